"""Ways of matching stones to cells to compare ours with; each answers pairs and poses, none of them refined.

The earlier method: principal axes on principal axes in the 4 proper ways, centroid on centroid, the relative symmetric
difference (|S - C| + |C - S|) / (|S| + |C|) as cost, Hungarian assignment. Greedy and random ones use our 48 rotations.
Whatever a method estimated by, its answer is measured by exact solids.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from cyclopean.design.matching.cells import Cells
from cyclopean.design.matching.coarse import Ranking, rotations
from cyclopean.design.matching.exact import Solids, principal, registered
from cyclopean.design.stones.stone import Stone


@dataclass(frozen=True)
class Placed:
    """Stone and rotation (body frame to wall, centroid on centroid) of each cell."""

    stone: np.ndarray  # (m,)
    rotation: np.ndarray  # (m, 3, 3)


@dataclass(frozen=True)
class Yard:
    """What all methods start from."""

    stones: Sequence[Stone]
    points: np.ndarray  # (n, p, 3) float32, body frame
    cells: Cells
    ranking: Ranking

    @property
    def volume(self) -> np.ndarray:
        return np.array([s.volume for s in self.stones])


def measured(yard: Yard, placed: Placed) -> tuple[float, float]:
    """Lambda and total gap, exact."""
    solids = Solids(yard.stones, yard.cells)
    shared = sum(
        solids.shared(int(i), j, turn, np.zeros(3))
        for j, (i, turn) in enumerate(zip(placed.stone, placed.rotation, strict=True))
    )
    return 1.0 - shared / float(yard.volume[placed.stone].sum()), 1.0 - shared / float(yard.cells.volume.sum())


def earlier(yard: Yard) -> Placed:
    """PCA, 4 flips, relative symmetric difference, Hungarian."""
    axes, _ = principal(yard.cells)
    turn = registered(axes).astype(np.float32)  # (m, 4, 3, 3)
    count = yard.points.shape[1]
    flat = yard.points.reshape(-1, 3)
    share = np.zeros((4, len(yard.stones), len(yard.cells)), np.float32)
    for j in range(len(yard.cells)):
        for flip in range(4):
            plane = yard.cells.normal[j].astype(np.float32) @ turn[j, flip]  # (p, k, 3) in the body frame
            inside = np.zeros(len(flat), bool)
            for normal, offset in zip(plane, yard.cells.offset[j].astype(np.float32), strict=True):
                inside |= (flat @ normal.T <= offset).all(axis=1)
            share[flip, :, j] = inside.reshape(-1, count).mean(axis=1)
    shared = share.max(axis=0) * yard.volume[:, None]
    difference = 1.0 - 2.0 * shared / (yard.volume[:, None] + yard.cells.volume)
    stone, cell = linear_sum_assignment(difference)
    stone = stone[np.argsort(cell)]
    cell = np.arange(len(yard.cells))
    return Placed(stone, turn[cell, share.argmax(axis=0)[stone, cell]].astype(float))


def _turned(yard: Yard, stone: np.ndarray) -> Placed:
    """Each stone in the best of our rotations."""
    cell = np.arange(len(yard.cells))
    turn = rotations()[yard.ranking.turns[0, stone, cell]]
    return Placed(stone, yard.cells.axes.transpose(0, 2, 1) @ turn)


def greedy_by_volume(yard: Yard) -> Placed:
    """Largest cell first; it takes the stone of the nearest volume."""
    free, taken = np.ones(len(yard.stones), bool), np.zeros(len(yard.cells), np.int64)
    for j in np.argsort(-yard.cells.volume, kind="stable"):
        off = np.where(free, np.abs(yard.volume - yard.cells.volume[j]), np.inf)
        taken[j] = off.argmin()
        free[taken[j]] = False
    return _turned(yard, taken)


def greedy_by_cost(yard: Yard) -> Placed:
    """The cheapest pair of all first, carved + void."""
    cost = yard.volume[:, None] + yard.cells.volume - 2.0 * yard.ranking.shared
    taken, free = np.full(len(yard.cells), -1), np.ones(len(yard.stones), bool)
    for pair in np.argsort(cost, axis=None, kind="stable"):
        i, j = divmod(int(pair), len(yard.cells))
        if free[i] and taken[j] < 0:
            taken[j], free[i] = i, False
    return _turned(yard, taken)


def at_random(yard: Yard) -> Placed:
    """Any stone in any cell, in the best of our rotations."""
    draw = np.random.Generator(np.random.PCG64(0))
    return _turned(yard, draw.permutation(len(yard.stones))[: len(yard.cells)])


METHODS: dict[str, Callable[[Yard], Placed]] = {
    "earlier": earlier,
    "greedy volume": greedy_by_volume,
    "greedy cost": greedy_by_cost,
    "random": at_random,
}
