"""Interlock of any wall: bonds by hand, the walls of experiments, drawn walls again from their stones, refusals."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from cyclopean.assembly import Assembly, Block
from cyclopean.design import arch, dome, stack, vault, wall
from cyclopean.design.walls.dressing import Quoins
from cyclopean.design.walls.front import interlock_of_stones, interlock_of_wall
from cyclopean.design.walls.interlock import interlock, usual_tolerance
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cylinder
from cyclopean.errors import InputError
from laws import examples


def turned(model: Assembly, angle: float) -> Assembly:
    """The blocks alone, turned about z and far from the origin."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return Assembly(tuple(replace(b, vertices=b.vertices @ turn + [300, -20, 5]) for b in model.blocks))


def opened(model: Assembly, share: float = 0.98) -> Assembly:
    """Every free stone smaller about its middle, so that no joint is shared."""
    return Assembly(
        tuple(
            b if b.fixed else replace(b, vertices=(v := b.vertices).mean(axis=0) + share * (v - v.mean(axis=0)))
            for b in model.blocks
        )
    )


def stacked(columns: int = 4, courses: int = 4) -> Assembly:
    """Stack bond of units 0.2 x 0.15 m on a slab."""
    box = wall(1, 1, length=0.2, height=0.15).blocks[1]
    corner = box.vertices - box.vertices.min(axis=0)
    unit = np.ptp(corner, axis=0)
    stones = [Block(f"s{i}-{k}", corner + unit * [i, 0, k], box.faces) for i in range(columns) for k in range(courses)]
    return Assembly((Block("ground", corner * [columns, 1, 1] - [0, 0, unit[2]], box.faces, fixed=True), *stones))


# ---- by hand


@pytest.mark.parametrize(("model", "seen"), [(stacked(), "joints"), (opened(stacked()), "elevation")])
def test_stack_bond_has_no_interlock_and_its_trace_goes_straight_up(model: Assembly, seen: str) -> None:
    found = interlock_of_stones(model)
    assert found.seen == seen
    assert found.interlock.score == 0.0
    assert len(found.interlock.crossings) == 9
    assert found.minimum_trace == pytest.approx(1000.0, abs=1e-9 if seen == "joints" else 5.0)
    assert found.courses == 4


@pytest.mark.parametrize(("height", "courses", "reported"), [(0.15, 8, 1600.0), (0.10, 9, 1900.0)])
def test_walls_of_experiments_have_the_trace_that_is_reported(height: float, courses: int, reported: float) -> None:
    """Dry ashlar 1 m long, units 200 mm long; Vanin et al. (2017) round to 100 mm to the m."""
    found = interlock_of_stones(wall(5, courses, length=0.2, depth=0.2, height=height))
    by_hand = 1e3 * (courses * height + (courses - 1) * 0.1) / (courses * height)
    assert found.minimum_trace == pytest.approx(by_hand)
    assert round(found.minimum_trace, -2) == reported
    assert found.interlock.score == 1.0
    assert found.interlock.rules.least_overlap == pytest.approx(0.5)
    assert found.size == pytest.approx([1.0, 0.2, courses * height])


def test_open_joints_are_seen_on_a_raster() -> None:
    found = interlock_of_stones(opened(wall(5, 8, length=0.2, height=0.15), 0.995))
    assert (found.seen, found.interlock.score, found.courses) == ("elevation", 1.0, 8)
    assert found.minimum_trace == pytest.approx(1583.3, rel=0.03)  # across gaps it cuts corners
    assert found.interlock.head_length == pytest.approx(36 * 0.15, rel=0.02)


def test_a_first_course_that_nobody_fixed_is_of_the_wall() -> None:
    bare = Assembly(tuple(replace(b, fixed=None) for b in stacked().blocks[1:]))
    assert len(interlock_of_stones(bare).interlock.head) == 12


# ---- laws


@given(
    seed=st.integers(0, 10**6),
    coursing=st.sampled_from([0.0, 0.4, 1.0]),
    more=st.sampled_from([
        {}, {"rows": 7, "courses": 7}, {"base_radius": 6.0}, {"quoins": Quoins(0.5, 0.3)},
        {"openings": (Opening(0.6, 0.6, 1.0, head="arch"), Opening(1.9, 0.5, 0.5, 0.5))},
    ]),
    angle=st.sampled_from([0.0, 0.02, 0.7, 2.0, 4.4]),
)  # fmt: skip
@settings(max_examples=examples(8), deadline=None)
def test_the_stones_of_a_drawn_wall_interlock_as_its_pattern(seed: int, coursing: float, more, angle: float) -> None:
    options = PatternSettings(seed=seed, coursing=coursing, **more)
    made = polygonal_wall(options, batter=0.05)
    tolerance = usual_tolerance(made.pattern)
    drawn = interlock(made.pattern)
    found = interlock_of_stones(turned(made.assembly, angle), courses=options.courses, tolerance=tolerance)
    assert found.seen == "joints"
    assert found.interlock.score == pytest.approx(drawn.score, abs=1e-9)
    assert found.interlock.head_length == pytest.approx(drawn.head_length)
    assert len(found.interlock.crossings) == len(drawn.crossings)
    for name in ("overlap", "least_overlap", "lapped", "vertical_joint", "trace", "horizontality"):
        assert getattr(found.interlock.rules, name) == pytest.approx(getattr(drawn.rules, name), abs=1e-9)


def test_a_joint_that_is_moved_under_another_is_seen() -> None:
    """The law above can fail: in a wall that scores 1, a stone made longer until two joints stand in one line."""
    whole = wall(4, 3)
    low, high = (b for b in whole.blocks if b.id in ("c02-b02", "c02-b03"))
    joint = high.vertices[:, 0].min()
    moved = []
    for block in whole.blocks:
        if block in (low, high):
            at = np.isclose(block.vertices[:, 0], joint)
            block = replace(block, vertices=block.vertices + np.where(at[:, None], [0.2, 0.0, 0.0], 0.0))
        moved.append(block)
    assert interlock_of_stones(whole).interlock.score == 1.0
    assert interlock_of_stones(Assembly(tuple(moved))).interlock.score < 0.8


def test_a_drawing_unrolls_a_curved_wall() -> None:
    made = polygonal_wall(PatternSettings(seed=4), surface=Cylinder(3.0, 1.5))
    found = cyclopean.interlock(made)
    assert (found.seen, found.masons, found.size) == ("drawing", None, None)
    assert found.interlock.score == interlock(made.pattern).score < 1.0
    assert interlock_of_wall(made, courses=5).interlock.score == pytest.approx(found.interlock.score)
    with pytest.raises(InputError, match="it bends, and only a wall that carries its drawing is unrolled"):
        cyclopean.interlock(made.assembly)


# ---- the command, and refusals


def test_info_tells_the_interlock(run, tmp_path) -> None:
    file = tmp_path / "wall.json"
    run("make", "polygonal", "--seed", "4", "--out", str(file))
    drawn = json.loads(run("info", file, "--interlock", "--json", "-")[1])["interlock"]
    mesh = tmp_path / "wall.obj"
    run("convert", file, mesh)
    read = json.loads(run("info", mesh, "--interlock", "--json", "-")[1])["interlock"]
    assert (drawn["seen"], read["seen"]) == ("drawing", "joints")
    assert drawn["J"] == pytest.approx(read["J"], abs=1e-6)
    assert drawn["minimum_trace"] == pytest.approx(read["minimum_trace"], rel=1e-6)
    assert drawn["masons"]["through_stones"] == pytest.approx(40 / 5.4, rel=0.01)
    told = run("info", mesh, "--interlock")[1]
    assert "mm to the m of height along joints" in told
    assert "head joints stand above each other in 1 place, through up to 4 courses" in told


@pytest.mark.parametrize(
    ("model", "why"),
    [
        (arch(15), "it spans a void, as an arch does"),
        (dome(8, 16), "a dome, a vault or a floor, and no upright wall"),
        (vault(8, 5), "a dome, a vault or a floor, and no upright wall"),
        (stack(5), "no stone lies across the joint of two others"),
        (wall(5, 1, height=0.3), "no stone lies across the joint of two others"),
        (stack(2), "it has 2 stones, and a bond needs 3"),
    ],
)
def test_what_is_no_wall_is_refused(model: Assembly, why: str) -> None:
    with pytest.raises(InputError, match=why):
        interlock_of_stones(model)


def test_options_that_make_no_sense_are_refused(run, tmp_path) -> None:
    file = tmp_path / "arch.json"
    run("make", "arch", "9", "--out", str(file))
    status, _, err = run("info", file, "--interlock")
    assert (status, err.count("\n")) == (2, 1)
    assert "arch.json: has no interlock" in err
    assert "give --interlock too" in run("info", file, "--courses", "3")[2]
    assert "--interlock: is that of a wall" in run("info", tmp_path, "--interlock")[2]
    with pytest.raises(InputError, match="courses"):
        interlock_of_stones(wall(4, 3), courses=0)
    with pytest.raises(InputError, match="tolerance: must not be negative"):
        interlock_of_stones(wall(4, 3), tolerance=-1.0)
