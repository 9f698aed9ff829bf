"""The path of a settlement that is not small, for the page."""

from html import escape

from cyclopean.analysis import Result, Subsidence, SubsidenceStep
from cyclopean.view.figures import number
from cyclopean.view.markup import section, table
from cyclopean.view.tables import joint_name

__all__ = ["subsidence_section"]

_LEAD = (
    "The supports move on in steps, as rigid bodies; the blocks follow so that the loads lose most while nothing closes"
    " that is shut, and a state of rest is looked for on the geometry as it has become. Forces, openings and pictures"
    " above are those of its beginning. Of the states on the way only the last one of rest is proved, if it is."
)


def subsidence_section(found: Subsidence, result: Result) -> str:
    """The table of its steps as a part of the page."""
    names = ("share", "settlement", "found", "widest joint", "", "points that touch")
    rows = table([(name, "") for name in names], (_row(step, found, result) for step in found.steps))
    return section("As the settlement goes on", f"<p>{escape(found.ended)}</p>{rows}", _LEAD)


def _row(step: SubsidenceStep, found: Subsidence, result: Result) -> tuple[str, ...]:
    return (
        f"{100 * step.share:.4g} %",
        f"{number(step.settlement)} m",
        escape(step.word),
        f"{number(step.opening)} m",
        joint_name(result, step.joint, found.contacts) if step.joint >= 0 else "",
        str(step.touching),
    )
