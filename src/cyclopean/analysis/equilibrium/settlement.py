"""What an infinitesimal settlement of supports leaves: the displacement that takes most work out of the loads.

The ground moves the supports by u. With dd = A'y + dd0 the displacement of each contact point, dd0 what u alone does to
it, the blocks move so that nothing closes, and what slides opens too (associated flow), and so that the loads lose as
much as they can:

    min  -p.y    s.t.  dd in K*            (dn >= mu |dd_t| at every point)
    min  dd0.f   s.t.  A f = -p, f in K    (the dual: the state of equilibrium on which the ground works most)

At the optimum f.dd = 0 point by point: what has opened carries nothing, and the joints that stay shut are hinges. No
feasible y means that the blocks cannot follow (they are locked: something has to crush); no feasible f that nothing
holds them even before. For an arch whose springers part this is the state of least thrust [Heyman1966]_; as a convex
programme it is that of [Portioli2017]_ and of the piecewise rigid displacement method [Iannuzzo2018]_. Associated flow
may leave forces where sliding has opened a gap. Dry stone has none there, so a state that needs them is no answer here.

References
----------
.. [Heyman1966] Heyman: The stone skeleton. Int. J. Solids Structures 2 (1966).
.. [Portioli2017] Portioli, Cascini: Large displacement analysis of dry-jointed masonry structures subjected to
   settlements using rigid block modelling. Eng. Structures 148 (2017).
.. [Iannuzzo2018] Iannuzzo, Angelillo, De Chiara, De Guglielmo, De Serio, Ribera, Gesualdo: Modelling the cracks
   produced by settlements in masonry structures. Meccanica 53 (2018).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.equilibrium.newton import newton
from cyclopean.analysis.equilibrium.rbe import BALANCE, balanced, solve_rbe
from cyclopean.analysis.equilibrium.reference import Cone, conic_options, rbe_program
from cyclopean.arrays import Bools, Floats
from cyclopean.errors import SolverError
from cyclopean.solvers import ConicProgram, solve
from cyclopean.statics import EquilibriumSystem, Schur, project_cones

__all__ = ["SettledOutcome", "settle", "support_gap"]

SHUT = 1e-6  # of the largest settlement: gaps below it are those of a hinge
TOLERANCES = (1e-10, 1e-8)  # of the conic solver, one after the other
GOOD = 3e-8  # how far a state may miss its conditions; a certificate allows 1e-7
ROUNDS = 4  # of the polish: sliding points turn a little in each


@dataclass(frozen=True, slots=True, eq=False)
class SettledOutcome:
    """What the solvers found, in scaled units (displacements in the largest settlement of a contact point)."""

    word: Literal["settled", "sliding", "locked", "collapse", "undecided"]
    f: Floats | None = None  # (q, 3)
    y: Floats | None = None  # (6 m,) displacement of the free blocks, sliding or not; of a collapse its mechanism
    gap: Floats | None = None  # (q, 3) dd
    balance: float = np.inf
    bound: float = 0.0
    missed: float = np.inf  # by how much the conditions are missed
    provenance: dict[str, Any] = field(default_factory=dict)


def support_gap(system: EquilibriumSystem, motion_a: Floats, motion_b: Floats) -> Floats:
    """(q, 3) dd0 in each point's frame, of (q, 6) scaled motions of its two blocks; zero rows where a block is free."""
    at_a, at_b = (
        motion[:, :3] + np.cross(motion[:, 3:], arm)
        for motion, arm in ((motion_a, system.arm_a), (motion_b, system.arm_b))
    )
    return np.asarray(np.einsum("qij,qj->qi", system.frame, at_b - at_a))


def settle(system: EquilibriumSystem, gap: Floats) -> SettledOutcome:
    """Find the displacement and the forces after an infinitesimal settlement.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled.
    gap : (q, 3)
        dd0, scaled so that the largest settlement of a contact point is 1.
    """
    rigid = solve_rbe(system)
    if rigid.word != "balanced" or rigid.f is None:
        word: Literal["collapse", "undecided"] = "collapse" if rigid.word == "collapse" else "undecided"
        return SettledOutcome(word, None, rigid.y, None, rigid.balance, rigid.bound, np.inf, rigid.provenance)
    tried: list[dict[str, Any]] = []
    slides: SettledOutcome | None = None
    for tolerance in TOLERANCES:
        answer = solve(_program(system, gap), **conic_options(system.blocks, tolerance))
        tried.append({"solver": "clarabel", "word": answer.status, "factorisations": answer.iterations})
        if _locked(system, gap, answer.x):
            return SettledOutcome("locked", provenance=_told(tried))
        if answer.word != "solved":
            continue
        y = system.still(answer.z[: len(system.p)])
        for found in _candidates(system, gap, answer.x, y, tried):
            off, hanging = missed(system, found), hangs(system, found)
            if found.balance <= BALANCE and off <= GOOD and hanging <= GOOD:
                return replace(found, missed=max(off, hanging))
            if slides is None and found.balance <= BALANCE and off <= GOOD:
                slides = found
    if slides is not None:
        return replace(slides, word="sliding", f=None, provenance=_told(tried))
    return SettledOutcome("undecided", provenance=_told(tried))


def missed(system: EquilibriumSystem, found: SettledOutcome) -> float:
    """By how much a settled state misses its conditions, as the checker counts it: displacement, and work of forces."""
    assert found.f is not None
    assert found.gap is not None
    dd, f = found.gap, found.f
    closing = system.mu * np.hypot(dd[:, 1], dd[:, 2]) - dd[:, 0]
    mean = (system.total or 1.0) / max(system.blocks, 1)
    work = np.abs(np.sum(f * dd, axis=1)) / np.maximum(np.linalg.norm(f, axis=1), mean)
    return float(max(np.max(closing, initial=0.0), np.max(work, initial=0.0)))


def hangs(system: EquilibriumSystem, found: SettledOutcome) -> float:
    """The most that a point has opened which carries a force, by its force as in `missed`.

    Sliding that opens (associated flow) can leave forces where a gap is: dry stone has none there.
    """
    assert found.f is not None
    assert found.gap is not None
    force = np.linalg.norm(found.f, axis=1)
    mean = (system.total or 1.0) / max(system.blocks, 1)
    return float(np.max(np.maximum(found.gap[:, 0], 0.0) * force / np.maximum(force, mean), initial=0.0))


def _candidates(
    system: EquilibriumSystem, gap: Floats, x: Floats, y: Floats, tried: list[dict[str, Any]]
) -> Iterator[SettledOutcome]:
    """States from a solver's answer: with hinges shut to rounding and the least forces; else as near as it came."""
    exact, shut, slides = _polished(system, gap, y)
    if (found := _forces(system, gap, exact, shut, slides, tried)) is not None:
        yield found
    f, balance = balanced(system, x)
    for motion in (exact, y):
        yield SettledOutcome("settled", f, motion, system.gap(motion) + gap, balance, provenance=_told(tried))


def _locked(system: EquilibriumSystem, gap: Floats, x: Floats) -> bool:
    """Whether forces balance among themselves while the settlement works on them: then no displacement follows it.

    For every y with dd in K*: 0 <= f.dd = f.A'y + f.dd0 = f.dd0, so that f.dd0 < 0 rules all of them out. In floats,
    with room: such a model is left undecided, and nothing is proved of it.
    """
    f = project_cones(x.reshape(-1, 3), system.mu)
    size = float(np.abs(f).max(initial=0.0))
    if not size > 0.0:
        return False
    f = f / size
    off = float(np.abs(system.A @ f.ravel()).max(initial=0.0))
    return float(np.sum(f * gap)) < -1e3 * max(off, 1e-9)


def _program(system: EquilibriumSystem, gap: Floats) -> ConicProgram:
    """Min dd0.f subject to A f = -p, f in K; the multiplier of equilibrium is y."""
    base = rbe_program(system, Cone())
    q = 3 * system.points
    return ConicProgram(sp.csc_matrix((q, q)), gap.ravel().copy(), base.A, base.b, base.cones)


def _told(tried: list[dict[str, Any]]) -> dict[str, Any]:
    last = tried[-1]
    count = sum(entry["factorisations"] for entry in tried)
    return {"solver": last["solver"], "iterations": count, "factorisations": count, "tried": tried}


def _polished(system: EquilibriumSystem, gap: Floats, y: Floats) -> tuple[Floats, Bools, Bools]:
    """The displacement with hinges shut to rounding, and which points stay shut or slide along the edge of K*.

    What is shut gives three equations, dd = 0; what slides one, dn = mu e.dd_t with e its own direction. They are
    solved for the smallest change of y.
    """
    from scipy.sparse.linalg import lsqr

    shut, slides = _sorted(system, system.gap(y) + gap)
    for _ in range(ROUNDS):
        dd = system.gap(y) + gap
        tangent = np.hypot(dd[:, 1], dd[:, 2])
        lean = np.zeros((system.points, 3))
        lean[:, 0] = 1.0
        lean[:, 1:] = -system.mu[:, None] * dd[:, 1:] / np.maximum(tangent, 1e-300)[:, None]
        rows = np.flatnonzero(np.repeat(shut, 3))
        column = 3 * np.flatnonzero(slides)[:, None] + np.arange(3)
        along = sp.csr_matrix(
            (lean[slides].ravel(), column.ravel(), 3 * np.arange(len(column) + 1)),
            shape=(len(column), 3 * system.points),
        )
        gaps = system.A.T.tocsr()
        matrix = sp.vstack([gaps[rows], along @ gaps], format="csr")
        off = np.concatenate([dd.ravel()[rows], along @ dd.ravel()])
        if not len(off) or not (np.abs(off).max() > 1e-15):
            break
        least = lsqr(matrix, off, atol=1e-16, btol=1e-16, iter_lim=20 * sum(matrix.shape))[0]
        y = y - system.still(least)
    return y, shut, slides


def _sorted(system: EquilibriumSystem, dd: Floats) -> tuple[Bools, Bools]:
    """Points that stay shut, and points that slide along the edge of K*; the others have opened."""
    tangent = np.hypot(dd[:, 1], dd[:, 2])
    shut = np.maximum(np.abs(dd[:, 0]), tangent) <= SHUT
    return shut, ~shut & (dd[:, 0] - system.mu * tangent <= SHUT)


def _forces(
    system: EquilibriumSystem, gap: Floats, y: Floats, shut: Bools, slides: Bools, tried: list[dict[str, Any]]
) -> SettledOutcome | None:
    """The least forces that go with a displacement: none where it opens, against the sliding where it slides."""
    dd = system.gap(y) + gap
    tangent = np.maximum(np.hypot(dd[:, 1], dd[:, 2]), 1e-300)
    mould = np.zeros((system.points, 3, 3))
    mould[shut] = np.eye(3)
    mould[slides, 0, 0] = 1.0
    mould[slides, 1:, 0] = (-system.mu[:, None] * dd[:, 1:] / tangent[:, None])[slides]
    allowed = replace(
        system,
        frame=np.einsum("qji,qjk->qik", mould, system.frame),
        mu=np.where(shut, system.mu, 0.0),
        A=(system.A @ sp.block_diag(list(mould), format="csr")).tocsr(),
    )
    schur = Schur(allowed)
    try:
        answer = newton(allowed, schur, cap=60)
    except SolverError:
        return None
    tried.append({"solver": "newton", "word": answer.word, "factorisations": schur.factorisations})
    f = np.einsum("qij,qj->qi", mould, answer.f)
    balance = float(np.linalg.norm(system.residual(f))) / (system.total or 1.0)
    return SettledOutcome("settled", f, y, dd, balance, provenance=_told(tried))
