"""The live engine: a warm answer is that of a cold start, and nothing is called proved that is not.

By hand: a cube on a slope of tilt t stands iff mu >= tan t and t <= 45 degrees; pushed by a share s of its weight on
the level, iff s <= min(mu, 1). Tilt t and push s along the same axis: the slope of the load is (sin t + s) / cos t.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Settings, check, solve_rbe
from cyclopean.analysis.interactive import Knobs, LiveModel
from cyclopean.analysis.proving import Claim, rigid_claim
from cyclopean.assembly import Contacts, Load
from cyclopean.design import arch, dome, stack, wall
from cyclopean.errors import InputError
from cyclopean.statics import equilibrium_system
from laws import examples


def marked(model):
    """Supports marked, as the page has them."""
    if any(block.fixed for block in model.blocks):
        return model
    low = min(block.vertices[:, 2].min() for block in model.blocks)
    blocks = tuple(replace(b, fixed=bool(b.vertices[:, 2].min() <= low + 1e-9)) for b in model.blocks)
    return replace(model, blocks=blocks)


CUBE = marked(stack(1, size=(1.0, 1.0, 1.0)))
MODELS = {"wall": marked(wall(6, 5)), "arch": marked(arch(12, span=3.0, thickness=0.4)), "dome": marked(dome(4, 8))}


@given(mu=st.floats(0.05, 2.0), tilt=st.floats(0.0, 60.0), push=st.floats(-0.9, 0.9))
@settings(max_examples=examples(40), deadline=None)
def test_a_cube_by_hand(mu, tilt, push):
    slope = (np.sin(np.radians(tilt)) + push) / np.cos(np.radians(tilt))
    limit = min(mu, 1.0)
    assume(abs(abs(slope) - limit) > 1e-6)
    live = LiveModel(CUBE)
    answer = live.solve(Knobs(mu=mu, everywhere=True, tilt=tilt, push=(push, 0.0)))
    assert answer.word == ("balanced" if abs(slope) < limit else "collapse")


@pytest.mark.parametrize("name", MODELS)
def test_only_loads_and_friction_are_new(name):
    model = MODELS[name]
    load = Load(len(model) - 1, np.array([100.0, -50.0, -300.0]), model.mass.centroid[-1] + 0.1)
    model = replace(model, loads=(load,))
    live = LiveModel(model, density=2000.0)
    knobs = Knobs(mu=0.55, everywhere=True, tilt=7.0, azimuth=30.0, push=(0.1, -0.05))
    contacts = replace(model.contacts, mu=np.full(len(model.contacts), 0.55))
    gravity = knobs.turned(live.gravity)
    fresh = equilibrium_system(model, contacts, live.fixed, gravity, 2000.0)
    quick = live.system(knobs)
    assert quick.p == pytest.approx(fresh.p, rel=1e-12, abs=1e-12)
    assert quick.force_unit == pytest.approx(fresh.force_unit, rel=1e-12)
    assert np.array_equal(quick.mu, fresh.mu)
    assert (quick.A != fresh.A).nnz == 0


@pytest.mark.parametrize("name", MODELS)
@given(
    walk=st.lists(st.tuples(st.floats(0.2, 1.2), st.floats(0.0, 45.0), st.floats(0.0, 360.0)), min_size=2, max_size=7)
)
@settings(max_examples=examples(6), deadline=None)
def test_warm_is_cold_on_any_walk_of_the_sliders(name, walk):
    live = LiveModel(MODELS[name])
    for mu, tilt, azimuth in walk:
        answer = live.solve(Knobs(mu=mu, everywhere=True, tilt=tilt, azimuth=azimuth))
        cold = solve_rbe(answer.system)
        assert answer.word in (cold.word, "balanced" if cold.word == "undecided" else cold.word)
        outcome = answer.outcome
        if answer.word == "balanced":
            off = np.linalg.norm(answer.system.residual(outcome.f)) / len(answer.system.free)
            assert off <= 1e-9
            fn, ft = outcome.f[:, 0], np.hypot(outcome.f[:, 1], outcome.f[:, 2])
            assert (ft <= answer.system.mu * fn + 1e-9).all()
        else:
            assert outcome.bound >= 1e6


def test_a_known_mechanism_answers_without_a_factorisation():
    live = LiveModel(MODELS["wall"])
    assert live.solve(Knobs(tilt=44.0)).word == "collapse"
    again = live.solve(Knobs(tilt=46.0))
    assert again.outcome.provenance == {"solver": "known mechanism", "factorisations": 0}
    assert live.solve(Knobs(tilt=1.0)).word == "balanced"


def test_a_small_turn_costs_fewer_factorisations_than_a_cold_start():
    live = LiveModel(MODELS["dome"])
    live.solve(Knobs(tilt=5.0))
    warm = live.solve(Knobs(tilt=5.2)).outcome.provenance["factorisations"]
    cold = LiveModel(MODELS["dome"]).solve(Knobs(tilt=5.2)).outcome.provenance["factorisations"]
    assert warm < cold


def test_mu_of_the_model_wins_unless_it_is_overruled():
    mu = [0.3] * len(MODELS["wall"].contacts)
    given_mu = replace(MODELS["wall"].contacts, mu=np.array([*mu[:-1], np.nan]))
    live = LiveModel(replace(MODELS["wall"], contacts=given_mu))
    assert live.friction(Knobs(mu=0.9)).tolist() == [*mu[:-1], 0.9]
    assert set(live.friction(Knobs(mu=0.9, everywhere=True)).tolist()) == {0.9}


def test_a_claim_is_never_shown_as_a_verdict():
    for tilt in (0.0, 44.0):
        live = LiveModel(MODELS["wall"])
        shown = live.shown(live.solve(Knobs(tilt=tilt)))
        assert (shown.verdict, shown.certificate) == ("undecided", None)
        assert (shown.force is not None) == (tilt == 0.0)
        assert (shown.mechanism is not None) == (tilt > 0.0)


@pytest.mark.parametrize(("tilt", "method"), [(3.0, "rbe"), (44.0, "rbe"), (3.0, "cra"), (44.0, "cra")])
def test_a_claim_leads_to_what_check_says(tilt, method):
    model, live = MODELS["arch"], LiveModel(MODELS["arch"])
    knobs = Knobs(mu=0.8, tilt=tilt)
    answer = live.solve(knobs)
    said = Settings(method=method, mu=0.8, gravity=tuple(knobs.turned(live.gravity).tolist()))
    claim = rigid_claim(answer.outcome) if method == "rbe" or tilt > 40.0 else None
    found = check(model, said, warm=claim)
    expected = check(model, Settings(method=method, mu=0.8, tilt=(tilt, 0.0)))
    assert found.verdict == expected.verdict == ("stable" if tilt < 40.0 else "unstable")
    assert found.certificate["kind"] == expected.certificate["kind"]


def test_a_false_claim_is_found_out_and_solved_again():
    live = LiveModel(MODELS["arch"])
    answer = live.solve(Knobs(mu=0.8))
    bad = Claim("rbe-state", 1.01 * answer.outcome.f, provenance={"solver": "made up"})
    found = check(MODELS["arch"], Settings(method="rbe", mu=0.8), warm=bad)
    assert found.verdict == "stable"
    assert found.provenance["solver"] != "made up"


def test_balance_alone_is_no_coupled_state():
    claim = rigid_claim(LiveModel(MODELS["arch"]).solve(Knobs(mu=0.8)).outcome)
    assert claim.kind == "rbe-state"
    assert check(MODELS["arch"], Settings(method="cra", mu=0.8), warm=claim).certificate["kind"] == "cra-state"


def test_a_mechanism_can_be_learned():
    model = MODELS["arch"]
    live, knobs = LiveModel(model), Knobs(mu=0.8, tilt=44.0)
    result = check(model, Settings(method="rbe", mu=0.8, gravity=tuple(knobs.turned(live.gravity).tolist())))
    live.learn(result)
    assert live.solve(knobs).outcome.provenance["solver"] == "known mechanism"


def test_loose_and_lonely_blocks_fall():
    model = replace(MODELS["arch"], contacts=Contacts.of([], []))
    answer = LiveModel(model).solve(Knobs())
    assert answer.word == "collapse"
    result = check(model, Settings(method="rbe"), warm=rigid_claim(answer.outcome))
    assert result.verdict == "unstable"
    assert result.reason.startswith("Nothing holds block")


@pytest.mark.parametrize(
    "values", [{"mu": -0.1}, {"mu": np.nan}, {"tilt": np.inf}, {"push": (0.0, np.nan)}, {"azimuth": np.nan}]
)
def test_bad_knobs_are_refused(values):
    with pytest.raises(InputError):
        Knobs(**values)


def test_contacts_are_wanted():
    with pytest.raises(InputError, match="contacts are missing"):
        LiveModel(replace(CUBE, contacts=None))
