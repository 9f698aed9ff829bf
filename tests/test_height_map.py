"""Height maps: rasters of true surfaces, and where one comes to rest on another."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.design.rubble.height_map import edges_of, rasters, rest_heights
from cyclopean.errors import InputError
from fixtures_stones import boulder, box, rotation


def raster(vertices, triangles, cell, snapped=False):
    return rasters(vertices[None], triangles, edges_of(triangles), cell, snapped=snapped)[0]


def sampled(vertices, triangles, found, cell, each=400):
    """Extremes of many points of the surface, and whether every one of them lies in the grid."""
    weight = np.random.default_rng(1).dirichlet([1, 1, 1], each)
    point = np.einsum("kb,tbc->tkc", weight, vertices[triangles]).reshape(-1, 3)
    where = (point[:, :2] - found.corner) / cell
    inside = ((where > -1e-5) & (where < np.array(found.low.shape) + 1e-5)).all(axis=1)
    at = np.clip(np.floor(where).astype(int), 0, np.array(found.low.shape) - 1)
    low, high = np.full(found.low.shape, np.inf), np.full(found.low.shape, -np.inf)
    np.minimum.at(low, tuple(at[inside].T), point[inside, 2])
    np.maximum.at(high, tuple(at[inside].T), point[inside, 2])
    return low, high, inside.all()


def test_a_box_covers_its_cells_and_no_more_and_its_heights_are_exact():
    found = raster(*box(0.2, 0.1, 0.3, at=(0.3, 0.5, 0.7)), 0.1, snapped=True)
    assert found.low.tolist() == [[0.7], [0.7]]
    assert found.high.tolist() == [[1.0], [1.0]]
    assert found.corner == pytest.approx([0.3, 0.5], abs=1e-12)
    assert raster(*box(0.2, 0.1, 0.3, at=(0.35, 0.5, 0.7)), 0.1, snapped=True).low.shape == (3, 1)
    assert raster(*box(0.2, 0.1, 0.3, at=(0.35, 0.5, 0.7)), 0.1).low.shape == (2, 1)  # lines that bound it


def test_a_tip_between_the_vertices_of_the_grid_is_found_and_an_edge_across_a_cell():
    """A roof of ridge height 1 over x = 0.25, falling to 0 at x = 0 and 0.5, drawn with two faces: by hand."""
    corner = np.array([[0, 0, 0], [0.5, 0, 0], [0.25, 0, 1], [0, 1, 0], [0.5, 1, 0], [0.25, 1, 1]], float)
    faces = np.array([(0, 1, 2), (3, 5, 4), (0, 3, 4), (0, 4, 1), (0, 2, 5), (0, 5, 3), (1, 4, 5), (1, 5, 2)])
    found = raster(corner, faces, 0.1)
    assert found.high[:, 5] == pytest.approx([0.4, 0.8, 1.0, 0.8, 0.4], abs=1e-6)
    assert (found.low == 0.0).all()


@pytest.mark.parametrize("cell", [0.02, 0.05, 0.3, 2.0])
def test_no_point_of_the_surface_leaves_its_raster_and_the_raster_is_tight(cell):
    vertices, triangles = boulder(3)
    vertices = vertices @ rotation(5).T
    found = raster(vertices, triangles, cell)
    low, high, all_inside = sampled(vertices, triangles, found, cell)
    assert all_inside
    assert not (np.isfinite(low) & ~np.isfinite(found.low)).any()
    both = np.isfinite(low)
    assert (found.low[both] <= low[both] + 1e-6).all()
    assert (found.high[both] >= high[both] - 1e-6).all()
    assert np.median(low[both] - found.low[both]) < 0.003


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
    together = rasters(poses, triangles, edges_of(triangles), 0.05)
    for pose, found in zip(poses, together, strict=True):
        alone = raster(pose, triangles, 0.05)
        assert np.array_equal(alone.low, found.low)
        assert np.array_equal(alone.high, found.high)


def test_rest_heights_are_those_of_the_plain_definition():
    draw = np.random.default_rng(2)
    ground, low = draw.random((9, 7)), draw.random((3, 2))
    low[1, 1] = np.inf
    rest, gap = rest_heights(ground, low, 0.4)
    assert rest.shape == gap.shape == (7, 6)
    covered = [(a, b) for a in range(3) for b in range(2) if low[a, b] < np.inf]
    for i in range(7):
        for j in range(6):
            high = max(ground[i + a, j + b] - low[a, b] for a, b in covered)
            assert rest[i, j] == pytest.approx(high, abs=1e-6)
            left = [min(high + low[a, b] - ground[i + a, j + b], 0.4) for a, b in covered]
            assert gap[i, j] == pytest.approx(sum(left) / len(left), abs=1e-6)


def test_a_grid_too_fine_is_refused():
    with pytest.raises(InputError, match=r"cell: 1e-05 m makes a grid of .* cells; use larger ones"):
        raster(*box(), 1e-5)
