"""The first line of an answer: what a mason or an engineer wants to know, in everyday words and units.

What is proved is said, and no more: a mechanism by rigid-block equilibrium proves that a structure falls, whichever way
the joints slide, so that "falls" is said of the upper bound of a limit or a margin, rounded up.
"""

import math
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cyclopean.analysis.limit_analysis.live_load import Live
    from cyclopean.analysis.limit_analysis.result import LimitResult
    from cyclopean.analysis.verdict import Result

__all__ = ["BALANCED", "amount", "answer", "force", "limit_answer", "none_to_spare", "rounded", "towards"]

BALANCED = {  # why a structure stands where nothing else is to be said, by method
    "rbe": "Compression and friction at the contacts can balance every load on every block.",
    "cra": "Forces that a virtual motion of the blocks produces, pressing and rubbing, balance every load.",
}
WAYS = ("right", "right and back", "back", "left and back", "left", "left and front", "front", "right and front")
LATEST = "It falls at the latest"  # the upper bound is proved of every way in which joints may slide
SURCHARGE = re.compile(r"a surcharge of (\S+) Pa (.*)")  # as a live load names it
NAMED = 2  # loaded stones that are named one by one
SLIGHT = 1e-3  # degrees; % of the weight: less than anybody measures
NONE = 1e-3  # of the last digit: no more than solvers and decimals leave
WORDS = {"stable": "Stands", "unstable": "Falls", "undecided": "Undecided"}


def towards(azimuth: float) -> str:
    """A direction on the ground, seen from the front: x to the right, y to the back.

    >>> towards(180.0), towards(-90.0), towards(30.0)
    ('towards the left', 'towards the front', 'towards azimuth 30')
    """
    way, off = divmod(azimuth % 360.0, 45.0)
    return f"towards azimuth {azimuth:g}" if off else f"towards the {WAYS[int(way)]}"


def rounded(value: float, up: bool, digits: int = 3) -> str:
    """A figure of a few digits, rounded to the side on which what is said of it stays true.

    >>> rounded(8.0812, True), rounded(8.0812, False), rounded(0.25, True)
    ('8.09', '8.08', '0.25')
    """
    if value == 0.0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits)
    whole = math.ceil(value / unit - NONE) if up else math.floor(value / unit + NONE)
    return f"{whole * unit:.12g}"


def force(newtons: float, up: bool, digits: int = 3) -> str:
    """A force, in the unit that suits it.

    >>> force(52949.6, True), force(12.0, False)
    ('53 kN', '12 N')
    """
    small = abs(newtons) < 1e3
    return f"{rounded(newtons / (1.0 if small else 1e3), up, digits)} {'N' if small else 'kN'}"


def amount(live: "Live", multiplier: float, up: bool, digits: int = 3) -> tuple[str, str]:
    """How much of what grows a multiplier is, with its unit, and what that is or where it acts."""
    if live.tilt is not None:
        return f"{rounded(math.degrees(math.atan(multiplier)), up, digits)} degrees", towards(live.tilt)
    if live.push is not None:
        x, y, z = live.push
        way = towards(math.degrees(math.atan2(y, x))) if z == 0.0 else f"along ({x:g}, {y:g}, {z:g})"
        return f"{rounded(100.0 * multiplier * math.hypot(x, y, z), up, digits)} % of its weight", way
    if live.words.startswith("1 kN "):
        return f"{rounded(multiplier, up, digits)} kN", live.words[5:]
    if (pressed := SURCHARGE.fullmatch(live.words)) is not None:
        pascals = multiplier * float(pressed[1])
        whole = f"{rounded(pascals / 1e3, up, digits)} kPa" if pascals >= 1e3 else f"{rounded(pascals, up, digits)} Pa"
        return whole, f"as a surcharge {pressed[2]}"
    if live.words:
        return f"{rounded(multiplier, up, digits)} times", live.words
    total = force(multiplier * math.fsum(math.hypot(*load.force) for load in live.loads), up, digits)
    blocks = sorted({load.block for load in live.loads})
    named = " and ".join(f"'{name}'" for name in blocks) if len(blocks) <= NAMED else f"{len(blocks)} stones"
    return total, f"{'in all ' * (len(blocks) > 1)}on {named}"


def none_to_spare(live: "Live", most: float) -> bool:
    """Whether the least tilt or push that anybody would measure brings it down."""
    if live.tilt is not None:
        return math.degrees(math.atan(most)) < SLIGHT
    return live.push is not None and 100.0 * most * math.hypot(*live.push) < SLIGHT


def answer(result: "Result") -> tuple[str, str]:
    """Whether a structure stands, in a word, and how far it is from falling, or why, in a sentence."""
    word, known = WORDS[result.verdict], result.undecided
    if known is not None:
        return word, known.why
    spare = result.margins if result.verdict == "stable" else None
    if spare is None or spare.tilt is None or spare.tilt.falls is None or spare.azimuth is None:
        return word, result.reason
    way = towards(spare.azimuth)
    falls = f"It would fall if the ground tilted by {rounded(spare.tilt.falls, up=True)} degrees {way}."
    if spare.tilt.falls < SLIGHT:
        falls = f"It would fall at the slightest tilt of the ground {way}."
    return word, falls if result.reason in BALANCED.values() else f"{result.reason} {falls}"


def limit_answer(result: "LimitResult") -> tuple[str, str]:
    """Up to which live load a structure stands, in a few words, and what that means, in a sentence."""
    if result.word != "limit" or result.upper is None or result.lower is None:
        word = {"unbounded": "No limit", "falls": "Falls as it is"}.get(result.word, "Undecided")
        return word, result.reason
    live, most = result.live, result.upper
    much, what = amount(live, most, up=True)
    if live.tilt is not None:
        if none_to_spare(live, most):
            return "Nothing to spare", f"It falls at the slightest tilt of the ground {what}."
        return much.replace(" degrees", "°"), f"{LATEST} when the ground tilts by {much} {what}."
    if live.push is not None:
        if none_to_spare(live, most):
            return "Nothing to spare", f"It falls at the slightest push {what}."
        return much, f"{LATEST} when it is pushed {what} with {much}."
    return much, f"{LATEST} under {much} {what}."
