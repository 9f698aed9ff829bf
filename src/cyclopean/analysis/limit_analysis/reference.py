"""Limit analysis as one second-order cone programme: reference and fallback of the fast path."""

from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.equilibrium.reference import BIG, Cone, force_rows, solve_program
from cyclopean.analysis.limit_analysis.interior import LimitPoint
from cyclopean.analysis.limit_analysis.load_family import Pencil
from cyclopean.solvers import ConicProgram, solve

__all__ = ["limit_by_clarabel", "limit_program"]

CLOSE = 1e-9  # tolerance of the one attempt that a deadline leaves


def limit_program(loads: Pencil) -> ConicProgram:
    """Max s subject to A f + s q = -p0, f in K; unknowns (f, s). Its multipliers of equilibrium are the mechanism."""
    system, q = loads.system, loads.system.points
    rows, kinds = force_rows(system, Cone())
    A = sp.bmat([[system.A, loads.q[:, None]], [rows, None]], format="csc")
    b = np.concatenate([-system.p, np.zeros(rows.shape[0])])
    cost = np.append(np.zeros(3 * q), -1.0)
    return ConicProgram(sp.csc_matrix((3 * q + 1, 3 * q + 1)), cost, A, b, (("zero", len(system.p), 1), *kinds))


def limit_by_clarabel(loads: Pencil, seconds: float = np.inf) -> LimitPoint:
    """Solve by Clarabel; the word is ours to check. With a deadline it has one attempt, as far as that gets."""
    system = loads.system
    if seconds < np.inf:
        options: dict[str, Any] = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), CLOSE)
        options["direct_solve_method"] = "faer" if system.blocks > BIG else "qdldl"
        answer = solve(limit_program(loads), max_iter=200, time_limit=seconds, **options)
    else:
        answer = solve_program(limit_program(loads), system.blocks)
    f, s, y = answer.x[:-1].reshape(-1, 3), float(answer.x[-1]), answer.z[: len(system.p)]
    if answer.word == "infeasible":
        power = float(system.p @ y)
        word = "infeasible" if power > 0.0 else "unfinished"
        return LimitPoint(word, f, s, y / power if power > 0.0 else y, np.inf, np.inf, answer.iterations)  # type: ignore[arg-type]
    if "DualInfeasible" in answer.status and s > 0.0:
        return LimitPoint("unbounded", f / s, 1.0, y, np.inf, np.inf, answer.iterations)
    residual = float(np.max(np.abs(system.A @ f.ravel() + loads.loads(s)), initial=0.0))
    gap = abs(s + float(system.p @ y)) / (1e-6 + abs(s))
    word = "solved" if answer.word == "solved" else "unfinished"
    return LimitPoint(word, f, s, y, residual, gap, answer.iterations)  # type: ignore[arg-type]
