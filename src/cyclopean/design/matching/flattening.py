"""A polygonal wall laid flat: poses in (u, v, t), u along the wall, v up its face, t (m) outwards along the normal.

Near a cell the surface is taken for its tangent plane at the cell's centroid. On a flat wall that is exact. On a curved
one, where a stone in its cell is turned and shifted with the surface, it is off by about the square of the stone's
radius over the surface's: the pose is refined in the true cell afterwards.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.design.matching.ascent import FAR, FlatWall, Obstacles
from cyclopean.design.walls.pattern import Pattern, beyond_outline, seed_grid
from cyclopean.design.walls.polygonal import PolygonalWall
from cyclopean.design.walls.surfaces import Surface
from cyclopean.geometry.polygon import convex_pieces

__all__ = ["TangentPlanes", "flat_wall", "frames_at"]

STEP = 1e-4  # of the wall's size, to tell which way is up


@dataclass(frozen=True, slots=True, eq=False)
class TangentPlanes:
    """Tangent planes of a surface."""

    uv: Floats  # (n, 2) m
    point: Floats  # (n, 3) m
    axes: Floats  # (n, 3, 3) rows: along, up, outwards

    def flat(self, rotation: Floats, shift: Floats) -> tuple[Floats, Floats]:
        """Poses (n, 3, 3), (n, 3) in space as poses in (u, v, t)."""
        about = np.einsum("nij,nj->ni", self.axes, shift - self.point)
        about[:, :2] += self.uv
        return self.axes @ rotation, about

    def laid(self, rotation: Floats, shift: Floats) -> tuple[Floats, Floats]:
        """Poses in (u, v, t) as poses in space."""
        about = np.array(shift)
        about[:, :2] -= self.uv
        back = self.axes.transpose(0, 2, 1)
        return back @ rotation, self.point + np.einsum("nij,nj->ni", back, about)


def frames_at(surface: Surface, uv: Floats) -> TangentPlanes:
    """Tangent planes at points (n, 2) m of a surface."""
    step = np.array([0.0, STEP * float(np.ptp(uv, axis=0).max(initial=1.0))])
    point, normal = surface.at(uv)
    up = surface.at(uv + step)[0] - surface.at(uv - step)[0]
    up = up - (up * normal).sum(axis=1)[:, None] * normal
    up = up / np.linalg.norm(up, axis=1)[:, None]
    return TangentPlanes(uv, point, np.stack([np.cross(up, normal), up, normal], axis=1))


def flat_wall(wall: PolygonalWall) -> FlatWall:
    """What bounds the cells of a wall that grow from seeds."""
    settings = wall.pattern.settings
    origin, spacing = seed_grid(settings)
    return FlatWall(
        origin=origin,
        spacing=spacing,
        size=np.array([settings.width, settings.height]),
        grid=np.array([settings.columns, settings.rows], float),
        depth=wall.thickness.depth,
        batter=wall.thickness.batter,
        obstacles=_obstacles(wall.pattern),
    )


def _obstacles(pattern: Pattern) -> Obstacles:
    """Openings, dressed stones and ground, in convex pieces."""
    cells = pattern.subdivision
    rings = [cells.ring(k) for k, kind in enumerate(pattern.kind) if kind != "stone"]
    rings += [*pattern.openings, *beyond_outline(pattern.settings)]
    corners = [ring[piece] for ring in rings for piece in convex_pieces(ring)]
    if pattern.foot is not None:
        below = np.array([0.0, pattern.settings.height])
        corners += [np.stack([a - below, b - below, b, a]) for a, b in pairwise(pattern.foot)]
    most = max(map(len, corners), default=0)
    normal, offset = np.zeros((len(corners), most, 3)), np.full((len(corners), most), FAR)
    for k, ring in enumerate(corners):
        along = np.roll(ring, -1, axis=0) - ring
        length = np.linalg.norm(along, axis=1)
        own = length > 0.0
        out = np.column_stack([along[own, 1], -along[own, 0]]) / length[own, None]
        normal[k, : len(out), :2], offset[k, : len(out)] = out, (out * ring[own]).sum(axis=1)
    return Obstacles(tuple(corners), normal, offset)
