"""Rigid-block equilibrium by semismooth Newton on its dual."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur, cone_jacobian, project_cones

__all__ = ["DualAnswer", "collapse_bound", "newton", "sharpen_mechanism"]

ENOUGH = 1e-12  # scaled residual at which a state is taken as balanced; the certificate asks for 1e-9 of the total
GOOD = 1e-10  # ... and at which one that no longer improves is taken
SHIFT = 1e-9  # S is singular for blocks with few engaged contacts


@dataclass(frozen=True, slots=True, eq=False)
class DualAnswer:
    """Where a dual method stopped: forces, velocities, and what they are claimed to be (claims are checked later)."""

    word: Literal["balanced", "collapse", "unfinished"]
    f: Floats  # (q, 3) scaled forces, in their cones
    y: Floats  # (6 m,) scaled velocities
    residual: float  # max |A f + p|
    steps: int


def collapse_bound(system: EquilibriumSystem, y: Floats) -> float:
    """Least size of admissible forces by a motion (6n,): p'y / ||P_K(-A'y)|| in total loads; <= 0 proves nothing.

    For every f in K: p'y = -f'A'y <= ||f|| ||P_K(-A'y)||. Infinite for an exact mechanism.
    """
    return _bound(system, float(system.p @ y), project_cones(-system.gap(y), system.mu))


def _bound(system: EquilibriumSystem, power: float, f: Floats) -> float:
    """`collapse_bound` of a motion with power p'y and f = P_K(-A'y)."""
    if not power > 0.0:
        return 0.0
    needed, total = float(np.linalg.norm(f)), system.total
    if not total > 0.0:
        return 0.0
    return np.inf if needed == 0.0 else power / needed / total


def newton(
    system: EquilibriumSystem,
    schur: Schur,
    start: Floats | None = None,
    cap: int = 20,
    decisive: float = 3e6,
    lost: float = np.inf,
) -> DualAnswer:
    """Minimise phi(y) = 1/2 ||P_K(-A'y)||^2 - p'y; f = P_K(-A'y) is the least-norm state of equilibrium.

    phi is convex and once differentiable with -grad phi = A f + p. Each step solves (A J A' + shift) d = A f + p with J
    the generalised Jacobian of the projection (Qi and Sun 1993), then searches along d. Two factorisations do for an
    upright wall. When no state exists, y runs off along a mechanism and phi falls without end.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled. With weights on the normal and tangential forces, already scaled by columns.
    schur : Schur
        S of the same system.
    start : (6 m,), optional
        Where to start y.
    cap : int
        Most factorisations before handing over.
    decisive : float
        Collapse bound (in total loads) that counts as a mechanism.
    lost : float
        Collapse bound at which to hand over: past what models that stand usually need.
    """
    here = _point(system, np.zeros(schur.size) if start is None else start.copy())
    shift, word, step, worst = SHIFT, "unfinished", 0, np.inf
    for step in range(cap + 1):
        worst = here.worst
        if worst <= ENOUGH:
            word = "balanced"
            break
        bound = _bound(system, float(system.p @ here.y), here.f) if step else 0.0
        if bound >= decisive:
            word = "collapse"
        if step == cap or bound >= min(decisive, lost):
            break
        d = _direction(schur, cone_jacobian(here.back, system.mu), here.g, shift * min(1.0, worst))
        length, there = _search(system, here, d)
        if there.worst > 0.5 * worst and worst <= GOOD:  # rounding: no further
            word = "balanced"
            break
        here = there
        shift = SHIFT if length > 0.2 else min(shift * 10.0, 1e-2)
    return DualAnswer(word, here.f, here.y, worst, step)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """phi at y, and what it is made of."""

    y: Floats
    back: Floats  # (q, 3) -A'y
    f: Floats  # (q, 3) P_K(back)
    phi: float
    g: Floats  # (6 m,) A f + p
    worst: float  # max |g|


def _point(system: EquilibriumSystem, y: Floats) -> _Point:
    back = -system.gap(y)
    f = project_cones(back, system.mu)
    g = system.residual(f)
    phi = 0.5 * float(np.sum(f * f)) - float(system.p @ y)
    return _Point(y, back, f, phi, g, float(np.max(np.abs(g), initial=0.0)))


def _direction(schur: Schur, D: Floats, g: Floats, shift: float) -> Floats:
    shift = max(shift, 1e-13)
    for _ in range(8):
        try:
            return schur.factor(D, shift).solve(g)
        except SolverError:
            shift = max(shift * 1e3, 1e-10)
    raise SolverError("the dual Newton matrix cannot be factorised")


def _search(system: EquilibriumSystem, here: _Point, d: Floats) -> tuple[float, _Point]:
    """Backtrack on phi; near the end, where phi has no digits left, a halved residual will do."""
    slope, length = float(here.g @ d), 1.0
    for _ in range(30):
        there = _point(system, here.y + length * d)
        if there.phi <= here.phi - 1e-4 * length * slope or there.worst < 0.5 * here.worst:
            break
        length *= 0.5
    return length, there


def sharpen_mechanism(system: EquilibriumSystem, schur: Schur, y: Floats, cap: int = 25) -> Floats:
    """Drive ||P_K(-A'y)|| to rounding while p'y stays 1: Newton on 1/2 ||P_K(-A'y)||^2 subject to p'y = 1.

    Takes a mechanism that is nearly one (from an interior point, or from Newton's y) and returns the best it meets.
    """
    best, bound = y, collapse_bound(system, y)
    power = float(system.p @ y)
    if not power > 0.0:
        return y
    here, idle = y / power, 0
    for _ in range(cap):
        back = -system.gap(here)
        f = project_cones(back, system.mu)
        slope = -np.asarray(system.A @ f.ravel())  # gradient of 1/2 ||P_K(-A'y)||^2
        size = float(np.max(np.abs(slope), initial=0.0))
        if size == 0.0:
            break
        try:
            factor = schur.factor(cone_jacobian(back, system.mu), max(1e-8 * size, 1e-14))
            towards, along = factor.solve(slope), factor.solve(system.p)
        except SolverError:  # S is singular to rounding: what has been met is the best there is
            break
        weight = float(system.p @ towards) / float(system.p @ along)
        d = towards - weight * along
        length, merit = 1.0, float(np.sum(f * f))
        for _ in range(12):
            trial = project_cones(-system.gap(here - length * d), system.mu)
            if float(np.sum(trial * trial)) < merit:
                break
            length *= 0.5
        here = here - length * d
        here = here / float(system.p @ here)
        found = collapse_bound(system, here)
        idle = 0 if found > bound else idle + 1
        if found > bound:
            best, bound = here, found
        if idle > 3:
            break
    return best
