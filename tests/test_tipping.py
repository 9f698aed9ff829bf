"""Stones that tip on a height map, by hand and against a general solver.

By hand: a plank let go on a peg at one end meets the ground at the other; a box on level ground stays as it is; one
whose middle is beyond the peg tips until slopes are as steep as they may be.
Mutants killed: the wrong cell leaves the triangle; limits of slopes of the wrong sign; cells outside the plan counted.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from cyclopean.design.rubble import tipping
from cyclopean.design.rubble.tipping import FAR, left_under, tipped

CELL, STEEP = 0.04, 0.35


def cells(count, shift=0.0):
    return (np.arange(count) + 0.5) * CELL - count * CELL / 2.0 + shift


def draw(seed, steps=None):
    """Needs of three stones on a rough map, a few cells outside their plans."""
    rng = np.random.default_rng(seed)
    need = rng.normal(size=(3, 9, 7)) * rng.uniform(0.002, 0.1)
    if steps:
        need = np.round(need * steps) / steps  # many cells of one height
    need[rng.random(need.shape) < 0.3] = -np.inf
    need[:, 4, 3] = 0.0
    x, y = (np.stack([cells(n, rng.uniform(-0.05, 0.05)) for _ in range(3)]) for n in (9, 7))
    return need - need.max(axis=(1, 2), keepdims=True), x, y


def lowest(need, x, y):
    """a of one stone by a general solver."""
    i, j = np.nonzero(np.isfinite(need))
    rows = np.column_stack([np.ones(len(i)), x[i], y[j]])
    bounds = [(None, None), (-STEEP, STEEP), (-STEEP, STEEP)]
    return linprog([1.0, 0.0, 0.0], -rows, -need[i, j], bounds=bounds).fun


@given(st.integers(0, 10_000), st.sampled_from([None, 50, 10]))
def test_it_is_the_lowest_plane_over_all_cells(seed, steps):
    need, x, y = draw(seed, steps)
    motion = tipped(need, x, y, STEEP)
    assert left_under(need, x, y, motion).min() >= -1e-8
    assert np.abs(motion[:, 1:]).max() <= STEEP * (1.0 + 1e-3)
    for k in range(3):
        least = lowest(need[k], x[k], y[k])
        assert motion[k, 0] == pytest.approx(least, rel=1.5 / FAR, abs=1e-9)  # limits of slopes stand that far out


@given(st.integers(0, 10_000))
def test_one_stone_has_no_say_over_another(seed):
    need, x, y = draw(seed)
    together = tipped(need, x, y, STEEP)
    for k in range(3):
        alone = tipped(need[k : k + 1], x[k : k + 1], y[k : k + 1], STEEP)
        assert alone[0] == pytest.approx(together[k], abs=1e-12)


@given(st.integers(0, 10_000), st.floats(0.01, 100.0))
def test_the_unit_of_length_changes_nothing(seed, unit):
    need, x, y = draw(seed)
    one, other = tipped(need, x, y, STEEP), tipped(unit * need, unit * x, unit * y, STEEP)
    assert other == pytest.approx(one * [unit, 1.0, 1.0], rel=1e-6, abs=1e-9 * unit)


def test_a_box_on_level_ground_stays():
    need = np.zeros((1, 6, 4))
    assert tipped(need, cells(6)[None], cells(4)[None], STEEP)[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize(("peg", "slope"), [(0, -0.5 / 9.0), (9, 0.5 / 9.0)])
def test_a_plank_on_a_peg_at_one_end_meets_the_ground_at_the_other(peg, slope):
    """Ten cells, the peg half a cell high under the first or the last: it tips by half a cell over nine."""
    need = np.full((1, 10, 2), -0.5 * CELL)
    need[0, peg] = 0.0
    a, b, c = tipped(need, cells(10)[None], cells(2)[None], STEEP)[0]
    assert (b, c) == pytest.approx((slope, 0.0), abs=1e-9)
    assert a == pytest.approx(-0.25 * CELL)


def test_a_stone_with_its_middle_beyond_the_edge_goes_over():
    need = np.full((1, 10, 2), -9.0)
    need[0, :3] = 0.0
    assert tipped(need, cells(10)[None], cells(2)[None], STEEP)[0, 1] == pytest.approx(-STEEP, rel=1e-3)


def test_a_stone_without_an_answer_counts_as_one_that_falls(monkeypatch):
    monkeypatch.setattr(tipping, "MOST", 0)
    need, x, y = draw(3)
    assert np.abs(tipped(need, x, y, STEEP)[:, 1:]).min() > STEEP
