"""One door for what goes out to other programs: which formats there are, what each holds, and what is lost in it."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import PurePath
from typing import Any

import numpy as np

from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.io.fields import label
from cyclopean.io.files import PathLike, json_text, one_line, together, write_bytes
from cyclopean.io.findings import Findings
from cyclopean.io.round_trip import refuse_unwritable

__all__ = ["FORMATS", "Format", "exchange_format", "exchange_paths", "write_exchange"]


@dataclass(frozen=True, slots=True)
class Format:
    """A format that models are written in, and what it holds of them."""

    suffix: str
    name: str
    holds: frozenset[str] | None  # kinds of `_KINDS` beside ids and shapes; None = all that a model says
    findings: bool  # forces, utilisation, lambda of a result
    shapes: bool = True  # blocks as solids
    reads: bool = True


FORMATS = {
    form.suffix: form
    for form in (
        Format(".json", "cyclopean.model/1", None, findings=False),
        Format(".compas.json", "COMPAS JSON", None, findings=True),
        Format(".3dm", "Rhino 3DM", None, findings=True),
        Format(".ifc", "IFC4", None, findings=True),
        Format(".glb", "GLB", None, findings=True),
        Format(".obj", "OBJ", frozenset({"group"}), findings=False),
        Format(".ply", "PLY", frozenset(), findings=False),
        Format(".stl", "STL", frozenset(), findings=False),
        Format(".3ddat", "3DEC", frozenset({"group", "density", "fixed"}), findings=False, reads=False),
        Format(
            ".csv",
            "CSV",
            frozenset({"group", "density", "fixed", "material", "contacts", "mu", "tension"}),
            findings=True,
            shapes=False,
            reads=False,
        ),
    )
}
_PLURAL = {"density": "densities", "fixed": "supports", "group": "groups", "mu": "friction of contacts"}
_PLURAL |= {"material": "materials", "held": "partial supports", "actions": "loads on faces and bodies"}


def exchange_format(path: PathLike, option: str = "OUT") -> Format:
    """Tell the format of a file that is to be written by its ending.

    Raises
    ------
    InputError
        The ending is not one of `FORMATS`.
    """
    name = PurePath(path).name.lower()
    for suffix in sorted(FORMATS, key=len, reverse=True):
        if name.endswith(suffix):
            return FORMATS[suffix]
    raise InputError(f"{option} {one_line(path)}: unknown ending; use {', '.join(FORMATS)}")


def exchange_paths(path: PathLike) -> tuple[PurePath, ...]:
    """Name the files that writing to `path` makes: two tables for CSV, else the file itself.

    Examples
    --------
    >>> [p.name for p in exchange_paths("wall.csv")], [p.name for p in exchange_paths("wall.ifc")]
    (['wall-blocks.csv', 'wall-contacts.csv'], ['wall.ifc'])
    """
    whole = PurePath(path)
    if exchange_format(path).suffix != ".csv":
        return (whole,)
    return tuple(whole.with_name(f"{whole.stem}-{kind}{whole.suffix}") for kind in ("blocks", "contacts"))


def write_exchange(
    path: PathLike,
    assembly: Assembly,
    findings: Findings | None = None,
    drawing: dict[str, Any] | None = None,
) -> tuple[str, ...]:
    """Write a model in the format that the ending says, whole or not at all.

    Parameters
    ----------
    path : path
        Its ending is one of `FORMATS`.
    assembly : Assembly
        The model.
    findings : Findings, optional
        What goes along where the format holds it.
    drawing : dict, optional
        How the wall was drawn (`drawing_dict`); only the project's own file holds it.

    Returns
    -------
    tuple of str
        What the file does not hold of all this, one line each.

    Raises
    ------
    InputError
        The place cannot be written, an extra is not installed, or a block cannot be written.
    """
    form = exchange_format(path)
    known = Findings() if findings is None else findings
    shown = one_line(path)
    if form.suffix != ".json" and form.shapes:
        refuse_unwritable(shown, assembly)
    places = exchange_paths(path)
    try:
        contents = _json(assembly, drawing) if form.suffix == ".json" else _WRITERS[form.suffix](assembly, known)
    except InputError as error:
        raise InputError(f"{shown}: {error}") from None
    with together():
        for place, content in zip(places, contents, strict=False):  # a model without contacts has no table of them
            write_bytes(place, content)
    name = PurePath(path).name
    lost = _lost(form, assembly, known)
    if drawing is not None and form.suffix != ".json":
        lost.append(f"{form.name} does not hold how the wall was drawn: dropped; match `negotiate` needs the .json")
    return tuple(f"{one_line(name)}: {line}" for line in lost)


def _lost(form: Format, assembly: Assembly, findings: Findings) -> list[str]:
    """Say what of the model the format does not hold, and in what it is less exact."""
    lines = []
    kinds = [] if form.holds is None else [kind for kind in _kinds(assembly) if kind not in form.holds]
    if kinds:
        names = ", ".join(_PLURAL.get(kind, kind.replace("_", " ")) for kind in kinds)
        lines.append(f"{form.name} holds no {names}: dropped")
    if findings and not form.findings:
        lines.append(f"{form.name} holds no results: dropped")
    if not form.shapes:
        lines.append(f"{form.name} holds tables, no shapes: it cannot be read back")
        if assembly.contacts is None:
            lines.append("the model lists no contacts, so there is no table of them; name a result with `result`")
    if form.suffix == ".stl" and any(block.id != block.id.strip() for block in assembly.blocks):
        lines.append(f"{form.name} holds no blanks at the ends of ids: dropped")
    if form.suffix == ".3ddat":
        from cyclopean.io.blocklist import not_convex

        if wrong := not_convex(assembly):
            more = f" and {len(wrong) - 1} more are" if len(wrong) > 1 else " is"
            lines.append(f"block {label(wrong[0])}{more} not convex, and 3DEC only takes convex ones")
    return lines


def _kinds(assembly: Assembly) -> list[str]:
    """What the model says beside ids and shapes, under the names of the fields that say it."""
    said = []
    for name in _names(Block, "id", "vertices", "faces"):
        said += [name] if any(getattr(block, name) not in (None, ()) for block in assembly.blocks) else []
    for name in _names(Assembly, "blocks", "name"):
        said += [] if getattr(assembly, name) in (None, ()) else [name]
    contacts = assembly.contacts
    if contacts is not None:
        for name in _names(type(contacts), "a", "b", "start", "point"):
            value = getattr(contacts, name)
            empty = value is None or (
                isinstance(value, np.ndarray) and value.dtype.kind == "f" and np.isnan(value).all()
            )
            said += [] if empty else [name]
    return said


def _names(kind: type, *passed: str) -> list[str]:
    return [item.name for item in fields(kind) if item.init and item.name not in passed]


def _json(assembly: Assembly, drawing: dict[str, Any] | None) -> list[bytes]:
    from cyclopean.io.model_json import model_dict

    return [json_text(model_dict(assembly, drawing=drawing)).encode()]


def _compas(assembly: Assembly, findings: Findings) -> list[bytes]:
    from cyclopean.io.compas_json import compas_dict

    return [json_text(compas_dict(assembly, findings)).encode()]


def _rhino(assembly: Assembly, findings: Findings) -> list[bytes]:
    from cyclopean.io.rhino import rhino_bytes

    return [rhino_bytes(assembly, findings)]


def _ifc(assembly: Assembly, findings: Findings) -> list[bytes]:
    from cyclopean.io.ifc import ifc_bytes

    return [ifc_bytes(assembly, findings)]


def _glb(assembly: Assembly, findings: Findings) -> list[bytes]:
    from cyclopean.io.glb import glb_bytes

    return [glb_bytes(assembly, findings)]


def _obj(assembly: Assembly, _: Findings) -> list[bytes]:
    from cyclopean.io.obj import obj_text

    return [obj_text(assembly).encode()]


def _ply(assembly: Assembly, _: Findings) -> list[bytes]:
    from cyclopean.io.ply import ply_bytes

    return [ply_bytes(assembly)]


def _stl(assembly: Assembly, _: Findings) -> list[bytes]:
    from cyclopean.io.stl import stl_text

    return [stl_text(assembly).encode()]


def _blocklist(assembly: Assembly, _: Findings) -> list[bytes]:
    from cyclopean.io.blocklist import blocklist_text

    return [blocklist_text(assembly).encode()]


def _tables(assembly: Assembly, findings: Findings) -> list[bytes]:
    from cyclopean.io.block_tables import blocks_csv, contacts_csv

    blocks = blocks_csv(assembly, findings).encode()
    return [blocks] if assembly.contacts is None else [blocks, contacts_csv(assembly, findings).encode()]


_WRITERS: dict[str, Callable[[Assembly, Findings], list[bytes]]] = {
    ".compas.json": _compas,
    ".3dm": _rhino,
    ".ifc": _ifc,
    ".glb": _glb,
    ".obj": _obj,
    ".ply": _ply,
    ".stl": _stl,
    ".3ddat": _blocklist,
    ".csv": _tables,
}
