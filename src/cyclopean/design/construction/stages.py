"""Does what has been built so far stand? The verdict of one stage, from the one before where that helps.

A stage is the part of the structure that has been laid, with the supports, the joints between all these, and their
loads. Every verdict is proved anew: the certificate of the whole stage passes the independent checker.

By coupled analysis the state of the stage before is the first guess: its forces and displacement, the new stone pushed
up by what it rests on. One round of active sets and Newton on that settles most stages at a fraction of the cost of a
search; where it fails, the search begins from nothing.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis import Result, Settings, collapse_bound, solve_cra, solve_rbe
from cyclopean.analysis.coupled.polish import polish
from cyclopean.analysis.coupled.search import CoupledOutcome
from cyclopean.analysis.posing import PosedModel
from cyclopean.analysis.proving import Claim, coupled_claim, prove, rigid_claim
from cyclopean.analysis.rigid.rbe import COLLAPSE
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Contacts, Load
from cyclopean.statics import EquilibriumSystem, equilibrium_system

__all__ = ["CONTINUED", "Stage", "moving", "stage_of", "verdict", "with_props"]

CONTINUED = "the stage before"  # the route of a state that was continued
SHARE = 0.00499  # of the size of the free blocks: the largest tolerance that a certificate may state, with room
MARGIN = 1.001  # of beta_min, where a state was refused by a rounding error
SLOW = 1e-6  # of the speed of the fastest block
RISE = 0.1  # of the normal along gravity from which a joint pushes the new stone up in the first guess


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """Part of a structure, ready for analysis."""

    model: PosedModel
    block: Ints  # (k,) index of each of its blocks in the whole
    point: Ints  # (q,) index of each of its contact points in the whole


def stage_of(whole: PosedModel, standing: Bools, props: Sequence[int] = ()) -> Stage:
    """Cut a stage out of the whole.

    Parameters
    ----------
    whole : PosedModel
        The finished structure, n blocks.
    standing : (n,) bool
        What has been laid; supports always stand.
    props : sequence of int
        Blocks of the whole that are held fixed for the time being.
    """
    held = whole.fixed.copy()
    held[list(props)] = True
    block = np.flatnonzero(standing | whole.fixed)
    place = np.full(len(standing), -1)
    place[block] = np.arange(len(block))
    contacts, point = _within(whole.contacts, place)
    loads = tuple(Load(int(place[x.block]), x.force, x.point) for x in whole.assembly.loads if place[x.block] >= 0)
    assembly = Assembly(tuple(whole.assembly.blocks[i] for i in block), contacts, loads, whole.assembly.name)
    fixed = held[block]
    touched = np.zeros(len(block), bool)
    touched[contacts.a] = touched[contacts.b] = True
    model = PosedModel(
        assembly,
        contacts,
        fixed,
        whole.gravity,
        whole.density,
        _tolerance(assembly, fixed, whole.tolerance),
        whole.assumed,
        (),
        tuple(np.flatnonzero(~touched & ~fixed).tolist()),
    )
    return Stage(model, block, point)


def with_props(stage: Stage, props: Sequence[int]) -> Stage:
    """The same stage with these blocks of the whole held."""
    fixed = stage.model.fixed | np.isin(stage.block, list(props))
    idle = tuple(i for i in stage.model.idle if not fixed[i])
    tolerance = _tolerance(stage.model.assembly, fixed, stage.model.tolerance)
    return replace(stage, model=replace(stage.model, fixed=fixed, idle=idle, tolerance=tolerance))


def verdict(stage: Stage, settings: Settings, before: tuple[Stage, Result] | None = None) -> Result:
    """Decide whether a stage stands, with a verified certificate.

    Parameters
    ----------
    stage : Stage
        What has been laid.
    settings : Settings
        Method, solver and budget.
    before : Stage and Result, optional
        The stage before and its verdict, to begin from.
    """
    began = time.perf_counter()
    model = stage.model
    system = equilibrium_system(model.assembly, model.contacts, model.fixed, model.gravity, model.density)
    if settings.chosen_method() == "rbe":
        result = prove(model, settings, system, rigid_claim(solve_rbe(system, settings.solver)))
    else:
        result = _coupled(stage, settings, system, before)
    return replace(result, seconds={"total": time.perf_counter() - began})


def moving(stage: Stage, settings: Settings) -> Ints | None:
    """Blocks of the whole that a mechanism of this stage moves; None where there is none.

    Blocks that move a million times slower than the fastest are taken to stand, if what is left is still a mechanism.
    """
    model = stage.model
    system = equilibrium_system(model.assembly, model.contacts, model.fixed, model.gravity, model.density)
    outcome = solve_rbe(system, settings.solver)
    if outcome.word != "collapse" or outcome.y is None:
        return None
    rows = outcome.y.reshape(-1, 6)
    speed = np.abs(rows).max(axis=1)
    mobile = speed > SLOW * speed.max(initial=0.0)
    if not (collapse_bound(system, np.where(mobile[:, None], rows, 0.0).ravel()) >= COLLAPSE):
        mobile = speed > 0.0
    return np.asarray(stage.block[system.free[mobile]])


def _coupled(
    stage: Stage, settings: Settings, system: EquilibriumSystem, before: tuple[Stage, Result] | None
) -> Result:
    bounds = settings.bounds().unit()
    claim = None if before is None else _continued(stage, settings, system, *before)
    if claim is not None:
        result = prove(stage.model, settings, system, claim)
        if result.verdict == "stable":
            return result
    claim = coupled_claim(solve_cra(system, bounds, settings.solver, settings.seconds, settings.nodes))
    result = prove(stage.model, settings, system, claim)
    if (
        result.verdict == "undecided" and claim.kind == "cra-state"
    ):  # sliding by beta_min to the last bit was too little
        more = replace(bounds, beta=bounds.beta * MARGIN)
        again = coupled_claim(solve_cra(system, more, settings.solver, settings.seconds, settings.nodes))
        if again.kind == "cra-state":
            return prove(stage.model, settings, system, again)
    return result


def _continued(
    stage: Stage, settings: Settings, system: EquilibriumSystem, earlier: Stage, known: Result
) -> Claim | None:
    """A coupled state near that of the stage before; None where there is none."""
    if known.force is None or known.displacement is None or not system.blocks or not system.points:
        return None
    f, motion = _guess(stage, system, earlier, known)
    motion[:, 3:] *= system.length_unit
    bounds = settings.bounds().unit()
    near, dq, residuals = polish(system, bounds, f / system.force_unit, motion.ravel() / settings.eps, 1)
    if not residuals.accepted:
        return None
    provenance = {"route": CONTINUED, "solver": "newton", "iterations": 1, "factorisations": 0, "tried": []}
    return coupled_claim(CoupledOutcome("coupled", near, dq, merit=0.0, route=CONTINUED, provenance=provenance))


def _guess(stage: Stage, system: EquilibriumSystem, earlier: Stage, known: Result) -> tuple[Floats, Floats]:
    """(q, 3) N and (m, 6) displacement (rotations per metre) of the stage before; new stones sit on what is below."""
    assert known.force is not None and known.displacement is not None  # noqa: PT018  the caller looked
    force = np.zeros((int(max(stage.point.max(initial=-1), earlier.point.max(initial=-1))) + 1, 3))
    force[earlier.point] = known.force
    f = force[stage.point][system.used]
    whole = np.zeros((int(max(stage.block.max(), earlier.block.max())) + 1, 6))
    whole[earlier.block] = known.displacement
    motion = whole[stage.block[system.free]]
    for row in np.flatnonzero(~np.isin(stage.block[system.free], earlier.block)).tolist():
        _seat(stage, system, row, f, motion)
    return f, motion


def _seat(stage: Stage, system: EquilibriumSystem, row: int, f: Floats, motion: Floats) -> None:
    """Put a new stone into the guess: its weight spread over the points below it, pressed there by eps."""
    up = -stage.model.gravity / max(float(np.linalg.norm(stage.model.gravity)), 1e-300)
    side = np.where(system.row_b == row, 1.0, np.where(system.row_a == row, -1.0, 0.0))
    below = np.flatnonzero(side * (system.frame[:, 0] @ up) > RISE)
    if not len(below):
        return
    f[below, 0] = np.linalg.norm(system.p[6 * row : 6 * row + 3]) * system.force_unit / len(below)
    scale = np.array([1.0, 1.0, 1.0, *[system.length_unit] * 3])
    rows = system.A.T.tocsr()[3 * below]
    gap = rows @ (motion * scale).ravel()
    own = rows[:, 6 * row : 6 * row + 6].toarray()
    motion[row] += np.linalg.lstsq(own, -1.0 - gap, rcond=1e-9)[0] / scale


def _within(contacts: Contacts, place: Ints) -> tuple[Contacts, Ints]:
    """Joints between blocks that have a place, and which contact points of the whole are theirs."""
    kept = np.flatnonzero((place[contacts.a] >= 0) & (place[contacts.b] >= 0))
    inside = np.zeros(len(contacts), bool)
    inside[kept] = True
    point = np.flatnonzero(inside[contacts.patch])
    start = np.concatenate([[0], np.cumsum(np.diff(contacts.start)[kept])])
    part = Contacts(place[contacts.a[kept]], place[contacts.b[kept]], start, contacts.point[point], contacts.mu[kept])
    return part, point


def _tolerance(assembly: Assembly, fixed: Bools, wanted: float) -> float:
    """The tolerance (m) of the whole, as far as a certificate of so few free blocks may state it."""
    free = assembly.mesh.vertex[~fixed[assembly.mesh.vertex_body]]
    return min(wanted, SHARE * float(np.linalg.norm(np.ptp(free, axis=0)))) if len(free) else wanted
