"""A pattern and its interlock as SVG: head joints, those that are aligned, running joints and crossings marked.

Two walls that meet at a corner are drawn side by side, as if the second were turned into the plane of the first.

>>> from cyclopean.design.walls.interlock import interlock
>>> from cyclopean.design.walls.pattern import PatternSettings, draw_pattern
>>> pattern = draw_pattern(PatternSettings(columns=3, rows=2))
>>> wall_svg(pattern, interlock(pattern), "six stones").count("<polygon")
6
"""

from collections.abc import Sequence
from html import escape

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.walls.corner import CornerWall, joint_score
from cyclopean.design.walls.interlock import Interlock, interlock
from cyclopean.design.walls.pattern import Pattern
from cyclopean.view.colours import ACCENT, FORCE, GHOST, INK, RUB

__all__ = ["corner_svg", "wall_svg"]

WIDTH, MARGIN = 1000.0, 24.0  # of the drawing, in its own units
LEGEND = 44.0  # height below the wall
SEAM = 30.0  # between two walls of a corner
COLUMNS = (180.0, 400.0, 570.0, 812.0)  # of the legend
FIELD, DRESSED, EDGE, PAPER = "#eceae4", "#d3cec2", "#7d766a", "#ffffff"
ALIGNED = ACCENT["unstable"]


def wall_svg(pattern: Pattern, found: Interlock, title: str, *, tints: Sequence[str] | None = None) -> str:
    """Draw a pattern with what its interlock is made of, as one `<svg>` element.

    Parameters
    ----------
    pattern : Pattern
    found : Interlock
        Of this pattern.
    title : str
        For readers that do not see it.
    tints : sequence of str, optional
        Colour of each cell (#rrggbb); field stones in one and dressed stones in another where not given.

    Returns
    -------
    str
    """
    scale = (WIDTH - 2.0 * MARGIN) / pattern.settings.width
    wall = pattern.settings.height * scale
    parts = _face(pattern, found, tints, np.array([MARGIN, MARGIN + wall]), scale)
    return _sheet(parts, wall + 2.0 * MARGIN, [found], found.score, title)


def corner_svg(made: CornerWall, title: str, *, tints: Sequence[str] | None = None) -> str:
    """Draw both faces of two walls that meet at a corner, the second to the right of the first, as one `<svg>` element.

    Parameters
    ----------
    made : CornerWall
    title : str
        For readers that do not see it.
    tints : sequence of str, optional
        Colour of each block (#rrggbb), that of the ground included; as in `wall_svg` where not given.

    Returns
    -------
    str
    """
    widths = [pattern.settings.width for pattern in made.patterns]
    scale = (WIDTH - 2.0 * MARGIN - SEAM) / sum(widths)
    wall = made.patterns[0].settings.height * scale
    found = [interlock(pattern, depth=made.thickness.depth) for pattern in made.patterns]
    parts: list[str] = []
    for k, (pattern, number) in enumerate(zip(made.patterns, made.block, strict=True)):
        left = MARGIN + k * (widths[0] * scale + SEAM)
        own = None if tints is None else [tints[block] for block in number]
        parts += _face(pattern, found[k], own, np.array([left, MARGIN + wall]), scale)
    return _sheet(parts, wall + 2.0 * MARGIN, found, joint_score(made), title)


def _face(pattern: Pattern, found: Interlock, tints: Sequence[str] | None, foot: Floats, scale: float) -> list[str]:
    """One wall whose foot begins at a point of the sheet."""
    cells, left, right = pattern.subdivision, foot[0], foot[0] + pattern.settings.width * scale
    point = foot + cells.vertex * [scale, -scale]
    ends = point[cells.edge]
    tints = tints if tints is not None else [FIELD if kind == "stone" else DRESSED for kind in pattern.kind]
    parts = [_stone(point[ring], tint) for ring, tint in zip(cells.rings(), tints, strict=True)]
    parts += [_line(left, y, right, y, GHOST, 1.0, "2 6") for y in foot[1] - pattern.lines * scale]
    parts += [_hole(foot + hole * [scale, -scale]) for hole in pattern.openings]
    parts.append(_ground(pattern, foot, scale))
    aligned = np.unique(found.aligned)
    parts += [_joint(ends[e], INK, 3.0) for e in np.setdiff1d(found.head, aligned)]
    parts += [_joint(ends[e], ALIGNED, 7.0) for e in aligned]
    for joint in found.running:
        middle = ends[list(joint.joints)].mean(axis=1)
        way = " ".join(f"{x:.1f},{y:.1f}" for x, y in middle.tolist())
        parts.append(f'<polyline points="{way}" fill="none" stroke="{FORCE}" stroke-width="2" stroke-dasharray="5 4"/>')
    return parts + [_ring(x, y) for x, y in point[found.crossings].tolist()]


def _sheet(parts: list[str], top: float, found: Sequence[Interlock], score: float, title: str) -> str:
    """Everything drawn, over the legend that begins at `top`."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {top + LEGEND:.0f}" role="img"'
        f' font-family="sans-serif" font-size="19" fill="{INK}">'
        f"<title>{escape(title)}</title>"
        f'<rect width="100%" height="100%" fill="{PAPER}"/>'
        f"{''.join(parts)}{_legend(found, score, top)}</svg>"
    )


def _stone(ring: Floats, colour: str) -> str:
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in ring.tolist())
    return f'<polygon points="{corners}" fill="{colour}" stroke="{EDGE}" stroke-width="1.5" stroke-linejoin="round"/>'


def _way(point: Floats) -> str:
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in point.tolist())


def _hole(ring: Floats) -> str:
    return f'<path d="{_way(ring)}Z" fill="{PAPER}" stroke="{EDGE}" stroke-width="1.5" stroke-linejoin="round"/>'


def _ground(pattern: Pattern, foot: Floats, scale: float) -> str:
    """The line on which the wall stands, a little beyond its ends."""
    line = np.array([[0.0, 0.0], [pattern.settings.width, 0.0]]) if pattern.foot is None else pattern.foot
    line = foot + line * [scale, -scale]
    beyond = np.array([[MARGIN / 2.0, 0.0]])
    line = np.concatenate([line[:1] - beyond, line, line[-1:] + beyond])
    return f'<path d="{_way(line)}" fill="none" stroke="{EDGE}" stroke-width="4" stroke-linejoin="round"/>'


def _line(a: float, b: float, c: float, d: float, colour: str, width: float, dashes: str = "") -> str:
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    where = f'x1="{a:.1f}" y1="{b:.1f}" x2="{c:.1f}" y2="{d:.1f}"'
    return f'<line {where} stroke="{colour}" stroke-width="{width:g}" stroke-linecap="round"{dashed}/>'


def _joint(ends: Floats, colour: str, width: float) -> str:
    (a, b), (c, d) = ends.tolist()
    return _line(a, b, c, d, colour, width)


def _ring(x: float, y: float) -> str:
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="9" fill="none" stroke="{RUB}" stroke-width="3.5"/>'


def _legend(found: Sequence[Interlock], score: float, top: float) -> str:
    """The score, and what the marks mean with how many there are."""
    y = top + 18.0
    marks = (
        (_line(0, -6, 26, -6, INK, 3.0), f"head joints {sum(len(one.head) for one in found)}"),
        (_line(0, -6, 26, -6, ALIGNED, 7.0), f"aligned {sum(len(np.unique(one.aligned)) for one in found)}"),
        (_line(0, -6, 26, -6, FORCE, 2.0, "5 4"), f"running joints {sum(len(one.running) for one in found)}"),
        (_ring(13, -6), f"crossings {sum(len(one.crossings) for one in found)}"),
    )
    parts = [f'<text x="{MARGIN:g}" y="{y:g}" font-weight="600">J = {score:.3f}</text>']
    for x, (mark, text) in zip(COLUMNS, marks, strict=True):
        parts.append(f'<g transform="translate({x:g} {y:g})">{mark}<text x="36" y="0">{text}</text></g>')
    return "".join(parts)
