"""Rigid-block equilibrium by a structured interior point: one factorisation of S = A D A' an iteration."""

import numpy as np

from cyclopean.analysis.embedding import SMALLEST_MU, Embedding, Point
from cyclopean.analysis.equilibrium.newton import DualAnswer, collapse_bound
from cyclopean.analysis.quadratic_cones import lifted
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["SMALLEST_MU", "interior_point"]

PATIENCE = 5  # iterations without gain after which rounding has the upper hand


def interior_point(
    system: EquilibriumSystem, schur: Schur, cap: int = 50, gap: float = 1e-7, decisive: float = 3e6
) -> DualAnswer:
    """Min 1/2 ||f||^2 subject to A f = -p, f in K, by an interior point on its homogeneous embedding.

    Every step is one factorisation of S, the pattern that the dual Newton method uses too (see `embedding`). A
    mechanism is returned as soon as its `collapse_bound` exceeds `decisive`. Forces are good to `gap`; the dual Newton
    method, started at y, finishes them.

    Raises
    ------
    SolverError
        A friction coefficient is below `SMALLEST_MU`, or S cannot be factorised.
    """
    task = Embedding(system, schur)
    x, y = task.least_norm()
    at = Point(x, lifted(task.H * x + task.pull(y)), y, 1.0, 1.0)
    size = 1.0 + float(np.max(np.abs(system.p), initial=0.0))
    f, worst, word, step = task.stretch * at.x, np.inf, "unfinished", 0
    least, idle = np.inf, 0
    for step in range(cap + 1):
        missed = task.missed(at)
        f = task.stretch * at.x / at.tau
        worst = float(np.max(np.abs(missed.force), initial=0.0)) / at.tau
        product = float(np.sum(at.x * at.z))
        slack = product / at.tau**2 / max(system.points, 1)
        off = float(np.max(np.abs(missed.motion), initial=0.0)) / at.tau
        if worst <= gap * size and slack <= gap and off <= gap:
            word = "balanced"
            break
        if collapse_bound(system, at.y) >= decisive:
            word = "collapse"
            break
        centrality = (2.0 * product + at.tau * at.kappa) / (2 * system.points + 1)
        idle = 0 if centrality < 0.9 * least else idle + 1
        least = min(least, centrality)
        if step == cap or not (centrality < np.inf) or idle > PATIENCE:
            break
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # ends at the factorisation's gate
            at, _ = task.step(at, missed)
    return DualAnswer(word, f, at.y / at.tau, worst, step)  # type: ignore[arg-type]
