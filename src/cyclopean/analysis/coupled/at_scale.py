"""Coupled states of thousands of blocks: programme A on S = A D A', then Newton on what it leaves.

Any solution of programme A (see `proximal`) in which no point's friction is at its bound mu fn is a coupled state,
whatever the stiffnesses alpha_k >= 0: dn = -1 where fn > 0, and dd_t = -(beta + alpha_k |f_t|) f_t / |f_t|. At the
bound there is a multiplier lambda = |dd_t| - beta - alpha_k |f_t|, and dn = -1 + mu lambda: a gap where the point
presses. It is closed in one of these ways, tried in every round.

* None is at its bound: the programme solved to rounding is the state.
* Newton on the state's own equations (see `block_newton`) with dn = -1 and |f_t| = mu fn kept at those points. Nothing
  in a coupled state prices friction, so the system is under-determined and a step of least norm does it.
* The same without those points: many of them carry forces that decay from round to round.

Where these fail and there are more than a few points, a fourth way starts from the same programme before it is exact,
when everything is still off its bounds, and follows a path through the middle of the family of states (see
`central_path`). Sloping joints need it, and joints that are not quite plane, whose sets are nearly degenerate.

Else the next round stiffens friction: wherever lambda > 0, alpha_k is raised to what makes the observed sliding cost a
share `ease` of the observed friction. Each round starts from the last one's answer, on the same S.

Sloping joints mobilise friction at hundreds of points, and many of these end with no force at all, which no finite
alpha brings about. So there a plan (see `Plan`) may also raise the price beta of a point: friction of next to no force,
and friction whose point slides far already, begins only after a longer slide, yet short of eta, so that nothing slides
away for want of friction. And it may shift the gap by s, the price of fn being 1 + s, which follows mu lambda and
so takes back the gap that lambda opens. Where one plan leads nowhere, the next one starts afresh.

By hand: friction r = 0.5 at its bound, sliding 0.37, beta 0.02: alpha = 0.35 / (0.7 0.5) = 1 asks for r = 0.35.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cyclopean.analysis.coupled.block_newton import BlockNewton, Sets
from cyclopean.analysis.coupled.central_path import follow_path
from cyclopean.analysis.coupled.kkt import Doubled
from cyclopean.analysis.coupled.proximal import Pace, Prices, proximal_newton
from cyclopean.analysis.coupled.sliding_interior import sliding_interior
from cyclopean.analysis.coupled.states import Bounds, Residuals, measure
from cyclopean.arrays import Bools, Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["ScaleAnswer", "solve_at_scale"]

FAR = 0.4  # of eta: sliding beyond which friction is not stiffened any more
LOST = 5.0  # etas of sliding beyond its price: no plan returns from there
IDLE = 4  # rounds that a plan has in any case
DULL = 0.1  # of eta: sliding before friction of next to no force begins, at least
LATER = 2.0  # ... or this many times what it slides now
LOOSE = 1e-4  # how well the programme is solved while some friction is at its bound
TIGHT = 2e-11  # ... and once none is
FEW = 1e-2  # lambda up to which it is worth to solve to rounding before anything else
NEAR = 1e-2  # work fn |dn + 1| from which points at their bound may be let go
WORTH = 0.5  # work fn |dn + 1| up to which a polish may succeed on sloping joints
WEAK = 0.3  # mean block weights per eps of gap below which a point at its bound may be let go
MENDS = 4  # sets tried in one polish
ROUNDS = 16  # at most, where prices are finite only (`rounds`)
CENTRAL = 1e-4  # mean complementarity from which the path starts
FOLLOWED = 5.0  # work fn |dn + 1| up to which it may succeed
PLANNED = 200  # contact points up to which the plain plan alone is tried: other routes are thorough there


@dataclass(frozen=True, slots=True)
class Plan:
    """How friction is stiffened from round to round."""

    start: float  # alpha of the first round
    ease: float  # share of the friction at its bound that the stiffened price asks for
    tiny: float = 0.0  # mean block weights, times mu, below which friction at its bound is next to no force
    shift: float = 0.0  # how much of the way to mu lambda the shift of the gap goes
    rounds: int = 20  # at most
    reach: float = np.inf  # of eta: most sliding in the first round; alpha is lowered until then


PLAIN = Plan(1.0, 0.7)
PLANS = (
    Plan(1.0, 0.7, rounds=4),  # most regular models need no more
    Plan(3.0, 0.6, tiny=0.01, reach=0.3),
    Plan(3.0, 0.6, tiny=0.02, shift=0.5, reach=0.6),
    Plan(0.3, 0.5, tiny=0.05, shift=0.5),
    PLAIN,
)


@dataclass(frozen=True, slots=True, eq=False)
class ScaleAnswer:
    """Where the search stopped: a state, or the best pair it met."""

    word: Literal["coupled", "undecided"]
    f: Floats  # (q, 3) scaled
    dq: Floats  # (6 m,) scaled, eps = 1
    residuals: Residuals
    reason: str  # of "undecided"
    rounds: int = 0  # programmes with different prices
    solves: int = 0  # of programme A, to any precision
    factorisations: int = 0  # of S
    paths: int = 0  # followed into the middle of the family


def solve_at_scale(
    system: EquilibriumSystem,
    bounds: Bounds,
    *,
    seconds: float = 60.0,
    rounds: int = ROUNDS,
    schur: Schur | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> ScaleAnswer:
    """Find a coupled state of a system of any size by stiffening friction.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, m free blocks and q points; friction coefficients at least 1e-6.
    bounds : Bounds
        Of the displacement.
    seconds : float
        Budget; looked at between rounds and before a second polish.
    rounds : int
        Most rounds with finite prices only; other plans know when they lead nowhere.
    schur : Schur, optional
        Of the same system, where the caller has one already.
    progress : callable
        Is told of every round.

    Returns
    -------
    ScaleAnswer
        "coupled" only if `measure` accepts it.
    """
    search = _Search(system, bounds.unit(), seconds, Schur(system) if schur is None else schur)
    why = "the rounds or the time ran out"
    for plan in PLANS if system.points > PLANNED else (PLAIN,):
        search.begin(plan)
        for number in range(plan.rounds if plan.tiny > 0.0 else min(rounds, plan.rounds)):
            progress(f"stiffening friction, round {number + 1}")
            try:
                done = search.round()
            except (SolverError, np.linalg.LinAlgError) as fault:  # the next plan may go another way
                why = str(fault)
                break
            if done or search.late:
                return search.answer(why)
            if search.idle():
                break
    return search.answer(why)


class _Search:
    """What goes from round to round."""

    def __init__(self, system: EquilibriumSystem, bounds: Bounds, seconds: float, schur: Schur) -> None:
        self.system, self.bounds, self.until = system, bounds, time.perf_counter() + seconds
        self.schur, self.before = schur, schur.factorisations
        self.least = 2.0 * bounds.beta
        self.begin(PLAIN)
        self.f, self.dq = np.zeros((system.points, 3)), np.zeros(self.schur.size)
        self.best = self.f, self.dq, measure(system, bounds, self.f, self.dq)
        self.solves = self.paths = self.rounds = 0
        self.doubled: Doubled | None = None
        self.reason = ""

    def begin(self, plan: Plan) -> None:
        """Prices of a first round."""
        zero = np.zeros(self.system.points)
        self.plan, self.warm, self.started = plan, False, False
        self.trail: list[tuple[int, float]] = []  # points at their bound and largest lambda of each round
        self.slide, self.stiff, self.normal = zero + self.least, zero + plan.start, zero + 1.0

    @property
    def late(self) -> bool:
        """Whether the time is up."""
        return time.perf_counter() > self.until

    def prices(self) -> Prices:
        """Of this round."""
        return Prices(self.normal, self.slide, self.stiff)

    def round(self) -> bool:
        """Solve, look, polish, stiffen; whether to stop."""
        if not (self.solve(LOOSE) and self.gentle()):
            return True
        found = self.keep(self.f, self.dq)
        over, work = self.overrun()
        if not found and float(np.max(over, initial=0.0)) <= FEW:
            self.solve(TIGHT)
            found = self.keep(self.f, self.dq)
            over, work = self.overrun()
        bound = over > LOOSE
        found = found or (
            (work <= WORTH or not self.plan.tiny > 0.0)
            and any(self.polished(*choice) for choice in self.choices(bound, work))
        )
        found = found or (work <= FOLLOWED and self.followed())
        self.rounds += 1
        self.trail.append((int(bound.sum()), float(np.max(over, initial=0.0))))
        if found:
            return self.within_reach()
        self.stiffen(over)
        return False

    def idle(self) -> bool:
        """Whether this plan leads nowhere: points slide far beyond eta, or two rounds are alike."""
        if self.system.points <= PLANNED or not self.trail:
            return False
        (at_bound, now), eta = self.trail[-1], self.bounds.eta
        if self.plan.tiny <= 0.0 or len(self.trail) < IDLE:
            return now > LOST * eta
        as_many, last = self.trail[-2]
        return now > 2.0 * eta or (as_many == at_bound and abs(now - last) <= 1e-2 * now)

    def gentle(self) -> bool:
        """Lower the alpha a plan starts from where friction would slide far: it grows with the height of a wall."""
        started, self.started = self.started, True
        if started or not (self.plan.reach < np.inf):
            return True
        d = self.system.gap(self.dq)
        reach = float(np.max(np.hypot(d[:, 1], d[:, 2]), initial=0.0))
        if reach <= self.plan.reach * self.bounds.eta:
            return True
        self.stiff = self.stiff * (self.plan.reach * self.bounds.eta / reach)
        return self.solve(LOOSE)

    def followed(self) -> bool:
        """Follow the path from this round's programme; whether it ends at a state."""
        if self.system.points <= PLANNED or self.late:
            return False
        inner = sliding_interior(self.system, self.schur, self.prices(), gap=CENTRAL)
        if inner.word != "solved":
            return False
        self.solves, self.paths = self.solves + 1, self.paths + 1
        end = follow_path(self.system, self.twice(), self.bounds, inner.f, inner.q, self.until)
        return self.keep(end.f, end.dq)

    def twice(self) -> Doubled:
        """The matrix of polishes and paths; ordered when first asked for."""
        self.doubled = self.doubled or Doubled(self.schur)
        return self.doubled

    def choices(self, bound: Bools, work: float) -> Iterator[tuple[Bools, Bools]]:
        """Which points to keep on their bounds and which to let go, the likeliest first."""
        none = np.zeros_like(bound)
        yield bound, none
        if self.late:
            return
        weak = bound & (self.f[:, 0] < WEAK * (self.system.gap(self.dq)[:, 0] + 1.0))
        if weak.any():
            yield bound & ~weak, weak
        if work <= NEAR and bound.any():
            yield none, bound

    def within_reach(self) -> bool:
        """Whether the state found keeps |dd| <= eta; if not, all friction is softened for another round."""
        reach = self.best[2].reach
        if self.best[2].accepted:
            return True
        self.reason = "the displacement found exceeds eta"
        soft = 0.5 * self.bounds.eta / (self.bounds.eta + reach)
        self.stiff, self.slide = soft * self.stiff, np.maximum(soft * self.slide, self.least)
        return False

    def solve(self, enough: float) -> bool:
        """Programme A at the present prices, from the last answer if that is near; whether it has one."""
        prices, system, schur = self.prices(), self.system, self.schur
        if self.warm or enough == TIGHT:
            pace = Pace(sigma=10.0, growth=10.0, enough=enough, cap=12)  # the start is good: few steps
            warm = proximal_newton(system, schur, prices, self.f, self.dq, pace)
            self.solves += 1
            if warm.word == "solved" or enough == TIGHT:
                self.f, self.dq = warm.f, warm.q
                return True
            self.warm = False  # prices that change that much will do so again
        else:
            self.warm = not self.solves or self.warm
        inner = sliding_interior(system, schur, prices)
        self.solves += 1
        if inner.word == "collapse":
            self.reason = "no forces balance the loads"
            return False
        exact = proximal_newton(system, schur, prices, inner.f, inner.q, Pace(enough=enough, cap=30))
        self.f, self.dq = exact.f, exact.q
        return True

    def overrun(self) -> tuple[Floats, float]:
        """(q,) lambda at points that press, and the largest work fn |dn + 1|."""
        d = self.system.gap(self.dq)
        slide, tangent = np.hypot(d[:, 1], d[:, 2]), np.hypot(self.f[:, 1], self.f[:, 2])
        over = np.where(self.f[:, 0] > 0.0, slide - self.slide - self.stiff * tangent, 0.0)
        work = float(np.max(self.f[:, 0] * np.abs(d[:, 0] + 1.0), initial=0.0))
        return np.maximum(over, 0.0), work

    def stiffen(self, over: Floats) -> None:
        """Raise alpha, or beta, where friction is at its bound; shift the gap there."""
        plan, mu, eta = self.plan, self.system.mu, self.bounds.eta
        tangent = np.hypot(self.f[:, 1], self.f[:, 2])
        bound = (over > LOOSE) & (tangent > 0.0)
        paid = self.stiff * tangent + over  # |dd_t| - beta_k
        stiff, slide = self.stiff.copy(), self.slide.copy()
        if plan.tiny > 0.0:
            tiny = bound & (tangent < plan.tiny * mu)
            later = np.clip(LATER * (paid + slide), DULL * eta, FAR * eta)
            slide[tiny] = np.maximum(slide, later)[tiny]
            far = bound & ~tiny & (paid + self.slide > FAR * eta)
            slide[far], stiff[far] = FAR * eta, min(plan.start, 1.0)
            bound &= ~(tiny | far)
        stiff[bound] = paid[bound] / (plan.ease * tangent[bound])
        self.stiff, self.slide = stiff, slide
        shift = self.normal - 1.0
        self.normal = 1.0 + shift + plan.shift * (np.where(over > LOOSE, mu * over, 0.0) - shift)

    def keep(self, f: Floats, dq: Floats) -> bool:
        """Remember the pair if it is the best so far; whether it is a state, eta apart."""
        residuals = measure(self.system, self.bounds, f, dq)
        if not (self.best[2].worst <= residuals.worst):
            self.best = f, dq, residuals
        if replace(residuals, reach=0.0).accepted:
            self.best = f, dq, residuals
            return True
        return False

    def polished(self, edge: Bools, without: Bools) -> bool:
        """Newton with friction on its bound at `edge` and nothing at `without`; whether it finds a state."""
        pressed = (self.f[:, 0] > 0.0) & ~without
        sets = Sets.of(pressed, pressed & (np.hypot(self.f[:, 1], self.f[:, 2]) > 0.0), edge)
        newton = BlockNewton(self.system, self.bounds, self.twice())
        for pair in newton.repaired(sets, self.f, self.dq, [], MENDS):
            if self.keep(*pair):
                return True
        return False

    def answer(self, reason: str) -> ScaleAnswer:
        """What is known now."""
        found, spent = self.best[2].accepted, self.schur.factorisations - self.before
        reason = "" if found else self.reason or reason
        word: Literal["coupled", "undecided"] = "coupled" if found else "undecided"
        return ScaleAnswer(word, *self.best, reason, self.rounds, self.solves, spent, self.paths)
