"""Ways of matching stones to cells to compare ours with; each answers pairs and poses, none of them refined.

The earlier method: for each cell the 6 stones that are most like it in volume and extents; principal axes on principal
axes in the 4 proper ways, centroid on centroid, the relative symmetric difference (|S - C| + |C - S|) / (|S| + |C|) as
cost, Hungarian assignment. Greedy and random ones use our 48 rotations.
Whatever a method estimated by, its answer is measured by exact solids.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from cyclopean.design.matching.cells import Cells
from cyclopean.design.matching.coarse import Ranking, rotations
from cyclopean.design.matching.exact import Solids, principal, registered
from cyclopean.design.stones.stone import Stone, in_body_frame

TOP = 6  # stones a cell that the earlier method looked at


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
    """As it was by default: only the 6 stones of the most similar volume and extents are looked at in a cell."""
    return _symmetric(yard, TOP)


def earlier_of_all(yard: Yard) -> Placed:
    """The same, but all stones are looked at in every cell."""
    return _symmetric(yard, len(yard.stones))


def _symmetric(yard: Yard, top: int) -> Placed:
    """PCA, 4 flips, relative symmetric difference for the first `top` stones of a cell, 1 + dissimilarity for others.

    Its volumes in common, from a grid of 12^3 points, are ours from evenly spread points: better than they were.
    """
    axes, _ = principal(yard.cells)
    turn = registered(axes).astype(np.float32)  # (m, 4, 3, 3)
    unlike = _dissimilarity(yard, axes)
    cost = 1.0 + unlike
    flip = np.zeros(cost.shape, np.int64)
    for j in range(len(yard.cells)):
        first = np.argsort(unlike[:, j], kind="stable")[:top]
        flat, share = yard.points[first].reshape(-1, 3), np.zeros((4, len(first)))
        for k in range(4):
            inside = np.zeros(len(flat), bool)
            for normal, offset in zip(yard.cells.normal[j], yard.cells.offset[j], strict=True):
                plane = normal.astype(np.float32) @ turn[j, k]  # in the body frame
                inside |= (flat @ plane.T <= offset.astype(np.float32)).all(axis=1)
            share[k] = inside.reshape(len(first), -1).mean(axis=1)
        flip[first, j] = share.argmax(axis=0)
        volume = yard.volume[first]
        cost[first, j] = 1.0 - 2.0 * share.max(axis=0) * volume / (volume + yard.cells.volume[j])
    stone, cell = linear_sum_assignment(cost)
    stone, cell = stone[np.argsort(cell)], np.arange(len(yard.cells))
    return Placed(stone, turn[cell, flip[stone, cell]].astype(float))


def _dissimilarity(yard: Yard, axes: np.ndarray) -> np.ndarray:
    """(n, m) half the relative difference of volumes, half the mean relative difference of extents along the axes."""
    stone = np.array([np.ptp(in_body_frame(s), axis=0) for s in yard.stones])
    blocks = [yard.cells.assembly.blocks[b].vertices for b in yard.cells.block]
    cell = np.array([np.ptp(v @ a.T, axis=0) for v, a in zip(blocks, axes, strict=True)])

    def relative(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.abs(a - b) / np.maximum(a, b)

    volumes = relative(yard.volume[:, None], yard.cells.volume[None])
    return volumes / 2.0 + relative(stone[:, None], cell[None]).mean(axis=2) / 2.0


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
    "earlier, 6 a cell": earlier,
    "earlier, all pairs": earlier_of_all,
    "greedy volume": greedy_by_volume,
    "greedy cost": greedy_by_cost,
    "random": at_random,
}
