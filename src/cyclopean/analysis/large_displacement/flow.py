"""Motions in which joints slide without opening: friction bounded by mu times the pressure found before.

In rigid-block equilibrium what slides opens too (associated flow); no real friction does, and finite motions along such
a flow lift stones. With the bound mu N of each point held still, N the pressure found before, the programme

    min  g.f   s.t.  A f = -p,  fn >= 0,  |f_t| <= mu N      (forces)

    min  -p.d + sum of mu N |dd_t|   s.t.  dd = A'd + g,  dn >= 0      (its dual: motions)

has motions that slide in the plane of a joint: g is how far points are open, and have slipped since the last place of
rest. N is taken from its forces, and it is solved again until they agree [Gilbert2006]_. They need not: only the motion
is used, and what it leads to is judged by itself.

References
----------
.. [Gilbert2006] Gilbert, Casapulla, Ahmed: Limit analysis of masonry block structures with non-associative frictional
   joints using linear programming. Computers & Structures 84 (2006).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.equilibrium.reference import conic_options
from cyclopean.arrays import Floats
from cyclopean.solvers import Cone as ConeKind
from cyclopean.solvers import ConicProgram, solve
from cyclopean.statics import EquilibriumSystem

__all__ = ["DryFlow", "Stuck", "dry_flow"]

ROUNDS = 8  # of pressures and bounds
AGREE = 1e-3  # of the largest pressure: they agree
SETTLES = 3  # rounds after which the mean of two pressures is taken: they may alternate
TOLERANCE = 1e-10  # of the conic solver, as of settlements
FLOOR = 1e-6  # of the largest pressure: of friction at every point, so that no cone is without inside
SLIDES = 1e-6  # of the largest of all motions: a point that presses and moves more slides, so that its bound matters
Stuck = Literal["falls", "locked", "undecided"]


@dataclass(frozen=True, slots=True, eq=False)
class DryFlow:
    """Forces and a motion of that programme."""

    f: Floats  # (q, 3)
    y: Floats  # (6 m,) d
    dd: Floats  # (q, 3)


def dry_flow(system: EquilibriumSystem, pressure: Floats, gap: Floats) -> DryFlow | Stuck:
    """Solve that programme, or say why not.

    "falls": nothing balances within the bounds; "locked": no motion clears all joints; else "undecided".

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    pressure : (q,)
        N to begin with.
    gap : (q, 3)
        g, in each point's frame.
    """
    found: DryFlow | Stuck = "undecided"
    for k in range(ROUNDS):
        bound = system.mu * pressure + FLOOR * float(np.max(pressure, initial=0.0))
        answer = solve(_program(system, bound, gap), **conic_options(system.blocks, TOLERANCE))
        if answer.word != "solved":
            if isinstance(found, str):
                found = "falls" if answer.word == "infeasible" else "undecided"
                if "DualInfeasible" in answer.status:
                    found = "locked"
            break
        y = system.still(answer.z[: len(system.p)])
        found = DryFlow(answer.x[: 3 * system.points].reshape(-1, 3), y, system.gap(y) + gap)
        now = np.maximum(found.f[:, 0], 0.0)
        top, off = float(np.max(now, initial=0.0)), np.abs(now - pressure)
        slides = np.hypot(found.dd[:, 1], found.dd[:, 2]) > SLIDES * float(np.max(np.abs(y), initial=0.0))
        if not (off[slides] > AGREE * top).any():
            break
        pressure = now if k < SETTLES else (now + pressure) / 2.0
    return found


def _program(system: EquilibriumSystem, bound: Floats, gap: Floats) -> ConicProgram:
    q, n = system.points, len(system.p)
    point = np.arange(q)
    pressing = sp.csr_matrix((-np.ones(q), (point, 3 * point)), shape=(q, 3 * q))
    cone = 3 * np.repeat(point, 2) + np.tile([1, 2], q)
    rubbing = sp.csr_matrix((-np.ones(2 * q), (cone, cone)), shape=(3 * q, 3 * q))
    b = np.concatenate([-system.p, np.zeros(4 * q)])
    b[n + q :: 3] = bound
    cones: tuple[ConeKind, ...] = (("zero", n, 1), ("nonnegative", q, 1), ("second-order", 3, q))
    A = sp.vstack([system.A, pressing, rubbing], format="csc")
    return ConicProgram(sp.csc_matrix((3 * q, 3 * q)), gap.ravel(), A, b, cones)
