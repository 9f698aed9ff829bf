"""The largest multiplier of the live loads, from below by forces and from above by a mechanism."""

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from cyclopean.analysis.equilibrium.newton import collapse_bound
from cyclopean.analysis.equilibrium.rbe import COLLAPSE
from cyclopean.analysis.equilibrium.reference import BIG
from cyclopean.analysis.limit_analysis.budget import UNLIMITED, Budget
from cyclopean.analysis.limit_analysis.interior import SCALE, SMALLEST_MU, LimitPoint, Start, limit_interior
from cyclopean.analysis.limit_analysis.load_family import Pencil, total
from cyclopean.analysis.limit_analysis.polish import Bracket, opened, polished, rebalanced
from cyclopean.analysis.limit_analysis.reference import limit_by_clarabel
from cyclopean.analysis.limit_analysis.starting import AtRest
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import PlaneSystem, plane_system, project_cones

__all__ = ["CLOSED", "SOLVERS", "LimitOutcome", "solve_limit"]

SOLVERS = ("auto", "interior", "clarabel")
WANTED = 1e-7  # relative gap at which polishing stops
CLOSED = 1e-6  # ... and at which both bounds count as one
MENDING = 0.1  # of the time: what putting forces back into balance takes where the search is stopped
SANE = 1e3  # multiplier up to which a motion has to refute all
HEAVY = 1e3  # live load in dead load that is proved where there is no limit


@dataclass(frozen=True, slots=True, eq=False)
class LimitOutcome:
    """What the solvers found, in scaled units; a claim until a certificate of it has been checked.

    "limit": both bounds. "unbounded": no multiplier brings it down; `lower` is one that was proved. "falls": it does
    not stand without live loads; `lower` and `upper` then say where it does (the window up to `upper` begins at
    `least`), or, with neither force nor `lower`, that no multiplier from `upper` on helps. "undecided": bounds apart.
    """

    word: Literal["limit", "unbounded", "falls", "undecided"]
    lower: float = -np.inf
    upper: float = np.inf
    least: float = -np.inf
    f: Floats | None = None  # (q, 3) at lower
    y: Floats | None = None  # (6 m,)
    late: bool = False  # whether time ran out
    provenance: dict[str, Any] = field(default_factory=dict)


def solve_limit(
    loads: Pencil, solver: str = "auto", budget: Budget = UNLIMITED, rest: AtRest | None = None
) -> LimitOutcome:
    """Find the largest s with A f = -(p0 + s q), f in K.

    "auto" solves a structure in the plane there, and what that does not settle as it is. It takes the structured
    interior point, and Clarabel where that does not close the gap; what either finds is polished on both sides (see
    `polish`), and only what has been measured there is returned.

    Parameters
    ----------
    loads : Pencil
        Dead and live loads.
    solver : {"auto", "interior", "clarabel"}
        One of them alone, or both.
    budget : Budget
        When to stop; both bounds are then as far apart as they are.
    rest : AtRest, optional
        What is known of the system whatever grows on it.
    """
    plane = plane_system(loads.system, loads.q) if solver == "auto" else None
    if plane is not None:
        flat = _solved(replace(loads, system=plane.system, q=plane.loads(loads.q)), solver, budget, None)
        whole = _lifted(loads, plane, flat)
        if whole.word == "limit" or budget.before(MENDING).over:  # no time is left to search the whole
            return whole
    return _solved(loads, solver, budget, rest)


def _lifted(loads: Pencil, plane: PlaneSystem, flat: LimitOutcome) -> LimitOutcome:
    """Both bounds that were found in the plane, measured on the whole; undecided where they are then apart."""
    bracket = Bracket()
    if flat.f is not None:
        bracket.raise_lower(loads, plane.forces(flat.f), flat.lower)
    if flat.y is not None:
        bracket.cut_upper(loads, plane.motion(flat.y))
    word = flat.word if bracket.gap(SCALE) <= CLOSED else "undecided"
    return replace(flat, word=word, lower=bracket.lower, upper=bracket.upper, f=bracket.f, y=bracket.y)


def _solved(loads: Pencil, solver: str, budget: Budget, rest: AtRest | None) -> LimitOutcome:
    """As `solve_limit`, of the system as it is."""
    tried: list[dict[str, Any]] = []
    rest = AtRest(loads.system) if rest is None else rest
    dead = rest.outcome
    spent = int(dead.provenance.get("factorisations", 0))
    tried.append({"solver": f"rbe: {dead.provenance['solver']}", "word": dead.word, "factorisations": spent})
    if dead.word == "collapse" and dead.provenance["solver"] == "connectivity":
        return _settled(_fallen(loads, dead.y), tried)
    if not loads.system.points:
        return LimitOutcome("undecided", provenance={"solver": "none", "tried": tried})
    outcome = _bounded(loads, rest, solver, dead.f if dead.word == "balanced" else None, tried, budget)
    if dead.word != "collapse":
        return _settled(outcome, tried)
    if outcome.word == "falls" or outcome.y is None:  # no multiplier at all was found
        return _settled(_fallen(loads, outcome.y if outcome.word == "falls" else dead.y), tried)
    back = _bounded(loads.turned(), rest, solver, None, tried, budget)
    least = -back.lower if back.word in ("limit", "undecided") else -np.inf
    return _settled(replace(outcome, word="falls", least=least), tried)


def _settled(outcome: LimitOutcome, tried: list[dict[str, Any]]) -> LimitOutcome:
    names = [t["solver"] for t in tried]
    provenance = {
        "solver": names[-1].partition(":")[0],
        "factorisations": sum(t["factorisations"] for t in tried),
        "tried": tried,
    }
    return replace(outcome, provenance=provenance)


def _fallen(loads: Pencil, y: Floats | None) -> LimitOutcome:
    """Nothing stands at s = 0, nor beyond where the live loads do not hinder the motion."""
    if y is None:
        return LimitOutcome("falls")
    upper = 0.0 if float(loads.q @ y) >= -1e-9 * float(np.abs(loads.q) @ np.abs(y)) else np.inf
    return LimitOutcome("falls", upper=upper, y=y)


def _bounded(
    loads: Pencil, rest: AtRest, solver: str, f0: Floats | None, tried: list[dict[str, Any]], budget: Budget
) -> LimitOutcome:
    """Both bounds of the largest s; `f0` are forces at s = 0, where there are any."""
    chain = ("interior", "clarabel") if solver == "auto" else (solver,)
    bracket = Bracket()
    if f0 is not None:
        bracket.raise_lower(loads, f0, 0.0)
    cut, schur = _Cut(loads, rest, bracket, budget), rest.schur
    for name in chain:
        if name == "interior" and loads.system.mu.min() < SMALLEST_MU:
            continue
        if budget.limited and (budget.over or (name == "clarabel" and loads.system.blocks > BIG)):
            continue
        before = schur.factorisations
        try:
            point = _by_interior(cut, f0) if name == "interior" else limit_by_clarabel(loads, max(budget.left, 1e-3))
        except SolverError as fault:
            tried.append({"solver": name, "word": str(fault), "factorisations": schur.factorisations - before})
            continue
        spent = schur.factorisations - before if name == "interior" else point.steps
        entry: dict[str, Any] = {"solver": name, "word": point.word, "factorisations": spent}
        if point.word in ("infeasible", "unbounded"):
            tried.append(entry)
            if (found := _without_end(cut, point, f0)) is not None:
                return found
            continue
        before = schur.factorisations
        _closed(cut, point, f0)
        entry["factorisations"] += schur.factorisations - before
        tried.append(entry | {"gap": bracket.gap(SCALE)})
        if bracket.gap(SCALE) <= CLOSED:
            break
    word: Literal["limit", "undecided"] = "limit" if bracket.gap(SCALE) <= CLOSED else "undecided"
    late = budget.over and word == "undecided"
    return LimitOutcome(word, bracket.lower, bracket.upper, -np.inf, bracket.f, bracket.y, late)


def _by_interior(cut: "_Cut", f0: Floats | None) -> LimitPoint:
    """The structured interior point, from inside both cones where there is such a start."""
    loads, budget = cut.loads, cut.budget
    inside = Start(cut.rest.pressed if f0 is not None else None, cut.rest.opened(budget))
    cut(loads.q)  # a poor bound that costs nothing: every block as its live load pushes it, and every joint opened
    point = limit_interior(loads, cut.rest.schur, cut, start=inside, budget=budget.before(MENDING))
    cut(point.y)
    return point


def _without_end(cut: "_Cut", point: LimitPoint, f0: Floats | None) -> LimitOutcome | None:
    """No multiplier, or all of them, once that has been measured."""
    if point.word == "unbounded":
        return _unbounded(cut.loads, point, f0)
    refuting = cut.refuting(point.y)
    return None if refuting is None else LimitOutcome("falls", y=refuting)


def _closed(cut: "_Cut", point: LimitPoint, f0: Floats | None) -> None:
    """Mend both sides of a solver's answer, as far as that goes."""
    loads, schur, bracket = cut.loads, cut.rest.schur, cut.bracket
    cut(point.y)
    _raise(cut, point.f, point.s, f0)
    if not (bracket.gap(SCALE) <= CLOSED / 3.0) and not cut.budget.over:
        polished(loads, schur, point.f, point.y, point.s, bracket, WANTED, SCALE, cut.budget)
        if bracket.best is not None and bracket.near is not None:
            cut(bracket.best)
            _raise(cut, *bracket.near, f0)


@dataclass(frozen=True, slots=True, eq=False)
class _Cut:
    """Takes motions as upper bounds, helped by one that opens every joint where they need help."""

    loads: Pencil
    rest: AtRest
    bracket: Bracket
    budget: Budget

    def __call__(self, y: Floats) -> float:
        """The least upper bound so far."""
        loads, bracket = self.loads, self.bracket
        power = float(loads.q @ y)
        if not power > 0.0:
            return bracket.upper
        y = y / power
        bracket.cut_upper(loads, y)
        if bracket.upper + float(loads.system.p @ y) <= 0.1 * WANTED * (SCALE + abs(bracket.upper)):
            return bracket.upper
        wide = self.rest.opened(self.budget)
        if wide is not None:
            bracket.cut_upper(loads, opened(loads, y, wide))
        return bracket.upper

    def refuting(self, y: Floats) -> Floats | None:
        """A motion that no multiplier of a sane size resists, from one that is nearly one; None where it is not.

        Displaced structures may stand at one multiplier only; to an interior point that looks almost like none.
        """
        wide = self.rest.opened(self.budget)
        y = y if wide is None else opened(self.loads, y, wide)
        bounds = [collapse_bound(self.loads.at(s), y) for s in (0.0, SANE, -SANE)]
        return y if min(bounds) >= COLLAPSE else None


def _raise(cut: _Cut, f: Floats, s: float, f0: Floats | None) -> None:
    """Take forces as a lower bound, put back into balance; a little of those at s = 0 gives them room in their cones.

    Where the loads of the limit vanish altogether, no force is exact: `f0` fades instead.
    """
    loads, bracket = cut.loads, cut.bracket
    none = -float(loads.q @ loads.system.p) / float(loads.q @ loads.q)
    if abs(none - s) <= 1e-6 * abs(s) and np.linalg.norm(loads.loads(none)) <= 1e-12 * np.linalg.norm(loads.system.p):
        f, s = np.zeros_like(f), none
    shares = (0.0, 1e-8, 5e-8, 2e-7, 5e-7, 1e-5, 1e-3, 0.1) if f0 is not None and s > 0.0 else (0.0,)
    for share in shares:
        mixed, at = (f, s) if f0 is None else ((1.0 - share) * f + share * f0, (1.0 - share) * s)
        if not (at > bracket.lower) or (share and cut.budget.over):
            return
        if bracket.raise_lower(loads, *rebalanced(loads, cut.rest.schur, mixed, at)):
            return


def _unbounded(loads: Pencil, point: LimitPoint, f0: Floats | None) -> LimitOutcome | None:
    """Forces that balance any multiplier: those at s = 0 and the ray; proved at one where live loads are `HEAVY`."""
    live = total(loads.q)
    if f0 is None or not live > 0.0:
        return None
    s = HEAVY * max(total(loads.system.p), 1e-300) / live
    f = f0 + s * project_cones(point.f, loads.system.mu)
    if not (loads.balance(f, s) <= 5e-10):
        return None
    return LimitOutcome("unbounded", lower=s, f=f)
