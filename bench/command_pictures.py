"""Pictures that commands of the docs write: walls of sawn stones, and the stones of the demo before and after carving.

Run `python bench/command_pictures.py [--out docs/images]`; the demo takes a minute.
"""

import argparse
import os
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cyclopean.cli import main as cyclopean
from cyclopean.design.ashlar.best_fit import pack
from cyclopean.design.ashlar.planning import AshlarSettings
from cyclopean.design.ashlar.stock import Slab
from cyclopean.view.ashlar_drawing import ashlar_svg

RUNNING = (
    "ashlar --stone 0.3x0.15x0.2*152 --stone 1.2x0.15x0.2*2 --width 3 --height 1.8 --depth 0.2"
    " --opening 0.8,0,0.7,1.2 --opening 2.1,0.75,0.5,0.45 --out wall.json --svg ashlar-running.svg"
)
BRICKS = "ashlar --stone 0.2x0.1x0.1*200 --height 0.9 --depth 0.2 --out wall.json --width"
COMMANDS = (
    RUNNING,
    f"{BRICKS} 1.6 --bond english --svg ashlar-english.svg",
    f"{BRICKS} 1.7 --bond flemish --svg ashlar-flemish.svg",
    "demo --out demo",
    "carve demo/match.json --out demo/carved",
)
TRUE_SIZE = re.compile(r' width="[^"]*mm" height="[^"]*mm"')  # a page scales its pictures
CARVED = {"before.svg": "stones-as-placed.svg", "after.svg": "stones-as-carved.svg"}


def best_fit() -> str:
    """The wall of slabs of many lengths of the page on laying."""
    lengths = np.random.default_rng(3).uniform(0.2, 0.6, 60).round(3)
    slabs = [Slab(f"m{k:02d}", [length, 0.2, 0.15]) for k, length in enumerate(lengths)]
    wall = pack(AshlarSettings(length=3.0, height=0.9, depth=0.2), slabs, slots="free").wall
    return ashlar_svg(wall, "Wall of stones of different lengths, chosen by best fit") + "\n"


def main(given: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images")
    out = parser.parse_args(given).out.resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        Path("demo/carved").mkdir(parents=True)
        for command in COMMANDS:
            if cyclopean(command.split()):
                return 1
        made = {f"demo/carved/{file}": picture for file, picture in CARVED.items()}
        for file, picture in (made | {str(file): file.name for file in Path().glob("ashlar-*.svg")}).items():
            drawn = TRUE_SIZE.sub("", Path(file).read_text(encoding="utf-8"), count=1)
            (out / picture).write_text(drawn, encoding="utf-8")
        (out / "ashlar-best-fit.svg").write_text(best_fit(), encoding="utf-8")
        os.chdir(out)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
