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
from dataclasses import dataclass
from functools import partial
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from cyclopean.arrays import Floats, Ints
from cyclopean.design.matching.cells import Cells

__all__ = ["Bonds", "Schedule", "bonded", "refine", "turned_by"]

Singles = NDArray[np.float32]
Real = TypeVar("Real", np.float32, np.float64)

BATCH = 1 << 16  # points times planes at a time: what the fast memory of a core holds
KEPT = 0.6  # of the last step's direction that is kept in the next
LEVI_CIVITA = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]], float
)
TOUCH = 1e-6  # of the stone's radius: points so near to a plane count as inside


@dataclass(frozen=True, slots=True)
class Schedule:
    """How long to climb; lengths as shares of the stone's radius of gyration, angles in radians."""

    points: int
    steps: int
    width: tuple[float, float]  # from and to which the border is smoothed
    step: tuple[float, float]


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
    """Pairs that are refined together: cells of as many parts, and no more than fit."""
    planes = cells.offset.shape[2]
    for parts in np.unique(cells.part_count[cell]):
        rows = np.flatnonzero(cells.part_count[cell] == parts)
        size = max(1, BATCH // (points * planes * int(parts)))
        yield from (rows[k : k + size] for k in range(0, len(rows), size))


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
    parts = int(cells.part_count[cell[0]])
    bond = None if bonds is None else (bonds.way[batch].astype(np.float32), bonds.angle)
    return (
        points[stone, :count],
        cells.normal[cell, :parts].astype(np.float32).reshape(len(batch), -1, 3),
        cells.offset[cell, :parts].astype(np.float32).reshape(len(batch), -1),
        parts,
        poses[0][batch].astype(np.float32),
        poses[1][batch].astype(np.float32),
        bond,
    )


def _climbed(schedule: Schedule, job: Job) -> tuple[Singles, Singles, Singles]:
    """Climb with one batch: share, rotation and shift at the best pose that was met."""
    points, normal, offset, parts, rotation, shift, bond = job
    size = np.sqrt((points**2).sum(axis=2).mean(axis=1))
    body = np.ascontiguousarray(points.transpose(0, 2, 1))
    ones = np.ones((len(points), 1, points.shape[1]), np.float32)
    best = np.full(len(points), -1.0, np.float32)
    best_rotation, best_shift = rotation.copy(), shift.copy()
    momentum: Singles = np.zeros((len(points), 6), np.float32)
    if bond is not None:
        rotation = bonded(rotation, *bond)
    for k in range(schedule.steps + 1):
        done = k / max(1, schedule.steps - 1)
        turned = np.concatenate([rotation @ body, ones], axis=1)  # (b, 4, n), about the stone's own centroid
        plane = np.concatenate([normal, ((normal @ shift[:, :, None])[..., 0] - offset)[:, :, None]], axis=2)
        depth = plane @ turned
        outermost = depth.reshape(len(points), parts, -1, points.shape[1]).max(axis=2).min(axis=1)
        share = (outermost <= (TOUCH * size)[:, None]).mean(axis=1, dtype=np.float32)
        better = share > best
        best = np.where(better, share, best)
        best_rotation[better], best_shift[better] = rotation[better], shift[better]
        if k == schedule.steps:
            break
        width = schedule.width[0] * (schedule.width[1] / schedule.width[0]) ** done
        step = np.float32(schedule.step[0] * (schedule.step[1] / schedule.step[0]) ** done)
        push = 1.0 - (outermost / (np.float32(width) * size)[:, None]) ** 2
        np.maximum(push, 0.0, out=push)
        pushed = np.multiply(
            depth == outermost[:, None], push[:, None], dtype=np.float32
        )  # by the plane that is nearest
        moment = pushed @ turned.transpose(0, 2, 1)  # (b, planes, 4): first moments and sum
        force = -(moment[:, :, 3:] * normal).sum(axis=1)
        torque = -np.cross(moment[:, :, :3], normal).sum(axis=1)
        way: Singles = np.concatenate([force, torque / size[:, None]], axis=1)
        way /= np.linalg.norm(way, axis=1, keepdims=True) + np.float32(1e-12)
        momentum = np.float32(KEPT) * momentum + np.float32(1.0 - KEPT) * way
        shift = shift + momentum[:, :3] * (step * size[:, None])
        rotation = (turned_by(step * momentum[:, 3:]) @ rotation).astype(np.float32)
        if bond is not None:
            rotation = bonded(rotation, *bond)
    return best, best_rotation, best_shift


def turned_by(vector: NDArray[Real]) -> NDArray[Real]:
    """Rotations (b, 3, 3) about vectors (b, 3), by their lengths in radians (Rodrigues)."""
    angle = np.sqrt((vector**2).sum(axis=1))[:, None, None]
    axis = vector[:, :, None] / np.where(angle > 0.0, angle, 1.0)
    cross = (LEVI_CIVITA @ axis[:, None])[..., 0]  # (b, 3, 3): the matrix of axis x
    turned = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
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
