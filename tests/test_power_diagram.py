"""Power diagrams, subdivisions and overlays.

By hand: the border of two sites a distance d apart lies d/2 + (w1 - w2)/(2d) from the first; four sites at the quarter
points of a rectangle meet in a "+"; a regular grid of m x n sites has m n cells, m (n + 1) + n (m + 1) edges and
(m - 1)(n - 1) crossings.

Mutants killed (by hand): weight added instead of subtracted in the lifting; short dual edges not welded; corners not
put onto the clip line, or onto the upright side of a given polygon; heaviest of coincident sites dropped; hopeless
sites left in play; voids of an overlay kept; touching lines taken for voids; corners dissolved at degree 3.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.errors import InputError
from cyclopean.geometry import arrangement, dissolved, merged, power_diagram, subdivide
from geometry_rules import faults
from laws import examples

LOW, HIGH = np.array([-1.0, 2.0]), np.array([3.0, 4.5])
AREA = 10.0


def grid(columns: int, rows: int) -> np.ndarray:
    u = LOW[0] + (np.arange(columns) + 0.5) * 4.0 / columns
    v = LOW[1] + (np.arange(rows) + 0.5) * 2.5 / rows
    return np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)


def box(a: float, b: float, c: float, d: float) -> np.ndarray:
    return np.array([[a, b], [c, b], [c, d], [a, d]])


# ---- by hand


@pytest.mark.parametrize(("w", "border"), [(0.0, 0.5), (1.0, 0.75), (-1.0, 0.25), (1.9, 0.975)])
def test_border_of_two_sites(w: float, border: float) -> None:
    cells = power_diagram([[0.0, 0.5], [2.0, 0.5]], [w, 0.0], [-0.5, 0.0], [2.5, 1.0])
    # 0.5 + d/2 + w/(2 d) = 1.5 + w/4 wide, counted from the left end
    assert cells.areas() == pytest.approx([1.5 + w / 4.0, 1.5 - w / 4.0], abs=1e-12)
    assert border == 0.5 + w / 4.0


def test_four_sites_meet_in_one_crossing() -> None:
    cells = power_diagram(grid(2, 2), np.zeros(4), LOW, HIGH)
    crossing = cells.crossings()
    assert cells.vertex[crossing] == pytest.approx(np.array([[1.0, 3.25]]), abs=1e-12)
    assert len(cells.vertex) == 9
    assert len(cells.edge) == 12
    assert cells.inradii() == pytest.approx([2 * 2.5 / 6.5] * 4)


@pytest.mark.parametrize(("m", "n"), [(1, 1), (1, 7), (7, 1), (20, 12)])
def test_regular_grid(m: int, n: int) -> None:
    cells = power_diagram(grid(m, n), np.zeros(m * n), LOW, HIGH)
    assert len(cells) == m * n
    assert len(cells.edge) == m * (n + 1) + n * (m + 1)
    assert len(cells.crossings()) == (m - 1) * (n - 1)
    assert faults(cells, AREA) == []


def test_areas_centroids_and_perimeters_far_from_the_origin() -> None:
    ell = subdivide(np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2.0]]) + 1e6, [[0, 1, 2, 3, 4, 5]])
    assert ell.areas() == pytest.approx([3.0], rel=1e-12)
    assert ell.centroids() - 1e6 == pytest.approx(np.array([[5.0 / 6.0, 5.0 / 6.0]]), abs=1e-9)
    assert ell.perimeters() == pytest.approx([8.0])


def test_two_squares_become_one_and_lose_the_idle_corners() -> None:
    two = subdivide([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], [[0, 1, 4, 3], [1, 2, 5, 4]])
    ring = merged(two, 0, 1)
    assert ring is not None
    one = dissolved(subdivide(two.vertex, [ring]))
    assert len(one.vertex) == 4
    assert one.areas().tolist() == [2.0]
    assert merged(subdivide([[0, 0], [1, 0], [0, 1], [3, 0], [4, 0], [3, 1]], [[0, 1, 2], [3, 4, 5]]), 0, 1) is None


# ---- degenerate input


@pytest.mark.parametrize(
    ("site", "weight", "cells"),
    [
        (np.concatenate([grid(6, 4), grid(6, 4)[:3]]), np.zeros(27), 24),  # coincident: the earlier one wins
        (np.stack([np.linspace(-0.9, 2.9, 10), np.full(10, 3.0)], 1), np.zeros(10), 10),  # collinear, level
        (np.stack([np.full(10, 1.0), np.linspace(2.1, 4.4, 10)], 1), np.zeros(10), 10),  # upright
        (np.stack([np.linspace(0, 2, 10), np.linspace(2.1, 4.1, 10)], 1), np.zeros(10), 10),  # oblique
        (grid(6, 4), 1e9 * np.eye(24)[9], 1),  # one dominates
        (np.full((5, 2), 3.0), np.arange(5.0), 1),
        (np.array([LOW, HIGH, [-1.0, 4.5], [3.0, 2.0]]), np.zeros(4), 4),  # on the corners
    ],
)
def test_degenerate_sites(site: np.ndarray, weight: np.ndarray, cells: int) -> None:
    found = power_diagram(site, weight, LOW, HIGH)
    assert faults(found, AREA) == []
    assert len(found) == cells


def test_of_coincident_sites_the_heaviest_has_the_cell() -> None:
    found = power_diagram([[0.0, 3.0], [0.0, 3.0], [1.0, 3.0]], [0.0, 0.1, 0.0], LOW, HIGH)
    assert found.site.tolist() == [1, 2]


def test_a_site_too_light_to_matter_costs_no_digits() -> None:
    site = np.random.default_rng(5).uniform(LOW, HIGH, (40, 2))
    light = np.zeros(40)
    light[7] = -1e12
    found = power_diagram(site, light, LOW, HIGH)
    alone = power_diagram(np.delete(site, 7, axis=0), np.zeros(39), LOW, HIGH)
    assert found.areas() == pytest.approx(alone.areas(), abs=1e-12)


# ---- laws


@given(
    n=st.integers(1, 60), spread=st.floats(0.0, 3.0), seed=st.integers(0, 2**32 - 1), snap=st.sampled_from([0.0, 0.5])
)
@settings(max_examples=examples(60), deadline=None)
def test_cells_tile_the_rectangle_and_belong_to_the_site_of_least_power(
    n: int, spread: float, seed: int, snap: float
) -> None:
    draw = np.random.default_rng(seed)
    site = draw.uniform(LOW, HIGH, (n, 2))
    if snap:
        site = np.round(site / snap) * snap  # many ties
    weight = spread * draw.uniform(0.0, 1.0, n)
    cells = power_diagram(site, weight, LOW, HIGH)
    assert faults(cells, AREA) == []
    inner = (cells.side >= 0).all(axis=1)
    outer = cells.vertex[cells.edge[~inner]]
    assert np.all(((outer == LOW) | (outer == HIGH)).any(axis=2).all(axis=1))  # the rest lies on the rectangle exactly
    power = ((cells.centroids()[:, None] - site) ** 2).sum(axis=2) - weight
    assert np.all(power[np.arange(len(cells)), cells.site] <= power.min(axis=1) + 1e-9)


@given(seed=st.integers(0, 2**32 - 1), shift=st.floats(-1e3, 1e3), heavier=st.floats(-5.0, 5.0))
@settings(max_examples=examples(20), deadline=None)
def test_moving_everything_or_adding_to_every_weight_changes_nothing(seed: int, shift: float, heavier: float) -> None:
    draw = np.random.default_rng(seed)
    site, weight = draw.uniform(LOW, HIGH, (30, 2)), draw.uniform(0.0, 0.3, 30)
    one = power_diagram(site, weight, LOW, HIGH)
    two = power_diagram(site + shift, weight + heavier, LOW + shift, HIGH + shift)
    assert two.site.tolist() == one.site.tolist()
    assert two.areas() == pytest.approx(one.areas(), abs=1e-9)


def test_same_input_same_bits() -> None:
    site, weight = np.random.default_rng(3).uniform(LOW, HIGH, (200, 2)), np.zeros(200)
    one, two = (power_diagram(site, weight, LOW, HIGH) for _ in range(2))
    assert one.vertex.tobytes() == two.vertex.tobytes()
    assert one.index.tobytes() == two.index.tobytes()


@given(n=st.integers(1, 80), seed=st.integers(0, 2**32 - 1), at=st.sampled_from([0.0, 1e-13, 1e-10, 0.1]))
@settings(max_examples=examples(40), deadline=None)
def test_overlay_covers_all_but_the_voids(n: int, seed: int, at: float) -> None:
    site = np.random.default_rng(seed).uniform(LOW, HIGH, (n, 2))
    cells = power_diagram(site, np.zeros(n), LOW, HIGH)
    if n > 1 and at < 0.1:  # a void whose side runs through a corner of a cell, or almost
        u = float(np.clip(cells.vertex[cells.index[2], 0] + at, -0.5, 1.5))
    else:
        u = 0.25
    void = [box(u, 1.0, u + 0.5, 3.5), box(2.2, 3.0, 2.6, 3.4)]
    given_ = [box(u - 0.2, 3.5, u + 0.7, 3.75), *(box(k - 1.0, 4.25, k, 4.5) for k in range(4))]
    found, which = arrangement(cells, given_, void)
    assert faults(found, AREA - 0.5 * 1.5 - 0.16) == []
    assert which[which >= 0].tolist() == [0, 1, 2, 3, 4]
    assert found.site[which >= 0].tolist() == [-1] * 5
    upright = found.vertex[np.abs(found.vertex[:, 0] - u) < 1e-8, 0]
    assert len(upright) >= 2
    assert np.all(upright[found.vertex[np.abs(found.vertex[:, 0] - u) < 1e-8, 1] <= 3.5] == u)
    for k, polygon in enumerate(given_):
        ring = found.ring(int(np.flatnonzero(which == k)[0]))
        assert {tuple(p) for p in polygon.tolist()} <= {tuple(p) for p in ring.tolist()}  # corners to the bit


def test_an_island_in_one_cell_cuts_it_in_two() -> None:
    whole = subdivide(box(0, 0, 4, 2), [[0, 1, 2, 3]])
    found, _ = arrangement(whole, [], [box(1, 0.5, 2, 1)])
    assert len(found) == 2
    assert faults(found, 7.5) == []


# ---- the watchman can bark


@pytest.mark.parametrize(
    ("vertex", "rings", "word"),
    [
        ([[0, 0], [1, 1], [1, 0], [0, 1]], [[0, 1, 2, 3]], "not simple"),
        ([[0, 0], [1, 0], [1, 1]], [[0, 2, 1]], "positive area"),
        ([[0, 0], [1, 0], [1, 1], [0.5, 2]], [[0, 1, 2], [0, 1, 3]], "overlap along"),
        ([[0, 0], [2, 0], [2, 1], [0, 1], [1, 0], [2, -1], [0, -1]], [[0, 1, 2, 3], [6, 5, 1, 4, 0]], "sharing"),
        ([[0, 0], [2, 0], [0, 2], [1, 0.2], [3, 0.2], [3, 2]], [[0, 1, 2], [3, 4, 5]], "sharing"),
    ],
)
def test_faults_are_named(vertex: list[list[float]], rings: list[list[int]], word: str) -> None:
    assert any(word in line for line in faults(subdivide(vertex, rings)))


def test_missing_area_is_named() -> None:
    assert "cover" in faults(subdivide(box(0, 0, 1, 1), [[0, 1, 2, 3]]), 1.0 + 3e-9)[0]
    assert "cover" in faults(subdivide(box(0, 0, 1, 1), [[0, 1, 2, 3]]), 1.0 - 3e-9)[0]


# ---- refusals


@pytest.mark.parametrize(
    ("site", "weight", "low", "high", "word"),
    [
        (np.zeros((0, 2)), [], [0, 0], [1, 1], "at least one site"),
        ([[0.5, 0.5]], [0.0], [0, 0], [1, 0], "no area"),
        ([[0.5, np.nan]], [0.0], [0, 0], [1, 1], "finite"),
        ([[0.5, 0.5]], [0.0, 1.0], [0, 0], [1, 1], "weight: expected shape"),
    ],
)
def test_bad_sites(site: object, weight: object, low: object, high: object, word: str) -> None:
    with pytest.raises(InputError, match=word):
        power_diagram(site, weight, low, high)  # type: ignore[arg-type]


def test_bad_rings_and_overlapping_polygons() -> None:
    with pytest.raises(InputError, match="fewer than three"):
        subdivide([[0, 0], [1, 0]], [[0, 1]])
    with pytest.raises(InputError, match="not there"):
        subdivide([[0, 0], [1, 0]], [[0, 1, 2]])
    whole = subdivide(box(0, 0, 4, 2), [[0, 1, 2, 3]])
    with pytest.raises(InputError, match="overlaps"):
        arrangement(whole, [box(1, 0.5, 2, 1), box(1.5, 0.5, 3, 1)], [])
