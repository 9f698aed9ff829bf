"""Polygon meshes made closed and outward, many at a time, or told why they cannot be.

Models come with faces that share no vertices, run the wrong way round, stand twice, miss a lid, or meet with a vertex
of one on an edge of another. What is mended leaves the shape as it is: vertices in one place become one, a vertex on
an edge becomes a corner of the face beyond, faces are oriented alike and outward, and faces stay polygons. What
changes the shape is told with its size: cracks, holes, shells inside others. What would have to be guessed is not
done: a hole that is not flat, an edge with three faces, a sheet without thickness.

All lengths are compared in diagonals of the body itself. A body is mended whole or left as it came.

>>> from cyclopean.geometry.polyhedra import pack, unpacked
>>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
>>> found = mended(pack([(corner, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 3, 2)])]))
>>> [done.text for done in found.done[0]]
['1 face was turned over']
>>> flat = mended(pack([(corner, [(0, 2, 1), (0, 1, 3), (0, 3, 2)])]))
>>> [done.text for done in flat.done[0]], unpacked(flat.mesh)[0][1][3]
(['1 flat hole closed, 0.866 m2'], (3, 1, 2))
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.geometry.boxes import meeting_boxes
from cyclopean.geometry.frames import newell_normals, unit
from cyclopean.geometry.packed import components, following, offsets, ragged
from cyclopean.geometry.polygon import triangulated
from cyclopean.geometry.polyhedra import (
    Polyhedra,
    bodies_of,
    compacted,
    joined,
    mass_properties,
    mesh_faults,
)
from cyclopean.geometry.shells import nested
from cyclopean.geometry.sides import Sides, open_bodies, rings

__all__ = [
    "ATTEMPTS",
    "FLAT",
    "KINDS",
    "Done",
    "Mended",
    "Reach",
    "Work",
    "mended",
    "place_text",
    "sewn",
    "shaped",
    "turned_alike",
    "welded",
]

FLAT = 1e-3  # of the diagonal: a ring that is nowhere farther from a plane may be the edge of a face

KINDS = {
    "weld": "{} vertex was welded|{} vertices were welded",
    "fold": "{} face without area dropped|{} faces without area dropped",
    "twice": "{} face that stood twice dropped|{} faces that stood twice dropped",
    "crack": "{} vertex was welded across a crack|{} vertices were welded across cracks",
    "stitch": "{} vertex was joined to the edge it lies on|{} vertices were joined to the edges they lie on",
    "tiny": "{} tiny hole closed|{} tiny holes closed",
    "flat": "{} flat hole closed|{} flat holes closed",
    "turn": "{} face was turned over|{} faces were turned over",
    "out": "was inside out and was turned|{} shells were inside out and were turned",
    "slab": "was a sheet without thickness and was made a slab|{} sheets without thickness were made slabs",
    "inner": "{} shell inside the surface dropped|{} shells inside the surface dropped",
}
"""What is done, of one and of many, in the order in which it is done."""


@dataclass(frozen=True, slots=True)
class Done:
    """One kind of thing that was done to a body, how often, and of what size."""

    kind: str  # of KINDS
    count: int
    size: str = ""

    @property
    def text(self) -> str:
        """In words."""
        one, _, many = KINDS[self.kind].partition("|")
        return (one if self.count == 1 else many).format(self.count) + (f", {self.size}" if self.size else "")


@dataclass(frozen=True, slots=True)
class Reach:
    """How far mending goes, in diagonals of the body."""

    crack: float = 1e-6
    """Width of cracks that are welded: the digits that a file format cut off."""
    hole: float = 0.25
    """Length round a hole that is closed whatever its shape: 0.08 across, half a percent of a round stone's surface."""
    lids: bool = False
    """Whether flat holes are closed whatever their size: a face that was not drawn."""


ATTEMPTS = Reach(), Reach(crack=1e-3), Reach(lids=True)
"""What is tried of a model's block, one after the other, until it is sound; a crack may be 1 mm in a block of 1 m."""


@dataclass(frozen=True, slots=True, eq=False)
class Mended:
    """Bodies, those with a fault as they came."""

    mesh: Polyhedra  # n bodies
    done: tuple[tuple[Done, ...], ...]  # (n)
    fault: tuple[tuple[int, str], ...]  # body and what is wrong with it still
    origin: Ints  # (F,) number that each face had in its body; -1 = a hole was closed with it
    turned: Bools  # (F,) whether it runs the other way round now


@dataclass(frozen=True, slots=True, eq=False)
class Work:
    """Meshes on the way, and what was done to them so far."""

    mesh: Polyhedra
    origin: Ints  # (F,)
    turned: Bools  # (F,)
    done: list[list[Done]]  # (n)
    fault: dict[int, str]  # body and why it cannot be mended

    @classmethod
    def of(cls, mesh: Polyhedra) -> "Work":
        """Nothing done yet."""
        face = np.arange(len(mesh.corner_start) - 1) - mesh.face_start[mesh.face_body]
        return cls(mesh, face, np.zeros(len(face), bool), [[] for _ in range(len(mesh))], {})

    @property
    def sides(self) -> Sides:
        """Of its faces."""
        return Sides.of(self.mesh.corner, self.mesh.corner_start)

    def told(self, kind: str, count: Ints, size: dict[int, str] | None = None) -> "Work":
        """The same, with so much (n,) done to each body."""
        for body in np.flatnonzero(count).tolist():
            self.done[body].append(Done(kind, int(count[body]), (size or {}).get(body, "")))
        return self

    def kept(self, face: Bools) -> "Work":
        """Only the chosen (F,) faces."""
        if face.all():
            return self
        which, position = ragged(self.mesh.corner_start, np.flatnonzero(face))
        count = np.bincount(self.mesh.face_body[face], minlength=len(self.mesh))
        mesh = replace(
            self.mesh,
            corner=self.mesh.corner[position],
            corner_start=offsets(np.bincount(which, minlength=int(face.sum()))),
            face_start=offsets(count),
        )
        return replace(self, mesh=mesh, origin=self.origin[face], turned=self.turned[face])

    def named(self, corner: Ints) -> "Work":
        """With other corners (K,); those that came to lie on their neighbours go, and faces of fewer than three."""
        work = replace(self, mesh=replace(self.mesh, corner=corner))
        while True:
            mesh = work.mesh
            after = following(mesh.corner_start)
            before = np.zeros_like(after)
            before[after] = np.arange(len(after))
            over = mesh.corner == mesh.corner[after]
            if not over.any():
                over = mesh.corner[before] == mesh.corner[after]  # there and back again
            if not over.any():
                return work
            size = np.bincount(mesh.corner_face[~over], minlength=len(mesh.corner_start) - 1)
            work = replace(work, mesh=replace(mesh, corner=mesh.corner[~over], corner_start=offsets(size))).kept(
                size > 2
            )


def mended(mesh: Polyhedra, attempts: Sequence[Reach] = ATTEMPTS) -> Mended:
    """Mend every body that is no closed, outward solid; sound ones are not touched.

    Returns
    -------
    Mended
        Of mended bodies, vertices that no face names any more are dropped.
    """
    came = Work.of(mesh)
    found = Mended(mesh, ((),) * len(mesh), tuple(mesh_faults(mesh)), came.origin, came.turned)
    for reach in attempts:
        if not found.fault:
            break
        found = _once(found, reach)
    return found


def _once(before: Mended, reach: Reach) -> Mended:
    """Mend what has a fault, from what it came as; all bodies in their order, what could not be mended as it came."""
    bad = np.array([body for body, _ in before.fault])
    work = shaped(sewn(Work.of(bodies_of(before.mesh, bad)), reach), reach)
    still = _pinched(work.mesh) | dict(mesh_faults(work.mesh))
    fault = {int(bad[k]): work.fault.get(k) or _where(work, k, still[k]) for k in sorted({*still, *work.fault})}
    row = np.arange(len(before.mesh))
    fresh = np.flatnonzero(~np.isin(bad, list(fault)))
    row[bad[fresh]] = len(row) + fresh
    both = joined(before.mesh, compacted(work.mesh))
    _, face = ragged(both.face_start, row)
    done = list(before.done)
    for k in fresh.tolist():
        done[int(bad[k])] = tuple(work.done[k])
    origin = np.concatenate([before.origin, work.origin])[face]
    turned = np.concatenate([before.turned, work.turned])[face]
    return Mended(bodies_of(both, row), tuple(done), tuple(fault.items()), origin, turned)


def _pinched(mesh: Polyhedra) -> dict[int, str]:
    """Bodies with a face that comes to one vertex twice: no polygon."""
    face = mesh.corner_face
    key, count = np.unique(face * max(len(mesh.vertex), 1) + mesh.corner, return_counts=True)
    twice = mesh.face_body[key[count > 1] // max(len(mesh.vertex), 1)]
    return dict.fromkeys(np.unique(twice).tolist(), "has a face that comes to one vertex twice")


def _where(work: Work, body: int, said: str) -> str:
    """What is wrong with a body, and the place (m) where it can be seen."""
    mesh, sides = work.mesh, work.sides
    here = mesh.face_body[sides.face] == body
    many = np.flatnonzero(here & (sides.count[sides.edge] > 2))
    if len(many):
        count = len(np.unique(sides.edge[many]))
        edges = "1 edge" if count == 1 else f"{count} edges"
        place = mesh.vertex[[sides.tail[many[0]], sides.head[many[0]]]].mean(axis=0)
        return f"has {edges} with more than two faces{', one' * (count > 1)} near {place_text(place)}"
    used = mesh.vertex[sides.tail[here]]
    if said != "has zero volume" or not len(used):
        return said
    return f"is a sheet without thickness near {place_text(used.mean(axis=0))}"


def welded(mesh: Polyhedra) -> Polyhedra:
    """Equal vertices of a body are one, where it has an edge without exactly one face on either side."""
    return _welded(Work.of(mesh)).mesh


def sewn(work: Work, reach: Reach) -> Work:
    """Let faces share their vertices, and drop those that stand twice."""
    return _stitched(_across_cracks(_single(_welded(work)), reach.crack), reach.crack)


def _welded(work: Work) -> Work:
    mesh = work.mesh
    chosen = open_bodies(mesh)[mesh.vertex_body]
    here = np.flatnonzero(chosen)
    if not len(here):
        return work
    keys = np.column_stack([mesh.vertex[here][:, ::-1], mesh.vertex_body[here]]).T
    order = np.lexsort(keys)  # stable: the lowest index of equals comes first
    fresh = np.concatenate([[True], (np.diff(keys[:, order], axis=1) != 0.0).any(axis=0)])
    target = np.arange(len(mesh.vertex))
    target[here[order]] = here[order[np.flatnonzero(fresh)]][np.cumsum(fresh) - 1]
    used = np.unique(mesh.corner)
    gone = used[target[used] != used]
    told = work.told("weld", np.bincount(mesh.vertex_body[gone], minlength=len(mesh)))
    clean = told.named(target[mesh.corner])
    return clean.told("fold", np.diff(mesh.face_start) - np.diff(clean.mesh.face_start))


def _single(work: Work) -> Work:
    """Faces that are left when none stands twice.

    Of two faces with the same corners one stays, or none where the body closes better so: a fin that sticks out of a
    surface has two.
    """
    first, count = _same_corners(work.mesh)
    if (count == 1).all():
        return work
    one = first == np.arange(len(first))
    none = one & (count % 2 == 1)
    gaps = []
    for chosen in (one, none):
        left = work.kept(chosen)
        sides = left.sides
        odd = sides.face[sides.count[sides.edge] % 2 == 1]
        gaps.append(np.bincount(left.mesh.face_body[odd], minlength=len(work.mesh)))
    body = work.mesh.face_body
    chosen = np.where((gaps[1] < gaps[0])[body], none, one)
    return work.told("twice", np.bincount(body[~chosen], minlength=len(work.mesh))).kept(chosen)


def _same_corners(mesh: Polyhedra) -> tuple[Ints, Ints]:
    """(F,) the first face with the same corners as each face, and (F,) how many there are."""
    size = np.diff(mesh.corner_start)
    first, count = np.arange(len(size)), np.ones(len(size), np.int64)
    for k in np.unique(size).tolist():
        face = np.flatnonzero(size == k)
        corner = np.sort(mesh.corner[mesh.corner_start[face][:, None] + np.arange(k)], axis=1)
        order = np.lexsort(corner.T[::-1])  # stable: the lowest number of equals comes first
        fresh = np.concatenate([[True], (np.diff(corner[order], axis=0) != 0).any(axis=1)])
        group = np.cumsum(fresh) - 1
        first[face[order]] = face[order[np.flatnonzero(fresh)]][group]
        count[face[order]] = np.bincount(group)[group]
    return first, count


def _own_size(mesh: Polyhedra) -> Floats:
    """(V, 3) vertices in diagonals of their body, from its lowest corner."""
    low, size = mesh.boxes()[0], mesh.diagonal
    whose = mesh.vertex_body
    return np.asarray((mesh.vertex - low[whose]) / np.where(size > 0.0, size, 1.0)[whose][:, None])


def _rim(work: Work) -> tuple[Ints, Ints, Floats]:
    """Tail and head of the sides without neighbour, and (n,) how long those of each body are, in its diagonals."""
    sides = work.sides
    tail, head = sides.tail[sides.lone], sides.head[sides.lone]
    point = _own_size(work.mesh)
    length = np.linalg.norm(point[head] - point[tail], axis=1)
    return tail, head, np.asarray(np.bincount(work.mesh.vertex_body[tail], length, len(work.mesh)), float)


def _across_cracks(work: Work, width: float) -> Work:
    """Weld vertices of the rim no farther apart than `width` of their body, where its rim is shorter then."""
    from scipy.spatial import cKDTree

    tail, head, before = _rim(work)
    if not len(tail):
        return work
    mesh, rim = work.mesh, np.unique([tail, head])
    whose = mesh.vertex_body
    beside = np.column_stack([_own_size(mesh)[rim], 4.0 * whose[rim]])  # bodies far from each other
    pair = rim[cKDTree(beside).query_pairs(width, output_type="ndarray")]
    sides, many = work.sides, len(mesh.vertex)
    edge = np.minimum(sides.tail, sides.head) * many + np.maximum(sides.tail, sides.head)
    pair = pair[~np.isin(pair.min(axis=1) * many + pair.max(axis=1), edge)]  # a short side is no crack
    if not len(pair):
        return work
    label = components(many, pair[:, 0], pair[:, 1])
    target = np.unique(label, return_index=True)[1][label]
    better = _rim(work.named(target[mesh.corner]))[2] < before
    target = np.where(better[whose], target, np.arange(many))
    gone = np.flatnonzero(target != np.arange(many))
    apart = np.linalg.norm(mesh.vertex[gone] - mesh.vertex[target[gone]], axis=1)
    widest = {b: f"up to {apart[whose[gone] == b].max():.2g} m wide" for b in np.unique(whose[gone]).tolist()}
    work.told("crack", np.bincount(whose[gone], minlength=len(mesh)), widest)
    return work.named(target[mesh.corner])


def _stitched(work: Work, width: float) -> Work:
    """Make vertices of the rim that lie on a side of the rim corners of its face, where the rim is shorter then."""
    before = _rim(work)[2]
    if not before.any():
        return work
    side, vertex = _on_sides(work, width)
    if not len(side):
        return work
    mesh = work.mesh
    better = _rim(_inserted(work, side, vertex))[2] < before
    chosen = better[mesh.vertex_body[vertex]]
    side, vertex = side[chosen], vertex[chosen]
    put = np.unique(vertex)
    work.told("stitch", np.bincount(mesh.vertex_body[put], minlength=len(mesh)))
    return _inserted(work, side, vertex)


def _on_sides(work: Work, width: float) -> tuple[Ints, Ints]:
    """Sides of the rim and the vertices of the rim that lie on them, in the order along each side."""
    mesh, sides = work.mesh, work.sides
    lone, point = sides.lone, _own_size(mesh)
    rim = np.unique([sides.tail[lone], sides.head[lone]])
    a, b = point[sides.tail[lone]], point[sides.head[lone]]
    beside = np.zeros((len(mesh), 3))
    beside[:, 0] = 4.0 * np.arange(len(mesh))
    shift, own = beside[mesh.vertex_body[sides.tail[lone]]], beside[mesh.vertex_body[rim]]
    low, high, at = np.minimum(a, b) + shift, np.maximum(a, b) + shift, point[rim] + own
    i, j = meeting_boxes(low, high, at, at, width)
    along, away = b[i] - a[i], point[rim[j]] - a[i]
    length = np.linalg.norm(along, axis=1)
    share = np.einsum("ki,ki->k", along, away) / np.maximum(length, 1e-300) ** 2
    off = np.linalg.norm(away - share[:, None] * along, axis=1)
    many = len(mesh.vertex)
    own_corner = np.isin(sides.face[lone[i]] * many + rim[j], sides.face * many + sides.tail)
    clear = width / np.maximum(length, 1e-300)
    on = (off <= width) & (share > clear) & (share < 1.0 - clear) & ~own_corner
    i, j, share = i[on], j[on], share[on]
    order = np.lexsort((share, i))
    return lone[i[order]], rim[j[order]]


def _inserted(work: Work, side: Ints, vertex: Ints) -> Work:
    """With vertices as corners on sides, in the order given."""
    mesh = work.mesh
    size = np.diff(mesh.corner_start) + np.bincount(mesh.corner_face[side], minlength=len(mesh.corner_start) - 1)
    return replace(
        work, mesh=replace(mesh, corner=np.insert(mesh.corner, side + 1, vertex), corner_start=offsets(size))
    )


def shaped(work: Work, reach: Reach, turn: bool = True) -> Work:
    """Orient faces alike, close holes, and turn the whole outward; with `turn` False faces stay as they run."""
    return _outward(_closed(turned_alike(work), reach)) if turn else _closed(work, reach)


def turned_alike(work: Work) -> Work:
    """Let neighbours agree about which side is out, as most of them do already.

    Each face stands twice in a graph, as it is and turned over; neighbours that run along their edge the same way are
    joined crosswise. A surface with one side only joins a face to itself turned over.
    """
    sides = work.sides
    one, two = sides.pairs()
    cross = sides.tail[one] == sides.tail[two]
    if not cross.any():
        return work
    n = len(work.turned)
    a, b = sides.face[one], sides.face[two]
    label = components(2 * n, np.concatenate([a, a + n]), np.concatenate([b + n * cross, b + n * ~cross]))
    patch, turned = np.minimum(label[:n], label[n:]), label[:n] > label[n:]
    most = 2 * np.bincount(patch, turned) > np.bincount(patch)
    turned ^= most[patch]
    for body in np.unique(work.mesh.face_body[label[:n] == label[n:]]).tolist():
        work.fault[body] = "has one side only: its faces cannot be oriented alike"
    return _turned(work, turned)


def _turned(work: Work, face: Bools) -> Work:
    """With the chosen (F,) faces turned over."""
    start, which = work.mesh.corner_start, work.mesh.corner_face
    here = np.arange(len(which))
    back = start[which] + start[which + 1] - 1 - here
    corner = work.mesh.corner[np.where(face[which], back, here)]
    return replace(work, mesh=replace(work.mesh, corner=corner), turned=work.turned ^ face)


def _closed(work: Work, reach: Reach) -> Work:
    """Close the holes of each body, if all of them can be; else the largest that cannot is its fault."""
    sides = work.sides
    holes: dict[int, list[_Hole]] = {}
    for ring in rings(sides.rim):
        body = int(work.mesh.vertex_body[ring[0]])
        holes.setdefault(body, []).append(_Hole.of(work.mesh.vertex, ring, float(work.mesh.diagonal[body]), reach))
    lids: list[tuple[int, Ints]] = []
    for body, found in sorted(holes.items()):
        if left := [hole for hole in found if not hole.kind]:
            worst = max(left, key=lambda hole: hole.round)
            more = f" (and {len(left) - 1} more)" if len(left) > 1 else ""
            work.fault.setdefault(
                body, f"is open: a hole {worst.round:.3g} m round near {place_text(worst.middle)}{more}"
            )
            continue
        lids += [(body, hole.ring[::-1]) for hole in found]
        for kind in ("tiny", "flat"):
            if alike := [hole for hole in found if hole.kind == kind]:
                work.done[body].append(Done(kind, len(alike), _Hole.size(alike)))
    return _with_faces(work, lids)


@dataclass(frozen=True, slots=True, eq=False)
class _Hole:
    """A ring of sides without neighbour."""

    ring: Ints  # (k,) vertices
    kind: str  # "tiny", "flat" or "" = too large and not flat
    round: float  # m
    area: float  # m2
    middle: Floats  # (3,) m

    @classmethod
    def of(cls, vertex: Floats, ring: Ints, diagonal: float, reach: Reach) -> "_Hole":
        point = vertex[ring]
        middle = point.mean(axis=0)
        length = float(np.linalg.norm(point - np.roll(point, -1, axis=0), axis=1).sum())
        normal = newell_normals(point - middle, np.array([0, len(point)]))[0]
        area = float(np.linalg.norm(normal)) / 2.0
        off = float(np.abs((point - middle) @ unit(normal)).max())
        kind = "tiny" if length <= reach.hole * diagonal else ""
        if not kind and len(ring) > 2 and reach.lids and off <= FLAT * diagonal and triangulated(point) is not None:
            kind = "flat"
        return cls(ring, kind if len(ring) > 2 else "", length, area, middle)

    @staticmethod
    def size(holes: "Sequence[_Hole]") -> str:
        upto = "up to " * (len(holes) > 1)
        if holes[0].kind == "tiny":
            return f"{upto}{max(hole.round for hole in holes):.3g} m round"
        return f"{upto}{max(hole.area for hole in holes):.3g} m2"


def _with_faces(work: Work, lids: Sequence[tuple[int, Ints]]) -> Work:
    """With more faces, each the last of its body."""
    if not lids:
        return work
    mesh = work.mesh
    body, size = np.array([b for b, _ in lids]), np.array([len(ring) for _, ring in lids])
    place = mesh.face_start[body + 1]
    corner = np.insert(mesh.corner, np.repeat(mesh.corner_start[place], size), np.concatenate([r for _, r in lids]))
    start = offsets(np.insert(np.diff(mesh.corner_start), place, size))
    count = np.diff(mesh.face_start) + np.bincount(body, minlength=len(mesh))
    grown = replace(mesh, corner=corner, corner_start=start, face_start=offsets(count))
    return replace(
        work, mesh=grown, origin=np.insert(work.origin, place, -1), turned=np.insert(work.turned, place, False)
    )


def _outward(work: Work) -> Work:
    """Turn shells outward, but for those round a hollow, which run the other way; drop what lies inside stone."""
    volume = mass_properties(work.mesh).volume
    work = _turned(work, (volume < 0.0)[work.mesh.face_body])
    shell = nested(work.mesh)
    hollow = (shell.volume < 0.0) & (shell.depth % 2 == 1)
    wrong = (shell.volume < 0.0) & ~hollow
    inner = (shell.volume > 0.0) & (shell.depth % 2 == 1)
    work = _turned(work, wrong[shell.label])
    count = np.bincount(shell.label)
    lids = np.bincount(shell.label, work.origin < 0)
    over = np.bincount(shell.label, work.turned & (work.origin >= 0))
    out = (over + lids >= count) & (over > 0)
    n = len(work.mesh)
    work.told("turn", np.bincount(shell.body, np.where(out, 0, over)).astype(np.int64))
    work.told("out", np.bincount(shell.body, out, n).astype(np.int64))
    lost = np.bincount(shell.body, inner * shell.volume, n)
    whole = mass_properties(work.mesh).volume - lost
    size = {b: f"of {lost[b] / max(whole[b], 1e-300):.2%} of its volume" for b in np.flatnonzero(lost).tolist()}
    return work.told("inner", np.bincount(shell.body, inner, n).astype(np.int64), size).kept(~inner[shell.label])


def place_text(point: Floats) -> str:
    """A place (3,), in m."""
    return f"({', '.join(f'{x:.4g}' for x in point.tolist())})"
