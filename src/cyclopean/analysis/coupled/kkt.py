"""Newton steps in forces and motion together: equations of every contact point eliminated, twelve unknowns a block.

Whatever in coupled analysis goes from nearly a state to a state solves, again and again, for the cheapest step

    min  b.df + 1/2 df'W^-1 df + bd.dd + 1/2 dd'Q dd + 1/2 tie |dq|^2      dd = A'dq
    s.t. A df = -off        C_k df_k + G_k dd_k = -r_k  at each point k

The multipliers nu_k and forces df_k of a point see others only through y (of A df = -off) and dq. Eliminating them
point by point, with e = A'y and K = (C W C' + slack)^-1, leaves on the graph of blocks

    [ -A (W - W C'K C W) A'   A (W C'K G) A'          ] [ y  ]   [ off - A W (b + C'K (r - C W b)) ]
    [  A (G'K C W) A'         tie + A (Q + G'K G) A'  ] [ dq ] = [ -A (bd + G'K (r - C W b))       ]

    nu = -K (C W (e - b) + G dd + r)        df = W (e - b + C'nu)

which is symmetric quasi-definite, so that LDL' takes it in any order. The slack lets dependent rows be (four corners of
a flat joint); what it leaves of the equations goes by solving again for that, with the multipliers known so far.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cyclopean.analysis.quadratic_cones import apply
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.solvers import Factor, Symbolic, analyse
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["Doubled", "Eliminated", "PointRows", "Scaled", "Step"]

REFINEMENTS = 8  # one or two are usual


@dataclass(frozen=True, slots=True, eq=False)
class Scaled:
    """A factorisation of s M s, whose diagonal is of ones."""

    factor: Factor
    scale: Floats  # (n,) s


class Doubled:
    """Factors symmetric matrices of twelve unknowns a block, made of three on the pattern of S; ordered once."""

    def __init__(self, schur: Schur) -> None:
        self.schur, self.size, self.factorisations = schur, len(schur.free), 0
        indptr, indices = schur.symbolic.indptr, schur.symbolic.indices
        column = np.repeat(np.arange(self.size), np.diff(indptr))
        self.strict = np.flatnonzero(indices != column)
        self.symbolic: Symbolic = self._laid(indices, column)

    def _laid(self, row: Ints, column: Ints) -> Symbolic:
        """Pattern of the lower triangle with y and dq of a block side by side."""
        free = self.schur.free
        beside = np.concatenate([12 * (free // 6) + free % 6 + k for k in (0, 6)])
        y, dq = self.y, self.dq = np.argsort(np.argsort(beside)).reshape(2, -1)
        r, c = row[self.strict], column[self.strict]
        first = np.concatenate([y[row], dq[row], dq[row], dq[c]])
        second = np.concatenate([y[column], dq[column], y[column], y[r]])
        low, high = np.minimum(first, second), np.maximum(first, second)
        n = 2 * self.size
        self.order = np.argsort(low * n + high)
        self.row, self.column = high[self.order], low[self.order]
        self.diagonal = np.searchsorted(self.column, np.arange(n))
        return analyse(np.append(self.diagonal, len(self.row)), self.row)

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
        free = self.schur.free
        rhs[self.y], rhs[self.dq] = first[free], second[free]
        found = factor.scale * factor.factor.solve(factor.scale * rhs)
        one, other = np.zeros((2, self.schur.size))
        one[free], other[free] = found[self.y], found[self.dq]
        return one, other


@dataclass(frozen=True, slots=True, eq=False)
class PointRows:
    """Linearised equations C df + G dd = -r of every point; rows of zeros where there is none."""

    C: Floats  # (q, k, 3) columns fn fu fv
    G: Floats  # (q, k, 3) columns dn du dv
    r: Floats  # (q, k)

    @classmethod
    def empty(cls, points: int, count: int) -> "PointRows":
        """No equations, with room for `count` at each point."""
        return cls(np.zeros((points, count, 3)), np.zeros((points, count, 3)), np.zeros((points, count)))

    def shut(self, where: Bools, d: Floats) -> None:
        """Row 0: dn + 1 = 0, for (q, 3) displacements d."""
        self.G[where, 0, 0], self.r[where, 0] = 1.0, d[where, 0] + 1.0

    def sine(self, where: Bools, f: Floats, d: Floats) -> None:
        """Row 1: (fu dv - fv du) / (|f_t| |dd_t|) = 0, for (q, 3) forces and displacements."""
        k = np.flatnonzero(where)
        share = 1.0 / np.maximum(np.hypot(f[k, 1], f[k, 2]) * np.hypot(d[k, 1], d[k, 2]), 1e-14)
        self.r[k, 1] = (f[k, 1] * d[k, 2] - f[k, 2] * d[k, 1]) * share
        self.C[k, 1, 1], self.C[k, 1, 2] = d[k, 2] * share, -d[k, 1] * share
        self.G[k, 1, 1], self.G[k, 1, 2] = -f[k, 2] * share, f[k, 1] * share

    def slack(self, size: float) -> Floats:
        """(q, k) `size` where there is an equation, one where there is none."""
        used = (np.abs(self.C).sum(2) + np.abs(self.G).sum(2)) > 0.0
        return np.where(used, size, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """Change of forces and of motion, and what draws at them: e + C'nu at the forces, G'nu at the displacements."""

    df: Floats  # (q, 3)
    dq: Floats  # (6 m,)
    d: Floats  # (q, 3) A'dq
    force: Floats  # (q, 3)
    motion: Floats  # (q, 3)

    def plus(self, more: "Step", share: float) -> "Step":
        """The sum with a share of another."""
        mine, others = ((x.df, x.dq, x.d, x.force, x.motion) for x in (self, more))
        return Step(*(x + share * y for x, y in zip(mine, others, strict=True)))

    def dot(self, other: "Step") -> float:
        """Product with another, in what forces and motion cost."""
        return float(np.sum(self.df * other.force) + np.sum(self.d * other.motion))


class Eliminated:
    """The equations of one iterate with those of its points eliminated: one factorisation, any number of steps.

    Parameters
    ----------
    doubled : Doubled
        Of the system.
    system : EquilibriumSystem
        Scaled, q points.
    metric : W, Q, (q, 3, 3) each
        The inverse of what forces cost, zero where none may change, and what motion costs.
    rows : PointRows
        The points' equations.
    slack : (q, k)
        Of each of them.
    shift : (share, least)
        Of the first block's diagonal, see `Doubled.factor`.
    """

    def __init__(
        self,
        doubled: Doubled,
        system: EquilibriumSystem,
        metric: tuple[Floats, Floats],
        rows: PointRows,
        slack: Floats,
        shift: tuple[float, float] = (1e-11, 1e-3),  # below that, rows that depend on each other are rounding
    ) -> None:
        W, Q = metric
        self.doubled, self.A, self.W, self.rows = doubled, system.A, W, rows
        self.CW = rows.C @ W
        inner = self.CW @ rows.C.transpose(0, 2, 1)
        diagonal = np.arange(slack.shape[1])
        inner[:, diagonal, diagonal] += slack
        self.K = np.asarray(np.linalg.inv(inner))
        KCW, turned = self.K @ self.CW, rows.G.transpose(0, 2, 1)
        forces, motion = W - self.CW.transpose(0, 2, 1) @ KCW, Q + turned @ (self.K @ rows.G)
        self.factor = doubled.factor(forces, turned @ KCW, motion, *shift, 1.0)

    def step(self, off: Floats, r: Floats, b: Floats, bd: Floats) -> Step:
        """The cheapest step from residuals off (6 m,) and r (q, k), with slopes b and bd (q, 3)."""
        lead = apply(self.K, r - apply(self.CW, b))
        first = off - self.A @ (apply(self.W, b) + _back(self.CW, lead)).ravel()
        second = -(self.A @ (bd + _back(self.rows.G, lead)).ravel())
        y, dq = self.doubled.solve(self.factor, first, second)
        e, d = (np.asarray(self.A.T @ x).reshape(-1, 3) for x in (y, dq))
        nu = -lead - apply(self.K, apply(self.CW, e) + apply(self.rows.G, d))
        force = e + _back(self.rows.C, nu)
        return Step(apply(self.W, force - b), dq, d, force, _back(self.rows.G, nu))

    def refined(self, off: Floats, r: Floats, b: Floats, bd: Floats, wrong: Callable[[Floats, Floats], float]) -> Step:
        """As `step`, then conjugate gradients on what it leaves; the best met.

        In their metric all singular values of the equations beyond the root of shift and slack count as one, so that
        one step settles them; each of the few below takes one more. `wrong` says how much the (6 m,) and (q, k) that
        are left are: at most one is small enough.
        """
        total, zero = self.step(off, r, b, bd), np.zeros_like(b)
        left, miss = off + self.A @ total.df.ravel(), r + self._along(total)
        best, least = total, wrong(left, miss)
        slope = towards = self.step(left, miss, zero, zero) if least > 1.0 else total
        for _ in range(REFINEMENTS):
            if least <= 1.0:
                break
            along, rise = self.A @ towards.df.ravel(), self._along(towards)
            raised = self.step(-along, -rise, zero, zero)
            power, curvature = slope.dot(slope), towards.dot(raised)
            if not (power > 0.0 and curvature > 0.0):
                break
            share = power / curvature
            total, left, miss = total.plus(towards, share), left + share * along, miss + share * rise
            slope = slope.plus(raised, -share)
            towards = slope.plus(towards, slope.dot(slope) / power)
            if (now := wrong(left, miss)) < least:
                best, least = total, now
        return best

    def _along(self, step: Step) -> Floats:
        """(q, k) C df + G dd."""
        return apply(self.rows.C, step.df) + apply(self.rows.G, step.d)


def _back(M: Floats, x: Floats) -> Floats:
    """M_k' x_k for (q, k, 3) M and (q, k) x."""
    return np.asarray(np.einsum("nij,ni->nj", M, x))
