"""Where polyhedra touch: by hand, from either side, and as the certificate checker wants it.

By hand: a cube that overhangs another lies on what they share; a prism with an edge down touches with the ends of the
edge that are over the face, and where it leaves the face; of two ridges that cross, one point.
Mutants killed: the gap of the larger body; a corner that others are lower than; points of one plane that are not one
face; the normal of the wrong body.
"""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly, Block, Contacts
from cyclopean.assembly.patches import gathered
from cyclopean.design.rubble.features import body_of
from cyclopean.design.rubble.seating import seat
from cyclopean.design.rubble.touching import TOUCH, _top, touching
from cyclopean.errors import InputError
from cyclopean.io import read_model, write_model
from cyclopean.io.exchange import write_exchange
from fixtures_stones import boulder, box, rotation
from laws import examples
from oracle_models import box as oracle_box
from test_proof_points import knife, ridges, stool

GROUND = body_of(*box(8.0, 8.0, 1.0, at=(-4.0, -4.0, -1.0)))


def prism(long=1.0, at=(0.0, 0.0, 0.0)):
    """A bar of 45 degrees with its edge down, along x."""
    vertices, triangles = box(long, 1.0, 1.0, at=(-long / 2.0, -0.5, -0.5))
    c = np.sqrt(0.5)
    turned = vertices @ np.array([[1.0, 0.0, 0.0], [0.0, c, -c], [0.0, c, c]]).T
    return body_of(turned + np.array([0.0, 0.0, c]) + np.array(at), triangles)


def points(parts):
    return sorted(tuple(np.round(part.polygon.mean(axis=0), 6) + 0.0) for part in parts)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_cube_that_overhangs_lies_on_what_they_share(turn):
    c, s = np.cos(turn), np.sin(turn)
    spin = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    (vertices, triangles), (above, _) = (
        box(2.0, 2.0, 1.0, at=(-1.0, -1.0, 0.0)),
        box(1.0, 1.0, 1.0, at=(0.4, -0.5, 1.0)),
    )
    (part,) = touching(body_of(above @ spin.T, triangles), [body_of(vertices @ spin.T, triangles)])[0]
    assert part.kind == "flat"
    assert part.touching == pytest.approx(0.6, rel=1e-9)
    assert part.normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


def test_an_edge_touches_at_its_ends():
    """One end is over the face; the other is beyond it, and the edge leaves the face at 0.5."""
    below = body_of(*box(1.0, 1.0, 1.0, at=(-0.5, -0.5, -1.0)))
    parts = touching(prism(1.0, (0.3, 0.0, 0.0)), [below])[0]
    assert {part.kind for part in parts} == {"point"}
    assert points(parts) == [(-0.2, 0.0, 0.0), (0.5, 0.0, 0.0)]
    for part in parts:
        assert part.normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


def test_ridges_that_cross_touch_at_a_point():
    below = prism(3.0)
    spin = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    above = below.moved(spin, [0.1, 0.2, np.sqrt(2.0)])
    parts = touching(above, [below])[0]
    assert points(parts) == [(0.1, 0.0, np.round(np.sqrt(2.0), 6))]
    assert parts[0].normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


@pytest.mark.parametrize(("gap", "count"), [(0.5, 1), (2.0, 0)])
def test_the_gap_is_that_of_the_smaller_body(gap, count):
    pebble = body_of(*box(0.1, 0.1, 0.1, at=(0.0, 0.0, gap * 0.1 * TOUCH)))
    assert len(touching(pebble, [GROUND])[0]) == count
    assert len(touching(GROUND, [pebble])[0]) == count


def test_bodies_that_are_apart_do_not_touch():
    away = body_of(*box(1.0, 1.0, 1.0, at=(9.0, 0.0, 0.0)))
    assert touching(away, [GROUND, prism()]) == [(), ()]
    assert touching(away, []) == []


def test_a_corner_that_another_is_lower_than_is_none():
    """A plank with a long edge down touches at both its ends; with one of them lifted by a millimetre, at the other."""
    vertices, triangles = box(1.0, 0.2, 0.1)
    lean = 0.02  # radians about the length, so that one long edge is down
    turned = (
        vertices @ np.array([[1.0, 0.0, 0.0], [0.0, np.cos(lean), -np.sin(lean)], [0.0, np.sin(lean), np.cos(lean)]]).T
    )
    turned[:, 2] += 0.5 * TOUCH * np.cbrt(0.02)
    assert {part[0] for part in points(touching(body_of(turned, triangles), [GROUND])[0])} == {0.0, 1.0}
    tipped = turned + np.outer(turned[:, 0], [0.0, 0.0, 1e-3])
    (part,) = touching(body_of(tipped, triangles), [GROUND])[0]
    assert part.polygon.mean(axis=0)[0] == pytest.approx(0.0, abs=1e-6)


def solid(block):
    faces = [(ring[0], p, q) for ring in block["faces"] for p, q in pairwise(ring[1:])]
    return body_of(np.array(block["vertices"], float), np.array(faces))


def lowered():
    block = stool(0.2)
    block["vertices"][1][2] = -0.01
    return block


def raised(fall):
    """A roof upside down, its ridge at z = 0 in the middle, one end of it higher."""
    _, (_, roof) = ridges(0.0)
    return roof | {"vertices": [[x, y, z - 1.0 + fall * y] for x, y, z in roof["vertices"]]}


@pytest.mark.parametrize(
    ("block", "point", "up", "told"),
    [
        (stool(0.2), (-1.0, -1.0, 0.0), -1.0, True),
        (stool(0.2), (-0.9, -0.9, 0.0), -1.0, False),  # under the hollow
        (lowered(), (-1.0, -1.0, 0.0), -1.0, False),  # another corner is lower
        (stool(0.5), (0.0, 0.0, 0.5), 1.0, False),  # the end of a pit
        (raised(0.0), (0.0, 0.0, 0.0), -1.0, True),
        (raised(3e-3), (0.0, 0.0, 0.0), -1.0, False),  # an edge that is not level
    ],
)
def test_what_touches_a_plane_at_a_point_is_what_the_checker_says(block, point, up, told):
    """The same cases as those of the certificate checker, by the same rule."""
    found = _top(solid(block), np.array(point), np.array([0.0, 0.0, up]), 1e-4)
    assert (found.run is not None) is told


@pytest.mark.parametrize(("turn", "count"), [(90.0, 1), (30.0, 1), (4.0, 0)])
def test_edges_that_hardly_cross_have_no_normal(turn, count):
    _, (below, above) = ridges(turn)
    assert len(touching(solid(above), [solid(below)])[0]) == count


@pytest.fixture
def bar():
    """A bar with an edge down on the ground, held there by the contacts that it has."""
    lying = prism()
    contacts, _ = gathered({(0, 1): touching(lying, [GROUND])[0]})
    blocks = [
        Block(name, body.vertices, tuple(map(tuple, body.triangles.tolist())), None, name == "ground")
        for name, body in (("ground", GROUND), ("bar", lying))
    ]
    return Assembly(tuple(blocks), contacts, ())


def test_a_file_says_that_contacts_are_points(bar, tmp_path):
    write_model(tmp_path / "bar.json", bar)
    again, _ = read_model(tmp_path / "bar.json")
    assert again.contacts.at_points.tolist() == [True, True]
    assert (again.contacts.frame == bar.contacts.frame).all()
    assert (again.contacts.point == bar.contacts.point).all()
    assert again.contacts.only(np.array([1])).at_points.tolist() == [True]
    assert write_exchange(tmp_path / "bar.obj", bar) == (
        "bar.obj: OBJ holds no supports, contacts, points for contacts: dropped",
    )


@pytest.mark.parametrize("ending", [".3dm", ".ifc", ".glb", ".compas.json"])
def test_other_formats_hold_points(bar, tmp_path, ending):
    """As points, with their normals; what a result says of them goes along."""
    pytest.importorskip({".3dm": "rhino3dm", ".ifc": "ifcopenshell"}.get(ending, "numpy"))
    assert write_exchange(tmp_path / f"bar{ending}", bar) == ()
    again = read_model(tmp_path / f"bar{ending}")[0].contacts
    for name in ("a", "b", "start", "point", "facing"):
        assert getattr(again, name) == pytest.approx(getattr(bar.contacts, name), abs=1e-12), name


def test_points_do_not_pull(bar, tmp_path):
    """A tension for all joints leaves them dry and says so; one of their own is refused."""
    tipped = (5.0, 90.0)  # about its edge, which 1e5 Pa on any area would hold
    dry, asked = (check(bar, Settings(method="rbe", mu=0.6, tilt=tipped, tension=pull)) for pull in (None, 1e5))
    assert dry.verdict == asked.verdict == "unstable"
    assert "2 of 2 contacts are points, which have no area to pull with: they stay dry" in asked.warnings
    write_model(tmp_path / "bar.json", bar)
    data = json.loads((tmp_path / "bar.json").read_text())
    data["contacts"][0]["tension"] = 1e5
    (tmp_path / "bar.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match="a point has no area to pull with; leave its tension out"):
        read_model(tmp_path / "bar.json")


def test_smooth_points_carry_what_is_square_to_them(bar):
    """Four smooth corners of a stool hold it against gravity, and nothing sideways."""
    ground, block = (body_of(*box(8.0, 8.0, 1.0, at=(-4.0, -4.0, -1.0))), solid(stool(0.2)))
    contacts, _ = gathered({(0, 1): touching(block, [ground])[0]})
    assert contacts.at_points.tolist() == [True] * 4
    blocks = [
        Block(name, body.vertices, tuple(map(tuple, body.triangles.tolist())), None, name == "ground")
        for name, body in (("ground", ground), ("stool", block))
    ]
    standing = Assembly(tuple(blocks), contacts, ())
    assert check(standing, Settings(method="rbe", mu=0.0)).verdict == "stable"
    assert check(standing, Settings(method="cra", mu=0.0)).verdict == "stable"
    assert check(standing, Settings(method="rbe", mu=0.0, tilt=(1.0, 0.0))).verdict == "unstable"


def test_a_contact_that_is_no_point_proves_nothing(bar):
    """Off the edge it is refused by name; in the middle of a face of either block no proof takes it."""
    off = replace(bar.contacts, point=bar.contacts.point + np.array([0.0, 0.2, 0.0]))
    with pytest.raises(InputError, match="off the faces, corners and edges of block 'bar'"):
        check(replace(bar, contacts=off), Settings(method="rbe", mu=0.6))
    ground = Block("ground", *oracle_box((-4.0, -4.0, -1.0), (4.0, 4.0, 0.0)), fixed=True)
    flat = replace(bar, blocks=(ground, Block("bar", *oracle_box((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0)))))
    single = bar.contacts.only(np.array([0]))
    single = replace(single, point=single.point - single.point.mean(axis=0))
    result = check(replace(flat, contacts=single), Settings(method="rbe", mu=0.6))
    assert result.verdict == "undecided"
    assert "no corner or edge" in str(result.provenance["refused"])


@settings(max_examples=examples(12), deadline=None)
@given(seed=st.integers(0, 10**6), ratio=st.sampled_from([0.15, 0.5, 1.0]))
def test_what_touches_does_so_from_either_side_and_a_proof_takes_it(seed, ratio):
    """A boulder at rest on another one and on the ground; of either size."""
    draw = np.random.default_rng(seed)
    lower = body_of(*boulder(seed)).moved(rotation(seed), [0.0, 0.0, 2.0])
    first = seat(lower, np.eye(3), np.zeros(3), (GROUND,), None)
    lower = lower.moved(first.rotation, first.shift)
    vertices, triangles = boulder(seed + 1)
    upper = body_of(ratio * vertices, triangles)
    drop = [*draw.uniform(-0.5, 0.5, 2), float(lower.high[2]) + 1.0]
    rest = seat(upper, rotation(seed + 1), drop, (lower, GROUND), None)
    upper = upper.moved(rest.rotation, rest.shift)
    parts = touching(upper, [lower])[0]
    back = touching(lower, [upper])[0]
    assert points(parts) == points(back)
    ahead = sorted(tuple(np.round(part.normal, 6) + 0.0) for part in parts)
    assert ahead == sorted(tuple(np.round(-part.normal, 6) + 0.0) for part in back)
    bodies = (GROUND, lower, upper)
    found = {(0, 1): touching(lower, [GROUND])[0], (0, 2): touching(upper, [GROUND])[0], (1, 2): parts}
    contacts, _ = gathered({pair: parts for pair, parts in found.items() if parts})
    blocks = [
        Block(f"b{k}", b.vertices, tuple(map(tuple, b.triangles.tolist())), None, k == 0) for k, b in enumerate(bodies)
    ]
    result = check(Assembly(tuple(blocks), contacts, ()), Settings(method="rbe", mu=0.6, seconds=20.0))
    assert result.verdict in ("stable", "unstable")
    assert "refused" not in result.provenance
    assert result.certificate is not None


@pytest.mark.parametrize(("share", "word"), [(0.98, "stable"), (1.02, "undecided"), (1.5, "unstable")])
@pytest.mark.parametrize(("half", "mu"), [(30.0, 0.5), (45.0, 0.6)])
def test_an_edge_on_an_edge_is_held_up_to_the_slope_that_a_proof_takes(half, mu, share, word):
    """By hand, of a knife edge that may not turn, listed with both normals: up to mu it stands; from mu / sqrt(cos^2 a
    - mu^2 sin^2 a) on it slides; between the two no proof is taken.
    """
    given_, up, out = knife(half, mu, 1.0, 0.0)[0], np.cos(np.radians(half)), np.sin(np.radians(half))
    blocks = tuple(
        Block(b["id"], b["vertices"], b["faces"], b["density"], b["fixed"], held=tuple(b.get("held", ())))
        for b in given_["blocks"]
    )
    joints = given_["contacts"]
    contacts = Contacts.of(
        [(0, 1)] * len(joints),
        [np.array(joint["polygon"]) for joint in joints],
        [mu] * len(joints),
        facing=[np.array(joint["normal"]) for joint in joints],
    )
    slope = share * (mu if share < 1.2 else mu / np.sqrt(up**2 - (mu * out) ** 2))
    result = check(Assembly(blocks, contacts, ()), Settings(method="rbe", gravity=(0.0, -9.81 * slope, -9.81)))
    assert result.verdict == word, result.reason
