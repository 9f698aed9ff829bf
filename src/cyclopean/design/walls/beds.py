"""Stones that lie on a bed: corners moved until every stone has a face below it that is flatter than an angle.

A stone all of whose lower faces are steeper than the friction angle slides off them, unless its neighbours jam it
(`assembly.steep_beds`). In a drawn pattern few stones are like that, and mostly by little. For each of them the ends of
its lower edges are moved, one of the two or both, upright or square to the bed that is wanted, by as little as will do.
A move counts under the conditions of `design.walls.net`, if no edge becomes short by it and fewer of the stones that
it touches are without a bed. Stones for which there is none stay as they were drawn.

The angle is that of the joint as it is laid on its surface. Where that leans back, so does every bed, and at the height
of a dome no stone has a flat one.

By hand: a joint that rises as much as it runs leans by 45 degrees on a plane.

>>> front = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 1.0]])
>>> np.degrees(_angles(front, front + [0.0, 1.0, 0.0], [0], [1])).round(9).tolist()
[45.0]
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.design.walls.joints import base_edges
from cyclopean.design.walls.net import Net, Point, net_of
from cyclopean.design.walls.pattern import Pattern
from cyclopean.design.walls.surfaces import Surface, Thickness
from cyclopean.geometry import Subdivision
from cyclopean.geometry.frames import unit

__all__ = ["bedded"]

UPRIGHT = 90.0  # degrees: every face below a stone is flatter than this, so there is nothing to do
AIMS = (0.99, 0.8, 0.5)  # of the rise a metre that is allowed: less is needed where the surface leans or is round
ROUNDS = 6  # of looking at all stones; one change can make room for another
SHARES = (1.0, 0.0, 0.5)  # of a move that falls to the left end of an edge
ASIDE = 1e-6  # of a move square to the bed: a corner that slides away from it by less has no say

Edge = tuple[int, int]
Moves = dict[int, Point]


@dataclass(frozen=True, slots=True)
class _Wanted:
    """What beds are to be like, and what has no say in it."""

    surface: Surface
    thickness: Thickness
    limit: float  # rad from level
    idle: frozenset[Edge]  # edges on nothing, the lower corner first: they bear no stone

    def steep(self, net: Net, c: int) -> bool:
        """Whether a cell has no bed."""
        ring = net.rings[c]
        front, back = self.thickness.rails(self.surface, np.array([net.point[k] for k in ring]))
        angle = _angles(front, back, np.arange(len(ring)), np.roll(np.arange(len(ring)), -1))
        bears = [(min(a, b), max(a, b)) not in self.idle for a, b in _around(net, c)]
        return not bool((angle[bears] <= self.limit).any())


def bedded(pattern: Pattern, surface: Surface, thickness: Thickness) -> Pattern:
    """The pattern with its corners moved so that its field stones lie on beds.

    Parameters
    ----------
    pattern : Pattern
        Of its settings, `max_bed` says how flat one of the lower faces of every stone is to be; 90 = as drawn.
    surface, thickness
        What it is laid on.

    Returns
    -------
    Pattern
        The very one given where nothing was to be done.
    """
    cells, settings = pattern.subdivision, pattern.settings
    if not settings.max_bed < UPRIGHT:
        return pattern
    outside: Bools = np.any(cells.side < 0, axis=1)
    outside[base_edges(pattern)] = False
    idle = frozenset((a, b) for a, b in cells.edge[outside].tolist())
    wanted = _Wanted(surface, thickness, float(np.radians(settings.max_bed)), idle)
    spacing = np.array([settings.width / settings.columns, settings.height / settings.rows])
    for _ in range(ROUNDS):
        steep = _steep(pattern.subdivision, wanted)
        net = net_of(pattern.subdivision, spacing, float(cells.inradii().min())) if steep else None
        if net is None or not sum(_bedded(net, c, wanted) for c in steep):
            break
        pattern = pattern.with_corners(np.array(net.point))
    return pattern


def _steep(found: Subdivision, wanted: _Wanted) -> list[int]:
    """Field stones without a bed."""
    ahead = found.following()
    angle = _angles(*wanted.thickness.rails(wanted.surface, found.vertex), found.index, ahead)
    ends = np.sort(np.stack([found.index, ahead], 1), axis=1).tolist()
    bears = np.array([(a, b) not in wanted.idle for a, b in ends])
    best = np.minimum.reduceat(np.where(bears, angle, np.inf), found.start[:-1])
    return [int(c) for c in np.flatnonzero((best > wanted.limit) & (found.site >= 0))]


def _angles(front: Floats, back: Floats, first: Ints, second: Ints) -> Floats:
    """Angle from level (rad) of the joints over edges; below a right angle where they bear the stone to the left."""
    normal = np.cross(back[second] - front[first], back[first] - front[second])
    size = np.linalg.norm(normal, axis=1)
    rise = np.divide(normal[:, 2], size, out=np.zeros(len(size)), where=size > 0.0)
    return np.asarray(np.arccos(np.clip(rise, -1.0, 1.0)))


def _around(net: Net, c: int) -> list[Edge]:
    """Edges of a cell, counter-clockwise."""
    ring = net.rings[c]
    return list(zip(ring, ring[1:] + ring[:1], strict=True))


def _bedded(net: Net, c: int, wanted: _Wanted) -> bool:
    """Give a stone a bed by the least move that will do; whether there is one."""
    if not wanted.steep(net, c):
        return False  # a neighbour's move did it
    for moves in _moves(net, c, wanted):
        touched = sorted(set[int]().union(*(net.cells[p] for p in moves)) - {-1})
        thin, whole = {k: net.thinness(k) for k in touched}, sum(map(net.area, touched))
        before, short = sum(wanted.steep(net, k) for k in touched), net.short_edges(*moves)
        old = {p: net.point[p] for p in moves}
        for p, place in moves.items():
            net.point[p] = place
        sound = net.covers(touched, whole) and all(net.is_good(k, thin[k]) for k in touched)
        if sound and net.short_edges(*moves) <= short and sum(wanted.steep(net, k) for k in touched) < before:
            return True
        for p, place in old.items():
            net.point[p] = place
    return False


def _moves(net: Net, c: int, wanted: _Wanted) -> list[Moves]:
    """New places for the ends of the lower edges of a cell, the shortest way first."""
    found: list[tuple[float, Moves]] = []
    for a, b in _around(net, c):
        if net.point[b][0] > net.point[a][0] and (min(a, b), max(a, b)) not in wanted.idle:
            for aim in AIMS:
                found += _flattened(net, a, b, aim * float(np.tan(wanted.limit)))
    return [moves for _, moves in sorted(found, key=lambda one: one[0])]


def _flattened(net: Net, a: int, b: int, slope: float) -> Iterator[tuple[float, Moves]]:
    """Ways to make an edge that runs to the right as flat as a slope, and how far (spacings) a corner goes in each."""
    (x, y), (u, v) = net.point[a], net.point[b]
    sign = 1.0 if v > y else -1.0
    excess = sign * (v - y) - slope * (u - x)  # m, that the edge rises too much
    if not excess > 0.0:
        return
    square = (-slope, sign)  # of a metre that the left end goes this way, excess falls by the square of its length
    for way in (square, (0.0, sign)):
        for share in SHARES:
            ends = ((a, 1.0, share), (b, -1.0, 1.0 - share))
            moves = {p: _gone(net, p, way, square, turn, part * excess) for p, turn, part in ends if part}
            places = {p: place for p, place in moves.items() if place is not None}
            if len(places) == len(moves):
                yield max(net.distance(p, place) for p, place in places.items()), places


def _gone(net: Net, p: int, way: Point, square: Point, turn: float, excess: float) -> Point | None:
    """Place of a corner that has gone a way, or the opposite, until this much excess (m) is gone; None = it cannot."""
    along = np.array(way)
    if p in net.slide:
        side = net.slide[p]
        if side is None:
            return None
        line = unit(np.array(side) * net.spacing)
        along = line * (line @ along)
    fall = float(along @ square)
    if not fall > ASIDE:
        return None
    x, y = np.array(net.point[p]) + turn * excess / fall * along
    return float(x), float(y)
