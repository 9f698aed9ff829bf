"""One step of an interior point for forces in friction cones, on one factorisation of S = A D A'.

    min  1/2 x'H x - s    s.t.  A f + p + s q = 0,  f = stretch x in K

With x = (mu fn, fu, fv) the cones become Q3 = {x0 >= |(x1, x2)|}; multipliers z in Q3, velocities y. H is diagonal or
zero; without live loads q there is no s. The homogeneous embedding adds tau and kappa >= 0:

    A x + p tau + q s = 0     H x + A'y = z     q'y = tau     x'H x / tau - s - p'y + kappa = 0

In the limit tau > 0 gives forces x / tau, kappa > 0 a mechanism y. The 3 x 3 Nesterov-Todd scalings W give
D = (H + W^-2)^-1, and predictor and corrector are solved with S, bordered by p and q.

References
----------
.. [NT] Nesterov, Todd: Primal-dual interior-point methods for self-scaled cones. SIAM J. Optim. 8 (1998).
.. [CVX] Vandenberghe: The CVXOPT linear and quadratic cone program solvers (2010), for scalings and step lengths.
.. [Clarabel] Goulart, Chen: Clarabel, arXiv 2405.12762 (2024), for the embedding with a quadratic objective.
.. [YTM] Ye, Todd, Mizuno: An O(sqrt n L)-iteration homogeneous and self-dual linear programming algorithm. Math. Oper.
   Res. 19 (1994).
"""

from dataclasses import dataclass

import numpy as np

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
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["SMALLEST_MU", "Embedding", "Missed", "Newton", "Point"]

SMALLEST_MU = 1e-6  # below this the cone is too thin for the scaling x = (mu fn, ft); the conic solver takes it
REFINED = 4  # rounds of refinement of a solve, at most
SHIFT = 1e-13  # of the largest entry of D: S is singular where few contacts are engaged
LARGE = 1e3  # ... which counts no more than this


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """An iterate, or a step of one."""

    x: Floats  # (q, 3) in Q3
    z: Floats  # (q, 3) in Q3
    y: Floats  # (6 m,)
    tau: float
    kappa: float
    s: float = 0.0

    def moved(self, d: "Point", length: float) -> "Point":
        """The point `length` along `d`."""
        return Point(*(getattr(self, n) + length * getattr(d, n) for n in ("x", "z", "y", "tau", "kappa", "s")))

    def room(self, d: "Point") -> float:
        """Largest step along `d` that keeps every cone."""
        corners = [-here / step for here, step in ((self.tau, d.tau), (self.kappa, d.kappa)) if step < 0.0]
        return min([longest(self.x, d.x), longest(self.z, d.z), *corners])


@dataclass(frozen=True, slots=True, eq=False)
class Missed:
    """What an iterate misses of the four equations."""

    force: Floats  # (6 m,) A x + p tau + q s
    motion: Floats  # (q, 3) H x + A'y - z
    power: float  # q'y - tau
    gap: float  # x'H x / tau - s - p'y + kappa


class Embedding:
    """The problem, and Newton steps of it.

    Parameters
    ----------
    system, schur
        Scaled, m blocks, q points; S of it.
    live : (6 m,), optional
        Live loads q; without them H is that of 1/2 |f|^2, with them zero.

    Raises
    ------
    SolverError
        A friction coefficient is below `SMALLEST_MU`.
    """

    def __init__(self, system: EquilibriumSystem, schur: Schur, live: Floats | None = None) -> None:
        if system.points and system.mu.min() < SMALLEST_MU:
            raise SolverError(f"the interior point needs mu >= {SMALLEST_MU:g}")
        self.system, self.schur, self.live = system, schur, live
        self.stretch = np.ones((system.points, 3))
        self.stretch[:, 0] = 1.0 / system.mu
        self.H = self.stretch**2 if live is None else np.zeros((system.points, 3))
        self.scale = self.stretch[:, :, None] * self.stretch[:, None, :]
        self.border = system.p[:, None] if live is None else np.stack([system.p, live], 1)  # columns of tau and s

    def push(self, x: Floats) -> Floats:
        """(6 m,) A f of (q, 3) x."""
        return np.asarray(self.system.A @ (self.stretch * x).ravel())

    def pull(self, y: Floats) -> Floats:
        """(q, 3) of (6 m,) y: the adjoint of `push`."""
        return self.stretch * self.system.gap(y)

    def missed(self, at: Point) -> Missed:
        """Residuals."""
        force, energy = self.push(at.x) + at.tau * self.system.p, float(np.sum(self.H * at.x * at.x)) / at.tau
        gap = energy - at.s - float(self.system.p @ at.y) + at.kappa
        motion = self.H * at.x + self.pull(at.y) - at.z
        if self.live is None:
            return Missed(force, motion, 0.0, gap)
        return Missed(force + at.s * self.live, motion, float(self.live @ at.y) - at.tau, gap)

    def least_norm(self) -> tuple[Floats, Floats]:
        """(q, 3) x that solves A x = -p, lifted into the cones, and the (6 m,) y that it comes from."""
        metric = np.zeros((self.system.points, 3, 3))
        metric[:, range(3), range(3)] = 1.0 / np.where(self.H > 0.0, self.H, 1.0)
        y = self.schur.factor(metric * self.scale, 1e-9).solve(self.system.p)
        return lifted(apply(metric, -self.pull(y))), y

    def step(self, at: Point, off: Missed, compatible: bool = True) -> tuple[Point, Floats]:
        """Mehrotra's predictor and corrector on one factorisation; and y made a mechanism, as far as that goes.

        Where it is none yet (not `compatible`) the last is the step dy that brings A'(y + dy) nearest to z in the
        metric of D: contacts that are engaged, of which z is near its cone's side, get their z exactly, and what is
        left goes to those that part.

        Parameters
        ----------
        at, off
            An iterate, and what it misses.
        compatible : bool
            Whether y needs no such step.
        """
        newton = Newton(self, at, off)
        exact = None if compatible else at.y - newton.solved(self.push(apply(newton.D, off.motion)))
        d = newton.direction(1.0, -newton.middle, -at.kappa * at.tau)
        centre = (1.0 - min(1.0, at.room(d))) ** 3
        mean = centre * (float(np.sum(at.x * at.z)) + at.tau * at.kappa) / (len(at.x) + 1)
        target = -product(newton.middle, newton.middle) - product(newton.backward(d.x), newton.forward(d.z))
        target[:, 0] += mean
        corner = mean - at.kappa * at.tau - d.tau * d.kappa
        d = newton.direction(1.0 - centre, quotient(newton.middle, target), corner)
        there = at.moved(d, min(1.0, 0.99 * at.room(d)))
        return there, there.y if exact is None else exact


class Newton:
    """Nesterov-Todd scaling at an iterate, and Newton directions by one factorisation of S."""

    def __init__(self, task: Embedding, at: Point, off: Missed) -> None:
        self.task, self.at, self.off = task, at, off
        self.w, self.ratio = nesterov_todd(at.x, at.z)
        self.D = condensed(self.w, self.ratio, task.H[:, 0], task.H[:, 1])
        self.middle = self.forward(at.z)
        shift = SHIFT * min(float(np.max(self.D, initial=1.0)), LARGE)
        self.factor = task.schur.factor(self.D * task.scale, shift)
        self.along = np.stack([self.solved(column) for column in task.border.T], 1)  # (6 m, 1 or 2)
        self.weight = 2.0 / at.tau * task.H * at.x
        corner = np.array([[-at.kappa / at.tau - float(np.sum(task.H * at.x * at.x)) / at.tau**2, -1.0], [-1.0, 0.0]])
        corner = corner[: self.along.shape[1], : self.along.shape[1]]
        bent = [float(np.sum(self.weight * apply(self.D, task.pull(column)))) for column in self.along.T]
        self.corner = corner + (task.border * [-1.0, 1.0][: len(corner)]).T @ self.along
        self.corner[0] -= bent

    def forward(self, x: Floats) -> Floats:
        """(q, 3) W x."""
        return scaled(self.w, self.ratio, x)

    def backward(self, x: Floats) -> Floats:
        """(q, 3) W^-1 x."""
        return scaled(REFLECT * self.w, 1.0 / self.ratio, x)

    def solved(self, rhs: Floats) -> Floats:
        """(6 m,) y with S y = rhs, refined; the best met, for near the end a solve may be far off."""
        task, least = self.task, np.inf
        y = best = self.factor.solve(rhs)
        enough = 1e-13 * (1e-3 + float(np.max(np.abs(rhs), initial=0.0)))
        for more in range(REFINED, -1, -1):
            left = rhs - task.push(apply(self.D, task.pull(y)))
            worst, before = float(np.max(np.abs(left), initial=0.0)), least
            if worst < least:
                best, least = y, worst
            if worst <= enough or not (worst < 0.5 * before) or not more:
                break
            y = y + self.factor.solve(left)
        return best

    def direction(self, share: float, target: Floats, corner: float) -> Point:
        """Newton step: residuals cut by `share`, W^-1 dx + W dz = (q, 3) target, kappa dtau + tau dkappa = corner."""
        task, at, off = self.task, self.at, self.off
        # D W^-1 target; without H that is W target, in which nothing cancels
        along = apply(self.D, self.backward(target)) if task.live is None else self.forward(target)
        base = self.solved(share * off.force + task.push(along - share * apply(self.D, off.motion)))
        dx = along - apply(self.D, share * off.motion + task.pull(base))
        rhs = [float(task.system.p @ base) - share * off.gap - corner / at.tau - float(np.sum(self.weight * dx))]
        if task.live is not None:
            rhs.append(-share * off.power - float(task.live @ base))
        steps = np.linalg.solve(self.corner, np.array(rhs))
        dy = base + self.along @ steps
        opened = task.pull(dy) + share * off.motion
        dx = along - apply(self.D, opened)
        dz = task.H * dx + opened  # from the dual equation: it keeps its digits
        dtau, ds = float(steps[0]), float(steps[1]) if len(steps) > 1 else 0.0
        return Point(dx, dz, dy, dtau, (corner - at.kappa * dtau) / at.tau, ds)
