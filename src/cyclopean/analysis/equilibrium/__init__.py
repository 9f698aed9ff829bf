"""Rigid-block equilibrium: a state of compression and friction, or the mechanism that shows that there is none."""
