"""What a result, a match, a carving or a sequence says of the stones of a model, to go along into other programs.

These files name blocks by id and contacts by order, so a file of another model is found out and refused.
"""

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cyclopean.arrays import Floats, sealed
from cyclopean.assembly import Assembly, Contacts
from cyclopean.errors import InputError
from cyclopean.io.fields import array, found, label, mapping, number, points, read_json, text
from cyclopean.io.files import PathLike, one_line

__all__ = ["ContactState", "Findings", "ForceRow", "force_rows", "listed", "read_findings"]

_RESULT, _SEQUENCE, _INFO = "cyclopean.result/1", "cyclopean.sequence/1", "cyclopean.info/1"
_PLACED = {  # schema: where its rows stand, which key names the block, which keys are told of it
    "cyclopean.match/1": ("placements", "cell", ("stone", "lambda", "gap")),
    "cyclopean.carving/1": ("stones", "cell", ("stone", "lambda", "gap")),
    "cyclopean.settle/1": ("placements", "stone", ("course",)),
}

_MARGINS = {  # of a result: with how much of its friction, and of its joints' size, it stands, and up to which tilt
    "friction share": ("margins", "friction", "stands"),
    "joint share": ("margins", "joints", "stands"),
    "tilt degrees": ("margins", "tilt", "stands"),
}


@dataclass(frozen=True, slots=True, eq=False)
class ContactState:
    """Forces at the corners of one contact, as a result has them."""

    point: Floats  # (m, 3) m
    local: Floats  # (m, 3) N: fn, fu, fv on block b
    frame: Floats  # (3, 3) rows n, u, v; n from a into b
    utilisation: float | None  # share of the friction that is used

    def __post_init__(self) -> None:
        for name, *shape in (("point", None, 3), ("local", len(self.point), 3), ("frame", 3, 3)):
            object.__setattr__(self, name, sealed(f"contact state {name}", getattr(self, name), *shape))

    @property
    def force(self) -> Floats:
        """(m, 3) N, world, on block b."""
        return np.asarray(self.local @ self.frame)


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """What was found out about a model; empty where nothing was asked for."""

    model: Mapping[str, str | float] = field(default_factory=dict)  # verdict, method, margins, Lambda, gap, J
    block: Mapping[str, Mapping[str, float | int | str]] = field(default_factory=dict)  # by id: lambda, utilisation ...
    contact: tuple[ContactState, ...] = ()  # one a contact of the assembly, or none at all

    def __bool__(self) -> bool:
        return bool(self.model or self.block or self.contact)


def read_findings(paths: Iterable[PathLike], assembly: Assembly) -> tuple[Assembly, Findings, tuple[str, ...]]:
    """Read what result, match, carving, settling or sequence files say of a model.

    Parameters
    ----------
    paths : iterable of path
        The files; where two say the same thing of a block, the later one counts.
    assembly : Assembly
        The model that they are of.

    Returns
    -------
    assembly : Assembly
        The same; where it lists no contacts, with those that the result found.
    findings : Findings
        What the files say.
    warnings : tuple of str
        What they do not say, one line each.

    Raises
    ------
    InputError
        One cannot be read, is of another kind, or of another model.
    """
    whole = Findings()
    lines: list[str] = []
    for path in paths:
        assembly, said, warnings = _read(path, assembly)
        blocks = dict(whole.block)
        for name, row in said.block.items():
            blocks[name] = {**blocks.get(name, {}), **row}
        whole = Findings({**whole.model, **said.model}, blocks, said.contact or whole.contact)
        lines += warnings
    return assembly, whole, tuple(lines)


def _read(path: PathLike, assembly: Assembly) -> tuple[Assembly, Findings, tuple[str, ...]]:
    shown = one_line(path)
    data = read_json(path)
    said = data.get("schema") if isinstance(data, dict) else None
    ids = {block.id for block in assembly.blocks}
    if said == _RESULT:
        return _result(shown, data, assembly)
    if said == _SEQUENCE:
        return assembly, Findings(block=_sequence(shown, data, ids)), ()
    if said == _INFO:
        if data.get("interlock") is None:
            raise InputError(f"{shown}: it holds no interlock; let `info --interlock` write it")
        return assembly, Findings(_numbers(shown, data, {"J": ("interlock", "J")})), ()
    if isinstance(said, str) and said in _PLACED:
        whole = _numbers(shown, data, {"Lambda": ("Lambda",), "gap": ("gap",), "J": ("J", "after")})
        return assembly, Findings(whole, _placed(shown, data, said, ids)), ()
    known = ", ".join(sorted((_RESULT, _SEQUENCE, _INFO, *_PLACED)))
    raise InputError(f"{shown}: its schema is {found(said)}; a file that tells of a model has one of {known}")


def _numbers(shown: str, data: dict[str, Any], places: Mapping[str, Sequence[str]]) -> dict[str, float]:
    """Numbers of a file, each under the name that it is told by; nothing where the file does not say it."""
    told: dict[str, float] = {}
    for name, keys in places.items():
        where, value = shown, data
        for key in keys[:-1]:
            where = f"{where}: {key}"
            value = mapping(value.get(key) or {}, where)
        if value.get(keys[-1]) is not None:
            told[name] = number(value[keys[-1]], f"{where}: {keys[-1]}")
    return told


def _known(where: str, value: Any, ids: Container[str]) -> str:
    name = text(value, where)
    if name not in ids:
        raise InputError(f"{where} names block {label(name)}, which is not in the model; is the file of another one?")
    return name


def _sequence(shown: str, data: dict[str, Any], ids: set[str]) -> dict[str, dict[str, int]]:
    told: dict[str, dict[str, int]] = {}
    for k, name in enumerate(array(data.get("order"), f"{shown}: order")):
        told[_known(f"{shown}: order[{k}]", name, ids)] = {"order": k + 1}
    for k, row in enumerate(array(data.get("layers", []), f"{shown}: layers")):
        for m, name in enumerate(array(row, f"{shown}: layers[{k}]")):
            told.setdefault(_known(f"{shown}: layers[{k}][{m}]", name, ids), {})["course"] = k + 1
    return told


def _placed(shown: str, data: dict[str, Any], schema: str, ids: set[str]) -> dict[str, dict[str, Any]]:
    place, key, keys = _PLACED[schema]
    told: dict[str, dict[str, Any]] = {}
    for k, value in enumerate(array(data.get(place), f"{shown}: {place}")):
        where = f"{shown}: {place}[{k}]"
        row = mapping(value, where)
        given = {name: row[name] for name in keys if row.get(name) is not None}
        told[_known(f"{where}.{key}", row.get(key), ids)] = {
            name: text(item, f"{where}.{name}") if name == "stone" else number(item, f"{where}.{name}")
            for name, item in given.items()
        }
    return told


@dataclass(frozen=True, slots=True, eq=False)
class ForceRow:
    """One row of the `forces` of a result."""

    ends: tuple[int, int]  # blocks a and b of the model
    polygon: Floats  # (m, 3) m
    force: Floats | None  # (m, 3) N: fn, fu, fv on block b; None where no state was found
    frame: Floats | None  # (3, 3) rows n, u, v
    utilisation: float | None

    @property
    def facing(self) -> Floats | None:
        """(3,) normal of a contact at a point; None of a polygon."""
        return self.frame[0] if self.frame is not None and len(self.polygon) == 1 else None


def listed(rows: Sequence[ForceRow]) -> Contacts:
    """The contacts of some rows."""
    return Contacts.of([row.ends for row in rows], [row.polygon for row in rows], facing=[row.facing for row in rows])


def force_rows(shown: str, data: Mapping[str, Any], index: Mapping[str, int]) -> list[ForceRow]:
    """Read the `forces` of a result; `index` numbers the blocks of its model by their ids.

    Raises
    ------
    InputError
        Names the row and what is wrong with it.
    """
    rows = []
    for k, value in enumerate(array(data.get("forces") or [], f"{shown}: forces")):
        where = f"{shown}: forces[{k}]"
        row = mapping(value, where)
        a, b = (index[_known(f"{where}: {key}", row.get(key), index)] for key in "ab")
        if a == b:
            raise InputError(f"{where}: joins block {label(row['a'])} to itself")
        polygon = points(row.get("polygon"), f"{where}: polygon")
        force, frame = (
            None if row.get(key) is None else points(row[key], f"{where}: {key}") for key in ("force", "frame")
        )
        if (force is not None and len(force) != len(polygon)) or (frame is not None and len(frame) != 3):
            raise InputError(f"{where}: needs one force a corner of its polygon, and a frame of three vectors")
        used = None if row.get("utilisation") is None else number(row["utilisation"], f"{where}: utilisation")
        rows.append(ForceRow((a, b), polygon, force, frame, used))
    return rows


def _result(shown: str, data: dict[str, Any], assembly: Assembly) -> tuple[Assembly, Findings, tuple[str, ...]]:
    said = {key: text(data[key], f"{shown}: {key}") for key in ("verdict", "method") if data.get(key) is not None}
    model: dict[str, str | float] = {**said, **_numbers(shown, data, _MARGINS)}
    rows = force_rows(shown, data, {block.id: i for i, block in enumerate(assembly.blocks)})
    pairs, given = [row.ends for row in rows], assembly.contacts
    if rows and given is not None and pairs != list(zip(given.a.tolist(), given.b.tolist(), strict=True)):
        raise InputError(f"{shown}: its contacts are not those of the model; check that model again")
    if rows and given is None:
        assembly = replace(assembly, contacts=listed(rows))
    if not rows or any(row.force is None for row in rows):  # all or none: files hold null where no state was found
        lacking = f"{shown}: holds no forces, because its verdict is {model.get('verdict', 'not given')}"
        return assembly, Findings(model), (lacking,)
    states = [_state(f"{shown}: forces[{k}]", row) for k, row in enumerate(rows)]
    return assembly, Findings(model, _utilisation(assembly, pairs, states), tuple(states)), ()


def _state(where: str, row: ForceRow) -> ContactState:
    if row.force is None or row.frame is None:
        raise InputError(f"{where}: needs one force a corner of its polygon, and a frame of three vectors")
    return ContactState(row.polygon, row.force, row.frame, row.utilisation)


def _utilisation(
    assembly: Assembly, pairs: list[tuple[int, int]], states: list[ContactState]
) -> dict[str, dict[str, float]]:
    """The most used contact of each block."""
    worst: dict[int, float] = {}
    for pair, state in zip(pairs, states, strict=True):
        for i in pair:
            if state.utilisation is not None:
                worst[i] = max(worst.get(i, 0.0), state.utilisation)
    return {assembly.blocks[i].id: {"utilisation": worst[i]} for i in sorted(worst)}
