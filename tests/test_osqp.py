"""OSQP: the card, and rigid-block equilibrium with pyramids in place of cones.

By hand: min 1/2 x^2 - 3x subject to x <= 2 has x = 2 and multiplier 1. A cube on a slope of 20 degrees stands from
mu = tan 20 on; a pyramid of 16 faces, 1.9 % less, does not carry it there.

Mutants killed by hand: l = b on inequality rows, the Farkas vector's sign, a start that is ignored, an inscribed
pyramid's "infeasible" taken as a collapse.
"""

import sys

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Cone, Settings, collapse_bound, rbe_program, solve_rbe
from cyclopean.analysis.coupled.search import solve_cra
from cyclopean.design import arch, stack, wall
from cyclopean.errors import InputError, SolverError
from cyclopean.solvers import ConicProgram, solve
from laws import examples
from near_limit import G, posed, random_assembly

pytest.importorskip("osqp", reason="the osqp package is not installed (pip install 'cyclopean[osqp]')")

UPRIGHT = np.array([0.0, 0.0, -G])
SOC = (("second-order", 3, 1),)


def tilted(degrees: float, azimuth: float = 0.0) -> np.ndarray:
    angle, heading = np.deg2rad(degrees), np.deg2rad(azimuth)
    return G * np.array([np.sin(angle) * np.cos(heading), np.sin(angle) * np.sin(heading), -np.cos(angle)])


def bounded(limit: float) -> ConicProgram:
    return ConicProgram(sp.identity(1), np.array([-3.0]), sp.identity(1), np.array([limit]), (("nonnegative", 1, 1),))


# --- the card ---------------------------------------------------------------------------------------------------------


def test_a_bounded_parabola_by_hand() -> None:
    answer = solve(bounded(2.0), "osqp")
    assert (answer.word, answer.solver) == ("solved", "osqp")
    assert answer.x[0] == pytest.approx(2.0, abs=1e-9)
    assert answer.z[0] == pytest.approx(1.0, abs=1e-9)
    assert max(answer.primal, answer.dual, answer.cone, answer.gap) < 1e-9


def test_contradictory_rows_give_a_farkas_vector() -> None:
    rows = sp.csc_matrix([[1.0], [-1.0]])  # x <= -1 and x >= 1
    program = ConicProgram(sp.identity(1), np.zeros(1), rows, np.array([-1.0, -1.0]), (("nonnegative", 2, 1),))
    answer = solve(program, "osqp")
    assert answer.word == "infeasible"
    assert np.all(answer.z >= 0.0)
    assert abs((rows.T @ answer.z)[0]) < 1e-6 * answer.z.max()
    assert answer.z @ program.b < 0.0


def test_a_warm_start_saves_iterations() -> None:
    system = posed(wall(4, 5), 0.7, tilted(5.0))
    program = rbe_program(system, Cone("inscribed", 16))
    cold = solve(program, "osqp")
    warm = solve(program, "osqp", (cold.x, cold.z))
    assert warm.word == cold.word == "solved"
    assert 2 * warm.iterations <= cold.iterations


def test_it_says_nothing_on_standard_output(capfd: pytest.CaptureFixture[str]) -> None:
    """OSQP remarks on polishing without active rows even when it is not verbose."""
    program = ConicProgram(sp.identity(1), np.zeros(1), sp.identity(1), np.ones(1), (("nonnegative", 1, 1),))
    assert solve(program, "osqp").word == "solved"
    assert capfd.readouterr().out == ""


def test_refusals(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SolverError, match="no option 'speed'"):
        solve(bounded(1.0), "osqp", speed=11)
    with pytest.raises(SolverError, match="refuses"):
        solve(bounded(1.0), "osqp", rho=-1.0)
    with pytest.raises(SolverError, match="linear cones only"):
        solve(ConicProgram(sp.identity(3), np.zeros(3), -sp.identity(3), np.zeros(3), SOC), "osqp")  # type: ignore[arg-type]
    with pytest.raises(SolverError, match="not finite"):
        solve(bounded(1.0), "osqp", (np.array([np.nan]), np.zeros(1)))
    with pytest.raises(SolverError, match="interior point"):
        solve(bounded(1.0), "clarabel", (np.zeros(1), np.zeros(1)))
    with pytest.raises(SolverError, match=r"clarabel, osqp \(pip install 'cyclopean\[osqp\]'\)"):
        solve(bounded(1.0), "simplex")
    with pytest.raises(InputError, match=r"solver simplex: .*cyclopean\[osqp\]"):
        solve_rbe(posed(stack(1), 0.7, UPRIGHT), "simplex")
    monkeypatch.setitem(sys.modules, "osqp", None)
    for absent in (lambda: solve(bounded(1.0), "osqp"), lambda: solve_rbe(posed(stack(1), 0.7, UPRIGHT), "osqp")):
        with pytest.raises(InputError, match=r"solver osqp: the package is not installed; pip install 'cyclopean"):
            absent()


# --- rigid-block equilibrium ------------------------------------------------------------------------------------------


@settings(max_examples=examples(12), deadline=None)
@given(seed=st.integers(0, 10_000), tilt=st.sampled_from([0.0, 3.0, 50.0]))
def test_osqp_agrees_with_the_chain(seed: int, tilt: float) -> None:
    """The same word wherever it has one, with residuals in the exact cone; near a limit it may be undecided."""
    system = posed(random_assembly(np.random.default_rng(seed)), 0.7, tilted(tilt))
    chain, outcome = solve_rbe(system), solve_rbe(system, "osqp")
    assert outcome.word in (chain.word, "undecided")
    assert outcome.word != "undecided" or system.points > 100
    if outcome.word == "balanced":
        assert outcome.f is not None
        assert np.all(np.hypot(outcome.f[:, 1], outcome.f[:, 2]) <= system.mu * outcome.f[:, 0] * (1 + 1e-14))
        assert outcome.balance < 1e-11
    elif outcome.word == "collapse":
        assert outcome.y is not None
        assert collapse_bound(system, outcome.y) >= 1e6


@pytest.mark.parametrize(
    ("share", "word", "cones"),
    [(1.01, "balanced", 3), (1.05, "balanced", 1), (0.99, "collapse", 1), (1.0001, "undecided", 3)],
)
def test_an_inscribed_pyramid_without_a_state_proves_nothing(share: float, word: str, cones: int) -> None:
    system = posed(stack(1), np.tan(np.deg2rad(20.0)) * share, tilted(20.0, 30.0))
    outcome = solve_rbe(system, "osqp")
    assert outcome.word == word
    assert outcome.provenance["tried"][0]["cone"] == "inscribed:16"
    assert len(outcome.provenance["tried"]) == cones


# --- coupled analysis -------------------------------------------------------------------------------------------------


def test_coupled_analysis_takes_osqp() -> None:
    system = posed(arch(11), 0.84, UPRIGHT)
    outcome = solve_cra(system, settings=Settings(solver="osqp", seconds=20.0))
    assert outcome.word == "coupled"
    solvers = [entry["solver"] for entry in outcome.provenance["tried"]]
    assert solvers[0] == "osqp"
    assert set(solvers[1:]) == {"clarabel"}  # its programmes have cones, and this says who solved them
    fallen = solve_cra(posed(stack(1), 0.3, tilted(30.0)), settings=Settings(solver="osqp", seconds=20.0))
    assert fallen.word == "collapse"
