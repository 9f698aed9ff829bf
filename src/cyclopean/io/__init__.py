"""Files in and out: the only room that opens files or converts units."""

from cyclopean.io.files import json_text, write_json, write_text
from cyclopean.io.models import MESH_SUFFIXES, read_model, write_mesh, write_model
from cyclopean.io.results import result_dict
from cyclopean.io.sequences import sequence_dict

__all__ = [
    "MESH_SUFFIXES",
    "json_text",
    "read_model",
    "result_dict",
    "sequence_dict",
    "write_json",
    "write_mesh",
    "write_model",
    "write_text",
]
