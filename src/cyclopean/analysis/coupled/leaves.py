"""What one cell of a refuting tree proves: bounds of the work of its two sides, and the test of a leaf.

A cell says of every contact point whether it is engaged (dn = -1), unloaded (f = 0) or open, in which sector it slides
(dd_t = s e, f_t = -r e, e in S) and how fast (lo <= s <= hi). A coupled state in the cell does the work

    p.dq = sum fn + sum |f_t||dd_t|            (eps = 1: virtual work, and fn (dn + 1) = 0)

*Force side.* Least work: min sum fn + max(beta_min, lo) |f_t| over forces that balance the loads. Its multiplier y
proves the bound with no solver: p.y <= p.dq for every state of the cell if at every point that may be loaded

    1 + dn^y >= 0,    1 + dn^y >= mu (h_y - max(beta_min, lo)),    h_y = max {e . dd_t^y : e in S},    dd^y = A'y

Both are linear in a multiple t of y, so that the best multiple is found in closed form; without a limit on t the cell
balances no loads at all.

*Motion side.* Most work: max p.dq over motions of the cell. Its multiplier is one vector w a point with A w = p, and

    p.dq = sum w.dd <= U = sum_k sup {w_k . dd : dd in the cell}

A cell is closed when t p.y > U, when nothing limits t, or when A w = 0 and U < 0 (no motion at all).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.analysis.coupled.states import Bounds
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.statics import EquilibriumSystem

__all__ = [
    "ENGAGED",
    "OPEN",
    "UNLOADED",
    "Cell",
    "Leaf",
    "Prior",
    "closes",
    "least_work",
    "most_work",
    "prior",
    "root_cell",
    "support",
]

OPEN, ENGAGED, UNLOADED = 0, 1, -1
COMFORT = 1e-8  # share of all terms by which a leaf must close in floats, so that the exact checker agrees
DETOUR = 10.0  # the checker may bound motions along other contacts than `prior` does


@dataclass(frozen=True, slots=True, eq=False)
class Cell:
    """A box of states: what a node of the tree assumes at every point."""

    status: Ints  # (q,) OPEN, ENGAGED or UNLOADED
    sector: Bools  # (q,) whether rays bound the sliding direction
    ray_a: Floats  # (q, 2) unit, in the point's (u, v); counter-clockwise to ray_b by less than 180 degrees
    ray_b: Floats  # (q, 2)
    lo: Floats  # (q,) least sliding
    hi: Floats  # (q,) most sliding

    def at(self, k: int, **values: Any) -> "Cell":
        """The same with other values at point k."""
        changed = {name: getattr(self, name).copy() for name in values}
        for name, value in values.items():
            changed[name][k] = value
        return replace(self, **changed)

    def engaged(self, k: int) -> "Cell":
        """The part where point k has dn = -1."""
        return self.at(k, status=ENGAGED)

    def unloaded(self, k: int) -> "Cell":
        """The part where point k carries nothing."""
        return self.at(k, status=UNLOADED)

    def friction(self, system: EquilibriumSystem, bounds: Bounds) -> Floats:
        """(q,) coefficients: none where a point slides by less than beta_min, so that it has no friction."""
        return np.where(self.hi < bounds.beta, 0.0, system.mu)

    def within(self, k: int, ray_a: Floats, ray_b: Floats) -> "Cell":
        """The part where point k slides between two rays, (2,) each."""
        return self.at(k, sector=True, ray_a=ray_a, ray_b=ray_b)


@dataclass(frozen=True, slots=True, eq=False)
class Leaf:
    """A closed cell: the vectors that prove it."""

    y: Floats | None  # (6 m,) force side, scaled
    w: Floats | None  # (q, 3) motion side, scaled, in (n, u, v)


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """Bounds on every motion and every force of a state, known beforehand; they only price rounding."""

    shift: Floats  # (m,) displacement of the centre of mass
    turn: Floats  # (m,) rotation
    thrust: float  # sum of all fn

    @property
    def finite(self) -> bool:
        """Whether a chain of contacts ties every block to a support."""
        return bool(np.isfinite(self.shift).all() and np.isfinite(self.turn).all())


def root_cell(system: EquilibriumSystem, bounds: Bounds) -> Cell:
    """The cell of all states."""
    q, rays = system.points, np.zeros((system.points, 2))
    return Cell(np.zeros(q, np.int64), np.zeros(q, bool), rays, rays, np.zeros(q), np.full(q, bounds.eta))


def prior(system: EquilibriumSystem, bounds: Bounds) -> Prior:
    """Bound all motions by going from the supports through contacts.

    Relative displacements at the three points of a triangle (edges e1, e2) in a contact are at most
    D = sqrt(2) max(eps, eta), so that the relative rotation is at most 2 D / |e1| + 2 D (|e1| + |e2|) / |e1 x e2|.
    Block b then has
    Omega_b = Omega_a + that, V_b = V_a + Omega_a |r0 - c_a| + D + Omega_b |r0 - c_b|; the best of all ways is taken.
    """
    reach = float(np.sqrt(2.0)) * max(bounds.eps, bounds.eta)
    shift, turn = np.full(system.blocks, np.inf), np.full(system.blocks, np.inf)
    hinges = []
    for points in _joints(system):
        k, twist = int(points[0]), _twist(system, points, reach)
        ends = [(int(system.row_a[k]), system.arm_a[k]), (int(system.row_b[k]), system.arm_b[k])]
        hinges += [(start, end, twist) for start, end in (ends, ends[::-1]) if end[0] >= 0]
    for _ in range(system.blocks):
        for (i, arm_i), (j, arm_j), twist in hinges:
            before, turned = (0.0, 0.0) if i < 0 else (shift[i], turn[i])
            omega = turned + twist
            lever = 0.0 if i < 0 else turned * float(np.linalg.norm(arm_i))
            turn[j] = min(turn[j], omega)
            shift[j] = min(shift[j], before + lever + reach + omega * float(np.linalg.norm(arm_j)))
    if not np.isfinite(shift).all():
        return Prior(shift, turn, np.inf)
    shift, turn = DETOUR * shift, DETOUR * turn
    load = system.p.reshape(-1, 6)
    work = np.linalg.norm(load[:, :3], axis=1) @ shift + np.linalg.norm(load[:, 3:], axis=1) @ turn
    return Prior(shift, turn, float(work) / bounds.eps)


def _joints(system: EquilibriumSystem) -> list[Ints]:
    """Runs of points that share both blocks and a normal: the contact polygons."""
    key = np.column_stack([system.row_a, system.row_b, system.frame[:, 0]])
    starts = np.flatnonzero(np.any(np.diff(key, axis=0) != 0.0, axis=1)) + 1
    return [run for run in np.split(np.arange(system.points), starts) if len(run) >= 3]


def _twist(system: EquilibriumSystem, points: Ints, reach: float) -> float:
    """The most that the two blocks of a contact turn against each other: from its first point, the furthest, and the
    one furthest aside.
    """
    k = points[0]
    arm = system.arm_b if system.row_b[k] >= 0 else system.arm_a
    edges = arm[points[1:]] - arm[k]
    one = edges[int(np.argmax(np.linalg.norm(edges, axis=1)))]
    area = np.linalg.norm(np.cross(one, edges), axis=1)
    two = edges[int(np.argmax(area))]
    long, wide = float(np.linalg.norm(one)), float(np.max(area))
    if not (wide > 0.0):
        return np.inf
    return 2.0 * reach / long + 2.0 * reach * (long + float(np.linalg.norm(two))) / wide


def support(cell: Cell, g: Floats) -> Floats:
    """(..., q) largest e.g over unit e in each point's sector, of (..., q, 2) tangential vectors."""
    size = np.hypot(g[..., 0], g[..., 1])
    if not cell.sector.any():
        return np.asarray(size)
    inside = (_cross(cell.ray_a, g) >= 0.0) & (_cross(g, cell.ray_b) >= 0.0)
    at_rays = np.maximum(np.sum(cell.ray_a * g, -1), np.sum(cell.ray_b * g, -1))
    return np.asarray(np.where(cell.sector & ~inside, at_rays, size))


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def least_work(system: EquilibriumSystem, bounds: Bounds, cell: Cell, gap: Floats) -> Floats:
    """(...) the largest multiple t of y, given its scaled gaps (..., q, 3), dd^y, that still proves t p.y <= p.dq."""
    mu = cell.friction(system, bounds)
    floor = mu * np.maximum(bounds.beta, cell.lo)
    push = mu * support(cell, gap[..., 1:]) - gap[..., 0]
    alone = np.where(gap[..., 0] < 0.0, 1.0 / np.maximum(-gap[..., 0], 1e-300), np.inf)
    rubbing = np.where(push > 0.0, (1.0 + floor) / np.maximum(push, 1e-300), np.inf)
    limits = np.where(cell.status == UNLOADED, np.inf, np.minimum(alone, rubbing))
    return np.asarray(np.min(limits, axis=-1, initial=np.inf))


def most_work(bounds: Bounds, cell: Cell, w: Floats) -> Floats:
    """(...) the most scaled work that vectors w, (..., q, 3), can do on motions of the cell."""
    normal = np.where(cell.status == ENGAGED, -w[..., 0], np.maximum(-w[..., 0], bounds.eta * w[..., 0]))
    h = support(cell, w[..., 1:])
    return np.asarray(np.sum(normal + np.where(h >= 0.0, cell.hi, cell.lo) * h, axis=-1))


def closes(system: EquilibriumSystem, bounds: Bounds, cell: Cell, known: Prior, leaf: Leaf) -> bool:
    """The leaf test of the certificate in floats, with room for rounding.

    With v the most that a unit of fn can take from p.y, and r the residual of A w = p (or A w = 0):
    p.y - max(v) sum fn > U + sum (|r_F| V + |r_M| Omega).
    """
    coupled = float(leaf.y is not None and leaf.w is not None)
    gain = loss = scale = 0.0
    if leaf.y is not None:
        gap = system.gap(leaf.y)
        bare = -(coupled + gap[:, 0])
        rub = bare + cell.friction(system, bounds) * (
            support(cell, gap[:, 1:]) - coupled * np.maximum(bounds.beta, cell.lo)
        )
        taken = np.where(cell.status == UNLOADED, 0.0, np.maximum(bare, rub))
        gain = float(system.p @ leaf.y) - float(np.max(taken, initial=0.0)) * known.thrust
        scale += float(np.abs(system.p) @ np.abs(leaf.y))
    if leaf.w is not None:
        off = np.asarray(coupled * system.p - system.A @ leaf.w.ravel()).reshape(-1, 6)
        slack = np.linalg.norm(off[:, :3], axis=1) @ known.shift + np.linalg.norm(off[:, 3:], axis=1) @ known.turn
        loss = float(most_work(bounds, cell, leaf.w) + slack)
        scale += max(1.0, bounds.eta) * float(np.sum(np.abs(leaf.w)))
    return gain - loss > COMFORT * scale
