"""Facts of a stone: by hand, by laws, and against the real scans.

By hand, a brick of 4 x 2 x 1: V = 8, A = 28, semi-axes of the ellipsoid of the same inertia sqrt(5/3) (2, 1, 1/2), so
b/a = c/b = 1/2, a blade; sphericity pi^(1/3) 48^(2/3) / 28; six flat faces, 8 8 4 4 2 2, misfit 0. A ball of radius r
has the semi-axes r and no flat face.
Mutants killed: limits of the classes swapped or 0.6; area for volume in the sphericity; flat faces by number of
triangles, not by area; misfit from the vertices only; axes as the eigenvectors come.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.design.stones.inventory import CLASSES, Inventory, aspect_class, flat_faces, shape_of, size_of
from cyclopean.design.stones.stone import in_body_frame, stone_of
from cyclopean.errors import InputError
from cyclopean.io import read_stones
from fixtures_stones import NAMES, SCANS, boulder, box, needs_scans, rotation, sphere, subdivided
from laws import examples

SEEDS = st.integers(0, 2**32 - 1)
ROUNDING = 1e-9  # far above what turning and summing in another order does to a stone 10 m from the origin


def brick():
    vertices, triangles = box(1.0, 4.0, 2.0, at=(7.0, -3.0, 5.0))
    return stone_of("brick", vertices, triangles)


def test_a_brick_by_hand():
    stone = brick()
    assert stone.volume == pytest.approx(8.0, rel=1e-14)
    assert stone.hull_volume == pytest.approx(8.0, rel=1e-14)
    assert stone.area == pytest.approx(28.0, rel=1e-14)
    assert stone.half == pytest.approx(np.sqrt(5.0 / 3.0) * np.array([2.0, 1.0, 0.5]), rel=1e-12)
    assert stone.centroid == pytest.approx([7.5, -1.0, 6.0], rel=1e-13)
    assert np.abs(stone.axes) == pytest.approx(np.eye(3)[[1, 2, 0]], abs=1e-12)
    shape = shape_of(stone)
    assert (shape.elongation, shape.flatness, shape.thinness) == pytest.approx((0.5, 0.5, 0.25))
    assert shape.solidity == pytest.approx(1.0)
    assert shape.sphericity == pytest.approx(np.pi ** (1 / 3) * 48 ** (2 / 3) / 28)
    assert shape.aspect == "blade"
    assert size_of(stone) == pytest.approx((48 / np.pi) ** (1 / 3))


def test_flat_faces_of_a_brick_by_hand():
    stone = brick()
    found = flat_faces(stone, share=0.0)
    assert [face.area for face in found] == pytest.approx([8, 8, 4, 4, 2, 2])
    for face in found:
        assert face.misfit < 1e-12
        assert len(face.triangles) == 2
        assert face.normal @ (face.point - stone.centroid) > 0.0
    assert [face.area for face in flat_faces(stone, share=0.1)] == pytest.approx([8, 8, 4, 4])


def test_a_misfit_by_hand():
    """A square pyramid 1 high on a square of side 2 sqrt 3, seen within 50 degrees: its four faces are one.

    The height over the base is linear from 0 at the rim to 1 at the apex, so its mean is 1/3 and its variance 1/18.
    """
    s = np.sqrt(3.0)
    vertices = np.array([[-s, -s, 0], [s, -s, 0], [s, s, 0], [-s, s, 0], [0, 0, 1.0]])
    triangles = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (0, 3, 2), (0, 2, 1)])
    base, roof = sorted(flat_faces(stone_of("p", vertices, triangles), angle=50.0), key=lambda face: face.normal[2])
    assert (base.area, base.misfit) == pytest.approx((12.0, 0.0), abs=1e-12)
    assert roof.misfit == pytest.approx(np.sqrt(1 / 18), rel=1e-12)
    assert roof.area == pytest.approx(4 * s * 2.0, rel=1e-12)


def test_a_ball_has_no_flat_face():
    stone = stone_of("ball", *sphere(4))
    assert flat_faces(stone) == ()
    assert stone.half == pytest.approx([1, 1, 1], rel=0.01)
    assert shape_of(stone).aspect == "block"
    assert shape_of(stone).sphericity == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("half", "name"),
    [
        ((3.0, 2.01, 1.35), "block"),
        ((3.0, 2.01, 1.33), "slab"),
        ((3.0, 1.99, 1.35), "bar"),
        ((3.0, 1.99, 1.32), "blade"),
        ((3.0, 2.0, 1.0), "blade"),  # at the limit, not above it
    ],
)
def test_classes_at_their_limits(half, name):
    assert aspect_class(half) == name


def facts(stone):
    shape = shape_of(stone)
    return [stone.volume, stone.hull_volume, stone.area, *stone.half, shape.solidity, shape.sphericity]


@settings(max_examples=examples(60), deadline=None)
@given(seed=SEEDS, divide=st.booleans())
def test_facts_turn_with_the_stone_and_do_not_depend_on_how_it_is_written(seed, divide):
    draw = np.random.default_rng(seed)
    vertices, triangles = boulder(seed % 11, detail=1)
    stone = stone_of("s", vertices, triangles)
    turn, shift = rotation(seed), draw.uniform(-10, 10, 3)
    other = subdivided(vertices, triangles) if divide else (vertices, triangles)
    order = draw.permutation(len(other[0]))
    moved = (other[0] @ turn.T + shift)[order]
    rolled = np.array([np.roll(t, draw.integers(3)) for t in np.argsort(order)[other[1]]])
    twin = stone_of("s", moved, rolled[draw.permutation(len(rolled))])
    assert facts(twin) == pytest.approx(facts(stone), rel=ROUNDING)
    assert twin.centroid == pytest.approx(turn @ stone.centroid + shift, abs=ROUNDING)
    assert twin.axes == pytest.approx(stone.axes @ turn.T, abs=1e-6)
    here, there = (in_body_frame(s) for s in (stone, twin))
    assert there.min(axis=0) == pytest.approx(here.min(axis=0), abs=1e-7)
    assert there.max(axis=0) == pytest.approx(here.max(axis=0), abs=1e-7)
    one, two = flat_faces(stone), flat_faces(twin)
    assert [f.area for f in two] == pytest.approx([f.area for f in one], rel=ROUNDING)
    for a, b in zip(one, two, strict=True):
        assert b.normal == pytest.approx(turn @ a.normal, abs=1e-8)
        assert b.point == pytest.approx(turn @ a.point + shift, abs=1e-8)
        assert b.misfit == pytest.approx(a.misfit, abs=1e-8)


@settings(max_examples=examples(30), deadline=None)
@given(seed=SEEDS, scale=st.floats(1e-2, 1e2))
def test_what_scales_and_how(seed, scale):
    vertices, triangles = boulder(seed % 11)
    stone, large = stone_of("s", vertices, triangles), stone_of("s", scale * vertices, triangles)
    power = [3, 3, 2, 1, 1, 1, 0, 0]
    assert facts(large) == pytest.approx([f * scale**p for f, p in zip(facts(stone), power, strict=True)], rel=1e-10)
    assert shape_of(large).aspect == shape_of(stone).aspect
    assert size_of(large) == pytest.approx(scale * size_of(stone), rel=1e-12)
    for a, b in zip(flat_faces(stone), flat_faces(large), strict=True):
        assert (b.area, b.misfit) == pytest.approx((scale**2 * a.area, scale * a.misfit), rel=1e-8)


def test_the_frame_is_right_handed_and_principal():
    for seed in range(10):
        stone = stone_of("s", *boulder(seed))
        assert np.linalg.det(stone.axes) == pytest.approx(1.0)
        assert (np.diff(stone.half) <= 0.0).all()
        again = stone_of("s", in_body_frame(stone), stone.triangles)
        assert again.axes == pytest.approx(np.eye(3), abs=1e-9)
        assert again.centroid == pytest.approx(np.zeros(3), abs=1e-12)


def test_refusals():
    vertices, triangles = box()
    with pytest.raises(InputError, match="encloses no volume"):
        stone_of("s", vertices, triangles[:, ::-1])
    with pytest.raises(InputError, match="vertex that is not there; there are 8"):
        stone_of("s", vertices, triangles + 1)
    with pytest.raises(InputError, match="not a finite number"):
        stone_of("s", np.full((8, 3), np.nan), triangles)
    with pytest.raises(InputError, match="'brick': the id stands twice"):
        Inventory((brick(), brick()))
    assert len(Inventory((brick(), replace(brick(), id="other")))) == 2


@needs_scans
def test_the_scans_have_the_shapes_that_were_measured_of_them():
    """Means and deviations of the 16 scans, found with other programs: b/a, c/a, volume / hull, sphericity."""
    inventory, _ = read_stones(SCANS, "m", cache=False)
    assert len(inventory) == len(NAMES) == 16
    shapes = [shape_of(stone) for stone in inventory.stones]
    found = {
        name: np.array([getattr(s, name) for s in shapes])
        for name in ("elongation", "thinness", "solidity", "sphericity")
    }
    measured = {
        "elongation": (0.76, 0.12),
        "thinness": (0.52, 0.12),
        "solidity": (0.86, 0.06),
        "sphericity": (0.81, 0.05),
    }
    for name, (mean, deviation) in measured.items():
        assert found[name].mean() == pytest.approx(mean, abs=0.01)
        assert found[name].std() == pytest.approx(deviation, abs=0.01)
    assert sum(stone.volume for stone in inventory.stones) == pytest.approx(5.275, abs=1e-3)
    assert {shape.aspect for shape in shapes} == set(CLASSES)
    assert all(flat_faces(stone) for stone in inventory.stones)
