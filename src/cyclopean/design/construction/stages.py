"""Does what has been built so far stand? The verdict of one stage, from another one where that helps.

A stage is the part of the structure that has been laid, with the supports, the joints between all these, and their
loads. Its verdict is that of `analysis.recheck`, which begins from the state of another stage, mostly the one before.

Stages come in runs: the first of a run begins from nothing, each other one from the one before. So runs do not need
each other, and may be looked at side by side, here or anywhere, with the same answers. A run has one memory of what its
certificates have in common, the shapes of the stones and how they lie on each other: that is checked once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cyclopean.analysis import CONTINUED, Judge, Known, PreparedModel, Result, Settings, Word, recheck
from cyclopean.arrays import Bools, Ints
from cyclopean.assembly import Assembly
from cyclopean.proof import Memory, verify

__all__ = ["RUN", "Judged", "Stage", "judged", "judged_run", "stage_at", "stage_of", "verdict", "with_props"]

RUN = 50  # stages that follow on each other: the first costs a search, of a second or so for a large wall
TURNING = 0.2  # of its speed that comes of turning, from which a stone topples; else it slides or drops
PLUMB = 0.95  # cosine of the angle to the vertical, 18 degrees, within which it drops
SLOW = 1e-3  # of the speed of the fastest stone: slower ones are not said to move


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
    kept = (place[whole.contacts.a] >= 0) & (place[whole.contacts.b] >= 0)
    point, part = np.flatnonzero(kept[whole.contacts.patch]), whole.contacts.only(np.flatnonzero(kept))
    contacts = replace(part, a=place[part.a], b=place[part.b])
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


@dataclass(frozen=True, slots=True)
class Judged:
    """What is kept of the verdict on a stage."""

    verdict: Word
    reason: str
    proof: str = ""  # kind of the certificate; "" where nothing was proved
    seal: str = ""  # of the certificate
    warm: bool = False  # the state of the stage before led to this one
    moving: tuple[int, ...] = ()  # blocks of the whole that a mechanism moves, the fastest first
    how: str = ""  # what the fastest of them does: topples, slides or drops
    seconds: float = 0.0


def stage_at(whole: PreparedModel, order: Sequence[int], number: int) -> Stage:
    """The stage at which so many stones (from 0), and one more, of an order are laid."""
    standing = whole.fixed.copy()
    standing[list(order[: number + 1])] = True
    return stage_of(whole, standing)


def judged(stage: Stage, result: Result) -> Judged:
    """Keep of a verdict what is told of a stage."""
    certificate = result.certificate or {}
    moving, how = _falls(stage, result)
    return Judged(
        result.verdict,
        result.reason,
        str(certificate.get("kind", "")),
        str(certificate.get("seal", "")),
        result.provenance.get("route") == CONTINUED,
        moving,
        how,
        result.seconds["total"],
    )


def judged_run(
    whole: PreparedModel, settings: Settings, order: Sequence[int], run: range, watched: bool = False
) -> list[tuple[Judged, Result | None]]:
    """Decide a run of stages, each from the one before where that stands.

    Parameters
    ----------
    whole : PreparedModel
        The finished structure.
    settings : Settings
        Of the verdicts.
    order : sequence of int
        Blocks, the first to be laid first.
    run : range
        Numbers of the stages, from 0.
    watched : bool
        Whether results are wanted whole.
    """
    judge = partial(verify, memory=Memory())
    before: tuple[Stage, Result] | None = None
    found: list[tuple[Judged, Result | None]] = []
    for number in run:
        stage = stage_at(whole, order, number)
        result = verdict(stage, settings, before, judge)
        before = (stage, result) if result.verdict == "stable" else None
        found.append((judged(stage, result), result if watched else None))
    return found


def _falls(stage: Stage, result: Result) -> tuple[tuple[int, ...], str]:
    """Which blocks of the whole a mechanism moves, the fastest first, and what that one does."""
    rows = result.mechanism
    if rows is None:
        return (), ""
    model = stage.model
    speed = np.linalg.norm(rows[:, :3], axis=1)
    turning = np.linalg.norm(rows[:, 3:], axis=1) * np.cbrt(np.abs(model.assembly.mass.volume))
    moving = np.flatnonzero(np.maximum(speed, turning) > SLOW * np.max(np.maximum(speed, turning)))
    moving = moving[np.argsort(-speed[moving], kind="stable")]
    k = int(moving[0])
    down = float(rows[k, :3] @ model.gravity) / max(float(speed[k] * np.linalg.norm(model.gravity)), 1e-300)
    how = "topples" if turning[k] > TURNING * speed[k] else "drops" if down > PLUMB else "slides"
    return tuple(stage.block[moving].tolist()), how
