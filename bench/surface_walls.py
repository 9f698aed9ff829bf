"""Picture of walls on a designer's surfaces: a saddle, a patch of a dome, and a wavy wall with a door.

Run `python bench/surface_walls.py [--out docs/images]`: lays the walls of `examples/wall_on_a_surface.py` and writes
`wall-surfaces.svg`. Needs rhino3dm for the saddle.
"""

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))

from gallery import CHAMFER, GAP, axonometric
from wall_on_a_surface import surfaces

import cyclopean
from cyclopean.design.walls.interlock import interlock
from cyclopean.design.walls.joints import with_open_joints
from cyclopean.view.colours import ACCENT
from cyclopean.view.svg import WIDTH, sheet, text

SHARE, MARGIN, LINE = 0.7, 24.0, 40.0  # of the sheet's width that a wall takes; drawing units
SAID = {"saddle.3dm": "a NURBS saddle", "dome.obj": "a patch of a dome, as a mesh", "wavy.ply": "a wavy mesh"}


def shorter(svg: str) -> str:
    """The same picture in fewer bytes: corners from the one before, and a class for each colour."""
    names: dict[str, str] = {}

    def way(found: re.Match[str]) -> str:
        first, *rest = ([float(x) for x in pair.split(",")] for pair in found[1].split())
        steps, (x, y) = [], first
        for u, v in rest:
            step = f"{u - x:.1f},{v - y:.1f}".replace(".0", "").replace(",-", "-")
            steps.append(re.sub(r"(?<!\d)0\.", ".", step))
            x, y = u, v
        tint = "#" + "".join(f"{min(255, (int(found[2][k : k + 2], 16) + 2) // 4 * 4):02x}" for k in (1, 3, 5))
        name = names.setdefault(tint, f"c{len(names)}")  # shades nearer than 4 of 255 are one
        return f'<path class="{name}" d="M{first[0]:g},{first[1]:g}l{" ".join(steps)}z"/>'

    drawn = re.sub(r'<polygon points="([^"]*)" fill="([^"]*)" stroke="[^"]*"/>', way, svg)
    same = re.compile(r'(<path class="(c\d+)" d="[^"]*)"/><path class="\2" d="')
    while same.search(drawn):
        drawn = same.sub(r"\1", drawn)
    style = "".join(f".{name}{{color:{colour}}}" for colour, name in names.items())
    return drawn.replace("</title>", f"</title><style>path{{fill:currentColor;stroke:currentColor}}{style}</style>", 1)


def main(given: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images")
    chosen = parser.parse_args(given)
    parts, top = [], MARGIN
    with TemporaryDirectory() as folder:
        for name, options in surfaces(Path(folder)):
            made = cyclopean.polygonal_wall(surface=Path(folder) / name, **options)
            verdict = cyclopean.check(made).verdict
            stones = with_open_joints(made.pattern, made.surface, made.thickness, gap=GAP, chamfer=CHAMFER)
            wall = axonometric(made.assembly, stones, SAID[name])
            high = SHARE * float(re.search(r'viewBox="0 0 \d+ (\d+)"', wall)[1])
            left, wide = (1.0 - SHARE) / 2.0 * WIDTH, SHARE * WIDTH
            place = f'<svg x="{left:.0f}" y="{top:.0f}" width="{wide:.0f}" height="{high:.0f}" '
            parts.append(wall.replace("<svg ", place, 1))
            least, most = made.surface.stretch
            score = interlock(made.pattern, depth=made.thickness.depth).score
            words = f"{SAID[name]}: a metre is {least:.3f} to {most:.3f} m, {len(stones)} stones, J {score:.2f}"
            top += high + LINE / 2.0
            parts.append(text(MARGIN, top, f'{words}: <tspan fill="{ACCENT[verdict]}">{verdict}</tspan>'))
            print(words, verdict)
            top += LINE
    svg = shorter(sheet((WIDTH, top), "Walls on surfaces of a designer", parts, letters=22.0))
    (chosen.out / "wall-surfaces.svg").write_text(svg + "\n", encoding="utf-8")
    print(f"{len(svg):,} bytes")


if __name__ == "__main__":
    main()
