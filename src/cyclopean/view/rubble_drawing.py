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
from html import escape

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, supports
from cyclopean.errors import InputError
from cyclopean.geometry.solids import mesh_of, solid_of
from cyclopean.view.colours import shaded

__all__ = ["rubble_svg"]

WIDTH, MARGIN = 1000.0, 24.0  # of the drawing, in its own units
GRAIN = 4  # steps of coordinates in one unit; whole numbers keep the file small
FINE = 2.5  # units: faces smaller than that are joined, as no eye would tell them apart
HAIR = 0.7  # units
LIGHT = np.array([-0.5, -0.62, 0.6])  # towards the sun, world
AMBIENT = 0.4
STEPS = 24  # of light
TINTS = ("#d8cdb9", "#bfc8c9", "#d9bfa3", "#c9cdb2", "#cfc3b6", "#c4c0b4", "#e0d2ba")
GROUND = "#b9b8ab"
GROUND_BELOW = 0.06  # of the wall's height that is drawn of the ground
UNSTEADY = "#c0492f"  # outline of a stone that does not sit


def rubble_svg(assembly: Assembly, title: str, unsteady: Sequence[str] = ()) -> str:
    """Draw a wall whose front looks to -y, as one `<svg>` element.

    Parameters
    ----------
    assembly : Assembly
        Free blocks are drawn, on a strip of ground below the lowest one.
    title : str
        For readers that do not see it.
    unsteady : sequence of str
        Ids of stones to tint as not sitting.

    Returns
    -------
    str
        Static: no script, nothing that is loaded.

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
    tint = {block.id: TINTS[k * 5 % len(TINTS)] for k, block in enumerate(stones)}
    tint.update(dict.fromkeys(unsteady, UNSTEADY))
    faces = [_front(block.vertices, block.faces, low, high, scale, block.id) for block in stones]
    shown = _visible([corner for corner, _ in faces], int(WIDTH), int(height))
    order = np.argsort([-float(np.median(corner[:, :, 1])) for corner, _ in faces], kind="stable")
    parts = [
        _stone(stones[k].id, faces[k][0][shown[k]], faces[k][1][shown[k]], tint[stones[k].id]) for k in order.tolist()
    ]
    ground = (
        f'<rect x="0" y="{height - MARGIN - strip:.1f}" width="100%" height="{MARGIN + strip:.1f}" fill="{GROUND}"/>'
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {height:.0f}" role="img">'
        f'<title>{escape(title)}</title><rect width="100%" height="100%" fill="#fff"/>{ground}'
        f'<g transform="scale({1.0 / GRAIN:g})" fill="currentColor" stroke="currentColor"'
        f' stroke-width="{HAIR * GRAIN:g}" stroke-linejoin="round">{"".join(parts)}</g></svg>'
    )


def _front(
    vertices: Floats, faces: tuple[tuple[int, ...], ...], low: Floats, high: Floats, scale: float, name: str
) -> tuple[Floats, Floats]:
    """Triangles that look to the front, (t, 3, 3) in units: right, away from the viewer, down; and their light."""
    solid = solid_of(vertices, faces, name).simplify(FINE / scale)
    point, triangles = mesh_of(solid)
    corner = point[triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    seen = normal[:, 1] < -1e-6
    light = AMBIENT + (1.0 - AMBIENT) * np.maximum(normal[seen] @ (LIGHT / np.linalg.norm(LIGHT)), 0.0)
    sheet = (corner[seen] - [low[0], low[1], high[2]]) * scale * [1.0, 1.0, -1.0] + np.array([MARGIN, 0.0, MARGIN])
    return sheet, np.rint(light * STEPS) / STEPS


def _visible(corners: Sequence[Floats], width: int, height: int) -> list[Bools]:
    """Which triangles of each stone are seen at a pixel at least: a depth buffer with pixels of one unit."""
    nearest = np.full((width + 1, height + 1), np.inf)
    pixels = [_pixels(corner, nearest.shape) for corner in corners]
    for _, at, depth in pixels:
        np.minimum.at(nearest.reshape(-1), at, depth)
    shown = []
    for corner, (which, at, depth) in zip(corners, pixels, strict=True):
        seen = np.zeros(len(corner), bool)
        seen[which[depth <= nearest.reshape(-1)[at] + 1e-9]] = True
        shown.append(seen)
    return shown


def _pixels(corner: Floats, shape: tuple[int, int]) -> tuple[Ints, Ints, Floats]:
    """Pixels whose middle each triangle covers: which triangle, which pixel, how deep."""
    flat = corner[:, :, [0, 2]]
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
    y = corner[which, :, 1]
    depth = y[:, 0] + s * (y[:, 1] - y[:, 0]) + t * (y[:, 2] - y[:, 0])
    return which, pixel[:, 0] * shape[1] + pixel[:, 1], depth


def _stone(name: str, corner: Floats, light: Floats, tint: str) -> str:
    """The triangles of one stone, the farthest first; those of one light that follow each other in one path."""
    order = np.argsort(-corner[:, :, 1].mean(axis=1), kind="stable")
    flat = np.rint(corner[order][:, :, [0, 2]] * GRAIN).astype(np.int64)
    flat[:, 1:] -= flat[:, :1].copy()  # from the first corner
    rows = flat.reshape(-1, 6).tolist()
    shapes: dict[float, list[str]] = {}
    for (a, b, c, d, e, f), shade in zip(rows, light[order].tolist(), strict=True):
        shapes.setdefault(shade, []).append(f"M{a} {b}l{c} {d} {e - c} {f - d}z")
    drawn = "".join(f'<path color="{shaded(tint, shade)}" d="{"".join(d)}"/>' for shade, d in shapes.items())
    return f"<g><title>{escape(name)}</title>{drawn}</g>"
