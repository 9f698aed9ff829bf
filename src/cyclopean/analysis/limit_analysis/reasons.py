"""One sentence for what limit analysis found."""

import numpy as np

from cyclopean.analysis.limit_analysis.live_load import Live
from cyclopean.analysis.limit_analysis.solving import LimitOutcome

__all__ = ["reason_for_limit"]

_FLOW = "sliding with the dilatancy that rigid-block equilibrium assumes, which for real friction may be too high"


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
        low, high = _said(live, lower), _said(live, upper)
        beyond = "beyond that" if low == high else f"from {high} on"
        return f"It stands up to {low}; {beyond} a mechanism exists ({_FLOW})."
    parts = []
    if lower is not None:
        parts.append(f"it stands at {_said(live, lower)}")
    if upper is not None:
        parts.append(f"a mechanism exists from {_said(live, upper)} on")
    why = "Time ran out before the limit was closed in on" if outcome.late else "The limit was not closed in on"
    return f"{why}: {', and '.join(parts) or 'neither bound was proved'}."


def _said(live: Live, multiplier: float | None) -> str:
    if multiplier is None:
        return "a multiplier that could not be proved"
    if live.kind == "tilt":
        return f"{np.rad2deg(np.arctan(multiplier)):.6g} degrees"
    return f"{multiplier:.7g} times {live.words or ('the push' if live.kind == 'push' else 'the live loads')}"
