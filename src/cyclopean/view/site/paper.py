"""Sheets of paper: frame, title block, words that fit. Here a drawing unit is a millimetre of paper.

No letter is smaller than a capital of 2.2 mm: it is read at arm's length, in the rain.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from itertools import accumulate
from typing import TypeVar

from cyclopean.view.colours import INK, SOFT
from cyclopean.view.svg import layer, rect, sheet, text, to_scale

T = TypeVar("T")
PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0)}  # mm, landscape
LETTERS, HEADING = 3.1, 4.6  # mm, size of letters; a capital is 0.72 of it
LINE = 4.4  # mm from line to line
MARGIN, STRIP = 8.0, 13.0  # mm, of the frame, which printers reach, and height of the title block
INSIDE = 4.0  # mm between the frame and what is drawn
SCALES = (1, 2, 5, 10, 20, 25, 50, 100, 200, 500, 1000)  # that 1:n of drawings is; ISO 5455, and 1:25 of masons
BOLD = 'font-weight="600"'
# Widths of letters in their size: the widest of each sort in Arial and Helvetica, and a little more.
NARROW, WIDE, CAPITAL, USUAL, FULL = 0.34, 0.96, 0.74, 0.58, 1.0
BOLDER = 1.1  # times as wide
FACES = "Arial, Helvetica, 'Liberation Sans', sans-serif"


@dataclass(frozen=True, slots=True)
class Form:
    """Paper with a frame and a title block."""

    paper: str

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, mm."""
        return PAPERS[self.paper]

    @property
    def room(self) -> tuple[float, float, float, float]:
        """What may be drawn on: left, top, width and height, mm."""
        (wide, high), edge = self.size, MARGIN + INSIDE
        return edge, edge, wide - 2.0 * edge, high - 2.0 * edge - STRIP


@dataclass(frozen=True, slots=True)
class Title:
    """What the title block says on every sheet."""

    name: str
    date: str = ""

    def shown(self, form: Form) -> str:
        """As much of the name as its field has room for."""
        return shortened(self.name, _parted(form, self)[0] - 4.0, LETTERS * BOLDER)


@dataclass(frozen=True, slots=True)
class Page:
    """What is on one sheet."""

    kind: str  # begins the name of its file
    title: str
    parts: tuple[str, ...]
    scale: str = ""  # as the title block says it
    per_metre: float = 1000.0  # mm of paper for a metre of what DXF shows; paper itself where it is to no scale
    foot: tuple[float, float] = (0.0, 0.0)  # mm, from where DXF measures


def drawn(pages: Sequence[Page], form: Form, title: Title) -> dict[str, str]:
    """Every sheet as one `<svg>` element, by its name: the kind, and a number where there are several of it."""
    count = {page.kind: sum(one.kind == page.kind for one in pages) for page in pages}
    seen = dict.fromkeys(count, 0)
    found: dict[str, str] = {}
    for number, page in enumerate(pages, 1):
        seen[page.kind] += 1
        digits = len(str(count[page.kind]))
        name = page.kind + (f"-{seen[page.kind]:0{digits}}" if count[page.kind] > 1 else "")
        (wide, high), block = form.size, _title_block(page, form, title, f"{number} of {len(pages)}")
        more = f' width="{wide:g}mm" height="{high:g}mm" font-family="{FACES}" font-size="{LETTERS}" fill="{INK}"'
        more += to_scale(page.per_metre, page.foot)
        found[name] = sheet((wide, high), f"{title.name}: {page.title}", (*page.parts, block), more=more)
    return found


def _title_block(page: Page, form: Form, title: Title, number: str) -> str:
    """The frame, and in its foot what this sheet is."""
    (wide, high), line = form.size, f'fill="none" stroke="{INK}" stroke-width="0.5"'
    top, x = high - MARGIN - STRIP, MARGIN
    parts = [rect(MARGIN, MARGIN, wide - 2.0 * MARGIN, high - 2.0 * MARGIN, line)]
    labels = ("Structure", "Drawing", "Date", "Scale", "Paper", "Sheet")
    said = (title.name, page.title, title.date, page.scale or "none", form.paper, number)
    for label, value, room in zip(labels, said, _parted(form, title), strict=True):
        if room:  # with a line at its left
            parts.append(f'<path d="M{x:.2f} {top:g}v{STRIP:g}" stroke="{INK}" stroke-width="0.25"/>')
            parts.append(words(x + 2.0, top + 4.6, label, more=f'fill="{SOFT}"'))
            parts.append(words(x + 2.0, top + 10.2, shortened(value, room - 4.0, LETTERS * BOLDER), more=BOLD))
        x += room
    parts.append(f'<path d="M{MARGIN:g} {top:g}H{wide - MARGIN:g}" {line}/>')
    return layer("title-block", parts)


def _parted(form: Form, title: Title) -> tuple[float, ...]:
    """Widths of the fields of the title block, mm; 0 for a date that nobody gave."""
    fixed = (38.0 if title.date else 0.0, 24.0, 18.0, 34.0)
    rest = form.size[0] - 2.0 * MARGIN - sum(fixed)
    return 0.55 * rest, 0.45 * rest, *fixed


def words(x: float, y: float, said: str, size: float = LETTERS, more: str = "") -> str:
    """Words, escaped here, that begin at a point unless the attributes say otherwise."""
    style = (f'font-size="{size:g}" ' if size != LETTERS else "") + more
    return text(x, y, escape(said), style.strip())


def width(said: str, size: float = LETTERS) -> float:
    """How wide words are, mm; rather more than less."""
    return size * sum(_wide(c) for c in said)


def _wide(letter: str) -> float:
    if letter in "iljtfr.,:;'|!I()[] /-":
        return NARROW
    if ord(letter) > 0x2E7F:  # Chinese, Japanese, Korean and signs as wide as they are high
        return FULL
    return WIDE if letter in "mwMW@%\u2014" else CAPITAL if letter.isupper() else USUAL


def shortened(said: str, room: float, size: float = LETTERS) -> str:
    """Words, cut where they are wider than the room (mm); three dots say so."""
    if width(said, size) <= room:
        return said
    kept = said
    while kept and width(f"{kept}…", size) > room:
        kept = kept[:-1]
    return f"{kept.rstrip()}…"


def wrapped(said: str, room: float, most: int = 99) -> list[str]:
    """Lines that fit the room (mm), at most so many; the last is cut where there would be more."""
    lines: list[str] = []
    for word in said.split():
        if lines and width(f"{lines[-1]} {word}") <= room:
            lines[-1] = f"{lines[-1]} {word}"
        else:
            lines.append(word)
    if len(lines) > most:
        lines = [*lines[: most - 1], " ".join(lines[most - 1 :])]
    return [shortened(line, room) for line in lines]


def columns(x: float, rooms: Sequence[float], row: Iterable[str], y: float, more: str = "") -> str:
    """A row of a table: words in columns of such widths (mm) from x on, cut to them."""
    size = LETTERS * BOLDER if BOLD in more else LETTERS
    cells = zip(accumulate(rooms, initial=x), rooms, row, strict=False)
    return "".join(words(at, y, shortened(said, room - 2.0, size), more=more) for at, room, said in cells if said)


def portions(things: Sequence[T], each: int) -> list[Sequence[T]]:
    """So many of them at a time, in their order."""
    return [things[k : k + each] for k in range(0, len(things), each)]


def standard_scale(span: tuple[float, float], room: tuple[float, float], among: Sequence[int] = SCALES) -> int | None:
    """The largest scale 1:n of some at which a length across and one up (m) fit a room (mm); None where none does.

    Examples
    --------
    >>> standard_scale((4.0, 2.0), (250.0, 150.0)), standard_scale((0.4, 0.2), (250.0, 150.0))
    (20, 2)
    """
    fits = (n for n in among if all(1000.0 * s / n <= r * (1.0 + 1e-9) for s, r in zip(span, room, strict=True)))
    return next(fits, None)
