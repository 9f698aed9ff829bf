"""Match stones to the cells of a wall: which goes where, how it is turned, what is carved off and what is missing."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Literal, Self

import numpy as np

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.assembly import Block
from cyclopean.design.matching.assignment import assign, costs, prices, weight_for_gap
from cyclopean.design.matching.candidates import EXACT, POLISH, POLISHED, REFINED, Candidates
from cyclopean.design.matching.cells import Cells
from cyclopean.design.matching.coarse import POINTS, rank, rotations
from cyclopean.design.matching.problem import Bonds, Problem, Singles
from cyclopean.design.options import at_least, one_of, positive, within
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.sampling import body_points
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError
from cyclopean.options import option
from cyclopean.representation import one_line

__all__ = ["Match", "MatchSettings", "Placement", "match_stones"]

Bond = Literal["free", "into", "along"]

TWINS = 3  # stones of a cell's own shape that are refined in it, whatever their rank
NEARLY = 4  # pairs a cell, next in line by their prices, that are polished with the chosen ones to begin with
EAGER = 2  # rounds in which they are
ROUNDS = 12  # of measuring and assigning anew, at most
GAP_SLACK = 0.01  # by which the total gap may miss what was asked before it is said


@dataclass(frozen=True, slots=True)
class MatchSettings:
    """What is asked of a match, and how much trouble is taken over it."""

    weight: float = option(1.0, "Price of a litre of void; a litre carved costs 1.", "number", metavar="W")  # w
    gap: float | None = option(
        None, "Share of the wall that may stay void; sets the weight.", "number", metavar="G"
    )  # G: w is then found by bisection
    points: int = option(2048, "Points in each stone that its pose is found by.", "whole", metavar="N")
    shortlist: int = 12  # pairs a cell that are refined to begin with
    starts: int = 2  # rotations from which a pair is refined
    bond: Bond = "free"  # where the longest axis of a stone lies: anywhere, into the wall, or along it
    bond_angle: float = 30.0  # degrees by which it may be off
    climbs: int = 120  # pairs whose poses may climb by exact volumes, shared out evenly among the cells

    def __post_init__(self) -> None:
        positive("weight", self.weight)
        if self.gap is not None:
            within("gap", self.gap, 0.0, 1.0)
        for name, least in (("points", 64), ("shortlist", 1), ("starts", 1), ("climbs", 0)):
            at_least(name, getattr(self, name), least)
        within("bond_angle", self.bond_angle, 0.0, 90.0)
        one_of("bond", self.bond, Bond)

    def bonds(self, cells: Cells) -> Bonds | None:
        """Along what the longest axis of a stone in each cell lies."""
        if self.bond == "free":
            return None
        way = cells.frame[:, 0] if self.bond == "along" else cells.axes[:, 2]
        return Bonds(way, float(np.radians(self.bond_angle)))


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """One stone in one cell. A point x of the stone's own frame comes to rotation x + shift in the wall."""

    stone: int  # index into the stones given
    cell: int  # index into the cells
    rotation: Floats  # (3, 3)
    shift: Floats  # (3,) m
    shared: float  # m3 that stone and cell have in common, exact
    carved_share: float  # lambda = 1 - shared / volume of the stone
    gap_share: float  # 1 - shared / volume of the cell

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", sealed("rotation", self.rotation, 3, 3))
        object.__setattr__(self, "shift", sealed("shift", self.shift, 3))

    @classmethod
    def of(cls, number: int, cell: int, stone: Stone, cells: Cells, pose: tuple[Floats, Floats], shared: float) -> Self:
        """A stone in a cell, by the pose (3, 3), (3,) m of its body frame about the cell's centre and m3 in common."""
        rotation, room = pose[0] @ stone.axes, float(cells.volume[cell])
        shift = cells.centre[cell] + pose[1] - rotation @ stone.centroid
        carved, gap = (max(0.0, 1.0 - shared / whole) for whole in (stone.volume, room))
        return cls(number, cell, rotation, shift, shared, carved, gap)

    def pose(self, stone: Stone) -> tuple[Floats, Floats]:
        """Rotation (3, 3) and centroid (3,) m of its body frame in the wall."""
        return self.rotation @ stone.axes.T, self.rotation @ stone.centroid + self.shift

    @property
    def carved(self) -> float:
        """m3 that come off."""
        return self.shared * self.carved_share / (1.0 - self.carved_share) if self.shared > 0.0 else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Which stone goes into which cell. Imposition is the chapter's Lambda."""

    __repr__ = one_line

    placements: tuple[Placement, ...]  # by cell
    unused: Ints  # stones
    empty: Ints  # cells that have no stone
    imposition: float  # Lambda: carved volume / volume of the stones that are placed
    gap: float  # void / volume of the cells that have a stone
    gap_of_wall: float  # void / volume of all cells; one without a stone is all void
    weight: float  # w that was used
    settings: MatchSettings
    notes: tuple[str, ...] = ()  # what a reader should know, one line each
    seconds: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("unused", "empty"):
            object.__setattr__(self, name, sealed(name, getattr(self, name), None, dtype=np.int64))

    def __len__(self) -> int:
        return len(self.placements)

    def placed(self, stones: Sequence[Stone], cells: Cells) -> Iterator[tuple[Stone, Block, Floats, Floats]]:
        """Stone, block, rotation and shift (m) of each placement, as `carve_all` takes them."""
        for p in self.placements:
            yield stones[p.stone], cells.assembly.blocks[int(cells.block[p.cell])], p.rotation, p.shift

    @classmethod
    def of(
        cls, placements: Sequence[Placement], stones: Sequence[Stone], cells: Cells, weight: float, asked: MatchSettings
    ) -> Self:
        """The match with these placements, by cell, and what it comes to."""
        stone, cell = (np.array([getattr(p, name) for p in placements], np.int64) for name in ("stone", "cell"))
        shared = sum(p.shared for p in placements)
        used = np.array([stones[i].volume for i in stone])
        wholes = used.sum(), cells.volume[cell].sum(), cells.volume.sum()
        imposition, gap, gap_of_wall = (max(0.0, 1.0 - shared / float(whole)) for whole in wholes)
        unused, empty = np.setdiff1d(np.arange(len(stones)), stone), np.setdiff1d(np.arange(len(cells)), cell)
        return cls(tuple(placements), unused, empty, imposition, gap, gap_of_wall, weight, asked)


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What is known before stones are matched."""

    start: Match | None = None  # by the same stones for as many cells: its pairs and poses are candidates too
    points: Singles | None = None  # (n, p, 3) `body_points` of the stones, at least 1,024 and as many as asked for
    measured: bool = False  # what the pairs of `start` share was measured in these very cells: it is not done again
    yielding: float = 0.0
    """Share of what the pairs of `start` have in common that does not count when stones are assigned: cells that have
    moved towards their stones would else keep them, and others, towards which they could move too, have no chance.
    Where it is above 0 a climb of the cells is to follow, and volumes of new pairs are by counted points only."""


def match_stones(
    stones: Inventory | Sequence[Stone],
    cells: Cells,
    settings: MatchSettings | None = None,
    executor: Executor | None = None,
    progress: Callable[[str], None] = lambda _: None,
    known: Known | None = None,
) -> Match:
    """Place stones in the cells of a wall so that carved + w void is least.

    All stones are ranked in all cells (`coarse`); those that dual prices of the assignment say are worth it are refined
    (`refine`); the pairs that are chosen are polished, then measured by exact solids, and the assignment is made again
    until it stands. Every volume of the answer is exact.

    Parameters
    ----------
    stones : Inventory or sequence of Stone
        At least one; more than there are cells, or fewer.
    cells : Cells
        Where they may go.
    settings : MatchSettings, optional
        What is asked.
    executor : Executor, optional
        Runs ranking and refining; this process where not given. The answer is the same.
    progress : callable
        Told what is being done.
    known : Known, optional
        What is known from before.

    Raises
    ------
    InputError
        No stones, or one that is no closed solid.
    """
    settings, known = settings or MatchSettings(), known or Known()
    given = tuple(stones.stones if isinstance(stones, Inventory) else stones)
    if not given:
        raise InputError("stones: there are none to match; give at least one")
    order = np.lexsort(([s.area for s in given], [s.volume for s in given]))  # so that theirs decides no tie
    stock = tuple(given[k] for k in order)
    began = perf_counter()
    seconds: dict[str, float] = {}
    progress("sampling stones")
    count = max(settings.points, POINTS)
    points, start = known.points, known.start
    if points is not None and (len(points) != len(stock) or points.shape[1] < count):
        raise InputError(f"points: {points.shape[1]} of {len(points)} stones; expected {count} of {len(stock)}")
    points = body_points(stock, count) if points is None else points[order, :count]
    seconds["points"] = perf_counter() - began
    ranked = perf_counter()
    bonds = settings.bonds(cells)
    longest = np.abs(rotations()[:, 2 if settings.bond == "into" else 0, 0])  # of a stone, along the cell's axis
    allowed = longest >= (-1.0 if bonds is None else np.cos(bonds.angle) - 1e-9)
    axes = cells.frame if settings.bond == "along" else cells.axes
    problem = Problem(stock, points, cells, bonds, executor, progress)
    work = Candidates(problem, rank(problem, axes, allowed, settings.starts))
    seconds["rank"] = perf_counter() - ranked
    if start is not None:
        stone, cell, rotation, shift = _incumbents(start, stock, order, cells)
        work.take(
            stone, cell, rotation, shift, np.array([p.shared for p in start.placements]) if known.measured else None
        )
        # measured at once, so that whoever takes their place is better, and not only thought to be
        work.improve(stone, cell, EXACT, replace(POLISH, points=settings.points))
        work.hold_back(stone, cell, known.yielding)
    weight, chosen = _assigned(work, settings, rough=known.yielding > 0.0)
    found = _answer(work, settings, weight, chosen, order, given)
    total = perf_counter() - began
    return replace(found, seconds={**seconds, **work.seconds, "total": total})


def _incumbents(start: Match, stock: Sequence[Stone], order: Ints, cells: Cells) -> tuple[Ints, Ints, Floats, Floats]:
    """Pairs of an earlier match, and their poses by body frames."""
    if any(p.stone >= len(stock) or p.cell >= len(cells) for p in start.placements):
        raise InputError("start: names a stone or a cell that is not there; start from a match of the same two")
    stone = np.argsort(order)[np.array([p.stone for p in start.placements], np.int64)]
    cell = np.array([p.cell for p in start.placements], np.int64)
    poses = [p.pose(stock[i]) for i, p in zip(stone.tolist(), start.placements, strict=True)]
    rotation, shift = np.array([r for r, _ in poses]).reshape(-1, 3, 3), np.array([t for _, t in poses]).reshape(-1, 3)
    return stone, cell, rotation, shift - cells.centre[cell]


def _assigned(work: Candidates, settings: MatchSettings, rough: bool) -> tuple[float, Ints]:
    """Weight and stone of each cell, all of whose pairs are measured, or polished only."""
    polish = replace(POLISH, points=settings.points)
    each = settings.climbs // len(work.cells)  # a wall of many cells has its choice of stones instead
    work.climbs = settings.climbs if each else 0
    weight, chosen = _chosen(work, settings)
    if not rough:
        work.improve(*work.twins(TWINS), EXACT, polish)
    work.improve(*_unique(work, *_shortlist(work, weight, chosen, settings.shortlist)), REFINED)
    for level in (POLISHED,) if rough else (POLISHED, EXACT):
        for turn in range(ROUNDS):
            weight, chosen = _chosen(work, settings, weight)
            stone, cell = chosen[chosen >= 0], np.flatnonzero(chosen >= 0)
            if (work.level[stone, cell] >= level).all():
                break
            most = NEARLY if level == POLISHED else min(each // 2, NEARLY)
            if turn < EAGER and most:
                near, place = _shortlist(work, weight, chosen, most)
                known = work.level[near, place] >= level - 1
                stone, cell = np.concatenate([stone, near[known]]), np.concatenate([cell, place[known]])
            work.improve(*_unique(work, stone, cell), level, polish)
    if not rough:  # they are already, unless rounds have run out
        filled = np.flatnonzero(chosen >= 0)
        work.improve(chosen[filled], filled, EXACT, polish)
    return weight, chosen


def _chosen(work: Candidates, settings: MatchSettings, last: float | None = None) -> tuple[float, Ints]:
    """Weight, by the last one, and the best assignment by what is known now."""
    if settings.gap is not None:
        return weight_for_gap(work.worth, work.volume, work.cells.volume, settings.gap, last)
    return settings.weight, assign(work.worth, work.volume, settings.weight)


def _shortlist(work: Candidates, weight: float, chosen: Ints, most: int) -> tuple[Ints, Ints]:
    """Pairs of least reduced cost, so many for each cell (each stone, where these are fewer), and those chosen."""
    cost = costs(work.worth, work.volume, weight)
    u, v = prices(cost, chosen)
    reduced = cost - u[:, None] - v
    n, m = reduced.shape
    if n >= m:
        most = min(most, n)
        stone = np.argpartition(reduced, most - 1, axis=0)[:most].ravel()
        cell = np.tile(np.arange(m), most)
    else:
        most = min(most, m)
        cell = np.argpartition(reduced, most - 1, axis=1)[:, :most].ravel()
        stone = np.repeat(np.arange(n), most)
    filled = np.flatnonzero(chosen >= 0)
    return np.concatenate([stone, chosen[filled]]), np.concatenate([cell, filled])


def _unique(work: Candidates, stone: Ints, cell: Ints) -> tuple[Ints, Ints]:
    m = len(work.cells)
    found, other = np.divmod(np.unique(stone * m + cell), m)
    return found, other


def _answer(
    work: Candidates, settings: MatchSettings, weight: float, chosen: Ints, order: Ints, given: Sequence[Stone]
) -> Match:
    """The match in numbers, as exact as its pairs are known; stones by their order as they were given."""
    placements = [
        Placement.of(int(order[i]), j, work.stones[i], work.cells, work.pose(i, j), float(work.value[i, j]))
        for j, i in enumerate(chosen.tolist())
        if i >= 0
    ]
    found = Match.of(placements, given, work.cells, weight, settings)
    notes, wall = [], found.gap_of_wall
    if settings.gap is not None and not wall <= settings.gap + GAP_SLACK:
        notes.append(f"gap {settings.gap:g} cannot be reached with these stones: {wall:.3f} of the wall is void")
    if len(found.empty):
        there = "is only 1 stone" if len(given) == 1 else f"are only {len(given)} stones"
        notes.append(f"{len(found.empty)} of {len(chosen)} cells stay empty: there {there}")
    return replace(found, notes=tuple(notes))
