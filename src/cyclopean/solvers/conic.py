"""The table of convex solvers, and one way to call any of them."""

import time
from collections.abc import Callable
from typing import Any

from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.solvers.clarabel_card import clarabel_card
from cyclopean.solvers.osqp_card import osqp_card
from cyclopean.solvers.programs import ConicAnswer, ConicProgram, Word, judged

__all__ = ["EXTRAS", "SOLVERS", "solve"]

Card = Callable[..., tuple[Word, str, Floats, Floats, int]]
SOLVERS: dict[str, Card] = {"clarabel": clarabel_card, "osqp": osqp_card}
EXTRAS = {"osqp": "pip install 'cyclopean[osqp]'"}  # solvers that do not come with the core


def solve(
    program: ConicProgram, solver: str = "clarabel", start: tuple[Floats, Floats] | None = None, **options: Any
) -> ConicAnswer:
    """Solve with the named solver and recompute every residual from the programme's own data.

    Parameters
    ----------
    program : ConicProgram
        Finite by construction: Clarabel answers "Solved" with 1e20 when it is given NaN.
    solver : str
        A key of `SOLVERS`.
    start : (x, z), optional
        Where to begin, (n,) and (m,): for first-order solvers.
    **options
        The solver's own settings; an unknown one is an error.

    Raises
    ------
    SolverError
        Unknown solver or option, cones that it does not know, or a start that it has no use for.
    InputError
        The solver's package is not installed.
    """
    if solver not in SOLVERS:
        known = (f"{name} ({EXTRAS[name]})" if name in EXTRAS else name for name in sorted(SOLVERS))
        raise SolverError(f"no solver '{solver}': choose one of {', '.join(known)}")
    if start is not None and solver == "clarabel":
        raise SolverError("clarabel is an interior point: it cannot begin at a given start")
    began = time.perf_counter()
    raw = SOLVERS[solver](program, options) if start is None else SOLVERS[solver](program, options, start)
    return judged(program, raw, solver, options, time.perf_counter() - began)
