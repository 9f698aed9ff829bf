"""Certificates built by hand, without any solver, and what the checker must say of them.

Unit cubes of density RHO stand on fixed blocks whose top is z = 0; G = 9.8125 is a short binary fraction, so that
hand-made forces balance to the last bit. W = RHO * G is the weight of a unit cube, the root of 3 its size D.
"""

import copy
import math
import sys
from fractions import Fraction

import pytest

from cyclopean.proof import Report, seal, verify

RHO, G = 2400.0, 9.8125
W = RHO * G
CUBE_FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]


# --- builders, also used by the other tests of the checker -----------------------------------------------------------


def box(name, low, high, *, fixed=False, density=RHO):
    (x, y, z), (X, Y, Z) = low, high
    corners = [[x, y, z], [X, y, z], [X, Y, z], [x, Y, z], [x, y, Z], [X, y, Z], [X, Y, Z], [x, Y, Z]]
    return {"id": name, "vertices": corners, "faces": copy.deepcopy(CUBE_FACES), "density": density, "fixed": fixed}


def prism(name, outline, bottom, top, *, fixed=False):
    """Upright prism over a counter-clockwise outline."""
    n = len(outline)
    vertices = [[x, y, z] for z in (bottom, top) for x, y in outline]
    sides = [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    faces = [list(range(n))[::-1], list(range(n, 2 * n)), *sides]
    return {"id": name, "vertices": vertices, "faces": faces, "density": RHO, "fixed": fixed}


def contact(a, b, polygon, mu=0.5):
    return {"a": a, "b": b, "polygon": [list(map(float, p)) for p in polygon], "mu": mu}


def level(x, y, X, Y, z=0.0):
    """Rectangle at height z whose normal points up."""
    return [[x, y, z], [X, y, z], [X, Y, z], [x, Y, z]]


def sealed(certificate):
    return {**certificate, "seal": seal(certificate)}


def state(blocks, contacts, forces, *, gravity=(0.0, 0.0, -G), loads=(), tolerance=1e-6):
    return _certificate("rbe-state", blocks, contacts, gravity, loads, tolerance, forces=forces)


def mechanism(blocks, contacts, motion, *, gravity=(0.0, 0.0, -G), loads=(), tolerance=1e-6):
    return _certificate("rbe-mechanism", blocks, contacts, gravity, loads, tolerance, mechanism=motion)


def _certificate(kind, blocks, contacts, gravity, loads, tolerance, **proof):
    return sealed(
        {
            "schema": "cyclopean.certificate/2",
            "kind": kind,
            "gravity": list(gravity),
            "tolerance": tolerance,
            "blocks": copy.deepcopy(list(blocks)),
            "contacts": copy.deepcopy(list(contacts)),
            "loads": copy.deepcopy(list(loads)),
            **copy.deepcopy(proof),
        }
    )


GROUND = box("ground", [-4, -4, -1], [4, 4, 0], fixed=True)
CUBE = box("cube", [-0.5, -0.5, 0], [0.5, 0.5, 1])
BASE = contact("ground", "cube", level(-0.5, -0.5, 0.5, 0.5))


def cube_on_ground():
    """Each corner bears a quarter of the weight."""
    return state([GROUND, CUBE], [BASE], [[0, 0, W / 4]] * 4)


def cube_on_slope(mu=0.5, slope=0.5, forces=None):
    """Gravity tilted to (slope, 0, -1) G: the corners at x = +-1/2 bear (1 +- slope) W/4, because the resultant passes
    half a side above the base: sum x Fz = W slope / 2. Each corner's friction is -slope times its normal force.
    """
    normal = [W / 4 * (1 + sign * slope) for sign in (-1, 1, 1, -1)]
    forces = forces or [[-slope * n, 0, n] for n in normal]
    base = contact("ground", "cube", level(-0.5, -0.5, 0.5, 0.5), mu)
    return state([GROUND, CUBE], [base], forces, gravity=(slope * G, 0, -G))


def two_cubes():
    """A quarter of W at each corner between the cubes, of 2 W at each corner below."""
    upper = box("upper", [-0.5, -0.5, 1], [0.5, 0.5, 2])
    joint = contact("cube", "upper", level(-0.5, -0.5, 0.5, 0.5, 1.0))
    return state([GROUND, CUBE, upper], [BASE, joint], [[0, 0, W / 2]] * 4 + [[0, 0, W / 4]] * 4)


def pushed_cube():
    """A horizontal load of W/4 in the middle of a side and one of W on top: Fz = W/2 on average, and
    sum x Fz = (W/4)/2 means corners of W/2 +- W/16 (from n+ - n- = W/8); friction W/16 each.
    """
    loads = [
        {"block": "cube", "force": [W / 4, 0, 0], "point": [-0.5, 0, 0.5]},
        {"block": "cube", "force": [0, 0, -W], "point": [0, 0, 1]},
    ]
    forces = [[-W / 16, 0, W / 2 + sign * W / 16] for sign in (-1, 1, 1, -1)]
    return state([GROUND, CUBE], [BASE], forces, loads=loads)


def overhang(reach=-0.125):
    """Only x <= reach < 0 is supported: the cube tips about the edge x = reach, spin +y. The velocity of its centre is
    spin x (-reach, 0, 1/2) = (1/2, 0, reach), so that the weight does W |reach| of work, and the contact only opens.
    """
    ledge = box("ground", [-4, -4, -1], [reach, 4, 0], fixed=True)
    base = contact("ground", "cube", level(-0.5, -0.5, reach, 0.5))
    return mechanism([ledge, CUBE], [base], {"cube": [0.5, 0, reach, 0, 1, 0]})


def sliding(rise=0.5, mu=0.5):
    """Gravity (1, 0, -1) G and mu = 1/2: the cube slides with (1, 0, rise); rise = mu is the dilatant direction, in
    which no admissible force does work. W = sqrt(2) RHO G; the loads do RHO G (1 - rise).
    """
    base = contact("ground", "cube", level(-0.5, -0.5, 0.5, 0.5), mu)
    return mechanism([GROUND, CUBE], [base], {"cube": [1, 0, rise, 0, 0, 0]}, gravity=(G, 0, -G))


def falling():
    """Nothing touches the cube."""
    return mechanism([CUBE], [], {"cube": [0, 0, -G, 0, 0, 0]})


PROVED = [cube_on_ground, cube_on_slope, two_cubes, pushed_cube, overhang, sliding, falling]


# --- what must be proved ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("build", PROVED)
def test_hand_made_certificates_prove_their_claim(build):
    report = verify(build())
    assert report.proved, report.reason
    assert report.claim.startswith("stable" if report.kind == "rbe-state" else "unstable")
    assert all(math.isfinite(x) for x in report.figures.values())


def test_balance_of_exact_numbers_is_exactly_zero():
    report = verify(two_cubes())
    assert report.figures == {
        "blocks": 3,
        "free": 2,
        "contacts": 2,
        "points": 8,
        "equilibrium_force": 0,
        "equilibrium_moment": 0,
        "exact": 1,
        "misfit": 0,
        "contact_gap": 0,
        "contact_overlap": 0,
        "lean": 0,
    }
    assert verify(two_cubes()).claim == "stable under rigid-block equilibrium; every block balances exactly"


@pytest.mark.parametrize("build", [overhang, sliding, falling])
def test_a_motion_nothing_resists_is_infinitely_good(build):
    assert verify(build()).figures["bound"] == sys.float_info.max


def test_decimal_gravity_balances_to_rounding():
    g = 9.80665
    report = verify(state([GROUND, CUBE], [BASE], [[0, 0, RHO * g / 4]] * 4, gravity=(0, 0, -g)))
    assert report.proved
    assert report.figures["equilibrium_force"] < 1e-15


def test_ten_kilometres_away_in_decimal_coordinates():
    """Coordinates rounded to 2e-12 m, cube side 0.1 m: the rounding must stay far below the tolerance."""
    x, y, s = 10_000.3, -7_000.7, 0.1
    ground = box("ground", [x - 1, y - 1, -0.3], [x + 1, y + 1, 0.7], fixed=True)
    cube = box("cube", [x, y, 0.7], [x + s, y + s, 0.7 + s])
    base = contact("ground", "cube", level(x, y, x + s, y + s, 0.7))
    side = (Fraction(x + s) - Fraction(x)) * (Fraction(y + s) - Fraction(y)) * (Fraction(0.7 + s) - Fraction(0.7))
    quarter = float(side * Fraction(RHO) * Fraction(G) / 4)
    assert verify(state([ground, cube], [base], [[0, 0, quarter]] * 4)).proved
    wrong = float(Fraction(s) ** 3 * Fraction(RHO) * Fraction(G) / 4)  # the volume before rounding: off by 1e-11
    assert verify(state([ground, cube], [base], [[0, 0, wrong]] * 4)).proved


# --- where exactly the line runs -------------------------------------------------------------------------------------


def test_friction_cone_is_closed_and_exact():
    assert verify(cube_on_slope(mu=0.5)).proved
    refused = verify(cube_on_slope(mu=math.nextafter(0.5, 0)))
    assert not refused.proved
    assert "friction cone" in refused.reason


def test_a_pulling_force_is_refused_though_it_balances():
    """On a slope of 3/2 the cube must tip: the upper corners would have to pull, n = (1 - 3/2) W / 4."""
    assert "pulls" in verify(cube_on_slope(mu=2.0, slope=1.5)).reason


def test_moments_must_balance():
    """All of the weight under two corners: forces balance, the moment left is W/2, and W D is its unit."""
    report = verify(state([GROUND, CUBE], [BASE], [[0, 0, 0], [0, 0, W / 2], [0, 0, W / 2], [0, 0, 0]]))
    assert "moments do not balance" in report.reason
    assert report.figures["equilibrium_force"] == 0
    assert report.figures["equilibrium_moment"] == pytest.approx(0.5 / math.sqrt(3), rel=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_moments_about_every_axis_must_balance(axis):
    """A couple of 0.6 W about each axis in turn: it tips the cube, or twists it beyond what mu 0.5 holds."""
    push, place = {0: ([0, 0, 1], [0, 1, 0]), 1: ([0, 0, -1], [1, 0, 0]), 2: ([0, 1, 0], [1, 0, 0])}[axis]
    loads = [
        {"block": "cube", "force": [s * 0.6 * W * x for x in push], "point": [s * x / 2 for x in place]}
        for s in (1, -1)
    ]
    report = verify(state([GROUND, CUBE], [BASE], [[0, 0, W / 4]] * 4, loads=loads))
    assert "moments do not balance" in report.reason
    assert report.figures["equilibrium_force"] == 0
    assert report.figures["equilibrium_moment"] == pytest.approx(0.6 / math.sqrt(3), rel=1e-12)


def on_edges(certificate, mu=0.5):
    """All forces on the edge of their cones, so that none of them can be corrected: friction adds up to nothing."""
    joints = [{**joint, "mu": mu} for joint in certificate["contacts"]]
    signs = (1, 1, -1, -1) * len(joints)
    forces = [[0, sign * mu * f[2], f[2]] for sign, f in zip(signs, certificate["forces"], strict=True)]
    return sealed({**certificate, "contacts": joints, "forces": forces})


@pytest.mark.parametrize(("relative", "proved"), [(0.99e-9, True), (1.01e-9, False)])
def test_balance_threshold_of_forces(relative, proved):
    certificate = cube_on_ground()
    certificate["forces"] = [[0, 0, W / 4 * (1 + relative)]] * 4
    report = verify(on_edges(certificate))
    assert report.proved is proved
    assert report.figures["equilibrium_force"] == pytest.approx(relative, rel=1e-3)
    assert not proved or report.claim.endswith(
        "; balancing loads that differ, on each block, by at most 1e-9 of its own weight"
    )


@pytest.mark.parametrize(("relative", "proved"), [(0.99e-9, True), (1.01e-9, False)])
def test_balance_threshold_of_moments(relative, proved):
    """A couple d on the corners turns by 4 d (lever 1 each); block size 2 m, weight 8 W, moment unit 8 W sqrt 12."""
    cube = box("cube", [-1, -1, 0], [1, 1, 2])
    base = contact("ground", "cube", level(-1, -1, 1, 1))
    d = 8 * W * math.sqrt(12) * relative / 4
    certificate = state([GROUND, cube], [base], [[0, 0, 2 * W + sign * d] for sign in (-1, 1, 1, -1)])
    report = verify(on_edges(certificate))
    assert report.proved is proved
    assert report.figures["equilibrium_moment"] == pytest.approx(relative, rel=1e-3)


def test_every_free_block_must_balance():
    """The lower cube floats on the ground's 2 W, the upper one is held by nothing; and the reverse."""
    for forces in ([W / 2] * 4 + [0.0] * 4, [W / 4] * 8, [0.0] * 4 + [W / 4] * 4):
        certificate = {**two_cubes(), "forces": [[0, 0, f] for f in forces]}
        assert "forces do not balance" in verify(on_edges(certificate)).reason


def test_bound_of_a_pressing_motion():
    """The cube sinks with velocity 1: x = -dd = (0, 0, 1) at four points, inside the cone. A state might leave 1e-9 W,
    so that W (1 - 1e-9) has to be held, of W sqrt 4.
    """
    report = verify(mechanism([GROUND, CUBE], [BASE], {"cube": [0, 0, -1, 0, 0, 0]}))
    assert not report.proved
    assert report.figures["bound"] == pytest.approx(0.5 * (1 - 1e-9), rel=1e-12)


def test_bound_of_a_sliding_motion():
    """Rise 0.49 < mu: a = -0.49, s = 1, each point resists (0.5 - 0.49) / sqrt(1.25); work (1 - 0.49) W / sqrt 2, less
    1e-9 W times the velocity.
    """
    report = verify(sliding(rise=0.49))
    assert not report.proved
    assert report.figures["bound"] == pytest.approx(
        (0.51 / math.sqrt(2) - 1e-9 * math.hypot(1, 0.49)) / (2 * 0.01 / math.sqrt(1.25)), rel=1e-12
    )


@pytest.mark.parametrize(("lack", "proved"), [(1e-6, False), (0.9e-7, True)])
def test_threshold_of_the_bound(lack, proved):
    """With rise = 1/2 - e the bound is sqrt(1.25 / 2) / 4 / e: 1e6 at e = 1.98e-7."""
    report = verify(sliding(rise=0.5 - lack))
    assert report.proved is proved
    assert report.figures["bound"] == pytest.approx(math.sqrt(0.625) / 4 / lack, rel=1e-5)


def test_a_motion_without_work_is_refused():
    """Lifting resists nothing, but the weight does negative work; standing still does none."""
    for v in (1.0, 0.0):
        report = verify(mechanism([GROUND, CUBE], [BASE], {"cube": [0, 0, v, 0, 0, 0]}))
        assert "no work" in report.reason


def test_tipping_the_wrong_way_is_refused():
    certificate = overhang()
    certificate["mechanism"]["cube"] = [-0.5, 0, 0.125, 0, -1, 0]
    assert "no work" in verify(sealed(certificate)).reason


def test_tipping_about_a_point_that_is_supported_is_refused():
    """The same rotation, but the cube stands on all of its base: the far edge would be pressed down."""
    report = verify(mechanism([GROUND, CUBE], [BASE], {"cube": [0.5, 0, -0.125, 0, 1, 0]}))
    assert not report.proved
    assert 0 < report.figures["bound"] < 1


def test_loads_do_work_and_count_as_weight():
    """No gravity; a load of 3 N at the top, velocity of its point 2 m/s, four corners opening: infinitely good.
    And pressing down with 3 N: bound 3 / (3 sqrt 4), less 1e-9 of the weight that the cube would have on earth.
    """
    lift = [{"block": "cube", "force": [0, 0, 3.0], "point": [0, 0, 1.0]}]
    assert verify(mechanism([GROUND, CUBE], [BASE], {"cube": [0, 0, 2, 0, 0, 0]}, gravity=(0, 0, 0), loads=lift)).proved
    press = [{"block": "cube", "force": [0, 0, -3.0], "point": [0, 0, 1.0]}]
    motion = {"cube": [0, 0, -1, 0, 0, 0]}
    report = verify(mechanism([GROUND, CUBE], [BASE], motion, gravity=(0, 0, 0), loads=press))
    assert report.figures["bound"] == pytest.approx((3 - 1e-9 * RHO * 9.80665) / 6, rel=1e-12)


def test_a_load_on_a_fixed_block_changes_nothing():
    load = {"block": "ground", "force": [1e9, 0, 0], "point": [0, 0, 0]}
    pressing = mechanism([GROUND, CUBE], [BASE], {"cube": [0, 0, -1, 0, 0, 0]})
    unbalanced = state([GROUND, CUBE], [BASE], [[0, 0, W / 4 + i] for i in range(4)])
    for plain in (cube_on_ground(), overhang(), pressing, unbalanced):
        assert verify(sealed({**plain, "loads": [load]})) == verify(plain)


def test_a_load_does_work_at_its_own_point():
    """The cube tips with spin +y about x = -1/8; no gravity. A load down at (1/2, 0, 1) works (its lever is 5/8),
    the same load at (-1/4, 0, 1) resists.
    """
    for x, proved in ((0.5, True), (-0.25, False)):
        load = {"block": "cube", "force": [0, 0, -3.0], "point": [x, 0, 1.0]}
        report = verify(sealed({**overhang(), "gravity": [0, 0, 0], "loads": [load]}))
        assert report.proved is proved, report.reason


# --- contacts must lie on the blocks ---------------------------------------------------------------------------------


def on_support(support, polygon, tolerance=1e-6):
    """A cube-shaped free block whose base is the polygon's box, resting on a support by that polygon."""
    xs, ys, zs = zip(*polygon, strict=True)
    low, high = [min(xs), min(ys), min(zs)], [max(xs), max(ys), max(zs) + 1]
    quarter = RHO * G * (high[0] - low[0]) * (high[1] - low[1]) / 4
    joint = contact(support["id"], "cube", polygon)
    return state([support, box("cube", low, high)], [joint], [[0, 0, quarter]] * 4, tolerance=tolerance)


def test_floating_contact_proves_nothing():
    ground = box("ground", [-4, -4, -2], [4, 4, -1], fixed=True)
    assert "not on a face of its block a" in verify(on_support(ground, level(-0.5, -0.5, 0.5, 0.5))).reason


def test_contact_that_only_touches_the_support_proves_nothing():
    """The cube hovers a quarter of a metre above its contact, or stands beside it."""
    for low in ([-0.5, -0.5, 0.25], [0.25, -0.5, 0]):
        cube = box("cube", low, [x + 1 for x in low])
        base = contact("ground", "cube", level(-0.25, -0.25, 0.25, 0.25))
        for certificate in (
            state([GROUND, cube], [base], [[0, 0, W / 4]] * 4),
            mechanism([GROUND, cube], [base], {"cube": [0, 0, -1, 0, 0, 0]}),
        ):
            assert "not on a face of its block b" in verify(certificate).reason


def test_contact_beside_the_face_is_refused():
    ground = box("ground", [-4, -4, -1], [0.25, 4, 0], fixed=True)
    assert "not on a face of its block a" in verify(on_support(ground, level(-0.5, -0.5, 0.5, 0.5))).reason


@pytest.mark.parametrize(("gap", "proved"), [(2.0**-10, True), (2.0**-10 + 2.0**-40, False), (-(2.0**-10), True)])
def test_tolerance_off_the_plane_is_exact(gap, proved):
    ground = box("ground", [-4, -4, -1], [4, 4, -gap], fixed=True)
    report = verify(on_support(ground, level(-0.5, -0.5, 0.5, 0.5), tolerance=2.0**-10))
    assert report.proved is proved, report.reason


@pytest.mark.parametrize(("gap", "proved"), [(2.0**-10, True), (2.0**-10 + 2.0**-40, False)])
def test_tolerance_beside_the_face_is_exact(gap, proved):
    ground = box("ground", [-4, -4, -1], [0.5 - gap, 4, 0], fixed=True)
    report = verify(on_support(ground, level(-0.5, -0.5, 0.5, 0.5), tolerance=2.0**-10))
    assert report.proved is proved, report.reason


def test_tolerance_beyond_a_corner_is_round():
    """A corner 3/4 of the tolerance away in x and in y is 1.06 of it away."""
    t = 2.0**-10
    for part, proved in ((0.75, False), (0.5, True)):
        ground = box("ground", [-4, -4, -1], [0.5 - part * t, 0.5 - part * t, 0], fixed=True)
        assert verify(on_support(ground, level(-0.5, -0.5, 0.5, 0.5), tolerance=t)).proved is proved


def test_zero_tolerance_suffices_for_exact_models():
    assert verify(sealed({**two_cubes(), "tolerance": 0})).proved
    assert verify(sealed({**overhang(), "tolerance": 0})).proved


ELL = [[-4, -4], [4, -4], [4, 0], [0, 0], [0, 4], [-4, 4]]


@pytest.mark.parametrize("turn", range(6))
def test_a_notch_in_a_face_does_not_support(turn):
    """L-shaped support: inside even-odd, wherever the outline begins (its fan would cover the notch)."""
    support = prism("ell", ELL[turn:] + ELL[:turn], -1, 0, fixed=True)
    for x, y, inside in ((-3, -3, True), (1, -3, True), (-3, 1, True), (1, 1, False), (-0.5, -0.5, False)):
        report = verify(on_support(support, level(x, y, x + 2, y + 2)))
        assert report.proved is inside, (x, y, report.reason)


def warped_ground():
    """The ground with its top corner at (4, 4) raised to z = 1/2: two triangles meet in the diagonal from (-4, -4)."""
    ground = box("ground", [-4, -4, -1], [4, 4, 0], fixed=True)
    ground["vertices"][6][2] = 0.5
    return ground


def test_a_face_that_is_not_flat_is_its_fan():
    """In the fan's first triangle z = (y + 4) / 16, in the second z = (x + 4) / 16; 3.6 degrees steep."""
    ground = warped_ground()

    def joint(rise):
        points = [[x, y, rise(x, y)] for x, y in ((1, -3), (2, -3), (2, -2), (1, -2))]
        cube = box("cube", [1, -3, 0], [2, -2, 1])
        for vertex in cube["vertices"]:
            vertex[2] = vertex[2] + rise(vertex[0], vertex[1])
        return mechanism([ground, cube], [contact("ground", "cube", points)], {"cube": [0, 0, -1, 0, 0, 0]})

    assert "might hold" in verify(joint(lambda x, y: (y + 4) / 16)).reason
    assert "block a" in verify(joint(lambda x, y: (x + 4) / 16)).reason
    assert "block a" in verify(joint(lambda x, y: 0)).reason


def test_a_thin_slab_does_not_support_with_its_underside():
    """The points are within the tolerance of the slab's underside, which looks the wrong way."""
    t = 2.0**-8
    slab = box("slab", [-4, -4, 0], [4, 4, 1], fixed=True)  # its underside, z = 0, touches the cube's base
    assert "block a" in verify(on_support(slab, level(-0.5, -0.5, 0.5, 0.5), tolerance=t)).reason


@pytest.mark.parametrize(
    ("slope", "surface", "proved"),
    [(0.000999, {}, True), (0.001001, {}, False)]
    + [(0.32, {"surface": kind}, True) for kind in ("rough", "curved")]
    + [(0.34, {"surface": "rough"}, False)],
)
def test_alignment_of_contact_and_face(slope, surface, proved):
    """A contact may lean from its face by a thousandth; if the surface is rough or curved by 18 degrees (slope 0.329)
    at most. Of a small contact all points are within the tolerance.
    """
    h, t = (0.5, 0.002) if slope < 0.1 else (2.0**-10, 2.0**-9)
    polygon = [[-h, -h, -slope * h], [h, -h, slope * h], [h, h, slope * h], [-h, h, -slope * h]]
    base = {**contact("ground", "cube", polygon), **surface}
    report = verify(mechanism([GROUND, CUBE], [base], {"cube": [0, 0, -1, 0, 0, 0]}, tolerance=t))
    assert ("might hold" in report.reason) is proved
    assert ("not on a face" in report.reason) is not proved


def test_contact_turned_over_is_refused():
    base = contact("ground", "cube", level(-0.5, -0.5, 0.5, 0.5)[::-1])
    for sign in (1, -1):
        assert "not on a face" in verify(state([GROUND, CUBE], [base], [[0, 0, sign * W / 4]] * 4)).reason


def test_a_mechanism_with_a_floating_contact_is_refused_too():
    certificate = overhang()
    for point in certificate["contacts"][0]["polygon"]:
        point[2] += 0.25
    assert "not on a face" in verify(sealed(certificate)).reason


@pytest.mark.parametrize("far", [[], [box("far", [1e6, 0, 0], [1e6 + 1, 1, 1], fixed=True)]])
def test_the_smaller_block_bounds_the_tolerance(far):
    """0.5 % of the diagonal of the unit cube is 8.66 mm, however large the support, the model and the tolerance are; a
    vertex that no face uses is no part of it.
    """
    cube = {**CUBE, "vertices": [*CUBE["vertices"], [1e6, 0, 0]]}
    for gap, proved in ((0.0086, True), (0.0087, False)):
        huge = box("ground", [-1e4, -1e4, -1], [1e4, 1e4, -gap], fixed=True)
        report = verify(state([huge, cube, *far], [BASE], [[0, 0, W / 4]] * 4, tolerance=10.0))
        assert report.proved is proved, report.reason
        assert not proved or "off the faces" in report.claim


def test_a_small_support_bounds_the_tolerance_too():
    """A plinth of 0.2 x 0.2 x 0.2 m: 0.5 % of its diagonal is 1.73 mm."""
    base = contact("plinth", "cube", level(-0.1, -0.1, 0.1, 0.1))
    for gap, proved in ((0.0017, True), (0.0018, False)):
        plinth = box("plinth", [-0.1, -0.1, -0.2 - gap], [0.1, 0.1, -gap], fixed=True)
        assert verify(state([plinth, CUBE], [base], [[0, 0, W / 4]] * 4, tolerance=10.0)).proved is proved


def test_report_is_frozen():
    report = verify(cube_on_ground())
    assert isinstance(report, Report)
    with pytest.raises(AttributeError):
        report.proved = False
