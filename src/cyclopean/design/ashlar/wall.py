"""Ashlar: walls of sawn stones in level courses, every one cut, placed and accounted for.

The wall stands on level ground with its front face in y = 0, from x = 0 to its length. Each course is divided by a bond
(`bonds`); each part of it is a slot for one stone, which a rule chooses from the stock and the saw cuts to fit. A slot
for which no piece is long enough is filled with two. What cannot be filled is a gap, and is told; nothing is laid on
top of a course with gaps.

*Joints.* Dry stones touch, so the default width is 0. Where bed or head joints have a width, stones are sawn smaller
by it; what is checked are stones that meet in the middles of their joints, as in a polygonal wall: mortar counts as
stone, and holds nothing together. `open_stones` gives the stones as they are sawn.

*Heights.* A course is as high as the lowest slab that is within a tolerance of the height wanted; the others are
dressed down to it. Nothing is sawn along its bed.

By hand, 1.5 x 1.0 m of slabs of 0.30 x 0.20 x 0.15 m: 6 courses fit, 0.9 of the face is covered. In stack bond those
are 30 blocks with 4 x 6 head joints, 5 x 5 bed joints and 5 on the ground. In running bond every odd course has
4 whole stones and 2 halves of a fifth: 33 blocks from the same 30 slabs, 3 x 4 + 3 x 5 head joints and 5 x 10 bed
joints, and no end of the wall stays open.

>>> from cyclopean.design.ashlar.planning import AshlarSettings
>>> from cyclopean.design.ashlar.stock import Slab
>>> slabs = [Slab(f"s{k}", [0.3, 0.2, 0.15]) for k in range(30)]
>>> made = ashlar(AshlarSettings(1.5, 1.0, 0.2, bond="stack"), slabs)
>>> len(made.laid), made.readout.courses, round(made.readout.coverage, 12), len(made.assembly.contacts)
(30, 6, 0.9, 54)
>>> made = ashlar(AshlarSettings(1.5, 1.0, 0.2), slabs)
>>> len(made.laid), made.readout.cut, len(made.assembly.contacts), made.readout.leftover
(33, 6, 82, 0)
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block, detect
from cyclopean.design.ashlar.courses import lay
from cyclopean.design.ashlar.planning import AshlarSettings, Gap, LaidStone, Rule, first_fit, planned
from cyclopean.design.ashlar.stock import SAME, Slab, Stock, stock_of
from cyclopean.design.walls.interlock import interlock_of
from cyclopean.geometry import Subdivision
from cyclopean.geometry.line_net import outlined_cells

__all__ = ["AshlarWall", "Readout", "ashlar", "built", "face_of", "open_stones"]


@dataclass(frozen=True, slots=True)
class Readout:
    """What a mason asks of a wall; lengths in m, volumes in m3."""

    courses: int
    blocks: int
    cut: int  # blocks that are a part of a slab
    cuts: int
    turned: int
    through: int  # stones that reach through a wall of two leaves, lintels included
    coverage: float  # of the front face less its openings
    leftover: int  # slabs that were not touched
    offcuts: int  # in store at the end
    stock: float
    placed: float
    left: float  # volume of leftovers
    off: float  # volume of offcuts in store
    lost: float
    score: float  # J of the front face
    aligned: int  # head joints in line with one of the course above or below, as J counts them
    least_lap: float  # least distance of head joints of consecutive courses; inf where there are none


@dataclass(frozen=True, slots=True, eq=False)
class AshlarWall:
    """A wall of sawn stones."""

    settings: AshlarSettings
    laid: tuple[LaidStone, ...]  # course by course, each from left to right, front before back
    stock: Stock  # what is left
    gaps: tuple[Gap, ...]
    notes: tuple[str, ...]
    readout: Readout
    assembly: Assembly  # ground, and one block for each stone in the same order; with contacts
    unit: float  # m: length of a stone with one joint


def ashlar(
    settings: AshlarSettings, slabs: Iterable[Slab], rule: Rule | None = None, *, found: bool = False
) -> AshlarWall:
    """Build a wall of sawn stones.

    Parameters
    ----------
    settings : AshlarSettings
    slabs : iterable of Slab
        The stock; the order does not count.
    rule : callable, optional
        Chooses the piece for each slot; `first_fit` where not given.
    found : bool
        Lay stones at the lengths they have, as long as they break the joints below, instead of to the bond.

    Returns
    -------
    AshlarWall

    Raises
    ------
    InputError
        No slab has the height or depth for a course, none is long enough for a lintel, or the wall has too many stones.
    """
    store = stock_of(slabs, settings.kerf, settings.least)
    plan = planned(settings, store, first_fit if rule is None else rule, found)
    laid, left, gaps, notes = lay(plan, store)
    return built(settings, laid, left, gaps, (*settings.without_effect(), *notes), plan.unit)


def built(
    settings: AshlarSettings,
    laid: Iterable[LaidStone],
    left: Stock,
    gaps: Iterable[Gap] = (),
    notes: Iterable[str] = (),
    unit: float = 0.0,
) -> AshlarWall:
    """Make a wall of stones that were laid in any order; `unit` is the length of a stone with one joint (m)."""
    stones = tuple(sorted(laid, key=lambda s: (s.slot.course, s.slot.low[0], s.slot.low[1])))
    last = [s for s in stones if s.slot.course == stones[-1].slot.course]  # has no bed joint on top
    top = (replace(s, cell_high=np.append(s.cell_high[:2], s.slot.high[2])) for s in last)
    stones = (*stones[: len(stones) - len(last)], *top)
    assembly = _assembly(settings, stones, left.slabs)
    readout = _readout(settings, stones, left, unit)
    return AshlarWall(settings, stones, left, tuple(gaps), tuple(notes), readout, assembly, unit)


# What came out


_FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def _box(name: str, low: Floats, high: Floats, density: float | None, fixed: bool, group: str) -> Block:
    """A cuboid; its corners are counted in binary, x first."""
    corner = np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)], bool)
    return Block(name, np.where(corner, high, low), _FACES, density, fixed, group)


def _names(laid: Sequence[LaidStone]) -> list[str]:
    """c01-b01 ...: course, and place in it."""
    most = Counter(s.slot.course for s in laid)
    digits = max(2, *(len(str(n)) for n in most.values()), len(str(len(most)))) if most else 2
    seen: Counter[int] = Counter()
    names = []
    for stone in laid:
        course = stone.slot.course
        seen[course] += 1
        names.append(f"c{course + 1:0{digits}d}-b{seen[course]:0{digits}d}")
    return names


def _assembly(settings: AshlarSettings, laid: Sequence[LaidStone], slabs: Sequence[Slab]) -> Assembly:
    margin = settings.depth / 2.0
    far = np.array([settings.length + margin, settings.depth + margin, 0.0])
    blocks = [_box("ground", np.array([-margin, -margin, -margin]), far, None, True, "ground")]
    for name, stone in zip(_names(laid), laid, strict=True):
        own = slabs[stone.sawn.slab].density
        density = settings.density if own is None else own
        blocks.append(_box(name, stone.cell_low, stone.cell_high, density, False, f"course-{stone.slot.course + 1}"))
    bare = Assembly(tuple(blocks), name=f"ashlar, {settings.bond} bond")
    found = detect(bare).contacts
    return replace(bare, contacts=found if settings.mu is None else found.with_mu(settings.mu))


def open_stones(wall: AshlarWall) -> tuple[Block, ...]:
    """Ground and stones as they are sawn, with open joints where these have a width."""
    ground, *solid = wall.assembly.blocks
    stones = (
        _box(b.id, np.array(s.slot.low), np.array(s.slot.high), b.density, False, b.group or "")
        for b, s in zip(solid, wall.laid, strict=True)
    )
    return (ground, *stones)


def face_of(laid: Sequence[LaidStone]) -> Subdivision:
    """The front face as cells that share their corners."""
    import shapely

    ends = [(*s.cell_low[[0, 2]], *s.cell_high[[0, 2]]) for s in laid if s.slot.leaf <= 0]
    face = shapely.box(*np.array(ends).T)
    found = outlined_cells([shapely.get_coordinates(one) for one in face], face, SAME, once=True)
    assert found is not None, "stones that are laid do not overlap"
    return found


def _least_lap(laid: Sequence[LaidStone]) -> float:
    """Least distance (m) of head joints of consecutive courses in the front face."""
    joints: dict[int, Floats] = {}
    for course in {s.slot.course for s in laid}:
        row = [s for s in laid if s.slot.course == course and s.slot.leaf <= 0]
        joints[course] = np.intersect1d([s.cell_low[0] for s in row], [s.cell_high[0] for s in row])
    gaps = [np.abs(x[:, None] - joints[k + 1]).min(initial=np.inf) for k, x in joints.items() if k + 1 in joints]
    return float(min(gaps, default=np.inf))


def _readout(settings: AshlarSettings, laid: Sequence[LaidStone], left: Stock, unit: float) -> Readout:
    face = sum(float(np.prod((s.cell_high - s.cell_low)[[0, 2]])) for s in laid if s.slot.leaf <= 0)
    wanted = settings.length * settings.height - sum(one.width * one.height for one in settings.openings)
    whole = left.whole()
    volume = np.prod(left.high - left.low, axis=1)
    lines = np.unique([z for s in laid for z in (s.cell_low[2], s.cell_high[2])])
    # joints nearer to each other than a tenth of a stone are aligned
    found = interlock_of(face_of(laid), lines, tolerance=0.1 * unit) if laid else None
    return Readout(
        courses=len({s.slot.course for s in laid}),
        blocks=len(laid),
        cut=sum(s.sawn.cuts > 0 or s.sawn.offcut for s in laid),
        cuts=sum(s.sawn.cuts for s in laid),
        turned=sum(s.turned for s in laid),
        through=sum(s.slot.leaf == -1 for s in laid),
        coverage=face / wanted,
        leftover=int(whole.sum()),
        offcuts=int((~whole).sum()),
        stock=sum(s.volume for s in left.slabs),
        placed=sum(float(np.prod(s.sawn.high - s.sawn.low)) for s in laid),
        left=float(volume[whole].sum()),
        off=float(volume[~whole].sum()),
        lost=left.lost,
        score=1.0 if found is None else found.score,
        aligned=0 if found is None else len(np.unique(found.aligned)),
        least_lap=_least_lap(laid),
    )
