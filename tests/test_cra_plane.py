"""Plane models against an exact integer programme, and models in space against another seed of the restarts.

What the alternation or the tree says of blocks in one plane must be what the integer programme says, both where its
bounds are a hair wider and where they are narrower; a state is measured, and a tree walked from its root again. Set
CYCLOPEAN_PLANE_CASES to run more.

By hand (see `coupled_cases`): one block of length 1 and height h between upright walls stands if and only if
mu >= 2 h and 2 / h + beta_min <= eta, in units where eps = 1.
"""

from dataclasses import replace

import numpy as np
import pytest

from coupled_cases import coupled_case
from cyclopean.analysis import Settings
from cyclopean.analysis.coupled.alternation import alternation
from cyclopean.analysis.coupled.branches import Split
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.analysis.coupled.tree import refute
from cyclopean.analysis.preparation import prepare
from laws import cases
from plane_cases import PlaneCase, has_state, in_a_row, plane_case, tree_holds

CASES = cases("CYCLOPEAN_PLANE_CASES", 120)
PROGRAMMES, NODES = 60, 300


def answered(case: PlaneCase) -> str:
    """By alternation, then by the tree; whatever they claim is looked at again."""
    found = alternation(case.system, case.bounds, budget=PROGRAMMES)
    answer = None if found.found else refute(case.system, case.bounds, NODES)
    if answer is None or answer.word == "coupled":
        best = found if answer is None else answer.best
        assert measure(case.system, case.bounds, best.f, best.dq).accepted
        return "coupled"
    if answer.root is not None:
        assert tree_holds(case.system, case.bounds, answer.root)
    return answer.word


@pytest.mark.parametrize("first", range(0, CASES, 10))
def test_no_plane_model_contradicts_the_integer_programme(first: int) -> None:
    for seed in range(first, min(first + 10, CASES)):
        case = plane_case(seed)
        word = answered(case)
        if word == "coupled":
            assert has_state(case, outer=True), seed
        if word == "refuted":
            assert not has_state(case, outer=False), seed


@pytest.mark.parametrize(
    ("mu", "height", "eta", "stands"),
    [
        (0.594, 0.3, 10.0, False),
        (0.606, 0.3, 10.0, True),
        (0.99, 0.5, 10.0, False),
        (1.01, 0.5, 10.0, True),
        (0.84, 0.3, 2.0 / 0.3 - 0.04, False),
        (0.84, 0.3, 2.0 / 0.3 + 0.06, True),
    ],
)
def test_one_block_between_walls_by_hand(mu: float, height: float, eta: float, stands: bool) -> None:
    at = np.array([0.0, 1.0])
    case = in_a_row(at, at, height, mu, Bounds(1.0, eta, 0.01))
    assert [has_state(case, outer) for outer in (True, False)] == [stands, stands]
    assert answered(case) == ("coupled" if stands else "refuted")


def test_a_tree_with_a_wrong_part_does_not_hold() -> None:
    for seed in range(50):
        case = plane_case(seed)
        answer = refute(case.system, case.bounds, NODES)
        if isinstance(answer.root, Split) and answer.root.rays is None:
            wrong = replace(answer.root, parts=answer.root.parts[::-1])
            assert not tree_holds(case.system, case.bounds, wrong)
            return
    raise AssertionError("no tree with a split")


@pytest.mark.parametrize("seed", range(0, 40, 5))
def test_another_seed_of_the_restarts_contradicts_nothing(seed: int) -> None:
    case = coupled_case(seed)
    asked = Settings(method="cra", mu=case.mu, gravity=case.gravity)
    system, bounds = prepare(case.assembly, asked).system(), asked.bounds()
    refuted = refute(system, bounds, 60).word == "refuted"
    for walk in (1, 2):
        assert not (refuted and alternation(system, bounds, budget=40, seed=walk).found)
