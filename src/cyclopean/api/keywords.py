"""Options as keywords: their names, their defaults and what they do, from the dataclasses that describe them."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, Literal, TypedDict, TypeVar

from cyclopean.options import Option, options_of, read_option, shown_default
from cyclopean.texts import PointLoad

if TYPE_CHECKING:
    from cyclopean.design.rubble.places import Scores

Function = TypeVar("Function", bound=Callable[..., Any])
Chosen = TypeVar("Chosen")
Vector = tuple[float, float, float]


class ModelKeywords(TypedDict, total=False):
    """Types of the options that every analysis has; what they do says `Settings`."""

    mu: float | None
    density: float | None
    supports: str
    gravity: Vector | None
    tolerance: float | tuple[float, float] | str | None
    units: str | None
    strict: bool


class SequenceKeywords(ModelKeywords, total=False):
    """Types of the options of `build_sequence`."""

    method: Literal["", "cra", "rbe"] | None
    seconds: float | None
    bearing: float | None
    clearance: float | None
    order: str | Sequence[str | int] | None


class LimitKeywords(ModelKeywords, total=False):
    """Types of the options of `limit`."""

    push: Vector | None
    tilt: float | None
    loads: Mapping[str, Vector] | tuple[PointLoad, ...]
    surcharge: float | None
    live_at: str
    along: str | tuple[float, float] | None
    method: Literal["rbe", "cra"]
    solver: Literal["auto", "interior", "clarabel"]
    seconds: float | None
    polar: int | None
    pushover: str | tuple[float, str] | None
    steps: int | None
    combination: str
    factors: Mapping[str, float] | tuple[tuple[str, float], ...]
    soil_height: float | None
    tension: float | None
    cohesion: float | None


class SettingsKeywords(ModelKeywords, total=False):
    """Types of the options of `Settings`."""

    method: Literal["", "cra", "rbe"] | None
    tilt: float | tuple[float, float] | None
    cone: str
    solver: str
    weights: tuple[float, float]
    penalty: bool
    eps: float
    eta: float | None
    beta_min: float | None
    seconds: float | None
    nodes: int
    combination: str
    factors: Mapping[str, float] | tuple[tuple[str, float], ...]
    surcharge: float | None
    soil_height: float | None
    tension: float | None
    cohesion: float | None
    settlement: Mapping[str, tuple[float, ...]] | tuple[tuple[str, tuple[float, ...]], ...]
    within: float | tuple[float, ...] | None


class LineKeywords(TypedDict, total=False):
    """Types of the options by which `polygonal_wall` reads a drawing."""

    units: str | None
    scale: float
    snap: float | None
    deviation: float | None
    layer: tuple[str, ...]


class CellKeywords(TypedDict, total=False):
    """Types of the options that `match` and `tradeoff` share."""

    gap: float | None
    points: int | None
    shortlist: int
    starts: int
    bond: Literal["free", "into", "along"] | None
    bond_angle: float | None
    climbs: int
    rounds: int | None
    units: str | None
    strict: bool


class MatchKeywords(CellKeywords, total=False):
    """Types of the options of `match`."""

    weight: float | None
    sawn: str
    negotiate: float
    supports: str


class TradeoffKeywords(CellKeywords, total=False):
    """Types of the options of `tradeoff`."""

    depths: tuple[float, float] | None


class SettleKeywords(TypedDict, total=False):
    """Types of the options of `settle`."""

    length: float | None
    height: float | None
    thickness: float | None
    wythes: Literal[1, 2]
    batter: str | None
    corner: float | None
    opening: tuple[float, ...] | None
    ends: Literal["vertical", "racked"]
    coursed: bool
    through: float | None
    binders: float
    hearting: bool
    pins: bool
    copes: bool
    inward: float
    dress: float
    all: bool
    cell: float | None
    yaws: int
    scores: "Scores"
    look_ahead: int
    margin: float | None
    friction: float
    lean: float
    ways: int | None
    units: str | None
    strict: bool


class SiteKeywords(TypedDict, total=False):
    """Types of the options of `site_set`."""

    paper: Literal["A4", "A3"]
    cards: int
    scale: int | None
    title: str
    date: str
    hours: Mapping[str, float] | tuple[tuple[str, float], ...]


class CheckKeywords(SettingsKeywords, total=False):
    """Types of all options of `check`."""

    rough: float | Literal["auto"] | None
    margins: bool | None
    steps: int | None
    vary: tuple[str, ...]
    samples: int
    seed: int


def takes(*kinds: type, only: str = "") -> Callable[[Function], Function]:
    """Let a function that takes `**options` show which: in its signature, and below that word in its docstring.

    Parameters
    ----------
    kinds : dataclasses
        Their options become keywords; where two have one of the same name, it is that of the first.
    only : str
        Names of these, where not all are.
    """
    every = {name: one for kind in reversed(kinds) for name, one in options_of(kind).items()}
    known = {name: every[name] for name in only.split() or every}
    types = {field.name: field.type for kind in reversed(kinds) for field in fields(kind)}

    def told(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [one for one in signature.parameters.values() if one.kind is not one.VAR_KEYWORD]
        made = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=one.default, annotation=types[name])
            for name, one in known.items()
        ]
        about: Any = function
        about.__signature__ = signature.replace(parameters=[*own, *made])
        lines = "".join(f"        {name} : {shown_default(one)}\n" for name, one in known.items())
        before, word, after = (function.__doc__ or "").partition("    **options\n")
        function.__doc__ = f"{before}{word}{lines}{after}" if word else function.__doc__
        return function

    return told


def given_to(function: Callable[..., Any], options: Mapping[str, Any], *bases: Any) -> list[Any]:
    """Settings objects in which the options that were given (are not None) stand instead; each goes where it belongs.

    Raises
    ------
    TypeError
        The function takes no such option.
    """
    known = {*inspect.signature(function).parameters, *(field.name for base in bases for field in fields(base))}
    if strange := next((name for name in options if name not in known), None):
        raise TypeError(f"{function.__name__}() got an unexpected keyword argument '{strange}'")
    found = []
    for base in bases:
        described, names = options_of(base), [field.name for field in fields(base)]
        own = {name: options[name] for name in names if options.get(name) is not None}
        own |= {name: _plain(name, described[name], value) for name, value in own.items() if name in described}
        found.append(replace(base, **own) if own else base)
    return found


def _plain(name: str, described: Option, value: Any) -> Any:
    """A value as the dataclass holds it: an angle alone is towards azimuth 0, a mapping its items, a motion six."""
    if described.kind == "tilt" and isinstance(value, int | float):
        return float(value), 0.0
    if described.kind == "settlements":
        return tuple((block, (*motion, 0.0, 0.0, 0.0)[: max(6, len(motion))]) for block, motion in dict(value).items())
    if described.kind == "loads" and isinstance(value, Mapping):
        return tuple((block, force, None) for block, force in value.items())
    if described.kind in ("reach", "span") and isinstance(value, str):
        return read_option(f"`{name}`", described, value)
    return tuple(value.items()) if isinstance(value, Mapping) else value
