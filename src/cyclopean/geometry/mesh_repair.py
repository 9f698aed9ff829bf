"""Triangle meshes as they come from a scanner made closed and outward, or told why they cannot be.

What is repaired leaves the stone as it is: equal vertices are welded, faces without area or that stand twice dropped,
faces oriented alike and outward, holes closed that are tiny. What would have to be guessed is not: a large hole, a
surface that crosses itself, an edge with three faces.

A tetrahedron without one of its faces is open, and the hole is far too large to be closed:

>>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
>>> repair(corner, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2]])).pieces[0].fault
'is open: a hole 4.24 m round'
>>> repair(corner, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 3, 2]])).pieces[0].done
('1 face was turned over',)
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.geometry.boxes import box_pairs
from cyclopean.geometry.crossing import crossing
from cyclopean.geometry.frames import solid_angles
from cyclopean.geometry.packed import components
from cyclopean.geometry.polygon import triangulated
from cyclopean.geometry.polyhedra import mass_properties, pack

__all__ = ["Piece", "Repair", "clean", "connected", "mend", "repair", "solid_angle", "weld"]

# A hole of a quarter of the diagonal round is 0.08 of it across: half a percent of the surface of a round stone.
TINY_HOLE = 0.25
# Cracks no wider than this share of the diagonal are the digits that a file format cut off.
CRACK = 1e-6
# A loose piece whose diagonal is below this share of the largest piece's is dust of the scan: 1/8000 of its volume.
DUST = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """One connected piece of a mesh."""

    vertices: Floats  # (v, 3) m
    triangles: Ints  # (t, 3); counter-clockwise from outside where there is no fault
    done: tuple[str, ...] = ()  # what was repaired
    fault: str = ""  # why it is no solid; "" = closed, outward, of one piece, and does not cross itself


@dataclass(frozen=True, slots=True, eq=False)
class Repair:
    """All pieces of a mesh, in the order of their first faces."""

    pieces: tuple[Piece, ...]
    done: tuple[str, ...]  # what was repaired of the mesh as a whole


def repair(vertices: Floats, triangles: Ints, split: Callable[[Floats, Ints], Ints] | None = None) -> Repair:
    """Clean a mesh, split it into its pieces, and mend each.

    Parameters
    ----------
    vertices : (v, 3) float
        m.
    triangles : (t, 3) int
        Index `vertices`.
    split : callable, optional
        Gives the number of the piece of each triangle, in order of appearance; default `connected`. Only asked where
        edges have more than two faces, as where stones touch that a file put into one mesh; its pieces are not turned.

    Returns
    -------
    Repair
        Pieces with a fault are left as they came. Shells inside another piece, and dust, are dropped.
    """
    vertices, triangles, done = clean(vertices, triangles)
    if not len(triangles):
        return Repair((), (*done, "no face has an area"))
    vertices, triangles, cracks = _uncracked(vertices, triangles)
    shared = bool((_Edges.of(triangles).count > 2).any())
    label = (split if shared and split is not None else connected)(vertices, triangles)
    parts = [_compact(vertices, triangles[label == k]) for k in range(int(label.max()) + 1)]
    parts, dust = _without_dust(parts)
    pieces = [mend(*part, turn=not shared) for part in parts]
    pieces, inner = _without_inner(pieces)
    return Repair(tuple(_apart(pieces)), (*done, *cracks, *dust, *inner))


def clean(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Weld equal vertices; drop faces without corners of their own, or that stand twice, and vertices without faces.

    Returns
    -------
    vertices : (v, 3) float
    triangles : (t, 3) int
    done : tuple of str
    """
    done: list[str] = []
    before = len(np.unique(triangles))
    triangles = weld(vertices, triangles)
    if merged := before - len(np.unique(triangles)):
        done.append(f"{_many(merged, 'vertex was', 'vertices were')} welded")
    flat = _folded(triangles)
    if flat.any():
        triangles = triangles[~flat]
        done.append(f"{_many(int(flat.sum()), 'face', 'faces')} without area dropped")
    single = _single(triangles)
    if len(single) < len(triangles):
        done.append(f"{_many(len(triangles) - len(single), 'face', 'faces')} that stood twice dropped")
        triangles = triangles[single]
    return (*_compact(vertices, triangles), tuple(done))


def weld(vertices: Floats, triangles: Ints) -> Ints:
    """Triangles (t, 3) that name, of vertices in one place, the first only."""
    order = np.lexsort(vertices.T)  # stable: the lowest index of equals comes first
    fresh = np.concatenate([[True], (np.diff(vertices[order], axis=0) != 0.0).any(axis=1)])[: len(order)]
    if fresh.all():
        return triangles
    target = np.zeros(len(vertices), np.int64)
    target[order] = order[np.flatnonzero(fresh)][np.cumsum(fresh) - 1]
    return target[triangles]


def connected(vertices: Floats, triangles: Ints) -> Ints:
    """(t,) number of the piece of each triangle, in order of appearance; pieces hang together by edges."""
    edges = _Edges.of(triangles)
    order = np.argsort(edges.number, kind="stable")
    same = edges.number[order[1:]] == edges.number[order[:-1]]
    return components(len(triangles), edges.face[order[1:][same]], edges.face[order[:-1][same]])


def mend(vertices: Floats, triangles: Ints, turn: bool = True) -> Piece:
    """Orient one connected piece (vertices in m), close its tiny holes, and say whether it is a solid then.

    `turn` False leaves faces that run the wrong way as they are: where pieces were told apart by which side is out,
    that side cannot be changed afterwards.
    """
    came = vertices, triangles
    done: list[str] = []
    for step in (_turned_alike, _closed) if turn else (_closed,):
        vertices, triangles, said, fault = step(vertices, triangles)
        done += said
        if fault:
            return Piece(*came, tuple(done), fault)
    if fault := _edge_fault(triangles):
        return Piece(*came, tuple(done), fault)
    mass = mass_properties(pack([(vertices, triangles)]))
    volume, centre = float(mass.volume[0]), mass.centroid[0]
    if volume < 0.0 and turn:
        triangles = triangles[:, ::-1]
        done = [*[d for d in done if "turned over" not in d], "was inside out and was turned"]
    elif not volume > 0.0:
        return Piece(*came, tuple(done), "has no volume" if volume == 0.0 else "is inside out")
    if not _star_shaped(vertices, triangles, centre):
        where = crossing(vertices, triangles)
        if where is not None:
            return Piece(*came, tuple(done), f"crosses itself near {_place(where)}")
    return Piece(vertices, np.ascontiguousarray(triangles), tuple(done))


@dataclass(frozen=True, slots=True, eq=False)
class _Edges:
    """The sides of triangles (3 t of them), and the undirected edges they lie on."""

    tail: Ints  # (3t,)
    head: Ints  # (3t,)
    face: Ints  # (3t,)
    number: Ints  # (3t,) which edge
    count: Ints  # (e,) sides on each edge

    @classmethod
    def of(cls, triangles: Ints) -> "_Edges":
        tail, head = triangles.reshape(-1), triangles[:, [1, 2, 0]].reshape(-1)
        key = np.minimum(tail, head) * (int(triangles.max(initial=0)) + 1) + np.maximum(tail, head)
        _, number, count = np.unique(key, return_inverse=True, return_counts=True)
        return cls(tail, head, np.repeat(np.arange(len(triangles)), 3), number.reshape(-1), count)

    def pairs(self) -> tuple[Ints, Ints]:
        """The two sides of each edge that has two."""
        here = np.flatnonzero(self.count[self.number] == 2)
        both = here[np.argsort(self.number[here], kind="stable")].reshape(-1, 2)
        return both[:, 0], both[:, 1]


def _compact(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Only the vertices that are used, in the order they had."""
    used = np.zeros(len(vertices), bool)
    used[triangles.reshape(-1)] = True
    if used.all():
        return vertices, triangles
    return vertices[used], (np.cumsum(used) - 1)[triangles]


def _folded(triangles: Ints) -> Bools:
    a, b, c = triangles.T
    return np.asarray((a == b) | (b == c) | (c == a))


def _single(triangles: Ints) -> Ints:
    """Faces that are left when none stands twice.

    Of two faces with the same corners one stays, or none where the mesh closes better so: a fin that sticks out of a
    surface has two.
    """
    corner = np.sort(triangles, axis=1)
    order = np.lexsort((np.arange(len(corner)), *corner.T[::-1]))
    fresh = np.concatenate([[True], (np.diff(corner[order], axis=0) != 0).any(axis=1)])[: len(order)]
    if fresh.all():
        return np.arange(len(triangles))
    first = order[np.flatnonzero(fresh)]
    odd = np.diff(np.append(np.flatnonzero(fresh), len(order))) % 2 == 1
    one, none = np.sort(first), np.sort(first[odd])
    gaps = [int((_Edges.of(triangles[keep]).count % 2).sum()) for keep in (one, none)]
    return none if gaps[1] < gaps[0] else one


def _without_dust(parts: list[tuple[Floats, Ints]]) -> tuple[list[tuple[Floats, Ints]], list[str]]:
    size = np.array([_diagonal(vertices) for vertices, _ in parts])
    kept = size >= DUST * size.max()
    said = [] if kept.all() else [f"{_many(int((~kept).sum()), 'loose piece', 'loose pieces')} of dust dropped"]
    return [part for part, keep in zip(parts, kept, strict=True) if keep], said


def _diagonal(vertices: Floats) -> float:
    return float(np.linalg.norm(np.ptp(vertices, axis=0)))


def _turned_alike(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints, list[str], str]:
    """Let neighbours agree about which side is out, as most of them by area do already.

    Each triangle stands twice in a graph, as it is and turned over; neighbours that run along their edge the same way
    are joined crosswise. A surface with one side only joins a triangle to itself turned over.
    """
    edges = _Edges.of(triangles)
    one, two = edges.pairs()
    cross = edges.tail[one] == edges.tail[two]
    if not cross.any():
        return vertices, triangles, [], ""
    n = len(triangles)
    a, b = edges.face[one], edges.face[two]
    label = components(2 * n, np.concatenate([a, a + n]), np.concatenate([b + n * cross, b + n * ~cross]))
    if (label[:n] == label[n:]).any():
        return vertices, triangles, [], "has one side only: its faces cannot be oriented alike"
    turned = np.zeros(n, bool)
    for patch in np.unique(np.minimum(label[:n], label[n:])):  # one, but where edges have many faces
        here, over = label[:n] == patch, label[n:] == patch
        turned |= over if over.sum() < here.sum() else here
    triangles = triangles.copy()
    triangles[turned] = triangles[turned, ::-1]
    return vertices, triangles, [f"{_many(int(turned.sum()), 'face was', 'faces were')} turned over"], ""


def _closed(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints, list[str], str]:
    """Close tiny holes; a larger one is a fault."""
    rim = _rim(triangles)
    if not len(rim):
        return vertices, triangles, [], ""
    loops = list(rim_loops(rim))
    round_ = [float(np.linalg.norm(vertices[loop] - vertices[np.roll(loop, -1)], axis=1).sum()) for loop in loops]
    if not max(round_) <= TINY_HOLE * _diagonal(vertices):
        more = f" (and {len(loops) - 1} more)" if len(loops) > 1 else ""
        return vertices, triangles, [], f"is open: a hole {max(round_):.3g} m round{more}"
    lids = []
    for loop in loops:
        vertices, lid = _lid(vertices, loop[::-1])
        lids.append(lid)
    closed = np.concatenate([triangles, *lids])
    return vertices, closed, [f"{_many(len(loops), 'tiny hole', 'tiny holes')} closed, {_most(round_)} m round"], ""


def _most(lengths: list[float]) -> str:
    return f"{max(lengths):.3g}" if len(lengths) == 1 else f"up to {max(lengths):.3g}"


def _uncracked(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints, list[str]]:
    """Weld vertices of the rim that only the digits of the file keep apart."""
    rim = _rim(triangles)
    if not len(rim):
        return vertices, triangles, []
    joined = _across_cracks(vertices, triangles, np.unique(rim), CRACK * _diagonal(vertices))
    joined = joined[~_folded(joined)]
    if not len(_rim(joined)) < len(rim):
        return vertices, triangles, []
    return (*_compact(vertices, joined), ["hairline cracks were welded"])


def _rim(triangles: Ints) -> Ints:
    """(k, 2) tail and head of sides that have no neighbour."""
    edges = _Edges.of(triangles)
    lone = edges.count[edges.number] == 1
    return np.stack([edges.tail[lone], edges.head[lone]], 1)


def _across_cracks(vertices: Floats, triangles: Ints, rim: Ints, width: float) -> Ints:
    """Triangles in which vertices of the rim that are no farther apart than `width` are one."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(vertices[rim]).query_pairs(width, output_type="ndarray")
    if not len(pairs):
        return triangles
    target = np.arange(len(vertices))
    for a, b in np.sort(rim[pairs], axis=1)[::-1].tolist():
        target[target == target[b]] = target[a]
    return np.asarray(target[triangles])


def rim_loops(rim: Ints) -> Iterator[Ints]:
    """Rings of directed edges (k, 2); where rings meet in a vertex, one ends where it first comes back to itself."""
    following: dict[int, list[int]] = {}
    for tail, head in rim.tolist():
        following.setdefault(tail, []).append(head)
    while following:
        path = [next(iter(following))]
        while True:
            here = path[-1]
            heads = following.get(here)
            if heads is None:  # a rim that ends nowhere: the mesh is not oriented; take what there is as one hole
                yield np.array(path)
                break
            there = heads.pop()
            if not heads:
                del following[here]
            if there in path:
                start = path.index(there)
                yield np.array(path[start:])
                path = path[: start + 1]
                if start == 0:
                    break
            else:
                path.append(there)


def _lid(vertices: Floats, loop: Ints) -> tuple[Floats, Ints]:
    """Fill a loop flat by its ears, or from its middle where it has none."""
    point = vertices[loop]
    triangles = triangulated(point)
    if triangles is not None:
        return vertices, loop[triangles]
    new = len(vertices)
    fan = np.stack([loop, np.roll(loop, -1), np.full(len(loop), new)], 1)
    return np.concatenate([vertices, point.mean(axis=0)[None]]), fan


def _edge_fault(triangles: Ints) -> str:
    edges = _Edges.of(triangles)
    if many := int((edges.count > 2).sum()):
        return f"has {_many(many, 'edge', 'edges')} with more than two faces"
    one, two = edges.pairs()
    if len(one) < len(edges.count):
        return "is open"
    if (edges.tail[one] == edges.tail[two]).any():
        return "has faces that disagree about which side is out"
    return ""


def _star_shaped(vertices: Floats, triangles: Ints, centre: Floats) -> bool:
    """Whether every face is seen from inside at the centre, once.

    If no face is seen from behind or edge-on, the sphere of directions is covered as often as the solid angle says;
    once means that no two faces are in one direction, so they cannot cross. Most stones are so, and need no more.
    """
    p = vertices[triangles] - centre
    six = np.einsum("ti,ti->t", p[:, 0], np.cross(p[:, 1], p[:, 2]))
    scale = float(np.abs(p).max()) ** 3
    return bool((six > 1e-12 * scale).all()) and abs(solid_angle(vertices, triangles, centre) - 1.0) < 1e-6


def solid_angle(vertices: Floats, triangles: Ints, centre: Floats) -> float:
    """How often a closed mesh (v, 3), (t, 3) winds round a point (3,): 1 inside, 0 outside."""
    return float(solid_angles(vertices[triangles] - centre).sum())


def _without_inner(pieces: list[Piece]) -> tuple[list[Piece], list[str]]:
    """Drop shells inside another piece: a scan sees no cavity."""
    if len(pieces) < 2:
        return pieces, []
    low = np.array([p.vertices.min(axis=0) for p in pieces])
    high = np.array([p.vertices.max(axis=0) for p in pieces])
    within = (low[:, None] >= low).all(axis=2) & (high[:, None] <= high).all(axis=2)
    pairs = [(a, b) for a, b in np.argwhere(within).tolist() if a != b and not pieces[b].fault]
    inner = {a for a, b in pairs if _is_inside(pieces[a], pieces[b])}
    said = [f"{_many(len(inner), 'shell', 'shells')} inside the surface dropped"] if inner else []
    return [piece for k, piece in enumerate(pieces) if k not in inner], said


def _is_inside(a: Piece, b: Piece) -> bool:
    """Whether a lies inside b, neither crossing nor being crossed; they may touch."""
    some = a.triangles[:: max(1, len(a.triangles) // 8)]  # one may touch, and then says nothing
    seen = (solid_angle(b.vertices, b.triangles, point) for point in a.vertices[some].mean(axis=1))
    return any(winding > 0.9 for winding in seen) and crossing(*_together(a, b)) is None


def _apart(pieces: list[Piece]) -> list[Piece]:
    """Refuse sound pieces that cross each other: they are one surface that was folded, not two stones."""
    if len(pieces) < 2:
        return pieces
    low = np.array([p.vertices.min(axis=0) for p in pieces])
    high = np.array([p.vertices.max(axis=0) for p in pieces])
    fault = [piece.fault for piece in pieces]
    for a, b in zip(*(side.tolist() for side in box_pairs(low, high, 0.0)), strict=True):
        if not pieces[a].fault and not pieces[b].fault:
            where = crossing(*_together(pieces[a], pieces[b]))
            if where is not None:
                fault[a] = fault[b] = f"crosses another piece near {_place(where)}"
    return [Piece(p.vertices, p.triangles, p.done, said) for p, said in zip(pieces, fault, strict=True)]


def _together(a: Piece, b: Piece) -> tuple[Floats, Ints]:
    return np.concatenate([a.vertices, b.vertices]), np.concatenate([a.triangles, b.triangles + len(a.vertices)])


def _many(count: int, one: str, more: str) -> str:
    return f"{count} {one if count == 1 else more}"


def _place(point: Floats) -> str:
    return f"({', '.join(f'{x:.4g}' for x in point.tolist())})"
