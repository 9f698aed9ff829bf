"""`match`: which found stone goes into which cell of a wall."""

import os
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cyclopean.cli.outputs import STANDARD_OUTPUT, folder, planned
from cyclopean.cli.terminal import long_work, say, say_json, warn
from cyclopean.cli.wall_options import named
from cyclopean.cli.workers import workers
from cyclopean.errors import InputError
from cyclopean.texts import choice, number, whole

if TYPE_CHECKING:
    from cyclopean.design.matching.cells import Cells
    from cyclopean.design.matching.match import Match, MatchSettings
    from cyclopean.design.matching.negotiation import Round
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.design.walls.polygonal import PolygonalWall
    from cyclopean.io.checkpoints import Checkpoints

__all__ = ["match"]

Supports = Annotated[
    str, typer.Option(metavar="S", show_default=False, help="below=Z or ids=a,b instead of what the model says.")
]
PARTS = "match.parts"  # folder with what is done so far, gone once all is
WALL = "negotiated.json"
FIELDS = {
    **{name: (f"--{name}", "") for name in ("weight", "gap", "points")},
    "bond_angle": ("--bond", "angle"),
}
LISTED = 5  # cells or stones named one by one
ALIKE = 30.0  # times that stones may be larger than cells, or smaller, before it looks like a slip of units


def match(
    stones: Annotated[
        str, typer.Argument(metavar="STONES", show_default=False, help="Folder of stones, or a file that holds them.")
    ],
    wall: Annotated[
        str, typer.Argument(metavar="WALL", show_default=False, help="Model whose free blocks are the cells.")
    ],
    out: Annotated[str, typer.Option(metavar="DIR", show_default=False, help="Folder to write to.")],
    gap: Annotated[
        str | None, typer.Option(metavar="G", help="Share of the wall that may stay void; sets the weight.")
    ] = None,
    weight: Annotated[
        str | None, typer.Option(metavar="W", help="Price of a litre of void; a litre carved costs 1 [1].")
    ] = None,
    negotiate: Annotated[
        str, typer.Option(metavar="X", help="0: cells stay as drawn .. 1: cells move freely to suit the stones.")
    ] = "0",
    rounds: Annotated[
        str | None, typer.Option(metavar="N", help="Times that cells are moved and stones placed again [3 to 12].")
    ] = None,
    bond: Annotated[
        str, typer.Option(metavar="free|into|along[:DEG]", help="Where the stones' longest axes lie.")
    ] = "free",
    points: Annotated[str, typer.Option(metavar="N", help="Points in each stone that its pose is found by.")] = "1024",
    units: Annotated[str | None, typer.Option(metavar="U", help="Unit of the stones' lengths, such as mm.")] = None,
    supports: Supports = "",
    strict: Annotated[bool, typer.Option("--strict", help="A stone that cannot be used is an error.")] = False,
    workers_: Annotated[str, typer.Option("--workers", metavar="N", help="Processes that share the work.")] = "1",
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a dask cluster that does the work.")
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget what an interrupted run has left in DIR.")] = False,
    json: Annotated[
        str | None, typer.Option(metavar="F|-", help="Write the match here too; - prints it and nothing else.")
    ] = None,
    report: Annotated[str | None, typer.Option(metavar="F", help="Write a page to read in a browser.")] = None,
) -> int:
    """Match found stones to the cells of a wall, so that as little as possible is carved away.

    DIR gets match.json, and negotiated.json where cells were moved. A run that is interrupted goes on where it stopped
    when it is started again.
    """
    kind, colon, degrees = bond.partition(":")
    wanted: dict[str, Any] = {
        "weight": 1.0 if weight is None else number("--weight", weight),
        "gap": None if gap is None else number("--gap", gap),
        "points": whole("--points", points),
        "bond": choice("--bond", kind, ("free", "into", "along")),
        **({"bond_angle": number("--bond", degrees)} if colon else {}),
    }
    if weight is not None and gap is not None:
        raise InputError("--weight: --gap finds it; leave out one of the two")
    if colon and kind == "free":
        raise InputError(f"--bond: '{bond}' should be free, into[:DEG] or along[:DEG]")
    share, count = number("--negotiate", negotiate), whole("--workers", workers_)
    turns = None if rounds is None else whole("--rounds", rounds)
    if not 0.0 <= share <= 1.0:
        raise InputError(f"--negotiate: {share:g} is not between 0 and 1")
    if turns is not None and not 1 <= turns <= 100:
        raise InputError(f"--rounds: {turns} is not between 1 and 100")
    if turns is not None and not share > 0.0:
        raise InputError("--rounds: has no say where cells stay as drawn; add --negotiate, or leave it out")
    place = folder("--out", out, out)
    moved = {"--out negotiated.json": str(place / WALL)} if share > 0.0 else {}
    files = planned({"--out match.json": str(place / "match.json"), **moved, "--json": json, "--report": report})
    for given in (stones, wall):
        planned({option: str(path) for option, path in files.items()}, keep=given)

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the products are small: threads would wait for each other
    from cyclopean import io
    from cyclopean.design.matching.match import MatchSettings
    from cyclopean.io.checkpoints import Checkpoints

    with named(FIELDS):
        settings = MatchSettings(**wanted)
    with workers(count, cluster) as hands, long_work(f"matching {stones}") as stage:
        inventory, said = io.read_stones(stones, units, strict)
        parts = Checkpoints(place / PARTS, hands)
        if fresh:
            parts.clear()
        resumed = any(parts)
        try:
            answer = _answered(inventory, wall, supports, settings, (share, turns), parts, stage)
        except InputError:
            if not resumed and not parts.made:  # a slip in the command must not cost what was done before it
                parts.clear()
            raise
    unlike = _unlike(inventory, answer.cells)
    for warning in dict.fromkeys(
        (*said, *_unfit(parts), *inventory.notes, *unlike, *answer.warnings, *answer.match.notes)
    ):
        warn(warning)
    data = answer.data(
        inventory, stones, files, units, {**wanted, "negotiate": share, "rounds": turns, "supports": supports or None}
    )
    page = answer.page(inventory) if "--report" in files else None
    with io.together():
        if answer.drawn is not None and "--out negotiated.json" in files:
            io.write_model(files["--out negotiated.json"], answer.drawn.assembly, drawing=io.drawing_dict(answer.drawn))
        for option in ("--out match.json", "--json"):
            if option in files:
                io.write_json(files[option], data)
        if page is not None:
            io.write_text(files["--report"], page)
    parts.clear()
    if json == STANDARD_OUTPUT:
        say_json(data)
    else:
        say("\n".join(_lines(data, inventory, files)))
    return 0


@dataclass(frozen=True, slots=True)
class _Answer:
    """A match, the cells it is of, and the wall whose cells were moved for it."""

    match: "Match"
    cells: "Cells"
    source: str  # file of the wall that the cells are of, where it is not drawn anew
    drawn: "PolygonalWall | None" = None
    rounds: "tuple[Round, ...]" = ()
    warnings: tuple[str, ...] = ()

    def data(
        self, inventory: "Inventory", stones: str, files: dict[str, Path], units: str | None, asked: dict[str, Any]
    ) -> dict[str, Any]:
        """The match as plain data; paths as seen from the folder it is written to."""
        from cyclopean.io.matches import match_dict

        there = files["--out match.json"].parent
        wall = WALL if self.drawn is not None else _seen_from(there, self.source)
        rounds = [
            {"Lambda": r.imposition, "gap": r.gap, "carved": r.carved, "void": r.void, "seconds": r.seconds}
            for r in self.rounds
        ]
        return match_dict(
            self.match,
            inventory.stones,
            self.cells,
            stones_path=_seen_from(there, stones),
            wall_path=wall,
            stone_units=units,
            rounds=rounds,
            settings=asked | {"weight": self.match.weight},
        )

    def page(self, inventory: "Inventory") -> str:
        """The match as a page to read in a browser."""
        from cyclopean.view.match_page import match_html

        return match_html(self.match, inventory.stones, self.cells, self.rounds)


def _answered(
    inventory: "Inventory",
    wall: str,
    supports: str,
    settings: "MatchSettings",
    moving: tuple[float, int | None],
    executor: Executor,
    stage: Callable[[str], None],
) -> _Answer:
    """Match to the cells as they are, or negotiate them.

    Raises
    ------
    InputError
        The wall cannot be read, has no free block, or does not say how it was drawn and its cells shall move.
    """
    from cyclopean import io
    from cyclopean.assembly import supports as held_blocks
    from cyclopean.design.matching.cells import cells_of
    from cyclopean.design.matching.match import match_stones

    share, turns = moving
    if not share > 0.0:
        assembly, said = io.read_model(wall)
        cells = cells_of(assembly, held_blocks(assembly, supports)[0])
        found = match_stones(inventory, cells, settings, executor, stage)
        return _Answer(found, cells, wall, warnings=(*said, *_empty(found, cells)))

    from cyclopean.design.matching.negotiation import negotiate

    drawn, said = io.read_drawing(wall)
    if drawn is None:
        way = "cells can move only in a wall from 'make polygonal', and not round a --corner"
        raise InputError(f"--negotiate: {said[-1] if said else f'{wall}: does not say how it was drawn; {way}'}")
    if supports:
        raise InputError("--supports: has no say where cells move; the ground of a drawn wall is its support")
    done = negotiate(inventory, drawn, settings, share, rounds=turns, executor=executor, progress=stage)
    cells = cells_of(done.wall.assembly)
    return _Answer(done.match, cells, wall, done.wall, done.rounds, (*said, *done.notes, *_empty(done.match, cells)))


def _unlike(inventory: "Inventory", cells: "Cells") -> tuple[str, ...]:
    """Name the suspicion that stones and wall are not in the same units."""
    import numpy as np

    stone, cell = np.median([s.volume for s in inventory.stones]), np.median(cells.volume)
    times = float(np.cbrt(cell / stone))
    if 1.0 / ALIKE <= times <= ALIKE:
        return ()
    said = f"{times:.3g} times as large as" if times > 1.0 else f"{1.0 / times:.3g} times smaller than"
    return (f"cells are {said} stones; check the units of the wall and of the stones (--units)",)


def _unfit(parts: "Checkpoints") -> tuple[str, ...]:
    """Tell of what an interrupted run has left in vain."""
    if not parts.unfit:
        return ()
    what = "1 part" if len(parts.unfit) == 1 else f"{len(parts.unfit)} parts"
    return (
        f"{parts.folder}: {what} of an interrupted run did not fit (damaged, changed or of other input): done anew",
    )


def _empty(found: "Match", cells: "Cells") -> tuple[str, ...]:
    """Name the cells that get no stone."""
    names = [cells.assembly.blocks[cells.block[j]].id for j in found.empty.tolist()]
    if not names:
        return ()
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return (f"no stone is left for {', '.join(names[:LISTED])}{more}",)


def _lines(data: dict[str, Any], inventory: "Inventory", files: dict[str, Path]) -> list[str]:
    """Say what came out."""
    rows = data["placements"]
    worst = max(rows, key=lambda row: row["lambda"])
    placed, cells = sum(row["stone_volume"] for row in rows), sum(row["cell_volume"] for row in rows)
    lines = [
        f"matched: {len(rows)} of {len(inventory.stones)} stones to {len(rows)} of {len(rows) + len(data['empty'])}"
        f" cells, Lambda {data['Lambda']:.4f}, gap {data['gap']:.4f}",
        f"  volumes  {1e3 * placed:.1f} L of stone for {1e3 * cells:.1f} L of wall, {1e3 * placed * data['Lambda']:.1f}"
        f" L to carve away, {1e3 * cells * data['gap']:.1f} L void; w {data['settings']['weight']:.3g}",
        f"  most is carved off {worst['stone']} for {worst['cell']}: lambda {worst['lambda']:.3f}",
        "  datum    Lambda 0.27 was built: Cyclopean Cannibalism (Clifford & McGee 2018)",
    ]
    for number_, row in enumerate(data["rounds"]):
        lines.append(f"  round {number_:<2} Lambda {row['Lambda']:.4f}, gap {row['gap']:.4f}, {row['seconds']:.1f} s")
    lines.append(f"  written  {', '.join(str(path) for path in files.values())}")
    return lines


def _seen_from(folder_: Path, file: str) -> str:
    """A path as it is to be read from a folder; absolute where the two have no common root."""
    try:
        return os.path.relpath(os.path.realpath(file), os.path.realpath(folder_)).replace(os.sep, "/")
    except ValueError:  # another drive
        return os.path.abspath(file)
