"""Stones that lie on a bed: corners moved until every stone has a face below it that is flatter than an angle.

A stone all of whose lower faces are steeper than the friction angle slides off them, unless its neighbours jam it
(`assembly.steep_beds`). In a drawn pattern few stones are like that, and mostly by little. For each of them the ends of
its lower edges are moved, one of the two or both, upright or square to the bed that is wanted, by as little as will do;
of the first few moves the first is taken that costs no interlock, if there is one. A move counts under the conditions
of `design.walls.net`, if no edge becomes short by it and fewer of the stones that it touches are without a bed. Stones
for which there is none stay as they were drawn.

The angle is that of the joint as it is laid on its surface. Where that leans back, so does every bed, and at the height
of a dome no stone has a flat one.

By hand: a joint that rises as much as it runs leans by 45 degrees on a plane.

>>> front = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 1.0]])
>>> np.degrees(_angles(front, front + [0.0, 1.0, 0.0], [0], [1])).round(9).tolist()
[45.0]
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis import GRAVITY, MU
from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly, SteepBed, steep_beds
from cyclopean.design.walls.interlock import aligned_joints, course_lines, usual_tolerance
from cyclopean.design.walls.net import Net, Point, net_of
from cyclopean.design.walls.pattern import Pattern
from cyclopean.design.walls.surfaces import Surface, Thickness
from cyclopean.geometry import Subdivision
from cyclopean.geometry.frames import unit

__all__ = ["bedded", "without_bed"]

UPRIGHT = 90.0  # degrees: every face below a stone is flatter than this, so there is nothing to do
AIMS = (0.99, 0.8, 0.5)  # of the rise a metre that is allowed: less is needed where the surface leans or is round
ROUNDS = 6  # of looking at all stones; one change can make room for another
SHARES = (1.0, 0.0, 0.5)  # of a move that falls to the left end of an edge
TRIES = 6  # moves that would do but cost interlock, before the least of them is taken
ASIDE = 1e-6  # of a move square to the bed: a corner that slides away from it by less has no say

Moves = dict[int, Point]


@dataclass(frozen=True, slots=True)
class _Wanted:
    """What beds are to be like, and what has no say in it."""

    surface: Surface
    thickness: Thickness
    limit: float  # rad from level
    pattern: Pattern  # as it was drawn

    def angles(self, ring: Floats) -> Floats:
        """Angle from level (rad) of the joint over each side of a ring, (k, 2) m."""
        here = np.arange(len(ring))
        return _angles(*self.thickness.rails(self.surface, ring), here, np.roll(here, -1))

    def steep(self, net: Net, c: int) -> bool:
        """Whether a cell has no bed."""
        return not bool((self.angles(np.array([net.point[k] for k in net.rings[c]])) <= self.limit).any())

    def within(self, place: Point) -> bool:
        """Whether a place is in the pattern."""
        whole = self.pattern.settings
        return 0.0 <= place[0] <= whole.width and 0.0 <= place[1] <= whole.height

    def aligned(self, net: Net) -> float:
        """Share of the head joints, by length, that are aligned: what they take from J."""
        cells = self.pattern.with_corners(np.array(net.point)).subdivision
        head, pair = aligned_joints(cells, course_lines(self.pattern), usual_tolerance(self.pattern))
        length = cells.lengths()[head]
        return float(length[np.unique(pair)].sum() / max(length.sum(), 1e-300))


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
    wanted = _Wanted(surface, thickness, float(np.radians(settings.max_bed)), pattern)
    spacing = np.array([settings.width / settings.columns, settings.height / settings.rows])
    for _ in range(ROUNDS):
        steep = _steep(pattern.subdivision, wanted)
        net = net_of(pattern.subdivision, spacing, float(cells.inradii().min())) if steep else None
        if net is None or not sum(_bedded(net, c, wanted) for c in steep):
            break
        pattern = pattern.with_corners(np.array(net.point))
    return pattern


def without_bed(assembly: Assembly, stones: Sequence[int], degrees: float) -> tuple[SteepBed, ...]:
    """Stones of a wall that have no face below them as flat as this, or as the friction angle if that is less.

    Parameters
    ----------
    assembly : Assembly
        A wall with its joints; friction is that of a check where it gives none.
    stones : sequence of int
        Blocks to look at.
    degrees : float
        From level.
    """
    joints = assembly.contacts
    if joints is None:
        return ()
    mu = np.minimum(joints.with_mu(MU).mu, np.tan(np.radians(degrees)))
    fixed = np.ones(len(assembly), bool)
    fixed[list(stones)] = False
    return steep_beds(assembly, replace(joints, mu=mu), fixed, np.array(GRAVITY))


def _steep(found: Subdivision, wanted: _Wanted) -> list[int]:
    """Field stones without a bed."""
    ahead = found.following()
    angle = _angles(*wanted.thickness.rails(wanted.surface, found.vertex), found.index, ahead)
    best = np.minimum.reduceat(angle, found.start[:-1])
    return [int(c) for c in np.flatnonzero((best > wanted.limit) & (found.site >= 0))]


def _angles(front: Floats, back: Floats, first: Ints, second: Ints) -> Floats:
    """Angle from level (rad) of the joints over edges; below a right angle where they bear the stone to the left."""
    normal = np.cross(back[second] - front[first], back[first] - front[second])
    size = np.linalg.norm(normal, axis=1)
    rise = np.divide(normal[:, 2], size, out=np.zeros(len(size)), where=size > 0.0)
    return np.asarray(np.arccos(np.clip(rise, -1.0, 1.0)))


def _bedded(net: Net, c: int, wanted: _Wanted) -> bool:
    """Give a stone a bed by the least move that costs no interlock, or by the least; whether there is one."""
    ways = _moves(net, c, wanted) if wanted.steep(net, c) else []  # a neighbour's move may have done it
    if not ways:
        return False
    before, sound = wanted.aligned(net), list[Moves]()
    for moves in ways:
        old = _placed(net, moves)
        if not wanted.steep(net, c) and _spoils_nothing(net, old, wanted):
            if wanted.aligned(net) <= before:
                return True
            sound.append(moves)
        _placed(net, old)
        if len(sound) == TRIES:
            break
    _placed(net, sound[0] if sound else {})
    return bool(sound)


def _spoils_nothing(net: Net, old: Moves, wanted: _Wanted) -> bool:
    """Whether a move from these places leaves cells that are good, and fewer of them without a bed."""
    touched = sorted(set[int]().union(*(net.cells[p] for p in old)) - {-1})

    def measured() -> tuple[list[float], int, int]:
        without = sum(wanted.steep(net, k) for k in touched)
        return [net.thinness(k) for k in touched], net.short_edges(*old), without

    new = _placed(net, old)
    thin, short, without = measured()
    whole = sum(map(net.area, touched))
    _placed(net, new)
    _, now_short, now_without = measured()
    good = net.covers(touched, whole) and all(map(net.is_good, touched, thin))
    return good and now_short <= short and now_without < without


def _placed(net: Net, places: Moves) -> Moves:
    """Put corners in their places; where they were."""
    old = {p: net.point[p] for p in places}
    for p, place in places.items():
        net.point[p] = place
    return old


def _moves(net: Net, c: int, wanted: _Wanted) -> list[Moves]:
    """New places for the ends of the lower edges of a cell, the shortest way first."""
    found: list[tuple[float, Moves]] = []
    ring = net.rings[c]
    for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
        (x, y), (u, _) = net.point[a], net.point[b]
        # where even a level edge is too steep, the surface leans too far
        if u > x and wanted.angles(np.array([(x, y), (u, y)]))[0] <= wanted.limit:
            for aim in AIMS:
                found += _flattened(net, a, b, aim * float(np.tan(wanted.limit)))
    within = [one for one in found if all(wanted.within(place) for place in one[1].values())]
    return [moves for _, moves in sorted(within, key=lambda one: one[0])]


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
