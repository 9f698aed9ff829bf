"""How a dataclass that holds arrays is shown at a prompt: in one line."""

from dataclasses import fields
from typing import Any

__all__ = ["one_line"]

WIDEST = 160  # characters of a line
LONG = 40  # characters of a field beyond which its length stands for it


def one_line(thing: Any) -> str:
    """What a prompt shows of a dataclass: its verdict, its name and size, or its fields, arrays by their shape.

    Examples
    --------
    >>> from cyclopean.assembly import Contacts
    >>> Contacts.of([], [])
    <Contacts, 0>
    """
    name = type(thing).__name__
    if (word := getattr(thing, "verdict", getattr(thing, "word", None))) is not None:
        said = f"{name} {word}: {thing.reason}"
    elif hasattr(thing, "imposition") and hasattr(thing, "match"):
        said = f"{name} of {len(thing.match)} stones: Lambda {thing.imposition:.3f}, gap {thing.gap:.3f}"
    elif hasattr(thing, "assembly") and hasattr(thing.assembly, "name"):
        said = f"{name} '{thing.assembly.name}', {len(thing.assembly)} blocks"
    elif hasattr(thing, "__len__"):
        called = getattr(thing, "name", getattr(thing, "source", ""))
        said = f"{name} '{called}', {len(thing)}" if called else f"{name}, {len(thing)}"
    else:
        said = f"{name} " + ", ".join(f"{field.name} {_short(getattr(thing, field.name))}" for field in fields(thing))
    said = " ".join(said.split())
    return f"<{said}>" if len(said) <= WIDEST else f"<{said[:WIDEST]} ...>"


def _short(value: Any) -> str:
    """Of an array its shape, of anything long how many things it holds."""
    if hasattr(value, "shape"):
        return str(value.shape)
    told = repr(value)
    return f"({len(value)})" if len(told) > LONG and hasattr(value, "__len__") else told
