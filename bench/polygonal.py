"""Generated walls and what coupled analysis says of them: flat, curved, pierced, coursing 0 to 1, 15 to 2,000 stones.

Run `python bench/polygonal.py [--only door] [--seconds 60] [--large] [--seed 7] [--save DIR]`; prints one row a wall:
stones, contacts, points, joints that are not flat, processor seconds to draw and to check (verification included), the
verdict and the route that found it; then how many of the walls got which verdict, and which stay undecided. `--large`
adds walls of 150, 300, 1,000 and 2,000 stones: flat with coursing 0, 0.4 and 1, a cylinder, a sphere, a door. `--seed`
draws all of them with another seed; `--save` writes the models that stay undecided.

Budgets count work; `--seconds` only stops a search, and a busy machine needs more of them.

One thread: set RAYON_NUM_THREADS=1 and OMP_NUM_THREADS=1 before.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from cyclopean.analysis import Settings, check
from cyclopean.design.walls.dressing import Coping, Quoins
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cone, Cylinder, Free, Ruled, Sphere
from cyclopean.io import write_model

SMALL = ((5, 3), (12, 8))  # columns and rows
LARGE = ((17, 9), (25, 12), (40, 25), (56, 36))
Case = tuple[str, dict[str, Any], Any]
DOOR = (Opening(1.1, 0.8, 1.15),)
ARCH = (Opening(1.0, 0.9, 1.25, 0.0, "arch"),)
WINDOWS = (Opening(0.5, 0.5, 0.6, 0.6), Opening(1.9, 0.5, 0.6, 0.6, "arch"))


def twisted(u: np.ndarray) -> tuple[Any, ...]:
    """Top edge of a wall that is turned by 10 degrees from foot to top."""
    turn = np.radians(10.0)
    return 1.5 + (u - 1.5) * np.cos(turn), (u - 1.5) * np.sin(turn), 1.8


SURFACES = {
    "cylinder 4": Cylinder(4.0, 1.5),
    "hollow 4": Cylinder(-4.0, 1.5),
    "cylinder 8": Cylinder(8.0, 1.5),
    "cone 4, 8 deg": Cone(4.0, 8.0, 1.5),
    "sphere 6": Sphere(6.0, 0.0, 1.5),
    "hollow sphere 9": Sphere(-9.0, 0.0, 1.5),
    "twist 10 deg": Ruled(lambda u: (u, 0.0, 0.0), twisted, 3.0, 1.8),
    "wavy": Free(lambda u, v: (u, 0.08 * np.sin(2.0 * u) * np.cos(v), v), 3.0, 1.8),
}


def sized(columns: int, rows: int) -> dict[str, Any]:
    """A wall of stones as large as those of the default, and as many courses as rows."""
    return {"columns": columns, "rows": rows, "courses": rows, "width": 0.375 * columns, "height": 0.36 * rows}


def cases(large: bool) -> Iterator[Case]:
    """Name, pattern and surface of every wall."""
    yield "default", {}, None
    for seed in range(6):
        yield f"seed {seed}", {"seed": seed}, None
    for coursing in (0.0, 0.25, 0.5, 0.75, 1.0):
        yield f"coursing {coursing:g}", {"coursing": coursing}, None
    for name, surface in SURFACES.items():
        for coursing in (0.4, 1.0):
            yield f"{name}, c {coursing:g}", {"coursing": coursing}, surface
    for name, openings in (("door", DOOR), ("arch", ARCH), ("windows", WINDOWS)):
        yield name, {"openings": openings}, None
        for kind in ("cylinder 8", "sphere 6"):
            yield f"{name}, {kind}", {"openings": openings}, SURFACES[kind]
    yield "quoins and coping", {"quoins": Quoins(), "coping": Coping()}, None
    yield "all, cylinder 8", {"quoins": Quoins(), "coping": Coping(), "openings": ARCH}, SURFACES["cylinder 8"]
    yield "hill", {"base_radius": 6.0}, None
    yield "slope", {"base": ((0.0, 0.0), (3.0, 0.5))}, None
    for columns, rows in (*SMALL, *(LARGE if large else ())):
        for coursing in (0.0, 0.4, 1.0):
            size = sized(columns, rows)
            yield f"{columns} x {rows}, c {coursing:g}", {**size, "coursing": coursing}, None
        width, height = size["width"], size["height"]
        yield f"{columns} x {rows}, curved", size, Cylinder(1.5 * width, width / 2.0)
        if (columns, rows) in LARGE:
            yield f"{columns} x {rows}, sphere", size, Sphere(2.0 * width, 0.0, width / 2.0)
            door = (Opening(0.4 * width, 0.12 * width, 0.5 * height),)
            yield f"{columns} x {rows}, door", {**size, "openings": door}, None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--save", type=Path)
    chosen = parser.parse_args()
    check(polygonal_wall(PatternSettings(columns=3, rows=2)).assembly, Settings(method="cra"))  # imports are not timed
    print(
        f"{'wall':>22} {'stones':>6} {'contacts':>8} {'points':>6} {'warped':>6} {'folded':>6} {'off mm':>6} |"
        f" {'draw s':>6} {'check s':>7} {'verdict':>9} {'route':>12}"
    )
    verdicts: Counter[str] = Counter()
    open_: list[str] = []
    for name, options, surface in cases(chosen.large):
        if chosen.only not in name:
            continue
        if chosen.seed is not None:
            options = {**options, "seed": chosen.seed + options.get("seed", 0)}
        began = process_time()
        made = polygonal_wall(PatternSettings(**options), surface=surface)
        drawn = process_time()
        result = check(made.assembly, Settings(method="cra", seconds=chosen.seconds))
        ended = process_time()
        contacts, joints = made.assembly.contacts, made.joints
        verdict = result.verdict
        verdicts[verdict] += 1
        if verdict == "undecided":
            open_.append(name)
        print(
            f"{name:>22} {len(made.assembly) - 1:>6} {len(contacts):>8} {len(contacts.point):>6} {joints.warped:>6}"
            f" {joints.folded:>6} {1e3 * joints.deviation:>6.2f} | {drawn - began:>6.2f} {ended - drawn:>7.2f}"
            f" {verdict:>9} {result.provenance.get('route', ''):>12}",
            flush=True,
        )
        if verdict == "undecided" and chosen.save:
            write_model(chosen.save / f"{name.replace(' ', '-').replace(',', '')}.json", made.assembly)
    print(", ".join(f"{count} {verdict}" for verdict, count in verdicts.most_common()))
    if open_:
        print("undecided:", "; ".join(open_))


if __name__ == "__main__":
    main()
