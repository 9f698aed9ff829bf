"""Cells overlaid with polygons that have the say: holes cut out of them, and cells that are given.

All lines are noded together on a fine grid, so that a vertex exists once; then every vertex that was known before gets
its own floats back, and one that lies on an axis-parallel side of a given polygon lies on it exactly. Only the cells
near the given polygons take part, the others keep their vertices untouched.

By hand: a unit square with its lower right quarter cut out keeps 3/4.

>>> whole = subdivide([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2, 3]])
>>> cut, given = arrangement(whole, [], [np.array([[0.5, 0], [1, 0], [1, 0.5], [0.5, 0.5]])])
>>> cut.areas().tolist(), given.tolist()
([0.75], [-1])
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.errors import InputError
from cyclopean.geometry.frames import cross_2d
from cyclopean.geometry.subdivision import Subdivision, dissolved, subdivide

__all__ = ["arrangement"]

GRID = 2.0**-33  # of the outline's size: vertices nearer to each other than about this become one


def arrangement(subdivision: Subdivision, given: Sequence[Floats], void: Sequence[Floats]) -> tuple[Subdivision, Ints]:
    """The cells where no given polygon lies, then the given polygons, all with common vertices; voids are left out.

    Parameters
    ----------
    subdivision : Subdivision
        Cells to be cut.
    given : sequence of (k, 2) float
        Simple polygons (m) that become cells; they lie within the cells' outline and do not overlap.
    void : sequence of (k, 2) float
        Simple polygons (m) that are cut out; they may reach over the edge of the outline.

    Returns
    -------
    subdivision : Subdivision
        Pieces of cells in the order of their sites, the larger piece first; then the given polygons, site -1.
    given : (n,) int
        Which given polygon each cell is, or -1.

    Raises
    ------
    InputError
        A given polygon that overlaps another or a void, or leaves the outline.
    """
    import shapely

    if not len(given) and not len(void):
        return subdivision, np.full(len(subdivision), -1)
    size = float(np.hypot(*np.ptp(subdivision.vertex, axis=0)))
    grid = 2.0 ** np.floor(np.log2(size)) * GRID
    cell = subdivision.polygons()
    outline = shapely.coverage_union_all(cell)
    hole = _common(shapely.union_all([shapely.polygons(v) for v in void]), outline) if len(void) else None
    block = [shapely.polygons(g) for g in given]
    laid = np.array([*block, *([hole] if hole is not None else [])])
    part = shapely.get_parts(laid)
    touched = np.unique(shapely.STRtree(cell).query(part, predicate="dwithin", distance=8.0 * grid)[1])
    seam = shapely.difference(shapely.boundary(cell[touched]), shapely.union_all(laid))
    face = _faces(shapely.union_all(np.concatenate([seam, shapely.boundary(laid)]), grid_size=grid), grid)
    owner = _owners(face, block, hole, cell[touched])
    rings, vertex = _restored(face, subdivision.vertex, list(given), void, grid)
    count = np.bincount(owner[owner >= len(touched)] - len(touched), minlength=len(block))
    if (bad := np.flatnonzero(count != 1)).size:
        raise InputError(f"given polygon {bad[0]} overlaps another one or a void, or leaves the outline")
    return _assembled(subdivision, touched, rings, vertex, owner)


def _common(a: Any, b: Any) -> Any:
    """What two regions have in common, without the lines and points along which they only touch."""
    import shapely

    part = shapely.get_parts(shapely.intersection(a, b))
    return shapely.union_all(part[shapely.get_dimensions(part) == 2])


def _faces(line: Any, grid: float) -> Any:
    """Faces, none with a hole, into which noded lines cut the plane."""
    import shapely

    while True:
        face = shapely.get_parts(shapely.polygonize(shapely.get_parts(line)))
        ringed = face[shapely.get_num_interior_rings(face) > 0]
        if not len(ringed):
            return face
        # an island in a cell: cut the cell in two through it, from side to side
        cuts = []
        for polygon in ringed:
            low, _, high, _ = shapely.bounds(shapely.get_interior_ring(polygon, 0))
            _, bottom, _, top = shapely.bounds(polygon)
            cut = shapely.linestrings([[(low + high) / 2.0, bottom - grid], [(low + high) / 2.0, top + grid]])
            cuts.append(shapely.intersection(cut, polygon))
        line = shapely.union_all([line, *cuts], grid_size=grid)


def _owners(face: Any, block: Sequence[Any], hole: Any, cell: Any) -> Ints:
    """Cell that each face is a part of, or len(cell) + given polygon, or -1 for a void."""
    import shapely

    inside = shapely.point_on_surface(face)
    owner = np.full(len(face), -1, np.int64)
    for which, first in ((cell, 0), (np.array(block), len(cell))):
        if len(which):
            point, polygon = shapely.STRtree(which).query(inside, predicate="intersects")
            owner[point] = first + polygon
    if hole is not None:
        shapely.prepare(hole)
        owner[shapely.intersects(hole, inside)] = -1
    return owner


def _restored(
    face: Any, known: Floats, given: Sequence[Floats], void: Sequence[Floats], grid: float
) -> tuple[list[list[int]], Floats]:
    """Rings of vertex numbers: known vertices come first and keep their floats, new ones follow."""
    import shapely
    from scipy.spatial import cKDTree

    coordinate, owner = shapely.get_coordinates(shapely.get_exterior_ring(face), return_index=True)
    last = np.append(np.flatnonzero(np.diff(owner)), len(owner) - 1)
    coordinate, owner = np.delete(coordinate, last, axis=0), np.delete(owner, last)  # the closing point
    sides = [np.stack([p, np.roll(p, -1, axis=0)], 1) for p in (*given, *void)]
    side = np.concatenate(sides)
    base = np.concatenate([known, side[:, 0]])
    far, near = cKDTree(side[:, 0]).query(coordinate, distance_upper_bound=2.0 * grid)
    name = np.where(np.isfinite(far), len(known) + near, -1)
    far, near = cKDTree(known).query(coordinate, distance_upper_bound=2.0 * grid)
    name = np.where((name < 0) & np.isfinite(far), near, name)
    new = np.flatnonzero(name < 0)
    fresh, number = np.unique(coordinate[new], axis=0, return_inverse=True)
    name[new] = len(base) + number
    vertex = np.concatenate([base, fresh])
    used = np.unique(name)
    vertex[used] = _on_sides(vertex[used], side, grid)
    first = np.unique(vertex, axis=0, return_index=True, return_inverse=True)  # a corner shared by given polygons
    name = first[1][first[2].ravel()][name]
    rings: list[list[int]] = [[] for _ in range(len(face))]
    for k, n in zip(owner.tolist(), name.tolist(), strict=True):
        if not rings[k] or rings[k][-1] != n:
            rings[k].append(n)
    ccw = shapely.is_ccw(shapely.get_exterior_ring(face))
    rings = [ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring for ring in rings]
    return [ring if up else ring[::-1] for ring, up in zip(rings, ccw, strict=True)], vertex


def _on_sides(point: Floats, side: Floats, grid: float) -> Floats:
    """Points that lie within the grid of an axis-parallel side, put onto it exactly."""
    point = point.copy()
    low, high = side.min(axis=1), side.max(axis=1)
    for axis in (0, 1):
        flat = np.flatnonzero(low[:, axis] == high[:, axis])
        for k in flat:
            close = np.abs(point[:, axis] - low[k, axis]) <= 2.0 * grid
            close &= (point[:, 1 - axis] >= low[k, 1 - axis]) & (point[:, 1 - axis] <= high[k, 1 - axis])
            point[close, axis] = low[k, axis]
    return point


def _assembled(
    subdivision: Subdivision, touched: Ints, rings: list[list[int]], vertex: Floats, owner: Ints
) -> tuple[Subdivision, Ints]:
    """Untouched cells and new faces in one subdivision, in canonical order."""
    old = subdivision.rings()
    untouched = np.setdiff1d(np.arange(len(subdivision)), touched)
    parts = [(int(subdivision.site[c]), 0.0, old[c], -1) for c in untouched]
    stones = len(touched)
    last = int(subdivision.site.max(initial=0)) + 1
    for ring, who in zip(rings, owner.tolist(), strict=True):
        if who < 0 or len(ring) < 3:
            continue
        p = vertex[ring] - vertex[ring[0]]
        area = float(cross_2d(p, np.roll(p, -1, axis=0)).sum()) / 2.0
        if not area > 0.0:
            continue
        if who < stones:
            parts.append((int(subdivision.site[touched[who]]), -area, ring, -1))
        else:
            parts.append((last + who - stones, 0.0, ring, who - stones))
    parts.sort(key=lambda part: part[:2])
    site = np.array([part[0] if part[3] < 0 else -1 for part in parts], dtype=np.int64)
    found = dissolved(subdivide(vertex, [part[2] for part in parts], site))
    return found, np.array([part[3] for part in parts], dtype=np.int64)
