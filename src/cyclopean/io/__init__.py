"""Files in and out: the only room that opens files or converts units."""

import typing

from cyclopean.io.files import json_text, together, write_json, write_text
from cyclopean.io.formats import MESH_SUFFIXES
from cyclopean.io.models import file_format, read_mended, read_model, write_mesh, write_model
from cyclopean.io.results import (
    interlock_dict,
    limit_dict,
    margins_dict,
    result_dict,
    sensitivity_dict,
    subsidence_dict,
)
from cyclopean.io.sequences import sequence_dict
from cyclopean.lazy_exports import lazy_exports as _lazy_exports

if typing.TYPE_CHECKING:
    from cyclopean.io.drawings import drawing_dict, read_drawing
    from cyclopean.io.dxf_drawing import dxf_text
    from cyclopean.io.exchange import exchange_paths, write_exchange
    from cyclopean.io.findings import read_findings
    from cyclopean.io.line_work import read_line_work
    from cyclopean.io.orders import read_order
    from cyclopean.io.stones import inventory_dict, read_stones, write_stones

__all__ = [
    "MESH_SUFFIXES",
    "drawing_dict",
    "dxf_text",
    "exchange_paths",
    "file_format",
    "interlock_dict",
    "inventory_dict",
    "json_text",
    "limit_dict",
    "margins_dict",
    "read_drawing",
    "read_findings",
    "read_line_work",
    "read_mended",
    "read_model",
    "read_order",
    "read_stones",
    "result_dict",
    "sensitivity_dict",
    "sequence_dict",
    "subsidence_dict",
    "together",
    "write_exchange",
    "write_json",
    "write_mesh",
    "write_model",
    "write_stones",
    "write_text",
]

# Only asked for by commands that design: what they load would double the start of `check`
__getattr__, __dir__ = _lazy_exports(
    __name__,
    {
        "drawings": "drawing_dict read_drawing",
        "dxf_drawing": "dxf_text",
        "exchange": "exchange_paths write_exchange",
        "findings": "read_findings",
        "line_work": "read_line_work",
        "orders": "read_order",
        "stones": "inventory_dict read_stones write_stones",
    },
)
