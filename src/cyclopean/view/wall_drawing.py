"""A pattern and its interlock as SVG: head joints, those that are aligned, running joints and crossings marked.

Two walls that meet at a corner are drawn side by side, as if the second were turned into the plane of the first.

>>> from cyclopean.design.walls.interlock import interlock
>>> from cyclopean.design.walls.pattern import PatternSettings, draw_pattern
>>> pattern = draw_pattern(PatternSettings(columns=3, rows=2))
>>> wall_svg(pattern, interlock(pattern), "six stones").count('Z" fill="#eceae4"')
6
"""

from collections.abc import Sequence

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.walls.corner import CornerWall, joint_score
from cyclopean.design.walls.interlock import Interlock, interlock
from cyclopean.design.walls.pattern import Pattern
from cyclopean.view.colours import ACCENT, FORCE, GHOST, INK, RUB
from cyclopean.view.svg import EXACT, PAPER, WIDTH, closed, layer, legend, open_path, sheet, to_scale

MARGIN = 24.0  # drawing units
LEGEND, LINE = 44.0, 5  # height below the wall, and parts of it in one line
SEAM = 30.0  # between two walls of a corner
COLUMNS = (180.0, 400.0, 570.0, 812.0)  # of the legend
FIELD, DRESSED, EDGE = "#eceae4", "#d3cec2", "#7d766a"
OUTLINE = f'stroke="{EDGE}" stroke-width="1.5" stroke-linejoin="round"'
ALIGNED = ACCENT["unstable"]


def wall_svg(
    pattern: Pattern, found: Interlock, title: str, *, tints: Sequence[str] | None = None, key: str = ""
) -> str:
    """Draw a pattern with what its interlock is made of, as one `<svg>` element.

    The title is for readers that do not see it. Where no `tints` (#rrggbb) of the cells are given, field stones have
    one and dressed stones another. What they mean may be drawn as a `key` from (0, 0) on, below the legend.
    """
    scale = (WIDTH - 2.0 * MARGIN) / pattern.settings.width
    wall = pattern.settings.height * scale
    foot = np.array([MARGIN, MARGIN + wall])
    parts = _face(pattern, found, tints, foot, scale)
    return _drawn(title, parts, foot, scale, _legend([found], found.score, key))


def corner_svg(made: CornerWall, title: str, *, tints: Sequence[str] | None = None) -> str:
    """Draw both faces of two walls that meet at a corner, the second to the right of the first, as one `<svg>` element.

    As `wall_svg`; `tints` are of the blocks, that of the ground included.
    """
    widths = [pattern.settings.width for pattern in made.patterns]
    scale = (WIDTH - 2.0 * MARGIN - SEAM) / sum(widths)
    wall = made.patterns[0].settings.height * scale
    found = [interlock(pattern, depth=made.thickness.depth) for pattern in made.patterns]
    foot = np.array([MARGIN, MARGIN + wall])
    parts: list[str] = []
    for k, (pattern, number) in enumerate(zip(made.patterns, made.block, strict=True)):
        own = None if tints is None else [tints[block] for block in number]
        along = np.array([k * (widths[0] * scale + SEAM), 0.0])
        face = _face(pattern, found[k], own, foot + along, scale)
        parts.append(layer(f"wall-{k + 1}", face))
    return _drawn(title, parts, foot, scale, _legend(found, joint_score(made)))


def _face(pattern: Pattern, found: Interlock, tints: Sequence[str] | None, foot: Floats, scale: float) -> list[str]:
    """One wall whose foot begins at a point of the sheet."""
    cells, units = pattern.subdivision, np.array([scale, -scale])
    point = foot + cells.vertex * units
    ends = point[cells.edge]
    tints = tints if tints is not None else [FIELD if kind == "stone" else DRESSED for kind in pattern.kind]
    reach = foot + np.array([[0.0, 0.0], [pattern.settings.width * scale, 0.0]])
    aligned = np.unique(found.aligned)
    running = (ends[list(joint.joints)].mean(axis=1) for joint in found.running)
    return [
        layer("stones", (_ring(point[ring], tint) for ring, tint in zip(cells.rings(), tints, strict=True))),
        layer("course-lines", (_line(reach - [0.0, y * scale], GHOST, 1.0, "2 6") for y in pattern.lines), solid=True),
        layer("openings", (_ring(foot + hole * units, PAPER) for hole in pattern.openings), solid=True),
        layer("ground", [_ground(pattern, foot, units)]),
        layer("head-joints", (_line(ends[e], INK, 3.0) for e in np.setdiff1d(found.head, aligned))),
        layer("aligned-joints", (_line(ends[e], ALIGNED, 7.0) for e in aligned)),
        layer("running-joints", (_line(way, FORCE, 2.0, "5 4") for way in running)),
        layer("crossings", (_crossing(x, y) for x, y in point[found.crossings].tolist())),
    ]


def _drawn(title: str, parts: list[str], foot: Floats, scale: float, told: list[str]) -> str:
    """Everything drawn, at a scale from its foot, and the legend below it."""
    top = float(foot[1]) + MARGIN
    below = layer("legend", [f'<g transform="translate(0 {top:.1f})">', *told, "</g>"])
    size = WIDTH, top + (1.0 if len(told) <= LINE else 1.6) * LEGEND
    return sheet(size, title, [*parts, below], letters=19.0, more=to_scale(scale, foot))


def _legend(found: Sequence[Interlock], score: float, key: str = "") -> list[str]:
    """The score, what the marks mean, how many there are; and a key in a line of its own."""
    sample = np.array([[0.0, -6.0], [26.0, -6.0]])
    marks = (
        (_line(sample, INK, 3.0), f"head joints {sum(len(one.head) for one in found)}"),
        (_line(sample, ALIGNED, 7.0), f"aligned {sum(len(np.unique(one.aligned)) for one in found)}"),
        (_line(sample, FORCE, 2.0, "5 4"), f"running joints {sum(len(one.running) for one in found)}"),
        (_crossing(13.0, -6.0), f"crossings {sum(len(one.crossings) for one in found)}"),
    )
    told = legend(f"J = {score:.3f}", marks, COLUMNS, (MARGIN, 18.0))
    return [*told, f'<g transform="translate({MARGIN:g} {LEGEND + 6.0:.1f})">{key}</g>'] if key else told


def _ring(ring: Floats, colour: str) -> str:
    """A stone, or an opening."""
    return f'<path d="{closed(ring, EXACT)}" fill="{colour}" {OUTLINE}/>'


def _ground(pattern: Pattern, foot: Floats, units: Floats) -> str:
    """The line on which the wall stands, a little beyond its ends."""
    line = np.array([[0.0, 0.0], [pattern.settings.width, 0.0]]) if pattern.foot is None else pattern.foot
    line = foot + line * units
    beyond = np.array([[MARGIN / 2.0, 0.0]])
    line = np.concatenate([line[:1] - beyond, line, line[-1:] + beyond])
    return f'<path d="{open_path(line, EXACT)}" fill="none" stroke="{EDGE}" stroke-width="4" stroke-linejoin="round"/>'


def _line(way: Floats, colour: str, width: float, dashes: str = "") -> str:
    """A line through points (k, 2)."""
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    style = f'fill="none" stroke="{colour}" stroke-width="{width:g}" stroke-linecap="round"{dashed}'
    return f'<path d="{open_path(way, EXACT)}" {style}/>'


def _crossing(x: float, y: float) -> str:
    return f'<circle cx="{x:.{EXACT}f}" cy="{y:.{EXACT}f}" r="9" fill="none" stroke="{RUB}" stroke-width="3.5"/>'
