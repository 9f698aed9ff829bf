"""Dressing: flats cut on a stone where bosses keep it from sitting, as a mason knocks them off before it is laid.

A stone is let down a little into what lies below it. Wherever it would then stand in another stone, or in the ground,
one plane takes off all that does, and it takes the stone's whole side beyond it, for a flat reaches from edge to edge.
So its direction matters: of many, the one that takes least. A plane square to the thinnest direction of a place may
take more. Planes that are nearly parallel become one, for a mason works one bed where one will do.

By hand: a box of 2 x 1 x 1 stands 1 cm deep in a table of the same size. One level cut takes 1 cm off its foot.

>>> from cyclopean.geometry.solids import CUBE
>>> corner = [[x, y, z] for x in (0, 2) for y in (0, 1) for z in (0, 1)]
>>> box = body_of(corner, [t for a, b, c, d in CUBE for t in ((a, b, c), (a, c, d))])
>>> found = dressed(box, np.eye(3), [0.0, 0.0, 0.99], [box], 0.05)
>>> [(cut.normal.round(9).tolist(), round(cut.offset, 9), round(cut.area, 9)) for cut in found.cuts]
[([0.0, 0.0, -1.0], -0.01, 2.0)]
>>> round(found.removed, 9), round(imposition(found.removed, box.volume), 9)
(0.02, 0.01)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Floats, sealed
from cyclopean.design.carving.carve import share_off
from cyclopean.design.carving.cuts import pieces_with_cavities
from cyclopean.design.rubble.features import Body, body_of
from cyclopean.design.rubble.seating import overlap_share
from cyclopean.errors import InputError
from cyclopean.geometry import mass_properties, pack
from cyclopean.geometry.frames import spiral, unit
from cyclopean.geometry.solids import Solid, beneath, intersection, mesh_of, solid_volume

__all__ = ["DEEPEST", "Cut", "Dressed", "cut_list", "dressed", "imposition", "let_down"]

DEEPEST = 0.2  # of the cube root of the volume: a blow that is to take more breaks the stone, not the boss
SPECK = 1e-6  # of the stone's volume: what is shared in a place is left to the seating, which lifts the stone by it
OVERLAP = 1e-3  # of the stone's volume: what a laid stone may share with another
ALIKE = 0.996  # cosine of 5 degrees: two beds closer than that are worked as one
DIRECTIONS = 96  # tried for a plane: 20 degrees apart
NARROWER = (0.3, 0.1)  # radians around the best of them: then some 6, then 2 degrees apart
PATCHES = 1000  # of a stone's surface, at least: by them alone directions are compared
FLAT = 1e-7  # of the stone's size: corners within it of a cut lie in it


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """One flat that a mason cuts, in the stone's own frame."""

    normal: Floats  # (3,) unit, towards what comes off
    offset: float  # m; what stays has normal . x <= offset
    area: float  # m2 of the face that is left
    depth: float  # m; how far the stone reached beyond the plane
    volume: float  # m3 that comes off here


@dataclass(frozen=True, slots=True, eq=False)
class Dressed:
    """A stone as it is after dressing, in its own frame."""

    body: Body
    cuts: tuple[Cut, ...]
    removed: float  # m3


Plane = tuple[Floats, float]  # normal towards what comes off, offset


def dressed(
    body: Body,
    rotation: ArrayLike,
    shift: ArrayLike,
    placed: Sequence[Body],
    share: float,
    ground: float | None = 0.0,
) -> Dressed | None:
    """Cut flats on a stone where it would stand in others or in the ground.

    Parameters
    ----------
    body : Body
        In its own frame.
    rotation : (3, 3) array_like
        Of the pose wanted: each point x goes to rotation x + shift.
    shift : (3,) array_like
        m.
    placed : sequence of Body
        What stands already.
    share : float
        Of its volume that the stone may lose.
    ground : float, optional
        m; height of level ground, None where there is none.

    Returns
    -------
    Dressed or None
        None where more would come off than allowed, a cut would be deeper than `DEEPEST`, or more than one piece, or
        none, would be left. Without any overlap the body itself, with no cuts.

    Raises
    ------
    InputError
        A share below 0, or of 1 and above.
    """
    if not 0.0 <= share < 1.0:
        raise InputError(f"dressing: a share of {share:g} of a stone's volume; give one from 0 to below 1")
    r, s = sealed("rotation", rotation, 3, 3), sealed("shift", shift, 3)
    there = body.moved(r, s)
    near = [other for other in placed if np.all((there.low < other.high) & (other.low < there.high))]
    planes = _planes(there, near, share, ground)
    if planes is None:
        return None
    if not planes:
        return Dressed(body, (), 0.0)
    found = _cut(body, [(normal @ r, offset - float(normal @ s)) for normal, offset in planes])
    if found is None or not found.removed <= share * body.volume:
        return None
    return found if overlap_share(found.body.moved(r, s), near) <= OVERLAP else None


def _planes(there: Body, near: Sequence[Body], share: float, ground: float | None) -> list[Plane] | None:
    """The planes to cut on a stone in its place; None where they take too much."""
    level: list[Plane] = []
    if ground is not None and there.low[2] < ground:
        level.append((np.array([0.0, 0.0, -1.0]), -ground))
    beds: list[Plane] = []
    solid = _below(there.solid, level)
    for other in near:
        for place in intersection(solid, other.solid).decompose():
            if solid_volume(place) > SPECK * there.volume:
                _clear(beds, place, solid)
                solid = beneath(solid, *beds[-1])
        if not solid_volume(solid) >= (1.0 - share) * there.volume:
            return None
    return level + beds


def _clear(beds: list[Plane], place: Solid, solid: Solid) -> None:
    """Add a plane, the last one, that takes a place off a stone; one that lies nearly so is moved instead."""
    vertices, triangles = mesh_of(place)
    inertia = mass_properties(pack([(vertices, triangles)])).inertia[0]
    thin: Floats = np.linalg.eigh(inertia)[1][:, -1]  # most inertia about it, least extent along it
    normal = _cheapest(vertices, np.stack([thin, -thin]), *_patches(solid))
    alike = [k for k, (other, _) in enumerate(beds) if other @ normal >= ALIKE]
    if alike:
        normal = beds.pop(alike[0])[0]
    beds.append((normal, float((vertices @ normal).min())))


def _cheapest(place: Floats, first: Floats, middle: Floats, area: Floats) -> Floats:
    """(3,) unit, of a plane with a place beyond it that takes as little as can be off a stone of small patches.

    What lies beyond a plane of normal n is the sum of h (n . area) over the patches at heights h > 0 above it.
    """
    around = spiral(DIRECTIONS)
    tried: Floats = np.concatenate([first, around])
    for width in (*NARROWER, 0.0):
        height = middle @ tried.T - (place @ tried.T).min(axis=0)
        best = tried[np.argmin((np.maximum(height, 0.0) * (area @ tried.T)).sum(axis=0))]
        tried = np.concatenate([best[None], unit(best + width * around)])
    return np.asarray(best)


def _patches(solid: Solid) -> tuple[Floats, Floats]:
    """Middles (k, 3) in m and outward areas (k, 3) in m2 of small triangles that make the surface of a solid."""
    vertices, triangles = mesh_of(solid)
    corner = vertices[triangles]
    parts = int(np.ceil(np.sqrt(PATCHES / len(corner))))  # of each side
    i, j = np.divmod(np.arange(parts * parts), parts)
    up = i + j < parts  # the others lie head down between them
    weight = np.stack([np.where(up, k + 1 / 3, parts - k - 1 / 3) for k in (i, j)], 1) / parts
    along = corner[:, 1:] - corner[:, :1]
    middle = corner[:, :1] + np.einsum("pk,tki->tpi", weight, along)
    area = np.cross(along[:, 0], along[:, 1]) / (2.0 * parts * parts)
    return middle.reshape(-1, 3), np.repeat(area, parts * parts, axis=0)


def _below(solid: Solid, planes: Sequence[Plane]) -> Solid:
    for normal, offset in planes:
        solid = beneath(solid, normal, offset)
    return solid


def _cut(body: Body, planes: Sequence[Plane]) -> Dressed | None:
    """A body cut by planes in its own frame, each after the other; None where no stone is left that a mason would."""
    solid, volume, steps = body.solid, body.volume, []
    for normal, offset in planes:
        depth = float((mesh_of(solid)[0] @ normal).max(initial=offset)) - offset
        if not depth <= DEEPEST * np.cbrt(body.volume):
            return None
        solid = beneath(solid, normal, offset)
        left = solid_volume(solid)
        steps.append((normal, offset, depth, volume - left))
        volume = left
    if len(pieces_with_cavities(solid)) != 1:
        return None
    made = body_of(*mesh_of(solid), "dressed stone")
    cuts = tuple(
        Cut(sealed("normal", normal, 3), offset, _area(made, normal, offset), depth, off)
        for normal, offset, depth, off in steps
        if off > SPECK * SPECK * body.volume  # a later cut may have made an earlier one needless, but for rounding
    )
    return Dressed(made, cuts, body.volume - made.volume)


def _area(body: Body, normal: Floats, offset: float) -> float:
    """Area (m2) of the faces in a plane."""
    corner = body.vertices[body.triangles]
    double = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    flat = (np.abs(corner @ normal - offset) <= FLAT * np.cbrt(body.volume)).all(axis=1)
    return float((double[flat] @ normal).sum() / 2.0)


def let_down(gap: Floats, cell: float, volume: Floats, cap: ArrayLike) -> Floats:
    """Return how far (k,) in m stones may be let down into a map, so that each shares no more than a volume with it.

    Exact: what is shared at a depth h is cell^2 sum max(h - gap, 0), linear between the gaps.

    Parameters
    ----------
    gap : (k, w, d) Floats
        m between the undersides of k stones and the map, inf outside of them.
    cell : float
        Width of a cell of the map, m.
    volume : (k,) Floats
        m3 that may be shared.
    cap : float or (k,) array_like
        m; the farthest, for instance a quarter of the cube root of the stone's volume.

    Examples
    --------
    >>> let_down(np.array([[[0.0, 0.01, np.inf]]]), 0.1, np.array([0.0003]), 0.05).round(12).tolist()
    [0.02]
    """
    rows = np.sort(gap.reshape(len(gap), -1), axis=1)
    there = np.isfinite(rows)
    known = np.where(there, rows, 0.0)
    before = np.cumsum(known, axis=1) - known
    wanted = np.asarray(volume / cell**2)
    reached = there & (np.arange(rows.shape[1]) * known - before <= wanted[:, None])
    count = reached.sum(axis=1)
    depth = (wanted + np.where(reached, known, 0.0).sum(axis=1)) / np.maximum(count, 1)
    depth = np.where(there.any(axis=1), depth, np.inf)  # without a map below them only the cap holds
    return np.asarray(np.clip(depth, 0.0, cap))


def cut_list(cuts: Sequence[Cut]) -> list[dict[str, Any]]:
    """Return cuts as plain lists and numbers, ready for JSON; SI units, in the stone's own frame."""
    return [
        {"normal": cut.normal.tolist(), **{name: getattr(cut, name) for name in ("offset", "area", "depth", "volume")}}
        for cut in cuts
    ]


def imposition(removed: float, stones: float) -> float:
    """Lambda of a wall: volume (m3) that comes off, over that of its stones; as for carved walls, 0 without stones."""
    return share_off(stones - removed, stones) if stones > 0.0 else 0.0
