"""The first line of an answer: what a mason or an engineer wants to know, in everyday words and units.

What is proved is said, and no more: a mechanism by rigid-block equilibrium proves that a structure falls, whichever way
the joints slide, so that "falls" is said of the upper bound of a limit or a margin, rounded up.
"""

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cyclopean.analysis.limit_analysis.result import LimitResult
    from cyclopean.analysis.verdict import Result

__all__ = ["BALANCED", "answer", "force", "limit_answer", "rounded", "towards"]

BALANCED = {  # why a structure stands where nothing else is to be said, by method
    "rbe": "Compression and friction at the contacts can balance every load on every block.",
    "cra": "Forces that a virtual motion of the blocks produces, pressing and rubbing, balance every load.",
}
WAYS = ("right", "right and back", "back", "left and back", "left", "left and front", "front", "right and front")
LATEST = "It falls at the latest"  # the upper bound is proved of every way in which joints may slide
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


def rounded(value: float, up: bool) -> str:
    """A figure of three digits, rounded to the side on which what is said of it stays true.

    >>> rounded(8.0812, True), rounded(8.0812, False), rounded(0.25, True)
    ('8.09', '8.08', '0.25')
    """
    if value == 0.0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
    whole = math.ceil(value / unit - NONE) if up else math.floor(value / unit + NONE)
    return f"{whole * unit:.12g}"


def force(newtons: float, up: bool) -> str:
    """A force, in the unit that suits it.

    >>> force(52949.6, True), force(12.0, False)
    ('53 kN', '12 N')
    """
    return f"{rounded(newtons / 1e3, up)} kN" if newtons >= 1e3 else f"{rounded(newtons, up)} N"


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
    if live.tilt is not None:
        degrees, way = math.degrees(math.atan(most)), towards(live.tilt)
        if degrees < SLIGHT:
            return "Nothing to spare", f"It falls at the slightest tilt of the ground {way}."
        angle = rounded(degrees, up=True)
        return f"{angle}°", f"{LATEST} when the ground tilts by {angle} degrees {way}."
    if live.push is not None:
        x, y, z = live.push
        way = towards(math.degrees(math.atan2(y, x))) if z == 0.0 else f"along ({x:g}, {y:g}, {z:g})"
        percent = 100.0 * most * math.hypot(x, y, z)
        if percent < SLIGHT:
            return "Nothing to spare", f"It falls at the slightest push {way}."
        share = rounded(percent, up=True)
        return f"{share} % of its weight", f"{LATEST} when it is pushed {way} with {share} % of its weight."
    if live.words:
        often = rounded(most, up=True)
        total = f"{often} {live.words[2:]}" if live.words.startswith("1 kN ") else f"{often} times {live.words}"
        return total.partition(" on ")[0], f"{LATEST} under {total}."
    total = force(most * math.fsum(math.hypot(*load.force) for load in live.loads), up=True)
    blocks = sorted({load.block for load in live.loads})
    where = f"on '{blocks[0]}'" if len(blocks) == 1 else f"in all on {len(blocks)} stones"
    return total, f"{LATEST} under {total} {where}."
