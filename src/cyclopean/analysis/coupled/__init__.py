"""Coupled rigid-block analysis: what a state is, the searches for one, and the proof that there is none."""
