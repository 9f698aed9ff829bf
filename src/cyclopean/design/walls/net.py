"""A pattern whose corners are moved one by one: what meets at each, which way it may go, and what a move must leave.

Corners of the outline and of dressed stones (site -1) slide along a straight side or stay where they are. A change is
good if the cells that it touches stay simple, keep their inradius proxy or the least one, and cover together what they
covered before.

By hand: of two squares side by side the corners between them slide along the outline, the others stay.

>>> from cyclopean.geometry import subdivide
>>> two = subdivide([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], [[0, 1, 4, 3], [1, 2, 5, 4]])
>>> net = net_of(two, np.array([1.0, 1.0]), 0.1)
>>> [k for k, way in net.slide.items() if way], net.slide[1], net.thinness(0)
([1, 4], (1.0, 0.0), 0.5)
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.geometry import Subdivision

__all__ = ["SHORT", "Net", "Point", "net_of"]

SHORT = 0.02  # of the spacing of the stones: an edge below this is short
COVER = 1e-10  # of a spacing's area: what the cells that a change touches may gain or lose together
STRAIGHT = 1e-8  # of the spacing: a corner nearer than this to the line between its fixed neighbours slides along it

Point = tuple[float, float]


@dataclass(slots=True)
class Net:
    """A subdivision under change, as lists; lengths in spacings, so that a stretched wall has its joints stretched."""

    point: list[Point]
    rings: list[list[int]]
    spacing: Point  # m
    least: float  # m, inradius proxy
    cells: dict[int, set[int]] = field(default_factory=dict)  # at each corner; -1 = outside
    slide: dict[int, Point | None] = field(default_factory=dict)  # of corners not free: direction, None = stays
    outline: set[int] = field(default_factory=set)

    def around(self, p: int) -> set[int]:
        """Corners next to a corner."""
        near: set[int] = set()
        for c in self.cells[p] - {-1}:
            ring = self.rings[c]
            i = ring.index(p)
            near |= {ring[i - 1], ring[(i + 1) % len(ring)]}
        return near

    def length(self, a: int, b: int) -> float:
        """From corner to corner, in spacings."""
        return self.distance(a, self.point[b])

    def distance(self, a: int, place: Point) -> float:
        """From a corner to a place, in spacings."""
        (x, y), (u, v) = self.point[a], place
        return float(np.hypot((u - x) / self.spacing[0], (v - y) / self.spacing[1]))

    def along(self, a: int, b: int) -> Point:
        """From a to b, in spacings."""
        (x, y), (u, v) = self.point[a], self.point[b]
        return (u - x) / self.spacing[0], (v - y) / self.spacing[1]

    def area(self, c: int) -> float:
        """Area of a cell (m2)."""
        corner = np.array([self.point[k] for k in self.rings[c]])
        if len(corner) < 3:
            return 0.0
        after, here = np.roll(corner, -1, axis=0) - corner[0], corner - corner[0]
        return float((here[:, 0] * after[:, 1] - here[:, 1] * after[:, 0]).sum()) / 2.0

    def thinness(self, c: int) -> float:
        """Inradius proxy 2 A / P of a cell (m), negative where it is not simple."""
        import shapely

        if len(self.rings[c]) < 3:
            return -1.0
        corner = np.array([self.point[k] for k in self.rings[c]])
        polygon = shapely.polygons(corner)
        if not shapely.is_valid(polygon):
            return -1.0
        return 2.0 * self.area(c) / float(shapely.length(polygon))

    def on_side(self, p: int, q: int) -> bool:
        """Whether q lies on the line along which p slides."""
        way = self.slide[p]
        if way is None:
            return False
        u, v = self.along(p, q)
        return abs(u * way[1] - v * way[0]) <= STRAIGHT

    def covers(self, touched: Iterable[int], before: float) -> bool:
        """Whether cells have the area together that they had before (m2)."""
        return abs(sum(map(self.area, touched)) - before) <= COVER * self.spacing[0] * self.spacing[1]

    def is_good(self, c: int, before: float) -> bool:
        """Whether a cell is simple, and no thinner than it was before (m) or than the least."""
        return self.thinness(c) >= min(before, self.least) and self.thinness(c) > 0.0

    def short_edges(self, *ends: int) -> int:
        """How many short edges there are at some corners."""
        edges = {(min(p, q), max(p, q)) for p in ends for q in self.around(p)}
        return sum(self.length(p, q) < SHORT for p, q in edges)


def net_of(found: Subdivision, spacing: Floats, least: float) -> Net:
    """The net of a valid pattern.

    Parameters
    ----------
    found : Subdivision
        Dressed stones have site -1.
    spacing : (2,) float
        Of the stones along u and v (m).
    least : float
        Inradius proxy (m) that no cell may fall below, unless it is below already.
    """
    step = float(spacing[0]), float(spacing[1])
    net = Net([(x, y) for x, y in found.vertex.tolist()], found.rings(), step, least)
    net.cells = {k: set() for k in range(len(found.vertex))}
    for k, c in zip(found.index.tolist(), found.cell().tolist(), strict=True):
        net.cells[k].add(c)
    outer: Bools = np.any(found.side < 0, axis=1)
    held = outer | (found.site < 0)[found.side].any(axis=1)
    arms: dict[int, list[int]] = {}
    for (a, b), outside in zip(found.edge[held].tolist(), outer[held].tolist(), strict=True):
        for p, q in ((a, b), (b, a)):
            arms.setdefault(p, []).append(q)
            if outside:
                net.outline.add(p)
                net.cells[p].add(-1)
    for p, ends in arms.items():
        net.slide[p] = _side(found.vertex / spacing, p, ends) if len(ends) == 2 else None
    return net


def _side(vertex: Floats, p: int, ends: list[int]) -> Point | None:
    """Direction (spacings) in which a corner can slide between two fixed edges; None if they are not in one line."""
    one, other = vertex[ends[0]] - vertex[p], vertex[ends[1]] - vertex[p]
    way = other - one
    if not (abs(one[0] * other[1] - one[1] * other[0]) <= STRAIGHT * np.hypot(*way) and one @ other < 0.0):
        return None
    way = way / np.hypot(*way)
    return float(way[0]), float(way[1])
