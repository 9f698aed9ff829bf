"""Cards: what a notebook shows of a thing where a page would be too much; verdict, reason, figures, one picture.

A card is a piece of HTML with its styles in it, and nothing that could touch the notebook around it: pictures lie in
frames, which may load nothing from a network. A scene in 3D weighs about 0.8 MB; where one would weigh more than
`HEAVIEST`, a drawing stands there instead.
"""

from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np

from cyclopean.analysis import GRAVITY, LimitResult, Result
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block, supports
from cyclopean.design.construction.sequence import BuildSequence
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError
from cyclopean.view.building import building_svg
from cyclopean.view.colours import ACCENT, GHOST, HATCH, INK, LINE, SCALE, SOFT
from cyclopean.view.drawing import Picture, picture, picture_at_limit, still, without_points
from cyclopean.view.elevation import elevation_svg
from cyclopean.view.figures import number
from cyclopean.view.markup import POLICY, STILL
from cyclopean.view.scene import scene_html
from cyclopean.view.stone_sheet import stone_sheet_svg

__all__ = ["inventory_card", "limit_card", "model_card", "result_card", "sequence_card", "stones_card"]

HEAVIEST = 1_400_000  # characters of one picture
SHOWN = 24  # stones of an inventory
NOTES = 4  # warnings that are shown; the rest are counted

_CARD = (
    f"background:#fff;color:{INK};border:1px solid {LINE};border-left:.45rem solid {{}};border-radius:.3rem;"
    "padding:.9rem 1.1rem;max-width:56rem;font:15px/1.5 system-ui,sans-serif;overflow-wrap:anywhere"
)
_FRAME = f"display:block;width:100%;border:1px solid {LINE};border-radius:.3rem;margin-top:.8rem;background:#fff"

DOWN = np.array(GRAVITY)

Figures = Sequence[tuple[str, str]]


def result_card(result: Result) -> str:
    """Verdict, reason, what was assumed, and the forces or the motion.

    Parameters
    ----------
    result : Result
        From a check.
    """
    drawn = picture(result)
    free = len(result.assembly) - int(result.fixed.sum())
    figures = [("blocks", f"{len(result.assembly):,}"), ("of them free", f"{free:,}")]
    figures += [("contacts", f"{len(result.contacts):,}"), ("method", result.method)]
    figures.append(("proof", _proof(result)))
    meaning = {"utilisation": ("friction used", "1 = about to slide"), "movement": ("movement", "1 = the largest")}
    scale = _ramp(*meaning[drawn.quantity]) if drawn.quantity in meaning else ""
    return _card(
        result.verdict.capitalize(),
        f"{result.assembly.name}: {result.reason}",
        figures,
        scale + _scene(drawn, result.assembly.name),
        accent=ACCENT[result.verdict],
        soft=[_assumed(result)] if result.assumed else [],
        notes=result.warnings,
    )


def limit_card(result: LimitResult) -> str:
    """Bounds of the multiplier, why, and the motion at the upper one.

    Parameters
    ----------
    result : LimitResult
        From a limit analysis.
    """
    drawn = picture_at_limit(result)
    title = {"falls": "Falls already", "unbounded": "No limit found", "undecided": "Undecided"}.get(result.word)
    figures = [("stands up to", _bound(result.lower)), ("falls from", _bound(result.upper)), ("method", result.method)]
    value = _bound(result.value)
    if result.angle is not None:
        low, high = result.angle
        figures[:2] = [("stands up to", f"{_bound(low)}°"), ("falls from", f"{_bound(high)}°")]
        value = f"{number(low if low is not None else np.nan, 4)}°"
    scale = _ramp("movement", "1 = the largest") if drawn.motion is not None else ""
    return _card(
        title or f"Limit {value}",
        f"{result.assembly.name}: {result.reason}",
        [*figures, ("proof", _proof(result))],
        scale + _scene(drawn, result.assembly.name),
        soft=[_assumed(result)] if result.assumed else [],
        notes=result.warnings,
    )


def _proof(result: Result | LimitResult) -> str:
    return "none" if result.certificate is None else f"{result.certificate.get('kind', '')}, checked"


def _bound(value: float | None) -> str:
    return "not proved" if value is None else number(value, 6)


def _assumed(result: Result | LimitResult) -> str:
    parts = [f"{name} {_plain(value)}" for name, value in result.assumed.items()]
    return f"assumed: {', '.join(parts)}"


def _plain(value: Any) -> str:
    if isinstance(value, int | float):
        return f"{value:g}"
    return value if isinstance(value, str) else f"({', '.join(f'{float(x):g}' for x in value)})"


def model_card(assembly: Assembly, kind: str = "structure") -> str:
    """Blocks and supports; no verdict, for nothing was checked.

    Parameters
    ----------
    assembly : Assembly
        The structure.
    kind : str
        What it is.
    """
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
    return _card(assembly.name, f"a {kind}, not checked", figures, _scene(drawn, assembly.name))


def sequence_card(sequence: BuildSequence) -> str:
    """Whether it stands at every stage, and how it is built; the drawing moves at a click.

    Parameters
    ----------
    sequence : BuildSequence
        How a structure is built.
    """
    steps, first = sequence.steps, sequence.first_unstable
    words = [step.verdict for step in steps]
    figures = [("stones", f"{len(steps):,}"), ("layers", f"{int(sequence.layer.max(initial=0)):,}")]
    figures += [(f"stages {word}", f"{words.count(word):,}") for word in ACCENT if word in words]
    if first is None:
        title, text, accent = "Stands at every stage", "every stage was proved stable without props", ACCENT["stable"]
    else:
        step = steps[first]
        name = sequence.assembly.blocks[step.block].id
        title = "Needs props" if any(s.propped == "stable" for s in steps) else "Does not stand while built"
        text, accent = f"{step.verdict} from step {first + 1}, with stone {name}", ACCENT[step.verdict]
    svg = building_svg(sequence)
    shown = (
        _drawing(svg, f"{sequence.assembly.name}, how it is built")
        if len(svg) <= HEAVIEST
        else _scene(still(sequence.assembly, sequence.fixed, gravity=DOWN), title)
    )
    soft = ["Click the drawing to see it built."] if steps and len(svg) <= HEAVIEST else []
    return _card(
        title, f"{sequence.assembly.name}: {text}", figures, shown, accent=accent, soft=soft, notes=sequence.warnings
    )


def stones_card(
    title: str,
    text: str,
    figures: Figures,
    bodies: Sequence[Block],
    carved_share: Floats,
    *,
    held: Sequence[Block] = (),
    notes: Sequence[str] = (),
) -> str:
    """Stones in a wall, each in the colour of how much of it is carved off.

    Parameters
    ----------
    title, text : str
        What it is.
    figures : sequence of (str, str)
        What, and how much.
    bodies : sequence of Block
        The stones where they lie; at least one, or a held block.
    carved_share : (n,) float
        Lambda of each.
    held : sequence of Block
        Supports, drawn with them.
    notes : sequence of str
        What a reader should know.
    """
    whole = Assembly(
        tuple(Block(f"{k}", b.vertices, b.faces) for k, b in enumerate((*bodies, *held)) if len(b.faces)), contacts=None
    )
    share = np.concatenate([np.asarray(carved_share, float), np.zeros(len(held))])
    fixed = np.arange(len(share)) >= len(bodies)
    there = np.array([len(b.faces) > 0 for b in (*bodies, *held)], bool)
    drawn = still(whole, fixed[there], share[there], DOWN)
    return _card(title, text, figures, _ramp("carved off", "1 = all of it") + _scene(drawn, title), notes=notes)


def inventory_card(stones: Sequence[Stone], source: str, notes: Sequence[str] = ()) -> str:
    """Some of the stones, and what they come to.

    Parameters
    ----------
    stones : sequence of Stone
        At least one.
    source : str
        Where they are from.
    notes : sequence of str
        What was repaired or refused.
    """
    volume = np.array([stone.volume for stone in stones])
    figures = [("stones", f"{len(stones):,}"), ("m³", number(float(volume.sum())))]
    if len(stones):
        figures.append(("litres each", f"{number(1e3 * float(volume.min()))} to {number(1e3 * float(volume.max()))}"))
    shown = _drawing(stone_sheet_svg(stones, most=SHOWN), source) if len(stones) else ""
    return _card(source, "found stones", figures, shown, notes=notes)


def _scene(drawn: Picture, name: str) -> str:
    """A frame with the scene in 3D, or with an elevation where that would be too heavy."""
    page = scene_html(drawn)
    if len(page) > HEAVIEST:
        return _drawing(elevation_svg(without_points(drawn), name), name)
    guarded = page.replace("<head>", f'<head><meta http-equiv="Content-Security-Policy" content="{POLICY}">', 1)
    return _frame(guarded, f"3D scene: {name}", "aspect-ratio:3/2;max-height:34rem")


def _drawing(svg: str, name: str) -> str:
    """A frame with a drawing: alone in its document, its ids meet no others."""
    page = (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><meta http-equiv="Content-Security-Policy"'
        f' content="{STILL}"><style>body{{margin:0;font-family:system-ui,sans-serif}}'
        f"svg{{display:block;width:100%;height:98vh}}</style></head><body>{svg}</body></html>"
    )
    return _frame(page, name, "aspect-ratio:3/2;max-height:34rem")


def _frame(page: str, name: str, shape: str) -> str:
    return (
        f'<iframe title="{escape(name)}" srcdoc="{escape(page, quote=True)}" loading="lazy"'
        f' style="{_FRAME};{shape}"></iframe>'
    )


def _ramp(what: str, high: str) -> str:
    """The scale of the colours."""
    steps = "".join(f'<i style="background:{colour};width:1.1rem;height:.7rem"></i>' for colour in SCALE)
    return (
        f'<div style="display:flex;gap:.5rem;align-items:center;margin-top:.7rem;font-size:13px;color:{SOFT}">'
        f'{escape(what)} 0<span style="display:inline-flex;border:1px solid {HATCH}">{steps}</span>{escape(high)}</div>'
    )


def _card(
    title: str,
    text: str,
    figures: Figures,
    shown: str,
    *,
    accent: str = GHOST,
    soft: Sequence[str] = (),
    notes: Sequence[str] = (),
) -> str:
    cells = "".join(
        f'<span style="margin-right:1.4rem"><b>{escape(value)}</b> <i style="color:{SOFT};font-style:normal">'
        f"{escape(what)}</i></span>"
        for what, value in figures
    )
    lines = [*soft, *notes[:NOTES]]
    if len(notes) > NOTES:
        lines.append(f"and {len(notes) - NOTES} more notes")
    below = "".join(f'<div style="color:{SOFT};font-size:13px">{escape(line)}</div>' for line in lines)
    colour = accent if accent != GHOST else INK
    return (
        f'<div class="cyclopean-card" style="{_CARD.format(accent)}">'
        f'<div style="font-size:1.6rem;font-weight:700;line-height:1.2;color:{colour}">{escape(title)}</div>'
        f'<div style="margin:.2rem 0 .5rem">{escape(text)}</div><div>{cells}</div>{below}{shown}</div>'
    )
