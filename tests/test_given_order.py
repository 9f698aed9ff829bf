"""Orders of building that somebody gives: read, judged, and mended by the fewest moves."""

import json
import random
import re
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from cyclopean import io
from cyclopean.analysis import Settings, prepare
from cyclopean.assembly import Assembly
from cyclopean.design import arch, stack, wall
from cyclopean.design.construction.given import faults_of, nearest_order, stays
from cyclopean.design.construction.options import SequenceOptions
from cyclopean.design.construction.props import fewest
from cyclopean.design.construction.sequence import _site, build_sequence
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.errors import InputError
from laws import examples
from sequence_cases import interlocked

RBE = Settings(method="rbe")


def common(one: list[int], other: list[int]) -> int:
    """Length of a longest common subsequence, by the book: O(n m)."""
    row = [0] * (len(other) + 1)
    for a in one:
        last = 0
        for k, b in enumerate(other, 1):
            last, row[k] = row[k], max(row[k], row[k - 1], last + 1 if a == b else 0)
    return row[-1]


def trap_of(sets: list[list[set[int]]]):
    """Blocks are trapped by any of these sets."""
    return lambda block, there: next((tuple(sorted(s)) for s in sets[block] if s <= set(there)), ())


@given(st.integers(0, 10**6))
@settings(max_examples=examples(60), deadline=None)
def test_no_valid_order_is_nearer(seed) -> None:
    """Against all orders of up to six stones, with what they rest on and what traps them drawn at random."""
    draw = random.Random(seed)
    n = draw.randint(1, 6)
    ranked = draw.sample(range(n), n)
    below: list[set[int]] = [set() for _ in range(n)]
    for k, block in enumerate(ranked):
        below[block] |= {other for other in ranked[:k] if draw.random() < 0.3}
    others = [[x for x in range(n) if x != block] for block in range(n)]
    sets = [[set(draw.sample(rest, min(len(rest), 2)))] if rest and draw.random() < 0.4 else [] for rest in others]
    order, trap = draw.sample(range(n), n), trap_of(sets)
    valid = [list(one) for one in permutations(range(n)) if not faults_of(one, below, (), trap)]
    found = nearest_order(order, below, (), trap, lambda: order)
    if valid:
        assert list(found.order) in valid
        best = n - max(common(order, one) for one in valid)
        assert (found.least, len(found.moved), n - common(order, list(found.order))) == (best, best, best)
        assert (not found.moved) == (order in valid)


def test_a_reversed_tower_keeps_one_stone() -> None:
    """By hand: of b1 < b2 < ... < b5 given the other way round no two can stay."""
    chain = [set(range(k)) for k in range(5)]
    assert len(stays([4, 3, 2, 1, 0], chain)) == 1
    found = build_sequence(stack(5), RBE, wanted=SequenceOptions(order=["b05", "b04", "b03", "b02", "b01"]))
    assert found.given is not None
    assert (found.given.nearest.least, found.given.nearest.order) == (4, (1, 2, 3, 4, 5))
    assert set(found.given.words) == {"stable"}
    assert [step.how for step in found.steps] == ["drops"] * 4 + [""]
    assert [step.props for step in found.steps] == [(5,), (4,), (3,), (2,), ()]  # each shore bears all above it
    assert {prop.kind for prop in found.props} == {"shore"}


def test_the_right_order_needs_no_move_and_is_what_is_found_here() -> None:
    model = wall(3, 2)
    usual = build_sequence(model, RBE)
    again = build_sequence(model, RBE, wanted=SequenceOptions(order=usual.order))
    assert again.given is not None
    assert (again.given.faults, again.given.nearest.moved, again.given.nearest.least) == ((), (), 0)
    assert again.order == usual.order
    assert [step.seal for step in again.steps] == [step.seal for step in usual.steps]


def test_a_stone_laid_upon_nothing_drops_and_is_shored() -> None:
    """Second course first: it rests on c01-b01, which comes third; one move mends that."""
    ids = ["c02-b01", "c01-b02", "c01-b01", "c02-b02", "c01-b03", "c02-b03", "c02-b04"]
    found = build_sequence(wall(3, 2), wanted=SequenceOptions(order=ids))
    names = [block.id for block in found.assembly.blocks]
    assert found.given is not None
    (fault,) = found.given.faults
    assert (fault.step, names[fault.block], [names[i] for i in fault.missing]) == (0, "c02-b01", ["c01-b01"])
    assert [names[i] for i in found.given.nearest.moved] == ["c02-b01"]
    assert set(found.given.words) == {"stable"}
    assert found.first_unstable == 0
    assert (found.steps[0].how, [names[i] for i in found.steps[0].moving]) == ("drops", ["c02-b01"])
    (prop,) = found.props
    assert prop.said(names) == "shore under 'c02-b01' from step 1 until 'c01-b01' is in, step 3"
    assert [step.propped for step in found.steps] == ["stable", "stable"] + [None] * 5


def test_an_arch_from_one_side_is_centred_until_its_last_stone() -> None:
    """The springer leans in and has a strut until the next stone, on its centring, holds it."""
    found = build_sequence(arch(5), wanted=SequenceOptions(order=["v01", "v02", "v03", "v04", "v05"]))
    names = [block.id for block in found.assembly.blocks]
    assert [prop.said(names) for prop in found.props] == [
        "strut against 'v01' from step 1 until 'v02' is in, step 2",
        "centring under 'v02', 'v03', 'v04' from step 2 until 'v05' is in, step 5",
    ]
    assert found.least_props == 4
    assert [step.propped for step in found.steps] == ["stable"] * 4 + [None]


def test_fewer_props_would_not_do() -> None:
    """Every set of one stone less leaves a stage that falls; the proof that the test can fail: the set itself holds."""
    model = arch(5)
    found = build_sequence(model, RBE)
    held = sorted({i for step in found.steps for i in step.props})
    assert len(held) == found.least_props == 4

    def stands(props: tuple[int, ...]) -> bool:
        for k, step in enumerate(found.steps):
            if step.verdict != "stable":
                there = {*np.flatnonzero(found.fixed).tolist(), *found.order[: k + 1]}
                blocks = tuple(
                    replace(b, fixed=b.fixed or i in props) for i, b in enumerate(model.blocks) if i in there
                )
                if cyclopean.check(Assembly(blocks), method="rbe").verdict != "stable":
                    return False
        return True

    assert stands(tuple(held))
    assert not any(stands(some) for some in combinations(found.order, 3))


def test_a_ring_has_no_order_and_that_is_told() -> None:
    """a and b rest on each other: the weaker joint is set aside, and orders are judged without it."""
    for ids, moves in ((["a", "b"], 0), (["b", "a"], 1)):
        found = build_sequence(interlocked(), RBE, wanted=SequenceOptions(order=ids))
        assert found.given is not None
        assert len(found.graph.cycles) == 1
        assert (len(found.given.nearest.moved), found.given.nearest.least) == (moves, moves)


def repaired(model: Assembly, seed: int) -> tuple[int, int]:
    """Moves that mend a shuffled order of a wall, and those to the order found without it."""
    site = _site(prepare(model, RBE), 0.1)
    usual = site.taken_apart()
    order = random.Random(seed).sample(usual, len(usual))
    found = nearest_order(order, site.graph.below, site.fixed, site.trap, lambda: site.taken_apart(order))
    assert sorted(found.order) == sorted(order)
    assert not faults_of(found.order, site.graph.below, site.fixed, site.trap)
    assert found.least <= len(found.moved) == len(order) - common(order, list(found.order))
    return len(found.moved), len(order) - common(order, usual)


@given(seed=st.integers(0, 10_000), columns=st.integers(2, 5), rows=st.integers(2, 4))
@settings(max_examples=examples(8), deadline=None)
def test_shuffled_orders_of_random_walls_are_mended(seed, columns, rows) -> None:
    """The mended order is valid, as long as the given one, and no further from it than the order found without it."""
    model = polygonal_wall(PatternSettings(columns=columns, rows=rows, seed=seed)).assembly
    moves, others = repaired(model, seed)
    assert moves <= others


@given(st.lists(st.sets(st.integers(0, 7), min_size=1), min_size=1, max_size=8))
@settings(max_examples=examples(40), deadline=None)
def test_a_smallest_hitting_set_is_a_smallest(mechanisms) -> None:
    found, least = fewest([sorted(m) for m in mechanisms], (), list(range(8, 0, -1)))
    sizes = [mask.bit_count() for mask in range(1 << 8) if all(any(mask >> b & 1 for b in m) for m in mechanisms)]
    assert len(found) == least == min(sizes)
    assert all(found & m for m in mechanisms)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("o.txt", "# from the mason\nv01\n\nv02\n v03 \n"),
        ("o.csv", "v01\nv02\nv03\n"),
        ("o.csv", "step;block\n2;v02\n1;v01\n3;v03\n"),
        ("o.csv", "id,weight\nv01,3\nv02,4\nv03,5\n"),
        ("o.json", '["v01", "v02", "v03"]'),
        ("o.json", '{"schema": "cyclopean.sequence/1", "order": ["v01", "v02", "v03"]}'),
    ],
)
def test_an_order_is_read(tmp_path, name, text) -> None:
    (tmp_path / name).write_text(text)
    assert io.read_order(tmp_path / name) == ("v01", "v02", "v03")


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("o.txt", "# nothing\n", "o.txt: holds no ids"),
        ("o.csv", "step,block\n1,\n", "o.csv: line 2: names no block"),
        ("o.csv", "step,block\none,v01\n", "o.csv: line 2: its step is not a number"),
        ("o.json", "[1, 2]", "o.json: entry 1 of the order is 1; expected the id of a block"),
        ("o.json", '{"steps": []}', "o.json: expected a list of ids, or an object with a list 'order', not null"),
        ("o.json", "[", "o.json: is not JSON"),
    ],
)
def test_what_is_no_order_is_refused(tmp_path, monkeypatch, name, text, message) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match="^" + re.escape(message)):
        io.read_order(name)


@pytest.mark.parametrize(
    ("ids", "message"),
    [
        ("v01 v02 v03 v04 key", "--order o.txt: block 'key' is not in the model; take out or correct"),
        ("v01 v02 v03", "--order o.txt: blocks 'v04', 'v05' are missing; an order names every stone that is laid"),
        ("v01 v02 v03 v04 v05 v01", "--order o.txt: block 'v01' is named more than once; a stone is laid once"),
    ],
)
def test_a_wrong_order_is_refused_in_one_line(run, tmp_path, ids, message) -> None:
    run("make", "arch", 5, "--out", "arch.json")
    (tmp_path / "o.txt").write_text("\n".join(ids.split()))
    status, out, err = run("sequence", "arch.json", "--out", "seq.json", "--order", "o.txt")
    assert (status, out, err) == (2, "", f"cyclopean: error: {message}\n")
    assert not (tmp_path / "seq.json").exists()


def test_a_given_order_in_words_and_in_the_file(run, tmp_path) -> None:
    run("make", "wall", 3, 2, "--out", "wall.json")
    ids = ["c02-b01", "c01-b02", "c01-b01", "c02-b02", "c01-b03", "c02-b03", "c02-b04"]
    (tmp_path / "o.txt").write_text("\n".join(ids))
    status, out, err = run("sequence", "wall.json", "--out", "seq.json", "--order", "o.txt", "--method", "rbe")
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[3:-1] == [
        "  order    as given, not valid: 'c02-b01' at step 1 comes before 'c01-b01' that it rests on",
        "  nearest  1 move: 'c02-b01'; no valid order is nearer; its stages: 7 stable",
        "  first    unstable at step 1, with 'c02-b01': 'c02-b01' drops",
        "  props    1 stone to hold: no fewer would do",
        "           shore under 'c02-b01' from step 1 until 'c01-b01' is in, step 3",
    ]
    data = json.loads((tmp_path / "seq.json").read_text())
    assert data["order"] == ids
    assert data["given"]["nearest"]["moved"] == ["c02-b01"]
    assert data["given"]["faults"] == [{"step": 1, "block": "c02-b01", "missing": ["c01-b01"], "trapped_by": []}]
    assert (data["held"], data["least_held"]) == (1, 1)


def test_supports_that_an_order_names_stand_already() -> None:
    found = cyclopean.build_sequence(cyclopean.stack(2), method="rbe", order=["ground", "b01", "b02"])
    assert found.order == (1, 2)
