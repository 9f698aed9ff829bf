"""Small linear programmes: by hand, against another solver on random ones, and by duality.

Mutants killed: the long step left out of the values; the bound that a leaving unknown stands at; multipliers unsorted.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cyclopean.design.rubble.dual_simplex import least
from cyclopean.errors import SolverError
from laws import examples


def test_the_corner_of_a_triangle():
    """Lowest x + 2 y above both x + y >= 1 and y >= x / 2, within 0 .. 5: at (2/3, 1/3), worth 4/3."""
    rows, room = np.array([[1.0, 1.0], [-0.5, 1.0]]), np.array([-1.0, 0.0])
    x, price = least(np.array([1.0, 2.0]), rows, room, np.zeros(2), np.full(2, 5.0))
    assert x == pytest.approx([2 / 3, 1 / 3])
    assert price == pytest.approx([4 / 3, 2 / 3])


def test_without_inequalities_every_unknown_is_at_its_better_bound():
    x, price = least(np.array([1.0, -1.0]), np.zeros((0, 2)), np.zeros(0), np.array([-2.0, -3.0]), np.array([4.0, 5.0]))
    assert x.tolist() == [-2.0, 5.0]
    assert len(price) == 0


def test_what_cannot_be_is_refused():
    with pytest.raises(SolverError, match="nothing satisfies all inequalities"):
        least(np.ones(1), np.array([[1.0], [-1.0]]), np.array([-0.5, 0.25]), np.zeros(1), np.ones(1))


@settings(max_examples=examples(80), deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 8), m=st.integers(1, 120), whole=st.booleans())
def test_as_another_solver_and_by_duality(seed, n, m, whole):
    draw = np.random.default_rng(seed)
    rows = draw.integers(-2, 3, (m, n)).astype(float) if whole else draw.normal(size=(m, n))
    inside = draw.uniform(-0.5, 0.5, n)
    room = np.abs(draw.normal(size=m)) * (draw.random(m) < 0.9) - rows @ inside - 0.3 * (seed % 4 == 0)
    cost, low, high = draw.normal(size=n), -draw.uniform(0.5, 2.0, n), draw.uniform(0.5, 2.0, n)
    other = linprog(cost, A_ub=-rows, b_ub=room, bounds=np.stack([low, high], 1), method="highs-ds")
    if other.status != 0:
        with pytest.raises(SolverError):
            least(cost, rows, room, low, high)
        return
    x, price = least(cost, rows, room, low, high)
    assert cost @ x == pytest.approx(other.fun, abs=1e-8)
    assert (room + rows @ x).min() >= -1e-9
    assert ((low - 1e-12 <= x) & (x <= high + 1e-12)).all()
    over = cost - rows.T @ price
    assert (price >= 0.0).all()
    assert np.where(over > 0.0, over * low, over * high).sum() - room @ price == pytest.approx(cost @ x, abs=1e-7)
