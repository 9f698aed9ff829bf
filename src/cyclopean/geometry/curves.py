"""Curves as facets: corners on the curve, and no chord further from it than a stated deviation.

A curve P(t), t from 0 to 1, in n equal steps leaves its chords by at most |P''| / (8 n^2), so that
n = sqrt(max |P''| / (8 d)) steps do for a deviation d. With c the centre and a, b conjugate half axes,
P = c + a cos s + b sin s has |P''| <= |s'|^2 sigma, sigma the larger singular value of [a b]; on a circle that is its
radius, and the bound that of the sagitta. A Bezier curve of degree k with control points p has
|P''| <= k (k - 1) max |p_i - 2 p_i+1 + p_i+2|. The same curve drawn the other way round has the same corners.

By hand: a quarter of a circle of radius 1 within 0.01 needs (pi / 2) / sqrt(8 x 0.01) = 5.6 steps.

>>> quarter = elliptic(np.zeros(2), np.array([1.0, 0.0]), np.array([0.0, 1.0]), 0.0, np.pi / 2.0)
>>> len(quarter.corners(0.01)) - 1
6
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import comb

import numpy as np

from cyclopean.arrays import Floats

__all__ = ["Curve", "bezier", "bulged", "elliptic", "sampled", "straight", "thinned"]

ROUGH = 8  # steps where any deviation will do, as for the size of a drawing
MOST = 5000  # steps of one curve; a full circle then leaves its chords by 2e-7 of its radius


@dataclass(frozen=True, slots=True)
class Curve:
    """A piece of a line."""

    corners: Callable[[float], Floats]  # of a deviation: (k, d) points on it, the ends included
    bent: bool = True


def straight(point: Floats) -> Curve:
    """Straight pieces through points (k, d)."""
    return Curve(lambda _: point, bent=False)


def elliptic(centre: Floats, a: Floats, b: Floats, start: float, end: float) -> Curve:
    """Arc centre + a cos s + b sin s from s = start to s = end (rad); centre, a and b are (d,)."""
    bend = (end - start) ** 2 * float(np.linalg.norm(np.stack([a, b]), 2))

    def corners(deviation: float) -> Floats:
        turn = np.linspace(start, end, _steps(bend, deviation) + 1)[:, None]
        return np.asarray(centre + a * np.cos(turn) + b * np.sin(turn))

    return Curve(corners)


def bulged(start: Floats, end: Floats, bulge: float) -> Curve:
    """Arc between two points (2,); the bulge is the tangent of a quarter of its angle, positive counter-clockwise."""
    if not bulge:
        return straight(np.stack([start, end]))
    chord = end - start
    centre = (start + end) / 2.0 + np.array([-chord[1], chord[0]]) * (1.0 - bulge**2) / (4.0 * bulge)
    ray = start - centre
    arc = elliptic(centre, ray, np.array([-ray[1], ray[0]]), 0.0, 4.0 * float(np.arctan(bulge)))
    return Curve(lambda deviation: np.concatenate([start[None], arc.corners(deviation)[1:-1], end[None]]))


def bezier(control: Floats) -> Curve:
    """Bezier curve of any degree over its control points (k + 1, d)."""
    degree = len(control) - 1
    bend = degree * (degree - 1) * float(np.linalg.norm(np.diff(control, 2, axis=0), axis=1).max(initial=0.0))

    def corners(deviation: float) -> Floats:
        t = np.linspace(0.0, 1.0, _steps(bend, deviation) + 1)[:, None]
        share = [comb(degree, k) * t**k * (1.0 - t) ** (degree - k) for k in range(degree + 1)]
        return np.asarray(np.concatenate(share, axis=1) @ control)

    return Curve(corners)


def sampled(at: Callable[[Floats], Floats], start: float, end: float) -> Curve:
    """A curve that can only be asked for points: parameters (k,) from start to end to (k, d)."""

    def corners(deviation: float) -> Floats:
        steps, found = ROUGH, at(np.linspace(start, end, ROUGH + 1))
        while np.isfinite(deviation) and steps < MOST:
            steps, coarse = 2 * steps, found
            found = at(np.linspace(start, end, steps + 1))
            off = np.linalg.norm(found[1::2] - (coarse[:-1] + coarse[1:]) / 2.0, axis=1)
            if off.max() <= deviation / 2.0:
                return thinned(found, deviation / 2.0)
        return found

    return Curve(corners)


def _steps(bend: float, deviation: float) -> int:
    if not np.isfinite(deviation):
        return ROUGH
    return int(np.clip(np.ceil(np.sqrt(bend / (8.0 * deviation))), 1, MOST))


def thinned(point: Floats, deviation: float) -> Floats:
    """Points (k, d) of a line without those that can go if no other may lie off it by more (Douglas, Peucker 1973)."""
    keep = np.zeros(len(point), bool)
    keep[[0, -1]] = True
    stack = [(0, len(point) - 1)]
    while stack:
        first, last = stack.pop()
        way, off = point[last] - point[first], point[first + 1 : last] - point[first]
        length = float(way @ way)
        share = np.clip(off @ way / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(off))
        far = np.linalg.norm(off - share[:, None] * way, axis=1)
        if len(far) and far.max() > deviation:
            middle = first + 1 + int(far.argmax())
            keep[middle] = True
            stack += [(first, middle), (middle, last)]
    return point[keep]
