"""The line of thrust of a structure in which every block bears on two joints at most: arches, columns, buttresses.

The two forces on a voussoir and its weight are in balance, so that they meet in one point (Hooke 1675; Moseley 1843):
the line runs from one centre of pressure along the force there to that point, and along the other force to the other
centre of pressure. What lies inside every joint is thrust that the joints can bear; what comes near an edge is where a
hinge will open.
"""

import numpy as np

from cyclopean.analysis import Result
from cyclopean.arrays import Floats
from cyclopean.view.figures import Resultants, resultants

__all__ = ["thrust_line"]

PARALLEL = 1e-2  # sine of the angle between two forces below which the point where they meet is too far to matter
AWAY = 1.0  # of a block's size: how far from its centre the meeting point may lie and still be drawn


def thrust_line(result: Result) -> Floats:
    """(t, 2, 3) m: pieces of the line of thrust; none where a free block bears on more than two joints."""
    found = resultants(result)
    none = np.zeros((0, 2, 3))
    if found is None or not len(found.loaded):
        return none
    a, b = result.contacts.a[found.loaded], result.contacts.b[found.loaded]
    block, joint = np.concatenate([a, b]), np.tile(found.loaded, 2)
    free = ~result.fixed[block]
    order = np.argsort(block[free], kind="stable")
    block, joint = block[free][order], joint[free][order]
    who, first, count = np.unique(block, return_index=True, return_counts=True)
    if not len(who) or count.max() > 2:
        return none
    size = np.cbrt(np.abs(result.assembly.mass.volume))
    pieces = []
    for i, start, n in zip(who.tolist(), first.tolist(), count.tolist(), strict=True):
        centre = result.assembly.mass.centroid[i]
        pieces += _through(found, joint[start : start + n].tolist(), centre, float(size[i]))
    return np.array(pieces) if pieces else none


def _through(found: Resultants, joints: list[int], centre: Floats, size: float) -> list[Floats]:
    """Pieces of the line in one block."""
    ends = found.centre[joints]
    if len(joints) == 1:
        return [np.stack([ends[0], centre])]  # where a thrust begins: its weight alone
    force = found.force[joints]
    meeting = _meeting(ends, force / np.linalg.norm(force, axis=1)[:, None])
    if meeting is None or np.linalg.norm(meeting - centre) > AWAY * size:
        return [ends]
    return [np.stack([ends[0], meeting]), np.stack([meeting, ends[1]])]


def _meeting(point: Floats, along: Floats) -> Floats | None:
    """Where two lines come nearest to each other; None where they are as good as parallel."""
    across = np.cross(along[0], along[1])
    sine2 = float(across @ across)
    if not sine2 > PARALLEL**2:
        return None
    apart = point[1] - point[0]
    reach = [float(np.cross(apart, along[1 - k]) @ across) / sine2 for k in range(2)]
    return np.asarray((point[0] + reach[0] * along[0] + point[1] + reach[1] * along[1]) / 2.0)
