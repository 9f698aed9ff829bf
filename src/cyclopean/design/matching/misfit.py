"""What can be said of a stock of stones before they are matched: where no choice of stones can make the wall.

All of it is certain: bounds that hold however stones are given to cells and turned in them.

By hand: stones of 1 and 4 L for cells of 2 and 3 L. The larger stone fills the larger cell at most, the smaller one
half of its own: at least 1 of 5 L stays void.

>>> round(least_gap(np.array([1.0, 4.0]), np.array([2.0, 3.0])), 6)
0.2
"""

from collections.abc import Sequence

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.matching.cells import Cells
from cyclopean.design.stones.stone import Stone

__all__ = ["least_gap", "misfits"]

USUAL = 0.1  # gap from which too little stone is told where none was asked for: carved joints have to bear
SHORT = 0.8  # of the length of a cell: what is shorter leaves a fifth of it void, or more
NAMED = 4  # cells named one by one
ALIKE = 30.0  # times that stones may be larger than cells, or smaller, before it looks like a slip of units


def least_gap(stone: Floats, cell: Floats) -> float:
    """Share of the cells' volume that stays void whichever stone goes where, by volumes (n,) and (m,) alone.

    A pair shares no more than the smaller of both; of all assignments that of largest to largest shares most (the
    smaller of two numbers is a supermodular function of both).
    """
    pairs = min(len(stone), len(cell))
    shared = np.minimum(np.sort(stone)[::-1][:pairs], np.sort(cell)[::-1][:pairs]).sum()
    return float(1.0 - shared / cell.sum())


def misfits(stones: Sequence[Stone], cells: Cells, gap: float | None = None) -> tuple[str, ...]:
    """Say why these stones cannot make this wall well, one line each; nothing where no bound speaks against it.

    Parameters
    ----------
    stones : sequence of Stone
        At least one.
    cells : Cells
        Where they may go.
    gap : float, optional
        Share that may stay void.
    """
    volume, length = np.array([s.volume for s in stones]), np.array([_diameter(s.vertices) for s in stones])
    times = float(np.cbrt(np.median(cells.volume) / np.median(volume)))
    if not 1.0 / ALIKE <= times <= ALIKE:
        said = f"{times:.3g} times as large as" if times > 1.0 else f"{1.0 / times:.3g} times smaller than"
        return (f"cells are {said} stones; check the units of the wall and of the stones (`units`)",)
    found = []
    void = least_gap(volume, cells.volume)
    if void > (USUAL if gap is None else max(gap, 1e-9)):
        most = np.sort(volume)[::-1][: len(cells)]
        hold, room = (f"{1e3 * x.sum():.3g} L" for x in (most, cells.volume))
        found.append(
            f"too little stone: the {len(most)} largest of {len(stones)} stones hold {hold}, the {len(cells)} cells"
            f" {room}; at least {100.0 * void:.0f} % of the wall stays void"
        )
    depth = np.ptp(cells.depth, axis=1)
    through = int((length >= SHORT * float(np.median(depth))).sum())
    if through < len(cells):
        found.append(
            f"too thin for the wall: {through} of {len(stones)} stones are {100.0 * SHORT:.0f} % as long as it is deep"
            f" ({1e3 * float(np.median(depth)):.0f} mm), and there are {len(cells)} cells"
        )
    blocks = [cells.assembly.blocks[i] for i in cells.block.tolist()]
    names = [block.id for block in blocks if SHORT * _diameter(block.vertices) > length.max()]
    if names:
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        found.append(
            f"no stone is as long as {', '.join(names[:NAMED])}{more}: the longest is {1e3 * length.max():.0f} mm; have"
            " them sawn (`sawn`), or draw shorter ones"
        )
    return tuple(found)


def _diameter(point: Floats) -> float:
    """The greatest distance (m) of two points of a body."""
    from scipy.spatial import ConvexHull
    from scipy.spatial.distance import pdist

    return float(pdist(point[ConvexHull(point).vertices]).max())
