"""Stones as they are found, in SVG: many small faces, in the sun from the upper left, the nearest painted last.

Coordinates here are drawing units: to the right, down, and towards the viewer.
"""

from collections.abc import Sequence
from html import escape
from itertools import groupby

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.geometry.frames import unit
from cyclopean.geometry.solids import mesh_of, solid_of
from cyclopean.view.colours import shaded

GRAIN = 5  # steps of coordinates in one unit; whole numbers keep the file small
FINE = 2.0  # units: faces smaller than that are joined, as no eye would tell them apart
HAIR = 1.1  # units: the stroke, of the colour of its face, closes the hairlines between faces
LIGHT = unit(np.array([[-0.5, -0.6, 0.62]]))[0]  # towards the sun
AMBIENT = 0.4  # light of a face that is turned away from the sun
STEPS = 24  # of light


def facing(point: Floats, triangles: Ints) -> tuple[Floats, Floats]:
    """Triangles that look at the viewer: corners (t, 3, 3), and light (t,) from `AMBIENT` to 1.

    Points are (v, 3), triangles (f, 3): counter-clockwise on the sheet where they look at the viewer.
    """
    corner = point[triangles]
    normal = unit(-np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    seen = normal[:, 2] > 1e-6
    return corner[seen], AMBIENT + (1.0 - AMBIENT) * np.maximum(normal[seen] @ LIGHT, 0.0)


def stone_faces(point: Floats, faces: Ints | Sequence[Sequence[int]], name: str = "stone") -> tuple[Floats, Floats]:
    """What `facing` answers with faces joined that no eye would tell apart, the furthest first, light in steps.

    Points are (v, 3), faces polygons or (f, 3). The name is for refusals.
    """
    upright = point * [1.0, -1.0, 1.0]  # right-handed
    point, triangles = mesh_of(solid_of(upright, faces, name).simplify(FINE))
    corner, light = facing(point * [1.0, -1.0, 1.0], triangles)
    order = np.argsort(corner[:, :, 2].mean(axis=1), kind="stable")
    return corner[order], np.rint(light[order] * STEPS) / STEPS


def stone_svg(name: str, corner: Floats, light: Floats, tint: str, at: tuple[float, float] = (0.0, 0.0)) -> str:
    """One stone of `stone_faces` in a tint (#rrggbb), its origin `at` (x, y); its name is escaped here.

    Faces of one light that follow each other are one path.
    """
    flat = np.rint(corner[:, :, :2] * GRAIN).astype(np.int64)
    flat[:, 1:] -= flat[:, :1].copy()  # from the first corner
    rows = zip(flat.reshape(-1, 6).tolist(), light.tolist(), strict=True)
    paths = []
    for shade, faces in groupby(rows, key=lambda row: row[1]):
        way = "".join(f"M{a} {b}l{c} {d} {e - c} {f - d}z" for (a, b, c, d, e, f), _ in faces)
        paths.append(f'<path color="{shaded(tint, shade)}" d="{way}"/>')
    return (
        f'<g transform="translate({at[0]:.1f} {at[1]:.1f}) scale({1.0 / GRAIN:g})" fill="currentColor"'
        f' stroke="currentColor" stroke-width="{HAIR * GRAIN:g}" stroke-linejoin="round">'
        f"<title>{escape(name)}</title>{''.join(paths)}</g>"
    )
