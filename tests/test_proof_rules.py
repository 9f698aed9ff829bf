"""Forgeries against the rules for forces and motions: every block at its own scale, corrections, splits, the cap.

Each certificate is sealed anew, so that only the arithmetic refuses it. w is a block's own weight, D the diagonal of
its box; W = 2400 G is the weight of a unit cube.
"""

import copy
import math
import random
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.proof import verify
from cyclopean.proof.checker import EXACT, NEARLY, _area_vector, _corrections, _cross
from laws import examples
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
    level,
    mechanism,
    on_edges,
    overhang,
    sealed,
    sliding,
    state,
    two_cubes,
)
from test_proof_laws import other_side

SIGNS = (1, 1, -1, -1)  # of friction along y at the corners of a square, so that it adds up to nothing


def corners(up, along=0.0, mu=0.0):
    """Forces of `up` at four corners, with friction of `mu` times that which adds up to nothing, and `along` x."""
    return [[along, sign * mu * up, up] for sign in SIGNS]


def apart(distance=3.0):
    """A second cube on the same ground, a component of its own."""
    cube = box("other", [distance - 0.5, -0.5, 0], [distance + 0.5, 0.5, 1])
    return cube, contact("ground", "other", level(distance - 0.5, -0.5, distance + 0.5, 0.5))


# --- every block at its own scale ------------------------------------------------------------------------------------


def pebble_on_boulder(extra):
    """A unit cube on a boulder of 1000 W; what bears the pebble is too much by `extra` w. Nothing can be corrected."""
    boulder, pebble = box("boulder", [-5, -5, -10], [5, 5, 0]), {**CUBE, "id": "pebble"}
    rock = box("rock", [-9, -9, -11], [9, 9, -10], fixed=True)
    joints = [contact("rock", "boulder", level(-5, -5, 5, 5, -10.0)), contact("boulder", "pebble", BASE["polygon"])]
    up = W / 4 * (1 + extra)
    return state([rock, boulder, pebble], joints, corners(250 * W + up, mu=0.5) + corners(up, mu=0.5))


@pytest.mark.parametrize(("extra", "proved"), [(0.99e-9, True), (1.01e-9, False), (1e-7, False), (-1e-3, False)])
def test_a_boulder_does_not_hide_what_is_left_on_a_pebble(extra, proved):
    report = verify(pebble_on_boulder(extra))
    assert report.proved is proved
    assert report.figures["equilibrium_force"] == pytest.approx(abs(extra), rel=1e-3)
    assert proved or report.reason.startswith("block pebble: its forces do not balance")
    assert report.figures.get("exact", 0.0) == 0.0


def test_a_boulder_does_not_hide_that_a_pebble_tips():
    """A pebble of 1/2048 m hangs over the edge by 60 %: with all of it borne by the edge, 0.1 w s is left, of w D."""
    s = 2.0**-11
    ledge = box("ledge", [-4, -4, -1], [0, 4, 0], fixed=True)
    boulder, pebble = box("boulder", [-1.5, -2, 0], [-0.5, -1, 1]), box("pebble", [-0.4 * s, 0, 0], [0.6 * s, s, s])
    joints = [
        contact("ledge", "boulder", level(-1.5, -2, -0.5, -1)),
        contact("ledge", "pebble", level(-0.4 * s, 0, 0, s)),
    ]
    forces = [*corners(W / 4), [0, 0, 0], [0, 0, W * s**3 / 2], [0, 0, W * s**3 / 2], [0, 0, 0]]
    report = verify(state([ledge, boulder, pebble], joints, forces, tolerance=1e-9))
    assert "block pebble: its moments do not balance" in report.reason
    assert report.figures["equilibrium_moment"] == pytest.approx(0.1 / math.sqrt(3), rel=1e-6)


def test_weights_count_without_gravity_too():
    """A load of 1e-9 of what the cube would weigh at 9.80665 m/s2 may stay unbalanced, of more not."""
    for share, proved in ((0.99e-9, True), (1.01e-9, False)):
        load = {"block": "cube", "force": [share * RHO * 9.80665, 0, 0], "point": [0, 0, 0.5]}
        model = state([GROUND, CUBE], [BASE], corners(0.0), gravity=(0, 0, 0), loads=[load])
        assert verify(model).proved is proved


@pytest.mark.parametrize("axis", range(6))
def test_every_component_of_what_is_left_counts(axis):
    """A cube about the origin, without gravity: a force, or a couple, along one axis alone and nothing else."""
    cube, unit = box("cube", [-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]), RHO * 9.80665
    base = contact("ground", "cube", level(-0.5, -0.5, 0.5, 0.5, -0.5))
    ground = box("ground", [-4, -4, -1], [4, 4, -0.5], fixed=True)
    one, two, three = (tuple(float(i == (axis + k) % 3) for i in range(3)) for k in range(3))
    for share, proved in ((0.99e-9, True), (1.01e-9, False)):
        f = share * unit * (1 if axis < 3 else math.sqrt(3))
        loads = [{"block": "cube", "force": [f * x for x in one], "point": [0, 0, 0]}]
        if axis >= 3:
            loads = [
                {"block": "cube", "force": [s * f * x for x in two], "point": [s * x / 2 for x in three]}
                for s in (1, -1)
            ]
        assert verify(state([ground, cube], [base], corners(0.0), gravity=(0, 0, 0), loads=loads)).proved is proved


def test_a_model_without_blocks_is_none():
    assert "there are no blocks" in verify(state([], [], [])).reason


# --- balance made exact ----------------------------------------------------------------------------------------------

TRIANGLE = [(0, 0, 0), (3, 0, 0), (0, 3, 0)]
SMALL = 2.0**-31  # of own weight: 4.7e-10, so that a block may be left with twice that


def corrections(force, moment, ring=TRIANGLE):
    """Send a wrench (its moment about the origin) through the corners of a triangle: a force at each, in fractions."""
    found, divisor = _corrections(ring, force, moment)
    return [[Fraction(x, divisor) for x in row] for row in found]


def squared(force, moment, ring=TRIANGLE):
    return sum(x * x for row in corrections(force, moment, ring) for x in row)


def test_corrections_by_hand():
    """The middle is (1, 1). 3 down there: 1 at each corner. 3 down at (3, 0): all of it there. Sideways: a third each.
    A twist of 6 about the middle: in proportion to the arms, sum |arm|^2 = 12, so 36 / 12 in all.
    """
    assert corrections((0, 0, -3), (-3, 3, 0)) == [[0, 0, -1]] * 3
    assert corrections((0, 0, -3), (0, 9, 0)) == [[0, 0, 0], [0, 0, -3], [0, 0, 0]]
    assert corrections((6, 0, 0), (0, 0, -6)) == [[2, 0, 0]] * 3
    assert squared((0, 0, 0), (0, 0, 6)) == 3
    assert squared((0, 0, 0), (0, 0, 0)) == 0


wrenches = st.tuples(*[st.integers(-9, 9)] * 6)
triangles = st.lists(st.tuples(*[st.integers(-9, 9)] * 3), min_size=3, max_size=3).filter(
    lambda ring: any(_area_vector(ring))
)


@settings(max_examples=examples(100), deadline=None)
@given(triangles, wrenches)
def test_corrections_add_up_to_what_is_sent(ring, wrench):
    found = corrections(wrench[:3], wrench[3:], ring)
    moments = [_cross(r, d) for r, d in zip(ring, found, strict=True)]
    assert [sum(x) for x in zip(*found, strict=True)] == list(wrench[:3])
    assert [sum(x) for x in zip(*moments, strict=True)] == list(wrench[3:])


@settings(max_examples=examples(100), deadline=None)
@given(triangles, wrenches)
def test_the_least_correction_in_the_plane_and_out_of_it(ring, wrench):
    """The same by least squares over what acts across the plane and what acts in it: no other forces are as small."""
    np = pytest.importorskip("numpy")
    r = np.array(ring, float)
    rows = np.vstack([np.tile(np.eye(3), 3), np.hstack([_skew(x) for x in r])])
    d = np.linalg.lstsq(rows, np.array(wrench, float), rcond=None)[0]
    assert float(squared(wrench[:3], wrench[3:], ring)) == pytest.approx(float(d @ d), rel=1e-6, abs=1e-9)


def _skew(r):
    return [[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]]


def hinged(excess, along=0.0, mu=0.5):
    """The cube on two contacts. One bears nearly all of it, with all the friction there is; the other one W / 4 x SMALL
    at each corner, and `along` times that to either side. `excess` x SMALL W is too much.
    """
    rows = corners(W / 4 * (1 + SMALL * (excess - 1)), mu=0.5)
    light = contact("ground", "cube", BASE["polygon"], mu)
    return state(
        [GROUND, CUBE], [BASE, light], rows + [[s * along * SMALL * W / 4, 0, SMALL * W / 4] for s in (1, -1, 1, -1)]
    )


@pytest.mark.parametrize(
    ("excess", "grade"), [(0.0, EXACT), (0.5, EXACT), (0.51, NEARLY), (1.0, NEARLY), (-2.0, EXACT), (-2.2, None)]
)
def test_what_is_left_is_corrected_if_the_cones_allow(excess, grade):
    """The centre lies between corners 0 and 2, from which half of what is too much is taken each: at an excess of a
    half they keep nothing, with more they would pull. What is left of 1e-9 W is refused even if it could be corrected.
    """
    report = verify(hinged(excess))
    assert report.proved is (grade is not None)
    assert report.figures["equilibrium_force"] == pytest.approx(abs(excess * SMALL), rel=1e-6)
    if grade:
        assert report.claim.endswith(grade)
        assert report.figures["exact"] == (grade == EXACT)
    else:
        assert "block cube: its forces do not balance" in report.reason


@pytest.mark.parametrize(("along", "mu", "grade"), [(0.24, 0.5, EXACT), (0.26, 0.5, NEARLY), (0.26, 0.6, EXACT)])
def test_corrections_stay_in_the_cones(along, mu, grade):
    """Half of what corners 0 and 2 bear is taken off: with mu = 1/2 a quarter of it may be friction."""
    assert verify(hinged(0.25, along, mu)).claim.endswith(grade)


def resting(up, mu=0.0):
    return state([GROUND, CUBE], [BASE], corners(up, mu=mu))


@pytest.mark.parametrize(("extra", "proved"), [(5e-10, True), (2e-9, False)])
def test_a_correction_that_leaves_a_cone_leaves_the_second_grade(extra, proved):
    """Friction within 1e-12 of the edge: to bear less there is more than that."""
    report = verify(resting(W / 4 * (1 + extra), mu=0.5 * (1 - 1e-12)))
    assert report.proved is proved
    if proved:
        assert report.figures["exact"] == 0
        assert report.claim.endswith(NEARLY)


@pytest.mark.parametrize(("inside", "grade"), [((0, 1), NEARLY), ((0, 1, 2), EXACT), ((1, 2, 3), EXACT), ((), NEARLY)])
def test_a_way_needs_three_points_inside_their_cones(inside, grade):
    """At the others friction is at its bound, all of it held by loads at the same points."""
    loads = [
        {"block": "cube", "force": [-W / 8, 0, 0], "point": list(p)}
        for k, p in enumerate(BASE["polygon"])
        if k not in inside
    ]
    up = W / 4 * (1 + 1e-10)
    forces = [[0 if k in inside else up / 2, 0, up] for k in range(4)]
    report = verify(state([GROUND, CUBE], [BASE], forces, loads=loads))
    assert report.proved, report.reason
    assert report.claim.endswith(grade)


def test_a_way_needs_points_that_are_in_no_line():
    """Inside are three points of one side; the two others are on the edge of their cones."""
    five = [[-0.5, -0.5, 0], [0, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]
    ups = [W / 6, W / 6, W / 6, W / 4, W / 4]
    friction = [0, 0, 0, W / 8, -W / 8]
    forces = [[f, 0, up * (1 + 1e-10)] for f, up in zip(friction, ups, strict=True)]
    forces[3][0] = 0.5 * forces[3][2]
    forces[4][0] = -0.5 * forces[4][2]
    report = verify(state([GROUND, CUBE], [contact("ground", "cube", five)], forces))
    assert report.proved, report.reason
    assert report.claim.endswith(NEARLY)


def test_the_weakest_component_is_the_claim():
    """One cube can be corrected; the other only balances to 1e-10: refused from 1e-9 on, and named."""
    other, joint = apart()
    for extra, proved in ((1e-10, True), (1.1e-9, False)):
        forces = corners(W / 4 * (1 - SMALL)) + corners(W / 4 * (1 + extra), mu=0.5)
        report = verify(state([GROUND, CUBE, other], [BASE, joint], forces))
        assert report.proved is proved
        assert proved or "block other" in report.reason
        if proved:
            assert report.figures["exact"] == 0.5
            assert report.claim.endswith(NEARLY)


def stacked(lower, upper, frictions=(0.0, 0.0)):
    """Two cubes on each other with these forces at the corners below each."""
    certificate = two_cubes()
    certificate["forces"] = [
        [0, sign * f, up] for up, f in zip((lower, upper), frictions, strict=True) for sign in SIGNS
    ]
    return sealed(certificate)


def test_what_is_left_goes_down_to_the_support():
    """SMALL W is missing above, and goes on below: unless the lower contact has no point inside its cone. If there is
    something left below alone, it does not matter that the upper contact has none.
    """
    less = W / 4 * (1 - SMALL)
    assert verify(stacked(W / 2, less)).claim.endswith(EXACT)
    assert verify(stacked(W / 2, less, (W / 4, 0.0))).claim.endswith(NEARLY)
    assert verify(stacked(W / 2, W / 4, (W / 4, 0.0))).claim.endswith(EXACT)
    assert verify(stacked(W / 2 * (1 - SMALL / 2), W / 4, (0.0, W / 8))).claim.endswith(EXACT)


@pytest.mark.parametrize(("spare", "grade"), [(0.49, NEARLY), (0.51, EXACT)])
def test_what_goes_down_adds_up(spare, grade):
    """Too much by SMALL W above; the lower cube balances. But what is too much goes on through the joint below, where
    it leaves W / 2 - SMALL W / 4 at two corners: friction there may be half of that.
    """
    friction = W / 4 * (1 - spare * SMALL)
    certificate = stacked(W / 2 + SMALL * W / 4, W / 4 * (1 + SMALL), (friction, 0.0))
    assert verify(certificate).claim.endswith(grade)
    assert verify(sealed(other_side(certificate))).claim.endswith(grade)


def test_corrections_may_be_large():
    """SMALL W D / 2 of moment on the side that is left to hold it, 2**-20 m wide, takes 2**-12 W at a corner and more:
    that is fine as long as the cones allow it, as the forces in the file rule a mechanism out by themselves.
    """
    strip = level(0.5 - 2.0**-20, -0.5, 0.5, 0.5)
    heavy = corners(W / 4, mu=0.5)
    for row, s in zip(heavy, (1, -1, -1, 1), strict=True):
        row[1], row[2] = row[1] * (1 + s * SMALL), row[2] * (1 + s * SMALL)
    joints = [BASE, contact("ground", "cube", strip)]
    for thrust, grade in ((2.0**-8, EXACT), (2.0**-14, NEARLY)):
        squeeze = [[0, 0, thrust * W]] * 4
        model = state(
            [GROUND, CUBE],
            joints,
            heavy + squeeze,
            loads=[{"block": "cube", "force": [0, 0, -4 * thrust * W], "point": [0.5 - 2.0**-21, 0, 0]}],
            tolerance=1e-9,
        )
        report = verify(model)
        assert report.proved, report.reason
        assert report.claim.endswith(grade)


@pytest.mark.parametrize(("push", "grade"), [(0.035e6, EXACT), (0.036e6, NEARLY), (0.35e6, NEARLY), (0.36e6, "")])
def test_corrections_leave_room_below_the_cap(push, grade):
    """Eight forces of `push` W are sqrt 8 of that in size: a tenth of 1e6 W, or all; and 1e-10 of it is missing."""
    rows = [[push * W, 0, s * W / 8 * (1 + 1e-10)] for s in (1, -1) for _ in range(4)]
    report = verify(state(*key(0.5), rows))
    assert report.proved is bool(grade), report.reason
    assert report.claim.endswith(grade)


@pytest.mark.parametrize("loaded", [False, True])
def test_what_a_support_bears_does_not_raise_the_cap(loaded):
    """A cube that is held from below, and in its turning: its weight, or a load, is nothing. Nor may it press."""
    held = {**CUBE, "held": ["z", "rx", "ry", "rz"]}
    loads = [{"block": "cube", "force": [0, 0, -W], "point": [0, 0, 0.5]}] if loaded else []
    for up, proved in ((0.0, True), (W / 4, False)):
        gravity = (0, 0, 0) if loaded else (0, 0, -G)
        report = verify(state([GROUND, held], [BASE], corners(up), gravity=gravity, loads=loads))
        assert report.proved is proved
        assert proved or "larger than 1e+06 times its weight" in report.reason


def test_what_joints_pull_counts_against_a_mechanism():
    """As `sliding`, with a joint that pulls T = w' / 4 in all, w' = RHO G: it takes T x 0.49 off the work, and counts
    beside the weight of sqrt 2 w'.
    """
    certificate = sliding(rise=0.49)
    certificate["contacts"][0]["tension"] = W / 4
    work = 0.51 - 0.49 / 4 - 1e-9 * math.sqrt(2) * math.hypot(1, 0.49)
    expected = work / (math.sqrt(2) + 0.25) / (2 * 0.01 / math.sqrt(1.25))
    assert verify(sealed(certificate)).figures["bound"] == pytest.approx(expected, rel=1e-12)


# --- contacts without friction, forces in two parts ------------------------------------------------------------------


def smooth(rows):
    return state([GROUND, CUBE], [{**BASE, "mu": 0.0}], rows)


@pytest.mark.parametrize("row", [[W / 8], [W / 8, 0.0], [W / 2, -3 * W / 8], [W / 16, W / 16]])
def test_without_friction_a_force_is_a_multiple_of_the_area_vector(row):
    """N is twice the area, (0, 0, 2): W / 8 of it is a quarter of the weight."""
    report = verify(smooth([row] * 4))
    assert report.proved, report.reason
    assert report.figures["equilibrium_force"] == report.figures["equilibrium_moment"] == 0
    assert report.claim.endswith(EXACT)


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ([0, 0, W / 4], "has 3 numbers instead of 1 or 2"),
        ([], "has 0 numbers instead of 1 or 2"),
        ([0, 0, W / 4, 0, 0, 0], "has 6 numbers instead of 1 or 2"),
        ([W / 4], "do not balance"),
        ([W / 8, W * 1e-8], "do not balance"),
        ([-W / 8], "pulls"),
        ([W / 8, -W / 4], "pulls"),
        ([None], "is not a number"),
        (W / 8, "is not a list"),
    ],
)
def test_without_friction_nothing_else_holds(row, reason):
    assert reason in verify(smooth([row] * 4)).reason


def test_with_friction_one_number_is_none():
    for row, count in (([W / 4], 1), ([W / 4, 0], 2), ([0, 0, W / 4, 0], 4), ([0] * 7, 7)):
        assert f"has {count} numbers instead of 3 or 6" in verify(state([GROUND, CUBE], [BASE], [row] * 4)).reason


@pytest.mark.parametrize("half", [0.3, 0.7, 1 / 3])
def test_a_wedge_without_friction(half):
    """A triangular prism, 2 x `half` wide and 0.7 high, on two planes: N = 2 (-+0.7, 0, half), so that 8 x 2 half x is
    its weight, x = RHO G 0.7 / 16. No three doubles lie on such a ray; one number of each point does it.
    """
    h, faces = 0.7, [[0, 1, 2], [5, 4, 3], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]]
    section = [[0.0, 0.0], [half, h], [-half, h]]
    wedge = {"id": "wedge", "vertices": [[x, y, z] for y in (-0.5, 0.5) for x, z in section], "faces": faces}
    wedge |= {"density": RHO, "fixed": False}
    bed = [box(name, [0, -2, -1], [1, 2, 0], fixed=True) for name in ("left", "right")]
    for sign, block in zip(
        (-1, 1), bed, strict=True
    ):  # of each the inner edge of the top is at 0, the outer up the slope
        for corner in block["vertices"]:
            outer = corner[0] == (1 if sign == 1 else 0)
            corner[0], corner[2] = (sign * 4 * half, 4 * h if corner[2] == 0 else -1) if outer else (0.0, corner[2])
    x, z, y = half, h, 0.5
    joints = [
        contact("right", "wedge", [[0, -y, 0], [x, -y, z], [x, y, z], [0, y, 0]], 0.0),
        contact("left", "wedge", [[0, y, 0], [-x, y, z], [-x, -y, z], [0, -y, 0]], 0.0),
    ]
    push = RHO * G * h / 16
    for extra, proved in ((0.0, True), (0.9e-9, True), (1.1e-9, False)):
        assert verify(state([wedge, *bed], joints, [[push * (1 + extra)]] * 8)).proved is proved
    assert verify(state([wedge, *bed], joints, [[push * 2, -push]] * 8)).proved


def test_six_numbers_are_a_sum():
    """g / 4 of a decimal g is no double: two of them come to within 1e-32 of it."""
    g = 9.80665
    exact = Fraction(RHO) * Fraction(g) / 4
    high = float(exact)
    low = float(exact - Fraction(high))
    assert low != 0
    one = verify(state([GROUND, CUBE], [BASE], [[0, 0, high]] * 4, gravity=(0, 0, -g)))
    two = verify(state([GROUND, CUBE], [BASE], [[0, 0, high, 0, 0, low]] * 4, gravity=(0, 0, -g)))
    mixed = verify(state([GROUND, CUBE], [BASE], [[0, 0, high, 0, 0, low], [0, 0, high]] * 2, gravity=(0, 0, -g)))
    assert 1e-17 < one.figures["equilibrium_force"] < 1e-15
    assert two.figures["equilibrium_force"] < 1e-30
    assert mixed.figures["equilibrium_force"] == pytest.approx(one.figures["equilibrium_force"] / 2, rel=1e-6)


@pytest.mark.parametrize(
    ("more", "reason"), [([W, 0, 0], "friction cone"), ([0, 0, -W / 2], "pulls"), ([0, 0, 1e-8 * W], "do not balance")]
)
def test_the_second_part_of_a_force_smuggles_nothing(more, reason):
    certificate = on_edges(cube_on_ground())
    certificate["forces"] = [[*row, *more] for row in certificate["forces"]]
    assert reason in verify(sealed(certificate)).reason
    certificate["forces"] = [[*row[:3], 0, 0, 0] for row in certificate["forces"]]
    assert verify(sealed(certificate)).proved


# --- the cap, and motions: no model has both a state and a mechanism -------------------------------------------------


def key(mu):
    """A key between two walls, N = (1, 0, 0) twice over: its model."""
    walls = [box(n, [x, -1, -1], [x + 1, 2, 3], fixed=True) for n, x in (("L", -1.0), ("R", 1.0))]
    stone = box("key", [0, 0, 1], [1, 1, 2])
    rings = [[[x, 0, 1], [x, 1, 1], [x, 1, 2], [x, 0, 2]] for x in (0, 1)]
    return [*walls, stone], [contact("L", "key", rings[0], mu), contact("key", "R", rings[1], mu)]


def test_a_thrust_of_any_size_does_not_hold_a_key_without_friction():
    """As it was forged for the first version: friction of 1e-12 of a thrust of 1e12 weights."""
    x = W / 8 / 1e-12
    rows = [[x, 0, s * W / 8] for s in (1, -1) for _ in range(4)]
    assert "has 3 numbers" in verify(state(*key(0.0), rows)).reason
    assert "do not balance" in verify(state(*key(0.0), [[W]] * 8)).reason
    rows = [[x * (1 + 1e-9), 0, s * W / 8] for s in (1, -1) for _ in range(4)]
    assert "larger than 1e+06 times its weight" in verify(state(*key(1e-12), rows)).reason
    assert verify(mechanism(*key(0.0), {"key": [0, 0, -1, 0, 0, 0]})).proved


@pytest.mark.parametrize("off", [1e-8, 1e-5, 1e-3])
def test_the_cap_is_where_mechanisms_begin(off):
    """N = W / (2 mu) on either side is W / (sqrt 8 mu) in size. To drop, the key has to overcome mu / sqrt(1 + mu^2)
    at eight points: the loads do W, less 1e-9 W, so both bounds are at mu = 1e-6 / sqrt 8.
    """
    for sign, held in ((1, True), (-1, False)):
        mu = 1e-6 / math.sqrt(8) * (1 + sign * off)
        rows = [[W / 8 / mu * (1 + 1e-15), 0, s * W / 8] for s in (1, -1) for _ in range(4)]
        assert verify(state(*key(mu), rows)).proved is held
        assert verify(mechanism(*key(mu), {"key": [0, 0, -1, 0, 0, 0]})).proved is (not held and off > 1e-9)


def test_another_component_lends_no_thrust():
    """The cap is of the component's own weight: a boulder apart does not raise it."""
    mu = 0.9e-6 / math.sqrt(8)
    blocks, joints = key(mu)
    rows = [[W / 8 / mu * (1 + 1e-15), 0, s * W / 8] for s in (1, -1) for _ in range(4)]
    boulder, ground = box("boulder", [-5, -5, -12], [5, 5, -2]), box("bed", [-9, -9, -14], [9, 9, -12], fixed=True)
    joint = contact("bed", "boulder", level(-5, -5, 5, 5, -12.0))
    both = state([*blocks, boulder, ground], [*joints, joint], rows + corners(250 * W))
    assert "times its weight" in verify(both).reason


@pytest.mark.parametrize(("share", "proved"), [(2.4e-9, False), (2.6e-9, True)])
def test_a_mechanism_does_more_work_than_a_state_may_leave(share, proved):
    """mu = 1/2, gravity ((1 + share) / 2, 0, -1) G, v = (1, 0, 1/2): nothing resists, the work is w' share / 2 with
    w' = RHO G; a state may leave 1e-9 w |v| = 1e-9 w' 1.25.
    """
    certificate = sliding()
    certificate["gravity"] = [G * (1 + share) / 2, 0, -G]
    report = verify(sealed(certificate))
    assert report.proved is proved
    assert proved or "do no work" in report.reason


@pytest.mark.parametrize(("reach", "proved"), [(2.2e-9, False), (2.3e-9, True)])
def test_a_mechanism_that_turns_does_more_work_too(reach, proved):
    """Tipping about an edge `reach` beyond the centre: W reach, of which 1e-9 W (|v| + D |omega|), |v| = 1/2."""
    assert (reach > 1e-9 * (0.5 + math.sqrt(3))) is proved
    assert verify(overhang(-reach)).proved is proved


def beside(certificate, motion, heavy=False):
    """The same with another cube, or a boulder, apart."""
    size = 5.0 if heavy else 0.5
    other = box("other", [20 - size, -size, 0], [20 + size, size, 2 * size])
    ground = box("yard", [10, -9, -1], [30, 9, 0], fixed=True)
    joint = contact("yard", "other", level(20 - size, -size, 20 + size, size))
    result = copy.deepcopy(certificate)
    result["blocks"] += [other, ground]
    result["contacts"].append(joint)
    result["mechanism"]["other"] = motion
    return sealed(result)


@pytest.mark.parametrize("motion", [[0.0] * 6, [0, 0, 1.0, 0, 0, 0], [0, 0, -1.0, 0, 0, 0]])
def test_one_component_that_falls_is_enough(motion):
    """Whatever the other one does, that is heavier by far, and needs work or is pressed down."""
    near = sliding(rise=0.5 - 1.9e-7)
    assert verify(near).proved
    assert verify(beside(near, motion, heavy=True)).proved
    assert verify(beside(overhang(), motion, heavy=True)).figures["bound"] == pytest.approx(1.7976931348623157e308)


def test_components_do_not_add_up():
    """Neither falls alone: one lacks the work, of the other too much resists."""
    lazy, other = sliding(rise=0.5 - 2.1e-7), [0, 0, 1.0, 0, 0, 0]
    assert "might hold" in verify(lazy).reason
    assert "might hold" in verify(beside(lazy, other)).reason
    rising = mechanism([GROUND, CUBE], [BASE], {"cube": [0, 0, 1, 0, 0, 0]})
    assert "might hold" in verify(beside(rising, [0, 0, -1.0, 0, 0, 0])).reason


def test_a_boulder_that_touches_counts():
    """What slides, just enough, leaves a boulder behind: the weight of both has to be overcome a million times."""
    near = sliding(rise=0.5 - 1.9e-7)
    boulder = box("boulder", [-10.5, -5, 0], [-0.5, 5, 10])
    bed = box("bed", [-12, -6, -1], [-4, 6, 0], fixed=True)
    near["blocks"] += [boulder, bed]
    side = contact("boulder", "cube", [[-0.5, -0.5, 0], [-0.5, 0.5, 0], [-0.5, 0.5, 1], [-0.5, -0.5, 1]])
    near["contacts"].append(contact("bed", "boulder", level(-10, -5, -5, 5)))
    near["mechanism"]["boulder"] = [0.0] * 6
    assert verify(sealed(near)).proved
    near["contacts"].append(side)
    report = verify(sealed(near))
    assert "might hold" in report.reason
    assert report.figures["bound"] < 2e6 / 1000


def test_never_both():
    """Random models near their limits: forces and a motion made for each, of which at most one is proved."""
    rng, seen = random.Random(7), {"state": 0, "mechanism": 0, "neither": 0}
    for _ in range(200):
        off = rng.choice([-1, 1]) * 10.0 ** rng.uniform(-12, -3)
        blocks, joints, rows, motion, gravity = rng.choice([_slides, _tips, _drops])(off, rng)
        held = verify(state(blocks, joints, rows, gravity=gravity)).proved
        falls = verify(mechanism(blocks, joints, motion, gravity=gravity)).proved
        assert not (held and falls), off
        seen["state" if held else "mechanism" if falls else "neither"] += 1
    assert min(seen.values()) > 5, seen


def _slides(off, rng):
    """On a slope that is too steep by `off`, with as much friction as there is."""
    mu = rng.uniform(0.1, 0.9)
    slope = mu * (1 + off)
    used = min(slope, mu)
    rows = [[-used * W / 4 * (1 + s * slope), 0, W / 4 * (1 + s * slope)] for s in (-1, 1, 1, -1)]
    base = contact("ground", "cube", level(-0.5, -0.5, 0.5, 0.5), mu * (1 + 1e-15))
    rise = mu * (1 - rng.choice([0, 1e-7, 1e-8]))
    return [GROUND, CUBE], [base], rows, {"cube": [1, 0, rise, 0, 0, 0]}, (slope * G, 0, -G)


def _tips(off, rng):
    """Supported up to `off` beyond its middle, on the edge."""
    certificate = overhang(-off / 4)
    rows = [[0, s * W / 4, W / 2] if k in (1, 2) else [0, 0, 0] for k, s in enumerate((0, 1, -1, 0))]
    return certificate["blocks"], certificate["contacts"], rows, certificate["mechanism"], (0, 0, -G)


def _drops(off, rng):
    """The key, about the friction at which it has to be thrust by a million weights."""
    mu = 1e-6 / math.sqrt(8) * (1 + off)
    rows = [[W / 8 / mu * (1 + 1e-15), 0, s * W / 8] for s in (1, -1) for _ in range(4)]
    return *key(mu), rows, {"key": [0, 0, -1, 0, 0, 0]}, (0, 0, -G)
