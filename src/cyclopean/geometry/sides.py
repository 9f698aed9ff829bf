"""The sides of faces: which lie on one edge, which faces hang together by them, and the rings of those that are alone.

Stones that touch share vertices and edges once they are welded, so pieces hang together by the faces that bound the
same solid round an edge, never by a mere common vertex.

>>> from cyclopean.geometry.polyhedra import pack
>>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
>>> mesh = pack([(corner, [(0, 2, 1), (0, 1, 3), (0, 3, 2)])])
>>> sides = Sides.of(mesh.corner, mesh.corner_start)
>>> [ring.tolist() for ring in rings(sides.rim)], pieces(mesh).tolist()
([[2, 1, 3]], [0, 0, 0])
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Ints
from cyclopean.geometry.frames import unit
from cyclopean.geometry.packed import components, following, offsets, ragged
from cyclopean.geometry.polyhedra import Polyhedra, face_normals

__all__ = ["Sides", "open_bodies", "parted", "pieces", "rings"]

# Half-planes closer than this round an edge (rad) are one: single precision leaves 1e-4 on the smallest facets,
# and no stone has so sharp an arris.
SAME_ANGLE = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Sides:
    """The sides of faces (K of them), and the undirected edges they lie on."""

    tail: Ints  # (K,)
    head: Ints  # (K,)
    face: Ints  # (K,)
    edge: Ints  # (K,) number of the undirected edge
    count: Ints  # (E,) sides on each edge

    @classmethod
    def of(cls, corner: Ints, start: Ints) -> "Sides":
        """Sides of faces packed at offsets `start` (F + 1,)."""
        head = corner[following(start)]
        key = np.minimum(corner, head) * (int(corner.max(initial=0)) + 1) + np.maximum(corner, head)
        _, edge, count = np.unique(key, return_inverse=True, return_counts=True)
        return cls(corner, head, np.repeat(np.arange(len(start) - 1), np.diff(start)), edge.reshape(-1), count)

    @property
    def forward(self) -> Bools:
        """(K,) whether a side runs from the lower vertex to the higher."""
        return self.tail < self.head

    @property
    def lone(self) -> Ints:
        """Sides without a neighbour."""
        return np.flatnonzero(self.count[self.edge] == 1)

    @property
    def rim(self) -> Ints:
        """(k, 2) tail and head of these."""
        return np.stack([self.tail[self.lone], self.head[self.lone]], 1)

    def pairs(self) -> tuple[Ints, Ints]:
        """The two sides of each edge that has two."""
        here = np.flatnonzero(self.count[self.edge] == 2)
        both = here[np.argsort(self.edge[here], kind="stable")].reshape(-1, 2)
        return both[:, 0], both[:, 1]


def open_bodies(mesh: Polyhedra) -> Bools:
    """(n,) whether a body has an edge without exactly one face on either side."""
    sides = Sides.of(mesh.corner, mesh.corner_start)
    balance = np.bincount(sides.edge, np.where(sides.forward, 1, -1))
    bad = (sides.count != 2) | (balance != 0)
    return np.asarray(np.bincount(mesh.face_body[sides.face[bad[sides.edge]]], minlength=len(mesh)) > 0)


def rings(rim: Ints) -> Iterator[Ints]:
    """Rings of directed edges (k, 2); where rings meet in a vertex, one ends where it first comes back to itself."""
    onward: dict[int, list[int]] = {}
    for tail, head in rim.tolist():
        onward.setdefault(tail, []).append(head)
    while onward:
        path = [next(iter(onward))]
        place = {path[0]: 0}  # of each vertex in the path
        while True:
            here = path[-1]
            heads = onward.get(here)
            if heads is None:  # a rim that ends nowhere: the mesh is not oriented; take what there is as one hole
                yield np.array(path)
                break
            there = heads.pop()
            if not heads:
                del onward[here]
            start = place.get(there)
            if start is None:
                place[there] = len(path)
                path.append(there)
                continue
            yield np.array(path[start:])
            for vertex in path[start + 1 :]:
                del place[vertex]
            path = path[: start + 1]
            if start == 0:
                break


def parted(mesh: Polyhedra, label: Ints) -> Polyhedra:
    """One body for each class of faces, labelled (F,) from 0, with the vertices that it uses, all in their order."""
    order = np.argsort(label, kind="stable")
    which, position = ragged(mesh.corner_start, order)
    many = len(mesh.vertex)
    key = label[order][which] * many + mesh.corner[position]
    used, corner = np.unique(key, return_inverse=True)
    count = int(label.max(initial=-1)) + 1
    return Polyhedra(
        mesh.vertex[used % max(many, 1)],
        offsets(np.bincount(used // max(many, 1), minlength=count)),
        corner.reshape(-1),
        offsets(np.diff(mesh.corner_start)[order]),
        offsets(np.bincount(label, minlength=count)),
    )


def pieces(mesh: Polyhedra, wedges: bool = True) -> Ints:
    """(F,) number of the connected piece of each face, counted in order of appearance.

    Two faces hang together when they are the only two at an edge, or, with `wedges`, when of the many faces round an
    edge that stones share they bound the same wedge of stone.
    """
    sides = Sides.of(mesh.corner, mesh.corner_start)
    first, second = sides.pairs()
    one, other = _same_wedge(mesh, sides) if wedges else (first[:0], second[:0])
    a = sides.face[np.concatenate([first, one])]
    b = sides.face[np.concatenate([second, other])]
    return components(len(mesh.corner_start) - 1, a, b)


def _same_wedge(mesh: Polyhedra, sides: Sides) -> tuple[Ints, Ints]:
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
    axis = unit(mesh.vertex[high] - mesh.vertex[low])
    normal = unit(face_normals(mesh))[sides.face[many]]
    forward = sides.forward[many]
    into = np.cross(normal, np.where(forward[:, None], axis, -axis))  # in the face, away from the edge
    zero = into[lead]
    angle = np.arctan2(np.einsum("ki,ki->k", into, np.cross(axis, zero)), np.einsum("ki,ki->k", into, zero)) % (
        2 * np.pi
    )
    angle[angle > 2 * np.pi - SAME_ANGLE] -= 2 * np.pi
    order = np.lexsort((angle, group))
    step = np.concatenate([[True], (np.diff(angle[order]) > SAME_ANGLE) | (np.diff(group[order]) > 0)])
    order = order[np.lexsort((~forward[order], np.cumsum(step)))]
    sizes = np.bincount(group)
    after = following(offsets(sizes))
    opens = ~forward[order] & forward[order[after]]
    return many[order[opens]], many[order[after[opens]]]
