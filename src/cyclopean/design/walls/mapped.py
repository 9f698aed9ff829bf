"""A designer's surface: an open mesh laid flat, so that a pattern in metres can be laid on it.

The mesh is a sheet with one boundary (`geometry.unfolding.sheet`); laid flat as rigidly as possible, a metre of the
pattern is a metre on the surface but for a stretch that is told. The plane is turned so that v runs up, the way in
which the height grows on the whole; of a rectangle that is not upright, along the side that is nearest to that. The
pattern lies within the flat boundary. Where that is a rectangle, to within `FACETS`, everything is as on the surfaces
of formulas; else it is the outline of the wall, whose lower edge, as far as it is no steeper than `STEEP`, stands on
the ground.

Between the corners of a triangle point and normal are linear, so that the mesh itself is the face of the wall; normals
of corners are those of paraboloids fitted to the corners near them (Cazals & Pouget 2005). A point a little beyond the
boundary lies on the plane of the nearest triangle.

The wall lies behind the mesh, against its normals. Offsets along them fold where a triangle of the mesh, offset by t
with its normals n, is turned over: (e1 - t dn1) x (e2 - t dn2) . n = 0 for a t up to the depth, e = sides, dn =
differences of normals along them. On a sphere of radius R that is t = R.

By hand: a wall of 3 x 2 m in a plane that runs to the north looks to the east.

>>> corner = np.array([[0.0, 0, 0], [0, 3, 0], [0, 3, 2], [0, 0, 2]])
>>> wall = mapped(corner, [(0, 1, 2, 3)])
>>> round(wall.width, 9), round(wall.height, 9), wall.outline
(3.0, 2.0, None)
>>> point, normal = wall.at(np.array([[1.0, 0.5]]))
>>> (point.round(9) + 0.0).tolist(), (normal.round(9) + 0.0).tolist()
([[0.0, 1.0, 0.5]], [[1.0, 0.0, 0.0]])
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.surfaces import Thickness
from cyclopean.errors import InputError
from cyclopean.geometry import Subdivision, frames_from_normals, pack
from cyclopean.geometry.frames import unit
from cyclopean.geometry.mending import place_text
from cyclopean.geometry.unfolding import area_ratio, sheet, stretch, unfolded

__all__ = ["Mapped", "mapped"]

Point = tuple[float, float]

FACETS = 5e-4  # of the flat sheet's diagonal, 2 mm of a wall of 3.5 m: how far the outline may lie off the boundary
OBLONG = 0.99  # of the least rectangle about it: a sheet that fills so much of it is a rectangle, however it leans
STEEP = 1.0  # rise over run of the lower edge: what is steeper is a side of the wall, and does not stand
UPRIGHT = 0.1  # least mean rise of a metre of the flat sheet: a surface below that lies level and is no wall
MOST_STRETCH = 2.0  # lengths that are wrong by more make no stones of the size that was asked for
NARROW = 1e-6  # least eigenvalue over the greatest: corners nearer to a line say nothing of how the mesh bends across
MOST = 200_000  # triangles: more are laid flat in minutes, and no wall needs them


@dataclass(frozen=True, slots=True, eq=False)
class Mapped:
    """A sheet of triangles and where its corners lie in the pattern's plane."""

    vertex: Floats  # (n, 3) m
    normal: Floats  # (n, 3) outward, unit length
    triangle: Ints  # (t, 3)
    uv: Floats  # (n, 2) m; the rectangle about the outline begins at (0, 0)
    boundary: Ints  # (k,) corners of the mesh, counter-clockwise in the plane
    outline: tuple[Point, ...] | None = field(init=False)  # m, counter-clockwise; None = the whole rectangle
    width: float = field(init=False)  # m
    height: float = field(init=False)  # m
    tree: Any = field(init=False, repr=False)  # of the triangles in the plane

    def __post_init__(self) -> None:
        import shapely

        for name, columns in (("vertex", 3), ("normal", 3), ("uv", 2)):
            object.__setattr__(self, name, sealed(name, getattr(self, name), None, columns))
        object.__setattr__(self, "triangle", sealed("triangle", self.triangle, None, 3, dtype=np.int64))
        object.__setattr__(self, "boundary", sealed("boundary", self.boundary, None, dtype=np.int64))
        if not len(self.vertex) == len(self.normal) == len(self.uv):
            raise InputError("surface: as many normals and places in the plane as corners are needed")
        if not all(0 <= x.min(initial=0) and x.max(initial=0) < len(self.uv) for x in (self.triangle, self.boundary)):
            raise InputError("surface: a triangle names a corner that is not there")
        ring = self.uv[self.boundary]
        if not (len(ring) >= 3 and shapely.is_valid(shapely.polygons(ring)) and self.stretch[0] > 0.0):
            raise InputError("surface: its boundary crosses itself in the plane, or a triangle is turned over there")
        outline, (width, height) = _outline(self.uv[self.boundary])
        for name, value in (("outline", outline), ("width", width), ("height", height)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "tree", shapely.STRtree(shapely.polygons(self.uv[self.triangle])))

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals, (n, 3) each."""
        place = np.asarray(uv, float).reshape(-1, 2)
        corner = self.triangle[self._triangle_of(place)]
        share = _shares(place, self.uv[corner])
        point = (share[..., None] * self.vertex[corner]).sum(axis=1)
        share = np.maximum(share, 0.0)  # beyond the boundary the normal is that of the nearest point of it, nearly
        return point, unit((share[..., None] * self.normal[corner]).sum(axis=1))

    def _triangle_of(self, place: Floats) -> Ints:
        """(n,) triangle in which a place (n, 2) lies, or the nearest: on a common side always the same one."""
        import shapely

        point = shapely.points(place)
        found = np.full(len(place), len(self.triangle))
        which, triangle = self.tree.query(point, predicate="intersects")
        np.minimum.at(found, which, triangle)
        outside = np.flatnonzero(found == len(self.triangle))
        found[outside] = self.tree.nearest(point[outside])
        return found

    @property
    def stretch(self) -> tuple[float, float]:
        """Least and greatest length on the surface of a metre in the pattern."""
        each = stretch(self.vertex, self.uv, self.triangle)
        return float(each.min()), float(each.max())

    @property
    def told(self) -> str:
        """Its size and what laying it flat costs, in words."""
        least, most = self.stretch
        return (
            f"{self.width:.3g} x {self.height:.3g} m laid flat; a metre of the pattern is {least:.3f} to {most:.3f} m"
        )

    def area_ratio(self, uv: Floats) -> Floats:
        """Area on the surface of a square metre in the pattern, at (n, 2) m."""
        each = area_ratio(self.vertex, self.uv, self.triangle)
        return each[self._triangle_of(np.asarray(uv, float))]

    def fitted(self, settings: PatternSettings) -> PatternSettings:
        """The settings of a pattern that covers the surface.

        Raises
        ------
        InputError
            Settings that say another size, or that need a rectangle where the outline is none.
        """
        usual = PatternSettings()
        for name in ("width", "height"):
            if getattr(settings, name) not in (getattr(usual, name), getattr(self, name)):
                raise InputError(f"{name}: is that of the surface, {getattr(self, name):.4g} m; leave it out")
        whole = replace(settings, width=self.width, height=self.height)
        if self.outline is None:
            return whole
        for name in ("quoins", "coping", "base", "base_radius"):
            if getattr(settings, name) is not None:
                raise InputError(
                    f"{name}: is of a wall with four square corners, which this surface has not; leave it out"
                )
        return replace(whole, outline=self.outline, base=_base(self.outline, self.width))

    def refuse_outside(self, cells: Subdivision) -> None:
        """Refuse a drawing that reaches beyond the surface.

        Raises
        ------
        InputError
            With the place.
        """
        import shapely

        ring = self.uv[self.boundary]
        far = shapely.distance(shapely.polygons(ring), shapely.points(cells.vertex))
        worst = int(far.argmax())
        if not far[worst] <= 2.0 * FACETS * float(np.hypot(*np.ptp(ring, axis=0))):
            u, v = cells.vertex[worst]
            raise InputError(
                f"drawing: reaches {far[worst]:.3g} m beyond the surface at u = {u:.3g}, v = {v:.3g} m; "
                f"draw within {self.width:.4g} x {self.height:.4g} m, from the lower left"
            )

    def refuse_folds(self, thickness: Thickness) -> None:
        """Refuse a wall whose back would fold into itself.

        Raises
        ------
        InputError
            With the place where the mesh folds first.
        """
        corner, normal = self.vertex[self.triangle], self.normal[self.triangle]
        (e1, e2), (d1, d2) = ((x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) for x in (corner, normal))
        up = np.cross(e1, e2)
        c = (np.cross(d1, d2) * up).sum(axis=1)
        b = -((np.cross(d1, e2) + np.cross(e1, d2)) * up).sum(axis=1)
        folds = _first_root((up * up).sum(axis=1), b, c)
        first = int(folds.argmin())
        if not folds[first] > thickness.depth * (1.0 + 1e-6):
            raise InputError(
                f"surface: it bends with a radius of {folds[first]:.3g} m near "
                f"{place_text(corner[first].mean(axis=0))} m, not more than the wall's depth {thickness.depth:g} m; "
                "bend it less there or make the wall thinner"
            )


def mapped(vertex: ArrayLike, faces: Sequence[Sequence[int]]) -> Mapped:
    """Lay an open mesh flat.

    Parameters
    ----------
    vertex : (n, 3) array_like
        m.
    faces : sequence of sequence of int
        Triangles and polygons, counter-clockwise seen from where the wall is looked at.

    Raises
    ------
    InputError
        No sheet with one boundary, one that cannot be laid flat, or that lies level.
    """
    given = sealed("vertex", vertex, None, 3)
    if not len(faces):
        raise InputError("has no faces; a surface is an open mesh")
    if len(faces) > MOST:
        raise InputError(f"has more than {MOST:,} faces; give a coarser mesh")
    point, triangle, boundary = sheet(pack([(given, [tuple(face) for face in faces])]))
    flat = unfolded(point, triangle)
    _refuse_stretch(point, flat, triangle)
    flat = _upright(point, flat, triangle, boundary)
    return Mapped(point, _normals(point, triangle), triangle, flat, boundary)


def _refuse_stretch(vertex: Floats, flat: Floats, triangle: Ints) -> None:
    each = stretch(vertex, flat, triangle)
    wrong = np.maximum(each[:, 1], 1.0 / np.maximum(each[:, 0], 1e-12))
    wrong[each[:, 0] <= 0.0] = np.inf
    worst = int(wrong.argmax())
    if not wrong[worst] <= MOST_STRETCH:
        raise InputError(
            f"cannot be laid flat without stretching it more than {MOST_STRETCH:g} times, worst near "
            f"{place_text(vertex[triangle[worst]].mean(axis=0))}; give it in parts, each a wall of its own"
        )


def _upright(vertex: Floats, flat: Floats, triangle: Ints, boundary: Ints) -> Floats:
    """The flat sheet turned so that v runs up, and moved so that its outline begins at (0, 0)."""
    import shapely

    side, height = flat[triangle], vertex[triangle, 2]
    run = np.stack([side[:, 1] - side[:, 0], side[:, 2] - side[:, 0]], 1)
    rise = np.stack([height[:, 1] - height[:, 0], height[:, 2] - height[:, 0]], 1)
    area = np.linalg.det(run)
    up = (np.linalg.solve(run, rise[..., None])[..., 0] * area[:, None]).sum(axis=0) / area.sum()
    if not np.linalg.norm(up) > UPRIGHT:
        raise InputError("lies level on the whole, and no wall stands on it; a wall's face rises")
    up = unit(up)
    ring = shapely.polygons(flat[boundary])
    if not shapely.is_valid(ring):
        raise InputError("overlaps itself when it is laid flat; give it in parts, each a wall of its own")
    box = shapely.oriented_envelope(ring)
    if shapely.area(ring) >= OBLONG * shapely.area(box):
        one = unit(shapely.get_coordinates(box)[1] - shapely.get_coordinates(box)[0])
        ways = np.array([one, -one, [-one[1], one[0]], [one[1], -one[0]]])
        up = ways[int((ways @ up).argmax())]
    turned = np.stack([flat @ np.array([up[1], -up[0]]), flat @ up], 1)
    return np.asarray(turned - turned[boundary].min(axis=0))


def _outline(ring: Floats) -> tuple[tuple[Point, ...] | None, Point]:
    """The boundary (k, 2) with as few corners as its facets allow, None where these are a rectangle's; its size (m)."""
    import shapely

    size = np.ptp(ring, axis=0)
    reach = FACETS * float(np.hypot(*size))
    before, after = (unit(np.roll(ring, k, axis=0) - ring) for k in (1, -1))
    sharpest = int((before * after).sum(axis=1).argmax())  # a corner that is kept
    kept = shapely.simplify(shapely.polygons(np.roll(ring, -sharpest, axis=0)), reach)
    corner = shapely.get_coordinates(kept)[:-1]
    for axis in (0, 1):
        corner[np.abs(corner[:, axis]) <= reach, axis] = 0.0
        corner[np.abs(corner[:, axis] - size[axis]) <= reach, axis] = size[axis]
    straight = shapely.get_coordinates(shapely.simplify(shapely.polygons(corner), 0.0))[:-1]
    whole = float(size[0]), float(size[1])
    if len(straight) == 4 and np.all((straight == 0.0) | (straight == size)):
        return None, whole
    return tuple((u, v) for u, v in straight.tolist()), whole


def _base(outline: Sequence[Point], width: float) -> tuple[Point, ...] | None:
    """The lower edge of an outline, on which the wall stands, drawn out level to both ends; None where it is level."""
    corner = np.array(outline)
    run, rise = (np.roll(corner, -1, axis=0) - corner).T
    bears = (run > 0.0) & (np.abs(rise) <= STEEP * run)
    count, lowest = len(corner), int(corner[:, 1].argmin())
    first = last = lowest
    while bears[(first - 1) % count] and first > lowest - count:
        first -= 1
    while bears[last % count] and last < lowest + count:
        last += 1
    if first == last:
        u, v = corner[lowest]
        raise InputError(f"surface: it stands on a corner, at u = {u:.3g}, v = {v:.3g} m; give it a foot to stand on")
    line = [(float(u), float(v)) for u, v in corner[np.arange(first, last + 1) % count]]
    line = [(0.0, line[0][1])] * (line[0][0] > 0.0) + line + [(width, line[-1][1])] * (line[-1][0] < width)
    return tuple(line) if any(v for _, v in line) else None


def _normals(vertex: Floats, triangle: Ints) -> Floats:
    """(n, 3) normals of corners: of the paraboloid over the corners up to two sides away.

    A mean of the triangles round a corner would lean inwards along the boundary.
    """
    from scipy.sparse import coo_array

    corner = vertex[triangle]
    twice = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    rough = np.zeros_like(vertex)
    np.add.at(rough, triangle, twice[:, None, :])
    rough = unit(rough)
    row = triangle.ravel(), np.repeat(np.arange(len(triangle)), 3)
    meets = coo_array((np.ones(3 * len(triangle)), row), shape=(len(vertex), len(triangle))).tocsr()
    joined = meets @ meets.T
    near = (joined @ joined).tocsr()
    here, start = np.repeat(np.arange(len(vertex)), np.diff(near.indptr)), near.indptr[:-1]
    frame = frames_from_normals(rough)
    off = np.einsum("kij,kj->ki", frame[here], vertex[near.indices] - vertex[here])
    reach = np.maximum.reduceat(np.linalg.norm(off, axis=1), start)
    rise, s, t = (off / reach[here, None]).T
    basis = np.stack([s, t, s * s, s * t, t * t], 1)
    matrix = np.add.reduceat(basis[:, :, None] * basis[:, None, :], start)
    found = (
        np.linalg.pinv(matrix, rcond=NARROW, hermitian=True) @ np.add.reduceat(basis * rise[:, None], start)[..., None]
    )
    return unit(frame[:, 0] - found[:, 0] * frame[:, 1] - found[:, 1] * frame[:, 2])


def _shares(place: Floats, corner: Floats) -> Floats:
    """(n, 3) weights of the corners (n, 3, 2) of a triangle, of which a place is the mean."""
    one, two, here = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0], place - corner[:, 0]
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    second = (here[:, 0] * two[:, 1] - here[:, 1] * two[:, 0]) / area
    third = (one[:, 0] * here[:, 1] - one[:, 1] * here[:, 0]) / area
    return np.stack([1.0 - second - third, second, third], 1)


def _first_root(a: Floats, b: Floats, c: Floats) -> Floats:
    """Least positive t with a + b t + c t^2 = 0, for a > 0; inf where there is none."""
    inside = b * b - 4.0 * a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        q = -(b + np.where(b < 0.0, -1.0, 1.0) * np.sqrt(np.maximum(inside, 0.0))) / 2.0
        roots = np.stack([a / q, q / c], 1)
    good = (inside >= 0.0)[:, None] & np.isfinite(roots) & (roots > 0.0)
    return np.asarray(np.where(good, roots, np.inf).min(axis=1))
