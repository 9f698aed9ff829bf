"""The trade-off between carving and interlock: walls from one drawing and one stock, all at the same gap.

A drawing that is kept as it is (imposition) interlocks as it was meant to, and costs the most carving; cells that go
wherever the stones want them cost the least, and interlock as it happens. Between lie walls without number. Some are
made here by a plan that depends on nothing but their number:

    1  the wall as drawn                         2  its cells moved freely (share 1 of `negotiation`)
    3  the wall as drawn, with the best J         4  that one, its cells moved freely (unless J is 1 as drawn)
    5  and more: other seeds, every other one with the best J to begin with; the share, the coursing about that of the
       drawing, and the depth where a range of it is allowed, by multiples of irrationals [Richtmyer]_, which fill
       their ranges evenly however many there are; shares near 1 are more frequent

Every wall is drawn with exact joints, its stones are matched at the gap, and coupled analysis says whether it stands.
A wall is beaten (dominated) by one that carves no more and interlocks no less, and is better in one of the two
[Pareto]_. Walls that cannot be shown to stand beat nobody and are not recommended, nor those with a larger gap than
was asked for: they would win by leaving the wall empty. One that is fuller counts, for it carves the more for it.

By hand: of (Lambda, J) = (0.2, 0.7), (0.3, 0.9), (0.3, 0.8) and (0.4, 0.9) the third and the fourth are beaten, both by
the second.

>>> unbeaten(np.array([0.2, 0.3, 0.3, 0.4]), np.array([0.7, 0.9, 0.8, 0.9])).tolist()
[True, True, False, False]

References
----------
.. [Pareto] Pareto: Manuale di economia politica (1906), chapter 6.
.. [Richtmyer] Richtmyer: The evaluation of definite integrals, and a quasi-Monte-Carlo method based on the properties
   of algebraic numbers. Los Alamos LA-1342 (1951): fractional parts of multiples of square roots.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.design.matching.cells import Cells, cells_of
from cyclopean.design.matching.match import GAP_SLACK, Match, MatchSettings, Placement
from cyclopean.design.matching.negotiation import Moving, negotiate
from cyclopean.design.options import at_least
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.stone import Stone
from cyclopean.design.walls.interlock import interlock
from cyclopean.design.walls.joints import Masonry
from cyclopean.design.walls.mapped import Mapped
from cyclopean.design.walls.pattern import PatternSettings, Seeds, draw_from, draw_pattern
from cyclopean.design.walls.polygonal import PolygonalWall, laid_wall, polygonal_wall, verdict
from cyclopean.design.walls.surfaces import Surface, Thickness, refuse_folds
from cyclopean.errors import InputError
from cyclopean.options import check_options, option

__all__ = ["Alternative", "Asked", "Tradeoff", "TradeoffSettings", "tradeoff", "unbeaten"]

WALLS = 12  # where no number is given
GAP = 0.1  # where none is given: of stock hardly larger than the cells, less void cannot be had without much carving
COURSING = 0.25  # by which the coursing may be more or less than that of the drawing
STEPS = ((5**0.5 - 1.0) / 2.0, 2**0.5, 3**0.5)  # of share, coursing and depth, from wall to wall: no two keep pace
STABLE = "stable"


@dataclass(frozen=True, slots=True)
class TradeoffSettings:
    """How many walls, and what may differ beside seeds, coursing and negotiation."""

    walls: int = option(
        WALLS, "N walls between least carving and best interlock, at one gap.", "whole", metavar="N", least=2, most=500
    )
    depths: tuple[float, float] | None = option(
        None, "Least and greatest depth (m) of the walls of a trade-off [as drawn].", "pair", metavar="L,L"
    )
    rounds: int | None = None  # of each negotiation, as of `negotiate`

    def __post_init__(self) -> None:
        check_options(self)
        if self.rounds is not None:
            at_least("rounds", self.rounds, 1)
        if self.depths is not None and not 0.0 < self.depths[0] <= self.depths[1]:
            raise InputError.of("depths", None, f"expected a least depth above 0 and no greater one, got {self.depths}")


@dataclass(frozen=True, slots=True)
class Asked:
    """What one wall was made from."""

    seed: int
    coursing: float
    depth: float  # m
    share: float  # of negotiation: 0 = cells stay as they are laid out, 1 = they go where the stones want them
    improved: bool  # whether seeds were moved for the best J before
    redrawn: bool  # from other seeds than those of the drawing


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """One wall, the stones in it, and what it is judged by."""

    asked: Asked
    wall: PolygonalWall
    cells: Cells
    match: Match
    interlock: float  # J
    verdict: str  # of coupled analysis

    @property
    def imposition(self) -> float:
        """Lambda."""
        return self.match.imposition

    @property
    def gap(self) -> float:
        """Void / volume of the wall."""
        return self.match.gap_of_wall

    def fault(self, gap: float) -> str:
        """Why it is not to be recommended whatever it scores; nothing where it stands with no more void than `gap`."""
        if self.verdict != STABLE:
            return self.verdict
        return "" if self.gap <= gap + GAP_SLACK else f"gap {self.gap:.3f}"


@dataclass(frozen=True, slots=True, eq=False)
class Tradeoff:
    """Walls at one gap, the first of them as drawn."""

    alternatives: tuple[Alternative, ...]
    gap: float
    non_dominated: tuple[int, ...]  # of them, by Lambda
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.alternatives)


@dataclass(frozen=True, slots=True, eq=False)
class _Drawing:
    """What the walls are drawn from."""

    seeds: Seeds
    settings: PatternSettings
    surface: Surface
    thickness: Thickness
    masonry: Masonry

    def laid(self, asked: Asked) -> PolygonalWall:
        """The wall before its cells move."""
        settings = self.pattern_settings(asked)
        if asked.redrawn:
            pattern = draw_pattern(settings, self.surface.area_ratio if isinstance(self.surface, Mapped) else None)
        else:
            pattern = draw_from(self.seeds, settings)
        return polygonal_wall(
            pattern,
            surface=self.surface,
            depth=asked.depth,
            batter=self.thickness.batter,
            density=self.masonry.density,
            mu=self.masonry.mu,
            warped=self.masonry.warped,
            improve=asked.improved,
        )

    def relaid(self, asked: Asked, seeds: Seeds, coursing: float, sliver: float) -> PolygonalWall:
        """The wall that grows from these seeds."""
        pattern = draw_from(seeds, replace(self.pattern_settings(asked), coursing=coursing, sliver=sliver))
        return laid_wall(pattern, self.surface, replace(self.thickness, depth=asked.depth), self.masonry)

    def pattern_settings(self, asked: Asked) -> PatternSettings:
        """Those of the drawing, but for what is asked."""
        return replace(self.settings, seed=asked.seed, coursing=asked.coursing)


def tradeoff(
    stones: Inventory | Sequence[Stone],
    drawn: PolygonalWall,
    wanted: TradeoffSettings | None = None,
    settings: MatchSettings | None = None,
    executor: Executor | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Tradeoff:
    """Make walls between least carving and best interlock, and say which of them no other beats.

    Parameters
    ----------
    stones : Inventory or sequence of Stone
        At least one.
    drawn : PolygonalWall
        Drawn from seeds.
    wanted : TradeoffSettings, optional
        How many walls, and whether their depth may differ.
    settings : MatchSettings, optional
        As of `match_stones`; the gap is that of all walls, 0.1 where none is given, and finds their weights.
    executor : Executor, optional
        Makes every wall as one call; this process where not given. The answer is the same.
    progress : callable
        Told what is being done.

    Returns
    -------
    Tradeoff
        Walls of the plan that cannot be drawn are left out, and said in its notes.

    Raises
    ------
    InputError
        A wall that was not drawn from seeds, a weight, depths at which the surface folds, or as `negotiate`.
    """
    wanted, settings = wanted or TradeoffSettings(), settings or MatchSettings()
    if settings.weight != MatchSettings().weight:
        raise InputError.of("weight", None, "has no say in a trade-off, which finds it at one gap; give `gap` instead")
    notes = [] if settings.gap is not None else [f"gap {GAP:g} assumed, at which all walls are compared (`gap`)"]
    settings = replace(settings, gap=GAP) if settings.gap is None else settings
    stock = tuple(stones.stones if isinstance(stones, Inventory) else stones)
    drawing = _drawing(drawn, wanted)
    plan = list(_plan(drawing, wanted))
    made: list[Alternative] = []
    columns = zip(*((stock, drawing, asked, settings, wanted.rounds) for asked in plan), strict=True)
    answers = map(_made, *columns) if executor is None else executor.map(_made, *columns)
    for k, answer in enumerate(answers):
        progress(f"wall {k + 1} of {len(plan)}")
        if len(answer) > 1:
            made.append(_alternative(answer, stock, drawing, plan[k], settings))
        elif k == 0:
            raise InputError(str(answer[0]))
        else:
            notes.append(f"one wall of {len(plan)} is left out (seed {plan[k].seed}): {answer[0]}")
    return _judged(made, settings, notes)


def _judged(made: Sequence[Alternative], settings: MatchSettings, notes: Sequence[str]) -> Tradeoff:
    """The walls, and which of them no other beats."""
    assert settings.gap is not None
    fair = np.array([k for k, one in enumerate(made) if not one.fault(settings.gap)], np.int64)
    carved, locked = (np.array([getattr(made[k], name) for k in fair]) for name in ("imposition", "interlock"))
    best = unbeaten(carved, locked)
    order = np.lexsort((fair[best], carved[best]))
    return Tradeoff(tuple(made), settings.gap, tuple(fair[best][order].tolist()), tuple(notes))


def unbeaten(imposition: Floats, interlock: Floats) -> Bools:
    """Which of some walls, (n,) numbers each, none beats: by less carving and no less interlock, or the other way."""
    less, more = imposition[:, None] - imposition, interlock[:, None] - interlock
    beats = (less <= 0.0) & (more >= 0.0) & ((less < 0.0) | (more > 0.0))  # the row the column
    return np.asarray(~beats.any(axis=0))


def _drawing(drawn: PolygonalWall, wanted: TradeoffSettings) -> _Drawing:
    """What the walls are drawn from.

    Raises
    ------
    InputError
        There are no seeds, or the surface folds at the greatest depth.
    """
    pattern = drawn.pattern
    if pattern.seeds is None:
        raise InputError("tradeoff: the wall was not drawn from seeds, so there are none to move; draw it anew")
    if wanted.depths is not None:
        deepest = replace(drawn.thickness, depth=wanted.depths[1])
        refuse_folds(drawn.surface, deepest, pattern.settings.width, pattern.settings.height)
    return _Drawing(pattern.seeds, pattern.settings, drawn.surface, drawn.thickness, drawn.masonry)


def _plan(drawing: _Drawing, wanted: TradeoffSettings) -> Iterator[Asked]:
    """What is asked of each wall, see the head of this module."""
    settings, depth = drawing.settings, drawing.thickness.depth
    low, high = wanted.depths or (depth, depth)
    drawn = 4 if interlock(draw_from(drawing.seeds, settings)).score < 1.0 else 2
    for k in range(min(drawn, wanted.walls)):
        yield Asked(settings.seed, settings.coursing, depth, float(k % 2), k >= 2, redrawn=False)
    for k in range(1, wanted.walls - drawn + 1):
        share, level, deep = (float((0.5 + k * step) % 1.0) for step in STEPS)
        share = 1.0 - share * share  # more of them near 1: of walls of 24 cells those below a half were mostly beaten
        coursing = min(1.0, max(0.0, settings.coursing + COURSING * (2.0 * level - 1.0)))
        yield Asked(settings.seed + k, coursing, low + deep * (high - low), share, k % 2 == 1, redrawn=True)


def _made(
    stones: Sequence[Stone], drawing: _Drawing, asked: Asked, settings: MatchSettings, rounds: int | None
) -> tuple[np.ndarray[Any, Any], ...]:
    """One wall as arrays, ready to be kept: of the seeds, the settings that changed, the match and the verdict; or
    one only, that says why there is none.
    """
    try:
        done = negotiate(stones, drawing.laid(asked), settings, Moving(asked.share, rounds))
    except InputError as error:
        return (np.array(str(error)),)
    pattern, match = done.wall.pattern, done.match
    assert pattern.seeds is not None
    placed = match.placements
    return (
        pattern.seeds.point,
        pattern.seeds.weight,
        np.array([pattern.settings.coursing, pattern.settings.sliver, match.weight]),
        np.array([(p.stone, p.cell) for p in placed], np.int64).reshape(-1, 2),
        np.array([p.rotation for p in placed]).reshape(-1, 3, 3),
        np.array([p.shift for p in placed]).reshape(-1, 3),
        np.array([(p.shared, p.carved_share, p.gap_share) for p in placed]).reshape(-1, 3),
        np.array([verdict(done.wall.assembly), *done.notes]),
    )


def _alternative(
    made: Sequence[np.ndarray[Any, Any]],
    stones: Sequence[Stone],
    drawing: _Drawing,
    asked: Asked,
    settings: MatchSettings,
) -> Alternative:
    """A wall from its arrays."""
    point, weight, (coursing, sliver, price), pairs, rotation, shift, volumes, said = made
    wall = drawing.relaid(asked, Seeds(point, weight), float(coursing), float(sliver))
    cells = cells_of(wall.assembly)
    rows = zip(pairs.tolist(), rotation, shift, volumes.tolist(), strict=True)
    placements = [Placement(i, j, turn, move, *shares) for (i, j), turn, move, shares in rows]
    match = replace(Match.of(placements, stones, cells, float(price), settings), notes=tuple(said[1:].tolist()))
    return Alternative(asked, wall, cells, match, interlock(wall.pattern).score, str(said[0]))
