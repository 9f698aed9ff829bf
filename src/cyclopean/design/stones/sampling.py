"""Points evenly spread in the inside of stones, to rank placements with: how many lie in a cell says what is shared.

A stone is cut into columns along its shortest axis: one for each square of a grid over its outline, placed within the
square so that no two share a row or column of the finer grid (Chiu, Shirley and Wang 1994, multi-jittered). Where a
column enters and leaves the stone is exact, from the triangles that it crosses. Then the k-th point of a Sobol'
sequence in the unit cube is carried over by the conditional distributions of the columns' lengths (Rosenblatt 1952):
first x, then y, then the depth in the column. So every point stands for the same volume, any first few points are
evenly spread too, and the points follow the body: neither the stone's frame nor its triangulation counts.

By hand: half of the points of a box lie before its middle plane, and of an L of two arms with volumes 2 and 1, two
thirds lie in the first.
"""

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from cyclopean.arrays import Floats, Ints
from cyclopean.design.stones.stone import Stone, in_body_frame
from cyclopean.errors import InputError

__all__ = ["body_points"]

SIDE = 64  # columns along each side of a stone's outline; a power of two, for the bit reversal
BITS = 32  # of the numbers of the Sobol' sequence
# Bits by which the sequence is shifted (a digital shift keeps it a net): a third of any step. Its first 2^m points,
# which begin at 0, would lean to one side by half a step, and this leaves a sixth.
SHIFT = (0x55555555, 0xAAAAAAAA, 0x55555555)
# Of the columns in the squares of the finer grid, without common measure: an edge or a diagonal of a regular body then
# meets no column. On one that met many, both the way in and the way out would be missed.
OFFSET = (math.sqrt(0.5), (math.sqrt(5.0) - 1.0) / 2.0)


def body_points(stones: Sequence[Stone], count: int = 1024) -> NDArray[np.float32]:
    """Spread points in each stone, each of which stands for volume / count.

    Parameters
    ----------
    stones : sequence of Stone
        Of any closed shape.
    count : int
        Points of each stone. The first of a larger count are those of a smaller one.

    Returns
    -------
    (n, count, 3) float32
        m, in the body frame of each stone; inside it, up to rounding.

    Raises
    ------
    InputError
        No points are asked for, or a stone is too thin for any column to meet it.
    """
    if count < 1:
        raise InputError(f"points: {count} of them; ask for at least 1")
    spread = _sobol(count)
    points = np.zeros((len(stones), count, 3), np.float32)
    for k, stone in enumerate(stones):
        points[k] = _spread(stone, spread)
    return points


def _spread(stone: Stone, unit: Floats) -> Floats:
    """Carry points (n, 3) of the unit cube into a stone, volume to volume."""
    place, low, high = _intervals(in_body_frame(stone), stone.triangles)
    if not len(place):
        raise InputError(f"stone '{stone.id}': is too thin to be sampled; is its mesh closed?")
    total = np.concatenate([[0.0], np.cumsum(high - low)])
    first = np.searchsorted(place[:, 0], np.arange(SIDE + 1))  # intervals of each strip of equal i
    strip = total[first]  # volume before each strip
    share = unit[:, 0] * total[-1]
    i = np.clip(np.searchsorted(strip, share, side="right") - 1, 0, SIDE - 1)
    share = strip[i] + unit[:, 1] * (strip[i + 1] - strip[i])
    k = np.clip(np.searchsorted(total, share, side="right") - 1, 0, len(place) - 1)
    return np.column_stack([place[k, 1:], low[k] + unit[:, 2] * (high[k] - low[k])])


def _intervals(vertices: Floats, triangles: Ints) -> tuple[Floats, Floats, Floats]:
    """Find what of each column lies in the body.

    Returns
    -------
    place : (k, 3) strip i of the column, and its x and y; sorted by strip, then along y
    low, high : (k,) z where it enters and where it leaves
    """
    column, z = _crossings(vertices, triangles)
    order = np.lexsort((z, column))
    column, z = column[order], z[order]
    crossings = np.bincount(column, minlength=SIDE * SIDE)
    # A column that meets a corner or an edge to the last bit misses it, and has an odd number left: leave it out.
    whole = crossings[column] % 2 == 0
    column, z = column[whole][::2], z[whole]
    i, j = np.divmod(column, SIDE)
    x, y = _columns(vertices)
    return np.column_stack([i, x[i, j], y[i, j]]), z[::2], z[1::2]


def _crossings(vertices: Floats, triangles: Ints) -> tuple[Ints, Floats]:
    """Column (c,) and height (c,) of every crossing of a column with a triangle."""
    corner = vertices[triangles]  # (t, 3, 3)
    foot, size = vertices[:, :2].min(axis=0), np.ptp(vertices[:, :2], axis=0)
    cell = (corner[..., :2] - foot) * (SIDE / size)
    first = np.minimum(cell.min(axis=1).astype(np.int64), SIDE - 1)
    extent = np.minimum(cell.max(axis=1).astype(np.int64), SIDE - 1) - first + 1
    pairs = extent[:, 0] * extent[:, 1]
    before = np.cumsum(pairs) - pairs
    down, across = np.divmod(np.arange(pairs.sum()) - np.repeat(before, pairs), np.repeat(extent[:, 1], pairs))
    column = (down + np.repeat(first[:, 0], pairs)) * SIDE + across + np.repeat(first[:, 1], pairs)
    x, y = (line.ravel()[column] for line in _columns(vertices))
    area = [_areas(corner[:, k, :2], corner[:, (k + 1) % 3, :2], x, y, pairs) for k in range(3)]
    hit = np.flatnonzero((np.minimum.reduce(area) > 0.0) | (np.maximum.reduce(area) < 0.0))
    opposite = np.stack([area[1][hit], area[2][hit], area[0][hit]])  # to corners 0, 1 and 2
    z = corner[np.searchsorted(before, hit, side="right") - 1, :, 2].T
    return column[hit], (opposite * z).sum(axis=0) / opposite.sum(axis=0)


def _areas(a: Floats, b: Floats, x: Floats, y: Floats, pairs: Ints) -> Floats:
    """Twice the signed areas of the triangles (a, b, foot of the column), for all columns near each edge.

    They change sign, to the bit, when a and b change places: two triangles that share an edge agree on the side on
    which a column passes it.
    """
    constant = np.repeat(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], pairs)
    return constant + np.repeat(a[:, 1] - b[:, 1], pairs) * x + np.repeat(b[:, 0] - a[:, 0], pairs) * y


def _columns(vertices: Floats) -> tuple[Floats, Floats]:
    """X and y (SIDE, SIDE) of the columns over the outline of a body."""
    foot, size = vertices[:, :2].min(axis=0), np.ptp(vertices[:, :2], axis=0)
    x, y = _unit_columns()
    return foot[0] + x * size[0], foot[1] + y * size[1]


@cache
def _unit_columns() -> tuple[Floats, Floats]:
    """The columns over the unit square, one in each square of the grid."""
    reversed_bits = _reversed(np.arange(SIDE, dtype=np.uint64), SIDE.bit_length() - 1)
    step = np.arange(SIDE)
    x = step[:, None] + (reversed_bits + OFFSET[0])[None, :] / SIDE
    y = step[None, :] + (reversed_bits + OFFSET[1])[:, None] / SIDE
    return x / SIDE, y / SIDE


@cache
def _sobol(count: int) -> Floats:
    """The first points (count, 3) of the shifted Sobol' sequence, in the unit cube."""
    index = np.arange(count, dtype=np.uint64)
    point = np.zeros((count, 3), np.uint64)
    for axis, (value, directions) in enumerate(zip(SHIFT, _directions(), strict=True)):
        point[:, axis] = value
        for bit, direction in enumerate(directions):
            point[(index >> np.uint64(bit)) & np.uint64(1) == 1, axis] ^= np.uint64(direction)
    spread: Floats = (point.astype(np.float64) + 0.5) / 2.0**BITS
    spread.flags.writeable = False
    return spread


def _directions() -> tuple[list[int], list[int], list[int]]:
    """Direction numbers of Joe and Kuo (2008) in three dimensions, as integers of `BITS` bits."""
    corput = [1 << (BITS - 1 - k) for k in range(BITS)]
    second, third = corput[:1], [corput[0], 3 * corput[1]]
    for _ in range(1, BITS):
        second.append(second[-1] ^ second[-1] >> 1)  # of x + 1
    for _ in range(2, BITS):
        third.append(third[-1] ^ third[-2] ^ third[-2] >> 2)  # of x2 + x + 1
    return corput, second, third


def _reversed(number: NDArray[np.uint64], bits: int) -> NDArray[np.uint64]:
    """The numbers with their bits in the opposite order."""
    turned = np.zeros_like(number)
    for bit in range(bits):
        turned |= ((number >> np.uint64(bit)) & np.uint64(1)) << np.uint64(bits - 1 - bit)
    return turned
