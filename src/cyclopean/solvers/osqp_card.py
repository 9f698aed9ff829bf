"""OSQP: the operator splitting (ADMM) of Stellato et al. as its authors ship it, for programmes with linear cones.

    min 1/2 x'Px + q'x   s.t.   l <= A x <= u        l = u = b on "zero" rows, l = -inf and u = b on "nonnegative" ones

Its multipliers have our sign: P x + q + A'z = 0, z >= 0 where x presses against u. It factors one matrix and then needs
only triangular solves. Three digits come cheap and eight do not; polishing guesses the active rows and solves for them,
to rounding when they are right. Second-order cones have to become pyramids first (`statics.pyramid_rows`).

References
----------
.. [Stellato2020] Stellato, Banjac, Goulart, Bemporad, Boyd: OSQP: an operator splitting solver for quadratic programs.
   Mathematical Programming Computation 12 (2020) 637-672.
"""

from collections.abc import Mapping
from contextlib import redirect_stdout
from importlib import import_module
from io import StringIO
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Floats
from cyclopean.errors import InputError, SolverError
from cyclopean.solvers.programs import ConicProgram, Word

__all__ = ["load_osqp", "osqp_card"]

# The update of rho is counted in iterations, not in time, so that an answer does not depend on the machine's load.
DEFAULTS: dict[str, Any] = {
    "eps_abs": 1e-7,
    "eps_rel": 1e-7,
    "eps_prim_inf": 1e-7,
    "eps_dual_inf": 1e-7,
    "max_iter": 10_000,
    "polishing": True,
    "verbose": False,
}
WORDS: dict[str, Word] = {
    "OSQP_SOLVED": "solved",
    "OSQP_SOLVED_INACCURATE": "solved",
    "OSQP_PRIMAL_INFEASIBLE": "infeasible",
    "OSQP_PRIMAL_INFEASIBLE_INACCURATE": "infeasible",
}


def load_osqp() -> Any:
    """Import the package.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        return import_module("osqp")
    except ImportError:
        raise InputError("`solver` osqp: the package is not installed; pip install 'cyclopean[osqp]'") from None


def osqp_card(
    program: ConicProgram, options: Mapping[str, Any], start: tuple[Floats, Floats] | None = None
) -> tuple[Word, str, Floats, Floats, int]:
    """Solve once with OSQP (Apache-2.0), linear cones only; see `conic.solve`.

    Parameters
    ----------
    program : ConicProgram
        Linear cones only, m rows and n unknowns.
    options : mapping
        OSQP's own settings, over `DEFAULTS`.
    start : (x, z), optional
        Where to begin, (n,) and (m,).

    Raises
    ------
    SolverError
        A second-order cone, an option that OSQP does not have, or a start that is not finite.
    InputError
        The package is not installed.
    """
    osqp = load_osqp()
    solver = osqp.OSQP(algebra="builtin")
    for name in options:
        if name.startswith("_") or not hasattr(solver.ext.OSQPSettings, name):
            raise SolverError(f"osqp has no option '{name}'")
    if any(kind == "second-order" for kind, _, count in program.cones if count):
        raise SolverError("osqp takes linear cones only: turn second-order cones into pyramids first")
    if start is not None and not (np.isfinite(start[0]).all() and np.isfinite(start[1]).all()):
        raise SolverError("osqp: the start holds values that are not finite")
    tight = np.repeat([kind == "zero" for kind, _, _ in program.cones], [n * count for _, n, count in program.cones])
    lower, upper = np.where(tight, program.b, -np.inf), sp.triu(program.P, format="csc")
    try:
        with redirect_stdout(StringIO()):  # remarks that come even if not verbose, such as no active rows to polish
            solver.setup(upper, program.q.copy(), program.A, lower, program.b.copy(), **{**DEFAULTS, **options})
            if start is not None:
                solver.warm_start(x=np.array(start[0], float), y=np.array(start[1], float))
            said = solver.solve(raise_error=False)
    except osqp.OSQPException as fault:
        raise SolverError(f"osqp refuses the programme or its options: error {fault.args}") from None
    status = osqp.SolverStatus(said.info.status_val).name
    word = WORDS.get(status, "failed")
    x, z = np.array(said.x, float), np.array(said.y, float)
    if word == "infeasible":
        x, z = np.zeros_like(x), np.array(said.prim_inf_cert, float)
    return word, status.removeprefix("OSQP_").replace("_", " ").lower(), x, z, int(said.info.iter)
