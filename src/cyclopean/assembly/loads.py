"""Loads beside the weight: at points, on faces, throughout a volume; in cases, and the combinations of these."""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, sealed
from cyclopean.errors import InputError

__all__ = ["DEAD", "SELF", "BodyLoad", "Combination", "Load", "SurfaceLoad", "check_case"]

DEAD = "dead"  # the case of loads that name none
SELF = "self"  # the case of the weight; no load may take it


def check_case(case: str) -> None:
    """Refuse a case without a name, or with that of the weight."""
    if case == SELF:
        raise InputError(f"loads: the case '{SELF}' is the weight of the blocks; name this one otherwise")
    if not case:
        raise InputError("loads: a case needs a name")


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """A force that stays as it is while the block moves."""

    block: int  # index into Assembly.blocks
    force: Floats  # (3,) N, world
    point: Floats  # (3,) m, world
    case: str = DEAD

    def __post_init__(self) -> None:
        for name in ("force", "point"):
            object.__setattr__(self, name, sealed(f"load {name}", getattr(self, name), 3))
        check_case(self.case)


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceLoad:
    """A load spread evenly over a face of a block, or over a polygon on one; either a pressure or a traction."""

    block: int  # index into Assembly.blocks
    face: int | None = None  # index into the block's faces
    polygon: Floats | None = None  # (k, 3) m, world, counter-clockwise seen from outside
    pressure: float | None = None  # Pa, positive presses inward
    traction: Floats | None = None  # (3,) Pa, world
    case: str = DEAD

    def __post_init__(self) -> None:
        if (self.face is None) == (self.polygon is None):
            raise InputError('loads: a surface load acts on a "face" or on a "polygon"; give one of them')
        if (self.pressure is None) == (self.traction is None):
            raise InputError('loads: a surface load is a "pressure" or a "traction"; give one of them')
        if self.pressure is not None and not np.isfinite(self.pressure):
            raise InputError("loads: a pressure must be a finite number of Pa")
        for name, shape in (("polygon", (None, 3)), ("traction", (3,))):
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, sealed(f"load {name}", value, *shape))
        if self.polygon is not None and len(self.polygon) < 3:
            raise InputError("loads: the polygon of a surface load needs at least 3 points")
        check_case(self.case)


@dataclass(frozen=True, slots=True, eq=False)
class BodyLoad:
    """A load throughout the volume of one block, of a group of blocks or of all.

    A force density, an acceleration, or the whole force, of which nobody said where on the block it acts.
    """

    block: int | None = None  # index into Assembly.blocks
    group: str | None = None  # all blocks of this group; neither = all blocks
    body: Floats | None = None  # (3,) N/m3, world
    acceleration: Floats | None = None  # (3,) m/s2, world: times the mass, as gravity is
    force: Floats | None = None  # (3,) N, world, at the centre of mass of each
    case: str = DEAD

    def __post_init__(self) -> None:
        if self.block is not None and self.group is not None:
            raise InputError('loads: a body force acts on a "block" or on a "group"; give one of them, or neither')
        names = ("body", "acceleration", "force")
        if sum(getattr(self, name) is not None for name in names) != 1:
            raise InputError(
                'loads: a body force is "body" (N/m3), "acceleration" (m/s2) or "force" (N); give one of them'
            )
        for name in names:
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, sealed(f"load {name}", value, 3))
        check_case(self.case)


@dataclass(frozen=True, slots=True)
class Combination:
    """Factors on the cases of a model; a case that is not named has 0, the weight ("self") 1."""

    name: str
    factors: tuple[tuple[str, float], ...]  # case and factor

    def __post_init__(self) -> None:
        if not self.name:
            raise InputError("combinations: a combination needs a name")
        names = [case for case, _ in self.factors]
        if len(set(names)) < len(names):
            raise InputError(f"combination '{self.name}': a case stands twice in its factors")
        for case, factor in self.factors:
            if not np.isfinite(factor):
                raise InputError(f"combination '{self.name}': the factor of '{case}' must be a finite number")
