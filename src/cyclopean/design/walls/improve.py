"""A better interlock: move seeds and weights near joints that run on, and keep what raises the score J.

In each round one seed beside each offending place (an aligned pair of head joints, a crossing) is shaken: mostly along
the wall, a little up and down, or its weight is changed. Seeds shaken in one round are so far apart that each can be
judged by the offences near it; those that made things worse go back. What remains is kept if the whole pattern is
better, or, as in simulated annealing, a little worse now and then while the search is young. A pattern that loses a
stone, gains a thinner one or a crossing, or becomes less even than it was is never kept.

Besides the score the search sees how far pairs are from being aligned, and joints that meet end to end though their
midpoints differ: so it is led out of a plateau, keeps a margin, and does not please the score alone. All chance comes
from the settings' seed and work is counted, not timed: the same wall is improved likewise on any machine.

The search knows nothing of forces. `improvements` therefore hands out several walls, the best first and the one that
it began with last: `standing` takes the first of them that stands, if the last one does.

Builds on relaxation by moving seeds, Lloyd (1982), and on the score of `design.walls.interlock`;
local search as such is old.

>>> found = improve_interlock(PatternSettings(seed=3), rounds=5)
>>> interlock(found).score >= interlock(draw_pattern(found.settings)).score
True
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.design.options import at_least
from cyclopean.design.walls.interlock import Interlock, course_lines, interlock, joint_gaps
from cyclopean.design.walls.pattern import Pattern, PatternSettings, Seeds, draw_from, draw_pattern, seed_grid
from cyclopean.errors import InputError

__all__ = ["Chosen", "improve_interlock", "improvements", "standing"]

MARGIN = 1.5  # of the tolerance: pairs nearer than this weigh on the search, the more the nearer they are
PULL = 0.3  # what the margin weighs beside an offence
NEAR = 2.1  # spacings within which an offence is put down to a seed
APART = 4.5  # spacings between two seeds that are shaken in one round
BESIDE = 4  # seeds beside an offence, of which one is shaken
GRADED = 0.25  # of the shakes change the weight
STEP = (0.22, 0.1, 0.25)  # standard deviations along u and v (spacings) and of the weight (mean cells)
STRAY = 0.6  # spacings that a seed may go from where it began
THIN = 0.9  # of the thinnest stone's inradius proxy: no stone becomes thinner than this
UNEVEN = 1.1  # area CV may grow to this times what it was ...
EVEN = 0.33  # ... or to this, if that is more
ROUNDS = 300  # at most; a wall of 200 stones is usually done before
STONES = 60_000  # that are drawn on the whole: some 15 s, so that walls of thousands end as well
PATIENCE = 80  # rounds without a better wall after which the search ends
STABLE = "stable"  # the verdict that is to be kept
HEAT = 0.01  # of the energy, that a young search may lose in a round


Wall = TypeVar("Wall")


@dataclass(frozen=True, slots=True, eq=False)
class _Scored:
    """A pattern, its score, and where what is wrong with it lies."""

    pattern: Pattern
    seeds: Seeds  # of the pattern
    found: Interlock
    place: Floats  # (k, 2) spacings
    offence: Floats  # (k,) share of J that is lost there, margin included

    @property
    def energy(self) -> float:
        return float(self.offence.sum())

    @property
    def rank(self) -> tuple[float, float]:
        return self.found.score, -self.energy


@dataclass(frozen=True, slots=True, eq=False)
class _Start:
    """What the search began with, which bounds where it may go."""

    pattern: Pattern
    seeds: Seeds  # of the pattern
    origin: Floats  # (2,) m, of the grid of seeds
    spacing: Floats  # (2,) m
    thinnest: float  # m, least inradius proxy that a stone may have


@dataclass(frozen=True, slots=True)
class Chosen:
    """Which of several walls was taken, and whether it stands."""

    place: int  # in the list of walls, the best first
    verdict: str  # of coupled analysis, on this wall
    before: str | None  # its verdict on the wall that the search began with; None = there was no need to ask


def improve_interlock(wall: Pattern | PatternSettings, *, rounds: int | None = None) -> Pattern:
    """Move seeds and weights of a wall to raise its interlock score.

    Parameters are those of `improvements`, of which this is the first.

    Returns
    -------
    Pattern
        With a score no lower than that of the wall given, as many stones, and no more crossings. Whether it stands is
        for the caller to check.

    Raises
    ------
    InputError
        As `improvements`.
    """
    return improvements(wall, rounds=rounds)[0]


def improvements(
    wall: Pattern | PatternSettings, *, rounds: int | None = None, until: float = 1.0
) -> tuple[Pattern, ...]:
    """Walls that the search came through on its way to the best one.

    Parameters
    ----------
    wall : Pattern or PatternSettings
        A pattern drawn from seeds, or what to draw one from.
    rounds : int, optional
        At most; each draws the pattern once or twice. 300 where not given, fewer for walls of more than 200 stones.
    until : float
        Score at which the search ends.

    Returns
    -------
    tuple of Pattern
        In falling order: the best, some that were the best before it (the last, then 2, 4, 8 ... steps back), and the
        wall that the search began with; that one alone where nothing better was found.

    Raises
    ------
    InputError
        A pattern that was not drawn from seeds, or a number of rounds below 0.
    """
    pattern = draw_pattern(wall) if isinstance(wall, PatternSettings) else wall
    if pattern.seeds is None:
        raise InputError("improve: the pattern was not drawn from seeds, so there are none to move; leave it out")
    usual = min(ROUNDS, max(1, STONES // pattern.readout.cells))
    rounds = usual if rounds is None else at_least("rounds", rounds, 0)
    origin, spacing = seed_grid(pattern.settings)
    thinnest = THIN * float(pattern.subdivision.inradii().min())
    start = _Start(pattern, pattern.seeds, origin, spacing, thinnest)
    state = _scored(pattern, pattern.seeds, start)
    better = [state]
    draw = np.random.Generator(np.random.PCG64([pattern.settings.seed, 1]))
    since = 0
    for k in range(rounds):
        if not len(state.place) or since >= PATIENCE or (better[-1].found.score >= until and until < 1.0):
            break
        since += 1
        trial = _round(state, start, draw)
        if trial is None:
            continue
        warmth = HEAT * (1.0 - (k + 1) / rounds)
        if trial.energy < state.energy + warmth * draw.exponential():
            state = trial
        if trial.rank > better[-1].rank:
            better.append(trial)
            since = 0
    back = {0, *(2**k for k in range(len(better).bit_length())), len(better) - 1}
    return tuple(better[-1 - k].pattern for k in sorted(back) if k < len(better))


def standing(walls: Sequence[Wall], verdict: Callable[[Wall], str]) -> Chosen:
    """The first of several walls that stands, provided that the last one does; else the first.

    Parameters
    ----------
    walls : sequence
        The best first, and last the one that a search began with.
    verdict : callable
        "stable" for a wall that stands; asked as seldom as may be.
    """
    first = verdict(walls[0])
    if first == STABLE or len(walls) == 1:
        return Chosen(0, first, None)
    before = verdict(walls[-1])
    if before != STABLE:  # there is no stability to keep
        return Chosen(0, first, before)
    for k, wall in enumerate(walls[1:-1], 1):
        if verdict(wall) == STABLE:
            return Chosen(k, STABLE, before)
    return Chosen(len(walls) - 1, before, before)


def _round(state: _Scored, start: _Start, draw: np.random.Generator) -> _Scored | None:
    """Shake some seeds, take back those that made things worse nearby; None where nothing valid came out."""
    old = state.seeds
    chosen = _chosen(state, draw)
    point, weight = old.point.copy(), old.weight.copy()
    move = draw.normal(size=(len(chosen), 3)) * STEP
    graded = draw.random(len(chosen)) < GRADED
    point[chosen] += np.where(graded[:, None], 0.0, move[:, :2])
    point[chosen] = np.clip(point[chosen], start.seeds.point[chosen] - STRAY, start.seeds.point[chosen] + STRAY)
    weight[chosen] += np.where(graded, move[:, 2], 0.0)
    trial = _drawn(Seeds(point, weight), start)
    if len(chosen) == 1:
        return trial
    if trial is None:  # one of them spoilt it: go on with half
        back = chosen[: (len(chosen) + 1) // 2]
    else:
        back = chosen[_nearby(trial, old.point[chosen]) > _nearby(state, old.point[chosen])]
    if len(back) in (0, len(chosen)):
        return trial
    point[back], weight[back] = old.point[back], old.weight[back]
    return _drawn(Seeds(point, weight), start)


def _chosen(state: _Scored, draw: np.random.Generator) -> Ints:
    """Seeds to shake: one of those nearest to each offending place, in random order, as many as are far apart."""
    from scipy.spatial import cKDTree

    point = state.seeds.point
    order = np.argsort(-state.offence * draw.random(len(state.place)), kind="stable")
    count = min(BESIDE, len(point))
    near = cKDTree(point).query(state.place[order], k=np.arange(1, count + 1))[1]
    pick = near[np.arange(len(order)), draw.integers(count, size=len(order))]
    taken: list[int] = []
    free: Bools = np.ones(len(point), bool)
    for k in pick.tolist():
        if free[k]:
            taken.append(k)
            free &= np.hypot(*(point - point[k]).T) > APART
    return np.array(taken, np.int64)


def _nearby(state: _Scored, point: Floats) -> Floats:
    """Offence within reach of each point, (m,)."""
    if not len(state.place):
        return np.zeros(len(point))
    far = np.hypot(*(state.place[None] - point[:, None]).transpose(2, 0, 1))
    total: Floats = np.where(far <= NEAR, state.offence, 0.0).sum(axis=1)
    return total


def _drawn(seeds: Seeds, start: _Start) -> _Scored | None:
    """The pattern of these seeds, if it is as sound as the one that the search began with."""
    was = start.pattern.readout
    try:
        pattern = draw_from(seeds, start.pattern.settings)
    except InputError:  # too many slivers
        return None
    now = pattern.readout
    sound = now.cells >= was.cells and now.culled <= was.culled and now.merged <= was.merged
    even = now.area_cv <= max(UNEVEN * was.area_cv, EVEN)
    even = even and float(pattern.subdivision.inradii().min()) >= start.thinnest
    whole = abs(now.coverage - 1.0) <= 1e-9
    if not (sound and even and whole and now.crossings <= was.crossings):
        return None
    return _scored(pattern, seeds, start)


def _scored(pattern: Pattern, seeds: Seeds, start: _Start) -> _Scored:
    """Score, and what takes from it: head joints by their nearest fellow in the next course, and crossings."""
    cells, found = pattern.subdivision, interlock(pattern)
    tolerance, reach = found.tolerance, MARGIN * found.tolerance
    low, high, gap = joint_gaps(cells, course_lines(pattern), found.head, reach + 0.5 * float(start.spacing[0]))
    ends = cells.vertex[cells.edge[found.head]]
    rows, v = np.arange(len(ends)), ends[..., 1]
    foot, top = ends[rows, v.argmin(axis=1), 0], ends[rows, v.argmax(axis=1), 0]
    nearest, meeting = np.full(len(ends), np.inf), np.full(len(ends), np.inf)
    for joint in (low, high):
        np.minimum.at(nearest, joint, gap)
        np.minimum.at(meeting, joint, np.abs(top[low] - foot[high]))
    cost = (nearest <= tolerance) + PULL * np.maximum(reach - nearest, 0.0) / max(reach, 1e-300)
    cost += PULL * np.maximum(tolerance - meeting, 0.0) / max(tolerance, 1e-300)
    joint = np.flatnonzero(cost > 0.0)
    share = cells.lengths()[found.head[joint]] / max(found.head_length, 1e-300)
    middle = cells.vertex[cells.edge[found.head[joint]]].mean(axis=1)
    place = (np.concatenate([middle, cells.vertex[found.crossings]]) - start.origin) / start.spacing
    offence = np.concatenate([cost[joint] * share, np.full(len(found.crossings), 0.5 / len(cells))])
    return _Scored(pattern, seeds, found, place, offence)
