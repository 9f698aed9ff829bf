"""Joints whose edges have worn away."""

import numpy as np
import shapely

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly.contacts import Contacts
from cyclopean.errors import InputError
from cyclopean.geometry import newell_normals

__all__ = ["worn"]

LEAST = 1e-9  # of its area, below which what is left of a joint counts as nothing; of its size, below which wear does


def worn(contacts: Contacts, depth: Floats) -> tuple[Contacts, Ints]:
    """Draw the edges of every joint in by a length: arrises are chipped, stones are not quite as drawn.

    What is left lies inside what was there, so that a deeper wear never helps. A joint may fall into parts, or vanish.

    Parameters
    ----------
    contacts : Contacts
        c joints.
    depth : (c,) m
        Not negative; less than a billionth of its size leaves a joint as it is, corner by corner.

    Returns
    -------
    contacts : Contacts
        c' of them.
    origin : (c',) int
        Which joint each one was.

    Raises
    ------
    InputError
        A depth is negative or not finite, or there are not c of them.
    """
    depth = np.asarray(depth, float)
    if depth.shape != (len(contacts),) or not (np.isfinite(depth).all() and (depth >= 0.0).all()):
        raise InputError(f"wear of joints: expected {len(contacts)} lengths in metres, none of them negative")
    if not len(contacts) or not depth.any():
        return contacts, np.arange(len(contacts))
    polygons: list[Floats] = []
    origin: list[int] = []
    frame = contacts.frame
    for k in range(len(contacts)):
        whole = contacts.polygon(k)
        unworn = len(whole) < 3 or depth[k] <= LEAST * np.max(np.ptp(whole, axis=0))
        parts = [whole] if unworn else _inner(whole, frame[k], float(depth[k]))
        polygons += parts
        origin += [k] * len(parts)
    kept = np.array(origin, np.int64)
    said = contacts.only(kept)
    ends = np.stack([said.a, said.b], 1)
    return Contacts.of(ends, polygons, said.mu, said.tension, said.lean, said.facing), kept


def _inner(polygon: Floats, frame: Floats, depth: float) -> list[Floats]:
    """What is left of one polygon: parts, counter-clockwise about the same normal."""
    origin = polygon[0]  # local, so that a model far from the origin loses nothing
    flat = (polygon - origin) @ frame[1:].T
    whole = shapely.Polygon(flat)
    inner = shapely.buffer(whole, -depth, join_style="mitre")
    parts = []
    for part in shapely.get_parts(inner):
        if not part.area > LEAST * whole.area:
            continue
        ring = shapely.get_coordinates(shapely.geometry.polygon.orient(part).exterior)[:-1]
        lifted = origin + ring @ frame[1:]
        if len(ring) >= 3 and newell_normals(lifted, np.array([0, len(lifted)]))[0] @ frame[0] > 0.0:
            parts.append(lifted)
    return parts
