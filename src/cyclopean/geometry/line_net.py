"""Drawn lines made a net: corners that nearly meet become one, and every line ends where it meets another.

Drawn lines seldom meet to the last digit. So, with a reach r,

1. points nearer to each other than r become one of them. Those at which most lines meet have the first choice, facets
   of curves the last, so that nodes stay where they were drawn; each takes what is within r of itself and no further,
   so that nothing moves by more than r, however finely a curve is drawn;
2. a point nearer than r to the inside of a straight line is moved onto it, so that a long bed stays straight;
3. a line is broken at every point nearer than r to it. Those are the points that step 2 put there, and points on
   curves, which lie on the arc and not on its chords: the chords go through them.

What remains is either a plane graph or has lines that cross where neither has a corner, and their places are told. The
faces are those of the graph; lines that bound none (dangling or between two nets) are told by their places too.

The steps are those of cleaning in geographic information systems; snapping by a choice of points is snap rounding with
corners instead of a grid, Hobby (1999). Nothing here is new.

By hand: a square with a line from side to side that ends 1 mm short of one and 1 mm beyond the other has two faces.

>>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0.0]])
>>> net = noded([square, np.array([[0.5, 0.001], [0.5, 1.001]])], 0.01)
>>> found = faces(net)
>>> [len(ring) for ring in found.rings], net.gap[:, 2].round(6).tolist(), len(found.idle), len(net.crossing)
([4, 4], [0.001, 0.001], 0, 0)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.geometry.subdivision import Subdivision, dissolved, subdivide

__all__ = ["Faces", "LineNet", "faces", "noded", "outlined_cells"]

SAME = 1e-9  # of the drawing's size: what is nearer was meant to meet, and is not told as a gap
PASSES = 8  # of breaking lines: bending one to a point brings it within reach of another now and then


@dataclass(frozen=True, slots=True, eq=False)
class LineNet:
    """Lines broken where they meet."""

    point: Floats  # (V, 2) unit of the drawing
    edge: Ints  # (E, 2) point numbers, the lower first
    part: Ints  # (P, 2) edge, and line of which it is a part; an edge that was drawn twice has two rows
    gap: Floats  # (g, 3) where something was closed, and how far it was open
    crossing: Floats  # (c, 2) where edges cross

    def of(self, lines: Bools) -> Bools:
        """(E,) whether an edge is part of one of some lines, (n,)."""
        found = np.zeros(len(self.edge), bool)
        found[self.part[lines[self.part[:, 1]], 0]] = True
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
    """Faces of a net, and the edges that bound none."""

    rings: tuple[tuple[int, ...], ...]  # points of each, counter-clockwise
    islands: tuple[tuple[int, ...], ...]  # points of each ring that lies free in a face
    holed: tuple[int, ...]  # the face around each island
    idle: Ints  # (i,) edges with the same face on both sides: they dangle, or lead from one net to another


@dataclass(frozen=True, slots=True, eq=False)
class _Segments:
    """Straight pieces of lines."""

    ends: Ints  # (S, 2) point numbers
    line: Ints  # (S,)
    curved: Bools  # (S,) whether it stands for a piece of a curve


def noded(lines: Sequence[Floats], reach: float, facet: Sequence[Bools] | None = None) -> LineNet:
    """Break lines where they meet, and close gaps.

    Parameters
    ----------
    lines : sequence of (k, 2) float
        Closed ones end where they begin; in any unit.
    reach : float
        Points and lines that are nearer to each other than this meet.
    facet : sequence of (k,) bool, optional
        Which points of each line were put on a curve; none where not given.

    Returns
    -------
    LineNet
    """
    every = np.concatenate(lines)
    size = float(np.hypot(*np.ptp(every, axis=0)))
    on_curve = np.zeros(len(every), bool) if facet is None else np.concatenate(facet)
    place, name = np.unique(every, axis=0, return_inverse=True)
    name = name.ravel()
    last = np.cumsum([len(line) for line in lines])
    rank = _rank(len(place), name, on_curve, np.concatenate([last - 1, last - [len(line) for line in lines]]))
    centre = _centres(place, rank, reach)
    far = np.hypot(*(place - place[centre]).T)
    drawn = np.bincount(name, ~on_curve, minlength=len(place)) > 0
    moved = np.flatnonzero(drawn & (far > SAME * size))
    gap = [np.column_stack([place[centre[moved]], far[moved]])]
    inner = np.setdiff1d(np.arange(len(every) - 1), last - 1)
    owner = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    ends = centre[name[np.stack([inner, inner + 1], 1)]]
    some = ends[:, 0] != ends[:, 1]
    curved = on_curve[inner] | on_curve[inner + 1]
    segments = _Segments(ends[some], owner[inner[some]], curved[some])
    place, closed = _put_on_lines(place, segments, reach, SAME * size)
    segments = _broken(place, segments, reach)
    return _net(place, segments, np.concatenate([*gap, closed]))


def _rank(count: int, name: Ints, on_curve: Bools, tip: Ints) -> Ints:
    """Points in the order in which they choose: facets of curves last, where most lines meet first, free ends late."""
    drawn = np.bincount(name, ~on_curve, minlength=count)
    ends = np.bincount(name[tip], minlength=count)
    return np.lexsort((np.arange(count), (drawn == ends) & (ends == 1), -drawn, drawn == 0))


def _centres(place: Floats, rank: Ints, reach: float) -> Ints:
    """Of each point the one that it becomes."""
    from scipy.spatial import cKDTree

    near = cKDTree(place).query_pairs(reach, output_type="ndarray")
    beside: dict[int, list[int]] = {}
    for a, b in near.tolist():
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    centre = np.full(len(place), -1, np.int64)
    for k in rank.tolist():
        if centre[k] < 0:
            centre[k] = k
            for other in beside.get(k, ()):
                if centre[other] < 0:
                    centre[other] = k
    return centre


def _near(place: Floats, segments: _Segments, reach: float) -> tuple[Ints, Ints, Floats, Floats]:
    """Points near the inside of segments: point, segment, share along it, and distance, (m,) each."""
    import shapely

    used = np.unique(segments.ends)
    tree = shapely.STRtree(shapely.linestrings(place[segments.ends]))
    which, segment = tree.query(shapely.points(place[used]), predicate="dwithin", distance=reach)
    point = used[which]
    foreign = (segments.ends[segment] != point[:, None]).all(axis=1)
    point, segment = point[foreign], segment[foreign]
    start, way = place[segments.ends[segment, 0]], np.diff(place[segments.ends[segment]], axis=1)[:, 0]
    off = place[point] - start
    share = (off * way).sum(axis=1) / (way * way).sum(axis=1)
    far = np.abs(way[:, 0] * off[:, 1] - way[:, 1] * off[:, 0]) / np.hypot(way[:, 0], way[:, 1])
    inside = (share > 0.0) & (share < 1.0)
    return point[inside], segment[inside], share[inside], far[inside]


def _put_on_lines(place: Floats, segments: _Segments, reach: float, same: float) -> tuple[Floats, Floats]:
    """Points near straight segments moved onto the nearest of them; where, and how far each had to go, (g, 3)."""
    point, segment, share, far = _near(place, segments, reach)
    keep = ~segments.curved[segment] & (far > same)  # what lies on a line already keeps its digits
    point, segment, share, far = point[keep], segment[keep], share[keep], far[keep]
    order = np.lexsort((segment, far, point))
    first = order[np.unique(point[order], return_index=True)[1]]
    ends = place[segments.ends[segment[first]]]
    moved = place.copy()
    moved[point[first]] = ends[:, 0] + share[first, None] * (ends[:, 1] - ends[:, 0])
    return moved, np.column_stack([moved[point[first]], far[first]])


def _broken(place: Floats, segments: _Segments, reach: float) -> _Segments:
    """Segments broken at every point that lies on them or within reach."""
    for _ in range(PASSES):
        point, segment, share, _ = _near(place, segments, reach)
        if not len(point):
            break
        count = len(segments.ends)
        owner = np.concatenate([np.arange(count), segment, np.arange(count)])
        along = np.concatenate([np.zeros(count), share, np.ones(count)])
        name = np.concatenate([segments.ends[:, 0], point, segments.ends[:, 1]])
        order = np.lexsort((name, along, owner))
        name, owner = name[order], owner[order]
        inner = np.flatnonzero((owner[1:] == owner[:-1]) & (name[1:] != name[:-1]))
        own = owner[inner]
        segments = _Segments(np.stack([name[inner], name[inner + 1]], 1), segments.line[own], segments.curved[own])
    return segments


def _net(place: Floats, segments: _Segments, gap: Floats) -> LineNet:
    """Every segment once, and where two of them cross."""
    import shapely

    edge, number = np.unique(np.sort(segments.ends, axis=1), axis=0, return_inverse=True)
    part = np.unique(np.stack([number.ravel(), segments.line], 1), axis=0)
    drawn = shapely.linestrings(place[edge])
    one, other = shapely.STRtree(drawn).query(drawn, predicate="crosses")
    once = one < other
    crossing = shapely.get_coordinates(shapely.centroid(shapely.intersection(drawn[one[once]], drawn[other[once]])))
    return LineNet(place, edge, part, gap, np.unique(crossing, axis=0))


def faces(net: LineNet) -> Faces:
    """Faces of a net without crossings."""
    import shapely

    drawn = shapely.linestrings(net.point[net.edge])
    polygon = shapely.get_parts(shapely.polygonize_full(drawn)[0])
    number = {(x, y): k for k, (x, y) in enumerate(net.point.tolist())}
    rings = tuple(_named(shapely.get_exterior_ring(one), number) for one in polygon)
    inner = [(k, ring) for k, one in enumerate(polygon) for ring in one.interiors]
    islands = tuple(_named(ring, number) for _, ring in inner)
    bounding = {frozenset(pair) for ring in (*rings, *islands) for pair in pairwise((*ring, ring[0]))}
    idle = [k for k, pair in enumerate(net.edge.tolist()) if frozenset(pair) not in bounding]
    return Faces(rings, islands, tuple(k for k, _ in inner), np.array(idle, np.int64))


def outlined_cells(outlines: Sequence[Floats], shapes: Any, reach: float, *, once: bool) -> Subdivision | None:
    """Cells of outlines (k, 2): the faces of their net, see `noded`, that lie in one of `shapes`, (n,) polygons.

    None where outlines cross, shapes overlap, or with `once` where a shape has not just one face.
    """
    import shapely

    net = noded(outlines, reach)
    if len(net.crossing):
        return None
    ring = faces(net).rings
    inside = shapely.point_on_surface(shapely.polygons([shapely.linearrings(net.point[list(r)]) for r in ring]))
    face, shape = shapely.STRtree(shapes).query(inside, predicate="within")
    if once and not (np.bincount(shape, minlength=len(shapes)) == 1).all():
        return None
    if len(np.unique(face)) < len(face):
        return None
    return dissolved(subdivide(net.point, [ring[k] for k in face.tolist()], shape))


def _named(ring: Any, number: dict[tuple[float, float], int]) -> tuple[int, ...]:
    """Points of a ring, counter-clockwise."""
    import shapely

    names = [number[x, y] for x, y in shapely.get_coordinates(ring)[:-1].tolist()]
    return tuple(names if shapely.is_ccw(ring) else names[::-1])
