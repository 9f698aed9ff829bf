"""How new stones sit on others that are known to stand: programme A for a few blocks, the rest held where it is.

With the motion of the rest given, dd = dd0 + A'dq, and for prices beta, alpha of friction (see `coupled.halves`)

    min  sum (1 + dn0) fn + dd0_t.f_t + beta |f_t| + 1/2 alpha |f_t|^2     s.t.  A f = -p,  |f_t| <= mu fn

has multipliers dq with which the blocks press, dn = -1, and slide against their neighbours as in a coupled state, if
no friction is at its bound mu fn; where some is, its alpha is raised and the programme solved again. What the
neighbours feel is left out of balance. Friction at points that were there before is priced so that what was known of
them costs no change: beta + alpha |f_t| = |dd_t|.
"""

import numpy as np

from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.programme_a import Prices
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.analysis.warm_start.region import region
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.statics import EquilibriumSystem

__all__ = ["seated"]

ROUNDS = 30  # of raising alpha; what still is at its bound then is left to the steps that follow
EASE = 0.7  # share of friction at its bound that a raised price asks for
LOOSE = 1e-4  # eps by which a point slides too far for its price
NOTHING = 1e-6, 1e-7  # mean block weights: pressure and friction that are none
STIFFEST = 100.0  # alpha, eps a mean block weight
FURTHEST = 0.4  # of eta: sliding before friction begins


def seated(
    system: EquilibriumSystem, bounds: Bounds, blocks: Ints, old: Bools, f: Floats, dq: Floats
) -> tuple[Floats, Floats] | None:
    """Forces and motion with those of a few blocks found anew.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, q points.
    bounds : Bounds
        With eps = 1.
    blocks : (k,) int
        Rows of the free blocks to seat.
    old : (q,) bool
        Points whose forces and displacements are known from before.
    f, dq : (q, 3), (6 m,)
        What is known.

    Returns
    -------
    f, dq or None
        None where the blocks cannot be held up by the rest.
    """
    cut = region(system, blocks)
    part, point, dof = cut.part, cut.point, cut.dof
    if not len(point):
        return None
    given = cut.given(system, dq)
    beta, alpha = _prices(part, bounds, f[point], system.gap(dq)[point], old[point])
    found = _stiffened(part, bounds, given, beta, alpha)
    if found is None:
        return None
    force, motion = f.copy(), dq.copy()
    force[point], motion[dof] = found
    return force, motion


def _prices(part: EquilibriumSystem, bounds: Bounds, f: Floats, d: Floats, old: Bools) -> tuple[Floats, Floats]:
    """(q,) beta and alpha at which what is known costs no change; those of a first search at new points."""
    least = 2.0 * bounds.beta
    tangent, slide = np.hypot(f[:, 1], f[:, 2]), np.hypot(d[:, 1], d[:, 2])
    rubs = tangent > NOTHING[1]
    alpha = np.clip((slide - least) / np.maximum(tangent, 1e-9), 0.0, STIFFEST)
    spare = np.where(f[:, 0] > 0.0, 0.0, np.maximum(d[:, 0] + 1.0, 0.0) / np.maximum(part.mu, 1e-6))
    idle = np.clip(slide - spare, least, max(FURTHEST * bounds.eta, least))
    beta = np.where(rubs, np.maximum(slide - alpha * tangent, bounds.beta), idle)
    return np.where(old, beta, least), np.where(old & rubs, alpha, 1.0)


def _stiffened(
    part: EquilibriumSystem, bounds: Bounds, given: Floats, beta: Floats, alpha: Floats
) -> tuple[Floats, Floats] | None:
    """(q, 3) forces and (6 k,) motion; None where nothing balances."""
    halves, one = Halves(part, bounds), np.ones(part.points)
    f, motion = np.zeros((part.points, 3)), np.zeros(len(part.p))
    for _ in range(ROUNDS):
        answer = halves.priced(Prices(one, beta, alpha), given)
        if answer.word != "solved":
            return None
        f, motion = answer.f, answer.dq
        d = given + part.gap(motion)
        tangent = np.hypot(f[:, 1], f[:, 2])
        over = np.hypot(d[:, 1], d[:, 2]) - beta - alpha * tangent
        bound = (f[:, 0] > NOTHING[0]) & (over > LOOSE) & (part.mu > 0.0)
        if not bound.any():
            break
        alpha = np.where(bound, (alpha * tangent + over) / (EASE * np.maximum(tangent, 1e-9)), alpha)
    f = np.where((f[:, 0] > NOTHING[0])[:, None], f, 0.0)
    f[np.hypot(f[:, 1], f[:, 2]) < NOTHING[1], 1:] = 0.0
    return f, motion
