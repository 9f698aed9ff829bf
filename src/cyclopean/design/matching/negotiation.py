"""Negotiation: the cells of a polygonal wall move towards the stones that they were given, and stones are given anew.

A round is a climb of all poses, sites and weights at once (`ascent`), the wall drawn again from the moved seeds with
exact joints, and a match in the cells it really has, in which the stones placed before are candidates. What is reported
of a round is exact. The wall that is returned is that of the best round, by carved + w void.

`share` says how much the wall gives: 0 = imposition, cells stay as drawn; 1 = the cells go wherever the stones want
them. Between, seeds are tied to where they were drawn, and courses are levelled by (1 - share) of what the drawing
asked for, since level courses are what a designer imposes.

No stone of the drawing is lost: seeds stay on the wall, and a step that hides a cell or makes a sliver of it is taken
back by halves. A wall that stands is not given up for one that does not: then the seeds go back towards the drawing
until coupled analysis says that it stands.

The chapter's section 5.6 asks for this dialogue between stock and design; for the matching of irregular stock see
Bukauskas et al. (2019), Bruetting et al. (2019) and Clifford and McGee (2018).
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.design.matching.ascent import Bodies, Climb, Variables, climbed
from cyclopean.design.matching.candidates import CLIMB, POLISH
from cyclopean.design.matching.cells import Cells, cells_of
from cyclopean.design.matching.exact import FLIPS, Solids
from cyclopean.design.matching.flattening import flat_wall, frames_at
from cyclopean.design.matching.match import Known, Match, MatchSettings, Placement, match_stones
from cyclopean.design.matching.problem import Problem, Singles
from cyclopean.design.matching.refine import refine
from cyclopean.design.options import at_least, within
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.sampling import body_points
from cyclopean.design.stones.stone import Stone, stone_of
from cyclopean.design.walls.pattern import Pattern, PatternSettings, Seeds, draw_from, live_seeds
from cyclopean.design.walls.polygonal import PolygonalWall, laid_wall, verdict
from cyclopean.errors import InputError
from cyclopean.geometry.solids import fans

__all__ = ["Negotiation", "Round", "negotiate"]

Pose = tuple[Floats, Floats]  # rotation (3, 3) and centroid (3,) m of a body frame, in the wall
Poses = dict[int, Pose]

POINTS = 1024  # of each stone in a climb
TETHER = 1.0  # mean volumes of a stone, at an even share, that moving a site by a spacing costs, squared and halved
YIELD = (0.01, 0.07)  # of what a stone has in common with its cell: what moving the cell for another stone may gain
GOLDEN = 0.618  # by its multiples the rounds are spread over that evenly, however many there are
TRIES = 10  # of drawing a wall none of whose stones is lost
NEAR = 1.6  # spacings: seeds that step back together with one that lost its stone
NUDGES, NUDGE = 5, 0.05  # times, and mean cells, by which a seed is made heavier that levelling kept from being lost
BACK = (0.75, 0.5, 0.25, 0.0)  # shares of the way from the drawing that are tried when the wall does not stand
COVERED = 1e-9  # of the wall: so much may be missing of its cells' area
IDLE = 4  # rounds without a better one after which no other begins
ENDS = 3  # of the best rounds, of which that is kept which carves least at the gap asked for
MET = 0.002  # by which the total gap may miss what was asked
HASTY = (6, 512)  # pairs a cell, and points of a stone, at most, in a match that a climb follows
ROUNDS, WORK = (3, 12), 600  # rounds where their number is not given; cells times rounds
SPARE = 600  # pairs that are tried to meet a gap, one of them taking the place of another
FINALISTS = 8  # of these, that are measured
DENSE = 0.96  # of what a pair was seen to share in a short climb: what it is taken to share
FALL = (0.1, 0.4)  # by which the total gap falls, least and most, where the weight of void grows by a factor e
STABLE = "stable"


@dataclass(frozen=True, slots=True)
class Round:
    """What came of a round; all volumes exact."""

    imposition: float  # Lambda
    gap: float  # void / volume of the wall
    carved: float  # m3
    void: float  # m3
    weight: float  # w
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class Negotiation:
    """The wall in the end, which stone goes where in it, and how it came about."""

    wall: PolygonalWall
    match: Match  # in `cells_of(wall.assembly)`
    rounds: tuple[Round, ...]  # the first is the wall as drawn, the last the wall as it is
    notes: tuple[str, ...] = ()  # what a reader should know, one line each


@dataclass(frozen=True, slots=True, eq=False)
class _Turn:
    """A wall, what it grows from, and what stands in it."""

    wall: PolygonalWall
    seeds: Seeds
    cells: Cells
    match: Match

    @property
    def place(self) -> Ints:
        """Which cell of the pattern each cell is: some may be sawn, and are none."""
        return self.cells.block - (len(self.wall.assembly) - len(self.wall.pattern.subdivision))

    @property
    def site(self) -> Ints:
        """Seed of each cell of the pattern; -1 for dressed stones."""
        return self.wall.pattern.subdivision.site

    @property
    def carved(self) -> float:
        """m3."""
        return sum(p.carved for p in self.match.placements)

    @property
    def void(self) -> float:
        """m3, of the whole wall."""
        return self.match.gap_of_wall * float(self.cells.volume.sum())

    def cost(self, weight: float) -> float:
        """Carved + w void (m3)."""
        return self.carved + weight * self.void

    def told(self, began: float) -> Round:
        """What came of it, and how long it took since then."""
        match, took = self.match, perf_counter() - began
        return Round(match.imposition, match.gap_of_wall, self.carved, self.void, match.weight, took)


@dataclass(frozen=True, slots=True, eq=False)
class _Talk:
    """What stays the same throughout."""

    stock: tuple[Stone, ...]
    points: Singles
    settings: MatchSettings
    climb: Climb
    sawn: tuple[int, ...]  # blocks of the wall, in any drawing of it
    executor: Executor | None
    progress: Callable[[str], None]

    def matched(self, cells: Cells, weight: float | None, start: Match | None = None, yielding: float = 0.0) -> Match:
        """Stones given to cells at a weight of void, or as the settings say."""
        settings = self.settings
        if weight is not None:
            settings = replace(settings, weight=weight, gap=None)
        if yielding:  # the climb that follows moves the poses anyway
            few = min(settings.shortlist, HASTY[0]), min(settings.points, HASTY[1])
            settings = replace(settings, climbs=0, shortlist=few[0], points=few[1])
        known = Known(start, self.points, start is not None, yielding)  # they were measured where they are
        return match_stones(self.stock, cells, settings, self.executor, self.progress, known)

    def problem(self, cells: Cells) -> Problem:
        """The stones and some cells."""
        bonds = self.settings.bonds(cells)
        return Problem(self.stock, self.points, cells, bonds, self.executor, self.progress)

    def missed(self, turn: _Turn) -> float:
        """By how much the total gap is further than `MET` from what was asked."""
        asked = self.settings.gap
        return 0.0 if asked is None else max(0.0, abs(turn.match.gap_of_wall - asked) - MET)


@dataclass(frozen=True, slots=True)
class Moving:
    """How cells move towards their stones."""

    share: float = 1.0  # 0 = the cells stay as drawn, to 1 = they go where the stones want them
    rounds: int | None = None
    """Of climbing and matching; 0 is the same as a share of 0. None: 3 on a wall of 200 stones or more, and up to 12 on
    smaller ones, where they cost little."""
    climb: Climb = Climb()  # noqa: RUF009  frozen; how sites and poses climb; its tether is set by the share
    sawn: tuple[int, ...] = ()  # blocks of the wall that are sawn new, and get no stone

    def __post_init__(self) -> None:
        within("negotiate", self.share, 0.0, 1.0)
        if self.rounds is not None:
            at_least("rounds", self.rounds, 0)


def negotiate(
    stones: Inventory | Sequence[Stone],
    drawn: PolygonalWall,
    settings: MatchSettings | None = None,
    moving: Moving = Moving(),
    executor: Executor | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Negotiation:
    """Match stones to a wall whose cells move towards them.

    Parameters
    ----------
    stones : Inventory or sequence of Stone
        At least one; more than there are cells, or fewer.
    drawn : PolygonalWall
        Drawn from seeds.
    settings : MatchSettings, optional
        What is asked of the match. With a `gap`, the weight of void is found so that the total gap is that in the end.
    moving : Moving
        How cells move.
    executor : Executor, optional
        Runs ranking and refining; this process where not given. The answer is the same.
    progress : callable
        Told what is being done.

    Returns
    -------
    Negotiation
        The drawn wall itself where no other is better.

    Raises
    ------
    InputError
        A wall that was not drawn from seeds, or as `match_stones`.
    """
    settings = settings or MatchSettings()
    share, rounds, sawn = moving.share, moving.rounds, moving.sawn
    stock = tuple(stones.stones if isinstance(stones, Inventory) else stones)
    began = perf_counter()
    if not stock:
        raise InputError("stones: there are none to match; give at least one")
    progress("sampling stones")
    points = body_points(stock, max(POINTS, settings.points))
    seeds, _ = _freed(drawn, 0.0)
    tether = TETHER * (1.0 - share) / share if share else 0.0
    talk = _Talk(stock, points, settings, replace(moving.climb, tether=tether), sawn, executor, progress)
    cells = cells_of(drawn.assembly, None, sawn)
    first = _Turn(drawn, seeds, cells, talk.matched(cells, None))
    story = [first.told(began)]
    if share == 0.0 or rounds == 0:
        return Negotiation(drawn, first.match, tuple(story), first.match.notes)
    base, coursed = _base(first, share)
    best, told = _rounds(talk, first, base, int(np.clip(WORK // len(cells), *ROUNDS)) if rounds is None else rounds)
    began = perf_counter()
    end, notes = _standing(talk, first, best)
    if end is not best:
        told.append(end.told(began))
    return Negotiation(end.wall, end.match, (*story, *told), (*end.match.notes, *coursed, *notes))


def _rounds(talk: _Talk, first: _Turn, base: _Turn, rounds: int) -> tuple[_Turn, list[Round]]:
    """The best turn, and what came of each.

    Cells that move close some of the gap. Where a total gap is asked for, the weight of void falls from round to round
    until it is that again, with stones of which less is carved.
    """
    best, told, weight, idle = first, list[Round](), first.match.weight, 0
    turns = [first]
    tried: list[tuple[float, float]] = []  # weights, and the gaps that they led to
    for number in range(rounds):
        began, before = perf_counter(), best
        turn = base if best is first else best
        if number:
            yielding = YIELD[0] + (YIELD[1] - YIELD[0]) * (number * GOLDEN % 1.0)
            turn = replace(turn, match=talk.matched(turn.cells, weight, turn.match, yielding))
        moved = _climbed(talk, turn)
        if moved is not None:
            best = min(best, moved, key=lambda one: one.cost(weight))
            turns.append(moved)
            tried.append((weight, moved.match.gap_of_wall))
        told.append(best.told(began))
        weight = _reweighted(talk.settings.gap, tried, weight)
        idle = 0 if best is not before else idle + 1
        if idle == IDLE:
            break
    began = perf_counter()
    several = talk.settings.gap is not None and len(best.cells) <= SPARE // 2
    near = sorted(turns, key=lambda one: one.cost(weight))[: ENDS if several else 1]
    best = min((_ended(talk, turn, weight) for turn in near), key=lambda one: (talk.missed(one), one.cost(weight)))
    told[-1] = best.told(began - told[-1].seconds)
    return best, told


def _ended(talk: _Talk, turn: _Turn, weight: float) -> _Turn:
    """A turn, or the same cells matched once more, or some of their stones changed: what meets the gap asked for."""
    last = talk.matched(turn.cells, None if talk.settings.gap is not None else weight, turn.match)
    best = min(turn, replace(turn, match=last), key=lambda one: (talk.missed(one), one.cost(weight)))
    return _trimmed(talk, best) if talk.missed(best) and len(best.cells) <= SPARE // 2 else best


def _reweighted(asked: float | None, tried: Sequence[tuple[float, float]], weight: float) -> float:
    """The weight at which the gap should be what was asked, by the last two tries, or by what is usual."""
    if asked is None or not tried:
        return weight
    (last, gap), fall = tried[-1], FALL[0]
    if len(tried) > 1 and tried[-2][0] != last:
        fall = float(np.clip((tried[-2][1] - gap) / np.log(last / tried[-2][0]), *FALL))
    return last * float(np.exp(np.clip((gap - asked) / fall, -0.5, 0.5)))


def _freed(drawn: PolygonalWall, share: float) -> tuple[Seeds, PatternSettings]:
    """The seeds that have stones, and settings by which the same stones grow from them, less strictly coursed."""
    pattern = drawn.pattern
    if pattern.seeds is None:
        raise InputError("negotiate: the wall was not drawn from seeds, so there are none to move; draw it anew")
    live = live_seeds(pattern.seeds, pattern.settings)
    sliver = pattern.settings.sliver * float(np.sqrt(len(live) / len(pattern.seeds)))
    coursing = pattern.settings.coursing * (1.0 - share)
    return Seeds(pattern.seeds.point[live], pattern.seeds.weight[live]), replace(
        pattern.settings, sliver=sliver, coursing=coursing
    )


def _base(first: _Turn, share: float) -> tuple[_Turn, tuple[str, ...]]:
    """The drawn wall, less strictly coursed as far as that loses no stone; its match is still that of the drawn one."""
    for part in (1.0, 0.75, 0.5, 0.25, 0.0):
        seeds, freed = _freed(first.wall, share * part)
        for _ in range(NUDGES):
            pattern = draw_from(seeds, freed)
            lost = _lost(pattern, seeds, freed, first.site)
            if lost is None:
                kept = f"courses stay levelled by {freed.coursing:.2g}: with less, stones of the drawing would be lost"
                return replace(first, wall=_relaid(first.wall, pattern), seeds=seeds), () if part == 1.0 else (kept,)
            weight = seeds.weight.copy()
            weight[lost] += NUDGE  # for all of them: for none
            seeds = Seeds(seeds.point, weight)
    raise InputError("negotiate: the wall is not what its seeds draw; draw it anew")


def _relaid(wall: PolygonalWall, pattern: Pattern) -> PolygonalWall:
    """Another pattern on the same surface."""
    return laid_wall(pattern, wall.surface, wall.thickness, wall.masonry)


def _climbed(talk: _Talk, turn: _Turn) -> _Turn | None:
    """The same stones in cells that have moved towards them, measured; None where none can move."""
    cell = np.concatenate([[p.cell for p in turn.match.placements], turn.match.empty]).astype(np.int64)
    cell = cell[turn.site[turn.place[cell]] >= 0]
    if not len(cell):
        return None
    bodies, state = _laid_flat(talk, turn, cell)
    moved, _ = climbed(flat_wall(turn.wall), bodies, state, talk.climb, talk.progress)
    seeds = Seeds(moved.point, moved.weight)
    found = _redrawn(turn, seeds)
    if found is None:
        return None
    wall, seeds = found
    frames = frames_at(wall.surface, wall.pattern.subdivision.centroids()[turn.place[cell]])
    poses = dict(zip(cell.tolist(), zip(*frames.laid(moved.rotation, moved.shift), strict=True), strict=True))
    cells = cells_of(wall.assembly, None, talk.sawn)
    return _Turn(wall, seeds, cells, _polished(talk, turn.match, cells, poses))


def _laid_flat(talk: _Talk, turn: _Turn, cell: Ints) -> tuple[Bodies, Variables]:
    """What lies in some cells, in the flat wall; a cell without a stone is filled with its own body, which stays."""
    placed = {p.cell: p for p in turn.match.placements}
    bodies, poses, points = [], [], []
    for j in cell.tolist():
        if (p := placed.get(j)) is not None:
            stone = talk.stock[p.stone]
            poses.append(p.pose(stone))
            points.append(talk.points[p.stone, :POINTS])
        else:
            block = turn.cells.assembly.blocks[int(turn.cells.block[j])]
            stone = stone_of(block.id, block.vertices, fans(block.faces))
            poses.append((stone.axes.T, stone.centroid))
            points.append(body_points([stone], POINTS)[0])
        bodies.append(stone)
    frames = frames_at(turn.wall.surface, turn.wall.pattern.subdivision.centroids()[turn.place[cell]])
    rotation, shift = (np.stack(part) for part in zip(*poses, strict=True))
    held = np.array([j not in placed for j in cell.tolist()])
    bonds = talk.settings.bonds(turn.cells)
    if bonds is not None:
        bonds = replace(bonds, way=np.einsum("nij,nj->ni", frames.axes, bonds.way[cell]))
    volume = np.array([stone.volume for stone in bodies])
    return (
        Bodies(np.stack(points), volume, turn.site[turn.place[cell]], held, bonds),
        Variables(turn.seeds.point, turn.seeds.weight, *frames.flat(rotation, shift)),
    )


def _redrawn(turn: _Turn, goal: Seeds) -> tuple[PolygonalWall, Seeds] | None:
    """The wall of moved seeds with the same stones; seeds that would lose theirs go only part of the way.

    Those near them wait with them, by halves. None where nothing comes of it.
    """
    old, settings = turn.seeds, turn.wall.pattern.settings
    share = np.ones(len(old))
    for _ in range(TRIES):
        point = old.point + share[:, None] * (goal.point - old.point)
        seeds = Seeds(point, old.weight + share * (goal.weight - old.weight))
        try:
            pattern = draw_from(seeds, settings)
            lost = _lost(pattern, seeds, settings, turn.site)
            if lost is None:
                return _relaid(turn.wall, pattern), seeds
        except InputError:  # too many slivers, or a stone that is turned inside out: where is not said
            lost = np.arange(len(old))
        apart = np.linalg.norm(point[:, None] - point[lost][None], axis=2).min(axis=1, initial=np.inf)
        share[apart <= NEAR] *= 0.5 if len(lost) < len(old) else 0.25
    return None


def _lost(pattern: Pattern, seeds: Seeds, settings: PatternSettings, site: Ints) -> Ints | None:
    """Seeds whose stones are not those of before; None where all are."""
    found = pattern.subdivision.site
    if not pattern.readout.culled and np.array_equal(found, site):
        whole = abs(pattern.readout.coverage - 1.0) <= COVERED
        return None if whole else np.arange(len(seeds))
    if pattern.readout.culled:
        return np.setdiff1d(np.arange(len(seeds)), live_seeds(seeds, settings))
    most = max(len(seeds), int(site.max(initial=-1)) + 1)
    count = [np.bincount(s[s >= 0], minlength=most) for s in (found, site)]
    differ = np.flatnonzero(count[0][: len(seeds)] != count[1][: len(seeds)])
    return differ if len(differ) else np.arange(len(seeds))


def _polished(talk: _Talk, match: Match, cells: Cells, poses: Poses) -> Match:
    """The same pairs in other cells, their poses refined there and their volumes exact.

    `poses` are those of body frames in the wall (m), by cell, where they are not those of the match.
    """
    if not match.placements:
        return match
    start = [poses.get(p.cell) or p.pose(talk.stock[p.stone]) for p in match.placements]
    stone, cell = (np.array([getattr(p, name) for p in match.placements], np.int64) for name in ("stone", "cell"))
    return _tallied(talk, match, cells, _placed(talk, cells, (stone, cell), start))


def _start(cells: Cells, cell: Ints, poses: Sequence[Pose]) -> Pose:
    """Rotations (b, 3, 3) and shifts (b, 3) m from the centres of cells, of poses in the wall."""
    return np.stack([r for r, _ in poses]), np.stack([t for _, t in poses]) - cells.centre[cell]


def _placed(talk: _Talk, cells: Cells, pairs: tuple[Ints, Ints], poses: Sequence[Pose]) -> list[Placement]:
    """Pairs, refined and measured."""
    schedule = replace(POLISH, points=talk.settings.points)
    _, turned, moved = refine(talk.problem(cells), pairs, _start(cells, pairs[1], poses), schedule)
    u, _, vt = np.linalg.svd(turned)  # they went through single precision
    solids, found = Solids(talk.stock, cells), []
    for i, j, *pose in zip(pairs[0].tolist(), pairs[1].tolist(), u @ vt, moved, strict=True):
        shared = min(solids.shared(i, j, *pose), talk.stock[i].volume, float(cells.volume[j]))
        found.append(Placement.of(i, j, talk.stock[i], cells, (pose[0], pose[1]), shared))
    return found


def _tallied(talk: _Talk, match: Match, cells: Cells, placements: Sequence[Placement]) -> Match:
    """The match with these placements in the place of its own."""
    found = Match.of(placements, talk.stock, cells, match.weight, match.settings)
    return replace(found, notes=match.notes, seconds=match.seconds)


def _trimmed(talk: _Talk, turn: _Turn) -> _Turn:
    """One stone exchanged for an unused one so that the total gap is what was asked, as nearly as may be.

    A small wall has few assignments, and none of the cheapest may have the gap that is wanted.
    """
    match, cells, stock = turn.match, turn.cells, talk.stock
    asked = talk.settings.gap
    if asked is None or not len(match.unused):
        return turn
    gain = (match.gap_of_wall - asked) * float(cells.volume.sum())  # m3 that are to be shared in addition
    pairs = [
        (abs(stock[i].volume - stock[p.stone].volume - gain), i, k)
        for k, p in enumerate(match.placements)
        for i in match.unused.tolist()
    ]
    pairs = sorted(pairs)[:SPARE]
    stone = np.repeat([i for _, i, _ in pairs], len(FLIPS))
    place = np.repeat([k for _, _, k in pairs], len(FLIPS))
    at = [match.placements[k] for k in place.tolist()]
    cell, own = np.array([p.cell for p in at]), [p.pose(stock[p.stone]) for p in at]
    poses = [(turn @ np.diag(FLIPS[f % len(FLIPS)]), move) for f, (turn, move) in enumerate(own)]
    share, turned, moved = refine(talk.problem(cells), (stone, cell), _start(cells, cell, poses), CLIMB)
    volume = np.array([stock[i].volume for i in stone.tolist()])
    shared = DENSE * share * volume
    off = np.abs(shared - np.array([p.shared for p in at]) - gain)
    carved = volume - shared - np.array([p.carved for p in at])
    weight = match.weight
    order = np.argsort((1.0 + 2.0 * weight) * off + carved, kind="stable")[:FINALISTS]
    best = turn
    for k in order.tolist():
        pose = [(turned[k], moved[k] + cells.centre[cell[k]])]
        new = _placed(talk, cells, (stone[k : k + 1], cell[k : k + 1]), pose)[0]
        exchanged = [new if p.cell == new.cell else p for p in match.placements]
        trial = replace(turn, match=_tallied(talk, match, cells, exchanged))
        best = min(best, trial, key=lambda one: (talk.missed(one), one.cost(weight)))
    return best


def _standing(talk: _Talk, first: _Turn, best: _Turn) -> tuple[_Turn, tuple[str, ...]]:
    """The best turn, if it stands or the drawn wall did not; else one on the way back to the drawing, and why."""
    if best is first or verdict(best.wall.assembly) == STABLE:
        return best, ()
    before = verdict(first.wall.assembly)
    if before != STABLE:
        return best, (f"neither the drawn wall ({before}) nor the negotiated one can be said to stand",)
    why = "the negotiated wall could not be shown to stand as the drawn one does"
    for share in BACK:
        talk.progress(f"going back to {share:.0%} of the way")
        seeds = Seeds(
            first.seeds.point + share * (best.seeds.point - first.seeds.point),
            first.seeds.weight + share * (best.seeds.weight - first.seeds.weight),
        )
        found = _redrawn(best, seeds)
        if found is None or verdict(found[0].assembly) != STABLE:
            continue
        cells = cells_of(found[0].assembly, None, talk.sawn)
        match = talk.matched(cells, best.match.weight, _polished(talk, best.match, cells, {}))
        return _Turn(*found, cells, match), (f"{why}: the seeds went back to {share:.0%} of their way",)
    return first, (f"{why}, nor any wall on the way: it is left as drawn",)
