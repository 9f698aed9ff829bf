"""Colours for stones, such that no two that touch share one.

DSATUR [Brelaz]_: next comes the stone whose neighbours already show the most different colours, among those the one
with the most neighbours; it gets the first colour that none of them has. At most one colour more than the most joined
stone has neighbours, and exactly two wherever two would do.

References
----------
.. [Brelaz] Brelaz: New methods to color the vertices of a graph. Communications of the ACM 22 (1979).
"""

import heapq

import numpy as np

from cyclopean.arrays import Ints
from cyclopean.assembly import Contacts
from cyclopean.design.construction.blocking import neighbours

__all__ = ["colouring"]


def colouring(contacts: Contacts, count: int) -> Ints:
    """(n,) colour 0, 1, ... of each of `count` blocks; blocks with a joint between them differ."""
    touching = [set(one.block.tolist()) for one in neighbours(contacts, count)]
    colour = np.full(count, -1)
    seen: list[set[int]] = [set() for _ in range(count)]
    queue = [(0, -len(touching[i]), i) for i in range(count)]
    heapq.heapify(queue)
    while queue:
        shown, _, block = heapq.heappop(queue)
        if colour[block] >= 0 or -shown != len(seen[block]):
            continue  # an entry from before a neighbour got its colour
        colour[block] = next(c for c in range(count) if c not in seen[block])
        for other in touching[block]:
            if colour[other] < 0 and colour[block] not in seen[other]:
                seen[other].add(int(colour[block]))
                heapq.heappush(queue, (-len(seen[other]), -len(touching[other]), other))
    return colour
