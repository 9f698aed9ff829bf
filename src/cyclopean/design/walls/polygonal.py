"""The polygonal wall: a pattern (`pattern`) on a surface (`surfaces`) with exact joints (`joints`).

>>> made = polygonal_wall()
>>> made.assembly.blocks[0].id, len(made.assembly) == made.pattern.readout.cells + 1
('ground', True)
"""

from dataclasses import dataclass, replace

from cyclopean.assembly import Assembly, SteepBed
from cyclopean.design.walls.beds import bedded, without_bed
from cyclopean.design.walls.improve import Chosen, improvements, standing
from cyclopean.design.walls.joints import JointReadout, Masonry, Warped, jointed
from cyclopean.design.walls.mapped import Mapped
from cyclopean.design.walls.pattern import Pattern, PatternSettings, draw_pattern
from cyclopean.design.walls.surfaces import Plane, Surface, Thickness, refuse_folds
from cyclopean.representation import one_line

__all__ = ["PolygonalWall", "laid_wall", "polygonal_wall", "verdict"]


@dataclass(frozen=True, slots=True, eq=False)
class PolygonalWall:
    """A drawn wall, what it was drawn from, and how its joints came out."""

    __repr__ = one_line

    assembly: Assembly  # block 0 is the fixed ground, block k + 1 is cell k of the pattern
    pattern: Pattern
    surface: Surface
    thickness: Thickness
    joints: JointReadout
    masonry: Masonry
    chosen: Chosen | None = None  # which of the improved walls this is, and whether it stands; None = not improved

    @property
    def without_bed(self) -> tuple[SteepBed, ...]:
        """Field stones without a face below as flat as the pattern's `max_bed` and the friction angle."""
        field = [k + 1 for k, kind in enumerate(self.pattern.kind) if kind == "stone"]
        return without_bed(self.assembly, field, self.pattern.settings.max_bed)


def polygonal_wall(
    settings: PatternSettings | Pattern | None = None,
    *,
    surface: Surface | None = None,
    depth: float = 0.2,
    batter: float = 0.0,
    density: float | None = None,
    mu: float | None = None,
    warped: Warped = "auto",
    improve: bool | float = False,
) -> PolygonalWall:
    """Draw a wall of polygonal stones that stands on a fixed ground block.

    Parameters
    ----------
    settings : PatternSettings or Pattern, optional
        The pattern, or what to draw one from: 3.0 x 1.8 m from 8 x 5 seeds where not given.
    surface : Surface, optional
        The face of the wall; an upright plane where not given.
    depth : float
        Thickness along the normal (m), at the foot.
    batter : float
        By how much the front recedes (m a metre of height).
    density, mu : float, optional
        kg/m3 of every block, and friction coefficient of every joint; None = not said.
    warped : {"auto", "triangles", "plane"}
        What a contact becomes whose corners lie in no plane, see `design.walls.joints`.
    improve : bool or float
        Move and weight the seeds until the stones interlock with this score J, or as well as they can be made to, see
        `design.walls.improve`; a wall that stands is not given up for one of which coupled analysis cannot say so.

    Raises
    ------
    InputError
        An option that cannot be built, a pattern that cannot be drawn, a surface that bends more than the depth allows.
    """
    pattern = settings or PatternSettings()
    if isinstance(surface, Mapped):
        if isinstance(pattern, Pattern):
            surface.refuse_outside(pattern.subdivision)
        else:  # drawn to cover it
            pattern = draw_pattern(surface.fitted(pattern), surface.area_ratio)
    whole = pattern.settings if isinstance(pattern, Pattern) else pattern
    bed = surface if surface is not None else Plane(), Thickness(depth, batter), Masonry(density, mu, warped)
    refuse_folds(*bed[:2], whole.width, whole.height)
    if not improve:
        return laid_wall(pattern if isinstance(pattern, Pattern) else draw_pattern(pattern), *bed)
    patterns = improvements(pattern, until=float(improve))
    chosen = standing(patterns, lambda pattern: verdict(laid_wall(pattern, *bed).assembly))
    return replace(laid_wall(patterns[chosen.place], *bed), chosen=chosen)


def laid_wall(pattern: Pattern, surface: Surface, thickness: Thickness, masonry: Masonry) -> PolygonalWall:
    """Lay a pattern on a surface, on beds and with exact joints; parameters and errors as `jointed`."""
    pattern = bedded(pattern, surface, thickness)
    name = f"polygonal wall of {pattern.readout.cells}"
    assembly, joints = jointed(pattern, surface, thickness, masonry, name)
    return PolygonalWall(assembly, pattern, surface, thickness, joints, masonry)


def verdict(assembly: Assembly) -> str:
    """What coupled analysis says of a wall: "stable", "unstable" or "undecided"."""
    from cyclopean.analysis import Settings, check

    return check(assembly, Settings(method="cra")).verdict
