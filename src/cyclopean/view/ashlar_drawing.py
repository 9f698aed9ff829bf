"""A wall of sawn stones as SVG: its front face, and below it the plans of its two lowest courses.

Stones are tinted by what they are for; a stroke across a stone says that it is a part of a slab.
"""

from html import escape

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.ashlar.planning import LaidStone
from cyclopean.design.ashlar.wall import AshlarWall
from cyclopean.view.colours import ACCENT, GHOST, INK

__all__ = ["ashlar_svg"]

WIDTH, MARGIN = 1000.0, 24.0  # of the drawing, in its own units
LEGEND, BETWEEN, CAPTION = 44.0, 16.0, 26.0
PAPER, EDGE = "#ffffff", "#6f685c"
TINT = {
    "stretcher": "#ddd3c1", "header": "#b7ab97", "closer": "#f3ecde", "through": "#8f8a80", "lintel": "#a9b7bd",
}  # fmt: skip
PLANS = 2


def ashlar_svg(wall: AshlarWall, title: str) -> str:
    """Draw a wall.

    Parameters
    ----------
    wall : AshlarWall
    title : str
        For readers that do not see it.

    Returns
    -------
    str
        One `<svg>` element.
    """
    settings = wall.settings
    scale = (WIDTH - 2.0 * MARGIN) / settings.length
    foot = MARGIN + settings.height * scale
    front = [s for s in wall.laid if s.slot.leaf <= 0]
    parts = [_stone(s, _flat(s, 2), scale, foot) for s in front]
    parts += [_opening(wall, k, scale, foot) for k in range(len(settings.openings))]
    parts += [_gap(wall, k, scale, foot) for k in range(len(wall.gaps))]
    ground = f'<path d="M{MARGIN / 2:g} {foot:.1f}H{WIDTH - MARGIN / 2:g}" stroke="{EDGE}" stroke-width="4"/>'
    parts.append(ground)
    low = foot + BETWEEN
    for course in range(min(PLANS, wall.readout.courses)):
        low += CAPTION
        parts.append(f'<text x="{MARGIN:g}" y="{low - 7:.1f}" font-size="16">course {course + 1}, from above</text>')
        low += settings.depth * scale
        parts += [_stone(s, _flat(s, 1), scale, low) for s in wall.laid if s.slot.course == course]
        low += BETWEEN
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {low + LEGEND:.0f}" role="img"'
        f' font-family="sans-serif" font-size="17" fill="{INK}">'
        f"<title>{escape(title)}</title>"
        f'<rect width="100%" height="100%" fill="{PAPER}"/>'
        f"{''.join(parts)}{_legend(wall, low + 24.0)}</svg>"
    )


def _flat(stone: LaidStone, up: int) -> Floats:
    """Least and largest x and y (or z) of a stone, (2, 2) m."""
    return np.array([stone.slot.low, stone.slot.high])[:, [0, up]]


def _rect(box: Floats, scale: float, foot: float) -> tuple[float, float, float, float]:
    """X, y, width and height on the sheet."""
    (x0, y0), (x1, y1) = box.tolist()
    return MARGIN + x0 * scale, foot - y1 * scale, (x1 - x0) * scale, (y1 - y0) * scale


def _stone(stone: LaidStone, box: Floats, scale: float, foot: float) -> str:
    x, y, width, height = _rect(box, scale, foot)
    shape = f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}"'
    drawn = f'{shape} fill="{TINT[stone.slot.kind]}" stroke="{EDGE}" stroke-width="1.5"/>'
    if not (stone.sawn.cuts or stone.sawn.offcut):
        return drawn
    size = min(8.0, 0.3 * width, 0.3 * height)
    a, b = x + width / 2.0, y + height / 2.0
    return drawn + _stroke(a, b, size)


def _stroke(a: float, b: float, size: float) -> str:
    way = f"M{a - size:.1f} {b + size:.1f}L{a + size:.1f} {b - size:.1f}"
    return f'<path d="{way}" stroke="{INK}" stroke-width="1.5"/>'


def _opening(wall: AshlarWall, number: int, scale: float, foot: float) -> str:
    """Clear width and height as asked for, dashed."""
    one = wall.settings.openings[number]
    box = np.array([[one.left, one.sill], [one.left + one.width, one.top]])
    x, y, width, height = _rect(box, scale, foot)
    shape = f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}"'
    return f'{shape} fill="none" stroke="{GHOST}" stroke-width="1.5" stroke-dasharray="5 4"/>'


def _gap(wall: AshlarWall, number: int, scale: float, foot: float) -> str:
    gap = wall.gaps[number]
    row = [s for s in wall.laid if s.slot.course == gap.course]
    if not row or gap.leaf > 0:
        return ""
    box = np.array([[gap.low, row[0].slot.low[2]], [gap.high, row[0].slot.high[2]]])
    x, y, width, height = _rect(box, scale, foot)
    shape = f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}"'
    return f'{shape} fill="none" stroke="{ACCENT["unstable"]}" stroke-width="2" stroke-dasharray="3 4"/>'


def _legend(wall: AshlarWall, y: float) -> str:
    """The score, what the tints mean, and how many stones there are of each."""
    kinds = [s.slot.kind for s in wall.laid]
    marks = [(f'<rect width="24" height="14" y="-12" fill="{TINT[k]}" stroke="{EDGE}"/>', _plural(k, kinds.count(k)))
             for k in TINT if k in kinds]  # fmt: skip
    marks.append((_stroke(12.0, -5.0, 7.0), f"{wall.readout.cut} parts of slabs"))
    parts = [f'<text x="{MARGIN:g}" y="{y:.1f}" font-weight="600">J = {wall.readout.score:.3f}</text>']
    step = (WIDTH - 2.0 * MARGIN - 110.0) / max(len(marks), 5)
    for k, (mark, text) in enumerate(marks):
        at = f"translate({MARGIN + 120.0 + k * step:.1f} {y:.1f})"
        parts.append(f'<g transform="{at}">{mark}<text x="32" y="0">{text}</text></g>')
    return "".join(parts)


def _plural(kind: str, count: int) -> str:
    name = {"through": "through-stone"}.get(kind, kind)
    return f"{count} {name}{'' if count == 1 else 's'}"
