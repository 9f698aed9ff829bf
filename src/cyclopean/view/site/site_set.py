"""The set of sheets for whoever builds: elevations, order, props and masses, cards, cuts; an index of many stones."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from cyclopean.design.construction.laying import LaidStone, axes_of, laid_stones
from cyclopean.design.construction.sequence import BuildSequence
from cyclopean.view.site.bodies import solid_of_block
from cyclopean.view.site.cards import card_pages
from cyclopean.view.site.cuts import CutStone, cut_pages, template_svg
from cyclopean.view.site.elevation import elevation_pages
from cyclopean.view.site.order import order_pages, props_and_masses
from cyclopean.view.site.paper import BOLD, HEADING, LINE, Form, Page, Title, columns, drawn, portions, words
from cyclopean.view.svg import layer

__all__ = ["SiteSet", "site_set"]

INDEXED = 40  # stones from which looking one up takes an index
ENTRY = (34.0, 14.0, 16.0)  # mm, columns of the index: stone, step, sheet


@dataclass(frozen=True, slots=True, eq=False)
class SiteSet:
    """Sheets, and what is to be said of them."""

    sheets: dict[str, str]  # by the name of its file: one `<svg>` element, in mm of paper
    titles: dict[str, str]  # of each sheet
    templates: dict[str, str] = field(default_factory=dict)  # 1:1
    notes: tuple[str, ...] = ()


def site_set(
    sequence: BuildSequence,
    form: Form,
    title: Title,
    cards: int = 2,
    scale: int | None = None,
    cut: dict[int, CutStone] | None = None,
) -> SiteSet:
    """Compose all sheets.

    Parameters
    ----------
    sequence : BuildSequence
        The structure and how it is built.
    form : Form
        Paper.
    title : Title
        Of the title block.
    cards : int
        On a page, 1 to 8.
    scale : int, optional
        Of the elevations, 1 to so much; the largest standard one that fits where not given.
    cut : dict of int to CutStone, optional
        Stones that are cut, by block.

    Raises
    ------
    InputError
        The structure is too large for the paper.
    """
    cut = cut or {}
    stones = laid_stones(sequence)
    seen = elevation_pages(sequence, form, scale)
    solids = {stone.block: solid_of_block(sequence.assembly.blocks[stone.block]) for stone in stones}
    scans = {block: one.carved.stone for block, one in cut.items()}
    pages = [
        *seen.pages,
        *order_pages(sequence, stones, form),
        *props_and_masses(sequence, stones, form, _spoil(cut)),
        *card_pages(sequence, stones, solids, scans, form, cards),
        *cut_pages(stones, cut, axes_of(sequence), form),
    ]
    first = next((k for k, page in enumerate(pages, 1) if page.kind == "cards"), 0)
    pages += _index(stones, first, cards, form) if len(stones) > INDEXED else ()
    sheets = drawn(pages, form, title)
    titles = {name: page.title for name, page in zip(sheets, pages, strict=True)}
    return SiteSet(sheets, titles, _templates(sequence, stones, cut), seen.notes)


def _spoil(cut: dict[int, CutStone]) -> tuple[str, ...]:
    """What comes off, in words."""
    if not cut:
        return ()
    every = [one.carved for one in cut.values()]
    off = 1000.0 * sum(c.stone_volume - c.volume for c in every)
    count = sum(not face.dressing for c in every for face in c.cuts)
    area = sum(face.area for c in every for face in c.cuts if not face.dressing)
    return (f"{len(every)} found stones are cut: {count} cuts, {area:.2f} m² of faces, {off:,.0f} litres come off.",)


def _templates(sequence: BuildSequence, stones: Sequence[LaidStone], cut: dict[int, CutStone]) -> dict[str, str]:
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
            at = [left, left + ENTRY[0], left + ENTRY[0] + ENTRY[1]]
            drawn_.append(columns(at, ENTRY, ("Stone", "Step", "Sheet"), y + HEADING + 8.0, BOLD))
            for row, stone in enumerate(column, 1):
                entry = stone.id, str(stone.step), str(first + (stone.step - 1) // each)
                drawn_.append(columns(at, ENTRY, entry, y + HEADING + 8.0 + row * LINE))
        pages.append(Page("index", f"Index, {part[0].id} to {part[-1].id}", (layer("index", drawn_),)))
    return tuple(pages)
