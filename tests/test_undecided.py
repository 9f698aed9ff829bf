"""What is said of a model that coupled analysis leaves undecided.

By hand: a prism between two walls that lean outwards by `lean` (x per z) rests on two faces at 90 - atan(lean) degrees
from level. With mu = 0.5 friction reaches 26.57 degrees.
"""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean.analysis.what_would_decide as trials
from coupled_cases import beams, shaft
from cyclopean.analysis import Settings, check
from cyclopean.analysis.coupled.search import CoupledOutcome
from cyclopean.analysis.preparation import prepare
from cyclopean.analysis.undecided import Fold, Undecided, folds_at, listed, recut_of
from cyclopean.analysis.what_would_decide import what_would_decide
from cyclopean.proof import verify
from laws import examples
from test_smallest_eta import let_down


def wedge(lean, **said):
    """The prism and its contacts, prepared."""
    return prepare(beams(0.5, 0.6, 0.4, lean=lean), Settings(mu=0.5, **said))


def test_a_wedge_by_hand():
    model = wedge(0.5)
    (fold,) = folds_at(model, range(8))
    assert fold.block == "beam0"
    assert fold.neighbours in (("left",), ("right",))  # the face that is not the best; they are alike
    assert fold.faces == pytest.approx([63.4349488] * 2)
    assert fold.friction == pytest.approx(26.5650512)
    assert fold.words().startswith("stone 'beam0' rests on faces steeper than friction (63 degrees against 27) and")
    assert recut_of(model, [fold]).words().endswith("' lies at 63 degrees and would carry it at 26")


@settings(max_examples=examples(60), deadline=None)
@given(st.floats(-1.5, 1.5), st.floats(0.0, 60.0), st.floats(0.0, 360.0))
def test_angles_are_those_between_faces_and_gravity(lean, tilt, azimuth):
    """Of every face that looks down along gravity, whatever way it is numbered, and of no other."""
    model = wedge(lean, tilt=(tilt, azimuth))
    (fold,) = folds_at(model, range(8))
    outward = [np.array([sign, 0.0, -lean]) / np.hypot(1.0, lean) for sign in (-1.0, 1.0)]  # of the prism's two faces
    down = model.gravity / np.linalg.norm(model.gravity)
    angles = sorted(np.degrees(np.arccos(np.clip(n @ down, -1.0, 1.0))) for n in outward if n @ down > 1e-6)
    if fold.steep:
        assert fold.faces == pytest.approx(angles, abs=1e-6)
    assert fold.steep == (not angles or angles[0] > fold.friction)


def test_a_stone_on_a_flat_bed_is_no_such_stone():
    model = prepare(shaft(1.0, 1.0, 0.5), Settings(mu=0.5))
    (fold,) = folds_at(model, range(8))
    assert not fold.steep
    assert fold.words() == "the search ends at the joint of 'beam0' and 'left'"
    assert recut_of(model, [fold]) is None


def test_what_hangs_between_upright_faces_rests_on_nothing():
    model = prepare(beams(0.3, 0.3, 0.4), Settings())
    (fold,) = folds_at(model, [5])
    assert fold.words() == "stone 'beam0' rests on nothing and stands only if 'left' and 'right' jam it"
    assert recut_of(model, [fold]) is None


def test_steep_stones_come_first_and_few_are_told():
    model = prepare(beams(0.5, 0.6, 0.4, count=7, lean=0.5), Settings(mu=0.5))
    names = [fold.block for fold in folds_at(model, range(len(model.contacts.point)))]
    assert len(names) == 3
    assert names == list(dict.fromkeys(names))
    assert folds_at(model, []) == ()


def test_the_reason_begins_with_why_and_tells_the_rest():
    known = Undecided("It is open.", "undecided", 10.0, folds=(Fold("a", (40.0,), 30.0, ("b",)),))
    assert known.reason() == (
        "It is open. Rigid-block equilibrium alone says undecided. Stone 'a' rests on a face steeper than friction"
        " (40 degrees against 30) and stands only if 'b' jams it. More `seconds` and `nodes`, a larger `eta` or other"
        " friction may decide it."
    )
    assert listed([str(k) for k in range(6)]) == "'0', '1', '2', '3' and 2 more"


def left_open(half, height, mu, **said):
    """A beam between walls that the search leaves open, prepared, and what is known of it."""
    chosen = Settings(mu=mu, nodes=1, **said)
    model = beams(half, height, 0.4)
    return prepare(model, chosen), chosen, check(model, chosen)


def test_trials_are_proved_and_by_hand():
    """It needs mu = h / a = 1 and, with a / h = 4, eta = 16.01 eps; 0.84 x 1.25 = 1.05."""
    model, chosen, open_ = left_open(1.0, 0.25, 0.84)
    assert open_.verdict == "undecided"
    found = what_would_decide(model, chosen, open_)
    assert found.verdict == "undecided"
    assert found.undecided.stable_at.eta == 16.02
    assert verify(found.undecided.stable_at.certificate).proved
    assert not verify(found.undecided.stable_at.certificate | {"eta": 16.0}).proved
    assert found.undecided.friction is None  # none would do
    model, chosen, open_ = left_open(0.3, 0.3, 0.84)
    found = what_would_decide(model, chosen, open_)
    assert found.undecided.stable_at is None
    assert found.undecided.friction.mu == 1.05


def test_nothing_is_tried_once_the_time_is_up():
    model, chosen, open_ = left_open(1.0, 0.25, 0.84)
    found = what_would_decide(model, chosen, open_, until=time.perf_counter())
    assert found.undecided.untried == ("a larger eta", "more friction")
    assert found.undecided.stable_at is None
    assert "There was no time to try a larger eta and more friction" in found.reason


def test_a_state_that_needs_no_more_than_was_asked_for_is_the_verdict(monkeypatch):
    model, _, f, dq = let_down(1.0, 1.0, 30.0)
    chosen = Settings(mu=3.0)
    monkeypatch.setattr(trials, "_searched", lambda *_: CoupledOutcome("coupled", f, dq))
    open_ = replace(check(beams(1.0, 1.0, 0.7), chosen), verdict="undecided", undecided=Undecided("", "stable", 10.0))
    found = what_would_decide(model, chosen, open_)
    assert found.verdict == "stable"
    assert found.undecided is None
    assert verify(found.certificate).proved
    assert found.certificate["eta"] == 10.0


def test_what_is_no_state_is_not_proved(monkeypatch):
    model, _, f, dq = let_down(1.0, 0.25, 30.0)
    chosen = Settings(mu=3.0)
    monkeypatch.setattr(trials, "_searched", lambda *_: CoupledOutcome("coupled", f, dq))
    monkeypatch.setattr(trials, "smallest_eta", lambda *_: (12.0, f, dq))  # which moves 46 eps
    open_ = replace(check(beams(1.0, 1.0, 0.7), chosen), verdict="undecided", undecided=Undecided("", "stable", 10.0))
    found = what_would_decide(model, chosen, open_)
    assert found.verdict == "undecided"
    assert found.undecided.stable_at is None
