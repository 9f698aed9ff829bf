"""Contacts at points: corners on faces, edges across edges, and what is neither.

By hand: a stool of four legs, a block whose underside is hollow, stands on its corners. Forces there are in the cones
about the normal of the ground, however steep the hollow is; a roof that stands ridge on ridge, crossed, has the normal
of both ridges.
Mutants killed: the highest corner not asked for; the distance from it; which side of it is outside; a level edge; that
edges cross; the normal that two edges have; a corner on both sides; friction about anything but the contact's normal.
"""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.proof import Memory, verify
from laws import examples
from test_proof_checker import GROUND, RHO, G, box, contact, level, mechanism, sealed, state
from test_proof_solids import extruded

TOLERANCE = 1e-6


def at(a, b, point, normal=(0.0, 0.0, 1.0), mu=0.5):
    return contact(a, b, [list(point)], mu) | {"surface": "point", "normal": list(normal)}


def stool(rise, low=(-1.0, -1.0), high=(1.0, 1.0), up=1):
    """A block 1 m high whose underside rises to its middle; its volume is that of a box less a pyramid."""
    (x, y), (X, Y) = low, high
    bottom = [[x, y, 0.0], [X, y, 0.0], [X, Y, 0.0], [x, Y, 0.0]]
    top = [[px, py, 1.0] for px, py, _ in bottom]
    faces = [[(k + 1) % 4, k, 8] for k in range(4)] + [[k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k] for k in range(4)]
    middle = [(x + X) / 2.0, (y + Y) / 2.0, rise]
    block = {"id": "stool", "vertices": [*bottom, *top, middle], "faces": [*faces, [4, 5, 6, 7]]}
    return block | {"density": RHO, "fixed": False}


def standing(rise, side, mu, share=1.0):
    """A stool on its corners, under gravity of which a share goes sideways along x; forces as they have to be.

    Centre of mass: box of 4 m3 at 0.5, less a pyramid of 4/3 rise at a quarter of its height.
    """
    hollow = 4.0 * rise / 3.0
    volume, height = 4.0 - hollow, (2.0 - hollow * rise / 4.0) / (4.0 - hollow)
    weight = RHO * volume * G
    tip = side * weight * height / 4.0  # on each pair of corners, 2 m apart: moment over twice the lever
    ups = [weight / 4.0 + sign * tip for sign in (-1, 1, 1, -1)]
    joints, forces = [], []
    for (x, y), up in zip([(-1, -1), (1, -1), (1, 1), (-1, 1)], ups, strict=True):
        joints.append(at("ground", "stool", (x, y, 0.0), mu=mu))
        forces.append([-share * side * up, 0.0, up])
    return state([GROUND, stool(rise)], joints, forces, gravity=(side * G, 0.0, -G), tolerance=TOLERANCE)


def said(joint, blocks):
    """What is wrong with a contact, which is looked at before the motion that it is given with."""
    blocks = [block | {"fixed": block is not blocks[-1]} for block in blocks]
    return verify(mechanism(blocks, [joint], {blocks[-1]["id"]: [0, 0, -1, 0, 0, 0]}, tolerance=TOLERANCE)).reason


@pytest.mark.parametrize("rise", [0.02, 0.2, 0.6])
def test_a_stool_stands_on_its_corners(rise):
    """The faces of a hollow of 0.02 lean by a degree, of 0.2 by 11, of 0.6 by 31: only the ground's normal counts."""
    report = verify(standing(rise, 0.0, 0.5))
    assert report.proved, report.reason
    assert "4 of them at corners and edges" in report.claim
    assert verify(standing(rise, 0.3, 0.31)).proved
    assert "leaves the friction cone" in verify(standing(rise, 0.3, 0.29)).reason


def test_a_memory_of_certificates_before_changes_no_answer():
    """Lengths of these are counted in different units, so that the same normal is not the same integers."""
    memory, proved = Memory(), []
    for rise in (0.5, 0.02, 0.5, 0.3):
        for mu in (0.31, 0.29):
            certificate = standing(rise, 0.3, mu)
            assert verify(certificate, memory) == verify(certificate)
            proved.append(verify(certificate).proved)
    assert proved == [True, False] * 4


def test_the_length_of_a_normal_is_nothing_but_a_unit():
    certificate = standing(0.2, 0.3, 0.31)
    joints = [joint | {"normal": [0.0, 0.0, 1e-3]} for joint in certificate["contacts"]]
    assert verify(sealed({**certificate, "contacts": joints})).proved
    smooth = standing(0.2, 0.0, 0.0)
    forces = [[force[2]] for force in smooth["forces"]]  # by unit vectors, which the normals are
    assert verify(sealed({**smooth, "forces": forces})).proved


def test_a_contact_has_to_say_that_it_is_a_point():
    certificate = standing(0.6, 0.0, 0.5)

    def changed(wrong, **change):
        joints = [joint | change for joint in certificate["contacts"]]
        joints = [{key: value for key, value in joint.items() if value is not None} for joint in joints]
        report = verify(sealed({**certificate, "contacts": joints}))
        assert not report.proved
        assert wrong in report.reason

    for surface in (None, "rough"):
        changed("fewer than three points", surface=surface)
        changed("only a point has a normal", surface=surface, polygon=level(-1.0, -1.0, 1.0, 1.0))
    changed("normal is missing or zero", normal=None)
    changed("normal is missing or zero", normal=[0.0, 0.0, 0.0])
    changed("normal has 2 numbers", normal=[0.0, 1.0])
    changed("more points than one", polygon=level(-1.0, -1.0, 1.0, 1.0))
    changed("or a point pulls", tension=1.0)


@pytest.mark.parametrize(
    ("x", "y", "z", "wrong"),
    [
        (-1.0, -1.0, 0.0, None),
        (-1.0, -1.0 + 4e-6, 0.0, None),  # on the edge to the next corner, which is level
        (-1.0 + 4e-6, -1.0 + 4e-6, 0.0, "not on a face of its block b"),  # under the hollow
        (-1.0, -1.0, 4e-6, "not on a face of its block a"),
        (-1.0, -1.0 - 4e-6, 0.0, "not on a face of its block b"),
        (0.0, 0.0, 0.2, "not on a face of its block a"),  # the top of the hollow
    ],
)
def test_where_a_corner_is(x, y, z, wrong):
    reason = said(at("ground", "stool", (x, y, z)), [GROUND, stool(0.2)])
    assert (wrong or "might hold") in reason


@pytest.mark.parametrize(("lean", "good"), [(0.0, True), (0.0009, True), (0.0011, False), (0.1, False)])
def test_the_normal_is_that_of_the_face(lean, good):
    reason = said(at("ground", "stool", (-1.0, -1.0, 0.0), (lean, 0.0, 1.0)), [GROUND, stool(0.2)])
    assert ("might hold" in reason) is good


def test_faces_that_lie_on_each_other_are_no_points():
    """Or a contact too narrow to be one could call itself a point: two cubes side by side, one a hair further up."""
    cube = box("cube", [-0.5, -0.5, 0], [0.5, 0.5, 1])
    assert "no corner or edge" in said(at("ground", "cube", (0.0, 0.0, 0.0)), [GROUND, cube])
    assert "might hold" in said(at("ground", "cube", (0.5, 0.5, 0.0)), [GROUND, cube])
    assert "might hold" in said(contact("ground", "cube", level(-0.5, -0.5, 0.5, 0.5)), [GROUND, cube])


def test_a_pit_is_no_corner():
    """The apex of a pit from below is its highest point, but there is stone above it: what lies in it does not rest."""
    pit = stool(0.5)
    above = box("above", [-0.1, -0.1, 0.5], [0.1, 0.1, 0.9])
    assert "not on a face of its block a" in said(at("stool", "above", (0.0, 0.0, 0.5)), [pit, above])


def test_a_slanting_notch_is_no_corner():
    """The end of a notch from the side is higher than all of its walls, of which one looks up: stone is above it."""
    box_corners = [[x, y, z] for x in (-1.0, 1.0) for y, z in ((-1, 0), (1, 0), (1, 1), (-1, 1))]
    mouth = [[1.0, -0.5, 0.45], [1.0, 0.5, 0.45], [1.0, 0.0, 0.2]]
    plain = [[0, 3, 2, 1], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    around = [[4, 5, 10], [5, 9, 10], [5, 6, 9], [6, 8, 9], [6, 7, 8], [7, 4, 8], [4, 10, 8]]
    walls = [[8, 11, 9], [9, 11, 10], [10, 11, 8]]
    notched = {"id": "notched", "vertices": [*box_corners, *mouth, [0.0, 0.0, 0.5]], "faces": [*plain, *around, *walls]}
    above = box("above", [-0.1, -0.1, 0.5], [0.1, 0.1, 0.9])
    reason = said(at("notched", "above", (0.0, 0.0, 0.5)), [notched | {"density": RHO, "fixed": True}, above])
    assert "not on a face of its block a" in reason


def test_another_corner_is_lower():
    block = stool(0.2)
    block["vertices"][1][2] = -0.01
    assert "not on a face of its block b" in said(at("ground", "stool", (-1.0, -1.0, 0.0)), [GROUND, block])


def test_the_ridge_of_a_blade_is_not_at_its_middle():
    """Both of its sides are within the tolerance of its middle plane, and meet in the ridge, half a metre above."""
    vertices, faces = extruded([(2.5e-7, 0), (0, 1), (-2.5e-7, 0)], -2, 2)
    blade = {"id": "blade", "vertices": [list(map(float, p)) for p in vertices], "faces": faces, "density": RHO}
    above = box("above", [-0.1, -0.1, 0.5], [0.1, 0.1, 0.9])
    reason = said(at("blade", "above", (0.0, 0.0, 0.5)), [blade | {"fixed": True}, above])
    assert "not on a face of its block a" in reason


def ridges(turn, rise=1.0, lean=0.0, low=0.0):
    """A roof on the ground with its ridge along y, and one upside down on it, turned about the vertical."""
    below, faces = extruded([(1, 0), (0, rise), (-1, 0)], -2, 2)
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    above = [[c * x - s * y, s * x + c * y, 2.0 * rise - z + low] for x, y, z in below]
    turned = [face[::-1] for face in faces]
    roofs = [
        {"id": name, "vertices": [list(map(float, p)) for p in vertices], "faces": some, "density": RHO, "fixed": fixed}
        for name, vertices, some, fixed in (("below", below, faces, True), ("above", above, turned, False))
    ]
    return at("below", "above", (0.0, 0.0, rise), (lean, 0.0, 1.0)), roofs


def test_ridge_on_ridge():
    joint, roofs = ridges(90.0)
    weight = RHO * 4.0 * G
    report = verify(state(roofs, [joint], [[0.0, 0.0, weight]], tolerance=TOLERANCE))
    assert report.proved, report.reason


@pytest.mark.parametrize(
    ("turn", "lean", "low", "wrong"),
    [
        (90.0, 0.0, 0.0, None),
        (30.0, 0.0, 0.0, None),
        (4.0, 0.0, 0.0, "nor on edges that cross"),
        (0.0, 0.0, 0.0, "nor on edges that cross"),
        (90.0, 0.002, 0.0, "not on a face of its block b"),  # its edge is not level then
        (30.0, 0.0015, 0.0, "leans from the plane"),
        (90.0, 0.0, 1e-5, "not on a face of its block b"),
    ],
)
def test_edges_have_to_cross_and_the_normal_is_theirs(turn, lean, low, wrong):
    joint, roofs = ridges(turn, lean=lean, low=low)
    assert (wrong or "might hold") in said(joint, roofs)


@pytest.mark.parametrize(("fall", "good"), [(0.0, True), (0.0005, True), (0.003, False)])
def test_an_edge_on_a_face_is_level(fall, good):
    """A roof upside down, its ridge on the ground, one end of it raised."""
    _, (_, roof) = ridges(0.0)
    roof["vertices"] = [[x, y, z - 1.0 + fall * (y + 2.0)] for x, y, z in roof["vertices"]]
    ground = box("ground", [-4, -4, -1], [4, 4, 2 * fall])
    reason = said(at("ground", "above", (0.0, 0.0, 2.0 * fall)), [ground, roof])
    assert ("might hold" in reason) is good


def test_corners_of_both_blocks_have_no_plane():
    """Two spires, tip on tip."""

    def spire(name, up, fixed):
        corners = [[-1, -1, -up], [1, -1, -up], [1, 1, -up], [-1, 1, -up], [0, 0, 0]]
        faces = [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
        faces = faces if up > 0 else [face[::-1] for face in faces]
        return {"id": name, "vertices": corners, "faces": faces, "density": RHO, "fixed": fixed}

    tip = at("below", "above", (0.0, 0.0, 0.0))
    assert "no face that looks along it" in said(tip, [spire("below", 1.0, True), spire("above", -1.0, False)])


@settings(max_examples=examples(25), deadline=None)
@given(
    rise=st.floats(0.01, 0.8),
    turn=st.floats(0.0, 360.0),
    scale=st.sampled_from([1e-2, 1.0, 1e2]),
    away=st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)),
)
def test_where_it_stands_and_how_large_it_is_changes_nothing(rise, turn, scale, away):
    certificate = standing(rise, 0.0, 0.5)
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))

    def moved(point):
        x, y, z = (scale * value for value in point)
        shifted = [c * x - s * y + scale * away[0], s * x + c * y + scale * away[1], z]
        return [value if abs(value) > 1e-100 else 0.0 for value in shifted]

    blocks = [block | {"vertices": [moved(p) for p in block["vertices"]]} for block in certificate["blocks"]]
    joints = [joint | {"polygon": [moved(p) for p in joint["polygon"]]} for joint in certificate["contacts"]]
    forces = [[scale**3 * f for f in force] for force in certificate["forces"]]
    report = verify(
        sealed({**certificate, "blocks": blocks, "contacts": joints, "forces": forces, "tolerance": scale * TOLERANCE})
    )
    assert report.proved, report.reason


def knife(half, mu, share, turned):
    """A ridge and a knife edge on it that may not turn, both 2 m long; normals lean by `half` degrees to either side.

    At both ends forces in the cones of `share` times mu about both normals, as far along the ridge as they go, turned
    down the faces by `turned` radians; and the gravity that they balance, with its slope along the ridge.
    """
    up, out = math.cos(math.radians(half)), math.sin(math.radians(half))
    solids = {
        "low": extruded([(1.0, -out / up), (0.0, 0.0), (-1.0, -out / up)], 0.0, 2.0),
        "top": extruded([(0.0, 0.0), (1.0, out / up), (-1.0, out / up)], 0.0, 2.0),
    }
    blocks = [
        {"id": name, "vertices": vertices, "faces": faces, "density": RHO, "fixed": name == "low"}
        for name, (vertices, faces) in solids.items()
    ]
    blocks[1]["held"] = ["rx", "ry", "rz"]
    joints, forces = [], []
    for y in (0.0, 2.0):
        for sign in (-1.0, 1.0):
            joints.append(at("low", "top", (0.0, y, 0.0), normal=(sign * out, 0.0, up), mu=mu))
            down, along = share * mu * math.sin(turned), share * mu * math.cos(turned)
            forces.append([sign * (out + down * up), along, up - down * out])
    weight = RHO * G * 2.0 * out / up
    scale, slope = weight / sum(z for _, _, z in forces), forces[0][1] / forces[0][2]
    forces = [[scale * x for x in row] for row in forces]
    return state(blocks, joints, forces, gravity=(0.0, -slope * G, -G), tolerance=TOLERANCE), slope


@pytest.mark.parametrize("half", [5.0, 45.0, 60.0])
@pytest.mark.parametrize("mu", [0.2, 1.0])
def test_an_edge_on_an_edge_grips_no_more_than_about_one_normal(half, mu):
    """By hand: in the cones of mu' = mu cos / sqrt(1 + mu^2 sin^2) about both normals the sum is steepest at a slope of
    mu, where sin(turned) = mu' tan; in those of mu it would be more.
    """
    up, out = math.cos(math.radians(half)), math.sin(math.radians(half))
    grip = up / math.hypot(1.0, mu * out)
    for turned in (0.0, math.asin(min(grip * mu * out / up, 1.0))):
        certificate, slope = knife(half, mu, grip * (1.0 - 1e-6), turned)
        assert verify(certificate).proved, verify(certificate).reason
        assert slope < mu
        assert slope > mu * (1.0 - 2e-6) or not turned
        assert "friction cone" in verify(knife(half, mu, grip * (1.0 + 1e-6), turned)[0]).reason


def test_an_edge_on_an_edge_with_one_normal_grips_as_that_one_does():
    certificate = knife(45.0, 0.5, 1.0 - 1e-6, 0.0)[0]
    certificate["contacts"], certificate["forces"] = certificate["contacts"][::2], certificate["forces"][::2]
    certificate["blocks"][1]["held"] = ["x", "rx", "ry", "rz"]
    certificate["forces"] = [[2.0 * x for x in row] for row in certificate["forces"]]
    assert verify(sealed(certificate)).proved


def test_an_edge_is_not_far_from_an_edge_because_the_tolerance_has_room():
    """The knife edge is 0.6 tolerances down a face from the ridge, points with its normal 1.4, others on the ridge."""
    grip, across, up = math.sqrt(0.75 / 1.25), TOLERANCE * math.sqrt(0.75), TOLERANCE / 2.0
    for share, proved in ((1.0 - 1e-6, True), (1.0 + 1e-6, False), (1.2, False)):
        certificate = knife(30.0, 1.0, grip * share, 0.0)[0]
        top = certificate["blocks"][1]
        top["vertices"] = [[x - 0.6 * across, y, 4.0 * z - 0.6 * up] for x, y, z in top["vertices"]]  # it is sharper
        top["density"] /= 4.0
        for joint in certificate["contacts"]:
            ((x, y, z),) = joint["polygon"]
            down = 1.4 if joint["normal"][0] < 0.0 else 0.0
            joint["polygon"] = [[x - down * across, 0.5 + y / 2.0, z - down * up]]
        report = verify(sealed(certificate))
        assert report.proved is proved, report.reason
        assert proved or "friction cone" in report.reason
