"""The report: one HTML page that holds everything it shows and asks no network for anything."""

import shlex
from html import escape

from cyclopean.analysis import Result
from cyclopean.view.colours import FORCE, GRAVITY, HATCH, PULL, SCALE, SUPPORT, THRUST
from cyclopean.view.coupling import coupled, near, refuted, tension
from cyclopean.view.drawing import Picture, picture, without_points
from cyclopean.view.elevation import elevation_svg
from cyclopean.view.figures import number, unit_of
from cyclopean.view.margins_table import margins_section
from cyclopean.view.markup import DASHED, arrow, click_note, counts, document, key, section
from cyclopean.view.proofs import proves, proves_not
from cyclopean.view.scene import scene_html
from cyclopean.view.sensitivity_chart import sensitivity_section
from cyclopean.view.subsidence_table import subsidence_section
from cyclopean.view.tables import (
    assumptions,
    contacts_table,
    movement_table,
    provenance_table,
    residuals_table,
    settlement_table,
)

__all__ = ["POLICY", "report_html"]

# The browser itself is told to load nothing from anywhere; the scene in the frame inherits this. Viser's client unpacks
# itself with blob and data addresses, which never leave the machine.
POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline' 'unsafe-eval' blob: data:;"
    " worker-src blob: data:; connect-src blob: data:; img-src blob: data:; font-src data:;"
    " base-uri 'none'; form-action 'none'"
)

# Our only script: without WebGL the frame is hidden, and the elevation stands alone.
_FLAT = (
    "<script>try{if(!document.createElement('canvas').getContext('webgl2'))throw 0}"
    "catch(e){document.documentElement.className+=' flat'}</script>"
)

_METHOD = {
    "rbe": "rigid-block equilibrium (RBE)",
    "cra": "coupled rigid-block analysis (CRA)",
}


def report_html(
    result: Result,
    *,
    certificate_file: str | None = None,
    model_file: str | None = None,
) -> str:
    """Write the report of a result as one self-contained HTML page.

    Parameters
    ----------
    result : Result
        What `check` answered; results without forces, mechanism or certificate are shown as far as they go.
    certificate_file : str, optional
        Name of the certificate's file, for the command that verifies it.
    model_file : str, optional
        Name of the model's file.

    Returns
    -------
    str
        HTML that opens from a file, off line. The 3D scene needs WebGL; an elevation takes its place in print.
    """
    drawn = picture(result)
    body = (
        _head(result, model_file),
        _pictures(result, drawn),
        coupled(result, drawn),
        refuted(result),
        near(result),
        section("What was assumed", assumptions(result), _ASSUMED if result.assumed else ""),
        section("After the settlement", settlement_table(result), _SETTLED),
        _movement(result, drawn),
        _contacts(result),
        "" if result.path is None else subsidence_section(result.path, result),
        "" if (spare := result.margins) is None else margins_section(spare, result),
        "" if result.sensitivity is None else sensitivity_section(result.sensitivity),
        section("Tension it would need", tension(result)),
        section("Warnings", _list(result.warnings)),
        _proof(result, certificate_file, model_file),
        section("How exact the answer is", residuals_table(result), _EXACT),
        section("How it was computed", provenance_table(result)),
    )
    head = f"<noscript><style>.scene{{display:none}}</style></noscript>{_FLAT}"
    title = f"{result.assembly.name}: {result.verdict}"
    return document(title, body, word=result.verdict, head=head, may=POLICY)


_ASSUMED = "Neither the model nor the command said what is marked as assumed. Check it before you rely on the verdict."
_SETTLED = (
    "What opens, and where it stays shut: hinges. It holds for settlements that are small against the blocks; openings"
    " grow with the settlement."
)
_EXACT = "Recomputed from the model after the solver was done, and relative, so that units and size do not matter."


def _list(lines: tuple[str, ...]) -> str:
    return f'<ul class="warnings">{"".join(f"<li>{escape(line)}</li>" for line in lines)}</ul>' if lines else ""


def _head(result: Result, model_file: str | None) -> str:
    n, held = len(result.assembly), int(result.fixed.sum())
    figures = [("blocks", n), ("of them free", n - held), ("contacts", len(result.contacts))]
    figures.append(("contact points", len(result.contacts.point)))
    source = f' <span class="soft">({escape(model_file)})</span>' if model_file else ""
    return (
        f"<header><h1>{escape(result.assembly.name)}{source}</h1><span>cyclopean</span></header>"
        f'<div class="verdict"><strong>{result.verdict.capitalize()}</strong><p>{escape(result.reason)}</p>'
        f"{_pulling(result)}</div>"
        + counts([(name, f"{count:,}") for name, count in figures], _METHOD.get(result.method, result.method))
    )


def _pulling(result: Result) -> str:
    """A warning in red where joints pull: such a verdict is not one on dry stone."""
    if not result.strength > 0.0:
        return ""
    count = int((result.contacts.strength > 0.0).sum())
    return (
        f'<p class="pulling">This verdict counts on joints that pull: {count:,} of {len(result.contacts):,} contacts,'
        f" up to {result.strength:,.6g} Pa. Dry joints do not.</p>"
    )


def _pictures(result: Result, drawn: Picture) -> str:
    if not len(drawn.mesh.vertex):
        return ""
    scene = escape(scene_html(drawn), quote=True)
    flat = elevation_svg(without_points(drawn), f"Elevation of {result.assembly.name}")
    caption = f"Elevation. {_caption(result, drawn)}{click_note(drawn)}{_notes(drawn)}"
    name = escape(f"{result.assembly.name}, {result.verdict}")
    return (
        f"<section><h2>{'How it moves' if drawn.motion else 'The model'}</h2>{_legend(drawn)}"
        f'<figure class="scene"><iframe title="3D scene: {name}" srcdoc="{scene}"></iframe>'
        "<figcaption>Drag to turn, scroll to zoom, right-drag to move. The button at the top right of the scene lists "
        f"its layers.{_PALE if len(drawn.arrow) else ''}{_POINTS if len(drawn.press) else ''}</figcaption></figure>"
        f'<figure class="elevation">{flat}<figcaption>{caption}</figcaption></figure></section>'
    )


_PALE = " Blocks are drawn see-through for the forces inside them, hence paler than the scale; the elevation is exact."

_POINTS = " Dots are points that press, the thin arrows at them their friction."


def _notes(drawn: Picture) -> str:
    return "".join(f" {escape(note)}" for note in drawn.notes)


def _caption(result: Result, drawn: Picture) -> str:
    if drawn.quantity == "movement":
        return (
            "The mechanism is a direction of motion and has no size of its own: it is drawn so that the largest"
            " movement is a quarter of a mean block. Each block is turned and shifted as the rigid body it is;"
            " lines show where it stands."
        )
    if len(drawn.arrow):
        return (
            "Arrows are the resultants of the contacts, drawn through their centres of pressure in the direction in"
            " which the load passes on. They are one set of forces that keeps balance; in a structure that is"
            " statically indeterminate there are others."
        )
    if len(drawn.pull):
        return "Dots are points where joints would have to pull; the larger, the more."
    if result.certificate is not None and "tree" in result.certificate:
        return "There are no forces and no motion to show: what is proved is that none go together."
    return "" if drawn.notes else "There are no forces and no motion to show."


def _legend(drawn: Picture) -> str:
    parts = []
    if drawn.quantity != "nothing":
        title, low, high = _SCALES[drawn.quantity]
        steps = "".join(f'<li style="background:{colour}"></li>' for colour in SCALE)
        parts.append(
            f'<div class="ramp"><b>{title}</b><ol aria-hidden="true">{steps}</ol>'
            f"<span><i>{low}</i><i>0.5</i><i>{high}</i></span></div>"
        )
    box = f'<rect width="32" height="16" fill="{SUPPORT}"/><path d="M2 18 18 0M12 18 28 0M22 18 38 0" stroke="{HATCH}"'
    parts.append(key(f'{box} stroke-width="3"/>', "support"))
    if len(drawn.arrow):
        divisor, unit = unit_of(drawn.largest)
        text = f"contact force, the longest is {number(drawn.largest / divisor)} {unit}"
        parts.append(key(arrow(FORCE), text))
    if len(drawn.thrust):
        line = f'<path d="M1 8H31" stroke="{THRUST}" stroke-width="3.5"/>'
        parts.append(key(line, "line of thrust (elevation): where the load passes"))
    if len(drawn.ghost):
        parts.append(key(DASHED, "where it stands"))
    if len(drawn.pull):
        parts.append(key(f'<circle cx="16" cy="8" r="6" fill="{PULL}"/>', "would have to pull"))
    parts.append(key(arrow(GRAVITY), "gravity"))
    return f'<div class="legend">{"".join(parts)}</div>'


_SCALES = {
    "utilisation": ("Friction used at the worst contact of a block", "0", "1 = about to slide"),
    "movement": ("Movement of a block, largest = 1", "0", "1"),
}


def _movement(result: Result, drawn: Picture) -> str:
    if drawn.motion is None:
        return ""
    return section("Blocks that move most", movement_table(result, drawn.motion))


def _contacts(result: Result) -> str:
    lead = (
        "Utilisation is the friction a contact carries over the friction it could carry under the same compression, for"
        " the contact as a whole. It says nothing about how close a contact is to opening at an edge."
    )
    return section("Most used contacts", contacts_table(result), lead)


def _proof(result: Result, certificate_file: str | None, model_file: str | None) -> str:
    if result.certificate is None:
        lead = "<p>There is no certificate: it is proved neither that this model stands nor that it falls.</p>"
        return f"<section><h2>How to verify it</h2>{lead}</section>" if result.verdict == "undecided" else ""
    name = shlex.quote(certificate_file or "certificate.json")
    write = ""
    if certificate_file is None:
        model = shlex.quote(model_file or "MODEL")
        write = f"<p>Write the certificate first:</p><pre>cyclopean check {escape(model)} --certificate {name}</pre>"
    kind = escape(str(result.certificate.get("kind", "")))
    return (
        f"<section><h2>How to verify it</h2>{write}<p>The verdict carries a certificate ({kind}). Check it with</p>"
        f"<pre>cyclopean verify {escape(name)}</pre><p>The checker also runs alone. It uses exact arithmetic and"
        f" Python's standard library, and shares no code with the solvers:</p>"
        f"<pre>python -m cyclopean.proof {escape(name)}</pre>"
        f'<div class="proof"><div><h3>What it proves</h3><ul>{_items(proves(result))}</ul></div>'
        f"<div><h3>What it does not</h3><ul>{_items(proves_not(result))}</ul></div></div></section>"
    )


def _items(lines: list[str]) -> str:
    return "".join(f"<li>{line}</li>" for line in lines)
