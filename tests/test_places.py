"""Places on the height map: found by the plain definition, kept where nothing changed, found anew where it did.

Mutants killed: places not swept anew where the map changed; a place tried in vain offered again; a ceiling not kept.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.design.rubble.choosing import Looks, chosen, closed, hidden_area
from cyclopean.design.rubble.orientations import bedded
from cyclopean.design.rubble.places import FULL, Place, Places, Scores, let_down, swept
from cyclopean.design.rubble.shape import Shape
from cyclopean.design.stones.quarry import quarry
from cyclopean.design.stones.stone import stone_of
from cyclopean.errors import InputError
from fixtures_stones import box
from laws import examples

CELL, UNIT = 0.06, 0.4


@given(seed=st.integers(0, 200))
@settings(max_examples=examples(20), deadline=None)
def test_rest_heights_are_those_of_the_plain_definition(seed):
    draw = np.random.default_rng(seed)
    ground, low = draw.random((9, 7)).astype(np.float32), draw.random((3, 2)).astype(np.float32)
    low[1, 1] = np.inf
    cells = np.argwhere(low < np.inf)
    ring = np.array([[3, 0], [3, 1]])
    under = low[cells[:, 0], cells[:, 1]]
    every = np.stack(np.indices((6, 6)), -1).reshape(-1, 2)
    rest, gap, beside = (told.reshape(6, 6) for told in let_down(ground, cells, under, ring, every))
    assert swept(ground, cells, under, (3, 2), (2, 4)) == pytest.approx(rest[2:5, 4:6], abs=1e-6)
    for i in range(6):
        for j in range(6):
            high = max(ground[i + a, j + b] - low[a, b] for a, b in cells)
            assert rest[i, j] == pytest.approx(high, abs=1e-6)
            left = sum(high + low[a, b] - ground[i + a, j + b] for a, b in cells)
            assert gap[i, j] == pytest.approx(left, abs=1e-5)
            assert beside[i, j] == pytest.approx(np.mean([ground[i + a, j + b] >= high for a, b in ring]))


def told(places):
    return [(p.lying.stone, p.cell, p.rest, p.cost) for p in places]


def test_what_is_kept_is_what_is_found_anew():
    draw = np.random.default_rng(5)
    ground = draw.uniform(0.0, 0.1, (80, 14))
    room = np.full(ground.shape, np.inf)
    stones = [bedded(k, stone, 4, CELL) for k, stone in enumerate(quarry(3, 4, detail=1))]
    kept, found = Places(0, room, CELL, UNIT, Scores()), []
    for _ in range(8):
        anew = Places(0, room, CELL, UNIT, Scores())
        ceiling = float(draw.uniform(0.25, 0.6))  # it may rise, and few places are below it
        kept.forget()
        first = told(kept.best(ground, stones, ceiling))
        assert first == told(anew.best(ground, stones, ceiling))
        found.append(len(first))
        i = int(draw.integers(0, 70))
        ground[i : i + 6, 2:8] += draw.uniform(0.0, 0.1)
        kept.changed((i, 2, i + 6, 8))
    assert max(found) > 2 * min(found)


def test_a_place_tried_in_vain_is_not_offered_until_something_is_laid_near():
    ground, room = np.zeros((40, 12)), np.full((40, 12), np.inf)
    stones = [bedded(0, quarry(1, 4, detail=1)[0], 4, CELL)]
    places = Places(0, room, CELL, UNIT, Scores())
    first = places.best(ground, stones, 1.0)[0]
    places.fail(first)
    assert (first.lying, first.cell) not in [(p.lying, p.cell) for p in places.best(ground, stones, 1.0)]
    places.changed((first.cell[0], 0, first.cell[0] + 1, 12))
    assert (first.lying, first.cell) in [(p.lying, p.cell) for p in places.best(ground, stones, 1.0)]
    places.fail(first)
    places.renewed()
    assert (first.lying, first.cell) in [(p.lying, p.cell) for p in places.best(ground, stones, 1.0)]


def test_nothing_above_the_ceiling_or_out_of_the_wall():
    ground, room = np.zeros((40, 14)), np.full((40, 14), np.inf)
    room[:20] = 0.0
    ground[:20] = FULL
    stones = [bedded(0, quarry(1, 4, detail=1)[0], 4, CELL)]
    found = Places(0, room, CELL, UNIT, Scores()).best(ground, stones, 1.0)
    assert found
    assert all(place.cell[0] >= 19 for place in found)
    top = min(place.rest + place.lying.top for place in found)
    assert not Places(0, room, CELL, UNIT, Scores()).best(ground, stones, top - 0.01)
    none = Places(0, room, CELL, UNIT, Scores()).best(ground, stones, 1.0, lambda place: False)
    assert not none


def test_the_closing_fills_what_is_narrower_than_its_square_and_faces_are_walls():
    """By hand: a slot of one cell is filled to its lower side; a step of two cells beside a face as well."""
    ground = np.array([[0.3] * 5, [0.0] * 5, [0.2] * 5, [0.2] * 5, [0.2] * 5, [0.1] * 5])
    assert closed(ground, 1)[:, 2].tolist() == pytest.approx([0.3, 0.2, 0.2, 0.2, 0.2, 0.2])
    grown = closed(ground, 1)
    assert (grown >= ground).all()
    assert np.array_equal(closed(grown, 1), grown)


def test_a_stone_lies_flat_on_flat_ground_and_the_lower_place_is_chosen():
    ground, label = np.zeros((40, 14)), np.full((40, 14), -1)
    ground[:20] = 0.3
    stones = [bedded(0, quarry(6, 4, detail=1)[1], 4, CELL)]
    room = np.full((40, 14), np.inf)
    places = Places(0, room, CELL, UNIT, Scores()).best(ground, stones, 2.0)
    good = chosen(ground, label, places, Looks(room, 2, CELL, UNIT, Scores()))
    assert good
    assert good[0].place.cell[0] >= 20
    assert [t.cost for t in good] == sorted(t.cost for t in good)
    assert np.hypot(*good[0].slope) < 0.2
    assert chosen(ground, label, [], Looks(room, 2, CELL, UNIT, Scores())) == []


def boxed(*size):
    """Orientations of a box (m), the first with its length along the wall."""
    return bedded(0, stone_of("box", *box(*size)), 8, CELL)


def test_a_box_is_seen_where_its_front_is_near_a_face():
    """By hand: 0.42 x 0.30 x 0.24 m is 7 x 5 cells of 0.06; 2 cells behind a face are seen, of a stone 8 cells behind
    others fit before it, and of one that stands back by 2 or more and less than that nothing is seen."""
    lying = boxed(0.42, 0.30, 0.24)[0]
    looks = Looks(np.full((60, 14), np.inf), 2, CELL, UNIT, Scores())
    area = [hidden_area(lying, Place(lying, (20, j), 0.12, 0.0), looks) for j in (0, 1, 2, 3, 9)]
    assert area == pytest.approx([0.0, 0.0, 0.42 * 0.24, 0.42 * 0.24, 0.0], abs=1e-9)
    assert hidden_area(lying, Place(lying, (2, 0), 0.12, 0.0), looks) == pytest.approx(0.30 * 0.24)  # from the end
    assert hidden_area(lying, Place(lying, (51, 0), 0.12, 0.0), looks) == pytest.approx(0.30 * 0.24)


def test_a_box_that_shows_an_edge_is_seen_less():
    """By hand: with its edge in the face it is seen as far as both of its sides are within 2 cells of it: 4 cells."""
    turned = boxed(0.42, 0.30, 0.24)[1]
    looks = Looks(np.full((60, 14), np.inf), 2, CELL, UNIT, Scores())
    wide = turned.raster.low.shape[0] * CELL
    assert hidden_area(turned, Place(turned, (20, 0), 0.12, 0.0), looks) == pytest.approx(
        (wide - 0.24) * 0.24, abs=0.03
    )


def test_a_face_that_leans_is_followed():
    """A stone in the foot's face stands back higher up, where the face has not come in yet, and is in it further up."""
    lying = boxed(0.42, 0.30, 0.24)[0]
    room = np.where(np.arange(14) < 3, 1.0, np.inf) * np.ones((60, 1))  # up to 1 m the wall is 3 cells thicker
    looks = Looks(room, 2, CELL, UNIT, Scores())
    assert hidden_area(lying, Place(lying, (20, 3), 0.5, 0.0), looks) > 0.0
    assert hidden_area(lying, Place(lying, (20, 3), 1.5, 0.0), looks) == 0.0


def test_stones_are_moved_up_to_a_face_that_they_all_but_reach():
    """By hand: 2 m long, 0.6 thick, front 1:6. At a height of 0.6 m the face is 0.1 behind its foot."""
    wall, foot = Shape(2.0, 0.6, batter=1 / 6), np.array([[0.5, 0.13, 0.0], [0.8, 0.13, 0.6]])
    assert wall.flush(foot, 0.05, 0.0) == pytest.approx([0.0, -0.03])
    assert wall.flush(foot, 0.05, 0.01) == pytest.approx([0.0, -0.04])
    assert wall.flush(foot, 0.02, 0.01).tolist() == [0.0, 0.0]
    assert wall.flush(foot + np.array([1.18, 0.455, 0.0]), 0.05, 0.0) == pytest.approx([0.02, 0.015])
    moved = foot + np.append(wall.flush(foot, 0.05, 0.01), 0.0)
    assert wall.holds(moved, 0.0101)
    assert not wall.holds(moved, 0.0099)


def test_scores_below_nothing_are_refused():
    with pytest.raises(InputError, match="scores: void: must not be negative"):
        Scores(void=-1.0)
