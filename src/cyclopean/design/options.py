"""Numbers and words given as options: each check returns them, or names the option and says what would do."""

from typing import Any, get_args

import numpy as np

from cyclopean.errors import InputError

__all__ = ["at_least", "finite", "not_negative", "one_of", "positive", "within"]


def at_least(name: str, value: int, least: int) -> int:
    """A whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(f"{name}: expected a whole number of at least {least}, got {value!r}")
    return int(value)


def finite(name: str, value: float) -> float:
    """Any number but NaN and infinity."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not np.isfinite(value):
        raise InputError(f"{name}: expected a finite number, got {value!r}")
    return float(value)


def one_of(name: str, value: str, words: Any) -> str:
    """One of the words of a `Literal`."""
    *most, last = get_args(words)
    if value not in (*most, last):
        raise InputError(f"{name}: expected {', '.join(most)} or {last}, got {value!r}")
    return value


def positive(name: str, value: float) -> float:
    """A number above zero."""
    if not finite(name, value) > 0.0:
        raise InputError(f"{name}: must be more than 0, got {value:g}")
    return float(value)


def not_negative(name: str, value: float) -> float:
    """Zero or a number above it."""
    if not finite(name, value) >= 0.0:
        raise InputError(f"{name}: must not be negative, got {value:g}")
    return float(value)


def within(name: str, value: float, low: float, high: float) -> float:
    """A number from `low` to `high`, both allowed."""
    if not low <= finite(name, value) <= high:
        raise InputError(f"{name}: must be between {low:g} and {high:g}, got {value:g}")
    return float(value)
