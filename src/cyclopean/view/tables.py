"""Tables of the report, as HTML. Whatever comes from the model is escaped here."""

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np

from cyclopean.analysis import LimitResult, Margins, Result, Subsidence, SubsidenceStep, openings
from cyclopean.analysis.safety_margins import Bracket
from cyclopean.analysis.verdict import millimetres
from cyclopean.arrays import Floats
from cyclopean.assembly import Contacts
from cyclopean.texts import first_few
from cyclopean.view.colours import classes, fill
from cyclopean.view.figures import cases, densities, fastest, needed_tension, number, resultants, unit_of, worst
from cyclopean.view.markup import bar, section, table
from cyclopean.view.motion import Motion

ROWS = 12  # of the longer tables

Cell = str  # HTML, already escaped

_RESIDUALS = {
    "equilibrium": "forces and moments left unbalanced, on the worst block; as a share of its own weight (and size)",
    "cone": "how far the worst contact force lies outside compression and friction; as a share of its size",
    "gap": "no point overlaps by more than eps: by how much the worst one does; in eta",
    "complementarity": "what presses overlaps by eps exactly: worst product of a normal force and its distance from "
    "that; in eps times the weight of the lighter block, or times the force where that is larger",
    "alignment": "friction acts against sliding: worst deviation from that; in the same unit",
    "reach": "no point moves further than eta: by how much the worst one does; in eta",
    "sliding": "where there is friction, a point slides by at least beta_min: by how much the worst one falls short; "
    "in beta_min",
    "missed": "by how much forces and displacement after the settlement miss belonging together; in the largest one",
    "balance": "loads that the best forces met leave unbalanced, as a share of the total load; a proof asks for 10⁻⁹ "
    "of each block's own weight",
    "merit": "work of the best forces and displacement met beyond that of a coupled state; 0 is wanted. In eps times a "
    "mean block weight",
    "bound": "any set of admissible forces that held this up would have to exceed this many times the total load; "
    "10⁶ is enough for a proof",
}
_CLOSED = "share of all cases that the refuting search has proved impossible; 1 would be a proof that it is unstable"


def joint_name(result: Result | LimitResult, contact: int, contacts: Contacts | None = None) -> str:
    """Which two blocks a contact of a result, or of such contacts, is between; escaped."""
    blocks, found = result.assembly.blocks, result.contacts if contacts is None else contacts
    return escape(f"{blocks[found.a[contact]].id} – {blocks[found.b[contact]].id}")


def contacts_table(result: Result) -> str:
    """The contacts that use most of their friction."""
    found, some = resultants(result), worst(result, ROWS)
    if found is None or result.utilisation is None or not len(some):
        return ""
    divisor, unit = unit_of(float(np.max(found.normal)))
    area = result.contacts.area
    rows = [
        (
            joint_name(result, k),
            _bar(float(result.utilisation[k])),
            number(float(found.normal[k]) / divisor),
            number(float(found.friction[k]) / divisor),
            number(float(result.contacts.mu[k])),
            number(float(area[k])),
        )
        for k in some.tolist()
    ]
    head = ["Contact", ">Utilisation", f">Normal ({unit})", f">Friction ({unit})", ">μ", ">Area (m²)"]
    return table(head, rows)


def _bar(share: float) -> Cell:
    """A share in its colour; a dash where it is not known."""
    known = float(np.nan_to_num(share, nan=0.0, posinf=0.0, neginf=0.0))
    return bar(known, fill(int(classes(np.array([share]))[0])), f"{share:.2f}" if np.isfinite(share) else "–")


def movement_table(result: Result, motion: Motion | None) -> str:
    """The blocks that move furthest in the mechanism as drawn."""
    if result.mechanism is None or motion is None:
        return ""
    largest = max(float(np.max(motion.travel, initial=0.0)), 1e-300)
    rows = [
        (
            escape(result.assembly.blocks[i].id),
            _bar(float(motion.travel[i]) / largest),
            _direction(result.mechanism[i, :3]),
            f"{np.degrees(motion.turn[i]):.1f}°",
        )
        for i in fastest(motion, ROWS).tolist()
    ]
    return table(["Block", ">Movement", ">Direction (x, y, z)", ">Turn as drawn"], rows)


def _direction(velocity: Floats) -> Cell:
    speed = float(np.linalg.norm(velocity))
    if not (speed > 0.0):
        return "stays"
    parts = (velocity / speed).round(2).tolist()
    return ", ".join(f"{part:+.2f}".replace("-", "−") if part else "0" for part in parts)


def tension_table(result: Result) -> str:
    """The contacts that would have to pull most."""
    found = needed_tension(result)
    if found is None or not len(found.patches):
        return ""
    divisor, unit = unit_of(float(np.max(found.pull)))
    rows = [
        (
            joint_name(result, k),
            number(float(found.pull[k]) / divisor),
            f"{number(100.0 * float(found.pull[k]) * found.share / found.total)} %",
            number(float(found.peak[k]) / divisor),
            number(float(result.contacts.area[k])),
        )
        for k in found.patches[:ROWS].tolist()
    ]
    head = ["Contact", f">Tension ({unit})", ">Share of the weight", f">At one point ({unit})", ">Area (m²)"]
    return table(head, rows)


def cases_table(tree: Mapping[str, Any]) -> str:
    """In which ways the cases of a refuting tree were proved impossible."""
    found = cases(tree)
    ways = (
        ("forces", "No forces", "none that press and rub as the case says balance the loads"),
        ("motion", "No displacement", "none within the bounds moves as the case says"),
        ("work", "Not both together", "virtual work: the loads gain less than pressing and rubbing would take"),
    )
    rows = [(name, f"{found[key]:,}", why) for key, name, why in ways]
    return table(["Why impossible", ">Cases", "In words"], rows)


def settlement_table(result: Result) -> str:
    """The joints that open in a settlement, the widest first, and where they stay shut."""
    if result.settled is None:
        return ""
    rows = []
    for k, width in openings(result)[:ROWS]:
        here = slice(result.contacts.start[k], result.contacts.start[k + 1])
        shut = np.abs(result.settled.gap[here]).max(axis=1) <= 1e-6 * width
        points = result.contacts.polygon(k)[shut]
        hinge = ", ".join(number(float(x), 3) for x in points.mean(axis=0)) if len(points) else "nowhere"
        rows.append(
            (
                joint_name(result, k),
                number(1e3 * width),
                f"{hinge}" + (f" ({len(points)} corners)" if len(points) else ""),
            )
        )
    if not rows:
        return "<p>No joint opens.</p>"
    return table(["Joint", ">Opens by (mm)", "Stays shut at (m)"], rows)


def residuals_table(result: Result) -> str:
    """What is left over in the answer, and what that means."""
    meaning = _RESIDUALS | ({"bound": _CLOSED} if "merit" in result.residuals else {})
    rows = [
        (escape(name), number(float(value)), meaning.get(name, "as recomputed from the model"))
        for name, value in result.residuals.items()
    ]
    return table(["Residual", ">Value", "Meaning"], rows)


def assumptions(result: Result) -> str:
    """What was assumed, what was given."""
    held = int(np.sum(result.fixed))
    rule = result.assumed.get("supports")
    words = {"lowest": "the blocks that touch the lowest point"}.get(str(rule), str(rule))
    supports = f"{held} of {len(result.fixed)} blocks" + ("" if rule is None else f": {words}")
    mu = result.contacts.mu
    rows = [
        _assumption(result, "mu", "Friction coefficient μ", _range(mu) + _angle(mu), "where the model gives none"),
        _assumption(result, "density", "Density", _range(densities(result)) + " kg/m³", "where the model gives none"),
        _assumption(result, "supports", "Supports", supports, ""),
        _assumption(result, "gravity", "Gravity", _gravity(result.gravity), ""),
    ]
    if "tolerance" in result.assumed:
        gap, degrees = str(result.assumed["tolerance"]).split(",")
        forgiven = f"faces up to {gap} m apart or in each other, and {degrees} degrees askew, count as touching"
        rows.append(_assumption(result, "tolerance", "Forgiven of the drawing", forgiven, ""))
    if partly := result.partly_held:
        sides = {block.id: " ".join(block.held) for block in result.assembly.blocks if block.held}
        some = first_few([f"{name} ({sides[name]})" for name in partly], 5)
        rows.append(_assumption(result, "held", "Partly held", some, ""))
    if result.loading is not None:
        rows.append(_assumption(result, "loads", "Loads", result.loading.words(), ""))
    if result.strength > 0.0:
        pull = f"{_range(result.contacts.strength)} Pa"
        rows.append(_assumption(result, "tension", "Joints that pull", pull, ""))
    return table(["", "Value used", ""], rows)


def _assumption(result: Result, key: str, name: str, value: str, where: str) -> tuple[Cell, Cell, Cell]:
    if key not in result.assumed:
        return name, escape(value), '<span class="tag given">given</span>'
    stood_in = result.assumed[key]
    note = f" {number(float(stood_in), 5)} {where}" if isinstance(stood_in, int | float) and where else ""
    return name, escape(value), f'<span class="tag assumed">assumed</span><span class="soft">{escape(note)}</span>'


def _gravity(gravity: Floats) -> str:
    size = number(float(np.linalg.norm(gravity)), 6)
    if gravity[0] == gravity[1] == 0.0 and gravity[2] < 0.0:
        return f"{size} m/s², straight down"
    return f"{size} m/s² along ({', '.join(number(part, 4) for part in gravity.tolist())})"


def _range(value: Floats) -> str:
    """Write the lowest and the highest value, or the one there is."""
    known = value[np.isfinite(value)]
    if not len(known):
        return "none"
    low, high = float(known.min()), float(known.max())
    return number(low, 5) if low == high else f"{number(low, 5)} to {number(high, 5)}"


def _angle(mu: Floats) -> str:
    known = np.unique(mu[np.isfinite(mu)])
    return f" ({np.degrees(np.arctan(known[0])):.1f}°)" if len(known) == 1 else ""


_ROUTES = {
    "RBE": "rigid-block equilibrium, which settles it already",
    "continuation": "continuation: from dilating to Coulomb friction",
    "alternation": "alternation: forces and displacement in turn, with restarts",
    "tree": "a tree of cases",
    "smallest eta": "continuation and linear programmes, from a larger eta downwards",
}


def provenance_table(result: Result) -> str:
    """Who computed it, how, and how long it took."""
    rows = [
        (escape(_words(name)), _value(_ROUTES.get(str(value), value) if name == "route" else value))
        for name, value in result.provenance.items()
        if not isinstance(value, str) or value
    ]
    if result.seconds:
        rows.append(("seconds", _value(result.seconds)))
    return table(["", ""], rows)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _value(value: Any) -> Cell:
    if isinstance(value, Mapping):
        return ", ".join(f"{escape(_words(str(k)))} {_value(v)}" for k, v in value.items()) or "–"
    if isinstance(value, list | tuple) and any(isinstance(v, Mapping) for v in value):
        return "<br>".join(_value(v) for v in value)
    if isinstance(value, list | tuple):
        return f"({', '.join(_value(v) for v in value)})"
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "–"}[value]
    if isinstance(value, int | np.integer):
        return f"{int(value):,}"
    if isinstance(value, float | np.floating):
        return number(float(value), 4)
    return escape(str(value))


_SPARE = (
    "By rigid-block equilibrium, the others unchanged: how far each may go before no forces keep balance any more. Both"
    " sides of each are proved by certificates. Where stones slide without opening, or by coupled analysis, less may be"
    " left."
)


def margins_section(found: Margins, result: Result) -> str:
    """What, how much, and which joint governs."""
    content = table(["", "", "moves most when it falls"], _margin_rows(found, result))
    return section("What it has to spare", content, _SPARE)


def _margin_rows(found: Margins, result: Result) -> list[tuple[str, str, str]]:
    rows = []
    mu = result.contacts.mu
    if found.friction is not None:
        if found.friction.stands == 0.0:
            much = "needs none"
        else:
            one = len(mu) > 0 and float(mu.min()) == float(mu.max())
            value = f"μ {number(found.friction.stands * float(mu[0]))}, " if one else ""
            much = f"{value}{100 * found.friction.stands:.1f} % of what there is"
        rows.append(("Least friction", much, _governing(found.friction, result)))
    if found.joints is not None:
        if found.joints.falls is None:
            much = f"to less than {100 * found.joints.stands:g} % of their size"
        else:
            much = f"to {100 * found.joints.stands:.1f} % of their size: geometric safety {found.geometric_safety:.2f}"
        rows.append(("Joints may shrink", much, _governing(found.joints, result)))
    if found.tilt is not None:
        much = f"{found.tilt.stands:.2f}° towards azimuth {found.azimuth:g}°, the worst of eight"
        rows.append(("The ground may tilt by", much, _governing(found.tilt, result)))
    if found.within:
        rows.append(("Drawings may be off by", f"{millimetres(found.within)}, proved of all within that", ""))
    return rows


def _governing(bracket: Bracket, result: Result) -> str:
    return "" if bracket.governing is None else joint_name(result, bracket.governing)


_SUBSIDING = (
    "The supports move on in steps, as rigid bodies; the blocks follow so that the loads lose most, friction counted,"
    " while nothing closes that is shut; stones that run into each other bear on each other from there on. A state of"
    " rest is looked for on the geometry as it has become. Forces, openings and pictures above are those of its"
    " beginning."
    " Where a rest is proved, its certificate was checked in exact arithmetic."
)


def subsidence_section(found: Subsidence, result: Result, drawn: str) -> str:
    """The table of its steps as a part of the page, and where it ends, drawn."""
    names = ("share", "settlement", "found", "widest joint", "", "points that touch")
    rows = table(names, (_step_row(step, found, result) for step in found.steps))
    return section("As the settlement goes on", f"<p>{escape(found.ended)}</p>{drawn}{rows}", _SUBSIDING)


def _step_row(step: SubsidenceStep, found: Subsidence, result: Result) -> tuple[str, ...]:
    met = "".join(f"; {one} and {other} meet" for one, other in step.met)
    return (
        f"{100 * step.share:.4g} %",
        f"{number(step.settlement)} m",
        escape(step.word + (", proved" if step.proved else "") + met),
        f"{number(step.opening)} m",
        joint_name(result, step.joint, found.contacts) if step.joint >= 0 else "",
        str(step.touching),
    )
