"""How one wythe of one course of a rubble wall is laid: from its ends inwards, slot after slot."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import cycle, islice

import numpy as np

from cyclopean.analysis import DENSITY
from cyclopean.design.rubble.hearting import wedge_under
from cyclopean.design.rubble.places import Slot, different, ranked
from cyclopean.design.rubble.seating import heyman_margin
from cyclopean.design.rubble.site import NARROW, Site, Trial

__all__ = ["CLOSE", "Course", "inwards", "level_of"]

ROCKING = 3  # rocking stones that are tried with a wedge before a gap is left
DEEPEST = 0.6  # of the thickness: a stone of one of two wythes
INTO, PLAY = 4, 6  # cells by which a place may reach into its neighbour's plan, and stand off from it
SKIPS = 5, 4, 3, 6, 8, 2  # cells that are left open where nothing goes: one number for each way to lay a wall
CLOSE = 48  # places looked at closely, of each choice


@dataclass(frozen=True, slots=True)
class Course:
    """One wythe of a course."""

    number: int
    wythe: int
    level: float  # m: height that it should come to


def inwards(
    site: Site, course: Course, cells: tuple[int, int], sides: Sequence[int], least: float = 0.0
) -> tuple[tuple[int, int], list[float]]:
    """Lay stones from the ends of what is open of a course inwards.

    Parameters
    ----------
    site : Site
        The wall so far.
    course : Course
        Which.
    cells : (int, int)
        What is open along the wall.
    sides : sequence of int
        The ends that stones are laid at in turn: -1 = the lower one, 1 = the upper one.
    least : float
        Where there is less room than that (m), nothing more is laid.

    Returns
    -------
    cells : (int, int)
        What is open then.
    joints : list of float
        x (m) of the ends of the stones laid: the new head joints.
    """
    low, high = cells
    joints: list[float] = []
    for side in cycle(sides):
        if not (site.left and (high - low) * site.cell >= max(least, site.narrowest())):
            break
        trial = _next(site, _slot(site, (low, high), side, course))
        if trial is None:  # nothing goes here: leave a gap
            skip = SKIPS[site.way]
            low, high = (low + skip, high) if side < 0 else (low, high - skip)
            continue
        site.take(trial, course.number, course.wythe)
        joints.append(float(site.boxes[-1, 1, 0] if side < 0 else site.boxes[-1, 0, 0]))
        end = round(joints[-1] / site.cell)
        low, high = (end, high) if side < 0 else (low, end)
    return (low, high), joints


def _next(site: Site, slot: Slot) -> Trial | None:
    """Seat the best of the stones that come next: the first that stands."""
    room = float(slot.first[1] - slot.first[0]) * site.cell
    patient = (k for k in site.left if site.patient(k))
    if site.ahead == 0:
        window = list(islice(patient, 1))
    else:
        deep = int(slot.across[1] - slot.across[0])
        short = (k for k in patient if 2.0 * NARROW * site.stones[k].half[1] <= room)
        window = list(islice((k for k in short if site.shallow(k, deep)), site.ahead))
    rocking: list[Trial] = []
    for bed in (0, 1):
        lying = [b for k in window for b in site.bedded(k, bed)]
        places = ranked(site.map, lying, slot, site.settings.weights, site.cell, CLOSE, site.looked)
        trial = site.first(different(places)[: site.settings.tries], rocking)
        if trial is not None:
            return trial
    return _chinked(site, sorted(rocking, key=lambda t: -t.margin)) if site.settings.chinking else None


def _chinked(site: Site, rocking: Sequence[Trial]) -> Trial | None:
    """Drive a wedge under one of some stones that rock; None where none of them stands even so."""
    for trial in rocking[:ROCKING]:
        body = site.lying(trial)
        near = site.near(body.vertices, site.cell)
        bodies = [site.stood[k] for k in near]
        wanted = site.margin(body)
        wedge = wedge_under(body, bodies, trial.fresh[-1].bearing, site.cell, 2.0 * wanted)
        if wedge is None:
            continue
        low = site.fresh(wedge.body, DENSITY, near)
        stone = trial.fresh[-1]
        high = site.structure.fresh(stone.mass, stone.surface, near, (low.surface,))
        margin = heyman_margin(high.bearing, body.centroid)
        state = site.structure.held((low, high)) if margin >= wanted else None
        if state is not None:
            held = replace(trial, fresh=(low, high), margin=margin, state=state, wedge=wedge)
            held = site.borne(held, body, near)
            if held.state is not None:
                return held
    return None


def _slot(site: Site, cells: tuple[int, int], side: int, course: Course) -> Slot:
    """Where the next stone of a course should go."""
    n = site.map.shape[0]
    open_from, open_to = cells
    at_end = open_from == 0 if side < 0 else open_to == n
    two = site.settings.wythes == 2
    return Slot(
        np.array([max(open_from - INTO, 0), min(open_to + INTO, n)]),
        np.array(_across(site, course.wythe, math.ceil(DEEPEST * site.map.shape[1]))),
        course.level,
        site.limit,
        side,
        play=0 if at_end else INTO + PLAY,
        play_across=PLAY if two else 0,
        rear=course.wythe == 1,
        both=not two,
        open=(open_from * site.cell, open_to * site.cell),
        joints=np.array(site.joints.get(course.wythe, [])),
        length=site.mean,
        narrowest=site.narrowest(),
    )


def _across(site: Site, wythe: int, deep: int) -> tuple[int, int]:
    """Cells across the wall that a wythe has, where one of two is so deep."""
    d = site.map.shape[1]
    deep = d if site.settings.wythes == 1 else deep
    return (d - deep, d) if wythe == 1 else (0, deep)


def level_of(site: Site, wythe: int) -> float:
    """Height (m) that the next course should come to: the skyline's mean, and a stone of those to come."""
    y0, y1 = _across(site, wythe, site.map.shape[1] // 2)
    window = site.left[: max(site.ahead, 1)]
    thick = float(np.median([b.thickness for k in window for b in site.bedded(k, 0)]))
    return float(site.map[:, y0:y1].max(axis=1).mean()) + thick
