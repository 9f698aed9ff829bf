"""Alternation with restarts: forces and motion fitted to each other in turn, from one start after the other.

The merit

    sum  fn (dn + 1) + (|f_t| |dd_t| + f_t . dd_t) + max(0, 2 beta_min |f_t| + f_t . dd_t)

is convex in the forces for a fixed motion and in the motion for fixed forces, never negative where f lies in its cones
and dn >= -1, and zero only at a coupled state. Each half is one conic programme, so that a descent goes down to a local
minimum, of which there are many. What is nearly a state is polished.

Descents begin at forces of programme A for several compliances and at those given; then half of them at random forces
on a random half of the points, and the others at the pair kept last, disturbed: all forces by random factors, or the
motion, or two points altogether. A minimum is kept if it is not above the last one, and now and then although it is; a
walk that makes no progress for long begins anew. Budgets count programmes: the same question has the same answer.
"""

import time
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.polish import Attempt, attempt, better, nothing, polish, total_merit
from cyclopean.analysis.coupled.programme_a import Prices
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.arrays import Floats
from cyclopean.statics import EquilibriumSystem

__all__ = ["NEAR", "Walk", "alternation"]

COMPLIANCES = (0.1, 5.0, 0.0)  # of the first starts
NEAR = 0.05  # merit from which a pair is worth polishing
ROUNDS, PROGRESS = 60, 0.997  # of a descent: at most so many rounds, each of which takes the merit down to this share
LEVEL, UPHILL = 1.02, 0.02  # how far up a restart may lead, and how often one is kept wherever it leads
PATIENCE = 40  # restarts without progress after which the walk begins anew
BUDGET = 200  # programmes
OVERDRAFT = 4  # budgets that descents from the starts may take: most take one

Pair = tuple[float, Floats, Floats]  # merit, (q, 3) forces, (6 m,) motion


def alternation(
    system: EquilibriumSystem,
    bounds: Bounds,
    starts: Iterable[Floats] = (),
    budget: int = BUDGET,
    deadline: float = np.inf,
    seed: int = 0,
) -> Attempt:
    """Descend from every start, then restart, until a state is found or the budget is spent.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    bounds : Bounds
        Only eta / eps and beta_min / eps matter.
    starts : iterable of (q, 3)
        Forces to start from, beside those of programme A.
    budget : int
        Convex programmes after which no other descent begins; after `OVERDRAFT` times that also the first ones end.
    deadline : float
        Of `time.perf_counter`: stops the search wherever it is.
    seed : int
        Of the restarts.
    """
    halves = Halves(system, bounds.unit(), deadline)
    walk = Walk(halves, seed, OVERDRAFT * budget)
    for f in _first(halves, starts):
        walk.descend(f)
        if walk.best.found or walk.over:
            break
    while not walk.best.found and halves.solves < budget and not walk.over:
        walk.restart()
    return replace(walk.best, solves=halves.solves, rounds=walk.rounds, iterations=halves.iterations)


def _first(halves: Halves, starts: Iterable[Floats]) -> Iterator[Floats]:
    """Forces of programme A at several compliances, and those given."""
    one = np.ones(halves.system.points)
    for k, compliance in enumerate(COMPLIANCES):
        answer = halves.priced(Prices(one, 2.0 * halves.bounds.beta, compliance * one))
        if answer.word == "solved":
            yield answer.f
        if k == 0:
            yield from starts


class Walk:
    """Descents from start to start, and the best pair that they met; reproducible.

    Parameters
    ----------
    halves : Halves
        The programmes of a system.
    seed : int
        Of the restarts.
    limit : float
        Programmes after which a descent ends.
    """

    def __init__(self, halves: Halves, seed: int = 0, limit: float = np.inf) -> None:
        self.halves, self.random, self.rounds, self.limit = halves, np.random.default_rng(seed), 0, limit
        self.best = nothing(halves.system, halves.bounds)
        self.kept: Pair = (np.inf, self.best.f, self.best.dq)
        self.idle = 0  # restarts since the last progress

    @property
    def over(self) -> bool:
        """Whether the programmes or the time are spent."""
        return self.halves.solves >= self.limit or time.perf_counter() > self.halves.deadline

    def restart(self) -> None:
        """One descent from a random start, or from the pair kept last, disturbed."""
        fresh = self.random.random() < 0.5 or not np.isfinite(self.kept[0])
        pair = self.descend(self._random() if fresh else self._disturbed())
        self.idle = 0 if pair[0] < 0.999 * self.kept[0] else self.idle + 1
        if pair[0] < LEVEL * self.kept[0] or self.random.random() < UPHILL:
            self.kept = pair
        if self.idle > PATIENCE:
            self.kept, self.idle = (np.inf, *self.kept[1:]), 0

    def descend(self, f: Floats) -> Pair:
        """Fit motion and forces to each other from (q, 3) forces; the best pair met."""
        pair: Pair = (np.inf, f, self.kept[2])
        system, bounds, polished = self.halves.system, self.halves.bounds, NEAR
        for near, dq in islice(self.halves.fitted(f), ROUNDS):
            self.rounds += 1
            value, last = total_merit(system, bounds, near, dq), pair[0]
            if value < last:
                pair = (value, near, dq)
            if value < polished:
                polished = 0.5 * value  # no second polish before this much is gained
                self.polish(near, dq)
            if self.best.found or not (value < PROGRESS * last) or self.over:
                break
        if np.isfinite(pair[0]):
            self.best = better(self.best, attempt(system, bounds, *pair[1:]))
        return pair

    def polish(self, f: Floats, dq: Floats) -> None:
        """Polish (q, 3) forces and a (6 m,) motion that almost are a state."""
        near, moved, _ = polish(self.halves.system, self.halves.bounds, f, dq)
        self.best = better(self.best, attempt(self.halves.system, self.halves.bounds, near, moved))

    def _random(self) -> Floats:
        q = self.halves.system.points
        f = self.random.normal(size=(q, 3)) * self.random.integers(0, 2, size=(q, 1))
        f[:, 0] = np.abs(f[:, 0])
        return f

    def _disturbed(self) -> Floats:
        random, (_, f, dq) = self.random, self.kept
        kind = random.integers(3)
        if kind == 0:
            f = f * np.exp(random.choice([0.3, 1.0, 3.0]) * random.normal(size=(len(f), 1)))
            f = f + random.choice([0.0, 0.02, 0.2]) * random.normal(size=f.shape)
        elif kind == 1:
            dq = dq * np.exp(0.5 * random.normal(size=dq.shape))
            dq = dq + random.choice([0.1, 0.5, 2.0]) * random.normal(size=dq.shape)
            f = self.halves.fitted_forces(self.halves.system.gap(dq))[1]
        else:
            f = f.copy()
            f[random.integers(len(f), size=2)] *= random.choice([0.0, 10.0, -1.0])
        f[:, 0] = np.abs(f[:, 0])
        return f
