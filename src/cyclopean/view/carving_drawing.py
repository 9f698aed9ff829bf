"""A wall before and after its stones are carved: elevations as SVG, and the page that shows them with the cut list.

Before, every stone stands where it was placed; what reaches beyond its cell is hatched. After, the carved stones stand
in their cells, and what they do not fill stays white. In each stone stands lambda, the share of it that comes off. The
legend says Lambda of the wall; Clifford & McGee's *Cyclopean Cannibalism* wall (ACADIA 2018) came to 0.27.
"""

from collections.abc import Collection, Sequence
from html import escape
from typing import Literal

import numpy as np

from cyclopean.analysis import Result
from cyclopean.analysis.answers import answer
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly
from cyclopean.design.carving.carve import Carved, total
from cyclopean.design.carving.carved_wall import CarvedWall
from cyclopean.geometry.polygon import convex_hull
from cyclopean.geometry.sides import rings
from cyclopean.geometry.solids import fans
from cyclopean.view import markup, svg
from cyclopean.view.building import middle_of
from cyclopean.view.colours import GHOST, HATCH, INK, SOFT, SUPPORT, stone
from cyclopean.view.drawing import still
from cyclopean.view.figures import number

DATUM = 0.27  # Lambda of the Cyclopean Cannibalism wall: 73 % of the scanned stock was used
MARGIN, LEGEND = 24.0, 64.0  # drawing units
TALLEST = 900.0  # drawing units
SMALL = 9.0  # drawing units: letters that would be smaller are left out
FINE = 0.3  # drawing units: what is narrower is not seen
APART = 0.8  # drawing units between the corners of an outline

SAWN = "#dcd9d2"  # neutral: nothing is carved there

When = Literal["before", "after"]


def carving_svg(
    wall: Assembly, fixed: Bools, carved: Sequence[Carved], title: str, when: When = "after", sawn: Collection[str] = ()
) -> str:
    """Draw a wall and the stones in its cells as one `<svg>` element: as placed, with what comes off, or as carved.

    `fixed` (n,) are its held blocks, `sawn` the ids of those that are sawn new; the title is for readers that do not
    see it.
    """
    held, free = ([b for b, one in zip(wall.blocks, fixed, strict=True) if one == still] for still in (True, False))
    whole = [b.vertices for b in free] or [np.zeros((1, 3))]  # held blocks may reach beyond, and are cut off there
    off = [piece.vertices for c in carved for piece in c.offcuts] if when == "before" else []
    view = svg.front_view(np.concatenate(whole))
    paper = svg.fitted(view, np.concatenate([*whole, *off]), TALLEST, (MARGIN,) * 4, wide=True)
    outline = {b.id: _outline(paper.of(b.vertices), fans(b.faces)) for b in wall.blocks}
    filled = {c.cell for c in carved if len(c.triangles)} | {*sawn}
    placed = [(k, c) for k, c in enumerate(carved) if c.cell in outline]
    stones = (_stone(paper, c, outline[c.cell], f"{when}-{k}", when, stone(k)) for k, c in placed)
    corners = {b.id: b.vertices for b in wall.blocks}
    parts = [
        svg.layer("supports", (f'<path d="{outline[b.id]}" fill="url(#held)" stroke="{HATCH}"/>' for b in held)),
        svg.layer("sawn", (f'<path d="{outline[name]}" fill="{SAWN}"/>' for name in sawn)),
        svg.layer("stones", ['<g class="grain">', *stones, "</g>"]),
        svg.layer("cells", (_cell(outline[b.id], b.id in filled) for b in free)),
        svg.layer("shares", (_share(paper.of(corners[c.cell]), c.carved_share) for _, c in placed)),
    ]
    clip = f'<clipPath id="{when}">{svg.rect(0.0, 0.0, svg.WIDTH, paper.height, "")}</clipPath>'
    told = svg.layer("legend", _legend(carved, paper.height, when, len(sawn)))
    shown = [_patterns(), clip, f'<g clip-path="url(#{when})">', *parts, "</g>", told]
    more = svg.to_scale(paper.scale, paper.foot)
    return svg.sheet((svg.WIDTH, paper.height + LEGEND), title, shown, letters=17.0, more=more)


def _cell(outline: str, filled: bool) -> str:
    """A cell as it was drawn, dashed where it has no stone."""
    stroke = f'stroke="{INK}"' if filled else f'stroke="{GHOST}" stroke-dasharray="6 5"'
    return f'<path d="{outline}" fill="none" stroke-width="1.6" stroke-linejoin="round" {stroke}/>'


def _outline(flat: Floats, triangles: Ints) -> str:
    """Path of what a closed mesh covers, to be filled by the non-zero rule.

    It is the rim of the triangles that look one way: it runs round each place as often as they lie over it.
    """
    corner = flat[triangles]
    one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    seen = triangles[one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0] < 0.0]
    edge = seen[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    count = len(flat)
    rim = edge[~np.isin(edge[:, 0] * count + edge[:, 1], edge[:, 1] * count + edge[:, 0])]
    return "".join(_ring(flat[loop]) for loop in rings(rim))


def _ring(loop: Floats) -> str:
    """Path of one ring; nothing where it is too narrow to be seen."""
    (x, y), (ahead, up) = (loop - loop[0]).T, (np.roll(loop, -1, axis=0) - loop[0]).T
    length = float(np.hypot(ahead - x, up - y).sum())
    if not abs(float((x * up - y * ahead).sum())) > FINE * length:
        return ""
    way = [loop[0].tolist()]
    for a, b in loop[1:].tolist():
        if abs(a - way[-1][0]) + abs(b - way[-1][1]) > APART:
            way.append([a, b])
    return svg.closed(np.array(way), svg.EXACT)


def _stone(paper: svg.Paper, c: Carved, cell: str, name: str, when: When, colour: str) -> str:
    """One stone: what is left, and before it is carved what reaches beyond the outline of its cell."""
    said = f"<title>{escape(c.stone)} in {escape(c.cell)}: lambda {c.carved_share:.3f}, gap {c.gap_share:.3f}</title>"
    rim = f'stroke="{HATCH}" stroke-width="1.6" stroke-linejoin="round" paint-order="stroke"'  # no lines inside
    parts = [f'<path d="{_outline(paper.of(c.vertices), c.triangles)}" fill="{colour}" {rim}/>'] if c.volume else []
    off = "".join(_outline(paper.of(piece.vertices), piece.triangles) for piece in c.offcuts)
    if when == "before" and off:
        sheet_of_paper = f"M0 0H{svg.WIDTH:g}V{paper.height:.1f}H0Z"
        parts.append(
            f'<clipPath id="{name}"><path d="{sheet_of_paper}{cell}" clip-rule="evenodd"/></clipPath>'
            f'<path clip-path="url(#{name})" d="{off}" fill="url(#off)"'
            ' data-layer="offcuts"/>'
        )
    return f"<g>{said}{''.join(parts)}</g>"


def _share(cell: Floats, share: float) -> str:
    """How much of the stone comes off, in the middle of its cell; nothing where the letters would be too small."""
    x, y, width = middle_of(convex_hull(cell))
    size = min(0.2 * width, 17.0)
    words = f'font-size="{size:.1f}" text-anchor="middle" paint-order="stroke" stroke="#fff" stroke-width="3"'
    return svg.text(x, y + 0.35 * size, f"{100.0 * share:.0f} %", words) if size > SMALL else ""


def _patterns() -> str:
    def back(colour: str, opacity: float) -> str:
        return f'<rect width="7" height="7" fill="{colour}" fill-opacity="{opacity:g}"/>'

    off, held = svg.hatch("off", -45, 1.6, back(svg.PAPER, 0.5), SOFT), svg.hatch("held", back=back(SUPPORT, 1.0))
    return f"<defs>{svg.grain()}{off}{held}</defs>"


def _legend(carved: Sequence[Carved], top: float, when: When, sawn: int) -> list[str]:
    """What is carved off the whole wall, what hatch and numbers mean, and the neutral colour where some are sawn."""
    y, here, small = top + 26.0, total(carved).imposition, 'font-size="14"'
    new = [
        svg.rect(536.0, top + 37.0, 34.0, 16.0, f'fill="{SAWN}" stroke="{INK}"'),
        svg.text(580.0, top + 51.0, f"sawn new, {sawn} stone{'s' * (sawn != 1)}", small),
    ]
    off, says, meant = (
        ("to be carved off", "url(#off)", "comes off")
        if when == "before"
        else ("carved off", svg.PAPER, "what the stones do not fill")
    )
    return [
        svg.text(MARGIN, y, f'<tspan font-weight="600">Lambda {here:.3f}</tspan>: share of the stone {off}'),
        svg.text(MARGIN, y + 24.0, f"12 %: so much of one stone. To compare: {DATUM:g} Cyclopean Cannibalism", small),
        svg.rect(536.0, y - 13.0, 34.0, 16.0, f'fill="{says}" stroke="{HATCH if when == "before" else INK}"'),
        svg.text(580.0, y + 1.0, meant, small),
        *(new if sawn else []),
    ]


def carving_html(
    carved: Sequence[Carved],
    built: CarvedWall,
    result: Result,
    *,
    drawings: tuple[str, str],
    least: float,
    certificate_file: str | None = None,
) -> str:
    """Write the page of a carved wall: self-contained, without a script.

    It shows the stones in their cells, the wall that is built of them and what `check` says of that, and the drawings
    of `carving_svg`, before and after. Cuts down to `least` (m) were taken for dressing. `certificate_file`
    is for the command that verifies it.
    """
    notes = [*(n for c in carved for n in c.notes), *built.notes, *result.warnings]
    order = sorted(carved, key=lambda c: (-c.carved_share, c.cell))
    stones = markup.table(_HEAD, (_row(c) for c in order), elsewhere=" in cutlist.csv")
    body = (
        _headline(carved, built, result),
        markup.section("Before and after", _pictures(*drawings, built), MEANT),
        markup.section("In space", in_space(built.assembly, result.fixed, carved)),
        markup.section("Stone by stone", stones, _STONES.format(least=number(1e3 * least))),
        markup.section("What to know", markup.listed(notes)),
        _proof(result, certificate_file),
    )
    return markup.document(built.assembly.name, body, word=result.verdict, may=markup.POLICY)


_STONES = (
    "The most carved first. A cut lies on one plane of the cell; its depth is how far what comes off there reaches"
    " beyond that plane. Cuts that are nowhere deeper than {least} mm are left to the chisel and not counted."
    " Positions and angles of every cut, in the frame of the stone's own file, stand in cuts.csv."
)


def _headline(carved: Sequence[Carved], built: CarvedWall, result: Result) -> str:
    cuts, (word, said), whole = sum(not cut.dressing for c in carved for cut in c.cuts), answer(result), total(carved)
    reason = (
        f"As it will be built, with the gaps that the stones leave. {said}"
        f" Carved stones touch over {100.0 * built.touching_share:.0f} % of the joints that were drawn."
    )
    figures = [
        ("Lambda: carved off", f"{whole.imposition:.3f}"),
        ("gap: left empty", f"{whole.gap:.3f}"),
        ("stones", len(carved)),
        ("cuts", cuts),
        ("litres come off", f"{1e3 * (whole.stone_volume - whole.volume):,.0f}"),
        *([("sawn new", len(built.sawn))] if built.sawn else []),
    ]
    return markup.headline(built.assembly.name, figures, f"method {result.method}", answer=(word, reason))


def _pictures(before: str, after: str, built: CarvedWall) -> str:
    box = '<path d="M2 3H30V13H2Z" fill="none" stroke='
    keys = [markup.key(markup.SUPPORTED, "support"), markup.key(f'{box}"{INK}" stroke-width="1.6"/>', "cell, as drawn")]
    if built.missing:
        keys.append(markup.key(f'{box}"{GHOST}" stroke-dasharray="5 3"/>', "cell without a stone"))
    return markup.legend(keys) + markup.figure(before, _BEFORE) + markup.figure(after, _AFTER)


_BEFORE = "Stones as placed. What comes off in front of the wall and behind it is not seen from here."
_AFTER = (
    f"Carved back to their cells. Clifford and McGee measured about {DATUM:g} on their Cyclopean Cannibalism wall"
    " (ACADIA 2018)."
)


def in_space(wall: Assembly, fixed: Bools, carved: Sequence[Carved]) -> str:
    """Stones as a scene in 3D, `fixed` (n,) the held blocks; what is cut off them is seen as ghosts."""
    off = [(piece.vertices, piece.triangles) for c in carved for piece in c.offcuts]
    return markup.scene_figure(
        still(wall, fixed), wall.name, f"{markup.DRAG} Ghosts are what is cut off." if off else "", off=off
    )


MEANT = (
    "Lambda is the share of the stones' volume that is cut away: 0 is nothing. The gap is the share of the cells"
    " that the stones leave empty. Either alone says little: small stones need no cutting, and leave holes."
)


_HEAD = (
    "Stone", "Cell", ">Lambda", ">Gap", ">Stone (L)", ">Comes off (L)", ">Offcuts", ">Cuts", ">Cut area (m²)",
    ">Deepest (mm)",
)  # fmt: skip


def _row(c: Carved) -> list[str]:
    cuts = [cut for cut in c.cuts if not cut.dressing]
    return [
        escape(c.stone),
        escape(c.cell),
        markup.bar(c.carved_share, GHOST, f"{c.carved_share:.3f}"),
        f"{c.gap_share:.3f}",
        f"{1e3 * c.stone_volume:.1f}",
        f"{1e3 * (c.stone_volume - c.volume):.1f}",
        str(sum(not piece.dressing for piece in c.offcuts)),
        str(len(cuts)),
        f"{sum(cut.area for cut in cuts):.3f}",
        f"{1e3 * max((cut.depth for cut in cuts), default=0.0):.0f}",
    ]


def _proof(result: Result, certificate_file: str | None) -> str:
    if result.certificate is None or certificate_file is None:
        return ""
    kind = escape(str(result.certificate.get("kind", "")))
    return markup.section(
        "How to verify it",
        f"<pre>cyclopean verify {escape(certificate_file)}</pre>",
        f"The verdict on the wall as it will be built carries a certificate ({kind}), checked in exact arithmetic.",
    )
