"""The building site of a rubble wall: what stands, the running height map over it, the stones that are left.

A stone is tried at a place by seating it on the exact meshes; it may be laid where it shares no volume with another,
stands well inside the hull of what bears it, and the wall with it is in equilibrium. What was found out about places is
kept as long as nothing is laid near them.
"""

import hashlib
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis import DENSITY
from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import Assembly, Block
from cyclopean.assembly.patches import Surface
from cyclopean.design.rubble.features import Body, body_of
from cyclopean.design.rubble.hearting import Wedge, small_stones
from cyclopean.design.rubble.height_map import lying_raster
from cyclopean.design.rubble.places import Bedded, Looked, Place, bedded
from cyclopean.design.rubble.seating import Seat, heyman_margin, seat
from cyclopean.design.rubble.standing import GRAVITY, Fresh, Mass, State, Structure
from cyclopean.design.rubble.wall import OVERLAP, Laid, SettleSettings, mean_length
from cyclopean.design.stones.stone import Stone
from cyclopean.geometry import triangles
from cyclopean.geometry.solids import CUBE

__all__ = ["NARROW", "Progress", "Site", "Trial", "Turn", "free_name"]

INSIDE = 0.05  # of the cube root of a stone's volume: margin that is asked for
PATIENCE = 10, 50  # times that a stone is seated in vain before it is put aside until the next course: many, few stones
FEW_STONES = 16  # ... as few as that, or less
WORN = 20, 150  # ... in all, and it is put aside until the end
TOUCH = 2.5e-4  # of the cube root of a median volume: surfaces farther apart hold nothing before they move
FEWER = 0.75  # of the stones compete for a place in every other way to lay a wall
REACH = 0.5  # of a mean stone's length: what is farther from a dropped stone is not looked at
NARROW = 0.8  # a stone is no narrower than that share of twice its middle semi-axis

Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """A stone that was laid."""

    number: int  # in the structure, of the first of what was laid with it
    course: int
    wythe: int
    trial: "Trial"


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """A stone, seated; with a wedge under it where it needs one."""

    stone: int  # in the inventory
    seat: Seat
    fresh: tuple[Fresh, ...]  # the stone, after its wedge
    margin: float  # m: of the centre of mass inside the hull of what bears it
    state: State | None  # forces that hold all; None: it does not stand
    wedge: Wedge | None = None


class Site:
    """The wall while it is laid."""

    def __init__(self, stones: Sequence[Stone], settings: SettleSettings, say: Progress, way: int = 0) -> None:
        length, thickness, cell = (float(v or 0.0) for v in (settings.length, settings.thickness, settings.cell))
        self.stones, self.settings, self.say, self.way = stones, settings, say, way
        self.ahead = math.ceil(settings.look_ahead * (FEWER if way % 2 else 1.0))  # stones that compete for a place
        self.cell, self.size = cell, (length, thickness)
        self.limit = np.inf if settings.height is None else settings.height  # m: no stone reaches above
        self.map: Floats = np.zeros((int(length / cell + 1e-9), int(thickness / cell + 1e-9)))
        self.mean = mean_length(stones)
        self._sort_stones()
        self.aside: list[int] = []  # stones that fit nowhere
        self.laid: list[Laid] = []
        self.bodies: dict[int, Body] = {}  # stones in their own frames, made when they are first asked for
        self.stood: dict[int, Body] = {}  # stones and wedges, by their numbers in the structure
        self.kind: dict[int, Laid | Wedge] = {}
        self.boxes = np.zeros((0, 2, 3))  # lowest and highest corners of what stands, in the same order
        self.turns: list[Turn] = []
        self.overlap = 0.0
        self.known: dict[tuple[int, int], list[Bedded]] = {}
        self.joints: dict[int, list[float]] = {}
        self.ground = _ground(free_name("ground", {s.id for s in stones}), length, thickness, self.mean)
        lone = Assembly((self.ground,), None, ()).mesh
        floor = Surface.of(lone.vertex[triangles(lone)[0]])
        touch = TOUCH * float(np.cbrt(np.median([stone.volume for stone in stones])))
        self.structure = Structure(floor, float(settings.band or 0.0), settings.friction, settings.lean, touch)
        self.patience, self.lasting = (
            round(float(np.clip(many[1] * FEW_STONES / len(stones), *many))) for many in (PATIENCE, WORN)
        )
        self.vain: Counter[int] = Counter()  # times that each stone was seated in vain in this course
        self.worn: Counter[int] = Counter()  # ... in all
        self.looked = Looked()
        self.between = -np.inf, np.inf  # m along the wall: where stones may be laid

    def _sort_stones(self) -> None:
        """Those for the courses, and those that are kept for the hollows; the largest first, or as they come."""
        order = list(range(len(self.stones)))
        if self.settings.look_ahead:
            order.sort(key=lambda k: _content(self.stones[k]))
        small = small_stones(self.stones) if self.settings.hearting else np.zeros(len(order), bool)
        self.left = [k for k in order if not small[k]]
        self.small = [k for k in order if small[k]]

    def narrowest(self) -> float:
        """Room (m) along the wall that the narrowest stone needs."""
        return min(2.0 * NARROW * float(self.stones[k].half[1]) for k in self.left)

    def patient(self, stone: int) -> bool:
        """Whether a stone was not tried in vain too often."""
        return self.vain[stone] < self.patience and self.worn[stone] < self.lasting

    def bedded(self, stone: int, bed: int) -> list[Bedded]:
        """A stone in the orientations of one bed."""
        if (stone, bed) not in self.known:
            self.known[stone, bed] = bedded(stone, self.stones[stone], self.settings.yaws, self.cell, (bed,))
        return self.known[stone, bed]

    def shallow(self, stone: int, deep: int) -> bool:
        """Whether a stone fits into the thickness of a wythe (cells), whichever way it lies."""
        return any(b.raster.low.shape[1] <= deep for bed in (0, 1) for b in self.bedded(stone, bed))

    def margin(self, body: Body) -> float:
        """What is asked for (m)."""
        wanted = self.settings.margin
        return INSIDE * float(np.cbrt(body.volume)) if wanted is None else wanted

    def near(self, point: Floats, reach: float) -> list[int]:
        """Stones of the wall whose boxes come nearer than reach (m) to the box of some points."""
        low, high = point.min(axis=0) - reach, point.max(axis=0) + reach
        near: Bools = ((self.boxes[:, 0] <= high) & (self.boxes[:, 1] >= low)).all(axis=1)
        if not near.any():
            return []
        number = np.fromiter(self.stood, np.int64, len(self.stood))
        return sorted(number[near].tolist())

    def body(self, number: int) -> Body:
        """A stone in its own frame."""
        if number not in self.bodies:
            stone = self.stones[number]
            self.bodies[number] = body_of(stone.vertices, stone.triangles, f"stone '{stone.id}'")
        return self.bodies[number]

    def lying(self, trial: Trial) -> Body:
        """The stone where it was seated."""
        return self.body(trial.stone).moved(trial.seat.rotation, trial.seat.shift)

    def first(self, places: Sequence[Place], rocking: list[Trial]) -> Trial | None:
        """The first of these places where a stone stands; what rocks is told."""
        for place in places:
            if self.looked.failed(place):
                continue
            trial = self.seated(place)
            if trial is not None and trial.state is not None:
                return trial
            self.looked.fail(place)
            self.vain[place.lying.stone] += 1
            self.worn[place.lying.stone] += 1
            rocking += [] if trial is None else [trial]
        return None

    def seated(self, place: Place) -> Trial | None:
        """Adjust a stone on the exact meshes; None where it would stand in another one, slides, or rocks for good.

        Its centre of mass has to stand inside the hull of what it touches, and inside that of the contacts that are
        found within the band: those are more, and count on surfaces that only meet once it has moved.
        """
        stone = self.body(place.lying.stone)
        turn = place.lying.rotation
        centre = np.array([*(np.array(place.cell) * self.cell - place.lying.raster.corner), place.rest])
        near = self.near((stone.vertices - stone.centroid) @ turn.T + centre, REACH * self.mean)
        found = seat(stone, turn, centre - turn @ stone.centroid, [self.stood[k] for k in near], give_up=True)
        wanted = self.margin(stone)
        rocks = not found.margin >= wanted
        if not found.overlap <= OVERLAP or (found.slid and not found.margin > 0.0):
            return None
        if rocks and not self.settings.chinking:
            return None
        body = stone.moved(found.rotation, found.shift)
        if not (self.between[0] <= body.low[0] and body.high[0] <= self.between[1]):
            return None
        near = self.near(body.vertices, self.structure.band)
        fresh = self.fresh(body, self.stones[place.lying.stone].density or DENSITY, near)
        margin = heyman_margin(fresh.bearing, body.centroid)
        inside = margin > 0.0 and margin >= wanted and not rocks
        state = self.structure.held((fresh,)) if inside else None
        trial = Trial(place.lying.stone, found, (fresh,), margin, state)
        return trial if state is None else self.borne(trial, body, near)

    def fresh(self, body: Body, density: float, near: Sequence[int]) -> Fresh:
        """A body (kg/m3) where it shall lie, with all its joints."""
        mass = Mass(body.centroid, body.volume, density * body.volume * GRAVITY)
        return self.structure.fresh(mass, Surface.of(body.vertices[body.triangles]), near)

    def borne(self, trial: Trial, body: Body, near: Sequence[int]) -> Trial:
        """With its contacts in the model, and its margin by these; without a state where that is too small."""
        fresh = self.structure.with_contacts(trial.fresh, near)
        margin = heyman_margin(fresh[-1].told, body.centroid)
        well = margin > 0.0 and margin >= self.margin(body)
        return replace(trial, fresh=fresh, margin=margin, state=trial.state if well else None)

    def take(self, trial: Trial, course: int, wythe: int) -> None:
        """Lay the stone, and raise the map by it."""
        assert trial.state is not None
        number, body, found = trial.stone, self.lying(trial), trial.seat
        self.turns.append(Turn(self.structure.next, course, wythe, trial))
        support = self._raise(body)
        stone = Laid(
            number, found.rotation, found.shift, course, wythe, trial.margin, True, support, trial.fresh[-1].told
        )
        first = self.structure.next
        if trial.wedge is not None:
            self._stand(first, trial.wedge.body, trial.wedge)
        self._stand(first + len(trial.fresh) - 1, body, stone)
        self.structure.lay(trial.fresh, trial.state)
        self.laid.append(stone)
        self.looked.forget(float(body.low[0]) / self.cell, float(body.high[0]) / self.cell)
        self.overlap = max(self.overlap, found.overlap)
        if number in self.left:
            self.left.remove(number)
        for bed in (0, 1):
            self.known.pop((number, bed), None)
        self.say(f"{len(self.laid)} of {len(self.stones)} stones, course {course + 1}")

    def _raise(self, body: Body) -> float:
        """Raise the map to the top of a body; share of its plan that nearly touched the map before."""
        raster = lying_raster(body.vertices, body.triangles, self.cell)
        i, j = np.rint(raster.corner / self.cell).astype(int)
        w, d = raster.low.shape
        rows, columns = (slice(max(k, 0), max(k + n, 0)) for k, n in ((i, w), (j, d)))
        under = self.map[rows, columns]
        a, b = max(-i, 0), max(-j, 0)
        low, high = (part[a : a + under.shape[0], b : b + under.shape[1]] for part in (raster.low, raster.high))
        support = float(np.count_nonzero(low - under <= self.cell)) / max(int(np.count_nonzero(low < np.inf)), 1)
        self.map[rows, columns] = np.maximum(under, high)
        return support

    def _stand(self, number: int, body: Body, what: Laid | Wedge) -> None:
        """Count a body among what stands."""
        self.stood[number], self.kind[number] = body, what
        self.boxes = np.concatenate([self.boxes, [[body.low, body.high]]])


def _content(stone: Stone) -> tuple[float, bytes, str]:
    """What stones are sorted by: the largest first, and never by where they stand in the inventory."""
    return -stone.volume, hashlib.sha256(stone.vertices.tobytes() + stone.triangles.tobytes()).digest(), stone.id


def free_name(wanted: str, names: set[str]) -> str:
    """The name, with a number behind it where it is taken."""
    return next(n for n in (wanted, *(f"{wanted}-{k}" for k in range(len(names) + 1))) if n not in names)


def _ground(name: str, length: float, thickness: float, margin: float) -> Block:
    """A box with its top at 0, a margin wider than the wall on every side."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    low = np.array([-margin, -margin, -margin / 2.0])
    vertices = low + corner * (np.array([length + margin, thickness + margin, 0.0]) - low)
    return Block(name, vertices, CUBE, None, True, "ground")
