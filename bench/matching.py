"""Stones to cells by the earlier protocol: exact Lambda at equal total gap, against the earlier method and plain ones.

Run `python bench/matching.py [--stones DIR] [--seeds 20] [--only 45] [--source scans] [--negotiate] [--large]`.

Walls of 15, 24 and 100 cells (5 x 3, 6 x 4, 10 x 10 seeds; depth 0.30 m, coursing 0.5) and stones of 30 to 200 L, 45,
60 and 150 of them: stand-ins made from real scans (`--stones` or CYCLOPEAN_STONES names their folder) and a synthetic
quarry. A wall is sized so that a mean cell has the volume of a mean stone. Seed k draws both the stones and the wall.

Lambda means something only at a stated gap: each method of ours is asked for the total gap of the earlier method, and
Lambda is read off between its answers on either side of that gap. Greedy and random ones take no such wish: they are
given with their own gap. Seconds are of the processor. `--large` measures 1,100 x 300 and 10,000 x 1,000 instead, and
how well the ranking recalls the pairs that are best by exact volumes.

One thread: set OMP_NUM_THREADS=1 before.
"""

import argparse
import os
import resource
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from matching_baselines import METHODS, Yard, measured

from cyclopean.design.matching.candidates import EXACT, POLISHED, Candidates
from cyclopean.design.matching.cells import cells_of
from cyclopean.design.matching.coarse import rank
from cyclopean.design.matching.match import Match, MatchSettings, match_stones
from cyclopean.design.matching.negotiation import negotiate
from cyclopean.design.stones.quarry import quarry, stand_in
from cyclopean.design.stones.sampling import body_points
from cyclopean.design.stones.stone import Stone
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import PolygonalWall, polygonal_wall
from cyclopean.io.stones import read_stones

SIZES = {45: (5, 3), 60: (6, 4), 150: (10, 10)}
LARGE = {1100: (20, 15), 10000: (40, 25)}
DEPTH, COURSING = 0.30, 0.5
LIGHTER = 0.9  # the answer on the other side of the gap is sought at a weight this much lower, again and again
LIGHTENINGS = 4

Source = Callable[[int, int], Sequence[Stone]]


def wall_for(stones: Sequence[Stone], columns: int, rows: int, seed: int) -> PolygonalWall:
    """A wall twice as long as high whose mean cell has the volume of the mean stone."""
    area = float(np.mean([s.volume for s in stones])) * columns * rows / DEPTH
    width = float(np.sqrt(2.0 * area))
    pattern = PatternSettings(
        width=width,
        height=area / width,
        columns=columns,
        rows=rows,
        courses=rows,
        coursing=COURSING,
        seed=seed,
    )
    return polygonal_wall(pattern, depth=DEPTH)


def sources(folder: str | None) -> dict[str, Source]:
    """Where stones come from: of a number and a seed."""
    found: dict[str, Source] = {"quarry": quarry}
    if folder:
        scans, _ = read_stones(Path(folder), units="m")
        found["scans"] = lambda count, seed: stand_in(scans.stones, count, seed)
    return found


def at_gap(answer: Callable[[MatchSettings], Match], gap: float) -> tuple[float, float, float]:
    """Lambda at a total gap, between the answers on either side of it; the gap of the fuller answer; seconds of it."""
    began = process_time()
    full = answer(MatchSettings(gap=gap))
    seconds = process_time() - began
    lighter, weight = full, full.weight
    for _ in range(LIGHTENINGS):
        if lighter.gap_of_wall > gap:
            break
        weight *= LIGHTER
        lighter = answer(MatchSettings(weight=weight))
    low, high = sorted((m.gap_of_wall, m.imposition) for m in (full, lighter))
    if not low[0] <= gap <= high[0]:
        return full.imposition, full.gap_of_wall, seconds
    return float(np.interp(gap, [low[0], high[0]], [low[1], high[1]])), full.gap_of_wall, seconds


def one(stones: Sequence[Stone], wall: PolygonalWall, negotiated: bool) -> dict[str, tuple[float, float, float]]:
    """Lambda, gap and seconds of every method on one wall."""
    cells = cells_of(wall.assembly)
    began = process_time()
    points = body_points(stones, 1024)
    ranking = rank(points, np.array([s.volume for s in stones]), cells, cells.axes, np.ones(48, bool), 2)
    prepared = process_time() - began
    yard = Yard(stones, points, cells, ranking)
    found = {}
    for name, method in METHODS.items():
        began = process_time()
        placed = method(yard)
        found[name] = (*measured(yard, placed), prepared + process_time() - began)
    gap = found["earlier"][1]
    found["ours fixed"] = at_gap(lambda settings: match_stones(stones, cells, settings), gap)
    if negotiated:
        found["ours negotiated"] = at_gap(lambda settings: negotiate(stones, wall, settings).match, gap)
    return found


def compare(chosen: argparse.Namespace) -> None:
    """One table: Lambda, gap and ratio to the earlier method, by means over the seeds."""
    print(
        f"{'stones x cells':>22} {'method':>17} {'Lambda':>7} {'gap':>6} {'ratio':>6} {'least':>6} {'most':>6} {'s':>6}"
    )
    overall = defaultdict(list)
    for source, make in sources(chosen.stones).items():
        for count, (columns, rows) in SIZES.items():
            if chosen.only not in (None, count) or chosen.source not in (None, source):
                continue
            rows_of = defaultdict(list)
            for seed in range(chosen.seeds):
                stones = make(count, seed)
                answers = one(stones, wall_for(stones, columns, rows, seed), chosen.negotiate)
                for name, (imposition, gap, seconds) in answers.items():
                    rows_of[name].append((imposition, gap, imposition / answers["earlier"][0], seconds))
            for name, row in rows_of.items():
                table = np.array(row)
                imposition, gap, ratio, seconds = table.mean(axis=0)
                overall[name] += table[:, 2].tolist()
                print(
                    f"{f'{source} {count} x {columns * rows}':>22} {name:>17} {imposition:>7.4f} {gap:>6.3f}"
                    f" {ratio:>6.3f} {table[:, 2].min():>6.3f} {table[:, 2].max():>6.3f} {seconds:>6.2f}",
                    flush=True,
                )
    for name, ratio in overall.items():
        print(f"{'all':>22} {name:>17} ratio {np.mean(ratio):.3f}, {min(ratio):.3f} to {max(ratio):.3f}")


def large(chosen: argparse.Namespace) -> None:
    """Seconds, memory and recall where there are many."""
    for count, (columns, rows) in LARGE.items():
        if chosen.only not in (None, count):
            continue
        make = sources(chosen.stones).get(chosen.source or "quarry", quarry)
        stones = make(count, 0)
        wall = wall_for(stones, columns, rows, 3)
        cells = cells_of(wall.assembly)
        began, work = perf_counter(), process_time()
        match = match_stones(stones, cells, MatchSettings())
        took, work = perf_counter() - began, process_time() - work
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        parts = ", ".join(f"{name} {seconds:.2f}" for name, seconds in match.seconds.items() if name != "total")
        print(
            f"{count} x {len(cells)}: Lambda {match.imposition:.4f} gap {match.gap_of_wall:.4f} in {took:.1f} s,"
            f" {work:.1f} s of one processor"
            f" ({parts}), {memory:.2f} GB at most",
            flush=True,
        )
        recall(stones, cells, min(count, 400), min(len(cells), 10))


def recall(stones: Sequence[Stone], cells, among: int, asked: int) -> None:
    """Of the pairs that are best in a cell by exact volumes, how many are among the first k by rank."""
    some, points = stones[:among], body_points(stones[:among], 1024)
    volume = np.array([s.volume for s in some])
    ranking = rank(points, volume, cells, cells.axes, np.ones(48, bool), 2)
    work = Candidates(some, points, cells, ranking, cells.axes)
    place = np.linspace(0, len(cells) - 1, asked).astype(int)
    stone, cell = (x.ravel() for x in np.meshgrid(np.arange(among), place, indexing="ij"))
    work.improve(stone, cell, POLISHED)
    work.improve(stone, cell, EXACT)
    cost, seen = volume[:, None] - 2.0 * work.value[:, place], volume[:, None] - 2.0 * ranking.shared[:, place]
    order, true = np.argsort(seen, axis=0, kind="stable"), np.argsort(cost, axis=0, kind="stable")
    for first in (1, 5):
        for most in (5, 12, 24):
            hits = np.mean([np.isin(true[:first, j], order[:most, j]).mean() for j in range(asked)])
            print(f"  the best {first} of {among} by exact volumes are among the first {most} by rank: {hits:.3f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stones", default=os.environ.get("CYCLOPEAN_STONES"))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--only", type=int)
    parser.add_argument("--source", choices=("scans", "quarry"))
    parser.add_argument("--negotiate", action="store_true")
    parser.add_argument("--large", action="store_true")
    chosen = parser.parse_args()
    (large if chosen.large else compare)(chosen)


if __name__ == "__main__":
    main()
