"""Which of the places of some stones is best: a closer look at a few of them, all at once.

Let go at its place, a stone tips on the map until it lies on three points (`tipping`). Then what counts is

void     how much of the wall it makes unusable, over its own volume: by how much the volume under the *closing* of the
         map grows, less its own. The grey closing fills whatever is narrower than a square; two squares are taken, of
         which the mean counts, and whatever lies outside the faces counts as full. So a stone is laid where it leaves
         room that other stones can fill, or none
height   of its centre of mass
centre   how far the centre of mass stands inside the hull of what it touches
bond     on how many stones it lies
size     the largest stones first
upright  how high it stands over its least thickness
bearing  how much of its plan all but lies on what is below
level    the slope to which it tips
face     how much of it is too far behind a face, or an end, to be seen in it, where nothing fits before it any more: so
         stones show their flat sides, and ends go up as steeply as faces
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.design.rubble.dressing import DEEPEST, let_down
from cyclopean.design.rubble.orientations import Bedded
from cyclopean.design.rubble.places import FULL, Place, Scores
from cyclopean.design.rubble.tipping import left_under, tipped

__all__ = ["Looks", "Tipped", "chosen", "closed", "hidden_area", "leaning"]

DIRECTIONS = 16  # in which the hull of what touches is felt
STEEP = 0.5  # slope beyond which a stone that tips falls
TILTED = 0.35  # slope beyond which one that has tipped is left alone: hardly any such stands on the exact meshes
TOUCHING = 0.2  # cells: gap at which a stone counts as touching
LEAST, MOST = 0.12, 0.45  # of the stone's size: margin below which it is left alone, and above which more is no better
SQUARES = 0.3, 0.7  # of the size of a stone: half the widths of the squares
LET = 0.4  # of the share that may be knocked off: a flat takes more than what stands in its way
BEARING = 0.7  # cells: gap at which a stone all but lies on the map
DENSER = 1.5  # times the weight of void where stones are dressed: then they fit where they are wanted
STANDS_BACK = 1.0  # of the size of a stone: what is farther from a face leaves room before it


@dataclass(frozen=True, slots=True, eq=False)
class Tipped:
    """A stone at a place, tipped until it lies."""

    place: Place
    slope: tuple[float, float]  # of what was level, along and across
    rest: float  # m: of its centre of mass
    cost: float
    down: float = 0.0  # m: of it, what it is let down into the map to be dressed


def closed(ground: Floats, half: int) -> Floats:
    """The grey closing of maps (..., n, m) by squares of 2 half + 1 cells; what is outside counts as full."""
    size = 2 * half + 1
    out = ground
    for axis in (-2, -1):
        out = maximum_filter1d(out, size, axis=axis, mode="constant", cval=FULL)
    for axis in (-2, -1):
        out = minimum_filter1d(out, size, axis=axis, mode="constant", cval=FULL)
    return np.asarray(out)


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """How places are looked at."""

    room: Floats  # (n, m) m: height up to which each cell of the whole map is in the wall
    deep: int  # cells behind a face in which stone is seen as face
    cell: float  # m, of the map
    unit: float  # m, size of a stone
    scores: Scores
    dress: float = 0.0  # share of its volume that may be knocked off a stone: it is let down so far into the map
    inward: float = 0.0  # slope by which beds should fall into the wall
    faces: int = 1
    first: int = 0  # cell along the wall where the part of the map begins


def chosen(ground: Floats, label: Ints, places: Sequence[Place], looks: Looks) -> list[Tipped]:
    """Places at which stones lie, the best first.

    Parameters
    ----------
    ground : (n, m) array
        Part of the map (m).
    label : (n, m) array of int
        Which stone is on top of each cell.
    places : sequence of Place
        What is looked at.
    looks : Looks
        How.
    """
    if not places:
        return []
    cell, unit, scores, first, dress = looks.cell, looks.unit, looks.scores, looks.first, looks.dress
    at = [(place.cell[0] - first, place.cell[1]) for place in places]
    lying = [place.lying for place in places]
    need, x, y = _needed(ground, lying, at, cell)
    level = need.max(axis=(1, 2))
    need -= level[:, None, None]
    motion = tipped(need, x, y, STEEP)
    gap = left_under(need, x, y, motion)
    size = np.cbrt([b.volume for b in lying])
    down = let_down(gap, cell, LET * dress * size**3, DEEPEST * size) if dress > 0.0 else np.zeros(len(size))
    touching = gap <= TOUCHING * cell + down[:, None, None]
    reach = _reach(touching, x, y)
    margin = reach.min(axis=0) / size
    steep = np.hypot(motion[:, 1], motion[:, 2])
    good = np.flatnonzero((margin >= LEAST) & (steep <= TILTED))
    if not len(good):
        return []
    rest = level + motion[:, 0] - down
    room = _lost(ground, [lying[k] for k in good], [at[k] for k in good], (rest, motion, x, y), good, (cell, unit))
    volume = size[good] ** 3
    under = [len(np.unique(_under(label, touching[k], at[k]))) for k in good]
    tall = np.array([(lying[k].top - lying[k].bottom) / (2.0 * lying[k].thin) for k in good])
    cost = (
        scores.void * (DENSER if dress > 0.0 else 1.0) * (room / volume - 1.0)
        + scores.height * rest[good] / unit
        - scores.centre * np.minimum(margin[good], MOST)
        - scores.size * np.log(volume / unit**3)
        - scores.bond * np.minimum(under, 3)
        + scores.upright * tall
        - scores.bearing * np.array([_bearing(gap[k], lying[k], cell) for k in good])
        + scores.level * steep[good]
        + scores.face * np.array([hidden_area(lying[k], places[k], looks) for k in good.tolist()]) / size[good] ** 2
    )
    if looks.inward:
        behind = np.array([at[k][1] + lying[k].raster.low.shape[1] / 2.0 > ground.shape[1] / 2.0 for k in good])
        wanted = np.where(behind & (looks.faces == 2), looks.inward, -looks.inward)
        cost = cost + np.abs(motion[good, 2] - wanted)
    order = np.argsort(cost, kind="stable")
    return [
        Tipped(places[k], (float(motion[k, 1]), float(motion[k, 2])), float(rest[k]), float(cost[o]), float(down[k]))
        for o, k in zip(order.tolist(), good[order].tolist(), strict=True)
    ]


def leaning(along: float, across: float) -> Floats:
    """Rotation (3, 3) that gives a level plane these slopes."""
    axis = np.array([across, -along, 0.0])
    size = float(np.linalg.norm(axis))
    if size < 1e-12:
        return np.eye(3)
    x, y, _ = axis / size
    angle = np.arctan(size)
    cross = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    turned: Floats = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return turned


def _needed(
    ground: Floats, lying: Sequence[Bedded], at: Sequence[tuple[int, int]], cell: float
) -> tuple[Floats, Floats, Floats]:
    """How far the map stands above the underside of each stone (k, w, d), and its cells from its centre of mass."""
    shape = [b.raster.low.shape for b in lying]
    need = np.full((len(lying), max(w for w, _ in shape), max(d for _, d in shape)), -np.inf)
    for k, (b, (i, j), (w, d)) in enumerate(zip(lying, at, shape, strict=True)):
        need[k, :w, :d] = ground[i : i + w, j : j + d] - b.raster.low
    corner = np.array([b.raster.corner for b in lying])
    x, y = (corner[:, axis, None] + cell * (np.arange(need.shape[1 + axis]) + 0.5) for axis in (0, 1))
    return need, x, y


def _reach(touching: Bools, x: Floats, y: Floats) -> Floats:
    """(16, k) how far (m) some cells of each stone reach from its centre of mass, in each direction."""
    angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    which, along, across = touching.nonzero()  # stone after stone
    out = x[which, along] * np.cos(angle)[:, None] + y[which, across] * np.sin(angle)[:, None]
    reach, some = np.full((DIRECTIONS, len(touching)), -np.inf), np.unique(which)
    if len(some):
        reach[:, some] = np.maximum.reduceat(out, np.searchsorted(which, some), axis=1)
    return reach


def _lost(
    ground: Floats,
    lying: Sequence[Bedded],
    at: Sequence[tuple[int, int]],
    moved: tuple[Floats, Floats, Floats, Floats],
    which: Ints,
    sizes: tuple[float, float],
) -> Floats:
    """(k,) m3 by which the volume under the closing grows with each stone, in the mean of two squares."""
    cell, unit = sizes
    rest, motion, x, y = moved
    halves = [max(round(share * unit / cell), 1) for share in SQUARES]
    n = len(ground)
    width = min(max(b.raster.low.shape[0] for b in lying) + 8 * max(halves), n)
    start = [min(max(i - 4 * max(halves), 0), n - width) for i, _ in at]
    before = np.stack([ground[s : s + width] for s in start])
    after = before.copy()
    for k, (b, (i, j), s) in enumerate(zip(lying, at, start, strict=True)):
        w, d = b.raster.low.shape
        q = which[k]
        plane = motion[q, 1] * x[q, :w, None] + motion[q, 2] * y[q, None, :d]
        top = b.raster.high + rest[q] + plane
        part = after[k, i - s : i - s + w, j : j + d]
        np.maximum(part, top, out=part)
    grown = [(closed(after, half) - closed(before, half)).clip(0.0, FULL / 2.0).sum(axis=(1, 2)) for half in halves]
    return np.asarray(np.mean(grown, axis=0)) * cell**2


def _under(label: Ints, touching: Bools, at: tuple[int, int]) -> Ints:
    """Stones under the cells that touch."""
    i, j = touching.nonzero()
    return label[i + at[0], j + at[1]]


def _bearing(gap: Floats, lying: Bedded, cell: float) -> float:
    """Share of its plan that all but lies on the map."""
    return float(np.count_nonzero(gap <= BEARING * cell)) / len(lying.cells[0])


def hidden_area(lying: Bedded, place: Place, looks: Looks) -> float:
    """Area (m2) of a stone that is too far behind faces and ends to be seen in them; 0 where another fits before it.

    By hand: a box with its front in a face shows all of it; turned by 45 degrees, or a cell too far back, less or none.
    """
    hidden, (w, d), (i, j) = 0.0, lying.raster.low.shape, place.cell
    top = place.rest + lying.top
    for line, start, size, sides in (
        (looks.room[:, j + d // 2] >= top, i, w, lying.shown[0]),
        (looks.room[i + w // 2] >= top, j, d, lying.shown[1]),
    ):
        out = np.flatnonzero(~line)
        k = int(np.searchsorted(out, start))
        before = start - (int(out[k - 1]) + 1 if k else 0)
        after = (int(out[k]) if k < len(out) else len(line)) - start - size
        gap, side = (before, sides[0]) if before <= after else (after, sides[1])
        if gap * looks.cell < STANDS_BACK * 2.0 * lying.thin:
            within = min(looks.deep - gap, len(side))
            hidden += looks.cell * float(side[-1] - (side[within - 1] if within > 0 else 0.0))
    return hidden
