"""The page of limit analysis: both bounds, the mechanism in motion, the joints that move, and the curves."""

import shlex
from collections.abc import Sequence
from html import escape

import numpy as np

from cyclopean.analysis import CoupledBracket, LimitResult, Polar, Pushover, Result, moving_joints
from cyclopean.view.colours import ACCENT
from cyclopean.view.drawing import picture, without_points
from cyclopean.view.elevation import elevation_svg
from cyclopean.view.markup import click_note, counts, document, section
from cyclopean.view.page import POLICY
from cyclopean.view.scene import scene_html

__all__ = ["limit_html", "polar_svg", "pushover_svg"]

INK, SOFT, LINE = "#23211d", "#5b5750", "#dedbd3"
MOST = 40  # joints listed
WORDS = {"limit": "Limit", "unbounded": "No limit", "falls": "Falls", "undecided": "Undecided"}
TONES = {"limit": "stable", "unbounded": "stable", "falls": "unstable", "undecided": "undecided"}
KINDS = {"hinge": "opens about a hinge", "slide": "slides", "part": "parts"}


def limit_html(
    result: LimitResult,
    *,
    certificate_file: str | None = None,
    model_file: str | None = None,
) -> str:
    """Write the page as one self-contained HTML document.

    Parameters
    ----------
    result : LimitResult
        Both bounds.
    certificate_file, model_file : str, optional
        Names of these files.
    """
    polar, pushover = result.polar, result.pushover
    body = (
        _head(result, model_file),
        section("The bounds", _bounds(result), _MEANING[result.live.kind]),
        _pictures(result),
        section("Joints that move", _joints(result), _JOINTS),
        section("Without dilatancy", _coupled(result.coupled), _COUPLED),
        section("Tilt in every direction", "" if polar is None else _figure(polar_svg(polar), _polar_caption(polar))),
        section("As it goes on", "" if pushover is None else _pushover(pushover), _PUSHOVER),
        section("Warnings", "".join(f"<p>{escape(line)}</p>" for line in result.warnings)),
        section("How to verify it", _proof(result, certificate_file, model_file)),
        section("How it was computed", _provenance(result)),
    )
    title = f"{result.assembly.name}: {WORDS[result.word].lower()}"
    return document(title, body, word=TONES[result.word], may=POLICY)


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
    " does not certify need not fall."
)
_PUSHOVER = (
    "At each step the limit is found anew on the displaced geometry. Joints that have opened bear nothing; points that"
    " press stay in touch. These values are bounds of the solver, closed to a millionth, without certificates."
)


def _head(result: LimitResult, model_file: str | None) -> str:
    n, held = len(result.assembly), int(result.fixed.sum())
    figures = [("blocks", n), ("of them free", n - held), ("contacts", len(result.contacts))]
    source = f' <span class="soft">({escape(model_file)})</span>' if model_file else ""
    return (
        f"<header><h1>{escape(result.assembly.name)}{source}</h1><span>cyclopean</span></header>"
        f'<div class="verdict"><strong>{_answer(result)}</strong><p>{escape(result.reason)}</p></div>'
        + counts([(name, f"{count:,}") for name, count in figures], "rigid-block limit analysis")
    )


def _answer(result: LimitResult) -> str:
    if result.word != "limit":
        return WORDS[result.word]
    if result.angle is not None and result.angle[0] is not None:
        return f"{result.angle[0]:.5g}°"
    return f"{result.value:.5g}"


def _bounds(result: LimitResult) -> str:
    rows = [("stands, proved, at", _number(result.lower)), ("falls, proved, from", _number(result.upper))]
    if np.isfinite(result.gap):
        rows.append(("apart by", f"{result.gap:.1e} of it"))
    if result.angle is not None:
        low, high = result.angle
        rows += [("angle, stands at", _degrees(low)), ("angle, falls from", _degrees(high))]
    if result.window is not None:
        rows.append(("stands only between", f"{result.window[0]:.8g} and {result.window[1]:.8g}"))
    if result.assumed:
        rows += [(f"{name} (assumed)", escape(str(value))) for name, value in result.assumed.items()]
    return _table(rows)


def _number(value: float | None) -> str:
    return "not proved" if value is None else f"{value:.10g}"


def _degrees(value: float | None) -> str:
    return "not proved" if value is None else f"{value:.8g}°"


def _table(rows: Sequence[tuple[str, ...]], head: Sequence[str] = ()) -> str:
    top = f"<thead><tr>{''.join(f'<th>{cell}</th>' for cell in head)}</tr></thead>" if head else ""
    lines = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table>{top}<tbody>{lines}</tbody></table>" if rows else ""


def _shown(result: LimitResult) -> Result:
    """What the pictures of a check draw: the mechanism where there is one, else the forces."""
    moves = result.mechanism is not None
    return Result(
        assembly=result.assembly,
        contacts=result.contacts,
        fixed=result.fixed,
        method=result.method,
        verdict="unstable" if moves else "stable",
        reason=result.reason,
        assumed=result.assumed,
        gravity=result.gravity,
        residuals={},
        force=None if moves else result.force,
        frame=result.frame,
        utilisation=None if moves else result.utilisation,
        mechanism=result.mechanism,
    )


def _pictures(result: LimitResult) -> str:
    drawn = picture(_shown(result))
    scene = escape(scene_html(drawn), quote=True)
    name = escape(result.assembly.name)
    flat = elevation_svg(without_points(drawn), f"Elevation of {result.assembly.name}")
    moves = drawn.motion is not None
    told = (
        "The mechanism at the upper bound, drawn so that the largest movement is a quarter of a mean block."
        if moves
        else "Forces at the lower bound."
    )
    return (
        f"<section><h2>{'How it moves' if moves else 'The model'}</h2>"
        f'<figure class="scene"><iframe title="3D scene: {name}" srcdoc="{scene}"></iframe>'
        "<figcaption>Drag to turn, scroll to zoom, right-drag to move.</figcaption></figure>"
        f'<figure class="elevation">{flat}<figcaption>Elevation. {told}{click_note(drawn)}</figcaption></figure>'
        "</section>"
    )


def _joints(result: LimitResult) -> str:
    blocks, contacts = result.assembly.blocks, result.contacts
    joints = moving_joints(result)
    rows = [
        (
            escape(blocks[contacts.a[joint.contact]].id),
            escape(blocks[contacts.b[joint.contact]].id),
            KINDS[joint.kind],
            f"{joint.speed:.3f}",
            ", ".join(f"{x:.3f}" for x in joint.point),
        )
        for joint in joints[:MOST]
    ]
    more = f"<p>And {len(joints) - MOST:,} more.</p>" if len(joints) > MOST else ""
    return _table(rows, ("block", "and block", "how", "speed", "about (m)")) + more if rows else ""


def _coupled(coupled: CoupledBracket | None) -> str:
    if coupled is None:
        return ""
    stands = "none" if coupled.stands is None else f"{coupled.stands:.6g}"
    rows = [("largest multiplier certified", stands)]
    if coupled.not_yet is not None:
        rows.append((f"least that is not ({coupled.word})", f"{coupled.not_yet:.6g}"))
    return _table(rows) + _table([(f"{t:.6g}", word) for t, word in coupled.trials], ("tried", "verdict"))


def _figure(drawing: str, caption: str) -> str:
    return f"<figure>{drawing}<figcaption>{caption}</figcaption></figure>"


def _polar_caption(polar: Polar) -> str:
    angle = polar.least.angle
    if angle is None or angle[0] is None:
        return f"{len(polar.results)} azimuths."
    return (
        f"{len(polar.results)} azimuths; the least of them is {angle[0]:.4g}° towards {polar.least.live.tilt:g}°"
        " (between two of them it may be less). From +x to the right, counter-clockwise to +y."
    )


def polar_svg(polar: Polar) -> str:
    """Draw the tilt that is proved to stand, by azimuth, on circles of equal angle."""
    table = [(az, 90.0 if low is not None and high is None else low or 0.0) for az, low, high in polar.table]
    top = max((value for _, value in table), default=1.0) or 1.0
    ring = next(step for step in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0) if top / step <= 5.0 or step == 30.0)
    rings = np.arange(ring, top * 1.001 + ring, ring)
    reach = 190.0 / float(rings[-1])
    parts = []
    for value in rings:
        parts.append(f'<circle r="{value * reach:.1f}" fill="none" stroke="{LINE}"/>')
        parts.append(f'<text x="4" y="{-value * reach - 3:.1f}" fill="{SOFT}" font-size="11">{value:g}°</text>')
    parts.append(f'<path d="M-200 0H200M0 -200V200" stroke="{LINE}"/>')
    points = [(value * reach * np.cos(np.deg2rad(az)), -value * reach * np.sin(np.deg2rad(az))) for az, value in table]
    outline = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    parts.append(f'<path d="M{outline}Z" fill="{ACCENT["stable"]}" fill-opacity=".18" stroke="{ACCENT["stable"]}"/>')
    for (x, y), (az, value) in zip(points, table, strict=True):
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{ACCENT["stable"]}">'
            f"<title>{az:g}°: {value:.4g}°</title></circle>"
        )
    for x, y, anchor, name in ((204, 4, "start", "+x"), (-204, 4, "end", "−x"), (0, -206, "middle", "+y")):
        parts.append(f'<text x="{x}" y="{y}" text-anchor="{anchor}" fill="{INK}" font-size="13">{name}</text>')
    return (
        '<svg viewBox="-240 -230 480 450" role="img" aria-label="Tilt by azimuth" xmlns="http://www.w3.org/2000/svg"'
        f' font-family="system-ui,sans-serif" style="max-width:34rem">{"".join(parts)}</svg>'
    )


def _pushover(pushover: Pushover) -> str:
    caption = f"Control block '{escape(pushover.control)}'. It ends where {escape(pushover.ended)}."
    rows = [
        (f"{s.displacement:.5g}", f"{s.rotation:.4g}", f"{s.multiplier:.6g}", f"{s.touching:,}") for s in pushover.steps
    ]
    table = _table(rows, ("displacement (m)", "rotation (°)", "multiplier", "points in touch"))
    return _figure(pushover_svg(pushover), caption) + table


def pushover_svg(pushover: Pushover) -> str:
    """Draw the multiplier over the displacement of the control block."""
    u = np.array([step.displacement for step in pushover.steps])
    t = np.array([step.multiplier for step in pushover.steps])
    wide, high, left, foot = 560.0, 260.0, 60.0, 36.0
    right, top = float(u.max()) or 1.0, float(max(t.max(), 0.0)) or 1.0
    low = float(min(t.min(), 0.0))

    def place(x: float, y: float) -> tuple[float, float]:
        return left + wide * x / right, 12.0 + high * (top - y) / (top - low)

    parts = []
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        x, y = place(share * right, low + share * (top - low))
        parts.append(f'<path d="M{left:g} {y:.1f}h{wide:g}" stroke="{LINE}"/>')
        label = f"{low + share * (top - low):.3g}"
        parts.append(f'<text x="{left - 6:g}" y="{y + 4:.1f}" text-anchor="end" fill="{SOFT}">{label}</text>')
        parts.append(
            f'<text x="{x:.1f}" y="{high + 30:g}" text-anchor="middle" fill="{SOFT}">{share * right:.3g}</text>'
        )
    line = "L".join("{:.1f} {:.1f}".format(*place(x, y)) for x, y in zip(u.tolist(), t.tolist(), strict=True))
    parts.append(f'<path d="M{line}" fill="none" stroke="{ACCENT["stable"]}" stroke-width="2"/>')
    for x, y in (place(a, b) for a, b in zip(u.tolist(), t.tolist(), strict=True)):
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{ACCENT["stable"]}"/>')
    title = f'<text x="{left + wide / 2:g}" y="{high + foot + 12:g}" text-anchor="middle" fill="{INK}">'
    parts.append(f"{title}displacement of the control block (m); upright: multiplier</text>")
    return (
        f'<svg viewBox="0 0 {left + wide + 24:g} {high + foot + 22:g}" role="img" aria-label="Pushover curve"'
        ' xmlns="http://www.w3.org/2000/svg" font-family="system-ui,sans-serif" font-size="12">'
        f"{''.join(parts)}</svg>"
    )


def _proof(result: LimitResult, certificate_file: str | None, model_file: str | None) -> str:
    if result.certificate is None:
        return "<p>There is no certificate: neither bound is proved.</p>"
    name = escape(shlex.quote(certificate_file or "certificate.json"))
    write = ""
    if certificate_file is None:
        model = escape(shlex.quote(model_file or "MODEL"))
        write = f"<p>Write the certificate first: <code>cyclopean limit {model} ... --certificate {name}</code></p>"
    return (
        f"{write}<p>Both bounds stand in one certificate (limit-bounds). Check it with</p>"
        f"<pre>cyclopean verify {name}</pre><p>It is exact: at the lower multiplier every force is inside its friction"
        " cone and all blocks balance; from the upper one on, forces below a million times weight and loads cannot hold"
        " the mechanism, for the contacts listed and with the dilatancy of associated flow.</p>"
    )


def _provenance(result: LimitResult) -> str:
    tried = result.provenance.get("tried", [])
    rows = [(escape(str(t["solver"])), escape(str(t["word"])), str(t["factorisations"])) for t in tried]
    times = ", ".join(f"{name} {value:.3g} s" for name, value in result.seconds.items())
    return _table(rows, ("solver", "answer", "factorisations")) + f"<p>{times}</p>"
