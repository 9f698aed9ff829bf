"""Stones and cells that several tests of carving share."""

import numpy as np

from cyclopean.assembly import Block
from cyclopean.design.carving.cuts import planes_of
from cyclopean.design.stones.stone import Stone, stone_of
from cyclopean.geometry.solids import CUBE
from geometry_rules import hull_mesh

CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])


def box(size=(1.0, 1.0, 1.0), low=(0.0, 0.0, 0.0), name="cell", **more) -> Block:
    """A box as a block."""
    return Block(name, np.asarray(low) + CORNERS * size, CUBE, **more)


def stone_like(block: Block, scale: float = 1.0, name: str = "") -> Stone:
    """A stone of the shape of a block, scaled about its centroid."""
    vertices, triangles = block.vertices, planes_of(block, np.zeros(3)).triangles
    found = stone_of(name or block.id, vertices, triangles)
    middle = found.centroid
    return stone_of(name or block.id, middle + scale * (vertices - middle), triangles, block.density)


def prism(outline, depth: float, name: str = "cell", up: bool = False) -> Block:
    """A polygon (x, z), counter-clockwise as seen from -y, drawn through y = 0 to depth; or (x, y), drawn up."""
    flat = np.asarray(outline, float)
    n = len(flat)
    ends = []
    for level in (0.0, depth):
        ends.append(np.insert(flat, 2 if up else 1, level, axis=1))
    front, back = tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1))
    sides = [(k, n + k, n + (k + 1) % n, (k + 1) % n) for k in range(n)]
    faces = (front, back, *sides)
    if up:
        faces = tuple(face[::-1] for face in faces)
    return Block(name, np.concatenate(ends), faces)


def rotation(rng: np.random.Generator) -> np.ndarray:
    """A random rotation."""
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))


def pebble(rng: np.random.Generator, count: int = 30, size: float = 1.0) -> Stone:
    """A convex stone: the hull of random points, somewhere off its origin."""
    return stone_of("pebble", *hull_mesh(size * rng.normal(size=(count, 3)) / 2.0 + rng.normal(size=3)))
