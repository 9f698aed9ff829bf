"""Faces of Rhino's surfaces and polysurfaces as meshes, sampled to a deviation; meshes as they are.

A face that fills its surface is sampled on a grid that is doubled until the middles of its sides and cells lie within
`DEVIATION` of their chords. A trimmed one is read by its render mesh: rhino3dm tells no curves of trims in the plane.
"""

from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.io.bodies import Body
from cyclopean.io.extras import extra
from cyclopean.io.rhino_json import Units, coordinates, decoded, in_metres, mesh_shape

__all__ = ["DEVIATION", "face_bodies", "surface_bodies"]

DEVIATION = 1e-4  # of the face's diagonal, 0.3 mm of a wall of 3 m: how far the mesh may lie off the surface
FIRST = 8  # cells along the longer side to begin with: fewer see no wave
MOST = 256  # cells along a side: a face that needs more is too wild for a wall
ON_EDGE = 1e-3  # of the diagonal: the curve of an edge nearer to the surface's own edge than this is that edge


def face_bodies(where: str, geometry: Any) -> list[Body]:
    """Meshes (in the drawing's unit) of a mesh, a surface, or every face of a polysurface or extrusion; of others none.

    Raises
    ------
    InputError
        A trimmed face without a render mesh, or one that cannot be sampled.
    """
    kind = str(geometry.ObjectType).rpartition(".")[2]
    if kind == "Mesh":
        return [Body(None, *mesh_shape(geometry))]
    if kind == "Surface":
        return [_sampled(where, geometry)]
    brep = geometry.ToBrep(True) if kind == "Extrusion" else geometry if kind == "Brep" else None
    if brep is None:
        return []
    found = []
    for k in range(len(brep.Faces)):
        face = brep.Faces[k]
        body = _sampled(where, face) if _fills(brep, face) else _rendered(where, face)
        turned = _fills(brep, face) and face.OrientationIsReversed
        found.append(Body(None, body.vertices, [ring[::-1] for ring in body.faces]) if turned else body)
    return found


def surface_bodies(where: str, data: object, units: Units) -> list[Body]:
    """Read every face of a surface or polysurface that is JSON, in m; errors as `rhino_json.mesh_body`."""
    found = face_bodies(where, decoded(where, data, "GeometryBase"))
    return [Body(None, in_metres(where, one.vertices, units), one.faces) for one in found]


def _points(face: Any, s: Floats, t: Floats) -> Floats:
    """(s, t, 3) points at shares (s,), (t,) of the domain."""
    (a, b), (c, d) = ((face.Domain(k).T0, face.Domain(k).T1) for k in (0, 1))
    rows = [[face.PointAt(a + x * (b - a), c + y * (d - c)) for y in t.tolist()] for x in s.tolist()]
    return np.array([[(p.X, p.Y, p.Z) for p in row] for row in rows])


def _sampled(where: str, face: Any) -> Body:
    """Quads on a grid, as fine as the deviation asks."""
    rough = _points(face, np.linspace(0.0, 1.0, FIRST + 1), np.linspace(0.0, 1.0, FIRST + 1))
    if not np.isfinite(rough).all():
        raise InputError(f"{where}: a surface in it has points that are not finite; draw it anew")
    size = float(np.linalg.norm(np.ptp(rough.reshape(-1, 3), axis=0)))
    along, up = (float(np.linalg.norm(np.diff(rough, axis=k), axis=2).sum(axis=k).max()) for k in (0, 1))
    cells = [max(1, round(FIRST * side / max(along, up, 1e-300))) for side in (along, up)]
    while True:
        fine = _points(face, *(np.linspace(0.0, 1.0, 2 * count + 1) for count in cells))
        if not max(off := _off_chords(fine)) > DEVIATION * size:
            break
        cells = [count * (1 + (each > DEVIATION * size)) for count, each in zip(cells, off, strict=True)]
        if max(cells) > MOST:
            raise InputError(f"{where}: a surface in it bends too much to be sampled; smooth it, or give a mesh")
    grid = fine[::2, ::2]
    i, j = (x.ravel() for x in np.meshgrid(*(np.arange(count) for count in cells), indexing="ij"))
    first, step = i * (cells[1] + 1) + j, cells[1] + 1
    rings = np.stack([first, first + step, first + step + 1, first + 1], 1)
    return Body(None, grid.reshape(-1, 3), [tuple(ring) for ring in rings.tolist()])


def _off_chords(fine: Floats) -> tuple[float, float]:
    """How far the middles of sides and cells lie off the chords, both ways; `fine` is twice as fine as the cells."""
    own = fine[::2, ::2]
    chord = _off(fine[1::2, ::2], own[:-1], own[1:]), _off(fine[::2, 1::2], own[:, :-1], own[:, 1:])
    middle = _off(fine[1::2, 1::2], own[:-1, :-1], own[1:, 1:])
    return max(chord[0], middle if chord[0] >= chord[1] else 0.0), max(chord[1], middle if chord[1] > chord[0] else 0.0)


def _off(point: Floats, start: Floats, end: Floats) -> float:
    """Greatest distance of points from the chords below them."""
    along, here = end - start, point - start
    square = (along * along).sum(axis=-1, keepdims=True)
    share = np.clip((here * along).sum(axis=-1, keepdims=True) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return float(np.linalg.norm(here - share * along, axis=-1).max(initial=0.0))


def _fills(brep: Any, face: Any) -> bool:
    """Whether a face is its whole surface: no holes, and its edges lie on the edges of that."""
    from scipy.spatial import cKDTree

    if len(face.Loops) != 1:
        return False
    share = np.linspace(0.0, 1.0, 16 * FIRST + 1)
    ends = np.array([0.0, 1.0])
    rim = np.concatenate([_points(face, share, ends).reshape(-1, 3), _points(face, ends, share).reshape(-1, 3)])
    size = float(np.linalg.norm(np.ptp(rim, axis=0)))
    apart = float(np.linalg.norm(np.diff(_points(face, share, ends), axis=0), axis=2).max())
    apart = max(apart, float(np.linalg.norm(np.diff(_points(face, ends, share), axis=1), axis=2).max()))
    points = []
    for k in range(face.OuterLoop.TrimCount):
        number = face.OuterLoop.Trims[k].EdgeIndex
        if number >= 0:
            edge = brep.Edges[number]
            low, high = edge.Domain.T0, edge.Domain.T1
            points += [edge.PointAt(low + x * (high - low)) for x in np.linspace(0.0, 1.0, FIRST + 1).tolist()]
    far = cKDTree(rim).query(coordinates(points))[0]
    return bool(np.all(far <= apart / 2.0 + ON_EDGE * size))


def _rendered(where: str, face: Any) -> Body:
    mesh = face.GetMesh(extra("rhino").MeshType.Any)
    if mesh is None or not len(mesh.Faces):
        raise InputError(
            f"{where}: a face in it is trimmed and has no render mesh; in Rhino, run Mesh on it, or untrim it"
        )
    return Body(None, *mesh_shape(mesh))
