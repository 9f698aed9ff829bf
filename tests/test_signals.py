"""What ends a command from outside ends all of it: its workers too, with one line and the status that a shell gives.

Every process here holds the pipe of standard error, so that reading it to its end takes until the last one is gone.
Mutants killed: signals answered by Python's defaults; workers that see a terminal's signals; the process that cleans up
after others ended by one; workers that do not look whether their parent lives.
"""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

from cyclopean.cli import main
from laws import nightly, some
from processes import argv, cluster, drawn

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs what Unix has")

LONG = 60.0  # s: that a busy machine may take to begin or to end
ENDLESS = {
    "match": "match stones.glb wall.json --out out --workers 2 --negotiate 1 --rounds 100",
    "settle": "settle stones.glb --out laid.json --workers 2 --ways 6 --yaws 64",
    "sequence": "sequence wall.json --out order.json --workers 2 --method rbe",
    "vary": "check wall.json --method rbe --vary mu=0.6:0.9 --samples 1000000 --workers 2",
}

INTERRUPTED = "cyclopean: error: interrupted; no result was written\n"


@pytest.fixture(scope="module")
def yard(tmp_path_factory):
    """Sixty stones, and a wall of about as many."""
    place = tmp_path_factory.mktemp("yard")
    (place / "out").mkdir()
    stones = "make stones --count 60 --detail 1 --out stones.glb"
    wall = "make polygonal --columns 9 --rows 6 --out wall.json"
    with pytest.MonkeyPatch.context() as patch:
        return drawn(place, (stones, wall), patch)


@contextmanager
def begun(line, place, ready=lambda process: len(children(process)) > 1, **streams):
    """The command, in a session of its own, once it has workers: one child is Python's own, the next a worker."""
    given = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | streams
    with subprocess.Popen(argv(line), cwd=place, start_new_session=True, **given) as process:
        try:
            deadline = time.monotonic() + LONG
            while not ready(process) and process.poll() is None and time.monotonic() < deadline:
                time.sleep(0.02)
            assert process.poll() is None
            yield process
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)


def children(process):
    said = subprocess.run(["ps", "-o", "pid=", "--ppid", str(process.pid)], capture_output=True, text=True, check=False)
    return [int(pid) for pid in said.stdout.split()]


@pytest.mark.parametrize(
    ("command", "number", "whole_group"),
    [
        ("vary", signal.SIGHUP, True),
        *some(
            [
                ("match", signal.SIGTERM, False),
                ("match", signal.SIGHUP, True),
                ("settle", signal.SIGHUP, False),
                ("sequence", signal.SIGTERM, False),
                ("sequence", signal.SIGINT, True),
                ("settle", signal.SIGTERM, True),
            ]
        ),
    ],
)
def test_a_signal_ends_command_and_workers_with_one_line(yard, command, number, whole_group):
    with begun(ENDLESS[command], yard) as process:
        (os.killpg if whole_group else os.kill)(process.pid, number)
        out, err = process.communicate(timeout=LONG)
    assert (process.returncode, out, err) == (128 + number, "", INTERRUPTED)
    assert sorted(path.name for path in yard.glob("*.json")) == ["wall.json"], "nothing half done is written"


@pytest.mark.parametrize("command", some(["match", "settle", "sequence"]))
def test_workers_end_with_a_parent_that_is_killed(yard, command):
    with begun(ENDLESS[command], yard) as process:
        process.kill()
        process.communicate(timeout=LONG)
    assert process.returncode == -signal.SIGKILL


def test_a_worker_that_somebody_ends_is_told_of_in_one_line(yard):
    with begun(ENDLESS["match"], yard) as process:
        os.kill(max(children(process)), signal.SIGKILL)
        out, err = process.communicate(timeout=LONG)
    assert (process.returncode, out) == (2, "")
    *kept, last = err.splitlines()
    assert "--workers: a process that did part of the work was ended" in last
    assert all("are kept in" in line for line in kept), "what was done before, if anything was"
    assert len(kept) <= 1


def test_a_thread_that_waits_for_ever_holds_nobody_up():
    """An interrupt that comes while a lock is taken leaves it taken; who waits for it is not waited for."""
    program = (
        "import threading, cyclopean.cli as cli, cyclopean.cli.app as app\n"
        "def run(_):\n"
        "    threading.Thread(target=threading.Event().wait).start()\n"
        "    raise KeyboardInterrupt\n"
        "app.run = run\n"
        "cli.process()\n"
    )
    argv = [sys.executable, "-c", program]
    done = subprocess.run(argv, capture_output=True, text=True, timeout=LONG, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", INTERRUPTED)


def test_a_terminal_that_is_closed_leaves_nobody_to_be_told(yard):
    """Its session gets SIGHUP, and what is written to it fails."""
    import pty

    ours, theirs = pty.openpty()
    with begun(ENDLESS["match"], yard, stdout=theirs, stderr=theirs) as process:
        os.close(theirs)
        os.close(ours)
        process.send_signal(signal.SIGHUP)
        assert process.wait(timeout=LONG) == 128 + signal.SIGHUP


@nightly
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_work_on_a_cluster_with_one_line(yard, tmp_path, number):
    (yard / f"cluster-{number}").mkdir()
    with cluster(tmp_path, 1) as (address, _):
        line = f"match stones.glb wall.json --out cluster-{number} --cluster {address}"
        with begun(line, yard, lambda _: any(yard.glob(f"cluster-{number}/match.parts/*.npz"))) as process:
            process.send_signal(number)
            out, err = process.communicate(timeout=LONG)
    assert (process.returncode, out, err.splitlines(keepends=True)[-1:]) == (128 + number, "", [INTERRUPTED])


@pytest.mark.parametrize("interrupted", [True, False])
def test_an_interrupt_that_a_library_takes_for_its_own_error_is_one(monkeypatch, capsys, interrupted):
    """What is written in C and interrupted while it is loaded says ImportError."""

    class Program:
        def main(self, *_, **__):
            try:
                raise KeyboardInterrupt if interrupted else ValueError
            except BaseException as error:
                raise ImportError("initialization failed") from error

    monkeypatch.setattr("cyclopean.cli.app.program", Program)
    status, err = main(["info", "x.json"]), capsys.readouterr().err
    assert err.count("\n") == 1
    assert (status, "interrupted" in err, "internal error" in err) == (
        (130, True, False) if interrupted else (70, False, True)
    )


def test_an_interrupt_of_a_string_that_was_run_ends_with_the_status_too(tmp_path):
    """The interpreter notes it where it makes a dataclass, and would end a module by the signal all the same."""
    (tmp_path / "interrupted.py").write_text(
        "from cyclopean import cli\n"
        "def main():\n"
        "    try:\n"
        "        exec('raise KeyboardInterrupt')\n"
        "    except KeyboardInterrupt:\n"
        "        print('answered')\n"
        "        return 130\n"
        "cli.main = main\n"
        "cli.process()\n"
    )
    line = [sys.executable, "-m", "interrupted"]
    ended = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=LONG)
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "answered\n", "")
