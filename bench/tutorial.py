"""Pictures of the tutorial: runs the commands of that page, and takes pictures of the pages and drawings they write.

Run `python bench/tutorial.py [--out docs/images]`. Pages are photographed by Chromium, which has to be on PATH;
drawings are copied.
"""

import argparse
import contextlib
import os
import re
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from cyclopean.cli import main as cyclopean

DOCS = Path(__file__).parents[1] / "docs"
PAGES = {  # picture -> page, and its size on the screen
    "tutorial-unstable.png": ("first.html", (1200, 1180)),
    "tutorial-stable.png": ("wall.html", (1200, 1180)),
    "tutorial-building.png": ("building.html", (1200, 1000)),
}
DRAWINGS = {"tutorial-placed.svg": "built/before.svg"}
CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --hide-scrollbars"
    " --virtual-time-budget=30000"
)
SHOTS = 3


def run_the_page(page: Path) -> None:
    """Every command of its console blocks, in the folder where we are."""
    for command in re.findall(r"^\$ (\S.*)$", page.read_text(encoding="utf-8"), re.MULTILINE):
        words = shlex.split(command)
        if words[0] == "./run":
            cyclopean(words[1:])
        elif words[0] == "mkdir":
            Path(words[1]).mkdir()


def photograph(browser: str, page: Path, picture: Path, size: tuple[int, int]) -> None:
    """One page as a PNG. Arrows come last, and on a busy machine too late: of some shots the fullest is kept."""
    wide, high = size
    shots = []
    with tempfile.TemporaryDirectory() as folder:
        for k in range(SHOTS):
            shot = Path(folder) / f"{k}.png"
            options = [*FLAGS.split(), f"--window-size={wide},{high}", f"--screenshot={shot}"]
            subprocess.run([browser, *options, page.resolve().as_uri()], check=True, capture_output=True, timeout=120)
            shots.append(shot.read_bytes())
    picture.write_bytes(max(shots, key=len))


def main(given: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=DOCS / "images")
    out = parser.parse_args(given).out.resolve()
    browser = next(filter(None, map(shutil.which, CHROMIUM)), None)
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        run_the_page(DOCS / "tutorial.md")
        for name, drawing in DRAWINGS.items():
            shutil.copy(drawing, out / name)
        for name, (page, size) in PAGES.items():
            if browser is None:
                print(f"{name}: no Chromium on PATH, left as it is")
                continue
            photograph(browser, Path(page), out / name, size)
    for name in (*DRAWINGS, *PAGES):
        print(f"{name}: {os.path.getsize(out / name):,} bytes" if (out / name).exists() else f"{name}: missing")


if __name__ == "__main__":
    main()
