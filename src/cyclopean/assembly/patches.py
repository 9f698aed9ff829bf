"""Contacts of rough meshes: where two surfaces come within a band of each other, as few flat polygons.

Scanned stones share no plane. Two of their triangles touch where they face each other and the gap between them, along
the mean of their normals, is at most the band: that part of them is cut out exactly, a convex polygon. Those of two
blocks are gathered, by their normals and by the plane on which they lie, into patches; a patch becomes one contact:

    plane     through the middle of the touching area, normal to its mean normal
    outline   convex hull of the touching area in that plane, cut down to eight of its corners
    misfit    how far the surfaces leave the plane within the patch, at most

**Why the hull is sound.** Both blocks are rigid and touch at every corner kept, so that each of those points can carry
a force; and whatever pressures act between, their resultant lies within the hull of the touching points and is that of
forces at its corners, in the same friction cones. Hollows inside the hull change nothing.

**What a proof asks for.** The certificate checker wants every point of a contact within its tolerance of a face of
either block that looks along the contact's normal, 18 degrees apart at most. So only triangles that face each other to
within 34 degrees are gathered, and the normal is one from which each of them leans by no more than 17. A corner or an
edge of a block that stands on another with all its faces steeper than that touches in no plane that can be proved: it
is listed, with contact -1, and carries nothing. A touching area narrower than the band (a point, or a line) is widened
to a triangle or strip as wide as the band, in the plane of the faces that touch there: a moment arm of half a band, a
millimetre or so, that is not there.

By hand: of two unit cubes, one shifted along x by 0.5 on top of the other, touch 0.5 m2, misfit 0.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.contacts import Contacts
from cyclopean.errors import InputError
from cyclopean.geometry import box_pairs, frames_from_normals, triangles
from cyclopean.geometry.boxes import meeting_boxes
from cyclopean.geometry.frames import unit

__all__ = [
    "Meeting",
    "Patch",
    "Surface",
    "gathered",
    "meeting",
    "patch_notes",
    "rough_contacts",
    "usual_band",
]

BAND = 0.005  # of the cube root of the median block's volume: 2 mm for stones of 0.4 m
ALIGNED = 0.955  # least cosine between a contact's normal and those of the faces it lies on; the checker has 0.95
FACING = 2.0 * ALIGNED**2 - 1.0  # of two faces that can share such a normal
CORNERS = 8  # of a contact, at most
LEAN = 0.002  # share of the area for which a corner is not worth keeping
NARROW = 0.2  # bands; what is narrower is a line or a point
SPECK = 1e-9  # of the band squared: area below which two triangles only graze each other
SEEDS = 24  # largest parts that are tried as the beginning of a patch
TURNS = 3  # rounds in which a patch settles on its normal
TOLD = 5  # contacts whose misfit is told
ROUNDED = 1.0 + 1e-9  # bands: so that rounding loses nothing that touches
BATCH = 1 << 18  # pairs of triangles cut at a time


@dataclass(frozen=True, slots=True, eq=False)
class Meeting:
    """A patch where two blocks meet."""

    polygon: Floats  # (k, 3) m; empty where surfaces meet in a corner or edge, which no contact can stand for
    kind: str  # "face", "narrow" = widened to the band, "edge" = no contact; "flat", "point" where bodies touch exactly
    normal: Floats  # (3,) from a into b
    touching: float  # m2 of the surfaces that lie within the band of each other, as seen along the normal
    misfit: float  # m: farthest that either surface leaves the plane within the patch
    gap: float  # m: mean distance of the two surfaces, negative where they run into each other


@dataclass(frozen=True, slots=True, eq=False)
class Patch(Meeting):
    """What is known of one contact of rough surfaces."""

    contact: int  # index into the contacts; -1 = there is none
    a: int  # blocks, a < b
    b: int
    area: float  # m2 of the polygon


def rough_contacts(
    assembly: Assembly, band: float | None = None, pairs: Sequence[tuple[int, int]] | None = None
) -> tuple[Contacts, tuple[Patch, ...]]:
    """Find contacts of blocks whose surfaces are not flat.

    Parameters
    ----------
    assembly : Assembly
        Blocks as closed meshes; its own `contacts` are not looked at.
    band : float, optional
        Gap (m) up to which surfaces count as touching; default 0.005 of the size of the median block.
    pairs : sequence of (int, int), optional
        Blocks to look at; default all.

    Returns
    -------
    contacts : Contacts
        Sorted by a, then b, then by area, largest first; a < b; mu NaN.
    patches : tuple of Patch
        One for every contact, in the same order; then those that cannot be contacts.

    Raises
    ------
    InputError
        A band that is not a positive number, or a pair of blocks that is none.
    """
    if band is not None and not 0.0 < band < np.inf:
        raise InputError(f"band: {band:g} m must be a positive number of metres")
    width = usual_band(assembly.mass.volume) if band is None else float(band)
    mesh = assembly.mesh
    corner, face = triangles(mesh)
    start = np.searchsorted(mesh.face_body[face], np.arange(len(assembly) + 1))
    surfaces = [Surface.of(mesh.vertex[corner[i:j]]) for i, j in pairwise(start.tolist())]
    found = {(a, b): meeting(surfaces[a], surfaces[b], width) for a, b in _pairs(surfaces, width, pairs)}
    return gathered(found)


def patch_notes(assembly: Assembly, patches: Sequence[Patch]) -> tuple[str, ...]:
    """Say what contacts of rough surfaces stand for: how many, the worst of them, and what carries nothing."""
    ids = [block.id for block in assembly.blocks]
    held = sorted((p for p in patches if p.contact >= 0), key=lambda p: -p.misfit)
    narrow = sum(p.kind == "narrow" for p in held)
    notes = [
        f"rough surfaces: {len(held)} contacts stand for where blocks nearly touch, {narrow} of them points or lines"
        " as wide as the band"
    ]
    notes += [
        f"rough surfaces: '{ids[p.a]}' and '{ids[p.b]}' leave the plane of their contact by {p.misfit:.2g} m,"
        f" {p.touching:.2g} m2 nearly touch of {p.area:.2g} m2"
        for p in held[:TOLD]
    ]
    notes += [
        f"rough surfaces: '{ids[p.a]}' and '{ids[p.b]}' meet in a corner or an edge only, which carries nothing"
        for p in patches
        if p.contact < 0
    ]
    return tuple(notes)


def gathered(found: Mapping[tuple[int, int], Sequence[Meeting]]) -> tuple[Contacts, tuple[Patch, ...]]:
    """Make contacts, and what is known of them, of what was found between blocks a < b: as `rough_contacts` does."""
    every = [(part, a, b) for (a, b), parts in sorted(found.items(), key=lambda entry: entry[0]) for part in parts]
    every.sort(key=lambda entry: not len(entry[0].polygon))  # those that are no contacts come last
    held = [entry for entry in every if len(entry[0].polygon)]
    kinds = [part.kind for part, *_ in held]
    contacts = Contacts.of(
        [(a, b) for _, a, b in held],
        [part.polygon for part, *_ in held],
        lean=[None if kind in ("flat", "point") else 0.0 for kind in kinds],
        facing=[part.normal if part.kind == "point" else None for part, *_ in held],
    )
    area = [*contacts.area.tolist(), *[0.0] * (len(every) - len(held))]
    return contacts, tuple(
        Patch(
            **{name: getattr(part, name) for name in Meeting.__slots__},
            contact=k if k < len(held) else -1,
            a=a,
            b=b,
            area=area[k],
        )
        for k, (part, a, b) in enumerate(every)
    )


def usual_band(volume: Floats) -> float:
    """The band (m) for blocks of these volumes."""
    size = np.sort(np.cbrt(np.abs(volume)))
    return BAND * float(size[(len(size) - 1) // 2]) if len(size) else 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """The triangles of one block."""

    corner: Floats  # (t, 3, 3)
    normal: Floats  # (t, 3) unit
    low: Floats  # (t, 3)
    high: Floats  # (t, 3)

    @classmethod
    def of(cls, corner: Floats) -> "Surface":
        """Of triangles (t, 3, 3), counter-clockwise from outside."""
        double = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        return cls(corner, unit(double), corner.min(axis=1), corner.max(axis=1))


def _pairs(surfaces: Sequence[Surface], band: float, pairs: Sequence[tuple[int, int]] | None) -> list[tuple[int, int]]:
    """Blocks a < b that may touch, in order."""
    count = len(surfaces)
    if pairs is not None:
        chosen = {(min(int(a), int(b)), max(int(a), int(b))) for a, b in pairs}
        for a, b in sorted(chosen):
            if not (0 <= a < count and b < count) or a == b:
                raise InputError(f"pairs: ({a}, {b}) does not name two of the blocks 0..{count - 1}")
        return sorted(chosen)
    if count < 2:
        return []
    low = np.array([s.low.min(axis=0, initial=np.inf) for s in surfaces])
    high = np.array([s.high.max(axis=0, initial=-np.inf) for s in surfaces])
    i, j = box_pairs(low, high, band)
    return list(zip(i.tolist(), j.tolist(), strict=True))


def meeting(a: Surface, b: Surface, band: float) -> list[Meeting]:
    """Patches of two blocks, largest first."""
    i, j = meeting_boxes(a.low, a.high, b.low, b.high, band)
    opposed = -np.einsum("ki,ki->k", a.normal[i], b.normal[j])
    facing = np.flatnonzero(opposed >= FACING)
    facing = facing[_near(a, b, i[facing], j[facing], band)]
    parts = _parts(_pieces(a, b, i[facing], j[facing], band), band)
    if parts:
        return parts
    steep = np.flatnonzero((opposed > 0.0) & (opposed < FACING))
    return _steep(a, b, i[steep], j[steep], band)


def _near(a: Surface, b: Surface, i: Ints, j: Ints, band: float) -> Bools:
    """(k,) pairs of triangles of which neither lies wholly farther than the band from the plane of the other."""
    near = np.ones(len(i), bool)
    for one, two, x, y in ((a, b, i, j), (b, a, j, i)):
        height = np.einsum("kci,ki->kc", one.corner[x] - two.corner[y, :1], two.normal[y])
        near &= (height.min(axis=1) <= band * ROUNDED) & (height.max(axis=1) >= -band * ROUNDED)
    return near


def _parts(pieces: "_Pieces", band: float) -> list[Meeting]:
    """Patches of pieces, largest first."""
    parts: list[Meeting] = []
    left = np.ones(len(pieces.area), bool)
    while left.any():
        members, normal = _largest(pieces, left, band)
        parts.append(_part(pieces, members, normal, band))
        left[members] = False
    parts.sort(key=lambda part: -part.touching)
    return parts


@dataclass(frozen=True, slots=True, eq=False)
class _Pieces:
    """Where pairs of triangles lie within the band of each other: convex polygons with up to m corners (k of them)."""

    point: Floats  # (k, m, 3) halfway between the two; unused rows repeat the first
    gap: Floats  # (k, m)
    area: Floats  # (k,)
    middle: Floats  # (k, 3) mean of the corners
    normal: Floats  # (k, 3) mean normal, from a into b
    normal_a: Floats  # (k, 3)
    normal_b: Floats  # (k, 3)


def _pieces(a: Surface, b: Surface, i: Ints, j: Ints, band: float) -> _Pieces:
    """Cut the parts of triangles i and j out that lie within the band of each other."""
    start = range(0, max(len(i), 1), BATCH)
    batches = [_cut(a, b, i[k : k + BATCH], j[k : k + BATCH], band) for k in start]
    return _Pieces(*(np.concatenate([getattr(part, name) for part in batches]) for name in _Pieces.__slots__))


def _cut(a: Surface, b: Surface, i: Ints, j: Ints, band: float) -> _Pieces:
    """Triangle i, seen along the mean normal, clipped by the sides of triangle j and by gaps of -band and band."""
    normal_a, normal_b = a.normal[i], b.normal[j]
    mean = normal_a - normal_b
    frame = frames_from_normals(unit(mean))
    origin = a.corner[i, 0]
    one = np.einsum("kci,kfi->kcf", a.corner[i] - origin[:, None], frame)
    two = np.einsum("kci,kfi->kcf", b.corner[j] - origin[:, None], frame)[:, [0, 2, 1]]
    # the first corner again in unused rows, so that they add no area
    ring, count = one[:, [0, 1, 2, 0, 0, 0, 0, 0], 1:], np.full(len(i), 3)
    for c in range(3):
        start, run = two[:, c, 1:], two[:, (c + 1) % 3, 1:] - two[:, c, 1:]
        inward = np.stack([-run[:, 1], run[:, 0]], 1)
        ring, count = _clipped(ring, count, inward, -np.einsum("ki,ki->k", inward, start))
    lean_a, rise_a = _height(normal_a, frame, one[:, 0])
    lean_b, rise_b = _height(normal_b, frame, two[:, 0])
    for sign in (1.0, -1.0):
        ring, count = _clipped(ring, count, sign * (lean_b - lean_a), band + sign * (rise_b - rise_a))
    area = _area(ring)
    kept = np.flatnonzero((count >= 3) & (area > SPECK * band * band))
    ring, count, frame, origin = ring[kept], count[kept], frame[kept], origin[kept]
    below = np.einsum("kmi,ki->km", ring, lean_a[kept]) + rise_a[kept, None]
    above = np.einsum("kmi,ki->km", ring, lean_b[kept]) + rise_b[kept, None]
    local = np.concatenate([((below + above) / 2.0)[:, :, None], ring], axis=2)
    point = np.einsum("kmf,kfi->kmi", local, frame) + origin[:, None]
    used = np.arange(ring.shape[1])[None, :] < count[:, None]
    middle = np.where(used[:, :, None], point, 0.0).sum(axis=1) / np.maximum(count, 1)[:, None]
    return _Pieces(point, above - below, area[kept], middle, frame[:, 0], normal_a[kept], normal_b[kept])


def _height(normal: Floats, frame: Floats, point: Floats) -> tuple[Floats, Floats]:
    """A plane in the frame as height = lean . (u, v) + rise: (k, 2) and (k,)."""
    local = np.einsum("ki,kfi->kf", normal, frame)
    lean = -local[:, 1:] / local[:, :1]
    return lean, point[:, 0] - np.einsum("ki,ki->k", lean, point[:, 1:])


def _clipped(ring: Floats, count: Ints, inward: Floats, offset: Floats) -> tuple[Floats, Ints]:
    """Convex polygons (k, m, 2) cut to inward . x + offset >= 0 (Sutherland and Hodgman 1974), all at once."""
    k, m = ring.shape[:2]
    used = np.arange(m)[None, :] < count[:, None]
    following = np.where(np.arange(m)[None, :] + 1 < count[:, None], np.arange(m)[None, :] + 1, 0)
    height = np.einsum("kmi,ki->km", ring, inward) + offset[:, None]
    later = np.take_along_axis(height, following, axis=1)
    to = np.take_along_axis(ring, following[:, :, None], axis=1)
    crosses = used & ((height >= 0.0) != (later >= 0.0))
    share = height / np.where(crosses, height - later, 1.0)
    out = np.stack([ring, ring + share[:, :, None] * (to - ring)], axis=2).reshape(k, 2 * m, 2)
    keep = np.stack([used & (height >= 0.0), crosses], axis=2).reshape(k, 2 * m)
    order = np.argsort(~keep, axis=1, kind="stable")[:, :m]
    kept = np.take_along_axis(keep, order, axis=1)
    out = np.take_along_axis(out, order[:, :, None], axis=1)
    return np.where(kept[:, :, None], out, out[:, :1]), keep.sum(axis=1)


def _area(ring: Floats) -> Floats:
    """(k,) area of polygons."""
    x, y = ring[:, :, 0] - ring[:, :1, 0], ring[:, :, 1] - ring[:, :1, 1]
    return np.asarray((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1) / 2.0)


def _largest(pieces: _Pieces, left: Bools, band: float) -> tuple[Ints, Floats]:
    """Members and normal of the patch of most area among the pieces that are left."""
    rows = np.flatnonzero(left)
    best: tuple[float, Ints, Floats] = (-1.0, rows[:0], np.zeros(3))
    seen = np.zeros(len(left), bool)
    for seed in rows[np.argsort(-pieces.area[rows], kind="stable")[:SEEDS]].tolist():
        if seen[seed]:
            continue  # it is in a patch already that began at a larger one
        normal, middle = pieces.normal[seed], pieces.middle[seed]
        members = _members(pieces, rows, normal, middle, band)
        for _ in range(TURNS):
            weight = pieces.area[members]
            mean = weight @ pieces.normal[members]
            mean /= np.linalg.norm(mean)
            grown = _members(pieces, rows, mean, weight @ pieces.middle[members] / weight.sum(), band)
            if pieces.area[grown].sum() < weight.sum():
                break
            members, normal = grown, mean
        seen[members] = True
        total = float(pieces.area[members].sum())
        if total > best[0]:
            best = (total, members, normal)
        if len(members) == len(rows):
            break
    return best[1], best[2]


def _members(pieces: _Pieces, rows: Ints, normal: Floats, middle: Floats, band: float) -> Ints:
    """Pieces whose faces look along the normal, and all of whose corners lie within the band of the plane."""
    along = (pieces.normal_a[rows] @ normal >= ALIGNED) & (-pieces.normal_b[rows] @ normal >= ALIGNED)
    near = rows[along]
    off = np.abs((pieces.point[near] - middle) @ normal).max(axis=1, initial=0.0)
    return np.asarray(near[off <= band])


def _part(pieces: _Pieces, members: Ints, normal: Floats, band: float) -> Meeting:
    """The contact polygon of a patch, and its facts."""
    weight = pieces.area[members]
    middle = weight @ pieces.middle[members] / weight.sum()
    frame = frames_from_normals(normal[None])[0]
    local = (pieces.point[members].reshape(-1, 3) - middle) @ frame.T
    gap = pieces.gap[members].reshape(-1)
    outline, widened = _outline(local[:, 1:], band)
    misfit = float((np.abs(local[:, 0]) + np.abs(gap) / 2.0).max())
    slope = np.einsum("ki,i->k", pieces.normal[members], normal)
    mean = float(weight @ pieces.gap[members].mean(axis=1) / weight.sum())
    polygon = middle + outline @ frame[1:]
    kind = "narrow" if widened else "face"
    return Meeting(polygon, kind, normal, float(weight @ slope), misfit, mean)


def _outline(xy: Floats, band: float) -> tuple[Floats, bool]:
    """Hull (k, 2) of points in a plane, counter-clockwise, with few corners and not too narrow; whether widened."""
    from scipy.spatial import ConvexHull

    _, vector = np.linalg.eigh(np.cov(xy.T))
    turned = xy @ vector[:, ::-1]  # longest first
    extent = np.ptp(turned, axis=0)
    widened = bool(extent[1] < NARROW * band)
    if widened:
        centre = (turned.max(axis=0) + turned.min(axis=0)) / 2.0
        if extent[0] < band:
            corner = band / np.sqrt(3.0) * np.exp(2j * np.pi * np.arange(3) / 3.0)  # sides as long as the band
            turned = centre + np.stack([corner.real, corner.imag], 1)
        else:
            half = np.array([extent[0], band]) / 2.0
            turned = centre + half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        xy = turned @ vector[:, ::-1].T
    return _reduced(xy[ConvexHull(xy).vertices]), widened


def _reduced(ring: Floats) -> Floats:
    """Leave out corners of a convex ring, the one that costs least area first, until what is left is worth keeping."""
    ring = ring.copy()
    x, y = ring.T
    whole = float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))  # twice the area
    while len(ring) > 3:
        back, on = np.roll(ring, 1, axis=0) - ring, np.roll(ring, -1, axis=0) - ring
        loss = np.abs(back[:, 0] * on[:, 1] - back[:, 1] * on[:, 0])
        k = int(np.argmin(loss))
        if len(ring) <= CORNERS and not loss[k] <= LEAN * whole:
            break
        ring = np.delete(ring, k, axis=0)
    return ring


def _steep(a: Surface, b: Surface, i: Ints, j: Ints, band: float) -> list[Meeting]:
    """One entry for blocks that touch with steep faces only, in a corner or along an edge; none where they do not."""
    if not len(i):
        return []
    pieces = _pieces(a, b, i, j, band)
    if not len(pieces.area):
        return []
    mean = pieces.area @ pieces.normal
    length = float(np.linalg.norm(mean))
    normal = mean / length if length > 0.0 else pieces.normal[0]
    off = float((np.abs((pieces.point - pieces.middle.mean(axis=0)) @ normal) + np.abs(pieces.gap) / 2.0).max())
    gap = float(pieces.area @ pieces.gap.mean(axis=1) / pieces.area.sum())
    return [Meeting(np.zeros((0, 3)), "edge", normal, float(pieces.area.sum()), off, gap)]
