"""Height maps: rasters of surfaces at the middles of cells, exact at the corners of the mesh.

Mutants killed: middles half a cell off; corners outside the covered cells counted; the grid about another middle.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.design.rubble.height_map import rasters
from cyclopean.errors import InputError
from fixtures_stones import boulder, box, rotation


def raster(vertices, triangles, cell, snapped=False):
    return rasters(vertices[None], triangles, cell, snapped=snapped)[0]


def test_a_box_covers_the_cells_whose_middles_it_covers_and_its_heights_are_exact():
    found = raster(*box(0.2, 0.1, 0.3, at=(0.3, 0.5, 0.7)), 0.1, snapped=True)
    covered = found.low < np.inf
    assert covered.sum() == 2
    assert found.low[covered] == pytest.approx(0.7)
    assert found.high[covered] == pytest.approx(1.0)
    aside = raster(*box(0.2, 0.1, 0.3, at=(0.33, 0.5, 0.7)), 0.1, snapped=True)
    assert np.argwhere(aside.low < np.inf).tolist() == [[0, 0], [1, 0]], "middles at 0.35 and 0.45, not at 0.55"
    free = raster(*box(0.2, 0.1, 0.3, at=(0.33, 0.5, 0.7)), 0.1)
    assert free.corner == pytest.approx([0.33, 0.5]), "about the middle of the mesh"


def test_a_ridge_between_the_middles_of_cells_is_found_by_its_corners():
    """A roof of ridge height 1 over x = 0.25, falling to 0 at x = 0 and 0.5: the ridge ends in cells 2 at both ends."""
    corner = np.array([[0, 0, 0], [0.5, 0, 0], [0.25, 0, 1], [0, 1, 0], [0.5, 1, 0], [0.25, 1, 1]], float)
    faces = np.array([(0, 1, 2), (3, 5, 4), (0, 3, 4), (0, 4, 1), (0, 2, 5), (0, 5, 3), (1, 4, 5), (1, 5, 2)])
    found = raster(corner, faces, 0.1)
    assert found.high[:, 5] == pytest.approx([0.2, 0.6, 1.0, 0.6, 0.2], abs=1e-6)
    assert (found.low == 0.0).all()


@pytest.mark.parametrize("cell", [0.02, 0.05])
def test_heights_are_those_of_the_surface_over_the_middles(cell):
    """Along a vertical line through a middle, a closed mesh is entered lowest and left highest: by plain geometry."""
    vertices, triangles = boulder(3)
    vertices = vertices @ rotation(5).T
    found = raster(vertices, triangles, cell)
    corner = vertices[triangles]
    for i, j in np.argwhere(found.low < np.inf)[::7]:
        x, y = found.corner + cell * (np.array([i, j]) + 0.5)
        a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        det = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        s = ((x - corner[:, 0, 0]) * b[:, 1] - (y - corner[:, 0, 1]) * b[:, 0]) / det
        t = (a[:, 0] * (y - corner[:, 0, 1]) - a[:, 1] * (x - corner[:, 0, 0])) / det
        hit = (s >= 0) & (t >= 0) & (s + t <= 1)
        z = (corner[:, 0, 2] + s * a[:, 2] + t * b[:, 2])[hit]
        assert found.low[i, j] <= z.min() + 1e-9
        assert found.high[i, j] >= z.max() - 1e-9
    area = np.count_nonzero(found.low < np.inf) * cell**2
    from scipy.spatial import ConvexHull

    assert area <= ConvexHull(vertices[:, :2]).volume * 1.1


@given(seed=st.integers(0, 50), x=st.integers(-40, 40), y=st.integers(-40, 40))
def test_shifts_by_whole_cells_move_a_raster_and_change_nothing(seed, x, y):
    vertices, triangles = boulder(seed, 1)
    here = raster(vertices, triangles, 0.0625, snapped=True)
    there = raster(vertices + np.array([x, y, 0.0]) * 0.0625, triangles, 0.0625, snapped=True)
    assert there.corner == pytest.approx(here.corner + np.array([x, y]) * 0.0625, abs=1e-12)
    assert there.low == pytest.approx(here.low, abs=1e-6)
    assert there.high == pytest.approx(here.high, abs=1e-6)


def test_poses_together_are_those_one_by_one():
    vertices, triangles = boulder(1, 1)
    poses = np.stack([vertices @ rotation(k).T for k in range(3)])
    together = rasters(poses, triangles, 0.05)
    for pose, found in zip(poses, together, strict=True):
        alone = raster(pose, triangles, 0.05)
        assert np.array_equal(alone.low, found.low)
        assert np.array_equal(alone.high, found.high)


def test_a_grid_too_fine_is_refused():
    with pytest.raises(InputError, match=r"cell: 1e-05 m makes a grid of .* cells; use larger ones"):
        raster(*box(), 1e-5)
