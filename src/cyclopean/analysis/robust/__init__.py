"""Verdicts that hold for every drawing that differs from a model by no more than a length and an angle."""
