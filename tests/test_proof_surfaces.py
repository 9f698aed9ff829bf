"""Forgeries with contacts: leaning, narrow, floating or overlapping ones, and what the claim says of them."""

import math

import pytest

from cyclopean.proof import verify
from test_proof_checker import (
    BASE,
    CUBE,
    GROUND,
    RHO,
    G,
    W,
    box,
    contact,
    level,
    mechanism,
    on_support,
    sealed,
    state,
    two_cubes,
)
from test_proof_solids import extruded

DOWN = {"cube": [0, 0, -1, 0, 0, 0]}


def on_contact(polygon, surface=None, tolerance=1e-6, ground=GROUND, cube=CUBE):
    """The cube presses on one contact: what is wrong with it is said first, else that it might hold."""
    joint = contact("ground", "cube", polygon) | ({"surface": surface} if surface else {})
    return verify(mechanism([ground, cube], [joint], DOWN, tolerance=tolerance))


# --- contacts that lean ----------------------------------------------------------------------------------------------

SLOPE, LEAN = math.radians(35), math.radians(10)
NEEDED = math.tan(SLOPE)


def leaning(mu, surface, used=NEEDED):
    """A slab of 1 x 1 x 0.2 m on flat ground under gravity of 35 degrees to it. A contact of 0.3 m that leans by 10
    degrees has 25 to bear (tan 0.466), its faces 35 (0.700), or what is `used` of it. The weight passes from 0.1 m
    above the ground down to the contact, z = x tan 10, at x (1 + tan 10 tan 35) = 0.1 tan 35.
    """
    slab, half = box("slab", [-0.5, -0.5, 0], [0.5, 0.5, 0.2]), 0.15
    rise, middle = half * math.tan(LEAN), 0.1 * math.tan(SLOPE) / (1 + math.tan(LEAN) * math.tan(SLOPE))
    polygon = [[-half, -half, -rise], [half, -half, rise], [half, half, rise], [-half, half, -rise]]
    joint = contact("ground", "slab", polygon, mu) | ({"surface": surface} if surface else {})
    gravity = (G * math.sin(SLOPE), 0, -G * math.cos(SLOPE))
    ups = [-0.05 * RHO * gravity[2] * (1 + s * middle / half) for s in (-1, 1, 1, -1)]
    return state([GROUND, slab], [joint], [[-used * up, 0, up] for up in ups], gravity=gravity, tolerance=0.03)


def test_a_leaning_contact_does_not_make_a_slope_less_steep():
    """Inside the cone about the contact's normal, but at mu 0.6 not in that about its faces'; at 0.71 in both."""
    assert "not on a face" in verify(leaning(0.6, None)).reason
    assert "not on a face" in verify(leaning(0.71, None)).reason
    for surface in ("rough", "curved"):
        assert "leaves the friction cone" in verify(leaning(0.6, surface)).reason
        report = verify(leaning(0.71, surface))
        assert report.proved, report.reason
        assert ", leaning by up to 10 degrees, 1 of them on surfaces said to be rough or curved; every" in report.claim
        assert report.figures["lean"] == pytest.approx(LEAN, rel=1e-9)


def test_corrections_stay_in_the_cones_about_the_faces_too():
    """Of the 0.700 that are needed 3e-10 less is used: what is missing is added at three of the four points, which
    takes them out of the cones about their faces where 1e-10 is left there, though not out of that of the contact.
    """
    lacking = NEEDED * (1 - 3e-10)
    assert verify(leaning(NEEDED * (1 + 1e-6), "rough", lacking)).claim.endswith("every block balances exactly")
    assert verify(leaning(lacking * (1 + 1e-10), "rough", lacking)).claim.endswith("own weight")


def test_a_force_is_in_the_cones_of_both_sides():
    """The same with the contact told from the other side, so that the faces of `a` are those of the slab."""
    for mu, proved in ((0.6, False), (0.71, True)):
        certificate = leaning(mu, "rough")
        joint = certificate["contacts"][0]
        joint["a"], joint["b"], joint["polygon"] = joint["b"], joint["a"], joint["polygon"][::-1]
        certificate["forces"] = [[-x for x in row] for row in certificate["forces"][::-1]]
        assert verify(sealed(certificate)).proved is proved


@pytest.mark.parametrize(("mu", "proved"), [(0.15, False), (0.19, True)])
def test_one_face_of_each_side_is_enough(mu, proved):
    """A ridge on the ground of two planes of 10 degrees (tan 0.176), with a level contact whose points are on both: an
    upright force is in the cone of either plane from 0.176 on.
    """
    t = math.tan(LEAN)
    top = [[-0.1, -0.5, -0.1 * t], [0.1, -0.5, -0.1 * t], [0.1, 0.5, -0.1 * t], [-0.1, 0.5, -0.1 * t]]
    ridge = {
        "id": "ground",
        "vertices": [[x, y, z] for y in (-1.0, 1.0) for x, z in ((-1, -1), (1, -1), (1, -t), (0, 0), (-1, -t))],
        "faces": [
            [0, 1, 2, 3, 4],
            [9, 8, 7, 6, 5],
            [0, 5, 6, 1],
            [1, 6, 7, 2],
            [2, 7, 8, 3],
            [3, 8, 9, 4],
            [4, 9, 5, 0],
        ],
        "density": RHO,
        "fixed": True,
    }
    cube = box("cube", [-0.5, -0.5, -0.1 * t], [0.5, 0.5, 1 - 0.1 * t])
    joint = contact("ground", "cube", top, mu) | {"surface": "rough"}
    report = verify(state([ridge, cube], [joint], [[0, 0, W / 4]] * 4))
    assert report.proved is proved, report.reason
    assert proved or "leaves the friction cone" in report.reason


@pytest.mark.parametrize(("gap", "proved"), [(0.0432, True), (0.0434, False)])
def test_rough_surfaces_have_more_room(gap, proved):
    """2.5 % of the diagonal of the cube, root 3."""
    ground = box("ground", [-4, -4, -1], [4, 4, -gap], fixed=True)
    report = on_contact(BASE["polygon"], "rough", tolerance=1.0, ground=ground)
    assert ("might hold" in report.reason) is proved


# --- contacts that are hardly there ----------------------------------------------------------------------------------


@pytest.mark.parametrize("turn", [0.0, 45.0])
@pytest.mark.parametrize(("width", "wide"), [(0.0039, False), (0.0041, True)])
def test_a_contact_as_narrow_as_the_tolerance_carries_nothing(width, wide, turn):
    """A strip of 1 m: its area over half its perimeter is w / (1 + w), and has to be above 4 mm."""
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    ring = [(-0.5, -width / 2), (0.5, -width / 2), (0.5, width / 2), (-0.5, width / 2)]
    strip = [[c * x - s * y, s * x + c * y, 0.0] for x, y in ring]
    report = on_contact(strip, tolerance=1e-3)
    assert ("might hold" in report.reason) is wide
    assert ("no wider than 4 tolerances" in report.reason) is not wide
    assert "might hold" in on_contact(strip, "rough", tolerance=1e-3).reason


def test_the_tolerance_that_counts_is_what_makes_a_contact_narrow():
    """However large the stated one: 0.5 % of the cube's diagonal is 8.66 mm, four of them 34.6 mm."""
    for width, wide in ((0.0340, False), (0.0370, True)):
        strip = level(-0.5, -width / 2, 0.5, width / 2)
        assert ("might hold" in on_contact(strip, tolerance=100.0).reason) is wide


def test_a_pebble_that_floats_under_a_slab():
    """A slab of 20 m on three piers and a pebble of 2 cm that is 0.2 mm short. The slab's size gives no room for that,
    the pebble's 0.17 mm; whatever the tolerance is said to be.
    """
    slab, half = box("slab", [-10, -10, 0], [10, 10, 1]), 0.01
    for short, proved in ((1.5e-4, True), (2e-4, False)):
        pebble = box("pebble", [-half, -half, -2 * half - short], [half, half, -short])
        ground = box("ground", [-20, -20, -1], [20, 20, -2 * half - short], fixed=True)
        bed = contact("ground", "pebble", level(-half, -half, half, half, -2 * half - short))
        joint = contact("pebble", "slab", level(-half, -half, half, half, 0.0))
        motion = {"pebble": [0, 0, -1, 0, 0, 0], "slab": [0, 0, -1, 0, 0, 0]}
        report = verify(mechanism([ground, pebble, slab], [bed, joint], motion, tolerance=0.1))
        assert ("might hold" in report.reason) is proved, report.reason


# --- what the claim says ---------------------------------------------------------------------------------------------


def test_an_exact_model_needs_no_words():
    assert verify(two_cubes()).claim == "stable under rigid-block equilibrium; every block balances exactly"


def lying(top, at=0.0):
    """The cube's underside is at 0, the contact `at`, the ground's top somewhere near."""
    ground = box("ground", [-4, -4, -1], [4, 4, top], fixed=True)
    return verify(
        state(
            [ground, CUBE],
            [contact("ground", "cube", level(-0.5, -0.5, 0.5, 0.5, at))],
            [[0, 0, W / 4]] * 4,
            tolerance=0.005,
        )
    )


@pytest.mark.parametrize(
    ("top", "at", "off", "gap", "overlap"),
    [
        (-0.001, 0.0, 0.001, 0.001, 0.0),
        (-0.002, -0.001, 0.001, 0.002, 0.0),
        (0.001, 0.0, 0.001, 0.0, 0.001),
        (0.002, 0.001, 0.001, 0.0, 0.002),
        (0.0, 0.002, 0.002, 0.0, 0.0),
        (0.003, 0.004, 0.004, 0.0, 0.003),
    ],
)
def test_gaps_and_overlaps_are_told(top, at, off, gap, overlap):
    report = lying(top, at)
    assert report.proved, report.reason
    figures = [report.figures[key] for key in ("misfit", "contact_gap", "contact_overlap", "lean")]
    assert figures == pytest.approx([off, gap, overlap, 0], abs=1e-12)
    assert f", contacts up to {off:.2g} m off the faces" in report.claim
    assert (f"(gaps up to {gap:.2g} m)" in report.claim) is (gap > 0)
    assert (f"(faces up to {overlap:.2g} m into each other)" in report.claim) is (overlap > 0)
    assert "leaning" not in report.claim


@pytest.mark.parametrize(("gap", "told"), [(1.7e-5, False), (1.8e-5, True)])
def test_what_is_less_than_drawings_say_is_not_told(gap, told):
    """Up to 1e-5 of the cube's diagonal, root 3."""
    assert ("off the faces" in lying(-gap).claim) is told


def test_a_point_on_the_brink_of_a_step_lies_on_the_step():
    """Rough ground is 0.5 mm lower, or higher, beyond the cube's side: within the tolerance, and nothing to be told."""
    for low in (5e-4, -5e-4):
        outline = [(-4, -1), (4, -1), (4, -low), (0.5, -low), (0.5, 0), (-4, 0)]
        vertices, faces = extruded(outline, -4, 4)
        ground = {"id": "ground", "vertices": vertices, "faces": faces, "density": RHO, "fixed": True}
        certificate = on_support(ground, level(-0.5, -0.5, 0.5, 0.5), tolerance=0.002)
        certificate["contacts"][0]["surface"] = "rough"
        report = verify(sealed(certificate))
        assert report.proved, report.reason
        assert [report.figures[key] for key in ("misfit", "contact_gap", "contact_overlap")] == [0, 0, 0]


def test_a_contact_beside_its_face_is_told():
    ground = box("ground", [-4, -4, -1], [0.499, 4, 0], fixed=True)
    report = verify(on_support(ground, level(-0.5, -0.5, 0.5, 0.5), tolerance=0.002))
    assert report.figures["misfit"] == pytest.approx(0.001, rel=1e-9)
    assert report.figures["contact_gap"] == report.figures["contact_overlap"] == 0
    assert "contacts up to 0.001 m off the faces; " in report.claim


@pytest.mark.parametrize(("slope", "told"), [(0.9e-4, False), (1.1e-4, True), (9e-4, True)])
def test_lean_is_told(slope, told):
    h = 0.01
    polygon = [[-h, -h, -slope * h], [h, -h, slope * h], [h, h, slope * h], [-h, h, -slope * h]]
    report = verify(state([GROUND, CUBE], [contact("ground", "cube", polygon)], [[0, 0, W / 4]] * 4, tolerance=1e-4))
    assert report.proved, report.reason
    assert report.figures["lean"] == pytest.approx(slope, rel=1e-6)
    assert (f"leaning by up to {math.degrees(slope):.2g} degrees" in report.claim) is told


def test_the_worst_contact_is_told():
    """Two cubes: below a gap of 1 mm, above the faces 2 mm into each other."""
    certificate = two_cubes()
    for vertex in certificate["blocks"][0]["vertices"]:
        vertex[2] -= 0.001
    for vertex in certificate["blocks"][2]["vertices"]:
        vertex[2] -= 0.002
    report = verify(sealed({**certificate, "tolerance": 0.005}))
    assert report.proved
    said = ", contacts up to 0.002 m off the faces (gaps up to 0.001 m) (faces up to 0.002 m into each other);"
    assert said in report.claim


@pytest.mark.parametrize("fine", [1e-150, 1e-100, 2.0**-60])
def test_a_tiny_coordinate_hides_no_misfit(fine):
    """A vertex that no face uses makes all integers long, and once made what is told as small as one likes."""
    ground = box("ground", [-4, -4, -1], [0.499, 4, -0.001], fixed=True)
    ground["vertices"].append([fine, 0.0, 0.0])
    report = verify(on_support(ground, level(-0.5, -0.5, 0.5, 0.5), tolerance=0.002))
    assert report.proved
    assert report.figures["misfit"] == pytest.approx(math.hypot(0.001, 0.001), rel=1e-9)
    assert report.figures["contact_gap"] == pytest.approx(0.001, rel=1e-9)
