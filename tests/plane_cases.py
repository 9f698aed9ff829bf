"""Blocks in one vertical plane, and an exact integer programme that says whether they have a coupled state.

Between two walls, or between one wall and nothing, stand one to three blocks whose joints lean; some stand on a floor.
All contact points lie in the plane y = 0, two to a joint. Out of the plane friction can only take work, of which there
is none to give, so that it is zero: in the plane a point sticks without friction, or slides up, or down, and to say so
is one binary each. Plates beside the blocks, of no friction, bear nothing for the same reason; they only tie blocks to
supports, so that motions are bounded, and their points bound the displacement of a block near its centre. That bound
is a disc: the programme takes the square around it (`outer`) or in it, and from there on is linear.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.optimize import Bounds as Box
from scipy.optimize import LinearConstraint, milp

from cyclopean.analysis.coupled.branches import Node
from cyclopean.analysis.coupled.leaves import Cell, Leaf, closes, prior, root_cell
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.statics import EquilibriumSystem, contact_matrix

PLATE = 0.01  # how far the points of a plate are from the centre of their block
HAIR = 1e-5  # share by which bounds are wider or narrower than asked for: nobody decides what is nearer


@dataclass(frozen=True)
class PlaneCase:
    system: EquilibriumSystem
    plates: int  # last points
    bounds: Bounds


def _side(heading, mu, a, b, point, centre):
    """One point: normal along `heading` in the plane, from block a into block b (-1: fixed)."""
    n = np.array([np.cos(heading), 0.0, np.sin(heading)])
    y = np.array([0.0, 1.0, 0.0])
    arms = [point - centre[k] if k >= 0 else np.zeros(3) for k in (a, b)]
    return a, b, *arms, np.array([n, np.cross(y, n), y]), mu


def in_a_row(low, high, height, mu, bounds, right=True, floor=(), tilt=0.0) -> PlaneCase:
    """Blocks between joints from (low, 0) to (high, height), the first and, if `right`, the last on a wall."""
    m = len(low) - 1
    area = 0.5 * height * (np.diff(low) + np.diff(high))
    centre = np.array(
        [_centroid(np.array([[low[i], low[i + 1], high[i + 1], high[i]], [0, 0, height, height]])) for i in range(m)]
    )
    sides = []
    for j in range(m + 1 if right else m):
        heading = np.arctan2(low[j] - high[j], height)
        for x, z in ((low[j], 0.0), (high[j], height)):
            sides.append(_side(heading, mu, j - 1, j if j < m else -1, np.array([x, 0.0, z]), centre))
    for i in floor:
        for x in (low[i], low[i + 1]):
            sides.append(_side(np.pi / 2, mu, -1, i, np.array([x, 0.0, 0.0]), centre))
    frame = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    for i in range(m):
        for turn in (0.0, 2.0, 4.0):
            arm = PLATE * np.array([np.cos(turn), 0.0, np.sin(turn)])
            sides.append((-1, i, np.zeros(3), arm, frame, 0.0))
    a, b, arm_a, arm_b, frames, friction = (np.array(part) for part in zip(*sides, strict=True))
    load, k = np.zeros((m, 6)), np.arange(len(sides))
    load[:, 0], load[:, 2] = np.sin(tilt) * area / area.mean(), -np.cos(tilt) * area / area.mean()
    A = contact_matrix(m, a, b, arm_a, arm_b, frames)
    units = 1.0, 1.0, np.ones(m), np.ones(m)
    system = EquilibriumSystem(np.arange(m), k, a, b, arm_a, arm_b, frames, friction, A, load.ravel(), *units)
    return PlaneCase(system, 3 * m, bounds)


def plane_case(seed: int) -> PlaneCase:
    """Case number `seed`: one to three blocks, most of them between two walls."""
    rng = np.random.default_rng([seed, 11])
    m, height, mu = int(rng.integers(1, 4)), float(rng.uniform(0.3, 1.5)), float(rng.uniform(0.05, 1.5))
    lean = rng.uniform(-0.3, 0.3, m + 1) * rng.integers(0, 2)
    at = np.concatenate([[0.0], np.cumsum(rng.uniform(0.4, 1.2, m))])
    right = bool(rng.random() < 0.7)
    floor = [i for i in range(m) if rng.random() < (0.3 if right else 0.8)]
    tilt = float(rng.choice([0.0, rng.uniform(-0.5, 0.5)]))
    bounds = Bounds(1.0, float(rng.choice([2.0, 10.0])), 0.01)
    return in_a_row(at - lean * height / 2, at + lean * height / 2, height, mu, bounds, right, floor, tilt)


def _centroid(corners):
    """(3,) of a polygon in y = 0, x and z of its corners given."""
    x, z = corners
    cross = x * np.roll(z, -1) - np.roll(x, -1) * z
    return np.array([cross @ (x + np.roll(x, -1)), 0.0, cross @ (z + np.roll(z, -1))]) / (3.0 * cross.sum())


def has_state(case: PlaneCase, outer: bool) -> bool:
    """Whether there is a coupled state, with bounds a hair wider (and squares for discs), or narrower."""
    system, q, hair = case.system, case.system.points - case.plates, HAIR if outer else -HAIR
    eta, beta = case.bounds.eta * (1.0 + hair), case.bounds.beta * (1.0 - hair)
    rows = (6 * np.arange(system.blocks)[:, None] + [0, 2, 4]).ravel()
    A = system.A.toarray()[rows]
    N, U, m = A[:, : 3 * q : 3], A[:, 1 : 3 * q : 3], len(rows)
    centres = np.hstack([np.zeros((m, 0)), *(A[:, 3 * k + 1 : 3 * k + 3] for k in range(q, q + case.plates))])
    far = 2.0 if case.plates else 8.0  # eta that a centre may be displaced: without plates joints add up
    most = float(np.abs(system.p).sum()) * far * case.bounds.eta  # sum fn = p.dq less what friction takes
    mu, one, zero = np.diag(system.mu[:q]), np.eye(q), np.zeros((q, q))
    still = np.zeros((m, q))

    def row(fn, ft, dq, on, up, down, low, high):
        return np.hstack([fn, ft, dq, on, up, down]), low, high

    none = np.zeros((q, m))
    table = [
        row(N, U, np.zeros((m, m)), still, still, still, -system.p[rows], -system.p[rows]),
        row(one, zero, none, -most * one, zero, zero, -np.inf, 0.0),
        row(-mu, one, none, zero, zero, zero, -np.inf, 0.0),
        row(-mu, -one, none, zero, zero, zero, -np.inf, 0.0),
        row(zero, one, none, zero, zero, -most * one, -np.inf, 0.0),
        row(zero, -one, none, zero, -most * one, zero, -np.inf, 0.0),
        row(zero, zero, N.T, zero, zero, zero, -1.0 - max(hair, 0.0), eta),
        row(zero, zero, N.T, (eta + 1.0) * one, zero, zero, -np.inf, eta + max(hair, 0.0)),
        row(zero, zero, U.T, zero, zero, zero, -eta, eta),
        row(zero, zero, U.T, zero, -(eta + beta) * one, zero, -eta, np.inf),
        row(zero, zero, U.T, zero, zero, (eta + beta) * one, -np.inf, eta),
        row(zero, zero, none, zero, one, one, 0.0, 1.0),
    ]
    size = eta if outer else eta * np.sqrt(0.5)
    part = np.zeros((2 * case.plates, q))
    table.append(row(part, part, centres.T, part, part, part, -size, size))
    constraints = [LinearConstraint(sp.csr_array(M), low, high) for M, low, high in table]
    free = np.full(q, np.inf)
    lowest = np.concatenate([np.zeros(q), -free, np.full(m, -np.inf), np.zeros(3 * q)])
    highest = np.concatenate([free, free, np.full(m, np.inf), np.ones(3 * q)])
    kinds = np.concatenate([np.zeros(2 * q + m), np.ones(3 * q)])
    cost = np.concatenate([np.ones(q), np.zeros(4 * q + m)])
    found = milp(cost, constraints=constraints, bounds=Box(lowest, highest), integrality=kinds)
    assert found.status in (0, 2), found.message  # a state, or none
    return bool(found.status == 0)


def tree_holds(system: EquilibriumSystem, bounds: Bounds, root: Node) -> bool:
    """Whether the cells of a tree cover all states, and each leaf closes its cell."""
    known = prior(system, bounds)

    def holds(node: Node, cell: Cell) -> bool:
        if isinstance(node, Leaf):
            return closes(system, bounds, cell, known, node)
        k = node.point
        if node.speed is not None:
            assert cell.lo[k] < node.speed < cell.hi[k]
            cells = [cell.at(k, hi=node.speed), cell.at(k, lo=node.speed)]
        elif node.rays is None:
            cells = [cell.engaged(k), cell.unloaded(k)]
            if cell.status[k]:  # settled: the other part is empty
                return holds(node.parts[0 if cell.status[k] > 0 else 1], cell)
        else:
            edges = [cell.ray_a[k], *node.rays, cell.ray_b[k]] if cell.sector[k] else [*node.rays, node.rays[0]]
            assert all(a[0] * b[1] - a[1] * b[0] > 0.0 for a, b in pairwise(edges))
            cells = [cell.within(k, a, b) for a, b in pairwise(edges)]
        assert len(cells) == len(node.parts)
        return all(map(holds, node.parts, cells))

    return holds(root, root_cell(system, bounds))
