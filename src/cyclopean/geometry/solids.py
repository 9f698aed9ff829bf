"""Closed triangle meshes as solids: intersections, differences, pieces. Exact up to rounding, by manifold3d.

manifold3d answers an open mesh with an empty solid of volume 0 and raises nothing, and turns an inverted mesh into one
of negative volume. Here every solid that goes in is looked at, and every volume that comes out is integrated by us
about a local origin (`polyhedra.mass_properties`).

>>> cube = solid_of([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], CUBE)
>>> half = moved(cube, np.eye(3), [0.5, 0.0, 0.0])
>>> round(solid_volume(intersection(cube, half)), 12), round(solid_volume(difference(cube, half)), 12)
(0.5, 0.5)
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.errors import InputError
from cyclopean.geometry.polyhedra import mass_properties, pack

if TYPE_CHECKING:
    from manifold3d import Manifold

__all__ = [
    "CUBE",
    "Solid",
    "beneath",
    "cross_section",
    "difference",
    "fans",
    "intersection",
    "mesh_of",
    "mesh_volume",
    "moved",
    "solid_of",
    "solid_volume",
    "sourced_mesh_of",
]

Solid = Any  # manifold3d's own class; a name for signatures, so that the library is not imported before it is used

# Quads of a box whose corners are counted in binary, x first.
CUBE = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))

_FAULTS = {
    "NonFiniteVertex": "has a coordinate that is not a finite number",
    "NotManifold": "is open, or has edges with more than two faces",
    "VertexOutOfBounds": "has a face that names a vertex which is not there",
}


def solid_of(vertices: ArrayLike, faces: Sequence[Sequence[int]] | Ints, name: str = "mesh") -> Solid:
    """Make a solid of a closed, outward mesh.

    Parameters
    ----------
    vertices : (v, 3) array_like
        m.
    faces : sequence of sequence of int, or (f, 3) array
        Corners counter-clockwise from outside; polygons are cut into fans.
    name : str
        What errors call it.

    Returns
    -------
    Solid

    Raises
    ------
    InputError
        The mesh is open, inside out, of no volume, or not finite.
    """
    from manifold3d import Error, Manifold, Mesh64

    point = np.array(sealed(f"{name}: vertices", vertices, None, 3))  # the library refuses read-only arrays
    made = Manifold(Mesh64(point, np.array(fans(faces), np.uint64)))
    if made.status() != Error.NoError:
        why = made.status().name
        raise InputError(f"{name}: {_FAULTS.get(why, f'is not a solid ({why})')}")
    volume = made.volume()
    if not volume > 0.0:
        raise InputError(f"{name}: {'is inside out' if volume < 0.0 else 'has no volume'}")
    return made


def fans(faces: Sequence[Sequence[int]] | Ints) -> Ints:
    """Triangles (t, 3) of polygon faces, or of an array (f, 3) of such."""
    if all(len(face) == 3 for face in faces):
        return np.array(faces, np.int64).reshape(-1, 3)
    return np.array([(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)], np.int64).reshape(-1, 3)


def mesh_of(solid: Solid) -> tuple[Floats, Ints]:
    """Vertices (v, 3) and triangles (t, 3) of a solid; empty where it is empty."""
    return sourced_mesh_of(solid)[:2]


def sourced_mesh_of(solid: Solid) -> tuple[Floats, Ints, Ints, Ints]:
    """The mesh of a solid, and of each triangle (t,) which solid it comes from, by its number, and which face there.

    The library tells triangles by the solids that they come from, in the order in which those were made. Here they are
    sorted, so that the same operations give the same mesh whatever was made before.
    """
    mesh = solid.to_mesh64()
    vertices = np.array(mesh.vert_properties, np.float64)[:, :3].reshape(-1, 3)
    triangles = np.array(mesh.tri_verts, np.int64).reshape(-1, 3)
    turned = (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3 if len(triangles) else triangles
    triangles = np.take_along_axis(triangles, turned, axis=1)
    order = np.lexsort(triangles.T[::-1])
    start = np.array(mesh.run_index, np.int64) // 3
    source = np.repeat(np.array(mesh.run_original_id, np.int64), start[1:] - start[:-1])
    return vertices, triangles[order], source[order], np.array(mesh.face_id, np.int64)[order]


def solid_volume(solid: Solid) -> float:
    """Volume (m3), integrated by us from the triangles."""
    return mesh_volume(*mesh_of(solid))


def mesh_volume(vertices: Floats, triangles: Ints) -> float:
    """Volume (m3) within closed triangles, negative where they face inwards; 0 where there are none."""
    return float(mass_properties(pack([(vertices, triangles)])).volume[0])


def intersection(a: Solid, b: Solid) -> Solid:
    """What two solids have in common; may be empty."""
    from manifold3d import Manifold, OpType

    return _sound(Manifold.batch_boolean([a, b], OpType.Intersect))


def difference(a: Solid, b: Solid) -> Solid:
    """What is left of `a` without `b`; may be empty."""
    from manifold3d import Manifold, OpType

    return _sound(Manifold.batch_boolean([a, b], OpType.Subtract))


def cross_section(solid: Solid, height: float) -> list[Floats]:
    """Rings (k, 2), x and y, in which the level plane z = height cuts a solid; holes run the other way round."""
    return [np.array(ring, np.float64) for ring in solid.slice(height).to_polygons()]


def beneath(solid: Solid, normal: ArrayLike, offset: float) -> Solid:
    """What of a solid has normal . x <= offset (m), for a unit normal (3,); may be empty."""
    return _sound(solid.trim_by_plane(-np.asarray(normal, float), -offset))


def moved(solid: Solid, rotation: ArrayLike, shift: ArrayLike) -> Solid:
    """The solid with each point x taken to rotation x + shift."""
    matrix = np.column_stack([sealed("rotation", rotation, 3, 3), sealed("shift", shift, 3)])
    return _sound(solid.transform(matrix))


def _sound(solid: "Manifold") -> "Manifold":
    """Pass a result on only if the library says that it is one."""
    from manifold3d import Error

    if solid.status() != Error.NoError:
        raise InputError(f"solid: the operation failed ({solid.status().name})")
    return solid
