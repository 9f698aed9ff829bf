"""The order of building as small pictures: what stands after so many steps, what is new, which props stand then."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.construction.laying import axes_of
from cyclopean.design.construction.sequence import BuildSequence
from cyclopean.view.building import STONES, painting_order
from cyclopean.view.colours import INK
from cyclopean.view.site.bodies import Solid, covered, on_paper
from cyclopean.view.site.elevation import GROUND, numbered
from cyclopean.view.site.paper import BOLD, BOLDER, HEADING, LETTERS, LINE, Form, Page, portions, shortened, words
from cyclopean.view.svg import Paper, View, layer, project

GRIDS = {"A4": ((3, 4), (4, 3), (6, 2)), "A3": ((4, 5), (5, 4), (7, 3))}  # pictures across and down
PAGES = 2  # sheets of pictures at most: each picture shows more steps where there are many
APART, CAPTION = 5.0, 5.5  # mm between pictures, and below each for its words
STANDING = "#e6e2d8"  # what stood before
COARSE = 0.05  # mm: finer corners of outlines are left out
NUMBERED = 150  # stones of a structure up to which the new ones have numbers


@dataclass(frozen=True, slots=True, eq=False)
class _Stones:
    """Outlines of all stones at the scale of the pictures, from the left foot of the structure, the furthest first."""

    shape: dict[int, Any]  # of shapely, mm
    path: dict[int, str]
    size: Floats  # (2,) mm


def stage_pages(sequence: BuildSequence, solids: Sequence[Solid], form: Form) -> tuple[Page, ...]:
    """Small front elevations of the stages, on two sheets at most.

    Parameters
    ----------
    sequence : BuildSequence
        The structure and how it is built.
    solids : sequence of Solid
        All of its blocks.
    form : Form
        Paper.
    """
    steps = len(sequence.steps)
    if not steps:
        return ()
    x, y, wide, high = form.room
    along, into, up = axes_of(sequence)
    view = View(along, into, up)
    flat = project(np.concatenate([solids[step.block].vertices for step in sequence.steps]), view)[0]
    span = np.maximum(np.ptp(flat, axis=0), 1e-9)

    def times(grid: tuple[int, int]) -> float:
        room = wide / grid[0] - APART, (high - HEADING - 4.0) / grid[1] - APART - CAPTION
        return float(min(room[0] / span[0], room[1] / span[1]))

    across, down = max(GRIDS[form.paper], key=times)
    stones = _outlines(sequence, solids, Paper(view, flat.min(axis=0), np.zeros(2), times((across, down))), span)
    each = -(-steps // (across * down * PAGES))
    pages = []
    for part in portions([range(k, min(k + each, steps)) for k in range(0, steps, each)], across * down):
        drawn: list[str] = []
        for k, new in enumerate(part):
            left = x + (k % across) * wide / across
            foot = y + HEADING + 4.0 + (k // across + 1) * (high - HEADING - 4.0) / down - CAPTION - APART / 2.0
            drawn += _picture(sequence, stones, new, (left, foot), wide / across - APART)
        title = f"Stages, steps {part[0][0] + 1} to {part[-1][-1] + 1}"
        head = layer("headings", [words(x, y + HEADING, title, HEADING, BOLD)])
        pages.append(Page("stages", title, (head, *drawn)))
    return tuple(pages)


def _outlines(sequence: BuildSequence, solids: Sequence[Solid], paper: Paper, span: Floats) -> _Stones:
    shape, size = {}, paper.scale * span
    for i in painting_order(sequence, paper.view.sight):
        outline = on_paper(solids[i], paper).outline.simplify(COARSE)
        if sequence.fixed[i]:  # supports are shown a little beyond the stones
            import shapely

            outline = outline.intersection(shapely.box(-1.5, -size[1] - 1.5, size[0] + 1.5, 1.5))
        shape[i] = outline
    return _Stones(shape, {i: covered(one, 2) for i, one in shape.items()}, size)


def _picture(
    sequence: BuildSequence, stones: _Stones, new: range, at: tuple[float, float], room: float
) -> Iterator[str]:
    """What stands after the last of some new steps (from 0), in its middle; its left foot at a point (mm)."""
    step = {one.block: k for k, one in enumerate(sequence.steps)}
    shown = [i for i in stones.path if i not in step or step[i] <= new[-1]]
    parts = []
    for i in shown:
        fresh = step.get(i, -1) in new
        tint = GROUND if i not in step else STONES[int(sequence.colour[i]) % len(STONES)] if fresh else STANDING
        if stones.path[i]:
            style = f'fill="{tint}" stroke="{INK}" stroke-width="{0.3 if fresh else 0.1}" stroke-linejoin="round"'
            parts.append(f'<path d="{stones.path[i]}" {style}/>')
    left = at[0] + (room - float(stones.size[0])) / 2.0
    yield layer("stages", [f'<g transform="translate({left:.2f} {at[1]:.2f})">{"".join(parts)}</g>'])
    if len(step) <= NUMBERED:
        said = {i: str(step[i] + 1) for i in shown if step.get(i, -1) in new}
        yield layer("numbers", _numbers(stones, shown, said, (left, at[1])))
    steps = f"{new[0] + 1} to {new[-1] + 1}" if len(new) > 1 else f"{new[0] + 1}"
    props = [f"P{k}" for k, prop in enumerate(sequence.props, 1) if prop.first <= new[-1] and prop.last >= new[0]]
    told = f"Step {steps}" + (f"; {', '.join(props)}" if props else "")
    yield layer("names", [words(at[0], at[1] + LINE, shortened(told, room, LETTERS * BOLDER), more=BOLD)])


def _numbers(stones: _Stones, shown: Sequence[int], said: dict[int, str], at: tuple[float, float]) -> Iterator[str]:
    """Numbers of new stones where they are seen and there is room."""
    import shapely
    from shapely.affinity import translate

    for place, i in enumerate(shown):
        if i in said:
            before = [stones.shape[k] for k in shown[place + 1 :] if stones.shape[k].intersects(stones.shape[i])]
            yield numbered(translate(stones.shape[i].difference(shapely.union_all(before)), *at), said[i])
