"""Whether a stone can be brought to its place: directions in which its neighbours let it go.

A stone may move along d, at first, if it leaves no neighbour's face behind itself: n.d >= 0 for the normal n of every
joint, pointing from the neighbour into the stone. These half-spaces meet in a cone; it is brought in against such a d.
Of all that are free the one nearest to `up` is taken. The nearest point of a cone of half-spaces to a given direction
is that direction itself, or its projection onto one face, or an edge (the cross product of two normals), so all of
these are tried; where none rises, edges and directions within one face are what is left of the cone.

It is a test of the first instant of a straight move. Whether the path further out is clear of stones that do not touch
is not asked.

By hand: a stone on a bed, n = (0, 0, 1), between two upright joints, n = (1, 0, 0) and (-1, 0, 0), goes straight up. A
dovetail's sides, n = (+-0.8, 0, -0.6), and its bed, n = (0, 0, 1), leave only y.

>>> freest(np.array([[0.8, 0, -0.6], [-0.8, 0, -0.6], [0, 0, 1.0]]), np.array([0.0, 0, 1])).tolist()
[0.0, -1.0, 0.0]
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Contacts

__all__ = ["Neighbours", "blockers", "freest", "insertion", "neighbours"]

SLIDE = 1e-6  # n.d may be that much below 0: a stone slides along a joint
SAME = 7  # decimals at which two normals are one
BATCH = 4096  # candidate directions looked at together


@dataclass(frozen=True, slots=True, eq=False)
class Neighbours:
    """What touches a block."""

    block: Ints  # (k,) the other block
    normal: Floats  # (k, 3) unit, from it into this one


def neighbours(contacts: Contacts, count: int) -> list[Neighbours]:
    """Joints of every block, with normals that point into it."""
    normal = contacts.frame[:, 0] if len(contacts) else np.zeros((0, 3))
    here = np.concatenate([contacts.b, contacts.a])
    other = np.concatenate([contacts.a, contacts.b])
    into = np.concatenate([normal, -normal])
    order = np.argsort(here, kind="stable")
    cut = np.searchsorted(here[order], np.arange(count + 1))
    rows = [order[cut[i] : cut[i + 1]] for i in range(count)]
    return [Neighbours(other[row], into[row]) for row in rows]


def insertion(around: Neighbours, standing: Collection[int], up: Floats) -> Floats | None:
    """(3,) unit direction in which a block can be taken away from its standing neighbours; None where it is trapped."""
    there = np.array([block in standing for block in around.block.tolist()], bool)
    return freest(around.normal[there], up)


def blockers(around: Neighbours, standing: Collection[int], up: Floats) -> tuple[int, ...]:
    """Standing neighbours that trap a block together, none of whom could be left out; () where it is free; up (3,)."""
    if insertion(around, standing, up) is not None:
        return ()
    needed = sorted({int(block) for block in around.block if int(block) in standing})
    for block in list(needed):
        fewer = [other for other in needed if other != block]
        if insertion(around, fewer, up) is None:
            needed = fewer
    return tuple(needed)


def freest(normal: Floats, up: Floats) -> Floats | None:
    """(3,) unit d with n.d >= 0 for all (k, 3) normals n and d.up as large as possible; None where there is none.

    Among directions that rise equally (or fall equally) the first of a fixed list, so that the answer is repeatable.
    """
    n = np.unique(np.round(normal, SAME) + 0.0, axis=0) if len(normal) else np.zeros((0, 3))
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    if np.all(n @ up >= -SLIDE):
        return np.asarray(up, float) + 0.0
    best, height = None, -np.inf
    candidates = _candidates(n, up)
    for first in range(0, len(candidates), BATCH):
        some = candidates[first : first + BATCH]
        rise = np.where(np.all(some @ n.T >= -SLIDE, axis=1), some @ up, -np.inf)
        top = int(np.argmax(rise > np.max(rise) - 1e-9))  # the first of those that rise as much
        if rise[top] > height + 1e-9:
            best, height = some[top] + 0.0, float(rise[top])
    return best


def _candidates(n: Floats, up: Floats) -> Floats:
    """(m, 3) unit: `up` brought into every face, edges of the cone, and normals, for where only a half-line is left."""
    faces = up - (n @ up)[:, None] * n
    i, j = np.triu_indices(len(n), 1)
    edges = np.cross(n[i], n[j])
    within = np.concatenate([np.cross(n, axis) for axis in np.eye(3)])  # lines of a face, where all faces are one
    found = np.concatenate([faces, within, -within, edges, -edges, n])
    size = np.linalg.norm(found, axis=1)
    keep = size > 1e-6
    return np.asarray(found[keep] / size[keep, None])
