"""Rubble: a wall of stones as they were found, laid dry, course after course, on a running height map.

The map holds the top of the wall over a grid. A stone is tried in its bedded orientations at the places that are open
to it (`places`), dropped onto the map, and, once a place is chosen, adjusted on the exact meshes until it sits
(`seating`). It is laid there only if

- it shares no more than `OVERLAP` of its volume with any other, which is looked up with exact solids;
- its centre of mass stands inside the hull of what bears it, by a margin (Heyman 1966);
- the wall with it is in equilibrium, with less friction than stone has on stone, and with gravity leaning a little
  whichever way (`standing`).

So the wall stands when it is done, and at every stage before. Where none of some stones at some places does all that, a
gap is left; a stone that is tried in vain too often is put aside, and tried again in the next course and at the end.

A course is laid from both ends towards its middle: left, right, left ... Where a wall has two wythes, the front one of
a course is laid first, then the rear one. Which stone comes next: of all that are left, the largest; `look_ahead` of
them compete for every place. With a look-ahead of 0, stones are laid in the order of the inventory, the next one always
at the first place where it stands. Nothing is drawn at random.
"""

import hashlib
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from time import perf_counter
from typing import Any

import numpy as np

from cyclopean.analysis import DENSITY
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly import Assembly, Block
from cyclopean.assembly.patches import Patch, Surface, gathered, usual_band
from cyclopean.design.laying.gaps import Body, body_of
from cyclopean.design.laying.hearting import FACES, Wedge, small_stones, wedge_under
from cyclopean.design.laying.height_map import MOST_CELLS, edges_of, rasters
from cyclopean.design.laying.places import Bedded, Place, Slot, Weights, bedded, ranked
from cyclopean.design.laying.seating import Seat, heyman_margin, seat
from cyclopean.design.laying.standing import FRICTION, GRAVITY, Fresh, Mass, State, Structure
from cyclopean.design.options import at_least, not_negative, positive
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError
from cyclopean.geometry import triangles
from cyclopean.geometry.solids import intersection, solid_of, solid_volume

__all__ = ["OVERLAP", "Laid", "RubbleWall", "SettleSettings", "largest_overlap", "settle"]

INSIDE = 0.05  # of the cube root of a stone's volume: margin that is asked for
LEAN, STEEP = 4.0, 45.0  # degrees: by which gravity leans while laying, and what is too much
PATIENCE = 10, 50  # times that a stone is seated in vain before it is put aside until the next course: many, few stones
FEW_STONES = 16  # ... as few as that, or less
WORN = 3  # times as often in all, and it is put aside until the end
WEDGED = 3  # rocking stones that are tried with a wedge before a gap is left
OVERLAP = 1e-3  # of a stone's volume: what it may share with another one
DEEPEST = 0.6  # of the thickness: a stone of one of two wythes
CELLS = 20  # of a mean stone's length
SLENDER = 2.0  # times its thickness: height that a wall is planned for
SOLIDITY = 0.4  # share of stone in a wall, to find its length by
WIDE, WIDE_OF_TWO = 90.0, 75.0  # percentile of the stones' widths that a wythe is made for
INTO, PLAY = 4, 6  # cells by which a place may reach into its neighbour's plan, and stand off from it
REACH = 0.5  # of a mean stone's length: what is farther from a dropped stone is not looked at
HEART = 2  # the wythe of small stones in hollows
HEARTING = Weights(bond=0.0, face=0.0)
WEDGE = np.array([t for a, b, c, d in FACES for t in ((a, b, c), (a, c, d))])
SKIP = 3  # cells that are left open where nothing goes
CLOSE = 48  # places looked at closely, of each choice
FEW = 12  # ... of a part of the wall, at the end
SECTION = 8.0  # mean lengths: part of a wall that is looked at together
NARROW = 0.8  # a stone is no narrower than that share of twice its middle semi-axis


@dataclass(frozen=True, slots=True)
class SettleSettings:
    """How a rubble wall is laid. None: found from the stones."""

    length: float | None = None  # m
    height: float | None = None  # m that no stone reaches above; None = as high as the stones go
    thickness: float | None = None  # m
    wythes: int = 1
    cell: float | None = None  # m: of the height map
    yaws: int = 8  # turns about the vertical that are tried
    weights: Weights = field(default_factory=Weights)
    look_ahead: int = 8  # stones that compete for a place; 0 = in the order of the inventory
    margin: float | None = None  # m that the centre of mass stands inside the hull of the contacts; None = `INSIDE`
    friction: float = FRICTION  # counted on while laying
    lean: float = LEAN  # degrees by which gravity may lean at every stage
    tries: int = 8  # places at which stones are seated before a gap is left
    hearting: bool = False
    chinking: bool = False
    band: float | None = None  # m: surfaces nearer than that make a contact

    def __post_init__(self) -> None:
        for name in ("length", "height", "thickness", "cell", "band"):
            value = getattr(self, name)
            object.__setattr__(self, name, None if value is None else positive(name, value))
        for name, least in (("yaws", 1), ("look_ahead", 0), ("tries", 1)):
            object.__setattr__(self, name, at_least(name, getattr(self, name), least))
        object.__setattr__(self, "margin", None if self.margin is None else not_negative("margin", self.margin))
        object.__setattr__(self, "friction", positive("friction", self.friction))
        object.__setattr__(self, "lean", not_negative("lean", self.lean))
        if not self.lean < STEEP:
            raise InputError(f"lean: {self.lean:g} degrees; give less than {STEEP:g}")
        if self.wythes not in (1, 2):
            raise InputError(f"wythes: expected 1 or 2, got {self.wythes!r}")


@dataclass(frozen=True, slots=True, eq=False)
class Laid:
    """A stone where it lies: x_wall = rotation x_stone + shift."""

    stone: int  # in the inventory
    rotation: Floats  # (3, 3)
    shift: Floats  # (3,) m
    course: int
    wythe: int  # 0 = front, 1 = rear, 2 = hearting
    margin: float  # m: of the centre of mass inside the hull of the contacts, in plan; negative outside
    stable: bool  # margin is positive, and at least what was asked for
    support: float  # share of its plan under which it nearly touches
    contacts: Floats  # (n, 3) m, world

    @property
    def transform(self) -> Floats:
        """(4, 4) from the stone's frame to the wall's."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.rotation, self.shift
        return matrix


@dataclass(frozen=True, slots=True)
class Measures:
    """What came out."""

    void: float  # share of the wall that is not stone, between its faces and below its skyline
    hollow: float  # share that is not stone below the stones' own upper surface
    stable: float  # share of the stones there are that are in the wall and stable
    courses: int
    height: float  # m: of the highest stone
    length: float  # m
    thickness: float  # m
    overlap: float  # largest share of its volume that a stone has in common with another one
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class RubbleWall:
    """A settled wall."""

    laid: tuple[Laid, ...]  # in the order in which they were laid
    left_over: Ints  # stones of the inventory that are not in the wall
    settings: SettleSettings  # with all that was left open filled in but the height
    measures: Measures
    assembly: Assembly  # the ground, the stones, then wedges; with the contacts of the real meshes
    patches: tuple[Patch, ...]  # where surfaces meet: one of each contact, then those that are too narrow for one
    wedges: int = 0


Progress = Callable[[str], None]


def settle(
    inventory: Inventory, settings: SettleSettings | None = None, progress: Progress | None = None
) -> RubbleWall:
    """Lay a wall of found stones.

    Parameters
    ----------
    inventory : Inventory
        At least one stone.
    settings : SettleSettings, optional
        How.
    progress : callable, optional
        Told what goes on.

    Returns
    -------
    RubbleWall

    Raises
    ------
    InputError
        There are no stones, none of them fits into the wall, or the map would have too many cells.
    """
    began = perf_counter()
    say = progress or (lambda _: None)
    if not len(inventory):
        raise InputError(f"{inventory.source}: there are no stones to lay")
    full = _filled_in(inventory.stones, settings or SettleSettings())
    site = _Site(inventory.stones, full, say)
    site.build()
    if not site.laid:
        raise InputError(
            f"{inventory.source}: none of {len(inventory)} stones fits into a wall {full.length:.3g} m long and"
            f" {full.thickness:.3g} m thick; make it larger (--length, --thickness, --height)"
        )
    return _finished(site, inventory, began)


def _filled_in(stones: Sequence[Stone], settings: SettleSettings) -> SettleSettings:
    """The settings with lengths for what was left open."""
    extent = np.array([np.ptp(s.vertices @ s.axes.T, axis=0) for s in stones])
    mean = _mean_length(stones)
    cell = settings.cell or mean / CELLS
    longest = float(extent[:, 0].max()) + 2.0 * cell
    share = WIDE if settings.wythes == 1 else WIDE_OF_TWO
    thickness = settings.thickness or settings.wythes * float(np.percentile(extent[:, 1], share)) + cell
    face = math.fsum(s.volume for s in stones) / SOLIDITY / thickness  # m2 of wall
    length = settings.length or max(face / (settings.height or SLENDER * thickness), longest)
    if not length / cell * (thickness / cell) <= MOST_CELLS:
        raise InputError(f"cell: {cell:g} m makes a map of more than {MOST_CELLS:,} cells; use larger ones")
    if length < cell or thickness < cell:
        raise InputError(f"cell: {cell:g} m is more than the wall is long or thick; use smaller ones")
    return replace(
        settings,
        length=length,
        thickness=thickness,
        cell=cell,
        band=settings.band or usual_band(np.array([stone.volume for stone in stones])),
    )


def _mean_length(stones: Sequence[Stone]) -> float:
    """Mean extent (m) along the longest axis; to the bit the same in any order of the stones."""
    return math.fsum(float(np.ptp(s.vertices @ s.axes[0])) for s in stones) / len(stones)


def _content(stone: Stone) -> tuple[float, bytes, str]:
    """What stones are sorted by: the largest first, and never by where they stand in the inventory."""
    return -stone.volume, hashlib.sha256(stone.vertices.tobytes() + stone.triangles.tobytes()).digest(), stone.id


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """A stone, seated; with a wedge under it where it needs one."""

    place: Place
    seat: Seat
    body: Body  # where it lies
    fresh: tuple[Fresh, ...]  # the stone, after its wedge
    margin: float  # m: of the centre of mass inside the hull of what bears it
    state: State | None  # forces that hold all; None: it does not stand
    wedge: Wedge | None = None


class _Site:
    """The wall while it is laid."""

    def __init__(self, stones: Sequence[Stone], settings: SettleSettings, say: Progress) -> None:
        length, thickness, cell = (float(v or 0.0) for v in (settings.length, settings.thickness, settings.cell))
        self.stones, self.settings, self.say = stones, settings, say
        self.cell, self.size = cell, (length, thickness)
        self.map: Floats = np.zeros((int(length / cell + 1e-9), int(thickness / cell + 1e-9)))
        self.mean = _mean_length(stones)
        order = list(range(len(stones)))
        self.left = order if settings.look_ahead == 0 else sorted(order, key=lambda k: _content(stones[k]))
        small = small_stones(stones) if settings.hearting else np.zeros(len(stones), bool)
        self.small = [k for k in self.left if small[k]]  # kept for the hollows
        self.left = [k for k in self.left if not small[k]]
        self.aside: list[int] = []  # stones that fit nowhere
        self.laid: list[Laid] = []
        self.bodies = _Bodies(stones)
        self.stood: list[Body] = []  # stones and wedges, in the order in which they were laid
        self.kind: list[Laid | Wedge] = []
        self.lows: list[Floats] = []  # corners of the boxes of what stands
        self.highs: list[Floats] = []
        self.overlap = 0.0
        self.known: dict[tuple[int, int], list[Bedded]] = {}
        self.joints: dict[int, list[float]] = {}
        self.ground = _ground(self._ground_name(), length, thickness, self.mean)
        lone = Assembly((self.ground,), None, ()).mesh
        floor = Surface.of(lone.vertex[triangles(lone)[0]])
        self.structure = Structure(floor, float(settings.band or 0.0), settings.friction, settings.lean)
        self.patience = round(float(np.clip(PATIENCE[1] * FEW_STONES / len(stones), *PATIENCE)))
        self.vain: Counter[int] = Counter()  # times that each stone was seated in vain in this course
        self.worn: Counter[int] = Counter()  # ... in all
        self.failed: set[tuple[int, int, tuple[int, int]]] = set()

    def _ground_name(self) -> str:
        """One that no stone has."""
        return _free_name("ground", {s.id for s in self.stones})

    def build(self) -> None:
        """Lay courses until stones or room are used up."""
        course = 0
        while self.left:
            count = len(self.laid)
            self.vain.clear()
            for wythe in range(self.settings.wythes):
                self._course(course, wythe)
            self._heart(course)
            if len(self.laid) > count:
                course += 1
                self.left, self.aside = self.aside + self.left, []
            elif self.settings.look_ahead == 0:  # the one that comes next fits nowhere, and others may
                self.aside, self.left = self.aside + self.left[:1], self.left[1:]
            else:
                break
        self.left, self.aside = self.aside + self.left, []
        if self.settings.look_ahead:
            self._once_more(self.laid[-1].course if self.laid else 0)

    def _course(self, course: int, wythe: int) -> None:
        """Lay one wythe of one course from both ends inwards."""
        if not self.left:
            return
        open_from, open_to = 0, self.map.shape[0]
        level = self._level(wythe)
        joints: list[float] = []
        side = -1
        while self.left and (open_to - open_from) * self.cell >= self._narrowest():
            slot = self._slot(open_from, open_to, side, wythe, level)
            trial = self._next(slot)
            if trial is None:  # nothing goes here: leave a gap
                open_from, open_to = (open_from + SKIP, open_to) if side < 0 else (open_from, open_to - SKIP)
            else:
                self._take(trial, course, wythe)
                low, high = float(self.lows[-1][0]), float(self.highs[-1][0])
                if side < 0:
                    open_from, joint = round(high / self.cell), high
                else:
                    open_to, joint = round(low / self.cell), low
                joints.append(float(joint))
            side = -side
        self.joints[wythe] = joints

    def _heart(self, course: int) -> None:
        """Drop small stones into the hollows of what was laid, as long as they sit there."""
        n, d = self.map.shape
        level = float(self.map.max(axis=1).mean())
        slot = Slot(
            np.array([0, n]), np.array([0, d]), 0, 0, 0, False, False, level, level, (0.0, 0.0), np.zeros(0), 1.0, 0.0
        )
        fruitless = 0
        while self.small and fruitless < len(self.small):
            number = self.small.pop(0)
            places = ranked(self.map, self._bedded(number, 0), slot, HEARTING, self.cell, CLOSE)
            good = self._first(places[: self.settings.tries], [])
            if good is None:
                self.small.append(number)
                fruitless += 1
            else:
                self._take(good, course, HEART)
                fruitless = 0

    def _once_more(self, course: int) -> None:
        """Try each stone that is left at the best places of the whole wall."""
        self.vain.clear()
        for number in tuple(self.left):
            lying = [b for bed in (0, 1) for b in self._bedded(number, bed)]
            weights = self.settings.weights
            places = [p for slot in self._sections() for p in ranked(self.map, lying, slot, weights, self.cell, FEW)]
            trial = self._first(sorted(places, key=lambda p: p.cost)[: 2 * self.settings.tries], [])
            if trial is not None:
                self._take(trial, course, 0)

    def _sections(self) -> list[Slot]:
        """The whole wall, open from above, in parts that overlap."""
        n, d = self.map.shape
        long, level = round(SECTION * self.mean / self.cell), self._level(0)
        limit = np.inf if self.settings.height is None else self.settings.height
        starts = range(0, max(n - long, 0) + 1, max(long // 2, 1))
        ends = [(k, min(k + long, n)) for k in starts]
        ends[-1] = (ends[-1][0], n)
        across, joints = np.array([0, d]), np.zeros(0)
        return [
            Slot(np.array(x), across, 0, 0, 0, False, True, level, limit, (0.0, 0.0), joints, self.mean, 0.0)
            for x in ends
        ]

    def _chinked(self, rocking: Sequence[_Trial]) -> _Trial | None:
        """Drive a wedge under one of some stones that rock; None where none of them stands even so."""
        for trial in rocking[:WEDGED]:
            near = self._near(trial.body.vertices, self.cell)
            bodies = [self.stood[k] for k in near]
            wanted = self._margin(trial.body)
            wedge = wedge_under(trial.body, bodies, trial.fresh[-1].bearing, self.cell, 2.0 * wanted)
            if wedge is None:
                continue
            lump = body_of(wedge.vertices, WEDGE, "wedge")
            low = self.structure.fresh(_mass(lump, DENSITY), _surface(lump), near)
            stone = trial.fresh[-1]
            high = self.structure.fresh(stone.mass, stone.surface, near, (low.surface,))
            margin = heyman_margin(high.bearing, trial.body.centroid)
            state = self.structure.held((low, high)) if margin >= wanted else None
            if state is not None:
                return replace(trial, fresh=(low, high), margin=margin, state=state, wedge=wedge)
        return None

    def _strip(self, wythe: int) -> tuple[int, int]:
        """Cells across the wall in which a wythe has its stones."""
        d = self.map.shape[1]
        if self.settings.wythes == 1:
            return 0, d
        return (0, d // 2) if wythe == 0 else (d - d // 2, d)

    def _level(self, wythe: int) -> float:
        """Height (m) that the next course should come to: the skyline's mean, and a stone of those to come."""
        y0, y1 = self._strip(wythe)
        window = self.left[: max(self.settings.look_ahead, 1)]
        thick = float(np.median([b.thickness for k in window for b in self._bedded(k, 0)]))
        return float(self.map[:, y0:y1].max(axis=1).mean()) + thick

    def _across(self, wythe: int) -> Ints:
        """Cells across the wall in which a stone of a wythe must lie."""
        d = self.map.shape[1]
        deep = d if self.settings.wythes == 1 else math.ceil(DEEPEST * d)
        return np.array([d - deep, d] if wythe == 1 else [0, deep])

    def _slot(self, open_from: int, open_to: int, side: int, wythe: int, level: float) -> Slot:
        n = self.map.shape[0]
        at_end = open_from == 0 if side < 0 else open_to == n
        two = self.settings.wythes == 2
        return Slot(
            np.array([max(open_from - INTO, 0), min(open_to + INTO, n)]),
            self._across(wythe),
            side,
            0 if at_end else INTO + PLAY,
            PLAY if two else 0,
            wythe == 1,
            not two,
            level,
            np.inf if self.settings.height is None else self.settings.height,
            (open_from * self.cell, open_to * self.cell),
            np.array(self.joints.get(wythe, [])),
            self.mean,
            self._narrowest(),
        )

    def _narrowest(self) -> float:
        return min(2.0 * NARROW * float(self.stones[k].half[1]) for k in self.left)

    def _stand(self, body: Body, what: Laid | Wedge) -> None:
        """Count a body among what stands."""
        self.stood.append(body)
        self.kind.append(what)
        self.lows.append(body.low)
        self.highs.append(body.high)

    def _bedded(self, stone: int, bed: int) -> list[Bedded]:
        if (stone, bed) not in self.known:
            self.known[stone, bed] = bedded(stone, self.stones[stone], self.settings.yaws, self.cell, (bed,))
        return self.known[stone, bed]

    def _shallow(self, stone: int, deep: int) -> bool:
        """Whether a stone fits into the thickness of a wythe (cells), whichever way it lies."""
        return any(b.raster.low.shape[1] <= deep for bed in (0, 1) for b in self._bedded(stone, bed))

    def _next(self, slot: Slot) -> _Trial | None:
        """Seat the best of the stones that come next: the first that stands."""
        room = float(slot.first[1] - slot.first[0]) * self.cell
        patient = (k for k in self.left if self.vain[k] < self.patience and self.worn[k] < WORN * self.patience)
        if self.settings.look_ahead == 0:
            window = list(islice(patient, 1))
        else:
            deep = int(slot.across[1] - slot.across[0])
            near = (k for k in patient if 2.0 * NARROW * self.stones[k].half[1] <= room)
            window = list(islice((k for k in near if self._shallow(k, deep)), self.settings.look_ahead))
        rocking: list[_Trial] = []
        for bed in (0, 1):
            lying = [b for k in window for b in self._bedded(k, bed)]
            places = ranked(self.map, lying, slot, self.settings.weights, self.cell, CLOSE)
            trial = self._first(_different(places)[: self.settings.tries], rocking)
            if trial is not None:
                return trial
        return self._chinked(sorted(rocking, key=lambda t: -t.margin)) if self.settings.chinking else None

    def _first(self, places: Sequence[Place], rocking: list[_Trial]) -> _Trial | None:
        """The first of these places where a stone stands; what rocks is told."""
        for place in places:
            key = (place.lying.stone, id(place.lying), place.cell)
            if key in self.failed:
                continue
            trial = self._seated(place)
            if trial is not None and trial.state is not None:
                return trial
            self.failed.add(key)
            self.vain[place.lying.stone] += 1
            self.worn[place.lying.stone] += 1
            rocking += [] if trial is None else [trial]
        return None

    def _seated(self, place: Place) -> _Trial | None:
        """Adjust a stone on the exact meshes; None where it would stand in another one, or slides."""
        stone = self.bodies[place.lying.stone]
        turn = place.lying.rotation
        centre = np.array([*(np.array(place.cell) * self.cell - place.lying.raster.corner), place.rest])
        near = self._near((stone.vertices - stone.centroid) @ turn.T + centre, REACH * self.mean)
        found = seat(stone, turn, centre - turn @ stone.centroid, [self.stood[k] for k in near])
        if not found.overlap <= OVERLAP or (found.slid and not found.margin > 0.0):
            return None
        body = stone.moved(found.rotation, found.shift)
        mass = _mass(body, self.stones[place.lying.stone].density or DENSITY)
        fresh = self.structure.fresh(mass, _surface(body), self._near(body.vertices, self.structure.band))
        margin = heyman_margin(fresh.bearing, body.centroid)
        inside = margin > 0.0 and margin >= self._margin(body)
        return _Trial(place, found, body, (fresh,), margin, self.structure.held((fresh,)) if inside else None)

    def _margin(self, body: Body) -> float:
        """What is asked for (m)."""
        wanted = self.settings.margin
        return INSIDE * float(np.cbrt(body.volume)) if wanted is None else wanted

    def _near(self, point: Floats, reach: float) -> list[int]:
        """Stones of the wall whose boxes come near the box of some points."""
        if not self.stood:
            return []
        low, high = point.min(axis=0) - reach, point.max(axis=0) + reach
        near: Bools = ((np.array(self.lows) <= high) & (np.array(self.highs) >= low)).all(axis=1)
        return np.flatnonzero(near).tolist()

    def _take(self, trial: _Trial, course: int, wythe: int) -> None:
        """Lay the stone, and raise the map by it."""
        assert trial.state is not None
        number, body, found = trial.place.lying.stone, trial.body, trial.seat
        raster = rasters(body.vertices[None], body.triangles, edges_of(body.triangles), self.cell, snapped=True)[0]
        i, j = np.rint(raster.corner / self.cell).astype(int)
        w, d = raster.low.shape
        rows, columns = (slice(max(k, 0), max(k + n, 0)) for k, n in ((i, w), (j, d)))
        under = self.map[rows, columns]
        a, b = max(-i, 0), max(-j, 0)
        low, high = (part[a : a + under.shape[0], b : b + under.shape[1]] for part in (raster.low, raster.high))
        support = float(np.count_nonzero(low - under <= self.cell)) / max(int(np.count_nonzero(low < np.inf)), 1)
        self.map[rows, columns] = np.maximum(under, high)
        stone = Laid(
            number, found.rotation, found.shift, course, wythe, trial.margin, True, support, trial.fresh[-1].bearing
        )
        if trial.wedge is not None:
            self._stand(body_of(trial.wedge.vertices, WEDGE, "wedge"), trial.wedge)
        self._stand(body, stone)
        self.structure.lay(trial.fresh, trial.state)
        self.laid.append(stone)
        self.failed.clear()
        self.overlap = max(self.overlap, found.overlap)
        if number in self.left:
            self.left.remove(number)
        for bed in (0, 1):
            self.known.pop((number, bed), None)
        self.say(f"{len(self.laid)} of {len(self.stones)} stones, course {course + 1}")


def _different(places: Sequence[Place]) -> list[Place]:
    """The best place of each stone in each orientation."""
    return list({(p.lying.stone, id(p.lying)): p for p in reversed(places)}.values())[::-1]


def _free_name(wanted: str, names: set[str]) -> str:
    """The name, with a number behind it where it is taken."""
    return next(n for n in (wanted, *(f"{wanted}-{k}" for k in range(len(names) + 1))) if n not in names)


def _mass(body: Body, density: float) -> Mass:
    return Mass(body.centroid, body.volume, density * body.volume * GRAVITY)


def _surface(body: Body) -> Surface:
    return Surface.of(body.vertices[body.triangles])


class _Bodies:
    """Stones as bodies, made when they are first asked for."""

    def __init__(self, stones: Sequence[Stone]) -> None:
        self.stones = stones
        self.made: dict[int, Body] = {}

    def __getitem__(self, number: int) -> Body:
        if number not in self.made:
            stone = self.stones[number]
            self.made[number] = body_of(stone.vertices, stone.triangles, f"stone '{stone.id}'")
        return self.made[number]


def _ground(name: str, length: float, thickness: float, margin: float) -> Block:
    """A box with its top at 0, a margin wider than the wall on every side."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    low = np.array([-margin, -margin, -margin / 2.0])
    vertices = low + corner * (np.array([length + margin, thickness + margin, 0.0]) - low)
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return Block(name, vertices, faces, None, True, "ground")


def _finished(site: _Site, inventory: Inventory, began: float) -> RubbleWall:
    """The wall as a model with contacts, and its measures."""
    bare = _assembly(site, inventory)
    wedge = np.array([isinstance(what, Wedge) for what in site.kind])
    number = np.where(wedge, len(site.laid) + np.cumsum(wedge), np.cumsum(~wedge))
    contacts, patches = gathered(site.structure.meetings(number.tolist()))
    whole = Assembly(bare.blocks, contacts, (), bare.name)
    return RubbleWall(
        tuple(site.laid),
        np.array(sorted(site.left + site.aside + site.small), np.int64),
        site.settings,
        _measures(site, perf_counter() - began),
        whole,
        patches,
        sum(isinstance(what, Wedge) for what in site.kind),
    )


def _assembly(site: _Site, inventory: Inventory) -> Assembly:
    """Blocks of the wall, the ground first."""
    names = {s.id for s in inventory.stones} | {site.ground.id}
    stones: list[Block] = [site.ground]
    wedges: list[Block] = []
    for what, mesh in zip(site.kind, site.stood, strict=True):
        faces = tuple(map(tuple, mesh.triangles.tolist()))
        if isinstance(what, Wedge):
            name = _free_name(f"wedge-{len(wedges) + 1}", names)
            wedges.append(Block(name, mesh.vertices, faces, None, False, "chinking"))
        else:
            stone = inventory.stones[what.stone]
            stones.append(Block(stone.id, mesh.vertices, faces, stone.density, False, f"course-{what.course}"))
    blocks = stones + wedges
    return Assembly(tuple(blocks), None, (), "rubble wall")


def _measures(site: _Site, seconds: float) -> Measures:
    volume = sum(site.stones[laid.stone].volume for laid in site.laid)
    skyline = float(site.map.max(axis=1).sum()) * site.cell * site.map.shape[1] * site.cell
    return Measures(
        1.0 - volume / skyline,
        1.0 - volume / (float(site.map.sum()) * site.cell**2),
        sum(laid.stable for laid in site.laid) / len(site.stones),
        1 + max(laid.course for laid in site.laid),
        float(max(high[2] for high in site.highs)),
        *site.size,
        site.overlap,
        seconds,
    )


def largest_overlap(assembly: Assembly) -> tuple[float, tuple[str, str]]:
    """Largest volume that two blocks have in common, as share of the smaller one, and which two; by exact solids."""
    boxes = [(b.vertices.min(axis=0), b.vertices.max(axis=0)) for b in assembly.blocks]
    solids: list[Any] = [solid_of(b.vertices, b.faces, b.id) for b in assembly.blocks]
    low, high = (np.array([box[k] for box in boxes]) for k in (0, 1))
    worst: tuple[float, tuple[str, str]] = (0.0, ("", ""))
    for a in range(len(solids)):
        for b in (np.flatnonzero(((low[a + 1 :] < high[a]) & (high[a + 1 :] > low[a])).all(axis=1)) + a + 1).tolist():
            smaller = min(float(assembly.mass.volume[a]), float(assembly.mass.volume[b]))
            share = solid_volume(intersection(solids[a], solids[b])) / smaller
            if share > worst[0]:
                worst = share, (assembly.blocks[a].id, assembly.blocks[b].id)
    return worst
