"""The parts of a wall that are laid out by rule: its foot, quoins at its ends, and a coping.

Quoins are corner stones, long and short in turn, one to a course, so that each ties into the field beyond its
neighbours. The coping is a row of equal stones over everything. The foot is a line of heights over the ground's level;
the wall stands on it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.options import finite, positive
from cyclopean.errors import InputError

__all__ = ["Coping", "End", "Quoins", "coping_stones", "foot_line", "quoin_stones", "shared_coping"]

LEAST = 0.5  # share of a quoin that openings and foot must leave; otherwise the field takes its place
CLEAR = 0.15  # of a coping stone's length: its joints keep this far from those of the quoins

Foot = Callable[[float], float] | Sequence[tuple[float, float]] | None
End = Literal["left", "right"]


@dataclass(frozen=True, slots=True)
class Quoins:
    """Corner stones at one or both ends of a wall; lengths in m along it."""

    long: float = 0.5
    short: float = 0.28
    height: float | None = None  # None = one to a course
    left: bool = True
    right: bool = True
    corner: End | None = None  # end at which another wall turns off: the short quoins are the ends of its long ones

    def __post_init__(self) -> None:
        positive("quoins short", self.short)
        if not positive("quoins long", self.long) >= self.short:
            raise InputError(f"quoins long: {self.long:g} m is less than short, {self.short:g} m; exchange them")
        if self.height is not None:
            positive("quoins height", self.height)
        if not (self.left or self.right):
            raise InputError("quoins: neither end is wanted; leave the quoins out")
        if self.corner is not None and not (self.right if self.corner == "right" else self.left):
            raise InputError(f"quoins: a corner needs them; leave those at the {self.corner} end")


@dataclass(frozen=True, slots=True)
class Coping:
    """A row of equal stones along the top; lengths in m."""

    height: float = 0.12
    length: float = 0.5  # about; the row is divided evenly

    def __post_init__(self) -> None:
        positive("coping height", self.height)
        positive("coping length", self.length)


def foot_line(foot: Foot, radius: float | None, width: float, facets: int) -> Floats | None:
    """Corners of the line on which the wall stands, from left to right, (k, 2) m; None where it is straight.

    Parameters
    ----------
    foot : callable, sequence of (u, v), or None
        Heights in m over the level of v = 0: a function of u, or points of a line from u = 0 to the far end.
    radius : float or None
        Of a circular foot (m): positive for ground that is highest in the middle, negative for a hollow.
    width : float
        Of the wall (m).
    facets : int
        Number of straight pieces in which a curve is drawn.

    Raises
    ------
    InputError
        Both given, heights below 0, a line that does not run from end to end, or a radius below half the width.
    """
    if foot is None and radius is None:
        return None
    if foot is not None and radius is not None:
        raise InputError("base: give a line of heights or a radius, not both")
    u = np.linspace(0.0, width, facets + 1)
    if radius is not None:
        if not abs(finite("base_radius", radius)) >= width / 2.0:
            raise InputError(f"base_radius: {radius:g} m is below half the wall's width; at least {width / 2.0:g} m")
        height = np.sqrt(np.maximum(radius**2 - (u - width / 2.0) ** 2, 0.0))
        line = np.stack([u, height - height[0] if radius > 0.0 else height.max() - height], 1)
    elif callable(foot):
        line = np.array([[x, finite("base", foot(float(x)))] for x in u])
    else:
        line = np.array([[finite("base", x), finite("base", v)] for x, v in foot or ()]).reshape(-1, 2)
        if len(line) < 2 or line[0, 0] != 0.0 or line[-1, 0] != width or not np.all(np.diff(line[:, 0]) > 0.0):
            raise InputError(f"base: the points must run from u = 0 to u = {width:g}, each to the right of the last")
    if not np.all(line[:, 1] >= 0.0):
        raise InputError(f"base: the height {line[:, 1].min():g} m is below 0; measure from the lowest point")
    return line if line[:, 1].any() else None


def coping_stones(
    coping: Coping, width: float, height: float, avoid: Floats, shared: tuple[float, float] = (0.0, 0.0)
) -> list[Floats]:
    """Stones of the coping from left to right, (4, 2) m each, counter-clockwise.

    Their number is the one nearest to the wanted length whose joints keep clear of those given in `avoid` (m): a joint
    that runs on from the quoin below would be a weak line. What is `shared` (m at the left and right end) with the
    coping of another wall round the corner is one stone more.
    """
    first, last = shared[0], width - shared[1]
    count = max(1, round((last - first) / coping.length))
    tries = [k for step in range(4) for k in (count + step, count - step) if k >= 1]
    rows = [np.linspace(first, last, k + 1) for k in tries]
    clear = [np.abs(row[1:-1, None] - avoid).min(initial=np.inf) / (last - first) * (len(row) - 1) for row in rows]
    joint = next((row for row, share in zip(rows, clear, strict=True) if share >= CLEAR), rows[int(np.argmax(clear))])
    joint = np.concatenate([[0.0] * (first > 0.0), joint, [width] * (last < width)])
    low = height - coping.height
    return [np.array([[a, low], [b, low], [b, height], [a, height]]) for a, b in pairwise(joint.tolist())]


def quoin_stones(
    quoins: Quoins, lines: Floats, width: float, foot: Floats | None, taken: Sequence[Floats]
) -> list[Floats]:
    """Stones at the ends, (k, 2) m each, counter-clockwise, less what the foot and other parts take from them.

    Parameters
    ----------
    quoins : Quoins
    lines : (k,) float
        Heights of the course lines (m); the last is the top of the field.
    width : float
        Of the wall (m).
    foot : (k, 2) float or None
        Line on which the wall stands.
    taken : sequence of (k, 2) float
        Polygons in which no quoin can lie.
    """
    import shapely

    cover = shapely.union_all([shapely.polygons(p) for p in taken])
    stones: list[Floats] = []
    for wanted, at_right in ((quoins.left, False), (quoins.right, True)):
        near = np.zeros(1) if foot is None else foot[np.abs(foot[:, 0] - width * at_right) <= quoins.long, 1]
        bed = _beds(quoins, lines, float(near.min()), float(near.max()))
        for k, (low, high) in enumerate(pairwise(bed.tolist()) if wanted else ()):
            length = quoins.long if _is_long(k, at_right) else quoins.short
            a, b = (width - length, width) if at_right else (0.0, length)
            stone = shapely.polygons([[a, low], [b, low], [b, high], [a, high]])
            whole = shapely.area(stone)
            stone = stone if not shapely.intersects(stone, cover) else shapely.difference(stone, cover)
            if shapely.get_type_id(stone) == 3 and shapely.area(stone) >= LEAST * whole:
                ring = shapely.get_exterior_ring(stone)
                corner = shapely.get_coordinates(ring)[:-1]
                stones.append(corner if shapely.is_ccw(ring) else corner[::-1])
    return stones


def shared_coping(quoins: Quoins, lines: Floats) -> tuple[float, float]:
    """What the coping shares with that of the wall round the corner, at the left and right end (m); lines (k,) m.

    The coping goes on with the alternation of the quoins below a straight foot: where the next of them would be short,
    so is the coping's last stone.
    """
    if quoins.corner is None:
        return 0.0, 0.0
    at_right = quoins.corner == "right"
    short = 0.0 if _is_long(len(_beds(quoins, lines, 0.0, 0.0)) - 1, at_right) else quoins.short
    return (0.0, short) if at_right else (short, 0.0)


def _is_long(k: int, at_right: bool) -> bool:
    """Whether the k-th quoin from the foot is a long one: at the left end the even ones, at the right the odd ones."""
    return k % 2 == int(at_right)


def _beds(quoins: Quoins, lines: Floats, low: float, high: float) -> Floats:
    """Heights of the quoins' beds over a foot that lies between `low` and `high`, below which they are cut off."""
    if quoins.height is None:
        course = float(lines[1] - lines[0])
        return np.concatenate([[low], lines[lines > high + LEAST * course]])
    return np.linspace(low, float(lines[-1]), max(1, round((float(lines[-1]) - low) / quoins.height)) + 1)
