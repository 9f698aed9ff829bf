"""The building of small structures, by hand: order, layers, ways in, verdicts of stages, props."""

from dataclasses import replace

import numpy as np
import pytest

from cyclopean.analysis import Settings, check
from cyclopean.analysis.preparation import prepare
from cyclopean.assembly import Assembly, Block, Load
from cyclopean.design import arch, stack, wall
from cyclopean.design.construction.options import SequenceOptions
from cyclopean.design.construction.props import _Episode
from cyclopean.design.construction.sequence import BuildSequence, build_sequence, dot_text
from cyclopean.errors import InputError
from sequence_cases import box, diamond, four_legs, interlocked


def told(found: BuildSequence) -> list[tuple[str, int, str, tuple[str, ...]]]:
    """Stone, layer, verdict and props of every step."""
    ids = [block.id for block in found.assembly.blocks]
    return [(ids[s.block], s.layer, s.verdict, tuple(ids[i] for i in s.props)) for s in found.steps]


def test_a_tower_goes_up_stone_by_stone():
    found = build_sequence(stack(3))
    assert told(found) == [("b01", 1, "stable", ()), ("b02", 2, "stable", ()), ("b03", 3, "stable", ())]
    assert found.first_unstable is None
    assert [s.free.tolist() for s in found.steps] == [[0, 0, 1]] * 3
    assert {s.proof for s in found.steps} == {"cra-state"}
    assert [s.warm for s in found.steps] == [False, True, True]
    assert len(set(found.colour.tolist())) == 2  # a chain needs two


def test_a_running_bond_wall_goes_up_course_by_course_from_left_to_right():
    found = build_sequence(wall(3, 2))
    names = ["c01-b01", "c01-b02", "c01-b03", "c02-b01", "c02-b02", "c02-b03", "c02-b04"]
    assert told(found) == [(name, int(name[2]), "stable", ()) for name in names]
    ids = [b.id for b in found.assembly.blocks]
    assert [ids[i] for i in found.steps[4].rests_on] == ["c01-b01", "c01-b02"]
    half = [e.support for e in found.graph.edges if ids[e.upper] == "c02-b02"]
    assert half == pytest.approx([0.2 * 0.2] * 2)  # half a stone of 0.4 m, 0.2 m deep, on each


def test_a_diamond_slides_until_its_sides_are_held():
    """Joints of 45 degrees with mu 0.84 < tan 45: each side slides; held, they make a V that the top sits in."""
    found = build_sequence(diamond())
    assert told(found) == [
        ("left", 1, "unstable", ("left",)),
        ("right", 1, "unstable", ("left", "right")),
        ("top", 2, "unstable", ("left", "right")),
    ]
    assert all(s.smallest and s.propped == "stable" for s in found.steps)
    assert found.first_unstable == 0


def test_a_diamond_of_rough_stone_stands_in_part():
    """With mu 1.2 a square bears on all of its face and does not slide; the top pushes the sides apart."""
    verdicts = [s.verdict for s in build_sequence(diamond(), Settings(mu=1.2)).steps]
    assert verdicts[:2] == ["stable", "stable"]


def test_an_interlocked_pair_is_a_cycle_broken_at_its_weaker_joint():
    found = build_sequence(interlocked())
    (cycle,) = found.graph.cycles
    ids = [b.id for b in found.assembly.blocks]
    assert [ids[i] for i in cycle.blocks] == ["a", "b"]
    assert [(ids[e.upper], ids[e.lower], e.support) for e in cycle.broken] == [("a", "b", pytest.approx(0.5))]
    ((edge, order),) = cycle.alternatives
    assert (ids[edge.upper], ids[edge.lower], edge.support) == ("b", "a", pytest.approx(1.0))
    assert [ids[i] for i in order] == ["b", "a"]
    assert [row[:2] for row in told(found)] == [("a", 1), ("b", 2)]
    free = found.steps[1].free
    assert free[2] == pytest.approx(0.0, abs=1e-9)  # neither up nor down: the lip is above, the mouth below
    assert free[0] >= -1e-9
    assert {e.upper for e in found.graph.kept} == {1, 2}


def test_a_four_legged_arch_needs_centring_until_its_key_is_in():
    """Lower voussoirs stand: their centre, 4.29 m out, is over the springing, 4 to 5 m. Upper ones, centre 2.74 m out,
    topple over the inner edge of their joint, 3.28 m out, one after the other; the key closes two arches of thickness
    0.22 r, twice what a semicircle needs.
    """
    rows = told(build_sequence(four_legs()))
    assert [row[1] for row in rows] == [1] * 4 + [2] * 4 + [3]
    assert {row[0] for row in rows[:4]} == {f"lower-{k}" for k in range(4)}
    assert [row[2] for row in rows] == ["stable"] * 4 + ["unstable"] * 4 + ["stable"]
    uppers = [row[0] for row in rows[4:8]]
    assert [set(row[3]) for row in rows[4:]] == [set(uppers[: k + 1]) for k in range(4)] + [set()]


def test_an_arch_is_held_at_the_last_stone_of_each_side():
    found = build_sequence(arch(7))
    assert [row[0] for row in told(found)] == ["v01", "v07", "v02", "v06", "v03", "v05", "v04"]
    held = ["v02", "v06", "v03", "v05"]
    assert [row[3] for row in told(found)[2:]] == [*(tuple(held[: k + 1]) for k in range(4)), ()]
    (prop,) = found.props
    assert prop.said([block.id for block in found.assembly.blocks]) == (
        "centring under 'v02', 'v06', 'v03', 'v05' from step 3 until the keystone 'v04' is in, step 7"
    )
    assert found.least_props == 4


@pytest.mark.parametrize("method", ["rbe", "cra"])
def test_a_stage_is_what_a_check_of_the_part_says(method):
    """The last stage is the whole; a stage in between the same model without the later stones."""
    model = arch(5)
    settings = Settings(method=method)
    found = build_sequence(model, settings)
    for k in (0, 2, 3, len(found.steps) - 1):
        there = set(found.order[: k + 1]) | set(np.flatnonzero(found.fixed))
        part = Assembly(tuple(b for i, b in enumerate(model.blocks) if i in there))
        assert check(part, settings).verdict == found.steps[k].verdict


def test_props_come_with_a_proof_that_fewer_do_not_do():
    """Where one block is held in place of the two found, the model falls."""
    model = arch(7)
    found = build_sequence(model)
    step = found.steps[3]
    assert step.smallest
    there = [i for i in range(len(model)) if found.fixed[i] or i in found.order[:4]]
    for prop in found.order[:4]:
        part = Assembly(tuple(replace(model.blocks[i], fixed=bool(found.fixed[i]) or i == prop) for i in there))
        assert check(part).verdict == "unstable"


def test_mechanisms_are_made_small_before_they_are_counted():
    """With all four upper voussoirs laid, each topples by itself: four mechanisms of one stone, so four props."""
    model = four_legs()
    episode = _Episode(prepare(model, Settings()), Settings(), range(4, 13), range(4, 8), ())
    assert episode.bounded() == (frozenset({8, 9, 10, 11}), 4)
    assert sorted(episode.mechanisms) == [[8], [9], [10], [11]]


def test_a_stone_that_hangs_in_the_air_is_what_is_held():
    model = Assembly((box("ground", (0, 1), (0, 1), True), box("cloud", (3, 4), (2, 3))))
    assert told(build_sequence(model)) == [("cloud", 1, "unstable", ("cloud",))]


def test_all_supports_is_nothing_to_build():
    found = build_sequence(Assembly((box("a", (0, 1), (0, 1), True),)))
    assert (found.steps, found.first_unstable) == ((), None)


def test_loads_act_from_the_stage_at_which_their_stone_is_laid():
    model = stack(2, mu=0.5)
    push = Load(2, np.array([1e6, 0.0, 0.0]), model.mass.centroid[2])
    assert [row[2] for row in told(build_sequence(replace(model, loads=(push,))))] == ["stable", "unstable"]


def test_up_is_against_gravity():
    """The tower lies along x and so does gravity."""
    tower = stack(2)
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    model = Assembly(tuple(replace(b, vertices=b.vertices @ turn.T) for b in tower.blocks))
    found = build_sequence(model, Settings(gravity=(-9.8, 0.0, 0.0)))
    assert told(found) == [("b01", 1, "stable", ()), ("b02", 2, "stable", ())]
    assert found.up.tolist() == [1, 0, 0]
    assert found.along @ found.up == 0.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"bearing": 1.0}, "bearing 1: "),
        ({"bearing": float("nan")}, "bearing nan: "),
        ({"clearance": 0.0}, "clearance 0: "),
        ({"order": ["b01", "none"]}, "block 'none' is not in the model"),
        ({"order": ["b01", "b01"]}, "block 'b01' is named more than once"),
        ({"order": []}, "block 'b01' is missing"),
        ({"order": [7]}, "block '7' is not in the model"),
    ],
)
def test_refused(options, message):
    with pytest.raises(InputError, match=message):
        build_sequence(stack(1), wanted=SequenceOptions(**options))


def test_without_gravity_there_is_no_order():
    with pytest.raises(InputError, match="without gravity"):
        build_sequence(stack(1), Settings(gravity=(0.0, 0.0, 0.0)))


def test_an_open_mesh_is_refused():
    open_box = Block("b", box("b", (0, 1), (0, 1)).vertices, box("b", (0, 1), (0, 1)).faces[1:])
    with pytest.raises(InputError, match="block 'b' is open"):
        build_sequence(Assembly((open_box,)))


def test_the_graph_in_dot():
    text = dot_text(build_sequence(interlocked()))
    assert text.startswith("digraph building {\n")
    assert '"a" -> "b" [label="0.5", style=dashed];' in text
    assert '"b" -> "a" [label="1"];' in text
    assert '"ground" [shape=box];' in text
