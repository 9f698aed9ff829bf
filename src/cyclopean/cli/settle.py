"""`settle`: a rubble wall of stones as they were found."""

import os
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cyclopean.cli.outputs import STANDARD_OUTPUT, planned
from cyclopean.cli.terminal import long_work, say, say_json, warn
from cyclopean.cli.wall_options import named
from cyclopean.cli.workers import beside
from cyclopean.errors import InputError
from cyclopean.texts import choice, number, optional_number, whole

if TYPE_CHECKING:
    from cyclopean.design.rubble.places import Weights
    from cyclopean.design.rubble.settle import RubbleWall
    from cyclopean.design.stones.inventory import Inventory

__all__ = ["settle"]

LISTED = 6  # stones named one by one
MANY = 400  # stones beyond which a second process is worth its start
LENGTHS = "length", "height", "thickness", "cell", "margin", "band"
NUMBERS = "wythes", "yaws", "friction", "lean", "tries", "ways"
NAMED = {name: (f"--{name}", "") for name in LENGTHS + NUMBERS} | {"look_ahead": ("--look-ahead", "")}


def settle(
    stones: Annotated[
        str, typer.Argument(metavar="STONES", show_default=False, help="Folder of stones, or a file that holds them.")
    ],
    out: Annotated[str, typer.Option(metavar="MODEL", show_default=False, help="Model file to write.")],
    length: Annotated[str | None, typer.Option(metavar="L", help="Of the wall (m) [to suit the stones].")] = None,
    height: Annotated[
        str | None, typer.Option(metavar="L", help="No stone reaches higher (m) [as high as they go].")
    ] = None,
    thickness: Annotated[str | None, typer.Option(metavar="L", help="Of the wall (m) [to suit the stones].")] = None,
    wythes: Annotated[str, typer.Option(metavar="1|2", help="Stones side by side through the wall.")] = "1",
    look_ahead: Annotated[
        str, typer.Option("--look-ahead", metavar="N", help="Stones that compete for a place; 0: in their order.")
    ] = "8",
    margin: Annotated[
        str | None,
        typer.Option(
            metavar="L",
            help="Depth (m) of the centre of mass inside what bears a stone [1/20 of its size].",
        ),
    ] = None,
    friction: Annotated[str, typer.Option(metavar="M", help="Friction that is counted on while laying.")] = "0.6",
    lean: Annotated[
        str, typer.Option(metavar="DEG", help="Gravity may lean by so much, four ways, while laying.")
    ] = "4",
    yaws: Annotated[str, typer.Option(metavar="N", help="Turns about the vertical that are tried.")] = "8",
    weights: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=W,...",
            help="[support=2,centre=3,tilt=1.5,void=1,height=0.2,bond=0.5,face=0.5]",
            show_default=False,
        ),
    ] = None,
    hearting: Annotated[bool, typer.Option("--hearting", help="Small stones go into the hollows.")] = False,
    chinking: Annotated[bool, typer.Option("--chinking", help="Drive wedges under stones that would rock.")] = False,
    cell: Annotated[str | None, typer.Option(metavar="L", help="Of the height map (m) [1/20 of a stone].")] = None,
    ways: Annotated[
        str | None, typer.Option(metavar="N", help="Walls laid, of which the best is kept [4 of up to 32 stones].")
    ] = None,
    workers: Annotated[
        str | None, typer.Option(metavar="1|2", help="Processes [2 for several walls, and beyond 400 stones].")
    ] = None,
    units: Annotated[str | None, typer.Option(metavar="U", help="Unit of the stones' lengths, such as mm.")] = None,
    strict: Annotated[bool, typer.Option("--strict", help="A stone that cannot be used is an error.")] = False,
    json: Annotated[
        str | None, typer.Option(metavar="F|-", help="Write placements and figures; - prints them and nothing else.")
    ] = None,
    svg: Annotated[str | None, typer.Option(metavar="F", help="Draw the wall.")] = None,
) -> int:
    """Lay found stones, uncut, into a dry rubble wall that stands at every stage."""
    wanted: dict[str, Any] = {
        "length": optional_number("--length", length, above=0.0),
        "height": optional_number("--height", height, above=0.0),
        "thickness": optional_number("--thickness", thickness, above=0.0),
        "cell": optional_number("--cell", cell, above=0.0),
        "wythes": int(choice("--wythes", wythes, ("1", "2"))),
        "look_ahead": whole("--look-ahead", look_ahead),
        "yaws": whole("--yaws", yaws),
        "margin": optional_number("--margin", margin),
        "friction": number("--friction", friction),
        "lean": number("--lean", lean),
        "ways": None if ways is None else whole("--ways", ways),
        "hearting": hearting,
        "chinking": chinking,
    }
    count = None if workers is None else int(choice("--workers", workers, ("1", "2")))
    files = planned({"--out": out, "--json": json, "--svg": svg})
    for option, path in files.items():
        planned({option: str(path)}, keep=stones)
    if Path(out).suffix.lower() != ".json":
        raise InputError(f"--out {out}: unknown ending; use .json")

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the products are small: threads would wait for each other
    from cyclopean import io
    from cyclopean.design.rubble.settle import SettleSettings
    from cyclopean.design.rubble.settle import settle as build
    from cyclopean.design.rubble.wall import ways_of
    from cyclopean.io.settled import settled_dict

    with named(NAMED), long_work(f"laying {stones}") as stage:
        settings = SettleSettings(**wanted, weights=_weights(weights))
        inventory, said = io.read_stones(stones, units, strict)
        two = ways_of(settings, len(inventory)) > 1 or len(inventory) > MANY
        with beside((count or 1 + two) - 1) as executor:
            wall = build(inventory, settings, stage, executor)
    for warning in (*said, *inventory.notes):
        warn(warning)
    there = Path(json if "--json" in files and json else out).absolute().parent
    data = settled_dict(
        wall,
        inventory,
        stones_path=os.path.relpath(stones, there),
        model_path=os.path.relpath(out, there),
        units=units,
    )
    with io.together():
        if "--svg" in files:
            from cyclopean.view.rubble_drawing import rubble_svg

            io.write_text(files["--svg"], rubble_svg(wall.assembly, Path(stones).name))
        io.write_model(files["--out"], wall.assembly)
        if "--json" in files:
            io.write_json(files["--json"], data)
    if json == STANDARD_OUTPUT:
        say_json(data)
    else:
        say("\n".join(_lines(wall, inventory, files)))
    return 0


def _weights(text: str | None) -> "Weights":
    """Read NAME=W,...; what is not named keeps its weight.

    Raises
    ------
    InputError
        No such name, a name twice, or no number of at least 0.
    """
    from cyclopean.design.rubble.places import Weights

    given: dict[str, float] = {}
    known = [field.name for field in fields(Weights)]
    for part in [] if text is None else text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or name not in known:
            raise InputError(f"--weights: '{part}' should be NAME=W with one of {', '.join(known)}")
        if name in given:
            raise InputError(f"--weights: '{name}' stands twice")
        given[name] = number(f"--weights {name}", value)
        if not given[name] >= 0.0:
            raise InputError(f"--weights {name}: {given[name]:g} is less than 0")
    return Weights(**given)


def _lines(wall: "RubbleWall", inventory: "Inventory", files: dict[str, Path]) -> list[str]:
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
    lines.append(f"  written   {', '.join(str(path) for path in files.values())}")
    return lines


def _some(names: list[str]) -> str:
    return ", ".join(names[:LISTED]) + (f" and {len(names) - LISTED} more" if len(names) > LISTED else "")
