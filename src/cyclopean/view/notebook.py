"""Cards: what a notebook shows of a thing where a page would be too much; verdict, reason, figures, one picture.

A card is a piece of HTML with its styles in it, and nothing that could touch the notebook around it: pictures lie in
frames, which may load nothing from a network. A scene in 3D weighs about 0.8 MB and is there only where it is asked
for; a drawing is below `HEAVIEST`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape

import numpy as np

from cyclopean.analysis import GRAVITY, LimitResult, Result
from cyclopean.assembly import Assembly, Block, supports
from cyclopean.design.construction.sequence import BuildSequence
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError
from cyclopean.texts import plain
from cyclopean.view.building import building_svg, outcome
from cyclopean.view.colours import ACCENT, GHOST, INK, LINE, SOFT
from cyclopean.view.drawing import Picture, picture, picture_at_limit, still, without_points
from cyclopean.view.elevation import FACE_LIMIT, elevation_svg
from cyclopean.view.figures import number
from cyclopean.view.markup import POLICY, STILL, told
from cyclopean.view.scene import scene_html
from cyclopean.view.stone_sheet import stone_sheet_svg

HEAVIEST = 70_000  # characters of one drawing: a cell stays below 100 kB when its quotes are escaped
SHOWN = 24  # stones of an inventory
NOTES = 4  # warnings that are shown; the rest are counted

_CARD = (
    f"background:#fff;color:{INK};border:1px solid {LINE};border-left:.45rem solid {{}};border-radius:.3rem;"
    "padding:.9rem 1.1rem;max-width:56rem;font:15px/1.5 system-ui,sans-serif;overflow-wrap:anywhere"
)
_FRAME = (
    f"display:block;width:100%;border:1px solid {LINE};border-radius:.3rem;margin-top:.8rem;background:#fff;"
    "aspect-ratio:3/2;max-height:34rem"
)
_GUARD = '<meta http-equiv="Content-Security-Policy" content="{}">'

DOWN = np.array(GRAVITY)

Figures = Sequence[tuple[str, str]]


def result_card(result: Result, scene: bool = False) -> str:
    """Verdict, reason, what was assumed, and the forces or the motion of a check."""
    free = len(result.assembly) - int(result.fixed.sum())
    figures = [("blocks", f"{len(result.assembly):,}"), ("of them free", f"{free:,}")]
    figures += [("contacts", f"{len(result.contacts):,}"), ("method", result.method)]
    shown = _shown(picture(result), result.assembly.name, scene)
    return _result(result, result.verdict.capitalize(), figures, shown, ACCENT[result.verdict])


def limit_card(result: LimitResult, scene: bool = False) -> str:
    """Bounds of the multiplier, why, and the motion at the upper one."""
    title = {"falls": "Falls already", "unbounded": "No limit found", "undecided": "Undecided"}.get(result.word)
    (low, high), unit, value = (result.lower, result.upper), "", _bound(result.value)
    if result.angle is not None:
        (low, high), unit = result.angle, "°"
        value = f"{number(low if low is not None else np.nan, 4)}°"
    figures = [("stands up to", _bound(low, unit)), ("falls from", _bound(high, unit)), ("method", result.method)]
    shown = _shown(picture_at_limit(result), result.assembly.name, scene)
    return _result(result, title or f"Limit {value}", figures, shown, GHOST)


def _result(result: Result | LimitResult, title: str, figures: list[tuple[str, str]], shown: str, accent: str) -> str:
    """The card of an answer that may be proved."""
    proof = "none" if result.certificate is None else f"{result.certificate.get('kind', '')}, checked"
    assumed = ", ".join(f"{name} {plain(value)}" for name, value in result.assumed.items())
    said = Told(title, f"{result.assembly.name}: {result.reason}", [*figures, ("proof", proof)], result.warnings)
    return _card(said, shown, accent, [f"assumed: {assumed}"] if assumed else [])


def _bound(value: float | None, unit: str = "") -> str:
    return "not proved" if value is None else f"{number(value, 6)}{unit}"


def model_card(assembly: Assembly, kind: str = "structure", scene: bool = False) -> str:
    """Blocks and supports of a structure of some kind; no verdict, for nothing was checked."""
    try:
        held = supports(assembly)[0]
    except InputError:  # a model that says that nothing is held is still to be seen
        held = np.zeros(len(assembly), bool)
    contacts = "to be detected" if assembly.contacts is None else f"{len(assembly.contacts):,}"
    figures = [
        ("blocks", f"{len(assembly):,}"),
        ("held", f"{int(held.sum()):,}"),
        ("contacts", contacts),
        ("m³", number(float(np.abs(assembly.mass.volume).sum()))),
    ]
    if assembly.loads:
        figures.append(("loads", f"{len(assembly.loads):,}"))
    drawn = still(assembly, held, gravity=DOWN)
    said = Told(assembly.name, f"a {kind}, not checked", figures)
    return _card(said, _shown(drawn, assembly.name, scene))


def sequence_card(sequence: BuildSequence, scene: bool = False) -> str:
    """Whether a structure stands at every stage, and how it is built; the drawing moves at a click."""
    words, (title, text, word) = [step.verdict for step in sequence.steps], outcome(sequence)
    figures = [("stones", f"{len(words):,}"), ("layers", f"{int(sequence.layer.max(initial=0)):,}")]
    figures += [(f"stages {one}", f"{words.count(one):,}") for one in ACCENT if one in words]
    name, svg = sequence.assembly.name, building_svg(sequence)
    if len(svg) <= HEAVIEST and not scene:
        shown, soft = _drawing(svg, f"{name}, how it is built"), ["Click the drawing to see it built."] if words else []
    else:
        shown, soft = _shown(still(sequence.assembly, sequence.fixed, gravity=DOWN), title, scene), []
    return _card(Told(title, f"{name}: {text}", figures, sequence.warnings), shown, ACCENT[word], soft)


@dataclass(frozen=True, slots=True)
class Told:
    """What a card says beside what it shows."""

    title: str
    text: str
    figures: Figures
    notes: Sequence[str] = ()


def stones_card(said: Told, bodies: Sequence[Block], *, held: Sequence[Block] = (), scene: bool = False) -> str:
    """Stones in a wall.

    `bodies` are the stones where they lie, `held` the supports that are drawn with them; there is at least one body or
    support.
    """
    parts = ((bodies, False), (held, True))
    there = [(body, one) for some, one in parts for body in some if len(body.faces)]
    whole = Assembly(tuple(Block(f"{k}", b.vertices, b.faces) for k, (b, _) in enumerate(there)), contacts=None)
    drawn = still(whole, np.array([one for _, one in there], bool), gravity=DOWN)
    return _card(said, _shown(drawn, said.title, scene))


def inventory_card(stones: Sequence[Stone], source: str, notes: Sequence[str] = ()) -> str:
    """Some of the stones of an inventory, what they come to, and notes: what was repaired or refused."""
    volume = np.array([stone.volume for stone in stones])
    figures = [("stones", f"{len(stones):,}"), ("m³", number(float(volume.sum())))]
    if len(stones):
        figures.append(("litres each", f"{number(1e3 * float(volume.min()))} to {number(1e3 * float(volume.max()))}"))
    sheets = (stone_sheet_svg(stones, most=SHOWN // part) for part in (1, 3, 8) if len(stones))
    shown = next((_drawing(svg, source) for svg in sheets if len(svg) <= HEAVIEST), "")
    return _card(Told(source, "found stones", figures, notes), shown)


def _shown(drawn: Picture, name: str, scene: bool) -> str:
    """A frame with an elevation, of silhouettes where it would be too heavy; or, asked for, with a scene."""
    if scene:
        page = scene_html(drawn)
        return _frame(page.replace("<head>", f"<head>{_GUARD.format(POLICY)}", 1), f"3D scene: {name}")
    plain = replace(without_points(drawn), rest=None)  # nothing moves: that would be a second drawing
    for faces in (FACE_LIMIT, 0):
        if len(svg := elevation_svg(plain, name, faces=faces)) <= HEAVIEST:
            return _drawing(svg, name)
    return ""


def _drawing(svg: str, name: str) -> str:
    """A frame with a drawing: alone in its document, its ids meet no others."""
    style = "body{margin:0;font-family:system-ui,sans-serif}svg{display:block;width:100%;height:98vh}"
    head = f'<meta charset="utf-8">{_GUARD.format(STILL)}<style>{style}</style>'
    return _frame(f'<!doctype html><html lang="en"><head>{head}</head><body>{svg}</body></html>', name)


def _frame(page: str, name: str) -> str:
    return (
        f'<iframe title="{escape(name)}" srcdoc="{escape(page, quote=True)}" loading="lazy" style="{_FRAME}"></iframe>'
    )


def _card(said: Told, shown: str, accent: str = GHOST, soft: Sequence[str] = ()) -> str:
    cells = "".join(
        f'<span style="margin-right:1.4rem"><b>{escape(value)}</b> <i style="color:{SOFT};font-style:normal">'
        f"{escape(what)}</i></span>"
        for what, value in said.figures
    )
    lines = [*soft, *said.notes[:NOTES]]
    if len(said.notes) > NOTES:
        lines.append(f"and {len(said.notes) - NOTES} more notes")
    below = "".join(f'<div style="color:{SOFT};font-size:13px">{told(line)}</div>' for line in lines)
    colour = accent if accent != GHOST else INK
    return (
        f'<div class="cyclopean-card" style="{_CARD.format(accent)}">'
        f'<div style="font-size:1.6rem;font-weight:700;line-height:1.2;color:{colour}">{escape(said.title)}</div>'
        f'<div style="margin:.2rem 0 .5rem">{told(said.text)}</div><div>{cells}</div>{below}{shown}</div>'
    )
