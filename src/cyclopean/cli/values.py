"""Values of options, from text; messages name the option."""

import math

from cyclopean.errors import InputError

REACH = 1e12  # as in model files: beyond it, products leave double precision
SPECK = 1e-100  # what is smaller counts as zero, for its products leave double precision too

__all__ = [
    "case_factors",
    "choice",
    "number",
    "numbers",
    "optional_number",
    "settlements",
    "tilt",
    "vector",
    "weights",
    "whole",
]


def number(option: str, text: str) -> float:
    """Read a finite number.

    Raises
    ------
    InputError
        The text is something else.

    Examples
    --------
    >>> number("--mu", "0.7")
    0.7
    >>> number("--mu", "nan")
    Traceback (most recent call last):
    cyclopean.errors.InputError: --mu: 'nan' is not a finite number
    """
    try:  # 1_0 is ten to Python only
        value = float(text if "_" not in text else "")
    except ValueError:
        raise InputError(f"{option}: '{text}' is not a number") from None
    if not math.isfinite(value):
        raise InputError(f"{option}: '{text}' is not a finite number")
    if not abs(value) <= REACH:
        raise InputError(f"{option}: {value:g} is beyond {REACH:g}; check the units")
    return value if abs(value) >= SPECK else 0.0


def optional_number(
    option: str, text: str | None, *, least: float = -math.inf, above: float = -math.inf
) -> float | None:
    """Read a finite number of at least `least` and more than `above`, or None where the option was not given.

    Raises
    ------
    InputError
        The text is something else.
    """
    if text is None:
        return None
    value = number(option, text)
    if value < least:
        raise InputError(f"{option}: {value:g} is less than {least:g}")
    if value <= above:
        raise InputError(f"{option}: {value:g} is not more than {above:g}")
    return value


def whole(option: str, text: str) -> int:
    """Read a whole number.

    Raises
    ------
    InputError
        The text is something else.
    """
    try:
        return int(text if "_" not in text else "")
    except ValueError:
        raise InputError(f"{option}: '{text}' is not a whole number") from None


def numbers(option: str, text: str) -> tuple[float, ...]:
    """Read finite numbers between commas."""
    return tuple(number(option, part) for part in text.split(","))


def vector(option: str, text: str | None) -> tuple[float, float, float] | None:
    """Read X,Y,Z, or None where the option was not given.

    Raises
    ------
    InputError
        Not three finite numbers between commas.

    Examples
    --------
    >>> vector("--gravity", "-1,0,-9")
    (-1.0, 0.0, -9.0)
    """
    if text is None:
        return None
    value = numbers(option, text)
    if len(value) != 3:
        raise InputError(f"{option}: '{text}' should be three numbers X,Y,Z")
    return value[0], value[1], value[2]


def tilt(option: str, text: str | None) -> tuple[float, float] | None:
    """Read DEG[,AZ] in degrees, azimuth 0 where it is not given.

    Raises
    ------
    InputError
        Not one or two finite numbers.

    Examples
    --------
    >>> tilt("--tilt", "5")
    (5.0, 0.0)
    """
    if text is None:
        return None
    value = numbers(option, text)
    if len(value) > 2:
        raise InputError(f"{option}: '{text}' should be DEG or DEG,AZ")
    return value[0], value[1] if len(value) == 2 else 0.0


def weights(option: str, text: str | None) -> tuple[float, float]:
    """Read `N,T`: weights of the normal and tangential forces; 1,1 where not given."""
    if text is None:
        return 1.0, 1.0
    values = numbers(option, text)
    if len(values) != 2 or not all(value > 0.0 for value in values):
        raise InputError(f"{option} {text}: expected two positive numbers N,T")
    return values[0], values[1]


def choice(option: str, text: str, known: tuple[str, ...]) -> str:
    """Read one of the known words.

    Raises
    ------
    InputError
        The text is another word.
    """
    if text not in known:
        raise InputError(f"{option}: '{text}' is not one of {', '.join(known)}")
    return text


def case_factors(option: str, texts: list[str] | None) -> tuple[tuple[str, float], ...]:
    """Read `CASE=X` of a repeatable option.

    Raises
    ------
    InputError
        One of them is something else, or a case stands twice.

    Examples
    --------
    >>> case_factors("--factor", ["wind=1.5", "self=0.9"])
    (('wind', 1.5), ('self', 0.9))
    """
    found: dict[str, float] = {}
    for text in texts or []:
        case, between, value = text.rpartition("=")
        if not between or not case:
            raise InputError(f"{option}: '{text}' should be CASE=X, such as wind=1.5")
        if case in found:
            raise InputError(f"{option}: the case '{case}' stands twice")
        found[case] = number(f"{option} {case}", value)
    return tuple(found.items())


def settlements(option: str, texts: list[str] | None) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """Read `BLOCK:DX,DY,DZ[,RX,RY,RZ]` of a repeatable option; rotations are zero where they are not given.

    Raises
    ------
    InputError
        One of them is something else, or a block stands twice.

    Examples
    --------
    >>> settlements("--settle", ["s1:0,0,-0.01"])
    (('s1', (0.0, 0.0, -0.01, 0.0, 0.0, 0.0)),)
    """
    found: dict[str, tuple[float, ...]] = {}
    for text in texts or []:
        block, between, values = text.rpartition(":")
        if not between or not block:
            raise InputError(f"{option}: '{text}' should be BLOCK:DX,DY,DZ or BLOCK:DX,DY,DZ,RX,RY,RZ")
        if block in found:
            raise InputError(f"{option}: block '{block}' stands twice")
        motion = numbers(f"{option} {block}", values)
        if len(motion) not in (3, 6):
            raise InputError(f"{option} {block}: '{values}' should be three or six numbers")
        found[block] = (*motion, 0.0, 0.0, 0.0)[:6]
    return tuple(found.items())
