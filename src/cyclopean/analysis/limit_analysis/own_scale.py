"""Both bounds of a multiplier with every block measured by its own weight and size.

Where stones of very different sizes lie together, a small one that tips is lost in the rounding of the large ones: then
the conic programme is solved again, rows of each block in its own weight, forces in the weight of the lighter block at
each point. Forces are polished until each block balances; the motion is made to open every joint of what moves,

    min  -p0.y    s.t.  p1.y = 1,  dd - delta n in K* at every joint of the group

so that no contact resists it, not even by rounding, and -p0.y / p1.y is an upper bound whatever delta is.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.equilibrium.components import group
from cyclopean.analysis.equilibrium.exact_balance import Balance
from cyclopean.analysis.equilibrium.opening import moving_groups, pressed
from cyclopean.analysis.equilibrium.own_scale import lighter_weight, own_rows, own_scaled
from cyclopean.analysis.equilibrium.reference import dual_rows
from cyclopean.analysis.limit_analysis.load_family import Pencil, total
from cyclopean.analysis.limit_analysis.reference import limit_by_clarabel
from cyclopean.analysis.limit_analysis.solving import HEAVY, LimitOutcome
from cyclopean.arrays import Bools, Floats
from cyclopean.errors import SolverError
from cyclopean.solvers import ConicProgram, solve
from cyclopean.statics import EquilibriumSystem, project_cones

__all__ = ["limit_at_own_scale", "opened_bound"]

OPENINGS = (1e-9, 1e-7, 1e-5)  # delta, where |(v, D omega)| is of the size that p1.y = 1 gives it
LARGEST = 1500  # blocks of a group that is opened
TIGHT = 1e-11  # tolerances of the conic solver


def limit_at_own_scale(loads: Pencil, balance: Balance) -> LimitOutcome:
    """Both bounds, as far as they are found, in the units of `loads`; claims, as all that solvers say.

    Parameters
    ----------
    loads : Pencil
        Of a system whose blocks have own weights.
    balance : Balance
        Of the same system.
    """
    system = loads.system
    columns = lighter_weight(system, system.weight)
    scaled = own_scaled(system, system.weight, system.diagonal, columns)
    rows = own_rows(system.weight, system.diagonal)
    unit = float(np.max(np.abs(rows * loads.q), initial=0.0))
    if not unit > 0.0:
        return LimitOutcome("undecided")
    point = limit_by_clarabel(replace(loads, system=scaled, q=rows * loads.q / unit))
    f = columns[:, None] * project_cones(point.f, system.mu)
    if point.word == "unbounded":
        s = HEAVY * max(total(system.p), 1e-300) / max(total(loads.q), 1e-300)
        return LimitOutcome("unbounded", lower=s)
    if point.word == "infeasible":
        return LimitOutcome("undecided")
    y = rows * point.y
    upper, motion = opened_bound(loads, balance, y)
    return LimitOutcome("limit", lower=point.s / unit, upper=upper, f=f, y=motion)


def opened_bound(loads: Pencil, balance: Balance, y: Floats) -> tuple[float, Floats | None]:
    """The least upper bound of motions that open every joint of a group of blocks, and that motion.

    Parameters
    ----------
    loads : Pencil
        Dead and live loads.
    balance : Balance
        Of the same system: says what rounding may do to motions.
    y : (6 m,)
        What nearly is the mechanism: says which blocks move.
    """
    system = loads.system
    best: tuple[float, Floats | None] = (np.inf, None)
    seen: set[bytes] = set()
    for chosen in moving_groups(system, system.weight, system.diagonal, y):
        if chosen.tobytes() in seen or chosen.sum() > LARGEST:
            continue
        seen.add(chosen.tobytes())
        for found in _opened(loads, chosen):
            power = float(loads.q @ found)
            if not power > 0.0 or pressed(system, balance, found.reshape(-1, 6)).any():
                continue
            upper = -float(system.p @ found) / power
            upper += 4e-15 * float(np.abs(system.p) @ np.abs(found)) / power
            best = (upper, found) if upper < best[0] else best
            break
    return best


def _opened(loads: Pencil, chosen: Bools) -> Iterator[Floats]:
    """Motions of a group, opening by more and more."""
    part = group(replace(loads.system, pull=np.zeros(0)), chosen)
    rows = own_rows(np.ones(len(part.blocks)), part.system.diagonal)
    six = (6 * part.blocks[:, None] + np.arange(6)).ravel()
    live, dead = rows * loads.q[six], rows * part.system.p
    unit = float(np.max(np.abs(live), initial=0.0))
    if not unit > 0.0 or not len(part.points):
        return
    even = own_scaled(part.system, np.ones(len(part.blocks)), part.system.diagonal, np.ones(len(part.points)))
    for delta in OPENINGS:
        answer = _solved(even, live / unit, dead / unit, delta)
        if answer is not None:
            yield part.spread(rows * answer, loads.system.blocks)


def _solved(system: EquilibriumSystem, live: Floats, dead: Floats, delta: float) -> Floats | None:
    """Min -dead.y subject to live.y = 1 and every dd at least delta inside K*."""
    cone_rows, kinds, offset = dual_rows(system, delta)
    A = sp.vstack([sp.csc_matrix(live[None]), cone_rows], format="csc")
    b = np.concatenate([[1.0], offset])
    n = len(live)
    program = ConicProgram(sp.csc_matrix((n, n)), -dead, A, b, (("zero", 1, 1), *kinds))
    try:
        answer = solve(program, max_iter=200, tol_gap_abs=TIGHT, tol_gap_rel=TIGHT, tol_feas=TIGHT)
    except SolverError:
        return None
    usable = answer.word == "solved" or "Almost" in answer.status
    return answer.x if usable and np.isfinite(answer.x).all() else None
