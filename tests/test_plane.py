"""Structures in the plane, solved there: the same bounds as of the whole."""

from dataclasses import replace

import numpy as np
import pytest

from cyclopean.analysis import Live, Settings
from cyclopean.analysis.limit_analysis.growing import GrowingModel
from cyclopean.analysis.limit_analysis.solving import solve_limit
from cyclopean.analysis.preparation import prepare
from cyclopean.design import arch, dome, stack, wall
from cyclopean.statics import plane_system

ALONG = Live(push=(1.0, 0.0, 0.0))


def loads_of(assembly, live=ALONG, mu=0.6):
    return GrowingModel.of(prepare(assembly, Settings(mu=mu)), live).pencil


@pytest.mark.parametrize("model", [wall(5, 6), arch(9, thickness=1.2), stack(3, offset=0.05)])
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
    deeper = system.arm_a + np.array([0.0, 1e-6, 0.0]), system.arm_b + np.array([0.0, 1e-6, 0.0])
    assert plane_system(replace(system, arm_a=deeper[0], arm_b=deeper[1])) is None
