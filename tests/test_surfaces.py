"""Surfaces by hand, normals against differences, thickness, and walls that would fold into themselves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.design.walls.surfaces import (
    Cone,
    Cylinder,
    Free,
    HeightGrid,
    Plane,
    Ruled,
    Sphere,
    Thickness,
    refuse_folds,
    tightest_bulge,
)
from cyclopean.errors import InputError
from laws import examples

WIDTH, HEIGHT = 3.0, 1.8


def wave(u, v):
    return u, 0.1 * np.sin(u) * np.cos(v), v


def relief():
    v, u = np.meshgrid(np.linspace(0, HEIGHT, 12), np.linspace(0, WIDTH, 16), indexing="ij")
    return -0.1 * np.sin(u) * np.cos(v)


SURFACES = {
    "plane": Plane(),
    "cylinder": Cylinder(2.5, 1.5),
    "hollow": Cylinder(-2.5, 1.5),
    "cone": Cone(3.0, 12.0, 1.5),
    "hollow cone": Cone(-3.0, 12.0, 1.5),
    "sphere": Sphere(4.0, 10.0, 1.5),
    "hollow sphere": Sphere(-4.0, 10.0, 1.5),
    "ruled": Ruled(lambda u: (u, 0.0, 0.0), lambda u: (u, 0.2 * u, HEIGHT), WIDTH, HEIGHT),
    "free": Free(wave, WIDTH, HEIGHT),
    "grid": HeightGrid(relief(), WIDTH, HEIGHT),
}


def at(surface, u, v):
    point, normal = surface.at(np.array([[u, v]]))
    return point[0], normal[0]


def test_points_by_hand() -> None:
    """A quarter turn of a cylinder, a cone of 30 degrees, a sphere from its equator to 60 degrees north."""
    point, normal = at(Cylinder(2.0), np.pi, 1.0)
    assert point == pytest.approx([2, 2, 1])
    assert normal == pytest.approx([1, 0, 0], abs=1e-15)
    point, normal = at(Cone(2.0, 30.0), 0.0, 1.0)
    assert point == pytest.approx([0, 0.5, np.sqrt(0.75)])
    assert normal == pytest.approx([0, -np.sqrt(0.75), 0.5])
    point, normal = at(Sphere(3.0), 0.0, np.pi)
    assert point == pytest.approx([0, 1.5, 3 * np.sqrt(0.75)])
    assert normal == pytest.approx([0, -0.5, np.sqrt(0.75)])
    point, normal = at(Cone(-2.0, 30.0), 0.0, 1.0)  # hollow: towards its axis is towards the viewer
    assert point == pytest.approx([0, -0.5, np.sqrt(0.75)])


@pytest.mark.parametrize("name", SURFACES)
@settings(max_examples=examples(25), deadline=None)
@given(u=st.floats(0.01, WIDTH - 0.01), v=st.floats(0.01, HEIGHT - 0.01))
def test_normals_are_unit_and_cross_the_differences(name, u, v) -> None:
    surface, step = SURFACES[name], 1e-5
    _, normal = at(surface, u, v)
    along = at(surface, u + step, v)[0] - at(surface, u - step, v)[0]
    up = at(surface, u, v + step)[0] - at(surface, u, v - step)[0]
    cross = np.cross(along, up)
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-12)
    assert normal @ cross == pytest.approx(np.linalg.norm(cross), rel=1e-6)


@pytest.mark.parametrize("name", ["plane", "cylinder", "hollow", "cone", "hollow cone", "sphere", "hollow sphere"])
def test_lengths_are_true_along_the_foot_and_up_the_middle(name) -> None:
    u = np.linspace(0.0, WIDTH, 2001)
    foot = SURFACES[name].at(np.stack([u, 0 * u], 1))[0]
    assert np.linalg.norm(np.diff(foot, axis=0), axis=1).sum() == pytest.approx(WIDTH, rel=1e-6)
    assert SURFACES[name].at(np.array([[1.5, 0.0]]))[0] == pytest.approx(np.array([[1.5, 0.0, 0.0]]), abs=1e-12)
    v = np.linspace(0.0, HEIGHT, 2001)
    middle = SURFACES[name].at(np.stack([0 * v + 1.5, v], 1))[0]
    assert np.linalg.norm(np.diff(middle, axis=0), axis=1).sum() == pytest.approx(HEIGHT, rel=1e-6)


def test_a_free_surface_is_what_its_function_says() -> None:
    uv = np.random.default_rng(1).uniform(0, 1, (50, 2)) * [WIDTH, HEIGHT]
    exact = Cylinder(2.5, 1.5)
    free = Free(lambda u, v: exact.at(np.stack([u, v], 1))[0].T, WIDTH, HEIGHT)
    for ours, theirs, tol in zip(free.at(uv), exact.at(uv), (0, 2e-4), strict=True):
        assert np.abs(ours - theirs).max() <= tol
    point, normal = SURFACES["grid"].at(uv)  # the bicubic grid against the function it was sampled from
    assert np.abs(point - np.stack(wave(*uv.T), 1)).max() < 2e-4
    assert np.abs(normal - SURFACES["free"].at(uv)[1]).max() < 2e-3


def test_tightest_radius_by_hand() -> None:
    """R for cylinder and sphere; r / cos(lean) at the top of a cone; none for what is flat or hollow."""
    assert tightest_bulge(Cylinder(2.5, 1.5), WIDTH, HEIGHT)[0] == pytest.approx(2.5, rel=1e-6)
    assert tightest_bulge(Sphere(4.0, 0.0, 1.5), WIDTH, HEIGHT)[0] == pytest.approx(4.0, rel=1e-6)
    top = (3.0 - HEIGHT * np.sin(np.radians(12))) / np.cos(np.radians(12))
    assert tightest_bulge(Cone(3.0, 12.0, 1.5), WIDTH, HEIGHT)[0] == pytest.approx(top, rel=1e-3)
    for name in ("plane", "hollow", "hollow sphere"):
        assert tightest_bulge(SURFACES[name], WIDTH, HEIGHT)[0] == np.inf


def test_thickness_tapers_from_the_front() -> None:
    front, back = Thickness(0.5, 0.1).rails(Plane(), [[1.0, 0.0], [1.0, 2.0]])
    assert front == pytest.approx(np.array([[1, 0, 0], [1, 0.2, 2]]))
    assert back == pytest.approx(np.array([[1, 0.5, 0], [1, 0.5, 2]]))
    front, back = Thickness(0.5).rails(Cylinder(2.0), [[np.pi, 0.0]])
    assert front - back == pytest.approx(np.array([[0.5, 0, 0]]))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Cylinder(0.0), "cylinder radius: must not be 0"),
        (lambda: Cone(2.0, 85.0), "cone lean"),
        (lambda: Cylinder(0.4, 1.5).at(np.array([[0.0, 0.0]])), "closes on itself"),
        (lambda: Cone(1.0, 60.0).at(np.array([[0.0, 1.5]])), "ends below 1.5 m"),
        (lambda: Sphere(1.0).at(np.array([[0.0, 1.6]])), "ends below 1.6 m"),
        (lambda: Free(lambda u, v: (u, u, u), 1, 1).at(np.array([[0.5, 0.5]])), "no normal at u = 0.5"),
        (lambda: Free(lambda u, v: (u, v), 1, 1).at(np.array([[0.5, 0.5]])), "expected x, y, z"),
        (lambda: Free(lambda u, v: (u, np.nan * u, v), 1, 1).at(np.array([[0.5, 0.5]])), "not a finite number"),
        (lambda: HeightGrid([[0.0, 1.0]], 1, 1), "at least 2 x 2"),
        (lambda: Thickness(0.0), "depth"),
        (lambda: Thickness(0.2, -0.1), "batter"),
        (lambda: Thickness(0.2, 0.2).rails(Plane(), [[0.0, 1.0]]), "leaves nothing"),
        (lambda: refuse_folds(Cylinder(0.2, 0.2), Thickness(0.2), 0.4, 1.0), "bends with a radius of 0.2 m"),
        (lambda: refuse_folds(Sphere(0.4, 0.0, 0.2), Thickness(0.5), 0.4, 0.4), "bends with a radius"),
    ],
)
def test_refusals(make, says) -> None:
    with pytest.raises(InputError, match=says) as error:
        make()
    assert "\n" not in str(error.value)


def test_a_radius_just_above_the_depth_will_do() -> None:
    refuse_folds(Cylinder(0.21, 0.2), Thickness(0.2), 0.4, 1.0)
    refuse_folds(Cylinder(-0.15, 0.2), Thickness(0.2), 0.4, 1.0)  # hollow: the back is the wider side
