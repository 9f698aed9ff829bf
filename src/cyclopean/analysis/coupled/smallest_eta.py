"""From a coupled state to one that moves less: how small may eta be before no state is near?

Near a state (f, dq) its conditions are linear but for three things: friction lies along sliding, within its circle, and
no point slides further than eta. Linearised, with (u, v) the tangents and e = dd_t / |dd_t|, the least eta within a
trusted distance is a linear programme in the changes of forces and motion,

    min eta    A (f + df) = -p    dn + ddn = -1 and fn >= 0 where the joint is shut, dn + ddn >= -1 and f = 0 elsewhere
               f_t x dd_t = 0, e.f_t <= 0, e.dd_t >= beta where friction may act, within its bound
               dn <= eta, c.dd_t <= eta in directions c around e

Its answer is polished into a state, if need be after programmes around it that correct what is not linear; one that
moves less is the next to start from, else the distance shrinks. What is reached is a local minimum.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.coupled.polish import polish
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.errors import InputError
from cyclopean.statics import EquilibriumSystem

__all__ = ["smallest_eta"]

SHUT = 1e-7  # eps: a joint that gaps less may press
PRESSED = 1e-9  # weights of the lighter block: what presses less carries nothing
SPARE = 1.001  # of beta_min, so that a polish does not end below it
TURNS = np.linspace(-np.pi / 2.0, np.pi / 2.0, 13)  # directions in which circles are held to, around where they touch
FAR = 0.3  # of eta: what slides less in a state does not limit its eta
POINTS = 250  # contact points up to which programmes take seconds, not minutes
LIMITS = {"maxiter": 20_000}  # of one programme
TRUST, WIDER, NARROWER, LEAST = 0.3, 2.0, 0.3, 1e-5  # shares of eta and of each force; growth; what is too little
GAIN = 1e-6  # of eta: a programme that promises less ends it
CORRECTIONS, CONTRACTS = 5, 0.5  # programmes from one state; share of what was left that the next has to undercut
AIM = 0.999  # of the eta that is good enough: no programme aims lower
NORMAL, NONE = np.array([1.0, 0.0, 0.0]), np.zeros(3)
CHOICES = 2  # of the polish, for each step
_dot: Callable[[Floats, Floats], Floats] = partial(np.einsum, "qj,qj->q")


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """A state from which to go on, and what is linear there."""

    f: Floats  # (q, 3)
    dq: Floats  # (6 m,)
    gap: Floats  # (q, 3)
    eta: float  # what it needs
    bears: Bools  # (q,) presses, or may
    rubs: Bools  # (q,) of these, whose friction may act


def smallest_eta(
    system: EquilibriumSystem,
    bounds: Bounds,
    f: Floats,
    dq: Floats,
    programmes: int,
    stop: Callable[[], bool] = lambda: False,
) -> tuple[float, Floats, Floats]:
    """Lower the eta that a coupled state needs, by linear programmes on the joints that press and rub in it.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, q points.
    bounds : Bounds
        With eps = 1; a state that needs no more than their eta is good enough.
    f : (q, 3)
        Scaled forces of a state.
    dq : (6 m,)
        Its displacement, whatever its size.
    programmes : int
        Linear programmes to solve at most; none where there are more than `POINTS` contact points.
    stop : callable
        Whether to stop before the next programme.

    Returns
    -------
    eta, f, dq
        The eta of the last state, never above that of the first, and the state.

    Raises
    ------
    InputError
        (f, dq) is no state for any eta.
    """
    at, trust, left = _place(system, bounds, f, dq), TRUST, programmes if system.points <= POINTS else 0
    if not measure(system, replace(bounds, eta=max(at.eta, 2.0 * bounds.beta)), f, dq).accepted:
        raise InputError("smallest eta: the forces and the displacement to start from are no coupled state")
    while left > 0 and at.eta > bounds.eta and trust > LEAST and not stop():
        lower, used = _lowered(system, bounds, at, trust, min(left, CORRECTIONS))
        left -= used
        if lower is at:
            break
        at, trust = (at, NARROWER * trust) if lower is None else (lower, min(WIDER * trust, 1.0))
    return at.eta, at.f, at.dq


def _lowered(
    system: EquilibriumSystem, bounds: Bounds, at: _Place, trust: float, programmes: int
) -> tuple[_Place | None, int]:
    """A state that needs less, None where none is met, `at` where none is to be expected; and the programmes used.

    What a programme leaves of the conditions that are not linear the next one, from its answer, corrects.
    """
    here, left = at, np.inf
    for used in range(1, programmes + 1):
        step = _step(system, bounds, here, trust)
        if step is None:
            return None, used
        if here is at and at.eta - step[2] < GAIN * at.eta:
            return at, used
        here, last = _place(system, bounds, *step[:2]), left
        within = replace(bounds, eta=at.eta)
        f, dq, residuals = polish(system, within, here.f, here.dq, CHOICES)
        lower = _place(system, bounds, f, dq)
        if residuals.accepted and lower.eta < at.eta * (1.0 - GAIN):
            return lower, used
        left = measure(system, within, here.f, here.dq).worst
        if not left < CONTRACTS * last:
            break
    return None, used


def _place(system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats) -> _Place:
    gap = system.gap(dq)
    eta = float(np.max(np.maximum(gap[:, 0], np.hypot(gap[:, 1], gap[:, 2])), initial=0.0))
    bears = (f[:, 0] > PRESSED * system.lighter) | (gap[:, 0] < SHUT - 1.0)
    rubs = bears & (np.hypot(gap[:, 1], gap[:, 2]) > bounds.beta) & (system.mu > 0.0)
    return _Place(f, dq, gap, eta, bears, rubs)


def _step(system: EquilibriumSystem, bounds: Bounds, at: _Place, trust: float) -> tuple[Floats, Floats, float] | None:
    """Forces, motion and eta of the linear programme around a state; None where it has no answer."""
    from scipy.optimize import linprog

    forces = at.f.size
    reach = trust * np.maximum(np.linalg.norm(at.f, axis=1), system.lighter)[:, None]
    high = np.where(at.bears[:, None], reach, 0.0).repeat(3, 1)
    low = -high
    low[:, 0] = np.maximum(low[:, 0], -np.maximum(at.f[:, 0], 0.0))
    low[~at.rubs, 1:] = high[~at.rubs, 1:] = -at.f[~at.rubs, 1:]
    moved = np.full(len(at.dq), trust * at.eta)
    ends = (low.ravel(), -moved, [AIM * bounds.eta]), (high.ravel(), moved, [np.inf])
    span = np.stack([np.concatenate(end) for end in ends], 1)
    equal, right, below, limit = _programme(system, bounds, at)
    found = linprog(
        np.eye(1, len(span), len(span) - 1)[0], below, limit, equal, right, span, method="highs", options=LIMITS
    )
    if found.status != 0:
        return None
    return at.f + found.x[:forces].reshape(-1, 3), at.dq + found.x[forces:-1], float(found.x[-1])


def _programme(system: EquilibriumSystem, bounds: Bounds, at: _Place) -> tuple[Any, Floats, Any, Floats]:
    """Equations and inequalities in (df, ddq, eta): a matrix and its right side, each."""
    f, d, mu, G = at.f, at.gap, system.mu, system.A.T.tocsr()
    bear, off, rub = (np.flatnonzero(which) for which in (at.bears, ~at.bears, at.rubs))
    wide = np.flatnonzero(np.hypot(d[:, 1], d[:, 2]) > FAR * at.eta)
    e = _unit(d)
    grip = _unit(f - 1e-12 * e)  # against sliding where there is no friction yet

    def rows(points: Ints, of_f: Floats, of_d: Floats, of_eta: float = 0.0) -> Any:
        """One row a point: (r, 3) or (3,) coefficients of its force and of its gap, and that of eta."""
        of_force, of_motion = (_spread(points, part, system.points) for part in (of_f, of_d))
        return sp.hstack([of_force, of_motion @ G, sp.csr_matrix(np.full((len(points), 1), of_eta))])

    balance = sp.hstack([system.A, sp.csr_matrix((len(at.dq), len(at.dq) + 1))])
    equal = [
        (balance, -system.residual(f)),
        (rows(bear, NONE, NORMAL), -1.0 - d[bear, 0]),
        (rows(rub, _turned(d[rub]), -_turned(f[rub])), -_dot(f[rub], _turned(d[rub]))),
    ]
    below = [
        (rows(off, NONE, -NORMAL), 1.0 + d[off, 0]),
        (rows(np.arange(system.points), NONE, NORMAL, -1.0), -d[:, 0]),
        (rows(rub, e[rub], NONE), -_dot(e[rub], f[rub])),
        (rows(rub, NONE, -e[rub]), _dot(e[rub], d[rub]) - SPARE * bounds.beta),
    ]
    for angle in TURNS:
        c, g = _turned(e[wide], angle), _turned(grip[rub], angle)
        below.append((rows(wide, NONE, c, -1.0), -_dot(c, d[wide])))
        below.append((rows(rub, g - mu[rub, None] * NORMAL, NONE), mu[rub] * f[rub, 0] - _dot(g, f[rub])))
    (equations, right), (inequalities, limit) = zip(*equal, strict=True), zip(*below, strict=True)
    return sp.vstack(equations), np.concatenate(right), sp.vstack(inequalities), np.concatenate(limit)


def _spread(points: Ints, coefficients: Floats, of: int) -> Any:
    """(r, 3 of) rows with the coefficients, (r, 3) or (3,), of each point in its three columns."""
    values = np.broadcast_to(coefficients, (len(points), 3))
    columns = 3 * points[:, None] + np.arange(3)
    start = 3 * np.arange(len(points) + 1)
    return sp.csr_matrix((values.ravel(), columns.ravel(), start), shape=(len(points), 3 * of))


def _unit(rows: Floats) -> Floats:
    """(r, 3) tangential parts made one long."""
    tangent = rows * (1.0 - NORMAL)
    return np.asarray(tangent / np.maximum(np.linalg.norm(tangent, axis=1), 1e-300)[:, None])


def _turned(rows: Floats, angle: float = -np.pi / 2.0) -> Floats:
    """(r, 3) tangential parts turned about the normal; backwards by a right angle, x.turned is x_u r_v - x_v r_u."""
    turned = np.stack([np.zeros(len(rows)), -rows[:, 2], rows[:, 1]], 1)
    return np.asarray(np.cos(angle) * rows * (1.0 - NORMAL) + np.sin(angle) * turned)
