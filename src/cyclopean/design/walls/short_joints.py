"""Joints far shorter than a stone taken out of a pattern: they bear nothing, and no mason would cut them.

The two ends of a short edge become one corner where no more than three regions then meet there (the outside counts as
one): a bend is straightened, a bed runs into the corner of a dressed stone. Elsewhere that would make a crossing, which
weakens the bond; there the ends move apart along the edge until it is a joint worth the name. Corners on straight sides
of the outline or of dressed stones slide along them, other corners of these stay. A change counts only if every cell
that it touches stays simple, keeps its inradius proxy or the least one, they cover together what they covered before,
and no other edge becomes short by it. What cannot be changed under these conditions stays.

By hand: two short edges in a square, one a bend that can go, one between two joints that must be set apart.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.geometry import Subdivision, dissolved, subdivide

__all__ = ["SHORT", "without_short_joints"]

SHORT = 0.02  # of the spacing of the stones: an edge below this is short
APART = (1.5, 1.01)  # of the short length: what an edge is stretched to, the first that fits
ROUNDS = 6  # of looking at all short edges; one change can make room for another
COVER = 1e-10  # of a spacing's area: what the cells that a change touches may gain or lose together
STRAIGHT = 1e-8  # of the spacing: a corner nearer than this to the line between its fixed neighbours slides along it

Point = tuple[float, float]


@dataclass(slots=True)
class _Net:
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
        return float(np.hypot(*self.along(a, b)))

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


def without_short_joints(found: Subdivision, spacing: Floats, least: float) -> Subdivision:
    """The pattern without edges between stones that are shorter than `SHORT` of the stones' spacing.

    Parameters
    ----------
    found : Subdivision
        A valid pattern; dressed stones have site -1 and keep their shape.
    spacing : (2,) float
        Of the stones along u and v (m).
    least : float
        Inradius proxy (m) that no cell may fall below, unless it is below already.

    Returns
    -------
    Subdivision
        A valid pattern of the same outline; the very one given where nothing could be changed.
    """
    for _ in range(ROUNDS):
        near = _short_edges(found, spacing)
        net = _net(found, spacing, least) if near else None
        if net is None or not sum(_mended(net, a, b) for a, b in near if a in net.cells and b in net.cells):
            break
        found = dissolved(subdivide(net.point, net.rings, found.site))
    return found


def _short_edges(found: Subdivision, spacing: Floats) -> list[tuple[int, int]]:
    """Short edges, the shortest first."""
    along = (found.vertex[found.edge[:, 1]] - found.vertex[found.edge[:, 0]]) / spacing
    length = np.hypot(along[:, 0], along[:, 1])
    some = np.flatnonzero(length < SHORT)
    return [(a, b) for a, b in found.edge[some[np.argsort(length[some], kind="stable")]].tolist()]


def _net(found: Subdivision, spacing: Floats, least: float) -> _Net:
    step = float(spacing[0]), float(spacing[1])
    net = _Net([(x, y) for x, y in found.vertex.tolist()], found.rings(), step, least)
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


def _mended(net: _Net, a: int, b: int) -> bool:
    """Try the changes in turn; whether one was made."""
    if b not in net.around(a) or not net.length(a, b) < SHORT:
        return False
    corner_of_outline = any(p in net.outline and net.slide.get(p, ()) is None for p in (a, b))
    ways = [_merged, _parted]
    if corner_of_outline:  # a joint that ran into it would leave a wedge on one side
        ways.reverse()
    return any(way(net, a, b) for way in ways)


def _merged(net: _Net, a: int, b: int) -> bool:
    """Make the ends one corner, if no more than three regions meet there."""
    if len(net.cells[a] | net.cells[b]) > 3:
        return False
    fixed = [p for p in (a, b) if p in net.slide]
    stays = [p for p in fixed if net.slide[p] is None]
    if len(stays) == 2 or (len(fixed) == 2 and not stays):
        return False
    keep = (stays or fixed or [max((a, b), key=lambda p: len(net.cells[p]))])[0]
    gone = b if keep == a else a
    if gone in net.slide and not _on_side(net, gone, keep):
        return False
    touched = sorted((net.cells[a] | net.cells[b]) - {-1})
    before = {c: (net.rings[c], net.thinness(c)) for c in touched}
    whole = sum(map(net.area, touched))
    for c in touched:
        ring = [keep if k == gone else k for k in net.rings[c]]
        net.rings[c] = [k for k, after in zip(ring, ring[1:] + ring[:1], strict=True) if k != after]
    simple = all(len(set(net.rings[c])) == len(net.rings[c]) for c in touched)
    if not (simple and _covers(net, touched, whole) and all(_good(net, c, before[c][1]) for c in touched)):
        for c in touched:
            net.rings[c] = before[c][0]
        return False
    net.cells[keep] |= net.cells.pop(gone)
    return True


def _on_side(net: _Net, p: int, q: int) -> bool:
    """Whether q lies on the line along which p slides."""
    way = net.slide[p]
    if way is None:
        return False
    u, v = net.along(p, q)
    return abs(u * way[1] - v * way[0]) <= STRAIGHT


def _covers(net: _Net, touched: list[int], before: float) -> bool:
    """Whether cells have the area together that they had before (m2)."""
    return abs(sum(map(net.area, touched)) - before) <= COVER * net.spacing[0] * net.spacing[1]


def _good(net: _Net, c: int, before: float) -> bool:
    return net.thinness(c) >= min(before, net.least) and net.thinness(c) > 0.0


def _parted(net: _Net, a: int, b: int) -> bool:
    """Move the ends apart, as far as they are free to go."""
    touched = sorted((net.cells[a] | net.cells[b]) - {-1})
    thin, whole = {c: net.thinness(c) for c in touched}, sum(map(net.area, touched))
    old = net.point[a], net.point[b]
    short = _count_short(net, a, b)
    for new in _stretched(net, a, b):
        net.point[a], net.point[b] = new
        if not net.length(a, b) < SHORT and _count_short(net, a, b) < short:
            if _covers(net, touched, whole) and all(_good(net, c, thin[c]) for c in touched):
                return True
        net.point[a], net.point[b] = old
    return False


def _count_short(net: _Net, a: int, b: int) -> int:
    edges = {(min(p, q), max(p, q)) for p in (a, b) for q in net.around(p)}
    return sum(net.length(p, q) < SHORT for p, q in edges)


def _stretched(net: _Net, a: int, b: int) -> Iterator[tuple[Point, Point]]:
    """Places for both ends: each moves half of the way, then one of them all of it."""
    (u, v), length = net.along(a, b), net.length(a, b)
    if not length > 0.0:
        return
    way = (u / length, v / length)
    stays = [p in net.slide and net.slide[p] is None for p in (a, b)]
    for goal in APART:
        more = goal * SHORT - length
        for share in (0.0,) if stays[0] else (1.0,) if stays[1] else (0.5, 0.0, 1.0):
            yield _moved(net, a, way, -more * share), _moved(net, b, way, more * (1.0 - share))


def _moved(net: _Net, p: int, way: Point, far: float) -> Point:
    """Place of a corner after it has gone `far` (spacings) along a direction, as far as its side allows."""
    x, y = net.point[p]
    if p in net.slide:
        side = net.slide[p]
        if side is None:
            return x, y
        far *= way[0] * side[0] + way[1] * side[1]
        way = side
    return x + far * way[0] * net.spacing[0], y + far * way[1] * net.spacing[1]
