"""The tilt or the push that a model bears in every direction, and the load on its road in every place."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.limit import found_limit
from cyclopean.analysis.limit_analysis.live_load import Live
from cyclopean.analysis.limit_analysis.result import LimitResult
from cyclopean.analysis.preparation import prepare
from cyclopean.analysis.settings import Settings
from cyclopean.assembly import Assembly

__all__ = ["Polar", "Travelling", "last_least", "polar", "travelling"]

SAME = 1e-5  # relative: ten times as far as both bounds of a limit lie apart


@dataclass(frozen=True, slots=True, eq=False)
class Polar:
    """Limits by azimuth (degrees); the least of those tried, which need not be the least of all."""

    azimuths: tuple[float, ...]
    results: tuple[LimitResult, ...]
    least: LimitResult

    @property
    def table(self) -> list[tuple[float, float | None, float | None]]:
        """Azimuth and both bounds: of the angle of a tilt in degrees, else of the multiplier."""
        ends = (r.angle or (None, None) if r.live.tilt is not None else (r.lower, r.upper) for r in self.results)
        return [(azimuth, *pair) for azimuth, pair in zip(self.azimuths, ends, strict=True)]

    @property
    def towards(self) -> float:
        """Azimuth of the least."""
        return self.azimuths[self.results.index(self.least)]


@dataclass(frozen=True, slots=True, eq=False)
class Travelling:
    """Limits of a load in several places (m) along x; the least of those tried, which need not be the least of all."""

    places: tuple[float, ...]
    results: tuple[LimitResult, ...]
    least: LimitResult

    @property
    def at(self) -> float:
        """Place of the least (m)."""
        return self.places[self.results.index(self.least)]


def polar(
    assembly: Assembly,
    live: Live,
    settings: Settings | None = None,
    *,
    count: int,
    solver: str = "auto",
    seconds: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Polar:
    """Limit analysis of a tilt or a push turned to `count` azimuths, evenly spread from its own, `seconds` for all."""
    turns = 360.0 * np.arange(count) / count
    x, y, z = live.push or (0.0, 0.0, 0.0)
    first = live.tilt if live.tilt is not None else float(np.degrees(np.arctan2(y, x)))
    azimuths = tuple(float((first + turn) % 360.0) for turn in turns)
    way = np.hypot(x, y) * np.stack([np.cos(np.radians(azimuths)), np.sin(np.radians(azimuths))], 1).round(15)
    tilted = live.tilt is not None
    lives = [
        Live(tilt=az) if tilted else Live(push=(u, v, z)) for az, (u, v) in zip(azimuths, way.tolist(), strict=True)
    ]
    named = [(f"{live.kind} towards {azimuth:g} degrees", one) for azimuth, one in zip(azimuths, lives, strict=True)]
    return Polar(azimuths, *_each(assembly, named, settings, solver, seconds, progress))


def travelling(
    assembly: Assembly,
    lives: Sequence[tuple[float, Live]],
    settings: Settings | None = None,
    *,
    solver: str = "auto",
    seconds: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Travelling:
    """Limit analysis of loads at several places (m), `seconds` for all."""
    named = [(f"load at x = {x:g} m", live) for x, live in lives]
    found = _each(assembly, named, settings, solver, seconds, progress)
    return Travelling(tuple(x for x, _ in lives), *found)


def _each(
    assembly: Assembly,
    lives: Sequence[tuple[str, Live]],
    settings: Settings | None,
    solver: str,
    seconds: float | None,
    progress: Callable[[str], None],
) -> tuple[tuple[LimitResult, ...], LimitResult]:
    """Every limit, and the least."""
    budget = UNLIMITED if seconds is None else Budget(seconds)
    results: list[LimitResult] = []
    clock: dict[str, float] = {}
    model, known = prepare(assembly, settings, progress, clock), None
    contacts = clock["contacts"] - clock["margin"]
    for done, (name, live) in enumerate(lives):
        progress(name)
        own = Budget(max(budget.left / (len(lives) - done), 1e-3)) if budget.limited else UNLIMITED
        result, growing = found_limit(model, live, solver, own, beside=known)
        known = growing if growing.model is model else known  # a tilt of loads that do not turn is a model of its own
        results.append(replace(result, seconds={"contacts": 0.0 if results else contacts, **result.seconds}))
    return tuple(results), results[last_least([_height(result) for result in results])]


def last_least(values: Sequence[float]) -> int:
    """Which is the last of those that are as small as any, to rounding: mirrored directions bear the same tilt.

    >>> last_least([2.0, 1.0, 1.0 + 1e-7])
    2
    """
    return max(k for k, value in enumerate(values) if value <= min(values) + SAME * abs(min(values)))


def _height(result: LimitResult) -> float:
    """The multiplier (tangent of a tilt) to rank by: what is proved to bring it down, else what is proved to stand."""
    if result.upper is not None:
        return result.upper
    return 0.0 if result.lower is None else np.inf
