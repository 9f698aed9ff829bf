"""Faces that have slid over each other, and stones that have run into each other, once blocks have moved."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Contacts, length_tolerance
from cyclopean.assembly.precision import local_mesh
from cyclopean.geometry import (
    PlanarRegions,
    Polyhedra,
    box_pairs,
    convex_bodies,
    penetration_depths,
    planar_regions,
)

__all__ = ["Bodies", "Faces", "within"]

FACES = 0.999  # cosine of the angle between a contact and the face of a block that it lies on, at least
MEETS = 0.01  # of the diagonal of the smaller of two stones: they have run into each other when deeper


class At(Protocol):
    """Where all blocks are."""

    @property
    def centre(self) -> Floats: ...
    @property
    def turn(self) -> Floats: ...


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
    """The two whole faces that meet in each contact, outlines (k, 3) m from the centres of mass of their blocks."""

    a: Ints  # (c,) block
    b: Ints  # (c,)
    outline_a: tuple[tuple[Floats, ...], ...]  # rings, the outer one first
    outline_b: tuple[tuple[Floats, ...], ...]
    carries: Ints  # (c,) the block with the smaller face: its own points bear wherever it goes

    @classmethod
    def of(cls, assembly: Assembly, contacts: Contacts) -> "Faces":
        """The faces that contacts lie on; where a contact lies on no single flat face, its own polygon."""
        mesh, origin = local_mesh(assembly)
        tolerance = length_tolerance(assembly)
        regions = planar_regions(mesh, tolerance)
        away = assembly.mass.centroid - origin
        sides: list[tuple[tuple[Floats, ...], ...]] = []
        areas = []
        for block, sign in ((contacts.a, 1.0), (contacts.b, -1.0)):
            rings, area = [], np.zeros(len(contacts))
            for k in range(len(contacts)):
                polygon = contacts.point[contacts.start[k] : contacts.start[k + 1]] - origin
                face = _face(regions, int(block[k]), sign * contacts.frame[k, 0], polygon, 10.0 * tolerance)
                found = [polygon] if face < 0 else _rings(regions, face)
                rings.append(tuple(ring - away[block[k]] for ring in found))
                area[k] = contacts.area[k] if face < 0 else regions.area[face]
            sides.append(tuple(rings))
            areas.append(area)
        carries = np.where(areas[0] < areas[1], contacts.a, contacts.b)
        return cls(contacts.a, contacts.b, sides[0], sides[1], carries)

    def common(self, place: At, contact: int, frame: Floats, origin: Floats) -> Any:
        """What both faces of a contact have in common (Shapely, m), in a plane: `origin` (3,), `frame` (3, 3)."""
        import shapely

        drawn = []
        for block, rings in (
            (self.a[contact], self.outline_a[contact]),
            (self.b[contact], self.outline_b[contact]),
        ):
            flat = [(place.centre[block] + ring @ place.turn[block].T - origin) @ frame[1:].T for ring in rings]
            drawn.append(shapely.make_valid(shapely.Polygon(flat[0], flat[1:])))
        return shapely.intersection(*drawn)


def within(common: Any, point: Floats, frame: Floats, origin: Floats) -> tuple[Floats, Bools]:
    """Points (k, 3) m moved along the plane of `frame` (3, 3) into a region of it, and whether there is one."""
    import shapely

    if common.is_empty:
        return point, np.zeros(len(point), bool)
    flat = (point - origin) @ frame[1:].T
    line = shapely.shortest_line(common, shapely.points(flat))
    nearest = shapely.get_coordinates(line).reshape(-1, 2, 2)[:, 0]
    return point + (nearest - flat) @ frame[1:], np.ones(len(point), bool)


def _face(regions: PlanarRegions, block: int, normal: Floats, polygon: Floats, off: float) -> int:
    """The face of a block that a contact's polygon (k, 3) lies on, within a length (m); -1: none."""
    import shapely

    if len(polygon) < 3:
        return -1
    middle = polygon.mean(axis=0)
    for face in range(regions.body_start[block], regions.body_start[block + 1]):
        if regions.normal[face] @ normal < FACES or abs((middle - regions.point[face]) @ normal) > off:
            continue
        across = np.linalg.svd(normal[None])[2][1:]
        rings = [ring @ across.T for ring in _rings(regions, face)]
        outline = shapely.make_valid(shapely.Polygon(rings[0], rings[1:]))
        if shapely.buffer(outline, off).covers(shapely.MultiPoint(polygon @ across.T)):
            return face
    return -1


def _rings(regions: PlanarRegions, face: int) -> list[Floats]:
    """Corners (k, 3) m of each ring of a face, the outer one first."""
    start = regions.corner_start
    rings = range(regions.ring_start[face], regions.ring_start[face + 1])
    return [regions.vertex[regions.corner[start[ring] : start[ring + 1]]] for ring in rings]


class Bodies:
    """Whether stones that were clear of each other have run into each other."""

    def __init__(self, assembly: Assembly) -> None:
        self.mesh, self.origin = local_mesh(assembly)
        self.tolerance = length_tolerance(assembly)
        self.centroid = assembly.mass.centroid
        still = np.tile(np.eye(3), (len(assembly), 1, 1))
        i, j, _ = self._met(self.centroid, still)
        self.before = set(zip(i.tolist(), j.tolist(), strict=True))

    def met(self, place: At) -> tuple[int, int] | None:
        """The two stones that are deepest in each other at a place and were not at first."""
        i, j, depth = self._met(place.centre, place.turn)
        order = np.argsort(-depth, kind="stable").tolist()
        return next((pair for k in order if (pair := (int(i[k]), int(j[k]))) not in self.before), None)

    def _met(self, centre: Floats, turn: Floats) -> tuple[Ints, Ints, Floats]:
        """Pairs of blocks that are in each other by more than a share of the smaller, and how deep (m)."""
        mesh = self.mesh
        body = np.repeat(np.arange(len(mesh)), np.diff(mesh.vertex_start))
        away = mesh.vertex + self.origin - self.centroid[body]
        vertex = centre[body] + np.einsum("kij,kj->ki", turn[body], away) - self.origin
        moved = Polyhedra(vertex, mesh.vertex_start, mesh.corner, mesh.corner_start, mesh.face_start)
        regions = planar_regions(moved, self.tolerance)
        pairs = box_pairs(*moved.boxes(), 0.0)
        depth = penetration_depths(moved, regions, convex_bodies(regions), pairs, self.tolerance)
        deep = depth > MEETS * np.minimum(mesh.diagonal[pairs[0]], mesh.diagonal[pairs[1]])
        return pairs[0][deep], pairs[1][deep], depth[deep]
