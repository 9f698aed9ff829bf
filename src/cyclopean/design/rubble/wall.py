"""Rubble walls: how one is laid, and what it is then."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly
from cyclopean.assembly.patches import Patch, usual_band
from cyclopean.design.options import at_least, not_negative, positive
from cyclopean.design.rubble.height_map import MOST_CELLS
from cyclopean.design.rubble.places import Weights
from cyclopean.design.rubble.standing import FRICTION
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError
from cyclopean.geometry.frames import affine
from cyclopean.options import option

__all__ = ["OVERLAP", "Laid", "Measures", "RubbleWall", "SettleSettings", "filled_in", "mean_length", "ways_of"]

OVERLAP = 1e-3  # of a stone's volume: what it may share with another one
LEAN, STEEP = 4.0, 45.0  # degrees: by which gravity leans while laying, and what is too much
CELLS = 20  # of a mean stone's length
SLENDER = 2.0  # times its thickness: height that a wall is planned for
FEW, WAYS, MOST_WAYS = 32, 4, 6  # of so few stones, so many walls are laid; and no more
SOLIDITY = 0.4  # share of stone in a wall, to find its length by
WIDE, WIDE_OF_TWO = 90.0, 75.0  # percentile of the stones' widths that a wythe is made for


@dataclass(frozen=True, slots=True)
class SettleSettings:
    """How a rubble wall is laid. None: found from the stones."""

    length: float | None = option(None, "Of the wall (m) [to suit the stones].", "number", metavar="L")
    height: float | None = option(None, "No stone reaches higher (m) [as high as they go].", "number", metavar="L")
    thickness: float | None = option(None, "Of the wall (m) [to suit the stones].", "number", metavar="L")
    wythes: int = option(1, "Stones side by side through the wall.", "whole", choices=("1", "2"))
    cell: float | None = option(None, "Of the height map (m) [1/20 of a stone].", "number", metavar="L")
    yaws: int = option(8, "Turns about the vertical that are tried.", "whole", metavar="N")
    weights: Weights = field(default_factory=Weights)
    look_ahead: int = option(8, "Stones that compete for a place; 0: in their order.", "whole", metavar="N")
    margin: float | None = option(
        None, "Depth (m) of the centre of mass inside what bears a stone [1/20 of its size].", "number", metavar="L"
    )
    friction: float = option(FRICTION, "Friction that is counted on while laying.", "number", metavar="M", word="mu")
    lean: float = option(LEAN, "Gravity may lean by so much, four ways, while laying.", "number", metavar="DEG")
    tries: int = 8  # places at which stones are seated before a gap is left
    hearting: bool = option(False, "Small stones go into the hollows.", "flag")
    chinking: bool = option(False, "Drive wedges under stones that would rock.", "flag")
    band: float | None = None  # m: surfaces nearer than that make a contact
    ways: int | None = option(
        None, "Walls laid, of which the best is kept [4 of up to 32 stones].", "whole", metavar="N"
    )

    def __post_init__(self) -> None:
        for name in ("length", "height", "thickness", "cell", "band"):
            value = getattr(self, name)
            object.__setattr__(self, name, None if value is None else positive(name, value))
        for name, least in (("yaws", 1), ("look_ahead", 0), ("tries", 1)):
            object.__setattr__(self, name, at_least(name, getattr(self, name), least))
        if self.ways is not None:
            object.__setattr__(self, "ways", at_least("ways", self.ways, 1))
        object.__setattr__(self, "margin", None if self.margin is None else not_negative("margin", self.margin))
        object.__setattr__(self, "friction", positive("friction", self.friction))
        object.__setattr__(self, "lean", not_negative("lean", self.lean))
        if (self.ways or 1) > MOST_WAYS:
            raise InputError(f"ways: {self.ways}; give no more than {MOST_WAYS}")
        if not self.lean < STEEP:
            raise InputError(f"lean: {self.lean:g} degrees; give less than {STEEP:g}")
        if self.wythes not in (1, 2):
            raise InputError(f"wythes: expected 1 or 2, got {self.wythes!r}")


@dataclass(frozen=True, slots=True, eq=False)
class Laid:
    """A stone where it lies: x_wall = rotation x_stone + shift."""

    stone: int  # in the inventory
    rotation: Floats  # (3, 3)
    shift: Floats  # (3,) m
    course: int
    wythe: int  # 0 = front, 1 = rear, 2 = hearting
    margin: float  # m: of the centre of mass inside the hull of the contacts, in plan; negative outside
    stable: bool  # margin is positive, and at least what was asked for
    support: float  # share of its plan under which it nearly touches
    contacts: Floats  # (n, 3) m, world

    @property
    def transform(self) -> Floats:
        """(4, 4) from the stone's frame to the wall's."""
        return affine(self.rotation, self.shift)


@dataclass(frozen=True, slots=True)
class Measures:
    """What came out."""

    void: float  # share of the wall that is not stone, between its faces and below its skyline
    hollow: float  # share that is not stone below the stones' own upper surface
    stable: float  # share of the stones there are that are in the wall and stable
    courses: int
    height: float  # m: of the highest stone
    length: float  # m
    thickness: float  # m
    overlap: float  # largest share of its volume that a stone has in common with another one
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class RubbleWall:
    """A settled wall."""

    laid: tuple[Laid, ...]  # in the order in which they were laid
    left_over: Ints  # stones of the inventory that are not in the wall
    settings: SettleSettings  # with all that was left open filled in but the height
    measures: Measures
    assembly: Assembly  # the ground, the stones, then wedges; with the contacts of the real meshes
    patches: tuple[Patch, ...]  # where surfaces meet: one of each contact, then those that are too narrow for one
    wedges: int = 0


def filled_in(stones: Sequence[Stone], settings: SettleSettings) -> SettleSettings:
    """The settings with lengths for what was left open."""
    extent = np.array([np.ptp(s.vertices @ s.axes.T, axis=0) for s in stones])
    mean = mean_length(stones)
    cell = settings.cell or mean / CELLS
    longest = float(extent[:, 0].max()) + 2.0 * cell
    share = WIDE if settings.wythes == 1 else WIDE_OF_TWO
    thickness = settings.thickness or settings.wythes * float(np.percentile(extent[:, 1], share)) + cell
    face = math.fsum(s.volume for s in stones) / SOLIDITY / thickness  # m2 of wall
    length = settings.length or max(face / (settings.height or SLENDER * thickness), longest)
    if not length / cell * (thickness / cell) <= MOST_CELLS:
        raise InputError(f"cell: {cell:g} m makes a map of more than {MOST_CELLS:,} cells; use larger ones")
    if length < cell or thickness < cell:
        raise InputError(f"cell: {cell:g} m is more than the wall is long or thick; use smaller ones")
    return replace(
        settings,
        length=length,
        thickness=thickness,
        cell=cell,
        band=settings.band or usual_band(np.array([stone.volume for stone in stones])),
        ways=ways_of(settings, len(stones)),
    )


def ways_of(settings: SettleSettings, stones: int) -> int:
    """How many walls are laid of so many stones."""
    return settings.ways or (WAYS if stones <= FEW else 1)


def mean_length(stones: Sequence[Stone]) -> float:
    """Mean extent (m) along the longest axis; to the bit the same in any order of the stones."""
    return math.fsum(float(np.ptp(s.vertices @ s.axes[0])) for s in stones) / len(stones)
