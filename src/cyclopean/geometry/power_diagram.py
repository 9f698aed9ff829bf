"""Power diagram of weighted sites in a rectangle, by lifting to a convex hull.

A point x belongs to the site s of least power |x - s|^2 - w. Lifted to (s, |s|^2 - w), the sites whose cells are not
empty are the corners of the lower convex hull, and a facet with the plane z = 2 v.x + c stands for the diagram's
vertex v (Aurenhammer 1987). Eight far sites close the outer cells; then four half-planes cut the diagram to the
rectangle, each vertex being judged once and each crossing edge cut once, so that neighbours agree to the bit.

By hand: two sites a distance d apart have their border at d/2 + (w1 - w2) / (2 d) from the first.

>>> cells = power_diagram([[1.0, 0.5], [3.0, 0.5]], [1.0, 0.0], [0.0, 0.0], [4.0, 1.0])
>>> cells.areas().tolist()
[2.25, 1.75]
"""

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Bools, Floats, Ints, sealed
from cyclopean.errors import InputError, SolverError
from cyclopean.geometry.packed import components, following, offsets
from cyclopean.geometry.subdivision import Subdivision

__all__ = ["power_diagram"]

SAME = 1e-10  # of the rectangle's diagonal: vertices that are nearer to each other than this are one
COINCIDENT = 1e-9  # of the diagonal: sites that are nearer than this are one; the heavier one has the cell


def power_diagram(site: ArrayLike, weight: ArrayLike, low: ArrayLike, high: ArrayLike) -> Subdivision:
    """Cells of weighted sites, cut to the rectangle from `low` to `high`, which they cover exactly.

    Parameters
    ----------
    site : (n, 2) array_like
        m; sites outside the rectangle are allowed.
    weight : (n,) array_like
        m2; a heavier site has the larger cell.
    low, high : (2,) array_like
        Corners of the rectangle (m).

    Returns
    -------
    Subdivision
        Convex cells in the order of their sites. A site that is outweighed everywhere in the rectangle, or that
        coincides with a heavier (or earlier) one, has no cell.

    Raises
    ------
    InputError
        No site, a rectangle without area, or numbers that are not finite.
    SolverError
        The cells found do not cover the rectangle.

    Notes
    -----
    F. Aurenhammer, "Power diagrams: properties, algorithms and applications", SIAM J. Comput. 16 (1987).
    """
    low, high = sealed("low", low, 2), sealed("high", high, 2)
    site = sealed("site", site, None, 2)
    weight = sealed("weight", weight, len(site))
    if not len(site):
        raise InputError("site: a power diagram needs at least one site")
    if not (np.all(high > low)):
        raise InputError(f"high: the rectangle {low.tolist()} to {high.tolist()} has no area")
    size, centre = float(np.hypot(*(high - low))), (low + high) / 2.0
    x, w = (site - centre) / size, (weight - weight.max()) / size**2
    kept = np.flatnonzero(_in_play(x, w, (high - low) / (2.0 * size)) & ~_coincident(x, w))
    vertex, cell, index = _dual(x[kept], w[kept])
    vertex = vertex * size + centre
    for side in ((0, low[0], -1.0), (0, high[0], 1.0), (1, low[1], -1.0), (1, high[1], 1.0)):
        vertex, cell, index = _clipped(vertex, cell, index, side, SAME * size)
    touched = (vertex == low).sum(axis=1) + (vertex == high).sum(axis=1)
    cell, index = _welded(vertex, cell, index, touched, SAME * size)
    used, index = np.unique(index, return_inverse=True)
    held, count = np.unique(cell, return_counts=True)
    found = Subdivision(vertex[used], offsets(count), index, kept[held])
    whole = float(np.prod(high - low))
    if not (abs(float(found.areas().sum()) - whole) <= 1e-11 * whole and np.all(found.areas() > 0.0)):
        raise SolverError("power diagram: the cells do not cover the rectangle")
    return found


def _in_play(x: Floats, w: Floats, half: Floats) -> Bools:
    """Sites that the heaviest one does not outweigh everywhere: the difference of two powers is linear in x.

    Without this, one dominating site would push the far sites out so far that the rest drowns in rounding.
    """
    top = int(np.argmax(w))
    corner = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    own = ((corner[None] - x[:, None]) ** 2).sum(axis=2) - w[:, None]
    best = ((corner - x[top]) ** 2).sum(axis=1) - w[top]
    wins: Bools = (own < best).any(axis=1)
    wins[top] = True
    return wins


def _coincident(x: Floats, w: Floats) -> Bools:
    """Sites that lie on a heavier one, or on an earlier one of the same weight."""
    from scipy.spatial import cKDTree

    lost = np.zeros(len(x), bool)
    pair = cKDTree(x).query_pairs(COINCIDENT, output_type="ndarray")
    if len(pair):
        first, second = pair.min(axis=1), pair.max(axis=1)
        lost[np.where(w[first] >= w[second], second, first)] = True
    return lost


def _dual(x: Floats, w: Floats) -> tuple[Floats, Ints, Ints]:
    """Vertices, and the rings of all cells as sorted entries (cell, vertex), from the lower convex hull."""
    from scipy.spatial import ConvexHull

    n = len(x)
    far = 4.0 * max(1.0, float(np.abs(x).max())) + 3.0 * float(np.sqrt(np.ptp(w)))
    turn = np.arange(8) * (np.pi / 4.0) + 0.1  # off the axes: no far site lines up with a grid
    all_x = np.concatenate([x, far * np.stack([np.cos(turn), np.sin(turn)], 1)])
    all_w = np.concatenate([w, np.full(8, w.min())])
    hull = ConvexHull(np.column_stack([all_x, (all_x**2).sum(axis=1) - all_w]), qhull_options="Qt")
    lower = np.flatnonzero(hull.equations[:, 2] < -1e-9)
    plane = hull.equations[lower]
    vertex = -plane[:, :2] / (2.0 * plane[:, 2:3])
    number = np.full(len(hull.equations), -1)
    number[lower] = np.arange(len(lower))
    near = number[hull.neighbors[lower]]
    pair = np.stack([np.repeat(np.arange(len(lower)), 3), near.ravel()], 1)
    pair = pair[(pair[:, 0] < pair[:, 1])]
    short = np.hypot(*(vertex[pair[:, 0]] - vertex[pair[:, 1]]).T) <= SAME
    name = _representatives(len(vertex), pair[short], np.zeros(len(vertex), np.int64))
    cell, corner = hull.simplices[lower].ravel().astype(np.int64), np.repeat(name, 3)
    entry = np.unique(np.stack([cell, corner], 1)[cell < n], axis=0)
    cell, corner = entry[:, 0], entry[:, 1]
    count = np.maximum(np.bincount(cell, minlength=n), 1)
    mean = np.stack([np.bincount(cell, vertex[corner, k], minlength=n) for k in (0, 1)], 1) / count[:, None]
    arm = vertex[corner] - mean[cell]
    order = np.lexsort((np.arctan2(arm[:, 1], arm[:, 0]), cell))
    cell, corner = cell[order], corner[order]
    full = count[cell] >= 3
    return vertex, cell[full], corner[full]


def _clipped(
    vertex: Floats, cell: Ints, index: Ints, side: tuple[int, float, float], tolerance: float
) -> tuple[Floats, Ints, Ints]:
    """Cut all rings to sign (x[axis] - bound) <= 0 on one `side`; vertices within the tolerance are put onto it."""
    axis, bound, sign = side
    vertex = vertex.copy()
    beyond = sign * (vertex[:, axis] - bound)
    on = np.abs(beyond) <= tolerance
    vertex[on, axis], beyond[on] = bound, 0.0
    after = index[following(np.append(np.searchsorted(cell, np.unique(cell)), len(cell)))]
    cut = np.flatnonzero(beyond[index] * beyond[after] < 0.0)
    low, high = np.minimum(index[cut], after[cut]), np.maximum(index[cut], after[cut])
    key, number = np.unique(low * len(vertex) + high, return_inverse=True)
    a, b = key // len(vertex), key % len(vertex)
    share = (beyond[a] / (beyond[a] - beyond[b]))[:, None]
    fresh = vertex[a] + share * (vertex[b] - vertex[a])
    fresh[:, axis] = bound
    both = np.full((len(index), 2), -1, np.int64)
    inside = beyond[index] <= 0.0
    both[inside, 0] = index[inside]
    both[cut, 1] = len(vertex) + number
    proper = np.zeros(int(cell.max(initial=-1)) + 1, bool)  # a cell that only touches the line from outside is gone
    proper[cell[beyond[index] < 0.0]] = True
    keep = (both >= 0) & proper[cell][:, None]
    return np.concatenate([vertex, fresh]), np.repeat(cell, 2)[keep.ravel()], both.ravel()[keep.ravel()]


def _welded(vertex: Floats, cell: Ints, index: Ints, rank: Ints, tolerance: float) -> tuple[Ints, Ints]:
    """Rings in which vertices joined by an edge no longer than the tolerance are one: the one of highest rank."""
    after = index[following(np.append(np.searchsorted(cell, np.unique(cell)), len(cell)))]
    along = vertex[after] - vertex[index]
    short = np.hypot(along[:, 0], along[:, 1]) <= tolerance
    if not short.any():
        return cell, index
    name = _representatives(len(vertex), np.stack([index, after], 1)[short], rank)
    keep = ~short
    cell, index = cell[keep], name[index[keep]]
    full = np.bincount(cell, minlength=int(cell.max(initial=-1)) + 1)[cell] >= 3
    return cell[full], index[full]


def _representatives(count: int, pair: Ints, rank: Ints) -> Ints:
    """For each of `count` things the one of highest rank (the first of those) that pairs connect it with."""
    label = components(count, pair[:, 0], pair[:, 1])
    order = np.lexsort((np.arange(count), -rank, label))
    first = order[np.unique(label[order], return_index=True)[1]]
    name: Ints = first[label].astype(np.int64)
    return name
