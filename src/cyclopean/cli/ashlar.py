"""`ashlar` and `pack`: walls of sawn stones."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cyclopean.cli import wall_options
from cyclopean.cli.outputs import STANDARD_OUTPUT, planned
from cyclopean.cli.terminal import long_work, say, say_json, warn
from cyclopean.errors import InputError
from cyclopean.texts import choice, number, numbers, optional_number, whole

if TYPE_CHECKING:
    from cyclopean.design.ashlar.best_fit import Packed
    from cyclopean.design.ashlar.planning import AshlarSettings
    from cyclopean.design.ashlar.stock import Slab
    from cyclopean.design.ashlar.wall import AshlarWall

__all__ = ["ashlar", "pack"]

BONDS = ("running", "stack", "third", "english", "flemish")
STONE = re.compile(r"(?P<length>[^x*]+)x(?P<height>[^x*]+)x(?P<depth>[^x*]+)(\*(?P<count>[^x*]+))?")
FIELDS = {
    **wall_options.FIELDS,
    **{name: (f"--{name}", "") for name in (
        "bond", "depth", "height", "unit", "leaves", "through", "stagger", "bed", "head", "kerf", "least", "method",
        "slots", "weights", "density", "mu",
    )},
    "length": ("--width", ""),
    "course": ("--courses", ""),
    "tolerance": ("--height-tolerance", ""),
    "openings": ("--opening", ""),
    "least score": ("--least-score", ""),
    "stock": ("STONES", ""),
}  # fmt: skip

Stones = Annotated[
    str | None,
    typer.Argument(metavar="STONES", show_default=False, help="Stock list (CSV), or a folder or file of sawn stones."),
]
Stone = Annotated[
    list[str] | None,
    typer.Option("--stone", metavar="LxHxD[*N]", help="N stones of this length, height, depth (m); repeatable."),
]
Width = Annotated[str, typer.Option(metavar="L", show_default=False, help="Length of the wall (m).")]
Height = Annotated[str, typer.Option(metavar="L", show_default=False, help="Of the wall (m).")]
Depth = Annotated[str, typer.Option(metavar="L", show_default=False, help="Thickness of the wall (m).")]
Out = Annotated[str, typer.Option(metavar="MODEL", show_default=False, help="Model file to write.")]
Bond = Annotated[str, typer.Option(metavar="|".join(BONDS), help="Where the head joints lie.")]
Courses = Annotated[
    str,
    typer.Option(metavar="fixed[:H]|bins", help="One height (m) [that of most stones], or bins, the tallest below."),
]
HeightTolerance = Annotated[
    str, typer.Option(metavar="L", help="Heights (m) that differ by less are dressed to one course.")
]
Unit = Annotated[str | None, typer.Option(metavar="L", help="Length of a stone (m) [that of most].")]
Leaves = Annotated[str | None, typer.Option(metavar="1|2", help="Leaves of the wall [as the bond has it].")]
Through = Annotated[str, typer.Option(metavar="N", help="A stone through both leaves at every N-th; 0 none.")]
Stagger = Annotated[str, typer.Option(metavar="S", help="running: share of a stone with which odd courses begin.")]
Bed = Annotated[str, typer.Option(metavar="L", help="Thickness of bed joints (m).")]
Head = Annotated[str, typer.Option(metavar="L", help="Width of head joints (m).")]
Openings = Annotated[
    list[str] | None,
    typer.Option(
        "--opening", metavar="X,Z,W,H", help="Left jamb, sill, clear width and height (m), under a lintel; repeatable."
    ),
]
NoYaw = Annotated[bool, typer.Option("--no-yaw", help="Never turn a stone by 90 degrees.")]
Kerf = Annotated[str, typer.Option(metavar="L", help="Width that a cut takes (m).")]
Least = Annotated[str, typer.Option(metavar="L", help="Shortest stone (m); what is shorter is chips.")]
Density = Annotated[str | None, typer.Option(metavar="D", help="kg/m3 where a stone does not say it.")]
Mu = Annotated[str | None, typer.Option(metavar="M", help="Friction coefficient of every contact.")]
Units = Annotated[str | None, typer.Option(metavar="U", help="Unit of the lengths in mesh files, such as mm.")]
Strict = Annotated[bool, typer.Option("--strict", help="A stone that cannot be used is an error.")]
Cutlist = Annotated[str | None, typer.Option(metavar="F", help="Write the cut list (CSV).")]
Left = Annotated[str | None, typer.Option(metavar="F", help="Write what is left in store (CSV).")]
Svg = Annotated[str | None, typer.Option(metavar="F", help="Draw the face and the plans of two courses.")]
Display = Annotated[str | None, typer.Option(metavar="MODEL", help="Also write the stones as sawn, joints open.")]
Json = Annotated[
    str | None, typer.Option(metavar="F|-", help="Write placements and figures; - prints them and nothing else.")
]


def ashlar(
    width: Width,
    height: Height,
    depth: Depth,
    out: Out,
    stones: Stones = None,
    stone: Stone = None,
    bond: Bond = "running",
    courses: Courses = "fixed",
    height_tolerance: HeightTolerance = "0.002",
    unit: Unit = None,
    leaves: Leaves = None,
    through: Through = "0",
    stagger: Stagger = "0.5",
    bed: Bed = "0",
    head: Head = "0",
    opening: Openings = None,
    no_yaw: NoYaw = False,
    kerf: Kerf = "0",
    least: Least = "0.05",
    density: Density = None,
    mu: Mu = None,
    units: Units = None,
    strict: Strict = False,
    cutlist: Cutlist = None,
    left: Left = None,
    svg: Svg = None,
    display: Display = None,
    json: Json = None,
) -> int:
    """Build a wall of sawn stones in a bond."""
    given = dict(locals())
    settings, files = _asked(given)

    from cyclopean.design.ashlar import wall as room

    with long_work("building a wall of sawn stones"), wall_options.named(FIELDS):
        slabs, said = _slabs(stones, stone, units, strict)
        wall = room.ashlar(settings, slabs)
    return _end(wall, said, files, json, {"method": "first", "slots": "bond"}, [])


def pack(
    width: Width,
    height: Height,
    depth: Depth,
    out: Out,
    stones: Stones = None,
    stone: Stone = None,
    method: Annotated[
        str, typer.Option(metavar="best|first|global", help="Slot by slot the best or first fit, or all together.")
    ] = "best",
    slots: Annotated[
        str | None,
        typer.Option(metavar="free|bond", help="At the lengths of the stones, or of the bond [free, if it can be]."),
    ] = None,
    weights: Annotated[
        str, typer.Option(metavar="L,D,H,A", help="Of the fits of length, depth, height, length over height.")
    ] = "0.4,0.2,0.2,0.2",
    least_score: Annotated[
        str, typer.Option(metavar="S", help="Where no stone scores this, the first that fits is taken.")
    ] = "0.5",
    compare: Annotated[bool, typer.Option("--compare", help="Tell what the other methods make of the slots.")] = False,
    bond: Bond = "running",
    courses: Courses = "fixed",
    height_tolerance: HeightTolerance = "0.002",
    unit: Unit = None,
    leaves: Leaves = None,
    through: Through = "0",
    stagger: Stagger = "0.5",
    bed: Bed = "0",
    head: Head = "0",
    opening: Openings = None,
    no_yaw: NoYaw = False,
    kerf: Kerf = "0",
    least: Least = "0.05",
    density: Density = None,
    mu: Mu = None,
    units: Units = None,
    strict: Strict = False,
    cutlist: Cutlist = None,
    left: Left = None,
    svg: Svg = None,
    display: Display = None,
    json: Json = None,
) -> int:
    """Build a wall of the sawn stones that fit best."""
    given = dict(locals())
    settings, files = _asked(given)
    known = settings.bond != "running" or settings.through > 0 or method == "global"
    where = choice("--slots", slots, ("free", "bond")) if slots is not None else "bond" if known else "free"
    values = numbers("--weights", weights)
    if len(values) != 4:
        raise InputError(f"--weights: '{weights}' should be four numbers L,D,H,A")
    enough = number("--least-score", least_score)

    from cyclopean.design.ashlar import best_fit as room

    with long_work("packing a wall of sawn stones") as stage, wall_options.named(FIELDS):
        shares = room.Weights(*values)
        slabs, said = _slabs(stones, stone, units, strict)
        options: dict[str, Any] = {"weights": shares, "least_score": enough}
        done = room.pack(settings, slabs, method=method, slots=where, **options)
        tried: list[Packed] = []
        for other in room.METHODS if compare else ():
            stage(other)
            tried.append(room.pack(settings, slabs, method=other, slots="bond", **options))
    asked = {
        "method": method, "slots": where, "weights": values, "least_score": enough, "mean_score": done.mean,
        "poor": done.poor, "compare": [_compared(one) for one in tried],
    }  # fmt: skip
    lines = [f"  score    {done.mean:.3f} in the mean; {done.poor} of {len(done.wall.laid)} below {enough:g}"]
    lines += [f"  {one.method:<8} in the slots of the bond: {_told(one)}" for one in tried]
    return _end(done.wall, said, files, json, asked, lines)


def _asked(given: dict[str, Any]) -> "tuple[AshlarSettings, dict[str, Path]]":
    """Settings and output files from the options as typed.

    Raises
    ------
    InputError
        Names the option.
    """
    files = planned(
        {f"--{name}": given[name] for name in ("out", "cutlist", "left", "svg", "display", "json")},
        keep=given["stones"],
        models=("--out", "--display"),
    )
    table = given["stones"] is None or given["stones"].lower().endswith(".csv")
    if table and given["units"] is not None:
        raise InputError("--units: a stock list and --stone are in metres; leave it out")
    kind, colon, high = given["courses"].partition(":")
    choice("--courses", kind, ("fixed", "bins"))
    if colon and kind == "bins":
        raise InputError(f"--courses: '{given['courses']}' should be fixed, fixed:H or bins")
    wanted: dict[str, Any] = {
        "length": number("--width", given["width"]),
        "bond": choice("--bond", given["bond"], BONDS),
        "course": number("--courses", high) if colon else None,
        "bins": kind == "bins",
        "tolerance": number("--height-tolerance", given["height_tolerance"]),
        "leaves": None if given["leaves"] is None else whole("--leaves", given["leaves"]),
        "through": whole("--through", given["through"]),
        "yaw": not given["no_yaw"],
        **{name: number(f"--{name}", given[name]) for name in (
            "height", "depth", "stagger", "bed", "head", "kerf", "least"
        )},
        **{name: optional_number(f"--{name}", given[name], above=0.0) for name in ("unit", "density")},
        "mu": optional_number("--mu", given["mu"], least=0.0),
    }  # fmt: skip

    from cyclopean.design.ashlar.planning import AshlarSettings

    with wall_options.named(FIELDS):
        openings = tuple(wall_options.opening("--opening", text) for text in given["opening"] or ())
        return AshlarSettings(**wanted, openings=openings), files


def _slabs(
    stones: str | None, stone: list[str] | None, units: str | None, strict: bool
) -> "tuple[list[Slab], tuple[str, ...]]":
    """The stock, from wherever it is given, and what is to be said of it.

    Raises
    ------
    InputError
        There is none, it cannot be read, or nothing in it is a sawn stone.
    """
    from cyclopean import io
    from cyclopean.design.ashlar.stock import slabs_of
    from cyclopean.io.stocklist import MOST, read_stocklist

    if stones is None and not stone:
        raise InputError("STONES: no stock given; name a stock list or stones, or use --stone")
    found: list[Slab] = []
    warnings: tuple[str, ...] = ()
    if stones is not None and stones.lower().endswith(".csv"):
        found += read_stocklist(stones)
    elif stones is not None:
        inventory, said = io.read_stones(stones, units, strict)
        boxes, notes = slabs_of(inventory.stones)
        if not boxes or (strict and notes):
            raise InputError(f"{stones}: {notes[0] if boxes else 'none of its stones is a box'}")
        warnings = (*said, *inventory.notes, *notes)
        found += boxes
    for text in stone or ():
        found += _typed(text, len(found))
        if len(found) > MOST:
            raise InputError(f"--stone: more than {MOST:,} stones; give fewer")
    return found, warnings


def _typed(text: str, before: int) -> "list[Slab]":
    from cyclopean.io.stocklist import MOST, repeated

    parts = STONE.fullmatch(text)
    if parts is None:
        raise InputError(f"--stone: '{text}' should be LxHxD or LxHxD*N, such as 0.3x0.15x0.2*30")
    length, high, deep = (number("--stone", parts[name]) for name in ("length", "height", "depth"))
    count = 1 if parts["count"] is None else whole("--stone", parts["count"])
    if not (min(length, high, deep) > 0.0 and 0 < count <= MOST):
        raise InputError(f"--stone: '{text}' should have sizes above 0, and be 1 to {MOST:,} times")
    return repeated("", (length, deep, high), count, before)


def _compared(one: "Packed") -> dict[str, Any]:
    out = one.wall.readout
    used = sum(slab.volume for slab in one.wall.stock.slabs) - out.left
    return {
        "method": one.method, "mean_score": one.mean, "poor": one.poor, "blocks": out.blocks, "cuts": out.cuts,
        "coverage": out.coverage, "used": used, "offcuts": out.off, "lost": out.lost,
    }  # fmt: skip


def _told(one: "Packed") -> str:
    out = one.wall.readout
    return (
        f"score {one.mean:.3f}, {out.cuts} cuts, {len(one.wall.stock.slabs) - out.leftover} slabs used,"
        f" {1e3 * out.off:.1f} L of offcuts, {1e3 * out.lost:.1f} L lost"
    )


def _end(
    wall: "AshlarWall",
    said: tuple[str, ...],
    files: "dict[str, Path]",
    json: str | None,
    asked: dict[str, Any],
    lines: list[str],
) -> int:
    """Write everything, and say what came out."""
    from cyclopean import io
    from cyclopean.io.stocklist import ashlar_cutlist_csv, ashlar_dict, left_csv

    texts: dict[str, str] = {}
    if "--svg" in files:
        from cyclopean.view.ashlar_drawing import ashlar_svg

        texts["--svg"] = ashlar_svg(wall, wall.assembly.name) + "\n"
    texts |= {"--cutlist": ashlar_cutlist_csv(wall), "--left": left_csv(wall)}
    data = ashlar_dict(wall, asked)
    with io.together():
        io.write_model(files["--out"], wall.assembly)
        for option, text in texts.items():
            if option in files:
                io.write_text(files[option], text)
        if "--display" in files:
            from cyclopean.assembly import Assembly, Contacts
            from cyclopean.design.ashlar.wall import open_stones

            shown = Assembly(open_stones(wall), Contacts.of([], []), name=f"{wall.assembly.name}, as sawn")
            io.write_model(files["--display"], shown)
        if "--json" in files:
            io.write_json(files["--json"], data)
    for note in (*said, *wall.notes):
        warn(note)
    if json == STANDARD_OUTPUT:
        say_json(data)
    else:
        say("\n".join([*_lines(wall), *lines, f"  written  {', '.join(map(str, files.values()))}"]))
    return 0


def _lines(wall: "AshlarWall") -> list[str]:
    """Say what came out."""
    out, settings = wall.readout, wall.settings
    contacts = 0 if wall.assembly.contacts is None else len(wall.assembly.contacts)
    through = f", {out.through} through the wall" if out.through else ""
    lap = "" if out.least_lap == float("inf") else f", joints {out.least_lap:.3g} m apart or more"
    return [
        f"{wall.assembly.name}: {out.courses} courses, {out.blocks} stones{through}, {contacts} contacts",
        f"  coverage {out.coverage:.6g} of the face{' less its openings' if settings.openings else ''}",
        f"  bond     J {out.score:.3f}, {out.aligned} aligned head joints{lap}",
        f"  sawing   {out.cuts} cuts, {out.cut} stones that are parts of slabs, {out.turned} turned",
        f"  stock    {1e3 * out.stock:.1f} L = {1e3 * out.placed:.1f} L laid + {1e3 * out.left:.1f} L in {out.leftover}"
        f" slabs left + {1e3 * out.off:.1f} L in {out.offcuts} offcuts + {1e3 * out.lost:.1f} L lost",
    ]
