"""The refuting tree: leaves, splits, symmetries, documents that the independent checker accepts, and restarts.

By hand, the frame of two fixed columns and a beam of length L, height h, depth d >= h, weight W between them: the beam
can press both columns only by turning, say with its upper left and its lower right edge. There N and -N turn it by N h;
frictions F, G (upwards, left and right) must balance that and W: (G - F) L / 2 = N h, F + G = W. Both are at most mu N,
and F >= 0 because the left end goes down: G = W / 2 + N h / L <= mu N and N <= W L / (2 h) ask for mu >= 2 h / L.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis.certificates import certify
from cyclopean.analysis.coupled.alternation import alternation
from cyclopean.analysis.coupled.branches import Split, symmetries, tree_document
from cyclopean.analysis.coupled.halves import Halves
from cyclopean.analysis.coupled.leaves import (
    Leaf,
    closes,
    least_work,
    most_work,
    prior,
    root_cell,
    support,
)
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.analysis.coupled.tree import refute
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.assembly import Assembly, Block, detect
from cyclopean.proof import seal, verify
from cyclopean.statics import equilibrium_system
from laws import examples

GRAVITY = np.array([0.0, 0.0, -9.80665])
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
UNIT = Bounds()


def cuboid(name, low, high, fixed=False):
    (x, y, z), (X, Y, Z) = low, high
    corners = [(x, y, z), (X, y, z), (X, Y, z), (x, Y, z), (x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)]
    return Block(name, np.array(corners, float), FACES, density=2400.0, fixed=fixed)


def frame(length=0.6, height=0.3, depth=0.4):
    right = 0.4 + length
    return Assembly(
        (
            cuboid("left", (0, 0, 0), (0.4, depth, 1.2), True),
            cuboid("right", (right, 0, 0), (right + 0.4, depth, 1.2), True),
            cuboid("beam", (0.4, 0, 0.6), (right, depth, 0.6 + height)),
        )
    )


def standing_frame():
    return Assembly(
        (
            cuboid("ground", (-1, -1, -1), (4, 2, 0), True),
            cuboid("left", (0, 0, 0), (0.8, 0.4, 1.2)),
            cuboid("right", (1.4, 0, 0), (2.2, 0.4, 1.2)),
            cuboid("beam", (0.8, 0, 0.45), (1.4, 0.4, 0.75)),
        )
    )


def prepared(assembly, mu):
    contacts = detect(assembly).contacts.with_mu(mu)
    fixed = np.array([block.fixed for block in assembly.blocks])
    return contacts, fixed, equilibrium_system(assembly, contacts, fixed, GRAVITY, 2400.0)


def as_analysed(assembly, contacts, fixed):
    return PreparedModel(assembly, contacts, fixed, GRAVITY, 2400.0, 1e-6, {}, (), ())


def certificate(assembly, mu, root, eps=1.0, bounds=UNIT):
    contacts, fixed, system = prepared(assembly, mu)
    names = [block.id for block in assembly.blocks]
    world = Bounds(eps, eps * bounds.eta, eps * bounds.beta)
    proof = {"bounds": world, "tree": tree_document(root, system, names, eps)}
    return certify(as_analysed(assembly, contacts, fixed), system, "cra-tree", proof)


@pytest.fixture(scope="module")
def refuted():
    system = prepared(frame(), 0.84)[2]
    return system, refute(system, UNIT)


# -- by hand ----------------------------------------------------------------------------------------------------------


def test_frame_is_refuted_and_the_checker_agrees(refuted):
    _, answer = refuted
    assert answer.word == "refuted"
    assert answer.bound == 1.0
    for eps in (1.0, 0.003):
        report = verify(certificate(frame(), 0.84, answer.root, eps))
        assert report.proved, report.reason
        assert report.figures["least_margin"] > 1e-6


@pytest.mark.parametrize(("mu", "word"), [(0.59, "refuted"), (0.61, "coupled")])
def test_frame_stands_from_twice_height_over_length_on(mu, word):
    answer = refute(prepared(frame(length=1.0), mu)[2], UNIT)
    assert answer.word == word
    if word == "coupled":
        assert answer.best.found
    else:
        assert verify(certificate(frame(length=1.0), mu, answer.root)).proved


def test_a_cube_on_the_ground_does_exactly_its_weight():
    system = prepared(
        Assembly((cuboid("ground", (-1, -1, -1), (2, 2, 0), True), cuboid("cube", (0, 0, 0), (1, 1, 1)))), 0.5
    )[2]
    cell, halves = root_cell(system, UNIT), Halves(system, UNIT)
    word, f, y = halves.forces(cell)
    assert word == "solved"
    assert f[:, 0].sum() == pytest.approx(1.0, abs=1e-7)  # in mean block weights; sinks by eps = 1
    assert least_work(system, UNIT, cell, system.gap(y)) == pytest.approx(1.0, abs=1e-6)
    word, _, w = halves.motions(cell)
    assert most_work(UNIT, cell, w) == pytest.approx(1.0, abs=1e-6)
    assert np.allclose(system.A @ w.ravel(), system.p, atol=1e-13)


def test_support_of_a_quadrant():
    system = prepared(frame(), 0.84)[2]
    cell = root_cell(system, UNIT).within(0, np.array([1.0, 0.0]), np.array([0.0, 1.0]))
    g = np.zeros((8, 2))
    for inward, by_hand in (((3.0, 4.0), 5.0), ((3.0, -4.0), 3.0), ((-3.0, -4.0), -3.0), ((-5.0, 2.0), 2.0)):
        g[0] = g[1] = inward
        assert support(cell, g)[0] == pytest.approx(by_hand)
        assert support(cell, g)[1] == pytest.approx(np.hypot(*inward))  # no sector there


def test_multiples_of_a_motion_are_limited_by_pressure_and_by_rubbing():
    system = prepared(frame(), 0.84)[2]
    cell, gap = root_cell(system, UNIT).at(1, lo=0.5).unloaded(3), np.zeros((8, 3))
    gap[0], gap[1], gap[2], gap[3] = (0.0, 0.0, 2.0), (0.0, 2.0, 0.0), (-4.0, 0.0, 0.0), (-9.0, 9.0, 0.0)
    by_hand = [(1.0 + 0.84 * 0.01) / (0.84 * 2.0), (1.0 + 0.84 * 0.5) / (0.84 * 2.0), 0.25, *[np.inf] * 5]
    alone = gap * np.eye(8)[:, :, None]
    assert least_work(system, UNIT, cell, alone) == pytest.approx(by_hand)
    assert least_work(system, UNIT, cell, gap) == pytest.approx(0.25)


# -- laws -------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def state():
    system = prepared(frame(length=1.0), 0.84)[2]
    answer = refute(system, UNIT)
    assert answer.word == "coupled"
    return system, answer.best.f, answer.best.dq


def cell_around(system, f, dq, random):
    """A random cell that holds the state (f, dq)."""
    cell, d = root_cell(system, UNIT), system.gap(dq)
    for k in range(system.points):
        if random.random() < 0.5:
            if f[k, 0] > 0.0:
                cell = cell.engaged(k)
            elif not f[k].any():
                cell = cell.unloaded(k)
        slide, heading = np.hypot(*d[k, 1:]), np.arctan2(d[k, 2], d[k, 1])
        if slide > 0.1 and random.random() < 0.5:
            a, b = heading - random.uniform(0.01, 1.5), heading + random.uniform(0.01, 1.5)
            cell = cell.within(k, np.array([np.cos(a), np.sin(a)]), np.array([np.cos(b), np.sin(b)]))
        if random.random() < 0.5:
            cell = cell.at(k, lo=slide * random.uniform(0.0, 0.999), hi=slide + random.uniform(0.001, 1.0))
    return cell


@settings(max_examples=examples(60), deadline=None)
@given(seed=st.integers(0, 10**6))
def test_no_leaf_closes_a_cell_that_holds_a_state(state, seed):
    system, f, dq = state
    random, work = np.random.default_rng(seed), float(system.p @ dq)
    cell, halves, known = cell_around(system, f, dq, random), Halves(system, UNIT), prior(system, UNIT)
    _, _, y = halves.forces(cell)
    _, _, w = halves.motions(cell)
    for noise in (0.0, 0.1, 1.0):
        y_any = y + noise * random.normal(size=y.shape)
        y_any = y_any / (system.p @ y_any)
        null = random.normal(size=w.shape)
        w_any = w + noise * (null - (halves.lift @ (system.A @ null.ravel())).reshape(-1, 3))
        t, u = least_work(system, UNIT, cell, system.gap(y_any)), most_work(UNIT, cell, w_any)
        assert t <= work + 1e-6
        assert u >= work - 1e-6
        for leaf in (Leaf(t * y_any, w_any), Leaf(y_any, None), Leaf(None, w_any), Leaf(t * y_any, 0.9 * w_any)):
            assert not closes(system, UNIT, cell, known, leaf)


def test_symmetries_keep_equilibrium():
    system = prepared(frame(), 0.84)[2]
    found = list(symmetries(system))
    assert len(found) == 3  # two reflections and their product
    f, y = np.random.default_rng(1).normal(size=(8, 3)), np.random.default_rng(2).normal(size=6)
    for symmetry in found:
        assert np.allclose(system.gap(symmetry.motion(y)), symmetry.vectors(system.gap(y)), atol=1e-9)
        assert np.allclose(system.A @ symmetry.vectors(f).ravel(), symmetry.motion(system.A @ f.ravel()), atol=1e-9)
    assert len(list(symmetries(prepared(standing_frame(), 0.84)[2]))) == 3
    pushed = replace(system, p=system.p + np.array([0.0, 0.0, 0.0, 0.1, 0.2, 0.3]))
    assert not list(symmetries(pushed))


def test_image_of_a_split_keeps_its_sectors():
    system = prepared(frame(), 0.84)[2]
    rays = np.array([[1.0, 0.2], [-1.0, 1.0], [-0.3, -1.0]])
    leaves = tuple(Leaf(np.full(6, float(i)), None) for i in range(3))
    for symmetry in symmetries(system):
        image = symmetry.image(Split(2, (Split(1, leaves, rays), leaves[0]), speed=1.0))
        slower = image.parts[0]
        assert (image.point, slower.point) == (symmetry.point[2], symmetry.point[1])
        ring = [*slower.rays, slower.rays[0]]
        assert all(a[0] * b[1] - a[1] * b[0] > 0.0 for a, b in pairwise(ring))
        for i in range(3):  # the image of a direction of sector i lies in the image of sector i
            inner = symmetry.tangent[1] @ (rays[i] + rays[(i + 1) % 3])
            at = [leaf.y is not None and np.allclose(leaf.y, symmetry.motion(leaves[i].y)) for leaf in slower.parts]
            a, b = ring[at.index(True)], ring[at.index(True) + 1]
            assert a[0] * inner[1] - a[1] * inner[0] > 0.0 > b[0] * inner[1] - b[1] * inner[0]


# -- refusals ---------------------------------------------------------------------------------------------------------


def test_a_budget_ends_the_search():
    answer = refute(prepared(frame(), 0.84)[2], UNIT, 5)
    assert (answer.word, answer.root) == ("undecided", None)
    assert answer.nodes <= 2 * 5
    assert 0.0 <= answer.bound < 1.0


def test_a_block_tied_to_no_support_is_left_undecided():
    ground, a, b = (-1, -1, -1), (0, 0, 1), (0, 0, 2)
    blocks = cuboid("ground", ground, (2, 2, 0), True), cuboid("a", a, (1, 1, 2)), cuboid("b", b, (1, 1, 3))
    loose = Assembly(blocks)
    system = prepared(loose, 0.84)[2]
    assert refute(system, UNIT, 100).word == "undecided"
    assert not alternation(system, UNIT, budget=20).found


@pytest.mark.parametrize("damage", ["swap", "leaf", "force", "eta", "friction"])
def test_a_damaged_tree_is_rejected(refuted, damage):
    document = certificate(frame(), 0.84, refuted[1].root)
    if damage == "swap":
        tree = document["tree"]
        tree["engaged"], tree["unloaded"] = tree["unloaded"], tree["engaged"]
    elif damage == "eta":
        document["eta"] *= 5.0
    elif damage == "friction":
        for contact in document["contacts"]:
            contact["mu"] = 1.1  # beyond 2 h / L = 1: a state exists
    else:
        node = document["tree"]
        while "point" in node:
            node = (node.get("sectors") or [node.get("unloaded", node.get("faster"))])[-1]
        for part in node.values():
            rows = part.values() if isinstance(part, dict) else part
            for row in rows:
                row[:] = [-x for x in row] if damage == "leaf" else [0.0 * x for x in row]
    document["seal"] = seal(document)
    assert not verify(document).proved


def test_splits_that_are_settled_are_left_out():
    system = prepared(frame(), 0.84)[2]
    leaf, other = Leaf(np.zeros(6), None), Leaf(np.ones(6), None)
    inner = Split(3, (other, leaf))
    document = tree_document(Split(3, (inner, leaf)), system, ["l", "r", "beam"])
    assert document["engaged"] == {"mechanism": {"beam": [1.0] * 3 + [1.0 / system.length_unit] * 3}}


# -- states -----------------------------------------------------------------------------------------------------------


def test_a_free_standing_frame_stands_if_displacements_may_be_twelve_times_eps():
    """Its columns twist. At eta = 10 no state is known."""
    system, wide = prepared(standing_frame(), 0.84)[2], Bounds(1.0, 12.0, 0.01)
    found = alternation(system, wide, budget=20_000, seed=7)
    f, dq = found.f, found.dq
    assert measure(system, wide, f, dq).accepted
    assert not measure(system, UNIT, f, dq).accepted
    contacts, fixed, _ = prepared(standing_frame(), 0.84)
    motion = dq.reshape(-1, 6) / np.repeat([1.0, system.length_unit], 3)
    force = np.einsum("qi,qij->qj", f * [1.0, 1.0 - 1e-12, 1.0 - 1e-12] * system.force_unit, system.frame)
    proof = {"world_force": (force, None), "motion": motion, "bounds": wide}
    document = certify(as_analysed(standing_frame(), contacts, fixed), system, "cra-state", proof)
    assert verify(document).proved
