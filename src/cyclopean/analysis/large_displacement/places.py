"""A model whose blocks have moved: contact points are carried by both blocks that they join."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.settings import Settings
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Contacts, Load
from cyclopean.geometry import frames_from_normals, rotations
from cyclopean.statics import EquilibriumSystem, contact_matrix

__all__ = ["TOUCHES", "Displaced", "Place", "degrees"]

TOUCHES = 1e-7  # of the length unit (mean V^(1/3)): a point that is further open bears nothing
STRIP = 0.2  # of the tolerance: how far a point beside a hinge may gape
WIDEST = 1e-2  # of the distance to its neighbour: how far it is from the hinge
ROUNDS = 12  # of the correction that keeps points in touch


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where all blocks are."""

    centre: Floats  # (n, 3)
    turn: Floats  # (n, 3, 3)

    def moved(self, blocks: Ints, motion: Floats) -> "Place":
        """After finite rigid motions (m, 6) of some blocks: v along, then w (radians) about the centre of mass."""
        centre, turn = self.centre.copy(), self.turn.copy()
        centre[blocks] += motion[:, :3]
        turn[blocks] = rotations(motion[:, 3:]) @ turn[blocks]
        return Place(centre, turn)


class Displaced:
    """Where contact points and loads are once blocks have moved."""

    def __init__(self, model: PreparedModel) -> None:
        self.model, assembly = model, model.assembly
        self.base = model.system()
        contacts = model.contacts
        self.patch = patch = contacts.patch[self.base.used]
        self.a, self.b = contacts.a[patch], contacts.b[patch]
        point = contacts.point[self.base.used]
        self.arm_a = point - assembly.mass.centroid[self.a]
        self.arm_b = point - assembly.mass.centroid[self.b]
        self.normal = contacts.frame[patch, 0]
        self.mass = model.mass

    @property
    def unit(self) -> float:
        """m: the length unit of the equilibrium system."""
        return self.base.length_unit

    def start(self) -> Place:
        """Where all blocks are at first."""
        count = len(self.model.assembly)
        return Place(self.model.assembly.mass.centroid.copy(), np.tile(np.eye(3), (count, 1, 1)))

    def ends(self, place: Place) -> tuple[Floats, Floats, Floats]:
        """(q, 3) each contact point as block a carries it and as b does, and the normal between both faces."""
        pa = place.centre[self.a] + np.einsum("qij,qj->qi", place.turn[self.a], self.arm_a)
        pb = place.centre[self.b] + np.einsum("qij,qj->qi", place.turn[self.b], self.arm_b)
        n = np.einsum("qij,qj->qi", place.turn[self.a] + place.turn[self.b], self.normal)
        return pa, pb, n / np.linalg.norm(n, axis=1)[:, None]

    def gaps(self, place: Place) -> Floats:
        """(q,) how far each point is open, in length units."""
        pa, pb, n = self.ends(place)
        return np.asarray(np.sum((pb - pa) * n, 1) / self.unit)

    def bearing(self, place: Place) -> tuple[Floats, Bools]:
        """(q, 3) m where each contact point bears, and (q,) whether it does: half-way between both blocks' own."""
        pa, pb, _ = self.ends(place)
        return (pa + pb) / 2.0, np.ones(len(pa), bool)

    def system(self, place: Place, touching: Ints) -> EquilibriumSystem:
        """The equilibrium system over some points, by index; its loads are those of the model at rest."""
        n = self.ends(place)[2][touching]
        base, unit = self.base, self.unit
        point, frame = self.bearing(place)[0][touching], frames_from_normals(n)
        arm_a = (point - place.centre[self.a[touching]]) / unit
        arm_b = (point - place.centre[self.b[touching]]) / unit
        row_a, row_b = base.row_a[touching], base.row_b[touching]
        A: Any = contact_matrix(base.blocks, row_a, row_b, arm_a, arm_b, frame)
        if base.held.any():
            import scipy.sparse as sp

            A = (sp.diags((~base.held.ravel()).astype(float)) @ A).tocsr()
        return replace(
            base,
            used=base.used[touching],
            row_a=row_a,
            row_b=row_b,
            arm_a=arm_a,
            arm_b=arm_b,
            frame=frame,
            mu=base.mu[touching],
            A=A,
            pull=np.zeros(0),
            size=None,
        )

    def wrench(self, place: Place, gravity: Floats, loads: tuple[Load, ...]) -> Floats:
        """(6 m,) scaled; points of loads move with their blocks."""
        wrench = np.zeros((len(self.mass), 6))
        wrench[:, :3] = self.mass[:, None] * gravity
        for load in loads:
            wrench[load.block, :3] += load.force
            arm = self.carried(place, load.block, load.point) - place.centre[load.block]
            wrench[load.block, 3:] += np.cross(arm, load.force)
        scaled = wrench[self.base.free] / self.base.force_unit
        scaled[:, 3:] /= self.unit
        return self.base.still(scaled.ravel())

    def world(self, y: Floats) -> Floats:
        """(m, 6) m and rad a unit of time, from scaled velocities."""
        motion = self.base.still(y).reshape(-1, 6).copy()
        motion[:, :3] *= self.unit
        return motion

    def kept(self, place: Place, active: Ints, sticks: Bools, offset: Floats) -> Place:
        """Least motions (m, rad) that close the active points again, and bring those that stick back together."""
        from scipy.sparse.linalg import lsmr

        unit = self.unit
        for _ in range(ROUNDS):
            pa, pb, _ = (x[active] for x in self.ends(place))
            system = self.system(place, active)
            apart = np.einsum("qij,qj->qi", system.frame, pb - pa) / unit
            was = np.einsum("qij,qj->qi", system.frame, offset) / unit
            miss = np.where(sticks[:, None], apart - was, 0.0)
            miss[:, 0] = apart[:, 0]
            if float(np.max(np.abs(miss), initial=0.0)) <= 1e-12:
                break
            wanted = np.repeat(sticks[:, None], 3, 1)
            wanted[:, 0] = True
            rows = np.flatnonzero(wanted.ravel())
            step = lsmr(system.A.T.tocsr()[rows], -miss.ravel()[rows], atol=1e-13, btol=1e-13, maxiter=2000)[0]
            correction = self.base.still(step).reshape(-1, 6).copy()
            correction[:, :3] *= unit
            place = place.moved(self.base.free, correction)
        return place

    def displaced(self, place: Place, settings: Settings) -> tuple[Assembly, Settings]:
        """The blocks as they stand at a place, and the contacts that are left, for `check` and `limit`.

        A joint that has opened about an edge is given as a narrow strip along that edge, within the tolerance of both
        faces; one that has parted is left out. `settings` are those of the model before.
        """
        model = self.model
        old, origin = model.assembly, model.assembly.mass.centroid
        blocks = tuple(
            replace(
                block,
                vertices=place.centre[i] + (block.vertices - origin[i]) @ place.turn[i].T,
                fixed=bool(model.fixed[i]),
            )
            for i, block in enumerate(old.blocks)
        )
        loads = tuple(replace(load, point=self.carried(place, load.block, load.point)) for load in old.loads)
        moved = replace(
            old, blocks=blocks, contacts=self._left(place), loads=loads, settlements=(), combinations=(), actions=()
        )
        x, y, z = model.gravity.tolist()
        plain = Settings(method="rbe", gravity=(x, y, z), density=model.density, tolerance=settings.tolerance)
        return moved, plain

    def carried(self, place: Place, block: int, point: Floats) -> Floats:
        """(3,) m: where a point of a block has gone."""
        away = point - self.model.assembly.mass.centroid[block]
        return np.asarray(place.centre[block] + place.turn[block] @ away)

    def _left(self, place: Place) -> Contacts:
        """What still touches."""
        contacts, gaps = self.model.contacts, self.gaps(place)
        point, bears = self.bearing(place)
        pairs, polygons, friction = [], [], []
        for k in np.unique(self.patch):
            here = np.flatnonzero(self.patch == k)
            shut = here[(gaps[here] <= 10.0 * TOUCHES) & bears[here]]
            if not len(shut):
                continue
            corners = point[here].copy()
            for row, other in enumerate(here):
                if other not in shut:
                    hinge = shut[int(np.argmin(np.linalg.norm(point[shut] - point[other], axis=1)))]
                    strip = min(WIDEST, STRIP * self.model.tolerance / (gaps[other] * self.unit))
                    corners[row] = point[hinge] + strip * (point[other] - point[hinge])
            pairs.append((int(contacts.a[k]), int(contacts.b[k])))
            polygons.append(corners)
            friction.append(float(contacts.mu[k]))
        return Contacts.of(pairs, polygons, friction)


def degrees(turn: Floats) -> float:
    """Angle of a rotation (3, 3) in degrees."""
    off = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return float(np.rad2deg(np.arctan2(np.linalg.norm(off), np.trace(turn) - 1.0)))
