"""A motion that no drawing of a family resists, and in which its loads do work in every one.

Every contact opens by more than another drawing may take from it, or its blocks move as one body: then nothing happens
there, wherever it lies and however it leans. Such bodies are found in a mechanism of the model as it is.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.equilibrium.reference import solve_program
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.robust.family import Family, swelling, warps
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Contacts
from cyclopean.geometry import packed
from cyclopean.solvers import Cone, ConicProgram
from cyclopean.statics import EquilibriumSystem

__all__ = ["bodies", "falling"]

STILL = (1e-6, 1e-2)  # of the largest speed: what moves less, or moves less apart, is taken to stand or to move as one
LARGEST = 600  # bodies that move; beyond, one programme takes a minute
SPARE = 1e-8  # of the fastest body's speed, by which contacts open more than they have to: solvers are as good as that
WORK = 1e-9  # of weights times the fastest body: the least that loads may do in every drawing


def bodies(system: EquilibriumSystem, motion: Floats) -> Iterator[Ints]:
    """(m,) the rigid body that each free block belongs to, -1 = at rest; several ways to see a mechanism.

    Parameters
    ----------
    system : EquilibriumSystem
        m free of n blocks.
    motion : (n, 6)
        Velocities of its centres of mass, spins.
    """
    rows = motion[system.free]
    reach = system.length_unit * system.diagonal
    speed = np.linalg.norm(rows[:, :3], axis=1) + reach * np.linalg.norm(rows[:, 3:], axis=1)
    scaled = rows * np.array([1.0, 1.0, 1.0, *[system.length_unit] * 3])
    apart = np.linalg.norm(system.gap(scaled.ravel()), axis=1)
    seen: set[bytes] = set()
    for still in STILL:
        moves = speed > still * speed.max()
        for alike in (apart <= still * speed.max(), np.zeros(len(apart), bool)):
            label = _joined(system, moves, alike)
            if label.tobytes() not in seen and 0 <= label.max(initial=-1) < LARGEST:
                seen.add(label.tobytes())
                yield label


def _joined(system: EquilibriumSystem, moves: Bools, alike: Bools) -> Ints:
    """Bodies of the blocks that move: those join of which no point between them moves apart."""
    pairs = np.stack([system.row_a, system.row_b], 1)
    inside = (pairs >= 0).all(1) & moves[pairs].all(1)
    apart = {(a, b) for a, b in pairs[inside & ~alike].tolist()}
    kept = np.array([pair for pair in pairs[inside].tolist() if tuple(pair) not in apart], np.int64).reshape(-1, 2)
    label = packed.components(system.blocks, kept[:, 0], kept[:, 1])
    label[moves] = np.unique(label[moves], return_inverse=True)[1]
    label[~moves] = -1
    return label


@dataclass(frozen=True, slots=True, eq=False)
class _Bodies:
    """Rigid bodies made of free blocks, with motions z (6 g,): velocities of their middles, spins times the unit."""

    system: EquilibriumSystem
    label: Ints  # (m,) of each free block; -1 = at rest
    middle: Floats  # (g, 3) m
    matrix: Any  # (6 m, 6 g) motions of the blocks of those of the bodies

    @classmethod
    def of(cls, model: PreparedModel, system: EquilibriumSystem, label: Ints) -> "_Bodies":
        moves, count = np.flatnonzero(label >= 0), int(label.max()) + 1
        centre, at = model.assembly.mass.centroid[system.free], label[moves]
        weight = np.bincount(at, minlength=count)
        middle = np.stack([np.bincount(at, centre[moves, k], count) / weight for k in range(3)], 1)
        arm = (centre[moves] - middle[at]) / system.length_unit
        turn = np.cross(np.eye(3)[None], arm[:, None])  # rows e_k x arm
        parts = np.tile(np.eye(6), (len(moves), 1, 1))
        parts[:, :3, 3:] = turn.transpose(0, 2, 1)
        six = np.arange(6)
        rows = np.broadcast_to(6 * moves[:, None, None] + six[:, None], parts.shape)
        columns = np.broadcast_to(6 * at[:, None, None] + six, parts.shape)
        shape = (6 * system.blocks, 6 * count)
        matrix = sp.csr_matrix((parts.ravel(), (rows.ravel(), columns.ravel())), shape=shape)
        return cls(system, label, middle, matrix)

    def rows(self, z: Floats) -> list[list[float]]:
        """Of every free block, six numbers: velocity of the point of its body at the world's origin, and spin (1/m).

        Blocks of one body have the same ones, to the last bit.
        """
        pairs = z.reshape(-1, 6) / max(float(np.max(np.abs(z))), 1e-300)
        spin = pairs[:, 3:] / self.system.length_unit
        found = np.concatenate([pairs[:, :3] - np.cross(spin, self.middle), spin], 1)
        rows: list[list[float]] = np.where(self.label[:, None] >= 0, found[self.label], 0.0).tolist()
        return rows


def falling(model: PreparedModel, system: EquilibriumSystem, label: Ints, family: Family) -> dict[str, Any] | None:
    """What a certificate holds that the model falls in every drawing of a family; None where no such motion was found.

    Parameters
    ----------
    model : PreparedModel
        It falls as it is.
    system : EquilibriumSystem
        Of it, with m free blocks.
    label : (m,)
        Rigid bodies that they make, as `bodies` finds them.
    family : Family
        By how much drawings differ.
    """
    group = _Bodies.of(model, system, label)
    opening = _opening(model, group, family)
    if opening is None:
        return None
    shape, joints = group.matrix.shape[1], opening[1]
    power, work = _power(model, group, family, shape + joints)
    n = power.shape[1]

    def wide(matrix: Any) -> Any:
        return sp.hstack([matrix, sp.csr_matrix((matrix.shape[0], n - matrix.shape[1]))])

    ball = sp.vstack([sp.csr_matrix((1, shape)), -sp.identity(shape)])
    parts = [wide(part) for part in (*opening[0], ball)]
    A = sp.vstack([power, *parts], format="csc")
    b = np.zeros(A.shape[0])
    b[power.shape[0] : power.shape[0] + opening[0][0].shape[0] : 3] = -SPARE
    b[len(b) - shape - 1] = 1.0
    q = np.zeros(n)
    q[-1] = -1.0
    cones: tuple[Cone, ...] = (*work, *opening[2], ("second-order", shape + 1, 1))
    kept = tuple(cone for cone in cones if cone[1] * cone[2])
    answer = solve_program(ConicProgram(sp.csc_matrix((n, n)), q, A, b, kept), system.blocks)
    if not np.isfinite(answer.x).all() or not answer.x[-1] > WORK * max(system.total, 1e-300):
        return None
    names = [model.assembly.blocks[i].id for i in system.free]
    motions = dict(zip(names, group.rows(answer.x[:shape]), strict=True))
    return {"within": family.entry(), "motions": motions}


def _opening(model: PreparedModel, group: _Bodies, family: Family) -> tuple[list[Any], int, tuple[Cone, ...]] | None:
    """Rows and cones in (z, s) that keep contacts open, and how many s, the sizes of relative spins, there are.

    With mu' the friction at normals that lean, dn - sqrt(1 + mu'^2) e s >= mu' |dd_t| at every corner, e how far it may
    get. None where some contact between two bodies may resist anything.
    """
    system, contacts = group.system, model.contacts
    beside = np.append(group.label, -1)
    patch = contacts.patch[system.used]
    corner = np.flatnonzero(beside[system.row_a] != beside[system.row_b])
    known, joint = np.unique(patch[corner], return_inverse=True)
    lean = family.leans(contacts)[known]
    if not (contacts.mu[known] * lean < 1.0).all():
        return None
    mu = (contacts.mu[known] + lean) / (1.0 - contacts.mu[known] * lean)
    warp = warps(contacts)
    far = np.concatenate([np.zeros(0), *(_far(contacts, int(k), family.length, float(warp[k])) for k in known)])
    hull = np.flatnonzero(far > 0.0)
    corner, joint, far = corner[hull], joint[hull], far[hull] / system.length_unit
    count, g = len(known), group.matrix.shape[1]
    gap = (system.A.T @ group.matrix)[(3 * corner[:, None] + np.arange(3)).ravel()]
    stretch = np.ones((len(corner), 3))
    stretch[:, 1:] = mu[joint][:, None]
    lost = sp.csr_matrix(
        (np.sqrt(1.0 + mu[joint] ** 2) * far, (3 * np.arange(len(corner)), joint)), shape=(3 * len(corner), count)
    )
    cones = sp.hstack([sp.diags(-stretch.ravel()) @ gap, lost])
    one = np.unique(joint, return_index=True)[1]
    spin = np.zeros((4 * count, g))
    for j, k in enumerate(corner[one].tolist()):
        for end, sign in ((beside[system.row_a[k]], 1.0), (beside[system.row_b[k]], -1.0)):
            if end >= 0:
                spin[4 * j + 1 : 4 * j + 4, 6 * end + 3 : 6 * end + 6] += sign * np.eye(3)
    size = sp.csr_matrix((np.full(count, -1.0), (4 * np.arange(count), np.arange(count))), shape=(4 * count, count))
    spins = sp.hstack([sp.csr_matrix(spin), size])
    return [cones, spins], count, (("second-order", 3, len(corner)), ("second-order", 4, count))


def _far(contacts: Contacts, k: int, length: float, warp: float) -> Floats:
    """(p,) m: how far each corner of a contact may get, 0 for those that are no corners of its convex outline."""
    import shapely

    ring = contacts.polygon(k)
    flat = (ring - ring[0]) @ contacts.only(np.array([k])).frame[0, 1:].T
    outline = shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(flat)))[:-1]
    back, on = np.roll(outline, 1, 0) - outline, np.roll(outline, -1, 0) - outline
    cosine = np.einsum("ij,ij->i", back, on) / (np.linalg.norm(back, axis=1) * np.linalg.norm(on, axis=1))
    aside = length * np.sqrt(2.0 / np.maximum(1.0 - cosine, 1e-12))
    reach = dict(zip(map(tuple, outline), np.hypot(aside, length + warp).tolist(), strict=True))
    return np.array([reach.get(tuple(x), 0.0) for x in flat])


def _power(model: PreparedModel, group: _Bodies, family: Family, first: int) -> tuple[Any, tuple[Cone, ...]]:
    """Rows and cones that keep the least work of the loads in any drawing above the last unknown, t.

    Unknowns from `first` on bound |g.v| of every block, |(g x w)_k| of every body, |F x w| of every load; then t.
    """
    system, label, gravity = group.system, group.label, model.gravity
    unit, bodies_, moving = system.length_unit, len(group.middle), np.flatnonzero(label >= 0)
    number = {int(block): i for i, block in enumerate(system.free)}
    loads = [x for x in model.assembly.loads if x.block in number and label[number[x.block]] >= 0]
    volume, moment = (x[system.free] for x in swelling(model.assembly, family.length))
    density = model.assembly.densities(model.density)[system.free]
    count = (len(moving), 3 * bodies_, len(loads))
    n = first + sum(count) + 1
    swung = np.zeros((bodies_, 3))
    np.add.at(swung, label[moving], (density[:, None] * moment)[moving])
    price = np.concatenate(
        [(density * volume)[moving], swung.ravel() / unit, np.full(len(loads), family.length / unit)]
    )
    wide = sp.lil_matrix((1 + 2 * (count[0] + count[1]) + 4 * count[2], n))
    wide[0, : group.matrix.shape[1]] = -(system.p @ group.matrix)
    wide[0, first : n - 1] = price / system.force_unit
    wide[0, n - 1] = 1.0
    speeds = sp.csr_matrix(np.kron(np.eye(system.blocks), np.append(gravity, np.zeros(3))[None])) @ group.matrix
    turn = -np.cross(np.eye(3), gravity).T  # g x w = turn w
    level = sp.vstack([speeds[moving], sp.block_diag([np.hstack([np.zeros((3, 3)), turn])] * bodies_)]).tocsr()
    for i in range(count[0] + count[1]):
        for row, sign in ((1 + 2 * i, 1.0), (2 + 2 * i, -1.0)):
            wide[row, : level.shape[1]] = sign * level[i]
            wide[row, first + i] = -1.0
    for i, load in enumerate(loads):
        row, body = 1 + 2 * (count[0] + count[1]) + 4 * i, int(label[number[load.block]])
        wide[row, first + count[0] + count[1] + i] = -1.0
        wide[row + 1 : row + 4, 6 * body + 3 : 6 * body + 6] = np.cross(np.eye(3), load.force).T
    return wide.tocsr(), (("nonnegative", 1 + 2 * (count[0] + count[1]), 1), ("second-order", 4, len(loads)))
