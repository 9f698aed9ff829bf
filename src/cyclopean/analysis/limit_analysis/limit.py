"""From a model and what grows on it to a multiplier with a verified certificate."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.growing import GrowingModel
from cyclopean.analysis.limit_analysis.joints import moving_joints
from cyclopean.analysis.limit_analysis.live_load import Live
from cyclopean.analysis.limit_analysis.load_family import Pencil, pencil
from cyclopean.analysis.limit_analysis.proving import Proved, in_users_units, prove_bounds
from cyclopean.analysis.limit_analysis.reasons import of_real_friction, reason_for_limit
from cyclopean.analysis.limit_analysis.result import LimitResult
from cyclopean.analysis.limit_analysis.solving import LimitOutcome, solve_limit
from cyclopean.analysis.limit_analysis.turning import solve_turning
from cyclopean.analysis.preparation import PreparedModel, prepare
from cyclopean.analysis.proving import spread, utilisation
from cyclopean.analysis.settings import Settings
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.statics import turned_gravity

BACK = 1e-8  # radians between what a solver says of a tilt and what is proved: room for forces, and for a motion

__all__ = ["Found", "find_limit", "found_limit", "limit", "proved_limit"]


def limit(
    assembly: Assembly,
    live: Live,
    settings: Settings | None = None,
    progress: Callable[[str], None] = lambda _: None,
    *,
    solver: str = "auto",
    seconds: float | None = None,
) -> LimitResult:
    """By how much may these loads grow before a mechanism forms?

    Loads p(t) = p0 + t p1, p0 the weight and the given loads, p1 the live ones. The answer is bounded from below by
    forces in balance at t = lower, from above by a mechanism at every t >= upper, and says nothing that the independent
    checker has not confirmed. By rigid-block equilibrium: a joint that slides is taken to dilate.

    Parameters
    ----------
    assembly : Assembly
        The model; contacts are detected where it gives none.
    live : Live
        What grows.
    settings : Settings
        Friction, density, supports, gravity; what belongs to coupled analysis is not used.
    progress : callable
        Is told the name of each stage as it begins.
    solver : {"auto", "interior", "clarabel"}
        The structured interior point, the conic solver, or the second after the first.
    seconds : float, optional
        When to stop, proof and all: the best bounds that are proved by then are answered, however far apart.

    Raises
    ------
    InputError
        As `check`; and live loads that name no block, act on supports only, or are zero.

    References
    ----------
    .. [Livesley1978] Livesley: Limit analysis of structures formed from rigid blocks. Int. J. Numer. Methods Eng. 12.
    .. [FerrisTinLoi2001] Ferris, Tin-Loi: Limit analysis of frictional block assemblies as a mathematical program with
       complementarity constraints. Int. J. Mech. Sci. 43.
    """
    if seconds is not None and not (0.0 < seconds < np.inf):
        raise InputError.of("seconds", seconds, "expected a positive number")
    budget = UNLIMITED if seconds is None else Budget(seconds)
    began, clock = time.perf_counter(), dict[str, float]()
    model = prepare(assembly, settings, progress, clock)
    result, _ = found_limit(model, live, solver, budget, progress)
    stages = {"contacts": clock["contacts"] - clock["margin"], **result.seconds}
    return replace(result, seconds=stages | {"total": time.perf_counter() - began})


def found_limit(
    model: PreparedModel,
    live: Live,
    solver: str = "auto",
    budget: Budget = UNLIMITED,
    progress: Callable[[str], None] = lambda _: None,
    beside: GrowingModel | None = None,
) -> tuple[LimitResult, GrowingModel]:
    """`limit` of a prepared model, from what is known `beside`; and what is then known for other live loads."""
    clock = [time.perf_counter()]
    progress("solving")
    found = find_limit(model, live, solver, budget.before_proof(len(model.contacts.point)), beside)
    clock.append(time.perf_counter())
    progress("verifying")
    result = proved_limit(model, live, found, budget)
    clock.append(time.perf_counter())
    seconds = {"solve": clock[1] - clock[0], "verify": clock[2] - clock[1], "total": clock[2] - clock[0]}
    return replace(result, seconds=seconds), found.growing


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What the solvers found, and between which loads."""

    growing: GrowingModel
    outcome: LimitOutcome
    angle: tuple[float | None, float | None] | None = None  # radians at multipliers 0 and 1, where they stand for that


def find_limit(
    model: PreparedModel,
    live: Live,
    solver: str = "auto",
    budget: Budget = UNLIMITED,
    beside: GrowingModel | None = None,
) -> Found:
    """What the solvers find, before anything is proved; from what is known `beside`, of other live loads."""
    if live.tilt is not None and _turns_unevenly(model, live.tilt):
        return _turned(model, live.tilt, solver, budget)
    growing = GrowingModel.of(model, live) if beside is None else beside.beside(live)
    outcome = solve_limit(growing.pencil, solver, budget, growing.rest)
    return Found(growing, in_users_units(outcome, growing.pencil.unit))


def _turns_unevenly(model: PreparedModel, azimuth: float) -> bool:
    """Whether something acts on free blocks that does not turn, so that loads are on no line in tan(angle)."""
    along = model.gravity + turned_gravity(model.gravity, 180.0, azimuth)
    given = any(not model.fixed[load.block] for load in model.assembly.loads)
    return given or bool(np.linalg.norm(along) > 1e-9 * np.linalg.norm(model.gravity))


def _turned(model: PreparedModel, azimuth: float, solver: str, budget: Budget) -> Found:
    """A tilt of a model with loads that do not turn."""

    def at(gravity: Floats, live: Floats) -> Pencil:
        there = GrowingModel(replace(model, gravity=gravity), live)
        return there.pencil if live.any() else pencil(there.system, there.live)

    turn = solve_turning(at, model.gravity, azimuth, solver, budget)
    start = 0.0 if turn.low is None else turn.low - BACK
    end = None if turn.high is None else turn.high + BACK
    first = turned_gravity(model.gravity, float(np.rad2deg(start)), azimuth)
    last = first if end is None else turned_gravity(model.gravity, float(np.rad2deg(end)), azimuth)
    low = None if turn.low is None else start
    return Found(GrowingModel(replace(model, gravity=first), last - first), turn.outcome, (low, end))


def proved_limit(model: PreparedModel, live: Live, found: Found, budget: Budget = UNLIMITED) -> LimitResult:
    """What of it the checker confirms."""
    proved = prove_bounds(found.growing, found.outcome, found.angle is None, budget)
    system, outcome = found.growing.system, found.outcome
    lower, upper = proved.lower, proved.upper
    if found.angle is not None:  # 0 and 1 stand for two angles
        low, high = found.angle
        lower = None if lower is None or low is None else float(np.tan(low))
        upper = None if upper is None or high is None else float(np.tan(high))
    force = None if proved.force is None else spread(system, model.contacts, system.true_forces(proved.force))
    force = None if force is None else force * system.force_unit
    rows = None
    if proved.motion is not None:
        rows = np.zeros((len(model.assembly), 6))
        rows[system.free] = proved.motion
    window = None
    if outcome.word == "falls" and lower is not None and np.isfinite(outcome.least):
        window = (outcome.least, lower) if outcome.least > 0.0 else None
    warnings = model.warnings
    if proved.report is not None and not proved.report.proved:
        warnings = (*warnings, f"a solver's bounds did not survive the independent check: {proved.report.reason}")
    result = LimitResult(
        assembly=model.assembly,
        contacts=model.contacts,
        fixed=model.fixed,
        live=live,
        method="rbe",
        word=_word(outcome, proved),
        reason=_reason(model, live, replace(outcome, word=_word(outcome, proved)), lower, upper, window),
        lower=lower,
        upper=upper,
        window=window,
        assumed=model.assumed,
        gravity=model.gravity,
        force=force,
        utilisation=None if force is None else utilisation(model.contacts, force),
        mechanism=rows,
        angle=_angles(live, lower, upper),
        certificate=proved.certificate,
        provenance=dict(outcome.provenance),
        warnings=warnings,
        loading=model.loading,
    )
    joints = moving_joints(result)
    loaded = [joint for joint in joints if joint.kind != "part"]
    governing = (loaded or list(joints))[0].contact if joints else None
    reason = f"{result.reason} {of_real_friction(joints)}" if result.word == "limit" else result.reason
    return replace(result, governing=governing, reason=reason)


def _word(outcome: LimitOutcome, proved: Proved) -> Any:
    """What of the solvers' word is left after the check."""
    if proved.unbounded:
        return "unbounded"
    if proved.falls:
        return "falls"
    if outcome.word in ("limit", "undecided", "unbounded"):
        if proved.upper is not None and proved.upper <= 0.0 and not (proved.lower is not None and proved.lower >= 0.0):
            return "falls"
        if proved.closed:
            return "limit"
    if outcome.word == "limit" and (proved.lower is None or proved.upper is None):
        return "undecided"
    return "undecided" if outcome.word == "unbounded" else outcome.word


def _reason(
    model: PreparedModel,
    live: Live,
    outcome: LimitOutcome,
    lower: float | None,
    upper: float | None,
    window: tuple[float, float] | None,
) -> str:
    if model.fixed.all():
        return "Every block is a support, so nothing can move."
    if model.idle:
        names = ", ".join(f"'{model.assembly.blocks[i].id}'" for i in model.idle[:3])
        return f"Nothing holds block {names}: it touches no other block and is no support."
    return reason_for_limit(live, outcome, lower, upper, window)


def _angles(live: Live, lower: float | None, upper: float | None) -> tuple[float | None, float | None] | None:
    """Degrees of a tilt."""
    if live.kind != "tilt":
        return None
    low, high = (None if t is None else float(np.rad2deg(np.arctan(t))) for t in (lower, upper))
    return low, high
