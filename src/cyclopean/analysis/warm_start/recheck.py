"""Check a model that grew from one whose verdict is known.

Every verdict is proved anew: the certificate of the whole model passes the independent checker. By coupled analysis
the known state is the first guess. What is new is seated on what was there (see `seating`), and steps that stay inside
all inequalities lead from there to a state of the whole (see `inward`). At first only what is near a shortest way down
from what is new to a support may move: its weight has to go down, but not far to the sides. Where the steps jam all may
move; then the neighbours are seated anew as well, then theirs; where that fails too, the search begins from nothing.
Components, blocks that contacts join, do not need each other: those that nothing new has come to keep their
state, and only the others are searched.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from cyclopean.analysis.checking import decide
from cyclopean.analysis.coupled.kkt import Doubled
from cyclopean.analysis.coupled.polish import attempt
from cyclopean.analysis.coupled.search import CoupledOutcome, solve_cra
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.analysis.equilibrium.components import components, in_own_units
from cyclopean.analysis.equilibrium.newton import collapse_bound
from cyclopean.analysis.equilibrium.rbe import COLLAPSE, solve_rbe
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.proving import Claim, Judge, coupled_claim
from cyclopean.analysis.settings import Settings
from cyclopean.analysis.verdict import Result
from cyclopean.analysis.warm_start.inward import inward
from cyclopean.analysis.warm_start.region import Region, around, region, way_down
from cyclopean.analysis.warm_start.seating import seated
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.errors import InputError, SolverError
from cyclopean.proof import verify
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["CONTINUED", "Known", "mobile", "recheck"]

CONTINUED = "known state"  # the route of a state that was continued
RADII = (0, 1, 2)  # joints from what is new within which blocks are seated anew, one after the other
AISLE = 3  # joints to each side of a way down, within which the weight of what is new goes down first
MOST = 0.7  # share of the blocks from which all of them are as good
MANY = 4  # new blocks beyond which what is known is no guess
SLOW = 1e-6  # of the speed of the fastest block


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A result of a model of k blocks and P contact points, and where these are in the model it grew into."""

    result: Result
    block: Ints  # (k,) index of each block, -1 = taken away
    point: Ints  # (P,) index of each contact point, -1 = taken away


def recheck(model: PreparedModel, settings: Settings, known: Known | None = None, judge: Judge = verify) -> Result:
    """Decide whether a model stands, with a verified certificate.

    Parameters
    ----------
    model : PreparedModel
        n blocks.
    settings : Settings
        Method, solver and budget.
    known : Known, optional
        The result of a smaller model, to begin from; what it says is a guess, nothing is taken on trust.
    judge : callable
        The independent checker.

    Returns
    -------
    Result
        As of `check`; its provenance has the route "known state" where that led to a state.

    Raises
    ------
    InputError
        `known` has other blocks or points than its result, or some that the model does not have.
    """
    if known is None or settings.chosen_method() == "rbe":
        return decide(model, settings, judge=judge)
    _fitting(model, known)
    return decide(model, settings, lambda system: _continued(model, settings, system, known), judge)


def mobile(model: PreparedModel, settings: Settings) -> Ints | None:
    """Blocks that a mechanism of rigid-block equilibrium moves; None where there is none.

    Blocks that move a million times slower than the fastest are taken to stand, if what is left is still a mechanism.

    Parameters
    ----------
    model : PreparedModel
        n blocks.
    settings : Settings
        The solver.
    """
    system = model.system()
    outcome = solve_rbe(system, settings.solver)
    if outcome.word != "collapse" or outcome.y is None:
        return None
    rows = outcome.y.reshape(-1, 6)
    speed = np.abs(rows).max(axis=1)
    moving = speed > SLOW * speed.max(initial=0.0)
    if not (collapse_bound(system, np.where(moving[:, None], rows, 0.0).ravel()) >= COLLAPSE):
        moving = speed > 0.0
    return np.asarray(system.free[moving])


def _fitting(model: PreparedModel, known: Known) -> None:
    result = known.result
    for name, index, count, most in (
        ("block", known.block, len(result.assembly), len(model.assembly)),
        ("point", known.point, len(result.contacts.point), len(model.contacts.point)),
    ):
        if len(index) != count:
            raise InputError(f"known {name}s: {len(index)} places for the {count} of the known result")
        if count and not (-1 <= int(index.min()) and int(index.max()) < most):
            raise InputError(f"known {name}s: a place that the model, with {most} of them, does not have")


def _continued(model: PreparedModel, settings: Settings, system: EquilibriumSystem, known: Known) -> Claim | None:
    """A coupled state near the one known; None where none is found."""
    result = known.result
    if result.force is None or result.displacement is None or not system.blocks or not system.points:
        return None
    f, motion, old_block, old_point = _placed(model, system, known)
    f, dq = f / system.force_unit, motion / settings.eps
    bounds, rounds = settings.bounds().unit(), 0
    if np.count_nonzero(~old_block) > MANY:
        return None
    parts = components(system)
    for part in parts:
        k, b = part.points, part.blocks
        if old_block[b].all() and old_point[k].all() and measure(part.system, bounds, f[k], dq[b].ravel()).accepted:
            continue  # what is new does not touch it
        state = _near(part.system, bounds, np.flatnonzero(~old_block[b]), old_point[k], f[k], dq[b].ravel())
        if state is not None:
            f[k], dq[b], rounds = state[0], state[1].reshape(-1, 6), max(rounds, state[2])
            continue
        if len(parts) == 1:
            return None
        own, force, length = in_own_units(part.system)
        found = solve_cra(own, bounds, settings)
        if found.f is None or found.dq is None or found.word != "coupled":
            folds = tuple(k[list(found.folds)].tolist())
            lost = coupled_claim(replace(found, f=None, dq=None, part=own, folds=folds))
            return None if found.word == "collapse" else lost
        f[k], dq[b] = found.f * force, found.dq.reshape(-1, 6) / np.repeat([1.0, length], 3)
    provenance = {"route": CONTINUED, "solver": "newton", "iterations": rounds, "factorisations": 0, "tried": []}
    return coupled_claim(CoupledOutcome("coupled", f, dq.ravel(), merit=0.0, provenance=provenance))


def _near(
    system: EquilibriumSystem, bounds: Bounds, fresh: Ints, old_point: Bools, f: Floats, dq: Floats
) -> tuple[Floats, Floats, int] | None:
    """A coupled state near (f, dq) with some (k,) fresh blocks, and what it took; None where none is found."""
    down = way_down(system, fresh)

    @cache
    def cut(rows: bytes) -> tuple[Region, Doubled]:
        """A region and its matrix, ordered once."""
        found = region(system, np.frombuffer(rows, np.int64))
        return found, Doubled(Schur(found.part))

    for radius in RADII:
        blocks = around(system, fresh, radius)
        if radius and len(blocks) > MOST * system.blocks:
            break  # to seat most of them anew is to begin from nothing
        start = _seat(system, bounds, blocks, old_point, f, dq)
        if start is not None:
            if attempt(system, bounds, *start).found:
                return *start, radius + 1
            for room in _rooms(system, np.union1d(down, blocks)):
                near, moved, residuals = inward(system, *cut(room.tobytes()), bounds, *start)
                if residuals.accepted:
                    return near, moved, radius + 1
        if not len(fresh):
            break
    return None


def _rooms(system: EquilibriumSystem, blocks: Ints) -> list[Ints]:
    """What is near these blocks, then all; only that where it is most of them."""
    near, everything = around(system, blocks, AISLE), np.arange(system.blocks)
    return [everything] if len(near) > MOST * len(everything) else [near, everything]


def _seat(
    system: EquilibriumSystem, bounds: Bounds, blocks: Ints, old: Bools, f: Floats, dq: Floats
) -> tuple[Floats, Floats] | None:
    """Forces and motion with these blocks seated anew; None where that fails."""
    try:
        return seated(system, bounds, blocks, old, f, dq) if len(blocks) else (f, dq)
    except SolverError:
        return None


def _placed(model: PreparedModel, system: EquilibriumSystem, known: Known) -> tuple[Floats, Floats, Bools, Bools]:
    """(q, 3) N and (m, 6) displacement, rotations scaled, as far as they are known; which blocks and points are old."""
    result = known.result
    assert result.force is not None and result.displacement is not None  # noqa: PT018  the caller looked
    force, old_point = np.zeros((len(model.contacts.point), 3)), np.zeros(len(model.contacts.point), bool)
    kept = known.point >= 0
    force[known.point[kept]] = result.force[kept]
    old_point[known.point[kept]] = True
    motion, old_block = np.zeros((len(model.assembly), 6)), np.zeros(len(model.assembly), bool)
    kept = (known.block >= 0) & ~result.fixed  # what was held is new: of its motion nothing is known
    motion[known.block[kept]] = result.displacement[kept]
    old_block[known.block[kept]] = True
    rows = motion[system.free]
    rows[:, 3:] *= system.length_unit
    free = old_block[system.free]
    beside = [np.where(row >= 0, free[row], True) for row in (system.row_a, system.row_b)]
    return force[system.used], rows, free, old_point[system.used] & beside[0] & beside[1]
