"""Route B to a coupled state: biconvex descent, forces and motion in turn.

The merit

    sum  fn (dn + 1) + (|f_t| |dd_t| + f_t . dd_t) + max(0, 2 beta_min |f_t| + f_t . dd_t)

is convex in the forces for a fixed motion and in the motion for fixed forces, never negative where f lies in its cones
and dn >= -1, and zero only at a coupled state. Each half is one conic programme, so the merit can only fall; a polish
takes over near zero. Seeds are the sliding programmes at several compliances, with the displacement held within eta.
"""

import time
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.coupled.polish import Attempt, attempt, better, nothing, polish, total_merit
from cyclopean.analysis.coupled.sliding import SlidingProgram, tolerances
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.arrays import Floats
from cyclopean.solvers import ConicAnswer, ConicProgram, solve
from cyclopean.statics import EquilibriumSystem

__all__ = ["Halves", "alternate", "alternation"]

COMPLIANCES = (0.1, 5.0, 0.0)  # of the seeds
NEAR = 0.05  # merit from which a polish is worth its time
STALLED = 0.97  # share of the merit three rounds ago that counts as no progress
OPTIMAL = 1e-9
FAINT = 1e-9  # friction that counts as none
FICTITIOUS = 1e-6  # ... and fictitious forces
SHARE = 0.4  # of the time left that one seed may take


class Halves:
    """The two convex halves of one system: rows are laid out once, prices change."""

    def __init__(self, system: EquilibriumSystem, bounds: Bounds, deadline: float = np.inf) -> None:
        self.system, self.bounds, self.deadline, self.solves, self.iterations = system, bounds, deadline, 0, 0
        q = system.points
        points, rough = np.arange(q), np.flatnonzero(system.mu > 0.0)
        self.rough = rough
        # forces: (fn, fu, fv) of every point, r >= |f_t| and the slack of beta_min where there is friction
        rub = len(rough)
        size = 3 * q + 2 * rub
        keep = np.ones((q, 3))
        keep[system.mu <= 0.0, 1:] = 0.0
        balance = sp.hstack([system.A @ sp.diags(keep.ravel()), sp.csr_matrix((len(system.p), 2 * rub))])
        smooth = np.flatnonzero(system.mu <= 0.0)
        head = 3 * q + np.arange(rub)
        self.force_rows = (
            balance,
            _place(3 * smooth, -1.0, size),
            _place(head, 1.0, size) - _place(3 * rough, system.mu[rough], size),
            _place(head + rub, -1.0, size),
        )
        self.force_cones = _place(np.stack([head, 3 * rough + 1, 3 * rough + 2], 1).ravel(), -1.0, size)
        # motion: dq, m >= |dd_t| of every point, the slack of beta_min where friction acts (added per solve)
        gaps = system.A.T.tocsr()
        self.n, self.u, self.v = gaps[0::3], gaps[1::3], gaps[2::3]
        dofs = len(system.p)
        none, unit = sp.csr_matrix((q, q)), sp.identity(q, format="csr")
        self.motion_rows = sp.bmat([[-self.n, none], [self.n, none], [None, unit]], format="csr")
        self.motion_limits = np.concatenate([np.ones(q), np.full(2 * q, bounds.eta)])
        stacked = sp.bmat([[None, -unit], [-self.u, none], [-self.v, none]], format="csr")
        self.motion_cones = stacked[(points[:, None] + q * np.arange(3)).ravel()]
        self.dofs = dofs

    def forces(self, dq: Floats) -> Floats | None:
        """The (q, 3) forces of least merit for this motion; None if the solver fails."""
        system, q, rough = self.system, self.system.points, self.rough
        rub = len(rough)
        d = system.gap(dq)
        slide = np.hypot(d[:, 1], d[:, 2])
        cost = np.zeros(3 * q + 2 * rub)
        cost[0 : 3 * q : 3] = np.maximum(d[:, 0] + 1.0, 0.0) + 1e-6
        cost[3 * rough + 1], cost[3 * rough + 2] = d[rough, 1], d[rough, 2]
        cost[3 * q : 3 * q + rub], cost[3 * q + rub :] = slide[rough], 1.0
        k = np.arange(rub)
        column = np.concatenate([3 * q + k, 3 * rough + 1, 3 * rough + 2, 3 * q + rub + k])
        value = np.concatenate([np.full(rub, 2 * self.bounds.beta), d[rough, 1], d[rough, 2], np.full(rub, -1.0)])
        backwards = sp.csr_matrix((value, (np.tile(k, 4), column)), shape=(rub, len(cost)))
        inequalities = sp.vstack([*self.force_rows[1:], backwards])
        A = sp.vstack([self.force_rows[0], inequalities, self.force_cones], format="csc")
        b = np.zeros(A.shape[0])
        b[: len(system.p)] = -system.p
        cones = (
            ("zero", len(system.p), 1),
            ("nonnegative", inequalities.shape[0], 1),
            ("second-order", 3, rub),
        )
        answer = self._solved(ConicProgram(sp.csc_matrix((len(cost), len(cost))), cost, A, b, cones))  # type: ignore[arg-type]
        if answer is None:
            return None
        f = answer.x[: 3 * q].reshape(-1, 3).copy()
        f[system.mu <= 0.0, 1:] = 0.0
        return f

    def motion(self, f: Floats) -> Floats | None:
        """The (6 m,) displacement of least merit for these forces; None if the solver fails."""
        q = self.system.points
        tangent = np.hypot(f[:, 1], f[:, 2])
        T = np.flatnonzero(tangent > FAINT)
        cost = np.zeros(self.dofs + q + len(T))
        normal = np.maximum(f[:, 0], 0.0) + 1e-6
        cost[: self.dofs] = self.n.T @ normal + self.u.T @ f[:, 1] + self.v.T @ f[:, 2]
        cost[self.dofs : self.dofs + q], cost[self.dofs + q :] = tangent + 1e-7, 1.0
        along = sp.diags(f[T, 1]) @ self.u[T] + sp.diags(f[T, 2]) @ self.v[T]
        slack = sp.identity(len(T), format="csr")
        rows = sp.bmat(
            [
                [self.motion_rows, sp.csr_matrix((3 * q, len(T)))],
                [sp.hstack([along, sp.csr_matrix((len(T), q))]), -slack],
                [sp.csr_matrix((len(T), self.dofs + q)), -slack],
                [self.motion_cones, sp.csr_matrix((3 * q, len(T)))],
            ],
            format="csc",
        )
        b = np.concatenate(
            [self.motion_limits, -2.0 * self.bounds.beta * tangent[T], np.zeros(len(T)), np.zeros(3 * q)]
        )
        cones = (("nonnegative", 3 * q + 2 * len(T), 1), ("second-order", 3, q))
        answer = self._solved(ConicProgram(sp.csc_matrix((len(cost), len(cost))), cost, rows, b, cones))  # type: ignore[arg-type]
        return None if answer is None else answer.x[: self.dofs].copy()

    def _solved(self, program: ConicProgram) -> ConicAnswer | None:
        answer = solve(program, **tolerances(self.system.blocks, OPTIMAL, self.deadline))
        self.solves += 1
        self.iterations += answer.iterations
        return answer if answer.word == "solved" else None


def alternate(
    halves: Halves, f: Floats, best: Attempt, rounds: int = 40, deadline: float = np.inf
) -> tuple[Attempt, int]:
    """Descend from the forces f until the polish accepts a state, the merit stalls or time is up.

    Returns
    -------
    best : Attempt
        The best triple met, the given one included.
    rounds : int
        How many were done.
    """
    system, bounds = halves.system, halves.bounds
    history: list[float] = []
    polished = NEAR
    for done in range(1, rounds + 1):
        dq = halves.motion(f)
        if dq is None:
            return best, done
        best, polished = _considered(system, bounds, best, polished, f, dq)
        if best.found:
            return best, done
        pressed = halves.forces(dq)
        if pressed is None:
            return best, done
        f = pressed
        best, polished = _considered(system, bounds, best, polished, f, dq)
        if best.found or time.perf_counter() > deadline:
            return best, done
        history.append(total_merit(system, bounds, f, dq))
        if len(history) > 3 and history[-1] > STALLED * history[-4]:
            return best, done
    return best, rounds


def alternation(
    system: EquilibriumSystem, bounds: Bounds, given: Iterable[Floats] = (), deadline: float = np.inf
) -> Attempt:
    """Alternate from every seed until one leads to a state.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    bounds : Bounds
        With eps = 1.
    given : iterable of (q, 3)
        Forces in equilibrium to start from as well.
    deadline : float
        Of `time.perf_counter`.
    """
    halves = Halves(system, bounds, deadline)
    best, rounds, seeds = nothing(system, bounds), 0, 0
    for f in _seeds(system, bounds, given, deadline):
        seeds += 1
        now = time.perf_counter()
        best, done = alternate(halves, f, best, deadline=now + SHARE * max(deadline - now, 0.0))
        rounds += done
        if best.found or time.perf_counter() > deadline:
            break
    return replace(best, solves=halves.solves + seeds, rounds=rounds, iterations=halves.iterations)


def _considered(
    system: EquilibriumSystem, bounds: Bounds, best: Attempt, polished: float, f: Floats, dq: Floats
) -> tuple[Attempt, float]:
    """The best triple now, and the merit from which the next polish is worth its time: half of this one's."""
    here = attempt(system, bounds, f, dq)
    best = better(best, here)
    if best.found or not (here.merit < polished):
        return best, polished
    return better(best, attempt(system, bounds, *polish(system, bounds, f, dq)[:2])), 0.5 * here.merit


def _seeds(system: EquilibriumSystem, bounds: Bounds, given: Iterable[Floats], deadline: float) -> Iterator[Floats]:
    """Forces to start from: within eta at several compliances, and those of least compression whatever they move."""
    within = SlidingProgram(system, 2.0 * bounds.beta, eta=bounds.eta)
    zero = np.zeros(system.points)
    for k, compliance in enumerate(COMPLIANCES):
        answer = within.solve(zero, zero + compliance, deadline=deadline)
        if answer.word == "solved" and answer.fictitious < FICTITIOUS:
            yield answer.f
        if k == 0:
            yield from given
    answer = SlidingProgram(system, bounds.beta).solve(zero, zero, deadline=deadline)
    if answer.word == "solved":
        yield answer.f


def _place(column: np.ndarray, value: float | Floats, size: int) -> sp.csr_matrix:
    """One row for every column named, holding `value` there."""
    count = len(column)
    return sp.csr_matrix((np.broadcast_to(value, count), (np.arange(count), column)), shape=(count, size))
