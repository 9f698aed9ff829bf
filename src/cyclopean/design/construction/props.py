"""The fewest stones to hold while the structure does not stand by itself.

A prop is a block that is held fixed for the time being, as by centring under an arch. Which blocks to hold is a
hitting-set problem: a mechanism in which no held block moves goes on as before, so a set of props holds at least one
block of every mechanism. Mechanisms are first made small: all that need not move is held, block by block, until what
is left moves only as a whole; with those blocks held the next mechanism is looked for, and so on. As many mechanisms as
share no block, so many props are needed at least. From that number on sets are tried by size; each one that fails
leaves another mechanism behind, which rules out more. A set found so is a smallest one. The mechanisms that say so are
recomputed, in floating point, but not certified; the verdict with the props is. A mechanism is one of rigid-block
equilibrium, without which there is no coupled state; where coupled analysis refuses a set that balances, only that set
is ruled out.

Before that the props of the stage before are tried, alone and with the stone laid last: its state with them is known,
so that costs next to nothing, and no larger set need be looked at then. Rigid-block equilibrium is asked first of every
set, which takes hundredths of a second; a set that it lets pass and coupled analysis does not costs a search, so after
a few of those, too, the budget is spent. Then the set that works is taken; or, where there is none, blocks are held one
by one, the likeliest of each mechanism, beside the props of the stage before, and some of those that turn out to be
idle are let go again: a set that helps, not proved to be a smallest.
"""

import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

from cyclopean.analysis import Result, Settings, mobile
from cyclopean.design.construction.stages import Stage, verdict, with_props

__all__ = ["Props", "smallest_props"]

EXHAUSTIVE = 4  # blocks beyond the least number possible, up to which all sets are gone through
TRIALS = 60  # sets looked at for one stage
SHARE = 0.1  # of the seconds for one stage that the verdict on one set may take
BOUNDED = 0.2  # of those seconds for sets smaller than one that works
REFUSALS = 2  # sets that rigid-block equilibrium lets pass and coupled analysis does not: each takes a search
NODES = 20_000  # of the search for a set that hits all mechanisms


@dataclass(frozen=True, slots=True, eq=False)
class Props:
    """Blocks of the whole to hold at one stage, and the verdict with them."""

    blocks: tuple[int, ...]
    result: Result
    smallest: bool  # no smaller set would do; else only that none of these blocks can be left out


def smallest_props(
    stage: Stage,
    alone: Result,
    settings: Settings,
    preferred: Sequence[int],
    most: int = EXHAUSTIVE,
    before: tuple[Stage, Props] | None = None,
) -> Props | None:
    """Find the fewest blocks that, held fixed, make a stage stand.

    Parameters
    ----------
    stage : Stage
        One that does not stand by itself.
    alone : Result
        Its verdict without props.
    settings : Settings
        Of the verdicts.
    preferred : sequence of int
        Free blocks of the stage; of several smallest sets the one with the earliest of these is taken.
    most : int
        How many blocks beyond the least number possible all sets are gone through for.
    before : Stage and Props, optional
        The stage before, as it was with its props held.

    Returns
    -------
    Props or None
        None where not even holding every block was proved to help.
    """
    search = _Search(stage, alone, settings, preferred, before)
    least = search.seeded()
    usual = search.usual(before[1].blocks) if before is not None else None
    largest = min(least + most, len(preferred)) if usual is None else min(least + most, len(usual.blocks) - 1)
    for size in range(max(1, least), largest + 1):
        if found := search.of_size(size):
            return found
        if search.spent:
            break
    if usual is None:
        return search.greedy(() if before is None else before[1].blocks)
    return replace(usual, smallest=search.proved and largest == len(usual.blocks) - 1 and not search.spent)


class _Search:
    """Mechanisms met so far, and how much has been spent."""

    def __init__(
        self,
        stage: Stage,
        alone: Result,
        settings: Settings,
        preferred: Sequence[int],
        before: tuple[Stage, Props] | None = None,
    ) -> None:
        self.stage, self.settings = stage, replace(settings, seconds=SHARE * settings.seconds)
        self.known = None if before is None else (with_props(before[0], before[1].blocks), before[1].result)
        self.place = {block: k for k, block in enumerate(preferred)}
        self.mechanisms: list[list[int]] = []
        self.tried: set[frozenset[int]] = set()
        self.trials, self.nodes, self.refusals = 0, 0, 0
        self.began = time.perf_counter()
        self.until = self.began + settings.seconds
        self.proved = alone.verdict == "unstable"

    @property
    def spent(self) -> bool:
        """Whether sets are no longer gone through."""
        over = self.trials >= TRIALS or self.nodes >= NODES or self.refusals >= REFUSALS
        return over or time.perf_counter() > self.until

    def seeded(self) -> int:
        """Find mechanisms that share no block, and count them."""
        held: set[int] = set()
        while (mobile := self.mechanism(held)) is not None:
            held.update(mobile)
        return len(self.mechanisms)

    def usual(self, held: Sequence[int]) -> Props | None:
        """The props of the stage before, or these and the stone laid last, less those that can be let go."""
        latest = [block for block in self.place if block not in held][:1]
        for props in ([*held], [*held, *latest]):
            if result := self.works(props):
                self.until = time.perf_counter() + BOUNDED * (self.until - self.began)
                return self.lean(props, result)
        return None

    def of_size(self, size: int) -> Props | None:
        """The first set of so many blocks that works."""
        for props in self.hitting((), size):
            if result := self.works(props):
                return Props(tuple(sorted(props)), result, self.proved)
            if self.spent:
                break
        return None

    def hitting(self, props: tuple[int, ...], room: int) -> Iterator[tuple[int, ...]]:
        """Sets of `room` more blocks, each once, that hold one of every mechanism known when they are asked for."""
        self.nodes += 1
        missed = sorted((m for m in self.mechanisms if not set(m) & set(props)), key=len)
        if not room:
            if not missed and frozenset(props) not in self.tried:
                self.tried.add(frozenset(props))
                yield props
            return
        if _apart(missed) > room:
            return
        for block in missed[0] if missed else list(self.place):
            if self.nodes >= NODES:
                return
            if block not in props:
                yield from self.hitting((*props, block), room - 1)

    def works(self, props: Sequence[int]) -> Result | None:
        """The verdict with these props, if it is that the stage stands."""
        self.trials += 1
        if self.mechanism(props) is not None:
            return None
        propped = with_props(self.stage, props)
        result = verdict(propped, self.settings, self.known)
        if result.verdict == "stable":
            if self.known is None:
                self.known = propped, result
            return result
        self.refusals += 1
        self.proved = self.proved and result.verdict == "unstable"
        return None

    def mechanism(self, props: Collection[int]) -> list[int] | None:
        """A least set of blocks that moves with these props, which is remembered; None where nothing moves."""
        mobile = self.mobile(props)
        if mobile is None:
            return None
        for block in sorted(mobile, key=self.place.__getitem__, reverse=True):
            if block in mobile and len(mobile) > 1:
                mobile = self.mobile(self.place.keys() - mobile | {block}) or mobile
        self.mechanisms.append(sorted(mobile, key=self.place.__getitem__))
        return self.mechanisms[-1]

    def mobile(self, props: Collection[int]) -> set[int] | None:
        """Blocks that a mechanism moves while these are held; None where there is none."""
        stage = with_props(self.stage, tuple(props))
        found = mobile(stage.model, self.settings)
        return None if found is None else set(stage.block[found].tolist())

    def greedy(self, begun: Sequence[int] = ()) -> Props | None:
        """Hold one block of each mechanism more until the rest stands, then let go what need not be held."""
        held = list(begun)
        result = None
        self.until = late = self.until + (self.until - self.began)
        while result is None and len(held) < len(self.place):
            if time.perf_counter() > late:
                held = list(self.place)
            else:
                mobile = self.mechanism(held)
                held.append(next(b for b in mobile or self.place if b not in held))
            result = self.works(held)
        if result is None:
            return None
        self.refusals = 0
        return self.lean(held, result)

    def lean(self, held: list[int], result: Result) -> Props:
        """Let go, one after the other, what need not be held."""
        for block in list(held):
            fewer = [other for other in held if other != block]
            if fewer and not self.spent and (less := self.works(fewer)):
                held, result = fewer, less
        return Props(tuple(sorted(held)), result, False)


def _apart(mechanisms: Sequence[Sequence[int]]) -> int:
    """At least how many blocks it takes to hold one of each: sets that share no block, picked one after the other."""
    used: set[int] = set()
    count = 0
    for mechanism in mechanisms:
        if not used & set(mechanism):
            used.update(mechanism)
            count += 1
    return count
