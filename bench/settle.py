"""Rubble walls: look-ahead against input order, and how long it takes.

Run `python bench/settle.py [--stones DIR] [--only scans,200,1000] [--look-ahead 8] [--lean 4] [--detail 2]
[--workers 2] [--seeds 10]`.

Inventories: real scans (`--stones` or CYCLOPEAN_STONES names their folder), and 200 and 1,000 stones of the synthetic
quarry. For each, one line with a look-ahead and one in the order of the inventory: stones laid, their share of all,
void between the faces and below the stones' own tops, height, what `check` says by rigid-block equilibrium, seconds of
the laying, and the largest volume that two blocks share, by exact solids, over that of the smaller one. With --seeds
also how many of so many walls of 40 quarry stones stand by rigid-block equilibrium, and how many by coupled analysis.

With two workers a second process lays half of each long wall; `of one core` is what this process alone has worked, and
`pace` what a million turns of an empty loop take it (s), before and after: other jobs on the machine show there. One
thread each: set OMP_NUM_THREADS=1 before.
"""

import argparse
import os
from pathlib import Path
from time import perf_counter, process_time

from cyclopean.analysis import Settings, check
from cyclopean.cli.workers import beside
from cyclopean.design.rubble.settle import RubbleWall, SettleSettings, settle
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.quarry import quarry
from cyclopean.io.stones import read_stones

HEAD = f"{'stones':>8} {'ahead':>5} {'laid':>5} {'share':>6} {'void':>6} {'tops':>6} {'height':>7} {'check':>9}"


def inventory(name: str, folder: str | None, detail: int) -> Inventory | None:
    """Stones by name: a number of the quarry's, or the scans; None where there are none."""
    if name != "scans":
        return Inventory(quarry(int(name), 0, detail=detail))
    return read_stones(Path(folder), "m")[0] if folder else None


def verdict(wall: RubbleWall, method: str) -> str:
    """What `check` says."""
    return check(wall.assembly, Settings(method=method, seconds=20.0)).verdict


def pace() -> float:
    """Seconds that a million turns of an empty loop take."""
    began = perf_counter()
    for _ in range(1_000_000):
        pass
    return perf_counter() - began


def stand(seeds: int, detail: int) -> None:
    """Walls of 40 quarry stones, one a seed."""
    words = []
    for seed in range(seeds):
        wall = settle(Inventory(quarry(40, seed, detail=detail)))
        words.append((len(wall.laid), verdict(wall, "rbe"), verdict(wall, "cra")))
        print(f"seed {seed}: {words[-1][0]} of 40 laid; rbe {words[-1][1]}, cra {words[-1][2]}", flush=True)
    by = [sum(row[k] == "stable" for row in words) for k in (1, 2)]
    print(f"{by[0]} of {seeds} stand by rigid-block equilibrium, {by[1]} by coupled analysis")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stones", default=os.environ.get("CYCLOPEAN_STONES"))
    parser.add_argument("--only", default="scans,200,1000")
    parser.add_argument("--look-ahead", type=int, default=8)
    parser.add_argument("--detail", type=int, default=2)
    parser.add_argument("--lean", type=float, default=SettleSettings().lean, help="degrees by which gravity may lean")
    parser.add_argument("--pins", action="store_true")
    parser.add_argument("--workers", type=int, choices=(1, 2), default=2)
    parser.add_argument("--seeds", type=int, default=0)
    asked = parser.parse_args()
    print(f"{HEAD} {'seconds':>8} {'of one core':>11} {'overlap':>8} pace")
    for name in asked.only.split(","):
        stones = inventory(name, asked.stones, asked.detail)
        if stones is None:
            continue
        for ahead in (asked.look_ahead, 0):
            settings = SettleSettings(look_ahead=ahead, lean=asked.lean, pins=asked.pins)
            before, began, worked = pace(), perf_counter(), process_time()
            with beside(asked.workers - 1) as executor:
                wall = settle(stones, settings, None, executor)
            seconds, core = perf_counter() - began, process_time() - worked
            m = wall.measures
            print(
                f"{name:>8} {ahead:5d} {len(wall.laid):5d} {len(wall.laid) / len(stones):6.1%} {m.void:6.1%}"
                f" {m.void_tops:6.1%} {m.height:6.2f}m {verdict(wall, 'rbe'):>9} {seconds:8.1f}"
                f" {core:11.1f} {m.overlap:8.1e} {before:.3f} {pace():.3f}",
                flush=True,
            )
    if asked.seeds:
        stand(asked.seeds, asked.detail)


if __name__ == "__main__":
    main()
