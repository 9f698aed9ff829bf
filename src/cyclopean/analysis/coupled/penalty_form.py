"""Where a model without a coupled state would need glue: the penalty form of coupled rigid-block analysis.

Every contact point may pull with a force t >= 0 along its normal, at the price of opening: a coupled state with glue is

    A (f - t n) = -p, f in K_mu, eqs. (8) to (10) of [Kao2022]_ for f as ever     t (dn - w) = 0, dn <= w, t >= 0

so that a joint is glued only where it has opened by w, and never presses and pulls at one point. (The peer prices
1e6 t^2 and bounds dn by eta: there w = eta. A stiff spring dn = gamma t would make the bounds of the motion
meaningless; a stop at dn = w keeps them, and where one w asks for more sliding than eta, a smaller one does not.)

A pull along n that resists opening beyond w is nothing but a frictionless contact point that faces the other way: with
its column -A n / w, the force t w >= 0 and the gap -dn / w >= -1 obey the same equations as any other point. So the
system with q further points is solved by the routes of coupled analysis as they are.

By hand: a block of weight W whose centre overhangs the edge of its support by a, glued along a line b behind that edge,
needs t = W a / b. A block on a slope beyond friction cannot be held by glue in a coupled state: its flat joint would
have to press and pull at once. Nor can an H frame's beam between parallel faces: what one face opens the other closes.
Then the forces of the convex programme are returned.

References
----------
.. [Kao2022] Kao, Iannuzzo, Thomaszewski, Coros, Van Mele, Block: Coupled Rigid-Block Analysis. Computer-Aided
   Design 146 (2022) 103216.
"""

import time
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.coupled.alternation import alternation
from cyclopean.analysis.coupled.continuation import continuation
from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.polish import Attempt, attempt, better, nothing
from cyclopean.analysis.coupled.programme_a import Prices
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem

__all__ = ["coupled_tension", "glued"]

OPENINGS = (0.5, 0.1)  # w in terms of eta: a smaller one where sliding would exceed eta


def glued(system: EquilibriumSystem, opening: float) -> EquilibriumSystem:
    """The system with a frictionless point facing the other way at every contact point: f = t w, gap = -dn / w.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, q points.
    opening : float
        w > 0 in eps.
    """
    q = system.points
    backwards = sp.kron(sp.identity(q), np.diag([-1.0 / opening, 0.0, 0.0]))
    frame = np.zeros_like(system.frame)
    frame[:, 0] = -system.frame[:, 0] / opening
    return replace(
        system,
        used=np.concatenate([system.used, system.used]),
        row_a=np.concatenate([system.row_a, system.row_a]),
        row_b=np.concatenate([system.row_b, system.row_b]),
        arm_a=np.concatenate([system.arm_a, system.arm_a]),
        arm_b=np.concatenate([system.arm_b, system.arm_b]),
        frame=np.concatenate([system.frame, frame]),
        mu=np.concatenate([system.mu, np.zeros(q)]),
        A=sp.hstack([system.A, system.A @ backwards], format="csr"),
    )


def coupled_tension(
    system: EquilibriumSystem,
    bounds: Bounds,
    state: tuple[Floats, Floats] | None = None,
    seconds: float = 20.0,
) -> tuple[Floats, Attempt]:
    """Measure the tension that a coupled state would need (penalty form).

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, q points.
    bounds : Bounds
        Of the displacement.
    state : (f, dq), optional
        A coupled state that is known already: then there is no tension to look for.
    seconds : float
        Budget.

    Returns
    -------
    pull : (q,)
        Scaled tension of each point; exactly zero where there is none.
    found : Attempt
        A coupled state, or one of the system with glue, whose q further points come last; where there is neither,
        forces that balance with glue.

    Raises
    ------
    SolverError
        Even with glue no forces balance the loads: blocks that nothing touches, or joints without friction.
    """
    bounds, deadline = bounds.unit(), time.perf_counter() + seconds
    if system.points == 0 and system.p.any():
        raise SolverError("no forces balance the loads: there is no joint to glue")
    found = nothing(system, bounds) if state is None else attempt(system, bounds, *state)
    found = found if found.found else _searched(system, bounds, deadline)
    if found.found:
        return np.zeros(system.points), found
    for opening in (share * bounds.eta for share in OPENINGS):
        found = _searched(glued(system, opening), bounds, deadline)
        if found.found:
            return _pull(found, opening), found
    opening = OPENINGS[0] * bounds.eta
    found = _balanced(glued(system, opening), bounds)
    return _pull(found, opening), found


def _searched(system: EquilibriumSystem, bounds: Bounds, deadline: float) -> Attempt:
    """By the continuation, then by alternation."""
    found = continuation(system, bounds, deadline=deadline)
    return found if found.found else better(found, alternation(system, bounds, deadline=deadline))


def _balanced(both: EquilibriumSystem, bounds: Bounds) -> Attempt:
    """Forces and pulls of the convex programme, whose sliding dilates: balanced, but not yet coupled."""
    one = np.ones(both.points)
    answer = Halves(both, bounds).priced(Prices(one, 2.0 * bounds.beta, one))
    if answer.word != "solved":
        raise SolverError("no forces balance the loads, not even with glue in every joint")
    f = np.where(np.abs(answer.f) < 1e-8, 0.0, answer.f)
    return Attempt(f, answer.dq, measure(both, bounds, f, answer.dq), np.inf)


def _pull(found: Attempt, opening: float) -> Floats:
    """(q,) of 2 q points, of which the last q are glue."""
    return np.maximum(found.f[len(found.f) // 2 :, 0], 0.0) / opening
