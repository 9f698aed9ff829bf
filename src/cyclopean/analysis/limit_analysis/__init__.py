"""Limit analysis: by how much the live loads may grow before the assembly becomes a mechanism."""
