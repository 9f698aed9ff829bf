"""How a rubble wall rises: courses from both ends towards the middle, hollows filled, and what is left tried once more.

Where a wall has two wythes, the front one of a course is laid first, then the rear one. Which stone comes next: of all
that are left, the largest; `look_ahead` of them compete for every place. With a look-ahead of 0 the next stone is that
of the inventory, at the first place where it stands.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from cyclopean.analysis import DENSITY
from cyclopean.arrays import Ints
from cyclopean.design.laying.hearting import wedge_under
from cyclopean.design.laying.places import Place, Slot, Weights, ranked
from cyclopean.design.laying.seating import heyman_margin
from cyclopean.design.laying.site import NARROW, Site, Trial, mass_of, surface_of, wedge_body

__all__ = ["build"]

ROCKING = 3  # rocking stones that are tried with a wedge before a gap is left
DEEPEST = 0.6  # of the thickness: a stone of one of two wythes
INTO, PLAY = 4, 6  # cells by which a place may reach into its neighbour's plan, and stand off from it
HEART = 2  # the wythe of small stones in hollows
HEARTING = Weights(bond=0.0, face=0.0)
SKIP = 3  # cells that are left open where nothing goes
CLOSE = 48  # places looked at closely, of each choice
FEW = 12  # ... of a part of the wall, at the end
PARTS = 8  # parts that a stone is tried in, at the end
SECTION = 8.0  # mean lengths: part of a wall that is looked at together


def build(site: Site) -> None:
    """Lay courses until stones or room are used up."""
    course = 0
    while site.left:
        count = len(site.laid)
        site.vain.clear()
        for wythe in range(site.settings.wythes):
            _course(site, course, wythe)
        _heart(site, course)
        if len(site.laid) > count:
            course += 1
            site.left, site.aside = site.aside + site.left, []
        elif site.settings.look_ahead == 0:  # the one that comes next fits nowhere, and others may
            site.aside, site.left = site.aside + site.left[:1], site.left[1:]
        else:
            break
    site.left, site.aside = site.aside + site.left, []
    if site.settings.look_ahead:
        _once_more(site, site.laid[-1].course if site.laid else 0)


def _course(site: Site, course: int, wythe: int) -> None:
    """Lay one wythe of one course from both ends inwards."""
    if not site.left:
        return
    open_from, open_to = 0, site.map.shape[0]
    level = _level(site, wythe)
    joints: list[float] = []
    side = -1
    while site.left and (open_to - open_from) * site.cell >= site.narrowest():
        trial = _next(site, _slot(site, open_from, open_to, side, wythe, level))
        if trial is None:  # nothing goes here: leave a gap
            open_from, open_to = (open_from + SKIP, open_to) if side < 0 else (open_from, open_to - SKIP)
        else:
            site.take(trial, course, wythe)
            low, high = float(site.lows[-1][0]), float(site.highs[-1][0])
            if side < 0:
                open_from, joint = round(high / site.cell), high
            else:
                open_to, joint = round(low / site.cell), low
            joints.append(float(joint))
        side = -side
    site.joints[wythe] = joints


def _next(site: Site, slot: Slot) -> Trial | None:
    """Seat the best of the stones that come next: the first that stands."""
    room = float(slot.first[1] - slot.first[0]) * site.cell
    patient = (k for k in site.left if site.patient(k))
    if site.settings.look_ahead == 0:
        window = list(islice(patient, 1))
    else:
        deep = int(slot.across[1] - slot.across[0])
        short = (k for k in patient if 2.0 * NARROW * site.stones[k].half[1] <= room)
        window = list(islice((k for k in short if site.shallow(k, deep)), site.settings.look_ahead))
    rocking: list[Trial] = []
    for bed in (0, 1):
        lying = [b for k in window for b in site.bedded(k, bed)]
        places = ranked(site.map, lying, slot, site.settings.weights, site.cell, CLOSE, site.looked)
        trial = site.first(_different(places)[: site.settings.tries], rocking)
        if trial is not None:
            return trial
    return _chinked(site, sorted(rocking, key=lambda t: -t.margin)) if site.settings.chinking else None


def _different(places: Sequence[Place]) -> list[Place]:
    """The best place of each stone in each orientation."""
    return list({(p.lying.stone, id(p.lying)): p for p in reversed(places)}.values())[::-1]


def _chinked(site: Site, rocking: Sequence[Trial]) -> Trial | None:
    """Drive a wedge under one of some stones that rock; None where none of them stands even so."""
    for trial in rocking[:ROCKING]:
        near = site.near(trial.body.vertices, site.cell)
        bodies = [site.stood[k] for k in near]
        wanted = site.margin(trial.body)
        wedge = wedge_under(trial.body, bodies, trial.fresh[-1].bearing, site.cell, 2.0 * wanted)
        if wedge is None:
            continue
        lump = wedge_body(wedge)
        low = site.structure.fresh(mass_of(lump, DENSITY), surface_of(lump), near)
        stone = trial.fresh[-1]
        high = site.structure.fresh(stone.mass, stone.surface, near, (low.surface,))
        margin = heyman_margin(high.bearing, trial.body.centroid)
        state = site.structure.held((low, high)) if margin >= wanted else None
        if state is not None:
            return replace(trial, fresh=(low, high), margin=margin, state=state, wedge=wedge)
    return None


def _heart(site: Site, course: int) -> None:
    """Drop small stones into the hollows of what was laid, as long as they sit there."""
    n, d = site.map.shape
    level = float(site.map.max(axis=1).mean())
    slot = Slot(
        np.array([0, n]), np.array([0, d]), 0, 0, 0, False, False, level, level, (0.0, 0.0), np.zeros(0), 1.0, 0.0
    )
    fruitless = 0
    while site.small and fruitless < len(site.small):
        number = site.small.pop(0)
        places = ranked(site.map, site.bedded(number, 0), slot, HEARTING, site.cell, CLOSE)
        good = site.first(places[: site.settings.tries], [])
        if good is None:
            site.small.append(number)
            fruitless += 1
        else:
            site.take(good, course, HEART)
            fruitless = 0


def _once_more(site: Site, course: int) -> None:
    """Try each stone that is left at the best places of the whole wall, or of some parts of a long one, in turn."""
    site.vain.clear()
    for turn, number in enumerate(tuple(site.left)):
        lying = [b for bed in (0, 1) for b in site.bedded(number, bed)]
        weights = site.settings.weights
        parts = _sections(site)
        parts = [parts[(turn * PARTS + k) % len(parts)] for k in range(min(PARTS, len(parts)))]
        places = [p for slot in parts for p in ranked(site.map, lying, slot, weights, site.cell, FEW)]
        trial = site.first(sorted(places, key=lambda p: p.cost)[: 2 * site.settings.tries], [])
        if trial is not None:
            site.take(trial, course, 0)


def _sections(site: Site) -> list[Slot]:
    """The whole wall, open from above, in parts that overlap."""
    n, d = site.map.shape
    long, level = round(SECTION * site.mean / site.cell), _level(site, 0)
    limit = np.inf if site.settings.height is None else site.settings.height
    starts = range(0, max(n - long, 0) + 1, max(long // 2, 1))
    ends = [(k, min(k + long, n)) for k in starts]
    ends[-1] = (ends[-1][0], n)
    across, joints = np.array([0, d]), np.zeros(0)
    return [
        Slot(np.array(x), across, 0, 0, 0, False, True, level, limit, (0.0, 0.0), joints, site.mean, 0.0) for x in ends
    ]


def _slot(site: Site, open_from: int, open_to: int, side: int, wythe: int, level: float) -> Slot:
    """Where the next stone of a course should go."""
    n = site.map.shape[0]
    at_end = open_from == 0 if side < 0 else open_to == n
    two = site.settings.wythes == 2
    return Slot(
        np.array([max(open_from - INTO, 0), min(open_to + INTO, n)]),
        _across(site, wythe),
        side,
        0 if at_end else INTO + PLAY,
        PLAY if two else 0,
        wythe == 1,
        not two,
        level,
        np.inf if site.settings.height is None else site.settings.height,
        (open_from * site.cell, open_to * site.cell),
        np.array(site.joints.get(wythe, [])),
        site.mean,
        site.narrowest(),
    )


def _across(site: Site, wythe: int) -> Ints:
    """Cells across the wall in which a stone of a wythe must lie."""
    d = site.map.shape[1]
    deep = d if site.settings.wythes == 1 else math.ceil(DEEPEST * d)
    return np.array([d - deep, d] if wythe == 1 else [0, deep])


def _strip(site: Site, wythe: int) -> tuple[int, int]:
    """Cells across the wall in which a wythe has its stones."""
    d = site.map.shape[1]
    if site.settings.wythes == 1:
        return 0, d
    return (0, d // 2) if wythe == 0 else (d - d // 2, d)


def _level(site: Site, wythe: int) -> float:
    """Height (m) that the next course should come to: the skyline's mean, and a stone of those to come."""
    y0, y1 = _strip(site, wythe)
    window = site.left[: max(site.settings.look_ahead, 1)]
    thick = float(np.median([b.thickness for k in window for b in site.bedded(k, 0)]))
    return float(site.map[:, y0:y1].max(axis=1).mean()) + thick
