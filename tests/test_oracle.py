"""The oracle of the audit against answers by hand, laws, and a programme of another form."""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import Bounds, LinearConstraint, milp

import oracle
from oracle import Allowed, G, Structure
from oracle_models import (
    PLANE_FAMILIES,
    SHARES,
    SPACE_FAMILIES,
    Case,
    Plane,
    Space,
    box,
    convex,
    cut,
    cut_solid,
    drawn,
    dumped,
    loaded,
    plane_joints,
    polygon_mass,
    rectangle,
    solid_mass,
    space_joints,
    space_of,
    structure_of,
)

FIXTURES = Path(os.environ.get("CYCLOPEAN_FIXTURES", Path(__file__).parents[2] / "shared" / "fixtures")) / "audit"
DOWN = np.array([0.0, -G])


def plane(parts: list, fixed: list[bool], mu: float, gravity: np.ndarray = DOWN) -> Structure:
    """Polygons that touch where they touch."""
    parts = [np.array(part, float) for part in parts]
    joints = plane_joints(parts, fixed, 1e-9, 0.0)
    assert joints
    shape = Plane(tuple(parts), tuple(fixed), (2400.0,) * len(parts), 1.0, tuple(joints))
    return structure_of(shape, mu, gravity)


def boxes(solids: list, fixed: list[bool], mu: float, gravity: np.ndarray | None = None) -> Structure:
    """Upright boxes in space."""
    joints = space_joints(solids, fixed, 1e-9, 0.0)
    assert joints
    shape = Space(tuple(solids), tuple(fixed), (2400.0,) * len(solids), tuple(joints))
    return structure_of(shape, mu, np.array([0.0, 0.0, -G]) if gravity is None else gravity)


def leaning(slope: float) -> np.ndarray:
    """Gravity on a slope of this tangent."""
    return G * np.array([slope, -1.0]) / np.hypot(slope, 1.0)


def test_mass_of_parts_is_that_of_the_whole() -> None:
    rng = np.random.default_rng(5)
    whole, solid = rectangle((100.0, 3.0), (102.0, 4.0)), box((100.0, 3.0, -7.0), (102.0, 4.0, -4.0))
    for _ in range(20):
        normal, point = rng.normal(size=3), np.array([101.0, 3.5, -5.5]) + rng.uniform(-0.4, 0.4, 3)
        halves = [polygon_mass(part) for part in cut(whole, point[:2], normal[:2])]
        assert sum(area for area, _ in halves) == pytest.approx(2.0, rel=1e-12)
        assert sum(area * centre for area, centre in halves) == pytest.approx([202.0, 7.0], rel=1e-12)
        pieces = [solid_mass(*part) for part in cut_solid(solid, point, normal)]
        assert sum(volume for volume, _ in pieces) == pytest.approx(6.0, rel=1e-12)
        assert sum(volume * centre for volume, centre in pieces) == pytest.approx([606.0, 21.0, -33.0], rel=1e-12)


def test_where_blocks_touch() -> None:
    parts = [rectangle((0.0, 0.0), (2.0, 1.0)), rectangle((1.5, 1.0), (3.0, 2.0)), rectangle((2.0, 0.0), (3.0, 1.0))]
    found = plane_joints(parts, [False] * 3, 1e-12, 0.1)
    assert found is not None
    assert {(a, b, tuple(n), abs(p - q).max()) for a, b, (p, q), n in found} == {
        (0, 1, (0.0, 1.0), 0.5),
        (0, 2, (1.0, 0.0), 1.0),
        (1, 2, (0.0, -1.0), 1.0),
    }
    assert plane_joints(parts, [False] * 3, 1e-12, 0.6) is None  # a joint of 0.5 is neither one nor none
    assert plane_joints(parts, [True] * 3, 1e-12, 0.1) == []  # supports have no joints of their own
    solids = [box((0, 0, 0), (2, 2, 1)), box((1, 1.5, 1), (3, 3, 2))]
    ((a, b, patch, normal),) = space_joints(solids, [True, False], 1e-12, 0.1)
    assert (a, b, normal.tolist()) == (0, 1, [0.0, 0.0, 1.0])
    assert (patch.min(axis=0).tolist(), patch.max(axis=0).tolist()) == ([1.0, 1.5, 1.0], [2.0, 2.0, 1.0])


@pytest.mark.parametrize("mu", [0.1, 0.4, 0.9])
def test_a_block_on_a_slope_slides_where_the_slope_is_steeper_than_its_friction(mu: float) -> None:
    flat = [rectangle((-5.0, -1.0), (5.0, 0.0)), rectangle((0.0, 0.0), (3.0, 1.0))]
    for share, expected in ((1.0 - 1e-4, "stable"), (1.0, "near"), (1.0 + 1e-4, "unstable")):
        structure = plane(flat, [True, False], mu, leaning(share * mu))
        assert oracle.rbe(structure) == expected
        assert oracle.coupled(structure, Allowed()) == expected
    solids = [box((-5, -5, -1), (5, 5, 0)), box((0, 0, 0), (3, 3, 1))]
    for share, expected in ((0.99, "stable"), (1.01, "unstable")):
        gravity = np.array([0.6 * share * mu, 0.8 * share * mu, -1.0]) * G  # no edge of the cones lies along it
        assert oracle.rbe(boxes(solids, [True, False], mu, gravity)) == expected


@pytest.mark.parametrize("small", [1.0, 1e-2, 1e-4])
def test_a_stone_tips_where_half_of_it_hangs_over(small: float) -> None:
    for over, expected in ((0.5 - 1e-3, "stable"), (0.5, "near"), (0.5 + 1e-3, "unstable")):
        x = 1.0 - (1.0 - over) * small
        parts = [rectangle((-1.0, -1.0), (2.0, 0.0)), rectangle((0.0, 0.0), (1.0, 1.0))]
        stone = rectangle((x, 1.0), (x + small, 1.0 + small))
        assert oracle.rbe(plane([*parts, stone], [True, False, False], 0.5)) == expected
        solids = [box((-1, -1, -1), (2, 2, 0)), box((0, 0, 0), (1, 1, 1))]
        stone_there = box((x, 0.3, 1.0), (x + small, 0.3 + small, 1.0 + small))
        assert oracle.rbe(boxes([*solids, stone_there], [True, False, False], 0.5)) == expected


@pytest.mark.parametrize("small", [1e-1, 1e-2, 1e-4])
def test_pins_far_lighter_than_what_they_carry(small: float) -> None:
    for shift, expected in ((0.0, "stable"), (0.45, "stable"), (0.55, "unstable")):
        feet = [rectangle((x, 0.0), (x + small, small)) for x in (shift, 1.0)]
        parts = [rectangle((-1.0, -1.0), (2.0, 0.0)), *feet, rectangle((0.0, small), (1.0 + small, 1.0 + small))]
        if shift:  # one foot only: the cube stands where its middle is above it
            shift_to = 0.5 * (1.0 + small) + (shift - 0.5) * 2.0 * small - 0.5 * small
            parts[1:3] = [rectangle((shift_to, 0.0), (shift_to + small, small))]
            expected = "stable" if abs(shift_to + 0.5 * small - 0.5 * (1.0 + small)) < 0.5 * small else "unstable"
        assert oracle.rbe(plane(parts, [True, *[False] * (len(parts) - 1)], 0.5)) == expected


def test_without_friction_a_pin_under_a_load_far_above_its_weight_is_near() -> None:
    """A file's last digits lean it by 1e-13, and 1e9 of its own weight press it: it is pushed out, or it is not."""
    feet = [rectangle((x, 0.0), (x + 1e-3, 1e-3)) for x in (0.0, 1.0)]
    parts = [rectangle((-1.0, -1.0), (2.0, 0.0)), *feet, rectangle((0.0, 1e-3), (1.001, 1000.0))]
    pinned = replace(plane(parts, [True, False, False, False], 0.0), rounding=2e-16)
    alone = replace(plane([parts[0], rectangle((0.0, 0.0), (1.0, 1.0))], [True, False], 0.0), rounding=2e-16)
    assert oracle.rbe(alone) == "stable"
    assert oracle.rbe(pinned) == "near"
    assert oracle.rbe(replace(pinned, rounding=0.0)) == "stable"
    assert oracle.rbe(replace(pinned, mu=0.1)) == "stable"


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.6])
@pytest.mark.parametrize("slender", [0.25, 2.0])
def test_a_pushed_block_slides_or_tips(mu: float, slender: float) -> None:
    parts = [rectangle((-5.0, -1.0), (5.0, 0.0)), rectangle((0.0, 0.0), (slender, 1.0))]
    found = oracle.limit(plane(parts, [True, False], mu), np.array([1.0, 0.0]))
    assert found.word == "limit"
    assert found.lower <= min(mu, slender) <= found.upper
    assert found.upper - found.lower <= 1e-5
    solids = [box((-5, -5, -1), (5, 5, 0)), box((0, 0, 0), (slender, 1, 1))]
    around = oracle.limit(boxes(solids, [True, False], mu), np.array([1.0, 0.0, 0.0]))
    assert around.lower <= min(mu, slender) <= around.upper
    assert around.upper - around.lower <= 2e-3


def test_pushes_that_nothing_resists_or_everything() -> None:
    parts = [rectangle((-5.0, -1.0), (5.0, 0.0)), rectangle((0.0, 0.0), (1.0, 1.0))]
    structure = plane(parts, [True, False], 0.5)
    assert oracle.limit(structure, np.array([0.0, -1.0])).word == "unbounded"
    assert oracle.limit(structure, np.array([0.4, -1.0])).word == "unbounded"
    lifted = oracle.limit(structure, np.array([0.0, 1.0]))
    assert lifted.lower <= 1.0 <= lifted.upper <= 1.0 + 1e-5
    assert oracle.limit(plane(parts, [True, False], 0.5, leaning(0.6)), np.array([0.0, -1.0])).word == "falls"


def test_the_upright_frame_by_hand() -> None:
    """A beam, half-length a and height h, between upright supports: mu >= h / a, 4 (a / h) eps + beta <= eta."""
    for slender, mu, eta, rigid, coupled in (
        (2.0, 0.501, 10.0, "stable", "stable"),  # 8.01 <= 10
        (2.0, 0.499, 10.0, "stable", "unstable"),
        (3.0, 0.9, 10.0, "stable", "unstable"),  # 12.01 > 10
        (3.0, 0.9, 12.02, "stable", "stable"),
        (3.0, 0.9, 12.0, "stable", "unstable"),
    ):
        parts = [
            rectangle((-slender - 1.0, -1.0), (-slender, 2.0)),
            rectangle((-slender, 0.0), (slender, 1.0)),
            rectangle((slender, -1.0), (slender + 1.0, 2.0)),
        ]
        structure = plane(parts, [True, False, True], mu)
        assert oracle.rbe(structure) == rigid
        assert oracle.coupled(structure, Allowed(eta)) == coupled


def test_groups_that_do_not_touch_are_judged_apart() -> None:
    floor = rectangle((-5.0, -1.0), (5.0, 0.0))
    parts = [floor, rectangle((-2.0, 0.0), (-1.0, 1.0)), rectangle((1.0, 0.0), (2.0, 1.0))]
    structure = plane(parts, [True, False, False], 0.5)
    assert sorted(oracle.components(structure)) == [(1,), (2,)]
    parts[2] = parts[2] + [3.6, 0.0]  # 60 % of it hangs over
    assert oracle.rbe(plane(parts, [True, False, False], 0.5)) == "unstable"


def test_forces_and_motions_that_prove_nothing_are_not_believed() -> None:
    parts = [
        rectangle((-5.0, -1.0), (5.0, 0.0)),
        rectangle((0.0, 0.0), (1.0, 1.0)),
        rectangle((0.3, 1.0), (0.31, 1.01)),
    ]
    structure = plane(parts, [True, False, False], 0.5)
    eq = oracle.equations(structure, (1, 2))
    word, f = oracle.held(eq, eq.p)
    assert word == "yes"
    assert f is not None
    assert oracle.balanced(eq, eq.p, f)
    pebble = eq.column < 1e-3 * eq.column.max()
    assert not oracle.balanced(eq, eq.p, f * np.where(pebble, 1.0 + 1e-6, 1.0))  # 1e-10 of the weight of all
    assert not oracle.balanced(eq, eq.p, f - 2.0 * f.max() * np.eye(len(f))[0])
    up = np.array([0.0, -1.0, 0.0, 0.0, -1.0, 0.0])  # both go down into the floor
    assert oracle.falling(eq, eq.p, up) is None


def by_integers(structure: Structure, allowed: Allowed, bound: float = 1e3) -> str:
    """Coupled analysis by one mixed-integer programme, forces up to `bound` weights: good where sizes are alike."""
    (blocks,) = oracle.components(structure)
    eq = oracle.equations(structure, blocks, normals=True)
    normal, slide = oracle.gaps(structure, blocks)
    (q, m), c = normal.shape, len(eq.column)
    at = np.eye(q)[eq.point]
    which = [np.where(eq.kind == kind, 1.0, 0.0) for kind in (0, 1, -1)]
    eta, beta = allowed.eta, allowed.beta
    force, motion, none = np.zeros((q, c)), np.zeros((c, m)), np.zeros((q, q))
    eye = np.eye(q)
    unit = eq.total / len(blocks)
    rows = [
        (np.hstack([eq.scaled() * unit / eq.column, np.zeros((len(eq.p), m + 3 * q))]), -eq.p / eq.row, -eq.p / eq.row),
        (np.hstack([force, normal, none, none, none]), -1.0, np.inf),
        (np.hstack([force, normal, (1.0 + eta) * eye, none, none]), -np.inf, eta),
        (np.hstack([force, slide, none, (eta + beta) * eye, none]), -np.inf, eta),
        (np.hstack([force, slide, none, none, -(eta + beta) * eye]), -eta, np.inf),
        (np.hstack([force, np.zeros((q, m)), -eye, eye, eye]), -np.inf, 0.0),
    ]
    for k, group in enumerate(which):
        switch = [np.zeros((c, q))] * 3
        switch[k] = -bound * at * group[:, None]
        rows.append((np.hstack([np.diag(group), motion, *switch]), -np.inf, 0.0))
    height = [len(row) for row, _, _ in rows]
    low = np.concatenate(
        [np.broadcast_to(np.asarray(low, float), n) for (_, low, _), n in zip(rows, height, strict=True)]
    )
    high = np.concatenate(
        [np.broadcast_to(np.asarray(high, float), n) for (*_, high), n in zip(rows, height, strict=True)]
    )
    found = milp(
        np.concatenate([np.ones(c), np.zeros(m + 3 * q)]),
        integrality=np.concatenate([np.zeros(c + m), np.ones(3 * q)]),
        bounds=Bounds(
            np.concatenate([np.zeros(c), np.full(m, -np.inf), np.zeros(3 * q)]),
            np.concatenate([np.full(c + m, np.inf), np.ones(3 * q)]),
        ),
        constraints=LinearConstraint(np.vstack([row for row, _, _ in rows]), low, high),
        options={"mip_rel_gap": 1.0, "node_limit": 3000},
    )
    return "stable" if found.x is not None else {2: "unstable"}.get(found.status, "near")


def test_the_tree_of_patterns_and_whole_numbers_say_the_same() -> None:
    said: dict[str, int] = {}
    for family in ("squeezed", "wedge", "fan", "cut"):
        for seed in range(12):
            case = drawn("cra", seed, family)
            structure = case.structure()
            sizes = [body.size for body in structure.bodies if not body.fixed]
            points = sum(len(joint.point) for joint in structure.joints)
            if points > 8 or max(sizes) > 20.0 * min(sizes) or len(oracle.components(structure)) > 1:
                continue
            allowed = Allowed(case.eta, case.beta)
            word = oracle.coupled(structure, allowed)
            other = by_integers(structure, allowed)
            if "near" not in (word, other):
                assert word == other, (family, seed)
                said[word] = said.get(word, 0) + 1
    assert min(said["stable"], said["unstable"]) >= 4


def test_answers_do_not_depend_on_scale_place_or_order() -> None:
    for seed in range(25):
        case = drawn("rbe", seed)
        structure = case.structure()
        expected = oracle.rbe(structure)
        order = np.random.default_rng(seed).permutation(len(structure.bodies))
        number = {int(old): new for new, old in enumerate(order)}
        moved = Structure(
            tuple(
                replace(b, centre=100.0 * b.centre + 7.0, size=100.0 * b.size, weight=1e6 * b.weight)
                for b in (structure.bodies[i] for i in order)
            ),
            tuple(
                replace(j, a=number[j.b], b=number[j.a], normal=-j.normal, point=100.0 * j.point + 7.0)
                for j in structure.joints
            ),
            structure.mu,
            structure.gravity,
        )
        assert oracle.rbe(moved) == expected


# --- cases -----------------------------------------------------------------------------------------------------------


def test_every_family_is_drawn_and_sizes_are_mixed() -> None:
    for kind, shares in SHARES.items():
        assert sum(shares.values()) == pytest.approx(1.0)
        assert set(shares) <= {*PLANE_FAMILIES, *SPACE_FAMILIES}
        for family in shares:
            case = drawn(kind, 3, family)
            assert case.family == family
            assert any(not fixed for fixed in case.shape.fixed)
            assert case.shape.__class__ is Space or all(map(convex, case.shape.parts))
    ratios = []
    for seed in range(60):
        weights = [b.weight for b in drawn("rbe", seed).structure().bodies if not b.fixed]
        ratios.append(max(weights) / min(weights))
    assert np.mean(np.array(ratios) > 100.0) > 1 / 3


def test_a_part_that_crosses_or_winds_about_itself_is_none() -> None:
    square = rectangle((0.0, 0.0), (1.0, 1.0))
    assert convex(square)
    assert convex(np.insert(square, 1, [0.5, 0.0], axis=0))  # a corner along a side
    assert not convex(square[::-1])
    assert not convex(square[[0, 2, 1, 3]])
    assert not convex(np.insert(square, 1, [0.5, 0.2], axis=0))
    assert not convex(np.concatenate([square, square]))


def same(a: Case, b: Case) -> bool:
    return json.dumps(dumped(a)) == json.dumps(dumped(b))


def test_a_case_survives_its_file_and_a_seed_is_one_case() -> None:
    for kind, seed in (("rbe", 0), ("rbe", 7), ("cra", 1), ("limit", 2), ("rbe", 32)):
        case = drawn(kind, seed)
        back = loaded(json.loads(json.dumps(dumped(case))))
        assert same(case, back)
        assert same(case, drawn(kind, seed))
        assert not same(case, drawn(kind, seed + 1))


@pytest.fixture(scope="module")
def folder() -> Path:
    if not FIXTURES.is_dir():
        pytest.skip("no fixtures: set CYCLOPEAN_FIXTURES to the folder that holds audit/")
    return FIXTURES


def test_fixtures_as_their_readme_says(folder: Path) -> None:
    def read(name: str, mu: float) -> Structure:
        shape = space_of(json.loads((folder / f"{name}.json").read_text()))
        return structure_of(shape, mu, np.array([0.0, 0.0, -G]))

    for size in ("0.05", "0.3", "1.0"):
        assert oracle.rbe(read(f"tip_ratio_{size}", 0.84)) == "unstable"
    assert oracle.rbe(read("pinning_0.02", 0.84)) == "unstable"
    assert oracle.rbe(read("pebble_on_slope_edge", 0.84)) == "stable"
    for size in ("0.001", "0.02"):
        found = oracle.limit(read(f"limit_mixed_1_{size}", 0.7), np.array([1.0, 0.0, 0.0]))
        assert found.lower <= 0.25 <= found.upper <= 0.25 + 1e-6


def test_cases_of_the_fixtures_are_read_and_answered(folder: Path) -> None:
    def read(name: str) -> Case:
        return loaded(json.loads((folder / f"undecided_{name}.json").read_text()))

    case = read("c3_210")
    assert oracle.coupled(case.structure(), Allowed(case.eta, case.beta)) == "unstable"
    assert oracle.rbe(read("d2_37").structure()) == "unstable"
    assert oracle.limit(read("l2_110").structure(), read("l2_110").push).word == "unbounded"
    found = oracle.limit(read("l2_32").structure(), read("l2_32").push)
    assert found.lower - 1e-12 <= 1.106233642993749 <= found.upper + 1e-12 <= 1.1062346
