"""`check` and `verify` from the outside: words, files, statuses."""

import json
import os
from dataclasses import replace

import pytest

from coupled_cases import beams
from cyclopean import analysis
from cyclopean.io import write_model


@pytest.fixture
def cube(run):
    """A cube on the ground: stands on a slope iff mu >= tan of its angle, and below 45 degrees."""
    assert run("make", "stack", 1, "--out", "cube.json")[0] == 0
    return "cube.json"


def test_stable_in_words(run, cube, unasked):
    status, out, err = run("check", cube)
    assert (status, err) == (0, "")
    assert out.startswith("Stands. ")
    assert "mu 0.84" in out
    assert "density 2400" in out
    assert "(0, 0, -9.80665)" in out
    assert out.isascii()


def test_what_was_said_is_not_assumed(run, cube):
    _, out, _ = run("check", cube, "--mu", "0.5", "--density", "2000", "--gravity", "0,0,-9.8")
    assert "assumed" not in out


def test_unstable_and_its_proof(run):
    run("make", "stack", 5, "--offset", "0.3", "--out", "lean.json")
    status, out, _ = run("check", "lean.json", "--certificate", "proof.json")
    assert status == 1
    assert out.startswith("Falls. ")
    assert "proof.json" in out
    status, out, _ = run("verify", "proof.json")
    assert status == 0
    assert out.startswith("proved: ")


@pytest.mark.parametrize(
    ("options", "status"),
    [
        (["--tilt", "39"], 0),  # atan 0.84 = 40.03 degrees
        (["--tilt", "41"], 1),
        (["--tilt", "-41"], 1),
        (["--tilt=-39,30"], 0),
        (["--tilt", "44,90", "--mu", "1.2"], 0),
        (["--tilt", "46,90", "--mu", "1.2"], 1),  # it tips
        (["--gravity", "-8,0,-9.8"], 0),
        (["--gravity=-8,0,-9.8"], 0),
        (["--gravity", "-8.5,0,-9.8"], 1),
        (["--gravity=-8.5,0,-9.8"], 1),
        (["--gravity", "0,0,9.8"], 1),
        (["--supports", "below=-0.1"], 0),
        (["--supports", "ids=b01"], 1),  # the slab hangs on nothing
        (["--supports", "ids=b01", "--gravity", "0,0,9.8"], 0),  # and falls up against the cube
        (["--solver", "clarabel"], 0),
        (["--method", "rbe", "--solver", "interior", "--tilt", "39"], 0),
        (
            ["--method", "cra", "--tilt", "39", "--eta", "20", "--beta-min", "1e-3", "--seconds", "30", "--nodes", "5"],
            0,
        ),
    ],
)
def test_cube_on_a_slope_by_hand(run, cube, options, status):
    found, out, err = run("check", cube, *options)
    assert (found, err) == (status, "")
    assert out.startswith({0: "Stands. ", 1: "Falls. "}[status])


def test_json_on_stdout_and_nothing_else(run, cube):
    status, out, err = run("check", cube, "--json", "-", "--certificate", "proof.json")
    data = json.loads(out)
    assert (status, err) == (0, "")
    assert data["schema"] == "cyclopean.result/1"
    assert (data["verdict"], data["method"]) == ("stable", "cra")
    assert (data["blocks"], data["free"], data["contacts"], data["points"]) == (2, 1, 1, 4)
    assert data["certificate"] == {"kind": "cra-state", "file": "proof.json"}
    assert {"read", "contacts", "solve", "verify", "total"} <= set(data["seconds"])
    assert sorted(os.listdir()) == ["cube.json", "proof.json"]


def test_all_files_and_a_page_that_needs_nothing_else(run, cube, unasked):
    run("check", cube, "--json", "r.json", "--certificate", "c.json", "--report", "r.html")
    with open("r.json") as result, open("r.html") as page:
        assert json.load(result)["verdict"] == "stable"
        text = page.read()
    assert "<html" in text
    assert 'src="http' not in text


def test_the_penalty_form_names_where_it_pulls(run):
    run("make", "stack", 2, "--offset", "0.6", "--out", "over.json")
    status, out, _ = run("check", "over.json", "--penalty")
    assert status == 1
    assert "between b01 and b02" in out
    run("make", "stack", 2, "--out", "stands.json")
    status, out, _ = run("check", "stands.json", "--penalty")
    assert status == 0
    assert "tension  none is needed" in out


def test_files_name_each_other_from_where_they_are(run, cube):
    os.mkdir("pages")
    os.mkdir("proofs")
    run("check", cube, "--json", "pages/r.json", "--certificate", "proofs/c.json", "--report", "pages/r.html")
    with open("pages/r.json") as result, open("pages/r.html") as page:
        assert json.load(result)["certificate"]["file"] == "../proofs/c.json"
        assert "../proofs/c.json" in page.read()


def test_undecided_leaves_no_certificate(run, cube, monkeypatch):
    decided = analysis.check

    def undecided(*argv, **said):
        return replace(decided(*argv, **said), verdict="undecided", reason="Too close to call.", certificate=None)

    monkeypatch.setattr(analysis, "check", undecided)
    status, out, err = run("check", cube, "--certificate", "c.json", "--json", "r.json")
    assert status == 3
    assert out.startswith("Undecided. Too close to call.")
    assert err.count("\n") == 1
    assert "no certificate" in err
    assert sorted(os.listdir()) == ["cube.json", "r.json"]


def test_warnings_of_the_reader_come_one_to_a_line(run, cube):
    with open(cube) as file:
        model = json.load(file)
    model["contacts"][0]["polygon"].reverse()
    with open(cube, "w") as file:
        json.dump(model, file)
    status, _, err = run("check", cube)
    assert status == 0
    assert err.startswith("cyclopean: warning: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--json", "no/r.json"], "no/r.json: the folder 'no' does not exist"),
        (["--json", "folder"], "is a folder"),
        (["--json", "r.json/"], "r.json/"),
        (["--json", ""], "--json"),
        (["--json", "x" * 300], "too long"),
        (["--certificate", "-"], "--certificate"),
        (["--report", "-"], "--report"),
        (["--json", "cube.json"], "input"),
        (["--report", "./folder/../cube.json"], "input"),
        (["--json", "link.json"], "input"),
        (["--json", "hard.json"], "input"),
        (["--json", "r.json", "--report", "./r.json"], "same file"),
        (["--json", "other.json", "--certificate", "dangling.json"], "same file"),
    ],
)
def test_outputs_are_looked_at_before_the_work(run, cube, monkeypatch, options, said):
    os.mkdir("folder")
    os.symlink("cube.json", "link.json")
    os.symlink("other.json", "dangling.json")
    os.link("cube.json", "hard.json")
    with open(cube) as file:
        before = file.read()
    monkeypatch.setattr(analysis, "check", None)  # nobody gets that far
    status, out, err = run("check", cube, *options)
    assert (status, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
    assert sorted(os.listdir()) == ["cube.json", "dangling.json", "folder", "hard.json", "link.json"]
    with open(cube) as file:
        assert file.read() == before


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="permissions do not bind the superuser")
def test_a_folder_that_may_not_be_written_is_refused(run, cube):
    os.mkdir("shut", 0o500)
    status, _, err = run("check", cube, "--json", "shut/r.json")
    assert status == 2
    assert "permission" in err


def test_devices_may_be_named(run, cube):
    assert run("check", cube, "--json", os.devnull, "--certificate", os.devnull)[0] == 0


def test_a_spoilt_certificate_is_told(run, cube):
    run("check", cube, "--certificate", "c.json")
    with open("c.json") as file:
        proof = json.load(file)
    proof["forces"][0][2] *= 1.001
    with open("spoilt.json", "w") as file:
        json.dump(proof, file)
    status, out, _ = run("verify", "spoilt.json")
    assert status == 1
    assert out.startswith("NOT proved: ")
    status, out, err = run("verify", "spoilt.json", "--json", "-")
    assert (status, err) == (1, "")
    assert json.loads(out)["proved"] is False
    with open("half.json", "w") as file:
        file.write(json.dumps(proof)[:100])
    status, out, err = run("verify", "half.json")
    assert (status, out) == (2, "")
    assert err.startswith("cyclopean: error: half.json: ")


def test_units(run, cube):
    status, _, err = run("convert", cube, "cube.obj")
    assert status == 0
    assert err == "cyclopean: warning: cube.obj: OBJ holds no supports, contacts: dropped\n"
    assert run("info", "cube.obj", "--units", "mm", "--json", "mm.json")[0] == 0
    with open("mm.json") as file:
        assert json.load(file)["volume"]["least"] == pytest.approx(1e-9)
    assert run("check", "cube.obj", "--units", "furlong")[0] == 2


@pytest.fixture
def frame(tmp_path):
    """A beam between two fixed columns that hangs on friction alone: by statics RBE accepts it and CRA does not."""
    write_model(tmp_path / "frame.json", beams(0.3, 0.3, 0.4))
    return "frame.json"


def test_a_beam_that_hangs_on_friction_is_refuted_by_cases(run, frame):
    status, out, err = run("check", frame, "--mu", "0.3", "--certificate", "tree.json", "--json", "r.json")
    assert (status, err) == (1, "")
    assert out.startswith("Falls. Rigid-block equilibrium has forces for it")
    assert "proof    cra-tree, checked in exact arithmetic; eta 10 eps, beta_min 0.01 eps" in out
    status, out, _ = run("verify", "tree.json")
    assert status == 0
    assert out.startswith("proved: unstable under coupled rigid-block analysis (eta = 10 eps, beta_min = 0.01 eps")
    with open("r.json") as file:
        data = json.load(file)
    assert data["certificate"]["kind"] == "cra-tree"
    assert not {"mechanism", "displacement", "forces"} & data.keys()
    status, out, _ = run("check", frame, "--mu", "0.3", "--penalty")
    assert status == 1
    assert "tension  none that would help was found" in out
    status, out, _ = run("check", frame, "--mu", "0.3", "--method", "rbe")
    assert status == 0
    assert "by rbe" in out


def test_a_budget_that_is_too_small_leaves_it_undecided(run, frame):
    """By hand (see `coupled_cases`): with friction of height over half-length, 1, it stands; 1.25 x 0.84 = 1.05."""
    status, out, err = run("check", frame, "--nodes", "1", "--json", "r.json")
    assert (status, err) == (3, "")
    lines = out.splitlines()
    assert lines[0].startswith("Undecided. Coupled analysis met neither a state in which the stones")
    assert lines[1] == "  rbe      rigid-block equilibrium alone says stable, with proof"
    assert "  stone    stone 'beam0' rests on nothing and stands only if 'left' and 'right' jam it" in lines
    assert "  change   with friction 1.05 it is proved stable" in lines
    with open("r.json") as file:
        data = json.load(file)
    assert data["residuals"].keys() == {"merit", "bound"}
    assert 0.0 < data["residuals"]["merit"] < 100.0
    assert 0.0 <= data["residuals"]["bound"] < 1.0
    assert data["provenance"]["rbe"] == "stable"
    assert [stone["block"] for stone in data["provenance"]["folds"]] == ["beam0"]
    assert data["change"]["friction"] == {"factor": 1.25, "mu": 1.05}
    assert "stable_at" not in data
    assert [len(row) for row in data["nearest"]["forces"][0]["force"]] == [3] * 4
    assert len(data["nearest"]["displacement"]["beam0"]) == 6


@pytest.mark.parametrize(("mu", "expected"), [("0", 1), ("2", 0)])
def test_friction_may_be_none_or_more_than_one(run, frame, mu, expected):
    status, _, err = run("check", frame, "--mu", mu)
    assert (status, err) == (expected, "")


def test_a_state_at_a_larger_eta_is_proved_beside(run, tmp_path):
    """By hand: a beam of half-length 1 and height 0.25 needs eta = 4 (1 / 0.25) eps + beta_min = 16.01 eps."""
    write_model(tmp_path / "long.json", beams(1.0, 0.25, 0.4))
    status, out, err = run("check", "long.json", "--nodes", "1", "--json", "r.json", "--certificate", "p.json")
    assert status == 3
    assert err.startswith("cyclopean: warning: --certificate p.json: nothing was proved")
    assert "  at eta   a state exists for eta >= 16.02, with proof (10 was asked for)" in out
    with open("r.json") as file:
        found = json.load(file)["stable_at"]
    assert found == {"eta": 16.02, "certificate": {"kind": "cra-state", "file": "p-at-eta.json"}}
    assert sorted(os.listdir()) == ["long.json", "p-at-eta.json", "r.json"]
    status, out, _ = run("verify", "p-at-eta.json", "--model", "long.json")
    assert status == 0
    assert out.startswith("proved: stable under coupled rigid-block analysis (eta = 16.02 eps")


def test_only_ratios_of_the_bounds_matter(run, cube):
    """The verdict of a cube on a slope is that of statics for any eps; the displacement grows with it."""
    sizes = []
    for eps in ("1", "0.001", "250"):
        status, out, _ = run("check", cube, "--tilt", "30", "--eps", eps, "--json", f"{eps}.json")
        assert status == 0
        assert "eta 10 eps, beta_min 0.01 eps" in out
        with open(f"{eps}.json") as file:
            sizes.append(max(abs(x) for x in json.load(file)["displacement"]["b01"]) / float(eps))
    assert sizes == pytest.approx([sizes[0]] * 3, rel=1e-9)


def test_an_option_of_rbe_chooses_it_and_says_so(run, cube):
    status, out, err = run("check", cube, "--weights", "1,2", "--eta", "5")
    assert status == 0
    assert "by rbe" in out
    assert sorted(err.splitlines()) == [
        "cyclopean: warning: --eta: no effect, for only coupled analysis has it (--method cra)",
        "cyclopean: warning: --weights 1,2: only rigid-block equilibrium has it, so the method is rbe",
    ]
    _, _, err = run("check", cube, "--eps", "2")
    assert err == "cyclopean: warning: --eps: no effect, for --eta and --beta-min follow it where they are not given\n"
    assert run("check", cube, "--eps", "2", "--eta", "5")[2] == ""
    status, _, err = run("check", cube, "--method", "cra", "--weights", "1,2")
    assert status == 2
    assert "--weights 1,2: only rigid-block equilibrium has it; use --method rbe" in err


def test_the_help_names_every_solver(run):
    from cyclopean.analysis.settings import CRA_SOLVERS, RBE_SOLVERS

    _, out, _ = run("check", "--help")
    for name in {*CRA_SOLVERS, *RBE_SOLVERS}:
        assert name in out


def test_an_old_word_answers_with_the_new_one(run, cube):
    for argv in (("--settle", "b:0,0,1"), ("--settle=b:0,0,1",)):
        status, out, err = run("check", cube, *argv)
        assert (status, out) == (2, "")
        assert err == "cyclopean: error: --settle: is --settlement now; to settle is to lay stones\n"
