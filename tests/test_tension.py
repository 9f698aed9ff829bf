"""Joints that pull: counted on only where someone says so, and then said aloud.

By hand. A cube of weight W overhangs the cube below by 0.8 of its metre. The joint is 0.2 m x 1 m, the centre hangs
0.3 m beyond its near edge. About that edge an even pull s on the joint gives s x 0.2 x 0.1, the weight W x 0.3: it
stands from s = 15 W on. A cube glued to an upright face slides down unless mu s >= W, and turns unless s / 2 >= W / 2
(areas of 1 m2). So with mu = 0.84 the cohesion has to be W, with mu = 5 the tension.
"""

import copy
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import Polygon

from coupled_cases import prism
from cyclopean.analysis import Settings, check, solve_cra
from cyclopean.analysis.preparation import prepare
from cyclopean.analysis.sensitivity_study.ranges import Range
from cyclopean.analysis.sensitivity_study.throughout import corners
from cyclopean.assembly import Assembly, Block, Contacts, Load, detect, supports
from cyclopean.design import wall
from cyclopean.errors import InputError
from cyclopean.io import read_model, write_model
from cyclopean.proof import checker, seal, verify
from cyclopean.statics import equilibrium_system
from laws import examples
from test_proof_solids import extruded

G = 9.80665
W = 2400.0 * G
LOW = replace(prism("low", [(0, 0), (1, 0), (1, 1), (0, 1)], 1.0), fixed=True)
HANGING = Assembly((LOW, prism("top", [(0.8, 1), (1.8, 1), (1.8, 2), (0.8, 2)], 1.0)))
GLUED = Assembly((LOW, prism("side", [(1, 0), (2, 0), (2, 1), (1, 1)], 1.0)))


def of(model: Assembly, tension: float, mu: float = 0.84) -> Any:
    return check(model, Settings(method="rbe", tension=tension, mu=mu))


@pytest.mark.parametrize(
    ("model", "limit", "mu"),
    [(HANGING, 15 * W, 0.84), (GLUED, W / 0.84, 0.84), (GLUED, W, 5.0)],
    ids=["hang", "slide", "turn"],
)
def test_limits_by_hand(model: Assembly, limit: float, mu: float) -> None:
    assert of(model, 0.9999 * limit, mu).verdict == "unstable"
    assert of(model, 1.0001 * limit, mu).verdict == "stable"


def test_cohesion_is_friction_times_tension() -> None:
    for share, word in ((0.999, "unstable"), (1.001, "stable")):
        result = check(GLUED, Settings(method="rbe", cohesion=share * W, mu=0.84))
        assert result.verdict == word
        assert result.strength == pytest.approx(share * W / 0.84)


def test_a_dry_model_stays_dry() -> None:
    assert check(HANGING, Settings(method="rbe")).verdict == "unstable"
    dry = of(HANGING, 1e9).certificate
    assert dry is not None
    assert "tension" not in check(Assembly((LOW, GLUED.blocks[1])), Settings(method="rbe")).certificate["contacts"][0]


def test_true_forces_pull() -> None:
    """What is shown and certified is what the joint bears: its sum is the weight, its moment that of the weight."""
    result = of(HANGING, 20 * W)
    assert result.force.sum(0)[0] == pytest.approx(W)
    assert result.force[:, 0].min() < 0.0
    x = result.contacts.point[:, 0]
    assert float(result.force[:, 0] @ x) == pytest.approx(1.3 * W)
    assert "counts on joints that pull: 1 of them" in result.reason


# ---------------------------------------------------------------------------------------------------------------------
# Shares.


def ring(seed: int, corners: int, convex: bool) -> np.ndarray:
    """A star-shaped polygon in a random plane."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(corners) + rng.uniform(0.1, 0.9, corners)) / corners
    radius = 1.0 if convex else rng.uniform(0.2, 1.0, corners)
    flat = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(corners)])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.asarray(flat @ (turn * np.sign(np.linalg.det(turn))) + 10.0 * rng.normal(size=3))


@settings(max_examples=examples(40), deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 9), st.booleans())
def test_shares_keep_force_and_moment(seed: int, corners: int, convex: bool) -> None:
    """They add up to one at the centroid, here from the triangles that fan from the first corner."""
    polygon = ring(seed, corners, convex)
    share = Contacts.of([(0, 1)], [polygon]).shares
    arms = polygon[1:] - polygon[0]
    cross = np.cross(arms[:-1], arms[1:])
    area = cross @ cross.sum(0) / np.linalg.norm(cross.sum(0)) ** 2
    centroid = polygon[0] + area @ (arms[:-1] + arms[1:]) / 3.0
    assert share.sum() == pytest.approx(1.0, abs=1e-12)
    assert share @ polygon == pytest.approx(centroid, abs=1e-9)
    assert not convex or share.min() > 0.0


@settings(max_examples=examples(25), deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 7), st.booleans(), st.floats(1.0, 1e7))
def test_the_checker_finds_the_same_pulls(seed: int, corners: int, convex: bool, strength: float) -> None:
    """Exact fractions against floats; t |N| in the checker's units."""
    polygon = ring(seed, corners, convex)
    contacts = Contacts.of([(0, 1)], [polygon], None, [strength])
    k, per = 60, 40
    points = checker._vectors(polygon.tolist(), k)
    normal = checker._area_vector(points)
    joint, rows = checker._Joint(0, 1, polygon.tolist(), 0.5, strength), slice(0, corners)
    patch = checker._Patch(
        0, joint, 0, rows, 0, 1, 1, 2, (1, 2), points, normal, checker._dot(normal, normal), (0, 1), []
    )
    unit, shares = checker._pulls(patch, per, k)
    found = [float(unit * share) / 2.0 ** (per + 2 * k) for share in shares]
    assert found == pytest.approx(contacts.pull * 2.0 * contacts.area[0], rel=1e-9, abs=1e-9 * strength)


@settings(max_examples=examples(10), deadline=None)
@given(st.floats(0.0, 60.0), st.floats(0.0, 360.0), st.floats(1.0, 5.0))
def test_a_stronger_joint_never_takes_a_stable_verdict_away(tilt: float, azimuth: float, more: float) -> None:
    model = wall(2, 2)
    words = [check(model, Settings(method="rbe", tension=s, tilt=(tilt, azimuth))).verdict for s in (4e3, 4e3 * more)]
    assert words != ["stable", "unstable"]


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_units_do_not_matter(scale: float) -> None:
    """Weights go with the cube of lengths, pulls with the square, so the strength needed goes with the length."""
    big = Assembly(tuple(replace(b, vertices=scale * b.vertices) for b in HANGING.blocks))
    assert of(big, 15.01 * W * scale).verdict == "stable"
    assert of(big, 14.99 * W * scale).verdict == "unstable"


def test_more_points_on_a_joint_change_nothing() -> None:
    """The same joint in one piece, with a corner on an edge, and cut in two: the even pull is the same."""
    whole = detect(HANGING).contacts.polygon(0)
    edge = np.insert(whole, 1, (whole[0] + whole[1]) / 2, axis=0)
    low, high = (whole[1] + whole[2]) / 2, (whole[3] + whole[0]) / 2
    halves = [np.array([whole[0], whole[1], low, high]), np.array([high, low, whole[2], whole[3]])]
    for polygons in ([whole], [edge], halves):
        contacts = Contacts.of([(0, 1)] * len(polygons), polygons)
        for share, word in ((0.9999, "unstable"), (1.0001, "stable")):
            assert of(replace(HANGING, contacts=contacts), share * 15 * W).verdict == word


@pytest.mark.parametrize("part", [1.0, 0.6])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("higher", [0.0, 5e-7])  # within the tolerance of the file
def test_a_joint_that_is_listed_twice_does_not_pull_twice(part: float, turned: bool, higher: float) -> None:
    """Of both polygons together as much would be pulled as of one that stands; nor may one polygon go round twice."""
    whole = detect(HANGING).contacts.polygon(0)
    again = whole * [1.0, part, 1.0] + [0.0, 0.0, higher]
    listed = Contacts.of([(0, 1), (1, 0) if turned else (0, 1)], [whole, again[::-1] if turned else again])
    assert listed.frame[1, 0] @ listed.frame[0, 0] == pytest.approx(-1.0 if turned else 1.0)
    found = of(replace(HANGING, contacts=listed), 15.1 / (1.0 + part) * W)
    assert found.verdict == "undecided"
    assert "lie on each other" in found.reason
    round_twice = replace(HANGING, contacts=Contacts.of([(0, 1)], [np.concatenate([whole, whole])]))
    assert "goes round some of its area twice" in of(round_twice, 7.6 * W).reason


def test_a_joint_does_not_pull_where_no_faces_are() -> None:
    """A block of 1.1 m3 on two feet, each 0.1 m wide, is lifted by 2 W: the feet have to pull 0.9 W, 4.5 W a m2.

    One polygon over both and the gap between them would do it at 0.45.
    """
    outline = [(0, 1), (0.1, 1), (0.1, 1.5), (1.9, 1.5), (1.9, 1), (2, 1), (2, 2), (0, 2)]
    low = replace(prism("low", [(-1, 0), (3, 0), (3, 1), (-1, 1)], 1.0), fixed=True)
    vertices, faces = extruded(outline)
    blocks = (low, Block("feet", np.array(vertices, float), faces))
    lifted = Assembly(blocks, loads=(Load(1, np.array([0.0, 0.0, 2.0 * W]), np.array([1.0, 0.5, 2.0])),))
    for strength, word in ((4.49, "unstable"), (4.51, "stable")):
        assert of(lifted, strength * W).verdict == word
    over = Contacts.of([(0, 1)], [np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0], [0.0, 1.0, 1.0]])])
    found = of(replace(lifted, contacts=over), 1.0 * W)
    assert found.verdict == "undecided"
    assert "less than half of it is on faces" in found.reason
    assert check(replace(lifted, loads=(), contacts=over), Settings(method="rbe")).verdict == "stable"  # dry it stands


@settings(max_examples=examples(40), deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 7), st.integers(3, 7))
def test_the_area_in_common_is_that_of_an_overlay(seed: int, one: int, two: int) -> None:
    """Polygons on whole numbers, some with corners and sides in common; none crosses itself."""
    rng = np.random.default_rng(seed)
    rings = []
    for count in (one, two):
        at = rng.integers(0, 9, (count, 2))
        middle = at.mean(axis=0)
        rings.append([(int(x), int(y)) for x, y in at[np.argsort(np.arctan2(*(at - middle).T))]])
    a, b = map(Polygon, rings)
    assume(a.is_valid and b.is_valid)
    assert float(checker._in_common(*rings)) == pytest.approx(2.0 * a.intersection(b).area, abs=1e-9)
    assert checker._in_common(rings[0], rings[0]) == checker._twice_area(rings[0])


# ---------------------------------------------------------------------------------------------------------------------
# The checker: what it must refuse, and what it must say.


def changed(certificate: dict, change, sealed: bool = True) -> Any:
    data = copy.deepcopy(certificate)
    change(data)
    if sealed:
        data["seal"] = seal(data)
    return verify(data)


def test_a_state_that_pulls_stands_or_falls_with_its_tension() -> None:
    found = of(HANGING, 15.1 * W).certificate
    assert found is not None
    assert "COUNTING ON JOINTS THAT PULL: 1 of 1, up to 355393 Pa" in verify(found).claim

    def strength(value: Any):
        return lambda d: d["contacts"][0].update(tension=value)

    assert "seal" in changed(found, strength(16 * W), sealed=False).reason
    assert "up to 376575 Pa" in changed(found, strength(16 * W)).claim  # another claim, and it says so
    weaker = changed(found, strength(14.9 * W))
    assert not weaker.proved
    assert "pulls more than the joint can" in weaker.reason
    dry = changed(found, lambda d: d["contacts"][0].pop("tension"))
    assert not dry.proved
    assert "PULL" not in dry.claim
    for wrong in (0, -1.0, "1", None, True, [1.0]):
        assert not changed(found, strength(wrong)).proved
    slid = changed(found, lambda d: d["forces"].__setitem__(0, [1e4, *d["forces"][0][1:]]))
    assert "friction cone" in slid.reason


def test_a_mechanism_has_to_work_against_the_pull() -> None:
    found = of(HANGING, 14.9 * W).certificate
    assert found is not None
    assert verify(found).proved
    stronger = changed(found, lambda d: d["contacts"][0].update(tension=15.1 * W))
    assert not stronger.proved
    assert "no work beyond what joints that pull take up" in stronger.reason


def test_coupled_certificates_have_no_joints_that_pull() -> None:
    found = check(Assembly((LOW, prism("on", [(0, 1), (1, 1), (1, 2), (0, 2)], 1.0)))).certificate
    assert found is not None
    assert found["kind"] == "cra-state"
    assert "no part" in changed(found, lambda d: d["contacts"][0].update(tension=1.0)).reason


def test_a_proof_for_all_tilts_does_not_leave_out_the_heaviest() -> None:
    """Joints with a strength of their own bear so much and no more: less gravity, tilted, says nothing of all of it."""
    model = prepare(HANGING, Settings(method="rbe", tension=16 * W))
    sizes = [float(np.linalg.norm(one.gravity)) for one in corners(model, (Range("tilt", 0.0, 1.0),)) or []]
    assert max(sizes) > G
    dry = prepare(HANGING, Settings(method="rbe"))
    assert len(corners(dry, (Range("tilt", 0.0, 1.0),)) or []) < len(sizes)


# ---------------------------------------------------------------------------------------------------------------------
# Refusals, files, the command.


def test_coupled_analysis_refuses_joints_that_pull() -> None:
    contacts = detect(HANGING).contacts.with_mu(0.84).with_tension(20 * W)
    system = equilibrium_system(HANGING, contacts, supports(HANGING)[0], np.array([0, 0, -G]), 2400.0)
    with pytest.raises(InputError, match="coupled analysis has none"):
        solve_cra(system)
    with pytest.raises(InputError, match="only rigid-block equilibrium"):
        check(replace(HANGING, contacts=contacts), Settings(method="cra"))
    with pytest.raises(InputError, match="only rigid-block equilibrium"):
        Settings(method="cra", tension=1.0)
    told = check(replace(HANGING, contacts=contacts), Settings())
    assert (told.method, told.verdict) == ("rbe", "stable")
    assert any("so the method is rbe" in line for line in told.warnings)


def test_what_is_refused() -> None:
    for said in (
        {"tension": -1.0},
        {"tension": np.inf},
        {"tension": 1.0, "cohesion": 1.0},
        {"tension": 1.0, "penalty": True},
    ):
        with pytest.raises(InputError):
            Settings(method="rbe", **said)
    mixed = replace(wall(2, 2), contacts=None)
    contacts = detect(mixed).contacts
    mu = np.full(len(contacts), np.nan)
    mu[0] = 0.1
    with pytest.raises(InputError, match="needs one friction"):
        check(replace(mixed, contacts=replace(contacts, mu=mu)), Settings(method="rbe", cohesion=1e3))
    with pytest.raises(InputError, match="must not be negative"):
        replace(contacts, tension=np.full(len(contacts), -1.0))


def test_a_model_file_says_it(tmp_path) -> None:
    contacts = detect(HANGING).contacts.with_tension(20 * W)
    write_model(tmp_path / "m.json", replace(HANGING, contacts=contacts))
    model, warnings = read_model(tmp_path / "m.json")
    assert warnings == ()
    assert model.contacts is not None
    assert model.contacts.strength.tolist() == [20 * W]
    data = json.loads((tmp_path / "m.json").read_text())
    data["contacts"][0]["tension"] = -1.0
    (tmp_path / "m.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match="tension -1 must not be negative"):
        read_model(tmp_path / "m.json")


def test_the_command_says_it_aloud(run, tmp_path) -> None:
    write_model(tmp_path / "m.json", HANGING)
    assert run("check", "m.json", "--method", "rbe")[0] == 1
    status, out, err = run(
        "check", "m.json", "--tension", f"{20 * W}", "--json", "r.json", "--report", "r.html", "--certificate", "c.json"
    )
    assert status == 0
    assert "WARNING  this counts on joints that pull with up to 470719 Pa" in out
    assert "so the method is rbe" in err
    assert json.loads((tmp_path / "r.json").read_text())["joints_that_pull"] == {
        "strength": pytest.approx(20 * W),
        "contacts": 1,
    }
    assert '<p class="pulling">This verdict counts on joints that pull' in (tmp_path / "r.html").read_text()
    assert "COUNTING ON JOINTS THAT PULL" in run("verify", "c.json")[1]
    for argv in (("--tension", "1", "--method", "cra"), ("--tension", "1", "--cohesion", "1"), ("--tension", "0")):
        status, _, err = run("check", "m.json", *argv)
        assert (status, len(err.splitlines())) == (2, 1)
