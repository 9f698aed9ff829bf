"""Checking a model that grew: the known state is a guess, and the verdict is that of a check from nothing."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis import (
    CONTINUED,
    Bounds,
    Known,
    PreparedModel,
    Result,
    Settings,
    check,
    mobile,
    prepare,
    recheck,
)
from cyclopean.analysis.coupled.kkt import Doubled
from cyclopean.analysis.coupled.states import measure
from cyclopean.analysis.warm_start.inward import inward
from cyclopean.analysis.warm_start.region import around, region, way_down
from cyclopean.analysis.warm_start.seating import seated
from cyclopean.assembly import Assembly
from cyclopean.design import stack, wall
from cyclopean.design.construction import sequence
from cyclopean.design.construction.sequence import build_sequence
from cyclopean.design.construction.stages import Stage, stage_of, verdict
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.errors import InputError
from cyclopean.proof import Memory, verify
from cyclopean.statics import Schur
from laws import examples
from sequence_cases import four_legs


def posed(model: Assembly, said: Settings = Settings()) -> PreparedModel:  # noqa: B008  frozen
    return prepare(model, said)


def without(whole: PreparedModel, gone: list[int]) -> Stage:
    standing = np.ones(len(whole.assembly), bool)
    standing[gone] = False
    return stage_of(whole, standing)


def same(result: Result) -> Known:
    return Known(result, np.arange(len(result.assembly)), np.arange(len(result.contacts.point)))


def test_a_tower_grows_by_its_top():
    """By hand: every stone presses the one below by all weight above; nine are more than are seated anew."""
    whole = posed(stack(9))
    before = without(whole, [9])
    known = verdict(before, Settings())
    after = stage_of(whole, np.ones(10, bool))
    found = verdict(after, Settings(), (before, known))
    weight = 2400.0 * 9.80665 * whole.assembly.mass.volume[9]
    carried = np.add.reduceat(found.force[:, 0], found.contacts.start[:-1])
    assert found.provenance["route"] == CONTINUED
    assert sorted(carried.tolist()) == pytest.approx([k * weight for k in range(1, 10)])
    assert verify(found.certificate).proved


def test_a_stone_is_seated_an_eps_deep_with_its_weight_on_what_is_below():
    """By hand: the upper of two cubes, the lower held where it is, turned by nothing and sunk by 3 eps."""
    model = posed(stack(2))
    system = model.system()
    start = np.zeros((2, 6))
    start[0, 2] = -3.0
    f, dq = seated(system, Bounds(), np.array([1]), np.zeros(8, bool), np.zeros((8, 3)), start.ravel())
    between = (system.row_a >= 0) & (system.row_b >= 0)
    assert f[between, 0].sum() == pytest.approx(1.0)  # mean block weight
    assert not f[~between].any()
    assert dq.reshape(2, 6)[1] == pytest.approx([0, 0, -4, 0, 0, 0], abs=1e-6)
    assert around(system, np.array([1]), 1).tolist() == [0, 1]


def test_a_state_is_a_state_of_the_same_model():
    whole = posed(wall(3, 2))
    first = recheck(whole, Settings())
    again = recheck(whole, Settings(), same(first))
    assert (again.verdict, again.provenance["route"]) == ("stable", CONTINUED)


@given(seed=st.integers(0, 10_000), columns=st.integers(3, 5), rows=st.integers(2, 3), mu=st.sampled_from([0.5, 0.84]))
@settings(max_examples=examples(12), deadline=None)
def test_a_grown_wall_has_the_verdict_of_a_check_from_nothing(seed, columns, rows, mu):
    size = PatternSettings(columns=columns, rows=rows, courses=rows, width=0.4 * columns, height=0.4 * rows, seed=seed)
    model = polygonal_wall(size).assembly
    said = Settings(mu=mu, seconds=5.0)
    whole = posed(model, said)
    top = int(np.argmax(whole.assembly.mass.centroid[:, 2]))
    before = without(whole, [top])
    known = verdict(before, said)
    found = verdict(stage_of(whole, np.ones(len(model), bool)), said, (before, known))
    assert found.verdict == check(model, said).verdict
    if found.verdict == "stable":
        assert verify(found.certificate).proved


@given(scale=st.floats(-5.0, 5.0), seed=st.integers(0, 10_000))
@settings(max_examples=examples(15), deadline=None)
def test_what_is_known_is_only_a_guess(scale, seed):
    """Whatever the known state says, a stage that falls is not called stable, and one that stands has a proof."""
    random = np.random.default_rng(seed)
    model = four_legs()
    whole = posed(model)
    names = [block.id for block in model.blocks]
    standing = without(whole, [names.index("key"), *(names.index(f"upper-{k}") for k in range(4))])
    known = verdict(standing, Settings())
    noise = scale * random.standard_normal(known.force.shape)
    wrong = replace(known, force=known.force * noise, displacement=known.displacement + scale)
    falls = without(whole, [names.index("key"), *(names.index(f"upper-{k}") for k in range(3))])
    assert verdict(falls, Settings(seconds=2.0), (standing, wrong)).verdict == "unstable"
    stands = verdict(standing, Settings(seconds=2.0), (standing, wrong))
    assert stands.verdict == "stable"
    assert verify(stands.certificate).proved


def test_a_mechanism_moves_the_leg_that_topples():
    """The upper stone goes over, and may push out the one that it stands on; the other legs stay."""
    model = four_legs()
    names = [block.id for block in model.blocks]
    stage = without(posed(model), [names.index("key"), *(names.index(f"upper-{k}") for k in range(3))])
    moves = mobile(stage.model, Settings())
    names = {stage.model.assembly.blocks[i].id for i in moves}
    assert "upper-3" in names
    assert names <= {"upper-3", "lower-3"}
    assert mobile(posed(stack(2)), Settings()) is None


@pytest.mark.parametrize(
    ("block", "point", "message"),
    [
        ([0, 1], [], "known blocks: 2 places for the 3 of the known result"),
        ([0, 1, 2], [], "known points: 0 places"),
        ([0, 1, 3], None, "known blocks: a place that the model, with 3 of them, does not have"),
        ([0, 1, -2], None, "known blocks: a place"),
    ],
)
def test_refused(block, point, message):
    whole = posed(stack(2))
    result = recheck(whole, Settings())
    places = np.arange(len(result.contacts.point)) if point is None else np.array(point, int)
    with pytest.raises(InputError, match=message):
        recheck(whole, Settings(), Known(result, np.array(block), places))


def test_a_region_is_its_blocks_with_the_rest_held():
    """By hand: of a tower of four the upper two, with the joint below them as rim; the way down is all of it."""
    model = posed(stack(4))
    system = model.system()
    assert way_down(system, np.array([3])).tolist() == [0, 1, 2, 3]
    upper = region(system, np.array([2, 3]))
    assert (upper.part.blocks, upper.part.points, int(upper.rim.sum())) == (2, 8, 4)
    dq = np.random.default_rng(3).standard_normal(24)
    assert upper.given(system, dq) + upper.part.gap(dq[upper.dof]) == pytest.approx(system.gap(dq)[upper.point])


def test_steps_in_a_region_leave_the_rest_as_it_is():
    """The top stone is shaken; what is outside its region, and what presses on that, stays to the last bit."""
    model = posed(wall(3, 3))
    system = model.system()
    known = recheck(model, Settings())
    f = known.force[system.used] / system.force_unit
    rows = known.displacement[system.free] / Settings().eps
    rows[:, 3:] *= system.length_unit
    blocks = around(system, np.array([system.blocks - 1]), 1)
    at = region(system, blocks)
    assert 0 < len(blocks) < system.blocks
    assert at.rim.any()
    shaken = rows.ravel().copy()
    shaken[at.dof] += 1e-4 * np.random.default_rng(1).standard_normal(len(at.dof))
    assert not measure(system, Bounds(), f, shaken).accepted
    near, moved, found = inward(system, at, Doubled(Schur(at.part)), Bounds(), f, shaken)
    assert found.accepted
    outside = np.setdiff1d(np.arange(system.points), at.point[~at.rim])
    assert np.array_equal(near[outside], np.where(f[outside, :1] > 1e-9, f[outside], 0.0))
    assert np.array_equal(np.delete(moved, at.dof), np.delete(shaken, at.dof))


def test_runs_of_stages_have_the_same_answers_side_by_side(monkeypatch) -> None:
    monkeypatch.setattr(sequence, "RUN", 4)  # so that a small wall has several
    model = wall(3, 3)
    alone = build_sequence(model)
    with ThreadPoolExecutor(2) as executor:
        beside = build_sequence(model, executor=executor)
    assert [s.verdict for s in beside.steps] == [s.verdict for s in alone.steps] == ["stable"] * len(alone.steps)
    assert [s.seal for s in beside.steps] == [s.seal for s in alone.steps]
    assert [s.reason for s in beside.steps] == [s.reason for s in alone.steps]
    assert [k for k, s in enumerate(alone.steps) if not s.warm] == list(range(0, len(alone.steps), 4))


def test_every_stage_is_proved_by_a_whole_certificate() -> None:
    """What the checker remembers of other stages changes none of its answers."""
    seen: list[Result] = []
    build_sequence(wall(3, 2), watch=lambda _, result: seen.append(result))
    assert len(seen) == 7
    for result in seen:
        assert verify(result.certificate) == verify(result.certificate, Memory())
        assert verify(result.certificate).proved
