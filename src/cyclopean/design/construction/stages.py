"""Does what has been built so far stand? The verdict of one stage, from another one where that helps.

A stage is the part of the structure that has been laid, with the supports, the joints between all these, and their
loads. Its verdict is that of `analysis.recheck`, which begins from the state of another stage, mostly the one before.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.analysis import Judge, Known, PreparedModel, Result, Settings, recheck
from cyclopean.arrays import Bools, Ints
from cyclopean.assembly import Assembly, Contacts
from cyclopean.proof import verify

__all__ = ["Stage", "stage_of", "verdict", "with_props"]


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """Part of a structure, ready for analysis."""

    model: PreparedModel
    block: Ints  # (k,) index of each of its blocks in the whole
    point: Ints  # (q,) index of each of its contact points in the whole


def stage_of(whole: PreparedModel, standing: Bools) -> Stage:
    """Cut a stage out of the whole.

    Parameters
    ----------
    whole : PreparedModel
        The finished structure, n blocks.
    standing : (n,) bool
        What has been laid; supports always stand.
    """
    block = np.flatnonzero(standing | whole.fixed)
    place = np.full(len(standing), -1)
    place[block] = np.arange(len(block))
    contacts, point = _within(whole.contacts, place)
    loads = tuple(replace(x, block=int(place[x.block])) for x in whole.assembly.loads if place[x.block] >= 0)
    assembly = Assembly(tuple(whole.assembly.blocks[i] for i in block), contacts, loads, whole.assembly.name)
    fixed = whole.fixed[block]
    touched = np.array([bool(b.held) for b in assembly.blocks], bool)  # what is partly held hangs on something
    touched[contacts.a] = touched[contacts.b] = True
    model = PreparedModel(
        assembly,
        contacts,
        fixed,
        whole.gravity,
        whole.density,
        whole.tolerance,
        whole.assumed,
        (),
        tuple(np.flatnonzero(~touched & ~fixed).tolist()),
        whole.loading,
    )
    return Stage(model, block, point)


def with_props(stage: Stage, props: Sequence[int]) -> Stage:
    """The same stage with these blocks of the whole held."""
    fixed = stage.model.fixed | np.isin(stage.block, list(props))
    idle = tuple(i for i in stage.model.idle if not fixed[i])
    return replace(stage, model=replace(stage.model, fixed=fixed, idle=idle))


def verdict(
    stage: Stage, settings: Settings, before: tuple[Stage, Result] | None = None, judge: Judge = verify
) -> Result:
    """Decide whether a stage stands, with a verified certificate.

    Parameters
    ----------
    stage : Stage
        What has been laid.
    settings : Settings
        Method, solver and budget.
    before : Stage and Result, optional
        Another stage and its verdict, to begin from.
    judge : callable
        As for `recheck`.
    """
    if before is None:
        return recheck(stage.model, settings, judge=judge)
    earlier, result = before
    block, point = _places(stage.block, earlier.block), _places(stage.point, earlier.point)
    return recheck(stage.model, settings, Known(result, block, point), judge)


def _places(here: Ints, wanted: Ints) -> Ints:
    """Where in the sorted `here` each of `wanted` stands; -1 = nowhere."""
    if not len(here):
        return np.full(len(wanted), -1)
    place = np.minimum(np.searchsorted(here, wanted), len(here) - 1)
    return np.where(here[place] == wanted, place, -1)


def _within(contacts: Contacts, place: Ints) -> tuple[Contacts, Ints]:
    """Joints between blocks that have a place, and which contact points of the whole are theirs."""
    kept = np.flatnonzero((place[contacts.a] >= 0) & (place[contacts.b] >= 0))
    inside = np.zeros(len(contacts), bool)
    inside[kept] = True
    point = np.flatnonzero(inside[contacts.patch])
    part = contacts.only(kept)
    return replace(part, a=place[part.a], b=place[part.b]), point
