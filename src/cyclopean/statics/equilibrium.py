"""The equilibrium system A f = -p of an assembly, scaled so that no verdict depends on units."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Contacts, held_directions
from cyclopean.errors import InputError

STANDARD_GRAVITY = 9.80665  # m/s2; own weights are counted in it where there is no gravity
RELIED = 1.0 - 1e-9
"""Share of a joint's tension that is counted on: what is left keeps forces inside the cones of a certificate."""

__all__ = ["EquilibriumSystem", "body_loads", "contact_matrix", "equilibrium_system", "partly_held", "turned_gravity"]


@dataclass(frozen=True, slots=True, eq=False)
class EquilibriumSystem:
    """A f = -p in scaled units, over the contact points that touch a free block (symbols: `cyclopean.statics`).

    Directions that a partial support holds have rows of zeros in A and p: nothing has to balance there, and what a
    velocity says there moves nothing (`still` sets it to zero). Where joints pull, f stands for the true forces plus
    `pull` n and p for the loads less A (pull n), so that all cones begin at zero (`true_forces` takes it off).
    """

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
    weight: Floats  # (m,) scaled own weight rho V |g|, of standard gravity where there is none
    diagonal: Floats  # (m,) scaled diagonal of each block's box
    held: Bools = field(default_factory=lambda: np.zeros((0, 6), bool))  # (m, 6), or none at all
    pull: Floats = field(default_factory=lambda: np.zeros(0))  # (q,) scaled tension of each point, or none at all
    size: Floats | None = None  # (m,) scaled size of the loads of each block; None = that of its force in p
    rows: Floats | None = None  # (6 m,) by what rows of A and p are multiplied beyond the two units; None = nothing
    across: Any = field(init=False, repr=False)  # A' (3 q, 6 m) csc: making this view takes longer than a product

    def __post_init__(self) -> None:
        object.__setattr__(self, "across", self.A.T)

    @property
    def total(self) -> float:
        """Size of all loads, scaled: what residuals and collapse bounds are measured by.

        Of blocks that are partly held without the parts that the supports bear.
        """
        size = np.linalg.norm(self.p.reshape(-1, 6)[:, :3], axis=1) if self.size is None else self.size
        return float(np.sum(size))

    @property
    def blocks(self) -> int:
        """Number m of free blocks."""
        return len(self.free)

    @property
    def points(self) -> int:
        """Number q of contact points that matter."""
        return len(self.used)

    def own(self, residual: Floats) -> Floats:
        """(m,) the larger of each block's residual force and moment, in its own weight (times its own diagonal)."""
        rows = residual.reshape(-1, 6)
        force, moment = np.linalg.norm(rows[:, :3], axis=1), np.linalg.norm(rows[:, 3:], axis=1)
        return np.asarray(np.maximum(force, moment / self.diagonal) / self.weight)

    @property
    def lighter(self) -> Floats:
        """(q,) scaled own weight of the lighter free block at each point."""
        beside = np.append(self.weight, np.inf)  # the last for fixed blocks, which are numbered -1
        return np.asarray(np.minimum(beside[self.row_a], beside[self.row_b]))

    def gap(self, y: Floats) -> Floats:
        """(q, 3) dd = A' y."""
        return np.asarray(self.across @ y).reshape(-1, 3)

    def residual(self, f: Floats) -> Floats:
        """(6 m,) A f + p."""
        return np.asarray(self.A @ f.ravel() + self.p)

    def still(self, y: Floats) -> Floats:
        """(6 m,) y with zeros where supports hold."""
        return np.where(self.held.ravel(), 0.0, y) if self.held.any() else y

    def true_forces(self, f: Floats) -> Floats:
        """(q, 3) what the contacts really bear: f without the shift by which the cones begin at zero."""
        if not self.pull.any():
            return f
        shifted = f.copy()
        shifted[:, 0] -= self.pull
        return shifted


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
    wrench = np.zeros((len(assembly), 6))
    wrench[:, :3] = (assembly.densities(density) * assembly.mass.volume)[:, None] * gravity
    if assembly.actions:
        raise InputError("loads: surface loads and body forces have to be resolved before statics (resolved_loads)")
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
    Partial supports and joints that pull are part of the system, see `EquilibriumSystem`.

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
    frame = contacts.frame[patch]
    wrench = body_loads(assembly, gravity, density)[free]
    weight = np.linalg.norm(wrench[:, :3], axis=1)
    force_unit = float(np.mean(weight)) if weight.any() else 1.0
    length_unit = float(np.mean(np.cbrt(np.abs(assembly.mass.volume[free])))) if len(free) else 1.0
    centre, point = assembly.mass.centroid, contacts.point[used]
    a, b = contacts.a[patch], contacts.b[patch]
    arm_a, arm_b = (point - centre[a]) / length_unit, (point - centre[b]) / length_unit
    p = wrench / force_unit
    p[:, 3:] /= length_unit
    matrix = contact_matrix(len(free), row[a], row[b], arm_a, arm_b, frame)
    mass = (assembly.densities(density) * assembly.mass.volume)[free]
    own = mass * (float(np.linalg.norm(gravity)) or STANDARD_GRAVITY)
    low, high = _boxes(assembly, free)
    diagonal = np.asarray(np.linalg.norm(high - low, axis=1))
    sides, units = (row[a], row[b], arm_a, arm_b, frame), (force_unit, length_unit)
    sizes = own / force_unit, diagonal / length_unit
    system = EquilibriumSystem(free, used, *sides, contacts.mu[patch], matrix, p.ravel(), *units, *sizes)
    held = held_directions(assembly)[free]
    if held.any():
        system = partly_held(system, held, _free_size(assembly, free, held, gravity, density) / force_unit)
    return _pulling(system, contacts.pull[used] / force_unit) if contacts.strength.any() else system


def _boxes(assembly: Assembly, which: Ints) -> tuple[Floats, Floats]:
    """(m, 3) m lower and upper corners of the boxes around some blocks."""
    mesh = assembly.mesh
    if not len(which):
        return np.zeros((0, 3)), np.zeros((0, 3))
    first = mesh.vertex_start[:-1]
    return np.minimum.reduceat(mesh.vertex, first)[which], np.maximum.reduceat(mesh.vertex, first)[which]


def partly_held(system: EquilibriumSystem, held: Bools, size: Floats) -> EquilibriumSystem:
    """The system with rows of zeros where partial supports hold."""
    matrix = (sp.diags((~held.ravel()).astype(float)) @ system.A).tocsr()
    matrix.eliminate_zeros()
    return replace(system, A=matrix, p=np.where(held.ravel(), 0.0, system.p), held=held, size=size)


def _free_size(assembly: Assembly, free: Ints, held: Bools, gravity: Floats, density: float) -> Floats:
    """(m,) N: sizes of weight and loads, of partly held blocks only what the supports leave.

    As the checker of certificates has it: a load on a block that may turn counts in full, for its moment does work.
    """
    plain = np.linalg.norm(body_loads(assembly, gravity, density)[free, :3], axis=1)
    place = {int(i): k for k, i in enumerate(free)}
    size, mass = plain.copy(), assembly.densities(density) * assembly.mass.volume
    for k in np.flatnonzero(held.any(1)).tolist():
        size[k] = mass[free[k]] * np.linalg.norm(np.where(held[k, :3], 0.0, gravity))
    for load in assembly.loads:
        k = place.get(load.block, -1)
        if k >= 0 and held[k].any():
            left = np.where(held[k, :3], 0.0, load.force) if held[k, 3:].all() else load.force
            size[k] += np.linalg.norm(left)
    return np.asarray(size)


def _pulling(system: EquilibriumSystem, pull: Floats) -> EquilibriumSystem:
    """The system in f + pull n: |ft| <= mu (fn + pull) is an ordinary cone, and A (f + pull n) = -(p - A (pull n))."""
    relied = pull - (1.0 - RELIED) * np.abs(pull)
    along = np.zeros((len(pull), 3))
    along[:, 0] = relied
    size = np.linalg.norm(system.p.reshape(-1, 6)[:, :3], axis=1) if system.size is None else system.size
    return replace(system, p=system.p - system.A @ along.ravel(), pull=relied, size=size)


def contact_matrix(blocks: int, row_a: Ints, row_b: Ints, arm_a: Floats, arm_b: Floats, frame: Floats) -> Any:
    """A, (6 m, 3 q) csr, of points with these frames and arms; rows and units as in `EquilibriumSystem`."""
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
