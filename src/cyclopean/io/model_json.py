"""The model file `cyclopean.model/1`."""

from typing import Any

import numpy as np

from cyclopean.assembly import (
    DEAD,
    DIRECTIONS,
    Assembly,
    Block,
    BodyLoad,
    Combination,
    Contacts,
    FrictionPair,
    Load,
    Settlement,
    SurfaceLoad,
)
from cyclopean.errors import InputError
from cyclopean.io.fields import UnknownKeys, array, faces, found, label, mapping, number, points, text, vector
from cyclopean.io.units import check_units, metres

__all__ = ["SCHEMA", "model_dict", "read_document"]

SCHEMA = "cyclopean.model/1"

_MODEL = frozenset(
    {"schema", "name", "units", "blocks", "contacts", "loads", "drawing"}
    | {"supports", "friction", "combinations", "settlements"}
)
_BLOCK = frozenset({"id", "vertices", "faces", "density", "fixed", "group", "material"})
_CONTACT = frozenset({"a", "b", "polygon", "mu", "tension", "surface"})
_SURFACES = ("flat", "rough", "curved")
_LOADS = {  # by what says which kind of load it is
    "force": frozenset({"block", "force", "point", "case"}),
    "pressure": frozenset({"block", "pressure", "face", "polygon", "case"}),
    "traction": frozenset({"block", "traction", "face", "polygon", "case"}),
    "body": frozenset({"block", "group", "body", "case"}),
    "acceleration": frozenset({"block", "group", "acceleration", "case"}),
}


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
            raise InputError(f"{path}: says that its units are {given}; leave out `units` {units}")
        units = given
    elif units is None:
        units = "m"
        warnings.append(f'{path}: says no "units"; metres assumed')
    name = stem if data.get("name") is None else text(data["name"], f"{path}: name")
    if "blocks" not in data:
        raise InputError(f'{path}: has no "blocks"')
    held = _held(path, _rows(path, data, "supports"), unknown)
    blocks = _blocks(path, array(data["blocks"], f"{path}: blocks"), units, unknown, held)
    index = {block.id: i for i, block in enumerate(blocks)}
    contacts = None
    if data.get("contacts") is not None:
        contacts = _contacts(path, array(data["contacts"], f"{path}: contacts"), index, units, unknown)
    loads = [_load(f"{path}: load {k}", row, index, units, unknown) for k, row in enumerate(_rows(path, data, "loads"))]
    try:
        assembly = Assembly(
            tuple(blocks),
            contacts,
            tuple(load for load in loads if isinstance(load, Load)),
            name,
            tuple(load for load in loads if not isinstance(load, Load)),
            _combinations(path, _rows(path, data, "combinations"), unknown),
            _friction(path, _rows(path, data, "friction"), unknown),
            _settlements(path, _rows(path, data, "settlements"), index, units, unknown),
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return assembly, (*warnings, *unknown.warnings())


def _rows(path: str, data: dict[str, Any], key: str) -> list[dict[str, Any]]:
    """The objects of an optional list."""
    rows = array([] if data.get(key) is None else data[key], f"{path}: {key}")
    one = "load" if key == "loads" else key
    return [mapping(row, f"{path}: {one} {k}") for k, row in enumerate(rows)]


def _needed(where: str, row: dict[str, Any], *keys: str) -> None:
    for key in keys:
        if row.get(key) is None:
            raise InputError(f'{where}: has no "{key}"')


def _held(path: str, rows: list[dict[str, Any]], unknown: UnknownKeys) -> dict[str, tuple[str, ...]]:
    """What partial supports hold, by the id of the block."""
    found_here: dict[str, tuple[str, ...]] = {}
    for k, row in enumerate(rows):
        where = f"{path}: supports {k}"
        _needed(where, row, "block", "held")
        block_id = text(row["block"], f"{where}: block")
        if block_id in found_here:
            raise InputError(f"{where}: block {label(block_id)} stands twice; list all that is held in one row")
        names = [text(name, f"{where}: held[{m}]") for m, name in enumerate(array(row["held"], f"{where}: held"))]
        if not names or (wrong := [name for name in names if name not in DIRECTIONS]):
            what = f"'{wrong[0]}'" if names else "nothing"
            raise InputError(f"{where}: held names {what}; choose among {', '.join(DIRECTIONS)}")
        unknown.note(row, frozenset({"block", "held"}), "support", where)
        found_here[block_id] = tuple(names)
    return found_here


def _combinations(path: str, rows: list[dict[str, Any]], unknown: UnknownKeys) -> tuple[Combination, ...]:
    combined = []
    for k, row in enumerate(rows):
        where = f"{path}: combinations {k}"
        _needed(where, row, "name", "factors")
        factors = mapping(row["factors"], f"{where}: factors")
        read = tuple((case, number(value, f"{where}: factors {label(case)}")) for case, value in factors.items())
        unknown.note(row, frozenset({"name", "factors"}), "combination", where)
        combined.append(Combination(text(row["name"], f"{where}: name"), read))
    return tuple(combined)


def _friction(path: str, rows: list[dict[str, Any]], unknown: UnknownKeys) -> tuple[FrictionPair, ...]:
    pairs = []
    for k, row in enumerate(rows):
        where = f"{path}: friction {k}"
        _needed(where, row, "pair", "mu")
        pair = array(row["pair"], f"{where}: pair")
        if len(pair) != 2:
            raise InputError(f"{where}: pair must name two materials, found {len(pair)}")
        a, b = (text(name, f"{where}: pair[{m}]") for m, name in enumerate(pair))
        unknown.note(row, frozenset({"pair", "mu"}), "friction pair", where)
        pairs.append(FrictionPair(a, b, number(row["mu"], f"{where}: mu")))
    return tuple(pairs)


def _settlements(
    path: str, rows: list[dict[str, Any]], index: dict[str, int], units: str, unknown: UnknownKeys
) -> tuple[Settlement, ...]:
    settled = []
    for k, row in enumerate(rows):
        where = f"{path}: settlements {k}"
        block = _known(where, "block", row, index)
        _needed(where, row, "motion")
        motion = array(row["motion"], f"{where}: motion")
        if len(motion) != 6:
            raise InputError(f"{where}: motion must be [dx, dy, dz, rx, ry, rz], found {len(motion)} numbers")
        values = np.array([number(x, f"{where}: motion[{m}]") for m, x in enumerate(motion)])
        unknown.note(row, frozenset({"block", "motion"}), "settlement", where)
        settled.append(Settlement(block, np.concatenate([metres(values[:3], units), values[3:]])))
    return tuple(settled)


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
        unknown.note(row, _BLOCK, "block", where)
    if strange := [name for name in held if name not in seen]:
        raise InputError(f"{path}: supports: block {label(strange[0])} is not in the model")
    return blocks


def _block(where: str, block_id: str, row: dict[str, Any], units: str, held: tuple[str, ...]) -> Block:
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
    group, material = row.get("group"), row.get("material")
    return Block(
        block_id,
        metres(vertices, units),
        faces(row["faces"], f"{where}: faces", len(vertices)),
        None if density is None else float(density),
        fixed,
        None if group is None else text(group, f"{where}: group"),
        None if material is None else text(material, f"{where}: material"),
        held,
    )


def _known(where: str, key: str, row: dict[str, Any], index: dict[str, int]) -> int:
    if key not in row:
        raise InputError(f'{where}: has no "{key}"; name a block')
    name = text(row[key], f"{where}: {key}")
    if name not in index:
        raise InputError(f"{where}: {key} names block {label(name)}, which is not in the model")
    return index[name]


def _contacts(path: str, rows: list[Any], index: dict[str, int], units: str, unknown: UnknownKeys) -> Contacts:
    pairs, polygons, mus, pulls, leans = [], [], [], [], []
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
        pull = None if row.get("tension") is None else number(row["tension"], f"{where}: tension")
        if pull is not None and not pull >= 0.0:
            raise InputError(f"{where}: tension {pull:g} must not be negative")
        surface = "flat" if row.get("surface") is None else row["surface"]
        if surface not in _SURFACES:
            raise InputError(f"{where}: surface {label(surface)} is not one of {', '.join(_SURFACES)}")
        unknown.note(row, _CONTACT, "contact", where)
        pairs.append((a, b))
        polygons.append(metres(polygon, units))
        mus.append(mu)
        pulls.append(pull)
        leans.append(None if surface == "flat" else 0.0)  # how much is measured when the contacts are checked
    return Contacts.of(pairs, polygons, mus, pulls, leans)


def _load(
    where: str, row: dict[str, Any], index: dict[str, int], units: str, unknown: UnknownKeys
) -> Load | SurfaceLoad | BodyLoad:
    kinds = [key for key in _LOADS if row.get(key) is not None]
    if len(kinds) > 1:
        raise InputError(f'{where}: has both "{kinds[0]}" and "{kinds[1]}"; make two loads of it')
    if not kinds and "block" in row:
        _known(where, "block", row, index)
    if not kinds:
        raise InputError(f'{where}: has no "force"')
    kind = kinds[0]
    if kind not in ("body", "acceleration") or row.get("block") is not None:
        block: int | None = _known(where, "block", row, index)
    else:
        block = None
    value = number(row[kind], f"{where}: {kind}") if kind == "pressure" else vector(row[kind], f"{where}: {kind}")
    case = DEAD if row.get("case") is None else text(row["case"], f"{where}: case")
    unknown.note(row, _LOADS[kind], "load", where)
    try:
        if kind in ("body", "acceleration"):
            group = None if row.get("group") is None else text(row["group"], f"{where}: group")
            return BodyLoad(block, group, **{kind: value}, case=case)  # type: ignore[arg-type]
        assert block is not None
        if kind == "force":
            if row.get("point") is None:
                return BodyLoad(block, force=np.asarray(value), case=case)
            return Load(block, np.asarray(value), metres(vector(row["point"], f"{where}: point"), units), case)
        return _surface_load(where, row, block, kind, value, units, case)
    except InputError as error:
        raise InputError(str(error) if str(error).startswith(where) else f"{where}: {error}") from None


def _surface_load(
    where: str, row: dict[str, Any], block: int, kind: str, value: Any, units: str, case: str
) -> SurfaceLoad:
    face, polygon = row.get("face"), row.get("polygon")
    if face is not None and type(face) is not int:
        raise InputError(f"{where}: face must be a whole number, found {found(face)}")
    ring = None if polygon is None else metres(points(polygon, f"{where}: polygon"), units)
    return SurfaceLoad(block, face, ring, **{kind: value}, case=case)


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
            | ({} if np.isnan(lean) else {"surface": "rough"})
            for k, (a, b, mu, pull, lean) in enumerate(
                zip(
                    *(x.tolist() for x in (joined.a, joined.b, joined.mu, joined.strength_given, joined.leaning)),
                    strict=True,
                )
            )
        ]
    if assembly.loads or assembly.actions:
        document["loads"] = [
            {"block": ids[load.block], "force": load.force.tolist(), "point": load.point.tolist()} | _case(load.case)
            for load in assembly.loads
        ] + [_action_dict(load, ids) for load in assembly.actions]
    document |= {key: rows for key, rows in _sections(assembly, ids).items() if rows}
    if drawing is not None:
        document["drawing"] = drawing
    return document


def _case(case: str) -> dict[str, str]:
    return {} if case == DEAD else {"case": case}


def _action_dict(load: SurfaceLoad | BodyLoad, ids: list[str]) -> dict[str, Any]:
    """A load that is not at a point."""
    row: dict[str, Any] = {} if load.block is None else {"block": ids[load.block]}
    for key in ("group", "face", "polygon", "force", "pressure", "traction", "body", "acceleration"):
        if (value := getattr(load, key, None)) is not None:
            row[key] = value.tolist() if isinstance(value, np.ndarray) else value
    return row | _case(load.case)


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
    for key in ("density", "fixed", "group", "material"):
        if (value := getattr(block, key)) is not None:
            row[key] = value
    return row
