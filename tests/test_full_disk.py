"""Commands that write several files leave a folder as it was when the disk is full, and never touch what is not theirs.

A limit on the size of files stands for the full disk: the first files fit, a later one does not.
"""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs limits as Unix has them")

COMMANDS = {
    "stones": "make stones --count 5 --detail 2 --seed 9 --volume 1..200L --out out",
    "match": "match stones wall.json --out out --negotiate 1 --rounds 1 --report out/match.html",
    "carve": "carve match --out out --method rbe --least-cut 0.03",
    "settle": "settle stones --out out/a.json --json out/b.json --svg out/c.svg --yaws 2 --ways 1 --look-ahead 2",
    "sequence": "sequence wall.json --out out/order.json --dot out/order.dot --report out/order.html --method rbe",
}


@pytest.fixture(scope="module")
def yard(tmp_path_factory):
    place = tmp_path_factory.mktemp("yard")
    for name in ("stones", "match"):
        (place / name).mkdir()
    for line in (
        "make stones --count 7 --seed 2 --detail 1 --out stones",
        "make polygonal --columns 3 --rows 2 --width 1.4 --height 0.9 --depth 0.3 --out wall.json",
        "match stones wall.json --out match",
    ):
        assert called(line, place).returncode == 0
    return place


def called(line, place, largest=None):
    """Run a command that may write files of so many bytes."""

    def limit():
        import resource

        if largest is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))

    argv = [sys.executable, "-m", "cyclopean", *line.split()]
    return subprocess.run(argv, cwd=place, capture_output=True, text=True, timeout=300, preexec_fn=limit, check=False)


def held(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "match.parts"}  # kept to go on


@pytest.mark.parametrize("command", COMMANDS)
def test_a_full_disk_leaves_what_was_there(yard, command):
    place, line = yard / f"to-{command}", COMMANDS[command].replace(" out", f" to-{command}")
    place.mkdir()
    done = called(line, yard)
    assert done.returncode == 0, done.stderr
    fresh = held(place)
    sizes = sorted(map(len, fresh.values()))
    assert sizes[0] < sizes[-1]
    theirs = dict.fromkeys((*fresh, "notes.txt"), b"of an earlier day")
    for name, data in theirs.items():
        (place / name).write_bytes(data)
    done = called(line, yard, sizes[-1] - 1)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1].endswith("cannot be written (File too large)")
    assert held(place) == theirs
    assert called(line, yard).returncode == 0
    assert set(held(place)) == set(theirs)
    assert held(place)["notes.txt"] == b"of an earlier day"
