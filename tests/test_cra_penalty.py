"""The penalty form of coupled rigid-block analysis: where a model would need glue.

By hand: a block of weight W and length 1 shifted by a beyond half of it hangs on its support's edge, about which its
weight turns with arm a - 1/2; glue along the far side of the joint, 1 - a behind the edge, must pull with
W (a - 1/2) / (1 - a). A block between two held faces that lean by 30 degrees and open downwards (`16_A`) drops away
from both: glue alone can hold it, without any friction, and its upward share is sin 30: twice the weight is needed.

Mutants killed by hand: the glue's column or its frame without the minus sign (it then presses), without 1 / w (opens by
eps instead), an opening in terms of eps rather than eta, glue not taken off the forces, `pull` not divided by w, a
state returned as exact without being measured.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Settings, check, solve_rbe, tension
from cyclopean.analysis.coupled.penalty_form import coupled_tension, glued
from cyclopean.analysis.coupled.polish import Attempt
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.assembly import Assembly, Block, Contacts, supports
from cyclopean.design import arch, stack, wall
from cyclopean.errors import SolverError
from cyclopean.io import read_model
from cyclopean.statics import EquilibriumSystem, equilibrium_system
from fixtures_compas_cra import FOLDER, needs_fixtures, raw
from laws import examples, nightly, some
from near_limit import G, posed

UPRIGHT = np.array([0.0, 0.0, -G])
BOUNDS = Bounds()
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def tilted(degrees: float) -> np.ndarray:
    angle = np.deg2rad(degrees)
    return G * np.array([np.sin(angle), 0.0, -np.cos(angle)])


def box(name: str, low: tuple[float, ...], high: tuple[float, ...], fixed: bool = False) -> Block:
    (x, y, z), (X, Y, Z) = low, high
    corners = [(x, y, z), (X, y, z), (X, Y, z), (x, Y, z), (x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)]
    return Block(name, np.array(corners), FACES, fixed=fixed)


def frame() -> EquilibriumSystem:
    """A beam between two held columns, with nothing underneath: RBE squeezes it, CRA does not."""
    blocks = (
        box("left", (0, 0, 0), (0.4, 0.4, 1.2), True),
        box("right", (1.0, 0, 0), (1.4, 0.4, 1.2), True),
        box("beam", (0.4, 0, 0.6), (1.0, 0.4, 0.9)),
    )
    rings = [np.array([(x, 0, 0.6), (x, 0.4, 0.6), (x, 0.4, 0.9), (x, 0, 0.9)]) for x in (0.4, 1.0)]
    return posed(Assembly(blocks, Contacts.of([(0, 2), (2, 1)], rings, [None, None])), 0.84, UPRIGHT)


def peer(name: str) -> EquilibriumSystem:
    model = read_model(str(FOLDER / f"{name}.json"))[0]
    assert model.contacts is not None
    return equilibrium_system(model, model.contacts.with_mu(raw(name)["mu"]), supports(model)[0], UPRIGHT, 2400.0)


def true_forces(system: EquilibriumSystem, pull: np.ndarray, found: Attempt) -> np.ndarray:
    f = found.f[: system.points].copy()
    f[:, 0] -= pull
    return f


def hold_together(system: EquilibriumSystem, pull: np.ndarray, found: Attempt) -> None:
    """Balance, and glue only where nothing presses and the joint has opened by half of eta: from scratch."""
    f, dq, opening = true_forces(system, pull, found), found.dq, 0.5 * BOUNDS.eta
    loads = np.abs(system.p.reshape(-1, 6)[:, 2]).sum()
    assert np.linalg.norm(system.residual(f)) < 1e-9 * loads
    pressing = f[:, 0] + pull
    assert np.all(pressing >= -1e-9)
    assert np.all(np.hypot(f[:, 1], f[:, 2]) <= system.mu * pressing + 1e-9)
    d = system.gap(dq)
    assert np.all(d[:, 0] >= -1.0 - 1e-9)
    assert np.all(pressing * (d[:, 0] + 1.0) < 1e-9 * np.maximum(1.0, pressing))
    assert np.all(np.abs(np.minimum(pressing, pull)) <= 1e-9)
    assert d[pull > 1e-9, 0] == pytest.approx(opening, rel=1e-8)
    assert np.all(d[:, 0] <= BOUNDS.eta)
    assert np.all(np.einsum("kj,kj->k", f[:, 1:], d[:, 1:]) <= 1e-9)


@settings(max_examples=examples(15), deadline=None)
@given(shift=st.floats(0.52, 0.95), mu=st.floats(0.1, 1.0))
def test_an_overhanging_block_by_hand(shift: float, mu: float) -> None:
    system = posed(stack(2, ground=False, offset=shift), mu, UPRIGHT)
    pull, found = coupled_tension(system, BOUNDS)
    assert found.found
    assert pull.sum() / system.total == pytest.approx((shift - 0.5) / (1.0 - shift), rel=1e-8)
    hold_together(system, pull, found)


@pytest.mark.parametrize("model", [stack(3, offset=0.1), wall(3, 4), arch(11)], ids=["stack", "wall", "arch"])
@pytest.mark.parametrize("tilt", [0.0, 4.0])
def test_what_stands_needs_none(model: Assembly, tilt: float) -> None:
    system = posed(model, 0.84, tilted(tilt))
    pull, found = coupled_tension(system, BOUNDS)
    assert not pull.any()
    assert measure(system, BOUNDS, found.f, found.dq).accepted
    known = coupled_tension(system, BOUNDS, state=(found.f, found.dq))
    assert known[1].f is found.f


@pytest.mark.parametrize("thickness", some([0.08, 0.1]))
def test_a_thin_arch_is_glued_at_its_hinges_and_nowhere_else(thickness: float) -> None:
    """Less in all than rigid-block equilibrium's square price asks for, and at a few joints only."""
    system = posed(arch(20, radius=1.0, thickness=thickness), 0.7, UPRIGHT)
    assert solve_rbe(system).word == "collapse"
    pull, found = coupled_tension(system, BOUNDS)
    assert found.found
    hold_together(system, pull, found)
    assert 0.0 < pull.sum() / system.total * system.blocks <= tension(system)[1].sum() * (1 + 1e-6)
    assert 0 < np.count_nonzero(pull) <= system.points // 4


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_neither_size_nor_eps_matters(scale: float) -> None:
    size = (scale, scale, scale)
    here = coupled_tension(posed(stack(2, ground=False, offset=0.8), 0.84, UPRIGHT), BOUNDS)
    large = stack(2, size, ground=False, offset=0.8 * scale)
    there = coupled_tension(posed(large, 0.84, UPRIGHT), Bounds(2.0, 20.0, 0.02))
    assert there[0].sum() == pytest.approx(here[0].sum(), rel=1e-8)
    assert there[0] == pytest.approx(here[0], rel=1e-6, abs=1e-9)


def test_glue_does_not_stop_sliding() -> None:
    """Beyond friction a flat joint would have to press and pull at once: no state, and it is said so."""
    system = posed(stack(1), 0.5, tilted(30.0))
    pull, found = coupled_tension(system, BOUNDS)
    assert not found.found
    assert pull.sum() == pytest.approx(tension(system)[1].sum(), rel=1e-3)
    assert np.abs(system.residual(true_forces(system, pull, found))).max() < 1e-7


def test_an_h_frame_cannot_be_glued_either() -> None:
    """What one face opens the other closes, so neither opens by w: forces that balance, and no state."""
    system = frame()
    assert solve_rbe(system).word == "balanced"
    pull, found = coupled_tension(system, BOUNDS)
    assert not found.found
    assert pull.sum() < 1e-6
    assert np.abs(system.residual(true_forces(system, pull, found))).max() < 1e-7


@needs_fixtures
@pytest.mark.parametrize(
    ("name", "eta", "expected", "peer_says"),
    [
        ("03b_offset0.75", 10.0, 1.0, 1.0),
        ("03_offset0.75_tilt40", 10.0, 2.0516, 2.1),
        ("05_wedge_type-c_y90", 100.0, 0.34682, 0.38),  # the peer prices squares: ours is the smaller sum
        ("05_wedge_type-d_y90", 100.0, 0.34682, 0.35),
        ("16_A", 10.0, 2.0, 2.0),
    ],
)
def test_against_the_peer(name: str, eta: float, expected: float, peer_says: float) -> None:
    system = peer(name)
    pull, found = coupled_tension(system, Bounds(1.0, eta, 0.01))
    assert found.found
    assert pull.sum() / system.total == pytest.approx(expected, rel=1e-4)
    assert pull.sum() / system.total <= peer_says * 1.01


@nightly  # as the frame above
@needs_fixtures
def test_the_peers_h_frame() -> None:
    """The peer answers "infeasible" for its penalty form, locally; so do we."""
    assert not coupled_tension(peer("16_H"), BOUNDS)[1].found


def test_a_glue_point_is_a_contact_that_faces_the_other_way() -> None:
    system = posed(stack(1), 0.84, UPRIGHT)
    both = glued(system, 5.0)
    lift = np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0])
    assert both.gap(lift)[:4, 0] == pytest.approx([5.0] * 4)
    assert both.gap(lift)[4:] == pytest.approx(np.array([[-1.0, 0.0, 0.0]] * 4))
    pulled = np.zeros((8, 3))
    pulled[4:, 0] = 5.0  # a unit pull at each point
    assert (both.A @ pulled.ravel())[2] == pytest.approx(-4.0)


def test_refusals() -> None:
    far, slab = box("far", (9, 9, 9), (10, 10, 10)), box("slab", (0, 0, 0), (1, 1, 0.2), True)
    loose = Assembly(
        (slab, box("cube", (0, 0, 0.2), (1, 1, 1.2)), far),
        Contacts.of([(0, 1)], [np.array([(0, 0, 0.2), (1, 0, 0.2), (1, 1, 0.2), (0, 1, 0.2)])], [None]),
    )
    with pytest.raises(SolverError, match="no forces balance the loads"):
        coupled_tension(posed(loose, 0.84, UPRIGHT), BOUNDS)
    with pytest.raises(SolverError, match="no forces balance the loads"):
        coupled_tension(posed(stack(1), 0.0, tilted(10.0)), BOUNDS)
    nothing = Assembly(
        (box("slab", (0, 0, 0), (1, 1, 0.2), True), box("far", (9, 9, 9), (10, 10, 10))), Contacts.of([], [], [])
    )
    with pytest.raises(SolverError, match="no joint to glue"):
        coupled_tension(posed(nothing, 0.84, UPRIGHT), BOUNDS)


def test_a_false_state_is_not_believed() -> None:
    """Forces of equilibrium without a motion are no state: the search starts all the same."""
    system = posed(stack(1), 0.84, UPRIGHT)
    f = solve_rbe(system).f
    assert f is not None
    assert coupled_tension(system, BOUNDS, state=(f, np.zeros(6)))[1].found


def test_check_says_where_not_even_glue_makes_a_state():
    """A slope beyond friction has no glued state; a block past the edge has one, and no warning."""
    slides = check(stack(1), Settings(mu=0.3, tilt=(30.0, 0.0), penalty=True))
    assert slides.verdict == "unstable"
    assert not slides.tension_exact
    assert any("not even glue makes a coupled state" in warning for warning in slides.warnings)
    hangs = check(stack(2, offset=0.75), Settings(penalty=True))
    assert hangs.tension_exact
    assert not any("glue" in warning for warning in hangs.warnings)
