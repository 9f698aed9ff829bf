"""What files of other programs carry of a model beside its shapes, in the names that the model file has for it.

Whatever `cyclopean.model/1` says of a block goes along under its own name, so that what this program learns tomorrow
is carried as well; reading back, the model document is put together again and read as every model file is. Where a file
holds text only, a value is written as JSON, and text as it is, unless it would be taken for JSON.

Polygons that a file has to cut into triangles, always the fan from the first corner, stand beside them as a record. It
counts only while it still bounds the same triangles: who edits the mesh in another program gets what he made.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.io.bodies import Body, welded_body
from cyclopean.io.fields import density, flag, found, label, optional
from cyclopean.io.findings import Findings
from cyclopean.io.model_json import SCHEMA, model_dict, read_document

__all__ = [
    "TOLD",
    "carried",
    "fan",
    "found_at",
    "model_rest",
    "polygons",
    "rebuilt",
    "record_of",
    "refuse_unwritable",
    "shaped",
    "shown",
    "stone_row",
    "told",
    "understood",
    "written_fields",
]

_SHAPE = frozenset({"id", "vertices", "faces"})
# what files tell of stones and contacts for people and scripts: results, which no reader takes for part of the model
TOLD = frozenset("volume lambda gap stone utilisation order course touches N T vertices".split())
# text even where it looks like a number
_TEXT = frozenset({"id", "group", "material", "a", "b", "block", "name", "stone", "case", "faces"})


def carried(assembly: Assembly) -> tuple[dict[str, Any], list[dict[str, Any]], list[dict[str, Any]]]:
    """Split the model document into what it says of the whole, of each block without its shape, and of each contact.

    Returns
    -------
    rest : dict
        Everything but blocks and contacts; `contacts` is True where the model lists them, if only an empty list.
    blocks, contacts : list of dict
        One row each, as in the model file; blocks without id, vertices and faces.
    """
    document = model_dict(assembly)
    rest = {key: value for key, value in document.items() if key not in ("blocks", "contacts")}
    if "contacts" in document:
        rest["contacts"] = True
    blocks = [{key: value for key, value in row.items() if key not in _SHAPE} for row in document["blocks"]]
    return rest, blocks, document.get("contacts", [])


def told(assembly: Assembly, findings: Findings) -> list[dict[str, Any]]:
    """What files tell of each block for people and scripts, and nobody reads back: its volume (m3) and the findings."""
    return [
        {"volume": volume} | dict(findings.block.get(block.id, {}))
        for block, volume in zip(assembly.blocks, assembly.mass.volume.tolist(), strict=True)
    ]


def model_rest(path: str, rest: Any) -> dict[str, Any]:
    """Return what a file carries of the whole model, without what the file itself says better.

    Raises
    ------
    InputError
        It is no object.
    """
    if not isinstance(rest, dict):
        raise InputError(f"{path}: what it carries of the model must be an object, found {found(rest)}")
    return {key: value for key, value in rest.items() if key not in ("blocks", "units", "schema", "findings")}


def rebuilt(
    path: str,
    stem: str,
    rest: Mapping[str, Any],
    blocks: list[dict[str, Any]],
    contacts: list[dict[str, Any]],
    units: str = "m",
) -> tuple[Assembly, tuple[str, ...]]:
    """Put a model document together again and read it; errors and warnings as `read_document`."""
    document = {**rest, "schema": SCHEMA, "units": units, "blocks": blocks}
    listed = document.pop("contacts", None) is True
    if contacts or listed:
        document["contacts"] = contacts
    return read_document(path, stem, document, None)


def shaped(said: Mapping[str, Any], vertices: Floats, faces: Sequence[Sequence[int]]) -> dict[str, Any]:
    """Row of the model document for a stone: what a file says of it, but for results, and its shape ((v, 3) m)."""
    row = {key: value for key, value in said.items() if key not in TOLD}
    return row | {"vertices": vertices.tolist(), "faces": [list(face) for face in faces]}


def stone_row(path: str, body: Body, said: Mapping[str, Any], record: Any) -> dict[str, Any]:
    """The same for a mesh that may have been made anew since, along its edges unjoined; `record` as in `polygons`."""
    faces = polygons(record, body.faces)
    if faces is None:
        body = welded_body(f"{path}: block {label(str(said['id']))}", body)
        faces = tuple(body.faces)
    return shaped(said, body.vertices, faces)


def found_at(findings: Findings, contact: int) -> dict[str, Any]:
    """What files tell of a contact of which forces are known: their normal resultant (N), and the share of friction."""
    if not findings.contact:
        return {}
    state = findings.contact[contact]
    return {"N": float(state.local[:, 0].sum()), "utilisation": state.utilisation}


def refuse_unwritable(path: str, assembly: Assembly) -> None:
    """Refuse what no file of shapes can hold.

    Raises
    ------
    InputError
        A block has no faces, or a name is empty or not of one line.
    """
    for block in assembly.blocks:
        if not block.faces:
            raise InputError(f"{path}: block {label(block.id)} has no faces to write")
        for name in (block.id, block.group):
            if name is not None and not (name and name.isprintable()):
                raise InputError(f"{path}: block {label(block.id)}: its id and group must be text of one line")


def shown(key: str, value: Any) -> str:
    """Write a value as text.

    Examples
    --------
    >>> shown("density", 2400.0), shown("fixed", True), shown("group", "12"), shown("note", "12")
    ('2400.0', 'true', '12', '"12"')
    """
    if isinstance(value, str) and value and understood(key, value) == value:
        return value
    return json.dumps(value, ensure_ascii=False)


def understood(key: str, text: str) -> Any:
    """Read such text again; what people type need not be quoted where only text can be meant.

    Examples
    --------
    >>> understood("density", "2400"), understood("fixed", "Yes"), understood("group", "12")
    (2400, True, '12')
    """
    if key == "fixed" and text.strip().lower() in _WORDS:
        return _WORDS[text.strip().lower()]
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return text
    return text if key in _TEXT and not isinstance(value, str) else value


_WORDS = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}


def written_fields(where: str, row: Mapping[str, Any]) -> dict[str, Any]:
    """Density, support and group, as far as a file that another program made gives them.

    Raises
    ------
    InputError
        One of them is not what it should be.
    """
    group = row.get("group")
    given = {
        "density": optional(row.get("density"), f"{where}: density", density),
        "fixed": optional(row.get("fixed"), f"{where}: fixed", flag),
        "group": group if isinstance(group, str) and group and group.isprintable() else None,
    }
    return {key: value for key, value in given.items() if value is not None}


def fan(face: Sequence[int]) -> list[tuple[int, int, int]]:
    """Triangles of a polygon, from its first corner."""
    return [(face[0], face[k], face[k + 1]) for k in range(1, len(face) - 1)]


def record_of(faces: Sequence[Sequence[int]], drawn: bool) -> dict[str, str]:
    """The record of the polygons of a block, unless all of them are `drawn` as they are."""
    return {} if drawn else {"faces": json.dumps(faces, separators=(",", ":"))}


def polygons(record: Any, drawn: Sequence[tuple[int, ...]]) -> tuple[tuple[int, ...], ...] | None:
    """Faces of a block that were recorded as JSON text, or None where they are not those that are drawn.

    Parameters
    ----------
    record : any
        What the file holds; text, unless it was tampered with.
    drawn : sequence of tuple of int
        Faces that the file draws in place of them.
    """
    try:
        rows = json.loads(record) if isinstance(record, str) else None
    except (ValueError, RecursionError):
        return None
    if not isinstance(rows, list) or not all(isinstance(row, list) and len(row) >= 3 for row in rows):
        return None
    if not all(type(i) is int for row in rows for i in row):
        return None
    faces = tuple(map(tuple, rows))
    same = [t for face in faces for t in fan(face)] == [t for face in drawn for t in fan(face)]
    return faces if same else None
