"""Convex conic programmes, and answers whose residuals are recomputed here, never taken from the solver."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Floats, sealed
from cyclopean.errors import SolverError

__all__ = ["Cone", "ConicAnswer", "ConicProgram", "distance_to_cone", "judged", "project_to_cone"]

Cone = tuple[Literal["zero", "nonnegative", "second-order"], int, int]  # kind, dimension, how many in a row
Word = Literal["solved", "infeasible", "failed"]


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

    word: Word
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
    off, worst, at = s - project_to_cone(cones, s, dual), 0.0, 0
    for kind, size, count in cones:
        part = off[at : at + size * count].reshape(count, size)
        at += size * count
        far = np.linalg.norm(part, axis=1) if kind == "second-order" else np.abs(part)
        worst = float(np.max([worst, np.max(far, initial=0.0)]))
    return worst


def project_to_cone(cones: tuple[Cone, ...], s: Floats, dual: bool = False) -> Floats:
    """Nearest point of the product of cones (or of the dual cones) to (m,) `s`."""
    out, at = np.zeros_like(s), 0
    for kind, size, count in cones:
        part = s[at : at + size * count].reshape(count, size)
        if kind == "nonnegative":
            out[at : at + size * count] = np.maximum(part, 0.0).ravel()
        elif kind == "zero" and dual:
            out[at : at + size * count] = part.ravel()
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


def judged(
    program: ConicProgram,
    raw: tuple[Word, str, Floats, Floats, int],
    solver: str,
    options: Mapping[str, Any],
    seconds: float = 0.0,
) -> ConicAnswer:
    """Turn what a solver said into an answer whose residuals come from the programme's own data.

    Parameters
    ----------
    program : ConicProgram
        What it was given, m rows and n unknowns.
    raw : (word, status, x, z, iterations)
        What it said; x (n,) and z (m,) may hold anything.
    solver : str
        Its name.
    options : mapping
        Its settings.
    seconds : float
        Its time.
    """
    word, status, x, z, iterations = raw
    nothing = float("inf")
    if not (np.isfinite(x).all() and np.isfinite(z).all()):
        word, x, z = "failed", np.zeros_like(program.q), np.zeros_like(program.b)
    if word != "solved":  # x is a direction or nothing at all: only z has a meaning
        cone = distance_to_cone(program.cones, z, dual=True) if word == "infeasible" else nothing
        return ConicAnswer(
            word, x, z, nothing, nothing, cone, nothing, solver, status, iterations, dict(options), seconds
        )
    slack = program.b - program.A @ x
    primal = float(np.max(np.abs(slack - project_to_cone(program.cones, slack)), initial=0.0))
    quadratic = program.P @ x
    dual = float(np.max(np.abs(quadratic + program.q + program.A.T @ z), initial=0.0))
    gap = float(abs(x @ quadratic + program.q @ x + program.b @ z))
    cone = distance_to_cone(program.cones, z, dual=True)
    return ConicAnswer(word, x, z, primal, dual, cone, gap, solver, status, iterations, dict(options), seconds)
