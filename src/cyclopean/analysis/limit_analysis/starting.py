"""Room inside both cones: forces that press on every joint, and a motion that opens every joint."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cyclopean.analysis.equilibrium.newton import newton
from cyclopean.analysis.equilibrium.rbe import Outcome, solve_rbe
from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur, cone_jacobian, project_cones

__all__ = ["AtRest", "opening", "pressing"]

PRESSES = (0.03, 0.003, 3e-4)  # scaled normal force at every point: what blocks weigh is of size 1
ROUNDS = 12  # of Newton's method for each of them
LOST = 10.0  # collapse bound in total loads at which there is none
OPENS = 0.25  # of what is aimed at: enough of an opening
SHIFT = 1e-3  # larger ones take fewer steps: S is singular where few points close
STEPS = 60  # of Newton at most, a factorisation each


@dataclass(eq=False)
class AtRest:
    """What is known of a system whatever grows on it, each found once."""

    system: EquilibriumSystem
    _motion: list[Floats | None] = field(default_factory=list)

    @cached_property
    def schur(self) -> Schur:
        """S, whatever loads act."""
        return Schur(self.system)

    @cached_property
    def outcome(self) -> Outcome:
        """What rigid-block equilibrium says of the dead loads alone."""
        return solve_rbe(self.system, schur=self.schur if self.system.points else None)

    @cached_property
    def pressed(self) -> Floats | None:
        """Forces that balance the dead loads well inside their cones."""
        return pressing(self.system, self.schur)

    def opened(self, budget: Budget) -> Floats | None:
        """A motion that opens every joint; also None where there was no time to find one."""
        if not self._motion:
            found = opening(self.system, self.schur, budget)
            if found is None and budget.over:
                return None
            self._motion.append(found)
        return self._motion[0]


def opening(system: EquilibriumSystem, schur: Schur, budget: Budget = UNLIMITED) -> Floats | None:
    """A motion in which every joint opens, A'y - (1/2, 0, 0) in K* at every point; None where there is none.

    Semismooth Newton on 1/2 ||P_K(e - A'y)||^2 with e = (1, 0, 0). Blocks that others hold between them (a key, a
    wedge under friction) have no such motion.
    """
    axis = np.zeros((system.points, 3))
    axis[:, 0] = 1.0
    y = np.zeros(len(system.p))
    for _ in range(STEPS):
        if not np.any(project_cones(OPENS * axis - system.gap(y), system.mu)):
            return y * (0.5 / OPENS)
        if budget.over:
            return None
        f = project_cones(axis - system.gap(y), system.mu)
        merit = float(np.sum(f * f))
        try:
            factor = schur.factor(cone_jacobian(axis - system.gap(y), system.mu), SHIFT)
            d = factor.solve(np.asarray(system.A @ f.ravel()))
        except SolverError:
            return None
        length = 1.0
        for _ in range(20):
            new = project_cones(axis - system.gap(y + length * d), system.mu)
            if float(np.sum(new * new)) < (1.0 - 1e-4 * length) * merit:
                break
            length *= 0.5
        else:
            return None
        y = y + length * d
    return None


def pressing(system: EquilibriumSystem, schur: Schur) -> Floats | None:
    """Forces that balance p0 well inside their cones, f - delta (1, 0, 0) in K everywhere; None where none are found.

    With f = g + delta e that is rigid-block equilibrium of g under the loads p0 + delta A e.
    """
    axis = np.zeros((system.points, 3))
    axis[:, 0] = 1.0
    pressed = np.asarray(system.A @ axis.ravel())
    for delta in PRESSES:
        try:
            answer = newton(replace(system, p=system.p + delta * pressed), schur, cap=ROUNDS, lost=LOST)
        except SolverError:
            continue
        if answer.word == "balanced":
            return answer.f + delta * axis
    return None
