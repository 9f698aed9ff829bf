"""Solids: intersections, differences, cuts and pieces, by hand and by laws.

By hand: unit cubes shifted by (a, b, c) have (1 - a)(1 - b)(1 - c) in common; a cube cut by the plane through three of
its corners loses 1/6; a cube without a slab through its middle is two pieces of 0.45.
Mutants killed: difference for intersection; the part before for the part beyond a plane; the shift turned with the
rotation; no look at the status, or at the sign of the volume; a cube of the library's own volume for ours; triangles
of a mesh as the library has them.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from cyclopean.errors import InputError
from cyclopean.geometry import mass_properties, mesh_faults, pack
from cyclopean.geometry.solids import (
    CUBE,
    difference,
    intersection,
    mesh_of,
    mesh_volume,
    moved,
    solid_of,
    solid_volume,
    sourced_mesh_of,
)
from cyclopean.io import read_stones
from fixtures_stones import NAMES, SCANS, boulder, box, needs_scans, rotation, subdivided
from geometry_rules import hull_mesh
from laws import examples

SEEDS = st.integers(0, 2**32 - 1)
SHIFT = st.tuples(*[st.floats(0.01, 0.99)] * 3)
RELATIVE = 1e-9  # of the larger volume: what the library may lose in new corners, with two decades in hand


def two(seed):
    draw = np.random.default_rng(seed)
    a, b = (solid_of(*boulder(seed % 13 + k)) for k in range(2))
    return a, moved(b, rotation(seed), draw.uniform(-0.15, 0.15, 3))


@settings(max_examples=examples(50), deadline=None)
@given(shift=SHIFT)
def test_two_cubes_by_hand(shift):
    cube = solid_of(*box())
    other = moved(cube, np.eye(3), shift)
    common = float(np.prod(1.0 - np.array(shift)))
    assert solid_volume(intersection(cube, other)) == pytest.approx(common, rel=1e-9, abs=1e-12)
    assert solid_volume(difference(cube, other)) == pytest.approx(1.0 - common, rel=1e-9, abs=1e-12)


def test_cubes_apart_and_the_same():
    cube = solid_of(*box())
    away = moved(cube, np.eye(3), [5.0, 0, 0])
    assert solid_volume(intersection(cube, away)) == 0.0
    assert [len(part) for part in mesh_of(intersection(cube, away))] == [0, 0]
    assert solid_volume(difference(cube, away)) == pytest.approx(1.0)
    assert solid_volume(intersection(cube, cube)) == pytest.approx(1.0)
    assert solid_volume(difference(cube, cube)) == 0.0


def test_polygons_are_cut_into_fans():
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    assert solid_volume(solid_of(box(2.0, 3.0, 4.0)[0], quads)) == pytest.approx(24.0)


def test_volume_by_hand_wherever_it_lies():
    vertices, triangles = box(2.0, 2.0, 2.0, at=(7.0, 7.0, 7.0))
    assert mesh_volume(vertices, triangles) == pytest.approx(8.0, rel=1e-14)
    assert mesh_volume(vertices, triangles[:, ::-1]) == pytest.approx(-8.0, rel=1e-14)
    assert mesh_volume(np.zeros((0, 3)), np.zeros((0, 3), np.int64)) == 0.0


def test_triangles_know_the_face_that_they_come_from_whatever_was_made_before():
    """A cube without the corner of another: of each triangle the plane of its face, by the cube that it is of."""
    small = solid_of(box(0.5, 0.5, 0.5, at=(0.6, 0.6, 0.6))[0], CUBE)
    cube = solid_of(*box())
    for one, other in ((cube, small), (small, cube)):
        for made in (difference(one, other), intersection(one, other)):
            vertices, triangles, source, face = sourced_mesh_of(made)
            for solid in (one, other):
                corner, own = sourced_mesh_of(solid)[0], source == sourced_mesh_of(solid)[2][0]
                assert own.any()
                shell, part = mesh_of(solid)[1], sourced_mesh_of(solid)[3]
                for triangle, number in zip(triangles[own], face[own], strict=True):
                    a, b, c = corner[shell[part == number][0]]
                    assert np.abs((vertices[triangle] - a) @ np.cross(b - a, c - a)).max() < 1e-12


def test_a_turn_comes_before_a_shift():
    quarter = [[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]
    corner = mesh_of(moved(solid_of(*box(2.0, 1.0, 1.0)), quarter, [10.0, 0, 0]))[0]
    assert corner.min(axis=0) == pytest.approx([9, 0, 0])
    assert corner.max(axis=0) == pytest.approx([10, 2, 1])


@settings(max_examples=examples(60), deadline=None)
@given(seed=SEEDS)
def test_what_is_common_and_what_is_left_make_the_whole(seed):
    a, b = two(seed)
    common, left, right = intersection(a, b), difference(a, b), difference(b, a)
    whole = solid_volume(a)
    assert solid_volume(common) + solid_volume(left) == pytest.approx(whole, rel=RELATIVE)
    assert solid_volume(common) + solid_volume(right) == pytest.approx(solid_volume(b), rel=RELATIVE)
    assert solid_volume(intersection(b, a)) == pytest.approx(solid_volume(common), abs=RELATIVE * whole)
    assert solid_volume(intersection(left, b)) == pytest.approx(0.0, abs=RELATIVE * whole)
    for solid in (common, left):
        vertices, triangles = mesh_of(solid)
        assert not len(triangles) or mesh_faults(pack([(vertices, triangles)])) == []


@settings(max_examples=examples(40), deadline=None)
@given(seed=SEEDS)
def test_volumes_do_not_see_a_motion_of_both(seed):
    a, b = two(seed)
    draw = np.random.default_rng(seed)
    turn, shift = rotation(seed + 1), draw.uniform(-20, 20, 3)
    c, d = moved(a, turn, shift), moved(b, turn, shift)
    assert solid_volume(c) == pytest.approx(solid_volume(a), rel=1e-11)
    assert solid_volume(intersection(c, d)) == pytest.approx(solid_volume(intersection(a, b)), rel=1e-8, abs=1e-12)


@settings(max_examples=examples(30), deadline=None)
@given(seed=SEEDS)
def test_the_volume_is_that_of_the_mesh_and_does_not_depend_on_its_triangles(seed):
    vertices, triangles = boulder(seed % 13)
    by_mesh = mass_properties(pack([(vertices, triangles)])).volume[0]
    assert solid_volume(solid_of(vertices, triangles)) == pytest.approx(by_mesh, rel=1e-12)
    assert solid_volume(solid_of(*subdivided(vertices, triangles))) == pytest.approx(by_mesh, rel=1e-12)
    hull = solid_of(*hull_mesh(vertices))
    assert solid_volume(hull) == pytest.approx(ConvexHull(vertices).volume, rel=1e-12)
    assert solid_volume(hull) >= by_mesh * (1.0 - 1e-12)
    assert solid_volume(difference(solid_of(vertices, triangles), hull)) == pytest.approx(0.0, abs=1e-6 * by_mesh)


@pytest.mark.parametrize("how", [intersection, difference])
def test_a_mesh_does_not_depend_on_which_solid_was_made_first(how):
    def made(order):
        solids = {k: solid_of(*boulder(k)) for k in order}
        return mesh_of(how(solids[0], moved(solids[1], np.eye(3), [0.1, 0.05, 0.0])))

    for one, other in zip(made((0, 1)), made((1, 0)), strict=True):
        assert one.tobytes() == other.tobytes()


def test_refusals():
    vertices, triangles = box()
    spoilt = vertices.copy()
    spoilt[3, 1] = np.nan
    for mesh, said in (
        ((vertices, triangles[1:]), "stone: is open, or has edges with more than two faces"),
        ((vertices, triangles[:, ::-1]), "stone: is inside out"),
        ((spoilt, triangles), r"stone: vertices\[3, 1\]: nan is not a finite number"),
        ((vertices, triangles + 1), "stone: has a face that names a vertex which is not there"),
        ((vertices * [1.0, 1.0, 0.0], triangles), "stone: has no volume"),
    ):
        with pytest.raises(InputError, match=said):
            solid_of(*mesh, name="stone")
    cube = solid_of(vertices, triangles)
    with pytest.raises(InputError, match="rotation"):
        moved(cube, np.full((3, 3), np.nan), [0, 0, 0])


@needs_scans
@pytest.mark.parametrize("k", range(len(NAMES)))
def test_a_scan_carved_by_a_box_loses_nothing(k):
    stone = read_stones(SCANS / f"{NAMES[k]}.obj", "m", cache=False)[0].stones[0]
    solid = solid_of(stone.vertices, stone.triangles)
    cell = moved(solid_of(*box(0.7, 0.6, 0.5, at=(-0.35, -0.3, -0.25))), rotation(k), stone.centroid)
    kept, cut = intersection(solid, cell), difference(solid, cell)
    assert solid_volume(kept) + solid_volume(cut) == pytest.approx(stone.volume, rel=RELATIVE)
    assert 0.0 < solid_volume(kept) < min(stone.volume, 0.21)
