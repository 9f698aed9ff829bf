"""Contact detection, timed: running-bond walls on a slab, and the checking of the same contacts as if given.

Run `python bench/contacts.py [courses ...]`; prints one row a wall.
"""

import sys
from itertools import pairwise
from time import perf_counter

import numpy as np

from cyclopean.assembly import Assembly, Block, check_contacts, detect

SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def box(name: str, low: tuple[float, float, float], high: tuple[float, float, float]) -> Block:
    """An upright box."""
    (x, y, z), (X, Y, Z) = low, high
    corners = [[x, y, z], [X, y, z], [X, Y, z], [x, Y, z], [x, y, Z], [X, y, Z], [X, Y, Z], [x, Y, Z]]
    return Block(name, np.array(corners, float), SIDES)


def wall(columns: int, courses: int) -> Assembly:
    """Running bond of blocks 2 x 1 x 1 on a slab; odd courses start and end with half blocks."""
    blocks = [box("slab", (0, 0, -1), (2 * columns, 1, 0))]
    for course in range(courses):
        cuts = [0, *range(1, 2 * columns, 2), 2 * columns] if course % 2 else list(range(0, 2 * columns + 1, 2))
        for k, (x, X) in enumerate(pairwise(cuts)):
            blocks.append(box(f"b{course}.{k}", (x, 0, course), (X, 1, course + 1)))
    return Assembly(tuple(blocks))


def best(work, repeats: int = 3) -> tuple[float, object]:
    """Least time of a few runs (s), and what came out."""
    times, answer = [], None
    for _ in range(repeats):
        began = perf_counter()
        answer = work()
        times.append(perf_counter() - began)
    return min(times), answer


def main() -> None:
    import scipy.sparse.csgraph  # noqa: F401  imports are not what is timed
    import scipy.spatial  # noqa: F401
    import shapely  # noqa: F401

    print(f"{'wall':>10} {'blocks':>7} {'contacts':>9} {'detect s':>9} {'check s':>8}")
    for side in [int(s) for s in sys.argv[1:]] or [3, 5, 8, 10, 15, 20, 100]:
        model = wall(side, side)
        seconds, found = best(lambda model=model: detect(model))
        again, _ = best(lambda model=model, found=found: check_contacts(model, found.contacts))
        print(f"{side:>4} x {side:<3} {len(model):>7} {len(found.contacts):>9} {seconds:>9.3f} {again:>8.3f}")


if __name__ == "__main__":
    main()
