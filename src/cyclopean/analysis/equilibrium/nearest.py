"""The forces nearest to given ones that balance, on the edges of friction cones as well as inside.

Forces f leave r = A f + p; wanted is the least |df / s| with A df = -r and f + df in the cones. By its dual,

    z = f / s - (A S)'y,   f + df = s P_K(z),   min over y of  1/2 |d|^2 - 1/2 |z - P_K(z)|^2 - r.y,   d = -(A S)'y,

a convex function whose terms are all as small as what is to be mended, so that they keep their digits. Each step solves
(A S J S A' + shift) dy = r + A df, with J the generalised Jacobian of the projection, as `newton` does.
"""

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur, cone_jacobian, project_cones

__all__ = ["nearest"]

ROUNDS = 15  # most steps; quadratic where it ends at all
HALVINGS = 12  # of a step; where 1/4096 of it gains nothing, none does
ENOUGH = 1e-14  # own weights: what rounding leaves is for the polish
IDLE = 3  # steps that do not halve what is left, after which nothing is to be hoped for
SHIFT = 1e-9  # of the diagonal of S to begin with


def nearest(
    system: EquilibriumSystem, schur: Schur, f: Floats, residual: Floats, columns: Floats, mu: Floats
) -> Floats:
    """(q, 3) forces f + df; those given where nothing better is found.

    Parameters
    ----------
    system, schur
        With rows in own weights, columns 1; S of it.
    f : (q, 3)
        In the cones.
    residual : (6 m,)
        What they leave, in own weights; more exact than A f + p in doubles.
    columns : (q, 3)
        Scale s of every force; all three equal, or zero for components that stay as they are.
    mu : (q,)
        Of the cones.
    """
    scale = columns[:, 0]
    start = np.divide(f, scale[:, None], out=np.zeros_like(f), where=columns > 0.0)

    def at(y: Floats) -> tuple[Floats, Floats, Floats, float]:
        d = -np.where(columns > 0.0, scale[:, None] * system.gap(y), 0.0)
        z = start + d
        inside = project_cones(z, mu)
        change = np.where((inside == z), d, inside - start)
        left = residual + system.A @ (columns * change).ravel()
        value = 0.5 * float(np.sum(d * d) - np.sum((z - inside) ** 2)) - float(residual @ y)
        return z, change, left, value

    y = np.zeros(len(residual))
    z, change, left, value = at(y)
    worst, idle = float(np.max(np.abs(residual), initial=0.0)), 0
    best, least = change, worst
    for _ in range(ROUNDS):
        J = cone_jacobian(z, mu) * columns[:, :, None] * columns[:, None, :]
        try:
            step = schur.factor(J, max(SHIFT * min(1.0, worst), 1e-14)).solve(left)
        except SolverError:
            break
        slope, length = float(left @ step), 1.0
        for _ in range(HALVINGS):
            found = at(y + length * step)
            off = float(np.max(np.abs(found[2]), initial=0.0))
            if found[3] <= value - 1e-4 * length * slope or off < 0.5 * worst:
                break
            length *= 0.5
        y, (z, change, left, value), worst = y + length * step, found, off
        idle = 0 if worst < 0.5 * least else idle + 1
        if worst < least:
            best, least = change, worst
        if worst <= ENOUGH or idle >= IDLE or not np.isfinite(worst):
            break
    return f + columns * best
