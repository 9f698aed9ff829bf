"""The least eta at which a state is proved.

By hand: a beam of half-length a and height h between two fixed upright walls (see `coupled_cases`) needs
eta = 4 (a / h) eps + beta_min, whatever the friction beyond h / a. Let down by s more it slides by s more everywhere
and is still a state: one of eta + s.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupled_cases import beams, coupled_case
from cyclopean.analysis import Settings
from cyclopean.analysis.coupled.search import solve_cra
from cyclopean.analysis.coupled.smallest_eta import SPARE, smallest_eta
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.analysis.preparation import prepare
from cyclopean.analysis.proving import Claim, prove
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from laws import examples

LOW = Bounds(1.0, 1.0, 0.01)
PROGRAMMES = 40


def let_down(half, height, by, mu=None, scale=1.0):
    """A beam between walls, prepared, its system, and a state of it that slides by so many eps more than it must.

    It turns by 2 eps / h, so that its upper right and its lower left edge press, and comes down by (2 a / h) eps +
    beta_min + `by`. The lower left edge rubs and bears the weight W; both thrusts are W a / h.
    """
    model = beams(half, height, 0.7)
    blocks = tuple(replace(b, vertices=scale * b.vertices) for b in model.blocks)
    grown = Assembly(blocks, replace(model.contacts, point=scale * model.contacts.point))
    posed = prepare(grown, Settings(mu=3.0 * height / half if mu is None else mu))
    system = posed.system()
    on_a = (system.row_a == 0)[:, None]
    arm = np.where(on_a, system.arm_a, system.arm_b)
    x, z = arm[:, 0], arm[:, 2]
    thrust, weight = (x * z > 0.0) * half / height / 2.0, ((x < 0.0) & (z < 0.0)) / 2.0
    force = np.stack([-np.sign(x) * thrust, 0.0 * x, weight], 1)
    f = np.einsum("qij,qj->qi", system.frame, np.where(on_a, -force, force))
    unit = system.length_unit / scale
    turn = 2.0 * unit / height
    fall = 2.0 * half / height + LOW.beta + by
    return posed, system, f, np.array([0.0, 0.0, -fall, 0.0, turn, 0.0])


def proved(posed, system, eta, f, dq, **said):
    return prove(posed, Settings(eta=eta, **said), system, Claim("cra-state", f, dq)).verdict


@pytest.mark.parametrize(("half", "height"), [(1.0, 1.0), (1.0, 0.5), (0.4, 1.0)])
def test_a_beam_between_walls_by_hand(half, height):
    posed, system, f, dq = let_down(half, height, 20.0)
    assert np.max(np.abs(system.gap(dq))) > 20.0
    eta, f, dq = smallest_eta(system, LOW, f, dq, PROGRAMMES)
    assert eta == pytest.approx(4.0 * half / height + SPARE * LOW.beta, rel=1e-5)
    assert proved(posed, system, eta * (1.0 + 1e-9), f, dq, mu=3.0 * height / half) == "stable"
    assert (
        proved(posed, system, eta * 0.999, f, dq, mu=3.0 * height / half) == "undecided"
    )  # the checker has eyes for it


@settings(max_examples=examples(40), deadline=None)
@given(st.floats(0.4, 2.0), st.floats(0.4, 2.0), st.floats(1.1, 3.0), st.floats(1e-3, 1e3))
def test_no_unit_changes_it(half, height, more, scale):
    _, system, f, dq = let_down(half, height, 5.0, more * height / half, scale)
    eta, *_ = smallest_eta(system, LOW, f, dq, PROGRAMMES)
    assert eta == pytest.approx(4.0 * half / height + SPARE * LOW.beta, rel=1e-4)


@settings(max_examples=examples(20), deadline=None)
@given(st.integers(0, 10_000))
def test_never_above_the_start_and_proved(seed):
    case = coupled_case(seed)
    posed = prepare(case.assembly, Settings(mu=case.mu, gravity=case.gravity))
    system = posed.system()
    found = solve_cra(system, Bounds(1.0, 100.0, 0.01), Settings(nodes=1, seconds=2.0))
    if found.word != "coupled":
        return
    gap = system.gap(found.dq)
    before = float(np.max(np.maximum(gap[:, 0], np.hypot(gap[:, 1], gap[:, 2])), initial=0.0))
    eta, f, dq = smallest_eta(system, LOW, found.f, found.dq, PROGRAMMES)
    assert eta <= before
    word = proved(posed, system, max(eta, 1.0) * (1.0 + 1e-9), f, dq, mu=case.mu, gravity=case.gravity)
    assert word == "stable"


def test_nothing_is_lowered_without_programmes_or_once_stopped():
    _, system, f, dq = let_down(1.0, 1.0, 20.0)
    for kept in (smallest_eta(system, LOW, f, dq, 0), smallest_eta(system, LOW, f, dq, PROGRAMMES, lambda: True)):
        assert (kept[1] == f).all()
        assert (kept[2] == dq).all()


def test_an_eta_that_is_good_enough_ends_it():
    _, system, f, dq = let_down(1.0, 1.0, 20.0)
    eta, f, dq = smallest_eta(system, replace(LOW, eta=10.0), f, dq, PROGRAMMES)
    assert 9.0 < eta <= 10.0
    assert measure(system, replace(LOW, eta=10.0), f, dq).accepted


def test_what_is_no_state_is_refused():
    _, system, f, dq = let_down(1.0, 1.0, 0.0)
    with pytest.raises(InputError, match="no coupled state"):
        smallest_eta(system, LOW, 1.01 * f, dq, PROGRAMMES)
