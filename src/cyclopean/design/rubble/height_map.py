"""Height maps: the under- and upper surface of a mesh over a grid, and where it comes to rest on another one.

In every cell a raster holds the lowest and the highest point that the surface has over that cell. Over a cell, a plane
triangle is extreme at a corner of what the cell cuts out of it, and such a corner is one of three things: a corner of
the triangle, a point where one of its edges crosses a line of the grid, or a corner of the cell inside the triangle.
All of these are taken, so a raster is exact, whatever the sizes of triangles and cells.

A stone dropped onto a map of heights m comes to rest, at a shift by whole cells, at

    z = max over its cells of (m - low),

and nothing of it is then lower than anything below: the map is never lower than what it stands for, the stone never
lower than `low`. It may be left a little high, by what the surfaces rise and fall within one cell.

By hand: a box of 2 x 1 cells and height 3 has low 0 and high 3 in two cells; on a map (0, 1, 0) it rests at 1 over the
first two cells; a stone that is hollow by 1 over the second one rests there at 0.

>>> import numpy as np
>>> rest, gap = rest_heights(np.array([[0.0], [1.0], [0.0]]), np.array([[0.0], [0.0]]), 9.0)
>>> rest.ravel().tolist(), gap.ravel().tolist()
([1.0, 1.0], [0.5, 0.5])
>>> rest_heights(np.array([[0.0], [1.0], [0.0]]), np.array([[0.0], [1.0]]), 9.0)[0].ravel().tolist()
[0.0, 1.0]
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.errors import InputError

__all__ = ["MOST_CELLS", "Raster", "edges_of", "lying_raster", "rasters", "rest_heights"]

INSET = 1e-7  # share by which a mesh is narrowed, so that a side in a line of the grid does not cover the next cell
SLIVER = 1e-6  # of a cell: a mesh that reaches no farther into one does not cover it
MOST_CELLS = 4_000_000  # of all rasters made together


@dataclass(frozen=True, slots=True, eq=False)
class Raster:
    """Lowest and highest point of a surface over each cell of a grid; w x d cells."""

    low: Floats  # (w, d) m; +inf where there is nothing
    high: Floats  # (w, d) m; -inf where there is nothing
    corner: Floats  # (2,) m: x and y of the outer corner of cell (0, 0)

    @property
    def covered(self) -> int:
        """Number of cells with something in them."""
        return int(np.count_nonzero(self.low < np.inf))


def edges_of(triangles: Ints) -> Ints:
    """Edges (e, 2) of a closed mesh, each once: its two triangles run along it in opposite directions."""
    tail, head = triangles.reshape(-1), triangles[:, [1, 2, 0]].reshape(-1)
    return np.column_stack([tail, head])[tail < head]


def rasters(points: Floats, triangles: Ints, edges: Ints, cell: float, *, snapped: bool = False) -> list[Raster]:
    """Rasters of a mesh in several poses.

    Parameters
    ----------
    points : (r, v, 3) array
        Vertices in each pose (m).
    triangles : (t, 3) array
        Of a closed mesh.
    edges : (e, 2) array
        Its edges, `edges_of`.
    cell : float
        Width of a cell (m).
    snapped : bool
        Lines of the grid at multiples of `cell`; otherwise the first ones bound the mesh, in each pose anew.

    Raises
    ------
    InputError
        The grid would have too many cells.
    """
    low, high = points[:, :, :2].min(axis=1), points[:, :, :2].max(axis=1)
    spread = (high - low) * (1.0 - INSET)
    first = (low + high - spread) / 2.0 / cell
    start = np.floor(first + SLIVER) if snapped else first  # (r, 2) in cells
    count = np.maximum(np.ceil((low + high + spread) / 2.0 / cell - start - SLIVER).astype(np.int64), 1)
    w, d = (int(n) for n in count.max(axis=0, initial=1))
    if not len(points) * w * d <= MOST_CELLS:
        raise InputError(f"cell: {cell:g} m makes a grid of {len(points) * w * d:,} cells; use larger ones")
    middle = (low + high) / 2.0
    flat = (middle[:, None] + (points[:, :, :2] - middle[:, None]) * (1.0 - INSET)) / cell - start[:, None]
    place = np.concatenate([flat, points[:, :, 2:]], axis=2)
    found = _Extremes(len(points), w, d)
    _corners(found, place)
    for axis in (0, 1):
        _crossings(found, place, edges, axis)
    _inner(found, place, triangles)
    return [
        Raster(found.low[k, : count[k, 0], : count[k, 1]], found.high[k, : count[k, 0], : count[k, 1]], start[k] * cell)
        for k in range(len(points))
    ]


def lying_raster(vertices: Floats, triangles: Ints, cell: float) -> Raster:
    """Raster of a closed mesh (v, 3), (t, 3) where it lies, on the grid of the map."""
    return rasters(vertices[None], triangles, edges_of(triangles), cell, snapped=True)[0]


class _Extremes:
    """Running extremes of the cells of r grids."""

    def __init__(self, r: int, w: int, d: int) -> None:
        self.shape = (r, w, d)
        self.low = np.full(self.shape, np.inf)
        self.high = np.full(self.shape, -np.inf)

    def take(self, pose: Ints, i: Ints, j: Ints, z: Floats) -> None:
        """Points at height z in cells (i, j); what lies outside is dropped."""
        _, w, d = self.shape
        inside = (i >= 0) & (i < w) & (j >= 0) & (j < d)
        at = ((pose * w + i) * d + j)[inside]
        np.minimum.at(self.low.reshape(-1), at, z[inside])
        np.maximum.at(self.high.reshape(-1), at, z[inside])


def _both(value: Floats) -> tuple[Ints, Ints]:
    """Cells that a coordinate lies in: two, on a line of the grid."""
    return np.floor(value).astype(np.int64), np.ceil(value).astype(np.int64) - 1


def _corners(found: _Extremes, place: Floats) -> None:
    """Corners of triangles."""
    r, v, _ = place.shape
    pose = np.repeat(np.arange(r), v)
    x, y, z = place.reshape(-1, 3).T
    (i, i_too), (j, j_too) = _both(x), _both(y)
    found.take(pose, i, j, z)
    line = np.flatnonzero((i != i_too) | (j != j_too))
    for a, b in ((i_too, j), (i, j_too), (i_too, j_too)):
        found.take(pose[line], a[line], b[line], z[line])


def _crossings(found: _Extremes, place: Floats, edges: Ints, axis: int) -> None:
    """Points where edges cross the lines of the grid that stand across an axis."""
    other = 1 - axis
    one, two = place[:, edges[:, 0]].reshape(-1, 3), place[:, edges[:, 1]].reshape(-1, 3)
    pose = np.repeat(np.arange(len(place)), len(edges))
    a, b = one[:, axis], two[:, axis]
    first = np.ceil(np.minimum(a, b)).astype(np.int64)
    count = np.floor(np.maximum(a, b)).astype(np.int64) - first + 1
    count[a == b] = 0  # an edge along the line: its ends are corners
    which, step = _expanded(count)
    line = first[which] + step
    share = (line - a[which]) / (b - a)[which]
    across = one[which, other] + share * (two[which, other] - one[which, other])
    z = one[which, 2] + share * (two[which, 2] - one[which, 2])
    cell, cell_too = _both(across)
    rows = pose[which]
    twice = np.flatnonzero(cell != cell_too)
    for side in (line - 1, line):
        for k, ids in ((cell, slice(None)), (cell_too, twice)):
            i, j = (side, k) if axis == 0 else (k, side)
            found.take(rows[ids], i[ids], j[ids], z[ids])


def _inner(found: _Extremes, place: Floats, triangles: Ints) -> None:
    """Corners of cells inside triangles."""
    r, _, _ = place.shape
    corner = place[:, triangles].reshape(-1, 3, 3)
    pose = np.repeat(np.arange(r), len(triangles))
    first = np.ceil(corner[:, :, :2].min(axis=1)).astype(np.int64)
    count = np.floor(corner[:, :, :2].max(axis=1)).astype(np.int64) - first + 1
    e1, e2 = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    double = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    total = np.where(double != 0.0, np.maximum(count, 0).prod(axis=1), 0)
    which, step = _expanded(total)
    x = first[which, 0] + step // count[which, 1]
    y = first[which, 1] + step % count[which, 1]
    dx, dy = x - corner[which, 0, 0], y - corner[which, 0, 1]
    s = (dx * e2[which, 1] - dy * e2[which, 0]) / double[which]
    t = (e1[which, 0] * dy - e1[which, 1] * dx) / double[which]
    inside = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0)
    x, y, which, s, t = x[inside], y[inside], which[inside], s[inside], t[inside]
    z = corner[which, 0, 2] + s * e1[which, 2] + t * e2[which, 2]
    for i in (x - 1, x):
        for j in (y - 1, y):
            found.take(pose[which], i, j, z)


def _expanded(count: Ints) -> tuple[Ints, Ints]:
    """For each item, `count` of it one after the other: which item, and the how-manyeth of it."""
    count = np.maximum(count, 0)
    which = np.repeat(np.arange(len(count)), count)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)


def rest_heights(ground: Floats, low: Floats, most: float) -> tuple[Floats, Floats]:
    """Where a surface comes to rest on a map, at every shift by whole cells; in single precision.

    Parameters
    ----------
    ground : (n, m) array
        Heights of the map (m).
    low : (w, d) array
        Underside of what is dropped; +inf where there is nothing.
    most : float
        A gap under it is counted for no more than that (m).

    Returns
    -------
    rest : (n - w + 1, m - d + 1) array
        By how much it is raised (m).
    gap : array of the same shape
        Mean gap (m) that is then left under it.
    """
    shape = (ground.shape[1] - low.shape[1] + 1, ground.shape[0] - low.shape[0] + 1)
    under = low.T.astype(np.float32)
    # x comes last, so that what runs in one sweep is as long as can be
    view = np.lib.stride_tricks.sliding_window_view(np.ascontiguousarray(ground.T, np.float32), shape)
    space = (under[:, :, None, None] - view).reshape(under.size, -1)
    nearest = space.min(axis=0)
    np.minimum(space, nearest + np.float32(most), out=space)
    share = (under < np.inf).ravel().astype(np.float32) / np.float32(np.count_nonzero(under < np.inf))
    gap = share @ space - nearest
    return (np.float32(0.0) - nearest).reshape(shape).T.astype(float), gap.reshape(shape).T.astype(float)
