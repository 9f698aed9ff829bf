"""From found stones to a wall: `match` them to its cells, `carve` them back, or `settle` them as they are."""

import os
import warnings
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

from cyclopean.api.inputs import Model, StoneReading, Stones, assembly_of, inventory_of, silent
from cyclopean.api.keywords import MatchKeywords, SettleKeywords, TradeoffKeywords, given_to
from cyclopean.errors import InputError
from cyclopean.options import check_options, option
from cyclopean.representation import one_line
from cyclopean.texts import first_few

if TYPE_CHECKING:
    from cyclopean.arrays import Bools, Ints
    from cyclopean.assembly import Assembly
    from cyclopean.design.carving.carve import Carved, Total
    from cyclopean.design.carving.carved_wall import CarvedWall
    from cyclopean.design.matching.cells import Cells
    from cyclopean.design.matching.match import Match, MatchSettings
    from cyclopean.design.matching.negotiation import Round
    from cyclopean.design.matching.tradeoff import Tradeoff, TradeoffSettings
    from cyclopean.design.rubble.settle import RubbleWall, SettleSettings
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.design.stones.stone import Stone
    from cyclopean.design.walls.polygonal import PolygonalWall

LISTED = 5  # cells named one by one


@dataclass(frozen=True, slots=True, eq=False)
class StoneMatch:
    """Which stone goes where, with the stones and the cells that this is of."""

    __repr__ = one_line

    match: "Match"
    stones: "tuple[Stone, ...]"
    cells: "Cells"
    drawn: "PolygonalWall | None" = None  # the wall as it was drawn, or drawn anew where its cells were moved
    rounds: "tuple[Round, ...]" = ()  # of a negotiation
    supports: str = ""  # which blocks are held, where that was said
    warnings: tuple[str, ...] = ()
    interlock: tuple[float, float] | None = None  # J before and after a negotiation
    misfits: tuple[str, ...] = ()  # why these stones cannot make this wall well; also among the warnings

    @property
    def assembly(self) -> "Assembly":
        """The wall whose free blocks are the cells."""
        return self.cells.assembly

    @property
    def imposition(self) -> float:
        """Lambda: share of the placed stones' volume that is carved off."""
        return self.match.imposition

    @property
    def gap(self) -> float:
        """Share of the volume of the cells that have a stone which stays void."""
        return self.match.gap


@dataclass(frozen=True, slots=True, eq=False)
class StoneTradeoff:
    """Walls between least carving and best interlock, and the stones that they were matched from."""

    __repr__ = one_line

    tradeoff: "Tradeoff"
    stones: "tuple[Stone, ...]"
    warnings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.tradeoff)

    def __getitem__(self, k: int) -> StoneMatch:
        """One of the walls with its stones, as `match` gives it: to be carved, saved, shown."""
        one = self.tradeoff.alternatives[k]
        return StoneMatch(one.match, self.stones, one.cells, one.wall, warnings=one.match.notes)

    @property
    def non_dominated(self) -> tuple[int, ...]:
        """Those that no other beats, the one of least carving first."""
        return self.tradeoff.non_dominated


@dataclass(frozen=True, slots=True, eq=False)
class StoneCarving:
    """Carved stones, and the wall that they make."""

    __repr__ = one_line

    carved: "tuple[Carved, ...]"
    total: "Total"
    drawn: "Assembly"  # the wall whose cells they were carved to
    fixed: "Bools"  # (n,) blocks of it that are held
    built: "CarvedWall"
    warnings: tuple[str, ...] = ()
    stones: "tuple[Stone, ...]" = ()  # as they were found, those that no cell took too

    @property
    def assembly(self) -> "Assembly":
        """The wall as it will be built, with contacts where the carved stones really touch."""
        return self.built.assembly


@dataclass(frozen=True, slots=True)
class MatchOptions:
    """What may be done to the wall so that the stones fit."""

    negotiate: float = option(
        0.0,
        "0: cells stay as drawn .. 1: cells move freely to suit the stones.",
        "number",
        metavar="X",
        least=0.0,
        most=1.0,
    )
    rounds: int | None = option(
        None, "Times that cells are moved and stones placed again [3 to 12].", "whole", metavar="N", least=1, most=100
    )
    supports: str = option("", "below=Z or ids=a,b instead of what the model says.", metavar="S")
    sawn: str = option(
        "",
        "Sawn new, and given no stone: voussoirs, lintels, quoins, coping, ids, patterns such as c01-*; by commas.",
        metavar="NAMES",
    )

    def __post_init__(self) -> None:
        check_options(self)
        if self.supports and self.negotiate > 0.0:
            raise InputError.of(
                "supports", None, "has no say where cells move; the ground of a drawn wall is its support"
            )


def match(
    stones: Stones,
    wall: Model,
    settings: "MatchSettings | None" = None,
    *,
    executor: Executor | None = None,
    progress: Callable[[str], None] = silent,
    **options: Unpack[MatchKeywords],
) -> StoneMatch:
    """Match found stones to the cells of a wall, so that as little as possible is carved away.

    Parameters
    ----------
    stones : path, Inventory or sequence of Stone
        Folder or file of scanned stones, or stones in memory.
    wall : path, Assembly, anything with an `assembly`, or a list or table of bodies
        Its free blocks are the cells; they can move only in a wall from `polygonal_wall`, or the file of one.
    settings : MatchSettings, optional
        Options in one object; keywords win over it.
    executor : Executor, optional
        Shares the work out; the answer is the same.
    progress : callable
        Is told what is being done.
    **options
        Fields of `MatchSettings`, such as gap, weight, bond, bond_angle and points; negotiate (0: cells stay as drawn,
        to 1: cells move freely to suit the stones), rounds of that, supports (as for `check`; they are no cells), and
        units of the stones' lengths, where the files do not say it.

    Returns
    -------
    StoneMatch
        To be given to `carve`, `save`, or shown in a notebook.

    Raises
    ------
    InputError
        Stones or wall cannot be read or used, options that contradict each other, a wall whose cells cannot move.
    """
    from cyclopean.design.matching.match import MatchSettings

    given: dict[str, Any] = dict(options)
    if given.get("gap") is not None and given.get("weight") is not None:
        raise InputError.of("weight", None, "`gap` finds it; leave out one of the two")
    base = MatchSettings() if settings is None else settings
    chosen, wanted, reading = given_to(match, given, base, MatchOptions(), StoneReading())
    inventory, assumed = inventory_of(stones, reading)
    found = matched(match_site(inventory, wall, chosen, wanted), chosen, wanted, executor, progress)
    return replace(found, warnings=(*assumed, *found.warnings))


@dataclass(frozen=True, slots=True, eq=False)
class MatchSite:
    """Stones and a wall that are to be matched."""

    inventory: "Inventory"
    drawn: "PolygonalWall | None"  # whose cells are to move, or who is the wall
    cells: "Cells"
    misfits: tuple[str, ...]  # why these stones cannot make this wall well
    warnings: tuple[str, ...]


def match_site(inventory: "Inventory", wall: Model, settings: "MatchSettings", wanted: MatchOptions) -> MatchSite:
    """Read the wall, and say what can be said before stones are placed; errors as `match`."""
    from cyclopean.assembly import supports as held_blocks
    from cyclopean.design.matching.cells import cells_of
    from cyclopean.design.matching.misfit import misfits
    from cyclopean.design.walls.polygonal import PolygonalWall

    if wanted.rounds is not None and not wanted.negotiate > 0.0:
        raise InputError.of("rounds", None, "has no say where cells stay as drawn; add `negotiate`, or leave it out")
    drawn = wall if isinstance(wall, PolygonalWall) else None
    if wanted.negotiate > 0.0:
        drawn, said = _drawn(wall)
        assembly = drawn.assembly
    else:
        assembly, said = assembly_of(wall)
    held = held_blocks(assembly, wanted.supports)[0]
    cells = cells_of(assembly, held, _sawn(assembly, held, drawn or wall, wanted.sawn))
    return MatchSite(inventory, drawn, cells, misfits(inventory.stones, cells, settings.gap), said)


def matched(
    site: MatchSite,
    settings: "MatchSettings",
    wanted: MatchOptions,
    executor: Executor | None = None,
    progress: Callable[[str], None] = silent,
) -> StoneMatch:
    """`match` with stones and wall that are read and options in objects, as every front end calls it."""
    from cyclopean.design.matching.cells import cells_of
    from cyclopean.design.matching.match import match_stones
    from cyclopean.design.matching.negotiation import Moving, negotiate
    from cyclopean.design.walls.interlock import interlock as score_of

    drawn, cells, said, scores = site.drawn, site.cells, site.warnings, None
    rounds: tuple[Round, ...] = ()
    if wanted.negotiate > 0.0:
        assert drawn is not None
        new = tuple(cells.sawn.tolist())
        moving = Moving(wanted.negotiate, wanted.rounds, sawn=new)
        done = negotiate(site.inventory, drawn, settings, moving, executor, progress)
        scores = score_of(drawn.pattern).score, score_of(done.wall.pattern).score
        drawn, found, rounds, said = done.wall, done.match, done.rounds, (*said, *done.notes)
        cells = cells_of(drawn.assembly, None, new)
    else:
        found = match_stones(site.inventory, cells, settings, executor, progress)
    notes = (*site.misfits, *said, *_unfilled(found, cells), *found.notes)
    return StoneMatch(found, site.inventory.stones, cells, drawn, rounds, wanted.supports, notes, scores, site.misfits)


def tradeoff(
    stones: Stones,
    wall: Model,
    walls: int | None = None,
    *,
    executor: Executor | None = None,
    progress: Callable[[str], None] = silent,
    **options: Unpack[TradeoffKeywords],
) -> StoneTradeoff:
    """Make walls between least carving and best interlock, all at one gap, and say which of them no other beats.

    Parameters
    ----------
    stones : path, Inventory or sequence of Stone
        As for `match`.
    wall : path or PolygonalWall
        From `polygonal_wall`, or the file of one: the others are drawn as it was.
    walls : int, optional
        How many, the wall as it is drawn included; 12 where not given.
    executor : Executor, optional
        Makes every wall as one call; the answer is the same.
    progress : callable
        Is told what is being done.
    **options
        depths (least and greatest, m), rounds of each negotiation, gap (0.1 where not given), bond, bond_angle, points
        and the like as for `match`, and units of the stones' lengths, where the files do not say it.

    Returns
    -------
    StoneTradeoff
        Each of its walls, `found[k]`, can be given to `carve` and `save`.

    Raises
    ------
    InputError
        As `match`, and for a wall that was not drawn, or a weight, which a trade-off finds.
    """
    from cyclopean.design.matching.match import MatchSettings
    from cyclopean.design.matching.tradeoff import TradeoffSettings

    given: dict[str, Any] = {**options, "walls": walls}
    chosen, wanted, reading = given_to(tradeoff, given, MatchSettings(), TradeoffSettings(), StoneReading())
    inventory, assumed = inventory_of(stones, reading)
    found = traded(inventory, wall, chosen, wanted, executor, progress)
    return replace(found, warnings=(*assumed, *found.warnings))


def traded(
    inventory: "Inventory",
    wall: Model,
    settings: "MatchSettings",
    wanted: "TradeoffSettings",
    executor: Executor | None = None,
    progress: Callable[[str], None] = silent,
) -> StoneTradeoff:
    """`tradeoff` with stones that are read and options in objects, as every front end calls it."""
    from cyclopean.design.matching.tradeoff import tradeoff as trade

    drawn, said = _drawn(wall, "tradeoff")
    found = trade(inventory, drawn, wanted, settings, executor, progress)
    return StoneTradeoff(found, inventory.stones, (*said, *found.notes))


def _sawn(assembly: "Assembly", held: "Bools", wall: Model, asked: str) -> "Ints":
    """Blocks that are sawn new, by what a wall says of how it was drawn, if it does."""
    from cyclopean.design.matching.sawn import sawn_blocks
    from cyclopean.design.walls.polygonal import PolygonalWall
    from cyclopean.io import read_drawing

    drawn = wall if isinstance(wall, PolygonalWall) else None
    if asked and isinstance(wall, str | os.PathLike):
        drawn = read_drawing(wall)[0]
    kinds = () if drawn is None else drawn.pattern.kind
    return sawn_blocks([block.id for block in assembly.blocks], held, kinds, asked)


def _drawn(wall: Model, asking: str = "negotiate") -> "tuple[PolygonalWall, tuple[str, ...]]":
    """How the wall was drawn, so that its cells can move, as an option asks.

    Raises
    ------
    InputError
        It does not say so.
    """
    from cyclopean.design.walls.polygonal import PolygonalWall
    from cyclopean.io import read_drawing

    if isinstance(wall, PolygonalWall):
        return wall, ()
    drawn, said = read_drawing(wall) if isinstance(wall, str | os.PathLike) else (None, ())
    if drawn is None:
        way = "cells can move only in a wall from 'make polygonal' or polygonal_wall, and not round a corner"
        which = wall if isinstance(wall, str | os.PathLike) else "the wall"
        raise InputError.of(asking, None, said[-1] if said else f"{which}: does not say how it was drawn; {way}")
    return drawn, said


def _unfilled(found: "Match", cells: "Cells") -> tuple[str, ...]:
    """Name the cells that get no stone."""
    names = [cells.assembly.blocks[cells.block[j]].id for j in found.empty.tolist()]
    return (f"no stone is left for {first_few(names, LISTED)}",) if names else ()


def carve(
    found: "StoneMatch | str | os.PathLike[str]",
    *,
    least: float | None = None,
    supports: str = "",
    progress: Callable[[str], None] = silent,
) -> StoneCarving:
    """Cut matched stones back to their cells, and find where they touch in the wall as it will be built.

    Parameters
    ----------
    found : StoneMatch or path
        From `match`, or a match file or the folder that it lies in.
    least : float, optional
        Depth (m) up to which a cut is left to the chisel.
    supports : str
        As for `match`; by default what was said there.
    progress : callable
        Is told which stone comes next.

    Returns
    -------
    StoneCarving
        Give it to `check` to know whether the wall stands as it will be built.

    Raises
    ------
    InputError
        The match cannot be read, or stones or wall have changed since.
    """
    from cyclopean.assembly import supports as held_blocks
    from cyclopean.design.carving.carve import LEAST, carve_all, total
    from cyclopean.design.carving.carved_wall import carved_wall
    from cyclopean.io.matches import read_match, read_matched

    depth = LEAST if least is None else least
    if not depth >= 0.0:
        raise InputError(f"least: {depth:g} is not a depth of at least 0 m")
    if isinstance(found, StoneMatch):
        wall, rule, new = found.assembly, supports or found.supports, found.cells.sawn.tolist()
        stones = tuple(found.stones)
        cut = carve_all(found.match.placed(found.stones, found.cells), least=depth, progress=progress)
    else:
        stored = read_match(found)
        wall, placed, stones = read_matched(stored)
        cut = carve_all(placed, least=depth, progress=progress)
        rule = supports or stored.supports or ""
        place = {block.id: k for k, block in enumerate(wall.blocks)}
        new = [place[name] for name in stored.sawn]
    fixed, _ = held_blocks(wall, rule)
    built = carved_wall(wall, cut, fixed=fixed, sawn=new)
    notes = (*(note for c in cut for note in c.notes), *built.notes)
    return StoneCarving(cut, total(cut), wall, fixed, built, notes, stones)


def settle(
    stones: Stones,
    settings: "SettleSettings | None" = None,
    progress: Callable[[str], None] = silent,
    *,
    standing: "Model | None" = None,
    next: int = 0,
    executor: Executor | None = None,
    **options: Unpack[SettleKeywords],
) -> "RubbleWall":
    """Lay found stones, uncut, into a dry rubble wall, and say of each whether it sits.

    Parameters
    ----------
    stones : path, Inventory or sequence of Stone
        Folder or file of scanned stones, or stones in memory.
    settings : SettleSettings, optional
        Options in one object; keywords win over it.
    progress : callable
        Is told what goes on.
    standing : model, optional
        A wall that stands already, its ground fixed: it is gone on with. Stones that are in it by their ids are used.
    next : int
        Tell so many stones that could be laid next, the best first, in `following`, and lay the first of them only.
    executor : Executor, optional
        Lays every other one of several walls; the result is the same without it.
    **options
        Fields of `SettleSettings`, such as length, height, thickness, wythes, batter and dress; and units of the
        stones' lengths, where the files do not say it.

    Returns
    -------
    RubbleWall
        What was assumed in reading files is a `UserWarning`, since a wall has no place for it.

    Raises
    ------
    InputError
        Stones that cannot be read, none that fits, options that make no sense.
    """
    from cyclopean.design.rubble import settle as rubble

    base = rubble.SettleSettings() if settings is None else settings
    chosen, reading = given_to(settle, options, base, StoneReading())
    inventory, assumed = inventory_of(stones, reading)
    stands, said = (None, ()) if standing is None else assembly_of(standing)
    wall = rubble.settle(inventory, chosen, progress, executor, stands, next)
    for line in (*assumed, *said):
        warnings.warn(line, stacklevel=2)
    return wall
