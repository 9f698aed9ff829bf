"""Coupled states written by hand, and what the checker must say of them and of their neighbours.

A cube of weight W on fixed ground, eps = 1, eta = 10, beta_min = 0.01. Its displacement is given at its centre, half a
side above the base: with a spin w about +y a base corner at x moves by (vx - w / 2, 0, vz - w x).
"""

import copy
import math
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.proof import verify
from damages import REMOVE, at, changed, differs, places, resealed, substitutes
from laws import examples
from test_proof_checker import (
    BASE,
    CUBE,
    GROUND,
    G,
    W,
    box,
    contact,
    cube_on_ground,
    cube_on_slope,
    level,
    pushed_cube,
    sealed,
    state,
)
from test_proof_laws import cross, moved, scaled_rows, split

BOUNDS = {"eps": 1.0, "eta": 10.0, "beta_min": 0.01}
SAID = "(eta = 10 eps, beta_min = 0.01 eps, listed contacts)"
PARTS = ("equilibrium_force", "equilibrium_moment", "gap", "complementarity", "alignment")


def coupled(certificate, motion, **bounds):
    """Make a cra-state of an rbe-state."""
    return sealed({**copy.deepcopy(certificate), "kind": "cra-state", "mechanism": motion, **{**BOUNDS, **bounds}})


def resting():
    """The cube sinks by eps: every corner overlaps by just that. No friction, so no sliding is asked for."""
    return coupled(cube_on_ground(), {"cube": [0, 0, -1, 0, 0, 0]})


def sliding(by=0.5, sink=1.0, spin=0.0, mu=0.5):
    """On a slope of 1/2 friction points uphill, -x: the cube tends to slide down, +x."""
    return coupled(cube_on_slope(mu=mu), {"cube": [by, 0, -sink, 0, 0, spin]})


def tipping(lift=1.0, slide=0.5):
    """On a slope of 45 degrees only the corners at x = 1/2 press: they overlap by eps, the others open by `lift`.

    vz - w / 2 = -1 and vz + w / 2 = lift, so w = lift + 1 and vz = (lift - 1) / 2; vx = slide + w / 2.
    """
    w = lift + 1
    return coupled(cube_on_slope(mu=1.0, slope=1.0), {"cube": [slide + w / 2, 0, (lift - 1) / 2, 0, w, 0]})


def leaning():
    """The cube of `pushed_cube`: friction against the push of W/4, which is along +x."""
    return coupled(pushed_cube(), {"cube": [0.25, 0, -1, 0, 0, 0]})


def two_slabs():
    """Two cubes on a slope, forces as of one each, both sliding: the upper one twice as far."""
    upper = box("upper", [-0.5, -0.5, 1], [0.5, 0.5, 2])
    lower = copy.deepcopy(cube_on_slope(mu=2.0, slope=0.25))
    joint = {"a": "cube", "b": "upper", "polygon": [[x, y, 1.0] for x, y, _ in BASE["polygon"]], "mu": 2.0}
    lower["blocks"].append(upper)
    lower["contacts"].append(joint)
    own = [W / 4 * (1 + sign * 0.25) for sign in (-1, 1, 1, -1)]  # as in cube_on_slope
    both = [W / 2 * (1 + sign * 0.5) for sign in (-1, 1, 1, -1)]  # the resultant of both passes one side above
    lower["forces"] = [[-0.25 * n, 0, n] for n in both + own]
    return coupled(lower, {"cube": [0.5, 0, -1, 0, 0, 0], "upper": [1.0, 0, -2, 0, 0, 0]})


COUPLED = [resting, sliding, tipping, leaning, two_slabs]


@pytest.mark.parametrize("build", COUPLED)
def test_hand_made_states_are_proved(build):
    report = verify(build())
    assert report.proved, report.reason
    assert report.claim == f"stable under coupled rigid-block analysis {SAID}; every block balances exactly"
    assert all(report.figures[part] == 0 for part in PARTS)


def test_figures_by_hand():
    assert verify(resting()).figures["sliding_least"] == 10
    assert verify(sliding()).figures["sliding_least"] == 0.5
    assert verify(sliding(by=0.5, sink=1 - 1e-10)).figures["complementarity"] == pytest.approx(
        1e-10 * 1.5 / 4 / math.hypot(1, 0.5), rel=1e-3
    )
    assert verify(sliding(sink=1 + 1e-10)).figures["gap"] == pytest.approx(1e-10, rel=1e-3)


def test_no_block_free_and_nothing_to_show():
    empty = {**cube_on_ground(), "blocks": [GROUND], "contacts": [], "forces": []}
    assert verify(coupled(empty, {})).proved


REFUSED = [
    (sliding(by=0.0099), "slides by less"),
    (sliding(by=0.0), "slides by less"),
    (sliding(by=-0.5), "does not oppose"),
    (sliding(by=10.001), "more than eta"),
    (sliding(sink=1.001), "overlaps by more"),
    (sliding(sink=0.999), "without overlapping"),
    (sliding(sink=-0.999), "without overlapping"),
    (sliding(spin=1e-6), "does not oppose"),
    (tipping(lift=10.001), "more than eta"),
    (tipping(slide=10.001), "more than eta"),
    (tipping(slide=0.0), "slides by less"),
    (coupled(cube_on_ground(), {"cube": [0, 0, 0, 0, 0, 0]}), "without overlapping"),
    (coupled(cube_on_ground(), {"cube": [0, 0, -1, 0, 1e-6, 0]}), "overlaps by more|without overlapping"),
    (coupled(cube_on_ground(), {"cube": [7.1, 7.1, -1, 0, 0, 0]}), "more than eta"),
]


@pytest.mark.parametrize(("certificate", "reason"), REFUSED)
def test_neighbours_are_refused(certificate, reason):
    report = verify(certificate)
    assert not report.proved
    assert any(part in report.reason for part in reason.split("|")), report.reason
    assert report.claim.endswith(SAID)


THRESHOLDS = [
    (lambda t: sliding(sink=1 + t), 1.0),  # gap
    (lambda t: tipping(lift=10 * (1 + t)), 1.0),  # opening
    (lambda t: sliding(by=10 * (1 + t)), 1.0),  # sliding, at most
    (lambda t: sliding(by=0.01 * (1 - t)), 1.0),  # sliding, at least
    # The corners at x = 1/2 bear fn = 1.5 W/4 and friction of half that; the cube's weight is hypot(1, 1/2) W, which is
    # more than |F|. A spin t moves the corner (x, y) by t (-y, x), so by t/2 across friction.
    (lambda t: sliding(sink=1 - t), 1.5 / 4 / math.hypot(1, 0.5)),
    (lambda t: sliding(spin=t), 1.5 / 4 * 0.5 * 0.5 / math.hypot(1, 0.5)),
]


@pytest.mark.parametrize(("build", "share"), THRESHOLDS)
def test_thresholds(build, share):
    """One part in 1e9 may be missing, and no more; `share` of what is missing counts."""
    assert verify(build(0.999e-9 / share)).proved
    assert not verify(build(1.001e-9 / share)).proved


def test_large_forces_are_measured_by_their_own_size():
    """A column of eight cubes: the lowest corners bear 2 W each, twice a cube's weight, and miss eps by `lack`."""
    cubes = [box(f"c{i}", [-0.5, -0.5, i], [0.5, 0.5, i + 1]) for i in range(8)]
    names = ["ground", *(cube["id"] for cube in cubes)]
    joints = [contact(names[i], names[i + 1], level(-0.5, -0.5, 0.5, 0.5, float(i)), 0.5) for i in range(8)]
    forces = [[0, 0, (8 - i) * W / 4] for i in range(8) for _ in range(4)]
    for lack, proved in ((0.999e-9, True), (1.001e-9, False)):
        motion = {f"c{i}": [0, 0, lack - i - 1, 0, 0, 0] for i in range(8)}
        assert verify(coupled(state([GROUND, *cubes], joints, forces), motion)).proved is proved


def test_tiny_friction_needs_no_sliding():
    """Up to 1e-9 of the weight friction is noise: it need not slide, but it may not be aligned the wrong way."""
    for share, proved in ((0.9e-9, True), (1.1e-9, False)):
        certificate = cube_on_ground()
        certificate["forces"] = [[sign * share * W, 0, W / 4] for sign in (1, -1, 1, -1)]
        assert verify(coupled(certificate, {"cube": [0, 0, -1, 0, 0, 0]})).proved is proved


def test_small_friction_may_not_push_forward():
    """5e-9 of the weight, sliding by eps / 10: what it does is 5e-10, as good as aligned, but of the wrong sign."""
    certificate = cube_on_ground()
    certificate["forces"] = [[sign * 5e-9 * W, 0, W / 4] for sign in (1, -1, 1, -1)]
    assert "slides by less" in verify(coupled(certificate, {"cube": [0.1, 0, -1, 0, 0, 0]})).reason
    certificate["forces"] = [[0, 0, W / 4]] * 4
    assert verify(coupled(certificate, {"cube": [0.1, 0, -1, 0, 0, 0]})).proved


# --- laws ------------------------------------------------------------------------------------------------------------

LAWS = settings(max_examples=examples(25), deadline=None)
builds = st.sampled_from([*COUPLED, lambda: sliding(by=0.0099), lambda: sliding(sink=0.999), lambda: tipping(lift=11)])
exponents = st.integers(-60, 60)


def same(certificate, other):
    one, two = verify(certificate), verify(sealed(other))
    assert one.proved == two.proved, (one.reason, two.reason)
    assert one.figures == pytest.approx(two.figures, rel=1e-12, abs=1e-24)
    assert one.claim == two.claim


def with_bounds(certificate, factor):
    return {**certificate, **{key: certificate[key] * factor for key in BOUNDS}}


@LAWS
@given(builds, exponents, exponents, exponents)
def test_units_do_not_matter(build, length, weight, displacement):
    certificate = build()
    other = moved(certificate, lambda p: [math.ldexp(x, length) for x in p])
    other["tolerance"] = math.ldexp(other["tolerance"], length)
    for block in other["blocks"]:
        block["density"] = math.ldexp(block["density"], weight)
    motion = other.pop("mechanism")
    scaled_rows(other, 2.0 ** (3 * length + weight), 1.0)
    other["mechanism"] = {
        k: [*(math.ldexp(x, displacement) for x in v[:3]), *(math.ldexp(x, displacement - length) for x in v[3:])]
        for k, v in motion.items()
    }
    same(certificate, with_bounds(other, 2.0**displacement))


@LAWS
@given(builds, st.tuples(*[st.integers(-(2**30), 2**30)] * 3), st.sampled_from([(0, 1, 2), (1, 2, 0), (2, 0, 1)]))
def test_place_and_axes_do_not_matter(build, shift, order):
    certificate = build()

    def turn(v):
        return [v[i] for i in order]

    other = moved(certificate, lambda p: turn([x + s for x, s in zip(p, shift, strict=True)]))
    other["gravity"] = turn(other["gravity"])
    for load in other["loads"]:
        load["force"] = turn(load["force"])
    other["forces"] = [turn(row) for row in other["forces"]]
    other["mechanism"] = {k: turn(v[:3]) + turn(v[3:]) for k, v in other["mechanism"].items()}
    same(certificate, other)


@LAWS
@given(builds, st.tuples(*[st.integers(-179, 180)] * 3))
def test_direction_does_not_matter(build, angles):
    """Turned by any angles, a hair more friction so that rounding does not leave the cones."""
    certificate = build()
    turn = product_of_turns(angles)
    other = moved(certificate, turn)
    other["gravity"] = turn(other["gravity"])
    for joint in other["contacts"]:
        joint["mu"] *= 1.0 + 1e-12
    for load in other["loads"]:
        load["force"] = turn(load["force"])
    other["forces"] = [turn(row) for row in other["forces"]]
    other["mechanism"] = {k: turn(v[:3]) + turn(v[3:]) for k, v in other["mechanism"].items()}
    one, two = verify(certificate), verify(sealed(other))
    assert one.proved == two.proved, (one.reason, two.reason)
    for name in PARTS:
        assert one.figures.get(name, 0.0) == pytest.approx(two.figures.get(name, 0.0), abs=1e-12)


def product_of_turns(angles):
    """Turn about x, then y, then z, by degrees."""

    def turn(v):
        for k, angle in enumerate(angles):
            i, j = (k + 1) % 3, (k + 2) % 3
            c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
            v = [*v]
            v[i], v[j] = c * v[i] - s * v[j], s * v[i] + c * v[j]
        return v

    return turn


@LAWS
@given(builds, st.randoms(use_true_random=False), st.booleans())
def test_order_and_side_do_not_matter(build, random, swap):
    """Blocks, contacts and corners in another order; contacts told from the other side."""
    certificate = build()
    pairs = split(copy.deepcopy(certificate))
    random.shuffle(pairs)
    for joint, rows in pairs:
        k = random.randrange(len(joint["polygon"]))
        joint["polygon"] = joint["polygon"][k:] + joint["polygon"][:k]
        rows[:] = rows[k:] + rows[:k]
        if swap:
            joint["a"], joint["b"] = joint["b"], joint["a"]
            joint["polygon"].reverse()
            rows[:] = [[-x for x in row] for row in reversed(rows)]
    blocks = random.sample(certificate["blocks"], len(certificate["blocks"]))
    forces = [row for _, rows in pairs for row in rows]
    same(certificate, {**certificate, "blocks": blocks, "contacts": [joint for joint, _ in pairs], "forces": forces})


# --- a second opinion, in fractions ----------------------------------------------------------------------------------

small = st.floats(-1, 1).map(lambda x: round(x, 3))


@LAWS
@given(st.lists(st.tuples(small, small), min_size=4, max_size=4), st.tuples(*[small] * 6))
def test_figures_agree_with_floats(friction, noise):
    """The coupling of random forces and displacements, in ordinary floats: n = +z, so no projection is needed."""
    certificate = cube_on_ground()
    certificate["contacts"] = [{**BASE, "mu": 8.0}]
    shift, spin = [10.0 * x for x in noise[:3]], list(noise[3:])
    forces = [[W / 4 * a, W / 4 * b, W / 4] for a, b in friction]
    pull = [-sum(f[0] for f in forces), -sum(f[1] for f in forces)]
    twist = sum(p[0] * f[1] - p[1] * f[0] for p, f in zip(BASE["polygon"], forces, strict=True))
    couple = [{"block": "cube", "force": [0, sign * twist, 0], "point": [-sign / 2, 0, 0]} for sign in (1, -1)]
    certificate["loads"] = [{"block": "cube", "force": [*pull, 0], "point": [0, 0, 0]}, *couple]
    certificate["forces"] = forces
    eps, eta, beta = 3.0, 12.0, 0.5
    report = verify(coupled(certificate, {"cube": [*shift, *spin]}, eps=eps, eta=eta, beta_min=beta))
    figures = {"gap": [0.0], "complementarity": [0.0], "alignment": [0.0], "sliding_least": [eta / eps]}
    for (x, y, _), force in zip(BASE["polygon"], forces, strict=True):
        arm = [x, y, -0.5]
        move = [a + b for a, b in zip(shift, cross(spin, arm), strict=True)]
        size = max(W, math.hypot(*force)) * eps
        figures["gap"].append(-move[2] / eps - 1)
        figures["complementarity"].append(force[2] * abs(move[2] + eps) / size)
        slide = math.hypot(move[0], move[1])
        if math.hypot(force[0], force[1]) > 0.0:
            across = abs(force[0] * move[1] - force[1] * move[0])
            figures["alignment"].append(across / (size * min(1.0, 1000 * slide / eps)) if across else 0.0)
        figures["alignment"].append((force[0] * move[0] + force[1] * move[1]) / size)
        if math.hypot(force[0], force[1]) > 1e-9 * size / eps:
            figures["sliding_least"].append(slide / eps)
    expected = {key: (min if key == "sliding_least" else max)(values) for key, values in figures.items()}
    assert {key: report.figures[key] for key in expected} == pytest.approx(expected, rel=1e-9, abs=1e-12)


# --- mutants ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("build", [sliding, tipping])
def test_every_damage_breaks_the_seal_and_malformed_is_refused_without(build):
    certificate = build()
    for path in places(certificate):
        if path:
            old = at(certificate, path)
            for new in substitutes(old):
                if differs(new, old):
                    damaged = changed(certificate, path, new)
                    report = verify(damaged)
                    assert not report.proved, (path, new)
                    assert report.reason.isascii()
                    assert len(report.reason) < 250
                    if new is None or isinstance(new, dict | str) or (new is REMOVE and path[0] in BOUNDS):
                        assert path == ("seal",) or not verify(resealed(damaged)).proved, path


@pytest.mark.parametrize("build", [sliding, leaning, two_slabs])
def test_every_changed_number_of_a_coupled_state_is_refused(build):
    """By a millionth, re-sealed: forces, sinking (vz), spins. Sliding (vx) may be any between beta_min and eta: it is
    the harmless one, and only what leaves the bounds or turns round is refused.
    """
    certificate = build()
    for path in places(certificate["mechanism"]):
        if len(path) == 2:
            old, full = at(certificate["mechanism"], path), ("mechanism", *path)
            for by in (1e-6, -1e-6):
                proved = verify(sealed(changed(certificate, full, old + by))).proved
                assert proved is (path[1] == 0), full
            if path[1] == 0:
                for new in (-old, 0.0, 11.0, 0.009):
                    assert not verify(sealed(changed(certificate, full, new))).proved, (full, new)
    for path in places(certificate["forces"]):
        if len(path) == 2:
            old, full = at(certificate["forces"], path), ("forces", *path)
            for new in (old - 1e-6 * W, old + 1e-6 * W, 2 * old):
                if new != old:
                    assert not verify(sealed(changed(certificate, full, new))).proved, full


@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("eps", 1.01, "without overlapping"),
        ("eps", 0.99, "overlaps by more"),
        ("eps", 0.0, "not positive"),
        ("eps", -1.0, "not positive"),
        ("eta", 0.49, "more than eta"),
        ("eta", -10.0, "not positive"),
        ("eta", 0.01, "not below eta"),
        ("beta_min", 0.51, "slides by less"),
        ("beta_min", 0.0, "not positive"),
        ("beta_min", 10.0, "not below eta"),
        ("beta_min", "0.01", "not a number"),
        ("eps", math.nan, "not finite"),
        ("mechanism", {}, "missing: cube"),
        ("mechanism", {"cube": [0, 0, 0]}, "3 numbers"),
        ("kind", "rbe-state", "unknown field"),
        ("kind", "cra-tree", "missing: tree"),
    ],
)
def test_damaged_bounds(key, value, reason):
    report = verify(resealed({**sliding(), key: value}))
    assert not report.proved
    assert reason in report.reason


def test_wider_bounds_are_harmless_but_named():
    """eta and beta_min are part of the claim: it is proved with any that the state meets, and says which."""
    report = verify(coupled(sliding(), sliding()["mechanism"], eta=100.0, beta_min=0.001))
    assert report.proved
    assert "eta = 100 eps, beta_min = 0.001 eps" in report.claim


def test_ratios_are_exact_to_the_digits_printed():
    certificate = with_bounds(sliding(), 0.3)
    certificate["mechanism"] = {"cube": [0.15, 0, -0.3, 0, 0, 0]}
    report = verify(sealed(certificate))
    assert report.proved
    assert SAID in report.claim
    assert Fraction(certificate["beta_min"]) != Fraction(certificate["eps"]) / 100


def test_gravity_is_what_the_tests_think():
    assert cube_on_slope()["gravity"] == [0.5 * G, 0, -G]
    assert CUBE["id"] == "cube"
