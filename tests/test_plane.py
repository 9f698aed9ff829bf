"""Structures in the plane, solved there: the same bounds as of the whole."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from cyclopean.analysis import Live, Settings
from cyclopean.analysis.limit_analysis.budget import Budget
from cyclopean.analysis.limit_analysis.growing import GrowingModel
from cyclopean.analysis.limit_analysis.solving import solve_limit
from cyclopean.analysis.preparation import prepare
from cyclopean.assembly import Assembly
from cyclopean.design import arch, dome, stack, wall
from cyclopean.statics import plane_system
from limit_cases import rotated, rotation
from own_scale_cases import box

ALONG = Live(push=(1.0, 0.0, 0.0))


def prepared(assembly):
    return prepare(assembly, Settings(mu=0.6))


def loads_of(assembly, live=ALONG, mu=0.6, **settings):
    return GrowingModel.of(prepare(assembly, Settings(mu=mu, **settings)), live).pencil


def tower(ratio):
    """A cube, one of `ratio` of its size on it and one of that of the second on that, centred across."""
    sizes = [1.0, ratio, ratio**2]
    feet = np.cumsum([0.0, *sizes])
    cubes = [
        box(f"cube {k}", (-0.4 * size, -0.5 * size, z), size)
        for k, (size, z) in enumerate(zip(sizes, feet, strict=False))
    ]
    return Assembly([box("ground", (-1.0, -1.0, -1.0), (3.0, 2.0, 1.0), True), *cubes])


@pytest.mark.parametrize("model", [wall(5, 6), arch(9, thickness=1.2), stack(3, offset=0.05), tower(0.1)])
def test_bounds_in_the_plane_are_those_of_the_whole(model):
    loads = loads_of(model)
    plane = plane_system(loads.system, loads.q)
    assert plane is not None
    assert 2 * plane.system.points == loads.system.points
    flat, whole = solve_limit(loads), solve_limit(loads, "interior")
    assert flat.word == whole.word == "limit"
    assert flat.lower == pytest.approx(whole.lower, rel=1e-6)
    assert flat.upper == pytest.approx(whole.upper, rel=1e-6)
    assert loads.balance(flat.f, flat.lower) <= 2e-10


def test_a_plane_that_leans_is_found_and_has_the_same_limit():
    turn, straight = rotation(40.0), prepared(wall(4, 5)).contacts
    model = replace(wall(4, 5), contacts=straight)
    down, push = (tuple((turn @ np.array(v)).tolist()) for v in ([0.0, 0.0, -9.80665], [1.0, 0.0, 0.0]))
    leaning = loads_of(rotated(model, 40.0), Live(push=push), gravity=down)
    plane = plane_system(leaning.system, leaning.q)
    assert plane is not None
    assert np.abs(turn[:, 1] @ plane.turn[1]) == pytest.approx(1.0, abs=1e-12)
    upright = loads_of(model)
    flat, whole = solve_limit(leaning).lower * leaning.unit, solve_limit(upright, "interior").lower * upright.unit
    assert flat == pytest.approx(whole, rel=1e-6)


@dataclass(frozen=True)
class Asked(Budget):
    """Time that is over when it has been asked for so many times."""

    times: int = 0
    count: list[None] = field(default_factory=list)

    @property
    def over(self):
        self.count.append(None)
        return len(self.count) > self.times


def test_what_is_found_when_time_is_over_is_kept():
    """Every iterate of the search proves forces, those of the plane too."""
    found = solve_limit(loads_of(wall(5, 6)), budget=Asked(1e6, times=12))
    assert found.word == "undecided"
    assert found.lower > 0.0
    assert found.f is not None


def test_forces_and_motions_of_the_plane_are_those_of_the_whole():
    """Any forces there bear what their shares bear on the whole, and any motion opens both sides alike."""
    loads = loads_of(arch(7, thickness=0.3))
    plane, rng = plane_system(loads.system, loads.q), np.random.default_rng(1)
    f, y = rng.normal(size=(plane.system.points, 3)), plane.system.still(rng.normal(size=6 * plane.system.blocks))
    f[:, 2] = 0.0
    there = np.asarray(plane.system.A @ f.ravel())
    assert plane.loads(loads.system.A @ plane.forces(f).ravel()) == pytest.approx(there, abs=1e-12)
    opening = loads.system.gap(plane.motion(y))[:, 0]
    assert opening == pytest.approx(plane.system.gap(y)[plane.place, 0], abs=1e-12)


def test_what_is_not_in_a_plane_is_left_as_it_is():
    assert plane_system((across := loads_of(wall(3, 4), Live(push=(0.0, 1.0, 0.0)))).system, across.q) is None
    assert plane_system(loads_of(dome(3, 8, thickness=0.2)).system) is None
    system = loads_of(wall(3, 4)).system
    high = loads_of(tower(0.01))  # a hair of the cube's size is much of the pebble's
    pebble = high.system
    aside = pebble.arm_a + np.array([0.0, 1e-13, 0.0]), pebble.arm_b + np.array([0.0, 1e-13, 0.0])
    assert plane_system(pebble, high.q) is not None
    assert plane_system(replace(pebble, arm_a=aside[0], arm_b=aside[1]), high.q) is None
    deeper = system.arm_a + np.array([0.0, 1e-6, 0.0]), system.arm_b + np.array([0.0, 1e-6, 0.0])
    assert plane_system(replace(system, arm_a=deeper[0], arm_b=deeper[1])) is None


def test_one_thing_out_of_the_plane_is_enough():
    loads = loads_of(wall(3, 4))
    system = loads.system
    assert plane_system(system, loads.q) is not None
    between = ((system.row_a >= 0) & (system.row_b >= 0))[:, None]
    behind = replace(system, arm_b=system.arm_b + np.where(between, [0.0, 1e-6, 0.0], 0.0))
    head = np.flatnonzero(np.abs(system.frame[:, 0, 0]) > 0.5)[-4:]
    frame, twist = system.frame.copy(), system.p.copy()
    frame[head] = frame[head] @ np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    leaning = replace(system, frame=frame)
    twist[3] += 1e-6
    for other in (behind, leaning, replace(system, p=twist)):
        assert plane_system(other, loads.q) is None
