"""The parts of faces that look one way with nothing before them, and the resultant of a pressure on them.

Seen along one direction in parallel projection, a face that looks that way is hidden where another lies before it. All
is done in the picture: with t and u its axes, a point of a flat face is an affine function of (t, u), and so is a
pressure that is linear in the coordinates. The force on the face is the integral of pressure times traction over the
area in the picture; its moments are integrals of quadratic polynomials, exact by the midpoints of the sides of
triangles (each ring cut as a fan, holes counting negative).

By hand: water of 10 N/m3 against a square of one metre, up to its upper edge, pushes with 5 N, a third above its foot.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import shapely

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.loads import Load
from cyclopean.assembly.precision import length_tolerance
from cyclopean.geometry.polyhedra import face_triangles

__all__ = ["Exposed", "clipped", "exposed", "joined_loads", "resultants", "ring_quadrature"]

EDGEWISE = 1e-6  # cosine below which a face is seen edgewise: it has no picture, and its plane no slope
SPECK = 1e-9  # of a face's own area: overlaps that small are rounding


@dataclass(frozen=True, slots=True, eq=False)
class Exposed:
    """Pieces (k) of faces in the picture of one direction; `frame` has the axes t and u of the picture, and the way."""

    frame: Floats  # (3, 3) rows t, u, way; origin of the picture is `origin`
    origin: Floats  # (3,) m
    block: Ints  # (k,)
    shape: Any  # (k,) shapely geometries in (t, u)
    normal: Floats  # (k, 3) outward
    plane: Floats  # (k, 3) a, b, c: a point is `depth = a + b t + c u` towards the viewer

    def world(self, k: int, at: Floats) -> Floats:
        """(j, 3) m of points (j, 2) of the picture of piece k."""
        depth = self.plane[k, 0] + at @ self.plane[k, 1:]
        return np.asarray(self.origin + np.column_stack([at, depth]) @ self.frame)

    @property
    def area(self) -> Floats:
        """(k,) m2 in the picture."""
        return np.asarray(shapely.area(self.shape), float)

    @property
    def corners(self) -> Floats:
        """(j, 3) m of all pieces."""
        return np.concatenate([self.world(k, shapely.get_coordinates(shape)) for k, shape in enumerate(self.shape)])

    def only(self, here: Bools) -> "Exposed":
        """Some of the pieces, (k,) bool."""
        return replace(
            self, block=self.block[here], shape=self.shape[here], normal=self.normal[here], plane=self.plane[here]
        )

    def between(self, low: float | None, high: float | None) -> "Exposed":
        """What of it lies between two heights (m), seen level, where u is upright."""
        reach = 1.0 + 2.0 * float(np.abs(shapely.bounds(self.shape)).max(initial=0.0))
        ends = (-reach if low is None else low - self.origin[2], reach if high is None else high - self.origin[2])
        return self.within(shapely.box(-reach, ends[0], reach, ends[1]))

    def within(self, shape: Any) -> "Exposed":
        """What of it lies in a shape of the picture."""
        return _kept(self, shapely.intersection(self.shape, shape))


def exposed(assembly: Assembly, way: Floats, members: Bools, high: float | None = None) -> Exposed:
    """Parts of the members' faces that look towards `way` with no other member before them.

    Parameters
    ----------
    assembly : Assembly
        The blocks (n).
    way : (3,) float
        Unit vector towards the viewer.
    members : (n,) bool
        Blocks that count; the others neither show nor hide.
    high : float, optional
        World z (m) above which nothing is returned, though it hides.
    """
    mesh = assembly.mesh
    origin = (mesh.vertex.min(0) + mesh.vertex.max(0)) / 2.0
    frame = _picture_frame(way)
    corners = mesh.corner.tolist()
    faces = [corners[i:j] for i, j in pairwise(mesh.corner_start.tolist())]
    index = face_triangles(mesh.vertex, faces)
    owner, corner = mesh.vertex_body[index[:, 0]], (mesh.vertex[index] - origin) @ frame.T
    twice = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    seen = np.flatnonzero((twice[:, 2] > EDGEWISE * np.linalg.norm(twice, axis=1)) & members[owner])
    corner, twice = corner[seen], twice[seen]
    slope = -twice[:, :2] / twice[:, 2:]
    plane = np.column_stack([corner[:, 0, 2] - np.einsum("ki,ki->k", slope, corner[:, 0, :2]), slope])
    shape = shapely.polygons(corner[:, :, :2])
    normal = twice / np.linalg.norm(twice, axis=1)[:, None] @ frame
    whole = Exposed(frame, origin, owner[seen], shape, normal, plane)
    cut = shape if high is None else _below(corner @ frame + origin, shape, whole, high)
    return _kept(whole, _less_hidden(whole, cut, corner, length_tolerance(assembly)))


def _picture_frame(way: Floats) -> Floats:
    """(3, 3) rows t, u, way, right-handed; u is upright where way is level."""
    t = np.cross([0.0, 0.0, 1.0], way) if abs(way[2]) < 0.5 else np.array([1.0, 0.0, 0.0])
    t = t / np.linalg.norm(t)
    return np.stack([t, np.cross(way, t), way])


def _below(corner: Floats, shape: Any, whole: Exposed, high: float) -> Any:
    """Pictures of triangles (k, 3, 3) m cut off at a height."""
    cut, above = shape.copy(), corner[:, :, 2] > high
    cut[above.all(1)] = shapely.Polygon()
    for k in np.flatnonzero(above.any(1) & ~above.all(1)):
        ring = clipped(corner[k], high - corner[k, :, 2])
        cut[k] = shapely.Polygon((ring - whole.origin) @ whole.frame.T[:, :2])
    return cut


def clipped(ring: Floats, value: Floats) -> Floats:
    """What of a ring (k, d) has a linear value (k,), given at its corners, that is not negative (Sutherland, Hodgman).

    Parts of a ring that is not convex stay joined by sides that run there and back, which do nothing to an integral.

    >>> clipped(np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]]), np.array([1.0, -1.0, 1.0])).tolist()
    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 2.0]]
    """
    kept = []
    for a, b, x, y in zip(ring, np.roll(ring, -1, 0), value, np.roll(value, -1), strict=True):
        if x >= 0.0:
            kept.append(a)
        if x * y < 0.0:
            kept.append(a + x / (x - y) * (b - a))
    return np.array(kept).reshape(-1, ring.shape[1])


def _less_hidden(whole: Exposed, cut: Any, corner: Floats, near: float) -> Any:
    """The cut shapes without what lies behind others by more than `near` (m), or behind an equal one before it.

    Where no corner (k, 3, 3) of a triangle lies before the plane of another, the first hides nothing of the second.
    """
    hidden, hider = shapely.STRtree(whole.shape).query(cut, predicate="intersects")
    at = corner[hider] * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.0]
    before = corner[hider][:, :, 2] - np.einsum("kji,ki->kj", at, whole.plane[hidden][:, [1, 2, 0]])
    may = (hidden != hider) & ((before.max(1) > near) | (np.abs(before).max(1) <= near))
    hidden, hider = hidden[may], hider[may]
    shared = shapely.intersection(cut[hidden], whole.shape[hider])
    real = shapely.area(shared) > SPECK * shapely.area(whole.shape[hidden])
    hidden, hider, shared = hidden[real], hider[real], shared[real]
    at = shapely.get_coordinates(shapely.centroid(shared))
    point = np.column_stack([np.ones(len(at)), at])
    ahead = np.einsum("ki,ki->k", point, whole.plane[hider] - whole.plane[hidden])
    before = (ahead > near) | ((np.abs(ahead) <= near) & (hider < hidden))
    order = np.flatnonzero(before)[np.argsort(hidden[before], kind="stable")]
    which, first = np.unique(hidden[order], return_index=True)
    left = cut.copy()
    for k, rows in zip(which, np.split(order, first)[1:], strict=True):
        left[k] = shapely.difference(cut[k], shapely.union_all(shared[rows]))
    return left


def _kept(whole: Exposed, shape: Any) -> Exposed:
    """The pieces with these shapes, without those that are gone."""
    return replace(whole, shape=shape).only(shapely.area(shape) > SPECK * shapely.area(whole.shape))


def resultants(pieces: Exposed, start: float, slope: Floats, traction: Floats, case: str) -> list[Load]:
    """The force of each piece under the pressure start + slope . x, at its centre.

    Parameters
    ----------
    pieces : Exposed
        k pieces.
    start, slope : float and (3,) float
        Of the pressure (Pa), in world coordinates (m); it is nowhere negative on the pieces.
    traction : (k, 3) float
        Force per unit of area in the picture under a unit of pressure.
    case : str
        Of the loads.
    """
    found = []
    for k, shape in enumerate(pieces.shape):
        at, weight = _quadrature(shape)
        point = pieces.world(k, at)
        share = weight * (start + point @ slope)
        if (total := float(share.sum())) > 0.0:
            found.append(Load(int(pieces.block[k]), total * traction[k], share @ point / total, case))
    return found


def _quadrature(shape: Any) -> tuple[Floats, Floats]:
    """Points (j, 2) and weights (j,) m2 that integrate quadratic polynomials over a shape exactly."""
    parts = shapely.normalize(shapely.get_parts(shape))  # outer rings one way round, holes the other
    areas = parts[shapely.get_type_id(parts) == 3]  # what is cut off may leave lines behind
    rings = [ring_quadrature(shapely.get_coordinates(ring)[:-1]) for ring in shapely.get_rings(areas)]
    points, weights = (np.concatenate(rows) for rows in zip(*rings, strict=True))
    return points, weights * np.sign(weights.sum())


def ring_quadrature(corner: Floats) -> tuple[Floats, Floats]:
    """Points (j, 2) and weights (j,) for quadratic polynomials within a ring (k, 2), positive counter-clockwise."""
    a, b, c = corner[:1], corner[1:-1], corner[2:]
    x, y = b - a, c - a
    area = (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]) / 2.0
    return np.concatenate([(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0]), np.tile(area / 3.0, 3)


def joined_loads(loads: Iterable[Load]) -> tuple[Load, ...]:
    """The same forces and moments, by one load for each block where its are parallel, else one for each axis and sense.

    Parallel forces of one sense have a centre. So a stone with a thousand faces has six loads at most.
    """
    of_block: dict[int, list[Load]] = {}
    for load in loads:
        of_block.setdefault(load.block, []).append(load)
    found: list[Load] = []
    for block, rows in of_block.items():
        force, point = np.array([row.force for row in rows]), np.array([row.point for row in rows])
        total = force.sum(0)
        along = force @ total
        if (along > 0.0).all() and np.abs(np.cross(force, total)).max() <= SPECK * along.max():
            found.append(Load(block, total, along @ point / along.sum(), rows[0].case))
            continue
        for axis, sense in ((axis, sense) for axis in range(3) for sense in (1.0, -1.0)):
            size = np.maximum(sense * force[:, axis], 0.0)
            if size.any():
                found.append(Load(block, sense * size.sum() * np.eye(3)[axis], size @ point / size.sum(), rows[0].case))
    return tuple(found)
