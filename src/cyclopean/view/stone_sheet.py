"""A contact sheet of stones as SVG: each seen on its largest face, all at one scale, with id, volume and class.

>>> from cyclopean.design.stones.quarry import quarry
>>> stone_sheet_svg(quarry(3, detail=1)).count("<g transform")
3
"""

from collections.abc import Sequence
from html import escape

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.design.stones.inventory import CLASSES, shape_of
from cyclopean.design.stones.stone import Stone, in_body_frame
from cyclopean.errors import InputError
from cyclopean.geometry.solids import mesh_of, solid_of
from cyclopean.view.colours import INK, shaded
from cyclopean.view.figures import number

__all__ = ["stone_sheet_svg"]

WIDTH, MARGIN, GAP = 1000.0, 16.0, 14.0  # of the drawing, in its own units
LABEL, LINE = 11.5, 14.0  # size of the letters of a label, and height of its lines
HEAD = 34.0  # height above the stones: how many, and the scale
GRAIN = 5  # steps of coordinates in one unit; whole numbers keep the file small
FINE = 2.0  # units: faces smaller than that are joined, as no eye would tell them apart
HAIR = 0.6  # units
LIGHT = np.array([-0.5, 0.62, 0.6])  # from the upper left and from before the sheet: right, up, towards the viewer
AMBIENT = 0.42
TINTS = dict(zip(CLASSES, ("#d8cdb9", "#bfc8c9", "#d9bfa3", "#c9cdb2"), strict=True))
LETTER = 0.58 * LABEL  # width


def stone_sheet_svg(stones: Sequence[Stone], columns: int = 8, most: int = 48) -> str:
    """Draw stones side by side, as one `<svg>` element.

    Parameters
    ----------
    stones : sequence of Stone
        Of one inventory.
    columns : int
        Stones in a row.
    most : int
        Stones drawn; of more than that, as many are taken at equal steps through the order given.

    Returns
    -------
    str
        Static: no script, no animation, nothing that is loaded.

    Raises
    ------
    InputError
        There are no stones, or no columns or stones are asked for.
    """
    if not stones:
        raise InputError("contact sheet: there are no stones to draw")
    if columns < 1 or most < 1:
        raise InputError(f"contact sheet: {columns} columns, {most} stones; ask for at least 1 of each")
    shown = [stones[k] for k in _steps(len(stones), most)]
    columns = min(columns, len(shown))
    bodies = [in_body_frame(stone) for stone in shown]
    extent = np.array([np.ptp(body[:, :2], axis=0) for body in bodies]).max(axis=0)  # m
    pitch = (WIDTH - 2.0 * MARGIN) / columns
    scale = float(min((pitch - GAP) / extent[0], 2.0 * pitch / extent[1]))  # units a metre
    row = float(extent[1]) * scale + 2.0 * LINE + GAP
    parts = [_heading(len(stones), len(shown), sum(stone.volume for stone in stones)), _scale_bar(scale, pitch)]
    for k, (stone, body) in enumerate(zip(shown, bodies, strict=True)):
        x, y = MARGIN + (k % columns + 0.5) * pitch, MARGIN + HEAD + (k // columns) * row
        parts.append(_stone(stone, body, scale, x, y + float(extent[1]) * scale / 2.0))
        parts.append(_label(stone, x, y + float(extent[1]) * scale + LINE, pitch))
    height = 2.0 * MARGIN + HEAD + row * -(-len(shown) // columns)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {height:.0f}" role="img"'
        f' font-family="sans-serif" font-size="{LABEL}" fill="{INK}">'
        f"<title>Contact sheet of {len(shown)} stones</title>"
        f'<rect width="100%" height="100%" fill="#fff"/>{"".join(parts)}</svg>'
    )


def _steps(count: int, most: int) -> Ints:
    """Indices of at most `most` of `count` things, at equal steps, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(np.int64))


def _stone(stone: Stone, body: Floats, scale: float, x: float, y: float) -> str:
    """One stone about (x, y): faces that look at the viewer, from the farthest to the nearest."""
    tint = TINTS[shape_of(stone).aspect]
    middle = np.append((body[:, :2].min(axis=0) + body[:, :2].max(axis=0)) / 2.0, 0.0)
    point, triangles = _plain((body - middle) * scale, stone.triangles)
    corner = point[triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    seen = np.flatnonzero(normal[:, 2] > 1e-6)
    seen = seen[np.argsort(corner[seen, :, 2].mean(axis=1), kind="stable")]
    light = AMBIENT + (1.0 - AMBIENT) * np.maximum(normal[seen] @ (LIGHT / np.linalg.norm(LIGHT)), 0.0)
    flat = np.rint(corner[seen, :, :2] * [GRAIN, -GRAIN]).astype(np.int64)
    flat[:, 1:] -= flat[:, :1].copy()  # from the first corner
    path = flat.reshape(-1, 6).tolist()
    faces = "".join(
        f'<path color="{shaded(tint, shade)}" d="M{a} {b}l{c} {d} {e - c} {f - d}z"/>'
        for (a, b, c, d, e, f), shade in zip(path, light.tolist(), strict=True)
    )
    return (  # the stroke, of the colour of its face, closes the hairlines between faces
        f'<g transform="translate({x:.1f} {y:.1f}) scale({1.0 / GRAIN:g})" fill="currentColor" stroke="currentColor"'
        f' stroke-width="{HAIR * GRAIN:g}" stroke-linejoin="round"><title>{escape(stone.id)}</title>{faces}</g>'
    )


def _plain(point: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Join faces that are too fine for the drawing."""
    solid = solid_of(point, triangles).simplify(FINE)
    return mesh_of(solid)


def _label(stone: Stone, x: float, y: float, pitch: float) -> str:
    """Id, volume and class below a stone."""
    letters = max(int((pitch - GAP / 2.0) / LETTER), 2)
    name = stone.id if len(stone.id) <= letters else stone.id[: letters - 1] + "\u2026"
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="middle"><tspan font-weight="600">{escape(name)}</tspan>'
        f'<tspan x="{x:.1f}" dy="{LINE}">{_volume(stone.volume)}, {shape_of(stone).aspect}</tspan></text>'
    )


def _volume(volume: float) -> str:
    """Volume (m3) in the unit that is read most easily."""
    return f"{number(volume)} m\u00b3" if volume >= 1.0 else f"{number(1000.0 * volume)} L"


def _heading(count: int, shown: int, volume: float) -> str:
    which = f"{count:,} stone{'' if count == 1 else 's'}" + ("" if shown == count else f", {shown} of them drawn")
    return (
        f'<text x="{MARGIN:g}" y="{MARGIN + 12.0:g}" font-size="15"><tspan font-weight="600">{which}</tspan>'
        f"<tspan>; {_volume(volume)} in all, seen on the largest face</tspan></text>"
    )


def _scale_bar(scale: float, pitch: float) -> str:
    """A bar of 1, 2 or 5 times a power of ten metres, about as wide as a stone."""
    power = 10.0 ** np.floor(np.log10(pitch / scale))
    length = float(power * max(step for step in (1.0, 2.0, 5.0) if step * power * scale <= pitch * (1.0 + 1e-9)))
    right, y = WIDTH - MARGIN, MARGIN + 8.0
    left = right - length * scale
    name = f"{number(length)} m" if length >= 1.0 else f"{number(1000.0 * length)} mm"
    return (
        f'<path d="M{left:.1f} {y - 4:.1f}v8m0-4H{right:.1f}m0-4v8" stroke="{INK}" stroke-width="1.3" fill="none"/>'
        f'<text x="{left - 8.0:.1f}" y="{y + 4.0:.1f}" text-anchor="end">{name}</text>'
    )
