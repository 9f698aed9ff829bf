"""Conic programmes and sparse factorisations.

By hand: min 1/2 x^2 - 3x subject to x <= 2 has x = 2 and multiplier z = 1 (x - 3 + z = 0). The nearest point of
{s0 >= |s_t|} to (0, 3, 4) is (2.5, 1.5, 2), 5 / sqrt 2 away.
"""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.errors import InputError, SolverError
from cyclopean.solvers import ConicProgram, analyse, distance_to_cone, solve


def bounded(limit: float) -> ConicProgram:
    return ConicProgram(sp.identity(1), np.array([-3.0]), sp.identity(1), np.array([limit]), (("nonnegative", 1, 1),))


def test_a_bounded_parabola_by_hand() -> None:
    answer = solve(bounded(2.0))
    assert answer.word == "solved"
    assert answer.x[0] == pytest.approx(2.0, abs=1e-7)
    assert answer.z[0] == pytest.approx(1.0, abs=1e-6)
    assert max(answer.primal, answer.dual, answer.cone) < 1e-7
    assert answer.gap < 1e-6


def test_residuals_are_ours_not_the_solvers(monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver that lies about its answer is seen through: the signs of multipliers too."""
    from cyclopean.solvers import conic

    monkeypatch.setitem(conic.SOLVERS, "liar", lambda p, o: ("solved", "Solved", np.array([5.0]), np.array([-2.0]), 1))
    answer = solve(bounded(2.0), "liar")
    assert answer.primal == pytest.approx(3.0)
    assert answer.cone == pytest.approx(2.0)
    monkeypatch.setitem(conic.SOLVERS, "liar", lambda p, o: ("solved", "Solved", np.array([np.nan]), np.zeros(1), 1))
    assert solve(bounded(2.0), "liar").word == "failed"


def test_contradictory_rows_give_a_farkas_vector() -> None:
    rows = sp.csc_matrix([[1.0], [-1.0]])  # x <= -1 and x >= 1
    answer = solve(ConicProgram(sp.identity(1), np.zeros(1), rows, np.array([-1.0, -1.0]), (("nonnegative", 2, 1),)))
    assert answer.word == "infeasible"
    assert np.all(answer.z >= 0)
    assert abs(float((rows.T @ answer.z)[0])) < 1e-6 * answer.z.max()
    assert answer.z @ np.array([-1.0, -1.0]) < 0


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_nothing_non_finite_reaches_a_solver(bad: float) -> None:
    with pytest.raises(InputError, match="not a finite number"):
        bounded(bad)
    with pytest.raises(SolverError, match="not finite"):
        ConicProgram(sp.identity(1), np.zeros(1), sp.csc_matrix([[bad]]), np.zeros(1), (("zero", 1, 1),))


def test_refusals() -> None:
    with pytest.raises(SolverError, match="no solver 'simplex'"):
        solve(bounded(1.0), "simplex")
    with pytest.raises(SolverError, match="no option 'speed'"):
        solve(bounded(1.0), speed=11)
    with pytest.raises(SolverError, match="disagree about their sizes"):
        ConicProgram(sp.identity(1), np.zeros(1), sp.identity(1), np.zeros(1), (("nonnegative", 2, 1),))


def test_distances_to_cones_by_hand() -> None:
    soc = (("second-order", 3, 1),)
    assert distance_to_cone(soc, np.array([0.0, 3.0, 4.0])) == pytest.approx(5 / np.sqrt(2))
    assert distance_to_cone(soc, np.array([-3.0, 0.0, 4.0])) == pytest.approx(7 / np.sqrt(2))
    assert distance_to_cone(soc, np.array([-5.0, 3.0, 0.0])) == pytest.approx(np.hypot(5, 3))
    assert distance_to_cone(soc, np.array([5.0, 3.0, 4.0])) == 0.0
    zero = (("zero", 2, 1),)
    assert distance_to_cone(zero, np.array([0.0, -2.0])) == 2.0
    assert distance_to_cone(zero, np.array([0.0, -2.0]), dual=True) == 0.0


@given(seed=st.integers(0, 10_000), size=st.integers(1, 40))
def test_a_factorisation_solves(seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    root = sp.random(size, size, density=0.2, random_state=rng) + sp.identity(size)
    lower = sp.tril(root @ root.T, format="csc")
    lower.sort_indices()
    full = lower + sp.tril(lower, -1).T
    rhs = rng.standard_normal(size)
    symbolic = analyse(lower.indptr, lower.indices)
    for factor in (1.0, 3.0):  # one analysis, two sets of values
        x = symbolic.factor(lower.data * factor).solve(rhs)
        scale = np.abs(full).sum() * max(np.abs(x).max(), 1e-300)
        assert np.abs(factor * (full @ x) - rhs).max() <= 1e-11 * (factor * scale + 1)


def test_a_factorisation_refuses_what_is_not_finite() -> None:
    symbolic = analyse(np.array([0, 1]), np.array([0]))
    with pytest.raises(SolverError, match="not finite"):
        symbolic.factor(np.array([np.nan]))
