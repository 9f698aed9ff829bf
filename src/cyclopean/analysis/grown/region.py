"""Part of a system, with all that lies outside held where it is."""

from dataclasses import dataclass, replace

import numpy as np

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
    place = np.full(system.blocks + 1, -1)  # the last for supports, row -1
    place[blocks] = np.arange(len(blocks))
    a, b = place[system.row_a], place[system.row_b]
    point = np.flatnonzero((a >= 0) | (b >= 0))
    dof = (6 * blocks[:, None] + np.arange(6)).ravel()
    column = (3 * point[:, None] + np.arange(3)).ravel()
    part = replace(
        system,
        free=system.free[blocks],
        used=system.used[point],
        row_a=a[point],
        row_b=b[point],
        arm_a=system.arm_a[point],
        arm_b=system.arm_b[point],
        frame=system.frame[point],
        mu=system.mu[point],
        A=system.A[dof][:, column].tocsr(),
        p=system.p[dof],
        held=system.held[blocks] if len(system.held) else system.held,
        pull=system.pull[point] if len(system.pull) else system.pull,
        size=None if system.size is None else system.size[blocks],
        weight=None if system.weight is None else system.weight[blocks],
        diagonal=None if system.diagonal is None else system.diagonal[blocks],
    )
    outside = ((a < 0) & (system.row_a >= 0)) | ((b < 0) & (system.row_b >= 0))
    return Region(part, point, dof, outside[point])


def around(system: EquilibriumSystem, blocks: Ints, radius: int) -> Ints:
    """Free blocks at most so many joints away from the given ones, sorted."""
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
