"""Random structures in the plane: rigid-block equilibrium and limits against HiGHS on equations made in the tests.

By hand: a cube of side 1 on a floor, of friction 0.3, slides under a push of 0.3 g; without friction, of none.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import random_planes
from laws import cases, quick
from oracle import G
from oracle_models import Plane, plane_joints, rectangle
from random_planes import Question, by_highs, judged, programme, question

CASES = 12 if quick() else cases("CYCLOPEAN_LIMIT_CASES", 1000)


def cube(mu: float) -> Question:
    parts = [rectangle((-1.0, -1.0), (2.0, 0.0)), rectangle((0.0, 0.0), (1.0, 1.0))]
    fixed = (True, False)
    joints = plane_joints(parts, fixed, 1e-9, 0.0)
    assert joints
    shape = Plane(tuple(parts), fixed, (2400.0, 2400.0), 1.0, tuple(joints))
    return Question("cube", shape, (mu,), np.array([0.0, -G]), push=np.array([1.0, 0.0]))


@pytest.mark.parametrize("mu", [0.3, 0.0])
def test_a_cube_slides_by_hand(mu: float, tmp_path: Path) -> None:
    word, t = by_highs(programme(cube(mu)))
    assert word == "limit"
    assert t == pytest.approx(mu, abs=1e-12)
    assert judged(cube(mu), tmp_path) == []


def test_a_push_down_has_no_limit_and_a_push_up_lifts_at_one(tmp_path: Path) -> None:
    assert by_highs(programme(replace(cube(0.3), push=np.array([0.0, -1.0]))))[0] == "unbounded"
    assert by_highs(programme(replace(cube(0.3), push=np.array([0.0, 1.0]))))[1] == pytest.approx(1.0)


def test_random_planes(tmp_path: Path) -> None:
    found = {seed: judged(question(seed), tmp_path) for seed in range(CASES)}
    assert not {seed: wrong for seed, wrong in found.items() if wrong}


@pytest.mark.parametrize("seed", [7, 52, 381])
def test_what_was_once_left_undecided(seed: int, tmp_path: Path) -> None:
    """A load on one component or far below the weights beside it that has no limit; a limit of zero."""
    assert judged(question(seed), tmp_path) == []


def test_another_friction_is_told_from_the_right_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = programme(cube(0.30001))
    monkeypatch.setattr(random_planes, "programme", lambda _: other)
    assert len(judged(cube(0.3), tmp_path)) == 1
