"""Everything that is raised on purpose.

CyclopeanError
├── InputError    the user's file, option or model is at fault; the message is one line that says what to do
└── SolverError   a solver failed or answered something that does not hold

A message names an option in backticks, as Python writes it: `beta_min`. Each front end spells it its own way (`spelt`):
the command line as --beta-min, Python without the backticks.
"""

import re
from collections.abc import Callable
from typing import Self

__all__ = ["CyclopeanError", "InputError", "SolverError", "spelt"]

_OPTION = re.compile(r"`([a-z]+(?:_[a-z]+)*)`")


class CyclopeanError(Exception):
    """Root of every error this package raises on purpose; its text names options as Python does."""

    def __str__(self) -> str:
        return self.spelt(str)

    def spelt(self, spell: Callable[[str], str]) -> str:
        """The message with each option as a front end spells it."""
        return spelt(super().__str__(), spell)


class InputError(CyclopeanError):
    """Bad input: one clear line that names the file, block or option, and the remedy.

    Attributes
    ----------
    field : str
        The option at fault, as Python writes it; "" where it is none.
    value : object
        What was given for it; None where the message is not about one value.
    expected : str
        What is wanted instead, or why it cannot be.
    """

    def __init__(self, message: str, *, field: str = "", value: object = None, expected: str = "") -> None:
        super().__init__(message)
        self.field, self.value, self.expected = field, value, expected

    @classmethod
    def of(cls, field: str, value: object, expected: str) -> Self:
        """An option at fault: its name, what was given (None: not worth repeating), and what is expected."""
        given = "" if value is None else f" {_written(value)}"
        return cls(f"`{field}`{given}: {expected}", field=field, value=value, expected=expected)


class SolverError(CyclopeanError):
    """A solver failed, or its answer did not survive our own check of it."""


def spelt(text: str, spell: Callable[[str], str]) -> str:
    """A message in which each option, named in backticks, is spelt as a front end does."""
    return _OPTION.sub(lambda found: spell(found[1]), text)


def _written(value: object) -> str:
    """A value as a person writes it: 0.7, 1,2,3, auto."""
    if isinstance(value, tuple | list):
        return ",".join(_written(one) for one in value)
    return f"{value:g}" if isinstance(value, float) else str(value)
