"""A model made ready for analysis: meshes checked, supports chosen, contacts found, gaps filled in."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np

from cyclopean.analysis.settings import DENSITY, GRAVITY, MU, Settings
from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import (
    Assembly,
    Contacts,
    Detection,
    Forgiven,
    Load,
    Loading,
    NearMisses,
    bearing,
    check_contacts,
    detect,
    grounded,
    length_tolerance,
    load_cases,
    loading,
    meant,
    mended,
    paired_friction,
    resolved_fields,
    resolved_loads,
    slips,
    supports,
    with_soil,
)
from cyclopean.errors import InputError
from cyclopean.geometry import detached_pieces, mesh_faults
from cyclopean.statics import EquilibriumSystem, equilibrium_system, turned_gravity
from cyclopean.texts import AUTO

__all__ = ["PreparedModel", "joined", "prepare"]

ROUNDS = 4  # in which a tolerance is found, one or two are usual
LIBRARIES = ("scipy.spatial", "shapely")  # of detection: loaded before the clock runs


@dataclass(frozen=True, slots=True, eq=False)
class PreparedModel:
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
    loading: Loading | None = None  # which loads act; those of `assembly` have their factors already
    settled: Floats | None = None  # (n, 6) m, rad: what the ground does to supports; None = nothing
    forgiven: Forgiven | None = None  # of the drawing, as it was said or found
    drawing: str = ""  # how many contacts there are only because it was forgiven something
    near: NearMisses | None = None  # what nearly touches and does not count; None = the file gives the contacts

    @property
    def mass(self) -> Floats:
        """(n,) kg."""
        return self.assembly.densities(self.density) * self.assembly.mass.volume

    def system(self) -> EquilibriumSystem:
        """A f = -p of its free blocks."""
        return equilibrium_system(self.assembly, self.contacts, self.fixed, self.gravity, self.density)

    def under(self, gravity: Floats, loads: Iterable[Load]) -> "PreparedModel":
        """The model with other gravity, (3,) m/s2, and other loads."""
        return replace(self, assembly=replace(self.assembly, loads=tuple(loads)), gravity=gravity)


def prepare(
    assembly: Assembly,
    settings: Settings | None = None,
    progress: Callable[[str], None] = lambda _: None,
    clock: dict[str, float] | None = None,
) -> PreparedModel:
    """Check the blocks, choose supports and loads, find or check contacts, fill in what is not given.

    Parameters
    ----------
    assembly : Assembly
        The model; contacts are detected where it gives none.
    settings : Settings
        What the user said; the defaults where not given.
    progress : callable
        Is told the name of each stage as it begins.
    clock : dict of str to float
        Is told when the libraries were loaded ("margin") and when the contacts were there ("contacts").

    Raises
    ------
    InputError
        Blocks that are not closed solids, contacts off their blocks, supports that do not exist.
    """
    settings, clock = Settings() if settings is None else settings, {} if clock is None else clock
    if not len(assembly):
        raise InputError("the model has no blocks")
    _refuse_faults(assembly)
    fixed, rule = supports(assembly, settings.supports)
    density = DENSITY if settings.density is None else settings.density
    chosen = loading(assembly, settings.combination, settings.factors)
    assembly = with_soil(assembly, settings.surcharge, settings.soil_height)
    progress("contacts")
    for library in LIBRARIES if assembly.contacts is None else ():
        import_module(library)
    clock["margin"] = time.perf_counter()
    found, forgiven = joined(assembly, settings, fixed)
    contacts, margin, warnings = found.contacts, found.tolerance, found.warnings
    if forgiven is not None and rule == "lowest":
        fixed = grounded(assembly, contacts, fixed, forgiven.gap)
    tolerance = _stated(assembly, margin)
    contacts, narrow = bearing(assembly, contacts, tolerance)
    clock["contacts"] = time.perf_counter()
    contacts, unsaid = paired_friction(assembly, contacts)
    acting, chosen = _acting(assembly, contacts, chosen, density)
    warnings = (
        *warnings,
        *slips(assembly, contacts),
        *_detached(assembly),
        *narrow,
        *unsaid,
        *_idle_options(assembly, contacts, settings),
    )
    assumed: dict[str, Any] = {}
    if np.isnan(contacts.mu).any() and settings.mu is None:
        assumed["mu"] = MU
    if settings.density is None and any(b.density is None for b in assembly.blocks):
        assumed["density"] = DENSITY
    if rule == "lowest":
        assumed["supports"] = "lowest"
    if settings.tolerance == AUTO and forgiven is not None:
        assumed["tolerance"] = forgiven.words()
    if settings.gravity is None:
        assumed["gravity"] = list(GRAVITY)
    gravity = np.array(settings.gravity or GRAVITY, float)
    if settings.tilt is not None:
        gravity = turned_gravity(gravity, *settings.tilt)
    if chosen is not None and chosen.factors["self"] != 1.0:
        gravity = chosen.factors["self"] * gravity
    touched = np.array([bool(b.held) for b in assembly.blocks], bool)  # what is partly held hangs on something
    touched[contacts.a] = touched[contacts.b] = True
    return PreparedModel(
        acting,
        _pulling(contacts.with_mu(MU if settings.mu is None else settings.mu), settings),
        fixed,
        gravity,
        density,
        tolerance,
        assumed,
        tuple(warnings),
        tuple(int(i) for i in np.flatnonzero(~touched & ~fixed)),
        chosen,
        _settled(assembly, fixed, settings),
        forgiven,
        found.forgiven,
        found.near,
    )


def _acting(
    assembly: Assembly, contacts: Contacts, chosen: Loading | None, density: float
) -> tuple[Assembly, Loading | None]:
    """The model with all loads at points, and which of them act; both say earth, water and fill."""
    pressed, fields = resolved_fields(assembly, contacts)
    acting = resolved_loads(pressed, chosen, density)
    if not fields:
        return acting, chosen
    return acting, replace(chosen or Loading("", dict.fromkeys(load_cases(assembly), 1.0)), fields=fields)


def joined(assembly: Assembly, settings: Settings, fixed: Bools) -> tuple[Detection, Forgiven | None]:
    """Contacts found, or those that are given held against the blocks; and what was forgiven.

    Parameters
    ----------
    assembly : Assembly
        The blocks (n).
    settings : Settings
        Its `tolerance`.
    fixed : (n,) bool
        Supports.

    Raises
    ------
    InputError
        Contacts that are given are not on their blocks.
    """
    forgiven = settings.forgiven()
    if assembly.contacts is not None:
        gap = None if forgiven is None else forgiven.gap
        contacts, furthest, warnings = check_contacts(assembly, assembly.contacts, gap)
        return Detection(contacts, (), warnings, furthest, None), forgiven
    found = detect(assembly, forgiven)
    for _ in range(ROUNDS if settings.tolerance == AUTO else 0):  # faces that are flat within more miss otherwise
        more = None if found.near is None else meant(assembly, found.contacts, found.near, fixed)
        wider = more if forgiven is None or more is None else forgiven.and_also(more)
        if wider is None or wider == forgiven:
            break
        forgiven, found = wider, detect(assembly, wider)
    return found, forgiven


def _refuse_faults(assembly: Assembly) -> None:
    faults = mesh_faults(assembly.mesh)
    if faults:
        more = f" (and {len(faults) - 1} more blocks with faults)" if len(faults) > 1 else ""
        name = assembly.blocks[faults[0][0]].id
        said = dict(mended(assembly).faults).get(name, f"{faults[0][1]}; mend its mesh")
        raise InputError(f"block '{name}' {said}{more}")


def _detached(assembly: Assembly) -> tuple[str, ...]:
    """Say which blocks are of several pieces: that they move as one is a guess at what was meant."""
    pieces = detached_pieces(assembly.mesh)
    several = np.flatnonzero(pieces > 1)
    if not len(several):
        return ()
    more = f" (and {len(several) - 1} more such blocks)" if len(several) > 1 else ""
    first = int(several[0])
    return (
        f"block '{assembly.blocks[first].id}' consists of {pieces[first]} detached pieces,"
        f" taken as one rigid body{more}",
    )


def _settled(assembly: Assembly, fixed: Bools, settings: Settings) -> Floats | None:
    """(n, 6) movements of supports, those of the settings before those of the model; None where there are none."""
    number = {block.id: i for i, block in enumerate(assembly.blocks)}
    rows = {one.block: one.motion for one in assembly.settlements}
    for name, motion in settings.settlement:
        if name not in number:
            raise InputError.of("settlement", name, f"block '{name}' is not in the model")
        rows[number[name]] = np.array(motion, float)
    for i in rows:
        if not fixed[i]:
            raise InputError(f"settlement of block '{assembly.blocks[i].id}': it is no support; only supports settle")
    moved = np.zeros((len(assembly), 6))
    for i, row in rows.items():
        moved[i] = row
    return moved if moved.any() else None


def _pulling(contacts: Contacts, settings: Settings) -> Contacts:
    """Fill in what joints may pull, where that was asked for; cohesion C is mu times it."""
    if settings.tension is not None:
        return contacts.with_tension(settings.tension)
    if settings.cohesion is None or not len(contacts):
        return contacts
    mu = contacts.mu
    if not (mu.min() == mu.max() and mu.min() > 0.0):
        raise InputError(
            f"`cohesion` {settings.cohesion:g}: needs one friction above zero at all contacts"
            f" (they have {mu.min():g} to {mu.max():g}); use `tension`"
        )
    return contacts.with_tension(settings.cohesion / float(mu[0]))


def _idle_options(assembly: Assembly, contacts: Contacts, settings: Settings) -> tuple[str, ...]:
    """Options that fill in what the model already says everywhere: a user may think that they won."""
    idle = []
    if settings.mu is not None and len(contacts) and not np.isnan(contacts.mu).any():
        idle.append(f"`mu` {settings.mu:g} has no effect: every contact of the model gives its own mu")
    points = int(np.count_nonzero(contacts.at_points))
    if points and (settings.tension is not None or settings.cohesion is not None):
        idle.append(f"{points} of {len(contacts)} contacts are points, which have no area to pull with: they stay dry")
    if settings.tension is not None and len(contacts) and not np.isnan(contacts.strength_given).any():
        idle.append(f"`tension` {settings.tension:g} has no effect: every contact of the model gives its own tension")
    if settings.density is not None and all(b.density is not None for b in assembly.blocks):
        idle.append(f"`density` {settings.density:g} has no effect: every block of the model gives its own density")
    return tuple(idle)


def _stated(assembly: Assembly, furthest: float) -> float:
    """The tolerance (m) a certificate states, given how far the furthest contact point lies off the faces.

    Twice that and at least the length tolerance, for the checker measures to the facets of faces that are not quite
    flat. Of a small block less of it counts there.
    """
    return 2.0 * max(furthest, length_tolerance(assembly))
