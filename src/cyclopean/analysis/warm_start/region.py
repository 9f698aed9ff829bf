"""Part of a system, with all that lies outside held where it is."""

from dataclasses import dataclass

import numpy as np

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
    m = system.blocks
    ends = np.stack([system.row_a, system.row_b], 1)
    ends = np.unique(np.where(ends >= 0, ends, m), axis=0)  # all supports are one
    ends = np.concatenate([ends, ends[:, ::-1]])
    far = np.full(m + 1, m + 1)
    far[m] = 0
    for step in range(1, m + 1):
        reached = ends[far[ends[:, 0]] == step - 1, 1]
        reached = reached[far[reached] > step]
        if not len(reached):
            break
        far[reached] = step
    found = set()
    for block in blocks.tolist():
        while block != m and block not in found:
            found.add(block)
            beside = ends[ends[:, 0] == block, 1]
            block = int(beside[np.argmin(far[beside])]) if len(beside) else m
    return np.array(sorted(found), int)
