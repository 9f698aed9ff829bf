"""How a structure is built: the order, what each stone rests on, how it comes in, and whether every stage stands.

One sequencer for walls and for anything else: all of it follows from the joints. See `ordering` for the dependency
graph, its layers and its cycles, `blocking` for the way in, `given` for an order that somebody gives, `stages` for the
verdicts, `props` and `centring` for what is held meanwhile, `yard` for frames.
"""

import time
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np

from cyclopean.analysis import PreparedModel, Result, Settings, Word, prepare
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Contacts
from cyclopean.design.construction.blocking import Neighbours, blockers, insertion, neighbours
from cyclopean.design.construction.centring import Prop, hanging, named_props
from cyclopean.design.construction.colouring import colouring
from cyclopean.design.construction.given import Fault, Nearest, faults_of, nearest_order, numbers_of
from cyclopean.design.construction.options import SequenceOptions
from cyclopean.design.construction.ordering import (
    LEAN,
    SupportGraph,
    along_and_across,
    layers,
    support_graph,
    take_apart,
    upwards,
)
from cyclopean.design.construction.props import Held, held_through
from cyclopean.design.construction.stages import RUN, Judged, judged_run
from cyclopean.design.construction.yard import Frames, frames_of, yard_places
from cyclopean.representation import one_line

__all__ = ["BuildSequence", "GivenOrder", "Step", "build_sequence", "dot_text"]

SECONDS = 30.0  # for the coupled search of one stage: it stops by the work it has done, long before
EFFORT = 0.08  # of a usual search: there are many stages
FEW, SHORT = 4, 10  # runs at least, so that several processes have something to do, unless they would be that short
CLEARANCE = 0.1  # m, of approach and retreat


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One stone is laid; the verdict is of everything that stands then."""

    block: int
    layer: int
    rests_on: tuple[int, ...]  # broken edges included
    free: Floats | None  # (3,) unit: it can be taken away like this, and comes in the other way; None = trapped
    blocked_by: tuple[int, ...]  # the stones that trap it
    frames: Frames
    verdict: Word = "undecided"
    proof: str = ""  # kind of the certificate; "" where nothing was proved
    seal: str = ""  # of the certificate
    reason: str = ""
    warm: bool = False  # the state of the stage before led to this one
    moving: tuple[int, ...] = ()  # where it falls: the blocks that move, the fastest first
    how: str = ""  # what the fastest of them does: topples, slides or drops
    props: tuple[int, ...] = ()  # to be held at this stage
    propped: Word | None = None  # the verdict with them; None = no props needed or none found
    smallest: bool = False  # no fewer stones would do while nothing stands without props
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class GivenOrder:
    """What became of an order that was given."""

    faults: tuple[Fault, ...]  # () = it is valid
    nearest: Nearest
    words: tuple[Word, ...]  # verdicts of the stages of the nearest order, without props


@dataclass(frozen=True, slots=True, eq=False)
class BuildSequence:
    """A structure and how it is built."""

    __repr__ = one_line

    assembly: Assembly
    contacts: Contacts
    fixed: Bools  # (n,)
    method: str
    graph: SupportGraph
    layer: Ints  # (n,) 0 = support
    steps: tuple[Step, ...]
    props: tuple[Prop, ...]  # what is put up, in the order of building
    least_props: int  # so many stones have to be held at some time, at least
    given: GivenOrder | None  # None = the order was found here
    colour: Ints  # (n,) no two blocks that touch share one
    yard: Floats  # (n, 3) m, from its place to the yard
    along: Floats  # (3,) unit, along the wall
    up: Floats  # (3,) unit, against gravity
    gravity: Floats  # (3,) m/s2
    lean: float
    assumed: dict[str, Any]
    warnings: tuple[str, ...]
    seconds: dict[str, float] = field(default_factory=dict)
    density: float = np.nan  # kg/m3, of blocks that give none

    @property
    def order(self) -> tuple[int, ...]:
        """Free blocks, the first to be laid first."""
        return tuple(step.block for step in self.steps)

    @property
    def first_unstable(self) -> int | None:
        """Index of the first step after which the structure was not proved to stand by itself."""
        return next((k for k, step in enumerate(self.steps) if step.verdict != "stable"), None)


def build_sequence(
    assembly: Assembly,
    settings: Settings | None = None,
    wanted: SequenceOptions = SequenceOptions(),  # noqa: B008  frozen
    progress: Callable[[str], None] = lambda _: None,
    executor: Executor | None = None,
    watch: Callable[[int, Result], None] | None = None,
) -> BuildSequence:
    """Find the order in which a structure is built, or take one that is given, and check every stage of it.

    Parameters
    ----------
    assembly : Assembly
        The finished structure; contacts are detected where it gives none.
    settings : Settings
        As for a check; the defaults where not given. Searches do a share of the usual work (`effort`).
    wanted : SequenceOptions
        How the order is found, or ids or numbers of all blocks that are laid, the first to be laid first.
    progress : callable
        Is told what begins.
    executor : Executor, optional
        Does runs of stages side by side, with the same answers; this process where not given.
    watch : callable, optional
        Is given the number of each stage (from 0) and its verdict without props, certificate included.

    Returns
    -------
    BuildSequence
        Every verdict in it has passed the independent checker.

    Raises
    ------
    InputError
        As `check`, and where gravity is zero, `bearing` or `clearance` are out of range, or the order names blocks that
        are not there, names one twice or leaves one out.
    """
    began = time.perf_counter()
    settings = Settings(seconds=SECONDS) if settings is None else settings
    settings = replace(settings, effort=EFFORT * settings.effort)
    whole = prepare(assembly, settings, progress)
    progress("ordering")
    lean = LEAN if wanted.bearing is None else wanted.bearing
    site = _site(whole, lean)
    steps, yard, nearest = _planned(whole, site, wanted)
    ordered = time.perf_counter()
    work = _Work(whole, settings, progress, watch, executor)
    found = work.verdicts([step.block for step in steps])
    told = [replace(step, **asdict(one)) for step, one in zip(steps, found, strict=True)]
    steps, props, least = _held(whole, site, work, told)
    given = None if nearest is None else _compared(site, work, steps, nearest)
    done = time.perf_counter()
    return BuildSequence(
        assembly,
        whole.contacts,
        whole.fixed,
        settings.chosen_method(),
        site.graph,
        site.layer,
        tuple(steps),
        props,
        least,
        given,
        colouring(whole.contacts, len(assembly)),
        yard,
        site.along,
        site.up,
        whole.gravity,
        lean,
        whole.assumed,
        whole.warnings,
        {"order": ordered - began, "stages": done - ordered, "total": done - began},
        whole.density,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Site:
    """What follows from geometry alone, whatever the order."""

    fixed: frozenset[int]
    graph: SupportGraph
    layer: Ints
    around: list[Neighbours]
    along: Floats
    up: Floats
    place: Floats  # (n, 2) along the wall and across, by its size

    def trap(self, block: int, standing: Collection[int]) -> tuple[int, ...]:
        """Standing blocks that leave a block no way in."""
        return blockers(self.around[block], standing, self.up)

    def taken_apart(self, first: Sequence[int] = ()) -> list[int]:
        """An order by layer and along the wall, or as near to another one as taking the structure apart comes."""
        turn = {block: float(k) for k, block in enumerate(first)}
        rows = np.round(self.place, 9).tolist()
        rank = [(turn.get(i, float(self.layer[i])), *rows[i], float(i)) for i in range(len(rows))]
        fixed = np.isin(np.arange(len(rows)), list(self.fixed))
        return take_apart(self.graph, fixed, rank, lambda i, there: insertion(self.around[i], there, self.up) is None)


def _site(whole: PreparedModel, lean: float) -> _Site:
    assembly, up = whole.assembly, upwards(whole.gravity)
    graph = support_graph(whole.contacts, whole.fixed, up, lean)
    along, across = along_and_across(assembly.mass.centroid[~whole.fixed], up)
    place = assembly.mass.centroid @ np.stack([along, across], 1) / max(assembly.size, 1e-300)
    fixed = frozenset(np.flatnonzero(whole.fixed).tolist())
    around = neighbours(whole.contacts, len(assembly))
    return _Site(fixed, graph, layers(graph, whole.fixed), around, along, up, place)


def _planned(whole: PreparedModel, site: _Site, wanted: SequenceOptions) -> tuple[list[Step], Floats, Nearest | None]:
    """Steps in order, without their verdicts, and the yard; the nearest valid order where one was given."""
    assembly, up, nearest = whole.assembly, site.up, None
    clearance = CLEARANCE if wanted.clearance is None else wanted.clearance
    if wanted.order is None:
        order = site.taken_apart()
    else:
        order = list(numbers_of(list(wanted.order), [block.id for block in assembly.blocks], whole.fixed.tolist()))
        nearest = nearest_order(order, site.graph.below, site.fixed, site.trap, lambda: site.taken_apart(order))
    yard = yard_places(assembly, order, site.along, up)
    standing = set(site.fixed)
    below: list[tuple[int, ...]] = [()] * len(assembly)
    for edge in site.graph.edges:
        below[edge.upper] += (edge.lower,)
    free, trapping = [], []
    for block in order:
        free.append(insertion(site.around[block], standing, up))
        trapping.append(site.trap(block, standing) if free[-1] is None else ())
        standing.add(block)
    frames = frames_of(assembly, order, yard, free, up, clearance)
    told = zip(order, site.layer[order].tolist(), (below[i] for i in order), free, trapping, frames, strict=True)
    return [Step(*one) for one in told], yard, nearest


@dataclass(frozen=True, slots=True, eq=False)
class _Work:
    """Runs of stages, done here or side by side elsewhere: each is the same work wherever it is done."""

    whole: PreparedModel
    settings: Settings
    progress: Callable[[str], None]
    watch: Callable[[int, Result], None] | None
    executor: Executor | None

    def mapped(self, do: Callable[..., Any], jobs: Sequence[Any]) -> Iterator[Any]:
        """What a function of one job gives for each, in their order; the last, which are the largest, begin first."""
        if self.executor is None:
            return map(do, jobs)
        begun = [self.executor.submit(do, job) for job in reversed(jobs)]
        return (one.result() for one in reversed(begun))

    def verdicts(self, order: Sequence[int], start: int = 0) -> list[Judged]:
        """Verdicts of every stage of an order from a number on, without props."""
        size = min(RUN, max(SHORT, -(-len(order) // FEW)))
        runs = [range(k, min(k + size, len(order))) for k in range(start, len(order), size)]
        watch = self.watch if start == 0 else None
        do = partial(judged_run, self.whole, self.settings, tuple(order), watched=watch is not None)
        found: list[Judged] = []
        self.progress(f"stages of {len(order)}")
        for run, rows in zip(runs, self.mapped(do, runs), strict=True):
            self.progress(f"stage {run.stop} of {len(order)}")
            for number, (judged, result) in zip(run, rows, strict=True):
                found.append(judged)
                if watch is not None and result is not None:
                    watch(number, result)
        return found

    def held(self, order: Sequence[int], episodes: Sequence[range], hang: Collection[int]) -> list[Held]:
        """What is held in each episode."""
        if episodes:
            self.progress("props")
        do = partial(held_through, self.whole, self.settings, tuple(order), hanging=frozenset(hang))
        return list(self.mapped(do, episodes))


def _held(
    whole: PreparedModel, site: _Site, work: _Work, steps: list[Step]
) -> tuple[list[Step], tuple[Prop, ...], int]:
    """The steps with what is held at them; the props by name, and how many stones have to be held at least."""
    order = [step.block for step in steps]
    falls = groupby(range(len(steps)), lambda k: steps[k].verdict != "stable")
    episodes = [range((numbers := list(group))[0], numbers[-1] + 1) for falling, group in falls if falling]
    hang = hanging(whole, site.graph, site.up)
    found = work.held(order, episodes, hang)
    for held in found:
        for k, (blocks, word) in enumerate(zip(held.blocks, held.words, strict=True), held.first):
            steps[k] = replace(steps[k], props=blocks, propped=word, smallest=held.count == held.least)
    props = tuple(prop for held in found for prop in named_props(whole, held, order, hang, site.up))
    return steps, props, sum(held.least for held in found)


def _compared(site: _Site, work: _Work, steps: Sequence[Step], nearest: Nearest) -> GivenOrder:
    """A given order beside the nearest valid one, whose stages are certified from where they differ."""
    order = [step.block for step in steps]
    faults = tuple(faults_of(order, site.graph.below, site.fixed, site.trap))
    same = next((k for k, pair in enumerate(zip(order, nearest.order, strict=True)) if pair[0] != pair[1]), len(order))
    words = [step.verdict for step in steps[:same]]
    return GivenOrder(faults, nearest, (*words, *(one.verdict for one in work.verdicts(nearest.order, same))))


def dot_text(sequence: BuildSequence) -> str:
    """The dependency graph in the DOT language of Graphviz: an arrow from each stone to what it rests on.

    Supports are boxes, layers rows, broken edges dashed.
    """
    names = [_quoted(block.id) for block in sequence.assembly.blocks]
    number = {step.block: k for k, step in enumerate(sequence.steps, 1)}
    kept = {(e.upper, e.lower) for e in sequence.graph.kept}
    used = sorted(number.keys() | {e.lower for e in sequence.graph.edges})
    lines = ["digraph building {", "  rankdir=BT;"]
    for i in used:
        lines.append(f"  {names[i]}" + (f' [xlabel="{number[i]}"];' if i in number else " [shape=box];"))
    for edge in sequence.graph.edges:
        style = "" if (edge.upper, edge.lower) in kept else ", style=dashed"
        lines.append(f'  {names[edge.upper]} -> {names[edge.lower]} [label="{edge.support:.3g}"{style}];')
    for level in sorted(set(sequence.layer[used].tolist())):
        row = "; ".join(names[i] for i in used if sequence.layer[i] == level)
        lines.append(f"  {{ rank=same; {row} }}")
    return "\n".join([*lines, "}"]) + "\n"


def _quoted(name: str) -> str:
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") + '"'
