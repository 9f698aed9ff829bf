"""Contacts of rough meshes, by hand and by laws.

By hand: two unit cubes, one half a length aside on the other, touch on 0.5 m2, as `detect` finds. A cube tilted by 3
degrees about the edge it stands on touches within a band h on a strip h / (2 tan 1.5 degrees) wide. One tilted by 40
degrees touches in an edge whose faces are too steep: no contact, one entry. A bar with two feet touches with both, and
its contact spans them. A ball of radius 1 lies within h of the ground on 2 pi h.
Mutants killed: the band not applied on one side; triangles clipped by two sides only; a normal from b to a; the first
face's normal for the mean; faces that lean too far; pieces off the plane; misfit without the gap; too much touching
area; the hull cut down to three corners; widening left out.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly, Block, check_contacts, detect, rough_contacts
from cyclopean.errors import InputError
from cyclopean.geometry.solids import mesh_of, solid_of
from fixtures_stones import boulder, box, rotation, sphere, subdivided
from laws import examples

SEEDS = st.integers(0, 2**32 - 1)


def block(name, vertices, triangles, fixed=None):
    return Block(name, vertices, tuple(map(tuple, np.asarray(triangles).tolist())), 2400.0, fixed)


def two_boxes():
    return Assembly((block("low", *box(), True), block("high", *box(at=(0.5, 0.0, 1.0)))))


def plate(seed, noise, at=0.0, times=4):
    """A slab of 1 x 1 x 0.2 in fine triangles, its top and bottom uneven by `noise`."""
    vertices, triangles = box(1.0, 1.0, 0.2)
    for _ in range(times):
        vertices, triangles = subdivided(vertices, triangles)
    flat = (vertices[:, 2] == 0.0) | (vertices[:, 2] == 0.2)
    vertices[flat, 2] += np.random.default_rng(seed).uniform(-noise, noise, int(flat.sum()))
    return vertices + np.array([0.0, 0.0, at]), triangles


def tilted(degrees, at=(0.0, 0.0, 0.0)):
    """A cube turned about its lower left edge."""
    vertices, triangles = box()
    return vertices @ Rotation.from_rotvec([0.0, -np.radians(degrees), 0.0]).as_matrix().T + at, triangles


def ground():
    return block("ground", *box(4.0, 4.0, 0.5, at=(-1.5, -1.5, -0.5)), True)


def is_sound(model, contacts, patches):
    """Accepted as given contacts are, to the checker's tolerances, and described one by one."""
    _, distance, _ = check_contacts(model, contacts)
    assert distance <= 0.005 * model.size
    listed = [p for p in patches if p.contact >= 0]
    assert [p.contact for p in listed] == list(range(len(contacts)))
    assert [(p.a, p.b) for p in listed] == list(zip(contacts.a.tolist(), contacts.b.tolist(), strict=True))
    assert np.all(contacts.a < contacts.b)
    assert np.all(np.diff(contacts.start) <= 8)
    assert [p.area for p in listed] == pytest.approx(contacts.area.tolist())
    for p, frame in zip(listed, contacts.frame, strict=True):
        assert frame[0] @ p.normal == pytest.approx(1.0, abs=1e-9)
        assert p.misfit >= abs(p.gap) / 2.0 - 1e-12


def test_two_boxes_touch_as_detected():
    model = two_boxes()
    contacts, patches = rough_contacts(model)
    known = detect(model).contacts
    assert len(contacts) == len(known) == 1
    assert contacts.area == pytest.approx(known.area)
    assert contacts.frame[0, 0] == pytest.approx(known.frame[0, 0])
    assert np.sort(contacts.point, axis=0) == pytest.approx(np.sort(known.point, axis=0))
    (patch,) = patches
    assert (patch.kind, patch.area, patch.touching) == ("face", pytest.approx(0.5), pytest.approx(0.5))
    assert (patch.misfit, patch.gap) == (pytest.approx(0.0, abs=1e-12), pytest.approx(0.0, abs=1e-12))
    is_sound(model, contacts, patches)


@pytest.mark.parametrize("apart", [0.004, -0.004])
def test_a_gap_is_told_with_its_sign(apart):
    model = Assembly((block("low", *box(), True), block("high", *box(at=(0.0, 0.0, 1.0 + apart)))))
    (patch,) = rough_contacts(model)[1]
    assert patch.gap == pytest.approx(apart)
    assert patch.misfit == pytest.approx(0.002)
    assert rough_contacts(model)[0].point[:, 2] == pytest.approx(1.0 + apart / 2.0)
    assert len(rough_contacts(model, band=0.003)[0]) == 0


def test_the_order_of_the_blocks_turns_the_normal():
    low, high = two_boxes().blocks
    (patch,) = rough_contacts(Assembly((high, low)))[1]
    assert (patch.a, patch.b) == (0, 1)
    assert patch.normal == pytest.approx([0.0, 0.0, -1.0])


@settings(max_examples=examples(6), deadline=None)
@given(seed=SEEDS)
def test_two_uneven_plates(seed):
    noise, band = 0.0005, 0.003
    model = Assembly((block("a", *plate(seed, noise), True), block("b", *plate(seed + 1, noise, at=0.2))))
    contacts, patches = rough_contacts(model, band)
    (patch,) = patches
    assert patch.area == pytest.approx(1.0, rel=0.01)
    assert patch.touching == pytest.approx(1.0, rel=0.01)
    assert patch.normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-3)
    assert 0.3 * noise <= patch.misfit <= 2.0 * noise
    assert abs(patch.gap) < noise / 5
    is_sound(model, contacts, patches)
    assert check(Assembly(model.blocks, contacts), Settings(method="rbe")).verdict == "stable"


def test_a_tilted_cube_touches_on_a_strip():
    band, lean = 0.004, np.radians(3.0)
    model = Assembly((ground(), block("cube", *tilted(3.0))))
    contacts, (patch,) = rough_contacts(model, band)
    # measured along the mean of the two normals, from which either face leans by half
    assert patch.touching == pytest.approx(band / (2.0 * np.tan(lean / 2.0)), rel=1e-6)
    assert patch.area == pytest.approx(patch.touching, rel=1e-6)
    assert patch.misfit <= band
    assert patch.normal @ [-np.sin(lean / 2), 0.0, np.cos(lean / 2)] == pytest.approx(1.0)
    is_sound(model, contacts, (patch,))
    assert check(Assembly(model.blocks, contacts), Settings(method="rbe")).verdict == "unstable"


@pytest.mark.parametrize("degrees", [40.0, 45.0])
def test_an_edge_between_steep_faces_is_listed_and_no_contact(degrees):
    model = Assembly((ground(), block("cube", *tilted(degrees))))
    contacts, (patch,) = rough_contacts(model, 0.004)
    assert len(contacts) == 0
    assert (patch.contact, patch.kind, patch.area) == (-1, "edge", 0.0)
    assert patch.touching > 0.0
    assert patch.normal[2] > 0.7


def test_a_ridge_under_a_plate_makes_two_leaning_contacts():
    """Faces that lean by 25 degrees share no normal with the plate and each other, but each half one with the plate."""
    ridge = np.array(
        [[x, y, z] for x in (0.0, 1.0) for y, z in ((-1.0, 0.0), (1.0, 0.0), (0.0, np.tan(np.radians(25))))]
    )
    faces = np.array([(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)])
    plate = box(1.0, 2.0, 0.2, at=(0.0, -1.0, np.tan(np.radians(25))))
    model = Assembly((block("ridge", ridge, faces, True), block("plate", *plate)))
    contacts, patches = rough_contacts(model, 0.004)
    is_sound(model, contacts, patches)
    assert sorted(p.normal[1] for p in patches) == pytest.approx([-np.sin(np.radians(12.5)), np.sin(np.radians(12.5))])


def test_a_line_is_widened_to_the_band():
    low, high = box(1.0, 1.0, 0.5), box(1.0, 1.0, 0.5, at=(0.9999, 0.0, 0.5))
    model = Assembly((block("a", *low, True), block("b", *high)))
    contacts, (patch,) = rough_contacts(model, 0.005)
    assert (patch.kind, patch.area) == ("narrow", pytest.approx(0.005))
    assert patch.touching == pytest.approx(1e-4)
    is_sound(model, contacts, (patch,))


def test_a_point_is_widened_to_a_triangle():
    model = Assembly((block("a", *box(), True), block("b", *box(at=(0.9999, 0.9999, 1.0)))))
    contacts, (patch,) = rough_contacts(model, 0.005)
    assert len(contacts.point) == 3
    sides = np.linalg.norm(np.roll(contacts.point, 1, axis=0) - contacts.point, axis=1)
    assert sides == pytest.approx([0.005] * 3)
    assert contacts.point.mean(axis=0) == pytest.approx([0.99995, 0.99995, 1.0])
    is_sound(model, contacts, (patch,))


def test_a_hollow_is_spanned():
    """A bar that touches at its two ends is one contact, over both: area 0.5 m2, of which 0.1 m2 touch."""
    foot = [box(0.1, 0.5, 0.1, at=(x, 0.0, 1.0)) for x in (0.0, 0.9)]
    bar = box(1.0, 0.5, 0.2, at=(0.0, 0.0, 1.1))
    whole = solid_of(*bar)
    for part in foot:
        whole = whole + solid_of(*part)
    model = Assembly((block("a", *box(), True), block("bar", *mesh_of(whole))))
    contacts, (patch,) = rough_contacts(model)
    assert patch.area == pytest.approx(0.5)
    assert patch.touching == pytest.approx(0.1)
    is_sound(model, contacts, (patch,))
    assert check(Assembly(model.blocks, contacts)).verdict == "stable"


def test_a_step_higher_than_the_band_makes_two_patches():
    """Against the corner of two walls a cube touches below and beside: two contacts at right angles."""
    wall = block("wall", *box(0.5, 1.0, 1.0, at=(-0.5, 0.0, 0.0)), True)
    model = Assembly((ground(), block("cube", *box()), wall))
    contacts, patches = rough_contacts(model, pairs=[(1, 0), (2, 1)])
    assert sorted((p.a, p.b) for p in patches) == [(0, 1), (1, 2)]
    assert contacts.area == pytest.approx([1.0, 1.0])
    assert [p.normal.round(9).tolist() for p in patches] == [[0, 0, 1], [-1, 0, 0]]


def test_a_ball_on_the_ground():
    """A ball of radius 1 on a plane is within h of it on a disc of radius sqrt(2 h), area 2 pi h, mean gap h / 2."""
    vertices, triangles = sphere(5)
    band = 0.016
    model = Assembly((ground(), block("ball", vertices @ rotation(3).T + [0.0, 0.0, 1.0], triangles)))
    contacts, (patch,) = rough_contacts(model, band)
    assert patch.touching == pytest.approx(2.0 * np.pi * band, rel=0.1)
    assert patch.area == pytest.approx(patch.touching, rel=0.15)
    assert patch.gap == pytest.approx(band / 2.0, rel=0.15)
    assert patch.misfit <= band
    is_sound(model, contacts, (patch,))


@settings(max_examples=examples(8), deadline=None)
@given(seed=SEEDS)
def test_contacts_of_stones_are_accepted_and_turn_with_them(seed):
    """Two boulders pressed against each other: what is found is a fact of the two, not of the frame or the mesh."""
    draw = np.random.default_rng(seed)
    (va, ta), (vb, tb) = boulder(seed % 13), boulder(seed % 11 + 20)
    vb = vb @ rotation(seed).T
    vb = vb + np.array([draw.uniform(-0.1, 0.1), 0.0, 0.0])
    low, high = 0.0, 2.0
    for _ in range(24):  # to within a thousandth of a millimetre of touching
        middle = (low + high) / 2.0
        pair = block("a", va, ta), block("b", vb + np.array([0.0, 0.0, middle]), tb)
        apart = not rough_contacts(Assembly(pair), 1e-6)[1]
        low, high = (low, middle) if apart and middle > 0.2 else (middle, high)
    vb = vb + np.array([0.0, 0.0, high])
    model = Assembly((block("a", va, ta, True), block("b", vb, tb)))
    contacts, patches = rough_contacts(model, 0.002)
    is_sound(model, contacts, patches)
    turn, away = rotation(seed + 1), draw.uniform(-9, 9, 3)
    moved = Assembly((block("a", va @ turn.T + away, ta, True), block("b", vb @ turn.T + away, tb)))
    again, facts = rough_contacts(moved, 0.002)
    assert [p.kind for p in facts] == [p.kind for p in patches]
    assert [p.touching for p in facts] == pytest.approx([p.touching for p in patches], rel=1e-6)
    assert again.area == pytest.approx(contacts.area, rel=0.01)
    larger = Assembly((block("a", 10 * va, ta, True), block("b", 10 * vb, tb)))
    assert rough_contacts(larger, 0.02)[0].area == pytest.approx(100.0 * contacts.area, rel=1e-6)


def test_refusals():
    model = two_boxes()
    for band in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="band"):
            rough_contacts(model, band)
    for pair in ((0, 0), (0, 2), (-1, 0)):
        with pytest.raises(InputError, match="does not name two of the blocks"):
            rough_contacts(model, pairs=[pair])
    assert len(rough_contacts(Assembly(()))[0]) == 0
    assert len(rough_contacts(Assembly(model.blocks[:1]))[0]) == 0
