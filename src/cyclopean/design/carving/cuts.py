"""Where a stone is cut: the planes of its cell, traced through the boolean operations without any tolerance.

manifold3d remembers of every triangle that comes out of an operation which solid it came from, and which triangle of
that. So a face of a carved stone or of an offcut is known to lie on a plane of the cell because it *is* part of it.

A cell is a closed block of the wall: flat polygons, also ones that are not convex, and fans of triangles where a face
is curved. Its triangles are sorted into planes once, the largest first.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.assembly import Block
from cyclopean.design.stones.stone import Stone
from cyclopean.geometry.mesh_repair import solid_angle
from cyclopean.geometry.polyhedra import face_triangles
from cyclopean.geometry.sides import Sides
from cyclopean.geometry.solids import Solid, mesh_of, mesh_volume, sourced_mesh_of

__all__ = [
    "OWN",
    "CellPlanes",
    "Cut",
    "CutPiece",
    "cuts_of",
    "labelled",
    "pieces_with_cavities",
    "planes_of",
    "reaches",
]

OWN = -1  # label of what is the stone's own surface
PLANE = 1e-6  # of the cell's size: corners within this of a plane lie in it, as for contacts
SAME_SIDE = 0.9  # cosine below which two triangles are not in one plane, however small they are
TRACE = 1e-9  # of the stone's size: where the stone reaches no further beyond a plane, it was not cut by it


@dataclass(frozen=True, slots=True, eq=False)
class CellPlanes:
    """The triangles of a cell and the k planes they lie in, about an origin of its own."""

    vertices: Floats  # (v, 3) m, about the origin
    triangles: Ints  # (t, 3)
    plane: Ints  # (t,) plane of each triangle
    normal: Floats  # (k, 3) unit, outward
    offset: Floats  # (k,) m


@dataclass(frozen=True, slots=True, eq=False)
class CutPiece:
    """A connected solid that came out of stone and cell, each triangle with the plane of the cell that it lies on."""

    vertices: Floats  # (v, 3) m, about the cell's origin
    triangles: Ints  # (t, 3)
    plane: Ints  # (t,) plane of the cell, or OWN
    volume: float  # m3


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """One plane on which the stone is cut, as seen from the stone's own frame."""

    normal: Floats  # (3,) unit, towards what comes off
    offset: float  # m; what stays has normal . x <= offset
    area: float  # m2 of the face that is left
    depth: float  # m; how far what comes off here reaches beyond the plane
    dressing: bool  # too shallow to be called a cut
    to_axis: float  # degrees between the plane and the stone's longest axis: 90 = square across it, 0 = along it
    to_flat: float | None  # degrees to the nearest face that the stone has already: 0 = parallel; None = it has none
    beside: tuple[tuple[int, float], ...]  # neighbouring cuts (indices), angle of the stone between them (degrees)


def planes_of(cell: Block, origin: Floats) -> CellPlanes:
    """Triangles and planes of a cell, about `origin` (3,) m."""
    vertices: Floats = cell.vertices - origin
    size = float(np.linalg.norm(np.ptp(vertices, axis=0))) if len(vertices) else 0.0
    triangles = face_triangles(vertices, cell.faces)
    edge = vertices[triangles]
    double = np.cross(edge[:, 1] - edge[:, 0], edge[:, 2] - edge[:, 0])
    length = np.linalg.norm(double, axis=1)
    unit = double / np.where(length > 0.0, length, 1.0)[:, None]
    plane = np.full(len(triangles), OWN, np.int64)
    normals: list[Floats] = []
    offsets: list[float] = []
    for t in np.argsort(-length, kind="stable"):
        if plane[t] != OWN:
            continue
        offset = float(unit[t] @ edge[t].mean(axis=0))
        in_it = (np.abs(edge @ unit[t] - offset) <= PLANE * size).all(axis=1)
        in_it &= (unit @ unit[t] >= SAME_SIDE) | ~(length > 0.0)
        plane[in_it & (plane == OWN)] = len(normals)
        plane[t] = len(normals)
        normals.append(unit[t])
        offsets.append(offset)
    return CellPlanes(vertices, triangles, plane, np.array(normals).reshape(-1, 3), np.array(offsets))


def pieces_with_cavities(solid: Solid) -> list[list[Solid]]:
    """Connected solids, largest first, each with the shells of the cavities in it.

    manifold3d takes a solid apart by its surface, so that a cavity comes out as a shell of its own, inside out. It is
    given back to the smallest piece that it lies in.
    """
    shells = [shell for shell in solid.decompose() if not shell.is_empty()]
    volume = [mesh_volume(*mesh_of(shell)) for shell in shells]
    outer = sorted((k for k in range(len(shells)) if volume[k] > 0.0), key=lambda k: volume[k])
    found = {k: [shells[k]] for k in outer}
    for k in range(len(shells)):
        if volume[k] < 0.0:
            point = mesh_of(shells[k])[0][0]
            around = next(
                (o for o in outer if volume[o] > -volume[k] and solid_angle(*mesh_of(shells[o]), point) > 0.5), None
            )
            if around is not None:
                found[around].append(shells[k])
    return [found[k] for k in outer[::-1]]


def labelled(shells: Sequence[Solid], room: Solid, planes: CellPlanes) -> CutPiece:
    """One mesh of shells that belong together, each triangle with the plane of the cell that it comes from.

    Parameters
    ----------
    shells : sequence of Solid
        What came out of an operation on stone and cell.
    room : Solid
        The cell that went in, made of `planes.triangles`.
    planes : CellPlanes
        Its planes.
    """
    own = np.unique(sourced_mesh_of(room)[2])
    points, corners, labels, before = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)], 0
    for shell in shells:
        point, corner, source, face = sourced_mesh_of(shell)
        of_cell = np.isin(source, own)
        points.append(point)
        corners.append(corner + before)
        labels.append(np.where(of_cell, planes.plane[np.where(of_cell, face, 0)], OWN))
        before += len(point)
    vertices, triangles = np.concatenate(points), np.concatenate(corners)
    return CutPiece(vertices, triangles, np.concatenate(labels), mesh_volume(vertices, triangles))


def reaches(piece: CutPiece, planes: CellPlanes) -> Floats:
    """(k,) how far (m) an offcut reaches beyond each plane that it was cut off by; -1 for planes that it is not at."""
    found = np.full(len(planes.normal), -1.0)
    for k in np.unique(piece.plane[piece.plane != OWN]).tolist():
        found[k] = max(float((piece.vertices @ planes.normal[k] - planes.offset[k]).max()), 0.0)
    return found


def cuts_of(
    stone: Stone,
    kept: CutPiece,
    planes: CellPlanes,
    depth: Floats,
    pose: tuple[Floats, Floats],
    least: float,
    flat: Floats,
) -> tuple[tuple[Cut, ...], Ints]:
    """Cuts of a carved stone, the largest first, and the cut of each of its triangles.

    Parameters
    ----------
    stone : Stone
        As it is in its own frame.
    kept : CutPiece
        What is left of it.
    planes : CellPlanes
        Of its cell.
    depth : (k,) Floats
        m; how far what comes off reaches beyond each plane, negative where nothing does.
    pose : (3, 3) and (3,) Floats
        Rotation of the stone, and where its centroid lies about the cell's origin (m).
    least : float
        m; a cut that is no deeper is dressing.
    flat : (f, 3) Floats
        Outward unit normals of faces that the stone has already, in its own frame.

    Returns
    -------
    cuts : tuple of Cut
    label : (t,) Ints
        Index of the cut that each triangle lies on, or OWN.
    """
    (turn, middle), area = pose, np.zeros(len(planes.normal))
    edge = kept.vertices[kept.triangles]
    size = np.linalg.norm(np.cross(edge[:, 1] - edge[:, 0], edge[:, 2] - edge[:, 0]), axis=1) / 2.0
    on = kept.plane != OWN
    np.add.at(area, kept.plane[on], size[on])
    trace = TRACE * float(np.linalg.norm(np.ptp(stone.vertices, axis=0)))
    chosen = np.flatnonzero((area > 0.0) & (depth > trace))
    chosen = chosen[np.argsort(-area[chosen], kind="stable")]
    rank = np.full(len(planes.normal) + 1, OWN)  # the last entry is that of OWN itself
    rank[chosen] = np.arange(len(chosen))
    label = rank[kept.plane].astype(np.int64)
    beside = _neighbours(kept, label, planes.normal[chosen], planes.offset[chosen])
    cuts = []
    for i, k in enumerate(chosen.tolist()):
        normal = turn.T @ planes.normal[k]
        offset = float(planes.offset[k] - planes.normal[k] @ middle + normal @ stone.centroid)
        across = float(np.degrees(np.arcsin(min(abs(float(normal @ stone.axes[0])), 1.0))))
        cuts.append(
            Cut(
                sealed("normal", normal, 3),
                offset,
                float(area[k]),
                float(depth[k]),
                bool(depth[k] <= least),
                across,
                float(np.degrees(_angles(flat, normal).min())) if len(flat) else None,
                beside[i],
            )
        )
    return tuple(cuts), label


def _angles(normals: Floats, normal: Floats) -> Floats:
    """(k,) radians between unit vectors and another one; exact near 0, where the cosine is not."""
    return np.asarray(2.0 * np.arcsin(np.clip(np.linalg.norm(normals - normal, axis=1) / 2.0, 0.0, 1.0)))


def _neighbours(kept: CutPiece, label: Ints, normal: Floats, offset: Floats) -> list[tuple[tuple[int, float], ...]]:
    """Cuts that share an edge with each cut, and the angle of the stone between the two (degrees).

    Below 180 where the stone is convex there; what is told by the side of the other plane on which a face lies. An
    edge between two planes of a cell that is not convex may be of both kinds; the longer one counts.
    """
    sides = Sides.of(kept.triangles.ravel(), np.arange(0, kept.triangles.size + 1, 3))
    here, there = np.concatenate([sides.pairs(), sides.pairs()[::-1]], axis=1)
    one, two = label[sides.face[here]], label[sides.face[there]]
    opposite = kept.triangles[sides.face[here], (here + 2) % 3]
    folded: dict[tuple[int, int], float] = {}  # length of convex edges less that of hollow ones
    for e in np.flatnonzero((one != OWN) & (two != OWN) & (one != two)).tolist():
        i, j = int(one[e]), int(two[e])
        start, end, corner = kept.vertices[[sides.tail[here[e]], sides.head[here[e]], opposite[e]]]
        length = float(np.linalg.norm(end - start))
        below = float(normal[j] @ corner) <= offset[j]
        folded[i, j] = folded.get((i, j), 0.0) + (length if below else -length)
    found: list[list[tuple[int, float]]] = [[] for _ in normal]
    for (i, j), more in sorted(folded.items()):
        turn = float(np.degrees(_angles(normal[j : j + 1], normal[i])[0]))
        found[i].append((j, 180.0 - turn if more >= 0.0 else 180.0 + turn))
    return [tuple(row) for row in found]
