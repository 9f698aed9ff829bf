"""Forgeries in limits, coupled states, trees and settlements: each component, and each stone, at its own scale."""

import copy
import math

import pytest

from cyclopean.proof import verify
from cyclopean.proof.checker import EXACT, NEARLY
from test_proof_checker import (
    BASE,
    CUBE,
    GROUND,
    RHO,
    G,
    W,
    box,
    contact,
    cube_on_ground,
    cube_on_slope,
    level,
    sealed,
    state,
)
from test_proof_cra_state import coupled
from test_proof_cra_state import sliding as coupled_slide
from test_proof_cra_tree import falls_over, frame, virtual_work
from test_proof_cra_tree import tree as tree_of

STILL = [0.0] * 6


def push(x=0.0, y=0.0, z=0.0, loads=()):
    return {"gravity": [x, y, z], "loads": list(loads)}


def limit(model, live, **proof):
    """Make bounds of a multiplier of a state: `lower` with its forces, or `upper`."""
    rest = {k: v for k, v in model.items() if k != "forces" or "lower" in proof}
    return sealed({**copy.deepcopy(rest), "kind": "limit-bounds", "live": live, **proof})


# --- limits ----------------------------------------------------------------------------------------------------------


def shoved(multiplier, size=2.0**-10):
    """A stone of `size` x `size` x 4 `size` beside a unit cube, mu 0.75, both pushed by `multiplier` of their weights.

    The corners of the cube bear (1 -+ multiplier) W / 4, it could slide at 0.75. The stone tips at 1/4: of its moment
    over the edge that bears all of its weight w, (4 multiplier - 1) / 2 w size is left.
    """
    ups = [W / 4 * (1 + s * multiplier) for s in (-1, 1, 1, -1)]
    ups += [4 * size**3 * W / 2 * k for k in (0, 1, 1, 0)]
    thin = box("thin", [2, 0, 0], [2 + size, size, 4 * size])
    joints = [
        contact("ground", "cube", BASE["polygon"], 0.75),
        contact("ground", "thin", level(2, 0, 2 + size, size), 0.75),
    ]
    model = state([GROUND, CUBE, thin], joints, [[-multiplier * up, 0, up] for up in ups], tolerance=1e-9)
    return limit(model, push(G), lower=multiplier)


def test_the_slender_stone_decides_however_small_it_is():
    assert verify(shoved(0.25)).proved
    for multiplier in (0.26, 0.7):
        report = verify(shoved(multiplier))
        assert "block thin: its moments do not balance" in report.reason
        assert report.figures["equilibrium_moment"] == pytest.approx((4 * multiplier - 1) / 2 / math.sqrt(18), rel=1e-9)


def falling_beside(hindered, load):
    """One cube overhangs by 1/8 and tips, +x; another one, apart, may rise. Live loads on either."""
    ledge = box("ledge", [-4, -4, -1], [-0.125, 4, 0], fixed=True)
    joint = contact("ledge", "cube", level(-0.5, -0.5, -0.125, 0.5))
    other, yard = box("other", [10, 0, 0], [11, 1, 1]), box("yard", [9, -1, -1], [12, 2, 0], fixed=True)
    beside = contact("yard", "other", level(10, 0, 11, 1))
    model = state([ledge, CUBE, yard, other], [joint, beside], [[0, 0, 0]] * 8)
    loads = [{"block": "cube", "force": [hindered, 0, 0], "point": [0, 0, 1]}] if hindered else []
    loads += [{"block": "other", "force": [0, 0, load], "point": [10.5, 0.5, 0]}] if load else []
    motion = {"cube": [0.5, 0, -0.125, 0, 1, 0], "other": [0, 0, 1.0, 0, 0, 0]}
    return limit(model, push(loads=loads), upper=0.0, mechanism=motion)


def test_live_loads_may_not_hinder_the_component_that_falls():
    assert verify(falling_beside(0.0, 0.0)).proved
    assert verify(falling_beside(1.0, 0.0)).proved
    assert verify(falling_beside(1.0, -100.0)).proved, "what hinders the other one is no matter"
    for other in (0.0, 100.0, 1e9):  # nor is what helps the other one, that does not fall at 0
        assert not verify(falling_beside(-1.0, other)).proved
    assert "against the motion" in verify(falling_beside(-1.0, 0.0)).reason


def test_live_loads_have_to_do_the_work_where_it_falls():
    """The other cube is lifted with much work. The first creeps along its ledge while it tips; its live load does
    something, but less than what friction may take up of more of it.
    """
    certificate = falling_beside(0.0, 1e9)
    certificate["mechanism"]["cube"] = [0.5 - 1e-9, 0, -0.125 - 1e-9, 0, 1, 0]
    assert verify(sealed(certificate)).proved
    certificate["live"]["loads"].append({"block": "cube", "force": [-1.0, 0, 0], "point": [-0.125, 0, 0]})
    assert "too little work" in verify(sealed(certificate)).reason


# --- limits that there are not ---------------------------------------------------------------------------------------

WALL = box("wall", [0.5, -4, 0], [1.5, 4, 4], fixed=True)
SIDE = [[0.5, -0.5, 0], [0.5, 0.5, 0], [0.5, 0.5, 1], [0.5, -0.5, 1]]


def against_a_wall(recession, live=None, mu=0.5, **more):
    """A cube on the ground, pushed against a wall by its own weight at a multiplier of 1: W / 4 at each corner."""
    ground = box("ground", [-4, -4, -1], [0.5, 4, 0], fixed=True)
    joints = [contact("ground", "cube", BASE["polygon"], mu), contact("cube", "wall", SIDE, mu)]
    single = [[W / 8]] * 4 + [[0]] * 4
    forces = [[0, 0, W / 4]] * 4 + [[0, 0, 0]] * 4 if mu else single
    model = state([ground, CUBE, WALL], joints, forces)
    return limit(model, live or push(G), lower=0.0, recession=recession, **more)


def pressing(x, along=0.0):
    """At the wall the cube presses with `x` W at each corner; friction of `along` of that adds up to nothing."""
    return [[0, 0, 0]] * 4 + [[x * W, s * along * x * W, 0] for s in (1, -1, 1, -1)]


def test_a_wall_holds_any_push():
    report = verify(against_a_wall(pressing(0.25)))
    assert report.proved, report.reason
    assert "forces hold it at 0 and at every larger one; every block balances exactly" in report.claim
    assert "so do forces that balance the live loads alone" in report.reason
    assert verify(against_a_wall(pressing(0.25 * (1 - 5e-10)))).claim.endswith(EXACT), "corrected"
    assert "do not balance" in verify(against_a_wall(pressing(0.2))).reason
    smooth = verify(against_a_wall([[0]] * 4 + [[W / 8]] * 4, mu=0.0))
    assert smooth.claim.endswith(EXACT)


@pytest.mark.parametrize(
    ("recession", "live", "reason"),
    [
        (pressing(-0.25), None, "the recession at point 0 pulls"),
        (pressing(0.25, 0.51), None, "the recession at point 0 leaves the friction cone"),
        (pressing(0.25), push(-G), "do not balance"),
        (pressing(0.25), push(G, 0, 2 * G), "do not balance"),
        (pressing(0.0), None, "do not balance"),
        (pressing(0.25 * (1 + 1.1e-9), 0.5), None, "do not balance"),
        (pressing(1e6), None, "larger than 1e+06 times"),
        (pressing(0.25)[:7], None, "7 recessions for 8 contact points"),
        ([[W / 8]] * 8, None, "1 numbers instead of 3 or 6"),
    ],
)
def test_recessions_that_hold_nothing(recession, live, reason):
    assert reason in verify(against_a_wall(recession, live)).reason


def test_a_recession_of_the_second_grade_is_told():
    report = verify(against_a_wall(pressing(0.25 * (1 + 0.9e-9), 0.5 * (1 - 1e-15))))
    assert report.proved
    assert report.claim.endswith(NEARLY + " (of the live loads, for each unit of their multiplier)")
    assert report.figures["equilibrium_force"] == pytest.approx(0.9e-9, rel=1e-6)
    assert report.figures["exact"] == 0


def test_a_recession_goes_with_a_lower_side_only():
    good = pressing(0.25)
    assert "unknown field: upper" in verify(against_a_wall(good, upper=1.0)).reason
    assert "unknown field: mechanism" in verify(against_a_wall(good, mechanism={"cube": STILL})).reason
    without = {k: v for k, v in against_a_wall(good).items() if k not in ("lower", "forces")}
    assert "fields missing: forces, lower" in verify(sealed(without)).reason


def test_a_recession_does_not_count_what_joints_pull():
    """The joint below holds a pull of 1e5 N or more: less than 0.01 W upward at any one multiplier, and not at all."""
    lift = push(loads=[{"block": "cube", "force": [0, 0, W / 100], "point": [0, 0, 0.5]}])
    for joint in ({}, {"tension": 1e5}):
        model = state([GROUND, CUBE], [BASE | joint], [[0, 0, W / 4]] * 4)
        for recession in ([[0, 0, W / 1e5]] * 4, [[0, 0, -W / 400]] * 4, [[0, 0, 0]] * 4):
            assert not verify(limit(model, lift, lower=0.0, recession=recession)).proved
    down = push(loads=[{"block": "cube", "force": [0, 0, -W / 100], "point": [0, 0, 0.5]}])
    for extra in (5e-10, -5e-10):
        recession = [[0, 0, W / 400 * (1 + extra)]] * 4
        assert verify(limit(model, down, lower=0.0, recession=recession)).claim.endswith(EXACT)


@pytest.mark.parametrize("share", [1e-3, 1e-10, 1e-20])
def test_live_loads_that_are_small_have_to_balance_too(share):
    """Any multiple of them has to: a push sideways of 1e-10 W is balanced by nothing to 1e-9 of the weight."""
    side = push(loads=[{"block": "cube", "force": [share * W, 0, 0], "point": [0, 0, 0.5]}])
    model = state([GROUND, CUBE], [BASE], [[0, 0, W / 4]] * 4)
    assert "do not balance" in verify(limit(model, side, lower=0.0, recession=[[0, 0, 0]] * 4)).reason
    heavy = {"block": "cube", "force": [0, 0, -W], "point": [0, 0, 0.5]}
    side["loads"].append(heavy)
    recession = [[0, s * W / 8, W / 4] for s in (1, 1, -1, -1)]
    assert verify(limit(model, side, lower=0.0, recession=recession)).proved is False
    only = push(loads=[heavy])
    assert verify(limit(model, only, lower=0.0, recession=recession)).proved


def test_live_weights_are_measured_by_themselves():
    """A push sideways by 1e-10 of the weight, that nothing balances."""
    model = state([GROUND, CUBE], [BASE], [[0, 0, W / 4]] * 4)
    assert not verify(limit(model, push(1e-10 * G), lower=0.0, recession=[[0, 0, 0]] * 4)).proved
    assert verify(limit(model, push(0, 0, -1e-10 * G), lower=0.0, recession=[[0, 0, W / 4e10]] * 4)).proved


@pytest.mark.parametrize("lower", [1e-150, -1e-150, 1e100, 1e-9])
def test_multipliers_of_any_size_are_answered(lower):
    report = verify(against_a_wall(pressing(0.25)) | {"lower": lower})
    assert "seal" in report.reason
    assert verify(sealed(against_a_wall(pressing(0.25)) | {"lower": lower})).reason


# --- coupled states --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("touching", [True, False])
@pytest.mark.parametrize(("lack", "proved"), [(3.9e-9, True), (4.1e-9, False)])
def test_points_of_a_pebble_are_measured_by_its_weight(lack, proved, touching):
    """Each corner bears W / 4 and lacks some of eps, on a boulder of 1000 W or beside one."""
    boulder, pebble = box("boulder", [-5, -5, 0], [5, 5, 10]), box("pebble", [-0.5, -0.5, 10], [0.5, 0.5, 11])
    ground, at = box("ground", [-9, -9, -1], [9, 9, 0], fixed=True), 10.0
    shelf = box("shelf", [-0.5, -0.5, 9.5], [0.5, 0.5, 10], fixed=True)
    blocks = [ground, boulder, pebble]
    if not touching:
        blocks[1], at = box("boulder", [20, -5, 0], [30, 5, 10]), 10.0
        blocks.append(shelf)
        ground["vertices"] = [[40 if x == 9 else x, y, z] for x, y, z in ground["vertices"]]
    x = blocks[1]["vertices"][0][0]
    joints = [
        contact("ground", "boulder", level(x, -5, x + 10, 5)),
        contact("boulder" if touching else "shelf", "pebble", level(-0.5, -0.5, 0.5, 0.5, at)),
    ]
    forces = [[0, 0, 250 * W + touching * W / 4]] * 4 + [[0, 0, W / 4]] * 4
    motion = {"boulder": [0, 0, -1, 0, 0, 0], "pebble": [0, 0, lack - 1 - touching, 0, 0, 0]}
    report = verify(coupled(state(blocks, joints, forces), motion))
    assert report.proved is proved, report.reason
    assert proved or "contact 1 (" in report.reason
    assert report.figures["complementarity"] == pytest.approx(lack / 4, rel=1e-6)


@pytest.mark.parametrize("off", [-5e-10, 5e-10, -2e-9, -1.0])
def test_forces_that_go_with_a_displacement_are_not_corrected(off):
    """Those that would have to be added need not go with it: a state by itself is exact, the coupled one nearly so."""
    thin = {**cube_on_ground(), "forces": [[0, 0, W / 4 * (1 + off)]] * 4}
    small = abs(off) < 1e-9
    assert verify(sealed(thin)).claim.endswith(EXACT) is small
    report = verify(coupled(thin, {"cube": [0, 0, -1.0, 0, 0, 0]}))
    assert report.proved is small
    assert report.claim.endswith(NEARLY) is small
    assert small or "do not balance" in report.reason


def test_a_coupled_state_is_exact_or_to_the_second_grade():
    for extra, grade in ((0.0, EXACT), (1e-12, NEARLY)):
        thin = {**cube_on_ground(), "forces": [[0, 0, W / 4 * (1 + extra)]] * 4}
        report = verify(coupled(thin, {"cube": [0, 0, -1, 0, 0, 0]}))
        assert report.proved
        assert report.claim.endswith(grade)


@pytest.mark.parametrize("by", [1e-3, 1e-6, 1e-9, 1e-11])
def test_friction_opposes_the_shortest_sliding_too(by):
    """By `by` eps down the slope, or 30 degrees beside it: however short, and however small beta_min is."""
    straight = coupled_slide(by=by)["mechanism"]["cube"]
    aside = [by * math.cos(math.pi / 6), by * math.sin(math.pi / 6), *straight[2:]]
    assert verify(coupled(coupled_slide(), {"cube": straight}, beta_min=1e-12)).proved
    report = verify(coupled(coupled_slide(), {"cube": aside}, beta_min=1e-12))
    assert "does not oppose its sliding" in report.reason
    across = 1.5 / 8 / math.hypot(1, 0.5) / 2  # of |F_t|, by the cube's weight
    assert report.figures["alignment"] == pytest.approx(across / 1000, rel=1e-6)


@pytest.mark.parametrize(("turn", "proved"), [(0.999e-6, True), (1.001e-6, False)])
def test_how_straight_a_short_sliding_has_to_be(turn, proved):
    """|F_t| = W / 8 (1 + 1/2) of w = hypot(1, 1/2) W at two corners, and 1e-6 w is what may go across."""
    share = 1.5 / 8 / math.hypot(1, 0.5)
    motion = [1e-6, 1e-6 * turn / share, -1.0, 0, 0, 0]
    assert verify(coupled(coupled_slide(), {"cube": motion}, beta_min=1e-7)).proved is proved


# --- trees of one component ------------------------------------------------------------------------------------------


def with_a_cube(certificate, **more):
    """The same tree, of the component that a block names, in a model that holds another cube, which stands."""
    ground, cube = box("yard", [5, 5, -1], [9, 9, 0], fixed=True), box("stone", [6, 6, 0], [7, 7, 1])
    joint = contact("yard", "stone", level(6, 6, 7, 7))
    blocks = [ground, *certificate["blocks"], cube]
    return sealed({**certificate, "blocks": blocks, "contacts": [joint, *certificate["contacts"]], **more})


@pytest.mark.parametrize(("build", "name"), [(frame, "beam"), (virtual_work, "beam"), (falls_over, "cube")])
def test_a_tree_of_one_component_refutes_the_model(build, name):
    report, alone = verify(with_a_cube(build(), component=name)), verify(build())
    assert report.proved, report.reason
    assert report.claim == alone.claim
    assert report.figures["least_margin"] == pytest.approx(alone.figures["least_margin"], rel=1e-12)
    assert verify(sealed({**build(), "component": name})).proved


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("stone", "mechanism"),
        ("yard", "component: yard is a support"),
        ("left", "component: left is a support"),
        ("nobody", "component: there is no block nobody"),
        (None, "component: there is no block"),
        (["beam"], "component: there is no block"),
        (3, "component: there is no block"),
    ],
)
def test_components_that_are_not_the_refuted_one(name, reason):
    report = verify(with_a_cube(virtual_work(0.05), component=name))
    assert not report.proved
    assert reason in report.reason


def test_a_tree_of_all_is_of_all():
    """Without a component the leaf has to speak of the other cube too, and of its points."""
    certificate = with_a_cube(virtual_work(0.05))
    assert "missing: stone" in verify(certificate).reason
    leaf = copy.deepcopy(certificate["tree"])
    leaf["mechanism"]["stone"] = STILL
    assert "8 forces for 12" in verify(sealed({**certificate, "tree": leaf})).reason
    assert "unknown field: component" in verify(sealed({**cube_on_ground(), "component": "cube"})).reason


def test_a_component_takes_its_loads_along_and_no_others():
    """The beam's weight as a load on it, among loads on the cube and on supports."""
    certificate = with_a_cube(virtual_work(0.05), component="beam")
    weight = RHO * G * 0.09
    loads = [
        {"block": "stone", "force": [0, 0, 9e9], "point": [6.5, 6.5, 0.5]},
        {"block": "yard", "force": [0, 0, 9e9], "point": [0, 0, 0]},
        {"block": "left", "force": [9e9, 0, 0], "point": [0, 0, 0]},
        {"block": "beam", "force": [0, 0, -weight / 2], "point": [0, 0, 0]},
    ]
    beam = next(block for block in certificate["blocks"] if block["id"] == "beam")
    beam["density"] = RHO / 2
    report = verify(sealed({**certificate, "loads": loads}))
    assert report.proved, report.reason
    whole = verify(virtual_work(0.05)).figures["least_margin"]
    assert report.figures["least_margin"] == pytest.approx(whole, rel=1e-9)
    loads[3]["block"] = "stone"
    assert not verify(sealed({**certificate, "loads": loads})).proved


def test_meshes_of_other_components_are_looked_at():
    certificate = with_a_cube(virtual_work(0.05), component="beam")
    certificate["blocks"][-1]["faces"].pop()
    assert "block stone: its faces do not close" in verify(sealed(certificate)).reason
    assert tree_of(virtual_work(0.05), virtual_work(0.05)["tree"])["kind"] == "cra-tree"


# --- settlements -----------------------------------------------------------------------------------------------------


def settled(sinks, follows, forces=None, mu=0.5, size=1.0):
    """Two cubes, the second of `size`, each on a fixed plinth of its own. The plinths sink, the cubes follow."""
    one, two = box("one", [0, 0, 0], [1, 1, 1]), box("two", [5, 0, 0], [5 + size, size, size])
    plinths = [box(f"plinth {k}", [x - 1, -1, -1], [x + 2, 2, 0], fixed=True) for k, x in (("one", 0), ("two", 5))]
    joints = [
        contact("plinth one", "one", level(0, 0, 1, 1), mu),
        contact("plinth two", "two", level(5, 0, 5 + size, size), mu),
    ]
    forces = forces or [[0, 0, W / 4]] * 4 + [[0, 0, W * size**3 / 4]] * 4
    model = state([*plinths, one, two], joints, forces)
    motion = {name: [0, 0, -z, 0, 0, 0] for name, z in zip(("one", "two"), follows, strict=True)}
    moved = {f"plinth {name}": [0, 0, -z, 0, 0, 0] for name, z in zip(("one", "two"), sinks, strict=True)}
    return sealed({**model, "kind": "rbe-settled", "mechanism": motion, "settlements": moved})


def test_cubes_follow_what_sinks():
    report = verify(settled((1.0, 0.5), (1.0, 0.5)))
    assert report.proved, report.reason
    assert report.claim.endswith(EXACT)


@pytest.mark.parametrize(
    ("second", "proved"), [(1e-9 * (1 - 0.9e-7), True), (1e-9 * (1 - 4.5e-7), False), (0.0, False)]
)
def test_each_component_is_measured_by_its_own_settlement(second, proved):
    """The second plinth sinks by 1e-9 of the first one. A cube that does not follow stands on nothing: |F| d = W / 4
    times what has opened, of W times 1e-9.
    """
    report = verify(settled((1.0, 1e-9), (1.0, second)))
    assert report.proved is proved, report.reason
    assert proved or "contact 1 (plinth two - two): the force at point 0 does work" in report.reason


def test_a_component_whose_ground_does_not_move_stays_exactly():
    assert verify(settled((1.0, 0.0), (1.0, 0.0))).proved
    for creep in (1e-12, -1e-12):
        assert "contact 1" in verify(settled((1.0, 0.0), (1.0, creep))).reason
    assert "no contact point is on a block that the ground moves" in verify(settled((0.0, 0.0), (0.0, 0.0))).reason


@pytest.mark.parametrize(("lack", "proved"), [(3.9e-7, True), (4.1e-7, False)])
def test_forces_of_a_pebble_are_measured_by_its_weight(lack, proved):
    """It has opened by `lack`, and W' / 4 does that work, of its own W'."""
    report = verify(settled((1.0, 1.0), (1.0, 1.0 - lack), size=0.0625))
    assert report.proved is proved, report.reason


def test_forces_of_a_settlement_are_not_corrected():
    """Forces too small to count may stay where a cube has come off; those that hold it could not."""
    thin = [[0, 0, 1e-9 * W]] * 4 + [[0, 0, W / 4]] * 4
    assert "block one: its forces do not balance" in verify(settled((1.0, 1.0), (0.0, 1.0), thin)).reason
    assert "block one: its forces do not balance" in verify(settled((1.0, 1.0), (1.0, 1.0), thin)).reason


def test_what_slides_and_opens_carries_nothing():
    """On a slope of mu sliding by 1 opens by mu: all the friction there is does no work, but the point is off."""
    slope = {**cube_on_slope(), "kind": "rbe-settled", "settlements": {"ground": [0, 0, -1.0, 0, 0, 0]}}
    assert verify(sealed({**slope, "mechanism": {"cube": [0, 0, -1.0, 0, 0, 0]}})).proved
    report = verify(sealed({**slope, "mechanism": {"cube": [1.0, 0, -0.5, 0, 0, 0]}}))
    assert "has opened, but carries a force" in report.reason
    for motion in ([1.0, 0, -0.501, 0, 0, 0], [0.0, 0, -1.001, 0, 0, 0]):
        assert "closes, or slides without opening" in verify(sealed({**slope, "mechanism": {"cube": motion}})).reason
