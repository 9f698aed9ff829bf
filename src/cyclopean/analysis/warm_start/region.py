"""Part of a system, with all that lies outside held where it is."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.equilibrium.components import group
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.statics import EquilibriumSystem

__all__ = ["Region", "around", "region", "way_down"]


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """Some blocks of a system, and the points that touch them."""

    part: EquilibriumSystem  # of these blocks alone: all others count as fixed
    point: Ints  # (k,) its points in the whole
    dof: Ints  # (6 b,) its rows in the whole
    rim: Bools  # (k,) points that a free block outside touches too

    def given(self, system: EquilibriumSystem, dq: Floats) -> Floats:
        """(k, 3) dd at its points if its own blocks stay where they are and all others move by dq."""
        others = dq.copy()
        others[self.dof] = 0.0
        return system.gap(others)[self.point]


def region(system: EquilibriumSystem, blocks: Ints) -> Region:
    """Cut the region of these blocks, (b,) sorted rows of free blocks, out of a system."""
    inside = np.zeros(system.blocks, bool)
    inside[blocks] = True
    part = group(system, inside)
    a, b = system.row_a[part.points], system.row_b[part.points]
    rim = ((a >= 0) & ~inside[a]) | ((b >= 0) & ~inside[b])
    return Region(part.system, part.points, (6 * blocks[:, None] + np.arange(6)).ravel(), rim)


def around(system: EquilibriumSystem, blocks: Ints, radius: int) -> Ints:
    """Free blocks at most so many joints away from those of the given numbers, sorted."""
    inside = np.zeros(system.blocks, bool)
    inside[blocks] = True
    a, b = system.row_a, system.row_b
    between = (a >= 0) & (b >= 0)
    a, b = a[between], b[between]
    for _ in range(radius):
        touched = inside[a] | inside[b]
        inside[a[touched]] = inside[b[touched]] = True
    return np.flatnonzero(inside)


def way_down(system: EquilibriumSystem, blocks: Ints) -> Ints:
    """Blocks on one shortest way, joint by joint, from each of the given ones to a support; sorted, these included."""
    from scipy.sparse.csgraph import breadth_first_order

    m = system.blocks
    a, b = (np.where(row >= 0, row, m) for row in (system.row_a, system.row_b))  # all supports are one
    joints = sp.csr_matrix((np.ones(len(a)), (a, b)), shape=(m + 1, m + 1))
    below = breadth_first_order(joints, m, directed=False)[1]
    found = set()
    for block in blocks.tolist():
        while block >= 0 and block != m and block not in found:
            found.add(block)
            block = int(below[block])
    return np.array(sorted(found), int)
