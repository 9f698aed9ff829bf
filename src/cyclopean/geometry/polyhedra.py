"""Closed polygon meshes, many at a time: packed arrays, face normals, triangles, volumes, faults."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.errors import InputError
from cyclopean.geometry.frames import newell_normals, unit
from cyclopean.geometry.packed import extents, following, offsets, ragged
from cyclopean.geometry.polygon import triangulated

__all__ = [
    "MassProperties",
    "Polyhedra",
    "bodies_of",
    "compacted",
    "face_normals",
    "face_triangles",
    "face_warp",
    "joined",
    "mass_properties",
    "mesh_faults",
    "pack",
    "triangles",
    "unpacked",
]

Faces = Sequence[Sequence[int]] | Ints


@dataclass(frozen=True, slots=True, eq=False)
class Polyhedra:
    """Polygon meshes packed end to end (n bodies, V vertices, F faces, K face corners).

    Rows `vertex_start[i]:vertex_start[i + 1]` of `vertex` belong to body i, likewise faces; corners of a face are
    counter-clockwise from outside and index `vertex` as a whole.
    """

    vertex: Floats  # (V, 3) m
    vertex_start: Ints  # (n + 1,)
    corner: Ints  # (K,) index into vertex
    corner_start: Ints  # (F + 1,)
    face_start: Ints  # (n + 1,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertex", sealed("vertex", self.vertex, None, 3))
        for name in ("vertex_start", "corner", "corner_start", "face_start"):
            object.__setattr__(self, name, sealed(name, getattr(self, name), None, dtype=np.int64))

    def __len__(self) -> int:
        return len(self.vertex_start) - 1

    @property
    def face_body(self) -> Ints:
        """(F,) body of each face."""
        return np.repeat(np.arange(len(self)), np.diff(self.face_start))

    @property
    def vertex_body(self) -> Ints:
        """(V,) body of each vertex."""
        return np.repeat(np.arange(len(self)), np.diff(self.vertex_start))

    @property
    def corner_face(self) -> Ints:
        """(K,) face of each corner."""
        return np.repeat(np.arange(len(self.corner_start) - 1), np.diff(self.corner_start))

    @property
    def next_corner(self) -> Ints:
        """(K,) for each corner, the position of the next one round its face."""
        return following(self.corner_start)

    def boxes(self) -> tuple[Floats, Floats]:
        """(n, 3) lower and upper corners of the bodies' bounding boxes (m); inverted for a body without vertices."""
        return extents(self.vertex, self.vertex_start)

    @property
    def diagonal(self) -> Floats:
        """(n,) m: of the bodies' bounding boxes."""
        low, high = self.boxes()
        return np.asarray(np.linalg.norm(np.maximum(high - low, 0.0), axis=1))


def pack(bodies: Sequence[tuple[Floats, Faces]]) -> Polyhedra:
    """Pack (vertices, faces) pairs; faces index their own body's vertices.

    Raises
    ------
    InputError
        A face with fewer than three corners, or one that names a vertex that is not there.
    """
    counts = [len(v) for v, _ in bodies]
    vertex_start = offsets(counts)
    rows = [_rows(faces) for _, faces in bodies]
    sizes = np.concatenate([size for size, _ in rows] or [np.zeros(0, np.int64)])
    local = np.concatenate([corner for _, corner in rows] or [np.zeros(0, np.int64)])
    corner_start, face_start = offsets(sizes), offsets([len(f) for _, f in bodies])
    body = np.repeat(np.repeat(np.arange(len(bodies)), np.diff(face_start)), sizes)
    limit = np.asarray(counts, np.int64)[body] if len(bodies) else np.zeros(0, np.int64)
    if (bad := np.flatnonzero((local < 0) | (local >= limit))).size:
        face = int(np.searchsorted(corner_start, bad[0], side="right")) - 1
        raise InputError(
            f"body {body[bad[0]]}: face {face - face_start[body[bad[0]]]} names vertex {local[bad[0]]},"
            f" but there are {limit[bad[0]]} vertices"
        )
    if (bad := np.flatnonzero(sizes < 3)).size:
        owner = int(np.searchsorted(face_start, bad[0], side="right")) - 1
        raise InputError(f"body {owner}: face {bad[0] - face_start[owner]} has fewer than 3 corners")
    vertex = np.concatenate([np.asarray(v, np.float64).reshape(-1, 3) for v, _ in bodies] or [np.zeros((0, 3))])
    return Polyhedra(vertex, vertex_start, vertex_start[body] + local, corner_start, face_start)


def _rows(faces: Faces) -> tuple[Ints, Ints]:
    """Number of corners of each face, and the corners one after the other; arrays are not gone through one by one."""
    if isinstance(faces, np.ndarray):
        return np.full(len(faces), faces.shape[1] if faces.ndim == 2 else 0, np.int64), faces.reshape(-1).astype(
            np.int64
        )
    sizes = np.array([len(face) for face in faces], np.int64)
    return sizes, np.fromiter((i for face in faces for i in face), np.int64, int(sizes.sum()))


def unpacked(mesh: Polyhedra) -> list[tuple[Floats, tuple[tuple[int, ...], ...]]]:
    """Vertices (v, 3), in m, and faces of each body: what `pack` puts together."""
    corner, start = mesh.corner.tolist(), mesh.corner_start.tolist()
    found = []
    for body in range(len(mesh)):
        first, last = mesh.vertex_start[body : body + 2].tolist()
        rows = range(*mesh.face_start[body : body + 2].tolist())
        faces = tuple([tuple([i - first for i in corner[start[k] : start[k + 1]]]) for k in rows])
        found.append((mesh.vertex[first:last], faces))
    return found


def bodies_of(mesh: Polyhedra, bodies: Ints) -> Polyhedra:
    """Some bodies (m,) of a mesh, by index, in the order given."""
    _, vertex = ragged(mesh.vertex_start, bodies)
    face_owner, face = ragged(mesh.face_start, bodies)
    which, position = ragged(mesh.corner_start, face)
    vertex_start = offsets(np.diff(mesh.vertex_start)[bodies])
    moved = (vertex_start[:-1] - mesh.vertex_start[bodies])[face_owner]
    return Polyhedra(
        mesh.vertex[vertex],
        vertex_start,
        mesh.corner[position] + moved[which],
        offsets(np.diff(mesh.corner_start)[face]),
        offsets(np.diff(mesh.face_start)[bodies]),
    )


def joined(one: Polyhedra, two: Polyhedra) -> Polyhedra:
    """The bodies of both."""
    return Polyhedra(
        np.concatenate([one.vertex, two.vertex]),
        np.concatenate([one.vertex_start, two.vertex_start[1:] + len(one.vertex)]),
        np.concatenate([one.corner, two.corner + len(one.vertex)]),
        np.concatenate([one.corner_start, two.corner_start[1:] + len(one.corner)]),
        np.concatenate([one.face_start, two.face_start[1:] + one.face_start[-1]]),
    )


def compacted(mesh: Polyhedra) -> Polyhedra:
    """The same without vertices that no face names."""
    used = np.zeros(len(mesh.vertex), bool)
    used[mesh.corner] = True
    count = np.bincount(mesh.vertex_body[used], minlength=len(mesh))
    return replace(
        mesh, vertex=mesh.vertex[used], vertex_start=offsets(count), corner=(np.cumsum(used) - 1)[mesh.corner]
    )


def triangles(mesh: Polyhedra) -> tuple[Ints, Ints]:
    """Fan triangulation from the first corner of every face.

    Returns
    -------
    triangle : (T, 3) int
        Indices into `mesh.vertex`, wound as their face.
    face : (T,) int
        Face of each triangle.
    """
    inner = np.diff(mesh.corner_start) - 2
    face = np.repeat(np.arange(len(inner)), inner)
    first = mesh.corner_start[face]
    step = np.arange(len(face)) - np.repeat(np.cumsum(inner) - inner, inner)
    return np.stack([mesh.corner[first], mesh.corner[first + step + 1], mesh.corner[first + step + 2]], 1), face


def face_triangles(vertices: Floats, faces: Sequence[Sequence[int]]) -> Ints:
    """Triangles (t, 3) of polygons on vertices (v, 3): fans, or ears where a polygon is not convex."""
    if all(len(face) == 3 for face in faces):
        return np.array(faces, np.int64).reshape(-1, 3)
    mesh = pack([(vertices, faces)])
    found, owner = triangles(mesh)
    corner = vertices[found]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    hollow = np.unique(owner[np.einsum("ti,ti->t", across, face_normals(mesh)[owner]) < 0.0])
    kept = found[~np.isin(owner, hollow)]
    cut = []
    for k in hollow.tolist():
        face = np.array(faces[k])
        ears = triangulated(vertices[face])
        cut.append(found[owner == k] if ears is None else face[ears])
    return np.concatenate([kept, *cut])


def face_normals(mesh: Polyhedra) -> Floats:
    """(F, 3) m2: Newell normal of every face, twice its area long."""
    return newell_normals(mesh.vertex[mesh.corner], mesh.corner_start)


def face_warp(mesh: Polyhedra) -> Floats:
    """(F,) m: distance of the furthest corner of each face from the plane through the mean of its corners."""
    if not len(mesh.corner):
        return np.zeros(0)
    normal = unit(face_normals(mesh))
    start, sizes = mesh.corner_start[:-1], np.diff(mesh.corner_start)
    here = mesh.vertex[mesh.corner] - np.repeat(mesh.vertex[mesh.corner[start]], sizes, axis=0)
    here -= np.repeat(np.add.reduceat(here, start, axis=0) / sizes[:, None], sizes, axis=0)
    off = np.abs(np.einsum("ki,ki->k", here, np.repeat(normal, sizes, axis=0)))
    return np.asarray(np.maximum.reduceat(off, start))


@dataclass(frozen=True, slots=True, eq=False)
class MassProperties:
    """Volume, centroid and inertia of n bodies of unit density."""

    volume: Floats  # (n,) m3, negative when a mesh is inside out
    centroid: Floats  # (n, 3) m
    inertia: Floats  # (n, 3, 3) m5, about the centroid, world axes

    @property
    def spread(self) -> Floats:
        """(n, 3, 3) m5: integral of x x' about the centroid."""
        return np.asarray(np.trace(self.inertia, axis1=1, axis2=2)[:, None, None] / 2.0 * np.eye(3) - self.inertia)


def mass_properties(mesh: Polyhedra) -> MassProperties:
    """Volume, centroid and inertia tensor by tetrahedra to a local origin in each body.

    The usual integral over signed tetrahedra (Mirtich 1996, Eberly 2002), taken about the body's first vertex: in raw
    coordinates a block 10 km from the origin loses a fifth of its inertia to rounding.
    A body of zero volume gets the mean of its vertices as centroid and no inertia.
    """
    n = len(mesh)
    origin = np.zeros((n, 3))
    held = np.diff(mesh.vertex_start) > 0
    origin[held] = mesh.vertex[mesh.vertex_start[:-1][held]]
    tri, face = triangles(mesh)
    body = mesh.face_body[face]
    p = mesh.vertex[tri] - origin[body][:, None, :]  # (T, 3, 3)
    six = np.einsum("ti,ti->t", p[:, 0], np.cross(p[:, 1], p[:, 2]))  # 6 x signed volume
    volume: Floats = np.bincount(body, six, n) / 6.0
    total = p.sum(1)
    first = np.stack([np.bincount(body, six * total[:, k], n) for k in range(3)], 1) / 24.0
    # second moment of a tetrahedron with one corner at the origin: V/20 (sum p p' + s s'), s = sum of the other corners
    second = np.einsum("t,tki,tkj->tij", six, p, p) + np.einsum("t,ti,tj->tij", six, total, total)
    covariance = np.zeros((n, 3, 3))
    np.add.at(covariance, body, second / 120.0)
    mean: Floats = np.stack([np.bincount(mesh.vertex_body, mesh.vertex[:, k], n) for k in range(3)], 1)
    mean = mean / np.maximum(np.diff(mesh.vertex_start), 1)[:, None]
    extent = np.zeros(n)
    np.maximum.at(extent, mesh.vertex_body, np.abs(mesh.vertex - origin[mesh.vertex_body]).max(axis=1, initial=0))
    solid = np.abs(volume) > 1e-12 * np.maximum(extent, 1e-300) ** 3
    safe = np.where(solid, volume, 1.0)
    shift = np.where(solid[:, None], first / safe[:, None], mean - origin)
    about = covariance - volume[:, None, None] * shift[:, :, None] * shift[:, None, :]
    trace = np.trace(about, axis1=1, axis2=2)
    inertia = trace[:, None, None] * np.eye(3) - about
    inertia[~solid] = 0.0
    return MassProperties(np.where(solid, volume, 0.0), origin + shift, inertia)


def mesh_faults(mesh: Polyhedra) -> list[tuple[int, str]]:
    """Find (body, fault) for every mesh that is not a closed, outward, solid body.

    Faults, in words for a person: "has no faces", "is open (3 edges have one face only)", "has faces that disagree
    about which side is out", "has zero volume", "is inside out", and those of `shells.solid_faults`: "has a shell
    without volume (faces 6 and 7)". One fault a body, the first that applies.
    """
    from cyclopean.geometry.shells import solid_faults

    n = len(mesh)
    here, there = mesh.corner, mesh.corner[mesh.next_corner]
    body = mesh.face_body[mesh.corner_face] if len(mesh.corner) else np.zeros(0, np.int64)
    size = max(len(mesh.vertex), 1)
    directed = here * size + there
    ordered, counts = np.unique(directed, return_counts=True)
    twin = there * size + here
    position = np.minimum(np.searchsorted(ordered, twin), max(len(ordered) - 1, 0))
    matched = ordered[position] == twin if len(ordered) else np.zeros(0, bool)
    repeated = counts[np.searchsorted(ordered, directed)] > 1 if len(ordered) else np.zeros(0, bool)
    open_edges = np.bincount(body, ~matched & ~repeated, n)
    double_edges = np.bincount(body, repeated, n)
    volume = mass_properties(mesh).volume
    found: list[tuple[int, str]] = []
    for i in range(n):
        if mesh.face_start[i] == mesh.face_start[i + 1]:
            found.append((i, "has no faces"))
        elif double_edges[i]:
            found.append((i, "has faces that disagree about which side is out, or edges with more than two faces"))
        elif open_edges[i]:
            found.append((i, f"is open: {int(open_edges[i])} edges have a face on one side only"))
        elif volume[i] == 0.0:
            found.append((i, "has zero volume"))
        elif volume[i] < 0.0:
            found.append((i, "is inside out: its faces must run counter-clockwise seen from outside"))
    closed = np.ones(n, bool)
    closed[[i for i, _ in found]] = False
    return sorted(found + solid_faults(mesh, closed))
