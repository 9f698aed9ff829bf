"""Convex programmes and sparse factorisations; knows nothing of stone."""

from cyclopean.solvers.conic import EXTRAS, SOLVERS, solve
from cyclopean.solvers.osqp_card import load_osqp
from cyclopean.solvers.programs import Cone, ConicAnswer, ConicProgram, distance_to_cone
from cyclopean.solvers.sparse import Factor, Symbolic, analyse

__all__ = [
    "EXTRAS",
    "SOLVERS",
    "Cone",
    "ConicAnswer",
    "ConicProgram",
    "Factor",
    "Symbolic",
    "analyse",
    "distance_to_cone",
    "load_osqp",
    "solve",
]
