"""What is said of a stock that cannot make a wall: bounds by hand, laws on random volumes, and against real matches.

Mutants killed by hand: smallest to largest in the bound, cells without a stone left out of it, the least of the lengths
in place of the greatest.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import cyclopean
from cyclopean.design.matching.cells import cells_of
from cyclopean.design.matching.match import MatchSettings, match_stones
from cyclopean.design.matching.misfit import least_gap, misfits
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.quarry import quarry
from cyclopean.io import write_stones

VOLUMES = arrays(float, st.integers(1, 8), elements=st.floats(0.01, 10.0))


@given(VOLUMES, VOLUMES, st.integers(0, 99))
def test_no_assignment_leaves_less_void(stones, cells, seed):
    draw = np.random.default_rng(seed)
    pairs = min(len(stones), len(cells))
    some = draw.permutation(stones)[:pairs], draw.permutation(len(cells))[:pairs]
    void = 1.0 - np.minimum(some[0], cells[some[1]]).sum() / cells.sum()
    bound = least_gap(stones, cells)
    assert bound <= void + 1e-12
    assert least_gap(7.0 * draw.permutation(stones), 7.0 * cells[::-1]) == pytest.approx(bound, abs=1e-12)
    assert least_gap(np.append(stones, 1.0), cells) <= bound + 1e-12


def test_by_hand():
    assert least_gap(np.array([2.0, 2.0]), np.array([1.0, 1.0, 1.0])) == pytest.approx(1.0 / 3.0)
    assert least_gap(np.array([9.0]), np.array([4.0])) == 0.0


def test_a_match_keeps_to_the_bound_and_the_lines_say_why():
    """Cells 600 x 200 x 300 mm, 700 mm across; stones of 9 L fill a quarter, and are too short."""
    wall = cyclopean.stack(3, size=(0.6, 0.2, 0.3))
    cells = cells_of(wall)
    stones = quarry(4, seed=1, volume=(0.009, 0.0091), detail=1)
    said = misfits(stones, cells)
    start, end = (
        "too little stone: the 3 largest of 4 stones hold 27.1 L, the 3 cells 108 L; ",
        "at least 75 % of the wall",
    )
    assert said[0] == f"{start}{end} stays void"
    assert said[-1].startswith("no stone is as long as b01, b02, b03: the longest is ")
    bound = least_gap(np.array([s.volume for s in stones]), cells.volume)
    found = match_stones(stones, cells, MatchSettings(points=256, climbs=0))
    assert found.gap_of_wall >= bound
    assert misfits(quarry(8, seed=1, volume=(0.06, 0.08), detail=1), cells, 0.05) == ()
    thin = cells_of(cyclopean.polygonal_wall(columns=3, rows=2, courses=2, width=1.2, height=0.8, depth=0.9).assembly)
    assert any(
        line.startswith("too thin for the wall: 0 of 8 stones")
        for line in misfits(quarry(8, 1, (0.01, 0.02), detail=1), thin)
    )
    tiny = misfits(quarry(2, seed=1, volume=(1e-9, 2e-9), detail=1), cells)
    assert tiny == (tiny[0],)
    assert "check the units" in tiny[0]


def test_it_stands_first_and_a_heap_of_holes_is_no_wall(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cyclopean.save(cyclopean.stack(3, size=(0.6, 0.2, 0.3)), "wall.json")
    write_stones("stones.obj", Inventory(quarry(4, seed=1, volume=(0.009, 0.0091), detail=1)))
    (tmp_path / "m").mkdir()
    status, out, err = run("match", "stones.obj", "wall.json", "--out", "m", "--points", "256", "--report", "p.html")
    assert status == 0
    assert err.splitlines()[0].startswith("cyclopean: warning: too little stone: ")
    assert err.count("too little stone") == 1
    assert out.startswith("NO WALL YET: ")
    page = (tmp_path / "p.html").read_text()
    assert '<html lang="en" class="unstable">' in page
    assert "Does not fit" in page
