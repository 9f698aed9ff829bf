"""A page that lists reports."""

from collections.abc import Iterable
from dataclasses import dataclass
from html import escape
from urllib.parse import quote

from cyclopean.analysis import Result, Word
from cyclopean.errors import InputError
from cyclopean.view.colours import ACCENT
from cyclopean.view.drawing import picture
from cyclopean.view.elevation import elevation_svg
from cyclopean.view.style import sheet

__all__ = ["IndexEntry", "index_entry", "index_html"]

THUMBNAIL_FACES = 3_000  # a model with more gets no thumbnail: the index must stay light


@dataclass(frozen=True, slots=True)
class IndexEntry:
    """One report in the index."""

    title: str
    verdict: Word
    reason: str
    link: str  # path of the report relative to the index, with /
    picture: str = ""  # one <svg> element of ours, taken as it is

    def __post_init__(self) -> None:
        if self.verdict not in ACCENT:
            raise InputError(f"index: verdict '{self.verdict}' must be stable, unstable or undecided")


def index_entry(result: Result, link: str) -> IndexEntry:
    """Entry for a result whose report is at `link` (relative path), with a thumbnail where that is small."""
    small = len(result.assembly.mesh.corner_start) - 1 <= THUMBNAIL_FACES
    svg = elevation_svg(picture(result), result.assembly.name, bare=True) if small else ""
    return IndexEntry(result.assembly.name, result.verdict, result.reason, link, svg)


def index_html(entries: Iterable[IndexEntry], title: str = "Reports") -> str:
    """Write a self-contained page of cards: picture, title, verdict, reason, link."""
    cards = [_card(entry) for entry in entries]
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">"
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{escape(title)}</title><style>{sheet('index')}</style></head>"
        f'<body><main><h1>{escape(title)}</h1><ul class="cards">{"".join(cards)}</ul></main></body></html>'
    )


def _card(entry: IndexEntry) -> str:
    """Link, percent-encoded: whatever the name, it stays a relative path and never becomes a scheme."""
    return (
        f'<li class="{entry.verdict}"><a href="{quote(entry.link, safe="/")}">{entry.picture or _BLANK}'
        f"<h2>{escape(entry.title)}</h2><strong>{entry.verdict.capitalize()}</strong><p>{escape(entry.reason)}</p></a></li>"
    )


_BLANK = '<div class="blank"></div>'
