"""Programme A by a proximal semismooth Newton method, whose answers have exact zeros.

Programme A prices the forces, `h(f) = sum c fn + beta |f_t| + alpha / 2 |f_t|^2` over the friction cones, and asks for
the cheapest that balance the loads. The method of multipliers repeats, with a growing sigma,

    maximise over q    min_f { h(f) + |f - f0|^2 / (2 sigma) + q.(A f + p) } - tau / (2 sigma) |q - q0|^2

whose inner minimum is f = prox(f0 - sigma A'q), in closed form point by point; then f0, q0 <- f, q [Rock]_, [Li]_.
Newton solves (sigma A J A' + tau / sigma) dq = A f + p - tau / sigma (q - q0), J the generalised Jacobian of the prox:
the pattern that RBE uses too. The term in tau keeps S regular where little is engaged.

By hand, with c = sigma = 1: a point pulled to V = (2, 0, 0) keeps fn = 1, one at (1/2, 0, 0) is let go.

References
----------
.. [Rock] Rockafellar: Augmented Lagrangians and applications of the proximal point algorithm in convex programming.
   Mathematics of Operations Research 1 (1976).
.. [Li] Li, Sun, Toh: A highly efficient semismooth Newton augmented Lagrangian method for solving lasso problems. SIAM
   J. Optim. 28 (2018).
"""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["Pace", "Prices", "Prox", "ProximalAnswer", "prox", "prox_jacobian", "proximal_newton"]

CEILING = 1e6  # of sigma: beyond that, S is too stiff for its factorisation
OUTER = 30  # most updates of (f0, q0)
TAU = 1e-4  # weight of the proximal term in q against the one in f


@dataclass(frozen=True, slots=True, eq=False)
class Prices:
    """What forces cost: c fn + beta |f_t| + alpha / 2 |f_t|^2 at each point, in displacements (eps = 1)."""

    normal: Floats  # (q,) c = 1 + s
    slide: float | Floats  # (q,) or one beta: how far a point slides at least before it has friction
    stiff: Floats  # (q,) alpha: how much further for a unit of friction

    def of(self, f: Floats) -> float:
        """H of (q, 3) forces."""
        t = np.hypot(f[:, 1], f[:, 2])
        return float(np.sum(self.normal * f[:, 0] + (self.slide + 0.5 * self.stiff * t) * t))


@dataclass(frozen=True, slots=True, eq=False)
class Prox:
    """The prox of sigma h at V: the forces, and where each point lies."""

    f: Floats  # (q, 3)
    inside: Bools  # within its cone, friction not at its bound
    edge: Bools  # friction at its bound mu fn
    pulled: Floats  # (q,) |V_t|
    friction: Floats  # (q,) |f_t|


def prox(V: Floats, prices: Prices, sigma: float, mu: Floats) -> Prox:
    """Min over f in K_mu of h(f) + |f - V|^2 / (2 sigma), for each row of (q, 3) V."""
    normal = V[:, 0] - sigma * prices.normal
    pulled = np.hypot(V[:, 1], V[:, 2])
    spare = pulled - sigma * prices.slide
    flat = 1.0 + sigma * prices.stiff
    friction = np.maximum(spare, 0.0) / flat
    inside = (normal > 0.0) & (friction <= mu * normal)
    apex = (normal + mu * spare) / (1.0 + mu * mu * flat)
    edge = ~inside & (apex > 0.0)
    f = np.zeros_like(V)
    f[:, 0] = np.where(inside, normal, np.where(edge, apex, 0.0))
    friction = np.where(inside, friction, mu * f[:, 0])
    share = friction / np.maximum(pulled, 1e-300)
    f[:, 1] = share * V[:, 1]
    f[:, 2] = share * V[:, 2]
    return Prox(f, inside, edge, pulled, friction)


def prox_jacobian(V: Floats, at: Prox, prices: Prices, sigma: float, mu: Floats) -> Floats:
    """(q, 3, 3) generalised Jacobian of the prox: symmetric, eigenvalues in [0, 1]."""
    flat = 1.0 + sigma * prices.stiff
    share = 1.0 / (1.0 + mu * mu * flat)
    J = np.zeros((len(V), 3, 3))
    J[:, 0, 0] = np.where(at.inside, 1.0, np.where(at.edge, share, 0.0))
    k = np.flatnonzero(at.friction > 0.0)
    e = V[k, 1:] / at.pulled[k, None]
    edge, m = at.edge[k], mu[k]
    along = np.where(edge, m * m * share[k], 1.0 / flat[k])
    across = at.friction[k] / at.pulled[k]
    lean = np.where(edge, m * share[k], 0.0)
    J[k, 0, 1] = J[k, 1, 0] = lean * e[:, 0]
    J[k, 0, 2] = J[k, 2, 0] = lean * e[:, 1]
    J[k, 1, 1] = across + (along - across) * e[:, 0] ** 2
    J[k, 2, 2] = across + (along - across) * e[:, 1] ** 2
    J[k, 1, 2] = J[k, 2, 1] = (along - across) * e[:, 0] * e[:, 1]
    return J


@dataclass(frozen=True, slots=True)
class Pace:
    """How the method of multipliers goes on, and when it stops."""

    sigma: float = 100.0  # first step size
    growth: float = 5.0  # of sigma
    enough: float = 1e-6  # balance, relative to the largest force, and stationarity at which to stop
    cap: int = 40  # most factorisations


@dataclass(frozen=True, slots=True, eq=False)
class ProximalAnswer:
    """Where the method stopped."""

    word: str  # "solved" | "unfinished"
    f: Floats  # (q, 3), exactly zero where inactive
    q: Floats  # (6 m,) multiplier of equilibrium = displacement


def proximal_newton(
    system: EquilibriumSystem,
    schur: Schur,
    prices: Prices,
    f: Floats,
    q: Floats,
    pace: Pace = Pace(),
) -> ProximalAnswer:
    """Programme A from a start (f, q) near its solution, to exact zeros.

    Parameters
    ----------
    system, schur
        Scaled system and its S.
    prices : Prices
        The objective.
    f, q : (q, 3), (6 m,)
        Start; a poor one costs factorisations.
    pace : Pace
        How fast, how far and how exactly.
    """
    began, word, sigma, enough = schur.factorisations, "unfinished", pace.sigma, pace.enough
    mu = system.mu
    slide = system.gap(q)
    size = max(1.0, float(np.max(np.abs(f), initial=0.0)))
    for _ in range(OUTER):
        f0, q0 = f, q
        inner = _Inner(system, prices, sigma, f0, q0)
        now = inner.at(q, slide)
        while True:
            moved = float(np.max(np.abs(now.prox.f - f0), initial=0.0)) / sigma
            if now.worst <= max(0.3 * enough * size, min(1e-2, 0.05 * moved)):
                break
            if schur.factorisations - began >= pace.cap:
                break
            J = prox_jacobian(now.V, now.prox, prices, sigma, mu)
            d = schur.factor(sigma * J, max(TAU / sigma, 1e-13)).solve(now.gradient)
            after = inner.searched(now, d, system.gap(d))
            stalled = now.worst < 1e-7 * size and after.worst > 0.5 * now.worst
            now = after
            if stalled:
                break
        f, q, slide = now.prox.f, now.q, now.slide
        size = max(1.0, float(np.max(np.abs(f), initial=0.0)))
        balance = float(np.max(np.abs(system.residual(f)), initial=0.0))
        stationarity = float(np.max(np.abs(prox(f - slide, prices, 1.0, mu).f - f), initial=0.0))
        if max(balance / size, stationarity) <= enough:
            word = "solved"
            break
        if schur.factorisations - began >= pace.cap:
            break
        sigma = min(sigma * pace.growth, CEILING)
    return ProximalAnswer(word, f, q)


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    q: Floats
    slide: Floats  # (q, 3) A'q
    V: Floats
    prox: Prox
    value: float
    gradient: Floats
    worst: float  # max |gradient|


class _Inner:
    """The concave function of q that one round maximises."""

    def __init__(self, system: EquilibriumSystem, prices: Prices, sigma: float, f0: Floats, q0: Floats) -> None:
        self.system, self.prices, self.sigma, self.f0, self.q0 = system, prices, sigma, f0, q0

    def at(self, q: Floats, slide: Floats) -> _Trial:
        V = self.f0 - self.sigma * slide
        found = prox(V, self.prices, self.sigma, self.system.mu)
        tie = (TAU / self.sigma) * (q - self.q0)
        gradient = self.system.residual(found.f) - tie
        off = found.f - self.f0
        value = self.prices.of(found.f) + float(np.sum(off * off)) / (2.0 * self.sigma)
        value += float(np.sum(slide * found.f)) + float(self.system.p @ q) - 0.5 * float(tie @ (q - self.q0))
        return _Trial(q, slide, V, found, value, gradient, float(np.max(np.abs(gradient), initial=0.0)))

    def searched(self, now: _Trial, d: Floats, slide: Floats) -> _Trial:
        """Backtrack along d; near the end, where the value has no digits left, a halved gradient will do."""
        rise, length = float(now.gradient @ d), 1.0
        after = self.at(now.q + d, now.slide + slide)
        for _ in range(20):
            if after.value >= now.value + 1e-4 * length * rise - 1e-13 * abs(now.value):
                break
            length *= 0.5
            after = self.at(now.q + length * d, now.slide + length * slide)
        return after
