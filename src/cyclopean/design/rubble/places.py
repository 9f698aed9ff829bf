"""Where stones could lie: every place of a part of the height map is tried for every orientation.

A stone let down onto a map of heights m comes to rest, at a shift by whole cells, at

    z = max over its cells of (m - low).

All shifts are tried at once, and again only where the map has changed: by a few of the stone's cells first, which tell
of most places that it would be above the ceiling there. What speaks against a place at this first look
is the gap under the stone over its volume, its height, and the want of neighbours at its sides. Of each stone only the
best places are kept, for a closer look (`choosing`). Places where a stone was tried in vain are not offered again until
something is laid near them.

By hand: a block of two cells over a map (0, 1, 0) rests at 1 in both places, with half of a cell's gap under it.

>>> ground, cells = np.array([[0.0], [1.0], [0.0]]), np.array([[0, 0], [1, 0]])
>>> rest, gap, _ = let_down(ground, cells, np.zeros(2), cells[:0], np.array([[0, 0], [1, 0]]))
>>> rest.tolist(), gap.tolist(), swept(ground, cells, np.zeros(2), (2, 1)).ravel().tolist()
([1.0, 1.0], [1.0, 1.0], [1.0, 1.0])
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cyclopean.arrays import Floats, Ints
from cyclopean.design.options import not_negative
from cyclopean.design.rubble.orientations import Bedded
from cyclopean.design.rubble.sharing import Share

__all__ = ["FULL", "Place", "Places", "Scores", "let_down", "swept"]

Heights: TypeAlias = NDArray[np.floating[Any]]  # m, in single precision where there are many
Picked = tuple[float, int, int, int, float]  # cost, orientation, cells along and across, height at which it rests
Box = tuple[int, int, int, int]  # first cell along and across, and the ones after the last

FULL = 1e6  # m: height of the map where there is no wall
EACH, APART = 5, 2  # places of one orientation that are looked at, and cells by which they differ
PER_STONE, TWICE = 12, 3  # places of one stone that are looked at, and of these at about the same spot
FEW = 16  # cells of a stone that tell that it is above the ceiling, at most places
AROUND = 24  # best places of an orientation among which such are found


@dataclass(frozen=True, slots=True)
class Scores:
    """Of what speaks against a place; lengths over the size of a stone (`unit`), volumes over the stone's own."""

    gap: float = 1.0  # volume under the stone, at the first look
    height: float = 1.7
    beside: float = 0.5  # share of its sides without a neighbour, at the first look
    size: float = 0.6  # small stones, by the logarithm of their volume
    void: float = 1.0  # volume that it makes unusable (`choosing`)
    centre: float = 1.2  # centre of mass near the border of what bears it
    bond: float = 0.25  # stones that bear it: for each of up to three
    upright: float = 0.5
    bearing: float = 0.75  # share of its plan that lies on what is below
    level: float = 0.6  # slope to which it tips
    face: float = 4.0  # area too far behind a face or an end to be seen in it, over the square of its size

    def __post_init__(self) -> None:
        for name in self.__slots__:
            object.__setattr__(self, name, not_negative(f"scores: {name}", getattr(self, name)))


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A stone in an orientation at a place of the map."""

    lying: Bedded
    cell: tuple[int, int]  # of the map, below cell (0, 0) of its raster
    rest: float  # m: height of its centre of mass
    cost: float


def swept(
    padded: Heights, cells: Ints, under: Heights, count: tuple[int, int], start: tuple[int, int] = (0, 0)
) -> Heights:
    """Heights (count) at which a stone rests, m, at so many places along and across from `start` on; see `let_down`."""
    along, across = padded.shape[0] - count[0] + 1, padded.shape[1] - count[1] + 1
    whole = np.ascontiguousarray(padded)  # numpy's own sliding windows take longer to be made than the sweep
    view = np.ndarray((along, across, *count), whole.dtype, whole, 0, 2 * whole.strides)
    return np.asarray((view[cells[:, 0] + start[0], cells[:, 1] + start[1]] - under[:, None, None]).max(axis=0))


def let_down(
    padded: Heights, cells: Ints, under: Heights, ring: Ints, places: Ints
) -> tuple[Heights, Heights, Heights]:
    """Let a stone down at some places.

    Parameters
    ----------
    padded : (n, m) array
        Heights of the map (m).
    cells : (k, 2) array
        Cells that the stone covers at the place (0, 0).
    under : (k,) array
        Its underside there (m).
    ring : (r, 2) array
        Cells around it.
    places : (p, 2) array
        Where, in cells.

    Returns
    -------
    rest, gap, beside : (p,) arrays
        Height at which it rests (m), sum of the gaps under its cells (m), share of the ring as high as its middle.
    """
    row = np.array([padded.shape[1], 1])
    flat, at = padded.reshape(-1), places @ row
    space = flat[(cells @ row)[:, None] + at] - under[:, None]
    rest = space.max(axis=0)
    gap = len(space) * rest - space.sum(axis=0)
    around = flat[(ring @ row)[:, None] + at] >= rest
    return rest, gap, around.sum(axis=0, dtype=np.float32) / max(len(ring), 1)


class _Known:
    """What is known of the places of one stone in one orientation."""

    def __init__(self, lying: Bedded, shape: tuple[int, int], room: Floats) -> None:
        w, d = lying.raster.low.shape
        self.lying = lying
        self.count = shape[0] - w + 1, shape[1] - d + 1
        self.rest = np.zeros(self.count, np.float32)
        self.cost = np.zeros(self.count, np.float32)
        cells, _ = lying.cells
        view = np.lib.stride_tricks.sliding_window_view(room, self.count)
        self.most = view[cells[:, 0], cells[:, 1]].min(axis=0)  # m: height up to which all its cells are in the wall
        self.dirty: list[Box] = [(0, 0, *shape)]
        self.vain = np.zeros(self.count, bool)
        self.loose = np.zeros(self.count, bool)  # where it does not rest lower than is written, but no more is known
        self.best: list[tuple[float, int, int, float]] | None = None


@dataclass(slots=True, eq=False)
class Places:
    """All places of some stones on a part of the map, kept up to date.

    `room` (m) is the height up to which each cell is in the wall; 0 outside it.
    """

    first: int  # cell along the wall where the part begins
    room: Floats
    cell: float
    unit: float
    scores: Scores
    share: Share = field(default_factory=Share)  # of the orientations, those that this process looks at
    known: dict[Bedded, _Known | None] = field(default_factory=dict)

    def changed(self, box: Box) -> None:
        """Something was laid in a box of the whole map."""
        x0, y0, x1, y1 = box
        here = (x0 - self.first, y0, x1 - self.first, y1)
        if here[2] > 0 and here[0] < len(self.room):
            for known in self.known.values():
                if known is not None:
                    known.dirty.append(here)

    def fail(self, place: Place) -> None:
        """A stone was tried there in vain."""
        known = self.known.get(place.lying)
        if known is not None:
            i, j = place.cell[0] - self.first, place.cell[1]
            known.vain[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2] = True
            known.best = None

    def best(
        self,
        ground: Floats,
        stones: Sequence[Sequence[Bedded]],
        ceiling: float,
        accepts: Callable[[Place], bool] | None = None,
    ) -> list[Place]:
        """The best places of each of some stones below a ceiling (m), best first; `ground` is the whole map.

        Where not all places are accepted, those that are not count as tried in vain.
        """
        padded = np.pad(ground[self.part].astype(np.float32), 1, constant_values=np.float32(FULL))
        own = [
            (number, (cost, k, i, j, rest))
            for number, orientations in enumerate(stones)
            for k, lying in enumerate(orientations)
            if self.share.mine(k)
            for cost, i, j, rest in self._picked(lying, padded, ceiling)
        ]
        every: dict[int, list[Picked]] = {}
        for number, one in sorted(one for some in self.share.both(own) for one in some):
            every.setdefault(number, []).append(one)
        found = [place for number, mine in every.items() for place in self._kept(stones[number], mine)]
        if accepts is not None:
            for place in found:
                if not accepts(place):
                    self.fail(place)
            found = [place for place in found if accepts(place)]
        return sorted(found, key=lambda place: place.cost)

    def _picked(self, lying: Bedded, padded: Heights, ceiling: float) -> list[tuple[float, int, int, float]]:
        """The best places of one orientation: their costs, cells, and heights at which it rests."""
        known = self._entry(lying)
        if known is None:
            return []
        self._swept(known, padded)
        if known.best is None:
            limit = np.minimum(np.float32(ceiling - lying.top), known.most)
            low = known.rest <= limit
            if (low & known.loose).any():
                self._let_down(known, padded, np.argwhere(low & known.loose))
                low = known.rest <= limit
            low &= ~known.vain
            best = self._apart(np.where(low, known.cost, np.float32(np.inf))) if low.any() else []
            known.best = [(cost, i, j, float(known.rest[i, j])) for cost, i, j in best]
        return known.best

    @staticmethod
    def _apart(cost: Heights) -> list[tuple[float, int, int]]:
        """The places of least cost that are some cells apart."""
        flat = cost.reshape(-1)
        near = np.argpartition(flat, min(AROUND, flat.size - 1))[:AROUND]
        near = near[np.lexsort((near, flat[near]))]
        best: list[tuple[float, int, int]] = []
        for value, at in zip(flat[near].tolist(), near.tolist(), strict=True):
            i, j = divmod(at, cost.shape[1])
            if not value < np.inf or len(best) == EACH:
                break
            if all(max(abs(i - a), abs(j - b)) >= APART for _, a, b in best):
                best.append((value, i, j))
        return best

    @property
    def part(self) -> slice:
        """Of the map, along the wall."""
        return slice(self.first, self.first + len(self.room))

    def used(self, stone: int) -> None:
        """A stone is laid: its places are of no use any more."""
        for lying in [lying for lying in self.known if lying.stone == stone]:
            del self.known[lying]

    def renewed(self) -> None:
        """Places where stones were tried in vain are offered again."""
        for known in self.known.values():
            if known is not None:
                known.vain[:] = False
                known.best = None

    def forget(self) -> None:
        """Another ceiling: places are picked anew."""
        for known in self.known.values():
            if known is not None:
                known.best = None

    def _entry(self, lying: Bedded) -> _Known | None:
        if lying not in self.known:
            w, d = lying.raster.low.shape
            fits = w <= self.room.shape[0] and d <= self.room.shape[1]
            self.known[lying] = _Known(lying, (self.room.shape[0], self.room.shape[1]), self.room) if fits else None
        return self.known[lying]

    def _swept(self, known: _Known, padded: Heights) -> None:
        """Where the map has changed, find out how high the stone rests at least: by few of its cells."""
        if not known.dirty:
            return
        (w, d), (n, m) = known.lying.raster.low.shape, known.count
        cells, under = known.lying.cells
        step = math.ceil(len(cells) / FEW)
        cells, under = cells[::step] + 1, under[::step]
        for x0, y0, x1, y1 in _merged(known.dirty):
            a, b, c, e = max(0, x0 - w), min(n, x1 + 1), max(0, y0 - d), min(m, y1 + 1)
            if b > a and e > c:
                known.rest[a:b, c:e] = swept(padded, cells, under, (b - a, e - c), (a, c))
                known.loose[a:b, c:e] = True
                known.vain[a:b, c:e] = False
        known.dirty, known.best = [], None

    def _let_down(self, known: _Known, padded: Heights, places: Ints) -> None:
        """Let the stone down at some places (p, 2)."""
        lying, s, at = known.lying, self.scores, (places[:, 0], places[:, 1])
        cells, under = lying.cells
        rest, gap, beside = let_down(padded, cells + 1, under, lying.ring + 1, places)
        known.rest[at], known.loose[at] = rest, False
        area = np.float32(self.cell**2 / (lying.volume))
        known.cost[at] = (
            np.float32(s.gap) * area * gap + np.float32(s.height / self.unit) * rest - np.float32(s.beside) * beside
        )

    def _kept(self, orientations: Sequence[Bedded], mine: Sequence[Picked]) -> list[Place]:
        """The best places of one stone, no more than two at about one spot."""
        kept: list[tuple[float, float]] = []
        found: list[Place] = []
        for cost, k, i, j, rest in mine:
            lying = orientations[k]
            corner = lying.raster.corner / self.cell
            x, y = i - float(corner[0]), j - float(corner[1])
            if sum(abs(x - a) < APART and abs(y - b) < APART for a, b in kept) < TWICE:
                kept.append((x, y))
                small = self.scores.size * float(np.log(lying.volume / self.unit**3))
                found.append(Place(lying, (i + self.first, j), rest, cost - small))
            if len(found) == PER_STONE:
                break
        return found


def _merged(boxes: Sequence[Box]) -> list[Box]:
    """One box around all that overlap; boxes far apart stay apart."""
    merged: list[Box] = []
    for box in boxes:
        x0, y0, x1, y1 = box
        for other in [o for o in merged if o[0] <= x1 and x0 <= o[2] and o[1] <= y1 and y0 <= o[3]]:
            merged.remove(other)
            x0, y0, x1, y1 = min(x0, other[0]), min(y0, other[1]), max(x1, other[2]), max(y1, other[3])
        merged.append((x0, y0, x1, y1))
    return merged
