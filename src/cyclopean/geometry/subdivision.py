"""A part of the plane cut into cells that share their vertices: one index for a junction, identical floats for all.

Where three cells meet, one number stands in three rings. So an edge is the same edge seen from both sides, and areas
add up to the whole to rounding whatever is done to the vertices, as long as no cell turns inside out: the sum over the
cells of `integral x dy` cancels on every shared edge and leaves the boundary.

By hand: two unit squares side by side have 6 vertices, 7 edges, one of them shared, and no crossing.

>>> square = subdivide([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], [[0, 1, 4, 3], [1, 2, 5, 4]])
>>> square.areas().tolist(), len(square.edge), int((square.side >= 0).all(axis=1).sum()), len(square.crossings())
([1.0, 1.0], 7, 1, 0)
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.errors import InputError
from cyclopean.geometry.packed import following, offsets
from cyclopean.geometry.sides import rings

__all__ = ["Subdivision", "dissolved", "merged", "subdivide"]

STRAIGHT = 1e-12  # sine of the turn at a vertex below which it lies on the straight line between its neighbours


@dataclass(frozen=True, slots=True, eq=False)
class Subdivision:
    """Cells (n) with shared vertices (V); edges and their two sides follow from the rings."""

    vertex: Floats  # (V, 2) m
    start: Ints  # (n + 1,) offsets into index
    index: Ints  # (R,) vertex numbers of each ring, counter-clockwise
    site: Ints  # (n,) which seed a cell came from; -1 = none
    edge: Ints = field(init=False)  # (E, 2) vertex numbers, the lower first
    side: Ints = field(init=False)  # (E, 2) cells to the left and right of edge[0] -> edge[1]; -1 = outside

    def __post_init__(self) -> None:
        for name, dtype, *shape in (
            ("vertex", np.float64, None, 2),
            ("start", np.int64, None),
            ("index", np.int64, None),
            ("site", np.int64, None),
        ):
            object.__setattr__(self, name, sealed(name, getattr(self, name), *shape, dtype=dtype))
        if len(self.start) != len(self.site) + 1 or self.start[0] != 0 or self.start[-1] != len(self.index):
            raise InputError("start: expected one offset a cell and one more, from 0 to the length of index")
        if self.index.size and not (self.index.min() >= 0 and self.index.max() < len(self.vertex)):
            raise InputError("index: names a vertex that is not there")
        if (bad := np.flatnonzero(np.diff(self.start) < 3)).size:
            raise InputError(f"start: cell {bad[0]} has fewer than three corners")
        edge, side = _edges(self.index, self.following(), self.cell(), len(self.vertex))
        object.__setattr__(self, "edge", sealed("edge", edge, None, 2, dtype=np.int64))
        object.__setattr__(self, "side", sealed("side", side, None, 2, dtype=np.int64))

    def __len__(self) -> int:
        return len(self.site)

    def cell(self) -> Ints:
        """Cell of every ring entry, (R,)."""
        return np.repeat(np.arange(len(self.site)), np.diff(self.start))

    def following(self) -> Ints:
        """Vertex that follows every ring entry on its ring, (R,)."""
        return self.index[following(self.start)]

    def ring(self, cell: int) -> Floats:
        """Corners of one cell, counter-clockwise, (k, 2) m."""
        return self.vertex[self.index[self.start[cell] : self.start[cell + 1]]]

    def rings(self) -> list[list[int]]:
        """Vertex numbers of every ring, as lists."""
        flat = self.index.tolist()
        return [flat[a:b] for a, b in zip(self.start[:-1].tolist(), self.start[1:].tolist(), strict=True)]

    def areas(self) -> Floats:
        """Area of each cell (m2), (n,); negative where a ring runs clockwise."""
        return self._moments()[0]

    def centroids(self) -> Floats:
        """Centroid of each cell, (n, 2) m; the mean of the corners where the area vanishes."""
        return self._moments()[1]

    def perimeters(self) -> Floats:
        """Perimeter of each cell (m), (n,)."""
        along = self.vertex[self.following()] - self.vertex[self.index]
        return np.bincount(self.cell(), np.hypot(along[:, 0], along[:, 1]), minlength=len(self)).astype(np.float64)

    def inradii(self) -> Floats:
        """Inradius proxy 2 A / P of each cell (m), (n,): exact for a polygon with an inscribed circle."""
        around = self.perimeters()
        return np.divide(2.0 * self.areas(), around, out=np.zeros(len(self)), where=around > 0.0)

    def lengths(self) -> Floats:
        """Length of each edge (m), (E,)."""
        along = self.vertex[self.edge[:, 1]] - self.vertex[self.edge[:, 0]]
        return np.hypot(along[:, 0], along[:, 1])

    def crossings(self) -> Ints:
        """Vertices at which four or more cells meet."""
        return np.flatnonzero(np.bincount(self.index, minlength=len(self.vertex)) >= 4)

    def polygons(self) -> Any:
        """The cells as shapely polygons, (n,) array."""
        import shapely

        return shapely.polygons(shapely.linearrings(self.vertex[self.index], indices=self.cell()))

    def _moments(self) -> tuple[Floats, Floats]:
        """Areas and centroids, each about the cell's own first corner."""
        cell, n = self.cell(), len(self)
        origin = self.vertex[self.index[self.start[:-1]]]
        a, b = self.vertex[self.index] - origin[cell], self.vertex[self.following()] - origin[cell]
        twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        area = np.bincount(cell, twice, minlength=n) / 2.0
        first = np.stack([np.bincount(cell, twice * (a + b)[:, k], minlength=n) for k in (0, 1)], 1) / 6.0
        mean = np.stack([np.bincount(cell, a[:, k], minlength=n) for k in (0, 1)], 1) / np.diff(self.start)[:, None]
        thin = np.abs(area) <= 1e-14 * self.perimeters() ** 2
        centre = np.where(thin[:, None], mean, first / np.where(thin, 1.0, area)[:, None])
        return area, origin + centre


def subdivide(vertex: ArrayLike, rings: Sequence[Sequence[int]], site: ArrayLike | None = None) -> Subdivision:
    """Subdivision from rings of vertex numbers; vertices that no ring uses are dropped.

    Parameters
    ----------
    vertex : (V, 2) array_like
        m.
    rings : sequence of sequence of int
        Corners of each cell, counter-clockwise.
    site : (n,) array_like of int, optional
        Which seed each cell came from; the cell's own number by default.

    Returns
    -------
    Subdivision

    Raises
    ------
    InputError
        A ring with fewer than three corners, or one that names a vertex that is not there.
    """
    start = offsets([len(ring) for ring in rings])
    index = np.array([k for ring in rings for k in ring], dtype=np.int64)
    point = sealed("vertex", vertex, None, 2)
    if index.size and not (index.min() >= 0 and index.max() < len(point)):
        raise InputError("rings: a ring names a vertex that is not there")
    used, index = np.unique(index, return_inverse=True)
    return Subdivision(point[used], start, index, np.arange(len(rings)) if site is None else np.asarray(site))


def merged(subdivision: Subdivision, cell: int, into: int) -> list[int] | None:
    """Ring of two neighbours made one; None where the two do not join along a single chain of edges."""
    pair = [subdivision.index[subdivision.start[c] : subdivision.start[c + 1]].tolist() for c in (cell, into)]
    sides = [(a, b) for ring in pair for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
    both = set(sides)
    found = list(rings(np.array([(a, b) for a, b in sides if (b, a) not in both])))
    return found[0].tolist() if len(found) == 1 else None


def dissolved(subdivision: Subdivision) -> Subdivision:
    """The same cells without the vertices at which nothing happens: two edges, in one straight line."""
    point, edge = subdivision.vertex, subdivision.edge
    degree = np.bincount(edge.ravel(), minlength=len(point))
    beside = np.zeros((len(point), 2), np.int64)
    ends = np.concatenate([edge, edge[:, ::-1]])
    beside[ends[::-1, 0], 0] = ends[::-1, 1]  # the first neighbour; the last one follows
    beside[ends[:, 0], 1] = ends[:, 1]
    a, b = point[beside[:, 0]] - point, point[beside[:, 1]] - point
    turn = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    reach = np.hypot(a[:, 0], a[:, 1]) * np.hypot(b[:, 0], b[:, 1])
    idle = (degree == 2) & (turn <= STRAIGHT * reach) & ((a * b).sum(axis=1) < 0.0)
    if not idle.any():
        return subdivision
    rings = [[k for k in ring if not idle[k]] for ring in subdivision.rings()]
    return subdivide(point, rings, subdivision.site)


def _edges(index: Ints, following: Ints, cell: Ints, vertices: int) -> tuple[Ints, Ints]:
    """Undirected edges and the cells on their two sides."""
    low, high = np.minimum(index, following), np.maximum(index, following)
    key, number = np.unique(low * max(vertices, 1) + high, return_inverse=True)
    edge = np.stack([key // max(vertices, 1), key % max(vertices, 1)], axis=1)
    side = np.full((len(key), 2), -1, np.int64)
    side[number, np.where(index == low, 0, 1)] = cell
    return edge, side
