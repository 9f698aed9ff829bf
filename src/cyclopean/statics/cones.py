"""Coulomb's friction cone: projection, its generalised Jacobian, and pyramids for comparison."""

from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Bools, Floats

__all__ = ["cone_jacobian", "cone_regions", "project_cones", "pyramid_rows"]


def cone_regions(x: Floats, mu: Floats) -> tuple[Bools, Bools, Floats]:
    """Where each row of (P, 3) x lies: inside K_mu, or beyond it but not in its polar; and |x_t|.

    Returns
    -------
    inside, edge : (P,) bool
        Neither = in the polar cone, where the projection is zero.
    tangent : (P,)
        |x_t|.
    """
    tangent = np.hypot(x[:, 1], x[:, 2])
    inside = (x[:, 0] >= 0.0) & (tangent <= mu * x[:, 0])
    edge = ~inside & (x[:, 0] + mu * tangent > 0.0)
    return inside, edge, tangent


def project_cones(x: Floats, mu: Floats) -> Floats:
    """Nearest point of K_mu = {fn >= 0, |f_t| <= mu fn} to each row of (P, 3) x.

    On the edge fn = (x_n + mu |x_t|) / (1 + mu^2), f_t = mu fn x_t / |x_t|.

    Examples
    --------
    >>> project_cones(np.array([[2.0, 1, 0], [0, 2, 0], [-2, 1, 0]]), np.ones(3)).tolist()
    [[2.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]]
    """
    inside, edge, tangent = cone_regions(x, mu)
    normal = (x[:, 0] + mu * tangent) / (1.0 + mu * mu)
    share = np.where(edge, mu * normal / np.where(edge, np.maximum(tangent, 1e-300), 1.0), 0.0)
    f = np.where(inside[:, None], x, 0.0)
    f[:, 0] += np.where(edge, normal, 0.0)
    f[:, 1:] += share[:, None] * x[:, 1:]
    return f


def cone_jacobian(x: Floats, mu: Floats) -> Floats:
    """(P, 3, 3) generalised Jacobian of `project_cones` at x: symmetric, eigenvalues in [0, 1]."""
    inside, edge, tangent = cone_regions(x, mu)
    jacobian = np.zeros((len(x), 3, 3))
    jacobian[inside] = np.eye(3)
    m, s, e = mu[edge], tangent[edge], np.zeros((int(edge.sum()), 2))
    moving = s > 0.0
    e[moving] = x[edge, 1:][moving] / s[moving][:, None]
    share = 1.0 / (1.0 + m * m)
    turn = m * share * (x[edge, 0] + m * s) / np.maximum(s, 1e-300)
    block = np.zeros((len(m), 3, 3))
    block[:, 0, 0] = share
    block[:, 0, 1:] = block[:, 1:, 0] = (m * share)[:, None] * e
    along = e[:, :, None] * e[:, None, :]
    block[:, 1:, 1:] = (m * m * share)[:, None, None] * along + np.where(moving, turn, 0.0)[:, None, None] * (
        np.eye(2) - along
    )
    jacobian[edge] = block
    return jacobian


def pyramid_rows(mu: Floats, faces: int, inscribed: bool) -> Any:
    """(K P, 3 P) sparse rows g with g f <= 0: cos(theta_k) fu + sin(theta_k) fv <= mu' fn, theta_k = 2 pi k / K.

    Inscribed uses mu' = mu cos(pi / K) and is conservative; circumscribed (mu' = mu) allows up to mu / cos(pi / K).
    """
    count, k = len(mu), np.arange(faces)
    cos, sin = np.cos(2 * np.pi * k / faces), np.sin(2 * np.pi * k / faces)
    cos[np.abs(cos) < 1e-15] = 0.0  # exactly 0 and +-1 where they should be
    sin[np.abs(sin) < 1e-15] = 0.0
    reach = mu * np.cos(np.pi / faces) if inscribed else mu
    value = np.stack(np.broadcast_arrays(-reach[:, None], cos[None, :], sin[None, :]), 2)  # (P, K, 3)
    row = np.broadcast_to(np.arange(count * faces).reshape(count, faces, 1), value.shape)
    column = np.broadcast_to((3 * np.arange(count))[:, None, None] + np.arange(3), value.shape)
    rows = sp.csc_matrix((value.ravel(), (row.ravel(), column.ravel())), shape=(faces * count, 3 * count))
    rows.eliminate_zeros()
    return rows
