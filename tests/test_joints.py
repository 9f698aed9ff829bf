"""Joints of drawn walls: by hand, against detection, bit for bit on both stones, and what is refused.

By hand: two unit squares side by side, 0.5 m deep, have one head joint and two beds on the ground, each 1 x 0.5 m.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly, detect
from cyclopean.assembly.checking import check_contacts
from cyclopean.design.walls.dressing import Coping, Quoins
from cyclopean.design.walls.joints import Masonry, base_edges, jointed, stone_ids, with_open_joints
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import Pattern, PatternSettings, Readout
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cone, Cylinder, Free, HeightGrid, Plane, Sphere, Thickness
from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults, subdivide
from laws import examples

DOOR = (Opening(1.1, 0.7, 1.1),)
ARCH = (Opening(1.1, 0.7, 1.2, 0.0, "arch"),)
CURVED = {
    "cylinder": (Cylinder(4.0, 1.5), {}),
    "hollow": (Cylinder(-4.0, 1.5), {"openings": DOOR}),
    "cone": (Cone(4.0, 8.0, 1.5), {"coursing": 1.0}),
    "sphere": (Sphere(6.0, 0.0, 1.5), {"openings": ARCH}),
    "wavy": (Free(lambda u, v: (u, 0.1 * np.sin(2 * u + v), v), 3.0, 1.8), {"base_radius": 8.0}),
    "rough": (HeightGrid(0.1 * np.random.default_rng(0).random((4, 5)), 3.0, 1.8), {"quoins": Quoins()}),
}


def pattern_of(vertex, rings) -> Pattern:
    cells = subdivide(vertex, rings)
    n = len(cells)
    readout = Readout(n, 1.0, 0.0, 0, 0, 0)
    return Pattern(
        cells, ("stone",) * n, np.zeros(n, int), np.array([0.0, 1.0]), (), None, readout, PatternSettings(width=2.0)
    )


def two_squares() -> Pattern:
    return pattern_of([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], [[0, 1, 4, 3], [1, 2, 5, 4]])


def by_pair(contacts) -> dict:
    found: dict = {}
    for a, b, area in zip(contacts.a.tolist(), contacts.b.tolist(), contacts.area.tolist(), strict=True):
        found[min(a, b), max(a, b)] = found.get((min(a, b), max(a, b)), 0.0) + area
    return found


def test_two_squares_by_hand() -> None:
    model, readout = jointed(two_squares(), Plane(), Thickness(0.5), Masonry(2000.0, 0.6))
    assert [b.id for b in model.blocks] == ["ground", "c01-b01", "c01-b02"]
    assert [b.fixed for b in model.blocks] == [True, False, False]
    assert [b.group for b in model.blocks] == ["ground", "course-1", "course-1"]
    assert by_pair(model.contacts) == pytest.approx({(0, 1): 0.5, (0, 2): 0.5, (1, 2): 0.5})
    assert np.round(model.contacts.frame[:, 0], 12).tolist() == [[0, 0, 1], [0, 0, 1], [1, 0, 0]]
    assert model.contacts.polygon(2)[0].tolist() in ([1, 0, 0], [1, 0, 1], [1, 0.5, 0], [1, 0.5, 1])
    assert model.contacts.mu.tolist() == [0.6] * 3
    assert model.mass.volume[1:] == pytest.approx([0.5, 0.5])
    assert (readout.joints, readout.warped, readout.short) == (3, 0, 0)


def test_names_count_from_the_left_in_each_course() -> None:
    pattern = draw = polygonal_wall(PatternSettings(coursing=1.0)).pattern
    ids, u = stone_ids(pattern), draw.subdivision.centroids()[:, 0]
    assert len(set(ids)) == len(ids)
    for course in range(5):
        row = sorted((u[k], ids[k]) for k in np.flatnonzero(pattern.course == course))
        assert [name for _, name in row] == [f"c{course + 1:02d}-b{k:02d}" for k in range(1, len(row) + 1)]


@given(
    seed=st.integers(0, 10_000),
    coursing=st.sampled_from([0.0, 0.25, 0.4, 0.75, 1.0]),
    opening=st.sampled_from([(), DOOR, ARCH]),
    coping=st.sampled_from([None, Coping()]),
    quoins=st.sampled_from([None, Quoins()]),
    batter=st.sampled_from([0.0, 0.05]),
)
@settings(max_examples=examples(25), deadline=None)
def test_on_flat_walls_joints_are_what_detection_finds(seed, coursing, opening, coping, quoins, batter) -> None:
    drawn = PatternSettings(
        columns=5, rows=4, courses=4, seed=seed, coursing=coursing, openings=opening, coping=coping, quoins=quoins
    )
    made = polygonal_wall(drawn, batter=batter)
    model, detected = made.assembly, detect(Assembly(made.assembly.blocks)).contacts
    ours, theirs = by_pair(model.contacts), by_pair(detected)
    assert ours.keys() == theirs.keys()
    assert max(abs(ours[k] - theirs[k]) for k in ours) < 1e-9
    assert mesh_faults(model.mesh) == []
    _, distance, warnings = check_contacts(model, model.contacts)
    assert (distance < 1e-6, warnings) == (True, ())  # sides that are flat to 1e-7 are taken for one face
    area = made.pattern.subdivision.areas()
    height = made.pattern.subdivision.centroids()[:, 1]
    assert model.mass.volume[1:] == pytest.approx(area * (0.2 - batter * height), rel=1e-9)


def corners(block, face) -> frozenset:
    return frozenset(tuple(block.vertices[k].tolist()) for k in face)


@pytest.mark.parametrize("name", CURVED)
def test_on_curved_walls_every_joint_is_a_face_of_both_stones_to_the_bit(name) -> None:
    surface, options = CURVED[name]
    made = polygonal_wall(PatternSettings(**options), surface=surface, warped="triangles")
    model = made.assembly
    assert mesh_faults(model.mesh) == []
    faces = [{corners(block, face) for face in block.faces} for block in model.blocks]
    for k in range(len(model.contacts)):
        patch = frozenset(map(tuple, model.contacts.polygon(k).tolist()))
        assert patch in faces[model.contacts.a[k]]
        assert patch in faces[model.contacts.b[k]]
    _, distance, warnings = check_contacts(model, model.contacts)
    assert (distance < 1e-6, warnings) == (True, ())
    detected = by_pair(detect(Assembly(model.blocks)).contacts)
    assert detected.keys() == by_pair(model.contacts).keys()
    assert made.joints.folded == made.joints.warped
    assert len(model.contacts) == made.joints.joints + made.joints.folded
    assert (made.joints.warped > 0) == (name != "sphere")  # all normals of a sphere meet: any two lie in a plane


def test_a_fold_runs_along_the_shorter_diagonal() -> None:
    made = polygonal_wall(surface=CURVED["wavy"][0], warped="triangles")
    contacts = made.assembly.contacts
    sizes = np.diff(contacts.start)
    folds = 0
    for k in np.flatnonzero((sizes[:-1] == 3) & (sizes[1:] == 3)):
        one, two = (set(map(tuple, contacts.polygon(i).tolist())) for i in (k, k + 1))
        if (contacts.a[k], contacts.b[k]) == (contacts.a[k + 1], contacts.b[k + 1]) and len(one & two) == 2:
            fold, across = np.array(list(one & two)), np.array(list(one ^ two))
            assert np.linalg.norm(fold[0] - fold[1]) <= np.linalg.norm(across[0] - across[1]) + 1e-8
            folds += 1
    assert folds == made.joints.folded == 103


@pytest.mark.parametrize("name", CURVED)
def test_warped_joints_are_counted_and_their_deviation_reported(name) -> None:
    surface, options = CURVED[name]
    folded = polygonal_wall(PatternSettings(**options), surface=surface, warped="triangles")
    made = polygonal_wall(PatternSettings(**options), surface=surface)
    model, joints = made.assembly, made.joints
    assert (joints.joints, joints.warped, joints.warp) == (
        folded.joints.joints, folded.joints.warped, folded.joints.warp)  # fmt: skip
    assert folded.joints.deviation == 0.0
    assert 0 <= joints.folded <= joints.warped
    assert joints.deviation <= min(joints.warp, 1e-3 * 3.5)
    assert (joints.folded > 0) == (joints.warp > 1e-3 * np.hypot(3.0, 1.8))
    _, distance, _ = check_contacts(model, model.contacts)
    assert distance == pytest.approx(joints.deviation, rel=0.02, abs=1e-6)
    assert [b.faces for b in model.blocks] == [b.faces for b in folded.assembly.blocks]


def test_the_shell_of_a_cylinder_by_hand() -> None:
    """Chords lie inside their arcs: the volume is below (R^2 - r^2) / 2 x angle x height, and near it."""
    made = polygonal_wall(PatternSettings(columns=24, rows=15, courses=15), surface=Cylinder(3.0, 1.5))
    whole = (3.0**2 - 2.8**2) / 2.0 * (3.0 / 3.0) * 1.8
    volume = made.assembly.mass.volume[1:].sum()
    assert 0.999 * whole < volume < whole


def test_stones_of_any_shape_are_closed() -> None:
    """An L beside a skew quad, on a cylinder: the centroid of a thin L does not see all its corners."""
    pattern = pattern_of(
        [[0, 0], [2, 0], [2, 0.2], [0.2, 0.2], [0.2, 1], [0, 1], [1.9, 1.2]], [[0, 1, 2, 3, 4, 5], [3, 2, 6, 4]]
    )
    model, _ = jointed(pattern, Cylinder(3.0, 1.0), Thickness(0.3), Masonry(warped="triangles"))
    assert mesh_faults(model.mesh) == []
    assert len(model.blocks[1].vertices) == 12  # ears, no centre
    assert len(model.blocks[2].vertices) == 10  # a fan about the centre
    middle = (3.0 + 2.7) / 2.0 / 3.0 * 0.3  # mean length along the shell over that of the face, times the depth
    assert model.mass.volume[1:] == pytest.approx(pattern.subdivision.areas() * middle, rel=0.05)


def test_the_ground_follows_the_foot() -> None:
    hill = polygonal_wall(PatternSettings(base_radius=4.0, openings=DOOR), surface=Cylinder(5.0, 1.5))
    base = base_edges(hill.pattern)
    contacts = hill.assembly.contacts
    on = contacts.a == 0
    assert on.sum() == len(base)
    assert np.all(contacts.frame[on][:, 0, 2] > 0.5)
    assert hill.assembly.blocks[0].vertices[:, 2].min() < -0.1
    length = hill.pattern.subdivision.lengths()[base].sum()
    assert contacts.area[on].sum() == pytest.approx(length * 0.2, rel=0.03)


def test_open_joints_are_another_model() -> None:
    made = polygonal_wall(PatternSettings(openings=ARCH, quoins=Quoins()))
    whole = made.assembly.mass.volume[1:]
    same = Assembly(with_open_joints(made.pattern, made.surface, made.thickness, gap=0.0))
    assert same.mass.volume == pytest.approx(whole, rel=1e-12)
    apart = Assembly(with_open_joints(made.pattern, made.surface, made.thickness, gap=0.01, chamfer=0.01))
    assert mesh_faults(apart.mesh) == []
    cells = made.pattern.subdivision
    assert np.all(apart.mass.volume < whole - 0.9 * 0.005 * 0.2 * cells.perimeters() * 0.5)
    assert [b.id for b in apart.blocks] == [b.id for b in made.assembly.blocks[1:]]
    assert len(detect(apart).contacts) == 0
    box = polygonal_wall(PatternSettings(columns=3, rows=1, courses=1, coursing=1.0, jitter=0.0, size_grade=0.0))
    stones = with_open_joints(box.pattern, Plane(), Thickness(0.2), gap=0.02)
    size = sorted(np.ptp(s.vertices, axis=0).round(9).tolist() for s in stones)
    cell = sorted(np.ptp(box.pattern.subdivision.ring(k), axis=0).tolist() for k in range(3))
    assert size == pytest.approx(np.array([[u - 0.02, 0.2, v - 0.02] for u, v in cell]))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: polygonal_wall(warped="flat"), "warped: expected auto"),
        (lambda: polygonal_wall(depth=-1.0), "depth"),
        (lambda: polygonal_wall(mu=-0.1), "mu"),
        (lambda: polygonal_wall(PatternSettings(width=0.4), surface=Cylinder(0.15, 0.2)), "bends with a radius"),
        (lambda: polygonal_wall(surface=Free(lambda u, v: (u, v, 0.0 * u), 3.0, 1.8)), "straight up or down"),
        (
            lambda: jointed(two_squares(), Cylinder(0.8, 1.0), Thickness(1.0), Masonry()),
            "folds into itself at its foot",
        ),
        (lambda: with_open_joints(two_squares(), Plane(), Thickness(0.2), gap=1.1), "leaves nothing of stone"),
        (lambda: with_open_joints(two_squares(), Plane(), Thickness(0.2), gap=-1.0), "gap"),
        (lambda: with_open_joints(two_squares(), Plane(), Thickness(0.2), chamfer=0.2), "chamfer"),
    ],
)
def test_refusals(make, says) -> None:
    with pytest.raises(InputError, match=says) as error:
        make()
    assert "\n" not in str(error.value)


def test_the_same_settings_give_the_same_wall_to_the_bit() -> None:
    one, two = (polygonal_wall(surface=Cylinder(5.0, 1.5)).assembly for _ in range(2))
    assert np.array_equal(one.mesh.vertex, two.mesh.vertex)
    assert np.array_equal(one.contacts.point, two.contacts.point)
    assert [b.id for b in one.blocks] == [b.id for b in two.blocks]


def test_the_default_wall_stands() -> None:
    result = check(polygonal_wall().assembly, Settings(method="cra"))
    assert (result.verdict, result.warnings) == ("stable", ())


def test_thin_arms_of_stones_are_cut_off_by_open_joints() -> None:
    """A stone 0.8 m wide with an arm 6 mm high: with a gap of 10 mm nothing of the arm is left, the rest stays."""
    pattern = pattern_of(
        [[0, 0], [0.8, 0], [0.8, 0.994], [1.2, 0.994], [1.2, 1], [0, 1], [2, 0], [2, 1]],
        [[0, 1, 2, 3, 4, 5], [1, 6, 7, 4, 3, 2]],
    )
    for chamfer in (0.0, 0.01):
        stones = Assembly(with_open_joints(pattern, Plane(), Thickness(0.2), gap=0.01, chamfer=chamfer))
        assert mesh_faults(stones.mesh) == []
        assert len(detect(stones).contacts) == 0
        assert stones.blocks[0].vertices[:, 0].max() == pytest.approx(0.795)
        assert stones.blocks[0].vertices[:, 2].max() == pytest.approx(0.995)


@given(seed=st.integers(0, 10_000), chamfer=st.sampled_from([0.0, 0.012]))
@settings(max_examples=examples(10), deadline=None)
def test_stones_with_open_joints_do_not_touch(seed, chamfer) -> None:
    pattern = polygonal_wall(PatternSettings(seed=seed, openings=DOOR, quoins=Quoins(0.5, 0.2), coursing=0.0)).pattern
    stones = Assembly(with_open_joints(pattern, Plane(), Thickness(0.2), gap=0.01, chamfer=chamfer))
    assert mesh_faults(stones.mesh) == []
    assert len(detect(stones).contacts) == 0
