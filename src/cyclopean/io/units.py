"""Lengths come in as they are and become metres here, nowhere else."""

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.io.files import one_line

__all__ = ["UNITS", "Units", "check_units", "metres", "stated_units"]

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
    return units or "m", [] if units else [f"{path}: does not say its units; metres assumed (`units`)"]


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
