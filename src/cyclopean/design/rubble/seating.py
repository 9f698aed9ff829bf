"""Set a stone down: move it a little until it rests, on exact meshes.

A stone at rest without friction lies where no small motion lowers its centre of mass. From where it was dropped we go
there by linear programmes in its six small motions (t, w) about a point o:

    minimise  t_z + grip |t_xy| + SLIDE |w|     subject to  gap_k + n_k . t + ((p_k - o) x n_k) . w >= CLEARANCE

for every near pair k of a vertex and a face, or of two edges (`gaps.gaps_between`), |t| and |w| within a trust region.
After each step all gaps are measured anew on the turned mesh; a step that does not lower the stone, or that runs into
something, is taken back, what it ran into is added to the programme, and the trust region halved.

The price of moving sideways stands for friction: the motion is that of the point o below the centre of mass, as low as
the stone reaches, about where it touches, so that rocking costs nothing and sliding does. Without it nearly every stone
slides to the end of its travel, for rough beds slope; with a grip of 0.5, of 40 quarry stones that were laid in a wall
95 % came to stand instead of 77 %, in a third of the time.

The multipliers of the last programme are contact forces: they balance a weight of 1, but for a sideways hold of no more
than the grip. A basic solution of a programme in six unknowns has no more than six of them.

Heyman's test is made apart from all this: the hull, seen from above, of the points where the stone is borne, and how
far inside its border the centre of mass stands. That no two stones share a volume is found out by exact solids; where
they do, the stone is lifted until they do not.

Lengths are in units of the cube root of the stone's volume, in a frame that turns with the stone about the vertical,
so that nothing depends on the unit of length, or on where the wall stands and which way it runs.

By hand, for a box of 2 x 1 x 1 lowered on a table: four contacts under its corners, margin 0.5.

>>> from cyclopean.geometry.solids import CUBE
>>> corner = [[x, y, z] for x in (0, 2) for y in (0, 1) for z in (0, 1)]
>>> box = body_of(corner, [t for a, b, c, d in CUBE for t in ((a, b, c), (a, c, d))])
>>> found = seat(box, np.eye(3), [5.0, 0.0, 0.03])
>>> round(found.margin, 6), len(found.contacts), abs(float(found.shift[2])) < 1e-4
(0.5, 4, True)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.design.rubble.dual_simplex import least
from cyclopean.design.rubble.features import Body, Features, body_of
from cyclopean.design.rubble.gaps import Gaps, NearPairs, Surroundings, gaps_between, near_pairs
from cyclopean.errors import InputError
from cyclopean.geometry import crossed, rotations
from cyclopean.geometry.polygon import convex_hull
from cyclopean.geometry.solids import intersection, solid_volume

__all__ = ["Seat", "body_of", "heyman_margin", "overlap_share", "seat"]

# Lengths in units of the cube root of the stone's volume.
SLIDE = 1e-3  # price of moving sideways or turning, against that of height: slopes below it do not carry a stone off
CLEARANCE = 1e-5  # left between the stone and what it lies on: a few micrometres, a hundred times what solids lose
GRIP = 0.6  # friction counted on while a stone comes to rest: tan 31 degrees
TWIST = 0.3  # lever at which turning about the vertical slides
TOUCH = 5e-4  # gap up to which two points count as touching
FIRST = 0.05  # trust region at the start: 1.5 cm for a stone of half a metre
WIDEST = 0.1  # trust region at most
SMALL = 0.002  # trust region below which short steps do not make it smaller
LAST = 2e-6  # trust region at which we stop
GAIN = 1e-7  # predicted descent at which we stop
ARM = 0.8  # lever at which a rotation counts as much as a translation
REACH = 1.5  # trust regions within which gaps are looked at: what a point moves by in a step, but for rare ones
SPARE = 0.3  # around the stone: what is looked at, at first
ZONE, TURNED = 0.3, 0.25  # distance and radians within which pairs are gathered, so that they serve for several steps
FALL = 4.0  # times `travel`: how far a stone may sink
ALL_WAYS = np.array([1.0, 1.0, 1.0, 1.0 / ARM, 1.0 / ARM, 1.0 / ARM])
STEPS = 80  # towards its rest; a stone that needs more counts as sliding on
TRAVEL = 0.1  # sideways: 5 cm for a stone of half a metre
TURN = 0.35  # radians
AGREED = 0.1  # share of the predicted descent that a step must bring
WELL = 0.7  # share from which the trust region grows
ELASTIC = 1e3  # price of a gap that cannot be kept open, against that of height
BEARING = 0.25  # least upward component of the normal of a contact that bears; steeper ones only steady the stone
SHARED = 1e-9  # share of the stone's volume below which an overlap is rounding
LIFTS = 24  # doublings of the first height at most


@dataclass(frozen=True, slots=True, eq=False)
class Seat:
    """Where a stone came to rest, on what, and how safely."""

    rotation: Floats  # (3, 3)
    shift: Floats  # (3,) m: a point x of the stone's frame is at rotation x + shift
    contacts: Floats  # (n, 3) m: where it touches
    normals: Floats  # (n, 3) unit, into the stone
    forces: Floats  # (n,) along the normals, in weights of the stone; at most six are not 0; none where it slid
    bodies: Ints  # (n,) index of the placed body touched; -1 = ground
    margin: float  # m: centre of mass inside the border of the hull of its bearing contacts; negative outside
    lift: float  # m that it was raised by at the end, as exact solids found an overlap
    overlap: float  # largest volume shared with one placed body, over its own; NaN where it was given up
    slid: bool  # it came to the end of its travel, or of the steps allowed, and not to rest
    steps: int  # linear programmes solved


def seat(
    body: Body,
    rotation: ArrayLike,
    shift: ArrayLike,
    placed: Sequence[Body] = (),
    ground: float | None = 0.0,
    *,
    travel: float = TRAVEL,
    turn: float = TURN,
    grip: float = GRIP,
    give_up: bool = False,
) -> Seat:
    """Let one stone find its rest on stones already placed, and on the ground.

    Parameters
    ----------
    body : Body
        The stone in its own frame, from `body_of`.
    rotation, shift : (3, 3), (3,) array_like
        Where it was dropped: rotation x + shift, m.
    placed : sequence of Body
        What lies there, where it lies (`Body.moved`). Those that are out of reach cost next to nothing.
    ground : float or None
        Height of level ground (m); None = there is none.
    travel : float
        How far it may go sideways along each axis, in cube roots of its volume; it may sink four times as far.
    turn : float
        How far it may turn about each axis (radians).
    grip : float
        Slope below which a stone does not slide, from nearly 0 to 1.
    give_up : bool
        Leave a stone that slid off where it does not stand, without a look at what it shares with others.

    Returns
    -------
    Seat

    Raises
    ------
    InputError
        A pose that is none, or a travel or turn that is not positive.
    """
    spin, start = _pose(rotation, shift)
    if not 0.0 < travel < 1.0:
        raise InputError(f"travel: {travel:g} cube roots of the stone's volume; give a number between 0 and 1")
    if not 0.0 < turn < 1.0:
        raise InputError(f"turn: {turn:g} radians; give a number between 0 and 1")
    if not SLIDE <= grip <= 1.0:
        raise InputError(f"grip: {grip:g}; give a slope between {SLIDE:g} and 1")
    limit = np.array([travel, travel, FALL * travel, turn, turn, turn])
    unit = float(np.cbrt(body.volume))
    frame = _heading(spin)
    centre = spin @ body.centroid + start
    to = frame @ spin
    stone = body.features.scaled(1.0 / unit, to, -to @ body.centroid / unit)
    level = None if ground is None else (ground - float(centre[2])) / unit
    rest = _rest(_Neighbourhood(stone, (centre, frame, unit), placed, level), limit, grip)
    spin = frame.T @ rest.rotation @ frame @ spin
    settled = centre + unit * (frame.T @ rest.shift)
    there = settled - spin @ body.centroid
    lift, overlap = 0.0, np.nan
    if not (give_up and rest.slid) or _borne(rest, 0.0, unit, frame, centre, settled)[2] > 0.0:
        lift, overlap = _lifted(body.moved(spin, there), placed, unit)
    up = np.array([0.0, 0.0, lift])
    there = there + up
    touched, force, margin = _borne(rest, lift / unit, unit, frame, centre, settled)
    points, normals = centre + unit * (touched.point @ frame) + up, touched.normal @ frame
    return Seat(spin, there, points, normals, force, touched.body, margin, lift, overlap, rest.slid, rest.steps)


def _borne(
    rest: "_Rest", lift: float, unit: float, frame: Floats, centre: Floats, settled: Floats
) -> tuple[Gaps, Floats, float]:
    """What touches or carries, its forces, and the margin (m)."""
    touched, force = _touching(rest, lift)
    bearing = (touched.normal @ frame)[:, 2] >= BEARING
    return touched, force, heyman_margin((centre + unit * (touched.point @ frame))[bearing], settled)


def _pose(rotation: ArrayLike, shift: ArrayLike) -> tuple[Floats, Floats]:
    turn, start = sealed("rotation", rotation, 3, 3), sealed("shift", shift, 3)
    if not (np.abs(turn @ turn.T - np.eye(3)).max() <= 1e-6 and np.linalg.det(turn) > 0.0):
        raise InputError("rotation: is not a rotation matrix")
    return turn, start


def _heading(turn: Floats) -> Floats:
    """(3, 3) rows: a frame with z up that turns with the stone about the vertical."""
    flat = turn[:2]
    k = int(np.argmax(np.linalg.norm(flat, axis=0) > 0.5))
    x, y = flat[:, k] / np.linalg.norm(flat[:, k])
    return np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]])


def _scene(stone: Features, to: tuple[Floats, Floats, float], placed: Sequence[Body], spare: float) -> Features:
    """What is within `spare` of the box around a stone, in its frame about `to` (its centre, axes, and unit)."""
    centre, frame, unit = to
    low, high = stone.point.min(axis=0) - spare, stone.point.max(axis=0) + spare
    middle, half = unit * (low + high) / 2.0 @ frame + centre, unit * (high - low) / 2.0 @ np.abs(frame)
    there = [stone.cropped(np.full(3, np.inf), np.full(3, -np.inf))]  # nothing
    for k, other in enumerate(placed):
        if np.all((other.low <= middle + half) & (other.high >= middle - half)):
            near = other.features.cropped(middle - half, middle + half, k)
            there.append(near.scaled(1.0 / unit, frame, -frame @ centre / unit))
    return Features.joined(there)


def _radius(stone: Features) -> float:
    """Farthest point of the stone from its centroid."""
    return float(np.linalg.norm(stone.point, axis=1).max(initial=0.0))


@dataclass(frozen=True, slots=True, eq=False)
class _Rest:
    rotation: Floats
    shift: Floats
    gaps: Gaps
    force: Floats  # (g,)
    slid: bool
    steps: int


class _Neighbourhood:
    """Gaps of a stone at a pose; what is listed is gathered anew only once the stone may have left it behind."""

    def __init__(
        self, stone: Features, to: tuple[Floats, Floats, float], placed: Sequence[Body], ground: float | None
    ) -> None:
        self.stone, self.to, self.placed, self.ground = stone, to, placed, ground
        self.pairs: NearPairs | None = None
        self.at = np.eye(3), np.zeros(3)
        self.radius = _radius(stone)
        self.here, self.spare = Surroundings.of(stone), 0.0

    def gaps(self, rotation: Floats, shift: Floats, reach: float) -> Gaps:
        turned = float(np.linalg.norm(rotation - self.at[0])) / np.sqrt(2.0)
        if self.pairs is None or self._moved(rotation, shift, *self.at) + reach > ZONE or turned > TURNED:
            self.at = rotation, shift
            wanted = self._moved(rotation, shift, np.eye(3), np.zeros(3)) + ZONE
            if wanted > self.spare:
                self.spare = max(SPARE, 1.3 * wanted)
                self.scene = _scene(self.stone, self.to, self.placed, self.spare)
                self.around = Surroundings.of(self.scene)
            self.pairs = near_pairs(self.here, rotation, shift, self.around, ZONE, TURNED)
        return gaps_between(self.stone, rotation, shift, self.scene, self.pairs, reach, self.ground)

    def _moved(self, rotation: Floats, shift: Floats, spin: Floats, start: Floats) -> float:
        """How far any point of the stone is at most from where it was."""
        turned = float(np.linalg.norm(rotation - spin) / np.sqrt(2.0))
        return float(np.linalg.norm(shift - start)) + self.radius * turned


def _rest(near: _Neighbourhood, limit: Floats, grip: float) -> _Rest:
    """Descend by linear programmes until no small motion lowers the stone, or it has come to the end of its travel."""
    rotation, shift, total = np.eye(3), np.zeros(3), np.zeros(6)
    trust, steps = FIRST, 0
    below = np.array([0.0, 0.0, float(near.stone.point[:, 2].min())])  # of the centroid
    price = np.array([grip, grip, 0.0, SLIDE, SLIDE, max(SLIDE, TWIST * grip)])
    gaps = near.gaps(rotation, shift, _reach(trust))
    rows, room = _rows(gaps, shift + below)
    missed_rows, missed_room = rows[:0], room[:0]
    force = np.zeros(len(room))
    while steps < STEPS and trust >= LAST and not np.any(np.abs(total) >= limit * (1.0 - 1e-9)):
        steps += 1
        box = trust * ALL_WAYS
        low, high = np.maximum(-box, -limit - total), np.minimum(box, limit - total)
        all_rows, all_room = np.vstack([rows, missed_rows]), np.append(room, missed_room)
        step, push = _programme(all_rows, all_room, low, high, price)
        gain = _merit(0.0, room) - _merit(step[2], all_room + all_rows @ step)
        if not gain > GAIN:
            force = push[: len(room)]
            if not len(missed_room):
                break
            missed_rows, missed_room, trust = rows[:0], room[:0], trust / 4.0  # what was missed is not so near
            continue
        spin = rotations(step[None, 3:])[0]
        turned, there = spin @ rotation, shift + step[:3] + below - spin @ below
        found = near.gaps(turned, there, _reach(trust))
        new_rows, new_room = _rows(found, there + below)
        share = (_merit(0.0, room) - _merit(there[2] - shift[2], new_room)) / gain
        if share >= AGREED:
            rotation, shift, total = turned, there, total + step
            gaps, rows, room, force = found, new_rows, new_room, np.zeros(len(new_room))
            missed_rows, missed_room = rows[:0], room[:0]
            if share >= WELL and np.any(np.abs(step) >= box * (1.0 - 1e-9)):
                trust = min(2.0 * trust, WIDEST)
            else:
                trust = max(min(trust, 2.0 * float(np.max(np.abs(step / ALL_WAYS)))), min(trust, SMALL))
            continue
        at_start = new_room - new_rows @ step
        missed = (new_room < 0.0) & (at_start >= 0.0)
        missed_rows, missed_room = new_rows[missed], at_start[missed]
        trust /= 2.0 if missed.any() else 4.0
    slid = steps >= STEPS or bool(np.any(np.abs(total) >= limit * (1.0 - 1e-9)))
    if not slid and not force.any():  # it stopped for want of steps, or of room to make them
        force = _programme(rows, room, -SMALL * ALL_WAYS, SMALL * ALL_WAYS, price)[1]
    return _Rest(rotation, shift, gaps, force, slid, steps)


def _reach(trust: float) -> float:
    """Distance within which gaps are looked at: so that the next step may be twice as long."""
    return REACH * min(2.0 * trust, WIDEST)


def _rows(gaps: Gaps, centre: Floats) -> tuple[Floats, Floats]:
    """(g, 6) gradients of the gaps by a small motion about the centre, and (g,) how far each may close."""
    lever = crossed(gaps.point - centre, gaps.normal)
    return np.concatenate([gaps.normal, lever], axis=1), gaps.gap - CLEARANCE


def _merit(height: float, room: Floats) -> float:
    """Height of the centre of mass, and a price for the deepest gap that has closed."""
    return height + 10.0 * max(0.0, -float(room.min(initial=0.0)))


def _programme(rows: Floats, room: Floats, low: Floats, high: Floats, price: Floats) -> tuple[Floats, Floats]:
    """The best small motion (6,) from `low` to `high`, and the multipliers (g,) of the gaps."""
    low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
    near = np.flatnonzero(room + np.minimum(rows * low, rows * high).sum(axis=1) <= 0.0)  # others cannot close
    down = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    cost = np.concatenate([price + down, price - down, [ELASTIC]])
    matrix = np.hstack([rows[near], -rows[near], np.ones((len(near), 1))])
    x, multiplier = least(cost, matrix, room[near], np.zeros(13), np.concatenate([high, -low, [np.inf]]))
    force = np.zeros(len(room))
    force[near] = multiplier
    return x[:6] - x[6:12], force


def _lifted(body: Body, placed: Sequence[Body], unit: float) -> tuple[float, float]:
    """How far (m) the stone must be raised to share no volume with any other, and what share it then has in common.

    Raised by twice as much each time, and then let down again to the middle of the last two heights, twice.
    """
    low, high, overlap = 0.0, 0.0, overlap_share(body, placed)
    if overlap <= SHARED:
        return 0.0, overlap
    up = np.array([0.0, 0.0, 1.0])
    for k in range(LIFTS):
        low, high = high, unit * CLEARANCE * 2.0**k
        overlap = overlap_share(body.moved(np.eye(3), high * up), placed)
        if overlap <= SHARED:
            break
    for _ in range(2):
        middle = (low + high) / 2.0
        share = overlap_share(body.moved(np.eye(3), middle * up), placed)
        low, high, overlap = (low, middle, share) if share <= SHARED else (middle, high, overlap)
    return high, overlap


def overlap_share(body: Body, placed: Sequence[Body]) -> float:
    """Largest volume that a stone shares with one other, over its own; by exact solids."""
    worst = 0.0
    for other in placed:
        if np.all((body.low < other.high) & (other.low < body.high)):
            worst = max(worst, solid_volume(intersection(body.solid, other.solid)) / body.volume)
    return worst


def _touching(rest: _Rest, lift: float) -> tuple[Gaps, Floats]:
    """The pairs that touch or carry, each point of each body once, and their forces."""
    gaps = rest.gaps
    kept = np.flatnonzero((gaps.gap <= TOUCH + lift) | (rest.force > 0.0))
    if not len(kept):
        return Gaps(gaps.point[kept], gaps.normal[kept], gaps.gap[kept], gaps.body[kept]), np.zeros(0)
    kept = kept[np.argsort(-rest.force[kept], kind="stable")]
    apart = np.linalg.norm(gaps.point[kept][:, None] - gaps.point[kept][None], axis=2)
    along = gaps.normal[kept] @ gaps.normal[kept].T
    same = (apart <= 2.0 * TOUCH) & (along >= 0.99) & (gaps.body[kept][:, None] == gaps.body[kept][None])
    leader = np.argmax(same, axis=1)
    first = leader == np.arange(len(kept))
    force = np.bincount(leader, rest.force[kept], len(kept))[first]
    k = kept[first]
    return Gaps(gaps.point[k], gaps.normal[k], gaps.gap[k], gaps.body[k]), force


def heyman_margin(points: ArrayLike, centre: ArrayLike) -> float:
    """How far (m) a centre of mass stands inside the border of the hull of its contacts, seen from above.

    Negative outside: the distance to the hull. Of two contacts the hull is a segment, which has no inside; without
    contacts it is minus infinity.

    Parameters
    ----------
    points : (n, 3) array_like
        Contacts, m.
    centre : (3,) array_like
        Centre of mass, m.

    Examples
    --------
    >>> heyman_margin([[0, 0, 0], [4, 0, 1], [0, 4, 0], [4, 4, 0]], [1.0, 2.0, 9.0])
    1.0
    >>> heyman_margin([[0, 0, 0], [4, 0, 0]], [2.0, 3.0, 0.0])
    -3.0
    """
    xy = sealed("contacts", points, None, 3)[:, :2] - sealed("centre", centre, 3)[:2]
    if not len(xy):
        return -np.inf
    ring = convex_hull(xy)
    along = np.roll(ring, -1, axis=0) - ring
    square = np.maximum(np.einsum("ki,ki->k", along, along), 1e-300)
    share = np.clip(-np.einsum("ki,ki->k", ring, along) / square, 0.0, 1.0)
    nearest = float(np.linalg.norm(ring + share[:, None] * along, axis=1).min())
    left = ring[:, 0] * np.roll(ring[:, 1], -1) - ring[:, 1] * np.roll(ring[:, 0], -1)
    return nearest if len(ring) > 2 and bool(np.all(left > 0.0)) else -nearest
