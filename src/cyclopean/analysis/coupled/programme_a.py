"""Programme A, whose friction dilates, by an interior point: one factorisation of S = A D A' an iteration.

Programme A prices the forces over the friction cones, `h(f) = sum c fn + beta |f_t| + alpha / 2 |f_t|^2`, and asks for
the cheapest that balance the loads; the multipliers of the balance are a motion. Any solution in which no point's
friction is at its bound is a coupled state: dn = -1 where fn > 0, and dd_t = -(beta + alpha |f_t|) f_t / |f_t|. At the
bound there is a multiplier lambda = |dd_t| - beta - alpha |f_t|, and dn = -1 + mu lambda: the point presses and opens.
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.analysis.equilibrium.interior import SMALLEST_MU
from cyclopean.analysis.equilibrium.newton import collapse_bound
from cyclopean.analysis.quadratic_cones import (
    REFLECT,
    apply,
    condensed,
    longest,
    nesterov_todd,
    product,
    quotient,
    reach,
    scaled,
)
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.solvers import Factor
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["Prices", "SlidingPoint", "sliding_interior"]

CAP = 40  # iterations at most
DECISIVE = 3e6  # bound of a collapse from which there is one
PATIENCE = 5  # iterations without gain after which rounding has the upper hand


@dataclass(frozen=True, slots=True, eq=False)
class Prices:
    """What forces cost: c fn + beta |f_t| + alpha / 2 |f_t|^2 at each point, in displacements (eps = 1)."""

    normal: Floats  # (q,) c = 1 + s
    slide: float | Floats  # (q,) or one beta: how far a point slides at least before it has friction
    stiff: Floats  # (q,) alpha: how much further for a unit of friction


@dataclass(frozen=True, slots=True, eq=False)
class SlidingPoint:
    """Where the interior point stopped: forces and displacement good to `gap`, or a mechanism q."""

    word: str  # "solved" | "collapse" | "unfinished"
    f: Floats  # (q, 3)
    q: Floats  # (6 m,)
    gap: float  # mean complementarity
    steps: int


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """An iterate: x = (r, fu, fv) in Q3 and t = mu fn - r >= 0, their multipliers, and the displacement."""

    x: Floats  # (q, 3)
    t: Floats  # (q,)
    zx: Floats  # (q, 3) in Q3
    zt: Floats  # (q,) >= 0
    q: Floats  # (6 m,)

    def moved(self, d: "_Point", length: float) -> "_Point":
        """The point `length` along d."""
        return _Point(
            self.x + length * d.x,
            self.t + length * d.t,
            self.zx + length * d.zx,
            self.zt + length * d.zt,
            self.q + length * d.q,
        )

    def room(self, d: "_Point") -> float:
        """Largest step along d that keeps every cone."""
        flat = min(reach(self.t, d.t), reach(self.zt, d.zt))
        return min(flat, longest(self.x, d.x), longest(self.zx, d.zx))

    @property
    def gap(self) -> float:
        """Mean complementarity."""
        return (float(np.sum(self.x * self.zx)) + float(self.t @ self.zt)) / max(2 * len(self.t), 1)


def sliding_interior(
    system: EquilibriumSystem,
    schur: Schur,
    prices: Prices,
    gap: float = 1e-5,
    loose: float = 1e3,
) -> SlidingPoint:
    """Min sum c fn + beta |f_t| + alpha / 2 |f_t|^2 subject to A f = -p and |f_t| <= mu fn, to a gap of `gap`.

    What is off may be `loose` times the gap at the end.

    With x = (r, f_t) in Q3 and t = mu fn - r >= 0 the cones are standard and fn = (r + t) / mu. The Nesterov-Todd
    scalings of x and t fold into one 3 x 3 block D a point, so that a step solves with S = A D A', the pattern of RBE;
    Mehrotra's predictor and corrector share its factorisation. Multipliers are kept feasible up to a residual that
    shrinks with the steps. q runs off along a mechanism where there is no state: "collapse" as soon as its
    `collapse_bound` exceeds `DECISIVE`.

    Raises
    ------
    SolverError
        A friction coefficient is below `SMALLEST_MU`, or S cannot be factorised.
    """
    if system.points and system.mu.min() < SMALLEST_MU:
        raise SolverError(f"the interior point needs mu >= {SMALLEST_MU:g}")
    task = _Task(system, schur, prices)
    at = task.first()
    word, step, least, most, idle = "unfinished", 0, np.inf, 0.0, 0
    for step in range(CAP + 1):
        off_x, off_t, off = task.residuals(at)
        mean = at.gap
        primal = float(np.max(np.abs(off), initial=0.0))
        dual = max(float(np.max(np.abs(off_x), initial=0.0)), float(np.max(np.abs(off_t), initial=0.0)))
        if mean <= gap and max(primal, dual) <= loose * gap:
            word = "solved"
            break
        bound = collapse_bound(system, at.q)
        if bound >= DECISIVE:
            word = "collapse"
            break
        idle = 0 if mean < 0.9 * least or bound > 1.1 * most else idle + 1
        least, most = min(least, mean), max(most, bound)
        if step == CAP or not (mean < np.inf) or idle > PATIENCE:
            break
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # ends at the factorisation's gate
            at = task.step(at, off_x, off_t, off)
    return SlidingPoint(word, task.forces(at.x, at.t), at.q, at.gap, step)


class _Task:
    """The programme's data, and one Newton step of it."""

    def __init__(self, system: EquilibriumSystem, schur: Schur, prices: Prices) -> None:
        self.system, self.schur, self.stiff = system, schur, prices.stiff
        self.price_t = prices.normal / system.mu
        self.price_x = self.price_t + prices.slide

    def forces(self, x: Floats, t: Floats) -> Floats:
        """F = ((x0 + t) / mu, x_t)."""
        f = x.copy()
        f[:, 0] = (x[:, 0] + t) / self.system.mu
        return f

    def push(self, x: Floats, t: Floats) -> Floats:
        """A f."""
        return np.asarray(self.system.A @ self.forces(x, t).ravel())

    def pull(self, q: Floats) -> Floats:
        """Adjoint of `push` in x; in t it is the first column."""
        d = self.system.gap(q)
        d[:, 0] /= self.system.mu
        return d

    def residuals(self, at: _Point) -> tuple[Floats, Floats, Floats]:
        """Stationarity in x and in t, and balance."""
        d = self.pull(at.q)
        off_t = self.price_t + d[:, 0] - at.zt
        off_x = d - at.zx
        off_x[:, 0] += self.price_x
        off_x[:, 1:] += self.stiff[:, None] * at.x[:, 1:]
        return off_x, off_t, self.push(at.x, at.t) + self.system.p

    def first(self) -> _Point:
        """The least-norm balance of the loads, lifted into the cones; multipliers of no motion."""
        system = self.system
        eye = np.broadcast_to(np.eye(3), (system.points, 3, 3))
        f = -system.gap(self.schur.factor(eye, 1e-9).solve(system.p))
        size = 0.3 * system.mu * max(1.0, float(np.median(np.abs(f[:, 0]))) if len(f) else 1.0)
        x = f.copy()
        x[:, 0] = np.hypot(f[:, 1], f[:, 2]) + size
        zx = np.zeros_like(x)
        zx[:, 1:] = self.stiff[:, None] * x[:, 1:]
        zx[:, 0] = np.hypot(zx[:, 1], zx[:, 2]) + self.price_x
        return _Point(
            x, np.maximum(system.mu * f[:, 0] - x[:, 0], size), zx, self.price_t.copy(), np.zeros(self.schur.size)
        )

    def step(self, at: _Point, off_x: Floats, off_t: Floats, off: Floats) -> _Point:
        """Predictor and corrector."""
        scaling = _Scaling(self, at)
        middle = scaling.middle
        d = scaling.direction(off_x, off_t, off, -middle, -at.t * at.zt)
        centre = (1.0 - min(1.0, at.room(d))) ** 3
        target = -product(middle, middle) - product(scaling.backward(d.x), scaling.forward(d.zx))
        target[:, 0] += centre * at.gap
        corner = centre * at.gap - at.t * at.zt - d.t * d.zt
        share = 1.0 - centre
        d = scaling.direction(share * off_x, share * off_t, share * off, quotient(middle, target), corner)
        return at.moved(d, min(1.0, 0.99 * at.room(d)))


class _Scaling:
    """Nesterov-Todd scaling at an iterate, and Newton directions by one factorisation of S."""

    def __init__(self, task: _Task, at: _Point) -> None:
        self.task, self.at = task, at
        self.w, self.ratio = nesterov_todd(at.x, at.zx)
        self.v, self.inverse = REFLECT * self.w, 1.0 / self.ratio
        self.D = condensed(self.w, self.ratio, 0.0, task.stiff)
        self.D_t = at.t / at.zt
        self.middle = self.forward(at.zx)
        mu = task.system.mu
        self.folded = self.D.copy()  # x and t act on fn together: fn = (x0 + t) / mu
        self.folded[:, 0, 0] = (self.D[:, 0, 0] + self.D_t) / (mu * mu)
        self.folded[:, 0, 1:] /= mu[:, None]
        self.folded[:, 1:, 0] /= mu[:, None]
        self.factor: Factor = task.schur.factor(self.folded, 1e-12)

    def forward(self, x: Floats) -> Floats:
        """W x."""
        return scaled(self.w, self.ratio, x)

    def backward(self, x: Floats) -> Floats:
        """W^-1 x."""
        return scaled(self.v, self.inverse, x)

    def solved(self, rhs: Floats) -> Floats:
        """S dq = rhs, refined."""
        system = self.task.system
        dq = self.factor.solve(rhs)
        enough = 1e-10 * (1e-6 + float(np.max(np.abs(rhs), initial=0.0)))
        for _ in range(2):
            off = rhs - np.asarray(system.A @ apply(self.folded, system.gap(dq)).ravel())
            if float(np.max(np.abs(off), initial=0.0)) <= enough:
                break
            dq = dq + self.factor.solve(off)
        return dq

    def direction(self, off_x: Floats, off_t: Floats, off: Floats, target: Floats, corner: Floats) -> _Point:
        """Newton step with W^-1 dx + W dz = target and zt dt + t dzt = corner."""
        at, task = self.at, self.task
        along = self.backward(target)
        rx, rt = along - off_x, corner / at.t - off_t
        dq = self.solved(off + task.push(apply(self.D, rx), self.D_t * rt))
        d = task.pull(dq)
        dx = apply(self.D, rx - d)
        dt = self.D_t * (rt - d[:, 0])
        dzx = along - self.backward(self.backward(dx))
        return _Point(dx, dt, dzx, (corner - at.zt * dt) / at.t, dq)
