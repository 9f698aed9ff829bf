"""Contacts found from the blocks' meshes, and what looks wrong about the way the blocks lie."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.checking import off_faces, seated
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.near_misses import EQUAL, Forgiven, NearMisses, misses, near_misses
from cyclopean.assembly.precision import LEANS, ROUGH_SHARE, length_tolerance, local_mesh
from cyclopean.errors import InputError
from cyclopean.geometry import (
    Overlaps,
    PlanarRegions,
    Polyhedra,
    box_pairs,
    convex_bodies,
    face_warp,
    facing_regions,
    penetration_depths,
    planar_regions,
    region_overlaps,
)
from cyclopean.geometry.overlap import MAX_ANGLE

__all__ = ["Detection", "detect"]

OWN_SHARE = 1e-3  # of the smaller of two blocks: no gap between them may be wider, if none is forgiven
LISTED = 3  # faults named one by one before they are only counted
GRID = 1000.0  # tolerances: cell of the grid on which contacts are put in order


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """Contacts of an assembly and what a person should be told about them."""

    contacts: Contacts  # mu NaN; sorted by a, then b, then by place
    touching_nothing: tuple[int, ...]  # blocks without any contact
    warnings: tuple[str, ...]  # one line each, naming the blocks
    tolerance: float  # m: how far contacts may lie off the faces of their blocks
    near: NearMisses | None  # what nearly touches and does not count; None = not looked for
    forgiven: str = ""  # how many contacts count only because of what is forgiven, and how much that is


def detect(assembly: Assembly, tolerance: float | Forgiven | None = None) -> Detection:
    """Find every patch in which two blocks touch face to face.

    Coplanar neighbouring faces of a block are merged into planar regions with holes; regions of different blocks
    whose normals are opposed and whose planes lie within the tolerance of each other all over the overlap touch in
    the exact intersection of their polygons, unless they are further apart than 0.1 % of the smaller block's size.
    Each part of an intersection is one contact, convex or not; a part with holes is cut through them into contacts
    without. Parts whose mean width (2 area / perimeter) is at most the tolerance are dropped, and so is touching along
    an edge or in a point. Fixed blocks are treated like any other.

    A gap that is forgiven may be up to 2.5 % of the smaller block's size. Faces that are not flat within it count as
    flat; contacts whose faces lean from them say so, and bear less friction.

    In every contact a < b and the points run counter-clockwise about the normal from a into b, on the plane midway
    between the two faces, starting at the point of least x (then y, z). Contacts are sorted by a, b, and the x, y, z
    of their middles.

    Warnings name blocks that touch nothing, blocks that nearly touch, that stand in the same place, and that run into
    each other: exactly for pairs of convex blocks, by sampled edges for others (`geometry.penetration_depths`).

    Parameters
    ----------
    assembly : Assembly
        Blocks as closed meshes; its own `contacts` are not looked at.
    tolerance : float or Forgiven, optional
        Gap (m) that is forgiven, with the angle that it allows, or the one given. By default `length_tolerance`, and
        faces that lean from each other by no more than a thousandth of a radian.

    Raises
    ------
    InputError
        The tolerance is not a positive number.
    """
    forgiven = tolerance if isinstance(tolerance, Forgiven) else Forgiven(tolerance, MAX_ANGLE) if tolerance else None
    if tolerance is not None and (forgiven is None or not 0.0 < forgiven.gap < np.inf):
        raise InputError(f"tolerance {tolerance:g} m must be a positive number of metres")
    digits = length_tolerance(assembly)
    mesh, origin = local_mesh(assembly)
    asked = _Asked.of(mesh, digits, forgiven)
    pairs = box_pairs(*mesh.boxes(), asked.gap)
    regions, a, b, found = asked.found(mesh, pairs)
    contacts, order = _ordered(regions, a, b, found, origin, digits)
    off, told, left = digits, "", 0
    if forgiven is None:
        leaning = (regions.lean[a[found.pair]] > LEANS) | (regions.lean[b[found.pair]] > LEANS)
        contacts, left = _on_faces(assembly, contacts, leaning[order], digits)
    else:
        wide = asked.wide(contacts, mesh.diagonal)
        contacts, off, kept = seated(assembly, contacts.only(wide))
        told = _forgiven(regions, a, b, found, order[wide][kept], digits)
    near = near_misses(mesh, regions, (a[found.pair], b[found.pair]), digits)
    touched = np.zeros(len(assembly), bool)
    touched[contacts.a] = touched[contacts.b] = True
    alone = tuple(np.flatnonzero(~touched).tolist())
    names = [block.id for block in assembly.blocks]
    same = _duplicates(assembly, asked.gap)
    apart = _loose(pairs, contacts, same, near, len(names))
    warnings = (
        *_listed([_lonely(names, mesh, near, i) for i in alone[: LISTED + 1]], len(alone), "blocks that touch nothing"),
        *([told] if told else []),
        *(
            [f"{left} slivers of contacts lie on no single face and are left out; `tolerance` may count them"]
            * (left > 0)
        ),
        *near.only(touched[near.a] & touched[near.b]).told(names),
        *_twice([f"'{names[i]}' and '{names[j]}'" for i, j in same]),
        *_listed(_collisions(names, mesh, regions, apart, asked.gap, origin), 0, "pairs that run into each other"),
    )
    return Detection(contacts, alone, warnings, max(off, digits), near, told)


@dataclass(frozen=True, slots=True, eq=False)
class _Asked:
    """What counts as touching."""

    digits: float  # m: precision of the drawing
    gap: float  # m
    angle: float  # rad
    share: float  # of the smaller of two blocks: no gap between them may be wider
    flat: Floats  # (n,) m: within twice which faces of each block count as flat

    @classmethod
    def of(cls, mesh: Polyhedra, digits: float, forgiven: Forgiven | None) -> "_Asked":
        if forgiven is None:
            return cls(digits, digits, LEANS, OWN_SHARE, np.full(len(mesh), digits))
        gap = max(digits, forgiven.gap * (1.0 + EQUAL))
        return cls(digits, gap, forgiven.angle, ROUGH_SHARE, np.minimum(gap, ROUGH_SHARE * mesh.diagonal))

    def most(self, size: Floats, a: Ints, b: Ints) -> Floats:
        """(k,) m: how far faces of blocks a and b may be apart; size is that of all blocks."""
        return np.minimum(self.gap, self.share * np.minimum(size[a], size[b]))

    def wide(self, contacts: Contacts, size: Floats) -> Ints:
        """Numbers of the contacts that are wider than what is forgiven."""
        width = 2.0 * contacts.area / np.maximum(contacts.perimeter, 1e-300)
        return np.flatnonzero(width > self.most(size, contacts.a, contacts.b))

    def found(self, mesh: Polyhedra, pairs: tuple[Ints, Ints]) -> tuple[PlanarRegions, Ints, Ints, Overlaps]:
        """Planar regions of all blocks, pairs of them, and where these touch."""
        regions = planar_regions(mesh, self.flat)
        a, b = facing_regions(regions, pairs, self.gap, self.angle)
        most = self.most(mesh.diagonal, regions.body[a], regions.body[b])
        return regions, a, b, region_overlaps(regions, a, b, self.digits, most)


def _on_faces(assembly: Assembly, contacts: Contacts, leaning: Bools, digits: float) -> tuple[Contacts, int]:
    """Contacts without those that lie on no single face, and how many these are; leaning (c,) of merged faces."""
    bent = np.zeros(len(assembly), bool)
    bent[assembly.mesh.face_body[face_warp(assembly.mesh) > digits / 2.0]] = True
    doubtful = np.flatnonzero(leaning | bent[contacts.a] | bent[contacts.b])
    if not len(doubtful):
        return contacts, 0
    off = doubtful[off_faces(assembly, contacts.only(doubtful))]
    return contacts.only(np.setdiff1d(np.arange(len(contacts)), off)), len(off)


def _forgiven(regions: PlanarRegions, a: Ints, b: Ints, found: Overlaps, kept: Ints, digits: float) -> str:
    """Say how many of the contacts kept there are only because something was forgiven, and how much that was."""
    pair, apart = found.pair[kept], found.apart[kept]
    askew = np.linalg.norm(regions.normal[a[pair]] + regions.normal[b[pair]], axis=1)
    which = (np.abs(apart).max(axis=1, initial=0.0) > digits) | (askew > LEANS)
    if not which.any():
        return ""
    gap, overlap = max(float(apart[which, 1].max()), 0.0), max(-float(apart[which, 0].min()), 0.0)
    parts = misses(gap, overlap, float(askew[which].max()), digits)
    said = f"{', '.join(parts[:-1])} or {parts[-1]}" if len(parts) > 1 else parts[0]
    return f"{np.count_nonzero(which)} of {len(which)} contacts count although they are drawn up to {said}"


def _lonely(names: Sequence[str], mesh: Polyhedra, near: NearMisses, block: int) -> str:
    """Say that a block touches nothing, what it is nearest to, and which option would join them."""
    if (k := near.nearest(block)) >= 0:
        other = int(near.a[k] + near.b[k]) - block
        option = near.forgiving(np.array([k])).words()
        what = f"'{names[other]}' is {near.sizes(k)} (`tolerance` {option} would count it)"
    else:
        low, high = mesh.boxes()
        clear = np.maximum(np.maximum(low - high[block], low[block] - high), 0.0)
        away = np.linalg.norm(clear, axis=1)
        away[block] = np.inf
        other = int(np.argmin(away))
        if not np.isfinite(away[other]):
            return f"block '{names[block]}' touches no other block"
        what = f"'{names[other]}' is nearest, {away[other]:.2g} m away or more, with no face that fits"
        what = what if away[other] > 0.0 else f"no face of '{names[other]}', which is nearest, fits"
    return f"block '{names[block]}' touches no other block: {what}"


def _ordered(
    regions: PlanarRegions, a: Ints, b: Ints, found: Overlaps, origin: Floats, tolerance: float
) -> tuple[Contacts, Ints]:
    """Contacts in their documented order, each polygon starting at its least point; and which overlap each is."""
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
    return whole.only(order), order


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
    pairs: tuple[Ints, Ints, Ints],
    tolerance: float,
    origin: Floats,
) -> list[str]:
    """One line for every pair of blocks that run into each other, of pairs (i, j, whether faces of theirs touch)."""
    convex = convex_bodies(regions)
    # convex blocks that touch face to face are kept apart by that very plane
    doubtful = ~(pairs[2].astype(bool) & convex[pairs[0]] & convex[pairs[1]])
    i, j = pairs[0][doubtful], pairs[1][doubtful]
    depth = penetration_depths(mesh, regions, convex, (i, j), tolerance)
    low, high = mesh.boxes()
    lines = []
    for k in np.flatnonzero(depth > 0.0).tolist():
        middle = (np.maximum(low[i[k]], low[j[k]]) + np.minimum(high[i[k]], high[j[k]])) / 2.0 + origin
        where = ", ".join(f"{x:.4g}" for x in (np.round(middle / tolerance) * tolerance).tolist())
        deep = f" by about {depth[k]:.2g} m" if np.isfinite(depth[k]) else ""
        lines.append(f"blocks '{names[i[k]]}' and '{names[j[k]]}' run into each other{deep} near ({where})")
    return lines


def _loose(
    pairs: tuple[Ints, Ints], contacts: Contacts, same: list[tuple[int, int]], near: NearMisses, n: int
) -> tuple[Ints, Ints, Ints]:
    """Pairs of blocks of which nothing is told yet, and whether they touch: no duplicates, none that nearly touch."""
    key = pairs[0] * n + pairs[1]
    said = np.array([i * n + j for i, j in same], np.int64)
    untold = ~np.isin(key, np.concatenate([said, np.minimum(near.a, near.b) * n + np.maximum(near.a, near.b)]))
    return pairs[0][untold], pairs[1][untold], np.isin(key[untold], contacts.a * n + contacts.b).astype(np.int64)


def _twice(pairs: Sequence[str]) -> Sequence[str]:
    """One line for all pairs that stand in the same place."""
    if len(pairs) < 2:
        return [f"blocks {pair} stand in the same place" for pair in pairs]
    more = f" and {len(pairs) - LISTED} more pairs" if len(pairs) > LISTED else ""
    return [f"blocks {', '.join(pairs[:LISTED])}{more} stand in the same place: is the model in the file twice?"]


def _listed(lines: Sequence[str], count: int, what: str) -> Sequence[str]:
    """The lines, or the first few and how many more there are (of `count`, where that is more)."""
    if len(lines) <= LISTED:
        return lines
    return [*lines[:LISTED], f"... and {max(count, len(lines)) - LISTED} more {what}"]
