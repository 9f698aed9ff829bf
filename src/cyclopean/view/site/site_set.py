"""The set of sheets for whoever builds: elevations, stages, order, props, masses, cards, cuts, an index of many."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from cyclopean.design.construction.laying import LaidStone, axes_of, laid_stones
from cyclopean.design.construction.sequence import BuildSequence
from cyclopean.view.site.bodies import solid_of_block
from cyclopean.view.site.cards import card_pages
from cyclopean.view.site.cuts import CutStone, cut_pages, template_svg
from cyclopean.view.site.elevation import elevation_pages
from cyclopean.view.site.order import order_pages, props_and_masses
from cyclopean.view.site.paper import BOLD, HEADING, LINE, Form, Page, Title, columns, drawn, portions, words
from cyclopean.view.site.stages import stage_pages
from cyclopean.view.svg import layer

INDEXED = 40  # stones from which looking one up takes an index
ENTRY = (34.0, 14.0, 16.0)  # mm, columns of the index: stone, step, sheet


@dataclass(frozen=True, slots=True)
class LeftOver:
    """A stone, or a piece of one, that is not in the structure."""

    name: str
    volume: float  # m3
    why: str


@dataclass(frozen=True, slots=True, eq=False)
class Stock:
    """What is known of the stones as they were found or bought; nothing where a model alone is given."""

    cut: Mapping[int, CutStone] = field(default_factory=dict)  # stones that are cut, by block
    source: Mapping[int, str] = field(default_factory=dict)  # of what a block is made, as its card says it
    left: tuple[LeftOver, ...] = ()


@dataclass(frozen=True, slots=True)
class Layout:
    """How the sheets are drawn."""

    form: Form
    title: Title
    cards: int = 2  # on a page, 1 to 8
    scale: int | None = None  # of the elevations, 1 to so much; None = the largest standard one that fits
    hours: Mapping[str, float] = field(default_factory=dict)  # of work: lay, a tonne; cut, a m2 of faces


@dataclass(frozen=True, slots=True, eq=False)
class SiteSet:
    """Sheets, and what is to be said of them."""

    sheets: dict[str, str]  # by the name of its file: one `<svg>` element, in mm of paper
    titles: dict[str, str]  # of each sheet
    templates: dict[str, str] = field(default_factory=dict)  # 1:1
    notes: tuple[str, ...] = ()


def site_set(sequence: BuildSequence, layout: Layout, stock: Stock | None = None) -> SiteSet:
    """Compose all sheets.

    Parameters
    ----------
    sequence : BuildSequence
        The structure and how it is built.
    layout : Layout
        Paper, title, cards on a page, scale, rates of work.
    stock : Stock, optional
        Of what the stones are made, and what is left over.

    Raises
    ------
    InputError
        The structure is too large for the paper.
    """
    stock, form, cards = stock or Stock(), layout.form, layout.cards
    stones = laid_stones(sequence)
    solids = [solid_of_block(block) for block in sequence.assembly.blocks]
    seen = elevation_pages(sequence, form, layout.scale)
    pages = [
        *seen.pages,
        *stage_pages(sequence, solids, form),
        *order_pages(sequence, stones, form),
        *props_and_masses(
            sequence, stones, form, tuple(_work(stones, stock, layout.hours)), tuple(_left_over(stock.left))
        ),
        *card_pages(sequence, stones, solids, stock.source, form, cards),
        *cut_pages(stones, stock.cut, axes_of(sequence), form),
    ]
    first = next((k for k, page in enumerate(pages, 1) if page.kind == "cards"), 0)
    pages += _index(stones, first, cards, form) if len(stones) > INDEXED else ()
    sheets = drawn(pages, form, layout.title)
    titles = {name: page.title for name, page in zip(sheets, pages, strict=True)}
    return SiteSet(sheets, titles, _templates(sequence, stones, stock.cut), seen.notes)


def _work(stones: Sequence[LaidStone], stock: Stock, rates: Mapping[str, float]) -> Iterator[str]:
    """What comes off, and hours of work at the rates that were given."""
    every = [one.carved for one in stock.cut.values()]
    faces = [face.area for c in every for face in c.cuts if not face.dressing]
    if every:
        off = 1000.0 * sum(c.stone_volume - c.volume for c in every)
        said = f"{len(faces)} cuts, {sum(faces):.2f} m² of faces, {off:,.0f} litres come off"
        yield f"{len(every)} found stones are cut: {said}."
    much = {"lay": sum(stone.mass for stone in stones) / 1000.0, "cut": sum(faces)}
    unit = {"lay": "h of laying, at {:g} h a tonne", "cut": "h of cutting, at {:g} h a m²"}
    hours = {work: rate * much[work] for work, rate in rates.items()}
    if hours:
        parts = "; ".join(f"{hours[work]:.1f} {unit[work].format(rate)}" for work, rate in rates.items())
        yield f"Work: {parts}; {sum(hours.values()):.1f} h in all."


def _left_over(left: Iterable[LeftOver]) -> Iterator[str]:
    """What is left over, a line for each reason, with litres."""
    every = sorted(left, key=lambda one: one.why)
    for why, some in groupby(every, key=lambda one: one.why):
        those = list(some)
        litres = 1000.0 * sum(one.volume for one in those)
        names = ", ".join(f"{one.name} ({1000.0 * one.volume:.3g})" for one in those)
        yield f"{len(those)} {why}, {litres:,.0f} litres in all: {names}."


def _templates(sequence: BuildSequence, stones: Sequence[LaidStone], cut: Mapping[int, CutStone]) -> dict[str, str]:
    """A template for each face that a cut leaves, by the step of its stone and the number of the cut."""
    digits = len(str(len(stones)))
    return {
        f"stone-{stone.step:0{digits}}-cut-{k + 1}": template_svg(cut[stone.block], k, stone.step, sequence.up)
        for stone in stones
        if stone.block in cut
        for k in range(len(cut[stone.block].carved.cuts))
    }


def _index(stones: Sequence[LaidStone], first: int, each: int, form: Form) -> tuple[Page, ...]:
    """Stones by name, with their step and the sheet of their card, on which `first` is that of the first."""
    x, y, wide, high = form.room
    across, rows = int(wide // (sum(ENTRY) + 4.0)), int((high - HEADING - 12.0) / LINE)
    pages = []
    for part in portions(sorted(stones, key=lambda stone: stone.id), across * rows):
        drawn_ = [words(x, y + HEADING, "Index of stones", HEADING, BOLD)]
        for k, column in enumerate(portions(part, rows)):
            left = x + k * (sum(ENTRY) + 4.0)
            drawn_.append(columns(left, ENTRY, ("Stone", "Step", "Sheet"), y + HEADING + 8.0, BOLD))
            for row, stone in enumerate(column, 1):
                entry = stone.id, str(stone.step), str(first + (stone.step - 1) // each)
                drawn_.append(columns(left, ENTRY, entry, y + HEADING + 8.0 + row * LINE))
        pages.append(Page("index", f"Index, {part[0].id} to {part[-1].id}", (layer("index", drawn_),)))
    return tuple(pages)
