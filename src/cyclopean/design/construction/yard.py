"""From the yard to the wall: where stones are laid out, and the frames of a robot or a crane that brings each one.

The yard is a field beside the finished structure, level with its lowest point, on the side it faces (the right-hand
side of the direction along it). Stones lie in rows along it in the order of building, first to be laid nearest, turned
as they will be in the wall so that one grip serves from start to end. Every stone has a box of its own, with a gap
around it: nothing overlaps.

A frame is a 4x4 matrix that says where a stone's own frame stands: origin at its centre of mass, axes parallel to the
world's while it is in the wall. A point of the model moves with frame F to F place^-1 (x, 1). For each stone

    yard      where it waits
    lift      straight above the yard, higher than everything that stands
    approach  `clearance` before its place, along the direction in which it is free
    place     in the wall
    retract   where the tool goes when it has let go: back the way it came

A stone that is free in no direction, or is best brought in from below, still gets an approach: from above, or as it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, sealed
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.geometry.frames import affine
from cyclopean.geometry.packed import extents

__all__ = ["Frames", "frames_of", "yard_places"]

GAP = 0.25  # between stones in the yard, and between rows, of a mean stone's size
APART = 2.0  # between the structure and the yard, of a mean stone's size


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Frames of one stone on its way, each (4, 4), m."""

    yard: Floats
    lift: Floats
    approach: Floats
    place: Floats
    retract: Floats

    def __post_init__(self) -> None:
        for name in ("yard", "lift", "approach", "place", "retract"):
            object.__setattr__(self, name, sealed(name, getattr(self, name), 4, 4))


def yard_places(assembly: Assembly, order: Sequence[int], along: Floats, up: Floats) -> Floats:
    """(n, 3) m: how far each block is moved from its place in the wall to the yard; zero for blocks not in `order`.

    Parameters
    ----------
    assembly : Assembly
        The finished structure.
    order : sequence of int
        Blocks to lay out.
    along, up : (3,) unit
        Direction of the rows, and against gravity.
    """
    shift = np.zeros((len(assembly), 3))
    if not order:
        return shift
    axes = np.stack([along, np.cross(along, up), up])  # the yard grows along the second: to the right
    local = assembly.mesh.vertex @ axes.T
    low, high = extents(local, assembly.mesh.vertex_start)
    size = high - low
    stones = list(order)
    mean = float(np.mean(np.cbrt(np.abs(assembly.mass.volume[stones]))))
    floor, left, width = low[:, 2].min(), low[:, 0].min(), max(np.ptp(local[:, 0]), size[stones, 0].max())
    x, y, deep = 0.0, float(high[:, 1].max()) + APART * mean, 0.0
    for i in stones:
        if x > 0.0 and x + size[i, 0] > width * (1.0 + 1e-9):
            x, y, deep = 0.0, y + deep + GAP * mean, 0.0
        shift[i] = (np.array([left + x, y, floor]) - low[i]) @ axes
        x, deep = x + size[i, 0] + GAP * mean, max(deep, size[i, 1])
    return shift


def frames_of(
    assembly: Assembly, order: Sequence[int], yard: Floats, free: Sequence[Floats | None], up: Floats, clearance: float
) -> list[Frames]:
    """Frames of each stone.

    Parameters
    ----------
    assembly : Assembly
        The finished structure.
    order : sequence of int
        Its stones.
    yard : (n, 3) float
        m, of every block, from its place to the yard.
    free : sequence of (3,) unit or None
        Direction in which each stone can be taken away from its place; None where it is trapped, then `up` is drawn.
    up : (3,) unit
        Against gravity.
    clearance : float
        m, between approach and place, and between place and retract.

    Raises
    ------
    InputError
        The clearance is not positive.
    """
    if not (0.0 < clearance < np.inf):
        raise InputError.of("clearance", clearance, "expected a positive length in metres")
    top, mesh, found = float((assembly.mesh.vertex @ up).max()), assembly.mesh, []
    for block, way in zip(order, free, strict=True):
        shift, centre = yard[block], assembly.mass.centroid[block]
        own = mesh.vertex[mesh.vertex_start[block] : mesh.vertex_start[block + 1]] + shift
        lift = shift + max(top + clearance - float((own @ up).min()), clearance) * up
        away = clearance * (up if way is None else way)
        found.append(Frames(*(affine(np.eye(3), centre + move) for move in (shift, lift, away, np.zeros(3), away))))
    return found
