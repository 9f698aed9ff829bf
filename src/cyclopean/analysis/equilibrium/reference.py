"""Rigid-block equilibrium as one conic programme: the reference every fast path is tested against."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.solvers import Cone as ConeKind
from cyclopean.solvers import ConicAnswer, ConicProgram, solve
from cyclopean.statics import EquilibriumSystem, pyramid_rows

__all__ = [
    "Cone",
    "conic_options",
    "dual_rows",
    "force_rows",
    "mechanism_program",
    "parse_cone",
    "penalty_program",
    "rbe_program",
    "solve_program",
]

BIG = 1000  # blocks above which Clarabel's `faer` factorisation beats its `qdldl`
TOLERANCES = (1e-10, 1e-8), (1e-8, 1e-6)  # of an optimum, and of a proof that there is none, one after the other


@dataclass(frozen=True, slots=True)
class Cone:
    """Which friction cone: exact, or a pyramid of `faces` faces."""

    kind: str = "exact"  # "exact", "inscribed", "circumscribed"
    faces: int = 0


def parse_cone(text: str) -> Cone:
    """Read `exact`, `inscribed:K` or `circumscribed:K`, K >= 3.

    Examples
    --------
    >>> parse_cone("inscribed:8")
    Cone(kind='inscribed', faces=8)
    """
    kind, _, faces = text.partition(":")
    if kind == "exact" and not faces:
        return Cone()
    if kind in ("inscribed", "circumscribed") and faces.isdecimal() and 3 <= int(faces) <= 360:
        return Cone(kind, int(faces))
    raise InputError.of("cone", text, "expected exact, inscribed:K or circumscribed:K with K from 3 to 360")


def rbe_program(system: EquilibriumSystem, cone: Cone, weights: Floats | None = None) -> ConicProgram:
    """Min 1/2 f'Hf subject to A f = -p and every f_k in its cone; H = diag(weights), default identity.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled, q points.
    cone : Cone
        Exact or a pyramid.
    weights : (3 q,), optional
        Diagonal of H.
    """
    q = system.points
    H = sp.diags(np.ones(3 * q) if weights is None else weights, format="csc")
    rows, kinds = force_rows(system, cone)
    A = sp.vstack([system.A, rows], format="csc")
    b = np.concatenate([-system.p, np.zeros(rows.shape[0])])
    return ConicProgram(H, np.zeros(3 * q), A, b, (("zero", len(system.p), 1), *kinds))


def penalty_program(system: EquilibriumSystem, gamma: float = 1e6) -> ConicProgram:
    """The variant that measures tension: fn = fn+ - fn-, friction on fn+ alone, fn- priced at `gamma`.

    Unknowns (fn+, fu, fv) of every point, then fn- of every point. With friction on fn+ - fn- the cone would forbid
    tension altogether; this way the programme stays solvable and its fn- show where a model would need glue.
    """
    q = system.points
    H = sp.diags(np.concatenate([np.ones(3 * q), np.full(q, gamma)]), format="csc")
    rows, kinds = force_rows(system, Cone())
    pull = system.A.tocsc()[:, 0 : 3 * q : 3]
    A = sp.bmat([[system.A, -pull], [rows, None], [None, -sp.identity(q)]], format="csc")
    b = np.concatenate([-system.p, np.zeros(rows.shape[0] + q)])
    return ConicProgram(H, np.zeros(4 * q), A, b, (("zero", len(system.p), 1), *kinds, ("nonnegative", q, 1)))


def mechanism_program(system: EquilibriumSystem) -> ConicProgram:
    """Max t subject to ||y|| <= 1, p'y >= t and every A'y at least t inside {dn >= mu |d_t|}; unknowns (y, t).

    With t > 0 the y is a mechanism with room to spare, so that rounding cannot spoil its certificate. It decides models
    so near their limit that the force side alone is inconclusive. (Where some joints must stay shut, t is 0.)
    """
    q, n = system.points, len(system.p)
    opening = sp.hstack([dual_rows(system, 0.0)[0], np.tile([[1.0], [0.0], [0.0]], (q, 1))])
    power = sp.hstack([sp.csr_matrix(-system.p[None, :]), [[1.0]]])
    ball = sp.vstack([sp.csr_matrix((1, n + 1)), sp.hstack([-sp.identity(n), sp.csr_matrix((n, 1))])])
    A = sp.vstack([power, opening, ball], format="csc")
    b = np.zeros(A.shape[0])
    b[1 + 3 * q] = 1.0
    cones: tuple[ConeKind, ...] = (("nonnegative", 1, 1), ("second-order", 3, q), ("second-order", n + 1, 1))
    return ConicProgram(sp.csc_matrix((n + 1, n + 1)), np.append(np.zeros(n), -1.0), A, b, cones)


def solve_program(program: ConicProgram, blocks: int) -> ConicAnswer:
    """Solve by Clarabel, at first with tolerances two decades below what a certificate asks for, then with its own.

    The second attempt is for models so near their limit that the first gives up; what it finds is mended and checked
    like everything else.
    """
    for optimal, infeasible in TOLERANCES:
        loose: dict[str, Any] = dict.fromkeys(("tol_infeas_abs", "tol_infeas_rel"), infeasible)
        answer = solve(program, **conic_options(blocks, optimal), **loose)
        if answer.word != "failed":
            break
    return answer


def conic_options(blocks: int, tolerance: float) -> dict[str, Any]:
    """Clarabel's settings for a programme of a model of so many free blocks, to a tolerance of its optimum."""
    tolerances = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), tolerance)
    return {"direct_solve_method": "faer" if blocks > BIG else "qdldl", "max_iter": 200, **tolerances}


def dual_rows(system: EquilibriumSystem, delta: float) -> tuple[Any, tuple[Any, ...], Floats]:
    """Rows, cones and right-hand side that keep every dd = A'y at least `delta` inside K* = {dn >= mu |d_t|}."""
    q = system.points
    stretch = np.ones((q, 3))
    stretch[:, 1:] = system.mu[:, None]
    rows = sp.diags(-stretch.ravel()) @ system.A.T
    return rows, (("second-order", 3, q),), np.tile([-delta, 0.0, 0.0], q)


def force_rows(system: EquilibriumSystem, cone: Cone) -> tuple[Any, tuple[Any, ...]]:
    """Rows and cones that keep forces inside friction cones; where there is none fn >= 0 and f_t = 0."""
    q = system.points
    if cone.kind == "exact":
        stretch = np.ones((q, 3))
        stretch[:, 0] = system.mu
        rows = sp.diags(-stretch.ravel(), format="csr")
        if system.mu.all():
            return rows.tocsc(), (("second-order", 3, q),)
        rough, smooth = np.flatnonzero(system.mu), 3 * np.flatnonzero(system.mu == 0.0)  # there fn >= 0 and ft = 0
        upright = sp.csr_matrix((-np.ones(len(smooth)), (np.arange(len(smooth)), smooth)), shape=(len(smooth), 3 * q))
        across = rows[(smooth[:, None] + [1, 2]).ravel()]
        cones = rows[(3 * rough[:, None] + np.arange(3)).ravel()]
        kinds = (("zero", 2 * len(smooth), 1), ("nonnegative", len(smooth), 1), ("second-order", 3, len(rough)))
        return sp.vstack([across, upright, cones], format="csc"), tuple(kind for kind in kinds if kind[1] * kind[2])
    faces = pyramid_rows(system.mu, cone.faces, cone.kind == "inscribed")
    upright = sp.csc_matrix((-np.ones(q), (np.arange(q), 3 * np.arange(q))), shape=(q, 3 * q))
    return sp.vstack([faces, upright], format="csc"), (("nonnegative", cone.faces * q + q, 1),)
