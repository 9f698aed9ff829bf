"""Commands that write several files leave a folder as it was when the disk is full, and never touch what is not theirs.

A limit on the size of files stands for the full disk: the first files fit, a later one does not.
"""

import os
from contextlib import contextmanager

import pytest

from cyclopean.cli import main
from processes import SMALL, drawn

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs limits as Unix has them")

COMMANDS = {
    "stones": "make stones --count 5 --detail 2 --seed 9 --volume 1..200L --out out",
    "match": "match stones.glb wall.json --out out --negotiate 1 --rounds 1 --report out/match.html",
    "carve": "carve match --out out --method rbe --least-cut 0.03",
    "settle": "settle stones.glb --out out/a.json --json out/b.json --svg out/c.svg --yaws 1 --ways 1 --workers 1",
    "sequence": "sequence wall.json --out out/order.json --dot out/order.dot --report out/order.html --method rbe",
}


@pytest.fixture(scope="module")
def yard(tmp_path_factory):
    place = tmp_path_factory.mktemp("yard")
    (place / "match").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        return drawn(place, (*SMALL, "match stones.glb wall.json --out match"), patch)


def held(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "match.parts"}  # kept to go on


@contextmanager
def full(largest):
    """No file may grow beyond so many bytes."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("command", COMMANDS)
def test_a_full_disk_leaves_what_was_there(yard, command, monkeypatch, capsys):
    monkeypatch.chdir(yard)
    place, line = yard / f"to-{command}", COMMANDS[command].replace(" out", f" to-{command}")
    place.mkdir()
    drawn(yard, [line], monkeypatch)
    fresh = held(place)
    sizes = sorted(map(len, fresh.values()))
    assert sizes[0] < sizes[-1]
    theirs = dict.fromkeys((*fresh, "notes.txt"), b"of an earlier day")
    for name, data in theirs.items():
        (place / name).write_bytes(data)
    capsys.readouterr()
    with full(sizes[-1] - 1):
        assert main(line.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines()[-1].endswith("cannot be written (File too large)")
    assert held(place) == theirs
    drawn(yard, [line], monkeypatch)
    assert set(held(place)) == set(theirs)
    assert held(place)["notes.txt"] == b"of an earlier day"
