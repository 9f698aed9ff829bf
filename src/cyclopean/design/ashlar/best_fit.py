"""Best fit: for each slot of a wall, score every piece in store and take the best.

The score of a piece in a slot is the weighted mean of four fits,

    s = 0.4 f(length) + 0.2 f(depth) + 0.2 f(height) + 0.2 f(length / height),   f = 1 - |a - b| / max(a, b),

of the piece as it lies and as it lies turned by 90 degrees; 1 = the piece is the slot. Offcuts compete like slabs, so
what was sawn off one stone is used for another where it fits best. Building from a stock of given elements by such a
choice is in the line of [Furrer]_, who had a robot choose and stack stones as found, and of [Johns]_, who built a
dry-stone wall of boulders with an excavator.

Slots follow the stones' own lengths ("free": a course goes from left to right, each joint near the place that the
length of most stones would give it, and away from the joints below), or they are those of a bond. Where no piece that
is free to be laid uncut scores enough, the first one that can be sawn to the slot is taken: a first fit, and only
where none can, a gap is left.

The method "global" chooses for all slots of a bond together: of all ways to give slots pieces that need no cut to
length, one with the largest sum of scores (a linear assignment); then the others, both one at a time, each time the
pair that scores best in an assignment of all that are left, so that offcuts of one serve the next, and all at once. The
wall with the larger sum of scores is kept.

By hand: a slot of 0.30 m scores a stone of 0.30 m as 1, one of 0.15 m as 0.4 / 2 + 0.2 + 0.2 + 0.2 / 2.

>>> sizes = np.array([[[0.3, 0.2, 0.15]], [[0.15, 0.2, 0.15]]])
>>> score(sizes, np.array([0.3, 0.2, 0.15])).round(12).ravel().tolist()
[1.0, 0.7]

References
----------
.. [Furrer] Furrer, Wermelinger, Yoshida, Gramazio, Kohler, Siegwart & Hutter: Autonomous robotic stone stacking with
   online next best object target pose planning. ICRA 2017.
.. [Johns] Johns, Wermelinger, Mascaro, Jud, Gramazio, Kohler, Chli & Hutter: Autonomous dry stone: on-site planning
   and assembly of stone walls with a robotic excavator. Construction Robotics 4 (2020).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.design.ashlar.planning import AshlarSettings, LaidStone, Rule, candidates, first_fit, planned
from cyclopean.design.ashlar.stock import SAME, Slab, Stock, saw, stock_of
from cyclopean.design.ashlar.wall import AshlarWall, ashlar, built
from cyclopean.design.options import not_negative, one_of, within
from cyclopean.errors import InputError

__all__ = ["Method", "Packed", "Slots", "Weights", "best_fit", "pack", "score", "scores_of"]

Method = Literal["best", "first", "global"]
Slots = Literal["free", "bond"]
LEAST_SCORE = 0.5  # below this, best fit gives way to first fit
MOST = 4_000  # slots of an assignment: its matrix has to fit into memory
BETTER = 1e-12  # scores that differ by less are equal


@dataclass(frozen=True, slots=True)
class Weights:
    """Of the four fits; only their ratios count."""

    length: float = 0.4
    depth: float = 0.2
    height: float = 0.2
    aspect: float = 0.2

    def __post_init__(self) -> None:
        values = [not_negative("`scores`", v) for v in (self.length, self.depth, self.height, self.aspect)]
        if not sum(values) > 0.0:
            raise InputError("`scores`: one of them must be more than 0")


@dataclass(frozen=True, slots=True, eq=False)
class Packed:
    """A wall, how it was chosen, and how well its stones fit."""

    wall: AshlarWall
    method: str
    slots: str
    mean: float  # over the stones, of the scores of the pieces that they were sawn from
    poor: int  # stones whose piece scores less than `least_score`: for these best fit gave way to first fit


def score(sizes: Floats, slot: Floats, weights: Weights | None = None) -> Floats:
    """Score pieces in a slot.

    Parameters
    ----------
    sizes : (..., 3) float
        Length, depth and height of each piece as it would lie (m).
    slot : (3,) float
        Those of the slot (m).
    weights : Weights, optional

    Returns
    -------
    (...) float
        0 to 1.
    """
    w = Weights() if weights is None else weights
    share = np.array([w.length, w.depth, w.height, w.aspect])
    a = np.concatenate([sizes, sizes[..., :1] / sizes[..., 2:]], axis=-1)
    b = np.append(slot, slot[0] / slot[2])
    fit = 1.0 - np.abs(a - b) / np.maximum(a, b)
    return np.asarray(fit @ (share / share.sum()))


def best_fit(weights: Weights | None = None, least: float = LEAST_SCORE) -> Rule:
    """Make the rule that takes the piece with the best score, and the first that fits where none scores `least`.

    Of equal scores the first piece in store counts, and lying as it is before turned.
    """
    within("`least_score`", least, 0.0, 1.0)

    def rule(sizes: Floats, fits: Bools, slot: Floats) -> tuple[int, bool] | None:
        if not fits.any():
            return None
        found = np.where(fits, score(sizes, slot, weights), -1.0)
        if not found.max() >= least:
            return first_fit(sizes, fits, slot)
        piece, turned = np.argwhere(found >= found.max() - BETTER)[0].tolist()
        return piece, bool(turned)

    return rule


def pack(
    settings: AshlarSettings,
    slabs: Iterable[Slab],
    *,
    method: str = "best",
    slots: str = "free",
    weights: Weights | None = None,
    least_score: float = LEAST_SCORE,
) -> Packed:
    """Build a wall of the slabs that fit best.

    Parameters
    ----------
    settings : AshlarSettings
    slabs : iterable of Slab
        The stock; the order does not count.
    method : str
        One of `Method`: best fit slot by slot, first fit, or all slots together.
    slots : str
        "free" or "bond".
    weights : Weights, optional
    least_score : float
        Where no piece has it, the first that fits is taken.

    Returns
    -------
    Packed

    Raises
    ------
    InputError
        Unknown method or slots, slots that a method or a bond does not have, or as in `ashlar`.
    """
    one_of("method", method, Method)
    one_of("slots", slots, Slots)
    if slots == "free" and (method == "global" or settings.bond != "running" or settings.through):
        what = "the method global" if method == "global" else "a bond with through-stones, or one other than running,"
        raise InputError(f"`slots`: {what} needs slots that are known beforehand; take those of the bond")
    given = tuple(slabs)
    if method == "global":
        wall = _together(settings, given, weights)
    else:
        rule = first_fit if method == "first" else best_fit(weights, least_score)
        wall = ashlar(settings, given, rule, found=slots == "free")
    scores = scores_of(wall, weights)
    mean = float(scores.mean()) if len(scores) else 0.0
    return Packed(wall, method, slots, mean, int((scores < least_score).sum()))


def scores_of(wall: AshlarWall, weights: Weights | None = None) -> Floats:
    """(n,) scores of the pieces that the stones of a wall were sawn from."""
    if not wall.laid:
        return np.zeros(0)
    sizes = np.array([s.sawn.piece[[1, 0, 2]] if s.turned else s.sawn.piece for s in wall.laid])
    return np.array([float(score(a, s.slot.size, weights)) for a, s in zip(sizes, wall.laid, strict=True)])


def _together(settings: AshlarSettings, slabs: Sequence[Slab], weights: Weights | None) -> AshlarWall:
    """Choose for all slots of a bond at once; the slots are those that a first fit can fill."""
    drawn = ashlar(settings, slabs)
    if len(drawn.laid) > MOST:
        raise InputError(f"`method`: global takes up to {MOST:,} stones, here are {len(drawn.laid):,}; take best")
    store = stock_of(slabs, settings.kerf, settings.least)
    tallest = dict(planned(settings, store, first_fit, False).bands)
    notes, gaps = list(drawn.notes), drawn.gaps
    top = max((s.slot.course for s in drawn.laid), default=-1)
    while top >= 0:
        wanted = [s for s in drawn.laid if s.slot.course <= top]
        tried = (_assigned(wanted, store, tallest, settings.yaw, weights, at_once=many) for many in (False, True))
        whole = [
            built(settings, laid, left, gaps, notes, drawn.unit) for laid, left in tried if len(laid) == len(wanted)
        ]
        if whole:
            return max(whole, key=lambda wall: float(scores_of(wall, weights).sum()))
        notes.append(f"course {top + 1}: left out, for the stones chosen below it left too few")
        top, gaps = top - 1, ()  # nothing is laid on a course with gaps
    return built(settings, (), store, gaps, notes, drawn.unit)


def _assigned(
    wanted: Sequence[LaidStone],
    stock: Stock,
    tallest: Mapping[float, float],
    yaw: bool,
    weights: Weights | None,
    *,
    at_once: bool,
) -> tuple[list[LaidStone], Stock]:
    """Assign pieces to slots, those that need no cut to length first; slots that get none are left out."""
    laid: list[LaidStone] = []
    open_slots = list(wanted)
    while open_slots:
        value, turned, uncut = _values(open_slots, stock, tallest, yaw, weights)
        pairs = _matched(np.where(uncut, value, -1.0))
        if not pairs:  # saw one stone, and see what its offcut is good for
            best = _matched(value)
            if not best:
                break
            pairs = best if at_once else [max(best, key=lambda ij: (value[ij], -ij[0]))]
        name = [(int(a), tuple(b)) for a, b in zip(stock.slab.tolist(), stock.low.tolist(), strict=True)]
        for i, j in pairs:
            at = next(k for k in range(len(stock)) if (int(stock.slab[k]), tuple(stock.low[k].tolist())) == name[j])
            size = open_slots[i].slot.size
            stock, sawn = saw(stock, at, size[[1, 0, 2]] if turned[i, j] else size)
            laid.append(replace(open_slots[i], sawn=sawn, turned=bool(turned[i, j])))
        done = {i for i, _ in pairs}
        open_slots = [s for i, s in enumerate(open_slots) if i not in done]
    return laid, stock


def _values(
    slots: Sequence[LaidStone], stock: Stock, tallest: Mapping[float, float], yaw: bool, weights: Weights | None
) -> tuple[Floats, Bools, Bools]:
    """Scores (n, p) of pieces in slots, -1 where one cannot be sawn to the other; whether turned; whether uncut."""
    value = np.full((len(slots), len(stock)), -1.0)
    turned, uncut = np.zeros_like(value, bool), np.zeros_like(value, bool)
    for i, stone in enumerate(slots):
        slot = stone.slot.size
        height = float(slot[2])
        sizes, fits = candidates(stock, slot, (height, tallest.get(height, height)), yaw)
        both = np.where(fits, score(sizes, slot, weights), -1.0)
        turned[i] = both[:, 1] > both[:, 0] + BETTER
        value[i] = both.max(axis=1)
        length = np.where(turned[i], sizes[:, 1, 0], sizes[:, 0, 0])
        uncut[i] = (value[i] >= 0.0) & (np.abs(length - slot[0]) <= SAME)
    return value, turned, uncut


def _matched(value: Floats) -> list[tuple[int, int]]:
    """Pairs of as many slots as possible with pieces, of the largest sum of values; negative values are no pairs."""
    from scipy.optimize import linear_sum_assignment

    if not value.size:
        return []
    never = 10.0 * (len(value) + 1)
    rows, columns = linear_sum_assignment(np.where(value >= 0.0, -value, never))
    return [(i, j) for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if value[i, j] >= 0.0]
