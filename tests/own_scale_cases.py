"""Models whose answer is known by hand, with stones of very different sizes."""

from collections.abc import Iterator

import numpy as np

from cyclopean.assembly import Assembly, Block, Contacts
from cyclopean.geometry import rotations

FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def box(
    name: str, low: object, size: object, fixed: bool | None = None, turn: object = None, about: object = None
) -> Block:
    """A box from its low corner, optionally turned by a rotation vector about a point."""
    x, y, z = np.asarray(low, float)
    a, b, c = np.broadcast_to(np.asarray(size, float), 3)
    ring = np.array([[x, y, 0], [x + a, y, 0], [x + a, y + b, 0], [x, y + b, 0]])
    corner = np.concatenate([np.add(ring, [0, 0, z]), np.add(ring, [0, 0, z + c])])
    if turn is not None:
        corner = (corner - about) @ rotations(np.asarray(turn, float)[None])[0].T + about
    return Block(name, corner, FACES, fixed=fixed)


def tip(ratio: float, share: float, rng: np.random.Generator) -> tuple[Assembly, bool]:
    """A stone of `ratio` m over the edge of a 1 m cube by this share of its length; stands where that is < 1/2."""
    base = box("base", (0, 0, -1), (2, 2, 1), True)
    cube = box("cube", (0.5, 0.5, 0), 1.0)
    at = 1.5 - (1.0 - share) * ratio
    stone = box("stone", (at, 0.5 + 0.3 * rng.random(), 1.0), ratio)
    return Assembly([base, cube, stone]), share < 0.5


def slide(ratio: float, mu: float, steepness: float, beside: bool = True) -> tuple[Assembly, bool]:
    """A stone of `ratio` m on a fixed slope whose tangent is `steepness` mu, beside a cube; stands if that is < 1."""
    angle = np.arctan(steepness * mu)
    slope = box("slope", (0, 0, -1), (2, 2, 1), True, (0, -angle, 0), (0, 0, 0))
    stone = box("stone", (0.8, 0.8, 0), (ratio, ratio, 0.5 * ratio), None, (0, -angle, 0), (0, 0, 0))
    blocks = [slope, stone]
    if beside:  # joined to the stone's fate only through the support
        blocks += [box("cube", (1, 4, 0), 1.0), box("floor", (0, 3, -1), (3, 3, 1), True)]
    return Assembly(blocks), steepness < 1.0


def slide_on_cube(ratio: float, mu: float, steepness: float) -> tuple[Assembly, bool]:
    """The same on the sloping top of a free block of 1 m that stands in a pit wall's corner: one component."""
    rise = steepness * mu
    wedge = Block(
        "wedge",
        np.array(
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1 + rise], [1, 1, 1 + rise], [0, 1, 1]],
            float,
        ),
        FACES,
    )
    n = np.array([-rise, 0, 1]) / np.hypot(rise, 1)
    u = np.array([n[2], 0, -n[0]])
    v = np.array([0, 1.0, 0])
    at = np.array([0.5, 0.4, 1 + 0.5 * rise])
    stone = box("stone", (0, 0, 0), (ratio, ratio, 0.4 * ratio))
    corner = at + stone.vertices @ np.stack([u, v, n])
    return Assembly([box("base", (-1, -1, -1), (3, 3, 1), True), wedge, Block("stone", corner, FACES)]), steepness < 1.0


def pins(ratio: float, count: int, share: float, rng: np.random.Generator) -> tuple[Assembly, bool]:
    """A 1 m cube on `count` x `count` pins of `ratio` m; and one pin beside it that hangs over a ledge by `share`."""
    base = box("base", (-1, -1, -1), (3, 3, 1), True)
    places = np.linspace(0.0, 1.0 - ratio, count)
    under = [box(f"pin {i} {j}", (x, y, 0), ratio) for i, x in enumerate(places) for j, y in enumerate(places)]
    cube = box("cube", (0, 0, ratio), 1.0)
    top = box("top", (0.4, 0.3, 1.0 + ratio), ratio)
    hanging = box("hanging", (0.4 + share * ratio, 0.3, 1.0 + 2 * ratio), ratio)
    return Assembly([base, *under, cube, top, hanging]), share < 0.5


def turned(assembly: Assembly, rng: np.random.Generator) -> tuple[Assembly, np.ndarray]:
    """The assembly turned at random and moved, and the gravity that goes with it."""
    rotation = rotations(rng.normal(size=(1, 3)))[0]
    shift = rng.normal(size=3) * 5.0
    blocks = [Block(b.id, b.vertices @ rotation.T + shift, b.faces, b.density, b.fixed) for b in assembly.blocks]
    contacts = assembly.contacts
    if contacts is not None:
        contacts = Contacts(
            contacts.a, contacts.b, contacts.start, contacts.point @ rotation.T + shift, contacts.mu, contacts.tension
        )
    return Assembly(blocks, contacts), rotation @ [0.0, 0.0, -9.80665]


def mixed(seed: int) -> Iterator[tuple[str, Assembly, float, np.ndarray, bool]]:
    """Name, model, mu, gravity and whether it stands, of a random case of each family."""
    rng = np.random.default_rng(seed)
    ratio = 10.0 ** -rng.uniform(0.0, 4.0)
    margin = 10.0 ** -rng.uniform(0.5, 4.0) * rng.choice([-1.0, 1.0])
    mu = float(rng.uniform(0.2, 0.9))
    cases = [
        ("tip", *tip(ratio, 0.5 * (1.0 + margin), rng), mu),
        ("slide", *slide(ratio, mu, 1.0 + margin), mu),
        ("slide on cube", *slide_on_cube(ratio, mu, 1.0 + margin), mu),
        ("pins", *pins(min(ratio, 0.3), int(rng.integers(2, 4)), 0.5 * (1.0 + margin), rng), mu),
    ]
    for name, assembly, stands, mu_ in cases:
        if rng.random() < 0.5:
            moved, gravity = turned(assembly, rng)
            yield f"{name} turned", moved, mu_, gravity, stands
        else:
            yield name, assembly, mu_, np.array([0.0, 0.0, -9.80665]), stands
