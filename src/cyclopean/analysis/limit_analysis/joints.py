"""Which joints of a mechanism open about a hinge, slide or part."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from cyclopean.analysis.limit_analysis.result import LimitResult
from cyclopean.analysis.verdict import relative_motion

__all__ = ["MovingJoint", "moving_joints"]

MOVES = 1e-4  # of the largest relative velocity: below it a joint is at rest
SLIDES = 0.02  # of the largest relative velocity at the joint: below it a loaded point is a hinge
LOADED = 1e-6  # of the largest normal force


@dataclass(frozen=True, slots=True)
class MovingJoint:
    """A contact whose blocks move against each other in a mechanism."""

    contact: int
    kind: Literal["hinge", "slide", "part"]
    speed: float  # largest relative velocity of its points, the fastest joint has 1
    point: tuple[float, float, float]  # m: centre of what still touches (hinge, slide) or of the contact (part)


def moving_joints(result: LimitResult) -> tuple[MovingJoint, ...]:
    """Joints that move in the mechanism, the fastest first; none where there is no mechanism.

    A hinge keeps touching along an edge, at a corner or at loaded points that do not slide; a joint slides where loaded
    points move along it; it parts where nothing touches any more.
    """
    contacts = result.contacts
    if result.mechanism is None or not len(contacts):
        return ()
    patch, dd = contacts.patch, relative_motion(contacts, result.mechanism, result.assembly.mass.centroid)
    size = np.linalg.norm(dd, axis=1)
    fastest = np.maximum.reduceat(size, contacts.start[:-1])
    top = float(np.max(fastest, initial=0.0))
    normal = np.einsum("qj,qj->q", contacts.frame[patch, 0], dd)
    along = np.linalg.norm(dd - normal[:, None] * contacts.frame[patch, 0], axis=1)
    pressed = np.zeros(len(size)) if result.force is None else result.force[:, 0]
    loaded = pressed > LOADED * float(np.max(pressed, initial=0.0))
    joints = []
    for k in np.argsort(-fastest, kind="stable"):
        if not (fastest[k] > MOVES * top):
            break
        here = slice(contacts.start[k], contacts.start[k + 1])
        rubs = loaded[here] & (along[here] > SLIDES * fastest[k])
        touches = size[here] <= SLIDES * fastest[k]
        kind: Literal["hinge", "slide", "part"] = "slide" if rubs.any() else "hinge" if touches.any() else "part"
        kept = rubs if rubs.any() else touches if touches.any() else np.ones(len(rubs), bool)
        x, y, z = np.mean(contacts.point[here][kept], axis=0).tolist()
        joints.append(MovingJoint(int(k), kind, float(fastest[k] / top), (x, y, z)))
    return tuple(joints)
