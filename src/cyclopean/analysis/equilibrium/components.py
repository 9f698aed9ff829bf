"""Parts of a system that share no force: components of free blocks joined by contact points, and groups of blocks."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.geometry import packed
from cyclopean.statics import EquilibriumSystem

__all__ = ["Part", "component_labels", "components", "group", "in_own_units", "lightest", "with_points"]


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Some of a system's free blocks with all points at them; blocks beyond stand still."""

    system: EquilibriumSystem
    blocks: Ints  # (k,) rows of the whole system's free blocks
    points: Ints  # (r,) rows of its points

    def spread(self, y: Floats, blocks: int) -> Floats:
        """(6 m,) motion of the whole system of m blocks: y of this part, zero elsewhere."""
        whole = np.zeros((blocks, 6))
        whole[self.blocks] = y.reshape(-1, 6)
        return whole.ravel()


def component_labels(system: EquilibriumSystem) -> Ints:
    """(m,) number of the component of each free block, from 0; fixed blocks join nothing."""
    both = (system.row_a >= 0) & (system.row_b >= 0)
    return packed.components(system.blocks, system.row_a[both], system.row_b[both])


def lightest(label: Ints, weight: Floats) -> Floats:
    """(m,) weight of the lightest block in the component of each block, of (m,) labels and weights."""
    least = np.full(int(label.max(initial=-1)) + 1, np.inf)
    np.minimum.at(least, label, weight)
    return np.asarray(least[label])


def components(system: EquilibriumSystem) -> list[Part]:
    """The components as systems of their own, in the units of the whole."""
    label = component_labels(system)
    count = int(label.max(initial=-1)) + 1
    if count == 1:
        return [Part(system, np.arange(system.blocks), np.arange(system.points))]
    return [group(system, label == c) for c in range(count)]


def in_own_units(system: EquilibriumSystem) -> tuple[EquilibriumSystem, float, float]:
    """The same in units of its own mean weight and mean size, and these in the units before."""
    force, length = float(np.mean(system.weight)), float(np.mean(system.diagonal)) / np.sqrt(3.0)  # of a cube the edge
    turning = np.tile(np.repeat([1.0, 1.0 / length], 3), system.blocks)
    scaled = replace(
        system,
        arm_a=system.arm_a / length,
        arm_b=system.arm_b / length,
        A=(sp.diags(turning) @ system.A).tocsr(),
        p=turning * system.p / force,
        force_unit=system.force_unit * force,
        length_unit=system.length_unit * length,
        size=None if system.size is None else system.size / force,
        pull=system.pull / force,
        weight=system.weight / force,
        diagonal=system.diagonal / length,
    )
    return scaled, force, length


def group(system: EquilibriumSystem, chosen: Bools) -> Part:
    """The chosen (m,) blocks alone: all others are held at rest, as if they were fixed."""
    blocks = np.flatnonzero(chosen)
    row = np.full(system.blocks + 1, -1)  # the last for fixed blocks, which are numbered -1
    row[blocks] = np.arange(len(blocks))
    points = np.flatnonzero((row[system.row_a] >= 0) | (row[system.row_b] >= 0))
    six = (6 * blocks[:, None] + np.arange(6)).ravel()
    fewer = with_points(system, points)
    part = replace(
        fewer,
        free=system.free[blocks],
        row_a=row[fewer.row_a],
        row_b=row[fewer.row_b],
        A=fewer.A[six],
        p=system.p[six],
        held=system.held[blocks] if len(system.held) else system.held,
        size=None if system.size is None else system.size[blocks],
        weight=system.weight[blocks],
        diagonal=system.diagonal[blocks],
        rows=None if system.rows is None else system.rows[six],
    )
    return Part(part, blocks, points)


def with_points(system: EquilibriumSystem, points: Ints) -> EquilibriumSystem:
    """The same with these (r,) of its points alone."""
    three = (3 * points[:, None] + np.arange(3)).ravel()
    return replace(
        system,
        used=system.used[points],
        row_a=system.row_a[points],
        row_b=system.row_b[points],
        arm_a=system.arm_a[points],
        arm_b=system.arm_b[points],
        frame=system.frame[points],
        mu=system.mu[points],
        A=system.A[:, three].tocsr(),
        pull=system.pull[points] if len(system.pull) else system.pull,
    )
