"""What masons ask of a wall, measured on its stones: density, faces, bond, length into the wall, through-stones.

The wall runs along x from 0 to its length, its front is the plane y = lean z, its back y = thickness - lean z. The
front elevation is rastered: in each cell the stone that is seen, in joints the nearest one. Its boundaries are joints.
Where one runs more up than along between two stones it is a head joint; what goes on above or below it, past a stone
on either side, is the same head joint. It is covered by how far the stone above it and the one below run past the two
stones beside it. A line of minimum trace is the shortest one along boundaries and across gaps, by steps in 32
directions (1.3 % too long at most between them); it is given per metre of height, least and median over the joints
that come out at the top, each from where on the ground it is nearest.

By hand: in running bond of units l x h with half overlap it climbs h and runs l / 2 aside in each course but the
last, which it climbs only; in stack bond it is straight, 1 m per m.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.design.rubble.height_map import rasters
from cyclopean.errors import InputError
from cyclopean.geometry.packed import components

__all__ = ["NEAR_FACE", "Faces", "MasonsRules", "Stone", "masons_rules", "seen_front"]

CELLS = 80  # through the wall: 0.5 cm where it is 40 cm thick
FINE = 75  # cells of the elevation to the median height of a stone: a path cuts a corner by 0.8 of one
MOST = 600_000  # cells of an elevation: that of a very long wall is coarser
NEAR_FACE = 0.1  # of the thickness: stone this near to a face is in it
BINDER = 2.0 / 3.0  # of the thickness: how far a binder reaches
SHORT = 0.1  # of the median height of stones: shorter joints are no head joints, and ends this near are one
STEPS = ((1, 0), (1, 1), (2, 1), (1, 2), (3, 1), (1, 3), (3, 2), (2, 3))  # of a path; mirrored they make 32


class Stone(Protocol):
    """A closed mesh in its place; a `Body` is one."""

    @property
    def vertices(self) -> Floats:
        """(v, 3) m."""

    @property
    def triangles(self) -> Ints:
        """(t, 3)."""

    @property
    def volume(self) -> float:
        """In m3."""


@dataclass(frozen=True, slots=True)
class Faces:
    """Between which planes a wall stands."""

    length: float  # m
    thickness: float  # m, at the ground
    front_lean: float = 0.0  # m per m of height, into the wall
    back_lean: float = 0.0  # the same

    def __post_init__(self) -> None:
        if not (0.0 < self.length < np.inf and 0.0 < self.thickness < np.inf):
            raise InputError("length and thickness: must be positive lengths in metres")
        if not (0.0 <= self.front_lean < np.inf and 0.0 <= self.back_lean < np.inf):
            raise InputError("front_lean and back_lean: must not be negative")


@dataclass(frozen=True, slots=True)
class MasonsRules:
    """Measures of a wall; None where it has nothing to measure."""

    void: float  # share between the faces, below the highest stone of each column along the wall
    void_tops: float  # the same below each plan column's own top
    face: float  # share of the front below the skyline with stone within a tenth of the thickness
    face_back: float  # the same of the back
    top: float  # m, standard deviation of the top along the wall
    head_joints: int  # seen in the front, that some stone covers or bears
    joint_overlap_least: float | None  # m by which stones above and below run past a head joint
    joint_overlap_median: float | None  # m
    running_joints: int  # head joints that pass two stones or more on either side
    running_joint_longest: float  # m
    length_into_wall: float | None  # median over stones of the face: extent through over extent along the wall
    through_stones: float  # per m2 of the front: within a tenth of the thickness of both faces
    binders: float  # per m2 of the front: two thirds of the thickness or more
    largest_low: float | None  # rank correlation of volume with height: -1 where the largest are lowest
    trace_least: float | None  # m per m: line of minimum trace from the ground to the top
    trace_median: float | None  # m per m
    trace_along: float | None  # m per m, from end to end


@dataclass(frozen=True, slots=True, eq=False)
class _Elevation:
    """A face as it is seen."""

    label: Ints  # (w, h) stone seen, or nearest in joints; -1 above the skyline
    open: Bools  # (w, h) no stone is seen, below the skyline or between two parts of the wall
    extent: Ints  # (n, 2) columns from which, and before which, each stone is seen; empty of those that are not
    near: float  # share below the skyline with stone near the plane
    seen: Ints  # numbers of stones
    cell: float  # m


def masons_rules(stones: Sequence[Stone], faces: Faces) -> MasonsRules:
    """Measure a wall of at least one stone.

    Raises
    ------
    InputError
        There is no stone, or none within the length of the wall.
    """
    from scipy.stats import rankdata

    if not stones:
        raise InputError("stones: a wall needs at least one")
    if not all(np.isfinite(s.vertices).all() for s in stones):
        raise InputError("stones: a vertex is no finite number")
    top = _tops(stones, faces)
    front, back = _elevation(stones, faces, False), _elevation(stones, faces, True)
    low = np.array([s.vertices.min(axis=0) for s in stones])
    high = np.array([s.vertices.max(axis=0) for s in stones])
    size = high - low
    area = float(np.count_nonzero(front.label >= 0)) * front.cell**2
    depth = [np.ptp(_seen_from(s, faces, False)[:, 2]) for s in stones]
    into = np.array([[_seen_from(s, faces, side)[:, 2].min() for side in (False, True)] for s in stones])
    short = SHORT * float(np.median(size[:, 2]))
    joints, overlaps, running = _bond(front, short)
    volume = np.array([s.volume for s in stones])
    ranks = np.array([rankdata(volume), rankdata((low + high)[:, 2])])
    varied = bool((np.ptp(ranks, axis=1) > 0.0).all())
    up = _traces(front.label, front.open)
    along = _traces(front.label.T, front.open.T)
    return MasonsRules(
        *_voids(top, faces, float(volume.sum())),
        front.near,
        back.near,
        float(top.max(axis=1).std()),
        joints,
        min(overlaps, default=None),
        float(np.median(overlaps)) if overlaps else None,
        len(running),
        max(running, default=0.0),
        float(np.median((size[:, 1] / size[:, 0])[front.seen])),
        float(np.count_nonzero((into <= NEAR_FACE * faces.thickness).all(axis=1))) / area,
        float(np.count_nonzero(np.array(depth) >= BINDER * faces.thickness)) / area,
        float(np.corrcoef(ranks)[0, 1]) if varied else None,
        float(up.min()) if len(up) else None,
        float(np.median(up)) if len(up) else None,
        float(along.min()) if len(along) else None,
    )


def _tops(stones: Sequence[Stone], faces: Faces) -> Floats:
    """Highest stone (m) of each plan column (w, d)."""
    cell = faces.thickness / CELLS
    top = np.zeros((max(round(faces.length / cell), 1), CELLS))  # columns whose middle is in the wall
    for s in stones:
        raster = rasters(s.vertices[None], s.triangles, cell, snapped=True)[0]
        _raise(top, raster.high, np.round(raster.corner / cell).astype(np.int64))
    if not top.any():
        raise InputError("stones: none stands between the faces; is the wall's frame x along it, y through it?")
    return top


def _raise(top: Floats, high: Floats, corner: Ints) -> None:
    """Take a stone's top (w, d) into a map that starts at (0, 0)."""
    i, j = corner.tolist()
    a, b = max(i, 0), max(j, 0)
    part = top[a : max(i + high.shape[0], 0), b : max(j + high.shape[1], 0)]
    np.maximum(part, high[a - i :, b - j :][: part.shape[0], : part.shape[1]], out=part)


def _voids(top: Floats, faces: Faces, volume: float) -> tuple[float, float]:
    """Void below the skyline, and below each column's own top."""
    cell = faces.thickness / CELLS
    y = (np.arange(CELLS) + 0.5) * cell
    reach = np.full(CELLS, np.inf)  # how high a plan column lies between the faces
    for lean, from_face in ((faces.front_lean, y), (faces.back_lean, faces.thickness - y)):
        reach = np.minimum(reach, from_face / lean) if lean else reach
    below = [np.minimum(h, reach).sum() * cell**2 for h in (np.broadcast_to(top.max(axis=1)[:, None], top.shape), top)]
    return 1.0 - volume / float(below[0]), 1.0 - volume / float(below[1])


def _seen_from(stone: Stone, faces: Faces, back: bool) -> Floats:
    """(v, 3) along the wall, height, and depth behind a face."""
    x, y, z = stone.vertices.T
    depth = faces.thickness - y - faces.back_lean * z if back else y - faces.front_lean * z
    return np.column_stack([x, z, depth])


def _elevation(stones: Sequence[Stone], faces: Faces, back: bool) -> _Elevation:
    """A face, seen along y."""
    from scipy.ndimage import distance_transform_edt

    low, high = (np.array([bound(s.vertices[:, 2]) for s in stones]) for bound in (np.min, np.max))
    tallest = float(high.max())
    cell = max(float(np.median(high - low)) / FINE, float(np.sqrt(faces.length * max(tallest, 0.0) / MOST)))
    shape = int(np.ceil(faces.length / cell - 1e-6)), max(int(np.ceil(tallest / cell - 1e-6)), 1)
    depth, label = np.full(shape, np.inf), np.full(shape, -1)
    for number, s in enumerate(stones):
        raster = rasters(_seen_from(s, faces, back)[None], s.triangles, cell, snapped=True)[0]
        _see(depth, label, raster.low, np.round(raster.corner / cell).astype(np.int64), number)
    stone = label >= 0
    if not stone.any():
        raise InputError("stones: none stands within the length of the wall")
    below = np.flip(np.logical_or.accumulate(np.flip(stone, 1), axis=1), 1)
    nearest = distance_transform_edt(~stone, return_distances=False, return_indices=True)
    near = np.count_nonzero(depth[below] <= NEAR_FACE * faces.thickness) / np.count_nonzero(below)
    seen = np.unique(label[stone])
    gap = (below | _between(below)) & ~stone
    return _Elevation(np.where(below, label[tuple(nearest)], -1), gap, _extents(label, len(stones)), near, seen, cell)


def seen_front(stones: Sequence[Stone], faces: Faces) -> tuple[Ints, float]:
    """The front as it is seen.

    Returns
    -------
    label : (w, h) int
        Stone that is seen, the nearest one in joints; -1 in all that a disc can reach which is half as high as a stone
        and touches none: around the wall, and in openings.
    cell : float
        m.
    """
    from scipy.ndimage import distance_transform_edt

    front = _elevation(stones, faces, False)
    reach = 0.25 * float(np.median([np.ptp(s.vertices[:, 2]) for s in stones])) / front.cell
    label = np.pad(np.where(front.open, -1, front.label), int(reach) + 2, constant_values=-1)
    far, nearest = distance_transform_edt(label < 0, return_indices=True)
    free = distance_transform_edt(far <= reach) <= reach
    return np.where(free, -1, label[tuple(nearest)]), front.cell


def _extents(label: Ints, count: int) -> Ints:
    """(count, 2) columns from which, and before which, each stone is seen."""
    extent = np.column_stack([np.full(count, len(label)), np.zeros(count, np.int64)])
    column, _ = np.nonzero(label >= 0)
    number = label[label >= 0]
    np.minimum.at(extent[:, 0], number, column)
    np.maximum.at(extent[:, 1], number, column + 1)
    return extent


def _between(below: Bools) -> Bools:
    """(w, h) cells of columns without any stone between two that have some, up to the lower of these."""
    height = below.sum(axis=1)
    some = np.flatnonzero(height)
    column = np.arange(len(height))
    left = height[some[np.clip(np.searchsorted(some, column, "right") - 1, 0, None)]]
    right = height[some[np.clip(np.searchsorted(some, column), None, len(some) - 1)]]
    inside = (column > some[0]) & (column < some[-1])
    most = np.where((height == 0) & inside, np.minimum(left, right), 0)
    return np.asarray(np.arange(below.shape[1]) < most[:, None])


def _see(depth: Floats, label: Ints, low: Floats, corner: Ints, number: int) -> None:
    """Take a stone (w, h) into an elevation where it is nearer than what is there."""
    i, j = corner.tolist()
    a, b = max(i, 0), max(j, 0)
    where = np.s_[a : max(i + low.shape[0], 0), b : max(j + low.shape[1], 0)]
    part = depth[where]
    mine = low[a - i :, b - j :][: part.shape[0], : part.shape[1]]
    nearer = mine < part
    part[nearer] = mine[nearer]
    label[where][nearer] = number


def _bond(face: _Elevation, short: float) -> tuple[int, list[float], list[float]]:
    """Number of head joints, overlaps (m) over and under them, and lengths (m) of those that run on."""
    pairs, ends = _uprights(face.label, short / face.cell)
    if not len(pairs):
        return 0, [], []
    close = np.abs(ends[:, None, 1] - ends[None, :, 0]).max(axis=2) <= max(short / face.cell, 2.0)
    group = components(len(close), *np.nonzero(close))
    overlaps, running, joints = [], [], 0
    for g in range(group.max() + 1):
        mine = np.flatnonzero(group == g)
        foot, head = ends[mine, 0], ends[mine, 1]
        first, last = foot[np.argmin(foot[:, 1])], head[np.argmax(head[:, 1])]
        beside = [pairs[mine[at]] for at in (np.argmin(foot[:, 1]), np.argmax(head[:, 1]))]
        near = range(max(round(short / face.cell), 1))
        found = [
            _overlap(face, beside[0], int(first[0]), [int(first[1]) - 1 - k for k in near]),
            _overlap(face, beside[1], int(last[0]), [int(last[1]) + k for k in near]),
        ]
        there = [n * face.cell for n in found if n is not None]
        joints += bool(there)
        overlaps += [min(there)] if there else []
        if min(len(set(pairs[mine, side].tolist())) for side in (0, 1)) >= 2:
            running.append(float(last[1] - first[1]) * face.cell)
    return joints, overlaps, running


def _uprights(label: Ints, short: float) -> tuple[Ints, Ints]:
    """Pairs (k, 2) of stones, left and right of what is upright between them, and its foot and head (k, 2, 2)."""
    left, right = label[:-1], label[1:]
    i, j = np.nonzero((left != right) & (left >= 0) & (right >= 0))
    lying = label[:, :-1], label[:, 1:]
    a, b = np.nonzero((lying[0] != lying[1]) & (lying[0] >= 0) & (lying[1] >= 0))
    if not len(i):
        return np.zeros((0, 2), np.int64), np.zeros((0, 2, 2), np.int64)
    many = int(label.max()) + 1
    flat = np.sort(np.column_stack([lying[0][a, b], lying[1][a, b]]), axis=1) @ [many, 1]
    pairs, which, steps = np.unique(left[i, j] * many + right[i, j], return_inverse=True, return_counts=True)
    both = np.sort(np.column_stack([pairs // many, pairs % many]), axis=1) @ [many, 1]
    beds = np.searchsorted(np.sort(flat), both, "right") - np.searchsorted(np.sort(flat), both, "left")
    order = np.lexsort([j, which])
    start = np.searchsorted(which[order], np.arange(len(pairs)))
    foot, head = order[start], order[np.append(start[1:], len(order)) - 1]
    ends = np.stack([np.column_stack([i[foot] + 1, j[foot]]), np.column_stack([i[head] + 1, j[head] + 1])], axis=1)
    kept = (steps > beds) & (steps >= short)
    return np.column_stack([pairs // many, pairs % many])[kept], ends[kept]


def _overlap(face: _Elevation, beside: Ints, i: int, rows: Sequence[int]) -> int | None:
    """By how many cells the stone over or under the line i runs past the two beside it, where it is less.

    It is looked for in some rows, the nearest first; 0 where the joint goes on through all of them, None where there is
    no stone.
    """
    label = face.label
    for k, j in enumerate(rows):
        if not 0 <= j < label.shape[1] or label[i - 1, j] < 0 or label[i, j] < 0:
            return 0 if k else None
        if label[i - 1, j] == label[i, j]:
            left, right = min(int(face.extent[beside[0], 1]), i), max(int(face.extent[beside[1], 0]), i)
            first, end = face.extent[label[i, j]].tolist()
            return int(max(min(left - first, end - right), 0))
    return 0


def _traces(label: Ints, gaps: Bools) -> Floats:
    """Shortest lines through joints and gaps from the first row of cells to the last, over what they climb."""
    from scipy.sparse.csgraph import dijkstra

    joint, end = _joint_points(np.pad(label, 1, constant_values=-1), np.pad(gaps, 1))
    node = np.full(joint.shape, -1)
    node[joint] = np.arange(np.count_nonzero(joint))
    _, height = np.nonzero(joint)
    start = np.flatnonzero(height == 0)
    finish = np.flatnonzero(end[joint] & (height >= height.max(initial=0) / 2.0) & (height > 0))
    if not len(start) or not len(finish):
        return np.zeros(0)
    reached = dijkstra(_network(node), directed=False, indices=start, min_only=True)[finish]
    ratio: Floats = (reached / height[finish])[np.isfinite(reached)]
    return ratio


def _joint_points(padded: Ints, gaps: Bools) -> tuple[Bools, Bools]:
    """Corners of cells (w + 1, h + 1) where two stones meet or a gap is, and those of them with nothing above."""
    four: Ints = np.stack([padded[:-1, :-1], padded[1:, :-1], padded[:-1, 1:], padded[1:, 1:]])
    void: Bools = np.stack([gaps[:-1, :-1], gaps[1:, :-1], gaps[:-1, 1:], gaps[1:, 1:]])
    least = np.where(four < 0, np.iinfo(np.int64).max, four).min(axis=0)
    above = (four[2:] < 0) & ~void[2:]
    return np.asarray((four.max(axis=0) > least) | void.any(axis=0)), np.asarray(above.any(axis=0))


def _network(node: Ints) -> sp.csr_array:
    """Steps from point to point of joints, with their lengths in cells."""
    rows, columns, lengths = [], [], []
    for right, up in STEPS:
        for grid in (node, node[::-1]) if right and up else (node, node.T):
            w, h = grid.shape[0] - right, grid.shape[1] - up
            if w <= 0 or h <= 0:
                continue
            free = np.ones((w, h), bool)
            most = max(right, up)
            for k in range(most + 1):  # all points of the digital line
                a, b = round(k * right / most), round(k * up / most)
                free &= grid[a : a + w, b : b + h] >= 0
            rows.append(grid[:w, :h][free])
            columns.append(grid[right:, up:][free])
            lengths.append(np.full(len(rows[-1]), float(np.hypot(right, up))))
    ids = np.concatenate(rows), np.concatenate(columns)
    return sp.coo_array((np.concatenate(lengths), ids), shape=(node.max() + 1,) * 2).tocsr()
