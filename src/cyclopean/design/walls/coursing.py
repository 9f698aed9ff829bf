"""Coursing: draw the corners of a pattern towards level course lines, and keep every cell whole.

Each free corner moves straight up or down, v' = (1 - c) v + c line(v): c = 0 leaves an irregular wall, c = 1 levels it.
Since only v changes, "corner p stays above edge ab of its cell" is one linear inequality,

    s [ v_p - (1 - t) v_a - t v_b ] > 0,     t = (u_p - u_a) / (u_b - u_a),     s = +-1 as at the start,

and a pattern in which all of them hold in all cells is a valid one: no ring can cross itself, and rings that share
their edges then tile what they tiled before. They hold at c = 0; where they hold at c = 1 as well they hold in between.
So the lines that the corners aim at are chosen to satisfy them: the nearest, and where two corners disagree the one
that loses least takes its second nearest. What still conflicts moves only part of the way. Corners of one cell that aim
at one line may meet there: at c = 1 the edges between them fall onto each other, and a cell that lies in one line
vanishes between its neighbours.

Corners on upright edges of openings, dressed stones and wall ends slide along them; those on other such edges stay.
The coursing continuum follows the polygonal masonry of the Andes and the wall generators of Legakis, Dorsey & Gortler
(2001); nothing here claims to be new.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.geometry import Subdivision, dissolved, subdivide

__all__ = ["coursed", "free_corners"]

MARGIN = 0.1  # share of its first height over an edge that a corner keeps unless both end on one line
SAME = 1e-10  # of the pattern's width: corners on a line that are nearer than this are one
STAGGER = 0.15  # of a course's height: how far joints that would meet on a level bed are set off to each side
ROUNDS = 30  # of making corners give way; after that those in conflict stay where they were, which is always valid


@dataclass(frozen=True, slots=True, eq=False)
class _Heights:
    """Heights of corners over edges of the same cell (m of them), with their sign taken out."""

    corner: Ints  # (m,)
    first: Ints  # (m,) ends of the edge
    second: Ints  # (m,)
    share: Floats  # (m,) where along the edge, 0..1
    sign: Floats  # (m,) +1 where the corner lay above the edge, -1 below

    def of(self, v: Floats) -> Floats:
        """Heights (m) in the sense of the sign; all are positive in a valid pattern, (m,)."""
        edge = (1.0 - self.share) * v[self.first] + self.share * v[self.second]
        return self.sign * (v[self.corner] - edge)

    def level(self, aim: Floats, meets: Bools) -> Bools:
        """(m,) corner and edge end on one line, or the corner on the edge's end below or above it, if both may meet."""
        end = np.where(self.share == 0.0, self.first, np.where(self.share == 1.0, self.second, -1))
        one = (aim[self.corner] == aim[self.first]) & (aim[self.corner] == aim[self.second])
        both = (aim[self.corner] == aim[end]) & meets[self.corner] & meets[end]
        level: Bools = np.where(end >= 0, both, one)
        return level


def free_corners(subdivision: Subdivision, dressed: Bools) -> Bools:
    """Corners that coursing may move: (V,) bool.

    Parameters
    ----------
    subdivision : Subdivision
        The pattern.
    dressed : (n,) bool
        Cells that keep their shape.

    Notes
    -----
    A corner of field stones only is free. One on the outline or on a dressed stone is free if exactly two fixed edges
    meet there and both are upright: it slides.
    """
    side, edge, u = subdivision.side, subdivision.edge, subdivision.vertex[:, 0]
    fixed = (side < 0).any(axis=1) | dressed[side].any(axis=1)
    upright = u[edge[:, 0]] == u[edge[:, 1]]
    corners = len(subdivision.vertex)
    held = np.bincount(edge[fixed].ravel(), minlength=corners)
    tilted = np.bincount(edge[fixed & ~upright].ravel(), minlength=corners)
    field = np.bincount(edge[~fixed].ravel(), minlength=corners)
    free: Bools = (held == 0) | ((held == 2) & (tilted == 0) & (field > 0))
    return free


def coursed(subdivision: Subdivision, lines: Floats, coursing: float, dressed: Bools) -> Subdivision:
    """The pattern with its free corners moved towards their course lines.

    Parameters
    ----------
    subdivision : Subdivision
        A valid pattern.
    lines : (k,) float
        Heights of the course lines (m), rising.
    coursing : float
        0 = none .. 1 = level courses.
    dressed : (n,) bool
        Cells that keep their shape; see `free_corners` for which corners move.

    Returns
    -------
    Subdivision
        A valid pattern of the same area. At c = 1 a cell that lay between two lines' reach may have vanished.
    """
    free = free_corners(subdivision, dressed)
    if coursing == 0.0 or not free.any():
        return subdivision
    # a bed may run into the corner of a dressed stone, but not into that of the wall, where it would leave a wedge
    meets = free | (np.bincount(subdivision.index, dressed[subdivision.cell()], minlength=len(free)) > 0)
    start = subdivision.vertex[:, 1]
    heights = _heights(subdivision)
    aim = _aims(heights, start, lines, free, meets)
    v = _moved(heights, start, aim, coursing, free, meets)
    point = np.stack([subdivision.vertex[:, 0], v], 1)
    if coursing < 1.0:
        return Subdivision(point, subdivision.start, subdivision.index, subdivision.site)
    return _levelled(subdivision, point, lines, free)


def _heights(subdivision: Subdivision) -> _Heights:
    """Every corner against every edge of its cell that passes above or below it."""
    u, v = subdivision.vertex.T
    parts = [np.stack([p, a, b], 1) for p, a, b in _corner_edge_pairs(subdivision)]
    corner, first, second = np.concatenate(parts).T
    run = u[second] - u[first]
    flat = run != 0.0
    share = np.divide(u[corner] - u[first], run, out=np.zeros(len(run)), where=flat)
    over = (share >= 0.0) & (share <= 1.0) & flat
    upright = subdivision.edge[u[subdivision.edge[:, 0]] == u[subdivision.edge[:, 1]]]  # ends keep their order
    corner = np.concatenate([corner[over], upright[:, 0]])
    first = np.concatenate([first[over], upright[:, 1]])
    second = np.concatenate([second[over], upright[:, 1]])
    share = np.concatenate([share[over], np.zeros(len(upright))])
    height = v[corner] - (1.0 - share) * v[first] - share * v[second]
    return _Heights(corner, first, second, share, np.where(height > 0.0, 1.0, -1.0))


def _corner_edge_pairs(subdivision: Subdivision) -> Iterator[tuple[Ints, Ints, Ints]]:
    """Corners and the edges of the same cell that they are not ends of, cells of equal size together."""
    size = np.diff(subdivision.start)
    for k in np.unique(size):
        ring = subdivision.index[subdivision.start[:-1][size == k][:, None] + np.arange(k)]
        for step in range(1, k - 1):  # edge from the corner `step` further on, to the next
            yield ring.ravel(), np.roll(ring, -step, axis=1).ravel(), np.roll(ring, -step - 1, axis=1).ravel()


def _aims(heights: _Heights, start: Floats, lines: Floats, free: Bools, meets: Bools) -> Floats:
    """Height that each corner aims at: a course line, and its own height where it is not free."""
    nearest = np.clip(np.searchsorted((lines[1:] + lines[:-1]) / 2.0, start), 0, len(lines) - 1)
    other = np.clip(np.where(start > lines[nearest], nearest + 1, nearest - 1), 0, len(lines) - 1)
    extra = np.abs(start - lines[other]) - np.abs(start - lines[nearest])  # what the second choice costs (m)
    aim = np.where(free, lines[nearest], start)
    second = np.where(free, lines[other], start)
    open_ = free & (other != nearest)
    before = heights.of(start)
    who = np.stack([heights.corner, heights.first, heights.second], 1)
    wanted = heights.sign[:, None] * np.array([1.0, -1.0, -1.0])  # the direction in which each would help
    for _ in range(ROUNDS):
        bad = np.flatnonzero(~heights.level(aim, meets) & ~(heights.of(aim) >= MARGIN * before))
        three = who[bad]
        helps = open_[three] & (wanted[bad] * (second[three] - aim[three]) > 0.0)
        cost = np.where(helps, extra[three], np.inf)
        cheapest = cost.argmin(axis=1)
        can = np.isfinite(cost[np.arange(len(bad)), cheapest])
        if not can.any():
            break
        turn = np.unique(three[can, cheapest[can]])
        aim[turn], open_[turn] = second[turn], False
    return aim


def _moved(heights: _Heights, start: Floats, aim: Floats, coursing: float, free: Bools, meets: Bools) -> Floats:
    """Heights after the move; corners that would pass an edge go only as far as they and its ends can go together."""
    part = np.where(free, 1.0, 0.0)
    before = heights.of(start)
    full = (1.0 - coursing) * start + coursing * aim
    level = heights.level(aim, meets)
    who = np.stack([heights.corner, heights.first, heights.second], 1)
    for attempt in count():
        v = np.where(part == 1.0, full, start + part * (full - start))
        together = level & ((part[who] == 1.0) | ~free[who]).all(axis=1)
        bad = np.flatnonzero(~together & ~(heights.of(v) >= MARGIN * before * (1.0 - 1e-9)))
        if not bad.size:
            return v
        three = who[bad]
        common = np.where(free[three], part[three], 1.0).min(axis=1)
        if attempt == 0:  # as far as the height allows
            fall = np.maximum(before[bad] - heights.of(full)[bad], 1e-300)
            common = np.minimum(common, (1.0 - MARGIN) * before[bad] / fall)
        else:
            common = common / 2.0 if attempt < ROUNDS else 0.0 * common
        np.minimum.at(part, three.ravel(), np.repeat(common, 3))
    raise AssertionError("unreachable: corners that stay where they were violate nothing")


def _levelled(subdivision: Subdivision, point: Floats, lines: Floats, free: Bools) -> Subdivision:
    """Rings after corners have come to lie on lines: shared corners put in, edges walked both ways taken out."""
    same = _met(point, lines, free)
    on = np.unique(same[np.isin(point[same, 1], lines)])
    order = on[np.lexsort((point[on, 0], point[on, 1]))].tolist()  # corners on lines, line by line from the left
    rank = {k: i for i, k in enumerate(order)}
    height = point[:, 1].tolist()
    rings: list[list[int]] = []
    site: list[int] = []
    for ring, seed in zip(subdivision.rings(), subdivision.site.tolist(), strict=True):
        corners = same[ring].tolist()
        walk: list[int] = []
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            if a == b:
                continue
            walk.append(a)
            if height[a] == height[b] and a in rank:  # whatever lies on a level edge is a corner of it
                i, j = rank[a], rank[b]
                walk += order[i + 1 : j] if i < j else order[j + 1 : i][::-1]
        for loop in _loops(walk):
            rings.append(loop)
            site.append(seed)
    return _without_crossings(dissolved(subdivide(point, rings, site)), lines)


def _without_crossings(found: Subdivision, lines: Floats) -> Subdivision:
    """Joints that meet a level bed at one corner, set apart along it, so that no more than three stones meet."""
    left_out: set[int] = set()
    while True:
        trial, spread = _spread(found, lines, left_out)
        bad = _spoilt(trial, spread)
        if bad:
            left_out |= bad  # no room: these stay crossings
        elif len(trial.crossings()) < len(found.crossings()):
            found, left_out = trial, set()  # neighbours of those that moved get their turn
        else:
            return found


def _spread(found: Subdivision, lines: Floats, left_out: set[int]) -> tuple[Subdivision, dict[int, list[int]]]:
    """Crossings on course lines replaced by one corner for each joint; cells that touch each crossing replaced.

    A joint beside a dressed stone (site -1) stays where it is, and the others move away from it.
    """
    point, rings = found.vertex.tolist(), found.rings()
    cells: dict[int, list[int]] = {p: [] for p in found.crossings().tolist()}
    for c, ring in enumerate(rings):
        for p in cells.keys() & set(ring):
            cells[p].append(c)
    course = float(np.diff(lines).min())
    dressed = (found.side >= 0) & (found.site[found.side] < 0)
    held = set(map(tuple, found.edge[dressed.any(axis=1)].tolist()))
    spread: dict[int, list[int]] = {}
    taken: set[int] = set()
    for p in cells:
        u, v = point[p]
        here = [(rings[c], rings[c].index(p)) for c in cells[p]]
        near = sorted({ring[k % len(ring)] for ring, i in here for k in (i - 1, i + 1)})
        level = sorted((k for k in near if point[k][1] == v), key=lambda k: point[k][0])
        joint = [k for k in near if point[k][1] != v]
        if p in left_out or taken & {p, *level} or len(level) != 2 or len(joint) < 2 or v not in lines:
            continue
        room = min(u - point[level[0]][0], point[level[1]][0] - u)
        if not room > 0.0:
            continue
        # a joint that leans to the left goes to the left; side by side they get half the stagger each
        joint.sort(key=lambda k: (point[k][0] - u) / abs(point[k][1] - v))
        place = np.linspace(-1.0, 1.0, len(joint))
        fixed = [i for i, k in enumerate(joint) if (min(p, k), max(p, k)) in held]
        if len(fixed) > 1:
            continue
        place = (place - (place[fixed[0]] if fixed else 0.0)) * min(STAGGER * course, room / 3.0)
        new = list(range(len(point), len(point) + len(joint)))
        point += [[u + d, v] for d in place.tolist()]
        at = {level[0]: 0, level[1]: len(joint) - 1, **{k: i for i, k in enumerate(joint)}}
        for c, (ring, i) in zip(cells[p], here, strict=True):
            a, b = at[ring[i - 1]], at[ring[(i + 1) % len(ring)]]
            rings[c] = ring[:i] + (new[a : b + 1] if a <= b else new[b : a + 1][::-1]) + ring[i + 1 :]
        spread[p] = cells[p]
        taken |= {p, *near}
    return subdivide(point, rings, found.site), spread


def _spoilt(trial: Subdivision, spread: dict[int, list[int]]) -> set[int]:
    """Crossings next to a cell that is not simple or has lost its area."""
    import shapely

    near = sorted({c for cells in spread.values() for c in cells})
    polygon = [shapely.polygons(trial.ring(c)) for c in near]
    good = shapely.is_valid(polygon) & (trial.areas()[near] > 0.0)
    bad = {c for c, fine in zip(near, good, strict=True) if not fine}
    return {p for p, cells in spread.items() if bad & set(cells)}


def _met(point: Floats, lines: Floats, free: Bools) -> Ints:
    """For each corner the one that it has come to lie on, itself if none: corners on a line as good as in one place."""
    same = np.arange(len(point))
    on = np.flatnonzero(np.isin(point[:, 1], lines))
    on = on[np.lexsort((point[on, 0], point[on, 1]))]
    apart = (np.diff(point[on, 1]) != 0.0) | (np.diff(point[on, 0]) > SAME * np.ptp(point[:, 0]))
    group = np.concatenate([[0], np.cumsum(apart)])[: len(on)]
    order = np.lexsort((on, free[on], group))  # a corner that is fixed keeps its place
    first = on[order[np.unique(group[order], return_index=True)[1]]]
    same[on] = first[group]
    return same


def _loops(walk: list[int]) -> Iterator[list[int]]:
    """Simple loops of a closed walk that may pass a corner twice; a stretch walked out and straight back is none."""
    path: list[int] = []
    seen: dict[int, int] = {}
    for k in walk:
        if k in seen:
            loop = path[seen[k] :]
            if len(loop) >= 3:
                yield loop
            for gone in loop[1:]:
                del seen[gone]
            del path[seen[k] + 1 :]
        else:
            seen[k] = len(path)
            path.append(k)
    if len(path) >= 3:
        yield path
