"""Pushover: the multiplier that a structure still bears as its mechanism goes on, on displaced geometry."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from cyclopean.analysis.large_displacement.faces import Bodies, Faces, within
from cyclopean.analysis.large_displacement.places import TOUCHES, Displaced, Place, degrees
from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.limit import limit
from cyclopean.analysis.limit_analysis.live_load import Live, LiveLoad, live_loads
from cyclopean.analysis.limit_analysis.load_family import Pencil, pencil
from cyclopean.analysis.limit_analysis.result import LimitResult
from cyclopean.analysis.limit_analysis.solving import LimitOutcome, solve_limit
from cyclopean.analysis.preparation import PreparedModel, prepare
from cyclopean.analysis.settings import Settings
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError, SolverError
from cyclopean.geometry import frames_from_normals

__all__ = ["Pushover", "PushoverStep", "Reach", "pushover"]

SLID = 1e-6  # of the length unit: faces that have gone no further along each other meet where they did
PRESSES = 1e-6  # of the largest normal force: points that press stay in touch during a step
STICKS = 1e-3  # of the largest relative velocity: points that press and move less stick
EVENTS, EASINGS = 6, 16  # motions under dead loads alone in a step, and doublings of their length
BLURRED = 0.02  # likewise in motions under dead loads alone


@dataclass(frozen=True, slots=True, eq=False)
class PushoverStep:
    """One point of the curve."""

    displacement: float  # m, of the control block's centre of mass
    rotation: float  # degrees, of the control block
    multiplier: float  # largest at which the displaced geometry stands, between both bounds of the solver
    touching: int  # contact points in touch
    lower: float | None = None  # proved bounds on that multiplier; None where none is proved
    upper: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Pushover:
    """The curve, and why it ends."""

    control: str  # id of the control block
    steps: tuple[PushoverStep, ...]
    ended: str
    placed: Floats  # (n, 3) m, centres of mass at the end
    turned: Floats  # (n, 3, 3) rotations at the end
    proofs: tuple[Mapping[str, Any] | None, ...] = ()  # a certificate of each point's bounds


@dataclass(frozen=True, slots=True)
class Reach:
    """How far the control block goes: metres of its centre of mass, or degrees of its rotation; in equal steps."""

    far: float
    unit: str = "m"  # or "deg"
    steps: int = 20

    def __post_init__(self) -> None:
        if not (0.0 < self.far < np.inf) or self.steps < 1 or self.unit not in ("m", "deg"):
            raise InputError(
                f"`pushover` {self.far:g}{self.unit}: expected a positive length (m) or angle (deg), and `steps` >= 1"
            )


def pushover(
    assembly: Assembly,
    live: Live,
    reach: Reach,
    settings: Settings | None = None,
    seconds: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Pushover:
    """Follow the mechanism and ask at each step how much it still bears.

    At every step the limit problem is solved on the displaced geometry, and the blocks move on along its mechanism by
    finite rigid motions until the control block, the fastest of the first mechanism, has gone one step further.
    Points that press stay in touch: those that stick keep their place, those that slide stay in the plane of the joint,
    so that sliding does not lift blocks as the associated mechanism would, and bear no further than the edges of both
    faces. Points that have opened bear nothing until they close again. Normals of joints that have opened about an
    edge are the mean of both faces'. The curve ends where stones that were clear of each other run into each other by
    more than 1 % of the smaller.

    Parameters
    ----------
    assembly : Assembly
        The model.
    live : Live
        What grows.
    reach : Reach
        How far the control block goes.
    settings : Settings
        As for `limit`.
    seconds : float, optional
        When to stop, with the curve as far as it goes.
    progress : callable
        Is told each step.

    Raises
    ------
    InputError
        Joints that pull, or a model without a mechanism.
    """
    budget = UNLIMITED if seconds is None else Budget(seconds)
    model = prepare(assembly, settings, progress)
    if model.contacts.strength.any():
        raise InputError.of("pushover", None, "joints that pull are not followed; use dry joints")
    course, bodies = _Course(model, live, reach), Bodies(model.assembly)
    place = course.start()
    made: list[PushoverStep] = []
    proofs: list[Mapping[str, Any] | None] = []
    control, ended = -1, "the wanted displacement was reached"
    for step in range(reach.steps + 1):
        progress(f"pushover step {step} of {reach.steps}")
        place, loads, touching, found = course.settled(place, budget)
        if found.late or (made and budget.over):
            ended = "the time given is used up"
            break
        if found.y is None or found.f is None:
            ended = _WHY.get(found.word, "neither forces nor a mechanism were found")
            break
        motion = course.world(found.y)
        if control < 0:
            control = int(course.base.free[int(np.argmax(np.linalg.norm(motion[:, :3], axis=1)))])
        told = course.told(place, control, loads.unit * (found.lower + found.upper) / 2.0, touching)
        proved = course.proved(place, settings or Settings(), budget)
        made.append(told if proved is None else replace(told, lower=proved.lower, upper=proved.upper))
        proofs.append(None if proved is None else proved.certificate)
        if made[-1].multiplier <= 0.0:
            ended = "it does not stand without live loads any more"
            break
        if step == reach.steps:
            break
        after = course.advanced(place, touching, found.f, motion, control)
        if (met := bodies.met(after)) is not None:
            one, other = (f"'{model.assembly.blocks[k].id}'" for k in met)
            ended = f"in the step that follows {one} and {other} run into each other, and what they do then is not told"
            break
        place = after
    if not made:
        raise InputError.of("pushover", None, f"{ended}")
    return Pushover(model.assembly.blocks[control].id, tuple(made), ended, place.centre, place.turn, tuple(proofs))


_WHY = {
    "unbounded": "no mechanism exists",
    "falls": "it falls under its own weight, whatever the live loads",
}


class _Course(Displaced):
    """A model whose blocks move under loads that grow."""

    def __init__(self, model: PreparedModel, live: Live, reach: Reach) -> None:
        super().__init__(model)
        self.by, self.in_metres = reach.far / reach.steps, reach.unit == "m"
        self.gravity, self.live = live_loads(model.assembly, live, model.gravity)
        self.grows = live
        if live.tilt is not None and any(not model.fixed[load.block] for load in model.assembly.loads):
            raise InputError.of("pushover", None, "a tilt with loads that do not turn is not followed; use `push`")

    def bearing(self, place: Place) -> tuple[Floats, Bools]:
        """(q, 3) m where each contact point bears, and (q,) whether it does: not where its faces have left each other.

        Where faces have slid along each other a point goes with the block whose face is the smaller one, and no
        further than the edge of what both faces have in common: a stone that is pushed over an edge tips about it.
        """
        pa, pb, n = self.ends(place)
        point, bears = super().bearing(place)
        along = pb - pa
        along -= np.sum(along * n, 1)[:, None] * n
        slid = np.linalg.norm(along, axis=1) > SLID * self.unit
        for contact in np.unique(self.patch[slid & (self.gaps(place) <= TOUCHES)]).tolist():
            mine = np.flatnonzero(self.patch == contact)
            carried = (pb if self.faces.carries[contact] == self.faces.b[contact] else pa)[mine]
            frame = frames_from_normals(n[mine[:1]])[0]
            point[mine], bears[mine] = within(
                self.faces.common(place, contact, frame, carried[0]), carried, frame, carried[0]
            )
        return point, bears

    @cached_property
    def faces(self) -> Faces:
        """The whole faces that meet in each contact; looked for when the first of them slides."""
        return Faces.of(self.model.assembly, self.model.contacts)

    def pencil(self, place: Place) -> tuple[Pencil, Ints]:
        """Loads on the displaced geometry, and the points that touch."""
        touching = np.flatnonzero((self.gaps(place) <= TOUCHES) & self.bearing(place)[1])
        return self._pencil(place, touching), touching

    def settled(self, place: Place, budget: Budget) -> tuple[Place, Pencil, Ints, LimitOutcome]:
        """Solve at a place; where no multiplier holds, let the dead loads have their way first.

        Past the point at which a joint beside a hinge begins to open, the motion so far leads to places where nothing
        holds. There a mechanism exists in which dead loads do work and live ones do none: following it with the live
        loads' displacement held, as a jack would, a little of it brings the structure back into balance.
        """
        loads, touching = self.pencil(place)
        found = solve_limit(loads, budget=budget)
        for _ in range(EVENTS):
            if budget.over or found.f is not None or found.word != "falls" or found.y is None:
                break
            eased = self._eased(place, touching, self.world(found.y))
            if eased is None:
                break
            place, loads, touching, found = eased
        return place, loads, touching, found

    def _eased(self, place: Place, touching: Ints, motion: Floats) -> tuple[Place, Pencil, Ints, LimitOutcome] | None:
        """The first place along a motion at which something holds again, by ever longer steps."""
        scaled = motion.copy()
        scaled[:, :3] /= self.unit
        top = float(np.max(np.abs(scaled), initial=0.0))
        dd = self.system(place, touching).gap(scaled.ravel())
        shut = np.abs(dd[:, 0]) <= BLURRED * top  # the motion was opened a little everywhere to make it a proof
        sticks = (np.linalg.norm(dd[:, 1:], axis=1) <= BLURRED * top)[shut]
        before = self.ends(place)
        offset = before[1] - before[0]
        apart, everywhere = self.gaps(place), np.arange(self.base.points)
        rate = self.system(place, everywhere).gap(scaled.ravel())[:, 0] / top
        closing = np.where((apart > TOUCHES) & (rate < -BLURRED), apart / np.minimum(rate, -1e-300) * -1.0, np.inf)
        first = float(np.min(closing, initial=np.inf))
        lengths = [1e-6 * 2.0**power for power in range(EASINGS)]
        for length in [*(x for x in lengths if x < first), *([first] if np.isfinite(first) else [])]:
            met = np.flatnonzero(closing <= 1.01 * first) if length == first else np.zeros(0, np.int64)
            active = np.concatenate([touching[shut], met])
            there = place.moved(self.base.free, motion * (length / top))
            held = np.concatenate([sticks, np.zeros(len(met), bool)])
            there = self.kept(there, active, held, offset[active])
            loads, again = self.pencil(there)
            found = solve_limit(loads)
            if found.f is not None or found.word != "falls" or length == first:
                return there, loads, again, found
        return None

    def _pencil(self, place: Place, touching: Ints) -> Pencil:
        system = self.system(place, touching)
        p0 = self.wrench(place, self.model.gravity, self.model.assembly.loads)
        p1 = self.wrench(place, self.gravity, self.live)
        return pencil(replace(system, p=p0), p1)

    def proved(self, place: Place, settings: Settings, budget: Budget) -> LimitResult | None:
        """What `limit` proves of the blocks as they stand; None where a joint gapes too wide for one normal."""
        blocks = self.model.assembly.blocks
        at = (
            LiveLoad(blocks[load.block].id, _three(load.force), _three(self.carried(place, load.block, load.point)))
            for load in self.live
        )
        grows = replace(self.grows, loads=tuple(at)) if self.grows.loads else self.grows
        try:
            model, plain = self.displaced(place, settings)
            return limit(model, grows, plain, seconds=budget.left if budget.limited else None)
        except InputError:
            return None

    def told(self, place: Place, control: int, multiplier: float, touching: Ints) -> PushoverStep:
        """A point of the curve."""
        went = float(np.linalg.norm(place.centre[control] - self.model.assembly.mass.centroid[control]))
        return PushoverStep(went, degrees(place.turn[control]), multiplier, len(touching))

    def advanced(self, place: Place, touching: Ints, f: Floats, motion: Floats, control: int) -> Place:
        """One step along the mechanism, corrected so that what presses stays in touch."""
        by = self.by
        row = int(np.flatnonzero(self.base.free == control)[0])
        speed = motion[row, :3] if self.in_metres else np.rad2deg(motion[row, 3:])
        pace = float(np.linalg.norm(speed))
        if not pace > 1e-9 * float(np.max(np.abs(motion))):
            raise SolverError("the control block has come to rest: the mechanism has changed; use the other unit")
        presses = f[:, 0] > PRESSES * float(np.max(f[:, 0], initial=0.0))
        active = touching[presses]
        system = self.system(place, active)
        scaled = motion.copy()
        scaled[:, :3] /= self.unit
        dd = system.gap(scaled.ravel())
        slip = np.linalg.norm(dd[:, 1:], axis=1)
        sticks = slip <= STICKS * max(float(np.max(np.abs(dd), initial=0.0)), float(np.max(np.abs(scaled))))
        before = self.ends(place)
        offset = (before[1] - before[0])[active]
        length = by / pace
        for _ in range(3):  # the correction takes something off: sliding, for one, lifts blocks at first
            stepped = self.kept(place.moved(self.base.free, motion * length), active, sticks, offset)
            went = self._went(place, stepped, control)
            if abs(went - by) <= 1e-6 * by or not went > 0.1 * by:
                break
            length *= by / went
        return stepped

    def _went(self, before: Place, after: Place, control: int) -> float:
        """Metres or degrees that the control block has gone in a step."""
        if self.in_metres:
            return float(np.linalg.norm(after.centre[control] - before.centre[control]))
        return degrees(after.turn[control] @ before.turn[control].T)


def _three(vector: Floats) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
