"""A wall of polygonal stones in one call."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from cyclopean.api.inputs import said

if TYPE_CHECKING:
    from cyclopean.design.walls.dressing import Coping, Foot, Quoins
    from cyclopean.design.walls.joints import Warped
    from cyclopean.design.walls.openings import Opening
    from cyclopean.design.walls.pattern import PatternSettings
    from cyclopean.design.walls.polygonal import PolygonalWall
    from cyclopean.design.walls.surfaces import Surface

__all__ = ["polygonal_wall"]


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
    surface: "Surface | None" = None,
    depth: float = 0.2,
    batter: float = 0.0,
    density: float | None = None,
    mu: float | None = None,
    warped: "Warped" = "auto",
    improve: bool = False,
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
    surface : Surface, optional
        The face of the wall; an upright plane where not given.
    depth : float
        Thickness along the normal (m), at the foot.
    batter : float
        By how much the front recedes (m a metre of height).
    density, mu : float, optional
        kg/m3 and friction coefficient, kept in the model; not said where not given.
    warped : {"auto", "triangles", "plane"}
        What a contact becomes whose corners lie in no plane.
    improve : bool
        Move and weight the seeds until the stones interlock better.

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
    from cyclopean.design.walls.pattern import PatternSettings

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
        courses=courses,
        size_grade=size_grade,
        sliver=sliver,
        max_bed=max_bed,
        openings=None if openings is None else tuple(openings),
        quoins=quoins,
        coping=coping,
        base=base,
        base_radius=base_radius,
    )
    return polygonal.polygonal_wall(
        pattern,
        surface=surface,
        depth=depth,
        batter=batter,
        density=density,
        mu=mu,
        warped=warped,
        improve=improve,
    )
