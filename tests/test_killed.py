"""Work that is killed at any moment comes to the same end when it is started again, to the last digit.

CYCLOPEAN_KILLS=20 kills each command at twenty moments, drawn evenly from the time that it takes.
"""

import json
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from cyclopean.io.checkpoints import Checkpoints
from laws import nightly, some
from processes import SMALL, called, cluster, drawn

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs what Unix has")

KILLS = int(os.environ.get("CYCLOPEAN_KILLS", "1"))
COMMANDS = {
    "match": "match stones.glb wall.json --out {0} --workers 2 --negotiate 1 --rounds 1",
    "settle": "settle stones.glb --out {0}/a.json --json {0}/b.json --workers 2 --ways 2 --yaws 1 --look-ahead 1",
    "sequence": "sequence wall.json --out {0}/a.json --dot {0}/b.dot --workers 2 --method rbe",
}


@pytest.fixture(scope="module")
def yard(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        return drawn(tmp_path_factory.mktemp("yard"), SMALL, patch)


def held(folder):
    """What a folder holds, without the time that it took."""
    return {path.name: _timeless(path) for path in folder.iterdir() if path.suffix != ".tmp"}  # of a killed run


def _timeless(path):
    def plain(value):
        if isinstance(value, dict):
            return {key: plain(item) for key, item in value.items() if key != "seconds"}
        return [plain(item) for item in value] if isinstance(value, list) else value

    return plain(json.loads(path.read_text())) if path.suffix == ".json" else path.read_text()


@pytest.mark.parametrize("command", some(list(COMMANDS)))
def test_a_run_that_was_killed_comes_to_the_same_end(yard, command):
    line, whole = COMMANDS[command], yard / f"whole-{command}"
    whole.mkdir()
    began = time.monotonic()
    assert called(line.format(whole), yard)[0] == 0
    took = time.monotonic() - began
    for k, moment in enumerate(np.random.default_rng(1).uniform(0.0, took, KILLS)):
        place = yard / f"killed-{command}-{k}"
        place.mkdir()
        assert called(line.format(place), yard, moment)[0] in (0, -signal.SIGKILL)
        assert called(line.format(place), yard)[0] == 0
        assert held(place) == held(whole)


@nightly
def test_a_cluster_that_loses_a_worker_answers_the_same(run, tmp_path_factory, monkeypatch):
    """One of its two processes is killed as soon as the first part of the work is done."""
    for line in SMALL:
        assert run(*line.split())[0] == 0
    for name in ("alone", "together"):
        Path(name).mkdir()
    assert run("match", "stones.glb", "wall.json", "--out", "alone")[0] == 0
    killed, keep = [], Checkpoints._keep

    with cluster(tmp_path_factory.mktemp("cluster"), 2) as (address, workers):

        def kill_one(self, path, answer):
            if not killed:
                killed.append(workers[0])
                workers[0].kill()
            keep(self, path, answer)

        monkeypatch.setattr(Checkpoints, "_keep", kill_one)
        assert run("match", "stones.glb", "wall.json", "--out", "together", "--cluster", address)[0] == 0
    assert killed == workers[:1]
    assert held(Path("together")) == held(Path("alone"))
