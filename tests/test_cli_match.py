"""`match` from the outside: words, files, statuses, workers, a cluster, and going on after a stop."""

import json
from pathlib import Path

import numpy as np
import pytest

from cyclopean.io.checkpoints import Checkpoints


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
    assert out.splitlines()[0].startswith(f"matched: {len(rows)} of 7 stones to {len(rows)} of {len(rows)} cells")
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


def test_a_cluster_of_two_answers_as_one_process(run, yard):
    distributed = pytest.importorskip("distributed")
    run("match", *yard)
    alone = match_of()["placements"]
    with distributed.LocalCluster(
        n_workers=2, processes=True, threads_per_worker=1, dashboard_address=None, silence_logs=50
    ) as cluster:
        assert run("match", *yard, "--cluster", cluster.scheduler_address)[0] == 0
    assert match_of()["placements"] == alone


def test_a_run_that_was_stopped_goes_on(run, yard, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("cyclopean.design.matching.match._answer", stop)
        assert run("match", *yard)[0] == 130
    assert list(Path("out/match.parts").iterdir())
    assert not Path("out/match.json").exists()
    done = []
    with monkeypatch.context() as patch:
        patch.setattr(Checkpoints, "_keep", lambda *_: done.append(1))
        assert run("match", *yard)[0] == 0
    assert done == []  # nothing had to be done again
    assert [p.name for p in Path("out").iterdir()] == ["match.json"]
    resumed = match_of()["placements"]
    assert run("match", *yard, "--fresh")[0] == 0
    assert match_of()["placements"] == resumed


@pytest.mark.parametrize(
    ("extra", "said"),
    [
        (("--negotiate", "2"), "--negotiate: 2 is not between 0 and 1"),
        (("--negotiate", "x"), "--negotiate: 'x' is not a number"),
        (("--rounds", "0"), "--rounds: 0 is not between 1 and 100"),
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
    status, _, err = run("match", *yard, "--supports", "below=99")
    assert status == 2
    assert "every block of the model is a support" in err
    run("make", "wall", 3, 2, "--out", "bricks.json")
    status, _, err = run("match", "stones", "bricks.json", "--out", "out", "--negotiate", 1)
    assert (status, err.count("\n")) == (2, 1)
    assert "does not say how it was drawn" in err
    assert list(Path("out").iterdir()) == []


def test_bonds_turn_the_longest_axis(run, yard):
    run("match", *yard, "--bond", "into:20")
    run("match", *yard, "--bond", "into:20", "--json", "into.json")
    from cyclopean.io import read_stones

    stones = {s.id: s for s in read_stones("stones", cache=False)[0].stones}
    for row in match_of("into.json")["placements"]:
        longest = np.array(row["transform"])[:3, :3] @ stones[row["stone"]].axes[0]
        assert abs(longest[1]) >= np.cos(np.radians(20.0)) - 1e-4  # y runs through a flat wall
