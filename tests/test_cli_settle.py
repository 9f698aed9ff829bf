"""`settle`."""

import json
import re

import numpy as np
import pytest

from cyclopean.io import read_model

QUICK = ("--yaws", 2, "--look-ahead", 2, "--workers", 1)


@pytest.fixture
def quarry(run):
    assert run("make", "stones", "--count", 4, "--detail", 1, "--out", "q.json")[0] == 0
    return "q.json"


def test_a_wall_its_figures_and_its_picture(run, quarry, tmp_path):
    written = ("--json", "s.json", "--report", "w.html", "--svg", "w.svg")
    status, out, err = run("settle", quarry, "--out", "w.json", *written, "--length", 2.2, *QUICK)
    assert (status, err) == (0, "")
    assert out.startswith("4 of 4 stones make ")
    assert out.endswith("written   w.json, s.json, w.html, w.svg\n")
    model, _ = read_model("w.json")
    data = json.loads((tmp_path / "s.json").read_text())
    assert data["schema"] == "cyclopean.settle/1"
    assert (data["stones"], data["model"]) == (quarry, "w.json")
    stones, _ = read_model(quarry)
    found = {block.id: block for block in stones.blocks}
    for row, block in zip(data["placements"], model.blocks[1:], strict=True):
        matrix = np.array(row["transform"])
        assert row["stone"] == block.id
        assert block.vertices == pytest.approx(found[block.id].vertices @ matrix[:3, :3].T + matrix[:3, 3], abs=1e-9)
        assert row["stable"] == (row["margin"] > 0.0)
        assert row["role"] == "stone"
    assert data["measures"]["length"] == 2.2
    assert data["settings"]["scores"]["height"] == 1.7
    assert model.contacts is not None
    assert sum(c["kind"] != "edge" for c in data["contacts"]) == len(model.contacts)
    names = {block.id for block in model.blocks[1:]}
    assert set(re.findall("<title>(stone-[^<]*)", (tmp_path / "w.svg").read_text())) == names
    page = (tmp_path / "w.html").read_text()
    assert "4 of 4 stones make" in page
    assert all(f"<td>{name}</td>" in page for name in names)


def test_the_wall_stands(run, quarry):
    assert run("settle", quarry, "--out", "w.json", "--length", 4, "--pins", *QUICK)[0] == 0
    status, out, _ = run("check", "w.json", "--method", "rbe")
    assert status == 0
    assert "rubble wall: " in out


def test_a_second_process_changes_nothing(run, quarry, tmp_path):
    how = ("--ways", 2, "--pins", "--dress", 0.1)
    for count in (1, 2):
        options = ("--length", 3, "--thickness", 0.9, *QUICK[:4], "--workers", count, *how)
        assert run("settle", quarry, "--out", f"w{count}.json", *options)[0] == 0
    assert (tmp_path / "w1.json").read_bytes() == (tmp_path / "w2.json").read_bytes()


def test_contacts_of_a_model_that_has_none(run, quarry, tmp_path):
    assert run("settle", quarry, "--out", "w.json", "--length", 4, *QUICK)[0] == 0
    data = json.loads((tmp_path / "w.json").read_text())
    touching = len(data.pop("contacts"))
    (tmp_path / "bare.json").write_text(json.dumps(data))
    status, out, err = run("check", "bare.json", "--method", "rbe", "--rough", "auto")
    assert status == 0
    near = int(re.search(r"(\d+) contacts\n", out)[1])
    assert near > touching / 4, "within a wider band, and where fewer faces lean"
    assert f"rough surfaces: {near} contacts stand for where blocks nearly touch" in err
    status, out, err = run("check", "w.json", "--rough", "0.002")
    assert (status, out) == (2, "")
    assert "--rough: the model lists its contacts; leave it out" in err
    assert "--rough -1: expected a positive length in metres, or auto" in run("check", "bare.json", "--rough", "-1")[2]


def test_json_to_standard_output_is_all_that_is_printed(run, quarry):
    status, out, _ = run(
        "settle", quarry, "--out", "w.json", "--json", "-", "--scores", "void=2,height=0", "--wythes", 2, *QUICK
    )
    assert status == 0
    data = json.loads(out)
    assert (data["settings"]["scores"]["void"], data["settings"]["scores"]["height"]) == (2.0, 0.0)
    assert data["settings"]["wythes"] == 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--length", "0"), "--length: must be more than 0, got 0"),
        (("--length", "x"), "--length: 'x' is not a number"),
        (("--wythes", "3"), "--wythes: '3' is not one of 1, 2"),
        (("--look-ahead", "-1"), "--look-ahead: expected a whole number of at least 0, got -1"),
        (("--workers", "3"), "--workers: '3' is not one of 1, 2"),
        (("--ways", "0"), "--ways: expected a whole number of at least 1, got 0"),
        (("--ways", "7"), "--ways: 7; give no more than 6"),
        (("--yaws", "0"), "--yaws: expected a whole number of at least 1, got 0"),
        (("--margin", "-1"), "--margin: must not be negative, got -1"),
        (("--lean", "-1"), "--lean: must not be negative"),
        (("--friction", "0.5"), "--friction: is --mu now"),
        (("--weights", "void=1"), "--weights: is --scores now"),
        (("--lean", "50"), "--lean: 50 degrees; give less than 45"),
        (("--mu", "0"), "--mu: must be more than 0"),
        (("--scores", "voids=1"), "--scores: 'voids=1' should be NAME=W with one of gap, height"),
        (("--scores", "void=1,void=2"), "--scores: 'void' stands twice"),
        (("--scores", "void=-1"), "--scores void: -1 is less than 0"),
        (("--chinking",), "--chinking: is --pins now"),
        (("--batter", "6"), "--batter: '6' is none; give 1:N, such as 1:6"),
        (("--dress", "0.3"), "--dress: 0.3 is not a share from 0 to 0.2"),
        (("--cell", "1e-5"), "--cell: 1e-05 m makes a map of more than"),
        (("--length", "0.1", "--thickness", "0.1"), "none of 4 stones fits into a wall 0.1 m long"),
    ],
)
def test_bad_input_is_one_line_and_status_2(run, quarry, tmp_path, options, message):
    status, out, err = run("settle", quarry, "--out", "w.json", *options)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert not (tmp_path / "w.json").exists()


def test_an_opening_that_nothing_bridges_is_told(run, quarry):
    """Four stones beside a gap 0.2 m wide: no jamb comes up to 1.5 m."""
    options = ("--length", 4, "--thickness", 0.9, "--opening", "1.5,0,0.2,1.5", *QUICK)
    status, out, _ = run("settle", quarry, "--out", "w.json", *options)
    assert status == 0
    assert "  opening   no lintel was laid" in out


def test_files_that_will_not_do(run, quarry):
    assert "unknown ending; use .json" in run("settle", quarry, "--out", "w.obj")[2]
    assert "this is the input file" in run("settle", quarry, "--out", quarry)[2]
    assert run("settle", "nothing", "--out", "w.json")[0] == 2
    assert run("settle", quarry, "--out", "no/w.json")[0] == 2
