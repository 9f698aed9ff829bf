"""Trees written by hand: the cells cover all coupled states, and each is empty.

The H frame: a beam of weight w, 1 m long and 0.3 m deep and high, squeezed between two fixed columns by two faces of
four points each, eps = 1, eta = 10, beta_min = 0.01. Rigid-block equilibrium calls it stable with any friction at all
(press hard enough); but no displacement makes both ends overlap by eps at opposite points.
"""

import copy
import dataclasses
import json
import math
import sys
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.proof import checker, verify, verify_file
from damages import REMOVE, at, changed, differs, places, resealed, substitutes
from laws import examples, some
from test_proof_checker import BASE, CUBE, GROUND, RHO, G, box, contact, cube_on_ground, overhang, sealed, state
from test_proof_cra_state import BOUNDS, COUPLED
from test_proof_laws import cross, moved

HALF, LEVER = 0.15, 0.5  # half of the section, half of the length
CORNERS = [(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)]  # (y, z), in the order of the points
WEIGHT = RHO * G * (2 * LEVER) * (2 * HALF) ** 2
NOTHING = {"mechanism": {"beam": [0.0] * 6}}


def tree(model, root, **bounds):
    """Make a cra-tree of another certificate's model."""
    rest = {k: v for k, v in model.items() if k not in ("forces", "mechanism", *BOUNDS)}
    return sealed({**copy.deepcopy(rest), "kind": "cra-tree", "tree": copy.deepcopy(root), **{**BOUNDS, **bounds}})


def frame_model(mu):
    """Points 0 to 3 at the left end, where N points into the beam, 4 to 7 at the right end, where it points out."""
    left, right = (box(n, [x, -2, -3], [x + 1, 2, 3], fixed=True) for n, x in (("left", -1.5), ("right", 0.5)))
    beam = box("beam", [-LEVER, -HALF, -HALF], [LEVER, HALF, HALF])
    ends = [
        contact(a, b, [(x, *c) for c in CORNERS], mu)
        for a, b, x in (("left", "beam", -LEVER), ("beam", "right", LEVER))
    ]
    return state([left, beam, right], ends, [[0, 0, 0]] * 8)


# --- the smallest trees: a leaf --------------------------------------------------------------------------------------


def virtual_work(mu=0.1, share=1.0):
    """One leaf with both. Points carry mu fn at most, so sum fn >= w / mu, and what the forces do in a displacement is
    at least eps w / mu + beta_min w; but no point slides by more than eta, so the weight does at most eta w. Empty if

        eps / mu + beta_min > eta,   mu < 1 / 9.99

    y: down by `share` of that (then v = 0 up to share = 1); w: an eighth of the weight at each point.
    """
    down = -(1 / mu + 0.01) * share
    forces = [[0, 0, -WEIGHT / 8]] * 4 + [[0, 0, WEIGHT / 8]] * 4
    return tree(frame_model(mu), {"mechanism": {"beam": [0, 0, down, 0, 0, 0]}, "forces": forces})


def falls_over():
    """A mechanism of rigid-block equilibrium refutes every coupled state too: a tree of one leaf."""
    return tree(overhang(), {"mechanism": overhang()["mechanism"]})


@pytest.mark.parametrize(("mu", "proved"), [(0.05, True), (0.1, True), (0.1001, True), (0.1002, False), (0.2, False)])
def test_virtual_work_closes_the_root_up_to_the_friction_by_hand(mu, proved):
    report = verify(virtual_work(mu, share=1 - 1e-12))
    assert report.proved is proved, report.reason
    by_hand = (1 / mu + 0.01 - 10) / (1 / mu + 0.01 + 10)
    assert report.figures["least_margin"] == pytest.approx(by_hand, abs=1e-9)
    assert {k: report.figures[k] for k in ("nodes", "leaves", "depth")} == {"nodes": 1, "leaves": 1, "depth": 0}


def test_claim_names_the_bounds():
    claim = verify(virtual_work()).claim
    assert claim == ("unstable under coupled rigid-block analysis (eta = 10 eps, beta_min = 0.01 eps, listed contacts)")
    wide = tree(frame_model(0.1), virtual_work()["tree"], eta=9.0)
    assert "eta = 9 eps" in verify(wide).claim


@pytest.mark.parametrize(("eta", "proved"), [(10.0099, True), (10.0101, False)])
def test_virtual_work_depends_on_eta(eta, proved):
    assert verify(tree(frame_model(0.1), virtual_work(share=1 - 1e-12)["tree"], eta=eta)).proved is proved


@pytest.mark.parametrize(("beta", "proved"), [(0.0099, False), (0.0101, True)])
def test_virtual_work_depends_on_beta_min(beta, proved):
    """At eta = 10.01 sliding by beta_min decides; the displacement y must be that for the smaller beta_min."""
    leaf = virtual_work(share=1 - 1e-12)["tree"]
    leaf["mechanism"]["beam"][2] = -(10 + beta) * (1 - 1e-12)
    assert verify(tree(frame_model(0.1), leaf, eta=10.01, beta_min=beta)).proved is proved


def test_a_displacement_beyond_what_friction_forgives_pays_by_the_largest_thrust():
    """share > 1: v > 0 costs v times a bound of sum fn that is far from sharp."""
    assert verify(virtual_work(0.05, share=1.000001)).proved
    assert not verify(virtual_work(0.05, share=1.1)).proved


def test_out_of_balance_forces_pay_by_the_largest_displacement():
    """What w leaves of the weight counts with the largest displacement that any motion can have, hundreds of eps."""
    leaf = virtual_work(0.05)["tree"]
    for missing, proved in ((1e-6, True), (0.5, False), (1.0, False)):
        other = {**leaf, "forces": [[x * (1 - missing) for x in row] for row in leaf["forces"]]}
        assert verify(tree(frame_model(0.05), other)).proved is proved, missing
    turned = copy.deepcopy(leaf)
    turned["forces"][0][0], turned["forces"][2][0] = WEIGHT, -WEIGHT  # a couple: only moments are left
    assert not verify(tree(frame_model(0.05), turned)).proved


def test_moments_are_about_the_centre_of_mass():
    """Forces that leave a millionth of the weight, 4 m aside of where the model is drawn and 8 m behind."""
    leaf = virtual_work(0.05)["tree"]
    leaf["forces"] = [[x * (1 - 1e-6) for x in row] for row in leaf["forces"]]
    there = {**frame_model(0.05), "tolerance": 1e-9}
    assert verify(tree(moved(there, lambda p: [p[0] + 4.0, p[1] + 8.0, p[2]]), leaf)).proved


def test_a_mechanism_closes_the_root_alone():
    report = verify(falls_over())
    assert report.proved
    assert report.figures["least_margin"] == 1


def test_long_numbers_count_as_more_points(monkeypatch):
    """A speed of 1e-100 m/s makes integers of over 256 bits, and of fewer than 512."""
    short = falls_over()
    leaf = copy.deepcopy(short["tree"])
    next(iter(leaf["mechanism"].values()))[1] = 1e-100
    long = tree(overhang(), leaf)
    each = sum(len(joint["polygon"]) for joint in short["contacts"]) + len(short["blocks"])
    for visits, proved in ((each - 1, (False, False)), (each, (True, False)), (2 * each, (True, True))):
        monkeypatch.setattr(checker, "VISITS", visits)
        assert (verify(short).proved, verify(long).proved) == proved


def test_opposite_points_cannot_both_engage():
    """The forces leaf by hand: unit pushes at two opposite points cancel on the beam, and do -eps of work each."""
    push = [[0.0] * 3 for _ in range(8)]
    push[0], push[4] = [1.0, 0, 0], [1.0, 0, 0]
    root = {"point": 0, "engaged": {"point": 4, "engaged": {"forces": push}, "unloaded": NOTHING}, "unloaded": NOTHING}
    report = verify(tree(frame_model(0.05), root))
    assert "tree node 3" in report.reason  # node 2, that leaf, is closed
    assert report.figures["leaves"] == 2
    assert "tree node 0" in verify(tree(frame_model(0.05), {"forces": push})).reason  # not engaged: not closed


# --- the H frame, a complete tree ------------------------------------------------------------------------------------


def pushes(points):
    rows = [[0.0] * 3 for _ in range(8)]
    for k in points:
        rows[k] = [1.0, 0, 0]
    return {"forces": rows}


def turning(left, right, mu):
    """Mechanism of a beam that is held at some corners on the left and at others on the right, if these sets can be
    separated in the section: it turns about the line between them, so that all of them open, and slips down.

    With g half the gap between the sets, all open by g, and points slide by LEVER at most from turning: it may go down
    by t if g >= mu (LEVER + t); half of that t is used.
    """
    if not (left and right):
        return {"mechanism": {"beam": [1.0 if left else -1.0, 0, -0.5 / mu, 0, 0, 0]}}
    apart = [
        sum(CORNERS[i][j] for i in left) / len(left) - sum(CORNERS[i][j] for i in right) / len(right) for j in (0, 1)
    ]
    u = [x / math.hypot(*apart) for x in apart]
    along = [c[0] * u[0] + c[1] * u[1] for c in CORNERS]
    low, high = min(along[i] for i in left), max(along[i] for i in right)
    down = ((low - high) / 2 / mu - LEVER) / 2
    # x-displacement u.(y, z) - middle = wy z - wz y + vx
    return {"mechanism": {"beam": [-(low + high) / 2, 0, -down, 0, u[1], -u[0]]}}


def frame_tree(mu):
    """Pair by pair of opposite points: either the left one engages, then the right one cannot, or the left one is
    unloaded. Of the 16 ways all but two can be separated. The two diagonals cross: but if all four engage, the mean of
    the displacements on one diagonal is that on the other, and opposite.
    """

    def pair(i, left, right):
        if i == 4:
            return diagonals(left, right) if left in ((0, 2), (1, 3)) else turning(left, right, mu)
        blocked = {"point": i + 4, "engaged": pushes([i, i + 4]), "unloaded": pair(i + 1, (*left, i), right)}
        return {"point": i, "engaged": blocked, "unloaded": pair(i + 1, left, (*right, i))}

    def diagonals(left, right):
        one, two = right
        crossed = pushes([*left, one + 4, two + 4])
        second = {"point": two + 4, "engaged": crossed, "unloaded": turning(left, (one,), mu)}
        return {"point": one + 4, "engaged": second, "unloaded": turning(left, (two,), mu)}

    return pair(0, (), ())


def frame(mu=0.2):
    return tree(frame_model(mu), frame_tree(mu))


def test_the_frame_is_refuted_by_hand():
    """Cells with one corner against three: g = HALF / sqrt 2, so this tree works for mu < g / LEVER = 0.2121."""
    report = verify(frame())
    assert report.proved, report.reason
    assert {k: report.figures[k] for k in ("nodes", "leaves", "depth")} == {"nodes": 69, "leaves": 35, "depth": 8}
    assert 0 < report.figures["least_margin"] <= 1
    assert verify(frame(0.2121)).proved
    assert "does not exclude" in verify(frame(0.2122)).reason


def test_the_frame_has_a_state_of_rigid_block_equilibrium():
    """Each end pushes 5 w / 2 mu at each corner, with friction of w / 8 upward on the beam."""
    model = frame_model(0.2)
    push = WEIGHT / 8 / 0.2 * (1 + 1e-9)
    rows = [[push, 0, WEIGHT / 8]] * 4 + [[push, 0, -WEIGHT / 8]] * 4
    assert verify(state(model["blocks"], model["contacts"], rows)).proved


# --- sectors and speeds ----------------------------------------------------------------------------------------------


def ray(degrees):
    """In the plane of the left end, N = +x: counter-clockwise from y to z."""
    return [0.0, math.cos(math.radians(degrees)), math.sin(math.radians(degrees))]


def fan(*degrees, point=0, parts=None, leaf=None):
    leaf = leaf or virtual_work(0.05)["tree"]
    return {"point": point, "rays": [ray(d) for d in degrees], "sectors": [leaf] * (parts or len(degrees))}


def refined(first, which, *degrees):
    root = fan(*first)
    root["sectors"][which] = fan(*degrees, parts=len(degrees) + 1)
    return root


GOOD = {
    "three": fan(0, 120, 240),
    "begun anywhere": fan(250, 10, 130),
    "five": fan(0, 10, 20, 190, 300),
    "off the plane": {**fan(0, 120, 240), "rays": [[7.0, 1, 0], [-3.0, -1, 2], [0.5, -1, -2]]},
    "long and short": {**fan(0, 120, 240), "rays": [[0, 1e30, 0], [0, -1e-30, 2e-30], [0, -1, -2]]},
    "halved": refined((0, 120, 240), 1, 180),
    "in three": refined((0, 120, 240), 2, 250, 359),
    "other end": fan(0, 120, 240, point=5),
}
BAD = {
    "two half turns": (fan(0, 180), "180 degrees"),
    "one ray": (fan(0), "180 degrees"),
    "wide": (fan(0, 90, 179), "180 degrees"),
    "clockwise": (fan(0, 240, 120), "180 degrees"),
    "one twice": (fan(0, 0, 120, 240), "180 degrees"),
    "along N": ({**fan(0, 120, 240), "rays": [[1.0, 0, 0], ray(120), ray(240)]}, "180 degrees"),
    "no direction": ({**fan(0, 120, 240), "rays": [[0, 0, 0], ray(120), ray(240)]}, "180 degrees"),
    "twice round": (fan(0, 120, 240, 1, 121, 241), "more than once"),
    "twice round in long steps": (fan(0, 144, 288, 72, 216), "more than once"),
    "too few sectors": (fan(0, 120, 240, parts=2), "2 sectors for 3 rays"),
    "too many sectors": (fan(0, 120, 240, parts=4), "4 sectors for 3 rays"),
    "outside": (refined((0, 120, 240), 0, 130), "180 degrees"),
    "on the edge": (refined((0, 120, 240), 0, 120), "180 degrees"),
    "backwards": (refined((0, 120, 240), 0, 80, 40), "180 degrees"),
    "once round inside": (refined((0, 120, 240), 0, 110, 230, 350), "leave the sector"),
    "no rays": ({"point": 0, "rays": [], "sectors": []}, "no rays"),
    "no rays, two sectors": ({"point": 0, "rays": [], "sectors": [NOTHING, NOTHING]}, "no rays"),
    "sectors missing": ({"point": 0, "rays": [ray(0), ray(120), ray(240)]}, "missing: sectors"),
}


@pytest.mark.parametrize("name", GOOD)
def test_sectors_that_cover(name):
    report = verify(tree(frame_model(0.05), GOOD[name]))
    assert report.proved, report.reason


@pytest.mark.parametrize("name", BAD)
def test_sectors_that_do_not_cover(name):
    root, reason = BAD[name]
    report = verify(tree(frame_model(0.05), root))
    assert not report.proved
    assert reason in report.reason, report.reason


@settings(max_examples=examples(60), deadline=None)
@given(st.lists(st.integers(0, 359), min_size=1, max_size=7), st.integers(0, 7))
def test_sectors_agree_with_angles(degrees, point):
    """At the right end N = +x too; sorted or not, whatever the gaps: the checker sees what the angles say."""
    steps = [(b - a) % 360 for a, b in zip(degrees, [*degrees[1:], degrees[0]], strict=True)]
    good = all(0 < s < 180 for s in steps) and sum(steps) == 360
    assert verify(tree(frame_model(0.05), fan(*degrees, point=point))).proved is good


def by_speed(*speeds, point=0):
    leaf = virtual_work(0.05)["tree"]
    node = leaf
    for speed in speeds:
        node = {"point": point, "speed": speed, "slower": leaf, "faster": node}
    return node


def test_speeds():
    assert verify(tree(frame_model(0.05), by_speed(3.0))).proved
    assert verify(tree(frame_model(0.05), by_speed(5.0, 3.0, 0.001))).proved
    for root in (by_speed(0.0), by_speed(-1.0), by_speed(10.0), by_speed(11), by_speed(3.0, 3.0), by_speed(1.0, 3.0)):
        assert "not inside the interval" in verify(tree(frame_model(0.05), root)).reason
    for speed, reason in ((math.nan, "finite"), (None, "not a number"), ("3", "not a number"), (True, "not a number")):
        certificate = {**tree(frame_model(0.05), by_speed(3.0)), "tree": by_speed(speed)}
        assert reason in verify(resealed(certificate)).reason


# --- the leaf test, in cells of its own ------------------------------------------------------------------------------


def margin(certificate, leaf, change=lambda case, k: {}):
    """What a leaf has to spare in a cell, and the size of what it compares; `change` says what is known at point k."""
    sheet = checker._read(tree(certificate, leaf))
    case = checker._case(checker._weigh(sheet))
    zones = [
        dataclasses.replace(checker._Zone(False, False, None, 0, case.eta), **change(case, k))
        for k in range(len(case.spots))
    ]
    spare, size = checker._margin(case, zones, sheet.tree[0])
    return float(spare), float(size)


def between(slow, fast):
    return lambda case, _: {"slow": int(slow * 2**case.per), "fast": int(fast * 2**case.per)}


def within(case, k, *rays):
    return tuple(checker._ray(row, case.spots[k].patch.normal) for row in rays)


def test_slow_points_move_less_and_fast_points_rub_more():
    """At mu = 1/8: eps / mu = 8. Slower than 7 everywhere, the weight does 7 w at most; faster than 3, friction does
    3 w at least, so that y may go down by 8 + 3.
    """

    def down(by):
        leaf = copy.deepcopy(virtual_work(0.125)["tree"])
        leaf["mechanism"]["beam"][2] = -by
        return leaf

    model = frame_model(0.125)
    assert margin(model, down(8.0))[0] == pytest.approx((8 - 10) * WEIGHT)
    assert margin(model, down(8.0), between(0, 7))[0] == pytest.approx((8 - 7) * WEIGHT)
    assert margin(model, down(11.0), between(3, 10))[0] == pytest.approx((11 - 10) * WEIGHT)
    assert margin(model, down(11.1), between(3, 10))[0] < 0
    assert margin(model, down(11.0), between(2.9, 10))[0] < 0


def test_points_of_one_line_cannot_slide_towards_each_other():
    """Points 0 and 1 lie on a line along y, on one block: their displacements along it are equal. In sectors of 30
    degrees about +y and -y, at a speed of at least 2, pushes against both sectors do -2 cos 30 of work each.
    """
    rows = [[0, -1.0, 0], [0, 1.0, 0], *[[0, 0, 0]] * 6]
    tan = math.tan(math.radians(30))

    def towards(case, k):
        y = 1.0 if k == 0 else -1.0
        rays = [0.3, y, -tan * y], [-2, y, tan * y]  # the part along N is of no account
        return {"sector": within(case, k, *rays), **between(2, 10)(case, k)} if k < 2 else {}

    spare, size = margin(frame_model(0.5), {"forces": rows}, towards)
    assert spare == size == pytest.approx(4 * math.cos(math.radians(30)))
    apart = {"forces": [[-x for x in row] for row in rows]}
    assert margin(frame_model(0.5), apart, towards)[0] == pytest.approx(-2 * 10)  # straight along w: |w_t| eta


def test_friction_in_a_sector_does_less_against_a_motion():
    """A cube on a slope of 0.8, mu = 1. A coupled state slides down, +x; in a cell where all points slide across,
    within 45 degrees of y, it would need more friction than there is: y = (1, 0, mu cos 45).
    """
    model = {**cube_on_ground(), "gravity": [0.8 * G, 0, -G], "contacts": [{**BASE, "mu": 1.0}]}
    c = math.cos(math.pi / 4)
    leaf = {"mechanism": {"cube": [1, 0, c * (1 + 1e-12), 0, 0, 0]}}

    def across(case, k):
        return {"sector": within(case, k, [1, 1, 0], [-1, 1, 0])}

    assert margin(model, leaf, across)[0] == pytest.approx((0.8 - c) * RHO * G)
    assert margin(model, leaf)[0] < 0
    assert margin(model, leaf, lambda case, k: {"unloaded": True})[0] > 0
    steep = {"mechanism": {"cube": [1, 0, c * 0.99, 0, 0, 0]}}
    assert margin(model, steep, across)[0] < 0


def test_a_motion_that_presses_pays_whatever_friction_does():
    """A cube that stands. y = down by 1.005 eps gains 0.005 w, but presses: v = 0.005, of which friction, that would
    have to slide by beta_min, takes nothing back; and sum fn may be large.
    """
    forces = [[0, 0, -RHO * G / 4]] * 4
    leaf = {"mechanism": {"cube": [0, 0, -1.005, 0, 0, 0]}, "forces": forces}
    model = cube_on_ground()
    sheet = checker._read(tree(model, leaf))
    thrust = float(checker._reach(checker._weigh(sheet)).thrust)
    assert margin(model, leaf)[0] == pytest.approx(0.005 * (RHO * G - thrust))
    assert margin(model, leaf)[0] < 0


def test_a_couple_that_is_left_counts():
    """Points across from each other along a diagonal can both engage: the beam turns. Pushes there leave a couple."""

    def engaged(case, k):
        return {"engaged": k in (0, 6)}

    assert margin(frame_model(0.5), pushes([0, 6]), engaged)[0] < 0
    assert margin(frame_model(0.5), pushes([0, 4]), lambda case, k: {"engaged": k in (0, 4)})[0] == 2


def test_loads_count_as_weights_do():
    """Half of the beam's weight as density, half as a load at its centre; a load that is not there to w alone."""
    model, leaf = frame_model(0.05), virtual_work(0.05)["tree"]
    whole = margin(model, leaf)
    half = copy.deepcopy(model)
    half["blocks"][1]["density"] = RHO / 2
    half["loads"] = [{"block": "beam", "force": [0, 0, -WEIGHT / 2], "point": [0, 0, 0]}]
    assert margin(half, leaf) == pytest.approx(whole, rel=1e-12)
    assert margin(half, pushes([0, 4]), lambda case, k: {"engaged": k in (0, 4)})[0] == 2


@settings(max_examples=examples(100), deadline=None)
@given(
    st.sampled_from([[1.0, 0, 0], [0, -1.0, 0], [1.0, 2.0, 2.0], [-0.3, 0.7, 0.2]]),
    st.tuples(*[st.floats(-1, 1).map(lambda x: round(x, 3))] * 3),
    st.floats(0, 6.3).map(lambda x: round(x, 6)),
    st.floats(0.01, 3.1),
)
def test_the_farthest_in_a_sector_agrees_with_angles(normal, x, start, width):
    """cos of the angle between x_t and the sector, in floats."""
    size = math.hypot(*normal)
    n = [v / size for v in normal]
    u = cross(n, [0.6, 0.0, 0.8])
    u = [v / math.hypot(*u) for v in u]
    v = cross(n, u)
    whole = checker._vector(normal, 100)
    n2 = checker._dot(whole, whole)
    sizes = math.isqrt(n2 << 128), checker._root_above(n2 << 128)
    spot = checker._Spot(SimpleNamespace(normal=whole, normal2=n2), *sizes)
    rays = [
        [math.cos(t) * a + math.sin(t) * b + 0.3 * c for a, b, c in zip(u, v, n, strict=True)]
        for t in (start, start + width)
    ]
    one, two = (checker._ray(ray, whole) for ray in rays)
    along, across = (sum(a * b for a, b in zip(x, axis, strict=True)) for axis in (u, v))
    angle = (math.atan2(across, along) - start) % (2 * math.pi)
    off = 0.0 if angle <= width else min(angle - width, 2 * math.pi - angle)
    scale = 2.0 ** (checker.ROOT_BITS + 100)
    found = checker._farthest(checker._vector(x, 100), spot, (one, two)) / scale
    assert found == pytest.approx(math.hypot(along, across) * math.cos(off), abs=1e-12)
    assert checker._farthest(checker._vector(x, 100), spot, None) / scale == pytest.approx(
        math.hypot(along, across), abs=1e-12
    )


# --- laws ------------------------------------------------------------------------------------------------------------

small = st.floats(-1, 1).map(lambda x: round(x, 3))
triples = st.tuples(small, small, small)


@settings(max_examples=examples(150), deadline=None)
@given(st.data())
def test_no_leaf_excludes_a_state_that_is_in_its_cell(data):
    """The law that matters. Two cubes with random forces and a random displacement that are coupled; loads that balance
    them; a random cell around them; a random leaf, or the worst one there is (y = dq, w = -f): no margin is positive.
    """
    draw = data.draw
    mu, eps, eta, beta = draw(st.sampled_from([0.0, 0.3, 1.0, 3.0])), 1.0, draw(st.sampled_from([1.0, 10.0])), 0.01
    upper = box("upper", [-0.5, -0.5, 1], [0.5, 0.5, 2])
    joints = [contact("ground", "cube", BASE["polygon"], mu)]
    joints.append(contact("upper", "cube", [[x, y, 1.0] for x, y, _ in reversed(BASE["polygon"])], mu))
    model = {**cube_on_ground(), "blocks": [GROUND, CUBE, upper], "contacts": joints, "gravity": [0, 0, -G]}
    points = [(joint, p) for joint in joints for p in joint["polygon"]]
    motion = {name: [*draw(triples), *draw(triples)] for name in ("cube", "upper")}
    moves = [relative(motion, joint, p) for joint, p in points]
    normals = [1.0 if k < 4 else -1.0 for k in range(8)]
    scale = min(
        min((-eps / (n * m[2]) for n, m in zip(normals, moves, strict=True) if n * m[2] < 0), default=1e9),
        min((eta / max(abs(m[2]), math.hypot(m[0], m[1]), 1e-9) for m in moves), default=1e9),
    ) * draw(st.sampled_from([1.0, 0.5]))
    motion = {name: [scale * x for x in row] for name, row in motion.items()}
    moves = [[scale * x for x in m] for m in moves]
    forces, known = [], []
    for n, m in zip(normals, moves, strict=True):
        slide, engaged = math.hypot(m[0], m[1]), abs(n * m[2] + eps) < 1e-9
        push = draw(st.integers(0, 3000)) * 10.0 if engaged else 0.0
        rub = draw(st.sampled_from([0.0, 0.5, 1.0])) * mu * push / slide if slide >= beta else 0.0
        forces.append([-rub * m[0], -rub * m[1], n * push])
        known.append(draw(zone(engaged, push == 0.0, m, eta)))
    model["loads"] = balancing(model, points, forces)
    rows = draw(st.lists(triples, min_size=8, max_size=8))
    rows = draw(st.sampled_from([[[-x for x in f] for f in forces], [[1e4 * x for x in row] for row in rows]]))
    y = draw(st.sampled_from([motion, {name: [*draw(triples), *draw(triples)] for name in motion}]))
    leaf = draw(st.sampled_from([{"mechanism": y, "forces": rows}, {"mechanism": y}, {"forces": rows}]))
    bounds = {"eps": eps, "eta": eta, "beta_min": beta}

    def change(case, k):
        rays, slow, fast, status = known[k]
        sector = within(case, k, *rays) if rays else None
        whole = 2.0**case.per
        return {"sector": sector, "slow": int(slow * whole), "fast": int(fast * whole), **status}

    spare, size = margin({**model, **bounds}, leaf, change)
    assert spare <= 1e-9 * size


@st.composite
def zone(draw, engaged, unloaded, move, eta):
    """A cell around what happens at a point: rays, speeds, status."""
    slide, angle = math.hypot(move[0], move[1]), math.atan2(move[1], move[0])
    wide = st.sampled_from([0.0, 1e-6, 0.3, 1.5])
    one, two = draw(wide), draw(wide)
    rays = []
    if one + two > 0 and slide > 1e-6 and draw(st.booleans()):
        rays = [[math.cos(t), math.sin(t), draw(small)] for t in (angle - one - 1e-12, angle + two + 1e-12)]
    slow = draw(st.sampled_from([0.0, slide * (1 - 1e-12)]))
    fast = draw(st.sampled_from([eta, slide * (1 + 1e-12)]))
    status = {"engaged": engaged and draw(st.booleans())}
    if unloaded and not status["engaged"]:
        status["unloaded"] = draw(st.booleans())
    return rays, slow, fast, status


def relative(motion, joint, point):
    """Displacement of b against that of a; cubes are centred above the origin."""
    heights = {"cube": 0.5, "upper": 1.5}

    def move(name):
        if name == "ground":
            return [0.0] * 3
        turned = cross(motion[name][3:], [point[0], point[1], point[2] - heights[name]])
        return [a + b for a, b in zip(motion[name][:3], turned, strict=True)]

    return [b - a for a, b in zip(move(joint["a"]), move(joint["b"]), strict=True)]


def balancing(model, points, forces):
    """A load for every contact force, opposite and at the same place, on each block; and one for each weight."""
    loads = [
        {"block": name, "force": [0, 0, RHO * G], "point": [0, 0, z]} for name, z in (("cube", 0.5), ("upper", 1.5))
    ]
    for (joint, p), f in zip(points, forces, strict=True):
        loads += [
            {"block": joint[side], "force": [sign * x for x in f], "point": list(p)}
            for side, sign in (("a", 1), ("b", -1))
            if joint[side] != "ground"
        ]
    return loads


@settings(max_examples=examples(60), deadline=None)
@given(triples, triples, triples, triples, st.sampled_from([1.0, 20.0]))
def test_no_motion_within_the_bounds_exceeds_its_reach(v1, w1, v2, w2, eta):
    """Displacements that use up the bounds somewhere: centres and rotations stay below the a-priori bounds."""
    upper = box("upper", [-0.25, -0.5, 1], [0.75, 0.5, 2])
    joint = contact("cube", "upper", [[-0.25, -0.5, 1], [0.5, -0.5, 1], [0.5, 0.5, 1], [-0.25, 0.5, 1]])
    model = {**cube_on_ground(), "blocks": [GROUND, CUBE, upper], "contacts": [BASE, joint]}
    sheet = checker._read(tree(model, {"mechanism": {"cube": [0] * 6, "upper": [0] * 6}}, eta=eta))
    reach = checker._reach(checker._weigh(sheet))
    centres = {"cube": [0, 0, 0.5], "upper": [0.25, 0, 1.5]}
    motion = {"cube": (v1, w1), "upper": (v2, w2), "ground": ((0, 0, 0), (0, 0, 0))}

    def move(name, p):
        v, w = motion[name]
        arm = [a - b for a, b in zip(p, centres.get(name, (0, 0, 0)), strict=True)]
        return [a + b for a, b in zip(v, cross(w, arm), strict=True)]

    most = 1e-9
    for contact_ in model["contacts"]:
        for p in contact_["polygon"]:
            d = [b - a for a, b in zip(move(contact_["a"], p), move(contact_["b"], p), strict=True)]
            most = max(most, -d[2] / 1.0, d[2] / eta, math.hypot(d[0], d[1]) / eta)
    for i, name in ((1, "cube"), (2, "upper")):
        v, w = motion[name]
        assert math.hypot(*v) / most <= reach.shifts[i] / 2**reach.per_shift * (1 + 1e-9)
        assert math.hypot(*w) / most <= reach.turns[i] / 2**reach.per_turn * (1 + 1e-9)
    assert reach.shifts[0] == reach.turns[0] == 0


def test_reach_by_hand():
    """A cube on the ground, eta = 10: D = sqrt 200. From a corner, e1 is the diagonal, e2 a side, |n| = 1:
    Omega = 2 D / sqrt 2 + 2 D (sqrt 2 + 1), V = D + Omega sqrt(3/4); sum fn <= W V / eps.
    """
    sheet = checker._read(tree(cube_on_ground(), {"mechanism": {"cube": [0] * 6}}))
    reach = checker._reach(checker._weigh(sheet))
    d, root = math.sqrt(200), math.sqrt(2)
    omega = 2 * d / root + 2 * d * (root + 1)
    v = d + omega * math.sqrt(0.75)
    assert reach.turns[1] / 2**reach.per_turn == pytest.approx(omega, rel=1e-12)
    assert reach.shifts[1] / 2**reach.per_shift == pytest.approx(v, rel=1e-12)
    assert float(reach.thrust) == pytest.approx(v * RHO * G, rel=1e-12)


def test_thrust_of_a_load_by_hand():
    """No gravity: a load of 3 N half a metre beside the centre does 3 V + 1.5 Omega of work at most."""
    load = {"block": "cube", "force": [0, 0, -3.0], "point": [0.5, 0, 1.0]}
    model = {**cube_on_ground(), "gravity": [0, 0, 0], "loads": [load]}
    sheet = checker._read(tree(model, {"mechanism": {"cube": [0] * 6}}, eps=2.0))
    reach = checker._reach(checker._weigh(sheet))
    shift, turn = reach.shifts[1] / 2**reach.per_shift, reach.turns[1] / 2**reach.per_turn
    assert float(reach.thrust) == pytest.approx((3 * shift + 1.5 * turn) / 2, rel=1e-12)


def test_reach_up_a_stack_by_hand():
    """Each level turns by Omega against the one below: V2 = V1 + Omega l + D + 2 Omega l, l = sqrt(3/4)."""
    upper = box("upper", [-0.5, -0.5, 1], [0.5, 0.5, 2])
    joint = contact("cube", "upper", [[x, y, 1] for x, y, _ in BASE["polygon"]])
    model = {**cube_on_ground(), "blocks": [GROUND, CUBE, upper], "contacts": [joint, BASE]}
    sheet = checker._read(tree(model, {"mechanism": {"cube": [0] * 6, "upper": [0] * 6}}))
    reach = checker._reach(checker._weigh(sheet))
    d, arm = math.sqrt(200), math.sqrt(0.75)
    omega = 2 * d / math.sqrt(2) + 2 * d * (math.sqrt(2) + 1)
    assert reach.turns[2] / 2**reach.per_turn == pytest.approx(2 * omega, rel=1e-12)
    assert reach.shifts[2] / 2**reach.per_shift == pytest.approx(2 * d + 4 * omega * arm, rel=1e-12)


@pytest.mark.parametrize("build", COUPLED)
def test_thrust_of_every_hand_made_state_is_within_its_bound(build):
    certificate = build()
    sheet = checker._read(tree(certificate, {"mechanism": certificate["mechanism"]}))
    thrust = sum(f[2] for f in certificate["forces"])
    assert thrust <= float(checker._reach(checker._weigh(sheet)).thrust)


def mapped(node, vector, flip=False):
    """Turn a whole tree: all vectors and motions by `vector`, rays in reversed order if `flip`."""
    if isinstance(node, list):
        return [mapped(x, vector, flip) for x in node]
    result = dict(node)
    for key in ("engaged", "unloaded", "slower", "faster"):
        if key in node:
            result[key] = mapped(node[key], vector, flip)
    if "mechanism" in node:
        result["mechanism"] = {k: vector(v[:3]) + vector(v[3:]) for k, v in node["mechanism"].items()}
    if "forces" in node:
        result["forces"] = [vector(row) for row in node["forces"]]
    if "rays" in node:
        result |= {"rays": [vector(row) for row in node["rays"]], "sectors": mapped(node["sectors"], vector, flip)}
    return result


TREES = [
    frame,
    virtual_work,
    falls_over,
    lambda: frame(0.25),
    lambda: tree(frame_model(0.05), GOOD["in three"]),
    lambda: tree(frame_model(0.05), by_speed(5.0, 3.0)),
    lambda: tree(frame_model(0.05), BAD["twice round"][0]),
]
LAWS = settings(max_examples=examples(15), deadline=None)


def same(certificate, other):
    one, two = verify(certificate), verify(sealed(other))
    assert one.proved == two.proved, (one.reason, two.reason)
    assert one.figures == pytest.approx(two.figures, rel=1e-9, abs=1e-15)
    assert one.claim == two.claim


@LAWS
@given(st.sampled_from(TREES), st.tuples(*[st.integers(-(2**20), 2**20)] * 3), st.sampled_from([(0, 1, 2), (1, 2, 0)]))
def test_place_and_axes_do_not_matter(build, shift, order):
    certificate = build()

    def turn(v):
        return [v[i] for i in order]

    other = moved(certificate, lambda p: turn([math.fsum((x, s)) for x, s in zip(p, shift, strict=True)]))
    if any(shift):  # decimals do not survive being moved: give the tolerance room, and the figures too
        other = moved(certificate, turn)
    other["gravity"] = turn(other["gravity"])
    other["tree"] = mapped(other["tree"], turn)
    same(certificate, other)


exponents = st.integers(-60, 60)


@LAWS
@given(st.sampled_from(TREES), exponents, exponents, exponents)
def test_units_do_not_matter(build, length, weight, displacement):
    certificate = build()
    other = moved(certificate, lambda p: [math.ldexp(x, length) for x in p])
    other["tolerance"] = math.ldexp(other["tolerance"], length)
    for block in other["blocks"]:
        block["density"] = math.ldexp(block["density"], weight)
    for key in BOUNDS:
        other[key] = math.ldexp(other[key], displacement)

    def scaled(node):
        for branch in [
            *node.get("sectors", []),
            *(node[k] for k in ("engaged", "unloaded", "slower", "faster") if k in node),
        ]:
            scaled(branch)
        if "speed" in node:
            node["speed"] = math.ldexp(node["speed"], displacement)
        for row in node.get("forces", []):
            row[:] = [math.ldexp(x, 3 * length + weight) for x in row]
        for row in node.get("mechanism", {}).values():
            row[:] = [math.ldexp(x, displacement - length * (i > 2)) for i, x in enumerate(row)]

    other["tree"] = json.loads(json.dumps(other["tree"]))  # no part of it twice
    scaled(other["tree"])
    same(certificate, other)


@LAWS
@given(st.sampled_from(TREES), st.permutations(range(4)), st.booleans(), st.booleans())
def test_order_and_side_do_not_matter(build, blocks, reverse, swap):
    """Blocks in another order, contacts the other way round, each told from the other side."""
    certificate = build()
    count = len(certificate["blocks"])
    other = {**copy.deepcopy(certificate), "blocks": [certificate["blocks"][i] for i in blocks if i < count]}
    numbers = list(range(4 * len(certificate["contacts"])))
    groups = [numbers[i : i + 4] for i in range(0, len(numbers), 4)]
    if swap:
        groups = [group[::-1] for group in groups]
        for joint in other["contacts"]:
            joint["a"], joint["b"] = joint["b"], joint["a"]
            joint["polygon"].reverse()
    if reverse:
        groups.reverse()
        other["contacts"].reverse()
    old = [k for group in groups for k in group]

    def renumbered(node):
        result = {k: renumbered(v) if k in ("engaged", "unloaded", "slower", "faster") else v for k, v in node.items()}
        if "point" in node:
            result["point"] = old.index(node["point"])
        if "forces" in node:
            result["forces"] = [[-x if swap else x for x in node["forces"][k]] for k in old]
        if "rays" in node:  # -N and -r: the other way round
            result["sectors"] = [renumbered(n) for n in node["sectors"]]
            if swap:
                result["rays"] = [[-x for x in row] for row in node["rays"]][::-1]
                around = len(node["rays"]) == len(node["sectors"])
                parts = result["sectors"][::-1]
                result["sectors"] = [*parts[1:], parts[0]] if around else parts
        return result

    other["tree"] = renumbered(other["tree"])
    same(certificate, other)


# --- refusals and mutants --------------------------------------------------------------------------------------------


def _damage(*path_and_value):
    *path, value = path_and_value

    def change(certificate):
        return changed(certificate, ("tree", *path), value)

    return change


FORCES = [[0.0] * 3] * 8
DAMAGES = [
    (_damage("point", 1), "does not exclude"),
    (_damage("point", 8), "number of a contact point"),
    (_damage("point", -1), "number of a contact point"),
    (_damage("point", True), "number of a contact point"),
    (_damage("point", 0.0), "number of a contact point"),
    (_damage("point", None), "number of a contact point"),
    (_damage("point", REMOVE), "unknown field|missing"),
    (_damage("engaged", REMOVE), "missing: engaged"),
    (_damage("unloaded", REMOVE), "missing: unloaded"),
    (_damage("note", 1), "unknown field: note"),
    (_damage("engaged", {}), "missing: mechanism or forces"),
    (_damage("engaged", []), "not an object"),
    (_damage("engaged", None), "not an object"),
    (_damage("engaged", "point", 0), "already engaged"),
    (_damage("unloaded", "point", 0), "already engaged or unloaded"),
    (_damage("engaged", "engaged", {}), "missing"),
    (_damage("engaged", "engaged", {"forces": FORCES}), "does not exclude"),
    (_damage("engaged", "engaged", {"forces": FORCES[:7]}), "7 forces for 8"),
    (_damage("engaged", "engaged", {"forces": [[0, 0]] * 8}), "2 numbers"),
    (_damage("engaged", "engaged", {"forces": None}), "not a list"),
    (_damage("engaged", "engaged", {"mechanism": {}}), "missing: beam"),
    (_damage("engaged", "engaged", {"mechanism": {"beam": [0] * 5}}), "5 numbers"),
    (_damage("engaged", "engaged", {"mechanism": {"beam": [0] * 6, "left": [0] * 6}}), "unknown field: left"),
    (_damage("engaged", "engaged", {"mechanism": {"beam": [math.nan] * 6}}), "finite"),
    (_damage("engaged", "engaged", {"forces": [[1e101, 0, 0]] * 8}), "absurd magnitude"),
    (lambda c: {**c, "tree": None}, "not an object"),
    (lambda c: {**c, "tree": []}, "not an object"),
    (lambda c: {**c, "tree": {}}, "missing: mechanism or forces"),
    (lambda c: {**c, "eta": 0}, "not positive"),
    (lambda c: {**c, "eps": -1.0}, "not positive"),
    (lambda c: {**c, "beta_min": 20.0}, "not below eta"),
    (lambda c: {**c, "kind": "cra-state"}, "missing: forces"),
    (lambda c: changed(c, ("contacts", 0, "mu"), 0.22), "does not exclude"),
    (lambda c: changed(c, ("contacts", 1, "mu"), 0.22), "does not exclude"),
    (lambda c: {**c, "gravity": [0, 0, G]}, "does not exclude"),
    (lambda c: {**c, "gravity": [0, 0, 0]}, "does not exclude"),
    (
        lambda c: {**c, "contacts": [*c["contacts"], contact("left", "beam", c["contacts"][0]["polygon"])]},
        "8 forces for 12",
    ),
]


@pytest.mark.parametrize(("change", "reason"), DAMAGES)
def test_damages_with_a_good_seal(change, reason):
    report = verify(resealed(change(frame())))
    assert not report.proved
    assert any(part in report.reason for part in reason.split("|")), report.reason


def test_every_leaf_of_the_frame_is_needed():
    """A leaf of a mechanism turned round, made to stand still or to go up, a leaf of forces turned round or weakened on
    one side: refused at just that node. (Smaller changes of a motion that leave it a mechanism are harmless: any motion
    may serve as a witness, and so may any forces.)
    """
    certificate = frame()
    for path in places(certificate["tree"]):
        leaf = at(certificate["tree"], path)
        if path and path[-1] == "mechanism":
            row = leaf["beam"]
            for new in ([-x for x in row], [0.0] * 6, [*row[:2], -row[2], *row[3:]], [0.0, 0.0, *row[2:3], *[0.0] * 3]):
                report = verify(sealed(changed(certificate, ("tree", *path, "beam"), new)))
                assert "does not exclude" in report.reason, (path, new)
            assert verify(sealed(changed(certificate, ("tree", *path, "beam"), [2 * x for x in row]))).proved
        elif path and path[-1] == "forces":
            k = next(i for i, row in enumerate(leaf) if any(row))
            weak = [row if i != k else [0.5, 0, 0] for i, row in enumerate(leaf)]
            for new in ([[-x for x in row] for row in leaf], [[0.0] * 3] * 8, weak):
                assert "does not exclude" in verify(sealed(changed(certificate, ("tree", *path), new))).reason


@pytest.mark.parametrize(
    ("build", "of"), [(virtual_work, list), (lambda: tree(frame_model(0.05), GOOD["halved"]), some)]
)
def test_every_damage_is_answered(build, of):
    """Unsealed refused whatever it is; re-sealed refused for everything that is no number, and never an exception."""
    certificate = json.loads(json.dumps(build()))
    for path in of([*places(certificate)]):
        if path and path[0] in ("tree", "eps", "eta", "beta_min", "kind"):
            old = at(certificate, path)
            for new in substitutes(old):
                if differs(new, old):
                    damaged = changed(certificate, path, new)
                    assert not verify(damaged).proved
                    again = verify(resealed(damaged))
                    assert again.reason.isascii()
                    assert len(again.reason) < 250
                    assert all(math.isfinite(x) for x in again.figures.values())
                    number = isinstance(old, int | float) and isinstance(new, int | float) and not isinstance(new, bool)
                    # A whole leaf part that is left out may leave a proof; turned round, the same forces remain.
                    if not number and not isinstance(new, list) and new is not REMOVE:
                        assert not again.proved, (path, new)


def deep(levels):
    leaf = virtual_work(0.05)["tree"]
    root = leaf
    for i in range(levels):
        root = {"point": 0, "speed": 9.0 - 8 * i / levels, "slower": leaf, "faster": root}
    return root


def test_depth_is_bounded(tmp_path):
    """Deep as allowed passes, from a file too; deeper is refused, however deep."""
    good = by_depth(checker.MAX_DEPTH)
    assert verify(good).proved
    path = tmp_path / "deep.json"
    path.write_text(json.dumps(good))
    assert verify_file(path).figures["depth"] == checker.MAX_DEPTH
    bad = {**good, "tree": deep(checker.MAX_DEPTH + 1)}
    assert "deeper than" in verify(bad).reason
    endless = {"point": 0, "engaged": NOTHING, "unloaded": NOTHING}
    for _ in range(100_000):
        endless = {"point": 0, "engaged": endless, "unloaded": NOTHING}
    assert "deeper than" in verify({**good, "tree": endless}).reason


def by_depth(levels):
    return tree(frame_model(0.05), deep(levels))


def test_a_tree_that_holds_itself_is_refused():
    root = {"point": 0, "engaged": NOTHING, "unloaded": NOTHING}
    root["engaged"] = root
    assert "deeper than" in verify({**virtual_work(), "tree": root}).reason


def test_a_stack_that_is_nearly_full_is_answered():
    """Called from deep down, Python may lack the stack for the seal: refused, without an exception."""
    certificate = by_depth(checker.MAX_DEPTH)
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(_frames() + 120)
    try:
        report = verify(certificate)
    finally:
        sys.setrecursionlimit(limit)
    assert report.proved or "too deep" in report.reason


def _frames():
    frame, count = sys._getframe(), 0
    while frame is not None:
        frame, count = frame.f_back, count + 1
    return count


def test_a_model_that_hangs_on_nothing_is_refused():
    leaf = {"mechanism": {"cube": [0, 0, -1.0, 0, 0, 0]}}
    report = verify(tree({**cube_on_ground(), "contacts": [], "blocks": [GROUND, CUBE]}, leaf))
    assert "hangs on no support" in report.reason
    far = box("far", [7, 7, 7], [8, 8, 8])
    both = {"mechanism": {**overhang()["mechanism"], "far": [0] * 6}}
    other = {**overhang(), "blocks": [*overhang()["blocks"], far]}
    assert "block far hangs on no support" in verify(tree(other, both)).reason


def test_a_model_without_a_free_block_is_refused():
    certificate = tree({**cube_on_ground(), "contacts": [], "blocks": [GROUND]}, {"mechanism": {}})
    assert "no block is free" in verify(certificate).reason


def test_a_stable_cube_has_no_tree_of_one_leaf():
    """Whatever single leaf: the state of `resting` is in the root's cell."""
    for v in (1.0, -1.0, 0.0):
        for f in (1.0, -1.0, 0.0):
            leaf = {"mechanism": {"cube": [0, 0, v, 0, 0, 0]}, "forces": [[0, 0, f * RHO * G / 4]] * 4}
            assert not verify(tree(cube_on_ground(), leaf)).proved
