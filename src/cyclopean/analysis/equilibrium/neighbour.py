"""Rigid-block equilibrium of models that differ little from one to the next."""

import numpy as np

from cyclopean.analysis.equilibrium.newton import DualAnswer, collapse_bound, newton
from cyclopean.analysis.equilibrium.rbe import COLLAPSE, Outcome, solve_rbe
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["Neighbour"]

STEPS = 8  # of Newton's method from a neighbour; beyond, a search from nothing is as quick


class Neighbour:
    """What the models before came to: a start for the next one, which the checker judges like any other answer.

    All of them have the same free blocks and points.
    """

    def __init__(self) -> None:
        self.rest: Floats | None = None  # (6 m,) y of a state
        self.fall: Floats | None = None  # (6 m,) a mechanism
        self.schur: Schur | None = None  # of the first of them: the others have its pattern

    def solve(self, system: EquilibriumSystem, solver: str = "auto") -> Outcome:
        """Answer as `solve_rbe` does, from what is known if that is enough."""
        if not system.points:
            return solve_rbe(system, solver)
        if self.fall is not None and (bound := collapse_bound(system, self.fall)) >= COLLAPSE:
            return Outcome("collapse", None, self.fall, np.inf, bound)  # the same mechanism again
        schur = self.schur = Schur(system) if self.schur is None else self.schur.on(system)
        if self.rest is not None and (near := self._rested(system, schur)) is not None:
            return Outcome("balanced", near.f, None, near.residual)
        outcome = solve_rbe(system, solver, schur=schur)
        if outcome.word == "collapse":
            self.fall = outcome.y
        elif outcome.word == "balanced":
            self._rested(system, schur)
        return outcome

    def _rested(self, system: EquilibriumSystem, schur: Schur) -> DualAnswer | None:
        """The state that Newton's method finds from the last one, remembered; None where it finds none."""
        try:
            near = newton(system, schur, start=self.rest, cap=STEPS)
        except SolverError:
            return None
        if near.word != "balanced":
            return None
        self.rest = near.y
        return near
