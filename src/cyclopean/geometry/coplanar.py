"""Faces of a body that lie in one plane and hang together, merged into planar regions with holes."""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.geometry.frames import newell_normals, unit
from cyclopean.geometry.packed import components, extents, following, numbered, offsets, ragged
from cyclopean.geometry.polyhedra import Polyhedra, face_normals, triangles

__all__ = ["PlanarRegions", "flattened", "planar_regions", "twin_edges"]

SAME_SIDE = 0.9  # cosine below which two faces cannot be one region, however small they are


@dataclass(frozen=True, slots=True, eq=False)
class PlanarRegions:
    """Planar regions of n bodies (R regions, G rings, K ring corners), sorted by body, then by their first face.

    Region r holds rings `ring_start[r]:ring_start[r + 1]`, the outer one first and counter-clockwise from outside,
    then holes, clockwise; ring g holds corners `corner_start[g]:corner_start[g + 1]`. A region of no area (nothing but
    sliver faces) has a zero normal.
    """

    vertex: Floats  # (V, 3) m, those of the meshes
    body_start: Ints  # (n + 1,) regions of each body
    body: Ints  # (R,)
    normal: Floats  # (R, 3) unit, outward
    point: Floats  # (R, 3) m, in the plane, at the middle of the region
    area: Floats  # (R,) m2
    ring_start: Ints  # (R + 1,)
    corner_start: Ints  # (G + 1,)
    corner: Ints  # (K,) index into vertex
    across: Ints  # (K,) region beyond the edge from this corner to the next one; -1 = none
    lean: Floats  # (R,) sine of the angle by which a face leans from its region at most
    of_face: Ints  # (F,) region of each face of the mesh, as `flattened`

    def __len__(self) -> int:
        return len(self.body)

    @property
    def region_corner_start(self) -> Ints:
        """(R + 1,) offsets of each region's corners, all rings together."""
        return self.corner_start[self.ring_start]

    @property
    def next_corner(self) -> Ints:
        """(K,) position of the next corner round the ring."""
        return following(self.corner_start)

    @property
    def corner_region(self) -> Ints:
        """(K,) region of each corner."""
        return np.repeat(np.arange(len(self)), np.diff(self.region_corner_start))

    def boxes(self) -> tuple[Floats, Floats]:
        """(R, 3) lower and (R, 3) upper corner of each region's bounding box (m)."""
        return extents(self.vertex[self.corner], self.region_corner_start)

    def body_boxes(self) -> tuple[Floats, Floats]:
        """(n, 3) lower and (n, 3) upper corner of each body's bounding box (m); inverted for a body without regions."""
        low, high = self.boxes()
        return extents(low, self.body_start)[0], extents(high, self.body_start)[1]


@dataclass(frozen=True, slots=True, eq=False)
class _Faces:
    """Faces with what merging asks of them."""

    mesh: Polyhedra
    normal: Floats  # (F, 3) m2, twice the area long
    unit: Floats  # (F, 3), zero for a face of no area
    centre: Floats  # (F, 3) m, mean of the corners
    twin: Ints  # (K,) the same edge seen from the neighbouring face; -1 = none

    @classmethod
    def of(cls, mesh: Polyhedra) -> "_Faces":
        normal = face_normals(mesh)
        return cls(mesh, normal, unit(normal), _centres(mesh), twin_edges(mesh))


def planar_regions(mesh: Polyhedra, tolerance: float | Floats, bent: float | None = None) -> PlanarRegions:
    """Merge neighbouring faces of each body that lie in one plane within half the tolerance (m; or (n,), its own).

    Faces that are not flat, within half of `bent` (m) where that is given, are fan-triangulated first, as for
    volumes. Two neighbours merge when the corners of the smaller lie in the plane of the larger; a sliver, which
    has no plane worth the name, joins its largest neighbour. A chain of merges that has crept out of its mean plane
    (a finely faceted curve) is undone face by face. Edges that run inside a region vanish, also the seam of a face
    that is drawn round a hole.
    """
    own = np.broadcast_to(np.asarray(tolerance, float), len(mesh))
    faces = _Faces.of(flattened(mesh, own if bent is None else bent)[0])
    label = _merged(faces, own[faces.mesh.face_body])
    body = np.zeros(label.max(initial=-1) + 1, np.int64)
    body[label] = faces.mesh.face_body
    normal, point = _planes(faces, label)
    length = np.linalg.norm(normal, axis=1)
    edges, size, region = _rings(faces, label)
    lean = np.zeros(len(normal))
    np.maximum.at(lean, label, np.linalg.norm(np.cross(faces.unit, unit(normal)[label]), axis=1))
    corner_start = offsets(size)
    drawn = newell_normals(faces.mesh.vertex[faces.mesh.corner[edges]], corner_start)
    turning = np.einsum("gi,gi->g", drawn, normal[region])
    order = np.lexsort((-turning, region))  # the outer ring encloses most
    _, position = ragged(corner_start, order)
    edges = edges[position]
    across = np.where(faces.twin[edges] >= 0, label[faces.mesh.corner_face[faces.twin[edges]]], -1)
    return PlanarRegions(
        vertex=faces.mesh.vertex,
        body_start=np.searchsorted(body, np.arange(len(mesh) + 1)),
        body=body,
        normal=unit(normal),
        point=point,
        area=length / 2.0,
        ring_start=np.searchsorted(region[order], np.arange(len(body) + 1)),
        corner_start=offsets(size[order]),
        corner=faces.mesh.corner[edges],
        across=across,
        lean=lean,
        of_face=label,
    )


def _centres(mesh: Polyhedra) -> Floats:
    """(F, 3) mean of each face's corners."""
    if not len(mesh.corner):
        return np.zeros((0, 3))
    total = np.add.reduceat(mesh.vertex[mesh.corner], mesh.corner_start[:-1], axis=0)
    return np.asarray(total / np.diff(mesh.corner_start)[:, None])


def flattened(mesh: Polyhedra, tolerance: float | Floats) -> tuple[Polyhedra, Ints]:
    """The mesh with every face that is not flat within half the tolerance (m; or (n,)) cut into its fan of triangles.

    Returns
    -------
    mesh : Polyhedra
        Faces in the same order.
    origin : (F,) int
        Which face each was, or was part of.
    """
    if not len(mesh.corner):
        return mesh, np.arange(len(mesh.corner_start) - 1)
    face = mesh.corner_face
    height = np.einsum("ki,ki->k", mesh.vertex[mesh.corner] - _centres(mesh)[face], unit(face_normals(mesh))[face])
    own = np.broadcast_to(np.asarray(tolerance, float), len(mesh))[mesh.face_body]
    bent = ~(np.maximum.reduceat(np.abs(height), mesh.corner_start[:-1]) <= own / 2.0)
    if not bent.any():
        return mesh, np.arange(len(bent))
    fan, fan_face = triangles(mesh)
    fan, fan_face = fan[bent[fan_face]], fan_face[bent[fan_face]]
    kept = np.flatnonzero(~bent)
    whose = np.concatenate([kept, fan_face])
    size = np.concatenate([np.diff(mesh.corner_start)[kept], np.full(len(fan), 3)])
    corner = np.concatenate([mesh.corner[~bent[face]], fan.ravel()])
    start = offsets(size)
    order = np.argsort(whose, kind="stable")
    corner = corner[ragged(start, order)[1]]
    body = mesh.face_body[whose[order]]
    flat = Polyhedra(
        mesh.vertex,
        mesh.vertex_start,
        corner,
        offsets(size[order]),
        np.searchsorted(body, np.arange(len(mesh) + 1)),
    )
    return flat, whose[order]


def twin_edges(mesh: Polyhedra) -> Ints:
    """(K,) for each directed edge, the one that runs the other way; -1 where there is none or more than one."""
    if not len(mesh.corner):
        return np.zeros(0, np.int64)
    here, there = mesh.corner, mesh.corner[mesh.next_corner]
    key, back = here * len(mesh.vertex) + there, there * len(mesh.vertex) + here
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    position = np.minimum(np.searchsorted(ordered, back), len(key) - 1)
    twin = np.where(ordered[position] == back, order[position], -1)
    mutual = (twin >= 0) & (twin[twin] == np.arange(len(key)))  # an edge of three faces has no twin
    return np.where(mutual, twin, -1)


def _merged(faces: _Faces, tolerance: Floats) -> Ints:
    """(F,) region of each face, numbered by first face; tolerance (F,)."""
    count = len(faces.normal)
    one, other = _joins(faces, tolerance)
    if not len(one):
        return np.arange(count)
    label = components(count, one, other)
    normal, point = _planes(faces, label)
    region = label[faces.mesh.corner_face]
    height = np.einsum("ki,ki->k", faces.mesh.vertex[faces.mesh.corner] - point[region], unit(normal)[region])
    crept = np.zeros(len(normal), bool)
    crept[region[~(np.abs(height) <= tolerance[faces.mesh.corner_face] / 2.0)]] = True
    return numbered(np.where(crept[label], len(normal) + np.arange(count), label))


def _joins(faces: _Faces, tolerance: Floats) -> tuple[Ints, Ints]:
    """Pairs of neighbouring faces to be merged."""
    mesh = faces.mesh
    edge = np.flatnonzero(faces.twin > np.arange(len(faces.twin)))
    if not len(edge):
        return edge, edge
    one, other = mesh.corner_face[edge], mesh.corner_face[faces.twin[edge]]
    double = np.linalg.norm(faces.normal, axis=1)
    swap = double[one] > double[other]
    small, large = np.where(swap, other, one), np.where(swap, one, other)
    side = np.linalg.norm(mesh.vertex[mesh.corner[mesh.next_corner]] - mesh.vertex[mesh.corner], axis=1)
    sliver = double <= tolerance * np.maximum.reduceat(side, mesh.corner_start[:-1])  # thinner than the tolerance
    alike = np.einsum("ei,ei->e", faces.unit[small], faces.unit[large]) > SAME_SIDE
    wanted = (small != large) & ~sliver[large] & (alike | sliver[small])
    small, large = small[wanted], large[wanted]
    if not len(small):
        return small, large
    entry, position = ragged(mesh.corner_start, small)
    offset = mesh.vertex[mesh.corner[position]] - faces.centre[large][entry]
    height = np.abs(np.einsum("ki,ki->k", offset, faces.unit[large][entry]))
    first = np.searchsorted(entry, np.arange(len(small)))
    flat = np.maximum.reduceat(height, first) <= tolerance[small] / 2.0
    small, large = small[flat], large[flat]
    # a sliver on the edge between two planes would fuse them: it joins one neighbour only, the largest
    order = np.lexsort((large, -double[large], small))
    small, large = small[order], large[order]
    leading = np.concatenate([[True], small[1:] != small[:-1]])[: len(small)]
    keep = leading | ~sliver[small]
    return small[keep], large[keep]


def _planes(faces: _Faces, label: Ints) -> tuple[Floats, Floats]:
    """(R, 3) normals, twice the area long, and (R, 3) area-weighted middles of regions."""
    count = int(label.max(initial=-1)) + 1
    double = np.linalg.norm(faces.normal, axis=1)
    weight = np.where(np.bincount(label, double, count)[label] > 0.0, double, 1.0)
    total = np.bincount(label, weight, count)
    normal = np.stack([np.bincount(label, faces.normal[:, k], count) for k in range(3)], 1)
    point = np.stack([np.bincount(label, weight * faces.centre[:, k], count) for k in range(3)], 1)
    return np.asarray(normal, np.float64), np.asarray(point / total[:, None], np.float64)


def _rings(faces: _Faces, label: Ints) -> tuple[Ints, Ints, Ints]:
    """Boundary edges of all regions, ring after ring: edges (as positions of their first corner), ring sizes, regions.

    At the end of an edge the boundary goes on with the next edge of the face, or, where that runs inside the region,
    turns about the vertex through the region's faces; so rings that touch in a vertex are told apart.
    """
    mesh, twin = faces.mesh, faces.twin
    region = label[mesh.corner_face]
    inner = (twin >= 0) & (region[twin] == region)
    merged = np.zeros(int(label.max(initial=-1)) + 1, bool)
    merged[region[inner]] = True
    lone = np.flatnonzero(~merged[label])
    edges = [ragged(mesh.corner_start, lone)[1]]
    sizes = [np.diff(mesh.corner_start)[lone]]
    regions = [label[lone]]
    if merged.any():
        after = mesh.next_corner
        ahead = after.copy()
        turn = np.flatnonzero(~inner & merged[region])
        turn = turn[inner[ahead[turn]]]
        while len(turn):
            ahead[turn] = after[twin[ahead[turn]]]
            turn = turn[inner[ahead[turn]]]
        walked, size = _cycles(np.flatnonzero(~inner & merged[region]), ahead)
        edges.append(walked)
        sizes.append(size)
        regions.append(region[walked[np.cumsum(size) - size]])
    return np.concatenate(edges), np.concatenate(sizes), np.concatenate(regions)


def _cycles(member: Ints, ahead: Ints) -> tuple[Ints, Ints]:
    """Cycles of the permutation `ahead` of `member`, end to end, and their lengths."""
    follow = ahead.tolist()
    seen = bytearray(len(follow))
    walked: list[int] = []
    size: list[int] = []
    for start in member.tolist():
        if seen[start]:
            continue
        before, here = len(walked), start
        while not seen[here]:
            seen[here] = 1
            walked.append(here)
            here = follow[here]
        while len(walked) - before < 3:  # only where more than two faces meet in an edge; a ring needs three corners
            walked.append(walked[before])
        size.append(len(walked) - before)
    return np.array(walked, np.int64), np.array(size, np.int64)
