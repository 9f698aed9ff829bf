"""What is kept of places is what would be found anew, and it is forgotten where something is laid.

By hand: where a stone was tried in vain, it may be tried again once a box lies beside it, but not for one far away.
Mutants killed: nothing forgotten; heights taken from the wrong row; a place told apart by its row alone; the worst
place of a stone kept, or one in another order; a stone that touches nothing taken for the next one.
"""

import numpy as np

from cyclopean.design.rubble import places
from cyclopean.design.rubble.places import BESIDE, Looked, Place, Slot, Weights, assessed, bedded, different, ranked
from cyclopean.design.stones.quarry import quarry

CELL = 0.06


def slot(start, end):
    return Slot(
        np.array([start, end]), np.array([0, 14]), 0.6, np.inf, -1, play=10, both=True,
        open=(start * CELL, end * CELL), length=0.6, narrowest=0.1,
    )  # fmt: skip


def told(places):
    return [(p.lying.stone, id(p.lying), p.cell, p.rest, p.cost) for p in places]


def test_what_is_kept_is_what_is_found_anew():
    draw = np.random.default_rng(5)
    ground = draw.uniform(0.0, 0.1, (160, 14))
    lying = [b for k, stone in enumerate(quarry(3, 4, detail=1)) for b in bedded(k, stone, 4, CELL)]
    looked, seen = Looked(), 0
    for step in range(24):
        start = int(draw.integers(0, 120))
        for begin in (start, start + 3):
            kept = told(ranked(ground, lying, slot(begin, 160), Weights(), CELL, 24, looked))
            assert kept == told(ranked(ground, lying, slot(begin, 160), Weights(), CELL, 24))
            seen += len(kept)
        if step % 2:
            ground[start + 20 : start + 26] += draw.uniform(0.0, 0.1)
            looked.forget(start + 20.0, start + 26.0)
    assert seen > 100


def test_a_place_that_failed_is_open_again_when_something_is_laid_beside_it():
    lying = bedded(0, quarry(1, 4, detail=1)[0], 1, CELL)
    place, other = Place(lying[0], (40, 2), 0.1, 0.0), Place(lying[1], (40, 2), 0.1, 0.0)
    wide = lying[0].raster.low.shape[0]
    looked = Looked()
    looked.fail(place)
    assert looked.failed(place)
    assert not looked.failed(other)
    assert not looked.failed(Place(lying[0], (41, 2), 0.1, 0.0))
    looked.forget(40 + wide + BESIDE + 1, 90)
    looked.forget(0, 39 - BESIDE)
    assert looked.failed(place)
    looked.forget(40 + wide + 3, 90)
    assert not looked.failed(place)


def test_the_best_place_of_each_stone_as_it_lies():
    one, two = bedded(0, quarry(1, 4, detail=1)[0], 1, CELL)
    found = [Place(one, (3, 0), 0.1, 1.0), Place(one, (4, 0), 0.1, 2.0), Place(two, (9, 0), 0.1, 3.0)]
    assert different(found) == [found[0], found[2]]
    assert different([found[2], found[1], found[0]]) == [found[2], found[1]]
    assert different([]) == []


def test_a_stone_that_comes_to_touch_nothing_counts_as_one_that_falls(monkeypatch):
    """By hand: two stones on a floor; the one that is held a metre above it has no support, and the worst centre."""
    one, two = bedded(0, quarry(1, 4, detail=1)[0], 1, CELL)
    floor, at = np.zeros((40, 40)), [(one, (3, 3)), (two, (12, 5))]
    usual = assessed(floor, at, CELL)
    tip = places.tipped
    for held in (0, 1):
        lift = np.zeros((2, 3))
        lift[held, 0] = 1.0
        monkeypatch.setattr(places, "tipped", lambda *given, lift=lift: tip(*given) + lift)
        found = assessed(floor, at, CELL)
        assert found[held][:2] == (0.0, 2.0)
        assert found[1 - held] == usual[1 - held]
        assert usual[held][0] > 0.0
