"""What a stone and a cell have in common, exactly, and poses at which a stone of the cell's own shape fits it exactly.

A stone with the cell's shape, of whatever size, comes to lie as the cell does when their principal axes are put on each
other (4 ways), or, where axes are as long as one another and so mean nothing, when its corners are put on the cell's.
"""

from collections.abc import Sequence

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.matching.cells import Cells
from cyclopean.design.matching.refine import turned_by
from cyclopean.design.stones.stone import Stone, in_body_frame
from cyclopean.geometry.solids import Solid, intersection, mesh_of, moved, solid_of, sourced_mesh_of

__all__ = ["ALIKE", "SAME", "Solids", "climbed", "corner_fit", "principal", "registered", "unlikeness"]

FITS = 6  # rounds in which corners are paired with the nearest ones
ALIKE = 0.01  # ratios of semi-axes of stone and cell differ by less where they may be of one shape
SAME = 1e-6  # and by less than this where they nearly certainly are
FLIPS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])  # proper turns of axes


class Solids:
    """Stones in their body frames and cells about their centres, made into solids when first asked for."""

    def __init__(self, stones: Sequence[Stone], cells: Cells) -> None:
        self._stones, self._cells = stones, cells
        self._made: dict[tuple[str, int], Solid] = {}

    def stone(self, i: int) -> Solid:
        """Stone i, in its body frame."""
        if ("stone", i) not in self._made:
            stone = self._stones[i]
            made = solid_of(in_body_frame(stone), stone.triangles, f"stone '{stone.id}'")
            self._made["stone", i] = made.as_original()  # so that a piece of its surface is known as such
        return self._made["stone", i]

    def cell(self, j: int) -> Solid:
        """Cell j, about its centre."""
        if ("cell", j) not in self._made:
            block = self._cells.assembly.blocks[self._cells.block[j]]
            self._made["cell", j] = solid_of(block.vertices - self._cells.centre[j], block.faces, f"block '{block.id}'")
        return self._made["cell", j]

    def radius(self, i: int) -> float:
        """Of gyration of stone i (m)."""
        return float(np.sqrt((self._stones[i].half ** 2).sum() / 5.0))

    def shared(self, i: int, j: int, rotation: Floats, shift: Floats) -> float:
        """Volume (m3) that stone i, turned (3, 3) and shifted (3,) m from cell j's centre, has in common with it."""
        vertices, triangles = mesh_of(intersection(moved(self.stone(i), rotation, shift), self.cell(j)))
        return _volume(vertices[triangles])

    def slope(self, i: int, j: int, rotation: Floats, shift: Floats) -> tuple[float, Floats]:
        """`shared`, and how it grows (6,) with a shift (m2) and with a turn about the stone's centroid (m3 a radian).

        A stone that moves by v gains the integral of v . n over that part of its surface that lies in the cell.
        """
        common = intersection(moved(self.stone(i), rotation, shift), self.cell(j))
        vertices, triangles, source, _ = sourced_mesh_of(common)
        corner, own = vertices[triangles], source == self.stone(i).original_id()
        normal = np.cross(corner[own, 1] - corner[own, 0], corner[own, 2] - corner[own, 0]) / 2.0
        arm = corner[own].mean(axis=1) - shift
        return _volume(corner), np.concatenate([normal.sum(axis=0), np.cross(arm, normal).sum(axis=0)])


def _volume(corner: Floats) -> float:
    """Of a closed mesh, by its triangles (t, 3, 3)."""
    if not len(corner):
        return 0.0
    a, b, c = (corner[:, k] - corner[0, 0] for k in range(3))
    return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0)


def climbed(
    solids: Solids, i: int, j: int, rotation: Floats, shift: Floats, steps: int
) -> tuple[float, Floats, Floats]:
    """Volume in common, rotation and shift after a climb by exact volumes (BFGS), from a pose near the top.

    Parameters
    ----------
    solids : Solids
        Stones and cells.
    i, j : int
        Stone and cell.
    rotation, shift : (3, 3), (3,) float
        Pose to begin with.
    steps : int
        Of the climb.
    """
    from scipy.optimize import minimize

    radius = solids.radius(i)  # what a turn by a radian moves the stone
    unit = radius**3

    def posed(x: Floats) -> tuple[Floats, Floats]:
        return turned_by(x[None, 3:])[0] @ rotation, shift + radius * x[:3]

    def downhill(x: Floats) -> tuple[float, Floats]:
        volume, slope = solids.slope(i, j, *posed(x))
        return -volume / unit, -np.concatenate([radius * slope[:3], slope[3:]]) / unit

    found = minimize(downhill, np.zeros(6), jac=True, method="BFGS", options={"maxiter": steps})
    return -unit * float(found.fun), *posed(found.x)


def principal(cells: Cells) -> tuple[Floats, Floats]:
    """Principal axes (m, 3, 3), as rows, and semi-axes (m, 3) (m) of the cells, longest first, as `Stone` has them."""
    value, vector = np.linalg.eigh(cells.assembly.mass.spread[cells.block])
    axes = vector[:, :, ::-1].transpose(0, 2, 1).copy()
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return axes, np.sqrt(5.0 * np.maximum(value[:, ::-1], 0.0) / cells.volume[:, None])


def unlikeness(half: Floats, cell_half: Floats) -> Floats:
    """(n,) by how much the ratios of semi-axes (n, 3) differ from (3,); 0 for bodies of one shape, of any size."""
    return np.asarray(np.ptp(np.log(np.maximum(half, 1e-300)) - np.log(np.maximum(cell_half, 1e-300)), axis=1))


def registered(axes: Floats) -> Floats:
    """(4, 3, 3) or (b, 4, 3, 3) rotations that put a stone's axes on those of cells (3, 3) or (b, 3, 3), either way."""
    return np.asarray(np.swapaxes(axes, -1, -2)[..., None, :, :] * FLIPS[:, None, :])


def corner_fit(
    vertices: Floats, corners: Floats, scale: float, rotation: Floats, shift: Floats
) -> tuple[Floats, Floats]:
    """Pose that puts the corners of a stone on those of a cell, from a pose that nearly does.

    Each of the cell's corners is paired with the nearest of the stone's, and the turn and shift with the least squares
    are taken (Besl and McKay 1992, Kabsch 1976), a few times over.

    Parameters
    ----------
    vertices : (v, 3) float
        m, of the stone, body frame.
    corners : (c, 3) float
        m, of the cell, about its centre.
    scale : float
        Of the cell over the stone, as lengths.
    rotation, shift : (3, 3), (3,) float
        Pose to begin with.
    """
    from scipy.spatial import cKDTree

    scaled = vertices * scale
    for _ in range(FITS):
        near = scaled[cKDTree(scaled @ rotation.T + shift).query(corners)[1]]
        from_, to = near.mean(axis=0), corners.mean(axis=0)
        u, _, vt = np.linalg.svd((corners - to).T @ (near - from_))
        rotation = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
        shift = to - rotation @ from_
    return rotation, shift
