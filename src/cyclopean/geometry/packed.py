"""Packed lists of lists: the one index trick that replaces nested loops."""

from collections.abc import Iterator

import numpy as np

from cyclopean.arrays import Ints

__all__ = ["ragged", "ragged_batches"]

BATCH = 1 << 20  # rows expanded at a time: a few tens of megabytes


def ragged(start: Ints, row: Ints) -> tuple[Ints, Ints]:
    """Positions of everything that the wanted rows hold in an array packed at offsets `start`.

    Returns
    -------
    entry : (m,) int
        Which entry of `row` each position belongs to.
    position : (m,) int
        Index into the packed array.

    Examples
    --------
    >>> entry, position = ragged(np.array([0, 2, 5]), np.array([1, 0]))
    >>> entry.tolist(), position.tolist()
    ([0, 0, 0, 1, 1], [2, 3, 4, 0, 1])
    """
    count = start[row + 1] - start[row]
    before = np.cumsum(count) - count
    entry = np.repeat(np.arange(len(row)), count)
    return entry, np.arange(len(entry)) + np.repeat(start[row] - before, count)


def ragged_batches(start: Ints, row: Ints) -> Iterator[tuple[Ints, Ints]]:
    """`ragged`, in batches of whole rows that hold about a million positions each, so that memory stays modest."""
    total = np.cumsum(start[row + 1] - start[row])
    first = 0
    while first < len(row):
        done = total[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(total, done + BATCH, side="right")))
        entry, position = ragged(start, row[first:last])
        yield entry + first, position
        first = last
