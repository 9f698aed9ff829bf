"""The path of a settlement that is not small, for the page."""

from html import escape

from cyclopean.analysis import Result, Subsidence, SubsidenceStep
from cyclopean.view.figures import number
from cyclopean.view.markup import section

__all__ = ["subsidence_section"]

_LEAD = (
    "The supports move on in steps, as rigid bodies; the blocks follow so that the loads lose most while nothing closes"
    " that is shut, and a state of rest is looked for on the geometry as it has become. Forces, openings and pictures"
    " above are those of its beginning. Of the states on the way only the last one of rest is proved, if it is."
)


def subsidence_section(found: Subsidence, result: Result) -> str:
    """The table of its steps as a part of the page."""
    head = "".join(
        f'<th scope="col">{name}</th>'
        for name in ("share", "settlement", "found", "widest joint", "", "points that touch")
    )
    rows = "".join(_row(step, found, result) for step in found.steps)
    content = f"<p>{escape(found.ended)}</p><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
    return section("As the settlement goes on", content, _LEAD)


def _row(step: SubsidenceStep, found: Subsidence, result: Result) -> str:
    joint = ""
    if step.joint >= 0:
        ids = [block.id for block in result.assembly.blocks]
        joint = f"{ids[int(found.contacts.a[step.joint])]} – {ids[int(found.contacts.b[step.joint])]}"
    cells = (
        f"{100 * step.share:.4g} %",
        f"{number(step.settlement)} m",
        step.word,
        f"{number(step.opening)} m",
        joint,
        str(step.touching),
    )
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
