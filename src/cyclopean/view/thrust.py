"""The line of thrust of a structure in which every block bears on two joints at most: arches, columns, buttresses.

It is Moseley's line of resistance (1843): through the centre of pressure of each joint, so that it stays inside stones
that are not hollowed out. Where it comes near an edge, a hinge will open.
"""

import numpy as np

from cyclopean.analysis import Result
from cyclopean.arrays import Floats
from cyclopean.view.figures import resultants


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
    begins = np.where((count == 2)[:, None], found.centre[joint[first + count - 1]], result.assembly.mass.centroid[who])
    return np.stack([found.centre[joint[first]], begins], 1)  # where a block bears on one joint, its weight alone
