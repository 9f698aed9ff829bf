"""Pieces of HTML that the pages share: the document around them, figures at the head, sections, keys of a legend."""

from collections.abc import Iterable
from html import escape

from cyclopean.view.colours import GHOST
from cyclopean.view.drawing import Picture
from cyclopean.view.elevation import animated
from cyclopean.view.style import sheet

__all__ = ["DASHED", "STILL", "arrow", "click_note", "counts", "document", "key", "section"]

STILL = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"  # pages without a script
FOOTER = "<footer>Written by cyclopean. This page holds everything it shows and loads nothing from a network.</footer>"

DASHED = f'<path d="M0 8H32" stroke="{GHOST}" stroke-width="2" stroke-dasharray="5 3"/>'


def document(
    title: str, body: Iterable[str], *, word: str = "", style: str = "", head: str = "", may: str = STILL
) -> str:
    """One self-contained HTML page.

    Parameters
    ----------
    title : str
        Of the window; escaped here.
    body : iterable of str
        HTML, in order; a footer follows.
    word : str
        Verdict that the page's accent is of.
    style, head : str
        Further style sheet, further elements of the head.
    may : str
        Content security policy: what the browser may load.
    """
    accent = f' class="{word}"' if word else ""
    return (
        f'<!doctype html><html lang="en"{accent}><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{may}">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{escape(title)}</title><style>{sheet()}{style}</style>{head}</head>"
        f"<body><main>{''.join(body)}{FOOTER}</main></body></html>"
    )


def counts(rows: Iterable[tuple[str, str]], method: str = "") -> str:
    """Figures at the head of a page: what, and how many; then the method."""
    cells = "".join(f"<div><dt>{what}</dt><dd>{count}</dd></div>" for what, count in rows)
    last = f"<div><dt></dt><dd>{escape(method)}</dd></div>" if method else ""
    return f'<dl class="counts">{cells}{last}</dl>'


def section(title: str, content: str, lead: str = "") -> str:
    """Heading, one paragraph and content; nothing where there is no content."""
    if not content:
        return ""
    return f"<section><h2>{title}</h2>{f'<p>{lead}</p>' if lead else ''}{content}</section>"


def key(drawing: str, text: str) -> str:
    """Explain a small drawing of 32 x 16 units."""
    return f'<div class="key"><svg viewBox="0 0 32 16" aria-hidden="true">{drawing}</svg>{text}</div>'


def arrow(colour: str) -> str:
    """An arrow as it is drawn in the pictures."""
    return f'<path d="M1 8H20" stroke="{colour}" stroke-width="2.5"/><path d="M31 8 19 3.5V12.5Z" fill="{colour}"/>'


def click_note(drawn: Picture) -> str:
    """Tell that the elevation moves, when it does."""
    return " Click the drawing to see it move." if animated(drawn) else ""
