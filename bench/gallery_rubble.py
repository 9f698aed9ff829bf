"""Pictures of the gallery: walls of rubble, laid by the commands on that page.

Run `python bench/gallery_rubble.py [NAME ...] [--stones DIR] [--scans DIR] [--keep DIR] [--out docs/images]`; writes
one SVG a wall, and prints what `settle` says first, what `check` says by rigid-block equilibrium, and the bytes. Stones
are of the synthetic quarry; those of a benchmark (`--stones` or CYCLOPEAN_BENCHMARK_STONES) and scanned boulders
(`--scans` or CYCLOPEAN_STONES) are laid where their folders are named. Walls that are in the folder of `--keep` are
not laid again.
"""

import argparse
import json
import os
from collections.abc import Sequence
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from cyclopean.analysis import Settings, check
from cyclopean.cli import main as run
from cyclopean.design.rubble.wall import slope_of
from cyclopean.io import read_model
from cyclopean.view.rubble_drawing import Profile, Told, rubble_svg

MU = 0.6
FRONT, ENDS, ROUND = (("front",),), (("front", "right"),), (("front", "right", "back"),)
# name: title, stones, options of settle, pictures; stones: "COUNT SEED" of the quarry, or a folder's name
WALLS = {
    "rubble": ("Rubble, laid dry", "40 0", "--length 4 --height 1.8", FRONT),
    "rubble-double": ("Two faces, with hearting", "60 1", "--wythes 2 --length 3 --height 2", ROUND),
    "rubble-batter": ("Batter of 1 in 6", "40 2", "--batter 1:6 --length 3.5 --height 1.8", ENDS),
    "rubble-corner": ("Two legs at a corner", "50 3", "--length 3 --corner 2.4 --height 1.8", ENDS),
    "rubble-copes": ("Two faces under copes", "60 3", "--wythes 2 --copes --length 3 --height 1.6", ROUND),
    "rubble-dressed": ("Up to 5 % knocked off a stone", "40 0", "--dress 0.05 --length 4 --height 1.8", FRONT),
    "rubble-racked": ("Racked ends", "40 6", "--ends racked --length 5.5 --height 1.6", FRONT),
    "rubble-boulders": ("Boulders, scanned", "scans", "--units m --length 4.5 --height 2", FRONT),
    "rubble-benchmark": ("Stones of a published benchmark", "stones", "--units cm --length 0.7 --thickness 0.4", ROUND),
}
HOW = ("--ways", "1", "--workers", "1")


def stock(name: str, asked: argparse.Namespace) -> str | None:
    """The folder or file of some stones; None where nobody says where they are."""
    if name in ("stones", "scans"):
        return getattr(asked, name)  # type: ignore[no-any-return]
    count, seed = name.split()
    path = asked.keep / f"quarry-{count}-seed-{seed}.json"
    if not path.exists():
        run(["make", "stones", "--count", count, "--seed", seed, "--detail", "2", "--out", str(path)])
    return str(path)


def drawn(name: str, asked: argparse.Namespace) -> None:
    """Lay a wall, check it, and draw it."""
    title, stones, options, rows = WALLS[name]
    found = stock(stones, asked)
    if found is None:
        return
    path, told = asked.keep / f"{name}.json", asked.keep / f"{name}-told.json"
    files = ("--out", str(path), "--json", str(told))
    if not told.exists() and run(["settle", found, *options.split(), *HOW, *files]):
        raise SystemExit(f"{name}: was not laid")
    data = json.loads(told.read_text(encoding="utf-8"))
    wall, _ = read_model(path)
    svg = rubble_svg(wall, title, rows, told=told_of(data))
    (asked.out / f"{name}.svg").write_text(svg + "\n", encoding="utf-8")
    verdict = check(wall, Settings(method="rbe", mu=MU)).verdict
    print(f"{name}: {len(data['placements'])} stones, {verdict}, {len(svg):,} bytes", flush=True)


def told_of(data: dict[str, Any]) -> Told:
    """Roles of the stones, and the straight wall of the height that was asked for, of what `settle` wrote."""
    asked, profile = data["settings"], None
    if asked["height"] and not asked["corner"]:
        lean = slope_of(asked["batter"])
        both = (lean, lean if asked["wythes"] == 2 else 0.0)
        profile = Profile(asked["length"], asked["thickness"], asked["height"], both)
    return Told(role={one["stone"]: one["role"] for one in data["placements"]}, profile=profile)


def main(given: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", choices=[*WALLS, []], metavar="NAME", help=", ".join(WALLS))
    parser.add_argument("--stones", default=os.environ.get("CYCLOPEAN_BENCHMARK_STONES"))
    parser.add_argument("--scans", default=os.environ.get("CYCLOPEAN_STONES"))
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images")
    asked = parser.parse_args(given)
    asked.keep = asked.keep or Path(mkdtemp())
    asked.keep.mkdir(parents=True, exist_ok=True)
    for name in asked.names or WALLS:
        drawn(name, asked)


if __name__ == "__main__":
    main()
