"""From nearly a coupled state to one that is exact to rounding: active sets, then joint Gauss-Newton.

A solver leaves every force a little positive and every direction a little off. Here it is decided which points press
(E: fn > theta (dn + 1)) and which of them rub (T: |f_t| > tau); forces elsewhere become exactly zero, and the rest of
the state is a square root of a small system in forces and motion together:

    A f = -p        dn = -1 on E        (fu dv - fv du) / (|f_t| |dd_t|) = 0 on T

The last row is the sine of the angle between friction and sliding. Gauss-Newton steps of least norm, every force column
scaled by the force's own size so that small forces stay small, reach rounding in two or three. What then violates an
inequality joins the equations: points pressed below -1 get dn = -1 without a force, tension is dropped, friction beyond
its cone is put on the edge |f_t| = mu fn.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.coupled.states import Bounds, Residuals, measure, merit
from cyclopean.arrays import Bools, Floats
from cyclopean.errors import SolverError
from cyclopean.solvers import Factor, Symbolic, analyse
from cyclopean.statics import EquilibriumSystem

__all__ = ["Attempt", "Sets", "attempt", "better", "gauss_newton", "nothing", "polish", "total_merit"]

LADDER = ((1.0, 1e-6), (1e-3, 1e-6), (1.0, 1e-8), (1.0, 1e-4), (1e3, 1e-6))  # theta, tau
PRESSED = 1e-9  # weights of the lighter block: below that a point carries nothing
STEPS = 8  # of Gauss-Newton; two or three are usual
REPAIRS = 12  # rounds of moving violators into the equations; more than five are rare
EXACT = 2e-14  # residual of the equations at which to stop
SOLVED = 1e-9  # ... and beyond which they contradict each other: then no repair helps
DENSE = 120  # rows up to which a dense least-squares solution is the cheapest
SOUND = 1e-6  # residuals of a triple whose merit means something
SHIFT = 1e-11  # of J J', relative to its diagonal
ROUNDS = 12  # of conjugate gradients
SLOW = 0.3  # a step that leaves more than this share of the residual makes no progress


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """What a route of the search brought home: a state, or the best triple it met."""

    f: Floats  # (q, 3)
    dq: Floats  # (6 m,)
    residuals: Residuals
    merit: float  # of forces that balance and a motion within its bounds; infinite for others
    infeasible: bool = False  # the solver says that no forces balance the loads
    solves: int = 0
    rounds: int = 0
    iterations: int = 0  # of the solver, a factorisation each

    @property
    def found(self) -> bool:
        """Whether this is a state."""
        return self.residuals.accepted


@dataclass(frozen=True, slots=True, eq=False)
class Sets:
    """Which points the equations of a state hold at."""

    pressed: Bools  # (q,) E, forces
    shut: Bools  # (q,) dn = -1; contains E
    rubbing: Bools  # (q,) T, within E
    edge: Bools  # (q,) |f_t| = mu fn, within T

    def same(self, other: "Sets") -> bool:
        """Whether the equations are the same."""
        return all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in ("pressed", "shut", "rubbing", "edge")
        )


def attempt(system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats) -> Attempt:
    """The triple as it stands, measured."""
    residuals = measure(system, bounds, f, dq)
    r = residuals
    sound = np.max([r.equilibrium, r.cone, r.gap, r.reach]) <= SOUND
    return Attempt(f, dq, residuals, total_merit(system, bounds, f, dq) if sound else np.inf)


def nothing(system: EquilibriumSystem, bounds: Bounds) -> Attempt:
    """No forces and no motion: what a search starts from."""
    return attempt(system, bounds, np.zeros((system.points, 3)), np.zeros(len(system.p)))


def total_merit(system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats) -> float:
    """Sum of the merit over all points."""
    normal, tangential = merit(system, bounds, f, dq)
    return float(normal.sum() + tangential.sum())


def better(one: Attempt, other: Attempt) -> Attempt:
    """A state rather than none, then the smaller merit."""
    if one.found or not (other.found or other.merit < one.merit):
        return one
    return other


def polish(
    system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats, choices: int = len(LADDER)
) -> tuple[Floats, Floats, Residuals]:
    """Look for an exact state near (f, dq); stops at the first that is accepted.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, q points.
    bounds : Bounds
        With eps = 1.
    f : (q, 3)
        Scaled forces, nearly a state.
    dq : (6 m,)
        Their displacement.
    choices : int
        How many ways of choosing the sets to try; most successes come from the first.

    Returns
    -------
    f, dq, residuals
        The best triple met, the given one included. Forces off E and friction off T are exactly zero.
    """
    best = (f, dq, measure(system, bounds, f, dq))
    if best[2].accepted or not (np.isfinite(f).all() and np.isfinite(dq).all()):
        return best
    tried: list[Sets] = []
    for theta, tau in LADDER[:choices]:
        sets = _chosen(system, f, dq, theta, tau)
        for _ in range(REPAIRS):
            if not sets.pressed.any() or any(sets.same(other) for other in tried):
                break
            tried.append(sets)
            near_f, near_dq, off = gauss_newton(system, sets, f, dq)
            residuals = measure(system, bounds, near_f, near_dq)
            if not (best[2].worst <= residuals.worst):
                best = (near_f, near_dq, residuals)
            if residuals.accepted:
                return best
            if not (off <= SOLVED):
                break
            sets = _mended(system, sets, near_f, near_dq)
    return best


def _chosen(system: EquilibriumSystem, f: Floats, dq: Floats, theta: float, tau: float) -> Sets:
    gap, f = system.gap(dq)[:, 0] + 1.0, f / system.lighter[:, None]
    pressed = (f[:, 0] > theta * gap) & (f[:, 0] > PRESSED)
    rubbing = pressed & (np.hypot(f[:, 1], f[:, 2]) > tau) & (system.mu > 0.0)
    return Sets(pressed, pressed, rubbing, np.zeros(system.points, bool))


def _mended(system: EquilibriumSystem, sets: Sets, f: Floats, dq: Floats) -> Sets:
    """Move what violates an inequality into the equations."""
    gap, f = system.gap(dq)[:, 0] + 1.0, f / system.lighter[:, None]
    tangent = np.hypot(f[:, 1], f[:, 2])
    pulling = sets.pressed & (f[:, 0] < -1e-12)
    pressed = sets.pressed & ~pulling
    rubbing = sets.rubbing & pressed & (system.mu * f[:, 0] > 1e-12)
    beyond = tangent > system.mu * f[:, 0] + 1e-11
    return Sets(pressed, sets.shut | (gap < -1e-10), rubbing, (sets.edge | beyond) & rubbing)


def gauss_newton(system: EquilibriumSystem, sets: Sets, f: Floats, dq: Floats) -> tuple[Floats, Floats, float]:
    """Solve the equations of `sets` from (f, dq) by steps of least scaled norm.

    Returns
    -------
    f, dq, worst
        The best iterate and the largest residual of its equations.
    """
    f = np.where(sets.pressed[:, None], f, 0.0)
    f[~sets.rubbing, 1:] = 0.0
    rows, least_norm = _Rows(system, sets), _LeastNorm()
    best, idle = (np.inf, f, dq), 0
    for _ in range(STEPS):
        off, jacobian, scale = rows.linearised(f, dq)
        worst = float(np.max(np.abs(off), initial=0.0))
        if not (worst < best[0]):
            break
        idle = idle + 1 if worst > SLOW * best[0] else 0
        best = (worst, f, dq)
        if worst <= EXACT or idle > 1 or (idle and worst < 1e-11):
            break
        try:
            step = least_norm.solve(jacobian, -off) * scale
        except (SolverError, np.linalg.LinAlgError):
            break
        f, dq = rows.moved(f, dq, step)
    return best[1], best[2], best[0]


class _Rows:
    """The equations of one choice of sets, laid out for many steps."""

    def __init__(self, system: EquilibriumSystem, sets: Sets) -> None:
        self.system = system
        self.E, self.R, self.T, self.L = (np.flatnonzero(s) for s in (sets.pressed, sets.shut, sets.rubbing, sets.edge))
        self.columns = np.concatenate([3 * self.E, 3 * self.T + 1, 3 * self.T + 2])
        gaps = system.A.T.tocsr()
        self.balance = gaps[self.columns].T.tocsr()
        self.shut, self.u, self.v = gaps[3 * self.R], gaps[3 * self.T + 1], gaps[3 * self.T + 2]
        place = np.full(system.points, -1)
        place[self.E] = np.arange(len(self.E))
        self.edge_n = place[self.L]
        place[self.T] = np.arange(len(self.T))
        self.edge_t = place[self.L]

    def linearised(self, f: Floats, dq: Floats) -> tuple[Floats, Any, Floats]:
        """Residual, its Jacobian with scaled columns, and the scale of each column."""
        T, L, system = self.T, self.L, self.system
        d = system.gap(dq)
        tangent, slide = np.hypot(f[T, 1], f[T, 2]), np.hypot(d[T, 1], d[T, 2])
        weight = 1.0 / np.maximum(tangent * slide, 1e-9)
        sine = (f[T, 1] * d[T, 2] - f[T, 2] * d[T, 1]) * weight
        limit = np.hypot(f[L, 1], f[L, 2])
        off = np.concatenate([system.residual(f), d[self.R, 0] + 1.0, sine, limit - system.mu[L] * f[L, 0]])
        force = np.maximum(np.concatenate([np.abs(f[self.E, 0]), tangent, tangent]), 1e-9)
        turn = sp.diags(weight * f[T, 1]) @ self.v - sp.diags(weight * f[T, 2]) @ self.u
        nE, nT = len(self.E), len(T)
        twist = sp.hstack(
            [
                sp.csr_matrix((nT, nE)),
                sp.diags(weight * d[T, 2] * force[nE : nE + nT]),
                sp.diags(-weight * d[T, 1] * force[nE : nE + nT]),
            ]
        )
        blocks: list[list[Any]] = [[self.balance @ sp.diags(force), None], [None, self.shut], [twist, turn]]
        if len(L):
            blocks.append([self._edge(f, limit, force), None])
        return off, sp.bmat(blocks, format="csr"), np.concatenate([force, np.ones(len(dq))])

    def _edge(self, f: Floats, limit: Floats, force: Floats) -> Any:
        nE, nT, count = len(self.E), len(self.T), len(self.L)
        column = np.concatenate([self.edge_n, nE + self.edge_t, nE + nT + self.edge_t])
        along = f[self.L, 1:] / np.maximum(limit, 1e-300)[:, None]
        value = np.concatenate([-self.system.mu[self.L], along[:, 0], along[:, 1]]) * force[column]
        return sp.csr_matrix((value, (np.tile(np.arange(count), 3), column)), shape=(count, nE + 2 * nT))

    def moved(self, f: Floats, dq: Floats, step: Floats) -> tuple[Floats, Floats]:
        """Apply a step of (forces, motion)."""
        flat = f.ravel().copy()
        flat[self.columns] += step[: len(self.columns)]
        return flat.reshape(-1, 3), dq + step[len(self.columns) :]


class _LeastNorm:
    """The x of least norm with J x = b, or nearest to it; J may be rank deficient. Orders a pattern once."""

    def __init__(self) -> None:
        self.symbolic: Symbolic | None = None

    def solve(self, J: Any, b: Floats) -> Floats:
        """Dense where that is cheapest, else conjugate gradients on |b - J x|^2 in the metric of (J J' + shift)^-1.

        In that metric all singular values beyond sqrt(shift) count as one, so one step settles them; each of the few
        below takes one more. Started from zero it tends to the least norm, and a part of b out of reach does no harm.
        """
        if min(J.shape) <= DENSE:
            found: Floats = np.linalg.lstsq(J.toarray(), b, rcond=1e-11)[0]
            return found
        factor = self._factor(J)
        x, best = np.zeros(J.shape[1]), np.zeros(J.shape[1])
        left, lifted = b, factor.solve(b)
        goal = least = float(np.max(np.abs(b), initial=0.0))
        slope = J.T @ lifted
        towards, power = slope, float(slope @ slope)
        for _ in range(ROUNDS):
            along = J @ towards
            raised = factor.solve(along)
            if not (power > 0.0 and (curvature := float(along @ raised)) > 0.0):
                break
            x = x + power / curvature * towards
            left, lifted = left - power / curvature * along, lifted - power / curvature * raised
            now = float(np.max(np.abs(left), initial=0.0))
            if now < least:
                best, least = x, now
            if now <= 1e-15 + 1e-10 * goal:
                break
            slope = J.T @ lifted
            before, power = power, float(slope @ slope)
            towards = slope + power / before * towards
        return best

    def _factor(self, J: Any) -> Factor:
        normal = J @ J.T
        shift = SHIFT * (normal.diagonal() + 1e-3)
        lower = sp.tril(normal + sp.diags(shift), format="csc")  # with every diagonal entry, zero rows too
        lower.sort_indices()
        known = self.symbolic
        if known is None or not (
            np.array_equal(known.indptr, lower.indptr) and np.array_equal(known.indices, lower.indices)
        ):
            known = analyse(lower.indptr.astype(np.int64), lower.indices.astype(np.int64), threads=1)
            self.symbolic = known
        return known.factor(lower.data)
