"""Convex parts that stones are simulated by: they cover the stone and hardly stand out of it.

By hand: an L of three unit cubes is not convex. Its hull stands out by half a diagonal of the missing cube's section,
sqrt(1/2), in the middle of the hollow corner: a part that joins its two ends across the hollow is refused.
"""

import sys
from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold, OpType
from scipy.spatial import ConvexHull

from cyclopean.design.stones.quarry import quarry
from cyclopean.errors import InputError
from cyclopean.geometry import pack, triangles
from cyclopean.geometry.solids import CUBE, difference, mesh_of, solid_of, solid_volume

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))

from simulated import parts_of

BOX = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])


def ell() -> tuple[np.ndarray, np.ndarray]:
    """An L of volume 3, its faces cut into small triangles."""
    cube = solid_of(2.0 * BOX, CUBE)
    hollow = solid_of(BOX * [1.0, 1.0, 4.0] + [1.0, 1.0, -1.0], CUBE)
    return mesh_of(difference(cube, hollow).refine_to_length(0.4))


def test_a_convex_block_is_one_part() -> None:
    corner, _ = triangles(pack([(BOX, CUBE)]))
    found = parts_of(BOX, corner)
    assert (len(found.corners), found.out, found.covered) == (1, 0.0, 1.0)


def test_no_part_spans_a_hollow_corner() -> None:
    vertices, corner = ell()
    found = parts_of(vertices, corner)
    assert found.out <= 0.01
    assert found.covered == pytest.approx(1.0)
    assert parts_of(vertices, corner, most=9.0).out > 0.01, "patches alone stand out: the limit is what keeps them in"


@pytest.mark.parametrize("seed", range(3))
def test_parts_of_stones_cover_them(seed: int) -> None:
    stone = quarry(1, seed, detail=2)[0]
    vertices, corner = stone.vertices, stone.triangles
    found = parts_of(vertices, corner, most=0.02)
    solid = solid_of(vertices, corner)
    union = Manifold.batch_boolean([Manifold.hull_points(c) for c in found.corners], OpType.Add)
    size = np.cbrt(solid.volume())
    assert found.out <= 0.02
    assert solid_volume(difference(union, solid)) <= found.out * size * solid.surface_area()
    planes = [ConvexHull(c).equations for c in found.corners]
    point = vertices[corner].mean(axis=1)
    within = [(point @ p[:, :3].T + p[:, 3] <= 1e-9 * size).all(axis=1) for p in planes]
    assert np.any(within, axis=0).all(), "a part of the surface is not simulated"


def test_an_open_mesh_is_refused() -> None:
    with pytest.raises(InputError, match="is open"):
        parts_of(BOX, triangles(pack([(BOX, CUBE)]))[0][:-1])
