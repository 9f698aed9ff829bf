"""The ends of a path: from an iterate near a coupled state to the state itself, three ways, and the best so far.

`settled` reads the sets off an iterate (which points press, rub, are at their bound) and polishes them; `followed`
frees every alpha and follows the central path; `repaired` is for ends that miss by little because more points press
than can, as corners of one joint that lie a hair off their plane. There the linear programme

    min  -(p + A_t f_t).dq    s.t.  dn >= -1,  f_t x dd_t = 0 where a point rubs,   over small changes of the motion

picks the points that do press: its multipliers are normal forces that, with friction as it is, balance the loads on
those alone. By hand: a stone on four corners, one of them low by 1e-9, stands on the three others.
"""

import time
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.coupled.block_newton import BlockNewton, Sets
from cyclopean.analysis.coupled.central_path import follow_path
from cyclopean.analysis.coupled.dilatancy import Iterate
from cyclopean.analysis.coupled.kkt import Doubled
from cyclopean.analysis.coupled.polish import Attempt, attempt, better, nothing
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.arrays import Floats
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["Ends"]

TRACES = (1e-6, 1e-4)  # friction, in weights of the lighter block, up to which there is none
MENDS = 4  # sets tried in one polish
CLEAR = 1e-4  # products at the end of a central path from which a polish is worth its time
NEARLY = 1e-4  # residual from which the repair is tried
ITERATIONS = 20_000  # of the programme
FAR = 1e3  # how far it may move a block, in its own unit


class Ends:
    """Ends tried from one system's paths."""

    def __init__(self, system: EquilibriumSystem, bounds: Bounds, schur: Schur, deadline: float = np.inf) -> None:
        self.system, self.bounds, self.schur, self.deadline = system, bounds, schur, deadline
        self.best: Attempt = nothing(system, bounds)
        self.doubled: Doubled | None = None

    @property
    def factorisations(self) -> int:
        """Of twelve unknowns a block."""
        return 0 if self.doubled is None else self.doubled.factorisations

    def twice(self) -> Doubled:
        """The matrix of polishes and central paths; ordered when first asked for."""
        self.doubled = self.doubled or Doubled(self.schur)
        return self.doubled

    def keep(self, f: Floats, dq: Floats) -> bool:
        """Remember (q, 3) forces and a (6 m,) motion if they are the best so far; whether they are a state."""
        self.best = better(self.best, attempt(self.system, self.bounds, f, dq))
        return self.best.found

    def polished(self, sets: Sets, f: Floats, dq: Floats) -> bool:
        """Newton's method from (q, 3) forces and a (6 m,) motion on these sets and on what they are mended to."""
        newton = BlockNewton(self.system, self.bounds, self.twice())
        return any(self.keep(*pair) for pair in newton.repaired(sets, sets.without(f), dq, [], MENDS))

    def settled(self, at: Iterate) -> bool:
        """Polish the sets that an iterate shows."""
        size, mu = self.system.lighter, self.system.mu
        fn, t = at.f[:, 0] / size, np.hypot(at.f[:, 1], at.f[:, 2]) / size
        slide = np.hypot(at.d[:, 1], at.d[:, 2])
        pressed = fn > at.d[:, 0] + 1.0
        at_bound = (at.kappa * t * size > 1e-3) & (mu * fn - t < 1e-2 * mu * fn)
        for trace in TRACES:
            rubbing = pressed & (t > trace) & (slide > 0.5 * self.bounds.beta) & (mu > 0.0)
            if self.polished(Sets.of(pressed, rubbing, at_bound), at.f, at.dq):
                return True
        return False

    def followed(self, at: Iterate) -> bool:
        """Follow the central path, then polish and repair where it ends."""
        end = follow_path(self.system, self.twice(), self.bounds, at.f, at.dq, self.deadline)
        if self.keep(end.f, end.dq):
            return True
        if not (end.product < CLEAR):
            return False
        return self.polished(end.sets, end.f, end.dq) or (end.residuals.worst < NEARLY and self.repaired(end.f, end.dq))

    def repaired(self, f: Floats, dq: Floats) -> bool:
        """Let a linear programme say which points press, near (q, 3) forces and a (6 m,) motion, and polish."""
        from scipy.optimize import linprog

        system = self.system
        d, weight = system.gap(dq), system.lighter
        presses = f[:, 0] > TRACES[0] * weight
        small = max(
            1e-12, 1e3 * float(np.max(np.abs(d[presses, 0] + 1.0), initial=0.0))
        )  # a programme knows 1e-7 of it
        near = (d[:, 0] + 1.0 < small) | presses
        rubs = np.hypot(f[:, 1], f[:, 2]) > TRACES[0] * weight
        rows, k = system.A.T.tocsr(), np.flatnonzero(rubs)
        e = f[k, 1:] / np.hypot(f[k, 1], f[k, 2])[:, None]
        across = sp.diags(-e[:, 1]) @ rows[3 * k + 1] + sp.diags(e[:, 0]) @ rows[3 * k + 2]
        turned = (e[:, 0] * d[k, 2] - e[:, 1] * d[k, 1]) / small
        cost = -system.residual(f * [0.0, 1.0, 1.0])
        room = (1.0 + d[near, 0]) / small
        pressing = -rows[3 * np.flatnonzero(near)]
        limits: dict[str, Any] = {"maxiter": ITERATIONS}
        if np.isfinite(self.deadline):
            limits["time_limit"] = max(self.deadline - time.perf_counter(), 0.1)
        answer = linprog(cost, pressing, room, across, -turned, (-FAR, FAR), method="highs-ds", options=limits)
        if answer.status != 0:
            return False
        fn = np.zeros(system.points)
        fn[near] = -answer.ineqlin.marginals
        pressed = fn > 1e-9 * weight
        g = f.copy()
        g[:, 0] = np.where(pressed, fn, 0.0)
        g[~pressed, 1:] = 0.0
        return self.polished(Sets.of(pressed, pressed & rubs), g, dq + small * answer.x)
