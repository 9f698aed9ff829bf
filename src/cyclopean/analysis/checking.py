"""From a model to a verdict with a verified certificate."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np

from cyclopean.analysis.certificates import certify, inner_forces, world_forces
from cyclopean.analysis.rbe import BALANCE, COLLAPSE, Outcome, solve_rbe, tension
from cyclopean.analysis.reference import parse_cone
from cyclopean.analysis.verdict import Result, Word
from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import Assembly, Contacts, check_contacts, detect, length_tolerance, supports
from cyclopean.errors import InputError, SolverError
from cyclopean.geometry import mesh_faults
from cyclopean.proof import Report, verify
from cyclopean.statics import EquilibriumSystem, equilibrium_system, turned_gravity

__all__ = ["DENSITY", "GRAVITY", "MU", "Settings", "check"]

MU = 0.84  # tan 40 degrees, as both reference systems
DENSITY = 2400.0  # kg/m3
GRAVITY = (0.0, 0.0, -9.80665)  # m/s2
LIBRARIES = ("clarabel", "rslab", "scipy.sparse.csgraph", "scipy.spatial", "shapely")  # loaded before the clock runs


@dataclass(frozen=True, slots=True)
class Settings:
    """What a user may say about an analysis; None = not said, a default is assumed and reported."""

    method: str = "rbe"
    mu: float | None = None
    density: float | None = None  # kg/m3
    supports: str = ""  # "", "below=Z", "ids=a,b"
    gravity: tuple[float, float, float] | None = None  # m/s2
    tilt: tuple[float, float] | None = None  # degrees, azimuth in degrees
    tolerance: float | None = None  # m
    cone: str = "exact"
    solver: str = "auto"
    weights: tuple[float, float] = (1.0, 1.0)  # normal, tangential
    penalty: bool = False  # measure the tension that a state would need

    def __post_init__(self) -> None:
        if self.method == "cra":
            raise InputError("--method cra: coupled rigid-block analysis is not in this version; use --method rbe")
        if self.method != "rbe":
            raise InputError(f"--method {self.method}: expected rbe")
        if self.mu is not None and not (0.0 <= self.mu < np.inf):
            raise InputError(f"--mu {self.mu:g}: expected a number >= 0")
        if self.density is not None and not (0.0 < self.density < np.inf):
            raise InputError(f"--density {self.density:g}: expected a positive number of kg/m3")
        if self.tolerance is not None and not (0.0 < self.tolerance < np.inf):
            raise InputError(f"--tolerance {self.tolerance:g}: expected a positive length in metres")
        for name, values in (("gravity", self.gravity), ("tilt", self.tilt)):
            if values is not None and not np.isfinite(values).all():
                raise InputError(f"--{name}: expected finite numbers")


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """A model ready for analysis, and what had to be assumed for it."""

    assembly: Assembly
    contacts: Contacts
    fixed: Bools
    gravity: Floats
    density: float
    tolerance: float
    assumed: dict[str, Any]
    warnings: tuple[str, ...]
    idle: tuple[int, ...]  # free blocks that touch nothing


def check(
    assembly: Assembly, settings: Settings | None = None, progress: Callable[[str], None] = lambda _: None
) -> Result:
    """Decide whether the assembly stands by rigid-block equilibrium, and prove it.

    The verdict is "stable" or "unstable" only if a certificate of it has passed the independent checker, which knows
    nothing of the solvers; else it is "undecided".

    Parameters
    ----------
    assembly : Assembly
        The model; contacts are detected where it gives none.
    settings : Settings
        Options; the defaults where not given.
    progress : callable
        Is told the name of each stage as it begins.

    Raises
    ------
    InputError
        Blocks that are not closed solids, contacts off their blocks, supports that do not exist.
    """
    settings = Settings() if settings is None else settings
    clock = {"start": time.perf_counter()}
    model = _prepared(assembly, settings, clock, progress)
    progress("solving")
    system = equilibrium_system(model.assembly, model.contacts, model.fixed, model.gravity, model.density)
    outcome = solve_rbe(system, settings.solver, parse_cone(settings.cone), settings.weights)
    clock["solved"] = time.perf_counter()
    progress("verifying")
    result = _proved(model, settings, system, outcome)
    clock["verified"] = time.perf_counter()
    pull = _glue(model, system) if settings.penalty else None
    seconds = {
        "contacts": clock["contacts"] - clock["margin"],
        "solve": clock["solved"] - clock["contacts"],
        "verify": clock["verified"] - clock["solved"],
        "total": time.perf_counter() - clock["start"],
    }
    if settings.penalty and pull is None:
        result = replace(result, warnings=(*result.warnings, "--penalty: the tension could not be measured"))
    return replace(result, seconds=seconds, tension=pull)


def _glue(model: _Model, system: EquilibriumSystem) -> Floats | None:
    """(P,) N of tension at each contact point by the penalty form; None where that fails: the verdict stands anyway."""
    try:
        return _spread(system, model.contacts, tension(system)[1] * system.force_unit)
    except SolverError:
        return None


def _prepared(
    assembly: Assembly, settings: Settings, clock: dict[str, float], progress: Callable[[str], None]
) -> _Model:
    """Check the blocks, choose supports, find or check contacts, fill in what is not given."""
    if not len(assembly):
        raise InputError("the model has no blocks")
    faults = mesh_faults(assembly.mesh)
    if faults:
        more = f" (and {len(faults) - 1} more blocks with faults)" if len(faults) > 1 else ""
        raise InputError(f"block '{assembly.blocks[faults[0][0]].id}' {faults[0][1]}{more}; mend its mesh")
    fixed, rule = supports(assembly, settings.supports, settings.tolerance)
    progress("contacts")
    for library in LIBRARIES:
        import_module(library)
    clock["margin"] = time.perf_counter()
    if assembly.contacts is None:
        found = detect(assembly, settings.tolerance)
        contacts, warnings, margin = found.contacts, found.warnings, found.tolerance
    else:
        contacts, margin, warnings = check_contacts(assembly, assembly.contacts, settings.tolerance)
    clock["contacts"] = time.perf_counter()
    warnings = (*warnings, *_idle_options(assembly, contacts, settings))
    assumed: dict[str, Any] = {}
    if np.isnan(contacts.mu).any() and settings.mu is None:
        assumed["mu"] = MU
    if settings.density is None and any(b.density is None for b in assembly.blocks):
        assumed["density"] = DENSITY
    if rule == "lowest":
        assumed["supports"] = "lowest"
    if settings.gravity is None:
        assumed["gravity"] = list(GRAVITY)
    gravity = np.array(settings.gravity or GRAVITY, float)
    if settings.tilt is not None:
        gravity = turned_gravity(gravity, *settings.tilt)
    touched = np.zeros(len(assembly), bool)
    touched[contacts.a] = touched[contacts.b] = True
    return _Model(
        assembly,
        contacts.with_mu(MU if settings.mu is None else settings.mu),
        fixed,
        gravity,
        DENSITY if settings.density is None else settings.density,
        _stated(assembly, fixed, margin),
        assumed,
        tuple(warnings),
        tuple(int(i) for i in np.flatnonzero(~touched & ~fixed)),
    )


def _idle_options(assembly: Assembly, contacts: Contacts, settings: Settings) -> tuple[str, ...]:
    """Options that fill in what the model already says everywhere: a user may think that they won."""
    idle = []
    if settings.mu is not None and len(contacts) and not np.isnan(contacts.mu).any():
        idle.append(f"--mu {settings.mu:g} has no effect: every contact of the model gives its own mu")
    if settings.density is not None and all(b.density is not None for b in assembly.blocks):
        idle.append(f"--density {settings.density:g} has no effect: every block of the model gives its own density")
    return tuple(idle)


def _stated(assembly: Assembly, fixed: Bools, furthest: float) -> float:
    """The tolerance (m) a certificate states, given how far the furthest contact point lies off the faces.

    Twice that and at least the length tolerance, for the checker measures to the facets of faces that are not quite
    flat; but no more than it accepts unless the contacts need it.
    """
    free = assembly.mesh.vertex[~fixed[assembly.mesh.vertex_body]]
    share = 0.00499 * float(np.linalg.norm(np.ptp(free, axis=0))) if len(free) else np.inf
    wide = 2.0 * max(furthest, length_tolerance(assembly))
    return max(furthest * (1.0 + 1e-6), min(wide, share))


def _proved(model: _Model, settings: Settings, system: EquilibriumSystem, outcome: Outcome) -> Result:
    """Write the certificate of what the solvers claim, have it checked, and only then say the word."""
    force = velocity = certificate = None
    residuals: dict[str, float] = {}
    if outcome.word == "balanced" and outcome.f is not None:
        force = inner_forces(outcome.f, system.mu, _blur(model.contacts)[model.contacts.patch[system.used]])
        residuals = _state_residuals(system, force)
        certificate = _certificate(model, system, force=world_forces(system, force))
    elif outcome.word == "collapse" and outcome.y is not None:
        velocity = _velocity(system, outcome.y)
        residuals = {"bound": float(min(outcome.bound, 1e300))}
        certificate = _certificate(model, system, velocity=velocity)
    report = verify(certificate) if certificate is not None else None
    word, reason = _worded(model, outcome, report, velocity)
    contacts = model.contacts
    shown = None if force is None or word != "stable" else _spread(system, contacts, force * system.force_unit)
    moves = None
    if velocity is not None and word == "unstable":
        moves = np.zeros((len(model.assembly), 6))
        moves[system.free] = velocity
    return Result(
        assembly=model.assembly,
        contacts=contacts,
        fixed=model.fixed,
        method=settings.method,
        verdict=word,
        reason=reason,
        assumed=model.assumed,
        gravity=model.gravity,
        residuals=residuals,
        force=shown,
        frame=contacts.frame,
        utilisation=None if shown is None else _utilisation(contacts, shown),
        mechanism=moves,
        certificate=certificate if word != "undecided" else None,
        provenance={
            **outcome.provenance,
            "settings": {"cone": settings.cone, "solver": settings.solver, "weights": list(settings.weights)},
        },
        warnings=model.warnings,
    )


def _certificate(model: _Model, system: EquilibriumSystem, **proof: Floats) -> dict[str, Any]:
    return certify(
        model.assembly, model.contacts, model.fixed, model.gravity, model.density, system, model.tolerance, **proof
    )


def _blur(contacts: Contacts) -> Floats:
    """(c,) angle by which rounding may turn the normal of each patch: worse the thinner it is."""
    if not len(contacts):
        return np.zeros(0)
    low = np.minimum.reduceat(contacts.point, contacts.start[:-1], axis=0)
    high = np.maximum.reduceat(contacts.point, contacts.start[:-1], axis=0)
    return np.asarray(4e-16 * np.sum((high - low) ** 2, 1) / contacts.area)


def _state_residuals(system: EquilibriumSystem, f: Floats) -> dict[str, float]:
    total = float(np.sum(np.linalg.norm(system.p.reshape(-1, 6)[:, :3], axis=1))) or 1.0
    tangent = np.hypot(f[:, 1], f[:, 2])
    beyond = np.max([np.max(tangent - system.mu * f[:, 0], initial=0.0), np.max(-f[:, 0], initial=0.0)])
    return {"equilibrium": float(np.linalg.norm(system.residual(f))) / total, "cone": float(beyond) / total + 0.0}


def _velocity(system: EquilibriumSystem, y: Floats) -> Floats:
    """(m, 6) m/s and rad/s: the scaled mechanism with its fastest block at 1 m/s (or turning at 1 m/s at V^(1/3))."""
    rows = y.reshape(-1, 6) / max(float(np.max(np.abs(y), initial=0.0)), 1e-300)
    rows = rows.copy()
    rows[:, 3:] /= system.length_unit
    return rows


def _spread(system: EquilibriumSystem, contacts: Contacts, values: Floats) -> Floats:
    """Put values of the used points back among all contact points; points between fixed blocks carry nothing."""
    full = np.zeros((len(contacts.point), *values.shape[1:]))
    full[system.used] = values
    return full


def _utilisation(contacts: Contacts, force: Floats) -> Floats:
    """(c,) |sum f_t| / (mu sum fn): the share of its friction that each patch as a whole uses."""
    if not len(contacts):
        return np.zeros(0)
    whole = np.add.reduceat(force, contacts.start[:-1], axis=0)
    capacity = contacts.mu * whole[:, 0]
    noise = 1e-12 * float(np.max(whole[:, 0], initial=0.0))
    used = np.hypot(whole[:, 1], whole[:, 2])
    loaded = (whole[:, 0] > noise) & (used > noise)
    return np.where(loaded, used / np.where(loaded & (capacity > 0.0), capacity, 1.0), 0.0)


def _worded(model: _Model, outcome: Outcome, report: Report | None, velocity: Floats | None) -> tuple[Word, str]:
    """The verdict and one sentence for it."""
    blocks = model.assembly.blocks
    if report is not None and report.proved and outcome.word == "balanced":
        if model.fixed.all():
            return "stable", "Every block is a support, so nothing can move."
        return "stable", "Compression and friction at the contacts can balance every load on every block."
    if report is not None and report.proved and outcome.word == "collapse" and velocity is not None:
        if model.idle:
            names = ", ".join(f"'{blocks[i].id}'" for i in model.idle[:3])
            more = f" and {len(model.idle) - 3} more" if len(model.idle) > 3 else ""
            return "unstable", f"Nothing holds block {names}{more}: it touches no other block and is no support."
        if outcome.provenance.get("solver") == "connectivity":
            return "unstable", "A group of blocks is not connected to any support, so it falls."
        speed = np.linalg.norm(velocity[:, :3], axis=1)
        moving = int(np.sum(np.abs(velocity).max(axis=1) > 1e-6 * np.abs(velocity).max(initial=0.0)))
        fastest = blocks[int(np.flatnonzero(~model.fixed)[int(np.argmax(speed))])].id
        return "unstable", (
            f"A collapse mechanism exists: {moving} of {len(velocity)} free blocks move, '{fastest}' the fastest,"
            " and the loads drive the motion."
        )
    if report is not None:
        return "undecided", f"A solver's answer did not survive the independent check: {report.reason}"
    balance = f"best residual {outcome.balance:.1e} of the loads" if np.isfinite(outcome.balance) else "none at all"
    bound = f"best bound {outcome.bound:.1e}" if outcome.bound > 0.0 else "none at all"
    return "undecided", (
        f"Neither a state of equilibrium ({balance}, {BALANCE:.0e} wanted) nor a mechanism ({bound}, {COLLAPSE:.0e}"
        " wanted) was found."
    )
