"""Stones without a bed: every face that bears them is steeper than its friction angle.

Such a stone slides off whatever it lies on, unless its neighbours hold it by thrust: a keystone in its arch, a stone
that is jammed in its wall. That is no fault, but whether it stands then hangs on forces that its own weight does not
call forth. A face bears a stone if the stone's outward normal there points downwards; how steep it is, is the angle
between that normal and gravity.

By hand: at friction 0.5 a stone slides on a face of 45 degrees (its friction angle is 26.6 degrees), at friction 1 it
lies on it.

>>> import numpy as np
>>> from cyclopean.assembly import Assembly, Block, Contacts
>>> corners = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 1, 0], [1, 1, 0], [1, 1, 1]], float)
>>> faces = ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0))
>>> wedge, above = Block("ramp", corners, faces), Block("stone", corners + [0, 0, 1], faces)
>>> for mu in (0.5, 1.0):
...     slope = Contacts.of([(0, 1)], [corners[[2, 5, 3, 0]]], [mu])
...     found = steep_beds(Assembly((wedge, above)), slope, np.array([True, False]), np.array([0.0, 0.0, -9.8]))
...     print(len(found), *(f"{one.block} {one.angle:.1f} {one.friction:.1f}" for one in found))
1 stone 45.0 26.6
0
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.assembly.blocks import Assembly, held_directions
from cyclopean.assembly.contacts import Contacts

__all__ = ["SteepBed", "steep_beds"]

EXACT = 1e-9  # rad: a face as steep as its friction angle still bears, whatever rounding makes of it


@dataclass(frozen=True, slots=True)
class SteepBed:
    """A stone that no face bears by itself, and the face that comes nearest to it."""

    block: str  # id
    angle: float  # degrees from level of that face; above 90, nothing lies below the stone at all
    friction: float  # degrees, friction angle there
    neighbours: tuple[str, ...]  # ids of what touches its other faces and may hold it by thrust; () = nothing can

    def words(self) -> str:
        """The stone and its bed in one line."""
        return f"'{self.block}' ({self.angle:.0f} degrees, friction {self.friction:.0f})"


def steep_beds(assembly: Assembly, contacts: Contacts, fixed: Bools, gravity: Floats) -> tuple[SteepBed, ...]:
    """Stones all of whose bearing faces are steeper than the friction angle there.

    Parameters
    ----------
    assembly : Assembly
        The blocks (n). Those that are fixed, partly held, or joined by a face that may pull are not looked at.
    contacts : Contacts
        Between them, mu given at each.
    fixed : (n,) bool
        Supports.
    gravity : (3,) float
        m/s2; no stone is listed where it vanishes.

    Returns
    -------
    tuple of SteepBed
        In the order of the blocks; stones that touch nothing are not among them.
    """
    size, count = float(np.linalg.norm(gravity)), len(contacts)
    if not size > 0.0 or not count:
        return ()
    down = np.clip(contacts.frame[:, 0] @ (gravity / size), -1.0, 1.0)
    block = np.concatenate([contacts.a, contacts.b])
    angle, friction = np.arccos(np.concatenate([down, -down])), np.tile(np.arctan(contacts.mu), 2)
    excess = angle - friction
    order = np.lexsort((excess, block))
    first = order[np.unique(block[order], return_index=True)[1]]  # the best face of each block
    held = fixed | held_directions(assembly).any(axis=1)
    held[block[np.tile(contacts.strength > 0.0, 2)]] = True
    listed = first[(excess[first] > EXACT) & ~held[block[first]]]
    other = np.concatenate([contacts.b, contacts.a])
    name = [one.id for one in assembly.blocks]
    found = []
    for k in listed.tolist():
        beside = np.unique(other[(block == block[k]) & (np.arange(2 * count) != k)])
        bed = float(np.degrees(angle[k])), float(np.degrees(friction[k]))
        found.append(SteepBed(name[block[k]], *bed, tuple(name[i] for i in beside.tolist())))
    return tuple(found)
