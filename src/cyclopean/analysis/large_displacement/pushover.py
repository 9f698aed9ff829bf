"""Pushover: the multiplier that a structure still bears as its mechanism goes on, on displaced geometry."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.analysis.large_displacement.places import TOUCHES, Displaced, Place, degrees
from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.limit import limit
from cyclopean.analysis.limit_analysis.live_load import Live, LiveLoad, live_loads
from cyclopean.analysis.limit_analysis.load_family import Pencil, pencil
from cyclopean.analysis.limit_analysis.result import LimitResult
from cyclopean.analysis.limit_analysis.solving import LimitOutcome, solve_limit
from cyclopean.analysis.preparation import PreparedModel, prepare
from cyclopean.analysis.settings import Settings
from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError

__all__ = ["Pushover", "PushoverStep", "Reach", "pushover"]

LOST = 0.9  # of a multiplier: an upper bound alone that is lower is of a model that has lost contacts
HALVINGS = 30  # of a step in which stones run into each other, to find where they meet
PRESSES = 1e-6  # of the largest normal force: points that press stay in touch during a step
STICKS = 1e-3  # of the largest relative velocity: points that press and move less stick
EVENTS, EASINGS = 6, 16  # motions under dead loads alone in a step, and doublings of their length
BLURRED = 0.02  # likewise in motions under dead loads alone
STILL = 1e-5  # of the fastest: a block that moves, or turns, no more does not
FURTHEST, TURNS = 0.05, 0.05  # length units and radians that blocks go at most before the mechanism is asked for again
PARTS = 1000  # of one step, at most
DIVIDED = 6  # halvings of a step that leads to where nothing holds
JAMS = 0.1  # of a step: where the control block goes no further the stones jam
MEETINGS = 12  # in one step: where stones meet more often, the curve ends
THIN = 0.5  # of the thinnest stone's least side: no stone goes further before it is seen whether stones have met
ROUNDED = 1e-6  # of a step: what is left of it is nothing
AHEAD = 2.0  # tolerances that stones go on, to see which others meet at the same time
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
    met: tuple[tuple[str, str], ...] = ()  # ids of stones that have come into contact there


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
    faces. Points that have opened bear nothing until they close again. Of joints that have opened about an edge the
    normal is that of the face on which the edge lies; where two edges meet forces are inside the cones about both
    faces' normals.

    Where stones run into each other the step is cut short: they bear on each other from there on, by what of one lies
    on a face of the other that parts them. The curve ends where no face does: edges that cross, stones not convex.

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
    course = _Course(model, live, reach)
    walk = _Walk(course, settings or Settings(), budget)
    for step in range(reach.steps + 1):
        progress(f"pushover step {step} of {reach.steps}")
        if not walk.on(0.0 if step == 0 else course.by):
            break
    if not walk.made:
        raise InputError.of("pushover", None, walk.ended)
    place, control = walk.place, model.assembly.blocks[walk.control].id
    return Pushover(control, tuple(walk.made), walk.ended, place.centre, place.turn, tuple(walk.proofs))


@dataclass(frozen=True, slots=True, eq=False)
class _Mechanism:
    """How blocks go on from a place."""

    touching: Ints  # (k,) contact points in touch
    force: Floats  # (k, 3)
    motion: Floats  # (m, 6) m and rad a unit of time


class _Walk:
    """How far a curve has come."""

    def __init__(self, course: "_Course", settings: Settings, budget: Budget) -> None:
        self.course, self.settings, self.budget = course, settings, budget
        self.place, self.control = course.start(), -1
        self.made: list[PushoverStep] = []
        self.proofs: list[Mapping[str, Any] | None] = []
        self.ended = ON
        self.mechanism = _Mechanism(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 6)))

    def on(self, left: float) -> bool:
        """Go on by so many metres or degrees, with a point at the end and wherever stones meet; False at the end.

        Where a step leads to a place at which nothing holds, the mechanism has changed on the way: it is halved.
        """
        course, meetings, aim, far = self.course, 0, left, 0.0
        for _ in range(PARTS):
            before, met, went = self.place, list[tuple[int, int]](), 0.0
            if left > 0.0:
                far = course.reach(self.mechanism, self.control)
                if far == 0.0:
                    return self._still()
                aim = min(aim, far)
                self.place, beyond = course.advanced(before, self.mechanism, self.control, aim)
                course.faced(self.place, course.gaps(self.place) <= TOUCHES)
                course.anchored(self.place)
                met = [] if beyond is None else course.bodies.met(beyond)
                went = course.went(before, self.place, self.control)
                if not met and not JAMS * aim < went < aim / JAMS:
                    self.place = before
                    self.ended = f"the stones jam after {self._at()}: no motion of theirs follows the mechanism"
                    return False
            new, meetings = [pair for pair in met if self._bears(pair)], meetings + bool(met)
            least = bool(met) or not aim > min(course.by, far) / 2.0**DIVIDED
            if self.ended != ON or not self._judged(new, bool(new) or (aim >= left and not met), least):
                if self.ended != _WHY["falls"] or least:
                    return False
                self.ended, self.place, aim = ON, before, aim / 2.0
                continue
            left -= went if met else aim
            aim = left
            if not left > ROUNDED * course.by:
                return True
            if meetings == MEETINGS:
                break
        self.ended = f"one step does not come to its end in {PARTS} parts, and ends at {self._at()}"
        if meetings == MEETINGS:
            self.ended = f"stones run into each other again and again after {self._at()}"
        return False

    def _still(self) -> bool:
        """End where the control block does not move any more, or not so from the beginning."""
        if len(self.made) == 1:
            said = (
                "goes nowhere: give an angle, such as 10deg"
                if self.course.in_metres
                else "does not turn: give a length"
            )
            raise InputError.of("pushover", None, f"the fastest block {said}")
        self.ended = f"the control block comes to rest after {self._at()}: the mechanism has changed"
        return False

    def _bears(self, pair: tuple[int, int]) -> bool:
        """Let two stones that have met bear on each other; whether they did not do so already."""
        course, names = self.course, self._names(pair)
        found = course.bodies.touch(self.place, pair)
        if found is None:
            self.ended = f"{names} run into each other at {self._at()} where no face parts them, which is not followed"
            return False
        if course.known(self.place, found):
            return False
        course.joined(found, self.place, self.settings.mu)
        return True

    def _at(self) -> str:
        """How far the control block is then."""
        here = self.course.told(self.place, self.control, 0.0, 0)
        return f"{here.displacement:.4g} m, {here.rotation:.4g} degrees"

    def _names(self, pair: tuple[int, int]) -> str:
        return " and ".join(f"'{self.course.model.assembly.blocks[k].id}'" for k in pair)

    def _judged(self, met: list[tuple[int, int]], told: bool, ease: bool) -> bool:
        """Ask how much is borne at the place reached, and note it; False where the curve ends there."""
        course, budget = self.course, self.budget
        self.place, loads, touching, found = course.settled(self.place, budget, EVENTS if ease else 0)
        if found.late or (self.made and budget.over):
            self.ended = "the time given is used up"
            return False
        if found.y is None or found.f is None:
            why = _WHY.get(found.word, "neither forces nor a mechanism were found")
            self.ended = f"{', '.join(self._names(pair) for pair in met)} meet at {self._at()}: {why}" if met else why
            return False
        self.mechanism = _Mechanism(touching, found.f, course.world(found.y))
        if self.control < 0:
            speed = np.linalg.norm(self.mechanism.motion[:, :3], axis=1)
            self.control = int(course.base.free[int(np.argmax(speed))])
        multiplier = loads.unit * (found.lower + found.upper) / 2.0
        if not told and multiplier > 0.0:
            return True
        ids = [block.id for block in course.model.assembly.blocks]
        step = course.told(self.place, self.control, multiplier, len(np.unique(touching)))
        step = replace(step, met=tuple((ids[one], ids[other]) for one, other in met))
        proved = course.proved(self.place, self.settings, budget)
        if proved is not None and proved.lower is None and (proved.upper or 0.0) < LOST * multiplier:
            proved = None  # of less than what touches: strips too narrow to bear are not in it
        if proved is not None:
            low = -np.inf if proved.lower is None else proved.lower
            high = np.inf if proved.upper is None else proved.upper
            bears = float(
                np.clip(step.multiplier, low, high)
            )  # nothing else than what is proved of the contacts listed
            step = replace(step, lower=proved.lower, upper=proved.upper, multiplier=bears)
        self.made.append(step)
        self.proofs.append(None if proved is None else proved.certificate)
        if step.multiplier <= 0.0:
            self.ended = "it does not stand without live loads any more"
        return self.ended == ON


ON = "the wanted displacement was reached"
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

    def pencil(self, place: Place) -> tuple[Pencil, Ints]:
        """Loads on the displaced geometry, and the points that touch."""
        system, touching = self.borne(place, 10.0 * TOUCHES)
        p0 = self.wrench(place, self.model.gravity, self.model.assembly.loads)
        p1 = self.wrench(place, self.gravity, self.live)
        return pencil(replace(system, p=p0), p1), touching

    def settled(self, place: Place, budget: Budget, events: int) -> tuple[Place, Pencil, Ints, LimitOutcome]:
        """Solve at a place; where no multiplier holds, let the dead loads have their way first.

        Past the point at which a joint beside a hinge begins to open, the motion so far leads to places where nothing
        holds. There a mechanism exists in which dead loads do work and live ones do none: following it with the live
        loads' displacement held, as a jack would, a little of it brings the structure back into balance.
        """
        loads, touching = self.pencil(place)
        found = solve_limit(loads, budget=budget)
        for _ in range(events):
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

    def proved(self, place: Place, settings: Settings, budget: Budget) -> LimitResult | None:
        """What `limit` proves of the blocks as they stand; None where a joint gapes too wide for one normal."""
        blocks = self.model.assembly.blocks
        at = (
            LiveLoad(blocks[load.block].id, _three(load.force), _three(self.carried(place, load.block, load.point)))
            for load in self.live
        )
        grows = replace(self.grows, loads=tuple(at)) if self.grows.loads else self.grows
        found: list[LimitResult] = []
        for points in (True, False):  # what the checker does not take as points it may take as strips
            try:
                model, plain = self.displaced(place, settings, points)
                found.append(limit(model, grows, plain, seconds=budget.left if budget.limited else None))
            except InputError:
                continue
            if found[-1].lower is not None and found[-1].upper is not None:
                break
        return max(found, key=lambda one: (one.lower is not None) + (one.upper is not None), default=None)

    def told(self, place: Place, control: int, multiplier: float, touching: int) -> PushoverStep:
        """A point of the curve."""
        went = float(np.linalg.norm(place.centre[control] - self.model.assembly.mass.centroid[control]))
        return PushoverStep(went, degrees(place.turn[control]), multiplier, touching)

    def _pace(self, along: _Mechanism, control: int) -> float:
        """Metres or degrees that the control block goes in a unit of time."""
        row = int(np.flatnonzero(self.base.free == control)[0])
        speed = along.motion[row, :3] if self.in_metres else np.rad2deg(along.motion[row, 3:])
        return float(np.linalg.norm(speed))

    def reach(self, along: _Mechanism, control: int) -> float:
        """Metres or degrees that the control block may go before the mechanism is asked for again; 0: it does not."""
        pace, turns = self._pace(along, control), float(np.max(np.linalg.norm(along.motion[:, 3:], axis=1)))
        goes = float(np.max(np.linalg.norm(along.motion[:, :3], axis=1))) / self.unit
        if not pace > STILL * (self.unit * max(goes, turns) if self.in_metres else np.rad2deg(max(goes, turns))):
            return 0.0
        furthest = min(FURTHEST, THIN * self.bodies.thinnest / self.unit)
        return pace * min(furthest / max(goes, 1e-300), TURNS / max(turns, 1e-300))

    def advanced(self, place: Place, along: _Mechanism, control: int, by: float) -> tuple[Place, Place | None]:
        """So many metres or degrees along the mechanism, corrected so that what presses stays in touch.

        Where stones run into each other on the way: the last place before, and one a little beyond it.
        """
        touching, f, motion = along.touching, along.force, along.motion
        scaled = motion.copy()
        scaled[:, :3] /= self.unit
        system = self.system(place, touching)
        dd = system.gap(scaled.ravel())
        slip, least = np.linalg.norm(dd[:, 1:], axis=1), STICKS * float(max(np.max(np.abs(dd)), np.max(np.abs(scaled))))
        stays = f[:, 0] > PRESSES * float(np.max(f[:, 0], initial=0.0))
        stays &= dd[:, 0] <= system.mu * slip + least  # what opens more than by sliding presses no more
        active, sticks = touching[stays], slip[stays] <= least
        before = self.ends(place)
        offset = (before[1] - before[0])[active]

        def at(length: float) -> Place:
            return self.clear(place.moved(self.base.free, motion * length), active, sticks, offset)

        length = by / self._pace(along, control)
        for _ in range(3):  # the correction takes something off: sliding, for one, lifts blocks at first
            stepped = at(length)
            went = self.went(place, stepped, control)
            if abs(went - by) <= 1e-6 * by or not went > 0.1 * by:
                break
            length *= by / went
        return self._until(at, length, stepped, float(np.max(np.linalg.norm(motion[:, :3], axis=1))))

    def _until(
        self, at: Callable[[float], Place], length: float, end: Place, pace: float
    ) -> tuple[Place, Place | None]:
        """The end of a step, or the last place before stones run into each other and one a little beyond."""
        bodies, low, high = self.bodies, 0.0, length
        if not bodies.met(end):
            return end, None
        for _ in range(HALVINGS):
            middle = (low + high) / 2.0
            low, high = (low, middle) if bodies.met(at(middle)) else (middle, high)
        return at(low), at(high + AHEAD * bodies.tolerance / max(pace, 1e-300))

    def went(self, before: Place, after: Place, control: int) -> float:
        """Metres or degrees that the control block has gone in a step."""
        if self.in_metres:
            return float(np.linalg.norm(after.centre[control] - before.centre[control]))
        return degrees(after.turn[control] @ before.turn[control].T)


def _three(vector: Floats) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
