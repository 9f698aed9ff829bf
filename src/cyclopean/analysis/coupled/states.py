"""Coupled rigid-block analysis: what a state is, and how well a triple of forces and motion satisfies it.

A state couples forces f with a virtual displacement dq through dd = A' dq = (dn, dd_t) at every contact point
[Kao2022]_, eqs. (8) to (10), in units where eps = 1 (forces by the mean block weight, lengths by the mean V^(1/3)):

    A f = -p, f in K_mu        f_t = -alpha dd_t, alpha >= 0        fn (dn + 1) = 0, dn >= -1
    dn <= eta, |dd_t| <= eta   |dd_t| >= beta_min wherever f_t is not 0

|dd_t| is the Euclidean norm, so that nothing depends on the choice of tangents (the paper bounds each component), and
beta_min rules out alpha = infinity, friction without any sliding tendency. All of it is homogeneous in the
displacement: only eta / eps and beta_min / eps matter.

References
----------
.. [Kao2022] Kao, Iannuzzo, Thomaszewski, Coros, Van Mele, Block: Coupled Rigid-Block Analysis. Computer-Aided
   Design 146 (2022) 103216.
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.statics import EquilibriumSystem

__all__ = ["ACCEPT", "Bounds", "Residuals", "measure", "merit"]

EVEN, LOOSE = 0.01, 1e-7  # lightest weight in heaviest ones below which, and balance in own weights to which, it is so
ACCEPT = 2e-10  # a fifth of what the checker allows: rounding to world coordinates needs some room


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds of the virtual displacement, in scaled units."""

    eps: float = 1.0  # overlap of points that press
    eta: float = 10.0  # largest displacement
    beta: float = 0.01  # beta_min: least sliding where there is friction

    def __post_init__(self) -> None:
        for name, value in (("eps", self.eps), ("eta", self.eta), ("beta_min", self.beta)):
            if not (0.0 < value < np.inf):
                raise InputError.of(name, value, "expected a positive number")
        if not (self.beta < self.eta):
            raise InputError.of("beta_min", self.beta, f"must be smaller than eta ({self.eta:g})")
        if not (1e-6 <= self.eta / self.eps <= 1e6 and 1e-6 <= self.beta / self.eps):
            raise InputError("`eta`, `beta_min`: expected within a factor of 1e6 of eps")

    def unit(self) -> "Bounds":
        """The same in units where eps = 1: what all solvers work with."""
        return Bounds(1.0, self.eta / self.eps, self.beta / self.eps)


@dataclass(frozen=True, slots=True)
class Residuals:
    """How far (f, dq) is from a state; all relative, worst over every point, measured as the checker measures.

    Forces count in the weight of the lighter block at their point, or in the point's own force where that is larger,
    displacements in eps, what a block's balance misses in its own weight and size.
    """

    equilibrium: float  # A f + p, in own weights and own weights times own diagonals
    cone: float
    gap: float  # dn below -1
    complementarity: float  # fn (dn + 1)
    alignment: float  # |f_t x dd_t|, and |f_t| where it does not act against sliding
    reach: float  # beyond eta, in eta
    sliding: float  # below beta_min where friction acts, in beta_min

    @property
    def worst(self) -> float:
        """The largest of all."""
        parts = (self.equilibrium, self.cone, self.gap, self.complementarity, self.alignment, self.reach, self.sliding)
        return float(np.max(parts))  # NaN stays NaN

    @property
    def accepted(self) -> bool:
        """Whether this is worth writing a certificate for."""
        return self.worst <= ACCEPT


def measure(system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats) -> Residuals:
    """Residuals of scaled (q, 3) forces and a (6 m,) displacement; `bounds` with eps = 1."""
    d = system.gap(dq)
    tangent, slide = np.hypot(f[:, 1], f[:, 2]), np.hypot(d[:, 1], d[:, 2])
    size = np.maximum(system.lighter, np.linalg.norm(f, axis=1))
    across = np.abs(f[:, 1] * d[:, 2] - f[:, 2] * d[:, 1])
    along = f[:, 1] * d[:, 1] + f[:, 2] * d[:, 2]
    rubbing = tangent > ACCEPT * size  # less is none: a polish of the balance may leave a trace
    forward = rubbing & (along >= 0.0) & (tangent > ACCEPT * size)  # the checker takes no friction that pushes on
    return Residuals(
        equilibrium=_unbalanced(system, f),
        cone=_most(np.maximum(tangent - system.mu * f[:, 0], -f[:, 0]) / size),
        gap=_most(-1.0 - d[:, 0]),
        complementarity=_most(np.abs(f[:, 0] * (d[:, 0] + 1.0)) / size),
        alignment=_most(np.where(forward, tangent, np.maximum(across, along)) / size),
        reach=_most(np.maximum(d[:, 0], slide) / bounds.eta - 1.0),
        sliding=_most((1.0 - slide / bounds.beta)[rubbing]),
    )


def _unbalanced(system: EquilibriumSystem, f: Floats) -> float:
    """What forces miss of balance, in own weights; nothing where blocks differ much and doubles cannot say it better.

    The forces of a certificate are polished as sums of two doubles, and judged by the weight of the lightest block.
    """
    off = _most(system.own(system.residual(f)))
    uneven = system.weight is not None and system.blocks and system.weight.min() < EVEN * system.weight.max()
    return 0.0 if uneven and off <= LOOSE else off


def merit(system: EquilibriumSystem, bounds: Bounds, f: Floats, dq: Floats) -> tuple[Floats, Floats]:
    """How much work each point does that a state does not: (q,) of the normal and of the tangential part.

    fn (dn + 1), and |f_t||dd_t| + f_t.dd_t + max(0, 2 beta_min |f_t| + f_t.dd_t): convex in f for fixed dq and in dq
    for fixed f, zero everywhere only at a state.
    """
    d = system.gap(dq)
    tangent, slide = np.hypot(f[:, 1], f[:, 2]), np.hypot(d[:, 1], d[:, 2])
    along = f[:, 1] * d[:, 1] + f[:, 2] * d[:, 2]
    normal = np.maximum(f[:, 0], 0.0) * np.maximum(d[:, 0] + 1.0, 0.0)
    return normal, tangent * slide + along + np.maximum(0.0, 2.0 * bounds.beta * tangent + along)


def _most(values: Floats) -> float:
    return float(np.max(values, initial=0.0))
