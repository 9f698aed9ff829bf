"""From nearly a coupled state to one that is exact to rounding: active sets, then joint Gauss-Newton.

A solver leaves every force a little positive and every direction a little off. Here it is decided which points press
(fn > theta (dn + 1)) and which of them rub (|f_t| > tau); forces elsewhere become exactly zero, and the rest of the
state is a root of a small system in forces and motion together, see `block_newton`. What then violates an inequality
joins the equations.
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.analysis.coupled.block_newton import BlockNewton, Sets
from cyclopean.analysis.coupled.states import Bounds, Residuals, measure, merit
from cyclopean.arrays import Floats
from cyclopean.statics import EquilibriumSystem

__all__ = ["Attempt", "attempt", "better", "nothing", "polish", "total_merit"]

LADDER = ((1.0, 1e-6), (1e-3, 1e-6), (1.0, 1e-8), (1.0, 1e-4), (1e3, 1e-6))  # theta, tau
PRESSED = 1e-9  # weights of the lighter block: below that a point carries nothing
SOUND = 1e-6  # residuals of a triple whose merit means something


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """What a route of the search brought home: a state, or the best triple it met."""

    f: Floats  # (q, 3)
    dq: Floats  # (6 m,)
    residuals: Residuals
    merit: float  # of forces that balance and a motion within its bounds; infinite for others
    infeasible: bool = False  # the solver says that no forces balance the loads
    solves: int = 0
    rounds: int = 0
    iterations: int = 0  # of the solver, a factorisation each
    folds: tuple[int, ...] = ()  # contact points at which a path folds, those whose dilation does most work first

    @property
    def found(self) -> bool:
        """Whether this is a state."""
        return self.residuals.accepted


def attempt(system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats) -> Attempt:
    """The triple of (q, 3) forces and (6n,) motion as it stands, measured."""
    residuals = measure(system, bounds, f, dq)
    r = residuals
    sound = np.max([r.equilibrium, r.cone, r.gap, r.reach]) <= SOUND
    return Attempt(f, dq, residuals, total_merit(system, bounds, f, dq) if sound else np.inf)


def nothing(system: EquilibriumSystem, bounds: Bounds) -> Attempt:
    """No forces and no motion: what a search starts from."""
    return attempt(system, bounds, np.zeros((system.points, 3)), np.zeros(len(system.p)))


def total_merit(system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats) -> float:
    """Sum of the merit of (q, 3) forces and a (6n,) motion over all points."""
    normal, tangential = merit(system, bounds, f, dq)
    return float(normal.sum() + tangential.sum())


def better(one: Attempt, other: Attempt) -> Attempt:
    """A state rather than none, then the smaller merit."""
    if one.found or not (other.found or other.merit < one.merit):
        return one
    return other


def polish(
    system: EquilibriumSystem,
    bounds: Bounds,
    f: Floats,
    dq: Floats,
    choices: int = len(LADDER),
) -> tuple[Floats, Floats, Residuals]:
    """Look for an exact state near (f, dq); stops at the first that is accepted.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, q points.
    bounds : Bounds
        With eps = 1.
    f : (q, 3)
        Scaled forces, nearly a state.
    dq : (6 m,)
        Their displacement.
    choices : int
        How many ways of choosing the sets to try; most successes come from the first.

    Returns
    -------
    f, dq, residuals
        The best triple met, the given one included. Forces off E and friction off T are exactly zero.
    """
    best = (f, dq, measure(system, bounds, f, dq))
    if best[2].accepted or not (np.isfinite(f).all() and np.isfinite(dq).all()):
        return best
    newton, tried = BlockNewton(system, bounds), list[Sets]()
    for theta, tau in LADDER[:choices]:
        for near, moved in newton.repaired(_chosen(system, f, dq, theta, tau), f, dq, tried):
            residuals = measure(system, bounds, near, moved)
            if not (best[2].worst <= residuals.worst):
                best = (near, moved, residuals)
            if residuals.accepted:
                return best
    return best


def _chosen(system: EquilibriumSystem, f: Floats, dq: Floats, theta: float, tau: float) -> Sets:
    gap, f = system.gap(dq)[:, 0] + 1.0, f / system.lighter[:, None]
    pressed = (f[:, 0] > theta * gap) & (f[:, 0] > PRESSED)
    return Sets.of(pressed, pressed & (np.hypot(f[:, 1], f[:, 2]) > tau) & (system.mu > 0.0))
