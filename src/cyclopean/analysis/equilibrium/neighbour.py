"""Rigid-block equilibrium of models that differ little from one to the next."""

import numpy as np

from cyclopean.analysis.equilibrium.newton import collapse_bound, newton
from cyclopean.analysis.equilibrium.rbe import COLLAPSE, Outcome, solve_rbe
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["Neighbour"]

STEPS = 8  # of Newton's method from a neighbour; beyond, a search from nothing is as quick


class Neighbour:
    """What the models before came to: a start for the next one, which the checker judges like any other answer.

    All of them have the same free blocks.
    """

    def __init__(self) -> None:
        self.rest: Floats | None = None  # (6 m,) y of a state
        self.fall: Floats | None = None  # (6 m,) a mechanism

    def solve(self, system: EquilibriumSystem, solver: str = "auto") -> Outcome:
        """Answer as `solve_rbe` does, from what is known if that is enough."""
        return self._from_known(system) or self._learnt(system, solve_rbe(system, solver))

    def _from_known(self, system: EquilibriumSystem) -> Outcome | None:
        """The same mechanism again, or a state that Newton's method finds from the last one; None where neither."""
        if self.fall is not None and (bound := collapse_bound(system, self.fall)) >= COLLAPSE:
            return Outcome("collapse", None, self.fall, np.inf, bound)
        if self.rest is None or not system.points:
            return None
        try:
            near = newton(system, Schur(system), start=self.rest, cap=STEPS)
        except SolverError:
            return None
        if near.word != "balanced":
            return None
        self.rest = near.y
        return Outcome("balanced", near.f, None, near.residual)

    def _learnt(self, system: EquilibriumSystem, outcome: Outcome) -> Outcome:
        """Remember what a search from nothing came to."""
        if outcome.word == "collapse":
            self.fall = outcome.y
        elif outcome.word == "balanced" and system.points:
            try:
                near = newton(system, Schur(system), cap=STEPS)
            except SolverError:
                return outcome
            self.rest = near.y if near.word == "balanced" else None
        return outcome
