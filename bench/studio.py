"""How fast the live page answers: a slider is moved in a real headless Chromium until the verdict's text is another.

Run `python bench/studio.py [--sizes 200,2000] [--moves 15]`; prints, for running-bond walls of about so many blocks,
median and worst seconds from the click to the new text (a claim, or a proof where that is as quick), seconds of the
solver within, and from the click to a verdict that is proved. Software rendering on the processor that also solves: a
machine with a graphics card does better. Needs chromium.
"""

import argparse
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))  # the browser is shared with the tests of the page

from chromium import FOUND, StudioPage  # noqa: E402
from cyclopean.analysis import Settings  # noqa: E402
from cyclopean.design import wall  # noqa: E402
from cyclopean.view.studio.panel import studio  # noqa: E402

SHARES = [0.02, 0.04, 0.03, 0.05, 0.08, 0.06, 0.1, 0.12, 0.09, 0.14, 0.11, 0.15, 0.13, 0.07, 0.01]  # of 60 degrees


def measured(blocks: int, moves: int, method: str, picture: str | None) -> None:
    side = round(blocks**0.5)
    model = wall(side, side)
    with (
        tempfile.TemporaryDirectory() as folder,
        studio(model, Settings(method=method), folder=Path(folder)) as page,
        StudioPage(page.address) as browser,
    ):
        browser.ready(300.0)
        time.sleep(2.0)
        first, proved, inside = [], [], []
        for share in (SHARES * (moves // len(SHARES) + 1))[:moves]:
            began = time.perf_counter()
            first.append(browser.slide(StudioPage.TILT, share, 120.0))
            inside.append(page.desk.latest.answer.seconds)
            browser.settled(300.0)
            proved.append(time.perf_counter() - began)
        if picture:
            browser.picture(picture)
    middle = statistics.median
    print(
        f"{len(model):6} blocks, {method}: text {middle(first):.3f} s (worst {max(first):.3f}), of these solver"
        f" {middle(inside):.3f} s; proved {middle(proved):.2f} s (worst {max(proved):.2f}); {moves} moves,"
        f" load {os.getloadavg()[0]:.1f}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default="200,2000")
    parser.add_argument("--moves", type=int, default=15)
    parser.add_argument("--methods", default="rbe,cra")
    parser.add_argument("--picture", help="where to put a picture of the last page")
    chosen = parser.parse_args()
    if FOUND is None:
        sys.exit("no chromium on this machine")
    for size in chosen.sizes.split(","):
        for method in chosen.methods.split(","):
            measured(int(size), chosen.moves, method, chosen.picture)


if __name__ == "__main__":
    main()
