"""Flats cut on stones that are let down into others, by hand and by laws.

By hand: a box of 2 x 1 x 1 let 1 cm into a table loses 0.02 m3 by one level plane, 0.01 m above its foot; on two
stones side by side it is still one plane, the higher one. On a table and against a post two planes; in the ground, one.
Two cells of 1 cm2 with gaps of 0 and 1 cm share 3 cm3 at 2 cm.
Mutants killed: turn or shift of the pose left out; the plane at the far end of the place; the ground left out; no look
at the share, the depth or the pieces left; planes of one bed not made one; the dearest plane; no finer directions, or
not the thinnest one; patches head down or of wrong areas; volumes of cuts from the whole; gaps not sorted; no cap.
Survives: no look at the share before all planes are known, and none at overlaps at the end; both are done twice.
"""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cyclopean.design.carving.carve import total
from cyclopean.design.rubble.dressing import cut_list, dressed, imposition, let_down
from cyclopean.design.rubble.features import body_of
from cyclopean.design.rubble.seating import overlap_share
from cyclopean.design.stones.quarry import quarry
from cyclopean.errors import InputError
from cyclopean.geometry.solids import difference, solid_volume
from fixtures_stones import box, rotation
from laws import examples

EYE = np.eye(3)
SEEDS = st.integers(0, 2**32 - 1)


def body(x, y, z, at=(0.0, 0.0, 0.0)):
    return body_of(*box(x, y, z, at))


TABLE = body(4.0, 4.0, 1.0, (-1.0, -1.0, -1.0))


def test_a_box_one_centimetre_deep_in_another_loses_its_foot():
    found = dressed(body(2.0, 1.0, 1.0), EYE, [0.0, 0.0, -0.01], [TABLE], 0.05, None)
    assert found.removed == pytest.approx(0.02, rel=1e-9)
    (cut,) = found.cuts
    assert cut.normal == pytest.approx([0.0, 0.0, -1.0])
    assert (cut.offset, cut.area, cut.depth, cut.volume) == pytest.approx((-0.01, 2.0, 0.01, 0.02), rel=1e-9)
    assert found.body.volume == pytest.approx(1.98, rel=1e-9)
    assert imposition(found.removed, 2.0) == pytest.approx(0.01)


def test_the_ground_cuts_as_a_table_does():
    found = dressed(body(2.0, 1.0, 1.0), EYE, [0.0, 0.0, 0.49], [], 0.05, 0.5)
    assert cut_list(found.cuts) == [
        {"normal": [0.0, 0.0, -1.0], "offset": pytest.approx(-0.01), "area": pytest.approx(2.0),
         "depth": pytest.approx(0.01), "volume": pytest.approx(0.02)}
    ]  # fmt: skip
    json.dumps(cut_list(found.cuts))


def test_one_bed_on_two_stones_two_beds_on_a_step():
    halves = [body(1.0, 1.0, 1.0, (0.0, 0.0, -1.0)), body(1.0, 1.0, 1.005, (1.0, 0.0, -1.0))]
    found = dressed(body(2.0, 1.0, 1.0), EYE, [0.0, 0.0, -0.01], halves, 0.05, None)
    assert [cut.volume for cut in found.cuts] == pytest.approx([0.03])  # the deeper one
    post = body(0.1, 1.0, 1.0, (1.98, 0.0, 0.0))
    found = dressed(body(2.0, 1.0, 1.0), EYE, [0.0, 0.0, -0.01], [TABLE, post], 0.05, None)
    assert [cut.volume for cut in found.cuts] == pytest.approx([0.02, 0.02 * 0.99])


def test_what_touches_nothing_stays_as_it_is():
    stone = body(2.0, 1.0, 1.0)
    for height in (0.0, 0.01):
        found = dressed(stone, EYE, [0.0, 0.0, height], [TABLE], 0.05)
        assert found.body is stone
        assert (found.cuts, found.removed) == ((), 0.0)


@given(SEEDS)
@settings(max_examples=examples(40), deadline=None)
def test_the_pose_turns_the_cuts_with_it(seed):
    """The same stone in another frame of its own: the same cuts, told in that frame."""
    turn, stone = rotation(seed), body(2.0, 1.0, 1.0)
    found = dressed(
        stone.moved(turn, [1.0, 2.0, 3.0]), turn.T, -turn.T @ [1.0, 2.0, 3.0] - [0.0, 0.0, 0.01], [TABLE], 0.05, None
    )
    (cut,) = found.cuts
    assert cut.normal == pytest.approx(turn @ [0.0, 0.0, -1.0], abs=1e-9)
    assert cut.offset == pytest.approx(-0.01 + cut.normal @ [1.0, 2.0, 3.0], abs=1e-9)
    assert (cut.area, cut.depth, cut.volume) == pytest.approx((2.0, 0.01, 0.02), rel=1e-6)


@given(SEEDS, st.floats(0.0, 0.06), st.floats(0.0, 0.1))
@settings(max_examples=examples(60), deadline=None)
def test_quarry_stones_lose_no_more_than_allowed_and_overlap_nothing(seed, down, share):
    stones = quarry(4, seed, detail=1)
    top, *low = (body_of(s.vertices, s.triangles) for s in stones)
    placed, x = [], 0.0
    for other in low:
        placed.append(other.moved(EYE, [x - other.low[0], 0.0, -other.high[2]]))
        x = placed[-1].high[0]
    turn, size = rotation(seed), np.cbrt(top.volume)
    there = top.moved(turn, [0.0, 0.0, 0.0])
    shift = np.array([x / 2.0 - there.centroid[0], 0.0, -there.low[2] - down * size])
    found = dressed(top, turn, shift, placed, share, None)
    if found is None:
        assert overlap_share(top.moved(turn, shift), placed) > 0.0
        return
    assert found.removed <= share * top.volume
    assert sum(cut.volume for cut in found.cuts) == pytest.approx(found.removed, abs=1e-9 * top.volume)
    assert solid_volume(difference(found.body.solid, top.solid)) <= 1e-9 * top.volume
    assert overlap_share(found.body.moved(turn, shift), placed) <= 1e-3
    for cut in found.cuts:
        assert (found.body.vertices @ cut.normal).max() <= cut.offset + 1e-9 * size
        assert 0.0 <= cut.depth <= 0.2 * size


def test_corners_are_cut_off_nearly_level():
    """A level plane takes the corner of a cube that stands in a table and nothing else: what is cut is little more."""
    cube, more = body(1.0, 1.0, 1.0), []
    for turn in map(rotation, range(100)):
        if np.abs(turn[2]).min() > 0.35:  # no edge is so nearly level that more than a corner stands in the table
            shift = np.array([0.0, 0.0, -np.minimum(turn[2], 0.0).sum() - 0.08])
            removed = dressed(cube, turn, shift, [TABLE], 0.2, None).removed
            more.append(removed / overlap_share(cube.moved(turn, shift), [TABLE]))
    assert len(more) > 10
    assert min(more) >= 1.0 - 1e-9
    assert np.median(more) <= 1.05  # 1.6 by the first directions alone
    assert max(more) <= 1.6


def test_a_bad_share_and_what_would_take_too_much_are_refused():
    stone = body(2.0, 1.0, 1.0)
    for share in (-0.01, 1.0, np.nan):
        with pytest.raises(InputError, match="share"):
            dressed(stone, EYE, [0.0, 0.0, -0.01], [TABLE], share)
    assert dressed(stone, EYE, [0.0, 0.0, -0.02], [TABLE], 0.0201, None) is not None
    assert dressed(stone, EYE, [0.0, 0.0, -0.02], [TABLE], 0.0199, None) is None  # more than the share
    assert dressed(stone, EYE, [0.0, 0.0, -0.02], [], 0.0199) is None  # in the ground
    assert dressed(stone, EYE, [0.0, 0.0, -0.25], [TABLE], 0.5, None) is not None
    assert dressed(stone, EYE, [0.0, 0.0, -0.26], [TABLE], 0.5, None) is None  # deeper than a fifth of 2^(1/3) m
    assert dressed(stone, EYE, [0.0, 0.0, -2.0], [], 0.5) is None  # wholly in the ground


def test_a_stone_that_would_fall_in_two_is_refused():
    frame = np.array([[0, 0], [3, 0], [3, 1], [2, 1], [2, 0.1], [1, 0.1], [1, 1], [0, 1]], float)
    from manifold3d import CrossSection, Manifold

    from cyclopean.geometry.solids import mesh_of

    legs = body_of(*mesh_of(Manifold.extrude(CrossSection([frame]), 1.0)))  # two legs, a web of 0.1 below
    upright = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    assert dressed(legs, upright, [0.0, 0.0, -0.09], [TABLE], 0.3, None) is not None
    assert dressed(legs, upright, [0.0, 0.0, -0.11], [TABLE], 0.3, None) is None


def test_imposition_is_that_of_carved_walls():
    assert imposition(0.0, 0.0) == total([]).imposition == 0.0
    assert imposition(0.25, 1.0) == 0.25
    assert imposition(-1e-18, 1.0) == 0.0


def test_letting_down_by_hand():
    gap = np.array([[[0.01, 0.0]], [[np.inf, np.inf]], [[0.03, np.inf]], [[0.0, 0.0]]])
    found = let_down(gap, 0.01, np.array([3e-6, 1.0, 0.0, 1.0]), [0.1, 0.2, 0.3, 0.4])
    assert found == pytest.approx([0.02, 0.2, 0.03, 0.4])


@given(arrays(float, (3, 4, 5), elements=st.floats(0.0, 1.0) | st.just(np.inf)), st.floats(0.0, 0.1))
@settings(max_examples=examples(100))
def test_let_down_shares_the_volume_or_stops_at_the_cap(gap, volume):
    depth = let_down(gap, 0.1, np.full(3, volume), 0.8)
    shared = 0.01 * np.maximum(depth[:, None, None] - gap, 0.0).sum(axis=(1, 2))
    assert (shared <= volume + 1e-12).all()
    assert ((depth == 0.8) | (np.abs(shared - volume) <= 1e-12)).all()
