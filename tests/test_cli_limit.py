"""`limit` on the command line: what it prints, writes and refuses."""

import json

import pytest

from cyclopean.proof import verify_file


@pytest.fixture
def block(run):
    assert run("make", "stack", 1, "--size", "0.4,0.5,1", "--out", "block.json")[0] == 0
    return "block.json"


def test_a_push_in_full(run, block, tmp_path):
    status, out, err = run(
        *("limit", block, "--push", "1,0,0", "--mu", 0.84),
        *("--json", "limit.json", "--certificate", "bounds.json", "--report", "page.html"),
    )
    assert (status, err) == (0, "")
    assert out.startswith(
        "It falls at the latest when it is pushed towards the right with 40 % of its weight.\n"
        "  limit    multiplier 0.4: It stands up to 4"
    )
    data = json.loads((tmp_path / "limit.json").read_text())
    assert data["schema"] == "cyclopean.limit/1"
    assert data["multiplier"]["lower"] <= 0.4 <= data["multiplier"]["upper"]
    assert data["multiplier"]["gap"] <= 1e-6
    assert data["certificate"] == {"kind": "limit-bounds", "file": "bounds.json"}
    assert data["joints"][0]["kind"] == "hinge"
    assert data["governing"]["a"] in (data["joints"][0]["a"],)
    assert len(data["mechanism"]) == 1
    assert {"read", "contacts", "solve", "verify", "total"} <= data["seconds"].keys()
    assert verify_file(tmp_path / "bounds.json").proved
    assert run("verify", "bounds.json")[0] == 0
    page = (tmp_path / "page.html").read_text()
    for told in ("0.4", "opens about a hinge", "cyclopean verify bounds.json", "How it moves"):
        assert told in page


@pytest.mark.parametrize("words", [("--tilt",), ("--tilt", "0"), ("--tilt=0",), ("--tilt", "180")])
def test_a_tilt_with_and_without_an_azimuth(run, block, words):
    status, out, _ = run("limit", block, *words, "--mu", 0.84, "--json", "-")
    data = json.loads(out)
    assert status == 0
    assert data["live"]["tilt"] in (0.0, 180.0)
    assert data["angle"]["lower"] == pytest.approx(21.801409, abs=1e-4)  # atan 0.4


def test_a_tilt_before_the_model(run, block):
    assert run("limit", "--tilt", block, "--mu", 0.84)[1].splitlines()[1].startswith("  limit    21.801 degrees: ")


def test_loads_on_blocks(run, block):
    """A cube's weight is 4707 N: 1000 N at its centre tips it at 0.2 / 0.5 of that."""
    weight = 2400 * 9.80665 * 0.2
    for load in ("b01:1000,0,0", "b01:1000,0,0@0.2,0.25,0.5"):
        status, out, err = run("limit", block, "--load", load, "--mu", 0.84, "--json", "-")
        assert (status, err) == (0, "")
        assert json.loads(out)["multiplier"]["lower"] == pytest.approx(0.4 * weight / 1000, rel=1e-5)
    twice = run("limit", block, "--load", "b01:500,0,0", "--load", "b01:500,0,0", "--mu", 0.84, "--json", "-")
    assert json.loads(twice[1])["multiplier"]["lower"] == pytest.approx(0.4 * weight / 1000, rel=1e-5)


def test_a_polar_diagram(run, block, tmp_path):
    status, out, _ = run("limit", block, "--tilt", "--polar", 4, "--mu", 0.84, "--json", "p.json", "--report", "p.html")
    data = json.loads((tmp_path / "p.json").read_text())
    assert status == 0
    assert [row["azimuth"] for row in data["polar"]] == [0, 90, 180, 270]
    assert [row["angle"]["lower"] for row in data["polar"]] == pytest.approx([21.8014, 26.5651] * 2, abs=1e-3)
    assert data["live"]["tilt"] in (0.0, 180.0)
    assert "4 azimuths" in out
    assert "Tilt by azimuth" in (tmp_path / "p.html").read_text()


def test_a_pushover_curve(run, block, tmp_path):
    status, out, _ = run(
        *("limit", block, "--push", "1,0,0", "--mu", 0.84, "--pushover", "10deg", "--steps", 2),
        *("--json", "c.json", "--report", "c.html", "--certificate", "proof.json"),
    )
    steps = json.loads((tmp_path / "c.json").read_text())["pushover"]["steps"]
    assert status == 0
    assert [step["rotation"] for step in steps] == pytest.approx([0, 5, 10], abs=1e-2)
    assert "pushover 'b01'" in out
    assert "Pushover curve" in (page := (tmp_path / "c.html").read_text())
    assert "Where it ends" in page
    assert "3 of 3 proved, in proof-step-00.json to proof-step-02.json" in out
    assert run("verify", "proof-step-02.json")[0] == 0


def test_what_coupled_analysis_says_below(run, block, tmp_path):
    status, out, _ = run("limit", block, "--push", "1,0,0", "--mu", 0.84, "--method", "cra", "--json", "c.json")
    told = json.loads((tmp_path / "c.json").read_text())["coupled"]
    assert status == 0
    assert told["stands"] == pytest.approx(0.4, rel=2e-3)
    assert "certified at" in out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "exactly one"),
        (("--push", "1,0,0", "--tilt"), "--push and --tilt"),
        (("--push", "1,0,0", "--load", "b01:1,0,0"), "--push and --load"),
        (("--push", "1,0"), "--push"),
        (("--push", "0,0,0"), "zero"),
        (("--push", "nan,0,0"), "--push"),
        (("--tilt", "nan"), "--tilt"),
        (("--load", "b01"), "BLOCK:FX,FY,FZ"),
        (("--load", ":1,0,0"), "BLOCK:FX,FY,FZ"),
        (("--load", "b01:1,0"), "--load b01"),
        (("--load", "b01:1,0,0@1"), "--load b01"),
        (("--load", "b77:1,0,0"), "no block 'b77'"),
        (("--load", "ground:1,0,0"), "supports only"),
        (("--push", "0,0,1", "--polar", "8"), "--polar 8"),
        (("--tilt", "--polar", "0"), "--polar"),
        (("--push", "1,0,0", "--steps", "8"), "--steps 8"),
        (("--push", "1,0,0", "--pushover", "-1m"), "--pushover"),
        (("--push", "1,0,0", "--pushover", "far"), "--pushover"),
        (("--push", "1,0,0", "--method", "fem"), "--method"),
        (("--push", "1,0,0", "--solver", "magic"), "--solver"),
        (("--push", "1,0,0", "--json", "nowhere/r.json"), "nowhere"),
        (("--push", "1,0,0", "--certificate", "block.json"), "input file"),
    ],
)
def test_bad_input_is_one_line(run, block, tmp_path, words, told):
    before = set(tmp_path.iterdir())
    status, out, err = run("limit", block, *words)
    assert (status, out) == (2, "")
    assert told in err
    assert len(err.strip().splitlines()) == 1
    assert set(tmp_path.iterdir()) == before


def test_what_falls_or_never_does_is_no_error(run):
    assert run("make", "stack", 2, "--offset", 0.6, "--out", "leans.json")[0] == 0
    for words in (("--push", "1,0,0"), ("--tilt", "0"), ("--tilt", "0", "--polar", "4")):
        assert run("limit", "leans.json", *words)[1].startswith("Falls as it is. ")
    assert run("limit", "leans.json", "--push=-1,0,0")[1].startswith(
        "Falls as it is. It does not stand without live loads, but"
    )
    assert run("make", "stack", 1, "--out", "cube.json")[0] == 0
    assert run("limit", "cube.json", "--push", "0,0,-1")[1].startswith("No limit. ")


def test_a_load_on_no_block_names_the_option_that_was_typed(run):
    run("make", "arch", 5, "--out", "a.json")
    assert "--live nobody: there is no such block" in run("limit", "a.json", "--live", "nobody")[2]
