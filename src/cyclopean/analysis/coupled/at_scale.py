"""Coupled states of thousands of blocks: programme A on S = A D A', then Newton on what it leaves.

Any solution of programme A (see `proximal`) in which no point's friction is at its bound mu fn is a coupled state,
whatever the stiffnesses alpha_k >= 0: dn = -1 where fn > 0, and dd_t = -(beta + alpha_k |f_t|) f_t / |f_t|. At the
bound there is a multiplier lambda = |dd_t| - beta - alpha_k |f_t|, and dn = -1 + mu lambda: a gap where the point
presses. It is closed in one of three ways, tried in every round.

* None is at its bound: the programme solved to rounding is the state.
* Newton on the state's own equations (see `block_newton`) with dn = -1 and |f_t| = mu fn kept at those points. Nothing
  in a coupled state prices friction, so the system is under-determined and a step of least norm does it.
* The same without those points: many of them carry forces that decay from round to round.

Else the next round stiffens friction: wherever lambda > 0, alpha_k is raised to what makes the observed sliding cost a
share `EASE` of the observed friction. Each round starts from the last one's answer, on the same S.

By hand: friction r = 0.5 at its bound, sliding 0.37, beta 0.02: alpha = 0.35 / (0.7 0.5) = 1 asks for r = 0.35.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from cyclopean.analysis.coupled.block_newton import BlockNewton
from cyclopean.analysis.coupled.polish import Sets
from cyclopean.analysis.coupled.proximal import Prices, proximal_newton
from cyclopean.analysis.coupled.sliding_interior import sliding_interior
from cyclopean.analysis.coupled.states import Bounds, Residuals, measure
from cyclopean.arrays import Bools, Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["ScaleAnswer", "solve_at_scale"]

EASE = 0.7  # share of the friction at its bound that the stiffened price asks for
LOOSE = 1e-4  # how well the programme is solved while some friction is at its bound
TIGHT = 2e-11  # ... and once none is
FEW = 1e-2  # lambda up to which it is worth to solve to rounding before anything else
NEAR = 1e-2  # work fn |dn + 1| from which points at their bound may be let go
SOLVED = 1e-7  # residual of the equations of a polish from which its inequalities are worth a look
WEAK = 0.3  # mean block weights per eps of gap below which a point at its bound may be let go
MENDS = 4  # sets tried in one polish
ROUNDS = 16


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
    double: int = 0  # factorisations of the polish, twice the size
    polishes: int = 0
    seconds: float = 0.0
    history: tuple[dict[str, Any], ...] = field(default=())  # one entry a round


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
        Most rounds.
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
    for number in range(rounds):
        progress(f"stiffening friction, round {number + 1}")
        try:
            done = search.round()
        except SolverError as fault:
            return search.answer(str(fault))
        if done or search.elapsed > seconds:
            break
    return search.answer("the rounds or the time ran out")


class _Search:
    """What goes from round to round."""

    def __init__(self, system: EquilibriumSystem, bounds: Bounds, seconds: float, schur: Schur) -> None:
        self.system, self.bounds, self.began, self.seconds = system, bounds, time.perf_counter(), seconds
        self.schur, self.before = schur, schur.factorisations
        self.slide = 2.0 * bounds.beta
        self.stiff = np.ones(system.points)
        self.f, self.dq = np.zeros((system.points, 3)), np.zeros(self.schur.size)
        self.best = self.f, self.dq, measure(system, bounds, self.f, self.dq)
        self.newton: BlockNewton | None = None
        self.solves = self.polishes = 0
        self.reason = ""
        self.history: list[dict[str, Any]] = []

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self.began

    def prices(self) -> Prices:
        """Of this round."""
        return Prices(np.ones(self.system.points), self.slide, self.stiff)

    def round(self) -> bool:
        """Solve, look, polish, stiffen; whether to stop."""
        before = self.schur.factorisations
        if not self.solve(LOOSE):
            return True
        found = self.keep(self.f, self.dq)
        over, work = self.overrun()
        if not found and float(np.max(over, initial=0.0)) <= FEW:
            self.solve(TIGHT)
            found = self.keep(self.f, self.dq)
            over, work = self.overrun()
        bound = over > LOOSE
        found = found or any(self.polished(*choice) for choice in self.choices(bound, work))
        self.history.append(
            {
                "at_bound": int(bound.sum()),
                "over": float(np.max(over, initial=0.0)),
                "work": work,
                "factorisations": self.schur.factorisations - before,
                "seconds": self.elapsed,
            }
        )
        if found:
            return self.within_reach()
        self.stiffen(over)
        return False

    def choices(self, bound: Bools, work: float) -> Iterator[tuple[Bools, Bools]]:
        """Which points to keep on their bounds and which to let go, the likeliest first."""
        none = np.zeros_like(bound)
        yield bound, none
        if self.elapsed > self.seconds:
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
        self.stiff = self.stiff * (0.5 * self.bounds.eta / (self.bounds.eta + reach))
        return False

    def solve(self, enough: float) -> bool:
        """Programme A at the present prices, from the last answer if that is near; whether it has one."""
        prices, system, schur = self.prices(), self.system, self.schur
        if self.solves:
            warm = proximal_newton(
                system, schur, prices, self.f, self.dq, sigma=10.0, growth=10.0, cap=12, enough=enough
            )
            self.solves += 1
            if warm.word == "solved" or enough == TIGHT:
                self.f, self.dq = warm.f, warm.q
                return True
        inner = sliding_interior(system, schur, prices)
        self.solves += 1
        if inner.word == "collapse":
            self.reason = "no forces balance the loads"
            return False
        exact = proximal_newton(system, schur, prices, inner.f, inner.q, enough=enough, cap=30)
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
        """Raise alpha where friction is at its bound."""
        tangent = np.hypot(self.f[:, 1], self.f[:, 2])
        k = np.flatnonzero((over > LOOSE) & (tangent > 0.0))
        paid = self.stiff[k] * tangent[k] + over[k]  # |dd_t| - beta
        stiff = self.stiff.copy()
        stiff[k] = paid / (EASE * tangent[k])
        self.stiff = stiff

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
        """Newton with friction on its bound at `edge` and nothing at `without`; whether it finds a state.

        Points that then pull are let go, friction beyond its bound is put on it, points pressed too far are shut, and
        points that slide too little or the wrong way are made to slide by beta.
        """
        mu, beta = self.system.mu, self.bounds.beta
        pressed = (self.f[:, 0] > 0.0) & ~without
        rubbing = pressed & (np.hypot(self.f[:, 1], self.f[:, 2]) > 0.0)
        shut, edge, slow = pressed, edge & rubbing, np.zeros_like(edge)
        newton = self.newton = self.newton or BlockNewton(self.system, self.schur)
        for _ in range(MENDS):
            self.polishes += 1
            f, dq = newton.solve(Sets(pressed, shut, rubbing, edge), slow, self.slide, self.f, self.dq)
            if self.keep(f, dq):
                return True
            left, d = measure(self.system, self.bounds, f, dq), self.system.gap(dq)
            along = f[:, 1] * d[:, 1] + f[:, 2] * d[:, 2]
            pulls = pressed & (f[:, 0] < 0.0)
            beyond = rubbing & ~edge & (np.hypot(f[:, 1], f[:, 2]) > mu * f[:, 0] + 1e-11)
            low = ~shut & (d[:, 0] < -1.0 - 1e-10)
            stuck = rubbing & ~slow & ((along > 0.0) | (np.hypot(d[:, 1], d[:, 2]) < beta))
            solved = max(left.equilibrium, left.complementarity) <= SOLVED
            if not (solved and (pulls | beyond | low | stuck).any()):
                return False
            pressed, rubbing = pressed & ~pulls, rubbing & ~pulls & (mu * f[:, 0] > 1e-12)
            edge, slow, shut = (edge | beyond) & rubbing, (slow | stuck) & rubbing, shut | low
        return False

    def answer(self, reason: str) -> ScaleAnswer:
        """What is known now."""
        f, dq, residuals = self.best
        word: Literal["coupled", "undecided"] = "coupled" if residuals.accepted else "undecided"
        return ScaleAnswer(
            word,
            f,
            dq,
            residuals,
            "" if residuals.accepted else self.reason or reason,
            len(self.history),
            self.solves,
            self.schur.factorisations - self.before,
            self.newton.factorisations if self.newton else 0,
            self.polishes,
            self.elapsed,
            tuple(self.history),
        )
