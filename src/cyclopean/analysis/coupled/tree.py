"""Refute every coupled state of a small model by branch and bound, or meet one on the way; the closed tree is a proof.

A node is a cell of states (`leaves`), closed by what is cheapest: vectors that closed other cells; a point of which one
side is closed that way; then the cell's own two convex programmes, of which only those are solved that the last split
has touched. Otherwise forces and motion are fitted to each other for a few rounds. A pair that almost is a state goes
to the polish; else the point whose work is furthest from a state's decides what to split: pressing or not, the sector
of its sliding (sectors between the axes of the contact serve best: more other cells have the same), or, in a sector
that is narrow already, the speed.

A split of which one part is closed by a tree that closes the whole disappears. Cells that a symmetry of the model maps
to each other are closed once. Now and then a hop (`hopping`) looks for a state: where one exists, that is how it is
usually met.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from cyclopean.analysis.coupled.branches import (
    EngagementSplit,
    Node,
    SectorSplit,
    SpeedSplit,
    Symmetry,
    leaf_count,
    symmetries,
    tree_document,
)
from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.hopping import DENSE, Hopping, fit
from cyclopean.analysis.coupled.leaves import (
    ENGAGED,
    OPEN,
    UNLOADED,
    Cell,
    Leaf,
    Prior,
    closes,
    least_work,
    most_work,
    prior,
    work_limits,
    work_parts,
)
from cyclopean.analysis.coupled.states import Bounds, Residuals, merit
from cyclopean.arrays import Bools, Floats
from cyclopean.statics import EquilibriumSystem

__all__ = ["Node", "TreeAnswer", "refute", "tree_document"]

ROUNDS = 3  # of fitting forces and motion to each other in a node
POOL = 400  # vectors of each kind that are remembered
WORTH = 1e-9  # merit of a point that calls for a split
NARROW, THIN = np.pi / 8, 1e-3  # radians: sectors in which speed is split first, and that are not split any further
FARKAS = 1e9  # multiples of y from which the balance is called impossible
INSIDE = 1.0 - 1e-12  # share of its limit that a multiple of y may take
HOPS = 10  # nodes between hops (one, where there are too many points to branch on)
FEW = 40  # points


@dataclass(frozen=True, slots=True, eq=False)
class TreeAnswer:
    """What the search found, in scaled units."""

    word: Literal["refuted", "coupled", "undecided"]
    root: Node | None  # the closed tree
    f: Floats  # (q, 3) the state, or the best pair met
    dq: Floats  # (6 m,)
    residuals: Residuals | None  # of a state
    merit: float  # least met
    bound: float  # share of the tree that is closed, the parts of each split counting alike
    nodes: int
    leaves: int
    solves: int
    seconds: float


def refute(
    system: EquilibriumSystem,
    bounds: Bounds,
    seconds: float = 20.0,
    nodes: int = 2000,
) -> TreeAnswer:
    """Search all coupled states: none exists (a closed tree), here is one, or the budget is spent.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled; cost grows exponentially with its points: up to about 20 is reasonable.
    bounds : Bounds
        Of the displacement; only eta / eps and beta_min / eps matter.
    seconds, nodes : float, int
        Budgets.
    """
    began = time.perf_counter()
    bounds = bounds.unit()
    known = prior(system, bounds)
    if not known.finite or not 0 < system.points * system.blocks <= DENSE:
        nothing = np.zeros((system.points, 3)), np.zeros(len(system.p))
        return TreeAnswer("undecided", None, *nothing, None, np.inf, 0.0, 0, 0, 0, time.perf_counter() - began)
    search = _Search(Halves(system, bounds), known, began + seconds, nodes)
    root = search.run()
    value, f, dq = search.hopping.best
    return TreeAnswer(
        word="refuted" if root is not None else "coupled" if search.residuals is not None else "undecided",
        root=root,
        f=f,
        dq=dq,
        residuals=search.residuals,
        merit=value,
        bound=1.0 if root is not None else search.closed,
        nodes=search.nodes,
        leaves=0 if root is None else leaf_count(root),
        solves=search.halves.solves,
        seconds=time.perf_counter() - began,
    )


class _StoppedError(Exception):
    """A budget ran out, or a state was found."""


class _Shelf:
    """The last vectors of one kind, (q, 3) each."""

    def __init__(self, points: int) -> None:
        self.rows = np.zeros((POOL, points, 3))
        self.count = 0

    def add(self, row: Floats) -> int:
        at = self.count % POOL
        self.rows[at] = row
        self.count += 1
        return at

    @property
    def held(self) -> Floats:
        """(b, q, 3) all of them."""
        return self.rows[: min(self.count, POOL)]


class _Pool:
    """Vectors that programmes have given so far: leaves of cells not yet met."""

    def __init__(self, system: EquilibriumSystem, bounds: Bounds) -> None:
        self.system, self.bounds = system, bounds
        self.gap, self.w, self.idle = (_Shelf(system.points) for _ in range(3))  # A w = p; A w = 0
        self.y: dict[int, Floats] = {}  # (6 m,) with p.y = 1, by place on the shelf of their gaps

    def add(self, y: Floats | None, w: Floats | None, idle: bool = False) -> None:
        """Remember a multiplier of either side, or a proof that a cell has no motion."""
        if y is not None:
            self.y[self.gap.add(self.system.gap(y))] = y
        if w is not None and idle:
            self.idle.add(w / float(np.max(np.abs(w))))
        elif w is not None:
            self.w.add(w)

    def leaf(self, cell: Cell, proves: Callable[[Cell, Leaf], bool]) -> Leaf | None:
        """A leaf of the cell."""
        if self.idle.count:
            work = most_work(self.bounds, cell, self.idle.held)
            if proves(cell, leaf := Leaf(None, self.idle.rows[int(np.argmin(work))].copy())):
                return leaf
        if not self.gap.count:
            return None
        least = least_work(self.system, self.bounds, cell, self.gap.held)
        i = int(np.argmax(least))
        if least[i] >= FARKAS and proves(cell, leaf := Leaf(self.y[i], None)):
            return leaf
        if self.w.count:
            most = most_work(self.bounds, cell, self.w.held)
            j = int(np.argmin(most))
            if least[i] > most[j] and proves(cell, leaf := _pair(self.y[i], least[i], self.w.rows[j].copy())):
                return leaf
        return None

    def settled(self, cell: Cell) -> tuple[Bools, Bools]:
        """(q,) each: open points whose engaged, and whose unloaded side probably closes."""
        nowhere = np.zeros(len(cell.status), bool)
        mark = cell.status == OPEN
        if not mark.any() or not self.gap.count or not self.w.count:
            return nowhere, nowhere
        limits = work_limits(self.system, self.bounds, cell, self.gap.held)
        order = np.argsort(limits, axis=1)[:, :2]
        first, second = (limits[np.arange(len(limits)), at] for at in order.T)
        without = np.where(order[:, :1] == np.arange(len(mark)), second[:, None], first[:, None]).max(axis=0)
        most, pressed = self._pressed(cell, self.w.held)
        idle = self._pressed(cell, self.idle.held)[1]
        engaged = (pressed.min(axis=0) < first.max()) | (idle.min(axis=0, initial=np.inf) < 0.0)
        return mark & engaged, mark & ((without >= FARKAS) | (without > most.min()))

    def _pressed(self, cell: Cell, w: Floats) -> tuple[Floats, Floats]:
        """(b,) most work of (b, q, 3) vectors, and (b, q) the same with one more point engaged."""
        normal, tangential = work_parts(self.bounds, cell, w)
        most = np.sum(normal + tangential, axis=1)
        return most, most[:, None] - normal - w[..., 0]


def _pair(y: Floats, multiple: float, w: Floats) -> Leaf:
    return Leaf(y * (min(float(multiple), FARKAS) * INSIDE), w)


@dataclass(frozen=True, slots=True, eq=False)
class _Sight:
    """What the two programmes of a cell say, and which of them a split has made stale."""

    f: Floats  # (q, 3) least forces
    dq: Floats  # (6 m,) most motion
    y: Floats | None = None  # (6 m,) multiplier with p.y = 1
    w: Floats | None = None  # (q, 3) multiplier with A w = p


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """A cell to be closed."""

    cell: Cell
    sight: _Sight  # its parent's
    share: float  # of the whole tree
    force: bool = True  # whether the force side differs from the parent's
    motion: bool = True

    def part(self, cell: Cell, count: int, force: bool = True, motion: bool = True) -> "_Task":
        """One of `count` parts of it."""
        return _Task(cell, self.sight, self.share / count, force, motion)


class _Search:
    def __init__(self, halves: Halves, known: Prior, until: float, nodes: int) -> None:
        self.halves, self.known, self.until, self.most = halves, known, until, nodes
        self.system, self.bounds = halves.system, halves.bounds
        self.nodes, self.closed = 0, 0.0
        self.residuals: Residuals | None = None
        self.pool = _Pool(self.system, self.bounds)
        self.hopping = Hopping(halves)
        self.symmetries = list(symmetries(self.system)) if self.system.points <= FEW else []

    def run(self) -> Node | None:
        """The closed tree, or None."""
        sight = _Sight(np.zeros((self.system.points, 3)), np.zeros(len(self.system.p)))
        try:
            return self._close(_Task(self.halves.root, sight, 1.0))
        except (_StoppedError, RecursionError):
            return None

    # -- closing ------------------------------------------------------------------------------------------------------

    def _close(self, task: _Task) -> Node:
        """Close a cell, or raise."""
        if self.nodes >= self.most or time.perf_counter() > self.until:
            raise _StoppedError
        self.nodes += 1
        if self.nodes % (HOPS if self.system.points <= FEW else 1) == 0:
            self._noted(self.hopping.once())
        leaf = self.pool.leaf(task.cell, self._proves)
        if leaf is None and (node := self._propagated(task)) is not None:
            return node
        sight = task.sight
        if leaf is None:
            leaf, sight = self._solved(task)
        if leaf is not None:
            self.closed += task.share
            return leaf
        pair = fit(self.halves, task.cell, sight.f, sight.dq, ROUNDS, 0.8)
        self._noted(self.hopping.met(pair))
        return self._split(_Task(task.cell, sight, task.share), *pair[1:])

    def _proves(self, cell: Cell, leaf: Leaf) -> bool:
        return closes(self.system, self.bounds, cell, self.known, leaf)

    def _solved(self, task: _Task) -> tuple[Leaf | None, _Sight]:
        """A leaf from the cell's own programmes, or what they say."""
        cell, (f, dq, y, w) = task.cell, (task.sight.f, task.sight.dq, task.sight.y, task.sight.w)
        if task.force:
            word, f, y = self.halves.forces(cell)
            self.pool.add(y, None)
            if word == "infeasible" and y is not None and self._proves(cell, leaf := Leaf(y, None)):
                return leaf, task.sight
        if task.motion:
            word, dq, w = self.halves.motions(cell)
            if word == "infeasible" and w is not None:
                if self._proves(cell, leaf := Leaf(None, w)):
                    self.pool.add(None, w, idle=True)
                    return leaf, task.sight
                w = None
            self.pool.add(None, w)
        if y is not None and w is not None:
            least = float(least_work(self.system, self.bounds, cell, self.system.gap(y)))
            if least > most_work(self.bounds, cell, w) and self._proves(cell, leaf := _pair(y, least, w)):
                return leaf, task.sight
        return None, _Sight(f, dq, y, w)

    def _holds(self, cell: Cell, node: Node) -> bool:
        """Whether a tree closes a cell other than the one it was grown for."""
        if isinstance(node, Leaf):
            return self._proves(cell, node)
        k = node.point
        if isinstance(node, EngagementSplit):
            if cell.status[k] != OPEN:
                return self._holds(cell, node.engaged if cell.status[k] == ENGAGED else node.unloaded)
            return self._holds(cell.engaged(k), node.engaged) and self._holds(cell.unloaded(k), node.unloaded)
        if isinstance(node, SpeedSplit):
            if not (cell.lo[k] < node.speed < cell.hi[k]):
                return False
            slower, faster = cell.slower(k, node.speed), cell.faster(k, node.speed)
            return self._holds(slower, node.slower) and self._holds(faster, node.faster)
        parts = _sectors(cell, k, node.rays)
        return len(parts) == len(node.sectors) and all(map(self._holds, parts, node.sectors))

    def _noted(self, residuals: Residuals | None) -> None:
        if residuals is not None:
            self.residuals = residuals
            raise _StoppedError

    # -- splitting ----------------------------------------------------------------------------------------------------

    def _propagated(self, task: _Task) -> Node | None:
        """Where remembered vectors close one side of a point, go on with the other."""
        cell = task.cell
        engaged, unloaded = self.pool.settled(cell)
        for k in map(int, np.flatnonzero(engaged | unloaded)):
            one: Node | None = self.pool.leaf(cell.engaged(k), self._proves) if engaged[k] else None
            two: Node | None = self.pool.leaf(cell.unloaded(k), self._proves) if unloaded[k] else None
            if one is None and two is None:
                continue
            if one is None:
                one = self._close(_Task(cell.engaged(k), task.sight, task.share, task.force, True))
            elif two is None:
                two = self._close(_Task(cell.unloaded(k), task.sight, task.share, True, task.motion))
            else:
                self.closed += task.share
            assert two is not None
            return next((side for side in (one, two) if self._holds(cell, side)), EngagementSplit(k, one, two))
        return None

    def _split(self, task: _Task, f: Floats, dq: Floats) -> Node:
        """Split where the work of (f, dq) is furthest from a state's."""
        cell = task.cell
        normal, tangential = merit(self.system, self.bounds, f, dq)
        normal = np.where(cell.status == OPEN, normal, -1.0)
        width = np.where(cell.sector, _angles(cell.ray_a, cell.ray_b), 2.0 * np.pi)
        tangential = np.where((width > THIN) & (cell.status != UNLOADED), tangential, -1.0)
        i, j = int(np.argmax(normal)), int(np.argmax(tangential))
        if max(normal[i], tangential[j]) <= WORTH:
            return self._split_anything(task, width)
        if normal[i] >= 0.1 * tangential[j]:
            return self._split_load(task, i)
        speed = max(self.bounds.beta, 0.5 * float(np.hypot(*self.system.gap(dq)[j, 1:])))
        if width[j] <= NARROW and cell.lo[j] == 0.0 and speed < 0.9 * cell.hi[j]:
            return self._split_speed(task, j, speed)
        return self._split_sector(task, j)

    def _split_anything(self, task: _Task, width: Floats) -> Node:
        """Where the merit says nothing, be it that no pair was found: an open point, or the widest sector."""
        cell = task.cell
        if (cell.status == OPEN).any():
            return self._split_load(task, int(np.argmax(cell.status == OPEN)))
        j = int(np.argmax(np.where(cell.status == UNLOADED, 0.0, width)))
        if cell.status[j] == UNLOADED or not (width[j] > THIN):
            raise _StoppedError  # all but a point, and neither a state nor empty: rounding decides here
        return self._split_sector(task, j)

    def _split_load(self, task: _Task, k: int) -> Node:
        """Close the engaged part, hand it to all points that a symmetry of the cell moves k to, then close the rest."""
        cell, images = task.cell, dict[int, Symmetry]()
        for symmetry in self.symmetries:
            image = int(symmetry.point[k])
            if image != k and image not in images and symmetry.keeps(cell):
                images[image] = symmetry
        count = 2 + len(images)
        one = self._close(task.part(cell.engaged(k), count, force=False))
        if self._holds(cell, one):
            self.closed += task.share * (count - 1) / count
            return one
        self.closed += task.share * len(images) / count
        rest = cell.unloaded(k)
        for image in images:
            rest = rest.unloaded(image)
        two = self._close(task.part(rest, count, motion=False))
        if self._holds(cell, two):
            return two
        for image in reversed(images):
            two = EngagementSplit(image, images[image].image(one), two)
        return EngagementSplit(k, one, two)

    def _split_sector(self, task: _Task, k: int) -> Node:
        rays = _rays(task.cell, k)
        parts = self._closed_parts(task, _sectors(task.cell, k, rays))
        return parts[0] if len(parts) == 1 else SectorSplit(k, rays, tuple(parts))

    def _split_speed(self, task: _Task, k: int, speed: float) -> Node:
        parts = self._closed_parts(task, [task.cell.slower(k, speed), task.cell.faster(k, speed)])
        return parts[0] if len(parts) == 1 else SpeedSplit(k, speed, *parts)

    def _closed_parts(self, task: _Task, cells: list[Cell]) -> list[Node]:
        """A tree for each part, or a single one that closes the whole."""
        parts: list[Node] = []
        for cell in cells:
            parts.append(self._close(task.part(cell, len(cells))))
            if self._holds(task.cell, parts[-1]):
                self.closed += task.share * (len(cells) - len(parts)) / len(cells)
                return parts[-1:]
        return parts


def _rays(cell: Cell, k: int) -> Floats:
    """(r, 2) where to split the sliding of point k: along the axes of its contact, then in halves."""
    if not cell.sector[k]:
        return np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    middle = cell.ray_a[k] + cell.ray_b[k]
    return np.asarray(middle / np.linalg.norm(middle))[None]


def _sectors(cell: Cell, k: int, rays: Floats) -> list[Cell]:
    """The parts of a cell between rays at point k."""
    edges = [cell.ray_a[k], *rays, cell.ray_b[k]] if cell.sector[k] else [*rays, rays[0]]
    return [cell.within(k, a, b) for a, b in pairwise(edges)]


def _angles(a: Floats, b: Floats) -> Floats:
    """(q,) angle from ray a to ray b."""
    return np.asarray(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], np.sum(a * b, axis=1)))
