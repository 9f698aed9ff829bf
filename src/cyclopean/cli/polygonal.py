"""`make polygonal`: walls of polygonal stones, flat, curved, or round a corner."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.api import wall_options
from cyclopean.api.walls import chosen_pattern
from cyclopean.cli.command import command, some, written
from cyclopean.cli.make import Material
from cyclopean.cli.outputs import Files, planned
from cyclopean.cli.terminal import as_option, say, warn
from cyclopean.design.walls.line_work import LineReading
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.errors import InputError
from cyclopean.options import first_said, option, options_of
from cyclopean.texts import first_few

if TYPE_CHECKING:
    from cyclopean.assembly import Assembly, Block
    from cyclopean.design.walls.corner import CornerWall
    from cyclopean.design.walls.improve import Chosen
    from cyclopean.design.walls.interlock import Interlock
    from cyclopean.design.walls.joints import JointReadout
    from cyclopean.design.walls.pattern import Pattern
    from cyclopean.design.walls.polygonal import PolygonalWall
    from cyclopean.design.walls.surfaces import Surface

MOST_STONES = 50_000  # of a polygonal wall, which are drawn one by one
FIELDS = {  # what refusals of the design begin with, and the option that says it
    "base_radius": "base radius", "openings": "opening", "twist": "surface twist", "cylinder": "surface cylinder",
    "cone": "surface cone", "sphere": "surface sphere",
}  # fmt: skip
NAMED = 5  # stones without a bed; the rest are counted
SEEDED = "width height columns rows seed jitter lloyd coursing size_grade sliver"


@dataclass(frozen=True, slots=True)
class Dressing:
    """What is said of a wall by a text of its own."""

    opening: tuple[str, ...] = option(
        (),
        "Left jamb, sill, clear width and height (m); repeatable.",
        "texts",
        metavar="X,Z,W,H[,lintel|arch]",
    )
    quoins: str | None = option(None, "Corner stones at both ends (m).", metavar="LONG,SHORT[,H]|auto")
    coping: str | None = option(None, "A row of stones on top (m).", metavar="H[,L]|auto")
    base: str | None = option(None, "Line of the ground (m), or its radius.", metavar="U:V,...|radius:R")

    def of(self, depth: float | None) -> dict[str, Any]:
        """Fields of a pattern; `depth` (m) is that of walls that meet at a corner."""
        line, radius = wall_options.base("`base`", self.base)
        return {
            "openings": tuple(wall_options.opening("`opening`", text) for text in self.opening),
            "quoins": wall_options.quoins("`quoins`", self.quoins, depth),
            "coping": wall_options.coping("`coping`", self.coping),
            "base": line,
            "base_radius": radius,
        }


@dataclass(frozen=True, slots=True)
class Lying:
    """How the face of a wall lies; of walls that meet at a corner nothing of it may be said."""

    surface: str = option(
        "plane",
        "What the wall lies on; R < 0 is hollow. DEG: lean of a cone, latitude of a sphere's foot. F: an open mesh, or "
        "a 3DM with one face.",
        metavar="plane|cylinder:R|cone:R[,DEG]|sphere:R[,DEG]|twist:DEG|F",
    )
    batter: float = option(0.0, "How far the front recedes, m a metre.", "number", metavar="B")
    warped: str = option("auto", "What becomes of joints that are not flat.", choices=("auto", "triangles", "plane"))


@dataclass(frozen=True, slots=True)
class Apart:
    """Stones with open joints, for pictures."""

    gap: float = option(0.01, "Width of the open joints of `display` (m).", "number", metavar="L")
    chamfer: float = option(0.0, "Bevel along the front edges of those stones (m).", "number", metavar="L")


@dataclass(frozen=True, slots=True)
class Built:
    """How a wall is built from its pattern."""

    depth: float = option(0.2, "Thickness at the foot (m).", "number", metavar="L")
    corner: float | None = option(
        None, "Of a second wall (m) that turns back at the right end, bonded by quoins.", "number", metavar="LENGTH"
    )
    improve: str | None = option(
        None,
        "J: move stones until the score J of their interlock is as high as it gets in a wall that stands; a number:"
        " until it is so high.",
        metavar="J|SCORE",
    )

    @property
    def until(self) -> bool | float:
        """The score to be reached; True = the highest, False = nothing is moved at all."""
        if self.improve is None or self.improve == "J":
            return self.improve == "J"
        try:
            score = float(self.improve)
        except ValueError:
            score = math.nan
        if not 0.0 < score <= 1.0:
            raise InputError.of("improve", self.improve, "expected J, or the score to be reached, up to 1")
        return score


@command(fields=FIELDS)
def polygonal(
    files: Annotated[
        Files,
        written(
            "report",
            models="out",
            out=("MODEL", "Required: Model file to write."),
            display=("MODEL", "Also write the stones with open joints, for pictures."),
            drawing=("F", "Draw the face, with the joints that run through."),
        ),
    ],
    pattern: Annotated[PatternSettings, some(SEEDED)] = PatternSettings(),
    courses: Annotated[int | None, options_of(PatternSettings)["courses"]] = None,
    max_bed: Annotated[float | None, options_of(PatternSettings)["max_bed"]] = None,
    drawn: LineReading = LineReading(),
    dressing: Dressing = Dressing(),
    lying: Lying = Lying(),
    built: Built = Built(),
    apart: Apart = Apart(),
    material: Material = Material(),
) -> int:
    """Make a wall of polygonal stones, flat or curved, or two round a corner; from seeds, or from a drawing."""
    if pattern.columns * pattern.rows > MOST_STONES or (courses or 0) > MOST_STONES:
        raise InputError(f"make polygonal: more than {MOST_STONES:,} stones or courses; ask for fewer")
    deep = None if built.corner is None else built.depth
    courses = pattern.rows if courses is None and drawn.drawing is None else courses
    if drawn.drawing is not None:
        _refuse_beside(drawn.drawing, built, files)
    sheet = wall_options.surface_file(lying.surface)
    if sheet is not None:
        planned({as_option(name): str(path) for name, path in files.to.items()}, keep=sheet)
    reading = drawn if sheet is None or drawn.drawing is not None else replace(drawn, units=None)
    chosen = chosen_pattern(replace(pattern, **dressing.of(deep)), reading, courses, max_bed)
    options = {"depth": built.depth, "improve": built.until, **asdict(material)}
    if built.corner is None or not isinstance(chosen, PatternSettings):
        how = {"batter": lying.batter, "warped": lying.warped, **options}
        return _flat_or_curved(chosen, _surface(lying.surface, chosen, drawn.units), how, files, asdict(apart))
    if name := first_said(lying):
        raise InputError.of(name, None, "walls that meet at a corner are flat and upright; leave it out, or `corner`")
    return _cornered(chosen, built.corner, options, files, asdict(apart))


def _refuse_beside(drawing: str, built: Built, files: Files) -> None:
    """Refuse what cannot be had of a wall from a drawing, and files that would take its place."""
    for name, way in (
        ("corner", "draw both walls, each for itself"),
        ("improve", "it moves seeds; move joints instead"),
    ):
        if getattr(built, name) is not None:
            raise InputError.of(name, None, f"is not for a drawing: {way}, or leave out `drawing`")
    planned({as_option(name): str(path) for name, path in files.to.items()}, keep=drawing)


def _surface(text: str, pattern: "PatternSettings | Pattern", units: str | None) -> "Surface":
    """The surface that a text says, or the file that it names holds."""
    file = wall_options.surface_file(text)
    if file is None:
        whole = pattern if isinstance(pattern, PatternSettings) else pattern.settings
        return wall_options.surface("`surface`", text, whole.width, whole.height)
    from cyclopean.io.surfaces import read_surface

    surface, notes = read_surface(file, units)
    for note in notes:
        warn(note)
    return surface


def _flat_or_curved(
    pattern: "PatternSettings | Pattern",
    surface: "Surface",
    options: dict[str, Any],
    files: Files,
    apart: dict[str, float],
) -> int:
    """Make one wall, write it, and say what came out."""
    from cyclopean.design.walls.interlock import interlock
    from cyclopean.design.walls.joints import with_open_joints
    from cyclopean.design.walls.polygonal import polygonal_wall

    made = polygonal_wall(pattern, surface=surface, **options)
    _write(made, lambda: with_open_joints(made.pattern, made.surface, made.thickness, **apart), files)
    for note in made.pattern.notes:
        warn(note)
    readout = made.pattern.readout
    _say_made(made.assembly)
    say(f"cells      {readout.cells}")
    say(f"coverage   {readout.coverage:.12g}")
    say(f"area CV    {readout.area_cv:.3f}")
    say(f"culled     {readout.culled}")
    say(f"crossings  {readout.crossings}")
    say(f"J          {_rated(interlock(made.pattern, depth=made.thickness.depth))}")
    _say_end(made, files)
    return 0


def _cornered(
    settings: PatternSettings, length: float, options: dict[str, Any], files: Files, apart: dict[str, float]
) -> int:
    """Make two walls that meet at a corner, write them, and say what came out."""
    from cyclopean.design.walls.corner import corner_wall, corner_with_open_joints, joint_score

    if not settings.columns * settings.rows * (1.0 + length / settings.width) <= MOST_STONES:
        raise InputError.of("corner", None, f"more than {MOST_STONES:,} stones; ask for fewer")
    made = corner_wall(settings, length, **options)
    _write(made, lambda: corner_with_open_joints(made, **apart), files)
    _say_made(made.assembly)
    say(f"cells      {len(made.assembly) - 1}, {len(made.corner)} of them in both walls")
    for k, one in enumerate(made.patterns, 1):
        say(f"wall {k}     {_summed(one, made.thickness.depth)}")
    say(f"crossings  {sum(one.readout.crossings for one in made.patterns)}")
    say(f"J          {joint_score(made):.3f}")
    _say_end(made, files)
    return 0


def _write(made: "PolygonalWall | CornerWall", apart: "Callable[[], tuple[Block, ...]]", files: Files) -> None:
    """Write the wall with how it was drawn, and what it looks like with open joints."""
    from cyclopean import io
    from cyclopean.api.drawings import drawn, paged
    from cyclopean.assembly import Assembly, Contacts
    from cyclopean.design.walls.polygonal import PolygonalWall

    model = made.assembly
    drawing = io.drawing_dict(made) if isinstance(made, PolygonalWall) else None

    def shown() -> Callable[[Path], object]:
        stones = Assembly(apart(), Contacts.of([], []), name=f"{model.name}, open joints")
        return lambda file: io.write_exchange(file, stones)

    out = {"out": lambda: lambda file: io.write_model(file, model, drawing=drawing)}
    files.write({**out, "display": shown, **drawn(made), **paged(made)})


def _say_made(model: "Assembly") -> None:
    contacts = 0 if model.contacts is None else len(model.contacts)
    say(f"{model.name}: {len(model)} blocks, {len(model) - 1} of them free, {contacts} contacts")


def _say_end(made: "PolygonalWall | CornerWall", files: Files) -> None:
    """Lines that stand below every wall: its joints, what became of it by improving, and where it was written."""
    say(f"joints     {_flat(made.joints)}")
    for line in _beds(made):
        say(line)
    if made.chosen is not None:
        say(f"improved   {_improved(made.chosen)}")
    for path in files.to.values():
        say(f"written {path}")


def _beds(made: "PolygonalWall | CornerWall") -> list[str]:
    """Stones that lie on no bed, if there are any."""
    steep = made.without_bed
    if not steep:
        return []
    names = first_few([f"'{one.block}' ({one.angle:.0f})" for one in steep], NAMED)
    return [
        f"beds       {len(steep)} with no face below as flat as {steep[0].friction:.0f} degrees: {names}",
        "           at friction angles below those in brackets they stand only if their neighbours hold them by thrust",
    ]


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
