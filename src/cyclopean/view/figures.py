"""Numbers of a report: resultants, worst contacts, fastest blocks, and how numbers are written."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cyclopean.analysis import Result
from cyclopean.arrays import Floats, Ints
from cyclopean.view.motion import Motion

CARRIES = 1e-9  # of the largest normal force: below this a patch counts as unloaded
RUBS = 1e-6  # likewise friction at a point
TRACE = 1e-5  # of the weight: tension has a price and is not forbidden, so a trace of it is left where none is needed
PULLS = 1e-3  # of the largest tension: below this a point is not shown


@dataclass(frozen=True, slots=True, eq=False)
class Resultants:
    """What each contact patch (c of them) carries as a whole."""

    force: Floats  # (c, 3) N, world, on block b
    normal: Floats  # (c,) N, compression positive
    friction: Floats  # (c,) N
    centre: Floats  # (c, 3) m, centre of pressure; of the polygon where nothing is carried
    loaded: Ints  # patches that carry something, largest force first


def resultants(result: Result) -> Resultants | None:
    """Sum the point forces of every patch; None when the result has no forces."""
    contacts = result.contacts
    if result.force is None:
        return None
    frame = contacts.frame if result.frame is None else result.frame
    first = contacts.start[:-1]
    whole = np.add.reduceat(result.force, first, axis=0)
    normal, friction = whole[:, 0], np.hypot(whole[:, 1], whole[:, 2])
    world = np.einsum("ck,ckj->cj", whole, frame)
    size = np.hypot(normal, friction)
    carries = (normal > CARRIES * np.max(normal, initial=0.0)) & (normal > 0.0)
    weight = np.where(carries[contacts.patch], np.maximum(result.force[:, 0], 0.0), 1.0)
    origin = contacts.point[first]  # local, so that a model far from the origin loses nothing
    arm = contacts.point - origin[contacts.patch]
    total = np.add.reduceat(weight, first)
    centre = origin + np.add.reduceat(weight[:, None] * arm, first, axis=0) / np.where(total > 0.0, total, 1.0)[:, None]
    order = np.argsort(-size, kind="stable")
    return Resultants(world, normal, friction, centre, order[carries[order]])


@dataclass(frozen=True, slots=True, eq=False)
class Pressing:
    """Contact points of a coupled state that press, and the friction at them."""

    point: Floats  # (m, 3) m
    friction: Floats  # (m, 3) N, world, on the upper of the two blocks
    rubbing: Ints  # rows with friction, the largest first


def pressing(result: Result) -> Pressing | None:
    """Points that press and rub; None unless forces and a virtual displacement go together."""
    contacts = result.contacts
    if result.force is None or result.displacement is None:
        return None
    frame = contacts.frame if result.frame is None else result.frame
    largest = float(np.max(result.force[:, 0], initial=0.0))
    some = np.flatnonzero(result.force[:, 0] > CARRIES * largest)
    patch = contacts.patch[some]
    height = -result.assembly.mass.centroid @ result.gravity
    up = np.where(height[contacts.b[patch]] >= height[contacts.a[patch]], 1.0, -1.0)
    friction = up[:, None] * np.einsum("mk,mkj->mj", result.force[some, 1:], frame[patch, 1:])
    size = np.linalg.norm(friction, axis=1)
    order = np.argsort(-size, kind="stable")
    return Pressing(contacts.point[some], friction, order[size[order] > RUBS * largest])


@dataclass(frozen=True, slots=True, eq=False)
class Tension:
    """Tension that the contacts would have to bear."""

    pull: Floats  # (c,) N, of each contact
    peak: Floats  # (c,) N, at the worst point of each contact
    patches: Ints  # contacts that would pull, the most first
    point: Ints  # contact points that would pull, the most first
    total: float  # N
    share: float  # of the weight of all free blocks


def needed_tension(result: Result) -> Tension | None:
    """Sum the tension of every contact; None where it was not measured."""
    if result.tension is None:
        return None
    first = result.contacts.start[:-1]
    pull = np.maximum(np.nan_to_num(result.tension), 0.0)
    weight = free_weight(result)
    least = max(PULLS * float(np.max(pull, initial=0.0)), TRACE * weight)
    pull = np.where(pull > least, pull, 0.0)
    whole, peak, total = np.add.reduceat(pull, first), np.maximum.reduceat(pull, first), float(np.sum(pull))
    share = total / weight if weight else np.nan
    return Tension(whole, peak, _largest_first(whole), _largest_first(pull), total, share)


def _largest_first(value: Floats) -> Ints:
    """Rows of what is above zero."""
    order = np.argsort(-value, kind="stable")
    return np.asarray(order[value[order] > 0.0])


def densities(result: Result) -> Floats:
    """(n,) kg/m3 as used: the certificate lists them; else those of the blocks, or the assumed one."""
    if result.certificate is not None and result.certificate.get("blocks"):
        return np.array([float(block["density"]) for block in result.certificate["blocks"]])
    return result.assembly.densities(float(result.assumed.get("density", np.nan)))


def free_weight(result: Result) -> float:
    """Weight (N) of all free blocks; 0 where a density is not known."""
    mass = densities(result) * np.abs(result.assembly.mass.volume)
    weight = float(np.sum(mass[~result.fixed])) * float(np.linalg.norm(result.gravity))
    return weight if np.isfinite(weight) else 0.0


def cases(tree: Mapping[str, Any]) -> dict[str, int]:
    """How many leaves of a refuting tree are closed in each of the three ways, and how deep it goes.

    Examples
    --------
    >>> cases({"point": 0, "engaged": {"forces": []}, "unloaded": {"mechanism": {}, "forces": []}})
    {'forces': 0, 'motion': 1, 'work': 1, 'depth': 1}
    """
    found = {"forces": 0, "motion": 0, "work": 0, "depth": 0}
    waiting: list[tuple[Mapping[str, Any], int]] = [(tree, 0)]
    while waiting:
        node, depth = waiting.pop()
        found["depth"] = max(found["depth"], depth)
        if "point" in node:
            parts = [*node.get("sectors", ()), *(node[key] for key in _HALVES if key in node)]
            waiting += [(part, depth + 1) for part in parts]
        else:  # a motion alone refutes the forces, forces alone the motion, both together the work of both
            found["work" if {"mechanism", "forces"} <= node.keys() else _REFUTES["mechanism" in node]] += 1
    return found


_HALVES = ("engaged", "unloaded", "slower", "faster")
_REFUTES = {True: "forces", False: "motion"}


def block_utilisation(result: Result) -> Floats:
    """(n,) utilisation of the worst patch of each block; NaN where the result has none or the block has no patch."""
    worst_of = np.full(len(result.assembly), -np.inf)
    if result.utilisation is not None:
        known = np.where(np.isfinite(result.utilisation), result.utilisation, -np.inf)
        np.maximum.at(worst_of, result.contacts.a, known)
        np.maximum.at(worst_of, result.contacts.b, known)
    return np.where(np.isfinite(worst_of), worst_of, np.nan)


def worst(result: Result, count: int) -> Ints:
    """Patches with the highest utilisation, worst first, of those that carry anything; ties by force."""
    found = resultants(result)
    if found is None or result.utilisation is None or not len(found.loaded):
        return np.zeros(0, np.int64)
    share = np.nan_to_num(result.utilisation[found.loaded], nan=-1.0)
    return np.asarray(found.loaded[np.argsort(-share, kind="stable")][:count])


def fastest(motion: Motion, count: int) -> Ints:
    """Blocks that travel furthest, first; blocks that do not move are left out."""
    order = np.argsort(-motion.travel, kind="stable")
    still = 1e-9 * float(np.max(motion.travel, initial=0.0))
    return np.asarray(order[motion.travel[order] > still][:count])


def unit_of(newtons: float) -> tuple[float, str]:
    """Divisor and name of the unit in which forces of up to this size read well.

    Examples
    --------
    >>> unit_of(950.0), unit_of(12e3), unit_of(3e7)
    ((1.0, 'N'), (1000.0, 'kN'), (1000000.0, 'MN'))
    """
    for divisor, name in ((1e6, "MN"), (1e3, "kN")):
        if newtons >= divisor:
            return divisor, name
    return 1.0, "N"


def force_text(newtons: float) -> str:
    """Write a force in the unit in which it reads well.

    Examples
    --------
    >>> force_text(12e3)
    '12 kN'
    """
    divisor, unit = unit_of(newtons)
    return f"{number(newtons / divisor)} {unit}"


def number(value: float, digits: int = 3) -> str:
    """Write a number to so many significant digits, without an exponent from 0.001 to 10,000; a dash if not finite.

    Examples
    --------
    >>> number(12345.6), number(0.25), number(0.0), number(3.21e-12), number(float("nan"))
    ('12,300', '0.25', '0', '3.21 × 10⁻¹²', '–')
    """
    if not np.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    power = int(np.floor(np.log10(abs(value))))
    if -4 < power < 6:
        whole = round(value, digits - 1 - power)
        text = f"{whole:,.{max(digits - 1 - power, 0)}f}"
        return (text.rstrip("0").rstrip(".") if "." in text else text).replace("-", "−")
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    raised = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa} × 10{raised}".replace("-", "−")
