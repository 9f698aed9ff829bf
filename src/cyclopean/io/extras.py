"""Libraries that only an extra brings."""

import importlib
from typing import Any

from cyclopean.errors import InputError

__all__ = ["extra"]

_LIBRARY = {
    "dxf": ("DXF files need", "ezdxf"),
    "ifc": ("IFC files need", "ifcopenshell"),
    "pdf": ("PDF needs", "reportlab"),
    "rhino": ("3DM files need", "rhino3dm"),
}


def extra(name: str, part: str = "", where: str = "") -> Any:
    """The library of an extra, or a part of it; `where` begins the refusal.

    Raises
    ------
    InputError
        It is not installed.
    """
    what, library = _LIBRARY[name]
    try:
        return importlib.import_module(library + part)
    except ImportError:
        raise InputError(f"{where}{what} {library}: pip install 'cyclopean[{name}]'") from None
