"""Stones set down on exact meshes, by hand and by laws.

By hand: a box of 2 x 1 x 1 lowered on a table stands on its four corners, its centre of mass 0.5 inside; with 0.9 of
its length out over an edge it stands with a margin of 0.1, with 1.1 it tips, margin negative. A ball of radius 1 in the
valley of two more, 1.2 apart between axes, rests at sqrt(4 - 0.36) above them, and needs a third to stand.
A tetrahedron stands on its base with the radius of the inscribed circle, 1 / sqrt(12) of its edge, as margin.
Mutants killed: contacts of edges left out; vertices of the other stone left out; faces reaching beyond their valleys;
the turn of a step not kept; the heading left out of the frame; lengths not in units of the stone; no look at solids at
the end; margin without its sign; the moment of a contact reversed; grip without effect; ceilings that bear.
Survives: a sunk vertex held by all faces of a body and not by the nearest; outward directions already sort those out.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from cyclopean.design.rubble import seating
from cyclopean.design.rubble.features import body_of
from cyclopean.design.rubble.seating import heyman_margin, overlap_share, seat
from cyclopean.design.stones.quarry import quarry
from cyclopean.design.stones.stone import in_body_frame
from cyclopean.errors import InputError
from fixtures_stones import box, rotation, sphere, subdivided
from laws import examples

EYE = np.eye(3)
SEEDS = st.integers(0, 2**32 - 1)
FINE = 2e-4  # of a stone's size: what it may float above, or stand off from, what is told by hand


def turned(x, y, z):
    return Rotation.from_rotvec([x, y, z]).as_matrix()


def tetrahedron():
    corner = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0], [0.5, np.sqrt(1 / 12), np.sqrt(2 / 3)]])
    return corner, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])


def balanced(found, centre, grip):
    """Force and moment that the contacts leave over, in weights and metres; sideways `grip` may hold."""
    push = found.forces[:, None] * found.normals
    force = push.sum(axis=0) - [0.0, 0.0, 1.0]
    moment = np.cross(found.contacts - centre, push).sum(axis=0)
    return np.abs(force[:2]).max() <= 1.01 * grip + 1e-6 and abs(force[2]) < 1e-3, moment


@pytest.mark.parametrize("spin", [(0, 0, 0), (0.05, 0.03, 0.2), (-0.1, 0.08, 2.0)])
def test_a_box_lowered_on_a_table(spin):
    stone = body_of(*box(2.0, 1.0, 1.0))
    found = seat(stone, turned(*spin), [5.0, 0.0, 0.3])
    assert found.margin == pytest.approx(0.5, abs=FINE)
    assert not found.slid
    assert (stone.moved(found.rotation, found.shift).low[2]) == pytest.approx(0.0, abs=FINE)
    assert len(found.contacts) == 4
    assert found.bodies.tolist() == [-1] * 4
    assert found.normals == pytest.approx(np.tile([0.0, 0, 1], (4, 1)))
    assert np.count_nonzero(found.forces) <= 6
    assert found.forces.sum() == pytest.approx(1.0, abs=5e-3)
    assert found.rotation @ found.rotation.T == pytest.approx(EYE, abs=1e-9)


@pytest.mark.parametrize(("out", "margin"), [(0.5, 0.5), (0.9, 0.1), (1.1, None)])
def test_a_box_over_the_edge_of_a_step(out, margin):
    stone, step = body_of(*box(2.0, 1.0, 1.0)), body_of(*box(4.0, 3.0, 1.0))
    found = seat(stone, EYE, [2.0 + out, 1.0, 1.02], [step], None)
    if margin is None:
        assert found.slid
        assert found.margin < 0.0
    else:
        assert not found.slid
        assert found.margin == pytest.approx(margin, abs=FINE)
        assert found.bodies.tolist() == [0] * 4  # two corners on it, and two where edges cross


def test_a_cross_of_two_prisms_touches_where_their_edges_cross():
    prism = np.array([[x, y, z] for x in (-2.0, 2.0) for y, z in ((-1.0, 0.0), (1.0, 0.0), (0.0, 1.0))])
    faces = np.array([(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)])
    lower = body_of(prism, faces)
    upper = body_of((prism * [1.0, 1.0, -1.0] + [0.0, 0.0, 1.0])[:, [1, 0, 2]], faces)  # its edge down, across
    found = seat(upper, EYE, [0.0, 0.0, 1.02], [lower], None, turn=1e-3)
    assert found.shift[2] == pytest.approx(1.0, abs=2e-3)
    assert found.bodies.tolist() == [0]
    assert found.contacts[0] == pytest.approx([0.0, 0.0, 1.0], abs=3e-3)
    assert found.normals[0] == pytest.approx([0.0, 0.0, 1.0], abs=3e-3)


def test_a_spike_under_a_plate_is_found_by_its_own_vertex():
    plate, spike = body_of(*box(1.0, 1.0, 0.2)), body_of(*tetrahedron())
    found = seat(plate, EYE, [0.0, -0.2, 0.86], [spike], None, turn=1e-3)
    tip = tetrahedron()[0][3]
    assert found.contacts[0] == pytest.approx(tip, abs=2e-3)
    assert found.normals[0] == pytest.approx([0, 0, 1], abs=2e-3)


@pytest.mark.parametrize("start", [(0.05, 0.0), (-0.03, 0.04)])
def test_a_ball_in_a_valley(start):
    ball = body_of(*sphere(3))
    far = 1.2
    around = [ball.moved(EYE, [far * np.cos(a), far * np.sin(a), 0.0]) for a in 2.0 * np.pi * np.arange(3) / 3.0]
    found = seat(ball, rotation(1), [*start, 1.7], around, None, grip=1e-3)
    assert found.shift == pytest.approx([0.0, 0.0, np.sqrt(4.0 - far**2)], abs=0.03)  # the ball has facets
    assert set(found.bodies.tolist()) == {0, 1, 2}
    assert found.margin > 0.2
    assert found.forces @ found.normals[:, 2] == pytest.approx(1.0, abs=1e-3)
    pair = seat(ball, rotation(1), [*start, 1.7], around[:2], None, grip=1e-3)
    assert pair.slid
    assert pair.margin < 0.0


def test_a_tetrahedron_on_its_base():
    found = seat(body_of(*tetrahedron()), turned(0.1, 0.1, 0.5), [0.0, 0.0, 0.12])
    assert found.margin == pytest.approx(1.0 / np.sqrt(12.0), abs=FINE)
    assert len(found.contacts) == 3
    assert found.forces == pytest.approx([1 / 3] * 3, abs=2e-3)


def test_the_centre_of_mass_is_not_the_mean_of_the_vertices():
    corner, face = box(2.0, 1.0, 1.0)
    fine, faces = subdivided(corner, face)
    for _ in range(2):  # many vertices at one end
        fine, faces = subdivided(fine, faces)
    found = seat(body_of(fine, faces), EYE, [0.0, 0.0, 0.01])
    assert found.margin == pytest.approx(0.5, abs=FINE)


def test_a_stone_that_starts_inside_another_comes_out():
    stone, step = body_of(*box()), body_of(*box(3.0, 3.0, 1.0))
    found = seat(stone, EYE, [1.0, 1.0, 0.99], [step], None)
    assert found.shift[2] == pytest.approx(1.0, abs=FINE)
    assert found.overlap <= 1e-9
    deep = seat(stone, EYE, [1.0, 1.0, 0.6], [step], None)
    assert deep.overlap <= 1e-9
    assert overlap_share(stone.moved(deep.rotation, deep.shift), [step]) <= 1e-9


def test_a_corner_sunk_near_an_edge_leaves_by_the_nearest_face():
    stone, left, right = (body_of(*box(1.0, 1.0, 1.0, at=(x, 0.0, 0.0))) for x in (0.0, -0.95, 0.95))
    found = seat(stone, EYE, [0.0, 0.0, 0.99], [left, right], None)  # 5 cm over either, and sunk 1 cm
    assert found.shift == pytest.approx([0.0, 0.0, 1.0], abs=2e-3)
    assert found.margin == pytest.approx(0.5, abs=2e-3)


def test_grip_holds_on_a_slope():
    lean = turned(0.0, np.arctan(0.3), 0.0)
    slope, stone = body_of(*box(6.0, 3.0, 1.0)).moved(lean, [0.0, 0.0, 0.0]), body_of(*box(1.0, 1.0, 0.3))
    place = lean @ [2.0, 1.0, 1.01]
    held, loose = (seat(stone, lean, place, [slope], None, grip=grip) for grip in (0.5, 0.1))
    assert not held.slid
    assert held.shift == pytest.approx(place, abs=0.02)
    assert held.margin > 0.2
    assert loose.slid
    assert loose.shift[2] < held.shift[2] - 0.01


def pile(seed, convex=False):
    """Two stones of a quarry on the ground, a third dropped between them."""
    stones = []
    for s in quarry(3, seed=seed, detail=2):
        vertices, triangles = in_body_frame(s), s.triangles
        if convex:
            hull = ConvexHull(vertices)
            vertices, triangles = vertices[hull.vertices], outward(vertices[hull.vertices])
        stones.append(body_of(vertices, triangles))
    lying = []
    for k in range(2):
        x = -0.3 if k == 0 else 0.3 + stones[1].high[0] / 3
        found = seat(stones[k], EYE, [x, 0.0, 0.01 - stones[k].low[2]], lying)
        lying.append(stones[k].moved(found.rotation, found.shift))
    height = 1.2
    while not overlap_share(stones[2].moved(EYE, [0.0, 0.0, height - 0.02]), lying):
        height -= 0.02
    return stones[2], lying, height


def outward(points):
    hull = ConvexHull(points)
    corner = points[hull.simplices]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    wrong = np.einsum("ki,ki->k", normal, hull.equations[:, :3]) < 0
    faces = hull.simplices.astype(np.int64)
    faces[wrong] = faces[wrong][:, ::-1]
    return faces


@settings(max_examples=examples(4), deadline=None)
@given(seed=st.integers(0, 400), lifted=st.floats(0.0, 0.3), scale=st.sampled_from([0.05, 1.0]))
def test_what_is_gathered_as_a_stone_goes_is_what_all_around_it_tells(seed, lifted, scale):
    stone, lying, height = pile(seed)
    stone, *lying = (body_of(scale * one.vertices, one.triangles) for one in (stone, *lying))
    start = [0.0, 0.0, scale * (height + lifted)]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(seating, "SPARE", 10.0)
        slow = seat(stone, EYE, start, lying)
    fast = seat(stone, EYE, start, lying)
    assert fast.steps == slow.steps
    assert fast.shift == pytest.approx(slow.shift, abs=1e-9 * scale)
    assert fast.bodies.tolist() == slow.bodies.tolist()


@settings(max_examples=examples(6), deadline=None)
@given(seed=st.integers(0, 400), convex=st.booleans())
def test_no_two_stones_share_a_volume_and_a_rest_is_in_balance(seed, convex):
    stone, lying, height = pile(seed, convex)
    found = seat(stone, EYE, [0.0, 0.0, height], lying)
    settled = stone.moved(found.rotation, found.shift)
    assert overlap_share(settled, lying) <= 1e-6
    assert settled.low[2] >= 0.0
    assert settled.centroid[2] <= height + 1e-3
    bearing = found.normals[:, 2] >= 0.25
    assert found.margin == heyman_margin(found.contacts[bearing], settled.centroid)
    upright, _ = balanced(found, settled.centroid, 0.5)
    assert found.slid or upright
    free = seat(stone, EYE, [0.0, 0.0, height], lying, grip=1e-3, travel=0.4)
    if not free.slid:
        centre = stone.moved(free.rotation, free.shift).centroid
        upright, moment = balanced(free, centre, 1e-3)
        assert upright
        assert np.abs(moment).max() < 3e-3 * np.cbrt(stone.volume)
        assert free.margin > -1e-3 * np.cbrt(stone.volume)


@settings(max_examples=examples(4), deadline=None)
@given(seed=st.integers(0, 400), yaw=st.floats(0.1, 6.0), scale=st.sampled_from([0.01, 1000.0]))
def test_nothing_depends_on_where_it_is_or_in_which_unit(seed, yaw, scale):
    stone, lying, height = pile(seed)
    found = seat(stone, EYE, [0.0, 0.0, height], lying)
    turn, away = turned(0.0, 0.0, yaw), np.array([7.0, -3.0, 0.0])
    moved = seat(stone, turn, turn @ [0.0, 0.0, height] + away, [b.moved(turn, away) for b in lying])
    assert moved.margin == pytest.approx(found.margin, abs=2e-4)
    assert moved.shift == pytest.approx(turn @ found.shift + away, abs=2e-4)
    larger = [body_of(scale * b.vertices, b.triangles) for b in (stone, *lying)]
    grown = seat(larger[0], EYE, [0.0, 0.0, scale * height], larger[1:])
    assert grown.margin / scale == pytest.approx(found.margin, abs=2e-4)
    assert grown.shift / scale == pytest.approx(found.shift, abs=2e-4)


@settings(max_examples=examples(60), deadline=None)
@given(seed=SEEDS, count=st.integers(3, 12))
def test_the_margin_by_half_planes_of_another_hull(seed, count):
    draw = np.random.default_rng(seed)
    point, centre = draw.normal(size=(count, 3)), draw.normal(size=3) * 0.7
    hull = ConvexHull(point[:, :2])
    inside = -(hull.equations[:, :2] @ centre[:2] + hull.equations[:, 2]).max()
    margin = heyman_margin(point, centre)
    assert (margin > 0.0) == (inside > 0.0)
    if inside > 0.0:
        assert margin == pytest.approx(inside)
    else:
        assert margin <= inside + 1e-12


def test_the_margin_of_few_contacts():
    assert heyman_margin(np.zeros((0, 3)), [0, 0, 0]) == -np.inf
    assert heyman_margin([[3.0, 4.0, 9.0]], [0, 0, 0]) == -5.0
    assert heyman_margin([[-1.0, 0, 0], [1.0, 0, 0]], [0.0, 0.0, 5.0]) <= 0.0
    assert heyman_margin([[0, 0, 0], [1, 1, 0], [2, 2, 0], [3, 3, 5]], [2.0, 0.0, 0.0]) == pytest.approx(-np.sqrt(2.0))


def test_refusals():
    stone = body_of(*box())
    for options, said in (
        ({"travel": 0.0}, "travel"),
        ({"travel": np.nan}, "travel"),
        ({"turn": 2.0}, "turn"),
        ({"grip": 0.0}, "grip"),
    ):
        with pytest.raises(InputError, match=said):
            seat(stone, EYE, [0, 0, 0], **options)
    with pytest.raises(InputError, match="rotation: is not a rotation matrix"):
        seat(stone, 2.0 * EYE, [0, 0, 0])
    with pytest.raises(InputError, match="rotation: is not a rotation matrix"):
        seat(stone, np.diag([1.0, 1.0, -1.0]), [0, 0, 0])
    with pytest.raises(InputError, match=r"shift\[1\]: nan"):
        seat(stone, EYE, [0, np.nan, 0])
    vertices, triangles = box()
    with pytest.raises(InputError, match="stone 'a': is open"):
        body_of(vertices, triangles[1:], "stone 'a'")
    with pytest.raises(InputError, match="stone: is inside out"):
        body_of(vertices, triangles[:, ::-1])


def test_a_stone_with_nothing_below_falls():
    found = seat(body_of(*box()), EYE, [0.0, 0.0, 5.0], (), None)
    assert found.slid
    assert found.margin == -np.inf
    assert len(found.contacts) == len(found.forces) == len(found.bodies) == 0
