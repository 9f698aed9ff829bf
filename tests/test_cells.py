"""Cells: convex pieces, half-spaces, frames.

By hand: an L of three unit squares is two convex pieces, a plus of five is five squares or fewer; a box's half-spaces
lie half its sides from its centre; of an L's points, those in the missing square are outside.

Mutants killed (by hand): sign of a side's normal; a cap's plane dropped; frame left-handed; supports taken for cells; a
dent beside the caps overlooked; pieces never joined; pieces joined once only.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.assembly import Assembly, Block
from cyclopean.design import arch, dome, wall
from cyclopean.design.matching.cells import cells_of
from cyclopean.design.walls.corner import corner_wall
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cylinder, Sphere
from cyclopean.errors import InputError
from cyclopean.geometry.polygon import convex_pieces
from laws import examples
from matching_cases import box, model, prism, rotation

L = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
PLUS = [(1, 0), (2, 0), (2, 1), (3, 1), (3, 2), (2, 2), (2, 3), (1, 3), (1, 2), (0, 2), (0, 1), (1, 1)]


def area(ring):
    x, y = np.asarray(ring, float).T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2.0)


def is_convex(ring):
    at = np.asarray(ring, float)
    ahead = np.roll(at, -1, axis=0) - at
    behind = np.roll(ahead, 1, axis=0)
    return bool((behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0] >= -1e-9).all())


def inside(cells, j, points):
    """Points (n, 3) in the wall that the half-spaces of a cell hold."""
    depth = (points - cells.centre[j]) @ cells.normal[j].reshape(-1, 3).T - cells.offset[j].reshape(-1)
    return depth.reshape(len(points), *cells.offset[j].shape).max(axis=2).min(axis=1) <= 0.0


def sampled_volume(cells, j, count=20000):
    vertices = cells.assembly.blocks[cells.block[j]].vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    points = np.random.Generator(np.random.PCG64(0)).uniform(low, high, (count, 3))
    return inside(cells, j, points).mean() * np.prod(high - low)


@pytest.mark.parametrize(("ring", "most"), [(L, 2), (PLUS, 5), ([(0, 0), (1, 0), (1, 1), (0, 1)], 1)])
def test_pieces_by_hand(ring, most):
    pieces = convex_pieces(ring)
    assert len(pieces) <= most
    assert all(is_convex([ring[i] for i in piece]) for piece in pieces)
    assert sum(area([ring[i] for i in piece]) for piece in pieces) == pytest.approx(area(ring), rel=1e-12)


@given(st.lists(st.floats(0.3, 1.0), min_size=5, max_size=12), st.floats(0.0, 1.0))
@settings(max_examples=examples(100), deadline=None)
def test_pieces_of_any_star_are_convex_and_cover_it(radius, start):
    angle = 2.0 * np.pi * (start + np.arange(len(radius))) / len(radius)
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * np.array(radius)[:, None]
    pieces = convex_pieces(ring)
    assert all(is_convex(ring[piece]) for piece in pieces)
    assert sum(area(ring[piece]) for piece in pieces) == pytest.approx(area(ring), rel=1e-9)
    reflex = sum(not is_convex(ring[[k - 1, k, (k + 1) % len(ring)]]) for k in range(len(ring)))
    assert len(pieces) <= 1 + 2 * reflex  # Hertel and Mehlhorn: at most two diagonals a reflex corner


def test_half_spaces_of_a_box_by_hand():
    cells = cells_of(model(box((2.0, 0.5, 1.0), (3.0, 0.0, 7.0)), box((9, 9, 1), (0, 0, -9)), fixed=(1,)))
    assert cells.form == ("convex",)
    assert cells.block.tolist() == [0]
    assert cells.centre[0] == pytest.approx([3.0, 0.0, 7.0])
    planes = sorted((tuple(np.round(n, 12)), d) for n, d in zip(cells.normal[0, 0], cells.offset[0, 0], strict=True))
    assert [d for _, d in planes] == pytest.approx([1.0, 0.25, 0.5, 0.5, 0.25, 1.0])
    assert cells.frame[0] == pytest.approx(np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]))
    assert cells.depth[0] == pytest.approx([-0.25, 0.25])
    assert cells.reach[0] == pytest.approx(np.hypot(1.0, 0.5))


def test_an_l_is_two_parts_and_no_more_than_itself():
    cells = cells_of(model(prism(L), box((9, 9, 1), (0, 0, -9)), fixed=(1,)))
    assert cells.form == ("prism",)
    assert cells.part_count.tolist() == [2]
    points = np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [0.5, 0.5, 1.5], [1.5, 0.5, 1.5], [0.5, 1.5, 0.5]])
    assert inside(cells, 0, points).tolist() == [True, True, True, False, False]
    assert sampled_volume(cells, 0) == pytest.approx(3.0, rel=0.02)


def test_what_is_no_prism_is_its_hull_and_says_so():
    """A cube with a pyramid pressed into its top, and its front: neither convex nor between two caps."""
    vertices, faces = box((1.0, 1.0, 1.0))
    extra = np.array([[0.0, 0.0, 0.2], [0.0, -0.2, 0.0]])
    dented = [f for f in faces if f not in ((1, 5, 7, 3), (0, 4, 5, 1))]
    for tip, face in ((8, (1, 5, 7, 3)), (9, (0, 4, 5, 1))):
        dented += [(face[k], face[(k + 1) % 4], tip) for k in range(4)]
    cells = cells_of(Assembly((Block("dent", np.concatenate([vertices, extra]), tuple(dented)),)), [False])
    assert cells.form == ("hull",)
    assert sampled_volume(cells, 0) == pytest.approx(1.0, abs=1e-9)
    assert cells.volume[0] == pytest.approx(1.0 - 0.3 / 3 - 0.3 / 3)


@pytest.mark.parametrize(
    ("made", "within"),
    [
        (polygonal_wall(PatternSettings(coursing=0.5), depth=0.3).assembly, 0.02),
        (polygonal_wall(PatternSettings(coursing=1.0), depth=0.3, batter=0.1).assembly, 0.02),
        (polygonal_wall(PatternSettings(columns=4, rows=3), depth=0.2, surface=Cylinder(4.0, 1.5)).assembly, 0.03),
        (polygonal_wall(PatternSettings(columns=4, rows=3), depth=0.2, surface=Sphere(6.0, 0.0, 1.5)).assembly, 0.03),
        (wall(4, 3), 0.02),
        (arch(7), 0.02),
        (dome(4, 8), 0.05),
    ],
    ids=["flat", "batter", "cylinder", "sphere", "bricks", "arch", "dome"],
)
def test_half_spaces_hold_the_volume_of_the_block(made, within):
    cells = cells_of(made)
    assert "hull" not in cells.form
    for j in range(len(cells)):
        assert sampled_volume(cells, j) == pytest.approx(cells.volume[j], rel=within)
        assert np.linalg.det(cells.frame[j]) == pytest.approx(1.0)
        assert np.linalg.det(cells.axes[j]) == pytest.approx(1.0)
        assert cells.axes[j, 2] == pytest.approx(cells.frame[j, 2])


def test_through_follows_a_curved_wall():
    made = polygonal_wall(PatternSettings(columns=6, rows=3), depth=0.2, surface=Cylinder(4.0, 1.5))
    cells = cells_of(made.assembly)
    level = np.abs(cells.frame[:, 2, 2])
    assert level.max() < 0.02
    u = made.pattern.subdivision.centroids()[:, 0]
    heading = np.unwrap(np.arctan2(cells.frame[:, 2, 1], cells.frame[:, 2, 0])[np.argsort(u)])
    assert abs(heading[-1] - heading[0]) == pytest.approx(np.ptp(u) / 4.0, rel=0.05)


@given(st.integers(0, 10**6), st.tuples(*[st.floats(-1e3, 1e3)] * 3))
@settings(max_examples=examples(100), deadline=None)
def test_cells_do_not_depend_on_where_the_wall_stands(seed, shift):
    """Turned about the vertical and moved: the same half-spaces, turned."""
    angle = float(np.random.Generator(np.random.PCG64(seed)).uniform(0.0, 2.0 * np.pi))
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    vertices, faces = prism([(0, 0), (1.3, 0.1), (1.5, 1.0), (0.7, 0.6), (0.1, 1.2)], 0.0, 0.4)
    here = cells_of(Assembly((Block("a", vertices, faces),)), [False])
    there = cells_of(Assembly((Block("a", vertices @ turn.T + shift, faces),)), [False])
    assert there.part_count.tolist() == here.part_count.tolist()
    points = here.centre[0] + np.random.Generator(np.random.PCG64(seed)).uniform(-1.0, 1.0, (64, 3))
    assert inside(there, 0, points @ turn.T + shift).tolist() == inside(here, 0, points).tolist()


def test_a_model_without_free_blocks_is_refused():
    with pytest.raises(InputError, match="every block of the model is a support"):
        cells_of(model(box((1, 1, 1)), fixed=(0,)))


def test_an_open_block_is_refused_by_name():
    vertices, faces = box((1, 1, 1))
    with pytest.raises(InputError, match="block 'lid': is open"):
        cells_of(Assembly((Block("lid", vertices, faces[1:]),)), [False])
    held = cells_of(Assembly((Block("lid", vertices, faces[1:]), Block("b", vertices, faces))), [True, False])
    assert held.block.tolist() == [1]  # a support is no cell, whatever it is made of


def test_rotation_helper_is_one():
    assert np.linalg.det(rotation(3)) == pytest.approx(1.0)


def test_the_cells_of_a_corner_know_the_way_through_their_wall() -> None:
    made = corner_wall(PatternSettings(width=2.0, height=1.0, columns=3, rows=2, courses=2), 1.5, depth=0.3)
    cells = cells_of(made.assembly)
    ids = [made.assembly.blocks[b].id for b in cells.block]
    through = np.abs(cells.frame[:, 2])
    assert np.isfinite(through).all()
    for name, way in zip(ids, through, strict=True):
        wanted = {"w1": [0.0, 1.0, 0.0], "w2": [1.0, 0.0, 0.0]}.get(name.split("-")[0])
        assert wanted is None or way.tolist() == pytest.approx(wanted, abs=1e-9), name
