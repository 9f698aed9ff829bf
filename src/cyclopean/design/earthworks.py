"""Models with earth: a dry-stone wall that retains it, and an arch bridge under fill.

The retaining wall has straight sides in its cross-section, y = b z in front and y = w - c z at the back, and beds that
fall towards the earth, z = h - t y. Where a bed meets a side both y and z are linear in h, so that points at a share of
the way from front to back lie on a straight line too: all faces are flat.

>>> model = retaining(5, 4)
>>> sum(block.fixed is True for block in model.blocks), len(model.actions)
(1, 1)
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any, get_args

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Block, Earth, Fill, detect
from cyclopean.assembly.field_loads import EarthState
from cyclopean.design.options import at_least, not_negative
from cyclopean.design.templates import arch, brick_faces, numbered
from cyclopean.errors import InputError
from cyclopean.options import check_options, option
from cyclopean.texts import number

__all__ = ["BridgeShape", "DryStone", "Soil", "bridge", "retaining"]

TOE = 0.3  # m by which a foundation stands out on either side of its wall
STEEP = 30.0  # degrees of the extrados up to which a block of a spandrel wall lies on it: less than friction has


@dataclass(frozen=True, slots=True)
class DryStone:
    """The shape of a retaining wall of dry stone (m, degrees)."""

    length: float = option(0.5, "Of a stone (m).", "number", metavar="L", above=0.0)
    height: float = option(0.3, "Of a course (m).", "number", metavar="L", above=0.0)
    base: float = option(0.9, "Thickness of the wall at its foot (m).", "number", metavar="L", above=0.0)
    batter: float = option(0.15, "Lean of the face into the wall, a metre of height.", "number", metavar="B", least=0.0)
    back: float = option(0.0, "Lean of the back into the wall, likewise.", "number", metavar="B", least=0.0)
    inward: float = option(8.0, "Fall of the beds towards the earth.", "number", metavar="DEG", least=0.0, most=44.0)
    through: int = option(3, "Every so manieth stone goes through; 0 = none.", "whole", metavar="N", least=0)
    foundation: float = option(0.4, "Depth of the fixed block below (m).", "number", metavar="L", above=0.0)

    def __post_init__(self) -> None:
        check_options(self)


@dataclass(frozen=True, slots=True)
class Soil:
    """The earth behind a wall that is made, as `Earth` has it."""

    state: str = option("active", "Of the earth.", choices=get_args(EarthState))
    unit_weight: float = option(18_000.0, "Of the earth, N/m3.", "number", metavar="N", above=0.0, unit="N/m3")
    friction: float = option(35.0, "Of the earth.", "number", metavar="DEG", above=0.0)
    wall_friction: float = option(0.0, "Of wall and earth.", "number", metavar="DEG", least=0.0)
    slope: float = option(0.0, "By which the ground rises away from the wall.", "number", metavar="DEG")
    surcharge: float = option(0.0, "On the ground, Pa.", "number", metavar="PA", least=0.0, unit="Pa")

    def __post_init__(self) -> None:
        check_options(self)


def retaining(
    stones: int,
    courses: int,
    shape: DryStone = DryStone(),
    soil: Soil = Soil(),
    *,
    density: float | None = None,
    mu: float | None = None,
) -> Assembly:
    """Lay a dry-stone wall of two leaves along x, its face towards -y, the earth behind it at +y (azimuth 90).

    Parameters
    ----------
    stones : int
        Whole stones in a course; odd courses are shifted by half a stone.
    courses : int
        Courses on the foundation.
    shape : DryStone
        Sizes and angles.
    soil : Soil
        What it retains, up to the top of its back (case earth).
    density, mu : float, optional
        kg/m3 of every block, and friction coefficient of every contact; None = not said.

    Returns
    -------
    Assembly
        `foundation`, and stones `c03-b02-front`, `c03-b02-back` or `c03-b02-through`.

    Raises
    ------
    InputError
        An option that cannot be built, or leaves no thickness at the top.
    """
    for name, count in (("stones", stones), ("courses", courses)):
        at_least(name, count, 1)
    length, fall = shape.length, float(np.tan(np.radians(shape.inward)))
    section = _section(shape.height * np.arange(courses + 1.0), shape, fall)
    if not (shape.back * fall < 1.0 and section[-1, 1, 0] - section[-1, 0, 0] > 0.1 * shape.base):
        raise InputError(
            f"batter: {shape.batter:g} and back {shape.back:g} leave no thickness at the top; make the base wider"
        )
    blocks = [_foundation(section[0], shape.foundation, stones * length, fall, density)]
    for k, name in enumerate(numbered("c", courses)):
        shift = length / 2.0 * (k % 2)
        edges = np.unique(np.clip(np.arange(stones + 1 + k % 2) * length - shift, 0.0, stones * length))
        for i, x in enumerate(pairwise(edges.tolist()), 1):
            goes = shape.through and (i + k * (shape.through // 2 + 1)) % shape.through == 0
            for leaf, part in (("through", (0.0, 1.0)),) if goes else (("front", (0.0, 0.5)), ("back", (0.5, 1.0))):
                blocks.append(_stone(f"{name}-b{i:02d}-{leaf}", section[k : k + 2], x, part, density))
    earth = Earth(side=90.0, height=float(section[-1, 1, 1]), case="earth", **asdict(soil))
    return _joined(blocks, f"retaining wall of {stones} x {courses}", mu, (earth,))


def _section(level: Floats, shape: DryStone, fall: float) -> Floats:
    """(k, 2, 2) y and z where beds meet the front and the back."""
    ahead = shape.batter * level / (1.0 + shape.batter * fall)
    behind = (shape.base - shape.back * level) / (1.0 - shape.back * fall)
    return np.stack([np.stack([y, level - fall * y], 1) for y in (ahead, behind)], 1)


def _stone(name: str, bed: Floats, x: tuple[float, float], part: tuple[float, float], density: float | None) -> Block:
    """A stone between two beds (2, 2, 2), two x and two shares of the way from front to back."""
    corner = [[u, *((1.0 - w) * bed[v, 0] + w * bed[v, 1])] for v in (0, 1) for u in x for w in part]
    return Block(name, np.array(corner), brick_faces(1, 1, True), density, False, name.partition("-")[0])


def _foundation(bed: Floats, depth: float, length: float, fall: float, density: float | None) -> Block:
    """The fixed block below the lowest bed, which goes on as far as the block does."""
    y = np.array([bed[0, 0] - TOE, bed[1, 0] + TOE])
    top = bed[0, 1] - fall * (y - bed[0, 0])
    foot = np.stack([y, np.full(2, top.min() - depth)], 1)
    whole = np.stack([foot, np.stack([y, top], 1)])
    made = _stone("foundation", whole, (-TOE, length + TOE), (0.0, 1.0), density)
    return Block(made.id, made.vertices, made.faces, density, True, "foundation")


def _joined(blocks: list[Block], name: str, mu: float | None, earth: tuple[Earth | Fill, ...]) -> Assembly:
    """The model with its contacts."""
    found = detect(Assembly(tuple(blocks))).contacts
    side = np.array([str(block.group).startswith("spandrel") for block in blocks])
    found = found.only(np.flatnonzero(~(side[found.a] & side[found.b])))
    joints = found if mu is None else found.with_mu(not_negative("mu", mu))
    return Assembly(tuple(blocks), joints, name=name, actions=earth)


@dataclass(frozen=True, slots=True)
class BridgeShape:
    """The shape of an arch bridge (m), and its fill."""

    span: float = option(6.0, "Clear span (m).", "number", metavar="L", above=0.0)
    rise: float = option(2.0, "Of the inner crown (m).", "number", metavar="L", above=0.0)
    thickness: float = option(0.5, "Of the arch (m).", "number", metavar="L", above=0.0)
    width: float = option(4.0, "Of the bridge, along y (m).", "number", metavar="L", above=0.0)
    cover: float = option(0.4, "Fill over the crown (m).", "number", metavar="L", above=0.0)
    spandrel: float = option(0.7, "Thickness of each spandrel wall (m).", "number", metavar="L", above=0.0)
    unit_weight: float = option(18_000.0, "Of the fill, N/m3.", "number", metavar="N", above=0.0, unit="N/m3")
    level: float = option(0.0, "Level pressure of the fill on the arch, in shares of the upright one.", "number",
                          metavar="K", least=0.0)  # fmt: skip
    spread: str = option("30", "Of a load on the road: degrees from the upright.", metavar="DEG|boussinesq")

    def __post_init__(self) -> None:
        check_options(self)


def bridge(
    voussoirs: int, shape: BridgeShape = BridgeShape(), *, density: float | None = None, mu: float | None = None
) -> Assembly:
    """Turn a circular arch with a level road on fill between two spandrel walls.

    One block of each wall stands on every voussoir that is not too steep for it; further down fill lies on the whole
    width. Blocks side by side in a wall have no contact: a wall that jams between its ends would hold the arch up.

    Parameters
    ----------
    voussoirs : int
        Number of voussoirs.
    shape : BridgeShape
        Sizes, and the fill.
    density, mu : float, optional
        kg/m3 of every block, and friction coefficient of every contact; None = not said.

    Returns
    -------
    Assembly
        The blocks of `arch`, `spandrel-front-03`, `spandrel-back-03` on voussoir 3; fill on the barrel (case fill),
        earth at rest of 35 degrees at the spandrels (case earth).

    Raises
    ------
    InputError
        An option that cannot be built.
    """
    width, spandrel, weight = shape.width, shape.spandrel, shape.unit_weight
    if not 2.0 * spandrel < width:
        raise InputError(f"spandrel: two walls of {spandrel:g} m leave no road on a width of {width:g} m")
    spread: Any = shape.spread if shape.spread == "boussinesq" else number("`spread`", shape.spread)
    barrel = arch(voussoirs, span=shape.span, rise=shape.rise, thickness=shape.thickness, depth=width, density=density)
    road = shape.rise + shape.thickness + shape.cover
    leaves = {"front": (0.0, spandrel), "back": (width - spandrel, width)}
    blocks = [*barrel.blocks, *(block for name, y in leaves.items() for block in _columns(barrel, name, y, road))]
    fill = Fill(height=road, unit_weight=weight, level=shape.level, spread=spread, group="arch", case="fill")
    press: dict[str, Any] = {"state": "rest", "friction": 35.0, "unit_weight": weight, "height": road, "case": "earth"}
    sides = [Earth(side=side, group=f"spandrel-{name}", **press) for name, side in (("front", 90.0), ("back", 270.0))]
    return _joined(blocks, f"bridge of {voussoirs}", mu, (fill, *sides))


def _columns(barrel: Assembly, leaf: str, y: tuple[float, float], road: float) -> Iterator[Block]:
    """The blocks of one spandrel wall: upright prisms from the extrados to the road."""
    for k, block in enumerate(barrel.blocks):
        outer = block.vertices[block.vertices[:, 1] == 0.0].reshape(2, 2, 3)[:, 1]  # the extrados, from -x to +x
        (x0, _, z0), (x1, _, z1) = outer
        if block.fixed or abs(z1 - z0) > np.tan(np.radians(STEEP)) * (x1 - x0):
            continue
        ends = [[u, w, z] for v in (0, 1) for u, z in ((x0, z0), (x1, z1)) for w in y]
        corner = np.array([[u, w, z if i < 4 else road] for i, (u, w, z) in enumerate(ends)])
        name = f"spandrel-{leaf}"
        yield Block(f"{name}-{k:02d}", corner, brick_faces(1, 1, True), block.density, False, name)
