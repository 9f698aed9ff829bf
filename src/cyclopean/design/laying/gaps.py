"""Near points of a stone and of those it lies on, and how far they are apart: exact, for turned triangle meshes.

Between closed triangle meshes a rigid motion first closes the gap of a vertex and a face, or of two edges. Each such
pair has a point, a normal that pushes the stone away, and a signed gap; moved a little by (t, w) about the centroid c,
the gap becomes gap + n . t + ((p - c) x n) . w. A vertex over a convex edge, or over a vertex, is what two edges are
whose nearest points are ends of theirs.

A pair tells of the surface only where its direction looks out of both bodies (the normal cones of the two edges; the
prism over the face); a vertex sunk into several faces of one body is held to leave by the nearest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Bools, Floats, Ints, sealed
from cyclopean.errors import InputError
from cyclopean.geometry import mass_properties, pack
from cyclopean.geometry.solids import Solid, moved, solid_of

__all__ = ["Balls", "Body", "Features", "Gaps", "NearPairs", "Surroundings", "body_of", "gaps_between", "near_pairs"]

FLAT = 1e-6  # sine of the bend below which an edge counts as straight
PARALLEL = 1e-3  # sine of the angle of two edges that count as parallel: vertices and faces tell of those
ASKEW = 0.1  # radians by which two features may look past each other and yet touch
WIDEST = 1.8  # radians: features that look farther past each other never touch
CONE = 0.02  # sine by which a direction may leave the normal cone of an edge
APART = 1e-9  # unit lengths: nearer, two points give no direction
LENIENCE = 0.25  # of the reach: how far beyond a side over which the surface does not fall away a face is looked at
CROWD = 400_000  # pairs of balls that are looked at each with each
ROUNDING = 4e-6  # of the square of the largest length: what single precision may get wrong, and more
GROUND = -1


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
    inward: Floats  # (e, 2, 3) unit, in either face, at right angles to the edge
    outward: Floats  # (e, 3) unit, mean of the two faces' normals
    edge_spread: Floats  # (e,) radians: half of the angle between them
    edge_body: Ints  # (e,)

    def scaled(self, scale: float, rotation: Floats, shift: Floats) -> "Features":
        """The same at scale rotation x + shift."""
        plane = self.plane @ rotation.T
        offset = scale * self.offset + plane @ shift
        return replace(
            self,
            point=scale * self.point @ rotation.T + shift,
            point_outward=self.point_outward @ rotation.T,
            plane=plane,
            offset=offset,
            middle=scale * self.middle @ rotation.T + shift,
            radius=scale * self.radius,
            start=scale * self.start @ rotation.T + shift,
            run=scale * self.run @ rotation.T,
            inward=self.inward @ rotation.T,
            outward=self.outward @ rotation.T,
        )

    def cropped(self, low: Floats, high: Floats, number: int = 0) -> "Features":
        """Those in the box from `low` to `high`, as belonging to body `number`."""
        k = np.flatnonzero(np.all((self.point >= low) & (self.point <= high), axis=1))
        ball = self.radius[:, None]
        m = np.flatnonzero(np.all((self.middle - ball <= high) & (self.middle + ball >= low), axis=1))
        end = self.start + self.run
        e = np.flatnonzero(np.all((np.minimum(self.start, end) <= high) & (np.maximum(self.start, end) >= low), axis=1))
        return Features(
            self.point[k],
            self.point_outward[k],
            self.point_spread[k],
            np.full(len(k), number),
            self.plane[m],
            self.offset[m],
            self.lenient[m],
            self.middle[m],
            self.radius[m],
            np.full(len(m), number),
            self.start[e],
            self.run[e],
            self.inward[e],
            self.outward[e],
            self.edge_spread[e],
            np.full(len(e), number),
        )

    @classmethod
    def joined(cls, parts: Sequence["Features"]) -> "Features":
        """All of them in one."""
        none, index, size = np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0)
        faces = np.zeros((0, 4, 3)), np.zeros((0, 4)), np.zeros((0, 3), np.bool_), none, size, index
        empty = cls(none, none, size, index, *faces, none, none, np.zeros((0, 2, 3)), none, size, index)
        return cls(*(np.concatenate([getattr(p, name) for p in (empty, *parts)]) for name in cls.__slots__))


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
    normal = _unit(np.cross(along[:, 0], along[:, 1]))
    plane = np.concatenate([normal[:, None, :], _unit(np.cross(along, normal[:, None, :]))], axis=1)
    edge, face, side = _edges(corner, len(point), name)
    run = point[edge[:, 1]] - point[edge[:, 0]]
    unit, first, second = _unit(run), normal[face[:, 0]], normal[face[:, 1]]
    convex = np.einsum("ei,ei->e", np.cross(first, second), unit) > FLAT
    outer = np.unique(edge[convex])
    outward: Floats = np.stack([np.bincount(corner.reshape(-1), np.repeat(n, 3), len(point)) for n in normal.T], 1)
    inward = np.stack([np.cross(first, unit), -np.cross(second, unit)], axis=1)
    middle = (p.min(axis=1) + p.max(axis=1)) / 2.0
    mean = _unit(outward)
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
        inward[convex],
        _unit(first + second)[convex],
        _angle(np.einsum("ei,ei->e", first, second)[convex]) / 2.0,
        np.zeros(int(convex.sum()), np.int64),
    )


def _angle(cosine: Floats) -> Floats:
    """Radians."""
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _unit(vector: Floats) -> Floats:
    """Vectors (..., 3) of length 1; of length 0 where they have none."""
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.asarray(vector / np.where(length > 0.0, length, 1.0))


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


@dataclass(frozen=True, slots=True, eq=False)
class NearPairs:
    """Features of a stone (first) and of what it lies on (second) that may come near each other."""

    over: tuple[Ints, Ints]  # points of the stone, faces
    under: tuple[Ints, Ints]  # faces of the stone, points
    across: tuple[Ints, Ints]  # edges, edges


@dataclass(frozen=True, slots=True, eq=False)
class Balls:
    """Balls around features."""

    middle: Floats  # (n, 3)
    radius: Floats  # (n,)

    def near(self, other: "Balls", zone: float) -> tuple[Ints, Ints]:
        """Pairs of balls of this and of the other that come within `zone` of each other, in order."""
        i, j = self._beside(other, zone), other._beside(self, zone)
        if len(i) * len(j) > CROWD:
            here, there = (_Trees.around(b.middle[k], b.radius[k]) for b, k in ((self, i), (other, j)))
            rows, columns = here.near(there, zone)
        else:
            rows, columns = _close(self.middle[i], self.radius[i], other.middle[j], other.radius[j], zone)
        return i[rows], j[columns]

    def _beside(self, other: "Balls", zone: float) -> Ints:
        """Which of these balls come near the box around the others."""
        if not len(other.radius):
            return np.zeros(0, np.int64)
        reach = other.radius[:, None] + zone
        low, high = (other.middle - reach).min(axis=0), (other.middle + reach).max(axis=0)
        ball = self.radius[:, None]
        return np.flatnonzero(np.all((self.middle - ball <= high) & (self.middle + ball >= low), axis=1))


def _close(a: Floats, a_radius: Floats, b: Floats, b_radius: Floats, zone: float) -> tuple[Ints, Ints]:
    """Pairs of a few balls, each with each; in single precision, so some are found that are a little farther."""
    if not (len(a) and len(b)):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    origin = b.mean(axis=0)
    p, q = a - origin, b - origin
    one, two = np.ones((len(p), 1)), np.ones((len(q), 1))
    r, s = a_radius[:, None] + zone, b_radius[:, None]
    left = np.hstack([-2.0 * p, _square(p) - r * r, one, -2.0 * r])  # of |p - q|^2 - (r + s)^2, one matrix product
    right = np.hstack([q, two, _square(q) - s * s, s])
    slack = np.float32(ROUNDING * max(float(np.abs(left[:, 3]).max()), float(np.abs(right[:, 4]).max())))
    near = np.flatnonzero(left.astype(np.float32) @ right.astype(np.float32).T <= slack)
    return near // len(q), near % len(q)


def _square(vector: Floats) -> Floats:
    """(n, 1) squares of the lengths of vectors (n, 3)."""
    return np.asarray(np.einsum("ki,ki->k", vector, vector)[:, None])


@dataclass(frozen=True, slots=True, eq=False)
class _Trees:
    """Balls in trees of about one size each, so that large ones do not make small ones look far."""

    trees: tuple[tuple[Any, Ints, Floats], ...]  # tree of the middles, which features, their radii

    @classmethod
    def around(cls, middle: Floats, radius: Floats) -> "_Trees":
        """Of the balls with these middles (n, 3) and radii (n,)."""
        from scipy.spatial import cKDTree

        size = np.zeros(len(radius), np.int64)
        size[radius > 0.0] = np.floor(np.log2(radius[radius > 0.0]))
        found = [np.flatnonzero(size == k) for k in np.unique(size)]
        return cls(tuple((cKDTree(middle[which]), which, radius[which]) for which in found))

    def near(self, other: "_Trees", zone: float) -> tuple[Ints, Ints]:
        """Pairs of this and of the other that come within `zone` of each other, in order."""
        found = [(np.zeros(0, np.int64), np.zeros(0, np.int64))]
        for tree, which, radius in self.trees:
            for there, other_which, other_radius in other.trees:
                reach = zone + float(radius.max()) + float(other_radius.max())
                pair = tree.sparse_distance_matrix(there, reach, output_type="ndarray")
                i, j = pair["i"], pair["j"]
                kept = pair["v"] <= zone + radius[i] + other_radius[j]
                found.append((which[i[kept]], other_which[j[kept]]))
        i, j = (np.concatenate(part) for part in zip(*found, strict=True))
        order = np.lexsort((j, i))
        return i[order], j[order]


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """Balls around the points, faces and edges of some features."""

    points: Balls
    faces: Balls
    edges: Balls

    @classmethod
    def of(cls, features: Features) -> "Surroundings":
        """Where the features are."""
        half = np.linalg.norm(features.run, axis=1) / 2.0
        return cls(
            Balls(features.point, np.zeros(len(features.point))),
            Balls(features.middle, features.radius),
            Balls(features.start + features.run / 2.0, half),
        )


def near_pairs(
    stone: Features, rotation: Floats, shift: Floats, scene: Features, around: Surroundings, zone: float, turn: float
) -> NearPairs:
    """Pairs that can meet before the stone has moved by `zone` or turned by `turn` (rad) from rotation x + shift."""
    here = stone.scaled(1.0, rotation, shift)
    near = Surroundings.of(here)
    point, face, edge = (
        (here.point_outward, here.point_spread),
        (here.plane[:, 0], None),
        (here.outward, here.edge_spread),
    )
    to_point, to_face = (scene.point_outward, scene.point_spread), (scene.plane[:, 0], None)
    to_edge = scene.outward, scene.edge_spread
    return NearPairs(
        _facing(near.points.near(around.faces, zone), point, to_face, turn),
        _facing(near.faces.near(around.points, zone), face, to_point, turn),
        _facing(near.edges.near(around.edges, zone), edge, to_edge, turn),
    )


Cones = tuple[Floats, Floats | None]  # outward directions (n, 3), and how far normals spread about each; None = not


def _facing(pairs: tuple[Ints, Ints], a: Cones, b: Cones, turn: float) -> tuple[Ints, Ints]:
    """Pairs with a normal of the one opposite to one of the other, or nearly."""
    i, j = pairs
    spread = sum((s[k] for (_, s), k in ((a, i), (b, j)) if s is not None), np.full(len(i), turn + ASKEW))
    kept = -np.einsum("ki,ki->k", a[0][i], b[0][j]) > np.cos(np.minimum(spread, WIDEST))
    return i[kept], j[kept]


@dataclass(frozen=True, slots=True, eq=False)
class Gaps:
    """Near pairs as they are now: where, which way the stone is pushed, how far apart, and by which body."""

    point: Floats  # (g, 3)
    normal: Floats  # (g, 3) unit, into the stone
    gap: Floats  # (g,) negative where the two run into each other
    body: Ints  # (g,) of the scene; -1 = ground


def gaps_between(
    stone: Features,
    rotation: Floats,
    shift: Floats,
    scene: Features,
    pairs: NearPairs,
    reach: float,
    ground: float | None = None,
) -> Gaps:
    """Measure all near pairs with gaps from -reach to reach.

    Parameters
    ----------
    stone, scene : Features
        The stone in its own frame, and what it lies on.
    rotation, shift : (3, 3), (3,) array
        A point x of the stone is at rotation x + shift.
    pairs : NearPairs
        Which to look at.
    reach : float
        Unit of the frame.
    ground : float, optional
        Height of level ground.
    """
    point = stone.point @ rotation.T + shift
    found = [_over(point, scene, pairs.over, reach)]
    local = (scene.point - shift) @ rotation
    back = _over(local, stone, (pairs.under[1], pairs.under[0]), reach, scene.point_body)
    found.append(Gaps(back.point @ rotation.T + shift, -back.normal @ rotation.T, back.gap, back.body))
    found.append(_across(stone, rotation, shift, scene, pairs.across, reach))
    if ground is not None:
        low = point[np.abs(point[:, 2] - ground) <= reach]
        up = np.tile([0.0, 0.0, 1.0], (len(low), 1))
        found.append(Gaps(low, up, low[:, 2] - ground, np.full(len(low), GROUND)))
    return Gaps(*(np.concatenate([getattr(part, name) for part in found]) for name in Gaps.__slots__))


def _over(point: Floats, to: Features, pairs: tuple[Ints, Ints], reach: float, owner: Ints | None = None) -> Gaps:
    """Points over faces. `owner` tells the body of each point, where that is wanted and not that of the face."""
    i, j = pairs
    height = np.einsum("ki,ki->k", point[i], to.plane[j, 0]) - to.offset[j, 0]
    kept = np.flatnonzero(np.abs(height) <= reach)
    i, j, height = i[kept], j[kept], height[kept]
    beyond = np.einsum("ki,kji->kj", point[i], to.plane[j, 1:]) - to.offset[j, 1:]
    slack = np.where(to.lenient[j] & (height[:, None] > 0.0), LENIENCE * reach, APART)
    kept = np.flatnonzero(np.all(beyond <= slack, axis=1))
    kept = kept[_leaves_by_nearest(i[kept], to.face_body[j[kept]], height[kept])]
    i, j, height = i[kept], j[kept], height[kept]
    return Gaps(point[i], to.plane[j, 0], height, to.face_body[j] if owner is None else owner[i])


def _leaves_by_nearest(point: Ints, body: Ints, height: Floats) -> Bools:
    """(k,) pairs to keep: all above their face, and of those sunk into one body only the one least deep."""
    keep = np.ones(len(height), bool)
    sunk = np.flatnonzero(height < 0.0)
    if len(sunk):
        order = sunk[np.lexsort((-height[sunk], body[sunk], point[sunk]))]
        same = (point[order][1:] == point[order][:-1]) & (body[order][1:] == body[order][:-1])
        keep[order[1:][same]] = False
    return keep


def _across(
    stone: Features, rotation: Floats, shift: Floats, scene: Features, pairs: tuple[Ints, Ints], reach: float
) -> Gaps:
    """Edges across edges; a pair of parallel edges, or one that touches at its ends, tells nothing."""
    i, j = pairs
    start, run = stone.start @ rotation.T + shift, stone.run @ rotation.T
    middle, half = start + run / 2.0, np.linalg.norm(run, axis=1) / 2.0
    scene_middle, scene_half = scene.start + scene.run / 2.0, np.linalg.norm(scene.run, axis=1) / 2.0
    between = middle[i] - scene_middle[j]
    spheres = half[i] + scene_half[j] + reach
    kept = np.flatnonzero(np.einsum("ki,ki->k", between, between) <= spheres * spheres)
    i, j = i[kept], j[kept]
    a, u, b, v = start[i], run[i], scene.start[j], scene.run[j]
    s, t = _nearest(a - b, u, v)
    p, q = a + s[:, None] * u, b + t[:, None] * v
    apart = p - q
    far = np.linalg.norm(apart, axis=1)
    inner = (s > 0.0) & (s < 1.0) & (t > 0.0) & (t < 1.0)
    kept = np.flatnonzero((far <= reach) & (inner | (far > APART)))
    i, j, far, inner = i[kept], j[kept], far[kept], inner[kept]
    p, q, apart = p[kept], q[kept], apart[kept]
    normal = apart / np.maximum(far, APART)[:, None]
    cross = np.cross(u[kept][inner], v[kept][inner])
    length = np.linalg.norm(cross, axis=1)
    scale = np.linalg.norm(u[kept][inner], axis=1) * np.linalg.norm(v[kept][inner], axis=1)
    sign = np.sign(np.einsum("ki,ki->k", cross, scene.outward[j[inner]]))
    crossing = length > PARALLEL * scale
    normal[inner] = cross * (np.where(crossing, sign, 0.0) / np.maximum(length, 1e-300))[:, None]
    back = -normal @ rotation  # in the stone's own frame, where its normal cones are
    leans = np.einsum("ki,kfi->kf", normal, scene.inward[j]).max(axis=1, initial=-np.inf)
    leans = np.maximum(leans, np.einsum("ki,kfi->kf", back, stone.inward[i]).max(axis=1, initial=-np.inf))
    agree = np.einsum("ki,ki->k", back, stone.outward[i]) > 0.0
    agree &= np.einsum("ki,ki->k", normal, scene.outward[j]) > 0.0
    good = np.flatnonzero((leans <= CONE) & agree)
    gap = np.einsum("ki,ki->k", apart[good], normal[good])
    return Gaps(q[good], normal[good], gap, scene.edge_body[j[good]])


def _nearest(away: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Parameters in [0, 1] of the nearest points of segments a + s u and b + t v, with away = a - b (Ericson 2005)."""
    uu, vv, uv = (np.einsum("ki,ki->k", x, y) for x, y in ((u, u), (v, v), (u, v)))
    ua, va = np.einsum("ki,ki->k", u, away), np.einsum("ki,ki->k", v, away)
    span = uu * vv - uv * uv
    s = np.clip((uv * va - ua * vv) / np.where(span > 0.0, span, 1.0), 0.0, 1.0)
    t = (uv * s + va) / np.maximum(vv, 1e-300)
    held = np.clip(t, 0.0, 1.0)
    s = np.where(t == held, s, np.clip((uv * held - ua) / np.maximum(uu, 1e-300), 0.0, 1.0))
    return s, held
