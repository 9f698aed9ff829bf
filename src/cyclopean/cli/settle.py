"""`settle`: a rubble wall of stones as they were found."""

import os
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopean.api.inputs import StoneReading, inventory_of
from cyclopean.cli.command import argument, command, some, written
from cyclopean.cli.outputs import Files
from cyclopean.cli.terminal import long_work, warn
from cyclopean.cli.workers import beside
from cyclopean.design.rubble.places import Scores
from cyclopean.design.rubble.wall import SettleSettings
from cyclopean.errors import InputError
from cyclopean.options import Option
from cyclopean.texts import scores as read_scores

if TYPE_CHECKING:
    from cyclopean.design.rubble.wall import RubbleWall
    from cyclopean.design.stones.inventory import Inventory

__all__ = ["settle"]

LISTED = 6  # stones named one by one
MANY = 400  # stones beyond which a second process is worth its start
TAKEN = (
    "length height thickness wythes batter corner opening ends coursed through hearting pins copes inward dress all"
    " look_ahead margin friction lean yaws cell"
)


@command(
    friction="is --mu now, as everywhere",
    weights="is --scores now; weights are those of forces, as in check",
    chinking="is --pins now: stones that would rock are steadied with small ones of the stock",
    ways="is gone: one wall is laid, and better",
)
def settle(
    stones: Annotated[str, argument("STONES", "Folder of stones, or a file that holds them.", source=True)],
    files: Annotated[
        Files,
        written(
            out=("MODEL", "Required: Model file to write."),
            json=("F|-", "Write placements and figures; - prints them and nothing else."),
            report=("F", "Write a page: pictures, measures, and every stone."),
            svg=("F", "Draw the wall from all sides, and cut."),
        ),
    ],
    settings: Annotated[SettleSettings, some(TAKEN)] = SettleSettings(),
    scores: Annotated[
        str | None,
        Option("[" + ",".join(f"{name}={value:g}" for name, value in asdict(Scores()).items()) + "]", metavar="NAME=W,..."),
    ] = None,
    workers: Annotated[
        int | None, Option("Processes [2 for several walls, and beyond 400 stones].", "whole", choices=("1", "2"))
    ] = None,
    reading: StoneReading = StoneReading(),
) -> int:
    """Lay found stones, uncut, into a dry rubble wall that stands at every stage."""
    out = files.to["out"]
    if out.suffix.lower() != ".json":
        raise InputError(f"`out` {out}: unknown ending; use .json")
    if scores is not None:
        given = read_scores("`scores`", scores, tuple(asdict(settings.scores)))
        settings = replace(settings, scores=replace(settings.scores, **given))

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the products are small: threads would wait for each other
    from cyclopean import io
    from cyclopean.design.rubble.settle import settle as build
    from cyclopean.io.settled import settled_dict
    from cyclopean.view.rubble_drawing import rubble_svg
    from cyclopean.view.settled_page import settled_page, told_of

    with long_work(f"laying {stones}") as stage:
        inventory, said = inventory_of(stones, reading)
        two = ways_of(settings, len(inventory)) > 1 or len(inventory) > MANY
        with beside((workers or 1 + two) - 1) as executor:
            wall = build(inventory, settings, stage, executor)
    for warning in (*said, *inventory.notes):
        warn(warning)
    there = files.to.get("json", out).absolute().parent
    data = settled_dict(
        wall,
        inventory,
        stones_path=os.path.relpath(stones, there),
        model_path=os.path.relpath(out, there),
        units=reading.units,
    )
    files.write(
        {
            "svg": lambda: rubble_svg(wall.assembly, Path(stones).name, told=told_of(wall)),
            "report": lambda: settled_page(wall, inventory),
            "out": lambda: lambda file: io.write_model(file, wall.assembly),
            "json": lambda: data,
        }
    )
    files.tell(data, _lines(wall, inventory, files))
    return 0


def _lines(wall: "RubbleWall", inventory: "Inventory", files: Files) -> list[str]:
    """Say what came out."""
    m = wall.measures
    left = [inventory.stones[k].id for k in wall.left_over.tolist()]
    lines = [
        f"settled {len(wall.laid)} of {len(inventory)} stones in {m.courses} courses:"
        f" {m.length:.2f} m long, {m.thickness:.2f} m thick, {m.height:.2f} m high",
        f"  stands    at every stage with friction {wall.settings.friction:g} and gravity leaning by"
        f" {wall.settings.lean:g} degrees; {m.stable:.0%} of the stones sit in it",
        f"  void      {m.void:.0%} between the faces, {m.hollow:.0%} below the stones' own tops",
        f"  overlap   at most {m.overlap:.1e} of a stone",
    ]
    if wall.wedges:
        lines.append(f"  wedges    {wall.wedges}")
    if left:
        lines.append(f"  put aside {_some(left)}")
    return lines + files.line(wide=8)


def _some(names: list[str]) -> str:
    return ", ".join(names[:LISTED]) + (f" and {len(names) - LISTED} more" if len(names) > LISTED else "")
