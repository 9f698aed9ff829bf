"""`carve` from the outside: words, files, statuses, what it refuses; and the match file that it reads."""

import csv
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from carving_cases import stone_like
from cyclopean import io
from cyclopean.assembly import Assembly
from cyclopean.design import wall
from cyclopean.design.carving.carve import carve_all
from cyclopean.design.matching.cells import cells_of
from cyclopean.design.matching.match import Match, MatchSettings, Placement
from cyclopean.design.stones.inventory import Inventory
from cyclopean.errors import InputError
from cyclopean.io.matches import MatchFiles, match_dict, read_match, stone_hash, wall_hash
from cyclopean.io.stones import read_stones, write_stones
from cyclopean.proof import verify_file

FILES = {
    "after.svg", "before.svg", "carved.glb", "carved.json", "certificate.json", "cuts.csv", "cutlist.csv",
    "offcuts.glb", "placements.json", "result.json",
}  # fmt: skip
LAMBDA = 1.0 - 1.1**-3  # of a stone 10 % too long each way


@pytest.fixture(autouse=True)
def no_cache(monkeypatch, tmp_path_factory):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))


def matched(scale=1.1, left_out=0):
    """Bricks of a small wall, each with a stone of its own shape; files in the current folder."""
    drawn = wall(2, 2)
    Path("stones").mkdir(exist_ok=True)
    io.write_model("wall.json", drawn)
    free = [block for block in drawn.blocks if not block.fixed]
    write_stones("stones", Inventory(tuple(stone_like(b, scale, f"stone {b.id}") for b in free)))
    stones = read_stones("stones", "m", cache=False)[0].stones
    cells = cells_of(io.read_model("wall.json")[0])
    number = {stone.id: i for i, stone in enumerate(stones)}
    names = [cells.assembly.blocks[i].id for i in cells.block]
    placed = [
        Placement(number[f"stone {name}"], j, np.eye(3), np.zeros(3), cells.volume[j], LAMBDA, 0.0)
        for j, name in enumerate(names[: len(names) - left_out])
    ]
    empty = np.arange(len(names) - left_out, len(names))
    unused = np.array([number[f"stone {names[j]}"] for j in empty], np.int64)
    match = Match(tuple(placed), unused, empty, LAMBDA, 0.0, 0.0, 1.0, MatchSettings())
    data = match_dict(match, stones, cells, MatchFiles("stones", "wall.json", "m"))
    io.write_json("match.json", data)
    Path("out").mkdir(exist_ok=True)
    return match, stones, cells


def changed(**fields):
    """The match file with some fields replaced; None takes one out."""
    data = json.loads(Path("match.json").read_text()) | fields
    Path("match.json").write_text(json.dumps({k: v for k, v in data.items() if v is not None}))


def test_in_words_and_in_files(run, tmp_path):
    matched()
    status, out, err = run("carve", "match.json", "--out", "out")
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].startswith("As it will be built: stands. ")
    assert lines[1] == f"  carved   5 stones, Lambda {LAMBDA:.4f}, gap 0.0000"
    assert lines[3] == "  cuts     30 cuts, 1.68 m2, and 0 faces to dress"
    assert lines[4] == "  joints   9 of 9 touch, over 100% of the area that was drawn"
    assert lines[5] == "  verdict  stable, by cra"
    assert lines[-1] == "  written  out"
    assert out.isascii()
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES
    assert verify_file("out/certificate.json").proved
    result = json.loads(Path("out/result.json").read_text())
    assert (result["verdict"], result["certificate"]["file"]) == ("stable", "certificate.json")
    assert run("check", "out/carved.json")[0] == 0


def test_tables(run):
    match, stones, cells = matched()
    run("carve", ".", "--out", "out")
    with open("out/cutlist.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["cell"] for row in rows] == [cells.assembly.blocks[i].id for i in cells.block]
    for row, placed in zip(rows, match.placements, strict=True):
        volume = 1e3 * stones[placed.stone].volume
        assert row["stone"] == stones[placed.stone].id
        assert float(row["lambda"]) == pytest.approx(LAMBDA, abs=1e-6)
        assert float(row["stone [L]"]) == pytest.approx(volume, rel=1e-5)
        assert float(row["carved [L]"]) + float(row["offcuts [L]"]) == pytest.approx(volume, rel=1e-5)
        assert (row["offcuts"], row["cuts"], row["dressed faces"]) == ("1", "6", "0")
    with open("out/cuts.csv", encoding="utf-8", newline="") as file:
        cuts = list(csv.DictReader(file))
    assert len(cuts) == 30
    assert [cut["cut"] for cut in cuts[:6]] == list("123456")
    assert {cut["to nearest flat face [deg]"] for cut in cuts} == {"0.00"}  # a brick is flat all round
    for cut in cuts:
        normal = [float(cut[f"normal {axis}"]) for axis in "xyz"]
        assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-5)
        block = next(b for b in cells.assembly.blocks if b.id == cut["cell"])  # stones lie in the frame of the wall
        assert float(cut["offset [mm]"]) == pytest.approx(1e3 * (block.vertices @ normal).max(), abs=0.01)
        assert len(cut["neighbouring cuts [deg]"].split()) == 4


def test_meshes_and_placements(run):
    _, stones, cells = matched()
    run("carve", "match.json", "--out", "out")
    names = [cells.assembly.blocks[i].id for i in cells.block]
    carved, offcuts = (io.read_model(f"out/{name}.glb")[0] for name in ("carved", "offcuts"))
    assert [block.id for block in carved.blocks] == names
    assert carved.mass.volume == pytest.approx(cells.volume, rel=1e-5)
    assert [block.id for block in offcuts.blocks] == [f"stone {name} offcut 1" for name in names]
    assert offcuts.mass.volume == pytest.approx(cells.volume * (1.1**3 - 1.0), rel=1e-4)
    placements = json.loads(Path("out/placements.json").read_text())
    assert (placements["schema"], len(placements["placements"])) == ("cyclopean.placements/1", len(stones))
    assert placements["placements"][0]["transform"] == np.eye(4).tolist()


def test_json(run):
    matched()
    status, out, err = run("carve", "match.json", "--out", "out", "--json", "-", "--method", "rbe")
    assert (status, err) == (0, "")
    data = json.loads(out)
    assert data["schema"] == "cyclopean.carving/1"
    assert data["Lambda"] == pytest.approx(LAMBDA, abs=1e-12)
    assert data["imbalance"] <= 1e-9
    assert data["check"]["verdict"] == "stable"
    assert data["check"]["method"] == "rbe"
    assert data["joints"] == {"drawn": 9, "touching": 9, "touching_share": pytest.approx(1.0), "least_hull_kept": 1.0}
    for row in data["stones"]:
        assert sum(p["volume"] for p in row["offcuts"]) + row["volume"] == pytest.approx(row["stone_volume"], rel=1e-9)


def test_shallow_cuts_are_dressing_where_asked(run):
    matched(scale=1.004)  # 0.8 mm at the ends of a brick of 0.4 m
    _, out, err = run("carve", "match.json", "--out", "out")
    assert "  cuts     0 cuts, 0.00 m2, and 30 faces to dress\n" in out
    assert err == "cyclopean: warning: out/offcuts.glb: there is nothing to write in it\n"
    _, out, _ = run("carve", "match.json", "--out", "out", "--least-cut", "0")
    assert "  cuts     30 cuts" in out


def test_a_missing_stone_is_said_and_the_wall_is_checked_without_it(run):
    matched(left_out=1)
    status, out, err = run("carve", "match.json", "--out", "out")
    assert status == 0
    assert re.search(r"warning: 1 cell\(s\) have no stone: '[^']+'\n", err)
    assert "carved   4 stones" in out


def test_pictures(run):
    matched(left_out=1)
    run("carve", "match.json", "--out", "out", "--report", "page.html")
    for name in ("before", "after"):
        svg = ElementTree.parse(f"out/{name}.svg")
        text = " ".join(t.text or "" for t in svg.iter("{http://www.w3.org/2000/svg}text"))
        assert "0.27 Cyclopean Cannibalism" in text
        groups = [g for g in svg.iter("{http://www.w3.org/2000/svg}g") if len(g) and g[0].tag.endswith("title")]
        assert len(groups) == 4
        hatched = [p for g in groups for p in g.iter() if p.get("data-layer") == "offcuts"]
        assert len(hatched) == (4 if name == "before" else 0)
    page = Path("page.html").read_text(encoding="utf-8")
    outside = re.sub(r'srcdoc="[^"]*"', "", page)  # the scene brings a script of its own
    assert not re.search(r"""\b(?:src|href)=["']""", outside)
    assert "cyclopean verify out/certificate.json" in page
    assert "cell without a stone" in page
    assert page.count("<svg") >= 2


def test_names_cannot_break_out_of_page_or_table(run):
    matched()
    data = json.loads(Path("wall.json").read_text())
    nasty = '<b>"x", y</b>'
    old = data["blocks"][-1]["id"]
    Path("wall.json").write_text(json.dumps(data).replace(f'"{old}"', json.dumps(nasty)))
    rows = json.loads(Path("match.json").read_text())["placements"]
    for row in rows:
        row["cell"] = nasty if row["cell"] == old else row["cell"]
    changed(placements=rows, wall_hash=None)
    assert run("carve", "match.json", "--out", "out", "--report", "page.html")[0] == 0
    assert "<b>" not in Path("page.html").read_text(encoding="utf-8")
    with open("out/cutlist.csv", encoding="utf-8", newline="") as file:
        assert nasty in [row["cell"] for row in csv.DictReader(file)]


def test_the_match_file_goes_round(run):
    """What is written is read back; the carving from the file is that of the match."""
    match, stones, cells = matched(left_out=1)
    stored = read_match(".")
    assert [(p.stone, p.cell) for p in stored.placements] == [
        (stones[p.stone].id, cells.assembly.blocks[cells.block[p.cell]].id) for p in match.placements
    ]
    assert stored.unused == tuple(stones[i].id for i in match.unused)
    assert len(stored.empty) == 1
    assert (stored.stone_units, stored.wall_units) == ("m", None)
    assert stored.changed({stone.id: stone for stone in stones}, cells.assembly) is None
    carved = carve_all(match.placed(stones, cells))
    assert [c.carved_share for c in carved] == pytest.approx([LAMBDA] * len(carved), abs=1e-12)
    assert [(c.stone, c.cell) for c in carved] == [(p.stone, p.cell) for p in stored.placements]


def test_hashes_tell_shapes_apart():
    drawn = wall(1, 1)
    stone = stone_like(drawn.blocks[1])
    assert stone_hash(stone) == stone_hash(stone_like(drawn.blocks[1], 1.0, "another name"))
    assert stone_hash(stone) != stone_hash(stone_like(drawn.blocks[1], 1.0 + 1e-9))
    assert wall_hash(drawn) == wall_hash(Assembly(drawn.blocks, name="renamed"))
    assert wall_hash(drawn) != wall_hash(Assembly(drawn.blocks[:-1]))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"schema": "cyclopean.model/1"}, "is not a match: its schema is the text 'cyclopean.model/1'"),
        ({"schema": None}, "is not a match: it has no schema"),
        ({"placements": None}, 'match.json: has no "placements"'),
        ({"placements": [{"stone": "a", "cell": "b"}]}, 'match.json: placements[0]: has no "transform"'),
        (
            {"placements": [{"stone": "a", "cell": "b", "transform": [[1, 0, 0, 0]]}]},
            "match.json: placements[0].transform must be four rows of four numbers",
        ),
        (
            {"placements": [{"stone": "a", "cell": "b", "transform": (2.0 * np.eye(4)).tolist()}]},
            "match.json: placements[0].transform is not a rotation and a shift",
        ),
        (
            {"placements": [{"stone": "a", "cell": "b", "transform": np.eye(4).tolist()}]},
            "match.json: stone 'a' is not among the stones of 'stones'",
        ),
        ({"stones": "nowhere"}, "nowhere: no such file; check the path"),
        ({"units": {"stones": "furlong"}}, "match.json: units.stones: 'furlong' is not a unit of length; use m, cm"),
        ({"wall": "gone.json"}, "gone.json: no such file; check the path"),
        ({"wall_hash": "0"}, "match.json: the wall 'wall.json' has changed since the match was made; match again"),
    ],
)
def test_refused_in_one_line(run, tmp_path, fields, message):
    matched()
    changed(**fields)
    status, out, err = run("carve", "match.json", "--out", "out")
    assert (status, out) == (2, "")
    assert err.startswith("cyclopean: error: ")
    assert message in err
    assert err.count("\n") == 1
    assert not list((tmp_path / "out").iterdir())


def test_a_changed_stone_is_refused_by_name(run):
    _, stones, _ = matched()
    path = Path("stones") / f"{stones[0].id}.obj"
    lines = path.read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("v "))
    x, *rest = lines[first].split()[1:]
    lines[first] = f"v {float(x) + 1e-6} {' '.join(rest)}"
    path.write_text("\n".join(lines) + "\n")
    status, _, err = run("carve", "match.json", "--out", "out")
    said = f"match.json: stone '{stones[0].id}' has changed since the match was made; match again"
    assert (status, err) == (2, f"cyclopean: error: {said}\n")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--least-cut", "-1"], "--least-cut -1: expected a number >= 0"),
        (["--least-cut", "thin"], "--least-cut: 'thin' is not a number"),
        (["--method", "magic"], "--method: 'magic' is not one of cra, rbe"),
        (["--json", "match.json"], "--json match.json: this is the input file; choose another name"),
        (["--report", "wall.json"], "--report wall.json: this is the input file; choose another name"),
        (["--report", "no/where.html"], "--report no/where.html: the folder 'no' does not exist; make it first"),
        (["--supports", "ids=nobody"], "--supports ids=nobody: block 'nobody' is not in the model"),
    ],
)
def test_options_are_refused(run, tmp_path, options, message):
    matched()
    status, out, err = run("carve", "match.json", "--out", "out", *options)
    assert (status, out, err) == (2, "", f"cyclopean: error: {message}\n")
    assert not list((tmp_path / "out").iterdir())


def test_folders(run):
    matched()
    assert run("carve", "match.json", "--out", "nowhere")[2] == "cyclopean: error: --out nowhere: no such folder\n"
    assert "the folder holds no match.json" in run("carve", "stones", "--out", "out")[2]
    assert run("carve", "match.json", "--out", "")[2] == "cyclopean: error: --out: '' is no folder; . is this one\n"
    assert run("carve", "match.json")[0] == 2


def test_nothing_is_written_among_the_stones(run):
    """Carved stones and offcuts would be taken for found ones by the next match."""
    matched()
    before = sorted(path.name for path in Path("stones").iterdir())
    status, out, err = run("carve", "match.json", "--out", "stones")
    assert (status, out) == (2, "")
    assert err == (
        "cyclopean: error: --out carved.glb stones/carved.glb: lies among the stones and would be read as one;"
        " choose another folder\n"
    )
    assert sorted(path.name for path in Path("stones").iterdir()) == before


def test_what_was_held_in_the_match_is_held_here(run):
    """By hand: a mesh file says no supports; three bricks on it are held where the match was told so."""
    matched()
    data = json.loads(Path("match.json").read_text())
    lowest = [row for row in data["placements"] if row["cell"].startswith("c01")]
    rest = [row for row in data["placements"] if row not in lowest]
    assert lowest
    assert rest
    changed(placements=rest, settings={"supports": "ids=ground," + ",".join(row["cell"] for row in lowest)})
    status, out, err = run("carve", "match.json", "--out", "out")
    assert (status, err) == (0, "")
    assert f"carved   {len(rest)} stones" in out
    assert "have no stone" in run("carve", "match.json", "--out", "out", "--supports", "ids=ground")[2]


def test_an_option_without_effect_is_told(run):
    matched()
    _, _, err = run("carve", "match.json", "--out", "out", "--method", "rbe", "--seconds", "5")
    assert err == "cyclopean: warning: --seconds: no effect, for only coupled analysis has it (--method cra)\n"


def test_two_stones_for_a_cell_are_refused(tmp_path):
    row = {"stone": "a", "cell": "b", "transform": np.eye(4).tolist()}
    data = {"schema": "cyclopean.match/1", "stones": ".", "wall": "w", "placements": [row, row | {"stone": "c"}]}
    (tmp_path / "match.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match="cell 'b' is placed twice"):
        read_match(tmp_path)
