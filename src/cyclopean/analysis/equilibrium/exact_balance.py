"""What is left of the balance of every block, rounded once, and how much that is of the block's own weight.

Forces come as sums of two doubles. Products are split without error (Dekker 1971), sums are those of `math.fsum`, and
weights and first moments are exact (`geometry.exact_moments`): next to a force of 1e9 own weights a small stone's
balance still has its digits.

By hand: 0.1 x 0.1 = 0.01 + 8.67e-19 - 2.08e-19..., whose second part `product` returns.

>>> high, low = product(np.array([0.1]), np.array([0.1]))
>>> float(high[0]), float(low[0])
(0.010000000000000002, -8.326672684688674e-19)
"""

from dataclasses import dataclass
from math import fsum
from typing import Any

import numpy as np

from cyclopean.analysis.preparation import PreparedModel
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Contacts
from cyclopean.geometry.exact_moments import exact_area_vectors, exact_moments, expanded, on_grid
from cyclopean.statics import EquilibriumSystem

__all__ = ["Balance", "Parts", "exact_balance", "own_loads", "product", "rounding_of_normals", "stretched", "total"]

Parts = tuple[Floats, Floats | None]  # (q, 3) N each, a force is their sum; None = zero

STANDARD_GRAVITY = 9.80665  # m/s2; stands in for the size of a gravity that is zero
_SPLIT = 134217729.0  # 2^27 + 1


def total(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Sum without error (Knuth), each number by itself: a + b = high + low, high rounded."""
    high = a + b
    there = high - a
    return high, (a - (high - there)) + (b - there)


def product(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Product of each number without error (Dekker): a b = high + low, high rounded, if nothing over- or underflows."""
    high = a * b
    x, y = _SPLIT * a, _SPLIT * b
    a1, b1 = x - (x - a), y - (y - b)
    a2, b2 = a - a1, b - b1
    return high, ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """The loads of every free block as they are, and the points at which forces act on it (m blocks, q points).

    At a joint without friction a force is x N, with N twice the area vector of the joint's polygon, exact: of the rows
    of `Parts` the first number is then x (N/m2), the others are zero.
    """

    weight: Floats  # (m,) N: w = rho V |g|, of standard gravity where there is none
    diagonal: Floats  # (m,) m: D, the diagonal of the block's box
    centre: Floats  # (m, 3) m
    size: Floats  # (m,) N: weight as it acts, and given loads
    own_load: Floats  # (m, 6, j) N, N m about the world's origin: own weight, as sums of j doubles
    held: Bools  # (m, 6)
    sliding: Bools  # (q,) points of joints without friction
    normal: Floats  # (q, 3 components, 3 doubles) m2: N of those points, zero elsewhere
    area: Floats  # (q,) m2: |N|, 1 of a contact at a point
    blur: Floats  # (q,) angle by which rounding may turn the normal of the joint
    joint: Ints  # (q,) which polygon of the model
    width: Floats  # (q,) m: of the joint, about; less than its smaller side; 0 of a point
    point: Floats  # (q + l, 3) m: contact points used, then those of loads
    push: Floats  # (l, 3) N: loads
    entry: Ints  # (e,) row of `point`, sorted by block
    sign: Floats  # (e, 1)
    start: Ints  # (m + 1,) offsets of the blocks into `entry`

    def forces(self, parts: Parts) -> list[Floats]:
        """(q, 3) N doubles whose sum is the force on block b at each point."""
        high, low = parts
        if not self.sliding.any():
            return [high] if low is None else [high, low]
        at = self.sliding
        axial = stretched(self.normal[at], high[at, :1], None if low is None else low[at, :1])
        made = [np.zeros_like(high) for _ in axial]
        made[0][~at] = high[~at]
        if low is not None:
            made[1][~at] = low[~at]
        for one, along in zip(made, axial, strict=True):
            one[at] = along
        return made

    def residual(self, parts: Parts) -> Floats:
        """(m, 6) N, N m: sum of forces on every block, and of their moments about its centre of mass."""
        terms: list[list[Floats]] = [[] for _ in range(6)]
        for i, force in enumerate(self.forces(parts)):
            given = self.push if i == 0 else np.zeros_like(self.push)
            pull = np.concatenate([force, given])[self.entry] * self.sign
            if not pull.any():
                continue
            at = self.point[self.entry]
            for k in range(3):
                n, p = (k + 1) % 3, (k + 2) % 3
                terms[k].append(pull[:, k])
                for one, other, sign in ((n, p, 1.0), (p, n, -1.0)):
                    terms[3 + k] += [sign * x for x in product(at[:, one], pull[:, other])]
        off = np.stack([self._summed(terms[k], self.own_load[:, k]) for k in range(6)], 1)
        off[:, 3:] -= np.cross(self.centre, off[:, :3])
        return np.where(self.held, 0.0, off)

    def _summed(self, terms: list[Floats], load: Floats) -> Floats:
        """(m,) rounded sums over each block of its rows of (e,) terms and its (m, j) load."""
        count = len(terms)
        flat = np.stack(terms, 1).ravel().tolist() if count else []
        bounds, loads = (count * self.start).tolist(), load.tolist()
        return np.array([fsum(flat[i:j] + own) for i, j, own in zip(bounds, bounds[1:], loads, strict=False)], float)

    def own(self, residual: Floats) -> Floats:
        """(m, 2): the residual force in own weights, the residual moment in own weights times own diagonals."""
        force, moment = (np.linalg.norm(residual[:, i : i + 3], axis=1) for i in (0, 3))
        return np.stack([force / self.weight, moment / (self.weight * self.diagonal)], 1)


def stretched(normal: Floats, high: Floats, low: Floats | None) -> list[Floats]:
    """(high + low) N as sums of three doubles: (k, 3, 3) N, (k, 1) factors; what is lost is some 2^-150 of it."""
    first, second, third = (normal[:, :, j] for j in range(3))
    one, rest = product(high, first)
    two, last = product(high, second)
    middle, small = total(rest, two)
    small = small + last + high * third
    if low is not None:
        more, last = product(low, first)
        middle, extra = total(middle, more)
        small = small + extra + last + low * second
    one, middle = total(one, middle)
    middle, small = total(middle, small)
    return [one, middle, small]


def exact_balance(model: PreparedModel, system: EquilibriumSystem) -> Balance:
    """Prepare the balance of the free blocks of a system, in world units.

    Parameters
    ----------
    model : PreparedModel
        Its blocks, contacts, gravity and loads.
    system : EquilibriumSystem
        Says which blocks are free and which points are used.
    """
    assembly, contacts, gravity = model.assembly, model.contacts, model.gravity
    free, m = system.free, system.blocks
    six, moment, k = moments = exact_moments(assembly.mesh, free)
    given = assembly.densities(model.density)[free]
    volume = expanded(six, 3 * k, 6)[:, 0]
    size = float(np.linalg.norm(gravity))
    corner = assembly.mesh.vertex_start[:-1]
    box = np.maximum.reduceat(assembly.mesh.vertex, corner) - np.minimum.reduceat(assembly.mesh.vertex, corner)
    weight = given * volume * (size or STANDARD_GRAVITY)
    acting = [one for one in assembly.loads if one.block in set(free.tolist())]
    push = np.array([one.force for one in acting], float).reshape(-1, 3)
    pushed = np.searchsorted(free, np.array([one.block for one in acting], np.int64))
    entry, sign, start = _entries(system, pushed)
    sliding, normal, area = _sliding(contacts, system)
    joint, across = contacts.patch[system.used], _diagonals(contacts)
    return Balance(
        weight,
        np.asarray(np.linalg.norm(box[free], axis=1)),
        expanded(moment, 4 * k, 24)[:, :, 0] / volume[:, None],
        given * volume * size + np.bincount(pushed, np.linalg.norm(push, axis=1), m),
        _own_loads(moments, given, gravity),
        system.held if len(system.held) else np.zeros((m, 6), bool),
        sliding,
        normal,
        area,
        rounding_of_normals(contacts)[joint],
        joint,
        0.5 * area / np.where(across > 0.0, across, np.inf)[joint],
        np.concatenate([contacts.point[system.used], np.array([one.point for one in acting], float).reshape(-1, 3)]),
        push,
        entry,
        sign,
        start,
    )


def own_loads(model: PreparedModel, free: Ints, gravity: Floats) -> Floats:
    """(m, 6, j) N, N m about the world's origin: weight of (m,) free blocks under (3,) gravity, sums of j doubles."""
    return _own_loads(exact_moments(model.assembly.mesh, free), model.assembly.densities(model.density)[free], gravity)


def _own_loads(moments: tuple[Any, Any, int], density: Floats, gravity: Floats) -> Floats:
    six, moment, k = moments
    mass, rho_bits = on_grid(density)
    pull, g_bits = on_grid(np.asarray(gravity, float))
    bits = k + rho_bits + g_bits
    x, y, z = (mass[:, None] * moment).T
    turning = np.stack([y * pull[2] - z * pull[1], z * pull[0] - x * pull[2], x * pull[1] - y * pull[0]], 1)
    weight = expanded((mass * six)[:, None] * pull[None, :], bits + 2 * k, 6)
    return np.concatenate([weight, expanded(turning, bits + 3 * k, 24)], 1)


def _entries(system: EquilibriumSystem, pushed: Ints) -> tuple[Ints, Floats, Ints]:
    """Which rows of points and loads act on each block, with which sign."""
    b, a = np.flatnonzero(system.row_b >= 0), np.flatnonzero(system.row_a >= 0)
    entry = np.concatenate([b, a, system.points + np.arange(len(pushed))])
    block = np.concatenate([system.row_b[b], system.row_a[a], pushed])
    sign = np.ones(len(entry))
    sign[len(b) : len(b) + len(a)] = -1.0
    order = np.argsort(block, kind="stable")
    return entry[order], sign[order, None], np.searchsorted(block[order], np.arange(system.blocks + 1))


def _sliding(contacts: Contacts, system: EquilibriumSystem) -> tuple[Bools, Floats, Floats]:
    """Points of joints without friction, and their area vectors."""
    sliding = np.zeros(system.points, bool)
    normal = np.zeros((system.points, 3, 3))
    if not len(contacts):
        return sliding, normal, np.zeros(0)
    patch = contacts.patch[system.used]
    sliding = contacts.mu[patch] == 0.0
    wanted = np.unique(patch[sliding])
    if len(wanted):
        some = contacts.only(wanted)
        vectors, k = exact_area_vectors(some.point, some.start)
        whole = expanded(vectors, 2 * k)
        whole[some.at_points, :, 0] = some.normal_given[some.at_points]  # and nothing beyond a double
        normal[sliding] = whole[np.searchsorted(wanted, patch[sliding])]
    return sliding, normal, contacts.scale[patch]


def rounding_of_normals(contacts: Contacts) -> Floats:
    """(c,) angle by which rounding may turn the normal of each patch: worse the thinner it is, 0 where it is given."""
    if not len(contacts):
        return np.zeros(0)
    return np.asarray(4e-16 * _diagonals(contacts) ** 2 / np.where(contacts.at_points, 1.0, contacts.area))


def _diagonals(contacts: Contacts) -> Floats:
    """(c,) m: of the box of each patch."""
    if not len(contacts):
        return np.zeros(0)
    low = np.minimum.reduceat(contacts.point, contacts.start[:-1], axis=0)
    high = np.maximum.reduceat(contacts.point, contacts.start[:-1], axis=0)
    return np.asarray(np.linalg.norm(high - low, axis=1))
