"""What a model has to spare, for the page."""

from cyclopean.analysis import Margins, Result
from cyclopean.analysis.safety_margins import Bracket
from cyclopean.view.figures import number
from cyclopean.view.markup import section, table
from cyclopean.view.tables import joint_name

__all__ = ["margins_section"]

_LEAD = (
    "By rigid-block equilibrium, the others unchanged: how far each may go before no forces keep balance any more. Both"
    " sides of each are proved by certificates. Where stones slide without opening, or by coupled analysis, less may be"
    " left."
)


def margins_section(found: Margins, result: Result) -> str:
    """What, how much, and which joint governs."""
    content = table([("", ""), ("", ""), ("moves most when it falls", "")], _rows(found, result))
    return section("What it has to spare", content, _LEAD)


def _rows(found: Margins, result: Result) -> list[tuple[str, str, str]]:
    rows = []
    mu = result.contacts.mu
    if found.friction is not None:
        if found.friction.stands == 0.0:
            much = "needs none"
        else:
            one = len(mu) > 0 and float(mu.min()) == float(mu.max())
            value = f"μ {number(found.friction.stands * float(mu[0]))}, " if one else ""
            much = f"{value}{100 * found.friction.stands:.1f} % of what there is"
        rows.append(("Least friction", much, _joint(found.friction, result)))
    if found.joints is not None:
        if found.joints.falls is None:
            much = f"to less than {100 * found.joints.stands:g} % of their size"
        else:
            much = f"to {100 * found.joints.stands:.1f} % of their size: geometric safety {found.geometric_safety:.2f}"
        rows.append(("Joints may shrink", much, _joint(found.joints, result)))
    if found.tilt is not None:
        much = f"{found.tilt.stands:.2f}° towards azimuth {found.azimuth:g}°, the worst of eight"
        rows.append(("The ground may tilt by", much, _joint(found.tilt, result)))
    return rows


def _joint(bracket: Bracket, result: Result) -> str:
    return "" if bracket.governing is None else joint_name(result, bracket.governing)
