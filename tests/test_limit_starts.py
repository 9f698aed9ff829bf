"""Where the search for a limit starts, and where it may stop: inside both cones, every iterate proves two bounds.

By hand. On a block of scaled weight 1 that stands on four corners, forces balance with at least delta at each as long
as 4 delta <= 1: `pressing` finds 0.03. A motion that opens every joint lifts it: dn >= 1/2 at each corner. Between two
walls that stand on the ground and lean over it, no motion opens every joint.
"""

from dataclasses import replace
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

from cyclopean.analysis import Live, Reach, Settings, limit, polar, pushover
from cyclopean.analysis.limit_analysis import budget
from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.growing import GrowingModel
from cyclopean.analysis.limit_analysis.interior import Start, limit_interior
from cyclopean.analysis.limit_analysis.load_family import proving_multiplier
from cyclopean.analysis.limit_analysis.polish import rebalanced
from cyclopean.analysis.limit_analysis.starting import opening, pressing
from cyclopean.analysis.preparation import prepare
from cyclopean.assembly import Load
from cyclopean.design import arch, dome, stack, wall
from cyclopean.errors import InputError
from cyclopean.proof import verify
from cyclopean.statics import Schur

PUSH = Live(push=(1.0, 0.0, 0.0))
MODELS = {
    "block": stack(1),
    "wall": wall(5, 6),
    "arch": arch(9, thickness=1.2),
    "dome": dome(3, 8, thickness=0.2),
    "tall": wall(4, 24),
}


def posed_pencil(assembly, live=PUSH, mu=0.7):
    return GrowingModel.of(prepare(assembly, Settings(mu=mu)), live).pencil


def spare(f, mu):
    """How far forces are inside their cones, along the normal."""
    return f[:, 0] - np.hypot(f[:, 1], f[:, 2]) / mu


@pytest.mark.parametrize("name", MODELS)
def test_forces_that_press_on_every_joint(name):
    loads = posed_pencil(MODELS[name])
    f = pressing(loads.system, Schur(loads.system))
    assert f is not None
    assert loads.balance(f, 0.0) <= 1e-11
    assert spare(f, loads.system.mu).min() >= 3e-4 * (1 - 1e-9)


def test_a_block_spares_what_is_asked_for_first():
    loads = posed_pencil(stack(1))
    f = pressing(loads.system, Schur(loads.system))
    assert spare(f, loads.system.mu).min() >= 0.03 * (1 - 1e-9)
    assert f[:, 0].sum() == pytest.approx(-loads.system.p[2])


@pytest.mark.parametrize("name", MODELS)
def test_a_motion_that_opens_every_joint(name):
    loads = posed_pencil(MODELS[name])
    y = opening(loads.system, Schur(loads.system))
    dd = loads.system.gap(y)
    assert (dd[:, 0] - loads.system.mu * np.hypot(dd[:, 1], dd[:, 2])).min() >= 0.5 * (1 - 1e-9)


def test_what_cannot_stand_has_no_such_forces():
    thin = posed_pencil(arch(15, thickness=0.05), mu=0.84)
    assert pressing(thin.system, Schur(thin.system)) is None


def test_what_is_wedged_has_no_such_motion():
    """A block on the ground, under the same ground: what lifts it off one presses it on the other."""
    loads = posed_pencil(stack(1))
    system = loads.system
    both = replace(
        system,
        used=np.tile(system.used, 2),
        row_a=np.tile(system.row_a, 2),
        row_b=np.tile(system.row_b, 2),
        arm_a=np.tile(system.arm_a, (2, 1)),
        arm_b=np.tile(system.arm_b, (2, 1)),
        frame=np.concatenate([system.frame, system.frame * np.array([-1.0, 1.0, -1.0])[:, None]]),
        mu=np.tile(system.mu, 2),
        A=_beside(system),
    )
    assert opening(both, Schur(both)) is None


def _beside(system):
    import scipy.sparse as sp

    return sp.hstack([system.A, system.A @ sp.diags(np.tile([-1.0, 1.0, -1.0], system.points))], format="csr")


@pytest.mark.parametrize("name", ["wall", "arch", "dome"])
@pytest.mark.parametrize("cap", [3, 6, 10])
def test_every_iterate_proves_both_bounds(name, cap):
    loads = posed_pencil(MODELS[name])
    schur = Schur(loads.system)
    best = limit_interior(loads, schur)
    start = Start(pressing(loads.system, schur), opening(loads.system, schur))
    point = limit_interior(loads, schur, cap=cap, start=start)
    assert point.steps <= cap
    f, low = rebalanced(loads, schur, point.f, point.s)
    assert loads.balance(f, low) <= 1e-10
    assert low == pytest.approx(point.s, abs=1e-7)
    high = proving_multiplier(loads, point.y)
    assert low <= best.s + 1e-6
    assert best.s - 1e-6 <= high
    assert cap < 6 or high < np.inf


def test_what_is_out_of_balance_along_the_mechanism_moves_the_multiplier():
    """Forces of the limit, taken for those of a ten-thousandth more: no forces balance that, so that s has to give."""
    loads = posed_pencil(MODELS["wall"])
    schur = Schur(loads.system)
    point = limit_interior(loads, schur, start=Start(pressing(loads.system, schur), opening(loads.system, schur)))
    f, low = rebalanced(loads, schur, point.f, 1.0001 * point.s)
    assert loads.balance(f, low) <= 1e-10
    assert low == pytest.approx(point.s, rel=1e-6)


def test_no_time_no_steps():
    loads = posed_pencil(MODELS["wall"])
    late = Budget(1.0, began=UNLIMITED.began - 10.0)
    assert limit_interior(loads, Schur(loads.system), budget=late).steps == 0
    assert opening(loads.system, Schur(loads.system), late) is None


def test_starts_inside_and_outside_agree():
    loads = posed_pencil(MODELS["wall"])
    schur = Schur(loads.system)
    inside = limit_interior(loads, schur, start=Start(pressing(loads.system, schur), opening(loads.system, schur)))
    assert inside.word == "solved"
    assert inside.s == pytest.approx(limit_interior(loads, schur).s, rel=1e-6)


@pytest.mark.parametrize("seconds", [0.02, 0.15, 0.4, 60.0])
def test_bounds_in_time_are_bounds(seconds):
    """However little time there is: what is answered is proved, and holds the limit between."""
    model = wall(14, 14)
    best = limit(model, PUSH, Settings(mu=0.7))
    found = limit(model, PUSH, Settings(mu=0.7), seconds=seconds)
    assert found.word in ("limit", "undecided")
    assert found.lower is None or found.lower <= best.upper
    assert found.upper is None or found.upper >= best.lower
    assert found.certificate is None or verify(found.certificate).proved
    assert (found.lower is None and found.upper is None) == (found.certificate is None)
    if found.word == "undecided":
        assert "Time ran out" in found.reason


def test_a_tilt_in_time_with_a_load_that_does_not_turn():
    model = stack(2, size=(1.0, 1.0, 1.0))
    loaded = replace(model, loads=(Load(2, np.array([0.0, 0.0, -5000.0]), model.mass.centroid[2]),))
    best = limit(loaded, Live(tilt=0.0), Settings(mu=0.5))
    found = limit(loaded, Live(tilt=0.0), Settings(mu=0.5), seconds=1e-3)
    for one in (best, limit(loaded, Live(tilt=0.0), Settings(mu=0.5), seconds=30.0)):
        assert one.word == "limit"
    assert found.lower is None or found.lower <= best.upper


def test_time_for_many_is_shared(monkeypatch):
    """By a clock that goes on by a hundredth of a second whenever it is read, so that the machine does not matter."""
    ticks = count(0.0, 0.01)
    monkeypatch.setattr(budget, "time", SimpleNamespace(perf_counter=ticks.__next__, process_time=ticks.__next__))
    around = polar(stack(2), Live(tilt=0.0), Settings(mu=0.5), count=3, seconds=30.0)
    assert [found.word for found in around.results] == ["limit"] * 3
    ended = pushover(wall(2, 2), PUSH, Reach(0.05, steps=200), Settings(mu=0.7), 1.0)
    assert ended.ended == "the time given is used up"
    assert 1 < len(ended.steps) < 201


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), float("inf")])
def test_no_time_is_no_limit(seconds):
    with pytest.raises(InputError, match="seconds"):
        limit(stack(1), PUSH, seconds=seconds)


def test_what_is_put_by():
    budget = Budget(100.0)
    assert not budget.over
    assert budget.before(0.25).left == pytest.approx(75.0, abs=1.0)
    assert budget.before_proof(10**9).left == pytest.approx(10.0, abs=1.0)  # a tenth at least is for the search
    assert not budget.allows_proof(10**9)
    assert budget.allows_proof(10)
    assert UNLIMITED.before_proof(10**9) is UNLIMITED
    assert UNLIMITED.allows_proof(10**9)
    assert Budget(0.5, began=budget.began - 1.0).over
