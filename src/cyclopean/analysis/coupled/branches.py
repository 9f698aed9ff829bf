"""The branches of a refuting tree, their images under a symmetry of the model, and the document of a certificate.

A split covers the cell that it splits: a point presses (dn = -1) or carries nothing, for fn (dn + 1) = 0; it slides
into one of several sectors, whose rays go once round or lie inside the sector so far; it slides by at most or at least
a speed.

Where a rotation or reflection maps the model and a cell onto themselves, a tree that closes a part of the cell closes
the image of that part as well, with the image of each vector. A contact may change sides: then dd and f, which both
belong to block b, change sign, and the normal part stays.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cyclopean.analysis.certificates import flushed
from cyclopean.analysis.coupled.leaves import Cell, Leaf
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.statics import EquilibriumSystem

__all__ = ["Node", "Split", "Symmetry", "leaf_count", "moving_alike", "renumbered", "symmetries", "tree_document"]

MATCH = 1e-8  # mean block sizes and weights within which two points or blocks are images of each other


@dataclass(frozen=True, slots=True, eq=False)
class Split:
    """A point either presses or carries nothing; or, with rays, slides between two of them; or slower or faster."""

    point: int
    parts: "tuple[Node, ...]"  # engaged, unloaded | one a sector, in the order of the rays | slower, faster
    rays: Floats | None = None  # (r, 2) in its (u, v); r sectors the first time, then r + 1: rays lie inside the sector
    speed: float | None = None


Node = Leaf | Split


def leaf_count(node: Node) -> int:
    """How many leaves a tree has."""
    return 1 if isinstance(node, Leaf) else sum(map(leaf_count, node.parts))


def moving_alike(system: EquilibriumSystem) -> Ints:
    """(q,) the first point of the same joint that moves as each does in every motion, because blocks are held.

    Two points' gaps differ by w x (r - r'), w the relative spin: not at all where both blocks may turn about no axis,
    and where about one only, if the points differ along it alone.
    """
    first = np.arange(system.points)
    if not system.held.any():
        return first
    turns = np.vstack([~system.held[:, 3:], np.zeros((1, 3), bool)])  # the last for fixed blocks, numbered -1
    turning = turns[system.row_a] | turns[system.row_b]
    arm = np.where((system.row_b >= 0)[:, None], system.arm_b, system.arm_a)
    apart = np.where(turning | ~turning.any(axis=1)[:, None], 0.0, arm)
    key = np.column_stack([system.row_a, system.row_b, system.mu, system.frame.reshape(-1, 9), apart])
    key[turning.sum(axis=1) > 1, 0] = -2.0 - first[turning.sum(axis=1) > 1]  # each like none but itself
    _, earliest, which = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return np.asarray(earliest[which.ravel()])


def renumbered(node: Node, points: Ints, count: int) -> Node:
    """A tree over the (r,) chosen ones of `count` points, as one over all."""
    if isinstance(node, Split):
        parts = tuple(renumbered(part, points, count) for part in node.parts)
        return Split(int(points[node.point]), parts, node.rays, node.speed)
    if node.w is None:
        return node
    w = np.zeros((count, 3))
    w[points] = node.w
    return Leaf(node.y, w)


@dataclass(frozen=True, slots=True, eq=False)
class Symmetry:
    """A rotation or reflection that maps the model, loads included, onto itself."""

    turn: Floats  # (3, 3) orthogonal
    block: Ints  # (m,) image of each free block
    point: Ints  # (q,) image of each point
    tangent: Floats  # (q, 2, 2) maps (u, v) parts at a point to those at its image

    def keeps(self, cell: Cell) -> bool:
        """Whether the cell is its own image; cells with sectors are taken not to be."""
        at = self.point
        parts = (cell.status, cell.lo, cell.hi)
        return not cell.sector.any() and all(np.array_equal(part[at], part) for part in parts)

    def image(self, node: Node) -> Node:
        """The tree that closes the image of what a tree closes."""
        if isinstance(node, Leaf):
            y = None if node.y is None else self.motion(node.y)
            return Leaf(y, None if node.w is None else self.vectors(node.w))
        k, tangent = int(self.point[node.point]), self.tangent[node.point]
        parts = tuple(map(self.image, node.parts))
        rays = None if node.rays is None else node.rays @ tangent.T
        if rays is not None and np.linalg.det(tangent) < 0.0:  # turned over: sectors follow each other the other way
            parts = (*parts[-2::-1], parts[-1]) if len(parts) == len(rays) else parts[::-1]
            rays = rays[::-1]
        return Split(k, parts, rays, node.speed)

    def motion(self, y: Floats) -> Floats:
        """(6 m,) image of a motion."""
        rows, out = y.reshape(-1, 6), np.zeros((len(self.block), 6))
        out[self.block, :3] = rows[:, :3] @ self.turn.T
        out[self.block, 3:] = np.linalg.det(self.turn) * (rows[:, 3:] @ self.turn.T)
        return out.ravel()

    def vectors(self, w: Floats) -> Floats:
        """(q, 3) image of one vector a point in (n, u, v)."""
        out = np.zeros_like(w)
        out[self.point, 0] = w[:, 0]
        out[self.point, 1:] = np.einsum("qij,qj->qi", self.tangent, w[:, 1:])
        return out


def symmetries(system: EquilibriumSystem) -> Iterator[Symmetry]:
    """All symmetries but the identity, of models whose loads share one direction."""
    load = system.p.reshape(-1, 6)[:, :3]
    down = np.sum(load, axis=0)
    size = float(np.linalg.norm(down))
    if not (size > 0.0) or np.max(np.linalg.norm(np.cross(load, down / size), axis=1)) > MATCH:
        return
    down = down / size
    arms = np.concatenate([system.arm_a[system.row_a >= 0], system.arm_b[system.row_b >= 0]])
    level = arms - np.outer(arms @ down, down)
    length = np.linalg.norm(level, axis=1)
    if not (np.max(length, initial=0.0) > MATCH):
        return
    start = level[int(np.argmax(length))] / np.max(length)
    seen = {np.arange(system.points).tobytes()}
    for j in np.flatnonzero(np.max(length) - length < MATCH):
        for turn in _turns(down, start, level[j] / length[j]):
            found = _matched(system, turn)
            if found is not None and (key := found.point.tobytes()) not in seen:
                seen.add(key)
                yield found


def _turns(down: Floats, start: Floats, end: Floats) -> list[Floats]:
    """The rotation about `down`, and the reflection in a plane along it, that take `start` to `end`."""
    frame = np.column_stack([down, start, np.cross(down, start)])
    return [np.column_stack([down, end, sign * np.cross(down, end)]) @ frame.T for sign in (1.0, -1.0)]


def _matched(system: EquilibriumSystem, turn: Floats) -> Symmetry | None:
    """The permutations of points and blocks that go with an orthogonal map; None if it does not fit.

    Each point takes the first point that looks like its image and agrees with the blocks matched so far. Where many
    blocks look alike that may miss a symmetry; one that is returned holds.
    """
    held = np.stack([system.row_a >= 0, system.row_b >= 0])
    arms = np.where(held[:, :, None], np.stack([system.arm_a, system.arm_b]), 0.0)
    rows, normal, q = np.stack([system.row_a, system.row_b]), system.frame[:, 0], system.points
    looks = [_looks(system.mu, sign * normal, arms[order], held[order]) for sign, order in SIDES]
    image = _looks(system.mu, normal @ turn.T, arms @ turn.T, held)
    block, point = np.full(system.blocks, -1), np.full(q, -1)
    tangent, free = np.zeros((q, 2, 2)), np.ones(q, bool)
    for k in np.argsort(-held.sum(axis=0), kind="stable"):  # between two free blocks first: they say most
        for (sign, order), look in zip(SIDES, looks, strict=True):
            near = free & (np.max(np.abs(look - image[k]), axis=1) < MATCH)
            for side in (0, 1):
                i = rows[side, k]
                near &= (i < 0) | (block[i] < 0) | (rows[order[side]] == block[i])
            if near.any():
                point[k] = j = int(np.argmax(near))
                free[j] = False
                tangent[k] = sign * system.frame[j, 1:] @ turn @ system.frame[k, 1:].T
                for side in (0, 1):
                    if rows[side, k] >= 0:
                        block[rows[side, k]] = rows[order[side], j]
                break
    found = Symmetry(turn, block, point, tangent)
    return found if _fits(system, found) else None


SIDES = ((1.0, [0, 1]), (-1.0, [1, 0]))  # contact as it is, and with a and b swapped


def _looks(mu: Floats, normal: Floats, arms: Floats, held: Bools) -> Floats:
    """(q, 12) what tells points apart: friction, normal, place on both blocks, which of them are free."""
    return np.column_stack([mu, normal, arms[0], arms[1], held.T])


def _fits(system: EquilibriumSystem, found: Symmetry) -> bool:
    """Whether a map permutes points and blocks, and keeps equilibrium: A and p go with it."""
    if sorted(found.block.tolist()) != list(range(system.blocks)) or (found.point < 0).any():
        return False
    if sorted(found.point.tolist()) != list(range(system.points)):
        return False
    y = np.sin(1.0 + np.arange(6 * system.blocks))  # any motion: its gaps at the images are the images of its gaps
    gap = found.vectors(system.gap(y))
    off = np.max(np.abs(system.gap(found.motion(y)) - gap), initial=0.0) / (1.0 + np.max(np.abs(gap), initial=0.0))
    return bool(off < 1e2 * MATCH and np.max(np.abs(found.motion(system.p) - system.p)) < 1e2 * MATCH)


def tree_document(
    root: Node, system: EquilibriumSystem, names: Mapping[int, str] | Sequence[str], eps: float = 1.0
) -> dict[str, Any]:
    """The tree of a certificate: nested JSON in world units.

    Splits of the load at points where it is settled already, as images of other parts of a tree may have them, are
    left out.

    Parameters
    ----------
    root : Node
        A closed tree in scaled units (eps = 1).
    system : EquilibriumSystem
        The scaled system it belongs to; its points are those of the certificate.
    names : mapping or sequence
        Id of every block.
    eps : float
        Unit of displacements in the document.
    """
    labels = [names[int(i)] for i in system.free]

    def written(node: Node, settled: dict[int, int]) -> dict[str, Any]:
        if isinstance(node, Leaf):
            return _leaf_document(node, system, labels, eps)
        k = node.point
        if node.rays is not None:
            rays = node.rays @ system.frame[k, 1:]
            return {"point": k, "rays": rays.tolist(), "sectors": [written(part, settled) for part in node.parts]}
        if node.speed is not None:
            slower, faster = (written(part, settled) for part in node.parts)
            return {"point": k, "speed": node.speed * eps, "slower": slower, "faster": faster}
        if k in settled:
            return written(node.parts[settled[k]], settled)
        engaged, unloaded = (written(part, settled | {k: i}) for i, part in enumerate(node.parts))
        return {"point": k, "engaged": engaged, "unloaded": unloaded}

    return written(root, {})


def _leaf_document(leaf: Leaf, system: EquilibriumSystem, labels: list[str], eps: float) -> dict[str, Any]:
    document: dict[str, Any] = {}
    if leaf.y is not None:
        rows = system.still(leaf.y).reshape(-1, 6) * eps / np.repeat([1.0, system.length_unit], 3)
        document["mechanism"] = dict(zip(labels, flushed(rows), strict=True))
    if leaf.w is not None:
        document["forces"] = flushed(np.einsum("qi,qij->qj", leaf.w * system.force_unit, system.frame))
    return document
