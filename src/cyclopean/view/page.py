"""The report: one HTML page that holds everything it shows and asks no network for anything."""

from html import escape

from cyclopean.analysis import Result
from cyclopean.analysis.answers import answer
from cyclopean.view import markup, tables
from cyclopean.view.colours import FORCE, GRAVITY, PULL, THRUST, WEAK
from cyclopean.view.coupling import coupled, known_all_the_same, near, refuted, tension
from cyclopean.view.drawing import Picture, picture, settled
from cyclopean.view.elevation import elevation_svg
from cyclopean.view.figures import force_text
from cyclopean.view.proof_here import proof_here
from cyclopean.view.proofs import proves, proves_not
from cyclopean.view.sensitivity_chart import sensitivity_section
from cyclopean.view.svg import rect

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
    certificate_file, model_file : str, optional
        Names of these files, for the commands that the page tells.

    Returns
    -------
    str
        HTML that opens from a file, off line. The 3D scene needs WebGL; an elevation takes its place in print.
    """
    drawn, rest = picture(result), settled(result)
    said = "The stones at the last state of rest, over where they stood."
    place = "" if rest is None else markup.figure(elevation_svg(rest, "Where they come to rest"), said)
    body = (
        _head(result, model_file),
        known_all_the_same(result),
        markup.section("How it moves" if drawn.motion else "The model", _pictures(result, drawn)),
        coupled(result, drawn),
        refuted(result),
        near(result),
        markup.section("What was assumed", tables.assumptions(result), _ASSUMED if result.assumed else ""),
        markup.section("After the settlement", tables.settlement_table(result), _SETTLED),
        markup.section("Blocks that move most", tables.movement_table(result, drawn.motion)),
        markup.section("Most used contacts", tables.contacts_table(result), _CONTACTS),
        "" if result.path is None else tables.subsidence_section(result.path, result, place),
        "" if result.margins is None else tables.margins_section(result.margins, result),
        "" if result.sensitivity is None else sensitivity_section(result.sensitivity),
        markup.section("Tension it would need", tension(result)),
        markup.section("Warnings", markup.listed(result.warnings)),
        markup.section("How to verify it", _proof(result, certificate_file, model_file)),
        markup.section("How exact the answer is", tables.residuals_table(result), _EXACT),
        markup.section("How it was computed", tables.provenance_table(result)),
    )
    return markup.document(f"{result.assembly.name}: {result.verdict}", body, word=result.verdict, may=markup.POLICY)


_ASSUMED = "Neither the model nor the command said what is marked as assumed. Check it before you rely on the verdict."
_SETTLED = (
    "What opens, and where it stays shut: hinges. It holds for settlements that are small against the blocks; openings"
    " grow with the settlement."
)
_EXACT = "Recomputed from the model after the solver was done, and relative, so that units and size do not matter."


def _head(result: Result, model_file: str | None) -> str:
    n, held, (word, said) = len(result.assembly), int(result.fixed.sum()), answer(result)
    figures = [("blocks", n), ("of them free", n - held), ("contacts", len(result.contacts))]
    figures.append(("contact points", len(result.contacts.point)))
    return markup.headline(
        result.assembly.name,
        figures,
        _METHOD.get(result.method, result.method),
        answer=(word, said if said.startswith(result.reason) or result.undecided else f"{said} {result.reason}"),
        more=_pulling(result) + (f'<p class="soft">{escape(result.drawing)}.</p>' if result.drawing else ""),
        model_file=model_file,
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
    notes = "".join(f" {escape(note)}" for note in drawn.notes)
    layers = f"{markup.DRAG}{_INSIDE if len(drawn.arrow) else ''}{_POINTS if len(drawn.press) else ''}"
    caption = _caption(result, drawn) + notes
    return _legend(drawn) + markup.model_figures(drawn, result.assembly.name, caption, layers=layers)


_INSIDE = " Forces lie inside the stones: switch those off to see them, or the utilisation on."
_POINTS = " Dots are points that press, the thin arrows at them their friction."


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
    if len(drawn.blamed):
        return "Numbers are those of the stones above."
    return "" if drawn.notes else "There are no forces and no motion to show."


def _legend(drawn: Picture) -> str:
    thrust = f'<path d="M1 8H31" stroke="{THRUST}" stroke-width="3.5"/>'
    longest = f"contact force, the longest is {force_text(drawn.largest)}"
    return markup.legend(
        [
            markup.switch(drawn.quantity),
            markup.key(markup.SUPPORTED, "support"),
            markup.key(rect(0.0, 0.0, 32.0, 16.0, f'fill="{WEAK}"'), "where the search ends")
            if len(drawn.blamed)
            else "",
            markup.key(markup.arrow(FORCE), longest) if len(drawn.arrow) else "",
            markup.key(thrust, "line of thrust: centres of pressure, joint by joint") if len(drawn.thrust) else "",
            markup.key(markup.DASHED, "where it stands") if len(drawn.ghost) else "",
            markup.key(f'<circle cx="16" cy="8" r="6" fill="{PULL}"/>', "would have to pull")
            if len(drawn.pull)
            else "",
            markup.key(markup.arrow(GRAVITY), "gravity"),
        ]
    )


_CONTACTS = (
    "Utilisation is the friction a contact carries over the friction it could carry under the same compression, for"
    " the contact as a whole. It says nothing about how close a contact is to opening at an edge."
)


def _proof(result: Result, certificate_file: str | None, model_file: str | None) -> str:
    if result.certificate is None:
        lead = "<p>There is no certificate: it is proved neither that this model stands nor that it falls.</p>"
        return lead if result.verdict == "undecided" else ""
    name, write = markup.written_first("check {model}", certificate_file, model_file)
    kind = escape(str(result.certificate.get("kind", "")))
    does, does_not = ("".join(f"<li>{line}</li>" for line in lines) for lines in (proves(result), proves_not(result)))
    return (
        f"{write}<p>The verdict carries a certificate ({kind}). Check it with</p>"
        f"<pre>cyclopean verify {name}</pre><p>The checker also runs alone. It uses exact arithmetic and"
        f" Python's standard library, and shares no code with the solvers:</p>"
        f"<pre>python -m cyclopean.proof {name}</pre>{proof_here(result.certificate, result.assembly.name)}"
        f'<div class="proof"><div><h3>What it proves</h3><ul>{does}</ul></div>'
        f"<div><h3>What it does not</h3><ul>{does_not}</ul></div></div>"
    )
