"""Certificates: the model and the proof in world units, as the independent checker wants them."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from cyclopean.analysis.preparation import PreparedModel
from cyclopean.arrays import Floats
from cyclopean.assembly import Contacts
from cyclopean.errors import InputError
from cyclopean.proof import seal
from cyclopean.statics import EquilibriumSystem

__all__ = ["certify", "flushed", "force_rows", "inner_forces", "inner_slope"]

FINAL = (
    "tree",
    "component",
    "within",
    "points",
    "forces",
    "ways",
    "motions",
)  # parts of a proof that are as they stand
Parts = tuple[Floats, Floats | None]  # (q, 3) N each, a force is their sum; where there is no friction a factor


def inner_forces(f: Floats, mu: Floats, blur: Floats) -> Floats:
    """Pull (q, 3) forces just inside their cones, so that rounding in world coordinates cannot push them out.

    The slope |f_t| / fn is held to mu (1 - 2e-12), less what `blur` allows for: the (q,) angle by which rounding may
    turn a patch's normal. Where the slope is below 1 friction gives way, above it fn grows: the smaller change.
    Equilibrium suffers by less than a thousandth of what a certificate allows.
    """
    inner = f.copy()
    inner[:, 0] = np.maximum(inner[:, 0], 0.0)
    tangent = np.hypot(f[:, 1], f[:, 2])
    slope = inner_slope(mu, blur)
    beyond = tangent > slope * inner[:, 0]
    raised, cut = beyond & (slope > 1.0), beyond & ~(slope > 1.0)
    inner[:, 0] = np.where(raised, tangent / np.where(raised, slope, 1.0), inner[:, 0])
    inner[:, 1:] *= np.where(cut, slope * inner[:, 0] / np.where(cut, tangent, 1.0), 1.0)[:, None]
    return inner


def inner_slope(mu: Floats, blur: Floats) -> Floats:
    """(q,) largest |f_t| / fn of `inner_forces`."""
    return np.maximum(mu * (1.0 - 2e-12 - 1e-15 * mu) - (1.0 + mu * mu) * blur, 0.0)


def flushed(values: Floats) -> list[list[float]]:
    """Rows as lists, with noise below 1e-60 of the largest entry set to zero: it only makes exact numbers long."""
    rows: list[list[float]] = np.where(
        np.abs(values) > 1e-60 * np.max(np.abs(values), initial=0.0), values, 0.0
    ).tolist()
    return rows


def force_rows(system: EquilibriumSystem, contacts: Contacts, parts: Parts) -> list[list[float]]:
    """One row for every used point: the two doubles that a force is the sum of, or one where the other is zero.

    Without friction a row holds what its contact's area vector is multiplied by.
    """
    high, low = parts
    smooth = contacts.mu[contacts.patch[system.used]] == 0.0 if len(contacts) else np.zeros(len(high), bool)
    rows = flushed(high)
    for k in np.flatnonzero(smooth).tolist():
        rows[k] = rows[k][:1]
    if low is not None:
        more = low.tolist()
        for k in np.flatnonzero(low.any(1)).tolist():
            rows[k] = rows[k] + more[k][: len(rows[k])]
    return rows


def certify(model: PreparedModel, system: EquilibriumSystem, kind: str, proof: Mapping[str, Any]) -> dict[str, Any]:
    """Write a certificate.

    Parameters
    ----------
    model : PreparedModel
        As it was analysed.
    system : EquilibriumSystem
        Its equilibrium system: says which contact points matter.
    kind : str
        What it proves, as `docs/certificates.md` names it.
    proof : mapping
        `world_force`, a pair as `force_rows` takes it; `motion` (m, 6) of each free block, of its centre of mass:
        m/s and rad/s of a mechanism, or a virtual displacement in the unit of `bounds`; `bounds`; `settlements` (n, 6)
        of supports; and those of `FINAL`, as they are to stand in the file. Those that the kind has.

    Raises
    ------
    InputError
        Loads that are not at points.
    """
    assembly, contacts, fixed = model.assembly, model.contacts, model.fixed
    if assembly.actions:
        raise InputError("a certificate holds loads at points only; resolve the others first (resolved_loads)")
    used = ~(fixed[contacts.a] & fixed[contacts.b])
    names = [block.id for block in assembly.blocks]
    strength = contacts.strength
    certificate: dict[str, Any] = {
        "schema": "cyclopean.certificate/2",
        "kind": kind,
        "gravity": flushed(np.asarray(model.gravity, float)[None])[0],
        "tolerance": float(model.tolerance),
        "blocks": [
            {
                "id": block.id,
                "vertices": block.vertices.tolist(),
                "faces": [list(face) for face in block.faces],
                "density": float(density),
                "fixed": bool(whole),
            }
            | ({"held": list(block.held)} if block.held and not whole else {})
            for block, whole, density in zip(assembly.blocks, fixed, assembly.densities(model.density), strict=True)
        ],
        "contacts": [
            {
                "a": names[contacts.a[k]],
                "b": names[contacts.b[k]],
                "polygon": contacts.polygon(int(k)).tolist(),
                "mu": float(contacts.mu[k]),
            }
            | ({"tension": float(strength[k])} if strength[k] > 0.0 else {})
            | contacts.surface(int(k))
            for k in np.flatnonzero(used)
        ],
        "loads": [
            {
                "block": names[load.block],
                "force": flushed(load.force[None])[0],
                "point": flushed(load.point[None])[0],
            }
            for load in assembly.loads
        ],
    }
    if "world_force" in proof:
        certificate["forces"] = force_rows(system, contacts, proof["world_force"])
    if "motion" in proof:
        rows = flushed(system.still(np.ravel(proof["motion"])).reshape(-1, 6))
        certificate["mechanism"] = {names[i]: row for i, row in zip(system.free, rows, strict=True)}
    if "settlements" in proof:
        moved = np.asarray(proof["settlements"])
        certificate["settlements"] = {names[i]: moved[i].tolist() for i in np.flatnonzero(moved.any(1)).tolist()}
    if "bounds" in proof:
        bounds = proof["bounds"]
        certificate |= {"eps": bounds.eps, "eta": bounds.eta, "beta_min": bounds.beta}
    certificate |= {key: proof[key] for key in FINAL if key in proof}
    certificate["seal"] = seal(certificate)
    return certificate
