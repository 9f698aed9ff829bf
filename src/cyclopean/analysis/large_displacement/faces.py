"""Faces that have slid over each other, and stones that have run into each other, once blocks have moved."""

from dataclasses import dataclass, replace
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
    frames_from_normals,
    penetration_depths,
    planar_regions,
)

__all__ = ["Bodies", "Faces", "Touch", "within"]

FACES = 0.999  # cosine of the angle between a contact and the face of a block that it lies on, at least
NEAR = 3.0  # tolerances: what of a stone comes so near to a face of another touches it, once they have met within one
WIDE = 8.0  # tolerances: a face that bears is wider, twice what a certificate asks for; else its corners bear alone
POINT, EDGE, FLAT = range(3)  # with what a stone lies on a face of another: with more is better
Rings = tuple[Floats, ...]


class At(Protocol):
    """Where all blocks are."""

    @property
    def centre(self) -> Floats: ...
    @property
    def turn(self) -> Floats: ...


@dataclass(frozen=True, slots=True, eq=False)
class Touch:
    """Where two stones have come into contact: a face of one, and what of the other lies on it."""

    contacts: Contacts  # where the stones are then: one polygon, or single points; mu NaN
    face: int  # the block whose face it is
    outline_a: Rings  # as in `Faces`
    outline_b: Rings

    @property
    def pair(self) -> tuple[int, int]:
        """Both blocks."""
        return int(self.contacts.a[0]), int(self.contacts.b[0])


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
    """The two faces that meet in each contact, outlines (k, 3) m from the centres of mass of their blocks at rest."""

    a: Ints  # (c,) block
    b: Ints  # (c,)
    outline_a: tuple[Rings, ...]  # rings, the outer one first; a single point or two where nothing else bears
    outline_b: tuple[Rings, ...]
    carries: Ints  # (c,) the block with the smaller face: its own points bear wherever it goes

    @classmethod
    def of(cls, assembly: Assembly, contacts: Contacts) -> "Faces":
        """The faces that contacts lie on; where a contact lies on no single flat face, its own polygon."""
        mesh, origin = local_mesh(assembly)
        tolerance = length_tolerance(assembly)
        regions = planar_regions(mesh, tolerance)
        away = assembly.mass.centroid - origin
        sides: list[tuple[Rings, ...]] = []
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

    def joined(self, met: Touch) -> "Faces":
        """With contacts that came about on the way; what lies on the face goes on bearing where it goes."""
        count = len(met.contacts)
        a, b = met.pair
        return Faces(
            np.append(self.a, met.contacts.a),
            np.append(self.b, met.contacts.b),
            (*self.outline_a, *[met.outline_a] * count),
            (*self.outline_b, *[met.outline_b] * count),
            np.append(self.carries, np.full(count, b if met.face == a else a)),
        )

    def drawn(self, place: At, contact: int, frame: Floats, origin: Floats) -> tuple[Any, Any]:
        """Both faces of a contact (Shapely, m), in a plane: `origin` (3,), `frame` (3, 3)."""
        a, b = int(self.a[contact]), int(self.b[contact])
        sides = ((a, self.outline_a[contact]), (b, self.outline_b[contact]))
        one, two = (
            _flat([(place.centre[k] + ring @ place.turn[k].T - origin) @ frame[1:].T for ring in rings])
            for k, rings in sides
        )
        return one, two

    def common(self, place: At, contact: int, frame: Floats, origin: Floats) -> Any:
        """What both have in common (m), in that plane."""
        import shapely

        return shapely.intersection(*self.drawn(place, contact, frame, origin))

    def bearing(self, place: At, contact: int, point: Floats, normal: Floats, off: float) -> tuple[bool, bool]:
        """Whether a point (3,) lies inside the face of block a, further than `off` (m) from its edges, and of b."""
        import shapely

        frame = frames_from_normals(normal[None])[0]
        here = shapely.Point(0.0, 0.0)
        one, two = (
            bool(side.covers(here)) and bool(shapely.distance(shapely.boundary(side), here) > off)
            for side in self.drawn(place, contact, frame, point)
        )
        return one, two


def within(common: Any, point: Floats, frame: Floats, origin: Floats) -> tuple[Floats, Bools]:
    """Points (k, 3) m moved along the plane of `frame` (3, 3) into a region of it, and whether there is one."""
    import shapely

    if common.is_empty:
        return point, np.zeros(len(point), bool)
    flat = (point - origin) @ frame[1:].T
    line = shapely.shortest_line(common, shapely.points(flat))
    nearest = shapely.get_coordinates(line).reshape(-1, 2, 2)[:, 0]
    return point + (nearest - flat) @ frame[1:], np.ones(len(point), bool)


def _flat(rings: list[Floats]) -> Any:
    """A face (Shapely) from its rings (k, 2); a point or a line from fewer corners than three."""
    import shapely

    if len(rings[0]) < 3:
        return shapely.MultiPoint(rings[0]).convex_hull
    return shapely.make_valid(shapely.Polygon(rings[0], rings[1:]))


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
        outline = _flat([ring @ across.T for ring in _rings(regions, face)])
        if shapely.buffer(outline, off).covers(shapely.MultiPoint(polygon @ across.T)):
            return face
    return -1


def _rings(regions: PlanarRegions, face: int) -> list[Floats]:
    """Corners (k, 3) m of each ring of a face, the outer one first."""
    start = regions.corner_start
    rings = range(regions.ring_start[face], regions.ring_start[face + 1])
    return [regions.vertex[regions.corner[start[ring] : start[ring + 1]]] for ring in rings]


class Bodies:
    """Which stones have run into each other, and where they touch."""

    def __init__(self, assembly: Assembly, fixed: Bools) -> None:
        self.mesh, self.origin = local_mesh(assembly)
        self.tolerance = length_tolerance(assembly)
        self.centroid, self.fixed = assembly.mass.centroid, fixed
        self.regions = planar_regions(self.mesh, self.tolerance)
        self.convex = convex_bodies(self.regions)
        low, high = self.mesh.boxes()
        self.thinnest = float((high - low).min())  # m
        self.known: dict[tuple[int, int], float] = {}
        self.known = self._deep(self.centroid, np.tile(np.eye(3), (len(assembly), 1, 1)))

    def met(self, place: At) -> list[tuple[int, int]]:
        """Stones that are in each other at a place more than they were at first, the deepest first."""
        deep = self._deep(place.centre, place.turn)
        return sorted(deep, key=lambda pair: (-deep[pair], pair))

    def _deep(self, centre: Floats, turn: Floats) -> dict[tuple[int, int], float]:
        """How deep (m) stones are in each other, by pair, where it is more than was known."""
        mesh, regions = self.mesh, self._regions(centre, turn)
        moved = Polyhedra(regions.vertex, mesh.vertex_start, mesh.corner, mesh.corner_start, mesh.face_start)
        i, j = box_pairs(*moved.boxes(), 0.0)
        moves = ~(self.fixed[i] & self.fixed[j])
        i, j = i[moves], j[moves]
        depth = penetration_depths(moved, regions, self.convex, (i, j), self.tolerance)
        pairs = zip(i.tolist(), j.tolist(), depth.tolist(), strict=True)
        return {(a, b): d for a, b, d in pairs if d > self.known.get((a, b), -self.tolerance) + self.tolerance}

    def _regions(self, centre: Floats, turn: Floats) -> PlanarRegions:
        """All faces, once blocks have moved."""
        body = np.repeat(np.arange(len(self.mesh)), np.diff(self.mesh.vertex_start))
        away = self.mesh.vertex + self.origin - self.centroid[body]
        vertex = centre[body] + np.einsum("kij,kj->ki", turn[body], away) - self.origin
        old, own = self.regions, self.regions.body
        middle = old.point + self.origin - self.centroid[own]
        return replace(
            old,
            vertex=vertex,
            normal=np.einsum("kij,kj->ki", turn[own], old.normal),
            point=centre[own] + np.einsum("kij,kj->ki", turn[own], middle) - self.origin,
        )

    def furthest(self, before: At, after: At) -> float:
        """How far (m) a corner has gone at most from one place to another."""
        went = self._regions(after.centre, after.turn).vertex - self._regions(before.centre, before.turn).vertex
        return float(np.max(np.linalg.norm(went, axis=1), initial=0.0))

    def joined(self, met: Touch) -> None:
        """From now on two stones bear on each other: they lie as deep in each other as they did when they met."""
        self.known[met.pair] = max(self.known.get(met.pair, 0.0), NEAR * self.tolerance)

    def touch(self, place: At, pair: tuple[int, int]) -> Touch | None:
        """Where two stones that have just met touch: what of one lies on a face of the other that parts them.

        None where no face does: edges that cross, or stones that are not convex.
        """
        a, b = min(pair), max(pair)
        if not (self.convex[a] and self.convex[b]):
            return None
        regions, start = self._regions(place.centre, place.turn), self.mesh.vertex_start
        found: list[tuple[int, int, _Shared]] = []
        for one, other in ((a, b), (b, a)):
            corner = regions.vertex[start[other] : start[other + 1]]
            for face in range(regions.body_start[one], regions.body_start[one + 1]):
                shared = _shared(regions, face, corner, self.tolerance)
                if shared is not None:
                    found.append((one, face, shared))
        if not found:
            return None
        one, face, best = max(found, key=lambda entry: entry[2].size)
        polygons = [best.point] if best.size[0] == FLAT else list(best.point[:, None])
        contacts = Contacts.of(
            [(a, b)] * len(polygons),
            [(polygon if one == a else polygon[::-1]) + self.origin for polygon in polygons],
            facing=None if best.size[0] == FLAT else [best.normal if one == a else -best.normal] * len(polygons),
        )
        sides = _rings(regions, face), [best.low]
        rings_a, rings_b = (
            tuple((ring + self.origin - place.centre[block]) @ place.turn[block] for ring in side)
            for block, side in zip((a, b), sides if one == a else sides[::-1], strict=True)
        )
        return Touch(contacts, one, rings_a, rings_b)


@dataclass(frozen=True, slots=True, eq=False)
class _Shared:
    """What of a stone lies on a face of another that parts both."""

    size: tuple[int, float]  # a face, an edge or a corner of it; and its area (m2) or length (m)
    point: Floats  # (k, 3) corners of what is shared, counter-clockwise about the normal
    low: Floats  # (m, 3) corners of what lies in the plane of the face, shared or not
    normal: Floats  # (3,) of the face


def _shared(regions: PlanarRegions, face: int, corner: Floats, tolerance: float) -> _Shared | None:
    """What of a stone with these corners (k, 3) lies on a face; None where that does not part them, or nothing does."""
    import shapely

    normal, origin = regions.normal[face], regions.point[face]
    height, near = (corner - origin) @ normal, NEAR * tolerance
    if not normal.any() or height.min() < -near or height.min() > near:
        return None
    frame = frames_from_normals(normal[None])[0]
    hull = shapely.MultiPoint((corner[height <= near] - origin) @ frame[1:].T).convex_hull
    outline = _flat([(ring - origin) @ frame[1:].T for ring in _rings(regions, face)])
    shared = shapely.intersection(shapely.buffer(outline, near, join_style="mitre"), hull)
    if shared.is_empty:
        return None
    size = (POINT, 0.0)
    if shared.geom_type == "Polygon" and 2.0 * shared.area > WIDE * tolerance * shared.length:
        size = (FLAT, shared.area)
    elif shared.length > WIDE * tolerance:
        size = (EDGE, shared.length)
    ends = shared if size[0] == FLAT else shared.minimum_rotated_rectangle
    return _Shared(size, origin + _corners(ends) @ frame[1:], origin + _corners(hull) @ frame[1:], normal)


def _corners(region: Any) -> Floats:
    """(k, 2) of a region without holes, counter-clockwise, of a line or of a point."""
    import shapely

    flat = np.asarray(shapely.get_coordinates(region))
    if region.geom_type != "Polygon":
        return flat
    turned = shapely.is_ccw(region.exterior)
    return flat[:-1] if turned else flat[:0:-1]
