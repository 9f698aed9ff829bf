"""Doors and windows: what is cut out of a wall, and the stones that carry the wall over it.

A lintel is one stone that bears on both sides. An arch is a ring of wedges with a keystone: the clear shape follows the
chords of the soffit, so that what is cut out is exactly what the wedges leave. With half width a and rise r the soffit
has the radius (a^2 + r^2) / (2 r).

By hand: a window 1 m wide and 1 m high under a lintel 0.2 m thick that bears 0.2 m takes 1 m2 out of the wall.

>>> window = Opening(left=1.0, width=1.0, height=1.0, sill=0.5)
>>> clear_shape(window).tolist()
[[1.0, 0.5], [2.0, 0.5], [2.0, 1.5], [1.0, 1.5]]
>>> [(kind, stone.min(axis=0).tolist(), stone.max(axis=0).tolist()) for kind, stone in head_stones(window)]
[('lintel', [0.8, 1.5], [2.2, 1.7])]
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.options import at_least, not_negative, one_of, positive
from cyclopean.errors import InputError

__all__ = ["Kind", "Opening", "clear_shape", "fitting", "head_stones"]

Kind = Literal["stone", "lintel", "voussoir", "keystone", "quoin", "coping"]  # what a cell of a wall is
Head = Literal["lintel", "arch"]

SHARE = 0.2  # of the clear width: default thickness of a lintel or ring, and default bearing
WEDGE = 0.75  # default width of a voussoir at mid-ring, as a share of the ring's thickness


@dataclass(frozen=True, slots=True)
class Opening:
    """A door (sill 0) or window, in the wall's own plane; lengths in m."""

    left: float  # of the left jamb, from the wall's left end
    width: float
    height: float  # clear, from the sill to the soffit or its crown
    sill: float = 0.0  # 0 = a door that reaches the ground
    head: Head = "lintel"
    thickness: float | None = None  # of the lintel or ring; None = a fifth of the width
    bearing: float | None = None  # of the lintel on each side; None = a fifth of the width
    rise: float | None = None  # of the arch; None = half the width, a semicircle
    voussoirs: int | None = None  # odd, so that there is a keystone; None = as many as look right

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            positive(f"opening {name}", getattr(self, name))
        for name in ("left", "sill"):
            not_negative(f"opening {name}", getattr(self, name))
        for name in ("thickness", "bearing", "rise"):
            if (value := getattr(self, name)) is not None:
                positive(f"opening {name}", value)
        one_of("opening head", self.head, Head)
        if self.head == "arch" and not self.arch_rise <= min(self.width / 2.0, self.height):
            raise InputError(
                f"opening rise: {self.arch_rise:g} m is more than half the width or the height; give a smaller rise"
            )
        if self.voussoirs is not None and at_least("opening voussoirs", self.voussoirs, 3) % 2 == 0:
            raise InputError(f"opening voussoirs: {self.voussoirs} leaves no keystone; give an odd number")

    @property
    def arch_rise(self) -> float:
        """Rise of the arch (m)."""
        return self.width / 2.0 if self.rise is None else self.rise

    @property
    def head_thickness(self) -> float:
        """Height of the lintel, or thickness of the ring (m)."""
        return SHARE * self.width if self.thickness is None else self.thickness

    @property
    def top(self) -> float:
        """Height of the soffit or its crown (m)."""
        return self.sill + self.height


def clear_shape(opening: Opening) -> Floats:
    """What is cut out of the wall: (k, 2) m, counter-clockwise from the lower left corner."""
    left, right = opening.left, opening.left + opening.width
    low = [[left, opening.sill], [right, opening.sill]]
    if opening.head == "lintel":
        return np.array([*low, [right, opening.top], [left, opening.top]])
    soffit = _ring(opening)[0][::-1]
    if opening.arch_rise == opening.height:  # the arch springs from the sill
        return soffit[np.r_[-1, : len(soffit) - 1]]
    return np.concatenate([low, soffit])


def head_stones(opening: Opening) -> list[tuple[Kind, Floats]]:
    """Kind and corners (k, 2) m, counter-clockwise, of the stones that carry the wall over the opening."""
    if opening.head == "lintel":
        bearing = SHARE * opening.width if opening.bearing is None else opening.bearing
        left, right = opening.left - bearing, opening.left + opening.width + bearing
        low, high = opening.top, opening.top + opening.head_thickness
        return [("lintel", np.array([[left, low], [right, low], [right, high], [left, high]]))]
    inner, outer = _ring(opening)
    middle = len(inner) // 2 - 1
    return [
        ("keystone" if k == middle else "voussoir", np.array([inner[k], inner[k + 1], outer[k + 1], outer[k]]))
        for k in range(len(inner) - 1)
    ]


def fitting(openings: Sequence[Opening], width: float, low: float, top: float) -> None:
    """Refuse openings that, with their heads, leave the wall or come upon each other.

    Parameters
    ----------
    openings : sequence of Opening
    width : float
        Of the wall (m).
    low : float
        Highest point of the ground (m); the heads stay above it.
    top : float
        Underside of the coping, or top of the wall (m).

    Raises
    ------
    InputError
        Names the opening and what would fit.
    """
    import shapely

    shapes = []
    for k, opening in enumerate(openings):
        parts = [clear_shape(opening), *(stone for _, stone in head_stones(opening))]
        corner = np.concatenate(parts)
        (left, _), (right, high) = corner.min(axis=0), corner.max(axis=0)
        if not (left > 0.0 and right < width):
            raise InputError(
                f"openings: number {k + 1} with its head reaches from {left:g} to {right:g} m, "
                f"outside the wall's 0 to {width:g} m; move it or make it narrower"
            )
        if not high < top:
            raise InputError(
                f"openings: number {k + 1} with its head reaches up to {high:g} m and the wall only to {top:g} m "
                "below its coping; make it lower"
            )
        if (opening.head == "arch" and not opening.top - opening.arch_rise > low) or not opening.top > low:
            raise InputError(f"openings: number {k + 1} has its head in the ground, which rises to {low:g} m; raise it")
        shapes.append(shapely.union_all([shapely.polygons(p) for p in parts]))
    for k, one in enumerate(shapes):
        for j in range(k):
            if not shapely.distance(one, shapes[j]) > 1e-6 * width:
                raise InputError(f"openings: numbers {j + 1} and {k + 1} overlap or touch; leave stone between them")


def _ring(opening: Opening) -> tuple[Floats, Floats]:
    """Soffit and back of the arch, from left to right, (n + 1, 2) m each."""
    half, rise, thick = opening.width / 2.0, opening.arch_rise, opening.head_thickness
    radius = (half**2 + rise**2) / (2.0 * rise)
    reach = np.arctan2(half, radius - rise)
    count = opening.voussoirs
    if count is None:
        count = max(3, 2 * round(reach * (radius + thick / 2.0) / (WEDGE * thick) - 0.5) + 1)
    angle = np.linspace(-reach, reach, count + 1)
    way = np.stack([np.sin(angle), np.cos(angle)], 1)
    centre = np.array([opening.left + half, opening.top - radius])
    inner, outer = centre + radius * way, centre + (radius + thick) * way
    spring = opening.top - rise
    inner[0], inner[-1] = (opening.left, spring), (opening.left + opening.width, spring)
    if rise == half:  # level springings, exactly
        outer[[0, -1], 1] = spring
    return inner, outer
