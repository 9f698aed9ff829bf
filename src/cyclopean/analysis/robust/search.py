"""For how large a length does the answer hold in every drawing within it? What is told has passed the checker."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from cyclopean.analysis.certificates import certify
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.robust.falling import bodies, falling
from cyclopean.analysis.robust.family import Family
from cyclopean.analysis.robust.standing import standing
from cyclopean.analysis.verdict import Result, Within
from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.proof import verify

__all__ = ["certain_length", "drawings", "require_known"]

CLOSE = 1.1  # how near the largest length is found, as a factor
TRIES = 12  # lengths at most
LEAST = 1e-6  # of the first length: shorter ones are not looked at
FURTHER = 50.0  # by which the next length is larger or smaller at most
FIRST = 1e-3  # of the smallest contact's width: the length that is tried first where none is asked for

Attempt = Callable[[float], tuple[dict[str, Any] | None, float]]


def require_known(model: PreparedModel) -> None:
    """Say what drawings of a family are not known of.

    Raises
    ------
    InputError
        Joints that pull, a settlement, partial supports, rough or curved contacts, contacts at points.
    """
    pairs = zip(model.assembly.blocks, model.fixed, strict=True)
    held = next((block.id for block, whole in pairs if block.held and not whole), None)
    for known, what in (
        (not model.contacts.strength.any(), "joints that pull"),
        (model.settled is None, "a settlement"),
        (held is None, f"blocks that are partly held, such as '{held}'"),
        (bool(np.isnan(model.contacts.leaning).all()), "rough or curved contacts"),
        (not model.contacts.at_points.any(), "contacts at points"),
    ):
        if not known:
            raise InputError(f"`within` does not go with {what}; leave it out")


def drawings(model: PreparedModel, result: Result, length: float, degrees: float | None) -> Result:
    """The result with what is certain of the drawings within a length (m) and an angle: undecided unless it is proved.

    Parameters
    ----------
    model : PreparedModel
        As it was analysed.
    result : Result
        By rigid-block equilibrium.
    length, degrees : float
        As asked for.
    """
    moved = np.zeros((0, 6)) if result.mechanism is None else result.mechanism
    attempt = _attempt(model, Family(length, degrees), None if result.verdict == "stable" else moved)
    certain, certificate = (0.0, None) if result.verdict == "undecided" else _search(attempt, length, False)
    within = Within(length, degrees, certain >= length, certain)
    if within.holds:
        reason = f"{result.reason} {within.words()}"
        return replace(result, reason=reason, within=within, certificate=certificate)
    if result.verdict == "undecided":
        return replace(result, within=within)
    reason = f"As drawn it is {result.verdict}. {within.words()}"
    return replace(result, verdict="undecided", reason=reason, within=within, certificate=None)


def certain_length(model: PreparedModel, mechanism: Floats | None = None) -> float:
    """The largest length (m), to a tenth, for which an answer was proved of all drawings; 0 where none was.

    The answer is that the model stands, or with an (n, 6) mechanism that it falls.
    """
    try:
        require_known(model)
    except InputError:
        return 0.0
    if not len(model.contacts) or model.fixed.all():
        return 0.0
    first = FIRST * float(np.min(model.contacts.area / model.contacts.perimeter))
    return _search(_attempt(model, Family(first), mechanism), first, True)[0]


def _attempt(model: PreparedModel, family: Family, mechanism: Floats | None) -> Attempt:
    """A proof for one length, and the share of it that was needed, where that can be told; else infinite."""
    system = model.system()
    labels = [] if mechanism is None or not len(mechanism) else list(bodies(system, mechanism))

    def attempt(length: float) -> tuple[dict[str, Any] | None, float]:
        if mechanism is None:
            kind, (found, share) = "rbe-state-within", standing(model, family.of(length))
        else:
            proofs = (falling(model, system, label, family.of(length)) for label in labels)
            kind, found, share = "rbe-mechanism-within", next(filter(None, proofs), None), np.inf
        return None if found is None else certify(model, system, kind, found), share

    return attempt


def _search(attempt: Attempt, first: float, grows: bool) -> tuple[float, dict[str, Any] | None]:
    """The largest length (m) to a tenth, and its certificate; no larger than the first unless it `grows`.

    What is needed grows with the length about in proportion, which tells where to look next.
    """
    known: list[tuple[float, dict[str, Any]]] = []
    low, high, length = 0.0, np.inf, first
    for _ in range(TRIES):
        certificate, share = attempt(length)
        if certificate is None:
            high = length
        else:
            low = length
            known.append((length, certificate))
        if (low == first and not grows) or high <= CLOSE * low:
            break
        guess = 0.95 * length / share if 0.0 < share < np.inf else length * (8.0 if low else 0.125)
        if low and high < np.inf:
            near = (high / low) ** 0.2
            guess = np.clip(guess, low * near, high / near)
        length = float(np.clip(guess, length / FURTHER, FURTHER * length))
        if length < LEAST * first:
            break
    return next((one for one in reversed(known) if verify(one[1]).proved), (0.0, None))
