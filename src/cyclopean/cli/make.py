"""`make`: parametric models with exact contacts."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.cli.command import argument, command, written
from cyclopean.cli.outputs import Files
from cyclopean.cli.terminal import say
from cyclopean.errors import InputError
from cyclopean.options import Option, check_options, option

if TYPE_CHECKING:
    from cyclopean.assembly import Assembly

__all__ = ["Material", "Out", "arch", "counted", "dome", "made", "stack", "vault", "wall"]

MOST = 1_000_000  # blocks, or facets of them, in a model that is made: more do not fit into a common memory

Out = Annotated[Files, written(models="out", out=("MODEL", "Required: Model file to write."))]


@dataclass(frozen=True, slots=True)
class Material:
    """What is said of every block and contact."""

    density: float | None = option(
        None, "Density of every block, kg/m3.", "number", metavar="D", above=0.0, unit="kg/m3"
    )
    mu: float | None = option(None, "Friction coefficient of every contact.", "number", metavar="M", least=0.0)

    def __post_init__(self) -> None:
        check_options(self)


def _number(help: str, metavar: str = "L") -> Option:
    return Option(help, "number", metavar=metavar)


def counted(name: str, help: str) -> Any:
    """Say of an argument that it is a whole number."""
    return argument(name, help, kind="whole")


@command()
def stack(
    count: Annotated[int, counted("COUNT", "Number of blocks.")],
    files: Out,
    size: Annotated[tuple[float, float, float], Option("Of each block (m).", "vector", metavar="X,Y,Z")] = (
        1.0,
        1.0,
        1.0,
    ),
    offset: Annotated[
        tuple[float, ...],
        Option("Shift (m) along x of each block over the one below, or of all.", "numbers", metavar="L[,L...]"),
    ] = (0.0,),
    slope: Annotated[float, _number("Slope of the ground, falling towards +x.", "DEG")] = 0.0,
    ground: Annotated[bool, Option("Put a fixed slab below.", "flag")] = True,
    material: Material = Material(),
) -> int:
    """Make blocks on top of each other."""
    shift = offset[0] if len(offset) == 1 else offset
    return made("stack", (count,), files, material, size=size, offset=shift, slope=slope, ground=ground)


@command()
def wall(
    columns: Annotated[int, counted("COLUMNS", "Whole blocks in a course.")],
    courses: Annotated[int, counted("COURSES", "Number of free courses.")],
    files: Out,
    length: Annotated[float, _number("Of a block, along x (m).")] = 0.4,
    depth: Annotated[float, _number("Of a block, along y (m).")] = 0.2,
    height: Annotated[float, _number("Of a block (m).")] = 0.2,
    ground: Annotated[str, Option("What it stands on.", choices=("slab", "course"))] = "slab",
    material: Material = Material(),
) -> int:
    """Make a running-bond wall."""
    sizes = {"length": length, "depth": depth, "height": height}
    return made("wall", (columns, courses), files, material, **sizes, ground=ground)


@command()
def arch(
    voussoirs: Annotated[int, counted("VOUSSOIRS", "Number of voussoirs.")],
    files: Out,
    span: Annotated[float | None, _number("Clear span (m) [10, if no radius is given].")] = None,
    rise: Annotated[float | None, _number("Of the inner crown (m) [half the span].")] = None,
    radius: Annotated[float | None, _number("Of the centre line of a semicircle (m), instead of the span.")] = None,
    thickness: Annotated[float, _number("Radial thickness (m).")] = 0.8,
    depth: Annotated[float, _number("Along y (m).")] = 1.0,
    springers: Annotated[
        str, Option("Stand on fixed wedges, or fix the first and last voussoir.", choices=("wedges", "fixed"))
    ] = "wedges",
    facets: Annotated[int, Option("Chords for the curve of each voussoir.", "whole", metavar="N")] = 1,
    material: Material = Material(),
) -> int:
    """Make a circular arch."""
    circle = {"span": span, "rise": rise, "radius": radius, "thickness": thickness, "depth": depth}
    return made("arch", (voussoirs,), files, material, **circle, springers=springers, facets=facets)


@command()
def vault(
    voussoirs: Annotated[int, counted("VOUSSOIRS", "Rows from springing to springing.")],
    columns: Annotated[int, counted("COLUMNS", "Whole blocks in a row.")],
    files: Out,
    radius: Annotated[float, _number("Radius of the middle surface (m).")] = 1.0,
    thickness: Annotated[float, _number("Radial thickness (m).")] = 0.2,
    length: Annotated[float | None, _number("Of the barrel (m) [blocks twice as long as wide].")] = None,
    material: Material = Material(),
) -> int:
    """Make a barrel vault."""
    sizes = {"radius": radius, "thickness": thickness, "length": length}
    return made("vault", (voussoirs, columns), files, material, **sizes)


@command()
def dome(
    courses: Annotated[int, counted("COURSES", "Rings from the springing to the oculus.")],
    segments: Annotated[int, counted("SEGMENTS", "Blocks in a ring.")],
    files: Out,
    radius: Annotated[float, _number("Radius of the middle surface (m).")] = 1.0,
    thickness: Annotated[float, _number("Radial thickness (m).")] = 0.15,
    oculus: Annotated[float, _number("Half the opening angle at the top, from the axis.", "DEG")] = 10.0,
    material: Material = Material(),
) -> int:
    """Make a hemispherical dome."""
    sizes = {"radius": radius, "thickness": thickness, "oculus": oculus}
    return made("dome", (courses, segments), files, material, **sizes)


def made(kind: str, counts: tuple[int, ...], files: Files, material: Material, **options: Any) -> int:
    """Make the model and write it."""
    if math.prod(abs(n) for n in (*counts, options.get("facets", 1))) > MOST:
        raise InputError(f"make {kind}: more than {MOST:,} blocks or facets; ask for fewer")

    from cyclopean import design, io

    template: Callable[..., Assembly] = getattr(design, kind)
    model = template(*counts, **options, **asdict(material))
    io.write_model(files.to["out"], model)
    contacts = 0 if model.contacts is None else len(model.contacts)
    free = sum(not block.fixed for block in model.blocks)
    say(f"{model.name}: {len(model)} blocks, {free} of them free, {contacts} contacts; written {files.to['out']}")
    return 0
