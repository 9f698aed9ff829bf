"""Convex programmes and sparse factorisations; knows nothing of stone."""

from cyclopean.solvers.conic import SOLVERS, Cone, ConicAnswer, ConicProgram, distance_to_cone, solve
from cyclopean.solvers.sparse import Factor, Symbolic, analyse

__all__ = [
    "SOLVERS",
    "Cone",
    "ConicAnswer",
    "ConicProgram",
    "Factor",
    "Symbolic",
    "analyse",
    "distance_to_cone",
    "solve",
]
