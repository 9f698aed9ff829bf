"""The order of building as tables: every step, what stands meanwhile, and what the crane has to lift."""

from collections.abc import Iterator, Sequence
from itertools import zip_longest

import numpy as np

from cyclopean.design.construction.laying import LaidStone
from cyclopean.design.construction.sequence import BuildSequence
from cyclopean.view.colours import INK, LINE
from cyclopean.view.figures import number
from cyclopean.view.site.paper import BOLD, HEADING, Form, Page, columns, portions, words, wrapped
from cyclopean.view.site.paper import LINE as PITCH
from cyclopean.view.svg import layer

ROW = 5.2  # mm, height of a row
MOST = 4  # lines of a step
SHARES = (0.05, 0.16, 0.06, 0.08, 0.15, 0.30, 0.20)  # of the width: one for each column
HEAD = ("Step", "Stone", "Layer", "Mass, kg", "Size, mm", "Rests on", "Props")
# kg up to which a stone is lifted by what; 25 and 50 are what Europe's safety rules have for one person and for two
CRANE = ((25.0, "one person"), (50.0, "two people"), (250.0, "a hoist"), (1000.0, "a light crane"), (np.inf, "a crane"))
HEAVIEST = 10  # stones that are listed


def kilograms(mass: float) -> str:
    """A mass (kg) to a tenth below 10 kg, else to the kilogram; a dash where no density is known."""
    return "-" if not np.isfinite(mass) else f"{mass:.1f}" if mass < 10.0 else f"{mass:,.0f}"


def millimetres(stone: LaidStone) -> str:
    """Its box: along the wall, from face to back, up."""
    return " x ".join(f"{1000.0 * length:.0f}" for length in stone.size)


def named(sequence: BuildSequence, blocks: Sequence[int]) -> str:
    """Blocks by their step numbers, supports by name."""
    step = {one.block: str(k) for k, one in enumerate(sequence.steps, 1)}
    return ", ".join(step.get(i, sequence.assembly.blocks[i].id) for i in blocks)


def order_pages(sequence: BuildSequence, stones: Sequence[LaidStone], form: Form) -> tuple[Page, ...]:
    """Every step, in so many tables as it takes."""
    x, y, wide, high = form.room
    rooms = [share * wide for share in SHARES]
    steps = []
    for stone in stones:  # in so many lines as its longest column takes
        cells = [wrapped(said, room - 2.0, MOST) for said, room in zip(_row(sequence, stone), rooms, strict=True)]
        steps.append((stone.step, list(zip_longest(*cells, fillvalue=""))))
    pages = []
    for part in _filled(steps, high - 2.0 * ROW - HEADING):
        first, last = part[0][0], part[-1][0]
        row = y + HEADING + ROW + 1.0
        drawn = [words(x, y + HEADING, f"Order of laying, steps {first} to {last}", HEADING, BOLD)]
        drawn.append(columns(x, rooms, HEAD, row + 0.72 * ROW, BOLD))
        row += ROW
        for step, lines in part:
            drawn.append(f'<path d="M{x:.2f} {row:.2f}h{wide:.2f}" stroke="{INK if step == first else LINE}" {_THIN}/>')
            drawn += [columns(x, rooms, line, row + 0.72 * ROW + k * PITCH) for k, line in enumerate(lines)]
            row += _height(lines)
        pages.append(Page("order", f"Order of laying, {first} to {last}", (layer("order", drawn),)))
    return tuple(pages)


Rows = list[tuple[str, ...]]  # lines of a step, each with all columns


def _height(lines: Rows) -> float:
    return ROW + (len(lines) - 1) * PITCH


def _filled(steps: Sequence[tuple[int, Rows]], room: float) -> Iterator[list[tuple[int, Rows]]]:
    """Steps of one page after the other, as many as fit its room (mm)."""
    page: list[tuple[int, Rows]] = []
    used = 0.0
    for one in steps:
        if page and used + _height(one[1]) > room:
            yield page
            page, used = [], 0.0
        page.append(one)
        used += _height(one[1])
    if page:
        yield page


_THIN = 'stroke-width="0.2" fill="none"'


def _row(sequence: BuildSequence, stone: LaidStone) -> tuple[str, ...]:
    own, others = ([f"P{one.number}" for one in stone.props if one.own == its] for its in (True, False))
    props = [f"held by {', '.join(own)}"] if own else []
    props += [f"{', '.join(others)} stand{'s' * (len(others) == 1)}"] if others else []
    return (
        str(stone.step),
        stone.id,
        str(stone.layer),
        kilograms(stone.mass),
        millimetres(stone),
        named(sequence, stone.rests_on),
        "; ".join(props),
    )


def props_and_masses(
    sequence: BuildSequence, stones: Sequence[LaidStone], form: Form, work: Sequence[str] = (), left: Sequence[str] = ()
) -> tuple[Page, ...]:
    """Props with their times, masses for whoever lifts, totals; lines of the work, and of what is left over."""
    x, y, wide, high = form.room
    room = wide / 2.0 - 6.0
    lines = [
        ("Totals", True), *((line, False) for line in (*_totals(sequence, stones), *work)), ("", False),
        ("Masses", True), *((line, False) for line in _masses(stones)), ("", False),
        ("Props and centrings", True), *((line, False) for line in _props(sequence)),
        *((("", False), ("Left over, litres of each", True), *((line, False) for line in left)) if left else ()),
    ]  # fmt: skip
    flowed = [(part, bold) for line, bold in lines for part in (wrapped(line, room) or [""])]
    fits = int((high - HEADING - 8.0) / PITCH)
    pages = []
    for two in portions(portions(flowed, fits), 2):
        drawn = [words(x, y + HEADING, "Props, masses and totals", HEADING, BOLD)]
        for column, part in enumerate(two):
            begin = x + column * (wide / 2.0)
            for k, (said, bold) in enumerate(part):
                if said:
                    drawn.append(words(begin, y + HEADING + 8.0 + k * PITCH, said, more=BOLD if bold else ""))
        pages.append(Page("props-and-masses", "Props, masses and totals", (layer("order", drawn),)))
    return tuple(pages)


def _totals(sequence: BuildSequence, stones: Sequence[LaidStone]) -> Iterator[str]:
    volume = np.abs(sequence.assembly.mass.volume)[[stone.block for stone in stones]]
    mass = sum(stone.mass for stone in stones)
    yield f"{len(stones)} stones in {len({stone.layer for stone in stones})} layers, {len(sequence.props)} props."
    yield f"Stone laid: {number(float(volume.sum()), 4)} m³, {kilograms(mass)} kg."
    if assumed := sequence.assumed.get("density"):
        yield f"Masses assume {assumed:g} kg/m³, which nobody said; weigh a stone before you trust them."
    for word in ("unstable", "undecided"):
        steps = [k for k, step in enumerate(sequence.steps, 1) if step.verdict == word and step.propped != "stable"]
        if steps:
            yield f"Not proved to stand, even with the props below, after step {', '.join(map(str, steps[:12]))}."


def _masses(stones: Sequence[LaidStone]) -> Iterator[str]:
    low = 0.0
    for most, by in CRANE:
        count = sum(low < stone.mass <= most for stone in stones)
        if count:
            upto = f"{low:g} to {most:g} kg" if np.isfinite(most) else f"over {low:g} kg"
            yield f"{count} stones of {upto}: {by}."
        low = most
    heaviest = sorted(stones, key=lambda stone: (-round(stone.mass, 1), stone.step))[:HEAVIEST]
    if heaviest and np.isfinite(heaviest[0].mass):
        yield "Heaviest: " + ", ".join(f"{stone.step} ({kilograms(stone.mass)} kg)" for stone in heaviest) + "."


def _props(sequence: BuildSequence) -> Iterator[str]:
    if not sequence.props:
        yield "None: nothing has to be held."
    whole = sequence.assembly
    ids, masses = [b.id for b in whole.blocks], whole.densities(sequence.density) * np.abs(whole.mass.volume)
    for k, prop in enumerate(sequence.props, 1):
        mass = sum(masses[list(prop.blocks)].tolist())
        said = f"stone{'s' * (len(prop.blocks) > 1)} {named(sequence, prop.blocks)}, {kilograms(mass)} kg in all"
        yield f"P{k}: {prop.said(ids)} ({said})."
