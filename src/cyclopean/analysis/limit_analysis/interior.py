"""Limit analysis by a structured interior point: one factorisation of S = A D A' an iteration."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cyclopean.analysis.embedding import SMALLEST_MU, Embedding, Point
from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.load_family import Pencil
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import Schur

__all__ = ["SCALE", "SMALLEST_MU", "LimitPoint", "Start", "limit_interior"]

PATIENCE = 4  # iterations without gain after which rounding has the upper hand
SLOW = 1e-2  # velocities to begin with: q'y = 1 makes those of many blocks small
SCALE = 1e-3  # multiplier below which the gap is absolute


@dataclass(frozen=True, slots=True, eq=False)
class LimitPoint:
    """Where a solver stopped: forces and multiplier, mechanism, and what they are claimed to be."""

    word: Literal["solved", "unbounded", "infeasible", "unfinished"]
    f: Floats  # (q, 3); a ray when unbounded
    s: float
    y: Floats  # (6 m,) q'y = 1; a mechanism at every multiplier when infeasible
    residual: float  # max |A f + p0 + s q|
    gap: float  # |s + p0'y|, relative
    steps: int


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Points well inside both cones to begin with; None where there is none, or none was found.

    From there on equilibrium and compatibility hold throughout, so that every iterate is a pair of proved bounds: the
    search may stop anywhere. Without them they hold in the limit only.
    """

    f: Floats | None = None  # (q, 3) inside K, balances p0
    y: Floats | None = None  # (6 m,) A'y inside K*


def limit_interior(
    loads: Pencil,
    schur: Schur,
    proves: Callable[[Floats], float] | None = None,
    cap: int = 100,
    gap: float = 1e-7,
    start: Start = Start(),
    budget: Budget = UNLIMITED,
) -> LimitPoint:
    """Max s subject to A f = -(p0 + s q), f in K, by an interior point on its homogeneous embedding.

    The dual is min -p0'y over mechanisms: A'y in K*, q'y = 1. Of the embedding (see `embedding`) the limit with
    tau > 0 is a pair of optimal solutions; with kappa > 0 either p0'y > 0 for a mechanism that the live loads do no
    work in (infeasible), or s > 0 for forces that balance live loads alone (unbounded).

    Parameters
    ----------
    loads : Pencil
        Dead and live loads.
    schur : Schur
        S of the same system.
    proves : callable, optional
        Gives the multiplier from which a motion proves collapse; asked when all else says that the gap is closed,
        and at the end.
    cap : int
        Most factorisations.
    gap : float
        Relative distance of s from what the motion proves at which to stop.
    start : Start
        Where to begin.
    budget : Budget
        When to stop whatever the gap.

    Raises
    ------
    SolverError
        A friction coefficient is below `SMALLEST_MU`, or S cannot be factorised.
    """
    task = Embedding(loads.system, schur, loads.q)
    at = _first(task, start)
    compatible = start.y is not None
    best, least, idle = _told(task, at, at.y, 0), np.inf, 0
    for step in range(1, cap + 1):
        if budget.over:
            break
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                at, exact = task.step(at, task.missed(at), compatible)
        except (SolverError, np.linalg.LinAlgError):  # rounding has won: the best so far stands
            break
        if not np.isfinite(at.tau + at.kappa + at.s):
            break
        if at.kappa > 1e3 * at.tau and (told := _diverged(task, at, step)) is not None:
            return told
        found = _told(task, at, exact, step)
        idle = 0 if found.gap < 0.9 * least else idle + 1
        if found.gap < least:
            best, least = found, found.gap
        if least <= gap and (proves is None or proves(best.y) - best.s <= 3.0 * gap * (SCALE + abs(best.s))):
            return replace(best, word="solved")
        if idle > PATIENCE * (1 if least < 1e-5 else 4):
            break
    return best


def _told(task: Embedding, at: Point, exact: Floats, step: int) -> LimitPoint:
    """What an iterate stands for, with a motion that is nearly a mechanism."""
    p0, power = task.system.p, float(task.border[:, 1] @ exact)
    f, s = task.stretch * at.x / at.tau, at.s / at.tau
    y = exact / power if power > 0.0 else exact
    residual = float(np.max(np.abs(task.missed(at).force), initial=0.0)) / at.tau
    left = abs(-float(p0 @ y) - s) / (SCALE + abs(s)) if power > 0.0 else np.inf
    return LimitPoint("unfinished", f, s, y, residual, left, step)


def _diverged(task: Embedding, at: Point, step: int) -> LimitPoint | None:
    """A ray of forces, or a mechanism at every multiplier, once it is one to 1e-8."""
    p0, q = task.border.T
    power = float(p0 @ at.y)
    if at.s > 0.0:
        off = float(np.max(np.abs(task.push(at.x) + at.s * q), initial=0.0)) / at.s
        if off <= 1e-8 * (1.0 + float(np.max(np.abs(at.x), initial=0.0)) / at.s):
            return LimitPoint("unbounded", task.stretch * at.x / at.s, 1.0, at.y, off, np.inf, step)
    if power > 0.0:
        off = float(np.max(np.abs(task.pull(at.y) - at.z), initial=0.0)) / power
        idle = abs(float(q @ at.y)) / power
        if max(off, idle) <= 1e-8:
            return LimitPoint("infeasible", at.x, np.nan, at.y / power, off, np.inf, step)
    return None


def _first(task: Embedding, start: Start) -> Point:
    """What there is to start from; else the least-norm solution of A x = -p0, lifted into the cones, and z on axes."""
    x = task.least_norm()[0] if start.f is None else start.f / task.stretch
    if start.y is None:
        y, z = np.zeros(task.schur.size), np.zeros((task.system.points, 3))
        z[:, 0] = SLOW
    else:
        y = SLOW * start.y
        z = task.pull(y)
    return Point(x, z, y, 1.0, SLOW if start.f is None else float(np.sum(x * z)) / len(x))
