"""Earth, water and fill in a model file: rows of `loads` whose keys are the fields of their dataclasses."""

from collections.abc import Callable
from dataclasses import MISSING, fields
from typing import Any, cast

from cyclopean.assembly.field_loads import Earth, FieldLoad, Fill, Water
from cyclopean.errors import InputError
from cyclopean.io.fields import UnknownKeys, array, mapping, number, text
from cyclopean.io.units import metres

__all__ = ["FIELDS", "field_dict", "field_load"]

FIELDS: dict[str, type[FieldLoad]] = {"soil": Earth, "water": Water, "fill": Fill}
PLACE = ("block", "group", "case")  # of every load: they stand beside the key, not in it
LENGTHS = ("height", "head", "foot")


def _pair(value: Any, where: str) -> tuple[float, float]:
    found = [number(one, f"{where}[{k}]") for k, one in enumerate(array(value, where))]
    if len(found) != 2:
        raise InputError(f"{where} must be [horizontal, vertical], found {len(found)} numbers")
    return found[0], found[1]


def _number_or_word(value: Any, where: str) -> float | str:
    return value if isinstance(value, str) else number(value, where)


READERS: dict[str, Callable[[Any, str], Any]] = {
    "state": text, "uplift": text, "seismic": _pair, "spread": _number_or_word
}  # fmt: skip


def field_load(where: str, kind: str, value: Any, units: str, unknown: UnknownKeys, place: dict[str, Any]) -> FieldLoad:
    """Earth, water or fill from what stands under its key; lengths in `units`, `place` as read.

    Raises
    ------
    InputError
        A key is missing, or says no such thing.
    """
    row, made = mapping(value, where), FIELDS[kind]
    known = {one.name: one for one in fields(made) if one.name not in PLACE}
    unknown.note(row, frozenset(known), kind, where)
    given: dict[str, Any] = {}
    for name, one in known.items():
        if row.get(name) is not None:
            reader: Callable[[Any, str], Any] = READERS.get(name, number)
            read = reader(row[name], f"{where}: {name}")
            given[name] = float(metres(read, units)) if name in LENGTHS else read
        elif one.default is MISSING:
            raise InputError(f'{where}: has no "{name}"')
    read_as: Any = made
    return cast(FieldLoad, read_as(**given, **place))


def field_dict(load: FieldLoad) -> dict[str, Any]:
    """The row again, in metres, with what differs from the defaults; without its place."""
    kind = next(key for key, made in FIELDS.items() if isinstance(load, made))
    said = {one.name: getattr(load, one.name) for one in fields(load) if one.name not in PLACE}
    defaults = {one.name: one.default for one in fields(load)}
    return {kind: {name: value for name, value in said.items() if value != defaults[name]}}
