"""Orientations in which a found stone can lie.

A stone is bedded on a face of its convex hull on which it can rest: from its shortest axis pointing down it rolls, face
by face, until it stands on the face below its centre of mass; so on both flips, and on those of its middle axis. About
the vertical it is turned by equal steps. Half of a turn away, a raster is the same one read backwards.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.design.rubble.height_map import Raster, rasters
from cyclopean.design.stones.stone import Stone

__all__ = ["Bedded", "bedded"]


@dataclass(frozen=True, eq=False)
class Bedded:
    """A stone in one orientation. Heights and plan are about its centre of mass."""

    stone: int
    rotation: Floats  # (3, 3)
    raster: Raster
    bed: int  # 0 on its flattest bed, 1 on its second choice
    top: float  # m: its highest point
    bottom: float  # m: its lowest point, negative
    volume: float  # m3, of the stone
    thin: float  # m: its shortest semi-axis

    @classmethod
    def of(cls, number: int, stone: Stone, rotation: Floats, raster: Raster, bed: int) -> "Bedded":
        """A stone, turned by (3, 3), with what its raster tells."""
        top, bottom = float(raster.high.max()), float(raster.low.min())
        return cls(number, rotation, raster, bed, top, bottom, stone.volume, float(stone.half[2]))

    @cached_property
    def cells(self) -> tuple[Ints, Floats]:
        """Cells (k, 2) that it covers, and its underside there (k,) in single precision."""
        inside = np.argwhere(self.raster.low < np.inf)
        return inside, self.raster.low[inside[:, 0], inside[:, 1]].astype(np.float32)

    @cached_property
    def shown(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Of its elevation from either end and either side: m, by a cell, in the first cell, in the first two, ...."""
        low, high = self.raster.low, self.raster.high
        return _shown(low.T, high.T), _shown(low, high)

    @cached_property
    def ring(self) -> Ints:
        """Cells (k, 2) right around its plan."""
        inside = np.pad(self.raster.low < np.inf, 1)
        near = inside.copy()
        near[1:] |= inside[:-1]
        near[:-1] |= inside[1:]
        near[:, 1:] |= inside[:, :-1]
        near[:, :-1] |= inside[:, 1:]
        return np.argwhere(near & ~inside) - 1


def bedded(number: int, stone: Stone, yaws: int, cell: float, beds: Sequence[int] = (0, 1)) -> list[Bedded]:
    """Orientations of a stone that are worth trying.

    Parameters
    ----------
    number : int
        What the stone is called by.
    stone : Stone
        A measured stone.
    yaws : int
        Turns about the vertical.
    cell : float
        Width of a cell of the map (m).
    beds : sequence of int
        0 = with the shortest axis up, 1 = with the middle one.
    """
    point = stone.vertices - stone.centroid
    normal, offset = _hull_faces(point)
    half = yaws // 2 if yaws % 2 == 0 else yaws
    flats = [(bed, sign) for bed in beds for sign in (-1.0, 1.0)]
    turns = [
        _yaw(2.0 * np.pi * k / yaws) @ _upright(_rolled(sign * stone.axes[2 - bed], normal, offset), stone.axes[0])
        for bed, sign in flats
        for k in range(half)
    ]
    bed_of = [bed for bed, _ in flats for _ in range(half)]
    made = rasters(np.stack([point @ turn.T for turn in turns]), stone.triangles, cell)
    if half < yaws:
        turns += [_yaw(np.pi) @ turn for turn in turns]
        made += [_backwards(raster, cell) for raster in made]
        bed_of *= 2
    return [Bedded.of(number, stone, *one) for one in zip(turns, made, bed_of, strict=True)]


def _shown(low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """See `Bedded.shown`: of the second axis."""
    one, two = (
        (np.maximum.accumulate(high[:, ::way], axis=1) - np.minimum.accumulate(low[:, ::way], axis=1)).clip(0.0)
        for way in (1, -1)
    )
    return one.sum(axis=0), two.sum(axis=0)


def _backwards(raster: Raster, cell: float) -> Raster:
    """The raster of a mesh turned by half of a turn."""
    return Raster(
        np.ascontiguousarray(raster.low[::-1, ::-1]),
        np.ascontiguousarray(raster.high[::-1, ::-1]),
        -(raster.corner + cell * np.array(raster.low.shape)),
    )


def _hull_faces(point: Floats) -> tuple[Floats, Floats]:
    """Outward normals (f, 3) and distances (f,) from the centre of mass of the faces of the convex hull."""
    from scipy.spatial import ConvexHull

    plane = ConvexHull(point).equations
    return plane[:, :3], np.maximum(-plane[:, 3], 1e-12)


def _rolled(down: Floats, normal: Floats, offset: Floats) -> Floats:
    """Normal of the face on which a body comes to stand that is let go with `down` pointing down.

    It tips over the face that the plumb line from its centre of mass leaves through; each time the centre sinks.
    """
    face = int(np.argmax(normal @ down / offset))
    for _ in range(len(normal)):
        below = int(np.argmax(normal @ normal[face] / offset))
        if not offset[below] < offset[face] * (1.0 - 1e-12):
            break
        face = below
    return np.asarray(normal[face], float)


def _upright(down: Floats, along: Floats) -> Floats:
    """Rotation that takes `down` to -z and lays `along` as nearly as can be along x."""
    up = -down
    x = along - (along @ up) * up
    if not np.linalg.norm(x) > 1e-6:
        x = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def _yaw(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
