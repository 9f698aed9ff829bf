"""Verdicts on an assembly, each with a certificate that has been checked."""

from cyclopean.analysis.checking import check
from cyclopean.analysis.coupled.search import CoupledOutcome, solve_cra
from cyclopean.analysis.coupled.states import Bounds, Residuals, measure
from cyclopean.analysis.grown.deferred import Deferred
from cyclopean.analysis.grown.recheck import CONTINUED, Known, mobile, recheck
from cyclopean.analysis.posing import PosedModel, pose
from cyclopean.analysis.proving import Judge
from cyclopean.analysis.rigid.interior import interior_point
from cyclopean.analysis.rigid.newton import DualAnswer, collapse_bound, newton, sharpen_mechanism
from cyclopean.analysis.rigid.rbe import Outcome, solve_rbe, tension
from cyclopean.analysis.rigid.reference import (
    Cone,
    mechanism_program,
    parse_cone,
    penalty_program,
    rbe_program,
    solve_program,
)
from cyclopean.analysis.settings import DENSITY, GRAVITY, MU, Settings
from cyclopean.analysis.verdict import Result, Word

__all__ = [
    "CONTINUED",
    "DENSITY",
    "GRAVITY",
    "MU",
    "Bounds",
    "Cone",
    "CoupledOutcome",
    "Deferred",
    "DualAnswer",
    "Judge",
    "Known",
    "Outcome",
    "PosedModel",
    "Residuals",
    "Result",
    "Settings",
    "Word",
    "check",
    "collapse_bound",
    "interior_point",
    "measure",
    "mechanism_program",
    "mobile",
    "newton",
    "parse_cone",
    "penalty_program",
    "pose",
    "rbe_program",
    "recheck",
    "sharpen_mechanism",
    "solve_cra",
    "solve_program",
    "solve_rbe",
    "tension",
]
