"""`match` from the outside: words, files, statuses, workers, a cluster, and going on after a stop."""

import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from cyclopean.io.checkpoints import Checkpoints
from processes import cluster

INTERRUPTED = "cyclopean: error: interrupted; no result was written\n"


@pytest.fixture
def yard(run):
    """Seven stones and a wall of about six cells."""
    Path("stones").mkdir()
    Path("out").mkdir()
    assert run("make", "stones", "--count", 7, "--seed", 2, "--detail", 1, "--out", "stones")[0] == 0
    made = run("make", "polygonal", "--columns", 3, "--rows", 2, "--width", 1.4, "--height", 0.9, "--depth", 0.3,
               "--out", "wall.json")  # fmt: skip
    assert made[0] == 0
    return "stones", "wall.json", "--out", "out"


def match_of(path="out/match.json"):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def test_the_file_and_the_words(run, yard):
    status, out, err = run("match", *yard)
    assert status == 0
    data = match_of()
    rows = data["placements"]
    assert data["schema"] == "cyclopean.match/1"
    assert (data["stones"], data["wall"]) == ("../stones", "../wall.json")
    assert len(rows) == len({row["stone"] for row in rows}) == len({row["cell"] for row in rows})
    assert len(rows) + len(data["unused"]) == 7
    carved = sum(row["lambda"] * row["stone_volume"] for row in rows)
    assert data["Lambda"] == pytest.approx(carved / sum(row["stone_volume"] for row in rows), abs=1e-12)
    void = sum(row["gap"] * row["cell_volume"] for row in rows)
    assert data["gap"] == pytest.approx(void / sum(row["cell_volume"] for row in rows), abs=1e-12)
    for row in rows:
        shared = row["stone_volume"] * (1 - row["lambda"])
        assert shared == pytest.approx(row["cell_volume"] * (1 - row["gap"]), rel=1e-12)
    assert out.splitlines()[1].startswith(f"  matched  {len(rows)} of 7 stones to {len(rows)} of {len(rows)} cells")
    assert out.splitlines()[-1] == "  written  out/match.json"
    assert "no file says its units; metres assumed" in err
    assert sorted(p.name for p in Path("out").iterdir()) == ["match.json"]


def test_dash_prints_the_file_and_nothing_else(run, yard):
    _, out, _ = run("match", *yard, "--json", "-")
    assert json.loads(out) == match_of()


def test_fewer_stones_than_cells_names_the_empty_ones(run, yard):
    for name in ("stone-0001", "stone-0002", "stone-0003", "stone-0004"):
        Path("stones", f"{name}.obj").unlink()
    status, _, err = run("match", *yard)
    data = match_of()
    assert status == 0
    assert len(data["placements"]) == 3
    assert data["empty"]
    assert f"no stone is left for {data['empty'][0]}" in err
    assert data["gap"] < data["gap_of_wall"]


def test_one_corrupt_file_among_many(run, yard):
    Path("stones/broken.obj").write_text("v 0 0 zero\n", encoding="utf-8")
    status, _, err = run("match", *yard)
    assert status == 0
    assert "broken.obj" in err
    status, _, err = run("match", *yard, "--strict")
    assert (status, err.count("\n")) == (2, 1)
    assert "broken.obj" in err


def test_two_workers_answer_as_one(run, yard):
    run("match", *yard)
    alone = match_of()["placements"]
    assert run("match", *yard, "--workers", 2)[0] == 0
    assert match_of()["placements"] == alone


def test_a_cluster_of_two_answers_as_one_process(run, yard, tmp_path_factory):
    run("match", *yard)
    alone = match_of()["placements"]
    with cluster(tmp_path_factory.mktemp("cluster"), 2) as (address, _):
        assert run("match", *yard, "--cluster", address)[0] == 0
    assert match_of()["placements"] == alone


def test_a_run_that_was_stopped_goes_on(run, yard, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("cyclopean.design.matching.match._answer", stop)
        assert run("match", *yard)[0] == 130
    assert list(Path("out/match.parts").iterdir())
    assert not Path("out/match.json").exists()
    assert run("match", "stones", "gone.json", "--out", "out")[0] == 2  # a slip, which costs nothing of what was done
    done = []
    with monkeypatch.context() as patch:
        patch.setattr(Checkpoints, "_keep", lambda *_: done.append(1))
        assert run("match", *yard)[0] == 0
    assert done == []  # nothing had to be done again
    assert [p.name for p in Path("out").iterdir()] == ["match.json"]
    resumed = match_of()["placements"]
    assert run("match", *yard, "--fresh")[0] == 0
    assert match_of()["placements"] == resumed


def stopped(run, yard, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("cyclopean.design.matching.match._answer", stop)
        assert run("match", *yard)[0] == 130
    return sorted(Path("out/match.parts").iterdir())


def test_parts_that_were_changed_are_done_again_and_told_of(run, yard, monkeypatch):
    """Poses shifted by a millimetre in a file that is sound otherwise."""
    assert run("match", *yard)[0] == 0
    alone = match_of()["placements"]
    for part in stopped(run, yard, monkeypatch):
        data = part.read_bytes()
        with np.load(io.BytesIO(data[32:])) as file:
            arrays = [file[f"arr_{k}"] for k in range(len(file.files))]
        shifted = [a + 1e-3 if a.dtype.kind == "f" else a for a in arrays]
        stream = io.BytesIO()
        np.savez(stream, *shifted)
        part.write_bytes(data[:32] + stream.getvalue())
    status, _, err = run("match", *yard)
    assert status == 0
    (line,) = [line for line in err.splitlines() if "match.parts" in line]
    assert line.endswith("of an interrupted run did not fit (damaged, changed or of other input): done anew")
    assert match_of()["placements"] == alone


def test_parts_of_other_input_are_told_of(run, yard, monkeypatch):
    assert run("match", *yard, "--points", 600)[0] == 0
    alone = match_of()["placements"]
    stopped(run, yard, monkeypatch)
    status, _, err = run("match", *yard, "--points", 600)
    assert status == 0
    (line,) = [line for line in err.splitlines() if "match.parts" in line]
    assert line.endswith("of an interrupted run did not fit (damaged, changed or of other input): done anew")
    assert match_of()["placements"] == alone
    assert [p.name for p in Path("out").iterdir()] == ["match.json"]


@pytest.mark.parametrize(
    ("extra", "said"),
    [
        (("--negotiate", "2"), "--negotiate 2: expected a number from 0 to 1"),
        (("--negotiate", "x"), "--negotiate: 'x' is not a number"),
        (("--rounds", "0"), "--rounds 0: expected a whole number from 1 to 100"),
        (("--rounds", "5"), "--rounds: has no say where cells stay as drawn"),
        (("--weight", "2", "--gap", "0.1"), "--weight: --gap finds it; leave out one of the two"),
        (("--bond", "free:20"), "--bond: 'free:20' should be free, into[:DEG] or along[:DEG]"),
        (("--bond", "along:"), "--bond: '' is not a number"),
        (("--report", "stones/stone-0001.obj"), "--report stones/stone-0001.obj: lies among the stones"),
        (("--workers", "0"), "--workers: 0 is not between 1 and 256"),
        (("--workers", "2", "--cluster", "tcp://127.0.0.1:1"), "--workers: has no say over a cluster"),
        (("--bond", "up"), "--bond: 'up' is not one of free, into, along"),
        (("--bond", "into:120"), "--bond: angle must be between 0 and 90, got 120"),
        (("--gap", "1.5"), "--gap: must be between 0 and 1, got 1.5"),
        (("--weight", "0"), "--weight: must be more than 0, got 0"),
        (("--points", "3"), "--points: expected a whole number of at least 64, got 3"),
        (("--json", "out/match.json"), "--json out/match.json: --out match.json writes to the same file"),
    ],
)
def test_bad_options(run, yard, extra, said):
    status, out, err = run("match", *yard, *extra)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert said in err
    assert list(Path("out").iterdir()) == []


def test_a_wall_that_is_all_support_and_one_without_a_drawing(run, yard):
    assert run("match", *yard, "--supports", "below=0.2")[0] == 0
    assert match_of()["settings"]["supports"] == "below=0.2"  # for `carve`
    Path("out/match.json").unlink()
    status, _, err = run("match", *yard, "--supports", "below=99")
    assert status == 2
    assert "every block of the model is a support" in err
    run("make", "wall", 3, 2, "--out", "bricks.json")
    status, _, err = run("match", "stones", "bricks.json", "--out", "out", "--negotiate", 1)
    assert (status, err.count("\n")) == (2, 1)
    assert "does not say how it was drawn" in err
    run("make", "polygonal", "--columns", 3, "--rows", 2, "--corner", 1.5, "--out", "corner.json")
    status, _, err = run("match", "stones", "corner.json", "--out", "out", "--negotiate", 1)
    assert (status, err.count("\n")) == (2, 1)
    assert "cells can move only in a wall from 'make polygonal' or polygonal_wall, and not round a corner" in err
    assert list(Path("out").iterdir()) == []


def test_bonds_turn_the_longest_axis(run, yard):
    run("match", *yard, "--bond", "into:20")
    run("match", *yard, "--bond", "into:20", "--json", "into.json")
    from cyclopean.io import read_stones

    stones = {s.id: s for s in read_stones("stones", cache=False)[0].stones}
    for row in match_of("into.json")["placements"]:
        longest = np.array(row["transform"])[:3, :3] @ stones[row["stone"]].axes[0]
        assert abs(longest[1]) >= np.cos(np.radians(20.0)) - 1e-4  # y runs through a flat wall


def test_a_wall_in_other_units_than_the_stones_is_suspected(run, yard):
    data = json.loads(Path("wall.json").read_text(encoding="utf-8")) | {"units": "mm", "contacts": None}
    data = {key: value for key, value in data.items() if key not in ("contacts", "drawing")}
    for times in (1.0, 1000.0):  # a wall of millimetres that says so, and one that says it wrongly
        for block in data["blocks"]:
            block["vertices"] = [[times * x for x in point] for point in block["vertices"]]
        Path("mm.json").write_text(json.dumps(data), encoding="utf-8")
        status, _, err = run("match", "stones", "mm.json", "--out", "out")
        assert status == 0
        assert ("check the units of the wall and of the stones" in err) == (times == 1.0)


def test_an_interrupt_that_a_library_took_for_its_own_fault_tells_what_is_kept(run, yard, monkeypatch):
    """As some do that are written in C, where Ctrl-C comes while they are loaded."""

    def given_up(cells, settings, options, parts, stage):
        for size in (1, 2):
            parts.submit(np.zeros, size).result()
        raise ImportError("initialization failed") from KeyboardInterrupt()

    monkeypatch.setattr("cyclopean.cli.match.matched", given_up)
    status, out, err = run("match", *yard)
    assert (status, out) == (130, "")
    kept, told = err.splitlines(keepends=True)
    assert "2 parts of the work are kept in out/match.parts" in kept
    assert told == INTERRUPTED


@pytest.mark.skipif(os.name == "nt", reason="needs what Unix has")
def test_an_interrupt_ends_workers_without_a_word(run):
    """A terminal sends Ctrl-C to every process there is; one line answers it."""
    run("make", "stones", "--count", 60, "--detail", 3, "--out", "stones.glb")
    run("make", "polygonal", "--columns", 9, "--rows", 6, "--out", "wall.json")
    Path("out").mkdir()
    argv = ["match", "stones.glb", "wall.json", "--out", "out", "--workers", "2", "--negotiate", "1", "--rounds", "100"]
    work = subprocess.Popen(
        [sys.executable, "-m", "cyclopean", *argv], stderr=subprocess.PIPE, start_new_session=True, text=True
    )
    try:
        for _ in range(600):
            if list(Path("out").glob("match.parts/*.npz")):
                break
            time.sleep(0.05)
        os.killpg(work.pid, signal.SIGINT)
        _, err = work.communicate(timeout=20)
    finally:
        if work.poll() is None:
            os.killpg(work.pid, signal.SIGKILL)
    told = err.splitlines(keepends=True)
    assert (work.returncode, told[-1], len(told)) == (130, INTERRUPTED, 2)
    assert "are kept in out/match.parts; the same command goes on from there" in told[0]
    assert {path.suffix for path in Path("out/match.parts").iterdir()} == {".npz"}  # nothing half written
    assert not Path("out/match.json").exists()
