"""The hardest questions we know, by coupled analysis: an H frame whose columns stand free on the ground, and shelves.

Run `python bench/hard.py [--seconds 60] [--shelves] [--seed 7]`; prints one row a case: points, eta / eps, mu, verdict,
route, nodes, seconds, and the merit of the best triple where nothing was proved. `--shelves` adds those of compas_cra's
own cases (CYCLOPEAN_FIXTURES): one walk from random starts of another seed, then all with eta = 10 and 100 eps.
"""

import argparse
import os
from pathlib import Path
from time import perf_counter

import numpy as np

from cyclopean.analysis import Settings, check
from cyclopean.analysis.coupled.alternation import alternation
from cyclopean.analysis.preparation import prepare
from cyclopean.assembly import Assembly, Block
from cyclopean.io import read_model

FOLDER = Path(os.environ.get("CYCLOPEAN_FIXTURES", "../shared/fixtures")) / "compas_cra"
SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def box(name: str, low: tuple[float, ...], high: tuple[float, ...], fixed: bool = False) -> Block:
    """An upright box."""
    (x, y, z), (X, Y, Z) = low, high
    corners = [[x, y, z], [X, y, z], [X, Y, z], [x, Y, z], [x, y, Z], [X, y, Z], [X, Y, Z], [x, Y, Z]]
    return Block(name, np.array(corners, float), SIDES, fixed=fixed)


def free_frame() -> Assembly:
    """A beam squeezed at mid-height between two columns that stand free on fixed ground."""
    return Assembly(
        (
            box("ground", (-1.5, -0.5, -0.2), (1.5, 0.9, 0.0), fixed=True),
            box("left", (-1.1, 0.0, 0.0), (-0.3, 0.4, 1.2)),
            box("right", (0.3, 0.0, 0.0), (1.1, 0.4, 1.2)),
            box("beam", (-0.3, 0.0, 0.45), (0.3, 0.4, 0.75)),
        ),
        name="free H",
    )


def row(name: str, model: Assembly, settings: Settings) -> str:
    began = perf_counter()
    result = check(model, settings)
    took, found = perf_counter() - began, result.provenance
    merit = f"merit {result.residuals['merit']:.2g}" if result.verdict == "undecided" else ""
    mu = "" if settings.mu is None else f"{settings.mu:g}"
    counts = f"{4 * len(result.contacts):>6} {settings.eta:>5g} {mu:>5}"
    route, nodes = found.get("route", ""), found.get("nodes", 0)
    return f"{name:>14} {counts} {result.verdict:>10} {route:>12} {nodes:>6} {took:>7.1f} {merit}"


def hopped(name: str, model: Assembly, seed: int, seconds: float) -> str:
    """One walk from random starts of this seed."""
    settings = Settings(eta=100.0)
    posed = prepare(model, settings)
    system = posed.system()
    began = perf_counter()
    found = alternation(system, settings.bounds(), budget=1_000_000, deadline=began + seconds, seed=seed)
    word = f"a state, worst residual {found.residuals.worst:.0e}" if found.found else "none"
    counts = f"{found.solves} programmes, {perf_counter() - began:.0f} s"
    return f"{name:>14} seed {seed}: {word}, merit {found.merit:.2g}, {counts}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--shelves", action="store_true")
    parser.add_argument("--seed", type=int, default=7)
    chosen = parser.parse_args()
    print(f"{'case':>14} points   eta    mu    verdict        route  nodes       s")
    for mu, eta in ((0.84, 12.0), (0.7, 20.0), (0.3, 10.0), (0.4, 10.0), (0.84, 10.0), (0.7, 10.0)):
        print(row("free H", free_frame(), Settings(mu=mu, eta=eta, seconds=chosen.seconds)), flush=True)
    if not chosen.shelves:
        return
    names = ("07_shelf-s1", "07_shelf-s3", "07_shelf")
    models = {name: read_model(FOLDER / f"{name}.json")[0] for name in names}
    print(hopped("07_shelf", models["07_shelf"], chosen.seed, 400.0), flush=True)
    for name in names:
        for eta in (10.0, 100.0):
            print(row(name, models[name], Settings(eta=eta, seconds=chosen.seconds)), flush=True)


if __name__ == "__main__":
    main()
