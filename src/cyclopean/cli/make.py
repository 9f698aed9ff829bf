"""`make`: parametric models with exact contacts."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cyclopean.cli import wall_options
from cyclopean.cli.outputs import planned
from cyclopean.cli.plain import PlainCommand, PlainGroup
from cyclopean.cli.quarry import stones
from cyclopean.cli.terminal import say
from cyclopean.errors import InputError
from cyclopean.texts import choice, number, numbers, optional_number, vector, whole

if TYPE_CHECKING:
    from pathlib import Path

    from cyclopean.assembly import Assembly, Block
    from cyclopean.design.walls.corner import CornerWall
    from cyclopean.design.walls.improve import Chosen
    from cyclopean.design.walls.interlock import Interlock
    from cyclopean.design.walls.joints import JointReadout
    from cyclopean.design.walls.pattern import Pattern
    from cyclopean.design.walls.polygonal import PolygonalWall

__all__ = ["commands"]

MOST_STONES = 50_000  # of a polygonal wall, which are drawn one by one
MOST = 1_000_000  # blocks, or facets of them, in a model that is made: more do not fit into a common memory

Out = Annotated[str, typer.Option(metavar="MODEL", show_default=False, help="Model file to write.")]
Mu = Annotated[str | None, typer.Option(metavar="M", help="Friction coefficient of every contact.")]
Density = Annotated[str | None, typer.Option(metavar="D", help="Density of every block, kg/m3.")]
Radius = Annotated[str, typer.Option(metavar="L", help="Radius of the middle surface (m).")]
Thickness = Annotated[str, typer.Option(metavar="L", help="Radial thickness (m).")]

commands = typer.Typer(
    cls=PlainGroup,
    help="Make a stack, wall, arch, vault, dome, polygonal wall, or synthetic stones.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _argument(name: str, text: str) -> Any:
    return typer.Argument(metavar=name, show_default=False, help=text)


@commands.command(cls=PlainCommand)
def stack(
    count: Annotated[str, _argument("COUNT", "Number of blocks.")],
    out: Out,
    size: Annotated[str, typer.Option(metavar="X,Y,Z", help="Of each block (m).")] = "1,1,1",
    offset: Annotated[
        str, typer.Option(metavar="L[,L...]", help="Shift (m) along x of each block over the one below, or of all.")
    ] = "0",
    slope: Annotated[str, typer.Option(metavar="DEG", help="Slope of the ground, falling towards +x.")] = "0",
    ground: Annotated[bool, typer.Option("--ground/--no-ground", help="Put a fixed slab below.")] = True,
    density: Density = None,
    mu: Mu = None,
) -> int:
    """Make blocks on top of each other."""
    shifts = numbers("--offset", offset)
    options = {
        "offset": shifts[0] if len(shifts) == 1 else shifts,
        "slope": number("--slope", slope),
        "ground": ground,
    }
    return _make("stack", (whole("COUNT", count), vector("--size", size)), options, out, density, mu)


@commands.command(cls=PlainCommand)
def wall(
    columns: Annotated[str, _argument("COLUMNS", "Whole blocks in a course.")],
    courses: Annotated[str, _argument("COURSES", "Number of free courses.")],
    out: Out,
    length: Annotated[str, typer.Option(metavar="L", help="Of a block, along x (m).")] = "0.4",
    depth: Annotated[str, typer.Option(metavar="L", help="Of a block, along y (m).")] = "0.2",
    height: Annotated[str, typer.Option(metavar="L", help="Of a block (m).")] = "0.2",
    ground: Annotated[str, typer.Option(metavar="slab|course", help="What it stands on.")] = "slab",
    density: Density = None,
    mu: Mu = None,
) -> int:
    """Make a running-bond wall."""
    options = {
        "length": number("--length", length),
        "depth": number("--depth", depth),
        "height": number("--height", height),
        "ground": choice("--ground", ground, ("slab", "course")),
    }
    return _make("wall", (whole("COLUMNS", columns), whole("COURSES", courses)), options, out, density, mu)


@commands.command(cls=PlainCommand)
def arch(
    voussoirs: Annotated[str, _argument("VOUSSOIRS", "Number of voussoirs.")],
    out: Out,
    span: Annotated[str | None, typer.Option(metavar="L", help="Clear span (m) [10, if no radius is given].")] = None,
    rise: Annotated[str | None, typer.Option(metavar="L", help="Of the inner crown (m) [half the span].")] = None,
    radius: Annotated[
        str | None, typer.Option(metavar="L", help="Of the centre line of a semicircle (m), instead of the span.")
    ] = None,
    thickness: Thickness = "0.8",
    depth: Annotated[str, typer.Option(metavar="L", help="Along y (m).")] = "1",
    springers: Annotated[
        str, typer.Option(metavar="wedges|fixed", help="Stand on fixed wedges, or fix the first and last voussoir.")
    ] = "wedges",
    facets: Annotated[str, typer.Option(metavar="N", help="Chords for the curve of each voussoir.")] = "1",
    density: Density = None,
    mu: Mu = None,
) -> int:
    """Make a circular arch."""
    options = {
        "span": optional_number("--span", span),
        "rise": optional_number("--rise", rise),
        "radius": optional_number("--radius", radius),
        "thickness": number("--thickness", thickness),
        "depth": number("--depth", depth),
        "springers": choice("--springers", springers, ("wedges", "fixed")),
        "facets": whole("--facets", facets),
    }
    return _make("arch", (whole("VOUSSOIRS", voussoirs),), options, out, density, mu)


@commands.command(cls=PlainCommand)
def vault(
    voussoirs: Annotated[str, _argument("VOUSSOIRS", "Rows from springing to springing.")],
    columns: Annotated[str, _argument("COLUMNS", "Whole blocks in a row.")],
    out: Out,
    radius: Radius = "1",
    thickness: Thickness = "0.2",
    length: Annotated[
        str | None, typer.Option(metavar="L", help="Of the barrel (m) [blocks twice as long as wide].")
    ] = None,
    density: Density = None,
    mu: Mu = None,
) -> int:
    """Make a barrel vault."""
    options = {
        "radius": number("--radius", radius),
        "thickness": number("--thickness", thickness),
        "length": optional_number("--length", length),
    }
    return _make("vault", (whole("VOUSSOIRS", voussoirs), whole("COLUMNS", columns)), options, out, density, mu)


@commands.command(cls=PlainCommand)
def dome(
    courses: Annotated[str, _argument("COURSES", "Rings from the springing to the oculus.")],
    segments: Annotated[str, _argument("SEGMENTS", "Blocks in a ring.")],
    out: Out,
    radius: Radius = "1",
    thickness: Thickness = "0.15",
    oculus: Annotated[
        str, typer.Option(metavar="DEG", help="Half the opening angle at the top, from the axis.")
    ] = "10",
    density: Density = None,
    mu: Mu = None,
) -> int:
    """Make a hemispherical dome."""
    options = {
        "radius": number("--radius", radius),
        "thickness": number("--thickness", thickness),
        "oculus": number("--oculus", oculus),
    }
    return _make("dome", (whole("COURSES", courses), whole("SEGMENTS", segments)), options, out, density, mu)


@commands.command(cls=PlainCommand)
def polygonal(
    out: Out,
    width: Annotated[str, typer.Option(metavar="L", help="Along the foot (m).")] = "3",
    height: Annotated[str, typer.Option(metavar="L", help="Up the face (m).")] = "1.8",
    columns: Annotated[str, typer.Option(metavar="N", help="Stones in a row, before culling.")] = "8",
    rows: Annotated[str, typer.Option(metavar="N", help="Rows of stones.")] = "5",
    depth: Annotated[str, typer.Option(metavar="L", help="Thickness at the foot (m).")] = "0.2",
    batter: Annotated[str, typer.Option(metavar="B", help="How far the front recedes, m a metre.")] = "0",
    seed: Annotated[str, typer.Option(metavar="N", help="Another seed, another wall.")] = "7",
    jitter: Annotated[str, typer.Option(metavar="S", help="Irregularity of the seeds, 0 to 0.5.")] = "0.25",
    lloyd: Annotated[str, typer.Option(metavar="N", help="Rounds of evening out.")] = "2",
    coursing: Annotated[str, typer.Option(metavar="C", help="0 irregular to 1 level courses.")] = "0.4",
    courses: Annotated[str | None, typer.Option(metavar="N", help="Number of courses [as many as rows].")] = None,
    size_grade: Annotated[str, typer.Option(metavar="S", help="Spread of the stones' sizes.")] = "0.3",
    sliver: Annotated[str, typer.Option(metavar="S", help="Stones thinner than this share are culled.")] = "0.18",
    opening: Annotated[
        list[str] | None,
        typer.Option(metavar="X,Z,W,H[,lintel|arch]", help="Left jamb, sill, clear width and height (m); repeatable."),
    ] = None,
    quoins: Annotated[
        str | None, typer.Option(metavar="LONG,SHORT[,H]|auto", help="Corner stones at both ends (m).")
    ] = None,
    coping: Annotated[str | None, typer.Option(metavar="H[,L]|auto", help="A row of stones on top (m).")] = None,
    base: Annotated[
        str | None, typer.Option(metavar="U:V,...|radius:R", help="Line of the ground (m), or its radius.")
    ] = None,
    surface: Annotated[
        str,
        typer.Option(
            metavar="plane|cylinder:R|cone:R[,DEG]|sphere:R[,DEG]|twist:DEG",
            help="What the wall lies on; R < 0 is hollow. DEG: lean of a cone, latitude of a sphere's foot.",
        ),
    ] = "plane",
    corner: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Of a second wall (m) that turns back at the right end, bonded by quoins."),
    ] = None,
    warped: Annotated[
        str, typer.Option(metavar="auto|triangles|plane", help="What becomes of joints that are not flat.")
    ] = "auto",
    improve: Annotated[
        str | None, typer.Option(metavar="J", help="J: move stones until they interlock better.")
    ] = None,
    display: Annotated[
        str | None, typer.Option(metavar="MODEL", help="Also write the stones with open joints, for pictures.")
    ] = None,
    gap: Annotated[str, typer.Option(metavar="L", help="Width of those open joints (m).")] = "0.01",
    chamfer: Annotated[str, typer.Option(metavar="L", help="Bevel along the front edges of those stones (m).")] = "0",
    density: Density = None,
    mu: Mu = None,
) -> int:
    """Make a wall of polygonal stones, flat or curved, or two round a corner."""
    paths = planned({"--out": out, "--display": display}, models=("--out", "--display"))
    deep = number("--depth", depth)
    line, radius = wall_options.base("--base", base)
    pattern: dict[str, Any] = {
        "width": number("--width", width),
        "height": number("--height", height),
        "columns": whole("--columns", columns),
        "rows": whole("--rows", rows),
        "seed": whole("--seed", seed),
        "jitter": number("--jitter", jitter),
        "lloyd": whole("--lloyd", lloyd),
        "coursing": number("--coursing", coursing),
        "courses": whole("--rows", rows) if courses is None else whole("--courses", courses),
        "size_grade": number("--size-grade", size_grade),
        "sliver": number("--sliver", sliver),
        "base": line,
        "base_radius": radius,
    }
    length = optional_number("--corner", corner)
    if abs(pattern["columns"] * pattern["rows"]) > MOST_STONES or abs(pattern["courses"]) > MOST_STONES:
        raise InputError(f"make polygonal: more than {MOST_STONES:,} stones or courses; ask for fewer")
    options: dict[str, Any] = {
        "depth": deep,
        "density": optional_number("--density", density, above=0.0),
        "mu": optional_number("--mu", mu, least=0.0),
        "improve": improve is not None and choice("--improve", improve, ("J",)) == "J",
    }
    only_flat = {
        "surface": surface,
        "batter": number("--batter", batter),
        "warped": choice("--warped", warped, ("auto", "triangles", "plane")),
    }
    apart = {"gap": number("--gap", gap), "chamfer": number("--chamfer", chamfer)}
    with wall_options.named():
        pattern["openings"] = tuple(wall_options.opening("--opening", text) for text in opening or ())
        pattern["quoins"] = wall_options.quoins("--quoins", quoins, None if length is None else deep)
        pattern["coping"] = wall_options.coping("--coping", coping)
        if length is None:
            return _flat_or_curved(pattern, only_flat, options, paths, apart)
        return _cornered(pattern, length, only_flat, options, paths, apart)


def _flat_or_curved(
    pattern: dict[str, Any],
    lying: dict[str, Any],
    options: dict[str, Any],
    paths: "dict[str, Path]",
    apart: dict[str, float],
) -> int:
    """Make one wall, write it, and say what came out."""
    from cyclopean.design.walls.interlock import interlock
    from cyclopean.design.walls.joints import with_open_joints
    from cyclopean.design.walls.pattern import PatternSettings
    from cyclopean.design.walls.polygonal import polygonal_wall

    lying["surface"] = wall_options.surface("--surface", lying["surface"], pattern["width"], pattern["height"])
    made = polygonal_wall(PatternSettings(**pattern), **lying, **options)
    shown = with_open_joints(made.pattern, made.surface, made.thickness, **apart) if "--display" in paths else None
    _write(made.assembly, shown, paths, made)
    readout = made.pattern.readout
    _say_made(made.assembly)
    say(f"cells      {readout.cells}")
    say(f"coverage   {readout.coverage:.12g}")
    say(f"area CV    {readout.area_cv:.3f}")
    say(f"culled     {readout.culled}")
    say(f"crossings  {readout.crossings}")
    say(f"J          {_rated(interlock(made.pattern, depth=made.thickness.depth))}")
    _say_end(made, paths)
    return 0


def _cornered(
    pattern: dict[str, Any],
    length: float,
    lying: dict[str, Any],
    options: dict[str, Any],
    paths: "dict[str, Path]",
    apart: dict[str, float],
) -> int:
    """Make two walls that meet at a corner, write them, and say what came out."""
    for name, usual in (("surface", "plane"), ("batter", 0.0), ("warped", "auto")):
        if lying[name] != usual:
            raise InputError(f"{name}: walls that meet at a corner are flat and upright; leave it out, or --corner")

    from cyclopean.design.walls.corner import corner_wall, corner_with_open_joints, joint_score
    from cyclopean.design.walls.pattern import PatternSettings

    settings = PatternSettings(**pattern)
    if not settings.columns * settings.rows * (1.0 + length / settings.width) <= MOST_STONES:
        raise InputError(f"corner: more than {MOST_STONES:,} stones; ask for fewer")
    made = corner_wall(settings, length, **options)
    _write(made.assembly, corner_with_open_joints(made, **apart) if "--display" in paths else None, paths)
    _say_made(made.assembly)
    say(f"cells      {len(made.assembly) - 1}, {len(made.corner)} of them in both walls")
    for k, one in enumerate(made.patterns, 1):
        say(f"wall {k}     {_summed(one, made.thickness.depth)}")
    say(f"crossings  {sum(one.readout.crossings for one in made.patterns)}")
    say(f"J          {joint_score(made):.3f}")
    _say_end(made, paths)
    return 0


def _write(
    model: "Assembly",
    shown: "tuple[Block, ...] | None",
    paths: "dict[str, Path]",
    drawn: "PolygonalWall | None" = None,
) -> None:
    """Write the wall with how it was drawn, and what it looks like with open joints."""
    from cyclopean import io
    from cyclopean.assembly import Assembly, Contacts

    with io.together():
        io.write_model(paths["--out"], model, drawing=None if drawn is None else io.drawing_dict(drawn))
        if shown is not None:
            io.write_model(paths["--display"], Assembly(shown, Contacts.of([], []), name=f"{model.name}, open joints"))


def _say_made(model: "Assembly") -> None:
    contacts = 0 if model.contacts is None else len(model.contacts)
    say(f"{model.name}: {len(model)} blocks, {len(model) - 1} of them free, {contacts} contacts")


def _say_end(made: "PolygonalWall | CornerWall", paths: "dict[str, Path]") -> None:
    """Lines that stand below every wall: its joints, what became of it by improving, and where it was written."""
    say(f"joints     {_flat(made.joints)}")
    if made.chosen is not None:
        say(f"improved   {_improved(made.chosen)}")
    for path in paths.values():
        say(f"written {path}")


def _flat(joints: "JointReadout") -> str:
    """How many joints are flat, and what became of the others."""
    if not joints.warped:
        return f"{joints.joints} flat"
    planes = joints.warped - joints.folded
    flat = f"{joints.joints - joints.warped} flat, {planes} within {joints.deviation:.2g} m of a plane"
    return flat + (f", {joints.folded} folded into triangles (warp up to {joints.warp:.2g} m)" if joints.folded else "")


def _improved(chosen: "Chosen") -> str:
    """Whether the improved wall stands, and what was given up for that."""
    if chosen.verdict != "stable":
        before = "" if chosen.before is None else f", as before it was {chosen.before}"
        return f"{chosen.verdict}{before}; coupled analysis"
    given_up = chosen.place
    better = f"; {given_up} with a better J did not pass" if given_up else ""
    return f"stable by coupled analysis{better}"


def _summed(pattern: "Pattern", depth: float) -> str:
    """One wall of several on one line."""
    from cyclopean.design.walls.interlock import interlock

    one = pattern.readout
    told = f"{one.cells} cells, coverage {one.coverage:.12g}, area CV {one.area_cv:.3f}, culled {one.culled}"
    return f"{told}, J {_rated(interlock(pattern, depth=depth))}"


def _rated(found: "Interlock") -> str:
    """The score, and the running joints that it lost by."""
    running = len(found.running)
    worst = (
        f", the longest {found.running[0].length:.2g} m through {found.running[0].courses} courses" if running else ""
    )
    return f"{found.score:.3f} ({running} running joint{'' if running == 1 else 's'}{worst})"


def _make(
    kind: str, sizes: tuple[Any, ...], options: dict[str, Any], out: str, density: str | None, mu: str | None
) -> int:
    """Make the model and write it."""
    options |= {
        "density": optional_number("--density", density, above=0.0),
        "mu": optional_number("--mu", mu, least=0.0),
    }
    path = planned({"--out": out}, models=("--out",))["--out"]
    wanted = (abs(n) for n in (*sizes, options.get("facets")) if isinstance(n, int))
    if math.prod(wanted) > MOST:
        raise InputError(f"make {kind}: more than {MOST:,} blocks or facets; ask for fewer")

    from cyclopean import design, io

    template: Callable[..., Assembly] = getattr(design, kind)
    with wall_options.named({name: (f"--{name}", "") for name in (*options, "size")}):
        model = template(*sizes, **options)
    io.write_model(path, model)
    contacts = 0 if model.contacts is None else len(model.contacts)
    free = sum(not block.fixed for block in model.blocks)
    say(f"{model.name}: {len(model)} blocks, {free} of them free, {contacts} contacts; written {path}")
    return 0


commands.command(cls=PlainCommand)(stones)

make = commands
