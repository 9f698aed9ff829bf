"""`ashlar` and `pack` from the outside."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from cyclopean.io import read_model
from fixtures_stones import box, obj

WALL = ("--width", 1.5, "--height", 0.9, "--depth", 0.2, "--out", "wall.json")
BOXES = ("--stone", "0.3x0.15x0.2*40")


def rows(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_wall_its_words_and_its_files(run):
    files = ("--cutlist", "cut.csv", "--left", "left.csv", "--svg", "wall.svg", "--json", "wall-made.json")
    status, out, err = run("ashlar", *BOXES, *WALL, *files, "--mu", 0.6, "--density", 2000)
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        "ashlar, running bond: 6 courses, 33 stones, 82 contacts",
        "  coverage 1 of the face",
        "  bond     J 1.000, 0 aligned head joints, joints 0.15 m apart or more",
        "  sawing   3 cuts, 6 stones that are parts of slabs, 0 turned",
        "  stock    360.0 L = 270.0 L laid + 90.0 L in 10 slabs left + 0.0 L in 0 offcuts + 0.0 L lost",
        "  written  wall.json, cut.csv, left.csv, wall.svg, wall-made.json",
    ]
    model, _ = read_model("wall.json")
    assert (len(model), len(model.contacts)) == (34, 82)
    assert [b.fixed for b in model.blocks] == [True] + [False] * 33
    assert {b.group for b in model.blocks} == {"ground", *(f"course-{k}" for k in range(1, 7))}
    assert {b.density for b in model.blocks[1:]} == {2000.0}
    assert set(model.contacts.mu.tolist()) == {0.6}
    cut = rows("cut.csv")
    assert [r["stone"] for r in cut] == [b.id for b in model.blocks[1:]]
    assert [(r["length [mm]"], r["sawn off"], r["cuts"]) for r in cut if r["sawn off"]] == [
        ("150", "slab", "1"), ("150", "offcut", "0")
    ] * 3  # fmt: skip
    assert len(rows("left.csv")) == 10
    assert Path("wall.svg").read_text(encoding="utf-8").count("<rect") > 33
    assert run("check", "wall.json")[0] == 0
    status, said, _ = run("sequence", "wall.json", "--out", "s.json")
    assert status == 0
    assert "33 stones in 6 layers; stages: 33 stable" in said


def test_transforms_lead_from_the_slab_to_the_wall(run):
    """A turned, cut stone of a stack: the corners of its part of the slab land on its slot."""
    assert run("make", "stack", 8, "--size", "0.2,0.1,0.1", "--no-ground", "--out", "yard.json")[0] == 0
    status, _, err = run("ashlar", "yard.json", "--width", 0.4, "--height", 0.2, "--depth", 0.2, "--bond", "english",
                         "--out", "w.json", "--json", "p.json")  # fmt: skip
    assert (status, err) == (0, "")
    data = json.loads(Path("p.json").read_text(encoding="utf-8"))
    yard, _ = read_model("yard.json")
    where = {b.id: b.vertices.min(axis=0) for b in yard.blocks}
    assert any(p["turned"] for p in data["placements"])
    for p in data["placements"]:
        matrix = np.array(p["transform"])
        corners = where[p["slab"]] + np.array([p["sawn_low"], p["sawn_high"]])  # length along x, depth along y
        moved = corners @ matrix[:3, :3].T + matrix[:3, 3]
        assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1.0)
        assert moved.min(axis=0) == pytest.approx(p["low"], abs=1e-9)
        assert moved.max(axis=0) == pytest.approx(p["high"], abs=1e-9)


def test_a_stagger_that_the_bond_has_not_is_told(run):
    said = "cyclopean: warning: --stagger: no effect, for stack bond has its own; only --bond running takes it"
    assert said in run("ashlar", *BOXES, *WALL, "--stagger", 0.3, "--bond", "stack")[2]
    assert "--stagger" not in run("ashlar", *BOXES, *WALL, "--stagger", 0.3)[2]


def test_a_stock_list(run):
    Path("stock.csv").write_text(
        "id,count,depth,height,length,density\nbrick,40,0.1,0.1,0.2,1900\n\nlong,1,0.2,0.1,0.9,\n", encoding="utf-8"
    )
    status, out, _ = run("ashlar", "stock.csv", "--width", 1.6, "--height", 0.2, "--depth", 0.2, "--bond", "english",
                         "--out", "w.json", "--json", "-")  # fmt: skip
    assert status == 0
    data = json.loads(out)
    assert data["schema"] == "cyclopean.ashlar/1"
    assert data["readout"]["blocks"] == 33
    assert {p["slab"] for p in data["placements"]} <= {f"brick-{k}" for k in range(1, 41)} | {"long"}
    assert data["readout"]["stock"] == pytest.approx(40 * 0.002 + 0.018)
    model, _ = read_model("w.json")
    assert {b.density for b in model.blocks[1:]} <= {1900.0, None}


def test_a_folder_of_stones_some_of_which_are_no_boxes(run):
    Path("yard").mkdir()
    assert run("make", "stones", "--count", 1, "--detail", 1, "--out", "yard")[0] == 0
    assert run("make", "stack", 4, "--size", "0.3,0.2,0.15", "--no-ground", "--out", "s.json")[0] == 0
    assert run("convert", "s.json", "yard/s.obj")[0] == 0
    wall = ("--width", 0.6, "--height", 0.3, "--depth", 0.2, "--out", "w.json")
    status, out, err = run("ashlar", "yard", "--units", "m", *wall)
    assert status == 0
    assert out.startswith("ashlar, running bond: 2 courses, 5 stones")
    assert "stone 'stone-0001': is no sawn stone, it fills" in err
    status, _, err = run("ashlar", "yard", "--units", "m", "--strict", *wall)
    assert status == 2
    assert "yard: stone 'stone-0001': is no sawn stone" in err


def test_joints_and_the_stones_as_sawn(run):
    status, _, _ = run("ashlar", "--stone", "0.29x0.14x0.2*20", "--width", 1.49, "--height", 0.44, "--depth", 0.2,
                       "--head", 0.01, "--bed", 0.01, "--out", "w.json", "--display", "d.json")  # fmt: skip
    assert status == 0
    drawn, shown = (read_model(name)[0] for name in ("w.json", "d.json"))
    assert [b.id for b in drawn.blocks] == [b.id for b in shown.blocks]
    assert np.ptp(shown.blocks[1].vertices, axis=0) == pytest.approx([0.29, 0.2, 0.14])
    assert np.ptp(drawn.blocks[1].vertices, axis=0) == pytest.approx([0.295, 0.2, 0.145])


def test_openings_bins_and_notes(run):
    status, out, err = run("ashlar", "--stone", "0.3x0.15x0.2*60", "--stone", "0.3x0.2x0.2*8", "--stone",
                           "0.9x0.15x0.2", "--width", 2.4, "--height", 1.2, "--depth", 0.2, "--courses", "bins",
                           "--opening", "0.8,0.35,0.5,0.4", "--out", "w.json")  # fmt: skip
    assert status == 0
    assert "of the face less its openings" in out
    assert "opening 1: reaches from 0.35 to 0.8 m, as courses go" in err


def test_pack_and_its_comparison(run):
    status, out, err = run("pack", *BOXES, *WALL, "--compare", "--json", "p.json")
    assert (status, err) == (0, "")
    assert "  score    0.98" in out
    assert [line.split()[0] for line in out.splitlines() if "in the slots of the bond" in line] == [
        "best", "first", "global"
    ]  # fmt: skip
    data = json.loads(Path("p.json").read_text(encoding="utf-8"))
    assert (data["settings"]["method"], data["settings"]["slots"]) == ("best", "free")
    assert [one["method"] for one in data["settings"]["compare"]] == ["best", "first", "global"]
    assert run("check", "wall.json")[0] == 0
    status, out, _ = run("pack", *BOXES, *WALL, "--bond", "third", "--method", "global", "--json", "-")
    assert json.loads(out)["settings"]["slots"] == "bond"


BAD = [
    ((), "STONES: no stock given; name a stock list or stones, or use --stone"),
    (("nowhere.csv",), "nowhere.csv: no such file"),
    (("--stone", "0.3x0.2"), "--stone: '0.3x0.2' should be LxHxD or LxHxD*N"),
    (("--stone", "0.3x0.2x-1"), "--stone: '0.3x0.2x-1' should have sizes above 0"),
    (("--stone", "0.3xax0.2"), "--stone: 'a' is not a number"),
    (("--stone", "0.3x0.15x0.2*0"), "should have sizes above 0, and be 1 to"),
    (("--stone", "0.3x0.15x0.2*9999999"), "and be 1 to 100,000 times"),
    ((*BOXES, "--bond", "dutch"), "--bond: 'dutch' is not one of"),
    ((*BOXES, "--courses", "bins:0.1"), "--courses: 'bins:0.1' should be fixed, fixed:H or bins"),
    ((*BOXES, "--courses", "fixed:0.2"), "--courses: no slab is 0.2 m high within 0.002 m"),
    ((*BOXES, "--bed", "-0.01"), "--bed -0.01: expected a length >= 0"),
    ((*BOXES, "--opening", "0,0,0.4"), "--opening: '0,0,0.4' should be X,Z,W,H"),
    ((*BOXES, "--opening", "0.5,0,0.4,2"), "--opening: number 1 reaches outside the wall"),
    ((*BOXES, "--opening", "0.4,0,0.4,0.45"), "--opening: number 1 is 0.4 m wide and takes a lintel"),
    ((*BOXES, "--height-tolerance", "x"), "--height-tolerance: 'x' is not a number"),
    ((*BOXES, "--least", "0"), "--least 0: expected a positive length"),
]


@pytest.mark.parametrize("command", ["ashlar", "pack"])
@pytest.mark.parametrize(("argv", "why"), BAD)
def test_bad_input_is_one_line(run, tmp_path, command, argv, why):
    status, out, err = run(command, *argv, *WALL)
    assert (status, out) == (2, "")
    assert err.startswith("cyclopean: error: ")
    assert err.count("\n") == 1
    assert why in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("argv", "why"),
    [
        (("--scores", "1,2"), "--scores: '1' should be NAME=W with one of length, depth, height, aspect"),
        (("--weights", "1,2"), "--weights: is --scores now"),
        (("--unit", "1"), "--unit: is --stone-length now"),
        (("--scores", "length=-3"), "--scores length: -3 is less than 0"),
        (("--scores", "length=0,depth=0,height=0,aspect=0"), "--scores: one of them must be more than 0"),
        (("--method", "worst"), "--method: 'worst' is not one of best, first, global"),
        (("--method", "global", "--slots", "free"), "--slots: the method global needs slots"),
        (("--least-score", "2"), "--least-score 2: expected a number from 0 to 1"),
        (("--slots", "any"), "--slots: 'any' is not one of free, bond"),
    ],
)
def test_bad_input_of_pack(run, argv, why):
    status, _, err = run("pack", *BOXES, *WALL, *argv)
    assert status == 2
    assert why in err


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("length,height\n1,1\n", "line 1: no column 'depth'"),
        ("length,height,depth,colour\n", "line 1: column 'colour' is unknown"),
        ("length,height,depth,depth\n", "line 1: column 'depth' stands twice"),
        ("length,height,depth\n", "lists no stone"),
        ("length,height,depth\n1,1\n", "line 2: 2 columns, the heading has 3"),
        ("length,height,depth\n1,1,nan\n", "line 2: depth 'nan' is not a positive number"),
        ("length,height,depth\n1,-1,1\n", "line 2: height '-1' is not a positive number"),
        ("length,height,depth,count\n1,1,1,1.5\n", "line 2: count '1.5' is not a whole number"),
        ("length,height,depth,count\n1,1,1,999999999\n", "line 2: count '999999999' is not a whole number of 1 to"),
        ("length,height,depth,density\n1,1,1,heavy\n", "line 2: density 'heavy' is not a positive number"),
        ("length,height,depth,id\n1,1,1,a\n1,1,1,a\n", "slab 'a': the id stands twice"),
        ('length,height,depth\n1,1,"1\n', "line 2"),
    ],
)
def test_bad_stock_lists(run, text, why):
    Path("s.csv").write_text(text, encoding="utf-8")
    status, _, err = run("ashlar", "s.csv", *WALL)
    assert status == 2
    assert err.count("\n") == 1
    assert why in err


def test_the_input_is_not_overwritten(run):
    Path("s.csv").write_text("length,height,depth\n0.3,0.15,0.2\n", encoding="utf-8")
    status, _, err = run("ashlar", "s.csv", *WALL, "--cutlist", "s.csv")
    assert status == 2
    assert "--cutlist s.csv: this is the input file" in err


def test_models_are_no_meshes_and_nothing_is_written_before_that_is_said(run, tmp_path):
    for extra, said in (
        (("--out", "w.obj"), "a model file ends in .json"),
        (("--out", "w.json", "--display", "d.xyz"), "d.xyz: unknown ending; use .json"),
    ):
        status, out, err = run("ashlar", *BOXES, *WALL, *extra)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert said in err
    assert not list(tmp_path.iterdir())


def test_stones_with_open_joints_in_another_format(run):
    assert run("ashlar", *BOXES, *WALL, "--out", "w.json", "--display", "d.stl")[0] == 0
    assert len(read_model("d.stl")[0]) == len(read_model("w.json")[0])


def test_units_of_a_table_are_not_asked_for(run):
    Path("s.csv").write_text("length,height,depth\n300,150,200\n", encoding="utf-8")
    for stock in (("s.csv",), BOXES):
        status, _, err = run("ashlar", *stock, *WALL, "--units", "mm")
        assert (status, err) == (
            2, "cyclopean: error: --units: a stock list and --stone are in metres; leave it out\n"
        )  # fmt: skip


def test_a_refusal_comes_alone(run):
    """What is said of the stock is no second line of an error."""
    Path("stock").mkdir()
    for k in range(2):
        Path("stock", f"s{k}.obj").write_text(obj(*box(0.3, 0.2, 0.15)))
    size = ("--width", 0.6, "--depth", 0.2, "--out", "w.json")
    status, out, err = run("ashlar", "stock", *size, "--height", 0.01)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "no file says its units" in run("ashlar", "stock", *size, "--height", 0.15)[2]
