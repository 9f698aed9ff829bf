"""`match`: which found stone goes into which cell of a wall."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.api.inputs import StoneReading, inventory_of
from cyclopean.api.site import SiteOptions, site_folder, site_sheets
from cyclopean.api.stones import MatchOptions, StoneMatch, StoneTradeoff, match_site, matched, traded
from cyclopean.cli.command import argument, command, some, written
from cyclopean.cli.outputs import Files, folder
from cyclopean.cli.site import written_site
from cyclopean.cli.terminal import long_work, warn
from cyclopean.cli.tradeoff import contents_of, names_of, summary, wanted_walls
from cyclopean.cli.workers import workers as hands
from cyclopean.design.matching.match import MatchSettings
from cyclopean.design.matching.tradeoff import TradeoffSettings
from cyclopean.errors import InputError
from cyclopean.options import Option, options_of
from cyclopean.texts import choice, number

if TYPE_CHECKING:
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.io.checkpoints import Checkpoints

PARTS = "match.parts"  # folder with what is done so far, gone once all is
MATCH, WALL = "match.json", "negotiated.json"


@command(fields={"bond_angle": "bond angle"})
def match(
    stones: Annotated[str, argument("STONES", "Folder of stones, or a file that holds them.", source=True)],
    wall: Annotated[str, argument("WALL", "Model whose free blocks are the cells.", source=True)],
    out: Annotated[str, Option("Folder to write to.", metavar="DIR")],
    settings: Annotated[MatchSettings, some("gap points")] = MatchSettings(points=1024),
    bond: Annotated[str, Option("Where the stones' longest axes lie.", metavar="free|into|along[:DEG]")] = "free",
    weight: Annotated[float | None, options_of(MatchSettings)["weight"]] = None,
    options: MatchOptions = MatchOptions(),
    tradeoff: Annotated[int | None, options_of(TradeoffSettings)["walls"]] = None,
    depths: Annotated[tuple[float, float] | None, options_of(TradeoffSettings)["depths"]] = None,
    reading: StoneReading = StoneReading(),
    workers: Annotated[int, Option("Processes that share the work.", "whole", metavar="N")] = 1,
    cluster: Annotated[str | None, Option("Scheduler of a dask cluster that does the work.", metavar="ADDRESS")] = None,
    site: SiteOptions = SiteOptions(),
    fresh: Annotated[bool, Option("Forget what an interrupted run has left in DIR.", "flag")] = False,
    files: Annotated[
        Files,
        written("report", "drawing", json=("F|-", "Write the match here too; - prints it and nothing else.")),
    ] = Files({}),
) -> int:
    """Match found stones to the cells of a wall, so that as little as possible is carved away.

    DIR gets match.json, and negotiated.json where cells were moved; with --tradeoff, a model, a match and a picture of
    each wall. A run that is interrupted goes on where it stopped when it is started again.
    """
    trade = wanted_walls(tradeoff, depths, weight, options)
    _look_at_drawings(files, site, several=trade is not None)
    settings, asked = _asked(settings, bond, weight, options)
    place = folder("--out", out, out)
    usual = (MATCH, WALL) if options.negotiate > 0.0 else (MATCH,)
    files = files.within(place, usual if trade is None else names_of(trade.walls), (stones, wall))
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the products are small: threads would wait for each other
    from cyclopean import io
    from cyclopean.io.checkpoints import Checkpoints

    with hands(workers, cluster) as executor, long_work(f"matching {stones}") as stage:
        inventory, said = inventory_of(stones, reading)
        parts = Checkpoints(place / PARTS, executor)
        if fresh:
            parts.clear()
        resumed = any(parts)
        try:
            found: StoneMatch | StoneTradeoff
            if trade is None:
                cells = match_site(inventory, wall, settings, options)
                for line in cells.misfits:
                    warn(line)
                found = matched(cells, settings, options, parts, stage)
            else:
                found = traded(inventory, wall, settings, trade, parts, stage)
            sheets = site_sheets(found, site, progress=stage) if isinstance(found, StoneMatch) else None
        except InputError:
            if not resumed and not parts.made:  # a slip in the command must not cost what was done before it
                parts.clear()
            raise
        except BaseException:  # an interrupt, or what a library makes of one
            _kept(parts)
            raise
    _warn((*said, *_unfit(parts), *inventory.notes, *found.warnings), but=getattr(found, "misfits", ()))

    def plain(of: StoneMatch, model: str, **more: Any) -> dict[str, Any]:
        return _data(of, place, stones, model, reading.units, asked | more)

    if isinstance(found, StoneTradeoff):
        data, contents = contents_of(found, lambda k, model, **more: plain(found[k], model, **more))
        lines = summary(found.tradeoff, place, files)
    else:
        data = plain(found, WALL if options.negotiate > 0.0 else _seen_from(place, wall))
        contents, lines = _contents(found, data), _lines(data, inventory, files)
    with io.together():
        files.write(contents)
        lines += written_site(site, sheets)
    parts.clear()
    files.tell(data, lines)
    return 0


def _look_at_drawings(files: Files, site: SiteOptions, *, several: bool) -> None:
    """Look at where drawings go; several walls have no one drawing.

    Raises
    ------
    InputError
        One was asked for, or the sheets cannot be written there.
    """
    site_folder(site)
    if not several:
        return
    if drawing := next((name for name in ("svg", "dxf") if name in files.to), ""):
        raise InputError.of(drawing, None, "a `tradeoff` draws each of its walls in DIR; leave it out")
    if site.site is not None:
        raise InputError.of("site", None, "a `tradeoff` gives several walls; carve one of them with `site`")


def _contents(found: "StoneMatch", data: dict[str, Any]) -> dict[str, Callable[[], Any]]:
    """What each file of a match holds."""
    from cyclopean import io
    from cyclopean.api.drawings import drawn
    from cyclopean.view.match_page import match_html

    drawing = None if found.drawn is None else io.drawing_dict(found.drawn)
    return {
        WALL: lambda: lambda file: io.write_model(file, found.assembly, drawing=drawing),
        MATCH: lambda: data,
        "json": lambda: data,
        "report": lambda: match_html(found.match, found.stones, found.cells, found.rounds, found.misfits),
        **drawn(found),
    }


def _asked(
    settings: MatchSettings, bond: str, weight: float | None, options: MatchOptions
) -> tuple[MatchSettings, dict[str, Any]]:
    """Settings with where the longest axes lie, and what was asked for as the match file tells it.

    Raises
    ------
    InputError
        A bond that is none, or a weight beside a gap that finds it.
    """
    from dataclasses import replace

    kind, colon, degrees = bond.partition(":")
    choice("`bond`", kind, ("free", "into", "along"))
    if colon and kind == "free":
        raise InputError(f"`bond`: '{bond}' should be free, into[:DEG] or along[:DEG]")
    if settings.gap is not None and weight is not None:
        raise InputError.of("weight", None, "`gap` finds it; leave out one of the two")
    settings = settings if weight is None else replace(settings, weight=weight)
    given: dict[str, Any] = {"bond": kind, **({"bond_angle": number("`bond`", degrees)} if colon else {})}
    asked = {"weight": settings.weight, "gap": settings.gap, "points": settings.points, **given}
    asked |= {
        "negotiate": options.negotiate,
        "rounds": options.rounds,
        "supports": options.supports or None,
        "sawn": options.sawn or None,
    }
    return replace(settings, **given), asked


def _data(
    found: "StoneMatch", place: Path, stones: str, wall: str, units: str | None, asked: dict[str, Any]
) -> dict[str, Any]:
    """The match as plain data; paths as seen from the folder it is written to."""
    from cyclopean.io.matches import MatchFiles, match_dict

    rounds = [
        {"Lambda": r.imposition, "gap": r.gap, "carved": r.carved, "void": r.void, "seconds": r.seconds}
        for r in found.rounds
    ]
    asked = asked | {"weight": found.match.weight}
    files = MatchFiles(_seen_from(place, stones), wall, units)
    said = match_dict(found.match, found.stones, found.cells, files, rounds, asked)
    if found.interlock is not None:
        said["J"] = dict(zip(("before", "after"), found.interlock, strict=True))
    return said


def _warn(notes: tuple[str, ...], but: tuple[str, ...]) -> None:
    """Warn once of each, but of what has been said."""
    for note in dict.fromkeys(note for note in notes if note not in but):
        warn(note)


def _kept(parts: "Checkpoints") -> None:
    """Say how to go on with work that was given up."""
    if count := len(list(parts)):
        warn(f"{count} parts of the work are kept in {parts.folder}; the same command goes on from there")


def _unfit(parts: "Checkpoints") -> tuple[str, ...]:
    """Tell of what an interrupted run has left in vain."""
    if not parts.unfit:
        return ()
    what = "1 part" if len(parts.unfit) == 1 else f"{len(parts.unfit)} parts"
    return (
        f"{parts.folder}: {what} of an interrupted run did not fit (damaged, changed or of other input): done anew",
    )


def _lines(data: dict[str, Any], inventory: "Inventory", files: Files) -> list[str]:
    """Say what came out."""
    from cyclopean.view.match_page import match_answer

    title, said = match_answer(len(data["empty"]), data["Lambda"], data["gap"], data["gap_of_wall"])
    rows = data["placements"]
    worst = max(rows, key=lambda row: row["lambda"])
    placed, cells = sum(row["stone_volume"] for row in rows), sum(row["cell_volume"] for row in rows)
    lines = [
        f"{title}{':' if title.isupper() else '.'} {said}",
        f"  matched  {len(rows)} of {len(inventory.stones)} stones to {len(rows)} of {len(rows) + len(data['empty'])}"
        f" cells, Lambda {data['Lambda']:.4f}, gap {data['gap']:.4f}",
        f"  volumes  {1e3 * placed:.1f} L of stone for {1e3 * cells:.1f} L of wall, {1e3 * placed * data['Lambda']:.1f}"
        f" L to carve away, {1e3 * cells * data['gap']:.1f} L void; w {data['settings']['weight']:.3g}",
        f"  most is carved off {worst['stone']} for {worst['cell']}: lambda {worst['lambda']:.3f}",
        "  datum    Lambda 0.27 was built: Cyclopean Cannibalism (Clifford & McGee 2018)",
    ]
    if data["sawn"]:
        litres = 1e3 * sum(row["volume"] for row in data["sawn"])
        lines.append(f"  sawn     {len(data['sawn'])} stones new, as drawn, {litres:.1f} L; no part of Lambda and gap")
    if "J" in data:
        lines.append(f"  J        {data['J']['before']:.3f} as drawn, {data['J']['after']:.3f} as negotiated")
    for k, row in enumerate(data["rounds"]):
        lines.append(f"  round {k:<2} Lambda {row['Lambda']:.4f}, gap {row['gap']:.4f}, {row['seconds']:.1f} s")
    return lines + files.line()


def _seen_from(place: Path, file: str) -> str:
    """A path as it is to be read from a folder; absolute where the two have no common root."""
    try:
        return os.path.relpath(os.path.realpath(file), os.path.realpath(place)).replace(os.sep, "/")
    except ValueError:  # another drive
        return os.path.abspath(file)
