"""Two walls that meet at a corner: by hand, against detection, certified, drawn, and what is refused.

By hand: walls 3 m and 2 m long outside, 1.8 m high and 0.2 m deep, hold (3 + 2 - 0.2) 0.2 1.8 = 1.728 m3. Five quoins,
each 0.5 x 0.2 x 0.36 m, lie on each other with squares of 0.2 m, and the lowest on the ground with 0.5 x 0.2 m.

Mutants killed (by hand): the short cell's block taken; its contact with the ground, or the second wall's with a corner
stone, kept; the coping long at both walls; short cells of open joints shown; patterns improved without a check.
"""

import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly, detect
from cyclopean.assembly.checking import check_contacts
from cyclopean.design.walls import corner
from cyclopean.design.walls.corner import (
    corner_quoins,
    corner_wall,
    corner_with_open_joints,
    joint_score,
)
from cyclopean.design.walls.dressing import Coping, Quoins
from cyclopean.design.walls.interlock import interlock
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings, draw_pattern
from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults
from cyclopean.io import read_model
from cyclopean.view.wall_drawing import corner_svg
from laws import examples

DOOR = (Opening(0.9, 0.7, 1.1),)
ARCH = (Opening(1.2, 0.7, 1.2, 0.0, "arch"),)
SMALL = PatternSettings(columns=5, rows=4, courses=4)


def by_pair(contacts) -> dict:
    found: dict = {}
    for a, b, area in zip(contacts.a.tolist(), contacts.b.tolist(), contacts.area.tolist(), strict=True):
        found[min(a, b), max(a, b)] = found.get((min(a, b), max(a, b)), 0.0) + area
    return found


def extent(block) -> list:
    return [block.vertices.min(axis=0).round(12).tolist(), block.vertices.max(axis=0).round(12).tolist()]


def test_the_default_corner_by_hand() -> None:
    made = corner_wall(length=2.0)
    model, area = made.assembly, by_pair(made.assembly.contacts)
    assert model.mass.volume[1:].sum() == pytest.approx(1.728, abs=1e-12)
    stones = made.corner
    assert [model.blocks[k].id for k in stones] == [f"corner-{k:02d}" for k in range(1, 6)]
    assert [extent(model.blocks[k]) for k in stones[:2]] == [
        [[2.8, 0.0, 0.0], [3.0, 0.5, 0.36]],  # along the second wall
        [[2.5, 0.0, 0.36], [3.0, 0.2, 0.72]],  # along the first
    ]
    between = [area[min(a, b), max(a, b)] for a, b in pairwise(stones)]
    assert between == pytest.approx([0.04] * 4)
    assert [area.get((0, k), 0.0) for k in stones] == pytest.approx([0.1, 0.0, 0.0, 0.0, 0.0])
    ground = model.blocks[0]
    assert (ground.fixed, extent(ground)) == (True, [[-0.1, -0.1, -0.2], [3.1, 2.1, 0.0]])
    assert model.mass.volume[0] == pytest.approx(0.2 * (3.2 * 0.4 + 1.8 * 0.4))


def test_a_long_quoin_holds_the_fields_of_both_walls() -> None:
    """Its end and the side beside it are as large as the course is high: 0.2 x 0.36 m, in each wall."""
    made = corner_wall(PatternSettings(coursing=1.0), 2.0)
    area, model = by_pair(made.assembly.contacts), made.assembly
    for k in made.corner:
        for wall in ("w1", "w2"):
            beside = 0.0
            for a, b in area:
                other = a if b == k else b
                if k in (a, b) and model.blocks[other].id.startswith(wall):
                    beside += sum(
                        model.contacts.area[i]
                        for i in range(len(model.contacts))
                        if (model.contacts.a[i], model.contacts.b[i]) == (a, b)
                        and abs(model.contacts.frame[i, 0, 2]) < 0.1
                    )
            assert beside == pytest.approx(0.2 * 0.36)


@given(
    seed=st.integers(0, 10_000),
    coursing=st.sampled_from([0.0, 0.4, 1.0]),
    openings=st.sampled_from([(), DOOR, ARCH]),
    coping=st.sampled_from([None, Coping(), Coping(0.15, 0.8)]),
    ends=st.sampled_from([None, (True, True, None), (True, False, 0.3), (False, True, 0.25)]),
    depth=st.sampled_from([0.15, 0.2, 0.3]),
    length=st.sampled_from([1.3, 2.0, 3.7]),
)
@settings(max_examples=examples(25), deadline=None)
def test_joints_are_what_detection_finds(seed, coursing, openings, coping, ends, depth, length) -> None:
    quoins = None if ends is None else Quoins(0.5, depth, ends[2], left=ends[0], right=ends[1])
    made = corner_wall(
        PatternSettings(
            columns=6, rows=4, courses=4, seed=seed, coursing=coursing, openings=openings, coping=coping, quoins=quoins
        ),
        length,
        depth=depth,
        mu=0.7,
    )
    model, detected = made.assembly, detect(Assembly(made.assembly.blocks)).contacts
    ours, theirs = by_pair(model.contacts), by_pair(detected)
    assert ours.keys() == theirs.keys()
    assert max(abs(ours[k] - theirs[k]) for k in ours) < 1e-9
    assert len(ours) <= len(model.contacts) == made.joints.joints
    assert np.all(model.contacts.a < model.contacts.b)
    assert set(model.contacts.mu.tolist()) == {0.7}
    assert mesh_faults(model.mesh) == []
    _, distance, warnings = check_contacts(model, model.contacts)
    assert (distance < 1e-9, warnings) == (True, ())
    whole = (3.0 + length - depth) * depth * 1.8
    whole -= sum(1.8 * 3.0 - p.subdivision.areas().sum() for p in made.patterns[:1]) * depth
    assert model.mass.volume[1:].sum() == pytest.approx(whole, rel=1e-9)
    blocks = [k for number in made.block for k in number]
    assert sorted(set(blocks)) == list(range(1, len(model)))
    assert len(blocks) - len(set(blocks)) == len(made.corner)


@pytest.mark.parametrize("options", [{}, {"coping": Coping(), "openings": DOOR, "quoins": Quoins(0.6, 0.2)}])
def test_a_corner_stands_and_that_is_certified(options) -> None:
    made = corner_wall(PatternSettings(**options), 2.0)
    result = check(made.assembly, Settings(method="cra"))
    assert (result.verdict, result.warnings) == ("stable", ())


@pytest.mark.parametrize("courses", [4, 5])
def test_the_coping_turns_the_corner_as_one_more_quoin(courses) -> None:
    made = corner_wall(PatternSettings(courses=courses, coping=Coping()), 2.0)
    sizes = [np.ptp(made.assembly.blocks[k].vertices, axis=0) for k in made.corner]
    assert len(sizes) == courses + 1
    assert [bool(x > y) for x, y, _ in sizes] == [bool(k % 2) for k in range(courses + 1)]
    assert sizes[-1][2] == pytest.approx(0.12)


def test_the_walls_are_drawn_as_walls_are() -> None:
    made = corner_wall(PatternSettings(openings=DOOR), 2.0)
    first, second = (pattern.settings for pattern in made.patterns)
    assert (first.openings, second.openings) == (DOOR, ())
    assert (second.width, second.columns, second.seed, second.rows) == (2.0, 5, 8, 5)
    assert made.patterns[0].lines.tolist() == made.patterns[1].lines.tolist()
    assert made.patterns[1].subdivision.vertex.tobytes() == draw_pattern(second).subdivision.vertex.tobytes()
    assert {b.group for b in made.assembly.blocks} == {"ground", *(f"course-{k}" for k in range(1, 6))}
    again = corner_wall(PatternSettings(openings=DOOR), 2.0)
    assert again.assembly.mesh.vertex.tobytes() == made.assembly.mesh.vertex.tobytes()


def test_the_score_of_both_walls() -> None:
    made = corner_wall(length=2.0)
    one, two = (interlock(pattern) for pattern in made.patterns)
    lost = (one.aligned_length + two.aligned_length) / (one.head_length + two.head_length)
    assert joint_score(made) == pytest.approx(1.0 - lost)
    assert min(one.score, two.score) < joint_score(made) < max(one.score, two.score)


@pytest.mark.parametrize("chamfer", [0.0, 0.01])
def test_open_joints_are_as_wide_as_said_round_the_corner(chamfer) -> None:
    made = corner_wall(PatternSettings(coursing=1.0, coping=Coping()), 2.0)
    apart = Assembly(corner_with_open_joints(made, gap=0.01, chamfer=chamfer))
    assert [b.id for b in apart.blocks] == [b.id for b in made.assembly.blocks[1:]]
    assert mesh_faults(apart.mesh) == []
    assert len(detect(apart).contacts) == 0
    assert np.all(apart.mass.volume < made.assembly.mass.volume[1:])
    assert apart.mass.volume.sum() > 0.9 * 1.728
    low, high = np.array([extent(apart.blocks[k - 1]) for k in made.corner]).transpose(1, 0, 2)
    long = np.array([np.ptp(made.assembly.blocks[k].vertices[:, :2], axis=0).max() for k in made.corner])
    assert np.max(high - low, axis=1) == pytest.approx(long - 0.005)
    assert np.all(high[:, 0] == 3.0)  # the arris stays where it was
    assert np.all(low[:, 1] == 0.0)
    along_second = high[:, 1] > 0.2
    assert np.all(low[along_second, 0] == 2.8)
    assert high[~along_second, 1] == pytest.approx(0.2)
    field = [k for k in set(made.block[1]) - set(made.corner) if "w2-" in made.assembly.blocks[k].id]
    assert min(extent(apart.blocks[k - 1])[0][1] for k in field) == pytest.approx(0.21)


def test_an_improved_corner_is_one_that_stands(monkeypatch) -> None:
    asked: list[Assembly] = []

    def verdict(assembly: Assembly) -> str:
        asked.append(assembly)
        return "unstable" if len(asked) == 1 else "stable"

    monkeypatch.setattr(corner, "verdict", verdict)
    made = corner_wall(SMALL, 2.0, improve=True)
    assert made.chosen is not None
    assert made.chosen.place > 0
    assert made.chosen.verdict == "stable"
    assert made.assembly.mesh.vertex.tobytes() == asked[-1].mesh.vertex.tobytes()
    assert joint_score(made) >= joint_score(corner_wall(SMALL, 2.0))
    monkeypatch.setattr(corner, "verdict", lambda _: "stable")
    best = corner_wall(SMALL, 2.0, improve=True)
    assert best.chosen == corner.Chosen(0, "stable", None)
    assert joint_score(best) >= joint_score(made)
    assert corner_wall(SMALL, 2.0).chosen is None


def test_both_faces_are_drawn() -> None:
    made = corner_wall(length=2.0)
    svg = corner_svg(made, "a < b")
    assert svg.count('Z" fill="#') == sum(len(pattern.kind) for pattern in made.patterns)
    assert f"J = {joint_score(made):.3f}" in svg
    assert "a &lt; b" in svg
    tints = [f"#{k:06x}" for k in range(len(made.assembly))]
    painted = corner_svg(made, "tinted", tints=tints)
    counts = [painted.count(f'fill="{tint}"') for tint in tints]
    assert counts == [0, *(2 if k in made.corner else 1 for k in range(1, len(tints)))]
    stones = re.findall(r'd="M([^"]*)Z" fill="#', svg)
    x = [float(pair.split()[0]) for ring in stones for pair in ring.split("L")]
    assert min(x) >= 24.0
    assert max(x) <= 976.0


def test_a_corner_from_the_command_line(run) -> None:
    status, out, err = run("make", "polygonal", "--corner", "2.0", "--out", "F.json", "--display", "D.json")
    assert (status, err) == (0, "")
    assert "cells      65, 5 of them in both walls\n" in out
    assert out.count("\nwall ") == 2
    wanted = corner_wall(length=2.0)
    assert f"\nJ          {joint_score(wanted):.3f}\n" in out
    model, warnings = read_model("F.json")
    assert warnings == ()
    assert model.mesh.vertex.tolist() == wanted.assembly.mesh.vertex.tolist()
    assert model.contacts.point.tolist() == wanted.assembly.contacts.point.tolist()
    assert [b.id for b in read_model("D.json")[0].blocks] == [b.id for b in model.blocks[1:]]
    status, out, _ = run("check", "F.json", "--report", "page.html")
    assert (status, out.split(".")[0]) == (0, "Stands")
    status, out, _ = run("make", "polygonal", "--corner", "2", "--quoins", "auto", "--depth", "0.3", "--out", "F.json")
    assert status == 0
    ends = [b for b in read_model("F.json")[0].blocks if np.ptp(b.vertices[:, 0]) == pytest.approx(0.6)]
    assert ends  # twice the depth


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["--corner", "x"], "--corner: 'x' is not a number"),
        (["--corner", "0"], "--corner: must be more than 0"),
        (["--corner", "0.5"], "--corner: 0.5 m leaves nothing beside quoins"),
        (["--corner", "1e9"], "--corner: more than 50,000 stones"),
        (["--corner", "2", "--surface", "cylinder:5"], "--surface: walls that meet at a corner are flat"),
        (["--corner", "2", "--batter", "0.05"], "--batter: walls that meet at a corner are flat"),
        (["--corner", "2", "--warped", "plane"], "--warped: walls that meet at a corner are flat"),
        (["--corner", "2", "--base", "radius:9"], "--base: a corner needs level ground"),
        (["--corner", "2", "--quoins", "0.5,0.28"], "--quoins: short 0.28 m, but at a corner"),
        (["--corner", "2", "--quoins", "0.2,0.2"], "--quoins: long 0.2 m ties nothing"),
        (["--corner", "2", "--opening", "2,0,0.5,1"], "--opening: number 1 with its head reaches to 0.4 m"),
        (["--corner", "2", "--coping", "0.1,0.15"], "--corner: its stones do not lie along one wall"),
        (["--corner", "2", "--depth", "0"], "--depth: must be more than 0"),
    ],
)
def test_a_corner_that_cannot_be_made(run, argv, says, tmp_path) -> None:
    status, out, err = run("make", "polygonal", *argv, "--out", "w.json")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"cyclopean: error: {says}")
    assert not (tmp_path / "w.json").exists()


def test_quoins_for_a_corner() -> None:
    assert corner_quoins(0.2) == Quoins(0.5, 0.2, left=False)
    assert corner_quoins(0.4).long == 0.8
    with pytest.raises(InputError, match="quoins: a corner needs them; leave those at the right end"):
        Quoins(right=False, corner="right")
    with pytest.raises(InputError, match="depth: must be more than 0"):
        corner_quoins(-1.0)
