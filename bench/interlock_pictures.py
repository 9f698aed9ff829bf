"""Draws docs/images/minimum-trace.svg: three walls with their head joints and their line of minimum trace.

    python bench/interlock_pictures.py [FILE]

Stack bond, the running bond of a dry wall of experiments (units of 200 x 150 mm), and a wall that was drawn. All are
read from their stones alone.
"""

import sys
from pathlib import Path

import numpy as np

from cyclopean.assembly import Assembly, Block
from cyclopean.design import wall
from cyclopean.design.walls.front import WallInterlock, interlock_of_stones
from cyclopean.design.walls.interlock import minimum_trace
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.view.colours import ACCENT, FORCE, INK
from cyclopean.view.svg import PAPER, WIDTH, closed, open_path, sheet

FILE = Path(__file__).parents[1] / "docs" / "images" / "minimum-trace.svg"
SCALE = 200.0  # drawing units to the metre
MARGIN, ROW = 24.0, 26.0
FIELD, EDGE = "#eceae4", "#7d766a"


def stacked(columns: int, courses: int) -> Assembly:
    """Stack bond of units of 200 x 150 mm."""
    box = wall(1, 1, length=0.2, height=0.15).blocks[1]
    corner = box.vertices - box.vertices.min(axis=0)
    places = [(i, k) for i in range(columns) for k in range(courses)]
    return Assembly(tuple(Block(f"s{i}-{k}", corner + np.array([0.2 * i, 0, 0.15 * k]), box.faces) for i, k in places))


def drawn(found: WallInterlock, left: float, foot: float, title: str) -> list[str]:
    """One wall, and two lines of text below it."""
    cells, one = found.cells, found.interlock
    point = np.array([left, foot]) + (cells.vertex - cells.vertex.min(axis=0)) * [SCALE, -SCALE]
    parts = [
        f'<path d="{closed(point[ring])}" fill="{FIELD}" stroke="{EDGE}" stroke-width="1.5"/>' for ring in cells.rings()
    ]
    parts += [_line(point[cells.edge[e]], INK, 3.0) for e in np.setdiff1d(one.head, one.aligned)]
    parts += [_line(point[cells.edge[e]], ACCENT["unstable"], 7.0) for e in np.unique(one.aligned)]
    parts.append(_line(point[minimum_trace(cells)[1]], FORCE, 4.0))
    told = (title, f"J = {one.score:.2f}, {found.minimum_trace:.0f} mm per m")
    return parts + [f'<text x="{left}" y="{foot + ROW * (k + 1)}" fill="{INK}">{t}</text>' for k, t in enumerate(told)]


def _line(way: np.ndarray, colour: str, width: float) -> str:
    style = f'stroke="{colour}" stroke-width="{width:g}" stroke-linecap="round" stroke-linejoin="round"'
    return f'<path d="{open_path(way)}" fill="none" {style}/>'


def main(file: Path) -> None:
    settings = PatternSettings(width=1.6, height=1.2, columns=6, rows=4, courses=4, coursing=0.2, seed=4)
    walls = (
        ("stack bond", stacked(5, 8)),
        ("running bond, 200 x 150 mm", wall(5, 8, length=0.2, height=0.15)),
        (
            "drawn, 24 stones",
            polygonal_wall(settings).assembly,
        ),
    )
    found = [(title, interlock_of_stones(model)) for title, model in walls]
    width = sum(float(one.size[0]) for _, one in found) * SCALE
    seam = (WIDTH - 2.0 * MARGIN - width) / (len(walls) - 1)
    foot = MARGIN + SCALE * max(float(one.size[2]) for _, one in found)
    parts, left = [f'<rect width="100%" height="100%" fill="{PAPER}"/>'], MARGIN
    for title, one in found:
        parts += drawn(one, left, foot, title)
        left += float(one.size[0]) * SCALE + seam
        print(f"{title}: J {one.interlock.score:.3f}, line of minimum trace {one.minimum_trace:.0f} mm per m")
    said = "Three walls: head joints, those that are aligned, and the line of minimum trace"
    file.write_text(sheet((WIDTH, foot + 2.0 * ROW + MARGIN), said, parts, letters=19.0))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE)
