"""Meshes whose shape is known, and the real scans. The scans are not part of the project."""

import os
from pathlib import Path

import numpy as np
import pytest

from cyclopean.geometry.solids import intersection, solid_of, solid_volume

SCANS = Path(os.environ.get("CYCLOPEAN_STONES", Path(__file__).parents[2] / "shared" / "data" / "eth1100_subset"))
NAMES = sorted(path.stem for path in SCANS.glob("*.obj"))
needs_scans = pytest.mark.skipif(not NAMES, reason=f"the scans are not at {SCANS}")

CUBE_FACES = np.array(
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
     (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
)  # fmt: skip


def box(x=1.0, y=1.0, z=1.0, at=(0.0, 0.0, 0.0)):
    """Vertices and outward triangles of a box with its lowest corner at `at`."""
    corner = np.array([[i, j, k] for i in (0, x) for j in (0, y) for k in (0, z)], float)
    return corner + np.asarray(at, float), CUBE_FACES.copy()


def subdivided(vertices, triangles):
    """Every triangle in four, at the middles of its sides; the shape is the same to the bit or nearly."""
    v, t = [tuple(p) for p in vertices.tolist()], []
    middle = {}

    def between(i, j):
        key = (min(i, j), max(i, j))
        if key not in middle:
            middle[key] = len(v)
            v.append(tuple((np.array(v[i]) + np.array(v[j])) / 2))
        return middle[key]

    for a, b, c in triangles.tolist():
        ab, bc, ca = between(a, b), between(b, c), between(c, a)
        t += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.array(v), np.array(t)


def sphere(detail=2):
    """Vertices on the unit sphere: an octahedron in four, again and again."""
    v = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    t = np.array([(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])
    for _ in range(detail):
        v, t = subdivided(v, t)
        v /= np.linalg.norm(v, axis=1)[:, None]
    return v, t


def boulder(seed=0, detail=2):
    """A bumpy stone without any symmetry, 0.3 to 0.6 m."""
    draw = np.random.default_rng(seed)
    v, t = sphere(detail)
    way = draw.normal(size=(6, 3))
    radius = 1.0 + 0.08 * np.cos(v @ way.T * 2.0 + draw.uniform(0, 6, 6)).sum(axis=1)
    return v * radius[:, None] * np.array([0.3, 0.23, 0.17]) * draw.uniform(0.9, 1.1, 3), t


def bent_bar(angle, steps=48):
    """A square bar bent round the z axis by an angle: beyond 2 pi it runs into itself."""
    turn = np.linspace(0.0, angle, steps + 1)
    section = np.array([[0.8, 0.0], [1.2, 0.0], [1.2, 0.3], [0.8, 0.3]])
    v = np.array([[r * np.cos(a), r * np.sin(a), z] for a in turn for r, z in section])
    return v, np.array([*_tube(steps, 4), (0, 1, 2), (0, 2, 3), *(4 * steps + np.array([(0, 2, 1), (0, 3, 2)]))])


def _tube(steps, k):
    sides = []
    for i in range(steps):
        for m in range(k):
            a, b = k * i + m, k * i + (m + 1) % k
            sides += [(a, a + k, b + k), (a, b + k, b)]
    return sides


def prism(outline, height=1.0):
    """A tube over a closed curve in the plane, its two ends fans about their middles; follows the curve's turns."""
    outline = np.asarray(outline, float)
    k = len(outline)
    low, high = (np.column_stack([outline, np.full(k, z)]) for z in (0.0, height))
    middle = outline.mean(axis=0)
    v = np.concatenate([low, high, [[*middle, 0.0], [*middle, height]]])
    t = []
    for m in range(k):
        n = (m + 1) % k
        t += [(m, n, k + n), (m, k + n, k + m), (n, m, 2 * k), (k + m, k + n, 2 * k + 1)]
    return v, np.array(t)


def torus(major, minor, steps=24):
    """Closed and smooth; with minor > major it goes through itself at the axis."""
    step = 2 * np.pi / steps
    a, b = np.meshgrid(step * np.arange(steps), step * (np.arange(steps) + 0.3), indexing="ij")
    r = major + minor * np.cos(b)
    v = np.stack([r * np.cos(a), r * np.sin(a), minor * np.sin(b)], 2).reshape(-1, 3)
    at = np.arange(steps * steps).reshape(steps, steps)
    right, up = np.roll(at, -1, axis=0), np.roll(at, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    halves = [np.stack(corners, 2).reshape(-1, 3) for corners in ((at, right, both), (at, both, up))]
    return v, np.concatenate(halves)


def rotation(seed):
    """A rotation matrix at random."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def obj(vertices, triangles, name=None, before=0):
    """OBJ text of one mesh; `before` vertices stand above it in the file."""
    lines = [f"o {name}"] if name else []
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices).tolist()]
    lines += ["f " + " ".join(str(i + 1 + before) for i in row) for row in np.asarray(triangles).tolist()]
    return "\n".join(lines) + "\n"


def largest_overlap(assembly):
    """Largest volume that two blocks have in common, as share of the smaller one, and which two; by exact solids."""
    solids = [solid_of(b.vertices, b.faces, b.id) for b in assembly.blocks]
    low, high = (np.array([f(b.vertices, axis=0) for b in assembly.blocks]) for f in (np.min, np.max))
    worst = 0.0, ("", "")
    for a, solid in enumerate(solids):
        for b in (np.flatnonzero(((low[a + 1 :] < high[a]) & (high[a + 1 :] > low[a])).all(axis=1)) + a + 1).tolist():
            share = solid_volume(intersection(solid, solids[b])) / assembly.mass.volume[[a, b]].min()
            worst = max(worst, (float(share), (assembly.blocks[a].id, assembly.blocks[b].id)))
    return worst
