"""Contacts that a file gives, held against the blocks: flat, on both blocks, and wound the right way."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.detection import length_tolerance, local_mesh
from cyclopean.errors import InputError
from cyclopean.geometry import (
    PlanarRegions,
    frames_from_normals,
    newell_normals,
    planar_regions,
    ragged,
    ragged_batches,
)

__all__ = ["ALIGNED", "REFUSED", "check_contacts", "face_distances"]

ALIGNED = 0.95  # cosine between a contact's normal and that of a face it may lie on, as the certificate checker has it
REFUSED = 0.005  # of the model's size: further from the blocks a contact is a mistake
FLAT = 1e-6  # of a polygon's own size: rounding that a file may carry
NEEDLE = 1e-9  # width / perimeter of a polygon that has no area
CLEARLY = 0.1  # a contact is turned when that brings it ten times nearer
LISTED = 5  # contacts named in a warning


def check_contacts(
    assembly: Assembly, contacts: Contacts, tolerance: float | None = None
) -> tuple[Contacts, float, tuple[str, ...]]:
    """Hold given contacts against the blocks they join.

    Every point is measured against the nearest face of `a` whose outward normal agrees with the contact's (cosine at
    least 0.95), and the nearest face of `b` whose outward normal opposes it. A polygon that finds no such faces, or
    only far ones, while its reverse lies on faces within the tolerance (or ten times nearer), is turned.

    Parameters
    ----------
    assembly : Assembly
        The blocks; its own `contacts` are not looked at.
    contacts : Contacts
        What the file says; `a` and `b` index the blocks.
    tolerance : float, optional
        Length (m) within which a point lies on a face; default `length_tolerance`.

    Returns
    -------
    contacts : Contacts
        The same contacts, wound so that their normals point from a into b.
    distance : float
        How far the furthest point lies from its faces (m).
    warnings : tuple of str
        One line on polygons that were turned, one on points beyond the tolerance.

    Raises
    ------
    InputError
        A polygon that is not planar, has no area, or lies further than 0.5 % of the model's size from a block.
    """
    if not len(contacts):
        return contacts, 0.0, ()
    tol = length_tolerance(assembly) if tolerance is None else float(tolerance)
    mesh, origin = local_mesh(assembly)
    regions = planar_regions(mesh, tol)
    point = contacts.point - origin
    names = [f"{assembly.blocks[a].id}-{assembly.blocks[b].id}" for a, b in zip(contacts.a, contacts.b, strict=True)]
    normal = _unit_normals(contacts, point, names, tol)
    limit = REFUSED * assembly.size
    everything = np.arange(len(contacts))
    sides = _side_distances(regions, contacts, point, normal, everything)
    far = np.flatnonzero(~(sides.max(axis=1) <= tol))
    other = _side_distances(regions, contacts, point, -normal, far)
    given, reverse = sides[far].max(axis=1), other.max(axis=1)
    turn = (reverse <= limit) & (~(given <= limit) | (reverse <= np.maximum(tol, CLEARLY * given)))
    turned = np.zeros(len(contacts), bool)
    turned[far[turn]] = True
    sides[far[turn]] = other[turn]
    _refuse_floating(assembly, contacts, names, sides, limit)
    distance = sides.max(axis=1)
    warnings = (
        *_turned_line(names, np.flatnonzero(turned)),
        *_distant_line(names, distance, tol),
    )
    return _reversed(contacts, turned), float(distance.max()), warnings


def _unit_normals(contacts: Contacts, point: Floats, names: Sequence[str], tolerance: float) -> Floats:
    """(c, 3) unit normals of flat polygons; refuses those that have none."""
    start, patch = contacts.start, contacts.patch
    double = newell_normals(point, start)
    length = np.linalg.norm(double, axis=1)
    following = np.arange(1, len(point) + 1)
    following[start[1:] - 1] = start[:-1]
    perimeter = np.add.reduceat(np.linalg.norm(point[following] - point, axis=1), start[:-1])
    if (bad := np.flatnonzero(~(length > NEEDLE * perimeter**2))).size:
        raise InputError(f"contact {bad[0]} ({names[bad[0]]}): its polygon has no area; remove it")
    normal = double / length[:, None]
    middle = np.add.reduceat(point, start[:-1]) / np.diff(start)[:, None]
    away = point - middle[patch]
    off = np.maximum.reduceat(np.abs(np.einsum("pi,pi->p", away, normal[patch])), start[:-1])
    own_size = np.maximum.reduceat(np.linalg.norm(away, axis=1), start[:-1])
    if (bad := np.flatnonzero(~(off <= np.maximum(tolerance, FLAT * own_size)))).size:
        k = bad[np.argmax(off[bad])]
        raise InputError(
            f"contact {k} ({names[k]}): its polygon is not planar, off by {off[k]:.2g} m; split it into planar pieces"
        )
    return np.asarray(normal)


def _side_distances(regions: PlanarRegions, contacts: Contacts, point: Floats, normal: Floats, which: Ints) -> Floats:
    """(m, 2) how far (m) the furthest point of each wanted contact lies from block a and from block b."""
    if not len(which):
        return np.zeros((0, 2))
    entry, position = ragged(contacts.start, which)
    first = np.searchsorted(entry, np.arange(len(which)))
    start = np.append(first, len(entry))
    sides = [
        face_distances(regions, block[which], direction[which], point[position], start)
        for block, direction in ((contacts.a, normal), (contacts.b, -normal))
    ]
    return np.stack([np.maximum.reduceat(side, first) for side in sides], 1)


def face_distances(regions: PlanarRegions, body: Ints, direction: Floats, point: Floats, start: Ints) -> Floats:
    """(p,) distance (m) of points `start[k]:start[k + 1]` from the nearest aligned region of body[k]; inf = none."""
    frame = frames_from_normals(regions.normal)
    away = regions.vertex[regions.corner] - regions.point[regions.corner_region]
    drawn = np.einsum("ki,kji->kj", away, frame[regions.corner_region, 1:])  # corners in their own region's plane
    contact, region = _aligned(regions, body, direction)
    nearest = np.full(len(point), np.inf)
    for pair, position in ragged_batches(start, contact):
        here = region[pair]
        local = np.einsum("ki,kji->kj", point[position] - regions.point[here], frame[here])
        gap = _plane_distance(regions, drawn, here, local[:, 1:])
        np.minimum.at(nearest, position, np.hypot(local[:, 0], gap))
    return nearest


def _aligned(regions: PlanarRegions, body: Ints, direction: Floats) -> tuple[Ints, Ints]:
    """Pairs of a contact and a region of its body that faces its way."""
    contacts, found = [], []
    for contact, region in ragged_batches(regions.body_start, body):
        agree = np.einsum("ki,ki->k", regions.normal[region], direction[contact]) >= ALIGNED
        contacts.append(contact[agree])
        found.append(region[agree])
    return np.concatenate(contacts), np.concatenate(found)


def _plane_distance(regions: PlanarRegions, drawn: Floats, region: Ints, xy: Floats) -> Floats:
    """(k,) distance (m) of flat points from their regions: 0 inside, by winding number, else to the nearest edge."""
    winding = np.zeros(len(region), np.int64)
    nearest = np.full(len(region), np.inf)
    following = regions.next_corner
    for row, corner in ragged_batches(regions.region_corner_start, region):
        p, q, x = drawn[corner], drawn[following[corner]], xy[row]
        along, away = q - p, x - p
        cross = along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]
        rising = (p[:, 1] <= x[:, 1]) & (x[:, 1] < q[:, 1]) & (cross > 0.0)
        falling = (q[:, 1] <= x[:, 1]) & (x[:, 1] < p[:, 1]) & (cross < 0.0)
        square = np.maximum(np.einsum("ki,ki->k", along, along), 1e-300)
        share = np.clip(np.einsum("ki,ki->k", along, away) / square, 0.0, 1.0)
        gap = away - share[:, None] * along
        which, first = np.unique(row, return_index=True)
        winding[which] = np.add.reduceat(rising.astype(np.int64) - falling, first)
        nearest[which] = np.minimum.reduceat(np.einsum("ki,ki->k", gap, gap), first)
    return np.asarray(np.where(winding != 0, 0.0, np.sqrt(nearest)))


def _refuse_floating(assembly: Assembly, contacts: Contacts, names: Sequence[str], sides: Floats, limit: float) -> None:
    """Raise for the contact that lies furthest from its blocks, if that is too far."""
    far = np.flatnonzero(~(sides.max(axis=1) <= limit))
    if not len(far):
        return
    k = int(far[np.argmax(sides[far].max(axis=1))])
    side = int(np.argmax(sides[k]))
    block = assembly.blocks[(contacts.a, contacts.b)[side][k]].id
    if np.isfinite(sides[k, side]):
        what = f"its polygon lies {sides[k, side]:.2g} m off the faces of block '{block}' that look its way"
    else:
        what = f"no face of block '{block}' looks its way"
    raise InputError(
        f"contact {k} ({names[k]}): {what}; at most 0.5 % of the model's size ({limit:.2g} m) is allowed:"
        " move it onto the faces of both blocks"
    )


def _turned_line(names: Sequence[str], which: Ints) -> list[str]:
    """One line that says which polygons were turned."""
    if not len(which):
        return []
    listed = ", ".join(f"{k} ({names[k]})" for k in which[:LISTED]) + (", ..." if len(which) > LISTED else "")
    return [f"{len(which)} contact polygon(s) wound the wrong way and were turned: {listed}"]


def _distant_line(names: Sequence[str], distance: Floats, tolerance: float) -> list[str]:
    """One line on contacts that lie near their blocks, but not on them."""
    count = int(np.count_nonzero(~(distance <= tolerance)))
    if not count:
        return []
    k = int(np.argmax(distance))
    return [
        f"{count} contact(s) lie further than the tolerance of {tolerance:.2g} m from the faces of their blocks,"
        f" at most {distance[k]:.2g} m (contact {k}, {names[k]}); curved joints drawn as facets do that"
    ]


def _reversed(contacts: Contacts, turned: Bools) -> Contacts:
    """The contacts with the marked polygons run the other way round."""
    if not turned.any():
        return contacts
    patch, index = contacts.patch, np.arange(len(contacts.point))
    mirrored = contacts.start[patch] + contacts.start[patch + 1] - 1 - index
    return replace(contacts, point=contacts.point[np.where(turned[patch], mirrored, index)])
