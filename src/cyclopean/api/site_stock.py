"""What each kind of wall tells of its stones, for the site set."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cyclopean.api.stones import StoneCarving
    from cyclopean.design.ashlar.wall import AshlarWall
    from cyclopean.design.construction.sequence import BuildSequence
    from cyclopean.design.rubble.wall import RubbleWall
    from cyclopean.design.stones.stone import Stone
    from cyclopean.view.site.site_set import LeftOver, Stock


def laid_order(thing: Any) -> tuple[str, ...] | None:
    """Ids in the order in which a wall was laid, where that is why it stands; None where it is to be found."""
    from cyclopean.design.rubble.wall import RubbleWall

    if not isinstance(thing, RubbleWall):
        return None
    return tuple(block.id for block in thing.assembly.blocks if not block.fixed)


def stock_of(sequence: "BuildSequence", thing: Any, stones: "Sequence[Stone]" = ()) -> "Stock":
    """Of what the stones of a structure are made, and what is left over.

    Parameters
    ----------
    sequence : BuildSequence
        The structure and how it is built.
    thing : StoneCarving, AshlarWall, RubbleWall or any other
        What it came from; the last two and any other model tell less.
    stones : sequence of Stone
        Those that a rubble wall was laid of.
    """
    from cyclopean.api.stones import StoneCarving
    from cyclopean.design.ashlar.wall import AshlarWall
    from cyclopean.design.rubble.wall import RubbleWall
    from cyclopean.view.site.site_set import Stock

    place = {one.id: k for k, one in enumerate(sequence.assembly.blocks)}
    if isinstance(thing, StoneCarving):
        return _carved(place, thing)
    if isinstance(thing, AshlarWall):
        return Stock(source=dict(_slabs(place, thing)), left=tuple(_in_store(thing)))
    if isinstance(thing, RubbleWall) and stones:
        return Stock(left=tuple(_put_aside(thing, stones)))
    return Stock()


def _carved(place: dict[str, int], carving: "StoneCarving") -> "Stock":
    """Found stones with their cuts, and those that no cell took."""
    from cyclopean.view.site.cuts import cut_stone
    from cyclopean.view.site.site_set import LeftOver, Stock

    stones = {stone.id: stone for stone in carving.stones}
    laid = [c for c in carving.carved if c.cell in place]
    used = {c.stone for c in laid}
    return Stock(
        {place[c.cell]: cut_stone(c, stones[c.stone]) for c in laid if c.cuts},
        {place[c.cell]: f"Cut from found stone {c.stone}." for c in laid}
        | {place[name]: "Sawn new, as drawn." for name in carving.built.sawn if name in place},
        tuple(LeftOver(stone.id, stone.volume, "not used") for stone in carving.stones if stone.id not in used),
    )


def _slabs(place: dict[str, int], wall: "AshlarWall") -> "Iterator[tuple[int, str]]":
    """Which slab each stone is sawn from."""
    for block, stone in zip(wall.assembly.blocks[1:], wall.laid, strict=True):
        slab, cuts = wall.stock.slabs[stone.sawn.slab].id, stone.sawn.cuts
        yield place[block.id], f"Sawn from {slab}, {cuts} cut{'s' * (cuts > 1)}." if cuts else f"Is {slab}, uncut."


def _in_store(wall: "AshlarWall") -> "Iterator[LeftOver]":
    from cyclopean.view.site.site_set import LeftOver

    stock = wall.stock
    pieces = zip(stock.slab.tolist(), stock.whole().tolist(), stock.sizes().prod(axis=1).tolist(), strict=True)
    return (LeftOver(stock.slabs[k].id, volume, "not used" if whole else "offcuts") for k, whole, volume in pieces)


def _put_aside(wall: "RubbleWall", stones: "Sequence[Stone]") -> "Iterator[LeftOver]":
    from cyclopean.view.site.site_set import LeftOver

    return (LeftOver(stones[k].id, stones[k].volume, f"left: {reason}") for k, reason in wall.left_over)
