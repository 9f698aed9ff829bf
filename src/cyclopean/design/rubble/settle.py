"""Rubble: a wall of stones as they were found, laid dry, on a running height map.

Nothing may reach above a ceiling, which rises by a little when nothing more fits below it; so courses fill from end to
end. Below it, all places of the largest stones left are looked at (`places`), the best more closely (`choosing`), and
of these the first is taken at which the stone, seated on the exact meshes (`seating`),

- shares no more than `OVERLAP` of its volume with any other;
- has its centre of mass inside the hull of what bears it, by a margin (Heyman 1966);
- keeps the wall in equilibrium, with less friction than stone has on stone, and with gravity leaning whichever way
  (`standing`).

So the wall stands when it is done, and at every stage before. Where none of the largest goes, all that are left are
tried. Nothing is drawn at random.

How many of a few stones come to lie hangs on chance: on which of them meet. So of few, several walls are laid, each
under another ceiling, and the best is kept: that with most stones, and of these the densest.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from cyclopean.assembly import Assembly, Block
from cyclopean.assembly.patches import gathered
from cyclopean.design.options import at_least
from cyclopean.design.rubble.as_built import NOTHING, AsBuilt
from cyclopean.design.rubble.choosing import Tipped, chosen
from cyclopean.design.rubble.dressing import imposition
from cyclopean.design.rubble.masons_rules import Faces, masons_rules
from cyclopean.design.rubble.places import FULL, Place, Places
from cyclopean.design.rubble.sharing import Share, shared
from cyclopean.design.rubble.site import Progress, Site
from cyclopean.design.rubble.trials import Trial, put_down, tried
from cyclopean.design.rubble.wall import FEW, OVERLAP, Laid, Measures, RubbleWall, SettleSettings, filled_in
from cyclopean.design.stones.inventory import Inventory
from cyclopean.errors import InputError

__all__ = ["OVERLAP", "Laid", "RubbleWall", "SettleSettings", "settle"]

FIRST = 1.9, 1.6, 1.75, 2.05, 1.45, 2.2  # of the unit: the ceiling at the start, one for each way to lay a wall
HEAD = 1.3  # of the unit: the ceiling is no further above the skyline, so that the top comes out level
HEAD_OF_FEW = 3.5  # few stones make no level top: each is laid where it stands
LIFT = 0.23  # by which it rises
COURSE = 4  # lifts
PART, SHARED, WHOLE = 10.0, 2.5, 1.5  # of the unit: parts of a long wall, and what they share; a short one is whole
MOST = 128  # stones that are tried where none of the largest goes
LOOKED = 150  # places that are looked at closely at a time
STEADY = 2.5  # weight of `centre` once none of the largest goes: of the steadiest fifth of places most stand
TAKEN_OUT = 0.15, 0.3  # share of the stones that is taken out, those laid last, to lay the rest of the wall anew
MANY = 1 / 3  # of the stones are left: then that is done; of few, it always is
PATIENCE, LAST = 60, 200  # trials in vain before the ceiling rises, and under the last one


def _silent(stage: str) -> None:
    """Nothing is told."""


def settle(
    inventory: Inventory,
    settings: SettleSettings | None = None,
    progress: Progress | None = None,
    executor: Executor | None = None,
    standing: Assembly | None = None,
    advice: int = 0,
) -> RubbleWall:
    """Lay a wall of found stones.

    Parameters
    ----------
    inventory : Inventory
        At least one stone.
    settings : SettleSettings, optional
        How.
    progress : callable, optional
        Told what goes on.
    executor : concurrent.futures.Executor, optional
        Lays every other one of several walls, or helps to lay a single one. The wall is the same without it.
    standing : Assembly, optional
        A wall that stands already, in the frame of this one, its ground fixed: it is gone on with. Stones that are in
        it by their ids count as used.
    advice : int
        Tell so many stones that could be laid next, the best first, and lay the first of them only.

    Returns
    -------
    RubbleWall

    Raises
    ------
    InputError
        No stones, none that fits into the wall, a map of too many cells, a standing wall that does not stand, or less
        than no stones to tell.
    """
    began = perf_counter()
    at_least("next", advice, 0)
    if not len(inventory):
        raise InputError(f"{inventory.source}: there are no stones to lay")
    before = AsBuilt.of(standing) if standing is not None else NOTHING
    at_hand = before.at_hand(inventory.stones)
    if not at_hand:
        raise InputError(f"{inventory.source}: all of its stones are in the wall that stands; there are none to lay")
    full = filled_in(at_hand, settings or SettleSettings(), before.volumes)
    ways = 1 if advice or before.blocks else full.ways or 1
    elsewhere = {} if executor is None else {k: executor.submit(_laid, inventory, full, k) for k in range(1, ways, 2)}
    say = progress or _silent
    alone = ways > 1 or advice or before.blocks
    with shared(None if alone else executor, _lay, inventory, full) as share:
        here = {k: _laid(inventory, full, k, say, before, advice, share) for k in range(ways) if k not in elsewhere}
    walls = [elsewhere[k].result() if k in elsewhere else here[k] for k in range(ways)]
    best = min((wall for wall in walls if wall is not None), key=_rank, default=None)
    if best is None:
        raise InputError(
            f"{inventory.source}: none of {len(inventory)} stones fits into a wall {full.length:.3g} m long and"
            f" {full.thickness:.3g} m thick; make it larger (`length`, `thickness`, `height`)"
        )
    return replace(best, measures=replace(best.measures, seconds=perf_counter() - began))


def _laid(
    inventory: Inventory,
    settings: SettleSettings,
    way: int,
    say: Progress = _silent,
    before: AsBuilt = NOTHING,
    advice: int = 0,
    share: Share | None = None,
) -> RubbleWall | None:
    """One wall; None where nothing can be laid."""
    site = Site(inventory.stones, settings, say, before)
    site.first = FIRST[way]
    following = _advised(site, advice) if advice else ()
    if not advice:
        site = _laid_anew(_built(site, share or Share()), share or Share())
    return _finished(site, following) if site.laid or before.blocks else None


def _lay(inventory: Inventory, settings: SettleSettings, share: Share) -> None:
    """Lay the same wall as another process does, to help it."""
    site = Site(inventory.stones, settings, _silent)
    site.first = FIRST[0]
    _laid_anew(_built(site, share), share)


def _advised(site: Site, count: int) -> tuple[Laid, ...]:
    """The best stones to be laid next, of which the first is laid."""
    parts, lift, found = _parts(site, Share()), COURSE * site.course, list[Trial]()
    site.begin()
    while len(found) < count and _ceiling(site, lift) <= _highest(site) + LIFT * site.unit:
        course = lift // COURSE
        told = {trial.stones[-1].stone for trial in found}
        work = _body(site, _ceiling(site, lift), course, PATIENCE)
        work = replace(work, pools=tuple([k for k in pool if k not in told] for pool in work.pools))
        trials = (_next(site, places, work) for places in parts if any(work.pools))
        trial = next((one for one in trials if one is not None), None)
        if trial is None:
            lift += 1
            _all(parts, Places.forget)
        else:
            found.append(trial)
    laid = tuple(
        Laid(one.stone, one.rotation, one.shift, lift // COURSE, "stone", one.margin, True, one.fresh.bearing)
        for trial in found
        for one in trial.stones[-1:]
    )
    if found:
        site.take(found[0], laid[0].course, "stone")
    return laid


def _rank(wall: RubbleWall) -> tuple[int, float]:
    """Less is better."""
    return -sum(laid.stable for laid in wall.laid), wall.measures.void


def _laid_anew(site: Site, share: Share) -> Site:
    """The wall; where many stones are left, or some of few, one of more: what was laid last gives way to others."""
    for part in TAKEN_OUT:
        few = len(site.left) + len(site.laid) <= FEW
        many = len(site.left) > (0.0 if few else MANY * len(site.stones))
        if many and site.kept.keys() <= {"stone", "hearting"} and not site.settings.all:
            again = _built(site.without(math.ceil(part * len(site.taken))), share)
            site = max(site, again, key=lambda wall: len(wall.laid))  # the first of equals
    return site


def _built(site: Site, share: Share) -> Site:
    """Lay stones under a rising ceiling until stones or room are used up; then the copes."""
    parts = _parts(site, share)
    lift, begun, lintels = COURSE * site.course, -1, list[int]()
    while site.kept["stone"]:
        course = lift // COURSE
        if course > begun:
            begun = course
            site.begin()
            _all(parts, Places.renewed)
        ceiling = _ceiling(site, lift)
        _tie(site, parts, ceiling, course)
        _all(parts, Places.forget)
        _fill(site, parts, _body(site, ceiling, course, PATIENCE))
        if site.bridged():
            parts, lintels = _parts(site, share), site.kept.pop("lintel")
        lintels = [k for k in lintels if k in site.left]  # one that finds no place is tried again a lift higher
        _fill(site, parts, Round(ceiling + LIFT * site.unit, course, "lintel", (lintels,), site.bridges))
        if _ceiling(site, lift + 1) > _highest(site):
            laid = len(site.laid)
            _fill(site, parts, _body(site, ceiling, course, LAST))
            if len(site.laid) == laid:
                break
        else:
            lift += 1
    _crowned(site, parts, lift // COURSE + 1)
    return site


def _ceiling(site: Site, lift: int) -> float:
    """Height (m) that nothing may be above: it rises lift by lift, or course by course."""
    risen = COURSE * (lift // COURSE) if site.settings.coursed else lift
    return min((site.first + LIFT * risen) * site.unit, site.shape.height)


def _parts(site: Site, share: Share) -> list[Places]:
    """The wall in parts that overlap by a stone: of a long one, one after the other is looked at."""
    n, long, shared = len(site.room), round(PART * site.unit / site.cell), round(SHARED * site.unit / site.cell)
    starts = range(0, max(n - long, 0) + 1, long - shared) if n > WHOLE * long else (0,)
    ends = [start + long for start in starts[:-1]] + [n]
    return [
        Places(start, site.room[start:end], site.cell, site.unit, site.settings.scores, share)
        for start, end in zip(starts, ends, strict=True)
    ]


def _all(parts: Sequence[Places], do: Callable[[Places], None]) -> None:
    for places in parts:
        do(places)


def _highest(site: Site) -> float:
    """The ceiling (m) is no higher: so far above the mean of the skyline, and not above the height asked for."""
    skyline = np.where(site.room > 0.0, site.map, 0.0).max(axis=1)
    head = HEAD_OF_FEW if len(site.stones) <= FEW else HEAD
    return min(site.shape.height - LIFT * site.unit / 2.0, float(skyline.mean()) + head * site.unit)


def _body(site: Site, ceiling: float, course: int, patience: int) -> "Round":
    """The stones of the body: the largest left, then all; of very many, some of every size."""
    stones = site.kept["stone"]
    window = stones[: max(site.settings.look_ahead, 1)]
    others = site.some_of(stones + site.kept.get("hearting", []), MOST)
    return Round(ceiling, course, "stone", (window, others), patience=patience)


def _tie(site: Site, parts: Sequence[Places], ceiling: float, course: int) -> None:
    """Lay a row of through-stones, where its height is reached."""
    apart = site.through
    if apart is None or not site.kept.get("through-stone"):
        return
    planned = site.shape.planned
    rows = [planned / 2.0] if apart > planned else np.arange(apart / 2.0, planned, apart).tolist()
    if site.ties < len(rows) and ceiling >= rows[site.ties] + site.first * site.unit / 2.0:
        site.ties, site.row = site.ties + 1, []
        _fill(site, parts, Round(ceiling, course, "through-stone", (site.kept["through-stone"],), site.ties_here))
        if site.ties == len(rows):
            site.kept["stone"] = site.by_size(site.kept["stone"] + site.kept.pop("through-stone"))


def _crowned(site: Site, parts: Sequence[Places], course: int) -> None:
    """Lay the copes; and what does not stand, where all are to be laid."""
    if site.kept.get("cope"):
        _all(parts, Places.renewed)
        ceiling = min(site.shape.height, float(site.map[site.room > 0.0].max()) + site.first * site.unit)
        _fill(site, parts, Round(ceiling, course, "cope", (site.kept["cope"],), patience=LAST))
    if site.settings.all:
        _all(parts, Places.renewed)
        for stone in tuple(site.left):
            found = [(places, places.best(site.map, [site.bedded(stone)], FULL / 2.0)) for places in parts]
            good = [tipped for places, some in found for tipped in _looked(site, places, some)]
            if good:
                best = min(good, key=lambda tipped: tipped.cost)
                box = site.leave(put_down(site, best), course)
                _all(parts, lambda places, box=box: places.changed(box))  # type: ignore[misc]


def _looked(site: Site, places: Places, some: Sequence[Place], steady: bool = False) -> list[Tipped]:
    """Some places of a part of the wall, looked at closely, those that are `steady` first where that is asked for.

    Places where no stone lies count as tried in vain.
    """
    here, scores = places.part, site.looks.scores
    if steady:
        scores = replace(scores, centre=max(scores.centre, STEADY))
    good = chosen(site.map[here], site.label[here], some, replace(site.looks, first=places.first, scores=scores))
    kept = {id(tipped.place) for tipped in good}
    for place in some:
        if id(place) not in kept:
            places.fail(place)
    return good


@dataclass(frozen=True, slots=True)
class Round:
    """Stones that are to be laid, one after the other, until none goes any more."""

    ceiling: float  # m
    course: int
    role: str
    pools: tuple[Sequence[int], ...]  # stones that are tried: the first of them first
    accepts: Callable[[Place], bool] | None = None
    patience: int = PATIENCE
    binders: bool = False  # they lie with their length into the wall


def _fill(site: Site, parts: Sequence[Places], work: Round) -> None:
    """Lay stones, part after part, until none goes below the ceiling."""
    for places in parts:
        while any(work.pools):
            trial = _next(site, places, replace(work, binders=True)) if site.wants_binder() else None
            trial = trial or _next(site, places, work)
            if trial is None:
                break
            boxes = site.take(trial, work.course, work.role)
            places.share.laid(trial.stones[-1].shift.tobytes())
            for other in parts:
                for one, box in zip(trial.stones, boxes, strict=True):
                    other.used(one.stone)
                    other.changed(box)
            if work.role == "stone":
                work = _body(site, work.ceiling, work.course, work.patience)
            else:
                work = replace(work, pools=tuple([k for k in pool if k in site.left] for pool in work.pools))


def _next(site: Site, places: Places, work: Round) -> Trial | None:
    """The stone that is laid next; None where none goes below the ceiling."""
    vain, rounds = 0, 0
    while vain < work.patience:
        pool = work.pools[min(rounds, len(work.pools) - 1)]
        lying = [site.binding(k) if work.binders else site.bedded(k) for k in pool]
        found = places.best(site.map, lying, work.ceiling, work.accepts)
        if not found and rounds >= len(work.pools) - 1:
            return None
        rounds += 1
        for start in range(0, len(found), LOOKED):
            good = _looked(site, places, found[start : start + LOOKED], rounds > 1)
            told = places.share.until(len(good), lambda k, good=good: tried(site, good[k], work.ceiling))  # type: ignore[misc]
            for tipped, trial in zip(good, told, strict=False):
                if not isinstance(trial, str):
                    return trial
                site.why.setdefault(tipped.place.lying.stone, Counter())[trial] += 1
                places.fail(tipped.place)
                vain += 1
            if good:
                break
    return None


# What came out


def _finished(site: Site, following: tuple[Laid, ...]) -> RubbleWall:
    """The wall as a model with contacts, and its measures but for the time that it took."""
    contacts, patches = gathered(site.structure.meetings({k: i + 1 for i, k in enumerate(site.stood)}))
    whole = Assembly(_blocks(site), contacts, (), "rubble wall")
    left_over = tuple((k, site.reason(k)) for k in sorted(site.left))
    return RubbleWall(tuple(site.laid), left_over, site.settings, _measures(site), whole, patches, following)


def _blocks(site: Site) -> tuple[Block, ...]:
    """The ground, then the stones."""
    blocks: list[Block] = [site.ground, *site.before.blocks]
    for laid, mesh in zip(site.laid, list(site.stood.values())[len(site.before.blocks) :], strict=True):
        stone = site.stones[laid.stone]
        faces = tuple(map(tuple, mesh.triangles.tolist()))
        blocks.append(Block(stone.id, mesh.vertices, faces, stone.density, False, f"course-{laid.course}"))
    return tuple(blocks)


def _measures(site: Site) -> Measures:
    shape = site.shape
    volume = sum(body.volume for body in site.stood.values())
    removed = sum(site.stones[laid.stone].volume for laid in site.laid) + sum(site.before.volumes) - volume
    top = np.where((site.room > 0.0) & (site.label >= 0), site.map, 0.0)
    skyline = top.max(axis=1)
    masons = None
    if not shape.corner:
        back = shape.batter if shape.faces == 2 else 0.0
        masons = masons_rules(tuple(site.stood.values()), Faces(shape.length, shape.thickness, shape.batter, back))
    plan = float(np.count_nonzero(site.room > 0.0)) * site.cell**2 / shape.length  # m, in the mean through the wall
    return Measures(
        void=masons.void if masons else 1.0 - volume / (float(skyline.sum()) * site.cell * plan),
        void_tops=masons.void_tops if masons else 1.0 - volume / (float(top.sum()) * site.cell**2),
        face=masons.face if masons else np.nan,
        top=masons.top if masons else float(skyline.std()),
        courses=1 + max((laid.course for laid in site.laid), default=site.course - 1),
        height=float(site.boxes[:, 1, 2].max()),
        level=float(skyline.mean()),
        stone=site.unit,
        length=shape.length,
        covered=float(np.count_nonzero(skyline > 0.0) / len(skyline)) * shape.length,
        thickness=shape.thickness,
        overlap=site.overlap,
        imposition=imposition(max(removed, 0.0), volume + removed) if site.settings.dress else 0.0,
        seconds=0.0,
        masons=masons,
    )
