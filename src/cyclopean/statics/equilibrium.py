"""The equilibrium system A f = -p of an assembly, scaled so that no verdict depends on units."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Contacts
from cyclopean.errors import InputError

__all__ = ["EquilibriumSystem", "body_loads", "equilibrium_system", "turned_gravity"]


@dataclass(frozen=True, slots=True, eq=False)
class EquilibriumSystem:
    """A f = -p in scaled units, over the contact points that touch a free block (symbols: `cyclopean.statics`)."""

    free: Ints  # (m,) block of each group of six rows
    used: Ints  # (q,) which contact points of the model these are
    row_a: Ints  # (q,) free index of block a, -1 = fixed
    row_b: Ints  # (q,) free index of block b, -1 = fixed
    arm_a: Floats  # (q, 3) r_k - c_a, scaled
    arm_b: Floats  # (q, 3) r_k - c_b, scaled
    frame: Floats  # (q, 3, 3) rows n, u, v
    mu: Floats  # (q,)
    A: Any  # (6 m, 3 q) csr, scaled
    p: Floats  # (6 m,) scaled
    force_unit: float  # N
    length_unit: float  # m

    @property
    def blocks(self) -> int:
        """Number m of free blocks."""
        return len(self.free)

    @property
    def points(self) -> int:
        """Number q of contact points that matter."""
        return len(self.used)

    def gap(self, y: Floats) -> Floats:
        """(q, 3) dd = A' y."""
        return np.asarray(self.A.T @ y).reshape(-1, 3)

    def residual(self, f: Floats) -> Floats:
        """(6 m,) A f + p."""
        return np.asarray(self.A @ f.ravel() + self.p)


def turned_gravity(gravity: Floats, degrees: float, azimuth: float = 0.0) -> Floats:
    """Turn (3,) gravity from -z towards `azimuth` (degrees from +x to +y) by `degrees`, keeping its size.

    A gravity vector that is not vertical is turned by the same rotation, about the horizontal axis.

    Examples
    --------
    >>> (turned_gravity(np.array([0.0, 0, -10]), 90.0).round(12) + 0.0).tolist()
    [10.0, 0.0, 0.0]
    """
    angle, heading = np.deg2rad(degrees), np.deg2rad(azimuth)
    towards = np.array([np.cos(heading), np.sin(heading), 0.0])
    axis = np.cross([0.0, 0.0, -1.0], towards)
    g = np.asarray(gravity, float)
    turned = g * np.cos(angle) + np.cross(axis, g) * np.sin(angle) + axis * (axis @ g) * (1 - np.cos(angle))
    return np.asarray(turned)


def body_loads(assembly: Assembly, gravity: Floats, density: float) -> Floats:
    """(n, 6) N and N m: weight and given loads of every block, moments about its centre of mass.

    `density` (kg/m3) fills in where a block gives none.
    """
    given = np.array([density if b.density is None else b.density for b in assembly.blocks])
    wrench = np.zeros((len(assembly), 6))
    wrench[:, :3] = (given * assembly.mass.volume)[:, None] * gravity
    for load in assembly.loads:
        wrench[load.block, :3] += load.force
        wrench[load.block, 3:] += np.cross(load.point - assembly.mass.centroid[load.block], load.force)
    return wrench


def equilibrium_system(
    assembly: Assembly, contacts: Contacts, fixed: Bools, gravity: Floats, density: float
) -> EquilibriumSystem:
    """Set up A f = -p.

    [Kao2022]_ eq. (11), first constraint, with their sign turned: here the force on `b` is positive. For block i and
    contact point k, s = +1 if i is b, -1 if it is a, and R_k the frame's rows:

        A[i, k] = s [  R_k'           ]
                    [ (r_k - c_i) x R_k' ]

    Unlike there, fixed blocks have no rows, contacts between two fixed blocks no columns, and everything is scaled.

    Parameters
    ----------
    assembly : Assembly
        n blocks, volumes positive.
    contacts : Contacts
        Friction coefficients filled in.
    fixed : (n,) bool
        Supports.
    gravity : (3,) m/s2
        World axes.
    density : float
        kg/m3 where a block gives none.

    References
    ----------
    .. [Kao2022] Kao, Iannuzzo, Thomaszewski, Coros, Van Mele, Block: Coupled Rigid-Block Analysis. Computer-Aided
       Design 146 (2022) 103216.

    Raises
    ------
    InputError
        A friction coefficient is missing.
    """
    free = np.flatnonzero(~fixed)
    row = np.full(len(assembly), -1)
    row[free] = np.arange(len(free))
    if np.isnan(contacts.mu).any():
        raise InputError("contacts: a friction coefficient mu is missing")
    patch = contacts.patch
    used = np.flatnonzero((row[contacts.a[patch]] >= 0) | (row[contacts.b[patch]] >= 0))
    patch = patch[used]
    frame = contacts.frame[patch] if len(contacts) else np.zeros((0, 3, 3))
    wrench = body_loads(assembly, gravity, density)[free]
    weight = np.linalg.norm(wrench[:, :3], axis=1)
    force_unit = float(np.mean(weight)) if weight.any() else 1.0
    length_unit = float(np.mean(np.cbrt(np.abs(assembly.mass.volume[free])))) if len(free) else 1.0
    centre, point = assembly.mass.centroid, contacts.point[used]
    a, b = contacts.a[patch], contacts.b[patch]
    arm_a, arm_b = (point - centre[a]) / length_unit, (point - centre[b]) / length_unit
    p = wrench / force_unit
    p[:, 3:] /= length_unit
    matrix = _matrix(len(free), row[a], row[b], arm_a, arm_b, frame)
    return EquilibriumSystem(
        free, used, row[a], row[b], arm_a, arm_b, frame, contacts.mu[patch], matrix, p.ravel(), force_unit, length_unit
    )


def _matrix(blocks: int, row_a: Ints, row_b: Ints, arm_a: Floats, arm_b: Floats, frame: Floats) -> Any:
    local3, local6 = np.arange(3), np.arange(6)
    rows, columns, values = [], [], []
    for row, arm, sign in ((row_a, arm_a, -1.0), (row_b, arm_b, 1.0)):
        k = np.flatnonzero(row >= 0)
        turn = np.cross(arm[k][:, None, :], frame[k])  # (q, 3 components, 3 axes)
        value = sign * np.concatenate([frame[k], turn], 2)  # (q, 3, 6)
        rows.append(np.broadcast_to(6 * row[k][:, None, None] + local6, value.shape).ravel())
        columns.append(np.broadcast_to(3 * k[:, None, None] + local3[:, None], value.shape).ravel())
        values.append(value.ravel())
    data, i, j = (np.concatenate(part) for part in (values, rows, columns))
    keep = data != 0.0
    return sp.csr_matrix((data[keep], (i[keep], j[keep])), shape=(6 * blocks, 3 * len(frame)))
