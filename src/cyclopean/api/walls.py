"""A wall of polygonal stones in one call, and the interlock of any wall."""

import os
import warnings
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, Unpack

from cyclopean.api.inputs import Model, Path, Reading, assembly_of, said
from cyclopean.api.keywords import LineKeywords, given_to
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.design.walls.dressing import Coping, Foot, Quoins
    from cyclopean.design.walls.front import WallInterlock
    from cyclopean.design.walls.joints import Warped
    from cyclopean.design.walls.line_work import LineReading
    from cyclopean.design.walls.openings import Opening
    from cyclopean.design.walls.pattern import Pattern, PatternSettings
    from cyclopean.design.walls.polygonal import PolygonalWall
    from cyclopean.design.walls.surfaces import Surface
    from cyclopean.io.line_work import Sheet


def chosen_pattern(
    settings: "PatternSettings",
    reading: "LineReading",
    courses: int | None = None,
    max_bed: float | None = None,
    sheet: "Sheet | None" = None,
) -> "PatternSettings | Pattern":
    """The pattern of a wall from the drawing that `reading` names, or what to draw one from where it names none.

    Parameters
    ----------
    settings : PatternSettings
        Of a pattern from seeds.
    reading : LineReading
        The drawing, and how it is read.
    courses, max_bed : optional
        What both have: the number of courses, and how flat beds are to be (degrees).
    sheet : Sheet, optional
        The lines of a drawing that is no file.

    Raises
    ------
    InputError
        A file that cannot be read, a drawing that shows no wall, or options of a pattern from seeds beside it.
    """
    from cyclopean.design.walls.line_work import LineReading, pattern_of
    from cyclopean.design.walls.pattern import PatternSettings
    from cyclopean.io.line_work import line_work_of, read_line_work

    if reading.drawing is None and sheet is None:
        if (name := _unlike(reading, LineReading())) is not None:
            raise InputError.of(name, None, "is of a drawing of joints; give `drawing` too")
        return said(settings, courses=courses, max_bed=max_bed)
    if (name := _unlike(settings, PatternSettings())) is not None:
        raise InputError(f"{name}: is of a pattern from seeds; leave it out, or `drawing`")
    if sheet is None:
        work = read_line_work(reading.drawing or "", reading)
    else:
        work = line_work_of("Drawing", sheet, reading)
    return pattern_of(work, reading.snap, courses, max_bed)


def _unlike(given: Any, usual: Any) -> str | None:
    """The first field of a dataclass that is not as usual."""
    return next((one.name for one in fields(usual) if getattr(given, one.name) != getattr(usual, one.name)), None)


def polygonal_wall(
    settings: "PatternSettings | None" = None,
    *,
    width: float | None = None,
    height: float | None = None,
    columns: int | None = None,
    rows: int | None = None,
    seed: int | None = None,
    jitter: float | None = None,
    lloyd: int | None = None,
    coursing: float | None = None,
    courses: int | None = None,
    size_grade: float | None = None,
    sliver: float | None = None,
    max_bed: float | None = None,
    openings: "Sequence[Opening] | None" = None,
    quoins: "Quoins | None" = None,
    coping: "Coping | None" = None,
    base: "Foot" = None,
    base_radius: float | None = None,
    drawing: Path | None = None,
    surface: "Surface | Path | None" = None,
    depth: float = 0.2,
    batter: float = 0.0,
    density: float | None = None,
    mu: float | None = None,
    warped: "Warped" = "auto",
    improve: bool | float = False,
    **options: Unpack[LineKeywords],
) -> "PolygonalWall":
    """Draw a wall of polygonal stones, with exact joints, on a fixed ground block.

    Parameters
    ----------
    settings : PatternSettings, optional
        The pattern in one object; keywords win over it. 3.0 x 1.8 m from 8 x 5 seeds where nothing is said.
    width, height : float, optional
        m.
    columns, rows : int, optional
        Seeds along and up: about as many stones.
    seed : int, optional
        Of the random numbers; the same seed draws the same wall.
    jitter, lloyd, coursing, courses, size_grade, sliver : optional
        How regular the pattern is; see `PatternSettings`.
    max_bed : float, optional
        Degrees: every stone is to lie on a face as flat as this, 90 = as drawn. Those that could not be given one are
        in `without_bed` of the wall.
    openings : sequence of Opening, optional
        Doors and windows.
    quoins, coping, base, base_radius : optional
        Dressed ends and top, and the line of the ground.
    drawing : path, optional
        DXF or SVG of the joints, instead of a pattern: its faces are the stones. Of the pattern only `courses` and
        `max_bed` may then be said. What was mended or passed over is in `pattern.notes` of the wall.
    surface : Surface or path, optional
        The face of the wall; an upright plane where not given. A file holds one open mesh, or a 3DM one face: it is
        laid flat, and then the pattern is as large as it is; how far that stretches lengths is in `pattern.notes`.
    depth : float
        Thickness along the normal (m), at the foot.
    batter : float
        By how much the front recedes (m a metre of height).
    density, mu : float, optional
        kg/m3 and friction coefficient, kept in the model; not said where not given.
    warped : {"auto", "triangles", "plane"}
        What a contact becomes whose corners lie in no plane.
    improve : bool or float
        Move and weight the seeds until the stones interlock as well as they can be made to, or with this score J.
    **options
        How a drawing or the file of a surface is read: `units`; and how a drawing is: `scale`, `snap`, `deviation`,
        `layer`, as `LineReading` says.

    Returns
    -------
    PolygonalWall
        `assembly` is its structure.

    Raises
    ------
    InputError
        An option that cannot be built, a pattern that cannot be drawn, a surface that bends more than the depth allows.

    Examples
    --------
    >>> made = polygonal_wall(width=2.0, height=1.2, columns=5, rows=3)
    >>> made.assembly.blocks[0].id
    'ground'
    """
    from cyclopean.design.walls import polygonal
    from cyclopean.design.walls.line_work import LineReading
    from cyclopean.design.walls.pattern import PatternSettings

    (reading,) = given_to(polygonal_wall, options, LineReading(None if drawing is None else os.fspath(drawing)))
    notes: tuple[str, ...] = ()
    if isinstance(surface, str | os.PathLike):
        from cyclopean.io.surfaces import read_surface

        surface, notes = read_surface(surface, reading.units)
        reading = reading if reading.drawing is not None else replace(reading, units=None)
    pattern = said(
        PatternSettings() if settings is None else settings,
        width=width,
        height=height,
        columns=columns,
        rows=rows,
        seed=seed,
        jitter=jitter,
        lloyd=lloyd,
        coursing=coursing,
        size_grade=size_grade,
        sliver=sliver,
        openings=None if openings is None else tuple(openings),
        quoins=quoins,
        coping=coping,
        base=base,
        base_radius=base_radius,
    )
    made = polygonal.polygonal_wall(
        chosen_pattern(pattern, reading, courses, max_bed),
        surface=surface,
        depth=depth,
        batter=batter,
        density=density,
        mu=mu,
        warped=warped,
        improve=improve,
    )
    return replace(made, pattern=replace(made.pattern, notes=(*notes, *made.pattern.notes)))


def interlock(
    wall: Model,
    *,
    courses: int | None = None,
    tolerance: float | None = None,
    units: str | None = None,
    strict: bool = False,
) -> "WallInterlock":
    """How well the stones of a wall interlock: the score J, the line of minimum trace, the rules of masons.

    Parameters
    ----------
    wall : path, Assembly, anything with an `assembly`, or bodies
        A wall that was drawn, negotiated, carved, settled, or read from any file; it is plane, or says how it was
        drawn.
    courses : int, optional
        By which J is judged; those of the drawing, or as many as stones of that size make, where not given.
    tolerance : float, optional
        Distance along the wall (m) within which midpoints of head joints coincide; a tenth of their mean spacing where
        not given.
    units, strict : optional
        As of `read_model`.

    Returns
    -------
    WallInterlock
        What was assumed in reading files is a `UserWarning`.

    Raises
    ------
    InputError
        It cannot be read, or is no wall: an arch, a dome, a single course.

    Examples
    --------
    >>> import cyclopean
    >>> cyclopean.interlock(cyclopean.wall(5, 8, length=0.2, height=0.15)).minimum_trace.__round__()
    1583
    """
    found, said = interlocked(wall, courses, tolerance, Reading(units, strict))
    for line in said:
        warnings.warn(line, stacklevel=2)
    return found


def interlocked(
    wall: Model, courses: int | None, tolerance: float | None, reading: Reading
) -> "tuple[WallInterlock, tuple[str, ...]]":
    """`interlock`, and what was assumed in reading the wall."""
    from cyclopean.design.walls.front import interlock_of_stones, interlock_of_wall
    from cyclopean.design.walls.polygonal import PolygonalWall
    from cyclopean.io import read_drawing
    from cyclopean.io.files import one_line

    drawn, stale = read_drawing(wall) if isinstance(wall, str | os.PathLike) else (getattr(wall, "drawn", wall), ())
    if isinstance(drawn, PolygonalWall):
        return interlock_of_wall(drawn, courses=courses, tolerance=tolerance), ()
    assembly, said = assembly_of(wall, reading)
    if isinstance(wall, str | os.PathLike):
        assembly = replace(assembly, name=one_line(wall))  # what is refused is refused by the name of the file
    return interlock_of_stones(assembly, courses=courses, tolerance=tolerance), (*said, *stale)
