"""Vertices moved as little as may be until they lie in planes that they share.

Given are vertices, and which of them are to lie in which planes; wanted is the least sum of squares of movements. Once
the planes are known, a vertex goes to the nearest point that is in all of its own: with A their normals and r its
heights above them,

    movement = -A' (A A')^-1 r        its square = r' (A A')^-1 r

so that the planes alone are unknown, by three figures each: two tilts and a rise. Gauss-Newton on these (variable
projection) has one sparse symmetric matrix, in which two planes meet where they share a vertex.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import csr_array, diags_array

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.geometry import frames_from_normals

__all__ = ["Planes", "largest", "moved_into_planes"]

ROUNDS = 12  # of Gauss-Newton: tilts are small, so that a round gains two digits or more
SOFT = 1e-5  # of a unit normal's square: what more than three planes in one vertex may miss of a movement
FIRM = 1e-9  # of a vertex' resistance to movement: a tilt that moves no vertex is left out
FEWEST = 5  # rounds before it is asked whether they gain
STILL = 1e-15  # of the size: planes that move less are there


@dataclass(frozen=True, slots=True, eq=False)
class Planes:
    """Planes (P) and the vertices that are to lie in them (k incidences, sorted by vertex)."""

    vertex: Ints  # (k,)
    plane: Ints  # (k,)
    level: Bools  # (P,) its normal stays +z
    centre: Floats  # (P, 3) m, about which it tilts
    frame: Floats  # (P, 3, 3) normal first
    height: Floats  # (P,) m along the normal from the centre
    radius: Floats  # (P,) m: root mean square distance of its vertices from the centre

    @classmethod
    def of(cls, point: Floats, vertex: Ints, plane: Ints, level: Bools) -> "Planes":
        """The planes of least squares through the vertices (k,) of planes (k,), in any order, at points (V, 3) in m."""
        total = len(level)
        key = np.unique(vertex * np.int64(total) + plane)
        vertex, plane = key // total, key % total
        count = np.maximum(np.bincount(plane, minlength=total), 1)
        centre = _summed(plane, point[vertex], total) / count[:, None]
        away = point[vertex] - centre[plane]
        spread = _summed(plane, (away[:, :, None] * away[:, None, :]).reshape(-1, 9), total) / count[:, None]
        normal = np.linalg.eigh(spread.reshape(-1, 3, 3))[1][:, :, 0]
        normal[level] = (0.0, 0.0, 1.0)
        radius = np.sqrt(spread[:, [0, 4, 8]].sum(axis=1))
        return cls(vertex, plane, level, centre, frames_from_normals(normal), np.zeros(total), radius)

    def off(self, point: Floats) -> Floats:
        """(k,) m: how far above its plane each vertex is, at points (V, 3)."""
        away = point[self.vertex] - self.centre[self.plane]
        return np.asarray(np.einsum("ki,ki->k", away, self.frame[self.plane, 0]) - self.height[self.plane])

    def furthest(self, point: Floats) -> Floats:
        """(P,) m: how far off each plane the furthest of its vertices is, at points (V, 3)."""
        return largest(self.plane, np.abs(self.off(point)), len(self.level))

    def slope(self, point: Floats) -> Floats:
        """(k, 3) change of each height above a plane with its two tilts, times the radius, and its rise."""
        away = point[self.vertex] - self.centre[self.plane]
        lever = np.einsum("ki,kji->kj", away, self.frame[self.plane, 1:]) / self.radius[self.plane][:, None]
        return np.column_stack([np.where(self.level[self.plane][:, None], 0.0, lever), -np.ones(len(lever))])

    def after(self, step: Floats) -> "Planes":
        """Those after a step (P, 3) m: two tilts, times the radius, and a rise."""
        normal = self.frame[:, 0] + np.einsum("pj,pji->pi", step[:, :2] / self.radius[:, None], self.frame[:, 1:])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        return replace(self, frame=frames_from_normals(normal), height=self.height + step[:, 2])


def moved_into_planes(point: Floats, planes: Planes) -> tuple[Floats, Planes]:
    """(V, 3) m: where the points (V, 3) go; and the planes in which they are then."""
    from scipy.sparse.linalg import spsolve

    count, total = len(planes.vertex), len(planes.level)
    column = (3 * planes.plane[:, None] + np.arange(3)).ravel()
    still = STILL * float(np.abs(point).max())
    now, force, last, weight = point, np.zeros(count), np.inf, _weights(planes)
    for k in range(ROUNDS):
        given = SOFT * force
        slope = csr_array((planes.slope(now).ravel(), column, 3 * np.arange(count + 1)), shape=(count, 3 * total))
        square = slope.T @ weight @ slope
        firm = square + diags_array(np.where(square.diagonal() > 0.0, FIRM, 1.0))
        step = spsolve(firm.tocsc(), -slope.T @ (weight @ (planes.off(point) - given))).reshape(-1, 3)
        planes = planes.after(step)
        weight = _weights(planes)
        force = -(weight @ (planes.off(point) - given))
        now = point + _summed(planes.vertex, force[:, None] * planes.frame[planes.plane, 0], len(point))
        furthest = max(float(np.abs(step).max()), float(np.abs(SOFT * force - given).max()))
        if furthest <= still or (k >= FEWEST and furthest > last / 2.0):
            break
        last = furthest
    return now, planes


def _weights(planes: Planes) -> Any:
    """(A A')^-1 as a sparse (k, k) matrix: a block for each vertex."""
    normal = planes.frame[planes.plane, 0]
    start = np.flatnonzero(np.diff(planes.vertex, prepend=-1))
    count = np.diff(np.append(start, len(planes.vertex)))
    data, row, column = [], [], []
    for q in np.unique(count):
        group = start[count == q][:, None] + np.arange(q)
        gram = np.einsum("gqi,gri->gqr", normal[group], normal[group])
        data.append(np.linalg.inv(gram + SOFT * np.eye(q)).ravel())
        row.append(np.repeat(group, q, axis=1).ravel())
        column.append(np.tile(group, q).ravel())
    place = np.concatenate(row), np.concatenate(column)
    return csr_array((np.concatenate(data), place), shape=(len(normal), len(normal)))


def largest(index: Ints, value: Floats, total: int) -> Floats:
    """(total,) largest of the values (k,), none of them negative, that have the same index (k,); 0 for none."""
    most = np.zeros(total)
    np.maximum.at(most, index, value)
    return most


def _summed(index: Ints, rows: Floats, total: int) -> Floats:
    """(total, c) sums of rows (k, c) that have the same index (k,)."""
    return np.stack([np.bincount(index, column, total) for column in rows.T], 1)
