"""OSQP: the operator splitting (ADMM) of Stellato et al. as its authors ship it, for programmes with linear cones.

    min 1/2 x'Px + q'x   s.t.   l <= A x <= u        l = u = b on "zero" rows, l = -inf and u = b on "nonnegative" ones

Its multipliers have our sign: P x + q + A'z = 0, z >= 0 where x presses against u. It factors one matrix and then needs
only triangular solves, so that a programme whose q or b change is solved again at once: keep an `OsqpWorkspace`. Three
digits come cheap and eight do not; polishing guesses the active rows and solves for them, to rounding when they are
right. Second-order cones have to become pyramids first (`linearised`).

References
----------
.. [Stellato2020] Stellato, Banjac, Goulart, Bemporad, Boyd: OSQP: an operator splitting solver for quadratic programs.
   Mathematical Programming Computation 12 (2020) 637-672.
"""

import time
from collections.abc import Mapping
from contextlib import AbstractContextManager, redirect_stdout
from dataclasses import replace
from importlib import import_module
from io import StringIO
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Floats
from cyclopean.errors import InputError, SolverError
from cyclopean.solvers.programs import ConicAnswer, ConicProgram, Word, judged

__all__ = ["OsqpWorkspace", "load_osqp", "osqp_card"]

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


class OsqpWorkspace:
    """A programme that stays set up: P and A, scaled and factorised once; each solve may bring a new q and b.

    Every solve begins where the last one ended, unless it is given a start or the last one failed.

    Parameters
    ----------
    program : ConicProgram
        Linear cones only.
    **options
        OSQP's own settings, over `DEFAULTS`.

    Raises
    ------
    SolverError
        A second-order cone, or an option that OSQP does not have.
    InputError
        The package is not installed.
    """

    def __init__(self, program: ConicProgram, **options: Any) -> None:
        osqp = load_osqp()
        self._solver = osqp.OSQP(algebra="builtin")
        for name in options:
            if name.startswith("_") or not hasattr(self._solver.ext.OSQPSettings, name):
                raise SolverError(f"osqp has no option '{name}'")
        if any(kind == "second-order" for kind, _, count in program.cones if count):
            raise SolverError("osqp takes linear cones only: turn second-order cones into pyramids first")
        self.program, self.options = program, {**DEFAULTS, **options}
        self._statuses = {int(status): status.name for status in osqp.SolverStatus}
        self._tight = np.concatenate(
            [np.zeros(0, bool), *(np.full(size * count, kind == "zero") for kind, size, count in program.cones)]
        )
        began = time.perf_counter()
        upper, q, b = sp.triu(program.P, format="csc"), program.q.copy(), program.b.copy()
        try:
            with _silence():
                self._solver.setup(upper, q, program.A, self._lower(b), b, **self.options)
        except osqp.OSQPException as fault:
            raise SolverError(f"osqp refuses the programme or its options: error {fault.args}") from None
        self.setup_seconds = time.perf_counter() - began

    def solve(
        self,
        q: Floats | None = None,
        b: Floats | None = None,
        start: tuple[Floats, Floats] | None = None,
        seconds: float | None = None,
    ) -> ConicAnswer:
        """Solve, with a new (n,) cost or (m,) right-hand side where given; residuals are those of the new programme.

        Parameters
        ----------
        q, b : (n,), (m,), optional
            As in `ConicProgram`; what is not given stays as it was.
        start : (x, z), optional
            Where to begin.
        seconds : float, optional
            Most time for this solve and those after it.

        Raises
        ------
        SolverError
            The start is not finite.
        """
        began = time.perf_counter()
        if seconds is not None:
            self._solver.update_settings(time_limit=seconds)
        if q is not None or b is not None:
            given = self.program
            self.program = replace(given, q=given.q if q is None else q, b=given.b if b is None else b)
            fresh = None if b is None else self.program.b.copy()
            self._solver.update(
                q=None if q is None else self.program.q.copy(), l=None if fresh is None else self._lower(fresh), u=fresh
            )
        if start is not None:
            if not (np.isfinite(start[0]).all() and np.isfinite(start[1]).all()):
                raise SolverError("osqp: the start holds values that are not finite")
            self._solver.warm_start(x=np.array(start[0], float), y=np.array(start[1], float))
        raw = self._run()
        return judged(self.program, raw, "osqp", self.options, time.perf_counter() - began)

    def _run(self) -> tuple[Word, str, Floats, Floats, int]:
        with _silence():
            said = self._solver.solve(raise_error=False)
        status = self._statuses[int(said.info.status_val)]
        word = WORDS.get(status, "failed")
        x, z = np.array(said.x, float), np.array(said.y, float)
        if word == "infeasible":
            x, z = np.zeros_like(x), np.array(said.prim_inf_cert, float)
        if word != "solved":  # its iterates run off: do not begin there again
            self._solver.warm_start(x=np.zeros(len(x)), y=np.zeros(len(z)))
        return word, status.removeprefix("OSQP_").replace("_", " ").lower(), x, z, int(said.info.iter)

    def _lower(self, b: Floats) -> Floats:
        return np.where(self._tight, b, -np.inf)


def _silence() -> AbstractContextManager[Any]:
    """OSQP writes remarks on standard output (no active rows to polish, a setting refused) even if not verbose."""
    return redirect_stdout(StringIO())


def osqp_card(
    program: ConicProgram, options: Mapping[str, Any], start: tuple[Floats, Floats] | None = None
) -> tuple[Word, str, Floats, Floats, int]:
    """Solve once with OSQP (Apache-2.0), linear cones only; see `conic.solve`."""
    answer = OsqpWorkspace(program, **options).solve(start=start)
    return answer.word, answer.status, answer.x, answer.z, answer.iterations
