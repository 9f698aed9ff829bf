"""The shape of a rubble wall: its faces, and what of a height map is in it.

The wall runs along x, its front looks to -y and stands on y = 0 at the foot. With a batter its faces lean inwards by so
much for each metre of height; racked ends step back likewise, so that more can be bonded in later. With a corner, a
second leg of the same thickness runs back along y from the end of the first. An opening goes right through the wall.

By hand: a wall 2 m long and 0.6 m thick with a batter of 1:6 on both faces is 0.4 m thick at a height of 0.6 m.

>>> wall = Shape(2.0, 0.6, batter=1 / 6, faces=2)
>>> import numpy as np
>>> wall.holds(np.array([[1.0, 0.11, 0.6], [1.0, 0.49, 0.6]]), 0.0), wall.holds(np.array([[1.0, 0.09, 0.6]]), 0.0)
(True, False)
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.design.walls.openings import Opening

__all__ = ["SLENDER", "Shape"]

SLENDER = 2.0  # times its thickness: height that a wall is planned for where none is asked


@dataclass(frozen=True, slots=True)
class Shape:
    """Faces of a wall."""

    length: float  # m
    thickness: float  # m, at the foot
    height: float = np.inf  # m
    batter: float = 0.0  # m inwards for each metre of height
    faces: int = 1  # that lean: the front, or both
    rack: float = 0.0  # m by which the ends step back for each metre of height
    corner: float = 0.0  # m: length of a second leg, measured from the front of the first; 0 = none
    opening: Opening | None = None

    @property
    def size(self) -> tuple[float, float]:
        """Along and through (m), of the box around it."""
        return self.length, max(self.thickness, self.corner)

    @property
    def planned(self) -> float:
        """Height (m) that it is planned for."""
        return self.height if np.isfinite(self.height) else SLENDER * self.thickness

    def room(self, cell: float) -> Floats:
        """(n, m) m: height up to which each cell of a map is in the wall, but for its opening; 0 where it is not."""
        n, m = (int(extent / cell + 1e-9) for extent in self.size)
        x, y = np.meshgrid((np.arange(n) + 0.5) * cell, (np.arange(m) + 0.5) * cell, indexing="ij")
        inwards = self._inwards(x, y)
        room = np.full((n, m), self.height)
        for distance, slope in inwards:
            room = np.minimum(room, np.where(distance <= 0.0, 0.0, distance / slope if slope > 0.0 else np.inf))
        return room

    def opened(self, cell: float) -> Bools:
        """(n, m) cells of a map that are in the opening, as seen from above."""
        n, m = (int(extent / cell + 1e-9) for extent in self.size)
        x = (np.arange(n) + 0.5) * cell
        gap = self.opening
        across = np.zeros(n, bool) if gap is None else np.abs(x - gap.left - gap.width / 2.0) < gap.width / 2.0
        return np.repeat(across[:, None], m, axis=1)

    def holds(self, points: Floats, proud: float) -> bool:
        """Whether points (n, 3) stand out of no face, and into no opening, by more than `proud` (m)."""
        x, y, z = points.T
        out = max(float((slope * z - distance).max()) for distance, slope in self._inwards(x, y))
        gap = self.opening
        if gap is not None:
            clear = np.abs(x - gap.left - gap.width / 2.0) < gap.width / 2.0 - proud
            if (clear & (z > gap.sill + proud) & (z < gap.sill + gap.height - proud)).any():
                return False
        return max(out, float((z - self.height).max())) <= proud

    def flush(self, points: Floats, near: float, proud: float) -> Floats:
        """(2,) m that points (n, 3) nearer than `near` to a face have to go to stand out of it by `proud` (m)."""
        outwards = ((-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0))  # as `_inwards` has the faces
        behind = [float((d - slope * points[:, 2]).min()) for d, slope in self._inwards(points[:, 0], points[:, 1])]
        move = np.zeros(2)
        for axis in (0, 1):
            gap, out = min(zip(behind[2 * axis : 2 * axis + 2], outwards[2 * axis : 2 * axis + 2], strict=True))
            if gap < near:
                move += (gap + proud) * np.array(out)
        return move

    def _inwards(self, x: Floats, y: Floats) -> list[tuple[Floats, float]]:
        """Distances (m) behind the foot of each face, negative outside, and how much the face leans."""
        rear = self.batter if self.faces == 2 else 0.0
        if not self.corner:
            return [
                (x, self.rack),
                (self.length - x, self.rack),
                (y, self.batter),
                (self.thickness - y, rear),
            ]
        inner = np.maximum(self.thickness - y, x - (self.length - self.thickness))  # in either leg
        return [
            (x, self.rack),
            (self.length - x, self.batter),
            (y, self.batter),
            (self.corner - y, self.rack),
            (inner, rear),
        ]
