"""Convex conic programmes, and answers whose residuals are recomputed here, never taken from the solver."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Floats, sealed
from cyclopean.errors import SolverError

__all__ = ["SOLVERS", "Cone", "ConicAnswer", "ConicProgram", "distance_to_cone", "solve"]

Cone = tuple[Literal["zero", "nonnegative", "second-order"], int, int]  # kind, dimension, how many in a row


@dataclass(frozen=True, slots=True, eq=False)
class ConicProgram:
    """Min 1/2 x'Px + q'x subject to A x + s = b, s in a product of cones.

    `cones` lists (kind, dimension, count) in the order of the rows: "zero" (s = 0), "nonnegative", "second-order"
    (s0 >= |(s1, ...)|).
    """

    P: Any  # (n, n) sparse, symmetric positive semidefinite
    q: Floats  # (n,)
    A: Any  # (m, n) sparse
    b: Floats  # (m,)
    cones: tuple[Cone, ...]

    def __post_init__(self) -> None:
        m, n = self.A.shape
        object.__setattr__(self, "q", sealed("q", self.q, n))
        object.__setattr__(self, "b", sealed("b", self.b, m))
        if self.P.shape != (n, n) or sum(size * count for _, size, count in self.cones) != m:
            raise SolverError("conic programme: P, A and the cones disagree about their sizes")
        for name in ("P", "A"):
            matrix = sp.csc_matrix(getattr(self, name))
            if not np.isfinite(matrix.data).all():
                raise SolverError(f"conic programme: {name} holds values that are not finite")
            object.__setattr__(self, name, matrix)


@dataclass(frozen=True, slots=True, eq=False)
class ConicAnswer:
    """What a solver said, and what is true of it.

    "solved": x and z satisfy all conditions to the residuals given. "infeasible": z is a Farkas vector, A'z = 0,
    b'z < 0, z in the dual cone. "failed": neither.
    """

    word: Literal["solved", "infeasible", "failed"]
    x: Floats  # (n,)
    z: Floats  # (m,) multipliers
    primal: float  # max |Ax + s - b| with s the nearest point of the cone
    dual: float  # max |Px + q + A'z|
    cone: float  # max distance of z from the dual cone
    gap: float  # |x'Px + q'x + b'z|
    solver: str
    status: str
    iterations: int
    settings: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0


def distance_to_cone(cones: tuple[Cone, ...], s: Floats, dual: bool = False) -> float:
    """Largest distance of any part of `s` from its cone (or from the dual cone, where "zero" becomes free).

    Examples
    --------
    >>> round(distance_to_cone((("second-order", 3, 1),), np.array([0.0, 3.0, 4.0])), 12)
    3.535533905933
    """
    worst, at = 0.0, 0
    for kind, size, count in cones:
        part = s[at : at + size * count].reshape(count, size)
        at += size * count
        if kind == "zero":
            off = np.zeros(1) if dual else np.abs(part)
        elif kind == "nonnegative":
            off = np.maximum(-part, 0.0)
        else:
            head, tail = part[:, 0], np.linalg.norm(part[:, 1:], axis=1)
            off = np.where(tail <= -head, np.hypot(head, tail), np.maximum(tail - head, 0.0) / np.sqrt(2.0))
        worst = float(np.max([worst, np.max(off, initial=0.0)]))
    return worst


def _project(cones: tuple[Cone, ...], s: Floats) -> Floats:
    out, at = np.zeros_like(s), 0
    for kind, size, count in cones:
        part = s[at : at + size * count].reshape(count, size)
        if kind == "nonnegative":
            out[at : at + size * count] = np.maximum(part, 0.0).ravel()
        elif kind == "second-order":
            head, tail = part[:, 0], np.linalg.norm(part[:, 1:], axis=1)
            share = np.clip((head + tail) / 2.0, 0.0, None)
            new = part.copy()
            edge = tail > np.abs(head)
            new[edge, 0] = share[edge]
            new[edge, 1:] *= (share[edge] / tail[edge])[:, None]
            new[~edge & (head < 0)] = 0.0
            out[at : at + size * count] = new.ravel()
        at += size * count
    return out


def _clarabel(program: ConicProgram, options: Mapping[str, Any]) -> tuple[str, str, Floats, Floats, int]:
    import clarabel

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    for name, value in options.items():
        if not hasattr(settings, name):
            raise SolverError(f"clarabel has no option '{name}'")
        setattr(settings, name, value)
    kinds = {
        "zero": lambda size, count: [clarabel.ZeroConeT(size * count)],
        "nonnegative": lambda size, count: [clarabel.NonnegativeConeT(size * count)],
        "second-order": lambda size, count: [clarabel.SecondOrderConeT(size)] * count,
    }
    cones = [cone for kind, size, count in program.cones if count for cone in kinds[kind](size, count)]
    upper = sp.triu(program.P, format="csc")
    answer = clarabel.DefaultSolver(upper, program.q, program.A, program.b, cones, settings).solve()
    status = str(answer.status)
    word = {"Solved": "solved", "AlmostSolved": "solved"}.get(status, "failed")
    if status in ("PrimalInfeasible", "AlmostPrimalInfeasible"):
        word = "infeasible"
    return word, status, np.array(answer.x), np.array(answer.z), int(answer.iterations)


Card = Callable[[ConicProgram, Mapping[str, Any]], tuple[str, str, Floats, Floats, int]]
SOLVERS: dict[str, Card] = {"clarabel": _clarabel}


def solve(program: ConicProgram, solver: str = "clarabel", **options: Any) -> ConicAnswer:
    """Solve with the named solver and recompute every residual from the programme's own data.

    Parameters
    ----------
    program : ConicProgram
        Finite by construction: Clarabel answers "Solved" with 1e20 when it is given NaN.
    solver : str
        A key of `SOLVERS`.
    **options
        The solver's own settings; an unknown one is an error.

    Raises
    ------
    SolverError
        Unknown solver or option.
    """
    if solver not in SOLVERS:
        raise SolverError(f"no solver '{solver}': choose one of {', '.join(sorted(SOLVERS))}")
    began = time.perf_counter()
    word, status, x, z, iterations = SOLVERS[solver](program, options)
    seconds = time.perf_counter() - began
    nothing = float("inf")
    if not (np.isfinite(x).all() and np.isfinite(z).all()):
        word, x, z = "failed", np.zeros_like(program.q), np.zeros_like(program.b)
    if word != "solved":  # x is a direction or nothing at all: only z has a meaning
        cone = distance_to_cone(program.cones, z, dual=True) if word == "infeasible" else nothing
        return ConicAnswer(
            word,  # type: ignore[arg-type]
            x, z, nothing, nothing, cone, nothing, solver, status, iterations, dict(options), seconds,
        )  # fmt: skip
    slack = program.b - program.A @ x
    primal = float(np.max(np.abs(slack - _project(program.cones, slack)), initial=0.0))
    quadratic = program.P @ x
    dual = float(np.max(np.abs(quadratic + program.q + program.A.T @ z), initial=0.0))
    gap = float(abs(x @ quadratic + program.q @ x + program.b @ z))
    cone = distance_to_cone(program.cones, z, dual=True)
    return ConicAnswer(
        word,  # type: ignore[arg-type]
        x,
        z,
        primal,
        dual,
        cone,
        gap,
        solver,
        status,
        iterations,
        dict(options),
        seconds,
    )
