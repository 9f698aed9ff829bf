"""Limit analysis by a structured interior point: one factorisation of S = A D A' an iteration."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.load_family import Pencil
from cyclopean.analysis.quadratic_cones import (
    REFLECT,
    apply,
    condensed,
    lifted,
    longest,
    nesterov_todd,
    product,
    quotient,
    scaled,
)
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import Schur

__all__ = ["SCALE", "SMALLEST_MU", "LimitPoint", "Start", "limit_interior"]

SMALLEST_MU = 1e-6  # below this the cone is too thin for the scaling x = (mu fn, ft); the conic solver takes it
PATIENCE = 4  # iterations without gain after which rounding has the upper hand
CORRECTORS = 3  # at most: each costs two solves, and a factorisation costs more
SLOW = 1e-2  # velocities to begin with: q'y = 1 makes those of many blocks small
SCALE = 1e-3  # multiplier below which the gap is absolute
REFINED = 4  # rounds of refinement of a solve, at most
SHIFT = 1e-13  # of the largest entry of D: S is singular where few contacts are engaged


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


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """An iterate of the homogeneous embedding."""

    x: Floats  # (q, 3) in Q3
    z: Floats  # (q, 3) in Q3
    y: Floats  # (6 m,)
    s: float
    tau: float
    kappa: float

    def moved(self, d: "_Point", length: float) -> "_Point":
        """The point `length` along `d`."""
        return _Point(*(getattr(self, n) + length * getattr(d, n) for n in ("x", "z", "y", "s", "tau", "kappa")))


@dataclass(frozen=True, slots=True, eq=False)
class _Off:
    """What an iterate misses of the four equations."""

    force: Floats  # A x + p0 tau + q s
    motion: Floats  # A'y - z
    power: float  # q'y - tau
    gap: float  # kappa - s - p0'y


class _Task:
    """The problem in x = (mu fn, fu, fv): f = stretch * x."""

    def __init__(self, loads: Pencil, schur: Schur) -> None:
        self.loads, self.system, self.schur = loads, loads.system, schur
        self.stretch = np.ones((self.system.points, 3))
        self.stretch[:, 0] = 1.0 / self.system.mu
        self.scale = self.stretch[:, :, None] * self.stretch[:, None, :]

    def push(self, x: Floats) -> Floats:
        """A f."""
        return np.asarray(self.system.A @ (self.stretch * x).ravel())

    def pull(self, y: Floats) -> Floats:
        """The adjoint of `push`."""
        return self.stretch * self.system.gap(y)

    def off(self, at: _Point) -> _Off:
        """Residuals."""
        p0, q = self.system.p, self.loads.q
        return _Off(
            self.push(at.x) + at.tau * p0 + at.s * q,
            self.pull(at.y) - at.z,
            float(q @ at.y) - at.tau,
            at.kappa - at.s - float(p0 @ at.y),
        )


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

    The dual is min -p0'y over mechanisms: A'y in K*, q'y = 1. With x = (mu fn, fu, fv) and z = A'y scaled likewise in
    Q3, the embedding reads

        A x + p0 tau + q s = 0      A'y = z      q'y = tau      s + p0'y = kappa >= 0

    and its limit with tau > 0 is a pair of optimal solutions; with kappa > 0 either p0'y > 0 for a mechanism that the
    live loads do no work in (infeasible), or s > 0 for forces that balance live loads alone (unbounded). Every step is
    solved on one factorisation of S = A W^2 A' (W the Nesterov-Todd scaling), bordered by p0 and q.

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

    References
    ----------
    .. [NT] Nesterov, Todd: Primal-dual interior-point methods for self-scaled cones. SIAM J. Optim. 8 (1998).
    .. [YTM] Ye, Todd, Mizuno: An O(sqrt n L)-iteration homogeneous and self-dual linear programming algorithm. Math.
       Oper. Res. 19 (1994).

    Raises
    ------
    SolverError
        A friction coefficient is below `SMALLEST_MU`, or S cannot be factorised.
    """
    if loads.system.points and loads.system.mu.min() < SMALLEST_MU:
        raise SolverError(f"the interior point needs mu >= {SMALLEST_MU:g}")
    task = _Task(loads, schur)
    at = _first(task, start)
    compatible = start.y is not None
    best, least, idle = _told(task, at, at.y, 0), np.inf, 0
    for step in range(1, cap + 1):
        if budget.over:
            break
        off = task.off(at)
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                at, exact = _iterate(task, at, off, compatible)
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


def _told(task: _Task, at: _Point, exact: Floats, step: int) -> LimitPoint:
    """What an iterate stands for, with a motion that is nearly a mechanism."""
    p0, power = task.system.p, float(task.loads.q @ exact)
    f, s = task.stretch * at.x / at.tau, at.s / at.tau
    y = exact / power if power > 0.0 else exact
    residual = float(np.max(np.abs(task.off(at).force), initial=0.0)) / at.tau
    left = abs(-float(p0 @ y) - s) / (SCALE + abs(s)) if power > 0.0 else np.inf
    return LimitPoint("unfinished", f, s, y, residual, left, step)


def _diverged(task: _Task, at: _Point, step: int) -> LimitPoint | None:
    """A ray of forces, or a mechanism at every multiplier, once it is one to 1e-8."""
    p0, q = task.system.p, task.loads.q
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


def _first(task: _Task, start: Start) -> _Point:
    """What there is to start from; else the least-norm solution of A x = -p0, lifted into the cones, and z on axes."""
    if start.f is None:
        D = np.zeros((task.system.points, 3, 3))
        D[:, range(3), range(3)] = 1.0
        y = task.schur.factor(D * task.scale, 1e-9).solve(-task.system.p)
        x = lifted(task.pull(y))
    else:
        x = start.f / task.stretch
    if start.y is None:
        y, z = np.zeros(task.schur.size), np.zeros((task.system.points, 3))
        z[:, 0] = SLOW
    else:
        y = SLOW * start.y
        z = task.pull(y)
    kappa = SLOW if start.f is None else float(np.sum(x * z)) / len(x)
    return _Point(x, z, y, 0.0, 1.0, kappa)


def _iterate(task: _Task, at: _Point, off: _Off, compatible: bool) -> tuple[_Point, Floats]:
    """One predictor and corrector on one factorisation; and y made a mechanism, as far as that goes.

    Where it is none yet (not `compatible`) the last is the step dy that brings A'(y + dy) nearest to z in the metric of
    D: contacts that are engaged, of which z is near its cone's side, get their z exactly, and what is left goes to
    those that part.
    """
    x, z, tau, kappa = at.x, at.z, at.tau, at.kappa
    p0, q = task.system.p, task.loads.q
    w, ratio = nesterov_todd(x, z)
    back = REFLECT * w, 1.0 / ratio
    D = condensed(w, ratio, 0.0, 0.0)
    middle = scaled(w, ratio, z)
    largest = float(np.max(D, initial=1.0))
    factor = task.schur.factor(D * task.scale, SHIFT * min(largest, 1e3))

    def solved(rhs: Floats) -> Floats:
        y = factor.solve(rhs)
        enough = 1e-13 * (1e-3 + float(np.max(np.abs(rhs), initial=0.0)))
        least = np.inf
        for _ in range(REFINED):
            left = rhs - task.push(apply(D, task.pull(y)))
            worst = float(np.max(np.abs(left), initial=0.0))
            if worst <= enough or not (worst < 0.5 * least):
                break
            y, least = y + factor.solve(left), worst
        return y

    exact = None if compatible else at.y - solved(task.push(apply(D, off.motion)))
    along_q, along_p = solved(q), solved(p0)
    # unknowns ds, dtau: the power and the gap equations once dy is eliminated
    corner_matrix = np.array(
        [
            [-float(q @ along_q), 1.0 - float(q @ along_p)],
            [-1.0 - float(p0 @ along_q), -kappa / tau - float(p0 @ along_p)],
        ]
    )

    def step(share: float, target: Floats, corner: float) -> _Point:
        """Newton step: residuals cut by `share`, W^-1 dx + W dz = target, kappa dtau + tau dkappa = corner."""
        pushed = scaled(w, ratio, target) + share * apply(D, -off.motion)
        base = solved(share * off.force + task.push(pushed))
        rhs = np.array([share * off.power + float(q @ base), -share * off.gap - corner / tau + float(p0 @ base)])
        ds, dtau = np.linalg.solve(corner_matrix, rhs)
        dy = base + ds * along_q + dtau * along_p
        dz = task.pull(dy) + share * off.motion
        dx = scaled(w, ratio, target) - apply(D, dz)
        return _Point(dx, dz, dy, float(ds), float(dtau), (corner - kappa * float(dtau)) / tau)

    d = step(1.0, -middle, -kappa * tau)
    centre = (1.0 - min(1.0, _room(at, d))) ** 3
    mean = centre * (float(np.sum(x * z)) + tau * kappa) / (len(x) + 1)
    best, reach = d, 0.0
    for _ in range(CORRECTORS):
        target = -product(middle, middle) - product(scaled(*back, d.x), scaled(w, ratio, d.z))
        target[:, 0] += mean
        d = step(1.0 - centre, quotient(middle, target), mean - kappa * tau - d.tau * d.kappa)
        room = min(1.0, 0.99 * _room(at, d))
        if not (room > 1.05 * reach):
            break
        best, reach = d, room
    there = at.moved(best, reach)
    return there, there.y if exact is None else exact


def _room(at: _Point, d: _Point) -> float:
    """Largest step along d that keeps every cone."""
    room = min(longest(at.x, d.x), longest(at.z, d.z))
    if d.tau < 0.0:
        room = min(room, -at.tau / d.tau)
    if d.kappa < 0.0:
        room = min(room, -at.kappa / d.kappa)
    return room
