"""Pictures of report pages, an arch that stands and a leaning stack that does not, and how the arch presses and rubs.

Run `python bench/report_pictures.py [--out docs/images]`; needs Chromium on PATH.
"""

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from tutorial import CHROMIUM, photograph

from cyclopean import check
from cyclopean.cli import main as cyclopean
from cyclopean.view.drawing import displaced
from cyclopean.view.drawing import picture as drawing_of
from cyclopean.view.elevation import elevation_svg

COUPLED = "coupled-arch.svg"
SIZE = 1100, 1150  # of the page on the screen
PAGES = {  # picture -> how its model is made
    "report-arch.png": ("arch.json", "make arch 20 --radius 5.25 --thickness 0.8 --depth 0.8 --density 2400 --mu 0.84"),
    "report-stack.png": ("stack.json", "make stack 5 --offset 0.3 --mu 0.84 --density 2400"),
}


def main(given: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images")
    out = parser.parse_args(given).out.resolve()
    browser = next(filter(None, map(shutil.which, CHROMIUM)), None)
    if browser is None:
        print("no Chromium on PATH", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as folder:
        for picture, (name, command) in PAGES.items():
            model, page = Path(folder) / name, Path(folder) / f"{name}.html"
            cyclopean([*command.split(), "--out", str(model)])
            cyclopean(["check", str(model), "--report", str(page)])
            photograph(browser, page, out / picture, SIZE)
            print(f"{picture}: {(out / picture).stat().st_size:,} bytes")
        moved = displaced(drawing_of(check(str(Path(folder) / "arch.json"), method="cra")))
    (out / COUPLED).write_text(elevation_svg(moved, "An arch, its virtual displacement drawn large") + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
