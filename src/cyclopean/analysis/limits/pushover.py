"""Pushover: the multiplier that a structure still bears as its mechanism goes on, on displaced geometry."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.analysis.limits.live import Live, live_loads
from cyclopean.analysis.limits.pencil import Pencil, pencil
from cyclopean.analysis.limits.solving import LimitOutcome, solve_limit
from cyclopean.analysis.posing import PosedModel, pose
from cyclopean.analysis.settings import Settings
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Load
from cyclopean.errors import InputError, SolverError
from cyclopean.geometry import frames_from_normals
from cyclopean.statics import EquilibriumSystem, contact_matrix, equilibrium_system

__all__ = ["Pushover", "PushoverStep", "pushover"]

TOUCHES = 1e-7  # of the length unit (mean V^(1/3)): a point that is further open bears nothing
PRESSES = 1e-6  # of the largest normal force: points that press stay in touch during a step
STICKS = 1e-3  # of the largest relative velocity: points that press and move less stick
EVENTS, EASINGS = 6, 16  # motions under dead loads alone in a step, and doublings of their length
BLURRED = 0.02  # likewise in motions under dead loads alone
ROUNDS = 12  # of the correction that keeps them so


@dataclass(frozen=True, slots=True, eq=False)
class PushoverStep:
    """One point of the curve."""

    displacement: float  # m, of the control block's centre of mass
    rotation: float  # degrees, of the control block
    multiplier: float  # largest at which the displaced geometry stands, between both bounds of the solver
    touching: int  # contact points in touch


@dataclass(frozen=True, slots=True, eq=False)
class Pushover:
    """The curve, and why it ends."""

    control: str  # id of the control block
    steps: tuple[PushoverStep, ...]
    ended: str
    placed: Floats  # (n, 3) m, centres of mass at the end
    turned: Floats  # (n, 3, 3) rotations at the end


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Where all blocks are."""

    centre: Floats  # (n, 3)
    turn: Floats  # (n, 3, 3)

    def moved(self, blocks: Ints, motion: Floats) -> "_Place":
        """After finite rigid motions (m, 6) of some blocks: v along, then w (radians) about the centre of mass."""
        centre, turn = self.centre.copy(), self.turn.copy()
        centre[blocks] += motion[:, :3]
        turn[blocks] = _rotations(motion[:, 3:]) @ turn[blocks]
        return _Place(centre, turn)


def pushover(
    assembly: Assembly,
    live: Live,
    settings: Settings | None = None,
    *,
    reach: float,
    unit: str = "m",
    steps: int = 20,
    progress: Callable[[str], None] = lambda _: None,
) -> Pushover:
    """Follow the mechanism and ask at each step how much it still bears.

    At every step the limit problem is solved on the displaced geometry, and the blocks move on along its mechanism by
    finite rigid motions until the control block, the fastest of the first mechanism, has gone one step further.
    Points that press stay in touch: those that stick keep their place, those that slide stay in the plane of the joint,
    so that sliding does not lift blocks as the associated mechanism would. Points that have opened bear nothing until
    they close again. Normals of joints that have opened about an edge are the mean of both faces'.

    Parameters
    ----------
    assembly : Assembly
        The model.
    live : Live
        What grows.
    settings : Settings
        As for `limit`.
    reach : float
        How far: metres of the control block's centre of mass, or degrees of its rotation.
    unit : {"m", "deg"}
        Which of the two.
    steps : int
        How many.
    progress : callable
        Is told each step.

    Raises
    ------
    InputError
        Joints that pull, a reach or steps that are not positive, or a model without a mechanism.
    """
    if not (0.0 < reach < np.inf) or steps < 1 or unit not in ("m", "deg"):
        raise InputError(f"--pushover {reach:g}{unit}: expected a positive length (m) or angle (deg), and --steps >= 1")
    model = pose(assembly, Settings() if settings is None else settings, {}, progress)
    if model.contacts.strength.any():
        raise InputError("--pushover: joints that pull are not followed; use dry joints")
    course = _Course(model, live)
    place = _Place(model.assembly.mass.centroid.copy(), np.tile(np.eye(3), (len(model.assembly), 1, 1)))
    made: list[PushoverStep] = []
    control, ended = -1, "the wanted displacement was reached"
    for step in range(steps + 1):
        progress(f"pushover step {step} of {steps}")
        place, loads, touching, found = course.settled(place)
        if found.y is None or found.f is None:
            ended = _WHY.get(found.word, "neither forces nor a mechanism were found")
            break
        motion = course.world(found.y)
        if control < 0:
            control = int(course.system.free[int(np.argmax(np.linalg.norm(motion[:, :3], axis=1)))])
        made.append(course.told(place, control, loads.unit * (found.lower + found.upper) / 2.0, touching))
        if made[-1].multiplier <= 0.0:
            ended = "it does not stand without live loads any more"
            break
        if step == steps:
            break
        place = course.advanced(place, touching, found.f, motion, control, reach / steps, unit)
    if not made:
        raise InputError(f"--pushover: {ended}")
    return Pushover(model.assembly.blocks[control].id, tuple(made), ended, place.centre, place.turn)


_WHY = {
    "unbounded": "no mechanism exists",
    "falls": "it falls under its own weight, whatever the live loads",
}


class _Course:
    """A model whose blocks move; contact points are carried by both blocks they join."""

    def __init__(self, model: PosedModel, live: Live) -> None:
        self.model, assembly = model, model.assembly
        self.gravity, self.live = live_loads(assembly, live, model.gravity)
        if live.tilt is not None and any(not model.fixed[load.block] for load in assembly.loads):
            raise InputError("--pushover: a tilt with loads that do not turn is not followed; use --push")
        self.system = equilibrium_system(assembly, model.contacts, model.fixed, model.gravity, model.density)
        contacts = model.contacts
        patch = contacts.patch[self.system.used]
        self.a, self.b = contacts.a[patch], contacts.b[patch]
        point = contacts.point[self.system.used]
        self.arm_a = point - assembly.mass.centroid[self.a]
        self.arm_b = point - assembly.mass.centroid[self.b]
        self.normal = contacts.frame[patch, 0]
        given = np.array([model.density if b.density is None else b.density for b in assembly.blocks])
        self.mass = given * assembly.mass.volume

    def ends(self, place: _Place) -> tuple[Floats, Floats, Floats]:
        """(q, 3) each contact point as block a carries it and as b does, and the normal between both faces."""
        pa = place.centre[self.a] + np.einsum("qij,qj->qi", place.turn[self.a], self.arm_a)
        pb = place.centre[self.b] + np.einsum("qij,qj->qi", place.turn[self.b], self.arm_b)
        n = np.einsum("qij,qj->qi", place.turn[self.a] + place.turn[self.b], self.normal)
        return pa, pb, n / np.linalg.norm(n, axis=1)[:, None]

    def gaps(self, place: _Place) -> Floats:
        """(q,) how far each point is open, in length units."""
        pa, pb, n = self.ends(place)
        return np.asarray(np.sum((pb - pa) * n, 1) / self.system.length_unit)

    def pencil(self, place: _Place) -> tuple[Pencil, Ints]:
        """Loads on the displaced geometry, and the points that touch."""
        touching = np.flatnonzero(self.gaps(place) <= TOUCHES)
        return self._pencil(place, touching), touching

    def settled(self, place: _Place) -> tuple[_Place, Pencil, Ints, LimitOutcome]:
        """Solve at a place; where no multiplier holds, let the dead loads have their way first.

        Past the point at which a joint beside a hinge begins to open, the motion so far leads to places where nothing
        holds. There a mechanism exists in which dead loads do work and live ones do none: following it with the live
        loads' displacement held, as a jack would, a little of it brings the structure back into balance.
        """
        loads, touching = self.pencil(place)
        found = solve_limit(loads)
        for _ in range(EVENTS):
            if found.f is not None or found.word != "falls" or found.y is None:
                break
            eased = self._eased(place, touching, self.world(found.y))
            if eased is None:
                break
            place, loads, touching, found = eased
        return place, loads, touching, found

    def _eased(self, place: _Place, touching: Ints, motion: Floats) -> tuple[_Place, Pencil, Ints, LimitOutcome] | None:
        """The first place along a motion at which something holds again, by ever longer steps."""
        scaled = motion.copy()
        scaled[:, :3] /= self.system.length_unit
        top = float(np.max(np.abs(scaled), initial=0.0))
        dd = self._system(place, touching).gap(scaled.ravel())
        shut = np.abs(dd[:, 0]) <= BLURRED * top  # the motion was opened a little everywhere to make it a proof
        sticks = (np.linalg.norm(dd[:, 1:], axis=1) <= BLURRED * top)[shut]
        before = self.ends(place)
        offset = before[1] - before[0]
        apart, everywhere = self.gaps(place), np.arange(self.system.points)
        rate = self._system(place, everywhere).gap(scaled.ravel())[:, 0] / top
        closing = np.where((apart > TOUCHES) & (rate < -BLURRED), apart / np.minimum(rate, -1e-300) * -1.0, np.inf)
        first = float(np.min(closing, initial=np.inf))
        lengths = [1e-6 * 2.0**power for power in range(EASINGS)]
        for length in [*(x for x in lengths if x < first), *([first] if np.isfinite(first) else [])]:
            met = np.flatnonzero(closing <= 1.01 * first) if length == first else np.zeros(0, np.int64)
            active = np.concatenate([touching[shut], met])
            there = place.moved(self.system.free, motion * (length / top))
            held = np.concatenate([sticks, np.zeros(len(met), bool)])
            there = self._kept(there, active, held, offset[active])
            loads, again = self.pencil(there)
            found = solve_limit(loads)
            if found.f is not None or found.word != "falls" or length == first:
                return there, loads, again, found
        return None

    def _pencil(self, place: _Place, touching: Ints) -> Pencil:
        system = self._system(place, touching)
        p0 = self._wrench(place, self.model.gravity, self.model.assembly.loads)
        p1 = self._wrench(place, self.gravity, self.live)
        return pencil(replace(system, p=p0), p1)

    def _system(self, place: _Place, touching: Ints) -> EquilibriumSystem:
        pa, pb, n = (x[touching] for x in self.ends(place))
        base, unit = self.system, self.system.length_unit
        point, frame = (pa + pb) / 2.0, frames_from_normals(n)
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

    def _wrench(self, place: _Place, gravity: Floats, loads: tuple[Load, ...]) -> Floats:
        """(6 m,) scaled; points of loads move with their blocks."""
        wrench = np.zeros((len(self.mass), 6))
        wrench[:, :3] = self.mass[:, None] * gravity
        origin = self.model.assembly.mass.centroid
        for load in loads:
            wrench[load.block, :3] += load.force
            arm = place.turn[load.block] @ (load.point - origin[load.block])
            wrench[load.block, 3:] += np.cross(arm, load.force)
        scaled = wrench[self.system.free] / self.system.force_unit
        scaled[:, 3:] /= self.system.length_unit
        return self.system.still(scaled.ravel())

    def world(self, y: Floats) -> Floats:
        """(m, 6) m and rad a unit of time, from scaled velocities."""
        motion = self.system.still(y).reshape(-1, 6).copy()
        motion[:, :3] *= self.system.length_unit
        return motion

    def told(self, place: _Place, control: int, multiplier: float, touching: Ints) -> PushoverStep:
        """A point of the curve."""
        went = float(np.linalg.norm(place.centre[control] - self.model.assembly.mass.centroid[control]))
        return PushoverStep(went, _degrees(place.turn[control]), multiplier, len(touching))

    def advanced(
        self, place: _Place, touching: Ints, f: Floats, motion: Floats, control: int, by: float, unit: str
    ) -> _Place:
        """One step along the mechanism, corrected so that what presses stays in touch."""
        row = int(np.flatnonzero(self.system.free == control)[0])
        speed = motion[row, :3] if unit == "m" else np.rad2deg(motion[row, 3:])
        pace = float(np.linalg.norm(speed))
        if not pace > 1e-9 * float(np.max(np.abs(motion))):
            raise SolverError("the control block has come to rest: the mechanism has changed; use the other unit")
        presses = f[:, 0] > PRESSES * float(np.max(f[:, 0], initial=0.0))
        active = touching[presses]
        system = self._system(place, active)
        scaled = motion.copy()
        scaled[:, :3] /= self.system.length_unit
        dd = system.gap(scaled.ravel())
        slip = np.linalg.norm(dd[:, 1:], axis=1)
        sticks = slip <= STICKS * max(float(np.max(np.abs(dd), initial=0.0)), float(np.max(np.abs(scaled))))
        before = self.ends(place)
        offset = (before[1] - before[0])[active]
        length = by / pace
        for _ in range(3):  # the correction takes something off: sliding, for one, lifts blocks at first
            stepped = self._kept(place.moved(self.system.free, motion * length), active, sticks, offset)
            went = self._went(place, stepped, control, unit)
            if abs(went - by) <= 1e-6 * by or not went > 0.1 * by:
                break
            length *= by / went
        return stepped

    def _went(self, before: _Place, after: _Place, control: int, unit: str) -> float:
        """Metres or degrees that the control block has gone in a step."""
        if unit == "m":
            return float(np.linalg.norm(after.centre[control] - before.centre[control]))
        return _degrees(after.turn[control] @ before.turn[control].T)

    def _kept(self, place: _Place, active: Ints, sticks: Bools, offset: Floats) -> _Place:
        """Least motions that close the active points again, and bring those that stick back together."""
        from scipy.sparse.linalg import lsmr

        unit = self.system.length_unit
        for _ in range(ROUNDS):
            pa, pb, _ = (x[active] for x in self.ends(place))
            system = self._system(place, active)
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
            correction = self.system.still(step).reshape(-1, 6).copy()
            correction[:, :3] *= unit
            place = place.moved(self.system.free, correction)
        return place


def _degrees(turn: Floats) -> float:
    """Angle of a rotation."""
    off = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return float(np.rad2deg(np.arctan2(np.linalg.norm(off), np.trace(turn) - 1.0)))


def _rotations(w: Floats) -> Floats:
    """(m, 3, 3) rotations by |w| about w (Rodrigues)."""
    angle = np.linalg.norm(w, axis=1)
    axis = w / np.where(angle > 0.0, angle, 1.0)[:, None]
    K = np.zeros((len(w), 3, 3))
    K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -axis[:, 2], axis[:, 1], -axis[:, 0]
    K[:, 1, 0], K[:, 2, 0], K[:, 2, 1] = axis[:, 2], -axis[:, 1], axis[:, 0]
    sin, cos = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + sin * K + (1.0 - cos) * (K @ K))
