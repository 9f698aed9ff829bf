"""Part of an assembly, or all of it in other places: what the model says of it goes along."""

from collections.abc import Callable
from dataclasses import replace

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly.blocks import Action, Assembly, Block
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.loads import SELF, SurfaceLoad

__all__ = ["part"]


def part(
    whole: Assembly,
    blocks: tuple[Block, ...],
    contacts: Contacts | None,
    place: Ints,
    moved: Callable[[int, Floats], Floats] = lambda _, points: points,
    name: str = "",
) -> Assembly:
    """An assembly of some blocks of another, with the loads, frictions, combinations and settlements that concern them.

    Parameters
    ----------
    whole : Assembly
        n blocks.
    blocks : tuple of Block
        Those of the part, in its order; their faces are those of the whole, or no surface load names one by number.
    contacts : Contacts, optional
        By numbers in the part.
    place : (n,) int
        Number in the part of each block of the whole, -1 = it is not there.
    moved : callable
        Where (k, 3) points that go with a block of the whole are now.
    name : str
        By default that of the whole.
    """
    loads = tuple(
        replace(load, block=int(place[load.block]), point=moved(load.block, load.point[None])[0])
        for load in whole.loads
        if place[load.block] >= 0
    )
    groups = {block.group for block in blocks}
    actions = tuple(_moved(load, place, moved) for load in whole.actions if _stays(load, place, groups))
    cases = {SELF, *(load.case for load in (*loads, *actions))}  # those of loads that are gone are gone too
    materials = {block.material for block in blocks}
    settlements = tuple(replace(one, block=int(place[one.block])) for one in whole.settlements if place[one.block] >= 0)
    return Assembly(
        blocks,
        contacts,
        loads,
        name or whole.name,
        actions,
        tuple(replace(one, factors=tuple(row for row in one.factors if row[0] in cases)) for one in whole.combinations),
        tuple(pair for pair in whole.friction if {pair.a, pair.b} <= materials),
        settlements,
    )


def _stays(load: Action, place: Ints, groups: set[str | None]) -> bool:
    if not isinstance(load, SurfaceLoad) and load.group is not None:
        return load.group in groups
    return load.block is None or bool(place[load.block] >= 0)


def _moved(load: Action, place: Ints, moved: Callable[[int, Floats], Floats]) -> Action:
    if load.block is None:
        return load
    if isinstance(load, SurfaceLoad) and load.polygon is not None:
        return replace(load, block=int(place[load.block]), polygon=moved(load.block, load.polygon))
    return replace(load, block=int(place[load.block]))
