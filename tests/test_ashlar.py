"""Walls of sawn stones, by hand and by laws.

The case of an earlier system: 1.5 x 1.0 x 0.2 m of boxes of 0.30 x 0.20 x 0.15 m. Its answer is 6 courses, 30 blocks,
49 interfaces and a coverage of 0.9. 49 = 4 x 6 head joints + 5 x 5 bed joints: joint stands over joint. Ours in stack
bond is the same, with the 5 joints on the ground. In running bond its odd courses begin half a stone from the end of
the wall and leave that open; ours has half a stone there, and the other half, of the same cut, at the other end: 33
stones of the same 30 slabs, no slab more, no offcut left, the ends closed and no joint over a joint.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Settings, check
from cyclopean.design.ashlar.planning import AshlarSettings
from cyclopean.design.ashlar.stock import Slab, saw, slabs_of, stock_of
from cyclopean.design.ashlar.wall import ashlar, face_of, open_stones
from cyclopean.design.stones.stone import stone_of
from cyclopean.design.walls.openings import Opening
from cyclopean.errors import InputError
from laws import examples

BOX = (0.3, 0.2, 0.15)
BRICK = (0.2, 0.1, 0.1)
CUBE = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def of(count, size, name="s"):
    return [Slab(f"{name}{k:03d}", size) for k in range(count)]


def cells(wall):
    return np.array([s.cell_low for s in wall.laid]), np.array([s.cell_high for s in wall.laid])


def overlap(wall):
    """Largest volume (m3) that two cells have in common, exactly."""
    low, high = cells(wall)
    worst = 0.0
    for k in range(len(low)):
        both = np.minimum(high[k], high[k + 1 :]) - np.maximum(low[k], low[k + 1 :])
        worst = max(worst, float(np.prod(np.clip(both, 0.0, None), axis=1).max(initial=0.0)))
    return worst


def laws(wall):
    """Volumes add up, every stone is its slot, inside the wall, and nothing overlaps."""
    out, own = wall.readout, wall.settings
    assert out.stock == pytest.approx(out.placed + out.left + out.off + out.lost, rel=1e-12)
    low, high = (a.reshape(-1, 3) for a in cells(wall))
    assert low.min(initial=0.0) >= 0.0
    assert (high <= np.array([own.length, own.depth, own.height]) + 1e-12).all()
    assert overlap(wall) <= 1e-12
    for stone in wall.laid:
        size = (stone.sawn.high - stone.sawn.low)[[1, 0, 2]] if stone.turned else stone.sawn.high - stone.sawn.low
        assert size == pytest.approx(stone.slot.size, abs=1e-9)
        assert (stone.cell_low <= np.array(stone.slot.low) + 1e-12).all()
        assert (stone.cell_high >= np.array(stone.slot.high) - 1e-12).all()
    used = {}
    for stone in wall.laid:
        used.setdefault(stone.sawn.slab, []).append((stone.sawn.low, stone.sawn.high))
    for slab, parts in used.items():  # no part of a slab is used twice, or from beyond it
        for k, (a, b) in enumerate(parts):
            assert (a >= 0.0).all()
            assert (b <= wall.stock.slabs[slab].size + 1e-12).all()
            for c, d in parts[k + 1 :]:
                assert np.prod(np.clip(np.minimum(b, d) - np.maximum(a, c), 0.0, None)) <= 1e-12


def stands(wall):
    return check(wall.assembly, Settings(method="cra")).verdict == "stable"


# By hand


def test_stack_bond_is_the_answer_of_the_earlier_system():
    wall = ashlar(AshlarSettings(1.5, 1.0, 0.2, bond="stack"), of(30, BOX))
    assert (wall.readout.courses, wall.readout.blocks, len(wall.assembly.contacts)) == (6, 30, 49 + 5)
    assert wall.readout.coverage == pytest.approx(0.9)
    assert wall.readout.aligned == 24
    assert wall.notes == ("the wall is 0.9 m high; 0.1 m is no course, or there is no stock for it",)


def test_running_bond_closes_the_ends_with_two_halves_of_one_slab():
    wall = ashlar(AshlarSettings(1.5, 1.0, 0.2), of(30, BOX))
    out = wall.readout
    assert (out.courses, out.blocks, out.cut, out.cuts) == (6, 33, 6, 3)
    assert len(wall.assembly.contacts) == 5 + (3 * 4 + 3 * 5) + 5 * 10
    assert (out.leftover, out.offcuts, out.lost, out.aligned) == (0, 0, 0.0, 0)
    assert out.coverage == pytest.approx(0.9)
    assert out.least_lap == pytest.approx(0.15)
    halves = [s for s in wall.laid if s.slot.course == 1 and s.sawn.low[0] + s.sawn.cuts > 0]
    assert [(s.slot.low[0], s.slot.high[0]) for s in halves] == [(0.0, 0.15), (1.35, 1.5)]
    assert halves[0].sawn.slab == halves[1].sawn.slab
    laws(wall)
    assert stands(wall)


def test_trimming_leaves_one_offcut():
    wall = ashlar(AshlarSettings(0.3, 0.15, 0.2, unit=0.3), of(1, (1.0, 0.2, 0.15)))
    assert wall.stock.sizes().tolist() == [[0.7, 0.2, 0.15]]
    assert (wall.readout.offcuts, wall.readout.cuts) == (1, 1)


def test_the_offcut_of_one_stone_is_another():
    wall = ashlar(AshlarSettings(1.0, 0.15, 0.2, unit=0.3), of(1, (1.0, 0.2, 0.15)))
    assert [s.slot.low[0] for s in wall.laid] == pytest.approx([0.0, 0.3, 0.6, 0.9])
    assert wall.readout.coverage == pytest.approx(1.0)
    assert wall.readout.cuts == 3
    assert (len(wall.stock), wall.readout.lost) == (0, 0.0)


def test_two_bins_by_height():
    """4 slabs of each height: 2 courses, 8 blocks; in running bond the upper course has two halves, so 9."""
    stock = [*of(4, (0.3, 0.2, 0.15), "low"), *of(4, (0.3, 0.2, 0.2), "high")]
    stack = ashlar(AshlarSettings(1.2, 0.5, 0.2, bond="stack", bins=True), stock)
    assert (stack.readout.courses, stack.readout.blocks) == (2, 8)
    assert [stack.stock.slabs[s.sawn.slab].id[:3] for s in stack.laid] == ["hig"] * 4 + ["low"] * 4
    assert max(s.slot.high[2] for s in stack.laid) == pytest.approx(0.35)
    running = ashlar(AshlarSettings(1.2, 0.5, 0.2, bins=True), stock)
    assert (running.readout.courses, running.readout.blocks, running.readout.leftover) == (2, 9, 0)


def test_english_bond_by_hand():
    """1.6 m of bricks of 0.2 x 0.1: 2 x 8 stretchers; or 2 headers and 2 queen closers at the ends and 13 headers."""
    wall = ashlar(AshlarSettings(1.6, 0.2, 0.2, bond="english"), of(40, BRICK))
    first, second = ([s for s in wall.laid if s.slot.course == k] for k in (0, 1))
    assert [s.slot.kind for s in first] == ["stretcher"] * 16
    assert [s.slot.kind for s in second] == ["header", "closer", *["header"] * 13, "closer", "header"]
    assert {s.slot.leaf for s in second} == {-1}
    assert all(s.turned for s in second if s.slot.kind == "header")
    assert wall.readout.cuts == 1  # both queen closers are halves of one brick
    assert wall.readout.least_lap == pytest.approx(0.05)


@pytest.mark.parametrize("bond", ["english", "flemish", "running", "third"])
def test_no_joint_stands_over_a_joint_and_the_wall_stands(bond):
    size, depth = (BRICK, 0.2) if bond in ("english", "flemish") else (BOX, 0.2)
    wall = ashlar(AshlarSettings(1.7, 0.6, depth, bond=bond), of(120, size))
    laws(wall)
    assert wall.readout.aligned == 0
    assert wall.readout.score == 1.0
    assert wall.readout.coverage == pytest.approx(1.0)
    assert not wall.gaps
    assert stands(wall)


def test_joints_make_stones_smaller_and_what_is_checked_meets_in_their_middles():
    """10 mm joints: stones of 0.29 x 0.14 in a pitch of 0.30 x 0.15."""
    wall = ashlar(AshlarSettings(1.49, 0.44, 0.2, head=0.01, bed=0.01), of(20, (0.29, 0.2, 0.14)))
    laws(wall)
    assert [s.slot.low[0] for s in wall.laid[:5]] == pytest.approx([0.0, 0.3, 0.6, 0.9, 1.2])
    assert [s.cell_low[0] for s in wall.laid[:5]] == pytest.approx([0.0, 0.295, 0.595, 0.895, 1.195])
    assert wall.readout.coverage == pytest.approx(1.0)
    assert stands(wall)
    sawn = open_stones(wall)
    assert len(sawn) == len(wall.assembly)
    assert sum(np.prod(np.ptp(b.vertices, axis=0)) for b in sawn[1:]) == pytest.approx(wall.readout.placed)


def test_through_stones_tie_two_leaves():
    wall = ashlar(AshlarSettings(2.4, 0.6, 0.4, leaves=2, through=3), of(100, (0.4, 0.2, 0.15)))
    laws(wall)
    ties = [s for s in wall.laid if s.slot.kind == "through"]
    assert wall.readout.through == len(ties) == 6
    assert all(s.slot.size == pytest.approx([0.2, 0.4, 0.15]) and s.turned for s in ties)
    assert wall.readout.aligned == 0
    assert stands(wall)
    loose = ashlar(AshlarSettings(2.4, 0.6, 0.4, leaves=2), of(100, (0.4, 0.2, 0.15)))
    assert loose.readout.through == 0


def test_a_lintel_bears_on_both_sides():
    """A window of 0.5 m: the lintel bears 0.1 m on each side, or more where a joint would stand under its end."""
    window = Opening(0.8, 0.5, 0.45, 0.3)
    wall = ashlar(AshlarSettings(2.4, 1.2, 0.2, openings=(window,)), [*of(60, BOX), Slab("long", (1.1, 0.2, 0.15))])
    laws(wall)
    (lintel,) = [s for s in wall.laid if s.slot.kind == "lintel"]
    assert wall.stock.slabs[lintel.sawn.slab].id == "long"
    assert lintel.slot.low[0] <= 0.7 + 1e-9
    assert lintel.slot.high[0] >= 1.4 - 1e-9
    assert lintel.slot.low[2] == pytest.approx(0.75)
    low, high = cells(wall)
    hole = np.array([0.8, 0.0, 0.3]), np.array([1.3, 0.2, 0.75])
    assert np.prod(np.clip(np.minimum(high, hole[1]) - np.maximum(low, hole[0]), 0.0, None), axis=1).max() <= 1e-12
    assert wall.readout.coverage == pytest.approx(1.0)
    assert stands(wall)


def test_a_slab_set_aside_for_a_lintel_is_not_used_below_it():
    window = Opening(0.8, 0.5, 0.45, 0.3)
    wall = ashlar(AshlarSettings(2.4, 1.2, 0.2, openings=(window,)), [*of(20, BOX), Slab("long", (1.1, 0.2, 0.15))])
    assert wall.gaps
    assert [wall.stock.slabs[k].id for k in wall.stock.slab] == ["long"]
    assert "opening 1: has no lintel, the wall ends below it" in wall.notes


def test_no_course_is_higher_than_the_one_below_it():
    """Three tall slabs are too few for a whole course; a door leaves room for three, but then they come too late."""
    stock = [*of(3, (0.3, 0.2, 0.2), "tall"), *of(12, (0.3, 0.2, 0.15), "low"), Slab("long", (0.6, 0.2, 0.15))]
    own = AshlarSettings(1.2, 0.6, 0.2, bins=True, stagger=0.0, openings=(Opening(0.45, 0.3, 0.15, 0.3),))
    wall = ashlar(own, stock)
    laws(wall)
    heights = [next(s.slot.size[2] for s in wall.laid if s.slot.course == k) for k in range(wall.readout.courses)]
    assert heights[:3] == [0.15, 0.15, 0.15]


def test_an_opening_goes_as_courses_go_and_says_so():
    door = Opening(0.8, 0.5, 0.5, 0.0)
    wall = ashlar(AshlarSettings(2.4, 0.9, 0.2, openings=(door,)), [*of(60, BOX), Slab("long", (0.8, 0.2, 0.15))])
    assert "opening 1: reaches from 0 to 0.6 m, as courses go" in wall.notes


def test_when_the_stock_runs_out_the_last_course_has_a_gap_and_nothing_lies_on_it():
    wall = ashlar(AshlarSettings(1.5, 1.0, 0.2), of(12, BOX))
    laws(wall)
    assert [(g.course, g.low, g.high) for g in wall.gaps] == [(2, 0.6, 1.5)]
    assert "course 3: gap from x = 0.600 to 1.500 m" in wall.notes
    assert max(s.slot.course for s in wall.laid) == 2
    assert wall.readout.coverage == pytest.approx(12 * 0.3 * 0.15 / 1.5)
    assert stands(wall)


def test_heights_within_the_tolerance_are_dressed_to_the_lowest():
    stock = [*of(3, (0.3, 0.2, 0.15)), Slab("tall", (0.3, 0.2, 0.152)), Slab("high", (0.3, 0.2, 0.16))]
    wall = ashlar(AshlarSettings(1.2, 0.15, 0.2), stock)
    assert {round(s.slot.high[2], 9) for s in wall.laid} == {0.15}
    assert wall.readout.lost == pytest.approx(0.3 * 0.2 * 0.002)
    assert [wall.stock.slabs[k].id for k in wall.stock.slab] == ["high"]


def test_a_slab_deeper_than_the_wall_is_ripped_and_a_kerf_is_lost():
    wall = ashlar(AshlarSettings(0.3, 0.15, 0.2, kerf=0.005, unit=0.3), of(1, (0.5, 0.4, 0.15)))
    laws(wall)
    assert (wall.readout.blocks, wall.readout.cuts) == (1, 2)
    assert wall.readout.lost == pytest.approx(0.005 * 0.15 * (0.4 + 0.3))
    assert wall.stock.sizes() == pytest.approx(np.array([[0.3, 0.195, 0.15], [0.195, 0.4, 0.15]]))


def test_shorter_stones_share_a_slot_that_none_can_fill():
    wall = ashlar(AshlarSettings(1.5, 0.3, 0.2, unit=0.3), of(30, (0.22, 0.2, 0.15)))
    laws(wall)
    assert wall.readout.coverage == pytest.approx(1.0)
    assert wall.readout.aligned == 0


# Laws


@st.composite
def cases(draw):
    bond = draw(st.sampled_from(["running", "third", "stack", "english", "flemish"]))
    two = bond in ("english", "flemish")
    sizes = draw(st.lists(st.sampled_from([0.2, 0.25, 0.3, 0.43, 0.7]), min_size=1, max_size=3, unique=True))
    depth = 0.1 if two else 0.2
    stock = [
        Slab(f"{k}-{n}", (size, depth, 0.1 + draw(st.sampled_from([0.0, 0.001]))))
        for k, size in enumerate(sizes)
        for n in range(draw(st.integers(5, 40)))
    ]
    own = AshlarSettings(
        draw(st.floats(0.5, 2.0)), draw(st.floats(0.2, 0.6)), 0.2, bond=bond, bins=draw(st.booleans()),
        kerf=draw(st.sampled_from([0.0, 0.004])), bed=draw(st.sampled_from([0.0, 0.01])),
        head=draw(st.sampled_from([0.0, 0.012])),
    )  # fmt: skip
    return own, stock, draw(st.randoms(use_true_random=False))


@settings(max_examples=examples(40), deadline=None)
@given(cases())
def test_laws_hold_and_the_order_of_the_stock_does_not_count(case):
    own, stock, random = case
    wall = ashlar(own, stock)
    laws(wall)
    mixed = list(stock)
    random.shuffle(mixed)
    again = ashlar(own, mixed)
    assert [(s.slot, s.sawn.slab, s.turned) for s in again.laid] == [(s.slot, s.sawn.slab, s.turned) for s in wall.laid]
    assert [s.id for s in again.stock.slabs] == [s.id for s in wall.stock.slabs]
    if not wall.gaps and wall.laid:
        top = max(s.slot.high[2] for s in wall.laid)
        assert wall.readout.coverage == pytest.approx(top / own.height, rel=1e-9)
        assert face_of(wall.laid).areas().sum() == pytest.approx(own.length * top, rel=1e-9)


def test_contacts_are_those_of_touching_boxes():
    """Independent of the detector: the area where two boxes share a face."""
    wall = ashlar(AshlarSettings(1.7, 0.4, 0.2, bond="flemish"), of(80, BRICK))
    low = np.array([b.vertices.min(axis=0) for b in wall.assembly.blocks])
    high = np.array([b.vertices.max(axis=0) for b in wall.assembly.blocks])
    expected = {}
    for i in range(len(low)):
        for j in range(i + 1, len(low)):
            size = np.minimum(high[i], high[j]) - np.maximum(low[i], low[j])
            if (np.abs(size) < 1e-9).sum() == 1 and (np.sort(size)[1:] > 1e-9).all():
                expected[i, j] = np.prod(np.sort(size)[1:])
    found = wall.assembly.contacts
    assert dict(zip(zip(found.a.tolist(), found.b.tolist(), strict=True), found.area.tolist(), strict=True)) == (
        pytest.approx(expected, rel=1e-9)
    )


# Slabs from meshes


def box(size, turn=0.0, shift=(0.0, 0.0, 0.0)):
    corner = np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)]) * np.array(size)
    c, s = np.cos(turn), np.sin(turn)
    points = corner @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + np.array(shift)
    return points, [t for q in CUBE for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))]


@pytest.mark.parametrize("turn", [0.0, 0.4, np.pi / 2])
def test_the_box_of_a_mesh(turn):
    slabs, notes = slabs_of([stone_of("a", *box((0.3, 0.2, 0.15), turn, (4.0, 5.0, 6.0)))])
    assert notes == ()
    assert slabs[0].size == pytest.approx([0.3, 0.2, 0.15], abs=1e-8)
    assert np.linalg.det(slabs[0].frame) == pytest.approx(1.0)
    points = box((0.3, 0.2, 0.15), turn, (4.0, 5.0, 6.0))[0]
    inside = (points - slabs[0].corner) @ slabs[0].frame.T
    assert inside.min(axis=0) == pytest.approx(np.zeros(3), abs=1e-8)
    assert inside.max(axis=0) == pytest.approx([0.3, 0.2, 0.15], abs=1e-8)


def test_a_wedge_is_no_sawn_stone():
    points, triangles = box((0.3, 0.2, 0.15))
    points = points.copy()
    points[4:, 0] *= 0.8
    slabs, notes = slabs_of([stone_of("wedge", points, triangles)])
    assert slabs == ()
    assert notes == ("stone 'wedge': is no sawn stone, it fills 90% of its box; left out",)


# Refusals


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"length": -1.0}, "length -1: expected a positive length"),
        ({"depth": np.nan}, "depth: expected a finite number"),
        ({"bond": "dutch"}, "bond dutch: expected one of"),
        ({"bond": "english", "leaves": 1}, "leaves: english bond has headers"),
        ({"leaves": 3}, "leaves 3: expected a whole number from 1 to 2"),
        ({"through": 2}, "through: a wall of one leaf"),
        ({"leaves": 2, "depth": 0.3, "through": 2}, "through: no slab of 0.3 x 0.3 m"),
        ({"bins": True, "course": 0.1}, "course: either one height"),
        ({"stagger": 1.0}, "stagger 1: expected a number from 0 to 0.9"),
        ({"least": 0.0}, "least 0: expected a positive length"),
        ({"openings": (Opening(1.0, 0.6, 0.4),)}, "openings: number 1 reaches outside the wall of 1.5 x 1 m"),
        ({"openings": (Opening(0.5, 0.4, 1.0),)}, "openings: number 1 reaches outside"),
        ({"openings": (Opening(0.5, 0.4, 0.4, head="arch"),)}, "openings: number 1 has an arch"),
        ({"openings": (Opening(0.5, 0.4, 0.4),)}, "openings: number 1 is 0.4 m wide and takes a lintel of at least"),
        ({"depth": 0.5}, "depth: no slab is 0.5 m deep; the deepest is 0.3 m"),
        ({"bond": "english", "depth": 0.35}, "depth: headers reach through the wall"),
        ({"course": 0.2}, "course: no slab is 0.2 m high within 0.002 m"),
        ({"height": 0.1}, "height: no slab fits into a wall 0.1 m high"),
        ({"length": 1e6, "height": 1e3}, "more than 50,000 stones"),
    ],
)
def test_refusals(options, why):
    given = {"length": 1.5, "height": 1.0, "depth": 0.2} | options
    with pytest.raises(InputError, match=why.replace("(", r"\(")):
        ashlar(AshlarSettings(**given), of(30, BOX))


def test_refusals_of_the_stock():
    with pytest.raises(InputError, match="stock: holds no slab"):
        ashlar(AshlarSettings(1.5, 1.0, 0.2), [])
    with pytest.raises(InputError, match=r"its depth must be more than 0 m, got -0\.2"):
        Slab("a", (0.3, -0.2, 0.1))
    with pytest.raises(InputError, match="slab 'a': the id stands twice"):
        stock_of([Slab("a", BOX), Slab("a", BOX)])
    with pytest.raises(InputError, match="slab 'a': is too small to be sawn"):
        saw(stock_of([Slab("a", BOX)]), 0, (0.4, 0.2, 0.15))
