"""The pattern of a polygonal wall: which stone lies where in the (u, v) rectangle, u along the wall and v up.

Seeds on a jittered grid, odd rows shifted by half a column so that head joints are staggered, own the cells of a power
diagram (`geometry.power_diagram`) whose weights grade the sizes. Lloyd's relaxation moves each seed to the centroid of
what is free of its cell, and changes its weight towards the size that it is to have. Openings, dressed stones and the
foot are laid over the cells (`geometry.arrangement`), coursing levels the corners (`design.walls.coursing`), and cells
whose inradius proxy 2 A / P is below `sliver` sqrt(area / seeds) lose their seed and everything is drawn again; pieces
that are still too thin join a neighbour, and joints far shorter than a stone are taken out
(`design.walls.short_joints`).

The diagram is drawn in units of the grid's spacing, so a wall that is stretched stretches its stones.

Sources: power diagrams, Aurenhammer (1987); relaxation, Lloyd (1982); the reading of interlock in Inca walls, Clifford
and McGee (2018); generated masonry, Legakis, Dorsey & Gortler (2001).

>>> pattern = draw_pattern(PatternSettings(seed=7))
>>> pattern.readout.cells == len(pattern.subdivision) == len(pattern.kind)
True
>>> abs(pattern.readout.coverage - 1.0) < 1e-9
True
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints, sealed
from cyclopean.design.options import at_least, not_negative, positive, within
from cyclopean.design.walls.coursing import coursed
from cyclopean.design.walls.dressing import (
    Coping,
    Foot,
    Quoins,
    coping_stones,
    foot_line,
    quoin_stones,
    shared_coping,
)
from cyclopean.design.walls.openings import Kind, Opening, clear_shape, fitting, head_stones
from cyclopean.design.walls.short_joints import without_short_joints
from cyclopean.errors import InputError
from cyclopean.geometry import Subdivision, arrangement, dissolved, merged, power_diagram, subdivide
from cyclopean.options import option
from cyclopean.representation import one_line

__all__ = [
    "AreaRatio",
    "Kind",
    "Pattern",
    "PatternSettings",
    "Readout",
    "Seeds",
    "beyond_outline",
    "course_of",
    "draw_from",
    "draw_pattern",
    "drawing_seeds",
    "live_seeds",
    "readout_of",
    "seed_grid",
]

LEAST_SEEDS = 3  # fewer make no pattern
PASSES = 12  # of culling; a cull makes its neighbours larger, so few are needed
EVENING = 0.4  # weight for each mean cell that an area lacks
WEIGHED = 2.0  # mean cells that a weight of 1 adds in a grid of squares
LEAST_VOID = 1e-9  # of the rectangle: what is smaller between it and an outline is rounding
RIM = 0.15  # of the spacing: no seed starts nearer to the end of a row than this

AreaRatio = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True)
class PatternSettings:
    """What a pattern is drawn from; lengths in m."""

    width: float = option(3.0, "Along the foot (m).", "number", metavar="L")
    height: float = option(1.8, "Up the face (m).", "number", metavar="L")
    columns: int = option(8, "Stones in a row, before culling.", "whole", metavar="N")
    rows: int = option(5, "Rows of stones.", "whole", metavar="N")
    seed: int = option(7, "Another seed, another wall.", "whole", metavar="N")
    jitter: float = option(0.25, "Irregularity of the seeds, 0 to 0.5.", "number", metavar="S")
    lloyd: int = option(2, "Rounds of evening out.", "whole", metavar="N")
    coursing: float = option(0.4, "0 irregular to 1 level courses.", "number", metavar="C")
    courses: int = option(5, "Number of courses [as many as rows].", "whole", metavar="N")
    size_grade: float = option(0.3, "Spread of the stones' sizes.", "number", metavar="S")
    sliver: float = option(0.18, "Stones thinner than this share are culled.", "number", metavar="S")
    max_bed: float = option(
        35.0, "Degrees: stones lie on a face as flat as this, if they can; 90 = as drawn [35].", "number",
        metavar="DEG",
    )  # fmt: skip
    openings: tuple[Opening, ...] = ()
    quoins: Quoins | None = None
    coping: Coping | None = None
    base: Foot = None  # heights of the ground: a function of u, or points from end to end
    base_radius: float | None = None  # of circular ground: positive = highest in the middle
    outline: tuple[tuple[float, float], ...] | None = None  # m, counter-clockwise; None = the whole rectangle

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            positive(name, getattr(self, name))
        for name, least in (("columns", 1), ("rows", 1), ("courses", 1), ("lloyd", 0), ("seed", 0)):
            at_least(name, getattr(self, name), least)
        within("coursing", self.coursing, 0.0, 1.0)
        within("jitter", self.jitter, 0.0, 0.5)
        within("sliver", self.sliver, 0.0, 1.0)
        within("max_bed", self.max_bed, 0.0, 90.0)
        not_negative("size_grade", self.size_grade)
        object.__setattr__(self, "openings", tuple(self.openings))
        _check_outline(self.outline)
        if self.columns * self.rows < LEAST_SEEDS:
            raise InputError(
                f"columns: {self.columns} x {self.rows} rows makes {self.columns * self.rows} seeds; "
                f"give at least {LEAST_SEEDS}"
            )


@dataclass(frozen=True, slots=True)
class Readout:
    """What a pattern is judged by at a glance."""

    cells: int
    coverage: float  # area of the cells / area of the wall less its openings
    area_cv: float  # standard deviation / mean of the field stones' areas
    culled: int  # seeds removed because their cell was a sliver, or had vanished
    merged: int  # thin pieces that joined a neighbour
    crossings: int  # corners at which four or more stones meet


@dataclass(frozen=True, slots=True, eq=False)
class Seeds:
    """What the cells grow from, in units of the grid: a spacing along u, a spacing along v, and a mean cell."""

    point: Floats  # (s, 2); (0, 0) is the lower left corner of the grid, (columns, rows) the upper right one
    weight: Floats  # (s,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", sealed("point", self.point, None, 2))
        object.__setattr__(self, "weight", sealed("weight", self.weight, len(self.point)))

    def __len__(self) -> int:
        return len(self.weight)


@dataclass(frozen=True, slots=True, eq=False)
class Pattern:
    """A drawn pattern: cells (n), what each is, and the lines it was drawn to."""

    __repr__ = one_line

    subdivision: Subdivision
    kind: tuple[Kind, ...]  # (n,)
    course: Ints  # (n,) course in which the cell's centroid lies, from 0
    lines: Floats  # (courses + 1,) heights of the course lines (m)
    openings: tuple[Floats, ...]  # (k, 2) m each: clear shapes
    foot: Floats | None  # (k, 2) m: line on which the wall stands, None where that is v = 0
    readout: Readout
    settings: PatternSettings
    seeds: Seeds | None = None  # what it was drawn from, those that were culled included; None = not from seeds
    notes: tuple[str, ...] = ()  # what was mended in the drawing that it was read from, and what was passed over

    def with_corners(self, vertex: Floats) -> "Pattern":
        """The same stones with their corners, (V, 2) m, in other places."""
        cells = self.subdivision
        moved = Subdivision(vertex, cells.start, cells.index, cells.site)
        readout = replace(self.readout, area_cv=readout_of(moved, 1.0).area_cv)
        return replace(self, subdivision=moved, course=course_of(moved, self.lines), readout=readout)


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    """Everything in the rectangle that is not field stone."""

    lines: Floats  # (courses + 1,) m
    origin: Floats  # (2,) m, of the grid of seeds
    spacing: Floats  # (2,) m, of the grid
    foot: Floats | None
    openings: tuple[Floats, ...]
    dressed: tuple[Floats, ...]
    kind: tuple[Kind, ...]  # of the dressed stones
    void: tuple[Floats, ...]  # openings and ground
    cover: Any  # of dressed stones and voids, a shapely geometry
    area: float  # of the wall without voids (m2)
    field: float  # of that, without dressed stones (m2)


def draw_pattern(settings: PatternSettings | None = None, area_ratio: AreaRatio | None = None) -> Pattern:
    """Draw the pattern of a polygonal wall; the same settings give the same pattern to the bit.

    Parameters
    ----------
    settings : PatternSettings, optional
        The defaults of `PatternSettings` otherwise.
    area_ratio : callable, optional
        As of `drawing_seeds`.

    Returns
    -------
    Pattern
        Field stones in the order of their seeds, then the dressed stones.

    Raises
    ------
    InputError
        Openings that do not fit, no field left for seeds, or more slivers than stones.
    """
    settings = settings or PatternSettings()
    return draw_from(drawing_seeds(settings, area_ratio), settings)


def drawing_seeds(settings: PatternSettings, area_ratio: AreaRatio | None = None) -> Seeds:
    """Seeds as `draw_pattern` uses them: on the jittered grid, clear of openings and dressed stones, and relaxed.

    Parameters
    ----------
    settings : PatternSettings
        All of it.
    area_ratio : callable, optional
        Of points (n, 2) m: area (n,) of the stone's face there for a square metre of the pattern. Seeds are weighted
        so that stones are as large as they would be where it is 1 throughout.

    Raises
    ------
    InputError
        As `draw_pattern`.
    """
    frame = _frame(settings)
    site, weight = _seeds(settings, frame)
    size = np.exp(weight)
    weight = weight + (_shares(area_ratio, frame, site) - 1.0) / WEIGHED
    for _ in range(settings.lloyd):
        site, weight = _relaxed(settings, frame, site, weight, size * _shares(area_ratio, frame, site))
    return Seeds(site, weight)


def _shares(area_ratio: AreaRatio | None, frame: _Frame, site: Floats) -> Floats:
    """(n,) areas in the pattern that are equal on the surface, 1 in the mean."""
    if area_ratio is None:
        return np.ones(len(site))
    share = 1.0 / area_ratio(frame.origin + site * frame.spacing)
    return np.asarray(share / share.mean())


def seed_grid(settings: PatternSettings) -> tuple[Floats, Floats]:
    """Origin and spacing (m), (2,) each, of the grid in whose units the seeds are given."""
    frame = _frame(settings)
    return frame.origin, frame.spacing


def draw_from(seeds: Seeds, settings: PatternSettings) -> Pattern:
    """Draw the pattern that grows from these seeds; `columns` and `rows` of the settings are the grid's.

    Parameters
    ----------
    seeds : Seeds
        At least one.
    settings : PatternSettings
        All that is not the seeds; `seed`, `jitter`, `lloyd` and `size_grade` have no say.

    Raises
    ------
    InputError
        As `draw_pattern`.
    """
    frame = _frame(settings)
    drawn, live, least = _culled(seeds, settings, frame)
    whole = _without_thin_pieces(drawn, least)
    found = without_short_joints(whole, frame.spacing, least)
    readout = readout_of(found, frame.area, int((~live).sum()), len(drawn) - len(whole))
    field: list[Kind] = ["stone"] * int((found.site >= 0).sum())
    kind, course = (*field, *frame.kind), course_of(found, frame.lines)
    return Pattern(found, kind, course, frame.lines, frame.openings, frame.foot, readout, settings, seeds)


def course_of(cells: Subdivision, lines: Floats) -> Ints:
    """(n,) course in which each cell's centroid lies, between lines (k,) m."""
    return np.searchsorted(lines[1:-1], cells.centroids()[:, 1])


def readout_of(cells: Subdivision, area: float, culled: int = 0, merged: int = 0) -> Readout:
    """What cells are judged by, in a wall whose area without openings is so large (m2)."""
    total, field = float(cells.areas().sum()), cells.areas()[cells.site >= 0]
    uneven = float(field.std() / field.mean())
    return Readout(len(cells), total / area, uneven, culled, merged, len(cells.crossings()))


def live_seeds(seeds: Seeds, settings: PatternSettings) -> Ints:
    """Which of the seeds the stones of `draw_from` grow from: all that are not culled, in whose order `site` counts."""
    return np.flatnonzero(_culled(seeds, settings, _frame(settings))[1])


def _culled(seeds: Seeds, settings: PatternSettings, frame: _Frame) -> tuple[Subdivision, Bools, float]:
    """The drawing without slivers, the seeds that are left, and the least inradius proxy (m) of a stone."""
    site, weight = seeds.point, seeds.weight
    least = settings.sliver * float(np.sqrt(frame.field / len(seeds)))
    live = np.ones(len(seeds), bool)
    for _ in range(PASSES):
        found = _drawn(settings, frame, site[live], weight[live])
        number = np.flatnonzero(live)
        keep = _worth_keeping(found, int(live.sum()), least)
        live[number[~keep]] = False
        if 2 * int(live.sum()) < len(seeds) or int(live.sum()) < min(LEAST_SEEDS, len(seeds)):
            raise InputError(_too_many(settings, len(seeds), int((~live).sum())))
        if keep.all():
            break
    else:
        found = _drawn(settings, frame, site[live], weight[live])
    return found, live, least


def _frame(settings: PatternSettings) -> _Frame:
    """Course lines, voids and dressed stones, checked against each other."""
    import shapely

    width, height = settings.width, settings.height
    top = height - (settings.coping.height if settings.coping else 0.0)
    if not top > 0.0:
        raise InputError(f"coping height: {settings.coping.height if settings.coping else 0:g} m leaves no wall below")
    lines = np.linspace(0.0, top, settings.courses + 1)
    foot = foot_line(settings.base, settings.base_radius, width, max(8, 3 * settings.columns))
    peak = 0.0 if foot is None else float(foot[:, 1].max())
    if not peak < top:
        raise InputError(f"base: the ground rises to {peak:g} m, above the wall's {top:g} m; make the wall higher")
    fitting(settings.openings, width, peak, top)
    clear = tuple(clear_shape(opening) for opening in settings.openings)
    ground = () if foot is None else (np.concatenate([[[0.0, -height], [width, -height]], foot[::-1]]),)
    beyond = beyond_outline(settings, ground)
    _refuse_leaving(settings.openings if beyond else (), beyond, width)
    heads = [stone for opening in settings.openings for stone in head_stones(opening)]
    named = list(heads)
    if settings.coping:
        tie = (settings.quoins.long, settings.quoins.short) if settings.quoins else ()
        avoid = np.array([*tie, *(width - t for t in tie)])
        shared = shared_coping(settings.quoins, lines) if settings.quoins else (0.0, 0.0)
        named += [("coping", stone) for stone in coping_stones(settings.coping, width, height, avoid, shared)]
    low, high = 0.0, width
    if settings.quoins:
        mean = (settings.quoins.long + settings.quoins.short) / 2.0
        low, high = mean * settings.quoins.left, width - mean * settings.quoins.right
        if not settings.quoins.long * (settings.quoins.left + settings.quoins.right) < width:
            raise InputError(f"quoins long: {settings.quoins.long:g} m leaves no field in a wall of {width:g} m")
        taken = [*clear, *ground, *(stone for _, stone in heads)]
        named += [("quoin", stone) for stone in quoin_stones(settings.quoins, lines, width, foot, taken)]
    start = np.array([low, 0.0 if foot is None else float(foot[:, 1].min())])
    spacing = (np.array([high, top]) - start) / np.array([settings.columns, settings.rows])
    dressed, void = tuple(stone for _, stone in named), (*clear, *ground, *beyond)
    polygons = [shapely.polygons(shape) for shape in (*void, *dressed)]
    wall, hole, cover = shapely.box(0.0, 0.0, width, height), *map(shapely.union_all, (polygons[: len(void)], polygons))
    shapely.prepare(cover)
    area = width * height - float(shapely.area(shapely.intersection(hole, wall)))
    left = area - float(sum(shapely.area(polygons[len(void) :])))
    return _Frame(lines, start, spacing, foot, clear, dressed, tuple(k for k, _ in named), void, cover, area, left)


def beyond_outline(settings: PatternSettings, ground: Sequence[Floats] = ()) -> tuple[Floats, ...]:
    """Rings (k, 2) m about what of the rectangle is neither in the wall's outline nor in the ground."""
    import shapely

    if settings.outline is None:
        return ()
    whole = shapely.box(0.0, 0.0, settings.width, settings.height)
    wall = shapely.union_all([shapely.polygons(ring) for ring in (settings.outline, *ground)])
    part = shapely.get_parts(shapely.difference(whole, wall))
    part = part[shapely.area(part) > LEAST_VOID * settings.width * settings.height]
    return tuple(shapely.get_coordinates(one)[:-1] for one in part)


def _refuse_leaving(openings: Sequence[Opening], beyond: Sequence[Floats], width: float) -> None:
    """Refuse openings that, with their heads, leave the outline of the wall but for their sills."""
    import shapely

    for k, one in enumerate(openings, 1):
        parts = [clear_shape(one), *(stone for _, stone in head_stones(one))]
        far = shapely.distance(*(shapely.union_all([shapely.polygons(p) for p in x]) for x in (parts, beyond)))
        if not far > 1e-6 * width:
            raise InputError(f"openings: number {k} with its head leaves the outline of the wall; move it")


def _check_outline(outline: tuple[tuple[float, float], ...] | None) -> None:
    """Refuse an outline that is no simple ring."""
    import shapely

    if outline is None:
        return
    ring = sealed("outline", outline, None, 2)
    if not (len(ring) >= 3 and shapely.is_valid(shapely.polygons(ring)) and shapely.is_ccw(shapely.linearrings(ring))):
        raise InputError("outline: is no ring that runs counter-clockwise and does not cross itself")


def _seeds(settings: PatternSettings, frame: _Frame) -> tuple[Floats, Floats]:
    """Seeds (n, 2) in grid units and weights (n,) in mean cells: drawn row by row, u, v and weight for each."""
    import shapely

    draw = np.random.Generator(np.random.PCG64(settings.seed))
    rows, columns = settings.rows, settings.columns
    shake = draw.uniform(-1.0, 1.0, (rows, columns, 3))
    u = np.arange(columns) + 0.5 + np.where(np.arange(rows) % 2, 0.25, -0.25)[:, None] + settings.jitter * shake[..., 0]
    v = np.arange(rows)[:, None] + 0.5 + settings.jitter * shake[..., 1]
    site = np.stack([np.clip(u, RIM, columns - RIM), np.clip(v, RIM, rows - RIM)], -1).reshape(-1, 2)
    weight = settings.size_grade * shake[..., 2].ravel()
    free = ~shapely.intersects(frame.cover, shapely.points(frame.origin + site * frame.spacing))
    if int(free.sum()) < LEAST_SEEDS:
        raise InputError(
            f"columns: openings and dressed stones leave {int(free.sum())} of {len(site)} seeds; "
            f"give more columns and rows (at least {LEAST_SEEDS} seeds are needed)"
        )
    return site[free], weight[free]


def _diagram(settings: PatternSettings, frame: _Frame, site: Floats, weight: Floats) -> Subdivision:
    """Power diagram over the whole rectangle (m), drawn in grid units."""
    origin, spacing, size = frame.origin, frame.spacing, np.array([settings.width, settings.height])
    low, high = -origin / spacing, (size - origin) / spacing
    cells = power_diagram(site, weight, low, high)
    vertex = np.clip(origin + cells.vertex * spacing, 0.0, size)
    vertex = np.where(cells.vertex == low, 0.0, np.where(cells.vertex == high, size, vertex))
    return Subdivision(vertex, cells.start, cells.index, cells.site)


def _relaxed(
    settings: PatternSettings, frame: _Frame, site: Floats, weight: Floats, target: Floats
) -> tuple[Floats, Floats]:
    """Seeds moved to the centroids of what is free of their cells (the largest piece of it), and weights that bring
    what is free of the new cells nearer to these shares.

    Without the latter relaxation spreads sizes: a large cell draws its seed away from small ones.
    """
    import shapely

    cells = _diagram(settings, frame, site, weight)
    centre = cells.centroids()
    if frame.void or frame.dressed:
        polygon = cells.polygons()
        cut = np.flatnonzero(shapely.intersects(frame.cover, polygon))
        piece, owner = shapely.get_parts(shapely.difference(polygon[cut], frame.cover), return_index=True)
        order = np.lexsort((-shapely.area(piece), owner))
        first = order[np.unique(owner[order], return_index=True)[1]]
        middle = shapely.centroid(piece[first])
        some = ~shapely.is_empty(middle)
        centre[cut[owner[first][some]]] = shapely.get_coordinates(middle[some])
    moved = site.copy()
    moved[cells.site] = (centre - frame.origin) / frame.spacing
    cells = _diagram(settings, frame, moved, weight)
    area = np.zeros(len(site))
    area[cells.site] = shapely.area(shapely.difference(cells.polygons(), frame.cover)) / np.prod(frame.spacing)
    return moved, weight + EVENING * (target * area.sum() / target.sum() - area)


def _drawn(settings: PatternSettings, frame: _Frame, site: Floats, weight: Floats) -> Subdivision:
    """Cells, overlaid and coursed; dressed stones have site -1 and come last, in the order of the frame."""
    cells, given = arrangement(_diagram(settings, frame, site, weight), frame.dressed, frame.void)
    return coursed(cells, frame.lines, settings.coursing, given >= 0)


def _worth_keeping(found: Subdivision, seeds: int, least: float) -> Bools:
    """Seeds that have a cell with a piece that is not a sliver."""
    keep = np.zeros(seeds, bool)
    if least == 0.0:
        return ~keep
    stone = (found.site >= 0) & (found.inradii() >= least)
    keep[found.site[stone]] = True
    return keep


def _too_many(settings: PatternSettings, seeds: int, culled: int) -> str:
    what = f"sliver: {settings.sliver:g} would cull {culled} of {seeds} stones"
    if settings.coursing > 0.5 and settings.courses < settings.rows:
        return f"{what}; {settings.rows} rows do not fit into {settings.courses} level courses: make them equal"
    return f"{what}; lower it (0.18 is usual) or change the seeds"


def _without_thin_pieces(found: Subdivision, least: float) -> Subdivision:
    """Pieces of field stones below the least inradius joined to the stone with which they share most."""
    for _ in range(PASSES):
        inradius = found.inradii()
        stone = found.site >= 0
        thin = np.flatnonzero(stone & (inradius < least))
        both = stone[found.side].all(axis=1) & (found.side >= 0).all(axis=1)
        side, length = found.side[both], found.lengths()[both]
        rings, site, gone, busy = found.rings(), found.site.copy(), set[int](), set[int]()
        for c in thin[np.argsort(inradius[thin], kind="stable")].tolist():
            mine = (side == c).any(axis=1)
            shared = np.bincount(side[mine].sum(axis=1) - c, length[mine], minlength=len(found))
            for other in np.argsort(-shared, kind="stable")[: int((shared > 0.0).sum())].tolist():
                ring = None if busy & {c, other} else merged(found, c, other)
                if ring is not None:
                    rings[other] = ring
                    gone.add(c)
                    # a neighbour's ring is read from `found`: leave all that touch for the next round
                    busy |= {c, other}
                    break
        if not gone:
            break
        left = [k for k in range(len(found)) if k not in gone]
        found = dissolved(subdivide(found.vertex, [rings[k] for k in left], site[left]))
    return found
