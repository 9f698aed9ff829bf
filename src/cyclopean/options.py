"""An option is described once, as a field of a frozen dataclass; every front end is made from it.

`option` makes such a field: its default, what it does, how its text is read, and what it may be. The command line takes
its words and its help from there (`cli.command`), Python its keywords and their documentation (`api.keywords`),
Grasshopper its inputs (`service.inputs`); the ranges are checked by the dataclass itself (`check_options`).
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from cyclopean import texts
from cyclopean.errors import InputError

__all__ = [
    "Kind",
    "Option",
    "check_option",
    "check_options",
    "first_said",
    "option",
    "options_of",
    "read_option",
    "shown_default",
]

Kind: TypeAlias = Literal[
    "text", "number", "whole", "flag", "vector", "tilt", "pair", "numbers", "length", "reach", "texts", "factors",
    "loads", "settlements", "tolerance", "within",
    "span",
]  # fmt: skip
# How a text becomes a value; what is no text yet, as from Python, is only checked. Texts that may be given several
# times are read together.
READERS: dict[str, Callable[[str, Any], Any]] = {
    "text": lambda _, text: text,
    "number": texts.number,
    "whole": texts.whole,
    "vector": texts.vector,
    "tilt": texts.tilt,
    "pair": texts.pair,
    "numbers": texts.numbers,
    "length": texts.length_or_auto,
    "reach": texts.reach,
    "tolerance": texts.tolerance,
    "within": texts.numbers,
    "span": texts.span,
    "loads": texts.point_loads,
    "texts": lambda _, several: tuple(several),
    "factors": texts.case_factors,
    "settlements": texts.settlements,
}
REPEATED = ("texts", "factors", "loads", "settlements")


@dataclass(frozen=True, slots=True)
class Option:
    """What one option is."""

    help: str  # one sentence
    kind: Kind = "text"
    metavar: str = ""
    choices: tuple[str, ...] = ()
    least: float = -math.inf
    above: float = -math.inf  # not allowed itself
    most: float = math.inf
    unit: str = ""
    word: str = ""  # what it is called where it is typed, if not by the name of the field
    default: Any = None  # shown where the help says none
    required: bool = False

    @property
    def repeated(self) -> bool:
        """Whether it may be given several times."""
        return self.kind in REPEATED

    @property
    def takes(self) -> str:
        """What stands for its value in the help; words that complete themselves where there is a choice."""
        return self.metavar or "|".join(self.choices)

    def expected(self) -> str:
        """The range in words."""
        noun = "whole number" if self.kind == "whole" else "length" if self.unit == "m" else "number"
        said = f"a {noun}"
        if self.least > -math.inf and self.most < math.inf:
            said = f"a {noun} from {self.least:g} to {self.most:g}"
        elif self.above == 0.0:
            said = f"a positive {noun}"
        elif self.least > -math.inf:
            said = f"a {noun} >= {self.least:g}"
        unit = " in metres" if noun == "length" else f" of {self.unit}" if self.unit else ""
        return f"expected {said}{unit}"


def option(default: Any, help: str, kind: Kind = "text", **more: Any) -> Any:
    """Field of a dataclass that is an option; `more` are the fields of `Option`."""
    return field(default=default, metadata={"option": Option(help, kind, default=default, **more)})


def options_of(kind: Any) -> dict[str, Option]:
    """The options of a dataclass, by the names of its fields, in their order."""
    return {one.name: one.metadata["option"] for one in dataclasses.fields(kind) if "option" in one.metadata}


def first_said(given: Any, names: str = "") -> str | None:
    """The first option of a dataclass, or of those named, that is not as it is by default."""
    every = options_of(given)
    return next((name for name in names.split() or every if getattr(given, name) != every[name].default), None)


def shown_default(option: Option) -> str:
    """The help, with the default where there is one and the help does not say it."""
    value = option.default
    if "[" in option.help or value is None or value in ("", ()) or isinstance(value, bool):
        return option.help
    shown = ",".join(f"{x:g}" for x in (value if isinstance(value, tuple) else (value,)) if not isinstance(x, str))
    return f"{option.help.removesuffix('.')} [{shown or value}]."


def read_option(where: str, option: Option, text: str | Sequence[str]) -> Any:
    """Value of an option from its text, or texts where it may be given several times.

    Raises
    ------
    InputError
        The text is no such value; begins with `where`. Ranges are the business of the dataclass.
    """
    if option.choices:
        texts.choice(where, str(text), option.choices)
    return READERS[option.kind](where, text)


def check_options(given: Any) -> None:
    """Check every option of a dataclass; None, and text where nothing is said, pass.

    Raises
    ------
    InputError
        A value that is none of the choices, not finite or out of range.
    """
    for name, described in options_of(type(given)).items():
        check_option(name, described, getattr(given, name))


def check_option(name: str, described: Option, value: Any) -> None:
    """Check the value of one option; None and the default pass.

    Raises
    ------
    InputError
        A value that is none of the choices, not finite or out of range.
    """
    if value is None or value == described.default:
        return
    if described.choices and str(value) not in described.choices:
        raise InputError.of(name, value, f"expected one of {', '.join(described.choices)}")
    if described.kind in ("number", "whole") and not _inside(described, value):
        raise InputError.of(name, value, described.expected())
    if described.kind in ("vector", "tilt", "pair", "numbers", "span") and not all(map(math.isfinite, value)):
        raise InputError.of(name, None, "expected finite numbers")


def _inside(described: Option, value: Any) -> bool:
    """Whether a number is finite, whole where it should be, and in range."""
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        return False
    if described.kind == "whole" and not hasattr(value, "__index__"):
        return False
    finite = isinstance(value, int) or math.isfinite(value)  # a whole number may be beyond any float
    return finite and described.least <= value <= described.most and value > described.above
