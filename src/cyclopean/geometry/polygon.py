"""Polygons: convex hulls, triangles of simple ones, and as few convex pieces as can be.

For the last, ears are cut off, then pieces that make a convex one together are joined. Joining across the diagonals of
a triangulation gives at most four times the least number of pieces (Hertel and Mehlhorn 1983).

By hand: an L falls into two pieces, a cross into at most five.

>>> convex_pieces([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
[[1, 2, 3, 0], [5, 0, 3, 4]]
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.geometry.frames import cross_2d, newell_normals

__all__ = ["convex_hull", "convex_pieces", "ears", "triangulated"]

STRAIGHT = 1e-9  # of the squared size: twice the area of a corner's triangle below which the corner is straight


def convex_hull(point: Floats) -> Floats:
    """Corners (h, 2) of the convex hull of points (k, 2), counter-clockwise (Andrew 1979); in a line the two ends."""
    ordered = sorted({(x, y) for x, y in point.tolist()})
    halves: list[tuple[float, float]] = []
    for run in (ordered, ordered[::-1]):
        chain: list[tuple[float, float]] = []
        for p in run:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 0.0:
                chain.pop()
            chain.append(p)
        halves += chain[:-1]
    return np.array(halves or ordered)


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def triangulated(points: Floats) -> Ints | None:
    """Triangles (k - 2, 3) of a polygon (k, 3) that is about flat, seen along its normal.

    None where an ear is missing, as in a polygon that crosses itself.
    """
    local = points - points[0]
    normal = newell_normals(local, np.array([0, len(local)]))[0]
    u = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    found = ears(np.stack([local @ u, local @ np.cross(normal, u)], 1), range(len(points)), forced=False)
    return np.array(found, np.int64) if found else None


def convex_pieces(ring: ArrayLike, slack: float = STRAIGHT) -> list[list[int]]:
    """Convex pieces of a simple polygon.

    Parameters
    ----------
    ring : (k, 2) array_like
        Corners, counter-clockwise.
    slack : float
        How far a corner may be reflex and pass for straight: twice the area of its triangle over the squared size.

    Returns
    -------
    list of list of int
        Corners of each piece, counter-clockwise; straight corners may be among them.
    """
    point = sealed("ring", ring, None, 2)
    least = -slack * float(np.ptp(point, axis=0).max(initial=0.0)) ** 2
    whole = list(range(len(point)))
    if _convex(point, whole, least):
        return [whole]
    reflex = sum(not _convex(point, [whole[k - 1], k, (k + 1) % len(whole)], least) for k in whole)
    best: list[list[int]] = []
    for start in whole:  # where one begins to cut decides how well the pieces join
        pieces = _joined(point, [list(ear) for ear in ears(point, whole[start:] + whole[:start])], least)
        if not best or len(pieces) < len(best):
            best = pieces
        if len(best) <= 1 + (reflex + 1) // 2:
            break  # a diagonal mends two corners at most
    return best


def _joined(point: Floats, pieces: list[list[int]], least: float) -> list[list[int]]:
    """Each piece takes in what it can, until nothing joins it any more."""
    k = 0
    while k < len(pieces):
        joined = next((both for both in _joints(pieces, k) if _convex(point, both[1], least)), None)
        if joined is None:
            k += 1
        else:
            pieces[k] = joined[1]
            del pieces[joined[0]]
            k -= int(joined[0] < k)
    return pieces


def _joints(pieces: list[list[int]], k: int) -> list[tuple[int, list[int]]]:
    """Every other piece that shares an edge with piece k, and the two as one ring."""
    mine = pieces[k]
    found = []
    for other, ring in enumerate(pieces):
        if other == k:
            continue
        for i, a in enumerate(mine):
            b = mine[(i + 1) % len(mine)]
            if b in ring and ring[(ring.index(b) + 1) % len(ring)] == a:
                start = ring.index(a)
                rest = ring[start:] + ring[:start]  # from a round to b
                found.append((other, mine[: i + 1] + rest[1:-1] + mine[i + 1 :]))
                break
    return found


def _convex(point: Floats, ring: list[int], least: float) -> bool:
    at = point[ring]
    ahead = np.roll(at, -1, axis=0) - at
    behind = np.roll(ahead, 1, axis=0)
    return bool((behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0] >= least).all())


def ears(point: Floats, ring: Sequence[int], *, forced: bool = True) -> list[tuple[int, int, int]]:
    """Triangles of a simple, counter-clockwise polygon through some of points (n, 2); the roundest ear goes first.

    Where none is an ear, as rounding may have it, the roundest corner counts as one if `forced`; otherwise there are no
    triangles.
    """
    left = list(ring)
    found = []
    while len(left) > 3:
        before, after = np.roll(left, 1), np.roll(left, -1)
        a, b, c = point[before], point[left], point[after]
        sides = ((b - a) ** 2).sum(1) + ((c - b) ** 2).sum(1) + ((a - c) ** 2).sum(1)
        order = np.argsort(-cross_2d(b - a, c - a) / np.where(sides > 0.0, sides, 1.0), kind="stable").tolist()
        where = next((i for i in order if _is_ear(point, left, i)), order[0] if forced else None)
        if where is None:
            return []
        found.append((int(before[where]), left[where], int(after[where])))
        del left[where]
    return [*found, (left[0], left[1], left[2])]


def _is_ear(point: Floats, left: list[int], i: int) -> bool:
    """Whether no other corner lies in the triangle at corner i, its border included."""
    corner = (left[i - 1], left[i], left[(i + 1) % len(left)])
    a, b, c = point[list(corner)]
    others = point[[k for k in left if k not in corner]]
    if not float(cross_2d(b - a, c - a)) > 0.0:
        return False
    sides = ((a, b), (b, c), (c, a))
    within = np.logical_and.reduce([cross_2d(head - tail, others - tail) >= 0.0 for tail, head in sides])
    return not bool(within.any())
