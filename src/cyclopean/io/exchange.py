"""One door for what goes out to other programs, which says what is lost in it."""

from dataclasses import fields
from pathlib import PurePath
from typing import Any

import numpy as np

from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.io.fields import label
from cyclopean.io.files import PathLike, json_text, one_line, together, write_bytes
from cyclopean.io.findings import Findings
from cyclopean.io.formats import Format, exchange_format
from cyclopean.io.model_json import model_dict
from cyclopean.io.round_trip import refuse_unwritable

__all__ = ["exchange_paths", "write_exchange"]

_PLURAL = {
    "density": "densities",
    "fixed": "supports",
    "group": "groups",
    "mu": "friction of contacts",
    "material": "materials",
    "held": "partial supports",
    "actions": "loads on faces and bodies",
    "facing": "points for contacts",
}


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
        Its ending is one of `formats.FORMATS`.
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
        if form.suffix == ".json":
            contents = [json_text(model_dict(assembly, drawing=drawing)).encode()]
        else:
            contents = form.written(assembly, known)
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
            said += [] if np.isnan(getattr(contacts, name)).all() else [name]
    return said


def _names(kind: type, *passed: str) -> list[str]:
    return [item.name for item in fields(kind) if item.init and item.name not in passed]
