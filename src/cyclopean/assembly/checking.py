"""Contacts that a file gives, held against the blocks: flat, on both blocks, and wound the right way."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.precision import FLAT_SHARE, LEANS, ROUGH_SHARE, length_tolerance, local_mesh
from cyclopean.errors import InputError
from cyclopean.geometry import (
    PlanarRegions,
    Polyhedra,
    frames_from_normals,
    newell_normals,
    planar_regions,
    ragged,
    ragged_batches,
    triangles,
)

__all__ = ["ALIGNED", "bearing", "bearing_cones", "check_contacts", "face_distances", "off_faces", "seated"]

ALIGNED = 0.95  # cosine between a contact's normal and that of a face it may lie on, as the certificate checker has it
NARROW = 4  # tolerances: contacts no wider carry nothing
TANGENT = 1e-9  # rad: a cone that touches another from inside must not leave it by rounding
FINE = 1e-3  # of the length tolerance: faces that are in one plane within it are one
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
        One line on polygons that were turned, one on points beyond the tolerance, one on normals that lean from the
        faces: such a joint is taken as curved, and its `lean` says by how much.

    Raises
    ------
    InputError
        A polygon that is not planar, has no area, or lies further from its blocks than 0.5 % of the size of the smaller
        of them (2.5 % where the surface is rough or curved).
    """
    if not len(contacts):
        return contacts, 0.0, ()
    tol = length_tolerance(assembly) if tolerance is None else float(tolerance)
    names = [f"{assembly.blocks[a].id}-{assembly.blocks[b].id}" for a, b in zip(contacts.a, contacts.b, strict=True)]
    on = _seats(assembly, contacts, names, tol)
    distance = on.sides.max(axis=1)
    if not (distance <= on.limit).all():
        raise InputError(_floating(assembly, names, on))
    return on.labelled(), float(distance.max()), tuple(_warnings(names, on, distance, tol))


def seated(assembly: Assembly, contacts: Contacts) -> tuple[Contacts, float, Ints]:
    """Hold contacts that were found against the blocks: those that no proof could use are left out, without a word.

    Returns
    -------
    contacts : Contacts
        With `lean` where faces lean from the contact, or are further off it than flat ones may be.
    distance : float
        How far the furthest point lies from its faces (m).
    kept : (k,) int
        Which of those given they are.
    """
    if not len(contacts):
        return contacts, 0.0, np.zeros(0, np.int64)
    on = _seats(assembly, contacts, [""] * len(contacts), length_tolerance(assembly))
    distance, size = on.sides.max(axis=1), _sizes(assembly, contacts)
    on = replace(on, bent=on.bent | (distance > FLAT_SHARE * size))
    kept = np.flatnonzero(distance <= ROUGH_SHARE * size)
    return on.labelled().only(kept), float(distance[kept].max(initial=0.0)), kept


def off_faces(assembly: Assembly, contacts: Contacts) -> Bools:
    """(c,) contacts with a point at which no single face, however small, is along them: a proof could not use them."""
    mesh, origin = local_mesh(assembly)
    tol = length_tolerance(assembly)
    regions = planar_regions(mesh, FINE * tol, 4.0 * tol)  # flat is what is so within the tolerance of a certificate
    point, normal = contacts.point - origin, contacts.frame[:, 0]
    distance = _side_distances(regions, contacts, point, normal, np.arange(len(contacts))).max(axis=1)
    lean = _leans(regions, contacts, point, normal, np.full(len(contacts), tol), tol)
    return np.asarray((distance > tol) | (np.sin(lean) > LEANS))


@dataclass(frozen=True, slots=True, eq=False)
class _Seats:
    """How contacts (c) lie on the faces of their blocks."""

    contacts: Contacts  # wound so that normals point from a into b
    turned: Bools  # (c,) which were not
    sides: Floats  # (c, 2) m: how far the furthest point lies from block a and from block b
    lean: Floats  # (c,) rad
    bent: Bools  # (c,) whether it is a joint between rough, curved or leaning faces
    limit: Floats  # (c,) m that a point may be off

    def labelled(self) -> Contacts:
        """The contacts, with the lean of those that are bent."""
        return replace(self.contacts, lean=np.where(self.bent, self.lean, np.nan))


def _seats(assembly: Assembly, contacts: Contacts, names: Sequence[str], tol: float) -> _Seats:
    mesh, origin = local_mesh(assembly)
    regions = planar_regions(mesh, tol)
    point = contacts.point - origin
    normal = _unit_normals(contacts, point, names, tol)
    limit = FLAT_SHARE * _sizes(assembly, contacts)
    sides = _side_distances(regions, contacts, point, normal, np.arange(len(contacts)))
    at_points = np.flatnonzero(contacts.at_points)
    sides[at_points] = np.minimum(sides[at_points], _corner_distances(mesh, contacts, point, at_points))
    far = np.flatnonzero(~(sides.max(axis=1) <= tol) & ~contacts.at_points)
    other = _side_distances(regions, contacts, point, -normal, far)
    given, reverse = sides[far].max(axis=1), other.max(axis=1)
    near = limit[far]
    turn = (reverse <= near) & (~(given <= near) | (reverse <= np.maximum(tol, CLEARLY * given)))
    turned = np.zeros(len(contacts), bool)
    turned[far[turn]] = True
    sides[far[turn]] = other[turn]
    contacts = _reversed(contacts, turned)
    distance, normal = sides.max(axis=1), np.where(turned[:, None], -normal, normal)
    lean = _leans(regions, contacts, contacts.point - origin, normal, distance, tol)
    bent = ~contacts.at_points & (~np.isnan(contacts.leaning) | (np.sin(lean) > LEANS))
    return _Seats(contacts, turned, sides, lean, bent, np.where(bent, ROUGH_SHARE / FLAT_SHARE, 1.0) * limit)


def bearing(assembly: Assembly, contacts: Contacts, tolerance: float) -> tuple[Contacts, tuple[str, ...]]:
    """Leave out contacts that are a few tolerances wide: where two blocks meet is not known well enough there.

    Parameters
    ----------
    assembly : Assembly
        The blocks.
    contacts : Contacts
        c of them.
    tolerance : float
        m, that their certificate is going to state; at a contact no more than 0.5 % of the smaller block counts.

    Returns
    -------
    contacts : Contacts
        Those whose width (area over half the perimeter) exceeds `NARROW` tolerances, and all that are said to lie on
        rough or curved surfaces, or to be points.
    warnings : tuple of str
        One line on the others.
    """
    if not len(contacts):
        return contacts, ()
    width = np.where(contacts.at_points, np.inf, 2.0 * contacts.area / np.maximum(contacts.perimeter, 1e-300))
    least = NARROW * np.minimum(tolerance, FLAT_SHARE * _sizes(assembly, contacts)) * (1.0 + 1e-9)
    kept = ~np.isnan(contacts.leaning) | (width > least)
    if kept.all():
        return contacts, ()
    k = int(np.flatnonzero(~kept)[0])
    pair = f"{assembly.blocks[contacts.a[k]].id}-{assembly.blocks[contacts.b[k]].id}"
    told = (
        f"{np.count_nonzero(~kept)} contact(s) are no wider than {NARROW} tolerances and carry nothing"
        f" ({pair}: {width[k]:.2g} m, tolerance {least[k] / NARROW:.2g} m)"
    )
    return contacts.only(np.flatnonzero(kept)), (told,)


def _sizes(assembly: Assembly, contacts: Contacts) -> Floats:
    """(c,) m: size of the smaller block at each contact."""
    size = assembly.mesh.diagonal
    return np.asarray(np.minimum(size[contacts.a], size[contacts.b]))


def _leans(
    regions: PlanarRegions, contacts: Contacts, point: Floats, normal: Floats, distance: Floats, tolerance: float
) -> Floats:
    """(c,) rad: the most by which the faces that a contact's points lie on lean from its normal, the best at each."""
    lean = np.zeros(len(contacts))
    for face in _faces_under(regions, contacts, point, normal, distance, tolerance):
        sine = np.linalg.norm(np.cross(face, normal[contacts.patch]), axis=1)
        sine = np.where(sine < 1e-7, 0.0, sine)  # rounding is no angle
        lean = np.maximum(lean, np.maximum.reduceat(np.arcsin(np.minimum(sine, 1.0)), contacts.start[:-1]))
    return lean


def _faces_under(
    regions: PlanarRegions, contacts: Contacts, point: Floats, normal: Floats, distance: Floats, tolerance: float
) -> list[Floats]:
    """(P, 3) unit normals of the faces of block a, then of b, that points lie on, turned along the contact's normal.

    Of several faces the one that leans least; where there is none, the contact's own normal.
    """
    reach = np.maximum(distance, tolerance)[contacts.patch] * (1.0 + 1e-9)
    found = []
    for body, direction in ((contacts.a, normal), (contacts.b, -normal)):
        best, face = np.full(len(point), -1.0), normal[contacts.patch].copy()
        for position, region, distances in _distances(regions, body, direction, point, contacts.start):
            on = distances <= reach[position]
            cosine = np.einsum("ki,ki->k", regions.normal[region[on]], direction[contacts.patch[position[on]]])
            order = np.argsort(cosine, kind="stable")  # the last to be written leans least
            row, which, cosine = position[on][order], region[on][order], cosine[order]
            better = cosine > best[row]
            best[row[better]] = cosine[better]
            face[row[better]] = regions.normal[which[better]]
        found.append(face * np.sign(np.einsum("pi,pi->p", face, normal[contacts.patch]))[:, None])
    return found


def bearing_cones(assembly: Assembly, contacts: Contacts, tolerance: float) -> tuple[Floats, Floats, Floats]:
    """A cone at every point inside those about the contact's normal and about the normals of the faces it lies on.

    Its axis is between the two of them that are furthest apart, and it is as much narrower as they are from it.

    Parameters
    ----------
    assembly : Assembly
        The blocks.
    contacts : Contacts
        As `check_contacts` returns them, friction filled in.
    tolerance : float
        m: how far points lie from their faces at the most.

    Returns
    -------
    normals : (P, 3, 3)
        Unit normals of the contact and of both faces, whose cones it lies in.
    axis : (P, 3)
        Unit vectors.
    mu : (P,)
        Friction about them; 0 where nothing is left.
    """
    mesh, origin = local_mesh(assembly)
    regions, patch = planar_regions(mesh, length_tolerance(assembly)), contacts.patch
    normal = contacts.frame[:, 0]
    reach = np.full(len(contacts), tolerance)
    faces = _faces_under(regions, contacts, contacts.point - origin, normal, reach, tolerance)
    three = np.stack([normal[patch], *faces], 1)  # (P, 3 vectors, 3)
    cosine = np.einsum("pik,pjk->pij", three, three)
    i, j = np.divmod(np.argmin(cosine.reshape(len(three), 9), axis=1), 3)
    row = np.arange(len(three))
    axis = three[row, i] + three[row, j]
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    apart = np.arccos(np.clip(np.einsum("pik,pk->pi", three, axis), -1.0, 1.0).min(axis=1))
    leans = ~np.isnan(contacts.leaning[patch]) & (apart > 1e-7)
    mu = contacts.mu[patch]
    mu = np.where(leans, np.tan(np.maximum(np.arctan(mu) - apart - TANGENT, 0.0)), mu)
    return three, np.where(leans[:, None], axis, normal[patch]), mu


def _unit_normals(contacts: Contacts, point: Floats, names: Sequence[str], tolerance: float) -> Floats:
    """(c, 3) unit normals of flat polygons; refuses those that have none."""
    start, patch = contacts.start, contacts.patch
    double = np.where(contacts.at_points[:, None], contacts.normal_given, newell_normals(point, start))
    length = np.linalg.norm(double, axis=1)
    if (bad := np.flatnonzero(~(length > NEEDLE * contacts.perimeter**2))).size:
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


def _corner_distances(mesh: Polyhedra, contacts: Contacts, point: Floats, which: Ints) -> Floats:
    """(m, 2) how far (m) the furthest point of each wanted contact lies from the nearest edge of either block."""
    found = np.zeros((len(which), 2))
    edges: dict[int, tuple[Floats, Floats]] = {}
    corner, face = triangles(mesh)
    first = np.searchsorted(mesh.face_body[face], np.arange(len(mesh.vertex_start)))
    for row, k in enumerate(which.tolist()):
        for side, body in enumerate((int(contacts.a[k]), int(contacts.b[k]))):
            if body not in edges:
                ring = mesh.vertex[corner[first[body] : first[body + 1]]]
                edges[body] = ring.reshape(-1, 3), (ring[:, [1, 2, 0]] - ring).reshape(-1, 3)
            start, run = edges[body]
            away = point[contacts.start[k] : contacts.start[k + 1], None] - start
            share = np.einsum("pei,ei->pe", away, run) / np.maximum(np.einsum("ei,ei->e", run, run), 1e-300)
            gap = away - np.clip(share, 0.0, 1.0)[:, :, None] * run
            found[row, side] = float(np.sqrt(np.einsum("pei,pei->pe", gap, gap).min(axis=1).max()))
    return found


def face_distances(regions: PlanarRegions, body: Ints, direction: Floats, point: Floats, start: Ints) -> Floats:
    """(p,) distance (m) of points `start[k]:start[k + 1]` from the nearest aligned region of body[k]; inf = none."""
    nearest = np.full(len(point), np.inf)
    for position, _, distance in _distances(regions, body, direction, point, start):
        np.minimum.at(nearest, position, distance)
    return nearest


def _distances(
    regions: PlanarRegions, body: Ints, direction: Floats, point: Floats, start: Ints
) -> Iterator[tuple[Ints, Ints, Floats]]:
    """(k,) points, aligned regions of their bodies, and how far (m) apart they are: every pair of them, in batches."""
    frame = frames_from_normals(regions.normal)
    away = regions.vertex[regions.corner] - regions.point[regions.corner_region]
    drawn = np.einsum("ki,kji->kj", away, frame[regions.corner_region, 1:])  # corners in their own region's plane
    contact, region = _aligned(regions, body, direction)
    for pair, position in ragged_batches(start, contact):
        here = region[pair]
        local = np.einsum("ki,kji->kj", point[position] - regions.point[here], frame[here])
        gap = _plane_distance(regions, drawn, here, local[:, 1:])
        yield position, here, np.hypot(local[:, 0], gap)


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


def _floating(assembly: Assembly, names: Sequence[str], on: _Seats) -> str:
    """What is wrong with the contact that lies furthest from its blocks."""
    k = int(np.argmax(np.where(on.sides.max(axis=1) <= on.limit, 0.0, on.sides.max(axis=1) / on.limit)))
    side = int(np.argmax(on.sides[k]))
    block = assembly.blocks[(on.contacts.a, on.contacts.b)[side][k]].id
    if np.isfinite(on.sides[k, side]):
        of = "faces, corners and edges" if on.contacts.at_points[k] else "faces"
        what = f"its polygon lies {on.sides[k, side]:.2g} m off the {of} of block '{block}' that look its way"
    else:
        what = f"no face of block '{block}' looks its way"
    return (
        f"contact {k} ({names[k]}): {what}; at most {on.limit[k]:.2g} m is allowed, 0.5 % of the smaller block's size"
        " (2.5 % where it is rough or curved): move it onto the faces of both blocks"
    )


def _warnings(names: Sequence[str], on: _Seats, distance: Floats, tolerance: float) -> Iterator[str]:
    """Lines on polygons that were turned, contacts near their blocks but not on them, and those that lean unsaid."""
    if len(which := np.flatnonzero(on.turned)):
        listed = ", ".join(f"{k} ({names[k]})" for k in which[:LISTED]) + (", ..." if len(which) > LISTED else "")
        yield f"{len(which)} contact polygon(s) wound the wrong way and were turned: {listed}"
    if count := np.count_nonzero(~(distance <= tolerance)):
        k = int(np.argmax(distance))
        yield (
            f"{count} contact(s) lie further than the tolerance of {tolerance:.2g} m from the faces of their blocks,"
            f" at most {distance[k]:.2g} m (contact {k}, {names[k]}); curved joints drawn as facets do that"
        )
    lean = np.where(on.bent & np.isnan(on.contacts.leaning), on.lean, 0.0)
    if count := np.count_nonzero(lean):
        k = int(np.argmax(lean))
        yield (
            f"{count} contact(s) lean from the faces of their blocks, by up to {np.degrees(lean[k]):.2g} degrees"
            f" (contact {k}, {names[k]}): taken as joints between rough or curved surfaces, with less friction"
        )


def _reversed(contacts: Contacts, turned: Bools) -> Contacts:
    """The contacts with the marked polygons run the other way round."""
    if not turned.any():
        return contacts
    patch, index = contacts.patch, np.arange(len(contacts.point))
    mirrored = contacts.start[patch] + contacts.start[patch + 1] - 1 - index
    return replace(contacts, point=contacts.point[np.where(turned[patch], mirrored, index)])
