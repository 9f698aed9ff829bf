"""Carve-back: what of a placed stone stays in its cell, what comes off, and where it is cut. Exact solids throughout.

Per placement, with the stone S where it was put and the cell C,

    carved = S ∩ C,    offcuts = S - C,    void = C - S,
    lambda = 1 - vol(carved) / vol(S),    g = 1 - vol(carved) / vol(C).

Both ways are checked: carved + offcuts = S and carved + void = C, each within `BALANCE`. A carved stone has to be one
piece, so where S ∩ C falls apart the largest piece is kept; the others come off too, count in lambda and g, and a note
says so.

**Cuts.** A cut is the part of the carved surface that lies on one plane of the cell (`cuts`). Its depth is how far what
comes off there reaches beyond that plane: the pieces that touch the cut are measured, not the stone as a whole, of
which another corner may be cut away by another plane. Normal and offset are given in the stone's own frame, for that is
how a mason, or a saw, has the stone.

**Too small to cut.** A cut that is nowhere deeper than `least` (2 mm unless said otherwise) is *dressing*: work for a
chisel, or left for the joint to swallow. It is listed and measured, but not counted as a cut; an offcut that reaches
beyond none of its planes by more is dressing too. The carved solid is not touched by this: it stays the exact
intersection.

Carving a stone that overlaps its cell back to the cell follows Clifford & McGee, *Cyclopean Cannibalism: A Method for
Recycling Rubble* (ACADIA 2018). By hand, a cube of 1 m and a cell of the same size, half a metre beside each other:

>>> from cyclopean.design.stones.stone import stone_of
>>> from cyclopean.geometry.solids import CUBE
>>> corner = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
>>> stone = stone_of("cube", *mesh_of(solid_of(corner, CUBE)))
>>> found = carve(stone, Block("cell", corner, CUBE), np.eye(3), [0.5, 0.0, 0.0])
>>> round(found.carved_share, 12), round(found.gap_share, 12), len(found.cuts), len(found.offcuts)
(0.5, 0.5, 1, 1)
>>> cut = found.cuts[0]
>>> round(cut.area, 12), round(cut.depth, 12), cut.normal.round(12).tolist(), round(cut.offset, 12)
(1.0, 0.5, [1.0, 0.0, 0.0], 0.5)
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.assembly import Block
from cyclopean.design.carving.cuts import (
    CellPlanes,
    Cut,
    CutPiece,
    cuts_of,
    labelled,
    pieces_with_cavities,
    planes_of,
    reaches,
)
from cyclopean.design.stones.inventory import flat_faces
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError
from cyclopean.geometry.solids import difference, intersection, mesh_of, mesh_volume, solid_of
from cyclopean.representation import one_line

__all__ = ["BALANCE", "LEAST", "Carved", "Offcut", "Total", "carve", "carve_all", "share_off", "total"]

BALANCE = 1e-9  # of a volume: what carved and offcuts may differ from the stone, carved and void from the cell
LEAST = 0.002  # m: depth up to which a cut is dressing; the kerf of a saw is wider
SPECK = 1e-12  # of the stone's volume: a piece below it is rounding, and not listed
STRAIGHT = 1e-9  # departure from a rotation that the digits of a file explain


@dataclass(frozen=True, slots=True, eq=False)
class Offcut:
    """A connected piece that comes off."""

    vertices: Floats  # (v, 3) m, wall frame
    triangles: Ints  # (t, 3)
    volume: float  # m3
    reach: float  # m; how far it reaches beyond the planes that it is cut off by
    dressing: bool  # reaches no farther than what is too small to cut
    lost: bool = False  # lies in the cell, but does not hang together with what is kept


@dataclass(frozen=True, slots=True, eq=False)
class Carved:
    """A stone carved back to its cell."""

    __repr__ = one_line

    stone: str  # id
    cell: str  # id of the block
    rotation: Floats  # (3, 3); x_wall = rotation @ x_stone + shift
    shift: Floats  # (3,) m
    vertices: Floats  # (v, 3) m, wall frame; none where the stone does not reach its cell
    triangles: Ints  # (t, 3) counter-clockwise from outside
    label: Ints  # (t,) which of `cuts` each triangle lies on; -1 = the stone's own surface
    volume: float  # m3, carved
    stone_volume: float  # m3
    cell_volume: float  # m3
    cuts: tuple[Cut, ...]  # the largest first
    offcuts: tuple[Offcut, ...]  # the largest first
    imbalance: float  # relative; the worse of both ways in which volumes are to add up
    density: float | None = None  # kg/m3, of the stone
    notes: tuple[str, ...] = ()

    @property
    def carved_share(self) -> float:
        """Lambda of this stone: the share of it that comes off."""
        return share_off(self.volume, self.stone_volume)

    @property
    def gap_share(self) -> float:
        """The share of the cell that stays empty."""
        return share_off(self.volume, self.cell_volume)


@dataclass(frozen=True, slots=True)
class Total:
    """Several placements together; shares are of summed volumes, so that a large stone counts for more."""

    imposition: float  # Lambda: what is carved off, over the volume of the stones
    gap: float  # what stays empty, over the volume of the cells
    stone_volume: float  # m3
    cell_volume: float  # m3
    volume: float  # m3, carved
    dressing: float  # m3 of offcuts that are dressing
    imbalance: float  # the worst


def total(carved: Iterable[Carved]) -> Total:
    """Sum up placements; all zero where there are none."""
    rows = list(carved)
    stones, cells = sum(c.stone_volume for c in rows), sum(c.cell_volume for c in rows)
    kept = sum(c.volume for c in rows)
    return Total(
        share_off(kept, stones) if rows else 0.0,
        share_off(kept, cells) if rows else 0.0,
        stones,
        cells,
        kept,
        sum(piece.volume for c in rows for piece in c.offcuts if piece.dressing),
        max((c.imbalance for c in rows), default=0.0),
    )


def share_off(part: float, whole: float) -> float:
    """What is not the part, over the whole; both m3."""
    return min(max(1.0 - part / whole, 0.0), 1.0)


def carve(
    stone: Stone,
    cell: Block,
    rotation: ArrayLike,
    shift: ArrayLike,
    *,
    least: float = LEAST,
    flat: ArrayLike | None = None,
) -> Carved:
    """Carve a placed stone back to its cell.

    Parameters
    ----------
    stone : Stone
        In its own frame.
    cell : Block
        A closed block of the wall.
    rotation : (3, 3) array_like
        Of the stone's frame into that of the wall.
    shift : (3,) array_like
        m; a point x of the stone goes to rotation @ x + shift.
    least : float
        m; a cut that is nowhere deeper is dressing.
    flat : (f, 3) array_like, optional
        Outward unit normals, in the stone's frame, of faces that it has already.

    Raises
    ------
    InputError
        A mesh that is not a closed solid, a matrix that is not a rotation, a depth below zero, or volumes that do not
        add up, as with a mesh that crosses itself.
    """
    if not 0.0 <= least < np.inf:
        raise InputError(f"least cut: {least:g} m must be a length of at least 0 m")
    turn, move = _pose(stone, rotation, shift)
    faces = sealed("flat", np.zeros((0, 3)) if flat is None else flat, None, 3)
    # all about the cell's middle, and the stone about its centroid: no digits are lost to where the frames lie
    origin = cell.vertices.mean(axis=0) if len(cell.vertices) else np.zeros(3)
    middle: Floats = turn @ stone.centroid + (move - origin)
    planes = planes_of(cell, origin)
    kept, lost, off, (room, imbalance) = _split(
        stone, cell, planes, (stone.vertices - stone.centroid) @ turn.T + middle
    )
    beyond = [reaches(piece, planes) for piece in off]
    depth = np.max([np.full(len(planes.normal), -1.0), *beyond], axis=0)
    cuts, label = cuts_of(stone, kept, planes, depth, (turn, middle), least, faces)
    offcuts = [
        *(_offcut(piece, origin, float(far.max(initial=0.0)), least) for piece, far in zip(off, beyond, strict=True)),
        *(_offcut(piece, origin, 0.0, least, lost=True) for piece in lost),
    ]
    return Carved(
        stone.id,
        cell.id,
        turn,
        move,
        sealed("vertices", kept.vertices + origin, None, 3),
        sealed("triangles", kept.triangles, None, 3, dtype=np.int64),
        sealed("label", label, None, dtype=np.int64),
        kept.volume,
        stone.volume,
        room,
        cuts,
        tuple(sorted((p for p in offcuts if p.volume > SPECK * stone.volume), key=lambda p: -p.volume)),
        imbalance,
        stone.density,
        _notes(stone, cell, kept, [piece for piece in lost if piece.volume > SPECK * stone.volume]),
    )


def carve_all(
    placed: Iterable[tuple[Stone, Block, Floats, Floats]],
    *,
    least: float = LEAST,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[Carved, ...]:
    """Carve many stones, each looked at for faces that are flat already; errors as `carve`.

    Parameters
    ----------
    placed : iterable of (Stone, Block, rotation, shift)
        As for `carve`.
    least : float
        m; as for `carve`.
    progress : callable
        Is told which stone comes next.
    """
    found = []
    for stone, cell, rotation, shift in placed:
        progress(f"carving '{stone.id}'")
        flat = [face.normal for face in flat_faces(stone)]
        found.append(carve(stone, cell, rotation, shift, least=least, flat=np.reshape(flat, (-1, 3))))
    return tuple(found)


def _pose(stone: Stone, rotation: ArrayLike, shift: ArrayLike) -> tuple[Floats, Floats]:
    """Rotation and shift, looked at; a rotation that is one but for the last digits of a file is set right."""
    turn = sealed(f"stone '{stone.id}': rotation", rotation, 3, 3)
    move = sealed(f"stone '{stone.id}': shift", shift, 3)
    if not np.abs(turn @ turn.T - np.eye(3)).max() <= STRAIGHT or not np.linalg.det(turn) > 0.0:
        raise InputError(f"stone '{stone.id}': its rotation is not one: a mirror, a scale or a shear")
    u, _, v = np.linalg.svd(turn)
    return sealed("rotation", u @ v, 3, 3), move


def _split(
    stone: Stone, cell: Block, planes: CellPlanes, placed: Floats
) -> tuple[CutPiece, list[CutPiece], list[CutPiece], tuple[float, float]]:
    """What is kept, what lies in the cell but is lost, what lies outside; the cell's volume (m3), and the imbalance."""
    rock = solid_of(placed, stone.triangles, f"stone '{stone.id}'")
    room = solid_of(planes.vertices, planes.triangles, f"cell '{cell.id}'")
    shared, off, void = intersection(rock, room), difference(rock, room), difference(room, rock)
    inside = [labelled(shells, room, planes) for shells in pieces_with_cavities(shared)]
    outside = [labelled(shells, room, planes) for shells in pieces_with_cavities(off)]
    common, capacity = sum(piece.volume for piece in inside), mesh_volume(planes.vertices, planes.triangles)
    worst = max(
        abs(common + sum(piece.volume for piece in outside) - stone.volume) / stone.volume,
        abs(common + mesh_volume(*mesh_of(void)) - capacity) / capacity,
    )
    if not worst <= BALANCE:
        raise InputError(
            f"stone '{stone.id}' in cell '{cell.id}': the parts differ from the whole by {worst:.2g} of its volume;"
            " does a mesh cross itself?"
        )
    nothing = CutPiece(np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros(0, np.int64), 0.0)
    kept, *lost = inside or [nothing]
    return kept, lost, outside, (capacity, worst)


def _offcut(piece: CutPiece, origin: Floats, reach: float, least: float, *, lost: bool = False) -> Offcut:
    return Offcut(
        sealed("vertices", piece.vertices + origin, None, 3),
        sealed("triangles", piece.triangles, None, 3, dtype=np.int64),
        piece.volume,
        reach,
        not lost and reach <= least,
        lost,
    )


def _notes(stone: Stone, cell: Block, kept: CutPiece, lost: Sequence[CutPiece]) -> tuple[str, ...]:
    """What a person should be told."""
    if not kept.volume > 0.0:
        return (f"stone '{stone.id}' does not reach cell '{cell.id}': nothing of it is left there",)
    if not lost:
        return ()
    gone = sum(piece.volume for piece in lost)
    many = "a piece" if len(lost) == 1 else f"{len(lost)} pieces"
    return (f"stone '{stone.id}' falls apart in cell '{cell.id}': {many} of {1000.0 * gone:.3g} L in all come off too",)
