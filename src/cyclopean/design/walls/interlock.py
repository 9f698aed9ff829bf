"""How well the stones of a wall interlock: the score J, and the masons' rules as measures.

Head joints are the edges between two stones that rise more than they run. Two of them are aligned, and make a running
joint, when they lie in consecutive courses and their u-midpoints coincide within a tolerance. With the length of the
head joints, that of those which belong to at least one aligned pair, and the corners N+ at which four or more stones
meet,

    J = clamp( 1 - L_aligned / L_head - N+ / (2 N_cells), 0, 1 ).

A joint is counted once however many others it is aligned with. It lies in the courses between the course lines nearest
to its two ends (in that of its midpoint where both ends are nearest to one line), so a tall stone's joint belongs to
two courses, and a stone beside two low ones makes no running joint.

The score follows section 5.4 of the chapter that this program was created from, which puts a number to Clifford and
McGee's reading of Inca walls [Clifford]_; rules for generated courses are those of [Legakis]_. The shortest way along
joints over the straight distance is the "minimum length" by which the masonry quality index judges how vertical joints
are staggered [Borri]_, since then often called the line of minimum trace; there it is taken between two points about a
metre apart, here from the foot to the top of the wall. Nothing here claims to be new.

By hand: four squares in stack bond have two head joints, one above the other, and one crossing; in running bond none is
above another.

>>> from cyclopean.geometry import subdivide
>>> point = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0, 2], [1, 2], [2, 2]]
>>> square = subdivide(point, [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
>>> stack = interlock_of(square, [0, 1, 2], tolerance=0.1)
>>> stack.score, stack.aligned.tolist(), stack.crossings.tolist(), stack.aligned_length, stack.head_length
(0.0, [[3, 8]], [4], 2.0, 2.0)

References
----------
.. [Borri] Borri, Corradi, Castori & De Maria: A method for the analysis and classification of historic masonry.
   Bulletin of Earthquake Engineering 13 (2015), 2647-2665.
.. [Clifford] Clifford & McGee: Cyclopean cannibalism: a method for recycling rubble. ACADIA 2018.
.. [Legakis] Legakis, Dorsey & Gortler: Feature-based cellular texturing for architectural models. SIGGRAPH 2001.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Bools, Floats, Ints, sealed
from cyclopean.design.options import not_negative, positive
from cyclopean.design.walls.pattern import Pattern
from cyclopean.errors import InputError
from cyclopean.geometry import Subdivision
from cyclopean.geometry.packed import components, extents

__all__ = [
    "Interlock",
    "MasonsRules",
    "RunningJoint",
    "aligned_joints",
    "course_lines",
    "head_joints",
    "interlock",
    "interlock_of",
    "joint_gaps",
    "minimum_trace",
    "score",
    "usual_tolerance",
]

TOLERANCE = 0.1  # of the spacing of the seeds along the wall: midpoints nearer to each other than this coincide

SAME = 1e-6  # of the height: a corner nearer to the foot than this lies on it


@dataclass(frozen=True, slots=True)
class RunningJoint:
    """Aligned head joints through several courses."""

    joints: tuple[int, ...]  # edges of the subdivision, from the lowest up
    length: float  # m, of these joints
    courses: int  # that they run through


@dataclass(frozen=True, slots=True)
class MasonsRules:
    """What a mason looks for; nan where a wall has nothing to measure it by."""

    overlap: float  # mean over the head joints: how far the stone on top laps past the joint's upper end / its length
    least_overlap: float  # of all of them; 0.5 is the best that there is, 0 means that no stone lies over the joint
    lapped: float  # share of the head joints over which a stone laps by a quarter of its length or more
    vertical_joint: float  # m, rise of the highest joint that goes up without a stone across it
    vertical_courses: float  # the same in heights of a course
    trace: float  # shortest way along joints from the foot to the top / height of the wall; 1 = straight up
    horizontality: float  # of the beds: mean of |run| / length, by length; 1 = level
    through_stones: int | None  # stones that reach from face to back; None = the depth is not known
    headers: float | None  # share of the stones that reach deeper into the wall than they are long on the face


@dataclass(frozen=True, slots=True, eq=False)
class Interlock:
    """The score J and what it is made of; edges and corners are those of the subdivision."""

    score: float  # J, 0..1
    head: Ints  # (h,) edges that are head joints
    aligned: Ints  # (p, 2) edges: aligned pairs, the lower joint first
    crossings: Ints  # (k,) corners at which four or more stones meet
    running: tuple[RunningJoint, ...]  # the longest first
    head_length: float  # m
    aligned_length: float  # m, each joint once
    tolerance: float  # m
    rules: MasonsRules


def interlock(pattern: Pattern, *, tolerance: float | None = None, depth: float | None = None) -> Interlock:
    """Score the interlock of a pattern.

    Parameters
    ----------
    pattern : Pattern
    tolerance : float, optional
        Distance along the wall (m) within which midpoints coincide; a tenth of the seeds' spacing, width / columns,
        where not given.
    depth : float, optional
        Thickness of the wall (m), for the through-stones.

    Raises
    ------
    InputError
        A negative tolerance, or a depth that is not positive.
    """
    tolerance = usual_tolerance(pattern) if tolerance is None else tolerance
    return interlock_of(pattern.subdivision, course_lines(pattern), tolerance=tolerance, depth=depth, foot=pattern.foot)


def course_lines(pattern: Pattern) -> Floats:
    """Heights of the course lines (m), that of the top of the coping included."""
    top = pattern.settings.height
    return np.append(pattern.lines, top) if pattern.lines[-1] < top else pattern.lines


def interlock_of(
    cells: Subdivision,
    lines: ArrayLike,
    *,
    tolerance: float,
    depth: float | None = None,
    foot: Floats | None = None,
) -> Interlock:
    """Score the interlock of cells between course lines.

    Parameters
    ----------
    cells : Subdivision
        n stones.
    lines : (k,) array_like
        Heights of the course lines (m), rising; at least two.
    tolerance : float
        m along the wall.
    depth : float, optional
        m.
    foot : (k, 2) float, optional
        Line on which the wall stands (m), where that is not level.

    Raises
    ------
    InputError
        A negative tolerance, a depth that is not positive, or lines that do not rise.
    """
    line = sealed("lines", lines, None)
    not_negative("tolerance", tolerance)
    if depth is not None:
        positive("depth", depth)
    if len(line) < 2 or not np.all(np.diff(line) > 0.0):
        raise InputError("lines: the course lines must rise, and be at least two")
    head, pair = aligned_joints(cells, line, tolerance)
    length, crossings = cells.lengths(), cells.crossings()
    total, bad = float(length[head].sum()), float(length[head[np.unique(pair)]].sum())
    running = _running(cells, line, head, pair)
    return Interlock(
        score=score(total, bad, len(crossings), len(cells)),
        head=head,
        aligned=head[pair],
        crossings=crossings,
        running=running,
        head_length=total,
        aligned_length=bad,
        tolerance=float(tolerance),
        rules=_rules(cells, line, head, depth, foot),
    )


def aligned_joints(cells: Subdivision, lines: Floats, tolerance: float) -> tuple[Ints, Ints]:
    """Head joints, (h,) edges, and the aligned pairs of them, (p, 2) places in that list, the lower joint first.

    Parameters
    ----------
    cells : Subdivision
    lines : (k,) float
        Heights of the course lines (m).
    tolerance : float
        m along the wall.
    """
    head = head_joints(cells)
    low, high, gap = joint_gaps(cells, lines, head, tolerance)
    near = gap <= tolerance
    return head, np.stack([low[near], high[near]], 1)


def usual_tolerance(pattern: Pattern) -> float:
    """Distance along the wall (m) within which midpoints coincide."""
    return TOLERANCE * pattern.settings.width / pattern.settings.columns


def score(head_length: float, aligned_length: float, crossings: int, cells: int) -> float:
    """J of so many metres of head joints and of aligned ones, crossings and stones."""
    lost = (aligned_length / head_length if head_length > 0.0 else 0.0) + 0.5 * crossings / max(cells, 1)
    return min(max(1.0 - lost, 0.0), 1.0)


def head_joints(cells: Subdivision) -> Ints:
    """Edges between two stones that rise more than they run, (h,)."""
    return np.flatnonzero((cells.side >= 0).all(axis=1) & _steep(cells))


def _steep(cells: Subdivision) -> Bools:
    run, rise = np.abs(cells.vertex[cells.edge[:, 1]] - cells.vertex[cells.edge[:, 0]]).T
    steep: Bools = rise > run
    return steep


def joint_gaps(cells: Subdivision, lines: Floats, head: Ints, reach: float) -> tuple[Ints, Ints, Floats]:
    """Head joints in consecutive courses and the distance along the wall between their midpoints.

    Parameters
    ----------
    cells : Subdivision
    lines : (k,) float
        m.
    head : (h,) int
        Edges.
    reach : float
        Distance (m) up to which pairs are listed.

    Returns
    -------
    low, high : (p,) int
        Places in `head` of the lower and the upper joint.
    gap : (p,) float
        m.
    """
    from scipy.spatial import cKDTree

    middle = cells.vertex[cells.edge[head]].mean(axis=1)[:, 0]
    first, last = _courses(cells, lines, head)
    # one row of points for each course: a joint's top is matched with the bottoms of those that start above it
    far = 4.0 * (reach + float(np.ptp(cells.vertex[:, 0])))
    if not len(head):
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)
    ends = cKDTree(np.stack([middle, far * (last + 1)], 1))
    starts = cKDTree(np.stack([middle, far * first], 1))
    slack = reach * (1.0 + 1e-12)  # what is exactly within reach is not lost to the tree's rounding
    found = ends.sparse_distance_matrix(starts, slack, output_type="coo_matrix").tocoo()
    # the tree leaves out nothing, but a distance of 0 is an entry like any other
    low, high = found.row.astype(np.int64), found.col.astype(np.int64)
    order = np.lexsort((high, low))
    low, high = low[order], high[order]
    return low, high, np.abs(middle[low] - middle[high])


def _courses(cells: Subdivision, lines: Floats, head: Ints) -> tuple[Ints, Ints]:
    """First and last course of each head joint: between the lines nearest to its ends."""
    v = cells.vertex[cells.edge[head]][..., 1]
    half = (lines[1:] + lines[:-1]) / 2.0
    low, high = np.searchsorted(half, v.min(axis=1)), np.searchsorted(half, v.max(axis=1))
    own = np.searchsorted(lines[1:-1], v.mean(axis=1))
    inside = low == high
    return np.where(inside, own, low), np.where(inside, own, high - 1)


def _running(cells: Subdivision, lines: Floats, head: Ints, pair: Ints) -> tuple[RunningJoint, ...]:
    """Joints connected by aligned pairs."""
    if not len(pair):
        return ()
    label = components(len(head), *pair.T)
    middle, length = cells.vertex[cells.edge[head]].mean(axis=1)[:, 1], cells.lengths()[head]
    first, last = _courses(cells, lines, head)
    found = []
    for name in np.unique(label[pair[:, 0]]):
        of = np.flatnonzero(label == name)
        of = of[np.argsort(middle[of], kind="stable")]
        courses = int(last[of].max() - first[of].min()) + 1
        found.append(RunningJoint(tuple(head[of].tolist()), float(length[of].sum()), courses))
    return tuple(sorted(found, key=lambda joint: -joint.length))


def _rules(cells: Subdivision, lines: Floats, head: Ints, depth: float | None, foot: Floats | None) -> MasonsRules:
    lap = _laps(cells, head)
    rise = _highest_joint(cells, head)
    inner = (cells.side >= 0).all(axis=1)
    bed = np.flatnonzero(inner & ~_steep(cells))
    run = np.abs(cells.vertex[cells.edge[bed, 1], 0] - cells.vertex[cells.edge[bed, 0], 0])
    along = cells.lengths()[bed]
    low, high = extents(cells.vertex[cells.index, 0], cells.start)
    return MasonsRules(
        overlap=float(lap.mean()) if len(lap) else np.nan,
        least_overlap=float(lap.min()) if len(lap) else np.nan,
        lapped=float((lap >= 0.25 * (1.0 - 1e-9)).mean()) if len(lap) else np.nan,
        vertical_joint=rise,
        vertical_courses=rise / float(np.diff(lines).mean()),
        trace=minimum_trace(cells, foot)[0],
        horizontality=float(run.sum() / along.sum()) if len(bed) else np.nan,
        through_stones=None if depth is None else len(cells),  # a drawn wall is one stone thick
        headers=None if depth is None else float((depth > high - low).mean()),
    )


def _laps(cells: Subdivision, head: Ints) -> Floats:
    """How far a third stone at the upper end of each head joint reaches to both sides of it / its length."""
    ends = cells.edge[head]
    top = np.where(cells.vertex[ends[:, 0], 1] > cells.vertex[ends[:, 1], 1], ends[:, 0], ends[:, 1])
    order = np.argsort(cells.index, kind="stable")
    corner, stone = cells.index[order], cells.cell()[order]
    begin, end = np.searchsorted(corner, top), np.searchsorted(corner, top, side="right")
    low, high = extents(cells.vertex[cells.index, 0], cells.start)  # left and right end (m) of each stone
    laps = []
    for k, (a, b) in enumerate(zip(begin.tolist(), end.tolist(), strict=True)):
        over = np.setdiff1d(stone[a:b], cells.side[head[k]])
        if len(over):
            u = cells.vertex[top[k], 0]
            laps.append(float((np.minimum(u - low[over], high[over] - u) / (high[over] - low[over])).max()))
    return np.array(laps)


def _highest_joint(cells: Subdivision, head: Ints) -> float:
    """Largest rise (m) of head joints that follow upon each other at common corners."""
    ends = cells.edge[head]
    v = cells.vertex[:, 1]
    up = np.where((v[ends[:, 0]] < v[ends[:, 1]])[:, None], ends, ends[:, ::-1])
    foot = v.copy()  # height at which the lowest joint begins from which one can climb to here
    for a, b in up[np.argsort(v[up[:, 0]], kind="stable")].tolist():
        foot[b] = min(foot[b], foot[a])
    return float((v - foot).max(initial=0.0))


def minimum_trace(cells: Subdivision, foot: Floats | None = None) -> tuple[float, Ints]:
    """The line of minimum trace: the shortest way along joints from the foot to the top, for what it climbs.

    Parameters
    ----------
    cells : Subdivision
    foot : (k, 2) float, optional
        Line on which the wall stands (m), where that is not level.

    Returns
    -------
    ratio : float
        Its length over how high it climbs; nan where no joints lead from the foot to the top.
    corners : (c,) int
        Of the cells, from the top down.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    u, v = cells.vertex.T
    inner = (cells.side >= 0).all(axis=1)
    edge, length = cells.edge[inner], cells.lengths()[inner]
    outer = np.unique(cells.edge[~inner])
    ground = np.full(len(outer), v.min()) if foot is None else np.interp(u[outer], foot[:, 0], foot[:, 1])
    low, top = outer[np.abs(v[outer] - ground) <= SAME * np.ptp(v)], outer[v[outer] == v.max()]
    graph = coo_array((length, (edge[:, 0], edge[:, 1])), shape=(len(v), len(v))).tocsr()
    far, before, source = dijkstra(graph, directed=False, indices=low, min_only=True, return_predecessors=True)
    top = top[np.isfinite(far[top])]
    if not len(top):
        return np.nan, top
    ratio = far[top] / (v[top] - v[source[top]])
    way = [int(top[ratio.argmin()])]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    return float(ratio.min()), np.array(way)
