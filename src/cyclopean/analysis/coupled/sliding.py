"""Forces whose multipliers slide: the convex programme behind coupled rigid-block analysis.

With a price 1 + s_k of compression and a compliance alpha_k of friction per point,

    min  sum (1 + s) fn + beta sum |f_t| + 1/2 sum alpha |f_t|^2
    s.t.  A f = -p,   |f_t| <= mu fn

has a multiplier dq of equilibrium with dd = A'dq and, where fn > 0 and the bound on |f_t| is idle,

    dn = -(1 + s),     dd_t = -(beta + alpha |f_t|) f_t / |f_t|

which is eqs. (8) to (10) of [Kao2022]_ as soon as s vanishes and no friction bound is active. (On the edge of the real
cone with multiplier l, dn = -(1 + s) + mu l and |dd_t| = beta + alpha |f_t| + l: raising s by mu l mends dn.) The
bounds dn <= eta and |dd_t| <= eta enter as fictitious point forces h priced at eta, which must come out as zero.

References
----------
.. [Kao2022] Kao, Iannuzzo, Thomaszewski, Coros, Van Mele, Block: Coupled Rigid-Block Analysis. Computer-Aided
   Design 146 (2022) 103216.
"""

import time
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Floats
from cyclopean.solvers import Cone, ConicProgram, solve
from cyclopean.statics import EquilibriumSystem

__all__ = ["SlidingAnswer", "SlidingProgram", "tolerances"]

LARGE = 1000  # blocks above which Clarabel's `faer` factorisation beats its `qdldl`


@dataclass(frozen=True, slots=True, eq=False)
class SlidingAnswer:
    """Forces and their multipliers, as the solver left them."""

    word: Literal["solved", "infeasible", "failed"]
    f: Floats  # (q, 3)
    dq: Floats  # (6 m,)
    fictitious: float  # largest fictitious point force; 0 without them
    iterations: int


def tolerances(blocks: int, optimal: float = 1e-10, deadline: float = np.inf) -> dict[str, Any]:
    """Settings of Clarabel for programmes of this size, to be done at `deadline` of `time.perf_counter`."""
    return {
        "time_limit": max(deadline - time.perf_counter(), 1e-3),
        "tol_gap_abs": optimal,
        "tol_gap_rel": optimal,
        "tol_feas": optimal,
        "tol_infeas_abs": 1e-9,
        "tol_infeas_rel": 1e-9,
        "direct_solve_method": "faer" if blocks > LARGE else "qdldl",
    }


class SlidingProgram:
    """The programme of one system: rows are laid out once, and each solve changes prices and bounds only.

    Unknowns: (fn, fu, fv) of every point, r >= |f_t| where there is friction, and with `eta` the fictitious forces: a
    pull at every point, (hu, hv) and its size.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, q points.
    beta : float
        Price of friction; twice beta_min keeps sliding clear of it.
    eta : float, optional
        Bound of the displacement; infinite without it.
    """

    def __init__(self, system: EquilibriumSystem, beta: float = 0.02, eta: float | None = None) -> None:
        self.system, self.beta, self.eta = system, beta, eta
        q = system.points
        self.rough = np.flatnonzero(system.mu > 0.0)  # points with friction
        rub, points = len(self.rough), np.arange(q)
        force = _tangents_off(system) if rub < q else system.A
        parts = [force.tocsc(), sp.csc_matrix((len(system.p), rub))]
        if eta is not None:
            columns = system.A.tocsc()
            parts += [-columns[:, 0::3], columns[:, 1::3], columns[:, 2::3], sp.csc_matrix((len(system.p), q))]
        balance = sp.hstack(parts, format="csc")
        self.size = balance.shape[1]
        limit = _rows(np.arange(rub), 3 * q + np.arange(rub), 1.0, rub, self.size)
        limit = limit - _rows(np.arange(rub), 3 * self.rough, system.mu[self.rough], rub, self.size)
        pressed = np.flatnonzero(system.mu <= 0.0)  # elsewhere |f_t| <= mu fn implies fn >= 0
        rows = [balance, -_rows(np.arange(len(pressed)), 3 * pressed, 1.0, len(pressed), self.size), limit]
        cones: list[Cone] = [("zero", len(system.p), 1), ("nonnegative", len(pressed) + rub, 1)]
        if eta is not None:
            pull = 3 * q + rub + points
            rows.append(-_rows(points, pull, 1.0, q, self.size))
            cones.append(("nonnegative", q, 1))
            rows.append(_cone_rows(pull + 3 * q, pull + q, pull + 2 * q, self.size))
            cones.append(("second-order", 3, q))
        rows.append(_cone_rows(3 * q + np.arange(rub), 3 * self.rough + 1, 3 * self.rough + 2, self.size))
        cones.append(("second-order", 3, rub))
        self.A, self.cones = sp.vstack(rows, format="csc"), tuple(cones)

    def solve(self, shift: Floats, alpha: Floats, deadline: float = np.inf) -> SlidingAnswer:
        """Solve for (q,) price shifts s and compliances alpha."""
        system, q = self.system, self.system.points
        cost = np.zeros(self.size)
        cost[0 : 3 * q : 3] = 1.0 + shift
        cost[3 * q : 3 * q + len(self.rough)] = self.beta
        if self.eta is not None:
            at = 3 * q + len(self.rough)
            cost[at : at + q] = cost[at + 3 * q : at + 4 * q] = self.eta
        curvature = np.zeros(self.size)
        curvature[1 : 3 * q : 3] = curvature[2 : 3 * q : 3] = alpha
        b = np.zeros(self.A.shape[0])
        b[: len(system.p)] = -system.p
        program = ConicProgram(sp.diags(curvature, format="csc"), cost, self.A, b, self.cones)
        answer = solve(program, **tolerances(system.blocks, deadline=deadline))
        f = answer.x[: 3 * q].reshape(-1, 3).copy()
        f[system.mu <= 0.0, 1:] = 0.0
        beyond = answer.x[3 * q + len(self.rough) :]
        fictitious = float(np.max(np.abs(beyond), initial=0.0))
        return SlidingAnswer(answer.word, f, answer.z[: len(system.p)].copy(), fictitious, answer.iterations)


def _rows(row: Any, column: Any, value: Any, count: int, size: int) -> Any:
    return sp.csc_matrix((np.broadcast_to(value, len(row)), (row, column)), shape=(count, size))


def _cone_rows(head: Any, first: Any, second: Any, size: int) -> Any:
    """Rows -(head, first, second) of every point, interleaved: a second-order cone each."""
    count = len(head)
    column = np.stack([head, first, second], 1).ravel()
    return _rows(np.arange(3 * count), column, -1.0, 3 * count, size)


def _tangents_off(system: EquilibriumSystem) -> Any:
    """A without the friction columns of points that have none."""
    keep = np.ones((system.points, 3))
    keep[system.mu <= 0.0, 1:] = 0.0
    return system.A @ sp.diags(keep.ravel())
