"""The time it takes to sequence structures with every stage checked: walls of 300 stones, an arch, a vault.

Run `python bench/sequence.py [--only polygonal]`; prints one row a structure: free stones, stages, how many of them
were certified stable and how many of these began from the state of the stage before, stages with props, most props,
seconds in all and processor seconds, one process.

One thread: set RAYON_NUM_THREADS=1 and OMP_NUM_THREADS=1 before.
"""

import argparse
from collections.abc import Callable, Iterator
from itertools import pairwise
from time import perf_counter, process_time

import numpy as np

from cyclopean.assembly import Assembly, Block
from cyclopean.design import stack, vault, wall
from cyclopean.design.construction.sequence import build_sequence
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cylinder

WIDTH, HEIGHT = 9.4, 4.3
SIZE = PatternSettings(columns=25, rows=12, courses=12, width=WIDTH, height=HEIGHT)


def four_legs(r: float = 4.0, R: float = 5.0, voussoirs: int = 5) -> Assembly:
    """Two semicircular arches that cross in one keystone, so many voussoirs on each of four legs."""
    top = np.radians(10.0)
    angle = np.append(np.linspace(np.pi / 2.0, top, voussoirs + 1)[::-1], np.pi / 2.0 + 0.1)[::-1]
    half = r * np.sin(top)
    stones = []
    for turn in range(4):
        c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][turn]
        for k, (start, end) in enumerate(pairwise(angle)):
            ring = [(rad * np.sin(t), rad * np.cos(t)) for rad, t in ((r, end), (r, start), (R, start), (R, end))]
            flat = np.array([(x, y, z) for y in (-half, half) for x, z in ring])
            sides = tuple((i, 4 + i, 4 + (i + 1) % 4, (i + 1) % 4) for i in range(4))
            vertices = flat @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
            stones.append(Block(f"leg{turn}-{k}", vertices, ((0, 1, 2, 3), (7, 6, 5, 4), *sides), fixed=k == 0))
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    rings = [[(x * k * np.sin(top), y * k * np.sin(top), k * np.cos(top)) for x, y in corners] for k in (r, R)]
    faces = ((3, 2, 1, 0), (4, 5, 6, 7), *((i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i) for i in range(4)))
    return Assembly((*stones, Block("key", np.array(rings[0] + rings[1]), faces)), name="four-legged arch")


def cases() -> Iterator[tuple[str, Callable[[], Assembly]]]:
    """Name and model of each."""
    yield "running bond", lambda: wall(25, 12)
    yield "polygonal, flat", lambda: polygonal_wall(SIZE).assembly
    curved = Cylinder(1.5 * WIDTH, WIDTH / 2.0)
    yield "polygonal, curved", lambda: polygonal_wall(SIZE, surface=curved).assembly
    yield "arch of four legs", four_legs
    yield "vault(8, 5)", lambda: vault(8, 5)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="")
    chosen = parser.parse_args()
    build_sequence(stack(2))  # imports are not timed
    names = ("stones", "stages", "stable", "known", "props")
    print(f"{'structure':>18} {' '.join(f'{name:>6}' for name in names)} most       s cpu s")
    for name, model in cases():
        if chosen.only not in name:
            continue
        assembly = model()
        began, used = perf_counter(), process_time()
        steps = build_sequence(assembly).steps
        took, spent = perf_counter() - began, process_time() - used
        stable, warm = sum(s.verdict == "stable" for s in steps), sum(s.warm for s in steps)
        held = [len(s.props) for s in steps if s.props]
        print(
            f"{name:>18} {len(steps):>6} {len(steps):>6} {stable:>6} {warm:>6} {len(held):>6} {max(held, default=0):>4}"
            f" {took:>7.1f} {spent:>5.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
