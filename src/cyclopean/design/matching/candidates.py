"""Pairs of a stone and a cell, and how well each is known: ranked, refined, polished, exact.

All pairs have a value, the volume they are taken to have in common. One that is only ranked or refined carries a little
less than it was seen to have, and one that is polished is seen a little too well, since its pose was chosen by the same
points; so whoever wins a cell is looked at more closely before it is believed, and the assignment is made again.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.design.matching.coarse import Ranking
from cyclopean.design.matching.exact import (
    ALIKE,
    SAME,
    Solids,
    climbed,
    corner_fit,
    principal,
    registered,
    unlikeness,
)
from cyclopean.design.matching.problem import Problem
from cyclopean.design.matching.refine import Schedule, bonded, refine
from cyclopean.design.stones.stone import in_body_frame

__all__ = ["EXACT", "POLISHED", "RANKED", "REFINED", "Candidates"]

RANKED, REFINED, POLISHED, EXACT = range(4)  # how well a pair is known
DISCOUNT = (0.97, 0.97, 0.99, 1.0)  # what a pair is taken to have, of what it was seen to have

# a climb, with few points, says which pairs are worth a polish, which is longer and ends finer
CLIMB = Schedule(points=256, steps=20, width=(0.15, 0.06), step=(0.10, 0.01))
POLISH = Schedule(points=1024, steps=40, width=(0.08, 0.02), step=(0.05, 0.005), early=24)
EVEN = 1e-12  # of the volume: poses that differ by less are even, and the first one stands
EVENS = 1e-9  # of a mean stone; counted points are often even, as of stones that lie wholly in either of two cells
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0  # its multiples, without their whole parts, are spread evenly
STEPS = 6  # of a climb by exact volumes
OFF_BOND = 1e-5  # radians by which a bond counts as kept


class Candidates:
    """Working state of one match; poses are of body frames, about the cells' centres."""

    def __init__(self, problem: Problem, ranking: Ranking) -> None:
        stones, cells = problem.stones, problem.cells
        self.problem, self.ranking = problem, ranking
        self.stones, self.cells, self.volume = stones, cells, problem.volume
        self.value: Floats = np.minimum(DISCOUNT[RANKED] * ranking.shared.astype(np.float64), cells.volume)
        self.value += self._tie(np.arange(len(stones))[:, None], np.arange(len(cells)))
        self.level = np.zeros(ranking.shared.shape, np.uint8)
        self.seconds: dict[str, float] = {}
        self._held: tuple[Ints, Ints, float] | None = None
        self._row = np.full(ranking.shared.shape, -1, np.int32)
        self._rotation, self._shift = np.zeros((0, 3, 3)), np.zeros((0, 3))
        self._solids = Solids(stones, cells)
        self._principal, half = principal(cells)
        stone_half = np.stack([s.half for s in stones])
        self._alike, self._same = (np.zeros(self.level.shape, bool) for _ in range(2))
        for j in range(len(cells)):  # one by one: a table of numbers would be the largest thing in memory
            unlike = unlikeness(stone_half, half[j])
            self._alike[:, j], self._same[:, j] = unlike < ALIKE, unlike < SAME
        self.climbs = 0  # pairs that may still climb by exact volumes

    def twins(self, most: int) -> tuple[Ints, Ints]:
        """Pairs of one shape, at most so many a cell: the ones of the most similar volume."""
        stone, cell = [], []
        for j in range(len(self.cells)):
            same = np.flatnonzero(self._same[:, j])
            off = np.abs(np.log(self.volume[same] / self.cells.volume[j]))
            first = np.roll(np.flatnonzero(off <= off.min(initial=np.inf) + SAME), -j)  # alike cells take turns
            near = np.concatenate([first, np.setdiff1d(np.argsort(off, kind="stable"), first, True)])[:most]
            stone.append(same[near])
            cell.append(np.full(len(near), j))
        return np.concatenate(stone), np.concatenate(cell)

    def pose(self, i: int, j: int) -> tuple[Floats, Floats]:
        """Rotation and shift of stone i in cell j, as well as it is known."""
        row = int(self._row[i, j])
        if row >= 0:
            return self._rotation[row], self._shift[row]
        return self.ranking.rotation(i, j), np.zeros(3)

    def take(self, stone: Ints, cell: Ints, rotation: Floats, shift: Floats, shared: Floats | None = None) -> None:
        """Note poses (b, 3, 3), (b, 3) m from elsewhere, and (b,) m3 in common if measured in these very cells.

        Pairs that were not measured are polished from there.
        """
        self._put(stone, cell, rotation, shift)
        if shared is None:
            self.level[stone, cell] = np.maximum(self.level[stone, cell], REFINED)
        else:
            self.value[stone, cell], self.level[stone, cell] = shared, EXACT

    def hold_back(self, stone: Ints, cell: Ints, share: float) -> None:
        """Let pairs (b,), (b,) count for less, by a share of what they have in common, when stones are assigned."""
        self._held = (stone, cell, share) if share else None

    @property
    def worth(self) -> Floats:
        """(n, m) m3: what pairs count for when stones are assigned."""
        if self._held is None:
            return self.value
        stone, cell, share = self._held
        found = self.value.copy()
        found[stone, cell] *= 1.0 - share
        return found

    def improve(self, stone: Ints, cell: Ints, level: int, schedule: Schedule = POLISH) -> None:
        """Bring pairs (b,), (b,) to a level, those that are not there yet."""
        for step in range(REFINED, level + 1):
            todo = self.level[stone, cell] < step
            if not todo.any():
                continue
            began = perf_counter()
            if step == REFINED:
                self._refine(stone[todo], cell[todo])
            elif step == POLISHED:
                self._polish(stone[todo], cell[todo], schedule)
            else:
                self._measure(stone[todo], cell[todo])
            name = ("", "refine", "polish", "measure")[step]
            self.seconds[name] = self.seconds.get(name, 0.0) + perf_counter() - began

    def _refine(self, stone: Ints, cell: Ints) -> None:
        """Climb from the best rotations, and from the principal axes where stone and cell are of one shape."""
        pair, rotation = [], []
        for place in range(len(self.ranking.turns)):
            pair.append(np.arange(len(stone)))
            rotation.append(self.ranking.rotation(stone, cell, place))
        same = np.flatnonzero(self._alike[stone, cell])
        pair.append(np.repeat(same, 4))
        rotation.append(registered(self._principal[cell[same]]).reshape(-1, 3, 3))
        start, turned = np.concatenate(pair), np.concatenate(rotation)
        poses = turned, np.zeros((len(start), 3))
        share, turned, shift = refine(self.problem, (stone[start], cell[start]), poses, CLIMB)
        order = np.lexsort((np.arange(len(start)), -share, start))
        best = order[np.unique(start[order], return_index=True)[1]]
        self._put(stone, cell, turned[best], shift[best])
        self._judge(stone, cell, share[best], REFINED)

    def _polish(self, stone: Ints, cell: Ints, schedule: Schedule) -> None:
        row = self._row[stone, cell]
        poses = self._rotation[row], self._shift[row]
        share, rotation, shift = refine(self.problem, (stone, cell), poses, schedule)
        self._put(stone, cell, rotation, shift)
        self._judge(stone, cell, share, POLISHED)

    def _measure(self, stone: Ints, cell: Ints) -> None:
        """Exact volumes, at the best of the poses that are worth a look."""
        for number, (i, j) in enumerate(zip(stone.tolist(), cell.tolist(), strict=True)):
            self.problem.progress(f"measuring: {number + 1} of {len(stone)}")
            row, most = int(self._row[i, j]), min(self.volume[i], self.cells.volume[j])
            best, pose = 0.0, (self._rotation[row], self._shift[row])
            for rotation, shift in (*self._fits(i, j), pose):
                found = self._solids.shared(i, j, rotation, shift)
                if found > best * (1.0 + EVEN):
                    best, pose = found, (rotation, shift)
                if best >= most * (1.0 - EVEN):
                    break  # it holds all that it can
            if self.climbs > 0 and self.problem.bonds is None and not best >= most * (1.0 - EVEN):
                self.climbs -= 1
                found, *higher = climbed(self._solids, i, j, *pose, STEPS)
                if found > best:
                    best, pose = found, (higher[0], higher[1])
            self._put(np.array([i]), np.array([j]), pose[0][None], pose[1][None])
            self.value[i, j] = min(best, most)
            self.level[i, j] = EXACT

    def _fits(self, i: int, j: int) -> list[tuple[Floats, Floats]]:
        """Poses at which a stone of the cell's shape fits it; none where it is of another shape."""
        if not self._alike[i, j]:
            return []
        row = int(self._row[i, j])
        corners = self.cells.assembly.blocks[self.cells.block[j]].vertices - self.cells.centre[j]
        scale = float(np.cbrt(self.cells.volume[j] / self.volume[i]))
        found = [(rotation, np.zeros(3)) for rotation in registered(self._principal[j])]
        found.append(corner_fit(in_body_frame(self.stones[i]), corners, scale, self._rotation[row], self._shift[row]))
        return [pose for pose in found if self._keeps_bond(j, pose[0])]

    def _keeps_bond(self, j: int, rotation: Floats) -> bool:
        bonds = self.problem.bonds
        if bonds is None:
            return True
        loose = replace(bonds, way=bonds.way[j : j + 1], angle=bonds.angle + OFF_BOND)
        return bool(np.abs(bonded(rotation[None], loose) - rotation).max() < 1e-12)

    def _put(self, stone: Ints, cell: Ints, rotation: Floats, shift: Floats) -> None:
        """Keep poses; rotations that went through single precision are made rotations again."""
        u, _, vt = np.linalg.svd(rotation)
        rotation = u @ vt
        new = np.flatnonzero(self._row[stone, cell] < 0)
        self._row[stone[new], cell[new]] = len(self._rotation) + np.arange(len(new))
        self._rotation = np.concatenate([self._rotation, np.zeros((len(new), 3, 3))])
        self._shift = np.concatenate([self._shift, np.zeros((len(new), 3))])
        row = self._row[stone, cell]
        self._rotation[row], self._shift[row] = rotation, shift

    def _tie(self, stone: Ints, cell: Ints) -> Floats:
        """What decides between pairs that look even (m3): small beside all volumes, but not beside their rounding."""
        return np.asarray(EVENS * self.volume.mean() * np.modf((stone + 1.0) * (cell + 1.0) * GOLDEN)[0])

    def _judge(self, stone: Ints, cell: Ints, share: Floats, level: int) -> None:
        seen = np.minimum(share * self.volume[stone], self.cells.volume[cell])
        least = self.value[stone, cell] if level == REFINED else 0.0  # a climb never ends below where it began
        self.value[stone, cell] = np.maximum(DISCOUNT[level] * seen + self._tie(stone, cell), least)
        self.level[stone, cell] = level
