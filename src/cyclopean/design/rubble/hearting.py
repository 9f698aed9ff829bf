"""What steadies a rubble wall: small stones in its hollows (hearting), and wedges under stones that rock (chinking).

Hearting. Stones of less than `SMALL` of the median volume are kept back from the courses. Once a course is laid, they
are dropped, the largest first, into the hollows that lie below its top, as long as they sit there.

Chinking. A stone whose centre of mass is not inside the hull of its contacts needs one more contact. Of all cells of
the height map below it where the gap can be wedged, that one is taken at which the hull reaches farthest round the
centre of mass. The wedge is a prism on a square whose top is the highest plane under the stone there, and whose
bottom is the lowest plane above what is below: two linear programmes in three unknowns. Both touch at their tightest
constraints, and the margin is then taken anew from all contacts.

By hand, for a plane a + b x + c y under the points (-1, 0, 0), (1, 0, 2), (0, 1, 3), (0, -1, 3), highest at (0, 0):
it is 1 + x, and touches the first two.

>>> import numpy as np
>>> above = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 2.0], [0.0, 1.0, 3.0], [0.0, -1.0, 3.0]])
>>> highest_plane(above)[:2].round(9).tolist()
[1.0, 1.0]
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.design.rubble.features import Body, body_of
from cyclopean.design.rubble.height_map import lying_raster
from cyclopean.design.rubble.places import DIRECTIONS
from cyclopean.design.rubble.seating import heyman_margin
from cyclopean.design.stones.stone import Stone
from cyclopean.geometry.solids import CUBE, intersection, mesh_of, solid_of, solid_volume

__all__ = ["SMALL", "Wedge", "highest_plane", "small_stones", "wedge_under"]

SMALL = 0.5  # of the median volume
WIDTH = 2.0  # cells: side of a wedge
THICKEST, THINNEST = 6.0, 0.05  # cells: heights of a wedge at its middle
STEEPEST = 0.7  # slope of the faces of a wedge, that of a friction angle of 35 degrees
TAPER = 0.5  # between its two faces: more of it would be squeezed out
TRIED = 12  # places of a wedge under one stone
SHARED = 1e-6  # of a wedge's volume: more in common with anything is no wedge
ACTIVE = 1e-9  # of a wedge's width: a point nearer than that to its plane touches it
TRIANGLES = np.array([t for a, b, c, d in CUBE for t in ((a, b, c), (a, c, d))])


@dataclass(frozen=True, slots=True, eq=False)
class Wedge:
    """A prism between a stone and what is below it."""

    vertices: Floats  # (8, 3) m, world
    contacts: Floats  # (n, 3) m: where its top touches the stone
    margin: float  # m: of the stone, with it

    @property
    def body(self) -> Body:
        """As a body."""
        return body_of(self.vertices, TRIANGLES, "wedge")


def small_stones(stones: Sequence[Stone]) -> Bools:
    """Which stones are kept for hearting."""
    volume = np.array([stone.volume for stone in stones])
    small: Bools = volume < SMALL * np.median(volume)
    return small


def wedge_under(body: Body, below: Sequence[Body], contacts: Floats, cell: float, wanted: float) -> Wedge | None:
    """Find the wedge that steadies a stone best.

    Parameters
    ----------
    body : Body
        The stone, where it lies.
    below : sequence of Body
        Everything near it; the ground at height 0 is known.
    contacts : (n, 3) array
        What bears it so far (m).
    cell : float
        Width of a cell of the height map (m); a wedge is two cells wide.
    wanted : float
        Margin (m) with which one is content; the first wedge that gives it is taken.

    Returns
    -------
    Wedge or None
        None where no wedge gives a positive margin.
    """
    best: Wedge | None = None
    for place in _places(body, below, contacts, cell):
        made = _prism(body, below, place, WIDTH * cell)
        if made is None:
            continue
        vertices, touching = made
        margin = heyman_margin(np.concatenate([contacts, touching]), body.centroid)
        if margin > 0.0 and (best is None or margin > best.margin):
            best = Wedge(vertices, touching, margin)
        if best is not None and best.margin >= wanted:
            break
    return best


def _places(body: Body, below: Sequence[Body], contacts: Floats, cell: float) -> list[Floats]:
    """Middles (3,) of gaps that could be wedged, those that the centre of mass gains most by first."""
    own = lying_raster(body.vertices, body.triangles, cell)
    top = np.zeros(own.low.shape)
    for other in below:
        raster = lying_raster(other.vertices, other.triangles, cell)
        off = np.rint((raster.corner - own.corner) / cell).astype(int).tolist()
        spans: list[tuple[int, int, int]] = list(zip(off, raster.high.shape, top.shape, strict=True))
        here = tuple(slice(max(o, 0), max(o + n, 0)) for o, n, _ in spans)
        there = tuple(slice(max(-o, 0), max(m - o, 0)) for o, _, m in spans)
        part = raster.high[there]
        if part.size:
            top[here] = np.maximum(top[here], np.where(part < own.low[here], part, -np.inf))
    gap = own.low - top
    i, j = np.nonzero((gap <= THICKEST * cell) & (gap > THINNEST * cell))
    plan = np.column_stack([i, j]) * cell + own.corner + cell / 2.0
    angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    way = np.stack([np.cos(angle), np.sin(angle)])
    reach = (contacts[:, :2] - body.centroid[:2]) @ way if len(contacts) else np.full((1, DIRECTIONS), -np.inf)
    gain = np.maximum((plan - body.centroid[:2]) @ way, reach.max(axis=0)).min(axis=1)
    order: Ints = np.argsort(-gain, kind="stable")
    middle = np.column_stack([plan, (own.low + top)[i, j] / 2.0])
    return [middle[k] for k in order[gain[order] > 0.0][:TRIED]]


def _prism(body: Body, below: Sequence[Body], place: Floats, width: float) -> tuple[Floats, Floats] | None:
    """Corners (8, 3) of a wedge round a place, and where its top touches; None where none fits."""
    over = _within(body, place, width, upper=True)
    under = [p for p in (_within(other, place, width, upper=False) for other in below) if len(p)]
    floor = np.concatenate([*under, _square(place, width) * [1.0, 1.0, 0.0]])
    if not len(over):
        return None
    about = np.array([place[0], place[1], 0.0])
    roof, base = highest_plane(over - about), -highest_plane((floor - about) * [1.0, 1.0, -1.0])
    corner = (_square(place, width) - about)[:, :2]
    flat = np.column_stack([np.ones(4), corner])
    high, low = flat @ roof, flat @ base
    slopes = [np.linalg.norm(roof[1:]), np.linalg.norm(base[1:])]
    thick = THINNEST * width / WIDTH
    if not (max(slopes) <= STEEPEST and np.linalg.norm(roof[1:] - base[1:]) <= TAPER and (high - low).min() >= thick):
        return None
    plan = corner + about[:2]
    vertices = np.stack([np.column_stack([plan, low]), np.column_stack([plan, high])], axis=1).reshape(8, 3)
    solid = solid_of(vertices, CUBE, "wedge")
    limit = SHARED * solid_volume(solid)
    if any(not solid_volume(intersection(solid, other.solid)) <= limit for other in (body, *below)):
        return None
    height = (over - about)[:, 2] - np.column_stack([np.ones(len(over)), (over - about)[:, :2]]) @ roof
    return vertices, over[height <= ACTIVE * width]


def _square(place: Floats, width: float) -> Floats:
    """Corners (4, 3) of a level square about a place, counted in binary, x first."""
    return place + width / 2.0 * np.array([[x, y, 0.0] for x in (-1, 1) for y in (-1, 1)])


def _within(body: Body, place: Floats, width: float, *, upper: bool) -> Floats:
    """Corners (n, 3) of the part of a body in the column on a square, above or below a place; maybe none."""
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    bottom, top = (place[2], high[2] + width) if upper else (low[2] - width, place[2])
    if not bottom < top:
        return np.zeros((0, 3))
    square = _square(place, width)
    corner = np.stack([square * [1, 1, 0] + [0, 0, bottom], square * [1, 1, 0] + [0, 0, top]], axis=1).reshape(8, 3)
    return mesh_of(intersection(body.solid, solid_of(corner, CUBE, "column")))[0]


def highest_plane(above: Floats) -> Floats:
    """Coefficients (a, b, c) of the plane a + b x + c y below all points (n, 3) that is highest at the origin."""
    from scipy.optimize import linprog

    rows = np.column_stack([np.ones(len(above)), above[:, :2]])
    steep = (-10.0 * STEEPEST, 10.0 * STEEPEST)  # few points alone would let it tip over
    found = linprog([-1.0, 0.0, 0.0], A_ub=rows, b_ub=above[:, 2], bounds=[(None, None), steep, steep], method="highs")
    return np.asarray(found.x if found.status == 0 else [-np.inf, 0.0, 0.0], float)
