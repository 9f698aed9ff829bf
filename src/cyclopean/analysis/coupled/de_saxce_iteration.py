"""Route A to a coupled state: the gap-shifted loop after De Saxce and Feng.

Real friction cones make sliding dilate: on the edge of the cone dn = -(1 + s) + mu l where the state wants -1. Raising
the price of compression there by exactly s = mu l = mu (|dd_t| - beta - alpha |f_t|) restores it [DeSaxce1998]_, so the
loop iterates on s, one conic programme a round. One round settles an upright wall (no friction at all), three to six an
arch or a slope.

References
----------
.. [DeSaxce1998] De Saxce, Feng: The bipotential method: a constructive approach to design the complete contact law with
   friction. Mathematical and Computer Modelling 28 (1998) 225-245.
"""

import time
from dataclasses import replace

import numpy as np

from cyclopean.analysis.coupled.halves import Halves, SlidingAnswer
from cyclopean.analysis.coupled.polish import Attempt, attempt, better, nothing, polish
from cyclopean.analysis.coupled.proximal import Prices
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.arrays import Floats
from cyclopean.statics import EquilibriumSystem

__all__ = ["de_saxce_iteration"]

NEAR = 1e-2  # largest fn |dn + 1| from which a polish is worth its time
CLOSE = 1e-3  # ... with every choice of sets
SETTLED = 1e-8  # ... and at which another round brings nothing new
STALLED = 0.6  # share of the work three rounds ago from which the loop is left to others
LOST = 1e8  # ... and at which the loop has run away


def de_saxce_iteration(
    system: EquilibriumSystem,
    bounds: Bounds,
    rounds: int = 14,
    deadline: float = np.inf,
) -> Attempt:
    """Iterate on the price shifts s until the polish accepts a state.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    bounds : Bounds
        With eps = 1.
    rounds : int
        Conic solves at most.
    deadline : float
        Of `time.perf_counter`.
    """
    halves, beta = Halves(system, bounds, deadline), 2.0 * bounds.beta
    s, alpha = np.zeros(system.points), np.ones(system.points)
    damping, last, polished, iterations, done = 1.0, np.inf, NEAR, 0, 0
    best, history = nothing(system, bounds), list[float]()
    for done in range(1, rounds + 1):
        answer = halves.priced(Prices(1.0 + s, beta, alpha))
        iterations += answer.iterations
        if answer.word != "solved":
            best = replace(best, infeasible=answer.word == "infeasible" and done == 1)
            break
        d = system.gap(answer.dq)
        work = float(np.max(np.abs(answer.f[:, 0] * (d[:, 0] + 1.0)), initial=0.0))
        if work < polished:
            polished = 0.5 * work  # no second polish before this much is gained
            near = polish(system, bounds, answer.f, answer.dq, *([] if work < CLOSE else [1]))
            best = better(best, attempt(system, bounds, *near[:2]))
            if best.found or work < SETTLED:
                break
        history.append(work)
        if not (work < LOST) or time.perf_counter() > deadline:
            break
        if len(history) > 4 and work > STALLED * history[-4]:
            break
        if done == 1:
            alpha = np.full(system.points, 1.0 / _typical(answer))
        step = _shift(system, beta, alpha, answer, d) - s
        size = float(np.max(np.abs(step), initial=0.0))
        damping = max(0.3, 0.7 * damping) if size > last else damping
        s, last = s + damping * step, size
    return replace(best, solves=done, rounds=done, iterations=iterations)


def _typical(answer: SlidingAnswer) -> float:
    """90th percentile of the friction forces that there are."""
    tangent = np.hypot(answer.f[:, 1], answer.f[:, 2])
    acting = tangent[tangent > 1e-6]
    return max(1e-3, float(np.percentile(acting, 90))) if acting.size else 1.0


def _shift(system: EquilibriumSystem, beta: float, alpha: Floats, answer: SlidingAnswer, d: Floats) -> Floats:
    """Mu times the multiplier of the friction bound: what sliding exceeds its price by."""
    tangent, slide = np.hypot(answer.f[:, 1], answer.f[:, 2]), np.hypot(d[:, 1], d[:, 2])
    return np.asarray(system.mu * np.maximum(slide - beta - alpha * tangent, 0.0))
