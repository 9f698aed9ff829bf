"""Commands as processes of their own, for tests of what ends them or kills them."""

import json
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager

import pytest

from cyclopean.cli import main

__all__ = ["SMALL", "argv", "called", "cluster", "drawn"]

LONG = 300.0  # s: that a busy machine may take
SMALL = (
    "make stones --count 7 --seed 2 --detail 1 --out stones.glb",
    "make polygonal --columns 3 --rows 2 --width 1.4 --height 0.9 --depth 0.3 --out wall.json",
)


def argv(line):
    return [sys.executable, "-m", "cyclopean", *line.split()]


def drawn(place, lines, patch):
    """Run commands in a folder, in this process; give the folder."""
    with patch.context() as there:
        there.chdir(place)
        for line in lines:
            assert main(line.split()) == 0, line
    return place


def called(line, place, seconds=LONG):
    """Status and words of a command; it is killed after so many seconds."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(argv(line), cwd=place, **pipes) as process:
        try:
            out, err = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            out, err = process.communicate(timeout=LONG)  # its workers end too, and let go of the pipes
    return process.returncode, out, err


@contextmanager
def cluster(place, workers):
    """The address of a cluster that keeps its files in a folder, and its workers.

    Scheduler and workers are processes of their own, as users have them: what they leave open is not open here.
    """
    distributed = pytest.importorskip("distributed", reason="needs dask")
    told = place / "scheduler.json"

    def begin(stack, *words):
        words = (sys.executable, "-m", "dask", *words, "--no-dashboard", "--host", "127.0.0.1")
        process = stack.enter_context(subprocess.Popen(words, cwd=place, stderr=subprocess.DEVNULL))
        stack.callback(process.kill)
        return process

    with ExitStack() as stack:
        scheduler = begin(stack, "scheduler", "--port", "0", "--scheduler-file", str(told))
        address, end = None, time.monotonic() + LONG
        while address is None:
            assert scheduler.poll() is None
            assert time.monotonic() < end
            time.sleep(0.05)
            try:
                address = json.loads(told.read_text())["address"]
            except (OSError, json.JSONDecodeError):
                continue  # not written yet, or not to its end
        worker = ("worker", address, "--no-nanny", "--nthreads", "1", "--local-directory", str(place))
        begun = [begin(stack, *worker) for _ in range(workers)]
        with distributed.Client(address, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=LONG)
        yield address, begun
