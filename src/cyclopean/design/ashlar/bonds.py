"""Bonds: where the head joints of each course lie.

Lengths count from the middle of one joint to the middle of the next, so a wall of n stones of length l with joints of
width j is n (l + j) long, half a joint of which lies beyond either end. U is the length of a stone, H the width of a
header on the face, both with one joint. Course 0 is the lowest.

running   stretchers; odd courses begin with a part of one (`stagger`, usually a half)
stack     stretchers, joint over joint: no bond at all, for comparison
third     stretchers; course k begins with 1, 1/3, 2/3 of one, in turn
english   courses of stretchers and courses of headers in turn; a course of headers has a queen closer, half as wide as
          a header, beside the header at either end
flemish   stretchers and headers in turn in every course, headers over the middles of stretchers; odd courses begin with
          a header and a queen closer, (U - H) / 2 wide

By hand, for U = 2 and H = 1: the stretchers of a course of English bond meet at 2, 4, 6; the headers above them at 1,
1.5, 2.5, 3.5 ..., half a header from the nearest of those.

>>> [span.low for span in course_spans("english", 1, 6.0, 2.0, 1.0)]
[0.0, 1.0, 1.5, 2.5, 3.5, 4.5, 5.0]
>>> [(span.low, span.kind) for span in course_spans("flemish", 1, 5.0, 2.0, 1.0)]
[(0.0, 'header'), (1.0, 'closer'), (1.5, 'stretcher'), (3.5, 'closer'), (4.0, 'header')]
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count, cycle
from typing import Literal

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.ashlar.stock import SAME
from cyclopean.design.options import one_of

__all__ = ["TWO_LEAVES", "Bond", "Kind", "Span", "best_joint", "clipped", "course_spans", "lap_of", "relieved", "tied"]

TWO_LEAVES = ("english", "flemish")  # bonds whose stretchers lie two deep, tied by headers
LAP = 0.2  # of the length of a stone: nearer to a joint below than this, a joint counts as aligned

Bond = Literal["running", "stack", "third", "english", "flemish"]
Kind = Literal["stretcher", "header", "closer", "through", "lintel"]


@dataclass(frozen=True, slots=True)
class Span:
    """A part of a course that one stone shall fill, from joint to joint (m)."""

    low: float
    high: float
    kind: Kind
    number: int = 0  # counted from the left end of the wall
    across: bool = False  # reaches through the wall, as headers do

    @property
    def length(self) -> float:
        """m, with one joint."""
        return self.high - self.low


def course_spans(
    bond: str, course: int, length: float, unit: float, header: float, stagger: float = 0.5
) -> tuple[Span, ...]:
    """Divide one whole course.

    Parameters
    ----------
    bond : str
        One of `Bond`.
    course : int
        0 = the lowest.
    length : float
        m, of the wall with one joint.
    unit : float
        U, m.
    header : float
        H, m.
    stagger : float
        Running bond: share of a stone with which odd courses begin; 0 = whole.

    Returns
    -------
    tuple of Span
        From the left end to the right one. What is left over at the right end is a closer; where a header comes
        before it, the two change places, so that the end of the wall is a header.

    Raises
    ------
    InputError
        Unknown bond.
    """
    one_of("bond", bond, Bond)
    spans: list[Span] = []
    low = 0.0
    for number, (size, kind, across) in enumerate(_pattern(bond, course, unit, header, stagger)):
        high = round(min(low + size, length), 9)
        if length - high < SAME:
            high = length
        spans.append(Span(low, high, kind if high - low >= size - SAME else "closer", number, across))
        low = high
        if high == length:
            break
    if len(spans) > 1 and spans[-1].kind == "closer" and spans[-2].kind == "header":
        before, last = spans[-2:]
        if last.length >= header / 2.0 - SAME:
            middle = round(length - before.length, 9)
            through = last.length <= header + SAME
            spans[-2] = Span(before.low, middle, "closer", before.number, through)
            spans[-1] = replace(before, low=middle, high=length, number=last.number)
    return tuple(spans)


def tied(spans: Sequence[Span], every: int, first: int, header: float | None) -> tuple[Span, ...]:
    """Put through-stones into a course of stretchers.

    Parameters
    ----------
    spans : sequence of Span
    every : int
        One for so many stretchers.
    first : int
        Number of the first one, counted from the end of the wall.
    header : float, optional
        Width of a through-stone on the face (m), if it is not as long as a stretcher. It then takes the middle of
        two stretchers, which are shortened by half of it each.
    """
    done = list(spans)
    for k, span in enumerate(spans):
        if span.kind != "stretcher" or span.number % every != first:
            continue
        if header is None:
            done[k] = replace(span, kind="through", across=True)
        elif k + 1 < len(spans) and spans[k + 1].kind == "stretcher":
            a, b = (round(span.high + side * header / 2.0, 9) for side in (-1.0, 1.0))
            done[k] = replace(span, high=a, kind="closer")
            done[k + 1] = replace(spans[k + 1], low=b, kind="closer")
            done.append(Span(a, b, "through", span.number, True))
    return tuple(sorted(done, key=lambda s: s.low))


def _pattern(bond: str, course: int, unit: float, header: float, stagger: float) -> Iterator[tuple[float, Kind, bool]]:
    """Lengths of stones from the left end on, without end: length, kind, whether through the wall."""
    odd = course % 2 == 1
    queen = (unit - header) / 2.0
    if bond == "english" and odd:
        yield from ((header, "header", True), (header / 2.0, "closer", True))
        yield from ((header, "header", True) for _ in count())
    elif bond == "flemish":
        if odd:
            yield from ((header, "header", True), (queen, "closer", True))
        yield from cycle(((unit, "stretcher", False), (header, "header", True)))
    else:
        share = {"running": stagger if odd else 0.0, "third": (0.0, 1.0 / 3.0, 2.0 / 3.0)[course % 3]}.get(bond, 0.0)
        if share > 0.0:
            yield share * unit, "closer", False
        yield from ((unit, "stretcher", False) for _ in count())


def lap_of(bond: str, unit: float, stagger: float = 0.5) -> float:
    """How near to a joint below (m) a joint of this bond may come; 0 where joints are meant to be aligned."""
    if bond == "stack":
        return 0.0
    if bond == "running":
        return min(LAP, 0.99 * stagger, 0.99 * (1.0 - stagger)) * unit
    return LAP * unit


def clipped(spans: Sequence[Span], low: float, high: float, least: float) -> tuple[Span, ...]:
    """What of a course lies between two places (m), as between the end of the wall and the jamb of a door.

    Stones that are cut by an end become closers; one that would be shorter than `least` is shared with its neighbour.
    """
    inside = []
    for span in spans:
        a, b = max(span.low, low), min(span.high, high)
        if b - a > SAME:
            whole = b - a >= span.length - SAME
            inside.append(replace(span, low=a, high=b, kind=span.kind if whole else "closer"))
    for at, other in ((0, 1), (-1, -2)):
        if len(inside) > 1 and inside[at].length < least - SAME:
            _share(inside, at, other)
    return tuple(inside)


def _share(spans: list[Span], at: int, other: int) -> None:
    """Divide a stone that is too short and its neighbour into two alike."""
    one, two = sorted((spans[at], spans[other]), key=lambda s: s.low)
    middle = round((one.low + two.high) / 2.0, 9)
    across = spans[other].across
    one = replace(one, high=middle, kind="closer", across=across)
    two = replace(two, low=middle, kind="closer", across=across)
    spans[at], spans[other] = (one, two) if at == 0 else (two, one)


def relieved(
    spans: Sequence[Span], below: Floats, lap: float, least: float, unit: float, header: float
) -> tuple[Span, ...]:
    """Move joints that come too near to those of the course below, as far away as the stones' length allows.

    Parameters
    ----------
    spans : sequence of Span
    below : (k,) float
        Joints of the course below (m).
    lap : float
        m that a joint must keep from them.
    least : float
        Shortest stone (m).
    unit, header : float
        Longest stretcher and widest header (m).
    """
    moved = list(spans)
    for k in range(len(moved) - 1):
        here, after = moved[k], moved[k + 1]
        joint = here.high
        if _distance(joint, below) >= lap - SAME or "through" in (here.kind, after.kind):
            continue
        most = header if here.across or after.across else unit
        low = max(here.low + least, after.high - most)
        high = min(here.low + most, after.high - least)
        better = best_joint(low, high, below, joint)
        if better is not None and _distance(better, below) > _distance(joint, below) + SAME:
            moved[k] = replace(here, high=better, kind="closer")
            moved[k + 1] = replace(after, low=better, kind="closer")
    return tuple(moved)


def best_joint(low: float, high: float, below: Floats, near: float) -> float | None:
    """The place between `low` and `high` (m) that is farthest from the joints below; of several, that nearest to
    `near`. None where there is no such place.
    """
    if high < low - SAME:
        return None
    known = np.sort(below)
    middles = (known[1:] + known[:-1]) / 2.0
    tried = np.concatenate([[low, max(low, high), min(max(near, low), max(low, high))], middles])
    tried = tried[(tried >= low - SAME) & (tried <= high + SAME)].round(9)
    far = np.array([min(_distance(x, below), 1e9) for x in tried.tolist()])
    best = np.lexsort((tried, np.abs(tried - near).round(9), -far.round(9)))[0]
    return float(tried[best])


def _distance(joint: float, below: Floats) -> float:
    return float(np.abs(below - joint).min(initial=np.inf))
