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
from cyclopean.view.markup import document, figure, headline, listed, section, table
from cyclopean.view.svg import open_path, sheet, text

__all__ = ["match_html", "rounds_svg"]

_CAPTION = (
    f"Hatched: what comes off. Clifford and McGee measured about {DATUM:g} on their Cyclopean Cannibalism wall (ACADIA"
    " 2018). Lambda means something only together with the gap."
)


def match_html(match: Match, stones: Sequence[Stone], cells: Cells, rounds: Sequence[Round] = ()) -> str:
    """Write the page of a match: self-contained, without a script.

    `stones` are those that were matched, `cells` as they are in the end, after `rounds` of a negotiation, where there
    was one.
    """
    blocks = cells.assembly.blocks
    placed = [(stones[p.stone], blocks[cells.block[p.cell]], p.rotation, p.shift) for p in match.placements]
    carved = tuple(carve(*row) for row in placed)
    held, _ = supports(cells.assembly)
    drawing = carving_svg(cells.assembly, held, carved, f"{cells.assembly.name}, stones as placed", "before")
    title = f"Stones for {cells.assembly.name}"
    figures = [
        ("Lambda: carved off", f"{match.imposition:.3f}"),
        ("gap: left empty", f"{match.gap:.3f}"),
        ("stones placed", f"{len(match):,} of {len(stones):,}"),
        ("cells without a stone", len(match.empty)),
        ("weight of void", f"{match.weight:.3g}"),
    ]
    body = (
        headline(title, figures),
        section("Stones as placed", figure(drawing, _CAPTION)),
        section("How the cells were negotiated", figure(rounds_svg(rounds)) if len(rounds) > 1 else "", _ROUNDS),
        section("Stone by stone", _table(match, stones, cells), "The most carved first."),
        section("What to know", listed(match.notes)),
    )
    return document(title, body)


_ROUNDS = "In each round the cells were moved to suit their stones, drawn again, and the stones placed again."


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
        line = open_path(np.stack([x, y[:, k]], -1))
        parts.append(f'<path d="{line}" fill="none" stroke="{colour}" stroke-width="2.5"/>')
        for a, b, v in zip(x, y[:, k], value[:, k], strict=True):
            parts.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="4" fill="{colour}"/>')
            parts.append(text(a, b - 8.0, f"{v:.3f}", f'text-anchor="middle" fill="{colour}"'))
        parts.append(text(x[-1] + 34.0, y[-1, k] + 5.0, label, f'fill="{colour}"'))
    for k, a in enumerate(x):
        parts.append(text(a, high - foot + 22.0, f"round {k}" if k else "as drawn", 'text-anchor="middle"'))
    return sheet((wide, high), "Lambda and gap by round", parts, letters=14.0, white=False)


def _table(match: Match, stones: Sequence[Stone], cells: Cells) -> str:
    head = ["Stone", "Cell", ">Lambda", ">Gap", ">Stone, L", ">Cell, L"]
    rows = (
        (
            escape(stones[p.stone].id),
            escape(cells.assembly.blocks[cells.block[p.cell]].id),
            f"{p.carved_share:.3f}",
            f"{p.gap_share:.3f}",
            f"{1e3 * stones[p.stone].volume:.1f}",
            f"{1e3 * float(cells.volume[p.cell]):.1f}",
        )
        for p in sorted(match.placements, key=lambda p: (-p.carved_share, p.cell))
    )
    return table(head, rows, elsewhere=" in match.json")
