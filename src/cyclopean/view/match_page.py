"""The page of a match: which stone goes where, how much comes off, and how a negotiation went."""

from collections.abc import Sequence
from html import escape

import numpy as np

from cyclopean.assembly import Assembly, Block, supports
from cyclopean.design.carving.carve import Carved, carve
from cyclopean.design.matching.cells import Cells
from cyclopean.design.matching.match import Match
from cyclopean.design.matching.negotiation import Round
from cyclopean.design.stones.stone import Stone
from cyclopean.view.carving_drawing import DATUM, MEANT, carving_svg, in_space
from cyclopean.view.curves import curves_svg
from cyclopean.view.markup import POLICY, document, figure, headline, listed, section, table

VOID = 0.3  # gap above which a wall of stones is none
_CAPTION = (
    f"Hatched: what comes off. Clifford and McGee measured about {DATUM:g} on their Cyclopean Cannibalism wall (ACADIA"
    " 2018)."
)


def match_answer(empty: int, imposition: float, gap: float, gap_of_wall: float) -> tuple[str, str]:
    """Whether the stones make a wall, in a few words, and at what price; one that is mostly holes is none."""
    off = f"{100.0 * imposition:.0f} % of the stone is to be carved away, {100.0 * gap:.1f} % of the cells stays void."
    if gap_of_wall > VOID:
        return "NO WALL YET", f"{100.0 * gap_of_wall:.0f} % of it stays void. {off}"
    return f"{empty} cells have no stone" if empty else "Every cell has a stone", off


def match_html(
    match: Match, stones: Sequence[Stone], cells: Cells, rounds: Sequence[Round] = (), misfits: Sequence[str] = ()
) -> str:
    """Write the page of a match: self-contained.

    `stones` are those that were matched, `cells` as they are in the end, after `rounds` of a negotiation, where there
    was one; `misfits` say why the stones do not suit the wall, and stand first, in red.
    """
    title = f"Stones for {cells.assembly.name}"
    figures = [
        ("Lambda: carved off", f"{match.imposition:.3f}"),
        ("gap: left empty", f"{match.gap:.3f}"),
        ("stones placed", f"{len(match):,} of {len(stones):,}"),
        ("cells without a stone", len(match.empty)),
        ("weight of empty space against cutting", f"{match.weight:.3g}"),
        *([("sawn new", len(cells.sawn))] if len(cells.sawn) else []),
    ]
    answer = match_answer(len(match.empty), match.imposition, match.gap, match.gap_of_wall)
    carved = _carved(match, stones, cells)
    body = (
        headline(title, figures, answer=("Does not fit", f"{'; '.join(misfits)}.") if misfits else answer),
        section("Stones as placed", figure(_placed(cells, carved), _CAPTION), MEANT),
        section("In space", _in_space(cells, carved)),
        section("How the cells were negotiated", figure(rounds_svg(rounds)) if len(rounds) > 1 else "", _ROUNDS),
        section("Stone by stone", _table(match, stones, cells), "The most carved first."),
        section("What to know", listed(match.notes)),
    )
    return document(title, body, word="unstable" if misfits else "", may=POLICY)


def placed_svg(match: Match, stones: Sequence[Stone], cells: Cells) -> str:
    """Draw matched stones in their cells, as placed, with what comes off, as one `<svg>` element."""
    return _placed(cells, _carved(match, stones, cells))


def _carved(match: Match, stones: Sequence[Stone], cells: Cells) -> tuple[Carved, ...]:
    blocks = cells.assembly.blocks
    placed = [(stones[p.stone], blocks[cells.block[p.cell]], p.rotation, p.shift) for p in match.placements]
    return tuple(carve(*row) for row in placed)


def _in_space(cells: Cells, carved: Sequence[Carved]) -> str:
    """What is left of the stones, and the supports, as a scene."""
    held, _ = supports(cells.assembly)
    left = [Block(c.cell, c.vertices, tuple(map(tuple, c.triangles.tolist()))) for c in carved if len(c.triangles)]
    base = [b for b, one in zip(cells.assembly.blocks, held, strict=True) if one]
    whole = Assembly((*left, *base), contacts=None, name=cells.assembly.name)
    return in_space(whole, np.arange(len(whole)) >= len(left), carved) if len(whole) else ""


def _placed(cells: Cells, carved: Sequence[Carved]) -> str:
    held, _ = supports(cells.assembly)
    sawn = [cells.assembly.blocks[k].id for k in cells.sawn.tolist()]
    return carving_svg(cells.assembly, held, carved, f"{cells.assembly.name}, stones as placed", "before", sawn)


_ROUNDS = "In each round the cells were moved to suit their stones, drawn again, and the stones placed again."


def rounds_svg(rounds: Sequence[Round]) -> str:
    """Lambda and gap of each round as two lines; nothing where there is no round."""
    ticks = ["as drawn", *(f"round {k}" for k in range(1, len(rounds)))][: len(rounds)]
    curves = {"Lambda": [r.imposition for r in rounds], "gap": [r.gap for r in rounds]}
    return curves_svg("Lambda and gap by round", range(len(rounds)), ticks, curves)


def _table(match: Match, stones: Sequence[Stone], cells: Cells) -> str:
    head = ["Stone", "Cell", ">Lambda", ">Gap", ">Stone (L)", ">Cell (L)"]
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
