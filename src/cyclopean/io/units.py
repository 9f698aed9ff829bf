"""Lengths come in as they are and become metres here, nowhere else."""

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.io.files import one_line

__all__ = ["UNITS", "Units", "check_units", "metres"]

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
