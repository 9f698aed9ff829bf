"""Stones to cells by the earlier protocol: exact Lambda at equal total gap, against the earlier method and plain ones.

Run `python bench/matching.py [--stones DIR] [--seeds 0:20] [--only 45] [--source scans] [--negotiate] [--large]`, or
`python bench/matching.py --curves docs/images/lambda-gap.svg` or `... --tradeoff docs/images/tradeoff.svg`.

Walls of 15, 24 and 100 cells (5 x 3, 6 x 4, 10 x 10 seeds; depth 0.30 m, coursing 0.5) and stones of 30 to 200 L, 45,
60 and 150 of them: stand-ins made from real scans (`--stones` or CYCLOPEAN_STONES names their folder) and a synthetic
quarry. A wall is sized so that a mean cell has the volume of a mean stone. Seed k draws both the stones and the wall.

Lambda means something only at a stated gap: each method of ours is asked for the total gap of the earlier method, and
Lambda is read off between its answers on either side of that gap. The earlier method looked at 6 stones a cell unless
told otherwise; that it looks at all of them is compared with too, at the gap it then has. Greedy and random ones take
no such wish: they are given with their own gap, and their ratio is not at equal gap. Seconds are of the processor.

`--curves` draws Lambda against the gap for one wall of 15 cells and one of 100. `--large` measures 1,100 x 300 and
10,000 x 1,000 instead, and how well the ranking recalls the pairs that are best by exact volumes. `--tradeoff` makes 24
walls between least carving and best interlock from 60 stones for 24 cells on two processes, and draws them.

One thread: set OMP_NUM_THREADS=1 before.
"""

import argparse
import os
import resource
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from matching_baselines import METHODS, Yard, measured
from matching_curves import Panel, svg, walls_svg
from stand_ins import stand_in

from cyclopean.cli.workers import beside
from cyclopean.design.matching.candidates import EXACT, POLISHED, Candidates
from cyclopean.design.matching.cells import cells_of
from cyclopean.design.matching.coarse import rank
from cyclopean.design.matching.match import Match, MatchSettings, match_stones
from cyclopean.design.matching.negotiation import negotiate
from cyclopean.design.matching.problem import Problem
from cyclopean.design.matching.tradeoff import TradeoffSettings, tradeoff
from cyclopean.design.stones.quarry import quarry
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
REFERENCES = ("earlier, 6 a cell", "earlier, all pairs")
TRADED, WALLS = 60, 24  # stones, and walls, of a trade-off
CURVED = (45, 150)  # stones of the walls whose curves are drawn
WEIGHTS = (0.15, 0.25, 0.4, 0.65, 1.0, 1.6, 2.5, 4.0, 6.5)  # of void; negotiated at every second

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


@dataclass(frozen=True)
class Answer:
    """What a method found on one wall."""

    imposition: float
    gap: float
    ratio: tuple[float, float]  # to both ways of the earlier method
    seconds: float


def one(stones: Sequence[Stone], wall: PolygonalWall, negotiated: bool) -> dict[str, Answer]:
    """Answers of every method on one wall; Lambda and gap of ours are at the gap of the first of the references."""
    cells = cells_of(wall.assembly)
    began = process_time()
    points = body_points(stones, 1024)
    ranking = rank(Problem(stones, points, cells), cells.axes, np.ones(48, bool), 2)
    prepared = process_time() - began
    yard = Yard(stones, points, cells, ranking)
    plain = {}
    for name, method in METHODS.items():
        began = process_time()
        plain[name] = (*measured(yard, method(yard)), prepared + process_time() - began)
    least = [plain[name][0] for name in REFERENCES]
    found = {name: Answer(x[0], x[1], (x[0] / least[0], x[0] / least[1]), x[2]) for name, x in plain.items()}
    ours = {"ours fixed": lambda settings: match_stones(stones, cells, settings)}
    if negotiated:
        ours["ours negotiated"] = lambda settings: negotiate(stones, wall, settings).match
    for name, answer in ours.items():
        first, second = (at_gap(answer, plain[reference][1]) for reference in REFERENCES)
        found[name] = Answer(first[0], first[1], (first[0] / least[0], second[0] / least[1]), first[2])
    return found


def compare(chosen: argparse.Namespace) -> None:
    """What every wall came to, one line each, then one table: means over the seeds, and the worst."""
    table: dict[tuple[str, str], list[Answer]] = defaultdict(list)
    for source, make in sources(chosen.stones).items():
        for count, (columns, rows) in SIZES.items():
            if chosen.only not in (None, count) or chosen.source not in (None, source):
                continue
            for seed in chosen.seeds:
                stones = make(count, seed)
                answers = one(stones, wall_for(stones, columns, rows, seed), chosen.negotiate)
                told = [f"{x.ratio[0]:.3f} {x.ratio[1]:.3f}" for name, x in answers.items() if name.startswith("ours")]
                print(f"{source} {count} x {columns * rows} seed {seed}: {', '.join(told)}", flush=True)
                for name, answer in answers.items():
                    table[f"{source} {count} x {columns * rows}", name].append(answer)
                    table["all", name].append(answer)
    six, every = ("to " + name.removeprefix("earlier, ") for name in REFERENCES)
    print(f"{'':>22} {'':>18} {'':>7} {'':>6} {six + ': mean, worst':>22} {every + ': mean, worst':>24} {'':>6}")
    print(f"{'stones x cells':>22} {'method':>18} {'Lambda':>7} {'gap':>6} {'ratio':>22} {'ratio':>24} {'s':>6}")
    for (wall, name), answers in sorted(table.items(), key=lambda row: row[0][0] == "all"):
        ratio = np.array([x.ratio for x in answers])
        mean = np.mean([(x.imposition, x.gap, x.seconds) for x in answers], axis=0)
        first, second = (f"{r.mean():.3f} {r.max():.3f}" for r in ratio.T)
        print(f"{wall:>22} {name:>18} {mean[0]:>7.4f} {mean[1]:>6.3f} {first:>22} {second:>24} {mean[2]:>6.2f}")


def seeds(text: str) -> range:
    """`A:B`, without B, or `B` for 0:B."""
    first, _, last = text.rpartition(":")
    return range(int(first or 0), int(last))


def draw_curves(chosen: argparse.Namespace) -> None:
    """Lambda against the gap, of one small wall and one larger, as SVG."""
    source, make = next((s, m) for s, m in sources(chosen.stones).items() if chosen.source in (None, s))
    panels = []
    for count in CURVED:
        columns, rows = SIZES[count]
        stones = make(count, chosen.seeds[0])
        panels.append(panel(f"{count} stones ({source}) for {columns * rows} cells", stones, columns, rows, chosen))
        for name, points in panels[-1].series.items():
            print(
                f"{panels[-1].title}: {name}: " + ", ".join(f"G {g:.3f} Lambda {x:.3f}" for g, x in points), flush=True
            )
    Path(chosen.curves).write_text(svg(panels), encoding="utf-8")


def panel(title: str, stones: Sequence[Stone], columns: int, rows: int, chosen: argparse.Namespace) -> Panel:
    """Gap and Lambda of each method on one wall, at several weights of void where it takes one."""
    wall = wall_for(stones, columns, rows, chosen.seeds[0])
    cells = cells_of(wall.assembly)
    points = body_points(stones, 1024)
    ranking = rank(Problem(stones, points, cells), cells.axes, np.ones(48, bool), 2)
    yard = Yard(stones, points, cells, ranking)
    series = {name: [measured(yard, METHODS[name](yard))[::-1]] for name in REFERENCES}
    fixed = [match_stones(stones, cells, MatchSettings(weight=w)) for w in WEIGHTS]
    moved = [negotiate(stones, wall, MatchSettings(weight=w)).match for w in WEIGHTS[::2]]
    for name, answers in (("cells as drawn", fixed), ("negotiated", moved)):
        series[name] = sorted((m.gap_of_wall, m.imposition) for m in answers)
    return Panel(title, series)


def trade(chosen: argparse.Namespace) -> None:
    """Walls between least carving and best interlock, of the middle size, as SVG."""
    source, make = next((s, m) for s, m in sources(chosen.stones).items() if chosen.source in (None, s))
    stones = make(TRADED, chosen.seeds[0])
    wall = wall_for(stones, *SIZES[TRADED], chosen.seeds[0])
    began = perf_counter()
    with beside(2) as executor:
        found = tradeoff(stones, wall, TradeoffSettings(WALLS), MatchSettings(gap=0.1, points=1024), executor)
    took = perf_counter() - began
    worked = resource.getrusage(resource.RUSAGE_CHILDREN)
    work = worked.ru_utime + worked.ru_stime
    print(f"{len(found)} walls ({source}): {took:.0f} s on two processes, {work:.0f} s of processors; not beaten:")
    for k in found.non_dominated:
        one = found.alternatives[k]
        print(f"  {k + 1}: Lambda {one.imposition:.4f} gap {one.gap:.4f} J {one.interlock:.3f} {one.asked}")
    Path(chosen.tradeoff).write_text(walls_svg(found), encoding="utf-8")


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
    problem = Problem(some, points, cells)
    ranking = rank(problem, cells.axes, np.ones(48, bool), 2)
    work = Candidates(problem, ranking)
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
    parser.add_argument("--seeds", type=seeds, default=range(20), metavar="A:B")
    parser.add_argument("--only", type=int)
    parser.add_argument("--source", choices=("scans", "quarry"))
    parser.add_argument("--negotiate", action="store_true")
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--curves", metavar="FILE")
    parser.add_argument("--tradeoff", metavar="FILE")
    chosen = parser.parse_args()
    asked = (("curves", draw_curves), ("tradeoff", trade), ("large", large), ("negotiate", compare))
    next((work for name, work in asked if getattr(chosen, name)), compare)(chosen)


if __name__ == "__main__":
    main()
