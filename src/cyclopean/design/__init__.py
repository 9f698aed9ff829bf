"""Design proposes geometry: parametric models with exact contacts."""

from cyclopean.design.earthworks import bridge, retaining
from cyclopean.design.templates import arch, dome, stack, vault, wall

__all__ = ["arch", "bridge", "dome", "retaining", "stack", "vault", "wall"]
