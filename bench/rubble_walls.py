"""Rubble walls: how much of them is stone, what `check` says of them, and what falls when they are let go.

    python bench/rubble_walls.py table [--stones DIR] [--dress 0,0.03] [--keep DIR]
    python bench/rubble_walls.py measure WALL.json ... [--length 0.7] [--thickness 0.4]
    python bench/rubble_walls.py simulate WALL.json ... [--out 0.01] [--parts DIR] [--mu 0.7]

`table` lays the 132 stones of a published benchmark by the command line, one wall for each share of dressing, and
prints them beside what is known of other walls of these stones; `--stones` or CYCLOPEAN_BENCHMARK_STONES names their
folder. *Void A*: what is not stone between the faces, below the highest stone of each column along the wall. *Void B*:
below each place's own top. *Face*: share of the front elevation with stone within a tenth of the thickness. *Top*:
standard deviation of the top of all that is covered. `check` reads the written file, with a friction of 0.6.

`simulate` lets a model go in MuJoCo on fine convex parts of its stones (`simulated.parts_of`), on level ground, and
tells how many stones moved by more than a tenth of their size (cube root of the volume), and how many fell: by more
than all of it. Set OMP_NUM_THREADS=1 before.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path
from tempfile import mkdtemp
from time import perf_counter, process_time

import numpy as np
import simulated

from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly
from cyclopean.design.rubble.features import body_of
from cyclopean.design.rubble.masons_rules import Faces, masons_rules
from cyclopean.geometry import triangles
from cyclopean.io import read_model

LENGTH, THICKNESS = 0.7, 0.4  # m
MU = 0.6
MOVED, FELL = 0.1, 1.0  # of a stone's size
DOWN = np.array([0.0, 0.0, -9.81])
HEADS = ("laid", "litres", "A", "B", "face", "top cm", "RBE", "CRA", "s")
FORMS = ("4d", "6.1f", "5.3f", "5.3f", "5.2f", "6.1f", "9", "9", "6.1f")
KNOWN = (
    ("StonePacking-3D, published", 108, 69.0, 0.621, 0.560, 0.52, np.nan, "unchecked", "unchecked", 132.0),
    ("first version of settle", 62, 55.3, 0.643, 0.477, 0.24, np.nan, "stable", "", 93.0),
)


def heads() -> str:
    """The first line of the table."""
    widths = (form.split(".")[0].rstrip("d") for form in FORMS)
    return f"{'wall':>26} " + " ".join(f"{head:>{width}}" for head, width in zip(HEADS, widths, strict=True))


def line(name: str, *values: object) -> str:
    """A line of the table."""
    return f"{name:>26} " + " ".join(f"{value:>{form}}" for value, form in zip(values, FORMS, strict=True))


def figures(wall: Assembly, length: float, thickness: float) -> tuple[int, float, float, float, float, float]:
    """Laid, litres, void A, void B, face and top (cm) of a wall on the first block."""
    corner, face = triangles(wall.mesh)
    body, start = wall.mesh.face_body[face], wall.mesh.vertex_start
    stones = [body_of(wall.blocks[k].vertices, corner[body == k] - start[k]) for k in range(1, len(wall))]
    told = masons_rules(stones, Faces(length, thickness))
    litres = 1e3 * sum(stone.volume for stone in stones)
    return len(stones), litres, told.void, told.void_tops, told.face, 100.0 * told.top


def measured(name: str, path: Path, seconds: float, length: float = LENGTH, thickness: float = THICKNESS) -> str:
    """The line of the table for a wall in a file."""
    wall, _ = read_model(path)
    words = [check(wall, Settings(method=method, mu=MU, seconds=300.0)).verdict for method in ("rbe", "cra")]
    return line(name, *figures(wall, length, thickness), *words, seconds)


def table(stones: str, shares: list[str], keep: Path) -> None:
    """Lay a wall for each share of dressing, and print it."""
    print(heads())
    for row in KNOWN:
        print(line(*row), flush=True)
    for share in shares:
        out = keep / f"wall-{share}.json"
        asked = ["--units", "cm", "--length", str(LENGTH), "--thickness", str(THICKNESS), "-o", str(out)]
        dress = ["--dress", share] if float(share) > 0.0 else []
        began = perf_counter()
        subprocess.run([sys.executable, "-m", "cyclopean", "settle", stones, *asked, *dress], check=False)
        print(measured(f"settle, {100 * float(share):g} % dressed", out, perf_counter() - began), flush=True)


def simulate(path: Path, mu: float, seconds: float, most: float, kept: Path | None) -> str:
    """Let the wall of a file go, and tell what moved."""
    wall, _ = read_model(path)
    began = process_time()
    parts = simulated.model_parts(wall, most, kept)
    made = process_time()
    size = np.cbrt(wall.mass.volume)
    motion = simulated.simulation(wall, [p.corners for p in parts], mu, DOWN, simulated.SOFT, seconds)
    far, series = np.zeros(len(wall)), []
    for _, _, place in motion:
        far = np.linalg.norm(place - wall.mass.centroid, axis=1) / size
        series.append(int((far[1:] > MOVED).sum()))
    out = np.array([p.out for p in parts])
    counts = [len(p.corners) for p in parts[1:]]
    who = ", ".join(f"{wall.blocks[k].id} {far[k]:.2f}" for k in np.argsort(-far)[:10] if far[k] > MOVED)
    return (
        f"{path.name}: {len(wall) - 1} stones, {seconds:g} s at mu {mu:g}: {series[-1]} moved by more than a tenth of "
        f"their size, {int((far[1:] > FELL).sum())} fell; median {np.median(far[1:]):.4f}\n"
        f"  moved after each half second: {series[4::5]}; farthest: {who or 'none'}\n"
        f"  {np.mean(counts):.0f} parts a stone; they stand out by {out.max():.4f} of its size at most; "
        f"{min(p.covered for p in parts):.4f} of the surface is covered at least\n"
        f"  {made - began:.1f} s for the parts, {process_time() - made:.1f} s for the simulation"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ways = parser.add_subparsers(dest="way", required=True)
    lay = ways.add_parser("table")
    lay.add_argument("--stones", default=os.environ.get("CYCLOPEAN_BENCHMARK_STONES"))
    lay.add_argument("--dress", default="0,0.03")
    lay.add_argument("--keep", type=Path, help="folder for the walls")
    told = ways.add_parser("measure")
    told.add_argument("walls", type=Path, nargs="+")
    told.add_argument("--length", type=float, default=LENGTH)
    told.add_argument("--thickness", type=float, default=THICKNESS)
    go = ways.add_parser("simulate")
    go.add_argument("walls", type=Path, nargs="+")
    go.add_argument("--out", type=float, default=simulated.OUT, help="of a stone's size: how far a part may stand out")
    go.add_argument("--parts", type=Path, help="folder in which the parts of stones are kept from one wall to the next")
    go.add_argument("--seconds", type=float, default=3.0)
    go.add_argument("--mu", type=float, default=0.7)
    asked = parser.parse_args()
    if asked.way == "table":
        if not asked.stones:
            parser.error("table: name the folder of the stones by --stones or CYCLOPEAN_BENCHMARK_STONES")
        table(asked.stones, asked.dress.split(","), asked.keep or Path(mkdtemp()))
        return
    if asked.way == "measure":
        print(heads())
        for path in asked.walls:
            print(measured(path.stem, path, np.nan, asked.length, asked.thickness), flush=True)
        return
    for path in asked.walls:
        print(simulate(path, asked.mu, asked.seconds, asked.out, asked.parts), flush=True)


if __name__ == "__main__":
    main()
