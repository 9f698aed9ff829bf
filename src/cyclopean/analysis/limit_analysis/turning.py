"""The tilt at which a model with given loads falls: these stay as they are while gravity turns, so p is no line."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.live_load import sideways
from cyclopean.analysis.limit_analysis.load_family import Pencil
from cyclopean.analysis.limit_analysis.solving import LimitOutcome, solve_limit
from cyclopean.arrays import Floats
from cyclopean.statics import turned_gravity

__all__ = ["Turn", "solve_turning"]

ROUNDS = 20  # angles at most, a limit each
LAST_ROUND = 0.4  # of the time: is kept for the forces just below the angle found
NEAR = 2e-7  # rad: how far below the mechanism's angle forces are looked for
LAST = np.pi / 2 - 1e-6  # rad: tilts beyond a right angle are another question


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """What a turn found: forces at `low`, a mechanism at `high` (radians; None where that side is missing)."""

    low: float | None
    high: float | None
    outcome: LimitOutcome  # between gravity at `low` (multiplier 0) and at `high` (multiplier 1), as far as they exist


def solve_turning(
    at: Callable[[Floats, Floats], Pencil],
    gravity: Floats,
    azimuth: float,
    solver: str,
    budget: Budget = UNLIMITED,
) -> Turn:
    """Find the least tilt towards `azimuth` at which no forces balance weight and given loads.

    Newton's method along the curve p(theta) = c + a cos(theta) + b sin(theta): at each angle a limit problem along p'
    gives a mechanism y, and the next angle is the first at which p(theta)'y turns positive.

    Parameters
    ----------
    at : callable
        (gravity, live gravity) to a `Pencil`, given loads included.
    gravity : (3,)
        Before the tilt, m/s2.
    azimuth : float
        Degrees from +x to +y.
    solver : str
        As for `solve_limit`.
    budget : Budget
        When to stop.
    """
    turned = sideways(gravity, azimuth)

    def pull(theta: float) -> Floats:
        return turned_gravity(gravity, float(np.rad2deg(theta)), azimuth)

    def along(theta: float) -> Floats:
        return np.asarray(np.cos(theta) * turned - np.sin(theta) * (gravity - pull(np.pi)) / 2.0)

    theta, high, y_high = 0.0, np.inf, None
    outcome = LimitOutcome("undecided")
    for _ in range(ROUNDS):
        loads = at(pull(theta), along(theta))
        outcome = solve_limit(loads, solver, budget.before(LAST_ROUND))
        if theta == 0.0 and outcome.word == "falls":
            return Turn(None, 0.0 if outcome.upper <= 0.0 else None, outcome)
        if outcome.y is None:
            break
        found = _first(at, pull, outcome.y, theta)
        if found < high:
            high, y_high = found, outcome.y
        if not (found < LAST) or abs(found - theta) <= 1e-3 * NEAR or outcome.late:
            break
        theta = found
    if y_high is None or not (high < LAST):
        return _standing(at, pull, along, LAST, solver, budget)
    low = _standing(at, pull, along, max(high - NEAR, 0.0), solver, budget)
    word: Literal["limit", "undecided"] = "limit" if low.low is not None else "undecided"
    if low.low is None and outcome.late:  # nothing is known but what stood without a tilt
        low = _standing(at, pull, along, 0.0, solver, budget)
    both = replace(low.outcome, word=word, upper=1.0, y=y_high, late=outcome.late)
    return Turn(low.low, high + 1e-9 * high, both)


def _first(at: Callable[[Floats, Floats], Pencil], pull: Callable[[float], Floats], y: Floats, near: float) -> float:
    """The angle nearest to `near` at which p(theta)'y turns positive, from three values of c + a cos + b sin."""
    none = np.zeros(3)
    unit = at(pull(0.0), pull(0.5)).system.force_unit

    def work(theta: float) -> float:
        system = at(pull(theta), none).system
        return float(system.p @ y) * system.force_unit / unit

    w0, w1, w2 = work(0.0), work(np.pi / 2), work(np.pi)
    c, a = (w0 + w2) / 2.0, (w0 - w2) / 2.0
    b = w1 - c
    size = float(np.hypot(a, b))
    if not size > abs(c):
        return np.inf if c <= 0.0 else 0.0
    turn = float(np.arctan2(b, a)) - float(np.arccos(-c / size))  # where it rises through zero
    turn += 2.0 * np.pi * round((near - turn) / (2.0 * np.pi))
    return turn if turn >= 0.0 else 0.0


def _standing(
    at: Callable[[Floats, Floats], Pencil],
    pull: Callable[[float], Floats],
    along: Callable[[float], Floats],
    theta: float,
    solver: str,
    budget: Budget,
) -> Turn:
    """Forces at one angle, between those furthest along the tangent both ways."""
    loads = at(pull(theta), along(theta))
    ahead = solve_limit(loads, solver, budget.before(LAST_ROUND / 2.0))
    behind = solve_limit(loads.turned(), solver, budget)
    none = LimitOutcome("undecided", provenance=ahead.provenance)
    if ahead.f is None or behind.f is None or not (ahead.lower >= 0.0 and behind.lower >= 0.0):
        return Turn(None, None, none)
    whole = ahead.lower + behind.lower
    share = behind.lower / whole if whole > 0.0 else 0.5
    f = share * ahead.f + (1.0 - share) * behind.f
    word: Literal["unbounded", "undecided"] = "unbounded" if theta == LAST else "undecided"
    return Turn(theta, None, LimitOutcome(word, 0.0, f=f, provenance=ahead.provenance))
