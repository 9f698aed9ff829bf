"""Rigid-block equilibrium, timed: our fast path against Clarabel on the same arrays, in one run.

Run `python bench/rbe.py [--sizes 100,1000,10000] [--families wall,arch,dome] [--no-reference]`; prints one row a model:
an upright one that stands and a tilted one that falls, with the number of factorisations, both times, their ratio, the
time from blocks to a verified verdict (contacts detected anew), and the peak memory of the process so far.

One thread: set RAYON_NUM_THREADS=1 and OMP_NUM_THREADS=1 before.
"""

import argparse
import resource
from collections.abc import Callable
from time import perf_counter

import numpy as np

from cyclopean.analysis import Settings, check, solve_rbe
from cyclopean.assembly import Assembly, Block, detect, supports
from cyclopean.design import arch, dome, vault, wall
from cyclopean.statics import equilibrium_system, turned_gravity

MU = 0.7
GRAVITY = np.array([0.0, 0.0, -9.80665])


def square_wall(blocks: int) -> Assembly:
    """A running-bond wall with about as many columns as courses."""
    side = max(2, round(blocks**0.5))
    return wall(side, side)


def long_arch(blocks: int) -> Assembly:
    """An arch up to 100 voussoirs, beyond that a bonded barrel vault as wide as it needs."""
    if blocks <= 100:
        return arch(blocks, radius=1.0, thickness=0.2)
    rows = max(9, round((1.6 * blocks) ** 0.5)) | 1
    return vault(rows, max(1, round(blocks / rows)), thickness=0.2)


def round_dome(blocks: int) -> Assembly:
    """A dome with about three times as many blocks a course as courses."""
    courses = max(3, round((blocks / 3) ** 0.5))
    return dome(courses, max(6, round(blocks / courses)), thickness=0.15)


FAMILIES: dict[str, Callable[[int], Assembly]] = {"wall": square_wall, "arch": long_arch, "dome": round_dome}


def timed(work: Callable[[], object]) -> tuple[float, object]:
    began = perf_counter()
    answer = work()
    return perf_counter() - began, answer


def row(family: str, blocks: int, tilt: float, reference: bool) -> str:
    model = FAMILIES[family](blocks)
    plain = Assembly(tuple(Block(b.id, b.vertices, b.faces, fixed=b.fixed) for b in model.blocks))
    assert model.contacts is not None
    system = equilibrium_system(
        model, model.contacts.with_mu(MU), supports(model)[0], turned_gravity(GRAVITY, tilt, 30.0), 2400.0
    )
    fast, found = timed(lambda: solve_rbe(system))
    slow, other = timed(lambda: solve_rbe(system, "clarabel")) if reference else (np.nan, None)
    whole, result = timed(lambda: check(plain, Settings(method="rbe", mu=MU, tilt=(tilt, 30.0))))
    contacts, _ = timed(lambda: detect(plain))
    steps = "+".join(str(t["factorisations"]) for t in found.provenance["tried"])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    other_word = other.word if other else "-"
    solved = f"{found.word:>9} {steps:>8} {fast:>9.3f} {slow:>9.3f} {slow / fast:>6.1f} {other_word:>10}"
    proved = f"{contacts:>9.3f} {result.seconds['verify']:>8.2f} {whole:>8.2f} {result.verdict:>9} {peak:>8.0f}"
    return f"{family:>5} {len(model):>6} {tilt:>4.0f} {solved} {proved}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default="100,1000,10000")
    parser.add_argument("--families", default="wall,arch,dome")
    parser.add_argument("--tilts", default="0,40")
    parser.add_argument("--no-reference", action="store_true")
    chosen = parser.parse_args()
    check(wall(2, 2), Settings(method="rbe"))  # imports are not what is timed
    print(
        f"{'':>5} {'blocks':>6} {'tilt':>4} {'found':>9} {'factors':>8} {'fast s':>9} {'clarabel':>9} {'ratio':>6}"
        f" {'reference':>10} {'contacts':>9} {'verify s':>8} {'whole s':>8} {'verdict':>9} {'peak MB':>8}"
    )
    for blocks in (int(n) for n in chosen.sizes.split(",")):
        for family in chosen.families.split(","):
            for tilt in (float(t) for t in chosen.tilts.split(",")):
                print(row(family, blocks, tilt, not chosen.no_reference), flush=True)


if __name__ == "__main__":
    main()
