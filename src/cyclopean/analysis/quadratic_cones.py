"""The algebra of products of Q3 = {x0 >= |(x1, x2)|}, one row a cone, that interior points need.

The Nesterov-Todd scaling of a pair x, z is W = r (2 w w' - J)^(1/2) with J = diag(1, -1, -1), w'J w = 1 and r a ratio
of sizes: W z = W^-1 x. Only w and r are kept; W^-1 has J w and 1 / r. By hand: for x = z = (1, 0, 0), w = (1, 0, 0) and
r = 1, so that W = I and (H + W^-2)^-1 = 1/2 for H = I.

>>> e = np.array([[1.0, 0.0, 0.0]])
>>> condensed(*nesterov_todd(e, e), 1.0, 1.0)[0].tolist()
[[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]]

References
----------
.. [NT] Nesterov, Todd: Primal-dual interior-point methods for self-scaled cones. SIAM J. Optim. 8 (1998).
.. [CVX] Vandenberghe: The CVXOPT linear and quadratic cone program solvers (2010), for scalings and step lengths.
"""

import numpy as np

from cyclopean.arrays import Floats

__all__ = [
    "REFLECT",
    "apply",
    "condensed",
    "determinant",
    "lifted",
    "longest",
    "nesterov_todd",
    "product",
    "quotient",
    "reach",
    "scaled",
]

REFLECT = np.array([1.0, -1.0, -1.0])


def apply(M: Floats, x: Floats) -> Floats:
    """M_k x_k for (q, 3, 3) M and (q, 3) x."""
    return np.asarray(np.einsum("nij,nj->ni", M, x))


def determinant(x: Floats) -> Floats:
    """x0^2 - |x_t|^2 of each row, as a product so that it keeps its digits near the edge."""
    tangent = np.hypot(x[:, 1], x[:, 2])
    return np.maximum((x[:, 0] - tangent) * (x[:, 0] + tangent), 1e-300)


def lifted(x: Floats) -> Floats:
    """Move all rows up the axis by one amount until they are well inside Q3."""
    low = float(np.max(np.hypot(x[:, 1], x[:, 2]) - x[:, 0], initial=-np.inf))
    if low <= -1e-8:
        return x
    x = x.copy()
    x[:, 0] += 1.0 + max(low, 0.0)
    return x


def nesterov_todd(x: Floats, z: Floats) -> tuple[Floats, Floats]:
    """(q, 3) w and (q,) r of the scaling with W z = W^-1 x."""
    root_x, root_z = np.sqrt(determinant(x)), np.sqrt(determinant(z))
    unit_x, unit_z = x / root_x[:, None], z / root_z[:, None]
    gamma = np.sqrt((1.0 + np.sum(unit_x * unit_z, 1)) / 2.0)
    return (unit_x + REFLECT * unit_z) / (2.0 * gamma[:, None]), np.sqrt(root_x / root_z)


def scaled(w: Floats, r: Floats, x: Floats) -> Floats:
    """W x, a row (q, 3) each; with REFLECT * w and 1 / r, W^-1 x.

    W / r = [ w0  w_t' ; w_t  I + w_t w_t' / (1 + w0) ].
    """
    along = w[:, 1] * x[:, 1] + w[:, 2] * x[:, 2]
    out = np.zeros_like(x)
    out[:, 0] = r * (w[:, 0] * x[:, 0] + along)
    share = r * (x[:, 0] + along / (1.0 + w[:, 0]))
    out[:, 1] = r * x[:, 1] + share * w[:, 1]
    out[:, 2] = r * x[:, 2] + share * w[:, 2]
    return out


def condensed(w: Floats, r: Floats, normal: Floats | float, tangential: Floats | float) -> Floats:
    """D = (diag(normal, tangential, tangential) + W^-2)^-1, (q, 3, 3), in closed form.

    With g = 1 / r^2 and s = |w_t|, W^-2 = g (2 (J w)(J w)' - J). Across w_t this is g; in the plane of the axis and w_t
    it is g [[1 + 2 s^2, -2 w0 s], [-2 w0 s, 1 + 2 s^2]], of determinant g^2: nothing cancels.
    """
    g = 1.0 / (r * r)
    square = w[:, 1] ** 2 + w[:, 2] ** 2
    steep = g * (1.0 + 2.0 * square)
    whole = g * g + steep * (normal + tangential) + normal * tangential
    across = 1.0 / (g + tangential)
    cross = 2.0 * g * w[:, 0] / whole
    bend = 2.0 * g * (g - normal) / whole * across  # (D along w_t - D across it) / s^2
    D = np.zeros((len(w), 3, 3))
    D[:, 0, 0] = (steep + tangential) / whole
    D[:, 0, 1] = D[:, 1, 0] = cross * w[:, 1]
    D[:, 0, 2] = D[:, 2, 0] = cross * w[:, 2]
    D[:, 1, 1] = across + bend * w[:, 1] ** 2
    D[:, 2, 2] = across + bend * w[:, 2] ** 2
    D[:, 1, 2] = D[:, 2, 1] = bend * w[:, 1] * w[:, 2]
    return D


def product(a: Floats, b: Floats) -> Floats:
    """Jordan product on Q3, of each row (q, 3)."""
    return np.concatenate([np.sum(a * b, 1, keepdims=True), a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:]], 1)


def quotient(a: Floats, b: Floats) -> Floats:
    """Solve a o x = b for x, in each row (q, 3)."""
    head = (a[:, 0] * b[:, 0] - np.sum(a[:, 1:] * b[:, 1:], 1)) / determinant(a)
    return np.concatenate([head[:, None], (b[:, 1:] - head[:, None] * a[:, 1:]) / a[:, :1]], 1)


def longest(x: Floats, d: Floats) -> float:
    """Largest t with x + t d in Q3 for every row (may be infinite)."""
    steep = np.hypot(d[:, 1], d[:, 2])
    a = (d[:, 0] - steep) * (d[:, 0] + steep)
    b = x[:, 0] * d[:, 0] - x[:, 1] * d[:, 1] - x[:, 2] * d[:, 2]
    c = determinant(x)
    square = b * b - a * c
    root = np.sqrt(np.maximum(square, 0.0))
    pivot = -(b + np.where(b >= 0.0, root, -root))
    reach = np.full(len(x), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for t in (pivot / a, c / pivot):
            reach = np.minimum(reach, np.where((t > 0.0) & (square >= 0.0), t, np.inf))
        apex = np.where(d[:, 0] < 0.0, -x[:, 0] / d[:, 0], np.inf)
    return float(np.min(np.minimum(reach, apex), initial=np.inf))


def reach(x: Floats, d: Floats) -> float:
    """Largest t with x + t d >= 0, (q,) each (may be infinite)."""
    down = d < 0.0
    return float(np.min(-x[down] / d[down], initial=np.inf))
