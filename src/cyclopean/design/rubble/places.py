"""Where a found stone could lie: its bedded orientations, and what speaks for and against each place on the map.

A stone is bedded on a face of its convex hull on which it can rest: from its shortest axis pointing down it rolls, face
by face, until it stands on the face below its centre of mass; so on both flips, and on those of its middle axis. About
the vertical it is turned by equal steps. Half of a turn away, a raster is the same one read backwards.

What speaks against a place, each term from 0 (nothing) to about 1:

support   share of the stone's plan under which it does not nearly touch what is below
centre    how far the centre of mass is from well inside the hull of what it touches; 1 on its border, 2 at most
tilt      slope by which it tips until it lies on three points, over `TIPPED`
void      mean gap under the stone over its thickness, and the length of the course that nothing could fill any more
height    how far its top is from the level of the course, over its thickness
bond      how near its end is to a head joint of the course below; 0 from a quarter of a mean stone's length on
face      how far it is from the face of the wall (of a wall of one wythe: from the farther one), over the thickness
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.design.options import not_negative
from cyclopean.design.rubble.height_map import Raster, edges_of, rasters, rest_heights
from cyclopean.design.rubble.tipping import left_under, tipped
from cyclopean.design.stones.stone import Stone

__all__ = ["Bedded", "Looked", "Place", "Slot", "Weights", "assessed", "bedded", "different", "ranked"]

DIRECTIONS = 16  # in which the hull of what touches is felt
NEAR = 0.25  # of a mean length: head joints farther from each other than that are bonded
HOLLOW = 0.6  # of its thickness: a stone that lies higher than that above what is below it bridges, it does not lie
ABOVE = 0.75  # of its thickness that a stone may rise above the level of its course
TIPPED = 0.35  # slope beyond which a stone that tips falls
OUTERMOST = 0.85  # centre term beyond which hardly a stone comes to stand
NEARLY = 0.5  # cells: gap at which a stone nearly touches
AHEAD = 12  # cells to either side that are looked at together, as the next slots will ask for them
BESIDE = 24.0  # cells: what is laid farther away along the wall than that changes nothing
DIGITS = 5  # of a mean gap: so that two places that are alike are so on any machine
LEVEL = 1e-5  # of a thickness: what heights of places are good to
EACH = 4  # places of one stone in one orientation that are looked at closely


@dataclass(frozen=True, slots=True)
class Weights:
    """Of what speaks against a place; 0 takes a term out."""

    support: float = 2.0
    centre: float = 3.0
    tilt: float = 1.5
    void: float = 1.0
    height: float = 0.2
    bond: float = 0.5
    face: float = 0.5

    def __post_init__(self) -> None:
        for name in self.__slots__:
            object.__setattr__(self, name, not_negative(f"weights: {name}", getattr(self, name)))


@dataclass(frozen=True, slots=True, eq=False)
class Bedded:
    """A stone in one orientation. Heights and plan are about its centre of mass."""

    stone: int
    rotation: Floats  # (3, 3)
    raster: Raster
    bed: int  # 0 on its flattest bed, 1 on its second choice
    top: float  # m: its highest point
    thickness: float  # m: from its lowest to its highest point

    @classmethod
    def of(cls, stone: int, rotation: Floats, raster: Raster, bed: int) -> "Bedded":
        """A stone, turned by (3, 3), with what its raster tells."""
        top = float(raster.high.max())
        return cls(stone, rotation, raster, bed, top, top - float(raster.low.min()))


@dataclass(frozen=True, slots=True, eq=False)
class Slot:
    """The part of the map that is open to the next stone, and what it should meet there; the grid in cells."""

    first: Ints  # (2,) range of x within which its plan must lie
    across: Ints  # (2,) the same of y
    level: float  # m: top of the course
    limit: float  # m: nothing may be higher
    side: int = 0  # -1: it should lie near the lower end of `first`, 1: near the upper, 0: anywhere
    play: int = 0  # places tried along the wall, from that side
    play_across: int = 0  # places tried across it, from its face; 0 = all
    rear: bool = False  # whether its face is the upper end of `across`
    both: bool = False  # whether the wall has its other face there too
    open: tuple[float, float] = (0.0, 0.0)  # m: x between the stones that the course has so far, for a side
    joints: Floats = field(default_factory=lambda: np.zeros(0))  # (k,) m: x of the head joints below, for a side
    length: float = 1.0  # m: of a mean stone
    narrowest: float = 0.0  # m: shorter room is lost


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A stone in an orientation at a place of the map."""

    lying: Bedded
    cell: tuple[int, int]  # of the map, below cell (0, 0) of its raster
    rest: float  # m: height of its centre of mass
    cost: float


def bedded(number: int, stone: Stone, yaws: int, cell: float, beds: Sequence[int] = (0,)) -> list[Bedded]:
    """Orientations of a stone that are worth trying.

    Parameters
    ----------
    number : int
        What the stone is called by.
    stone : Stone
        A measured stone.
    yaws : int
        Turns about the vertical.
    cell : float
        Width of a cell of the map (m).
    beds : sequence of int
        0 = with the shortest axis up, 1 = with the middle one.
    """
    point = stone.vertices - stone.centroid
    normal, offset = _hull_faces(point)
    edges = edges_of(stone.triangles)
    half = yaws // 2 if yaws % 2 == 0 else yaws
    found: list[Bedded] = []
    for bed in beds:
        for sign in (-1.0, 1.0):
            down = _rolled(sign * stone.axes[2 - bed], normal, offset)
            flat = _upright(down, stone.axes[0])
            turns = [_yaw(2.0 * np.pi * k / yaws) @ flat for k in range(half)]
            made = rasters(np.stack([point @ turn.T for turn in turns]), stone.triangles, edges, cell)
            if half < yaws:
                turns += [_yaw(np.pi) @ turn for turn in turns]
                made += [_backwards(raster, cell) for raster in made]
            found += [Bedded.of(number, turn, raster, bed) for turn, raster in zip(turns, made, strict=True)]
    return found


def _backwards(raster: Raster, cell: float) -> Raster:
    """The raster of a mesh turned by half of a turn."""
    return Raster(
        np.ascontiguousarray(raster.low[::-1, ::-1]),
        np.ascontiguousarray(raster.high[::-1, ::-1]),
        -(raster.corner + cell * np.array(raster.low.shape)),
    )


def _hull_faces(point: Floats) -> tuple[Floats, Floats]:
    """Outward normals (f, 3) and distances (f,) from the centre of mass of the faces of the convex hull."""
    from scipy.spatial import ConvexHull

    plane = ConvexHull(point).equations
    return plane[:, :3], np.maximum(-plane[:, 3], 1e-12)


def _rolled(down: Floats, normal: Floats, offset: Floats) -> Floats:
    """Normal of the face on which a body comes to stand that is let go with `down` pointing down.

    It tips over the face that the plumb line from its centre of mass leaves through; each time the centre sinks.
    """
    face = int(np.argmax(normal @ down / offset))
    for _ in range(len(normal)):
        below = int(np.argmax(normal @ normal[face] / offset))
        if not offset[below] < offset[face] * (1.0 - 1e-12):
            break
        face = below
    return np.asarray(normal[face], float)


def _upright(down: Floats, along: Floats) -> Floats:
    """Rotation that takes `down` to -z and lays `along` as nearly as can be along x."""
    up = -down
    x = along - (along @ up) * up
    if not np.linalg.norm(x) > 1e-6:
        x = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def _yaw(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


Felt = tuple[float, float, float, float]  # share that nearly touches, centre term, tilt term, rest height (m)


class Looked:
    """What was found out about places, as long as nothing is laid near them; x in cells."""

    def __init__(self) -> None:
        self._felt: dict[tuple[Bedded, int, int], Felt] = {}
        self._fits: dict[tuple[Bedded, int, int], tuple[int, Floats, Floats]] = {}
        self._failed: set[tuple[Bedded, int, int]] = set()

    def felt(self, ground: Floats, places: Sequence[tuple[Bedded, tuple[int, int]]], cell: float) -> list[Felt]:
        """What `assessed` says of each place."""
        fresh = [(lying, at) for lying, at in places if (lying, *at) not in self._felt]
        for (lying, at), felt in zip(fresh, assessed(ground, fresh, cell) if fresh else (), strict=True):
            self._felt[lying, *at] = felt
        return [self._felt[lying, *at] for lying, at in places]

    def fits(self, ground: Floats, lying: Bedded, x: tuple[int, int], y: tuple[int, int]) -> tuple[Floats, Floats]:
        """Rest heights and mean gaps over the thickness (sx, sy), from cell x[0] to x[1] along, y[0] to y[1] across."""
        known = self._fits.get((lying, *y))
        if known is None or x[0] < known[0] or x[1] >= known[0] + len(known[1]):
            w, d = lying.raster.low.shape
            start, end = max(x[0] - AHEAD, 0), min(x[1] + AHEAD, ground.shape[0] - w)
            rest, gap = rest_heights(ground[start : end + w, y[0] : y[1] + d], lying.raster.low, lying.thickness)
            known = self._fits[lying, *y] = start, rest, np.round(gap / lying.thickness, DIGITS)
        start, rest, hollow = known
        here = slice(x[0] - start, x[1] - start + 1)
        return rest[here], hollow[here]

    def fail(self, place: "Place") -> None:
        """A stone was tried there in vain."""
        self._failed.add((place.lying, *place.cell))

    def failed(self, place: "Place") -> bool:
        """Whether it was."""
        return (place.lying, *place.cell) in self._failed

    def forget(self, low: float, high: float) -> None:
        """Something is laid from x = low to high (cells)."""

        def beyond(lying: Bedded, start: int, more: int = 0) -> bool:
            return start + more + lying.raster.low.shape[0] < low - BESIDE or start > high + BESIDE

        self._felt = {at: felt for at, felt in self._felt.items() if beyond(*at[:2])}
        self._failed = {at for at in self._failed if beyond(*at[:2])}
        self._fits = {at: known for at, known in self._fits.items() if beyond(at[0], known[0], len(known[1]))}


def ranked(
    ground: Floats,
    stones: Sequence[Bedded],
    slot: Slot,
    weights: Weights,
    cell: float,
    close: int,
    looked: Looked | None = None,
) -> list[Place]:
    """The best places of some stones in a slot, best first.

    All places are ranked by what is quickly known (void, height, bond, face); of the best `close` of them, support and
    centre are felt cell by cell. What was found out before is taken from `looked`.
    """
    looked = Looked() if looked is None else looked
    rough: list[tuple[float, int, int, int]] = []
    for k, lying in enumerate(stones):
        cost, corner = _quick(ground, lying, slot, weights, cell, looked)
        flat = cost.reshape(-1)
        for at in np.argsort(flat, kind="stable")[:EACH].tolist():
            if flat[at] < np.inf:
                i, j = divmod(at, cost.shape[1])
                rough.append((float(flat[at]), k, int(corner[0]) + i, int(corner[1]) + j))
    rough = sorted(rough)[:close]
    found = []
    felt = looked.felt(ground, [(stones[k], (i, j)) for _, k, i, j in rough], cell)
    for (cost_so_far, k, i, j), (support, centre, tilt, rest) in zip(rough, felt, strict=True):
        if not (tilt < 1.0 and centre <= OUTERMOST):
            continue  # it falls over, or is about to
        cost_now = cost_so_far + weights.support * (1.0 - support) + weights.centre * centre + weights.tilt * tilt
        found.append(Place(stones[k], (i, j), rest, cost_now))
    return sorted(found, key=lambda place: place.cost)


def different(places: Sequence[Place]) -> list[Place]:
    """The best place of each stone in each orientation, of places with the best first; in this order."""
    best: dict[Bedded, Place] = {}
    for place in places:
        best.setdefault(place.lying, place)
    return list(best.values())


def _quick(
    ground: Floats, lying: Bedded, slot: Slot, weights: Weights, cell: float, looked: Looked
) -> tuple[Floats, tuple[int, int]]:
    """Cost so far (sx, sy) of every place of a slot, and the place that (0, 0) stands for."""
    (x0, x1), (y0, y1) = _range(lying, slot)
    if x1 < x0 or y1 < y0:
        return np.zeros((0, 1)), (0, 0)
    w, d = lying.raster.low.shape
    thick = lying.thickness
    rest, hollow = looked.fits(ground, lying, (x0, x1), (y0, y1))
    top = rest + lying.top
    start: Floats = (x0 + np.arange(x1 - x0 + 1, dtype=float)) * cell
    costs = weights.void * (hollow + _lost(start, lying, slot, cell)[:, None])
    costs = costs + weights.height * np.abs(top - slot.level) / thick
    costs = costs + weights.bond * _unbonded(start, w * cell, slot)[:, None]
    costs = costs + weights.face * _off_face(y0 + np.arange(y1 - y0 + 1), d, slot)
    refused = (hollow > HOLLOW) | (top > slot.level + ABOVE * thick) | (top > slot.limit + LEVEL * thick)
    return np.where(refused, np.inf, costs), (x0, y0)


def _range(lying: Bedded, slot: Slot) -> tuple[tuple[int, int], tuple[int, int]]:
    """First and last cell of its plan's lower corner, along and across."""
    w, d = lying.raster.low.shape
    x0, x1 = int(slot.first[0]), int(slot.first[1]) - w
    if slot.side < 0:
        x1 = min(x1, x0 + slot.play)
    elif slot.side > 0:
        x0 = max(x0, x1 - slot.play)
    y0, y1 = int(slot.across[0]), int(slot.across[1]) - d
    if slot.play_across and not slot.rear:
        y1 = min(y1, y0 + slot.play_across)
    elif slot.play_across:
        y0 = max(y0, y1 - slot.play_across)
    return (x0, x1), (y0, y1)


def _lost(start: Floats, lying: Bedded, slot: Slot, cell: float) -> Floats:
    """(sx,) length of the course that is lost, over the stone's own.

    That is the room towards the side it is laid from, and what is left of the course where no stone fits into that.
    Where the stone reaches into its neighbour's plan, length is won.
    """
    if slot.side == 0:
        return np.zeros(len(start))
    w = lying.raster.low.shape[0] * cell
    before, after = start - slot.open[0], slot.open[1] - start - w
    near, far = (before, after) if slot.side < 0 else (after, before)
    lost: Floats = (near + np.where(far < slot.narrowest, far, 0.0)) / w
    return lost


def _unbonded(start: Floats, length: float, slot: Slot) -> Floats:
    """(sx,) how near the nearest head joint below is to the stone's free end: 1 = below it, 0 = far enough."""
    if not len(slot.joints) or slot.side == 0:
        return np.zeros(len(start))
    end = start + length if slot.side < 0 else start
    near = np.abs(end[:, None] - slot.joints).min(axis=1)
    worst: Floats = np.maximum(1.0 - near / (NEAR * slot.length), 0.0)
    return worst


def _off_face(start: Ints, width: int, slot: Slot) -> Floats:
    """(sy,) distance from the face over the thickness."""
    low, high = start - slot.across[0], slot.across[1] - start - width
    away = np.maximum(low, high) if slot.both else high if slot.rear else low
    off: Floats = away / (slot.across[1] - slot.across[0])
    return off


def assessed(ground: Floats, places: Sequence[tuple[Bedded, tuple[int, int]]], cell: float) -> list[Felt]:
    """Support (share of the plan that nearly touches), centre and tilt terms, and the rest height (m) of some places.

    Let go at rest height, a stone tips until it lies on three points (`tipping`).
    """
    size = [lying.raster.low.shape for lying, _ in places]
    need = np.full((len(places), max(w for w, _ in size), max(d for _, d in size)), -np.inf)
    for k, ((lying, (i, j)), (w, d)) in enumerate(zip(places, size, strict=True)):
        need[k, :w, :d] = ground[i : i + w, j : j + d] - lying.raster.low
    rest = need.max(axis=(1, 2))
    need -= rest[:, None, None]
    corner = np.array([lying.raster.corner for lying, _ in places])  # about the centre of mass
    x, y = (corner[:, axis, None] + cell * (np.arange(need.shape[1 + axis]) + 0.5) for axis in (0, 1))
    motion = tipped(need, x, y, TIPPED)
    touching = left_under(need, x, y, motion) <= NEARLY * cell
    angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    which, along, across = touching.nonzero()  # stone after stone
    out = x[which, along] * np.cos(angle)[:, None] + y[which, across] * np.sin(angle)[:, None]
    reach, some = np.full(len(places), -np.inf), np.unique(which)
    reach[some] = np.maximum.reduceat(out, np.searchsorted(which, some), axis=1).min(axis=0)
    centre = np.clip(1.0 - reach / (0.5 * cell * np.array(size).min(axis=1)), 0.0, 2.0)
    support = touching.sum(axis=(1, 2)) / np.isfinite(need).sum(axis=(1, 2))
    tilt = np.hypot(motion[:, 1], motion[:, 2]) / TIPPED
    return list(zip(support.tolist(), centre.tolist(), tilt.tolist(), rest.tolist(), strict=True))
