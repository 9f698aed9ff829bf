"""Rank every stone in every cell in 48 rotations, as matrix products.

A wall's cell is nearly a prism, so what a stone shares with it is told in the plane of the wall: points of the stone
that stick out before or behind the cell are dropped, the rest are counted on a 24 x 24 grid, and the counts are
multiplied with the cell's outline, drawn on the same grid with soft edges. Both centroids are put on each other.

A rotation is one of 3 axes of the stone that goes through the wall, turned by 0 or 45 degrees, then by one of the 8
symmetries of the square, the mirrored ones with the stone turned back to front. The symmetries are applied to the
outlines, so a stone is counted 6 times only. Counts are whole numbers, so that sums are exact in single precision and
nothing depends on the order of stones, cells or tiles.

By hand: a stone that is the cell, a box, shares all of it; turned by 90 degrees about its thickness, a box of 2 x 1
shares half.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.design.matching.cells import Cells
from cyclopean.design.matching.problem import Problem, Singles

__all__ = ["POINTS", "Ranking", "Tile", "rank", "rank_tile", "rotations"]

GRID = 24  # squares along each side of the plane
FINE = 3  # samples along each side of a square, and through the wall
POINTS = 1024  # of each stone that are counted; POINTS * FINE**3 * CODE must stay below 2^24
CODE = 64  # a count is followed by the number of its rotation, so that one maximum finds both
TILE_STONES = 128  # by 256 cells at a time: a table of 128 KiB
TILE_CELLS = 256  # see TILE_STONES
CLASSES = 6  # different depths of cells that are told apart


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """What stone i shares with cell j in the best of the rotations, about the centroids."""

    shared: Singles  # (n, m) m3
    turns: NDArray[np.uint8]  # (starts, n, m) best rotations, best first; indices into `rotations()`
    axes: Floats  # (m, 3, 3) rows of each cell's frame in which the rotations are meant

    def rotation(self, stone: int | Ints, cell: int | Ints, place: int = 0) -> Floats:
        """(3, 3) or (b, 3, 3) body frame to wall, in the best rotation or one of the next."""
        turn = rotations()[self.turns[place, stone, cell]]
        return np.asarray(np.swapaxes(self.axes[cell], -1, -2) @ turn)


@dataclass(frozen=True, slots=True, eq=False)
class Tile:
    """Some stones and some cells: all that `rank_tile` needs, and nothing that cannot be sent elsewhere."""

    points: Singles  # (s, n, 3) m, body frame
    outline: NDArray[np.uint8]  # (c, GRID, GRID) of cells of about the same depth, in samples
    half_depth: float  # m
    width: float  # m: half of the grid's
    allowed: Bools  # (48,) rotations that the bond allows
    starts: int


@cache
def rotations() -> Floats:
    """(48, 3, 3): each takes the body frame of a stone to (first axis, second axis, through) of a cell.

    Number 16 a + 8 q + 4 f + i puts the stone's axis a through the wall, turned by 45 q + 90 i degrees, and turned back
    to front about the first axis if f.
    """
    back = np.diag([1.0, -1.0, -1.0])
    found = []
    for axis in range(3):
        base = np.eye(3)[[(axis + 1) % 3, (axis + 2) % 3, axis]]
        for eighth in (_turned(1.0, 0.0), _turned(np.sqrt(0.5), np.sqrt(0.5))):
            for front in (True, False):
                for quarter in range(4):
                    turn = np.linalg.matrix_power(_turned(0.0, 1.0), quarter) @ eighth @ base
                    found.append(turn if front else back @ turn)
    turns = np.stack(found)
    turns.flags.writeable = False
    return turns


def _turned(cos: float, sin: float) -> Floats:
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def rank(problem: Problem, axes: Floats, allowed: Bools, starts: int) -> Ranking:
    """Rank all stones in all cells, by the first 1024 points of each stone.

    Parameters
    ----------
    problem : Problem
        Stones and cells.
    axes : (m, 3, 3) float
        Rows of each cell's frame in which the rotations are meant: `cells.axes` or `cells.frame`.
    allowed : (48,) bool
        Rotations that may be used.
    starts : int
        How many of the best rotations are kept.
    """
    points, cells = problem.points[:, :POINTS], problem.cells
    starts = min(starts, int(allowed.sum()))
    best = np.zeros((len(points), len(cells)), np.float32)
    turns = np.zeros((starts, len(points), len(cells)), np.uint8)
    places, tiles = _tiles(points, cells, axes, allowed, starts)
    done = problem.done("ranking", rank_tile, tiles, len(places))
    for (stone, cell), (count, turn) in zip(places, done, strict=True):
        best[stone, cell], turns[:, stone, cell] = count, turn
    best *= (problem.volume / (points.shape[1] * FINE**3)).astype(np.float32)[:, None]
    return Ranking(best, turns, axes)


def _tiles(
    points: Singles, cells: Cells, axes: Floats, allowed: Bools, starts: int
) -> tuple[list[tuple[slice, NDArray[np.intp]]], Iterator[Tile]]:
    """Where each tile belongs in the table of stones and cells, and the tiles."""
    width = float(cells.reach.max())
    half = np.ptp(cells.depth, axis=1) / 2.0
    rows = [slice(k, min(k + TILE_STONES, len(points))) for k in range(0, len(points), TILE_STONES)]
    groups = [g[k : k + TILE_CELLS] for g in _depth_classes(half) for k in range(0, len(g), TILE_CELLS)]

    def made() -> Iterator[Tile]:
        for cell in groups:
            outline = _outlines(cells, axes, cell, width)
            for row in rows:
                yield Tile(points[row], outline, float(half[cell].mean()), width, allowed, starts)

    return [(row, cell) for cell in groups for row in rows], made()


def _depth_classes(half: Floats) -> list[NDArray[np.intp]]:
    """Cells of about the same depth together, deepest last: one class where a wall is of one thickness."""
    order = np.argsort(half, kind="stable")
    steps = np.log(np.maximum(half[order], 1e-9) / max(float(half.min()), 1e-9))
    span = max(float(steps[-1]) * (1.0 + 1e-9), 0.02 * CLASSES)
    label = np.minimum((steps / span * CLASSES).astype(np.int64), CLASSES - 1)
    return [order[label == k] for k in range(CLASSES) if (label == k).any()]


def _outlines(cells: Cells, axes: Floats, chosen: NDArray[np.intp], width: float) -> NDArray[np.uint8]:
    """(c, GRID, GRID): how many of the samples in each square of the grid lie in the cell, 27 at most.

    The cell's middle lies where the points are dropped from, its centroid on the middle of the grid.
    """
    line = (np.arange(GRID * FINE) + 0.5) * (2.0 * width / (GRID * FINE)) - width
    plane = np.stack(np.meshgrid(line, line, indexing="ij"), -1).reshape(-1, 2)
    found = np.zeros((len(chosen), GRID, GRID), np.uint8)
    for row, j in enumerate(chosen):
        low, high = cells.depth[j]
        inside = np.zeros((FINE, len(plane)), bool)
        normal = cells.normal[j] @ axes[j].T  # (p, k, 3) in the cell's own frame
        straight = not bool((np.minimum(np.abs(normal[..., 2]), np.hypot(*normal[..., :2].T).T) > 1e-9).any())
        flat = normal[..., :2] @ plane.T - cells.offset[j][..., None]  # (p, k, samples)
        for layer in range(1 if straight else FINE):
            z = low + (high - low) * ((layer + 0.5) / FINE if not straight else 0.5)
            inside[layer] = ((flat + normal[..., 2:] * z) <= 0.0).all(axis=1).any(axis=0)
        if straight:
            inside[1:] = inside[0]
        found[row] = inside.reshape(FINE, GRID, FINE, GRID, FINE).sum(axis=(0, 2, 4))
    return found


def rank_tile(tile: Tile) -> tuple[Singles, NDArray[np.uint8]]:
    """Rank the stones of a tile in its cells.

    Returns
    -------
    count : (s, c) float32
        Points times samples in common, in the best rotation.
    turns : (starts, s, c) uint8
        The best rotations, best first.
    """
    variants = _variants(tile.outline)  # (8, squares, c)
    stones, cells = len(tile.points), tile.outline.shape[0]
    best = np.full((tile.starts, stones, cells), -1.0, np.float32)
    for base, turn in enumerate(rotations()[::8]):
        allowed = tile.allowed[8 * base : 8 * base + 8]
        if not allowed.any():
            continue
        count = _counted(tile, turn.astype(np.float32))
        for number in np.flatnonzero(allowed):
            code = count @ variants[number]
            code += np.float32(CODE - 1 - (8 * base + number))
            for level in best:  # each level keeps the better and hands down the other
                low = np.minimum(level, code)
                np.maximum(level, code, out=level)
                code = low
    whole = best.astype(np.int32)
    return (whole[0] // CODE).astype(np.float32), (CODE - 1 - whole % CODE).astype(np.uint8)


def _variants(outline: NDArray[np.uint8]) -> Singles:
    """Outlines as seen after each of the 8 symmetries, ready for the product: (8, squares, c), times CODE."""
    found = []
    for seen in (outline, outline[:, :, ::-1]):
        for _ in range(4):
            found.append(seen.reshape(len(outline), -1).T)
            seen = seen[:, ::-1].transpose(0, 2, 1)  # (a, b) -> (-b, a)
    return np.ascontiguousarray(found).astype(np.float32) * np.float32(CODE)


def _counted(tile: Tile, turn: Singles) -> Singles:
    """(s, squares): points of each stone on the grid, without those that stick out of the wall."""
    scale = np.float32(GRID / (2.0 * tile.width))
    across, up, depth = (tile.points @ row for row in turn)  # each in one piece is faster than all three in columns
    i, j = (np.floor((along + np.float32(tile.width)) * scale) for along in (across, up))
    held = (i >= 0) & (i < GRID) & (j >= 0) & (j < GRID) & (np.abs(depth) <= np.float32(tile.half_depth))
    square = np.where(held, i * GRID + j, GRID * GRID).astype(np.int64)
    squares = GRID * GRID + 1
    square += np.arange(len(square))[:, None] * squares
    counts = np.bincount(square.ravel(), minlength=len(square) * squares).reshape(-1, squares)
    return counts[:, :-1].astype(np.float32)
