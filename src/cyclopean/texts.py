"""Values that are given as text: on the command line, or in a text input of Grasshopper; and lists as they are told.

Every reader is told where the text stands, as the message begins: an option in backticks, or the name of an argument.
"""

import math
from collections.abc import Collection, Sequence
from typing import Any, TypeAlias

from cyclopean.errors import InputError

__all__ = [
    "Motion",
    "PointLoad",
    "case_factors",
    "choice",
    "first_few",
    "length_or_auto",
    "number",
    "numbers",
    "pair",
    "plain",
    "point_loads",
    "reach",
    "scores",
    "settlements",
    "span",
    "tilt",
    "tolerance",
    "vector",
    "whole",
]

REACH = 1e12  # as in model files: beyond it, products leave double precision
SPECK = 1e-100  # what is smaller counts as zero, for its products leave double precision too
AUTO = "auto"

Motion: TypeAlias = tuple[float, ...]  # (6,) m, rad
Vector: TypeAlias = tuple[float, float, float]
PointLoad: TypeAlias = tuple[str, Vector, Vector | None]  # block, N, m (None = the block's centroid)


def first_few(names: Sequence[str], most: int) -> str:
    """The first of some names, and how many more there are.

    Examples
    --------
    >>> first_few(["a", "b", "c", "d"], 2)
    'a, b and 2 more'
    """
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def plain(value: Any) -> str:
    """A text, a number or several numbers as a person writes them."""
    if isinstance(value, int | float):
        return f"{value:g}"
    return value if isinstance(value, str) else f"({', '.join(f'{float(x):g}' for x in value)})"


def number(where: str, text: str) -> float:
    """Read a finite number.

    Raises
    ------
    InputError
        The text is something else.

    Examples
    --------
    >>> number("`mu`", "0.7")
    0.7
    >>> number("`mu`", "nan")
    Traceback (most recent call last):
    cyclopean.errors.InputError: mu: 'nan' is not a finite number
    """
    try:  # 1_0 is ten to Python only
        value = float(text if "_" not in text else "")
    except ValueError:
        raise InputError(f"{where}: '{text}' is not a number") from None
    if not math.isfinite(value):
        raise InputError(f"{where}: '{text}' is not a finite number")
    if not abs(value) <= REACH:
        raise InputError(f"{where}: {value:g} is beyond {REACH:g}; check the units")
    return value if abs(value) >= SPECK else 0.0


def whole(where: str, text: str) -> int:
    """Read a whole number.

    Raises
    ------
    InputError
        The text is something else.
    """
    try:
        return int(text if "_" not in text else "")
    except ValueError:
        raise InputError(f"{where}: '{text}' is not a whole number") from None


def numbers(where: str, text: str) -> tuple[float, ...]:
    """Read finite numbers between commas."""
    return tuple(number(where, part) for part in text.split(","))


def vector(where: str, text: str) -> tuple[float, float, float]:
    """Read X,Y,Z.

    Raises
    ------
    InputError
        Not three finite numbers between commas.

    Examples
    --------
    >>> vector("`gravity`", "-1,0,-9")
    (-1.0, 0.0, -9.0)
    """
    value = numbers(where, text)
    if len(value) != 3:
        raise InputError(f"{where}: '{text}' should be three numbers X,Y,Z")
    return value[0], value[1], value[2]


def tilt(where: str, text: str) -> tuple[float, float]:
    """Read DEG[,AZ] in degrees, azimuth 0 where it is not given.

    Raises
    ------
    InputError
        Not one or two finite numbers.

    Examples
    --------
    >>> tilt("`tilt`", "5")
    (5.0, 0.0)
    """
    value = numbers(where, text)
    if len(value) > 2:
        raise InputError(f"{where}: '{text}' should be DEG or DEG,AZ")
    return value[0], value[1] if len(value) == 2 else 0.0


def pair(where: str, text: str) -> tuple[float, float]:
    """Read N,T: two numbers."""
    values = numbers(where, text)
    if len(values) != 2:
        raise InputError(f"{where}: '{text}' should be two numbers N,T")
    return values[0], values[1]


def length_or_auto(where: str, text: str) -> "float | str":
    """Read a length (m), or the word auto."""
    return text if text == AUTO else number(where, text)


def tolerance(where: str, text: str) -> "float | tuple[float, float] | str":
    """Read GAP, GAP,DEGREES (m and degrees), or the word auto.

    Raises
    ------
    InputError
        Something else.

    Examples
    --------
    >>> tolerance("`tolerance`", "0.002,0.5")
    (0.002, 0.5)
    """
    if text == AUTO:
        return text
    values = numbers(where, text)
    if len(values) > 2:
        raise InputError(f"{where}: '{text}' should be GAP (m), GAP,DEGREES or auto")
    return values[0] if len(values) == 1 else (values[0], values[1])


def span(where: str, text: str) -> tuple[float, float]:
    """Read X0:X1: two numbers."""
    values = tuple(number(where, part) for part in text.split(":"))
    if len(values) != 2:
        raise InputError(f"{where}: '{text}' should be two numbers X0:X1")
    return values[0], values[1]


def reach(where: str, text: str) -> tuple[float, str]:
    """Read a length such as 0.1m or an angle such as 10deg: the number, and "m" or "deg"."""
    unit = "deg" if text.endswith("deg") else "m"
    return number(where, text.removesuffix(unit)), unit


def choice(where: str, text: str, known: Collection[str]) -> str:
    """Read one of the known words.

    Raises
    ------
    InputError
        The text is another word.
    """
    if text not in known:
        raise InputError(f"{where}: '{text}' is not one of {', '.join(known)}")
    return text


def scores(where: str, text: str, known: Collection[str]) -> dict[str, float]:
    """Read NAME=W,... of known names, each once; what is not named is left out.

    Raises
    ------
    InputError
        No such name, a name twice, or no number of at least 0.
    """
    given: dict[str, float] = {}
    for part in text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or name not in known:
            raise InputError(f"{where}: '{part}' should be NAME=W with one of {', '.join(known)}")
        if name in given:
            raise InputError(f"{where}: '{name}' stands twice")
        given[name] = number(f"{where} {name}", value)
        if not given[name] >= 0.0:
            raise InputError(f"{where} {name}: {given[name]:g} is less than 0")
    return given


def case_factors(where: str, texts: Sequence[str]) -> tuple[tuple[str, float], ...]:
    """Read CASE=X, each of them once.

    Raises
    ------
    InputError
        One of them is something else, or a case stands twice.

    Examples
    --------
    >>> case_factors("`factor`", ["wind=1.5", "self=0.9"])
    (('wind', 1.5), ('self', 0.9))
    """
    found: dict[str, float] = {}
    for text in texts:
        case, between, value = text.rpartition("=")
        if not between or not case:
            raise InputError(f"{where}: '{text}' should be NAME=X, a name and a number")
        if case in found:
            raise InputError(f"{where}: the case '{case}' stands twice")
        found[case] = number(f"{where} {case}", value)
    return tuple(found.items())


def point_loads(where: str, texts: Sequence[str]) -> tuple[PointLoad, ...]:
    """Read BLOCK:FX,FY,FZ or BLOCK:FX,FY,FZ@X,Y,Z; an id may hold colons.

    Raises
    ------
    InputError
        One of them is something else.

    Examples
    --------
    >>> point_loads("`load`", ["b1:0,0,-10@1,2,3"])
    (('b1', (0.0, 0.0, -10.0), (1.0, 2.0, 3.0)),)
    """
    found = []
    for text in texts:
        block, colon, rest = text.rpartition(":")
        if not colon or not block:
            raise InputError(f"{where} {text}: expected BLOCK:FX,FY,FZ or BLOCK:FX,FY,FZ@X,Y,Z")
        force, at, point = rest.partition("@")
        found.append((block, vector(f"{where} {block}", force), vector(f"{where} {block}", point) if at else None))
    return tuple(found)


def settlements(where: str, texts: Sequence[str]) -> tuple[tuple[str, Motion], ...]:
    """Read BLOCK:DX,DY,DZ[,RX,RY,RZ], each of them once; rotations are zero where they are not given.

    Raises
    ------
    InputError
        One of them is something else, or a block stands twice.

    Examples
    --------
    >>> settlements("`settlement`", ["s1:0,0,-0.01"])
    (('s1', (0.0, 0.0, -0.01, 0.0, 0.0, 0.0)),)
    """
    found: dict[str, Motion] = {}
    for text in texts:
        block, between, values = text.rpartition(":")
        if not between or not block:
            raise InputError(f"{where}: '{text}' should be BLOCK:DX,DY,DZ or BLOCK:DX,DY,DZ,RX,RY,RZ")
        if block in found:
            raise InputError(f"{where}: block '{block}' stands twice")
        motion = numbers(f"{where} {block}", values)
        if len(motion) not in (3, 6):
            raise InputError(f"{where} {block}: '{values}' should be three or six numbers")
        found[block] = (*motion, 0.0, 0.0, 0.0)[:6]
    return tuple(found.items())
