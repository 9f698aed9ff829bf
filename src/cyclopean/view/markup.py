"""The kit of pages: the document around them, verdict, figures, tables, scales and keys; every HTML page is made of it.

What comes from a model or from the user is escaped by who writes it into a page, unless a function says that it does.
"""

import shlex
from collections.abc import Iterable, Sequence
from html import escape

from cyclopean.arrays import Floats, Ints
from cyclopean.errors import spelt
from cyclopean.view.colours import GHOST, HATCH, SCALE, SUPPORT
from cyclopean.view.drawing import Picture, without_points
from cyclopean.view.elevation import animated, elevation_svg, sides
from cyclopean.view.scene import scene_html
from cyclopean.view.style import sheet

# Of pages without a script.
STILL = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
# Of pages with a scene: the browser itself is told to load nothing from anywhere; the scene in the frame inherits this.
# Viser's client unpacks itself with blob and data addresses, which never leave the machine.
POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline' 'unsafe-eval' blob: data:;"
    " worker-src blob: data:; connect-src blob: data:; img-src blob: data:; font-src data:;"
    " base-uri 'none'; form-action 'none'"
)
# Our only script: without WebGL the frame is hidden, and the elevation stands alone.
_FLAT = (
    "<noscript><style>.scene{display:none}</style></noscript>"
    "<script>try{if(!document.createElement('canvas').getContext('webgl2'))throw 0}"
    "catch(e){document.documentElement.className+=' flat'}</script>"
)
FOOTER = "<footer>Written by cyclopean. This page holds everything it shows and loads nothing from a network.</footer>"
ROWS = 400  # of a table, unless it says otherwise
LONG = 40  # rows beyond which it scrolls in a box
DRAG = "Drag to turn, scroll to zoom, right-drag to move; the button at the top right lists the layers to switch."

# What keys explain: small drawings of 32 x 16 units.
DASHED = f'<path d="M1 8H32" stroke="{GHOST}" stroke-width="2" stroke-dasharray="5 3"/>'
SUPPORTED = (
    f'<rect width="32" height="16" fill="{SUPPORT}"/>'
    f'<path d="M2 18 18 0M12 18 28 0M22 18 38 0" stroke="{HATCH}" stroke-width="3"/>'
)


def document(title: str, body: Iterable[str], *, word: str = "", style: str = "", may: str = STILL) -> str:
    """One self-contained HTML page: its title, escaped here, its parts in order, and a footer.

    `word` is the verdict that the accent is of, `style` a further style sheet, and `may` the content security policy:
    what the browser may load.
    """
    accent = f' class="{word}"' if word else ""
    return (
        f'<!doctype html><html lang="en"{accent}><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{may}">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{escape(title)}</title><style>{sheet()}{style}</style>{_FLAT if may == POLICY else ''}</head>"
        f"<body><main>{''.join(body)}{FOOTER}</main></body></html>"
    )


def told(text: str) -> str:
    """Escape a sentence; options that it names in backticks become what one types.

    Examples
    --------
    >>> told("a < b: say `beta_min`")
    'a &lt; b: say <code>--beta-min</code>'
    """
    return spelt(escape(text), lambda option: f"<code>--{option.replace('_', '-')}</code>")


def headline(
    name: str,
    figures: Iterable[tuple[str, object]],
    method: str = "",
    *,
    answer: tuple[str, str] | None = None,
    more: str = "",
    model_file: str | None = None,
) -> str:
    """What stands at the head of a page: its name, the answer in large letters and why, figures: what, and how many.

    Escaped here: the name, the reason (second of `answer`), the method and the name of the file. Whole numbers are
    written here; other figures are texts already. `more` is HTML below the reason.
    """
    source = f' <span class="soft">({escape(model_file)})</span>' if model_file else ""
    said = f'<div class="verdict"><strong>{answer[0]}</strong><p>{told(answer[1])}</p>{more}</div>' if answer else ""
    shown = [(what, f"{count:,}" if isinstance(count, int) else count) for what, count in figures]
    cells = "".join(f"<div><dt>{what}</dt><dd>{count}</dd></div>" for what, count in shown)
    last = f"<div><dt></dt><dd>{escape(method)}</dd></div>" if method else ""
    return (
        f"<header><h1>{escape(name)}{source}</h1><span>cyclopean</span></header>{said}"
        f'<dl class="counts">{cells}{last}</dl>'
    )


def section(title: str, content: str, lead: str = "") -> str:
    """Heading, one paragraph and content; nothing where there is no content."""
    if not content:
        return ""
    return f"<section><h2>{title}</h2>{f'<p>{lead}</p>' if lead else ''}{content}</section>"


def listed(lines: Iterable[str]) -> str:
    """Warnings and notes as a list; escaped here."""
    items = "".join(f"<li>{told(line)}</li>" for line in lines)
    return f'<ul class="warnings">{items}</ul>' if items else ""


def figure(drawing: str, caption: str = "", kind: str = "") -> str:
    """A drawing with what is said of it."""
    below = f"<figcaption>{caption}</figcaption>" if caption else ""
    return f"<figure{_class(kind)}>{drawing}{below}</figure>"


def model_figures(drawn: Picture, name: str, caption: str, *, layers: str = DRAG, joints: Floats | None = None) -> str:
    """A picture twice: in 3D, and as an elevation, for print and where there is no WebGL.

    The name of the model is escaped here. `layers` is said of the scene, `caption` of the elevation; `joints` (e, 2,
    3), m, are outlines of contacts, in the scene only.
    """
    flat = without_points(drawn)
    shown = [(what, elevation_svg(flat, f"{what} of {name}", view)) for what, view in sides(drawn.mesh, drawn.given)]
    told = [f"{shown[0][0]}. {caption}{click_note(drawn)}", *(f"{what}." for what, _ in shown[1:])]
    flats = (figure(svg, words, "elevation") for (_, svg), words in zip(shown, told, strict=True))
    return scene_figure(drawn, name, layers, joints=joints) + "".join(flats)


def scene_figure(
    drawn: Picture,
    name: str,
    caption: str = "",
    *,
    joints: Floats | None = None,
    off: Iterable[tuple[Floats, Ints]] = (),
) -> str:
    """A picture in 3D, of a page that may run `POLICY`; the name is escaped here.

    Outlines `joints` (e, 2, 3), m, and parts cut `off`, vertices (v, 3), m, with triangles (t, 3), as in `scene_html`.
    """
    page = escape(scene_html(drawn, joints, off), quote=True)
    return figure(f'<iframe title="3D scene: {escape(name)}" srcdoc="{page}"></iframe>', caption or DRAG, "scene")


def table(head: Sequence[str], rows: Iterable[Sequence[str]], most: int = ROWS, elsewhere: str = "") -> str:
    """An HTML table, in a box that scrolls where it is long; nothing where there are no rows.

    A title that begins with ">" is of numbers; without titles there is no line of them. Cells are escaped already; the
    first of each row is its heading. Of more rows than `most` the rest are counted, with `elsewhere`, " in match.json".
    """
    rows = list(rows)
    if not rows:
        return ""
    kinds = [_class("n" if title.startswith(">") else "") for title in head]
    columns = "".join(
        f'<th scope="col"{k}>{title.removeprefix(">")}</th>' for k, title in zip(kinds, head, strict=True)
    )
    body = "".join(
        f'<tr><th scope="row"{kinds[0]}>{row[0]}</th>'
        + "".join(f"<td{k}>{cell}</td>" for k, cell in zip(kinds[1:], row[1:], strict=True))
        + "</tr>"
        for row in rows[:most]
    )
    top = f"<thead><tr>{columns}</tr></thead>" if any(head) else ""
    more = f'<p class="soft">and {len(rows) - most:,} more{elsewhere}</p>' if len(rows) > most else ""
    box = " rows" if len(rows) > LONG else ""
    return f'<div class="wide{box}"><table>{top}<tbody>{body}</tbody></table></div>{more}'


def _class(name: str) -> str:
    return f' class="{name}"' if name else ""


def bar(share: float, colour: str, text: str) -> str:
    """A number with a bar as long as a share of 1."""
    width = 100.0 * min(max(share, 0.0), 1.0)
    return f'{text}<span class="bar"><i style="width:{width:.0f}%;background:{colour}"></i></span>'


def ramp(title: str, low: str, high: str) -> str:
    """What the colours mean, from 0 to 1; needs no style sheet, as notebooks and the live page have none of ours."""
    steps = "".join(f'<i style="flex:1;height:.95em;background:{colour}"></i>' for colour in SCALE)
    ends = zip(("left", "center", "right"), (low, "0.5", high), strict=True)
    words = "".join(f'<span style="flex:1;text-align:{side}">{end}</span>' for side, end in ends)
    return (
        f'<div class="ramp" style="width:25rem;max-width:100%;margin-top:.3em"><b style="font-weight:600">{title}</b>'
        f'<div style="display:flex;margin:.25em 0 .1em;border:1px solid #8b867b" aria-hidden="true">{steps}</div>'
        f'<div style="display:flex;font-size:.9em">{words}</div></div>'
    )


def switch(quantity: str) -> str:
    """What shows the colours of a quantity over the stone, and what they mean; nothing where they mean nothing.

    Movement is shown at first: it is there to be feared.
    """
    if quantity not in _SCALES:
        return ""
    on = " checked" if quantity == "movement" else ""
    said = f"{quantity.capitalize()} in colour"
    return f'<label class="overlay"><input type="checkbox" id="overlay"{on}> {said}</label>{ramp(*_SCALES[quantity])}'


_SCALES = {
    "utilisation": ("Friction used at the worst contact of a stone", "0", "1 = about to slide"),
    "movement": ("Movement of a stone, largest = 1", "0", "1"),
}


def legend(keys: Iterable[str]) -> str:
    """Scales and keys above a drawing."""
    return f'<div class="legend">{"".join(keys)}</div>'


def key(drawing: str, text: str) -> str:
    """Explain a small drawing of 32 x 16 units."""
    return f'<div class="key"><svg viewBox="0 0 32 16" aria-hidden="true">{drawing}</svg>{text}</div>'


def arrow(colour: str) -> str:
    """An arrow as it is drawn in the pictures."""
    return f'<path d="M1 8H20" stroke="{colour}" stroke-width="2.5"/><path d="M31 8 19 3.5V12.5Z" fill="{colour}"/>'


def click_note(drawn: Picture) -> str:
    """Tell that the elevation moves, when it does."""
    return " Click the drawing to see it move." if animated(drawn) else ""


def written_first(command: str, certificate_file: str | None, model_file: str | None) -> tuple[str, str]:
    """The certificate's name as one types it, and how a command, "check {model}", writes it where none has; escaped."""
    name = escape(shlex.quote(certificate_file or "certificate.json"))
    if certificate_file is not None:
        return name, ""
    asked = command.format(model=escape(shlex.quote(model_file or "MODEL")))
    return name, f"<p>Write the certificate first:</p><pre>cyclopean {asked} --certificate {name}</pre>"
