"""One stone for each cell: assignment by what is carved off and what is left void.

A pair costs carved + w void = V_s + w V_c - (1 + w) I, with I the volume in common. The void of all cells counts, those
that get no stone included, so w V_c is a constant and V_s - (1 + w) I is what is added up: right with more stones than
cells and with fewer. The best pose has the most I whatever w is, so every w costs one assignment.

By hand: stones of 3 and 2, cells of 2 and 2, I = [[2, 1], [2, 2]]: the greedy pair (0, 0) is also the best, total I 4.

>>> assign(np.array([[2.0, 1.0], [2.0, 2.0]]), np.array([3.0, 2.0]), 1.0).tolist()
[0, 1]
"""

import numpy as np

from cyclopean.arrays import Floats, Ints

__all__ = ["assign", "costs", "prices", "weight_for_gap"]

LIGHTEST, HEAVIEST = 1e-2, 1e2  # weights between which one is looked for
HALVINGS = 12
EXACT = 1e-12  # of the largest cost: a price that falls by less has settled
PASSES = 500


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


def weight_for_gap(shared: Floats, volume: Floats, cell_volume: Floats, gap: float) -> tuple[float, Ints]:
    """Least weight at which void / volume of all cells is no more than `gap`, and the assignment there.

    The more void costs, the less of it there is. Where even the heaviest weight leaves more, that one is the answer.
    """
    cell = np.arange(shared.shape[1])

    def found(weight: float) -> tuple[Ints, float]:
        chosen = assign(shared, volume, weight)
        filled = np.where(chosen >= 0, shared[chosen, cell], 0.0)
        return chosen, 1.0 - float(filled.sum() / cell_volume.sum())

    low, high = LIGHTEST, HEAVIEST
    best, reached = found(low)
    if reached <= gap:
        return low, best
    best, _ = found(high)
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        chosen, reached = found(middle)
        if reached <= gap:
            high, best = middle, chosen
        else:
            low = middle
    return high, best
