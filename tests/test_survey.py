"""What `info` says of a model, by hand and by law."""

import json
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.assembly import Assembly, Block, Contacts, survey

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def row(sides, **changes):
    """Cubes side by side on the ground, of these sides."""
    starts = np.cumsum([0, *sides])
    blocks = [Block(f"b{k}", CUBE * s + [starts[k], 0, 0], FACES, **changes) for k, s in enumerate(sides)]
    return Assembly(tuple(blocks), name="row")


def test_by_hand():
    blocks = [*row([1, 1, 1, 3]).blocks]
    blocks[0] = Block("b0", blocks[0].vertices, FACES, 2400.0, group="course")
    contacts = Contacts.of([(0, 1), (1, 2)], [CUBE[[1, 2, 6, 5]], CUBE[[1, 2, 6, 5]] + [1, 0, 0]], [0.5, None])
    found = survey(Assembly(tuple(blocks), contacts))
    assert (found.blocks, found.supports, found.support_rule) == (4, 4, "lowest")
    assert (found.contacts, found.points, found.loads, found.groups) == (2, 8, 0, 1)
    assert (found.without_density, found.without_mu) == (3, 1)
    assert found.extent == pytest.approx((6, 3, 3))
    assert found.size == pytest.approx(54**0.5)
    volumes = found.volumes
    assert (volumes.count, volumes.minimum, volumes.median, volumes.maximum) == pytest.approx((4, 1, 1, 27))
    assert (volumes.lower_quartile, volumes.upper_quartile, volumes.total) == pytest.approx((1, 7.5, 30))
    assert found.outliers == ("b3",)  # the fence ends at 7.5 + 1.5 * 6.5 = 17.25
    assert (found.faults, found.faces, found.warped_faces) == ((), 24, 0)
    assert json.loads(json.dumps(asdict(found)))["volumes"]["total"] == pytest.approx(30)


def test_contacts_not_given_are_not_counted():
    found = survey(row([1, 1]))
    assert (found.contacts, found.points, found.without_mu) == (None, None, None)


def test_faulty_and_warped_meshes_are_named_and_left_out_of_the_volumes():
    twisted = CUBE.copy()
    twisted[6, 2] = 1.2  # lifts one corner of three faces; only the top one leaves its plane
    blocks = (
        Block("open", CUBE, FACES[:-1]),
        Block("turned", CUBE, tuple(f[::-1] for f in FACES)),
        Block("twisted", twisted, FACES),
    )
    found = survey(Assembly(blocks))
    assert [name for name, _ in found.faults] == ["open", "turned"]
    assert found.volumes.count == 1
    assert found.warped_faces == 1
    assert found.warp == pytest.approx(0.05, rel=0.02)  # a quarter of the lift, for four corners
    assert survey(Assembly(blocks[:2])).volumes is None


def test_supports_are_said_as_they_are():
    assert survey(row([1, 2], fixed=False)).support_rule == "none"
    assert survey(row([1, 2], fixed=True)).support_rule == "file"
    assert survey(Assembly(())).blocks == 0


@given(st.integers(1, 30), st.floats(1e-3, 1e3), st.floats(-1e4, 1e4))
def test_stones_of_one_size_have_no_outliers(count, side, shift):
    """Not even by rounding, far from the origin."""
    blocks = [Block(f"b{k}", CUBE * side + [shift * side, side * k, 0], FACES) for k in range(count)]
    found = survey(Assembly(tuple(blocks)))
    assert found.outliers == ()
    assert found.warped_faces == 0
    assert found.volumes.total == pytest.approx(count * side**3, rel=1e-9)


@given(st.lists(st.floats(0.5, 2), min_size=4, max_size=12))
def test_volumes_are_in_order_and_scale_with_the_cube(sides):
    one, ten = survey(row(sides)).volumes, survey(row([10 * s for s in sides])).volumes
    order = [one.minimum, one.lower_quartile, one.median, one.upper_quartile, one.maximum]
    assert order == sorted(order)
    assert ten.total == pytest.approx(1000 * one.total)
    assert survey(row(sides)).outliers == survey(row([10 * s for s in sides])).outliers
