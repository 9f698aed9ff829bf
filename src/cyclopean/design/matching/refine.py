"""Refine poses: climb the share of a stone that lies in its cell, by its points near the cell's border.

The depth of a point in a cell is s = min over parts of max over planes of (normal . x - offset), negative inside. The
share of a stone's points with s <= 0 is smoothed to a width e, so that a point within e of the border pushes its
stone inwards, along the normal of the plane nearest to it, with the force 1 - (s / e)^2. Force and torque on the stone,
normalised and smoothed over the steps, turn and shift it, by steps and widths that shrink. The best pose met, by
plain counting, is kept; the one given is among them.

All pairs of a batch move together; none knows of the others.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from cyclopean.arrays import Floats, Ints
from cyclopean.design.matching.cells import Cells
from cyclopean.design.matching.problem import Bonds, Problem, Singles

__all__ = ["Schedule", "bonded", "refine", "turned_by", "wrench"]

Real = TypeVar("Real", np.float32, np.float64)

BATCH = 1 << 18  # points times planes at a time: what the fast memory of a core holds
KEPT = 0.6  # of the last step's direction that is kept in the next
# takes a vector to the matrix of its cross product, row by row
CROSS = np.array([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]], float)
AXES, NEXT, AFTER = [0, 1, 2], [1, 2, 0], [2, 0, 1]  # of a cross product
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
class _Job:
    """Pairs that climb together."""

    points: Singles  # (b, p, 3) m, of the stones
    normal: Singles  # (b, parts * planes, 3)
    offset: Singles  # (b, parts * planes) m
    parts: int
    rotation: Singles  # (b, 3, 3)
    shift: Singles  # (b, 3) m
    bonds: Bonds | None


def refine(
    problem: Problem, pairs: tuple[Ints, Ints], poses: tuple[Floats, Floats], schedule: Schedule
) -> tuple[Floats, Floats, Floats]:
    """Refine the poses of pairs of a stone and a cell.

    Parameters
    ----------
    problem : Problem
        Stones and cells.
    pairs : (b,) int, (b,) int
        Stone and cell of each pair.
    poses : (b, 3, 3) float, (b, 3) float
        Rotation from body frame to wall, and centroid of the stone from the centre of the cell (m).
    schedule : Schedule
        How long.

    Returns
    -------
    share : (b,) float
        Share of the stone's points that lie in the cell.
    rotation, shift : (b, 3, 3), (b, 3) float
        The poses at which they do.
    """
    share, rotation, shift = np.zeros(len(pairs[0])), np.array(poses[0], float), np.array(poses[1], float)
    batches = list(_batches(problem.cells, pairs[1], schedule.points))
    jobs = (_job(problem, pairs, poses, batch, schedule.points) for batch in batches)
    done = problem.done("refining", partial(_climbed, schedule), jobs, len(batches))
    for batch, found in zip(batches, done, strict=True):
        share[batch], rotation[batch], shift[batch] = found
    return share, rotation, shift


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


def _job(problem: Problem, pairs: tuple[Ints, Ints], poses: tuple[Floats, Floats], batch: Ints, count: int) -> _Job:
    cells, stone, cell = problem.cells, pairs[0][batch], pairs[1][batch]
    parts, planes = int(cells.part_count[cell[0]]), int(_planes(cells)[cell].max())
    bonds = problem.bonds
    return _Job(
        problem.points[stone, :count],
        cells.normal[cell, :parts, :planes].astype(np.float32).reshape(len(batch), -1, 3),
        cells.offset[cell, :parts, :planes].astype(np.float32).reshape(len(batch), -1),
        parts,
        poses[0][batch].astype(np.float32),
        poses[1][batch].astype(np.float32),
        None if bonds is None else Bonds(bonds.way[cell].astype(np.float32), bonds.angle),
    )


def _climbed(schedule: Schedule, job: _Job) -> tuple[Singles, Singles, Singles]:
    """Climb with one batch: share, rotation and shift at the best pose that was met."""
    if not schedule.early:
        return _leg(schedule, job, 0)
    few = replace(job, points=job.points[:, : job.points.shape[1] // FEW])
    _, turn, move = _leg(replace(schedule, steps=schedule.early), few, 0, schedule.steps)
    share, rotation, shift = _leg(schedule, replace(job, rotation=turn, shift=move), schedule.early)
    given, *_ = _leg(schedule, job, schedule.steps)  # a climb never ends below where it began
    worse = given > share
    share[worse], rotation[worse], shift[worse] = given[worse], job.rotation[worse], job.shift[worse]
    return share, rotation, shift


def _leg(schedule: Schedule, job: _Job, first: int, last: int = 0) -> tuple[Singles, Singles, Singles]:
    """Steps of a climb, from the first on; the best pose that was met by the points of the job.

    The planes are turned into the stones' frames, and not the points into the wall's: there are fewer of them.
    """
    points, normal, rotation, shift = job.points, job.normal, job.rotation, job.shift
    count, many = points.shape[:2]
    size = np.sqrt(np.einsum("bni,bni->b", points, points) / np.float32(many))
    body = np.ones((count, 4, many), np.float32)
    body[:, :3] = points.transpose(0, 2, 1)
    depth, nearest = (np.zeros((count, normal.shape[1], many), kind) for kind in (np.float32, bool))
    best = np.full(count, -1.0, np.float32)
    best_rotation, best_shift = rotation.copy(), shift.copy()
    momentum: Singles = np.zeros((count, 6), np.float32)
    plane, pull = np.zeros((count, normal.shape[1], 4), np.float32), np.zeros((count, 3, 2), np.float32)
    rotation = bonded(rotation, job.bonds)
    for k in range(first, schedule.steps + 1):
        done = k / max(1, (last or schedule.steps) - 1)
        turned = normal @ rotation
        plane[..., :3], plane[..., 3] = turned, (normal @ shift[:, :, None])[..., 0] - job.offset
        np.matmul(plane, body, out=depth)
        outermost = depth.reshape(count, job.parts, -1, many).max(axis=2).min(axis=1)  # of the union of parts
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
        force, torque = wrench(moment, turned)
        pull[:, :, 0], pull[:, :, 1] = force, torque / size[:, None]
        way: Singles = (rotation @ pull).transpose(0, 2, 1).reshape(count, 6)  # force, and torque
        way /= np.sqrt(np.einsum("bi,bi->b", way, way))[:, None] + np.float32(1e-12)
        momentum = np.float32(KEPT) * momentum + np.float32(1.0 - KEPT) * way
        shift = shift + momentum[:, :3] * (step * size[:, None])
        rotation = bonded(turned_by(step * momentum[:, 3:]) @ rotation, job.bonds)
    return best, best_rotation, best_shift


def wrench(moment: Singles, normal: Singles) -> tuple[Singles, Singles]:
    """Force (b, 3) and torque (b, 3) inwards, of points that planes push, by their moments (b, p, 4) and normals."""
    pressed = moment.transpose(0, 2, 1) @ normal  # (b, 4, 3): sums of moment times normal, and of normals
    return -pressed[:, 3], pressed[:, AFTER, NEXT] - pressed[:, NEXT, AFTER]


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


def bonded(rotation: NDArray[Real], bonds: Bonds | None) -> NDArray[Real]:
    """Rotations (b, 3, 3) turned back, by as little as will do, to where the stones' first axes keep their bonds."""
    if bonds is None:
        return rotation
    axis = rotation[:, :, 0]
    along = np.einsum("bi,bi->b", axis, bonds.way)
    way = np.where(along < 0.0, -1.0, 1.0)[:, None] * bonds.way
    over = np.maximum(np.arccos(np.clip(np.abs(along), 0.0, 1.0)) - bonds.angle, 0.0)
    about = np.cross(axis, way)
    length = np.linalg.norm(about, axis=1)
    unit = about / np.where(length > 0.0, length, 1.0)[:, None]
    back = turned_by(cast("NDArray[Real]", np.asarray(unit * over[:, None], rotation.dtype)))
    return cast("NDArray[Real]", np.asarray(back @ rotation, rotation.dtype))
