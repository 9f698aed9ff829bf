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

A course is laid from both ends towards its middle: left, right, left ... A long one is begun by two gangs, one from
either end, each with half of the stones. Where a wall has two wythes, the front one of a course is laid first, then the
rear one. Which stone comes next: of all that are left, the largest; `look_ahead` of
them compete for every place. With a look-ahead of 0, stones are laid in the order of the inventory, the next one always
at the first place where it stands. Nothing is drawn at random.

How many of a few stones come to lie hangs on chance: on which of them meet. So of few, several walls are laid, each
with gaps of another width where nothing goes, and every other one with a smaller look-ahead. The best is kept: that
with most stones, and of these the densest.
"""

from concurrent.futures import Executor
from dataclasses import replace
from time import perf_counter

from cyclopean.design.rubble.building import build
from cyclopean.design.rubble.finishing import finished, largest_overlap
from cyclopean.design.rubble.site import Progress, Site
from cyclopean.design.rubble.wall import OVERLAP, Laid, RubbleWall, SettleSettings, filled_in
from cyclopean.design.stones.inventory import Inventory
from cyclopean.errors import InputError

__all__ = ["OVERLAP", "Laid", "RubbleWall", "SettleSettings", "largest_overlap", "settle"]


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
    build(site, executor if settings.ways == 1 else None)  # of several walls, the other process lays some
    return finished(site, inventory) if site.laid else None


def _rank(wall: RubbleWall) -> tuple[int, float]:
    """Less is better."""
    return -len(wall.laid), wall.measures.void
