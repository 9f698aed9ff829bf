"""Inputs of components from options that are described once, and the options from what is connected."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

from cyclopean.errors import spelt
from cyclopean.options import Option, options_of, read_option, shown_default
from cyclopean.service.parameters import Access, Input, Kind

Chosen = TypeVar("Chosen")

# Names and nicknames in Grasshopper, where the name of the field in capitals would not do.
NAMED = {
    "mu": ("Friction", "mu"),
    "density": ("Density", "rho"),
    "method": ("Method", "Me"),
    "gravity": ("Gravity", "G"),
    "tension": ("Tension", "Te"),
    "combination": ("Combination", "Cb"),
    "cohesion": ("Cohesion", "Ch"),
    "settlement": ("Settlement", "Se"),
    "solver": ("Solver", "So"),
    "seed": ("Seed", "Sd"),
    "samples": ("Samples", "Sa"),
    "eta": ("Eta", "eta"),
    "eps": ("Eps", "eps"),
    "penalty": ("Penalty", "Py"),
    "pushover": ("Pushover", "Po"),
    "polar": ("Polar", "Pr"),
    "live_at": ("Live", "Lv"),
    "surcharge": ("Surcharge", "Sc"),
    "bearing": ("Bearing", "Be"),
    "order": ("Given Order", "Go"),
    "corner": ("Corner", "Cr"),
    "coursed": ("Coursed", "Cd"),
    "copes": ("Copes", "Cp"),
    "through": ("Through", "Tt"),
    "hearting": ("Hearting", "Hg"),
    "lean": ("Lean", "Ln"),
}
KINDS: dict[str, Kind] = {"number": "Number", "whole": "Integer", "flag": "Boolean", "vector": "Vector"}


def input_name(field: str) -> str:
    """What an option is called in Grasshopper."""
    return NAMED[field][0] if field in NAMED else field.replace("_", " ").title()


def option_inputs(kind: type, names: str = "", **helps: str) -> tuple[Input, ...]:
    """Inputs for the options of a dataclass, or for these of them; nothing need be connected to any."""
    every = options_of(kind)
    return tuple(_input(name, every[name], helps.get(name, "")) for name in names.split() or every)


def _input(name: str, option: Option, says: str) -> Input:
    nickname = (
        NAMED[name][1] if name in NAMED else "".join(word[: 2 - ("_" in name)] for word in name.title().split("_"))
    )
    about = spelt(says or shown_default(option), input_name)
    access: Access = "list" if option.repeated else "item"
    return Input(input_name(name), nickname, KINDS.get(option.kind, "Text"), about, access, optional=True)


def option_values(given: Mapping[str, Any], base: Chosen) -> Chosen:
    """A dataclass of options with what is connected instead of what it says.

    Raises
    ------
    InputError
        A text that says no such value, or a value out of range.
    """
    read = {}
    described = options_of(base)
    for field in fields(base):  # type: ignore[arg-type]
        value = given.get(input_name(field.name))
        option = described.get(field.name)
        if option is not None and value is not None and not (option.repeated and not value):
            read[field.name] = _value(field.name, option, value)
    return replace(base, **read) if read else base  # type: ignore[type-var]


def _value(name: str, option: Option, value: Any) -> Any:
    """One value: vectors come as arrays, most others as text."""
    if hasattr(value, "tolist"):
        return tuple(value.tolist())
    if isinstance(value, str) and option.choices:
        value = value.strip().lower()
    if option.kind == "number":  # as it would be typed: within reach of double precision
        value = repr(value)
    text = isinstance(value, str) or (isinstance(value, Sequence) and option.repeated)
    return read_option(f"`{name}`", option, value) if text else value
