"""Refute the coupled states of a larger model by splits of which all parts but one are empty, as far as there are such.

Near the limit of a live load most points are forced: whatever balances the loads presses at them, or rubs one way. A
split of such a point leaves one part open and costs a leaf or two. So at each node forces and motion are fitted to each
other within the cell, and the points at which they disagree most are *probed*: is the part where such a point carries
nothing empty of forces, or the one where it slides too little, or elsewhere, for friction? The first point of which one
part at most stays open is split. Forces and motions met so far answer most probes without a programme.
"""

import time
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cyclopean.analysis.coupled.branches import Node, Split
from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.leaves import ENGAGED, OPEN, UNLOADED, Cell, Leaf, Prior, support
from cyclopean.analysis.coupled.states import Bounds, merit
from cyclopean.analysis.coupled.tree import Search, StoppedError, TreeAnswer
from cyclopean.arrays import Bools, Floats
from cyclopean.statics import EquilibriumSystem

__all__ = ["refute_by_probing"]

PROBED = 12  # points at a node at most
WORTH = 1e-9  # merit of a point that calls for a probe
SLOWER = 0.9  # of beta_min: what slides by less has no friction
ASIDE = np.pi / 2 - 0.15  # radians from where friction points back at which the sector that stays open ends
EDGE = 1e-8  # scaled, by which a force or motion met may miss a cell and still answers a probe
NARROW = 1e-3  # between the rays of a sector that is split no further
ROOM = 1.01  # of what a motion lacks, in opening joints, that is added to it


@dataclass(frozen=True, slots=True)
class _Met:
    """Forces and gaps of motions that lie in a cell."""

    forces: list[Floats]  # (q, 3) each
    gaps: list[Floats]  # (q, 3) each

    def within(self, cell: Cell, bounds: Bounds) -> "_Met":
        """Those that lie in a part of it."""
        forces = [f for f in self.forces if _bears(cell, bounds, f)]
        return _Met(forces, [gap for gap in self.gaps if _moves(cell, gap)])


def refute_by_probing(
    system: EquilibriumSystem, bounds: Bounds, programmes: int, deadline: float, known: Prior
) -> TreeAnswer:
    """Search all coupled states: none exists (a closed tree), here is one, or the budget is spent.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    bounds : Bounds
        Of the displacement; only eta / eps and beta_min / eps matter.
    programmes : int
        Budget.
    deadline : float
        Of `time.perf_counter`: stops the search wherever it is.
    known : Prior
        Bounds of all motions.
    """
    search = _Probing(Halves(system, bounds.unit(), deadline), known)
    return search.answer(search.tried(programmes) if known.finite else None)


class _Probing(Search):
    def tried(self, programmes: int) -> Node | None:
        """The closed tree, or None."""
        self.programmes, self.room = programmes, self.halves.opening()
        try:
            return self._closed(self.halves.root, _Met([], []), 1.0)
        except (StoppedError, RecursionError):
            return None

    def _closed(self, cell: Cell, met: _Met, share: float) -> Node:
        """Close a cell, or raise."""
        self.nodes += 1
        met = met.within(cell, self.bounds)
        leaf = self._probed(cell, met)
        if leaf is not None:
            self.closed += share
            return leaf
        if not (met.forces and met.gaps):
            raise StoppedError  # not even near balance: floating point decides here
        f, dq = met.forces[-1], np.zeros(len(self.system.p))
        gap = met.gaps[-1]
        for _ in range(2):
            word, found = self.halves.fitted_forces(gap, cell)
            f = found if word == "solved" else f
            met.forces.append(f)
            word, moved = self.halves.fitted_motions(f, cell)
            dq = moved if word == "solved" else dq
            gap = self.system.gap(moved) if word == "solved" else gap
            met.gaps.append(gap)
        return self._split_best(cell, met, share, f, dq)

    def _split_best(self, cell: Cell, met: _Met, share: float, f: Floats, dq: Floats) -> Node:
        """Split where the fewest parts stay open, of the points at which forces and motion disagree most."""
        normal, tangential = merit(self.system, self.bounds, f, dq)
        if float(normal.sum() + tangential.sum()) < self.bounds.beta:
            self.walk.polish(f, dq)
            if self.walk.best.found:
                raise StoppedError
        q = self.system.points
        work = np.concatenate([np.where(cell.status == OPEN, normal, 0.0), tangential])
        best: tuple[int, list[Cell], list[Leaf | None]] | None = None
        for i in np.argsort(-work, kind="stable")[:PROBED].tolist():
            parts = _parts(cell, i % q, i >= q, -f[i % q, 1:], self.bounds.beta) if work[i] > WORTH else []
            if not parts:
                continue
            leaves = [self._probed(part, met) for part in parts]
            if best is None or leaves.count(None) < best[2].count(None):
                best = i, parts, leaves
            if leaves.count(None) <= 1:
                break
        if best is None:
            raise StoppedError
        i, parts, leaves = best
        share /= len(parts)
        self.closed += share * (len(parts) - leaves.count(None))
        nodes = [leaf or self._closed(part, met, share) for part, leaf in zip(parts, leaves, strict=True)]
        return _joined(i % q, i >= q, parts, nodes)

    def _probed(self, cell: Cell, met: _Met) -> Leaf | None:
        """A leaf of the cell where it has no forces, or no motions; what it has goes to those met."""
        leaf = self.pool.leaf(cell)
        if leaf is None and not any(_bears(cell, self.bounds, f) for f in met.forces):
            self._spend()
            word, f, y = self.halves.balance(cell)
            if y is not None:
                self.pool.add(self._opened(cell, y), None)
                leaf = self.pool.leaf(cell)
            elif word == "solved":
                met.forces.append(f)
        if leaf is None and not any(_moves(cell, gap) for gap in met.gaps):
            self._spend()
            word, dq, w = self.halves.motions(cell, any_work=True)
            if word == "infeasible":
                self.pool.add(None, w, idle=True)
                leaf = self.pool.leaf(cell)
            elif word == "solved":
                met.gaps.append(self.system.gap(dq))
        return leaf

    def _spend(self) -> None:
        if self.halves.solves >= self.programmes or time.perf_counter() > self.halves.deadline:
            raise StoppedError

    def _opened(self, cell: Cell, y: Floats) -> Floats | None:
        """A motion that opens or unloads what a cell loads, y of a solver, exactly so; None where there is none."""
        if self.room is None:
            return y
        gap, mu = self.system.gap(y), cell.friction(self.system, self.bounds)
        lacks = np.where(cell.status == UNLOADED, 0.0, mu * np.maximum(support(cell, gap[:, 1:]), 0.0) - gap[:, 0])
        y = y + ROOM * float(np.max(lacks, initial=0.0)) * self.room
        power = float(self.system.p @ y)
        return y / power if power > 0.0 else None


def _parts(cell: Cell, k: int, rubs: bool, way: Floats, beta: float) -> list[Cell]:
    """Into what a point's load is split, or how it slides: too little for friction, or along `way`, or elsewhere."""
    if not rubs:
        return [cell.engaged(k), cell.unloaded(k)]
    a, b = cell.ray_a[k], cell.ray_b[k]
    if cell.sector[k]:
        middle = (a + b) / np.linalg.norm(a + b)
        return [cell.within(k, a, middle), cell.within(k, middle, b)] if np.linalg.norm(a - b) > NARROW else []
    turn = np.arctan2(way[1], way[0]) + np.array([-ASIDE, ASIDE, np.pi, -ASIDE])
    rays = np.column_stack([np.cos(turn), np.sin(turn)])
    slow, fast = [cell.at(k, hi=SLOWER * beta)], cell.at(k, lo=SLOWER * beta)
    return slow + [fast.within(k, one, two) for one, two in pairwise(rays)]


def _joined(k: int, rubs: bool, parts: list[Cell], nodes: list[Node]) -> Split:
    """The nodes of the parts as branches of a split, or of one in another."""
    if not rubs:
        return Split(k, tuple(nodes))
    if len(parts) == 2:
        return Split(k, tuple(nodes), rays=parts[0].ray_b[k][None])
    rays = np.array([part.ray_a[k] for part in parts[1:]])
    return Split(k, (nodes[0], Split(k, tuple(nodes[1:]), rays=rays)), speed=float(parts[0].hi[k]))


def _bears(cell: Cell, bounds: Bounds, f: Floats) -> bool:
    """Whether (q, 3) forces lie in a cell."""
    still = (cell.status == UNLOADED)[:, None] | ((cell.hi < bounds.beta)[:, None] & np.array([False, True, True]))
    return bool(np.all(np.abs(np.where(still, f, 0.0)) < EDGE) and np.all(_inside(cell, -f)))


def _moves(cell: Cell, gap: Floats) -> bool:
    """Whether the (q, 3) gaps of a motion lie in a cell."""
    slide = np.hypot(gap[:, 1], gap[:, 2])
    shut = np.all(gap[cell.status == ENGAGED, 0] < -1.0 + EDGE)
    return bool(
        shut and np.all(slide < cell.hi + EDGE) and np.all(slide > cell.lo - EDGE) and np.all(_inside(cell, gap))
    )


def _inside(cell: Cell, x: Floats) -> Bools:
    """(q,) whether the tangential parts of (q, 3) vectors lie in the sectors."""
    a, b, t = cell.ray_a, cell.ray_b, x[:, 1:]
    left = a[:, 0] * t[:, 1] - a[:, 1] * t[:, 0]
    right = t[:, 0] * b[:, 1] - t[:, 1] * b[:, 0]
    return np.asarray(~cell.sector | ((left > -EDGE) & (right > -EDGE)))
