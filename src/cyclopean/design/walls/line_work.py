"""A wall from a drawing of its joints: lines in a plane, whose faces are the stones.

The lines are noded (`geometry.line_net`), gaps up to `snap` closed, and the faces of the net become the cells of a
pattern as seeds would give them, so that all that follows (surface, exact joints, interlock, verdict, matching,
sequence) is the same. Cells may have any simple outline, hollow corners included.

- Where every line is closed, they are the outlines of stones, and what lies in none of them is open; where lines are
  open too, every face is a stone.
- Closed lines on a layer called `opening` (door, window, void) bound openings. They need no such layer where they run
  into the outer edge of the wall, or where stones are drawn as closed outlines.
- Lines on a layer called `ground` (base, foot) are what the wall stands on; they may end anywhere. Without them it
  stands on its level edges at the lowest height, those within `snap` of it put there.

Coordinates of the drawing run to the right and up the face; the pattern begins at the lower left of what was drawn.
The score of the interlock needs courses. Where nobody says how many, they are those of a wall of as many stones of the
mean width w and height h: in a wall of height H whose n stones have the area A, H sqrt(n w / (h A)) of them.

By hand: of a square and a line across it two stones become; the wall stands on one metre.

>>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0.0]])
>>> drawn = pattern_of(LineWork("two.dxf", "m", 1.0, (Line(square), Line(np.array([[0.0, 0.5], [1.0, 0.5]])))))
>>> drawn.subdivision.areas().tolist(), drawn.notes
([0.5, 0.5], ())
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Bools, Floats, sealed
from cyclopean.design.options import at_least, positive
from cyclopean.design.walls.joints import base_edges
from cyclopean.design.walls.pattern import Kind, Pattern, PatternSettings, course_of, readout_of
from cyclopean.errors import InputError
from cyclopean.geometry import Subdivision, dissolved, subdivide
from cyclopean.geometry.line_net import Faces, LineNet, faces, noded
from cyclopean.geometry.packed import extents
from cyclopean.options import check_options, option

__all__ = [
    "GROUND",
    "OPENING",
    "Line",
    "LineReading",
    "LineWork",
    "pattern_of",
    "pattern_of_cells",
    "usual_grid",
    "usual_snap",
]

OPENING = ("opening", "openings", "door", "doors", "window", "windows", "void", "voids")
GROUND = ("ground", "base", "foot")
SNAP = 0.01  # of a mean stone, 3 mm of stones of 300 mm: wider gaps were hardly meant to be closed
NAMED = 4  # places in one message; the rest are counted
THIN = 2.0  # times the snap: stones thinner than this come from one joint that was drawn twice
LEAST = 3  # stones for which settings of a pattern can be given; walls of fewer count as three


@dataclass(frozen=True, slots=True)
class LineReading:
    """How a drawing of joints is read."""

    drawing: str | None = option(
        None, "DXF or SVG of the joints, whose faces are the stones; instead of a pattern from seeds.", metavar="F"
    )
    units: str | None = option(
        None,
        "Unit of the lengths in `drawing` or in the file of `surface`, such as mm, where that does not say it.",
        metavar="U",
    )
    scale: float = option(1.0, "Of `drawing`: N where it is drawn at 1 : N.", "number", metavar="N", above=0.0)
    snap: float | None = option(
        None, "Gaps in `drawing` up to this are closed (m) [a hundredth of a stone].", "number", metavar="L",
        above=0.0, unit="m",
    )  # fmt: skip
    deviation: float | None = option(
        None, "How far facets may lie off the curves of `drawing` (m) [a quarter of `snap`].", "number", metavar="L",
        above=0.0, unit="m",
    )  # fmt: skip
    layer: tuple[str, ...] = option((), "Only lines on this layer of `drawing`; repeatable.", "texts", metavar="NAME")

    def __post_init__(self) -> None:
        check_options(self)


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A line of straight pieces; closed where its last point is its first."""

    point: Floats  # (k, 2) in the unit of the drawing, to the right and up
    layer: str = ""
    curved: Bools | None = None  # (k,) points that stand for a curve; None = no curve

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", sealed("point", self.point, None, 2))

    @property
    def closed(self) -> bool:
        """Whether it bounds something."""
        return len(self.point) > 3 and bool(np.all(self.point[0] == self.point[-1]))

    def on(self, layers: tuple[str, ...]) -> bool:
        """Whether it lies on a layer of one of these names, in capitals or not."""
        return self.layer.lower() in layers


@dataclass(frozen=True, slots=True, eq=False)
class LineWork:
    """The lines of a drawing."""

    name: str  # of the file
    unit: str  # as messages write it
    per_metre: float  # units in a metre
    lines: tuple[Line, ...]
    notes: tuple[str, ...] = ()  # what was passed over, what became of curves
    downwards: bool = False  # whether places of the drawing are told with the second coordinate down the sheet

    def at(self, place: Iterable[Floats]) -> str:
        """Places (2,) of the drawing in words, a few of them."""
        every = [f"({x:.6g}, {(-y if self.downwards else y) + 0.0:.6g})" for x, y in place]
        more = f" and {len(every) - NAMED} more" if len(every) > NAMED else ""
        return f"{', '.join(every[:NAMED])} {self.unit}{more}"

    def wrong(self, what: str) -> InputError:
        """The drawing is at fault."""
        return InputError(f"{self.name}: {what}")


def usual_snap(work: LineWork) -> float:
    """Gap (m) up to which lines of a drawing are taken to meet where nobody says so.

    Stones are taken to be as large as the squares of a net of as much line on as much area: 2 area / length.
    """
    point = [line.point for line in work.lines]
    size = np.ptp(np.concatenate(point), axis=0)
    size = np.maximum(size, SNAP * size.max())  # of a line alone
    length = sum(float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum()) for p in point)
    return SNAP * 2.0 * float(size.prod()) / length / work.per_metre


def pattern_of(
    work: LineWork, snap: float | None = None, courses: int | None = None, max_bed: float | None = None
) -> Pattern:
    """The pattern of a wall from a drawing of its joints.

    Parameters
    ----------
    work : LineWork
        At least one line.
    snap : float, optional
        Gaps up to this are closed (m); a hundredth of a mean stone where not given.
    courses : int, optional
        By which the interlock is judged; as many as stones of that size make where not given.
    max_bed : float, optional
        As of `PatternSettings`; stones lie as they are drawn where not given.

    Raises
    ------
    InputError
        Lines that cross or dangle, stones in stones, no closed face, a wall that stands on nothing; with their places
        in the unit of the drawing.
    """
    snap = usual_snap(work) if snap is None else positive("snap", snap)
    reach = snap * work.per_metre
    curved = [np.zeros(len(one.point), bool) if one.curved is None else one.curved for one in work.lines]
    net = noded([line.point for line in work.lines], reach, curved)
    if len(net.crossing):
        raise work.wrong(
            f"lines cross at {work.at(net.crossing)}: end them on each other; where four stones meet, break both there"
        )
    found = faces(net)
    ground = net.of(np.array([line.on(GROUND) for line in work.lines]))
    _refuse_loose(work, net, found, ground)
    rings = _stones(work, net, found, reach)
    point, base = _grounded(work, net, rings, ground, reach)
    origin = point[np.unique(np.concatenate(rings))].min(axis=0)
    cells = subdivide((point - origin) / work.per_metre, rings)
    foot = None if base is None else _foot(work, (base - origin) / work.per_metre, cells)
    pattern = pattern_of_cells(dissolved(cells), foot, courses, max_bed)
    if not len(base_edges(pattern)):
        raise work.wrong("no stone stands on the line of the ground; let the lowest joints lie on it, or end on it")
    return replace(pattern, notes=(*work.notes, *_closed(work, net)))


def _closed(work: LineWork, net: LineNet) -> tuple[str, ...]:
    """What was said of gaps."""
    if not len(net.gap):
        return ()
    *place, far = net.gap[net.gap[:, 2].argmax()]
    some = "1 gap" if len(net.gap) == 1 else f"{len(net.gap)} gaps"
    return (f"{work.name}: {some} closed, the widest of {far:.2g} {work.unit} at {work.at([np.array(place)])}",)


def _refuse_loose(work: LineWork, net: LineNet, found: Faces, ground: Bools) -> None:
    """Refuse lines that bound nothing, but for the ground, and drawings without faces."""
    idle = found.idle[~ground[found.idle]]
    if len(idle):
        degree = np.bincount(net.edge.ravel(), minlength=len(net.point))
        tips = np.unique(net.edge[idle][degree[net.edge[idle]] == 1])
        none = "" if len(found.rings) else "has no closed face: "
        if not len(tips):
            raise work.wrong(
                f"lines at {work.at(net.point[net.edge[idle]].mean(axis=1))} have the same stone on both sides: "
                "leave them out, or close what they lead to"
            )
        raise work.wrong(
            f"{none}lines end freely at {work.at(net.point[tips])}: "
            "let them end on another, close wider gaps with `snap`, or leave out their layer (`layer`)"
        )
    if not len(found.rings):
        raise work.wrong("holds only the ground; draw the joints on other layers")


def _stones(work: LineWork, net: LineNet, found: Faces, reach: float) -> list[tuple[int, ...]]:
    """Rings of the faces that are stones."""
    import shapely

    outlines = [line for line in work.lines if line.closed and not line.on(GROUND)]
    if bad := [line.point[0] for line in work.lines if line.on(OPENING) and not line.closed]:
        raise work.wrong(f"the outline of an opening is open at {work.at(bad)}; close it, or name its layer otherwise")
    face = shapely.polygons([shapely.linearrings(net.point[list(ring)]) for ring in found.rings])
    for k, ring in zip(found.holed, found.islands, strict=True):
        face[k] = shapely.difference(face[k], shapely.polygons(net.point[list(ring)]))
    inside = shapely.point_on_surface(face)
    places = shapely.STRtree(inside)

    def within(lines: list[Line]) -> Bools:
        hit: Bools = np.zeros(len(face), bool)
        for line in lines:
            hit[places.query(shapely.make_valid(shapely.polygons(line.point)), predicate="intersects")] = True
        return hit

    keep = ~within([line for line in outlines if line.on(OPENING)])
    if all(line.closed or line.on(GROUND) for line in work.lines):
        keep &= within([line for line in outlines if not line.on(OPENING)])
    holed = [ring for k, ring in zip(found.holed, found.islands, strict=True) if keep[k]]
    if holed:
        place = [net.point[list(ring)].mean(axis=0) for ring in holed]
        raise work.wrong(f"what is drawn at {work.at(place)} lies free within a stone: lead a joint to it")
    thin = keep & (2.0 * shapely.area(face) < THIN * reach * shapely.length(face))
    if thin.any():
        raise work.wrong(
            f"what lies at {work.at(shapely.get_coordinates(inside[thin]))} is no thicker than the gaps that are "
            "closed: draw a joint once, or change `snap`"
        )
    if not keep.any():
        raise work.wrong("has openings and no stones; draw the joints on other layers")
    return [found.rings[k] for k in np.flatnonzero(keep)]


def _grounded(
    work: LineWork, net: LineNet, rings: list[tuple[int, ...]], ground: Bools, reach: float
) -> tuple[Floats, Floats | None]:
    """Points of the net with a level foot, or as they are with the line of the ground that is drawn, (k, 2)."""
    if ground.any():
        base = net.point[np.unique(net.edge[ground])]
        base = base[np.lexsort((base[:, 1], base[:, 0]))]
        if (upright := np.flatnonzero(np.diff(base[:, 0]) == 0.0)).size:
            raise work.wrong(
                f"the ground rises straight up at {work.at(base[upright])}; let it lean, or leave that out"
            )
        return net.point, base
    cells = subdivide(net.point, rings)
    used = np.unique(np.concatenate(rings))
    edge, point = used[cells.edge[(cells.side < 0).any(axis=1)]], net.point.copy()
    low = point[used, 1].min()
    level = edge[(point[edge, 1] <= low + reach).all(axis=1)]
    point[level, 1] = low
    if not len(level):
        here = point[used[[point[used, 1].argmin()]]]
        raise work.wrong(f"stands on the point {work.at(here)}; draw the ground as a line on a layer named ground")
    return point, None


def _foot(work: LineWork, base: Floats, cells: Subdivision) -> Floats | None:
    """The ground from end to end of the wall (m), (k, 2); None where it is level."""
    width = float(cells.vertex[:, 0].max())
    inner = base[(base[:, 0] > 0.0) & (base[:, 0] < width)]
    ends = np.interp([0.0, width], base[:, 0], base[:, 1])
    foot = np.concatenate([[[0.0, ends[0]]], inner, [[width, ends[1]]]])
    over = cells.vertex[:, 1] - np.interp(cells.vertex[:, 0], foot[:, 0], foot[:, 1])
    if (bad := np.flatnonzero(over < -1e-6 * float(np.hypot(*np.ptp(cells.vertex, axis=0))))).size:
        deep = -float(over[bad].min())
        raise work.wrong(f"{len(bad)} corners lie below the ground, by up to {deep:.2g} m; draw the ground below them")
    return foot if foot[:, 1].any() else None


def pattern_of_cells(
    cells: Subdivision, foot: Floats | None, courses: int | None = None, max_bed: float | None = None
) -> Pattern:
    """The pattern of cells that are given.

    Parameters
    ----------
    cells : Subdivision
        m; the lowest corner and the one furthest to the left are at 0.
    foot : (k, 2) float or None
        m; the line on which the wall stands, None where that is level.
    courses, max_bed : optional
        As `pattern_of`.
    """
    import shapely

    width, height = np.ptp(cells.vertex, axis=0).tolist()
    columns, rows = usual_grid(cells, courses)
    settings = PatternSettings(width, height, columns, rows, courses=rows, max_bed=90.0)
    settings = settings if max_bed is None else replace(settings, max_bed=max_bed)
    whole = shapely.coverage_union_all(cells.polygons())
    holes = [ring for part in shapely.get_parts(whole) for ring in part.interiors]
    lines = np.linspace(0.0, height, rows + 1)
    course, rings = course_of(cells, lines), cells.rings()  # each course from left to right, however it was drawn
    order = np.lexsort((cells.centroids()[:, 0], course))
    cells, course = subdivide(cells.vertex, [rings[k] for k in order]), course[order]
    readout = readout_of(cells, float(shapely.area(whole)))
    clear = tuple(np.asarray(shapely.get_coordinates(ring)[:-1]) for ring in holes)
    kind: list[Kind] = ["stone"] * len(cells)
    return Pattern(cells, tuple(kind), course, lines, clear, foot, readout, settings)


def usual_grid(cells: Subdivision, courses: int | None = None) -> tuple[int, int]:
    """Columns and courses of a wall of as many stones of the same size; `courses` where they are given."""
    low, high = extents(cells.vertex[cells.index], cells.start)
    (wide, tall), (width, height) = (high - low).mean(axis=0), np.ptp(cells.vertex, axis=0)
    area = float(cells.areas().sum())
    usual = max(1, round(float(height * np.sqrt(len(cells) * wide / (tall * area)))))
    rows = usual if courses is None else at_least("courses", courses, 1)
    return max(1, round(len(cells) * float(width * height) / (area * rows)), -(-LEAST // rows)), rows
