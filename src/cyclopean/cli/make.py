"""`make`: parametric models with exact contacts."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cyclopean.cli.outputs import planned
from cyclopean.cli.plain import PlainCommand, PlainGroup
from cyclopean.cli.terminal import say
from cyclopean.cli.values import choice, number, numbers, optional_number, vector, whole
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.assembly import Assembly

__all__ = ["commands"]

MOST = 1_000_000  # blocks, or facets of them, in a model that is made: more do not fit into a common memory

Out = Annotated[str, typer.Option(metavar="MODEL", show_default=False, help="Model file to write.")]
Mu = Annotated[str | None, typer.Option(metavar="M", help="Friction coefficient of every contact.")]
Density = Annotated[str | None, typer.Option(metavar="D", help="Density of every block, kg/m3.")]
Radius = Annotated[str, typer.Option(metavar="L", help="Radius of the middle surface (m).")]
Thickness = Annotated[str, typer.Option(metavar="L", help="Radial thickness (m).")]

commands = typer.Typer(
    cls=PlainGroup,
    help="Make a stack, wall, arch, vault or dome.",
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


def _make(
    kind: str, sizes: tuple[Any, ...], options: dict[str, Any], out: str, density: str | None, mu: str | None
) -> int:
    """Make the model and write it."""
    options |= {
        "density": optional_number("--density", density, above=0.0),
        "mu": optional_number("--mu", mu, least=0.0),
    }
    path = planned({"--out": out})["--out"]
    wanted = (abs(n) for n in (*sizes, options.get("facets")) if isinstance(n, int))
    if math.prod(wanted) > MOST:
        raise InputError(f"make {kind}: more than {MOST:,} blocks or facets; ask for fewer")

    from cyclopean import design, io

    template: Callable[..., Assembly] = getattr(design, kind)
    model = template(*sizes, **options)
    io.write_model(path, model)
    contacts = 0 if model.contacts is None else len(model.contacts)
    free = sum(not block.fixed for block in model.blocks)
    say(f"{model.name}: {len(model)} blocks, {free} of them free, {contacts} contacts; written {path}")
    return 0
