"""Contacts found from the blocks' meshes, and what looks wrong about the way the blocks lie."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.contacts import Contacts
from cyclopean.errors import InputError
from cyclopean.geometry import (
    Overlaps,
    PlanarRegions,
    Polyhedra,
    box_pairs,
    convex_bodies,
    facing_regions,
    offsets,
    penetration_depths,
    planar_regions,
    ragged,
    region_overlaps,
)

__all__ = ["Detection", "detect", "length_tolerance", "local_mesh"]

RELATIVE_TOLERANCE = 1e-6  # of the size that `length_tolerance` takes: six digits of a drawing
OWN_SHARE = 1e-3  # of the smaller of two blocks: no gap between them may be wider, whatever the tolerance
LISTED = 10  # faults named one by one before they are only counted
GRID = 1000.0  # tolerances: cell of the grid on which contacts are put in order


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """Contacts of an assembly and what a person should be told about them."""

    contacts: Contacts  # mu NaN; sorted by a, then b, then by place
    touching_nothing: tuple[int, ...]  # blocks without any contact
    warnings: tuple[str, ...]  # one line each, naming the blocks
    tolerance: float  # m


def length_tolerance(assembly: Assembly) -> float:
    """Length (m) below which two faces count as touching: 1e-6 of the model's size.

    Size is the diagonal of the model's bounding box, but no more than a hundred times that of the median block (of
    two in the middle the smaller), so that a wide ground slab does not coarsen it; where the model lies does not
    matter, unless so far off that eight units of rounding of its coordinates are larger still.
    """
    mesh = assembly.mesh
    if not len(mesh.vertex):
        return 0.0
    diagonal = np.sort(mesh.diagonal)
    size = min(assembly.size, 100.0 * float(diagonal[(len(diagonal) - 1) // 2]) or np.inf)
    return max(RELATIVE_TOLERANCE * size, 8.0 * float(np.spacing(np.abs(mesh.vertex).max())))


def detect(assembly: Assembly, tolerance: float | None = None) -> Detection:
    """Find every patch in which two blocks touch face to face.

    Coplanar neighbouring faces of a block are merged into planar regions with holes; regions of different blocks
    whose normals are opposed and whose planes lie within the tolerance of each other all over the overlap touch in
    the exact intersection of their polygons, unless they are further apart than 0.1 % of the smaller block's size.
    Each part of an intersection is one contact, convex or not; a part with holes is cut through them into contacts
    without. Parts whose mean width (2 area / perimeter) is at most the tolerance are dropped, and so is touching along
    an edge or in a point. Fixed blocks are treated like any other.

    In every contact a < b and the points run counter-clockwise about the normal from a into b, on the plane midway
    between the two faces, starting at the point of least x (then y, z). Contacts are sorted by a, b, and the x, y, z
    of their middles.

    Warnings name blocks that touch nothing, blocks that stand in the same place, and blocks that run into each other:
    exactly for pairs of convex blocks, by sampled edges for others (limits: `geometry.penetration_depths`).

    Parameters
    ----------
    assembly : Assembly
        Blocks as closed meshes; its own `contacts` are not looked at.
    tolerance : float, optional
        Length (m); default `length_tolerance`.

    Raises
    ------
    InputError
        The tolerance is not a positive number.
    """
    if tolerance is not None and not 0.0 < tolerance < np.inf:
        raise InputError(f"tolerance {tolerance:g} m must be a positive number of metres")
    tol = length_tolerance(assembly) if tolerance is None else float(tolerance)
    mesh, origin = local_mesh(assembly)
    regions = planar_regions(mesh, tol)
    pairs = box_pairs(*mesh.boxes(), tol)
    a, b = facing_regions(regions, pairs, tol)
    found = _near(regions, a, b, region_overlaps(regions, a, b, tol), mesh)
    contacts = _ordered(regions, a, b, found, origin, tol)
    touched = np.zeros(len(assembly), bool)
    touched[contacts.a] = touched[contacts.b] = True
    alone = tuple(np.flatnonzero(~touched).tolist())
    names = [block.id for block in assembly.blocks]
    same = _duplicates(assembly, tol)
    warnings = (
        *_listed([f"block '{names[i]}' touches no other block" for i in alone], "blocks that touch nothing"),
        *_listed([f"blocks '{names[i]}' and '{names[j]}' stand in the same place" for i, j in same], "duplicates"),
        *_listed(_collisions(names, mesh, regions, pairs, contacts, same, tol), "pairs that run into each other"),
    )
    return Detection(contacts, alone, warnings, tol)


def local_mesh(assembly: Assembly) -> tuple[Polyhedra, Floats]:
    """All meshes about the middle of their common bounding box, and where that is (m)."""
    mesh = assembly.mesh
    if not len(mesh.vertex):
        return mesh, np.zeros(3)
    origin = (mesh.vertex.min(axis=0) + mesh.vertex.max(axis=0)) / 2.0
    moved = Polyhedra(mesh.vertex - origin, mesh.vertex_start, mesh.corner, mesh.corner_start, mesh.face_start)
    return moved, origin


def _near(regions: PlanarRegions, a: Ints, b: Ints, found: Overlaps, mesh: Polyhedra) -> Overlaps:
    """The overlaps whose two faces are no further apart than the smaller of the blocks allows."""
    if not len(found.pair):
        return found
    size = mesh.diagonal
    i, j = a[found.pair], b[found.pair]
    patch = np.repeat(np.arange(len(found.pair)), np.diff(found.start))
    height = np.einsum("pi,pi->p", found.point - regions.point[i][patch], regions.normal[i][patch])
    gap = 2.0 * np.maximum.reduceat(np.abs(height), found.start[:-1])  # points are midway between the faces
    kept = np.flatnonzero(gap <= OWN_SHARE * np.minimum(size[regions.body[i]], size[regions.body[j]]))
    if len(kept) == len(found.pair):
        return found
    return Overlaps(found.pair[kept], offsets(np.diff(found.start)[kept]), found.point[ragged(found.start, kept)[1]])


def _ordered(regions: PlanarRegions, a: Ints, b: Ints, found: Overlaps, origin: Floats, tolerance: float) -> Contacts:
    """Contacts in their documented order, each polygon starting at its least point."""
    body_a, body_b = regions.body[a[found.pair]], regions.body[b[found.pair]]
    count = np.diff(found.start)
    patch = np.repeat(np.arange(len(count)), count)
    # places are compared on a coarse grid: rounding must not decide which of two comes first
    cell = np.floor(found.point / (GRID * tolerance) + 0.381966)
    leader = np.lexsort((cell[:, 2], cell[:, 1], cell[:, 0], patch))[found.start[:-1]]
    first = found.start[patch]
    point = found.point[first + (np.arange(len(patch)) + leader[patch] - 2 * first) % count[patch]]
    middle = np.stack([np.bincount(patch, point[:, k], len(count)) for k in range(3)], 1) / count[:, None]
    cell = np.floor(middle / (GRID * tolerance) + 0.381966)
    order = np.lexsort((cell[:, 2], cell[:, 1], cell[:, 0], body_b, body_a))
    whole = Contacts(body_a, body_b, found.start, point + origin, np.full(len(order), np.nan))
    return whole.only(order)


def _duplicates(assembly: Assembly, tolerance: float) -> list[tuple[int, int]]:
    """Pairs of blocks with the same centroid, extents and volume, within the tolerance."""
    if len(assembly) < 2:
        return []
    from scipy.spatial import cKDTree

    low, high = assembly.mesh.boxes()
    whole = np.flatnonzero(np.isfinite(low).all(axis=1))
    if len(whole) < 2:
        return []
    key = np.hstack([assembly.mass.centroid, low, high])
    pair = whole[cKDTree(key[whole]).query_pairs(3.0 * tolerance, output_type="ndarray")]
    i, j = np.sort(pair, axis=1).T
    volume = assembly.mass.volume
    face = 6.0 * np.linalg.norm(high - low, axis=1) ** 2  # no less than the surface of what the box holds, if convex
    same = np.all(np.abs(key[i] - key[j]) <= tolerance, axis=1) & (np.abs(volume[i] - volume[j]) <= tolerance * face[i])
    return sorted(zip(i[same].tolist(), j[same].tolist(), strict=True))


def _collisions(
    names: Sequence[str],
    mesh: Polyhedra,
    regions: PlanarRegions,
    pairs: tuple[Ints, Ints],
    contacts: Contacts,
    same: list[tuple[int, int]],
    tolerance: float,
) -> list[str]:
    """One line for every pair of blocks that run into each other, duplicates apart."""
    n = len(names)
    convex = convex_bodies(regions)
    key = pairs[0] * n + pairs[1]
    # convex blocks that touch face to face are kept apart by that very plane
    settled = np.isin(key, contacts.a * n + contacts.b) & convex[pairs[0]] & convex[pairs[1]]
    settled |= np.isin(key, np.array([i * n + j for i, j in same], np.int64))
    i, j = pairs[0][~settled], pairs[1][~settled]
    depth = penetration_depths(mesh, regions, convex, (i, j), tolerance)
    return [
        f"blocks '{names[i[k]]}' and '{names[j[k]]}' run into each other"
        + (f" by about {depth[k]:.2g} m" if np.isfinite(depth[k]) else "")
        for k in np.flatnonzero(depth > 0.0)
    ]


def _listed(lines: Sequence[str], what: str) -> Sequence[str]:
    """The lines, or the first few and how many more there are."""
    if len(lines) <= LISTED:
        return lines
    return [*lines[:LISTED], f"... and {len(lines) - LISTED} more {what}"]
