"""Points inside stones: each stands for the same volume, and they belong to the body.

By hand: half of the points of a box lie before its middle plane; a box of sides a has the variances a^2 / 12; an L of
two arms with volumes 2 and 1 has two thirds of its points in the first, and none in the corner that it leaves out.
"""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.design.stones.quarry import quarry
from cyclopean.design.stones.sampling import BITS, SHIFT, SIDE, _intervals, _sobol, body_points
from cyclopean.design.stones.stone import in_body_frame, stone_of
from cyclopean.errors import InputError
from cyclopean.geometry.solids import difference, mesh_of, solid_of, solid_volume
from laws import examples

QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
SHARE = 0.018  # of the volume; 1,024 points, 1,800 half-spaces: 0.3 % in the mean, 1.0 % in 99 of 100, 1.5 % at worst


def box(low, high):
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    return solid_of(np.array(low) + corner * (np.array(high) - np.array(low)), QUADS)


def stone(solid, name="s"):
    return stone_of(name, *mesh_of(solid))


def in_stone_frame(one, count):
    return body_points([one], count)[0].astype(float) @ one.axes + one.centroid


def l_shape(deep=0.5):
    return difference(box((0, 0, 0), (2, 2, deep)), box((1, 1, -1), (3, 3, deep + 1)))


def test_a_box_by_hand():
    sides = np.array([3.0, 2.0, 1.0])
    points = in_stone_frame(stone(box((5, 5, 5), 5 + sides)), 1024) - 5.0
    assert (points > -1e-6).all()
    assert (points < sides + 1e-6).all()
    for axis in range(3):
        assert np.mean(points[:, axis] < sides[axis] / 2) == pytest.approx(0.5, abs=0.004)
    assert points.mean(axis=0) == pytest.approx(sides / 2, rel=0.004)
    assert points.var(axis=0) == pytest.approx(sides**2 / 12, rel=0.01)


def test_no_column_of_a_box_is_lost_along_the_diagonals_of_its_faces():
    one = stone(box((0, 0, 0), (3, 2, 1)))
    _, low, high = _intervals(in_body_frame(one), one.triangles)
    assert high - low == pytest.approx(np.ones(SIDE * SIDE))


@pytest.mark.parametrize("deep", [0.2, 0.5, 6.0])  # in the last, the columns run in the plane of the L
def test_an_l_has_nothing_in_its_corner(deep):
    points = in_stone_frame(stone(l_shape(deep)), 2048)
    x, y, z = points.T
    assert not ((x > 1 + 1e-5) & (y > 1 + 1e-5)).any()
    assert (points > -1e-5).all()
    assert (points < [2 + 1e-5, 2 + 1e-5, deep + 1e-5]).all()
    assert np.mean(y < 1) == pytest.approx(2 / 3, abs=0.006)
    assert np.mean(x < 1) == pytest.approx(2 / 3, abs=0.006)
    assert np.mean(z < deep / 3) == pytest.approx(1 / 3, abs=0.006)


def test_a_stone_with_a_hollow_inside_is_left_hollow():
    hollow = difference(box((0, 0, 0), (3, 2, 1)), box((1, 0.5, 0.25), (2, 1.5, 0.75)))
    points = in_stone_frame(stone(hollow), 2048)
    inside = ((points > [1.001, 0.501, 0.251]) & (points < [1.999, 1.499, 0.749])).all(axis=1)
    assert not inside.any()
    assert np.mean(points[:, 0] < 1) == pytest.approx(2 / 5.5, abs=0.006)


@settings(max_examples=examples(15), deadline=None)
@given(seed=st.integers(0, 10**6), where=st.floats(0.1, 0.9), way=st.integers(0, 10**6))
def test_shares_of_half_spaces_are_those_of_the_solid(seed, where, way):
    one = quarry(1, seed, detail=2)[0]
    points = body_points([one])[0].astype(float)
    normal = np.random.default_rng(way).normal(size=3)
    normal /= np.linalg.norm(normal)
    offset = float(np.quantile(points @ normal, where))
    _, before = solid_of(in_body_frame(one), one.triangles).split_by_plane(tuple(normal), offset)
    assert np.mean(points @ normal <= offset) == pytest.approx(solid_volume(before) / one.volume, abs=SHARE)


@settings(max_examples=examples(15), deadline=None)
@given(seed=st.integers(0, 10**6))
def test_centre_and_inertia_are_those_of_the_solid(seed):
    one = quarry(1, seed, detail=2)[0]
    points = body_points([one])[0].astype(float)
    assert np.abs(points.mean(axis=0) / one.half).max() < 0.009  # of 600 stones 0.007 at worst
    spread = 5.0 * (points.T @ points) / len(points) / np.outer(one.half, one.half)
    assert np.abs(spread - np.eye(3)).max() < 0.036  # 0.032


@settings(max_examples=examples(10), deadline=None)
@given(seed=st.integers(0, 10**6))
def test_neither_frame_nor_order_nor_triangulation_counts(seed):
    draw = np.random.default_rng(seed)
    one = quarry(1, seed, detail=2)[0]
    turn, _ = np.linalg.qr(draw.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    new = draw.permutation(len(one.vertices))
    point = np.zeros_like(one.vertices)
    point[new] = one.vertices @ turn.T + draw.normal(size=3)
    corner = draw.permutation(new[one.triangles])
    middle = len(point) + np.arange(len(corner))  # and each triangle cut into three
    point = np.concatenate([point, point[corner].mean(axis=1)])
    corner = np.concatenate([np.column_stack([corner[:, k], corner[:, (k + 1) % 3], middle]) for k in range(3)])
    again = body_points([stone_of("other", point, corner)])
    assert np.abs(again - body_points([one])).max() < 1e-6


def test_the_first_points_of_more_are_those_of_fewer_and_evenly_spread_too():
    stones = quarry(3, 5, detail=2)
    many = body_points(stones, 2048)
    assert many.shape == (3, 2048, 3)
    assert many.dtype == np.float32
    assert (body_points(stones, 300) == many[:, :300]).all()
    assert (body_points(stones[1:2], 2048)[0] == many[1]).all()
    for one, points in zip(stones, many, strict=True):
        for count in (64, 128, 200, 256):
            assert np.abs(points[:count].mean(axis=0) / one.half).max() < 0.04


def test_the_sequence_is_that_of_sobol():
    from scipy.stats import qmc

    ours = (_sobol(512) * 2.0**BITS).astype(np.uint64) ^ np.array(SHIFT, np.uint64)
    theirs = (qmc.Sobol(3, scramble=False, bits=BITS).random(512) * 2.0**BITS).astype(np.uint64)
    assert (ours[np.lexsort(ours.T)] == theirs[np.lexsort(theirs.T)]).all()  # in the order of a Gray code there


def test_the_first_points_lean_by_a_sixth_of_a_step():
    for count in (1, 2, 16, 64, 1024):
        assert np.abs(_sobol(count).mean(axis=0) - 0.5) * count == pytest.approx(np.full(3, 1 / 6), abs=1e-6)


def test_no_points_no_stones_and_nothing_inside():
    assert body_points([], 8).shape == (0, 8, 3)
    with pytest.raises(InputError, match="ask for at least 1"):
        body_points([], 0)
    one = quarry(1, detail=1)[0]
    with pytest.raises(InputError, match="'stone-0001': is too thin"):
        body_points([dataclasses.replace(one, triangles=one.triangles[:0])])
