"""What a reader may cost: damaged and hostile files are refused within seconds and within their own size.

Limits of time are several times what a busy machine takes, and far below what a step that grows with the square of
the file would take.
"""

import io
import json
import time
import tracemalloc
import zipfile

import numpy as np
import pytest

from cyclopean.design.stones.stone import stone_of
from cyclopean.errors import InputError
from cyclopean.io import read_stones
from cyclopean.io.checkpoints import Checkpoints
from cyclopean.io.fields import face_fault, first_repeat, parsed
from cyclopean.io.npz import UNREADABLE, arrays_of
from fixtures_stones import boulder, obj

MANY = 120_000
SECONDS = 20.0


@pytest.mark.parametrize(
    "work",
    [
        lambda: parsed("big.json", "{" + ",".join(f'"{k}": 0' for k in [*range(MANY), MANY - 1]) + "}"),
        lambda: face_fault([*range(MANY), MANY - 1], MANY),
        lambda: first_repeat([*map(str, range(MANY)), "7"]),
    ],
)
def test_what_stands_twice_is_found_at_once(work) -> None:
    """The search by lists took over a minute for 1.2 MB of JSON."""
    started = time.perf_counter()
    try:
        said = work()
    except InputError as error:
        said = str(error)
    assert time.perf_counter() - started < SECONDS
    assert said == "7" or f"{MANY - 1}" in said


def test_equal_names_of_stones_are_numbered_at_once(tmp_path, monkeypatch) -> None:
    """Each of n equal names tried all numbers from 2 on: n^2 / 2 names, 200 million of them here."""
    from cyclopean.io import stones as module
    from cyclopean.io.stone_cache import Reading

    stone = stone_of("x", *boulder(0))
    many = Reading(stones=(stone,) * 20_000, named=True, alone=False)
    started = time.perf_counter()
    inventory = module._gathered(tmp_path / "yard.obj", [tmp_path / "yard.obj"], [many], 0)
    assert time.perf_counter() - started < SECONDS
    assert [stone.id for stone in inventory.stones[:3]] == ["x", "x-2", "x-3"]
    assert len({stone.id for stone in inventory.stones}) == 20_000


@pytest.fixture
def pack(tmp_path, monkeypatch):
    """The cache's one file of a folder with one stone, that folder, and what reading it gave."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    yard = tmp_path / "yard"
    yard.mkdir()
    (yard / "s.obj").write_text(obj(*boulder(0)))
    cold, _ = read_stones(yard, "m")
    (path,) = (tmp_path / "cache").iterdir()
    return path, yard, cold.stones[0]


def archive(path, change, **arrays):
    """The same pack with arrays added or put in place of others, written by `change`."""
    with np.load(path) as data:
        change(path, **(dict(data) | arrays))


def peak(work):
    """Bytes (at most, at one time) that Python and numpy ask for while this is done, and what it gives."""
    tracemalloc.start()
    try:
        return work(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_a_cache_takes_no_more_room_than_its_file(pack) -> None:
    """200 MB of zeros, compressed to 0.2 MB: the file is not unpacked, and the stone is read anew."""
    path, yard, stone = pack
    archive(path, np.savez_compressed, vertices=np.zeros((8_000_000, 3)))
    assert path.stat().st_size < 2**20
    (found, _), most = peak(lambda: read_stones(yard, "m"))
    assert most < 32 * 2**20
    assert found.stones[0].volume == stone.volume
    assert max(m.file_size for m in zipfile.ZipFile(path).infolist()) < 2**20  # it was written anew


def refusal(data):
    with pytest.raises(UNREADABLE) as refused:
        arrays_of(data)
    return str(refused.value)


def liar(shape):
    """An array file whose head promises more than there is."""
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return stream.getvalue() + bytes(800)


def test_an_array_is_as_large_as_its_head_says_or_refused() -> None:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as zipped:
        zipped.writestr("a.npy", liar((10**8,)))
    refused, most = peak(lambda: refusal(stream.getvalue()))
    assert "another size" in refused
    assert most < 2**20
    stream = io.BytesIO()
    np.savez(stream, a=np.arange(6).reshape(2, 3), b=np.zeros(0))
    found = arrays_of(stream.getvalue())
    assert (found["a"].tolist(), found["b"].tolist(), [*found]) == ([[0, 1, 2], [3, 4, 5]], [], ["a", "b"])


def test_members_that_share_their_bytes_are_refused() -> None:
    """One megabyte that a thousand entries of the directory name would be a gigabyte."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as zipped:
        zipped.writestr("a.npy", bytes(2**20))
        zipped.filelist = zipped.filelist * 1000
        zipped._didModify = True
    data = stream.getvalue()
    refused, most = peak(lambda: refusal(data))
    assert "own bytes" in refused
    assert most < 8 * 2**20


def test_volumes_are_taken_of_the_shape_and_not_believed(pack) -> None:
    """A pack that claims another volume, in the field that once held it or by a larger mesh, cannot make one up."""
    path, yard, stone = pack
    with np.load(path) as data:
        said, vertices = [name for name in data.files if name in ("facts", "volume", "density")], data["vertices"]
    for name in (*said, "facts"):
        archive(path, np.savez, **{name: np.full((1, 20) if name == "facts" else 1, 7.0)})
    assert read_stones(yard, "m")[0].stones[0].volume == stone.volume
    archive(path, np.savez, vertices=2.0 * vertices)
    assert read_stones(yard, "m")[0].stones[0].volume == pytest.approx(8.0 * stone.volume)


def plus(x):
    return (x + 1.0,)


def test_checkpoints_are_not_unpacked_either(tmp_path) -> None:
    kept = Checkpoints(tmp_path / "kept")
    assert kept.submit(plus, np.zeros(3)).result()[0].tolist() == [1.0] * 3
    (path,) = kept
    np.savez_compressed(path, np.zeros(25_000_000))
    (found,), most = peak(lambda: kept.submit(plus, np.zeros(3)).result())
    assert found.tolist() == [1.0] * 3
    assert most < 32 * 2**20


def test_json_of_one_megabyte_is_still_read() -> None:
    assert len(parsed("big.json", json.dumps({str(k): k for k in range(MANY)}))) == MANY
