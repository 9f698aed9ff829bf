"""The model file `cyclopean.model/1`."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import (
    DEAD,
    DIRECTIONS,
    Action,
    Assembly,
    Block,
    BodyLoad,
    Combination,
    Contacts,
    Earth,
    Fill,
    FrictionPair,
    Load,
    Settlement,
    SurfaceLoad,
    Water,
)
from cyclopean.assembly.contacts import UNIT
from cyclopean.assembly.field_loads import FieldLoad
from cyclopean.errors import InputError
from cyclopean.io.fields import (
    UnknownKeys,
    array,
    density,
    faces,
    flag,
    found,
    label,
    mapping,
    not_negative,
    number,
    optional,
    points,
    text,
    vector,
)
from cyclopean.io.units import ASSUMED, check_units, metres, stated_units

__all__ = ["SCHEMA", "model_dict", "read_document"]

SCHEMA = "cyclopean.model/1"

_MODEL = frozenset(
    {"schema", "name", "units", "blocks", "contacts", "loads", "drawing"}
    | {"supports", "friction", "combinations", "settlements"}
)
_BLOCK = ("density", "fixed", "group", "material")
_CONTACT = frozenset({"a", "b", "polygon", "mu", "tension", "surface", "normal"})
_SURFACES = ("flat", "rough", "curved", "point")
_SECTIONS = {  # what a row of them is called, and what it says
    "supports": ("support", ("block", "held")),
    "combinations": ("combination", ("name", "factors")),
    "friction": ("friction pair", ("pair", "mu")),
    "settlements": ("settlement", ("block", "motion")),
}
_FIELDS: dict[str, type[FieldLoad]] = {"soil": Earth, "water": Water, "fill": Fill}
_PLACE = ("block", "group", "case")  # of every load: in a row of earth, water or fill they stand beside its key
_LOADS: dict[str, tuple[Any, tuple[str, ...]]] = {  # by what says which kind of load it is: what it becomes, and beside
    "force": (Load, ("point",)),
    "pressure": (SurfaceLoad, ("face", "polygon")),
    "traction": (SurfaceLoad, ("face", "polygon")),
    "body": (BodyLoad, ("group",)),
    "acceleration": (BodyLoad, ("group",)),
} | {key: (made, ("group",)) for key, made in _FIELDS.items()}


def _whole(value: Any, where: str) -> int:
    if type(value) is not int:
        raise InputError(f"{where} must be a whole number, found {found(value)}")
    return value


def _pair(value: Any, where: str) -> tuple[float, ...]:
    numbers = tuple(number(one, f"{where}[{k}]") for k, one in enumerate(array(value, where)))
    if len(numbers) != 2:
        raise InputError(f"{where} must be [horizontal, vertical], found {len(numbers)} numbers")
    return numbers


def _number_or_word(value: Any, where: str) -> float | str:
    return value if isinstance(value, str) else number(value, where)


_READERS: defaultdict[str, Callable[[Any, str], Any]] = defaultdict(lambda: number)
_READERS |= {  # of what is no plain number
    **dict.fromkeys(("case", "group", "material", "state", "uplift"), text),
    **dict.fromkeys(("force", "point", "traction", "body", "acceleration"), vector),
    **dict.fromkeys(("mu", "tension"), not_negative),
    "density": density, "fixed": flag, "face": _whole, "polygon": points, "seismic": _pair, "spread": _number_or_word,
}  # fmt: skip
_LENGTHS = frozenset({"point", "polygon", "height", "head", "foot"})


def _said(row: dict[str, Any], keys: Iterable[str], where: str, units: str) -> dict[str, Any]:
    """What a row says under these keys, lengths in metres; what is null is absent."""
    said = {key: _READERS[key](row[key], f"{where}: {key}") for key in keys if row.get(key) is not None}
    return {key: metres(value, units) if key in _LENGTHS else value for key, value in said.items()}


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
    unknown = UnknownKeys()
    unknown.note(data, _MODEL, "model", path)
    said = check_units(text(data["units"], f"{path}: units"), f"{path}: units") if "units" in data else ""
    units, assumed = stated_units(path, said, units)
    warnings = [f'{path}: says no "units"; {ASSUMED}'] if assumed else []
    name = optional(data.get("name"), f"{path}: name", text) or stem
    if "blocks" not in data:
        raise InputError(f'{path}: has no "blocks"')
    held = _held(path, data, unknown)
    blocks = _blocks(path, array(data["blocks"], f"{path}: blocks"), units, unknown, held)
    index = {block.id: i for i, block in enumerate(blocks)}
    contacts = None
    if data.get("contacts") is not None:
        contacts = _contacts(_rows(path, data, "contacts", "contact"), index, units, unknown)
    loads = [_load(*found, index, units, unknown) for found in _rows(path, data, "loads", "load")]
    try:
        assembly = Assembly(
            tuple(blocks),
            contacts,
            tuple(load for load in loads if isinstance(load, Load)),
            name,
            tuple(load for load in loads if not isinstance(load, Load)),
            tuple(_combination(*found) for found in _section(path, data, "combinations", unknown)),
            tuple(_friction(*found) for found in _section(path, data, "friction", unknown)),
            tuple(_settlement(*found, index, units) for found in _section(path, data, "settlements", unknown)),
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return assembly, (*warnings, *unknown.warnings())


def _rows(path: str, data: dict[str, Any], key: str, one: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Place and object of each row of an optional list."""
    for k, row in enumerate(optional(data.get(key), f"{path}: {key}", array) or []):
        yield f"{path}: {one} {k}", mapping(row, f"{path}: {one} {k}")


def _section(path: str, data: dict[str, Any], key: str, unknown: UnknownKeys) -> Iterator[tuple[str, dict[str, Any]]]:
    """Place and object of each row of a list, all of whose keys are needed."""
    kind, needed = _SECTIONS[key]
    for where, row in _rows(path, data, key, key):
        for name in needed:
            if row.get(name) is None:
                raise InputError(f'{where}: has no "{name}"')
        unknown.note(row, frozenset(needed), kind, where)
        yield where, row


def _held(path: str, data: dict[str, Any], unknown: UnknownKeys) -> dict[str, tuple[str, ...]]:
    """What partial supports hold, by the id of the block."""
    found_here: dict[str, tuple[str, ...]] = {}
    for where, row in _section(path, data, "supports", unknown):
        block_id = text(row["block"], f"{where}: block")
        if block_id in found_here:
            raise InputError(f"{where}: block {label(block_id)} stands twice; list all that is held in one row")
        names = _texts(row["held"], f"{where}: held")
        if not names or (wrong := [name for name in names if name not in DIRECTIONS]):
            what = f"'{wrong[0]}'" if names else "nothing"
            raise InputError(f"{where}: held names {what}; choose among {', '.join(DIRECTIONS)}")
        found_here[block_id] = names
    return found_here


def _texts(value: Any, where: str) -> tuple[str, ...]:
    return tuple(text(name, f"{where}[{m}]") for m, name in enumerate(array(value, where)))


def _combination(where: str, row: dict[str, Any]) -> Combination:
    factors = mapping(row["factors"], f"{where}: factors")
    read = tuple((case, number(value, f"{where}: factors {label(case)}")) for case, value in factors.items())
    return Combination(text(row["name"], f"{where}: name"), read)


def _friction(where: str, row: dict[str, Any]) -> FrictionPair:
    pair = array(row["pair"], f"{where}: pair")
    if len(pair) != 2:
        raise InputError(f"{where}: pair must name two materials, found {len(pair)}")
    a, b = _texts(pair, f"{where}: pair")
    return FrictionPair(a, b, number(row["mu"], f"{where}: mu"))


def _settlement(where: str, row: dict[str, Any], index: dict[str, int], units: str) -> Settlement:
    block, motion = _known(where, "block", row, index), array(row["motion"], f"{where}: motion")
    if len(motion) != 6:
        raise InputError(f"{where}: motion must be [dx, dy, dz, rx, ry, rz], found {len(motion)} numbers")
    values = np.array([number(x, f"{where}: motion[{m}]") for m, x in enumerate(motion)])
    return Settlement(block, np.concatenate([metres(values[:3], units), values[3:]]))


def _blocks(
    path: str, rows: list[Any], units: str, unknown: UnknownKeys, held: dict[str, tuple[str, ...]]
) -> list[Block]:
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
        blocks.append(_block(where, block_id, row, units, held.get(block_id, ())))
        unknown.note(row, frozenset({"id", "vertices", "faces", *_BLOCK}), "block", where)
    if strange := [name for name in held if name not in seen]:
        raise InputError(f"{path}: supports: block {label(strange[0])} is not in the model")
    return blocks


def _block(where: str, block_id: str, row: dict[str, Any], units: str, held: tuple[str, ...]) -> Block:
    for key in ("vertices", "faces"):
        if key not in row:
            raise InputError(f'{where}: has no "{key}"')
    vertices = points(row["vertices"], f"{where}: vertices")
    said = _said(row, _BLOCK, where, units)
    corners = faces(row["faces"], f"{where}: faces", len(vertices))
    return Block(block_id, metres(vertices, units), corners, held=held, **said)


def _known(where: str, key: str, row: dict[str, Any], index: dict[str, int]) -> int:
    if key not in row:
        raise InputError(f'{where}: has no "{key}"; name a block')
    name = text(row[key], f"{where}: {key}")
    if name not in index:
        raise InputError(f"{where}: {key} names block {label(name)}, which is not in the model")
    return index[name]


def _contacts(
    rows: Iterable[tuple[str, dict[str, Any]]], index: dict[str, int], units: str, unknown: UnknownKeys
) -> Contacts:
    pairs, polygons, mus, pulls, leans, facing = [], [], [], [], [], []
    for place, row in rows:
        a, b = _known(place, "a", row, index), _known(place, "b", row, index)
        where = f"{place} ({label(row['a'])} to {label(row['b'])})"
        if a == b:
            raise InputError(f"{where}: joins a block to itself; name two blocks")
        if "polygon" not in row:
            raise InputError(f'{where}: has no "polygon"')
        polygon = points(row["polygon"], f"{where}: polygon")
        said = _said(row, ("mu", "tension"), where, units)
        surface = "flat" if row.get("surface") is None else row["surface"]
        if surface not in _SURFACES:
            raise InputError(f"{where}: surface {label(surface)} is not one of {', '.join(_SURFACES)}")
        facing.append(_normal(row, where) if surface == "point" else None)
        if len(polygon) < 3 and surface != "point":
            raise InputError(f"{where}: polygon has {len(polygon)} points; a contact needs at least 3")
        if len(polygon) != 1 and surface == "point":
            raise InputError(f"{where}: polygon has {len(polygon)} points; a contact at a point has 1, and a normal")
        if said.get("tension") and surface == "point":
            raise InputError(f"{where}: a point has no area to pull with; leave its tension out")
        unknown.note(row, _CONTACT, "contact", where)
        pairs.append((a, b))
        polygons.append(metres(polygon, units))
        mus.append(said.get("mu"))
        pulls.append(said.get("tension"))
        leans.append(0.0 if surface in ("rough", "curved") else None)  # how much is measured when they are checked
    return Contacts.of(pairs, polygons, mus, pulls, leans, facing)


def _normal(row: dict[str, Any], where: str) -> Floats:
    """(3,) unit normal of a contact at a point."""
    if "normal" not in row:
        raise InputError(f'{where}: has no "normal"; a contact at a point needs one, from its block a into its block b')
    normal = points([row["normal"]], f"{where}: normal")[0]
    length = float(np.linalg.norm(normal))
    if not length > 0.0:
        raise InputError(f"{where}: normal has no length")
    return np.asarray(normal if abs(length - 1.0) <= UNIT else normal / length)


def _load(where: str, row: dict[str, Any], index: dict[str, int], units: str, unknown: UnknownKeys) -> Load | Action:
    kinds = [key for key in _LOADS if row.get(key) is not None]
    if len(kinds) > 1:
        raise InputError(f'{where}: has both "{kinds[0]}" and "{kinds[1]}"; make two loads of it')
    if not kinds and "block" in row:
        _known(where, "block", row, index)
    if not kinds:
        raise InputError(f'{where}: has no "force"')
    kind = kinds[0]
    made, beside = _LOADS[kind]
    anywhere = "group" in beside and row.get("block") is None
    place: dict[str, Any] = {} if anywhere else {"block": _known(where, "block", row, index)}
    unknown.note(row, frozenset({"block", kind, "case", *beside}), "load", where)
    try:
        if kind in _FIELDS:
            place |= _said(row, _PLACE[1:], where, units)
            return _field(f"{where}: {kind}", kind, row[kind], units, unknown, place)
        said = _said(row, ("case", kind, *beside), where, units)
        made = BodyLoad if kind == "force" and "point" not in said else made
        load: Load | Action = made(**place, **said)
    except InputError as error:
        raise InputError(str(error) if str(error).startswith(where) else f"{where}: {error}") from None
    return load


def _field(where: str, kind: str, value: Any, units: str, unknown: UnknownKeys, place: dict[str, Any]) -> FieldLoad:
    """Earth, water or fill from what stands under its key."""
    row, made = mapping(value, where), _LOADS[kind][0]
    own = {one.name: one for one in fields(made) if one.name not in _PLACE}
    unknown.note(row, frozenset(own), kind, where)
    for name, one in own.items():
        if one.default is MISSING and row.get(name) is None:
            raise InputError(f'{where}: has no "{name}"')
    load: FieldLoad = made(**_said(row, own, where, units), **place)
    return load


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
            {"a": ids[a], "b": ids[b], "polygon": joined.polygon(k).tolist()}
            | ({} if np.isnan(mu) else {"mu": mu})
            | ({} if np.isnan(pull) else {"tension": pull})
            | joined.surface(k)
            for k, (a, b, mu, pull) in enumerate(
                zip(*(x.tolist() for x in (joined.a, joined.b, joined.mu, joined.strength_given)), strict=True)
            )
        ]
    if assembly.loads or assembly.actions:
        document["loads"] = [_load_dict(load, ids) for load in (*assembly.loads, *assembly.actions)]
    document |= {key: rows for key, rows in _sections(assembly, ids).items() if rows}
    if drawing is not None:
        document["drawing"] = drawing
    return document


def _load_dict(load: Load | Action, ids: list[str]) -> dict[str, Any]:
    row: dict[str, Any] = {} if load.block is None else {"block": ids[load.block]}
    for key in ("group", "face", "polygon", "force", "point", "pressure", "traction", "body", "acceleration"):
        if (value := getattr(load, key, None)) is not None:
            row[key] = value.tolist() if isinstance(value, np.ndarray) else value
    if isinstance(load, FieldLoad):
        kind = next(key for key, made in _FIELDS.items() if isinstance(load, made))
        own = [(one.name, getattr(load, one.name), one.default) for one in fields(load) if one.name not in _PLACE]
        row[kind] = {name: value for name, value, default in own if value != default}
    return row if load.case == DEAD else row | {"case": load.case}


def _sections(assembly: Assembly, ids: list[str]) -> dict[str, list[dict[str, Any]]]:
    """What a model may say beside blocks, contacts and loads."""
    return {
        "supports": [{"block": block.id, "held": list(block.held)} for block in assembly.blocks if block.held],
        "friction": [{"pair": [one.a, one.b], "mu": one.mu} for one in assembly.friction],
        "combinations": [{"name": one.name, "factors": dict(one.factors)} for one in assembly.combinations],
        "settlements": [{"block": ids[one.block], "motion": one.motion.tolist()} for one in assembly.settlements],
    }


def _block_dict(block: Block) -> dict[str, Any]:
    row: dict[str, Any] = {"id": block.id, "vertices": block.vertices.tolist(), "faces": [list(f) for f in block.faces]}
    for key in _BLOCK:
        if (value := getattr(block, key)) is not None:
            row[key] = value
    return row
