"""The two convex halves of coupled rigid-block analysis as quadratic programmes with linear constraints (OSQP).

Where a first-order method is to do the work, both halves of the biconvex descent (`alternation`) are better posed as
least squares, for operator splitting is slow on linear programmes and pyramids in place of norms leave a merit of 2 %.

Motion for fixed forces, after the certificate search of the chapter that this project began from, with b_k >= 0 the
sliding against friction and every row weighted by the force that it concerns:

    min  1/2 sum (fn / f0) (dn + 1)^2 + 1/2 sum (|f_t| / f0) |dd_t + b f_t / |f_t||^2 + 1/2 small |dq|^2
    s.t. -1 <= dn <= eta,  |du|, |dv| <= eta / sqrt 2,  b >= 2 beta_min

Forces for a fixed motion, with r_k >= 0 the friction against the sliding direction e = dd_t / |dd_t|:

    min  sum fn (dn + 1) + 1/2 sum |f_t + r e|^2 + 1/2 small |f|^2      s.t.  A f = -p,  f in inscribed pyramids

Both are zero (but for the small terms) at a coupled state, and what they find is polished and measured like all else.
"""

import time

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.coupled.polish import Attempt, attempt, better, nothing, polish
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.analysis.equilibrium.rbe import solve_rbe
from cyclopean.arrays import Floats
from cyclopean.solvers import ConicProgram, solve
from cyclopean.statics import EquilibriumSystem, pyramid_rows

__all__ = ["alternate_qp", "forces_qp", "motion_qp"]

FACES = 32  # of the inscribed pyramids: 0.5 % of friction off
SMALL = 1e-6  # weight of what only picks one answer among equals
FAINT = 1e-9  # friction that counts as none
NEAR = 0.3  # largest mismatch of a point, weighted by its force, from which a polish is worth its time
LOOSE = {"eps_abs": 1e-6, "eps_rel": 1e-6, "max_iter": 4000}  # what a polish needs


def motion_qp(
    system: EquilibriumSystem,
    bounds: Bounds,
    f: Floats,
    start: tuple[Floats, Floats] | None = None,
    deadline: float = np.inf,
) -> tuple[Floats, tuple[Floats, Floats]] | None:
    """The (6 m,) displacement that fits (q, 3) forces best, and (x, z) to begin the next one at; None if OSQP fails.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    bounds : Bounds
        With eps = 1.
    f : (q, 3)
        Forces.
    start : (x, z), optional
        Of a former solution; its sizes have to fit.
    deadline : float
        Of `time.perf_counter`.
    """
    q, dofs = system.points, len(system.p)
    gaps = system.A.T.tocsr()
    n, u, v = gaps[0::3], gaps[1::3], gaps[2::3]
    tangent = np.hypot(f[:, 1], f[:, 2])
    rubbing = tangent > FAINT
    e = np.where(rubbing[:, None], f[:, 1:] / np.maximum(tangent, FAINT)[:, None], 0.0)
    top = max(float(np.max(f[:, 0], initial=0.0)), FAINT)
    press, rub = sp.diags(np.maximum(f[:, 0], 0.0) / top), sp.diags(tangent / top)
    along = [sp.hstack([d, sp.diags(e[:, k])]).tocsr() for k, d in enumerate((u, v))]
    shut = sp.hstack([n, sp.csr_matrix((q, q))]).tocsr()
    size = dofs + q
    P = shut.T @ press @ shut + along[0].T @ rub @ along[0] + along[1].T @ rub @ along[1] + SMALL * sp.identity(size)
    cost = np.asarray(shut.T @ press.diagonal())
    back = sp.hstack([sp.csr_matrix((q, dofs)), -sp.identity(q)])
    sides = [sp.hstack([sign * d, sp.csr_matrix((q, q))]) for d in (u, v) for sign in (1.0, -1.0)]
    A = sp.vstack([-shut, shut, *sides, back], format="csc")
    b = np.concatenate(
        [np.ones(q), np.full(q, bounds.eta), np.full(4 * q, bounds.eta / np.sqrt(2.0)), np.full(q, -2.0 * bounds.beta)]
    )
    program = ConicProgram(P, cost, A, b, (("nonnegative", len(b), 1),))
    answer = solve(program, "osqp", _fitting(program, start), **LOOSE, time_limit=_left(deadline))
    if answer.word == "infeasible" or not answer.x.any():
        return None
    return answer.x[:dofs].copy(), (answer.x, answer.z)


def forces_qp(
    system: EquilibriumSystem,
    bounds: Bounds,
    dq: Floats,
    start: tuple[Floats, Floats] | None = None,
    deadline: float = np.inf,
) -> tuple[Floats, tuple[Floats, Floats]] | None:
    """The (q, 3) forces that fit a (6 m,) displacement best, and (x, z) for the next start; None if OSQP fails.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    bounds : Bounds
        With eps = 1.
    dq : (6 m,)
        Displacement.
    start : (x, z), optional
        Of a former solution.
    deadline : float
        Of `time.perf_counter`.
    """
    q = system.points
    d = system.gap(dq)
    slide = np.hypot(d[:, 1], d[:, 2])
    moving = slide >= bounds.beta
    e = np.where(moving[:, None], d[:, 1:] / np.maximum(slide, bounds.beta)[:, None], 0.0)
    place = 3 * np.arange(q)
    misfit = []
    for k in (0, 1):  # rows fu + r eu, fv + r ev
        row = np.concatenate([np.arange(q), np.arange(q)])
        column, value = np.concatenate([place + 1 + k, 3 * q + np.arange(q)]), np.concatenate([np.ones(q), e[:, k]])
        misfit.append(sp.csr_matrix((value, (row, column)), shape=(q, 4 * q)))
    P = misfit[0].T @ misfit[0] + misfit[1].T @ misfit[1] + SMALL * sp.identity(4 * q)
    cost = np.zeros(4 * q)
    cost[place] = np.maximum(d[:, 0] + 1.0, 0.0)
    upright = sp.csr_matrix((-np.ones(q), (np.arange(q), place)), shape=(q, 3 * q))
    friction = sp.vstack([pyramid_rows(system.mu, FACES, True), upright])
    against = sp.hstack([sp.csr_matrix((q, 3 * q)), -sp.identity(q)])
    A = sp.vstack(
        [
            sp.hstack([system.A, sp.csr_matrix((len(system.p), q))]),
            sp.hstack([friction, sp.csr_matrix((friction.shape[0], q))]),
            against,
        ],
        format="csc",
    )
    b = np.concatenate([-system.p, np.zeros(friction.shape[0] + q)])
    program = ConicProgram(P, cost, A, b, (("zero", len(system.p), 1), ("nonnegative", len(b) - len(system.p), 1)))
    answer = solve(program, "osqp", _fitting(program, start), **LOOSE, time_limit=_left(deadline))
    if answer.word == "infeasible" or not answer.x.any():
        return None
    f = answer.x[: 3 * q].reshape(-1, 3).copy()
    f[:, 0] = np.maximum(f[:, 0], 0.0)
    return f, (answer.x, answer.z)


def alternate_qp(
    system: EquilibriumSystem, bounds: Bounds, f: Floats | None = None, rounds: int = 25, deadline: float = np.inf
) -> Attempt:
    """Alternate between both halves until the polish accepts a state; the best triple met.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    bounds : Bounds
        With eps = 1.
    f : (q, 3), optional
        Forces to begin with; those of least norm if not given.
    rounds : int
        Of both halves.
    deadline : float
        Of `time.perf_counter`.

    Raises
    ------
    InputError
        OSQP is not installed.
    """
    best = nothing(system, bounds)
    if best.found or system.points == 0:
        return best
    here = solve_rbe(system, "osqp").f if f is None else f
    moved = pressed = None
    done = 0
    while done < rounds:
        done += 1
        if here is None or time.perf_counter() > deadline:
            break
        found = motion_qp(system, bounds, here, moved, deadline)
        if found is None:
            break
        dq, moved = found
        best = _considered(system, bounds, best, here, dq)
        if best.found or (again := forces_qp(system, bounds, dq, pressed, deadline)) is None:
            break
        here, pressed = again
        best = _considered(system, bounds, best, here, dq)
        if best.found:
            break
    return Attempt(best.f, best.dq, best.residuals, best.merit, best.infeasible, 2 * done, done, 0)


def _considered(system: EquilibriumSystem, bounds: Bounds, best: Attempt, f: Floats, dq: Floats) -> Attempt:
    d = system.gap(dq)
    off = f[:, 0] * np.abs(d[:, 0] + 1.0)
    if not (float(np.max(off, initial=0.0)) < NEAR):
        return best
    return better(best, attempt(system, bounds, *polish(system, bounds, f, dq)[:2]))


def _left(deadline: float) -> float:
    return float(np.clip(deadline - time.perf_counter(), 1e-3, 1e10))


def _fitting(program: ConicProgram, start: tuple[Floats, Floats] | None) -> tuple[Floats, Floats] | None:
    if start is None or len(start[0]) != len(program.q) or len(start[1]) != len(program.b):
        return None
    return start if np.isfinite(start[0]).all() and np.isfinite(start[1]).all() else None
