"""Limit analysis without dilatancy: multipliers at which coupled analysis still finds a state, by bisection."""

from collections.abc import Callable
from dataclasses import dataclass, replace

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


@dataclass(frozen=True, slots=True)
class CoupledBracket:
    """What coupled analysis says below the associated limit; "undecided" is no proof that it falls."""

    stands: float | None  # largest multiplier with a certified coupled state; None where none was found
    not_yet: float | None  # smallest multiplier tried above it that is not certified; None where all were
    word: Word | None  # what coupled analysis said there
    trials: tuple[tuple[float, Word], ...]  # in the order in which they were made


def coupled_bracket(
    assembly: Assembly,
    result: LimitResult,
    settings: Settings,
    *,
    trials: int = 9,
    progress: Callable[[str], None] = lambda _: None,
) -> CoupledBracket:
    """Bisect between no live load and the associated limit.

    The limit by rigid-block equilibrium takes sliding joints to dilate, and is an upper bound for friction without
    dilatancy. A coupled state is one that a virtual motion without dilatancy produces. Neither says that all
    multipliers below one that stands do so too.

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
    made: list[tuple[float, Word]] = []
    stands: float | None = None
    above: tuple[float, Word] | None = None
    model = replace(assembly, contacts=result.contacts)
    # just below the limit first: where friction is not at its limit the two agree
    queue = [0.999 * result.lower, 0.0]
    while len(made) < trials:
        if queue:
            t = queue.pop(0)
        elif stands is None or above is None:
            break
        else:
            t = (stands + above[0]) / 2.0
            if above[0] - stands <= 1e-3 * result.lower:
                break
        progress(f"coupled analysis at {t:.4g}")
        word = check(*multiplied(model, result.live, settings, t)).verdict
        made.append((t, word))
        if word == "stable":
            stands = t
            if above is None:
                break
        elif above is None or t < above[0]:
            above = t, word
            if t == 0.0:
                break
    return CoupledBracket(stands, None if above is None else above[0], None if above is None else above[1], tuple(made))


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
