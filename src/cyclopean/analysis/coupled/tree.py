"""Refute every coupled state of a small model by branch and bound, or meet one on the way; the closed tree is a proof.

A node is a cell of states (`leaves`), closed by what is cheapest: vectors that closed other cells; then the cell's own
two convex programmes, of which only those are solved that the last split has touched. Otherwise the point where the
work of their forces on their motion is furthest from a state's decides what to split: pressing or not, the sector of
its sliding (a ray lies between the sliding and the way that friction points, so that one of both goes), or, in a sector
that is narrow already, the speed.

Cells that a symmetry of the model maps to each other are closed once. Now and then the walk of `alternation` restarts:
where a state exists, that is how it is usually met.
"""

import time
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from cyclopean.analysis.coupled.alternation import NEAR, Walk
from cyclopean.analysis.coupled.branches import Node, Split, Symmetry, leaf_count, symmetries, tree_document
from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.leaves import OPEN, UNLOADED, Cell, Leaf, Prior, closes, least_work, most_work, prior
from cyclopean.analysis.coupled.polish import Attempt
from cyclopean.analysis.coupled.states import Bounds, merit
from cyclopean.arrays import Floats
from cyclopean.statics import EquilibriumSystem

__all__ = ["Node", "Search", "StoppedError", "TreeAnswer", "refute", "tree_document"]

POOL = 400  # vectors of each kind that are remembered
WORTH = 1e-9  # merit of a point that calls for a split
NARROW, THIN = np.pi / 8, 1e-3  # radians: sectors in which speed is split first, and that are not split any further
FARKAS = 1e9  # multiples of y from which the balance is called impossible
INSIDE = 1.0 - 1e-12  # share of its limit that a multiple of y may take
RESTART = 20  # nodes between restarts of the walk
FEW = 40  # points up to which symmetries are looked for
DENSE = 40_000  # points times blocks beyond which dense matrices are not set up

Word = Literal["refuted", "coupled", "undecided"]


@dataclass(frozen=True, slots=True, eq=False)
class TreeAnswer:
    """What the search found, in scaled units."""

    word: Word
    root: Node | None  # the closed tree
    best: Attempt  # the state, or the best pair met
    bound: float  # share of the tree that is closed, the parts of each split counting alike
    nodes: int
    solves: int
    narrow: bool = False  # whether it ended at a cell that floating point can neither close nor split

    @property
    def leaves(self) -> int:
        """How many leaves the closed tree has."""
        return 0 if self.root is None else leaf_count(self.root)


def refute(
    system: EquilibriumSystem,
    bounds: Bounds,
    nodes: int = 2000,
    deadline: float = np.inf,
    known: Prior | None = None,
) -> TreeAnswer:
    """Search all coupled states: none exists (a closed tree), here is one, or the budget is spent.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled; cost grows exponentially with its points: up to about 20 is reasonable.
    bounds : Bounds
        Of the displacement; only eta / eps and beta_min / eps matter.
    nodes : int
        Budget of each of two trees: one that first splits sliding in thirds from between the directions of sliding and
        friction, and one in quadrants along the contact's axes. Neither is smaller than the other for all models.
    deadline : float
        Of `time.perf_counter`: stops the search wherever it is.
    known : Prior, optional
        Bounds of all motions, where points have been left out that say more of them.
    """
    bounds = bounds.unit()
    search = Search(Halves(system, bounds, deadline), prior(system, bounds) if known is None else known)
    root: Node | None = None
    if search.pool.known.finite and 0 < system.points * system.blocks <= DENSE:
        for along in (False, True):
            if root is None and not search.walk.best.found:
                root = search.run(nodes, along)
    return search.answer(root)


class StoppedError(Exception):
    """A budget ran out, or a state was found."""


class _Shelf:
    """The last vectors of one kind."""

    def __init__(self, *shape: int) -> None:
        self.rows, self.count = np.zeros((POOL, *shape)), 0

    def add(self, row: Floats) -> None:
        self.rows[self.count % POOL] = row
        self.count += 1

    @property
    def held(self) -> Floats:
        """(b, ...) all of them."""
        return self.rows[: min(self.count, POOL)]


class _Pool:
    """Vectors that programmes have given so far: leaves of cells not yet met."""

    def __init__(self, system: EquilibriumSystem, bounds: Bounds, known: Prior) -> None:
        self.system, self.bounds, self.known = system, bounds, known
        self.y, self.gap = _Shelf(len(system.p)), _Shelf(system.points, 3)  # p.y = 1, and dd^y
        self.w, self.idle = _Shelf(system.points, 3), _Shelf(system.points, 3)  # A w = p; A w = 0

    def add(self, y: Floats | None, w: Floats | None, idle: bool = False) -> None:
        """Remember a multiplier of either side, or a proof that a cell has no motion."""
        if y is not None:
            self.y.add(y)
            self.gap.add(self.system.gap(y))
        if w is not None and idle:
            self.idle.add(w / float(np.max(np.abs(w))))
        elif w is not None:
            self.w.add(w)

    def leaf(self, cell: Cell) -> Leaf | None:
        """A leaf of the cell."""
        if self.idle.count:
            j = int(np.argmin(most_work(self.bounds, cell, self.idle.held)))
            if self._proves(cell, leaf := Leaf(None, self.idle.rows[j].copy())):
                return leaf
        if not self.gap.count:
            return None
        least = least_work(self.system, self.bounds, cell, self.gap.held)
        i = int(np.argmax(least))
        y, multiple = self.y.rows[i].copy(), min(float(least[i]), FARKAS)
        if multiple == FARKAS and self._proves(cell, leaf := Leaf(y, None)):
            return leaf
        if self.w.count:
            most = most_work(self.bounds, cell, self.w.held)
            j = int(np.argmin(most))
            if multiple > most[j] and self._proves(cell, leaf := Leaf(y * multiple * INSIDE, self.w.rows[j].copy())):
                return leaf
        return None

    def _proves(self, cell: Cell, leaf: Leaf) -> bool:
        return closes(self.system, self.bounds, cell, self.known, leaf)


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """A cell to be closed, and what the programmes say of it; at first, what they said of the cell around it."""

    cell: Cell
    f: Floats  # (q, 3) least forces
    dq: Floats  # (6 m,) most motion
    share: float = 1.0  # of the whole tree


class Search:
    """What a search of trees knows: the programmes, vectors that closed cells, the best pair met."""

    def __init__(self, halves: Halves, known: Prior) -> None:
        self.halves, self.system, self.bounds = halves, halves.system, halves.bounds
        self.nodes, self.most, self.closed, self.narrow, self.along = 0, 0, 0.0, False, False
        self.pool, self.walk = _Pool(self.system, self.bounds, known), Walk(halves)
        self.symmetries = list(symmetries(self.system)) if self.system.points <= FEW else []

    def answer(self, root: Node | None) -> TreeAnswer:
        """What has come of it, with a closed tree or without."""
        best = self.walk.best
        word: Word = "refuted" if root is not None else "coupled" if best.found else "undecided"
        bound = 1.0 if root is not None else self.closed
        return TreeAnswer(word, root, best, bound, self.nodes, self.halves.solves, self.narrow)

    def run(self, nodes: int, along: bool) -> Node | None:
        """The closed tree, or None; what other trees taught is used."""
        self.most, self.along, self.closed, self.narrow = self.nodes + nodes, along, 0.0, False
        try:
            return self._close(_Task(self.halves.root, self.walk.best.f, self.walk.best.dq))
        except (StoppedError, RecursionError):
            return None

    def _close(self, task: _Task, force: bool = True, motion: bool = True) -> Node:
        """Close a cell, or raise. A side that is False, forces or motions, is as in the cell around it."""
        if (self.nodes + 1) % RESTART == 0:
            self.walk.restart()
        if self.walk.best.found or self.nodes >= self.most or time.perf_counter() > self.halves.deadline:
            raise StoppedError
        self.nodes += 1
        leaf, cell, f, dq = self.pool.leaf(task.cell), task.cell, task.f, task.dq
        if leaf is None:
            if force:
                _, f, y = self.halves.forces(cell)
                self.pool.add(y, None)
            if motion:
                word, dq, w = self.halves.motions(cell)
                self.pool.add(None, w, idle=word == "infeasible")
            leaf = self.pool.leaf(cell)
        if leaf is not None:
            self.closed += task.share
            return leaf
        return self._split(_Task(cell, f, dq, task.share))

    # -- splitting ----------------------------------------------------------------------------------------------------

    def _split(self, task: _Task) -> Node:
        """Split where the work of the forces on the motion is furthest from a state's."""
        cell = task.cell
        normal, tangential = merit(self.system, self.bounds, task.f, task.dq)
        if float(normal.sum() + tangential.sum()) < NEAR:
            self.walk.polish(task.f, task.dq)
            if self.walk.best.found:
                raise StoppedError
        normal = np.where(cell.status == OPEN, normal, -1.0)
        width = np.where(cell.sector, _angles(cell.ray_a, cell.ray_b), 2.0 * np.pi)
        width = np.where(cell.status == UNLOADED, 0.0, width)
        tangential = np.where(width > THIN, tangential, -1.0)
        i, j = int(np.argmax(normal)), int(np.argmax(tangential))
        if max(normal[i], tangential[j]) <= WORTH:  # it says nothing, be it that no pair was found
            i, j = int(np.argmax(cell.status == OPEN)), int(np.argmax(width))
            if cell.status[i] == OPEN:
                return self._split_load(task, i)
            if not (width[j] > THIN):  # all but a point, and neither a state nor empty: rounding decides here
                self.narrow = True
                raise StoppedError
        elif normal[i] >= 0.1 * tangential[j]:
            return self._split_load(task, i)
        slide = self.system.gap(task.dq)[j, 1:]
        speed = max(self.bounds.beta, 0.5 * float(np.hypot(*slide)))
        if width[j] <= NARROW and cell.lo[j] == 0.0 and speed < 0.9 * cell.hi[j]:
            parts = self._closed_parts(task, [cell.at(j, hi=speed), cell.at(j, lo=speed)])
            return Split(j, parts, speed=speed)
        rays = _rays(cell, j, None if self.along else (slide, -task.f[j, 1:]))
        edges = [cell.ray_a[j], *rays, cell.ray_b[j]] if cell.sector[j] else [*rays, rays[0]]
        return Split(j, self._closed_parts(task, [cell.within(j, a, b) for a, b in pairwise(edges)]), rays=rays)

    def _split_load(self, task: _Task, k: int) -> Node:
        """Close the engaged part, hand it to all points that a symmetry of the cell moves k to, then close the rest."""
        cell, images = task.cell, dict[int, Symmetry]()
        for symmetry in self.symmetries:
            image = int(symmetry.point[k])
            if image != k and image not in images and symmetry.keeps(cell):
                images[image] = symmetry
        share = task.share / (2 + len(images))
        one = self._close(_Task(cell.engaged(k), task.f, task.dq, share), force=False)
        self.closed += share * len(images)
        rest = cell.unloaded(k)
        for image in images:
            rest = rest.unloaded(image)
        two = self._close(_Task(rest, task.f, task.dq, share), motion=False)
        for image in reversed(images):
            two = Split(image, (images[image].image(one), two))
        return Split(k, (one, two))

    def _closed_parts(self, task: _Task, cells: list[Cell]) -> tuple[Node, ...]:
        return tuple(self._close(_Task(cell, task.f, task.dq, task.share / len(cells))) for cell in cells)


def _rays(cell: Cell, k: int, ways: tuple[Floats, Floats] | None) -> Floats:
    """(r, 2) where to split point k's sliding: in halves; at first in thirds from between two ways, or quadrants."""
    if cell.sector[k]:
        middle = cell.ray_a[k] + cell.ray_b[k]
        return np.asarray(middle / np.linalg.norm(middle))[None]
    if ways is None:
        return np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    one, two = (np.arctan2(way[1], way[0]) for way in ways)
    apart = (two - one + np.pi) % (2.0 * np.pi) - np.pi
    turn = one + 0.5 * apart + 2.0 * np.pi / 3.0 * np.arange(3)
    return np.column_stack([np.cos(turn), np.sin(turn)])


def _angles(a: Floats, b: Floats) -> Floats:
    """(q,) angle from ray a to ray b."""
    return np.asarray(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], np.sum(a * b, axis=1)))
