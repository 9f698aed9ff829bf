"""Limit analysis without dilatancy: multipliers at which coupled analysis still finds a state, by bisection."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from cyclopean.analysis.checking import check
from cyclopean.analysis.limit_analysis.live_load import Live, live_loads
from cyclopean.analysis.limit_analysis.result import LimitResult
from cyclopean.analysis.settings import GRAVITY, Settings
from cyclopean.analysis.verdict import Word
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.statics import turned_gravity

__all__ = ["CoupledBracket", "coupled_bracket"]

SHY = 0.999  # share of the associated limit that is tried first
NARROW = 1e-3  # of the associated limit: gaps between multipliers that are not halved any more


@dataclass(frozen=True, slots=True)
class CoupledBracket:
    """What coupled analysis says below the associated limit; "undecided" is no proof that it falls."""

    stands: float | None  # largest multiplier with a certified coupled state; None where none was found
    not_yet: float | None  # smallest multiplier tried above it that is not certified; None where all were
    word: Word | None  # what coupled analysis said there
    trials: tuple[tuple[float, Word], ...]  # in the order in which they were made
    falls: float | None = None  # smallest multiplier tried above `stands` that is proved to have no coupled state


def coupled_bracket(
    assembly: Assembly,
    result: LimitResult,
    settings: Settings,
    *,
    trials: int = 12,
    progress: Callable[[str], None] = lambda _: None,
) -> CoupledBracket:
    """Bisect between no live load and the associated limit: the widest gap between multipliers that were tried.

    The limit by rigid-block equilibrium takes sliding joints to dilate, and is an upper bound for friction without
    dilatancy. A coupled state is one that a virtual motion without dilatancy produces. Neither says that all
    multipliers below one that stands do so too, nor that all above one without a coupled state have none: a multiplier
    stands or falls alone, until the associated limit, from which on a mechanism rules out all.

    Parameters
    ----------
    assembly : Assembly
        The model.
    result : LimitResult
        By rigid-block equilibrium.
    settings : Settings
        Its `seconds` are for each trial.
    trials : int
        Most verdicts to ask for.
    progress : callable
        Is told what is being tried.
    """
    if result.lower is None or not (result.lower > 0.0):
        return CoupledBracket(None, None, None, ())
    made: dict[float, Word] = {}
    model = replace(assembly, contacts=result.contacts)
    t: float | None = SHY * result.lower  # first: where friction is not at its limit the two agree
    while t is not None and len(made) < trials:
        progress(f"coupled analysis at {t:.4g}")
        made[t] = check(*multiplied(model, result.live, settings, t)).verdict
        t = _next(made, result.lower)
    stands = max((t for t, word in made.items() if word == "stable"), default=None)
    above = [t for t in made if stands is None or t > stands]
    not_yet = min(above, default=None)
    falls = min((t for t in above if made[t] == "unstable"), default=None)
    return CoupledBracket(stands, not_yet, None if not_yet is None else made[not_yet], tuple(made.items()), falls)


def _next(made: Mapping[float, Word], limit: float) -> float | None:
    """Where to ask next: no live load at all, then in the middle of the widest gap between what stands and falls."""
    if 0.0 not in made:
        return None if "stable" in made.values() else 0.0
    stands = max((t for t, word in made.items() if word == "stable"), default=None)
    if stands is None:
        return None
    falls = min((t for t, word in made.items() if word == "unstable" and t > stands), default=max(made))
    inside = sorted(t for t in made if stands <= t <= falls)
    width, middle = max((b - a, (a + b) / 2.0) for a, b in pairwise(inside))
    return middle if width > NARROW * limit else None


def multiplied(assembly: Assembly, live: Live, settings: Settings, t: float) -> tuple[Assembly, Settings]:
    """The model and settings of `check` at multiplier t of the live loads."""
    base = np.array(settings.gravity or GRAVITY, float)
    if settings.tilt is not None:
        base = turned_gravity(base, *settings.tilt)
    if live.tilt is not None:
        turned = turned_gravity(base, float(np.rad2deg(np.arctan(t))), live.tilt)
        return assembly, replace(settings, method="cra", gravity=_triple(turned), tilt=None)
    gravity, loads = live_loads(assembly, live, base)
    grown = tuple(replace(load, force=t * load.force) for load in loads)
    changed = replace(settings, method="cra", gravity=_triple(base + t * gravity), tilt=None)
    return replace(assembly, loads=(*assembly.loads, *grown)) if t else assembly, changed


def _triple(vector: Floats) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
