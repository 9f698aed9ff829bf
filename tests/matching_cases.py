"""Small models and stones for the tests of matching."""

import numpy as np

from cyclopean.assembly import Assembly, Block
from cyclopean.design.matching.cells import Cells
from cyclopean.design.stones.stone import Stone, stone_of
from cyclopean.geometry.solids import mesh_of, solid_of
from geometry_rules import hull_mesh

BOX = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def box(size, centre=(0.0, 0.0, 0.0)):
    """Corners and faces of a cuboid."""
    corner = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return corner * np.asarray(size) + np.asarray(centre), BOX


def prism(ring, low=0.0, high=1.0):
    """Corners and faces of an upright wall's cell: a counter-clockwise outline in (x, z), from y = low to high."""
    flat, k = np.asarray(ring, float), len(ring)
    corners = [np.column_stack([flat[:, 0], np.full(k, y), flat[:, 1]]) for y in (low, high)]
    sides = tuple((i, i + k, (i + 1) % k + k, (i + 1) % k) for i in range(k))
    return np.concatenate(corners), (tuple(range(k)), tuple(range(2 * k - 1, k - 1, -1)), *sides)


def model(*bodies, fixed=()):
    """An assembly of these bodies, none in contact."""
    return Assembly(tuple(Block(f"b{k}", *body, fixed=k in fixed) for k, body in enumerate(bodies)))


def rotation(seed):
    """A random rotation."""
    turn, _ = np.linalg.qr(np.random.Generator(np.random.PCG64(seed)).normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))


def stone(vertices, faces, name="s", turn=None, shift=(0.0, 0.0, 0.0)) -> Stone:
    """A body as a stone, its file turned and moved."""
    corner, triangles = mesh_of(solid_of(vertices, faces))
    return stone_of(name, corner @ (np.eye(3) if turn is None else turn).T + np.asarray(shift), triangles)


def stones_of(cells: Cells, scale=1.0, seed=0):
    """A stone like each cell, shuffled and turned; and the cell each was made from."""
    draw = np.random.Generator(np.random.PCG64(seed))
    order = draw.permutation(len(cells))
    found = []
    for j in order:
        block = cells.assembly.blocks[cells.block[j]]
        about = cells.centre[j] + scale * (block.vertices - cells.centre[j])
        found.append(stone(about, block.faces, f"s{j}", rotation([seed, int(j)]), 3.0 * draw.normal(size=3)))
    return found, order


def rubble(count, seed=0, size=0.5):
    """Convex stones of a dozen corners, of no symmetry."""
    found = []
    for k in range(count):
        draw = np.random.Generator(np.random.PCG64([seed, k]))
        point = draw.normal(size=(14, 3))
        point *= size / 2.0 * draw.uniform(0.8, 1.2) / np.linalg.norm(point, axis=1)[:, None] * [1.3, 1.0, 0.7]
        found.append(stone_of(f"r{k}", *hull_mesh(point)))
    return found


def row_of_boxes(widths, depth=0.35, height=0.45):
    """Cells side by side in a wall, on a fixed ground."""
    left = np.cumsum([0.0, *widths])
    bodies = [box((left[-1], depth, 0.1), (left[-1] / 2.0, 0.0, -0.05))]
    bodies += [
        box((w, depth, height), (x + w / 2.0, 0.0, height / 2.0)) for w, x in zip(widths, left[:-1], strict=True)
    ]
    return model(*bodies, fixed=(0,))
