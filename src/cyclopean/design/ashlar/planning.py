"""What is to be built of sawn stones, and what a stock allows: heights of courses, the length of a stone, lintels."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.design.ashlar.bonds import TWO_LEAVES, Bond, Kind, lap_of
from cyclopean.design.ashlar.stock import LEAST, SAME, Sawn, Stock
from cyclopean.design.options import finite, positive
from cyclopean.design.walls.openings import SHARE, Opening
from cyclopean.errors import InputError
from cyclopean.options import Option, check_options, option

__all__ = [
    "BEARING",
    "AshlarSettings",
    "Gap",
    "LaidStone",
    "Plan",
    "Rule",
    "Slot",
    "bearing_of",
    "candidates",
    "first_fit",
    "planned",
]

MOST = 50_000  # slots of a wall
BEARING = 0.5  # of what a lintel shall bear, it must at least

LENGTH: dict[str, Any] = {"kind": "number", "metavar": "L", "least": 0.0, "unit": "m"}
SIZE: dict[str, Any] = {"kind": "number", "metavar": "L", "above": 0.0, "unit": "m"}

Rule = Callable[[Floats, Bools, Floats], tuple[int, bool] | None]
"""Chooses a piece: sizes (p, 2, 3) of every piece as it lies and turned by 90 degrees, which of these can be sawn to
the slot, (p, 2), and length, depth and height of the slot (m); returns the piece and whether it is turned."""


def _required(help: str, word: str = "") -> Any:
    """A length that has to be given."""
    return field(metadata={"option": Option(help, word=word, required=True, **SIZE)})


@dataclass(frozen=True, slots=True)
class AshlarSettings:
    """What is to be built; lengths in m, to a nanometre. Heights of courses: all `course`, or of as many `bins`."""

    length: float = _required("Length of the wall (m).", word="width")
    height: float = _required("Of the wall (m).")
    depth: float = _required("Thickness of the wall (m).")
    bond: str = option("running", "Where the head joints lie.", choices=get_args(Bond))
    course: float | None = None  # height of every course; None = that of most slabs
    bins: bool = False  # courses of as many heights as the stock has, the tallest below
    tolerance: float = option(
        0.002, "Heights (m) that differ by less are dressed to one course.", word="height_tolerance", **LENGTH
    )
    unit: float | None = option(None, "Length of a stone (m) [that of most].", word="stone_length", **SIZE)
    leaves: int | None = option(None, "Leaves of the wall, with a joint between [as the bond has it].", "whole",
                                metavar="1|2", least=1, most=2)  # fmt: skip
    through: int = option(0, "A stone through both leaves at every N-th stretcher; 0 none.", "whole", metavar="N",
                          least=0)  # fmt: skip
    stagger: float = option(
        0.5, "running: share of a stone with which odd courses begin.", "number", metavar="S", least=0.0, most=0.9
    )
    bed: float = option(0.0, "Thickness of bed joints (m).", **LENGTH)
    head: float = option(0.0, "Width of head joints (m).", **LENGTH)
    openings: tuple[Opening, ...] = ()
    yaw: bool = option(True, "Stones may be turned by 90 degrees.", "flag")
    kerf: float = option(0.0, "Width that a cut takes (m).", **LENGTH)
    least: float = option(LEAST, "Shortest stone (m); what is shorter is chips.", **SIZE)
    density: float | None = option(
        None, "kg/m3 where a stone does not say it.", "number", metavar="D", above=0.0, unit="kg/m3"
    )
    mu: float | None = option(None, "Friction coefficient of every contact.", "number", metavar="M", least=0.0)

    def without_effect(self) -> tuple[str, ...]:
        """A line on an option that was given and that the bond has not."""
        if self.stagger == 0.5 or self.bond == "running":
            return ()
        return (f"`stagger`: no effect, for {self.bond} bond has its own; only `bond` running takes it",)

    def __post_init__(self) -> None:
        for name in ("length", "height", "depth", "course", "tolerance", "unit", "bed", "head", "kerf", "least"):
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, round(finite(name, value), 9))
        check_options(self)
        if self.course is not None:
            positive("course", self.course)
        if self.leaves == 1 and self.bond in TWO_LEAVES:
            raise InputError(f"`leaves`: {self.bond} bond has headers through two leaves; leave it out")
        if self.through and self.leaf_count == 1:
            raise InputError("`through`: a wall of one leaf has nothing to tie; take two leaves")
        if self.bins and self.course is not None:
            raise InputError("`course`: either one height for all courses, or bins by height")
        if not self.leaf > 0.0:
            raise InputError(f"`head`: a joint of {self.head:g} m leaves no stone in a depth of {self.depth:g} m")
        object.__setattr__(self, "openings", tuple(self.openings))
        _refuse_openings(self)

    @property
    def leaf_count(self) -> int:
        """1 or 2."""
        return (2 if self.bond in TWO_LEAVES else 1) if self.leaves is None else self.leaves

    @property
    def leaf(self) -> float:
        """Depth of a stone that does not reach through the wall (m)."""
        return self.depth if self.leaf_count == 1 else round((self.depth - self.head) / 2.0, 9)


def _refuse_openings(settings: AshlarSettings) -> None:
    for k, one in enumerate(settings.openings, 1):
        if one.head != "lintel":
            raise InputError(f"`openings`: number {k} has an arch; courses of ashlar take a lintel")
        if not (one.left > 0.0 and one.left + one.width < settings.length and one.top < settings.height):
            raise InputError(
                f"`openings`: number {k} reaches outside the wall of {settings.length:g} x {settings.height:g} m;"
                " leave stone at both sides and above"
            )


@dataclass(frozen=True, slots=True)
class Slot:
    """Room for one stone, as the stone fills it (m, world)."""

    course: int
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    kind: Kind
    leaf: int  # 0 = front, 1 = back, -1 = through the wall

    @property
    def size(self) -> Floats:
        """(3,) m: length, depth, height."""
        return np.asarray((np.array(self.high) - np.array(self.low)).round(9))


@dataclass(frozen=True, slots=True, eq=False)
class LaidStone:
    """A stone, where it lies, and what it was sawn from."""

    slot: Slot
    cell_low: Floats  # (3,) m: with its share of the joints, which is what is checked
    cell_high: Floats
    sawn: Sawn
    turned: bool  # by 90 degrees about the vertical: its slab's length runs into the wall


@dataclass(frozen=True, slots=True)
class Gap:
    """A part of a course for which there was no stone."""

    course: int
    low: float  # m
    high: float
    leaf: int  # as in Slot


@dataclass(frozen=True, slots=True)
class Plan:
    """What is the same for all courses."""

    settings: AshlarSettings
    rule: Rule
    found: bool  # lay stones at the lengths they have
    unit: float  # m, with one joint
    lap: float
    bands: tuple[tuple[float, float], ...]  # height of a course, and of the tallest stone dressed to it; tallest first
    held: dict[int, tuple[int, ...]]  # slabs set aside for the lintel of an opening
    wide: bool  # whether a slab reaches through the wall and is as long as a stretcher

    @property
    def header(self) -> float:
        """Width of a header on the face, with one joint (m)."""
        return self.settings.leaf + self.settings.head

    @property
    def least(self) -> float:
        """Shortest stone, with one joint (m)."""
        return self.settings.least + self.settings.head


def first_fit(sizes: Floats, fits: Bools, slot: Floats) -> tuple[int, bool] | None:
    """Choose the first piece (sizes in m) that can be sawn to the slot; pieces come by volume, so it is the smallest.

    It lies the way that takes fewer cuts.
    """
    if not fits.any():
        return None
    piece = int(np.argmax(fits.any(axis=1)))
    cuts = (sizes[piece, :, :2] > slot[:2] + SAME).sum(axis=1) + np.where(fits[piece], 0, 9)
    return piece, bool(cuts[1] < cuts[0])


def candidates(stock: Stock, slot: Floats, band: tuple[float, float], yaw: bool) -> tuple[Floats, Bools]:
    """Sizes (p, 2, 3) of all pieces, as they lie and turned, and which of these can be sawn to a slot (m).

    A piece that has just the depth of the slot is not turned to be ripped.
    """
    lying = stock.sizes()
    sizes = np.stack([lying, lying[:, [1, 0, 2]]], 1)
    high = (sizes[..., 2] >= band[0] - SAME) & (sizes[..., 2] <= band[1] + SAME)
    spare = sizes[..., 1] - slot[1]
    fits: Bools = high & (sizes[..., 0] >= slot[0] - SAME) & (spare >= -SAME)
    just = np.abs(spare) <= SAME
    fits[:, 1] &= yaw & (just[:, 1] | ~just[:, 0])
    return sizes, fits


# What can be built at all


def planned(settings: AshlarSettings, stock: Stock, rule: Rule, found: bool) -> Plan:
    """Find out what the stock allows: heights of courses, the length of a stone, lintels.

    Raises
    ------
    InputError
        No slab has the height or depth for a course, none is long enough for a lintel, or the wall has too many stones.
    """
    size = np.array([s.size for s in stock.slabs])
    side = size[:, :2].max(axis=1) if settings.yaw else size[:, 1]
    bands = _bands(settings, size, side)
    high = np.logical_or.reduce([(size[:, 2] >= a - SAME) & (size[:, 2] <= b + SAME) for a, b in bands])
    if (settings.bond in TWO_LEAVES or settings.through) and not (side[high] >= settings.depth - SAME).any():
        raise InputError(
            f"`depth`: {'headers' if settings.bond in TWO_LEAVES else 'through-stones'} reach through the wall, and no"
            f" slab of the right height reaches through {settings.depth:g} m; the longest side is"
            f" {side[high].max():g} m"
        )
    usual = high & (size[:, :2].max(axis=1) >= settings.leaf - SAME)
    unit = _most(size[usual, 0]) if settings.unit is None else settings.unit
    if settings.length / unit * settings.height / bands[-1][0] * settings.leaf_count > MOST:
        raise InputError(f"ashlar: more than {MOST:,} stones; take larger ones or a smaller wall")
    held = _lintels_held(settings, stock, bands)
    tie = np.array([unit, settings.depth, bands[0][0]])
    wide = any(candidates(stock, tie, band, settings.yaw)[1].any() for band in bands)
    lap = lap_of(settings.bond, unit + settings.head, settings.stagger)
    if settings.through in (1, 2) and not wide:
        raise InputError(
            f"`through`: no slab of {unit:g} x {settings.depth:g} m, and shorter through-stones would stand joint over"
            f" joint at every {settings.through}; give 3 or more"
        )
    return Plan(settings, rule, found, unit + settings.head, lap, bands, held, wide)


def _bands(settings: AshlarSettings, size: Floats, side: Floats) -> tuple[tuple[float, float], ...]:
    """Heights of courses, and of the tallest stones in them."""
    deep = side >= settings.leaf - SAME
    if not deep.any():
        raise InputError(f"`depth`: no slab is {settings.leaf:g} m deep; the deepest is {side.max():g} m")
    heights = np.sort(size[deep, 2])[::-1]
    if settings.bins:
        bands: list[tuple[float, float]] = []
        for height in heights.tolist():
            if bands and bands[-1][1] - height <= settings.tolerance + SAME:
                bands[-1] = (height, bands[-1][1])
            else:
                bands.append((height, height))
        bands = [band for band in bands if band[0] <= settings.height + SAME]
    else:
        wanted = _most(heights) if settings.course is None else settings.course
        near = heights[np.abs(heights - wanted) <= settings.tolerance + SAME]
        if not len(near):
            raise InputError(
                f"`course`: no slab is {wanted:g} m high within {settings.tolerance:g} m; they are"
                f" {heights[-1]:g} to {heights[0]:g} m high"
            )
        bands = [(float(near[-1]), float(near[0]))]
    if not bands or bands[-1][0] > settings.height + SAME:
        raise InputError(
            f"`height`: no slab fits into a wall {settings.height:g} m high; the lowest is {heights[-1]:g} m"
        )
    return tuple(bands)


def _most(values: Floats) -> float:
    """The most frequent of some lengths; of several the largest."""
    counted = Counter(values.round(6).tolist())
    return float(max(counted, key=lambda value: (counted[value], value)))


def _lintels_held(
    settings: AshlarSettings, stock: Stock, bands: Sequence[tuple[float, float]]
) -> dict[int, tuple[int, ...]]:
    """Set aside the smallest slabs that can be lintels, in every height."""
    held: dict[int, tuple[int, ...]] = {}
    taken: set[int] = set()
    for k, one in enumerate(settings.openings):
        of: list[int] = []
        for band in bands:
            for depth, wanted in ((settings.depth, 1), (settings.leaf, settings.leaf_count)):
                free = [i for i in _long_enough(settings, stock, one, depth, band) if i not in taken]
                if len(free) >= wanted:
                    of += free[:wanted]
                    break
        if not of:
            least = one.width + 2.0 * BEARING * bearing_of(one)
            longest = max(float(s.size[:2].max() if settings.yaw else s.size[0]) for s in stock.slabs)
            raise InputError(
                f"`openings`: number {k + 1} is {one.width:g} m wide and takes a lintel of at least {least:g} m;"
                f" the longest slab is {longest:g} m, or is set aside for another opening"
            )
        taken |= set(of)
        held[k] = tuple(of)
    return held


def bearing_of(opening: Opening) -> float:
    """How far (m) a lintel shall bear on each side."""
    return SHARE * opening.width if opening.bearing is None else opening.bearing


def _long_enough(
    settings: AshlarSettings, stock: Stock, opening: Opening, depth: float, band: tuple[float, float]
) -> list[int]:
    """Slabs of a height that can be lintels, those with the full bearing first."""
    found: list[int] = []
    for share in (1.0, BEARING):
        slot = np.array([opening.width + 2.0 * share * bearing_of(opening), depth, band[0]])
        fits = candidates(stock, slot, band, settings.yaw)[1].any(axis=1)
        found += [i for i in stock.slab[fits].tolist() if i not in found]
    return found
