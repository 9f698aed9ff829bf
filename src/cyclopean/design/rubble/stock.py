"""Which stones of an inventory are kept back from the body of a wall, and what for.

lintel         long enough to bridge the opening and bear on both sides, as many as lie side by side through the wall
through-stone  long enough to reach from face to face, or two thirds of the way: as many as are asked for
cope           for the top: large, and of nearly one thickness, as many as cover it
hearting       less than half of the median volume: for hollows, and to pin what would rock
"""

import math
from collections.abc import Sequence

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.rubble.shape import Shape
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError

__all__ = ["BEARING", "SPANNING", "kept_back"]

SMALL = 0.5  # of the median volume: hearting
SPANNING = 2.0 / 3.0  # of the thickness: a stone so long ties the wall
BEARING = 0.1  # m on either side of an opening, or a fifth of its width where that is less
COVERED = 0.7  # of its length and width that a cope covers of the top
COPES = 1.0 / 3.0  # of the stones that are left are no more than that copes
SPARE = 2  # times as many as are needed are kept: not every one fits where it should


def kept_back(
    stones: Sequence[Stone], left: Sequence[int], shape: Shape, asked: frozenset[str], through: float | None
) -> dict[str, list[int]]:
    """Stones by what they are kept for; those of `left`, the largest first, in the same order.

    Parameters
    ----------
    stones : sequence of Stone
        The inventory.
    left : sequence of int
        Its stones that are to be laid, the largest first.
    shape : Shape
        Of the wall.
    asked : set of str
        "cope" and "hearting", where they are wanted.
    through : float or None
        Distance of through-stones (m), along the wall and up it.

    Raises
    ------
    InputError
        No stone bridges the opening.
    """
    extent = {k: np.ptp(stones[k].vertices @ stones[k].axes.T, axis=0) for k in left}
    rest = list(left)
    kept: dict[str, list[int]] = {}

    def keep(role: str, chosen: Sequence[int]) -> None:
        kept[role] = sorted(chosen, key=rest.index)
        rest[:] = [k for k in rest if k not in kept[role]]

    if shape.opening is not None:
        keep("lintel", _lintels(stones, rest, extent, shape))
    if through is not None:
        longest = sorted((k for k in rest if _ties(extent[k], shape)), key=lambda k: -float(extent[k][0]))
        wanted = SPARE * max(round(shape.length * shape.planned / through**2), 1)
        keep("through-stone", longest[:wanted])
    if "cope" in asked:
        keep("cope", _copes(rest, extent, shape))
    if "hearting" in asked:
        small = SMALL * float(np.median([stones[k].volume for k in left]))
        keep("hearting", [k for k in rest if stones[k].volume < small])
    kept["stone"] = rest
    return kept


def _ties(extent: Floats, shape: Shape) -> bool:
    """Whether a stone reaches far enough through the wall, and no farther."""
    return bool(SPANNING * shape.thickness <= extent[0] <= shape.thickness)


def _lintels(stones: Sequence[Stone], rest: Sequence[int], extent: dict[int, Floats], shape: Shape) -> list[int]:
    """The stones that bridge the opening best: the shortest that do, side by side through the wall."""
    assert shape.opening is not None
    wide = shape.opening.width
    needed = wide + 2.0 * min(BEARING, wide / 5.0)
    long = sorted((k for k in rest if extent[k][0] >= needed), key=lambda k: float(extent[k][0]))
    if not long:
        longest = max(rest, key=lambda k: float(extent[k][0]))
        raise InputError(
            f"opening: no stone bridges {wide:g} m; it takes one {needed:.3g} m long, and the longest,"
            f" {stones[longest].id}, has {extent[longest][0]:.3g} m; make the opening narrower"
        )
    count, deep = 0, 0.0
    while count < len(long) and deep < shape.thickness:
        deep += float(extent[long[count]][1])
        count += 1
    return long[: min(count + SPARE, len(rest) // 3 + 1)]  # the jambs need stones, too


def _copes(rest: Sequence[int], extent: dict[int, Floats], shape: Shape) -> list[int]:
    """Of the larger half, the stones of most nearly one thickness, as many as cover the top."""
    large = rest[: max(len(rest) // 2, 1)]
    usual = float(np.median([extent[k][2] for k in large]))
    alike = sorted(large, key=lambda k: abs(float(extent[k][2]) - usual))
    top = shape.length * max(shape.thickness - shape.batter * shape.faces * shape.planned, shape.thickness / 3.0)
    covered = np.cumsum([COVERED**2 * float(extent[k][0] * extent[k][1]) for k in alike])
    count = int(np.searchsorted(covered, top)) + 1
    return alike[: min(count, math.ceil(COPES * len(rest)))]
