"""Climb what all stones share with their cells at once: poses, and the sites and weights of the power diagram.

The wall lies flat here, in (u, v, t): along it, up it, and outwards from its face (m). The cell of site i is bounded
against site j by the line of equal power. With G = (p - origin) / spacing, in which the diagram is drawn,

    s = (pow_i - pow_j) / 2L,   pow_i = |G - g_i|^2 - w_i,   L = |(g_j - g_i) / spacing|,

is the distance (m) of a point p from that line, negative on i's side, and with its unit normal n (towards j)

    ds/dg_i = -(G - g_i) / L + s n / (L spacing),    ds/dg_j = (G - g_j) / L - s n / (L spacing),    ds/dw_i = -1 / 2L.

The ends and the faces of the wall are planes that stay; what takes stone from a cell (openings, dressed stones, ground)
is convex, and a point lies outside of it where it is beyond one of its sides. So the depth of a point in its cell is

    s = max(max over lines and planes of s_k,  max over obstacles of min over sides of -s_e)

and the volume that stone i (n points, each of V_i / n) shares with its cell is smoothed over a width e to

    V_i / n  sum over points of  phi(s / e),    phi(x) = 1/2 - 3/4 x + 1/4 x^3 within -1..1, 1 before, 0 beyond.

The sum of that over all stones is climbed by Adam (Kingma and Ba 2015), whose second moments are those of blocks of
variables: shifts, turns, sites, weights. Steps and widths shrink. A diagram of moving cells forgets no volume: what one
stone's cell gains, another's loses.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.design.matching.problem import Bonds, Singles
from cyclopean.design.matching.refine import bonded, turned_by, wrench
from cyclopean.geometry import power_diagram

__all__ = [
    "Bodies",
    "Climb",
    "FlatWall",
    "Gradient",
    "Obstacles",
    "Variables",
    "climbed",
    "diagram_neighbours",
    "gradient",
]

BATCH = 1 << 18  # points times planes at a time
FAR = 1e3  # m: offset of a plane that everything is before
BESIDE = 8  # sites by which a hidden one is bounded
MOMENTS = (0.85, 0.95)  # of what was, in the means of the gradient and its square
FLOOR = 1e-3  # of the mean size of a block: so small a gradient moves nothing
EDGE = 0.02  # spacings: no site comes nearer to the end of the grid


@dataclass(frozen=True, slots=True, eq=False)
class Obstacles:
    """Convex parts of the wall's plane in which no cell is; their sides filled up with normal 0 and offset FAR."""

    corners: tuple[Floats, ...]  # (k, 2) m, counter-clockwise
    normal: Floats  # (o, e, 3) outward, in (u, v, t)
    offset: Floats  # (o, e) m

    def __len__(self) -> int:
        return len(self.corners)


@dataclass(frozen=True, slots=True, eq=False)
class FlatWall:
    """What bounds the cells beside their neighbours."""

    origin: Floats  # (2,) m, of the grid
    spacing: Floats  # (2,) m
    size: Floats  # (2,) m: width and height
    grid: Floats  # (2,) columns and rows: no site leaves these
    depth: float  # m
    batter: float  # m a metre
    obstacles: Obstacles


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """Stones in cells: b of them."""

    points: Singles  # (b, n, 3) m, body frame
    volume: Floats  # (b,) m3
    site: Ints  # (b,) in whose cell each lies
    held: Bools  # (b,) bodies that do not move: a cell that has no stone is filled with what it was
    bonds: Bonds | None = None  # of each, its way in (u, v, t)
    radius: Floats = field(init=False)  # (b,) m: of the farthest point from the centroid
    reach: Floats = field(init=False)  # (b,) m: of gyration

    def __post_init__(self) -> None:
        square = np.einsum("bni,bni->bn", self.points, self.points).astype(float)
        object.__setattr__(self, "radius", np.sqrt(square.max(axis=1)))
        object.__setattr__(self, "reach", np.sqrt(square.mean(axis=1)))


@dataclass(frozen=True, slots=True, eq=False)
class Variables:
    """What moves."""

    point: Floats  # (s, 2) sites, in spacings
    weight: Floats  # (s,) in mean cells
    rotation: Floats  # (b, 3, 3) body to (u, v, t)
    shift: Floats  # (b, 3) m: centroids in (u, v, t)


@dataclass(frozen=True, slots=True)
class Climb:
    """How to climb. Widths are shares of a stone's radius of gyration; steps, of it, of a radian, and of a spacing."""

    steps: int = 240
    width: tuple[float, float] = (0.2, 0.01)
    step: tuple[float, float] = (0.06, 0.001)
    redrawn: int = 5  # steps between two diagrams
    tether: float = 0.0  # mean volumes of a stone that it costs to move a site by one spacing, squared and halved


@dataclass(frozen=True, slots=True, eq=False)
class Gradient:
    """Shared volume (m3), by counting and smoothed, and the gradient of the latter."""

    counted: float
    smooth: float
    shift: Floats  # (b, 3) m2
    turn: Floats  # (b, 3) m3 a radian
    point: Floats  # (s, 2) m3 a spacing
    weight: Floats  # (s,) m3


def climbed(
    wall: FlatWall,
    bodies: Bodies,
    state: Variables,
    climb: Climb,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[Variables, float]:
    """Climb, and return the best state met at which the diagram was fresh, with the volume it shares by counting (m3).

    The volume is less what the tether costs; the state given is among those compared.
    """
    start, reach = state, bodies.reach
    mean = np.zeros((max(len(bodies.site), 1), 6)), np.zeros((len(state.weight), 3))
    square = np.zeros_like(mean[0]), np.zeros_like(mean[1])
    best, top = state, -np.inf
    beside = np.zeros((0, 0), np.int64)
    for k in range(climb.steps + 1):
        done = min(1.0, k / max(1, climb.steps - 1))
        width = climb.width[0] * (climb.width[1] / climb.width[0]) ** done
        step = climb.step[0] * (climb.step[1] / climb.step[0]) ** done
        fresh = k % climb.redrawn == 0 or k == climb.steps
        if fresh:
            progress(f"negotiating: {k} of {climb.steps}")
            beside = diagram_neighbours(wall, state)
        found = gradient(wall, bodies, state, beside, width * reach)
        pull = climb.tether * float(bodies.volume.mean())
        off = np.column_stack([state.point - start.point, state.weight - start.weight])
        value = found.counted - pull * float((off**2).sum()) / 2.0
        if fresh and value > top:
            best, top = state, value
        if k == climb.steps:
            break
        ways = (
            np.column_stack([found.shift * reach[:, None], found.turn]) * ~bodies.held[:, None],
            np.column_stack([found.point, found.weight]) - pull * off,
        )
        moves = []
        for way, first, second, blocks in zip(ways, mean, square, ((0, 3, 6), (0, 2, 3)), strict=True):
            first += (1.0 - MOMENTS[0]) * (way - first)
            second += (1.0 - MOMENTS[1]) * (way**2 - second)
            moves.append(step * _scaled(first, second, k + 1, blocks))
        state = _moved(wall, bodies, state, moves, reach)
    return best, top


def _scaled(first: Floats, second: Floats, count: int, blocks: tuple[int, ...]) -> Floats:
    """Adam's direction, where the variables of a block share one second moment."""
    size = second.copy()
    for a, b in pairwise(blocks):
        size[:, a:b] = size[:, a:b].mean(axis=1, keepdims=True)
    least = FLOOR * np.sqrt(size.mean()) + 1e-300
    corrected = np.sqrt(size / (1.0 - MOMENTS[1] ** count)) + least
    return np.asarray(first / (1.0 - MOMENTS[0] ** count) / corrected)


def _moved(wall: FlatWall, bodies: Bodies, state: Variables, moves: list[Floats], reach: Floats) -> Variables:
    poses, sites = moves
    point = np.clip(state.point + sites[:, :2], EDGE, wall.grid - EDGE)
    weight = state.weight + sites[:, 2]
    return Variables(
        point,
        weight - (weight.mean() - state.weight.mean()),  # a common weight moves no line
        bonded(turned_by(poses[:, 3:]) @ state.rotation, bodies.bonds),
        state.shift + poses[:, :3] * reach[:, None],
    )


def diagram_neighbours(wall: FlatWall, state: Variables) -> Ints:
    """(s, k) sites whose cells border on that of each, filled up with -1.

    A site that has no cell is bounded by those nearest to it, so that its stone lies outside.
    """
    from scipy.spatial import cKDTree

    low, high = -wall.origin / wall.spacing, (wall.size - wall.origin) / wall.spacing
    cells = power_diagram(state.point, state.weight, low, high)
    pair = cells.side[(cells.side >= 0).all(axis=1)]
    pair = np.unique(cells.site[np.concatenate([pair, pair[:, ::-1]])].reshape(-1, 2), axis=0)
    hidden = np.setdiff1d(np.arange(len(state.weight)), cells.site)
    if len(hidden):
        near = cKDTree(state.point).query(state.point[hidden], min(BESIDE + 1, len(state.point)))[1]
        more = np.column_stack([np.repeat(hidden, near.shape[1]), near.ravel()])
        pair = np.concatenate([pair, more[more[:, 0] != more[:, 1]]])
        pair = pair[np.lexsort((pair[:, 1], pair[:, 0]))]
    count = np.bincount(pair[:, 0], minlength=len(state.weight))
    beside = np.full((len(state.weight), int(count.max(initial=1))), -1, np.int64)
    first = np.cumsum(count) - count
    beside[pair[:, 0], np.arange(len(pair)) - first[pair[:, 0]]] = pair[:, 1]
    return beside


@dataclass(frozen=True, slots=True, eq=False)
class _Bisectors:
    """Bisectors of each body's site and its neighbours."""

    other: Ints  # (b, k) site beyond the line, -1 = none
    normal: Floats  # (b, k, 2)
    offset: Floats  # (b, k) m
    length: Floats  # (b, k) L, 1/m


def _bisectors(wall: FlatWall, bodies: Bodies, state: Variables, beside: Ints) -> _Bisectors:
    other = beside[bodies.site]
    some = other >= 0
    own, far = bodies.site[:, None], np.where(some, other, 0)
    across = (state.point[far] - state.point[own]) / wall.spacing
    length = np.maximum(np.linalg.norm(across, axis=2), 1e-12)
    normal = np.where(some[..., None], across / length[..., None], 0.0)
    lifted = (state.point**2).sum(axis=1) - state.weight
    offset = (lifted[far] - lifted[own]) / (2.0 * length) + normal @ wall.origin
    return _Bisectors(other, normal, np.where(some, offset, FAR), length)


def gradient(wall: FlatWall, bodies: Bodies, state: Variables, beside: Ints, width: Floats) -> Gradient:
    """Shared volume and its gradient, for given neighbours.

    Parameters
    ----------
    wall : FlatWall
        What stays.
    bodies : Bodies
        The stones.
    state : Variables
        What moves.
    beside : (s, k) int
        Neighbours of each site, see `diagram_neighbours`.
    width : (b,) float
        To which each stone's border is smoothed (m).
    """
    lines = _bisectors(wall, bodies, state, beside)
    normal, offset = _planes(wall, lines)
    # about the stone's own centroid, which keeps single precision precise
    offset = offset - np.einsum("bpk,bk->bp", normal, state.shift)
    order, count = _within_reach(bodies, offset, width)
    near = _near(wall, bodies, state)
    inside, smooth = np.zeros(len(count)), np.zeros(len(count))
    force, turn = np.zeros((len(count), 3)), np.zeros((len(count), 3))
    moment = np.zeros((*offset.shape, 5))  # of the points that each plane pushes: first moments, sum, sum of s
    for rows in _batches(near, count, BATCH // bodies.points.shape[1]):
        chosen = near[rows[0]]
        walls = None
        if len(chosen):
            edge = wall.obstacles.normal[chosen]
            walls = edge, wall.obstacles.offset[chosen] - np.einsum("oek,bk->boe", edge, state.shift[rows])
        first = order[rows, : count[rows].max()]
        planes = normal[rows[:, None], first], offset[rows[:, None], first]
        found = _pushes(bodies, state.rotation, planes, walls, width, rows)
        inside[rows], smooth[rows], force[rows], turn[rows], moment[rows[:, None], first] = found
    each = bodies.volume / bodies.points.shape[1]
    moment *= each[:, None, None]
    k = lines.other.shape[1]
    point, weight = _site_gradient(wall, bodies, state, lines, moment[:, :k])
    return Gradient(
        float((inside * each).sum()),
        float((smooth * each).sum()),
        force * each[:, None],
        turn * each[:, None],
        point,
        weight,
    )


def _within_reach(bodies: Bodies, offset: Floats, width: Floats) -> tuple[Ints, Ints]:
    """Planes (b, p) of each body, the nearest to its centroid first, and how many (b,) may push points of it."""
    within = np.count_nonzero(offset <= (bodies.radius * (1.0 + 1e-5) + width)[:, None], axis=1)
    return np.argsort(offset, axis=1, kind="stable"), np.maximum(within, 1)


def _planes(wall: FlatWall, lines: _Bisectors) -> tuple[Floats, Floats]:
    """Normals (b, k + 6, 3) and offsets (b, k + 6) of the lines, the ends, the top, the foot, and the faces."""
    count, k = lines.other.shape
    slope = float(np.hypot(1.0, wall.batter))
    fixed = np.array(
        [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, wall.batter / slope, 1 / slope], [0, 0, -1]], float
    )
    normal = np.zeros((count, k + len(fixed), 3))
    normal[:, :k, :2], normal[:, k:] = lines.normal, fixed
    ends = np.array([0.0, wall.size[0], 0.0, wall.size[1], 0.0, wall.depth])
    return normal, np.concatenate([lines.offset, np.broadcast_to(ends, (count, len(ends)))], axis=1)


def _near(wall: FlatWall, bodies: Bodies, state: Variables) -> list[Ints]:
    """Obstacles within reach of each stone."""
    if not len(wall.obstacles):
        return [np.zeros(0, np.int64)] * len(bodies.site)
    low = np.stack([c.min(axis=0) for c in wall.obstacles.corners])
    high = np.stack([c.max(axis=0) for c in wall.obstacles.corners])
    here = state.shift[:, None, :2]
    gap = np.linalg.norm(np.maximum(np.maximum(low - here, here - high), 0.0), axis=2)
    return [np.flatnonzero(row) for row in gap <= bodies.radius[:, None]]


def _batches(near: list[Ints], count: Ints, size: int) -> list[Ints]:
    """Stones with the same obstacles together, those with as many planes next to each other, as many as fit."""
    groups: dict[tuple[int, ...], list[int]] = {}
    for row in np.argsort(count, kind="stable").tolist():
        groups.setdefault(tuple(near[row].tolist()), []).append(row)
    found = []
    for group in groups.values():
        most = max(1, size // int(count[group].max()))
        found += [np.array(group[k : k + most]) for k in range(0, len(group), most)]
    return found


def _pushes(
    bodies: Bodies,
    rotation: Floats,
    planes: tuple[Floats, Floats],
    walls: tuple[Floats, Floats] | None,
    width: Floats,
    rows: Ints,
) -> tuple[Ints, Floats, Singles, Singles, Singles]:
    """Per stone: points inside, sum of phi, its gradient by shift and turn, and what each plane is pushed with.

    The planes are turned into the stones' frames, and not the points into the wall's: there are fewer of them.
    """
    turn, normal = rotation[rows].astype(np.float32), planes[0].astype(np.float32)
    body = np.ones((len(rows), 4, bodies.points.shape[1]), np.float32)
    body[:, :3] = bodies.points[rows].transpose(0, 2, 1)
    plane = np.concatenate([normal @ turn, -planes[1][..., None].astype(np.float32)], axis=2)
    depth = plane @ body  # (b, p, n)
    outermost = depth.max(axis=1)
    pressed = None
    if walls is not None:
        sides = np.broadcast_to(walls[0], (len(rows), *walls[0].shape)).astype(np.float32)
        side = np.concatenate([sides @ turn[:, None], -walls[1][..., None].astype(np.float32)], axis=3)  # (b, o, e, 4)
        pressed, outermost = _obstructed(side, body, outermost)
    own = width[rows, None].astype(np.float32)
    share = np.clip(outermost / own, np.float32(-1.0), np.float32(1.0))
    square = share * share
    phi = np.float32(0.5) + share * (np.float32(0.25) * square - np.float32(0.75))
    push = np.float32(0.75) * (1.0 - square) / own
    np.multiply(depth == outermost[:, None], push[:, None], out=depth)
    moment = depth @ body.transpose(0, 2, 1)  # (b, p, 4), in the stones' frames
    deep = np.einsum("bpi,bpi->bp", moment, plane)  # s is linear in the point
    moment[..., :3] = moment[..., :3] @ turn.transpose(0, 2, 1)
    force, torque = wrench(moment, normal)
    if pressed is not None:
        pressure = np.multiply(pressed, push[:, None], dtype=np.float32) @ body.transpose(0, 2, 1)
        pressure[..., :3] = pressure[..., :3] @ turn.transpose(0, 2, 1)
        out = wrench(pressure, sides.reshape(len(rows), -1, 3))
        force, torque = force - out[0], torque - out[1]
    inside = np.count_nonzero(outermost <= 0.0, axis=1)
    return inside, phi.sum(axis=1, dtype=float), force, torque, np.concatenate([moment, deep[..., None]], axis=2)


def _obstructed(side: Singles, body: Singles, outermost: Singles) -> tuple[Bools, Singles]:
    """Which side of which obstacle (b, o * e, n) presses each point most, if it lies deeper in it than it is out."""
    within = (side.reshape(len(side), -1, 4) @ body).reshape(*side.shape[:3], -1)
    beyond = within.max(axis=2)  # (b, o, n): how far out of each obstacle, negative inside
    deepest = beyond.argmin(axis=1)
    worst = -np.take_along_axis(beyond, deepest[:, None], axis=1)[:, 0]
    nearest = np.take_along_axis(within.argmax(axis=2), deepest[:, None], axis=1)[:, 0]
    # one side of one obstacle, though dressed stones in a row have sides in one line
    number = np.arange(side.shape[1] * side.shape[2])[:, None]
    pressed = (number == (deepest * side.shape[2] + nearest)[:, None]) & (worst > outermost)[:, None]
    return pressed, np.maximum(outermost, worst)


def _site_gradient(
    wall: FlatWall, bodies: Bodies, state: Variables, lines: _Bisectors, moment: Floats
) -> tuple[Floats, Floats]:
    """Gradient by sites (s, 2) and weights (s,), from the moments (b, k, 5) of the points that push each line."""
    some = lines.other >= 0
    own, far = np.broadcast_to(bodies.site[:, None], some.shape)[some], lines.other[some]
    mass, deep, length = moment[some][:, 3:4], moment[some][:, 4:], lines.length[some][:, None]
    body = np.broadcast_to(np.arange(len(bodies.site))[:, None], some.shape)[some]
    first = moment[some][:, :2] + mass * (state.shift[body, :2] - wall.origin)
    first /= wall.spacing  # sum of G
    turn = deep * lines.normal[some] / wall.spacing
    near = (first - mass * state.point[own] - turn) / length
    away = (first - mass * state.point[far] - turn) / length
    point, weight = np.zeros_like(state.point), np.zeros_like(state.weight)
    np.add.at(point, own, near)
    np.add.at(point, far, -away)
    half = (mass / (2.0 * length))[:, 0]
    np.add.at(weight, own, half)
    np.add.at(weight, far, -half)
    return point, weight
