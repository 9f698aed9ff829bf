"""Drawings that differ from a model by no more than a length L and an angle: what they have in common.

Blocks, listed contacts, densities, loads and supports are the same. No vertex, and no point at which a load acts, is
further than L from where it is here. Every point of a contact's polygon that is at least L inside its outline has a
point of the contact above or below it, no further than L away; no point of the contact is outside the convex outline
of which every edge is moved out by L, nor further than L from the plane; and normals lean by no more than the angle, or
by what L allows. What is bounded here is bounded in the same way by the checker (`docs/certificates.md`).
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Contacts
from cyclopean.geometry import triangles

__all__ = ["Family", "swelling", "warps"]


@dataclass(frozen=True, slots=True)
class Family:
    """By how much drawings may differ."""

    length: float  # m
    degrees: float | None = None  # by which normals may lean; None = by what the length allows

    @property
    def slope(self) -> float | None:
        """The tangent of that angle, rounded up."""
        return None if self.degrees is None else float(np.nextafter(np.tan(np.deg2rad(self.degrees)), np.inf))

    def of(self, length: float) -> "Family":
        """The family of another length (m)."""
        return Family(length, self.degrees)

    def leans(self, contacts: Contacts) -> Floats:
        """(c,) tangents of the angles by which normals may lean; infinite where they may stand upright.

        A plane nowhere further than L from a convex outline leans by no more than sin = L / r, with r the radius of a
        circle inside it, and r is at least area / perimeter.
        """
        if self.slope is not None:
            return np.full(len(contacts), self.slope)
        sine = self.length * contacts.perimeter / contacts.area
        return np.where(sine < 1.0, sine / np.sqrt(np.maximum(1.0 - sine**2, 1e-300)), np.inf)

    def entry(self) -> dict[str, float]:
        """As it stands in a certificate."""
        return {"length": self.length} | ({} if self.slope is None else {"slope": self.slope})


def warps(contacts: Contacts) -> Floats:
    """(c,) m: how far corners of contacts are off the plane through their mean at most."""
    if not len(contacts):
        return np.zeros(0)
    patch, count = contacts.patch, np.diff(contacts.start)
    local = contacts.point - contacts.point[contacts.start[:-1]][patch]
    rise = np.einsum("pi,pi->p", local, contacts.frame[patch, 0])
    mean = np.add.reduceat(rise, contacts.start[:-1]) / count
    return np.asarray(np.maximum.reduceat(np.abs(rise - mean[patch]), contacts.start[:-1]))


def swelling(assembly: Assembly, length: float) -> tuple[Floats, Floats]:
    """How much volumes (n,) m3 and first moments about the centres of mass (n, 3) m4 may change.

    A fan triangle with sides u, v sweeps no more than L B, B = A + L (|u| + |v|) / 2 + 2 L^2 / 3, and takes moments of
    L B (x + L) with it, x the root of the mean square of its distance from the centre along an axis.
    """
    corners, face = triangles(assembly.mesh)
    body = assembly.mesh.face_body[face]
    at = assembly.mesh.vertex[corners] - assembly.mass.centroid[body][:, None, :]
    u, v = at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]
    sides = np.linalg.norm(u, axis=1) + np.linalg.norm(v, axis=1)
    swept = length * (np.linalg.norm(np.cross(u, v), axis=1) / 2.0 + length * sides / 2.0 + 2.0 * length**2 / 3.0)
    mean = np.sqrt((np.square(at).sum(1) + np.square(at.sum(1))) / 12.0)
    volume, moment = np.zeros(len(assembly)), np.zeros((len(assembly), 3))
    np.add.at(volume, body, swept)
    np.add.at(moment, body, swept[:, None] * (mean + length))
    return volume, moment
