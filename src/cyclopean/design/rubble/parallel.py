"""A long wall laid from two fronts, one from either end, each with its own half of the stones.

Each front begins a course at its end and stops well before the middle; what is left between them is closed from both in
turn. The middle is elsewhere in each course, so that what is closed last does not lie above what was.

No stone of one front touches, or comes near, what the other one lays meanwhile. And neither lays a stone that would
change forces beyond the middle: all stones whose forces it finds anew have their centres in its own half, so that no
joint is changed by both, and none that one of them counts on by the other. So whatever the order in which they work, or
beside each other in two processes, the wall comes out the same, to the bit, and stands at every stage.

In another process, a copy of the site is kept, and brought up to date by what was laid since.
"""

import secrets
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from cyclopean.design.rubble.coursing import Course, inwards
from cyclopean.design.rubble.places import Looked, Slot, different, ranked
from cyclopean.design.rubble.site import Site, Turn
from cyclopean.design.rubble.wall import SettleSettings
from cyclopean.design.stones.stone import Stone

__all__ = ["Fronts"]

LONG = 64.0  # mean lengths: a wall as long as that is laid from two fronts
APART = 0.75  # mean lengths: that a front keeps off the middle
ROOM = 1.5  # mean lengths: where less than that is left to a front, it stops
SWAY = 4.0  # mean lengths: by which the middle moves from course to course
ENDS = (-1, 1)
FEW = 24  # places looked at closely, of each choice, in a part of the wall
PARTS = 4  # parts that a stone is tried in, at the end
SECTION = 8.0  # mean lengths: part of a wall that is looked at together


@dataclass(frozen=True, slots=True)
class Task:
    """What one front is to do."""

    side: int  # the end that it lays from: -1 or 1
    middle: int  # cell
    course: Course
    stones: tuple[int, ...]  # its own, as they come
    first: int  # number of the first that it lays
    again: bool  # whether to try each of its stones once more anywhere in its half, and not to begin a course


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """What it did."""

    turns: tuple[Turn, ...]
    vain: Counter[int]  # times more that its stones were tried in vain, in this course
    worn: Counter[int]  # ... in all
    open: int  # cell that it came to
    joints: list[float]  # m


class Fronts:
    """One front, or two on a long wall."""

    def __init__(self, site: Site, executor: Executor | None = None) -> None:
        self.site, self.executor = site, executor
        self.two = site.settings.look_ahead > 0 and site.map.shape[0] * site.cell >= LONG * site.mean
        self.key = secrets.token_hex()  # of the copy elsewhere

    def begun(self, course: Course) -> tuple[tuple[int, int], list[float]]:
        """Begin a course; the cells that are still open, and x (m) of the head joints so far."""
        if not self.two:
            return (0, self.site.map.shape[0]), []
        low, high = self._worked(course, again=False)
        return (low.open, high.open), low.joints + high.joints

    def again(self, course: Course) -> None:
        """Try each stone that is left at the best places of the whole wall, or of some parts of a long one, in turn."""
        if self.two:
            self._worked(course, again=True)
        else:
            _once_more(self.site, course, (0, self.site.map.shape[0]))

    def _worked(self, course: Course, *, again: bool) -> list[Report]:
        """Have each front do its task; all that they laid then stands."""
        site = self.site
        sway = (course.number % 3 - 1) * SWAY * site.mean
        middle = round(site.map.shape[0] / 2 + sway / site.cell)
        number, whole = site.structure.next, site.left
        tasks = [
            Task(side, middle, course, tuple(whole[k::2]), number + 2 * k * len(whole), again)
            for k, side in enumerate(ENDS)
        ]
        if self.executor is None:
            reports = [_worked(site, task) for task in tasks]
        else:
            turns, tried = tuple(site.turns), (site.joints, Counter(site.vain), Counter(site.worn))
            there = self.executor.submit(_elsewhere, self.key, site.stones, site.settings, turns, tried, tasks[1])
            reports = [_worked(site, tasks[0]), there.result()]
            _caught_up(site, reports[1].turns)
            site.vain.update(reports[1].vain)
            site.worn.update(reports[1].worn)
        site.left = [k for k in whole if k not in {turn.trial.stone for report in reports for turn in report.turns}]
        site.structure.next = max(site.stood, default=-1) + 1
        return reports


def _worked(site: Site, task: Task) -> Report:
    """Do a task."""
    vain, worn, count = Counter(site.vain), Counter(site.worn), len(site.turns)
    site.left, site.looked = list(task.stones), Looked()
    site.structure.next, site.structure.worst = task.first, 0
    n, lower, middle = site.map.shape[0], task.side < 0, task.middle * site.cell
    off = APART * site.mean
    site.structure.between = (-np.inf, middle) if lower else (middle, np.inf)
    site.between = (-np.inf, middle - off) if lower else (middle + off, np.inf)
    cells = (0, task.middle) if lower else (task.middle, n)
    joints: list[float] = []
    if task.again:
        least = round(off / site.cell)
        _once_more(site, task.course, (0, cells[1] - least) if lower else (cells[0] + least, n))
    else:
        cells, joints = inwards(site, task.course, cells, (task.side,), (APART + ROOM) * site.mean)
    site.between = site.structure.between = -np.inf, np.inf
    site.looked, site.structure.worst = Looked(), 0
    reached = cells[0] if lower else cells[1]
    return Report(tuple(site.turns[count:]), site.vain - vain, site.worn - worn, reached, joints)


def _once_more(site: Site, course: Course, cells: tuple[int, int]) -> None:
    """Try each stone that is left at the best places of these cells, or of some parts of them, in turn."""
    for turn, number in enumerate(tuple(site.left)):
        lying = [b for bed in (0, 1) for b in site.bedded(number, bed)]
        weights = site.settings.weights
        parts = _sections(site, course.level, cells)
        parts = [parts[(turn * PARTS + k) % len(parts)] for k in range(min(PARTS, len(parts)))]
        places = [p for slot in parts for p in different(ranked(site.map, lying, slot, weights, site.cell, FEW))]
        trial = site.first(sorted(places, key=lambda p: p.cost)[: site.settings.tries], [])
        if trial is not None:
            site.take(trial, course.number, 0)


def _sections(site: Site, level: float, cells: tuple[int, int]) -> list[Slot]:
    """A part of the wall, open from above, in sections that overlap."""
    first, last = cells
    long = round(SECTION * site.mean / site.cell)
    starts = range(first, max(last - long, first) + 1, max(long // 2, 1))
    ends = [(k, min(k + long, last)) for k in starts]
    ends[-1] = (ends[-1][0], last)
    across = np.array([0, site.map.shape[1]])
    return [Slot(np.array(x), across, level, site.limit, both=True) for x in ends]


_COPIES: dict[str, Site] = {}  # of the last wall that this process was asked to work on


def _elsewhere(
    key: str,
    stones: Sequence[Stone],
    settings: SettleSettings,
    turns: Sequence[Turn],
    tried: tuple[dict[int, list[float]], Counter[int], Counter[int]],
    task: Task,
) -> Report:
    """Do a task on a copy of the site, brought up to date with turns, and head joints and tries in vain so far."""
    if key not in _COPIES:
        _COPIES.clear()
        _COPIES[key] = Site(stones, settings, lambda _: None)
    site = _COPIES[key]
    _caught_up(site, turns)
    site.joints, site.vain, site.worn = tried
    return _worked(site, task)


def _caught_up(site: Site, turns: Sequence[Turn]) -> None:
    """Lay what others laid."""
    for turn in turns:
        if turn.number not in site.stood:
            site.structure.next = turn.number
            site.take(turn.trial, turn.course, turn.wythe)
