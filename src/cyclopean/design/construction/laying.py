"""What whoever lays a stone wants to know of it: how heavy, how large, where to sling it, what lies around it, when.

Lengths are measured in the wall, along three ways: along it, from its face to its back, and up. The face is the side
that is seen when the wall runs to the right.
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.construction.blocking import neighbours
from cyclopean.design.construction.centring import Prop
from cyclopean.design.construction.sequence import BuildSequence

__all__ = ["Holding", "LaidStone", "axes_of", "laid_stones"]


@dataclass(frozen=True, slots=True)
class Holding:
    """A prop that has to do with a stone."""

    number: int  # of the prop, from 1
    prop: Prop
    own: bool  # it holds this very stone; else it only stands while the stone is laid


@dataclass(frozen=True, slots=True, eq=False)
class LaidStone:
    """One stone, ready to be laid."""

    step: int  # from 1
    block: int  # index in the structure
    id: str
    layer: int
    mass: float  # kg
    size: Floats  # (3,) m of its box: along the wall, from face to back, up
    centre: Floats  # (3,) m, centre of gravity: from the left end of its box, from its face, from its bed
    rests_on: tuple[int, ...]  # blocks
    carries: tuple[int, ...]
    beside: tuple[int, ...]
    props: tuple[Holding, ...]


def axes_of(sequence: BuildSequence) -> Floats:
    """(3, 3) unit rows: along the wall, from its face to its back, up."""
    return np.stack([sequence.along, np.cross(sequence.up, sequence.along), sequence.up])


def laid_stones(sequence: BuildSequence) -> tuple[LaidStone, ...]:
    """Every stone that is laid, the first to be laid first.

    By hand, the second of two cubes of 1 m, one on the other:

    >>> from cyclopean.design import stack
    >>> from cyclopean.design.construction.sequence import build_sequence
    >>> stone = laid_stones(build_sequence(stack(2)))[1]
    >>> stone.step, stone.id, stone.size.round(9).tolist(), stone.centre.round(9).tolist(), len(stone.rests_on)
    (2, 'b02', [1.0, 1.0, 1.0], [0.5, 0.5, 0.5], 1)
    """
    assembly, axes = sequence.assembly, axes_of(sequence)
    mass = assembly.densities(sequence.density) * np.abs(assembly.mass.volume)
    near = neighbours(sequence.contacts, len(assembly))
    upper = [set[int]() for _ in near]
    for step in sequence.steps:
        for below in step.rests_on:
            upper[below].add(step.block)
    found = []
    for number, step in enumerate(sequence.steps, 1):
        i = step.block
        local = assembly.blocks[i].vertices @ axes.T
        low, size = local.min(axis=0), np.ptp(local, axis=0)
        others = set(near[i].block.tolist()) - upper[i] - set(step.rests_on)
        found.append(
            LaidStone(
                number,
                i,
                assembly.blocks[i].id,
                step.layer,
                float(mass[i]),
                size,
                axes @ assembly.mass.centroid[i] - low,
                step.rests_on,
                tuple(sorted(upper[i])),
                tuple(sorted(others)),
                tuple(
                    Holding(k, prop, i in prop.blocks)
                    for k, prop in enumerate(sequence.props, 1)
                    if i in prop.blocks or prop.first <= number - 1 <= prop.last or prop.until == i
                ),
            )
        )
    return tuple(found)
