"""The family of equations between programme A and Coulomb's law (see `continuation`): residuals and Newton's method.

Forces and kappa go out point by point (4 x 4), which leaves one unsymmetric factorisation of A P A' a step. A step
leaves a share of fn, kappa, of the opening g = dn + 1 - theta mu^2 kappa fn and of the room c = (mu^2 fn^2 - t^2) / 2.

A start at theta = 1 comes from any motion with dn > -1: the forces of each point are then the least of

    (1 + dn) fn - |dd_t| t + beta sqrt(t^2 + (soft s)^2) + alpha t^2 / (2 s) - nu s (ln fn + ln c)

with friction against sliding, so that all equations of points hold and only the balance is off. Newton's method on
that, damped as for self-concordant functions, needs ten to thirty rounds of 2 x 2.

By hand: where dn = 0 and there is no sliding, fn (1 - 2 nu s / fn) = nu s, so fn = 3 nu s.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cyclopean.analysis.coupled.states import Bounds
from cyclopean.analysis.quadratic_cones import reach
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["Family", "Iterate", "Stage"]

SMOOTH = 1e-6  # friction coefficient below which a joint has none
KEPT = 0.05  # share of what is positive that a step leaves
SHIFT = 1e-9  # of A P A'
TINY, STUCK = 1e-3, 8  # a step shorter than that is none; such steps before a stage is given up
FITTED, FITS = 1e-6, 80  # decrement at which a point's forces are the least; rounds at most


@dataclass(frozen=True, slots=True)
class Stage:
    """One member of the family."""

    alpha: float  # displacement for friction of the lighter block's weight
    theta: float  # share of dilatancy
    nu: float  # what every product is smoothed to
    soft: float  # friction below which its direction is smoothed


@dataclass(frozen=True, slots=True, eq=False)
class Iterate:
    """Forces (q, 3), multipliers (q,) of the bound of friction, motion (6 m,) and the gaps (q, 3) that it makes."""

    f: Floats
    kappa: Floats
    dq: Floats
    d: Floats

    def moved(self, change: Floats, dq: Floats, dd: Floats, length: float) -> "Iterate":
        """After a share of a step: (q, 4) of forces and kappa."""
        f, kappa = self.f + length * change[:, :3], self.kappa + length * change[:, 3]
        return Iterate(f, kappa, self.dq + length * dq, self.d + length * dd)


@dataclass(frozen=True, slots=True, eq=False)
class _Off:
    """What an iterate misses, and what it has left."""

    balance: Floats  # (6 m,)
    press: Floats  # (q,)
    bound: Floats  # (q,)
    slide: Floats  # (q, 2)
    g: Floats  # (q,)
    c: Floats  # (q,)
    t: Floats  # (q,) smoothed size of friction
    w: Floats  # (q,) what friction is multiplied with


class Family:
    """The equations of one system."""

    def __init__(self, system: EquilibriumSystem, bounds: Bounds, schur: Schur) -> None:
        self.system, self.schur = system, schur
        self.beta, self.size, self.mu = 2.0 * bounds.beta, system.lighter, system.mu
        self.rough = system.mu > SMOOTH

    @cached_property
    def rough_system(self) -> EquilibriumSystem:
        """The system with a trace of friction in smooth joints, for solvers that need some."""
        return self.system if self.rough.all() else replace(self.system, mu=np.maximum(self.mu, SMOOTH))

    def begun(self, dq: Floats, stage: Stage) -> Iterate:
        """An iterate of theta = 1 whose points are as they should be for a (6 m,) motion with dn > -1."""
        d, s, mu = self.system.gap(dq), self.size, np.where(self.rough, self.mu, 1.0)
        open_, slide = np.maximum(1.0 + d[:, 0], 1e-9), np.hypot(d[:, 1], d[:, 2])
        nu, alpha, soft = stage.nu * s, stage.alpha / s, stage.soft * s
        fn, t = 3.0 * nu / open_, np.zeros_like(s)
        for _ in range(FITS):
            c, root = 0.5 * ((mu * fn) ** 2 - t * t), np.hypot(t, soft)
            slope = open_ - nu / fn - nu * mu**2 * fn / c, (self.beta / root + alpha + nu / c) * t - slide
            bend = nu / fn**2 - nu * mu**2 / c + nu * (mu**2 * fn / c) ** 2
            flat = self.beta * soft**2 / root**3 + alpha + nu / c + nu * (t / c) ** 2
            mixed = -nu * mu**2 * fn * t / c**2
            full = bend * flat - mixed**2
            step = (mixed * slope[1] - flat * slope[0]) / full, (mixed * slope[0] - bend * slope[1]) / full
            decrement = np.sqrt(np.maximum(-(slope[0] * step[0] + slope[1] * step[1]) / nu, 0.0))
            length = np.where(decrement > 0.25, 1.0 / (1.0 + decrement), 1.0)
            fn, t = fn + length * step[0], t + length * step[1]
            if not (decrement.max(initial=0.0) > FITTED):
                break
        c = 0.5 * ((mu * fn) ** 2 - t * t)
        against = -d[:, 1:] / np.maximum(slide, 1e-300)[:, None]
        f = np.column_stack([fn, t[:, None] * against])
        f[~self.rough] = np.column_stack([nu / open_, 0.0 * nu, 0.0 * nu])[~self.rough]
        return Iterate(f, np.where(self.rough, nu / c, 0.0), dq, d)

    def converged(self, at: Iterate, stage: Stage, steps: int) -> tuple[Iterate, bool, int]:
        """Newton's method on one stage: where it ends, whether at a solution, and after how many steps."""
        stuck, step = 0, 0
        for step in range(1, steps + 1):
            try:
                at, length = self._stepped(at, stage)
            except (SolverError, np.linalg.LinAlgError):
                break
            stuck = stuck + 1 if length < TINY else 0
            if stuck > STUCK:
                break
            if self._small(self.off(at, stage), stage.nu):
                return at, True, step
        return at, False, step

    def dilation(self, at: Iterate, stage: Stage) -> Floats:
        """(q,) work that dilation still does at each point, in weights of the lighter block."""
        return np.asarray(stage.theta * self.mu**2 * at.kappa * at.f[:, 0] ** 2 / self.size)

    def off(self, at: Iterate, stage: Stage) -> _Off:
        """What an iterate misses of the equations of a stage."""
        fn, ft = at.f[:, 0], at.f[:, 1:]
        square = ft[:, 0] ** 2 + ft[:, 1] ** 2
        t = np.sqrt(square + (stage.soft * self.size) ** 2)
        g = at.d[:, 0] + 1.0 - stage.theta * self.mu**2 * at.kappa * fn
        c = 0.5 * ((self.mu * fn) ** 2 - square)
        w = stage.alpha / self.size + self.beta / t + at.kappa
        nu = stage.nu * self.size
        bound = np.where(self.rough, at.kappa * c - nu, 0.0)
        slide = np.where(self.rough[:, None], at.d[:, 1:] + w[:, None] * ft, 0.0)
        return _Off(self.system.residual(at.f), fn * g - nu, bound, slide, g, c, t, w)

    def _small(self, off: _Off, nu: float) -> bool:
        """Whether an iterate is near enough to its stage to go on."""
        products = max(_most(off.press / self.size), _most(off.bound / self.size))
        rest = max(_most(self.system.own(off.balance)), _most(off.slide))
        return bool(products < 2.0 * nu and rest < max(1e-10, 0.5 * nu))

    def _stepped(self, at: Iterate, stage: Stage) -> tuple[Iterate, float]:
        """One step of Newton, as far as everything positive stays so; its length."""
        off = self.off(at, stage)
        answer = np.linalg.solve(self._jacobian(at, stage, off), self._sides(at, off))
        P, constant = np.ascontiguousarray(answer[:, :3, :3]), answer[:, :, 3]
        dq = self._solved(P, off.balance - self.system.A @ constant[:, :3].ravel())
        dd = self.system.gap(dq)
        change = -constant - np.einsum("kij,kj->ki", answer[:, :, :3], dd)
        length = self._length(at, stage, off, change, dd)
        return at.moved(change, dq, dd, length), length

    def _jacobian(self, at: Iterate, stage: Stage, off: _Off) -> Floats:
        """(q, 4, 4) derivatives of a point's equations in fn, fu, fv, kappa."""
        fn, ft, kappa = at.f[:, 0], at.f[:, 1:], at.kappa
        dilating = stage.theta * self.mu**2
        J = np.zeros((len(fn), 4, 4))
        J[:, 0, 0], J[:, 0, 3] = off.g - fn * dilating * kappa, -dilating * fn * fn
        J[:, 1, 0], J[:, 1, 3] = kappa * self.mu**2 * fn, off.c
        J[:, 1, 1:3] = -kappa[:, None] * ft
        J[:, 2, 1] = J[:, 3, 2] = off.w
        J[:, 2:, 1:3] -= (self.beta / off.t**3)[:, None, None] * ft[:, :, None] * ft[:, None, :]
        J[:, 2:, 3] = ft
        J[~self.rough, 1:] = np.eye(4)[[3, 1, 2]]  # no kappa and no friction
        return J

    def _sides(self, at: Iterate, off: _Off) -> Floats:
        """(q, 4, 4): what the gap changes in a point's equations, and what they miss."""
        sides = np.zeros((len(at.f), 4, 4))
        sides[:, 0, 0] = at.f[:, 0]
        sides[:, 2, 1] = sides[:, 3, 2] = self.rough
        sides[:, 0, 3], sides[:, 1, 3], sides[:, 2:, 3] = off.press, off.bound, off.slide
        return sides

    def _solved(self, P: Floats, right: Floats) -> Floats:
        """A P A' dq = right, refined once."""
        factor = self.schur.unsymmetric(P, SHIFT)
        dq = factor.solve(right)
        back = self.system.A @ np.einsum("kij,kj->ki", P, self.system.gap(dq)).ravel()
        return np.asarray(dq + factor.solve(right - back))

    def _length(self, at: Iterate, stage: Stage, off: _Off, change: Floats, dd: Floats) -> float:
        """Longest step that leaves a share of all that is positive."""
        rough, mu = self.rough, self.mu
        room = min(reach(at.f[:, 0], change[:, 0]), reach(at.kappa[rough], change[rough, 3]))
        length = min(1.0, (1.0 - KEPT) * room)
        for _ in range(60):
            f, kappa = at.f + length * change[:, :3], at.kappa + length * change[:, 3]
            g = at.d[:, 0] + length * dd[:, 0] + 1.0 - stage.theta * mu**2 * kappa * f[:, 0]
            c = 0.5 * ((mu * f[:, 0]) ** 2 - f[:, 1] ** 2 - f[:, 2] ** 2)
            if (g > KEPT * off.g).all() and (c > KEPT * off.c)[rough].all():
                break
            length *= 0.8
        return length


def _most(values: Floats) -> float:
    return float(np.max(np.abs(values), initial=0.0))
