"""A model whose blocks have moved: contact points are carried by both blocks that they join."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from cyclopean.analysis.large_displacement.faces import Bodies, Faces, Touch, within
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.settings import MU, Settings
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Contacts, Load, paired_friction
from cyclopean.geometry import frames_from_normals, rotations
from cyclopean.statics import EquilibriumSystem, contact_matrix

__all__ = ["TOUCHES", "Displaced", "Place", "degrees"]

TOUCHES = 1e-7  # of the length unit (mean V^(1/3)): a point that is further open bears nothing
SLID = 1e-6  # of the length unit: faces that have gone no further along each other meet where they did
BESIDE = 1e-4  # of the length unit: a point that is no further from one that bears is no other
LEANS = 1e-6  # sine: faces that lean no more from each other have one normal
SAID = 1e-4  # rad: faces that lean more from a contact are said to
STRIP = 0.2  # of the tolerance: how far a point beside a hinge may gape
WIDEST = 1e-2  # of the distance to its neighbour: how far it is from the hinge
CLOSINGS = 6  # rounds in which joints are found that would close further than they can
CORRECTIONS = 12  # rounds that keep points in touch


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
        self.contacts = contacts = model.contacts
        self.patch = patch = contacts.patch[self.base.used]
        self.a, self.b = contacts.a[patch], contacts.b[patch]
        point = contacts.point[self.base.used]
        self.arm_a = point - assembly.mass.centroid[self.a]
        self.arm_b = point - assembly.mass.centroid[self.b]
        self.corner_a, self.corner_b = self.arm_a, self.arm_b  # (q, 3) m, of the contacts as they were first
        self.normal_a = self.normal_b = contacts.frame[patch, 0]
        self.counts = np.ones((len(patch), 2))  # (q, 2) how much the normal of either face counts
        self.mass = model.mass
        self.bodies = Bodies(assembly, model.fixed)

    @property
    def unit(self) -> float:
        """m: the length unit of the equilibrium system."""
        return self.base.length_unit

    @cached_property
    def faces(self) -> Faces:
        """The whole faces that meet in each contact; looked for when the first of them slides or opens."""
        return Faces.of(self.model.assembly, self.model.contacts)

    def start(self) -> Place:
        """Where all blocks are at first."""
        count = len(self.model.assembly)
        return Place(self.model.assembly.mass.centroid.copy(), np.tile(np.eye(3), (count, 1, 1)))

    def joined(self, met: Touch, place: Place, mu: float | None) -> None:
        """Add contacts that have come about at a place; friction by materials, else `mu`, else the least there is."""
        faces, assembly = self.faces.joined(met), self.model.assembly
        known = self.contacts.mu
        rest = mu if mu is not None else float(np.min(known)) if len(known) else MU
        new = paired_friction(assembly, met.contacts)[0].with_mu(rest)
        old, base, count = len(self.contacts), self.base, len(new.point)
        self.base = replace(
            base,
            used=np.append(base.used, len(self.contacts.point) + np.arange(count)),
            row_a=np.append(base.row_a, _rows(base, new.a[new.patch])),
            row_b=np.append(base.row_b, _rows(base, new.b[new.patch])),
            mu=np.append(base.mu, new.mu[new.patch]),
        )
        self.contacts, self.faces = Contacts.joined([self.contacts, new]), faces
        self.patch = np.append(self.patch, old + new.patch)
        a, b = met.pair
        normal, counts = new.frame[new.patch, 0], np.ones((count, 2))
        if new.at_points[0]:
            counts[:, int(met.face == a)] = 0.0
        self.a, self.b = np.append(self.a, np.full(count, a)), np.append(self.b, np.full(count, b))
        self.arm_a = np.vstack([self.arm_a, (new.point - place.centre[a]) @ place.turn[a]])
        self.arm_b = np.vstack([self.arm_b, (new.point - place.centre[b]) @ place.turn[b]])
        self.corner_a = np.vstack([self.corner_a, self.arm_a[-count:]])
        self.corner_b = np.vstack([self.corner_b, self.arm_b[-count:]])
        self.normal_a = np.vstack([self.normal_a, normal @ place.turn[a]])
        self.normal_b = np.vstack([self.normal_b, normal @ place.turn[b]])
        self.counts = np.vstack([self.counts, counts])
        self.bodies.joined(met)

    def known(self, place: Place, met: Touch) -> bool:
        """Whether there are points that bear already wherever two stones have met."""
        mine = (self.contacts.a[self.patch] == met.pair[0]) & (self.contacts.b[self.patch] == met.pair[1])
        mine |= (self.contacts.a[self.patch] == met.pair[1]) & (self.contacts.b[self.patch] == met.pair[0])
        point, bears = self.bearing(place)
        there = point[mine & bears & (self.gaps(place) <= 10.0 * TOUCHES)]
        if not len(there):
            return False
        apart = np.linalg.norm(met.contacts.point[:, None] - there, axis=2).min(axis=1)
        return bool((apart <= BESIDE * self.unit).all())

    def ends(self, place: Place) -> tuple[Floats, Floats, Floats]:
        """(q, 3) each contact point as block a carries it and as b does, and the normal there."""
        turn_a, turn_b = place.turn[self.a], place.turn[self.b]
        pa = place.centre[self.a] + np.einsum("qij,qj->qi", turn_a, self.arm_a)
        pb = place.centre[self.b] + np.einsum("qij,qj->qi", turn_b, self.arm_b)
        n = self.counts[:, :1] * np.einsum("qij,qj->qi", turn_a, self.normal_a)
        n += self.counts[:, 1:] * np.einsum("qij,qj->qi", turn_b, self.normal_b)
        return pa, pb, n / np.linalg.norm(n, axis=1)[:, None]

    def faced(self, place: Place, near: Bools) -> bool:
        """Give joints that have opened their normals: an edge on a face has the face's, two edges the mean of both.

        `near` (q,) tells which points touch, or will do so; whether anything has changed.
        """
        n_a, n_b = self._own_normals(place)
        leans = np.linalg.norm(np.cross(n_a, n_b), axis=1) > LEANS
        near = near & leans & ~self.contacts.at_points[self.patch]
        point, off = self.bearing(place)[0], 10.0 * self.bodies.tolerance
        before = self.counts.copy()
        for contact in np.unique(self.patch[near]).tolist():
            mine = self.patch == contact
            middle, normal = point[mine & near].mean(axis=0), n_a[mine][0] + n_b[mine][0]
            inside = self.faces.bearing(place, contact, middle, normal / np.linalg.norm(normal), off)
            self.counts[mine] = np.array(inside, float) if inside[0] != inside[1] else 1.0
        return not np.array_equal(before, self.counts)

    def gaps(self, place: Place) -> Floats:
        """(q,) how far each point is open, in length units."""
        pa, pb, n = self.ends(place)
        return np.asarray(np.sum((pb - pa) * n, 1) / self.unit)

    def bearing(self, place: Place) -> tuple[Floats, Bools]:
        """(q, 3) m where each contact point bears, and (q,) whether it does: not where its faces have left each other.

        That is half-way between both blocks' own. Where faces have slid along each other a point goes with the block
        whose face is the smaller one, and no further than the edge of what both faces have in common: a stone that is
        pushed over an edge tips about it.
        """
        pa, pb, n = self.ends(place)
        point, bears = (pa + pb) / 2.0, np.ones(len(pa), bool)
        along = pb - pa
        along -= np.sum(along * n, 1)[:, None] * n
        slid = np.linalg.norm(along, axis=1) > SLID * self.unit
        for contact in np.unique(self.patch[slid & (self.gaps(place) <= TOUCHES)]).tolist():
            mine = np.flatnonzero(self.patch == contact)
            point[mine], bears[mine] = self._shared(place, contact, mine, n[mine[0]])
        return point, bears

    def _shared(self, place: Place, contact: int, mine: Ints, normal: Floats) -> tuple[Floats, Bools]:
        """Where the points of a contact bear that has slid, and whether they do."""
        carrier = int(self.faces.carries[contact])
        corner = (self.corner_b if carrier == self.faces.b[contact] else self.corner_a)[mine]
        carried = place.centre[carrier] + corner @ place.turn[carrier].T
        frame = frames_from_normals(normal[None])[0]
        return within(self.faces.common(place, contact, frame, carried[0]), carried, frame, carried[0])

    def anchored(self, place: Place) -> None:
        """From now on both blocks carry the points of contacts that have slid from where they bear at a place."""
        pa, pb, n = self.ends(place)
        point, bears = self.bearing(place)
        moved = (np.linalg.norm(point - (pa + pb) / 2.0, axis=1) > 0.0) & bears
        n_a, n_b = self._own_normals(place)
        arms = []
        for block, own, face in ((self.a, pa, n_a), (self.b, pb, n_b)):
            onto = point + (np.sum((own - point) * face, 1) / np.sum(n * face, 1))[:, None] * n
            arms.append(np.einsum("qji,qj->qi", place.turn[block], onto - place.centre[block]))
        self.arm_a = np.where(moved[:, None], arms[0], self.arm_a)
        self.arm_b = np.where(moved[:, None], arms[1], self.arm_b)

    def borne(self, place: Place, open_by: float) -> tuple[EquilibriumSystem, Ints]:
        """The system over points that are open by no more than so many length units, and which (k,) those are."""
        touching = np.flatnonzero((self.gaps(place) <= open_by) & self.bearing(place)[1])
        return self.system(place, touching), touching

    def friction(self, place: Place) -> tuple[Floats, Floats]:
        """(q,) mu at each point, and by how much its faces lean (rad) from its normal where both of them count.

        Where an edge lies on an edge, each stone's may slide along the face of the other, and a force has to be inside
        the cones about both normals: about their mean there is that much less.
        """
        n_a, n_b = self._own_normals(place)
        both = (self.counts.sum(axis=1) > 1.0) & ~self.contacts.at_points[self.patch]
        sine, cosine = np.linalg.norm(np.cross(n_a, n_b), axis=1), np.sum(n_a * n_b, axis=1)
        lean = np.where(both, np.arctan2(sine, cosine) / 2.0, 0.0)
        return np.tan(np.maximum(np.arctan(self.base.mu) - lean, 0.0)), lean

    def _own_normals(self, place: Place) -> tuple[Floats, Floats]:
        """(q, 3) the normals of both faces at each point."""
        n_a = np.einsum("qij,qj->qi", place.turn[self.a], self.normal_a)
        return n_a, np.einsum("qij,qj->qi", place.turn[self.b], self.normal_b)

    def system(self, place: Place, touching: Ints, point: Floats | None = None) -> EquilibriumSystem:
        """The equilibrium system over some points, by index, where they bear; its loads are those of the model at rest.

        `point` (q, 3) m tells where all points bear, if that is known better.
        """
        n = self.ends(place)[2][touching]
        base, unit = self.base, self.unit
        point = (self.bearing(place)[0] if point is None else point)[touching]
        frame = frames_from_normals(n)
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
            mu=self.friction(place)[0][touching],
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
        for _ in range(CORRECTIONS):
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

    def clear(self, place: Place, active: Ints, sticks: Bools, offset: Floats) -> Place:
        """The same, and joints that would close further than they can are shut; `offset` (k, 3) m."""
        for _ in range(CLOSINGS):
            place = self.kept(place, active, sticks, offset)
            if self.faced(place, self.gaps(place) <= TOUCHES):
                continue
            closed = (self.gaps(place) < -TOUCHES) & self.bearing(place)[1]
            closed[active] = False
            if not closed.any():
                break
            more = np.flatnonzero(closed)
            active = np.append(active, more)
            sticks = np.append(sticks, np.zeros(len(more), bool))
            offset = np.vstack([offset, np.zeros((len(more), 3))])
        return place

    def displaced(self, place: Place, settings: Settings, points: bool = True) -> tuple[Assembly, Settings]:
        """The blocks as they stand at a place, and the contacts that are left, for `check` and `limit`.

        A joint that has opened about an edge is given as that edge, by `points` or as a strip; one that has parted is
        left out. `settings` are those of the model before.
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
            old,
            blocks=blocks,
            contacts=self._left(place, points),
            loads=loads,
            settlements=(),
            combinations=(),
            actions=(),
        )
        x, y, z = model.gravity.tolist()
        plain = Settings(method="rbe", gravity=(x, y, z), density=model.density, tolerance=settings.tolerance)
        return moved, plain

    def carried(self, place: Place, block: int, point: Floats) -> Floats:
        """(3,) m: where a point of a block has gone."""
        away = point - self.model.assembly.mass.centroid[block]
        return np.asarray(place.centre[block] + place.turn[block] @ away)

    def _left(self, place: Place, points: bool) -> Contacts:
        """What still touches: whole joints, and of those that have opened the edges about which they did.

        An edge on a face is given as points with the normal of the face, if these are wanted; an edge on an edge as a
        narrow strip between both faces, within the tolerance of either, of which it is said how far they lean from it.
        """
        contacts, gaps = self.contacts, self.gaps(place)
        point, bears = self.bearing(place)
        normal, lean = self.ends(place)[2], self.friction(place)[1]
        parts = list[tuple[int, Floats, Floats | None, float | None]]()
        for k in np.unique(self.patch).tolist():
            here = np.flatnonzero(self.patch == k)
            shut = here[(gaps[here] <= 10.0 * TOUCHES) & bears[here]]
            if contacts.at_points[k] or (points and len(shut) < len(here) and self.counts[here[0]].sum() == 1.0):
                parts += [(k, point[row][None], normal[row], None) for row in shut]
            elif len(shut):
                parts.append((k, self._strip(here, shut, point, gaps), None, float(lean[here[0]]) or None))
        which = [k for k, *_ in parts]
        pairs = np.stack([contacts.a[which], contacts.b[which]], 1)
        _, polygons, facing, leaning = zip(*parts, strict=True) if parts else ((), (), (), ())
        said = [one if one is not None and one > SAID else None for one in leaning]
        return Contacts.of(pairs, polygons, contacts.mu[which], lean=said, facing=facing)

    def _strip(self, here: Ints, shut: Ints, point: Floats, gaps: Floats) -> Floats:
        """(k, 3) m: corners of a joint, those that gape (q,) drawn in to beside the points that are shut."""
        corners = point[here].copy()
        for row in np.flatnonzero(~np.isin(here, shut)):
            other = here[row]
            hinge = shut[int(np.argmin(np.linalg.norm(point[shut] - point[other], axis=1)))]
            strip = min(WIDEST, STRIP * self.model.tolerance / (gaps[other] * self.unit))
            corners[row] = point[hinge] + strip * (point[other] - point[hinge])
        return corners


def _rows(base: EquilibriumSystem, block: Ints) -> Ints:
    """(k,) which of the free blocks these are, -1 = fixed."""
    place = {int(i): k for k, i in enumerate(base.free)}
    return np.array([place.get(int(i), -1) for i in block], np.int64)


def degrees(turn: Floats) -> float:
    """Angle of a rotation (3, 3) in degrees."""
    off = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return float(np.rad2deg(np.arctan2(np.linalg.norm(off), np.trace(turn) - 1.0)))
