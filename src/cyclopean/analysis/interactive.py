"""A verdict that follows while somebody drags: the same blocks under other friction, gravity and push.

A, its pattern and the ordering of S = A D A' belong to the blocks; friction only scales cones and gravity only p. So a
change of either costs a few Newton steps from the last y, or one product where the last mechanism still shows collapse:

    p(g)   linear in gravity: p = p(given loads) + M g
    still  p'y / ||P_K(-A'y)|| >= 1e6 total loads for the mechanism y found before: still unstable, nothing to solve

What comes out here is a claim. `check` makes a verdict of it, with the claim as its `warm`: it prepares the model
afresh, as if it came from a file, and asks the independent checker.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis.equilibrium.newton import collapse_bound, newton, sharpen_mechanism
from cyclopean.analysis.equilibrium.rbe import COLLAPSE, LOST, PROMISING, Outcome, solve_rbe
from cyclopean.analysis.proving import spread, utilisation
from cyclopean.analysis.settings import DENSITY, GRAVITY, MU
from cyclopean.analysis.verdict import Result
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError, SolverError
from cyclopean.statics import EquilibriumSystem, Schur, body_loads, equilibrium_system, turned_gravity

__all__ = ["Answer", "Knobs", "LiveModel"]

STEPS = 14  # factorisations that a live answer may take before the question is left to slower methods
AGAIN = 6  # ... to make a mechanism exact again that the last step has blurred
QUICK = 400  # blocks up to which the interior point, too, answers while somebody waits


@dataclass(frozen=True, slots=True)
class Knobs:
    """What can be turned while one looks on.

    Raises
    ------
    InputError
        A value that is not finite, or friction below zero.
    """

    mu: float = MU  # where a contact gives none
    everywhere: bool = False  # mu also takes the place of what contacts give
    tilt: float = 0.0  # degrees
    azimuth: float = 0.0  # degrees from +x to +y
    push: tuple[float, float] = (0.0, 0.0)  # along x and y, in shares of the weight

    def __post_init__(self) -> None:
        if not np.isfinite([self.mu, self.tilt, self.azimuth, *self.push]).all():
            raise InputError("knobs: expected finite numbers")
        if not self.mu >= 0.0:
            raise InputError(f"mu {self.mu:g}: expected a number >= 0")

    def turned(self, gravity: Floats) -> Floats:
        """(3,) m/s2: gravity tilted, and the push, which does not tilt with it."""
        size = float(np.linalg.norm(gravity))
        push = np.array([*self.push, 0.0])
        return np.asarray(turned_gravity(gravity, self.tilt, self.azimuth) + size * push)


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What the live solvers claim; word "" = not decided within their few steps."""

    knobs: Knobs
    system: EquilibriumSystem
    outcome: Outcome | None
    seconds: float

    @property
    def word(self) -> str:
        """Either "balanced", "collapse" or ""."""
        return "" if self.outcome is None or self.outcome.word == "undecided" else self.outcome.word


class LiveModel:
    """Blocks and contacts that stay, under knobs that turn; not to be used from two threads at once.

    Parameters
    ----------
    assembly : Assembly
        Blocks with contacts, supports marked by `fixed`.
    gravity : (3,) m/s2
        Before any tilt.
    density : float
        kg/m3 where a block gives none.

    Attributes
    ----------
    plain : bool
        Whether the quick methods apply: no partial supports, no joints that pull. Else all is left to `check`.

    Raises
    ------
    InputError
        The contacts are missing.
    """

    def __init__(self, assembly: Assembly, gravity: Floats | None = None, density: float = DENSITY) -> None:
        if assembly.contacts is None:
            raise InputError("live model: its contacts are missing")
        self.assembly = assembly
        self.gravity = np.array(GRAVITY if gravity is None else gravity, float)
        self.fixed = np.array([block.fixed is True for block in assembly.blocks], bool)
        self.density = density
        self.contacts = assembly.contacts
        base = equilibrium_system(assembly, self.contacts.with_mu(MU), self.fixed, self.gravity, density)
        still = body_loads(assembly, np.zeros(3), density)[base.free]
        self.plain = not (any(block.held for block in assembly.blocks) or self.contacts.strength.any())
        self._given = still
        self._mass = (body_loads(assembly, np.array([1.0, 0.0, 0.0]), density)[base.free] - still)[:, 0]
        self._base = base
        self._schur = Schur(base)
        self._rest: tuple[Floats, float] | None = None  # y of the last state of rest, and its unit of force
        self._mechanism: Floats | None = None

    def system(self, knobs: Knobs) -> EquilibriumSystem:
        """The equilibrium system under these knobs; only p, mu and the unit of force are new."""
        gravity = knobs.turned(self.gravity)
        wrench = self._given.copy()
        wrench[:, :3] += self._mass[:, None] * gravity
        size = np.linalg.norm(wrench[:, :3], axis=1)
        unit = float(np.mean(size)) if size.any() else 1.0
        p = wrench / unit
        p[:, 3:] /= self._base.length_unit
        mu = self.friction(knobs)[self.contacts.patch[self._base.used]]
        return replace(self._base, p=p.ravel(), mu=mu, force_unit=unit)

    def friction(self, knobs: Knobs) -> Floats:
        """(c,) friction coefficients of the contacts under these knobs."""
        given = self.contacts.mu
        return np.where(np.isnan(given) | knobs.everywhere, knobs.mu, given)

    def solve(self, knobs: Knobs) -> Answer:
        """Claim an answer by rigid-block equilibrium, from where the last one ended."""
        began = time.perf_counter()
        system = self.system(knobs)
        outcome = self._warm(system) if self.plain and system.points and system.blocks else None
        if outcome is None and self.plain and system.blocks <= QUICK:
            outcome = solve_rbe(system, schur=self._schur)
            if outcome.word == "collapse":
                self._mechanism = outcome.y
        return Answer(knobs, system, outcome, time.perf_counter() - began)

    def learn(self, result: Result) -> None:
        """Take over a mechanism that slower methods found for these blocks, to begin from it."""
        if result.mechanism is None or len(result.assembly) != len(self.assembly):
            return
        y = result.mechanism[self._base.free].copy()
        y[:, 3:] *= self._base.length_unit
        self._mechanism = y.ravel()

    def _warm(self, system: EquilibriumSystem) -> Outcome | None:
        """What the last mechanism or the last state of rest leads to; None where that decides nothing."""
        known = self._mechanism
        if known is not None and (bound := collapse_bound(system, known)) >= COLLAPSE:
            return _fallen(known, bound, "known mechanism", 0)
        before = self._schur.factorisations
        start = None if self._rest is None else self._rest[0] * (self._rest[1] / system.force_unit)
        try:
            answer = newton(system, self._schur, start, cap=STEPS, lost=LOST + 20.0 / system.blocks)
            if answer.word == "balanced":
                self._rest, self._mechanism = (answer.y, system.force_unit), None
                spent = {"solver": "newton", "factorisations": self._schur.factorisations - before}
                return Outcome("balanced", answer.f, None, answer.residual, 0.0, spent)
            for y in (answer.y, known):
                if y is None or not collapse_bound(system, y) >= PROMISING:
                    continue
                sharp = sharpen_mechanism(system, self._schur, y, cap=AGAIN)
                if (bound := collapse_bound(system, sharp)) >= COLLAPSE:
                    self._mechanism = sharp
                    return _fallen(sharp, bound, "newton", self._schur.factorisations - before)
        except SolverError:
            return None
        return None

    def shown(self, answer: Answer) -> Result:
        """What there is to draw of a claim. Its verdict is "undecided": nobody has proved it yet."""
        contacts = self.contacts
        contacts = replace(contacts, mu=self.friction(answer.knobs))
        force, rows, outcome = None, None, answer.outcome
        if outcome is not None and outcome.word == "balanced" and outcome.f is not None:
            force = spread(answer.system, contacts, outcome.f * answer.system.force_unit)
        if outcome is not None and outcome.word == "collapse" and outcome.y is not None:
            rows = np.zeros((len(self.assembly), 6))
            rows[self._base.free] = outcome.y.reshape(-1, 6)
            rows[:, 3:] /= self._base.length_unit
        return Result(
            assembly=self.assembly,
            contacts=contacts,
            fixed=self.fixed,
            method="rbe",
            verdict="undecided",
            reason="A solver claims it; no certificate has been checked yet.",
            assumed={},
            gravity=answer.knobs.turned(self.gravity),
            residuals={},
            force=force,
            frame=contacts.frame,
            utilisation=None if force is None else utilisation(contacts, force),
            mechanism=rows,
            provenance={} if outcome is None else outcome.provenance,
        )


def _fallen(y: Floats, bound: float, solver: str, spent: int) -> Outcome:
    return Outcome("collapse", None, y, np.inf, bound, {"solver": solver, "factorisations": spent})
