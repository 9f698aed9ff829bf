"""How precisely a model is drawn: the length within which its faces touch, and coordinates without a far origin."""

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly.blocks import Assembly
from cyclopean.geometry import Polyhedra

__all__ = ["FLAT_SHARE", "LEANS", "ROUGH_SHARE", "length_tolerance", "local_mesh"]

RELATIVE_TOLERANCE = 1e-6  # of the size that `length_tolerance` takes: six digits of a drawing
FLAT_SHARE = 0.005  # of the smaller block's size: further off its faces, a contact is none, as the checker has it
ROUGH_SHARE = 0.025  # likewise where faces lean from it, are rough or curved
LEANS = 1e-3  # sine of the angle beyond which faces lean from each other, as the checker has it


def length_tolerance(assembly: Assembly) -> float:
    """Length (m) below which two faces count as touching: 1e-6 of the model's size.

    Size is the diagonal of the model's bounding box, but no more than a hundred times that of the median block (of
    two in the middle the smaller), so that a wide ground slab does not coarsen it; where the model lies does not
    matter, unless so far off that eight units of rounding of its coordinates are larger still. It is the precision of
    numbers in a file; what may be forgiven between two blocks belongs to the smaller of them.
    """
    mesh = assembly.mesh
    if not len(mesh.vertex):
        return 0.0
    diagonal = np.sort(mesh.diagonal)
    size = min(assembly.size, 100.0 * float(diagonal[(len(diagonal) - 1) // 2]) or np.inf)
    return max(RELATIVE_TOLERANCE * size, 8.0 * float(np.spacing(np.abs(mesh.vertex).max())))


def local_mesh(assembly: Assembly) -> tuple[Polyhedra, Floats]:
    """All meshes about the middle of their common bounding box, and where that is (m)."""
    mesh = assembly.mesh
    if not len(mesh.vertex):
        return mesh, np.zeros(3)
    origin = (mesh.vertex.min(axis=0) + mesh.vertex.max(axis=0)) / 2.0
    moved = Polyhedra(mesh.vertex - origin, mesh.vertex_start, mesh.corner, mesh.corner_start, mesh.face_start)
    return moved, origin
