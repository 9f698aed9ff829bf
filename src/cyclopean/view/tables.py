"""Tables of the report, as HTML. Whatever comes from the model is escaped here."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from cyclopean.analysis import Result
from cyclopean.arrays import Floats
from cyclopean.view.colours import classes, fill
from cyclopean.view.figures import fastest, number, resultants, unit_of, worst
from cyclopean.view.motion import Motion

__all__ = ["assumptions", "contacts_table", "movement_table", "provenance_table", "residuals_table", "table"]

ROWS = 12  # of the longer tables

Cell = str  # HTML, already escaped

_RESIDUALS = {
    "equilibrium": "forces and moments left unbalanced, over all free blocks; as a share of the total load",
    "cone": "how far the worst contact force lies outside compression and friction; as a share of the total load",
    "gap": "worst product of a contact force and the gap it would have to act across",
    "alignment": "worst deviation of friction from the direction opposite to sliding",
    "bound": "any set of admissible forces that held this up would have to exceed this many times the total load; "
    "10⁶ is enough for a proof",
}


def table(head: Sequence[tuple[str, str]], rows: Iterable[Sequence[Cell]]) -> str:
    """Write an HTML table; head = (title, class) of each column, the first cell of every row is its heading."""
    columns = "".join(f'<th scope="col"{_class(c)}>{title}</th>' for title, c in head)
    body = "".join(
        f'<tr><th scope="row">{row[0]}</th>'
        + "".join(f"<td{_class(c)}>{cell}</td>" for cell, (_, c) in zip(row[1:], head[1:], strict=True))
        + "</tr>"
        for row in rows
    )
    return f'<div class="wide"><table><thead><tr>{columns}</tr></thead><tbody>{body}</tbody></table></div>'


def _class(name: str) -> str:
    return f' class="{name}"' if name else ""


def contacts_table(result: Result) -> str:
    """The contacts that use most of their friction."""
    found, some = resultants(result), worst(result, ROWS)
    if found is None or result.utilisation is None or not len(some):
        return ""
    contacts, blocks = result.contacts, result.assembly.blocks
    divisor, unit = unit_of(float(np.max(found.normal)))
    area = contacts.area
    colour = classes(result.utilisation)
    rows = [
        (
            escape(f"{blocks[contacts.a[k]].id} – {blocks[contacts.b[k]].id}"),
            _bar(float(result.utilisation[k]), fill(int(colour[k]))),
            number(float(found.normal[k]) / divisor),
            number(float(found.friction[k]) / divisor),
            number(float(contacts.mu[k])),
            number(float(area[k])),
        )
        for k in some.tolist()
    ]
    head = [("Contact", ""), ("Utilisation", "n"), (f"Normal ({unit})", "n"), (f"Friction ({unit})", "n")]
    return table([*head, ("μ", "n"), ("Area (m²)", "n")], rows)


def _bar(share: float, colour: str) -> Cell:
    width = 100.0 * min(max(share, 0.0), 1.0) if np.isfinite(share) else 0.0
    text = f"{share:.2f}" if np.isfinite(share) else "–"
    return f'{text}<span class="bar"><i style="width:{width:.0f}%;background:{colour}"></i></span>'


def movement_table(result: Result, motion: Motion) -> str:
    """The blocks that move furthest in the mechanism as drawn."""
    if result.mechanism is None:
        return ""
    largest = max(float(np.max(motion.travel, initial=0.0)), 1e-300)
    rows = [
        (
            escape(result.assembly.blocks[i].id),
            _bar(float(motion.travel[i]) / largest, fill(int(classes(motion.travel[i : i + 1] / largest)[0]))),
            _direction(result.mechanism[i, :3]),
            f"{np.degrees(motion.turn[i]):.1f}°",
        )
        for i in fastest(motion, ROWS).tolist()
    ]
    head = [("Block", ""), ("Movement", "n"), ("Direction (x, y, z)", "n")]
    return table([*head, ("Turn as drawn", "n")], rows)


def _direction(velocity: Floats) -> Cell:
    speed = float(np.linalg.norm(velocity))
    if not (speed > 0.0):
        return "stays"
    return ", ".join(_signed(part) for part in (velocity / speed).round(2).tolist())


def _signed(value: float) -> str:
    return f"{value:+.2f}".replace("-", "−") if value else "0"


def residuals_table(result: Result) -> str:
    """What is left over in the answer, and what that means."""
    rows = [
        (escape(name), number(float(value)), _RESIDUALS.get(name, "as recomputed from the model"))
        for name, value in result.residuals.items()
    ]
    return table([("Residual", ""), ("Value", "n"), ("Meaning", "")], rows) if rows else ""


def assumptions(result: Result) -> str:
    """What was assumed, what was given."""
    held = int(np.sum(result.fixed))
    rule = result.assumed.get("supports")
    words = {"lowest": "the blocks that touch the lowest point"}.get(str(rule), str(rule))
    supports = f"{held} of {len(result.fixed)} blocks" + ("" if rule is None else f": {words}")
    mu = result.contacts.mu
    rows = [
        _assumption(result, "mu", "Friction coefficient μ", _range(mu) + _angle(mu), "where the model gives none"),
        _assumption(result, "density", "Density", _range(_densities(result)) + " kg/m³", "where the model gives none"),
        _assumption(result, "supports", "Supports", supports, ""),
        _assumption(result, "gravity", "Gravity", _gravity(result.gravity), ""),
    ]
    return table([("", ""), ("Value used", ""), ("", "")], rows)


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


def _densities(result: Result) -> Floats:
    """Densities as used: the certificate lists them; else those of the blocks, or the assumed one."""
    if result.certificate is not None and result.certificate.get("blocks"):
        return np.array([float(block["density"]) for block in result.certificate["blocks"]])
    assumed = float(result.assumed.get("density", np.nan))
    return np.array([assumed if b.density is None else b.density for b in result.assembly.blocks], float)


def provenance_table(result: Result) -> str:
    """Who computed it, how, and how long it took."""
    rows = [(escape(_words(name)), _value(value)) for name, value in result.provenance.items()]
    if result.seconds:
        rows.append(("seconds", _value(result.seconds)))
    return table([("", ""), ("", "")], rows) if rows else ""


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
