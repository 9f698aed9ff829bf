"""Where stones touch, as the polyhedra that they are: at corners on faces, and where edges cross.

Two rigid bodies touch at a corner of one on a face of the other, with the face's normal, or where an edge of each
crosses that of the other, with the normal of both; where whole faces lie on each other, the corners of what they share
are such points. The normal there is certain, however rough the stone is. So a contact is a point of such a pair that
is all but closed; of points on two faces that lie in one plane, their hull.

A pair tells of the surface only if each of the bodies is, near the point, behind the plane: of its triangles there the
highest corner is the one that touches, or the highest edge. That is what a proof asks for as well, so that no contact
is listed that it would refuse.

By hand: a cube on a larger one touches it in a square; with an edge down, along a line, at its two ends.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.assembly.patches import Meeting
from cyclopean.design.rubble.features import Body, Features
from cyclopean.design.rubble.gaps import Gaps, Surroundings, gaps_between, near_pairs
from cyclopean.geometry import frames_from_normals
from cyclopean.geometry.frames import unit
from cyclopean.geometry.polygon import convex_hull

__all__ = ["TOUCH", "touching"]

# Lengths in units of the size (cube root of the volume) of the smaller of the two bodies.
TOUCH = 2.5e-4  # gap up to which two bodies touch; a stone comes to rest within a tenth of it
NEAR = 12.0  # times that: what of a body is nearer to the point has to be behind the plane
WIDE = 1e-2  # least width of a face; what is narrower is told by its ends
LEVEL = 5e-4  # sine: what is in one plane, half of what a proof allows
CROSSING = 0.1  # sine of the angle of two edges from which on they cross


def touching(body: Body, others: Sequence[Body]) -> list[tuple[Meeting, ...]]:
    """Contacts of a body with each of some others, beside which it lies; normals into the body."""
    if not others:
        return []
    size = float(np.cbrt(body.volume))
    gaps = _gaps(body, others, size)
    found = []
    for k, other in enumerate(others):
        least = min(size, float(np.cbrt(other.volume)))
        near = np.flatnonzero((gaps.body == k) & (np.abs(gaps.gap) <= TOUCH * least))
        found.append(tuple(_joint(_Points.of(other, body, gaps, near, least), least)) if len(near) else ())
    return found


def _gaps(body: Body, others: Sequence[Body], size: float) -> Gaps:
    """Near pairs of a body and some others, in place (m)."""
    still, reach = np.eye(3), TOUCH * size
    room = np.full(3, reach)
    scene = [other.features.cropped(body.low - room, body.high + room, k) for k, other in enumerate(others)]
    mine, there = (one.scaled(1.0 / size, still, -body.centroid / size) for one in (body.features, _joined(scene)))
    pairs = near_pairs(Surroundings.of(mine), still, np.zeros(3), Surroundings.of(there), TOUCH, 0.0)
    gaps = gaps_between(mine, still, np.zeros(3), there, pairs, TOUCH)
    return replace(gaps, point=size * gaps.point + body.centroid, gap=size * gaps.gap)


def _joined(parts: Sequence[Features]) -> Features:
    return parts[0] if len(parts) == 1 else Features.joined(parts)


@dataclass(frozen=True, slots=True, eq=False)
class _Points:
    """Points (k) where two bodies touch; those that tell of both surfaces."""

    at: Floats  # (k, 3) m
    normal: Floats  # (k, 3) unit, into the second
    gap: Floats  # (k,) m
    flat: Bools  # (k,) on a face of either
    known: Bools  # (k,) a corner or an edge is there

    @classmethod
    def of(cls, below: Body, above: Body, gaps: Gaps, near: Ints, least: float) -> "_Points":
        kept, flat, known = [], [], []
        for k in near.tolist():
            point, normal = gaps.point[k], gaps.normal[k]
            touch = TOUCH * least
            one, two = _top(below, point, normal, touch), _top(above, point, -normal, touch)
            faces, certain = one.face and two.face, _is_known(one, two, normal)
            if faces or certain:
                kept.append(k)
                flat.append(faces)
                known.append(certain)
        rows = np.array(kept, np.int64)
        return cls(gaps.point[rows], gaps.normal[rows], gaps.gap[rows], np.array(flat, bool), np.array(known, bool))

    def only(self, rows: Ints) -> "_Points":
        """Some of them."""
        return _Points(*(getattr(self, name)[rows] for name in self.__slots__))


@dataclass(frozen=True, slots=True, eq=False)
class _Top:
    """How a body meets a plane at a point."""

    face: bool  # a face of it is there, and in the plane
    run: Floats | None  # (3,) the edge along which it touches, 0 of a corner; None where it does neither


def _is_known(one: _Top, two: _Top, normal: Floats) -> bool:
    """Whether a corner or an edge touches a face, or an edge another that it crosses, so that the normal is certain."""
    if (one.face and two.run is not None) or (two.face and one.run is not None):
        return True
    if one.run is None or two.run is None or not (one.run.any() and two.run.any()):
        return False
    across = np.cross(one.run, two.run)
    sine = float(np.linalg.norm(across))
    least = CROSSING * (1.0 + LEVEL) * float(np.linalg.norm(one.run) * np.linalg.norm(two.run))
    return sine > least and float(np.linalg.norm(np.cross(across, normal))) <= LEVEL * sine


def _top(body: Body, point: Floats, up: Floats, touch: float) -> _Top:
    """How a body meets the plane through a point, `up` out of it: see `_top` of the certificate checker."""
    corner = body.vertices[body.triangles[_within(body, point, NEAR * touch)]]
    if not len(corner):
        return _Top(False, None)
    normal = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    lean = np.linalg.norm(np.cross(normal, up), axis=1)
    height = (corner - point) @ up
    face = bool(((normal @ up > 0.0) & (lean <= LEVEL) & (np.abs(height).max(axis=1) <= NEAR * touch)).any())
    t, c = np.divmod(int(np.argmax(height)), 3)
    top = corner[t, c]
    ahead = {tuple(e): (normal[k], e - top) for k in range(len(corner)) for e in _ends(corner[k], top, 1)}
    back = {tuple(e): normal[k] for k in range(len(corner)) for e in _ends(corner[k], top, 2)}
    both = [(ahead[e][1], ahead[e][0], back[e]) for e in ahead.keys() & back.keys()]
    if not both:
        return _Top(face, None)
    run, one, two = max(both, key=lambda edge: (float(edge[0] @ up) / float(np.linalg.norm(edge[0])), *edge[0]))
    looking = one @ up > 0.0, two @ up > 0.0
    if not (all(looking) or (any(looking) and float(np.cross(one, two) @ run) > 0.0)):
        return _Top(face, None)
    length = float(np.linalg.norm(run))
    share = float((point - top) @ run) / length**2
    away = float(np.linalg.norm(point - top - np.clip(share, 0.0, 1.0) * run))
    if away <= touch and abs(float(run @ up)) <= LEVEL * length:
        return _Top(face, run)
    return _Top(face, np.zeros(3) if float(np.linalg.norm(point - top)) <= touch else None)


def _ends(triangle: Floats, top: Floats, step: int) -> list[Floats]:
    """The corner after (1) or before (2) one of a triangle; none where that is no corner of it."""
    at = np.flatnonzero((triangle == top).all(axis=1))
    return [triangle[(int(at[0]) + step) % 3]] if len(at) else []


def _within(body: Body, point: Floats, reach: float) -> Ints:
    """Triangles of a body that come within reach of a point."""
    f = body.features
    away = point - f.middle
    some = np.flatnonzero(np.einsum("ti,ti->t", away, away) <= (f.radius + reach) ** 2)
    height = np.abs(f.plane[some, 0] @ point - f.offset[some, 0])
    some = some[height <= reach]
    corner = body.vertices[body.triangles[some]]
    inside = ((f.plane[some, 1:] @ point - f.offset[some, 1:]) <= 0.0).all(axis=1)
    run = corner[:, [1, 2, 0]] - corner
    share = np.einsum("tci,tci->tc", point - corner, run) / np.einsum("tci,tci->tc", run, run)
    beside = np.linalg.norm(point - corner - np.clip(share, 0.0, 1.0)[:, :, None] * run, axis=2).min(axis=1)
    return np.asarray(some[inside | (beside <= reach)])


def _joint(points: _Points, least: float) -> list[Meeting]:
    """Contacts of two bodies: faces first, then points."""
    found, left = [], np.ones(len(points.at), bool)
    for k in range(len(points.at)):
        if left[k] and points.flat[k]:
            off = np.abs((points.at - points.at[k]) @ points.normal[k])
            alike = left & points.flat & (points.normal @ points.normal[k] > 0.0) & (off <= TOUCH * least)
            alike &= np.linalg.norm(np.cross(points.normal, points.normal[k]), axis=1) <= LEVEL
            face = _face(points.only(np.flatnonzero(alike)), least)
            if face is not None:
                left &= ~alike
                found.append(face)
    for k in range(len(points.at)):
        if left[k] and points.known[k]:
            beside = np.linalg.norm(points.at - points.at[k], axis=1) <= 2.0 * TOUCH * least
            left &= ~(beside & (np.linalg.norm(points.normal - points.normal[k], axis=1) <= LEVEL))
            gap = float(points.gap[k])
            found.append(Meeting(points.at[k : k + 1], "point", points.normal[k], 0.0, abs(gap), gap))
    return found


def _face(points: _Points, least: float) -> Meeting | None:
    """The hull of points on two faces in one plane; None where it is a line or a point."""
    normal = points.normal.mean(axis=0)
    normal /= np.linalg.norm(normal)
    middle, frame = points.at.mean(axis=0), frames_from_normals(normal[None])[0]
    ring = convex_hull((points.at - middle) @ frame[1:].T)
    after = np.roll(ring, -1, axis=0)
    area = float((ring[:, 0] * after[:, 1] - ring[:, 1] * after[:, 0]).sum()) / 2.0
    if len(ring) < 3 or not 2.0 * area > WIDE * least * float(np.linalg.norm(after - ring, axis=1).sum()):
        return None
    off = float(np.abs((points.at - middle) @ normal).max())
    return Meeting(middle + ring @ frame[1:], "flat", normal, area, off, float(points.gap.mean()))
