"""Clarabel: an interior point on exact second-order cones, with certificates of infeasibility."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.solvers.programs import ConicProgram, Word

__all__ = ["clarabel_card"]

WORDS: dict[str, Word] = {
    "Solved": "solved",
    "AlmostSolved": "solved",
    "PrimalInfeasible": "infeasible",
    "AlmostPrimalInfeasible": "infeasible",
}


def clarabel_card(program: ConicProgram, options: Mapping[str, Any]) -> tuple[Word, str, Floats, Floats, int]:
    """Solve with Clarabel (Apache-2.0), an interior point on exact cones; see `conic.solve`."""
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
    upper = sp.triu(program.P, format="csc") if program.P.nnz else program.P
    answer = clarabel.DefaultSolver(upper, program.q, program.A, program.b, cones, settings).solve()
    status = str(answer.status)
    return WORDS.get(status, "failed"), status, np.array(answer.x), np.array(answer.z), int(answer.iterations)
