"""The convex programmes of coupled analysis: forces for given prices or a given motion, motion for given forces.

*Programme A.* With a price c_k of compression and a compliance alpha_k of friction per point,

    min  sum c fn + beta |f_t| + 1/2 alpha |f_t|^2     s.t.  A f = -p,  |f_t| <= mu fn

has a multiplier dq of equilibrium with dd = A'dq and, where fn > 0 and the bound on |f_t| is idle,

    dn = -c,     dd_t = -(beta + alpha |f_t|) f_t / |f_t|

which is eqs. (8) to (10) of [Kao2022]_ where c = 1 and no friction bound is active. On the edge of the cone with
multiplier l, dn = -c + mu l and |dd_t| = beta + alpha |f_t| + l: raising c by mu l mends dn.

*The merit*, for fixed motion and for fixed forces (see `states.merit`): each is convex, and a descent goes from the one
to the other.

*A cell's least and most work*, see `leaves`.

References
----------
.. [Kao2022] Kao, Iannuzzo, Thomaszewski, Coros, Van Mele, Block: Coupled Rigid-Block Analysis. Computer-Aided
   Design 146 (2022) 103216.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.coupled.leaves import ENGAGED, UNLOADED, Cell, root_cell
from cyclopean.analysis.coupled.programme_a import Prices
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.analysis.equilibrium.reference import BIG
from cyclopean.arrays import Floats, Ints
from cyclopean.solvers import SOLVERS, Cone, ConicProgram
from cyclopean.statics import EquilibriumSystem

__all__ = ["Halves", "SlidingAnswer"]

SHARP, FINE = 1e-10, 1e-9  # gap and residuals of programme A, and of all others
CERTAIN = 1e-9  # ... and of a proof that there are no forces
FAINT = 1e-9  # friction that counts as none
MISSED = 1e-6  # of balance, or of a cell of motions, from which nothing is in the cell

Word = Literal["solved", "infeasible", "failed"]
Entries = tuple[Any, Any, Any]  # rows, columns and values of a matrix, broadcast against each other


@dataclass(frozen=True, slots=True, eq=False)
class SlidingAnswer:
    """Forces of programme A and their multipliers, as the solver left them."""

    word: Word
    f: Floats  # (q, 3)
    dq: Floats  # (6 m,)


class _Answer(NamedTuple):
    word: Word
    x: Floats
    z: Floats


class _Rows:
    """Rows b - M x in a product of cones, as they are added."""

    def __init__(self, columns: int) -> None:
        self.columns, self.count = columns, 0
        self.entries: list[tuple[Ints, Ints, Floats]] = []
        self.rhs: list[Floats] = []
        self.cones: list[Cone] = []

    def add(self, kind: Literal["zero", "nonnegative", "second-order"], b: Floats, *entries: Entries) -> None:
        """Rows with (k,) right-hand sides; second-order cones take three each."""
        size = 3 if kind == "second-order" else 1
        for row, column, value in entries:
            i, j, x = np.broadcast_arrays(row, column, value)
            self.entries.append((i + self.count, j, x))
        self.rhs.append(b)
        self.cones.append((kind, size, len(b) // size))
        self.count += len(b)

    def slacken(self, which: Ints, column: int, sign: float) -> None:
        """Let rows that are there already miss by sign x, one x >= 0 for each from this column on."""
        k = np.arange(len(which))
        self.entries.append((which, column + k, np.full(len(k), sign)))
        self.add("nonnegative", np.zeros(len(k)), (k, column + k, -1.0))

    def program(self, cost: Floats, curvature: Floats | None = None) -> ConicProgram:
        """The programme with (n,) linear costs, and squares weighted by `curvature`."""
        row, column, value = (np.concatenate([part[i] for part in self.entries]) for i in range(3))
        kept = value != 0.0
        shape = (self.count, self.columns)
        A = sp.csc_matrix((value[kept], (row[kept], column[kept])), shape=shape)
        P = sp.csc_matrix((len(cost), len(cost))) if curvature is None else sp.diags(curvature, format="csc")
        return ConicProgram(P, cost, A, np.concatenate(self.rhs), tuple(self.cones))


class Halves:
    """The convex programmes of one system; counts what it solves.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, m free blocks and q points.
    bounds : Bounds
        With eps = 1.
    deadline : float
        Of `time.perf_counter`, at which solving ends.
    """

    def __init__(self, system: EquilibriumSystem, bounds: Bounds, deadline: float = np.inf) -> None:
        self.system, self.bounds, self.deadline, self.solves, self.iterations = system, bounds, deadline, 0, 0
        self.root = root_cell(system, bounds)
        entries = system.A.tocoo()
        self._row, self._value = entries.row, entries.data
        self._point, self._axis = np.divmod(entries.col, 3)

    @cached_property
    def lift(self) -> Floats:
        """(3 q, 6 m) least forces for a load: dense, for small models."""
        return np.asarray(np.linalg.pinv(self.system.A.toarray()))

    def priced(self, prices: Prices, given: Floats | None = None) -> SlidingAnswer:
        """Programme A; with (q, 3) `given` displacements of the points, which are not priced, beside those of dq."""
        linear = np.zeros((self.system.points, 3)) if given is None else given.copy()
        linear[:, 0] += prices.normal
        answer, f = self._forces(self.root, linear, prices.slide, stiff=prices.stiff)
        return SlidingAnswer(answer.word, f, answer.z[: len(self.system.p)].copy())

    def forces(self, cell: Cell) -> tuple[Word, Floats, Floats | None]:
        """Forces of the cell that do the least work.

        Returns
        -------
        word : {"solved", "infeasible", "failed"}
        f : (q, 3)
        y : (6 m,) multiplier of equilibrium or proof of infeasibility, with p.y = 1; None if there is none
        """
        unit = np.tile([1.0, 0.0, 0.0], (self.system.points, 1))
        answer, f = self._forces(cell, unit, np.maximum(self.bounds.beta, cell.lo))
        y = answer.z[: len(self.system.p)]
        power = float(self.system.p @ y)
        usable = answer.word != "failed" and power > 0.0
        return answer.word, f, y / power if usable else None

    def balance(self, cell: Cell) -> tuple[Word, Floats, Floats | None]:
        """Forces of the cell that miss balance by the least; as `forces`, but it always has an answer."""
        m, on = len(self.system.p), np.flatnonzero(cell.status != UNLOADED)
        mu = cell.friction(self.system, self.bounds)
        rough = np.flatnonzero(mu[on] > 0.0)
        first = 3 * len(on) + len(rough)
        rows = self._force_rows(cell, on, rough, first + 2 * m)
        rows.slacken(np.arange(m), first, 1.0)
        rows.slacken(np.arange(m), first + m, -1.0)
        self._add_sizes(rows, len(on), rough)
        cost = np.concatenate([np.full(len(on), FAINT), np.zeros(first - len(on)), np.ones(2 * m)])
        answer = self._solve(rows.program(cost))
        f = np.zeros((self.system.points, 3))
        f[on] = answer.x[: 3 * len(on)].reshape(3, -1).T
        f[mu <= 0.0, 1:] = 0.0
        y = answer.z[:m]
        power = float(self.system.p @ y)
        if answer.word != "solved" or not (answer.x[first:].sum() > MISSED and power > 0.0):
            return answer.word, f, None
        return "infeasible", f, y / power

    def opening(self) -> Floats | None:
        """Open every joint, dn >= mu |dd_t| + 1, at the least work against the loads; None: no motion does."""
        q, k = self.system.points, np.arange(self.system.points)
        rows, sides, one = _Rows(len(self.system.p)), np.zeros((q, 3)), np.array([1.0, 0.0, 0.0])
        sides[:, 0] = -1.0
        row, column, value = self._dotted(k, np.tile(-one, (q, 1)))
        mu = self.system.mu[self._point] * (self._axis > 0)
        along = (3 * self._point + self._axis, self._row, -mu * self._value)
        rows.add("second-order", sides.ravel(), (3 * row, column, value), along)
        answer = self._solve(rows.program(-self.system.p))
        return answer.x if answer.word == "solved" else None

    def fitted_forces(self, gap: Floats, cell: Cell | None = None) -> tuple[Word, Floats]:
        """Forces with the least merit against the (q, 3) gaps of a motion."""
        linear = gap.copy()
        linear[:, 0] = np.maximum(gap[:, 0] + 1.0, 0.0) + 1e-6  # a little more than it is worth: no idle compression
        answer, f = self._forces(cell or self.root, linear, np.hypot(gap[:, 1], gap[:, 2]), against=gap)
        return answer.word, f

    def motions(self, cell: Cell, any_work: bool = False) -> tuple[Word, Floats, Floats | None]:
        """Motions of the cell that do the most work; or `any_work`, where it has none those that miss it by the least.

        Returns
        -------
        word : {"solved", "infeasible", "failed"}
        dq : (6 m,)
        w : (q, 3) multipliers with A w = p to rounding (A w = 0 where infeasible); None if there are none
        """
        system = self.system
        m, shut = len(system.p), int(np.sum(cell.status == ENGAGED))
        edges = 3 * int(np.sum(cell.sector))
        rows, faces = self._motion_rows(cell, m + any_work * (2 * shut + edges))
        if any_work:
            rows.slacken(np.arange(shut), m, 1.0)
            rows.slacken(np.arange(shut), m + shut, -1.0)
            rows.slacken(2 * system.points - shut + np.arange(edges), m + 2 * shut, -1.0)
        radius = np.zeros((system.points, 3))
        radius[:, 0] = cell.hi
        rows.add("second-order", radius.ravel(), self._discs())
        cost = np.concatenate([-system.p * (not any_work), np.ones(rows.columns - m)])
        answer = self._solve(rows.program(cost))
        if answer.word == "failed":
            return answer.word, answer.x[:m], None
        word = "infeasible" if answer.x[m:].sum() > MISSED else answer.word
        w, row = np.zeros((system.points, 3)), 0
        for points, direction in faces:
            np.add.at(w, points, direction * answer.z[row : row + len(points), None])
            row += len(points)
        w[:, 1:] -= answer.z[-3 * system.points :].reshape(-1, 3)[:, 1:]
        target = system.p if word == "solved" and not any_work else np.zeros(m)
        for _ in range(2):
            w = w + (self.lift @ (target - system.A @ w.ravel())).reshape(-1, 3)
        return word, answer.x[:m], w

    def fitted_motions(self, force: Floats, cell: Cell | None = None) -> tuple[Word, Floats]:
        """Motions with the least merit against (q, 3) forces."""
        cell = cell or self.root
        q, m = self.system.points, len(self.system.p)
        k, tangent = np.arange(q), np.hypot(force[:, 1], force[:, 2])
        T = np.flatnonzero(tangent > FAINT)
        slide, late = m + k, m + q + np.arange(len(T))
        rows = self._motion_rows(cell, m + q + len(T))[0]
        along = force[T] * [0.0, 1.0, 1.0]
        rows.add("nonnegative", -2.0 * self.bounds.beta * tangent[T], self._dotted(T, along), (k[: len(T)], late, -1.0))
        rows.add("nonnegative", np.zeros(len(T)), (k[: len(T)], late, -1.0))
        rows.add("nonnegative", cell.hi, (k, slide, 1.0))
        rows.add("second-order", np.zeros(3 * q), (3 * k, slide, -1.0), self._discs())
        pull = self.system.A @ np.column_stack([np.maximum(force[:, 0], 0.0), force[:, 1:]]).ravel()
        answer = self._solve(rows.program(np.concatenate([pull, tangent + 1e-7, np.ones(len(T))])))  # no idle sliding
        return answer.word, answer.x[:m].copy()

    def fitted(self, f: Floats) -> Iterator[tuple[Floats, Floats]]:
        """Motion and forces fitted to each other in turn, from (q, 3) forces, for as long as that works."""
        while True:
            word, dq = self.fitted_motions(f)
            if word == "solved":
                word, f = self.fitted_forces(self.system.gap(dq))
            if word != "solved":
                return
            yield f, dq

    def _forces(
        self, cell: Cell, linear: Floats, slide: Any, against: Floats | None = None, stiff: Floats | None = None
    ) -> tuple[_Answer, Floats]:
        """Forces of the cell with the least linear.f + slide |f_t| + 1/2 stiff |f_t|^2.

        And of max(0, 2 beta_min |f_t| + f_t.dd_t), where (q, 3) dd is given to rub `against`.
        """
        q = self.system.points
        on, mu = np.flatnonzero(cell.status != UNLOADED), cell.friction(self.system, self.bounds)
        rough = np.flatnonzero(mu[on] > 0.0)
        n, rub = len(on), len(rough)
        fn, i = np.arange(n), np.arange(rub)
        fu, fv, r, late = n + fn, 2 * n + fn, 3 * n + i, 3 * n + rub + i
        rows = self._force_rows(cell, on, rough, 3 * n + rub * (1 if against is None else 2))
        if against is not None:
            d = against[on[rough]]
            lag = (i, r, 2.0 * self.bounds.beta), (i, fu[rough], d[:, 1]), (i, fv[rough], d[:, 2])
            rows.add("nonnegative", np.zeros(2 * rub), *lag, (i, late, -1.0), (rub + i, late, -1.0))
        self._add_sizes(rows, n, rough)
        cost = np.ones(rows.columns)
        linear = np.where((mu > 0.0)[:, None], linear, linear * [1.0, 0.0, 0.0])  # what is not there costs nothing
        cost[: 3 * n], cost[3 * n : 3 * n + rub] = linear[on].T.ravel(), np.broadcast_to(slide, q)[on[rough]]
        curvature = None if stiff is None else np.concatenate([np.zeros(n), stiff[on], stiff[on], np.zeros(rub)])
        answer = self._solve(rows.program(cost, curvature), FINE if stiff is None else SHARP)
        f = np.zeros((q, 3))
        if answer.word == "solved":
            f[on] = answer.x[: 3 * n].reshape(3, -1).T
            f[mu <= 0.0, 1:] = 0.0
        return answer, f

    @staticmethod
    def _add_sizes(rows: _Rows, n: int, rough: Ints) -> None:
        """Sizes r >= |f_t| at points that are rough."""
        i = np.arange(len(rough))
        size = (3 * i, 3 * n + i, -1.0), (3 * i + 1, n + rough, -1.0), (3 * i + 2, 2 * n + rough, -1.0)
        rows.add("second-order", np.zeros(3 * len(rough)), *size)

    def _force_rows(self, cell: Cell, on: Ints, rough: Ints, columns: int) -> _Rows:
        """Balance, friction and sectors, in fn, fu and fv of the points `on` and r >= |f_t| of those that are rough."""
        friction = cell.friction(self.system, self.bounds)
        n, mu, place = len(on), friction[on], np.full(self.system.points, -1)
        place[on] = np.arange(n)
        at = place[self._point]
        used = (at >= 0) & ((self._axis == 0) | (friction[self._point] > 0.0))
        rows, i, smooth = _Rows(columns), np.arange(len(rough)), np.flatnonzero(mu <= 0.0)
        rows.add("zero", -self.system.p, (self._row[used], self._axis[used] * n + at[used], self._value[used]))
        rows.add("nonnegative", np.zeros(len(rough)), (i, rough, -mu[rough]), (i, 3 * n + i, 1.0))
        rows.add("nonnegative", np.zeros(len(smooth)), (np.arange(len(smooth)), smooth, -1.0))
        split = np.flatnonzero(cell.sector[on])
        if len(split):  # -f_t lies between the rays
            a, b, k = cell.ray_a[on[split]], cell.ray_b[on[split]], np.arange(len(split))
            rows.add("nonnegative", np.zeros(len(split)), (k, n + split, -a[:, 1]), (k, 2 * n + split, a[:, 0]))
            rows.add("nonnegative", np.zeros(len(split)), (k, n + split, b[:, 1]), (k, 2 * n + split, -b[:, 0]))
        return rows

    def _motion_rows(self, cell: Cell, columns: int) -> tuple[_Rows, list[tuple[Ints, Floats]]]:
        """Flat faces of the cell of motions: as rows, and as (points, direction in (n, u, v)) of each group of rows."""
        pressed, loose = np.flatnonzero(cell.status == ENGAGED), np.flatnonzero(cell.status != ENGAGED)
        split = np.flatnonzero(cell.sector)
        a, b = cell.ray_a[split], cell.ray_b[split]
        middle = a + b
        middle = middle / np.linalg.norm(middle, axis=1)[:, None]
        chord = cell.lo[split] * np.maximum(np.sum(middle * a, axis=1), 0.0)
        ones, zero, up = np.ones(len(loose)), np.zeros(len(split)), np.array([1.0, 0.0, 0.0])
        plan: list[tuple[Literal["zero", "nonnegative"], Ints, Floats, Floats]] = [
            ("zero", pressed, np.tile(up, (len(pressed), 1)), -np.ones(len(pressed))),
            ("nonnegative", loose, np.tile(-up, (len(loose), 1)), ones),
            ("nonnegative", loose, np.tile(up, (len(loose), 1)), self.bounds.eta * ones),
            ("nonnegative", split, np.column_stack([zero, a[:, 1], -a[:, 0]]), zero),
            ("nonnegative", split, np.column_stack([zero, -b[:, 1], b[:, 0]]), zero),
            ("nonnegative", split, np.column_stack([zero, -middle]), -chord),
        ]
        rows = _Rows(columns)
        for kind, points, direction, rhs in plan:
            rows.add(kind, rhs, self._dotted(points, direction))
        return rows, [(points, direction) for _, points, direction, _ in plan]

    def _dotted(self, points: Ints, direction: Floats) -> Entries:
        """Rows direction.dd of (k,) points, in dq."""
        place = np.full(self.system.points, -1)
        place[points] = np.arange(len(points))
        at = place[self._point]
        used = at >= 0
        return at[used], self._row[used], direction[at[used], self._axis[used]] * self._value[used]

    def _discs(self) -> Entries:
        """-dd_t of all points, in dq: the last two rows of a second-order cone each."""
        used = self._axis > 0
        return (3 * self._point + self._axis)[used], self._row[used], -self._value[used]

    def _solve(self, program: ConicProgram, optimal: float = FINE) -> _Answer:
        settings: dict[str, Any] = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), optimal)
        settings |= dict.fromkeys(("tol_infeas_abs", "tol_infeas_rel"), CERTAIN)
        settings["time_limit"] = max(self.deadline - time.perf_counter(), 1e-3)
        settings["direct_solve_method"] = "faer" if self.system.blocks > BIG else "qdldl"
        word, _, x, z, iterations = SOLVERS["clarabel"](program, settings)  # what comes of it is measured, not believed
        self.solves += 1
        self.iterations += iterations
        sound = bool(np.isfinite(x).all() and np.isfinite(z).all())
        return _Answer(word if sound else "failed", x if sound else 0.0 * program.q, z if sound else 0.0 * program.b)
