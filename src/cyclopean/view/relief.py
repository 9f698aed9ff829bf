"""What is seen of many stones from one side, pixel by pixel: a depth buffer; where each ends; and the shade of hollows.

Coordinates are pixels: to the right, down, and towards the viewer. A triangle covers the pixels whose middle it covers,
so triangles that share an edge leave no gap and share no pixel.
"""

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.geometry.sides import rings
from cyclopean.view.colours import rgb, shaded
from cyclopean.view.png import png

STRIDE = 3  # corners of a pixelled outline that become one of the path
SHORT = 12  # corners: what is shorter is a speck
DARKEST = 0.8  # light that a place loses which sees no sky
AROUND = (0.02, 0.06, 0.15)  # of a stone's size: how far around a pixel its neighbours are looked at
_AROUND = [(np.cos(a), np.sin(a)) for a in np.pi / 8.0 + np.pi / 4.0 * np.arange(8)]
TONE = 0.7  # power of the light that is shown: middle tones are lifted, as print and screens swallow them
PALE = 0.25  # of its difference from white that a pale stone keeps
SHADES = 24  # of a tint: more are not told apart, fewer make steps


@dataclass(frozen=True, slots=True, eq=False)
class Relief:
    """What is seen at each pixel."""

    stone: Ints  # (h, w) which one; -1 where there is none
    near: Floats  # (h, w) pixels towards the viewer; -inf where there is no stone
    light: Floats  # (h, w)

    @classmethod
    def empty(cls, height: int, width: int) -> "Relief":
        """Nothing to be seen."""
        shape = (height, width)
        return cls(np.full(shape, -1), np.full(shape, -np.inf), np.zeros(shape))


def relief(before: Relief, stones: Iterable[tuple[int, Floats, Floats]], nearest: float = np.inf) -> Relief:
    """What is seen once stones are added: each its number, corners (t, 3, 3) of triangles and their light (t,).

    What is nearer than `nearest` (pixels) is not there.
    """
    near, stone, light = before.near.copy(), before.stone.copy(), before.light.copy()
    for k, corner, bright in stones:
        which, at, depth = _pixels(corner, (near.shape[0], near.shape[1]))
        some = depth <= nearest
        which, at, depth = which[some], at[some], depth[some]
        np.maximum.at(near.reshape(-1), at, depth)
        won = depth >= near.reshape(-1)[at]
        stone.reshape(-1)[at[won]] = k
        light.reshape(-1)[at[won]] = bright[which[won]]
    return Relief(stone, near, light)


def _pixels(corner: Floats, shape: tuple[int, int]) -> tuple[Ints, Ints, Floats]:
    """Pixels whose middle each triangle covers, row by row: which triangle, which pixel, how near."""
    y = corner[:, :, 1]
    first = np.clip(np.ceil(y.min(axis=1) - 0.5), 0, shape[0]).astype(np.int64)
    count = np.maximum(np.clip(np.ceil(y.max(axis=1) - 0.5), 0, shape[0]).astype(np.int64) - first, 0)
    which, step = _repeated(count)
    row = first[which] + step
    start, end = _span(corner[which], row + 0.5)
    left = np.clip(np.ceil(start - 0.5), 0, shape[1]).astype(np.int64)
    wide = np.maximum(np.clip(np.ceil(end - 0.5), 0, shape[1]).astype(np.int64) - left, 0)
    line, step = _repeated(wide)
    column = left[line] + step
    slope = _slope(corner)[which]
    foot = corner[which, 0]
    at_row = foot[:, 2] + slope[:, 1] * (row + 0.5 - foot[:, 1]) - slope[:, 0] * (foot[:, 0] - 0.5)
    return which[line], row[line] * shape[1] + column, at_row[line] + slope[line, 0] * column


def _repeated(count: Ints) -> tuple[Ints, Ints]:
    """Each index as often as counted (n,), and 0, 1, ... for each."""
    which = np.repeat(np.arange(len(count)), count)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)


def _span(corner: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Where triangles (n, 3, 3) begin and end, (n,) each, on level lines y (n,); nothing is from inf to -inf."""
    tail, head = corner, corner[:, [1, 2, 0]]
    crosses = (tail[:, :, 1] <= y[:, None]) != (head[:, :, 1] <= y[:, None])
    rise = np.where(crosses, head[:, :, 1] - tail[:, :, 1], 1.0)
    x = tail[:, :, 0] + (y[:, None] - tail[:, :, 1]) * (head[:, :, 0] - tail[:, :, 0]) / rise
    return np.where(crosses, x, np.inf).min(axis=1), np.where(crosses, x, -np.inf).max(axis=1)


def _slope(corner: Floats) -> Floats:
    """(t, 2) how much nearer a triangle comes a pixel to the right, and down; 0 where it is seen on edge."""
    one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    double = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    rise = np.stack([one[:, 2] * two[:, 1] - two[:, 2] * one[:, 1], two[:, 2] * one[:, 0] - one[:, 2] * two[:, 0]], 1)
    return np.asarray(rise / np.where(double == 0.0, np.inf, double)[:, None])


def hollow(seen: Relief, size: float) -> Floats:
    """(h, w) share of the sky that its neighbours hide from each pixel, among stones of a size (pixels).

    It is found at every other pixel, in eight directions: the steepest way up, of a few steps, to what is nearer.
    """
    from scipy.ndimage import uniform_filter

    near = seen.near[::2, ::2].astype(np.float32)
    reach = [max(round(share * size / 2.0), k + 1) for k, share in enumerate(AROUND)]
    wide = reach[-1]
    padded = np.pad(near, wide, constant_values=-np.inf)
    hidden = np.zeros(near.shape, np.float32)
    with np.errstate(invalid="ignore"):  # of what is not there from what is not there
        for across, down in _AROUND:
            steep = np.zeros(near.shape, np.float32)
            for far in reach:
                row, column = wide + round(far * down), wide + round(far * across)
                there = padded[row : row + near.shape[0], column : column + near.shape[1]]
                np.fmax(steep, (there - near) / (2.0 * far), out=steep)
            hidden += steep / np.sqrt(1.0 + steep * steep)
    hidden = np.where(np.isfinite(near), hidden / len(_AROUND), 0.0)
    full = np.repeat(np.repeat(hidden, 2, axis=0), 2, axis=1)[: seen.near.shape[0], : seen.near.shape[1]]
    return np.asarray(uniform_filter(full, 5), np.float64)


def picture(seen: Relief, size: float, tint: Ints, pale: Bools, colours: Sequence[str]) -> str:
    """A picture of stones of a size (pixels) as a data address.

    `tint` (n,) says which colour (#rrggbb) each is of; those that are `pale` (n,) are near to white.
    """
    light = seen.light**TONE * (1.0 - DARKEST * hollow(seen, size))
    used, which = np.unique(tint + len(colours) * pale, return_inverse=True)
    shades = min(SHADES, 255 // max(len(used), 1))
    step = np.clip(np.rint(light * (shades - 1)), 0, shades - 1).astype(np.int64)
    pixel = np.where(seen.stone >= 0, 1 + which[seen.stone] * shades + step, 0)
    palette = np.array([[255.0, 255.0, 255.0, 0.0]] * (1 + len(used) * shades))
    palette[1:, 3] = 255.0
    for row, k in enumerate(used.tolist()):
        colour = np.array([rgb(shaded(colours[k % len(colours)], s / (shades - 1))) for s in range(shades)], float)
        mixed = 255.0 + PALE * (colour - 255.0) if k >= len(colours) else colour
        palette[1 + row * shades : 1 + (row + 1) * shades, :3] = mixed
    return "data:image/png;base64," + base64.b64encode(png(pixel, np.rint(palette).astype(np.int64))).decode("ascii")


def outlines(seen: Relief) -> dict[int, list[Floats]]:
    """Where what is seen of each stone ends: rings (k, 2) of pixels, clockwise on the sheet round what is inside."""
    padded = np.pad(seen.stone, 1, constant_values=-1)
    h, w = padded.shape
    found: dict[int, list[Floats]] = {}
    rim = np.concatenate(list(_sides(padded, w + 1)))
    corners = (h + 1) * (w + 1)
    for ring in rings(rim):
        if len(ring) >= SHORT:
            stone, corner = divmod(ring, corners)
            point = np.stack([corner % (w + 1), corner // (w + 1)], 1) - 1.0
            found.setdefault(int(stone[0]), []).append(_smooth(point))
    return found


def _sides(stone: Ints, across: int) -> Iterable[Ints]:
    """Sides of pixels (k, 2) at which a stone ends, as tail and head: numbers of a corner in rows of `across`.

    Corners of another stone are other corners. The stone lies to the right on the sheet.
    """
    corners = (stone.shape[0] + 1) * across
    for upright, step, one, other in (
        (False, 1, stone[:-1], stone[1:]),
        (True, across, stone[:, :-1], stone[:, 1:]),
    ):
        row, column = np.nonzero(one != other)
        tail = (row + (not upright)) * across + column + upright
        for inside, way in ((one[row, column], upright), (other[row, column], not upright)):
            ends = np.stack([tail, tail + step] if way else [tail + step, tail], 1)
            yield (ends + corners * inside[:, None])[inside >= 0]


def _smooth(ring: Floats) -> Floats:
    """Every few points of a ring of pixels (k, 2), each the mean of those about it."""
    wrapped = np.concatenate([ring[-STRIDE:], ring, ring[:STRIDE]])
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(wrapped, axis=0)])
    wide = 2 * STRIDE + 1
    mean = (total[wide:] - total[:-wide]) / wide
    return np.asarray(mean[::STRIDE])


def places(seen: Relief) -> dict[int, tuple[float, float, float]]:
    """Where there is most room on what is seen of each stone: x, y and how far it is to its edge, pixels."""
    from scipy.ndimage import distance_transform_edt

    stone = seen.stone[::2, ::2]
    same = np.pad(stone, 1, constant_values=-1)
    inner = (stone >= 0) & (stone == same[:-2, 1:-1]) & (stone == same[2:, 1:-1])
    inner &= (stone == same[1:-1, :-2]) & (stone == same[1:-1, 2:])
    room = distance_transform_edt(np.pad(inner, 1))[1:-1, 1:-1]
    row, column = np.nonzero(inner)
    far, who = room[row, column], stone[row, column]
    order = np.lexsort((-far, who))
    _, first = np.unique(who[order], return_index=True)
    best = order[first]
    return {int(who[k]): (2.0 * float(column[k]) + 1.0, 2.0 * float(row[k]) + 1.0, 2.0 * float(far[k])) for k in best}
