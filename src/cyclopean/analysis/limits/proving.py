"""From bounds that the solvers claim to bounds that the independent checker has confirmed."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.analysis.certificates import certify, inner_forces, world_forces
from cyclopean.analysis.limits.budget import UNLIMITED, Budget
from cyclopean.analysis.limits.solving import LimitOutcome
from cyclopean.analysis.posing import PosedModel
from cyclopean.arrays import Floats
from cyclopean.assembly import Load
from cyclopean.proof import Report, seal, verify
from cyclopean.statics import EquilibriumSystem

__all__ = ["Proved", "in_users_units", "prove_bounds"]

STEPS = (0.0, 1e-9, 1e-8, 1e-7)  # by which an upper bound is raised when rounding spoils its proof


@dataclass(frozen=True, slots=True, eq=False)
class Proved:
    """Bounds as they stand in a certificate; None where that side was not proved."""

    lower: float | None
    upper: float | None
    force: Floats | None  # (q, 3) scaled, at lower
    motion: Floats | None  # (m, 6) m/s and rad/s, largest 1
    certificate: dict[str, Any] | None
    report: Report | None


def prove_bounds(
    model: PosedModel,
    system: EquilibriumSystem,
    gravity: Floats,
    loads: tuple[Load, ...],
    outcome: LimitOutcome,
    budget: Budget = UNLIMITED,
) -> Proved:
    """Write the certificate of an outcome, have it checked, and keep what was proved.

    Parameters
    ----------
    model : PosedModel
        With the dead loads; its gravity is theirs.
    system : EquilibriumSystem
        Of the dead loads.
    gravity : (3,)
        Live, m/s2.
    loads : tuple of Load
        Live.
    outcome : LimitOutcome
        In the user's multipliers.
    budget : Budget
        Where no time is left for a proof, nothing is proved.
    """
    nothing = Proved(None, None, None, None, None, None)
    sides: dict[str, Any] = {}
    force = motion = None
    if outcome.f is not None and np.isfinite(outcome.lower):
        force = inner_forces(outcome.f, system.mu, _blur(model)[model.contacts.patch[system.used]])
        sides |= {"lower": outcome.lower, "world_force": world_forces(system, force)}
    if outcome.y is not None and np.isfinite(outcome.upper):
        motion = system.still(outcome.y).reshape(-1, 6).copy()
        motion[:, 3:] /= system.length_unit
        motion /= max(float(np.max(np.abs(motion), initial=0.0)), 1e-300)
        sides |= {"upper": outcome.upper, "motion": motion}
    if not sides or not budget.allows_proof(len(model.contacts.point)):
        return nothing
    certificate, report = _checked(model, system, gravity, loads, sides)
    if not report.proved and budget.over:
        return replace(nothing, report=report)
    if not report.proved and len(sides) == 4:  # one side may stand without the other
        found = [_alone(model, system, gravity, loads, sides, keys) for keys in _SIDES]
        kept = {key: value for part in found for key, value in part.items()}
        if kept:
            certificate, report, sides = *_checked(model, system, gravity, loads, kept), kept
    elif not report.proved and "upper" in sides:
        kept = _alone(model, system, gravity, loads, sides, _SIDES[1])
        if kept:
            certificate, report, sides = *_checked(model, system, gravity, loads, kept), kept
    if not report.proved:
        return replace(nothing, report=report)
    return Proved(
        sides.get("lower"),
        sides.get("upper"),
        force if "lower" in sides else None,
        motion if "upper" in sides else None,
        certificate,
        report,
    )


_SIDES = (("lower", "world_force"), ("upper", "motion"))


def _alone(
    model: PosedModel,
    system: EquilibriumSystem,
    gravity: Floats,
    loads: tuple[Load, ...],
    sides: Mapping[str, Any],
    keys: tuple[str, str],
) -> dict[str, Any]:
    """One side, as far as it can be proved by itself; an upper bound is raised a little where that helps."""
    part = {key: sides[key] for key in keys if key in sides}
    for step in STEPS if "upper" in part else STEPS[:1]:
        moved = {key: value + step * abs(value) if key == "upper" else value for key, value in part.items()}
        if _checked(model, system, gravity, loads, moved)[1].proved:
            return moved
    return {}


def _checked(
    model: PosedModel,
    system: EquilibriumSystem,
    gravity: Floats,
    loads: tuple[Load, ...],
    sides: Mapping[str, Any],
) -> tuple[dict[str, Any], Report]:
    certificate = certify(
        model.assembly,
        model.contacts,
        model.fixed,
        model.gravity,
        model.density,
        system,
        model.tolerance,
        "limit-bounds",
        {key: value for key, value in sides.items() if key in ("world_force", "motion")},
    )
    names = [block.id for block in model.assembly.blocks]
    certificate["live"] = {
        "gravity": _plain(gravity),
        "loads": [
            {"block": names[load.block], "force": _plain(load.force), "point": _plain(load.point)} for load in loads
        ],
    }
    certificate |= {key: float(sides[key]) for key in ("lower", "upper") if key in sides}
    certificate["seal"] = seal(certificate)
    return certificate, verify(certificate)


def _plain(vector: Floats) -> list[float]:
    """Numbers, with noise below 1e-60 of the largest set to zero."""
    size = float(np.max(np.abs(vector), initial=0.0))
    return [float(x) if abs(x) > 1e-60 * size else 0.0 for x in vector]


def _blur(model: PosedModel) -> Floats:
    """(c,) angle by which rounding may turn the normal of each patch: worse the thinner it is."""
    contacts = model.contacts
    if not len(contacts):
        return np.zeros(0)
    low = np.minimum.reduceat(contacts.point, contacts.start[:-1], axis=0)
    high = np.maximum.reduceat(contacts.point, contacts.start[:-1], axis=0)
    return np.asarray(4e-16 * np.sum((high - low) ** 2, 1) / contacts.area)


def in_users_units(outcome: LimitOutcome, unit: float) -> LimitOutcome:
    """Multipliers t = unit s; an upper bound is rounded up, a lower one is what its forces balance."""
    upper = outcome.upper * unit
    upper = upper + 4e-16 * abs(upper) if np.isfinite(upper) else upper
    return replace(outcome, lower=outcome.lower * unit, upper=upper, least=outcome.least * unit)
