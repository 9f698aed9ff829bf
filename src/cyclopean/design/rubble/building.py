"""How a rubble wall rises: courses, then hollows filled, and what is left tried once more.

A course is laid from both ends towards its middle: left, right, left ... A long one is begun by two gangs (`gangs`).
Where a wall has two wythes, the front one of a course is laid first, then the rear one.
"""

from concurrent.futures import Executor

import numpy as np

from cyclopean.design.rubble.coursing import CLOSE, Course, inwards, level_of
from cyclopean.design.rubble.parallel import Gangs
from cyclopean.design.rubble.places import Slot, Weights, ranked
from cyclopean.design.rubble.site import Site

__all__ = ["build"]

HEART = 2  # the wythe of small stones in hollows
HEARTING = Weights(bond=0.0, face=0.0)


def build(site: Site, executor: Executor | None = None) -> None:
    """Lay courses until stones or room are used up."""
    gangs = Gangs(site, executor)
    course = 0
    while site.left:
        count = len(site.laid)
        site.vain.clear()
        for wythe in range(site.settings.wythes):
            if site.left:
                _course(gangs, Course(course, wythe, level_of(site, wythe)))
        _heart(site, course)
        if len(site.laid) > count:
            course += 1
            site.left, site.aside = site.aside + site.left, []
        elif site.settings.look_ahead == 0:  # the one that comes next fits nowhere, and others may
            site.aside, site.left = site.aside + site.left[:1], site.left[1:]
        else:
            break
    site.left, site.aside = site.aside + site.left, []
    if site.left and site.settings.look_ahead:
        site.vain.clear()
        gangs.again(Course(site.laid[-1].course if site.laid else 0, 0, level_of(site, 0)))


def _course(gangs: Gangs, course: Course) -> None:
    """Lay one wythe of one course."""
    site = gangs.site
    cells, joints = gangs.begun(course)
    site.joints[course.wythe] = joints + inwards(site, course, cells, (-1, 1))[1]


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
