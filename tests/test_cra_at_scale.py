"""Coupled states at scale: cone algebra, programme A by two methods, Newton on the state, and the search.

By hand: a cube of weight 1 on ground that falls by t presses with cos t and rubs with sin t. In programme A its four
corners share both alike (the cost of friction is strictly convex, and moments fix the rest up to the normal forces).

Mutants killed by hand: `bend` of `condensed` without its factor 2; the edge of `prox` without alpha; J off the diagonal
with the wrong sign; the price of friction left out of the interior point; slow points sent the wrong way; points shut,
put on their bound or made slow in vain; a stiffness that is not raised, or not lowered beyond eta; "coupled" said of a
pair that is not accepted.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.analysis import quadratic_cones as q3
from cyclopean.analysis.coupled.at_scale import Plan, _Search, solve_at_scale
from cyclopean.analysis.coupled.block_newton import BlockNewton, Sets
from cyclopean.analysis.coupled.central_path import _Kinds, _settled, follow_path
from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.kkt import Doubled
from cyclopean.analysis.coupled.proximal import Pace, Prices, prox, prox_jacobian, proximal_newton
from cyclopean.analysis.coupled.sliding_interior import sliding_interior
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.assembly import Assembly
from cyclopean.design import arch, dome, stack, vault, wall
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cylinder
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur
from near_limit import G, posed, random_case

BOUNDS = Bounds()
UP = np.array([1.0, 0.0, 0.0])
MODELS = {"stack": stack(3, offset=0.1), "wall": wall(3, 4), "arch": arch(11), "vault": vault(9, 3), "dome": dome(4, 8)}
seeds = st.integers(0, 2**32 - 1)


def system_of(model: Assembly, tilt: float = 0.0, mu: float = 0.7) -> EquilibriumSystem:
    angle = np.deg2rad(tilt)
    return posed(model, mu, G * np.array([np.sin(angle), 0.0, -np.cos(angle)]))


def prices_of(system: EquilibriumSystem) -> Prices:
    return Prices(np.ones(system.points), 0.02, np.ones(system.points))


def inside_q3(rng: np.random.Generator, count: int = 20) -> np.ndarray:
    x = rng.normal(size=(count, 3))
    x[:, 0] = np.hypot(x[:, 1], x[:, 2]) + 10.0 ** rng.uniform(-6, 1, count)
    return x


# Cone algebra


@given(seeds)
def test_the_scaling_takes_z_to_x(seed: int) -> None:
    """W z = W^-1 x, and W^-1 undoes W; six decades from the edge cost about as many digits."""
    rng = np.random.default_rng(seed)
    x, z = inside_q3(rng), inside_q3(rng)
    w, r = q3.nesterov_todd(x, z)
    forward, backward = q3.scaled(w, r, z), q3.scaled(q3.REFLECT * w, 1.0 / r, x)
    assert np.abs(forward - backward).max() <= 1e-6 * np.abs(forward).max()
    there = q3.scaled(q3.REFLECT * w, 1.0 / r, q3.scaled(w, r, x))
    assert np.abs(there - x).max() <= 1e-6 * np.abs(x).max()


@given(seeds)
def test_condensed_is_the_inverse(seed: int) -> None:
    """(H + W^-2) D = 1 row by row, with W^-2 built from its definition."""
    rng = np.random.default_rng(seed)
    w, r = q3.nesterov_todd(inside_q3(rng) + UP, inside_q3(rng) + UP)
    normal, tangential = rng.uniform(0, 3, 20), rng.uniform(0, 3, 20)
    D = q3.condensed(w, r, normal, tangential)
    for k in range(20):
        v = q3.REFLECT * w[k]
        K = (2.0 * np.outer(v, v) - np.diag(q3.REFLECT)) / r[k] ** 2 + np.diag(
            [normal[k], tangential[k], tangential[k]]
        )
        assert np.allclose(K @ D[k], np.eye(3), atol=1e-8)


@given(seeds)
def test_the_longest_step_ends_on_the_cone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, d = inside_q3(rng, 1), rng.normal(size=(1, 3))
    t = q3.longest(x, d)
    y = x + min(t, 1e3) * d
    edge = y[:, 0] - np.hypot(y[:, 1], y[:, 2])
    if np.isfinite(t) and t < 1e3:
        assert np.abs(edge).max() <= 1e-7 * (1.0 + np.abs(y).max())
    else:
        assert edge.min() >= -1e-9 * np.abs(y).max()


def test_product_and_quotient_undo_each_other() -> None:
    rng = np.random.default_rng(1)
    a, b = inside_q3(rng) + UP, rng.normal(size=(20, 3))
    assert np.allclose(q3.quotient(a, q3.product(a, b)), b)
    assert q3.product(np.array([[2.0, 1, 0]]), np.array([[3.0, 0, 1]])).tolist() == [[6.0, 3.0, 2.0]]


# Prox


def test_the_prox_by_hand() -> None:
    """c = sigma = 1, beta = 0, alpha = 1, mu = 1: (4, 2, 0) -> (3, 1, 0); on the edge (2, 4, 0) -> (5/3, 5/3, 0)."""
    prices = Prices(np.ones(3), 0.0, np.ones(3))
    V = np.array([[4.0, 2, 0], [2, 4, 0], [0.5, 0, 0]])
    found = prox(V, prices, 1.0, np.ones(3))
    assert np.allclose(found.f, [[3, 1, 0], [5 / 3, 5 / 3, 0], [0, 0, 0]])  # edge: min (f - 1)^2 + (f - 4)^2 + f^2
    assert found.inside.tolist() == [True, False, False]
    assert found.edge.tolist() == [False, True, False]


@given(seeds)
def test_nothing_near_the_prox_is_cheaper(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mu, sigma = rng.uniform(0.1, 1.5, 40), 10.0 ** rng.uniform(-2, 2)
    prices = Prices(rng.uniform(0.5, 2, 40), float(rng.uniform(0, 0.5)), rng.uniform(0, 3, 40))
    V = 3.0 * rng.normal(size=(40, 3)) * max(1.0, sigma)
    f = prox(V, prices, sigma, mu).f

    def cost(g: np.ndarray) -> np.ndarray:
        t = np.hypot(g[:, 1], g[:, 2])
        own = prices.normal * g[:, 0] + prices.slide * t + 0.5 * prices.stiff * t * t
        return own + np.sum((g - V) ** 2, 1) / (2 * sigma)

    assert (np.hypot(f[:, 1], f[:, 2]) <= mu * f[:, 0] * (1 + 1e-12)).all()
    for size in (1e-3, 0.1, 1.0):
        g = f + size * rng.normal(size=f.shape)
        g[:, 0] = np.maximum(g[:, 0], np.hypot(g[:, 1], g[:, 2]) / mu)  # back into the cone
        assert (cost(g) >= cost(f) - 1e-9 * np.abs(cost(f))).all()


@given(seeds)
def test_the_jacobian_is_the_derivative(seed: int) -> None:
    """Central differences; points within a step of a kink are left out."""
    rng = np.random.default_rng(seed)
    mu, sigma, step = rng.uniform(0.1, 1.5, 30), 2.0, 1e-6
    prices = Prices(np.ones(30), 0.1, rng.uniform(0, 3, 30))
    V = 5.0 * rng.normal(size=(30, 3)) + [2.0, 0, 0]
    at = prox(V, prices, sigma, mu)
    J = prox_jacobian(V, at, prices, sigma, mu)
    steady, difference = np.ones(30, bool), np.zeros_like(J)
    for j in range(3):
        shift = step * np.eye(3)[j]
        up, down = prox(V + shift, prices, sigma, mu), prox(V - shift, prices, sigma, mu)
        difference[:, :, j] = (up.f - down.f) / (2 * step)
        for other in (up, down):
            steady &= (other.inside == at.inside) & (other.edge == at.edge)
            steady &= (other.friction > 0) == (at.friction > 0)
    assert np.allclose(J[steady], difference[steady], atol=1e-6)
    assert np.allclose(J, J.transpose(0, 2, 1))


# Programme A


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("tilt", [0.0, 4.0])
def test_programme_a_agrees_with_clarabel(name: str, tilt: float) -> None:
    """Same cost as a plain conic solve of the same programme; the forces may differ where they are not unique."""
    system = system_of(MODELS[name], tilt)
    schur, prices = Schur(system), prices_of(system)
    inner = sliding_interior(system, schur, prices)
    assert inner.word == "solved"
    fine = sliding_interior(system, schur, prices, gap=1e-8)
    exact = proximal_newton(system, schur, prices, inner.f, inner.q, Pace(enough=1e-9))
    assert exact.word == "solved"
    other = Halves(system, BOUNDS).priced(prices)
    assert prices.of(exact.f) == pytest.approx(prices.of(other.f), rel=1e-7)
    assert prices.of(inner.f) == pytest.approx(prices.of(other.f), rel=1e-3)
    assert prices.of(fine.f) == pytest.approx(prices.of(other.f), rel=1e-6)
    dual = system.p @ exact.q - 0.5 * np.sum(prices.stiff[:, None] * exact.f[:, 1:] ** 2)
    assert dual == pytest.approx(prices.of(exact.f), rel=1e-7)  # no gap: q proves that nothing is cheaper


@pytest.mark.parametrize("name", MODELS)
def test_the_interior_point_finds_mechanisms(name: str) -> None:
    system = system_of(MODELS[name], 55.0)
    inner = sliding_interior(system, Schur(system), prices_of(system))
    assert inner.word == "collapse"
    assert system.p @ inner.q > 0.0


def test_no_friction_is_refused_by_the_interior_point() -> None:
    system = system_of(stack(1), mu=0.0)
    with pytest.raises(SolverError, match="mu >= 1e-06"):
        sliding_interior(system, Schur(system), prices_of(system))


# Newton on the state


def test_newton_recovers_a_disturbed_state() -> None:
    system = system_of(MODELS["vault"], 3.0)
    state = solve_at_scale(system, BOUNDS)
    rng = np.random.default_rng(0)
    f = state.f * (1 + 1e-4 * rng.normal(size=state.f.shape))
    dq = state.dq * (1 + 1e-4 * rng.normal(size=state.dq.shape))
    pressed, rubbing = state.f[:, 0] > 0.0, np.hypot(state.f[:, 1], state.f[:, 2]) > 0.0
    assert measure(system, BOUNDS, f, dq).worst > 1e-6
    edge = rubbing & (np.hypot(f[:, 1], f[:, 2]) > 0.999 * system.mu * f[:, 0])
    newton = BlockNewton(system, BOUNDS)
    *found, worst = newton.solve(Sets.of(pressed, rubbing, edge), f, dq)
    left = measure(system, BOUNDS, *found)
    assert worst < 1e-13
    assert max(left.equilibrium, left.complementarity, left.gap) < 1e-11
    assert newton.doubled.factorisations <= 3
    assert (found[0][~pressed] == 0.0).all()
    assert (found[0][~rubbing, 1:] == 0.0).all()


def test_newton_puts_friction_on_its_bound_and_sliding_on_beta() -> None:
    """A cube pulled downhill: friction asked to be mu fn somewhere and sliding 0.02 elsewhere, both to rounding."""
    system = system_of(stack(1), 10.0)
    state = solve_at_scale(system, BOUNDS)
    pressed, rubbing = state.f[:, 0] > 0.0, np.hypot(state.f[:, 1], state.f[:, 2]) > 0.0
    edge, slow = np.zeros_like(pressed), np.zeros_like(pressed)
    edge[0], slow[1] = True, True
    f, dq, _ = BlockNewton(system, BOUNDS).solve(Sets(pressed, pressed, rubbing, edge, slow), state.f, state.dq)
    assert np.hypot(f[0, 1], f[0, 2]) == pytest.approx(0.7 * f[0, 0], rel=1e-11)
    assert system.gap(dq)[1, 1:] @ f[1, 1:] == pytest.approx(-0.02 * np.hypot(*f[1, 1:]), rel=1e-11)  # against it
    assert np.abs(system.residual(f)).max() < 1e-12


# The path


def started(system: EquilibriumSystem) -> tuple[np.ndarray, np.ndarray]:
    """An interior answer to programme A, to a gap of 1e-4."""
    inner = sliding_interior(system, Schur(system), prices_of(system), gap=1e-4)
    assert inner.word == "solved"
    return inner.f, inner.q


def polygonal(columns: int, rows: int, coursing: float, seed: int, curved: bool) -> EquilibriumSystem:
    width = 0.375 * columns
    settings = PatternSettings(
        columns=columns, rows=rows, courses=rows, width=width, height=0.36 * rows, coursing=coursing, seed=seed
    )
    made = polygonal_wall(settings, surface=Cylinder(1.5 * width, width / 2.0) if curved else None)
    return posed(made.assembly, 0.84, np.array([0.0, 0.0, -G]))


@pytest.mark.parametrize("curved", [False, True])
def test_a_path_leads_into_the_interior(curved: bool) -> None:
    """Far from a state (work beyond 0.05) at the start; if a state is at its end, it has room at every bound."""
    met = 0
    for seed in range(3):
        system = polygonal(8, 5, 0.4, seed, curved)
        f, dq = started(system)
        assert measure(system, BOUNDS, f, dq).complementarity > 0.05
        doubled = Doubled(Schur(system))
        end = follow_path(system, doubled, BOUNDS, f, dq)
        assert end.residuals == measure(system, BOUNDS, end.f, end.dq)
        assert doubled.factorisations >= end.steps > 0
        if end.residuals.accepted:
            met += 1
            d, tangent = system.gap(end.dq), np.hypot(end.f[:, 1], end.f[:, 2])
            rubs = tangent > 1e-6
            assert rubs.sum() > 50
            assert end.product <= 1e-4
            assert (tangent < system.mu * end.f[:, 0])[rubs].all()
            assert (np.hypot(d[:, 1], d[:, 2]) > BOUNDS.beta)[rubs].all()
    assert met >= 1


@pytest.mark.parametrize("seed", range(6))
def test_a_path_claims_nothing_of_a_model_that_falls(seed: int) -> None:
    """From random interior starts of walls without a state, whatever comes back is not accepted."""
    system = system_of(wall(4, 4), 60.0)
    rng = np.random.default_rng(seed)
    f = np.abs(rng.normal(size=(system.points, 3))) + 0.1
    dq = np.zeros(6 * system.blocks)
    end = follow_path(system, Doubled(Schur(system)), BOUNDS, f, dq)
    assert not end.residuals.accepted
    assert end.residuals == measure(system, BOUNDS, end.f, end.dq)


def test_what_is_settled_on_a_path_by_hand() -> None:
    """Much force and no gap: shut. Much gap and next to no force: free, without force. All others go on."""
    f = np.zeros((4, 3))
    f[:, 0], gap = (1.0, 1e-3, 1e-9, 1e-5), np.array([1e-7, 1e-7, 0.1, 20.0])
    yes, no = np.ones(4, bool), np.zeros(4, bool)
    kinds, left = _settled(_Kinds(yes, no, no, no), f, gap)
    assert kinds.shut.tolist() == [True, False, False, False]
    assert kinds.free.tolist() == [False, False, True, False]
    assert kinds.pairs.tolist() == [False, True, False, True]
    assert kinds.rubs.tolist() == [True, True, False, True]
    assert left[:, 0].tolist() == [1.0, 1e-3, 0.0, 1e-5]


def test_a_path_starts_only_where_everything_has_room() -> None:
    system = system_of(stack(2), 5.0)
    f, dq = started(system)
    for start in ((0.0 * f, dq), (f, -1e3 * dq), (np.where(f > 0.0, np.nan, f), dq)):
        end = follow_path(system, Doubled(Schur(system)), BOUNDS, *start)
        assert end.steps == 0
        assert not end.residuals.accepted
    late = follow_path(system, Doubled(Schur(system)), BOUNDS, f, dq, deadline=0.0)
    assert late.steps == 0


def test_the_doubled_matrix_by_hand() -> None:
    """Twice the blocks of S = A D A' side by side, solved as the dense matrix that the formula says."""
    system = system_of(stack(2), 3.0)
    rng = np.random.default_rng(0)
    q, n, A = system.points, 6 * system.blocks, system.A.toarray()
    half = rng.normal(size=(3, q, 3, 3))
    forces, motion = (x @ x.transpose(0, 2, 1) for x in half[:2])
    dense = {}
    for name, D in (("forces", forces), ("motion", motion), ("mixed", half[2])):
        dense[name] = sum(A[:, 3 * k : 3 * k + 3] @ D[k] @ A[:, 3 * k : 3 * k + 3].T for k in range(q))
    top = -dense["forces"] - np.diag(1e-3 * np.diag(dense["forces"]))
    whole = np.block([[top, dense["mixed"].T], [dense["mixed"], dense["motion"] + 0.5 * np.eye(n)]])
    doubled, rhs = Doubled(Schur(system)), rng.normal(size=2 * n)
    found = doubled.solve(doubled.factor(forces, half[2], motion, 1e-3, 1e-9, 0.5), rhs[:n], rhs[n:])
    assert np.concatenate(found) == pytest.approx(np.linalg.solve(whole, rhs), rel=1e-8, abs=1e-10)
    assert doubled.factorisations == 1


def test_a_curved_wall_of_three_hundred_stones() -> None:
    """827 of its 849 joints are not quite plane, so that sets are nearly degenerate; stiffening alone ends nowhere."""
    system = polygonal(25, 12, 0.4, 0, curved=True)
    answer = solve_at_scale(system, BOUNDS)
    assert answer.word == "coupled"
    assert answer.paths >= 1
    assert answer.rounds <= 4


# The search


@pytest.mark.parametrize("tilt", [0.0, 10.0, 20.0])
def test_a_cube_on_a_slope_by_hand(tilt: float) -> None:
    answer = solve_at_scale(system := system_of(stack(1), tilt), BOUNDS)
    assert answer.word == "coupled"
    angle = np.deg2rad(tilt)
    assert answer.f[:, 0].sum() == pytest.approx(np.cos(angle), abs=1e-9)
    assert np.hypot(*answer.f[:, 1:].sum(0)) == pytest.approx(np.sin(angle), abs=1e-9)
    d = system.gap(answer.dq)
    assert np.abs(d[:, 0] + 1.0).max() < 1e-9
    if tilt == 0.0:
        assert (answer.f[:, 1:] == 0.0).all()
    else:  # all corners slide downhill by at least twice beta-min
        assert np.hypot(d[:, 1], d[:, 2]).min() > 0.01
        assert np.sum(d[:, 1:] * answer.f[:, 1:], 1).max() < 0.0


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("tilt", [0.0, 2.0, 5.0])
def test_models_that_stand_have_states(name: str, tilt: float) -> None:
    system = system_of(MODELS[name], tilt)
    answer = solve_at_scale(system, BOUNDS)
    assert answer.word == "coupled"
    assert answer.reason == ""
    assert measure(system, BOUNDS, answer.f, answer.dq).accepted
    assert answer.factorisations > 0
    assert answer.rounds > 0
    idle = answer.f[:, 0] < 1e-9
    assert (answer.f[idle] == 0.0).all()


@pytest.mark.parametrize(
    ("model", "tilt", "rounds"),
    [
        pytest.param(wall(10, 10), 0.0, 1, id="wall"),
        pytest.param(wall(12, 12), 5.0, 1, id="wall 5"),
        pytest.param(wall(14, 15), 10.0, 2, id="wall 10"),
        pytest.param(vault(15, 10), 0.0, 1, id="vault: slow points"),
        pytest.param(dome(4, 12), 0.0, 1, id="dome: points to shut"),
        pytest.param(dome(4, 12), 3.0, 4, id="dome 3: points to put on their bound"),
        pytest.param(dome(6, 16), 0.0, 9, id="larger dome"),
    ],
)
def test_larger_models_take_few_rounds(model: Assembly, tilt: float, rounds: int) -> None:
    answer = solve_at_scale(system_of(model, tilt), BOUNDS)
    assert answer.word == "coupled"
    assert answer.rounds <= rounds


@pytest.mark.parametrize("seed", range(16))
def test_what_is_claimed_is_true(seed: int) -> None:
    """Random models, half of them at their limit: a state is claimed only where the residuals allow it."""
    case = random_case(seed)
    system = posed(case.assembly, case.mu, np.array(case.gravity))
    answer = solve_at_scale(system, BOUNDS, rounds=12)
    residuals = measure(system, BOUNDS, answer.f, answer.dq)
    assert (answer.word == "coupled") == residuals.accepted
    assert residuals == answer.residuals
    if not case.share < 1.0:  # no forces at all
        assert answer.word == "undecided"
    if case.share < 0.2:
        assert answer.word == "coupled"


def test_a_model_that_falls_is_undecided() -> None:
    answer = solve_at_scale(system_of(wall(3, 4), 60.0), BOUNDS)
    assert answer.word == "undecided"
    assert answer.reason == "no forces balance the loads"


def test_a_model_without_friction_is_undecided() -> None:
    answer = solve_at_scale(system_of(stack(2), mu=0.0), BOUNDS)
    assert answer.word == "undecided"
    assert "mu >= 1e-06" in answer.reason


def test_friction_is_softened_until_sliding_is_within_eta() -> None:
    """Sliding goes with alpha times friction: a tall wall slides by 0.27 eps with alpha = 1, and need not."""
    system = system_of(wall(2, 30), 1.5)
    wide, narrow = (solve_at_scale(system, Bounds(eta=eta)) for eta in (50.0, 0.2))
    reach = [np.hypot(*system.gap(a.dq)[:, 1:].T).max() for a in (wide, narrow)]
    assert wide.word == narrow.word == "coupled"
    assert wide.rounds < narrow.rounds
    assert reach[1] <= 0.2 * (1 + 1e-9) < reach[0]


def test_time_is_kept_and_progress_told() -> None:
    told: list[str] = []
    answer = solve_at_scale(system_of(dome(4, 9)), BOUNDS, seconds=0.0, progress=told.append)
    assert answer.rounds == len(told) == 1
    assert told[0] == "stiffening friction, round 1"


def test_units_do_not_matter() -> None:
    """eta and beta-min count against eps alone."""
    system = system_of(arch(11), 2.0)
    one, ten = (solve_at_scale(system, Bounds(k, 10.0 * k, 0.01 * k)) for k in (1.0, 10.0))
    assert np.array_equal(one.dq, ten.dq)
    assert replace(one.residuals) == ten.residuals


def test_what_a_plan_makes_of_the_prices_by_hand() -> None:
    system = system_of(stack(2))
    search = _Search(system, BOUNDS, 1.0, Schur(system))
    search.begin(Plan(1.0, 0.5, tiny=0.02, shift=0.5))
    over = np.zeros(system.points)
    over[:3] = 0.1, 0.1, 6.0
    search.f[:, 1] = 0.5
    search.f[1, 1] = 0.01  # next to no force: 0.02 mu is 0.014
    search.stiffen(over)
    assert search.stiff[:4] == pytest.approx([0.6 / 0.25, 1.0, 1.0, 1.0])  # (alpha |f_t| + lambda) / (ease |f_t|)
    assert search.slide[:4] == pytest.approx([0.02, 1.0, 4.0, 0.02])  # a tenth of eta at least, 0.4 eta at most
    assert search.normal[:4] == pytest.approx([1.035, 1.035, 3.1, 1.0])  # halfway to 1 + mu lambda
    search.stiffen(np.zeros(system.points))
    assert search.normal[:4] == pytest.approx([1.0175, 1.0175, 2.05, 1.0])
