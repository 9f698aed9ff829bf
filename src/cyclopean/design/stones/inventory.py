"""An inventory of found stones, and what can be said of the shape of each.

By hand, for a brick of 4 x 2 x 1: b/a = 1/2, c/b = 1/2, a blade; it fills its hull; its sphericity is
pi^(1/3) (6 * 8)^(2/3) / 28 = 0.691.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError
from cyclopean.geometry.frames import spiral, unit
from cyclopean.geometry.packed import components
from cyclopean.geometry.sides import Sides
from cyclopean.representation import one_line

__all__ = ["CLASSES", "FlatFace", "Inventory", "Shape", "aspect_class", "flat_faces", "shape_of", "size_of"]

CLASSES = ("block", "slab", "bar", "blade")  # Zingg's sphere, disc, rod and blade
ZINGG = 2.0 / 3.0  # his limit of both ratios
FLAT_ANGLE = 15.0  # degrees by which triangles of a flat face may look away from it
FLAT_SHARE = 0.04  # of the surface; below it a flat face is no bed. A sphere's best cap within 15 degrees has 0.017
FLAT_MOST = 8  # faces told of; a box has six
DIRECTIONS = 1000  # tried, 6 degrees apart; the mean of what is gathered moves on from there
BLOCK = 1 << 12  # triangles looked at together, so that memory stays modest


@dataclass(frozen=True, slots=True, eq=False)
class Inventory:
    """Stones that can be used, and what became of those that had to be repaired or refused."""

    __repr__ = one_line

    stones: tuple[Stone, ...]  # unique ids, by name of file, then in the order of the file
    notes: tuple[str, ...] = ()  # what was repaired or passed over, one line each
    refused: tuple[str, ...] = ()  # file or stone, and why, one line each
    source: str = "stones"

    def __post_init__(self) -> None:
        for name in ("stones", "notes", "refused"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        twice = [name for name, count in Counter(s.id for s in self.stones).items() if count > 1]
        if twice:
            raise InputError(f"stone '{twice[0]}': the id stands twice; ids must be unique")

    def __len__(self) -> int:
        return len(self.stones)


@dataclass(frozen=True, slots=True)
class Shape:
    """Ratios that do not depend on size; a >= b >= c are the semi-axes of the ellipsoid of the same inertia."""

    elongation: float  # b / a
    flatness: float  # c / b
    thinness: float  # c / a
    solidity: float  # volume / volume of the convex hull
    sphericity: float  # area of the sphere of the same volume / area (Wadell 1932)
    aspect: str  # one of CLASSES


def shape_of(stone: Stone) -> Shape:
    """Describe the shape of a stone."""
    a, b, c = stone.half.tolist()
    sphere = np.pi ** (1.0 / 3.0) * (6.0 * stone.volume) ** (2.0 / 3.0)
    return Shape(b / a, c / b, c / a, stone.volume / stone.hull_volume, sphere / stone.area, aspect_class(stone.half))


def aspect_class(half: Sequence[float] | Floats) -> str:
    """Name the class of Zingg (1935) of semi-axes a >= b >= c (m), with his limits of two thirds.

    "block" where b/a and c/b are both above (his spheres), "slab" where only b/a is (discs), "bar" where only c/b is
    (rods), "blade" where neither is.

    Examples
    --------
    >>> [aspect_class(half) for half in ([1.0, 0.9, 0.8], [1.0, 0.9, 0.3], [1.0, 0.4, 0.3], [1.0, 0.5, 0.2])]
    ['block', 'slab', 'bar', 'blade']
    """
    a, b, c = (float(x) for x in half)
    wide, thick = b > ZINGG * a, c > ZINGG * b
    return CLASSES[2 * (not wide) + (not thick)]


def size_of(stone: Stone) -> float:
    """Diameter of the sphere of the same volume (m)."""
    return float((6.0 * stone.volume / np.pi) ** (1.0 / 3.0))


@dataclass(frozen=True, slots=True, eq=False)
class FlatFace:
    """A part of the surface that is nearly plane: a bed, if it is large."""

    area: float  # m2
    normal: Floats  # (3,) unit, outward, stone frame
    point: Floats  # (3,) m, centroid, stone frame
    misfit: float  # m: root mean square distance of the surface from the plane
    triangles: Ints  # (k,) of the stone


def flat_faces(stone: Stone, angle: float = FLAT_ANGLE, share: float = FLAT_SHARE) -> tuple[FlatFace, ...]:
    """Find the largest nearly plane parts of the surface, the largest first.

    The direction within `angle` of which most of the surface looks is taken, of that surface the largest part that
    hangs together, and so again with what is left while a part has the wanted share. Surface is weighed by area
    throughout, so the answer does not depend on how the stone was triangulated.

    Parameters
    ----------
    stone : Stone
        A measured stone.
    angle : float
        Degrees by which the surface may look away from the mean.
    share : float
        Least area of a flat face as share of the surface.

    Returns
    -------
    tuple of FlatFace
        At most eight.
    """
    corner = stone.vertices[stone.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2.0
    area = np.linalg.norm(across, axis=1)
    normal = unit(across)
    sides = Sides.of(stone.triangles.reshape(-1), np.arange(0, stone.triangles.size + 1, 3))
    one, two = sides.pairs()
    beside = sides.face[one], sides.face[two]
    limit = float(np.cos(np.radians(angle)))
    way = spiral(DIRECTIONS) @ stone.axes  # turns with the stone
    score = _looking(way, normal, area, limit)
    left = area > 0.0
    found: list[FlatFace] = []
    while len(found) < FLAT_MOST:
        part = _part(normal, area, beside, left, way[int(np.argmax(score))], limit)
        if not (len(part) and area[part].sum() >= share * stone.area):
            break
        found.append(_face(corner, across, area, part))
        left[part] = False
        score -= _looking(way, normal[part], area[part], limit)
    return tuple(sorted(found, key=lambda face: -face.area))


def _looking(way: Floats, normal: Floats, area: Floats, limit: float) -> Floats:
    """(n,) m2 of surface that looks the way of each direction."""
    total = np.zeros(len(way))
    for k in range(0, len(area), BLOCK):
        total += (way @ normal[k : k + BLOCK].T > limit) @ area[k : k + BLOCK]
    return total


def _part(normal: Floats, area: Floats, beside: tuple[Ints, Ints], left: Bools, way: Floats, limit: float) -> Ints:
    """The largest part that hangs together of what looks the same way, about `way`."""
    chosen = left
    for _ in range(5):  # the mean moves to the middle of what it gathers
        chosen = left & (normal @ way > limit)
        way = area[chosen] @ normal[chosen]
        way = way / max(float(np.linalg.norm(way)), 1e-300)
    one, two = (side[chosen[beside[0]] & chosen[beside[1]]] for side in beside)
    label = components(len(area), one, two)
    weight = np.bincount(label, np.where(chosen, area, 0.0))
    return np.flatnonzero((label == np.argmax(weight)) & chosen)


def _face(corner: Floats, across: Floats, area: Floats, part: Ints) -> FlatFace:
    """Measure a part; the square of a linear function has the mean (sum of squares + square of sum) / 12."""
    total = float(area[part].sum())
    normal = across[part].sum(axis=0)
    normal = normal / np.linalg.norm(normal)
    point = area[part] @ corner[part].mean(axis=1) / total
    height = (corner[part] - point) @ normal
    square = (np.square(height).sum(axis=1) + np.square(height.sum(axis=1))) / 12.0
    return FlatFace(total, normal, point, float(np.sqrt(area[part] @ square / total)), part)
