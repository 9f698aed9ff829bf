"""Whole commands by the clock, process and all: how long does a user wait for an answer on a small model?

Run `python bench/commands.py [CHECKOUT ...] [--times 9]`: each command in this checkout and in others, in turns; prints
medians in seconds. Each checkout has to be set up (`./run --version`).
"""

import argparse
import os
import statistics
import subprocess
import tempfile
from pathlib import Path
from time import perf_counter

HERE = Path(__file__).resolve().parent.parent
COMMANDS = {
    "check, 12 voussoirs, no margins": ["check", "arch.json", "--no-margins"],
    "check, 12 voussoirs": ["check", "arch.json"],
    "limit, 12 voussoirs": ["limit", "arch.json", "--tilt", "0"],
    "info, 12 voussoirs": ["info", "arch.json"],
}
ALONE = {name: "1" for name in ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}


def seconds(checkout: Path, arguments: list[str], folder: str) -> float:
    """By the clock; a command that fails ends the bench."""
    began = perf_counter()
    done = subprocess.run([checkout / "run", *arguments], cwd=folder, env=os.environ | ALONE, capture_output=True)
    if done.returncode:
        raise SystemExit(f"{checkout}: {' '.join(arguments)}: {done.stderr.decode()}")
    return perf_counter() - began


def main() -> None:
    """Time every command in every checkout, one after the other, as often as is asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("others", nargs="*", type=Path)
    parser.add_argument("--times", type=int, default=9)
    given = parser.parse_args()
    checkouts = [HERE, *(other.resolve() for other in given.others)]
    with tempfile.TemporaryDirectory() as folder:
        seconds(HERE, ["make", "arch", "12", "--span", "3", "--thickness", "0.3", "--out", "arch.json"], folder)
        for name, arguments in COMMANDS.items():
            taken = [[seconds(one, arguments, folder) for one in checkouts] for _ in range(given.times)]
            row = "  ".join(f"{statistics.median(column):.2f}" for column in zip(*taken, strict=True))
            print(f"{name:34}{row}", flush=True)


if __name__ == "__main__":
    main()
