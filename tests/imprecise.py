"""Drawings that do not quite meet: exact models whose blocks are disturbed, turned, lifted or sunk a little."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cyclopean import arch, dome, polygonal_wall, stack, vault, wall
from cyclopean.analysis import Settings, check
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block

Disturbance = Callable[[Floats, float, np.random.Generator], Floats]

TILTS = ((0.0, 0.0), (3.0, 0.0), (3.0, 90.0), (3.0, 180.0), (3.0, 270.0))
FRICTION = (0.8, 1.25)


def size(block: Block) -> float:
    """m: that of a cube as large as its box."""
    return float(np.prod(np.ptp(block.vertices, axis=0)) ** (1.0 / 3.0))


def shaken(vertices: Floats, by: float, rng: np.random.Generator) -> Floats:
    """Every vertex by itself, up to `by` along each axis."""
    return vertices + rng.uniform(-by, by, vertices.shape)


def shifted(vertices: Floats, by: float, rng: np.random.Generator) -> Floats:
    """Lifted or sunk."""
    return vertices + np.array([0.0, 0.0, rng.uniform(-by, by)])


def rolled(vertices: Floats, by: float, rng: np.random.Generator) -> Floats:
    """Turned about its middle, so that a point half a size away moves by half of `by`."""
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    middle = vertices.mean(axis=0)
    angle = by / max(float(np.prod(np.ptp(vertices, axis=0)) ** (1.0 / 3.0)), 1e-300)
    return vertices + np.cross(angle * axis, vertices - middle)


def disturbed(model: Assembly, how: Disturbance, share: float, rng: np.random.Generator, some: float = 1.0) -> Assembly:
    """The model with blocks disturbed by a share of their size, each of them with the chance `some`."""
    blocks = tuple(
        replace(b, vertices=how(b.vertices, share * size(b), rng)) if rng.random() < some else b for b in model.blocks
    )
    return replace(model, blocks=blocks, contacts=None)


def soup(model: Assembly, rng: np.random.Generator) -> Assembly:
    """The model as triangles that share no vertex, in random order, half of them turned."""

    def scattered(block: Block) -> Block:
        fans = [(f[0], f[k], f[k + 1]) for f in block.faces for k in range(1, len(f) - 1)]
        corner = rng.permutation(np.array([t[:: int(rng.choice([-1, 1]))] for t in fans]))
        faces = tuple(map(tuple, np.arange(corner.size).reshape(-1, 3).tolist()))
        return replace(block, vertices=block.vertices[corner.ravel()], faces=faces)

    return replace(model, blocks=tuple(map(scattered, model.blocks)))


def cut_block(rng: np.random.Generator) -> Assembly:
    """A wall of stone, 2 x 0.5 x 1.5 m, cut through by a few planes, on a slab."""
    from manifold3d import Manifold

    parts = [Manifold.cube([2.0, 0.5, 1.5])]
    for _ in range(int(rng.integers(2, 5))):
        lean = rng.normal(scale=0.3, size=3)
        normal = (
            np.array([lean[0], 0.2 * lean[1], 1.0]) if rng.random() < 0.6 else np.array([1.0, 0.2 * lean[1], lean[2]])
        )
        offset = float(normal @ rng.uniform([0.4, 0.1, 0.3], [1.6, 0.4, 1.2]) / np.linalg.norm(normal))
        halves = [half for part in parts for half in part.split_by_plane(normal.tolist(), offset)]
        parts = [half for half in halves if half.volume() > 1e-3]
    slab = Manifold.cube([3.0, 1.5, 0.2]).translate([-0.5, -0.5, -0.2])
    blocks = [
        Block(f"s{k}", part.to_mesh64().vert_properties[:, :3], tuple(map(tuple, part.to_mesh64().tri_verts.tolist())))
        for k, part in enumerate([slab, *parts])
    ]
    return Assembly((replace(blocks[0], fixed=True), *blocks[1:]), name=f"block cut into {len(parts)}")


def model_of(rng: np.random.Generator) -> Assembly:
    """One of several kinds of structures, sound or not."""
    kind = int(rng.integers(7))
    if kind == 0:
        return arch(int(rng.integers(5, 12)), span=2.0, rise=1.0, thickness=float(rng.uniform(0.12, 0.5)), depth=0.5)
    if kind == 1:
        return wall(int(rng.integers(2, 5)), int(rng.integers(2, 5)))
    if kind == 2:
        return vault(7, 3, thickness=float(rng.uniform(0.1, 0.3)))
    if kind == 3:
        return dome(3, 8, thickness=float(rng.uniform(0.05, 0.2)))
    if kind == 4:
        return stack(int(rng.integers(2, 6)))
    if kind == 5:
        return cut_block(rng)
    return polygonal_wall(width=2.0, height=1.4, columns=4, rows=3, seed=int(rng.integers(1000))).assembly


def verdict(model: Assembly, **more: object) -> str:
    """By rigid-block equilibrium."""
    return check(model, Settings(method="rbe", **more)).verdict


def far_from_limit(model: Assembly, mu: float, expected: str) -> bool:
    """Whether more or less friction and a little tilt leave the verdict as it is."""
    return all(verdict(model, mu=mu * share) == expected for share in FRICTION) and all(
        verdict(model, mu=mu, tilt=tilt) == expected for tilt in TILTS[1:]
    )
