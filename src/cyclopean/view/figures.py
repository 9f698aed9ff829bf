"""Numbers of a report: resultants, worst contacts, fastest blocks, and how numbers are written."""

from dataclasses import dataclass

import numpy as np

from cyclopean.analysis import Result
from cyclopean.arrays import Floats, Ints
from cyclopean.view.motion import Motion

__all__ = ["Resultants", "block_utilisation", "fastest", "number", "resultants", "unit_of", "worst"]

CARRIES = 1e-9  # of the largest normal force: below this a patch counts as unloaded


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
    if not len(contacts):
        none = np.zeros((0, 3))
        return Resultants(none, np.zeros(0), np.zeros(0), none, np.zeros(0, np.int64))
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
