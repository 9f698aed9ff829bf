"""Sawn stones in store: boxes, what is sawn off them, and what is left.

A slab has a length, a depth and a height: the bed it was quarried on lies level, so its height stays upright whatever
is done with it. A piece is a box inside a slab. Sawing a stone out of a piece takes a cross-cut through its length, a
rip through its depth, and dressing of its upper bed; what falls off goes back into store, unless it is too short to be
laid. Volumes add up at any time: slabs = stones laid + what is in store + what is lost.

By hand: a stone of 0.30 m sawn off a slab of 1 m leaves one offcut, of 0.70 m.

>>> stock = stock_of([Slab("a", [1.0, 0.2, 0.15])])
>>> stock, sawn = saw(stock, 0, [0.3, 0.2, 0.15])
>>> stock.sizes().tolist(), sawn.cuts
([[0.7, 0.2, 0.15]], 1)
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Bools, Floats, Ints, sealed
from cyclopean.design.options import not_negative
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError

__all__ = ["LEAST", "LEAST_FILL", "SAME", "Sawn", "Slab", "Stock", "saw", "slabs_of", "stock_of"]

SAME = 1e-9  # m: lengths that differ by less are the same; a millionth of what a saw can do
LEAST = 0.05  # m: what is shorter than a hand is wide is chips
LEAST_FILL = 0.98  # of its box that a body fills, if it is to pass for a sawn stone


@dataclass(frozen=True, slots=True, eq=False)
class Slab:
    """One sawn stone, a box, and how it lies in the file that it came from."""

    id: str
    size: Floats  # (3,) m: length, depth, height; to a nanometre
    density: float | None = None  # kg/m3; None = not said
    frame: Floats = field(default_factory=lambda: np.eye(3))  # (3, 3) rows: length, depth and height in the file
    corner: Floats = field(default_factory=lambda: np.zeros(3))  # (3,) m, file: where length, depth, height begin

    def __post_init__(self) -> None:
        for name, *shape in (("size", 3), ("frame", 3, 3), ("corner", 3)):
            object.__setattr__(self, name, sealed(f"slab '{self.id}': {name}", getattr(self, name), *shape))
        object.__setattr__(self, "size", sealed("size", self.size.round(9), 3))
        for name, value in zip(("length", "depth", "height"), self.size.tolist(), strict=True):
            if not value > 0.0:
                raise InputError(f"slab '{self.id}': its {name} must be more than 0 m, got {value:g}")

    @property
    def volume(self) -> float:
        """m3."""
        return float(np.prod(self.size))


@dataclass(frozen=True, slots=True, eq=False)
class Stock:
    """Pieces in store (p of them), each a box inside one of the slabs. The smallest come first."""

    slabs: tuple[Slab, ...]  # by size, then by id
    slab: Ints  # (p,) number of the slab
    low: Floats  # (p, 3) m: where the piece begins in its slab, along length, depth, height
    high: Floats  # (p, 3) m
    kerf: float  # m that every cut takes
    least: float  # m: what is shorter or narrower is chips
    lost: float  # m3 of kerfs, dressing and chips so far

    def __len__(self) -> int:
        return len(self.slab)

    def sizes(self) -> Floats:
        """(p, 3) m: length, depth, height."""
        return np.asarray(self.high - self.low).round(9)

    def whole(self) -> Bools:
        """(p,) whether a piece is a slab that was never cut."""
        size = np.array([s.size for s in self.slabs]).reshape(-1, 3)[self.slab]
        return np.asarray((self.low == 0.0).all(axis=1) & (self.high == size).all(axis=1))

    def volume(self) -> float:
        """m3 of all pieces."""
        return float(np.prod(self.high - self.low, axis=1).sum())


@dataclass(frozen=True, slots=True, eq=False)
class Sawn:
    """A stone as it left the saw, inside its slab."""

    slab: int
    low: Floats  # (3,) m
    high: Floats  # (3,) m
    cuts: int  # through its length and its depth
    dressed: float  # m taken off its upper bed
    offcut: bool  # whether it is sawn off what was left of a slab
    piece: Floats  # (3,) m: length, depth and height of what it was sawn off


def stock_of(slabs: Iterable[Slab], kerf: float = 0.0, least: float = LEAST) -> Stock:
    """Put slabs into store; the order in which they are given does not count.

    Raises
    ------
    InputError
        There are none, two have the same id, or the kerf or the least length is negative.
    """
    given = tuple(sorted(slabs, key=lambda s: (s.volume, *s.size.tolist(), s.id)))
    if not given:
        raise InputError("stock: holds no slab")
    twice = [name for name, count in Counter(s.id for s in given).items() if count > 1]
    if twice:
        raise InputError(f"slab '{min(twice)}': the id stands twice; ids must be unique")
    size = np.array([s.size for s in given])
    kerf, least = not_negative("kerf", kerf), not_negative("least", least)
    return Stock(given, np.arange(len(given)), np.zeros_like(size), size, kerf, least, 0.0)


def saw(stock: Stock, piece: int, size: ArrayLike) -> tuple[Stock, Sawn]:
    """Saw a stone out of a piece: first to length, then to depth, then dress it to height.

    Parameters
    ----------
    stock : Stock
    piece : int
        Which.
    size : (3,) array_like
        Length, depth and height (m) of the stone, along those of the piece.

    Returns
    -------
    stock : Stock
        With the offcuts in place of the piece.
    sawn : Sawn

    Raises
    ------
    InputError
        The piece is smaller than that.
    """
    low, high = stock.low[piece], stock.high[piece]
    wanted = low + sealed("size", size, 3)
    if not (wanted <= high + SAME).all():
        raise InputError(
            f"slab '{stock.slabs[stock.slab[piece]].id}': is too small to be sawn to {(wanted - low).tolist()} m"
        )
    end = np.where(
        np.abs(wanted - high) <= SAME, high, wanted.round(9)
    )  # what is not cut keeps its face, to the last bit
    kept: list[tuple[Floats, Floats]] = []
    cuts, gone = 0, float(np.prod((end - low)[:2]) * (high - end)[2])  # dressing
    for axis in (0, 1):
        if not end[axis] < high[axis]:
            continue
        cuts += 1
        first, last = low.copy(), np.where(np.arange(3) < axis, end, high)  # beyond the cut
        first[axis] = min(round(end[axis] + stock.kerf, 9), high[axis])
        section = float(np.prod(np.delete(last - first, axis)))
        gone += section * float(first[axis] - end[axis])
        if (last - first)[:2].min() >= max(stock.least - SAME, SAME):
            kept.append((first, last))
        else:
            gone += section * float(last[axis] - first[axis])
    sawn = Sawn(
        int(stock.slab[piece]),
        sealed("low", low, 3),
        sealed("high", end, 3),
        cuts,
        float(high[2] - end[2]),
        bool((low != 0.0).any() or (high != stock.slabs[stock.slab[piece]].size).any()),
        sealed("piece", (high - low).round(9), 3),
    )
    return _replaced(stock, piece, kept, gone), sawn


def _replaced(stock: Stock, piece: int, new: Sequence[tuple[Floats, Floats]], gone: float) -> Stock:
    """Take a piece out, put others in, and keep the order."""
    rest = np.arange(len(stock)) != piece
    slab = np.concatenate([stock.slab[rest], np.full(len(new), stock.slab[piece])])
    low = np.concatenate([stock.low[rest], np.array([a for a, _ in new]).reshape(-1, 3)])
    high = np.concatenate([stock.high[rest], np.array([b for _, b in new]).reshape(-1, 3)])
    if new:
        size = (high - low).round(9)
        order = np.lexsort((*low.T[::-1], slab, *size.T[::-1], np.prod(size, axis=1).round(12)))
        slab, low, high = slab[order], low[order], high[order]
    return replace(stock, slab=slab, low=low, high=high, lost=stock.lost + gone)


def slabs_of(stones: Iterable[Stone]) -> tuple[tuple[Slab, ...], tuple[str, ...]]:
    """Take stones for sawn ones where they are boxes.

    The height of a stone is upright in its file, or nearly so where the box stands askew, and its length the longer
    of the two other sides. The box is the one along the axes of the file, or the one along the principal axes of the
    stone where that fits better.

    Returns
    -------
    slabs : tuple of Slab
        Their boxes.
    notes : tuple of str
        Stones that are no boxes, and are left out; one line each.
    """
    found, notes = [], []
    for stone in stones:
        boxes = [_box(stone, np.eye(3)), _box(stone, stone.axes)]
        slab = min(boxes, key=lambda s: s.volume * (1.0 if s is boxes[0] else 1.0 + 1e-6))
        share = stone.volume / slab.volume
        if share >= LEAST_FILL:
            found.append(slab)
        else:
            notes.append(f"stone '{stone.id}': is no sawn stone, it fills {share:.0%} of its box; left out")
    return tuple(found), tuple(notes)


def _box(stone: Stone, axes: Floats) -> Slab:
    """Box of a stone along three axes, the most upright of which is its height."""
    up = int(np.argmax(np.abs(axes[:, 2])))
    across = [k for k in range(3) if k != up]
    length, depth = sorted(across, key=lambda k: -float(np.ptp(stone.vertices @ axes[k])))
    frame = axes[[length, depth, up]]
    frame[2] *= np.sign(frame[2, 2]) or 1.0
    frame[1] *= np.sign(np.linalg.det(frame))
    along = stone.vertices @ frame.T
    low = along.min(axis=0)
    size = (along.max(axis=0) - low).round(9)
    return Slab(stone.id, size, stone.density, frame, low @ frame)
