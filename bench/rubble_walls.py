"""Rubble walls: how much of them is stone, what `check` says of them, and what falls when they are let go.

    python bench/rubble_walls.py table [--stones DIR] [--scans DIR] [--quarry 40,200] [--seeds 1] [--dress 0,0.03]
                                       [--cra 100] [--workers 1] [--keep DIR]
    python bench/rubble_walls.py dressing [--stones DIR] [--quarry 40] [--seeds 3] [--dress 0,0.01,0.03,0.05,0.1]
                                          [--workers 1] [--keep DIR] [--svg docs/images/dressing.svg]
    python bench/rubble_walls.py measure WALL.json ... [--length 0.7] [--thickness 0.4] [--cra 100]
    python bench/rubble_walls.py simulate WALL.json ... [--out 0.01] [--parts DIR] [--mu 0.7]

`table` lays stocks of stones by the command line and prints each wall beside what is known of others of these stones:
the 132 of a published benchmark (`--stones` or CYCLOPEAN_BENCHMARK_STONES names their folder), one wall for each share
of dressing; boulders (`--scans` or CYCLOPEAN_STONES, in metres); and of the synthetic quarry so many, for each of so
many seeds. *Void A*: what is not stone between the faces, below the highest stone of each column along the wall.
*Void B*: below each place's own top. *Face*: share of the front elevation with stone within a tenth of the thickness.
*Top*: standard deviation of the top of all that is covered. *RBE*, *CRA*: what `check` says of the written file with a
friction of 0.6, CRA within so many seconds. *s*: of the laying, by the clock.

`dressing` lays stones of the quarry with each share of its volume that a stone may lose, and draws void A and Lambda,
means over the seeds; with `--stones` it prints those of the benchmark as well. Walls that are in the folder of `--keep`
are not laid again.

`simulate` lets a model go in MuJoCo on fine convex parts of its stones (`simulated.parts_of`), on level ground, and
tells how many stones moved by more than a tenth of their size (cube root of the volume), and how many fell: by more
than all of it. Set OMP_NUM_THREADS=1 before.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import mkdtemp
from time import process_time
from typing import Any

import numpy as np
import simulated
from dressing_chart import dressing_svg

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
FORMS = ("4d", "6.0f", "5.3f", "5.3f", "5.2f", "6.1f", "9", "9", "6.1f")
BENCHMARK, SCANS, DETAIL = "132 of a benchmark", "16 boulders", 2
ONE = ("--ways", "1")  # many seeds tell more than the best of two walls
UNKNOWN = float("nan")
KNOWN = {
    BENCHMARK: (
        ("StonePacking-3D, published", 108, 69.0, 0.621, 0.560, 0.52, UNKNOWN, "unchecked", "unchecked", 132.0),
        ("first version of settle", 62, 55.3, 0.643, 0.477, 0.24, UNKNOWN, "stable", "", 93.0),
    )
}


@dataclass(frozen=True)
class Stock:
    """Stones, and how a wall of them is asked for."""

    name: str
    stones: str  # folder or file
    asked: tuple[str, ...] = ()


@dataclass(frozen=True)
class Wall:
    """A wall that was laid: its file, and what `settle` told."""

    path: Path
    told: dict[str, Any]

    @property
    def figures(self) -> tuple[float, float, int]:
        """Void A, Lambda, and stones laid."""
        measures = self.told["measures"]
        return measures["void"], measures["imposition"], len(self.told["placements"])


def heads() -> str:
    """The first line of the table."""
    widths = (form.split(".")[0].rstrip("d") for form in FORMS)
    return f"{'wall':>26} " + " ".join(f"{head:>{width}}" for head, width in zip(HEADS, widths, strict=True))


def line(name: str, *values: object) -> str:
    """A line of the table; what is not known is left out."""
    told = (f"{value:>{form}}" for value, form in zip(values, FORMS, strict=True))
    return f"{name:>26} " + " ".join(" " * len(word) if word.strip() == "nan" else word for word in told)


def figures(wall: Assembly, length: float, thickness: float) -> tuple[int, float, float, float, float, float]:
    """Laid, litres, void A, void B, face and top (cm) of a wall on the first block."""
    corner, face = triangles(wall.mesh)
    body, start = wall.mesh.face_body[face], wall.mesh.vertex_start
    stones = [body_of(wall.blocks[k].vertices, corner[body == k] - start[k]) for k in range(1, len(wall))]
    told = masons_rules(stones, Faces(length, thickness))
    litres = 1e3 * sum(stone.volume for stone in stones)
    return len(stones), litres, told.void, told.void_tops, told.face, 100.0 * told.top


def measured(name: str, path: Path, seconds: float, length: float, thickness: float, most: float) -> str:
    """The line of the table for a wall in a file; coupled analysis has `most` seconds."""
    wall, _ = read_model(path)
    words = [check(wall, Settings(method=method, mu=MU, seconds=most)).verdict for method in ("rbe", "cra")]
    return line(name, *figures(wall, length, thickness), *words, seconds)


def command(*words: str) -> None:
    """Run the program; an end with an error ends the bench."""
    subprocess.run([sys.executable, "-m", "cyclopean", *words], check=True, stdout=subprocess.DEVNULL)


def benchmark(folder: str) -> Stock:
    """The stones of the published benchmark."""
    asked = ("--units", "cm", "--length", str(LENGTH), "--thickness", str(THICKNESS))
    return Stock(BENCHMARK, folder, asked)


def quarried(count: int, seed: int, keep: Path) -> Stock:
    """So many stones of the synthetic quarry."""
    path = keep / f"quarry-{count}-seed-{seed}.json"
    if not path.exists():
        what = ("--count", str(count), "--seed", str(seed), "--detail", str(DETAIL))
        command("make", "stones", *what, "--out", str(path))
    return Stock(f"{count} of the quarry, seed {seed}", str(path))


def laid(stock: Stock, share: str, keep: Path, workers: int) -> Wall:
    """The wall of a stock, of which each stone may lose a share; it is laid if it is not there."""
    name = "-".join([Path(stock.stones).stem, *(word.lstrip("-") for word in stock.asked), "dress", share])
    path, told = keep / f"{name}.json", keep / f"{name}-told.json"
    if not told.exists():
        how = ("--dress", share, "--workers", str(workers), "--out", str(path), "--json", str(told))
        command("settle", stock.stones, *stock.asked, *how)
    return Wall(path, json.loads(told.read_text(encoding="utf-8")))


def stocks(asked: argparse.Namespace) -> Iterator[tuple[Stock, tuple[str, ...]]]:
    """Stocks that are laid for the table, each with its shares of dressing."""
    if asked.stones:
        yield benchmark(asked.stones), tuple(asked.dress.split(","))
    if asked.scans:
        yield Stock(SCANS, asked.scans, ("--units", "m")), ("0",)
    for count in filter(None, asked.quarry.split(",")):
        for seed in range(asked.seeds):
            yield quarried(int(count), seed, asked.keep), ("0",)


def table(asked: argparse.Namespace) -> None:
    """Lay walls of several stocks, and print them."""
    print(heads())
    for stock, shares in stocks(asked):
        print(stock.name)
        for row in KNOWN.get(stock.name, ()):
            print(line(*row), flush=True)
        for share in shares:
            wall = laid(stock, share, asked.keep, asked.workers)
            settings, seconds = wall.told["settings"], wall.told["measures"]["seconds"]
            name = f"settle, {100 * float(share):g} % dressed" if float(share) else "settle"
            size = settings["length"], settings["thickness"]
            print(measured(name, wall.path, seconds, *size, asked.cra), flush=True)


def dressing(asked: argparse.Namespace) -> None:
    """Lay walls with every share of dressing; print void, Lambda and stones laid, and draw those of the quarry."""
    several = [[replace(quarried(int(asked.quarry), k, asked.keep), asked=ONE) for k in range(asked.seeds)]]
    several += [[benchmark(asked.stones)]] if asked.stones else []
    for k, alike in enumerate(several):
        print(f"{alike[0].name}{f' to {asked.seeds - 1}' if len(alike) > 1 else ''}: void A, Lambda, stones laid")
        rows = []
        for share in asked.dress.split(","):
            found = [laid(stock, share, asked.keep, asked.workers).figures for stock in alike]
            void, imposition, count = np.mean(found, axis=0).tolist()
            print(f"{share:>6} {void:6.3f} {imposition:7.4f} {count:6.1f}   {[n for *_, n in found]}", flush=True)
            rows += [(float(share), void, imposition) for void, imposition, _ in found]
        if not k:
            asked.svg.write_text(dressing_svg(rows) + "\n", encoding="utf-8")


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


def options(parser: argparse.ArgumentParser, quarry: str, seeds: int, dress: str) -> None:
    """What `table` and `dressing` are both told."""
    parser.add_argument("--stones", default=os.environ.get("CYCLOPEAN_BENCHMARK_STONES"), help="of the benchmark")
    parser.add_argument("--quarry", default=quarry, help="numbers of stones")
    parser.add_argument("--seeds", type=int, default=seeds)
    parser.add_argument("--dress", default=dress, help="shares")
    parser.add_argument("--workers", type=int, choices=(1, 2), default=1)
    parser.add_argument("--keep", type=Path, help="folder for the walls")


def asked_for(given: Sequence[str] | None) -> argparse.Namespace:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ways = parser.add_subparsers(dest="way", required=True)
    lay = ways.add_parser("table")
    options(lay, "40,200", 1, "0,0.03")
    lay.add_argument("--scans", default=os.environ.get("CYCLOPEAN_STONES"), help="folder of boulders, in metres")
    less = ways.add_parser("dressing")
    options(less, "40", 3, "0,0.01,0.03,0.05,0.1")
    less.add_argument("--svg", type=Path, default=Path(__file__).parents[1] / "docs" / "images" / "dressing.svg")
    told = ways.add_parser("measure")
    told.add_argument("walls", type=Path, nargs="+")
    told.add_argument("--length", type=float, default=LENGTH)
    told.add_argument("--thickness", type=float, default=THICKNESS)
    for way in (lay, told):
        way.add_argument("--cra", type=float, default=100.0, help="seconds that coupled analysis may take")
    go = ways.add_parser("simulate")
    go.add_argument("walls", type=Path, nargs="+")
    go.add_argument("--out", type=float, default=simulated.OUT, help="of a stone's size: how far a part may stand out")
    go.add_argument("--parts", type=Path, help="folder in which the parts of stones are kept from one wall to the next")
    go.add_argument("--seconds", type=float, default=3.0)
    go.add_argument("--mu", type=float, default=0.7)
    return parser.parse_args(given)


def main(given: Sequence[str] | None = None) -> None:
    asked = asked_for(given)
    if asked.way in ("table", "dressing"):
        asked.keep = asked.keep or Path(mkdtemp())
        asked.keep.mkdir(parents=True, exist_ok=True)
        (table if asked.way == "table" else dressing)(asked)
    elif asked.way == "measure":
        print(heads())
        for path in asked.walls:
            print(measured(path.stem, path, UNKNOWN, asked.length, asked.thickness, asked.cra), flush=True)
    else:
        for path in asked.walls:
            print(simulate(path, asked.mu, asked.seconds, asked.out, asked.parts), flush=True)


if __name__ == "__main__":
    main()
