"""`info` of stones."""

import json

import pytest

from fixtures_stones import SCANS, boulder, box, needs_scans, obj


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    """No test reads or writes the user's cache."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def yard(tmp_path):
    """A folder `yard` of four stones, in the folder where commands run."""
    (tmp_path / "yard").mkdir()
    for k in range(4):
        (tmp_path / "yard" / f"s{k}.obj").write_text(obj(*boulder(k)))
    return tmp_path / "yard"


def test_a_folder_for_a_person_and_for_a_program(run, yard):
    status, out, err = run("info", "yard", "--units", "m")
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "yard"
    assert lines[1].split() == ["stones", "4"]
    told = [line for line in lines[2:] if not line.startswith("   ")]  # without all but the first of the sizes
    assert [line.split()[0] for line in told] == ["volume", "sizes", "b/a", "c/a", "V/hull", "sphericity", "classes"]
    status, out, err = run("info", "yard", "--json", "-")
    assert (status, err) == (0, "cyclopean: warning: yard: no file says its units; metres assumed (--units)\n")
    data = json.loads(out)
    assert data["schema"] == "cyclopean.inventory/1"
    assert [stone["id"] for stone in data["stones"]] == ["s0", "s1", "s2", "s3"]
    wanted = {"id", "volume", "centroid", "axes", "half", "hull_volume", "area", "class", "flat_faces"}
    assert wanted <= data["stones"][0].keys()
    assert f"{data['volume']['total']:.4g} m3" in lines[2]
    assert run("info", "yard", "--json", "yard.json")[0] == 0
    with open("yard.json") as file:
        assert json.load(file) == data


def test_a_corrupt_file_is_a_warning_and_with_strict_an_error(run, yard):
    (yard / "s1.obj").write_text("v 0 0 zero\n")
    status, out, err = run("info", "yard", "--units", "m")
    assert status == 0
    assert "  stones      3\n" in out
    assert "  REFUSED     yard/s1.obj: line 1: a vertex needs three numbers" in out
    assert err.count("\n") == 1
    assert "warning: yard/s1.obj: line 1" in err
    status, out, err = run("info", "yard", "--units", "m", "--strict")
    assert (status, out) == (2, "")
    assert err.startswith("cyclopean: error: yard/s1.obj: line 1: ")
    assert err.count("\n") == 1


def test_repairs_and_refusals_are_named(run, yard):
    vertices, triangles = boulder()
    (yard / "s1.obj").write_text(obj(vertices, triangles[:, ::-1]))
    (yard / "s2.obj").write_text(obj(vertices, triangles[9:]))
    _, out, err = run("info", "yard", "--units", "m")
    assert "  note        yard/s1.obj: was inside out and was turned\n" in out
    assert "  REFUSED     yard/s2.obj: is open: a hole " in out
    assert "yard/s2.obj: is open: a hole " in err


def test_a_slip_of_units(run, tmp_path):
    (tmp_path / "mill").mkdir()
    (tmp_path / "mill" / "s.obj").write_text(obj(1000.0 * boulder()[0], boulder()[1]))
    status, _, err = run("info", "mill", "--units", "m")
    assert status == 0
    assert err.endswith("the lengths look as if in millimetres: --units mm\n")
    assert run("info", "mill", "--units", "mm")[2] == ""


@pytest.mark.parametrize(
    ("argv", "named"),
    [
        (["info", "."], "no stones in this folder"),
        (["info", "gone", "--stones"], "gone: no such file"),
        (
            ["info", "open.obj", "--stones"],
            "open.obj: is open: a hole 3.41 m round near (0, 0.3333, 0.6667); no stone is left",
        ),
        (["info", "yard", "--json", "yard"], "is a folder"),
    ],
)
def test_bad_input(run, yard, argv, named):
    vertices, triangles = box()
    (yard.parent / "sub").mkdir()
    (yard.parent / "open.obj").write_text(obj(vertices, triangles[1:]))
    if argv[1] == ".":
        argv = ["info", "sub"]
    status, out, err = run(*argv)
    assert (status, out) == (2, "")
    assert named in err
    assert err.count("\n") == 1


def test_a_file_of_stones(run, tmp_path):
    (tmp_path / "cube.obj").write_text(obj(*box()))
    status, out, _ = run("info", "cube.obj", "--stones", "--units", "m")
    assert status == 0
    assert "  volume      1 m3, stones 1 to 1 m3" in out
    assert "  classes     1 block" in out
    assert "blocks    1 (" in run("info", "cube.obj", "--units", "m")[1]  # without the option it is a structure


@needs_scans
def test_the_scans(run):
    status, out, err = run("info", SCANS, "--units", "m")
    assert (status, err) == (0, "")
    assert "  stones      16\n" in out
    assert "  volume      5.275 m3, stones 0.1566 to 0.5238 m3" in out
    assert "  b/a         0.763 +- 0.117\n" in out
    assert "  c/a         0.524 +- 0.125\n" in out


def test_a_stone_is_never_overwritten_nor_is_one_added(run, yard):
    before = {path.name: path.read_bytes() for path in yard.iterdir()}
    for name in ("yard/s1.obj", "yard/new.GLB"):
        status, out, err = run("info", "yard", "--units", "m", "--json", name)
        assert (status, out) == (2, "")
        assert err == (
            f"cyclopean: error: --json {name}: lies among the stones and would be read as one; choose another folder\n"
        )
    assert {path.name: path.read_bytes() for path in yard.iterdir()} == before
    assert run("info", "yard", "--units", "m", "--json", "yard/inventory.json")[0] == 0  # no mesh: passed over


def test_a_stone_of_next_to_no_size_is_refused(run, tmp_path):
    (tmp_path / "dust").mkdir()
    for size in (1e-30, 1e-100):
        (tmp_path / "dust" / "s.obj").write_text(obj(size * boulder()[0], boulder()[1]))
        status, out, err = run("info", "dust", "--units", "m")
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert "dust/s.obj: is thinner than 1e-09 m; check the units; no stone is left" in err
