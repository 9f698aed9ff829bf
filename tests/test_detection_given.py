"""Contacts that a file gives, held against the blocks.

By hand: a patch floating h above the joint of two cubes lies h from the face below and h from the face above; 0.5 % of
the model's size, sqrt(6) m for two unit cubes, is 12.2 mm.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.assembly import Assembly, Block, Contacts, check_contacts, detect
from cyclopean.errors import InputError
from laws import examples

SQUARE = np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
UP = np.array([0.0, 0, 1])
SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def cube(name, z, width=1.0):
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    return Block(name, corners * [width, width, 1] + [0, 0, z], SIDES)


def stack(n=2):
    return Assembly(tuple(cube(f"b{i}", i) for i in range(n)))


def given_contact(polygon, a=0, b=1):
    return Contacts.of([(a, b)], [np.asarray(polygon, float)], [0.7])


def test_a_good_contact_passes_unchanged():
    contacts, distance, warnings = check_contacts(stack(), given_contact(SQUARE))
    assert contacts.point.tolist() == SQUARE.tolist()
    assert (distance, warnings) == (0.0, ())


def test_distance_is_that_of_the_furthest_point():
    shifted = SQUARE + 0.003 * UP
    contacts, distance, warnings = check_contacts(stack(), given_contact(shifted))
    assert distance == pytest.approx(0.003, rel=1e-12)
    assert len(warnings) == 1
    assert "1 contact(s)" in warnings[0]
    assert "0.003 m" in warnings[0]
    assert contacts.point.tolist() == shifted.tolist()
    beside = SQUARE * [1.004, 1, 1]  # 4 mm over the edge, in the plane
    assert check_contacts(stack(), given_contact(beside))[1] == pytest.approx(0.004, rel=1e-12)
    both = SQUARE * [1.004, 1, 1] + [0, 0, 0.003]
    assert check_contacts(stack(), given_contact(both))[1] == pytest.approx(0.005, rel=1e-12)
    assert check_contacts(stack(), given_contact(shifted), tolerance=0.01)[2] == ()


def test_a_polygon_that_winds_the_wrong_way_is_turned():
    contacts, distance, warnings = check_contacts(stack(), given_contact(SQUARE[::-1]))
    np.testing.assert_allclose(contacts.frame[0, 0], [0, 0, 1])
    assert contacts.point.tolist() == SQUARE.tolist()
    assert contacts.mu.tolist() == [0.7]
    assert distance == 0.0
    assert warnings == ("1 contact polygon(s) wound the wrong way and were turned: 0 (b0-b1)",)


def test_thin_plates_do_not_hide_a_wrong_winding():
    """Two plates 1 mm thick: their far faces are well within 0.5 % of the size, and face the other way."""
    thin = [Block(f"b{k}", cube("", 0).vertices * [1, 1, 1e-3] + (1 + 1e-3 * (k - 1)) * UP, SIDES) for k in (0, 1)]
    model = Assembly((*thin, cube("b2", 1.001)))
    contacts, distance, warnings = check_contacts(model, given_contact(SQUARE[::-1]))
    np.testing.assert_allclose(contacts.frame[0, 0], [0, 0, 1])
    assert distance < 1e-12
    assert len(warnings) == 1


def test_holes_and_concave_faces_are_seen():
    """A patch over the nook of an L is off its face although it lies in the face's plane."""
    outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    vertices = np.array([[x, y, z] for z in (0, 1) for x, y in outline], float)
    sides = tuple((i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6) for i in range(6))
    angle = Block("L", vertices, (tuple(range(5, -1, -1)), tuple(range(6, 12)), *sides))
    model = Assembly((angle, cube("lid", 1, width=2.0)))
    inside = [[0, 0, 1], [2, 0, 1], [2, 1, 1], [1, 1, 1], [1, 2, 1], [0, 2, 1]]
    assert check_contacts(model, given_contact(inside))[1] == 0.0
    with pytest.raises(InputError, match=r"contact 0 \(L-lid\).*0\.5 m off.*'L'"):
        check_contacts(model, given_contact([[0, 0, 1], [1.5, 0, 1], [1.5, 1.5, 1], [0, 1.5, 1]]))


@pytest.mark.parametrize(
    ("polygon", "message"),
    [
        (SQUARE + 0.02 * UP, r"contact 0 \(b0-b1\).*0\.02 m off the faces of block 'b0'.*0\.5 %"),
        (SQUARE[:, [2, 0, 1]] * [0.5, 1, 1], r"contact 0 \(b0-b1\).*off the faces"),  # upright, in the middle
        (SQUARE + np.outer([1e-3, 0, 1e-3, 0], UP), r"contact 0 \(b0-b1\).*not planar.*split"),
        (SQUARE * [1, 0, 1], r"contact 0 \(b0-b1\).*no area"),
        (SQUARE @ np.array([[1, 0, 1], [0, 1, 0], [0, 0, 1]]), "no face of block 'b0' looks its way"),
    ],
)
def test_contacts_that_cannot_be_are_refused(polygon, message):
    with pytest.raises(InputError, match=message):
        check_contacts(stack(), given_contact(polygon))


def test_the_offender_is_named_among_many():
    model = stack(4)
    polygons = [SQUARE, SQUARE + UP, SQUARE + 2.1 * UP]
    with pytest.raises(InputError, match=r"contact 2 \(b2-b3\)"):
        check_contacts(model, Contacts.of([(0, 1), (1, 2), (2, 3)], polygons))


def test_no_contacts_no_questions():
    assert check_contacts(stack(), Contacts.of([], []))[1:] == (0.0, ())


@given(seed=st.integers(0, 999), scale=st.floats(1e-2, 1e2), flips=st.lists(st.booleans(), min_size=5, max_size=5))
@settings(max_examples=examples(30), deadline=None)
def test_what_was_found_passes_in_any_frame_and_any_winding(seed, scale, flips):
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    q *= np.sign(np.linalg.det(q))
    model = Assembly(tuple(Block(b.id, scale * b.vertices @ q.T + [1e4, 0, -1e4], b.faces) for b in stack(6).blocks))
    found = detect(model)
    polygons = [found.contacts.polygon(k) for k in range(5)]
    pairs = list(zip(found.contacts.a.tolist(), found.contacts.b.tolist(), strict=True))
    wound = Contacts.of(pairs, [p[::-1] if flip else p for p, flip in zip(polygons, flips, strict=True)])
    contacts, distance, warnings = check_contacts(model, wound)
    assert distance <= found.tolerance
    np.testing.assert_allclose(contacts.frame[:, 0], found.contacts.frame[:, 0], atol=1e-8)
    assert len(warnings) == any(flips)
