"""Which bodies run into each other: exact for convex pairs, by edges and winding numbers for the rest."""

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.geometry.coplanar import PlanarRegions
from cyclopean.geometry.packed import ragged, ragged_batches
from cyclopean.geometry.polyhedra import Polyhedra, triangles

__all__ = ["convex_bodies", "penetration_depths"]

REFLEX = 1e-9  # sine of the dihedral angle below which an edge counts as straight
NUDGE = 1.5  # tolerances by which sample points are moved into their own body
CONVEX_PRODUCTS = 1 << 18  # edges times planes of two convex bodies up to which they are compared exactly
PRODUCTS = 1 << 21  # comparisons of one body's parts with another's that we are ready to make for one pair
FURTHEST = 20.0  # times that depth: how far a sample is moved in at a knife edge


def convex_bodies(regions: PlanarRegions) -> Bools:
    """(n,) bodies that are closed, of one piece and convex.

    Locally convex at every edge, no region with a hole, and V - E + F = 2: a closed surface that is locally convex and
    a topological sphere bounds a convex body (Tietze, Nakajima).
    """
    n = len(regions.body_start) - 1
    edge_body = regions.body[regions.corner_region]
    following = regions.next_corner
    along = regions.vertex[regions.corner[following]] - regions.vertex[regions.corner]
    turn = np.einsum("ki,ki->k", np.cross(regions.normal[regions.corner_region], regions.normal[regions.across]), along)
    bad = (regions.across < 0) | ~(turn >= -REFLEX * np.linalg.norm(along, axis=1))
    convex = np.bincount(edge_body[bad], minlength=n) == 0
    pierced = np.diff(regions.ring_start) != 1
    convex &= np.bincount(regions.body[pierced], minlength=n) == 0
    _, vertex_body = _own_vertices(regions)
    euler = 2 * (np.bincount(vertex_body, minlength=n) + np.diff(regions.body_start))
    return np.asarray(convex & (euler - np.bincount(edge_body, minlength=n) == 4))


def penetration_depths(
    mesh: Polyhedra, regions: PlanarRegions, convex: Bools, pairs: tuple[Ints, Ints], tolerance: float
) -> Floats:
    """(m,) how deep (m) bodies i and j run into each other: 0 = no deeper than the tolerance, inf = depth not known.

    Pairs of convex bodies of ordinary size are decided exactly. All others (a body that is not convex, or edges times
    planes beyond a quarter of a million, as between scans) by looking up samples along the edges of each in the other:
    overlaps shallower than about twice the tolerance, or shorter than four times along the edge, may be missed, and
    with more than two million comparisons for a pair only every k-th sample is looked up.

    Parameters
    ----------
    mesh : Polyhedra
        The bodies.
    regions : PlanarRegions
        Their planar regions.
    convex : (n,) bool
        Which bodies are convex, from `convex_bodies`.
    pairs : (m,) int, (m,) int
        Bodies i and j.
    tolerance : float
        Length (m).
    """
    i, j = pairs
    faces = np.diff(regions.body_start)
    edges = np.bincount(regions.body[regions.corner_region], minlength=len(faces)) // 2
    exact = convex[i] & convex[j] & ((faces[i] + faces[j]) * (edges[i] + edges[j]) <= CONVEX_PRODUCTS)
    depth = np.zeros(len(i))
    if exact.any():
        depth[exact] = _convex_depths(regions, (i[exact], j[exact]), tolerance)
    if not exact.all():
        depth[~exact] = np.where(_sampled(mesh, regions, (i[~exact], j[~exact]), tolerance), np.inf, 0.0)
    return depth


def _own_vertices(regions: PlanarRegions) -> tuple[Ints, Ints]:
    """Vertices that are corners of regions, sorted by body, and the body of each."""
    body = np.zeros(len(regions.vertex), np.int64)
    body[regions.corner] = regions.body[regions.corner_region]
    used = np.unique(regions.corner)
    order = np.argsort(body[used], kind="stable")
    return used[order], body[used[order]]


def _convex_depths(regions: PlanarRegions, pairs: tuple[Ints, Ints], tolerance: float) -> Floats:
    """(m,) how deep convex bodies i and j run into each other, m; 0 where no deeper than the tolerance.

    Two convex bodies share more than a layer of the tolerance exactly when their copies, shrunk by half of it, have a
    point in common, and then an edge of one shrunk copy meets the other: every edge line is clipped by all planes of
    both. The depth is the least overlap along the face normals, at most a little above the true one. A pair that a
    face plane keeps apart is settled before that.
    """
    depth = np.zeros(len(pairs[0]))
    if not len(depth):
        return depth
    overlap = np.minimum(_overlap_along_faces(regions, *pairs), _overlap_along_faces(regions, *pairs[::-1]))
    doubtful = np.flatnonzero(overlap > tolerance)
    i, j = pairs[0][doubtful], pairs[1][doubtful]
    meet = _edges_meet(regions, i, j, tolerance / 2.0) | _edges_meet(regions, j, i, tolerance / 2.0)
    depth[doubtful[meet]] = overlap[doubtful[meet]]
    return depth


def _overlap_along_faces(regions: PlanarRegions, i: Ints, j: Ints) -> Floats:
    """(m,) least depth (m) that body j reaches below a face plane of body i; negative when one keeps them apart."""
    vertex, vertex_body = _own_vertices(regions)
    vertex_start = np.searchsorted(vertex_body, np.arange(len(regions.body_start)))
    pair, region = ragged(regions.body_start, i)
    reach = np.zeros(len(region))
    for entry, position in ragged_batches(vertex_start, j[pair]):
        away = regions.vertex[vertex[position]] - regions.point[region[entry]]
        height = np.einsum("ki,ki->k", away, regions.normal[region[entry]])
        block = np.unique(entry, return_index=True)
        reach[block[0]] = np.minimum.reduceat(height, block[1])
    least = np.full(len(i), np.inf)
    np.minimum.at(least, pair, -reach)
    return least


def _edges_meet(regions: PlanarRegions, i: Ints, j: Ints, depth: float) -> Bools:
    """(m,) does an edge of convex body i, shrunk by `depth` (m), meet body j, shrunk likewise?"""
    edge_start, start = _edges(regions)
    pair, position = ragged(edge_start, i)
    line, direction = start[0] + depth * start[1], start[2]
    low, high = np.full(len(pair), -np.inf), np.full(len(pair), np.inf)
    for body in (i, j):
        for entry, region in ragged_batches(regions.body_start, body[pair]):
            normal = regions.normal[region]
            rate = np.einsum("ki,ki->k", direction[position[entry]], normal)
            away = line[position[entry]] - regions.point[region]
            room = -depth - np.einsum("ki,ki->k", away, normal)
            scale = np.linalg.norm(direction[position[entry]], axis=1)
            parallel = np.abs(rate) <= REFLEX * scale
            at = room / np.where(parallel, 1.0, rate)
            outside = parallel & (room < -0.01 * depth)
            upper = np.where(parallel, np.where(outside, -np.inf, np.inf), np.where(rate > 0.0, at, np.inf))
            lower = np.where(~parallel & (rate < 0.0), at, -np.inf)
            which, first = np.unique(entry, return_index=True)
            high[which] = np.minimum(high[which], np.minimum.reduceat(upper, first))
            low[which] = np.maximum(low[which], np.maximum.reduceat(lower, first))
    return np.bincount(pair[low <= high], minlength=len(i)) > 0


def _edges(regions: PlanarRegions) -> tuple[Ints, tuple[Floats, Floats, Floats]]:
    """Edges between two regions, once each, of every body; start (m), shift inwards for unit depth, direction (m)."""
    one = regions.corner_region
    edge = np.flatnonzero((regions.across >= 0) & (one < regions.across))
    here = regions.vertex[regions.corner[edge]]
    there = regions.vertex[regions.corner[regions.next_corner[edge]]]
    n1, n2 = regions.normal[one[edge]], regions.normal[regions.across[edge]]
    spread = np.maximum(1.0 + np.einsum("ki,ki->k", n1, n2), 1e-12)
    edge_start = np.searchsorted(regions.body[one[edge]], np.arange(len(regions.body_start)))
    return edge_start, (here, -(n1 + n2) / spread[:, None], there - here)


def _sampled(mesh: Polyhedra, regions: PlanarRegions, pairs: tuple[Ints, Ints], tolerance: float) -> Bools:
    """(m,) do bodies i and j of any shape run into each other?

    Bodies that share a volume have an edge of one that runs inside the other for a while. So the edges of each are
    cut where they pass through faces of the other; the middle of each piece, moved 1.5 tolerances into its own body,
    is looked up in the other by its winding number (rays in one oblique direction, all triangles).
    """
    found = np.zeros(len(pairs[0]), bool)
    low, high = regions.body_boxes()
    samples = [_samples(regions, i, j, low, high, tolerance) for i, j in (pairs, pairs[::-1])]
    pair = np.concatenate([k for k, _ in samples])
    point = np.concatenate([p for _, p in samples])
    target = np.concatenate([pairs[1][samples[0][0]], pairs[0][samples[1][0]]])
    inside = _inside(mesh, target, point)
    found[pair[inside]] = True
    return found


def _samples(
    regions: PlanarRegions, i: Ints, j: Ints, low: Floats, high: Floats, tolerance: float
) -> tuple[Ints, Floats]:
    """Points just inside body i, one per piece of edge, that lie in the box of body j: pair of each, and the point."""
    edge_start, (start, shift, along) = _edges(regions)
    pair, at = ragged(edge_start, i)
    first, last = np.minimum(start, start + along), np.maximum(start, start + along)
    close = np.all((first[at] <= high[j[pair]]) & (low[j[pair]] <= last[at]), axis=1)
    pair, at = pair[close], at[close]
    heavy = np.bincount(pair, minlength=len(i)) * (regions.body_start[j + 1] - regions.body_start[j]) > PRODUCTS
    owner, cut = _cuts(regions, j, pair, at, heavy, (start, along))
    owner = np.concatenate([np.arange(len(pair)), np.arange(len(pair)), owner])
    cut = np.concatenate([np.zeros(len(pair)), np.ones(len(pair)), cut])
    order = np.lexsort((cut, owner))
    owner, cut = owner[order], cut[order]
    length = np.linalg.norm(along, axis=1)[at]
    piece = np.flatnonzero((owner[1:] == owner[:-1]) & ((cut[1:] - cut[:-1]) * length[owner[1:]] > 4.0 * tolerance))
    shift = shift * np.minimum(1.0, FURTHEST / np.maximum(np.linalg.norm(shift, axis=1), 1e-300))[:, None]
    middle, owner = (cut[piece] + cut[piece + 1]) / 2.0, owner[piece]
    line = at[owner]
    point = start[line] + middle[:, None] * along[line] + NUDGE * tolerance * shift[line]
    body = j[pair[owner]]
    boxed = np.all((point > low[body]) & (point < high[body]), axis=1)
    return _thinned(pair[owner[boxed]], point[boxed], regions.body_start[j + 1] - regions.body_start[j])


def _cuts(
    regions: PlanarRegions, j: Ints, pair: Ints, at: Ints, heavy: Bools, edges: tuple[Floats, Floats]
) -> tuple[Ints, Floats]:
    """Where edges pass through regions of body j (their planes, within their boxes): owner, fraction of the edge."""
    (low, high), (start, along) = regions.boxes(), edges
    light = np.flatnonzero(~heavy[pair])
    owners, fractions = [np.zeros(0, np.int64)], [np.zeros(0)]
    for entry, region in ragged_batches(regions.body_start, j[pair[light]]):
        owner = light[entry]
        here, way = start[at[owner]], along[at[owner]]
        first, last = np.minimum(here, here + way), np.maximum(here, here + way)
        near = np.all((first <= high[region]) & (low[region] <= last), axis=1)
        owner, region, here, way = owner[near], region[near], here[near], way[near]
        rate = np.einsum("ki,ki->k", way, regions.normal[region])
        room = np.einsum("ki,ki->k", regions.point[region] - here, regions.normal[region])
        crossing = np.abs(rate) > REFLEX * np.linalg.norm(way, axis=1)
        fraction = room / np.where(crossing, rate, 1.0)
        crossing &= (fraction > 0.0) & (fraction < 1.0)
        owners.append(owner[crossing])
        fractions.append(fraction[crossing])
    return np.concatenate(owners), np.concatenate(fractions)


def _thinned(pair: Ints, point: Floats, faces: Ints) -> tuple[Ints, Floats]:
    """Every k-th sample of a pair, k so that samples times faces stay within bounds."""
    count = np.bincount(pair, minlength=len(faces))
    step = np.maximum(count * faces // PRODUCTS, 1)
    order = np.argsort(pair, kind="stable")
    pair, point = pair[order], point[order]
    rank = np.arange(len(pair)) - (np.cumsum(count) - count)[pair]
    keep = rank % step[pair] == 0
    return pair[keep], point[keep]


def _inside(mesh: Polyhedra, target: Ints, point: Floats) -> Bools:
    """(k,) does point k lie inside body target[k]? Winding number along one oblique ray, exact off the surface."""
    # an oblique orthonormal frame: no edge of ordinary work projects onto a point or onto another
    turn = np.linalg.qr(np.array([[0.8191, 0.2933, 0.4931], [-0.3571, 0.9117, 0.1777], [0.4433, -0.2879, 0.8531]]))[0]
    vertex, here = mesh.vertex @ turn, point @ turn
    triangle, face = triangles(mesh)
    start = np.searchsorted(mesh.face_body[face], np.arange(len(mesh) + 1))
    order = np.argsort(target, kind="stable")
    bodies, count = np.unique(target, return_counts=True)
    inside = np.zeros(len(point), bool)
    for body, last, size in zip(bodies.tolist(), np.cumsum(count).tolist(), count.tolist(), strict=True):
        members = order[last - size : last]
        corner = vertex[triangle[start[body] : start[body + 1]]]
        # those whose boxes are met by the box of all rays along +z from the points
        low, high, point_low = corner.min(axis=1), corner.max(axis=1), here[members].min(axis=0)
        beside = np.all((low[:, :2] <= here[members, :2].max(axis=0)) & (high[:, :2] >= point_low[:2]), axis=1)
        corner = corner[beside & (high[:, 2] >= point_low[2])]
        rows = max(1, PRODUCTS // max(len(corner), 1))
        for k in range(0, len(members), rows):
            batch = members[k : k + rows]
            inside[batch] = _winding(corner, here[batch]) != 0
    return inside


def _winding(triangle: Floats, point: Floats) -> Ints:
    """(k,) signed count of the (t, 3, 3) triangles met by the rays along +z from the (k, 3) points."""
    x, y = point[:, None, 0], point[:, None, 1]
    side = []
    for k in range(3):
        p, q = triangle[:, k], triangle[:, (k + 1) % 3]
        side.append((q[:, 0] - p[:, 0]) * (y - p[:, 1]) - (q[:, 1] - p[:, 1]) * (x - p[:, 0]))
    left = (side[0] > 0.0) & (side[1] > 0.0) & (side[2] > 0.0)
    right = (side[0] < 0.0) & (side[1] < 0.0) & (side[2] < 0.0)
    ray, hit = np.nonzero(left | right)
    weight = np.stack([side[m][ray, hit] for m in (1, 2, 0)], 1)  # the side from corner 1 to 2 is opposite to corner 0
    above = (weight * triangle[hit, :, 2]).sum(axis=1) / weight.sum(axis=1) > point[ray, 2]
    turn = np.where(left[ray, hit], 1, -1)[above]
    return np.asarray(np.bincount(ray[above], turn, len(point)).round(), np.int64)
