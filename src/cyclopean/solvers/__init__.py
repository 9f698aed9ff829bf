"""Convex programmes and sparse factorisations; knows nothing of stone."""

from cyclopean.solvers.conic import EXTRAS, SOLVERS, solve
from cyclopean.solvers.osqp_card import OsqpWorkspace, load_osqp
from cyclopean.solvers.programs import Cone, ConicAnswer, ConicProgram, distance_to_cone
from cyclopean.solvers.pyramids import Linearised, linearised
from cyclopean.solvers.sparse import Factor, Symbolic, analyse

__all__ = [
    "EXTRAS",
    "SOLVERS",
    "Cone",
    "ConicAnswer",
    "ConicProgram",
    "Factor",
    "Linearised",
    "OsqpWorkspace",
    "Symbolic",
    "analyse",
    "distance_to_cone",
    "linearised",
    "load_osqp",
    "solve",
]
