"""What is drawn of a result, whoever draws it: bodies as shown, their colours, ghost lines and arrows."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from cyclopean.analysis import Result
from cyclopean.arrays import Floats, Ints
from cyclopean.geometry import Polyhedra, face_normals, pack
from cyclopean.view.colours import classes
from cyclopean.view.figures import Resultants, block_utilisation, resultants
from cyclopean.view.motion import Motion, drawn_motion

__all__ = ["Picture", "feature_edges", "outlines", "picture"]

FACE_LIMIT = 200_000  # triangles; beyond it blocks with many faces are drawn as their convex outlines
EDGE_LIMIT = 60_000  # line segments of one kind
ARROW_LIMIT = 2_000
BLOCK_LIMIT = 3_000  # beyond it neither arrows nor ghosts: they would be smaller than anyone can see
SHARP = np.cos(np.radians(20.0))  # faces that turn less than this share no drawn edge

Quantity = Literal["utilisation", "movement", "nothing"]


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One drawing of n blocks; lengths in metres, world axes."""

    mesh: Polyhedra  # as shown: moved along the mechanism when there is one
    group: Ints  # (n,) colour class
    quantity: Quantity  # what the colours mean
    edge: Floats  # (e, 2, 3)
    ghost: Floats  # (g, 2, 3) edges of the model where it stands, when it is shown moved
    arrow: Floats  # (m, 2, 3) tail and tip; largest force first
    largest: float  # N, the force of the longest arrow
    gravity: Floats  # (3,) m/s2
    motion: Motion | None
    notes: tuple[str, ...]  # what was left out or simplified, for the reader


def picture(result: Result) -> Picture:
    """Choose what to show of a result."""
    whole = result.assembly.mesh
    shown = outlines(whole, FACE_LIMIT)
    notes = [] if shown is whole else ["Blocks with many faces are drawn as their convex outlines."]
    motion = _motion(result, shown)
    edge = feature_edges(shown)
    if len(edge) > EDGE_LIMIT:
        notes.append("Edges of blocks are left out: there are too many.")
    if motion is not None:
        mesh = Polyhedra(motion.vertex, shown.vertex_start, shown.corner, shown.corner_start, shown.face_start)
        ghost, edge = edge, feature_edges(mesh)
    else:
        mesh, ghost = shown, np.zeros((0, 2, 3))
    drawable, many = len(edge) <= EDGE_LIMIT, len(result.assembly) > BLOCK_LIMIT
    if many and (len(ghost) or result.force is not None):
        what = "the model where it stands" if len(ghost) else "the drawing of contact forces"
        notes.append(f"With more than {BLOCK_LIMIT:,} blocks, {what} would not be legible and is left out.")
        ghost = ghost[:0]
    quantity, value = _quantity(result, motion)
    arrow, largest = _arrows(result, None if many else resultants(result), notes)
    return Picture(
        mesh,
        classes(value, result.fixed),
        quantity,
        edge if drawable else edge[:0],
        ghost if drawable else ghost[:0],
        arrow,
        largest,
        result.gravity,
        motion,
        tuple(notes),
    )


def _motion(result: Result, mesh: Polyhedra) -> Motion | None:
    """Follow the mechanism so far that the largest displacement is a quarter of the mean size of a free block."""
    if result.mechanism is None or not np.any(result.mechanism):
        return None
    volume = np.abs(result.assembly.mass.volume)
    free = volume[~result.fixed] if not result.fixed.all() else volume
    size = float(np.mean(free)) ** (1.0 / 3.0)
    return drawn_motion(mesh.vertex, mesh.vertex_body, result.assembly.mass.centroid, result.mechanism, 0.25 * size)


def _quantity(result: Result, motion: Motion | None) -> tuple[Quantity, Floats]:
    if motion is not None:
        return "movement", motion.travel / max(float(np.max(motion.travel, initial=0.0)), 1e-300)
    if result.utilisation is not None and len(result.utilisation):
        return "utilisation", block_utilisation(result)
    return "nothing", np.full(len(result.assembly), np.nan)


def _arrows(result: Result, found: Resultants | None, notes: list[str]) -> tuple[Floats, float]:
    """Resultants through the centres of pressure, along the way the load goes; the largest is 0.9 block sizes long."""
    if found is None or not len(found.loaded):
        return np.zeros((0, 2, 3)), 0.0
    some = found.loaded[:ARROW_LIMIT]
    if len(found.loaded) > ARROW_LIMIT:
        notes.append(f"Arrows show the largest {ARROW_LIMIT:,} of {len(found.loaded):,} contact forces.")
    force = found.force[some]
    force = np.where((force @ result.gravity < 0.0)[:, None], -force, force)  # of action and reaction, the downward one
    largest = float(np.max(np.linalg.norm(force, axis=1)))
    volume = np.abs(result.assembly.mass.volume)
    length = 0.9 * float(np.mean(volume)) ** (1.0 / 3.0) / largest
    half = 0.5 * length * force
    return np.stack([found.centre[some] - half, found.centre[some] + half], 1), largest


def feature_edges(mesh: Polyhedra) -> Floats:
    """(e, 2, 3) m: edges where the surface turns by more than 20 degrees, each once."""
    if not len(mesh.corner):
        return np.zeros((0, 2, 3))
    normal = face_normals(mesh)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    here, there = mesh.corner, mesh.corner[mesh.next_corner]
    key = np.minimum(here, there) * len(mesh.vertex) + np.maximum(here, there)
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    count = np.diff(np.append(first, len(order)))
    one, two = order[first], order[np.minimum(first + 1, len(order) - 1)]
    turn = np.einsum("ei,ei->e", normal[mesh.corner_face[one]], normal[mesh.corner_face[two]])
    keep = one[(count != 2) | (turn < SHARP)]
    return np.stack([mesh.vertex[here[keep]], mesh.vertex[there[keep]]], 1)


def outlines(mesh: Polyhedra, limit: int) -> Polyhedra:
    """The same mesh while it has at most `limit` triangles; beyond, blocks of many faces as convex outlines.

    An outline is the hull of the vertices that lie furthest in 64 directions, so it has at most 124 triangles.
    """
    count = np.diff(mesh.corner_start) - 2
    body_triangles = np.bincount(mesh.face_body, count, len(mesh))
    if body_triangles.sum() <= limit:
        return mesh
    from scipy.spatial import ConvexHull

    k = np.arange(64) + 0.5  # Fibonacci sphere
    height, angle = 1.0 - k / 32.0, np.pi * (1.0 + 5.0**0.5) * k
    ring = np.sqrt(1.0 - height**2)
    direction = np.stack([ring * np.cos(angle), ring * np.sin(angle), height])
    bodies: list[tuple[Floats, list[list[int]]]] = []
    for i in range(len(mesh)):
        low, high = mesh.vertex_start[i], mesh.vertex_start[i + 1]
        vertex = mesh.vertex[low:high]
        if body_triangles[i] > 124:
            vertex = vertex[np.unique(np.argmax((vertex - vertex[0]) @ direction, axis=0))]
            hull = ConvexHull(vertex)
            outward = np.linalg.det(vertex[hull.simplices] - vertex.mean(axis=0)) > 0.0
            bodies.append((vertex, np.where(outward[:, None], hull.simplices, hull.simplices[:, ::-1]).tolist()))
        else:
            spans = range(mesh.face_start[i], mesh.face_start[i + 1])
            faces = [mesh.corner[mesh.corner_start[f] : mesh.corner_start[f + 1]] - low for f in spans]
            bodies.append((vertex, [face.tolist() for face in faces]))
    return pack(bodies)
