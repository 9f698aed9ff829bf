"""A mechanism drawn as true rigid motion: each block turns about its centroid and shifts, nothing is stretched."""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.geometry import rotations

LARGEST_TURN = 0.8  # rad; a block that only spins is not turned further than this


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A mechanism followed for `time`, and how far that takes each block."""

    time: float  # s, of the velocities as they stand in the result
    vertex: Floats  # (V, 3) m, where every vertex goes
    travel: Floats  # (n,) m, the furthest vertex of each block
    turn: Floats  # (n,) rad


def moved(vertex: Floats, body: Ints, centre: Floats, mechanism: Floats, time: float) -> Floats:
    """(V, 3) m: vertices after every body has turned by w t about its centroid and shifted by v t.

    `body` (V,) is the body of each vertex (V, 3), m; `centre` (n, 3), m, are the centroids; `mechanism` (n, 6) is the
    velocity of each centroid, m/s, and the angular velocity, rad/s; `time` is in s.
    """
    turn = rotations(time * mechanism[:, 3:])[body]
    arm = vertex - centre[body]
    return np.asarray(centre[body] + np.einsum("vij,vj->vi", turn, arm) + time * mechanism[body, :3])


def drawn_motion(vertex: Floats, body: Ints, centre: Floats, mechanism: Floats, wanted: float) -> Motion:
    """Follow the mechanism until the vertex that moves most has moved by `wanted` (m).

    Velocities set the first guess; because blocks turn along arcs, three secant steps then meet the wish to within a
    few parts in a thousand. No block is turned by more than 0.8 rad.
    """
    n = len(centre)
    arm = vertex - centre[body]
    speed = np.linalg.norm(mechanism[body, :3] + np.cross(mechanism[body, 3:], arm), axis=1)
    spin = np.linalg.norm(mechanism[:, 3:], axis=1)
    fastest = float(np.max(speed, initial=0.0))
    limit = LARGEST_TURN / float(np.max(spin)) if np.any(spin > 0.0) else np.inf
    time = 0.0 if not (fastest > 0.0) else min(wanted / fastest, limit)
    for _ in range(3):
        way = moved(vertex, body, centre, mechanism, time) - vertex
        reach = float(np.max(np.linalg.norm(way, axis=1), initial=0.0))
        time = min(time * wanted / reach, limit) if reach > 0.0 else time
    there = moved(vertex, body, centre, mechanism, time)
    travel = np.zeros(n)
    np.maximum.at(travel, body, np.linalg.norm(there - vertex, axis=1))
    return Motion(time, there, travel, time * spin)
