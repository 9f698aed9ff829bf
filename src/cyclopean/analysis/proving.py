"""From what the solvers claim to a result: write the certificate, have it checked, and only then say the word."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cyclopean.analysis.certificates import certify
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.analysis.equilibrium.components import component_labels, lightest
from cyclopean.analysis.equilibrium.deciding import Decision
from cyclopean.analysis.equilibrium.exact_balance import exact_balance
from cyclopean.analysis.equilibrium.polishing import Polished, Polisher
from cyclopean.analysis.equilibrium.rbe import Outcome
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.reasons import counted_on, reason_for
from cyclopean.analysis.settings import Settings
from cyclopean.analysis.verdict import Result, Settled, Word, relative_motion
from cyclopean.arrays import Floats
from cyclopean.assembly import Contacts
from cyclopean.proof import Report, verify
from cyclopean.statics import EquilibriumSystem, Schur

if TYPE_CHECKING:
    from cyclopean.analysis.coupled.search import CoupledOutcome
    from cyclopean.analysis.equilibrium.settlement import SettledOutcome

__all__ = [
    "Claim",
    "Judge",
    "coupled_claim",
    "nearest",
    "polished",
    "prove",
    "rigid_claim",
    "settled_claim",
    "spread",
    "utilisation",
]

Judge = Callable[[Any], Report]
Kind = Literal["rbe-state", "rbe-mechanism", "rbe-settled", "cra-state", "cra-tree", ""]
WORDS: dict[str, Word] = {
    "rbe-state": "stable",
    "rbe-settled": "stable",
    "rbe-mechanism": "unstable",
    "cra-state": "stable",
    "cra-tree": "unstable",
}


@dataclass(frozen=True, slots=True, eq=False)
class Claim:
    """What the solvers found, in scaled units; kind "" = nothing that could be proved."""

    kind: Kind
    f: Floats | None = None  # (q, 3)
    motion: Floats | None = None  # (6 m,): a mechanism, or the virtual displacement of a coupled state
    tree: Any = None
    part: EquilibriumSystem | None = None  # of the component that the tree is about; None = all
    state: Polished | None = None  # forces as a certificate wants them, where they are known already
    folds: tuple[int, ...] = ()  # points (of q) at which a search ended
    figures: dict[str, float] = field(default_factory=dict)  # how near it came
    provenance: dict[str, Any] = field(default_factory=dict)


def rigid_claim(outcome: Outcome) -> Claim:
    """What rigid-block equilibrium found."""
    kind: Kind = {"balanced": "rbe-state", "collapse": "rbe-mechanism", "undecided": ""}[outcome.word]  # type: ignore[assignment]
    figures = {"balance": outcome.balance, "bound": outcome.bound}
    state = outcome.state if isinstance(outcome, Decision) else None
    return Claim(kind, outcome.f, outcome.y, state=state, figures=figures, provenance=outcome.provenance)


def coupled_claim(outcome: "CoupledOutcome") -> Claim:
    """What coupled analysis found."""
    if outcome.word == "collapse":
        return Claim("rbe-mechanism", None, outcome.y, provenance=outcome.provenance)
    kind: Kind = {"coupled": "cra-state", "refuted": "cra-tree", "undecided": ""}[outcome.word]  # type: ignore[assignment]
    figures = {"merit": outcome.merit, "bound": outcome.bound}
    return Claim(
        kind, outcome.f, outcome.dq, outcome.tree, outcome.part, None, outcome.folds, figures, outcome.provenance
    )


def prove(
    model: PreparedModel,
    settings: Settings,
    system: EquilibriumSystem,
    claim: Claim,
    judge: Judge = verify,
    written: Callable[[PreparedModel, EquilibriumSystem, str, dict[str, Any]], dict[str, Any]] = certify,
) -> Result:
    """Turn a claim into a result; "stable" and "unstable" only where a certificate has passed the independent checker.

    Parameters
    ----------
    model : PreparedModel
        As it was analysed.
    settings : Settings
        What the user said.
    system : EquilibriumSystem
        Its equilibrium system.
    claim : Claim
        What the solvers found.
    judge : callable
        The independent checker, perhaps with a memory.
    written : callable
        Writes the certificate, as `certify` does.
    """
    proof, residuals = _proof(model, settings.bounds(), system, claim)
    certificate = written(model, system, claim.kind, proof) if proof else None
    report = judge(certificate) if certificate is not None else None
    proved = report is not None and report.proved
    if report is not None and "bound" in report.figures:
        residuals = residuals | {"bound": min(report.figures["bound"], 1e300)}
    word = WORDS[claim.kind] if proved else "undecided"
    force = proof.get("force") if word == "stable" else None
    shown = None if force is None else spread(system, model.contacts, force * system.force_unit)
    rows = _rows(model, proof["motion"]) if proved and "motion" in proof else None
    return Result(
        assembly=model.assembly,
        contacts=model.contacts,
        fixed=model.fixed,
        method=settings.chosen_method(),
        verdict=word,
        reason=_reason(model, settings, system, claim, report),
        assumed=model.assumed,
        gravity=model.gravity,
        residuals=residuals,
        force=shown,
        frame=model.contacts.frame,
        utilisation=None if shown is None else utilisation(model.contacts, shown),
        mechanism=rows if word == "unstable" else None,
        displacement=rows if word == "stable" and model.settled is None else None,
        settled=None if rows is None or word != "stable" else _settled(model, rows),
        certificate=certificate if proved else None,
        provenance={**claim.provenance, "settings": _said(settings)}
        | ({} if proved or not report else {"refused": report.reason}),
        warnings=model.warnings,
        loading=model.loading,
        drawing=model.drawing,
    )


def _settled(model: PreparedModel, rows: Floats) -> Settled | None:
    """How blocks and joints have moved, of the (n, 6) displacements of free blocks."""
    if model.settled is None:
        return None
    contacts, moved = model.contacts, rows + model.settled
    apart = relative_motion(contacts, moved, model.assembly.mass.centroid)
    gap = np.einsum("pij,pj->pi", contacts.frame[contacts.patch], apart) if len(contacts) else np.zeros((0, 3))
    return Settled(model.settled, moved, gap)


def settled_claim(outcome: "SettledOutcome", settlement: float) -> Claim:
    """What became of a settlement, whose largest displacement of a contact point is given (m)."""
    provenance = outcome.provenance | {"settlement": outcome.word}
    figures = {"balance": outcome.balance, "bound": outcome.bound}
    if outcome.word == "collapse":
        return Claim("rbe-mechanism", None, outcome.y, figures=figures, provenance=provenance)
    if outcome.word == "settled":
        figures |= {"settlement": settlement, "missed": outcome.missed}
        return Claim("rbe-settled", outcome.f, outcome.y, figures=figures, provenance=provenance)
    return Claim("", figures=figures, provenance=provenance)


def spread(system: EquilibriumSystem, contacts: Contacts, values: Floats) -> Floats:
    """Put values of the used points, a row each, back among all points; those between fixed blocks carry nothing."""
    full = np.zeros((len(contacts.point), *values.shape[1:]))
    full[system.used] = values
    return full


def _proof(
    model: PreparedModel, bounds: Bounds, system: EquilibriumSystem, claim: Claim
) -> tuple[dict[str, Any], dict[str, float]]:
    """What the certificate will hold beside the model, and the residuals, recomputed from what will stand there."""
    if claim.kind in ("rbe-state", "rbe-settled", "cra-state") and claim.f is not None:
        state = polished(model, system, claim.f) if claim.state is None else claim.state
        force = state.f
        shown = force if claim.state is None else claim.f  # the state of least norm; the proof's may press more evenly
        proof: dict[str, Any] = {"force": _in_patches(model, system, shown), "world_force": state.parts}
        if claim.kind == "rbe-state" or claim.motion is None:
            return proof, _state_residuals(system, state)
        if claim.kind == "rbe-settled":
            settled = {name: float(claim.figures[name]) for name in ("missed",)}
            motion = _turned(system, claim.motion.reshape(-1, 6)) * claim.figures["settlement"]
            return proof | {"motion": motion, "settlements": model.settled}, _state_residuals(system, state) | settled
        found = measure(system, bounds.unit(), force, claim.motion)
        residuals = _state_residuals(system, state) | {
            "gap": found.gap,
            "complementarity": found.complementarity,
            "alignment": found.alignment,
            "reach": found.reach,
            "sliding": found.sliding,
        }
        displacement = claim.motion.reshape(-1, 6) * bounds.eps
        return proof | {"bounds": bounds, "motion": _turned(system, displacement)}, residuals
    if claim.kind == "rbe-mechanism" and claim.motion is not None:
        fastest = max(float(np.max(np.abs(claim.motion), initial=0.0)), 1e-300)
        bound = {"bound": float(min(claim.figures["bound"], 1e300))} if "bound" in claim.figures else {}
        return {"motion": _turned(system, claim.motion.reshape(-1, 6) / fastest)}, bound
    if claim.kind == "cra-tree":
        from cyclopean.analysis.coupled.tree import tree_document

        names, part = [block.id for block in model.assembly.blocks], claim.part or system
        tree = {"bounds": bounds, "tree": tree_document(claim.tree, part, names, bounds.eps)}
        return tree | ({} if claim.part is None else {"component": names[part.free[0]]}), {}
    return {}, {name: float(value) for name, value in claim.figures.items() if np.isfinite(value)}


def _in_patches(model: PreparedModel, system: EquilibriumSystem, f: Floats) -> Floats:
    """(q, 3) scaled true forces in the frames of the patches, from which those of points may lean."""
    world = np.einsum("qi,qij->qj", system.true_forces(f), system.frame)
    frame = model.contacts.frame[model.contacts.patch[system.used]] if len(model.contacts) else system.frame
    return np.asarray(np.einsum("qij,qj->qi", frame, world))


def nearest(
    model: PreparedModel, settings: Settings, system: EquilibriumSystem, claim: Claim
) -> tuple[Floats | None, Floats | None]:
    """The best forces (P, 3), N, and displacement (n, 6) that a search of coupled analysis met; no state."""
    if claim.f is None or claim.motion is None:
        return None, None
    force = spread(system, model.contacts, _in_patches(model, system, claim.f) * system.force_unit)
    return force, _rows(model, _turned(system, claim.motion.reshape(-1, 6) * settings.bounds().eps))


def _turned(system: EquilibriumSystem, rows: Floats) -> Floats:
    """(m, 6) with the scaled rotations turned into radians a metre of the displacement's own unit."""
    turned = system.still(rows.ravel()).reshape(-1, 6).copy()
    turned[:, 3:] /= system.length_unit
    return turned


def _rows(model: PreparedModel, motion: Floats) -> Floats:
    """(n, 6): the motion of free blocks among all blocks."""
    rows = np.zeros((len(model.assembly), 6))
    rows[~model.fixed] = motion
    return rows


def polished(model: PreparedModel, system: EquilibriumSystem, f: Floats, schur: Schur | None = None) -> Polished:
    """Forces made ready for a certificate: every block balanced to 1e-10 of the lightest one's weight, if it can be."""
    balance = exact_balance(model, system)
    share = lightest(component_labels(system), balance.weight) / balance.weight
    return Polisher(system, balance, schur).polished(f, share)


def _state_residuals(system: EquilibriumSystem, state: Polished) -> dict[str, float]:
    """What is left, in own weights and own diagonals; and by how much forces leave their cones, in their own size."""
    f = state.f
    size = np.maximum(np.linalg.norm(f, axis=1), system.lighter)
    beyond = np.maximum(np.hypot(f[:, 1], f[:, 2]) - system.mu * f[:, 0], -f[:, 0])
    return {"equilibrium": state.worst, "cone": float(np.max(beyond / size, initial=0.0)) + 0.0}


def utilisation(contacts: Contacts, force: Floats) -> Floats:
    """(c,) |sum f_t| / (mu sum fn): the share of its friction that each patch as a whole uses.

    Where joints pull, fn is what presses beyond that: the true one plus strength times area.
    """
    if not len(contacts):
        return np.zeros(0)
    whole = np.add.reduceat(force, contacts.start[:-1], axis=0)
    whole[:, 0] += contacts.strength * contacts.area
    capacity = contacts.mu * whole[:, 0]
    noise = 1e-12 * float(np.max(whole[:, 0], initial=0.0))
    used = np.hypot(whole[:, 1], whole[:, 2])
    loaded = (whole[:, 0] > noise) & (used > noise)
    return np.where(loaded, used / np.where(loaded & (capacity > 0.0), capacity, 1.0), 0.0)


def _said(settings: Settings) -> dict[str, Any]:
    """The settings that bear on how the verdict was found."""
    if settings.chosen_method() == "rbe":
        return {"cone": settings.cone, "solver": settings.solver, "weights": list(settings.weights)}
    bounds = settings.bounds()
    return {
        "solver": settings.solver,
        "eps": bounds.eps,
        "eta": bounds.eta,
        "beta_min": bounds.beta,
        "seconds": settings.seconds,
        "nodes": settings.nodes,
    }


def _reason(
    model: PreparedModel, settings: Settings, system: EquilibriumSystem, claim: Claim, report: Report | None
) -> str:
    if report is not None and not report.proved:
        return f"A solver's answer did not survive the independent check: {report.reason}"
    said = reason_for(
        model,
        settings.bounds(),
        claim.kind,
        None if claim.motion is None else claim.motion.reshape(-1, 6),
        claim.figures | ({} if report is None else report.figures),
        claim.provenance | {"method": settings.chosen_method()},
    )
    return said + _worst_joint(model, system, claim) + counted_on(model, claim.kind)


def _worst_joint(model: PreparedModel, system: EquilibriumSystem, claim: Claim) -> str:
    """Which joint a mechanism opens or slides most."""
    if claim.kind != "rbe-mechanism" or claim.motion is None or not system.points:
        return ""
    if model.idle or claim.provenance.get("solver") == "connectivity":
        return ""
    moved = np.abs(system.gap(claim.motion.ravel()))
    normal, tangential = moved[:, 0], np.hypot(moved[:, 1], moved[:, 2])
    k = int(np.argmax(normal + tangential))
    contact, blocks = int(model.contacts.patch[system.used][k]), model.assembly.blocks
    a, b = (blocks[int(side[contact])].id for side in (model.contacts.a, model.contacts.b))
    return f" The joint of '{a}' and '{b}' {'opens' if np.max(normal) > np.max(tangential) else 'slides'} most."
