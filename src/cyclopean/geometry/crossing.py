"""Does a triangle mesh cross itself?

Two triangles cross where each has corners on both sides of the other's plane and the two pieces that they cut out of
the line common to both planes overlap (Moeller 1997). Corners nearer to a plane than rounding count as on it, so three
cases of measure zero are looked at as well: an edge of the mesh that lies in a triangle while its two faces lie on
either side; and triangles in one plane that face the same way and overlap. Surfaces that merely touch do not cross.

>>> z = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [3, 3, 0]])
>>> crossing(z, np.array([[0, 1, 2], [3, 4, 5]])).tolist()
[1.25, 1.25, 0.0]
>>> crossing(z + [[0], [0], [0], [3], [3], [3]], np.array([[0, 1, 2], [3, 4, 5]])) is None
True
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.geometry.boxes import box_pairs
from cyclopean.geometry.frames import unit

__all__ = ["crossing"]

ON_PLANE = 1e-10  # of the mesh's diagonal: distances below it are rounding
OVERLAP = 1e-8  # of the diagonal: surfaces that have less than this length in common touch
NEEDLE = 1e-7  # of the diagonal: a triangle that is no higher has no plane; its neighbours tell


def crossing(vertices: Floats, triangles: Ints) -> Floats | None:
    """Find a point at which the surface crosses itself.

    Parameters
    ----------
    vertices : (v, 3) float
        m.
    triangles : (t, 3) int
        Faces that hang together name the same vertices.

    Returns
    -------
    (3,) float or None
        The middle of what the boxes of two crossing triangles have in common; None where nothing crosses.
    """
    pairs = _Pairs.of(vertices, triangles)
    for found in (_through(pairs), _folded_over(pairs), _along_edges(pairs)):
        if found.any():
            k = int(np.flatnonzero(found)[0])
            p, q = pairs.corner[pairs.a[k]], pairs.corner[pairs.b[k]]
            low, high = np.maximum(p.min(axis=0), q.min(axis=0)), np.minimum(p.max(axis=0), q.max(axis=0))
            return np.asarray((low + high) / 2.0)
    return None


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Triangles a[k] and b[k] whose boxes overlap and that have no edge in common (both ways round: k and k + n)."""

    triangles: Ints  # (t, 3)
    corner: Floats  # (t, 3, 3) m, about a point of the mesh
    normal: Floats  # (t, 3) unit
    a: Ints  # (k,)
    b: Ints  # (k,)
    height: Floats  # (k, 3) m: corners of a above the plane of b, exactly zero where that is rounding
    size: float  # m: diagonal of the mesh

    @classmethod
    def of(cls, vertices: Floats, triangles: Ints) -> "_Pairs":
        size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
        corner = vertices[triangles]
        side = corner - corner[:, [1, 2, 0]]
        normal = np.cross(side[:, 0], side[:, 1])
        area = np.linalg.norm(normal, axis=1)
        flat = np.flatnonzero(area > NEEDLE * size * np.linalg.norm(side, axis=2).max(axis=1))
        normal = unit(normal)
        i, j = box_pairs(corner[flat].min(axis=1), corner[flat].max(axis=1), 0.0)
        i, j = flat[i], flat[j]
        common = sum((triangles[i, m] == triangles[j, n]).astype(np.int64) for m in range(3) for n in range(3))
        apart = common < 2
        i, j = i[apart], j[apart]
        a, b = np.concatenate([i, j]), np.concatenate([j, i])
        height = np.einsum("kmi,ki->km", corner[a] - corner[b][:, :1], normal[b])
        height[~(np.abs(height) > ON_PLANE * size)] = 0.0
        return cls(triangles, corner, normal, a, b, height, size)


def _through(pairs: _Pairs) -> Bools:
    """(k,) whether the triangles pass through each other."""
    astride: Bools = np.logical_and((pairs.height > 0.0).any(axis=1), (pairs.height < 0.0).any(axis=1))
    found = np.zeros(len(astride), bool)
    half = len(astride) // 2
    here = np.flatnonzero(astride[:half] & astride[half:])
    if not len(here):
        return found
    there = here + half
    along = unit(np.cross(pairs.normal[pairs.a[here]], pairs.normal[pairs.b[here]]))
    origin = pairs.corner[pairs.a[here], :1]
    low, high = _on_line(pairs, here, along, origin)
    least, most = _on_line(pairs, there, along, origin)
    found[here] = np.minimum(high, most) - np.maximum(low, least) > OVERLAP * pairs.size
    return found


def _on_line(pairs: _Pairs, here: Ints, along: Floats, origin: Floats) -> tuple[Floats, Floats]:
    """Ends (k,) of what triangle a cuts out of the line common to both planes, as positions along it."""
    at = np.einsum("kmi,ki->km", pairs.corner[pairs.a[here]] - origin, along)
    h = pairs.height[here]
    ends = []
    for m, n in ((0, 1), (1, 2), (2, 0)):
        drop = h[:, m] - h[:, n]
        share = h[:, m] / np.where(drop == 0.0, 1.0, drop)
        ends.append(np.where(h[:, m] * h[:, n] < 0.0, at[:, m] + share * (at[:, n] - at[:, m]), np.nan))
        ends.append(np.where(h[:, m] == 0.0, at[:, m], np.nan))
    position = np.stack(ends, 1)
    return np.nanmin(position, axis=1), np.nanmax(position, axis=1)


def _folded_over(pairs: _Pairs) -> Bools:
    """(k,) whether the triangles lie in one plane, face the same way, and overlap."""
    same = (pairs.height == 0.0).all(axis=1)
    same &= np.einsum("ki,ki->k", pairs.normal[pairs.a], pairs.normal[pairs.b]) > 0.0
    found = np.zeros(len(same), bool)
    here = np.flatnonzero(same)
    p, q = pairs.corner[pairs.a[here]], pairs.corner[pairs.b[here]]
    overlap = np.ones(len(here), bool)
    for shape in (p, q):
        for m in range(3):
            side = shape[:, (m + 1) % 3] - shape[:, m]
            across = np.cross(pairs.normal[pairs.a[here]], side / np.linalg.norm(side, axis=1)[:, None])
            one, two = (np.einsum("kmi,ki->km", s - shape[:, m : m + 1], across) for s in (p, q))
            common = np.minimum(one.max(axis=1), two.max(axis=1)) - np.maximum(one.min(axis=1), two.min(axis=1))
            overlap &= common > OVERLAP * pairs.size
    found[here] = overlap
    return found


def _along_edges(pairs: _Pairs) -> Bools:
    """(k,) whether an edge of a lies in b, and its other face on the other side of b."""
    zero = pairs.height == 0.0
    found = np.zeros(len(zero), bool)
    here = np.flatnonzero(zero.sum(axis=1) == 2)
    if not len(here):
        return found
    off = np.argmin(zero[here], axis=1)
    ends = np.stack([(off + 1) % 3, (off + 2) % 3], 1)
    edge = np.sort(pairs.triangles[pairs.a[here][:, None], ends], axis=1)
    up = pairs.height[here, off] > 0.0
    key = np.column_stack([pairs.b[here], edge])
    _, number = np.unique(key, axis=0, return_inverse=True)
    number = number.reshape(-1)
    both = (np.bincount(number, up) > 0) & (np.bincount(number, ~up) > 0)
    inside = _length_inside(pairs, here, ends) > OVERLAP * pairs.size
    found[here] = both[number] & inside
    return found


def _length_inside(pairs: _Pairs, here: Ints, ends: Ints) -> Floats:
    """(k,) m: how much of the edge `ends` of a lies inside b, in whose plane it is."""
    corner, frame = pairs.corner[pairs.b[here]], pairs.normal[pairs.b[here]]
    tail, head = (pairs.corner[pairs.a[here], ends[:, m]] for m in (0, 1))
    first, last = np.zeros(len(here)), np.ones(len(here))
    for m in range(3):
        side = corner[:, (m + 1) % 3] - corner[:, m]
        inward = np.cross(frame, side / np.linalg.norm(side, axis=1)[:, None])
        start, stop = (np.einsum("ki,ki->k", x - corner[:, m], inward) - OVERLAP * pairs.size for x in (tail, head))
        rise = stop - start
        zero = -start / np.where(rise == 0.0, 1.0, rise)
        first = np.where(rise > 0.0, np.maximum(first, zero), first)
        last = np.where(rise < 0.0, np.minimum(last, zero), last)
        last = np.where((rise == 0.0) & (start < 0.0), -1.0, last)
    return np.asarray((last - first) * np.linalg.norm(head - tail, axis=1))
