"""An order of building that somebody gives: what is wrong with it, and the valid order nearest to it.

An order is *valid* if every stone is laid after all that it rests on, and has a way in at its turn (see `blocking`).
A *move* takes one stone out of the list and puts it elsewhere: so the fewest moves are the stones less as many as can
stay in the given order.

Some stones S can stay if no one of them has to come before another that is given before it. Pairs u, v with v below u
(through any number of stones) and u given before v are themselves an order, the intersection of two: u above v. S is a
set of stones no two of which it compares, an antichain, and a largest one is as large as the fewest chains that cover
all stones ([Dilworth]_); these come of a largest matching of the pairs, S of the vertex cover that goes with it
([Koenig]_). So that is exact, for any number of stones.

A stone b that is trapped by some others at its turn has to come before one of them: each is tried (branch and bound,
the fewest moves first), which is exact as well as long as the budget lasts. Where it does not, the order is that of
taking the structure apart, as near to the given one as that comes, and the moves have a lower bound.

By hand: a, b, c on each other, given c, b, a: of the pairs (b, c), (a, c), (a, b) any two stones compare, so one can
stay, and two move.

>>> chain = [set(), {0}, {0, 1}]
>>> sorted(stays([2, 1, 0], chain)), sorted(stays([0, 2, 1], chain))
([0], [0, 1])

References
----------
.. [Dilworth] Dilworth: A decomposition theorem for partially ordered sets. Annals of Mathematics 51 (1950).
.. [Koenig] Koenig: Graphs and matrices. Matematikai es Fizikai Lapok 38 (1931).
"""

import heapq
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.design.construction.ordering import laid
from cyclopean.errors import InputError

__all__ = ["Fault", "Nearest", "faults_of", "nearest_order", "numbers_of", "stays"]

CASES = 200  # of the branch and bound, each a matching; most orders need one
SHOWN = 3  # ids that a refusal names


@dataclass(frozen=True, slots=True)
class Fault:
    """A stone that a given order lays too early, or too late."""

    step: int  # from 0
    block: int
    missing: tuple[int, ...]  # what it rests on and is not there yet
    trapped_by: tuple[int, ...]  # or what leaves it no way in


@dataclass(frozen=True, slots=True)
class Nearest:
    """The valid order nearest to a given one."""

    order: tuple[int, ...]
    moved: tuple[int, ...]  # blocks, in the order found; the others stay in the given order
    least: int  # no valid order is nearer than that many moves


Trap = Callable[
    [int, Collection[int]], tuple[int, ...]
]  # the standing blocks that trap one together; () where it is free


def numbers_of(given: Sequence[str | int], ids: Sequence[str], fixed: Sequence[bool]) -> tuple[int, ...]:
    """Numbers of the free blocks of an order, of ids or numbers; supports that it names, which stand already, left out.

    Raises
    ------
    InputError
        The order names a block that is not there, names one twice, or leaves one out.
    """
    place = {name: k for k, name in enumerate(ids)}
    found: list[int] = []
    unknown = []
    for one in given:
        number = place.get(one) if isinstance(one, str) else int(one)
        if number is None or not 0 <= number < len(ids):
            unknown.append(str(one))
        else:
            found.append(number)
    if unknown:
        raise InputError.of("order", None, f"{_named(unknown)} not in the model; take out or correct")
    found = [k for k in found if not fixed[k]]
    counts = np.bincount(found, minlength=len(ids)) if found else np.zeros(len(ids), int)
    if twice := [ids[k] for k in np.flatnonzero(counts > 1).tolist()]:
        raise InputError.of("order", None, f"{_named(twice)} named more than once; a stone is laid once")
    if missing := [ids[k] for k in np.flatnonzero((counts == 0) & ~np.asarray(fixed, bool)).tolist()]:
        raise InputError.of("order", None, f"{_named(missing)} missing; an order names every stone that is laid")
    return tuple(found)


def _named(names: Sequence[str]) -> str:
    """`blocks 'a', 'b' and 3 more are`."""
    shown = ", ".join(f"'{name}'" for name in names[:SHOWN])
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return f"block{'s' * (len(names) > 1)} {shown}{more} {'are' if len(names) > 1 else 'is'}"


def faults_of(
    order: Sequence[int], below: Sequence[Collection[int]], fixed: Collection[int], trap: Trap
) -> list[Fault]:
    """Stones laid too early, or too late for a way in; what traps a stone in any order is no fault of this one.

    Parameters
    ----------
    order : sequence of int
        All free blocks.
    below : sequence of collections
        What each block rests on, without rings.
    fixed : collection of int
        Supports.
    trap : callable
        Which standing blocks trap a block.
    """
    before, standing, found = _closed(order, below, fixed), set(fixed), []
    for step, block in enumerate(order):
        missing = tuple(sorted(set(below[block]) - standing))
        trapping = trap(block, standing)
        if missing or not before[block].union(fixed).issuperset(trapping):
            found.append(Fault(step, block, missing, trapping))
        standing.add(block)
    return found


def nearest_order(
    given: Sequence[int],
    below: Sequence[Collection[int]],
    fixed: Collection[int],
    trap: Trap,
    usual: Callable[[], Sequence[int]],
) -> Nearest:
    """Find the valid order nearest to a given one.

    Parameters
    ----------
    given : sequence of int
        All free blocks.
    below : sequence of collections
        What each block rests on, without rings.
    fixed : collection of int
        Supports.
    trap : callable
        Which standing blocks trap a block.
    usual : callable
        A valid order to fall back on.
    """
    first = _closed(given, below, fixed)
    kept = stays(given, first)
    cases = [(len(given) - len(kept), 0, first, kept)]
    count = 0
    while cases and count < CASES:
        moves, _, before, kept = heapq.heappop(cases)
        order = laid(given, before, kept)
        choice = _trapped(order, first, fixed, trap)
        if choice is None:
            return Nearest(tuple(order), tuple(b for b in order if b not in kept), moves)
        block, others = choice
        for other in others:
            if other in before[block]:
                continue  # it has to be there before
            count += 1
            sooner = before[block] | {block}  # than the other, and than what comes after that
            more = [mine | sooner if one == other or other in mine else mine for one, mine in enumerate(before)]
            kept = stays(given, more)
            heapq.heappush(cases, (len(given) - len(kept), count, more, kept))
    least = cases[0][0] if cases else 1
    order = list(usual())
    earlier = [set[int]() for _ in below]
    for k, block in enumerate(order):
        earlier[block] = set(order[:k])
    kept = stays(given, earlier)
    return Nearest(tuple(order), tuple(b for b in order if b not in kept), min(least, len(order) - len(kept)))


def stays(given: Sequence[int], before: Sequence[Collection[int]]) -> set[int]:
    """As many blocks as can stay in the given order; `before` says of each what has to come before it, all of that."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import maximum_bipartite_matching

    place = {block: k for k, block in enumerate(given)}
    n = len(given)
    after = [[place[other] for other in before[block] if place.get(other, -1) > k] for k, block in enumerate(given)]
    if not any(after):
        return set(given)
    start = np.cumsum([0, *map(len, after)])
    index = np.array([k for row in after for k in row], np.int32)
    pairs = csr_array((np.ones(len(index), np.int8), index, start), shape=(n, n))
    right = np.asarray(maximum_bipartite_matching(pairs, perm_type="column"))  # of each left one its partner
    left = np.full(n, -1)
    left[right[right >= 0]] = np.flatnonzero(right >= 0)
    reached, there = right < 0, np.zeros(n, bool)  # by ways that take a pair, then a matched pair back
    pending = np.flatnonzero(reached).tolist()
    while pending:
        for k in after[pending.pop()]:
            if not there[k]:
                there[k] = True
                if left[k] >= 0 and not reached[left[k]]:
                    reached[left[k]] = True
                    pending.append(int(left[k]))
    return {given[k] for k in np.flatnonzero(reached & ~there).tolist()}


def _closed(given: Sequence[int], below: Sequence[Collection[int]], fixed: Collection[int]) -> list[set[int]]:
    """Of every block all that has to be laid before it, through any number of others."""
    held, found = set(fixed), [set[int]() for _ in below]
    direct = [set(others) - held for others in below]
    for block in laid(given, direct):
        for other in direct[block]:
            found[block] |= found[other] | {other}
    return found


def _trapped(
    order: Sequence[int], first: Sequence[Collection[int]], fixed: Collection[int], trap: Trap
) -> tuple[int, list[int]] | None:
    """The first stone that has no way in, and those that could come later; those trapped in any order pass."""
    standing = set(fixed)
    for block in order:
        others = [one for one in trap(block, standing) if one not in fixed and one not in first[block]]
        if others:
            return block, others
        standing.add(block)
    return None
