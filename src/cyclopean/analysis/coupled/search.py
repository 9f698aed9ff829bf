"""Coupled rigid-block analysis: the search for a state, and for a proof that there is none.

In this order: equilibrium alone (where no forces balance the loads at all, a mechanism says so), the continuation from
dilating to Coulomb friction, the alternation between forces and motion with restarts, and the branching tree, which can
also prove that no state exists. Whatever a route claims is measured here at every contact point. Budgets count
factorisations, programmes and nodes, so that the same question has the same answer on any machine; time only stops.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from cyclopean.analysis.coupled.alternation import alternation
from cyclopean.analysis.coupled.branches import moving_alike, renumbered
from cyclopean.analysis.coupled.continuation import FACTORISATIONS, continuation
from cyclopean.analysis.coupled.leaves import Prior, prior
from cyclopean.analysis.coupled.polish import Attempt, better, nothing
from cyclopean.analysis.coupled.probing import refute_by_probing
from cyclopean.analysis.coupled.states import Bounds, merit
from cyclopean.analysis.coupled.tree import Node, TreeAnswer, refute
from cyclopean.analysis.equilibrium.components import Part, components, in_own_units, with_points
from cyclopean.analysis.equilibrium.rbe import Outcome, solve_rbe
from cyclopean.analysis.settings import Settings
from cyclopean.arrays import Floats
from cyclopean.errors import InputError, SolverError
from cyclopean.statics import EquilibriumSystem

__all__ = ["CoupledOutcome", "solve_cra"]

DENSE = 40_000  # points times blocks beyond which the conic programmes of alternation and tree are not set up
TREE_POINTS = 60  # contact points up to which the tree is searched as far as the budget allows: it is exponential
PROGRAMMES, WORK = 200, 2_000_000  # of the alternation, before the tree; of larger models, points times blocks
CASES = 7  # times as many for a larger model's tree
EARLY = 1 / 20  # of that before the alternation: enough where most points are forced
FIRST = 6  # the continuation, after an alternation that failed with less effort, has its budget over this: one path
HASTY = 12  # programmes of the alternation at most where less effort is asked; a larger model then has no tree
FOLDS = 8  # contact points named where the search ends

Route = tuple[str, str, Callable[[], Attempt]]  # name, solver, and what to run
Tried = list[dict[str, Any]]  # what each route did


@dataclass(frozen=True, slots=True, eq=False)
class CoupledOutcome:
    """What the search found, in scaled units; a claim until a certificate of it has been checked."""

    word: Literal["coupled", "collapse", "refuted", "undecided"]  # state | mechanism | closed tree | none
    f: Floats | None = None  # (q, 3): a state, or the best triple met
    dq: Floats | None = None  # (6 m,)
    y: Floats | None = None  # (6 m,) mechanism
    tree: Node | None = None  # closed
    part: EquilibriumSystem | None = None  # of the component that the tree is about; None = the whole model
    merit: float = np.inf  # of the best triple
    bound: float = 0.0  # share of the tree that is closed
    folds: tuple[int, ...] = ()  # contact points (of q) at which an undecided search ends, the most blamed first
    provenance: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class _Asked:
    """What a search is asked for."""

    bounds: Bounds  # with eps = 1
    solver: str
    deadline: float  # of `time.perf_counter`
    nodes: int  # of the tree
    factorisations: int  # of the continuation
    effort: float  # share of the usual work on the alternation and the tree of a larger model
    progress: Callable[[str], None]
    known: Prior | None = None  # bounds of all motions, where points are left out that say more of them


def solve_cra(
    system: EquilibriumSystem,
    bounds: Bounds = Bounds(),  # noqa: B008  frozen
    settings: Settings = Settings(),  # noqa: B008  frozen
    progress: Callable[[str], None] = lambda _: None,
    rigid: Outcome | None = None,
    factorisations: int = FACTORISATIONS,
) -> CoupledOutcome:
    """Find forces and a displacement that make a coupled state, or prove that none exists.

    Free blocks that no contact joins, not even by way of others, are decided apart, each component in units of its own.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    bounds : Bounds
        Of the displacement; only eta / eps and beta_min / eps matter.
    settings : Settings
        Of these `solver`: "clarabel" and "osqp" leave out the continuation, whose equations are not convex, so that all
        is Clarabel's (OSQP knows linear cones only); `seconds`, after which the search stops wherever it is, and
        nothing else depends on it; `nodes`, the budget of each tree, and twice as many programmes for the alternation
        at most; and `effort`.
    progress : callable
        Is told what begins.
    rigid : Outcome, optional
        What rigid-block equilibrium says of the same system; found here if not given.
    factorisations : int
        Budget of the continuation.

    Returns
    -------
    CoupledOutcome
        Its provenance names every route tried, with its solves, rounds and factorisations.

    Raises
    ------
    InputError
        Unknown solver, or joints that pull.
    """
    if system.pull.any():  # its cones are shifted, and (10) of the coupled conditions is not made for that
        raise InputError("joints that pull: coupled analysis has none; use `method` rbe")
    began = time.perf_counter()
    deadline, nodes = began + settings.seconds, settings.nodes
    asked = _Asked(bounds.unit(), settings.solver, deadline, nodes, factorisations, settings.effort, progress)
    rigid = solve_rbe(system, settings.solver) if rigid is None else rigid
    spent = int(rigid.provenance.get("factorisations", 0))
    tried = [_entry("RBE", str(rigid.provenance.get("solver", "")), rigid.word, began, factorisations=spent)]
    if rigid.word == "collapse":
        provenance = {**_provenance("RBE", tried), **rigid.provenance, "tried": tried}
        return CoupledOutcome("collapse", y=rigid.y, provenance=provenance)
    parts = components(system)
    if len(parts) <= 1:
        return _component(system, asked, rigid.f, tried)
    return _together(system, asked, parts, rigid.f, tried)


def _together(
    system: EquilibriumSystem, asked: _Asked, parts: list[Part], given: Floats | None, tried: Tried
) -> CoupledOutcome:
    """Each component apart: one that is refuted refutes the model; one that stays open leaves it open."""
    f, dq = np.zeros((system.points, 3)), np.zeros((system.blocks, 6))
    merit, bound, open_ones, last = 0.0, 1.0, 0, None
    folds: list[int] = []
    for part in parts:
        own, force, length = in_own_units(part.system)
        start = None if given is None else given[part.points] / force
        found = _component(own, asked, start, list(tried))
        tried = list(found.provenance["tried"])
        if found.word == "refuted":
            return replace(found, part=own)
        if found.f is not None and found.dq is not None:
            f[part.points] = found.f * force
            dq[part.blocks] = found.dq.reshape(-1, 6) / np.repeat([1.0, length], 3)
        merit, bound = merit + found.merit, min(bound, found.bound)
        if found.word != "coupled":
            open_ones, last = open_ones + 1, found
            folds += part.points[list(found.folds)].tolist()
    if last is None:
        route = str(tried[-1]["route"])
        return CoupledOutcome("coupled", f, dq.ravel(), merit=merit, provenance=_provenance(route, tried))
    why = f"{last.provenance.get('why', '')} ({open_ones} of {len(parts)} groups of blocks that touch are open)"
    provenance = _provenance("", tried) | {"why": why}
    return CoupledOutcome(
        "undecided", f, dq.ravel(), merit=merit, bound=bound, folds=tuple(folds), provenance=provenance
    )


def _component(system: EquilibriumSystem, asked: _Asked, given: Floats | None, tried: Tried) -> CoupledOutcome:
    """Blocks that touch; of points that move alike one stands for all."""
    first, place = np.unique(moving_alike(system), return_inverse=True)
    if len(first) == system.points:
        return _routed(system, asked, given, tried)
    together = None
    if given is not None:
        together = np.zeros((len(first), 3))
        np.add.at(together, place, given)
    asked = replace(asked, known=prior(system, asked.bounds))
    found = _routed(with_points(system, first), asked, together, tried)
    f = np.zeros((system.points, 3))
    if found.f is not None:
        f[first] = found.f
    tree = None if found.tree is None else renumbered(found.tree, first, system.points)
    folds = tuple(int(first[k]) for k in found.folds)
    return replace(found, f=None if found.f is None else f, tree=tree, folds=folds)


def _routed(system: EquilibriumSystem, asked: _Asked, given: Floats | None, tried: Tried) -> CoupledOutcome:
    """The routes, one after the other; `given` are forces of rigid-block equilibrium."""
    best, folds = nothing(system, asked.bounds), list[int]()
    if best.found:  # nothing loaded, or nothing free
        return _coupled(best, "RBE", tried)
    for name, by, run in _routes(system, asked, [] if given is None else [given], folds):
        if time.perf_counter() > asked.deadline:
            break
        if name == "alternation" and system.points > TREE_POINTS and asked.effort >= 1.0:
            decided, best, _ = _refuting(system, asked, best, tried, EARLY)
            if decided is not None:
                return decided
        asked.progress(f"searching a coupled state: {name}")
        began = time.perf_counter()
        try:
            found = run()
        except (SolverError, np.linalg.LinAlgError):  # numerically beyond this route; the next may do better
            tried.append(_entry(name, by, "failed", began))
            continue
        word = "state" if found.found else "infeasible" if found.infeasible else "none"
        counts = {"solves": found.solves, "rounds": found.rounds, "factorisations": found.iterations}
        tried.append(_entry(name, by, word, began, **counts))
        best = better(best, found)
        if best.found:
            return _coupled(best, name, tried)
    return _branched(system, asked, best, tried, folds)


def _routes(system: EquilibriumSystem, asked: _Asked, given: list[Floats], folds: list[int]) -> Iterator[Route]:
    """The routes to a state in the order of their cost; `folds` takes the points where the continuation folds.

    Where less effort is asked, the alternation goes before the paths of the continuation, which take longer where none
    leads to a state; programme A alone, with which these begin, is quick.
    """
    hasty = asked.effort < 1.0

    def continued(budget: int = asked.factorisations) -> Attempt:
        found = continuation(system, asked.bounds, budget, asked.deadline)
        folds[:] = found.folds
        return found

    def alternated() -> Attempt:
        large = system.points > TREE_POINTS
        most = int(asked.effort * WORK) // (system.points * system.blocks) if large else PROGRAMMES
        most = min(most, HASTY) if hasty else most
        return alternation(system, asked.bounds, given, min(most, 2 * asked.nodes), asked.deadline)

    paths, dense = asked.solver not in ("clarabel", "osqp"), system.points * system.blocks <= DENSE
    if paths:
        yield "continuation", "interior", partial(continued, 0) if hasty and dense else continued
    if dense:
        yield "alternation", "clarabel", alternated
    if paths and hasty and dense:
        yield "continuation", "interior", partial(continued, asked.factorisations // FIRST)


def _branched(
    system: EquilibriumSystem, asked: _Asked, best: Attempt, tried: Tried, folds: list[int]
) -> CoupledOutcome:
    """The last resort: refute by branching, or meet a state there."""
    bounds, began = asked.bounds, time.perf_counter()
    if began > asked.deadline:
        folds = folds or _amiss(system, bounds, best)
        return _undecided(best, tried, folds, 0.0, "the time was up before the refuting search began")
    small = system.points <= TREE_POINTS
    if not small and asked.effort < 1.0:
        return _undecided(
            best, tried, folds or _amiss(system, bounds, best), 0.0, "less than the usual effort was asked"
        )
    decided, best, answer = _refuting(system, asked, best, tried)
    if decided is not None:
        return decided
    total = _provenance("", tried)
    why = f"after {total['factorisations']} factorisations, {total['solves']} programmes and {answer.nodes} nodes"
    if time.perf_counter() > asked.deadline:
        why += "; the time was up"
    elif not small:
        why += f"; the refuting search is exponential, so beyond {TREE_POINTS} contact points it is cut short"
    elif answer.narrow:
        why += "; a case of the refuting search is too narrow for floating point"
    return _undecided(best, tried, folds or _amiss(system, bounds, best), answer.bound, why)


def _refuting(
    system: EquilibriumSystem, asked: _Asked, best: Attempt, tried: Tried, share: float = 1.0
) -> tuple[CoupledOutcome | None, Attempt, TreeAnswer]:
    """What a tree decides, if anything; the best pair met, and how far it came. Larger models have a `share` of it."""
    asked.progress("refuting by branching")
    bounds, began = asked.bounds, time.perf_counter()
    known = prior(system, bounds) if asked.known is None else asked.known
    if system.points <= TREE_POINTS:
        answer = refute(system, bounds, asked.nodes, asked.deadline, known)
    else:
        programmes = min(CASES * WORK // (system.points * system.blocks), 2 * asked.nodes)
        answer = refute_by_probing(system, bounds, int(share * programmes), asked.deadline, known)
    tried.append(_entry("tree", "clarabel", answer.word, began, solves=answer.solves, nodes=answer.nodes))
    best = better(best, answer.best)
    if answer.word == "refuted":
        provenance = _provenance("tree", tried) | {"leaves": answer.leaves}
        found = CoupledOutcome("refuted", best.f, best.dq, tree=answer.root, merit=best.merit, bound=1.0)
        return replace(found, provenance=provenance), best, answer
    return (_coupled(best, "tree", tried) if best.found else None), best, answer


def _amiss(system: EquilibriumSystem, bounds: Bounds, best: Attempt) -> list[int]:
    """Where no path folds: the points at which the best triple misses most."""
    work = sum(merit(system, bounds, best.f, best.dq))
    worst: list[int] = np.argsort(-work, kind="stable")[:FOLDS].tolist()
    return worst


def _coupled(best: Attempt, route: str, tried: Tried) -> CoupledOutcome:
    provenance = _provenance(route, tried)
    return CoupledOutcome("coupled", best.f, best.dq, merit=best.merit, provenance=provenance)


def _undecided(best: Attempt, tried: Tried, folds: list[int], bound: float, why: str) -> CoupledOutcome:
    """The best triple met."""
    provenance = _provenance("", tried) | {"why": why}
    return CoupledOutcome(
        "undecided", best.f, best.dq, merit=best.merit, bound=bound, folds=tuple(folds), provenance=provenance
    )


def _entry(route: str, solver: str, word: str, began: float, **counts: int) -> dict[str, Any]:
    """What one route did; one solve and one round where nothing else is told."""
    known = {"solves": 1, "rounds": 1, "factorisations": 0, "nodes": 0, **counts}
    seconds = round(time.perf_counter() - began, 6)
    return {"route": route, "solver": solver, "word": word, **known, "seconds": seconds}


def _provenance(route: str, tried: Tried) -> dict[str, Any]:
    """How the answer was found: the last route's solver, the work of all."""
    total = {key: sum(entry[key] for entry in tried) for key in ("solves", "rounds", "factorisations", "nodes")}
    solver = tried[-1]["solver"]
    return {"route": route, "solver": solver, "iterations": total["rounds"], **total, "tried": tried}
