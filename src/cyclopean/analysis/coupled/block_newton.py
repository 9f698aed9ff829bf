"""Gauss-Newton on the equations of a coupled state, twelve unknowns a block.

On given sets (see `polish`) a state solves A f = -p and, per point that is shut, rubs, is at its bound or slow,

    dn + 1 = 0        (fu dv - fv du) / (|f_t| |dd_t|) = 0        |f_t| - mu fn = 0        e.dd_t + beta = 0

the last, with e = f_t / |f_t|, where a point would otherwise slide less than beta, or the wrong way. A step is the one
of least norm that zeroes the linearised equations: with W = each force's own size squared,

    min 1/2 df' W^-1 df + 1/2 |dq|^2     subject to     A df = -r1,     C_k df_k + G_k (A'dq)_k = -r_k  at each point k.

The multipliers nu_k and forces df_k of a point see others only through y (of A df = -r1) and dq. Eliminating them point
by point, with e = A'y, d = A'dq and K = (C W C' + eps)^-1, leaves on the graph of blocks

    [ -A (W - W C'K C W) A'    A (W C'K G) A'   ] [ y  ]   [ r1 - A W C'K r ]
    [  A (G'K C W) A'          1 + A (G'K G) A' ] [ dq ] = [ -A G'K r       ]      df = W (e + C'nu)
                                                           nu = -K (C W e + G d + r)

which is symmetric quasi-definite, so that LDL' takes it in any order. eps lets dependent rows be (four corners of a
flat joint); what it leaves behind goes in the next step.
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.analysis.coupled.polish import Sets
from cyclopean.analysis.quadratic_cones import apply
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.errors import SolverError
from cyclopean.solvers import Factor, Symbolic, analyse
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["BlockNewton", "Doubled", "Scaled"]

STEPS = 20
FACTORISATIONS = 8  # two or three are usual; sets that contradict each other take more and gain nothing
SLACK = 1e-11  # eps: of rows without forces, in units where displacements are about 1
EXACT = 1e-14  # residual at which to stop
FINE = 1e-9  # ... and from which a step that gains little is due to rounding
CHORD = 0.1  # contraction with which the last factorisation is good enough
SLOW = 0.5  # share of the least residual left that counts as no progress
PATIENCE = 1  # such steps in a row that are allowed


@dataclass(frozen=True, slots=True, eq=False)
class _Local:
    """The linearised equations of every point, and what eliminating them leaves."""

    W: Floats  # (q, 3)
    C: Floats  # (q, 4, 3) rows shut, sine, bound, slow; columns fn fu fv
    G: Floats  # (q, 4, 3) the same rows; columns dn du dv
    K: Floats  # (q, 4, 4)


@dataclass(frozen=True, slots=True, eq=False)
class Scaled:
    """A factorisation of s M s, whose diagonal is of ones."""

    factor: Factor
    scale: Floats  # (n,) s


class Doubled:
    """Factors symmetric matrices of twelve unknowns a block, made of three on the pattern of S; ordered once."""

    def __init__(self, schur: Schur) -> None:
        self.schur, self.size, self.factorisations = schur, schur.size, 0
        indptr, indices = schur.symbolic.indptr, schur.symbolic.indices
        column = np.repeat(np.arange(schur.size), np.diff(indptr))
        self.strict = np.flatnonzero(indices != column)
        self.symbolic: Symbolic = self._laid(indices, column)

    def _laid(self, row: Ints, column: Ints) -> Symbolic:
        """Pattern of the lower triangle with y and dq of a block side by side."""
        y, dq = (12 * (np.arange(self.size) // 6) + np.arange(self.size) % 6 + k for k in (0, 6))
        self.y, self.dq = y, dq
        r, c = row[self.strict], column[self.strict]
        first = np.concatenate([y[row], dq[row], dq[row], dq[c]])
        second = np.concatenate([y[column], dq[column], y[column], y[r]])
        low, high = np.minimum(first, second), np.maximum(first, second)
        n = 2 * self.size
        self.order = np.argsort(low * n + high)
        self.row, self.column = high[self.order], low[self.order]
        self.diagonal = np.searchsorted(self.column, np.arange(n))
        return analyse(np.append(self.diagonal, len(self.row)), self.row, self.schur.symbolic.backend)

    def factor(self, forces: Floats, mixed: Floats, motion: Floats, shift: float, least: float, tie: float) -> Scaled:
        """Factor [ -A forces A' - shift, A mixed' A' ; A mixed A', A motion A' + tie ], of (q, 3, 3) each.

        Parameters
        ----------
        forces, mixed, motion : (q, 3, 3)
            `forces` and `motion` symmetric and positive semidefinite; `mixed` by rows of motion, columns of forces.
        shift, least : float
            Each diagonal entry of the first block grows by a share `shift` of itself, but not of less than `least`.
        tie : float
            What the diagonal of the second block grows by.
        """
        S, M = self.schur.values(forces), self.schur.values(motion)
        low, high = self.schur.values(mixed), self.schur.values(np.ascontiguousarray(mixed.transpose(0, 2, 1)))
        diagonal = self.schur.symbolic.indptr[:-1]
        S[diagonal] += shift * np.maximum(S[diagonal], least)
        M[diagonal] += tie
        data = np.concatenate([-S, M, low, high[self.strict]])[self.order]
        self.factorisations += 1
        scale = 1.0 / np.sqrt(np.maximum(np.abs(data[self.diagonal]), 1e-300))
        return Scaled(self.symbolic.factor(data * scale[self.row] * scale[self.column]), scale)

    def solve(self, factor: Scaled, first: Floats, second: Floats) -> tuple[Floats, Floats]:
        """Both (6 m,) parts of the solution."""
        rhs = np.zeros(2 * self.size)
        rhs[self.y], rhs[self.dq] = first, second
        found = factor.scale * factor.factor.solve(factor.scale * rhs)
        return found[self.y], found[self.dq]


class BlockNewton:
    """Gauss-Newton for one system; the ordering of its matrix is shared by all choices of sets."""

    def __init__(self, system: EquilibriumSystem, doubled: Doubled) -> None:
        self.system, self.doubled = system, doubled

    @property
    def factorisations(self) -> int:
        """Of the doubled matrix, so far."""
        return self.doubled.factorisations

    def solve(self, sets: Sets, slow: Bools, beta: float, f: Floats, dq: Floats) -> tuple[Floats, Floats]:
        """The best pair met from (f, dq) on; forces off the sets exactly zero.

        Parameters
        ----------
        sets : Sets
            Which equations hold where.
        slow : (q,) bool
            Points of `rubbing` that slide by `beta` exactly.
        beta : float
            How far.
        f, dq : (q, 3), (6 m,)
            Start.
        """
        f = np.where(sets.pressed[:, None], f, 0.0)
        f[~sets.rubbing, 1:] = 0.0
        best, last, idle, factored = (np.inf, f, dq), np.inf, 0, 0
        factor: Scaled | None = None
        local: _Local | None = None
        for _ in range(STEPS):
            off, values, now = self._linearised(sets, slow, beta, f, dq)
            worst = max(float(np.max(np.abs(off), initial=0.0)), float(np.max(np.abs(values), initial=0.0)))
            idle = idle + 1 if worst > SLOW * best[0] else 0
            if worst < best[0]:
                best = (worst, f, dq)
            if worst <= EXACT or not (worst < np.inf) or idle > PATIENCE or (idle and last < FINE):
                break
            if factor is None or local is None or worst > CHORD * last:
                if factored == FACTORISATIONS:
                    break
                local, factored = now, factored + 1
                try:
                    factor = self._factor(local)
                except SolverError:
                    break
            last = worst
            df, step = self._step(local, factor, off, values)
            f, dq = f + df, dq + step
        return best[1], best[2]

    def _linearised(self, sets: Sets, slow: Bools, beta: float, f: Floats, dq: Floats) -> tuple[Floats, Floats, _Local]:
        """Residuals of balance and of every point, and the local equations."""
        d, mu = self.system.gap(dq), self.system.mu
        tangent, slide = np.hypot(f[:, 1], f[:, 2]), np.hypot(d[:, 1], d[:, 2])
        C, G, r = np.zeros((len(f), 4, 3)), np.zeros((len(f), 4, 3)), np.zeros((len(f), 4))
        k = np.flatnonzero(sets.shut)
        G[k, 0, 0], r[k, 0] = 1.0, d[k, 0] + 1.0
        k = np.flatnonzero(sets.rubbing)
        share = 1.0 / np.maximum(tangent[k] * slide[k], 1e-9)
        r[k, 1] = (f[k, 1] * d[k, 2] - f[k, 2] * d[k, 1]) * share
        C[k, 1, 1], C[k, 1, 2] = d[k, 2] * share, -d[k, 1] * share
        G[k, 1, 1], G[k, 1, 2] = -f[k, 2] * share, f[k, 1] * share
        k = np.flatnonzero(sets.edge)
        size = 1.0 / np.maximum(tangent[k], 1e-9)
        r[k, 2] = (tangent[k] - mu[k] * f[k, 0]) * size
        C[k, 2, 0] = -mu[k] * size
        C[k, 2, 1:] = f[k, 1:] * (size / np.maximum(tangent[k], 1e-300))[:, None]
        k = np.flatnonzero(slow)
        e = f[k, 1:] / np.maximum(tangent[k], 1e-300)[:, None]
        along = np.sum(e * d[k, 1:], 1)
        r[k, 3], G[k, 3, 1:] = along + beta, e
        C[k, 3, 1:] = (d[k, 1:] - along[:, None] * e) / np.maximum(tangent[k], 1e-9)[:, None]
        W = np.zeros_like(f)
        W[:, 0] = np.where(sets.pressed, np.maximum(np.abs(f[:, 0]), 1e-9) ** 2, 0.0)
        W[:, 1:] = np.where(sets.rubbing, np.maximum(tangent, 1e-9) ** 2, 0.0)[:, None]
        M = (C * W[:, None, :]) @ C.transpose(0, 2, 1)
        used = (np.abs(C).sum(2) + np.abs(G).sum(2)) > 0.0
        M[:, range(4), range(4)] += np.where(used, SLACK, 1.0)
        return self.system.residual(f), r, _Local(W, C, G, np.asarray(np.linalg.inv(M)))

    def _factor(self, at: _Local) -> Scaled:
        CW = at.C * at.W[:, None, :]
        KCW, KG = at.K @ CW, at.K @ at.G
        forces = -CW.transpose(0, 2, 1) @ KCW
        forces[:, range(3), range(3)] += at.W
        motion = at.G.transpose(0, 2, 1) @ KG
        mixed = at.G.transpose(0, 2, 1) @ KCW  # P', by rows of dq and columns of y
        return self.doubled.factor(forces, mixed, motion, SLACK, 1e-3, 1.0)

    def _step(self, at: _Local, factor: Scaled, off: Floats, r: Floats) -> tuple[Floats, Floats]:
        A = self.system.A
        lead = apply(at.K, r)
        first = off - A @ (at.W * apply(at.C.transpose(0, 2, 1), lead)).ravel()
        y, dq = self.doubled.solve(factor, first, -(A @ apply(at.G.transpose(0, 2, 1), lead).ravel()))
        e, d = self.system.gap(y), self.system.gap(dq)
        nu = -apply(at.K, apply(at.C, at.W * e) + apply(at.G, d) + r)
        return at.W * (e + apply(at.C.transpose(0, 2, 1), nu)), dq
