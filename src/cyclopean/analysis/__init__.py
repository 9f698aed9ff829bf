"""Verdicts on an assembly, each with a certificate that has been checked.

Names are imported when they are first asked for: no command needs all of them.
"""

import typing

from cyclopean.lazy_exports import lazy_exports as _lazy_exports

if typing.TYPE_CHECKING:
    from cyclopean.analysis.checking import check
    from cyclopean.analysis.coupled.search import CoupledOutcome, solve_cra
    from cyclopean.analysis.coupled.states import Bounds, Residuals, measure
    from cyclopean.analysis.equilibrium.interior import interior_point
    from cyclopean.analysis.equilibrium.newton import DualAnswer, collapse_bound, newton, sharpen_mechanism
    from cyclopean.analysis.equilibrium.rbe import Outcome, solve_rbe, tension
    from cyclopean.analysis.equilibrium.reference import (
        Cone,
        mechanism_program,
        parse_cone,
        penalty_program,
        rbe_program,
        solve_program,
    )
    from cyclopean.analysis.large_displacement.pushover import Pushover, PushoverStep, Reach, pushover
    from cyclopean.analysis.large_displacement.subsidence import Subsidence, SubsidenceStep, subsidence
    from cyclopean.analysis.limit_analysis.bracket import CoupledBracket, coupled_bracket
    from cyclopean.analysis.limit_analysis.joints import MovingJoint, moving_joints
    from cyclopean.analysis.limit_analysis.limit import limit
    from cyclopean.analysis.limit_analysis.live_load import Live, LiveLoad
    from cyclopean.analysis.limit_analysis.polar import Polar, Travelling, polar, travelling
    from cyclopean.analysis.limit_analysis.result import LimitResult
    from cyclopean.analysis.preparation import PreparedModel, prepare
    from cyclopean.analysis.proving import Judge
    from cyclopean.analysis.safety_margins import Margins, margins
    from cyclopean.analysis.same_model import Comparison, compare
    from cyclopean.analysis.sensitivity_study.ranges import QUANTITIES, Range, ranges_of
    from cyclopean.analysis.sensitivity_study.sampling import Sampling, Sensitivity, sensitivity, share_between
    from cyclopean.analysis.settings import DENSITY, GRAVITY, MU, Settings
    from cyclopean.analysis.verdict import Result, Settled, Word, openings
    from cyclopean.analysis.warm_start.recheck import CONTINUED, Known, mobile, recheck

__all__ = [
    "CONTINUED",
    "DENSITY",
    "GRAVITY",
    "MU",
    "QUANTITIES",
    "Bounds",
    "Comparison",
    "Cone",
    "CoupledBracket",
    "CoupledOutcome",
    "DualAnswer",
    "Judge",
    "Known",
    "LimitResult",
    "Live",
    "LiveLoad",
    "Margins",
    "MovingJoint",
    "Outcome",
    "Polar",
    "PreparedModel",
    "Pushover",
    "PushoverStep",
    "Range",
    "Reach",
    "Residuals",
    "Result",
    "Sampling",
    "Sensitivity",
    "Settings",
    "Settled",
    "Subsidence",
    "SubsidenceStep",
    "Travelling",
    "Word",
    "check",
    "collapse_bound",
    "compare",
    "coupled_bracket",
    "interior_point",
    "limit",
    "margins",
    "measure",
    "mechanism_program",
    "mobile",
    "moving_joints",
    "newton",
    "openings",
    "parse_cone",
    "penalty_program",
    "polar",
    "prepare",
    "pushover",
    "ranges_of",
    "rbe_program",
    "recheck",
    "sensitivity",
    "share_between",
    "sharpen_mechanism",
    "solve_cra",
    "solve_program",
    "solve_rbe",
    "subsidence",
    "tension",
    "travelling",
]

__getattr__, __dir__ = _lazy_exports(
    __name__,
    {
        "checking": "check",
        "coupled.search": "CoupledOutcome solve_cra",
        "coupled.states": "Bounds Residuals measure",
        "equilibrium.interior": "interior_point",
        "equilibrium.newton": "DualAnswer collapse_bound newton sharpen_mechanism",
        "equilibrium.rbe": "Outcome solve_rbe tension",
        "equilibrium.reference": "Cone mechanism_program parse_cone penalty_program rbe_program solve_program",
        "large_displacement.pushover": "Pushover PushoverStep Reach pushover",
        "large_displacement.subsidence": "Subsidence SubsidenceStep subsidence",
        "limit_analysis.bracket": "CoupledBracket coupled_bracket",
        "limit_analysis.joints": "MovingJoint moving_joints",
        "limit_analysis.limit": "limit",
        "limit_analysis.live_load": "Live LiveLoad",
        "limit_analysis.polar": "Polar Travelling polar travelling",
        "limit_analysis.result": "LimitResult",
        "preparation": "PreparedModel prepare",
        "proving": "Judge",
        "safety_margins": "Margins margins",
        "same_model": "Comparison compare",
        "sensitivity_study.ranges": "QUANTITIES Range ranges_of",
        "sensitivity_study.sampling": "Sampling Sensitivity sensitivity share_between",
        "settings": "DENSITY GRAVITY MU Settings",
        "verdict": "Result Settled Word openings",
        "warm_start.recheck": "CONTINUED Known mobile recheck",
    },
)
