"""Trials of stones on the exact meshes: where one comes to rest, on what, and whether the wall stands with it.

A stone may be laid where it shares no volume with another, stands well inside the hull of what bears it, stays within
the faces of the wall, and the wall with it is in equilibrium. A stone that rocks may be pinned: a small stone is laid
first, where it would bear it (`pinning`); each of the two has to sit by itself, and both are in the proof.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cyclopean.analysis import DENSITY
from cyclopean.arrays import Floats
from cyclopean.design.rubble.choosing import Tipped, leaning
from cyclopean.design.rubble.dressing import Cut, dressed
from cyclopean.design.rubble.features import Body
from cyclopean.design.rubble.pinning import pins_under
from cyclopean.design.rubble.seating import heyman_margin, seat
from cyclopean.design.rubble.standing import GRAVITY, Fresh, Mass, State
from cyclopean.design.rubble.touching import TOUCH
from cyclopean.design.rubble.wall import OVERLAP

if TYPE_CHECKING:
    from cyclopean.design.rubble.site import Site

__all__ = ["Seated", "Trial", "put_down", "tried"]

INSIDE = 0.03  # of the cube root of a stone's volume: margin that is asked for
REACH = 1.0  # of the unit: what is farther from a stone than that is not looked at
NEARLY = 0.2  # of its size: a stone that stands so far outside what bears it is not pinned
NEAR = 1.5  # cells: a stone that is nearer to a face is moved up to it,
SHOWS = 0.03  # and then stands out of it by so much of its size
LIFTED = 0.0, 0.4, 0.7  # of the depth to which a stone is let down to be dressed: where that takes too much, it is less
PINNED = 2  # pins that are tried under one stone

SLIDES, ROCKS, INTO, OUT, FALLS = (
    "slides where it could lie",
    "rocks where it could lie",
    "would stand in other stones",
    "would stand out of the wall",
    "would fall, or bring others down, with gravity leaning",
)


@dataclass(frozen=True, slots=True, eq=False)
class Seated:
    """A stone where it came to rest."""

    stone: int  # in the inventory
    rotation: Floats  # (3, 3)
    shift: Floats  # (3,) m
    body: Body
    fresh: Fresh
    margin: float  # m: of the centre of mass inside the hull of what bears it
    overlap: float  # largest volume that it has in common with another, over its own
    cuts: tuple[Cut, ...] = ()  # flats that are knocked off it


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Stones that are laid together, in this order: one, or a pin and the stone that it steadies."""

    stones: tuple[Seated, ...]
    state: State  # forces that hold all


def tried(site: "Site", tipped: Tipped, ceiling: float) -> Trial | str:
    """Seat a stone at a place and see whether the wall stands with it; in words where not."""
    lying, pose = tipped.place.lying, _pose(site, tipped)
    found = seated(site, lying.stone, pose, ceiling, down=tipped.down)
    stones: tuple[Seated, ...] = ()
    if isinstance(found, Seated):
        stones = (found,)
    elif found == ROCKS and site.settings.pins:
        stones = _pinned(site, lying.stone, pose, ceiling)
    state = site.structure.held([one.fresh for one in stones]) if stones else None
    return (FALLS if stones else str(found)) if state is None else Trial(stones, state)


def seated(
    site: "Site",
    stone: int,
    pose: tuple[Floats, Floats],
    ceiling: float,
    beside: Sequence[Seated] = (),
    down: float = 0.0,
) -> Seated | str:
    """Adjust a stone on the exact meshes from a pose (rotation, shift in m); in words where it does not sit there.

    `beside` is what is laid with it. The pose is so far `down` (m) in what is below as dressing is thought to allow.
    """
    body = site.body(stone)
    cuts: tuple[Cut, ...] = ()
    placed = _placed(site, body, pose, beside)
    for lifted in LIFTED if site.settings.dress > 0.0 else ():
        higher = pose[1] + np.array([0.0, 0.0, lifted * down])
        cut = dressed(body, pose[0], higher, placed, site.settings.dress)
        if cut is not None:  # otherwise it is laid as it is
            body, cuts, pose = cut.body, cut.cuts, (pose[0], higher)
            break
    found = seat(body, *pose, placed, give_up=True)
    wanted = site.margin(body)
    if found.slid and not found.margin > 0.0:
        return SLIDES
    if not found.overlap <= OVERLAP:
        return INTO
    if not found.margin >= wanted:
        return ROCKS
    lies = body.moved(found.rotation, found.shift)
    if not site.within(lies, ceiling):
        return OUT
    fresh = fresh_of(site, stone, lies, beside)
    margin = heyman_margin(fresh.bearing, lies.centroid)
    if not (margin > 0.0 and margin >= wanted):
        return ROCKS
    return Seated(stone, found.rotation, found.shift, lies, fresh, margin, found.overlap, cuts)


def put_down(site: "Site", tipped: Tipped) -> Seated:
    """A stone that does not stand by itself, where it comes to rest or is lifted out of others."""
    lying = tipped.place.lying
    body = site.body(lying.stone)
    pose = _pose(site, tipped)
    found = seat(body, *pose, _placed(site, body, pose))
    lies = body.moved(found.rotation, found.shift)
    fresh = fresh_of(site, lying.stone, lies)
    return Seated(lying.stone, found.rotation, found.shift, lies, fresh, found.margin, found.overlap)


def _pose(site: "Site", tipped: Tipped) -> tuple[Floats, Floats]:
    """Rotation, and shift (m), of a stone at a place where it has tipped."""
    lying = tipped.place.lying
    turn = leaning(*tipped.slope) @ lying.rotation
    plan = np.array(tipped.place.cell) * site.cell - lying.raster.corner
    body = site.body(lying.stone)
    shift = np.array([*plan, tipped.rest]) - turn @ body.centroid
    shift[:2] += site.shape.flush(body.vertices @ turn.T + shift, NEAR * site.cell, SHOWS * float(np.cbrt(body.volume)))
    return turn, shift


def _placed(site: "Site", body: Body, pose: tuple[Floats, Floats], beside: Sequence[Seated] = ()) -> list[Body]:
    """What stands near a stone in a pose, and what is laid with it."""
    turn, shift = pose
    point = body.vertices @ turn.T + shift
    near = site.near(point.min(axis=0), point.max(axis=0), REACH * site.unit)
    return [site.stood[k] for k in near] + [one.body for one in beside]


def fresh_of(site: "Site", stone: int, body: Body, beside: Sequence[Seated] = ()) -> Fresh:
    """A stone where it lies, with all its joints."""
    density = site.stones[stone].density or DENSITY
    mass = Mass(body.centroid, body.volume, density * body.volume * GRAVITY)
    near = site.near(body.low, body.high, TOUCH * float(np.cbrt(body.volume)))
    return site.structure.fresh(mass, body, near, [one.body for one in beside])


def _pinned(site: "Site", stone: int, pose: tuple[Floats, Floats], ceiling: float) -> tuple[Seated, ...]:
    """A pin and the stone that it steadies; nothing where none does."""
    pins = site.kept.get("hearting", [])
    body = site.body(stone)
    rest = seat(body, *pose, _placed(site, body, pose), give_up=True)
    if not pins or rest.slid or not rest.margin > -NEARLY * float(np.cbrt(body.volume)):
        return ()
    lies = body.moved(rest.rotation, rest.shift)
    bearing = rest.contacts[rest.normals[:, 2] > 0.0]
    places = pins_under(site.map, lies, bearing, [site.bedded(k) for k in pins if k != stone], site.cell)
    for place in places[:PINNED]:
        small = place.lying
        shift = place.centre - small.rotation @ site.body(small.stone).centroid
        pin = seated(site, small.stone, (small.rotation, shift), ceiling)
        if isinstance(pin, str):
            continue
        lifted = rest.shift + np.array([0.0, 0.0, max(place.lift, 0.0)])
        found = seated(site, stone, (rest.rotation, lifted), ceiling, (pin,))
        if isinstance(found, Seated) and any(joint.below == site.structure.next for joint in found.fresh.joints):
            return pin, found
    return ()
