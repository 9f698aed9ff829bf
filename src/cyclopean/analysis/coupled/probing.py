"""Refute the coupled states of a larger model by splits of which all parts but one are empty, as far as there are such.

Near the limit of a live load most points are forced: whatever balances the loads presses at them, or rubs one way. A
split of such a point leaves one part open and costs a leaf or two. So at each node forces and motion are fitted to each
other within the cell, and the points at which they disagree most are *probed*: is the part where such a point carries
nothing empty of forces, or the one where it slides too little, or elsewhere, for friction? The first point of which one
part at most stays open is split. Forces and motions met so far answer most probes without a programme.
"""

import time
from collections.abc import Iterator
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

PROBED, FORCED = 6, 12  # points at a node at most: where forces and motion disagree most, and that look forced
SURE = 1e-6  # scaled force or gap that all have that have been met, from which a point looks forced
WORTH = 1e-9  # merit of a point that calls for a probe
SLOWER = 0.9  # of beta_min: what slides by less has no friction
ASIDE = np.pi / 2 - 0.15  # radians from where friction points back at which the sector that stays open ends
EDGE = 1e-8  # scaled, by which a force or motion met may miss a cell and still answers a probe
NARROW = 1e-3  # between the rays of a sector that is split no further
ROOM = 1.01  # of what a motion lacks, in opening joints, that is added to it


@dataclass(slots=True)
class _Met:
    """A cell, and the forces and gaps of motions met so far that lie in it."""

    cell: Cell
    forces: list[Floats]  # (q, 3) each
    gaps: list[Floats]  # (q, 3) each

    def within(self, cell: Cell, bounds: Bounds) -> "_Met":
        """A part of it, and what lies in that."""
        forces = [f for f in self.forces if _bears(cell, bounds, f)]
        return _Met(cell, forces, [gap for gap in self.gaps if _moves(cell, gap)])


@dataclass(frozen=True, slots=True)
class _Splitting:
    """A point whose load, or whose sliding where it `rubs`, is split; some parts are closed."""

    point: int
    rubs: bool
    parts: list[Cell]
    leaves: dict[int, Leaf]

    @property
    def open(self) -> list[int]:
        """Numbers of the parts that are not closed."""
        return [i for i in range(len(self.parts)) if i not in self.leaves]

    def node(self, closed: dict[int, Node]) -> Split:
        """The split with the nodes of the parts that were open; one by speed has one by sectors in it."""
        k, parts = self.point, self.parts
        nodes = tuple({**self.leaves, **closed}[i] for i in range(len(parts)))
        if len(parts) == 2:
            return Split(k, nodes, rays=parts[0].ray_b[k][None] if self.rubs else None)
        rays = np.array([part.ray_a[k] for part in parts[1:]])
        return Split(k, (nodes[0], Split(k, nodes[1:], rays=rays)), speed=float(parts[0].hi[k]))


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
        self.pool.add(self.halves.forces(self.halves.root)[2], None)  # the work alone may be enough
        word, _, w = self.halves.motions(self.halves.root)
        self.pool.add(None, w, idle=word == "infeasible")
        try:
            return self._closed(_Met(self.halves.root, [], []), 1.0)
        except (StoppedError, RecursionError):
            return None

    def _closed(self, met: _Met, share: float) -> Node:
        """Close a cell, or raise: forced points are split one after the other, else one of which several parts stay."""
        self.nodes += 1
        leaf = self._probed(met.cell, met)
        if leaf is not None:
            self.closed += share
            return leaf
        if not (met.forces and met.gaps):
            raise StoppedError  # not even near balance: floating point decides here
        f, work = self._fitted(met)
        chain: list[_Splitting] = []
        best: _Splitting | None = None
        for i in self._candidates(met, work):
            splitting = self._split_at(met, i, -f)
            if len(splitting.open) > 1:
                best = splitting if best is None or len(splitting.open) < len(best.open) else best
                continue
            chain.append(splitting)
            if not splitting.open:
                break
            inner = met.within(splitting.parts[splitting.open[0]], self.bounds)
            met.cell, met.forces, met.gaps = inner.cell, inner.forces, inner.gaps
            if work[i] > WORTH or not (met.forces and met.gaps):
                break  # fit them anew
        if not chain:
            if best is None:
                raise StoppedError
            chain.append(best)
        return self._joined(chain, met, share)

    def _joined(self, chain: list["_Splitting"], met: _Met, share: float) -> Node:
        """The splits of a chain, what the last leaves open closed."""
        last = chain[-1]
        rest = share / max(len(last.open), 1)
        self.closed += share * (not last.open)
        closed = {i: self._closed(met.within(last.parts[i], self.bounds), rest) for i in last.open}
        node = last.node(closed)
        for splitting in reversed(chain[:-1]):
            node = splitting.node({splitting.open[0]: node})
        return node

    def _fitted(self, met: _Met) -> tuple[Floats, Floats]:
        """Forces fitted to a motion of the cell, and (2 q,) by how much they disagree at each point: load, sliding."""
        f, gap, dq = met.forces[-1], met.gaps[-1], np.zeros(len(self.system.p))
        for _ in range(2):
            self._spend()
            word, found = self.halves.fitted_forces(gap, met.cell)
            if word == "solved":
                f = found
                met.forces.append(f)
            word, moved = self.halves.fitted_motions(f, met.cell)
            if word == "solved":
                dq, gap = moved, self.system.gap(moved)
                met.gaps.append(gap)
        work = np.concatenate(merit(self.system, self.bounds, f, dq))
        if float(work.sum()) < self.bounds.beta:
            self.walk.polish(f, dq)
            if self.walk.best.found:
                raise StoppedError
        return f, work

    def _split_at(self, met: _Met, i: int, way: Floats) -> "_Splitting":
        """A point split, and those of its parts closed that have to be for one at most to stay open."""
        rubs, k = divmod(i, self.system.points)
        parts = _parts(met.cell, k, bool(rubs), way[k, 1:], self.bounds.beta)
        leaves: dict[int, Leaf] = {}
        for j in (1, 0) if len(parts) == 2 else (0, 2, 3):
            leaf = self._probed(parts[j], met)
            if leaf is not None:
                leaves[j] = leaf
                if len(parts) == 2:
                    break
        return _Splitting(k, bool(rubs), parts, leaves)

    def _candidates(self, met: _Met, work: Floats) -> Iterator[int]:
        """Points k whose load, and q + k whose sliding may be split: first where (2 q,) work is, then the forced ones.

        That all forces met press at a point, or rub one way, or that no motion met closes it, is a hint only.
        """
        work[: self.system.points][met.cell.status != OPEN] = 0.0
        asked = [i for i in np.argsort(-work, kind="stable")[:PROBED].tolist() if work[i] > WORTH]
        for i in asked:
            if _splits(met.cell, i):
                yield i
        for _ in range(FORCED):
            least = _forced(met)
            least[asked] = 0.0
            i = int(np.argmax(least))
            if not least[i] > SURE:
                return
            asked.append(i)
            yield i

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


def _forced(met: _Met) -> Floats:
    """(2 q,) how much at least all forces press that have been met, or all motions open; how much they rub one way."""
    forces, opens = np.array(met.forces), np.array(met.gaps)[:, :, 0].min(axis=0) + 1.0
    mean = forces[:, :, 1:].mean(axis=0)
    along = mean / np.maximum(np.hypot(mean[:, 0], mean[:, 1]), 1e-300)[:, None]
    rubs = np.sum(forces[:, :, 1:] * along, axis=2).min(axis=0)
    presses = np.maximum(forces[:, :, 0].min(axis=0), opens)
    return np.concatenate([np.where(met.cell.status == OPEN, presses, 0.0), np.where(met.cell.sector, 0.0, rubs)])


def _splits(cell: Cell, i: int) -> bool:
    """Whether a point's load, or its sliding, may be split further."""
    k, rubs = i % len(cell.status), i >= len(cell.status)
    if rubs and cell.sector[k]:
        return bool(np.linalg.norm(cell.ray_a[k] - cell.ray_b[k]) > NARROW)
    return bool(cell.lo[k] == 0.0) if rubs else bool(cell.status[k] == OPEN)


def _parts(cell: Cell, k: int, rubs: bool, way: Floats, beta: float) -> list[Cell]:
    """Into what a point's load is split, or how it slides: too little for friction, or along `way`, or elsewhere."""
    if not rubs:
        return [cell.engaged(k), cell.unloaded(k)]
    a, b = cell.ray_a[k], cell.ray_b[k]
    if cell.sector[k]:
        middle = (a + b) / np.linalg.norm(a + b)
        return [cell.within(k, a, middle), cell.within(k, middle, b)]
    turn = np.arctan2(way[1], way[0]) + np.array([-ASIDE, ASIDE, np.pi, -ASIDE])
    rays = np.column_stack([np.cos(turn), np.sin(turn)])
    slow, fast = [cell.at(k, hi=SLOWER * beta)], cell.at(k, lo=SLOWER * beta)
    return slow + [fast.within(k, one, two) for one, two in pairwise(rays)]


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
