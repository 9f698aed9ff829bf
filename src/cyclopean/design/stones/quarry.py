"""A synthetic quarry: stones with the shapes of real ones, for walls that are drawn before any stone was found.

A stone is a sphere cut by 5 to 11 planes far from each other, blunted: in the direction d its surface lies at
R(d) = (sum_k u_k^p)^(-1/p) with u_k = n_k . d / h_k for every plane n_k . x = h_k that it faces, and one term for the
sphere; the exponent p = 14 leaves arrises as worn as those of field stone. Long waves make it uneven, and a stretch
along its principal axes gives it the semi-axes that were drawn, to rounding. Every surface is a graph over the sphere,
which stretching does not change, so that no stone cuts itself.

Calibrated on 16 scans of the ETH1100 data set (Johns et al. 2023, Zenodo 10038881): ratios b/a 0.76 +- 0.12 and c/a
0.52 +- 0.12 of the semi-axes, volume 0.86 +- 0.06 of the hull's, sphericity 0.81 +- 0.05 (Wadell 1932).

>>> stone = quarry(1, seed=3)[0]
>>> stone.id, len(stone.vertices), 0.03 <= stone.volume <= 0.2
('stone-0001', 642, True)
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.design.stones.stone import Stone, stone_of
from cyclopean.errors import InputError
from cyclopean.geometry import mass_properties, pack

__all__ = ["DETAIL", "VOLUME", "laid_out", "quarry"]

VOLUME = (0.03, 0.2)  # m3: 80 to 500 kg, what is set with a small crane
DETAIL = (1, 6)  # subdivisions of the icosahedron: 42 to 40,962 vertices
FACETS = (5, 11)  # planes that cut a stone, least and most
CANDIDATES = 6  # random directions for each facet, of which those far from each other are kept
REACH = (0.75, 1.05)  # of the planes from the middle
ROUND = 1.25  # radius of the sphere that the planes cut
SHARPNESS = 14.0  # p: arrises as worn as those of field stone
WAVES = 6  # that make a stone uneven
WAVE_NUMBER = (2.0, 6.5)  # radians a radius
LEVEL = 1.3  # deviations at which crests and hollows level off; beyond, stones would grow lobes
UNEVENNESS = (0.15, 0.3)  # factor of the waves in log R; the hollows that part a stone from its hull
MIDDLE = (0.76, 0.12)  # mean and deviation of b/a
SHORT = (0.535, 0.125)  # of c/a, a little more as what goes beyond b/a is cut off
SLIMMEST = (0.5, 0.25)  # least b/a and c/a
APART = 0.97  # largest ratio of two semi-axes: a stone with two equal ones has no axes of its own
GANGWAY = 1.25  # distance of stones that are laid out, over the width of the widest


def quarry(count: int, seed: int = 0, volume: tuple[float, float] = VOLUME, *, detail: int = 3) -> tuple[Stone, ...]:
    """Make stones with the shapes of real ones, lying along the axes of their frame, longest along x.

    Parameters
    ----------
    count : int
        Number of stones. Stone k of a seed is the same whatever the count.
    seed : int
        Another seed, other stones.
    volume : (float, float)
        Least and largest volume (m3); log-uniform between.
    detail : int
        Subdivisions of the icosahedron: 10 x 4^detail + 2 vertices. A finer stone is the same one, unless two
        axes of its shape before the stretch are so nearly equal that they change places.

    Returns
    -------
    tuple of Stone
        stone-0001, stone-0002 ...

    Raises
    ------
    InputError
        No stones asked for, a band of volumes that is none, a seed below 0, or a detail out of bounds.
    """
    low, high = volume
    if count < 1:
        raise InputError(f"stones: {count} of them; ask for at least 1")
    if seed < 0:
        raise InputError(f"seed: {seed} is negative; give a whole number from 0 on")
    if not 0.0 < low <= high < math.inf:
        raise InputError(f"volume: from {low:g} to {high:g} m3 is no band; give the smaller one first, above 0")
    if not DETAIL[0] <= detail <= DETAIL[1]:
        raise InputError(f"detail: {detail} subdivisions; give {DETAIL[0]} to {DETAIL[1]}")
    direction, triangles = _icosphere(detail)
    found = []
    for k in range(count):
        draw = np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, k))))  # whatever else is made
        size = float(np.clip(low * (high / low) ** draw.uniform(), low, high))
        found.append(stone_of(f"stone-{k + 1:04d}", _shape(draw, direction, triangles, size), triangles))
    return tuple(found)


def laid_out(stones: Sequence[Stone]) -> tuple[Stone, ...]:
    """Lay stones on the ground z = 0 in rows, as they lie in their frames, so that none touches another."""
    if not stones:
        return ()
    pitch = GANGWAY * max(float(np.ptp(stone.vertices[:, :2], axis=0).max()) for stone in stones)
    columns = math.ceil(math.sqrt(len(stones)))
    found = []
    for k, stone in enumerate(stones):
        row, column = divmod(k, columns)
        low, high = stone.vertices.min(axis=0), stone.vertices.max(axis=0)
        foot = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]])
        shift = np.array([column * pitch, -row * pitch, 0.0]) - foot
        vertices = sealed("vertices", stone.vertices + shift, None, 3)
        found.append(replace(stone, vertices=vertices, centroid=sealed("centroid", stone.centroid + shift, 3)))
    return tuple(found)


def _shape(draw: np.random.Generator, direction: Floats, triangles: Ints, size: float) -> Floats:
    """Vertices (v, 3) of a stone of the volume `size` (m3), its principal axes along x, y and z."""
    normal = _far_apart(draw, int(draw.integers(FACETS[0], FACETS[1] + 1)))
    reach = draw.uniform(*REACH, len(normal))
    facing = np.maximum(direction @ normal.T / reach, 0.0)
    radius = ((facing**SHARPNESS).sum(axis=1) + ROUND**-SHARPNESS) ** (-1.0 / SHARPNESS)
    radius = radius * np.exp(draw.uniform(*UNEVENNESS) * _waves(draw, direction))
    middle = float(np.clip(draw.normal(*MIDDLE), SLIMMEST[0], APART))
    short = float(np.clip(draw.normal(*SHORT), SLIMMEST[1], APART * middle))
    mass = mass_properties(pack([(direction * radius[:, None], triangles)]))
    value, vector = np.linalg.eigh(mass.spread[0])
    axes = vector[:, ::-1].T * np.where(vector[:, ::-1].T @ normal[0] < 0.0, -1.0, 1.0)[:, None]  # at every detail
    axes[2] = np.cross(axes[0], axes[1])  # a mirror image would be inside out
    stretch = np.array([1.0, middle, short]) / np.sqrt(value[::-1])
    body = (direction * radius[:, None] - mass.centroid[0]) @ axes.T * stretch
    return np.asarray(body * (size / float(mass.volume[0] * stretch.prod())) ** (1.0 / 3.0))


def _far_apart(draw: np.random.Generator, count: int) -> Floats:
    """Unit vectors (count, 3): each the one, of random candidates, that is farthest from those before it."""
    candidate = draw.normal(size=(CANDIDATES * count, 3))
    candidate /= np.linalg.norm(candidate, axis=1)[:, None]
    chosen = [0]
    nearest = candidate @ candidate[0]  # cosine to the nearest chosen one
    for _ in range(count - 1):
        chosen.append(int(np.argmin(nearest)))
        nearest = np.maximum(nearest, candidate @ candidate[chosen[-1]])
    return np.asarray(candidate[chosen])


def _waves(draw: np.random.Generator, direction: Floats) -> Floats:
    """A sum of plane waves on the sphere, of variance about 1 before its extremes are levelled off."""
    way = draw.normal(size=(WAVES, 3))
    way *= (draw.uniform(*WAVE_NUMBER, WAVES) / np.linalg.norm(way, axis=1))[:, None]
    height = np.cos(direction @ way.T + draw.uniform(0.0, 2.0 * math.pi, WAVES)).sum(axis=1)
    return np.asarray(LEVEL * np.tanh(height / (math.sqrt(WAVES / 2.0) * LEVEL)))


@cache
def _icosphere(detail: int) -> tuple[Floats, Ints]:
    """Vertices (10 x 4^detail + 2, 3) on the unit sphere and triangles of a subdivided icosahedron."""
    g = (1.0 + math.sqrt(5.0)) / 2.0
    even = np.array([(0.0, s, t * g) for s in (-1, 1) for t in (-1, 1)])  # and its even permutations
    point = np.concatenate([even, np.roll(even, 1, axis=1), np.roll(even, 2, axis=1)])
    triangles = _nearest_triples(point)
    point /= np.linalg.norm(point, axis=1)[:, None]
    for _ in range(detail):
        point, triangles = _subdivided(point, triangles)
    point.flags.writeable = triangles.flags.writeable = False
    return point, triangles


def _nearest_triples(point: Floats) -> Ints:
    """The 20 faces of the icosahedron of edge 2: triples of corners that are that near, counter-clockwise."""
    near = np.isclose(np.linalg.norm(point[:, None] - point[None], axis=2), 2.0)
    a, b, c = np.nonzero(near[:, :, None] & near[:, None, :] & near[None, :, :])
    once = (a < b) & (a < c) & (np.einsum("ij,ij->i", point[a], np.cross(point[b], point[c])) > 0.0)
    return np.asarray(np.column_stack([a, b, c])[once], np.int64)


def _subdivided(point: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Cut each triangle into four, the new vertices on the sphere."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edge, which = np.unique(edges, axis=0, return_inverse=True)
    middle = point[edge].sum(axis=1)
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    a, b, c = triangles.T
    p, q, r = (which.reshape(-1, 3) + len(point)).T
    parts = [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
    return np.concatenate([point, middle]), np.concatenate([np.column_stack(part) for part in parts])
