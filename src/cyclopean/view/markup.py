"""Pieces of HTML that the parts of the report share: sections, keys of a legend."""

from cyclopean.view.colours import GHOST
from cyclopean.view.drawing import Picture
from cyclopean.view.elevation import animated

__all__ = ["DASHED", "arrow", "click_note", "key", "section"]

DASHED = f'<path d="M0 8H32" stroke="{GHOST}" stroke-width="2" stroke-dasharray="5 3"/>'


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
