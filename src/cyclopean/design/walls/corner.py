"""Two polygonal walls that meet at a right angle, bonded by quoins.

The first wall is a flat one as ever, with its outer face in the plane y = 0; at its right end, u = width, the second
turns off backwards, with its outer face in the plane x = width and its own u from the corner. Both have the same course
lines, and quoins of the same height at the corner. A quoin that is long in one wall shows in the other as a cell as
wide as the first wall is deep: as its end. So the quoins of the two walls, long and short in turn, and short where the
other has a long one, are one pile of blocks that lie along one wall and the other in turn; a coping goes on with it.

Each wall is laid out on its own, with exact joints (`design.walls.joints`), and the two are then made one:

- the block of a corner stone is that of the wall in which it is long: a box, with the end of the other wall's field on
  its side;
- the short cell has no block, but what it touches of the other wall's field touches the long one instead;
- where two corner stones lie on each other, or one on the ground, one contact is kept: the depth x depth square between
  corner stones, and the whole bed of the long one on the ground;
- the ground is one fixed block, shaped like an L.

By hand: the overlap of two corner stones is the square of the depth, 0.2 x 0.2 m.

>>> made = corner_wall(PatternSettings(), 2.0)
>>> stones = [k for k, block in enumerate(made.assembly.blocks) if block.id.startswith("corner")]
>>> contacts = made.assembly.contacts
>>> between = np.isin(contacts.a, stones) & np.isin(contacts.b, stones)
>>> contacts.area[between].round(12).tolist()
[0.04, 0.04, 0.04, 0.04]
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block, Contacts, SteepBed
from cyclopean.design.options import not_negative, positive
from cyclopean.design.walls.beds import bedded, without_bed
from cyclopean.design.walls.dressing import Quoins
from cyclopean.design.walls.improve import Chosen, improvements, standing
from cyclopean.design.walls.interlock import interlock, score
from cyclopean.design.walls.joints import FOOTING, MARGIN, JointReadout, Masonry, jointed, with_open_joints
from cyclopean.design.walls.openings import clear_shape, head_stones
from cyclopean.design.walls.pattern import Pattern, PatternSettings, draw_pattern
from cyclopean.design.walls.polygonal import verdict
from cyclopean.design.walls.surfaces import Plane, ReturnPlane, Surface, Thickness
from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults
from cyclopean.representation import one_line

__all__ = ["CornerWall", "corner_quoins", "corner_wall", "corner_with_open_joints", "joint_score"]

LONG = 2.0  # times the depth: default length of the long quoins, unless that of any quoin is more


@dataclass(frozen=True, slots=True, eq=False)
class CornerWall:
    """Two walls and their corner as one model, and what they were drawn from."""

    __repr__ = one_line

    assembly: Assembly  # block 0: the fixed ground; the first wall's stones, then what the second has beside them
    patterns: tuple[Pattern, Pattern]
    block: tuple[tuple[int, ...], tuple[int, ...]]  # of each cell of each pattern; the two share the corner stones
    thickness: Thickness
    joints: JointReadout
    chosen: Chosen | None = None  # which of the improved walls these are, and whether they stand; None = not improved

    @property
    def surfaces(self) -> tuple[Surface, Surface]:
        """What the two patterns lie on."""
        return Plane(), ReturnPlane(self.patterns[0].settings.width)

    @property
    def without_bed(self) -> tuple[SteepBed, ...]:
        """As of a `PolygonalWall`."""
        both = zip(self.patterns, self.block, strict=True)
        field = {k for one, block in both for k, kind in zip(block, one.kind, strict=True) if kind == "stone"}
        return without_bed(self.assembly, sorted(field), self.patterns[0].settings.max_bed)

    @property
    def corner(self) -> tuple[int, ...]:
        """Blocks that are in both walls, from the foot up."""
        return tuple(sorted(set(self.block[0]) & set(self.block[1]), key=lambda k: self.assembly.mass.centroid[k, 2]))


def corner_quoins(depth: float, quoins: Quoins | None = None) -> Quoins:
    """Quoins for the corner of walls of this depth (m): those given, or usual ones at the corner alone.

    Raises
    ------
    InputError
        Short quoins that are not as wide as the walls are deep, or long ones that are no longer than that.
    """
    positive("depth", depth)
    if quoins is None:
        return Quoins(max(Quoins().long, LONG * depth), depth, left=False)
    if quoins.short != depth:
        raise InputError(
            f"quoins short: {quoins.short:g} m, but at a corner it is the end of the other wall's; give {depth:g} m"
        )
    if not quoins.long > depth:
        raise InputError(f"quoins long: {quoins.long:g} m ties nothing at a corner; give more than {depth:g} m")
    return quoins


def corner_wall(
    settings: PatternSettings | None = None,
    length: float = 2.0,
    *,
    depth: float = 0.2,
    density: float | None = None,
    mu: float | None = None,
    improve: bool | float = False,
) -> CornerWall:
    """Draw two walls of polygonal stones that meet at a right angle on a fixed ground block.

    Parameters
    ----------
    settings : PatternSettings, optional
        The first wall's pattern. The second has its height, rows, courses and coping, stones of the same size, the next
        seed and no openings. Quoins stand at the corner; where some are given, also at the walls' other ends.
    length : float
        Of the second wall, along its outer face from the corner (m).
    depth : float
        Thickness of both (m).
    density, mu : float, optional
        kg/m3 of every block, and friction coefficient of every joint; None = not said.
    improve : bool or float
        As for `polygonal_wall`; both patterns.

    Raises
    ------
    InputError
        As `polygonal_wall`; ground that is not level; quoins or a coping that cannot turn the corner; an opening that
        leaves no room for the long quoins; a wall that is not longer than they are.
    """
    both = _both(settings or PatternSettings(), positive("corner", length), depth)
    bed = Thickness(depth), Masonry(density, mu)
    if not improve:
        return _joined((draw_pattern(both[0]), draw_pattern(both[1])), *bed)
    first, second = (improvements(one, until=float(improve)) for one in both)
    count = max(len(first), len(second))
    pairs = [(first[min(k, len(first) - 1)], second[min(k, len(second) - 1)]) for k in range(count)]
    chosen = standing(pairs, lambda pair: verdict(_joined(pair, *bed).assembly))
    return replace(_joined(pairs[chosen.place], *bed), chosen=chosen)


def joint_score(made: CornerWall) -> float:
    """Interlock score J of both walls together: their joints and crossings added up, over the stones there are."""
    found = [interlock(pattern, depth=made.thickness.depth) for pattern in made.patterns]
    crossings = sum(len(one.crossings) for one in found)
    head, bad = sum(one.head_length for one in found), sum(one.aligned_length for one in found)
    return score(head, bad, crossings, len(made.assembly) - 1)


def corner_with_open_joints(made: CornerWall, *, gap: float = 0.01, chamfer: float = 0.0) -> tuple[Block, ...]:
    """Every stone set back from its joints, as `with_open_joints` does it; in the order of the model's.

    Raises
    ------
    InputError
        As `with_open_joints`.
    """
    blocks = list(made.assembly.blocks)
    apart = _apart(made, not_negative("gap", gap))
    for k, surface in enumerate(made.surfaces):
        shown = with_open_joints(apart[k], surface, made.thickness, gap=gap, chamfer=chamfer)
        long = _long(made.patterns[k])
        for cell, block in enumerate(made.block[k]):
            if long.get(cell, True):
                blocks[block] = replace(shown[cell], id=blocks[block].id)
    return tuple(blocks[1:])


def _both(settings: PatternSettings, length: float, depth: float) -> tuple[PatternSettings, PatternSettings]:
    """What the two patterns are drawn from."""
    quoins = corner_quoins(depth, settings.quoins)
    given = settings.quoins
    if settings.base is not None or settings.base_radius is not None:
        raise InputError("base: a corner needs level ground; leave it out")
    if not length > quoins.long:
        raise InputError(f"corner: {length:g} m leaves nothing beside quoins {quoins.long:g} m long; give more")
    for k, opening in enumerate(settings.openings):
        shapes = [clear_shape(opening), *(stone for _, stone in head_stones(opening))]
        right = float(max(shape[:, 0].max() for shape in shapes))
        if settings.width >= right > settings.width - quoins.long:
            raise InputError(
                f"openings: number {k + 1} with its head reaches to {settings.width - right:g} m from the corner, "
                f"where the quoins are {quoins.long:g} m long; move it away"
            )
    first = replace(quoins, left=given is not None and given.left, right=True, corner="right")
    second = replace(quoins, left=True, right=given is not None and given.right, corner="left")
    columns = max(1, round(settings.columns * length / settings.width))
    return replace(settings, quoins=first), replace(
        settings, width=length, columns=columns, seed=settings.seed + 1, openings=(), quoins=second
    )


def _long(pattern: Pattern) -> dict[int, bool]:
    """Cells at the corner, from the foot up, and whether they are longer than the end of a wall."""
    cells, quoins = pattern.subdivision, pattern.settings.quoins
    at, short = (pattern.settings.width if quoins.corner == "right" else 0.0, quoins.short) if quoins else (0.0, 0.0)
    here = np.unique(cells.cell()[cells.vertex[cells.index, 0] == at])
    here = here[np.argsort(cells.centroids()[here, 1])]
    return {k: float(np.ptp(cells.ring(k)[:, 0])) > short * (1.0 + 1e-9) for k in here.tolist()}


def _pairs(patterns: tuple[Pattern, Pattern]) -> dict[int, int]:
    """Cell of the second wall at the corner to that of the first which is the same stone.

    Raises
    ------
    InputError
        Corner stones that do not lie at the same heights, long in one wall and short in the other.
    """
    one, two = (_long(pattern) for pattern in patterns)
    at_corner = [(pattern, k) for pattern, long in zip(patterns, (one, two), strict=True) for k in long]
    area = np.array([pattern.subdivision.areas()[k] for pattern, k in at_corner])
    box = np.array([np.prod(np.ptp(pattern.subdivision.ring(k), axis=0)) for pattern, k in at_corner])
    if not np.all(np.abs(area - box) <= 1e-9 * box):
        raise InputError("corner: a joint of the field would cut into a quoin; choose another seed")
    height = [pattern.subdivision.ring(k)[:, 1] for pattern, k in at_corner]
    bed = [(float(v.min()), float(v.max())) for v in height]
    alternate = all(a != b for a, b in zip(one.values(), two.values(), strict=False))
    kinds = {pattern.kind[k] for pattern, k in at_corner}
    if bed[: len(one)] != bed[len(one) :] or not alternate or not kinds <= {"quoin", "coping"}:
        raise InputError(
            "corner: its stones do not lie along one wall and the other in turn; "
            "make the coping's stones longer than the walls are deep"
        )
    return dict(zip(two, one, strict=True))


def _joined(patterns: tuple[Pattern, Pattern], thickness: Thickness, masonry: Masonry) -> CornerWall:
    """Both walls as one model."""
    width = patterns[0].settings.width
    faces: tuple[Surface, Surface] = (Plane(), ReturnPlane(width))
    patterns = (bedded(patterns[0], faces[0], thickness), bedded(patterns[1], faces[1], thickness))
    same = _pairs(patterns)
    laid = [jointed(pattern, face, thickness, masonry) for pattern, face in zip(patterns, faces, strict=True)]
    first = [k + 1 for k in range(len(patterns[0].subdivision))]
    fresh = iter(range(len(first) + 1, len(first) + len(patterns[1].subdivision) + 1))
    second = [first[same[k]] if k in same else next(fresh) for k in range(len(patterns[1].subdivision))]
    number = (tuple(first), tuple(second))
    blocks: dict[int, Block] = {0: _ground(width, patterns[1].settings.width, thickness.depth, masonry.density)}
    place = {first[k]: i for i, k in enumerate(same.values(), 1)}  # of the corner stones, from the foot up
    for wall, (pattern, (assembly, _)) in enumerate(zip(patterns, laid, strict=True)):
        long = _long(pattern)
        for cell, block in enumerate(assembly.blocks[1:]):
            k = number[wall][cell]
            if cell not in long:
                blocks[k] = replace(block, id=f"w{wall + 1}-{block.id}")
            elif long[cell]:
                blocks[k] = replace(block, id=f"corner-{place[k]:02d}")
    contacts = _contacts(patterns, [assembly for assembly, _ in laid], number)
    name = f"polygonal walls of {len(blocks) - 1} round a corner"
    model = Assembly(tuple(blocks[k] for k in range(len(blocks))), contacts, name=name)
    if bad := mesh_faults(model.mesh):
        raise InputError(f"corner: block '{model.blocks[bad[0][0]].id}' {bad[0][1]}; choose another seed")
    short = sum(readout.short for _, readout in laid)
    joints = JointReadout(joints=len(contacts), warped=0, folded=0, warp=0.0, deviation=0.0, short=short)
    return CornerWall(model, patterns, number, thickness, joints)


def _contacts(
    patterns: tuple[Pattern, Pattern], laid: Sequence[Assembly], number: tuple[tuple[int, ...], tuple[int, ...]]
) -> Contacts:
    """Contacts of both walls, from the lower block number to the higher."""
    found: list[tuple[tuple[int, int], Floats, float]] = []
    for wall, (pattern, assembly) in enumerate(zip(patterns, laid, strict=True)):
        long, contacts = _long(pattern), cast("Contacts", assembly.contacts)
        for k, (a, b) in enumerate(zip(contacts.a.tolist(), contacts.b.tolist(), strict=True)):
            short_on_ground = a == 0 and not long.get(b - 1, True)
            said_before = wall == 1 and a - 1 in long and b - 1 in long
            if short_on_ground or said_before:
                continue
            p, q = (0 if x == 0 else number[wall][x - 1] for x in (a, b))
            polygon = contacts.polygon(k)
            found.append(((min(p, q), max(p, q)), polygon if p < q else polygon[::-1], float(contacts.mu[k])))
    found.sort(key=lambda one: one[0])
    return Contacts.of([one[0] for one in found], [one[1] for one in found], [one[2] for one in found])


def _ground(width: float, length: float, depth: float, density: float | None) -> Block:
    """Fixed block below both walls, with the usual margin round their feet."""
    m = MARGIN * depth
    plan = np.array([
        [-m, -m], [width + m, -m], [width + m, length + m], [width - depth - m, length + m],
        [width - depth - m, depth + m], [-m, depth + m],
    ])  # fmt: skip
    k = len(plan)
    vertices = np.concatenate([np.c_[plan, np.full(k, -FOOTING * depth)], np.c_[plan, np.zeros(k)]])
    sides = [(i, (i + 1) % k, (i + 1) % k + k, i + k) for i in range(k)]
    return Block("ground", vertices, (tuple(range(k))[::-1], tuple(range(k, 2 * k)), *sides), density, True, "ground")


def _apart(made: CornerWall, gap: float) -> list[Pattern]:
    """The patterns with their ends at the corner half a gap further out, and the short cells that much wider.

    Setting the stones back then leaves the arris where it was, and a whole gap beside the end of every long quoin.
    """
    shown = []
    for pattern, at, sign in zip(made.patterns, (made.patterns[0].settings.width, 0.0), (1.0, -1.0), strict=True):
        cells = pattern.subdivision
        vertex, u = cells.vertex.copy(), cells.vertex[:, 0]
        vertex[u == at, 0] += sign * gap / 2.0
        vertex[u == at - sign * made.thickness.depth, 0] -= sign * gap / 2.0
        shown.append(replace(pattern, subdivision=type(cells)(vertex, cells.start, cells.index, cells.site)))
    return shown
