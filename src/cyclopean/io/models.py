"""One door for every model file: what it is, is told by its suffix and its content."""

import os
from collections.abc import Callable, Iterable
from pathlib import PurePath
from typing import Any

from cyclopean.assembly import Assembly, Contacts
from cyclopean.errors import InputError
from cyclopean.io.bodies import Body, assembly_of
from cyclopean.io.compas_json import is_compas, is_dump, is_ours, read_compas, read_dump
from cyclopean.io.fields import label, parsed
from cyclopean.io.files import PathLike, decoded, one_line, read_bytes, write_bytes, write_json
from cyclopean.io.glb import glb_bytes, read_glb_model
from cyclopean.io.model_json import SCHEMA, model_dict, read_document
from cyclopean.io.obj import obj_text, read_obj
from cyclopean.io.ply import ply_bytes, read_ply
from cyclopean.io.stl import read_stl, stl_text
from cyclopean.io.units import check_units

__all__ = ["MESH_SUFFIXES", "file_format", "read_model", "write_mesh", "write_model"]

_READERS: dict[str, Callable[[str, bytes], list[Body]]] = {
    ".obj": read_obj,
    ".ply": read_ply,
    ".stl": read_stl,
}
_WRITERS: dict[str, Callable[[Assembly], bytes]] = {
    ".glb": glb_bytes,
    ".obj": lambda assembly: obj_text(assembly).encode(),
    ".ply": ply_bytes,
    ".stl": lambda assembly: stl_text(assembly).encode(),
}
MESH_SUFFIXES = tuple(sorted(_WRITERS))
_KNOWN = frozenset({".json", ".3dm", ".ifc", *MESH_SUFFIXES})  # what is read


def read_model(path: PathLike, units: str | None = None) -> tuple[Assembly, tuple[str, ...]]:
    """Read a model: `cyclopean.model/1`, COMPAS JSON, OBJ, STL, PLY, GLB, Rhino 3DM or IFC.

    Parameters
    ----------
    path : path
        The file. Its suffix says what it is; where that is unknown, its first bytes do.
    units : str, optional
        Unit of length of a file that does not say it: m, cm, mm, in or ft. Metres are assumed, with a warning.

    Returns
    -------
    assembly : Assembly
        In SI units.
    warnings : tuple of str
        What was assumed, ignored, dropped or renamed; one line each.

    Raises
    ------
    InputError
        One line that names the file, the place in it and the remedy. Meshes that are open, inside out or of no
        volume are not found here: a check does that.
    """
    shown = one_line(path)
    if units is not None:
        check_units(units, "`units`")
    data = read_bytes(path)
    stem = _stem(path)
    suffix = _kind(path, data)
    if suffix in _READERS:
        assembly, warnings = assembly_of(shown, stem, _READERS[suffix](shown, data), units or "m")
        return assembly, (*warnings, *_assumed(shown, units))
    if suffix == ".glb":  # in metres, always
        return read_glb_model(shown, stem, data)
    if suffix == ".3dm":
        from cyclopean.io.rhino import read_rhino

        return read_rhino(shown, stem, data, units)
    if suffix == ".ifc":
        from cyclopean.io.ifc import read_ifc

        return read_ifc(shown, stem, data, units)
    if suffix != ".json":
        raise InputError(
            f"{shown}: '{one_line(suffix, 20)}' files cannot be read; use json, {_listed(_KNOWN - {'.json'})}"
        )
    return _read_json(shown, stem, data, units)


def file_format(path: PathLike) -> str:
    """Name the format of a model file, as `read_model` takes it; an ending in capitals where it does not know it."""
    data = read_bytes(path)
    suffix = _kind(path, data)
    if suffix == ".json":
        return SCHEMA if SCHEMA.encode() in data[:4096] else "COMPAS JSON"
    return {".3dm": "Rhino 3DM", ".ifc": "IFC"}.get(suffix, suffix[1:].upper())


def _read_json(shown: str, stem: str, data: bytes, units: str | None) -> tuple[Assembly, tuple[str, ...]]:
    document = parsed(shown, decoded(shown, data))
    if isinstance(document, dict) and "schema" in document:
        if document["schema"] == SCHEMA:
            return read_document(shown, stem, document, units)
        said = document["schema"]
        what = label(said) if isinstance(said, str) else "not text"
        raise InputError(f'{shown}: its schema is {what}; a model has "schema": "{SCHEMA}"')
    if is_dump(document):
        assembly, warnings = read_dump(shown, stem, document, units or "m")
    elif is_compas(document):
        if is_ours(document):
            if units not in (None, "m"):
                raise InputError(f"{shown}: says that its units are m; leave out `units` {units}")
            units = "m"
        assembly, warnings = read_compas(shown, stem, document, units or "m")
    else:
        raise InputError(f'{shown}: is not a model: expected an object with "schema": "{SCHEMA}", or a COMPAS assembly')
    return assembly, (*warnings, *_assumed(shown, units))


def _assumed(shown: str, units: str | None) -> tuple[str, ...]:
    return () if units is not None else (f"{shown}: does not say its units; metres assumed (`units`)",)


def _listed(suffixes: Iterable[str]) -> str:
    names = [suffix[1:] for suffix in sorted(suffixes)]
    return f"{', '.join(names[:-1])} or {names[-1]}"


def _stem(path: PathLike) -> str:
    stem = PurePath(os.fspath(path)).stem
    return stem if stem.isprintable() and stem else "model"


def _kind(path: PathLike, data: bytes) -> str:
    """The suffix where it is known; else what the first bytes look like."""
    suffix = PurePath(os.fspath(path)).suffix.lower()
    if suffix in _KNOWN:
        return suffix
    start = data[:64].lstrip(b"\xef\xbb\xbf \t\r\n")
    looks = {b"{": ".json", b"[": ".json", b"glTF": ".glb", b"ply": ".ply", b"solid": ".stl"}
    looks |= {b"3D Geometry File Format": ".3dm", b"ISO-10303-21": ".ifc"}
    if suffix in ("", ".tmp", ".txt"):
        return next((kind for first, kind in looks.items() if start.startswith(first)), suffix)
    return suffix


def write_model(
    path: PathLike, assembly: Assembly, contacts: Contacts | None = None, drawing: dict[str, Any] | None = None
) -> None:
    """Write `cyclopean.model/1` in metres, whole or not at all; reading it back gives the same numbers.

    Parameters
    ----------
    path : path
        A file that ends in .json.
    assembly : Assembly
        The model.
    contacts : Contacts, optional
        Take the place of the assembly's own.
    drawing : dict, optional
        How the blocks were drawn, from `drawing_dict`.

    Raises
    ------
    InputError
        The place cannot be written, or the suffix is that of a mesh file.
    """
    suffix = PurePath(os.fspath(path)).suffix.lower()
    if suffix in MESH_SUFFIXES:
        raise InputError(f"{one_line(path)}: a model file ends in .json; a mesh holds no contacts (use convert)")
    if suffix in _KNOWN - {".json"}:
        raise InputError(f"{one_line(path)}: a model file ends in .json; use convert for other programs")
    write_json(path, model_dict(assembly, contacts, drawing))


def write_mesh(path: PathLike, assembly: Assembly) -> None:
    """Write OBJ, STL, PLY or GLB by the suffix, whole or not at all.

    Blocks keep their ids, in OBJ their groups too; GLB carries the rest of the model as well (`io.exchange` says what
    each format holds). GLB holds single precision, the others every digit.

    Raises
    ------
    InputError
        The place cannot be written, the suffix is not one of these, or a block has no faces.
    """
    suffix = PurePath(os.fspath(path)).suffix.lower()
    if suffix not in _WRITERS:
        raise InputError(f"{one_line(path)}: '{one_line(suffix, 20)}' is not a mesh file; use {_listed(MESH_SUFFIXES)}")
    for block in assembly.blocks:
        if not block.faces:
            raise InputError(f"{one_line(path)}: block {label(block.id)} has no faces to write")
    write_bytes(path, _WRITERS[suffix](assembly))
