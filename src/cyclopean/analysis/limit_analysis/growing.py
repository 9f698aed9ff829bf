"""A prepared model and what grows on it: its system, its live loads, its exact balance, each made once."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cyclopean.analysis.equilibrium.deciding import Decision, decide_rigid
from cyclopean.analysis.equilibrium.exact_balance import Balance, exact_balance, own_loads, product, stretched
from cyclopean.analysis.limit_analysis.live_load import Live, live_loads
from cyclopean.analysis.limit_analysis.load_family import Pencil, pencil
from cyclopean.analysis.limit_analysis.starting import AtRest
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.arrays import Floats
from cyclopean.assembly import Load
from cyclopean.errors import InputError
from cyclopean.statics import EquilibriumSystem, Schur, body_loads

__all__ = ["GrowingModel"]

SHARED = ("system", "rest", "standing")  # what does not depend on the live loads


@dataclass(frozen=True, eq=False)
class GrowingModel:
    """A model with its dead loads, and the live ones that a multiplier is about."""

    model: PreparedModel
    gravity: Floats  # (3,) m/s2, live
    loads: tuple[Load, ...] = ()  # live

    @classmethod
    def of(cls, model: PreparedModel, live: Live) -> "GrowingModel":
        """The model under what is said to grow."""
        return cls(model, *live_loads(model.assembly, live, model.gravity))

    @cached_property
    def system(self) -> EquilibriumSystem:
        """The equilibrium system of the dead loads."""
        return self.model.system()

    @cached_property
    def rest(self) -> AtRest:
        """What is known of the system whatever grows on it."""
        return AtRest(self.system)

    @property
    def schur(self) -> Schur | None:
        """S of the system; None without contacts."""
        return self.rest.schur if self.system.points else None

    @cached_property
    def standing(self) -> Decision:
        """What rigid-block equilibrium says of the dead loads alone, every block measured by its own weight."""
        model = self.at(0.0)
        return decide_rigid(model, model.system(), schur=self.schur)

    def beside(self, live: Live) -> "GrowingModel":
        """The same under other live loads: what is known of the dead loads is kept."""
        other = GrowingModel.of(self.model, live)
        other.__dict__.update({key: self.__dict__[key] for key in SHARED if key in self.__dict__})
        return other

    @cached_property
    def live(self) -> Floats:
        """(6 m,) live loads in the units of the system."""
        model, system = self.model, self.system
        p1 = body_loads(replace(model.assembly, loads=self.loads), self.gravity, model.density)[system.free]
        p1[:, 3:] /= system.length_unit
        return system.still(p1.ravel() / system.force_unit)

    @cached_property
    def pencil(self) -> Pencil:
        """Dead and live loads as the solvers take them.

        Raises
        ------
        InputError
            The live loads do not act on any block that is free to move.
        """
        model, system = self.model, self.system
        if system.blocks and not self.live.any():
            raise InputError("the live loads act on supports only, or in directions that supports hold; nothing grows")
        dead, grown = (
            self._size(gravity, loads) / system.force_unit
            for gravity, loads in ((model.gravity, model.assembly.loads), (self.gravity, self.loads))
        )
        return pencil(system, self.live, dead, grown)

    def _size(self, gravity: Floats, loads: Iterable[Load]) -> float:
        """Sum of weights and of loads on free blocks, as certificates count it (N)."""
        free = ~self.model.fixed
        weight = float(np.sum(self.model.mass[free]) * np.linalg.norm(gravity))
        return weight + float(sum(np.linalg.norm(load.force) for load in loads if free[load.block]))

    def at(self, times: float, dead: float = 1.0) -> PreparedModel:
        """The model under `dead` times its own loads and so many times the live ones."""
        model = self.model
        given = [(load, dead) for load in model.assembly.loads] + [(load, times) for load in self.loads]
        acting = (replace(load, force=factor * load.force) for load, factor in given)
        return model.under(dead * model.gravity + times * self.gravity, acting)

    @cached_property
    def _balance(self) -> tuple[Balance, Floats]:
        """The exact balance of the dead loads with two pushes for each live one; (m, 6, j) own loads, live."""
        twice = [load for load in self.loads for _ in range(2)]
        model = self.model.under(self.model.gravity, (*self.model.assembly.loads, *twice))
        return exact_balance(model, self.system), own_loads(model, self.system.free, self.gravity)

    def balance(self, times: float) -> Balance:
        """Of loads that are not rounded: next to a boulder's a pebble's weight is less than that."""
        dead, live = self._balance
        rows = live.reshape(-1, 3, 3)
        grown = np.stack(stretched(rows, np.full((len(rows), 1), times), None), 2).reshape(live.shape)
        free = ~self.model.fixed
        forces = np.array([load.force for load in self.loads if free[load.block]], float).reshape(-1, 3)
        push = dead.push.copy()
        push[len(push) - 2 * len(forces) :] = np.stack(product(np.full(forces.shape, times), forces), 1).reshape(-1, 3)
        return replace(dead, push=push, own_load=np.concatenate([dead.own_load, grown], 2))
