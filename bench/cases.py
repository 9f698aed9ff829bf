"""Every one of compas_cra's own cases, by coupled analysis: verdict, route and effort, as a table in Markdown.

Run `python bench/cases.py [--seconds 60]` with CYCLOPEAN_FIXTURES naming the folder above `compas_cra`. Wedges turned
by 90 degrees and shelves are taken with eta = 100 eps as there, all others with 10. *Worst* is the largest residual of
a state, over every equation and every point; *merit* is what the best triple misses where nothing was proved.
"""

import argparse
import os
from pathlib import Path
from time import perf_counter

from cyclopean.analysis import Settings, check
from cyclopean.io import read_model

FOLDER = Path(os.environ.get("CYCLOPEAN_FIXTURES", "../shared/fixtures")) / "compas_cra"
WIDE = ("07_shelf", "05_wedge_type-a_y90", "05_wedge_type-b_y90", "05_wedge_type-c_y90", "05_wedge_type-d_y90")


def row(path: Path, seconds: float) -> str:
    model, _ = read_model(path)
    eta = 100.0 if path.stem.startswith(WIDE) else 10.0
    began = perf_counter()
    result = check(model, Settings(method="cra", eta=eta, seconds=seconds))
    took = perf_counter() - began
    found = result.provenance
    figure = {
        "stable": lambda: f"worst {max(result.residuals.values()):.0e}",
        "unstable": lambda: result.certificate["kind"],
        "undecided": lambda: f"merit {result.residuals.get('merit', float('nan')):.1e}",
    }[result.verdict]()
    counts = f"{found.get('solves', '')} | {found.get('nodes', '')}"
    route = found.get("route") or "-"
    return f"| {path.stem} | {eta:g} | {result.verdict} | {route} | {counts} | {took:.2f} | {figure} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    chosen = parser.parse_args()
    print(
        "| Case | eta / eps | Verdict | Route | Solves | Nodes | Seconds | Proof |\n|---|---|---|---|---|---|---|---|"
    )
    for path in sorted(FOLDER.glob("*.json")):
        print(row(path, chosen.seconds), flush=True)


if __name__ == "__main__":
    main()
