"""Samples of a model whose data are not quite known.

By hand. A cube of side 1 on a slope of angle theta stands exactly when mu >= tan theta (and theta < 45 degrees). So for
every friction drawn the verdict is known, and over mu from 0.2 to 1.0 with tan theta = 0.6 half of all samples stand.
On level ground a cube tilted towards any azimuth by less than 45 degrees stands exactly when tan(tilt) <= mu.

A square joint of side a worn by d is a square of side a - 2 d. The confidence interval of 8 hits in 10 is 0.4439 to
0.9748 (Clopper and Pearson 1934, the beta quantiles that every table has).
"""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Range, Sampling, Settings, ranges_of, sensitivity, share_between
from cyclopean.analysis.preparation import prepare
from cyclopean.analysis.sensitivity_study.ranges import drawn, varied
from cyclopean.analysis.sensitivity_study.throughout import corners
from cyclopean.assembly import Contacts, Load, worn
from cyclopean.design import stack, wall
from cyclopean.errors import InputError
from cyclopean.io import sensitivity_dict
from cyclopean.view.sensitivity_chart import sensitivity_section
from laws import examples

RBE = Settings(method="rbe")
CUBE = stack(1)


def test_a_cube_on_a_slope_stands_as_its_friction_says():
    slope = float(np.rad2deg(np.arctan(0.6)))
    found = sensitivity(CUBE, Sampling(ranges_of(["mu=0.2:1.0"]), 60, 3), replace(RBE, tilt=(slope, 30.0)))
    mu = found.values[:, 0]
    assert [word == "stable" for word in found.words] == (mu >= 0.6).tolist()
    assert found.count["stable"] + found.count["unstable"] == 60
    low, estimate, high = found.probability
    assert low < 0.5 < high
    assert estimate == np.mean(mu >= 0.6)
    assert found.throughout == "unstable"  # mu = 0.2 is within the range


@pytest.mark.parametrize("method", ["rbe", "cra"])
def test_a_cube_tilted_towards_any_azimuth_slides_at_its_friction(method):
    found = sensitivity(CUBE, Sampling(ranges_of(["tilt=0:40", "mu=0.5"]), 24, 1), Settings(method=method))
    expected = np.tan(np.deg2rad(found.values[:, 0])) <= 0.5
    assert [word == "stable" for word in found.words] == expected.tolist()
    assert 0 < expected.sum() < 24


def test_a_worn_square_by_hand():
    square = np.array([[0, 0, 2], [3, 0, 2], [3, 3, 2], [0, 3, 2]], float)
    joint = Contacts.of([(0, 1), (0, 1)], [square, square + np.array([5, 0, 0])], [0.5, None])
    left, origin = worn(joint, np.array([0.5, 2.0]))
    assert origin.tolist() == [0]  # the second is gone: 2 x 2.0 > 3
    assert left.area.tolist() == pytest.approx([4.0])
    assert sorted(map(tuple, left.polygon(0).round(12).tolist())) == [
        (x, y, 2.0) for x in (0.5, 2.5) for y in (0.5, 2.5)
    ]
    assert left.frame[0, 0].tolist() == pytest.approx([0, 0, 1])
    assert left.mu.tolist() == [0.5]


@settings(deadline=None)
@given(depth=st.floats(0.0, 0.2), more=st.floats(0.0, 0.2), turn=st.floats(0.0, 6.0), shift=st.floats(-1e3, 1e3))
def test_deeper_wear_leaves_less_and_in_the_same_plane(depth, more, turn, shift):
    shape = np.array([[0, 0, 0], [1, 0, 0], [1.2, 0.8, 0], [0.3, 1.1, 0]], float)
    c, s = np.cos(turn), np.sin(turn)
    joint = Contacts.of([(0, 1)], [shape @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) + shift])
    once, _ = worn(joint, np.array([depth]))
    twice, _ = worn(joint, np.array([depth + more]))
    assert twice.area.sum() <= once.area.sum() + 1e-9 <= joint.area.sum() + 2e-9
    for left in (once, twice):
        height = (left.point - joint.point[0]) @ joint.frame[0, 0]
        assert np.abs(height).max(initial=0.0) <= 1e-9


def test_the_same_samples_whoever_computes_them():
    ranges = ranges_of(["mu=0.3:0.7", "density-each=2000:2600", "joints=0:0.1"])
    model = replace(RBE, tilt=(20.0, 0.0))
    alone = sensitivity(stack(2), Sampling(ranges, 40, 5), model)
    with ThreadPoolExecutor(3) as executor:
        shared = sensitivity(stack(2), Sampling(ranges, 40, 5), model, executor=executor)
    assert np.array_equal(alone.values, shared.values)
    assert alone.words == shared.words
    assert not np.array_equal(alone.values, sensitivity(stack(2), Sampling(ranges, 40, 6), model).values)


def test_a_sample_does_not_depend_on_those_before_it():
    """Each begins from what its neighbour came to; the verdict is that of a check from nothing."""
    ranges = ranges_of(["mu=0.4:0.6", "tilt=20:30"])
    found = sensitivity(stack(2), Sampling(ranges, 32, 2), RBE)
    model = prepare(stack(2), RBE)
    from cyclopean.analysis import recheck

    for k in range(0, 32, 5):
        assert recheck(varied(model, drawn(ranges, model, 2, k)), RBE).verdict == found.words[k]
    assert {"stable", "unstable"} <= set(found.words)


@settings(max_examples=examples(8), deadline=None)
@given(
    mu=st.floats(0.3, 0.8),
    tilt=st.floats(0.5, 12.0),
    wear=st.floats(0.0, 0.05),
    push=st.floats(-3e3, 3e3),
    loaded=st.booleans(),
)
def test_what_is_proved_throughout_holds_for_every_sample(mu, tilt, wear, push, loaded):
    model = stack(2)
    if loaded:
        top = len(model) - 1
        model = replace(model, loads=(Load(top, [push, 0.0, -500.0], model.mass.centroid[top]),))
    ranges = (Range("mu", mu, 0.9), Range("tilt", 0.0, tilt), Range("joints", 0.0, wear), Range("density", 1800, 2600))
    found = sensitivity(model, Sampling(ranges, 10), RBE)
    if found.throughout == "stable":
        assert set(found.words) == {"stable"}


def test_what_stands_with_room_to_spare_is_proved_throughout():
    model = wall(3, 2)
    found = sensitivity(model, Sampling(ranges_of(["mu=0.6:0.9", "tilt=0:3", "density-each=2000:2400"]), 0), RBE)
    assert found.throughout == "undecided"  # 2^8 densities times 16 tilts are too many to try
    found = sensitivity(
        model, Sampling(ranges_of(["mu=0.6:0.9", "tilt=0:3", "density=2000:2400", "joints=0:0.01"]), 0), RBE
    )
    assert found.throughout == "stable"
    assert "16 corners" in found.why
    assert found.words == ()
    assert sensitivity_dict(found)["probability"] is None


@settings(deadline=None)
@given(tilt=st.floats(0.1, 60.0), azimuth=st.floats(0.0, 360.0), share=st.floats(0.0, 1.0), rho=st.floats(2000, 2500))
def test_the_corners_surround_every_weight(tilt, azimuth, share, rho):
    """Weights times gravity lie in the convex hull of the corners' (loads present, so that sizes matter)."""
    from scipy.optimize import linprog

    model = replace(CUBE, loads=(Load(1, [0, 0, -1.0], CUBE.mass.centroid[1]),))
    posed = prepare(model, RBE)
    ranges = (Range("tilt", 0.0, tilt), Range("density", 2000, 2500))
    around = np.array([c.gravity * c.assembly.blocks[1].density for c in corners(posed, ranges)])
    case = varied(posed, {"tilt": np.array([share * tilt, azimuth]), "density": np.array([rho])})
    inside = case.gravity * rho
    matrix = np.vstack([around.T / 2e4, np.ones(len(around))])
    answer = linprog(np.zeros(len(around)), A_eq=matrix, b_eq=np.append(inside / 2e4, 1.0))
    assert answer.status == 0


def test_too_many_corners_are_no_proof():
    model = prepare(wall(5, 4), RBE)
    assert corners(model, ranges_of(["density-each=2000:2400"])) is None
    sticky = replace(model, contacts=model.contacts.with_tension(1e3))
    assert corners(sticky, ranges_of(["joints=0:0.01"])) is None
    assert corners(sticky, ranges_of(["mu=0.5:0.6"])) is not None
    leaning = replace(model, gravity=np.array([1.0, 0.0, -9.0]))
    assert corners(leaning, ranges_of(["tilt=0:2"])) is None


def test_share_between_by_hand():
    assert share_between(8, 10) == pytest.approx((0.4439, 0.9748), abs=5e-5)
    assert share_between(10, 10)[1] == 1.0
    assert share_between(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("mu", "expected QUANTITY=LOW:HIGH"),
        ("mu=0.5:x", "expected QUANTITY=LOW:HIGH"),
        ("mu=0.8:0.5", "the lower one first"),
        ("mu=nan:1", "finite"),
        ("nu=0.5:0.8", "expected one of mu"),
        ("mu=-0.1:0.8", "0 or more"),
        ("density=0:2400", "more than 0"),
        ("tilt=0:90", "less than 90"),
    ],
)
def test_a_range_that_is_none_is_refused(text, why):
    with pytest.raises(InputError, match=why):
        ranges_of([text])


def test_nothing_twice_and_nothing_at_all():
    with pytest.raises(InputError, match="given twice"):
        ranges_of(["mu=0.5:0.6", "mu-each=0.5:0.6"])
    with pytest.raises(InputError, match="nothing varies"):
        sensitivity(CUBE, Sampling(()), RBE)
    with pytest.raises(InputError, match="expected 0 to"):
        sensitivity(CUBE, Sampling(ranges_of(["mu=0.5"]), -1), RBE)
    with pytest.raises(InputError, match="none of them negative"):
        worn(Contacts.of([(0, 1)], [np.eye(3)]), np.array([-1.0]))


def test_the_page_and_the_file_say_the_same():
    found = sensitivity(
        CUBE, Sampling(ranges_of(["mu=0.2:0.8", "density=2000:2400"]), 20), replace(RBE, tilt=(25.0, 0.0))
    )
    data = json.loads(json.dumps(sensitivity_dict(found)))
    assert data["count"] == {word: found.words.count(word) for word in ("stable", "unstable", "undecided")}
    assert data["vary"] == {"mu": [0.2, 0.8], "density": [2000, 2400]}
    page = sensitivity_section(found)
    assert f"{data['count']['stable']} stand" in page
    assert page.count("<rect") >= 4  # a bar, and what is undecided on top, for each tenth that has samples
