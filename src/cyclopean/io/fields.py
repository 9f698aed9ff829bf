"""What is in a parsed file, checked: every complaint names the place and what was expected there."""

import json
import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from itertools import chain
from typing import Any, NoReturn, TypeVar

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.io.files import PathLike, decoded, one_line, read_bytes

__all__ = [
    "REACH",
    "Faces",
    "UnknownKeys",
    "array",
    "density",
    "face_fault",
    "faces",
    "fail",
    "first_repeat",
    "flag",
    "found",
    "label",
    "mapping",
    "not_negative",
    "number",
    "optional",
    "parsed",
    "points",
    "read_json",
    "refuse_unfolded",
    "text",
    "vector",
]

Faces = tuple[tuple[int, ...], ...]

# Largest coordinate, force, density or mu that is believed. Inertia goes with the fifth power of length, so this
# keeps every later product within double precision; it is far beyond any quarry, in any unit.
REACH = 1e12

ROWS = 2_000_000  # vertices and corners that a small file may unfold to, by meshes that stand in several places
_NUMBERS = {int, float}
_Item = TypeVar("_Item", bound=Hashable)
_Value = TypeVar("_Value")


def parsed(path: str, content: str) -> Any:
    """Parse JSON; an object that holds a key twice is refused, because readers disagree about which one counts.

    Raises
    ------
    InputError
        It is not JSON, is nested too deeply, or holds a number too long to read.
    """

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs) and (twice := first_repeat(key for key, _ in pairs)) is not None:
            raise InputError(f"{path}: the key '{one_line(twice, 40)}' stands twice in one object; keep one")
        return found

    try:
        return json.loads(content, object_pairs_hook=once)
    except json.JSONDecodeError as error:
        ended = " (the file ends early)" if error.pos >= len(content.rstrip()) else ""
        raise InputError(
            f"{path}: is not JSON: line {error.lineno}, column {error.colno}: {one_line(error.msg)}{ended}"
        ) from None
    except RecursionError:
        raise InputError(f"{path}: is nested too deeply to be a model") from None
    except ValueError:  # Python refuses whole numbers of more than 4,300 digits
        raise InputError(f"{path}: holds a whole number of thousands of digits; coordinates are metres") from None


def read_json(path: PathLike) -> Any:
    """Parse a JSON file; errors as `read_bytes`, `decoded` and `parsed`."""
    shown = one_line(path)
    return parsed(shown, decoded(shown, read_bytes(path)))


def fail(path: str, line: int, what: str) -> NoReturn:
    """Refuse a line of a text file."""
    raise InputError(f"{path}: line {line}: {what}")


def first_repeat(items: Iterable[_Item]) -> _Item | None:
    """Return the first of the items that stood before, or None."""
    seen: set[_Item] = set()
    for item in items:
        if item in seen:
            return item
        seen.add(item)
    return None


def found(value: Any) -> str:
    """Name a JSON value in a few words."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, int | float):
        return one_line(repr(value), 24).replace("nan", "NaN").replace("inf", "Infinity")
    if isinstance(value, str):
        return f"the text '{one_line(value, 24)}'"
    return "a list" if isinstance(value, list) else "an object"


def label(text: str) -> str:
    """Quote an id for a message."""
    return f"'{one_line(text, 40)}'"


def mapping(value: Any, where: str) -> dict[str, Any]:
    """Return `value` if it is an object."""
    if not isinstance(value, dict):
        raise InputError(f"{where} must be an object, found {found(value)}")
    return value


def array(value: Any, where: str) -> list[Any]:
    """Return `value` if it is a list."""
    if not isinstance(value, list):
        raise InputError(f"{where} must be a list, found {found(value)}")
    return value


def text(value: Any, where: str) -> str:
    """Return `value` if it is text that prints on one line and is not empty."""
    if not isinstance(value, str):
        raise InputError(f"{where} must be text in quotes, found {found(value)}")
    if not value or not value.isprintable():
        raise InputError(f"{where} must be text of one line, not empty, found '{one_line(value, 40)}'")
    return value


def number(value: Any, where: str) -> float:
    """Return `value` as a float if it is a finite number of a size to be believed; true and false are no numbers."""
    if type(value) not in _NUMBERS:
        raise InputError(f"{where} is not a finite number (found {found(value)})")
    try:
        real = float(value)
    except OverflowError:
        real = math.inf
    if not math.isfinite(real):
        raise InputError(f"{where} is not a finite number (found {found(value)})")
    if not abs(real) <= REACH:
        raise InputError(f"{where} = {real:g} is beyond 1e12; check the units")
    return real


def optional(value: Any, where: str, reader: Callable[[Any, str], _Value]) -> _Value | None:
    """None if `value` is null, else what the reader makes of it."""
    return None if value is None else reader(value, where)


def not_negative(value: Any, where: str) -> float:
    """Return `value` if it is a number that is not negative."""
    if (real := number(value, where)) < 0.0:
        raise InputError(f"{where} {real:g} must not be negative")
    return real


def density(value: Any, where: str) -> float:
    """Return `value` if it is a positive number (kg/m3)."""
    if not (real := number(value, where)) > 0.0:
        raise InputError(f"{where} {real:g} must be a positive number of kg/m3")
    return real


def flag(value: Any, where: str) -> bool:
    """Return `value` if it is true or false."""
    if not isinstance(value, bool):
        raise InputError(f"{where} must be true or false, found {found(value)}")
    return value


def refuse_unfolded(path: str, rows: int, size: int) -> None:
    """Refuse a file of `size` bytes that becomes so many vertices and corners, by sharing or compression, so far."""
    if rows > max(ROWS, size):
        raise InputError(
            f"{path}: {size:,} bytes that unfold to more than {max(ROWS, size):,} vertices and corners; simplify it"
        )


def points(value: Any, where: str) -> Floats:
    """Return a list of [x, y, z] as an (n, 3) array."""
    regular = isinstance(value, list) and all(isinstance(p, list) and len(p) == 3 for p in value)
    if regular and set(map(type, chain.from_iterable(value))) <= _NUMBERS:
        try:
            result = np.array(value, np.float64).reshape(-1, 3)
        except OverflowError:  # a whole number beyond 1e308; found again below, by name
            result = np.full((1, 3), np.inf)
        if (np.abs(result) <= REACH).all():
            return result
    for i, point in enumerate(array(value, where)):
        if len(array(point, f"{where}[{i}]")) != 3:
            raise InputError(f"{where}[{i}] must be [x, y, z], found {len(point)} numbers")
        for k, coordinate in enumerate(point):
            number(coordinate, f"{where}[{i}][{k}]")
    raise InputError(f"{where} must be a list of [x, y, z]")


def vector(value: Any, where: str) -> Floats:
    """Return [x, y, z] as a (3,) array."""
    if len(array(value, where)) != 3:
        raise InputError(f"{where} must be [x, y, z], found {len(value)} numbers")
    return np.array([number(coordinate, f"{where}[{k}]") for k, coordinate in enumerate(value)])


def faces(value: Any, where: str, count: int) -> Faces:
    """Return a list of corner lists, each of three or more different indices into `count` vertices."""
    if not isinstance(value, list) or not all(isinstance(face, list) for face in value):
        for k, face in enumerate(array(value, where)):
            array(face, f"{where}[{k}]")
    if not set(map(type, chain.from_iterable(value))) <= {int}:
        for k, face in enumerate(value):
            for m, corner in enumerate(face):
                if type(corner) is not int:
                    raise InputError(f"{where}[{k}][{m}] must be a whole number, found {found(corner)}")
    for k, face in enumerate(value):
        if fault := face_fault(face, count):
            raise InputError(f"{where}[{k}] {fault}")
    return tuple(map(tuple, value))


def face_fault(face: Sequence[int], count: int) -> str:
    """Return what is wrong with the corners of a face, or ""."""
    if len(face) < 3:
        return f"has {len(face)} corners; a face needs at least 3"
    if min(face) < 0 or max(face) >= count:
        wrong = next(i for i in face if not 0 <= i < count)
        have = f"0..{count - 1}" if count else "none"
        return f"names vertex {found(wrong)}, but the vertices are {have}"
    if len(set(face)) < len(face):
        return f"names vertex {first_repeat(face)} twice; list every corner once"
    return ""


class UnknownKeys:
    """Keys that are ignored, gathered so that ten thousand blocks make one warning."""

    def __init__(self) -> None:
        self._seen: dict[tuple[str, str], tuple[int, str]] = {}

    def note(self, data: dict[str, Any], known: frozenset[str], kind: str, where: str) -> None:
        """Remember the keys of `data` that are not `known`; `kind` is "block", `where` the place of this one."""
        if not data.keys() <= known:
            for key in data.keys() - known:
                count, first = self._seen.get((kind, key), (0, where))
                self._seen[kind, key] = (count + 1, first)

    def warnings(self) -> list[str]:
        """One line for each kind and key."""
        lines = []
        for (kind, key), (count, first) in sorted(self._seen.items()):
            more = f" (and in {count - 1} more {kind}s)" if count > 1 else ""
            lines.append(f"{first}: unknown key '{one_line(key, 40)}' is ignored{more}")
        return lines
