"""`sequence` from the outside: words, files, statuses, the page."""

import json
import re
from dataclasses import replace
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest

from cyclopean import io
from cyclopean.analysis import Settings
from cyclopean.design import wall
from cyclopean.design.construction.sequence import build_sequence
from cyclopean.view import building_html
from cyclopean.view.building import building_svg
from sequence_cases import interlocked


@pytest.fixture
def arch(run):
    assert run("make", "arch", 5, "--out", "arch.json")[0] == 0
    return "arch.json"


def test_in_words(run, arch):
    status, out, err = run("sequence", arch, "--out", "seq.json")
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].startswith("Stands when finished. While it is built it needs a strut against ")
    assert lines[1] == "  sequence 5 stones in 3 layers; stages: 1 stable, 4 unstable"
    assert lines[3] == "  first    unstable at step 1, with 'v01': 'v01' topples"
    assert lines[4] == "  props    4 stones to hold: no fewer would do"
    assert lines[-1] == "  written  seq.json"
    assert out.isascii()


def test_the_file(run, arch):
    run("sequence", arch, "--out", "seq.json", "--method", "rbe", "--dot", "graph.dot")
    with open("seq.json", encoding="utf-8") as file:
        data = json.load(file)
    assert (data["schema"], data["method"], data["blocks"], data["free"]) == ("cyclopean.sequence/1", "rbe", 7, 5)
    assert data["order"] == ["v01", "v05", "v02", "v04", "v03"]
    assert data["layers"] == [["v01", "v05"], ["v02", "v04"], ["v03"]]
    assert data["supports"] == ["springer-left", "springer-right"]
    assert data["stages"] == {"stable": 1, "unstable": 4, "undecided": 0}
    assert data["first_unstable"]["block"] == "v01"
    assert data["steps"][0]["proof"]["kind"] == "rbe-mechanism"
    assert data["steps"][4]["rests_on"] == ["v02", "v04"]
    assert all(np.shape(frame) == (4, 4) for step in data["steps"] for frame in step["frames"].values())
    assert data["colours"].keys() == {"springer-left", "springer-right", *data["order"]}
    with open("graph.dot", encoding="utf-8") as file:
        assert file.read() == data["dot"]


def test_dash_prints_the_file_and_nothing_else(run, arch):
    _, out, _ = run("sequence", arch, "--out", "seq.json", "--json", "-")
    with open("seq.json", encoding="utf-8") as file:
        assert json.loads(out) == json.load(file)


def test_cycles_and_trapped_stones_are_said(run):
    io.write_model("pair.json", interlocked())
    _, out, _ = run("sequence", "pair.json", "--out", "seq.json")
    assert "  cycle    'a', 'b' rest on each other; set aside: 'a' on 'b'\n" in out
    with open("seq.json", encoding="utf-8") as file:
        data = json.load(file)
    assert [(e["upper"], e["lower"]) for e in data["graph"] if e["broken"]] == [("a", "b")]
    (cycle,) = data["cycles"]
    assert cycle["alternatives"][0]["order"] == ["b", "a"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--method", "magic"], "--method: 'magic' is not one of cra, rbe"),
        (["--bearing", "1"], "--bearing 1: expected a number from 0 up to, not including, 1"),
        (["--bearing", "-0.1"], "--bearing -0.1: expected a number >= 0"),
        (["--lean", "0.1"], "--lean: is --bearing now; a lean is an angle, as in settle"),
        (["--clearance", "0"], "--clearance 0: expected a positive number of metres"),
        (["--props", "2"], "--props: the fewest stones to hold are always looked for now; leave it out"),
        (["--order", "none.csv"], "none.csv: no such file; check the path"),
        (["--workers", "0"], "--workers: 0 is not between 1 and 256"),
        (["--seconds", "0"], "--seconds 0: expected a positive number"),
        (["--gravity", "0,0,0"], "--gravity 0,0,0: without gravity no stone rests on another; give a direction"),
        (["--supports", "ids=nobody"], "--supports ids=nobody: block 'nobody' is not in the model"),
        (["--report", "no/where.html"], "--report no/where.html: the folder 'no' does not exist; make it first"),
        (["--dot", "seq.json"], "--dot seq.json: --out writes to the same file"),
    ],
)
def test_refused_in_one_line(run, arch, tmp_path, options, message):
    status, out, err = run("sequence", arch, "--out", "seq.json", *options)
    assert (status, out, err) == (2, "", f"cyclopean: error: {message}\n")
    assert not (tmp_path / "seq.json").exists()


def test_out_is_needed_and_is_not_the_model(run, arch):
    assert run("sequence", arch)[0] == 2
    status, _, err = run("sequence", arch, "--out", arch)
    assert status == 2
    assert "this is the input file" in err


def test_the_page(run, arch):
    run("sequence", arch, "--out", "seq.json", "--report", "page.html")
    with open("page.html", encoding="utf-8") as file:
        page = file.read()
    assert not re.search(r"""(?:src|href)=["'](?:https?:|//)""", page)
    assert page.count("<use ") == 5  # each stone in the yard
    assert "Stands when finished" in page
    assert page.count("<animateTransform") == 5 + 1  # each stone, and the hand on the bar
    assert page.count('begin="building.click"') == 6 + 2 * 5  # and each stone is seen in one place at a time


def test_stones_move_from_the_yard_into_place_one_after_the_other():
    """SVG time: a stone waits until the one before it is in place, and ends where it was drawn."""
    found = build_sequence(wall(2, 2), Settings(method="rbe"))
    svg = ElementTree.fromstring(building_svg(found))
    moves = svg.findall(".//{*}g/{*}animateTransform")
    assert len(moves) == len(found.steps) == 5
    spans = []
    for move in moves:
        times = [float(t) for t in move.get("keyTimes").split(";")]
        stops = [tuple(map(float, v.split())) for v in move.get("values").split(";")]
        assert times == sorted(times)
        assert (times[0], times[-1]) == (0.0, 1.0)
        assert stops[0] == stops[1] != stops[-1] == stops[-2] == (0.0, 0.0)
        spans.append((times[1], times[4]))
    spans.sort()
    assert all(end <= start + 1e-4 for (_, end), (start, _) in pairwise(spans))


def test_names_cannot_break_out_of_the_page():
    model = wall(1, 1)
    blocks = tuple(replace(b, id=f"<b>{k}&\"'</b>") for k, b in enumerate(model.blocks))
    page = building_html(build_sequence(replace(model, blocks=blocks, name="<i>&")))
    assert "<b>" not in page
    assert "<i>&" not in page


def test_all_supports_make_a_page_too(run):
    run("make", "stack", 1, "--out", "m.json")
    status, out, _ = run("sequence", "m.json", "--supports", "below=9", "--out", "s.json", "--report", "p.html")
    assert status == 0
    assert out.startswith("Nothing to build. ")
