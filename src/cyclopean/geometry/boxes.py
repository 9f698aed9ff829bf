"""Which boxes meet."""

import numpy as np

from cyclopean.arrays import Floats, Ints

__all__ = ["box_pairs", "meeting_boxes"]

DIRECT = 1 << 15  # comparisons up to which all are made


def box_pairs(low: Floats, high: Floats, reach: float) -> tuple[Ints, Ints]:
    """Pairs (i < j, sorted) of the boxes `low`, `high`, both (n, 3) in m, that come within `reach` of each other."""
    i, j = meeting_boxes(low, high, low, high, reach)
    once = i < j
    return i[once], j[once]


def meeting_boxes(low_a: Floats, high_a: Floats, low_b: Floats, high_b: Floats, reach: float) -> tuple[Ints, Ints]:
    """Pairs (i, j), sorted, of boxes a[i] and b[j], corners (n, 3) and (m, 3) in m, within `reach` of each other.

    Few are compared one by one; of many a packed tree is made over the two axes along which most stand side by side.

    Examples
    --------
    >>> one, two = np.zeros((1, 3)), np.array([[2.0, 0, 0], [5.0, 0, 0]])
    >>> i, j = meeting_boxes(one, one + 1.0, two, two + 1.0, 1.5)
    >>> i.tolist(), j.tolist()
    ([0], [0])
    """
    none = np.zeros(0, np.int64)
    if not len(low_a) or not len(low_b):
        return none, none
    a = np.flatnonzero(np.all((low_a <= high_b.max(axis=0) + reach) & (high_a >= low_b.min(axis=0) - reach), axis=1))
    if not len(a):
        return none, none
    here_low, here_high = low_a[a] - reach, high_a[a] + reach
    b = np.flatnonzero(np.all((low_b <= here_high.max(axis=0)) & (high_b >= here_low.min(axis=0)), axis=1))
    if not len(b):
        return none, none
    there_low, there_high = low_b[b], high_b[b]
    if len(a) * len(b) <= DIRECT:
        near = np.ones((len(a), len(b)), bool)
        for x in range(3):
            near &= (here_low[:, None, x] <= there_high[None, :, x]) & (here_high[:, None, x] >= there_low[None, :, x])
        i, j = np.nonzero(near)
        return a[i], b[j]
    import shapely

    spread = np.ptp(np.concatenate([there_low, there_high]), axis=0)
    x, y, z = np.argsort(-spread / np.maximum((there_high - there_low).mean(axis=0), 1e-300), kind="stable")
    there = shapely.box(there_low[:, x], there_low[:, y], there_high[:, x], there_high[:, y])
    here = shapely.box(here_low[:, x], here_low[:, y], here_high[:, x], here_high[:, y])
    i, j = shapely.STRtree(there).query(here)
    order = np.lexsort((j, i))
    i, j = i[order], j[order]
    near = (here_low[i, z] <= there_high[j, z]) & (here_high[i, z] >= there_low[j, z])
    return a[i[near]], b[j[near]]
