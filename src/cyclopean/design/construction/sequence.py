"""How a structure is built: the order, what each stone rests on, how it comes in, and whether every stage stands.

One sequencer for walls and for anything else: all of it follows from the joints. See `ordering` for the dependency
graph, its layers and its cycles, `blocking` for the way in, `stages` and `props` for the verdicts, `yard` for frames.
"""

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cyclopean.analysis import CONTINUED, Deferred, PreparedModel, Result, Settings, Word, prepare
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Contacts
from cyclopean.design.construction.blocking import blockers, insertion, neighbours
from cyclopean.design.construction.colouring import colouring
from cyclopean.design.construction.ordering import (
    LEAN,
    SupportGraph,
    along_and_across,
    layers,
    support_graph,
    take_apart,
    upwards,
)
from cyclopean.design.construction.props import EXHAUSTIVE, Props, smallest_props
from cyclopean.design.construction.stages import Stage, stage_of, verdict
from cyclopean.design.construction.yard import Frames, frames_of, yard_places
from cyclopean.errors import InputError
from cyclopean.proof import verify

__all__ = ["BuildSequence", "Step", "build_sequence", "dot_text"]

SECONDS = 10.0  # for the coupled search of one stage
CLEARANCE = 0.1  # m, of approach and retreat
LAG = 32  # stages whose certificates may wait for the checker: they are kept meanwhile


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
    props: tuple[int, ...] = ()  # to be held at this stage
    propped: Word | None = None  # the verdict with them; None = no props needed or none found
    smallest: bool = False  # no smaller set of props would do
    seconds: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class BuildSequence:
    """A structure and how it is built."""

    assembly: Assembly
    contacts: Contacts
    fixed: Bools  # (n,)
    method: str
    graph: SupportGraph
    layer: Ints  # (n,) 0 = support
    steps: tuple[Step, ...]
    colour: Ints  # (n,) no two blocks that touch share one
    yard: Floats  # (n, 3) m, from its place to the yard
    along: Floats  # (3,) unit, along the wall
    up: Floats  # (3,) unit, against gravity
    gravity: Floats  # (3,) m/s2
    lean: float
    assumed: dict[str, Any]
    warnings: tuple[str, ...]
    seconds: dict[str, float] = field(default_factory=dict)

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
    *,
    lean: float = LEAN,
    clearance: float = CLEARANCE,
    most_props: int = EXHAUSTIVE,
    progress: Callable[[str], None] = lambda _: None,
    watch: Callable[[int, Result], None] = lambda _, __: None,
    executor: Executor | None = None,
) -> BuildSequence:
    """Find the order in which a structure is built, and check every stage of it.

    Parameters
    ----------
    assembly : Assembly
        The finished structure; contacts are detected where it gives none.
    settings : Settings
        As for a check; the defaults where not given, with 10 s for the coupled search of one stage.
    lean : float
        Least share of a joint's normal along gravity from which one stone rests on the other.
    clearance : float
        m, of approach and retreat.
    most_props : int
        Size up to which all sets of props are gone through.
    progress : callable
        Is told what begins.
    watch : callable
        Is given the number of each stage (from 0) and its verdict without props, certificate included.
    executor : Executor, optional
        Checks the certificates of stages while the next ones are looked at; this process where not given.

    Returns
    -------
    BuildSequence
        Every verdict in it has passed the independent checker.

    Raises
    ------
    InputError
        As `check`, and where gravity is zero or `lean` or `clearance` are out of range.
    """
    began = time.perf_counter()
    settings = Settings(seconds=SECONDS) if settings is None else settings
    if not (most_props >= 0):
        raise InputError.of("props", most_props, "expected a whole number >= 0")
    whole = prepare(assembly, settings, progress)
    progress("ordering")
    plan = _planned(whole, lean, clearance)
    ordered = time.perf_counter()
    steps = []
    stages = _Stages(whole, settings, [step.block for step in plan.steps], most_props, progress)
    for number, (alone, props) in enumerate(stages.run(executor)):
        watch(number, alone)
        steps.append(_judged(plan.steps[number], alone, props))
    done = time.perf_counter()
    return BuildSequence(
        assembly,
        whole.contacts,
        whole.fixed,
        settings.chosen_method(),
        plan.graph,
        plan.layer,
        tuple(steps),
        colouring(whole.contacts, len(assembly)),
        plan.yard,
        plan.along,
        plan.up,
        whole.gravity,
        lean,
        whole.assumed,
        whole.warnings,
        {"order": ordered - began, "stages": done - ordered, "total": done - began},
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Plan:
    """What follows from geometry alone."""

    graph: SupportGraph
    layer: Ints
    steps: list[Step]  # in order, without their verdicts
    yard: Floats
    along: Floats
    up: Floats


def _planned(whole: PreparedModel, lean: float, clearance: float) -> _Plan:
    assembly, up = whole.assembly, upwards(whole.gravity)
    graph = support_graph(whole.contacts, whole.fixed, up, lean)
    layer = layers(graph, whole.fixed)
    along, across = along_and_across(assembly.mass.centroid[~whole.fixed], up)
    around = neighbours(whole.contacts, len(assembly))
    place = assembly.mass.centroid @ np.stack([along, across], 1) / max(assembly.size, 1e-300)
    rank = [(float(layer[i]), *np.round(place[i], 9).tolist(), float(i)) for i in range(len(assembly))]
    order = take_apart(graph, whole.fixed, rank, lambda i, there: insertion(around[i], there, up) is None)
    yard = yard_places(assembly, order, along, up)
    standing = set(np.flatnonzero(whole.fixed).tolist())
    below: list[tuple[int, ...]] = [()] * len(assembly)
    for edge in graph.edges:
        below[edge.upper] += (edge.lower,)
    free, trapping = [], []
    for block in order:
        free.append(insertion(around[block], standing, up))
        trapping.append(blockers(around[block], standing, up) if free[-1] is None else ())
        standing.add(block)
    frames = frames_of(assembly, order, yard, free, up, clearance)
    told = zip(order, layer[order].tolist(), (below[i] for i in order), free, trapping, frames, strict=True)
    return _Plan(graph, layer, [Step(*one) for one in told], yard, along, up)


Judged = tuple[Result, Props | None]  # without props, and with them where it does not stand by itself


class _Stages:
    """The verdict of every stage, one after the other."""

    def __init__(
        self, whole: PreparedModel, settings: Settings, order: Sequence[int], most: int, progress: Callable[[str], None]
    ) -> None:
        self.whole, self.settings, self.order, self.most, self.progress = whole, settings, order, most, progress

    def run(self, executor: Executor | None) -> Iterator[Judged]:
        """Verdicts that have all passed the checker, in order."""
        later = None if executor is None else Deferred(executor)
        waiting: deque[tuple[int, Judged]] = deque()
        for number, found in enumerate(self._found(later)):
            waiting.append((number, found))
            if len(waiting) > LAG:
                yield self._proved(later, *waiting.popleft())
        while waiting:
            yield self._proved(later, *waiting.popleft())

    def _found(self, later: Deferred | None) -> Iterator[Judged]:
        before: tuple[Stage, Result] | None = None
        propped: tuple[Stage, Props] | None = None
        for number in range(len(self.order)):
            self.progress(f"stage {number + 1} of {len(self.order)}")
            stage = self._stage(number)
            alone = verdict(stage, self.settings, before, verify if later is None else later)
            props = self._props(stage, number, alone, propped)
            propped = None if props is None else (stage, props)
            before = (stage, alone) if alone.verdict == "stable" else None
            yield alone, props

    def _proved(self, later: Deferred | None, number: int, found: Judged) -> Judged:
        """What was found, if the checker says so; else the stage is looked at again from nothing."""
        if later is None or later.proved(found[0]):
            return found
        stage = self._stage(number)
        alone = verdict(stage, self.settings)
        return alone, self._props(stage, number, alone, None)

    def _stage(self, number: int) -> Stage:
        standing = self.whole.fixed.copy()
        standing[list(self.order[: number + 1])] = True
        return stage_of(self.whole, standing)

    def _props(self, stage: Stage, number: int, alone: Result, propped: tuple[Stage, Props] | None) -> Props | None:
        if alone.verdict == "stable":
            return None
        self.progress(f"stage {number + 1} of {len(self.order)}: props")
        held = () if propped is None else propped[1].blocks
        latest = [i for i in reversed(self.order[: number + 1]) if i not in held]
        return smallest_props(stage, alone, self.settings, [*held, *latest], self.most, propped)


def _judged(step: Step, alone: Result, props: Props | None) -> Step:
    """The step with its verdicts, without props and with them."""
    certificate = alone.certificate or {}
    if props is not None:
        step = replace(step, props=props.blocks, propped=props.result.verdict, smallest=props.smallest)
    return replace(
        step,
        verdict=alone.verdict,
        proof=str(certificate.get("kind", "")),
        seal=str(certificate.get("seal", "")),
        reason=alone.reason,
        warm=alone.provenance.get("route") == CONTINUED,
        seconds=alone.seconds["total"],
    )


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
