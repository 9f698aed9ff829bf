"""Laws that hold for every certificate, and a second, slower computation of the figures to compare with."""

import copy
import itertools
import math
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.proof import verify
from cyclopean.proof.checker import _root_above
from laws import examples
from test_proof_checker import (
    BASE,
    CUBE,
    GROUND,
    PROVED,
    RHO,
    W,
    box,
    contact,
    cube_on_slope,
    falling,
    level,
    mechanism,
    overhang,
    prism,
    pushed_cube,
    sealed,
    sliding,
    state,
    two_cubes,
)

LAWS = settings(max_examples=examples(40), deadline=None)
REFUSED = [
    lambda: cube_on_slope(mu=0.25),
    lambda: sliding(rise=0.25),
    lambda: state([GROUND, CUBE], [BASE], [[0, 0, W / 4 + i] for i in range(4)]),
]
certificates = st.sampled_from([*PROVED, *REFUSED]).map(lambda build: build())


def moved(certificate, place):
    """Apply a map to every point of the model."""
    result = copy.deepcopy(certificate)
    for block in result["blocks"]:
        block["vertices"] = [place(v) for v in block["vertices"]]
    for joint in result["contacts"]:
        joint["polygon"] = [place(p) for p in joint["polygon"]]
    for load in result["loads"]:
        load["point"] = place(load["point"])
    return result


def scaled_rows(certificate, force, speed):
    """Multiply forces and loads, and linear velocities."""
    for load in certificate["loads"]:
        load["force"] = [force * x for x in load["force"]]
    if "forces" in certificate:
        certificate["forces"] = [[force * x for x in row] for row in certificate["forces"]]
    else:
        motion = certificate["mechanism"]
        certificate["mechanism"] = {k: [*(speed * x for x in v[:3]), *v[3:]] for k, v in motion.items()}


def same(certificate, other):
    """Same verdict, and the same figures to the last digits of a float."""
    one, two = verify(certificate), verify(sealed(other))
    assert one.proved == two.proved, (one.reason, two.reason)
    assert one.figures == pytest.approx(two.figures, rel=1e-12, abs=1e-24)


exponents = st.integers(-60, 60)


@LAWS
@given(certificates, exponents, exponents, exponents)
def test_units_do_not_matter(certificate, length, density, gravity):
    """Lengths, densities and gravity in other (binary) units: forces go with density * gravity * length^3."""
    other = moved(certificate, lambda p: [math.ldexp(x, length) for x in p])
    other["tolerance"] = math.ldexp(other["tolerance"], length)
    other["gravity"] = [math.ldexp(x, gravity) for x in other["gravity"]]
    for block in other["blocks"]:
        block["density"] = math.ldexp(block["density"], density)
    scaled_rows(other, 2.0 ** (3 * length + density + gravity), 2.0**length)
    same(certificate, other)


@LAWS
@given(certificates, st.tuples(*[st.integers(-(2**30), 2**30)] * 3))
def test_place_does_not_matter(certificate, shift):
    same(certificate, moved(certificate, lambda p: [x + s for x, s in zip(p, shift, strict=True)]))


@LAWS
@given(certificates, st.sampled_from([(1, 2, 0), (2, 0, 1)]))
def test_axes_do_not_matter(certificate, order):
    """Turned by 120 degrees about (1, 1, 1): an even permutation of the axes, of everything."""

    def turn(v):
        return [v[i] for i in order]

    other = moved(certificate, turn)
    other["gravity"] = turn(other["gravity"])
    for load in other["loads"]:
        load["force"] = turn(load["force"])
    if "forces" in other:
        other["forces"] = [turn(row) for row in other["forces"]]
    else:
        other["mechanism"] = {k: turn(v[:3]) + turn(v[3:]) for k, v in other["mechanism"].items()}
    same(certificate, other)


def split(certificate):
    """Pair every contact with its forces (or with nothing)."""
    rows = iter(certificate.get("forces", []))
    return [(joint, list(itertools.islice(rows, len(joint["polygon"])))) for joint in certificate["contacts"]]


def joined(certificate, pairs):
    other = {**copy.deepcopy(certificate), "contacts": [joint for joint, _ in pairs]}
    if "forces" in other:
        other["forces"] = [row for _, rows in pairs for row in rows]
    return other


@LAWS
@given(certificates, st.randoms(use_true_random=False))
def test_order_does_not_matter(certificate, random):
    """Blocks and contacts shuffled, polygons begun at another corner, faces and their corners too."""
    pairs = split(copy.deepcopy(certificate))
    random.shuffle(pairs)
    for joint, rows in pairs:
        k = random.randrange(len(joint["polygon"]))
        joint["polygon"] = joint["polygon"][k:] + joint["polygon"][:k]
        rows[:] = rows[k:] + rows[:k]
    other = joined(certificate, pairs)
    random.shuffle(other["blocks"])
    for block in other["blocks"]:
        random.shuffle(block["faces"])
        k = random.randrange(4)
        block["faces"] = [face[k:] + face[:k] for face in block["faces"]]
    same(certificate, other)


@LAWS
@given(certificates)
def test_action_is_reaction(certificate):
    same(certificate, other_side(certificate))


def other_side(certificate):
    """The same contacts told from the other side: blocks swapped, polygon reversed, forces reversed and negated."""
    pairs = [
        (
            {**joint, "a": joint["b"], "b": joint["a"], "polygon": joint["polygon"][::-1]},
            [[-x for x in row] for row in rows[::-1]],
        )
        for joint, rows in split(certificate)
    ]
    return joined(certificate, pairs)


@LAWS
@given(st.sampled_from([overhang, sliding, falling]), st.integers(-40, 40))
def test_speed_does_not_matter(build, exponent):
    certificate = build()
    other = copy.deepcopy(certificate)
    other["mechanism"] = {k: [math.ldexp(x, exponent) for x in v] for k, v in other["mechanism"].items()}
    same(certificate, other)


@LAWS
@given(st.sampled_from([cube_on_slope, two_cubes, pushed_cube]))
def test_fans_do_not_matter(build):
    """Every face cut into triangles."""
    certificate = build()
    other = copy.deepcopy(certificate)
    for block in other["blocks"]:
        block["faces"] = [[f[0], f[i], f[i + 1]] for f in block["faces"] for i in range(1, len(f) - 1)]
    same(certificate, other)


# --- a second opinion, in fractions and by another formula -----------------------------------------------------------

decimals = st.floats(-1, 1).map(lambda x: round(x, 6))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def box_centre_and_weight(block, gravity):
    """Of a box: mean of its corners, product of its sides."""
    corners = [[Fraction(x) for x in v] for v in block["vertices"]]
    centre = [sum(column) / 8 for column in zip(*corners, strict=True)]
    volume = math.prod(max(column) - min(column) for column in zip(*corners, strict=True))
    return centre, [Fraction(block["density"]) * volume * Fraction(g) for g in gravity]


def norm(vector):
    return math.sqrt(sum(float(x) ** 2 for x in vector))


@LAWS
@given(st.lists(st.tuples(decimals, decimals, decimals), min_size=8, max_size=8), st.tuples(decimals, decimals))
def test_residuals_agree_with_fractions(noise, load):
    """Two cubes with random forces in the open cones, and a random load: the residuals, block by block."""
    certificate = two_cubes()
    certificate["contacts"] = [{**joint, "mu": 10.0} for joint in certificate["contacts"]]
    certificate["forces"] = [[1000 * a, 1000 * b, 5000 + 1000 * c] for a, b, c in noise]
    certificate["loads"] = [{"block": "upper", "force": [1e4 * load[0], 0.1, 3], "point": [0.1, load[1], 2]}]
    certificate["gravity"] = [0.3, -0.2, -9.80665]
    figures = verify(sealed(certificate)).figures
    left, turned = _residuals(certificate)
    weight = RHO * norm(certificate["gravity"])
    assert figures["equilibrium_force"] == pytest.approx(left / weight, rel=1e-9)
    assert figures["equilibrium_moment"] == pytest.approx(turned / (weight * math.sqrt(3)), rel=1e-9)


def _residuals(certificate):
    """The largest force and the largest moment that are left on a block."""
    out = {"cube": [0, 0, 0], "upper": [0, 0, 0]}
    turn = copy.deepcopy(out)
    parts = [
        (block, [Fraction(sign * x) for x in row], [Fraction(x) for x in point])
        for joint, rows in split(certificate)
        for row, point in zip(rows, joint["polygon"], strict=True)
        for block, sign in ((joint["a"], -1), (joint["b"], 1))
    ]
    parts += [
        (load["block"], list(map(Fraction, load["force"])), list(map(Fraction, load["point"])))
        for load in certificate["loads"]
    ]
    for block in certificate["blocks"][1:]:
        name = block["id"]
        centre, weight = box_centre_and_weight(block, certificate["gravity"])
        for owner, force, point in [*parts, (name, weight, centre)]:
            if owner == name:
                arm = [x - c for x, c in zip(point, centre, strict=True)]
                out[name] = [x + f for x, f in zip(out[name], force, strict=True)]
                turn[name] = [x + f for x, f in zip(turn[name], cross(arm, force), strict=True)]
    return [max(map(norm, part.values())) for part in (out, turn)]


@LAWS
@given(
    st.tuples(*[decimals] * 6),
    st.tuples(*[decimals] * 6),
    decimals.map(lambda x: 2 * abs(x)),
    st.tuples(decimals, decimals, decimals),
)
def test_bound_agrees_with_floats(lower, upper, mu, gravity):
    """The projection of every point's motion, in ordinary floats with normalised normals."""
    certificate = two_cubes()
    del certificate["forces"]
    motion = {"cube": list(lower), "upper": list(upper)}
    joints = [{**joint, "mu": mu} for joint in certificate["contacts"]]
    report = verify(mechanism(certificate["blocks"], joints, motion, gravity=gravity))
    centres = {"cube": [0, 0, 0.5], "upper": [0, 0, 1.5]}

    def velocity(name, r):
        if name == "ground":
            return [0, 0, 0]
        v, w = motion[name][:3], motion[name][3:]
        arm = [x - c for x, c in zip(r, centres[name], strict=True)]
        return [a + b for a, b in zip(v, cross(w, arm), strict=True)]

    power = sum(RHO * g * motion[name][i] for name in motion for i, g in enumerate(gravity))
    squares = 0.0
    for joint in joints:
        for r in joint["polygon"]:
            x, y, a = (p - q for p, q in zip(velocity(joint["a"], r), velocity(joint["b"], r), strict=True))
            s = math.hypot(x, y)
            inside, polar = a >= 0 and s <= mu * a, mu * s <= -a
            size = math.hypot(a, s) if inside else 0 if polar else (a + mu * s) / math.hypot(1, mu)
            squares += size**2
    if power <= 1e-9 or squares < 1e-12:
        return  # the floats cannot tell
    slack = sum(norm(row[:3]) + math.sqrt(3) * norm(row[3:]) for row in motion.values())
    power -= 1e-9 * RHO * norm(gravity) * slack
    expected = power / (2 * RHO * norm(gravity) * math.sqrt(squares))
    assert report.figures["bound"] == pytest.approx(expected, rel=1e-6)


@LAWS
@given(
    st.lists(st.integers(2, 30), min_size=3, max_size=9),
    st.integers(0, 600).map(lambda i: i / 100),
    decimals.map(lambda x: 3.5 * x),
    decimals.map(lambda x: 3.5 * x),
)
def test_even_odd_agrees_with_triangles(radii, start, x, y):
    """A star-shaped face: a tiny contact is on it if and only if it lies in one of the triangles from its centre."""
    n = len(radii)
    angles = [start + 2 * math.pi * i / n for i in range(n)]
    outline = [[r / 10 * math.cos(t), r / 10 * math.sin(t)] for r, t in zip(radii, angles, strict=True)]

    def side(p, q, r):
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    edges = list(zip(outline, [*outline[1:], outline[0]], strict=True))
    h = 2.0**-20
    points = [(x - h, y - h), (x + h, y - h), (x, y + h)]
    inside = []
    for r in points:
        values = [(side((0, 0), p, r), side(p, q, r), side(q, (0, 0), r)) for p, q in edges]
        if min(abs(v) for triple in values for v in triple) < 1e-5:
            return  # too near an edge to be told by floats
        inside.append(any(min(triple) > 0 for triple in values))
    support = prism("star", outline, -1, 0, fixed=True)
    joint = contact("star", "cube", [[*p, 0] for p in points])
    cube = box("cube", [-4, -4, 0], [4, 4, 8])
    report = verify(mechanism([support, cube], [joint], {"cube": [0, 0, -1, 0, 0, 0]}, tolerance=1e-9))
    assert ("might hold" in report.reason) is all(inside), report.reason


@LAWS
@given(st.integers(0, 10**60))
def test_integer_roots(n):
    root = _root_above(n)
    assert (root - 1) ** 2 < n <= root**2 or n == root == 0


def test_level_is_the_normal_that_the_tests_think():
    """A guard of the builder: counter-clockwise seen from above."""
    (a, b, c, _) = level(0, 0, 1, 1)
    assert cross([y - x for x, y in zip(a, b, strict=True)], [y - x for x, y in zip(b, c, strict=True)])[2] > 0
