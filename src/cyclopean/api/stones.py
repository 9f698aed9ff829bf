"""From found stones to a wall: `match` them to its cells, `carve` them back, or `settle` them as they are."""

import os
import warnings
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from cyclopean.api.inputs import Model, Stones, assembly_of, inventory_of, said
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.arrays import Bools
    from cyclopean.assembly import Assembly
    from cyclopean.design.carving.carve import Carved, Total
    from cyclopean.design.carving.carved_wall import CarvedWall
    from cyclopean.design.matching.cells import Cells
    from cyclopean.design.matching.match import Match, MatchSettings
    from cyclopean.design.matching.negotiation import Negotiation, Round
    from cyclopean.design.rubble.settle import RubbleWall, SettleSettings
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.design.stones.stone import Stone
    from cyclopean.design.walls.polygonal import PolygonalWall

__all__ = ["StoneCarving", "StoneMatch", "carve", "match", "settle"]


def _silent(_: str) -> None:
    """Tell nobody."""


@dataclass(frozen=True, slots=True, eq=False)
class StoneMatch:
    """Which stone goes where, with the stones and the cells that this is of."""

    match: "Match"
    stones: "tuple[Stone, ...]"
    cells: "Cells"
    drawn: "PolygonalWall | None" = None  # the wall as it was drawn, or drawn anew where its cells were moved
    rounds: "tuple[Round, ...]" = ()  # of a negotiation
    supports: str = ""  # which blocks are held, where that was said
    warnings: tuple[str, ...] = ()

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
class StoneCarving:
    """Carved stones, and the wall that they make."""

    carved: "tuple[Carved, ...]"
    total: "Total"
    drawn: "Assembly"  # the wall whose cells they were carved to
    fixed: "Bools"  # (n,) blocks of it that are held
    built: "CarvedWall"
    warnings: tuple[str, ...] = ()

    @property
    def assembly(self) -> "Assembly":
        """The wall as it will be built, with contacts where the carved stones really touch."""
        return self.built.assembly


def match(
    stones: Stones,
    wall: Model,
    settings: "MatchSettings | None" = None,
    *,
    gap: float | None = None,
    weight: float | None = None,
    negotiate: float = 0.0,
    rounds: int | None = None,
    bond: Literal["free", "into", "along"] | None = None,
    bond_angle: float | None = None,
    points: int | None = None,
    supports: str = "",
    executor: Executor | None = None,
    progress: Callable[[str], None] = _silent,
    units: str | None = None,
) -> StoneMatch:
    """Match found stones to the cells of a wall, so that as little as possible is carved away.

    Parameters
    ----------
    stones : path, Inventory or sequence of Stone
        Folder or file of scanned stones, or stones in memory.
    wall : path, Assembly or anything with an `assembly`
        Its free blocks are the cells.
    settings : MatchSettings, optional
        Options in one object; keywords win over it.
    gap : float, optional
        Share of the wall that may stay void; finds the weight.
    weight : float, optional
        Price of a litre of void, where a litre carved off costs 1.
    negotiate : float
        0: cells stay as drawn, to 1: cells move freely to suit the stones. Needs a wall from `polygonal_wall`, or the
        file of one.
    rounds : int, optional
        Of the negotiation.
    bond : {"free", "into", "along"}, optional
        Where the stones' longest axes lie.
    bond_angle : float, optional
        Degrees by which they may be off.
    points : int, optional
        Points in each stone that its pose is found by.
    supports : str
        "below=Z" (m) or "ids=a,b" instead of what the wall says; they are no cells.
    executor : Executor, optional
        Shares the work out; the answer is the same.
    progress : callable
        Is told what is being done.
    units : str, optional
        Unit of the stones' lengths, where the files do not say it.

    Returns
    -------
    StoneMatch
        To be given to `carve`, `save`, or shown in a notebook.

    Raises
    ------
    InputError
        Stones or wall cannot be read or used, options that contradict each other, a wall whose cells cannot move.
    """
    from cyclopean.assembly import supports as held_blocks
    from cyclopean.design.matching.cells import cells_of
    from cyclopean.design.matching.match import MatchSettings, match_stones

    if gap is not None and weight is not None:
        raise InputError("weight: gap finds it; leave out one of the two")
    if not negotiate > 0.0 and rounds is not None:
        raise InputError("rounds: has no say where cells stay as drawn; add negotiate, or leave it out")
    inventory, assumed = inventory_of(stones, units)
    base = MatchSettings() if settings is None else settings
    chosen = said(base, gap=gap, weight=weight, bond=bond, bond_angle=bond_angle, points=points)
    if negotiate > 0.0:
        done, said_of_wall = _negotiated(inventory, wall, chosen, negotiate, rounds, supports, executor, progress)
        notes = (*assumed, *said_of_wall, *done.notes, *done.match.notes)
        cells = cells_of(done.wall.assembly)
        return StoneMatch(done.match, inventory.stones, cells, done.wall, done.rounds, warnings=notes)
    assembly, said_of_wall = assembly_of(wall)
    cells = cells_of(assembly, held_blocks(assembly, supports)[0])
    found = match_stones(inventory, cells, chosen, executor, progress)
    from cyclopean.design.walls.polygonal import PolygonalWall

    drawn = wall if isinstance(wall, PolygonalWall) else None
    notes = (*assumed, *said_of_wall, *found.notes)
    return StoneMatch(found, inventory.stones, cells, drawn, supports=supports, warnings=notes)


def _negotiated(
    inventory: "Inventory",
    wall: Model,
    settings: "MatchSettings",
    share: float,
    rounds: int | None,
    supports: str,
    executor: Executor | None,
    progress: Callable[[str], None],
) -> "tuple[Negotiation, tuple[str, ...]]":
    """Let the cells move.

    Raises
    ------
    InputError
        The wall does not say how it was drawn, or supports were named.
    """
    from cyclopean.design.matching.negotiation import negotiate
    from cyclopean.design.walls.polygonal import PolygonalWall
    from cyclopean.io import read_drawing

    if supports:
        raise InputError("supports: has no say where cells move; the ground of a drawn wall is its support")
    drawn = wall if isinstance(wall, PolygonalWall) else None
    warned: tuple[str, ...] = ()
    if isinstance(wall, str | os.PathLike):
        drawn, warned = read_drawing(wall)
    if drawn is None:
        why = f" ({warned[-1]})" if warned else ""
        raise InputError(f"negotiate: cells can move only in a wall from polygonal_wall, or in the file of one{why}")
    return negotiate(inventory, drawn, settings, share, rounds=rounds, executor=executor, progress=progress), warned


def carve(
    found: "StoneMatch | str | os.PathLike[str]",
    *,
    least: float | None = None,
    supports: str = "",
    progress: Callable[[str], None] = _silent,
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
    from cyclopean.design.carving.carve import LEAST, carve_all, carve_match, total
    from cyclopean.design.carving.carved_wall import carved_wall
    from cyclopean.io.matches import read_match, read_matched

    depth = LEAST if least is None else least
    if not depth >= 0.0:
        raise InputError(f"least: {depth:g} is not a depth of at least 0 m")
    if isinstance(found, StoneMatch):
        wall, rule = found.assembly, supports or found.supports
        cut = carve_match(found.match, found.stones, found.cells, least=depth, progress=progress)
    else:
        stored = read_match(found)
        wall, placed = read_matched(stored)
        cut = carve_all(placed, least=depth, progress=progress)
        rule = supports or stored.supports or ""
    fixed, _ = held_blocks(wall, rule)
    built = carved_wall(wall, cut, fixed=fixed)
    notes = (*(note for c in cut for note in c.notes), *built.notes)
    return StoneCarving(cut, total(cut), wall, fixed, built, notes)


def settle(
    stones: Stones,
    settings: "SettleSettings | None" = None,
    progress: Callable[[str], None] = _silent,
    *,
    length: float | None = None,
    height: float | None = None,
    thickness: float | None = None,
    wythes: Literal[1, 2] | None = None,
    look_ahead: int | None = None,
    margin: float | None = None,
    hearting: bool | None = None,
    chinking: bool | None = None,
    units: str | None = None,
    executor: Executor | None = None,
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
    length, height, thickness : float, optional
        Of the wall (m); found from the stones where not given.
    wythes : {1, 2}, optional
        Stones side by side through the wall.
    look_ahead : int, optional
        Stones that compete for a place.
    margin : float, optional
        Depth (m) of the centre of mass inside the hull of the contacts.
    hearting, chinking : bool, optional
        Small stones go into the hollows; wedges go under stones that rock.
    units : str, optional
        Unit of the stones' lengths, where the files do not say it.
    executor : Executor, optional
        Has one process lay half of a long wall, or every other one of several; the result is the same without it.

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

    inventory, assumed = inventory_of(stones, units)
    chosen = said(
        rubble.SettleSettings() if settings is None else settings,
        length=length,
        height=height,
        thickness=thickness,
        wythes=wythes,
        look_ahead=look_ahead,
        margin=margin,
        hearting=hearting,
        chinking=chinking,
    )
    wall = rubble.settle(inventory, chosen, progress, executor)
    for line in assumed:
        warnings.warn(line, stacklevel=2)
    return wall
