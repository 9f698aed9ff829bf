"""What is drawn: rigid motion, resultants, colours, edges and the elevation, against hand calculations."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Result
from cyclopean.assembly import Assembly, Contacts
from cyclopean.geometry import mass_properties, mesh_faults, pack, rotations
from cyclopean.view import elevation
from cyclopean.view.colours import ACCENT, SCALE, classes, rgb, shaded, stone
from cyclopean.view.drawing import displaced, feature_edges, outlines, picture, without_points
from cyclopean.view.elevation import elevation_svg
from cyclopean.view.figures import (
    block_utilisation,
    cases,
    fastest,
    needed_tension,
    number,
    pressing,
    resultants,
    worst,
)
from cyclopean.view.motion import drawn_motion, moved
from cyclopean.view.svg import View, front_view, project
from laws import examples
from test_view_report import BOX, TREE, arch, collapsing_stack, hexahedron, sinking, square

CUBE = np.concatenate([square(0, 0), square(0, 1)])


def luminance(colour):
    part = np.array(rgb(colour)) / 255
    light = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return float(light @ [0.2126, 0.7152, 0.0722])


def result_of(assembly, contacts, **more):
    fixed = np.zeros(len(assembly), bool)
    return Result(assembly, contacts, fixed, "rbe", "stable", "", {}, np.array([0, 0, -9.81]), {}, **more)


def test_a_quarter_turn_by_hand():
    """The corner (1, 0, 0) of the unit cube, turned 90 degrees about z through the centroid (0.5, 0.5, 0.5), goes to
    (1, 1, 0); shifted by (0, 0, 2) on top it goes to (1, 1, 2)."""
    mechanism = np.array([[0, 0, 2.0, 0, 0, np.pi / 2]])
    there = moved(CUBE, np.zeros(8, int), np.full((1, 3), 0.5), mechanism, 1.0)
    np.testing.assert_allclose(there[1], [1, 1, 2], atol=1e-15)
    lengths = np.linalg.norm(there[:, None] - there[None], axis=2)
    np.testing.assert_allclose(lengths, np.linalg.norm(CUBE[:, None] - CUBE[None], axis=2), atol=1e-14)


vectors = st.lists(st.floats(-4, 4), min_size=3, max_size=3).map(np.array)


@given(turn=vectors, shift=vectors)
def test_motion_is_rigid(turn, shift):
    matrix = rotations(turn[None])[0]
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-13)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    np.testing.assert_allclose(matrix @ turn, turn, atol=1e-13)
    there = moved(CUBE, np.zeros(8, int), np.full((1, 3), 0.5), np.concatenate([shift, turn])[None], 0.7)
    lengths = np.linalg.norm(there[:, None] - there[None], axis=2)
    np.testing.assert_allclose(lengths, np.linalg.norm(CUBE[:, None] - CUBE[None], axis=2), atol=1e-13)


@given(v=vectors, w=vectors, scale=st.floats(1e-3, 1e3))
def test_the_largest_movement_is_as_wished(v, w, scale):
    """Unless a block would have to spin by more than 0.8 rad for it."""
    mechanism = scale * np.concatenate([v, w])[None]
    motion = drawn_motion(CUBE, np.zeros(8, int), np.full((1, 3), 0.5), mechanism, 0.25)
    if np.abs(mechanism).max() < 1e-6:
        return
    assert motion.turn[0] <= 0.8 + 1e-9
    assert motion.travel[0] == pytest.approx(0.25, rel=0.01) or motion.turn[0] == pytest.approx(0.8)


def test_a_mechanism_is_drawn_a_quarter_of_a_block_large_with_its_ghost():
    result = collapsing_stack()
    drawn = picture(result)
    assert drawn.quantity == "movement"
    assert drawn.motion is not None
    assert drawn.motion.travel.max() == pytest.approx(0.25, rel=0.01)
    assert drawn.motion.travel[0] == 0.0
    assert fastest(drawn.motion, 9).tolist() == [3, 2, 1]
    np.testing.assert_array_equal(drawn.ghost, feature_edges(result.assembly.mesh))
    assert drawn.group[0] == -2
    assert drawn.group[3] == 9
    # overturning goes down and to the right: the mechanism's own sense, not its opposite
    top = drawn.mesh.vertex[-8:].mean(axis=0) - result.assembly.mass.centroid[3]
    assert top[0] > 0 > np.dot(top, -result.gravity)


def pressed(force, low=0.0):
    """Two cubes, one on the other, with the given point forces (fn, fu, fv) in a frame of n = z, u = x, v = y."""
    level = [square(0, low + k) for k in range(3)]
    blocks = (hexahedron("low", *level[:2]), hexahedron("up", *level[1:]))
    contacts = Contacts.of([(0, 1)], [square(0, low + 1)], [0.5])
    frame = np.array([[[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]])
    return result_of(Assembly(blocks), contacts, force=np.array(force, float), frame=frame, utilisation=np.array([0.4]))


@pytest.mark.parametrize("low", [0.0, 1e7])
def test_resultant_and_centre_of_pressure_by_hand(low):
    """3, 1, 0, 0 N at the corners (0,0), (1,0), (1,1), (0,1) give 4 N at (0.25, 0); friction (3, 4) gives 5 N."""
    found = resultants(pressed([[3, 3, 0], [1, 0, 4], [0, 0, 0], [0, 0, 0]], low))
    assert found is not None
    assert (found.normal[0], found.friction[0]) == (4.0, 5.0)
    np.testing.assert_allclose(found.force[0], [3, 4, 4])
    np.testing.assert_allclose(found.centre[0], [0.25, 0, low + 1], rtol=1e-15)


def test_arrow_goes_the_way_of_the_load_through_the_centre_of_pressure():
    drawn = picture(pressed([[3, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, 0]]))
    tail, tip = drawn.arrow[0]
    np.testing.assert_allclose((tail + tip) / 2, [0.25, 0, 1])
    np.testing.assert_allclose(tip - tail, [0, 0, -0.9])  # the block above is pushed up, the one below down
    assert drawn.largest == pytest.approx(4.0)


def test_worst_contacts_and_blocks_come_first():
    result = arch()
    assert worst(result, 3).tolist() == [11, 10, 9]
    share = block_utilisation(result)
    assert share[12] == share[11] == result.utilisation[11]
    assert share[0] == result.utilisation[0]


def test_unloaded_patches_are_not_listed():
    result = arch()
    force = result.force.copy()
    force[44:] = 0.0
    assert worst(replace(result, force=force), 2).tolist() == [10, 9]


def test_elevation_of_a_cube_by_hand():
    """A cube of 2 m with its corner at (10, 20, 30): 1000 x 640 units less margins of 40 left and top, 104 right and 84
    below leave 856 x 516, so 258 units a metre. The front face spans x 40..556 and y 40..556 (y runs down)."""
    cube = Assembly((hexahedron("c", 2 * square(0, 0) + [10, 20, 30], 2 * square(0, 0) + [10, 20, 32]),))
    vertex = cube.mesh.vertex
    np.testing.assert_allclose(np.ptp(vertex, axis=0), 2.0)
    drawn = picture(result_of(cube, Contacts.of([], [])))
    svg = elevation_svg(drawn, "c")
    (outline,) = re.findall(r'<path d="M([^"]*)Z" fill="#', svg)[:1]
    corners = {tuple(map(float, pair.split())) for pair in outline.split("L")}
    assert corners == {(40.0, 40.0), (556.0, 40.0), (556.0, 556.0), (40.0, 556.0)}
    assert len(re.findall(r'Z" fill="#[0-9a-f]{6}"/>', svg)) == 2  # one face of six looks at the viewer; gravity's head
    assert "200 mm" in svg  # 1, 2 or 5 times a power of ten below 0.22 * 580 / 258 m


def test_projection_by_hand():
    """A wall along (3, 4) / 5 is seen square on: 53.13 degrees, rounded to a degree."""
    along, across = np.array([0.6, 0.8, 0.0]), np.array([-0.8, 0.6, 0.0])
    wall = np.array([a * along + b * across for a in (0, 10.0) for b in (0, 0.2)])
    view = front_view(wall)
    assert abs(view.right @ along) == pytest.approx(1.0, abs=1e-4)
    flat, depth = project(np.array([[0.0, 0.0, 7.0]]) + view.right * 2 + view.into * 5, view)
    np.testing.assert_allclose(flat[0], [2, 7], atol=1e-14)
    assert depth[0] == pytest.approx(5)
    assert np.cross(view.right, [0, 0, 1.0]) @ view.into == pytest.approx(-1.0)  # right, up, towards the viewer


def test_what_is_nearer_is_painted_later():
    """Of two cubes one behind the other, the support in front (smaller y) covers the other: it comes last."""
    row = {"near": np.zeros(3), "far": np.array([0, 5, 0])}
    cubes = tuple(hexahedron(name, square(0, 0) + shift, square(0, 1) + shift) for name, shift in row.items())
    result = replace(result_of(Assembly(cubes), Contacts.of([], [])), fixed=np.array([True, False]))
    view = View(np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(elevation, "front_view", lambda _: view)
        svg = elevation_svg(picture(result), "two")
    assert svg.index("url(#hatch)") > svg.index(shaded(stone(1), 1.0))


def test_supports_are_hatched_and_names_escaped_in_the_elevation():
    svg = elevation_svg(picture(arch()), "<b>&")
    assert svg.count("url(#hatch)") >= 2
    assert "<title>&lt;b&gt;&amp;</title>" in svg
    assert "nan" not in svg


def test_edges_of_a_cube_are_twelve_however_its_faces_are_cut():
    quads = pack([(CUBE, BOX)])
    triangles = pack([(CUBE, [t for a, b, c, d in BOX for t in ((a, b, c), (a, c, d))])])
    assert len(feature_edges(quads)) == len(feature_edges(triangles)) == 12
    assert np.linalg.norm(np.diff(feature_edges(triangles), axis=1), axis=2).max() == pytest.approx(1.0)


def test_outlines_are_closed_outward_and_hold_most_of_the_volume():
    n = 40
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi, n)[1:-1], np.linspace(0, 2 * np.pi, n, endpoint=False), indexing="ij"
    )
    ball = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    from scipy.spatial import ConvexHull

    hull = ConvexHull(ball)
    out = np.linalg.det(ball[hull.simplices]) > 0
    faces = np.where(out[:, None], hull.simplices, hull.simplices[:, ::-1]).tolist()
    whole = pack([(ball, faces), (CUBE, BOX)])
    assert outlines(whole, 10_000) is whole
    rough = outlines(whole, 100)
    assert not mesh_faults(rough)
    assert rough.face_start[1] <= 124
    assert mass_properties(rough).volume[0] == pytest.approx(4 / 3 * np.pi, rel=0.15)
    assert mass_properties(rough).volume[1] == pytest.approx(1.0)


def test_the_scale_gets_steadily_darker_and_accents_can_be_read_on_white():
    light = [luminance(colour) for colour in SCALE]
    assert all(a > b for a, b in pairwise(light))
    for colour in ACCENT.values():
        assert 1.05 / (luminance(colour) + 0.05) >= 4.5


def test_classes_by_hand():
    found = classes(np.array([0.0, 0.3, 1.0, 5.0, np.nan, 0.2]), np.array([False] * 5 + [True]))
    assert found.tolist() == [0, 3, 9, 9, -1, -2]


@settings(max_examples=examples(200))
@given(st.floats(allow_nan=True, allow_infinity=True))
def test_numbers_are_written_and_mean_what_they_say(value):
    text = number(value, 4)
    assert not re.search("nan|inf", text, re.I)
    if np.isfinite(value) and 1e-3 <= abs(value) < 1e5:
        assert float(text.replace(",", "").replace("−", "-")) == pytest.approx(value, rel=1e-3)


def test_points_that_press_and_friction_on_the_upper_block_by_hand():
    """Three of four corners press. Friction on b, the upper cube, is -1 kN along u = x; seen upside down it is the
    lower cube, so friction on the upper one is +1 kN."""
    found = pressing(sinking())
    assert found is not None
    np.testing.assert_array_equal(found.point, square(0, 1)[[0, 1, 3]])
    np.testing.assert_allclose(found.friction, [[-1000, 0, 0]] * 3)
    assert sorted(found.rubbing.tolist()) == [0, 1, 2]
    upended = pressing(replace(sinking(), gravity=np.array([0, 0, 9.8])))
    assert upended is not None
    np.testing.assert_allclose(upended.friction, [[1000, 0, 0]] * 3)
    assert pressing(arch()) is None  # forces alone do not say what presses


def test_a_coupled_state_is_drawn_where_it_stands_and_displaced_beside():
    """The largest movement is a quarter of a block of 1 m, along (3, 0, -1); friction is drawn half a block long."""
    drawn = picture(sinking())
    assert drawn.quantity == "utilisation"
    assert (len(drawn.press), len(drawn.arrow), drawn.rubbing) == (3, 1, pytest.approx(1000.0))
    np.testing.assert_allclose(np.diff(drawn.rub, axis=1)[:, 0], [[-0.5, 0, 0]] * 3)
    there = displaced(drawn)
    assert there is not None
    np.testing.assert_allclose(there.mesh.vertex[8:] - drawn.mesh.vertex[8:],
                               np.tile(0.25 * np.array([3, 0, -1]) / 10**0.5, (8, 1)), atol=1e-12)  # fmt: skip
    np.testing.assert_array_equal(there.mesh.vertex[:8], drawn.mesh.vertex[:8])
    np.testing.assert_array_equal(there.ghost, drawn.edge)
    assert displaced(picture(arch())) is None
    flat = elevation_svg(without_points(drawn), "forces")
    assert "<circle" not in flat
    assert "<animate" not in flat
    moving = elevation_svg(there, "displaced")
    assert moving.count("<circle") == 2  # of three points, two lie behind each other
    assert moving.count("<animate") == 1  # the front face of the upper cube; supports stay
    assert 'id="moving"' in moving
    assert 'begin="moving.click"' in moving


def test_a_mechanism_moves_at_a_click_too_unless_it_is_large():
    drawn = picture(collapsing_stack())
    assert elevation_svg(drawn, "falls").count("<animate") >= 3
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(elevation, "ANIMATED_FACES", 5)
        assert "<animate" not in elevation_svg(drawn, "falls")


def test_the_ways_in_which_cases_are_closed_are_counted():
    assert cases(TREE) == {"forces": 2, "motion": 2, "work": 1, "depth": 3}
    deep = {"forces": []}
    for _ in range(5000):  # deeper than the interpreter's stack
        deep = {"point": 0, "engaged": deep, "unloaded": {"mechanism": {}}}
    assert cases(deep) == {"forces": 5000, "motion": 1, "work": 0, "depth": 5000}


def test_glue_by_hand():
    """1.5 and 0.5 kN at two contacts of three cubes, 2400 kg each at 9.81275 m/s2: 2 / 70.65 of the weight."""
    pull = np.zeros(12)
    pull[[2, 7]] = [1500.0, 500.0]
    pull[5] = 0.7  # a trace: tension is dear, not forbidden
    found = needed_tension(replace(collapsing_stack(), tension=pull))
    assert found is not None
    assert found.pull.tolist() == [1500.0, 500.0, 0.0]
    assert found.patches.tolist() == [0, 1]
    assert found.point.tolist() == [2, 7]
    assert found.share == pytest.approx(2000 / (3 * 2400 * np.hypot(0.5, 9.8)))
    drawn = picture(replace(collapsing_stack(), tension=pull))
    assert drawn.pull_share.tolist() == [1.0, pytest.approx(1 / 3)]
    assert elevation_svg(drawn, "glue").count("<circle") == 2
    assert needed_tension(collapsing_stack()) is None
