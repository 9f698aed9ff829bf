"""Files in and out: the only room that opens files or converts units."""

from cyclopean.io.drawings import drawing_dict, read_drawing
from cyclopean.io.files import json_text, write_json, write_text
from cyclopean.io.models import MESH_SUFFIXES, read_model, write_mesh, write_model
from cyclopean.io.results import result_dict
from cyclopean.io.sequences import sequence_dict
from cyclopean.io.stones import inventory_dict, read_stones, write_stones

__all__ = [
    "MESH_SUFFIXES",
    "drawing_dict",
    "inventory_dict",
    "json_text",
    "read_drawing",
    "read_model",
    "read_stones",
    "result_dict",
    "sequence_dict",
    "write_json",
    "write_mesh",
    "write_model",
    "write_stones",
    "write_text",
]
