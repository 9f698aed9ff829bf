"""The wall as it will be built: carved stones in place of cells, and the joints where two of them really touch.

A cell that its stone does not fill leaves gaps in the joints around it. In every joint of the drawn wall, two carved
stones touch where the faces of both reach the joint's plane:

    R = (faces of stone a in the plane) ∩ (faces of stone b in the plane) ∩ (the drawn joint).

R may be ragged, and in several patches. The contact is the **convex hull** of R, one for each drawn joint.

**Why the hull is right.** Every corner of the hull is a point of R, so the stones do touch there. A force at a point
p = sum s_i p_i of the hull (s_i >= 0, sum s_i = 1), and its moment, are those of the forces s_i f at the corners p_i;
all corners share one normal and one friction coefficient, so s_i f is admissible where f is. Hence forces at the
corners of the hull and pressure spread over R have the same resultants: rigid-block equilibrium cannot tell them apart,
in both directions, and it does not matter whether R is in one piece. Coupled analysis also asks that R does not overlap
by more than eps: of two rigid stones the distance is an affine function of the place in the plane, so it keeps its
bound on R if and only if it does at the corners of the hull. As for every contact, forces are placed at corners there,
and friction is held against the sliding of the corner it acts at.

**What is given up.** A hull of more than `CORNERS` corners is replaced by the polygon of that many of them which loses
least area, corner by corner. What is analysed then is a wall whose stones touch a little less than they do: a state of
rigid-block equilibrium found for it is one of the true wall. A mechanism, and the bound on overlap in coupled analysis,
are those of the reduced joints; `CarvedWall.kept` says how much of each hull is left.

Joints of the drawn wall keep their friction; what they may pull is left out, for a hull is larger than R. Blocks that
are held or sawn stay as they are drawn. A cell without a stone is left out, with its joints. Curved joints that were
drawn as the best plane through their corners stay that plane, and both faces are laid into it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.assembly import (
    Assembly,
    Block,
    Contacts,
    check_contacts,
    detect,
    length_tolerance,
    part,
    supports,
    surface_loads_at_points,
)
from cyclopean.design.carving.carve import Carved
from cyclopean.errors import InputError
from cyclopean.representation import one_line

__all__ = ["CORNERS", "CarvedWall", "carved_wall"]

CORNERS = 8  # of a contact
ALIGNED = 0.95  # cosine between a face and the joint that it may lie in, as the certificate checker has it


@dataclass(frozen=True, slots=True, eq=False)
class CarvedWall:
    """The wall as it will be built, and what became of the joints that were drawn (c of them)."""

    __repr__ = one_line

    assembly: Assembly  # held blocks as drawn, and the carved stones under the ids of their cells; with contacts
    missing: tuple[str, ...]  # cells that have no stone
    drawn: Floats  # (c,) m2 of each drawn joint
    touching: Floats  # (c,) m2 where the stones really touch; 0 where they do not
    kept: Floats  # (c,) area of the contact over that of the hull of the touching region; 1 where nothing was given up
    joint: Ints  # drawn joint of each contact of the assembly
    notes: tuple[str, ...]
    sawn: tuple[str, ...] = ()  # blocks that are sawn as they are drawn

    @property
    def touching_share(self) -> float:
        """Share of the drawn joints' area over which stones really touch."""
        whole = float(self.drawn.sum())
        return float(self.touching.sum()) / whole if whole > 0.0 else 0.0


def carved_wall(
    wall: Assembly,
    carved: Sequence[Carved],
    *,
    fixed: ArrayLike | None = None,
    corners: int = CORNERS,
    sawn: Sequence[int] = (),
) -> CarvedWall:
    """Put carved stones into a wall and find where they touch.

    Parameters
    ----------
    wall : Assembly
        As drawn; its contacts are detected where it gives none.
    carved : sequence of Carved
        Stones carved back to blocks of this wall.
    fixed : (n,) array_like of bool, optional
        Blocks that are held and stay as drawn; what `supports` says of the wall where not given.
    corners : int
        Most corners of a contact, at least 3.
    sawn : sequence of int
        Numbers of blocks that are sawn as they are drawn.

    Raises
    ------
    InputError
        A stone for a cell that the wall does not have, that is held or sawn, two for one, or fewer than 3 corners.
    """
    if corners < 3:
        raise InputError(f"corners: a contact needs at least 3, got {corners}")
    held = supports(wall)[0] if fixed is None else sealed("fixed", fixed, len(wall), dtype=np.bool_)
    whole = held | np.isin(np.arange(len(wall)), list(sawn))
    stones = _by_block(wall, carved, whole.tolist())
    present = [i for i in range(len(wall)) if whole[i] or i in stones]
    place = np.full(len(wall), -1)
    place[present] = np.arange(len(present))
    # each joint turned from a into b, and how far (m) the furthest lies off its faces
    joints, furthest = detect(wall).contacts if wall.contacts is None else wall.contacts, 0.0
    if wall.contacts is not None:
        joints, furthest, _ = check_contacts(wall, joints)
    tolerance, frames = length_tolerance(wall), joints.frame
    near = max(tolerance, 2.0 * furthest)
    ends = np.stack([joints.a, joints.b], 1)
    touching, kept = np.zeros(len(joints)), np.ones(len(joints))
    polygons: list[Floats] = []
    which: list[int] = []
    for k in np.flatnonzero((place[ends] >= 0).all(axis=1)).tolist():
        sides = [stones.get(i) for i in ends[k].tolist()]
        found = _touching(joints.polygon(k), frames[k], sides, near, corners, tolerance)
        if found is not None:
            polygon, touching[k], kept[k] = found
            polygons.append(polygon)
            which.append(k)
    loaded = surface_loads_at_points(wall)
    mu = [None if np.isnan(joints.mu[k]) else float(joints.mu[k]) for k in which]
    # dry, whatever the drawn joint may pull: hulls are larger than what touches
    contacts = Contacts.of([(int(a), int(b)) for a, b in place[ends[which]]], polygons, mu)
    blocks = tuple(_block(wall.blocks[i], stones.get(i), bool(held[i])) for i in present)
    built = part(loaded, blocks, contacts, place, name=f"{wall.name}, carved")
    missing, new = (tuple(wall.blocks[i].id for i in rows) for rows in (np.flatnonzero(place < 0), sawn))
    apart = np.flatnonzero((place[ends] >= 0).all(axis=1) & ~(touching > 0.0))
    names = [f"{wall.blocks[a].id}-{wall.blocks[b].id}" for a, b in ends[apart]]
    lost = len(loaded.loads) + len(loaded.actions) - len(built.loads) - len(built.actions)
    notes = _notes(missing, lost, bool(joints.strength.any()), names)
    return CarvedWall(built, missing, joints.area, touching, kept, np.array(which, np.int64), notes, new)


def _by_block(wall: Assembly, carved: Sequence[Carved], held: Sequence[bool]) -> dict[int, Carved]:
    """Carved stones by the number of their block; those of which nothing is left are left out."""
    number = {block.id: i for i, block in enumerate(wall.blocks)}
    found: dict[int, Carved] = {}
    for stone in carved:
        if stone.cell not in number:
            raise InputError(f"stone '{stone.stone}': the wall has no block '{stone.cell}'")
        i = number[stone.cell]
        if held[i]:
            raise InputError(f"stone '{stone.stone}': block '{stone.cell}' is held or sawn, it is no cell")
        if i in found:
            raise InputError(f"cell '{stone.cell}': has two stones, '{found[i].stone}' and '{stone.stone}'")
        if stone.volume > 0.0:
            found[i] = stone
    return found


def _touching(
    polygon: Floats, frame: Floats, sides: Sequence[Carved | None], near: float, corners: int, tolerance: float
) -> tuple[Floats, float, float] | None:
    """Contact polygon, touching area and share of the hull of one joint; None where the stones do not touch.

    A side that is None is a held or a sawn block, which reaches all over the drawn joint.
    """
    import shapely

    origin = polygon.mean(axis=0)
    region: Any = shapely.make_valid(shapely.Polygon((polygon - origin) @ frame[1:].T))
    for stone, sign in zip(sides, (1.0, -1.0), strict=True):
        if stone is not None and not region.is_empty:
            region = shapely.intersection(region, _faces_in_plane(stone, sign * frame[0], origin, frame, near))
    hull = shapely.convex_hull(region)
    if not 2.0 * hull.area > tolerance * hull.length:  # a strip no wider than the tolerance, a line, nothing
        return None
    outline = shapely.get_coordinates(hull.exterior)[:-1]
    ring = _inscribed(outline if hull.exterior.is_ccw else outline[::-1], corners)
    return origin + ring @ frame[1:], float(region.area), float(shapely.Polygon(ring).area / hull.area)


def _faces_in_plane(stone: Carved, normal: Floats, origin: Floats, frame: Floats, near: float) -> Any:
    """Union of the stone's faces that lie in a plane and look its way, drawn in the plane's frame."""
    import shapely

    local = stone.vertices - origin
    low = np.abs(local @ normal) <= near
    flat = stone.triangles[low[stone.triangles].all(axis=1)]
    edge = local[flat]
    double = np.cross(edge[:, 1] - edge[:, 0], edge[:, 2] - edge[:, 0])
    facing = double @ normal > ALIGNED * np.linalg.norm(double, axis=1)
    return shapely.union_all(shapely.polygons(local[flat[facing]] @ frame[1:].T))


def _inscribed(ring: Floats, most: int) -> Floats:
    """Convex ring without the corners that add least, one after the other, until it has no more than `most`."""
    while len(ring) > most:
        before, after = np.roll(ring, 1, axis=0) - ring, np.roll(ring, -1, axis=0) - ring
        ear = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
        ring = np.delete(ring, int(np.argmin(ear)), axis=0)
    return ring


def _block(drawn: Block, stone: Carved | None, held: bool) -> Block:
    if stone is None:
        return replace(drawn, fixed=held)
    density = drawn.density if stone.density is None else stone.density
    faces = tuple(map(tuple, stone.triangles.tolist()))
    return replace(drawn, vertices=stone.vertices, faces=faces, density=density, fixed=held)


def _notes(missing: Sequence[str], loads_lost: int, pulled: bool, apart: Sequence[str]) -> tuple[str, ...]:
    """What a person should be told."""
    notes = []
    if missing:
        notes.append(f"{len(missing)} cell(s) have no stone: {_some(missing)}")
    if loads_lost:
        notes.append(f"{loads_lost} load(s) acted on cells that have no stone, and are left out")
    if pulled:
        notes.append("what the drawn joints may pull is left out: carved joints are taken as dry")
    if apart:
        notes.append(f"{len(apart)} drawn joint(s) do not touch once carved: {_some(apart)}")
    return tuple(notes)


def _some(names: Sequence[str], most: int = 6) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(f"'{name}'" for name in names[:most]) + more
