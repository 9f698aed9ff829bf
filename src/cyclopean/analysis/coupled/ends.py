"""The ends of a path: from an iterate near a coupled state to the state itself, two ways, and the best so far.

`settled` reads the sets off an iterate (which points press, rub, are at their bound) and polishes them; `followed`
frees every alpha and follows the central path.
"""

import numpy as np

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
        """Follow the central path, then polish where it ends."""
        end = follow_path(self.system, self.twice(), self.bounds, at.f, at.dq, self.deadline)
        if self.keep(end.f, end.dq):
            return True
        return end.product < CLEAR and self.polished(end.sets, end.f, end.dq)
