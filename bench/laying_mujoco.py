"""Rubble walls let go in MuJoCo: does what `check` says of a settled wall agree with what falls?

    python bench/laying_mujoco.py [walls]

MuJoCo collides convex bodies only, so the walls are laid from the convex hulls of quarry stones: both sides see the
same bodies. A wall has fallen when a stone has moved by more than a fifth of the smallest stone's size in three
seconds; what fell so far moved by a quarter or more, when we stop looking, and what stood by less than an eighth. A
stone that moved by more than a twentieth has shifted: it stood near its limit and found another rest nearby; the
agreement is told with shifted walls as fallen, too. "undecided" counts as disagreement. Half of the walls are looked
at on level ground, half on ground that slopes out of their plane by 2 to 20 degrees.
"""

import sys
from time import perf_counter

import numpy as np

from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly, supports
from cyclopean.design.laying.settle import SettleSettings, settle
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.quarry import quarry
from cyclopean.design.stones.stone import Stone, in_body_frame, stone_of
from cyclopean.geometry.solids import hull_of, mesh_of

WALLS = 40
STONES = (3, 8)
BAND = 2e-4  # m: the hulls touch in points; a wider band would lend them contacts that they do not have
SECONDS, STEP = 3.0, 1e-3
FELL, SHIFTED, ENOUGH = 0.2, 0.05, 0.25  # of the cube root of the smallest stone's volume
MU = 0.7
DENSITY = 2400.0
DETAIL = 2

XML = """
<mujoco>
  <option timestep="{step}" gravity="{gravity}" cone="elliptic" impratio="20" noslip_iterations="20" iterations="100"
          tolerance="1e-10" integrator="implicitfast"><flag multiccd="enable"/></option>
  <default>
    <geom type="mesh" condim="3" density="{density}" friction="{mu} 0 0" solref="0.004 1" solimp="0.99 0.999 0.0001"/>
  </default>
  <asset>{meshes}</asset>
  <worldbody>{bodies}</worldbody>
</mujoco>
"""


def hull_stone(stone: Stone) -> Stone:
    """The convex hull of a stone, as a stone."""
    return stone_of(stone.id, *mesh_of(hull_of(in_body_frame(stone))), DENSITY)


def drawn(seed: int) -> tuple[Assembly, tuple[float, float, float], int]:
    """A wall, the gravity it is looked at in, and how many of its stones were laid without a margin."""
    draw = np.random.default_rng([seed, 17])
    count = int(draw.integers(STONES[0], STONES[1] + 1))
    stones = tuple(hull_stone(s) for s in quarry(count, seed=1000 + seed, detail=DETAIL))
    length = float(draw.uniform(1.5, 3.0))
    wall = settle(Inventory(stones), SettleSettings(length=length, band=BAND, margin=0.01))
    slope = np.radians(draw.uniform(2.0, 20.0)) if seed % 2 else 0.0
    gravity = (0.0, 9.81 * float(np.sin(slope)), -9.81 * float(np.cos(slope)))
    return wall.assembly, gravity, sum(not laid.stable for laid in wall.laid)


def numbers(values: np.ndarray) -> str:
    return " ".join(f"{x:.17g}" for x in np.ravel(values))


def moved(model: Assembly, gravity: tuple[float, float, float]) -> tuple[float, str]:
    """How far the farthest stone goes, in sizes of the smallest stone, and which one it is."""
    import mujoco

    fixed, _ = supports(model)
    meshes, bodies = [], []
    for k, block in enumerate(model.blocks):
        centre = model.mass.centroid[k]
        meshes.append(f'<mesh name="m{k}" vertex="{numbers(block.vertices - centre)}"/>')
        joint = "" if fixed[k] else "<freejoint/>"
        bodies.append(f'<body name="b{k}" pos="{numbers(centre)}">{joint}<geom mesh="m{k}"/></body>')
    xml = XML.format(
        step=STEP, gravity=numbers(np.array(gravity)), density=DENSITY, mu=MU, meshes="".join(meshes),
        bodies="".join(bodies),
    )  # fmt: skip
    simulated = mujoco.MjModel.from_xml_string(xml)
    state = mujoco.MjData(simulated)
    free = np.flatnonzero(~fixed)
    size = float(np.cbrt(model.mass.volume[free].min()))
    farthest, which = 0.0, ""
    for step in range(round(SECONDS / STEP)):
        mujoco.mj_step(simulated, state)
        if step % 100 == 99:
            for k in free:
                turn = state.xmat[k + 1].reshape(3, 3)
                now = (model.blocks[k].vertices - model.mass.centroid[k]) @ turn.T + state.xpos[k + 1]
                far = float(np.linalg.norm(now - model.blocks[k].vertices, axis=1).max())
                if far > farthest:
                    farthest, which = far, model.blocks[k].id
            if farthest > ENOUGH * size:
                break
    return farthest / size, which


def main(walls: int) -> None:
    agreed, strictly, fallen, shifted = 0, 0, 0, 0
    print("wall stones rocking slope      check    moved agree  which, seconds")
    for seed in range(walls):
        start = perf_counter()
        model, gravity, rocking = drawn(seed)
        laid = perf_counter()
        result = check(model, Settings(mu=MU, gravity=gravity, density=DENSITY, seconds=20.0))
        checked = perf_counter()
        distance, which = moved(model, gravity)
        falls, shifts = distance > FELL, distance > SHIFTED
        same = result.verdict == ("unstable" if falls else "stable")
        agreed, strictly = agreed + same, strictly + (result.verdict == ("unstable" if shifts else "stable"))
        fallen, shifted = fallen + falls, shifted + (shifts and not falls)
        slope = np.degrees(np.arctan2(gravity[1], -gravity[2]))
        print(
            f"{seed:4d} {len(model) - 1:6d} {rocking:7d} {slope:5.1f} {result.verdict:>10} {distance:8.4f}"
            f" {'yes' if same else 'NO':>5}  {which} {laid - start:.1f} + {checked - laid:.1f}"
            f" + {perf_counter() - checked:.1f} s",
            flush=True,
        )
    print(f"{agreed} of {walls} agree ({agreed / walls:.1%}); {fallen} fell, {shifted} shifted")
    print(f"with the shifted ones as fallen: {strictly} of {walls} ({strictly / walls:.1%})")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else WALLS)
