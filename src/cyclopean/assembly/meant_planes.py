"""The planes in which the faces of a drawing are meant to lie.

    sheets    faces of one block in one plane: flat to the digits of the drawing, or one polygon that is flat within
              the length; or, where that alone does not do, matched faces that are flat together within it
    planes    of sheets that face each other within the length, one for each group of them; and one level plane of the
              feet of blocks, where the model does not say what its supports are

A plane of three vertices asks for nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.common_planes import Planes, largest
from cyclopean.assembly.near_misses import EQUAL
from cyclopean.assembly.precision import length_tolerance
from cyclopean.geometry import (
    PlanarRegions,
    Polyhedra,
    box_pairs,
    components,
    facing_regions,
    flattened,
    following,
    newell_normals,
    planar_regions,
    ragged,
    region_overlaps,
)

__all__ = ["MeantPlanes"]

LEVEL = 0.995  # cosine of the slope up to which a face may be a foot


@dataclass(frozen=True, slots=True, eq=False)
class MeantPlanes:
    """Sheets of a drawing, and the planes that are asked of them."""

    mesh: Polyhedra  # polygons that are bent by more than the length are triangles
    sheet: Ints  # (F,) of each face
    plane: Ints  # (sheets,)
    feet: Ints  # sheets on the ground
    pairs: Ints  # (m, 2) sheets of different blocks that face each other

    @classmethod
    def of(cls, assembly: Assembly, mesh: Polyhedra, length: float, merging: bool) -> "MeantPlanes":
        """Find them in meshes about a near origin, for vertices that move by up to a length (m).

        Faces of a block that are flat together within the length are taken for one where `merging` is wanted.
        """
        digits = length_tolerance(assembly)
        length *= 1.0 + EQUAL
        mesh = flattened(mesh, 2.0 * length)[0]
        fine, face = planar_regions(mesh, digits), flattened(mesh, digits)[1]
        regions = planar_regions(mesh, 2.0 * length if merging else digits, 2.0 * length)
        facing = _facing(regions, box_pairs(*mesh.boxes(), length), length, digits)
        feet = _feet(assembly, regions, length)
        first = _first(regions)
        merged = np.flatnonzero(np.isin(regions.of_face, np.concatenate([facing.ravel(), feet])))
        one = np.concatenate([face, merged])
        two = np.concatenate([face[_first(fine)][fine.of_face], first[regions.of_face[merged]]])
        sheet = components(len(mesh.corner_start) - 1, one, two)
        own = sheet[first[feet]]
        pairs = sheet[first[facing]]
        plane = _grouped(mesh, sheet, np.concatenate([np.stack([own[:-1], own[1:]], 1), pairs]), length)
        return cls(mesh, sheet, plane, own, pairs)

    @property
    def loose(self) -> Ints:
        """(l, 2) pairs whose sheets cannot lie in one plane."""
        return np.asarray(self.pairs[self.plane[self.pairs[:, 0]] != self.plane[self.pairs[:, 1]]])

    @property
    def matched(self) -> Ints:
        """(n,) sheets of each block that are in one plane with those of other blocks."""
        together = self.pairs[self.plane[self.pairs[:, 0]] == self.plane[self.pairs[:, 1]]]
        return np.bincount(self.body[np.unique(together)], minlength=len(self.mesh))

    @property
    def body(self) -> Ints:
        """(sheets,) block of each."""
        return np.asarray(self.mesh.face_body[np.unique(self.sheet, return_index=True)[1]])

    def planes(self) -> Planes:
        """Those that ask for something: of four vertices or more, or level."""
        level = np.zeros(self.plane.max(initial=-1) + 1, bool)
        level[self.plane[self.feet]] = True
        vertex, plane = self.mesh.corner, self.plane[self.sheet[self.mesh.corner_face]]
        asking = level | (np.bincount(Planes.of(self.mesh.vertex, vertex, plane, level).plane) > 3)
        kept, number = asking[plane], np.cumsum(asking) - 1
        return Planes.of(self.mesh.vertex, vertex[kept], number[plane[kept]], level[asking])

    def told(self, names: Sequence[str], length: float) -> tuple[str, ...]:
        """Say what stays apart, for the names of the blocks and the length (m) that was allowed."""
        body = np.unique(np.sort(self.body[self.loose], axis=1), axis=0)
        if not len(body):
            return ()
        what = "1 pair of blocks has" if len(body) == 1 else f"{len(body)} pairs of blocks have"
        return (
            f"{what} faces within {length:g} m of each other that cannot lie in one plane without moving further, and"
            f" stay as drawn ('{names[body[0, 0]]}' and '{names[body[0, 1]]}')",
        )


def _first(regions: PlanarRegions) -> Ints:
    """(R,) first face of each region."""
    return np.asarray(np.unique(regions.of_face, return_index=True)[1])


def _facing(regions: PlanarRegions, near: tuple[Ints, Ints], length: float, digits: float) -> Ints:
    """(m, 2) regions of blocks that are near, which face each other within a length (m); the nearest first.

    Where they are not in one plane to the digits (m), overlaps no wider than the length are strips beside an edge, and
    faces that are further apart elsewhere are not meant to touch.
    """
    a, b = facing_regions(regions, near, length)
    found = region_overlaps(regions, a, b, digits, length)
    side = np.linalg.norm(found.point[following(found.start)] - found.point, axis=1)
    around = np.add.reduceat(side, found.start[:-1]) if len(found.pair) else np.zeros(0)
    double = np.linalg.norm(newell_normals(found.point, found.start), axis=1)
    a, b = a[found.pair], b[found.pair]
    off = np.minimum(_furthest(regions, a, b), _furthest(regions, b, a))
    kept = np.flatnonzero((off <= digits) | ((double > length * around) & (off <= 2.0 * length)))
    apart = np.abs(found.apart).max(axis=1, initial=0.0)[kept]
    return np.stack([a, b], 1)[kept[np.argsort(apart, kind="stable")]]


def _furthest(regions: PlanarRegions, a: Ints, b: Ints) -> Floats:
    """(m,) m: how far corners of regions b are off the planes of regions a, at most."""
    pair, position = ragged(regions.region_corner_start, b)
    away = regions.vertex[regions.corner[position]] - regions.point[a[pair]]
    return largest(pair, np.abs(np.einsum("ki,ki->k", away, regions.normal[a[pair]])), len(a))


def _feet(assembly: Assembly, regions: PlanarRegions, length: float) -> Ints:
    """Regions that are meant to stand on level ground; none where one block alone does, or supports are named."""
    if not len(regions) or any(block.fixed is not None or block.held for block in assembly.blocks):
        return np.zeros(0, np.int64)
    low, high = regions.boxes()
    feet = np.flatnonzero((high[:, 2] <= low[:, 2].min() + length) & (regions.normal[:, 2] < -LEVEL))
    return feet if len(np.unique(regions.body[feet])) > 1 else feet[:0]


def _grouped(mesh: Polyhedra, sheet: Ints, pairs: Ints, length: float) -> Ints:
    """(sheets,) plane of each: those of pairs (m, 2) are one, unless a vertex is further off it than the length (m).

    Groups that are too far off are put together again pair by pair, the first pairs first.
    """
    total, of_corner = int(sheet.max(initial=-1)) + 1, sheet[mesh.corner_face]
    plane = components(total, *pairs.T)
    level = np.zeros(plane.max(initial=-1) + 1, bool)
    bad = Planes.of(mesh.vertex, mesh.corner, plane[of_corner], level).furthest(mesh.vertex) > length
    again = bad[plane[pairs[:, 0]]]
    if not again.any():
        return plane
    order = np.argsort(of_corner, kind="stable")
    members = np.split(mesh.corner[order], np.cumsum(np.bincount(of_corner, minlength=total))[:-1])
    owner, kept = np.arange(total), ~again
    for k in np.flatnonzero(again).tolist():
        one, two = owner[pairs[k]].tolist()
        both = np.union1d(members[one], members[two])
        if one == two or _flat(mesh.vertex[both], length):
            kept[k] = True
            owner[owner == two] = one
            members[one] = both
    return components(total, *pairs[kept].T)


def _flat(point: Floats, length: float) -> bool:
    """Whether points (k, 3) lie within a length (m) of their plane of least squares."""
    away = point - point.mean(axis=0)
    return float(np.abs(away @ np.linalg.eigh(away.T @ away)[1][:, 0]).max()) <= length
