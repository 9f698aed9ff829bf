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

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.walls.net import SHORT, Net, Point, net_of
from cyclopean.geometry import Subdivision, dissolved, subdivide

__all__ = ["SHORT", "without_short_joints"]

APART = (1.5, 1.01)  # of the short length: what an edge is stretched to, the first that fits
ROUNDS = 6  # of looking at all short edges; one change can make room for another


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
        along = (found.vertex[found.edge[:, 1]] - found.vertex[found.edge[:, 0]]) / spacing
        length = np.hypot(along[:, 0], along[:, 1])
        some = np.flatnonzero(length < SHORT)
        near = found.edge[some[np.argsort(length[some], kind="stable")]].tolist()  # the shortest first
        net = net_of(found, spacing, least) if near else None
        if net is None or not sum(_mended(net, a, b) for a, b in near if a in net.cells and b in net.cells):
            break
        found = dissolved(subdivide(net.point, net.rings, found.site))
    return found


def _mended(net: Net, a: int, b: int) -> bool:
    """Try the changes in turn; whether one was made."""
    if b not in net.around(a) or not net.length(a, b) < SHORT:
        return False
    corner_of_outline = any(p in net.outline and net.slide.get(p, ()) is None for p in (a, b))
    ways = [_merged, _parted]
    if corner_of_outline:  # a joint that ran into it would leave a wedge on one side
        ways.reverse()
    return any(way(net, a, b) for way in ways)


def _merged(net: Net, a: int, b: int) -> bool:
    """Make the ends one corner, if no more than three regions meet there."""
    if len(net.cells[a] | net.cells[b]) > 3:
        return False
    fixed = [p for p in (a, b) if p in net.slide]
    stays = [p for p in fixed if net.slide[p] is None]
    if len(stays) == 2 or (len(fixed) == 2 and not stays):
        return False
    keep = (stays or fixed or [max((a, b), key=lambda p: len(net.cells[p]))])[0]
    gone = b if keep == a else a
    if gone in net.slide and not net.on_side(gone, keep):
        return False
    touched = sorted((net.cells[a] | net.cells[b]) - {-1})
    before = {c: (net.rings[c], net.thinness(c)) for c in touched}
    whole = sum(map(net.area, touched))
    for c in touched:
        ring = [keep if k == gone else k for k in net.rings[c]]
        net.rings[c] = [k for k, after in zip(ring, ring[1:] + ring[:1], strict=True) if k != after]
    simple = all(len(set(net.rings[c])) == len(net.rings[c]) for c in touched)
    if not (simple and net.covers(touched, whole) and all(net.is_good(c, before[c][1]) for c in touched)):
        for c in touched:
            net.rings[c] = before[c][0]
        return False
    net.cells[keep] |= net.cells.pop(gone)
    return True


def _parted(net: Net, a: int, b: int) -> bool:
    """Move the ends apart, as far as they are free to go."""
    touched = sorted((net.cells[a] | net.cells[b]) - {-1})
    thin, whole = {c: net.thinness(c) for c in touched}, sum(map(net.area, touched))
    old = net.point[a], net.point[b]
    short = net.short_edges(a, b)
    for new in _stretched(net, a, b):
        net.point[a], net.point[b] = new
        if not net.length(a, b) < SHORT and net.short_edges(a, b) < short:
            if net.covers(touched, whole) and all(net.is_good(c, thin[c]) for c in touched):
                return True
        net.point[a], net.point[b] = old
    return False


def _stretched(net: Net, a: int, b: int) -> Iterator[tuple[Point, Point]]:
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


def _moved(net: Net, p: int, way: Point, far: float) -> Point:
    """Place of a corner after it has gone `far` (spacings) along a direction, as far as its side allows."""
    x, y = net.point[p]
    if p in net.slide:
        side = net.slide[p]
        if side is None:
            return x, y
        far *= way[0] * side[0] + way[1] * side[1]
        way = side
    return x + far * way[0] * net.spacing[0], y + far * way[1] * net.spacing[1]
