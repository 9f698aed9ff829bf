"""The building site of a rubble wall: what stands, the height map over it, the stones that are left and what for."""

import hashlib
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from cyclopean.analysis import DENSITY
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block
from cyclopean.design.rubble.as_built import NOTHING, AsBuilt
from cyclopean.design.rubble.choosing import Looks
from cyclopean.design.rubble.features import Body, body_of
from cyclopean.design.rubble.height_map import lying_raster
from cyclopean.design.rubble.masons_rules import NEAR_FACE
from cyclopean.design.rubble.orientations import Bedded, bedded
from cyclopean.design.rubble.places import FULL, Box, Place
from cyclopean.design.rubble.standing import GRAVITY, Mass, Structure
from cyclopean.design.rubble.stock import BEARING, SPANNING, kept_back
from cyclopean.design.rubble.touching import TOUCH
from cyclopean.design.rubble.trials import INSIDE, Seated, Trial
from cyclopean.design.rubble.wall import Laid, SettleSettings, unit_size
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError
from cyclopean.geometry import triangles
from cyclopean.geometry.solids import CUBE

__all__ = ["Progress", "Site", "free_name"]

PROUD = 0.07  # of its size: by which a stone may stand out of a face, or above the ceiling
THROUGH = 1.5  # m between through-stones of a wall of two wythes, as masons have it
INTO = 1.25  # times its length along the wall: from so deep on a stone lies with its length into it
LONGEST = 3.0  # times the unit: width of the ground around the wall

Progress = Callable[[str], None]

NO_PLACE, LARGE = "no place was left for it", "too large for the wall"


class Site:
    """The wall while it is laid."""

    def __init__(
        self, stones: Sequence[Stone], settings: SettleSettings, say: Progress, before: AsBuilt = NOTHING
    ) -> None:
        assert settings.cell is not None
        self.stones, self.settings, self.shape, self.say = stones, settings, settings.shape(), say
        self.cell, self.unit, self.before = settings.cell, unit_size(before.at_hand(stones), before.volumes), before
        inward = float(np.tan(np.radians(settings.inward)))
        self.room = self.shape.room(self.cell)  # (n, m) m: height up to which each cell is in the wall
        deep = max(round(NEAR_FACE * self.shape.thickness / self.cell), 1)
        self.looks = Looks(
            self.room, deep, self.cell, self.unit, settings.scores, settings.dress, inward, settings.wythes
        )
        if self.shape.opening is not None:
            under = self.shape.opened(self.cell)
            self.room[under] = np.minimum(self.room[under], self.shape.opening.sill)
        self.map: Floats = np.where(self.room > 0.0, 0.0, FULL)
        self.label = np.full(self.map.shape, -1)  # which stone is on top of each cell; -1 = the ground
        self.content = [_content(stone) for stone in stones]
        used = {block.id for block in before.blocks}
        at_hand = [k for k, stone in enumerate(stones) if stone.id not in used]
        self.left = self.by_size(at_hand) if settings.look_ahead else at_hand
        self.course = before.course  # from which on is laid
        self.first = 1.9  # of the unit: the ceiling at the start
        self.through = settings.through or (THROUGH if settings.wythes == 2 else None)  # m: between through-stones
        asked = {"cope"} if settings.copes else set()
        asked |= {"hearting"} if settings.hearting or settings.pins or settings.wythes == 2 else set()
        self.kept = kept_back(stones, self.left, self.shape, frozenset(asked), self.through)
        self.ties = 0  # rows of through-stones that were begun
        self.row: list[float] = []  # m along the wall: through-stones of this row
        self.laid: list[Laid] = []
        self.taken: list[tuple[Trial, int, str]] = []  # what was laid, in which course and as what
        self.known: dict[int, list[Bedded]] = {}
        self.bodies: dict[int, Body] = {}  # stones in their own frames
        self.stood: dict[int, Body] = {}  # by their numbers in the structure
        self.boxes = np.zeros((0, 2, 3))  # lowest and highest corners of what stands, in the same order
        self.why: dict[int, Counter[str]] = {}  # why each stone was not laid where it was tried
        self.overlap = 0.0
        self.ground = _ground(free_name("ground", {s.id for s in stones} | used), self.shape.size, LONGEST * self.unit)
        floor = body_of(self.ground.vertices, triangles(Assembly((self.ground,), None, ()).mesh)[0])
        self.structure = Structure(floor, settings.friction, settings.lean)
        for block, body in zip(before.blocks, before.bodies, strict=True):
            self._adopt(block, body)
        if before.blocks and not self.structure.resolve():
            raise InputError(
                f"standing: no forces hold what stands with friction {settings.friction:g} and gravity leaning by"
                f" {settings.lean:g} degrees; try a smaller `lean`, or `check` the model"
            )

    def _adopt(self, block: Block, body: Body) -> None:
        """Count a block that stands already among what stands."""
        density = block.density or DENSITY
        mass = Mass(body.centroid, body.volume, density * body.volume * GRAVITY)
        fresh = self.structure.fresh(mass, body, self.near(body.low, body.high, TOUCH * float(np.cbrt(body.volume))))
        if not fresh.joints:
            raise InputError(
                f"standing: block '{block.id}' touches nothing that comes before it in the file; list blocks from the"
                " ground up, and leave none in the air"
            )
        number = self.structure.next
        self.structure.lay((fresh,), ())
        self.stand(number, body)

    def bedded(self, stone: int) -> list[Bedded]:
        """A stone in its orientations."""
        if stone not in self.known:
            self.known[stone] = bedded(stone, self.stones[stone], self.settings.yaws, self.cell)
        return self.known[stone]

    def wants_binder(self) -> bool:
        """Whether too few stones lie with their length into the wall."""
        long, deep = (self.boxes[:, 1] - self.boxes[:, 0])[:, :2].T
        return int(np.count_nonzero(deep >= INTO * long)) < self.settings.binders * (len(self.boxes) + 1)

    def binding(self, stone: int) -> list[Bedded]:
        """A stone in those of its orientations in which its length lies into the wall."""
        shapes = [(lying, lying.raster.low.shape) for lying in self.bedded(stone)]
        return [lying for lying, (long, deep) in shapes if deep >= INTO * long]

    def near(self, low: Floats, high: Floats, reach: float) -> list[int]:
        """What stands nearer than reach (m) to a box."""
        near = np.asarray((self.boxes[:, 0] <= high + reach) & (self.boxes[:, 1] >= low - reach)).all(axis=1)
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

    def margin(self, body: Body) -> float:
        """What is asked for (m)."""
        wanted = self.settings.margin
        return INSIDE * float(np.cbrt(body.volume)) if wanted is None else wanted

    def within(self, body: Body, ceiling: float) -> bool:
        """Whether a body is within the faces of the wall, and below the ceiling (m)."""
        proud = PROUD * float(np.cbrt(body.volume))
        return bool(body.high[2] <= ceiling + proud) and self.shape.holds(body.vertices, proud)

    def by_size(self, stones: Iterable[int]) -> list[int]:
        """Stones, the largest first."""
        return sorted(stones, key=lambda k: self.content[k])

    def some_of(self, stones: Sequence[int], count: int) -> list[int]:
        """So many of some stones, of every size, and nearly the same ones once a few have been laid."""
        some = set(sorted(stones, key=lambda k: self.content[k][1:])[:count])
        return [k for k in stones if k in some]

    def begin(self) -> None:
        """Find all forces anew, as a new course begins: what was laid before does not matter then."""
        self.structure.resolve()

    def take(self, trial: Trial, course: int, role: str) -> list[Box]:
        """Lay stones, and raise the map by them; the boxes of cells that they cover."""
        number = self.structure.next
        self.taken.append((trial, course, role))
        self.structure.lay([one.fresh for one in trial.stones], trial.state)
        boxes = []
        for k, one in enumerate(trial.stones):
            what = "pin" if k < len(trial.stones) - 1 else role
            if what == "stone" and one.stone in self.kept.get("hearting", ()):
                what = "hearting"
            self.laid.append(
                Laid(
                    one.stone, one.rotation, one.shift, course, what, one.margin, True, one.fresh.bearing, "", one.cuts
                )
            )
            self.overlap = max(self.overlap, one.overlap)
            self._used(one.stone)
            if what == "through-stone":
                self.row.append(float(one.body.centroid[0]))
            boxes.append(self.stand(number + k, one.body))
        self.say(f"{len(self.laid)} of {len(self.stones)} stones, course {course + 1}")
        return boxes

    def without(self, count: int) -> "Site":
        """The wall before so many trials, the last ones; their stones come after all others when it is gone on with."""
        kept, out = self.taken[: len(self.taken) - count], self.taken[len(self.taken) - count :]
        other = Site(self.stones, self.settings, self.say, self.before)
        other.first, other.bodies = self.first, self.bodies
        for trial, course, role in kept:
            other.take(trial, course, role)
        other.course = out[0][1] if out else self.course
        last = {one.stone for trial, _, _ in out for one in trial.stones}
        other.kept["stone"].sort(key=lambda k: k in last)  # the order is kept among the others
        return other

    def leave(self, one: Seated, course: int) -> Box:
        """Put a stone down that does not stand by itself, flagged with the reason."""
        number = self.structure.next
        self.structure.lay((one.fresh,), ())
        self.overlap = max(self.overlap, one.overlap)
        points, why = one.fresh.bearing, self.reason(one.stone)
        self.laid.append(Laid(one.stone, one.rotation, one.shift, course, "stone", one.margin, False, points, why))
        self._used(one.stone)
        return self.stand(number, one.body)

    def reason(self, stone: int) -> str:
        """Why a stone is not in the wall: what happened most often where it was tried."""
        if not any(self._fits(lying) for lying in self.bedded(stone)):
            return LARGE
        tried = self.why.get(stone)
        return tried.most_common(1)[0][0] if tried else NO_PLACE

    def _fits(self, lying: Bedded) -> bool:
        """Whether a stone would have room in the wall if it were empty."""
        (w, d), (n, m) = lying.raster.low.shape, self.room.shape
        return w <= n and d <= m and lying.top - lying.bottom <= self.shape.height

    def _used(self, stone: int) -> None:
        self.left.remove(stone)
        self.known.pop(stone, None)
        for stones in self.kept.values():
            if stone in stones:
                stones.remove(stone)

    def ties_here(self, place: Place) -> bool:
        """Whether a through-stone is wanted at a place, and reaches far enough through the wall there."""
        assert self.through is not None
        w, d = place.lying.raster.low.shape
        x = (place.cell[0] + w / 2.0) * self.cell
        deep = d * self.cell >= SPANNING * self.shape.thickness - self.cell
        return deep and all(abs(x - other) >= 0.75 * self.through for other in self.row)

    def bridges(self, place: Place) -> bool:
        """Whether a lintel bears on both sides of the opening there."""
        gap = self.shape.opening
        assert gap is not None
        low = place.cell[0] * self.cell
        high = low + place.lying.raster.low.shape[0] * self.cell
        bearing = min(BEARING, gap.width / 5.0) / 2.0
        return low <= gap.left - bearing and high >= gap.left + gap.width + bearing

    def bridged(self) -> bool:
        """Let the wall go on above the opening, where both jambs have come to its height; whether that was now."""
        gap = self.shape.opening
        if gap is None or "lintel" not in self.kept:
            return False
        x = (np.arange(len(self.map)) + 0.5) * self.cell
        bearing = max(min(BEARING, gap.width / 5.0), self.unit / 2.0)  # stones are round: less of a jamb may be empty
        soffit, proud = gap.sill + gap.height, PROUD * self.unit
        for side in (gap.left - x, x - gap.left - gap.width):
            jamb = self.map[(side > 0.0) & (side < bearing)]
            if not float(np.median(jamb[jamb < FULL])) >= soffit - proud:
                return False
        under, whole = self.shape.opened(self.cell), self.shape.room(self.cell)
        self.room[under] = whole[under]
        self.map[under & (whole > 0.0)] = soffit - proud
        return True

    def stand(self, number: int, body: Body) -> Box:
        """Count a body among what stands."""
        self.stood[number] = body
        self.boxes = np.concatenate([self.boxes, [[body.low, body.high]]])
        raster = lying_raster(body.vertices, body.triangles, self.cell)
        i, j = (int(k) for k in np.rint(raster.corner / self.cell))
        w, d = raster.low.shape
        a, b = max(-i, 0), max(-j, 0)
        here = np.s_[max(i, 0) : max(i + w, 0), max(j, 0) : max(j + d, 0)]
        under, label = self.map[here], self.label[here]
        high = raster.high[a : a + under.shape[0], b : b + under.shape[1]]
        up = high > under
        under[up], label[up] = high[up], number
        return max(i, 0), max(j, 0), max(i + w, 0), max(j + d, 0)


def _content(stone: Stone) -> tuple[float, bytes, str]:
    """What stones are sorted by: the largest first, and never by where they stand in the inventory."""
    return -stone.volume, hashlib.sha256(stone.vertices.tobytes() + stone.triangles.tobytes()).digest(), stone.id


def free_name(wanted: str, names: set[str]) -> str:
    """The name, with a number behind it where it is taken."""
    return next(n for n in (wanted, *(f"{wanted}-{k}" for k in range(len(names) + 1))) if n not in names)


def _ground(name: str, size: tuple[float, float], margin: float) -> Block:
    """A box with its top at 0, a margin wider than the wall on every side."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    low = np.array([-margin, -margin, -margin / 2.0])
    vertices = low + corner * (np.array([size[0] + margin, size[1] + margin, 0.0]) - low)
    return Block(name, vertices, CUBE, None, True, "ground")
