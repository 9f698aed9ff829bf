"""Picture of a wall from a drawing: the lines as they were typed, and the wall that they make with its verdict.

Run `python bench/drawn_wall.py [--out docs/images]`: reads the drawing of `examples/wall_from_a_drawing.py` and writes
`wall-drawn.svg`. Circles stand where a gap was closed.
"""

import argparse
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))

from gallery import CHAMFER, GAP, axonometric
from wall_from_a_drawing import write_svg

import cyclopean
from cyclopean.arrays import Floats
from cyclopean.assembly import Block
from cyclopean.design.walls.interlock import interlock
from cyclopean.design.walls.joints import with_open_joints
from cyclopean.design.walls.line_work import GROUND, OPENING, LineReading, LineWork, usual_snap
from cyclopean.design.walls.pattern import Pattern
from cyclopean.geometry.line_net import noded
from cyclopean.io import read_line_work
from cyclopean.view.colours import ACCENT, FORCE, INK, RUB
from cyclopean.view.svg import WIDTH, legend, open_path, sheet, text

MARGIN, LINE, COLUMNS = 24.0, 46.0, (0.0, 180.0, 360.0, 540.0)  # drawing units
GROUND_INK = "#7d766a"
RING = f'fill="none" stroke="{RUB}" stroke-width="2"'


def lines(work: LineWork, top: float) -> tuple[list[str], float]:
    """The drawing below a height, with what was closed in it, and where it ends."""
    every = np.concatenate([line.point for line in work.lines])
    low, high = every.min(axis=0), every.max(axis=0)
    scale = (WIDTH - 2.0 * MARGIN) / (high - low)[0]
    parts = []
    for line in work.lines:
        colour, width = (FORCE, 4.0) if line.on(OPENING) else (GROUND_INK, 7.0) if line.on(GROUND) else (INK, 2.0)
        way = (line.point - [low[0], high[1]]) * [scale, -scale] + [MARGIN, top]
        parts.append(f'<path d="{open_path(way)}" fill="none" stroke="{colour}" stroke-width="{width:g}"/>')
    net = noded([line.point for line in work.lines], usual_snap(work) * work.per_metre, [
        line.curved if line.curved is not None else np.zeros(len(line.point), bool) for line in work.lines
    ])  # fmt: skip
    gaps = (net.gap[:, :2] - [low[0], high[1]]) * [scale, -scale] + [MARGIN, top]
    parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" {RING}/>' for x, y in gaps.tolist()]
    return parts, top + float((high - low)[1]) * scale


def marks() -> Sequence[tuple[str, str]]:
    """What the colours of the drawing mean."""

    def line(colour: str, width: float) -> str:
        return f'<path d="M0 -6H26" stroke="{colour}" stroke-width="{width:g}"/>'

    gap = f'<circle cx="13" cy="-6" r="6" {RING}/>'
    return (line(INK, 2.0), "joints"), (line(FORCE, 4.0), "opening"), (line(GROUND_INK, 7.0), "ground"), (gap, "gap")


def seen(stones: Sequence[Block], pattern: Pattern) -> list[Block]:
    """The stones without the sides that a neighbour hides: painted from the back they would show in the soffit."""
    edge = shapely.boundary(shapely.coverage_union_all(pattern.subdivision.polygons()))

    def shown(corner: Floats) -> bool:
        x, _, z = corner.mean(axis=0)
        return np.ptp(corner[:, 1]) < 0.5 * np.ptp(stones[0].vertices[:, 1]) or edge.distance(shapely.Point(x, z)) < GAP

    return [replace(one, faces=tuple(f for f in one.faces if shown(one.vertices[list(f)]))) for one in stones]


def main(given: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images")
    chosen = parser.parse_args(given)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "door.svg"
        write_svg(file)
        work = read_line_work(file, LineReading())
        made = cyclopean.polygonal_wall(drawing=file, depth=0.4)
    result = cyclopean.check(made)
    parts, end = lines(work, MARGIN + LINE)
    parts += legend("", marks(), [MARGIN + x for x in COLUMNS], (MARGIN, MARGIN + 10.0))
    stones = with_open_joints(made.pattern, made.surface, made.thickness, gap=GAP, chamfer=CHAMFER)
    wall = axonometric(made.assembly, seen(stones, made.pattern), "the wall", outer=lambda p: p[:, 1] < 1.01 * CHAMFER)
    high = float(re.search(r'viewBox="0 0 \d+ (\d+)"', wall)[1])
    parts.append(wall.replace("<svg ", f'<svg x="0" y="{end + LINE:.0f}" width="{WIDTH:.0f}" height="{high:.0f}" ', 1))
    found = interlock(made.pattern, depth=made.thickness.depth)
    words = f"{made.pattern.readout.cells} stones, {made.joints.joints} joints, J {found.score:.3f}"
    bottom = end + LINE + high + LINE / 2.0
    proof = f"{result.verdict}, by a state of forces that the checker accepts"
    parts.append(text(MARGIN, bottom, f'{words}: <tspan fill="{ACCENT[result.verdict]}">{proof}</tspan>'))
    svg = sheet((WIDTH, bottom + MARGIN), "A drawing of joints, and the wall that it makes", parts, letters=22.0)
    (chosen.out / "wall-drawn.svg").write_text(svg + "\n", encoding="utf-8")
    print(f"{words}, {result.verdict}, {len(svg):,} bytes")


if __name__ == "__main__":
    main()
