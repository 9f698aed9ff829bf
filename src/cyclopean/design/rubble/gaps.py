"""Near points of a stone and of those it lies on, and how far they are apart: exact, for turned triangle meshes.

Between closed triangle meshes a rigid motion first closes the gap of a vertex and a face, or of two edges. Each such
pair has a point, a normal that pushes the stone away, and a signed gap; moved a little by (t, w) about the centroid c,
the gap becomes gap + n . t + ((p - c) x n) . w. A vertex over a convex edge, or over a vertex, is what two edges are
whose nearest points are ends of theirs.

A pair tells of the surface only where its direction looks out of both bodies (the normal cones of the two edges; the
prism over the face); a vertex sunk into several faces of one body is held to leave by the nearest.
"""

from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.design.rubble.features import Features
from cyclopean.geometry import crossed

__all__ = ["Gaps", "NearPairs", "Surroundings", "gaps_between", "near_pairs"]

PARALLEL = 1e-3  # sine of the angle of two edges that count as parallel: vertices and faces tell of those
ASKEW = 0.1  # radians by which two features may look past each other and yet touch
WIDEST = 1.8  # radians: features that look farther past each other never touch
CONE = 0.02  # sine by which a direction may leave the normal cone of an edge
APART = 1e-9  # unit lengths: nearer, two points give no direction
LENIENCE = 0.25  # of the reach: how far beyond a side over which the surface does not fall away a face is looked at
CROWD = 400_000  # pairs of balls that are looked at together
ROUNDING = 4e-6  # of the square of the largest length: what single precision may get wrong, and more
GROUND = -1


@dataclass(frozen=True, slots=True, eq=False)
class NearPairs:
    """Features of a stone (first) and of what it lies on (second) that may come near each other."""

    over: tuple[Ints, Ints]  # points of the stone, faces
    under: tuple[Ints, Ints]  # faces of the stone, points
    across: tuple[Ints, Ints]  # edges, edges


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """Balls around points, faces and edges of some features, one after the other, and which way they look."""

    middle: Floats  # (n, 3)
    radius: Floats  # (n,)
    outward: Floats  # (n, 3) unit
    spread: Floats  # (n,) radians: how far normals of the surface there lean from it
    start: Ints  # (4,) where points, faces and edges begin, and all end

    @classmethod
    def of(cls, features: Features) -> "Surroundings":
        """Where the features are."""
        f = features
        return cls(
            np.concatenate([f.point, f.middle, f.edge_middle]),
            np.concatenate([np.zeros(len(f.point)), f.radius, f.edge_radius]),
            np.concatenate([f.point_outward, f.plane[:, 0], f.outward]),
            np.concatenate([f.point_spread, np.zeros(len(f.radius)), f.edge_spread]),
            np.cumsum([0, len(f.point), len(f.radius), len(f.edge_radius)]),
        )

    def turned(self, rotation: Floats, shift: Floats) -> "Surroundings":
        """The same at rotation x + shift (m)."""
        return replace(self, middle=self.middle @ rotation.T + shift, outward=self.outward @ rotation.T)

    def beside(self, other: "Surroundings", zone: float) -> "tuple[Surroundings, Ints]":
        """What comes near the box around the others; and where each of it was, among those of its kind."""
        if not len(other.radius):
            return self, np.arange(len(self.radius)) - np.repeat(self.start[:-1], np.diff(self.start))
        place, reach = np.ascontiguousarray(other.middle.T), other.radius + zone  # one long row for each axis
        low, high = (place - reach).min(axis=1)[:, None], (place + reach).max(axis=1)[:, None]
        place = np.ascontiguousarray(self.middle.T)
        x, y, z = (place - self.radius <= high) & (place + self.radius >= low)
        kept = (x & y & z).nonzero()[0]
        start = np.searchsorted(kept, self.start)
        near = Surroundings(self.middle[kept], self.radius[kept], self.outward[kept], self.spread[kept], start)
        return near, kept - np.repeat(self.start[:-1], np.diff(start))


def near_pairs(
    stone: Surroundings, rotation: Floats, shift: Floats, scene: Surroundings, zone: float, turn: float
) -> NearPairs:
    """Pairs that can meet before the stone has moved by `zone` or turned by `turn` (rad) from rotation x + shift."""
    here, mine = stone.turned(rotation, shift).beside(scene, zone)
    there, other = scene.beside(here, zone)
    found = []
    for a, b in ((0, 1), (1, 0), (2, 2)):  # a point and a face, a face and a point, two edges
        i, j = (slice(of.start[k], of.start[k + 1]) for of, k in ((here, a), (there, b)))
        rows, columns = _close(here.middle[i], here.radius[i], there.middle[j], there.radius[j], zone)
        spread = here.spread[i][rows] + there.spread[j][columns] + (turn + ASKEW)
        facing = -np.einsum("ki,ki->k", here.outward[i][rows], there.outward[j][columns])
        kept = (facing > np.cos(np.minimum(spread, WIDEST))).nonzero()[0]
        found.append((mine[i][rows[kept]], other[j][columns[kept]]))
    return NearPairs(*found)


def _close(a: Floats, a_radius: Floats, b: Floats, b_radius: Floats, zone: float) -> tuple[Ints, Ints]:
    """Pairs of balls that come within `zone` of each other, in order.

    Each with each, in single precision, so that some are found that are a little farther: a tree takes longer.
    """
    if not (len(a) and len(b)):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    origin = b.mean(axis=0)
    left, right = np.ones((len(a), 6), np.float32), np.ones((6, len(b)), np.float32)  # of |p - q|^2 - (r + s)^2
    p, q, r = a - origin, b - origin, a_radius + zone
    left[:, :3], left[:, 3], left[:, 5] = -2.0 * p, np.einsum("ki,ki->k", p, p) - r * r, -2.0 * r
    right[:3], right[4], right[5] = q.T, np.einsum("ki,ki->k", q, q) - b_radius * b_radius, b_radius
    slack = np.float32(ROUNDING * max(float(np.abs(left[:, 3]).max()), float(np.abs(right[4]).max())))
    step = max(CROWD // len(b), 1)
    first = range(0, len(a), step)  # one matrix product for so many rows
    near = np.concatenate([(left[k : k + step] @ right <= slack).ravel().nonzero()[0] + k * len(b) for k in first])
    rows = near // len(b)
    return rows, near - rows * len(b)


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
    kept = (np.abs(height) <= reach).nonzero()[0]
    i, j, height = i[kept], j[kept], height[kept]
    beyond = np.einsum("ki,kji->kj", point[i], to.plane[j, 1:]) - to.offset[j, 1:]
    slack = np.where(to.lenient[j] & (height[:, None] > 0.0), LENIENCE * reach, APART)
    kept = (beyond <= slack).all(axis=1).nonzero()[0]
    i, j, height = i[kept], j[kept], height[kept]
    if (height < 0.0).any():
        kept = _leaves_by_nearest(i, to.face_body[j], height).nonzero()[0]
        i, j, height = i[kept], j[kept], height[kept]
    return Gaps(point[i], to.plane[j, 0], height, to.face_body[j] if owner is None else owner[i])


def _leaves_by_nearest(point: Ints, body: Ints, height: Floats) -> Bools:
    """(k,) pairs to keep: all above their face, and of those sunk into one body only the one least deep."""
    keep = np.ones(len(height), bool)
    sunk = np.flatnonzero(height < 0.0)
    order = sunk[np.lexsort((-height[sunk], body[sunk], point[sunk]))]
    same = (point[order][1:] == point[order][:-1]) & (body[order][1:] == body[order][:-1])
    keep[order[1:][same]] = False
    return keep


def _across(
    stone: Features, rotation: Floats, shift: Floats, scene: Features, pairs: tuple[Ints, Ints], reach: float
) -> Gaps:
    """Edges across edges; a pair of parallel edges, or one that touches at its ends, tells nothing."""
    i, j = pairs
    between = (stone.edge_middle @ rotation.T + shift)[i] - scene.edge_middle[j]
    spheres = stone.edge_radius[i] + scene.edge_radius[j] + reach
    kept = (np.einsum("ki,ki->k", between, between) <= spheres * spheres).nonzero()[0]
    i, j = i[kept], j[kept]
    a, u, b, v = stone.start[i] @ rotation.T + shift, stone.run[i] @ rotation.T, scene.start[j], scene.run[j]
    s, t = _nearest(a - b, u, v)
    p, q = a + s[:, None] * u, b + t[:, None] * v
    apart = p - q
    far = np.sqrt(np.einsum("ki,ki->k", apart, apart))
    inner = (s > 0.0) & (s < 1.0) & (t > 0.0) & (t < 1.0)
    kept = ((far <= reach) & (inner | (far > APART))).nonzero()[0]
    i, j, far, inner = i[kept], j[kept], far[kept], inner[kept]
    u, v, q, apart = u[kept], v[kept], q[kept], apart[kept]
    cross = crossed(u, v)
    length = np.sqrt(np.einsum("ki,ki->k", cross, cross))
    crossing = length > PARALLEL * 4.0 * stone.edge_radius[i] * scene.edge_radius[j]
    side = np.where(crossing, np.sign(np.einsum("ki,ki->k", cross, scene.outward[j])), 0.0)
    normal = np.where(
        inner[:, None],
        cross * (side / np.maximum(length, 1e-300))[:, None],
        apart / np.maximum(far, APART)[:, None],
    )
    back = -normal @ rotation  # in the stone's own frame, where its normal cones are
    good = (np.einsum("ki,ki->k", back, stone.outward[i]) > 0.0).nonzero()[0]
    i, j, normal, back = i[good], j[good], normal[good], back[good]
    agree = np.einsum("ki,ki->k", normal, scene.outward[j]) > 0.0
    agree &= (np.einsum("ki,kfi->kf", normal, scene.inward[j]) <= CONE).all(axis=1)
    agree &= (np.einsum("ki,kfi->kf", back, stone.inward[i]) <= CONE).all(axis=1)
    kept = agree.nonzero()[0]
    good, normal = good[kept], normal[kept]
    return Gaps(q[good], normal, np.einsum("ki,ki->k", apart[good], normal), scene.edge_body[j[kept]])


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
