"""Do closed meshes bound solids? Shells without volume, inside out or in each other, faces that lie on each other.

All lengths are compared in sizes of the body itself, so that small bodies are looked at as closely as large ones. Most
bodies are convex, which their edges tell, and need no more.

>>> cube = np.array([[x, y, z] for x in (0.0, 1) for y in (0, 1) for z in (0, 1)])
>>> faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
>>> from cyclopean.geometry.polyhedra import pack
>>> sheet = [(8, 9, 10), (10, 9, 8)]
>>> solid_faults(pack([(np.concatenate([cube, cube[:3] + 5]), [*faces, *sheet])]), np.array([True]))
[(0, 'has a shell without volume (faces 6 and 7)')]
"""

from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.geometry.boxes import box_pairs
from cyclopean.geometry.common_area import common_areas
from cyclopean.geometry.coplanar import flattened, twin_edges
from cyclopean.geometry.frames import frames_from_normals, solid_angles, unit
from cyclopean.geometry.packed import components, following, offsets, ragged, ragged_batches
from cyclopean.geometry.polyhedra import Polyhedra, bodies_of, compacted, face_normals, triangles

__all__ = ["Nesting", "convex", "detached_pieces", "nested", "solid_faults"]

ROUNDING = 1e-9  # of a body's size: lengths below it are rounding
SAMPLES = 8  # places of a shell that are looked up in the others of its body
SAME_PLANE = 1e-7  # how near two planes' directions and offsets, mixed, are for a closer look


def solid_faults(mesh: Polyhedra, closed: Bools) -> list[tuple[int, str]]:
    """Find (body, fault) for those `closed` (n,) and of positive volume that are no solids; one fault a body, sorted.

    Shells that are turned inward are holes, each inside one more outward shell than inward ones; outward shells are
    outside of all that is solid. No two faces may lie on each other, back to back or facing the same way. Surfaces that
    cross each other elsewhere are not looked for (see `crossing`).
    """
    bodies = np.flatnonzero(closed & ~convex(mesh))
    if not len(bodies):
        return []
    part = _of_own_size(mesh, bodies)
    shells = _Shells.of(part)
    faults = {**_overlaid(part), **_misplaced(part, shells), **_thin(part, shells)}
    return [(int(bodies[body]), faults[body]) for body in sorted(faults)]


def detached_pieces(mesh: Polyhedra) -> Ints:
    """(n,) number of outer shells of each body: what is of several pieces moves as one all the same."""
    faces = np.diff(mesh.face_start) > 0
    pieces = faces.astype(np.int64)
    bodies = np.flatnonzero(faces & ~convex(mesh))
    if len(bodies):
        shells = _Shells.of(_of_own_size(mesh, bodies))
        pieces[bodies] = np.bincount(shells.body[shells.volume > 0.0], minlength=len(bodies))
    return pieces


@dataclass(frozen=True, slots=True, eq=False)
class Nesting:
    """The shells of bodies (m of them) and how they lie in each other."""

    label: Ints  # (F,) shell of each face
    body: Ints  # (m,)
    volume: Floats  # (m,) m3, negative where turned inward
    depth: Ints  # (m,) in how many other shells of its body it lies


def nested(mesh: Polyhedra) -> Nesting:
    """Tell shells apart, whichever way round each of them runs."""
    bodies = np.arange(len(mesh))
    shells = _Shells.of(_of_own_size(mesh, bodies))
    depth = np.zeros(len(shells.body), np.int64)
    several = np.flatnonzero(np.bincount(shells.body, minlength=len(mesh))[shells.body] > 1)
    if len(several):
        way = np.where(shells.volume < 0.0, -1, 1)
        shell, around = _surrounded(shells, several, way)
        depth[shell] = around
    low, high = mesh.boxes()
    size = (high - low).max(axis=1, initial=0.0)[shells.body]
    return Nesting(shells.label, shells.body, shells.volume * size**3, depth)


def convex(mesh: Polyhedra) -> Bools:
    """(n,) whether a body is convex: at each edge, and with V - E + F = 2 (see `penetration.convex_bodies`)."""
    n = len(mesh)
    if not len(mesh.corner):
        return np.ones(n, bool)
    normal = face_normals(mesh)
    length = np.linalg.norm(normal, axis=1)
    normal = unit(normal)
    twin, face = twin_edges(mesh), mesh.corner_face
    along = mesh.vertex[mesh.corner[mesh.next_corner]] - mesh.vertex[mesh.corner]
    turn = np.einsum("ki,ki->k", np.cross(normal[face], normal[face[twin]]), along)
    side = np.linalg.norm(along, axis=1)
    needle = ~(length > ROUNDING * np.maximum.reduceat(side, mesh.corner_start[:-1]) ** 2)  # it has no direction
    bad = (twin < 0) | needle[face] | ~(turn >= -ROUNDING * side)
    body = mesh.face_body[face]
    used = np.zeros(len(mesh.vertex), bool)
    used[mesh.corner] = True
    twice = 2 * (np.bincount(mesh.vertex_body[used], minlength=n) + np.diff(mesh.face_start))
    return np.asarray((np.bincount(body[bad], minlength=n) == 0) & (twice - np.bincount(body, minlength=n) == 4))


def _of_own_size(mesh: Polyhedra, bodies: Ints) -> Polyhedra:
    """Some of the bodies, each moved to the origin and scaled to the unit cube."""
    part = compacted(bodies_of(mesh, bodies))
    low, high = part.boxes()
    size = np.where(np.diff(part.face_start) > 0, (high - low).max(axis=1), 0.0)
    low[size == 0.0] = 0.0
    owner = part.vertex_body
    return replace(part, vertex=(part.vertex - low[owner]) / np.where(size > 0.0, size, 1.0)[owner][:, None])


@dataclass(frozen=True, slots=True, eq=False)
class _Shells:
    """Connected parts of meshes (m of them), numbered by their first faces, so sorted by body."""

    label: Ints  # (F,) shell of each face
    body: Ints  # (m,)
    volume: Floats  # (m,) negative where turned inward
    area: Floats  # (m,)
    low: Floats  # (m, 3)
    high: Floats  # (m, 3)
    triangle: Floats  # (T, 3, 3) corners, sorted by shell
    start: Ints  # (m + 1,) triangles of each shell

    @classmethod
    def of(cls, mesh: Polyhedra) -> "_Shells":
        count = len(mesh.corner_start) - 1
        twin, face = twin_edges(mesh), mesh.corner_face
        here = np.flatnonzero(twin >= 0)
        label = components(count, face[here], face[twin[here]])
        first = np.unique(label, return_index=True)[1]
        tri, tri_face = triangles(mesh)
        order = np.argsort(label[tri_face], kind="stable")
        shell = label[tri_face[order]]
        corner = mesh.vertex[tri[order]]
        start = np.searchsorted(shell, np.arange(len(first) + 1))
        away = corner - corner[start[:-1], :1][shell]
        normal = np.cross(away[:, 1] - away[:, 0], away[:, 2] - away[:, 0])
        volume = np.add.reduceat(np.einsum("ti,ti->t", away[:, 0], normal), start[:-1]) / 6.0
        area = np.add.reduceat(np.linalg.norm(normal, axis=1), start[:-1]) / 2.0
        low: Floats = np.minimum.reduceat(corner.min(axis=1), start[:-1], axis=0)
        high: Floats = np.maximum.reduceat(corner.max(axis=1), start[:-1], axis=0)
        return cls(label, mesh.face_body[first], volume, area, low, high, corner, start)

    def named(self, mesh: Polyhedra, shell: int) -> str:
        """Faces of a shell, by their numbers in their body."""
        return _named((np.flatnonzero(self.label == shell) - mesh.face_start[self.body[shell]]).tolist())


def _named(faces: list[int]) -> str:
    """Name faces by their numbers.

    >>> _named([6, 7]), _named([6, 7, 8, 9])
    ('faces 6 and 7', 'faces 6, 7 and 2 more')
    """
    if len(faces) < 3:
        return f"face{'s' * (len(faces) > 1)} {' and '.join(map(str, faces))}"
    return f"faces {faces[0]}, {faces[1]} and {len(faces) - 2} more"


def _thin(mesh: Polyhedra, shells: _Shells) -> dict[int, str]:
    """Bodies with a shell thinner than rounding."""
    size = (shells.high - shells.low).max(axis=1)
    thin = np.flatnonzero(~(np.abs(shells.volume) > ROUNDING * size * shells.area))[::-1]
    return {int(shells.body[k]): f"has a shell without volume ({shells.named(mesh, int(k))})" for k in thin}


def _misplaced(mesh: Polyhedra, shells: _Shells) -> dict[int, str]:
    """Bodies with a shell that is turned inside out, lies in another's solid, or on another."""
    count = np.bincount(shells.body, minlength=len(mesh))
    several = np.flatnonzero(count[shells.body] > 1)
    if not len(several):
        return {}
    shell, inside = _surrounded(shells, several)
    hole = shells.volume < 0.0
    known = np.zeros(len(shells.body), bool)
    known[shell] = True
    faults: dict[int, str] = {}
    for k in several[::-1].tolist():
        found = inside[shell == k] if known[k] and (inside[shell == k] != hole[k]).any() else None
        if known[k] and found is None:
            continue
        fault = "lies on another"
        if found is not None:
            fault = "is inside another: stone that would count twice" if found.max() > hole[k] else "is inside out"
        faults[int(shells.body[k])] = f"has a shell that {fault} ({shells.named(mesh, k)})"
    return faults


def _surrounded(shells: _Shells, several: Ints, way: Ints | int = 1) -> tuple[Ints, Ints]:
    """Places of shells off all other shells of their bodies: the shell of each, and how often the others go round it.

    Shells of which `way` (m,) is -1 count the other way round.

    Half of the places are corners of triangles, half their middles.
    """
    held = np.diff(shells.start)[several]
    pick = (np.arange(SAMPLES // 2) * held[:, None] // (SAMPLES // 2) + shells.start[several][:, None]).reshape(-1)
    owner = np.tile(np.repeat(several, SAMPLES // 2), 2)
    place = np.concatenate([shells.triangle[pick, 0], shells.triangle[pick].mean(axis=1)])
    body_start = np.searchsorted(shells.body, np.arange(shells.body.max() + 2))
    around = np.zeros(len(place))
    clear = np.ones(len(place), bool)
    for sample, other in ragged_batches(body_start, shells.body[owner]):
        near = (other != owner[sample]) & np.all(
            (place[sample] >= shells.low[other] - ROUNDING) & (place[sample] <= shells.high[other] + ROUNDING), axis=1
        )
        turns, on = _winding(shells, place[sample[near]], other[near])
        clear[sample[near][on]] = False
        np.add.at(around, sample[near], turns * np.broadcast_to(way, len(shells.body))[other[near]])
    return owner[clear], around[clear].astype(np.int64)


def _winding(shells: _Shells, place: Floats, shell: Ints) -> tuple[Floats, Bools]:
    """(k,) how often a shell goes round a place, and (k,) whether that is on it, where the number says nothing."""
    total, on = np.zeros(len(place)), np.zeros(len(place), bool)
    for entry, position in ragged_batches(shells.start, shell):
        p = shells.triangle[position] - place[entry][:, None]
        total += np.bincount(entry, solid_angles(p), len(place))
        on[entry[_is_at_origin(p)]] = True
    return total.round(), on


def _is_at_origin(triangle: Floats) -> Bools:
    """(t,) whether the origin is on a triangle (t, 3, 3), or as near to it as rounding lets be said."""
    side = triangle[:, [1, 2, 0]] - triangle
    normal = np.cross(side[:, 0], side[:, 1])
    length = np.linalg.norm(normal, axis=1)
    on = np.abs(np.einsum("ti,ti->t", triangle[:, 0], normal)) <= 4.0 * ROUNDING * length
    for k in range(3):
        inward = np.cross(normal, side[:, k])
        room = -np.einsum("ti,ti->t", triangle[:, k], inward)
        on &= room >= -4.0 * ROUNDING * length * np.linalg.norm(side[:, k], axis=1)
    return np.asarray(on & (length > 0.0))


def _overlaid(mesh: Polyhedra) -> dict[int, str]:
    """Bodies of which two faces lie on each other.

    Left out are faces that are not flat if some triangle of their fan looks backward: which of those share a plane with
    another is chance.
    """
    flat, origin = flattened(mesh, ROUNDING)
    normal = face_normals(flat)
    backward = np.einsum("fi,fi->f", normal, face_normals(mesh)[origin]) < 0.0
    folded = np.bincount(origin[backward], minlength=len(mesh.corner_start) - 1) > 0
    one, two, ring = _in_one_plane(flat, normal, ~folded[origin])
    if not len(one):
        return {}
    over = _overlap(flat, ring, one, two)
    faults: dict[int, str] = {}
    for a, b in zip(one[over][::-1].tolist(), two[over][::-1].tolist(), strict=True):
        body = int(flat.face_body[a])
        numbers = sorted({int(origin[k] - mesh.face_start[body]) for k in (a, b)})
        back = float(normal[a] @ normal[b]) < 0.0
        how = "back to back: no thickness is between them" if back else "facing the same way"
        faults[body] = f"has {_named(numbers)} lying on each other, {how}"
    return faults


def _in_one_plane(mesh: Polyhedra, normal: Floats, chosen: Bools) -> tuple[Ints, Ints, Floats]:
    """Pairs of chosen faces of a body that lie in one plane and whose boxes in it overlap.

    Returns
    -------
    one, two : (k,) int
        Faces.
    ring : (K, 2) float
        All corners in the plane of their face, counter-clockwise; the same coordinates for faces in one plane.
    """
    none = np.zeros(0, np.int64)
    length, normal = np.linalg.norm(normal, axis=1), unit(normal)
    first = mesh.corner_start[:-1]
    origin = mesh.vertex[mesh.corner[first]]
    oblique = np.array([0.5377, 0.6123, 0.5796])
    canonical = normal * np.where(normal @ oblique < 0.0, -1.0, 1.0)[:, None]
    mixed = canonical @ np.array([0.731, 0.417, 0.289]) + 0.613 * np.einsum("fi,fi->f", canonical, origin)
    key = 8.0 * mesh.face_body + mixed
    order = np.argsort(key, kind="stable")
    fresh = np.concatenate([[True], np.diff(key[order]) > SAME_PLANE])
    cluster = np.zeros(len(key), np.int64)
    cluster[order] = np.cumsum(fresh) - 1
    leader = order[np.flatnonzero(fresh)][cluster]
    frame = frames_from_normals(canonical[leader])[:, 1:]
    face = mesh.corner_face
    away = mesh.vertex[mesh.corner] - origin[leader][face]
    ring = np.einsum("ki,kji->kj", away, frame[face])
    wanted = np.flatnonzero((np.bincount(cluster)[cluster] > 1) & (length > ROUNDING**2) & chosen)
    if len(wanted) < 2:
        return none, none, ring
    low, high = np.minimum.reduceat(ring, first)[wanted], np.maximum.reduceat(ring, first)[wanted]
    beside = np.column_stack([4.0 * cluster[wanted], np.zeros(len(wanted))])  # planes side by side
    flat = np.zeros((len(wanted), 1))
    i, j = box_pairs(np.hstack([low + beside, flat]), np.hstack([high + beside, flat]), 0.0)
    overlap = np.minimum(high[i], high[j]) - np.maximum(low[i], low[j])
    i, j = (wanted[k[(overlap > ROUNDING).all(axis=1)]] for k in (i, j))
    same = _height(mesh, normal, i, j) & _height(mesh, normal, j, i)
    return i[same], j[same], ring


def _height(mesh: Polyhedra, normal: Floats, i: Ints, j: Ints) -> Bools:
    """(k,) whether all corners of face j are in the plane of face i."""
    if not len(i):
        return np.zeros(0, bool)
    entry, position = ragged(mesh.corner_start, j)
    away = mesh.vertex[mesh.corner[position]] - mesh.vertex[mesh.corner[mesh.corner_start[i]]][entry]
    height = np.abs(np.einsum("ki,ki->k", away, normal[i][entry]))
    return np.asarray(np.maximum.reduceat(height, np.searchsorted(entry, np.arange(len(i)))) <= 4.0 * ROUNDING)


def _overlap(mesh: Polyhedra, ring: Floats, one: Ints, two: Ints) -> Bools:
    """(k,) whether two faces in one plane have more area in common than rounding."""
    parts = [(ragged(mesh.corner_start, face)[1], offsets(np.diff(mesh.corner_start)[face])) for face in (one, two)]
    p, q = ((ring[position], following(start), start) for position, start in parts)
    around = (np.add.reduceat(np.linalg.norm(xy[after] - xy, axis=1), start[:-1]) for xy, after, start in (p, q))
    return np.asarray(common_areas(p, q) > 2.0 * ROUNDING * np.minimum(*around))
