"""Gauss-Newton on the equations of a coupled state, and the repair of the sets that they hold on.

On given sets (points that press, and those of them that rub) a state solves A f = -p and, per point that is shut, rubs,
is at its bound or slow,

    dn + 1 = 0        (fu dv - fv du) / (|f_t| |dd_t|) = 0        |f_t| - mu fn = 0        e.dd_t + beta = 0

the last, with e = f_t / |f_t|, where a point would otherwise slide less than beta, or the wrong way. A step is the one
of least norm that zeroes the linearised equations, each force measured by its own size so that small forces stay small
(see `kkt`, with W = size squared); two or three reach rounding. What then violates an inequality joins the equations.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from cyclopean.analysis.coupled.kkt import Doubled, Eliminated, PointRows
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.arrays import Bools, Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["BlockNewton", "Sets"]

STEPS = 20  # of Newton at most
FACTORISATIONS = 8  # two or three are usual; sets that contradict each other take more and gain nothing
SLACK = 1e-11  # of rows without forces, in units where displacements are about 1
EXACT = 1e-14  # residual at which to stop
FINE = 1e-9  # ... and from which a step that gains little is due to rounding
CHORD = 0.1  # contraction with which the last factorisation is good enough
SLOW = 0.5  # share of the least residual left that counts as no progress
LEFT = 1e-3  # share of the residual that a step may leave of its linearised equations
PATIENCE = 1  # such steps in a row that are allowed
SOLVED = 1e-7  # residual of the equations beyond which they contradict each other: then no repair helps
REPAIRS = 12  # rounds of moving violators into the equations; more than five are rare
SLIDE = 2.0  # beta_min that a slow point is made to slide


@dataclass(frozen=True, slots=True, eq=False)
class Sets:
    """Which points the equations of a state hold at, (q,) each."""

    pressed: Bools  # forces
    shut: Bools  # dn = -1; contains those pressed
    rubbing: Bools  # friction, within those pressed
    edge: Bools  # |f_t| = mu fn, within those rubbing
    slow: Bools  # |dd_t| = 2 beta_min, within those rubbing

    @classmethod
    def of(cls, pressed: Bools, rubbing: Bools, edge: Bools | None = None) -> "Sets":
        """(q,) each: points that press and rub as told, some of them at their bound."""
        none = np.zeros_like(pressed)
        return cls(pressed, pressed, rubbing, none if edge is None else edge & rubbing, none)

    def same(self, other: "Sets") -> bool:
        """Whether the equations are the same."""
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in self.__slots__)

    def without(self, f: Floats) -> Floats:
        """(q, 3) forces off the sets made exactly zero."""
        kept = np.where(self.pressed[:, None], f, 0.0)
        kept[~self.rubbing, 1:] = 0.0
        return kept

    def mended(self, system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats) -> "Sets":
        """Other sets: what violates an inequality at (f, dq) moves into the equations.

        Points that pull are let go, friction beyond its bound is put on it, points pressed too far are shut, and those
        that slide too little or the wrong way are made to slide.
        """
        d, f = system.gap(dq), f / system.lighter[:, None]
        tangent, along = np.hypot(f[:, 1], f[:, 2]), np.sum(f[:, 1:] * d[:, 1:], 1)
        pressed = self.pressed & ~(f[:, 0] < -1e-12)
        rubbing = self.rubbing & pressed & (system.mu * f[:, 0] > 1e-12)
        beyond = tangent > system.mu * f[:, 0] + 1e-11
        stuck = (along > 0.0) | (np.hypot(d[:, 1], d[:, 2]) < bounds.beta)
        shut = self.shut | (d[:, 0] < -1.0 - 1e-10)
        return Sets(pressed, shut, rubbing, (self.edge | beyond) & rubbing, (self.slow | stuck) & rubbing)


class BlockNewton:
    """Gauss-Newton for one system; the ordering of its matrix is shared by all choices of sets."""

    def __init__(self, system: EquilibriumSystem, bounds: Bounds, doubled: Doubled | None = None) -> None:
        self.system, self.bounds = system, bounds
        self.doubled = Doubled(Schur(system)) if doubled is None else doubled

    def repaired(
        self, sets: Sets, f: Floats, dq: Floats, tried: list[Sets], rounds: int = REPAIRS
    ) -> Iterator[tuple[Floats, Floats]]:
        """Answers from (f, dq) on these sets, then on sets mended by what each answer violates; none of `tried`."""
        for _ in range(rounds):
            if not sets.pressed.any() or any(sets.same(other) for other in tried):
                return
            tried.append(sets)
            near, moved, worst = self.solve(sets, f, dq)
            yield near, moved
            if not (worst <= SOLVED):
                return
            sets = sets.mended(self.system, self.bounds, near, moved)

    def solve(self, sets: Sets, f: Floats, dq: Floats) -> tuple[Floats, Floats, float]:
        """The best pair met from (f, dq) on, and what it leaves of the equations; forces off the sets exactly zero.

        Parameters
        ----------
        sets : Sets
            Which equations hold where.
        f, dq : (q, 3), (6 m,)
            Start.
        """
        f = sets.without(f)
        best, last, idle, factored = (np.inf, f, dq), np.inf, 0, 0
        local: Eliminated | None = None
        none = np.zeros_like(f)
        for _ in range(STEPS):
            off, rows = self.system.residual(f), self._rows(sets, f, dq)
            worst = _left(1.0, off, rows.r)
            idle = idle + 1 if worst > SLOW * best[0] else 0
            if worst < best[0]:
                best = (worst, f, dq)
            if worst <= EXACT or not (worst < np.inf) or idle > PATIENCE or (idle and last < FINE):
                break
            if local is None or worst > CHORD * last:
                if factored == FACTORISATIONS:
                    break
                try:
                    local, factored = self._eliminated(sets, rows, f), factored + 1
                except (SolverError, np.linalg.LinAlgError):
                    break
            last = worst
            step = local.refined(off, rows.r, none, none, partial(_left, max(LEFT * worst, EXACT)))
            f, dq = f + step.df, dq + step.dq
        return best[1], best[2], best[0]

    def _eliminated(self, sets: Sets, rows: PointRows, f: Floats) -> Eliminated:
        W, size = np.zeros((len(f), 3, 3)), np.hypot(f[:, 1], f[:, 2])
        W[:, 0, 0] = np.where(sets.pressed, np.maximum(np.abs(f[:, 0]), 1e-9) ** 2, 0.0)
        W[:, 1, 1] = W[:, 2, 2] = np.where(sets.rubbing, np.maximum(size, 1e-9) ** 2, 0.0)
        return Eliminated(self.doubled, self.system, (W, np.zeros_like(W)), rows, rows.slack(SLACK))

    def _rows(self, sets: Sets, f: Floats, dq: Floats) -> PointRows:
        """The equations at (f, dq): shut, sine, bound, slow."""
        d, mu, tangent = self.system.gap(dq), self.system.mu, np.hypot(f[:, 1], f[:, 2])
        rows = PointRows.empty(len(f), 4)
        rows.shut(sets.shut, d)
        rows.sine(sets.rubbing, f, d)
        k = np.flatnonzero(sets.edge)
        size = 1.0 / np.maximum(tangent[k], 1e-9)
        rows.r[k, 2] = (tangent[k] - mu[k] * f[k, 0]) * size
        rows.C[k, 2, 0] = -mu[k] * size
        rows.C[k, 2, 1:] = f[k, 1:] * (size / np.maximum(tangent[k], 1e-290))[:, None]
        k = np.flatnonzero(sets.slow)
        e = f[k, 1:] / np.maximum(tangent[k], 1e-300)[:, None]
        along = np.sum(e * d[k, 1:], 1)
        rows.r[k, 3], rows.G[k, 3, 1:] = along + SLIDE * self.bounds.beta, e
        rows.C[k, 3, 1:] = (d[k, 1:] - along[:, None] * e) / np.maximum(tangent[k], 1e-9)[:, None]
        return rows


def _left(unit: float, off: Floats, r: Floats) -> float:
    """The largest residual, in units."""
    return max(float(np.max(np.abs(off), initial=0.0)), float(np.max(np.abs(r), initial=0.0))) / unit
