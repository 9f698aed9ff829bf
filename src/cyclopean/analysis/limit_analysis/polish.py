"""Both sides of a limit driven to rounding: forces exactly in their cones, a motion that no contact resists."""

from dataclasses import dataclass

import numpy as np

from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.load_family import Pencil, proving_multiplier
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.solvers import Factor
from cyclopean.statics import Schur, cone_jacobian, project_cones

__all__ = ["Bracket", "opened", "polished", "rebalanced"]

BALANCE = 2e-10  # of the total load: five times below what a certificate allows
EXACT = 1e-13  # likewise: better need not be
SHIFT = 1e-9  # of the diagonal at first; ten times as much after each short step


@dataclass(slots=True)
class Bracket:
    """The best of both sides met so far; everything in it has been measured."""

    lower: float = -np.inf
    f: Floats | None = None  # balances p(lower)
    upper: float = np.inf
    y: Floats | None = None  # refutes every s >= upper
    best: Floats | None = None  # the latest motion, q'y = 1: nearly a mechanism, whatever it proves
    near: tuple[Floats, float] | None = None  # the latest forces and multiplier, whatever their balance

    def gap(self, scale: float) -> float:
        """(upper - lower) relative to the larger of them, or to `scale` where both are small."""
        if not (np.isfinite(self.lower) and np.isfinite(self.upper)):
            return np.inf
        return (self.upper - self.lower) / max(abs(self.upper), abs(self.lower), scale)

    def raise_lower(self, loads: Pencil, f: Floats, s: float) -> bool:
        """Take forces in the cones that balance p(s) to `BALANCE`, if they are better."""
        if s > self.lower and loads.balance(f, s) <= BALANCE:
            self.lower, self.f = s, f
            return True
        return False

    def cut_upper(self, loads: Pencil, y: Floats) -> None:
        """Take a motion (6n,), scaled, if it proves more."""
        found = proving_multiplier(loads, y)
        if found < self.upper:
            self.upper, self.y = found, y


def polished(
    loads: Pencil,
    schur: Schur,
    f: Floats,
    y: Floats,
    s: float,
    bracket: Bracket,
    wanted: float,
    scale: float,
    budget: Budget = UNLIMITED,
) -> Bracket:
    """Proximal method of multipliers from a solution that is nearly one.

    With f_k the forces so far, every outer step solves

        A f + p0 + s q = 0,   q'y = 1,   f = P_K(f_k - sigma A'y)

    by semismooth Newton on S = A J A' bordered by q. Such f are in their cones and balance p(s): s is a lower bound
    whatever the step. The motion misses by no more than ||P_K(-A'y)|| <= ||f - f_k|| / sigma, which falls with every
    step the faster the larger sigma.

    Parameters
    ----------
    loads : Pencil
        Dead and live loads.
    schur : Schur
        S of the same system.
    f, y, s : (q, 3), (6 m,), float
        Where to start; y need not be normalised.
    bracket : Bracket
        What is known already; improved in place.
    wanted : float
        Gap at which to stop.
    scale : float
        Multiplier below which the gap counts absolutely.
    budget : Budget
        When to stop whatever the gap.

    References
    ----------
    .. [Rock] Rockafellar: Augmented Lagrangians and applications of the proximal point algorithm in convex programming.
       Math. Oper. Res. 1 (1976).
    """
    system = loads.system
    power = float(loads.q @ y)
    if not power > 0.0:
        return bracket
    y = y / power
    f = project_cones(f, system.mu)
    size = float(np.linalg.norm(f)) / max(float(np.linalg.norm(system.gap(y))), 1e-300)
    for factor in (10.0, 100.0, 1e3, 1e4, 1e5):
        if budget.over:
            break
        sigma = max(size * factor, 1e-12)
        try:
            f, y, s, solved = _step(loads, schur, f, y, s, sigma, budget)
        except SolverError:
            break
        bracket.best, bracket.near = y, (f, s)
        bracket.raise_lower(loads, f, s)
        bracket.cut_upper(loads, y)
        if bracket.gap(scale) <= wanted or not solved:
            break
    return bracket


def _step(
    loads: Pencil, schur: Schur, f_k: Floats, y: Floats, s: float, sigma: float, budget: Budget, cap: int = 25
) -> tuple[Floats, Floats, float, bool]:
    """One outer step: minimise phi(y) = ||P_K(f_k - sigma A'y)||^2 / (2 sigma) - p0'y on the plane q'y = 1."""
    system, p0, q = loads.system, loads.system.p, loads.q
    enough = 1e-13 * (1.0 + float(np.max(np.abs(f_k), initial=0.0)))
    x = f_k - sigma * system.gap(y)
    f = project_cones(x, system.mu)
    phi = float(np.sum(f * f)) / (2.0 * sigma) - float(p0 @ y)
    shift, least, best = SHIFT, np.inf, (f, y, s)
    idle = 0
    for _ in range(cap):
        g0 = np.asarray(system.A @ f.ravel()) + p0
        jacobian = cone_jacobian(x, system.mu)
        factor = _factor(schur, jacobian, shift)
        d, s = _bordered(loads, factor, jacobian, g0, 0.0)
        worst = float(np.max(np.abs(g0 + s * q), initial=0.0))
        if worst < least:
            idle = 0 if worst < 0.5 * least else idle + 1
            least, best = worst, (f, y, s)
        else:
            idle += 1
        if worst <= enough or idle > 4 or budget.over:
            break
        d = d / sigma
        slope, length = float(g0 @ d), 1.0
        for _ in range(25):
            y_new = y + length * d
            x_new = f_k - sigma * system.gap(y_new)
            f_new = project_cones(x_new, system.mu)
            phi_new = float(np.sum(f_new * f_new)) / (2.0 * sigma) - float(p0 @ y_new)
            off = np.asarray(system.A @ f_new.ravel()) + p0 + s * q
            if phi_new <= phi - 1e-4 * length * slope or float(np.max(np.abs(off), initial=0.0)) < 0.5 * worst:
                break
            length *= 0.5
        y, x, f, phi = y_new, x_new, f_new, phi_new
        shift = SHIFT if length > 0.2 else min(shift * 10.0, 1e-3)
    f, y, _ = best
    s = _nearest(loads, f)
    return f, y, s, least <= 1e3 * enough


def _bordered(loads: Pencil, factor: Factor, J: Floats, rhs: Floats, power: float) -> tuple[Floats, float]:
    """Solve S d - q s = rhs, q'd = power, with refinement.

    S is singular along the mechanism itself, which q then takes care of: without refinement the two cancel.
    """
    system, q = loads.system, loads.q
    along = factor.solve(q)
    bend = float(q @ along)
    d, s = np.zeros_like(rhs), 0.0
    best, least = (d, s), np.inf
    left, short = rhs, power
    for _ in range(5):
        more = factor.solve(left)
        extra = (short - float(q @ more)) / bend
        d, s = d + more + extra * along, s + extra
        left = rhs + s * q - np.asarray(system.A @ np.einsum("qij,qj->qi", J, system.gap(d)).ravel())
        short, worst, before = power - float(q @ d), float(np.max(np.abs(left), initial=0.0)), least
        if worst < least:
            best, least = (d, s), worst
        if worst <= 1e-14 * (1.0 + float(np.max(np.abs(rhs), initial=0.0))) or not (worst < 0.5 * before):
            break
    return best


def _nearest(loads: Pencil, f: Floats) -> float:
    """The multiplier whose loads these forces balance best."""
    q = loads.q
    return -float(q @ (np.asarray(loads.system.A @ f.ravel()) + loads.system.p)) / float(q @ q)


def _factor(schur: Schur, D: Floats, shift: float) -> Factor:
    for _ in range(6):
        try:
            return schur.factor(D, shift)
        except SolverError:
            shift = max(shift * 1e2, 1e-9)
    raise SolverError("the polish of a limit could not be factorised")


def rebalanced(loads: Pencil, schur: Schur, f: Floats, s: float, rounds: int = 4) -> tuple[Floats, float]:
    """Restore A f = -p(s) by the least move of f and s in the metric of D^-1, D that of the cones' barrier at f.

    In x = (mu fn, fu, fv), D = 2 x x' - det(x) J, its inverse Hessian: points at the apex stay, others move little
    across their cone's side. What still leaves a cone is projected back, and the best state met is returned. At the
    limit S = A D A' is nearly singular along the mechanism, in which the live loads do work: that is why s moves too,
    by next to nothing.
    """
    system = loads.system
    stretch = np.ones_like(f)
    stretch[:, 0] = 1.0 / np.maximum(system.mu, 1e-9)
    scale = stretch[:, :, None] * stretch[:, None, :]
    f = project_cones(f, system.mu)
    best, balance = (f, s), loads.balance(f, s)
    for _ in range(rounds):
        if not EXACT < balance < np.inf:  # what has run away is not brought back
            break
        x = f / stretch
        det = np.maximum(x[:, 0] ** 2 - x[:, 1] ** 2 - x[:, 2] ** 2, 0.0)
        D = (2.0 * x[:, :, None] * x[:, None, :] - det[:, None, None] * np.diag([1.0, -1.0, -1.0])) * scale
        off = np.asarray(system.A @ f.ravel()) + loads.loads(s)
        try:
            y, more = _bordered(loads, _factor(schur, D, 1e-13), D, off, 0.0)
        except SolverError:
            break
        f, s = project_cones(f - np.einsum("qij,qj->qi", D, system.gap(y)), system.mu), s + more
        if not (found := loads.balance(f, s)) < balance:
            break
        best, balance = (f, s), found
    return best


def opened(loads: Pencil, y: Floats, wide: Floats) -> Floats:
    """A motion (6n,) that is nearly a mechanism, made one by as much of the `opening` as it needs.

    With P_K(-A'y) = f, A'y + f is in K*; and -f + delta (1/2, 0, 0) is once delta >= 2 (fn + mu |f_t|).
    """
    system = loads.system
    f = project_cones(-system.gap(y), system.mu)
    needed = 2.0 * float(np.max(f[:, 0] + system.mu * np.hypot(f[:, 1], f[:, 2]), initial=0.0))
    rounding = 4e-15 * (1.0 + float(np.max(system.mu))) * float(np.max(np.abs(y), initial=0.0))
    return y + (needed * (1.0 + 1e-6) + rounding) * wide
