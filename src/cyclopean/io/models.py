"""One door for every model file: what it is, is told by its suffix and its content."""

import os
from collections.abc import Iterable
from pathlib import PurePath
from typing import Any

import numpy as np

from cyclopean.assembly import Assembly, Contacts, MendedAssembly, mended
from cyclopean.errors import InputError
from cyclopean.io.bodies import assembly_of
from cyclopean.io.compas_json import is_dump, is_ours, read_compas, read_dump
from cyclopean.io.fields import label, parsed
from cyclopean.io.files import PathLike, decoded, one_line, read_bytes, write_bytes, write_json
from cyclopean.io.formats import FORMATS, MESH_SUFFIXES, loaded
from cyclopean.io.model_json import SCHEMA, model_dict, read_document
from cyclopean.io.round_trip import refuse_unwritable
from cyclopean.io.units import ASSUMED, LONG, check_units, likely_unit, stated_units

__all__ = ["file_format", "read_as_drawn", "read_json", "read_mended", "read_model", "write_mesh", "write_model"]


SIZES = 0.01, 100.0  # m: across; half of the blocks outside them is a slip of units


def read_model(path: PathLike, units: str | None = None, strict: bool = False) -> tuple[Assembly, tuple[str, ...]]:
    """Read a model, as `read_as_drawn` does, and mend blocks that are no closed, outward solids.

    Parameters
    ----------
    path : path
        The file.
    units : str, optional
        Unit of length of a file that does not say it: m, cm, mm, in or ft. Metres are assumed, with a warning.
    strict : bool
        Refuse a file of which a block has to be mended.

    Returns
    -------
    assembly : Assembly
        In SI units. Blocks that cannot be mended are as they came: a check refuses them.
    warnings : tuple of str
        What was assumed, ignored, dropped, renamed or mended; one line each.

    Raises
    ------
    InputError
        One line that names the file, the place in it and the remedy.
    """
    found, warnings = read_mended(path, units, strict)
    return found.assembly, (*warnings, *(f"{one_line(path)}: {line}" for line in found.said))


def read_mended(
    path: PathLike, units: str | None = None, strict: bool = False
) -> tuple[MendedAssembly, tuple[str, ...]]:
    """Read a model as `read_model` does, and tell block by block what was mended."""
    shown = one_line(path)
    assembly, warnings = read_as_drawn(path, units)
    try:
        found = mended(assembly)
    except InputError as error:
        raise InputError(f"{shown}: {error}") from None
    sizes = _suspicion(found.assembly, any(ASSUMED in line for line in warnings))
    return found.refused(shown) if strict else found, (*warnings, *(f"{shown}: {line}" for line in sizes))


def _suspicion(assembly: Assembly, unsaid: bool) -> tuple[str, ...]:
    """Name the unit that would make stones of what is too large or too small for stones."""
    size = float(np.median(assembly.mesh.diagonal)) if len(assembly) else 0.0
    if not size > 0.0 or SIZES[0] <= size <= SIZES[1]:
        return ()
    best = likely_unit(size, "m", SIZES) if unsaid else None
    guess = "check the units" if best is None else f"are these {LONG[best]}? (`units` {best})"
    return (f"half of the blocks are {'less' if size < SIZES[0] else 'more'} than {size:.3g} m across: {guess}",)


def read_as_drawn(path: PathLike, units: str | None = None) -> tuple[Assembly, tuple[str, ...]]:
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
        volume are not found here.
    """
    shown = one_line(path)
    if units is not None:
        check_units(units, "`units`")
    data = read_bytes(path)
    stem = PurePath(os.fspath(path)).stem
    stem = stem if stem.isprintable() and stem else "model"
    suffix = _kind(path, data)
    form = FORMATS.get(suffix)
    if form is None or not form.reads:
        known = _listed(other.suffix for other in FORMATS.values() if other.reads and "json" not in other.suffix)
        raise InputError(f"{shown}: '{one_line(suffix, 20)}' files cannot be read; use json, {known}")
    if form.reader:
        found: tuple[Assembly, tuple[str, ...]] = loaded(form.reader)(shown, stem, data, units)
        return found
    unit, assumed = stated_units(shown, "", units)
    assembly, warnings = assembly_of(shown, stem, loaded(form.bodies)(shown, data), unit)
    return assembly, (*warnings, *assumed)


def file_format(path: PathLike) -> str:
    """Name the format of a model file, as `read_model` takes it; an ending in capitals where it does not know it."""
    data = read_bytes(path)
    suffix = _kind(path, data)
    form = FORMATS.get(suffix)
    if form is None or not form.reads:
        return suffix[1:].upper()
    return "COMPAS JSON" if suffix == ".json" and SCHEMA.encode() not in data[:4096] else form.name.removesuffix("4")


def read_json(shown: str, stem: str, data: bytes, units: str | None) -> tuple[Assembly, tuple[str, ...]]:
    """Read a `cyclopean.model/1`, a COMPAS assembly or a dump of blocks and interfaces.

    Raises
    ------
    InputError
        It is none of these, or something in it is wrong.
    """
    document = parsed(shown, decoded(shown, data))
    if isinstance(document, dict) and "schema" in document:
        if document["schema"] == SCHEMA:
            return read_document(shown, stem, document, units)
        said = document["schema"]
        what = label(said) if isinstance(said, str) else "not text"
        raise InputError(f'{shown}: its schema is {what}; a model has "schema": "{SCHEMA}"')
    if not isinstance(document, dict | list):
        raise InputError(f'{shown}: is not a model: expected an object with "schema": "{SCHEMA}", or COMPAS JSON')
    unit, assumed = stated_units(shown, "m" if is_ours(document) else "", units)
    assembly, warnings = (read_dump if is_dump(document) else read_compas)(shown, stem, document, unit)
    return assembly, (*warnings, *assumed)


def _listed(suffixes: Iterable[str]) -> str:
    names = [suffix[1:] for suffix in sorted(suffixes)]
    return f"{', '.join(names[:-1])} or {names[-1]}"


def _kind(path: PathLike, data: bytes) -> str:
    """The suffix; where that says nothing, that of what the first bytes look like."""
    suffix = PurePath(os.fspath(path)).suffix.lower()
    if suffix not in ("", ".tmp", ".txt"):
        return suffix
    start = data[:64].lstrip(b"\xef\xbb\xbf \t\r\n")
    return next((form.suffix for form in FORMATS.values() if start.startswith(form.begins or (b"\0",))), suffix)


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
    if suffix in FORMATS and FORMATS[suffix].reads and suffix != ".json":
        raise InputError(f"{one_line(path)}: a model file ends in .json; use convert for other programs")
    write_json(path, model_dict(assembly, contacts, drawing))


def write_mesh(path: PathLike, assembly: Assembly) -> None:
    """Write OBJ, STL, PLY or GLB by the suffix, whole or not at all.

    Blocks keep their ids, in OBJ their groups too; GLB carries the rest of the model as well (`io.exchange` says what
    each format holds). GLB holds single precision, the others every digit.

    Raises
    ------
    InputError
        The place cannot be written, the suffix is not one of these, or a block has no faces or no name of one line.
    """
    suffix = PurePath(os.fspath(path)).suffix.lower()
    if suffix not in MESH_SUFFIXES:
        raise InputError(f"{one_line(path)}: '{one_line(suffix, 20)}' is not a mesh file; use {_listed(MESH_SUFFIXES)}")
    refuse_unwritable(one_line(path), assembly)
    write_bytes(path, FORMATS[suffix].written(assembly)[0])
