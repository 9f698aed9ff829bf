"""Models pushed, tilted and loaded, for the tests of limit analysis."""

import os
import sys
from dataclasses import replace

import numpy as np

from cyclopean.analysis import LimitResult, Live, Settings, limit
from cyclopean.assembly import Assembly, Block, Contacts
from cyclopean.statics import turned_gravity
from near_limit import random_assembly

__all__ = ["pushed", "random_push", "rotated", "scaled", "shuffled"]

sys.path.insert(0, os.path.dirname(__file__))


def pushed(model: Assembly, push: tuple[float, float, float], mu: float, **settings: object) -> LimitResult:
    return limit(model, Live(push=push), Settings(mu=mu, **settings))  # type: ignore[arg-type]


def random_push(seed: int) -> tuple[Assembly, tuple[float, float, float], float]:
    """A random assembly, a random horizontal direction and a random friction."""
    rng = np.random.default_rng(seed)
    model, mu, heading = random_assembly(rng), float(rng.uniform(0.3, 1.0)), rng.uniform(0, 2 * np.pi)
    return model, (float(np.cos(heading)), float(np.sin(heading)), 0.0), mu


def moved(model: Assembly, place: object) -> Assembly:
    """All coordinates passed through a function of (n, 3) points."""
    contacts = model.contacts
    assert contacts is not None
    blocks = tuple(replace(b, vertices=place(b.vertices)) for b in model.blocks)  # type: ignore[operator]
    polygons = [place(contacts.polygon(k)) for k in range(len(contacts))]  # type: ignore[operator]
    pairs = list(zip(contacts.a.tolist(), contacts.b.tolist(), strict=True))
    return Assembly(blocks, Contacts.of(pairs, polygons))


def scaled(model: Assembly, factor: float) -> Assembly:
    return moved(model, lambda points: points * factor)


def rotated(model: Assembly, degrees: float) -> Assembly:
    """About an axis through the origin that is neither upright nor level."""
    turn = rotation(degrees)
    fixed = moved(model, lambda points: points @ turn.T)
    low = [b.fixed for b in model.blocks]
    blocks = tuple(replace(b, fixed=bool(f)) for b, f in zip(fixed.blocks, low, strict=True))
    return replace(fixed, blocks=blocks)


def rotation(degrees: float) -> np.ndarray:
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    angle = np.deg2rad(degrees)
    K = np.cross(np.eye(3), axis)
    return np.asarray(np.eye(3) - np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


def shuffled(model: Assembly, seed: int) -> Assembly:
    """The same blocks and contacts in another order."""
    contacts = model.contacts
    assert contacts is not None
    rng = np.random.default_rng(seed)
    order, rank = rng.permutation(len(model)), rng.permutation(len(contacts))
    place = np.argsort(order)
    blocks: tuple[Block, ...] = tuple(model.blocks[i] for i in order)
    pairs = [(int(place[contacts.a[k]]), int(place[contacts.b[k]])) for k in rank]
    return Assembly(blocks, Contacts.of(pairs, [contacts.polygon(int(k)) for k in rank]))


def tilted_gravity(degrees: float) -> tuple[float, float, float]:
    x, y, z = turned_gravity(np.array([0.0, 0.0, -9.80665]), degrees).tolist()
    return x, y, z
