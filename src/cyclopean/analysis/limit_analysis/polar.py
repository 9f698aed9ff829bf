"""The tilt that a model bears in every direction."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.limit import limit
from cyclopean.analysis.limit_analysis.live_load import Live
from cyclopean.analysis.limit_analysis.result import LimitResult
from cyclopean.analysis.settings import Settings
from cyclopean.assembly import Assembly

__all__ = ["Polar", "last_least", "polar_tilt"]

SAME = 1e-5  # relative: ten times as far as both bounds of a limit lie apart


@dataclass(frozen=True, slots=True, eq=False)
class Polar:
    """Tilts by azimuth; the least of those tried, which need not be the least of all."""

    results: tuple[LimitResult, ...]
    least: LimitResult

    @property
    def table(self) -> list[tuple[float, float | None, float | None]]:
        """Azimuth and both bounds of the angle, in degrees."""
        return [(r.live.tilt or 0.0, *(r.angle or (None, None))) for r in self.results]


def polar_tilt(
    assembly: Assembly,
    settings: Settings | None = None,
    *,
    count: int,
    first: float = 0.0,
    solver: str = "auto",
    seconds: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Polar:
    """Limit analysis of tilts towards `count` azimuths, evenly spread from `first` (degrees), `seconds` for all."""
    budget = UNLIMITED if seconds is None else Budget(seconds)
    results: list[LimitResult] = []
    for done, azimuth in enumerate(first + 360.0 * np.arange(count) / count):
        progress(f"tilt towards {azimuth:g} degrees")
        heading = float(azimuth % 360.0)
        share = max(budget.left / (count - done), 1e-3) if budget.limited else None
        result = limit(assembly, Live(tilt=heading), settings, solver=solver, seconds=share)
        if assembly.contacts is None:  # found once
            assembly = replace(assembly, contacts=result.contacts)
        results.append(result)
    return Polar(tuple(results), results[last_least([_height(result) for result in results])])


def last_least(values: Sequence[float]) -> int:
    """Which is the last of those that are as small as any, to rounding: mirrored directions bear the same tilt.

    >>> last_least([2.0, 1.0, 1.0 + 1e-7])
    2
    """
    return max(k for k, value in enumerate(values) if value <= min(values) + SAME * abs(min(values)))


def _height(result: LimitResult) -> float:
    """The angle to rank by: what is proved to bring it down, else what is proved to stand."""
    low, high = result.angle or (None, None)
    if high is not None:
        return high
    return 90.0 if low is not None else 0.0
