"""Design proposes geometry: parametric models with exact contacts."""

from cyclopean.design.templates import arch, dome, stack, vault, wall

__all__ = ["arch", "dome", "stack", "vault", "wall"]
