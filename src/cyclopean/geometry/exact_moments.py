"""Volumes, first moments and area vectors without rounding: coordinates as integers on one power of two.

Python's integers stand in object arrays, so that numpy does the loops. What comes out are sums of three doubles each,
biggest first, which hold some 150 bits: enough to stand for the exact number in any sum of doubles.

By hand: the unit cube has 6 V = 6 and 24 int x dV = 12, and the area vector of its top is (0, 0, 2).
"""

from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.geometry.packed import following
from cyclopean.geometry.polyhedra import Polyhedra, triangles

__all__ = ["exact_area_vectors", "exact_moments", "expanded", "on_grid"]

LONGEST = 900  # bits of the longest integer that is made a double, which holds 1023
SPARE = 16  # bits below the grid that are kept where a number is divided


def on_grid(values: Floats) -> tuple[Any, int]:
    """Integers (objects), one for each number, and k, with values = integers / 2^k exactly."""
    mantissa, exponent = np.frexp(values)
    some = mantissa != 0.0
    k = int(np.max(53 - exponent, where=some, initial=0))
    whole = np.ldexp(mantissa, 53).astype(np.int64).astype(object)
    return np.asarray(whole << np.where(some, exponent - 53 + k, 0).astype(object), object), k


def expanded(numerator: Any, k: int, divisor: int = 1) -> Floats:
    """(..., 3) doubles whose sum is numerator / (divisor 2^k), but for what lies some 150 bits below the first."""
    shape = np.shape(numerator)
    rest = np.ravel(numerator)
    if divisor != 1:
        rest, k = (rest << SPARE) // divisor, k + SPARE
    longest = max((abs(n).bit_length() for n in rest.tolist()), default=0)
    if longest > LONGEST:
        rest, k = rest >> (longest - LONGEST), k - (longest - LONGEST)
    parts = np.zeros((len(rest), 3))
    for j in range(3):
        leading = rest.astype(np.float64)
        parts[:, j] = np.ldexp(leading, -k)
        rest = rest - np.array([int(x) for x in leading.tolist()], object)
    return parts.reshape(*shape, 3)


def exact_moments(mesh: Polyhedra, bodies: Ints) -> tuple[Any, Any, int]:
    """(n,) 6 V and (n, 3) 24 int r dV of some bodies as integers, on the grids 2^-3k and 2^-4k; and k.

    Fans of triangles from the first corner of every face, tetrahedra to a corner of the body: faces that are not flat
    bound the same solid as for the checker of certificates.
    """
    place = np.full(len(mesh), -1)
    place[bodies] = np.arange(len(bodies))
    owner = place[mesh.vertex_body]
    kept = np.flatnonzero(owner >= 0)
    vertex, k = on_grid(mesh.vertex[kept])
    position = np.zeros(len(owner), np.int64)
    position[kept] = np.arange(len(kept))
    origin = vertex[position[mesh.vertex_start[bodies]]]
    local = vertex - origin[owner[kept]]
    corner, face = triangles(mesh)
    body = mesh.face_body[face]
    apart = (corner != mesh.vertex_start[body][:, None]).all(1) & (place[body] >= 0)  # the others have no volume
    corner, row = position[corner[apart]], place[body[apart]]
    a, b, c = (local[corner[:, j]] for j in range(3))
    six = (a * _cross(b, c)).sum(axis=1)
    order = np.argsort(row, kind="stable")
    terms = np.concatenate([six[:, None], six[:, None] * (a + b + c)], 1)[order]
    total = np.full((len(bodies), 4), 0, object)
    filled, first = np.unique(row[order], return_index=True)
    if len(filled):
        total[filled] = np.add.reduceat(terms, first, axis=0)
    return total[:, 0], total[:, 1:] + 4 * total[:, :1] * origin, k


def exact_area_vectors(point: Floats, start: Ints) -> tuple[Any, int]:
    """(c, 3) twice the area vectors of packed polygons as integers on the grid 2^-2k, and k."""
    whole, k = on_grid(point)
    if len(start) <= 1:
        return np.zeros((0, 3), object), k
    here = whole - whole[np.repeat(start[:-1], np.diff(start))]
    return np.add.reduceat(_cross(here, here[following(start)]), start[:-1], axis=0), k


def _cross(a: Any, b: Any) -> Any:
    x, y, z = a.T
    u, v, w = b.T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], 1)
