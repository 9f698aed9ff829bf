"""The trade-off between carving and interlock: a curve of the walls, a picture of each, and the page of both."""

from collections.abc import Sequence
from html import escape

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.matching.tradeoff import Alternative, Tradeoff
from cyclopean.design.walls.interlock import interlock
from cyclopean.view.carving_drawing import MEANT
from cyclopean.view.colours import ACCENT, FORCE, INK, NEUTRAL, SOFT, shaded
from cyclopean.view.markup import document, figure, headline, listed, section, table
from cyclopean.view.svg import PAPER, grid, legend, open_path, rect, round_length, sheet, text
from cyclopean.view.wall_drawing import wall_svg

WIDE, HIGH, LEFT, BASE, TOP = 760.0, 440.0, 70.0, 340.0, 20.0  # of the sheet, and where its axes lie
AROUND = 0.08  # of its range, that an axis goes on beyond the outermost walls
LEAST = 0.02  # that an axis ranges over, so that rounding is not drawn large
LABEL = 17.0  # drawing units from a mark to its number
CHOSEN, OTHER = FORCE, SOFT
STONE, DARKER, MOST = "#f6f1e6", 0.62, 0.6  # a stone of which nothing comes off; how much darker one of such a share is
COLUMNS = (70.0, 230.0, 370.0, 560.0)  # of the legend
J_MEANT = "J says how well the stones interlock: 1 where no head joint stands above another and no four stones meet."
_CAPTION = (
    "Farther left, less is carved away; farther up, the stones interlock better. A wall is beaten by one that carves no"
    " more and interlocks no less; no wall beats those that the line joins. Crosses do not count: they cannot be shown"
    " to stand, or have more void than was asked for."
)


def tradeoff_svg(found: Tradeoff) -> str:
    """Draw J of every wall over its Lambda, with its number; those that none beats are joined."""
    value = np.array([(one.imposition, one.interlock) for one in found.alternatives])
    low, high = value.min(axis=0), value.max(axis=0)
    spare = AROUND * np.maximum(high - low, LEAST)
    low, high = low - spare, high + spare
    room = np.array([WIDE - LEFT - 30.0, TOP - BASE])
    place = np.array([LEFT, BASE]) + room * (value - low) / (high - low)
    levels, ticks = (_ticks(float(low[k]), float(high[k]), float(room[k]), (LEFT, BASE)[k]) for k in (1, 0))
    parts = [
        grid(LEFT, room[0], levels, ticks, BASE + 20.0),
        text(LEFT + room[0] / 2.0, BASE + 42.0, f"{_ACROSS}, at gap {found.gap:g}", _MIDDLE),
        text(18.0, (BASE + TOP) / 2.0, "J: interlock", f'{_MIDDLE} transform="rotate(-90 18 {(BASE + TOP) / 2:g})"'),
    ]
    joined = place[list(found.non_dominated)]
    if len(joined) > 1:
        parts.append(f'<path d="{open_path(joined)}" fill="none" stroke="{CHOSEN}" stroke-width="2"/>')
    way = np.linspace(joined[:-1], joined[1:], 9).reshape(-1, 2)  # places on the line
    labels = _labels(place, way)
    for k, (one, at, label) in enumerate(zip(found.alternatives, place, labels, strict=True)):
        kind = "cross" if one.fault(found.gap) else "full" if k in found.non_dominated else "hollow"
        parts.append(_mark(at, kind, square=k == 0))
        bold = f'font-weight="600" fill="{CHOSEN}"' if kind == "full" else f'fill="{OTHER}"'
        parts.append(text(label[0], label[1] + 4.5, str(k + 1), f'text-anchor="middle" {bold}'))
    here = np.array([12.0, -5.0])
    marks = [
        (_mark(here, "full"), "not beaten"),
        (_mark(here, "hollow"), "beaten"),
        (_mark(here, "cross"), "does not count"),
        (_mark(here, "hollow", square=True), "1, as drawn"),
    ]
    parts += legend("", marks, COLUMNS, (0.0, HIGH - 24.0))
    return sheet((WIDE, HIGH), "Interlock over the share that is carved away", parts, letters=14.0)


_ACROSS = "Lambda: share of the stones that is carved away"
_MIDDLE = f'text-anchor="middle" fill="{SOFT}"'


def _ticks(low: float, high: float, room: float, start: float) -> list[tuple[float, str]]:
    """Places (drawing units) of about five round values, and how they are written."""
    step = round_length((high - low) / 4.0)[0]
    digits = max(0, -int(np.floor(np.log10(step) + 1e-9)))
    value = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1)
    return [(start + room * (v - low) / (high - low), f"{v:.{digits}f}") for v in value.tolist()]


def _labels(place: Floats, line: Floats) -> Floats:
    """Where the number of each mark (n, 2) is written: beside it, far from others, numbers and a line (m, 2)."""
    turn = np.radians(45.0 * np.arange(8))
    ways = LABEL * np.stack([np.cos(turn), -np.sin(turn)], -1)
    found: list[Floats] = []
    for k, at in enumerate(place):
        taken = np.array([*np.delete(place, k, axis=0), *line, *found]).reshape(-1, 2)
        apart = np.linalg.norm((at + ways)[:, None] - taken, axis=2).min(axis=1, initial=3.0 * LABEL)
        found.append(at + ways[int(apart.round(6).argmax())])
    return np.array(found)


def _mark(at: Floats, kind: str, square: bool = False) -> str:
    """A wall on the curve."""
    x, y = at.tolist()
    if kind == "cross":
        return f'<path d="M{x - 5:.1f} {y - 5:.1f}l10 10m0 -10l-10 10" stroke="{ACCENT["unstable"]}" stroke-width="2"/>'
    style = f'fill="{CHOSEN if kind == "full" else PAPER}" stroke="{CHOSEN if kind == "full" else OTHER}"'
    style += ' stroke-width="2"'
    if square:
        return rect(x - 5.5, y - 5.5, 11.0, 11.0, style)
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5.5" {style}/>'


def alternative_svg(one: Alternative, title: str) -> str:
    """Draw a wall with its interlock; its stones are the darker the more of them is carved away."""
    tints = [NEUTRAL] * len(one.wall.pattern.kind)
    for p in one.match.placements:
        tints[int(one.cells.block[p.cell]) - 1] = _tint(p.carved_share)
    key = [text(0.0, 0.0, f"Lambda {one.imposition:.3f}, gap {one.gap:.3f}, {one.verdict}; carved off a stone:")]
    for k in range(5):
        share = MOST * k / 4.0
        key.append(rect(560.0 + 74.0 * k, -15.0, 20.0, 18.0, f'fill="{_tint(share)}" stroke="{INK}"'))
        key.append(text(585.0 + 74.0 * k, 0.0, f"{100.0 * share:.0f} %", 'font-size="15"'))
    found = interlock(one.wall.pattern, depth=one.asked.depth)
    return wall_svg(one.wall.pattern, found, title, tints=tints, key="".join(key))


def _tint(share: float) -> str:
    """Of a stone of which this share is carved away."""
    return shaded(STONE, 1.0 - DARKER * min(share / MOST, 1.0))


def tradeoff_html(found: Tradeoff, pictures: Sequence[str] | None = None) -> str:
    """Write the page: self-contained, without a script. `pictures` are those of the walls, where they are at hand."""
    name = found.alternatives[0].wall.assembly.name
    title = f"Carving against interlock: {name}"
    figures = [("walls", len(found)), ("not beaten", len(found.non_dominated)), ("gap of all", f"{found.gap:g}")]
    drawn = pictures or [alternative_svg(one, f"wall {k}") for k, one in enumerate(found.alternatives, 1)]
    order = [*found.non_dominated, *(k for k in range(len(found)) if k not in found.non_dominated)]
    fault = [one.fault(found.gap) or "beaten" for one in found.alternatives]
    said = ["not beaten" if k in found.non_dominated else fault[k] for k in range(len(found))]
    walls = "".join(figure(drawn[k], f"Wall {k + 1}: {said[k]}.") for k in order)
    body = (
        headline(title, figures),
        section("The curve", figure(tradeoff_svg(found), _CAPTION), f"{MEANT} {J_MEANT}"),
        section("Wall by wall", _table(found, order), "Those that none beats come first, the least carved of them."),
        section("The walls", walls, _WALLS),
        section("What to know", listed(found.notes)),
    )
    return document(title, body)


_WALLS = "The darker a stone, the more of it is carved away. J falls with head joints above each other, and crossings."


def _table(found: Tradeoff, order: Sequence[int]) -> str:
    head = ["Wall", ">Lambda", ">Carved (L)", ">Gap", ">J", "Verdict", ">Seed", ">Coursing", ">Depth (m)", ">Moved",
            "Laid out for J"]  # fmt: skip
    rows = []
    for k in order:
        one, asked = found.alternatives[k], found.alternatives[k].asked
        carved = 1e3 * sum(p.carved for p in one.match.placements)
        rows.append(
            (
                f"{k + 1}{', as drawn' if k == 0 else ''}{', not beaten' if k in found.non_dominated else ''}",
                *(f"{one.imposition:.3f}", f"{carved:.1f}", f"{one.gap:.3f}", f"{one.interlock:.3f}"),
                escape(one.verdict),
                *(f"{asked.seed}", f"{asked.coursing:.2f}", f"{asked.depth:.3f}", f"{asked.share:.2f}"),
                "yes" if asked.improved else "",
            )
        )
    return table(head, rows, elsewhere=" in tradeoff.json")
