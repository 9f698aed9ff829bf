"""Linear programmes in a few bounded unknowns with many inequalities, by the dual simplex method.

    minimise  c . x     subject to  room_k + rows_k . x >= 0,   low <= x <= high

Every x_j begins at the bound that its cost prefers, so that no reduced cost has the wrong sign; then the inequality
that is most violated enters, and what limits it leaves, until none is violated. A bound that is passed on the way is
changed for the other one (the long step of [Maros2003]_). What is kept is the whole tableau, one row for each
inequality and one column for each unknown: with a dozen unknowns and some hundred inequalities, a pivot is one small
outer product. A general solver takes ten times as long to be called as this takes to answer.

By hand: lower a plank x over pegs at heights 0.3 and 0.5, no lower than 0.5; the second peg bears it.

>>> import numpy as np
>>> x, force = least(np.array([1.0]), np.array([[1.0], [1.0]]), np.array([-0.3, -0.5]), np.zeros(1), np.ones(1))
>>> float(x[0]), force.tolist()
(0.5, [0.0, 1.0])

References
----------
.. [Maros2003] Maros: A generalized dual phase-2 simplex algorithm. European Journal of Operational Research 149 (2003).
"""

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.errors import SolverError

__all__ = ["least"]

SLACK = 1e-11  # of the largest room: an inequality violated by less holds
PIVOT = 1e-9  # entries smaller than that are none
MOST = 60  # pivots for each unknown


def least(cost: Floats, rows: Floats, room: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Solve one programme.

    Parameters
    ----------
    cost : (n,) array
        c.
    rows : (m, n) array
        One for each inequality.
    room : (m,) array
        How far each holds at x = 0.
    low, high : (n,) array
        Bounds; that which the cost prefers must be finite.

    Returns
    -------
    x : (n,) array
        The least.
    multiplier : (m,) array
        Of the inequalities, not negative: what a unit of room is worth.

    Raises
    ------
    SolverError
        No x satisfies all, or the method came to no end.
    """
    m, n = rows.shape
    at_high = cost < 0.0
    at = np.where(at_high, high, low)
    table, reduced, value = rows.copy(), cost.copy(), room + rows @ at
    floor, ceiling = np.zeros(m), np.full(m, np.inf)  # bounds of what is in the rows
    least_of, most_of = low.copy(), high.copy()  # bounds of what is in the columns
    in_row, in_column = np.arange(n, n + m), np.arange(n)  # unknowns first, then inequalities
    tolerance = SLACK * (1.0 + float(np.abs(room).max(initial=0.0)))
    for _ in range(MOST * n + 1):
        off = np.maximum(floor - value, value - ceiling)
        r = int(np.argmax(off)) if m else 0
        if not m or not off[r] > tolerance:
            return _answer(in_row, in_column, value, at, reduced)
        up = bool(value[r] < floor[r])
        target, pull = (floor[r], table[r]) if up else (ceiling[r], -table[r])
        helps = np.flatnonzero(np.where(at_high, pull < -PIVOT, pull > PIVOT))
        if not len(helps):
            raise SolverError("linear programme: nothing satisfies all inequalities")
        size = np.abs(pull[helps])
        helps, size = (a[np.lexsort((-size, np.abs(reduced[helps]) / size))] for a in (helps, size))
        gain = np.cumsum(size * (most_of - least_of)[helps])  # of all that are changed over
        k = min(int(np.searchsorted(gain, off[r])), len(helps) - 1)
        if k:
            over = helps[:k]
            step = np.where(at_high[over], least_of[over], most_of[over]) - at[over]
            value = value + table[:, over] @ step
            at[over] += step
            at_high[over] = ~at_high[over]
        j = int(helps[k])
        move = (target - value[r]) / table[r, j]
        value = value + move * table[:, j]
        entered = at[j] + move
        # the unknown of column j goes into row r, what was there into the column, at the bound that it violated
        column, row, share = table[:, j].copy(), table[r] / table[r, j], reduced[j] / table[r, j]
        reduced = reduced - share * table[r]
        reduced[j] = share
        table = table - np.outer(column, row)
        table[:, j] = column / column[r]
        table[r] = -row
        table[r, j] = 1.0 / column[r]
        value[r], at[j], at_high[j] = entered, target, not up
        in_row[r], in_column[j] = in_column[j], in_row[r]
        floor[r], least_of[j], ceiling[r], most_of[j] = least_of[j], floor[r], most_of[j], ceiling[r]
    raise SolverError(f"linear programme: no end after {MOST * n} pivots")


def _answer(in_row: Ints, in_column: Ints, value: Floats, at: Floats, reduced: Floats) -> tuple[Floats, Floats]:
    """Put unknowns and multipliers in their order."""
    n, m = len(in_column), len(in_row)
    whole = np.zeros(n + m)
    whole[in_row], whole[in_column] = value, at
    price = np.zeros(n + m)
    price[in_column] = reduced
    return whole[:n], np.maximum(price[n:], 0.0)
