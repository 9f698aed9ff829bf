"""Drawings of what functions gave, and as which files they are written."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cyclopean.design.ashlar.wall import AshlarWall
    from cyclopean.design.walls.corner import CornerWall
    from cyclopean.design.walls.polygonal import PolygonalWall


def as_files(compose: Callable[[], str]) -> dict[str, Callable[[], str]]:
    """What is written of a drawing to scale that is composed once, by the ending: 1:1 in millimetres.

    Raises
    ------
    InputError
        As DXF is asked for: ezdxf is not installed.
    """
    from cyclopean import io
    from cyclopean.view.svg import true_size

    made = cache(compose)
    return {"svg": lambda: true_size(made()), "dxf": lambda: io.dxf_text(made())}


def drawn(thing: Any) -> dict[str, Callable[[], str]]:
    """What is written of the drawing of a thing that has one, by the ending; loads nothing before it is asked for."""
    return as_files(lambda: _drawing(thing))


def _drawing(thing: Any) -> str:
    found = composer(thing)
    assert found is not None, thing
    return found()


def paged(wall: "AshlarWall | PolygonalWall | CornerWall", notes: Sequence[str] = ()) -> dict[str, Callable[[], str]]:
    """What is written of a wall that is drawn and not checked, with its own drawing first."""

    def compose() -> str:
        from cyclopean.assembly import supports
        from cyclopean.view.model_page import model_html

        made = wall.assembly
        assert made.contacts is not None
        return model_html(made, made.contacts, supports(made)[0], notes, _drawing(wall))

    return {"report": compose}


def composer(thing: Any) -> Callable[[], str] | None:
    """What draws a thing to scale, as one `<svg>` element; None where it has no drawing."""
    from cyclopean.analysis import LimitResult, Result
    from cyclopean.api.stones import StoneCarving, StoneMatch
    from cyclopean.design.ashlar.wall import AshlarWall
    from cyclopean.design.construction.sequence import BuildSequence
    from cyclopean.design.rubble.wall import RubbleWall
    from cyclopean.design.walls.corner import CornerWall
    from cyclopean.design.walls.interlock import interlock
    from cyclopean.design.walls.polygonal import PolygonalWall
    from cyclopean.view.ashlar_drawing import ashlar_svg
    from cyclopean.view.building import building_svg
    from cyclopean.view.carving_drawing import carving_svg
    from cyclopean.view.drawing import picture, picture_at_limit, without_points
    from cyclopean.view.elevation import elevation_svg
    from cyclopean.view.match_page import placed_svg
    from cyclopean.view.rubble_drawing import rubble_svg
    from cyclopean.view.settled_page import told_of
    from cyclopean.view.wall_drawing import corner_svg, wall_svg

    if isinstance(thing, Result | LimitResult):  # as in print in the report: without the points that press
        shown: Callable[[Any], Any] = picture if isinstance(thing, Result) else picture_at_limit
        return lambda: elevation_svg(without_points(shown(thing)), f"Elevation of {thing.assembly.name}")
    if isinstance(thing, BuildSequence):
        return lambda: building_svg(thing)
    if isinstance(thing, StoneMatch):
        return lambda: placed_svg(thing.match, thing.stones, thing.cells)
    if isinstance(thing, StoneCarving):
        of = thing.drawn, thing.fixed, thing.carved, f"{thing.drawn.name} after carving"
        return lambda: carving_svg(*of, "after", thing.built.sawn)
    if isinstance(thing, PolygonalWall):
        depth = thing.thickness.depth
        return lambda: wall_svg(thing.pattern, interlock(thing.pattern, depth=depth), thing.assembly.name)
    if isinstance(thing, CornerWall):
        return lambda: corner_svg(thing, thing.assembly.name)
    if isinstance(thing, AshlarWall):
        return lambda: ashlar_svg(thing, thing.assembly.name)
    if isinstance(thing, RubbleWall):
        return lambda: rubble_svg(thing.assembly, thing.assembly.name, told=told_of(thing))
    return None
