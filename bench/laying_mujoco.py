"""Rubble walls let go in MuJoCo: does what `check` says of a settled wall agree with what falls?

    python bench/laying_mujoco.py [first last]

MuJoCo collides convex bodies only, so the walls are laid from the convex hulls of quarry stones: both sides see the
same bodies. `settle` lays walls that stand, so of every four walls one is looked at as it is, one on ground that slopes
out of its plane by 0.5 to 3 degrees, one on ground that slopes by 15 to 35, and one after a stone that bears others was
taken out of it. Friction is 0.7 on both sides; laid was with 0.6 and gravity leaning by 6 degrees.

A wall has fallen when a stone has moved by more than a fifth of the smallest stone's size in three seconds. A stone
that moved by more than a twentieth has shifted: it stood near its limit and found another rest nearby; the agreement is
told with shifted walls as fallen, too. "undecided" counts as disagreement.
"""

import sys
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly, supports
from cyclopean.design.rubble.settle import SettleSettings, settle
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.quarry import quarry
from cyclopean.design.stones.stone import Stone, in_body_frame, stone_of

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))  # hulls are shared with the tests

from simulated import DENSITY, STIFF, hulls, simulation

from geometry_rules import hull_mesh

WALLS = 40
STONES = (4, 25)
SECONDS = 3.0
FELL, SHIFTED, ENOUGH = 0.2, 0.05, 0.25  # of the cube root of the smallest stone's volume
MU = 0.7
DETAIL = 2
YAWS = 4
SLOPES = ((0.0, 0.0), (0.5, 3.0), (15.0, 35.0), (0.0, 0.0))  # degrees


def hull_stone(stone: Stone) -> Stone:
    """The convex hull of a stone, as a stone."""
    return stone_of(stone.id, *hull_mesh(in_body_frame(stone)), DENSITY)


def drawn(seed: int) -> tuple[Assembly, float, str]:
    """A wall, the slope (degrees) that it is looked at on, and which stone was taken out of it."""
    draw = np.random.default_rng([seed, 17])
    count = int(draw.integers(STONES[0], STONES[1] + 1))
    stones = tuple(hull_stone(s) for s in quarry(count, seed=1000 + seed, detail=DETAIL))
    wall = settle(Inventory(stones), SettleSettings(yaws=YAWS, ways=1)).assembly
    kind = seed % 4
    slope = float(draw.uniform(*SLOPES[kind]))
    assert wall.contacts is not None
    below = sorted({int(a) for a in wall.contacts.a if a > 0})
    if kind < 3 or not below:
        return wall, slope, ""
    out = int(draw.choice(below))
    return without(wall, out), slope, wall.blocks[out].id


def without(wall: Assembly, out: int) -> Assembly:
    """The wall less one stone."""
    contacts = wall.contacts
    assert contacts is not None
    left = contacts.only(np.flatnonzero((contacts.a != out) & (contacts.b != out)))
    left = replace(left, a=left.a - (left.a > out), b=left.b - (left.b > out))
    blocks = tuple(block for k, block in enumerate(wall.blocks) if k != out)
    return Assembly(blocks, left, (), wall.name)


def moved(model: Assembly, gravity: tuple[float, float, float]) -> tuple[float, str]:
    """How far the farthest corner of a stone goes, in sizes of the smallest stone, and which stone it is."""
    free = np.flatnonzero(~supports(model)[0])
    size = float(np.cbrt(model.mass.volume[free].min()))
    farthest, which = 0.0, ""
    for _, turn, place in simulation(model, hulls(model), MU, np.array(gravity), STIFF, SECONDS):
        for k in free:
            block = model.blocks[k]
            now = (block.vertices - model.mass.centroid[k]) @ turn[k].T + place[k]
            far = float(np.linalg.norm(now - block.vertices, axis=1).max())
            if far > farthest:
                farthest, which = far, block.id
        if farthest > ENOUGH * size:
            break
    return farthest / size, which


def main(first: int, last: int) -> None:
    agreed, strictly, fallen, shifted = 0, 0, 0, 0
    print("wall stones slope  less          check    moved agree  which, seconds")
    for seed in range(first, last):
        start = perf_counter()
        model, slope, out = drawn(seed)
        down = np.radians(slope)
        gravity = (0.0, 9.81 * float(np.sin(down)), -9.81 * float(np.cos(down)))
        laid = perf_counter()
        result = check(model, Settings(mu=MU, gravity=gravity, density=DENSITY, seconds=20.0))
        checked = perf_counter()
        distance, which = moved(model, gravity)
        falls, shifts = distance > FELL, distance > SHIFTED
        same = result.verdict == ("unstable" if falls else "stable")
        agreed, strictly = agreed + same, strictly + (result.verdict == ("unstable" if shifts else "stable"))
        fallen, shifted = fallen + falls, shifted + (shifts and not falls)
        print(
            f"{seed:4d} {len(model) - 1:6d} {slope:5.1f} {out:>9} {result.verdict:>10} {distance:8.4f}"
            f" {'yes' if same else 'NO':>5}  {which} {laid - start:.1f} + {checked - laid:.1f}"
            f" + {perf_counter() - checked:.1f} s",
            flush=True,
        )
    walls = last - first
    print(f"{agreed} of {walls} agree ({agreed / walls:.1%}); {fallen} fell, {shifted} shifted")
    print(f"with the shifted ones as fallen: {strictly} of {walls} ({strictly / walls:.1%})")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:3]) if len(sys.argv) > 2 else (0, WALLS))
