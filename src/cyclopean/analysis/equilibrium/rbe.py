"""Rigid-block equilibrium: is there a state of compression and friction that balances the loads?"""

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.equilibrium.interior import SMALLEST_MU, interior_point
from cyclopean.analysis.equilibrium.newton import DualAnswer, collapse_bound, newton, sharpen_mechanism
from cyclopean.analysis.equilibrium.reference import (
    Cone,
    mechanism_program,
    penalty_program,
    rbe_program,
    solve_program,
)
from cyclopean.arrays import Floats
from cyclopean.errors import InputError, SolverError
from cyclopean.geometry import packed
from cyclopean.solvers import EXTRAS, load_osqp, solve
from cyclopean.statics import EquilibriumSystem, Schur, project_cones

__all__ = [
    "BALANCE",
    "COLLAPSE",
    "SOLVERS",
    "Outcome",
    "attempted",
    "balanced",
    "falling",
    "solve_rbe",
    "tension",
    "weighted",
]

SOLVERS = ("auto", "newton", "interior", "clarabel", "osqp")
BALANCE = 1e-9  # the certificate's own threshold: ||A f + p|| in total loads
LOST = 0.6  # least-norm states of standing models come to 0.1 to 0.3 of the total load, more where blocks are few
PROMISING = 1e3  # collapse bound from which a solver's velocities are worth sharpening rather than handing over
NEAR = 1e-5  # scaled residual from which an interior point's forces are worth mending
CAPS = 20, 50, 8  # steps of Newton, of the interior point, and of Newton after it
COLLAPSE = 1e6  # likewise: p'y / ||P_K(-A'y)|| in total loads
FACES = (16, 64)  # of the pyramids that OSQP gets in place of exact cones: up to 1.9 % and 0.12 % of friction off


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What the solvers found, in scaled units; a claim until a certificate of it has been checked."""

    word: Literal["balanced", "collapse", "undecided"]
    f: Floats | None = None  # (q, 3)
    y: Floats | None = None  # (6 m,)
    balance: float = np.inf  # ||A f + p|| in total loads
    bound: float = 0.0  # of the mechanism, in total loads
    provenance: dict[str, Any] = field(default_factory=dict)


def weighted(system: EquilibriumSystem, normal: float, tangential: float) -> tuple[EquilibriumSystem, Floats]:
    """Turn weights of H into a scaling of columns: f = stretch * g, mu' = mu sqrt(wt / wn), H = I.

    Raises
    ------
    InputError
        A weight is not positive and finite.
    """
    if not (0.0 < normal < np.inf and 0.0 < tangential < np.inf):
        raise InputError(f"`weights` {normal:g},{tangential:g}: both weights must be positive numbers")
    stretch = np.array([normal**-0.5, tangential**-0.5, tangential**-0.5])
    columns = sp.diags(np.tile(stretch, system.points))
    scaled = replace(
        system,
        frame=system.frame * stretch[:, None],
        mu=system.mu * np.sqrt(tangential / normal),
        A=(system.A @ columns).tocsr(),
    )
    return scaled, stretch


def solve_rbe(
    system: EquilibriumSystem,
    solver: str = "auto",
    weights: tuple[float, float] = (1.0, 1.0),
    schur: Schur | None = None,
) -> Outcome:
    """Find min 1/2 f'Hf subject to A f = -p and friction, or a mechanism that shows that no such f exists.

    "auto" takes the dual Newton method, past its cap the interior point on the same S, and Clarabel as a last resort.
    Each is named in the provenance with its factorisations. "osqp" is the QP route (ADMM): it gets pyramids for cones,
    and what it finds is mended and measured in the cones like all else.

    Parameters
    ----------
    system : EquilibriumSystem
        Scaled system.
    solver : {"auto", "newton", "interior", "clarabel", "osqp"}
        One of them alone, or the chain.
    weights : (normal, tangential)
        Diagonal of H.
    schur : Schur, optional
        Of the same system, where the caller has one already; ordering it is a good part of a small model's time.

    Raises
    ------
    InputError
        Unknown solver or one that is not installed, or weights that are not positive.
    """
    if solver not in SOLVERS:
        names = ", ".join(SOLVERS)
        raise InputError.of("solver", solver, f"expected one of {names} (osqp comes with: {EXTRAS['osqp']})")
    if solver == "osqp":
        load_osqp()  # absent: say so before anything else is done
    scaled, stretch = weighted(system, *weights)
    if (loose := falling(system)) is not None:
        return _settled(
            system, DualAnswer("collapse", np.zeros((system.points, 3)), loose, np.inf, 0), "connectivity", []
        )
    if system.points == 0:  # held by nothing and pulled by nothing
        return _settled(system, DualAnswer("balanced", np.zeros((0, 3)), np.zeros(len(system.p)), 0.0, 0), "none", [])
    if solver == "osqp":
        return _by_osqp(system, weights)
    if solver == "clarabel":
        return _by_clarabel(system, weights, [])
    chain = {"auto": ("newton", "interior"), "newton": ("newton",), "interior": ("interior",)}[solver]
    schur = Schur(system) if schur is None else schur
    columns = schur if weights == (1.0, 1.0) else schur.on(scaled)
    lost = (LOST + 20.0 / system.blocks) * float(np.max(1.0 / stretch))
    tried: list[dict[str, Any]] = []
    outcome = Outcome("undecided")
    for name in chain:
        if name == "interior" and scaled.mu.min() < SMALLEST_MU:
            continue
        before = columns.factorisations
        answer = attempted(name, scaled, columns, lost if solver == "auto" else np.inf)
        tried.append({"solver": name, "word": answer.word, "factorisations": columns.factorisations - before})
        found = replace(answer, f=answer.f * stretch)
        outcome = _settled(system, found, name, tried, schur)
        if outcome.word != "undecided":
            return outcome
    return _by_clarabel(system, weights, tried) if solver == "auto" else outcome


def tension(system: EquilibriumSystem, gamma: float = 1e6) -> tuple[Floats, Floats]:
    """Measure the tension that a state of equilibrium would need (penalty form).

    Returns
    -------
    f : (q, 3)
        Scaled forces with fn = fn+ - fn-.
    pull : (q,)
        Scaled fn- of each point.

    Raises
    ------
    SolverError
        Even with tension no state was found.
    """
    if system.points == 0:
        return np.zeros((0, 3)), np.zeros(0)
    answer = solve_program(penalty_program(system, gamma), system.blocks)
    if answer.word != "solved" or not (answer.primal <= 1e-6):
        raise SolverError(f"the penalty form was not solved: {answer.status}")
    f = answer.x[: 3 * system.points].reshape(-1, 3).copy()
    pull = np.maximum(answer.x[3 * system.points :], 0.0)
    f[:, 0] -= pull
    return f, pull


def attempted(
    name: str, system: EquilibriumSystem, schur: Schur, lost: float = np.inf, caps: tuple[int, int, int] = CAPS
) -> DualAnswer:
    """What "newton" or "interior" comes to; "unfinished" where it is numerically beyond it."""
    try:
        if name == "newton":
            return newton(system, schur, cap=caps[0], lost=lost)
        near = interior_point(system, schur, cap=caps[1])
        if near.word == "collapse" or not (near.residual <= NEAR):
            return near
        final = newton(system, schur, start=near.y, cap=caps[2])  # from its optimum y, two or three steps to rounding
        return final if final.word == "balanced" else replace(near, word="balanced")
    except (SolverError, np.linalg.LinAlgError):
        return DualAnswer("unfinished", np.zeros((system.points, 3)), np.zeros(schur.size), np.inf, 0)


def _balance(system: EquilibriumSystem, f: Floats) -> float:
    """||A f + p|| in total loads."""
    off = float(np.linalg.norm(system.residual(f)))
    total = system.total
    if total > 0.0:
        return off / total
    return 0.0 if off == 0.0 else np.inf


def _settled(
    system: EquilibriumSystem, answer: DualAnswer, name: str, tried: list[dict[str, Any]], schur: Schur | None = None
) -> Outcome:
    """Turn an answer into an outcome by our own residuals; sharpen or repair it where that is needed."""
    provenance: dict[str, Any] = {
        "solver": name,
        "iterations": answer.steps,
        "factorisations": sum(t["factorisations"] for t in tried),
        "tried": tried,
    }
    if answer.word == "balanced":
        f = project_cones(answer.f, system.mu)
        balance = _balance(system, f)
        if schur is not None and not (balance <= 1e-2 * BALANCE):
            f, balance = _repaired(system, schur, f, balance)
        return Outcome("balanced" if balance <= BALANCE else "undecided", f, None, balance, 0.0, provenance)
    y, bound = answer.y, collapse_bound(system, answer.y)
    if schur is not None and PROMISING < bound < 3.0 * COLLAPSE:
        before = schur.factorisations
        y = sharpen_mechanism(system, schur, y)
        bound = collapse_bound(system, y)
        tried.append({"solver": "sharpening", "word": name, "factorisations": schur.factorisations - before})
    provenance["factorisations"] = sum(t["factorisations"] for t in tried)
    return Outcome("collapse" if bound >= COLLAPSE else "undecided", None, y, np.inf, bound, provenance)


def _repaired(
    system: EquilibriumSystem, schur: Schur, f: Floats, balance: float, rounds: int = 4
) -> tuple[Floats, float]:
    """Restore A f = -p by moves f += D A' (A D A')^-1 r with D the inverse Hessian of the cone's barrier at f.

    In x = (mu fn, fu, fv) that is D = 2 x x' - det(x) J: points at the apex stay there, and others move little
    across their cone's side. What still leaves a cone is projected back, and the best state met is returned.
    """
    stretch = np.ones_like(f)
    stretch[:, 0] = 1.0 / np.maximum(system.mu, SMALLEST_MU)
    scale = stretch[:, :, None] * stretch[:, None, :]
    best = f
    for _ in range(rounds):
        x = f / stretch
        det = np.maximum(x[:, 0] ** 2 - x[:, 1] ** 2 - x[:, 2] ** 2, 0.0)
        D = (2.0 * x[:, :, None] * x[:, None, :] - det[:, None, None] * np.diag([1.0, -1.0, -1.0])) * scale
        try:
            y = schur.factor(D, 1e-13).solve(system.residual(f))
        except SolverError:
            break
        f = project_cones(f - np.einsum("qij,qj->qi", D, system.gap(y)), system.mu)
        if not (found := _balance(system, f)) < balance:
            break
        best, balance = f, found
    return best, balance


def _by_clarabel(system: EquilibriumSystem, weights: tuple[float, float], tried: list[dict[str, Any]]) -> Outcome:
    answer = solve_program(rbe_program(system, Cone(), _diagonal(system, weights)), system.blocks)
    tried = [*tried, {"solver": "clarabel", "word": answer.status, "factorisations": answer.iterations}]
    provenance = {
        "solver": "clarabel",
        "iterations": answer.iterations,
        "factorisations": sum(t["factorisations"] for t in tried),
        "tried": tried,
    }
    if answer.word == "solved":
        return _mended(system, Cone(), answer.x, provenance)
    y = answer.z[: len(system.p)]
    if answer.word == "failed":
        y = solve_program(mechanism_program(system), system.blocks).x[:-1]
    return _condemned(system, y, provenance)


def _by_osqp(system: EquilibriumSystem, weights: tuple[float, float]) -> Outcome:
    """ADMM on pyramids. Inscribed first: its states hold in the exact cones, but that it has none proves nothing.

    Circumscribed next: that it has none does prove it, once its velocities are sharp. Where it has one, the model is
    within 2 % of friction of its limit, and a finer inscribed pyramid may settle it.
    """
    coarse, fine = FACES
    cones = [Cone("inscribed", coarse), Cone("circumscribed", coarse), Cone("inscribed", fine)]
    tried: list[dict[str, Any]] = []
    outcome = Outcome("undecided")
    for pyramid in cones:
        if len(tried) == 2 and tried[-1]["word"] != "solved":
            break
        answer = solve(rbe_program(system, pyramid, _diagonal(system, weights)), "osqp")
        spent = {"solver": "osqp", "cone": f"{pyramid.kind}:{pyramid.faces}", "word": answer.status}
        tried.append({**spent, "iterations": answer.iterations, "factorisations": 0})  # OSQP does not count its own
        steps = sum(t["iterations"] for t in tried)
        provenance = {"solver": "osqp", "iterations": steps, "factorisations": 0, "tried": list(tried)}
        if answer.word != "infeasible":  # iterates that ran out of time are often near enough to mend
            outcome = _mended(system, pyramid, answer.x, provenance)
        if answer.word != "solved" and outcome.word == "undecided":
            outcome = _condemned(system, answer.z[: len(system.p)], provenance)
        if outcome.word != "undecided":
            break
    return outcome


def _diagonal(system: EquilibriumSystem, weights: tuple[float, float]) -> Floats:
    return np.tile([weights[0], weights[1], weights[1]], system.points)


def _mended(system: EquilibriumSystem, cone: Cone, x: Floats, provenance: dict[str, Any]) -> Outcome:
    """A conic solver's forces, put into the exact cone and back into balance."""
    f, balance = balanced(system, x, cone.kind != "circumscribed")
    return Outcome("balanced" if balance <= BALANCE else "undecided", f, None, balance, 0.0, provenance)


def balanced(system: EquilibriumSystem, x: Floats, repair: bool = True) -> tuple[Floats, float]:
    """Scaled forces (3q,) put into the exact cones and, where that is needed, back into balance; and how good."""
    f = project_cones(x.reshape(-1, 3), system.mu)
    balance = _balance(system, f)
    return _repaired(system, Schur(system), f, balance) if repair and not (balance <= 1e-2 * BALANCE) else (f, balance)


def _condemned(system: EquilibriumSystem, y: Floats, provenance: dict[str, Any]) -> Outcome:
    """A conic solver's velocities, sharpened until they are a mechanism, if they can be."""
    if 0.0 < (bound := collapse_bound(system, y)) < 3.0 * COLLAPSE:
        y = sharpen_mechanism(system, Schur(system), y)
        bound = collapse_bound(system, y)
    return Outcome("collapse" if bound >= COLLAPSE else "undecided", None, y, np.inf, bound, provenance)


def falling(system: EquilibriumSystem) -> Floats | None:
    """Velocity of a group of free blocks that hangs on no support and is pushed one way, if there is one.

    A block that a partial support holds hangs on something, unless it touches nothing: then it follows its own loads.
    """
    m = system.blocks
    ends = np.where(np.stack([system.row_a, system.row_b], 1) >= 0, np.stack([system.row_a, system.row_b], 1), m)
    partly = np.flatnonzero(system.held.any(1))
    alone = np.setdiff1d(partly, ends)
    driven = system.p.reshape(-1, 6)[alone]
    if np.abs(driven).max(initial=0.0) > 1e-9 * system.total:
        y = np.zeros((m, 6))
        y[alone] = driven / np.abs(driven).max()
        return y.ravel()
    ends = np.concatenate([ends, np.stack([partly, np.full(len(partly), m)], 1)])
    label = packed.components(m + 1, *ends.T)
    loose = label[:m] != label[m]
    force = system.p.reshape(-1, 6)[:, :3]
    group = np.stack([np.bincount(label[:m], force[:, k] * loose, label.max() + 1) for k in range(3)], 1)
    size = np.linalg.norm(group, axis=1)
    if not size.max(initial=0.0) > 1e-9 * max(system.total, 1e-300):
        return None
    y = np.zeros((m, 6))
    pushed = loose & (size[label[:m]] > 1e-9 * system.total)
    y[pushed, :3] = group[label[:m][pushed]] / size[label[:m][pushed]][:, None]
    return y.ravel()
