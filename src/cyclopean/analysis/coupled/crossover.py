"""From forces that are nearly a coupled state to a vertex: simplex crossover for near-degenerate joints.

Curved joints drawn as facets have many points that almost press, and an interior solution spreads force over all of
them. With friction taken as a load, min sum fn is a linear programme in the normal forces alone, and the simplex method
ends at a vertex: its multipliers are a motion whose points with dn = -1 are sharply told from the others. On these
points, friction against the sliding of that motion, f_t = -r dd_t / |dd_t| with r <= mu fn, leaves another linear
programme for the forces.
"""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.coupled.polish import Attempt, attempt, better, nothing, polish
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.arrays import Floats, Ints
from cyclopean.statics import EquilibriumSystem

__all__ = ["crossover"]

MARGINS = (1e-9, 2e-8)  # dn + 1 of points that count as pressed
FEASIBLE = 1e-10  # tolerance of the simplex method


def crossover(system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats, seconds: float = 10.0) -> Attempt:
    """Look for a state at a vertex near (f, dq).

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, q points.
    bounds : Bounds
        With eps = 1.
    f : (q, 3)
        Scaled forces in equilibrium, or nearly.
    dq : (6 m,)
        Their displacement: where the vertex leaves the sliding open (flat joints), its directions are taken.
    seconds : float
        Of each linear programme at most.
    """
    best, solves = nothing(system, bounds), 1
    friction = f.copy()
    friction[:, 0] = 0.0
    load = -system.residual(friction)
    pressing = _simplex(np.ones(system.points), system.A.tocsc()[:, 0::3], load, None, seconds)
    if pressing is None:
        return replace(best, solves=solves)
    vertex = -pressing[1]
    opening = system.gap(vertex)[:, 0] + 1.0
    for margin, motion in product(MARGINS, (vertex, dq)):
        solves += 1
        forces = _against(system, np.flatnonzero(opening < margin), motion, seconds)
        if forces is None:
            continue
        best = better(best, attempt(system, bounds, *polish(system, bounds, forces, motion)[:2]))
        if best.found:
            break
    return replace(best, solves=solves, rounds=solves)


def _against(system: EquilibriumSystem, E: Ints, dq: Floats, seconds: float) -> Floats | None:
    """(q, 3) forces on the points E alone, friction against the sliding of dq; None if none balance the loads."""
    columns, gap = system.A.tocsc(), system.gap(dq)[E]
    against = -gap[:, 1:] / np.maximum(np.hypot(gap[:, 1], gap[:, 2]), 1e-300)[:, None]
    rub = columns[:, 3 * E + 1] @ sp.diags(against[:, 0]) + columns[:, 3 * E + 2] @ sp.diags(against[:, 1])
    limit = sp.hstack([-sp.diags(system.mu[E]), sp.identity(len(E))])
    found = _simplex(np.ones(2 * len(E)), sp.hstack([columns[:, 3 * E], rub]), -system.p, limit, seconds)
    if found is None:
        return None
    normal, share = np.split(found[0], 2)
    forces = np.zeros((system.points, 3))
    forces[E, 0] = normal
    forces[E, 1:] = share[:, None] * against
    return forces


def _simplex(cost: Floats, A: Any, b: Floats, limit: Any, seconds: float) -> tuple[Floats, Floats] | None:
    """Min cost'x with A x = b, limit x <= 0, x >= 0: a vertex and the multipliers of A x = b; None without either."""
    from scipy.optimize import linprog

    if not A.shape[1]:
        return None
    answer = linprog(
        cost,
        A_eq=A,
        b_eq=b,
        A_ub=limit,
        b_ub=None if limit is None else np.zeros(limit.shape[0]),
        bounds=(0, None),
        method="highs-ds",
        options={
            "primal_feasibility_tolerance": FEASIBLE,
            "dual_feasibility_tolerance": FEASIBLE,
            "time_limit": seconds,
        },
    )
    if answer.status != 0 or not (np.isfinite(answer.x).all() and np.isfinite(answer.eqlin.marginals).all()):
        return None
    return np.asarray(answer.x), np.asarray(answer.eqlin.marginals)
