"""Rigid-block equilibrium by a structured interior point: one factorisation of S = A D A' an iteration."""

from dataclasses import dataclass

import numpy as np

from cyclopean.analysis.equilibrium.newton import DualAnswer, collapse_bound
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

__all__ = ["SMALLEST_MU", "interior_point"]

SMALLEST_MU = 1e-6  # below this the cone is too thin for the scaling x = (mu fn, ft); the conic solver takes it
PATIENCE = 5  # iterations without gain after which rounding has the upper hand


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """An iterate of the homogeneous embedding; x / tau are the forces sought, -y a velocity."""

    x: Floats  # (q, 3) in Q3
    y: Floats  # (6 m,)
    z: Floats  # (q, 3) in Q3
    tau: float
    kappa: float

    def moved(self, d: "_Point", length: float) -> "_Point":
        """The point `length` along `d`."""
        return _Point(
            self.x + length * d.x,
            self.y + length * d.y,
            self.z + length * d.z,
            self.tau + length * d.tau,
            self.kappa + length * d.kappa,
        )


class _Task:
    """The problem in x = (mu fn, fu, fv): f = stretch * x, A f = push(x), and its adjoint pull."""

    def __init__(self, system: EquilibriumSystem, schur: Schur) -> None:
        self.system, self.schur = system, schur
        self.stretch = np.ones((system.points, 3))
        self.stretch[:, 0] = 1.0 / system.mu
        self.H = self.stretch * self.stretch
        self.scale = self.stretch[:, :, None] * self.stretch[:, None, :]

    def push(self, x: Floats) -> Floats:
        """A f."""
        return np.asarray(self.system.A @ (self.stretch * x).ravel())

    def pull(self, y: Floats) -> Floats:
        """The adjoint of `push`."""
        return self.stretch * self.system.gap(y)

    def residuals(self, at: _Point) -> tuple[Floats, Floats, float]:
        """A x + p tau, H x - A'y - z, and x'Hx / tau + p'y + kappa: all zero at a solution."""
        primal = self.push(at.x) + self.system.p * at.tau
        dual = self.H * at.x - self.pull(at.y) - at.z
        energy = float(np.sum(self.H * at.x * at.x)) / at.tau
        return primal, dual, energy + float(self.system.p @ at.y) + at.kappa


def interior_point(
    system: EquilibriumSystem, schur: Schur, cap: int = 50, gap: float = 1e-7, decisive: float = 3e6
) -> DualAnswer:
    """Min 1/2 ||f||^2 subject to A f = -p, f in K, by an interior point on its homogeneous embedding.

    With x = (mu fn, fu, fv) the cones become Q3 = {x0 >= |(x1, x2)|}; multipliers z in Q3. The embedding adds tau and
    kappa >= 0: tau > 0 in the limit gives forces x / tau, kappa > 0 a mechanism -y. The 3 x 3 Nesterov-Todd scalings W
    give D = (H + W^-2)^-1, and every step reduces to two solves with S = A D A' on one factorisation, the pattern that
    the dual Newton method uses too; predictor and corrector share it. A mechanism is returned as soon as its
    `collapse_bound` exceeds `decisive`. Forces are good to `gap`; the dual Newton method, started at y, finishes them.

    References
    ----------
    .. [NT] Nesterov, Todd: Primal-dual interior-point methods for self-scaled cones. SIAM J. Optim. 8 (1998).
    .. [CVX] Vandenberghe: The CVXOPT linear and quadratic cone program solvers (2010), for scalings and step lengths.
    .. [Clarabel] Goulart, Chen: Clarabel, arXiv 2405.12762 (2024), for the embedding with a quadratic objective.

    Raises
    ------
    SolverError
        A friction coefficient is below `SMALLEST_MU`, or S cannot be factorised.
    """
    if system.points and system.mu.min() < SMALLEST_MU:
        raise SolverError(f"the interior point needs mu >= {SMALLEST_MU:g}")
    task = _Task(system, schur)
    at = _first(task)
    size = 1.0 + float(np.max(np.abs(system.p), initial=0.0))
    count = 2 * system.points + 1
    f, worst, word, step = task.stretch * at.x, np.inf, "unfinished", 0
    least, idle = np.inf, 0
    for step in range(cap + 1):
        primal, dual, energy = task.residuals(at)
        f = task.stretch * at.x / at.tau
        worst = float(np.max(np.abs(primal), initial=0.0)) / at.tau
        slack = float(np.sum(at.x * at.z)) / at.tau**2 / max(system.points, 1)
        off = float(np.max(np.abs(dual), initial=0.0)) / at.tau
        if worst <= gap * size and slack <= gap and off <= gap:
            word = "balanced"
            break
        if collapse_bound(system, -at.y) >= decisive:
            word = "collapse"
            break
        centrality = (2.0 * float(np.sum(at.x * at.z)) + at.tau * at.kappa) / count
        idle = 0 if centrality < 0.9 * least else idle + 1
        least = min(least, centrality)
        if step == cap or not (centrality < np.inf) or idle > PATIENCE:
            break
        with np.errstate(
            over="ignore", invalid="ignore", divide="ignore"
        ):  # a step that overflows ends at the factorisation's gate
            at = _iterate(task, at, primal, dual, energy)
    return DualAnswer(word, f, -at.y / at.tau, worst, step)  # type: ignore[arg-type]


def _first(task: _Task) -> _Point:
    """The least-norm solution of A x = -p, lifted into the cones."""
    D = np.zeros((task.system.points, 3, 3))
    D[:, range(3), range(3)] = 1.0 / task.H
    y = task.schur.factor(D * task.scale, 1e-9).solve(-task.system.p)
    x = lifted(task.pull(y) / task.H)
    return _Point(x, y, lifted(task.H * x - task.pull(y)), 1.0, 1.0)


def _iterate(task: _Task, at: _Point, primal: Floats, dual: Floats, energy: float) -> _Point:
    """One predictor and corrector on one factorisation."""
    x, z, tau, kappa = at.x, at.z, at.tau, at.kappa
    w, ratio = nesterov_todd(x, z)
    back = REFLECT * w, 1.0 / ratio
    D = condensed(w, ratio, task.H[:, 0], task.H[:, 1])
    middle = scaled(w, ratio, z)
    factor = task.schur.factor(D * task.scale, 1e-12)
    weight = 2.0 / tau * task.H * x
    own = float(np.sum(task.H * x * x)) / tau**2

    def solved(rhs: Floats) -> Floats:
        y = factor.solve(rhs)
        enough = 1e-13 * (1.0 + float(np.max(np.abs(rhs), initial=0.0)))
        for _ in range(3):
            off = rhs - task.push(apply(D, task.pull(y)))
            if float(np.max(np.abs(off), initial=0.0)) <= enough:
                break
            y = y + factor.solve(off)
        return y

    along_y = solved(-task.system.p)
    along_x = apply(D, task.pull(along_y))
    bend = float(np.sum(weight * along_x)) - own + float(task.system.p @ along_y) - kappa / tau

    def step(share: float, target: Floats, corner: float) -> _Point:
        """Newton step: residuals cut by `share`, W^-1 dx + W dz = target, kappa dtau + tau dkappa = corner."""
        r = -share * dual + scaled(*back, target)
        dy = solved(-share * primal - task.push(apply(D, r)))
        dx = apply(D, r + task.pull(dy))
        rest = share * energy + float(np.sum(weight * dx)) + float(task.system.p @ dy) + corner / tau
        dtau = -rest / bend
        dx, dy = dx + dtau * along_x, dy + dtau * along_y
        dz = task.H * dx - task.pull(dy) + share * dual  # from the dual equation: it keeps its digits
        return _Point(dx, dy, dz, dtau, (corner - kappa * dtau) / tau)

    d = step(1.0, -middle, -kappa * tau)
    centre = (1.0 - min(1.0, _room(at, d))) ** 3
    mean = centre * (float(np.sum(x * z)) + tau * kappa) / (len(x) + 1)
    target = -product(middle, middle) - product(scaled(*back, d.x), scaled(w, ratio, d.z))
    target[:, 0] += mean
    d = step(1.0 - centre, quotient(middle, target), mean - kappa * tau - d.tau * d.kappa)
    return at.moved(d, min(1.0, 0.99 * _room(at, d)))


def _room(at: _Point, d: _Point) -> float:
    """Largest step along d that keeps every cone."""
    room = min(longest(at.x, d.x), longest(at.z, d.z))
    if d.tau < 0.0:
        room = min(room, -at.tau / d.tau)
    if d.kappa < 0.0:
        room = min(room, -at.kappa / d.kappa)
    return room
