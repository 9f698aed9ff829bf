"""How stones tip that are let go on a height map: many at once.

Let go where it touches first, a stone turns until it lies on three points: on that facet of the upper hull of what is
below, measured from its underside, that is under its centre of mass. With a motion a + b x + c y of its underside, x
and y from the centre of mass, that is

    minimise  a     subject to  a + b x + c y >= need  at every cell of its plan,   |b|, |c| <= steep,

where `need` is how far a cell of the map stands above the underside there. The dual simplex method does it, for all
stones at a time: the plane through three cells with the centre of mass in the triangle between them; the cell that
stands out of it farthest takes the place of one of them, so that the centre of mass stays in the triangle. Slopes are
limited by four more cells, far out.

By hand: a plank of three cells, let go on a peg at one end, tips until it meets the ground at the other.

>>> need, x, y = np.array([[[0.0], [-0.3], [-0.2]]]), np.array([[-1.0, 0.0, 1.0]]), np.zeros((1, 1))
>>> tipped(need, x, y, 0.5)[:, :2].round(6).tolist()
[[-0.1, -0.1]]
"""

import numpy as np

from cyclopean.arrays import Floats

__all__ = ["left_under", "tipped"]

FAR = 1e4  # times its extent from the centre of mass: where cells stand for limits of the slopes
LEVEL = 1e-9  # of its extent: what stands out by less does not
MOST = 60  # exchanges


def tipped(need: Floats, x: Floats, y: Floats, steep: float) -> Floats:
    """Motions of some stones.

    Parameters
    ----------
    need : (k, w, d) array
        How far each cell of the map stands above the underside (m); -inf outside a stone's plan.
    x, y : (k, w), (k, d) arrays
        Of the cells' middles, from the centres of mass (m).
    steep : float
        Slope that none tips beyond, along either axis.

    Returns
    -------
    (k, 3) array
        a (m), b, c. Of a stone that came to no end in `MOST` exchanges, twice as steep as any may be.
    """
    count, _, d = need.shape
    extent = np.abs(x).max(axis=1) + np.abs(y).max(axis=1)
    far = FAR * extent
    cell = np.argmax(need.reshape(count, -1), axis=1)
    every = np.arange(count)
    first = np.stack([x[every, cell // d], y[every, cell % d]], axis=1)  # (k, 2)
    against = -far[:, None] * np.where(first < 0.0, -1.0, 1.0)
    row = np.zeros((count, 3, 3))  # (1, x, y) of the three cells
    row[:, :, 0] = 1.0
    row[:, 0, 1:], row[:, 1, 1], row[:, 2, 2] = first, against[:, 0], against[:, 1]
    height = np.stack([need[every, cell // d, cell % d], -steep * far, -steep * far], axis=1)
    motion = np.tile([0.0, 2.0 * steep, 2.0 * steep], (count, 1))
    going = every
    for _ in range(MOST):
        inverse = np.linalg.inv(row[going])
        plane = np.einsum("kij,kj->ki", inverse, height[going])
        entering, over, level = _farthest(need[going], x[going], y[going], plane, far[going], steep)
        done = over <= LEVEL * extent[going]
        motion[going[done]] = plane[done]
        going, entering, level, inverse = (part[~done] for part in (going, entering, level, inverse))
        if not len(going):
            break
        share = np.einsum("ki,kij->kj", entering, inverse)
        ratio = np.where(share > 1e-12, np.maximum(inverse[:, 0], 0.0) / np.where(share > 1e-12, share, 1.0), np.inf)
        leaving = np.argmin(ratio, axis=1)
        row[going, leaving], height[going, leaving] = entering, level
    return motion


def _farthest(
    need: Floats, x: Floats, y: Floats, plane: Floats, far: Floats, steep: float
) -> tuple[Floats, Floats, Floats]:
    """The cell that stands out farthest, as a row (k, 3), by how much (k,), and what it needs (k,)."""
    count, _, d = need.shape
    every = np.arange(count)
    out = -left_under(need, x, y, plane).reshape(count, -1)
    cell = np.argmax(out, axis=1)
    over, level = out[every, cell], need[every, cell // d, cell % d]
    row = np.stack([np.ones(count), x[every, cell // d], y[every, cell % d]], axis=1)
    for axis in (1, 2):
        sign = np.where(plane[:, axis] > 0.0, -1.0, 1.0)
        beyond = far * (np.abs(plane[:, axis]) - steep) - plane[:, 0]
        limit = beyond > over
        over, level = np.where(limit, beyond, over), np.where(limit, -steep * far, level)
        row[limit, 1:] = 0.0
        row[limit, axis] = (sign * far)[limit]
    return row, over, level


def left_under(need: Floats, x: Floats, y: Floats, motion: Floats) -> Floats:
    """(k, w, d) gaps (m) that are left under stones after a motion; +inf outside their plans."""
    a, b, c = motion.T
    return np.asarray((a[:, None] + b[:, None] * x)[:, :, None] + (c[:, None] * y)[:, None, :] - need)
