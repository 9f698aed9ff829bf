"""Cells: the free blocks of a model as places for stones.

Exact volumes come from the blocks themselves (`geometry.solids`). To rank and refine poses a cell is a union of convex
parts, each a set of half-spaces about the cell's centroid:

- "convex": the planes of the block's own faces;
- "prism": a block with two caps and sides between them, such as a stone of a polygonal wall that coursing made
  concave, or one of a curved wall: the middle outline is cut into convex pieces, and planes are fitted to caps and
  sides;
- "hull": anything else is replaced by its convex hull, and `Cells.form` says so.

>>> from cyclopean.design import wall
>>> cells = cells_of(wall(3, 2), fixed=None)
>>> len(cells), set(cells.form)
(7, {'convex'})
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Bools, Floats, Ints, sealed
from cyclopean.assembly import Assembly, supports
from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults, offsets
from cyclopean.geometry.polygon import convex_pieces
from cyclopean.geometry.sides import Sides, rings
from cyclopean.representation import one_line

__all__ = ["Cells", "Form", "cells_of"]

Form = Literal["convex", "prism", "hull"]

FLAT = 1e-7  # of a block's size: how far a corner may lie outside a plane of a convex block
ALIKE = 1e-3  # planes whose normals differ by less are one (radians)
MOST_PLANES = 40  # of one part; a rounder hull is coarsened
SPECK = 1e-12  # of a block's size squared: a triangle of less area has no normal
CAP = 0.7  # cosine: a face is a cap where its normal is within 45 degrees of the way through the wall
BENT = 2e-3  # of a block's squared size: on a curved wall, corners that were straight come out a little reflex
NEAR = 8  # neighbours by whose centres the lie of the wall is told
NEVER = -1e3  # m, offset of a plane that nothing is inside of


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Places for stones, m of them.

    Cell j is the union over parts p of {x : normal[j, p, k] . (x - centre[j]) <= offset[j, p, k] for all k}. Rows are
    filled up with normal 0 and offset 1 (planes that everything is inside of), parts with normal 0 and offset -1000
    (nothing is).
    """

    __repr__ = one_line

    assembly: Assembly
    block: Ints  # (m,) block of each cell
    volume: Floats  # (m,) m3, exact
    centre: Floats  # (m, 3) m, centroid
    frame: Floats  # (m, 3, 3) rows: along the wall, up, through it; right-handed
    axes: Floats  # (m, 3, 3) rows: the same, turned about the third so that the first is the longest in the plane
    depth: Floats  # (m, 2) m: from where to where the cell reaches along frame[:, 2], about the centre
    reach: Floats  # (m,) m: distance of its farthest corner from the centre, in the wall's plane
    normal: Floats  # (m, p, k, 3)
    offset: Floats  # (m, p, k) m
    part_count: Ints  # (m,)
    form: tuple[Form, ...]  # (m,)
    sawn: Ints = field(default_factory=lambda: np.zeros(0, np.int64))  # blocks that get no found stone

    def __post_init__(self) -> None:
        m, (parts, planes) = len(self.block), self.offset.shape[1:]
        shapes = {
            "volume": (m,), "centre": (m, 3), "frame": (m, 3, 3), "axes": (m, 3, 3), "depth": (m, 2), "reach": (m,),
            "normal": (m, parts, planes, 3), "offset": (m, parts, planes),
        }  # fmt: skip
        for name, shape in shapes.items():
            object.__setattr__(self, name, sealed(name, getattr(self, name), *shape))
        for name in ("block", "part_count"):
            object.__setattr__(self, name, sealed(name, getattr(self, name), m, dtype=np.int64))

    def __len__(self) -> int:
        return len(self.block)


def cells_of(assembly: Assembly, fixed: ArrayLike | None = None, sawn: ArrayLike = ()) -> Cells:
    """Read the cells of a model.

    Parameters
    ----------
    assembly : Assembly
        Closed blocks.
    fixed : (n,) bool, optional
        Blocks that are supports, and therefore no cells; by `assembly.supports` where not given.
    sawn : (k,) int
        Numbers of blocks that are sawn new, and therefore no cells either.

    Returns
    -------
    Cells
        One for each free block, in the model's order.

    Raises
    ------
    InputError
        A block is open or has no volume, or none is free.
    """
    held = supports(assembly)[0] if fixed is None else sealed("fixed", fixed, len(assembly), dtype=np.bool_)
    new = np.asarray(sawn, np.int64)
    block = np.setdiff1d(np.flatnonzero(~held), new)
    if not len(block):
        what = "a support or sawn" if len(new) else "a support"
        raise InputError(f"cells: every block of the model is {what}, so that there is nothing to match stones to")
    for body, fault in mesh_faults(assembly.mesh):
        if not held[body]:
            raise InputError(f"block '{assembly.blocks[body].id}': {fault}; a cell must be a closed solid")
    centre, volume = assembly.mass.centroid[block], assembly.mass.volume[block]
    bodies = [_CentredBlock(assembly, int(b), c) for b, c in zip(block, centre, strict=True)]
    through = _through(bodies, centre)
    frame = np.stack([_frame(t) for t in through])
    shapes = [_shape(body, turn) for body, turn in zip(bodies, frame, strict=True)]
    normal, offset = _padded([parts for _, parts in shapes])
    _, vector = np.linalg.eigh(frame[:, :2] @ assembly.mass.spread[block] @ frame[:, :2].transpose(0, 2, 1))
    long = np.einsum("mi,mik->mk", vector[:, :, 1], frame[:, :2])  # the longest way of the cell's outline
    placed = [body.vertices @ turn.T for body, turn in zip(bodies, frame, strict=True)]
    return Cells(
        assembly=assembly,
        block=block,
        volume=volume,
        centre=centre,
        frame=frame,
        axes=np.stack([long, np.cross(frame[:, 2], long), frame[:, 2]], axis=1),
        depth=np.array([(p[:, 2].min(), p[:, 2].max()) for p in placed]),
        reach=np.array([np.hypot(p[:, 0], p[:, 1]).max() for p in placed]),
        normal=normal,
        offset=offset,
        part_count=np.array([len(parts) for _, parts in shapes]),
        form=tuple(form for form, _ in shapes),
        sawn=new,
    )


Plane = tuple[Floats, float]  # unit normal (3,), offset (m)


class _CentredBlock:
    """One block about its centroid: corners, faces, and the directed areas of its triangles."""

    def __init__(self, assembly: Assembly, block: int, centre: Floats) -> None:
        source = assembly.blocks[block]
        self.vertices: Floats = source.vertices - centre
        self.faces = source.faces
        self.face = np.repeat(np.arange(len(self.faces)), [len(f) - 2 for f in self.faces])  # of each triangle
        fans = np.array([(f[0], f[k], f[k + 1]) for f in self.faces for k in range(1, len(f) - 1)], np.int64)
        corner = self.vertices[fans]
        directed = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2.0
        self.area: Floats = np.linalg.norm(directed, axis=1)
        self.normal: Floats = directed / np.maximum(self.area, 1e-300)[:, None]
        self.middle: Floats = corner.mean(axis=1)
        self.size = float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    def facing(self, way: Floats) -> Floats:
        """Cosine (f,) of the angle between each face's mean normal and a direction."""
        total = np.zeros((len(self.faces), 3))
        np.add.at(total, self.face, self.area[:, None] * self.normal)
        return np.asarray(total @ way / np.maximum(np.linalg.norm(total, axis=1), 1e-300))


def _through(bodies: Sequence[_CentredBlock], centre: Floats) -> Floats:
    """Direction (m, 3) through the wall at each cell.

    A wall is a sheet: the centres of a cell and its neighbours lie about a plane, and the block's own faces that look
    roughly along its normal say the rest. Where centres make no sheet (a stack, a heap), it is the way along which
    the block reaches least, a level one if there is any.
    """
    from scipy.spatial import cKDTree

    count = min(NEAR + 1, len(bodies))
    near = cKDTree(centre).query(centre, count)[1].reshape(len(bodies), count)
    about = centre[near] - centre[near].mean(axis=1, keepdims=True)
    value, vector = np.linalg.eigh(about.transpose(0, 2, 1) @ about)
    sheet = (value[:, 1] > 1e-6 * value[:, 2]) & (value[:, 0] <= 0.25 * value[:, 1])
    found = np.zeros((len(bodies), 3))
    for k, body in enumerate(bodies):
        axis = vector[k, :, 0] if sheet[k] else _thinnest(body)
        facing = body.normal @ axis
        pair = np.where(np.abs(facing) > CAP, np.sign(facing) * body.area, 0.0)[:, None] * body.normal
        axis = pair.sum(axis=0) if np.abs(pair).any() else axis
        axis = axis / np.linalg.norm(axis)
        found[k] = axis if -axis[1] - 1e-3 * axis[0] + 1e-6 * axis[2] >= 0.0 else -axis
    return found


def _thinnest(body: _CentredBlock) -> Floats:
    """Normal of a face along which a block reaches least; of a level one, if there is any."""
    solid = body.normal[body.area > SPECK * body.size**2]  # a fan of a face with a straight corner has empty triangles
    level = np.abs(solid[:, 2]) < CAP
    normal = solid[level] if level.any() else solid
    extent = np.ptp(body.vertices @ normal.T, axis=0)
    thin = normal[extent <= extent.min() * (1.0 + 1e-6)]
    return np.asarray(thin[np.argmax(np.abs(thin) @ [1.0, 2.0, 0.5])])  # of a cube's: through is along y


def _frame(through: Floats) -> Floats:
    """Rows along, up and through: up is as upright as can be."""
    up = np.array([0.0, 0.0, 1.0]) - through[2] * through
    if not np.linalg.norm(up) > 1e-3:  # a floor: up is the way of y
        up = np.array([0.0, 1.0, 0.0]) - through[1] * through
    up = up / np.linalg.norm(up)
    return np.stack([np.cross(up, through), up, through])


def _shape(body: _CentredBlock, frame: Floats) -> tuple[Form, list[list[Plane]]]:
    """How a cell is put together, and the planes of each convex part."""
    own = _distinct(list(zip(body.normal, np.einsum("ti,ti->t", body.normal, body.middle), strict=True)), body.size)
    beyond = np.stack([n for n, _ in own]) @ body.vertices.T - np.array([d for _, d in own])[:, None]
    if len(own) <= MOST_PLANES and float(beyond.max()) <= FLAT * body.size:
        return "convex", [own]
    rails = _rails(body, frame)
    if rails is not None:
        return "prism", _prism(body, frame, *rails)
    return "hull", [_hull(body)]


def _distinct(planes: list[Plane], size: float) -> list[Plane]:
    """Planes without repetition."""
    kept: list[Plane] = []
    for normal, offset in planes:
        if not any(float(n @ normal) > 1.0 - ALIKE**2 / 2.0 and abs(d - offset) < ALIKE * size for n, d in kept):
            kept.append((normal, float(offset)))
    return kept


def _rails(body: _CentredBlock, frame: Floats) -> tuple[Ints, Ints] | None:
    """Rings of the front cap and of the back cap, corner by corner; None where the block is no prism."""
    facing = body.facing(frame[2])
    front = _ring([body.faces[k] for k in np.flatnonzero(facing > CAP)])
    back = _ring([body.faces[k] for k in np.flatnonzero(facing < -CAP)])
    if front is None or back is None or len(front) != len(back):
        return None
    between = {corner for k in np.flatnonzero(np.abs(facing) <= CAP) for corner in body.faces[k]}
    edges = {frozenset(pair) for face in body.faces for pair in zip(face, (*face[1:], face[0]), strict=True)}
    flat = body.vertices @ frame[:2].T
    turns = [np.roll(back[::-1], k) for k in range(len(back))]
    twin = min(turns, key=lambda ring: float(((flat[ring] - flat[front]) ** 2).sum()))
    straight = all(frozenset(pair) in edges for pair in zip(front, twin.tolist(), strict=True))
    return (np.array(front), twin) if straight and between <= {*front, *back} else None


def _ring(faces: Sequence[Sequence[int]]) -> list[int] | None:
    """The one ring round a patch of faces, counter-clockwise from outside; None where there is not just one."""
    sides = Sides.of(np.array([k for face in faces for k in face], np.int64), offsets([len(face) for face in faces]))
    found = [ring.tolist() for ring in rings(sides.rim)]
    return np.roll(found[0], -found[0].index(min(found[0]))).tolist() if len(found) == 1 else None


def _prism(body: _CentredBlock, frame: Floats, front: Ints, back: Ints) -> list[list[Plane]]:
    """Planes of the convex pieces of a block with a front, a back and sides between."""
    f, b = body.vertices[front], body.vertices[back]
    facing = body.facing(frame[2])[body.face]
    caps = [_cap(body, facing > CAP), _cap(body, facing < -CAP)]
    parts = []
    for piece in convex_pieces((f + b) / 2.0 @ frame[:2].T, BENT):
        sides = []
        for i, j in zip(piece, (*piece[1:], piece[0]), strict=True):
            normal = np.cross(f[j] - b[i], b[j] - f[i])
            normal = normal / max(float(np.linalg.norm(normal)), 1e-300)
            outward = np.cross(f[j] - f[i] + b[j] - b[i], frame[2])
            normal = normal if float(normal @ outward) >= 0.0 else -normal
            sides.append((normal, float(np.mean(np.stack([f[i], f[j], b[i], b[j]]) @ normal))))
        parts.append(_distinct([*caps, *sides], body.size))
    return parts


def _cap(body: _CentredBlock, side: Bools) -> Plane:
    """Mean plane of the triangles of a cap; a fan of a concave face has some that count against it."""
    directed = body.area[side, None] * body.normal[side]
    normal = directed.sum(axis=0)
    normal = normal / np.linalg.norm(normal)
    area = directed @ normal
    return normal, float(area @ (body.middle[side] @ normal) / area.sum())


def _hull(body: _CentredBlock) -> list[Plane]:
    """Planes of the convex hull; coarser, and so a little larger, where these are too many."""
    from scipy.spatial import ConvexHull

    normal = ConvexHull(body.vertices).equations[:, :3]
    alike = ALIKE
    while True:
        kept: list[Floats] = []
        for n in normal:
            if not kept or not float((np.stack(kept) @ n).max()) > np.cos(alike):
                kept.append(n)
        if len(kept) <= MOST_PLANES:
            return [(n, float((body.vertices @ n).max())) for n in kept]
        alike *= 1.5


def _padded(parts: list[list[list[Plane]]]) -> tuple[Floats, Floats]:
    """Planes of all parts of all cells in arrays (m, p, k, 3) and (m, p, k)."""
    most, planes = max(map(len, parts)), max(len(part) for cell in parts for part in cell)
    normal = np.zeros((len(parts), most, planes, 3))
    offset = np.ones((len(parts), most, planes))
    for j, cell in enumerate(parts):
        offset[j, len(cell) :] = NEVER
        for p, part in enumerate(cell):
            for k, (n, d) in enumerate(part):
                normal[j, p, k], offset[j, p, k] = n, d
    return normal, offset
