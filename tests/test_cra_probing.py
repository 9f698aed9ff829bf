"""Trees of forced points, points that move alike, and brackets proved from above: against an exact integer programme.

Walls of a few stones in one plane, held in it, pushed at random: what `check` says of them with a certificate must be
what the integer programme says that tries all combinations of pressing and sliding at all points.
"""

import copy
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from cyclopean.analysis import Live, Settings, check, coupled_bracket, limit
from cyclopean.analysis.coupled import leaves, search
from cyclopean.analysis.coupled.branches import moving_alike
from cyclopean.analysis.coupled.leaves import prior
from cyclopean.analysis.coupled.probing import refute_by_probing
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.analysis.equilibrium.components import with_points
from cyclopean.analysis.limit_analysis.bracket import multiplied
from cyclopean.analysis.preparation import prepare
from cyclopean.assembly import Assembly
from cyclopean.proof import seal, verify
from laws import cases
from plane_cases import PlaneCase, has_state, plane_case, tree_holds
from sequence_cases import box

CASES = cases("CYCLOPEAN_PLANE_CASES", 40)
PUSH = Live(push=(1.0, 0.0, 0.0))
IN_PLANE = ("y", "rx", "rz")


def wall(seed: int) -> Assembly:
    """Two courses of one to three stones each on a ground, with the same ends, held in their plane."""
    rng = np.random.default_rng([seed, 23])
    high, long = rng.uniform(0.1, 0.5), rng.uniform(0.4, 1.2)
    blocks = [box("ground", (-3.0, 3.0), (-0.2, 0.0), fixed=True)]
    for course in range(2):
        cuts = np.linspace(0.0, long, int(rng.integers(2, 5)))
        cuts[1:-1] += rng.uniform(-0.05, 0.05, len(cuts) - 2)
        for i, ends in enumerate(pairwise(cuts.tolist())):
            blocks.append(box(f"c{course}-{i}", ends, (course * high, (course + 1) * high)))
    return Assembly(tuple(b if b.fixed else replace(b, held=IN_PLANE) for b in blocks))


def in_plane(system) -> PlaneCase:
    """One point for all that move alike, with tangents in the plane and across it."""
    system = with_points(system, np.unique(moving_alike(system)))
    across = np.array([0.0, 1.0, 0.0])
    frame = np.stack([system.frame[:, 0], np.cross(across, system.frame[:, 0]), np.tile(across, (system.points, 1))], 1)
    turn = np.einsum("qij,qkj->qik", system.frame, frame)  # columns of A in the old frame to those in the new
    columns = system.A.toarray().reshape(-1, system.points, 3)
    matrix = np.einsum("rqi,qik->rqk", columns, turn).reshape(len(system.p), -1)
    return PlaneCase(replace(system, frame=frame, A=type(system.A)(matrix)), 0, Bounds())


def asked(seed: int):
    """A wall, pushed somewhere between nothing and its limit, most near it: the model, its settings and case."""
    model, rng = wall(seed), np.random.default_rng([seed, 29])
    mu = float(rng.uniform(0.3, 0.8))
    found = limit(model, PUSH, Settings(mu=mu))
    model, t = replace(model, contacts=found.contacts), float((found.lower or 0.0) * (1.0 - 0.1 * rng.random() ** 2))
    pushed = multiplied(model, PUSH, Settings(mu=mu), t)
    return *pushed, in_plane(prepare(*pushed).system())


@pytest.mark.parametrize("first", range(0, CASES, 10))
def test_no_wall_contradicts_the_integer_programme(first: int, monkeypatch) -> None:
    monkeypatch.setattr(search, "TREE_POINTS", 0)  # as larger models are asked
    for seed in range(first, first + 10):
        model, settings, case = asked(seed)
        found = check(model, settings)
        if found.verdict == "stable":
            assert has_state(case, outer=True), seed
        if found.verdict == "unstable":
            assert not has_state(case, outer=False), seed


@pytest.mark.parametrize("first", range(0, CASES, 10))
def test_no_plane_model_contradicts_the_integer_programme(first: int) -> None:
    for seed in range(first, first + 10):
        case = plane_case(seed)
        word = probed(case)
        if word == "coupled":
            assert has_state(case, outer=True), seed
        if word == "refuted":
            assert not has_state(case, outer=False), seed


def probed(case: PlaneCase) -> str:
    """Whatever is claimed is looked at again."""
    answer = refute_by_probing(case.system, case.bounds, 150, np.inf, prior(case.system, case.bounds))
    assert answer.word != "coupled" or measure(case.system, case.bounds, answer.best.f, answer.best.dq).accepted
    assert answer.root is None or tree_holds(case.system, case.bounds, answer.root)
    return answer.word


def test_the_integer_programme_would_see_friction_forgotten(monkeypatch) -> None:
    monkeypatch.setattr(leaves.Cell, "friction", lambda cell, system, bounds: np.zeros(system.points))
    found = [seed for seed in range(12) if probed(plane_case(seed)) == "refuted"]
    assert any(has_state(plane_case(seed), outer=False) for seed in found)


@pytest.fixture(scope="module")
def refuted():
    """The certificate of a wall without a state at this push, though forces alone balance it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "TREE_POINTS", 0)
        return check(*asked(8)[:2]).certificate


def test_a_tree_of_points_that_move_alike_needs_blocks_that_are_held(refuted) -> None:
    assert verify(refuted).proved
    for kept in (["y"], ["y", "rx"], ["y", "rz"], ["y", "rx", "ry"]):  # about y alone may they turn
        loose = copy.deepcopy(refuted)
        for block in loose["blocks"]:
            if "held" in block:
                block["held"] = kept
        loose["seal"] = seal(loose)
        assert not verify(loose).proved, kept


def test_no_friction_only_below_beta_min(refuted) -> None:
    splits, pending = [], [refuted["tree"]]
    while pending:
        node = pending.pop()
        splits += [node] if "speed" in node else []
        pending += [x for x in node.values() if isinstance(x, dict)] + list(node.get("sectors", []))
    assert splits
    assert all(node["speed"] < refuted["beta_min"] for node in splits)
    for node in splits:
        node["speed"] = float(np.nextafter(refuted["beta_min"], 0.0))
    refuted["seal"] = seal(refuted)
    assert verify(refuted).proved
    for node in splits:
        node["speed"] = refuted["beta_min"]
    refuted["seal"] = seal(refuted)
    assert not verify(refuted).proved


def test_a_bracket_is_proved_on_both_sides() -> None:
    model, settings = wall(8), Settings(mu=asked(8)[1].mu)
    found = limit(model, PUSH, settings)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "TREE_POINTS", 0)
        bracket = coupled_bracket(model, found, settings)
    said = dict(bracket.trials)
    assert said[bracket.stands] == "stable"
    assert said[bracket.falls] == "unstable"
    assert 0.0 < bracket.stands < bracket.falls < found.lower
    assert bracket.falls - bracket.stands < 0.02 * found.lower
    for t, outer in ((bracket.stands, True), (bracket.falls, False)):
        case = in_plane(prepare(*multiplied(replace(model, contacts=found.contacts), PUSH, settings, t)).system())
        assert has_state(case, outer=outer) is outer


def test_points_move_alike_only_where_nothing_turns_them_apart() -> None:
    def groups(held: tuple[str, ...]) -> int:
        model = Assembly((box("ground", (-1.0, 1.0), (-1.0, 0.0), fixed=True), box("cube", (0.0, 1.0), (0.0, 1.0))))
        cube = replace(model.blocks[1], held=held) if held else model.blocks[1]
        return len(set(moving_alike(prepare(replace(model, blocks=(model.blocks[0], cube)), Settings()).system())))

    assert [groups(held) for held in ((), ("y", "rx"), IN_PLANE, ("rx", "ry", "rz"), ("rx", "ry"))] == [4, 4, 2, 1, 4]
