"""What of a closed triangle mesh can touch another one: outer vertices, faces, convex edges."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Bools, Floats, Ints, sealed
from cyclopean.errors import InputError
from cyclopean.geometry import mass_properties, pack
from cyclopean.geometry.frames import unit
from cyclopean.geometry.solids import Solid, moved, solid_of

__all__ = ["Body", "Features", "body_of"]

FLAT = 1e-6  # sine of the bend below which an edge counts as straight


# What each array of the features tells, and of what: rows of points, faces or edges
PLACES, RUNS = ("point", "middle", "start", "edge_middle"), ("run",)
DIRECTIONS, LENGTHS = ("point_outward", "plane", "inward", "outward"), ("radius", "edge_radius")
POINTS = ("point", "point_outward", "point_spread", "point_body")
FACES = ("plane", "offset", "lenient", "middle", "radius", "face_body")
EDGES = ("start", "run", "edge_middle", "edge_radius", "inward", "outward", "edge_spread", "edge_body")


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """What of bodies can touch: outer vertices, faces, convex edges. In one frame; k points, m faces, e edges."""

    point: Floats  # (k, 3)
    point_outward: Floats  # (k, 3) unit, mean of the normals of the faces there
    point_spread: Floats  # (k,) radians: largest angle of these normals with their mean
    point_body: Ints  # (k,)
    plane: Floats  # (m, 4, 3) unit normals: of the face, and in it, out of its three sides
    offset: Floats  # (m, 4)
    lenient: Bools  # (m, 3) sides beyond which the surface does not fall away
    middle: Floats  # (m, 3) of the ball around the face
    radius: Floats  # (m,)
    face_body: Ints  # (m,)
    start: Floats  # (e, 3)
    run: Floats  # (e, 3)
    edge_middle: Floats  # (e, 3) of the ball around the edge
    edge_radius: Floats  # (e,)
    inward: Floats  # (e, 2, 3) unit, in either face, at right angles to the edge
    outward: Floats  # (e, 3) unit, mean of the two faces' normals
    edge_spread: Floats  # (e,) radians: half of the angle between them
    edge_body: Ints  # (e,)

    def scaled(self, scale: float, rotation: Floats, shift: Floats) -> "Features":
        """The same at scale rotation x + shift (m)."""
        old = {name: getattr(self, name) for name in self.__slots__}
        new = {name: scale * old[name] @ rotation.T + shift for name in PLACES}
        new |= {name: scale * old[name] @ rotation.T for name in RUNS}
        new |= {name: scale * old[name] for name in LENGTHS}
        # as one product each, not as many
        new |= {name: (old[name].reshape(-1, 3) @ rotation.T).reshape(old[name].shape) for name in DIRECTIONS}
        return replace(self, offset=scale * self.offset + new["plane"] @ shift, **new)

    def cropped(self, low: Floats, high: Floats, number: int = 0) -> "Features":
        """Those in the box from `low` to `high`, as belonging to body `number`."""
        found: dict[str, Any] = {}
        for names, middle, radius in (
            (POINTS, self.point, 0.0),
            (FACES, self.middle, self.radius),
            (EDGES, self.edge_middle, self.edge_radius),
        ):
            kept = _reaching(middle, radius, low, high)
            found |= {name: getattr(self, name)[kept] for name in names[:-1]}
            found[names[-1]] = np.full(len(kept), number)
        return Features(**found)

    @classmethod
    def joined(cls, parts: Sequence["Features"]) -> "Features":
        """All of one or more in one."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__slots__))


def _reaching(middle: Floats, radius: Floats | float, low: Floats, high: Floats) -> Ints:
    """Which balls reach into a box."""
    place = np.ascontiguousarray(middle.T)  # one long row for each axis
    x, y, z = (place >= low[:, None] - radius) & (place <= high[:, None] + radius)
    return np.flatnonzero(x & y & z)


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A closed triangle mesh in its place, with what of it can touch, and its solid."""

    vertices: Floats  # (v, 3) m
    triangles: Ints  # (t, 3) counter-clockwise from outside
    centroid: Floats  # (3,) m, of mass
    volume: float  # m3
    low: Floats  # (3,) m, lowest corner of the box around it
    high: Floats  # (3,) m
    features: Features
    solid: Solid

    def moved(self, rotation: ArrayLike, shift: ArrayLike) -> "Body":
        """The body with each point x taken to rotation x + shift."""
        r, s = sealed("rotation", rotation, 3, 3), sealed("shift", shift, 3)
        vertices = self.vertices @ r.T + s
        return replace(
            self,
            vertices=vertices,
            centroid=r @ self.centroid + s,
            low=vertices.min(axis=0),
            high=vertices.max(axis=0),
            features=self.features.scaled(1.0, r, s),
            solid=moved(self.solid, r, s),
        )


def body_of(vertices: ArrayLike, triangles: ArrayLike, name: str = "stone") -> Body:
    """Make a body of a closed, outward triangle mesh.

    Raises
    ------
    InputError
        The mesh is open, inside out, not finite, or has an edge with more than two triangles.
    """
    point = sealed(f"{name}: vertices", vertices, None, 3)
    corner = sealed(f"{name}: triangles", triangles, None, 3, dtype=np.int64)
    solid = solid_of(point, corner, name)
    mass = mass_properties(pack([(point, corner)]))
    features = _features(point, corner, name)
    low, high = point.min(axis=0), point.max(axis=0)
    return Body(point, corner, mass.centroid[0], float(mass.volume[0]), low, high, features, solid)


def _features(point: Floats, corner: Ints, name: str) -> Features:
    """Outer vertices, faces and convex edges of one mesh."""
    p = point[corner]
    along = p[:, [1, 2, 0]] - p
    normal = unit(np.cross(along[:, 0], along[:, 1]))
    plane = np.concatenate([normal[:, None, :], unit(np.cross(along, normal[:, None, :]))], axis=1)
    edge, face, side = _edges(corner, len(point), name)
    run = point[edge[:, 1]] - point[edge[:, 0]]
    ahead, first, second = unit(run), normal[face[:, 0]], normal[face[:, 1]]
    convex = np.einsum("ei,ei->e", np.cross(first, second), ahead) > FLAT
    outer = np.unique(edge[convex])
    outward: Floats = np.stack([np.bincount(corner.reshape(-1), np.repeat(n, 3), len(point)) for n in normal.T], 1)
    inward = np.stack([np.cross(first, ahead), -np.cross(second, ahead)], axis=1)
    middle = (p.min(axis=1) + p.max(axis=1)) / 2.0
    mean = unit(outward)
    lean = _angle(np.einsum("tci,ti->tc", mean[corner], normal))
    spread = np.zeros(len(point))
    np.maximum.at(spread, corner, lean)
    return Features(
        point[outer],
        mean[outer],
        spread[outer],
        np.zeros(len(outer), np.int64),
        plane,
        np.einsum("mki,mki->mk", plane, np.concatenate([p[:, :1], p], axis=1)),
        ~convex[side],
        middle,
        np.linalg.norm(p - middle[:, None], axis=2).max(axis=1),
        np.zeros(len(corner), np.int64),
        point[edge[convex, 0]],
        run[convex],
        (point[edge[convex, 0]] + point[edge[convex, 1]]) / 2.0,
        np.linalg.norm(run[convex], axis=1) / 2.0,
        inward[convex],
        unit(first + second)[convex],
        _angle(np.einsum("ei,ei->e", first, second)[convex]) / 2.0,
        np.zeros(int(convex.sum()), np.int64),
    )


def _angle(cosine: Floats) -> Floats:
    """Radians."""
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _edges(corner: Ints, count: int, name: str) -> tuple[Ints, Ints, Ints]:
    """Edges as the first triangle runs along them, the two triangles at each, and the edge of each triangle's side."""
    here, there = corner.reshape(-1), corner[:, [1, 2, 0]].reshape(-1)
    face = np.repeat(np.arange(len(corner)), 3)
    key = np.minimum(here, there) * count + np.maximum(here, there)
    order = np.argsort(key, kind="stable")
    pair = order.reshape(-1, 2) if len(order) % 2 == 0 else np.zeros((0, 2), np.int64)
    ordered = key[order]
    if not len(pair) or np.any(key[pair[:, 0]] != key[pair[:, 1]]) or np.any(ordered[2::2] == ordered[1:-1:2]):
        raise InputError(f"{name}: has an edge with more or less than two triangles; mend its mesh")
    side = np.zeros(len(key), np.int64)
    side[pair] = np.arange(len(pair))[:, None]
    first = pair[:, 0]
    return np.stack([here[first], there[first]], 1), face[pair], side.reshape(-1, 3)
