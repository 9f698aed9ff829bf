"""From the meshes of a file to blocks: welding, connected pieces, unique names.

A mesh file knows nothing of stones. A body that is closed as it stands is left alone; one that is not (every STL, a
GLB split along its normals) has its equal vertices welded. Where the file does not say which faces make a block, the
connected pieces do. Stones that touch share vertices and edges once they are welded, so pieces hang together by the
faces that bound the same solid round an edge, never by a mere common vertex.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.geometry import face_normals, following, newell_normals, offsets, pack, triangles
from cyclopean.geometry.frames import unit
from cyclopean.geometry.packed import components
from cyclopean.geometry.polygon import triangulated
from cyclopean.io.fields import REACH, face_fault, label
from cyclopean.io.units import metres

__all__ = ["Body", "assembly_of", "face_triangles", "part_of", "pieces", "placed", "welded"]

# Half-planes closer than this round an edge (rad) are one: single precision leaves 1e-4 on the smallest facets,
# and no stone has so sharp an arris.
_SAME_ANGLE = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Part of a mesh file; `name` None where the file gives none, `whole` where the file says that it is one block."""

    name: str | None
    vertices: Floats  # (v, 3) in the units of the file
    faces: list[tuple[int, ...]]
    whole: bool = True
    fields: Mapping[str, Any] = field(default_factory=dict)  # density, fixed, group of the blocks made of it


def assembly_of(path: str, stem: str, bodies: Sequence[Body], units: str) -> tuple[Assembly, list[str]]:
    """Make one block of each body, or of each connected piece where bodies are not `whole`.

    A file that holds one single body is split into its pieces in any case: that is how modellers export a wall.

    Returns
    -------
    assembly : Assembly
        In metres, without contacts; with the densities, supports and groups that the bodies have.
    warnings : list of str
        How many blocks were made and of what, faces dropped, names changed.

    Raises
    ------
    InputError
        There are no faces, a coordinate is not finite or a face is not one.
    """
    bodies = [body for body in bodies if body.faces]
    if not bodies:
        raise InputError(f"{path}: has no faces; a model needs at least one closed mesh")
    for body in bodies:
        _check(f"{path}: {label(body.name)}" if body.name else path, body)
    soup = _Soup.of(bodies)
    welded = _welded(soup, _opened(soup))
    dropped = len(soup.faces) - len(welded.faces)
    warnings = [f"{path}: {dropped} faces without area were dropped"] if dropped else []
    if not welded.faces:
        raise InputError(f"{path}: has no faces with an area; a model needs at least one closed mesh")
    made, split = _split(path, bodies, welded, warnings)
    how = "connected piece" if split else "named mesh" if any(part.name for part in made) else "mesh"
    count = f"{len(made)} blocks, one for each" if len(made) > 1 else "1 block, from the one"
    warnings.insert(0, f"{path}: made {count} {how}")
    ids = _unique([part.name for part in made], path, warnings)
    blocks = tuple(
        Block(name, metres(part.vertices, units), tuple(part.faces), **part.fields)
        for name, part in zip(ids, made, strict=True)
    )
    return Assembly(blocks, name=stem), warnings


def welded(where: str, body: Body) -> Body:
    """Return the body as it is if it is closed, else with its equal vertices welded.

    Raises
    ------
    InputError
        A coordinate is not finite or a face is not one.
    """
    _check(where, body)
    soup = _Soup.of([body])
    opened = _opened(soup)
    if not opened.any():
        return body
    return part_of(body.name, body.vertices, _welded(soup, opened).faces, fields=body.fields)


def _check(where: str, body: Body) -> None:
    bad = np.argwhere(~(np.abs(body.vertices) <= REACH))
    if len(bad):
        value = body.vertices[tuple(bad[0])]
        what = f"is {value:g}, beyond 1e12; check the units" if np.isfinite(value) else "is not a finite number"
        raise InputError(f"{where}: vertex {bad[0][0]}, coordinate {bad[0][1]} {what}")
    for k, face in enumerate(body.faces):
        if fault := face_fault(face, len(body.vertices)):
            raise InputError(f"{where}: face {k} {fault}")


@dataclass(frozen=True, slots=True, eq=False)
class _Soup:
    """The bodies of a file end to end, so that ten thousand of them cost a few array operations."""

    vertices: Floats  # (V, 3)
    owner: Ints  # (V,) body of each vertex
    faces: list[tuple[int, ...]]  # index vertices as a whole
    body: Ints  # (F,) body of each face

    @classmethod
    def of(cls, bodies: Sequence[Body]) -> "_Soup":
        counts = [len(body.vertices) for body in bodies]
        offset = np.cumsum([0, *counts]).tolist()
        faces = [
            tuple([i + shift for i in face]) for body, shift in zip(bodies, offset, strict=False) for face in body.faces
        ]
        number = np.arange(len(bodies))
        vertices = np.concatenate([body.vertices for body in bodies])
        return cls(vertices, np.repeat(number, counts), faces, np.repeat(number, [len(b.faces) for b in bodies]))


@dataclass(frozen=True, slots=True, eq=False)
class _HalfEdges:
    """The sides of faces, packed (K of them), and the undirected edges they lie on."""

    tail: Ints  # (K,)
    head: Ints  # (K,)
    face: Ints  # (K,)
    start: Ints  # (F + 1,)
    edge: Ints  # (K,) number of the undirected edge
    count: Ints  # (E,) half-edges on each edge

    @classmethod
    def of(cls, faces: Sequence[Sequence[int]]) -> "_HalfEdges":
        sizes = np.fromiter(map(len, faces), np.int64, len(faces))
        start = offsets(sizes)
        tail = np.fromiter(chain.from_iterable(faces), np.int64, int(start[-1]))
        head = tail[following(start)]
        low, high = np.minimum(tail, head), np.maximum(tail, head)
        _, edge, count = np.unique(low * (tail.max(initial=0) + 1) + high, return_inverse=True, return_counts=True)
        return cls(tail, head, np.repeat(np.arange(len(faces)), sizes), start, edge.reshape(-1), count)

    @property
    def forward(self) -> Bools:
        return self.tail < self.head


def _opened(soup: _Soup) -> Bools:
    """(V,) whether the body of each vertex has an edge without exactly one face on either side."""
    sides = _HalfEdges.of(soup.faces)
    balance = np.bincount(sides.edge, np.where(sides.forward, 1, -1))
    bad = (sides.count != 2) | (balance != 0)
    opened = np.bincount(soup.body[sides.face[bad[sides.edge]]], minlength=soup.owner[-1] + 1) > 0
    return np.asarray(opened[soup.owner])


def _welded(soup: _Soup, chosen: Bools) -> _Soup:
    """Weld the equal vertices of each body among the chosen; faces left with fewer than three corners go.

    A face that would fold onto itself keeps its corners: the mesh is then faulty either way, and a check says why.
    """
    here = np.flatnonzero(chosen)
    if not len(here):
        return soup
    x, y, z = soup.vertices[here].T
    keys = np.stack([soup.owner[here].astype(float), x, y, z])
    order = np.lexsort((here, *keys[::-1]))
    fresh = np.concatenate([[True], (np.diff(keys[:, order], axis=1) != 0).any(0)])
    lowest = here[order][np.flatnonzero(fresh)]
    target = np.arange(len(soup.vertices))
    target[here[order]] = lowest[np.cumsum(fresh) - 1]
    new = target.tolist()
    faces: list[tuple[int, ...]] = []
    kept: list[int] = []
    for k, face in enumerate(soup.faces):
        corners = [new[i] for i in face]
        if len(set(corners)) < len(corners):
            corners = [i for m, i in enumerate(corners) if i != corners[m - 1]]
            if len(corners) < 3:
                continue
            if len(set(corners)) < len(corners):
                corners = list(face)
        faces.append(tuple(corners))
        kept.append(k)
    return replace(soup, faces=faces, body=soup.body[kept])


def _split(path: str, bodies: Sequence[Body], soup: _Soup, warnings: list[str]) -> tuple[list[Body], bool]:
    """Make a body of each body that stays whole and of each piece of the others."""
    labels = pieces(soup.vertices, soup.faces)
    parts: dict[int, dict[int, list[tuple[int, ...]]]] = {}
    for k, piece, face in zip(soup.body.tolist(), labels.tolist(), soup.faces, strict=True):
        parts.setdefault(k, {}).setdefault(piece, []).append(face)
    made: list[Body] = []
    split, loose = False, []
    for k, by_piece in parts.items():
        body = bodies[k]
        if len(by_piece) > 1 and (len(bodies) == 1 or not body.whole):
            names = [None if body.name is None else f"{body.name}-{m}" for m in range(len(by_piece))]
            made.extend(
                part_of(name, soup.vertices, faces, fields=body.fields)
                for name, faces in zip(names, by_piece.values(), strict=True)
            )
            split = True
            continue
        loose += [body.name] if len(by_piece) > 1 else []
        made.append(part_of(body.name, soup.vertices, list(chain.from_iterable(by_piece.values())), fields=body.fields))
    if loose:
        more = f" (and {len(loose) - 1} more)" if len(loose) > 1 else ""
        warnings.append(f"{path}: block {label(loose[0] or 'unnamed')} has separate pieces that move as one{more}")
    return made, split


def part_of(name: str | None, vertices: Floats, faces: list[tuple[int, ...]], **more: Any) -> Body:
    """Return the faces as a body, with only those of the vertices (v, 3) that they use, in the order they had."""
    used = sorted(set(chain.from_iterable(faces)))
    new = dict(zip(used, range(len(used)), strict=True))
    return Body(name, vertices[used], [tuple([new[i] for i in face]) for face in faces], **more)


def placed(
    matrix: Floats, vertices: Floats, faces: Sequence[tuple[int, ...]]
) -> tuple[Floats, tuple[tuple[int, ...], ...]]:
    """Vertices (v, 3) and faces where a (4, 4) matrix puts them; what it mirrors is turned outside again."""
    mirrored = np.linalg.det(matrix[:3, :3]) < 0.0
    return vertices @ matrix[:3, :3].T + matrix[:3, 3], tuple(face[::-1] if mirrored else face for face in faces)


def face_triangles(vertices: Floats, faces: Sequence[Sequence[int]]) -> Ints:
    """Triangles (t, 3) of polygons on vertices (v, 3): fans, or ears where a polygon is not convex."""
    if all(len(face) == 3 for face in faces):
        return np.array(faces, np.int64).reshape(-1, 3)
    mesh = pack([(vertices, faces)])
    found, owner = triangles(mesh)
    corner = vertices[found]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    hollow = np.unique(owner[np.einsum("ti,ti->t", across, face_normals(mesh)[owner]) < 0.0])
    kept = found[~np.isin(owner, hollow)]
    cut = []
    for k in hollow.tolist():
        face = np.array(faces[k])
        ears = triangulated(vertices[face])
        cut.append(found[owner == k] if ears is None else face[ears])
    return np.concatenate([kept, *cut])


def pieces(vertices: Floats, faces: Sequence[Sequence[int]]) -> Ints:
    """(F,) number of the connected piece of each face, counted in order of appearance.

    Two faces hang together when they are the only two at an edge, or when, of the many faces round an edge that
    stones share, they bound the same wedge of stone.
    """
    sides = _HalfEdges.of(faces)
    first, second = _only_two(sides)
    one, other = _same_wedge(vertices, sides)
    a = sides.face[np.concatenate([first, one])]
    b = sides.face[np.concatenate([second, other])]
    return components(len(faces), a, b)


def _only_two(sides: _HalfEdges) -> tuple[Ints, Ints]:
    here = np.flatnonzero(sides.count[sides.edge] == 2)
    pairs = here[np.argsort(sides.edge[here], kind="stable")].reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def _same_wedge(vertices: Floats, sides: _HalfEdges) -> tuple[Ints, Ints]:
    """Pair the half-edges of edges with more than two faces by the wedge of stone between them.

    Seen along the edge from its lower to its higher vertex, angles counter-clockwise: a face that runs backwards has
    its stone behind the next larger angle (it opens a wedge), one that runs forwards before it (it closes one). Where
    the faces of two touching stones lie on each other, the one that closes comes first.
    """
    many = np.flatnonzero(sides.count[sides.edge] > 2)
    if not len(many):
        return many, many
    many = many[np.argsort(sides.edge[many], kind="stable")]
    group = np.unique(sides.edge[many], return_inverse=True)[1].reshape(-1)
    lead = np.searchsorted(group, group)  # the first half-edge of the group
    low, high = np.minimum(sides.tail[many], sides.head[many]), np.maximum(sides.tail[many], sides.head[many])
    axis = unit(vertices[high] - vertices[low])
    normal = unit(newell_normals(vertices[sides.tail], sides.start))[sides.face[many]]
    forward = sides.forward[many]
    into = np.cross(normal, np.where(forward[:, None], axis, -axis))  # in the face, away from the edge
    zero = into[lead]
    angle = np.arctan2(np.einsum("ki,ki->k", into, np.cross(axis, zero)), np.einsum("ki,ki->k", into, zero)) % (
        2 * np.pi
    )
    angle[angle > 2 * np.pi - _SAME_ANGLE] -= 2 * np.pi
    order = np.lexsort((angle, group))
    step = np.concatenate([[True], (np.diff(angle[order]) > _SAME_ANGLE) | (np.diff(group[order]) > 0)])
    order = order[np.lexsort((~forward[order], np.cumsum(step)))]
    sizes = np.bincount(group)
    after = following(offsets(sizes))
    opens = ~forward[order] & forward[order[after]]
    return many[order[opens]], many[order[after[opens]]]


def _unique(names: Sequence[str | None], path: str, warnings: list[str]) -> list[str]:
    """Give every block a name of its own: the file's where it can be, b0, b1 ... where there is none."""
    plain = [None if name is None else "".join(c if c.isprintable() else "_" for c in name) or None for name in names]
    wanted = [f"b{k}" if name is None else name for k, name in enumerate(plain)]
    count, taken = Counter(wanted), set(wanted)
    result: list[str] = []
    used: set[str] = set()
    suffix: Counter[str] = Counter()
    for name in wanted:
        fresh = name
        while fresh in used or (fresh != name and fresh in taken):
            suffix[name] += 1
            fresh = f"{name}-{suffix[name] + 1}"
        used.add(fresh)
        result.append(fresh)
    if twice := [name for name in count if count[name] > 1]:
        more = f", and {len(twice) - 1} other names too" if len(twice) > 1 else ""
        warnings.append(f"{path}: the name {label(twice[0])} stands {count[twice[0]]} times{more}; numbers were added")
    return result
