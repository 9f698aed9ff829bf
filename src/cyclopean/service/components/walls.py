"""Polygonal Wall: a wall of polygonal stones with exact joints, flat or round in plan."""

from collections.abc import Mapping
from typing import Any

from cyclopean.api.walls import chosen_pattern
from cyclopean.design.walls.line_work import LineReading
from cyclopean.errors import InputError
from cyclopean.service.inputs import option_inputs, option_values
from cyclopean.service.meshes import block_meshes, contact_curves, model_text
from cyclopean.service.parameters import Answer, Component, Context, Input, Output

__all__ = ["POLYGONAL_WALL"]

MOST_STONES = 3000  # in a wall that is drawn while somebody waits

PATTERN = {
    "Width": "width", "Height": "height", "Columns": "columns", "Rows": "rows", "Seed": "seed", "Jitter": "jitter",
    "Relaxation": "lloyd", "Coursing": "coursing", "Size Grade": "size_grade",
}  # fmt: skip


def _polygonal_wall(given: Mapping[str, Any], _: Context) -> Answer:
    """Draw the wall."""
    from cyclopean.design.walls.interlock import interlock
    from cyclopean.design.walls.pattern import PatternSettings
    from cyclopean.design.walls.polygonal import polygonal_wall
    from cyclopean.design.walls.surfaces import Cylinder

    if not abs(given["Columns"] * given["Rows"]) <= MOST_STONES:
        raise InputError(f"Columns: more than {MOST_STONES:,} stones; ask for fewer")
    wanted = {field: given[name] for name, field in PATTERN.items()}
    settings = PatternSettings(
        **wanted, courses=max(given["Rows"], 1), openings=tuple(_opening(text) for text in given["Openings"])
    )
    reading = option_values({name: given[name] for name in ("Snap", "Deviation")}, LineReading())
    pattern = chosen_pattern(settings, reading, max_bed=given["Max Bed"], sheet=_sheet(given))
    whole = pattern if isinstance(pattern, PatternSettings) else pattern.settings
    if not isinstance(pattern, PatternSettings) and not len(pattern.subdivision) <= MOST_STONES:
        raise InputError(f"Drawing: shows more than {MOST_STONES:,} stones; draw a part of them")
    radius = given["Radius"]
    surface = Cylinder(radius, whole.width / 2.0) if radius else None
    made = polygonal_wall(pattern, surface=surface, depth=given["Depth"], batter=given["Batter"])
    ground, *stones = made.assembly.blocks
    contacts = made.assembly.contacts
    values = {
        "Stones": block_meshes(stones),
        "Names": [block.id for block in stones],
        "Ground": block_meshes([ground])[0],
        "Joints": [] if contacts is None else contact_curves(contacts),
        "Interlock": interlock(made.pattern, depth=given["Depth"]).score,
        "Model": model_text(made.assembly),
    }
    return Answer(values, made.pattern.notes)


def _sheet(given: Mapping[str, Any]) -> Any:
    """What is drawn, on the layers that the inputs stand for; None where nothing is."""
    from cyclopean.io.line_work import DrawnLine, Sheet

    layers = {"Drawing": "joints", "Clear Outlines": "opening", "Ground Line": "ground"}
    lines = [DrawnLine(pieces, layer) for name, layer in layers.items() for pieces in given[name]]
    return Sheet(tuple(lines), "m") if lines else None


def _opening(text: str) -> Any:
    """Read X,Z,W,H[,lintel|arch]: left jamb, sill, clear width and height in m."""
    from cyclopean.design.walls.openings import Opening

    *numbers, last = text.split(",")
    head = last.strip().lower()
    if head not in ("lintel", "arch"):
        numbers, head = [*numbers, last], "lintel"
    try:
        left, sill, width, height = (float(number) for number in numbers)
    except ValueError:
        raise InputError(f"Openings: '{text[:40]}' should be X,Z,W,H or X,Z,W,H,arch, in metres") from None
    return Opening(left, width, height, sill, "arch" if head == "arch" else "lintel")


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
    ),
    (
        Output("Stones", "S", "Mesh", "The stones.", "list"),
        Output("Names", "N", "Text", "Their names.", "list"),
        Output("Ground", "G", "Mesh", "The block that they stand on; it is held."),
        Output("Joints", "J", "Curve", "Outlines of the joints.", "list"),
        Output("Interlock", "I", "Number", "Score of the interlock, 0 to 1."),
        Output("Model", "M", "Text", "The wall with its exact joints, for Check and Sequence."),
    ),
    _polygonal_wall,
)  # fmt: skip
