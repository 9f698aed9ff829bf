"""An open sheet of triangles laid flat, as rigidly as possible.

A sheet is a disc: one piece, one boundary, two triangles at most on every edge. It is laid flat in two steps, each a
sparse system: a conformal map (least squares; corners keep their angles as well as they can), which begins the second,
the map whose triangles are as nearly as possible turned and not stretched:

    minimise  sum_t  sum_{edges ij of t}  cot(angle across ij) | (u_i - u_j) - R_t (x_i - x_j) |^2

over the places u of the corners and one rotation R_t of each triangle, x being the triangle in its own plane; in turns
for all R_t, which is in closed form, and for all u, a solve with a matrix that is factorised once. A sheet that can be
unfolded without stretching (a plane, a cylinder, a cone) is unfolded exactly by the first step already.

Sources: Levy, Petitjean, Ray & Maillot, "Least squares conformal maps" (2002); Liu, Zhang, Xu, Gotsman & Gortler, "A
local/global approach to mesh parameterization" (2008).

By hand: a square metre that is folded upright along its diagonal is a square again.

>>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0.5, 0.5**0.5], [0, 1, 0]])
>>> flat = unfolded(corner, np.array([[0, 1, 3], [1, 2, 3]]))
>>> float(np.linalg.norm(flat[2] - flat[0]).round(9))
1.414213562
>>> stretch(corner, flat, np.array([[0, 1, 3], [1, 2, 3]])).round(9).tolist()
[[1.0, 1.0], [1.0, 1.0]]
"""

from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.errors import InputError
from cyclopean.geometry.mending import Reach, Work, place_text, sewn, turned_alike
from cyclopean.geometry.packed import components
from cyclopean.geometry.polyhedra import Polyhedra, compacted, triangles
from cyclopean.geometry.sides import rings

__all__ = ["area_ratio", "sheet", "stretch", "unfolded"]

ROUNDS = 300  # of turns and solves: each gains a digit or two on a sheet that is bent a little, none after the last
NEEDLE = 1e-6  # of its length squared: a triangle of less area has no plane of its own
STILL = 1e-10  # of the sheet's size: corners that move less in a round have arrived


def sheet(mesh: Polyhedra) -> tuple[Floats, Ints, Ints]:
    """Corners (n, 3) m, triangles (t, 3) and boundary (k,) of a mesh of one body, its faces turned alike.

    Equal vertices are made one and faces without area dropped, as for the blocks of a model.

    Raises
    ------
    InputError
        No disc: closed, of several pieces or boundaries, more than two faces on an edge, a handle, one side only.
    """
    work = turned_alike(sewn(Work.of(mesh), Reach()))
    clean = compacted(work.mesh)
    if work.fault:
        raise InputError(f"{next(iter(work.fault.values()))}; a wall has a front and a back")
    sides = Work.of(clean).sides
    middle = (clean.vertex[sides.tail] + clean.vertex[sides.head]) / 2.0
    if len(many := np.flatnonzero(sides.count[sides.edge] > 2)):
        raise InputError(f"has an edge with more than two faces near {place_text(middle[many[0]])}; take one away")
    one, two = sides.pairs()
    piece = components(len(clean.corner_start) - 1, sides.face[one], sides.face[two])
    if len(set(piece.tolist())) > 1:
        apart = [clean.vertex[clean.corner[clean.corner_start[np.flatnonzero(piece == k)[0]]]] for k in (0, 1)]
        places = " and ".join(map(place_text, apart))
        raise InputError(f"is in {len(set(piece.tolist()))} pieces, two near {places}; a wall has one face")
    loops = list(rings(sides.rim))
    if not loops:
        raise InputError("is closed; a wall needs an open face: take away what is not its front")
    if len(loops) > 1:
        places = " and ".join(place_text(clean.vertex[loop].mean(axis=0)) for loop in loops[:2])
        raise InputError(
            f"has {len(loops)} boundaries, two of them round {places}; fill holes, and say doors with `opening`"
        )
    corner, _ = triangles(clean)
    ends = clean.vertex[corner]
    double = np.linalg.norm(np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0]), axis=1)
    if len(thin := np.flatnonzero(~(double > NEEDLE * np.ptp(ends, axis=1).max(axis=1) ** 2))):
        raise InputError(f"has a face without area near {place_text(ends[thin[0]].mean(axis=0))}; mesh it anew")
    if len(clean.vertex) - len(sides.count) + len(clean.corner_start) - 1 != 1:
        raise InputError("has a handle, or touches itself at a corner; a wall's face can be laid flat")
    return clean.vertex, corner, loops[0]


def unfolded(vertex: Floats, triangle: Ints) -> Floats:
    """The sheet in the plane, (n, 2) m: stretched as little as possible, the outer side of its triangles up.

    Parameters
    ----------
    vertex : (n, 3) float
        Corners (m).
    triangle : (t, 3) int
        A disc, each triangle counter-clockwise seen from outside.
    """
    from scipy.sparse.linalg import splu

    own = _own_planes(vertex, triangle)
    flat = _conformal(vertex, triangle, own)
    weight = _cotangents(own)
    solve = splu(_laplacian(len(vertex), triangle, weight)).solve
    size = float(np.linalg.norm(np.ptp(vertex, axis=0)))
    edge = own - np.roll(own, -1, axis=1)  # (t, 3, 2) from corner k to the next
    for _ in range(ROUNDS):
        side = flat[triangle] - np.roll(flat[triangle], -1, axis=1)
        turn = (weight[..., None, None] * side[..., :, None] * edge[..., None, :]).sum(axis=1)
        angle = np.arctan2(turn[:, 1, 0] - turn[:, 0, 1], turn[:, 0, 0] + turn[:, 1, 1])
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        wanted = np.stack([cos * edge[..., 0] - sin * edge[..., 1], sin * edge[..., 0] + cos * edge[..., 1]], -1)
        pull = weight[..., None] * wanted
        right = np.zeros_like(flat)
        np.add.at(right, triangle, pull - np.roll(pull, 1, axis=1))
        right[0] = 0.0  # this corner stays at the origin
        moved = solve(right)
        still = float(np.abs(moved - (flat - flat[0])).max()) <= STILL * size
        flat = moved
        if still:
            break
    return np.asarray(flat)


def stretch(vertex: Floats, flat: Floats, triangle: Ints) -> Floats:
    """Least and greatest length on the sheet of a metre in the plane, (t, 2) of each triangle; negative = turned over.

    The singular values of the map from the plane (n, 2) to the sheet (n, 3).
    """
    own, plane = _own_planes(vertex, triangle), flat[triangle]
    there, here = (np.stack([x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]], -1) for x in (own, plane))
    area = np.linalg.det(here)
    bad = ~(np.abs(area) > 1e-12 * np.abs(np.linalg.det(there)))
    here[bad] = np.eye(2) * 1e-12  # a triangle that has no area any more is stretched beyond all measure
    value = np.linalg.svd(there @ np.linalg.inv(here), compute_uv=False)[:, ::-1]
    return np.asarray(np.where((area > 0.0)[:, None], value, -value))


def area_ratio(vertex: Floats, flat: Floats, triangle: Ints) -> Floats:
    """Area on the sheet of a square metre in the plane, (t,) of each triangle."""
    return np.asarray(np.prod(stretch(vertex, flat, triangle), axis=1))


def _own_planes(vertex: Floats, triangle: Ints) -> Floats:
    """(t, 3, 2) each triangle in its own plane (m), from its first corner along its first side."""
    corner = vertex[triangle]
    one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    length = np.linalg.norm(one, axis=1)
    along = (one * two).sum(axis=1) / length
    across = np.linalg.norm(np.cross(one, two), axis=1) / length
    zero = np.zeros(len(triangle))
    return np.stack([np.stack([zero, zero], 1), np.stack([length, zero], 1), np.stack([along, across], 1)], 1)


def _conformal(vertex: Floats, triangle: Ints, own: Floats) -> Floats:
    """Least squares conformal map, two far corners held; scaled to the area of the sheet."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    z = own[..., 0] + 1j * own[..., 1]
    double = ((z[:, 1] - z[:, 0]).conj() * (z[:, 2] - z[:, 0])).imag
    opposite = (np.roll(z, -2, axis=1) - np.roll(z, -1, axis=1)) / np.sqrt(double)[:, None]
    row = np.repeat(np.arange(len(triangle)), 3)
    system = csc_array((opposite.ravel(), (row, triangle.ravel())), shape=(len(triangle), len(vertex)))
    first = int(np.argmax(np.linalg.norm(vertex - vertex[triangle[0, 0]], axis=1)))
    second = int(np.argmax(np.linalg.norm(vertex - vertex[first], axis=1)))
    free = np.setdiff1d(np.arange(len(vertex)), [first, second])
    held = np.zeros(len(vertex), complex)
    held[second] = np.linalg.norm(vertex[second] - vertex[first])
    if len(free):
        part = system[:, free]
        normal = csc_array(part.conj().T @ part)
        held[free] = splu(normal).solve(-(part.conj().T @ (system @ held)))
    flat = np.stack([held.real, held.imag], 1)
    side = flat[triangle]
    one, two = side[:, 1] - side[:, 0], side[:, 2] - side[:, 0]
    area = float(np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum())
    return np.asarray((flat - flat[0]) * np.sqrt(double.sum() / area))


def _cotangents(own: Floats) -> Floats:
    """(t, 3) cotangent of the angle across the side from each corner to the next."""
    tip = np.roll(own, -2, axis=1)
    one, two = own - tip, np.roll(own, -1, axis=1) - tip
    area = one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]
    return np.asarray((one * two).sum(axis=-1) / area)


def _laplacian(count: int, triangle: Ints, weight: Floats) -> Any:
    """(n, n) matrix of the second step, its first corner held."""
    from scipy.sparse import csc_array

    a, b, w = triangle.ravel(), np.roll(triangle, -1, axis=1).ravel(), weight.ravel()
    row, column = np.concatenate([a, b, a, b]), np.concatenate([a, b, b, a])
    value = np.concatenate([w, w, -w, -w])
    keep = row != 0
    ends = np.append(row[keep], 0), np.append(column[keep], 0)
    return csc_array((np.append(value[keep], 1.0), ends), shape=(count, count))
