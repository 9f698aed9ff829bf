"""Files are written whole or not at all; a result is plain JSON."""

import json
import os
import shutil
import stat
import threading

import numpy as np
import pytest

import cyclopean
from cyclopean.analysis import Result
from cyclopean.assembly import Assembly, Block, Contacts
from cyclopean.errors import InputError
from cyclopean.io import json_text, result_dict, together, write_json, write_text

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def test_json_keeps_every_digit_and_takes_numpy():
    data = {"a": [np.float64(0.1), np.int64(3), np.bool_(True)], "b": np.eye(2), "rows": [{"x": 1}, {"x": 2}], "é": "ü"}
    text = json_text(data)
    assert json.loads(text) == {"a": [0.1, 3, True], "b": [[1, 0], [0, 1]], "rows": [{"x": 1}, {"x": 2}], "é": "ü"}
    assert text.count("\n") == 9  # a line for each key, and for each row
    assert json_text([1e-300, -0.0]) == "[1e-300, -0.0]\n"


@pytest.mark.parametrize("bad", [float("nan"), np.inf, np.array([np.nan]), {"deep": [np.float64("nan")]}])
def test_json_never_holds_what_is_not_finite(tmp_path, bad):
    with pytest.raises(InputError, match="NaN or infinite, which JSON cannot hold"):
        write_json(tmp_path / "a.json", {"x": bad})
    assert list(tmp_path.iterdir()) == []


def test_what_is_not_json_is_a_fault_of_the_program(tmp_path):
    with pytest.raises(TypeError, match="object is not JSON"):
        write_json(tmp_path / "a.json", {"x": object()})


def test_writing_replaces_whole_files(tmp_path):
    file = tmp_path / "a.txt"
    write_text(file, "first, and long")
    write_text(file, "é")
    assert file.read_bytes() == "é".encode()
    assert [f.name for f in tmp_path.iterdir()] == ["a.txt"]
    assert stat.S_IMODE(file.stat().st_mode) & 0o600 == 0o600


@pytest.mark.skipif(os.name == "nt", reason="symbolic links need a privilege there")
def test_a_link_stays_a_link_and_a_device_a_device(tmp_path):
    (tmp_path / "link").symlink_to("file")
    write_text(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "file").read_text() == "text"
    write_text(os.devnull, "text")
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)


def test_refused_places(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("x")
    cases = {
        "nowhere/a.json": "nowhere/a.json: the folder 'nowhere' does not exist; make it first",
        "file/a.json": "file/a.json: the folder 'file' does not exist; make it first",
        "folder": "folder: is a folder; name a file in it",
        "nul\0": "nul\\x00: is not a path",
        "x" * 300: f"{'x' * 300}: cannot be written (File name too long)",
    }
    for path, line in cases.items():
        with pytest.raises(InputError) as caught:
            write_text(path, "text")
        assert str(caught.value) == line
    with pytest.raises(InputError, match=r"^a\.txt: a name in it is not valid text"):
        write_text("a.txt", "\ud800")
    assert sorted(f.name for f in tmp_path.rglob("*")) == ["file", "folder"]


@pytest.mark.parametrize("step", ["open", "fsync", "replace"])
def test_nothing_is_left_of_a_write_that_fails(tmp_path, monkeypatch, step):
    """A read-only folder, a full disk, a target that cannot be replaced: the old file stays, and nothing beside it."""
    file = tmp_path / "a.txt"
    file.write_text("old")

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, step, fail)
    with pytest.raises(InputError) as caught:
        write_text(file, "new")
    monkeypatch.undo()
    assert str(caught.value) == f"{file}: cannot be written (No space left on device)"
    assert file.read_text() == "old"
    assert [f.name for f in tmp_path.iterdir()] == ["a.txt"]


def test_nothing_is_left_of_a_write_that_is_interrupted(tmp_path, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_text(tmp_path / "a.txt", "new")
    assert list(tmp_path.iterdir()) == []


def test_of_runs_in_one_folder_the_last_one_leaves_all_of_its_files(tmp_path):
    """Whoever waits meanwhile: no file is of another run than its neighbour."""
    pytest.importorskip("fcntl", reason="this system has no such locks")
    go = threading.Barrier(4)

    def run(name):
        for k in range(20):
            with together():
                for number in range(12):
                    write_text(tmp_path / f"{number}.txt", f"{name} {k}")
                go.wait(timeout=60.0)
            go.wait(timeout=60.0)

    runs = [threading.Thread(target=run, args=(name,), daemon=True) for name in ("a", "b", "c")]
    for one in runs:
        one.start()
    for _ in range(20):
        go.wait(timeout=60.0)  # all are about to write
        go.wait(timeout=60.0)  # and have written
        assert len({(tmp_path / f"{number}.txt").read_text() for number in range(12)}) == 1
    for one in runs:
        one.join()


@pytest.fixture
def two_folders(tmp_path):
    """Each with an old file, and one of somebody else."""
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "old").write_text("old")
        (tmp_path / name / "theirs").write_text("theirs")
    return tmp_path


def tree(place):
    return {str(f.relative_to(place)): f.read_text() if f.is_file() else None for f in place.rglob("*")}


def write_four(place):
    with together():
        for name in ("a/old", "a/new", "b/new", "b/old"):
            write_text(place / name, "written")
            assert (place / "a/old").read_text() == "old", "nothing takes its place before all are there"


def test_files_that_are_written_together_are_all_there(two_folders):
    before = tree(two_folders)
    write_four(two_folders)
    assert tree(two_folders) == before | dict.fromkeys(("a/old", "a/new", "b/new", "b/old"), "written")


@pytest.mark.parametrize("links", [True, False])
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize("moment", range(4))
def test_of_files_that_are_written_together_none_stays_without_the_others(
    two_folders, monkeypatch, moment, error, links
):
    """The last of their places cannot be taken, or an interrupt comes between two."""
    before, replace, calls = tree(two_folders), os.replace, []

    def failing(source, target):
        if not source.endswith(".old") and not target.endswith(".old"):
            calls.append(target)
            if len(calls) == moment + 1:
                raise error
        replace(source, target)

    def refuse(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(os, "replace", failing)
    if not links:
        monkeypatch.setattr(os, "link", refuse)
    with pytest.raises(InputError if isinstance(error, OSError) else KeyboardInterrupt):
        write_four(two_folders)
    assert tree(two_folders) == before


def write_and_remove(place):
    with together():
        for name in ("a/old", "b/old"):
            write_text(place / name, "written")
        shutil.rmtree(place / "b")


def test_a_folder_that_is_removed_meanwhile_leaves_the_other_as_it_was(two_folders):
    before = {name: text for name, text in tree(two_folders).items() if name.startswith("a")}
    with pytest.raises(InputError, match=r"b/old: cannot be written \(No such file or directory\)"):
        write_and_remove(two_folders)
    assert tree(two_folders) == before


def write_and_fail(place):
    with together():
        with together():
            write_text(place / "a/old", "once")
        raise ZeroDivisionError


def test_a_file_twice_and_a_set_within_a_set(two_folders):
    with pytest.raises(ZeroDivisionError):
        write_and_fail(two_folders)
    assert (two_folders / "a/old").read_text() == "old"
    with together():
        write_text(two_folders / "a/old", "once")
        write_text(two_folders / "a/old", "twice")
    assert (two_folders / "a/old").read_text() == "twice"


def result(**changes):
    assembly = Assembly((Block("b0", CUBE, FACES), Block("b1", CUBE + np.array([0, 0, 1]), FACES)), name="pair")
    fields = {
        "assembly": assembly,
        "contacts": Contacts.of([(0, 1)], [CUBE[4:8]], [0.84]),
        "fixed": np.array([True, False]),
        "method": "rbe",
        "verdict": "stable",
        "reason": "It stands.",
        "assumed": {"mu": 0.84, "gravity": np.array([0, 0, -9.80665])},
        "gravity": np.array([0, 0, -9.80665]),
        "residuals": {"equilibrium": np.float64(1e-15), "gap": float("nan")},
        "force": np.arange(12.0).reshape(4, 3),
        "utilisation": np.array([0.25]),
        "certificate": {"kind": "rbe-state", "seal": "x"},
        "provenance": {"solver": "newton", "iterations": np.int64(3)},
        "seconds": {"total": 0.5},
    }
    return Result(**(fields | changes))


def test_result_by_hand():
    found = result_dict(result(), "pair.cert.json")
    assert list(found) == [
        "schema", "model", "method", "verdict", "reason", "blocks", "free", "contacts", "points", "assumed",
        "residuals", "forces", "objective", "certificate", "provenance", "warnings", "seconds",
    ]  # fmt: skip
    assert found["objective"] == 0.5 * sum(k * k for k in range(12))
    assert (found["schema"], found["model"], found["method"]) == ("cyclopean.result/1", "pair", "rbe")
    assert (found["blocks"], found["free"], found["contacts"], found["points"]) == (2, 1, 1, 4)
    assert found["assumed"] == {"mu": 0.84, "gravity": [0, 0, -9.80665]}
    assert found["residuals"] == {"equilibrium": 1e-15, "gap": None}
    assert found["certificate"] == {"kind": "rbe-state", "file": "pair.cert.json"}
    assert found["provenance"] == {"cyclopean": cyclopean.__version__, "solver": "newton", "iterations": 3}
    assert found["forces"] == [
        {
            "a": "b0",
            "b": "b1",
            "polygon": CUBE[4:8].tolist(),
            "force": [[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]],
            "frame": [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
            "utilisation": 0.25,
        }
    ]
    assert json.loads(json_text(found)) == found


def test_a_mechanism_only_when_unstable_and_only_of_free_blocks():
    moves = np.arange(12.0).reshape(2, 6)
    assert "mechanism" not in result_dict(result(mechanism=moves))
    found = result_dict(result(verdict="unstable", force=None, mechanism=moves, certificate=None))
    assert found["mechanism"] == {"b1": [6, 7, 8, 9, 10, 11]}
    assert "forces" not in found
    assert found["certificate"] is None
