"""Packed lists of lists, rings and classes: the index tricks that replace nested loops."""

from collections.abc import Iterator, Sequence

import numpy as np

from cyclopean.arrays import Floats, Ints

__all__ = ["components", "extents", "following", "numbered", "offsets", "ragged", "ragged_batches"]

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


def offsets(count: Sequence[int] | Ints) -> Ints:
    """(n + 1,) where each of n lists begins that hold so many entries, and where the last one ends."""
    start = np.zeros(len(count) + 1, np.int64)
    np.cumsum(count, out=start[1:])
    return start


def extents(value: Floats, start: Ints) -> tuple[Floats, Floats]:
    """(n, ...) least and greatest of each of n lists packed at offsets `start`; inverted where one is empty."""
    low, high = (np.full((len(start) - 1, *value.shape[1:]), end) for end in (np.inf, -np.inf))
    held = np.flatnonzero(np.diff(start) > 0)
    if len(held):
        low[held], high[held] = (end.reduceat(value, start[held]) for end in (np.minimum, np.maximum))
    return low, high


def following(start: Ints) -> Ints:
    """(m,) for each entry of rings packed at offsets `start` (n + 1,), the position of the next one round its ring.

    Examples
    --------
    >>> following(np.array([0, 3, 5])).tolist()
    [1, 2, 0, 4, 3]
    """
    after = np.arange(1, int(start[-1]) + 1)
    after[start[1:] - 1] = start[:-1]
    return after


def numbered(label: Ints) -> Ints:
    """(n,) the same classes, numbered in order of first appearance."""
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    rank = np.zeros(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.asarray(rank[inverse.reshape(-1)])


def components(count: int, a: Ints, b: Ints) -> Ints:
    """(count,) which of `count` things hang together by pairs a[k], b[k]: classes in order of first appearance.

    The root of each class is its first member, and roots of classes that touch go to the lower one until none touch
    [Shiloach1982]_. SciPy has it too, in a module that takes longer to load than a small model to be solved.

    Examples
    --------
    >>> components(4, np.array([3]), np.array([1])).tolist()
    [0, 1, 2, 1]

    References
    ----------
    .. [Shiloach1982] Shiloach, Vishkin: An O(log n) parallel connectivity algorithm. Journal of Algorithms 3 (1982).
    """
    root = np.arange(count)
    while (root[a] != root[b]).any():
        one, other = root[a], root[b]
        low = np.minimum(one, other)
        np.minimum.at(root, one, low)
        np.minimum.at(root, other, low)
        while (root[root] != root).any():
            root = root[root]
    return np.asarray((np.cumsum(root == np.arange(count)) - 1)[root])
