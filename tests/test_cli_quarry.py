"""`make stones`."""

import numpy as np
import pytest

from cyclopean.design.stones.quarry import quarry
from cyclopean.design.stones.stone import stone_of
from cyclopean.io import read_model
from cyclopean.io.stones import read_stones

COARSE = ("--detail", "1")


def test_a_folder_gets_one_file_a_stone_and_every_option_counts(run, tmp_path):
    (tmp_path / "q").mkdir()
    status, out, err = run(
        "make", "stones", "--count", 3, "--seed", 5, "--volume", "30..60L", "--detail", 2, "--out", "q"
    )
    assert (status, err) == (0, "")
    assert out.startswith("3 stones, 0.")
    assert out.endswith("written q\n")
    assert sorted(p.name for p in (tmp_path / "q").iterdir()) == [f"stone-{k:04d}.obj" for k in (1, 2, 3)]
    inventory, _ = read_stones("q", "m", cache=False)
    for read, made in zip(inventory.stones, quarry(3, 5, (0.03, 0.06), detail=2), strict=True):
        assert read.id == made.id
        assert read.vertices.tolist() == made.vertices.tolist()
        assert 0.03 <= read.volume <= 0.06


@pytest.mark.parametrize("name", ["s.glb", "s.ply", "s.obj", "s.stl", "s.json"])
def test_one_file_holds_all_stones_laid_out(run, name):
    status, out, err = run("make", "stones", "--count", 4, *COARSE, "--out", name)
    assert (status, err) == (0, "")
    assert out.count("\n") == 1
    model, _ = read_model(name, "m")
    assert len(model) == 4
    for block, made in zip(model.blocks, quarry(4, detail=1), strict=True):
        assert block.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-6)
        assert stone_of(block.id, block.vertices, block.faces).volume == pytest.approx(made.volume, rel=1e-4)
    assert len(np.unique([b.vertices[:, :2].mean(axis=0).round(1).tolist() for b in model.blocks], axis=0)) == 4


@pytest.mark.parametrize(
    ("text", "band"), [("30..200L", (0.03, 0.2)), ("0.1..0.1m3", (0.1, 0.1)), ("5 .. 6 l", (0.005, 0.006))]
)
def test_bands_in_litres_and_cubic_metres(run, text, band):
    assert run("make", "stones", "--count", 2, "--volume", text, *COARSE, "--out", "s.json")[0] == 0
    model, _ = read_model("s.json")
    for volume in model.mass.volume:
        assert band[0] * (1 - 1e-9) <= volume <= band[1] * (1 + 1e-9)


def test_other_meshes_in_the_folder_are_told_of(run, tmp_path):
    (tmp_path / "q").mkdir()
    assert run("make", "stones", "--count", 3, *COARSE, "--out", "q")[2] == ""
    assert run("make", "stones", "--count", 3, *COARSE, "--out", "q")[2] == ""
    status, _, err = run("make", "stones", "--count", 1, *COARSE, "--out", "q")
    assert status == 0
    assert err == "cyclopean: warning: q: also holds 2 other mesh files, left as they are\n"


@pytest.mark.parametrize(
    ("argv", "why"),
    [
        (("--count", "0", "--out", "s.obj"), "--count 0: expected a whole number >= 1"),
        (("--count", "-3", "--out", "s.obj"), "--count -3: expected a whole number >= 1"),
        (("--count", "2.5", "--out", "s.obj"), "--count: '2.5' is not a whole number"),
        (("--count", "1000000", "--out", "s.obj"), "more than 20,000,000 vertices"),
        (("--seed", "-1", "--out", "s.obj"), "--seed: -1 is negative"),
        (("--detail", "0", "--out", "s.obj"), "--detail: 0 subdivisions; give 1 to 6"),
        (("--count", "1", "--detail", "7", "--out", "s.obj"), "--detail: 7 subdivisions; give 1 to 6"),
        (("--count", "1", "--detail", "99999999", "--out", "s.obj"), "more than 20,000,000 vertices"),
        (("--volume", "200..30L", "--out", "s.obj"), "--volume: '200..30L' ends below its beginning"),
        (("--volume", "0..30L", "--out", "s.obj"), "--volume: '0..30L' begins at nothing"),
        (("--volume", "-5..30L", "--out", "s.obj"), "--volume: '-5..30L' begins at nothing"),
        (("--volume", "30..200", "--out", "s.obj"), "should be LOW..HIGH with the unit L or m3"),
        (("--volume", "30L", "--out", "s.obj"), "should be LOW..HIGH"),
        (("--volume", "a..bL", "--out", "s.obj"), "--volume: 'a' is not a number"),
        (("--volume", "1..nanL", "--out", "s.obj"), "--volume: 'nan' is not a finite number"),
        (("--out", "nowhere"), "--out nowhere: no such folder; make it first"),
        (("--out", "nowhere/s.obj"), "does not exist; make it first"),
        (("--out", "s.png"), "--out s.png: unknown ending"),
        (("--out", ""), "--out"),
    ],
)
def test_bad_input_is_one_line(run, tmp_path, argv, why):
    status, out, err = run("make", "stones", *argv)
    assert (status, out) == (2, "")
    assert err.startswith("cyclopean: error: ")
    assert err.count("\n") == 1
    assert why in err
    assert not list(tmp_path.iterdir())


def test_out_is_needed(run):
    status, _, err = run("make", "stones")
    assert status == 2
    assert "--out" in err
