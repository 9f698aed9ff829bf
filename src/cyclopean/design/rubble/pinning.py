"""Pins: where a small stone would bear a larger one that rocks.

A stone whose centre of mass does not stand well inside the hull of what it touches needs one more contact. Every small
stone that is kept for it is let down on the height map, at all places under the plan of the larger one; where its top
comes nearly to the underside there, it would bear it. Of these places, that one is best at which the hull reaches
farthest around the centre of mass.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.rubble.features import Body
from cyclopean.design.rubble.height_map import lying_raster
from cyclopean.design.rubble.orientations import Bedded
from cyclopean.design.rubble.places import FULL, swept

__all__ = ["PinPlace", "pins_under"]

DIRECTIONS = 16  # in which the hull of what touches is felt
NEARLY = 0.6  # cells: by which the top of a pin may miss the underside of the stone
MOST = 12  # places that are told


@dataclass(frozen=True, slots=True, eq=False)
class PinPlace:
    """A small stone under a larger one."""

    lying: Bedded
    centre: Floats  # (3,) m: of its mass
    lift: float  # m: by which it would lift the larger stone
    gain: float  # m: how far the hull of what bears then reaches, in the direction where it reaches least


def pins_under(
    ground: Floats, body: Body, bearing: Floats, small: Sequence[Sequence[Bedded]], cell: float
) -> list[PinPlace]:
    """Places of pins under a stone, the best first.

    Parameters
    ----------
    ground : (n, m) array
        The height map (m).
    body : Body
        The stone, where it rocks.
    bearing : (k, 3) array
        Points that bear it so far (m).
    small : sequence of sequences of Bedded
        Small stones, each in its orientations.
    cell : float
        Width of a cell (m).
    """
    own = lying_raster(body.vertices, body.triangles, cell)
    i, j = (int(k) for k in np.rint(own.corner / cell))
    rows, columns = (slice(max(k, 0), max(k + n, 0)) for k, n in zip((i, j), own.low.shape, strict=True))
    below = np.asarray(ground[rows, columns], np.float32)
    a, b = max(-i, 0), max(-j, 0)
    under = own.low[a : a + below.shape[0], b : b + below.shape[1]]
    roof = np.where(under < np.inf, under, FULL).astype(np.float32)  # no roof where the stone is not
    angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    way = np.stack([np.cos(angle), np.sin(angle)])
    reach = ((bearing[:, :2] - body.centroid[:2]) @ way).max(axis=0, initial=-np.inf)
    found: list[PinPlace] = []
    for orientations in small:
        for lying in orientations:
            w, d = lying.raster.low.shape
            count = below.shape[0] - w + 1, below.shape[1] - d + 1
            if min(count) < 1:
                continue
            cells, low = lying.cells
            top = lying.raster.high[cells[:, 0], cells[:, 1]].astype(np.float32)
            rest = swept(below, cells, low, count)
            lift = rest + swept(-roof, cells, -top, count)  # by which its top stands above the roof
            near = np.argwhere(np.abs(lift) <= NEARLY * cell)
            if not len(near):
                continue
            corner = np.array([rows.start, columns.start]) + near
            plan = corner * cell - lying.raster.corner
            gain = np.maximum((plan - body.centroid[:2]) @ way, reach).min(axis=1)
            best = int(np.argmax(gain))
            if gain[best] > 0.0:
                x, y = near[best]
                centre = np.array([*plan[best], float(rest[x, y])])
                found.append(PinPlace(lying, centre, float(lift[x, y]), float(gain[best])))
    return sorted(found, key=lambda place: -place.gain)[:MOST]
