"""Icons of the components: 24 x 24 pixels, drawn here from a few polygons, as PNG in base64.

A pixel's colour is the mean over 4 x 4 points in it. Coordinates run from 0 to 24, y downwards.
"""

import base64
from functools import cache

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.view.png import png

SIZE, FINE = 24, 4
STONE, DARK, LIGHT, GREEN, RED, BLUE = "#a79f8f", "#4a453c", "#d8d2c4", "#2f7d4f", "#b3422c", "#2b5c9e"

Shape = tuple[str, str]  # colour, and corners as "x,y x,y ..."
ARCH = ((DARK, "1,22 1,13 5,5 12,2 19,5 23,13 23,22 17,22 17,14 15,9 12,8 9,9 7,14 7,22"),
        (STONE, "2,21 2,15 6,15 6,21"), (STONE, "18,21 18,15 22,15 22,21"),
        (STONE, "2,14 5.6,6.5 8.4,8.6 6.2,13.6"), (STONE, "22,14 18.4,6.5 15.6,8.6 17.8,13.6"),
        (LIGHT, "6.5,5.6 11.5,3.2 11.5,7 9.2,7.8"), (LIGHT, "17.5,5.6 12.5,3.2 12.5,7 14.8,7.8"))  # fmt: skip
WALL = ((DARK, "1,2 23,2 23,22 1,22"), (STONE, "2,3 9,3 11,8 7,11 2,9"), (LIGHT, "10,3 22,3 22,7 17,10 12,8"),
        (LIGHT, "2,10 7,12 8,17 2,16"), (STONE, "8,12 11.5,9 16.5,11 17,16 9,17"), (LIGHT, "17.5,11 22,8 22,17 18,16"),
        (STONE, "2,17 8,18 8,21 2,21"), (LIGHT, "9,18 16,17 16,21 9,21"),
        (STONE, "17,17 22,18 22,21 17,21"))  # fmt: skip
DRAWINGS: dict[str, tuple[Shape, ...]] = {
    "check": (*ARCH, (GREEN, "9,18 11,16 13,19 19,10 21,12 13.2,23")),
    "limit": ((DARK, "2,22 22,22 22,20 2,20"), (STONE, "9,20 15,18 11,4 5,6"),
              (RED, "23,9 17,9 17,6 11,11 17,16 17,13 23,13")),
    "polygonal-wall": WALL,
    "match": ((DARK, "13,3 23,3 23,13 13,13"), (LIGHT, "14,4 22,4 22,12 14,12"),
              (STONE, "2,13 7,10 12,13 12,19 7,22 2,19"), (BLUE, "9,9 13,12 15,10 15,16 9,16 11,14 7,11")),
    "carve": ((STONE, "2,8 8,3 16,4 16,21 6,21 2,16"), (LIGHT, "17,5 22,10 22,17 17,21"),
              (RED, "16,1 17,1 17,23 16,23")),
    "sequence": ((STONE, "2,15 10,15 10,22 2,22"), (STONE, "11,15 19,15 19,22 11,22"), (LIGHT, "6,7 15,7 15,14 6,14"),
                 (BLUE, "20,2 23,7 21,7 21,12 19,12 19,7 17,7")),
    "settle": ((DARK, "1,20 23,20 23,22 1,22"), (STONE, "2,20 1,15 5,12 10,14 10,20"),
               (LIGHT, "11,20 11,14 17,13 22,16 21,20"), (STONE, "6,12 9,7 16,7 18,12 11,14"),
               (BLUE, "12,6 9,2 11,2 11,0 13,0 13,2 15,2")),
}  # fmt: skip


@cache
def icon(name: str) -> str:
    """The icon of a component as base64; "" where it has none."""
    if name not in DRAWINGS:
        return ""
    return base64.b64encode(png(np.rint(255.0 * _drawn(DRAWINGS[name])).astype(np.int64))).decode("ascii")


def _drawn(shapes: tuple[Shape, ...]) -> Floats:
    """Paint polygons over each other."""
    step = (np.arange(SIZE * FINE) + 0.5) / FINE
    point = np.stack(np.meshgrid(step, step), axis=-1)
    fine = np.zeros((SIZE * FINE, SIZE * FINE, 4))
    for colour, corners in shapes:
        polygon = np.array([[float(x) for x in pair.split(",")] for pair in corners.split()])
        fine[_inside(point, polygon)] = [*(int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)), 1.0]
    cover = fine.reshape(SIZE, FINE, SIZE, FINE, 4).sum(axis=(1, 3))
    solid = np.maximum(cover[..., 3:], 1e-9)  # colours are means over what is painted, not over the empty rest
    return np.concatenate([cover[..., :3] / solid, cover[..., 3:] / FINE**2], axis=-1)


def _inside(point: Floats, polygon: Floats) -> Bools:
    """Even-odd rule: whether a ray to the right crosses the outline an odd number of times."""
    odd = np.zeros(point.shape[:2], bool)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        if y0 != y1:
            across = (y0 > point[..., 1]) != (y1 > point[..., 1])
            odd ^= across & (point[..., 0] < x0 + (point[..., 1] - y0) * (x1 - x0) / (y1 - y0))
    return odd
