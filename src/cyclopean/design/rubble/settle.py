"""Rubble: a wall of stones as they were found, laid dry, course after course, on a running height map.

The map holds the top of the wall over a grid. A stone is tried in its bedded orientations at the places that are open
to it (`places`), dropped onto the map, and, once a place is chosen, adjusted on the exact meshes until it sits
(`seating`). It is laid there only if

- it shares no more than `OVERLAP` of its volume with any other, which is looked up with exact solids;
- its centre of mass stands inside the hull of what bears it, by a margin (Heyman 1966);
- the wall with it is in equilibrium, with less friction than stone has on stone, and with gravity leaning a little
  whichever way (`standing`).

So the wall stands when it is done, and at every stage before. Where none of some stones at some places does all that, a
gap is left; a stone that is tried in vain too often is put aside, and tried again in the next course and at the end.

A course is laid from both ends towards its middle: left, right, left ... A long wall is laid from two fronts, one from
either end, each with half of the stones (`parallel`). Where a wall has two wythes, the front one of a course is laid
first, then the rear one. Which stone comes next: of all that are left, the largest; `look_ahead` of them compete for
every place. With a look-ahead of 0, stones are laid in the order of the inventory, the next one always at the first
place where it stands. Nothing is drawn at random.

How many of a few stones come to lie hangs on chance: on which of them meet. So of few, several walls are laid, each
with gaps of another width where nothing goes, and every other one with a smaller look-ahead. The best is kept: that
with most stones, and of these the densest.
"""

from concurrent.futures import Executor
from dataclasses import replace
from time import perf_counter

import numpy as np

from cyclopean.assembly import Assembly, Block
from cyclopean.assembly.patches import gathered
from cyclopean.design.rubble.coursing import CLOSE, Course, inwards, level_of
from cyclopean.design.rubble.hearting import Wedge
from cyclopean.design.rubble.parallel import Fronts
from cyclopean.design.rubble.places import Slot, Weights, ranked
from cyclopean.design.rubble.site import Progress, Site, free_name
from cyclopean.design.rubble.wall import OVERLAP, Laid, Measures, RubbleWall, SettleSettings, filled_in
from cyclopean.design.stones.inventory import Inventory
from cyclopean.errors import InputError

__all__ = ["OVERLAP", "Laid", "RubbleWall", "SettleSettings", "settle"]

HEART = 2  # the wythe of small stones in hollows
HEARTING = Weights(bond=0.0, face=0.0)


def _silent(stage: str) -> None:
    """Nothing is told."""


def settle(
    inventory: Inventory,
    settings: SettleSettings | None = None,
    progress: Progress | None = None,
    executor: Executor | None = None,
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
        Has one process do half of a long wall, or lay every other one of several. The wall is the same without it.

    Returns
    -------
    RubbleWall

    Raises
    ------
    InputError
        There are no stones, none of them fits into the wall, or the map would have too many cells.
    """
    began = perf_counter()
    say = progress or _silent
    if not len(inventory):
        raise InputError(f"{inventory.source}: there are no stones to lay")
    full = filled_in(inventory.stones, settings or SettleSettings())
    ways = full.ways or 1
    elsewhere = {} if executor is None else {k: executor.submit(_laid, inventory, full, k) for k in range(1, ways, 2)}
    here = {k: _laid(inventory, full, k, say, executor) for k in range(ways) if k not in elsewhere}
    walls = [elsewhere[k].result() if k in elsewhere else here[k] for k in range(ways)]
    best = min((wall for wall in walls if wall is not None), key=_rank, default=None)
    if best is None:
        raise InputError(
            f"{inventory.source}: none of {len(inventory)} stones fits into a wall {full.length:.3g} m long and"
            f" {full.thickness:.3g} m thick; make it larger (`length`, `thickness`, `height`)"
        )
    return replace(best, measures=replace(best.measures, seconds=perf_counter() - began))


def _laid(
    inventory: Inventory, settings: SettleSettings, way: int, say: Progress = _silent, executor: Executor | None = None
) -> RubbleWall | None:
    """One wall; None where nothing can be laid."""
    site = Site(inventory.stones, settings, say, way)
    _build(site, executor if settings.ways == 1 else None)  # of several walls, the other process lays some
    return _finished(site) if site.laid else None


def _rank(wall: RubbleWall) -> tuple[int, float]:
    """Less is better."""
    return -len(wall.laid), wall.measures.void


def _build(site: Site, executor: Executor | None = None) -> None:
    """Lay courses until stones or room are used up."""
    fronts = Fronts(site, executor)
    number = 0
    while site.left:
        count = len(site.laid)
        site.vain.clear()
        for wythe in range(site.settings.wythes):
            if site.left:
                course = Course(number, wythe, level_of(site, wythe))
                cells, joints = fronts.begun(course)
                site.joints[wythe] = joints + inwards(site, course, cells, (-1, 1))[1]
        _heart(site, number)
        if len(site.laid) > count:
            number += 1
            site.left, site.aside = site.aside + site.left, []
        elif site.settings.look_ahead == 0:  # the one that comes next fits nowhere, and others may
            site.aside, site.left = site.aside + site.left[:1], site.left[1:]
        else:
            break
    site.left, site.aside = site.aside + site.left, []
    if site.left and site.settings.look_ahead:
        site.vain.clear()
        fronts.again(Course(site.laid[-1].course if site.laid else 0, 0, level_of(site, 0)))


def _heart(site: Site, course: int) -> None:
    """Drop small stones into the hollows of what was laid, as long as they sit there."""
    n, d = site.map.shape
    level = float(site.map.max(axis=1).mean())
    slot = Slot(np.array([0, n]), np.array([0, d]), level, level)
    fruitless = 0
    while fruitless < len(site.small):
        number = site.small.pop(0)
        places = ranked(site.map, site.bedded(number, 0), slot, HEARTING, site.cell, CLOSE)
        good = site.first(places[: site.settings.tries], [])
        if good is None:
            site.small.append(number)
            fruitless += 1
        else:
            site.take(good, course, HEART)
            fruitless = 0


# What came out


def _finished(site: Site) -> RubbleWall:
    """The wall as a model with contacts, and its measures but for the time that it took."""
    wedge = np.array([isinstance(what, Wedge) for what in site.kind.values()])
    block = np.where(wedge, len(site.laid) + np.cumsum(wedge), np.cumsum(~wedge))
    contacts, patches = gathered(site.structure.meetings(dict(zip(site.kind, block.tolist(), strict=True))))
    left_over = np.array(sorted(site.left + site.aside + site.small), np.int64)
    whole = Assembly(_blocks(site), contacts, (), "rubble wall")
    return RubbleWall(
        tuple(site.laid), left_over, site.settings, _measures(site), whole, patches, int(np.count_nonzero(wedge))
    )


def _blocks(site: Site) -> tuple[Block, ...]:
    """The ground, the stones, then wedges."""
    names = {s.id for s in site.stones} | {site.ground.id}
    stones: list[Block] = [site.ground]
    wedges: list[Block] = []
    for number, what in site.kind.items():
        mesh = site.stood[number]
        faces = tuple(map(tuple, mesh.triangles.tolist()))
        if isinstance(what, Wedge):
            name = free_name(f"wedge-{len(wedges) + 1}", names)
            wedges.append(Block(name, mesh.vertices, faces, None, False, "chinking"))
        else:
            stone = site.stones[what.stone]
            stones.append(Block(stone.id, mesh.vertices, faces, stone.density, False, f"course-{what.course}"))
    return (*stones, *wedges)


def _measures(site: Site) -> Measures:
    volume = sum(site.stones[laid.stone].volume for laid in site.laid)
    skyline = float(site.map.max(axis=1).sum()) * site.cell * site.map.shape[1] * site.cell
    return Measures(
        void=1.0 - volume / skyline,
        hollow=1.0 - volume / (float(site.map.sum()) * site.cell**2),
        stable=sum(laid.stable for laid in site.laid) / len(site.stones),
        courses=1 + max(laid.course for laid in site.laid),
        height=float(site.boxes[:, 1, 2].max()),
        length=site.size[0],
        thickness=site.size[1],
        overlap=site.overlap,
        seconds=0.0,
    )
