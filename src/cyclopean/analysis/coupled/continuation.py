"""First route to a coupled state: from friction that dilates to Coulomb's, along one family of equations.

Programme A is convex: the forces that balance the loads at the least cost, whose friction dilates where it is at its
bound. A coupled state does not dilate. With t = |f_t|, a multiplier kappa of the bound of friction, and s the weight of
the lighter block at each point, the family is, for theta from 1 to 0,

    A f = -p        fn (dn + 1 - theta mu^2 kappa fn) = nu s        kappa (mu^2 fn^2 - t^2) / 2 = nu s
    dd_t + (alpha / s + beta / sqrt(t^2 + (soft s)^2) + kappa) f_t = 0

At theta = 1 and nu = 0 it is programme A with the price fn + beta t + alpha t^2 / (2 s), at theta = 0 Coulomb's law:
friction at its bound slides on, and dn stays -1 where a point presses. To shift the gap by the dilation is the idea of
the bipotential [DeSaxce1998]_, to smooth products by nu that of interior points [Wright1997]_; to lead the one to the
other by a parameter is ours.

The path starts at programme A's barrier problem, whose solution is unique. At theta = 0 every alpha is set free and the
central path (see `central_path`) leads to a state; where that fails, nu goes to zero and the sets that emerge are
polished. Where the path folds, it cannot be followed by lowering theta: the central path is tried from there, and the
points whose dilation does most work then are the ones that a state would have to jam.

By hand: a cube on level ground presses with its weight and rubs nowhere. kappa = 0, theta means nothing, and the only
change on the way is nu: fn g = nu.

References
----------
.. [DeSaxce1998] De Saxce, Feng: The bipotential method: a constructive approach to design the complete contact law with
   friction. Mathematical and Computer Modelling 28 (1998) 225-245.
.. [Wright1997] Wright: Primal-Dual Interior-Point Methods. SIAM (1997).
"""

import time
from dataclasses import replace

import numpy as np

from cyclopean.analysis.coupled.block_newton import Sets
from cyclopean.analysis.coupled.dilatancy import Family, Iterate, Stage
from cyclopean.analysis.coupled.ends import Ends
from cyclopean.analysis.coupled.polish import Attempt
from cyclopean.analysis.coupled.programme_a import Prices, sliding_interior
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["FACTORISATIONS", "continuation"]

PATHS = ((0.3, 1e-2), (2.0, 1e-2), (0.3, 1e-1))  # alpha and nu of each
FACTORISATIONS = 1200  # in all; paths end by themselves, most at 50 to 150
EXACT = 1e-6  # mean complementarity to which programme A is solved first: where nothing is at its bound, that is enough
WORK = 1e-2  # fn |dn + 1| of its answer up to which a polish may succeed
SOFT = 3e-2  # friction below which its direction is smoothed, at first
REACH = 0.5  # of eta: sliding at theta = 1 beyond which alpha is lowered
FIRST, QUICK, SLOW = 0.1, 6, 12  # first step of theta; steps of Newton below which it doubles, or grows
SHRINK, SMALLEST = 0.3, 4e-3  # how it shrinks, and at what step the path folds
FAILURES = 3  # of steps of theta before the central path is tried from where the path is
STARTING, TURNING, CLOSING = 30, 12, 16  # steps of Newton for a start, a change of theta, a change of nu
CUT, SHARPEST, FLAT, EASY = 0.3, 0.05, 0.95, 9  # factor of nu: the first, the least, the one that is none; few steps
TRY, AGAIN = 1e-3, 0.02  # nu from which sets are polished, and the factor until the next time
ROUNDING = 5e-11  # nu and softness at the end: what is left is within what the checker allows
BLAMED, SHARE = 8, 0.1  # points that a fold names at most, and from what share of the largest work


def continuation(
    system: EquilibriumSystem,
    bounds: Bounds,
    budget: int = FACTORISATIONS,
    deadline: float = np.inf,
) -> Attempt:
    """Follow the family from programme A to a coupled state.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, m free blocks and q points, of any size; joints may be smooth.
    bounds : Bounds
        With eps = 1.
    budget : int
        Factorisations, looked at between stages.
    deadline : float
        Of `time.perf_counter`: stops the search wherever it is.

    Returns
    -------
    Attempt
        A state only if its residuals say so; else with the points at which the first path folds.
    """
    route = _Route(system, bounds, budget, deadline)
    folds: tuple[int, ...] = ()
    try:
        found = route.plain()
    except (SolverError, np.linalg.LinAlgError):
        found = False
    for alpha, nu in () if found or route.infeasible else PATHS:
        if route.over():
            break
        try:
            found, at, stage = route.path(alpha, nu)
        except (SolverError, np.linalg.LinAlgError):  # numerically beyond this path; the next may do better
            continue
        if found:
            break
        folds = folds or _blamed(route.family, at, stage)
    return replace(
        route.ends.best,
        infeasible=route.infeasible,
        solves=route.paths,
        rounds=route.stages,
        iterations=route.spent(),
        folds=() if found else folds,
    )


class _Route:
    """What the paths share: the factorisations spent, and the best end so far."""

    def __init__(self, system: EquilibriumSystem, bounds: Bounds, budget: int, deadline: float) -> None:
        self.system, self.bounds, self.budget, self.deadline = system, bounds, budget, deadline
        self.schur = schur = Schur(system)
        self.family, self.ends = Family(system, bounds, schur), Ends(system, bounds, schur, deadline)
        self.paths = self.stages = 0
        self.infeasible = False  # no forces balance the loads

    def spent(self) -> int:
        """Factorisations so far."""
        return self.schur.factorisations + self.ends.factorisations

    def over(self) -> bool:
        """Whether the budget or the time is spent."""
        return self.spent() >= self.budget or time.perf_counter() > self.deadline

    def prices(self, alpha: float) -> Prices:
        """Of programme A at theta = 1."""
        q = self.system.points
        return Prices(np.ones(q), np.full(q, 2.0 * self.bounds.beta), alpha / self.system.lighter)

    def plain(self) -> bool:
        """Programme A alone: the state of most upright walls, whose friction stays off its bound."""
        inner = sliding_interior(self.family.rough_system, self.schur, self.prices(1.0), gap=EXACT)
        self.paths, self.infeasible = self.paths + 1, inner.word == "collapse"
        gap = self.system.gap(inner.q)
        f = np.where(self.family.rough[:, None] | np.array([True, False, False]), inner.f, 0.0)
        if inner.word != "solved" or float(np.max(np.abs(f[:, 0] * (gap[:, 0] + 1.0)), initial=0.0)) > WORK:
            return False
        pressed = f[:, 0] > self.system.lighter * (gap[:, 0] + 1.0)
        friction, slide = np.hypot(f[:, 1], f[:, 2]), np.hypot(gap[:, 1], gap[:, 2])
        rubbing = pressed & (slide > self.bounds.beta) & (friction > 0.0)
        return self.ends.polished(Sets.of(pressed, rubbing), f, inner.q)

    def path(self, alpha: float, nu: float) -> tuple[bool, Iterate, Stage]:
        """One path: whether it ends at a state, and where theta stopped."""
        self.paths += 1
        at, stage, ok = self.start(alpha, nu)
        if not ok:
            return False, at, stage
        at, stage, found = self.turned(at, stage)
        if found or stage.theta > 0.0 or self.over():
            return found, at, stage
        return self.closed(at, stage) or self.ends.followed(at), at, stage

    def start(self, alpha: float, nu: float) -> tuple[Iterate, Stage, bool]:
        """Where theta = 1; alpha is lowered where points would slide too far: that grows with the height of a wall."""
        for _ in range(3):
            inner = sliding_interior(self.family.rough_system, self.schur, self.prices(alpha), gap=nu, loose=1.0)
            if inner.word != "solved":
                raise SolverError("programme A has no answer")
            stage = Stage(alpha, 1.0, nu, SOFT)
            at, ok = self.converged(self.family.begun(inner.q, stage), stage, STARTING)[:2]
            reach = self.reach(at) / REACH
            if not (ok and reach > 1.0):
                break
            alpha /= reach
        return at, stage, ok

    def reach(self, at: Iterate) -> float:
        """The longest displacement of a point, in eta."""
        slide = np.hypot(at.d[:, 1], at.d[:, 2])
        return float(np.max(np.maximum(at.d[:, 0], slide), initial=0.0)) / self.bounds.eta

    def turned(self, at: Iterate, stage: Stage) -> tuple[Iterate, Stage, bool]:
        """Theta to zero or to a fold; whether the central path found a state from where that was hard."""
        step, failures = FIRST, 0
        while stage.theta > 0.0 and step >= SMALLEST and not self.over():
            aim = replace(stage, theta=max(0.0, stage.theta - step))
            after, ok, steps = self.converged(at, aim, TURNING)
            if ok:
                leaves = self.reach(at) <= 1.0 < self.reach(after)  # eta: the central path has to start within it
                if leaves and self.ends.followed(at):
                    return at, stage, True
                at, stage = after, aim
                step *= 2.0 if steps < QUICK else 1.2 if steps < SLOW else 1.0
                continue
            step, failures = SHRINK * step, failures + 1
            if (failures == FAILURES or step < SMALLEST) and self.ends.followed(at):
                return at, stage, True
        return at, stage, False

    def closed(self, at: Iterate, stage: Stage) -> bool:
        """Nu to zero, as long as that is easy, polishing the sets that emerge; else the central path from there."""
        cut, failed, tried = CUT, False, TRY
        while stage.nu > ROUNDING and not self.over():
            nu = cut * stage.nu
            aim = replace(stage, nu=nu, soft=max(ROUNDING, min(stage.soft, 3.0 * nu)))
            after, ok, steps = self.converged(at, aim, CLOSING)
            if not ok:
                if not failed and self.ends.followed(at):
                    return True
                cut, failed = cut**0.5, True
                if cut > FLAT:
                    break
                continue
            at, stage = after, aim
            cut = max(cut**1.5, SHARPEST) if steps < EASY else cut
            if nu <= tried:
                tried = AGAIN * nu
                if self.ends.settled(at):
                    return True
        return self.ends.keep(at.f, at.dq) or self.ends.settled(at)

    def converged(self, at: Iterate, stage: Stage, steps: int) -> tuple[Iterate, bool, int]:
        """Newton's method on one stage, counted."""
        self.stages += 1
        return self.family.converged(at, stage, steps)


def _blamed(family: Family, at: Iterate, stage: Stage) -> tuple[int, ...]:
    """Points whose dilation does most of the work that a state would have to do without."""
    work = family.dilation(at, stage)
    order = np.argsort(-work)[:BLAMED]
    return tuple(int(k) for k in order if work[k] > SHARE * np.max(work, initial=0.0))
