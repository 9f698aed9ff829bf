"""The search for coupled states, each route alone and the chain.

By hand: a unit cube of weight 1 on a slope of angle a, four contact points. Normal forces (cos a + sin a) / 4 at the
two lower corners and (cos a - sin a) / 4 at the upper ones balance weight and moment; friction sin a in all. Programme
A with alpha = 1 shares friction equally, sin a / 4 each, where that is within the cone of the upper
corners: tan a <= mu / (1 + mu), 24.5 degrees for mu = 0.84. Then all points move alike: dq = -n + (beta + sin a / 4)
downhill, with no rotation. The cube stands iff tan a <= mu (it tips at 45 degrees only).

A stack of n cubes stands on a slope iff tan a <= min(mu, 1 / n).
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Settings
from cyclopean.analysis.coupled.alternation import Walk, alternation
from cyclopean.analysis.coupled.block_newton import BlockNewton, Sets
from cyclopean.analysis.coupled.continuation import continuation
from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.polish import polish
from cyclopean.analysis.coupled.programme_a import Prices
from cyclopean.analysis.coupled.search import solve_cra
from cyclopean.analysis.coupled.states import ACCEPT, Bounds, measure, merit
from cyclopean.analysis.equilibrium.rbe import solve_rbe
from cyclopean.assembly import Assembly, Block, Contacts, Load
from cyclopean.design import arch, dome, stack, vault, wall
from cyclopean.errors import InputError
from cyclopean.statics import equilibrium_system, turned_gravity
from laws import examples

G = 9.80665
DOWN = np.array([0.0, 0.0, -G])
UNIT = Bounds()
BOX = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def posed(model, mu=0.84, gravity=DOWN, density=2400.0):
    """Its equilibrium system; fixed blocks as the model says."""
    fixed = np.array([bool(b.fixed) for b in model.blocks])
    return equilibrium_system(model, model.contacts.with_mu(mu), fixed, gravity, density)


def box(name, low, high, fixed=False):
    (a, b, c), (d, e, f) = low, high
    corners = [[a, b, c], [d, b, c], [d, e, c], [a, e, c], [a, b, f], [d, b, f], [d, e, f], [a, e, f]]
    return Block(name, np.array(corners, float), BOX, fixed=fixed)


def h_frame():
    """A beam of 0.6 x 0.4 x 0.3 m between two fixed columns, held by nothing but friction at its ends."""
    blocks = (
        box("left", (-0.6, 0, 0), (-0.3, 0.4, 1.2), True),
        box("right", (0.3, 0, 0), (0.6, 0.4, 1.2), True),
        box("beam", (-0.3, 0, 0.5), (0.3, 0.4, 0.8)),
    )
    end = np.array([[0, 0, 0.5], [0, 0.4, 0.5], [0, 0.4, 0.8], [0, 0, 0.8]])
    aside = np.array([0.3, 0.0, 0.0])
    return Assembly(blocks, Contacts.of([(0, 2), (1, 2)], [end - aside, (end + aside)[::-1]]))


def on_ground(polygon, size=(1.0, 1.0, 1.0), **contact):
    """A box on a slab with the contact polygon given."""
    low = np.array([0.0, 0.0, 0.0])
    blocks = (box("ground", (-5, -5, -1), (5, 5, 0), True), box("stone", low, low + size))
    corners = np.array([[x, y, 0.0] for x, y in polygon])
    return Assembly(blocks, Contacts.of([(0, 1)], [corners], **contact))


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
ROUND = [(0.5 + 0.5 * np.cos(a), 0.5 + 0.5 * np.sin(a)) for a in np.linspace(0, 2 * np.pi, 24, endpoint=False)]


def priced(system, shift=0.0, stiff=1.0, beta=0.02):
    """Programme A with compression at 1 + shift."""
    return Halves(system, UNIT).priced(Prices(1.0 + shift, beta, stiff * np.ones(system.points)))


def accepted(system, found, bounds=UNIT):
    """Measured here, never taken from the route."""
    residuals = measure(system, bounds, found.f, found.dq)
    return residuals.worst <= ACCEPT and residuals.accepted


# The hand calculation


@pytest.mark.parametrize("degrees", [5.0, 20.0, 24.0])
def test_cube_on_a_slope_by_hand(degrees):
    a = np.radians(degrees)
    system = posed(on_ground(SQUARE), gravity=turned_gravity(DOWN, degrees))
    answer = priced(system)
    lower = system.arm_b[:, 0] > 0.0  # gravity turned towards +x
    assert answer.f[lower, 0] == pytest.approx((np.cos(a) + np.sin(a)) / 4, abs=1e-7)
    assert answer.f[~lower, 0] == pytest.approx((np.cos(a) - np.sin(a)) / 4, abs=1e-7)
    assert answer.dq == pytest.approx([0.02 + np.sin(a) / 4, 0, -1, 0, 0, 0], abs=1e-6)
    found = continuation(system, UNIT)
    assert accepted(system, found)
    world = np.einsum("qi,qij->qj", found.f, system.frame)
    assert world.sum(axis=0) == pytest.approx([-np.sin(a), 0, np.cos(a)], abs=1e-12)


@settings(max_examples=examples(25), deadline=None, derandomize=True)
@given(count=st.integers(1, 4), degrees=st.floats(0.0, 50.0), mu=st.floats(0.05, 1.2))
def test_stack_on_a_slope_stands_by_the_law(count, degrees, mu):
    limit = min(mu, 1.0 / count)
    assume(abs(np.tan(np.radians(degrees)) / limit - 1.0) > 0.01)
    system = posed(stack(count), mu, turned_gravity(DOWN, degrees))
    outcome = solve_cra(system)
    assert outcome.word == ("coupled" if np.tan(np.radians(degrees)) < limit else "collapse")
    assert outcome.word == "collapse" or accepted(system, outcome)


# Programme A


def test_multipliers_press_and_slide_as_priced():
    """dn = -(1 + s), dd_t = -(beta + alpha |f_t|) f_t / |f_t| inside the cone; dn >= -(1 + s) elsewhere."""
    system = posed(arch(9, radius=5.0, thickness=1.2), gravity=turned_gravity(DOWN, 3.0))
    rng = np.random.default_rng(4)
    s, alpha = rng.uniform(0, 1, system.points), rng.uniform(0.5, 2, system.points)
    answer = priced(system, s, alpha, 0.05)
    d, tangent = system.gap(answer.dq), np.hypot(answer.f[:, 1], answer.f[:, 2])
    assert np.all(d[:, 0] >= -1.0 - s - 1e-6)
    inside = (answer.f[:, 0] > 1e-4) & (tangent > 1e-4) & (tangent < 0.999 * system.mu * answer.f[:, 0])
    assert inside.sum() >= 5
    assert d[inside, 0] == pytest.approx(-1.0 - s[inside], abs=1e-5)
    ideal = -(0.05 + alpha * tangent)[:, None] * answer.f[:, 1:] / np.maximum(tangent, 1e-12)[:, None]
    assert d[inside, 1:] == pytest.approx(ideal[inside], abs=1e-4)


# Polish


@settings(max_examples=examples(15), deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), size=st.sampled_from([1e-8, 1e-6, 1e-5]))
def test_polish_mends_what_is_nearly_a_state(seed, size):
    system = posed(arch(7, radius=5.0, thickness=1.2), gravity=turned_gravity(DOWN, 4.0))
    state = solve_cra(system)
    rng = np.random.default_rng(seed)
    f = state.f + size * rng.normal(size=state.f.shape) * (state.f != 0.0)
    dq = state.dq + size * rng.normal(size=state.dq.shape)
    assert not measure(system, UNIT, f, dq).accepted
    new_f, new_dq, residuals = polish(system, UNIT, f, dq)
    assert residuals.accepted
    assert measure(system, UNIT, new_f, new_dq) == residuals
    pressed = np.abs(system.gap(new_dq)[:, 0] + 1.0) < 1e-9
    assert np.all(new_f[~pressed] == 0.0)  # exactly


def test_polish_returns_a_state_as_it_is():
    system = posed(stack(2))
    state = solve_cra(system)
    f, dq, residuals = polish(system, UNIT, state.f, state.dq)
    assert residuals.accepted
    assert f is state.f
    assert dq is state.dq


@pytest.mark.parametrize("where", ["f", "dq"])
def test_polish_refuses_what_is_not_finite(where):
    system = posed(stack(2))
    parts = {"f": np.zeros((system.points, 3)), "dq": np.zeros(12)}
    parts[where].flat[0] = np.nan
    _, _, residuals = polish(system, UNIT, **parts)
    assert not residuals.accepted


def test_polish_claims_nothing_for_a_beam_without_a_state():
    system = posed(h_frame())
    rigid = solve_rbe(system)
    assert rigid.word == "balanced"
    halves = Halves(system, UNIT)
    _, motion = halves.fitted_motions(rigid.f)
    assert not polish(system, UNIT, rigid.f, motion)[2].accepted


def test_gauss_newton_reaches_rounding_on_thousands_of_equations():
    system = posed(wall(8, 8), gravity=turned_gravity(DOWN, 5.0))
    answer = priced(system)
    pressed = answer.f[:, 0] > system.gap(answer.dq)[:, 0] + 1.0
    rubbing = pressed & (np.hypot(answer.f[:, 1], answer.f[:, 2]) > 1e-6)
    f, dq, worst = BlockNewton(system, UNIT).solve(Sets.of(pressed, rubbing), answer.f, answer.dq)
    residuals = measure(system, UNIT, f, dq)
    assert worst < 1e-13
    assert residuals.equilibrium < 1e-14
    assert residuals.complementarity < 1e-13


# The routes, each alone


@pytest.mark.parametrize("model", [dome(2, 8, thickness=0.3), vault(5, 2, thickness=0.3), stack(2)])
def test_alternation(model):
    system = posed(model, 0.6)
    found = alternation(system, UNIT)
    assert found.found
    assert accepted(system, found)


@settings(max_examples=examples(8), deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6))
def test_each_half_lowers_the_merit(seed):
    rng = np.random.default_rng(seed)
    system = posed(stack(3, offset=0.1), 0.5, turned_gravity(DOWN, 12.0))
    halves = Halves(system, UNIT)
    start = priced(system, rng.uniform(0, 3, 12), rng.uniform(0, 2, 12))
    f, last = start.f, np.inf
    for _ in range(3):
        _, dq = halves.fitted_motions(f)
        here = sum(part.sum() for part in merit(system, UNIT, f, dq))
        assert here <= last + 1e-5
        assert system.gap(dq)[:, 0].min() >= -1.0 - 1e-6
        _, f = halves.fitted_forces(system.gap(dq))
        last = sum(part.sum() for part in merit(system, UNIT, f, dq))
        assert last <= here + 1e-5
        assert measure(system, UNIT, f, dq).equilibrium < 1e-7


@settings(max_examples=examples(8), deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6))
def test_no_other_forces_have_less_merit_for_the_same_motion(seed):
    rng = np.random.default_rng(seed)
    system = posed(dome(2, 6, thickness=0.3), 0.5)
    q, halves = system.points, Halves(system, UNIT)
    others = [priced(system, rng.uniform(0, 3, q), rng.uniform(0, 2, q)).f for _ in range(4)]
    _, dq = halves.fitted_motions(others[0])
    _, best = halves.fitted_forces(system.gap(dq))
    least = sum(part.sum() for part in merit(system, UNIT, best, dq))
    for f in others:
        assert least <= sum(part.sum() for part in merit(system, UNIT, f, dq)) + 1e-5


def test_alternation_finds_nothing_where_there_is_nothing():
    system = posed(h_frame())
    walk = Walk(Halves(system, UNIT))
    assert walk.descend(solve_rbe(system).f)[0] == pytest.approx(walk.best.merit)
    assert not walk.best.found
    assert 0.1 < walk.best.merit < np.inf
    assert walk.rounds < 40


# The chain


def test_chain_names_every_route():
    outcome = solve_cra(posed(h_frame()), settings=Settings(nodes=3))
    assert outcome.word == "undecided"
    tried = outcome.provenance["tried"]
    assert [t["route"] for t in tried] == ["RBE", "continuation", "alternation", "tree"]
    assert all(
        {"route", "solver", "word", "solves", "rounds", "factorisations", "nodes", "seconds"} == set(t) for t in tried
    )
    for key in ("solves", "rounds", "factorisations", "nodes"):
        assert outcome.provenance[key] == sum(t[key] for t in tried)
    assert "6 nodes" in outcome.provenance["why"]
    assert 0.1 < outcome.merit < np.inf


def test_beam_held_by_friction_alone_is_refuted():
    outcome = solve_cra(posed(h_frame()), settings=Settings(seconds=30.0))
    assert outcome.word == "refuted"
    assert outcome.provenance["route"] == "tree"
    assert outcome.tree is not None
    assert outcome.provenance["leaves"] > 1


def test_no_time_is_said_to_be_the_reason():
    outcome = solve_cra(posed(h_frame()), settings=Settings(seconds=1e-9))
    assert outcome.word == "undecided"
    assert "time" in outcome.provenance["why"]


def test_unknown_solver_is_refused():
    with pytest.raises(InputError, match="solver ipopt"):
        solve_cra(posed(stack(1)), settings=Settings(solver="ipopt"))


def test_told_to_keep_to_clarabel():
    outcome = solve_cra(posed(wall(3, 3)), settings=Settings(solver="clarabel"))
    assert outcome.word == "coupled"
    assert {t["solver"] for t in outcome.provenance["tried"]} == {"clarabel"}


def test_progress_is_told():
    told = []
    solve_cra(posed(stack(2)), progress=told.append)
    assert told == ["searching a coupled state: continuation"]


@pytest.mark.parametrize(("count", "thickness"), [(20, 0.5), (20, 1.2), (30, 0.6), (40, 0.8)])
def test_semicircular_arches(count, thickness):
    """The reference implementation rejects 5 of 12 of these."""
    system = posed(arch(count, span=10.0, thickness=thickness, springers="fixed"))
    outcome = solve_cra(system)
    assert outcome.word == "coupled"
    assert accepted(system, outcome)


@pytest.mark.parametrize("degrees", [0.0, 5.0, 10.0])
def test_walls(degrees):
    system = posed(wall(6, 6), gravity=turned_gravity(DOWN, degrees))
    outcome = solve_cra(system)
    assert outcome.word == "coupled"
    assert accepted(system, outcome)


# Odd models


def test_everything_fixed():
    model = stack(2)
    outcome = solve_cra(posed(replace(model, blocks=tuple(replace(b, fixed=True) for b in model.blocks))))
    assert (outcome.word, outcome.provenance["route"]) == ("coupled", "RBE")
    assert outcome.f.shape == (0, 3)


def test_no_contacts():
    blocks = (box("ground", (0, 0, 0), (1, 1, 1), True), box("stone", (0, 0, 5), (1, 1, 6)))
    floating = Assembly(blocks, Contacts.of([], []))
    assert solve_cra(posed(floating)).word == "collapse"
    weightless = solve_cra(posed(floating, gravity=np.zeros(3)))
    assert weightless.word == "coupled"


@pytest.mark.parametrize("tilt", [0.0, 1.0])
def test_no_friction(tilt):
    system = posed(wall(3, 3), 0.0, turned_gravity(DOWN, tilt))
    outcome = solve_cra(system)
    assert outcome.word == ("coupled" if tilt == 0.0 else "collapse")
    assert outcome.f is None or np.all(outcome.f[:, 1:] == 0.0)


def test_smooth_and_rough_joints_together():
    model = wall(3, 3)
    mu = np.where(np.arange(len(model.contacts)) % 3 == 0, 0.0, 0.7)
    model = replace(model, contacts=replace(model.contacts, mu=mu))
    system = posed(model, gravity=turned_gravity(DOWN, 3.0))
    outcome = solve_cra(system)
    assert outcome.word == "coupled"
    assert accepted(system, outcome)
    assert np.all(outcome.f[system.mu == 0.0, 1:] == 0.0)


@pytest.mark.parametrize(
    "polygon",
    [
        [(0, 0), (1, 0), (0.5, 1)],
        [(0.499999, 0), (0.500001, 0), (0.500001, 1), (0.499999, 1)],
        [(0, 0), (0.3, 0), (0.6, 0), (1, 0), (1, 1), (0, 1)],
        ROUND,
    ],
    ids=["three points", "thin", "points in line", "round"],
)
def test_contact_shapes(polygon):
    system = posed(on_ground(polygon))
    outcome = solve_cra(system)
    assert outcome.word == "coupled"
    assert accepted(system, outcome)


def test_a_round_joint_on_a_slope():
    """Of 24 points, programme A presses on more than a state needs."""
    system = posed(on_ground(ROUND), gravity=turned_gravity(DOWN, 15.0))
    assert (priced(system).f[:, 0] > 1e-6).sum() > 6
    outcome = solve_cra(system)
    assert outcome.word == "coupled"
    assert accepted(system, outcome)


@pytest.mark.parametrize(("pull", "word"), [(0.5, "coupled"), (0.83, "coupled"), (0.85, "collapse")])
def test_pushed_at_its_foot(pull, word):
    """A load sideways at the base slides the block at mu times its weight."""
    model = on_ground(SQUARE)
    weight = 2400.0 * G
    system = posed(replace(model, loads=(Load(1, np.array([pull * weight, 0, 0]), np.array([0.5, 0.5, 0.0])),)))
    outcome = solve_cra(system)
    assert outcome.word == word
    assert word == "collapse" or accepted(system, outcome)


def test_lifted_by_its_own_weight_nothing_presses():
    model = on_ground(SQUARE)
    lift = Load(1, np.array([0.0, 0.0, 2400.0 * G]), np.array([0.5, 0.5, 0.5]))
    outcome = solve_cra(posed(replace(model, loads=(lift,))))
    assert outcome.word == "coupled"
    assert np.abs(outcome.f).max() < 1e-9


# Laws of the verdict


@settings(max_examples=examples(12), deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10**6), scale=st.sampled_from([1e-3, 1.0, 50.0, 1e3]), density=st.floats(1.0, 1e4),
    family=st.sampled_from(["stack", "arch", "wall"]), tilt=st.floats(0.0, 14.0),
)  # fmt: skip
def test_word_depends_on_neither_units_place_direction_nor_order(seed, scale, density, family, tilt):
    rng = np.random.default_rng(seed)
    model = {"stack": lambda: stack(3, offset=0.15), "arch": lambda: arch(7, radius=1.0, thickness=0.25),
             "wall": lambda: wall(2, 3)}[family]()  # fmt: skip
    gravity = turned_gravity(DOWN, tilt, float(rng.uniform(0, 360)))
    was = solve_cra(posed(model, 0.7, gravity))
    turn, shift, order = rotation(seed), rng.uniform(-10, 10, 3), rng.permutation(len(model.blocks))
    blocks = tuple(
        replace(model.blocks[i], vertices=scale * (model.blocks[i].vertices + shift) @ turn.T) for i in order
    )
    place, patches = np.argsort(order), rng.permutation(len(model.contacts))
    old = model.contacts
    polygons = [scale * (old.point[old.start[k] : old.start[k + 1]] + shift) @ turn.T for k in patches]
    contacts = Contacts.of([(place[old.a[k]], place[old.b[k]]) for k in patches], polygons)
    system = posed(Assembly(blocks, contacts), 0.7, gravity @ turn.T, density)
    now = solve_cra(system)
    assert now.word == was.word != "undecided"
    assert now.word != "coupled" or accepted(system, now)


def test_sliding_is_measured_as_the_checker_measures_it() -> None:
    """A shortfall of 2e-9 of beta_min is less than 1e-10 eps: too little to see in eps, too much for the checker."""
    model = stack(1, size=(1.0, 1.0, 1.0))
    system = posed(model, 0.84, np.array([0.2 * 9.80665, 0.0, -9.80665]))
    outcome = solve_cra(system, Bounds())
    assert outcome.f is not None
    assert outcome.dq is not None
    slide = float(np.min(np.hypot(*system.gap(outcome.dq)[:, 1:].T)))
    assert measure(system, Bounds(beta=slide), outcome.f, outcome.dq).accepted
    assert not measure(system, Bounds(beta=slide * (1.0 + 2e-9)), outcome.f, outcome.dq).accepted


def test_friction_that_pushes_on_is_refused_however_small() -> None:
    """The checker takes |f_t| above 1e-9 of the force as friction, and friction must act against sliding."""
    model = stack(1, size=(1.0, 1.0, 1.0))
    system = posed(model, 0.84, np.array([0.2 * 9.80665, 0.0, -9.80665]))
    outcome = solve_cra(system, Bounds())
    assert outcome.f is not None
    assert outcome.dq is not None
    d = system.gap(outcome.dq)[0, 1:]
    turned = outcome.f.copy()
    turned[0, 1:] = 5e-9 * d / np.hypot(*d)
    assert measure(system, Bounds(), turned, outcome.dq).alignment >= 4e-9
    turned[0, 1:] *= -1.0
    assert measure(system, Bounds(), turned, outcome.dq).alignment <= 2e-10


def test_a_tree_of_one_case_is_said_in_the_singular():
    from cyclopean.analysis.preparation import prepare
    from cyclopean.analysis.reasons import reason_for

    model = prepare(stack(1), Settings())
    for leaves, words in ((1, "the only case is proved impossible"), (35, "35 cases, each proved impossible")):
        assert words in reason_for(model, Bounds(), "cra-tree", None, {"leaves": leaves}, {"method": "cra"})
