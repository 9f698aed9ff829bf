"""In which order stones go up: who rests on whom, cycles of that, layers, and one order.

**Who rests on whom.** With n the normal of a joint from `a` into `b` and `up` against gravity, `b` rests on `a` where
n.up > `LEAN`, and `a` on `b` where n.up < -`LEAN`; steeper joints say nothing. LEAN = 0.1 is a joint 5.7 degrees off
the vertical: head joints stay out, the sloping joints of an arch count. The *support* of a pair is the sum of area
times n.up (m2, the area seen from above), kept apart for each direction, so that two stones that hook into each other
rest on each other and form a cycle.

**Cycles.** A set of stones each of which rests, through others, on all the rest (a strongly connected component) has no
order. The edge with the least support in it is broken, and again while a cycle is left; what was broken, and which
other edge would have done alone, is told.

**Layers.** Supports are layer 0; a free stone is one above the highest that it rests on (longest path), as in [Kim]_.

**Order.** By layer, then along the wall. Where that would trap a stone (see `blocking`) another one goes first: the
order is found by taking the finished structure apart, always the last stone in that list that carries nothing and can
be moved away.

References
----------
.. [Kim] Kim et al.: Finding the installation sequence of polygonal masonry through design and depth search of a
   directed acyclic graph. ASME IDETC/CIE 2024, DETC2024-142563.
"""

import heapq
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Contacts
from cyclopean.errors import InputError

__all__ = [
    "LEAN",
    "Cycle",
    "Edge",
    "SupportGraph",
    "along_and_across",
    "laid",
    "layers",
    "support_graph",
    "take_apart",
    "upwards",
]

LEAN = 0.1  # least share of a joint's normal along gravity from which one stone rests on the other
ALTERNATIVES = 200  # edges of a cycle up to which other ways to break it are looked for


@dataclass(frozen=True, slots=True)
class Edge:
    """One stone rests on another."""

    upper: int
    lower: int
    support: float  # m2, area of the joint seen along gravity


@dataclass(frozen=True, slots=True)
class Cycle:
    """Stones that rest on each other in a ring, and how the ring was broken."""

    blocks: tuple[int, ...]
    broken: tuple[Edge, ...]  # taken out of the graph, the least support first
    alternatives: tuple[tuple[Edge, tuple[int, ...]], ...]  # an edge that would do alone, and the order it gives


@dataclass(frozen=True, slots=True, eq=False)
class SupportGraph:
    """Who rests on whom, n blocks; edges between supports and of a support on anything are left out."""

    count: int
    edges: tuple[Edge, ...]  # sorted by upper, lower
    cycles: tuple[Cycle, ...]

    @property
    def kept(self) -> tuple[Edge, ...]:
        """Edges without the broken ones: a directed graph without cycles."""
        broken = {(e.upper, e.lower) for cycle in self.cycles for e in cycle.broken}
        return tuple(e for e in self.edges if (e.upper, e.lower) not in broken)

    @property
    def below(self) -> list[set[int]]:
        """What each block rests on, rings broken."""
        return _below(self.count, self.kept)


def upwards(gravity: Floats) -> Floats:
    """(3,) unit vector against gravity.

    Raises
    ------
    InputError
        There is no gravity, so there is no up.
    """
    size = float(np.linalg.norm(gravity))
    if not (size > 0.0):
        raise InputError("`gravity` 0,0,0: without gravity no stone rests on another; give a direction")
    return np.asarray(-gravity / size)


def along_and_across(centre: Floats, up: Floats) -> tuple[Floats, Floats]:
    """Two (3,) unit vectors across `up`: along the longer side of (n, 3) `centre`, and to the left of it.

    Along +x (or what is left of it across `up`) unless the blocks stretch clearly further in another direction.
    """
    start = np.eye(3)[int(np.argmin(np.abs(up) > 0.9))]  # x, unless gravity acts along it
    x = start - (start @ up) * up
    x = x / np.linalg.norm(x)
    y = np.cross(up, x)
    flat = (centre - centre.mean(axis=0)) @ np.stack([x, y], 1) if len(centre) else np.zeros((0, 2))
    value, vector = np.linalg.eigh(flat.T @ flat)
    if not (value[1] > 1.05 * value[0]):
        return x, y
    main = vector[:, 1] * (1.0 if vector[np.argmax(np.abs(vector[:, 1]) > 1e-9), 1] > 0.0 else -1.0)
    along = main[0] * x + main[1] * y
    return along, np.cross(up, along)


def support_graph(contacts: Contacts, fixed: Bools, up: Floats, lean: float = LEAN) -> SupportGraph:
    """Find who rests on whom, and break cycles.

    Parameters
    ----------
    contacts : Contacts
        Between n blocks.
    fixed : (n,) bool
        Supports: they rest on nothing.
    up : (3,) unit
        Against gravity.
    lean : float
        Least n.up that counts.

    Raises
    ------
    InputError
        `lean` is not between 0 and 1.
    """
    if not (0.0 <= lean < 1.0):
        raise InputError.of("bearing", lean, "expected a number from 0 up to, not including, 1")
    rise = contacts.frame[:, 0] @ up if len(contacts) else np.zeros(0)
    support = contacts.area * np.abs(rise)
    upper = np.where(rise > 0.0, contacts.b, contacts.a)
    lower = np.where(rise > 0.0, contacts.a, contacts.b)
    total: dict[tuple[int, int], float] = {}
    for k in np.flatnonzero((np.abs(rise) > lean) & ~fixed[upper]).tolist():
        pair = int(upper[k]), int(lower[k])
        total[pair] = total.get(pair, 0.0) + float(support[k])
    edges = tuple(Edge(a, b, area) for (a, b), area in sorted(total.items()))
    return SupportGraph(len(fixed), edges, tuple(_cycles(len(fixed), edges)))


def layers(graph: SupportGraph, fixed: Bools) -> Ints:
    """(n,) layer of every block: 0 for supports, else one more than the highest that it rests on, at least 1."""
    layer, below = np.where(fixed, 0, 1), graph.below
    for block in laid(range(graph.count), below):
        layer[block] = max([layer[block], *(layer[i] + 1 for i in below[block])])
    return layer


def take_apart(
    graph: SupportGraph,
    fixed: Bools,
    rank: Sequence[tuple[float, ...]],
    trapped: Callable[[int, Collection[int]], bool],
) -> list[int]:
    """Order the free blocks for building, by taking the finished structure apart.

    Parameters
    ----------
    graph : SupportGraph
        A block goes only when none that rests on it is left.
    fixed : (n,) bool
        Supports, which stay.
    rank : sequence of tuple
        Of each block: the highest that may go goes first, so the order follows the rank where nothing is in the way.
    trapped : callable
        Whether a block cannot be moved away while these others stand. A trapped one goes only when nothing else may.

    Returns
    -------
    list of int
        Free blocks, the first to be laid first.
    """
    below = graph.below
    load = np.bincount(np.array([edge.lower for edge in graph.kept], int), minlength=graph.count)
    standing = set(range(graph.count))
    down = [tuple(-r for r in one) for one in rank]
    ready = [(down[i], i) for i in np.flatnonzero(~fixed & (load == 0)).tolist()]
    heapq.heapify(ready)
    order: list[int] = []
    while ready:
        stuck = []
        while ready and trapped(ready[0][1], standing):
            stuck.append(heapq.heappop(ready))
        block = (heapq.heappop(ready) if ready else stuck.pop(0))[1]
        for item in stuck:
            heapq.heappush(ready, item)
        order.append(block)
        standing.discard(block)
        for lower in below[block]:
            load[lower] -= 1
            if load[lower] == 0 and not fixed[lower]:
                heapq.heappush(ready, (down[lower], lower))
    return order[::-1]


def _cycles(count: int, edges: Sequence[Edge]) -> list[Cycle]:
    """Every ring, broken at the least support until none is left."""
    found = []
    for blocks in _rings(count, edges):
        inside = set(blocks)
        ring = [e for e in edges if e.upper in inside and e.lower in inside]
        left, broken = list(ring), []
        while rings := _rings(count, left):
            knot = {b for group in rings for b in group}
            weakest = min(
                (e for e in left if e.upper in knot and e.lower in knot), key=lambda e: (e.support, e.upper, e.lower)
            )
            left.remove(weakest)
            broken.append(weakest)
        found.append(Cycle(tuple(sorted(blocks)), tuple(broken), tuple(_alternatives(ring, broken))))
    return found


def _alternatives(ring: Sequence[Edge], broken: Sequence[Edge]) -> list[tuple[Edge, tuple[int, ...]]]:
    """Other edges that break all rings of a component alone, and the order of its blocks without them."""
    if len(ring) > ALTERNATIVES:
        return []
    blocks = sorted({e.upper for e in ring})
    place = {block: i for i, block in enumerate(blocks)}
    found = []
    for edge in ring:
        rest = [Edge(place[e.upper], place[e.lower], e.support) for e in ring if e is not edge]
        if (len(broken) > 1 or edge is not broken[0]) and not _rings(len(blocks), rest):
            found.append((edge, tuple(blocks[i] for i in laid(range(len(blocks)), _below(len(blocks), rest)))))
    return found


def _rings(count: int, edges: Sequence[Edge]) -> list[list[int]]:
    """Strongly connected components of more than one block."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    if not edges:
        return []
    ends = np.array([(e.upper, e.lower) for e in edges])
    matrix = sp.coo_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    number, label = connected_components(matrix, directed=True, connection="strong")
    size = np.bincount(label, minlength=number)
    return [np.flatnonzero(label == k).tolist() for k in np.flatnonzero(size > 1)]


def _below(count: int, edges: Sequence[Edge]) -> list[set[int]]:
    """What each block rests on."""
    below: list[set[int]] = [set() for _ in range(count)]
    for edge in edges:
        below[edge.upper].add(edge.lower)
    return below


def laid(given: Sequence[int], before: Sequence[Collection[int]], kept: Collection[int] = ()) -> list[int]:
    """All blocks, each after those before it, those kept in the given order; else as given as can be."""
    place = {block: k for k, block in enumerate(given)}
    waits = {block: set(before[block]) for block in given}
    for one, other in pairwise(block for block in given if block in kept):
        waits[other].add(one)
    then: dict[int, list[int]] = {}
    for block, others in waits.items():
        for other in others:
            then.setdefault(other, []).append(block)
    left = {block: len(others) for block, others in waits.items()}
    ready = [place[block] for block in given if not left[block]]
    heapq.heapify(ready)
    order = []
    while ready:
        block = given[heapq.heappop(ready)]
        order.append(block)
        for other in then.get(block, ()):
            left[other] -= 1
            if not left[other]:
                heapq.heappush(ready, place[other])
    return order
