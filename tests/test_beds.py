"""Stones without a bed: found in any model, avoided where a wall is drawn, told where they cannot be.

By hand: of a semicircular arch of 9 the joints lean by 0, 20, 40, 60 and 80 degrees; the stones whose lower joint is
steeper than the friction angle are those that the thrust holds. A stone on one slope slides from it at the friction
angle, so there the list and rigid-block equilibrium say the same.

Mutants killed (by hand): angle taken from the upright; a normal not turned for the other block; worst face instead of
the best; fixed or partly held blocks listed; the bearing face's own neighbour left in; corners moved the wrong way;
none slides along the ground; cells not looked at after a move; what it costs of J ignored; the surface left out.
"""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from cyclopean import design
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block, SteepBed, detect, steep_beds
from cyclopean.design.walls.beds import bedded, without_bed
from cyclopean.design.walls.corner import corner_wall
from cyclopean.design.walls.interlock import interlock
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings, draw_pattern
from cyclopean.design.walls.polygonal import PolygonalWall, polygonal_wall
from cyclopean.design.walls.surfaces import Cylinder, Plane, Sphere, Surface, Thickness
from cyclopean.errors import InputError
from cyclopean.io.drawings import drawing_dict, wall_of
from cyclopean.statics import turned_gravity
from geometry_rules import faults
from laws import examples

DOWN = np.array([0.0, 0.0, -9.81])
SIZE = {"width": 4.5, "height": 2.9, "columns": 12, "rows": 8, "courses": 8}
WEDGED = PatternSettings(
    **SIZE, coursing=0.7, seed=6, lloyd=0
)  # has a stone on a point, on faces of 50 degrees and more
CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def listed(model: Assembly, mu: float = 0.84, gravity: Floats = DOWN) -> tuple[SteepBed, ...]:
    contacts = detect(model).contacts if model.contacts is None else model.contacts
    return steep_beds(model, contacts.with_mu(mu), np.array([bool(b.fixed) for b in model.blocks]), gravity)


# ---- in any model


@pytest.mark.parametrize(("mu", "angles"), [(0.84, [60, 80, 60]), (0.3, [20, 40, 60, 80, 60, 40, 20]), (6.0, [])])
def test_an_arch_by_hand(mu: float, angles: list[float]) -> None:
    found = listed(design.arch(9, radius=3.0), mu)
    assert [one.angle for one in found] == pytest.approx(angles, abs=1e-6)
    assert all(one.friction == pytest.approx(math.degrees(math.atan(mu))) for one in found)


def test_neighbours_are_those_that_hold_the_stone_on_its_best_face() -> None:
    crown = next(one for one in listed(design.arch(9, radius=3.0)) if one.angle > 70.0)
    assert crown.block == "v05"
    assert len(crown.neighbours) == 1
    assert crown.neighbours[0] in ("v04", "v06")


def test_what_is_held_pulled_or_free_in_the_air_is_not_listed() -> None:
    """A cube between two others, on nothing: only upright faces. At rest if it is held, or if a joint pulls."""
    row = [Block(f"b{k}", CUBE + np.array([k, 0, 0]), FACES, fixed=k != 1) for k in range(3)]
    model = Assembly(tuple(row))
    joints = detect(model).contacts
    assert [(one.block, round(one.angle), len(one.neighbours)) for one in listed(model)] == [("b1", 90, 1)]
    assert listed(model, gravity=np.zeros(3)) == ()
    assert listed(replace(model, contacts=joints.with_tension(1e4))) == ()
    assert listed(Assembly((row[0], replace(row[1], held=("z",)), row[2]))) == ()
    assert listed(replace(model, contacts=joints.only(np.array([], np.int64)))) == ()
    assert [one.neighbours for one in listed(replace(model, contacts=joints.only(np.array([0]))))] == [()]


@given(slope=st.floats(0.5, 60.0), mu=st.floats(0.05, 1.5), azimuth=st.floats(0.0, 360.0), turned=st.booleans())
@settings(max_examples=examples(40), deadline=None)
def test_alone_on_a_slope_a_stone_is_listed_if_it_slides(slope: float, mu: float, azimuth: float, turned: bool) -> None:
    """A slab, too flat to tip; which of the two blocks comes first does not matter."""
    if abs(math.degrees(math.atan(mu)) - slope) < 0.1:
        return
    ground = Block("ground", (CUBE - [0.5, 0.5, 1.0]) * [4.0, 4.0, 1.0], FACES, fixed=True)
    slab = Block("slab", (CUBE - [0.5, 0.5, 0.0]) * [2.0, 2.0, 0.1], FACES)
    model = Assembly((slab, ground) if turned else (ground, slab))
    found = listed(model, mu, turned_gravity(DOWN, slope, azimuth))
    verdict = cyclopean.check(model, method="rbe", mu=mu, tilt=(slope, azimuth)).verdict
    assert [one.block for one in found] == ["slab"] * (verdict == "unstable")
    assert verdict == ("unstable" if slope > math.degrees(math.atan(mu)) else "stable")


@given(seed=st.integers(0, 10**6), axis=st.integers(0, 2), degrees=st.floats(-180.0, 180.0))
@settings(max_examples=examples(10), deadline=None)
def test_a_model_turned_with_gravity_is_the_same_model(seed: int, axis: int, degrees: float) -> None:
    model = polygonal_wall(PatternSettings(columns=6, rows=5, coursing=0.0, seed=seed, max_bed=90.0)).assembly
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = np.roll(np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]), (axis, axis), (0, 1))
    blocks = tuple(replace(block, vertices=block.vertices @ turn.T) for block in model.blocks)
    joints = replace(model.contacts, point=model.contacts.point @ turn.T)
    there = listed(Assembly(blocks, joints), 0.4, turn @ DOWN)
    here = listed(model, 0.4)
    assert [one.block for one in there] == [one.block for one in here]
    assert [one.angle for one in there] == pytest.approx([one.angle for one in here], abs=1e-6)


def test_info_tells_them(run) -> None:
    run("make", "arch", "9", "--radius", "3", "--out", "arch.json")
    _, out, _ = run("info", "arch.json")
    assert "beds      3 stones stand only if the neighbours hold them by thrust" in out
    assert "'v05': 80 degrees, friction 40" in out
    _, out, _ = run("info", "arch.json", "--json", "-")
    told = json.loads(out)["steep_beds"]
    assert [one["block"] for one in told] == ["v04", "v05", "v06"]
    assert set(told[0]) == {"block", "angle", "friction", "neighbours"}
    run("make", "wall", "4", "3", "--out", "wall.json")
    _, out, _ = run("info", "wall.json")
    assert "beds" not in out


def test_contacts_wound_the_wrong_way_do_not_make_info_take_a_bed_for_a_ceiling(run) -> None:
    run("make", "wall", "4", "3", "--out", "wall.json")
    model = json.loads(Path("wall.json").read_text())
    for contact in model["contacts"]:
        contact["polygon"].reverse()
    Path("turned.json").write_text(json.dumps(model))
    _, out, _ = run("info", "turned.json", "--json", "-")
    assert json.loads(out)["steep_beds"] == []


# ---- where a wall is drawn


def drawn(wanted: PatternSettings, surface: Surface | None = None) -> tuple[PolygonalWall, PolygonalWall]:
    """A wall as it is drawn, and on beds."""
    return polygonal_wall(replace(wanted, max_bed=90.0), surface=surface), polygonal_wall(wanted, surface=surface)


def test_a_stone_on_its_point_is_given_a_bed() -> None:
    before, after = drawn(WEDGED)
    assert [(one.block, round(one.angle)) for one in before.without_bed] == [("c05-b12", 50)]
    assert after.without_bed == ()
    moved = np.any(before.pattern.subdivision.vertex != after.pattern.subdivision.vertex, axis=1)
    assert 1 <= moved.sum() <= 2
    far = np.abs(before.pattern.subdivision.vertex - after.pattern.subdivision.vertex).max()
    assert far < 0.1  # m, of stones of 0.37 m


def test_a_stone_beside_the_ground_is_given_a_bed_by_corners_that_slide_along_it() -> None:
    before, after = drawn(PatternSettings(coursing=1.0, seed=31, lloyd=0))
    assert "c01-b02" in [one.block for one in before.without_bed]
    assert after.without_bed == ()


def test_a_move_that_costs_no_interlock_comes_first() -> None:
    before, after = drawn(replace(WEDGED, seed=5))
    assert (len(before.without_bed) > 0, after.without_bed) == (True, ())
    assert interlock(after.pattern).score > interlock(before.pattern).score


def test_the_shortest_way_to_a_bed_is_square_to_it() -> None:
    """The nearest point of a line is at the foot of the perpendicular."""
    before, after = drawn(WEDGED)
    pattern, wanted = before.pattern, math.tan(math.radians(35.0)) * 0.99
    old, new = pattern.subdivision.vertex, after.pattern.subdivision.vertex
    (corner,) = np.flatnonzero(np.any(old != new, axis=1))[:1]
    step = new[corner] - old[corner]
    assert abs(step[1] / step[0]) == pytest.approx(1.0 / wanted, rel=1e-6)


@given(
    seed=st.integers(0, 10**6), coursing=st.sampled_from([0.0, 0.4, 0.7, 1.0]), degrees=st.floats(15.0, 60.0),
    surface=st.sampled_from([None, Cylinder(2.5, 1.5), Cylinder(-4.0, 1.5), Sphere(4.0, 0.0, 1.5)]),
    openings=st.sampled_from([(), (Opening(1.2, 0.7, 0.9),)]),
)  # fmt: skip
@settings(max_examples=examples(60), deadline=None)
def test_no_wall_is_worse_for_it(seed, coursing, degrees, surface, openings) -> None:
    """What is covered stays covered, no stone becomes thinner than the thinnest, none loses its bed."""
    wanted = PatternSettings(
        columns=9, rows=6, courses=6, seed=seed, coursing=coursing, max_bed=degrees, openings=openings
    )
    try:
        before = polygonal_wall(replace(wanted, max_bed=90.0), surface=surface)
    except InputError:  # a wall that cannot be drawn at all
        return
    after = polygonal_wall(wanted, surface=surface)
    one, two = before.pattern.subdivision, after.pattern.subdivision
    assert faults(two, float(one.areas().sum())) == []
    assert two.inradii().min() >= one.inradii().min() * (1.0 - 1e-12)
    dressed = one.site < 0
    assert two.areas()[dressed] == pytest.approx(one.areas()[dressed], rel=1e-9)
    assert two.index.tolist() == one.index.tolist()
    assert len(steep(after, degrees)) <= len(steep(before, degrees))


def steep(wall: PolygonalWall, degrees: float) -> tuple[SteepBed, ...]:
    field = [k + 1 for k, kind in enumerate(wall.pattern.kind) if kind == "stone"]
    return without_bed(replace(wall.assembly, contacts=wall.assembly.contacts.with_mu(10.0)), field, degrees)


def test_walls_of_all_kinds_lie_on_beds_and_did_not() -> None:
    """On a plane, a cylinder and a sphere; the same walls as drawn show that the test can fail."""
    before = after = 0
    for surface in (None, Cylinder(2.5, 2.2), Sphere(7.0, 0.0, 2.2)):
        for seed in range(4, 8):
            one, two = drawn(replace(WEDGED, seed=seed, coursing=0.2 * (seed % 4)), surface)
            before += len(steep(one, 35.0))
            after += len(steep(two, 35.0))
    assert (before > 0, after) == (True, 0)


def test_round_a_corner() -> None:
    wanted = PatternSettings(columns=20, rows=12, courses=12, seed=3, lloyd=0)
    before, after = corner_wall(replace(wanted, max_bed=90.0)), corner_wall(wanted)
    assert len(before.without_bed) == 3
    assert all(not one.block.startswith("corner") for one in before.without_bed)
    assert after.without_bed == ()


def test_at_90_degrees_the_wall_is_as_it_was_drawn() -> None:
    pattern = draw_pattern(replace(WEDGED, max_bed=90.0))
    assert bedded(pattern, Plane(), Thickness()) is pattern
    assert polygonal_wall(pattern.settings).pattern.subdivision.vertex.tobytes() == pattern.subdivision.vertex.tobytes()


def test_what_cannot_be_avoided_is_told(run) -> None:
    """At the height of a dome every bed leans back with it."""
    status, out, _ = run("make", "polygonal", "--surface", "sphere:2", "--out", "m.json")
    assert status == 0
    assert "beds       10 with no face below as flat as 35 degrees: 'c04-b03' (36)" in out
    assert "and 5 more" in out
    _, out, _ = run("make", "polygonal", "--out", "m.json")
    assert "beds" not in out


def test_a_drawing_from_before_there_was_such_an_angle_is_drawn_as_it_was() -> None:
    wall = polygonal_wall(replace(WEDGED, max_bed=90.0))
    drawing = drawing_dict(wall)
    del drawing["settings"]["max_bed"]
    assert wall_of(drawing).assembly.mesh.vertex.tobytes() == wall.assembly.mesh.vertex.tobytes()


@pytest.mark.parametrize("degrees", [-1.0, 90.1, math.nan])
def test_angles_that_are_none(degrees: float) -> None:
    with pytest.raises(InputError, match="max_bed"):
        PatternSettings(max_bed=degrees)
