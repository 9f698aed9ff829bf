"""Commands as processes of their own, for tests of what ends them, kills them or leaves them no room."""

import subprocess
import sys

from cyclopean.cli import main

__all__ = ["SMALL", "argv", "called", "drawn"]

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


def called(line, place, seconds=LONG, largest=None):
    """Status and words of a command; it is killed after so many seconds, and may write files of so many bytes."""

    def limit():
        import resource

        if largest is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))

    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(argv(line), cwd=place, preexec_fn=limit, **pipes) as process:
        try:
            out, err = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            out, err = process.communicate(timeout=LONG)  # its workers end too, and let go of the pipes
    return process.returncode, out, err
