"""Colours: of stone, one ordered scale for what is to be feared, and one accent for each verdict."""

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints

# Green for what has much to spare, amber from two thirds on, red for the last tenth. Lightness falls all the way (OKLab
# 0.95 to 0.50), so that it reads in the right order without colour vision and in a black-and-white print. Ten, so that
# a legend can be read off.
SCALE = (
    "#e6f3df", "#d7edcb", "#c9e5b6", "#bfdfa0", "#bad787",
    "#c4cb66", "#ddb63e", "#e39420", "#d55c13", "#b71b14",
)  # fmt: skip
STONES = ("#d3cabb", "#c3bdb1", "#dacfbd", "#b9b4aa", "#cdc1b0", "#c9c6bd", "#d6cab4")  # of one quarry, in turn
STEPS = len(SCALE)
NEUTRAL = "#cfcbc2"  # a block with no value
SUPPORT = "#5f6b76"
HATCH = "#3b444c"
FORCE = "#083f88"
RUB = "#a3127e"  # friction at a point
THRUST = "#0b7fa5"  # the line of thrust
LOAD = "#9c1450"  # a load that grows, and hinges
PULL = "#007a4d"  # tension that a joint would have to bear
GRAVITY = "#1b1b1b"
GHOST = "#8a8f94"
INK = "#33302b"
SOFT = "#5b5750"  # of words that may be overlooked
LINE = "#dedbd3"  # of tables and charts
ACCENT = {"stable": "#00695c", "unstable": "#b83a10", "undecided": "#8a5a00"}  # each >= 4.5 : 1 on white

WEAK = "#e3a63c"  # a stone at which a search ends

UNKNOWN, HELD, BLAMED = -1, -2, -3  # classes beside 0 .. STEPS - 1


def classes(value: Floats, fixed: Bools | None = None) -> Ints:
    """Class 0..9 of each value in [0, 1]; beyond 1 counts as the last, what is not finite as -1, supports as -2.

    Examples
    --------
    >>> classes(np.array([0.0, 0.05, 0.1, 0.999, 1.0, 1.2, np.nan])).tolist()
    [0, 0, 1, 9, 9, 9, -1]
    """
    finite = np.isfinite(value)
    step = np.floor(np.where(finite, value, 0.0) * STEPS + 1e-9)
    found = np.where(finite, np.clip(step, 0, STEPS - 1), UNKNOWN).astype(np.int64)
    return found if fixed is None else np.where(fixed, HELD, found)


def fill(group: int) -> str:
    """Colour of a class as #rrggbb."""
    return {HELD: SUPPORT, UNKNOWN: NEUTRAL, BLAMED: WEAK}.get(group) or SCALE[group]


def stone(number: int) -> str:
    """Colour of a stone that has such a number: of seven that lie near each other, seldom its neighbour's."""
    return STONES[5 * number % len(STONES)]  # 5 has no factor in common with 7: all take their turn


def rgb(colour: str) -> tuple[int, int, int]:
    """#rrggbb as three numbers 0..255.

    Examples
    --------
    >>> rgb("#ff8000")
    (255, 128, 0)
    """
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def shaded(colour: str, light: float) -> str:
    """Multiply a colour by `light` in [0, 1]."""
    return "#" + "".join(f"{round(light * part):02x}" for part in rgb(colour))
