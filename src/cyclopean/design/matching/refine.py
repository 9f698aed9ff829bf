"""Refine poses: climb the share of a stone that lies in its cell, by its points near the cell's border.

The depth of a point in a cell is s = min over parts of max over planes of (normal . x - offset), negative inside. The
share of a stone's points with s <= 0 is smoothed to a width e, so that a point within e of the border pushes its
stone inwards, along the normal of the plane nearest to it, with the force 1 - (s / e)^2. Force and torque on the stone,
normalised and smoothed over the steps, turn and shift it, by steps and widths that shrink. The best pose met, by
plain counting, is kept; the one given is among them.

All pairs of a batch move together; none knows of the others.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from cyclopean.arrays import Floats, Ints
from cyclopean.design.matching.cells import Cells

__all__ = ["Bonds", "Schedule", "bonded", "refine", "turned_by"]

Singles = NDArray[np.float32]
Real = TypeVar("Real", np.float32, np.float64)

BATCH = 1 << 18  # points times planes at a time: what the fast memory of a core holds
KEPT = 0.6  # of the last step's direction that is kept in the next
# takes a vector to the matrix of its cross product, row by row
CROSS = np.array([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]], float)
AXES, NEXT, AFTER = [0, 1, 2], [1, 2, 0], [2, 0, 1]
FEW = 4  # one of so many points is used in early steps
TOUCH = 1e-6  # of the stone's radius: points so near to a plane count as inside


@dataclass(frozen=True, slots=True)
class Schedule:
    """How long to climb; lengths as shares of the stone's radius of gyration, angles in radians."""

    points: int
    steps: int
    width: tuple[float, float]  # from and to which the border is smoothed
    step: tuple[float, float]
    early: int = 0  # of the steps, the first, that are made with a quarter of the points


@dataclass(frozen=True, slots=True, eq=False)
class Bonds:
    """Along what the longest axis of each pair's stone lies, to within an angle."""

    way: Floats  # (b, 3) unit
    angle: float  # radians


def refine(
    points: Singles,
    cells: Cells,
    pairs: tuple[Ints, Ints],
    poses: tuple[Floats, Floats],
    schedule: Schedule,
    bonds: Bonds | None = None,
    executor: Executor | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[Floats, Floats, Floats]:
    """Refine the poses of pairs of a stone and a cell.

    Parameters
    ----------
    points : (n, p, 3) float32
        m, evenly spread in each stone, body frame.
    cells : Cells
        The cells.
    pairs : (b,) int, (b,) int
        Stone and cell of each pair.
    poses : (b, 3, 3) float, (b, 3) float
        Rotation from body frame to wall, and centroid of the stone from the centre of the cell (m).
    schedule : Schedule
        How long.
    bonds : Bonds, optional
        Where the stones' longest axes lie.
    executor : Executor, optional
        Runs the batches; this process where not given.
    progress : callable
        Told what is being done.

    Returns
    -------
    share : (b,) float
        Share of the stone's points that lie in the cell.
    rotation, shift : (b, 3, 3), (b, 3) float
        The poses at which they do.
    """
    share, rotation, shift = np.zeros(len(pairs[0])), np.array(poses[0], float), np.array(poses[1], float)
    batches = list(_batches(cells, pairs[1], schedule.points))
    jobs = (_job(points, cells, pairs, poses, bonds, batch, schedule.points) for batch in batches)
    work = partial(_climbed, schedule)
    done = map(work, jobs) if executor is None else executor.map(work, jobs)
    for number, (batch, found) in enumerate(zip(batches, done, strict=True)):
        progress(f"refining: {number + 1} of {len(batches)}")
        share[batch], rotation[batch], shift[batch] = found
    return share, rotation, shift


Job = tuple[Singles, Singles, Singles, int, Singles, Singles, tuple[Singles, float] | None]


def _batches(cells: Cells, cell: Ints, points: int) -> Iterator[Ints]:
    """Pairs that are refined together: cells of as many parts and of about as many planes, and no more than fit."""
    planes = _planes(cells)[cell]
    for parts in np.unique(cells.part_count[cell]):
        rows = np.flatnonzero(cells.part_count[cell] == parts)
        rows = rows[np.argsort(planes[rows], kind="stable")]
        size = max(1, BATCH // (points * int(planes[rows].max()) * int(parts)))
        yield from (rows[k : k + size] for k in range(0, len(rows), size))


def _planes(cells: Cells) -> Ints:
    """(m,) planes of the part of each cell that has the most; others fill up what is left of the rows."""
    return np.asarray(np.abs(cells.normal).any(axis=3).sum(axis=2).max(axis=1))


def _job(
    points: Singles,
    cells: Cells,
    pairs: tuple[Ints, Ints],
    poses: tuple[Floats, Floats],
    bonds: Bonds | None,
    batch: Ints,
    count: int,
) -> Job:
    stone, cell = pairs[0][batch], pairs[1][batch]
    parts, planes = int(cells.part_count[cell[0]]), int(_planes(cells)[cell].max())
    bond = None if bonds is None else (bonds.way[batch].astype(np.float32), bonds.angle)
    return (
        points[stone, :count],
        cells.normal[cell, :parts, :planes].astype(np.float32).reshape(len(batch), -1, 3),
        cells.offset[cell, :parts, :planes].astype(np.float32).reshape(len(batch), -1),
        parts,
        poses[0][batch].astype(np.float32),
        poses[1][batch].astype(np.float32),
        bond,
    )


def _climbed(schedule: Schedule, job: Job) -> tuple[Singles, Singles, Singles]:
    """Climb with one batch: share, rotation and shift at the best pose that was met."""
    points, normal, offset, parts, start, shift, bond = job
    if not schedule.early:
        return _leg(schedule, job, 0)
    few = points[:, : points.shape[1] // FEW], normal, offset, parts, start, shift, bond
    _, *near = _leg(replace(schedule, steps=schedule.early), few, 0, schedule.steps)
    share, rotation, moved = _leg(schedule, (points, normal, offset, parts, near[0], near[1], bond), schedule.early)
    given, *_ = _leg(schedule, job, schedule.steps)  # a climb never ends below where it began
    worse = given > share
    share[worse], rotation[worse], moved[worse] = given[worse], start[worse], shift[worse]
    return share, rotation, moved


def _leg(schedule: Schedule, job: Job, first: int, last: int = 0) -> tuple[Singles, Singles, Singles]:
    """Steps of a climb, from the first on; the best pose that was met by the points of the job.

    The planes are turned into the stones' frames, and not the points into the wall's: there are fewer of them.
    """
    points, normal, offset, parts, rotation, shift, bond = job
    count, many = points.shape[:2]
    size = np.sqrt(np.einsum("bni,bni->b", points, points) / np.float32(many))
    body = np.ones((count, 4, many), np.float32)
    body[:, :3] = points.transpose(0, 2, 1)
    depth, nearest = (
        np.zeros((count, normal.shape[1], many), np.float32),
        np.zeros((count, normal.shape[1], many), bool),
    )
    best = np.full(count, -1.0, np.float32)
    best_rotation, best_shift = rotation.copy(), shift.copy()
    momentum: Singles = np.zeros((count, 6), np.float32)
    plane, pull = np.zeros((count, normal.shape[1], 4), np.float32), np.zeros((count, 3, 2), np.float32)
    if bond is not None:
        rotation = bonded(rotation, *bond)
    for k in range(first, schedule.steps + 1):
        done = k / max(1, (last or schedule.steps) - 1)
        turned = normal @ rotation
        plane[..., :3], plane[..., 3] = turned, (normal @ shift[:, :, None])[..., 0] - offset
        np.matmul(plane, body, out=depth)
        outermost = depth.max(axis=1) if parts == 1 else _union(depth, parts)
        share = np.count_nonzero(outermost <= (TOUCH * size)[:, None], axis=1).astype(np.float32) / np.float32(many)
        better = share > best
        best = np.where(better, share, best)
        best_rotation[better], best_shift[better] = rotation[better], shift[better]
        if k == schedule.steps:
            break
        width = schedule.width[0] * (schedule.width[1] / schedule.width[0]) ** done
        step = np.float32(schedule.step[0] * (schedule.step[1] / schedule.step[0]) ** done)
        np.equal(depth, outermost[:, None], out=nearest)
        push = outermost / (np.float32(width) * size)[:, None]
        push *= push
        np.subtract(np.float32(1.0), push, out=push)
        np.maximum(push, np.float32(0.0), out=push)
        np.multiply(nearest, push[:, None], out=depth)  # by the plane that is nearest
        moment = depth @ body.transpose(0, 2, 1)  # (b, planes, 4): first moments and sum
        pressed = moment.transpose(0, 2, 1) @ turned  # (b, 4, 3): of moments times normals, and force
        pull[:, :, 0] = -pressed[:, 3]
        pull[:, :, 1] = (pressed[:, AFTER, NEXT] - pressed[:, NEXT, AFTER]) / size[:, None]
        way: Singles = (rotation @ pull).transpose(0, 2, 1).reshape(count, 6)  # force, and torque
        way /= np.sqrt(np.einsum("bi,bi->b", way, way))[:, None] + np.float32(1e-12)
        momentum = np.float32(KEPT) * momentum + np.float32(1.0 - KEPT) * way
        shift = shift + momentum[:, :3] * (step * size[:, None])
        rotation = turned_by(step * momentum[:, 3:]) @ rotation
        if bond is not None:
            rotation = bonded(rotation, *bond)
    return best, best_rotation, best_shift


def _union(depth: Singles, parts: int) -> Singles:
    """(b, n) depth in a union of convex parts, of depths (b, parts * planes, n) beyond their planes."""
    split = depth.reshape(len(depth), parts, -1, depth.shape[2])
    return cast("Singles", split.max(axis=2).min(axis=1))


def turned_by(vector: NDArray[Real]) -> NDArray[Real]:
    """Rotations (b, 3, 3) about vectors (b, 3), by their lengths in radians (Rodrigues)."""
    square = np.einsum("bi,bi->b", vector, vector)
    angle = np.sqrt(square)
    safe = np.where(angle > 0.0, angle, vector.dtype.type(1.0))
    sine = np.sin(safe) / safe
    half = np.sin(safe / 2.0) / safe
    turned = vector[:, :, None] * ((2.0 * half * half)[:, None] * vector)[:, None]
    turned += ((sine[:, None] * vector) @ CROSS.astype(vector.dtype)).reshape(-1, 3, 3)
    turned[:, AXES, AXES] += np.cos(angle)[:, None]
    found: NDArray[Real] = np.asarray(turned, vector.dtype)
    return found


def bonded(rotation: NDArray[Real], way: NDArray[Real], angle: float) -> NDArray[Real]:
    """Rotations (b, 3, 3) turned back, by as little as will do, to where the stone's first axis is within the angle.

    A way (b, 3) has no sign: the axis may point along it or against it.
    """
    axis = rotation[:, :, 0]
    along = np.einsum("bi,bi->b", axis, way)
    way = np.where(along < 0.0, -1.0, 1.0)[:, None] * way
    over = np.maximum(np.arccos(np.clip(np.abs(along), 0.0, 1.0)) - angle, 0.0)
    about = np.cross(axis, way)
    length = np.linalg.norm(about, axis=1)
    unit = about / np.where(length > 0.0, length, 1.0)[:, None]
    back = turned_by(cast("NDArray[Real]", np.asarray(unit * over[:, None], rotation.dtype)))
    return cast("NDArray[Real]", np.asarray(back @ rotation, rotation.dtype))
