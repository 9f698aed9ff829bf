"""Friction pyramids in place of Coulomb's cone: the verdict that programs give which know no other, with its own proof.

A pyramid is all that its K edges can bear together. So a contact with a pyramid is, at each of its points, K contacts
without friction whose normals are the edges, and whatever decides and proves models of such joints decides this one.
In the certificate they are gathered again: a contact keeps its polygon and gets `edges`, and a force is given by what
it is along each of them. The K faces of a pyramid are those of `statics.pyramid_rows`, in the frame of the contact:

    cos(theta_k) fu + sin(theta_k) fv <= mu' fn        theta_k = 2 pi k / K

with mu' = mu cos(pi / K) where it is inscribed in the cone, and mu where it is circumscribed; its edges are between
them, with the friction mu' / cos(pi / K).

Coupled analysis has no such reduction: friction there goes against sliding. It takes the cone that lies inside the
pyramid, which friction mu' has, for a state; that round it, with the friction of the edges, for the lack of one.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from cyclopean.analysis.certificates import certify
from cyclopean.analysis.equilibrium.deciding import decide_rigid
from cyclopean.analysis.equilibrium.reference import Cone, parse_cone
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.proving import Claim, Judge, prove, rigid_claim, utilisation
from cyclopean.analysis.settings import Settings
from cyclopean.analysis.verdict import Result
from cyclopean.arrays import Floats
from cyclopean.assembly import Contacts
from cyclopean.errors import InputError
from cyclopean.proof import seal
from cyclopean.statics import EquilibriumSystem

__all__ = ["along_edges", "edges_of", "rigid_with_pyramids", "with_cones"]


def edges_of(contacts: Contacts, cone: Cone) -> Floats:
    """(c, K, 3) unit vectors along the edges of the pyramid at each contact, world axes."""
    middle = (2.0 * np.arange(cone.faces) + 1.0) * np.pi / cone.faces
    reach = contacts.mu / (1.0 if cone.kind == "inscribed" else np.cos(np.pi / cone.faces))
    way = np.stack([np.ones(cone.faces), np.cos(middle), np.sin(middle)], 1)
    local = np.where(np.arange(3) == 0, way, way * reach[:, None, None])
    edge = np.einsum("cki,cij->ckj", local, contacts.frame)
    return np.asarray(edge / np.linalg.norm(edge, axis=2)[:, :, None])


def along_edges(contacts: Contacts, edges: Floats) -> Contacts:
    """Contacts without friction, at every point of each in turn one along each of its (c, K, 3) edges.

    Their number is K times that of the points, whose order they keep.
    """
    patch, count = np.repeat(contacts.patch, edges.shape[1]), edges.shape[1]
    point = np.repeat(contacts.point, count, axis=0)
    facing = edges[contacts.patch].reshape(-1, 3)
    return Contacts(
        contacts.a[patch], contacts.b[patch], np.arange(len(patch) + 1), point, np.zeros(len(patch)), facing=facing
    )


def rigid_with_pyramids(model: PreparedModel, settings: Settings, judge: Judge) -> tuple[Result, Claim]:
    """Decide by rigid-block equilibrium with pyramids in place of cones, with a certificate that says so.

    Parameters
    ----------
    model : PreparedModel
        As it is analysed; no support of it settles.
    settings : Settings
        Their `cone` is a pyramid.
    judge : callable
        The independent checker.

    Raises
    ------
    InputError
        A joint that pulls, or whose surface is rough or curved.
    """
    contacts, cone = model.contacts, parse_cone(settings.cone)
    _require_plain(model, settings.cone)
    edges = edges_of(contacts, cone)
    edged = replace(model, contacts=along_edges(contacts, edges))
    system = edged.system()
    claim = rigid_claim(decide_rigid(edged, system, settings.solver))

    def written(_: PreparedModel, system: EquilibriumSystem, kind: str, proof: Mapping[str, Any]) -> dict[str, Any]:
        return _gathered(certify(edged, system, kind, proof), model, edges)

    found = prove(edged, settings, system, claim, judge, written)
    if found.force is None:
        return replace(found, contacts=contacts, frame=contacts.frame), claim
    world = found.force[:, :1] * edged.contacts.normal_given
    whole = world.reshape(len(contacts.point), cone.faces, 3).sum(axis=1)
    force = np.einsum("pij,pj->pi", contacts.frame[contacts.patch], whole)
    used = utilisation(contacts, force)
    return replace(found, contacts=contacts, frame=contacts.frame, force=force, utilisation=used), claim


def with_cones(model: PreparedModel, cone: Cone, *, inside: bool) -> PreparedModel:
    """The model with round cones inside the pyramids, or about them."""
    inner = np.cos(np.pi / cone.faces) if cone.kind == "inscribed" else 1.0
    outer = 1.0 if cone.kind == "inscribed" else 1.0 / np.cos(np.pi / cone.faces)
    mu = model.contacts.mu * (inner if inside else outer)
    return replace(model, contacts=replace(model.contacts, mu=mu))


def _require_plain(model: PreparedModel, said: str) -> None:
    contacts, blocks = model.contacts, model.assembly.blocks
    for what, bad in (("pulls", contacts.strength > 0.0), ("is rough or curved", ~np.isnan(contacts.leaning))):
        if bad.any():
            k = int(np.argmax(bad))
            a, b = blocks[contacts.a[k]].id, blocks[contacts.b[k]].id
            raise InputError.of("cone", said, f"the joint of '{a}' and '{b}' {what}, which only exact cones have")


def _gathered(certificate: dict[str, Any], model: PreparedModel, edges: Floats) -> dict[str, Any]:
    """The certificate with the contacts of the model, and the edges that stand for their cones."""
    contacts, count = model.contacts, edges.shape[1]
    used = np.flatnonzero(~(model.fixed[contacts.a] & model.fixed[contacts.b]))
    names = [block.id for block in model.assembly.blocks]
    certificate["contacts"] = [
        {"a": names[contacts.a[k]], "b": names[contacts.b[k]], "polygon": contacts.polygon(k).tolist()}
        | {"mu": float(contacts.mu[k]), "edges": edges[k].tolist()}
        | contacts.surface(k)
        for k in used.tolist()
    ]
    if "forces" in certificate:
        rows = certificate["forces"]
        points = [rows[k : k + count] for k in range(0, len(rows), count)]
        certificate["forces"] = [_both([row[0] for row in point], [sum(row[1:]) for row in point]) for point in points]
    certificate["seal"] = seal(certificate)
    return certificate


def _both(high: list[float], low: list[float]) -> list[float]:
    """What is borne along each edge; twice over where it is the sum of two doubles."""
    return high + low if any(low) else high
