"""What a first user gets wrong: every row of these tables has its one line and status 2, or its verdict by hand."""

import copy
import json
import os
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cyclopean.proof import seal
from test_io_fuzz import ascii_ply, binary_stl, compas

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
TOP = CUBE[4:8]
WEIGHT = 2400.0 * 9.80665  # N, of a cube
SIZE = 6**0.5  # m, of the pair
unix = pytest.mark.skipif(os.name == "nt", reason="needs what Unix has")


def block(name, at=(0, 0, 0), size=(1, 1, 1), **more):
    return {"id": name, "vertices": (CUBE * size + at).tolist(), "faces": copy.deepcopy(FACES), **more}


def model(*blocks, **more):
    return {"schema": "cyclopean.model/1", "units": "m", "blocks": list(blocks), **more}


def pair(upper=None, **more):
    """A cube on a fixed cube."""
    return model(block("g", fixed=True), block("b", (0, 0, 1)) | (upper or {}), **more)


def joined(polygon=TOP, **more):
    """The pair with its contact given."""
    return pair(contacts=[{"a": "g", "b": "b", "polygon": np.asarray(polygon).tolist()} | more])


def loaded(force, point, name="b"):
    """The pair with a load."""
    return pair(loads=[{"block": name, "force": force, "point": point}])


@pytest.fixture
def check(run):
    """Write a model, check it, verify what it proves: status, result, stderr."""

    def command(document, *options):
        text = document if isinstance(document, str) else json.dumps(document)
        Path("m.json").write_text(text, encoding="utf-8")
        status, out, err = run("check", "m.json", "--no-margins", "--json", "-", "--certificate", "c.json", *options)
        if status == 2:
            refused((status, out, err))
            assert os.listdir() == ["m.json"]
            return status, None, err
        result = json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} is not JSON"))
        assert status == {"stable": 0, "unstable": 1, "undecided": 3}[result["verdict"]]
        if status in (0, 1):
            assert run("verify", "c.json")[0] == 0
            assert result["certificate"] == {"kind": ("cra-state", "rbe-mechanism")[status], "file": "c.json"}
        return status, result, err

    return command


def refused(answer, *said):
    """The contract of an error."""
    status, out, err = answer
    assert (status, out) == (2, ""), err
    assert err.startswith("cyclopean: error: ")
    assert err.count("\n") == 1
    assert len(err) < 500
    for word in said:
        assert word in err


def changed(change, document=None):
    document = pair() if document is None else document
    change(document)
    return document


def text_of(old, new):
    return json.dumps(pair()).replace(old, new, 1)


BAD_MODELS = {
    "cut off": (json.dumps(pair())[:-30], "ends early"),
    "not an object": ("[]", "cyclopean.model/1"),
    "null": ("null", "cyclopean.model/1"),
    "no schema": ("{}", "cyclopean.model/1"),
    "wrong schema": (pair() | {"schema": "x"}, "schema"),
    "no blocks": (model(), "no blocks"),
    "NaN": (text_of("[1.0, 1.0, 1.0]", "[NaN, 1.0, 1.0]"), "block 'g': vertices[6][0]"),
    "1e400": (text_of("[1.0, 1.0, 1.0]", "[1e400, 1.0, 1.0]"), "block 'g': vertices[6][0]"),
    "text for a number": (text_of("[1.0, 1.0, 1.0]", '["1", 1.0, 1.0]'), "block 'g': vertices[6][0]"),
    "two coordinates": (text_of("[1.0, 1.0, 1.0]", "[1.0, 1.0]"), "block 'g': vertices[6]"),
    "face index": (pair({"faces": [[0, 3, 2, 99], *FACES[1:]]}), "block 'b': faces[0] names vertex 99"),
    "negative index": (pair({"faces": [[0, 3, 2, -1], *FACES[1:]]}), "block 'b': faces[0] names vertex -1"),
    "open mesh": (pair({"faces": FACES[:3]}), "m.json: block 'b' is open"),
    "no volume": (pair(block("b", (0, 0, 1), (1, 1, 0))), "block 'b' is a sheet without thickness near (0.5, 0.5, 1)"),
    "same id": (model(block("g"), block("g", (0, 0, 1))), "block 'g'"),
    "id a number": (pair({"id": 3}), "blocks[1].id"),
    "empty id": (pair({"id": ""}), "blocks[1].id"),
    "density below zero": (pair({"density": -1}), "block 'b': density -1"),
    "density zero": (pair({"density": 0}), "block 'b': density 0"),
    "fixed no truth": (pair({"fixed": 1}), "block 'b': fixed"),
    "unit": (pair() | {"units": "furlong"}, "furlong"),
    "key twice": (text_of('"units": "m"', '"units": "m", "units": "mm"'), "units"),
    "unknown block": (joined(b="zz"), "contact 0: b names block 'zz'"),
    "block to itself": (joined(b="g"), "contact 0"),
    "not planar": (joined(TOP + np.diag([0, 0, 0.1, 0])[:, :3]), "contact 0 (g-b): its polygon is not"),
    "two points": (joined(TOP[:2]), "2 points"),
    "no area": (joined([[0, 0, 1], [0.5, 0, 1], [1, 0, 1]]), "contact 0 (g-b): its polygon has no area"),
    "off the blocks": (joined(TOP + np.array([0, 0, 0.0051 * SIZE])), "0.5 % of the smaller block's size"),
    "beside the blocks": (joined(TOP + np.array([0.5, 0, 0])), "contact 0 (g-b)"),
    "mu below zero": (joined(mu=-1), "contact 0 ('g' to 'b'): mu -1"),
    "mu NaN": (joined(mu=float("nan")), "mu is not a finite number"),
    "contacts an object": (pair(contacts={}), "contacts must be a list"),
    "nothing held": (model(block("a", fixed=False)), "no block is a support"),
    "load on nobody": (loaded([0, 0, 1], [0, 0, 1], "zz"), "load 0: block names block 'zz'"),
    "load in the plane": (loaded([0, 1], [0, 0, 1]), "load 0: force must be [x, y, z]"),
    "load NaN": (loaded([0, 0, float("nan")], [0, 0, 1]), "load 0: force[2]"),
}


@pytest.mark.parametrize("name", BAD_MODELS)
def test_a_bad_model_is_refused(check, name):
    document, said = BAD_MODELS[name]
    status, _, err = check(document)
    assert status == 2
    assert said in err


def test_info_and_convert_refuse_what_cannot_be_read(run):
    for name in ("cut off", "NaN", "face index", "same id", "unknown block", "two points", "load NaN"):
        document, said = BAD_MODELS[name]
        Path("m.json").write_text(document if isinstance(document, str) else json.dumps(document), encoding="utf-8")
        for argv in (["info", "m.json"], ["convert", "m.json", "m.obj"]):
            refused(run(*argv), said)
            assert os.listdir() == ["m.json"]


BAD_OPTIONS = [
    (["--supports", "foo"], "--supports foo"),
    (["--supports", "below="], "--supports below="),
    (["--supports", "below=x"], "'x' is not a height"),
    (["--supports", "below=nan"], "--supports below=nan"),
    (["--supports", "below=-5"], "no block is a support"),
    (["--supports", "ids="], "no block is a support"),
    (["--supports", "ids=b,zz"], "block 'zz'"),
    (["--gravity", "1,2"], "--gravity"),
    (["--gravity", "-1", "0", "-9"], "-9"),
    (["--gravity", "0,0,-1e300"], "--gravity: -1e+300 is beyond"),
    (["--tilt", "5,"], "--tilt"),
    (["--tilt", ""], "--tilt"),
    (["--mu", "1e300"], "--mu: 1e+300 is beyond"),
    (["--mu", "-0.1"], "--mu"),
    (["--density", "1e300"], "--density: 1e+300 is beyond"),
    (["--density", "1e-300"], "--density"),
    (["--tolerance", "0"], "--tolerance"),
    (["--cone", "inscribed:2"], "--cone inscribed:2"),
    (["--units", "mm"], "--units mm"),
]


@pytest.mark.parametrize(("options", "said"), BAD_OPTIONS)
def test_a_bad_option_is_refused(check, options, said):
    status, _, err = check(pair(), *options)
    assert status == 2
    assert said in err


VERDICTS = {
    "as it stands": (pair(), [], 0),
    "all held": (model(block("g", fixed=True), block("b", (0, 0, 1), fixed=True)), [], 0),
    "one block, on the ground": (model(block("a")), [], 0),
    "none said to be held: the lowest": (model(block("a"), block("b", (0, 0, 1))), [], 0),
    "touches nothing": (pair(block("b", (0, 0, 2))), [], 1),
    "touches along an edge": (pair(block("b", (1, 0, 1))), [], 1),
    "two that hold each other in the air": (
        model(block("g", fixed=True), block("b", (0, 0, 3)), block("c", (0, 0, 4))),
        [],
        1,
    ),
    "no contacts, and said so": (pair(contacts=[]), [], 1),
    "contacts null are detected": (pair(contacts=None), [], 0),
    "frictionless on level ground": (pair(), ["--mu", "0"], 0),
    "frictionless on a slope": (pair(), ["--mu", "0", "--tilt", "0.001"], 1),
    "rough on a slope": (pair(), ["--mu", "1e9", "--tilt", "44.999"], 0),
    "rough, tips": (pair(), ["--mu", "1e9", "--tilt", "45.001"], 1),
    "mu of the contact wins, low": (joined(mu=0.1), ["--mu", "1", "--tilt", "20"], 1),
    "mu of the contact wins, high": (joined(mu=1.0), ["--mu", "0.1", "--tilt", "20"], 0),
    "mu fills in": (joined(), ["--mu", "0.1", "--tilt", "20"], 1),
    "light as nothing": (pair(), ["--density", "1e-9"], 0),
    "weightless": (pair(), ["--gravity", "0,0,0"], 0),
    "next to weightless": (pair(), ["--gravity", "0,0,-1e-300"], 0),
    "upside down": (pair(), ["--gravity", "0,0,9.8"], 1),
    "tilted upside down": (pair(), ["--tilt", "180"], 1),
    "tilted back": (pair(), ["--tilt", "-39,30"], 0),
    "tilted back too far": (pair(), ["--tilt=-41,30"], 1),
    "the spaced form": (pair(), ["--gravity", "-1,0,-9"], 0),
    "held from above": (pair(), ["--supports", "ids=b"], 1),
    "all below": (pair(), ["--supports", "below=1"], 0),
    "lowest below": (pair(), ["--supports", "below=0"], 0),
    "held by name": (pair(), ["--supports", "ids=g, b"], 0),
    "slides at mu W": (loaded([0.841 * WEIGHT, 0, 0], [0.5, 0.5, 1]), [], 1),
    "does not slide below": (loaded([0.839 * WEIGHT, 0, 0], [0.5, 0.5, 1]), [], 0),
    "tips: F x 1 m against W x 0.5 m": (loaded([0.501 * WEIGHT, 0, 0], [0.5, 0.5, 2]), ["--mu", "2"], 1),
    "does not tip below": (loaded([0.499 * WEIGHT, 0, 0], [0.5, 0.5, 2]), ["--mu", "2"], 0),
    "lifted by more than it weighs": (loaded([0, 0, 1.001 * WEIGHT], [0.5, 0.5, 2]), [], 1),
    "lifted by less": (loaded([0, 0, 0.999 * WEIGHT], [0.5, 0.5, 2]), [], 0),
    "pressed off its base": (loaded([0, 0, -1e9], [1.001, 0.5, 2]), [], 1),
    "pressed on its base": (loaded([0, 0, -1e9], [0.999, 0.5, 2]), [], 0),
    "a load on what is held": (loaded([1e9, 0, 0], [0.5, 0.5, 1], "g"), [], 0),
    "a load where nothing weighs": (loaded([0, 0, 1], [0.5, 0.5, 2]), ["--gravity", "0,0,0"], 1),
    "millimetres": (
        model(block("g", size=(1e3, 1e3, 1e3)), block("b", (0, 0, 1e3), (1e3, 1e3, 1e3))) | {"units": "mm"},
        [],
        0,
    ),
}


@pytest.mark.parametrize("name", VERDICTS)
def test_a_verdict_by_hand(check, name):
    document, options, status = VERDICTS[name]
    found, _, err = check(document, *options)
    assert found == status, err


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("at", [0.0, 1e4])
@pytest.mark.parametrize(("degrees", "status"), [("39", 0), ("41", 1)])
def test_size_and_place_do_not_matter(check, size, at, degrees, status):
    sides = (size, size, size)
    document = model(block("g", (at, at, at), sides, fixed=True), block("b", (at, at, at + size), sides))
    assert check(document, "--tilt", degrees)[0] == status


WARNED = {
    "wound the wrong way": (joined(TOP[::-1]), 0, "turned: 0 (g-b)"),
    "a little off": (joined(TOP + np.array([0, 0, 1e-3])), 0, "further than the tolerance"),
    "run into each other": (pair(block("b", (0, 0, 0.9))), 1, "run into each other"),
    "twice in one place": (model(*pair()["blocks"], block("c", (0, 0, 1))), 0, "'b' and 'c' stand in the same place"),
    "touches nothing": (pair(block("b", (0, 0, 2))), 1, "block 'b' touches no other block"),
    "unknown key": (pair({"colour": "red"}), 0, "colour"),
    "no units": ({k: v for k, v in pair().items() if k != "units"}, 0, "metres assumed"),
}


@pytest.mark.parametrize("name", WARNED)
def test_what_is_odd_is_warned_of(check, name):
    document, status, said = WARNED[name]
    found, _, err = check(document)
    assert found == status
    assert any(line.startswith("cyclopean: warning: ") and said in line for line in err.splitlines()), err


STATE = {"equilibrium", "cone", "gap", "complementarity", "alignment", "reach", "sliding"}


def test_the_result_holds_what_it_should(check):
    common = {"schema", "model", "method", "verdict", "reason", "blocks", "free", "contacts", "points", "assumed"}
    common |= {"residuals", "certificate", "provenance", "warnings", "seconds"}
    _, result, _ = check(pair(), "--margins")
    assert result.keys() == common | {"forces", "displacement", "margins"}
    assert result["margins"].keys() == {"method", "friction", "joints", "tilt", "within", "seconds"}
    assert result["displacement"]["b"] == pytest.approx(
        [0, 0, -1, 0, 0, 0], abs=1e-9
    )  # it overlaps by eps, and stays upright
    assert result["residuals"].keys() == STATE
    assert result["assumed"].keys() == {"mu", "density", "gravity"}
    assert result["forces"][0].keys() == {"a", "b", "polygon", "force", "frame", "utilisation"}
    assert np.sum(result["forces"][0]["force"], axis=0) == pytest.approx([WEIGHT, 0, 0], abs=1e-6)
    assert result["seconds"].keys() == {"read", "contacts", "solve", "verify", "total"}
    assert result["provenance"].keys() >= {"cyclopean", "solver", "settings", "iterations", "factorisations"}
    _, result, _ = check(pair(), "--tilt", "60")
    assert result.keys() == common | {"mechanism"}
    assert [len(row) for row in result["mechanism"].values()] == [6]
    assert result["mechanism"].keys() == {"b"}


def test_tension_is_written_where_it_is_asked_for(check):
    _, result, _ = check(pair(block("b", (0.6, 0, 1))), "--penalty")
    (row,) = result["forces"]
    assert row["force"] is None  # there is no state
    # moments about the edge x = 1: W 0.1 m to the right of it, held down at x = 0.6
    assert sum(row["tension"]) == pytest.approx(WEIGHT * 0.1 / 0.4, rel=1e-3)
    _, result, _ = check(pair(), "--penalty")
    assert max(result["forces"][0]["tension"]) < 1e-3


STRANGE = [
    "<script>alert(1)</script>",
    "a,b",
    "é ✓",
    "\"'\\",
    "&amp;",
    "../x",
    "x" * 3000,
    "ids=",
    "-",
    "{}",
    "%s",
    "a/b",
]


@pytest.mark.parametrize("name", STRANGE)
def test_strange_names_go_through_everything(run, check, name):
    document = pair({"id": name})
    assert check(document, "--report", "p.html")[0] == 0
    assert "<script>alert" not in Path("p.html").read_text(encoding="utf-8")
    for suffix in ("obj", "stl", "ply", "glb"):
        assert run("convert", "m.json", f"m.{suffix}")[0] == 0
        assert run("convert", f"m.{suffix}", "back.json")[0] == 0
        back = json.loads(Path("back.json").read_text(encoding="utf-8"))
        assert [b["id"] for b in back["blocks"]] == ["g", name]


def test_paths_with_spaces_and_accents(run):
    place = Path("d d", "é ünï ✓")
    place.mkdir(parents=True)
    (place / "m €.json").write_text(json.dumps(pair()), encoding="utf-8")
    files = [place / name for name in ("r €.json", "c €.json", "p €.html")]
    assert run("check", place / "m €.json", "--json", files[0], "--certificate", files[1], "--report", files[2])[0] == 0
    assert sorted(os.listdir(place)) == sorted(["m €.json", *(f.name for f in files)])
    assert run("verify", files[1])[0] == 0


ENCODINGS = [("utf-8", 0), ("utf-8-sig", 0), ("utf-16", 2), ("utf-16-le", 2), ("utf-16-be", 2), ("latin-1", 2)]


@pytest.mark.parametrize(("encoding", "status"), ENCODINGS)
def test_encodings(run, encoding, status):
    text = json.dumps(pair({"id": "ü"}), ensure_ascii=False)
    Path("m.json").write_bytes(text.encode(encoding))
    answer = run("check", "m.json")
    assert answer[0] == status
    if status:
        refused(answer, "m.json", "UTF-8")


def test_mesh_files(run):
    Path("m.json").write_text(json.dumps(pair()), encoding="utf-8")
    for suffix in ("obj", "stl"):
        run("convert", "m.json", f"m.{suffix}")
        Path(f"crlf.{suffix}").write_bytes(Path(f"m.{suffix}").read_bytes().replace(b"\n", b"\r\n"))
        assert run("check", f"crlf.{suffix}")[0] == 0
    Path("binary.stl").write_bytes(binary_stl())
    Path("solid.stl").write_bytes(b"solid" + binary_stl()[5:])
    Path("ascii.ply").write_bytes(ascii_ply())
    Path("compas.json").write_bytes(compas())
    for name in ("binary.stl", "solid.stl", "ascii.ply", "compas.json"):
        status, _, err = run("check", name)
        assert status == 0, err
        assert "metres assumed" in err
    assert run("check", "m.obj", "--units", "mm", "--json", "r.json")[0] == 0
    (row,) = json.loads(Path("r.json").read_text(encoding="utf-8"))["forces"]
    assert np.sum(row["force"], axis=0)[0] == pytest.approx(WEIGHT * 1e-9)
    refused(run("check", "m.json", "--units", "mm"), "m.json", "--units mm")


def commands(path):
    """Every command that reads a file."""
    return ["check", path], ["info", path], ["convert", path, "other.obj"], ["verify", path]


def prepare_paths():
    Path("folder").mkdir()
    Path("folder.json").mkdir()
    Path("zero.json").touch()
    if os.name != "nt":
        os.symlink("loop2", "loop1")
        os.symlink("loop1", "loop2")
        os.mkfifo("pipe")
        os.mkfifo("pipe.json")
    for suffix in ("json", "stl", "obj", "ply", "glb"):
        with open(f"huge.{suffix}", "wb") as file:
            file.truncate((1 << 30) + 1)


PATHS = ["missing.json", "folder", "folder.json", "zero.json", "", "nul\0.json", "x" * 300, "zero.json/", "zero.json/x"]
UNIX_PATHS = [
    "loop1",
    "pipe",
    "pipe.json",
    "/dev/null",
    "/dev/zero",
    *(f"huge.{s}" for s in "json stl obj ply glb".split()),
]


@pytest.mark.parametrize("path", [*PATHS, *(pytest.param(p, marks=unix) for p in UNIX_PATHS)])
def test_what_is_no_file_is_refused_at_once(run, path):
    prepare_paths()
    before = sorted(os.listdir())
    for argv in commands(path):
        refused(run(*argv), path.partition("\0")[0] or "''")
    assert sorted(os.listdir()) == before


@pytest.fixture
def good(run):
    Path("m.json").write_text(json.dumps(pair()), encoding="utf-8")
    return ["check", "m.json"]


@unix
@pytest.mark.parametrize("option", ["--json", "--certificate", "--report"])
@pytest.mark.parametrize("path", ["loop1", "pipe", "no/x", "folder", "zero.json/x", "/proc/x"])
def test_where_nothing_can_be_written(run, good, option, path):
    prepare_paths()
    before = sorted(os.listdir())
    refused(run(*good, option, path), path)
    assert sorted(os.listdir()) == before


@unix
def test_a_pipe_with_a_reader_is_written_to(run, good):
    os.mkfifo("pipe")
    with subprocess.Popen(["cat", "pipe"], stdout=subprocess.PIPE) as reader:
        for _ in range(100):  # until the reader is there
            if run(*good, "--json", "pipe")[0] == 0:
                break
        assert json.loads(reader.communicate(timeout=10)[0])["verdict"] == "stable"
    assert stat.S_ISFIFO(os.stat("pipe").st_mode)


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="permissions do not bind the superuser")
def test_read_only_files_are_left_alone(run, good):
    Path("r.json").write_text("old")
    Path("r.json").chmod(0o400)
    refused(run(*good, "--json", "r.json"), "r.json")
    assert Path("r.json").read_text() == "old"


@pytest.mark.parametrize(
    "options", [("--json", "--report"), ("--certificate", "--report"), ("--json", "--certificate")]
)
def test_two_outputs_never_share_a_file(run, good, options):
    refused(run(*good, options[0], "x", options[1], "./x"), options[1], options[0])
    assert os.listdir() == ["m.json"]


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["make", "wall", "1000000000", "3"], "wall"),
        (["make", "wall", "9" * 400, "3"], "wall"),
        (["make", "arch", "5", "--facets", "99999999"], "facets"),
        (["make", "stack", "3", "--size", "1e300,1,1"], "--size"),
        (["make", "stack", "3", "--size", "nan,1,1"], "--size"),
        (["make", "dome", "3", "5", "--radius", "-1"], "radius"),
        (["make", "vault", "3", "5", "--thickness", "0"], "thickness"),
    ],
)
def test_absurd_templates(run, argv, said):
    refused(run(*argv, "--out", "w.json"), said)
    assert os.listdir() == []


CERTIFICATES = {
    "a model": (lambda c: json.dumps(pair()), 2),
    "no JSON": (lambda c: "o b0", 2),
    "cut off": (lambda c: json.dumps(c)[:-9], 2),
    "other schema": (lambda c: json.dumps(c | {"schema": "cyclopean.certificate/9"}), 1),
    "other kind": (lambda c: json.dumps(c | {"kind": "rbe-mechanism"}), 1),
    "a force less": (lambda c: json.dumps(c | {"forces": c["forces"][1:]}), 1),
    "pulls": (lambda c: json.dumps(c | {"forces": [[-x for x in f] for f in c["forces"]]}), 1),
    "NaN": (lambda c: json.dumps(c | {"gravity": [0, 0, float("nan")]}), 1),
    "infinite": (lambda c: json.dumps(c | {"gravity": [0, 0, -1e999]}), 1),
    "deep": (lambda c: '{"schema": "cyclopean.certificate/1", "blocks": ' + "[" * 100000, 2),
    "a list": (lambda c: "[]", 2),
}


@pytest.mark.parametrize("name", CERTIFICATES)
def test_bad_certificates(run, good, name):
    run(*good, "--certificate", "c.json")
    change, status = CERTIFICATES[name]
    content = change(json.loads(Path("c.json").read_text(encoding="utf-8")))
    Path("c.json").write_text(content, encoding="utf-8")
    answer = run("verify", "c.json")
    assert answer[0] == status
    if status == 2:
        refused(answer, "c.json")
    else:
        assert answer[1].startswith("NOT proved: ")


def test_a_resealed_lie_is_a_lie(run, good):
    run(*good, "--certificate", "c.json")
    proof = json.loads(Path("c.json").read_text(encoding="utf-8"))
    proof["blocks"][1]["density"] *= 2
    proof["seal"] = seal(proof)
    Path("c.json").write_text(json.dumps(proof), encoding="utf-8")
    assert run("verify", "c.json")[0] == 1


@unix
def test_a_model_may_come_through_a_pipe_of_the_shell(tmp_path):
    (tmp_path / "m.json").write_text(json.dumps(pair()), encoding="utf-8")
    command = f"cat m.json | {sys.executable} -m cyclopean check /dev/stdin"
    answer = subprocess.run(["sh", "-c", command], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert answer.returncode == 0, answer.stderr
