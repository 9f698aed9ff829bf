"""One sentence for what limit analysis found."""

from collections.abc import Sequence

from cyclopean.analysis.answers import amount, none_to_spare
from cyclopean.analysis.limit_analysis.joints import MovingJoint
from cyclopean.analysis.limit_analysis.live_load import Live
from cyclopean.analysis.limit_analysis.solving import LimitOutcome

__all__ = ["of_real_friction", "reason_for_limit"]

DIGITS = 6  # of both bounds: they are a millionth apart


def reason_for_limit(
    live: Live, outcome: LimitOutcome, lower: float | None, upper: float | None, window: tuple[float, float] | None
) -> str:
    """Say what was proved.

    Parameters
    ----------
    live : Live
        What grows.
    outcome : LimitOutcome
        What the solvers found.
    lower, upper : float or None
        What was proved.
    window : (least, largest), optional
        Where it stands, if not without live loads.
    """
    if outcome.word == "falls":
        if window is not None:
            ends = f"multipliers between {window[0]:.6g} and {window[1]:.6g}"
            return f"It does not stand without live loads, but does at {ends}: these live loads hold it up."
        more = ", and no amount of these live loads holds it up" if outcome.upper <= 0.0 else ""
        return f"It does not stand even without live loads{more}."
    if outcome.word == "unbounded":
        return "No such live loads bring it down, however large: there are forces in balance with them alone (proved)."
    if lower is not None and upper is not None and outcome.word == "limit":
        low, high = (amount(live, one, up, DIGITS)[0] for one, up in ((lower, False), (upper, True)))
        stands = "as it is" if none_to_spare(live, upper) else f"up to {low}"
        return f"It stands {stands}, and falls at the latest from {high} on; both are proved."
    parts = []
    if lower is not None:
        parts.append(f"it stands at {_said(live, lower, up=False)}")
    if upper is not None:
        parts.append(f"a mechanism exists from {_said(live, upper, up=True)} on")
    why = "Time ran out before the limit was closed in on" if outcome.late else "The limit was not closed in on"
    return f"{why}: {', and '.join(parts) or 'neither bound was proved'}."


def of_real_friction(joints: Sequence[MovingJoint]) -> str:
    """What joints that move in the mechanism mean for friction without dilatancy."""
    if any(joint.kind == "slide" for joint in joints):
        return "Joints slide in the mechanism, and open as they do: with friction that does not, it may bear less."
    return "No joint slides in the mechanism."


def _said(live: Live, multiplier: float, up: bool) -> str:
    return " ".join(amount(live, multiplier, up, DIGITS))
