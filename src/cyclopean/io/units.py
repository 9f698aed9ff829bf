"""Lengths come in as they are and become metres here, nowhere else."""

import math

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.io.files import one_line

__all__ = ["ASSUMED", "UNITS", "Units", "check_units", "likely_unit", "metres", "stated_units"]

ASSUMED = "metres assumed"  # how warnings say it
USUAL = 0.4  # m: what two people lift; of the units that would explain a slip, the one that comes nearest is named
LONG = {"m": "metres", "cm": "centimetres", "mm": "millimetres"}  # inches are told from centimetres by nobody

Units = tuple[int, int]  # metres = value * first / second: whole numbers, so that 300 mm is 0.3 m to the last digit
UNITS: dict[str, Units] = {"m": (1, 1), "cm": (1, 100), "mm": (1, 1000), "in": (127, 5000), "ft": (381, 1250)}


def check_units(units: str, where: str) -> str:
    """Return `units`.

    Raises
    ------
    InputError
        They are not one of `UNITS`.
    """
    if units not in UNITS:
        raise InputError(f"{where}: '{one_line(units, 20)}' is not a unit of length; use m, cm, mm, in or ft")
    return units


def stated_units(path: str, said: str, units: str | None) -> tuple[str, list[str]]:
    """Unit of a file that says `said` ("" = nothing), and `units` where the user says it; what was assumed.

    Raises
    ------
    InputError
        The two do not agree, or one of them is no unit in which stones are drawn.
    """
    if units is not None:
        check_units(units, "`units`")
    if said in UNITS:
        if units not in (None, said):
            raise InputError(f"{path}: says that its units are {said}; leave out `units` {units}")
        return said, []
    if said:
        raise InputError(f"{path}: its unit is {said}; set it to metres, centimetres, millimetres, inches or feet")
    return units or "m", [] if units else [f"{path}: does not say its units; {ASSUMED} (`units`)"]


def likely_unit(size: float, units: str, sizes: tuple[float, float]) -> str | None:
    """The unit in which a size (m, of what was read in `units`) would be among `sizes`, as that of stones is.

    Examples
    --------
    >>> likely_unit(400.0, "m", (0.01, 100.0)), likely_unit(4e6, "m", (0.01, 100.0))
    ('mm', None)
    """
    times, over = UNITS[units]
    scaled = {name: size * over / times * UNITS[name][0] / UNITS[name][1] for name in LONG}
    likely = [name for name, value in scaled.items() if sizes[0] <= value <= sizes[1]]
    return min(likely, key=lambda name: abs(math.log(scaled[name] / USUAL)), default=None)


def metres(values: Floats, units: str | Units) -> Floats:
    """Convert `values` in `units`, or the unit of that name, to metres.

    Examples
    --------
    >>> import numpy as np
    >>> float(metres(np.array(300.0), "mm")), float(metres(np.array(10.0), "ft"))
    (0.3, 3.048)
    """
    times, over = UNITS[units] if isinstance(units, str) else units
    return values if times == over else values * times / over
