"""Height maps: the under- and upper surface of a mesh over the middles of a grid's cells.

A cell counts as covered where its middle is; the corners of the mesh in it make its lowest and highest point exact
there. So plans are neither wider nor narrower than the meshes are, in the mean. What lies on a map is a draft: where
stones touch is found out on the exact meshes (`seating`).

By hand: a box of 2 x 1 x 3 covers two cells of width 1, from 0 to 3.

>>> from cyclopean.geometry.solids import CUBE
>>> corner = np.array([[x, y, z] for x in (0.0, 2.0) for y in (0.0, 1.0) for z in (0.0, 3.0)])
>>> box = np.array([t for a, b, c, d in CUBE for t in ((a, b, c), (a, c, d))])
>>> raster = lying_raster(corner, box, 1.0)
>>> raster.low.tolist(), raster.high.tolist()
([[0.0], [0.0]], [[3.0], [3.0]])
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.errors import InputError

__all__ = ["MOST_CELLS", "Raster", "lying_raster", "rasters"]

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


def rasters(points: Floats, triangles: Ints, cell: float, *, snapped: bool = False) -> list[Raster]:
    """Rasters of a mesh in several poses.

    Parameters
    ----------
    points : (r, v, 3) array
        Vertices in each pose (m).
    triangles : (t, 3) array
        Of a closed mesh.
    cell : float
        Width of a cell (m).
    snapped : bool
        Lines of the grid at multiples of `cell`; otherwise the grid lies about the middle of the mesh.

    Raises
    ------
    InputError
        The grid would have too many cells.
    """
    low, high = points[:, :, :2].min(axis=1) / cell, points[:, :, :2].max(axis=1) / cell
    if snapped:
        start = np.floor(low)
        count = np.maximum(np.ceil(high) - start, 1.0).astype(np.int64)
    else:
        count = np.maximum(np.ceil(high - low - 0.5), 1.0).astype(np.int64)
        start = (low + high - count) / 2.0
    w, d = (int(n) for n in count.max(axis=0, initial=1))
    if not len(points) * w * d <= MOST_CELLS:
        raise InputError(f"cell: {cell:g} m makes a grid of {len(points) * w * d:,} cells; use larger ones")
    place = np.concatenate([points[:, :, :2] / cell - start[:, None], points[:, :, 2:]], axis=2)
    lowest, highest = np.full((len(points), w, d), np.inf), np.full((len(points), w, d), -np.inf)
    at, z = _middles(place, triangles, (w, d))
    _extend(lowest, highest, at, z)
    at, z = _corners(place, (w, d))
    covered = lowest.reshape(-1)[at] < np.inf
    _extend(lowest, highest, at[covered], z[covered])
    return [
        Raster(lowest[k, : count[k, 0], : count[k, 1]], highest[k, : count[k, 0], : count[k, 1]], start[k] * cell)
        for k in range(len(points))
    ]


def lying_raster(vertices: Floats, triangles: Ints, cell: float) -> Raster:
    """Raster of a closed mesh (v, 3), (t, 3) where it lies, on the grid of the map."""
    return rasters(vertices[None], triangles, cell, snapped=True)[0]


def _extend(low: Floats, high: Floats, at: Ints, z: Floats) -> None:
    """Take points at heights z in cells `at`."""
    np.minimum.at(low.reshape(-1), at, z)
    np.maximum.at(high.reshape(-1), at, z)


def _corners(place: Floats, size: tuple[int, int]) -> tuple[Ints, Floats]:
    """Cell of each vertex inside the grid, and its height."""
    w, d = size
    cell = np.floor(place[:, :, :2]).astype(np.int64)
    inside = ((cell >= 0) & (cell < size)).all(axis=2)
    pose = np.broadcast_to(np.arange(len(place))[:, None], inside.shape)[inside]
    i, j = cell[inside].T
    return (pose * w + i) * d + j, place[:, :, 2][inside]


def _middles(place: Floats, triangles: Ints, size: tuple[int, int]) -> tuple[Ints, Floats]:
    """Cells whose middle lies under or over a triangle, and its height there."""
    w, d = size
    corner = place[:, triangles].reshape(-1, 3, 3)
    pose = np.repeat(np.arange(len(place)), len(triangles))
    flat = corner[:, :, :2] - 0.5
    first = np.ceil(flat.min(axis=1)).astype(np.int64)
    count = np.maximum(np.floor(flat.max(axis=1)).astype(np.int64) - first + 1, 0)
    e1, e2 = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    double = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    total = np.where(double != 0.0, count.prod(axis=1), 0)
    which = np.repeat(np.arange(len(total)), total)
    step = np.arange(len(which)) - np.repeat(np.cumsum(total) - total, total)
    x, y = first[which, 0] + step // count[which, 1], first[which, 1] + step % count[which, 1]
    dx, dy = x - flat[which, 0, 0], y - flat[which, 0, 1]
    s = (dx * e2[which, 1] - dy * e2[which, 0]) / double[which]
    t = (e1[which, 0] * dy - e1[which, 1] * dx) / double[which]
    inside = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & (x >= 0) & (x < w) & (y >= 0) & (y < d)
    x, y, which, s, t = x[inside], y[inside], which[inside], s[inside], t[inside]
    z = corner[which, 0, 2] + s * e1[which, 2] + t * e2[which, 2]
    return (pose[which] * w + x) * d + y, z
