"""One sentence for each verdict that a person understands."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from cyclopean.analysis.answers import BALANCED
from cyclopean.analysis.coupled.states import Bounds
from cyclopean.analysis.equilibrium.rbe import BALANCE, COLLAPSE
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.arrays import Floats

__all__ = ["counted_on", "reason_for"]


def reason_for(
    model: PreparedModel,
    bounds: Bounds,
    kind: str,
    motion: Floats | None,
    figures: Mapping[str, float],
    provenance: Mapping[str, Any],
) -> str:
    """Say why.

    Parameters
    ----------
    model : PreparedModel
        The model.
    bounds : Bounds
        Of the virtual displacement.
    kind : str
        Kind of certificate that proved the verdict; "" where nothing was proved.
    motion : (m, 6), optional
        The mechanism, where there is one.
    figures : mapping of str to float
        How near the search came, or what the checker counted.
    provenance : mapping
        How the verdict was found.
    """
    if kind in ("rbe-state", "cra-state") and model.fixed.all():
        return "Every block is a support, so nothing can move."
    if kind == "rbe-settled":
        return (
            "After the settlement, if it is small, the blocks come to rest again: what stays shut balances every load,"
            " and what has opened carries nothing."
        )
    if provenance.get("settlement") == "sliding":
        return (
            "After this settlement joints slide, and the state that was found leans on sliding that opens gaps"
            " (associated flow); dry stone does not do that, so that nothing is proved."
        )
    if provenance.get("settlement") == "locked":
        return (
            "The blocks cannot follow this settlement: they are locked between the supports, so that something would"
            " have to crush."
        )
    if kind == "rbe-state" and model.contacts.strength.any():
        return "Compression, friction and joints that pull can balance every load on every block."
    if kind == "rbe-state":
        return BALANCED["rbe"]
    if kind == "cra-state":
        return BALANCED["cra"]
    if kind == "rbe-mechanism" and motion is not None:
        return _falls(model, motion, provenance) + _missed(model)
    if kind == "cra-tree":
        cases = int(figures.get("leaves", 0))
        each = f"{cases} cases, each" if cases != 1 else "the only case is"
        return (
            "Rigid-block equilibrium has forces for it, but no virtual motion produces them:"
            f" {each} proved impossible (for {_named(bounds)})."
        )
    return _undecided(bounds, figures, provenance) + _missed(model)


def counted_on(model: PreparedModel, kind: str) -> str:
    """What the verdict has to do with joints that pull; "" where none does."""
    pulling = model.contacts.strength
    if not pulling.any():
        return ""
    most = f"{pulling.max():g} Pa"
    if kind == "rbe-state":
        return f" This counts on joints that pull: {np.count_nonzero(pulling)} of them, with up to {most}."
    if kind == "rbe-mechanism":
        return f" Joints that pull with up to {most} do not prevent it."
    return f" Joints that pull with up to {most} were counted on."


def _named(bounds: Bounds) -> str:
    return f"eta = {bounds.eta / bounds.eps:g} eps, beta_min = {bounds.beta / bounds.eps:g} eps"


def _falls(model: PreparedModel, motion: Floats, provenance: Mapping[str, Any]) -> str:
    blocks = model.assembly.blocks
    if model.idle:
        names = ", ".join(f"'{blocks[i].id}'" for i in model.idle[:3])
        more = f" and {len(model.idle) - 3} more" if len(model.idle) > 3 else ""
        return f"Nothing holds block {names}{more}: it touches no other block and is no support."
    if provenance.get("solver") == "connectivity" and any(block.held for block in blocks):
        return "Its loads drive a block along a direction in which no support and no other block holds it."
    if provenance.get("solver") == "connectivity":
        return "A group of blocks is not connected to any support, so it falls."
    speed = np.linalg.norm(motion[:, :3], axis=1)
    moving = int(np.sum(np.abs(motion).max(axis=1) > 1e-6 * np.abs(motion).max(initial=0.0)))
    fastest = blocks[int(np.flatnonzero(~model.fixed)[int(np.argmax(speed))])].id
    return (
        f"A collapse mechanism exists: {moving} of {len(motion)} free blocks move, '{fastest}' the fastest,"
        " and the loads drive the motion."
    )


def _missed(model: PreparedModel) -> str:
    """What joints that were drawn imprecisely may have to do with it."""
    near = model.near
    if near is None or not len(near):
        return ""
    blocks = model.assembly.blocks
    if model.idle and (k := near.nearest(model.idle[0])) >= 0:
        other = int(near.a[k] + near.b[k]) - model.idle[0]
        return (
            f" Block '{blocks[other].id}' is {near.sizes(k)}: if they are meant to touch, use `tolerance`"
            f" {near.forgiving(np.array([k])).words()}, or auto."
        )
    pairs = len(np.unique(np.stack([near.a, near.b], 1), axis=0))
    return (
        f" But {pairs} {'pairs' if pairs > 1 else 'pair'} of blocks nearly touch and were not counted; see `tolerance`."
    )


def _undecided(bounds: Bounds, figures: Mapping[str, float], provenance: Mapping[str, Any]) -> str:
    if provenance["method"] == "rbe":
        balance = f"best residual {figures['balance']:.1e} of the loads" if np.isfinite(figures["balance"]) else "none"
        bound = f"best bound {figures['bound']:.1e}" if figures["bound"] > 0.0 else "none"
        return (
            f"Neither a state of equilibrium ({balance}, {BALANCE:.0e} wanted) nor a mechanism ({bound},"
            f" {COLLAPSE:.0e} wanted) was found."
        )
    merit = f"best merit {figures['merit']:.1e}, 0 wanted" if np.isfinite(figures["merit"]) else "none at all"
    why = provenance.get("why", "")
    return (
        f"Coupled analysis met neither a state in which the stones bring forth the forces that hold them ({merit}) nor"
        f" a proof that there is none ({figures['bound']:.0%} of the cases closed), for {_named(bounds)}"
        f"{': ' + why if why else ''}."
    )
