"""Forces made better until every block balances to rounding of its own weight, each force a sum of two doubles.

One step is f += D A'(A D A')^-1 r, r the residual as `exact_balance` has it, rows in own weights, D the inverse Hessian
of the barrier of each point's cone: of all corrections the one that is least against the room there is. A step whose
size in that measure is below 1 stays inside the cone; forces of zero stay zero.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cyclopean.analysis.certificates import inner_forces, inner_slope
from cyclopean.analysis.equilibrium.exact_balance import Balance, Parts, total
from cyclopean.analysis.equilibrium.nearest import nearest
from cyclopean.analysis.equilibrium.own_scale import lighter_weight, own_rows, own_scaled
from cyclopean.analysis.quadratic_cones import apply, determinant, longest
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["ENOUGH", "PLAIN", "Polished", "Polisher"]

ENOUGH = 1e-12  # residual in own weights at which a sum of two doubles is done; certificates ask for 1e-9
PLAIN = 1e-10  # ... at which single doubles will do: their files are half as long
HOPELESS = 1e-2  # ... beyond which a solver has found no state, and there is nothing to polish
ROUNDS = 12  # most steps; ordinary models need none or one, those within 1e-6 of a limit five
SHIFT = 1e-13  # of the diagonal of S, which is singular where blocks have few points that bear anything
INSIDE = 1.0 - 1e-12  # share of the cones' opening that a step may use; `inner_forces` leaves twice that


@dataclass(frozen=True, slots=True, eq=False)
class Polished:
    """Forces inside their cones, in world units, and how well they balance every block."""

    high: Floats  # (q, 3) N on block b; at joints without friction (x, 0, 0), see `Balance`
    low: Floats | None  # (q, 3) N to be added; None = zero
    f: Floats  # (q, 3) the same in the system's units and frames
    residual: Floats  # (m, 6) N, N m: what is left on each block
    own: Floats  # (m, 2) its sizes in own weights, and in own weights times own diagonals
    steps: int

    @property
    def parts(self) -> Parts:
        """The forces as `Balance` takes them."""
        return self.high, self.low

    @property
    def worst(self) -> float:
        """The largest of `own`."""
        return float(np.max(self.own, initial=0.0))


class Polisher:
    """Takes residuals off the forces of one system; S keeps the ordering that the solver made."""

    def __init__(self, system: EquilibriumSystem, balance: Balance, schur: Schur | None) -> None:
        self.system, self.balance, self.pattern = system, balance, schur
        self.slope = np.maximum(INSIDE * system.mu - 0.5 * (1.0 + system.mu**2) * balance.blur, 0.0)
        self.stretch = np.ones((system.points, 3))
        self.stretch[:, 0] = np.where(self.slope > 0.0, self.slope, 1.0)  # x = (slope fn, fu, fv) is in Q3
        self.straight = self.slope == 0.0  # only along the normal

    @cached_property
    def scaled(self) -> EquilibriumSystem:
        """The system with rows in own weights; many models need no step, and then not this either."""
        unit = self.system.force_unit, self.system.length_unit
        weight, diagonal = self.balance.weight / unit[0], self.balance.diagonal / unit[1]
        return own_scaled(self.system, weight, diagonal, np.ones(self.system.points))

    @cached_property
    def schur(self) -> Schur:
        """S of it, on the ordering that is there, if any is."""
        return Schur(self.scaled) if self.pattern is None else self.pattern.on(self.scaled)

    def polished(self, f: Floats, share: Floats | None = None, zeros: bool = True) -> Polished:
        """The best that (q, 3) forces f come to, in the system's units; f need not balance.

        Steps inside the cones come first. Where forces lie on the edges of their cones, these get stuck: then the
        nearest forces that balance are looked for, and polished again.

        Parameters
        ----------
        f : (q, 3)
            In the system's units.
        share : (m,), optional
            Residuals count in these of each block's own weight.
        zeros : bool
            Whether forces of zero stay zero.
        """
        scale = np.ones((self.system.blocks, 1)) if share is None else 1.0 / share[:, None]

        def worst(state: Polished) -> float:
            return float(np.max(state.own * scale, initial=0.0))

        best = self._stepped(f, scale)
        for awake in (False,) if zeros else (False, True):
            if not PLAIN < worst(best) or not best.worst <= HOPELESS or not len(f):
                break
            found = self._stepped(self._nearest(best, awake), scale)
            best = found if worst(found) < worst(best) else best
        return best

    def _nearest(self, state: Polished, awake: bool) -> Floats:
        """(q, 3) forces nearest to those of a state that balance, if the search for them ends."""
        lighter = lighter_weight(self.system, self.balance.weight / self.system.force_unit)
        size = np.linalg.norm(state.f, axis=1)
        size = np.where((size > 0.0) | awake, np.maximum(size, lighter), 0.0)
        columns = np.repeat(size[:, None], 3, 1)
        columns[self.straight, 1:] = 0.0
        off = self._in_own_units(state.residual)
        slope = np.where(self.straight, 1.0, inner_slope(self.system.mu, self.balance.blur))
        return nearest(self.scaled, self.schur, state.f, off, columns, slope)

    def _stepped(self, f: Floats, scale: Floats) -> Polished:
        """The best of what steps from (q, 3) f, put inside the cones, come to; residuals times (m, 1) scale count."""
        f = inner_forces(f, self.system.mu, self.balance.blur)
        f[self.straight, 1:] = 0.0

        def worst(state: Polished) -> float:
            return float(np.max(state.own * scale, initial=0.0))

        best = at = self._measured((self._turned(self.system.true_forces(f)), None), f, 0)
        steps = 0
        while (PLAIN if at.low is None else ENOUGH) < worst(at) and at.worst <= HOPELESS and steps < ROUNDS and len(f):
            try:
                step = self.step(at.f, -self._in_own_units(at.residual))
            except SolverError:
                break
            length = min(1.0, 0.9 * self.room(at.f, step))
            steps += 1
            parts, f = self._moved(at.parts, length * step), at.f + length * step
            plain = self._measured((parts[0], None), f, steps)  # the first of two doubles is the sum, rounded
            if worst(plain) <= PLAIN:
                return plain
            at = self._measured(parts, f, steps)
            stuck = not worst(at) < 0.7 * worst(best)
            best = at if worst(at) < worst(best) else best
            if (stuck and steps > 3) or not np.isfinite(at.worst):
                break
        return best

    def step(self, f: Floats, wanted: Floats) -> Floats:
        """(q, 3) change of forces that makes A df the (6 m,) wanted one in own units, least against the room at f.

        Raises
        ------
        SolverError
            S cannot be factorised.
        """
        D = self._metric(f)
        y = self.schur.factor(D, SHIFT).solve(wanted)
        return apply(D, self.scaled.gap(y))

    def room(self, f: Floats, step: Floats) -> float:
        """Largest t with f + t step, (q, 3) each, in all cones."""
        x, d = self.stretch * f, self.stretch * step
        moves = np.abs(d).max(1) > 0.0
        return longest(x[moves], d[moves])

    def _metric(self, f: Floats) -> Floats:
        """(q, 3, 3) D = 2 x x' - det(x) J in x = (slope fn, fu, fv): inverse Hessian of -log det, to a factor."""
        x = self.stretch * f
        det = np.where(x[:, 0] > 0.0, determinant(x), 0.0)
        D = 2.0 * x[:, :, None] * x[:, None, :] - det[:, None, None] * np.diag([1.0, -1.0, -1.0])
        D[self.straight, 1:, 1:] = 0.0
        return np.asarray(D / (self.stretch[:, :, None] * self.stretch[:, None, :]))

    def _in_own_units(self, residual: Floats) -> Floats:
        """(6 m,) of (m, 6) N, N m."""
        return residual.ravel() * own_rows(self.balance.weight, self.balance.diagonal)

    def _measured(self, parts: Parts, f: Floats, steps: int) -> Polished:
        residual = self.balance.residual(parts)
        return Polished(*parts, f, residual, self.balance.own(residual), steps)

    def _turned(self, local: Floats) -> Floats:
        """(q, 3) forces in N, as `Balance` wants them, of those in the system's units and frames."""
        force = np.einsum("qi,qij->qj", local * self.system.force_unit, self.system.frame)
        if self.balance.sliding.any():
            at = self.balance.sliding
            force[at] = 0.0
            force[at, 0] = local[at, 0] * self.system.force_unit / self.balance.area[at]
        return np.asarray(force)

    def _moved(self, parts: Parts, step: Floats) -> Parts:
        high, low = parts
        added = self._turned(step)
        high, rest = total(high, added)
        return total(high, rest if low is None else rest + low)
