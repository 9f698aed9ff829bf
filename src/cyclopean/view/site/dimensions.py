"""What is measured on an elevation: over all, level courses, openings, levels; its scale and its axes.

Boxes are left, top, right, foot in mm of paper; lengths that are said are those of the structure.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.view.colours import INK, SOFT
from cyclopean.view.figures import number
from cyclopean.view.site.paper import BOLD, Form, width, words
from cyclopean.view.svg import View, layer, rect, round_length

Box = tuple[float, float, float, float]
LEVEL = 1e-3  # m: beds that differ by less are level
CLEAR = 0.15  # m: what is seen through and smaller is a joint or a chink, no opening
BAR = 80.0  # mm that the scale may be long
ARROW = 9.0  # mm
FINE = f'stroke="{INK}" stroke-width="0.18" fill="none"'
MIDDLE = 'text-anchor="middle"'


def overall(box: Box, scale: int, below: float, beside: float) -> Iterator[str]:
    """Width below and height at the left, so far (mm) from the stones."""
    left, top, right, foot = box
    yield from chain((left, right), foot + below, scale, foot + 1.0)
    yield from chain((foot, top), left - beside, scale, left - 1.0, upright=True)


def chain(ends: Sequence[float], at: float, scale: int, stones: float, *, upright: bool = False) -> Iterator[str]:
    """Dimensions one after the other along a line at `at` mm, with lines to where the stones end; equal ones as one.

    Lengths for which there is no room are left out.
    """
    lines = "".join(
        f"M{stones:.3f} {e:.3f}H{at:.3f}M{at - 1:.3f} {e + 1:.3f}l2 -2"
        if upright
        else f"M{e:.3f} {stones:.3f}V{at:.3f}M{e - 1:.3f} {at + 1:.3f}l2 -2"
        for e in ends
    )
    first, last = ends[0], ends[-1]
    line = f"M{at:.3f} {first:.3f}V{last:.3f}" if upright else f"M{first:.3f} {at:.3f}H{last:.3f}"
    yield f'<path d="{lines}{line}" {FINE}/>'
    for low, high, said in _runs(ends, scale):
        if width(said) <= abs(high - low):
            middle = (low + high) / 2.0
            x, y = (at - 1.4, middle) if upright else (middle, at - 1.4)
            yield words(x, y, said, more=MIDDLE + (f' transform="rotate(-90 {x:.1f} {y:.1f})"' if upright else ""))


def _runs(ends: Sequence[float], scale: int) -> Iterator[tuple[float, float, str]]:
    """Lengths that are equal to the millimetre and follow on each other, where they begin and end, and what is said."""
    lengths = [round(abs(b - a) * scale) for a, b in pairwise(ends)]
    begin = 0
    for k in range(1, len(ends)):
        if k == len(lengths) or lengths[k] != lengths[begin]:
            one = said_length(abs(ends[begin + 1] - ends[begin]) * scale / 1000.0)
            yield ends[begin], ends[k], one if k - begin == 1 else f"{k - begin} x {one}"
            begin = k


def said_length(length: float) -> str:
    """A length (m) to the millimetre."""
    return f"{length:.3f} m" if length >= 1.0 else f"{1000.0 * length:.0f} mm"


def level_joints(low: Floats, high: Floats) -> list[float]:
    """Heights (m) at which a level joint runs through the whole structure, its foot and top too; none if these alone.

    By hand: two courses of 0.2 m, and a stone beside them as high as both:

    >>> level_joints(np.array([0.0, 0.2]), np.array([0.2, 0.4]))
    [0.0, 0.2, 0.4]
    >>> level_joints(np.array([0.0, 0.2, 0.0]), np.array([0.2, 0.4, 0.4]))
    []
    """
    top = np.unique(high)
    top = top[np.append(np.diff(top) > LEVEL, True)]
    through = [z for z in top.tolist() if not ((low < z - LEVEL) & (high > z + LEVEL)).any()]
    return [float(low.min()), *through] if len(through) > 1 else []


def openings(outlines: Iterable[Any], box: Box, scale: int) -> list[Box]:
    """What is seen through between stones (geometries of shapely) over their foot, from the left."""
    import shapely

    left, _, right, foot = box
    ground = shapely.box(left, foot, right, foot + 1.0)
    least = 1000.0 * CLEAR / scale
    holes = [
        shapely.bounds(ring).tolist()
        for part in shapely.get_parts(shapely.union_all([*outlines, ground]))
        for ring in part.interiors
    ]
    return sorted((a, b, c, d) for a, b, c, d in holes if c - a >= least and d - b >= least)


def clear_sizes(holes: Iterable[Box], foot: float, scale: int) -> Iterator[str]:
    """Clear width and height of each opening, and how high its sill lies, where there is room within it."""
    for left, top, right, sill in holes:
        said = [f"{said_length((right - left) * scale / 1000.0)} x {said_length((sill - top) * scale / 1000.0)}"]
        rise = (foot - sill) * scale / 1000.0
        said += [f"sill +{rise:.3f} m"] if rise > LEVEL else []
        if max(map(width, said)) <= right - left - 2.0 and 4.4 * len(said) <= sill - top - 2.0:
            for k, line in enumerate(said):
                yield words((left + right) / 2.0, (top + sill) / 2.0 + 4.4 * k, line, more=MIDDLE)


def datum(box: Box, scale: int, beyond: float) -> Iterator[str]:
    """The level of the lowest bed, from which heights are measured, and that of the top."""
    left, top, right, foot = box
    end = right + beyond + 4.0
    dashes = 'stroke-dasharray="6 1.2 0.8 1.2"'
    yield f'<path d="M{left - beyond - 6:.3f} {foot:.3f}H{end:.3f}" {FINE.replace("0.18", "0.35")} {dashes}/>'
    yield f'<path d="M{right + 1:.3f} {top:.3f}H{end:.3f}" {FINE}/>'
    for y, said in ((foot, "datum 0.000"), (top, f"+{(foot - top) * scale / 1000.0:.3f} m")):
        yield f'<path d="M{end:.3f} {y:.3f}l-1.5 -2.4h3z" fill="{INK}"/>'
        yield words(end - 3.0, y - 3.2, said)


def section_mark(x: float, top: float, foot: float) -> Iterator[str]:
    """Where a section is cut, and which way it looks: to the right."""
    for y in (top - 5.0, foot + 5.0):
        yield f'<path d="M{x:.3f} {y - 2.5:.3f}v5" stroke="{INK}" stroke-width="0.7" fill="none"/>'
        yield f'<path d="M{x:.3f} {y:.3f}h4l-1.6 -0.8v1.6l1.6 -0.8" {FINE}/>'
        yield words(x - 1.2, y + 1.1, "A", more=f'text-anchor="end" {BOLD}')


def axes_mark(form: Form, view: View, axes: Floats) -> str:
    """Two arrows: along the wall, from its face to its back, or up, as they are seen, with the model's own axes."""
    x, y = form.room[0] + form.room[2] - 36.0, form.room[1] + form.room[3] - 2.0
    parts = []
    for way, (right, up) in ((view.right, (1.0, 0.0)), (view.up, (0.0, -1.0))):
        share = axes @ way
        k = int(np.argmax(np.abs(share)))
        along = ARROW * float(np.sign(share[k]))
        end = x + along * right, y + along * up
        head = f"m{-0.9 * up:.2f} {0.9 * right:.2f}L{end[0] + along / 4 * right:.2f} {end[1] + along / 4 * up:.2f}"
        head += f"L{end[0] + 0.9 * up:.2f} {end[1] - 0.9 * right:.2f}z"
        parts.append(f'<path d="M{x:.2f} {y:.2f}L{end[0]:.2f} {end[1]:.2f}" {FINE.replace("0.18", "0.35")}/>')
        parts.append(f'<path d="M{end[0]:.2f} {end[1]:.2f}{head}" fill="{INK}"/>')
        said = ("along", "to the back", "up")[k] + _world(axes[k])
        if right:
            anchor = "start" if along > 0.0 else "end"
            parts.append(words(end[0] + along / 3.0, y, said, more=f'text-anchor="{anchor}" fill="{SOFT}"'))
        else:
            parts.append(words(x + 2.0, end[1], said, more=f'fill="{SOFT}"'))
    return layer("axes", parts)


def _world(axis: Floats) -> str:
    """Which of the model's axes a direction is, if any."""
    j = int(np.argmax(np.abs(axis)))
    return f" ({'-' if axis[j] < 0.0 else ''}{'xyz'[j]})" if abs(axis[j]) > 1.0 - 1e-6 else ""


def scale_mark(form: Form, scale: int) -> str:
    """A scale of five parts, black and white in turn."""
    x, y = form.room[0], form.room[1] + form.room[3] - 2.0
    length, _ = round_length(BAR * scale / 1000.0)
    part = length / 5.0 * 1000.0 / scale
    thin = f'stroke="{INK}" stroke-width="0.18"'
    parts = [
        rect(x + k * part, y - 2.0, part, 2.0, f'fill="{INK if k % 2 == 0 else "#ffffff"}" {thin}', 3) for k in range(5)
    ]
    unit, times = ("m", 1.0) if length >= 1.0 else ("mm", 1000.0)
    for k in (0, 1, 5):
        parts.append(words(x + k * part, y - 3.4, number(k * length / 5.0 * times), more=MIDDLE if k else ""))
    parts.append(words(x + 5.0 * part + 4.0, y, unit))
    said = f"Measure on the sheet only if this bar is {5.0 * part:.1f} mm long in print."
    return layer("scale", [*parts, words(x + 5.0 * part + 12.0, y, said, more=f'fill="{SOFT}"')])
