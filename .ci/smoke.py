# ruff: noqa: T201
"""Run every command once in the environment of this Python, in the folder that it is started in. Standard library only.

A command that the help lists and that no line below runs is a failure.
"""

import re
import signal
import subprocess
import sys
import threading
from pathlib import Path

# Status that is wanted, and the command; each may use what those before it have written.
RUNS = """
0 make stack 3 --out stack.json
0 make wall 4 3 --out plain.json
0 make arch 12 --span 3 --thickness 0.3 --out arch.json
0 make vault 8 3 --out vault.json
0 make dome 3 8 --out dome.json
0 make polygonal --width 1.6 --height 1.0 --columns 4 --rows 3 --out wall.json
0 make stones --count 20 --seed 1 --volume 20..90L --out stones.obj
0 check arch.json --json result.json --certificate proof.json --report arch.html
1 check arch.json --tilt 20
0 verify proof.json
0 info arch.json
0 info stones.obj --stones
0 convert arch.json arch.obj
0 convert arch.obj again.json --units m
0 sequence wall.json --out order.json --report building.html
0 match stones.obj wall.json --units m --out . --report match.html
0 carve . --out . --report carved.html
0 settle stones.obj --units m --out rubble.json
0 ashlar --stone 0.4x0.2x0.2*60 --width 1.6 --height 1.0 --depth 0.2 --out ashlar.json
0 pack --stone 0.4x0.2x0.2*60 --width 1.6 --height 1.0 --depth 0.2 --out pack.json
0 view result.json --out result.html --no-browser
0 limit arch.json --push 1,0,0
0 demo
2 serve --hops
0 doctor
0 completion bash
2 check nothing.json
"""

# Those that go on until they are interrupted.
SERVERS = ("studio stack.json --no-browser",)


def cyclopean(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The command of this environment, not one of the path."""
    program = Path(sys.executable).with_name("cyclopean")
    return subprocess.run([program, *arguments], capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)


def interrupted(command: str, patience: float = 30.0) -> tuple[bool, str]:
    """Whether a server says where it is, goes on, and leaves with 0 at an interrupt; what it said."""
    program = Path(sys.executable).with_name("cyclopean")
    served = subprocess.Popen([program, *command.split()], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    stop = threading.Timer(patience, served.kill)
    stop.start()
    address = next((line for line in served.stdout or () if "http://" in line), "")
    if address and served.poll() is None:
        served.send_signal(signal.SIGINT)
    rest, said = served.communicate()
    stop.cancel()
    return served.returncode == 0 and bool(address), address + rest + said


def listed(*group: str) -> list[str]:
    """Commands that the help lists, those of groups included."""
    shown = re.search(r"^Commands:\n((?:  .*\n)+)", cyclopean(*group, "--help").stdout, re.MULTILINE)
    if shown is None:
        return [" ".join(group)]
    return [name for found in re.findall(r"^  ([\w-]+)", shown[1], re.MULTILINE) for name in listed(*group, found)]


def main() -> int:
    """Run them all; say what went wrong."""
    wrong = 0
    lines = [line.partition(" ")[::2] for line in RUNS.strip().splitlines()]
    for wanted, command in lines:
        done = cyclopean(*command.split())
        fine = str(done.returncode) == wanted and "Traceback" not in done.stderr
        print(f"{'ok' if fine else 'WRONG':6}{done.returncode}  cyclopean {command}", flush=True)
        if not fine:
            print(done.stdout + done.stderr)
            wrong += 1
    for command in SERVERS:
        fine, said = interrupted(command)
        print(f"{'ok' if fine else 'WRONG':9} cyclopean {command}{'' if fine else chr(10) + said}", flush=True)
        wrong += not fine
    for command in listed():
        if not any(f"{run} ".startswith(f"{command} ") for run in (*(run for _, run in lines), *SERVERS)):
            print(f"WRONG     cyclopean {command}: no line of this script runs it")
            wrong += 1
    return min(wrong, 1)


if __name__ == "__main__":
    raise SystemExit(main())
