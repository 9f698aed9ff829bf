"""The largest multiplier of the live loads, from below by forces and from above by a mechanism."""

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from cyclopean.analysis.limits.interior import SCALE, SMALLEST_MU, LimitPoint, limit_interior
from cyclopean.analysis.limits.pencil import Pencil, total
from cyclopean.analysis.limits.polish import Bracket, opened, opening, polished, rebalanced
from cyclopean.analysis.limits.reference import limit_by_clarabel
from cyclopean.analysis.rigid.newton import collapse_bound
from cyclopean.analysis.rigid.rbe import COLLAPSE, solve_rbe
from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.statics import Schur, project_cones

__all__ = ["CLOSED", "SOLVERS", "LimitOutcome", "solve_limit"]

SOLVERS = ("auto", "interior", "clarabel")
WANTED = 1e-7  # relative gap at which polishing stops
CLOSED = 1e-6  # ... and at which both bounds count as one
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
    provenance: dict[str, Any] = field(default_factory=dict)


def solve_limit(loads: Pencil, solver: str = "auto") -> LimitOutcome:
    """Find the largest s with A f = -(p0 + s q), f in K.

    "auto" takes the structured interior point, and Clarabel where that does not close the gap; what either finds is
    polished on both sides (see `polish`), and only what has been measured there is returned.

    Parameters
    ----------
    loads : Pencil
        Dead and live loads.
    solver : {"auto", "interior", "clarabel"}
        One of them alone, or both.
    """
    tried: list[dict[str, Any]] = []
    rest = solve_rbe(loads.system)
    spent = int(rest.provenance.get("factorisations", 0))
    tried.append({"solver": f"rbe: {rest.provenance['solver']}", "word": rest.word, "factorisations": spent})
    if rest.word == "collapse" and rest.provenance["solver"] == "connectivity":
        return _settled(_fallen(loads, rest.y), tried)
    if loads.system.points == 0:
        return LimitOutcome("undecided", provenance={"solver": "none", "tried": tried})
    outcome = _bounded(loads, solver, rest.f if rest.word == "balanced" else None, tried)
    if rest.word != "collapse":
        return _settled(outcome, tried)
    if outcome.word == "falls" or outcome.y is None:  # no multiplier at all was found
        return _settled(_fallen(loads, outcome.y if outcome.word == "falls" else rest.y), tried)
    back = _bounded(loads.turned(), solver, None, tried)
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


def _bounded(loads: Pencil, solver: str, f0: Floats | None, tried: list[dict[str, Any]]) -> LimitOutcome:
    """Both bounds of the largest s; `f0` are forces at s = 0, where there are any."""
    chain = ("interior", "clarabel") if solver == "auto" else (solver,)
    schur = Schur(loads.system)
    bracket = Bracket()
    cut = _Cut(loads, schur, bracket)
    for name in chain:
        if name == "interior" and loads.system.mu.min() < SMALLEST_MU:
            continue
        before = schur.factorisations
        try:
            point = limit_interior(loads, schur, cut) if name == "interior" else limit_by_clarabel(loads)
        except SolverError as fault:
            tried.append({"solver": name, "word": str(fault), "factorisations": schur.factorisations - before})
            continue
        spent = schur.factorisations - before if name == "interior" else point.steps
        if point.word == "infeasible":
            spent = schur.factorisations - before if name == "interior" else point.steps
            refuting = cut.refuting(point.y)
            tried.append({"solver": name, "word": point.word, "factorisations": spent})
            if refuting is not None:
                return LimitOutcome("falls", y=refuting)
            continue
        if point.word == "unbounded":
            found = _unbounded(loads, point, f0)
            tried.append({"solver": name, "word": point.word, "factorisations": spent})
            if found is not None:
                return found
            continue
        before = schur.factorisations
        cut(point.y)
        _raise(loads, schur, bracket, point.f, point.s, f0)
        if not (bracket.gap(SCALE) <= CLOSED / 3.0):
            polished(loads, schur, point.f, point.y, point.s, bracket, WANTED, SCALE)
            if bracket.best is not None and bracket.near is not None:
                cut(bracket.best)
                _raise(loads, schur, bracket, *bracket.near, f0)
        spent += schur.factorisations - before
        tried.append({"solver": name, "word": point.word, "factorisations": spent, "gap": bracket.gap(SCALE)})
        if bracket.gap(SCALE) <= CLOSED:
            break
    word: Literal["limit", "undecided"] = "limit" if bracket.gap(SCALE) <= CLOSED else "undecided"
    return LimitOutcome(word, bracket.lower, bracket.upper, -np.inf, bracket.f, bracket.y)


class _Cut:
    """Takes motions as upper bounds, helped by one that opens every joint where they need help."""

    def __init__(self, loads: Pencil, schur: Schur, bracket: Bracket) -> None:
        self.loads, self.schur, self.bracket = loads, schur, bracket
        self.wide: Floats | None = None
        self.sought = False

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
        wide = self._opening()
        if wide is not None:
            bracket.cut_upper(loads, opened(loads, y, wide))
        return bracket.upper

    def refuting(self, y: Floats) -> Floats | None:
        """A motion that no multiplier of a sane size resists, from one that is nearly one; None where it is not.

        Displaced structures may stand at one multiplier only; to an interior point that looks almost like none.
        """
        wide = self._opening()
        y = y if wide is None else opened(self.loads, y, wide)
        bounds = [collapse_bound(self.loads.at(s), y) for s in (0.0, SANE, -SANE)]
        return y if min(bounds) >= COLLAPSE else None

    def _opening(self) -> Floats | None:
        if not self.sought:
            self.sought = True
            try:
                self.wide = opening(self.loads, self.schur)
            except SolverError:
                self.wide = None
        return self.wide


def _raise(loads: Pencil, schur: Schur, bracket: Bracket, f: Floats, s: float, f0: Floats | None) -> None:
    """Take forces as a lower bound, put back into balance; a little of those at s = 0 gives them room in their cones.

    Where the loads of the limit vanish altogether, no force is exact: `f0` fades instead.
    """
    none = -float(loads.q @ loads.system.p) / float(loads.q @ loads.q)
    if abs(none - s) <= 1e-6 * abs(s) and np.linalg.norm(loads.loads(none)) <= 1e-12 * np.linalg.norm(loads.system.p):
        f, s = np.zeros_like(f), none
    if f0 is not None:
        bracket.raise_lower(loads, f0, 0.0)
    for share in (0.0, 1e-8, 5e-8, 2e-7, 5e-7, 1e-5, 1e-3) if f0 is not None and s > 0.0 else (0.0,):
        mixed, at = (f, s) if f0 is None else ((1.0 - share) * f + share * f0, (1.0 - share) * s)
        if not (at > bracket.lower):
            return
        if bracket.raise_lower(loads, rebalanced(loads, schur, mixed, at), at):
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
