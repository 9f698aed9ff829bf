"""A card for each stone: seen from three sides, how heavy it is, where to sling it, what lies around it, when.

The three sides stand as on any drawing of a part in third-angle projection: the top above the face, the right end at
the right of it, all at one scale.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.construction.laying import Holding, LaidStone, axes_of
from cyclopean.design.construction.sequence import BuildSequence
from cyclopean.view.building import STONES
from cyclopean.view.colours import INK, SOFT
from cyclopean.view.site.bodies import Solid, on_paper
from cyclopean.view.site.order import kilograms, named
from cyclopean.view.site.paper import (
    BOLD,
    BOLDER,
    HEADING,
    LETTERS,
    LINE,
    Form,
    Page,
    portions,
    shortened,
    standard_scale,
    width,
    words,
    wrapped,
)
from cyclopean.view.svg import Paper, View, layer, project, rect

MOST = 8  # cards on a page; on A4 smaller ones have no room for their words
GRID = {1: (1, 1), 2: (2, 1), 3: (3, 1), 4: (2, 2), 5: (3, 2), 6: (3, 2), 7: (4, 2), 8: (4, 2)}  # columns, rows
GUTTER, PAD = 4.0, 3.0  # mm between cards, and within each
APART = 6.0  # mm between two pictures of a stone, and round them: room for arrows and names
# Of pictures that nobody measures: between the standard scales too, for small cards.
FINER_SCALES = (1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 25, 30, 40, 50, 60, 75, 100, 150, 200, 300, 500, 1000)
FACTS = 0.42  # of a card's height, that words may take
CLEAR = 2.0  # mm between the pictures' names and the words
TALL = 20.0  # mm, height of a picture beside which there is room for "this side up"
RED = "#b3261e"  # the centre of gravity, which must not be missed
THIN = f'stroke="{INK}" stroke-width="0.18" fill="none"'


class Place(NamedTuple):
    """A rectangle of a page, mm."""

    x: float
    y: float
    wide: float
    high: float


Card: TypeAlias = tuple[int, Callable[[Place], Iterator[str]]]  # its step, and what draws it in the place it is given


def drawn_pages(kind: str, title: str, cards: Sequence[Card], form: Form, each: int) -> tuple[Page, ...]:
    """Cards on pages, so many on each."""
    x, y, wide, high = form.room
    across, down = GRID[each]
    size = (wide - (across - 1) * GUTTER) / across, (high - (down - 1) * GUTTER) / down
    pages = []
    for part in portions(cards, each):
        drawn = []
        for k, (_, card) in enumerate(part):
            place = Place(x + k % across * (size[0] + GUTTER), y + k // across * (size[1] + GUTTER), *size)
            drawn.append(layer("frames", [rect(*place, THIN, 2)]))
            drawn += card(place)
        first, last = part[0][0], part[-1][0]
        steps = f"{first}" if first == last else f"{first} to {last}"
        pages.append(Page(kind, f"{title} {steps}", tuple(drawn)))
    return tuple(pages)


def card_pages(
    sequence: BuildSequence,
    stones: Sequence[LaidStone],
    solids: Sequence[Solid],
    source: Mapping[int, str],
    form: Form,
    each: int,
) -> tuple[Page, ...]:
    """Cards of all stones; `source` says of what a block is made, where that is known."""
    cards = [(stone.step, partial(_card, sequence, stone, solids[stone.block], source)) for stone in stones]
    return drawn_pages("cards", "Stones", cards, form, each)


def _card(
    sequence: BuildSequence, stone: LaidStone, solid: Solid, source: Mapping[int, str], place: Place
) -> Iterator[str]:
    """Heading, pictures, facts."""
    room = place.wide - 2.0 * PAD
    yield heading(place, str(stone.step), stone.id, f"step {stone.step} of {len(sequence.steps)}")
    most = max(int(FACTS * place.high / LINE), 6)
    lines = [part for fact in facts(sequence, stone, source.get(stone.block, "")) for part in wrapped(fact, room, 3)]
    lines = lines if len(lines) <= most else [*lines[: most - 1], shortened(f"{lines[most - 1]} …", room)]
    top = place.y + PAD + HEADING + 1.0
    foot = place.y + place.high - PAD - LINE * len(lines)
    tint = STONES[int(sequence.colour[stone.block]) % len(STONES)]
    yield from _pictures(sequence, stone, solid, tint, Place(place.x + PAD, top, room, foot - top - CLEAR))
    said = (words(place.x + PAD, foot + (k + 0.8) * LINE, line) for k, line in enumerate(lines))
    yield layer("facts", said)


def heading(place: Place, step: str, name: str, right: str) -> str:
    """Number, name, and at the right something more."""
    y, end = place.y + PAD + 0.75 * HEADING, place.x + place.wide - PAD
    number = 1.4 * HEADING
    x = place.x + PAD + width(step, number * BOLDER) + 2.0
    room = end - x - width(right) - 2.0
    parts = [
        words(place.x + PAD, y + 0.6, step, number, BOLD),
        words(x, y, shortened(name, room, HEADING * BOLDER), HEADING, BOLD),
        words(end, y, right, more='text-anchor="end"'),
    ]
    return layer("headings", parts)


def facts(sequence: BuildSequence, stone: LaidStone, source: str = "") -> Iterator[str]:
    """What a card says of a stone, the most important first."""
    along, deep, up = (f"{1000.0 * length:.0f}" for length in stone.size)
    left, face, bed = (f"{1000.0 * length:.0f}" for length in stone.centre)
    yield f"Mass {kilograms(stone.mass)} kg. {along} along, {deep} deep, {up} high (mm)."
    yield f"Centre of gravity (mm): {left} from left end, {face} behind face, {bed} above bed."
    if source:
        yield source
    around = (("on", stone.rests_on), ("beside", stone.beside), ("carries", stone.carries))
    said = "; ".join(f"{what} {named(sequence, blocks)}" for what, blocks in around if blocks)
    yield f"Layer {stone.layer}; {said or 'on nothing'}."
    for one in stone.props:
        yield _held(sequence, one)


def _held(sequence: BuildSequence, one: Holding) -> str:
    """What a prop has to do with a stone."""
    prop = one.prop
    until = "for good" if prop.until is None else f"until {named(sequence, (prop.until,))} is laid"
    if one.own:
        return f"Held by P{one.number}, {prop.kind}, {until}."
    freed = prop.until is not None and prop.until == sequence.steps[min(prop.last + 1, len(sequence.steps) - 1)].block
    return f"P{one.number} ({prop.kind}) stands, {until}." if freed or prop.until is None else f"P{one.number} stands."


@dataclass(frozen=True, slots=True, eq=False)
class _Third:
    """Three pictures of a box in third-angle projection."""

    times: float  # mm of paper a metre
    scale: int
    front: Floats  # (2,) mm, left foot of the face
    end: Floats  # (2,) of the right end
    top: Floats  # (2,) of the top


def _arranged(size: Floats, place: Place) -> _Third | None:
    """As large as the place allows; None where there is no room even at 1:1000."""
    room = place.wide - 3.0 * APART, place.high - 3.0 * APART
    scale = standard_scale((float(size[0] + size[1]), float(size[2] + size[1])), room, FINER_SCALES)
    if scale is None:
        return None
    times = 1000.0 / scale
    wide, deep, high = (times * size).tolist()
    x = place.x + APART + (room[0] - wide - deep) / 2.0
    foot = place.y + APART + (room[1] - high - deep) / 2.0 + deep + APART + high
    return _Third(
        times, scale, np.array([x, foot]), np.array([x + wide + APART, foot]), np.array([x, foot - high - APART])
    )


def _pictures(sequence: BuildSequence, stone: LaidStone, solid: Solid, tint: str, place: Place) -> Iterator[str]:
    """Face, right end and top, with the centre of gravity, the ways up and along, and dimensions."""
    third = _arranged(stone.size, place)
    if third is None:
        return
    axes = axes_of(sequence)
    along, into, up = axes
    views = (
        (View(along, into, up), third.front),
        (View(into, -along, up), third.end),
        (View(along, -up, into), third.top),
    )
    centre = sequence.assembly.mass.centroid[stone.block]
    marks = []
    for view, foot in views:
        paper = Paper(view, project(solid.vertices, view)[0].min(axis=0), foot, third.times)
        yield layer("stones", [on_paper(solid, paper).drawn(tint)])
        marks.append(_centre(paper.of(centre)))
    yield layer("centre-of-gravity", marks)
    (x, y), (wide, _, high) = third.front.tolist(), (third.times * stone.size).tolist()
    rise, run = min(max(high, 6.0), TALL), min(max(wide, 8.0), 18.0)
    arrows = _arrow(x - 3.0, y, x - 3.0, y - rise), _arrow(x, y + 2.4, x + run, y + 2.4)
    yield layer("arrows", arrows)  # up, at the left of the face; along the wall, below it
    yield layer("names", _names(third, third.times * stone.size, place))


def _centre(at: Floats) -> str:
    """The sign of a centre of gravity: a circle with two quarters filled."""
    x, y = at.tolist()
    quarters = f"M{x:.2f} {y:.2f}h1.2a1.2 1.2 0 0 0 -1.2 -1.2zM{x:.2f} {y:.2f}h-1.2a1.2 1.2 0 0 0 1.2 1.2z"
    return (
        f'<circle cx="{x:.2f}" cy="{y:.2f}" r="1.2" fill="#ffffff" stroke="{RED}" stroke-width="0.25"/>'
        f'<path d="{quarters}" fill="{RED}"/>'
    )


def _arrow(x: float, y: float, to_x: float, to_y: float) -> str:
    """A shaft and a head of 2 mm."""
    way = np.array([to_x - x, to_y - y])
    way = 2.0 * way / float(np.hypot(*way))
    side = 0.35 * np.array([-way[1], way[0]])
    (a, b), (c, d) = (-way + side).tolist(), (-way - side).tolist()
    head = f"M{to_x:.2f} {to_y:.2f}L{to_x + a:.2f} {to_y + b:.2f}L{to_x + c:.2f} {to_y + d:.2f}Z"
    shaft = f"M{x:.2f} {y:.2f}L{to_x - way[0]:.2f} {to_y - way[1]:.2f}"
    return f'<path d="{shaft}" stroke="{INK}" stroke-width="0.5" fill="none"/><path d="{head}" fill="{INK}"/>'


def _names(third: _Third, size: Floats, place: Place) -> Iterator[str]:
    """What each picture shows, at its edge, and the scale."""
    (x, y), (wide, deep, high) = third.front.tolist(), size.tolist()
    yield words(
        x - 4.6, y, "this side up" if high >= TALL else "up", more=f'transform="rotate(-90 {x - 4.6:.1f} {y:.1f})"'
    )
    said = "face, along the wall"
    yield words(x, y + 6.0, said if width(said) < wide + APART - 2.0 else "face")
    yield words(min(third.end[0], place.x + place.wide - width("right end")), y + 6.0, "right end")
    yield words(x, third.top[1] - deep - 1.2, "top")
    yield words(
        place.x + place.wide, place.y + LETTERS, f"scale 1:{third.scale}", more=f'text-anchor="end" fill="{SOFT}"'
    )
