"""Rubble walls: how one is laid, and what it is then."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.assembly.patches import Patch
from cyclopean.design.options import at_least, not_negative, positive
from cyclopean.design.rubble.dressing import Cut
from cyclopean.design.rubble.height_map import MOST_CELLS
from cyclopean.design.rubble.masons_rules import MasonsRules
from cyclopean.design.rubble.places import Scores
from cyclopean.design.rubble.shape import SLENDER, Shape
from cyclopean.design.rubble.standing import FRICTION
from cyclopean.design.stones.stone import Stone
from cyclopean.design.walls.openings import Opening
from cyclopean.errors import InputError
from cyclopean.geometry.frames import affine
from cyclopean.options import option
from cyclopean.representation import one_line

__all__ = ["FEW", "OVERLAP", "Laid", "Measures", "RubbleWall", "SettleSettings", "filled_in", "unit_size"]

OVERLAP = 1e-3  # of a stone's volume: what it may share with another one
LEAN, STEEP = 6.0, 45.0  # degrees: by which gravity leans while laying, and what is too much
CELLS = 8.5  # of the unit
SOLIDITY = 0.4  # share of stone in a wall, to find its length by
WIDE = 90.0  # percentile of the stones' widths that a wythe is made for
FEW, WAYS, MOST_WAYS = 60, 2, 6  # of so few stones, so many walls are laid; and no more
ENDS = ("vertical", "racked")
RACK = 1.0  # for each metre of height, where ends are racked: 45 degrees
MOST_DRESSED = 0.2  # share of a stone: more is no dressing, it is carving
STEEPEST_BATTER = 0.5  # 1:2: beyond that a wall is a slope


@dataclass(frozen=True, slots=True)
class SettleSettings:
    """How a rubble wall is laid. None: found from the stones."""

    length: float | None = option(None, "Of the wall (m) [to suit the stones].", "number", metavar="L")
    height: float | None = option(None, "No stone reaches higher (m) [as high as they go].", "number", metavar="L")
    thickness: float | None = option(None, "Of the wall at its foot (m) [to suit the stones].", "number", metavar="L")
    wythes: int = option(
        1, "2: two faces, with hearting between them and through-stones to tie them.", "whole", choices=("1", "2")
    )
    batter: str | None = option(None, "The faces lean inwards, by 1 in N of their height.", metavar="1:N")
    corner: float | None = option(
        None, "A second leg runs back from the far end: its length along the outer face (m).", "number", metavar="L"
    )
    opening: tuple[float, ...] | None = option(
        None, "Left jamb, sill, clear width and height (m), under lintels of the stock.", "numbers", metavar="X,Z,W,H"
    )
    ends: str = option("vertical", "racked: they step back, so that more can be bonded in.", choices=ENDS)
    coursed: bool = option(False, "Level courses.", "flag")
    through: float | None = option(
        None, "Through-stones so far apart (m), along the wall and up it [1.5 in two wythes].", "number", metavar="L"
    )
    binders: float = option(
        0.0, "Share of the stones that lie with their length into the wall.", "number", metavar="SHARE"
    )
    hearting: bool = option(False, "Small stones are kept for the hollows.", "flag")
    pins: bool = option(False, "Stones that would rock are steadied with chips that fit under them.", "flag")
    copes: bool = option(False, "Large stones of one thickness are kept for the top.", "flag")
    inward: float = option(0.0, "Beds slope into the wall by so much.", "number", metavar="DEG")
    dress: float = option(
        0.0, "Share of its volume that may be knocked off a stone where it keeps it from sitting.", "number",
        metavar="SHARE",
    )  # fmt: skip
    all: bool = option(False, "Lay what does not stand as well, and flag it.", "flag")
    cell: float | None = option(None, "Of the height map (m) [2/17 of a stone].", "number", metavar="L")
    yaws: int = option(16, "Turns about the vertical that are tried.", "whole", metavar="N")
    scores: Scores = field(default_factory=Scores)
    look_ahead: int = option(
        16, "Largest stones left that compete for a place; 0: in their order.", "whole", metavar="N"
    )
    margin: float | None = option(
        None, "Depth (m) of the centre of mass inside what bears a stone [3 % of its size].", "number", metavar="L"
    )
    friction: float = option(FRICTION, "Friction that is counted on while laying.", "number", metavar="M", word="mu")
    lean: float = option(LEAN, "Gravity may lean by so much, four ways, while laying.", "number", metavar="DEG")
    ways: int | None = option(
        None, "Walls laid, of which the best is kept [2 of up to 60 stones].", "whole", metavar="N"
    )

    def __post_init__(self) -> None:
        for name in ("length", "height", "thickness", "cell", "corner", "through"):
            value = getattr(self, name)
            object.__setattr__(self, name, None if value is None else positive(name, value))
        for name, least in (("yaws", 1), ("look_ahead", 0)):
            object.__setattr__(self, name, at_least(name, getattr(self, name), least))
        object.__setattr__(self, "margin", None if self.margin is None else not_negative("margin", self.margin))
        object.__setattr__(self, "friction", positive("friction", self.friction))
        for name in ("lean", "inward"):
            object.__setattr__(self, name, not_negative(name, getattr(self, name)))
            if not getattr(self, name) < STEEP:
                raise InputError(f"{name}: {getattr(self, name):g} degrees; give less than {STEEP:g}")
        if self.ways is not None and at_least("ways", self.ways, 1) > MOST_WAYS:
            raise InputError(f"ways: {self.ways}; give no more than {MOST_WAYS}")
        if not 0.0 <= self.dress <= MOST_DRESSED:
            raise InputError(
                f"dress: {self.dress:g} is not a share from 0 to {MOST_DRESSED:g}; to cut more, use match and carve"
            )
        if not 0.0 <= self.binders <= 1.0:
            raise InputError(f"binders: {self.binders:g} is not a share from 0 to 1")
        if self.binders and self.corner is not None:
            raise InputError("binders: a wall with a corner has two ways into it; leave out `binders` or `corner`")
        if self.wythes not in (1, 2):
            raise InputError(f"wythes: expected 1 or 2, got {self.wythes!r}")
        if self.ends not in ENDS:
            raise InputError(f"ends: expected {' or '.join(ENDS)}, got {self.ends!r}")
        slope_of(self.batter)
        if self.opening is not None and len(self.opening) != 4:
            raise InputError("opening: expected X,Z,W,H: left jamb, sill, clear width and height in metres")

    def shape(self) -> Shape:
        """The wall's faces, once its length and thickness are known."""
        assert self.length is not None
        assert self.thickness is not None
        opening = None
        if self.opening is not None:
            left, sill, width, height = self.opening
            opening = Opening(left, width, height, sill)
            if left + width > self.length or (self.height is not None and sill + height > self.height):
                raise InputError(f"opening: {left:g},{sill:g},{width:g},{height:g} is not within the wall")
        if self.corner is not None and self.corner < self.thickness:
            raise InputError(f"corner: {self.corner:g} m is less than the wall is thick ({self.thickness:g} m)")
        return Shape(
            self.length,
            self.thickness,
            np.inf if self.height is None else self.height,
            slope_of(self.batter),
            self.wythes,
            RACK if self.ends == "racked" else 0.0,
            self.corner or 0.0,
            opening,
        )


def slope_of(batter: str | None) -> float:
    """Length inwards for each length of height, of a batter such as 1:6; 0 of none.

    Raises
    ------
    InputError
        It is none.
    """
    if batter is None:
        return 0.0
    try:
        one, many = (float(part) for part in batter.split(":"))
        slope = one / many
    except (ValueError, ZeroDivisionError):
        raise InputError(f"batter: {batter!r} is none; give 1:N, such as 1:6") from None
    if not 0.0 <= slope <= STEEPEST_BATTER:
        raise InputError(f"batter: {batter} is not between upright and 1:2; give 1:N, such as 1:6")
    return slope


@dataclass(frozen=True, slots=True, eq=False)
class Laid:
    """A stone where it lies: x_wall = rotation x_stone + shift."""

    stone: int  # in the inventory
    rotation: Floats  # (3, 3)
    shift: Floats  # (3,) m
    course: int
    role: str  # stone, through-stone, hearting, pin, lintel or cope
    margin: float  # m: of the centre of mass inside the hull of the contacts, in plan; negative outside
    stable: bool  # it stands by itself, and brought nothing down
    contacts: Floats  # (n, 3) m, world: of what bears it
    reason: str = ""  # why it does not stand
    cuts: tuple[Cut, ...] = ()  # flats that were knocked off it, in its own frame

    @property
    def transform(self) -> Floats:
        """(4, 4) from the stone's frame to the wall's."""
        return affine(self.rotation, self.shift)


@dataclass(frozen=True, slots=True)
class Measures:
    """What came out."""

    void: float  # share of the wall that is not stone, between its faces and below its skyline
    void_tops: float  # share that is not stone below the stones' own upper surface
    face: float  # share of the front below the skyline with stone within a tenth of the thickness
    top: float  # m: standard deviation of the wall's top along it
    courses: int
    height: float  # m: of the highest stone
    level: float  # m: of the wall's top, in the mean along it
    stone: float  # m: cube root of the median volume of the stones
    length: float  # m, as asked
    covered: float  # m of it on which stones stand
    thickness: float  # m
    overlap: float  # largest share of its volume that a stone has in common with another one
    imposition: float  # Lambda: share of the stones' volume that was knocked off
    seconds: float
    masons: MasonsRules | None = None  # None of a wall with a corner: it has more than one face


@dataclass(frozen=True, slots=True, eq=False)
class RubbleWall:
    """A settled wall."""

    __repr__ = one_line

    laid: tuple[Laid, ...]  # in the order in which they were laid
    left_over: tuple[tuple[int, str], ...]  # stones of the inventory that are not in the wall, and why
    settings: SettleSettings  # with all that was left open filled in but the height
    measures: Measures
    assembly: Assembly  # the ground, then the stones; with the contacts of the real meshes
    patches: tuple[Patch, ...]  # where surfaces meet: one of each contact, then those that are too narrow for one
    following: tuple[Laid, ...] = ()  # stones that could be laid next, the best first, where that was asked for


def filled_in(stones: Sequence[Stone], settings: SettleSettings, standing: Sequence[float] = ()) -> SettleSettings:
    """The settings with lengths for what was left open; `standing` are volumes (m3) of what stands already."""
    extent = np.array([np.ptp(s.vertices @ s.axes.T, axis=0) for s in stones])
    cell = settings.cell or unit_size(stones, standing) / CELLS
    longest = float(extent[:, 0].max()) + 2.0 * cell
    thickness = settings.thickness or settings.wythes * float(np.percentile(extent[:, 1], WIDE)) + cell
    face = math.fsum(s.volume for s in stones) / SOLIDITY / thickness  # m2 of wall
    length = settings.length or max(face / (settings.height or SLENDER * thickness), longest)
    if not length / cell * (thickness / cell) <= MOST_CELLS:
        raise InputError(f"cell: {cell:g} m makes a map of more than {MOST_CELLS:,} cells; use larger ones")
    if length < cell or thickness < cell:
        raise InputError(f"cell: {cell:g} m is more than the wall is long or thick; use smaller ones")
    ways = settings.ways or (WAYS if len(stones) <= FEW else 1)
    return replace(settings, length=length, thickness=thickness, cell=cell, ways=ways)


def unit_size(stones: Sequence[Stone], standing: Sequence[float] = ()) -> float:
    """Cube root of the median volume (m): what lengths are told in while laying."""
    return float(np.cbrt(np.median([*(stone.volume for stone in stones), *standing])))
