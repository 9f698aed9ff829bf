"""The area that polygons of the plane have in common, without building what they have in common."""

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.geometry.packed import ragged_batches

__all__ = ["common_areas"]

UPRIGHT = 1e-150  # m: sides that run no further along x have nothing below them, and no slope


def common_areas(one: tuple[Floats, Ints, Ints], two: tuple[Floats, Ints, Ints]) -> Floats:
    """Area of polygon k of `one` and polygon k of `two` in common (m2), for all k.

    A polygon is the signed sum of the areas below its sides, down to a line below both polygons. So what two have in
    common is the signed sum, over a side of each, of the area below both: the integral of the lower of two straight
    lines. That is a continuous function of the corners. Nothing is decided, and sides that cross nearly at a corner or
    lie nearly on each other, which overlays of polygons have been seen to take wrongly, are like all others.

    Parameters
    ----------
    one, two : tuple
        Corners (c, 2) in m, ring after ring; the position of the next corner round the ring (c,); first corner of each
        polygon and one past the last (n + 1,). Holes run the other way round than what they are in.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> ring, start = np.array([1, 2, 3, 0]), np.array([0, 4])
    >>> common_areas((square, ring, start), (square + 1.0, ring, start)).tolist()
    [1.0]
    """
    count = len(one[2]) - 1
    if not count:
        return np.zeros(0)
    base = np.minimum(*(np.minimum.reduceat(xy[:, 1], start[:-1]) for xy, _, start in (one, two)))
    (low, high, at, slope, sign), other = (_sides(*side, base) for side in (one, two))
    polygon = np.repeat(np.arange(count), np.diff(one[2]))
    total = np.zeros(count)
    for entry, j in ragged_batches(two[2], polygon):
        left, right = np.maximum(low[entry], other[0][j]), np.minimum(high[entry], other[1][j])
        meet = np.flatnonzero((right > left) & (sign[entry] * other[4][j] != 0.0))
        i, j, left, right = entry[meet], j[meet], left[meet], right[meet]
        first, last = (at[i] + slope[i] * (x - low[i]) for x in (left, right))
        above, beyond = (other[2][j] + other[3][j] * (x - other[0][j]) for x in (left, right))
        lower = (right - left) * (0.5 * (first + last) + _below(above - first, beyond - last))
        total += np.bincount(polygon[i], sign[i] * other[4][j] * lower, count)
    return np.abs(total)


def _sides(xy: Floats, following: Ints, start: Ints, base: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Of each side: where it begins and ends, how high above the base it begins, its slope, and the sign it counts."""
    here = xy - np.stack([np.zeros(len(base)), base], 1)[np.repeat(np.arange(len(base)), np.diff(start))]
    there = here[following]
    run = there[:, 0] - here[:, 0]
    run = np.where(np.abs(run) > UPRIGHT, run, 0.0)
    begin = np.where((run >= 0.0)[:, None], here, there)
    slope = np.where(run == 0.0, 0.0, (there[:, 1] - here[:, 1]) / np.where(run == 0.0, 1.0, run))
    return begin[:, 0], begin[:, 0] + np.abs(run), begin[:, 1], slope, np.sign(run)


def _below(first: Floats, last: Floats) -> Floats:
    """Mean of min(0, d) where d runs straight from `first` to `last`."""
    down, up = np.minimum(first, 0.0) + np.minimum(last, 0.0), np.minimum(first, last)
    mixed = (first < 0.0) != (last < 0.0)
    whole = np.abs(first) + np.abs(last)
    return np.asarray(np.where(mixed & (whole > 0.0), -0.5 * up * up / np.where(whole > 0.0, whole, 1.0), 0.5 * down))
