"""Bonds, by hand, in units of a header: a stretcher is 2 long, a header 1 wide, a queen closer 1/2."""

from itertools import pairwise
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.design.ashlar.bonds import Bond, Span, best_joint, clipped, course_spans, lap_of, relieved, tied
from cyclopean.errors import InputError


def joints(bond, course, length, **options):
    return [span.high for span in course_spans(bond, course, length, 2.0, 1.0, **options)][:-1]


@pytest.mark.parametrize(
    ("bond", "course", "by_hand"),
    [
        ("running", 0, [2, 4, 6]),
        ("running", 1, [1, 3, 5, 7]),
        ("running", 2, [2, 4, 6]),
        ("stack", 1, [2, 4, 6]),
        ("third", 1, [2 / 3, 8 / 3, 14 / 3, 20 / 3]),
        ("third", 2, [4 / 3, 10 / 3, 16 / 3, 22 / 3]),
        ("third", 3, [2, 4, 6]),
        ("english", 0, [2, 4, 6]),
        ("english", 1, [1, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7]),
        ("flemish", 0, [2, 3, 5, 6]),
        ("flemish", 1, [1, 1.5, 3.5, 4.5, 6.5, 7]),
    ],
)
def test_joints_by_hand(bond, course, by_hand):
    """A wall 8 headers long; in Flemish bond 8 = 3 x 2 + 2: stretchers at both ends of even courses."""
    assert joints(bond, course, 8.0) == pytest.approx(by_hand, abs=1e-9)


def test_headers_stand_over_the_middles_of_stretchers():
    below = [s for s in course_spans("flemish", 0, 20.0, 2.0, 1.0) if s.kind == "stretcher"]
    above = [s for s in course_spans("flemish", 1, 20.0, 2.0, 1.0) if s.kind == "header"][1:-1]
    middles = {(s.low + s.high) / 2.0 for s in below}
    assert len(above) == 5
    assert all((s.low + s.high) / 2.0 in middles for s in above)


@pytest.mark.parametrize("bond", ["english", "flemish"])
def test_ends_are_headers_or_stretchers_and_a_closer_stands_beside_the_header(bond):
    spans = course_spans(bond, 1, 8.0, 2.0, 1.0)
    assert [s.kind for s in spans[:2]] == ["header", "closer"]
    assert [s.kind for s in spans[-2:]] == ["closer", "header"]
    assert {round(s.length, 9) for s in spans if s.kind == "closer"} == {0.5}
    assert all(s.across for s in spans if s.kind != "stretcher")


def test_stagger_of_running_bond():
    assert joints("running", 1, 8.0, stagger=0.25) == pytest.approx([0.5, 2.5, 4.5, 6.5])
    assert joints("running", 1, 8.0, stagger=0.0) == pytest.approx([2, 4, 6])


@given(
    bond=st.sampled_from(get_args(Bond)),
    course=st.integers(0, 7),
    length=st.floats(0.3, 40.0),
    unit=st.floats(0.5, 3.0),
    share=st.floats(0.3, 0.9),
)
def test_a_course_is_covered_once(bond, course, length, unit, share):
    spans = course_spans(bond, course, length, unit, share * unit)
    assert spans[0].low == 0.0
    assert spans[-1].high == length
    assert all(a.high == b.low for a, b in pairwise(spans))
    assert all(0.0 < s.length <= unit * (1 + 1e-9) for s in spans)


@pytest.mark.parametrize("bond", sorted(set(get_args(Bond)) - {"stack"}))
@pytest.mark.parametrize("length", [8.0, 14.0, 20.0])
def test_no_joint_stands_over_a_joint(bond, length):
    for course in range(6):
        low, high = (np.array(joints(bond, course + k, length)) for k in (0, 1))
        assert np.abs(low[:, None] - high).min() >= lap_of(bond, 2.0)


def test_and_in_stack_bond_all_do():
    assert joints("stack", 0, 8.0) == joints("stack", 1, 8.0)
    assert lap_of("stack", 2.0) == 0.0


def test_clipping_shares_what_would_be_too_short():
    """A jamb at 4.1 leaves 0.1 of a stretcher: that one and its neighbour become two of 1.05."""
    some = clipped(course_spans("running", 0, 8.0, 2.0, 1.0), 0.0, 4.1, 0.3)
    assert [(s.low, s.high, s.kind) for s in some] == [
        (0.0, 2.0, "stretcher"), (2.0, 3.05, "closer"), (3.05, 4.1, "closer")
    ]  # fmt: skip
    left = clipped(course_spans("running", 0, 8.0, 2.0, 1.0), 1.9, 8.0, 0.3)
    assert [s.low for s in left] == [1.9, 2.95, 4.0, 6.0]
    assert [s.high for s in clipped(course_spans("running", 0, 8.0, 2.0, 1.0), 0.0, 4.5, 0.3)] == [2.0, 4.0, 4.5]


def test_a_joint_moves_away_from_one_below():
    spans = (Span(0.0, 2.0, "stretcher"), Span(2.0, 3.0, "closer"))
    moved = relieved(spans, np.array([2.1]), 0.4, 0.25, 2.0, 1.0)
    assert moved[0].high == moved[1].low
    assert moved[0].high == pytest.approx(1.0)  # the stone after it can be 2 long at most
    assert relieved(spans, np.array([1.5]), 0.4, 0.25, 2.0, 1.0) == spans


@given(st.lists(st.floats(0.0, 10.0), max_size=6), st.floats(0.0, 10.0), st.floats(0.0, 5.0))
def test_best_joint_beats_every_other_place(below, low, width):
    known = np.array(below)
    best = best_joint(low, low + width, known, low)
    far = np.abs(known - best).min(initial=np.inf)
    assert low - 1e-9 <= best <= low + width + 1e-9
    for other in np.linspace(low, low + width, 50):
        assert far >= np.abs(known - other).min(initial=np.inf) - 1e-8
    assert best_joint(low + 1.0, low, known, low) is None


def test_through_stones_by_hand():
    """Every second stretcher: whole where a slab is long enough, else in the middle of two that are shortened."""
    spans = course_spans("running", 0, 8.0, 2.0, 1.0)
    whole = tied(spans, 2, 0, None)
    assert [s.kind for s in whole] == ["through", "stretcher", "through", "stretcher"]
    narrow = tied(spans, 3, 0, 1.0)
    assert [(s.low, s.high, s.kind) for s in narrow] == [
        (0.0, 1.5, "closer"), (1.5, 2.5, "through"), (2.5, 4.0, "closer"), (4.0, 6.0, "stretcher"),
        (6.0, 8.0, "stretcher"),
    ]  # fmt: skip


def test_unknown_bond():
    with pytest.raises(InputError, match=r"bond: expected running, .*, got 'dutch'"):
        course_spans("dutch", 0, 8.0, 2.0, 1.0)
