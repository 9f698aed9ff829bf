"""S = A D A' on the graph of free blocks: one pattern, many values."""

import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.solvers import Factor, Symbolic, analyse
from cyclopean.statics.equilibrium import EquilibriumSystem

__all__ = ["Schur"]

ALONE = 200  # blocks up to which threads cost more than they save
BATCH = 4  # contact points an element takes together; most joints have four corners


class Schur:
    """Assembles and factors S = A D A' + shift I for any 3 x 3 blocks D.

    Points of one pair of blocks are taken together, four to an element, so that assembly is a batch of small dense
    products (12 x 12) and one scatter into a pattern that is ordered once. Of the `size` unknowns only those `free` are
    on it, which no support holds. Counts its factorisations.
    """

    def __init__(self, system: EquilibriumSystem, threads: int | None = None) -> None:
        self.size = 6 * system.blocks
        self.factorisations = 0
        self._gather(system)
        self.free = free = np.flatnonzero(~system.held.ravel()) if system.held.any() else np.arange(self.size)
        dofs = np.full((system.blocks + 1, 6), -1)  # the last of fixed blocks, which are numbered so
        dofs.ravel()[free] = np.arange(len(free))
        row = dofs[self._pair].reshape(-1, 12)[:, self._rows]
        k = len(self._rows)
        i = np.broadcast_to(row[:, :, None], (len(row), k, k)).ravel()
        j = np.broadcast_to(row[:, None, :], (len(row), k, k)).ravel()
        self._kept = np.flatnonzero((i >= j) & (j >= 0))
        n = len(free)
        key = j[self._kept] * n + i[self._kept]
        diagonal = np.arange(n) * (n + 1)
        unique, place = np.unique(np.concatenate([key, diagonal]), return_inverse=True)
        self._place, self._diagonal = place[: len(key)], place[len(key) :]
        indices = unique % max(n, 1)
        indptr = np.searchsorted(unique // max(n, 1), np.arange(n + 1))
        self._entries = len(unique)
        threads = 1 if threads is None and system.blocks <= ALONE else threads
        self.symbolic: Symbolic = analyse(indptr, indices, threads)

    def on(self, system: EquilibriumSystem) -> "Schur":
        """S of a system with the same blocks and points in other units (`rows`, frames): the ordering is kept."""
        other = copy.copy(self)
        other.factorisations = 0
        other._gather(system)
        return other

    def _gather(self, system: EquilibriumSystem) -> None:
        """Sort the points by pair of blocks and cut each pair's points into elements of at most `BATCH`."""
        self._uneven = system.rows is not None
        q = system.points
        pair = np.stack([system.row_a, system.row_b], 1)
        order = np.lexsort((pair[:, 1], pair[:, 0]))
        ranked = pair[order]
        new = np.ones(q, bool)
        new[1:] = (ranked[1:] != ranked[:-1]).any(1)
        first = np.flatnonzero(new)
        within = np.arange(q) - np.repeat(first, np.diff(np.append(first, q)))
        opens = new | (within % BATCH == 0)
        element = np.cumsum(opens) - 1
        count = int(element[-1]) + 1 if q else 0
        slot = element * BATCH + within % BATCH
        self._slot = np.zeros(q, np.int64)
        self._slot[order] = slot
        self._pair = ranked[opens]
        influence = np.zeros((q, 12, 3))
        for half, (row, arm, sign) in enumerate(
            ((system.row_a, system.arm_a, -1.0), (system.row_b, system.arm_b, 1.0))
        ):
            turn = np.cross(arm[:, None, :], system.frame)
            value = sign * np.concatenate([system.frame, turn], 2).transpose(0, 2, 1)  # (q, 6, 3)
            if system.rows is not None:
                value = value * system.rows.reshape(-1, 6)[row][:, :, None]
            moves = (row >= 0)[:, None, None]
            if system.held.any():
                moves = moves & ~system.held[row][:, :, None]
            influence[:, 6 * half : 6 * half + 6] = np.where(moves, value, 0.0)
        moving = np.ones(6, bool) if not system.held.any() else ~system.held.all(0)
        self._rows = np.flatnonzero(np.tile(moving, 2))  # k <= 12 that not all blocks hold
        padded = np.zeros((count * BATCH, len(self._rows), 3))
        padded[self._slot] = influence[:, self._rows]
        stacked = padded.reshape(count, BATCH, len(self._rows), 3).transpose(0, 2, 1, 3)
        self._G = np.ascontiguousarray(stacked.reshape(count, len(self._rows), 3 * BATCH))
        self._Gt = np.ascontiguousarray(padded.transpose(0, 2, 1))  # (count BATCH, 3, k)

    def values(self, D: Floats) -> Floats:
        """Lower triangle of S = A D A' on the pattern, for (q, 3, 3) D."""
        padded = np.zeros((len(self._Gt), 3, 3))
        padded[self._slot] = D
        weighted = np.matmul(padded, self._Gt).reshape(len(self._G), 3 * BATCH, len(self._rows))
        full = np.matmul(self._G, weighted).ravel()[self._kept]
        total: Floats = np.bincount(self._place, full, self._entries).astype(np.float64)
        return total

    def factor(self, D: Floats, shift: float) -> Factor:
        """Factor S + shift I; where rows have scales of their own, S + shift (I + diag S)."""
        data = self.values(D)
        data[self._diagonal] += shift * (1.0 + data[self._diagonal]) if self._uneven else shift
        return self._counted(self.symbolic.factor(data))

    def unsymmetric(self, D: Floats, shift: float) -> Factor:
        """Factor A D A' + shift I for (q, 3, 3) D that are not symmetric."""
        lower, upper = self.values(D), self.values(np.ascontiguousarray(D.transpose(0, 2, 1)))
        lower[self._diagonal] += shift
        whole = self._whole
        return self._counted(whole.symbolic.factor(np.concatenate([lower, upper[whole.strict]])[whole.order]))

    def _counted(self, factor: Factor) -> Factor:
        """A factor of the free unknowns as one of all of them."""
        self.factorisations += 1
        return factor if len(self.free) == self.size else Factor(_Held(factor.handle, self.free, self.size))

    @cached_property
    def _whole(self) -> "_Whole":
        return _Whole.of(self.symbolic)


@dataclass(frozen=True, slots=True, eq=False)
class _Held:
    """A factor of some unknowns; the others are held, and are zero."""

    handle: Any
    free: Ints
    size: int

    def solve(self, rhs: Floats) -> Floats:
        """(size,) in, (size,) out."""
        x = np.zeros(self.size)
        x[self.free] = self.handle.solve(rhs[self.free])
        return x


@dataclass(frozen=True, slots=True, eq=False)
class _Whole:
    """Both triangles of a pattern, for LU."""

    symbolic: Symbolic
    strict: Ints  # entries of the lower triangle off the diagonal
    order: Ints  # (nnz,) of the lower triangle's entries, then those of the upper, by columns

    @classmethod
    def of(cls, lower: Symbolic) -> "_Whole":
        """From the lower triangle."""
        n, row = len(lower.indptr) - 1, lower.indices
        column = np.repeat(np.arange(n), np.diff(lower.indptr))
        strict = np.flatnonzero(row != column)
        r, c = np.concatenate([row, column[strict]]), np.concatenate([column, row[strict]])
        order = np.argsort(c * n + r)
        indptr = np.searchsorted(c[order], np.arange(n + 1))
        return cls(analyse(indptr, r[order], symmetric=False), strict, order)
