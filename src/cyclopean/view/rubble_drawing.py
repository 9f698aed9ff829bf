"""A wall of rubble as SVG, seen from before its face: every stone as it is, in the sun from the upper left.

>>> import numpy as np
>>> from cyclopean.assembly import Assembly, Block
>>> corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
>>> faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
>>> ground = Block("ground", corner - [0.0, 0.0, 1.0], faces, fixed=True)
>>> rubble_svg(Assembly((ground, Block("a", corner, faces, fixed=False))), "One").count("<title>a</title>")
1
"""

from collections.abc import Sequence

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, supports
from cyclopean.errors import InputError
from cyclopean.view.stone_faces import stone_faces, stone_svg
from cyclopean.view.svg import WIDTH, rect, sheet

__all__ = ["rubble_svg"]

MARGIN = 24.0  # drawing units
TINTS = ("#d8cdb9", "#bfc8c9", "#d9bfa3", "#c9cdb2", "#cfc3b6", "#c4c0b4", "#e0d2ba")
GROUND = "#b9b8ab"
GROUND_BELOW = 0.06  # of the wall's height that is drawn of the ground
UNSTEADY = "#c0492f"  # outline of a stone that does not sit


def rubble_svg(assembly: Assembly, title: str, unsteady: Sequence[str] = ()) -> str:
    """Draw a wall whose front looks to -y, as one static `<svg>` element that loads nothing.

    Free blocks are drawn, on a strip of ground below the lowest one; the stones whose ids are `unsteady` are tinted
    as not sitting. The title is for readers that do not see it.

    Raises
    ------
    InputError
        There is no free block to draw.
    """
    held, _ = supports(assembly)
    stones = [block for block, fixed in zip(assembly.blocks, held.tolist(), strict=True) if not fixed]
    if not stones:
        raise InputError(f"{assembly.name}: there is no stone to draw")
    point = np.concatenate([block.vertices for block in stones])
    low, high = point.min(axis=0), point.max(axis=0)
    scale = (WIDTH - 2.0 * MARGIN) / float(high[0] - low[0])
    strip = GROUND_BELOW * (high[2] - low[2]) * scale
    height = float((high[2] - low[2]) * scale + strip + 2.0 * MARGIN)
    corner_of = np.array([low[0], high[2], low[1]])
    drawn = []
    for k, block in enumerate(stones):
        units = (block.vertices[:, [0, 2, 1]] - corner_of) * [scale, -scale, -scale] + [MARGIN, MARGIN, 0.0]
        tint = UNSTEADY if block.id in unsteady else TINTS[k * 5 % len(TINTS)]
        drawn.append((block.id, *stone_faces(units, block.faces, block.id), tint))
    shown = _visible([corner for _, corner, _, _ in drawn], int(WIDTH), int(height))
    order = np.argsort([float(np.median(corner[:, :, 2])) for _, corner, _, _ in drawn], kind="stable")
    ground = rect(0.0, height - MARGIN - strip, WIDTH, MARGIN + strip, f'fill="{GROUND}"')
    parts = [
        stone_svg(name, corner[shown[k]], light[shown[k]], tint)
        for k in order
        for name, corner, light, tint in [drawn[k]]
    ]
    return sheet((WIDTH, height), title, [ground, *parts])


def _visible(corners: Sequence[Floats], width: int, height: int) -> list[Bools]:
    """Which triangles of each stone are seen at a pixel at least: a depth buffer with pixels of one unit."""
    nearest = np.full((width + 1, height + 1), -np.inf)
    pixels = [_pixels(corner, nearest.shape) for corner in corners]
    for _, at, near in pixels:
        np.maximum.at(nearest.reshape(-1), at, near)
    shown = []
    for corner, (which, at, near) in zip(corners, pixels, strict=True):
        seen = np.zeros(len(corner), bool)
        seen[which[near >= nearest.reshape(-1)[at] - 1e-9]] = True
        shown.append(seen)
    return shown


def _pixels(corner: Floats, shape: tuple[int, int]) -> tuple[Ints, Ints, Floats]:
    """Pixels whose middle each triangle covers: which triangle, which pixel, how near."""
    flat = corner[:, :, :2]
    first = np.ceil(flat.min(axis=1) - 0.5).astype(np.int64)
    count = np.maximum(np.floor(flat.max(axis=1) - 0.5).astype(np.int64) - first + 1, 0)
    total = count.prod(axis=1)
    which = np.repeat(np.arange(len(corner)), total)
    step = np.arange(len(which)) - np.repeat(np.cumsum(total) - total, total)
    pixel = first[which] + np.column_stack([step // count[which, 1], step % count[which, 1]])
    origin, one, two = flat[which, 0], flat[which, 1] - flat[which, 0], flat[which, 2] - flat[which, 0]
    d = pixel + 0.5 - origin
    double = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (d[:, 0] * two[:, 1] - d[:, 1] * two[:, 0]) / double
        t = (one[:, 0] * d[:, 1] - one[:, 1] * d[:, 0]) / double
    inside = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & (pixel >= 0).all(axis=1) & (pixel < shape).all(axis=1)
    which, pixel, s, t = which[inside], pixel[inside], s[inside], t[inside]
    z = corner[which, :, 2]
    near = z[:, 0] + s * (z[:, 1] - z[:, 0]) + t * (z[:, 2] - z[:, 0])
    return which, pixel[:, 0] * shape[1] + pixel[:, 1], near
