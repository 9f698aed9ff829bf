"""Verdicts on an assembly, each with a certificate that has been checked."""

from cyclopean.analysis.checking import DENSITY, GRAVITY, MU, Settings, check
from cyclopean.analysis.interior import interior_point
from cyclopean.analysis.newton import DualAnswer, collapse_bound, newton, sharpen_mechanism
from cyclopean.analysis.rbe import Outcome, solve_rbe, tension
from cyclopean.analysis.reference import (
    Cone,
    mechanism_program,
    parse_cone,
    penalty_program,
    rbe_program,
    solve_program,
)
from cyclopean.analysis.verdict import Result, Word

__all__ = [
    "DENSITY",
    "GRAVITY",
    "MU",
    "Cone",
    "DualAnswer",
    "Outcome",
    "Result",
    "Settings",
    "Word",
    "check",
    "collapse_bound",
    "interior_point",
    "mechanism_program",
    "newton",
    "parse_cone",
    "penalty_program",
    "rbe_program",
    "sharpen_mechanism",
    "solve_program",
    "solve_rbe",
    "tension",
]
