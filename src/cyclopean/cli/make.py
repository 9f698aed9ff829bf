"""`make`: parametric models with exact contacts."""

import inspect
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.cli.command import Command, argument, command, written
from cyclopean.cli.outputs import Files
from cyclopean.cli.terminal import say
from cyclopean.errors import InputError
from cyclopean.options import option

if TYPE_CHECKING:
    from cyclopean.assembly import Assembly

MOST = 1_000_000  # blocks, or facets of them, in a model that is made: more do not fit into a common memory


@dataclass(frozen=True, slots=True)
class Material:
    """What is said of every block and contact."""

    density: float | None = option(
        None, "Density of every block, kg/m3.", "number", metavar="D", above=0.0, unit="kg/m3"
    )
    mu: float | None = option(None, "Friction coefficient of every contact.", "number", metavar="M", least=0.0)


@dataclass(frozen=True, slots=True)
class StackShape:
    """Of blocks on top of each other."""

    size: tuple[float, ...] = option((1.0, 1.0, 1.0), "Of each block (m).", "vector", metavar="X,Y,Z")
    offset: tuple[float, ...] = option(
        (0.0,), "Shift (m) along x of each block over the one below, or of all.", "numbers", metavar="L[,L...]"
    )
    slope: float = option(0.0, "Slope of the ground, falling towards +x.", "number", metavar="DEG")
    ground: bool = option(True, "Put a fixed slab below.", "flag")


@dataclass(frozen=True, slots=True)
class WallShape:
    """Of a wall in running bond."""

    length: float = option(0.4, "Of a block, along x (m).", "number", metavar="L")
    depth: float = option(0.2, "Of a block, along y (m).", "number", metavar="L")
    height: float = option(0.2, "Of a block (m).", "number", metavar="L")
    ground: str = option("slab", "What it stands on.", choices=("slab", "course"))


@dataclass(frozen=True, slots=True)
class ArchShape:
    """Of a circular arch."""

    span: float | None = option(None, "Clear span (m) [10, if no radius is given].", "number", metavar="L")
    rise: float | None = option(None, "Of the inner crown (m) [half the span].", "number", metavar="L")
    radius: float | None = option(
        None, "Of the centre line of a semicircle (m), instead of the span.", "number", metavar="L"
    )
    thickness: float = option(0.8, "Radial thickness (m).", "number", metavar="L")
    depth: float = option(1.0, "Along y (m).", "number", metavar="L")
    springers: str = option(
        "wedges", "Stand on fixed wedges, or fix the first and last voussoir.", choices=("wedges", "fixed")
    )
    facets: int = option(1, "Chords for the curve of each voussoir.", "whole", metavar="N")


@dataclass(frozen=True, slots=True)
class VaultShape:
    """Of a barrel vault."""

    radius: float = option(1.0, "Radius of the middle surface (m).", "number", metavar="L")
    thickness: float = option(0.2, "Radial thickness (m).", "number", metavar="L")
    length: float | None = option(None, "Of the barrel (m) [blocks twice as long as wide].", "number", metavar="L")


@dataclass(frozen=True, slots=True)
class DomeShape:
    """Of a hemispherical dome."""

    radius: float = option(1.0, "Radius of the middle surface (m).", "number", metavar="L")
    thickness: float = option(0.15, "Radial thickness (m).", "number", metavar="L")
    oculus: float = option(10.0, "Half the opening angle at the top, from the axis.", "number", metavar="DEG")


def template(name: str, says: str, counts: dict[str, str], **shapes: Any) -> Command:
    """The command that makes what a template of `design` makes, from numbers of things and shapes of these.

    `sizes` among the shapes are given to the template one by one, all others as they are.
    """
    asked: dict[str, tuple[Any, Any]] = {
        one: (Annotated[int, argument(one.upper(), help_, kind="whole")], inspect.Parameter.empty)
        for one, help_ in counts.items()
    }
    out = written(models="out", out=("MODEL", "Required: Model file to write."))
    asked["files"] = Annotated[Files, out], inspect.Parameter.empty
    asked |= {one: (type(shape), shape) for one, shape in {**shapes, "material": Material()}.items()}

    def make(**given: Any) -> int:
        files, material = given.pop("files"), given.pop("material")
        sizes = asdict(given.pop("sizes")) if "sizes" in given else {}
        return _made(name, [given.pop(one) for one in counts], files, **given, **sizes, **asdict(material))

    told: Any = make
    told.__name__, told.__doc__ = name, says
    told.__annotations__ = {one: hint for one, (hint, _) in asked.items()}
    told.__signature__ = inspect.Signature([
        inspect.Parameter(one, inspect.Parameter.KEYWORD_ONLY, default=usual) for one, (_, usual) in asked.items()
    ])  # fmt: skip
    return command()(told)


def _made(kind: str, counts: list[int], files: Files, **options: Any) -> int:
    """Make the model and write it."""
    if math.prod(abs(n) for n in (*counts, options.get("facets", 1))) > MOST:
        raise InputError(f"make {kind}: more than {MOST:,} blocks or facets; ask for fewer")

    from cyclopean import design, io

    if len(options.get("offset", ())) == 1:  # of all blocks
        options["offset"] = options["offset"][0]
    template: Callable[..., Assembly] = getattr(design, kind)
    model = template(*counts, **options)
    io.write_model(files.to["out"], model)
    contacts = 0 if model.contacts is None else len(model.contacts)
    free = sum(not block.fixed for block in model.blocks)
    say(f"{model.name}: {len(model)} blocks, {free} of them free, {contacts} contacts; written {files.to['out']}")
    return 0


stack = template("stack", "Make blocks on top of each other.", {"count": "Number of blocks."}, sizes=StackShape())
wall = template(
    "wall",
    "Make a running-bond wall.",
    {"columns": "Whole blocks in a course.", "courses": "Number of free courses."},
    sizes=WallShape(),
)
arch = template("arch", "Make a circular arch.", {"voussoirs": "Number of voussoirs."}, sizes=ArchShape())
vault = template(
    "vault",
    "Make a barrel vault.",
    {"voussoirs": "Rows from springing to springing.", "columns": "Whole blocks in a row."},
    sizes=VaultShape(),
)
dome = template(
    "dome",
    "Make a hemispherical dome.",
    {"courses": "Rings from the springing to the oculus.", "segments": "Blocks in a ring."},
    sizes=DomeShape(),
)
