"""The front of any wall as cells: what a drawn wall has by its pattern, read off the stones of one that has none.

A wall has an upright plane. Up is z; along the wall lies the longer side of the smallest rectangle around the stones in
plan, or of the rectangle along x and y where that is hardly larger; its front looks towards -y, or -x. Blocks that are
fixed are ground, unless several lie lowest and nobody said that they are fixed.

- Where the faces of the stones in the front fit each other, their outlines are noded (`geometry.line_net`) and become
  cells that share their joints, as a drawing of joints would. So a wall that was drawn on a plane gets its own cells
  again.
- Where joints are open or stones hide others (found, settled, carved stones, several leaves), the front is seen on a
  raster, joints halved between the stones beside them (`design.rubble.masons_rules`), and a joint is the straight line
  between the corners at which it meets others.

Both are measured as `interlock` does it: courses are those of a wall of as many stones of the mean size, and midpoints
coincide within a tenth of the mean spacing of head joints, unless something else is said.

By hand: two courses of stones 0.2 x 0.1 m in running bond climb 0.1 m, run 0.1 m aside and climb 0.1 m again.

>>> from cyclopean.design import wall
>>> found = interlock_of_stones(wall(4, 2, length=0.2, height=0.1))
>>> found.seen, found.interlock.score, round(found.minimum_trace)
('joints', 1.0, 1500)
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly, supports
from cyclopean.design.options import at_least
from cyclopean.design.rubble.masons_rules import Faces, MasonsRules, masons_rules, seen_front
from cyclopean.design.walls.interlock import TOLERANCE, Interlock, interlock, interlock_of
from cyclopean.design.walls.line_work import usual_grid
from cyclopean.design.walls.polygonal import PolygonalWall
from cyclopean.design.walls.surfaces import Plane
from cyclopean.errors import InputError
from cyclopean.geometry import Subdivision, components, subdivide
from cyclopean.geometry.line_net import outlined_cells
from cyclopean.geometry.polyhedra import face_normals, face_triangles

__all__ = ["WallInterlock", "interlock_of_stones", "interlock_of_wall"]

LEAST = 3  # stones: fewer have no joint that another stone could lie across
SNAP = 1e-3  # of the median height of stones: corners that are nearer to each other than this are one
ALIGNED = 1.1  # times the smallest rectangle: up to this the one along x and y is the frame, as found stones are rough
WIDE = 1.5  # times the height: wider, and it lies or vaults; a half dome has 2, the first course of found stones 1.2
IN_PLANE = 0.6  # share of the plan that stones fill: less, and they bend round a curve or a corner
SOLID = 0.5  # share of the elevation: less, and they span a void rather than fill a wall, as an arch does
FACING = 0.5  # cosine to the front: steeper faces are sides of a stone
OPEN = 1e-3  # of the front's area in gaps narrower than a tenth of a stone's height: more, and joints are open
NARROW = 0.1  # of the median height of stones: gaps up to this are joints
MERGED = 2.5  # cells of a raster: corners that are nearer to each other cannot be told apart


@dataclass(frozen=True, slots=True, eq=False)
class WallInterlock:
    """How the stones of a wall interlock, by its drawing or as they stand."""

    seen: str  # "drawing", "joints" (faces that fit) or "elevation" (a raster)
    interlock: Interlock
    cells: Subdivision  # whose edges and corners those of the interlock are
    courses: int
    masons: MasonsRules | None  # of the meshes in the wall's plane; None where the wall is curved
    along: Floats | None  # (3,) unit vector along the wall, to the right as seen from the front; None where curved
    size: Floats | None  # (3,) m: along, through and up; None where curved

    @property
    def minimum_trace(self) -> float:
        """Line of minimum trace, mm of joint to the m of height; nan where no joints lead from foot to top."""
        return 1e3 * self.interlock.rules.trace


@dataclass(frozen=True, slots=True, eq=False)
class _Standing:
    """Stones in the frame of their wall: x along it from 0, y behind the front, z above the foot."""

    stones: tuple["_Stone", ...]
    ground: tuple[Floats, ...]  # (v, 3) m each
    front: tuple[Any, ...]  # shapely outline of each stone's faces in the front, in the plane of x and z
    along: Floats  # (3,)
    size: Floats  # (3,) m
    height: float  # m, median of the stones


@dataclass(frozen=True, slots=True, eq=False)
class _Stone:
    vertices: Floats  # (v, 3) m
    triangles: Ints  # (t, 3)
    volume: float  # m3


def interlock_of_wall(
    wall: PolygonalWall, *, courses: int | None = None, tolerance: float | None = None
) -> WallInterlock:
    """Interlock of a wall by its drawing, on any surface; the masons' measures where that is a plane.

    Parameters
    ----------
    wall : PolygonalWall
    courses, tolerance : optional
        As of `interlock_of_stones`; those of the drawing where not given.
    """
    depth, pattern = wall.thickness.depth, wall.pattern
    if courses is None:
        found, courses = interlock(pattern, tolerance=tolerance, depth=depth), len(pattern.lines) - 1
    else:
        found = _scored(pattern.subdivision, courses, tolerance, pattern.foot)
    if not isinstance(wall.surface, Plane):
        return WallInterlock("drawing", found, pattern.subdivision, courses, None, None, None)
    stands = _standing(wall.assembly)
    return WallInterlock(
        "drawing", found, pattern.subdivision, courses, masons_rules(*_between_faces(stands)), stands.along, stands.size
    )


def interlock_of_stones(
    assembly: Assembly, *, courses: int | None = None, tolerance: float | None = None
) -> WallInterlock:
    """Interlock of a plane wall as its stones stand, whatever it was made by.

    Parameters
    ----------
    assembly : Assembly
        Closed meshes in their places, gravity along -z.
    courses : int, optional
        Into which the height is divided evenly; as many as stones of that size make where not given.
    tolerance : float, optional
        Distance along the wall (m) within which midpoints coincide; a tenth of the mean spacing of head joints where
        not given.

    Raises
    ------
    InputError
        The stones are no plane upright wall, and why not.
    """
    stands = _standing(assembly)
    cells = _jointed(stands)
    seen = "elevation" if cells is None else "joints"
    masons = masons_rules(*_between_faces(stands))
    cells = _elevated(stands) if cells is None else cells
    if not len(cells) or np.bincount(cells.index).max() < LEAST:
        raise _none(assembly, "no stone lies across the joint of two others, as in an arch, a column or one course")
    rows = usual_grid(cells, courses)[1]
    found = _scored(cells, rows, tolerance, _foot(stands, cells))
    if seen == "elevation":
        trace = np.nan if masons.trace_least is None else masons.trace_least
        found = replace(found, rules=replace(found.rules, trace=trace))
    return WallInterlock(seen, found, cells, rows, masons, stands.along, stands.size)


def _none(assembly: Assembly, why: str) -> InputError:
    return InputError(f"{assembly.name}: has no interlock: {why}")


def _scored(cells: Subdivision, courses: int, tolerance: float | None, foot: Floats | None) -> Interlock:
    width, height = np.ptp(cells.vertex, axis=0).tolist()
    columns, rows = usual_grid(cells, at_least("courses", courses, 1))
    low = float(cells.vertex[:, 1].min())
    lines = np.linspace(low, low + height, rows + 1)
    return interlock_of(
        cells, lines, tolerance=TOLERANCE * width / columns if tolerance is None else tolerance, foot=foot
    )


# The frame


def _standing(assembly: Assembly) -> _Standing:
    """The stones of a wall in its frame.

    Raises
    ------
    InputError
        They make no plane upright wall.
    """
    import shapely

    mesh, (ground, rule) = assembly.mesh, supports(assembly)
    if rule == "lowest" and np.count_nonzero(ground) > 1:  # the first course, where nobody said that it is fixed
        ground = np.zeros_like(ground)
    free = np.flatnonzero(~ground)
    if len(free) < LEAST:
        raise _none(assembly, f"it has {len(free)} stones, and a bond needs {LEAST}")
    points = [assembly.blocks[k].vertices for k in free]
    axes = _axes(np.concatenate(points)[:, :2])
    turned = mesh.vertex @ axes.T
    own = np.isin(mesh.vertex_body, free)
    low, high = turned[own].min(axis=0), turned[own].max(axis=0)
    place = turned - low
    parts = np.split(place, mesh.vertex_start[1:-1])
    _refuse_others(assembly, [parts[k] for k in free], high - low)
    stones = tuple(
        _Stone(parts[k], face_triangles(parts[k], assembly.blocks[k].faces), float(assembly.mass.volume[k]))
        for k in free
    )
    normal = face_normals(mesh) @ axes[1]
    facing = np.flatnonzero(normal <= -FACING * np.linalg.norm(face_normals(mesh), axis=1))
    corner = np.isin(mesh.corner_face, facing)
    ring = np.searchsorted(facing, mesh.corner_face[corner])
    face = shapely.polygons(shapely.linearrings(place[mesh.corner[corner]][:, [0, 2]], indices=ring))
    body = mesh.face_body[facing]
    front = tuple(shapely.union_all(shapely.make_valid(face[body == k])) for k in free)
    heights = [float(np.ptp(s.vertices[:, 2])) for s in stones]
    ends = tuple(parts[k] for k in np.flatnonzero(ground))
    return _Standing(stones, ends, front, axes[0], high - low, float(np.median(heights)))


def _axes(plan: Floats) -> Floats:
    """(3, 3) unit vectors along, through and up, of points in plan (m)."""
    import shapely

    box = np.ptp(plan, axis=0)
    least = shapely.oriented_envelope(shapely.multipoints(plan))
    if shapely.area(least) * ALIGNED >= np.prod(box) or shapely.area(least) == 0.0:
        through = np.array([0.0, 1.0, 0.0]) if box[0] >= box[1] else np.array([1.0, 0.0, 0.0])
    else:
        corner = shapely.get_coordinates(least)
        side = corner[1:3] - corner[:2]
        short = side[np.hypot(*side.T).argmin()]
        into = short if short[np.abs(short).argmax()] > 0.0 else -short
        through = np.append(into / np.hypot(*into), 0.0)
    up = np.array([0.0, 0.0, 1.0])
    return np.stack([np.cross(through, up), through, up])


def _refuse_others(assembly: Assembly, points: list[Floats], size: Floats) -> None:
    """Refuse what is wider than high, bends, or spans a void."""
    import shapely

    def filled(a: int, b: int) -> float:
        hull = shapely.convex_hull([shapely.multipoints(p[:, [a, b]]) for p in points])
        whole = shapely.union_all(hull)
        return float(shapely.area(whole) / shapely.area(shapely.convex_hull(whole)))

    if size[1] > WIDE * size[2]:
        raise _none(
            assembly,
            f"it is {size[1]:.3g} m wide and {size[2]:.3g} m high: a dome, a vault or a floor, and no upright wall",
        )
    if (share := filled(0, 1)) < IN_PLANE:
        raise _none(
            assembly,
            f"its stones fill {share:.0%} of its plan: it bends, and only a wall that carries its drawing is unrolled",
        )
    if (share := filled(0, 2)) < SOLID:
        raise _none(assembly, f"its stones fill {share:.0%} of its elevation: it spans a void, as an arch does")


# The front


def _jointed(stands: _Standing) -> Subdivision | None:
    """Cells that share their joints; None where the faces in the front do not fit each other."""
    import shapely

    front = np.array(stands.front)
    if any(one.geom_type != "Polygon" or len(one.interiors) for one in front):
        return None
    whole, half = shapely.union_all(front), NARROW * stands.height / 2.0
    closed = shapely.buffer(shapely.buffer(whole, half, join_style="mitre"), -half, join_style="mitre")
    if shapely.area(closed) - shapely.area(whole) > OPEN * shapely.area(whole):
        return None
    return outlined_cells(
        [shapely.get_coordinates(one.exterior) for one in front], front, SNAP * stands.height, once=True
    )


def _elevated(stands: _Standing) -> Subdivision:
    """Cells as they are seen on a raster, with straight joints."""
    import shapely

    label, cell = seen_front(*_between_faces(stands))
    shapes, outlines = [], []
    for k in np.unique(label[label >= 0]).tolist():
        mine = np.pad(label == k, ((0, 0), (1, 1))).astype(np.int8)
        i, low = np.nonzero(np.diff(mine, axis=1) == 1)
        high = np.nonzero(np.diff(mine, axis=1) == -1)[1]
        whole = shapely.union_all(shapely.box(i, low, i + 1, high))
        for part in shapely.get_parts(whole):
            shapes.append(shapely.Polygon(part.exterior))
            outlines.append(shapely.get_coordinates(part.exterior))
    cells = outlined_cells(outlines, np.array(shapes), 0.25, once=False)
    if cells is None:
        raise InputError("the front of the wall cannot be told into stones; are its meshes sound?")
    straight = _chords(cells)
    return Subdivision(straight.vertex * cell, straight.start, straight.index, straight.site)


def _chords(cells: Subdivision) -> Subdivision:
    """The cells with joints that run straight from corner to corner; corners nearer than the raster tells are one."""
    from scipy.spatial import cKDTree

    outer = np.zeros(len(cells.vertex), bool)
    outer[cells.edge[(cells.side < 0).any(axis=1)]] = True
    node = np.bincount(cells.edge.ravel(), minlength=len(outer)) > 2
    number = np.flatnonzero(node)
    near = number[cKDTree(cells.vertex[number]).query_pairs(MERGED, output_type="ndarray")]
    group = components(len(outer), *near.T)
    name = np.unique(group, return_index=True)[1][group]
    rings, site = [], []
    for k, ring in enumerate(cells.rings()):
        kept = [int(name[v]) for v in ring if node[v] or outer[v]]
        kept = [v for v, before in zip(kept, [kept[-1], *kept[:-1]], strict=True) if v != before] if kept else []
        if len(kept) >= LEAST:
            rings.append(kept)
            site.append(int(cells.site[k]))
    return subdivide(cells.vertex, rings, site)


def _foot(stands: _Standing, cells: Subdivision) -> Floats | None:
    """Line (k, 2) m on which the cells stand; None where nothing is below them or that is level."""
    import shapely

    if not stands.ground:
        return None
    below = shapely.convex_hull([shapely.multipoints(p[:, [0, 2]]) for p in stands.ground])
    outer = cells.edge[(cells.side < 0).any(axis=1)]
    middle = shapely.points(cells.vertex[outer].mean(axis=1))
    on = np.unique(shapely.STRtree(below).query(middle, predicate="dwithin", distance=SNAP * stands.height)[0])
    line = cells.vertex[np.unique(outer[on])]
    level = len(line) == 0 or np.ptp(line[:, 1]) <= SNAP * stands.height
    return None if level else line[np.lexsort((line[:, 1], line[:, 0]))]


# The masons' measures


def _between_faces(stands: _Standing) -> tuple[tuple[_Stone, ...], Faces]:
    """The stones, moved so that the front begins at y = 0, and the planes that touch them at mid-height."""
    import shapely

    every = np.concatenate([s.vertices for s in stands.stones])[:, [2, 1]]
    ring = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(every)))
    a, b = ring[:-1], ring[1:]
    middle = stands.size[2] / 2.0
    across = (a[:, 0] <= middle) != (b[:, 0] <= middle)
    a, way = a[across], (b - a)[across]
    slope = way[:, 1] / way[:, 0]
    front, back = np.argsort(a[:, 1] + slope * (middle - a[:, 0]))
    lean, hang = max(float(slope[front]), 0.0), max(float(-slope[back]), 0.0)
    low, high = float((every[:, 1] - lean * every[:, 0]).min()), float((every[:, 1] + hang * every[:, 0]).max())
    moved = tuple(replace(s, vertices=s.vertices - [0.0, low, 0.0]) for s in stands.stones)
    return moved, Faces(float(stands.size[0]), high - low, lean, hang)
