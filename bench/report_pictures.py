"""Pictures of report pages: an arch that stands, and a leaning stack that does not.

Run `python bench/report_pictures.py [--out docs/images]`; needs Chromium on PATH.
"""

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from tutorial import CHROMIUM, photograph

from cyclopean.cli import main as cyclopean

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
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
