"""What would decide a model that coupled analysis leaves undecided: a larger eta, or more friction.

Each is a search with a small budget, and what it finds is proved like a verdict: a certificate of the model with that
eta or that friction passes the checker. Neither is a verdict on the model as it is; only where the eta that is needed
turns out to be no larger than the one asked for, the state found is one.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from cyclopean.analysis.coupled.continuation import FACTORISATIONS
from cyclopean.analysis.coupled.search import CoupledOutcome, solve_cra
from cyclopean.analysis.coupled.smallest_eta import smallest_eta
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.proving import Claim, coupled_claim, prove
from cyclopean.analysis.settings import Settings
from cyclopean.analysis.undecided import Friction, StableAt
from cyclopean.analysis.verdict import Result
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem

__all__ = ["what_would_decide"]

ETAS = (2.0, 5.0, 20.0)  # times the one asked for
FRICTIONS = (1.1, 1.25, 1.5)  # times what there is
LARGEST = 1e6  # eta in eps that bounds allow
SHARE = 4  # a search gets this part of the main one's budgets
NODES = 20, 300  # of the tree, in each: at least, and at most
PROGRAMMES = 60  # that lower eta
DIGITS = 4  # of the eta that is said, rounded up


def what_would_decide(
    model: PreparedModel,
    settings: Settings,
    result: Result,
    until: float = np.inf,
    progress: Callable[[str], None] = lambda _: None,
) -> Result:
    """Try a larger eta and more friction, one after the other, until one of each is proved.

    Parameters
    ----------
    model : PreparedModel
        As it was analysed.
    settings : Settings
        What the user said.
    result : Result
        Undecided by coupled analysis, and explained so far.
    until : float
        Time of `time.perf_counter` at which to stop; what was not tried by then is told.
    progress : callable
        Is told the name of each stage as it begins.

    Returns
    -------
    Result
        Still undecided but for a state that the eta asked for turns out to allow.
    """
    known = result.undecided
    if known is None or not len(result.contacts):
        return result
    progress("trying a larger eta")
    at, late = _first(ETAS, partial(_with_eta, model, settings, until), until)
    if isinstance(at, Result):
        return at
    progress("trying more friction")
    mu, too_late = _first(FRICTIONS, partial(_with_friction, model, settings, until), until)
    untried = [what for what, skipped in (("a larger eta", late), ("more friction", too_late)) if skipped]
    known = replace(known, stable_at=at, friction=mu, untried=tuple(untried))
    return replace(result, undecided=known, reason=known.reason())


def _first(factors: Sequence[float], attempt: Callable[[float], Any], until: float) -> tuple[Any, bool]:
    """What the first attempt finds that finds anything, and whether some were stopped."""
    for factor in factors:
        if time.perf_counter() >= until:
            return None, True
        try:
            found = attempt(factor)
        except (SolverError, np.linalg.LinAlgError):  # numerically beyond it; the next may do better
            continue
        if found is not None:
            return found, False
    return None, False


def _searched(system: EquilibriumSystem, bounds: Bounds, settings: Settings, until: float) -> CoupledOutcome:
    """What a search with a small budget finds."""
    seconds = max(min(until - time.perf_counter(), settings.seconds), 1e-9)
    nodes = min(max(settings.nodes // SHARE, NODES[0]), NODES[1])
    small = replace(settings, seconds=seconds, nodes=nodes, effort=1.0)
    return solve_cra(system, bounds, small, factorisations=FACTORISATIONS // SHARE)


def _with_eta(model: PreparedModel, settings: Settings, until: float, factor: float) -> StableAt | Result | None:
    """A state at so many times eta, lowered and proved; the verdict where it needs no more than what was asked for."""
    system, bounds, eps = model.system(), settings.bounds().unit(), settings.eps
    found = _searched(system, replace(bounds, eta=min(factor * bounds.eta, LARGEST)), settings, until)
    if found.word != "coupled" or found.f is None or found.dq is None:
        return None
    eta, f, dq = smallest_eta(system, bounds, found.f, found.dq, PROGRAMMES, lambda: time.perf_counter() >= until)
    claim = Claim("cra-state", f, dq, provenance=found.provenance | {"route": "smallest eta"})
    needed = bounds.eta if eta <= bounds.eta else _rounded_up(eta)
    result = prove(model, replace(settings, eta=eps * needed), system, claim)
    if result.verdict != "stable" or result.certificate is None:
        return None
    return result if eta <= bounds.eta else StableAt(eps * needed, result.certificate)


def _with_friction(model: PreparedModel, settings: Settings, until: float, factor: float) -> Friction | None:
    """So many times the friction, where the model is proved stable with it."""
    mu = model.contacts.mu
    if not mu.any():
        return None
    one = float(f"{factor * mu[0]:.3g}") if mu.min() == mu.max() else None
    grown = replace(model, contacts=replace(model.contacts, mu=factor * mu if one is None else np.full_like(mu, one)))
    outcome = _searched(grown.system(), settings.bounds().unit(), settings, until)
    if outcome.word != "coupled" or prove(grown, settings, grown.system(), coupled_claim(outcome)).verdict != "stable":
        return None
    return Friction(factor, one)


def _rounded_up(value: float) -> float:
    """The next number of so many digits, so that what is said is what is proved.

    >>> _rounded_up(11.8139046), _rounded_up(80.0)
    (11.82, 80.0)
    """
    unit = 10.0 ** (np.floor(np.log10(value)) + 1 - DIGITS)
    return float(f"{np.ceil(value / unit * (1.0 - 1e-12)) * unit:.{DIGITS}g}")
