"""Sections of the report that only coupled analysis has, and where joints would have to pull."""

from typing import Any

import numpy as np

from cyclopean.analysis import Result
from cyclopean.view.colours import FORCE, RUB
from cyclopean.view.drawing import Picture, displaced
from cyclopean.view.elevation import elevation_svg
from cyclopean.view.figures import cases, force_text, needed_tension, number, pressing
from cyclopean.view.markup import DASHED, arrow, click_note, figure, key, legend, section, told
from cyclopean.view.tables import cases_table, tension_table

NEAR = "merit"  # the residual that only an undecided coupled analysis has


def coupled(result: Result, drawn: Picture) -> str:
    """The virtual displacement of a coupled state, with what it presses and rubs."""
    moved, found = displaced(drawn), pressing(result)
    if moved is None or found is None:
        return ""
    lead = (
        f"A virtual displacement of the blocks brings the forces about: {len(found.point):,} of"
        f" {len(result.contacts.point):,} contact points overlap and press, {len(found.rubbing):,} of them rub against"
        f" the way in which they slide{_within(result)}. Nobody would see it move so: the displacement says how the"
        " forces hang together, and has no size of its own."
    )
    keys = [key(f'<circle cx="16" cy="8" r="4.5" fill="{FORCE}"/>', "presses")]
    if len(drawn.rub):
        keys.append(key(arrow(RUB), f"friction on the upper block, the longest is {force_text(drawn.rubbing)}"))
    keys.append(key(DASHED, "where it stands"))
    caption = (
        "Elevation of the virtual displacement, drawn so that the largest movement is a quarter of a mean block; where"
        f" blocks run into each other, they press. In the 3D scene it is a layer, hidden at first.{click_note(moved)}"
    )
    drawing = elevation_svg(moved, f"Virtual displacement of {result.assembly.name}")
    return section("How it presses and rubs", legend(keys) + figure(drawing, caption, "elevation"), lead)


def _within(result: Result) -> str:
    """The bounds of the virtual displacement, in words."""
    said: dict[str, Any] = (result.certificate or {}) | dict(result.provenance.get("settings", {}))
    if not {"eps", "eta", "beta_min"} <= said.keys():
        return ""
    eta, beta = (number(float(said[name]) / float(said["eps"])) for name in ("eta", "beta_min"))
    return f" (bounds: eta = {eta} eps, beta_min = {beta} eps)"


def refuted(result: Result) -> str:
    """Say in words what a closed tree proves."""
    if result.certificate is None or "tree" not in result.certificate:
        return ""
    tree = result.certificate["tree"]
    found = cases(tree)
    count = found["forces"] + found["motion"] + found["work"]
    lead = (
        f"{_accepted(result)}Nothing brings the forces about that would balance the loads. Whatever the blocks do, each"
        " contact point either presses or is unloaded, and slides in some direction. All of this was divided into"
        f" {count:,}"
        f" case{'' if count == 1 else 's'} ({found['depth']:,} decisions deep at most), which leave nothing out, and"
        f" each was proved impossible{_within(result)}. Other bounds may have another answer."
    )
    return section("What was proved", cases_table(tree), lead)


def _accepted(result: Result) -> str:
    """Say that equilibrium alone has forces for the model, if that came out on the way."""
    tried = result.provenance.get("tried", ())
    if any(one.get("route") == "RBE" and one.get("word") == "balanced" for one in tried):
        return (
            "Rigid-block equilibrium accepts this model: there are forces that press, stay within friction and balance"
            " the loads. "
        )
    return ""


def known_all_the_same(result: Result) -> str:
    """What is known of a model that stays undecided: what is proved, the stones that are blamed, what to change."""
    known = result.undecided
    if known is None:
        return ""
    said: dict[str, list[str]] = {}
    for word, text in known.lines():
        said.setdefault(word, []).append(f"<li>{told(text[0].upper() + text[1:])}.</li>")
    proved = "".join(said.get("rbe", []) + said.get("at eta", []))
    parts = [f"<h3>What is proved</h3><ul>{proved}</ul>"]
    if "stone" in said:
        parts.append(f"<h3>Where the search ends</h3><ol>{''.join(said['stone'])}</ol>")
    parts.append(f"<h3>What would decide it</h3><ul>{''.join(said['change'])}</ul>")
    return section("Why it is open, and what would decide it", f'<div class="known">{"".join(parts)}</div>')


def near(result: Result) -> str:
    """Say how near a coupled analysis came that ended without a proof."""
    if result.verdict != "undecided" or NEAR not in result.residuals:
        return ""
    merit, share = result.residuals[NEAR], result.residuals.get("bound", 0.0)
    lead = (
        f"{_accepted(result)}Whether a virtual displacement can bring forces about that balance the loads is open"
        f"{_within(result)}. The best forces and displacement met do"
        f" work of {number(float(merit))} (in eps times a mean block weight) that a coupled state does not do. The"
        f" search for a refutation closed {number(100.0 * float(share))} % of the cases."
    )
    return section("How near it came", f"<p>{lead}</p>")


def tension(result: Result) -> str:
    """Say how much pull the contacts would have to bear, when the analysis was asked for it."""
    found = needed_tension(result)
    if found is None:
        return ""
    points = len(found.point)
    if not points and result.verdict == "stable":
        return "<p>None: compression and friction are enough.</p>"
    if not points:
        return (
            "<p>None that would help: the loads can be balanced without, and glue that only keeps joints from opening"
            " does not bring such forces about. The model needs other joints, such as a bearing from below.</p>"
        )
    share = f" ({number(100.0 * found.share)} % of the weight of all free blocks)" if np.isfinite(found.share) else ""
    return (
        f"<p>Dry joints cannot pull. For {_wanted(result)}, {points:,} contact"
        f" point{'' if points == 1 else 's'} would have to, with at most"
        f" {force_text(float(np.max(found.peak)))} at one point and {force_text(found.total)} in all{share}."
        f" There the model needs glue, a tie, or another joint.</p>{tension_table(result)}"
    )


def _wanted(result: Result) -> str:
    """What the tension is needed for."""
    if result.method == "cra" and result.tension_exact:
        return "a coupled state"
    return "balance" if result.method == "rbe" else "balance alone (glue makes no coupled state here)"
