"""The page of limit analysis: both bounds, the mechanism in motion, the joints that move, and the curves."""

from html import escape
from typing import Any

import numpy as np

from cyclopean.analysis import CoupledBracket, LimitResult, Polar, Pushover, PushoverStep, Travelling, moving_joints
from cyclopean.analysis.answers import amount, limit_answer
from cyclopean.arrays import Floats
from cyclopean.view.colours import ACCENT, GRAVITY, INK, LINE, LOAD, SOFT
from cyclopean.view.drawing import Picture, followed, picture_at_limit
from cyclopean.view.elevation import elevation_svg
from cyclopean.view.figures import number
from cyclopean.view.markup import (
    DASHED,
    POLICY,
    SUPPORTED,
    arrow,
    document,
    figure,
    headline,
    key,
    legend,
    listed,
    model_figures,
    section,
    switch,
    table,
    written_first,
)
from cyclopean.view.proof_here import proof_here
from cyclopean.view.svg import closed, grid, open_path, sheet, text
from cyclopean.view.tables import joint_name

MOST = 40  # joints listed
RING = f'<circle cx="16" cy="8" r="5" fill="#fff" stroke="{LOAD}" stroke-width="2.4"/>'
STILL = 1e-6  # degrees: less than that is rounding
BOUND = 6  # digits of both bounds: they are a millionth apart
STANDS_TO, FALLS_FROM = "stands, proved, up to", "falls, proved, from"
MULTIPLIER = {
    "push": "multiplier of the push",
    "tilt": "tangent of the angle",
    "load": "multiplier of the load given",
}
WORDS = {"limit": "Limit", "unbounded": "No limit", "falls": "Falls", "undecided": "Undecided"}
TONES = {"limit": "stable", "unbounded": "stable", "falls": "unstable", "undecided": "undecided"}
KINDS = {"hinge": "opens about a hinge", "slide": "slides", "part": "parts"}
STANDS = ACCENT["stable"]
RADIUS = 190.0  # drawing units of the outermost circle
RINGS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0)  # degrees, or pushes, that circles may be apart


def limit_html(
    result: LimitResult,
    *,
    certificate_file: str | None = None,
    model_file: str | None = None,
) -> str:
    """Write the page of both bounds as one self-contained HTML document; files are named in its commands."""
    drawn, polar, pushover, moved = picture_at_limit(result), result.polar, result.pushover, result.travelling
    body = (
        _head(result, model_file),
        section("The bounds", _bounds(result), _MEANING[result.live.kind]),
        section(
            "How it moves" if drawn.motion else "The model",
            _keys(drawn, result)
            + model_figures(drawn, result.assembly.name, _MOVES if drawn.motion else "Forces at the lower bound."),
        ),
        section("Joints that move", _joints(result), _JOINTS),
        section("Without dilatancy", _coupled(result.coupled), _COUPLED),
        section("In every direction", "" if polar is None else figure(polar_svg(polar), _polar_caption(polar))),
        section("The load in every place", "" if moved is None else _travelling(moved), _TRAVELLING),
        section("As it goes on", "" if pushover is None else _pushover(pushover, result), _PUSHOVER),
        section("Warnings", listed(result.warnings)),
        section("How to verify it", _proof(result, certificate_file, model_file)),
        section("How it was computed", _provenance(result)),
    )
    title = f"{result.assembly.name}: {WORDS[result.word].lower()}"
    return document(title, body, word=TONES[result.word], may=POLICY)


def _keys(drawn: Picture, result: LimitResult) -> str:
    load = "the push on all blocks together" if result.live.push else "load that grows"
    return legend(
        [
            switch(drawn.quantity),
            key(SUPPORTED, "support"),
            key(arrow(LOAD), f"{load}, as large as at the limit") if len(drawn.load) else "",
            key(f'<circle cx="16" cy="8" r="6" fill="{LOAD}"/>', "hinge") if len(drawn.hinge) else "",
            key(RING, "joint that slides") if len(drawn.slide) else "",
            key(DASHED, "where it stands") if len(drawn.ghost) else "",
            key(arrow(GRAVITY), "gravity"),
        ]
    )


_MOVES = "The mechanism at the upper bound, drawn so that the largest movement is a quarter of a mean block."
_MEANING = {
    "push": (
        "The multiplier is of a push on every block, in shares of its weight under standard gravity. At the lower one"
        " contact forces balance all loads; from the upper one on a mechanism shows that none can."
    ),
    "tilt": (
        "The ground is tilted until a mechanism forms; the multiplier is the tangent of the angle. At the lower one"
        " contact forces balance all loads; at the upper one a mechanism shows that none can."
    ),
    "load": (
        "The multiplier is of the live loads. At the lower one contact forces balance all loads; from the upper one on"
        " a mechanism shows that none can."
    ),
}
_JOINTS = (
    "In the mechanism of the upper bound. A hinge keeps touching at an edge or a corner; the speed is that of its"
    " fastest point, the fastest joint has 1."
)
_COUPLED = (
    "Rigid-block equilibrium lets a joint that slides dilate, as no real friction does, so that its limit is an upper"
    " bound for Coulomb friction. Coupled analysis asks whether a motion without dilatancy produces the forces. What it"
    " does not certify need not fall. Each verdict is about one multiplier: between two that are proved, and above one"
    " without a coupled state, nothing is, until the bound from which on a mechanism rules out all."
)
_PUSHOVER = (
    "At each step the limit is found anew on the displaced geometry. Joints that have opened bear nothing; points that"
    " press stay in touch, no further than the edges of both faces; stones that run into each other bear on each other"
    " from there on. Bounds on the limit of the stones at that place are checked in exact arithmetic where they are"
    " proved."
)


def _head(result: LimitResult, model_file: str | None) -> str:
    n, held = len(result.assembly), int(result.fixed.sum())
    figures = [("blocks", n), ("of them free", n - held), ("contacts", len(result.contacts))]
    title, said = limit_answer(result)
    answer = title, said if said == result.reason else f"{said} {result.reason}"
    return headline(result.assembly.name, figures, "rigid-block limit analysis", answer=answer, model_file=model_file)


def _bounds(result: LimitResult) -> str:
    rows = [
        (word, _amount(result, value, up))
        for word, value, up in ((STANDS_TO, result.lower, False), (FALLS_FROM, result.upper, True))
    ]
    bounds = f"{_number(result.lower)} to {_number(result.upper)}"
    rows.append((MULTIPLIER[result.live.kind], f"{result.value:.6g}" if result.word == "limit" else bounds))
    if np.isfinite(result.gap):
        rows.append(("apart by", f"{number(result.gap, 2)} of it"))
    if result.window is not None:
        rows.append(("stands only between", f"{number(result.window[0])} and {number(result.window[1])}"))
    if result.live.words:
        rows.append(("what grows", escape(result.live.words)))
    if result.loading is not None:
        rows += [("loads", escape(words)) for words in result.loading.words().split("; ")]
    if result.assumed:
        rows += [(f"{name} (assumed)", _assumed(name, value)) for name, value in result.assumed.items()]
    return table(["", ""], rows)


def _assumed(name: str, value: Any) -> str:
    """What stood in for what nobody said, with its unit."""
    parts = value if isinstance(value, list | tuple) else [value]
    told = ", ".join(escape(part) if isinstance(part, str) else number(float(part), 6) for part in parts)
    unit = {"density": " kg/m³", "gravity": " m/s²"}.get(name, "")
    return f"({told}){unit}" if len(parts) > 1 else f"{told}{unit}"


def _amount(result: LimitResult, value: float | None, up: bool) -> str:
    """A bound, in the unit of what grows."""
    if value is None:
        return "not proved"
    much, what = amount(result.live, value, up, BOUND)
    return escape(much if result.live.kind != "load" else f"{much} {what}")


def _number(value: float | None) -> str:
    return "not proved" if value is None else f'<span title="{value:.10g}">{number(value)}</span>'


def _joints(result: LimitResult) -> str:
    rows = [
        (joint_name(result, j.contact), KINDS[j.kind], f"{j.speed:.3f}", ", ".join(f"{x:.3f}" for x in j.point))
        for j in moving_joints(result)
    ]
    return table(["Joint", "How", ">Speed (fastest = 1)", ">About x, y, z (m)"], rows, MOST)


def _coupled(coupled: CoupledBracket | None) -> str:
    if coupled is None:
        return ""
    rows = [("largest multiplier certified", "none" if coupled.stands is None else number(coupled.stands))]
    if coupled.not_yet is not None:
        rows.append((f"least that is not ({coupled.word})", number(coupled.not_yet)))
    if coupled.falls is not None:
        rows.append(("least above it that is proved to have no coupled state", number(coupled.falls)))
    return table(["", ""], rows) + table(
        ["Multiplier tried", "Verdict"], [(number(t), word) for t, word in coupled.trials]
    )


def _polar_caption(polar: Polar) -> str:
    stands, unit = next(low for azimuth, low, _ in polar.table if azimuth == polar.towards), _unit(polar)
    if stands is None:
        return f"{len(polar.results)} azimuths."
    return (
        f"{len(polar.results)} azimuths; the least of them is {number(stands)}{unit} towards {polar.towards:g}°"
        " (between two of them it may be less). From +x to the right, counter-clockwise to +y."
    )


def _unit(polar: Polar) -> str:
    return "°" if polar.least.live.tilt is not None else ""


def polar_svg(polar: Polar) -> str:
    """Draw what is proved to stand, by azimuth, on circles of equal angle, or multiplier of a push."""
    known = [(az, low or 0.0, high) for az, low, high in polar.table]
    most = 90.0 if _unit(polar) else max((low for _, low, high in known if high is not None), default=1.0)
    shown = [(az, most if high is None and low else low) for az, low, high in known]
    top = max((value for _, value in shown), default=1.0) or 1.0
    ring = next((step for step in RINGS if top / step <= 5.0), RINGS[-1])
    rings = np.arange(ring, top * 1.001 + ring, ring)
    reach = RADIUS / float(rings[-1])
    parts = []
    for value in rings:
        parts.append(f'<circle r="{value * reach:.1f}" fill="none" stroke="{LINE}"/>')
        parts.append(text(4.0, -value * reach - 3.0, f"{value:g}{_unit(polar)}", f'fill="{SOFT}" font-size="11"'))
    parts.append(f'<path d="M-200 0H200M0 -200V200" stroke="{LINE}"/>')
    points = (
        np.array([(value * np.cos(np.deg2rad(az)), -value * np.sin(np.deg2rad(az))) for az, value in shown]) * reach
    )
    parts.append(f'<path d="{closed(points)}" fill="{STANDS}" fill-opacity=".18" stroke="{STANDS}"/>')
    for (x, y), (az, value) in zip(points.tolist(), shown, strict=True):
        parts.append(_dot(x, y, f"<title>{az:g}°: {number(value)}{_unit(polar)}</title>"))
    for x, y, anchor, name in ((204, 4, "start", "+x"), (-204, 4, "end", "−x"), (0, -206, "middle", "+y")):
        parts.append(text(x, y, name, f'text-anchor="{anchor}"'))
    centred = ['<g transform="translate(240 230)">', *parts, "</g>"]
    title, narrow = "Tilt by azimuth" if _unit(polar) else "Push by azimuth", ' style="max-width:34rem"'
    return sheet((480.0, 450.0), title, centred, letters=13.0, white=False, more=narrow)


def _dot(x: float, y: float, title: str = "") -> str:
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{STANDS}">{title}</circle>'


def _pushover(pushover: Pushover, result: LimitResult) -> str:
    caption = f"Control block '{escape(pushover.control)}'. How it ends: {escape(pushover.ended)}."
    head = ["Displacement (m)", ">Rotation (°)", ">Multiplier", ">Limit", "Proved", ">Points in touch", ""]
    rows = (
        (
            number(s.displacement),
            number(s.rotation if s.rotation > STILL else 0.0),
            number(s.multiplier),
            escape(amount(result.live, s.multiplier, up=False)[0]),
            _proved(s),
            f"{s.touching:,}",
            escape(", ".join(f"{one} and {other} meet" for one, other in s.met)),
        )
        for s in pushover.steps
    )
    place = followed(result)
    said = "The stones where the curve ends, over where they stood."
    end = "" if place is None else figure(elevation_svg(place, "Where it ends"), said)
    return figure(pushover_svg(pushover), caption) + end + table(head, rows)


def _proved(step: PushoverStep) -> str:
    """Which bounds of a point are proved."""
    ends = [("stands at", step.lower), ("falls from", step.upper)]
    return ", ".join(f"{word} {_number(value)}" for word, value in ends if value is not None) or "neither bound"


def pushover_svg(pushover: Pushover) -> str:
    """Draw the multiplier over the displacement of the control block."""
    u, t = np.array([(step.displacement, step.multiplier) for step in pushover.steps]).T
    return _curve(u, t, "Pushover curve", "displacement of the control block (m); upright: multiplier")


def _travelling(moved: Travelling) -> str:
    caption = (
        f"{len(moved.places)} places; the least of them is x = {moved.at:g} m (between two of them it may be less)."
    )
    rows = [
        (f"{x:g}", WORDS[one.word], _number(one.lower), _number(one.upper))
        for x, one in zip(moved.places, moved.results, strict=True)
    ]
    return figure(travelling_svg(moved), caption) + table(["x (m)", "", ">Stands at (kN)", ">Falls from (kN)"], rows)


def travelling_svg(moved: Travelling) -> str:
    """Draw the load (kN) that is proved to stand over its place; places without a limit are left out."""
    rows = [(x, one.lower) for x, one in zip(moved.places, moved.results, strict=True) if one.lower and one.upper]
    x, y = (np.array(column, float) for column in zip(*rows, strict=True)) if rows else (np.zeros(1), np.zeros(1))
    return _curve(x, y, "Load by place", "place of the load, x (m); upright: load that stands (kN)", least=moved.at)


def _curve(u: Floats, t: Floats, title: str, axes: str, least: float | None = None) -> str:
    """A curve from its points, (k,) each, with the place marked where it is `least`."""
    wide, high, left, foot = 560.0, 260.0, 60.0, 36.0
    start = min(float(u.min()), 0.0) if least is None else float(u.min())
    right, top = float(u.max()) - start or 1.0, float(max(t.max(), 0.0)) or 1.0
    low = float(min(t.min(), 0.0))
    shares = np.linspace(0.0, 1.0, 5)
    values = low + shares * (top - low)  # three digits, or all before the point
    said = (f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}" for value in values)
    levels = list(zip(12.0 + high * (1.0 - shares), said, strict=True))
    ticks = [(left + wide * share, f"{start + share * right:.3g}") for share in shares]
    points = np.stack([left + wide * (u - start) / right, 12.0 + high * (top - t) / (top - low)], -1)
    parts = [
        grid(left, wide, levels, ticks, high + 30.0),
        f'<path d="{open_path(points)}" fill="none" stroke="{STANDS}" stroke-width="2"/>',
        *(_dot(x, y) for x, y in points.tolist()),
        *(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="none" stroke="{INK}"/>'
            for x, y in points[u == least].tolist()
        ),
        text(left + wide / 2.0, high + foot + 12.0, axes, f'text-anchor="middle" fill="{INK}"'),
    ]
    return sheet((left + wide + 24.0, high + foot + 22.0), title, parts, letters=12.0, white=False)


_TRAVELLING = (
    "The limit of a load of 1 kN in each place, so that multipliers are in kN; the curve is what is proved to stand."
    " The page shows the mechanism of the least of them."
)


def _proof(result: LimitResult, certificate_file: str | None, model_file: str | None) -> str:
    if result.certificate is None:
        return "<p>There is no certificate: neither bound is proved.</p>"
    name, write = written_first("limit {model} ...", certificate_file, model_file)
    return (
        f"{write}<p>Both bounds stand in one certificate (limit-bounds). Check it with</p>"
        f"<pre>cyclopean verify {name}</pre><p>It is exact: at the lower multiplier every force is inside its friction"
        " cone and all blocks balance; from the upper one on, forces below a million times weight and loads cannot hold"
        " the mechanism, for the contacts listed and with the dilatancy of associated flow.</p>"
        f"{proof_here(result.certificate, result.assembly.name)}"
    )


def _provenance(result: LimitResult) -> str:
    tried = result.provenance.get("tried", [])
    rows = [(escape(str(t["solver"])), escape(str(t["word"])), str(t["factorisations"])) for t in tried]
    times = ", ".join(f"{name} {value:.3g} s" for name, value in result.seconds.items())
    return table(["Solver", "Answer", ">Factorisations"], rows) + f"<p>{times}</p>"
