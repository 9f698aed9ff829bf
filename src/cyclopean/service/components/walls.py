"""Polygonal Wall: a wall of polygonal stones with exact joints, flat or round in plan."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from cyclopean.api import wall_options
from cyclopean.api.walls import chosen_pattern
from cyclopean.design.walls.line_work import LineReading
from cyclopean.errors import InputError
from cyclopean.service.inputs import option_inputs, option_values
from cyclopean.service.meshes import block_meshes, contact_curves, model_text
from cyclopean.service.parameters import Answer, Component, Context, Input, Output

if TYPE_CHECKING:
    from cyclopean.design.walls.pattern import Pattern, PatternSettings
    from cyclopean.design.walls.surfaces import Surface

MOST_STONES = 3000  # in a wall that is drawn while somebody waits

PATTERN = {
    "Width": "width", "Height": "height", "Columns": "columns", "Rows": "rows", "Seed": "seed", "Jitter": "jitter",
    "Relaxation": "lloyd", "Coursing": "coursing", "Size Grade": "size_grade", "Sliver": "sliver",
}  # fmt: skip


def _polygonal_wall(given: Mapping[str, Any], _: Context) -> Answer:
    """Draw the wall."""
    from cyclopean.design.walls.interlock import interlock
    from cyclopean.design.walls.polygonal import polygonal_wall

    surface, said = _designed(given)
    pattern = _pattern(given)
    if surface is None:
        surface = _formed(given, pattern)
    made = polygonal_wall(
        pattern,
        surface=surface,
        depth=given["Depth"],
        batter=given["Batter"],
        density=given["Density"],
        mu=given["Friction"],
        warped=given["Warped"],
        improve=given["Improve"],
    )
    ground, *stones = made.assembly.blocks
    contacts = made.assembly.contacts
    values = {
        "Stones": block_meshes(stones),
        "Names": [block.id for block in stones],
        "Ground": block_meshes([ground])[0],
        "Joints": [] if contacts is None else contact_curves(contacts),
        "Interlock": interlock(made.pattern, depth=given["Depth"]).score,
        "Coverage": made.pattern.readout.coverage,
        "Crossings": made.pattern.readout.crossings,
        "Model": model_text(made.assembly),
    }
    return Answer(values, (*said, *made.pattern.notes))


def _pattern(given: Mapping[str, Any]) -> "PatternSettings | Pattern":
    """The pattern, or what to draw one from."""
    from cyclopean.design.walls.pattern import PatternSettings

    if not abs(given["Columns"] * given["Rows"]) <= MOST_STONES:
        raise InputError(f"Columns: more than {MOST_STONES:,} stones; ask for fewer")
    wanted = {field: given[name] for name, field in PATTERN.items() if given[name] is not None}
    line, radius = wall_options.base("Base", given["Base"])
    settings = PatternSettings(
        **wanted,
        courses=max(given["Rows"], 1),
        openings=tuple(wall_options.opening("Openings", text) for text in given["Openings"]),
        quoins=wall_options.quoins("Quoins", given["Quoins"]),
        coping=wall_options.coping("Coping", given["Coping"]),
        base=line,
        base_radius=radius,
    )
    reading = option_values({name: given[name] for name in ("Snap", "Deviation")}, LineReading())
    pattern = chosen_pattern(settings, reading, given["Courses"], given["Max Bed"], _sheet(given))
    if not isinstance(pattern, PatternSettings) and not len(pattern.subdivision) <= MOST_STONES:
        raise InputError(f"Drawing: shows more than {MOST_STONES:,} stones; draw a part of them")
    return pattern


def _designed(given: Mapping[str, Any]) -> "tuple[Surface | None, tuple[str, ...]]":
    """The surface that is connected, laid flat, and what that costs; None where none is."""
    from cyclopean.io.surfaces import surface_of

    bodies, mesh = given["Surface"], given["Surface Mesh"]
    said = [name for name in ("Surface", "Surface Mesh", "Form", "Radius") if given[name]]
    if len(said) > 1:
        raise InputError(f"{said[1]}: connect either {said[0]} or {said[1]}")
    if bodies is None and mesh is None:
        return None, ()
    return surface_of(said[0], [mesh] if bodies is None else bodies)


def _formed(given: Mapping[str, Any], pattern: "PatternSettings | Pattern") -> "Surface | None":
    """The surface that a formula gives; None for a plane."""
    from cyclopean.design.walls.pattern import PatternSettings
    from cyclopean.design.walls.surfaces import Cylinder

    whole = pattern if isinstance(pattern, PatternSettings) else pattern.settings
    if given["Form"]:
        return wall_options.surface("Form", given["Form"], whole.width, whole.height)
    return Cylinder(given["Radius"], whole.width / 2.0) if given["Radius"] else None


def _sheet(given: Mapping[str, Any]) -> Any:
    """What is drawn, on the layers that the inputs stand for; None where nothing is."""
    from cyclopean.io.line_work import DrawnLine, Sheet

    layers = {"Drawing": "joints", "Clear Outlines": "opening", "Ground Line": "ground"}
    lines = [DrawnLine(pieces, layer) for name, layer in layers.items() for pieces in given[name]]
    return Sheet(tuple(lines), "m") if lines else None


POLYGONAL_WALL = Component(
    "polygonal-wall",
    "Polygonal Wall",
    "PolyWall",
    "Draws a wall of polygonal stones with exact joints. Lengths that are numbers are metres.",
    (
        Input("Width", "W", "Number", "Along the foot (m).", default=3.0),
        Input("Height", "H", "Number", "Up the face (m).", default=1.8),
        Input("Columns", "C", "Integer", "Stones in a row, before culling.", default=8),
        Input("Rows", "R", "Integer", "Rows of stones.", default=5),
        Input("Depth", "D", "Number", "Thickness at the foot (m).", default=0.2),
        Input("Batter", "B", "Number", "How far the front recedes, m a metre.", default=0.0),
        Input("Radius", "Ra", "Number", "Of a wall round in plan (m); negative = hollow, 0 = straight.", default=0.0),
        Input("Seed", "S", "Integer", "Another seed, another wall.", default=7),
        Input("Jitter", "J", "Number", "Irregularity of the seeds, 0 to 0.5.", default=0.25),
        Input("Relaxation", "L", "Integer", "Rounds of evening out.", default=2),
        Input("Coursing", "Co", "Number", "0 irregular to 1 level courses.", default=0.4),
        Input("Size Grade", "G", "Number", "Spread of the stones' sizes.", default=0.3),
        Input("Max Bed", "MB", "Number", "Degrees: stones lie on a face as flat as this, if they can; 90 = as drawn"
              " [35; with a Drawing 90].", optional=True),
        Input("Openings", "O", "Text", "X,Z,W,H or X,Z,W,H,arch: left jamb, sill, clear width and height (m).", "list",
              optional=True),
        Input("Drawing", "Dr", "Curve", "Joints, drawn in a plane, instead of a pattern from seeds: the faces between"
              " them are the stones.", "list", optional=True),
        Input("Clear Outlines", "CO", "Curve", "Closed outlines of doors and windows in that drawing.", "list",
              optional=True),
        Input("Ground Line", "GL", "Curve", "What the drawn wall stands on; its level edges at the lowest height where"
              " not given.", "list", optional=True),
        *option_inputs(LineReading, "snap deviation"),
        Input("Surface", "Sf", "Surface", "What the wall lies on: one face, laid flat; Width and Height are then its"
              " own.", optional=True),
        Input("Surface Mesh", "SM", "Mesh", "The same as an open mesh with one boundary.", optional=True),
        Input("Form", "Fo", "Text", "The same by a formula: cylinder:R, cone:R,DEG, sphere:R,DEG or twist:DEG.",
              optional=True),
        Input("Courses", "Cs", "Integer", "Number of courses [as many as Rows].", optional=True),
        Input("Sliver", "Sl", "Number", "Stones thinner than this share are culled [0.18].", optional=True),
        Input("Quoins", "Q", "Text", "Corner stones at both ends (m): LONG,SHORT, LONG,SHORT,HEIGHT or auto.",
              optional=True),
        Input("Coping", "Cp", "Text", "A row of stones on top (m): HEIGHT, HEIGHT,LENGTH or auto.", optional=True),
        Input("Base", "Ba", "Text", "Line of the ground (m): U:V,U:V,... or radius:R.", optional=True),
        Input("Warped", "Wa", "Text", "What becomes of joints that are not flat: auto, triangles or plane.",
              default="auto"),
        Input("Improve", "Im", "Boolean", "Move stones until they interlock better and the wall stands.",
              default=False),
        Input("Density", "rho", "Number", "Of every block (kg/m3); not said where not given.", optional=True),
        Input("Friction", "mu", "Number", "Coefficient of every joint; not said where not given.", optional=True),
    ),
    (
        Output("Stones", "S", "Mesh", "The stones.", "list"),
        Output("Names", "N", "Text", "Their names.", "list"),
        Output("Ground", "G", "Mesh", "The block that they stand on; it is held."),
        Output("Joints", "J", "Curve", "Outlines of the joints.", "list"),
        Output("Interlock", "I", "Number", "Score of the interlock, 0 to 1."),
        Output("Coverage", "Cv", "Number", "Area of the stones over that of the wall less its openings."),
        Output("Crossings", "X", "Integer", "Corners at which four or more stones meet."),
        Output("Model", "M", "Text", "The wall with its exact joints, for Check and Sequence."),
    ),
    _polygonal_wall,
)  # fmt: skip
