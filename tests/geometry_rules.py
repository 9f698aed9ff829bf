"""What holds of geometry, in words: the faults of a subdivision; and hulls by another hand."""

import numpy as np
import shapely
from scipy.spatial import ConvexHull

from cyclopean.geometry.solids import mesh_of, solid_of


def hull_mesh(points):
    """Vertices and outward triangles of the convex hull of points (n, 3), by Qhull."""
    hull = ConvexHull(points)
    corner = points[hull.simplices]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    inward = np.einsum("ti,ti->t", normal, hull.equations[:, :3]) < 0.0
    facet = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)
    kept, number = np.unique(facet, return_inverse=True)
    return mesh_of(solid_of(points[kept], number.reshape(-1, 3), "hull"))


def faults(subdivision, area=None):
    """What is wrong with a subdivision, in plain sentences; an empty list means that the cells tile their outline.

    Simple, counter-clockwise cells in which every directed edge occurs once, and whose unpaired edges close up to
    rings that neither cross nor touch along a line, cover the inside of those rings exactly once: walking across a
    paired edge leaves one cell and enters one other.
    `area` (m2) is what the cells should cover in all, within 1e-9 of it.
    """
    index, following, cell = subdivision.index, subdivision.following(), subdivision.cell()
    found = [f"cell {c} is not simple" for c in np.flatnonzero(~shapely.is_valid(subdivision.polygons()))]
    found += [f"cell {c} has no positive area" for c in np.flatnonzero(~(subdivision.areas() > 0.0))]
    directed = index * len(subdivision.vertex) + following
    order = np.argsort(directed, kind="stable")
    twice = np.flatnonzero(directed[order][1:] == directed[order][:-1])
    for k in twice:
        a, b = cell[order[k]], cell[order[k + 1]]
        found.append(f"cells {a} and {b} overlap along edge {index[order[k]]}-{following[order[k]]}")
    if twice.size:
        return found
    found += _boundary_faults(subdivision)
    covered = float(subdivision.areas().sum())
    if area is not None and not (abs(covered - area) <= 1e-9 * area):
        found.append(f"the cells cover {covered:.12g} m2 of {area:.12g} m2")
    return found


def _boundary_faults(subdivision):
    """Unpaired edges must enclose the cells; a gap or a vertex that one neighbour lacks shows as an edge too many."""
    if not len(subdivision):
        return []
    outer = subdivision.edge[(subdivision.side < 0).any(axis=1)]
    line = shapely.linestrings(subdivision.vertex[outer])
    first, second = shapely.STRtree(line).query(line, predicate="intersects")
    once = first < second
    first, second = first[once], second[once]
    shared = (outer[first][:, :, None] == outer[second][:, None, :]).any(axis=(1, 2))
    along = shapely.length(shapely.intersection(line[first], line[second])) > 0.0
    return [
        f"edges {a[0]}-{a[1]} and {b[0]}-{b[1]} meet without sharing a vertex: a gap, an overlap or a missing corner"
        for a, b in zip(outer[first[~shared | along]], outer[second[~shared | along]], strict=True)
    ]
