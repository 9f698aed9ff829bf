"""The model file `cyclopean.model/1`."""

from typing import Any

import numpy as np

from cyclopean.assembly import Assembly, Block, Contacts, Load
from cyclopean.errors import InputError
from cyclopean.io.fields import UnknownKeys, array, faces, found, label, mapping, number, points, text, vector
from cyclopean.io.units import check_units, metres

__all__ = ["SCHEMA", "model_dict", "read_document"]

SCHEMA = "cyclopean.model/1"

_MODEL = frozenset({"schema", "name", "units", "blocks", "contacts", "loads", "drawing"})
_BLOCK = frozenset({"id", "vertices", "faces", "density", "fixed", "group"})
_CONTACT = frozenset({"a", "b", "polygon", "mu"})
_LOAD = frozenset({"block", "force", "point"})


def read_document(path: str, stem: str, data: dict[str, Any], units: str | None) -> tuple[Assembly, tuple[str, ...]]:
    """Turn a parsed `cyclopean.model/1` document into an assembly.

    An optional field that is null counts as absent. Lengths are in the file's `units`; density is kg/m3 and force N
    whatever they are.

    Returns
    -------
    assembly : Assembly
        In SI units.
    warnings : tuple of str
        Unknown keys, and units that had to be assumed.

    Raises
    ------
    InputError
        The first thing that is wrong: file, block or contact or load, field, and what was expected.
    """
    unknown, warnings = UnknownKeys(), []
    unknown.note(data, _MODEL, "model", path)
    if "units" in data:
        given = check_units(text(data["units"], f"{path}: units"), f"{path}: units")
        if units is not None and units != given:
            raise InputError(f"{path}: says that its units are {given}; leave out --units {units}")
        units = given
    elif units is None:
        units = "m"
        warnings.append(f'{path}: says no "units"; metres assumed')
    name = stem if data.get("name") is None else text(data["name"], f"{path}: name")
    if "blocks" not in data:
        raise InputError(f'{path}: has no "blocks"')
    blocks = _blocks(path, array(data["blocks"], f"{path}: blocks"), units, unknown)
    index = {block.id: i for i, block in enumerate(blocks)}
    contacts = None
    if data.get("contacts") is not None:
        contacts = _contacts(path, array(data["contacts"], f"{path}: contacts"), index, units, unknown)
    loads = array([] if data.get("loads") is None else data["loads"], f"{path}: loads")
    placed = tuple(_load(f"{path}: load {k}", load, index, units, unknown) for k, load in enumerate(loads))
    return Assembly(tuple(blocks), contacts, placed, name), (*warnings, *unknown.warnings())


def _blocks(path: str, rows: list[Any], units: str, unknown: UnknownKeys) -> list[Block]:
    if not rows:
        raise InputError(f"{path}: has no blocks; a model needs at least one")
    blocks: list[Block] = []
    seen: dict[str, int] = {}
    for k, value in enumerate(rows):
        row = mapping(value, f"{path}: blocks[{k}]")
        if "id" not in row:
            raise InputError(f'{path}: blocks[{k}] has no "id"; give it one, as text')
        block_id = text(row["id"], f"{path}: blocks[{k}].id")
        where = f"{path}: block {label(block_id)}"
        if block_id in seen:
            raise InputError(
                f"{where}: the id stands twice, in blocks[{seen[block_id]}] and blocks[{k}]; make it unique"
            )
        seen[block_id] = k
        blocks.append(_block(where, block_id, row, units))
        unknown.note(row, _BLOCK, "block", where)
    return blocks


def _block(where: str, block_id: str, row: dict[str, Any], units: str) -> Block:
    for key in ("vertices", "faces"):
        if key not in row:
            raise InputError(f'{where}: has no "{key}"')
    vertices = points(row["vertices"], f"{where}: vertices")
    density = row.get("density")
    if density is not None and not number(density, f"{where}: density") > 0.0:
        raise InputError(f"{where}: density {density} must be a positive number of kg/m3")
    fixed = row.get("fixed")
    if fixed is not None and not isinstance(fixed, bool):
        raise InputError(f"{where}: fixed must be true or false, found {found(fixed)}")
    group = row.get("group")
    return Block(
        block_id,
        metres(vertices, units),
        faces(row["faces"], f"{where}: faces", len(vertices)),
        None if density is None else float(density),
        fixed,
        None if group is None else text(group, f"{where}: group"),
    )


def _known(where: str, key: str, row: dict[str, Any], index: dict[str, int]) -> int:
    if key not in row:
        raise InputError(f'{where}: has no "{key}"; name a block')
    name = text(row[key], f"{where}: {key}")
    if name not in index:
        raise InputError(f"{where}: {key} names block {label(name)}, which is not in the model")
    return index[name]


def _contacts(path: str, rows: list[Any], index: dict[str, int], units: str, unknown: UnknownKeys) -> Contacts:
    pairs, polygons, mus = [], [], []
    for k, value in enumerate(rows):
        where = f"{path}: contact {k}"
        row = mapping(value, where)
        a, b = _known(where, "a", row, index), _known(where, "b", row, index)
        where = f"{where} ({label(row['a'])} to {label(row['b'])})"
        if a == b:
            raise InputError(f"{where}: joins a block to itself; name two blocks")
        if "polygon" not in row:
            raise InputError(f'{where}: has no "polygon"')
        polygon = points(row["polygon"], f"{where}: polygon")
        if len(polygon) < 3:
            raise InputError(f"{where}: polygon has {len(polygon)} points; a contact needs at least 3")
        mu = None if row.get("mu") is None else number(row["mu"], f"{where}: mu")
        if mu is not None and not mu >= 0.0:
            raise InputError(f"{where}: mu {mu:g} must not be negative")
        unknown.note(row, _CONTACT, "contact", where)
        pairs.append((a, b))
        polygons.append(metres(polygon, units))
        mus.append(mu)
    return Contacts.of(pairs, polygons, mus)


def _load(where: str, value: Any, index: dict[str, int], units: str, unknown: UnknownKeys) -> Load:
    row = mapping(value, where)
    block = _known(where, "block", row, index)
    for key in ("force", "point"):
        if key not in row:
            raise InputError(f'{where}: has no "{key}"')
    force, point = vector(row["force"], f"{where}: force"), vector(row["point"], f"{where}: point")
    unknown.note(row, _LOAD, "load", where)
    return Load(block, force, metres(point, units))


def model_dict(
    assembly: Assembly, contacts: Contacts | None = None, drawing: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Return the assembly as a `cyclopean.model/1` document, in metres.

    `contacts` stand in for the assembly's own; where there are neither, the document leaves them to be detected.
    `drawing` says how the blocks were drawn, see `io.drawings`.
    """
    ids = [block.id for block in assembly.blocks]
    document: dict[str, Any] = {"schema": SCHEMA, "name": assembly.name, "units": "m"}
    document["blocks"] = [_block_dict(block) for block in assembly.blocks]
    joined = assembly.contacts if contacts is None else contacts
    if joined is not None:
        document["contacts"] = [
            {"a": ids[a], "b": ids[b], "polygon": joined.polygon(k).tolist()} | ({} if np.isnan(mu) else {"mu": mu})
            for k, (a, b, mu) in enumerate(zip(joined.a.tolist(), joined.b.tolist(), joined.mu.tolist(), strict=True))
        ]
    if assembly.loads:
        document["loads"] = [
            {"block": ids[load.block], "force": load.force.tolist(), "point": load.point.tolist()}
            for load in assembly.loads
        ]
    if drawing is not None:
        document["drawing"] = drawing
    return document


def _block_dict(block: Block) -> dict[str, Any]:
    row: dict[str, Any] = {"id": block.id, "vertices": block.vertices.tolist(), "faces": [list(f) for f in block.faces]}
    for key in ("density", "fixed", "group"):
        if (value := getattr(block, key)) is not None:
            row[key] = value
    return row
