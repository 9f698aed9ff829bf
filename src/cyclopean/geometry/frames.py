"""Right-handed orthonormal frames."""

import numpy as np

from cyclopean.arrays import Floats, Ints

__all__ = ["frames_from_normals", "newell_normals"]


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
    """(c, 3) m2: Newell normals, twice the area long, of c polygons packed in (P, 3) `point` at offsets `start`."""
    if len(start) <= 1:
        return np.zeros((0, 3))
    here = point - point[np.repeat(start[:-1], np.diff(start))]
    following = np.arange(1, len(point) + 1)
    following[start[1:] - 1] = start[:-1]
    return np.asarray(np.add.reduceat(np.cross(here, here[following]), start[:-1], axis=0))
