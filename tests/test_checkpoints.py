"""Checkpoints: a job that stopped goes on where it stopped, and never with another job's answers."""

import io
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from cyclopean.io.checkpoints import Checkpoints

CALLS = []


def squared(values):
    CALLS.append(float(values.sum()))
    return values**2, np.array([len(values)])


def failing(values):
    if values[0] > 1.0:
        raise ZeroDivisionError
    return squared(values)


@pytest.fixture(autouse=True)
def no_calls():
    CALLS.clear()


JOBS = [np.array([float(k), 2.0]) for k in range(4)]


@pytest.mark.parametrize("hands", [None, 2])
def test_the_second_run_calls_nothing_and_answers_the_same(tmp_path, hands):
    inner = None if hands is None else ThreadPoolExecutor(hands)
    first = list(Checkpoints(tmp_path / "parts", inner).map(squared, JOBS))
    assert len(CALLS) == 4
    again = Checkpoints(tmp_path / "parts")
    second = list(again.map(squared, JOBS))
    assert len(CALLS) == 4
    assert (again.found, again.made) == (4, 0)
    for job, one, other in zip(JOBS, first, second, strict=True):
        np.testing.assert_array_equal(one[0], job**2)
        assert all(np.array_equal(a, b) and a.dtype == b.dtype for a, b in zip(one, other, strict=True))


def test_what_was_done_before_a_failure_is_kept(tmp_path):
    parts = Checkpoints(tmp_path / "parts")
    with pytest.raises(ZeroDivisionError):
        list(parts.map(failing, JOBS))
    assert len(CALLS) == 2
    assert len(list(parts)) == 2
    assert Checkpoints(tmp_path / "parts").submit(failing, JOBS[1]).result()[0].tolist() == [1.0, 4.0]
    assert len(CALLS) == 2


def test_other_input_and_another_function_are_other_answers(tmp_path):
    parts = Checkpoints(tmp_path / "parts")
    parts.submit(squared, JOBS[0])
    parts.submit(squared, JOBS[0] + 1e-16)  # 0 + 1e-16 is another number
    parts.submit(failing, JOBS[0])
    assert parts.found == 0
    assert len(CALLS) == 3


def saved(*arrays):
    stream = io.BytesIO()
    np.savez(stream, *arrays)
    return stream.getvalue()


DAMAGE = {
    "emptied": lambda _: b"",
    "no zip": lambda _: b"PK\x03\x04 not a zip",
    "cut off": lambda data: data[:-40],
    "not a number": lambda _: saved(np.array([np.nan, 4.0]), np.array([2])),
    "another shape": lambda _: saved(np.array([1.0]), np.array([2])),
    "shifted a little": lambda _: saved(np.array([1.0 + 1e-9, 4.0]), np.array([2])),
    "shifted, behind the old digest": lambda data: data[:32] + saved(np.array([1.0 + 1e-9, 4.0]), np.array([2])),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_file_is_done_again(tmp_path, damage):
    before = Checkpoints(tmp_path / "parts")
    before.submit(squared, JOBS[1])
    (file,) = before
    parts = Checkpoints(tmp_path / "parts")
    file.write_bytes(DAMAGE[damage](file.read_bytes()))
    assert parts.submit(squared, JOBS[1]).result()[0].tolist() == [1.0, 4.0]
    assert len(CALLS) == 2
    assert parts.submit(squared, JOBS[1]).result()[1].tolist() == [2]
    assert len(CALLS) == 2
    assert (parts.found, parts.unfit) == (1, {file})


def test_the_answer_of_another_call_is_not_taken_for_this_one(tmp_path):
    parts = Checkpoints(tmp_path / "parts")
    parts.submit(squared, JOBS[1])
    (one,) = parts
    parts.submit(squared, JOBS[2])
    (other,) = set(parts) - {one}
    other.write_bytes(one.read_bytes())
    assert parts.submit(squared, JOBS[2]).result()[0].tolist() == [4.0, 4.0]
    again = Checkpoints(tmp_path / "parts")
    again.submit(squared, JOBS[2])
    assert again.unfit == {one}
    again.submit(squared, JOBS[1])
    assert not again.unfit


def test_clearing_leaves_what_others_put_there(tmp_path):
    parts = Checkpoints(tmp_path / "parts")
    parts.submit(squared, JOBS[0])
    (tmp_path / "parts" / "notes.npz").write_text("theirs")
    (tmp_path / "parts" / f".{'0' * 16}.tmp").mkdir()  # of a run that was killed
    (tmp_path / "parts" / f".{'0' * 16}.tmp" / "0").write_text("half")
    parts.clear()
    assert [path.name for path in (tmp_path / "parts").iterdir()] == ["notes.npz"]


def test_calls_are_made_as_they_are_asked_for(tmp_path):
    answers = Checkpoints(tmp_path / "parts").map(squared, JOBS)
    next(answers)
    assert len(CALLS) == 1


def test_nothing_is_left_once_cleared_and_clearing_nothing_is_fine(tmp_path):
    parts = Checkpoints(tmp_path / "parts")
    parts.clear()
    assert not (tmp_path / "parts").exists()
    parts.submit(squared, JOBS[0])
    parts.clear()
    assert not (tmp_path / "parts").exists()
    parts.submit(squared, JOBS[0])
    assert len(CALLS) == 2
