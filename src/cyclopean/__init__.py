"""Dry-jointed stone: does it stand, and why? Equilibrium, certificates, geometry."""

__version__ = "0.1.0"
