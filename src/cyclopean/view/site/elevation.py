"""Elevations and plan to a standard scale, each stone with its number in the order of building.

There are as many views as it takes to show every number: front, back, ends, plan. A number stands where its stone is
seen, and is left out of a view where there is no room for it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.construction.laying import axes_of
from cyclopean.design.construction.sequence import BuildSequence
from cyclopean.errors import InputError
from cyclopean.texts import first_few
from cyclopean.view.building import STONES, middle_of, painting_order
from cyclopean.view.site import dimensions
from cyclopean.view.site.bodies import Body, Solid, on_paper, sliced, solid_of_block
from cyclopean.view.site.paper import BOLD, HEADING, LETTERS, SCALES, Form, Page, standard_scale, words
from cyclopean.view.svg import Paper, View, layer, project

LEFT, TOP, RIGHT, FOOT = 24.0, 14.0, 30.0, 36.0  # mm round the stones: dimensions, heading, levels, scale bar
BEYOND = 9.0  # mm that supports are shown beyond the stones
GROUND = "#b9bfc4"  # supports
LARGEST = 5.0  # mm, letters of a stone's number
TIGHT = 0.62, 0.74  # width and height of a digit in its size
CLEAR = 0.3  # mm between a number and the rim of its stone
BAR_HIGH = 14.0  # mm that the scale takes at the foot
PARTS = 24  # sheets that a front may be parted into
ENOUGH = 0.95  # share of the numbers that are left, which parts are to show
EDGE = 0.004  # of the length: nearer to its end no stone is cut by the section
MOST_OPENINGS = 8  # that are measured; more are chinks of a wall of rubble


@dataclass(frozen=True, slots=True, eq=False)
class Elevations:
    """Sheets of elevations, and what is to be said of them."""

    pages: tuple[Page, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """A side from which the structure is drawn."""

    name: str
    view: View
    upright: bool = True
    cut: float | None = None  # m away from the viewer, of a section: what lies nearer is left out
    section: float | None = None  # m along, where the sheet says that a section is cut


def _sides(sequence: BuildSequence, solids: Sequence[Solid]) -> tuple[_Side, ...]:
    along, into, up = axes_of(sequence)
    at = _section_at([solids[step.block].vertices @ along for step in sequence.steps])
    return (
        _Side("Front elevation", View(along, into, up), section=at),
        _Side("Back elevation", View(-along, -into, up)),
        _Side("Plan", View(along, -up, into), upright=False, section=None),
        _Side("Section A-A", View(-into, along, up), cut=at),
        _Side("Right end", View(into, -along, up)),
        _Side("Left end", View(-into, along, up)),
    )


def _section_at(along: Sequence[Floats]) -> float | None:
    """Where to cut, near the middle: through as many stones as can be, none of them at its end."""
    if not along:
        return None
    low, high = np.array([x.min() for x in along]), np.array([x.max() for x in along])
    span = float(high.max() - low.min())
    places = low.min() + span * (0.5 + np.array([0.0, 0.02, -0.02, 0.05, -0.05, 0.1, -0.1]))
    count = [int(((low < x - EDGE * span) & (high > x + EDGE * span)).sum()) for x in places.tolist()]
    return float(places[int(np.argmax(count))])


def elevation_pages(sequence: BuildSequence, form: Form, scale: int | None = None) -> Elevations:
    """Draw a structure from all sides, cut through, and larger in parts where that takes to number every stone.

    The `scale`, as 1 to so much, is taken where it fits; else the largest standard one that does, which is told.

    Raises
    ------
    InputError
        The structure is too large for the paper at 1:1000.
    """
    solids = [solid_of_block(block) for block in sequence.assembly.blocks]
    left = {step.block for step in sequence.steps}
    pages: list[Page] = []
    other: dict[int, list[str]] = {}  # sides that the scale that was asked for does not fit, by their own
    for side in _sides(sequence, solids):
        view = _whole(sequence, solids, side, form, scale)
        if scale is not None and view.scale != scale:
            other.setdefault(view.scale, []).append(side.name.lower())
        told = dict(view.numbers())
        pages.append(view.page(told))
        left -= told.keys()
    for part, told in _details(sequence, solids, form, left):
        pages.append(part.page(told))
        left -= told.keys()
    notes = [f"1:{scale} does not fit on {form.paper}; 1:{k} on {', '.join(names)}" for k, names in other.items()]
    if left:
        steps = [str(k) for k, step in enumerate(sequence.steps, 1) if step.block in left]
        notes.append(f"no room on any elevation for the number of {first_few(steps, 12)}; see the cards")
    return Elevations(tuple(pages), tuple(notes))


def _whole(sequence: BuildSequence, solids: Sequence[Solid], side: _Side, form: Form, asked: int | None) -> "_Drawn":
    """All of a side on one sheet, at the largest scale that fits, or a smaller one that was asked for."""
    low, span = _extent(sequence, solids, side)
    x, y, wide, high = form.room
    room = wide - LEFT - RIGHT, high - TOP - FOOT
    best = standard_scale((float(span[0]), float(span[1])), room)
    if best is None:
        raise InputError(f"`site`: {span[0]:.0f} m by {span[1]:.0f} m do not fit on {form.paper} at 1:1000")
    scale = best if asked is None or asked < best else asked
    size = 1000.0 / scale * span
    left, foot = x + LEFT + (room[0] - size[0]) / 2.0, y + TOP + size[1] + (room[1] - size[1]) / 2.0
    beyond = BEYOND if side.upright else BEYOND / 2.0
    window = left - beyond, foot - size[1] - beyond / 2.0, left + size[0] + beyond, foot + beyond
    return _Drawn.of(sequence, solids, side, form, _Frame(scale, low, span, (left, foot), window))


def _details(
    sequence: BuildSequence, solids: Sequence[Solid], form: Form, left: set[int]
) -> Iterator[tuple["_Drawn", dict[int, str]]]:
    """Parts of the front, larger, in as many sheets as it takes for the numbers that had no room; none if too many."""
    side = _sides(sequence, solids)[0]
    low, span = _extent(sequence, solids, side)
    for scale in sorted(SCALES, reverse=True):
        frames = _parted(low, span, form, scale)
        if not left or len(frames) > PARTS:
            return
        if len(frames) > 1:
            parts = [_Drawn.of(sequence, solids, side, form, frame) for frame in frames]
            told = [dict(part.numbers()) for part in parts]
            if len(left & set().union(*told)) > ENOUGH * len(left):
                yield from zip(parts, told, strict=True)
                return


def _parted(low: Floats, span: Floats, form: Form, scale: int) -> list["_Frame"]:
    """A side in so many sheets as it takes, from the lowest left one; neighbours overlap a little."""
    left, top, wide, high = form.room[0], form.room[1] + TOP, form.room[2], form.room[3] - TOP - BAR_HIGH
    step_x, step_y = wide - BEYOND, high - BEYOND
    across, up = (
        max(int(np.ceil((1000.0 / scale * s + BEYOND) / step)), 1)
        for s, step in zip(span, (step_x, step_y), strict=True)
    )
    window = left, top, left + wide, top + high
    foot = left + BEYOND / 2.0, top + high - BEYOND / 2.0
    return [
        _Frame(
            scale,
            low,
            span,
            (foot[0] - i * step_x, foot[1] + j * step_y),
            window,
            f"part {j * across + i + 1} of {across * up}",
        )
        for j in range(up)
        for i in range(across)
    ]


def _extent(sequence: BuildSequence, solids: Sequence[Solid], side: _Side) -> tuple[Floats, Floats]:
    """(2,) m: left foot, and width and height, of the stones as seen from a side."""
    free = [solids[step.block].vertices for step in sequence.steps] or [one.vertices for one in solids]
    flat = project(np.concatenate(free), side.view)[0]
    return flat.min(axis=0), np.ptp(flat, axis=0)


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    """Where on a sheet a side is drawn."""

    scale: int
    low: Floats  # (2,) m, left foot of the stones
    span: Floats  # (2,) m
    foot: tuple[float, float]  # mm, where the left foot lies on the sheet, or would
    window: tuple[float, float, float, float]  # mm: left, top, right, foot of what is shown
    part: str = ""  # of several


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    """A structure as it is seen from one side, on paper."""

    side: _Side
    form: Form
    frame: _Frame
    sequence: BuildSequence
    solids: Sequence[Solid]
    bodies: dict[int, Body]  # by block, the furthest first

    @classmethod
    def of(cls, sequence: BuildSequence, solids: Sequence[Solid], side: _Side, form: Form, frame: _Frame) -> "_Drawn":
        """Draw every block of which something is seen."""
        paper = Paper(side.view, frame.low, np.array(frame.foot), 1000.0 / frame.scale)
        bodies: dict[int, Body] = {}
        slices: dict[int, Body] = {}
        near = -np.inf if side.cut is None else side.cut
        left, top, right, foot = frame.window
        for i in painting_order(sequence, side.view.sight):
            flat, far = paper.of(solids[i].vertices), project(solids[i].vertices, side.view)[1]
            (a, b), (c, d) = flat.min(axis=0), flat.max(axis=0)
            if far.max() <= near or not (a < right and left < c and b < foot and top < d):
                continue
            if far.min() < near:
                slices[i] = sliced(solids[i], paper, near)
            else:
                bodies[i] = on_paper(solids[i], paper)
        return cls(side, form, frame, sequence, solids, bodies | slices)

    @property
    def scale(self) -> int:
        """1 to so much."""
        return self.frame.scale

    @property
    def box(self) -> tuple[float, float, float, float]:
        """mm: left, top, right, foot of the stones."""
        (left, foot), size = self.frame.foot, 1000.0 / self.scale * self.frame.span
        return left, float(foot - size[1]), float(left + size[0]), foot

    def numbers(self) -> Iterator[tuple[int, str]]:
        """Blocks whose numbers have room where they are seen, and the number drawn."""
        import shapely

        window = shapely.box(*self.frame.window)

        step = {one.block: k for k, one in enumerate(self.sequence.steps, 1)}
        order = list(self.bodies)
        outlines = [self.bodies[i].outline for i in order]
        tree = shapely.STRtree(outlines)
        for place, block in enumerate(order):
            if block not in step:
                continue
            above = tree.query(outlines[place], predicate="intersects")
            hidden = shapely.union_all([outlines[k] for k in above if k > place])
            seen = outlines[place].difference(hidden)
            seen = seen.intersection(window) if self.frame.part else seen
            if drawn := numbered(seen, str(step[block])):
                yield block, drawn

    def page(self, told: dict[int, str]) -> Page:
        """The sheet."""
        import shapely

        window = shapely.box(*self.frame.window)
        held = set(np.flatnonzero(self.sequence.fixed).tolist())
        tints = self.sequence.colour % len(STONES)
        stones = (
            layer("supports", [body.drawn(GROUND, window)], solid=True)
            if i in held
            else layer("stones", [body.drawn(STONES[tints[i]], window if self.frame.part else None)], solid=True)
            for i, body in self.bodies.items()
        )
        whole = not self.frame.part
        title = f"{self._name()}, numbers in the order of laying{self._range()}"
        parts = (
            *stones,
            layer("numbers", told.values()),
            layer("dimensions", self._dimensions() if whole else ()),
            layer("datum", dimensions.datum(self.box, self.scale, BEYOND) if self.side.upright and whole else ()),
            layer("section", self._section_mark() if whole else ()),
            layer("headings", [words(self.form.room[0], self.form.room[1] + HEADING, title, HEADING, BOLD)]),
            dimensions.scale_mark(self.form, self.scale),
            dimensions.axes_mark(self.form, self.side.view, axes_of(self.sequence)),
        )
        return Page("elevation", self._name(), parts, f"1:{self.scale}", 1000.0 / self.scale, self.frame.foot)

    def _name(self) -> str:
        return self.side.name + (f", {self.frame.part}" if self.frame.part else "")

    def _range(self) -> str:
        """Which part of the structure a sheet shows."""
        if not self.frame.part:
            return ""
        (x, y), (left, top, right, foot), times = self.frame.foot, self.frame.window, self.scale / 1000.0
        wide, high = self.frame.span.tolist()
        across = max((left - x) * times, 0.0), min((right - x) * times, wide)
        up = max((y - foot) * times, 0.0), min((y - top) * times, high)
        return f": {across[0]:.2f} to {across[1]:.2f} m along, {up[0]:.2f} to {up[1]:.2f} m up"

    def _dimensions(self) -> Iterator[str]:
        """Over all; of an upright side its level courses and its openings too."""
        left, _, right, foot = self.box
        courses, holes = (self._courses(), self._openings()) if self.side.upright else ([], [])
        if holes:
            ends = sorted({left, right, *(x for a, _, c, _ in holes for x in (a, c))})
            yield from dimensions.chain(ends, foot + BEYOND + 4.5, self.scale, foot + 1.0)
            yield from dimensions.clear_sizes(holes, foot, self.scale)
        if courses:
            yield from dimensions.chain(courses, left - BEYOND - 2.0, self.scale, left - 1.0, upright=True)
        below, beside = BEYOND + (10.5 if holes else 4.5), BEYOND + (8.0 if courses else 2.0)
        yield from dimensions.overall(self.box, self.scale, below, beside)

    def _section_mark(self) -> Iterator[str]:
        if self.side.section is not None:
            (left, foot), times = self.frame.foot, 1000.0 / self.scale
            x = left + times * (self.side.section - float(self.frame.low[0]))
            yield from dimensions.section_mark(x, self.box[1], foot)

    def _courses(self) -> list[float]:
        """Level joints, mm of paper, from the foot."""
        up = [self.solids[step.block].vertices @ self.side.view.up for step in self.sequence.steps]
        found = dimensions.level_joints(np.array([z.min() for z in up]), np.array([z.max() for z in up]))
        return [self.box[3] - 1000.0 / self.scale * (z - found[0]) for z in found]

    def _openings(self) -> list[tuple[float, float, float, float]]:
        found = dimensions.openings((body.outline for body in self.bodies.values()), self.box, self.scale)
        return found if len(found) <= MOST_OPENINGS else []


def numbered(region: Any, said: str) -> str:
    """A number within what is seen of a stone, as large as there is room; nothing where there is none."""
    import shapely

    part = max(shapely.get_parts(region), key=lambda one: one.area, default=None)
    if part is None or part.geom_type != "Polygon" or part.is_empty:
        return ""
    ring = shapely.get_coordinates(part.exterior)[:-1]
    x, y, _ = middle_of(ring)
    for turn in (0, -90):
        for size in (LARGEST, 4.0, LETTERS):
            half = np.array([TIGHT[0] * len(said), TIGHT[1]]) * size / 2.0 + CLEAR
            across, up = half if turn == 0 else half[::-1]
            if part.contains(shapely.box(x - across, y - up, x + across, y + up)):
                style = f"{dimensions.MIDDLE} {BOLD}" + (f' transform="rotate({turn} {x:.1f} {y:.1f})"' if turn else "")
                return words(x, y + 0.36 * size, said, size, style)
    return ""
