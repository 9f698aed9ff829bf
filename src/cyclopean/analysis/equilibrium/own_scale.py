"""A system in which every block counts by its own weight and size, however small it is beside the others.

Rows of block i are divided by its weight w_i, those of moments by w_i D_i, D_i the diagonal of its box; forces are
counted in s_k at point k: f_k = s_k g_k. Friction cones have no scale, so the problem is the same, but residuals and
bounds are in own weights. s_k is the weight of the lighter block that touches at k, or what k bore in an answer that is
known: a pin below a boulder bears a thousand times its own weight.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.equilibrium.interior import SMALLEST_MU
from cyclopean.analysis.equilibrium.newton import collapse_bound, sharpen_mechanism
from cyclopean.analysis.equilibrium.rbe import COLLAPSE, PROMISING, attempted
from cyclopean.analysis.equilibrium.reference import Cone, mechanism_program, rbe_program, solve_program
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur, project_cones

__all__ = ["Answer", "answers", "lighter_weight", "own_rows", "own_scaled"]

PATIENT = 30, 80, 12  # caps of the solvers: there is no other scale left


def own_rows(weight: Floats, diagonal: Floats) -> Floats:
    """(6 m,) 1 / w_i and 1 / (w_i D_i) of m blocks."""
    force = np.broadcast_to((1.0 / weight)[:, None], (len(weight), 3))
    return np.concatenate([force, force / diagonal[:, None]], 1).ravel()


def own_scaled(system: EquilibriumSystem, weight: Floats, diagonal: Floats, columns: Floats) -> EquilibriumSystem:
    """R A S g = -R p with f = S g.

    Bounds of the new system are in own weights, for its total is 1. Where there is no friction, the columns of
    tangential forces become zeros and mu 1: states of least norm and mechanisms are the same, and no cone is a ray.

    Parameters
    ----------
    system : EquilibriumSystem
        m blocks, q points.
    weight, diagonal : (m,)
        Own weights and diagonals of the blocks' boxes, in the system's units.
    columns : (q,)
        Scale s of the force at each point.
    """
    rows, smooth = own_rows(weight, diagonal), system.mu == 0.0
    scale = np.repeat(columns[:, None], 3, 1)
    scale[smooth, 1:] = 0.0
    return replace(
        system,
        mu=np.where(smooth, 1.0, system.mu),
        frame=system.frame * scale[:, :, None],
        A=(sp.diags(rows) @ system.A @ sp.diags(scale.ravel())).tocsr(),
        p=rows * system.p,
        size=np.full(system.blocks, 1.0 / max(system.blocks, 1)),
        rows=rows if system.rows is None else rows * system.rows,
    )


def lighter_weight(system: EquilibriumSystem, weight: Floats) -> Floats:
    """(q,) weight of the lighter free block at each point, of (m,) own weights."""
    beside = np.append(weight, np.inf)  # the last for fixed blocks, which are numbered -1
    return np.asarray(np.minimum(beside[system.row_a], beside[system.row_b]))


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """Forces or velocities that a solver ended with, back in the units of the system; nothing is claimed."""

    solver: str
    word: str
    factorisations: int
    f: Floats | None = None  # (q, 3) in their cones
    y: Floats | None = None  # (6 m,)


def answers(system: EquilibriumSystem, scaled: EquilibriumSystem, columns: Floats, schur: Schur) -> Iterator[Answer]:
    """What the solvers come to at every block's own scale, one after the other: quick ones first.

    Parameters
    ----------
    system : EquilibriumSystem
        m blocks, q points.
    scaled : EquilibriumSystem
        The same by `own_scaled`, with these (q,) columns.
    columns : (q,)
        Scale of each point's force.
    schur : Schur
        Of the scaled system.
    """
    rows = np.ones(len(system.p)) if scaled.rows is None else scaled.rows

    def told(name: str, word: str, spent: int, f: Floats | None, y: Floats | None) -> Answer:
        force = None if f is None else columns[:, None] * project_cones(f, system.mu)
        return Answer(name, word, spent, force, None if y is None else rows * y)

    for name in ("newton", "interior"):
        if name == "interior" and scaled.mu.min(initial=np.inf) < SMALLEST_MU:
            continue
        before = schur.factorisations
        found = attempted(name, scaled, schur, caps=PATIENT)
        y = _sharpened(scaled, schur, found.y, PROMISING)
        yield told(name, found.word, schur.factorisations - before, found.f, y)
    conic = solve_program(rbe_program(scaled, Cone()), system.blocks)
    f = conic.x.reshape(-1, 3) if conic.word == "solved" else None
    finite = np.isfinite(conic.z).all()
    yield told(
        "clarabel",
        conic.word,
        conic.iterations,
        f,
        _sharpened(scaled, schur, conic.z[: len(system.p)], 0.0) if finite else None,
    )
    conic = solve_program(mechanism_program(scaled), system.blocks)
    if np.isfinite(conic.x).all():
        yield told("clarabel", conic.status, conic.iterations, None, conic.x[:-1])


def _sharpened(scaled: EquilibriumSystem, schur: Schur, y: Floats, promising: float) -> Floats:
    """Velocities that are nearly a mechanism, made more of one."""
    if not promising < collapse_bound(scaled, y) < 3.0 * COLLAPSE:
        return y
    try:
        return sharpen_mechanism(scaled, schur, y)
    except (SolverError, np.linalg.LinAlgError):
        return y
