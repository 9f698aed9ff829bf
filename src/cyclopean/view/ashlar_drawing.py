"""A wall of sawn stones as SVG: its front face, and below it the plans of its two lowest courses.

Stones are tinted by what they are for; a stroke across a stone says that it is a part of a slab.
"""

from collections.abc import Sequence

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.ashlar.planning import LaidStone
from cyclopean.design.ashlar.wall import AshlarWall
from cyclopean.view.colours import ACCENT, GHOST, INK
from cyclopean.view.svg import EXACT, WIDTH, layer, legend, rect, sheet, text, to_scale

MARGIN = 24.0  # drawing units
LEGEND, BETWEEN, CAPTION = 44.0, 16.0, 26.0
EDGE = "#6f685c"
TINT = {
    "stretcher": "#ddd3c1", "header": "#b7ab97", "closer": "#f3ecde", "through": "#8f8a80", "lintel": "#a9b7bd",
}  # fmt: skip
ASKED = f'fill="none" stroke="{GHOST}" stroke-width="1.5" stroke-dasharray="5 4"'  # clear width and height of openings
GAP = f'fill="none" stroke="{ACCENT["unstable"]}" stroke-width="2" stroke-dasharray="3 4"'
PLANS = 2  # courses drawn from above


def ashlar_svg(wall: AshlarWall, title: str) -> str:
    """Draw a wall as one `<svg>` element; the title is for readers that do not see it."""
    settings = wall.settings
    scale = (WIDTH - 2.0 * MARGIN) / settings.length
    foot = MARGIN + settings.height * scale
    row = {s.slot.course: s.slot for s in reversed(wall.laid)}
    asked = ([[one.left, one.sill], [one.left + one.width, one.top]] for one in settings.openings)
    gaps = (
        [[gap.low, row[gap.course].low[2]], [gap.high, row[gap.course].high[2]]]
        for gap in wall.gaps
        if gap.course in row and gap.leaf <= 0
    )
    ground = f'<path d="M{MARGIN / 2:g} {foot:.{EXACT}f}H{WIDTH - MARGIN / 2:g}" stroke="{EDGE}" stroke-width="4"/>'
    parts = [
        *_stones([s for s in wall.laid if s.slot.leaf <= 0], 2, scale, foot),
        layer("openings", (_box(box, scale, foot, ASKED) for box in asked)),
        layer("gaps", (_box(box, scale, foot, GAP) for box in gaps)),
        layer("ground", [ground]),
    ]
    low = foot + BETWEEN
    for course in range(min(PLANS, wall.readout.courses)):
        name = text(MARGIN, low + CAPTION - 7.0, f"course {course + 1}, from above", 'font-size="16"')
        low += CAPTION + settings.depth * scale
        plan = _stones([s for s in wall.laid if s.slot.course == course], 1, scale, low)
        parts.append(layer(f"course-{course + 1}", [layer("text", [name]), *plan]))
        low += BETWEEN
    parts.append(layer("legend", _legend(wall, low + 24.0)))
    return sheet((WIDTH, low + LEGEND), title, parts, letters=17.0, more=to_scale(scale, (MARGIN, foot)))


def _box(corners: Sequence[Sequence[float]] | Floats, scale: float, foot: float, style: str) -> str:
    """A rectangle between its least and its largest corner, (2, 2) m."""
    (x0, y0), (x1, y1) = corners
    return rect(MARGIN + x0 * scale, foot - y1 * scale, (x1 - x0) * scale, (y1 - y0) * scale, style, EXACT)


def _stones(stones: Sequence[LaidStone], up: int, scale: float, foot: float) -> list[str]:
    """Stones in x and y (`up` 1) or in x and z (2), and strokes across those that are parts of slabs."""
    box = [np.array([one.slot.low, one.slot.high])[:, [0, up]] for one in stones]
    rim = f'stroke="{EDGE}" stroke-width="1.5"'
    drawn = (_box(b, scale, foot, f'fill="{TINT[s.slot.kind]}" {rim}') for s, b in zip(stones, box, strict=True))
    strokes = []
    for b in (b for s, b in zip(stones, box, strict=True) if s.sawn.cuts or s.sawn.offcut):
        x, y = b.mean(axis=0) * scale
        strokes.append(_stroke(MARGIN + x, foot - y, min(8.0, 0.3 * scale * float(np.ptp(b, axis=0).min()))))
    return [layer("stones", drawn), layer("sawn", strokes)]


def _stroke(x: float, y: float, size: float) -> str:
    way = f"M{x - size:.1f} {y + size:.1f}L{x + size:.1f} {y - size:.1f}"
    return f'<path d="{way}" stroke="{INK}" stroke-width="1.5"/>'


def _legend(wall: AshlarWall, y: float) -> list[str]:
    """The score, what the tints mean, and how many stones there are of each."""
    kinds = [s.slot.kind for s in wall.laid]
    marks = [
        (rect(0.0, -12.0, 24.0, 14.0, f'fill="{tint}" stroke="{EDGE}"'), _plural(kind, kinds.count(kind)))
        for kind, tint in TINT.items()
        if kind in kinds
    ]
    marks.append((_stroke(12.0, -5.0, 7.0), f"{wall.readout.cut} parts of slabs"))
    step = (WIDTH - 2.0 * MARGIN - 110.0) / max(len(marks), 5)
    columns = [MARGIN + 120.0 + k * step for k in range(len(marks))]
    return legend(f"J = {wall.readout.score:.3f}", marks, columns, (MARGIN, y))


def _plural(kind: str, count: int) -> str:
    name = {"through": "through-stone"}.get(kind, kind)
    return f"{count} {name}{'' if count == 1 else 's'}"
