"""A load on the road above: how it spreads through the fill, and onto which stones.

A load of P newtons stands on a line across the whole road, at x. The fill (the highest, if there are several) spreads
it over the depth d below it, along x: evenly within d tan(angle) on either side, or as a line load on an elastic half
space (Boussinesq 1885; for a line Flamant 1892), sigma = 2 P / (pi d (1 + (s / d)2)2) at a distance s, cut off at 2 d.
What lies over nothing is laid on the rest, so that all of the load arrives. Without fill it stands on the stones.
"""

from dataclasses import dataclass

import numpy as np
import shapely

from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.exposed import Exposed, exposed, joined_loads, resultants
from cyclopean.assembly.field_forces import UP, seen_from_above
from cyclopean.assembly.field_loads import Fill
from cyclopean.assembly.loads import DEAD, Load
from cyclopean.errors import InputError

__all__ = ["Road"]

LINE = 1e-6  # of the model's size: half the width of what stands on a line
BEYOND = 2.0  # depths on either side within which a line load by Boussinesq has 96 % of its force
SLICES = 33  # strips of even pressure for the curve of Boussinesq: within 0.2 % of it in every strip's force


@dataclass(frozen=True, slots=True, eq=False)
class Road:
    """What lies open from above below a road, and the fill between."""

    pieces: Exposed
    fill: Fill | None
    size: float  # m, of the model

    @classmethod
    def of(cls, assembly: Assembly) -> "Road":
        """The road of a model: its highest fill, or the stones themselves."""
        fills = [row for row in assembly.actions if isinstance(row, Fill)]
        fill = max(fills, key=lambda row: row.height, default=None)
        above = exposed(assembly, UP, np.ones(len(assembly), bool)) if fill is None else seen_from_above(assembly, fill)
        return cls(above, fill, assembly.size)

    def loads(self, x: float, force: float) -> tuple[Load, ...]:
        """Forces on stones of a load (N) at x (m).

        Raises
        ------
        InputError
            Nothing lies below.
        """
        depth = self._depth(x)
        found: list[Load] = []
        strips = [(*strip, self._within(*strip[:2])) for strip in self._strips(x, depth)]
        there = sum(share for _, _, share, below in strips if len(below.block))
        for _, _, share, below in strips:
            if len(below.block):
                even = force * share / there / float(below.area.sum())
                found += resultants(below, even, np.zeros(3), np.tile(-UP, (len(below.block), 1)), DEAD)
        return joined_loads(found)

    @property
    def words(self) -> str:
        """How it spreads."""
        if self.fill is None or not self.fill.spread:
            return "not spread"
        spread = self.fill.spread
        return "spread by Boussinesq" if isinstance(spread, str) else f"spread by {spread:g} degrees"

    def _within(self, left: float, right: float) -> Exposed:
        """What lies below between two x (m)."""
        low, high = (value - self.pieces.origin[0] for value in (left, right))
        reach = 10.0 * self.size
        return self.pieces.within(shapely.box(low, -reach, high, reach))

    def _depth(self, x: float) -> float:
        """Mean depth (m) of fill on the line at x."""
        below = self._within(x - LINE * self.size, x + LINE * self.size)
        if not len(below.block):
            corners = self.pieces.corners[:, 0]
            raise InputError(
                f"x = {x:g} m: nothing lies below the road there; it reaches from {corners.min():g} to"
                f" {corners.max():g} m"
            )
        level = np.array([load.point[2] for load in resultants(below, 1.0, np.zeros(3), 0.0 * below.normal, DEAD)])
        return 0.0 if self.fill is None else max(self.fill.height - float(below.area @ level / below.area.sum()), 0.0)

    def _strips(self, x: float, depth: float) -> list[tuple[float, float, float]]:
        """Where it presses: left, right (m) and share of the load."""
        spread, line = 0.0 if self.fill is None else self.fill.spread, LINE * self.size
        if spread == "boussinesq" and depth > line:
            u = np.linspace(-BEYOND, BEYOND, SLICES + 1)
            part = np.diff(np.arctan(u) + u / (1.0 + u * u))
            return [*zip(x + depth * u[:-1], x + depth * u[1:], part, strict=True)]
        half = max(depth * np.tan(np.radians(0.0 if isinstance(spread, str) else spread)), line)
        return [(x - half, x + half, 1.0)]
