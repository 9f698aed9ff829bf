"""Certificates of bounds: what they prove, and that no damaged one is believed.

By hand: a cube of 1 m on mu 0.5 slides at a push of 0.5 of its weight. Forces for 0.5 hold nothing at 0.501; the motion
that proves 0.5 proves nothing at 0.499, and nothing if the push is turned round.
"""

import copy
import json

import pytest

from cyclopean.analysis import Live, LiveLoad, Settings, limit
from cyclopean.design import arch, stack
from cyclopean.proof import verify
from damages import OF_LIMITS, resealed


def certificate(kind="push"):
    if kind == "push":
        return limit(stack(2, size=(1.0, 0.8, 0.5)), Live(push=(1, 0, 0)), Settings(mu=0.5)).certificate
    loads = (LiveLoad("v03", (10.0, 0.0, -1000.0), None), LiveLoad("v04", (0.0, 0.0, -500.0), (-0.45, 0.2, 0.9)))
    return limit(arch(8, radius=1.0, thickness=0.25), Live(loads=loads), Settings(mu=0.7)).certificate


@pytest.fixture(scope="module", params=["push", "load"])
def proof(request):
    found = certificate(request.param)
    assert found["kind"] == "limit-bounds"
    return found


def test_both_sides_are_proved_exactly(proof):
    report = verify(json.loads(json.dumps(proof)))
    assert report.proved
    assert report.figures["lower"] == proof["lower"]
    assert report.figures["upper"] == proof["upper"]
    assert report.figures["equilibrium_force"] <= 1e-9
    assert report.figures["bound"] >= 1e6
    assert f"{proof['lower']:.15g}" in report.claim


@pytest.mark.parametrize("gone", [("lower", "forces"), ("upper", "mechanism")])
def test_one_side_proves_that_side_only(proof, gone):
    half = resealed({key: value for key, value in proof.items() if key not in gone})
    report = verify(half)
    assert report.proved
    assert ("from" in report.claim) == (gone[0] == "lower")
    assert gone[0] not in report.figures


@pytest.mark.parametrize("name", OF_LIMITS)
def test_damage_is_found(proof, name):
    damaged = copy.deepcopy(proof)
    OF_LIMITS[name](damaged)
    report = verify(resealed(damaged))
    assert not report.proved, name
    assert report.reason == "lower is above upper" if name == "lower above upper" else report.reason


def test_a_live_load_moved_or_on_another_block():
    proof = certificate("load")
    for change in ({"block": "v09"}, {"point": [0.4, 0.2, 0.9]}, {"block": "v06"}):
        damaged = copy.deepcopy(proof)
        damaged["live"]["loads"][1] |= change
        assert not verify(resealed(damaged)).proved


def test_a_motion_that_live_loads_hinder_proves_nothing_beyond():
    """A stack that overhangs falls at multiplier 0, but a push back holds it: p1.y < 0."""
    found = limit(stack(2, offset=0.6), Live(push=(-1, 0, 0)), Settings(mu=0.84))
    falls = limit(stack(2, offset=0.6), Live(push=(1, 0, 0)), Settings(mu=0.84))
    assert (found.word, falls.word) == ("falls", "falls")
    wrong = {key: value for key, value in falls.certificate.items() if key not in ("lower", "forces")}
    assert verify(resealed(copy.deepcopy(wrong))).proved
    wrong = copy.deepcopy(wrong)
    wrong["live"]["gravity"] = [-x for x in wrong["live"]["gravity"]]
    wrong["upper"] = 0.0
    report = verify(resealed(wrong))
    assert not report.proved
    assert "against the motion" in report.reason


def test_a_motion_in_which_live_loads_do_next_to_nothing_proves_nothing_beyond():
    """The upper block tips off. The lower one creeps along with 1e-9, and a push on it is at once what holds it."""
    falls = limit(stack(2, offset=0.6), Live(push=(1, 0, 0)), Settings(mu=0.84)).certificate
    creeping = {key: value for key, value in copy.deepcopy(falls).items() if key not in ("lower", "forces")}
    lower = creeping["blocks"][1]["id"]
    creeping["mechanism"][lower] = [1e-9, 0.0, 0.0, 0.0, 0.0, 0.0]
    creeping["upper"] = 0.0
    assert verify(resealed(creeping)).proved
    corner = creeping["blocks"][1]["vertices"][0]
    creeping["live"] |= {"gravity": [0.0, 0.0, 0.0], "loads": [{"block": lower, "force": [1.0, 0, 0], "point": corner}]}
    report = verify(resealed(creeping))
    assert not report.proved
    assert "too little work" in report.reason


def test_the_seal_covers_live_loads(proof):
    damaged = copy.deepcopy(proof)
    damaged["live"]["gravity"][1] += 1e-9
    assert "seal" in verify(damaged).reason
