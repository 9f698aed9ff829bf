"""Two fronts on a long wall: it is the same in one process and in two, and neither counts on what the other one does.

By hand: of two stacks side by side, the front whose half holds the one may lay on it, and none what bears on both.
Mutants killed: bearers beyond the middle not looked at; what the other front laid not counted in; counts of vain tries
not taken along; a share that both have; what is left open not closed.
"""

import multiprocessing
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from cyclopean.analysis import Settings, check
from cyclopean.assembly.patches import Surface
from cyclopean.design.rubble import parallel
from cyclopean.design.rubble.places import Place
from cyclopean.design.rubble.settle import OVERLAP, SettleSettings, settle
from cyclopean.design.rubble.standing import FRICTION, Mass, Structure
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.quarry import quarry
from fixtures_stones import box, largest_overlap

LONG = SettleSettings(look_ahead=3, yaws=2, tries=3, length=26.0, thickness=0.9, ways=1)


@pytest.fixture(scope="module")
def stones():
    return Inventory(quarry(60, 3, detail=1))


@pytest.fixture(scope="module")
def alone(stones):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parallel, "LONG", 20.0)
        return settle(stones, LONG)


class Elsewhere:
    """Does at once what is submitted, on a copy of the site; counts, and keeps what was sent."""

    def __init__(self):
        self.sent = []

    def submit(self, work, *what):
        self.sent.append(what)
        done = Future()
        done.set_result(work(*what))
        return done


def poses(wall):
    return [(laid.stone, laid.rotation.tobytes(), laid.shift.tobytes(), laid.course) for laid in wall.laid]


def test_the_wall_is_the_same_whoever_lays_its_other_half(stones, alone, monkeypatch):
    monkeypatch.setattr(parallel, "LONG", 20.0)
    other = Elsewhere()
    together = settle(stones, LONG, None, other)
    assert poses(together) == poses(alone)
    assert np.array_equal(together.assembly.contacts.point, alone.assembly.contacts.point)
    assert together.measures.void == alone.measures.void
    assert len({sent[0] for sent in other.sent}) == 1, "one copy for one wall"
    *_, last = other.sent
    assert len(last[3]) > 20, "it is told what was laid since"
    copy = parallel._COPIES[last[0]]
    assert {turn.number for turn in last[3]} <= set(copy.stood)
    assert (copy.map > 0.0).any(axis=1).mean() > 0.8, "both halves of its map"


def test_in_another_process_too(stones, alone, monkeypatch):
    """Bits that went through pickles and another interpreter."""
    monkeypatch.setattr(parallel, "LONG", 20.0)
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as executor:
        assert poses(settle(stones, LONG, None, executor)) == poses(alone)


def test_it_stands_and_nothing_overlaps(alone):
    assert len(alone.laid) >= 50
    assert check(alone.assembly, Settings(method="rbe", mu=FRICTION)).verdict == "stable"
    assert largest_overlap(alone.assembly)[0] <= OVERLAP
    assert len({laid.stone for laid in alone.laid}) == len(alone.laid)


def test_fronts_keep_off_the_middle_and_what_is_left_is_closed(stones, monkeypatch):
    """Each begins at its end, with every other stone; then the space between them is filled."""
    monkeypatch.setattr(parallel, "LONG", 20.0)
    reports, tasks, spoiled = [], [], []
    work, begin = parallel._worked, parallel.inwards

    def begun(site, *rest):
        assert not site.looked.failed(spoiled[-1]), "a copy does not know what was tried in vain before"
        return begin(site, *rest)

    def watched(site, task):
        tasks.append(task)
        spoiled.append(Place(site.bedded(task.stones[0], 0)[0], (0, 0), 0.0, 0.0))
        site.looked.fail(spoiled[-1])
        reports.append(work(site, task))
        ends = [(site.stood[t.number].low[0], site.stood[t.number].high[0]) for t in reports[-1].turns]
        middle, off = task.middle * site.cell, parallel.APART * site.mean
        assert all(high <= middle - off if task.side < 0 else low >= middle + off for low, high in ends)
        return reports[-1]

    monkeypatch.setattr(parallel, "_worked", watched)
    monkeypatch.setattr(parallel, "inwards", begun)
    wall = settle(stones, LONG)
    lower, upper = tasks[:2]
    assert (lower.side, upper.side) == (-1, 1)
    assert sorted(lower.stones + upper.stones) == list(range(60))
    assert abs(len(lower.stones) - len(upper.stones)) <= 1
    assert reports[0].open < tasks[0].middle < reports[1].open
    by_fronts = {turn.trial.stone for report in reports for turn in report.turns}
    assert len(by_fronts) < len(wall.laid), "some were laid in the space between them"
    assert len({task.middle for task in tasks}) > 1, "the middle moves"


def test_the_length_decides_and_the_order_of_the_inventory_rules_fronts_out(stones):
    kept = Elsewhere()
    settle(Inventory(stones.stones[:6]), replace(LONG, length=6.0), None, kept)
    assert not kept.sent, "a short wall"
    settle(Inventory(stones.stones[:6]), replace(LONG, length=60.0, look_ahead=0), None, kept)
    assert not kept.sent, "without a look-ahead there is one order"
    settle(Inventory(stones.stones[:6]), replace(LONG, length=60.0), None, kept)
    assert kept.sent


def slab(size, at):
    vertices, triangles = box(*size, at=at)
    volume = float(np.prod(size))
    return Mass(np.array(at) + np.array(size) / 2.0, volume, 1e3 * volume), Surface.of(vertices[triangles])


@pytest.mark.parametrize(
    ("between", "at", "held"),
    [
        ((-np.inf, np.inf), 0.6, True),
        ((-np.inf, 1.0), 0.6, False),  # it would bear on both
        ((-np.inf, 1.0), -0.1, True),
        ((1.0, np.inf), 1.3, True),
        ((1.0, np.inf), -0.1, False),
        ((1.0, np.inf), 0.6, False),
    ],
)
def test_no_front_changes_forces_beyond_the_middle(between, at, held):
    """Two cubes 1.2 apart, middle to middle; a third on the left one, on both, or on the right one."""
    vertices, triangles = box(20.0, 20.0, 1.0, at=(-10.0, -10.0, -1.0))
    structure = Structure(Surface.of(vertices[triangles]), 1e-3)
    for x in (0.0, 1.2):
        fresh = structure.fresh(*slab((1.0, 1.0, 1.0), (x, 0.0, 0.0)), list(structure.stones))
        structure.lay((fresh,), structure.held((fresh,)))
    structure.between = between
    fresh = structure.fresh(*slab((1.0, 1.0, 1.0), (at, 0.0, 1.0)), list(structure.stones))
    assert (structure.held((fresh,)) is not None) == held
