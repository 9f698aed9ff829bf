"""Walls that were tested, or computed by others, beside what this program says of them: writes docs/experiments.md.

Run `python bench/experiments.py [--quick]`. Geometry is built here from the dimensions that the sources state, measured
and published figures are copied into small tables with their source, and every figure of ours is computed anew with
both bounds. `--quick` prints the two smallest tables and writes nothing.

The one structure that no short rule describes (the portal of LACT3) is read from a drawing in the folder that
CYCLOPEAN_EXPERIMENTS names, and left out with a word on it where there is none. Nothing is tuned: the friction of each
row is the one its source gives, and rows that miss stay in.
"""

import argparse
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from statistics import mean, stdev

import numpy as np

import cyclopean
from cyclopean.analysis import LimitResult
from cyclopean.assembly import Assembly, Block, Load

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "experiments.md"
PREDICTIONS = ROOT / "docs" / "predictions.md"
FOLDER = Path(os.environ.get("CYCLOPEAN_EXPERIMENTS", ROOT.parent / "shared" / "validation"))
STANDARD_GRAVITY = 9.80665  # m/s2
KILO = 1000.0
Span = tuple[float, float]


# Geometry


def prism(name: str, outline: np.ndarray, depth: float, **given: object) -> Block:
    """An outline in x and z, counter-clockwise as seen from -y, as thick as `depth`."""
    n = len(outline)
    front = np.column_stack([outline[:, 0], np.zeros(n), outline[:, 1]])
    sides = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
    faces = (tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *[side[::-1] for side in sides])
    return Block(name, np.vstack([front, front + np.array([0.0, depth, 0.0])]), faces, **given)  # type: ignore[arg-type]


def box(name: str, x: Span, z: Span, depth: float, **given: object) -> Block:
    """An upright box with a face in y = 0."""
    return prism(name, np.array([[x[0], z[0]], [x[1], z[0]], [x[1], z[1]], [x[0], z[1]]]), depth, **given)


def without(spans: Sequence[Span], hole: Span) -> list[Span]:
    """The parts of spans outside a hole."""
    parts = [part for a, b in spans for part in ((a, min(b, hole[0])), (max(a, hole[1]), b))]
    return [(a, b) for a, b in parts if b - a > 1e-9]


@dataclass(frozen=True)
class Bond:
    """A wall of sawn blocks, one leaf thick, every other course of which begins with half a block (lengths in m)."""

    length: float
    unit: Span  # length and height of a block
    courses: int
    depth: float
    half_first: bool = True
    holes: tuple[tuple[Span, range], ...] = ()  # x, and the courses that are open there
    lintels: tuple[tuple[Span, int], ...] = ()  # x and the course of one long block

    def course(self, k: int) -> list[Span]:
        """x of the blocks of course k."""
        long = self.unit[0]
        first = long / 2 if (k % 2 == 0) == self.half_first else long
        joints = [0.0, *np.arange(first, self.length - 1e-9, long).tolist(), self.length]
        spans: list[Span] = list(pairwise(joints))
        for hole, rows in self.holes:
            spans = without(spans, hole) if k in rows else spans
        for lintel, row in self.lintels:
            spans = [*without(spans, lintel), lintel] if k == row else spans
        return sorted(spans)

    def model(self, name: str, density: float | None = None, top: float = 0.0) -> Assembly:
        """The wall on fixed ground; with a stiff block `top` high over all of it where that is not 0."""
        high = self.unit[1]
        blocks = [box("ground", (-1.0, self.length + 1.0), (-high, 0.0), self.depth, fixed=True)]
        for k in range(self.courses):
            blocks += [
                box(f"c{k + 1}-{i + 1}", x, (k * high, (k + 1) * high), self.depth, density=density)
                for i, x in enumerate(self.course(k))
            ]
        if top:
            rise = self.courses * high
            blocks.append(box("top", (0.0, self.length), (rise, rise + top), self.depth, density=density))
        return Assembly(tuple(blocks), name=name)


def tested(series: "Series", total: float) -> Assembly:
    """A wall of one of the two campaigns, its stiff block bearing what is left of the vertical force (kN)."""
    bond, top = series.bond, 2.0 * (series.span - series.bond.courses * series.bond.unit[1])
    density = series.weight * KILO / STANDARD_GRAVITY
    model = bond.model(series.name, density, top)
    own = series.weight * bond.length * bond.depth * (bond.courses * bond.unit[1] + top)  # kN
    last = len(model) - 1
    down = Load(last, np.array([0.0, 0.0, -(total - own) * KILO]), model.mass.centroid[last])
    return replace(model, loads=(down,))


def barrel(weight: float = 2000.0, one_abutment: bool = False) -> Assembly:
    """compas_dem's barrel vault: span 7, rise 0.1 and thickness 0.25 m, 9 voussoirs, 13 rows on 3 m, every other half.

    `one_abutment` makes one long block of the supports on the left, to which a thrust may be given.
    """
    radius = (3.5**2 + 0.1**2) / (2 * 0.1)
    turns = np.arcsin(3.5 / radius) * np.linspace(1.0, -1.0, 10)
    row = 3.0 / 13
    blocks = []
    for v in range(9):
        whole = np.linspace(0.0, 3.0, 14)
        cuts = whole if v % 2 == 0 else np.array([0.0, *(whole[:-1] + row / 2), 3.0])
        cuts = np.array([0.0, 3.0]) if one_abutment and v == 8 else cuts
        ring = [(turns[v], -0.125), (turns[v], 0.125), (turns[v + 1], 0.125), (turns[v + 1], -0.125)]
        outline = np.array([[(radius + r) * np.sin(t), (radius + r) * np.cos(t) + 0.225 - radius] for t, r in ring])
        for i, (low, high) in enumerate(pairwise(cuts.tolist())):
            stone = prism(f"v{v + 1}-{i + 1}", outline, high - low, density=weight, fixed=v in (0, 8))
            blocks.append(replace(stone, vertices=stone.vertices + np.array([0.0, low, 0.0])))
    return Assembly(tuple(blocks), name="barrel vault")


def plane_drawing(path: Path) -> Assembly:
    """Closed polylines of a drawing in mm as prisms; the lowest is the support."""
    import ezdxf

    outlines = []
    for line in ezdxf.readfile(path).modelspace().query("LWPOLYLINE"):
        points = np.array([(x, y) for x, y, *_ in line.get_points()]) / KILO
        points = points[:-1] if np.allclose(points[0], points[-1], atol=1e-9) else points
        x, z = points.T
        turns = float(x @ np.roll(z, -1) - z @ np.roll(x, -1))
        outlines.append(points if turns > 0 else points[::-1])
    low = min(range(len(outlines)), key=lambda k: outlines[k][:, 1].mean())
    blocks = [prism(f"b{k}", outline, 0.2, fixed=k == low) for k, outline in enumerate(outlines)]
    return Assembly(tuple(blocks), name=path.stem)


# What was measured or published


@dataclass(frozen=True)
class Series:
    """A campaign of walls in shear and compression."""

    name: str
    stone: str
    bond: Bond
    span: float  # m, height of the horizontal force above the foot
    weight: float  # kN/m3, from the difference of the table's vertical force and its mean stress
    rows: tuple[tuple[str, float, float, float | None], ...]  # wall, kN at the foot, kN measured one way and the other

    @property
    def measured(self) -> list[tuple[str, float, float]]:
        """Wall, vertical force and horizontal force (kN), the mean of both ways where there are two."""
        return [(name, total, one if other is None else (one + other) / 2) for name, total, one, other in self.rows]


# Vanin, Zaganelli, Penna and Beyer 2017 (doi 10.1007/s10518-017-0188-5): rows 1 to 10, 80 to 86, 99 to 102 of its data
GRANITE = Series(
    "WS",
    "granite",
    Bond(1.0, (0.2, 0.15), 8, 0.2),
    1.325,
    20.0,
    (
        ("WS.40", 44.8, 16.3, None),
        ("WS.100", 104.8, 37.0, None),
        ("WS1.100", 104.8, 39.0, 43.3),
        ("WS2.100", 104.8, 37.8, 40.9),
        ("WS3.100", 104.8, 38.0, 42.1),
        ("WS4.100", 104.8, 36.0, 40.1),
        ("WS.175", 179.8, 63.2, None),
        ("WS1.175", 179.8, 61.8, 69.0),
        ("WS2.175", 179.8, 64.5, 71.3),
        ("WS3.175", 179.8, 64.3, 71.2),
        ("WS.250", 254.8, 85.9, None),
        ("WS1.250", 254.8, 88.7, 95.7),
        ("WS2.250", 254.8, 87.1, 94.7),
        ("WS3.250", 254.8, 86.5, 92.6),
    ),
)
SANDSTONE = Series(
    "SW",
    "sandstone",
    Bond(1.0, (0.2, 0.1), 9, 0.2),
    1.0,
    20.0,
    (
        ("SW.30.1", 33.6, 21.9, None),
        ("SW.30.2", 33.6, 22.9, None),
        ("SW.100.1", 103.6, 41.5, None),
        ("SW.100.2", 103.6, 48.2, None),
        ("SW.200.1", 203.6, 71.6, None),
        ("SW.200.2", 203.6, 68.6, None),
        ("SW.250.1", 253.6, 102.7, None),
    ),
)
DRY_JOINT = 0.62  # assumed: the data give none; what 0.55 and 0.75 change stands on the page
MIDDLE = ((0.6, 1.0), range(3, 8))
# Ferris and Tin-Loi 2001: blocks of 0.4 x 0.175 m, mu 0.65. Published, and by a linear programme.
FERRIS = {
    1: (Bond(2.0, (0.4, 0.175), 6, 0.4), "0.643", 0.64286),
    2: (Bond(2.0, (0.4, 0.175), 10, 0.4), "", 0.58000),
    3: (Bond(1.6, (0.4, 0.175), 11, 0.4, half_first=False, holes=(MIDDLE,)), "", 0.40369),
    4: (Bond(2.0, (0.4, 0.175), 11, 0.4, holes=(((0.4, 0.8), range(3, 8)), ((1.2, 1.6), range(3, 8)))), "", 0.33195),
}
OPEN_WALL = Bond(  # the wall of LACT3: a door, a window, and one lintel
    2.0,
    (0.25, 1.5 / 27),
    27,
    0.2,
    half_first=False,
    holes=(((0.25, 0.5), range(1, 25)), ((0.875, 1.375), range(2, 24))),
    lintels=(((0.75, 1.5), 24),),
)
# Discrete elements (LMGC90) of compas_dem's sample, summed from the contact forces in its file of results: N
DEM = {"weight": 80166.0, "left": 40095.8, "right": 40070.2, "thrust": 175965.5}


# What is ours


def pushed(model: Assembly, mu: float = 0.65) -> LimitResult:
    """Along x, in shares of weight."""
    return cyclopean.limit(model, push=(1.0, 0.0, 0.0), mu=mu)


def sheared(series: Series, total: float, mu: float = DRY_JOINT) -> LimitResult:
    """The horizontal force (kN) on the stiff block."""
    return cyclopean.limit(tested(series, total), loads=(("top", (KILO, 0.0, 0.0), None),), mu=mu)


def tilted(model: Assembly, azimuth: float, degrees: float) -> LimitResult:
    """On a table, with this angle of friction."""
    return cyclopean.limit(model, tilt=azimuth, mu=float(np.tan(np.deg2rad(degrees))))


def thrust(heading: float, mu: float = 0.5) -> LimitResult:
    """By how many kN the left abutment may push more (1) or less (-1) than the discrete elements say."""
    model = barrel(one_abutment=True)
    last = len(model) - 1
    loose = replace(model.blocks[last], fixed=False, held=("y", "z", "rx", "ry", "rz"))
    push = Load(last, np.array([DEM["thrust"], 0.0, 0.0]), model.mass.centroid[last])
    model = replace(model, blocks=(*model.blocks[:last], loose), loads=(push,))
    live = ((loose.id, (heading * KILO, 0.0, 0.0), None),)
    return cyclopean.limit(model, loads=live, mu=mu, gravity=(0.0, 0.0, -9.81))  # their gravity


# The page


def kind(found: LimitResult) -> str:
    """Of the certificate, which the exact checker has accepted before an answer is given."""
    return f"`{found.certificate['kind']}`" if found.certificate else "none"


def bounds(low: float | None, high: float | None, n: int) -> str:
    """Both, to n decimals, outwards: the lower rounded down and the upper up."""
    if low is None or high is None:
        return "not both proved"
    return f"{np.floor(low * 10**n) / 10**n:.{n}f} to {np.ceil(high * 10**n) / 10**n:.{n}f}"


def shear_rows(series: Series) -> Iterator[str]:
    """A row a wall, then what they say together."""
    limits = {total: sheared(series, total) for total in sorted({total for _, total, _ in series.measured})}
    ratios = []
    for (name, total, measured), row in zip(series.measured, series.rows, strict=True):
        found = limits[total]
        ratios.append(measured / found.value)
        ways = f"{row[2]:.1f}" if row[3] is None else f"{row[2]:.1f}, {row[3]:.1f}"
        ours = bounds(found.lower, found.upper, 3)
        yield f"| {name} | {total:.1f} | {ways} | {ours} | {kind(found)} | {ratios[-1]:.3f} |"
    yield (
        f"| **all {len(ratios)}** | | | | | **{mean(ratios):.3f}**, standard deviation {stdev(ratios):.3f},"
        f" {min(ratios):.3f} to {max(ratios):.3f} |"
    )


def friction_rows() -> Iterator[str]:
    """What friction changes, at the least and the largest vertical force of each campaign."""
    for series in (GRANITE, SANDSTONE):
        totals = [total for _, total, _ in series.measured]
        for total in (min(totals), max(totals)):
            cells = " | ".join(f"{sheared(series, total, mu).value:.3f}" for mu in (0.55, DRY_JOINT, 0.75))
            yield f"| {series.stone} | {total:.1f} | {cells} |"


def in_its_plane(model: Assembly) -> Assembly:
    """Blocks held so that they neither leave the plane y = 0 nor turn out of it."""
    held = ("y", "rx", "rz")
    return replace(model, blocks=tuple(b if b.fixed else replace(b, held=held) for b in model.blocks))


def ferris_rows() -> Iterator[str]:
    """A row a wall; without dilatancy the wall is held in its plane."""
    for number, (bond, published, computed) in FERRIS.items():
        model = bond.model(f"wall {number}")
        found = pushed(model)
        count = f"{sum(len(bond.course(k)) for k in range(bond.courses))} | {len(found.contacts)}"
        ours = bounds(found.lower, found.upper, 5)
        held = cyclopean.limit(in_its_plane(model), push=(1.0, 0.0, 0.0), mu=0.65, method="cra")
        low, high = held.coupled.stands, held.coupled.falls or held.upper
        without = f"{np.floor(low * 1e5) / 1e5:.5f} | {np.ceil(high * 1e5) / 1e5:.5f} | {1.0 - low / high:.1%}"
        yield (
            f"| {number} | {count} | {published or 'not seen'} | {computed:.5f} | {ours} | {kind(found)}"
            f" | {computed / found.value:.5f} | {without} |"
        )


def tilt_rows() -> Iterator[str]:
    """LACT3's two assemblies, both ways; the portal where its drawing is there."""
    models: list[tuple[str, Assembly, float, tuple[tuple[int, str, float], ...]]] = [
        ("wall", OPEN_WALL.model("wall"), 26.0, ((0, "published", 16.73), (180, "computed", 10.63)))
    ]
    drawing = FOLDER / "lact3" / "Portal.dxf"
    if drawing.is_file():
        angles = ((0, "published", 27.30), (180, "computed", 27.88))
        models.insert(0, ("portal", plane_drawing(drawing), 30.0, angles))
    else:
        yield "| portal | | left out: its drawing is not here | | | | |"
    for name, model, degrees, rows in models:
        for azimuth, source, angle in rows:
            found = tilted(model, azimuth, degrees)
            low, high = found.angle or (None, None)
            way = "right" if azimuth == 0 else "left"
            ratio = angle / (low + high) * 2 if low and high else float("nan")
            yield (
                f"| {name} | {way} | {degrees:g} | {angle:.2f} ({source}) | {bounds(low, high, 3)} | {kind(found)}"
                f" | {ratio:.4f} |"
            )


def least_thrust(mu: float) -> tuple[LimitResult, str]:
    """Bounds (kN) of the least thrust with which the barrel vault stands."""
    found = thrust(-1.0, mu)
    high, low = (None if x is None else DEM["thrust"] / KILO - x for x in (found.lower, found.upper))
    return found, bounds(low, high, 3)


def vault_rows() -> Iterator[str]:
    """The barrel vault of compas_dem."""
    model = barrel()
    free = np.array([not block.fixed for block in model.blocks])
    ours = float(model.mass.volume[free].sum()) * 2000 * 9.81 / KILO
    theirs = DEM["weight"] / KILO
    yield f"| Weight of the free blocks (kN) | {theirs:.2f} | {ours:.2f} | | {theirs / ours:.4f} |"
    standing = cyclopean.check(model, mu=0.5, method="cra")
    proof = f"`{standing.certificate['kind']}`" if standing.certificate else "none"
    yield f"| Does it stand? | at rest, no block moved by 1e-6 m | {standing.verdict} | {proof} | |"
    found, least = least_thrust(0.5)
    ratio = DEM["thrust"] / KILO / (DEM["thrust"] / KILO - found.value)
    yield f"| Thrust (kN), least | {DEM['thrust'] / KILO:.2f} | {least} | {kind(found)} | {ratio:.4f} |"
    most = thrust(1.0)
    yield f"| Thrust, most | within | {most.word} | {kind(most)} | |"


TEMPLATE = """# Experiments

Walls that were tested, and structures that others computed, beside what this program says of them. The page is written
by `python bench/experiments.py`, which builds every geometry from the dimensions given here and computes every figure
of ours anew. [Validation](validation.md) shows that the program solves its equations; this page asks whether the
equations describe a wall.

Nothing is tuned. Dimensions and loads are those of the sources, and friction too where they give one; no row is left
out because it misses, and where the model misses a sentence says what it lacks. *Ours* are both [bounds](limit.md),
outwards: at the first there are forces, from the second on none, and each answer carries a certificate that the exact
checker has accepted. *Ratio* is theirs over ours: above 1 the wall bore more than the model allows.
[Predictions](predictions.md) for tests whose results we have not seen stand on a page of their own.

| | Compared with | Outcome |
|---|---|---|
| [Granite walls](#granite-fourteen-walls) | 14 tests | within a tenth, less and less as they are loaded more |
| [Sandstone walls](#sandstone-seven-walls-not-predicted) | 7 tests | **not predicted**, off by up to 46 % |
| [Walls of Ferris and Tin-Loi](#walls-of-ferris-and-tin-loi) | sums of others | the same |
| [Tilting tables of LACT3](#tilting-the-assemblies-of-lact3) | sums of others | the same to 0.05 % |
| [Barrel vault](#barrel-vault) | discrete elements | both stand; the thrust is ours only from below |

## Dry walls in shear and compression

One leaf of sawn blocks without mortar, in running bond. A stiff block on top bears a constant vertical force in its
middle and takes the horizontal force at a given height above the foot. Forces in kN; *at the foot* is the vertical
force with the weight of the wall (20 kN/m³). Where a wall was pushed both ways both peaks are given, and the ratio is
that of their mean. Measured peaks: Vanin and others 2017, who collect the tests of Vasconcelos (2005), Vasconcelos and
Lourenço (2009) and Lourenço and others (2005). Their table has no friction. It is 0.62 here, and hardly matters, so
that nothing could have been tuned with it:

| Walls | At the foot | mu 0.55 | mu 0.62 | mu 0.75 |
|---|---|---|---|---|
{friction}

### Granite: fourteen walls

1.0 m long, 1.2 m high, 0.2 m thick; blocks 0.2 x 0.15 m; the force 1.325 m above the foot.

| Wall | At the foot | Measured | Ours | Certificate | Ratio |
|---|---|---|---|---|---|
{granite}

These walls rock, and the model finds the force within a tenth. The ratio falls as the vertical force grows, from 1.03
to 0.94 in the mean: rigid blocks turn about a corner that bears any stress, and **crushing of the toe** is missing. It
is not the whole of it: at the 73 MPa that the masonry bore in compression the largest force needs a toe of 17 mm, which
costs 2 % of the lever arm, not 6. What else is missing (joints that bear on a few spots, blocks that spall) these
figures do not tell.

All ten walls that were pushed both ways bore more the second way; WS1.100 13 % more than the upper bound allows. So
**the rig, the wall or both** were not symmetrical, and a model with one number for both ways cannot show it.

### Sandstone: seven walls, not predicted

1.0 m long, 0.9 m high, 0.2 m thick; blocks 0.2 x 0.1 m; the force 1.0 m above the foot.

| Wall | At the foot | Measured | Ours | Certificate | Ratio |
|---|---|---|---|---|---|
{sandstone}

**This fails.** The mean is near 1 by accident.

- With the least vertical force the walls bore 21.9 and 22.9 kN, and no cantilever can: about its toe a rigid wall takes
  at most 33.6 kN times half a metre over one metre, 16.8 kN, whatever the friction. So the **rig** held the top back
  from turning, or the vertical force grew or moved as the wall rocked; the model has a force that does neither.
- With more vertical force the walls bore 5 to 32 % less than the model. The source reports crushed toes for all of
  these, which the model lacks; but at the strength of the masonry (57 MPa) **crushing** takes 2 % off at most, and
  plain sliding would need a friction of 0.34 to 0.47. **We do not know** what else happened.

A free number for the rig would hide the first and not the second, so there is none.

## Walls of Ferris and Tin-Loi

Walls pushed in their plane in proportion to their weight: blocks of 0.4 x 0.175 m in running bond, friction 0.65. Walls
1, 2 and 4 are 2.0 m long and begin with half a block; wall 3 is 1.6 m long and begins with a whole one. Six, ten,
eleven and eleven courses. Through courses 4 to 8 wall 3 has an opening of 0.4 m, wall 4 has two. *Computed* is by a
linear programme of the plane problem that shares nothing with this program. Walls 5 and 6 of the paper are missing: we
do not have their dimensions.

| Wall | Blocks | Joints | Published | Computed | Ours | Certificate | Ratio | Stands | None | Apart |
|---|---|---|---|---|---|---|---|---|---|---|
{ferris}

Pushes are in shares of weight. Ours is for associated friction: a joint that slides also opens, so that
[real friction may give less](limit.md#sliding-and-what-the-limit-does-not-say). *Stands*, *None* and *Apart* ask
[coupled analysis](theory.md), by `limit --method cra`, of the walls held in their plane: at the first push it has a
certified state without dilatancy (`cra-state`), at the second it proves that there is none (`cra-tree`, with
eta = 10 eps and beta_min = 0.01 eps, up to rounding outwards of the last digit). Each is proved of that push alone.
Nothing is proved of the pushes between, nor that all smaller ones are borne, nor that all larger ones are not, until
our upper bound: from there on a mechanism rules out every push. Blocks that may leave the plane may have more
states: a joint's two corners on one side of the plane may open while the other two press. These are sums beside sums:
nobody pushed a wall.

## Tilting the assemblies of LACT3

Plane assemblies on a table that is tilted in their plane. The wall: 182 blocks of 250 x 55.6 mm in 27 courses, 2.0 m
long; a door of 250 mm, 0.25 m from the left, through courses 2 to 25; a window of 500 mm, 0.875 m from the left,
through courses 3 to 24; a lintel of 750 mm over it in course 25. The portal: 40 polygonal blocks, read from the
authors' drawing, which is not part of this project. Angles in degrees.

| Assembly | To the | Friction angle | Theirs | Ours | Certificate | Ratio |
|---|---|---|---|---|---|---|
{tilt}

*Published* is the authors' figure, *computed* that of a plane linear programme. Again no table was tilted: both models
have rigid blocks and associated friction, so that agreement says nothing about stone.

## Barrel vault

A sample of compas_dem: span 7 m, rise 0.1 m, thickness 0.25 m, nine voussoirs in thirteen rows, every other one shifted
by half; 121 blocks of 2000 kg/m³, friction 0.5, both springings fixed. Its file of results was written by LMGC90
(contact dynamics of rigid blocks, 100 steps of 0.001 s, as the script beside it in that repository says); 1268 contact
points stick and 12 slide. Their thrust is the sum of the contact forces on one springing; ours is that of one long
springing which is held against all but a push.

| What | Discrete elements | Ours | Certificate | Ratio |
|---|---|---|---|---|
{vault}

Both say that it stands. Equilibrium leaves the thrust open: the vault is so flat that a straight strut fits into it,
and no thrust is too large. The discrete elements settle 2 % above the least. Which thrust a vault has depends on how
its springings give way and how it was built, and **rigid blocks on fixed springings cannot say**. The weights differ by
one in ten thousand, because our voussoirs span equal angles.

## What is not here

Strength of stone, cracks, sway of a rig, time. No test out of plane, none of a vault, none of rubble. Filled arch
bridges that were loaded to collapse are left out: their fill bears, and we have no measured one to hold our model of it
against.

## Sources

- F. Vanin, D. Zaganelli, A. Penna, K. Beyer (2017), *Bulletin of Earthquake Engineering*,
  [doi 10.1007/s10518-017-0188-5](https://doi.org/10.1007/s10518-017-0188-5); their data under MIT.
- M. C. Ferris, F. Tin-Loi: Limit analysis of frictional block assemblies as a mathematical program with complementarity
  constraints. *International Journal of Mechanical Sciences* 43 (2001), 209-224.
- Hua, Buzzetti, Pingaro, da Silva, Milani: LACT3 (2025).
- compas_dem, Block Research Group, ETH Zurich; MIT, commit 559107e.
"""


# Predictions


def shared(found: LimitResult, n: int = 3) -> str:
    """Bounds of what grows; degrees of a tilt."""
    return bounds(*(found.angle or (found.lower, found.upper)), n)


SHORT = replace(GRANITE, bond=replace(GRANITE.bond, length=0.6))
LOW = replace(GRANITE, bond=replace(GRANITE.bond, courses=4), span=0.725)
# docs/predictions.md by number: a row there is never changed, and this says whether the program still gives it.
PREDICTED: dict[str, Callable[[], str]] = {
    "P1": lambda: shared(sheared(GRANITE, 64.8)),
    "P2": lambda: shared(sheared(SHORT, 62.88)),
    "P3": lambda: shared(sheared(LOW, 102.4)),
    "P4": lambda: shared(cyclopean.limit(GRANITE.bond.model("granite"), tilt=0.0, mu=DRY_JOINT)),
    "P5": lambda: shared(cyclopean.limit(GRANITE.bond.model("granite"), tilt=90.0, mu=DRY_JOINT)),
    "P6": lambda: shared(cyclopean.limit(FERRIS[3][0].model("wall 3"), tilt=0.0, mu=0.65)),
    "P7": lambda: shared(cyclopean.limit(FERRIS[4][0].model("wall 4"), tilt=0.0, mu=0.65)),
    "P8": lambda: shared(tilted(OPEN_WALL.model("wall"), 0.0, 35.0)),
    "P9": lambda: shared(tilted(OPEN_WALL.model("wall"), 180.0, 35.0)),
    "P10": lambda: least_thrust(0.1)[1],
    "P11": lambda: cyclopean.check(barrel(), mu=0.0, method="rbe").verdict,
}


def changed(numbers: Iterable[str]) -> list[str]:
    """Predictions on the page that the program gives no more."""
    rows = {row.split(" | ")[0].strip("| "): row for row in PREDICTIONS.read_text(encoding="utf-8").splitlines()}
    wrong = []
    for number in numbers:
        ours = PREDICTED[number]()
        print(number, ours, flush=True)
        wrong += [] if f" | {ours} | " in rows.get(number, "") else [number]
    return wrong


def main(given: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="only the sandstone walls and what friction changes")
    parser.add_argument("--predictions", action="store_true", help="compute those of docs/predictions.md once more")
    chosen = parser.parse_args(given)
    if chosen.predictions:
        wrong = changed(PREDICTED)
        print(f"changed: {', '.join(wrong) or 'none'}")
        return int(bool(wrong))
    tables: dict[str, Callable[[], Iterator[str]]] = {
        "sandstone": lambda: shear_rows(SANDSTONE),
        "friction": friction_rows,
    }
    if not chosen.quick:
        tables["granite"] = lambda: shear_rows(GRANITE)
        tables |= {"ferris": ferris_rows, "tilt": tilt_rows, "vault": vault_rows}
    made = {}
    for name, rows in tables.items():
        made[name] = "\n".join(rows())
        print(made[name], flush=True)
    if not chosen.quick:
        PAGE.write_text(TEMPLATE.format(**made), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
