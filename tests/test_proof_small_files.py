"""Small files cost little, whatever is in them: each of these took minutes, gigabytes or an exception once.

No test here looks at a clock: what is counted are the steps that made it slow.
"""

import itertools
import json
import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.proof import NotACertificateError, checker, read_file, seal, verify, verify_file
from cyclopean.proof.checker import EXACT
from test_proof_checker import (
    CUBE,
    GROUND,
    PROVED,
    RHO,
    G,
    box,
    contact,
    cube_on_ground,
    falling,
    level,
    overhang,
    pushed_cube,
    sealed,
    sliding,
    state,
)
from test_proof_cra_state import BOUNDS, COUPLED
from test_proof_cra_tree import falls_over, frame_model, tree, virtual_work

HASH = 2**61 - 1  # whole numbers that differ by this have the same hash

# --- a row of cubes: bounds of displacements by the cheapest chain of contacts ---------------------------------------


def row(n, order=1):
    """Cubes in a row, the first of them fixed; contacts listed from one end or from the other."""
    blocks = [box(f"b{i}", [i, 0, 0], [i + 1, 1, 1], fixed=i == 0) for i in range(n)]
    sides = [[[x, 0, 0], [x, 1, 0], [x, 1, 1], [x, 0, 1]] for x in range(1, n)]
    joints = [contact(f"b{i}", f"b{i + 1}", side) for i, side in enumerate(sides)]
    still = {f"b{i}": [0.0] * 6 for i in range(1, n)}
    return tree(state(blocks, joints[::order], [[0, 0, 0]] * 4 * (n - 1)), {"mechanism": still})


def reach(certificate):
    sheet = checker._read(certificate)
    return checker._reach(checker._weigh(sheet))


@pytest.mark.parametrize("order", [1, -1])
def test_bounds_of_a_row_by_hand(order):
    """D = sqrt(2) eta. A unit square: |e1| = sqrt 2, e2 the corner next to it, |e1 x e2| = 1, so a joint turns by at
    most 2D / sqrt 2 + 2D (sqrt 2 + 1), and r0 is sqrt(3) / 2 from both centres of mass.
    """
    far = math.sqrt(2) * BOUNDS["eta"]
    turn, lever = 2 * far / math.sqrt(2) + 2 * far * (math.sqrt(2) + 1), math.sqrt(3) / 2
    found = reach(row(5, order))
    shift = 0.0
    for i in range(1, 5):
        shift += (i - 1) * turn * lever + far + i * turn * lever
        assert found.turns[i] / 2**found.per_turn == pytest.approx(i * turn, rel=1e-12)
        assert found.shifts[i] / 2**found.per_shift == pytest.approx(shift, rel=1e-12)


@given(st.integers(3, 6), st.randoms(use_true_random=False))
def test_no_chain_of_contacts_gives_smaller_bounds(n, random):
    """All chains gone through one by one."""
    hinge = {}
    for i, j in itertools.combinations(range(n), 2):
        if j == i + 1 or random.random() < 0.4:
            cost = Fraction(random.randint(1, 9), 4)
            hinge[i, j] = checker._Hinge(i, j, cost, Fraction(0), Fraction(0))
            hinge[j, i] = checker._Hinge(j, i, cost, Fraction(0), Fraction(0))
    across = [[one for (i, _), one in hinge.items() if i == k] for k in range(n)]
    found = checker._least(across, [0], lambda one: one.turn)
    for end in range(1, n):
        middles = (some for size in range(n - 1) for some in itertools.permutations(set(range(1, n)) - {end}, size))
        chains = [list(itertools.pairwise((0, *middle, end))) for middle in middles]
        sums = [sum(hinge[pair].turn for pair in chain) for chain in chains if hinge.keys() >= set(chain)]
        assert found[end] == min(sums)


def test_each_contact_is_crossed_a_few_times_only(monkeypatch):
    """In the order that needs a sweep for each block: sums taken, once per contact, direction and kind of bound."""
    certificate, sums = row(60, -1), []
    rounded = checker._rounded_up
    monkeypatch.setattr(checker, "_rounded_up", lambda x: sums.append(x) or rounded(x))
    reach(certificate)
    assert len(sums) <= 8 * 59


# --- trees -----------------------------------------------------------------------------------------------------------


def many_leaves(leaf, count, point=0):
    if count == 1:
        return leaf
    half = count // 2
    return {
        "point": point,
        "engaged": many_leaves(leaf, half, point + 1),
        "unloaded": many_leaves(leaf, count - half, point + 1),
    }


def edge(points, leaves):
    """A cube that overturns about an edge with many points on it, refuted over and over."""
    least = overhang()
    joint = least["contacts"][0]
    (x, y, z), (_, Y, _) = joint["polygon"][1], joint["polygon"][2]
    between = [[x, y + (Y - y) * i / points, z] for i in range(1, points)]
    joint["polygon"] = [*joint["polygon"][:2], *between, *joint["polygon"][2:]]
    return tree(least, many_leaves({"mechanism": least["mechanism"]}, leaves))


def test_leaves_look_at_no_more_points_than_the_size_allows(monkeypatch):
    assert verify(edge(30, 8)).proved
    monkeypatch.setattr(checker, "VISITS", 8 * 36)
    assert verify(edge(30, 8)).proved  # 33 points and 2 blocks
    monkeypatch.setattr(checker, "VISITS", 8 * 35 - 1)
    report = verify(edge(30, 8))
    assert "too many leaves for 33 contact points, 2 blocks" in report.reason
    monkeypatch.setattr(checker, "SMALL", 0)  # a larger file may ask for more
    assert verify(edge(30, 8)).proved


def test_long_numbers_count_more_than_once(monkeypatch):
    fine = edge(30, 8)
    fine["contacts"][0]["polygon"][0][2] = 1e-150
    monkeypatch.setattr(checker, "VISITS", 8 * 36)
    assert "too many leaves" in verify(sealed(fine)).reason


def test_branches_share_what_they_know_of_other_points(monkeypatch):
    """As many sectors as there are, there is one list of zones: no copy for each branch that waits."""
    copied = []
    whole = checker._Zone

    def counted(*values):
        copied.append(values)
        return whole(*values)

    count = 40
    rays = [[math.cos(2 * math.pi * i / count), math.sin(2 * math.pi * i / count), 0.0] for i in range(count)]
    root = {"point": 0, "rays": rays, "sectors": [overhang_leaf()] * count}
    monkeypatch.setattr(checker, "_Zone", counted)
    assert verify(tree(overhang(), root)).proved
    assert len(copied) <= 1 + 2 * count


def overhang_leaf():
    return {"mechanism": overhang()["mechanism"]}


@given(st.integers(0, 2**32 - 1))
def test_zones_of_a_node_are_those_on_the_way_to_it(seed):
    """Trees of random shape: what a leaf is told of each point is what the splits above it said, and nothing else."""
    import random

    dice = random.Random(seed)
    expected = []

    def grow(path):
        free = [p for p in range(8) if p not in path]
        if len(path) > 3 or dice.random() < 0.3:
            expected.append(dict(path))
            return virtual_work(0.05)["tree"]
        point = dice.choice(free)
        return {
            "point": point,
            "engaged": grow({**path, point: "engaged"}),
            "unloaded": grow({**path, point: "unloaded"}),
        }

    root, seen = grow({}), []
    margin = checker._margin

    def watched(case, zones, leaf):
        said = {i: "engaged" if z.engaged else "unloaded" for i, z in enumerate(zones) if z.engaged or z.unloaded}
        seen.append(said)
        return margin(case, zones, leaf)

    checker._margin = watched
    try:
        verify(tree(frame_model(0.05), root))
    finally:
        checker._margin = margin
    assert seen == expected[: len(seen)]
    assert seen


# --- numbers ---------------------------------------------------------------------------------------------------------


def at_multiplier(t):
    """A cube that stands at every multiplier of a sideways load of 1 N that is in reach."""
    base = cube_on_ground()
    live = {
        "gravity": [0.0, 0.0, 0.0],
        "loads": [{"block": "cube", "force": [0.0, 0.0, -1e-150], "point": [0, 0, 0.5]}],
    }
    rest = {k: v for k, v in base.items() if k != "kind"}
    return sealed({**rest, "kind": "limit-bounds", "live": live, "lower": t})


@pytest.mark.parametrize("t", [0.0, 1e-150, -1e-150, 1.7e-150, 5e-100, 1e-40, 1.0])
def test_tiny_multipliers_are_counted_exactly(t):
    report = verify(at_multiplier(t))
    assert report.proved, report.reason
    assert report.figures["lower"] == t


@given(st.floats(-1e100, 1e100).filter(lambda x: x == 0 or abs(x) >= 1e-150), st.integers(551, 1300))
def test_every_number_that_is_read_becomes_an_integer_exactly(x, k):
    exact = Fraction(x) * 2**k
    assert checker._integer(x, k) == exact
    assert checker._vectors([[x, -x, 0.0]], k) == [(exact, -exact, 0)]


NUMBERS = st.sampled_from([1e-150, -1e-150, 3.3e-149, 1e100, -1e100, 1e99, 1.0, 0.0, 5e-324, 1e300, 0.1])
PLACES = {
    "vertex": lambda c, x: c["blocks"][-1]["vertices"][0].__setitem__(0, x),
    "density": lambda c, x: c["blocks"][-1].update(density=x),
    "corner": lambda c, x: c["contacts"] and c["contacts"][0]["polygon"][0].__setitem__(2, x),
    "mu": lambda c, x: c["contacts"] and c["contacts"][0].update(mu=x),
    "tension": lambda c, x: c["contacts"] and c["contacts"][0].update(tension=x),
    "gravity": lambda c, x: c["gravity"].__setitem__(1, x),
    "tolerance": lambda c, x: c.update(tolerance=x),
    "force": lambda c, x: "forces" in c and c["forces"][0].__setitem__(0, x),
    "motion": lambda c, x: "mechanism" in c and next(iter(c["mechanism"].values())).__setitem__(3, x),
    "eps": lambda c, x: "eps" in c and c.update(eps=x),
    "eta": lambda c, x: "eta" in c and c.update(eta=x),
    "beta_min": lambda c, x: "beta_min" in c and c.update(beta_min=x),
    "lower": lambda c, x: "lower" in c and c.update(lower=x),
    "live": lambda c, x: "live" in c and c["live"]["gravity"].__setitem__(2, x),
    "load": lambda c, x: c["loads"] and c["loads"][0]["force"].__setitem__(2, x),
}
EVERY = [*PROVED, *COUPLED, falls_over, virtual_work, lambda: at_multiplier(1.0)]


@given(st.sampled_from(EVERY), st.lists(st.tuples(st.sampled_from(sorted(PLACES)), NUMBERS), min_size=1, max_size=4))
def test_extreme_numbers_are_answered(build, changes):
    certificate = json.loads(json.dumps(build()))
    for place, x in changes:
        PLACES[place](certificate, x)
    report = verify(sealed(certificate))
    assert "\n" not in report.reason + report.claim
    assert all(math.isfinite(x) for x in report.figures.values())
    assert all("\n" not in line for line in report.assumed)


# --- names and numbers of vertices -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "faces", [[[HASH * (3 * i + k) for k in range(3)] for i in range(99)], [[HASH * i for i in range(99)]]]
)
def test_vertex_numbers_are_bounded_before_they_are_hashed(faces, monkeypatch):
    monkeypatch.setattr(checker, "frozenset", None, raising=False)  # would be called for what is hashed
    certificate = cube_on_ground()
    certificate["blocks"][0]["faces"] = faces
    assert "a face is not three or more different vertex numbers" in verify(sealed(certificate)).reason


@pytest.mark.parametrize("faces", [[], [[]], [[0, 1]], [[0, 1, 8]], [[0, 1, -1]], [[0, 1, 1]]])
def test_faces_that_are_none(faces):
    certificate = cube_on_ground()
    certificate["blocks"][1]["faces"] = faces
    assert not verify(sealed(certificate)).proved


def test_many_missing_names_are_one_short_line():
    blocks = [{**CUBE, "id": f"cube\n{i}"} for i in range(500)]
    certificate = sealed({**falling(), "blocks": blocks, "mechanism": {}})
    reason = verify(certificate).reason
    assert reason.startswith("mechanism: fields missing: cube\\n0, ")
    assert reason.endswith(" and 488 more")
    assert len(reason) < 300


# --- whole files -----------------------------------------------------------------------------------------------------

TEXT = json.dumps(cube_on_ground())
FILES = {
    "cut off": (TEXT[:-30], 2),
    "a key twice": (TEXT.replace('"kind"', '"seal": 1, "kind"'), 2),
    "whole number of 100,000 digits": (TEXT.replace("-9.8125", "9" * 100_000), 2),
    "number of 100,000 digits": (TEXT.replace("-9.8125", "-9.8125" + "1" * 100_000), 1),
    "exponent of 100,000 digits": (TEXT.replace("-9.8125", "1e" + "9" * 100_000), 1),
    "nested": (TEXT.replace("-9.8125", "[" * 100_000 + "]" * 100_000), 2),
    "nested a little": (TEXT.replace("-9.8125", "[" * 500 + "]" * 500), 1),
    "a billion blocks": (json.dumps(cube_on_ground() | {"blocks": 10**9}), 1),
    "a billion blocks, as an object": (json.dumps(cube_on_ground() | {"blocks": {"count": 10**9}}), 1),
    "the vertex of number a billion": (TEXT.replace('"faces": [[0,', '"faces": [[1000000000,'), 1),
    "a contact that is not there": (json.dumps(cube_on_ground() | {"forces": [[0, 0, 1.0]] * 8}), 1),
    "version 9": (TEXT.replace("certificate/2", "certificate/9"), 1),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_answered_in_one_line(name, tmp_path, capsys):
    content, status = FILES[name]
    path = tmp_path / "c.json"
    path.write_text(content)
    assert checker.main([str(path)]) == status
    out, err = capsys.readouterr()
    assert bool(out) is (status == 1)
    assert err.count("\n") == (status == 2)
    assert len(out.splitlines()[1] if out else err) < 400
    if status == 2:
        with pytest.raises(NotACertificateError):
            read_file(path)


def test_a_file_without_end_is_not_read_for_ever(tmp_path, monkeypatch):
    path = tmp_path / "c.json"
    path.write_text(TEXT + " " * 5000)
    assert verify_file(path).proved
    monkeypatch.setattr(checker, "LARGEST", 4000)
    with pytest.raises(NotACertificateError, match="holds more than"):
        verify_file(path)


def test_version_1_is_told_from_anything_else():
    assert verify(cube_on_ground() | {"schema": "cyclopean.certificate/1"}).reason == (
        "certificate of version 1: its tolerances were those of the whole model; check the model again to get one of"
        " version 2"
    )
    for schema in ("cyclopean.certificate/3", "cyclopean.certificate", None):
        assert verify(cube_on_ground() | {"schema": schema}).reason == "schema is not cyclopean.certificate/2"
    assert cube_on_ground()["schema"] == "cyclopean.certificate/2"


# --- what the claim and the report say -------------------------------------------------------------------------------


def changed(build, **fields):
    return sealed({**build(), **fields})


def test_zero_gravity_is_in_the_claim():
    at_rest = state(
        [GROUND, CUBE], [contact("ground", "cube", level(-0.5, -0.5, 0.5, 0.5))], [[0, 0, 0]] * 4, gravity=(0, 0, 0)
    )
    assert "with zero gravity" in verify(at_rest).claim
    assert "zero gravity" not in verify(cube_on_ground()).claim
    live = {**at_multiplier(1.0), "gravity": [0.0, 0.0, 0.0], "live": {"gravity": [0.0, 0.0, -1.0], "loads": []}}
    assert "zero gravity" not in verify(sealed(live)).claim


def test_a_model_without_a_free_block_says_so():
    nothing = state([GROUND], [], [])
    assert verify(nothing).proved
    assert verify(nothing).claim == "stable under rigid-block equilibrium, no block is free" + EXACT


@pytest.mark.parametrize(("mu", "said"), [(2.0, ""), (2.5, ", mu up to 2.5"), (1e99, ", mu up to 1e+99")])
def test_friction_that_no_stone_has_is_in_the_claim(mu, said):
    certificate = cube_on_ground()
    certificate["contacts"][0]["mu"] = mu
    assert verify(sealed(certificate)).claim == f"stable under rigid-block equilibrium{said}{EXACT}"


@pytest.mark.parametrize("build", [*COUPLED, falls_over, virtual_work])
def test_every_coupled_claim_is_about_the_listed_contacts(build):
    assert ", listed contacts)" in verify(build()).claim


def test_what_a_proof_assumes():
    assert verify(pushed_cube()).assumed == (
        "blocks     2, 1 of them free",
        "supports   ground",
        "contacts   1 listed, 4 points; nothing else touches",
        "friction   mu 0.5",
        f"density    {RHO:g} kg/m3",
        f"gravity    (0, 0, {-G}) m/s2, in size {G}",
        "loads      2, together (5887.5, 0, -23550) N",
        "tolerance  contacts lie within 1e-06 m of faces",
    )


def test_what_else_a_proof_may_assume():
    said = dict(line.split(None, 1) for line in verify(at_multiplier(1.0)).assumed)
    assert said["live"] == "times the multiplier: gravity (0, 0, 0) m/s2; loads 1, together (0, 0, -1e-150) N"
    rest = sliding()
    rest["blocks"] += [box(f"far {i}", [9, 9, i], [10, 10, i + 1], fixed=True) for i in range(4)]
    rest["blocks"][1]["held"] = ["y", "rx"]
    rest["contacts"][0]["tension"] = 7.0
    said = dict(line.split(None, 1) for line in verify(sealed(rest)).assumed)
    assert said["supports"] == "ground, far 0, far 1 and 2 more"
    assert said["held"] == "partly: cube"
    assert said["tension"] == "1 of 1 joints pull, 7 Pa"
    assert said["loads"] == "none beside the weight"


def test_assumptions_are_told_of_what_is_not_proved_too(capsys, tmp_path):
    wrong = cube_on_ground()
    wrong["forces"][0][2] *= 2
    path = tmp_path / "wrong.json"
    path.write_text(json.dumps(wrong | {"seal": seal(wrong)}))
    assert checker.main([str(path)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("NOT PROVED: ")
    assert lines[2:] == [f"  {line}" for line in verify_file(path).assumed]
    assert verify({}).assumed == ()
