"""From a model to a verdict with a verified certificate."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from cyclopean.analysis.equilibrium.deciding import decide_rigid
from cyclopean.analysis.equilibrium.rbe import tension
from cyclopean.analysis.equilibrium.reference import parse_cone
from cyclopean.analysis.preparation import PreparedModel, prepare
from cyclopean.analysis.proving import Claim, Judge, coupled_claim, nearest, prove, rigid_claim, settled_claim, spread
from cyclopean.analysis.pyramids import rigid_with_pyramids, with_cones
from cyclopean.analysis.robust.search import drawings, require_known
from cyclopean.analysis.settings import Settings
from cyclopean.analysis.undecided import Undecided, folds_at, recut_of
from cyclopean.analysis.verdict import Result
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Contacts, bearing_cones
from cyclopean.errors import InputError, SolverError
from cyclopean.geometry import frames_from_normals
from cyclopean.proof import verify
from cyclopean.statics import EquilibriumSystem, contact_matrix

SPARED = (0.0, 0.003, 0.01, 0.03)  # rad by which cones are narrower still, one after the other
COUPLED = 6  # rounds of that in coupled analysis, each a search of its own
BISECTIONS = 40  # for how far a force may lean
NARROWINGS = 12  # rounds of narrowing cones that forces leave, two or three are usual; then all are narrowed

ROUNDED = 1e-9  # of a cosine: by which the checker, in whole numbers, may find it less
MARGIN = 1.001  # of beta_min, where a state was refused by a rounding error

__all__ = ["check", "decide"]

Warm = Callable[[EquilibriumSystem], Claim | None]


def check(
    assembly: Assembly,
    settings: Settings | None = None,
    progress: Callable[[str], None] = lambda _: None,
    warm: Claim | None = None,
    remedies: bool = False,
) -> Result:
    """Decide whether the assembly stands, and prove it.

    By coupled rigid-block analysis, or by rigid-block equilibrium alone where the settings say so. The verdict is
    "stable" or "unstable" only if a certificate of it has passed the independent checker, which knows nothing of the
    solvers; else it is "undecided".

    Parameters
    ----------
    assembly : Assembly
        The model; contacts are detected where it gives none.
    settings : Settings
        Options; the defaults where not given.
    progress : callable
        Is told the name of each stage as it begins.
    warm : Claim, optional
        An answer that is likely; what the checker does not accept of it is solved from nothing.
    remedies : bool
        Whether to try, where coupled analysis stays undecided, what would decide it: a larger eta, more friction.

    Raises
    ------
    InputError
        Blocks that are not closed solids, contacts off their blocks, supports or loads that do not exist, joints
        that pull with a method that has none.
    """
    settings = Settings() if settings is None else settings
    clock = {"start": time.perf_counter()}
    model = prepare(assembly, settings, progress, clock)
    if settings.within is not None:
        require_known(model)
    settings, warnings = _method_for(model, settings)
    if warm is not None and warm.kind == "rbe-state" and settings.chosen_method() == "cra":
        warm = None  # balance alone is less than coupled analysis asks for
    if model.settled is not None:
        warm = _after_settlement(model, model.settled)
        if warm is None:
            model = replace(model, settled=None)
            warnings = (*warnings, "no free block touches a support that settles, so the settlement changes nothing")
    result, claim = _decided(model, settings, lambda _: warm, verify, progress)
    if remedies and result.undecided is not None:
        from cyclopean.analysis.what_would_decide import what_would_decide

        result = what_would_decide(model, settings, result, clock["contacts"] + settings.seconds, progress)
    if (asked := settings.drawings()) is not None:
        progress("drawings around it")
        result = drawings(model, result, *asked)
    if settings.penalty:
        result = _glued(model, settings, claim, result)
    if not settings.method and (only := settings.asks_for_rbe()):
        warnings = (*warnings, f"{only}: only rigid-block equilibrium has it, so the method is rbe")
    seconds = {
        "contacts": clock["contacts"] - clock["margin"],
        **result.seconds,
        "total": time.perf_counter() - clock["start"],
    }
    return replace(result, seconds=seconds, warnings=(*result.warnings, *warnings))


def decide(
    model: PreparedModel,
    settings: Settings,
    warm: Warm = lambda _: None,
    judge: Judge = verify,
    progress: Callable[[str], None] = lambda _: None,
) -> Result:
    """Decide whether a prepared model stands, with a verified certificate.

    Parameters
    ----------
    model : PreparedModel
        Blocks, contacts, loads.
    settings : Settings
        Method, solver and budget.
    warm : callable
        Gives a claim for the system of the model, or None: what the judge does not accept is solved from nothing. A
        claim of nothing says that the search is over.
    judge : callable
        The independent checker.
    progress : callable
        Is told the name of each stage as it begins.
    """
    return _decided(model, settings, warm, judge, progress)[0]


def _decided(
    model: PreparedModel, settings: Settings, warm: Warm, judge: Judge, progress: Callable[[str], None]
) -> tuple[Result, Claim]:
    """The result, with its seconds, and the claim that it came of."""
    clock = [time.perf_counter()]
    if settings.cone != "exact":
        return _with_pyramids(model, settings, judge, progress)
    system = model.system()
    progress("solving")
    claim = warm(system)
    known = None if claim is None else prove(model, settings, system, claim, judge)
    if claim is None or known is None or (known.verdict == "undecided" and claim.kind and model.settled is None):
        claim, known = solved(model, settings, system, progress), None
    clock.append(time.perf_counter())
    progress("verifying")
    result = prove(model, settings, system, claim, judge) if known is None else known
    if result.verdict == "undecided" and claim.kind == "cra-state":  # beta_min to the last bit was too little
        claim = solved(model, settings, system, progress, MARGIN)
        result = prove(model, settings, system, claim, judge)
    result = _on_edges(model, settings, system, result, progress)
    result = _within_faces(model, settings, system, result, progress)
    if result.verdict == "undecided" and settings.chosen_method() == "cra":
        result = _explained(model, settings, system, claim, result, judge)
    clock.append(time.perf_counter())
    seconds = {"solve": clock[1] - clock[0], "verify": clock[2] - clock[1], "total": clock[2] - clock[0]}
    return replace(result, seconds=seconds), claim


def _with_pyramids(
    model: PreparedModel, settings: Settings, judge: Judge, progress: Callable[[str], None]
) -> tuple[Result, Claim]:
    """The verdict with pyramids in place of friction cones, and beside it that with the cones themselves."""
    exact = replace(settings, cone="exact")
    progress("solving with pyramids")
    result, claim = rigid_with_pyramids(model, settings, judge)
    if settings.chosen_method() == "cra" and result.verdict != "unstable":
        result, claim = _between_cones(model, settings, judge, progress)
    plain = decide(model, exact, judge=judge, progress=progress).verdict
    only = f"Only with friction pyramids, {settings.cone}; with friction cones it is {plain}. "
    same = f"With friction pyramids, {settings.cone}, as with friction cones. "
    reason = (same if plain == result.verdict else only) + result.reason
    provenance = result.provenance | {"cone": settings.cone, "exact_cone": plain}
    return replace(result, contacts=model.contacts, reason=reason, provenance=provenance), claim


def _between_cones(
    model: PreparedModel, settings: Settings, judge: Judge, progress: Callable[[str], None]
) -> tuple[Result, Claim]:
    """What coupled analysis says of pyramids: a state in the cones inside them, or that those round them have none."""
    cone, exact = parse_cone(settings.cone), replace(settings, cone="exact")
    found = _decided(with_cones(model, cone, inside=True), exact, lambda _: None, judge, progress)
    if found[0].verdict == "stable":
        return found
    found = _decided(with_cones(model, cone, inside=False), exact, lambda _: None, judge, progress)
    if found[0].verdict == "unstable":
        return found
    said = (
        "Coupled analysis finds a state neither in the cones inside the pyramids, nor proof that those round them have"
        " none; more faces bring the two nearer to each other."
    )
    nothing: dict[str, Any] = dict.fromkeys(
        ("force", "utilisation", "mechanism", "displacement", "certificate", "undecided")
    )
    return replace(found[0], verdict="undecided", reason=said, residuals={}, **nothing), Claim("")


def _explained(
    model: PreparedModel, settings: Settings, system: EquilibriumSystem, claim: Claim, result: Result, judge: Judge
) -> Result:
    """A result that coupled analysis leaves undecided, with what equilibrium alone says and where the search ends."""
    alone = decide(model, replace(settings, method="rbe"), judge=judge)
    folds = folds_at(model, system.used[list(claim.folds)])
    force, motion = nearest(model, settings, system, claim)
    known = Undecided(result.reason, alone.verdict, settings.bounds().eta, force, motion, folds, recut_of(model, folds))
    provenance = result.provenance | {"rbe": alone.verdict, "folds": known.stones()}
    return replace(result, reason=known.reason(), undecided=known, provenance=provenance)


def _method_for(model: PreparedModel, settings: Settings) -> tuple[Settings, tuple[str, ...]]:
    """Rigid-block equilibrium where the model asks for it and no method was said, with a warning.

    Raises
    ------
    InputError
        An option does not go with joints that pull, or with a settlement.
    """
    pulls, settles = bool(model.contacts.strength.any()), model.settled is not None
    if not pulls and not settles:
        return settings, ()
    what = "a settlement" if settles else "joints that pull"
    if pulls and settles:
        raise InputError("a settlement and joints that pull do not go together: what has opened pulls no more")
    if settings.penalty:
        raise InputError(f"`penalty` measures the tension that dry joints would need; it does not go with {what}")
    if settles and (settings.cone != "exact" or settings.weights != (1.0, 1.0) or settings.solver != "auto"):
        raise InputError("a settlement is answered in exact cones alone: leave out `cone`, `weights` and `solver`")
    if settings.method == "cra":
        raise InputError(f"{what}: only rigid-block equilibrium has that; use `method` rbe")
    if settings.method == "rbe" or settings.asks_for_rbe():
        return settings, ()
    told = f"the model has {what}: only rigid-block equilibrium has that, so the method is rbe"
    return replace(settings, method="rbe"), (told,)


def _after_settlement(model: PreparedModel, ground: Floats) -> Claim | None:
    """What becomes of a settlement; None where no contact point moves with the ground."""
    from cyclopean.analysis.equilibrium.settlement import settle, support_gap

    system = model.system()
    scaled = ground / system.length_unit
    scaled[:, 3:] *= system.length_unit
    patch = model.contacts.patch[system.used]
    gap = support_gap(system, scaled[model.contacts.a[patch]], scaled[model.contacts.b[patch]])
    size = float(np.max(np.linalg.norm(gap, axis=1), initial=0.0))
    if not size > 0.0:
        return None
    return settled_claim(settle(system, gap / size), size * system.length_unit)


def _on_edges(
    model: PreparedModel, settings: Settings, system: EquilibriumSystem, result: Result, progress: Callable[[str], None]
) -> Result:
    """The result, or one with forces that a proof takes where edges lie on edges, where it is open for want of them.

    Between the faces that meet there a point has one normal. Forces about two of them have to be in narrower cones,
    so that they add up to one about a normal between. Which points these are, the checker tells from the faces; here
    all single points of two blocks count, so that it may take some of less friction than they have.
    """
    if "friction cone" not in str(result.provenance.get("refused")) or model.settled is not None:
        return result
    mu = np.minimum(_edge_friction(model.contacts)[model.contacts.patch[system.used]], system.mu)
    if not (mu < system.mu).any():
        return result
    less = replace(system, mu=mu)
    second = prove(model, settings, less, solved(model, settings, less, progress))
    return second if second.verdict == "stable" else result


def _edge_friction(contacts: Contacts) -> Floats:
    """(c,) friction that adds up, of single points of two blocks with different normals, to that about one of them.

    mu'^2 = mu^2 (1 + c) / (2 + mu^2 (1 - c)), with c the least cosine between any two of the normals.
    """
    mu, sides = contacts.mu.copy(), dict[tuple[int, int], list[int]]()
    for k in np.flatnonzero(contacts.at_points).tolist():
        a, b = int(contacts.a[k]), int(contacts.b[k])
        sides.setdefault((min(a, b), max(a, b)), []).append(k)
    for rows in sides.values():
        normal = np.where(contacts.a[rows] < contacts.b[rows], 1.0, -1.0)[:, None] * contacts.normal_given[rows]
        cosine = min(float((normal @ normal.T).min()), 1.0) - ROUNDED
        if cosine < 1.0 - 2.0 * ROUNDED:
            mu[rows] *= np.sqrt(max(1.0 + cosine, 0.0) / (2.0 + contacts.mu[rows] ** 2 * (1.0 - cosine)))
    return mu


def _within_faces(
    model: PreparedModel,
    settings: Settings,
    system: EquilibriumSystem,
    result: Result,
    progress: Callable[[str], None] = lambda _: None,
) -> Result:
    """The result, or one with forces inside the cones about the faces' normals too, where surfaces lean and it is open.

    What a rough or curved joint bears has to be friction of the faces as well. By rigid-block equilibrium a narrower
    cone, which lies inside all of them, is asked for at every point that leaves one, until none does. Coupled analysis
    wants its displacements along the contacts' normals: it keeps to these, with less friction at such points by what
    the way of their forces asks for; where that leads nowhere, with less at all points by the lean. A mechanism needs
    no such care.
    """
    contacts = model.contacts
    if "refused" not in result.provenance or not (contacts.leaning > 0.0).any() or model.settled is not None:
        return result
    if settings.chosen_method() == "rbe":
        for margin in SPARED:
            found = _narrowed(model, settings, system, margin)
            second = result if found is None else prove(model, settings, *found)
            if found is None or second.verdict == "stable":
                break
    else:
        found = _less_rubbing(model, settings, system, progress)
        second = result if found is None else prove(model, settings, *found)
        if second.verdict != "stable":
            lean = np.nan_to_num(contacts.leaning, nan=0.0)[contacts.patch[system.used]]
            system = replace(system, mu=np.tan(np.maximum(np.arctan(system.mu) - lean, 0.0)))
            second = prove(model, settings, system, solved(model, settings, system, progress))
    if second.verdict == "stable" or "friction cone" not in str(result.provenance["refused"]):
        return second if second.verdict == "stable" else result
    k = int(np.nanargmax(contacts.leaning))
    a, b = (model.assembly.blocks[int(side[k])].id for side in (contacts.a, contacts.b))
    said = (
        "Forces balance every load within friction of the contacts' planes, but none were found within friction of the"
        f" faces too, which lean from these planes by up to {np.degrees(contacts.leaning[k]):.2g} degrees ('{a}' and"
        f" '{b}'). Flatter faces or more friction may decide it."
    )
    return replace(result, reason=said)


def _narrowed(
    model: PreparedModel, settings: Settings, system: EquilibriumSystem, margin: float
) -> tuple[EquilibriumSystem, Claim] | None:
    """Forces inside all cones, with the system that they are of; None where narrower cones leave no state.

    The cones are narrower by a margin (rad): faces that are not flat are cut otherwise by the checker.
    """
    cones = bearing_cones(model.assembly, model.contacts, model.tolerance)
    normals, axis, mu = (part[system.used] for part in cones)
    mu, limit = (np.tan(np.maximum(np.arctan(x) - margin, 0.0)) for x in (mu, system.mu))
    narrow, places = np.zeros(system.points, bool), (system.row_a, system.row_b, system.arm_a, system.arm_b)
    for round_ in range(NARROWINGS + 1):
        frame = np.where(narrow[:, None, None], frames_from_normals(axis), system.frame)
        matrix = contact_matrix(system.blocks, *places, frame)
        part = replace(system, frame=frame, A=matrix, mu=np.where(narrow, mu, system.mu))
        claim = solved(model, settings, part)
        if claim.kind != "rbe-state" or claim.state is None:
            return None
        force = np.einsum("qi,qij->qj", claim.state.f, frame)
        along = np.einsum("qj,qij->qi", force, normals)
        across = np.sqrt(np.maximum(np.einsum("qj,qj->q", force, force)[:, None] - along**2, 0.0))
        outside = (across > limit[:, None] * along * (1.0 - 1e-9)).any(1) & force.any(1) & ~narrow
        if not outside.any():
            return part, claim
        narrow |= outside | (round_ == NARROWINGS - 1)  # forces of arches and domes wander from joint to joint
    return None


def _less_rubbing(
    model: PreparedModel, settings: Settings, system: EquilibriumSystem, progress: Callable[[str], None]
) -> tuple[EquilibriumSystem, Claim] | None:
    """A coupled state inside all cones, with the system that it is of; None where none was found."""
    normals = bearing_cones(model.assembly, model.contacts, model.tolerance)[0][system.used]
    limit, began = system.mu, time.perf_counter()
    for _ in range(COUPLED):
        left = settings.seconds - (time.perf_counter() - began)  # all searches together have the time of one
        if not left > 0.0:
            return None
        claim = solved(model, replace(settings, seconds=left), system, progress)
        if claim.kind != "cra-state" or claim.f is None:
            return None
        force = np.einsum("qi,qij->qj", claim.f, system.frame)
        along = np.einsum("qj,qij->qi", force, normals)
        across = np.sqrt(np.maximum(np.einsum("qj,qj->q", force, force)[:, None] - along**2, 0.0))
        outside = (across > limit[:, None] * along * (1.0 - 1e-9)).any(1) & (along[:, 0] > 0.0)
        if not outside.any():
            return system, claim
        may = np.minimum(_leaning(force, normals, limit), system.mu)
        system = replace(system, mu=np.where(outside, may, system.mu))
    return None


def _leaning(force: Floats, normals: Floats, mu: Floats) -> Floats:
    """(P,) how far forces (P, 3) may lean the way they do, over their part along the first of some normals (P, 3, 3).

    They stay in the cones of friction about all of these; 0 where one of them does not hold the first normal.
    """
    axis = normals[:, 0]
    across = force - np.einsum("qi,qi->q", force, axis)[:, None] * axis
    across /= np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]
    least, most = np.zeros(len(force)), mu.copy()
    for _ in range(BISECTIONS):
        middle = (least + most) / 2.0
        way = axis + middle[:, None] * across
        cosine = np.einsum("qij,qj->qi", normals, way).min(axis=1) / np.linalg.norm(way, axis=1)
        inside = cosine * np.sqrt(1.0 + mu**2) >= 1.0 + 1e-9
        least, most = np.where(inside, middle, least), np.where(inside, most, middle)
    return least


def solved(
    model: PreparedModel,
    settings: Settings,
    system: EquilibriumSystem,
    progress: Callable[[str], None] = lambda _: None,
    slides: float = 1.0,
) -> Claim:
    """What the solvers of the chosen method claim; coupled states slide `slides` times beta_min at least."""
    if settings.chosen_method() == "rbe":
        return rigid_claim(decide_rigid(model, system, settings.solver, settings.weights))
    from cyclopean.analysis.coupled.search import solve_cra

    rigid, bounds = decide_rigid(model, system, settings.solver), settings.bounds().unit()
    bounds = replace(bounds, beta=slides * bounds.beta)
    return coupled_claim(solve_cra(system, bounds, settings, progress, rigid))


def _glued(model: PreparedModel, settings: Settings, claim: Claim, result: Result) -> Result:
    """The result with the tension at each contact point by the penalty form; the verdict stands anyway."""
    from cyclopean.analysis.coupled.penalty_form import coupled_tension

    system, exact = model.system(), True
    try:
        if settings.chosen_method() == "rbe":
            pull = tension(system)[1]
        else:
            known = (claim.f, claim.motion) if claim.f is not None and claim.motion is not None else None
            state = known if claim.kind == "cra-state" else None
            pull, found = coupled_tension(system, settings.bounds().unit(), state, settings.seconds)
            exact = found.found
    except SolverError:
        return replace(result, warnings=(*result.warnings, "`penalty`: the tension could not be measured"))
    told = () if exact else ("`penalty`: not even glue makes a coupled state; the tension shown would merely balance",)
    pull = spread(system, model.contacts, pull * system.force_unit)
    return replace(result, tension=pull, tension_exact=exact, warnings=(*result.warnings, *told))
