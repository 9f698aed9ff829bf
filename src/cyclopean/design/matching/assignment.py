"""One stone for each cell: assignment by what is carved off and what is left void.

A pair costs carved + w void = V_s + w V_c - (1 + w) I, with I the volume in common. The void of all cells counts, those
that get no stone included, so w V_c is a constant and V_s - (1 + w) I is what is added up: right with more stones than
cells and with fewer. The best pose has the most I whatever w is, so every w costs one assignment.

By hand: stones of 3 and 2, cells of 2 and 2, I = [[2, 1], [2, 2]]: the greedy pair (0, 0) is also the best, total I 4.

>>> assign(np.array([[2.0, 1.0], [2.0, 2.0]]), np.array([3.0, 2.0]), 1.0).tolist()
[0, 1]
"""

from collections.abc import Callable

import numpy as np

from cyclopean.arrays import Floats, Ints

__all__ = ["assign", "costs", "prices", "weight_for_gap"]

LIGHTEST, HEAVIEST = 1e-2, 1e2  # weights between which one is looked for
FINE = 1.0025  # ratio of two weights between which none is looked for
NEARBY = 1.02  # ratio of a weight to the first that is tried beside it
EXACT = 1e-12  # of the largest cost: a price that falls by less has settled
PASSES = 500  # of Bellman and Ford, at most


def costs(shared: Floats, volume: Floats, weight: float) -> Floats:
    """(n, m) m3: what each pair adds to carved + w void."""
    return np.asarray(volume[:, None] - (1.0 + weight) * shared)


def assign(shared: Floats, volume: Floats, weight: float) -> Ints:
    """Stone (m,) of each cell at the least total cost; -1 where there are not enough stones.

    Parameters
    ----------
    shared : (n, m) float
        m3 that stone i and cell j have in common.
    volume : (n,) float
        m3 of each stone.
    weight : float
        What void costs, where carving costs 1.
    """
    from scipy.optimize import linear_sum_assignment

    stone, cell = linear_sum_assignment(costs(shared, volume, weight))
    found = np.full(shared.shape[1], -1, np.int64)
    found[cell] = stone
    return found


def prices(cost: Floats, chosen: Ints) -> tuple[Floats, Floats]:
    """Dual prices (n,) of stones and (m,) of cells of a best assignment: cost - u - v >= 0, and 0 where chosen.

    The side of which some are left over has prices of at most 0, and 0 where left over; of these prices the highest
    are found, by shortest paths (Bellman and Ford).

    Parameters
    ----------
    cost : (n, m) float
        As it was assigned by.
    chosen : (m,) int
        Stone of each cell or -1.
    """
    if (chosen < 0).any():
        given = np.flatnonzero(chosen >= 0)
        cell_of = np.zeros(len(cost), np.int64)
        cell_of[chosen[given]] = given
        v, u = prices(cost.T, cell_of)
        return u, v
    between = cost[chosen]  # (m, m): only stones that are used have a price
    own = np.diagonal(between)
    u = np.zeros(len(chosen))
    settled = EXACT * float(np.abs(own).max(initial=0.0))
    for _ in range(min(PASSES, len(chosen) + 1)):
        lower = np.minimum(u, (between - (own - u)).min(axis=1))
        if (lower >= u - settled).all():
            break
        u = lower
    found = np.zeros(len(cost))
    found[chosen] = u
    return found, own - u


def weight_for_gap(
    shared: Floats, volume: Floats, cell_volume: Floats, gap: float, near: float | None = None
) -> tuple[float, Ints]:
    """Least weight at which void / volume of all cells is no more than `gap`, and the assignment there.

    The more void costs, the less of it there is. Where even the heaviest weight leaves more, that one is the answer.

    Parameters
    ----------
    shared : (n, m) float
        m3 that stone i and cell j have in common.
    volume, cell_volume : (n,) float, (m,) float
        m3 of each stone and of each cell.
    gap : float
        Share of all cells that may be void.
    near : float, optional
        Where to look first, such as the answer to nearly the same numbers.
    """
    cell = np.arange(shared.shape[1])
    found: dict[float, Ints] = {}

    def reaches(weight: float) -> bool:
        chosen = found.setdefault(weight, assign(shared, volume, weight))
        filled = np.where(chosen >= 0, shared[chosen, cell], 0.0)
        return 1.0 - float(filled.sum() / cell_volume.sum()) <= gap

    if near is None:
        low, high = LIGHTEST, HEAVIEST
        if reaches(low):
            return low, found[low]
        reaches(high)
    else:
        low, high = _bracket(reaches, near)
        if low == high:
            return low, found[low]
    while high > FINE * low:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if reaches(middle) else (middle, high)
    return high, found[high]


def _bracket(reaches: Callable[[float], bool], near: float) -> tuple[float, float]:
    """A weight that does not reach the gap and a heavier one that does; twice the last one where there are none."""
    way, step, last = reaches(near), NEARBY, near
    while True:
        weight = float(np.clip(last / step if way else last * step, LIGHTEST, HEAVIEST))
        if weight == last or reaches(weight) != way:
            return (weight, last) if way else (last, weight)
        step, last = step * step, weight
