"""Basin hopping: look for a coupled state by fitting forces and motion to each other from many starts.

The merit is convex in the forces for fixed motion and in the motion for fixed forces. Alternating between the two
halves goes down to a local minimum, of which there are many; the state, if there is one, is a minimum with value zero.
Half of the starts are random forces on a random half of the points. The others disturb the pair kept last: all forces
by random factors, or the motion, or two points altogether. A hop is kept if it does not lead up, and now and then
although it does; a walk that makes no progress for long begins anew.
"""

import time
from itertools import islice

import numpy as np

from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.leaves import Cell, prior
from cyclopean.analysis.coupled.polish import polish, total_merit
from cyclopean.analysis.coupled.states import Bounds, Residuals
from cyclopean.arrays import Floats
from cyclopean.statics import EquilibriumSystem

__all__ = ["DENSE", "Hopping", "Pair", "fit", "hop"]

NEAR = 1e-2  # merit from which a pair is worth polishing
ROUNDS, PROGRESS = 60, 0.997  # of one hop: at most so many rounds, each of which takes the merit down to this share
LEVEL, UPHILL = 1.02, 0.02  # how far up a hop may lead, and how often one is kept wherever it leads
HOPS = 20  # for each contact point: a shelf of 92 points was met after several hundred
PATIENCE = 40  # hops without progress after which the walk begins anew
DENSE = 40_000  # points times blocks beyond which dense programmes are not set up

Pair = tuple[float, Floats, Floats]  # merit, (q, 3) forces, (6 m,) motion


def hop(
    system: EquilibriumSystem,
    bounds: Bounds,
    seconds: float = 60.0,
    seed: int = 0,
    hops: int | None = None,
) -> tuple[Pair, Residuals | None]:
    """Hop until a state is found, the time is up or there were `hops` of them (not given: 20 a contact point).

    Returns
    -------
    pair : merit, forces, motion
        The state, or the best pair met.
    residuals : Residuals or None
        Of the state; None if there is none.
    """
    until, bounds = time.perf_counter() + seconds, bounds.unit()
    tied = prior(system, bounds).finite
    if not tied or not 0 < system.points * system.blocks <= DENSE:
        return (np.inf, np.zeros((system.points, 3)), np.zeros(len(system.p))), None
    hopping = Hopping(Halves(system, bounds), seed)
    for _ in range(HOPS * system.points if hops is None else hops):
        if time.perf_counter() > until:
            break
        if (residuals := hopping.once()) is not None:
            return hopping.best, residuals
    return hopping.best, None


def fit(halves: Halves, cell: Cell, f: Floats, dq: Floats, rounds: int, progress: float) -> Pair:
    """Fit motion and forces of a cell to each other, from (q, 3) forces; the best pair met."""
    best: Pair = (np.inf, f, dq)
    for near, moved in islice(halves.fitted(cell, f), rounds):
        value = total_merit(halves.system, halves.bounds, near, moved)
        stalled = not (value < progress * best[0])
        if value < best[0]:
            best = (value, near, moved)
        if stalled or value < 1e-7:
            break
    return best


class Hopping:
    """A walk from minimum to minimum; reproducible."""

    def __init__(self, halves: Halves, seed: int = 0) -> None:
        system = halves.system
        self.halves, self.random = halves, np.random.default_rng(seed)
        self.best: Pair = (np.inf, np.zeros((system.points, 3)), np.zeros(len(system.p)))
        self.kept, self.idle = self.best, 0  # idle: hops since the last progress

    def once(self) -> Residuals | None:
        """One hop; the residuals of a state (then `best`) if it ends in one."""
        f = self._fresh() if self.random.random() < 0.5 or not np.isfinite(self.kept[0]) else self._disturbed()
        pair = fit(self.halves, self.halves.root, f, self.kept[2], ROUNDS, PROGRESS)
        self.idle = 0 if pair[0] < 0.999 * self.kept[0] else self.idle + 1
        if pair[0] < LEVEL * self.kept[0] or self.random.random() < UPHILL:
            self.kept = pair
        if self.idle > PATIENCE:
            self.kept, self.idle = (np.inf, *self.kept[1:]), 0
        return self.met(pair)

    def met(self, pair: Pair) -> Residuals | None:
        """Take note of a pair, polish one that almost is a state; the residuals if that makes it one."""
        if pair[0] < self.best[0]:
            self.best = pair
        if pair[0] < NEAR:
            f, dq, residuals = polish(self.halves.system, self.halves.bounds, *pair[1:])
            if residuals.accepted:
                self.best = (pair[0], f, dq)
                return residuals
        return None

    def _fresh(self) -> Floats:
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
            f = self.halves.fitted_forces(self.halves.root, self.halves.system.gap(dq))[1]
        else:
            f = f.copy()
            f[random.integers(len(f), size=2)] *= random.choice([0.0, 10.0, -1.0])
        f[:, 0] = np.abs(f[:, 0])
        return f
