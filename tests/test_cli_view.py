"""`view`: pages of models and results, whatever lies beside them; nothing in them comes from a network."""

import json
import re
import shutil
import webbrowser
from pathlib import Path

import numpy as np
import pytest

from cyclopean.cli import main
from cyclopean.io import read_model
from cyclopean.io.result_reading import is_result, read_result

SEE = ("--no-browser",)


@pytest.fixture(scope="module")
def arch(tmp_path_factory):
    """A model, and its results when it stands and when it falls, with certificates."""
    lines = (
        "make arch 8 --span 3 --thickness 0.4 --out arch.json",
        "check arch.json --json arch.result.json --certificate arch.certificate.json",
        "check arch.json --tilt 50 --json falls.json --certificate falls.certificate.json",
    )
    folder = tmp_path_factory.mktemp("arch")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert [main(line.split()) for line in lines] == [0, 0, 1]
    return folder


@pytest.fixture
def made(arch, run, tmp_path):
    """Runs commands beside the model and its results."""
    shutil.copytree(arch, tmp_path, dirs_exist_ok=True)
    return run


def loads_nothing(page):
    outside = re.sub(r'srcdoc="[^"]*"', "", page)
    addresses = re.findall(r"(?:src|href|action|data)=[\"']?(\w+:)?//", outside)
    return "default-src 'none'" in page and not addresses


def test_a_model_is_drawn_without_a_verdict(made):
    status, out, err = made("view", "arch.json", "--out", "m.html", *SEE)
    assert (status, out, err) == (0, "written m.html\n", "")
    page = Path("m.html").read_text()
    assert "arch of 8" in page
    assert 'class="verdict"' not in page
    assert "springer-left" in page
    assert "<dd>9</dd>" in page  # contacts of 8 voussoirs between 2 springers
    assert loads_nothing(page)


@pytest.mark.parametrize(("name", "word"), [("arch.result.json", "Stands"), ("falls.json", "Falls")])
def test_a_result_is_drawn_with_the_blocks_of_its_certificate(made, name, word):
    status, _, err = made("view", name, "--out", "r.html", *SEE)
    assert (status, err) == (0, "")
    page = Path("r.html").read_text()
    assert f"<strong>{word}</strong>" in page
    assert ("How it moves" in page) == (word == "Falls")
    assert "<svg" in page
    assert loads_nothing(page)


def test_what_is_read_back_is_what_was_written(made):
    data = json.loads(Path("arch.result.json").read_text())
    result, warnings = read_result("arch.result.json")
    assert warnings == ()
    assert result.verdict == data["verdict"]
    assert result.force.tolist() == [row for k in data["forces"] for row in k["force"]]
    assert result.utilisation.tolist() == [k["utilisation"] for k in data["forces"]]
    assert {b.id: v.tolist() for b, v in zip(result.assembly.blocks, result.displacement, strict=True) if v.any()} == {
        name: row for name, row in data["displacement"].items() if any(row)
    }
    assert result.gravity.tolist() == [0.0, 0.0, -9.80665]
    falls, _ = read_result("falls.json")
    assert np.degrees(np.arctan2(falls.gravity[0], -falls.gravity[2])) == pytest.approx(50.0)
    assert falls.fixed.tolist() == [b.fixed is True for b in read_model("arch.json")[0].blocks]


def test_without_its_certificate_the_model_beside_it_is_taken(made):
    Path("arch.certificate.json").unlink()
    result, _ = read_result("arch.result.json")
    assert len(result.assembly.mesh.vertex) == 8 * 10
    assert int(result.fixed.sum()) == 2
    Path("arch.json").rename("model.json")
    assert len(read_result("arch.result.json")[0].assembly.mesh.vertex) == 8 * 10
    Path("model.json").rename("elsewhere.json")
    assert made("view", "arch.result.json", "--model", "elsewhere.json", "--out", "r.html", *SEE)[0] == 0


def test_without_any_model_the_verdict_is_shown_all_the_same(made):
    for name in ("arch.certificate.json", "arch.json"):
        Path(name).unlink()
    status, _, err = made("view", "arch.result.json", "--out", "r.html", *SEE)
    assert status == 0
    assert "its model was not found beside it, so blocks are not drawn; name it with --model" in err
    page = Path("r.html").read_text()
    assert "<strong>Stands</strong>" in page
    assert "Most used contacts" in page
    assert "<iframe" not in page


def test_another_model_is_refused(made):
    made("make", "stack", 3, "--out", "other.json")
    status, out, err = made("view", "arch.result.json", "--model", "other.json", "--out", "r.html", *SEE)
    assert (status, out) == (2, "")
    assert "other.json: is not the model of arch.result.json: it has no block" in err
    assert not Path("r.html").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"verdict": "maybe"}, "verdict 'maybe' is not one of"),
        ({"verdict": None}, "verdict must be text"),
        ({"forces": {}}, ""),
        ({"forces": [1]}, "forces[0] must be an object"),
        ({"mechanism": {"v01": [1, 2]}}, "must be six numbers"),
        ({"residuals": {"gap": "x"}}, "residuals.gap"),
        ({"assumed": 3}, "assumed must be an object"),
    ],
)
def test_damaged_results_are_one_line(made, change, said):
    data = json.loads(Path("arch.result.json").read_text()) | change
    Path("bad.json").write_text(json.dumps(data))
    status, out, err = made("view", "bad.json", "--out", "r.html", *SEE)
    if said:
        assert (status, out) == (2, "")
        assert err.count("\n") == 1
        assert said in err
        assert not Path("r.html").exists()


def test_a_frame_that_is_none_is_one_line(made):
    data = json.loads(Path("arch.result.json").read_text())
    data["forces"][1]["frame"] = [[1.0, 0.0, 0.0]]
    Path("bad.json").write_text(json.dumps(data))
    status, out, err = made("view", "bad.json", "--out", "r.html", *SEE)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "forces[1]: needs one force a corner of its polygon, and a frame of three vectors" in err


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["missing.json", "--out", "r.html"], "missing.json"),
        (["arch.json", "--out", "nowhere/r.html"], "nowhere"),
        (["arch.json", "--out", "arch.json"], "input file"),
        (["arch.json", "--model", "arch.json", "--out", "r.html"], "--model"),
        (["arch.json"], "--no-browser: needs --out"),
    ],
)
def test_bad_options(made, argv, said):
    status, out, err = made("view", *argv, *SEE)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert said in err


def test_the_browser_is_opened_on_the_page(made, monkeypatch, tmp_path):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    assert made("view", "arch.json", "--out", "m.html")[0] == 0
    assert opened == [(tmp_path / "m.html").resolve().as_uri()]
    status, out, _ = made("view", "arch.json")
    page = Path(out.removeprefix("written ").strip())
    assert status == 0
    assert "arch of 8" in page.read_text()
    assert opened[1] == page.as_uri()
    page.unlink()


def test_results_are_told_from_models(made):
    assert is_result("arch.result.json")
    assert not is_result("arch.json")
