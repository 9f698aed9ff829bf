"""Is every block in balance, measured by its own weight? Rigid-block equilibrium from solvers to forces for a file.

The whole model is solved at one scale first, and most are decided there. What is left, component by component, is
solved again with every block at its own scale. Forces are polished until each block balances to rounding of its own
weight; mechanisms have to pass the rule of the checker (`opening`) before they are called one.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from cyclopean.analysis.equilibrium.components import Part, component_labels, group, lightest
from cyclopean.analysis.equilibrium.exact_balance import Balance, exact_balance
from cyclopean.analysis.equilibrium.opening import MARGIN, drive, opened
from cyclopean.analysis.equilibrium.own_scale import Answer, answers, lighter_weight, own_scaled
from cyclopean.analysis.equilibrium.polishing import PLAIN, Polished, Polisher
from cyclopean.analysis.equilibrium.rbe import Outcome, falling, solve_rbe
from cyclopean.analysis.equilibrium.slack import AMPLE, centred, slack
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.arrays import Floats, Ints
from cyclopean.statics import EquilibriumSystem, Schur

__all__ = ["Decision", "decide_rigid"]

ACCEPTED = 5e-10  # of own weight: states with no slack come no further than this; certificates ask for 1e-9
FEW = 100  # blocks out of balance that are tried for a mechanism of their own before anything else
EVEN = 0.5  # lightest weight in those of others, above which blocks count as alike
FALLS = ("collapse", "infeasible")  # words of solvers that found no state


@dataclass(frozen=True, slots=True, eq=False)
class Decision(Outcome):
    """An outcome with forces for a certificate.

    These may differ from `f`, the state of least norm: they press more evenly where that had no slack.
    """

    state: Polished | None = None
    own: float = np.inf  # the largest residual in own weights, or own weights times own diagonals


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """One component, or the whole model, with what is needed to judge answers for it."""

    part: Part
    balance: Balance
    polisher: Polisher
    schur: Schur | None
    label: Ints

    @classmethod
    def of(cls, model: PreparedModel, part: Part, schur: Schur | None = None) -> "_Task":
        system = part.system
        schur = Schur(system) if schur is None and system.points else schur
        balance = exact_balance(model, system)
        return cls(part, balance, Polisher(system, balance, schur), schur, component_labels(system))

    @property
    def count(self) -> int:
        """Number of components."""
        return int(self.label.max(initial=-1)) + 1

    @property
    def share(self) -> Floats:
        """(m,) weight of the lightest block of the component, in own weights."""
        return np.asarray(lightest(self.label, self.balance.weight) / self.balance.weight)

    def open_parts(self, state: Polished) -> Ints:
        """Components that the state leaves out of balance, or in a balance that cannot be made exact."""
        poor = state.own.max(1) > PLAIN
        if self.part.system.points:
            poor |= slack(self.part.system, self.balance, state) < AMPLE
        return np.unique(self.label[poor])

    def accepted(self, state: Polished, limit: float = PLAIN) -> Polished | None:
        """The state, with slack if it can have it, where it is one; None where it is not, or may not be.

        What has slack can be made exact. Of the rest the checker asks for 1e-9 of the lightest block's weight: what a
        boulder may miss may be all that a pebble weighs which the boulder holds.
        """
        system = self.part.system
        if not state.worst <= limit:
            return None
        if system.points and (system.mu > 0.0).any():
            state = centred(system, self.balance, self.polisher, state)
            if np.min(slack(system, self.balance, state), initial=np.inf) >= AMPLE:
                return state
        share = self.share
        if not (state.own.max(1) <= limit * share).all():
            state = self.polisher.polished(state.f, share, zeros=False)
        return state if (state.own.max(1) <= limit * share).all() else None

    def falling(self, y: Floats | None) -> Floats | None:
        """The motion of the component that passes the rule best, alone; None where none passes."""
        if y is None or not len(self.label) or not np.isfinite(y).all():
            return None
        passes = drive(self.part.system, self.balance, self.label, y)
        best = int(np.argmax(passes))
        if not passes[best] >= MARGIN:
            return None
        return np.where(self.label[:, None] == best, y.reshape(-1, 6), 0.0).ravel()


def decide_rigid(
    model: PreparedModel,
    system: EquilibriumSystem,
    solver: str = "auto",
    weights: tuple[float, float] = (1.0, 1.0),
    schur: Schur | None = None,
) -> Decision:
    """Decide by rigid-block equilibrium, every block measured by its own weight.

    Parameters
    ----------
    model : PreparedModel
        As it is analysed.
    system : EquilibriumSystem
        Its equilibrium system, m free blocks and q points.
    solver, weights
        As `solve_rbe` takes them, and `schur`. Only "auto" goes on to every block's own scale.
    """
    schur = Schur(system) if schur is None and system.points else schur
    first = solve_rbe(system, solver, weights, schur)
    whole = _Task.of(model, Part(system, np.arange(system.blocks), np.arange(system.points)), schur)
    if (y := whole.falling(first.y)) is not None:
        return Decision("collapse", None, y, np.inf, first.bound, first.provenance)
    state = None if first.f is None else whole.polisher.polished(first.f, zeros=False)
    left = np.arange(whole.count) if state is None else whole.open_parts(state)
    tried = list(first.provenance.get("tried", []))
    shown = np.zeros((system.points, 3)) if state is None else state.f.copy()
    states: list[tuple[Part, Polished]] = []
    for c in left.tolist():
        part = whole.part if whole.count == 1 else group(system, whole.label == c)
        task = whole if whole.count == 1 else _Task.of(model, part)
        known = None if state is None else _cut(state, part)
        found: Polished | Floats | None = None if known is None else task.accepted(known)
        if found is None and first.word == "collapse" and first.y is not None:
            found = opened(part.system, task.balance, first.y.reshape(-1, 6)[part.blocks].ravel())
        if found is None and solver == "auto":
            found = _at_own_scale(task, known, tried)
            shown[part.points] = found.f if isinstance(found, Polished) else shown[part.points]
        elif found is None and known is not None:
            found = task.accepted(known, ACCEPTED)
        if isinstance(found, Polished):
            states.append((part, found))
        elif found is not None:
            y = part.spread(found, system.blocks)
            return Decision("collapse", None, y, np.inf, first.bound, _provenance(first, tried))
    provenance = _provenance(first, tried)
    if len(states) < len(left):
        own = np.inf if state is None else state.worst
        return Decision("undecided", first.f, first.y, first.balance, first.bound, provenance, own=own)
    state = _merged(system, state, states)
    return Decision("balanced", shown, None, first.balance, 0.0, provenance, state, state.worst)


def _at_own_scale(task: _Task, known: Polished | None, tried: list[dict[str, Any]]) -> Polished | Floats | None:
    """A state or a mechanism of one component, with every block at its own scale; None where neither was found."""
    system, balance = task.part.system, task.balance
    if (y := task.falling(falling(system))) is not None:
        return y
    if known is not None and (y := _few_falling(task, known)) is not None:
        return y
    best = known
    for answer in _answers(task, None if known is None else known.f):
        spent = {"solver": answer.solver, "word": answer.word, "factorisations": answer.factorisations}
        tried.append(spent | {"scale": "own"})
        if answer.f is not None:
            state = task.polisher.polished(answer.f, zeros=False)
            if (final := task.accepted(state)) is not None:
                return final
            best = state if best is None or state.worst < best.worst else best
        if answer.y is None:
            continue
        if (y := task.falling(answer.y)) is not None:
            return y
        if answer.word in FALLS and (y := opened(system, balance, answer.y)) is not None:
            return y
    return None if best is None else task.accepted(best, ACCEPTED)


def _few_falling(task: _Task, known: Polished) -> Floats | None:
    """A mechanism of the blocks that a state of the whole leaves out of balance, where they are few."""
    bad = known.own.max(1) > PLAIN
    if not 0 < bad.sum() <= FEW:
        return None
    return opened(task.part.system, task.balance, np.repeat(bad, 6).astype(float), (0.5,))


def _answers(task: _Task, known: Floats | None) -> Iterator[Answer]:
    """What the solvers say at several scales.

    Forces count in those that are known, then in the weight of the lighter block; rows in own weights, and at last in
    that of the lightest block: where a boulder's balance decides whether a pebble is held.
    """
    system = task.part.system
    if task.schur is None:
        return
    weight, diagonal = task.balance.weight / system.force_unit, task.balance.diagonal / system.length_unit
    lighter = lighter_weight(system, weight)
    scales = [(weight, lighter)]
    if known is not None:
        scales.insert(0, (weight, np.maximum(lighter, np.linalg.norm(known, axis=1))))
    if np.min(task.share) < EVEN:
        scales.append((weight * task.share, lighter))
    for rows, columns in scales:
        scaled = own_scaled(system, rows, diagonal, columns)
        yield from answers(system, scaled, columns, task.schur.on(scaled))


def _cut(state: Polished, part: Part) -> Polished:
    low = None if state.low is None else state.low[part.points]
    at, rows = part.points, part.blocks
    return Polished(state.high[at], low, state.f[at], state.residual[rows], state.own[rows], state.steps)


def _provenance(first: Outcome, tried: list[dict[str, Any]]) -> dict[str, Any]:
    """How the answer was found, with the last solver that was asked."""
    spent = sum(one["factorisations"] for one in tried)
    last = tried[-1]["solver"] if tried else first.provenance.get("solver", "none")
    return first.provenance | {"solver": last, "factorisations": spent, "tried": tried}


def _merged(system: EquilibriumSystem, state: Polished | None, states: list[tuple[Part, Polished]]) -> Polished:
    """One state of the whole from those of its components, which go before that of the whole."""
    q, m = system.points, system.blocks
    if state is None:
        state = Polished(np.zeros((q, 3)), None, np.zeros((q, 3)), np.zeros((m, 6)), np.zeros((m, 2)), 0)
    high, f, residual, own = state.high.copy(), state.f.copy(), state.residual.copy(), state.own.copy()
    low = np.zeros((q, 3)) if state.low is None else state.low.copy()
    for part, found in states:
        high[part.points], f[part.points] = found.high, found.f
        low[part.points] = 0.0 if found.low is None else found.low
        residual[part.blocks], own[part.blocks] = found.residual, found.own
    steps = state.steps + sum(found.steps for _, found in states)
    return Polished(high, low if low.any() else None, f, residual, own, steps)
