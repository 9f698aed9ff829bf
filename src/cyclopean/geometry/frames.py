"""Right-handed orthonormal frames, rotations, unit vectors, cross products, solid angles."""

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.geometry.packed import following

__all__ = [
    "affine",
    "cross_2d",
    "crossed",
    "frames_from_normals",
    "newell_normals",
    "rotations",
    "solid_angles",
    "spiral",
    "unit",
]

_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def frames_from_normals(normal: Floats) -> Floats:
    """(c, 3, 3) frames with rows n, u, v, right-handed, from (c, 3) unit normals.

    Branch-free construction of Duff et al. 2017 ("Building an Orthonormal Basis, Revisited"): continuous everywhere
    but at n_z = 0-, so nearby normals get nearby tangents. No answer depends on the choice of u and v.
    """
    x, y, z = normal.T
    sign = np.where(z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    u = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], 1)
    v = np.stack([b, sign + y * y * a, -y], 1)
    return np.stack([normal, u, v], 1)


def newell_normals(point: Floats, start: Ints) -> Floats:
    """(c, 3) m2: Newell normals, twice the area long, of c polygons packed in (P, 3) `point` at offsets `start`.

    Taken about each polygon's own first corner, so that a model far from the origin loses nothing.
    """
    if len(start) <= 1:
        return np.zeros((0, 3))
    here = point - point[np.repeat(start[:-1], np.diff(start))]
    return np.asarray(np.add.reduceat(np.cross(here, here[following(start)]), start[:-1], axis=0))


def crossed(a: Floats, b: Floats) -> Floats:
    """(k, 3) cross products of (k, 3) vectors; on short arrays in a third of the time that numpy's takes."""
    return np.asarray(a.take(_NEXT, 1) * b.take(_LAST, 1) - a.take(_LAST, 1) * b.take(_NEXT, 1))


def cross_2d(a: Floats, b: Floats) -> Floats:
    """Cross products of vectors (..., 2): twice the area of the triangle between them."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def unit(vector: Floats) -> Floats:
    """Vectors (..., 3) of length 1; of length 0 where they have none."""
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.asarray(vector / np.where(length > 0.0, length, 1.0))


def spiral(count: int) -> Floats:
    """Unit vectors (count, 3), evenly spread: the spiral of the golden angle."""
    k = np.arange(count) + 0.5
    height, turn = 1.0 - 2.0 * k / count, np.pi * (3.0 - np.sqrt(5.0)) * k
    return np.column_stack([*(np.sqrt(1.0 - height**2) * (np.cos(turn), np.sin(turn))), height])


def affine(linear: Floats, shift: Floats) -> Floats:
    """(4, 4) matrix of x -> linear (3, 3) @ x + shift (3,)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, shift
    return matrix


def solid_angles(corner: Floats) -> Floats:
    """(t,) share of all directions in which triangles (t, 3, 3) are seen from the origin (Van Oosterom, Strackee 1983).

    Positive where they are seen from behind: those of a closed, outward mesh add up to 1 inside it, and to 0 outside.
    """
    length = np.linalg.norm(corner, axis=2)
    six = np.einsum("ti,ti->t", corner[:, 0], np.cross(corner[:, 1], corner[:, 2]))
    below = length.prod(axis=1)
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        below += np.einsum("ti,ti->t", corner[:, a], corner[:, b]) * length[:, c]
    return np.asarray(np.arctan2(six, below) / (2.0 * np.pi))


def rotations(turn: Floats) -> Floats:
    """(n, 3, 3) rotation matrices of (n, 3) rotation vectors, by Rodrigues' formula.

    Examples
    --------
    >>> rotations(np.array([[0.0, 0.0, np.pi / 2]]))[0].round(12).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    angle = np.sqrt(np.einsum("ki,ki->k", turn, turn))
    skew = np.zeros((len(turn), 3, 3))
    skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0] = turn.T
    skew[:, 1, 2], skew[:, 2, 0], skew[:, 0, 1] = -turn.T
    first = np.sinc(angle / np.pi)  # sin(t)/t and (1 - cos t)/t^2, both finite at 0
    second = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    return np.asarray(np.eye(3) + first[:, None, None] * skew + second[:, None, None] * (skew @ skew))
