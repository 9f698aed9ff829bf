"""Limit analysis, timed and checked: both bounds of walls, vaults and domes; and random models, each proved exactly.

Run `python bench/limit.py [--sizes 100,1000,10000] [--families wall,vault,dome] [--push x,y] [--seconds S]
[--reference]` for one row a model and direction of push: both bounds, their gap, factorisations, seconds of solving and
of the exact check, then processor seconds of all of it, and Clarabel's where asked for; or
`python bench/limit.py --random 1000` for as many random assemblies pushed in a random direction: how many are bounded
within 1e-6 on both sides by a certificate that the exact checker has passed, and what became of the others.

One thread: set RAYON_NUM_THREADS=1 and OMP_NUM_THREADS=1 before.
"""

import argparse
from collections import Counter
from collections.abc import Callable
from time import perf_counter, process_time

import numpy as np

from cyclopean.analysis import Live, Settings, limit
from cyclopean.assembly import Assembly
from cyclopean.design import arch, dome, stack, vault, wall

MU = 0.7


def square_wall(blocks: int) -> Assembly:
    """A running-bond wall with about as many columns as courses."""
    side = max(2, round(blocks**0.5))
    return wall(side, side)


def long_vault(blocks: int) -> Assembly:
    """A bonded barrel vault as wide as it needs."""
    rows = max(9, round((1.6 * blocks) ** 0.5)) | 1
    return vault(rows, max(1, round(blocks / rows)), thickness=0.2)


def round_dome(blocks: int) -> Assembly:
    """A dome with about three times as many blocks a course as courses."""
    courses = max(3, round((blocks / 3) ** 0.5))
    return dome(courses, max(6, round(blocks / courses)), thickness=0.15)


FAMILIES: dict[str, Callable[[int], Assembly]] = {"wall": square_wall, "vault": long_vault, "dome": round_dome}


def random_assembly(rng: np.random.Generator) -> Assembly:
    """One of five families with random proportions."""
    kind = int(rng.integers(5))
    if kind == 0:
        size = rng.uniform(0.5, 1.5, 3)
        count = int(rng.integers(1, 7))
        return stack(count, size=tuple(size), offset=float(rng.uniform(-0.3, 0.3) * size[0] / count))
    if kind == 1:
        columns, courses = (int(n) for n in rng.integers(2, 5, 2))
        return wall(columns, courses, length=float(rng.uniform(0.3, 0.6)), depth=float(rng.uniform(0.15, 0.4)))
    if kind == 2:
        return arch(int(rng.integers(3, 12)), radius=1.0, thickness=float(rng.uniform(0.1, 0.35)))
    if kind == 3:
        return vault(int(rng.integers(5, 10)), int(rng.integers(1, 4)), thickness=float(rng.uniform(0.15, 0.4)))
    return dome(int(rng.integers(2, 5)), int(rng.integers(6, 10)), thickness=float(rng.uniform(0.08, 0.3)))


def row(family: str, blocks: int, push: tuple[float, float, float], solver: str, seconds: float | None) -> str:
    """One model by one solver."""
    model = FAMILIES[family](blocks)
    worked = process_time()
    found = limit(model, Live(push=push), Settings(mu=MU), solver=solver, seconds=seconds)
    worked = process_time() - worked
    low = float("nan") if found.lower is None else found.lower
    high = float("nan") if found.upper is None else found.upper
    times = f"{found.seconds['solve']:>8.2f} {found.seconds['verify']:>8.2f} {worked:>8.2f}"
    steps = "+".join(str(t["factorisations"]) for t in found.provenance["tried"])
    heading = "x" if push[0] else "y"
    return (
        f"{family:>5} {len(model):>6} {heading:>2} {solver:>9} {found.word:>9} {low:>12.8f} {high:>12.8f}"
        f" {found.gap:>8.1e} {steps:>14} {times}"
    )


def random_cases(count: int) -> None:
    """Bounds of random models, each verified exactly by `limit` itself."""
    words: Counter[str] = Counter()
    worst, began = 0.0, perf_counter()
    for seed in range(count):
        rng = np.random.default_rng(seed)
        model, mu, heading = random_assembly(rng), float(rng.uniform(0.3, 1.0)), rng.uniform(0, 2 * np.pi)
        found = limit(model, Live(push=(float(np.cos(heading)), float(np.sin(heading)), 0.0)), Settings(mu=mu))
        closed = found.word == "limit" and found.gap <= 1e-6
        words["bounded within 1e-6 and proved" if closed else found.word] += 1
        worst = max(worst, found.gap) if closed else worst
        if found.word == "undecided" or (found.word == "limit" and not closed):
            print(f"seed {seed}: {model.name}, {found.word}, gap {found.gap:.1e}", flush=True)
    told = ", ".join(f"{number} {word}" for word, number in words.most_common())
    print(f"{count} random models in {perf_counter() - began:.0f} s: {told}; widest gap {worst:.1e}")


def main() -> None:
    """Print the table, or the count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default="100,1000,10000")
    parser.add_argument("--families", default="wall,vault,dome")
    parser.add_argument("--push", default="x,y")
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--reference", action="store_true")
    parser.add_argument("--random", type=int, default=0)
    chosen = parser.parse_args()
    limit(wall(2, 2), Live(push=(1, 0, 0)))  # imports are not what is timed
    if chosen.random:
        random_cases(chosen.random)
        return
    print(
        f"{'':>5} {'blocks':>6} {'to':>2} {'solver':>9} {'found':>9} {'lower':>12} {'upper':>12} {'gap':>8}"
        f" {'factors':>14} {'solve s':>8} {'verify s':>8} {'cpu s':>8}"
    )
    for blocks in (int(n) for n in chosen.sizes.split(",")):
        for family in chosen.families.split(","):
            for heading in chosen.push.split(","):
                push = (float(heading == "x"), float(heading == "y"), 0.0)
                print(row(family, blocks, push, "auto", chosen.seconds), flush=True)
                if chosen.reference:
                    print(row(family, blocks, push, "clarabel", chosen.seconds), flush=True)


if __name__ == "__main__":
    main()
