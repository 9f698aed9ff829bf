"""Models by chance, and other drawings of them: within a length, as far off as chance makes them."""

from dataclasses import replace

import numpy as np
import shapely

import cyclopean
from cyclopean.analysis import Settings, prepare
from cyclopean.assembly import Assembly, Contacts, Load

SETTINGS = Settings(method="rbe")


def any_model(rng: np.random.Generator) -> Assembly:
    """A stack on a slope, an arch, a wall or a dome; about as many stand as fall. Some bear a load."""
    kind, mu = rng.choice(["stack", "arch", "wall", "dome"]), float(rng.uniform(0.3, 0.9))
    if kind == "stack":
        size = tuple(rng.uniform(0.3, 1.0, 3))
        made = cyclopean.stack(int(rng.integers(1, 6)), size, slope=float(rng.uniform(0.0, 45.0)), mu=mu)
    elif kind == "arch":
        thickness = float(rng.uniform(0.08, 0.5))
        made = cyclopean.arch(int(rng.integers(3, 14)), span=3.0, thickness=thickness, mu=mu)
    elif kind == "wall":
        made = cyclopean.wall(int(rng.integers(2, 5)), int(rng.integers(2, 5)), mu=mu)
    else:
        made = cyclopean.dome(int(rng.integers(2, 4)), 8, thickness=float(rng.uniform(0.1, 0.4)), mu=mu)
    if rng.random() < 0.4:
        block = int(rng.integers(len(made)))
        push = rng.normal(0.0, rng.choice([100.0, 3000.0]), 3)
        made = replace(made, loads=(Load(block, push, made.mass.centroid[block]),))
    return made


def another_drawing(model, length, rng):
    """A model of the family of `length` (m): vertices moved, contacts drawn in or out, tilted and lifted, loads moved.

    Half of them as badly as can be: all vertices of a block the same way, every contact drawn in by all of it.
    """
    bad = rng.random() < 0.5
    blocks = []
    for block in model.assembly.blocks:
        move = _ball(rng, 1, bad) if rng.random() < 0.5 else _ball(rng, len(block.vertices), bad)
        if rng.random() < 0.3:  # it swells, or shrinks, or both: towards a side
            away = block.vertices - block.vertices.mean(0)
            move = rng.choice([-1.0, 1.0]) * away / np.linalg.norm(away, axis=1).max()
        blocks.append(replace(block, vertices=block.vertices + length * move))
    loads = tuple(replace(load, point=load.point + length * _ball(rng, 1, bad)[0]) for load in model.assembly.loads)
    contacts = model.contacts
    polygons = [_other_contact(contacts, k, length, rng, bad) for k in range(len(contacts))]
    kept = [k for k, polygon in enumerate(polygons) if polygon is not None]
    assembly = replace(model.assembly, blocks=tuple(blocks), loads=loads, contacts=None)
    ends = np.stack([contacts.a, contacts.b], 1)[kept]
    drawn = Contacts.of(ends, [polygons[k] for k in kept], contacts.mu[kept])
    return replace(model, assembly=assembly, contacts=drawn)


def _ball(rng, count, bad):
    """Points in the unit ball, or on it."""
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    return way if bad else way * rng.random((count, 1)) ** (1.0 / 3.0)


def _other_contact(contacts, k, length, rng, bad):
    """The polygon drawn in or out by up to the length, then tilted and lifted so that nothing is further off."""
    ring, frame = contacts.polygon(k), contacts.frame[k]
    flat = (ring - ring[0]) @ frame[1:].T
    by = length * (rng.choice([-1.0, -1.0, 1.0]) if bad else rng.uniform(-1.0, 1.0)) * (1.0 - 1e-9)
    drawn = shapely.buffer(shapely.Polygon(flat), by, join_style="mitre", mitre_limit=1e3)
    if drawn.is_empty or drawn.geom_type != "Polygon":
        return None
    corners = shapely.get_coordinates(shapely.geometry.polygon.orient(drawn).exterior)[:-1]
    slope = rng.normal(size=2)
    rise = (corners - corners.mean(0)) @ slope
    lift = rng.uniform(-1.0, 1.0) * length
    most = np.abs(rise).max()
    height = lift + rise * ((length - abs(lift)) / most if most else 0.0)
    return ring[0] + corners @ frame[1:] + height[:, None] * frame[0]


def prepared(assembly: Assembly):
    """Ready for analysis by rigid-block equilibrium."""
    return prepare(assembly, SETTINGS)
