"""Structures in the plane: half the points and half the unknowns of a model that is its own mirror image.

Where every normal and every load lies in one direction of planes, and the points of each joint lie as far on one side
of the plane through the centres of mass as on the other, forces may be taken to be the same on both sides: mirror any
that balance the loads, and take the mean. So one point stands for those behind each other, and bears their sum; what
blocks do across the plane is held.
"""

from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.statics.equilibrium import EquilibriumSystem, contact_matrix, partly_held

__all__ = ["PlaneSystem", "plane_system"]

FLAT = 1e-12  # by how much normals, lengths and loads may be out of the plane: of the smaller block, of a block's own
ALIKE = 9  # decimals of the smaller block's diagonal by which points behind each other are looked for
SQUARE = 1e-3  # sine of the angle between two vectors from which they say where the plane lies
ACROSS = (1, 3, 5)  # rows of a block for what it does across the plane
UPRIGHT = np.array([0.0, 1.0, 0.0])  # the normal of the plane, in its own axes


@dataclass(frozen=True, slots=True, eq=False)
class PlaneSystem:
    """A system in axes of which the second is the normal of the plane, with one point for those behind each other."""

    system: EquilibriumSystem
    turn: Floats  # (3, 3) rows are these axes
    place: Ints  # (q,) the point that stands for each of the whole
    frame: Floats  # (q, 3, 3) of the whole

    def loads(self, p: Floats) -> Floats:
        """(6 m,) of the whole, in these axes."""
        return (p.reshape(-1, 2, 3) @ self.turn.T).ravel()

    def forces(self, f: Floats) -> Floats:
        """(q, 3) for the whole of those here, shared by the points behind each other."""
        share = f / np.bincount(self.place)[:, None]
        world = np.einsum("qi,qij->qj", share, self.system.frame) @ self.turn
        return np.asarray(np.einsum("qij,qj->qi", self.frame, world[self.place]))

    def motion(self, y: Floats) -> Floats:
        """(6 m,) for the whole."""
        return (self.system.still(y).reshape(-1, 2, 3) @ self.turn).ravel()


def plane_system(system: EquilibriumSystem, *others: Floats) -> PlaneSystem | None:
    """The system in its plane; None where it has none, or is partly held.

    Parameters
    ----------
    system : EquilibriumSystem
        m free blocks, q points.
    *others : (6 m,)
        Loads besides those of the system, which have to lie in the plane as well.
    """
    if not system.points or system.held.any() or system.rows is not None:
        return None
    normal = system.frame[:, 0]
    pushes = [p.reshape(-1, 2, 3) for p in (system.p, *others)]
    across = _across(normal, [p[:, 0] for p in pushes])
    if across is None or any(_out(p[:, 0] @ across, p) or _out(np.cross(p[:, 1], across), p) for p in pushes):
        return None
    turn = np.stack([normal[0], across, np.cross(normal[0], across)])
    arms = np.stack([system.arm_a, system.arm_b]) @ turn.T
    free = np.stack([system.row_a, system.row_b]) >= 0
    own = arms / _smaller(system)[:, None]
    arm = np.where(free[0][:, None], own[0], own[1])
    first, place = _behind(system, np.column_stack([arm[:, [0, 2]], normal @ turn[[0, 2]].T, system.mu]))
    mean = np.bincount(place, arm[:, 1]) / np.bincount(place)
    if np.max(np.abs(mean)) > FLAT or np.max(np.abs(arm - arm[first][place])[:, [0, 2]]) > FLAT:
        return None
    if np.max(np.abs(own[0, :, 1] - own[1, :, 1])[free.all(0)], initial=0.0) > FLAT:
        return None  # centres of mass beside each other are not in one plane
    return PlaneSystem(_flat(system, turn, first, place, arms[:, first]), turn, place, system.frame)


def _out(part: Floats, whole: Floats) -> bool:
    """Whether a part of some blocks' (m, 2, 3) loads is more than rounding of their own."""
    m = len(whole)
    return bool(np.any(np.abs(part).reshape(m, -1) > FLAT * np.max(np.abs(whole), axis=(1, 2))[:, None]))


def _smaller(system: EquilibriumSystem) -> Floats:
    """(q,) scaled diagonal of the smaller free block at each point."""
    size = np.append(system.diagonal, np.inf)  # fixed: -1
    return np.asarray(np.minimum(size[system.row_a], size[system.row_b]))


def _across(normal: Floats, pushes: list[Floats]) -> Floats | None:
    """(3,) the unit vector square to all (q, 3) normals and (m, 3) forces; None where there is none, or any."""
    first = normal[0]
    for vectors in (normal, *pushes):
        square = np.cross(first, vectors)
        size = np.linalg.norm(square, axis=1)
        k = int(np.argmax(size))
        if size[k] > SQUARE * float(np.linalg.norm(vectors[k])):
            across = square[k] / size[k]
            break
    else:
        return None
    flat = np.max(np.abs(normal @ across)) <= FLAT
    return np.asarray(across * np.sign(across[np.argmax(np.abs(across))])) if flat else None


def _behind(system: EquilibriumSystem, look: Floats) -> tuple[Ints, Ints]:
    """One of the points of each row that look the same along the plane, and (q,) which row each belongs to."""
    key = np.column_stack([system.row_a, system.row_b, look.round(ALIKE) + 0.0])
    order = np.lexsort(key.T)
    new = np.ones(len(key), bool)
    new[1:] = (key[order[1:]] != key[order[:-1]]).any(1)
    place = np.zeros(len(key), np.int64)
    place[order] = np.cumsum(new) - 1
    return np.asarray(order[new]), place


def _flat(system: EquilibriumSystem, turn: Floats, first: Ints, place: Ints, arms: Floats) -> EquilibriumSystem:
    """One point of each row, with everything across the plane taken to be zero."""
    arms = arms * (1.0 - UPRIGHT)
    normal = (system.frame[first, 0] @ turn.T) * (1.0 - UPRIGHT)
    frame = np.stack([normal, np.cross(UPRIGHT, normal), np.broadcast_to(UPRIGHT, normal.shape)], 1)
    row_a, row_b = system.row_a[first], system.row_b[first]
    held: Bools = np.zeros((system.blocks, 6), bool)
    held[:, ACROSS] = True
    matrix = contact_matrix(system.blocks, row_a, row_b, arms[0], arms[1], frame)
    rows = system.p.reshape(-1, 2, 3)
    size = np.linalg.norm(rows[:, 0], axis=1) if system.size is None else system.size
    whole = replace(
        system,
        used=system.used[first],
        row_a=row_a,
        row_b=row_b,
        arm_a=arms[0],
        arm_b=arms[1],
        frame=frame,
        mu=system.mu[first],
        A=matrix,
        p=(rows @ turn.T).ravel(),
        pull=np.bincount(place, system.pull).astype(float) if len(system.pull) else system.pull,
    )
    return partly_held(whole, held, np.asarray(size))
