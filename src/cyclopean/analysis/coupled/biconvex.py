"""Route B to a coupled state: biconvex descent, forces and motion in turn.

The merit

    sum  fn (dn + 1) + (|f_t| |dd_t| + f_t . dd_t) + max(0, 2 beta_min |f_t| + f_t . dd_t)

is convex in the forces for a fixed motion and in the motion for fixed forces, never negative where f lies in its cones
and dn >= -1, and zero only at a coupled state. Each half is one conic programme, so the merit can only fall; a polish
takes over near zero. Seeds are forces of programme A at several compliances.
"""

import time
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.polish import Attempt, attempt, better, nothing, polish, total_merit
from cyclopean.analysis.coupled.programme_a import Prices
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.arrays import Floats
from cyclopean.statics import EquilibriumSystem

__all__ = ["alternate", "alternation"]

COMPLIANCES = (0.1, 5.0, 0.0)  # of the seeds
NEAR = 0.05  # merit from which a polish is worth its time
STALLED = 0.97  # share of the merit three rounds ago that counts as no progress
SHARE = 0.4  # of the time left that one seed may take


def alternate(
    halves: Halves, f: Floats, best: Attempt, rounds: int = 40, deadline: float = np.inf
) -> tuple[Attempt, int]:
    """Descend from the (q, 3) scaled forces f until the polish accepts a state, the merit stalls or time is up.

    Returns
    -------
    best : Attempt
        The best triple met, the given one included.
    rounds : int
        How many were done.
    """
    system, bounds = halves.system, halves.bounds
    history: list[float] = []
    polished = NEAR
    for near, dq in islice(halves.fitted(halves.root, f), rounds):
        here = attempt(system, bounds, near, dq)
        best = better(best, here)
        if here.merit < polished:
            polished = 0.5 * here.merit  # no second polish before this much is gained
            best = better(best, attempt(system, bounds, *polish(system, bounds, near, dq)[:2]))
        history.append(total_merit(system, bounds, near, dq))
        stalled = len(history) > 3 and history[-1] > STALLED * history[-4]
        if best.found or stalled or time.perf_counter() > deadline:
            break
    return best, len(history)


def alternation(
    system: EquilibriumSystem, bounds: Bounds, given: Iterable[Floats] = (), deadline: float = np.inf
) -> Attempt:
    """Alternate from every seed until one leads to a state.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    bounds : Bounds
        With eps = 1.
    given : iterable of (q, 3)
        Forces in equilibrium to start from as well.
    deadline : float
        Of `time.perf_counter`.
    """
    halves = Halves(system, bounds, deadline)
    best, rounds = nothing(system, bounds), 0
    for f in _seeds(halves, given):
        now = time.perf_counter()
        best, done = alternate(halves, f, best, deadline=now + SHARE * max(deadline - now, 0.0))
        rounds += done
        if best.found or time.perf_counter() > deadline:
            break
    return replace(best, solves=halves.solves, rounds=rounds, iterations=halves.iterations)


def _seeds(halves: Halves, given: Iterable[Floats]) -> Iterator[Floats]:
    """Forces to start from: of programme A at several compliances, and those given."""
    one = np.ones(halves.system.points)
    for k, compliance in enumerate(COMPLIANCES):
        answer = halves.priced(Prices(one, 2.0 * halves.bounds.beta, compliance * one))
        if answer.word == "solved":
            yield answer.f
        if k == 0:
            yield from given
