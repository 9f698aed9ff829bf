"""Answers that hold for every drawing around a model (`within`), and drawings around it that might contradict."""

import json

import numpy as np
import pytest

import cyclopean
from cyclopean.analysis import Settings, prepare
from cyclopean.analysis.certificates import certify
from cyclopean.analysis.checking import decide
from cyclopean.analysis.equilibrium.deciding import decide_rigid
from cyclopean.analysis.robust.family import Family, swelling
from cyclopean.analysis.robust.search import certain_length
from cyclopean.analysis.robust.standing import standing
from cyclopean.analysis.verdict import Within, millimetres
from cyclopean.cli import main
from cyclopean.errors import InputError
from cyclopean.proof import verify
from laws import cases
from within_cases import SETTINGS, another_drawing, any_model, prepared

OTHERWISE = {"stable": "collapse", "unstable": "balanced"}


def judged(seed):
    """A model by chance, its verdict, and for what length (m) that was proved of all drawings."""
    rng = np.random.default_rng((8, seed))
    model = prepared(any_model(rng))
    result = decide(model, SETTINGS)
    word = result.verdict
    return model, word, certain_length(model, None if word == "stable" else result.mechanism), rng


@pytest.fixture(scope="module")
def lengths():
    return [judged(seed) for seed in range(cases("CYCLOPEAN_WITHIN", 48))]


def words(lengths, times, draws=4):
    """What other drawings come to, so many times the length away: (verdict here, word there)."""
    found = []
    for model, word, length, rng in lengths:
        if word != "undecided" and length:
            others = [another_drawing(model, times * length, rng) for _ in range(draws)]
            found += [(word, decide_rigid(other, other.system()).word) for other in others]
    return found


def test_no_drawing_within_the_length_contradicts(lengths):
    found = words(lengths, 1.0)
    assert len(found) > 2 * len(lengths)
    assert [pair for pair in found if OTHERWISE[pair[0]] == pair[1]] == []


def test_drawings_far_beyond_it_do(lengths):
    """So the law above can fail."""
    assert any(OTHERWISE[here] == there for here, there in words(lengths, 60.0))


def test_nearly_all_hold_for_some_length(lengths):
    assert np.mean([length > 0.0 for _, word, length, _ in lengths if word != "undecided"]) > 0.9


def test_the_checker_needs_what_the_solver_says():
    """Both compute by themselves how much of the room of a contact is needed; gravity from any side."""
    told = 0
    for seed in range(cases("CYCLOPEAN_WITHIN", 32)):
        rng = np.random.default_rng((9, seed))
        model = prepare(
            any_model(rng), Settings(method="rbe", tilt=(float(rng.uniform(0, 9)), float(rng.uniform(0, 360))))
        )
        proof, share = standing(model, Family(float(rng.uniform(1e-4, 3e-3)), None if rng.random() < 0.5 else 0.1))
        if proof is not None:
            report = verify(certify(model, model.system(), "rbe-state-within", proof))
            assert report.proved, report.reason
            assert report.figures["room_used"] == pytest.approx(share, rel=1e-5)
            told += 1
    assert told


def test_swelling_bounds_what_vertices_that_move_do():
    """A cube by hand: 6 L, and (1 + 4 / sqrt 12) L along an axis; then others by chance, never exceeded."""
    volume, moment = swelling(cyclopean.stack(2, ground=False), 1e-9)
    assert volume[0] == pytest.approx(6e-9)
    assert moment[0] == pytest.approx([(1.0 + 4.0 / np.sqrt(12.0)) * 1e-9] * 3)
    rng = np.random.default_rng(3)
    for _ in range(20):
        model = prepared(any_model(rng))
        length = float(rng.uniform(0.001, 0.05))
        volume, moment = swelling(model.assembly, length)
        was, now = model.assembly.mass, another_drawing(model, length, rng).assembly.mass
        assert (np.abs(now.volume - was.volume) <= volume * (1 + 1e-9)).all()
        off = np.abs(now.volume[:, None] * (now.centroid - was.centroid))
        assert (off <= moment * (1 + 1e-9)).all()


def test_an_arch_holds_for_some_drawings_and_not_for_others():
    arch = cyclopean.arch(12, span=3.0, thickness=0.3)
    near, far = cyclopean.check(arch, within=0.001), cyclopean.check(arch, within=(0.05, 1.0))
    assert near.verdict == "stable"
    assert near.within == Within(0.001, None, True, 0.001)
    assert "holds for every drawing within 1 mm" in near.reason
    assert verify(near.certificate).claim.startswith(
        "stable under rigid-block equilibrium in every drawing within 0.001 m"
    )
    assert (far.verdict, far.certificate) == ("undecided", None)
    assert 0.0 < far.within.certain < 0.05
    assert far.reason.startswith("As drawn it is stable. That is certain only for drawings within ")
    assert "asked 50 mm" in far.reason
    assert "normals within 1 degree;" in far.reason


def test_an_arch_too_thin_falls_in_every_drawing():
    thin = cyclopean.check(cyclopean.arch(12, span=3.0, thickness=0.1), within=0.002)
    assert thin.verdict == "unstable"
    assert thin.within.holds
    assert thin.certificate["kind"] == "rbe-mechanism-within"


def test_an_angle_alone_matters():
    """A cube on a slope, mu = tan 30: at 25 degrees it stands while normals lean by less than 5."""
    slab = cyclopean.stack(1, slope=25.0, mu=float(np.tan(np.deg2rad(30.0))))
    assert cyclopean.check(slab, within=(1e-6, 4.9)).within.holds
    assert not cyclopean.check(slab, within=(1e-6, 5.1)).within.holds
    steep = cyclopean.stack(1, slope=35.0, mu=float(np.tan(np.deg2rad(30.0))))
    assert cyclopean.check(steep, within=(1e-6, 4.9)).verdict == "unstable"
    assert cyclopean.check(steep, within=(1e-6, 5.1)).verdict == "undecided"


def test_the_command_says_it_and_verify_proves_it_alone(tmp_path, capsys):
    model, proof, told = (str(tmp_path / name) for name in ("arch.json", "proof.json", "result.json"))
    assert main(["make", "arch", "12", "--span", "3", "--thickness", "0.3", "--out", model]) == 0
    assert main(["check", model, "--within", "0.002,0.3", "--certificate", proof, "--json", told]) == 0
    said = capsys.readouterr()
    assert "The answer holds for every drawing within 2 mm of this one, their normals within 0.3 degrees." in said.out
    assert "only rigid-block equilibrium has it" in said.err
    assert json.loads((tmp_path / "result.json").read_text())["within"] == {
        "asked": 0.002,
        "degrees": 0.3,
        "holds": True,
        "certain": 0.002,
    }
    assert main(["verify", proof]) == 0
    assert "in every drawing within 0.002 m" in capsys.readouterr().out
    assert main(["check", model, "--within", "0.05"]) == 3
    assert "certain only for drawings within" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"within": -1.0}, "expected a positive length"),
        ({"within": (0.001, 90.0)}, "DEGREES below 90"),
        ({"within": (0.001, 1.0, 2.0)}, "expected a positive length"),
        ({"within": 0.001, "method": "cra"}, "only rigid-block equilibrium has it"),
        ({"within": 0.001, "tension": 1e4}, "joints that pull"),
        ({"within": 0.001, "settlement": {"springer-left": (0.01, 0, 0)}}, "a settlement"),
    ],
)
def test_what_is_refused(options, why):
    with pytest.raises(InputError, match=why):
        cyclopean.check(cyclopean.arch(12, span=3.0, thickness=0.3), **options)


def test_lengths_are_never_rounded_up():
    assert [millimetres(x) for x in (0.0031999, 0.003, 1.0, 1.2345e-7)] == ["3.19 mm", "3 mm", "1000 mm", "0.000123 mm"]


def test_the_angle_of_a_family_is_never_less_than_said():
    assert Family(1.0, 30.0).slope >= np.tan(np.pi / 6.0)
    assert Settings(within=0.1).drawings() == (0.1, None)
