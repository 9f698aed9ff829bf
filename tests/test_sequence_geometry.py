"""Parts of sequencing that know nothing of statics: graph, ways in, colours, yard, frames."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cyclopean.analysis import Settings
from cyclopean.assembly import Contacts
from cyclopean.design import arch, stack, vault, wall
from cyclopean.design.construction.blocking import Neighbours, blockers, freest, insertion
from cyclopean.design.construction.colouring import colouring
from cyclopean.design.construction.ordering import Edge, SupportGraph, layers, support_graph, take_apart
from cyclopean.design.construction.sequence import build_sequence
from laws import examples
from sequence_cases import four_legs

UP = np.array([0.0, 0.0, 1.0])
RBE = Settings(method="rbe")
TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


def touching(pairs: list[tuple[int, int]]) -> Contacts:
    return Contacts.of(pairs, [TRIANGLE] * len(pairs))


# Ways in


@pytest.mark.parametrize(
    ("normals", "direction"),
    [
        ([], [0, 0, 1]),
        ([[0, 0, 1], [1, 0, 0], [-1, 0, 0]], [0, 0, 1]),  # a bed between two upright joints
        ([[0.6, 0, -0.8]], [0.8, 0, 0.6]),  # under an overhang: out along it
        ([[0, 0.6, -0.8], [0, -0.6, -0.8], [1, 0, 0]], [1, 0, 0]),  # under a roof against a wall: off along the ridge
        ([[0, 0.6, -0.8], [0, -0.6, -0.8], [-1, 0, 0]], [-1, 0, 0]),
        ([[0.6, 0, -0.8], [-0.6, 0, -0.8]], None),  # under a roof, nothing below: sideways along its ridge
        ([[0, 0, 1], [0, 0, -1], [1, 0, 0]], None),  # in a mouth: anywhere level but into it
    ],
)
def test_the_freest_direction_by_hand(normals, direction):
    found = freest(np.array(normals, float).reshape(-1, 3), UP)
    if direction is not None:
        assert found == pytest.approx(direction)
    else:
        assert found[2] == pytest.approx(0.0, abs=1e-9)
        assert np.all(np.array(normals) @ found >= -1e-9)


def test_a_stone_in_a_closed_box_is_trapped_and_who_traps_it_is_named():
    sides = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    around = Neighbours(np.array([0, 1, 2, 2, 3, 4]), sides)
    assert insertion(around, {0, 1, 2, 3, 4}, UP) is None
    assert blockers(around, {0, 1, 2, 3, 4}, UP) == (0, 1, 2, 3, 4)
    assert insertion(around, {0, 1, 2, 3}, UP) == pytest.approx(UP)
    assert blockers(around, {0, 1, 2, 3}, UP) == ()
    dovetail = Neighbours(np.array([0, 0, 1, 2, 3]), np.array([[0.8, 0, -0.6], [-0.8, 0, -0.6], *sides[[4, 2, 3]]]))
    assert blockers(dovetail, {0, 1, 2, 3}, UP) == (0, 1, 2, 3)
    assert insertion(dovetail, {0, 1, 2}, UP) == pytest.approx([0, 1, 0])


@settings(deadline=None, max_examples=examples(150))
@given(st.lists(st.tuples(*[st.integers(-2, 2)] * 3).filter(any), min_size=1, max_size=7))
def test_a_way_is_found_exactly_where_there_is_one(rows):
    """Against linear programmes: the cone holds more than 0 iff one of six coordinates can be pushed from 0 in it."""
    normal = np.array(rows, float)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    reach = [
        -linprog(-sign * np.eye(3)[k], A_ub=-normal, b_ub=np.zeros(len(normal)), bounds=[(-1, 1)] * 3).fun
        for k in range(3)
        for sign in (1.0, -1.0)
    ]
    found = freest(normal, UP)
    assert (found is not None) == (max(reach) > 1e-6)
    if found is not None:
        assert np.linalg.norm(found) == pytest.approx(1.0)
        assert np.all(normal @ found >= -2e-6)
        assert (found[2] > 1e-6) == (reach[4] > 1e-6)  # upwards wherever that is possible


# Order


def graph_of(count: int, *edges: tuple[int, int]) -> SupportGraph:
    return SupportGraph(count, tuple(Edge(a, b, 1.0) for a, b in edges), ())


def test_layers_are_longest_paths():
    fixed = np.array([True, False, False, False, False])
    assert layers(graph_of(5, (1, 0), (2, 1), (3, 2), (3, 0)), fixed).tolist() == [0, 1, 2, 3, 1]


def test_a_stone_that_would_be_trapped_is_laid_earlier():
    """Stone 1 cannot come in while 2 stands; both carry nothing, and by rank 1 comes after 2."""
    fixed = np.array([True, False, False])
    rank = [(0.0,), (2.0,), (1.0,)]
    edges = graph_of(3, (1, 0), (2, 0))
    assert take_apart(edges, fixed, rank, lambda i, there: False) == [2, 1]
    assert take_apart(edges, fixed, rank, lambda i, there: i == 1 and 2 in there) == [1, 2]
    assert take_apart(edges, fixed, rank, lambda i, there: True) == [2, 1]  # nothing helps: as by rank


def test_steep_joints_say_nothing():
    """A joint leaning by 0.1 rad from the vertical has n.up = sin 0.1 = 0.0998."""
    face = np.array([[0.0, 0, 0], [0.0, 1, 0], [-np.sin(0.1), 1, np.cos(0.1)]])  # normal (cos, 0, sin)
    pair = Contacts.of([(0, 1)], [face])
    free = np.zeros(2, bool)
    assert pair.frame[0, 0] @ UP == pytest.approx(np.sin(0.1))
    assert support_graph(pair, free, UP).edges == ()
    (edge,) = support_graph(pair, free, UP, 0.09).edges
    assert (edge.upper, edge.lower, edge.support) == (1, 0, pytest.approx(0.5 * np.sin(0.1)))


def test_two_rings_that_share_a_stone_are_broken_twice():
    def flat(size: float) -> np.ndarray:
        return TRIANGLE * np.sqrt(2.0 * size)  # area `size`, normal up, from a into b

    joints = [(0, 1, 3.0), (1, 0, 1.0), (1, 2, 3.0), (2, 1, 2.0)]  # (lower, upper, support)
    contacts = Contacts.of([(a, b) for a, b, _ in joints], [flat(s) for *_, s in joints])
    (cycle,) = support_graph(contacts, np.zeros(3, bool), UP).cycles
    assert cycle.blocks == (0, 1, 2)
    assert [e.support for e in cycle.broken] == pytest.approx([1.0, 2.0])
    assert cycle.alternatives == ()  # no one joint breaks both


# Colours


def test_colours_of_an_even_ring_an_odd_ring_and_a_clique():
    assert len(set(colouring(touching([(0, 1), (1, 2), (2, 3), (3, 0)]), 4).tolist())) == 2
    assert len(set(colouring(touching([(0, 1), (1, 2), (2, 0)]), 3).tolist())) == 3
    assert len(set(colouring(touching([(i, j) for i in range(5) for j in range(i)]), 6).tolist())) == 5


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)).filter(lambda p: p[0] != p[1]), max_size=40))
def test_neighbours_never_share_a_colour(pairs):
    colour = colouring(touching(pairs), 10)
    assert colour.min() >= 0
    assert all(colour[a] != colour[b] for a, b in pairs)
    joined = [len({b if a == i else a for a, b in pairs if i in (a, b)}) for i in range(10)]
    assert colour.max() <= max(joined)


# Whole sequences, by equilibrium alone


MODELS = [stack(4, offset=0.1), wall(3, 3), arch(6, springers="fixed"), vault(4, 2), four_legs()]


@pytest.fixture(scope="module", params=MODELS, ids=lambda m: m.name)
def found(request):
    return build_sequence(request.param, RBE)


def test_no_stone_comes_before_what_it_rests_on(found):
    place = {block: k for k, block in enumerate(found.order)}
    assert sorted(place) == np.flatnonzero(~found.fixed).tolist()
    for edge in found.graph.kept:
        assert found.fixed[edge.lower] or place[edge.lower] < place[edge.upper]
        assert found.layer[edge.lower] < found.layer[edge.upper]
    assert found.layer[list(found.order)].tolist() == sorted(found.layer[list(found.order)].tolist())


def test_no_stone_is_trapped_by_those_before(found):
    normal = found.contacts.frame[:, 0]
    standing = set(np.flatnonzero(found.fixed).tolist())
    for step in found.steps:
        for a, b, n in zip(found.contacts.a, found.contacts.b, normal, strict=True):
            if (a == step.block and b in standing) or (b == step.block and a in standing):
                assert (n if b == step.block else -n) @ step.free >= -2e-6
        standing.add(step.block)


def test_the_yard_is_beside_the_wall_and_nothing_overlaps(found):
    mesh = found.assembly.mesh
    axes = np.stack([found.along, np.cross(found.up, found.along), found.up])

    def spans(vertex):
        local = vertex @ axes.T
        return np.minimum.reduceat(local, mesh.vertex_start[:-1]), np.maximum.reduceat(local, mesh.vertex_start[:-1])

    low, high = spans(mesh.vertex + found.yard[mesh.vertex_body])
    stones = list(found.order)
    low_wall, _ = spans(mesh.vertex)
    assert np.all(high[stones, 1] < low_wall[:, 1].min())  # in front of all that stands
    assert low[stones, 2] == pytest.approx(low_wall[:, 2].min())  # level with the ground
    for k, i in enumerate(stones):
        for j in stones[:k]:
            apart = np.maximum(low[i] - high[j], low[j] - high[i])[:2]
            assert apart.max() > 0.0


def test_frames_lead_from_the_yard_over_the_wall_into_place(found):
    mesh, top = found.assembly.mesh, (found.assembly.mesh.vertex @ found.up).max()
    for step in found.steps:
        frames, centre = step.frames, found.assembly.mass.centroid[step.block]
        assert np.array_equal(frames.place[:3, 3], centre)
        for name in ("yard", "lift", "approach", "place", "retract"):
            frame = getattr(frames, name)
            assert np.array_equal(frame[:3, :3], np.eye(3))
            assert frame[3].tolist() == [0, 0, 0, 1]
        assert frames.yard[:3, 3] - centre == pytest.approx(found.yard[step.block])
        own = mesh.vertex[mesh.vertex_body == step.block]
        lifted = own + (frames.lift[:3, 3] - centre)
        assert (lifted @ found.up).min() >= top
        assert np.cross(frames.lift[:3, 3] - frames.yard[:3, 3], found.up) == pytest.approx([0, 0, 0])
        assert frames.approach[:3, 3] - centre == pytest.approx(0.1 * step.free)


def test_neighbours_in_it_differ_in_colour(found):
    assert np.all(found.colour[found.contacts.a] != found.colour[found.contacts.b])


@settings(deadline=None, max_examples=examples(6))
@given(
    scale=st.floats(0.01, 100.0),
    turn=st.floats(-0.7, 0.7),  # less would let another end of the wall come first
    shift=st.tuples(*[st.integers(-1000, 1000)] * 3),
)
def test_the_sequence_does_not_depend_on_where_how_large_and_which_way(scale, turn, shift):
    model = arch(5)
    c, s = np.cos(turn), np.sin(turn)
    frame = scale * np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    blocks = tuple(replace(b, vertices=b.vertices @ frame.T + shift) for b in model.blocks)
    contacts = replace(model.contacts, point=model.contacts.point @ frame.T + shift)
    one = build_sequence(model, RBE)
    other = build_sequence(replace(model, blocks=blocks, contacts=contacts), RBE)
    assert other.order == one.order
    assert [(x.verdict, x.props) for x in other.steps] == [(x.verdict, x.props) for x in one.steps]
