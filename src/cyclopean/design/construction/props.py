"""Which stones to hold, and until when, while a structure does not stand by itself.

A prop is a block that is held fixed for the time being. It stays until the stones that have come since make do without
it. Stages that do not stand follow on each other in *episodes*, before and after which nothing is held, so each is
looked at by itself.

How few stones have to be held in an episode is a hitting-set problem: a mechanism of any of its stages in which no held
block moves goes on as before, so the held blocks are at least one of every mechanism. Mechanisms are made small first:
all that need not move is held, block by block, until what is left moves only as a whole. A smallest set that holds one
of each is found (by branch and bound), the stages are asked for mechanisms that it leaves, and so on, until none is
left (implicit hitting set, [Karp]_). What is held at a stage then is what of that set has been laid. No set is smaller:
that rests on mechanisms recomputed in floating point, but not certified, and is a lower bound even where the search was
cut short. A mechanism is one of rigid-block equilibrium, without which there is no coupled state.

Then every stage is certified with what is held. Where coupled analysis finds no state although nothing moves, the
stone laid last is held as well, then all that hang over, then everything. At last, from the end back, what a stage is
proved to stand without is let go there: struts one by one, a centring as a whole.

References
----------
.. [Karp] Moreno-Centeno, Karp: The implicit hitting set approach to solve combinatorial optimization problems with an
   application to multigenome alignment. Operations Research 61 (2013).
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cyclopean.analysis import PreparedModel, Result, Settings, Word, mobile
from cyclopean.design.construction.blocking import neighbours
from cyclopean.design.construction.stages import Stage, stage_at, verdict, with_props
from cyclopean.proof import Memory, verify

__all__ = ["Held", "fewest", "held_through"]

EFFORT = 0.2  # of a stage's search: for a set that leaves no mechanism, but leads to no coupled state at once
CASES = 40  # of the refuting search that a set gets one
LOOKS = 120_000  # contact points of all stages that are asked for mechanisms: some seconds
BRANCHES = 10_000  # of the search for a smallest set


@dataclass(frozen=True, slots=True)
class Held:
    """What is held in an episode."""

    first: int  # number of its first stage, from 0
    blocks: tuple[tuple[int, ...], ...]  # of the whole, at each of its stages
    words: tuple[Word, ...]  # verdicts with them
    least: int  # so many stones have to be held at some time, at least

    @property
    def count(self) -> int:
        """How many stones are held; one that is held a second time counts twice."""
        pairs = zip(((), *self.blocks), self.blocks, strict=False)
        return sum(len(set(now) - set(before)) for before, now in pairs)


def held_through(
    whole: PreparedModel, settings: Settings, order: Sequence[int], run: range, hanging: Collection[int]
) -> Held:
    """Find the fewest blocks that, held fixed, make every stage of an episode stand.

    Parameters
    ----------
    whole : PreparedModel
        The finished structure.
    settings : Settings
        Of the verdicts.
    order : sequence of int
        Blocks, the first to be laid first.
    run : range
        Numbers of the stages, from 0; none of them stands by itself.
    hanging : collection of int
        Blocks that a centring would carry.
    """
    return _Episode(whole, settings, order, run, hanging).found()


def fewest(
    mechanisms: Sequence[Collection[int]], chosen: Collection[int], age: Sequence[int]
) -> tuple[frozenset[int], int]:
    """A smallest set with one block at least of every mechanism, and how many any such set has at least.

    Of several smallest ones that which has most of the blocks `chosen` before, then that of the latest: `age` says of
    every block how long ago it was laid.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp

    blocks = sorted(set().union(*mechanisms))
    if not blocks:
        return frozenset(), 0
    place, n = {block: k for k, block in enumerate(blocks)}, len(blocks)
    rows = np.zeros((len(mechanisms), n))
    for row, mechanism in zip(rows, mechanisms, strict=True):
        row[[place[block] for block in mechanism]] = 1.0
    oldest = max(1, *(age[block] for block in blocks))
    new = np.array([block not in chosen for block in blocks])
    late = np.array([age[block] / oldest for block in blocks])
    cost = 1.0 + (new + late / (2.0 * n)) / (4.0 * n)  # all that is added comes to less than one block
    answer = milp(
        cost,
        integrality=np.ones(n),
        bounds=Bounds(0, 1),
        constraints=LinearConstraint(rows, lb=1.0),
        options={"node_limit": BRANCHES, "mip_rel_gap": 0.0},
    )
    if answer.x is None:
        return frozenset(next(iter(m)) for m in mechanisms) | frozenset(chosen), 1
    found = frozenset(block for block, x in zip(blocks, answer.x, strict=True) if x > 0.5)
    bound = len(found) if answer.status == 0 else math.ceil(answer.mip_dual_bound - 0.5)
    return found, max(1, bound)


class _Episode:
    """Stages that do not stand, the mechanisms met, and how much has been looked at."""

    def __init__(
        self,
        whole: PreparedModel,
        settings: Settings,
        order: Sequence[int],
        run: range,
        hanging: Collection[int],
    ) -> None:
        self.whole, self.order, self.run, self.hanging = whole, order, run, hanging
        self.settings = replace(settings, effort=EFFORT * settings.effort, nodes=min(settings.nodes, CASES))
        self.judge = partial(verify, memory=Memory())
        self.age = [len(order)] * len(whole.assembly)
        for number, block in enumerate(order):
            self.age[block] = len(order) - number
        self.beside = [set(one.block.tolist()) for one in neighbours(whole.contacts, len(whole.assembly))]
        self.mechanisms: list[list[int]] = []
        self.looks = 0
        self.known: tuple[Stage, Result] | None = None

    def found(self) -> Held:
        """Every stage with what is held at it."""
        chosen, least = self.bounded()
        held = chosen & set(self.order[: self.run.start])
        rows: dict[int, frozenset[int]] = {}
        words: list[Word] = []
        for number in self.run:
            held, word = self.certified(number, held | (chosen & {self.order[number]}))
            rows[number] = held
            words.append(word)
        self.let_go(rows)
        blocks = (tuple(block for block in self.order if block in rows[number]) for number in self.run)
        return Held(self.run.start, tuple(blocks), tuple(words), least)

    def bounded(self) -> tuple[frozenset[int], int]:
        """Blocks that leave no mechanism in any stage, if the search ends; and how few there can be."""
        chosen, least = frozenset[int](), 1
        again = True
        while again:
            again = False
            for number in self.run:
                while (mechanism := self.mechanism(number, chosen)) is not None:
                    self.mechanisms.append(mechanism)
                    found, least = fewest(self.mechanisms, chosen, self.age)
                    again = again or not found >= chosen
                    chosen = found
                    if self.looks > LOOKS:
                        return chosen, least
        return chosen, least

    def mechanism(self, number: int, held: Collection[int]) -> list[int] | None:
        """A least set of blocks that moves at a stage with these held; None where nothing moves."""
        stage = stage_at(self.whole, self.order, number)
        moving = self.moving(stage, held)
        if moving is None:
            return None
        laid = self.order[: number + 1]
        if laid[-1] in moving and len(moving) > 1 and self.moving(stage, set(laid) - {laid[-1]}):
            return [laid[-1]]
        for block in sorted(moving, key=self.age.__getitem__, reverse=True):  # the oldest is held first
            if block in moving and len(moving) > 1 and self.looks <= LOOKS:
                moving = self.moving(stage, set(laid) - moving | {block}) or moving
        return sorted(moving)

    def moving(self, stage: Stage, held: Collection[int]) -> set[int] | None:
        """Blocks that a mechanism moves while these are held; None where there is none."""
        propped = with_props(stage, tuple(held))
        self.looks += len(stage.point) + 1
        found = mobile(propped.model, self.settings)
        return None if found is None else set(stage.block[found].tolist())

    def certified(self, number: int, held: frozenset[int]) -> tuple[frozenset[int], Word]:
        """What is held at a stage, and the verdict with it: as it is, or with more."""
        laid = self.order[: number + 1]
        stage = stage_at(self.whole, self.order, number)
        hang = frozenset(self.hanging) & set(laid)
        for more in dict.fromkeys((held, held | {laid[-1]}, held | hang | {laid[-1]}, frozenset(laid))):
            if more and self.stands(stage, more):
                return more, "stable"
        return frozenset(laid), "undecided"

    def let_go(self, rows: dict[int, frozenset[int]]) -> None:
        """From the last stage back, what a stage is proved to stand without: struts one by one, centrings whole."""
        left = frozenset[int]().union(*rows.values())
        while left:
            prop = self.together(max(left, key=lambda block: (self.age[block], block)), left)
            left -= prop
            for number in reversed(self.run):
                held, less = rows[number], rows[number] - prop
                if held == less:
                    continue
                stage = stage_at(self.whole, self.order, number)
                if not less or self.moving(stage, less) is not None or not self.stands(stage, less):
                    break
                rows[number] = less

    def together(self, block: int, held: frozenset[int]) -> set[int]:
        """A held stone, with those of the same centring that it hangs together with."""
        found, pending = {block}, [block] if block in self.hanging else []
        while pending:
            for other in self.beside[pending.pop()] & held - found:
                if other in self.hanging:
                    found.add(other)
                    pending.append(other)
        return found

    def stands(self, stage: Stage, held: Collection[int]) -> bool:
        """Whether a stage is proved to stand while these are held."""
        propped = with_props(stage, tuple(held))
        result = verdict(propped, self.settings, self.known, self.judge)
        if result.verdict == "stable":
            self.known = propped, result
        return result.verdict == "stable"
