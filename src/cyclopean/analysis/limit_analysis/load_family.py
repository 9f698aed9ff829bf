"""The loads p(t) = p0 + t p1 of limit analysis on one equilibrium system, in scaled units."""

from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.statics import EquilibriumSystem, project_cones

__all__ = ["Pencil", "pencil", "proving_multiplier", "total"]

BOUND = 2e6  # forces that a mechanism has to demand, in total loads: twice what its certificate asks for


@dataclass(frozen=True, slots=True, eq=False)
class Pencil:
    """A f = -(p0 + t p1) = -(p0 + s q): the live loads q are scaled so that the largest on a block is of size 1.

    Inside this room the multiplier is s; t = unit s is the user's.
    """

    system: EquilibriumSystem  # its p is p0
    q: Floats  # (6 m,) scaled live loads
    unit: float
    dead: float  # W of p0 and of q, as certificates have it: sizes of weights and loads, one by one, and of pulls
    live: float

    def loads(self, s: float) -> Floats:
        """(6 m,) p at multiplier s."""
        return np.asarray(self.system.p + s * self.q)

    def at(self, s: float) -> EquilibriumSystem:
        """The equilibrium system at multiplier s."""
        return replace(self.system, p=self.loads(s), size=None)

    def turned(self) -> "Pencil":
        """The same with live loads the other way."""
        return replace(self, q=-self.q)

    def net(self, s: float) -> float:
        """Size of the loads at multiplier s, weight and loads of a block taken together: no more than W."""
        true = self.loads(s)
        if self.system.pull.any():
            along = np.zeros((self.system.points, 3))
            along[:, 0] = self.system.pull
            true = true + self.system.A @ along.ravel()
        return total(true)

    def balance(self, f: Floats, s: float) -> float:
        """||A f + p(s)|| in loads at s; no number, or infinite, where forces or s have run away."""
        with np.errstate(over="ignore", invalid="ignore"):
            off = float(np.linalg.norm(self.system.A @ f.ravel() + self.loads(s)))
            whole = self.net(s)
        return off / whole if whole > 0.0 else (0.0 if off == 0.0 else np.inf)


def pencil(system: EquilibriumSystem, p1: Floats, dead: float | None = None, live: float | None = None) -> Pencil:
    """Scale (6 m,) live loads, given in the scaled units of `system`.

    Parameters
    ----------
    system : EquilibriumSystem
        With the dead loads.
    p1 : (6 m,)
        Live loads.
    dead, live : float, optional
        W of both, scaled; by default that of the net force on each block.
    """
    size = float(np.max(np.abs(p1), initial=0.0))
    scale = 1.0 / size if size > 0.0 else 1.0
    own = total(system.p) if dead is None else dead
    grown = total(p1) if live is None else live
    return Pencil(system, scale * p1, scale, own + float(np.sum(np.abs(system.pull))), scale * grown)


def total(p: Floats) -> float:
    """Sum of the sizes of the forces (not moments) in (6 m,) p."""
    return float(np.sum(np.linalg.norm(p.reshape(-1, 6)[:, :3], axis=1)))


def proving_multiplier(loads: Pencil, y: Floats) -> float:
    """Least s from which the motion y proves that nothing stands; infinite where the live loads do no work in it.

    For every f in K that balances p(s): p(s)'y <= ||f|| ||P_K(-A'y)||. So with q'y > 0 all s are refuted for which
    p0'y + s q'y >= BOUND W(s) ||P_K(-A'y)||, and with an exact mechanism all s > -p0'y / q'y.
    """
    power = float(loads.q @ y)
    if not power > 0.0:
        return np.inf
    system = loads.system
    needed = BOUND * float(np.linalg.norm(project_cones(-system.gap(y), system.mu)))
    s = -float(system.p @ y) / power
    rounding = 4e-15 * float(np.abs(system.p) @ np.abs(y)) / power
    s += rounding + 1e-10 * abs(s)  # at s itself the work is zero, and rounded
    for sign in (1.0, -1.0):  # W(s) <= dead + |s| live
        slope = power - sign * needed * loads.live
        if slope > 0.0:
            found = (needed * loads.dead - float(system.p @ y)) / slope
            if sign * found >= 0.0:
                return max(s, found)
    return np.inf
