"""Faces that were meant to touch, it seems, and do not: drawn a little apart, into each other, or askew."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.precision import FLAT_SHARE, LEANS, ROUGH_SHARE
from cyclopean.geometry import (
    Overlaps,
    PlanarRegions,
    Polyhedra,
    box_pairs,
    facing_regions,
    mass_properties,
    region_overlaps,
)
from cyclopean.geometry.frames import newell_normals
from cyclopean.geometry.packed import following

__all__ = ["EQUAL", "Forgiven", "NearMisses", "grounded", "meant", "misses", "near_misses"]

THIN = 0.25  # of a block's mean thickness (2 volume / area): what is further away may lie behind another block
WIDE = 4.0  # times the distance: a joint that is no wider is none
STEP = 2.0  # gaps that follow each other more closely belong together
SKEW = 0.05  # rad: faces that lean less from each other, and are near, are meant to touch
UP = 0.1  # sine of the least slope of a face that something can stand on
EQUAL = 1e-9  # share by which a gap may exceed what is forgiven: numbers in files are rounded
SPECK = 1e-3  # of the other: a gap or an overlap that is less is not worth a word
DIGITS = 3  # to which a tolerance that is chosen is rounded up


@dataclass(frozen=True, slots=True)
class Forgiven:
    """What a drawing is forgiven: faces so far apart, or in each other, and so much askew, count as touching."""

    gap: float  # m
    angle: float  # rad

    def and_also(self, other: "Forgiven") -> "Forgiven":
        """What either forgives."""
        return Forgiven(max(self.gap, other.gap), max(self.angle, other.angle))

    def words(self) -> str:
        """As the option is typed, metres and degrees."""
        return f"{self.gap:.4g},{np.degrees(self.angle):.3g}"


@dataclass(frozen=True, slots=True, eq=False)
class NearMisses:
    """Pairs of faces of different blocks (m) that nearly touch and do not count."""

    a: Ints  # (m,) block
    b: Ints  # (m,)
    gap: Floats  # (m,) m: the most that they are apart
    overlap: Floats  # (m,) m: the most that they are in each other
    angle: Floats  # (m,) rad between them
    width: Floats  # (m,) m: area over half the perimeter
    rise: Floats  # (m,) sine of the slope by which a push lifts b; negative where it lifts a
    share: Floats  # (m,) the larger of gap and overlap, as a share of the smaller block's size

    def __len__(self) -> int:
        return len(self.a)

    @property
    def distance(self) -> Floats:
        """(m,) m: the larger of gap and overlap."""
        return np.maximum(self.gap, self.overlap)

    def only(self, which: Ints | Bools) -> "NearMisses":
        """Those of some numbers (k,), or of a mask (m,)."""
        return NearMisses(*(getattr(self, name)[which] for name in NearMisses.__slots__))

    def sizes(self, k: int) -> str:
        """How far one of them misses, in words."""
        return " and ".join(misses(self.gap[k], self.overlap[k], self.angle[k], SPECK * self.distance[k]))

    def angle_of(self, which: Ints | Bools) -> float:
        """rad: the angle that has to be forgiven for those of some numbers (k,), or of a mask (m,), to count."""
        most = float(self.angle[which].max(initial=0.0))
        return float(np.radians(_up(np.degrees(max(most, LEANS)))))

    def forgiving(self, which: Ints | Bools) -> Forgiven:
        """The least that has to be forgiven for those of some numbers (k,), or of a mask (m,), to count."""
        return Forgiven(_up(float(self.distance[which].max())), self.angle_of(which))

    def nearest(self, block: int) -> int:
        """The one that is nearest to a block; -1 where there is none."""
        own = np.flatnonzero((self.a == block) | (self.b == block))
        return int(own[np.argmin(self.distance[own])]) if len(own) else -1

    def told(self, names: Sequence[str]) -> list[str]:
        """One line that sums up what nearly touches and does not count."""
        if not len(self):
            return []
        pairs = len(np.unique(np.stack([self.a, self.b], 1), axis=0))
        k = int(np.argmax(self.share))
        parts = misses(self.gap.max(), self.overlap.max(), self.angle.max())
        return [
            f"{pairs} {'pairs' if pairs > 1 else 'pair'} of blocks nearly touch, and do not count: up to"
            f" {', '.join(parts)} ('{names[self.a[k]]}' and '{names[self.b[k]]}': {self.sizes(k)}); `tolerance` auto"
            f" counts those that clearly are meant, {self.forgiving(np.arange(len(self))).words()} all of them"
        ]


def misses(gap: float, overlap: float, angle: float, least: float = 0.0) -> list[str]:
    """By how much (m, rad) faces miss each other, in words; lengths up to the least are not worth any."""
    words = [f"{x:.2g} m {how}" for x, how in ((gap, "apart"), (overlap, "into each other")) if x > least]
    return [*words, f"{np.degrees(angle):.2g} degrees askew"] if np.degrees(angle) >= 1e-3 else words


def _up(value: float) -> float:
    """Rounded up to a few digits."""
    unit = 10.0 ** (np.floor(np.log10(value)) - DIGITS + 1) if value > 0.0 else 1.0
    return float(np.ceil(value / unit * (1.0 - EQUAL)) * unit)


def near_misses(mesh: Polyhedra, regions: PlanarRegions, found: tuple[Ints, Ints], tolerance: float) -> NearMisses:
    """Find faces that face each other nearly, apart from pairs of regions in which blocks touch.

    Looked for within 2.5 % of the smaller block's size, or a quarter of its thickness where that is less; joints
    must be four times as wide as they gape.

    Parameters
    ----------
    mesh : Polyhedra
        The blocks (n).
    regions : PlanarRegions
        Their planar regions.
    found : (k,) int, (k,) int
        Regions that touch.
    tolerance : float
        m: parts no wider are left out.
    """
    area = np.bincount(regions.body, regions.area, len(mesh))
    thickness = 2.0 * np.abs(mass_properties(mesh).volume) / np.maximum(area, 1e-300)  # as of a plate
    reach = np.minimum(ROUGH_SHARE * mesh.diagonal, THIN * thickness)
    low, high = mesh.boxes()
    i, j = box_pairs(low - reach[:, None] / 2.0, high + reach[:, None] / 2.0, 0.0)
    a, b = facing_regions(regions, (i, j), np.minimum(reach[i], reach[j]))
    new = ~np.isin(a * len(regions) + b, found[0] * len(regions) + found[1])
    a, b = a[new], b[new]
    least = np.minimum(reach[regions.body[a]], reach[regions.body[b]])
    parts = region_overlaps(regions, a, b, tolerance, least)
    return _measured(mesh, regions, a[parts.pair], b[parts.pair], parts)


def _measured(mesh: Polyhedra, regions: PlanarRegions, a: Ints, b: Ints, parts: Overlaps) -> NearMisses:
    """What is known of parts of regions a and b, those that are wide enough."""
    double = newell_normals(parts.point, parts.start)
    side = np.linalg.norm(parts.point[following(parts.start)] - parts.point, axis=1)
    around = np.add.reduceat(side, parts.start[:-1]) if len(a) else np.zeros(0)
    one, two = regions.body[a], regions.body[b]
    area = np.linalg.norm(double, axis=1)
    gap, overlap = np.maximum(parts.apart[:, 1], 0.0), np.maximum(-parts.apart[:, 0], 0.0)
    skew = np.linalg.norm(regions.normal[a] + regions.normal[b], axis=1)
    every = NearMisses(
        one,
        two,
        gap,
        overlap,
        2.0 * np.arcsin(np.minimum(skew / 2.0, 1.0)),
        area / np.maximum(around, 1e-300),
        double[:, 2] / np.maximum(area, 1e-300),
        np.maximum(gap, overlap) / np.minimum(mesh.diagonal[one], mesh.diagonal[two]),
    )
    return every.only(every.width > WIDE * every.distance)


def meant(assembly: Assembly, contacts: Contacts, near: NearMisses, fixed: Bools) -> Forgiven | None:
    """The least that has to be forgiven so that joints touch which clearly are meant to; None = nothing has to be.

    Meant are faces within 0.5 % of the smaller block's size and three degrees; and for a block that nothing bears,
    the nearest face that would, or the ground, if it is that near. From there on gaps belong to them as long as each
    is less than twice the last, so that the tolerance ends before a clear step in the distribution of gaps; where
    there is no such step before gaps that are no joints, it ends at those that clearly are meant.

    Parameters
    ----------
    assembly : Assembly
        The blocks (n).
    contacts : Contacts
        Those that touch anyway.
    near : NearMisses
        What else there is.
    fixed : (n,) bool
        Supports.
    """
    held = borne(contacts, fixed)
    distance = near.distance
    order = np.argsort(distance, kind="stable")
    chosen = (near.share <= FLAT_SHARE) & (near.angle <= SKEW)
    for k in order.tolist():  # the nearest first: what bears a block is found once
        lifted = near.b[k] if near.rise[k] > UP else near.a[k] if near.rise[k] < -UP else -1
        if lifted >= 0 and not held[lifted]:
            chosen[k] = held[lifted] = True
    above = height_above_ground(assembly)
    low = ~held & (above <= ROUGH_SHARE * assembly.mesh.diagonal)
    most = max(float(distance[chosen].max(initial=0.0)), float(above[low].max(initial=0.0)))
    if not most > 0.0:
        return None
    reached = most
    for further in distance[order].tolist():
        if reached < further <= STEP * reached:
            reached = further
    if near.share[distance <= reached].max(initial=0.0) * STEP < ROUGH_SHARE:  # else gaps go on to the end: no step
        most = reached
    return Forgiven(_up(most), near.angle_of(distance <= most))


def borne(contacts: Contacts, fixed: Bools) -> Bools:
    """(n,) blocks that are supports, or that a contact pushes up."""
    held = fixed.copy()
    if len(contacts):
        rise = contacts.frame[:, 0, 2]
        held[contacts.b[rise > UP]] = True
        held[contacts.a[rise < -UP]] = True
    return held


def height_above_ground(assembly: Assembly) -> Floats:
    """(n,) m: how far the lowest point of each block is above the lowest of all."""
    low = assembly.mesh.boxes()[0][:, 2]
    return np.asarray(low - low.min(initial=np.inf))


def grounded(assembly: Assembly, contacts: Contacts, fixed: Bools, gap: float) -> Bools:
    """(n,) the supports, and blocks that nothing bears and whose lowest points are within the gap (m) of the ground."""
    near = height_above_ground(assembly) <= np.minimum(gap, ROUGH_SHARE * assembly.mesh.diagonal)
    return fixed | (near & ~borne(contacts, fixed))
