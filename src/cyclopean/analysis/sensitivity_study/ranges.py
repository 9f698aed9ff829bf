"""What may vary, between which bounds, and one draw of it."""

from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis.preparation import PreparedModel
from cyclopean.arrays import Floats
from cyclopean.assembly import worn
from cyclopean.errors import InputError
from cyclopean.statics import turned_gravity

__all__ = ["QUANTITIES", "Range", "drawn", "ranges_of", "varied"]

QUANTITIES = {
    "mu": "friction coefficient of all joints",
    "mu-each": "friction coefficient, drawn for every joint",
    "density": "density of all blocks, kg/m3",
    "density-each": "density, drawn for every block, kg/m3",
    "joints": "length by which the edges of a joint are worn away, drawn for every joint, m",
    "tilt": "tilt of the ground, degrees, towards any azimuth",
}


@dataclass(frozen=True, slots=True)
class Range:
    """A quantity and the two ends of what it may be; between them every value is as likely."""

    quantity: str  # a key of QUANTITIES
    low: float
    high: float

    def __post_init__(self) -> None:
        where = f"`vary` {self.quantity}={self.low:g}:{self.high:g}"
        if self.quantity not in QUANTITIES:
            raise InputError(f"{where}: expected one of {', '.join(QUANTITIES)}")
        if not (np.isfinite([self.low, self.high]).all() and self.low <= self.high):
            raise InputError(f"{where}: expected two finite numbers, the lower one first")
        if self.low < 0.0 or (self.quantity.startswith("density") and self.low == 0.0):
            more = "more than 0" if self.quantity.startswith("density") else "0 or more"
            raise InputError(f"{where}: must be {more}")
        if self.quantity == "tilt" and self.high >= 90.0:
            raise InputError(f"{where}: a tilt is less than 90 degrees")


def ranges_of(texts: list[str]) -> tuple[Range, ...]:
    """Read ranges such as "mu=0.6:0.8"; a single number is both ends.

    Raises
    ------
    InputError
        A text that is none, a quantity that is unknown or given twice (also as a whole and for each).

    Examples
    --------
    >>> ranges_of(["mu=0.6:0.8", "tilt=0:2"])[1]
    Range(quantity='tilt', low=0.0, high=2.0)
    """
    found: list[Range] = []
    for text in texts:
        name, _, ends = text.partition("=")
        low, _, high = ends.partition(":")
        try:
            if "_" in ends:
                raise ValueError
            pair = float(low), float(high or low)
        except ValueError:
            raise InputError.of("vary", text, "expected QUANTITY=LOW:HIGH, such as mu=0.6:0.8") from None
        found.append(Range(name, *pair))
    kinds = [each.quantity.removesuffix("-each") for each in found]
    twice = [kind for k, kind in enumerate(kinds) if kind in kinds[:k]]
    if twice:
        raise InputError.of("vary", twice[0], "given twice; one range is enough")
    return tuple(found)


def drawn(ranges: tuple[Range, ...], model: PreparedModel, seed: int, sample: int) -> dict[str, Floats]:
    """One value of every quantity: one number, or one for each joint or block (tilt: degrees and azimuth).

    Every sample has random numbers of its own, so that it is the same whoever draws it, and in whatever order.
    """
    random = np.random.default_rng([seed, sample])
    many = {"mu-each": len(model.contacts), "joints": len(model.contacts), "density-each": len(model.assembly)}
    values = {r.quantity: random.uniform(r.low, r.high, many.get(r.quantity, 1)) for r in ranges}
    if "tilt" in values:
        values["tilt"] = np.append(values["tilt"], random.uniform(0.0, 360.0))
    return values


def varied(model: PreparedModel, values: dict[str, Floats]) -> PreparedModel:
    """Put values, one for each block or joint, in the place of what the model and the options say."""
    contacts, assembly, gravity = model.contacts, model.assembly, model.gravity
    for name in ("mu", "mu-each"):
        if name in values:
            contacts = replace(contacts, mu=np.broadcast_to(values[name], len(contacts)).copy())
    if "joints" in values:
        contacts, _ = worn(contacts, values["joints"])
    if "density" in values or "density-each" in values:
        density = np.broadcast_to(values.get("density", values.get("density-each", np.zeros(1))), len(assembly))
        blocks = tuple(replace(b, density=float(d)) for b, d in zip(assembly.blocks, density, strict=True))
        assembly = replace(assembly, blocks=blocks)
    if "tilt" in values:
        gravity = turned_gravity(gravity, float(values["tilt"][0]), float(values["tilt"][1]))
    return replace(model, assembly=assembly, contacts=contacts, gravity=gravity)
