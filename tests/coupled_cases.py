"""Small models for coupled analysis: what rests, what leans, and what is squeezed between fixed walls.

`beams` is one or more blocks in a row between two fixed columns. With upright faces and one block it is the H frame.
By hand, for a block of half-length a and height h, rotated by w about the level axis across it: two opposite corners
overlap by eps when w h / 2 = eps. The one that rubs (friction T = W up, so it slides down) is the one that the rotation
lifts by w a, so the other slides down by 2 w a + beta_min = 4 (a / h) eps + beta_min; the couple of the thrusts N
balances that of T: N h = W a. So with T <= mu N

    it stands if and only if    mu >= h / a    and    4 (a / h) eps + beta_min <= eta.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.assembly import Assembly, Block, Contacts
from cyclopean.design import stack
from near_limit import G, plain, random_case

FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
FAMILIES = ("at rest", "beams", "wedge", "shaft", "stack")
LARGEST = 110  # contact points


@dataclass(frozen=True)
class CoupledCase:
    """A model, its friction and its gravity."""

    family: str
    assembly: Assembly
    mu: float
    gravity: tuple[float, float, float]


def prism(name: str, section: Sequence[Sequence[float]], depth: float, fixed: bool | None = None) -> Block:
    """Four corners (x, z), counter-clockwise seen along +y, between y = 0 and y = depth."""
    (x0, z0), (x1, z1), (x2, z2), (x3, z3) = section
    front, back = 0.0, depth
    corners = [
        (x0, front, z0), (x1, front, z1), (x1, back, z1), (x0, back, z0),
        (x3, front, z3), (x2, front, z2), (x2, back, z2), (x3, back, z3),
    ]  # fmt: skip
    return Block(name, np.array(corners, float), FACES, fixed=fixed)


def beams(half: float, height: float, depth: float, count: int = 1, lean: float = 0.0, wall: float = 0.3) -> Assembly:
    """`count` blocks in a row, 2 `half` long in all at mid-height, between two fixed walls that end where they end.

    The ends lean outwards by `lean` (x per z): a wedge for lean > 0. Joints between blocks are upright.
    """
    edge = np.linspace(-half, half, count + 1)
    low, high = edge.copy(), edge.copy()
    low[[0, -1]] += np.array([1.0, -1.0]) * lean * height / 2
    high[[0, -1]] -= np.array([1.0, -1.0]) * lean * height / 2
    low, high = np.append(low, low[-1] + wall), np.append(high, high[-1] + wall)
    low, high = np.append(low[0] - wall, low), np.append(high[0] - wall, high)
    names = ["left", *(f"beam{i}" for i in range(count)), "right"]
    sections = [
        [(low[i], 0.0), (low[i + 1], 0.0), (high[i + 1], height), (high[i], height)] for i in range(len(low) - 1)
    ]
    blocks = [prism(n, s, depth, n in ("left", "right")) for n, s in zip(names, sections, strict=True)]
    joints = [
        [(low[i], 0.0, 0.0), (low[i], depth, 0.0), (high[i], depth, height), (high[i], 0.0, height)]
        for i in range(1, len(low) - 1)
    ]
    pairs = [(i, i + 1) for i in range(len(joints))]
    return Assembly(tuple(blocks), Contacts.of(pairs, [np.array(j) for j in joints]), name=f"{count} beams")


def shaft(half: float, height: float, depth: float, lean: float = 0.0) -> Assembly:
    """A block between two walls, standing on a floor as well."""
    model = beams(half, height, depth, 1, lean)
    foot = half - lean * height / 2
    floor = prism("floor", [(-foot, -0.2), (foot, -0.2), (foot, 0.0), (-foot, 0.0)], depth, True)
    assert model.contacts is not None
    base = np.array([(-foot, 0.0, 0.0), (foot, 0.0, 0.0), (foot, depth, 0.0), (-foot, depth, 0.0)])
    polygons = [model.contacts.polygon(k) for k in range(2)] + [base]
    return Assembly((*model.blocks, floor), Contacts.of([(0, 1), (1, 2), (3, 1)], polygons), name="shaft")


def points(model: Assembly) -> int:
    """Number of contact points."""
    return 0 if model.contacts is None else len(model.contacts.point)


def tilted(degrees: float, azimuth: float) -> tuple[float, float, float]:
    """Gravity (m/s2) turned from -z towards `azimuth` (radians)."""
    t = np.radians(degrees)
    return float(G * np.sin(t) * np.cos(azimuth)), float(G * np.sin(t) * np.sin(azimuth)), float(-G * np.cos(t))


def coupled_case(seed: int) -> CoupledCase:
    """Case number `seed`: a quarter rests on its supports, near its limit or not; most others are squeezed or lean."""
    rng = np.random.default_rng([seed, 7])
    family = FAMILIES[int(rng.choice(len(FAMILIES), p=[0.25, 0.35, 0.15, 0.15, 0.1]))]
    tilt = 0.0 if rng.random() < 0.5 else float(rng.uniform(0.0, 30.0))
    gravity = tilted(tilt, float(rng.choice([0.0, np.pi / 2, rng.uniform(0.0, 2 * np.pi)])))
    half, depth = 1.0, float(rng.uniform(0.3, 2.0))
    if family == "at rest":
        case = next(c for c in map(random_case, range(seed, seed + 10_000, 100)) if points(c.assembly) <= LARGEST)
        return CoupledCase(family, case.assembly, case.mu, case.gravity)
    if family == "beams":
        height, count = float(rng.uniform(0.3, 1.5)), int(rng.choice([1, 1, 1, 2, 3]))
        mu = float(height / half * rng.choice([0.3, 0.7, 0.95, 1.05, 1.5, 3.0]))
        return CoupledCase(family, beams(half, height, depth, count), mu, gravity)
    if family == "wedge":
        lean = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.5))
        model = beams(half, float(rng.uniform(0.4, 1.5)), depth, int(rng.choice([1, 1, 2])), lean)
        return CoupledCase(family, model, float(abs(lean) * rng.uniform(0.5, 4.0)), gravity)
    if family == "shaft":
        lean = float(rng.choice([-0.2, 0.0, 0.2])) * float(rng.random())
        model = shaft(half, float(rng.uniform(0.5, 2.5)), depth, lean)
        return CoupledCase(family, model, float(rng.uniform(0.05, 0.9)), gravity)
    count = int(rng.integers(1, 5))
    model = stack(count, (1.0, 0.8, float(rng.uniform(0.2, 0.8))), offset=float(rng.uniform(-0.5, 0.5) / count))
    return CoupledCase(family, model, float(rng.uniform(0.2, 1.2)), gravity)


def undetected(case: CoupledCase) -> Assembly:
    """The model without its contacts: they are to be found."""
    found = plain(case.assembly)
    held = [b.fixed for b in case.assembly.blocks]
    return replace(found, blocks=tuple(replace(b, fixed=f) for b, f in zip(found.blocks, held, strict=True)))
