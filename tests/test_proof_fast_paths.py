"""The short ways of the checker decide as the plain ones do, exactly.

Coordinates are small whole numbers, so that points fall on edges, corners and planes all the time.
"""

import itertools
import math
from fractions import Fraction

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cyclopean.proof import verify
from cyclopean.proof.checker import (
    HUGE,
    TINY,
    _area_vector,
    _Budget,
    _cross,
    _exponent,
    _Facet,
    _integer,
    _is_flat,
    _Joint,
    _moments,
    _Patch,
    _RefusedError,
    _seat,
    _Sheet,
    _Stone,
    _Surface,
    _triples,
    _vectors,
)
from laws import examples
from test_proof_checker import CUBE_FACES, cube_on_ground, sealed

LAWS = settings(max_examples=examples(300), deadline=None)
small = st.integers(-6, 6)
points = st.tuples(small, small, small)
tolerances = st.integers(0, 2)


def facet(ring):
    normal = _area_vector(ring)
    return _Facet(ring, normal, sum(x * x for x in normal)).prepared().edged()


def looks():
    return _Budget((10**9, 0), 0, "too many")


def beside(face, point, room):
    """How far beside a facet a point is, squared, by the short way and the general one; None where it is not on it."""
    if not face.reaches(point, room):
        return [None, None]
    return [(0, 1) if face.covers(point) else None, face.beside2(point, room, looks())]


def seat(facets, ring, sign, tolerance, bent=False):
    """How a contact between blocks "left" and "right" lies on these facets, and what is refused of it."""
    normal = _area_vector(ring)
    joint, size2 = _Joint(0, 1, [], 0.5, 0.0, bent), sum(x * x for x in normal)
    patch = _Patch(0, joint, 0, slice(0, len(ring)), 0, 1, 1, 2, (1, 2), ring, normal, size2, (tolerance**2, 1), [])
    stones = [_Stone(name, [], _Surface([], frozenset(), True), 1.0, False) for name in ("left", "right")]
    sheet = _Sheet([0.0] * 3, 0.0, stones, [joint], [], [], [], None, [])
    try:
        return _seat(sheet, facets, patch, sign, 0, looks()), ""
    except _RefusedError as refusal:
        return None, str(refusal)


def plainly_beside2(ring, point, room):
    """The plain way in fractions: within `room` of the plane, inside by the even-odd rule or so near to an edge."""
    normal = newell(ring)
    middle, size2 = mean(ring), dot(normal, normal)
    if dot(minus(point, middle), normal) ** 2 > room**2 * size2:
        return None
    u = next(v for axis in ((1, 0, 0), (0, 1, 0)) if any(v := _cross(normal, axis)))
    v = _cross(normal, u)
    x, y = dot(point, u), dot(point, v)
    inside, nearest2 = False, []
    for start, end in zip(ring, [*ring[1:], ring[0]], strict=True):
        (ax, ay), (bx, by) = ((dot(r, u), dot(r, v)) for r in (start, end))
        if (ay > y) != (by > y) and x < ax + Fraction((bx - ax) * (y - ay), by - ay):
            inside = not inside
        run = minus(end, start)
        along = min(max(Fraction(dot(minus(point, start), run), dot(run, run)), 0), 1)
        off = [p - s - along * r for p, s, r in zip(point, start, run, strict=True)]
        nearest2.append(dot(off, off))
    return 0 if inside else min((d for d in nearest2 if d <= room**2), default=None)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def mean(ring):
    return [Fraction(sum(column), len(ring)) for column in zip(*ring, strict=True)]


@st.composite
def rings(draw):
    """Three or four corners, in a plane or about it, convex, with a notch or crossing."""
    count = draw(st.integers(3, 4))
    outline = draw(st.lists(st.tuples(small, small), min_size=count, max_size=count, unique=True))
    a, b = draw(st.tuples(st.integers(-2, 2), st.integers(-2, 2)))
    off = draw(st.lists(st.sampled_from([0, 0, 0, 1, 4]), min_size=count, max_size=count))
    order = draw(st.sampled_from([(0, 1, 2), (1, 2, 0), (2, 0, 1)]))
    corners = [(x, y, a * x + b * y + z) for (x, y), z in zip(outline, off, strict=True)]
    return [tuple(c[i] for i in order) for c in corners]


@st.composite
def near(draw, ring):
    """A corner, a point between corners (of doubled rings: so that it is whole), or anything, a little displaced."""
    one, two = draw(st.sampled_from(ring)), draw(st.sampled_from(ring))
    middle = tuple((p + q) // 2 for p, q in zip(one, two, strict=True))
    shift = draw(st.sampled_from([(0, 0, 0), (0, 0, 0), (1, 0, 0), (0, -1, 0), (0, 0, 1)]))
    return tuple(p + s for p, s in zip(draw(st.sampled_from([middle, one, draw(points)])), shift, strict=True))


@LAWS
@given(rings(), st.sampled_from([1, 2]), tolerances, st.data())
def test_on_a_facet_is_what_the_plain_way_says(ring, scale, tolerance, data):
    ring = [tuple(scale * x for x in corner) for corner in ring]
    face = facet(ring)
    assume(face.normal2)
    for point in [data.draw(near(ring)) for _ in range(4)]:
        short, general = beside(face, point, (tolerance**2, 1))
        plain = plainly_beside2(ring, point, tolerance)
        rise = dot(minus(point, mean(ring)), face.normal)
        assert (general is None) is (plain is None), (ring, point)
        assert short is None or plain is not None, (ring, point)
        if general and not (face.lean or face.covers(point)):  # straight above the outline either answer is right
            assert Fraction(*general) in (plain, 0 if plain * face.normal2 == rise**2 else plain)
        assert face.height_of(point, 1) == pytest.approx(float(rise) / math.sqrt(face.normal2) / 2, abs=1e-12)


@LAWS
@given(
    st.lists(rings(), min_size=1, max_size=3),
    rings(),
    tolerances,
    st.sampled_from([1, -1]),
    st.booleans(),
    st.data(),
)
def test_a_contact_lies_on_the_facets_that_the_plain_way_finds(faces, patch, tolerance, sign, bent, data):
    faces = [[tuple(2 * x for x in corner) for corner in ring] for ring in faces]
    if data.draw(st.booleans()):
        patch = [data.draw(near(ring)) for ring in faces for _ in range(2)]
        patch = [*patch, data.draw(near(faces[0]))]
    facets, contact = [facet(ring) for ring in faces], facet(patch)
    assume(contact.normal2 and all(face.normal2 for face in facets))
    found, refusal = seat(facets, patch, sign, tolerance, bent)
    least = Fraction(361, 400) if bent else 1 - Fraction(1, 10**6)

    def under(point):
        for face in facets:
            cosine = sum(a * b for a, b in zip(face.normal, contact.normal, strict=True)) * sign
            looks = cosine > 0 and cosine**2 >= least * face.normal2 * contact.normal2
            if looks and any(beside(face, point, (tolerance**2, 1))):
                yield face

    plain = [list(under(point)) for point in patch]
    assert (found is None) is not all(plain)
    if found is None:
        named = [f"point {number} is not on a face" in refusal for number, on in enumerate(plain) if not on]
        assert any(named)
    elif bent:
        assert found.normals == [[tuple(sign * x for x in face.normal) for face in on] for on in plain]


def test_the_short_way_is_taken():
    """Corners, edges and the inside of a square, and what is next to it, within the tolerance or not."""
    square = facet([(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)])
    assert all(beside(square, point, (1, 1))[0] for point in [(0, 0, 0), (4, 2, 0), (2, 2, 1), (4, 4, -1)])
    assert not any(beside(square, point, (1, 1))[0] for point in [(5, 2, 0), (2, 2, 2), (-1, -1, 0)])


def test_just_outside_is_outside():
    """Next to an edge of slope 1 / 3, by as little as whole numbers allow."""
    wedge = facet([(0, 0, 0), (3, 1, 0), (0, 3, 0)])
    assert [wedge.covers(point) for point in [(2, 1, 0), (1, 0, 0), (3, 1, 0)]] == [True, False, True]


def test_the_middle_of_a_pentagram_is_not_inside():
    """The plain rule calls it outside, though it is to the left of all five edges; the short way is not for it."""
    star = [(round(1000 * math.cos(t)), round(1000 * math.sin(t)), 0) for t in (4 * math.pi * i / 5 for i in range(5))]
    middle = [(-9, -9, 0), (9, -9, 0), (0, 9, 0)]
    assert not any(facet(star).covers(point) for point in middle)
    assert "point 0 is not on a face of its block a" in seat([facet(star)], middle, 1, 1)[1]


def test_a_point_on_an_edge_of_a_warped_facet_is_as_near_as_the_edge_is():
    """The middle of an edge that leans: a point above it, nearer to the plane than to the edge, is not on the facet."""
    face = facet([(0, 0, 3), (20, 0, -3), (20, 20, 3), (0, 20, -3)])
    above = (2, 20, 3)  # the edge from (20, 20, 3) to (0, 20, -3) is at z = -2.4 there, the plane at z = 0
    assert beside(face, above, (16, 1)) == [None, None]
    assert face.covers((0, 0, 3))


def test_how_a_contact_lies_by_hand():
    """A square of 8 x 8; a contact 1 above it whose corner is 3 and 4 beyond its corner: sqrt 26 away."""
    square = facet([(0, 0, 0), (8, 0, 0), (8, 8, 0), (0, 8, 0)])
    found, _ = seat([square], [(2, 2, 1), (11, 12, 1), (2, 6, 1)], 1, 6)
    assert found == ({0: 1.0, 1: 1.0, 2: 1.0}, math.sqrt(26), 0.0, [], [])
    assert "point 1" in seat([square], [(2, 2, 1), (11, 12, 1), (2, 6, 1)], 1, 5)[1]


def test_lean_by_hand():
    """A contact that rises by 3 in 3000; by 4 it leans too much, unless the surface is rough: then the face is told."""
    square = facet([(0, 0, 0), (4000, 0, 0), (4000, 4000, 0), (0, 4000, 0)])

    def rising(z):
        return [(0, 0, 0), (3000, 0, z), (3000, 3000, z), (0, 3000, 0)]

    assert seat([square], rising(2), 1, 5)[0].lean == pytest.approx(math.atan(2 / 3000), rel=1e-12)
    assert seat([square], rising(3), 1, 5)[0].lean == pytest.approx(1e-3, rel=1e-6)
    assert "looks along it" in seat([square], rising(4), 1, 5)[1]
    rough, _ = seat([square], rising(4), 1, 5, bent=True)
    assert rough.normals == [[square.normal]] * 4
    assert rough.lean == pytest.approx(math.atan(4 / 3000), rel=1e-12)
    turned = facet(square.ring[::-1])
    assert seat([turned], rising(2), 1, 5)[0] is None
    assert seat([turned], rising(4), -1, 5, bent=True)[0].normals == [[square.normal]] * 4


def newell(ring):
    first = ring[0]
    total = [0, 0, 0]
    for b, c in itertools.pairwise(ring[1:]):
        u, v = ([x - o for x, o in zip(p, first, strict=True)] for p in (b, c))
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            total[i] += u[j] * v[k] - u[k] * v[j]
    return tuple(total)


@LAWS
@given(rings(), tolerances)
def test_area_and_flatness_of_quadrilaterals(ring, tolerance):
    normal = newell(ring)
    assert _area_vector(ring) == normal
    heights = [sum(a * b for a, b in zip(r, normal, strict=True)) for r in ring]
    mean, size2 = Fraction(sum(heights), len(ring)), sum(x * x for x in normal)
    flat = all((h - mean) ** 2 <= tolerance**2 * size2 for h in heights)
    assert _is_flat(ring, normal, size2, (tolerance**2, 1)) is flat
    assert _is_flat(ring, normal, size2, (9 * tolerance**2, 9)) is flat


@LAWS
@given(st.lists(points, min_size=8, max_size=8))
def test_volume_and_moment_from_any_origin(corners):
    """Of a warped box, about the world's origin instead of a vertex."""
    volume6, moment24 = 0, [0, 0, 0]
    for face in CUBE_FACES:
        for i, j in itertools.pairwise(face[1:]):
            a, b, c = corners[face[0]], corners[i], corners[j]
            n = newell([(0, 0, 0), b, c])
            det = sum(x * y for x, y in zip(a, n, strict=True))
            volume6 += det
            moment24 = [m + det * (x + y + z) for m, x, y, z in zip(moment24, a, b, c, strict=True)]
    assume(volume6 > 0)
    origin = corners[0]
    local = [tuple(x - o for x, o in zip(corner, origin, strict=True)) for corner in corners]
    found6, found24 = _moments(CUBE_FACES, local)
    assert found6 == volume6
    assert [m + 4 * found6 * o for m, o in zip(found24, origin, strict=True)] == moment24


accepted = st.floats(-HUGE, HUGE).filter(lambda x: x == 0 or abs(x) >= TINY)


@LAWS
@given(st.lists(st.tuples(accepted, accepted, accepted), min_size=1, max_size=5), st.sampled_from([1, 96]))
def test_integers_are_the_exact_fractions(rows, guard):
    k = _exponent([x for row in rows for x in row], guard)
    for more in (700, 0):
        exact = [tuple(Fraction(x) * 2 ** (k + more) for x in row) for row in rows]
        assert _vectors(rows, k + more) == exact
        assert [tuple(_integer(x, k + more) for x in row) for row in rows] == exact
    largest = max(abs(x) for row in exact for x in row)
    assert k >= 0
    assert largest == 0 or largest >= 2 ** (guard - 1)


@pytest.mark.parametrize("x", [0, 0.5, 1.0, -3.25, 1e100, 1e-150, -1e-150, 0.0, -0.0])
def test_rows_by_the_short_way_and_the_long_way(x):
    assert _triples([[x, 1.0, 2]], "rows", "row") == [[x, 1.0, 2.0]]
    assert all(type(v) is float for v in _triples([[x, 1, 2.0]], "rows", "row")[0])


@pytest.mark.parametrize(
    "x", [math.nan, math.inf, -math.inf, 1.1e100, 0.9e-150, -2e100, 5e-324, True, "1", None, 2**53 + 1]
)
@pytest.mark.parametrize("place", [0, 1, 2])
def test_rows_that_neither_way_accepts(x, place):
    certificate = cube_on_ground()
    row = [0.5, 0.5, 0.5]
    row[place] = x
    for rows in (certificate["forces"], certificate["blocks"][1]["vertices"], certificate["contacts"][0]["polygon"]):
        old, rows[1] = rows[1], row
        try:
            damaged = sealed(certificate)
        except ValueError:
            damaged = certificate
        report = verify(damaged)
        assert not report.proved
        assert "number" in report.reason
        rows[1] = old
