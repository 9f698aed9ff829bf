"""Pictures of pages: reports of an arch that stands and of a leaning stack, how the arch presses and rubs, the studio.

Run `python bench/report_pictures.py [--out docs/images]`; needs Chromium on PATH.
"""

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))  # the browser is shared with the tests of the page

from tutorial import CHROMIUM, photograph

from chromium import StudioPage
from cyclopean import arch, check
from cyclopean.analysis import Settings
from cyclopean.cli import main as cyclopean
from cyclopean.view.drawing import displaced
from cyclopean.view.drawing import picture as drawing_of
from cyclopean.view.elevation import elevation_svg
from cyclopean.view.studio.panel import studio

COUPLED = "coupled-arch.svg"
STUDIO = 1280, 860
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
    with (
        studio(arch(20, span=8.0, thickness=1.2, depth=1.6), Settings(mu=0.7), folder=out) as page,
        StudioPage(page.address, *STUDIO) as window,
    ):
        window.ready()
        window.slide(StudioPage.TILT, 0.14)
        window.settled()
        window.wait("(document.getElementById('reach')?.innerText||'').includes('falls at')", 60.0)
        window.js("document.querySelector('.mantine-Notification-closeButton')?.click()")  # of slow graphics
        time.sleep(1.0)
        window.picture(str(out / "studio.png"))
    (out / COUPLED).write_text(elevation_svg(moved, "An arch, its virtual displacement drawn large") + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
