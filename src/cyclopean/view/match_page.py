"""The page of a match: which stone goes where, how much comes off, and how a negotiation went."""

from collections.abc import Sequence
from html import escape

import numpy as np

from cyclopean.assembly import supports
from cyclopean.design.carving.carve import carve
from cyclopean.design.matching.cells import Cells
from cyclopean.design.matching.match import Match
from cyclopean.design.matching.negotiation import Round
from cyclopean.design.stones.stone import Stone
from cyclopean.view.carving_drawing import DATUM, carving_svg
from cyclopean.view.colours import GHOST, INK, SCALE
from cyclopean.view.markup import counts, document, section
from cyclopean.view.tables import table

__all__ = ["match_html", "rounds_svg"]

ROWS = 400  # of the table
_STYLE = "figure svg{display:block;width:100%;height:auto}.rows{max-height:34rem;overflow:auto}"


def match_html(match: Match, stones: Sequence[Stone], cells: Cells, rounds: Sequence[Round] = ()) -> str:
    """Write the page of a match: self-contained, without a script.

    Parameters
    ----------
    match : Match
        Which stone goes into which cell.
    stones : sequence of Stone
        Those that were matched.
    cells : Cells
        The cells, as they are in the end.
    rounds : sequence of Round
        Of the negotiation, where there was one.
    """
    blocks = cells.assembly.blocks
    placed = [(stones[p.stone], blocks[cells.block[p.cell]], p.rotation, p.shift) for p in match.placements]
    carved = tuple(carve(*row) for row in placed)
    held, _ = supports(cells.assembly)
    name = escape(cells.assembly.name)
    drawing = carving_svg(cells.assembly, held, carved, f"{cells.assembly.name}, stones as placed", "before")
    body = (
        f"<header><h1>Stones for {name}</h1><span>cyclopean</span></header>",
        _headline(match, stones),
        f"<section><h2>Stones as placed</h2><figure>{drawing}<figcaption>Hatched: what comes off. Clifford and McGee"
        f" measured about {DATUM:g} on their Cyclopean Cannibalism wall (ACADIA 2018). Lambda means something only"
        " together with the gap.</figcaption></figure></section>",
        section("How the cells were negotiated", rounds_svg(rounds), _ROUNDS) if len(rounds) > 1 else "",
        section("Stone by stone", _table(match, stones, cells), "The most carved first."),
        section("What to know", "".join(f"<p>{escape(note)}</p>" for note in match.notes)),
    )
    return document(f"Stones for {cells.assembly.name}", body, style=_STYLE)


_ROUNDS = "In each round the cells were moved to suit their stones, drawn again, and the stones placed again."


def _headline(match: Match, stones: Sequence[Stone]) -> str:
    figures = [
        ("Lambda: carved off", f"{match.imposition:.3f}"),
        ("gap: left empty", f"{match.gap:.3f}"),
        ("stones placed", f"{len(match):,} of {len(stones):,}"),
        ("cells without a stone", f"{len(match.empty):,}"),
        ("weight of void", f"{match.weight:.3g}"),
    ]
    return counts(figures)


def rounds_svg(rounds: Sequence[Round]) -> str:
    """Lambda and gap of each round as two lines; nothing where there is no round."""
    if not rounds:
        return ""
    wide, high, left, foot = 700.0, 260.0, 60.0, 40.0
    value = np.array([[r.imposition, r.gap] for r in rounds])
    top = max(float(value.max()) * 1.15, 1e-3)
    x = left + (wide - left - 110.0) * np.arange(len(rounds)) / max(len(rounds) - 1, 1)
    y = high - foot - (high - foot - 14.0) * value / top
    parts = [f'<path d="M{left} {high - foot}H{wide - 100}" stroke="{GHOST}"/>']
    for k, (label, colour) in enumerate((("Lambda", SCALE[5]), ("gap", INK))):
        line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y[:, k], strict=True))
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2.5"/>')
        for a, b, v in zip(x, y[:, k], value[:, k], strict=True):
            parts.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="4" fill="{colour}"/>')
            parts.append(f'<text x="{a:.1f}" y="{b - 8:.1f}" text-anchor="middle" fill="{colour}">{v:.3f}</text>')
        parts.append(f'<text x="{x[-1] + 34:.1f}" y="{y[-1, k] + 5:.1f}" fill="{colour}">{label}</text>')
    for k, a in enumerate(x):
        name = "as drawn" if k == 0 else f"round {k}"
        parts.append(f'<text x="{a:.1f}" y="{high - foot + 22:.1f}" text-anchor="middle">{name}</text>')
    return (
        f'<figure><svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide:.0f} {high:.0f}" role="img" font-size="14"'
        f' font-family="sans-serif" fill="{INK}"><title>Lambda and gap by round</title>{"".join(parts)}</svg></figure>'
    )


def _table(match: Match, stones: Sequence[Stone], cells: Cells) -> str:
    head = [("Stone", ""), ("Cell", ""), ("Lambda", "n"), ("Gap", "n"), ("Stone, L", "n"), ("Cell, L", "n")]
    order = sorted(match.placements, key=lambda p: (-p.carved_share, p.cell))
    rows = [
        [
            escape(stones[p.stone].id),
            escape(cells.assembly.blocks[cells.block[p.cell]].id),
            f"{p.carved_share:.3f}",
            f"{p.gap_share:.3f}",
            f"{1e3 * stones[p.stone].volume:.1f}",
            f"{1e3 * float(cells.volume[p.cell]):.1f}",
        ]
        for p in order[:ROWS]
    ]
    more = f'<p class="soft">and {len(order) - ROWS:,} more in match.json</p>' if len(order) > ROWS else ""
    return f'<div class="rows">{table(head, rows)}</div>{more}' if rows else ""
