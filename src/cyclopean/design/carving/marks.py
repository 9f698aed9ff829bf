"""Marks by which a cut is found on a stone: three points of it that a person can find, and distances from them.

**Numbered points.** A corner is where a stone is pointed: seen from it, all the surface nearby lies one way. With u the
unit vectors from a point to the surface around it,

    sharpness = |mean of u|: 0 on a plane, 2/pi cos 45 = 0.45 on a square edge, 0.735 at a cube's corner, 1 on a needle.

It is taken within `NEAR` of the stone's size, and within `CLOSE`, where a rounded tip is blunt; the less counts.
Vertices of the stone's hull above `POINTED` are corners. Of the sharpest, no two near each other, those three are taken
whose triangle is largest, weighed with their sharpness. A stone with fewer than three corners, such as a boulder, has
other marks, to be painted on: the two points that are farthest from each other, which callipers find, and the one
farthest from their line. All three are told with the distances between them, so that whoever finds them knows.

**Cuts.** A cut is marked by three points a, b, c of the line in which its plane meets the stone's surface: two far
apart, and the one farthest from their line. Each has its three straight distances to the numbered points. Two circles
drawn on the stone meet where it lies, the third distance tells whether that is so.

By hand, for a cube of 1 m with a face cut at 0.4 m:

>>> from cyclopean.assembly import Block
>>> from cyclopean.design.carving.carve import carve
>>> from cyclopean.design.stones.stone import stone_of
>>> from cyclopean.geometry.solids import CUBE, mesh_of, solid_of
>>> corner = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
>>> stone = stone_of("cube", *mesh_of(solid_of(corner, CUBE)))
>>> made = carve(stone, Block("cell", corner, CUBE), np.eye(3), [0.6, 0.0, 0.0])
>>> points = numbered_points(stone.vertices, stone.triangles)
>>> points.corners, sorted(set(points.apart.round(6).tolist())) == [round(2.0**0.5, 6)]
(True, True)
>>> marks = cut_marks(made, stone, 0, points)
>>> marks.point[:, 0].round(9).tolist()  # in the stone's frame: on the plane x = 0.4
[0.4, 0.4, 0.4]
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.design.carving.carve import Carved
from cyclopean.design.carving.cuts import OWN, Cut
from cyclopean.design.stones.stone import Stone
from cyclopean.geometry.frames import spiral, unit
from cyclopean.geometry.sides import Sides, rings

__all__ = ["CutMarks", "NumberedPoints", "Template", "cut_marks", "numbered_points", "template_of"]

NEAR = 0.18  # of the stone's diagonal: surface by which a corner is judged, wider than what chips of an edge
CLOSE = 0.05  # likewise: a tip that is round there is found to no better than that
POINTED = 0.55  # between a square edge (0.45) and the corner of a cube (0.735): where three faces meet bluntly
SAMPLES = 24000  # points on the surface: some fifty close to each corner
CANDIDATES = 400  # vertices of the hull that are looked at; a scan has thousands, many close together
SHARPEST = 10  # corners among which three are chosen
FLAT = 1e-6  # of the stone's diagonal: what stays lies on one side of a plane up to rounding
ENOUGH = 600  # points of a line among which marks are chosen


@dataclass(frozen=True, slots=True, eq=False)
class NumberedPoints:
    """Three points of a stone that a person can find."""

    point: Floats  # (3, 3) m, in the frame of the vertices that were given
    corners: bool  # they are corners; else the farthest points of a stone that has none

    @property
    def apart(self) -> Floats:
        """(3,) m: from 1 to 2, from 1 to 3, from 2 to 3."""
        one, two, three = self.point
        return np.asarray(np.linalg.norm([two - one, three - one, three - two], axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class CutMarks:
    """Three points of the line in which the plane of a cut meets the surface of a stone; all in the stone's frame."""

    cut: int  # index
    through: bool  # all that stays lies on one side: the cut may run through the whole stone
    line: Floats  # (e, 2, 3) m: segments of the line on the stone as it was found
    normal: Floats  # (e, 3) unit: outward normals of the surface there
    point: Floats  # (3, 3) m: a, b, c
    facing: Floats  # (3, 3) unit: outward normals of the surface at these
    distance: Floats  # (3, 3) m: of each (row) to the points 1, 2, 3


@dataclass(frozen=True, slots=True, eq=False)
class Template:
    """The outline of a dressed face, 1:1."""

    rings: tuple[Floats, ...]  # (k, 2) m each, seen from outside the stone, the second axis up; holes too
    area: float  # m2


def numbered_points(vertices: Floats, triangles: Ints) -> NumberedPoints:
    """Find three points of a stone that a person can find too.

    Parameters
    ----------
    vertices : (v, 3) float
        m.
    triangles : (t, 3) int
        Of its surface.
    """
    hull = _hull(vertices[np.unique(triangles)])
    size = float(np.linalg.norm(np.ptp(hull, axis=0)))
    surface = _surface(vertices, triangles)
    sharp = _sharpness(hull, surface, NEAR * size)
    tips = np.flatnonzero(sharp > POINTED)
    sharp[tips] = np.minimum(sharp[tips], _sharpness(hull[tips], surface, CLOSE * size))
    chosen: list[int] = []
    for k in np.argsort(-sharp, kind="stable").tolist():
        if len(chosen) == SHARPEST or sharp[k] <= POINTED:
            break
        if all(np.linalg.norm(hull[k] - hull[j]) > NEAR * size for j in chosen):
            chosen.append(k)
    if len(chosen) < 3:
        return NumberedPoints(hull[_farthest(hull)], False)

    def worth(three: Iterable[int]) -> float:
        which = list(three)
        a, b, c = hull[which]
        return float(np.linalg.norm(np.cross(b - a, c - a)) * np.prod(sharp[which]))

    return NumberedPoints(hull[list(max(combinations(chosen, 3), key=worth))], True)


def _hull(point: Floats) -> Floats:
    """(h, 3) vertices of the convex hull, at most `CANDIDATES`, spread over it."""
    from scipy.spatial import ConvexHull

    found = np.asarray(point[ConvexHull(point).vertices])
    if len(found) <= CANDIDATES:
        return found
    direction = spiral(4 * CANDIDATES)
    farthest = np.unique(np.argmax((found - found.mean(axis=0)) @ direction.T, axis=0))
    return np.asarray(found[farthest[:: max(len(farthest) // CANDIDATES, 1)]])


def _surface(vertices: Floats, triangles: Ints) -> Floats:
    """(`SAMPLES`, 3) points spread evenly over triangles, the same each time."""
    corner = vertices[triangles]
    double = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    share = np.cumsum(double) / double.sum()
    k = np.arange(SAMPLES)
    which = np.minimum(np.searchsorted(share, (k + 0.5) / SAMPLES), len(triangles) - 1)
    golden = (0.7548776662466927, 0.5698402909980532)  # of the plastic number: points that fill a square evenly
    s, t = (np.modf(0.5 + golden[i] * k)[0] for i in (0, 1))
    over = s + t > 1.0
    s, t = np.where(over, 1.0 - s, s)[:, None], np.where(over, 1.0 - t, t)[:, None]
    a, b, c = corner[which].transpose(1, 0, 2)
    return np.asarray(a + s * (b - a) + t * (c - a))


def _sharpness(point: Floats, surface: Floats, near: float) -> Floats:
    """(n,) how much the surface near each point (n, 3) lies one way from it, 0 to 1."""
    from scipy.spatial import KDTree

    found = np.zeros(len(point))
    for k, around in enumerate(KDTree(surface).query_ball_point(point, near)):
        ray = surface[around] - point[k]
        length = np.linalg.norm(ray, axis=1)
        some = length > 1e-9 * near
        if some.any():
            found[k] = float(np.linalg.norm((ray[some] / length[some, None]).mean(axis=0)))
    return found


def _farthest(point: Floats) -> list[int]:
    """Indices of two points (n, 3) that are farthest from each other, and of the one farthest from their line."""
    square = (point**2).sum(axis=1)
    apart = square[:, None] + square[None] - 2.0 * point @ point.T
    a, b = divmod(int(np.argmax(apart)), len(point))
    line = (point[b] - point[a]) / max(float(np.linalg.norm(point[b] - point[a])), 1e-300)
    beside = np.linalg.norm(np.cross(point - point[a], line), axis=1)
    return [a, b, int(np.argmax(beside))]


def cut_marks(carved: Carved, found: Stone, cut: int, points: NumberedPoints) -> CutMarks | None:
    """Choose the marks of a cut; None where no line of it is on the stone's own surface.

    Where all that stays lies on one side, the line is that of the whole plane with the stone as it was found. A cut
    that ends at another one, as in a notch, is marked where its face meets the stone's own surface.

    Parameters
    ----------
    carved : Carved
        The stone.
    found : Stone
        As it was found.
    cut : int
        Index of the cut.
    points : NumberedPoints
        Of the stone, in its own frame.
    """
    plane = carved.cuts[cut]
    kept = (carved.vertices - carved.shift) @ carved.rotation  # the rotation's transpose brings back
    size = float(np.linalg.norm(np.ptp(found.vertices, axis=0)))
    through = bool((kept @ plane.normal - plane.offset <= FLAT * size).all())
    line, normal = _section(found, plane) if through else _rim(carved, cut)
    if not len(line):
        return None
    chosen = _farthest(line[:: max(len(line) // ENOUGH, 1), 0])
    chosen = [k * max(len(line) // ENOUGH, 1) for k in chosen]
    point = line[chosen, 0]
    distance = np.linalg.norm(point[:, None] - points.point[None], axis=2)
    return CutMarks(cut, through, line, normal, point, normal[chosen], distance)


def _section(stone: Stone, plane: Cut) -> tuple[Floats, Floats]:
    """Segments (e, 2, 3) m in which a plane meets a stone, and the surface's normals there (e, 3)."""
    height = stone.vertices @ plane.normal - plane.offset
    above = height > 0.0
    corner = stone.triangles[np.isin(above[stone.triangles].sum(axis=1), (1, 2))]
    lone = above[corner].sum(axis=1) == 1  # else two corners are above, and the one below is alone
    alone = np.argmax(above[corner] == lone[:, None], axis=1)
    rows = np.arange(len(corner))
    apex, ends = corner[rows, alone], [corner[rows, (alone + k) % 3] for k in (1, 2)]
    crossing = []
    for end in ends:
        share = (height[apex] / (height[apex] - height[end]))[:, None]
        crossing.append(stone.vertices[apex] + share * (stone.vertices[end] - stone.vertices[apex]))
    return np.stack(crossing, 1), _normals(stone.vertices[corner])


def _rim(carved: Carved, cut: int) -> tuple[Floats, Floats]:
    """Where the face of a cut meets the stone's own surface: segments (e, 2, 3) m, and normals (e, 3); stone frame."""
    sides = Sides.of(carved.triangles.ravel(), np.arange(0, carved.triangles.size + 1, 3))
    here, there = np.concatenate([sides.pairs(), sides.pairs()[::-1]], axis=1)
    met = (carved.label[sides.face[here]] == cut) & (carved.label[sides.face[there]] == OWN)
    order = np.lexsort((here[met], here[met] % 3))
    here, there = here[met][order], there[met][order]
    corner = carved.vertices[carved.triangles[sides.face[there]]]
    line = (carved.vertices[np.stack([sides.tail[here], sides.head[here]], 1)] - carved.shift) @ carved.rotation
    return line, _normals(corner) @ carved.rotation


def _normals(corner: Floats) -> Floats:
    """(t, 3) unit normals of triangles (t, 3, 3); zero where they have none."""
    return unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))


def template_of(carved: Carved, cut: int, up: Floats) -> Template:
    """The face that a cut leaves, as a flat outline with `up` (3,) of the wall as nearly upwards as it can be."""
    mine = carved.triangles[carved.label == cut]
    normal = carved.rotation @ carved.cuts[cut].normal
    rise = up - (up @ normal) * normal
    if not np.linalg.norm(rise) > 1e-6:  # a level face: the wall's own second axis is as good as any
        rise = np.eye(3)[1] - normal[1] * normal
        rise = rise if np.linalg.norm(rise) > 1e-6 else np.eye(3)[0] - normal[0] * normal
    rise = rise / np.linalg.norm(rise)
    flat = carved.vertices @ np.stack([np.cross(rise, normal), rise], 1)
    rim = Sides.of(mine.reshape(-1), np.arange(0, mine.size + 1, 3)).rim
    found = tuple(flat[ring] for ring in rings(rim))
    return Template(found, carved.cuts[cut].area)
