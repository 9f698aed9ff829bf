"""Matching: ranking, refining, assigning, measuring.

By hand: a box ranked in itself shares all of it, and turned a quarter about its thickness, 2 x 1 shares half; stones of
3 and 2 in cells of 2 and 2 with I = [[2, 1], [2, 2]] fill both; a stone that is the cell loses nothing, one that is 1.1
times as large loses 1 - 1 / 1.1^3 = 0.2487 of itself; a half-volume stone leaves half of its cell.

Mutants killed (by hand): quarter turns the wrong way round; mirrored about the wrong axis; depth not dropped; code of
the rotation off by one; one depth for all cells; force outwards; torque's sign; the largest depth over the parts; bond
with the wrong sign, about the wrong axis; ranked pairs over-valued; exact values discounted; w for 1 + w; prices never
lowered; bisection the wrong way; corner fit without scale; slope by the cell's surface, or about the wrong point;
shift without the centroid; stones by their inner numbers.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from cyclopean.design import stack, wall
from cyclopean.design.matching.assignment import assign, costs, prices, weight_for_gap
from cyclopean.design.matching.cells import cells_of
from cyclopean.design.matching.coarse import rank, rotations
from cyclopean.design.matching.exact import Solids, climbed, corner_fit, principal
from cyclopean.design.matching.match import Known, MatchSettings, match_stones
from cyclopean.design.matching.problem import Bonds, Problem
from cyclopean.design.matching.refine import Schedule, bonded, refine, turned_by
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.sampling import body_points
from cyclopean.design.stones.stone import in_body_frame
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cylinder
from cyclopean.errors import InputError
from cyclopean.geometry.solids import intersection, moved, solid_of, solid_volume
from matching_cases import box, model, prism, rotation, row_of_boxes, rubble, stone, stones_of

OVERSIZE = 1.0 - 1.0 / 1.1**3
ALL = np.ones(48, bool)
QUICK = MatchSettings(climbs=0, points=256, shortlist=4)


def polygonal(columns=4, rows=3, **options):
    return cells_of(polygonal_wall(PatternSettings(columns=columns, rows=rows), depth=0.3, **options).assembly)


def only(*bodies):
    """Cells of these bodies, all free."""
    return cells_of(model(*bodies), [False] * len(bodies))


def shares(cells, j, points, turn, shift=(0.0, 0.0, 0.0)):
    """Share of points (n, 3) that lie in cell j at a pose, counted one plane after the other."""
    held = np.zeros(len(points), bool)
    for normal, offset in zip(cells.normal[j], cells.offset[j], strict=True):
        inside = np.ones(len(points), bool)
        for n, d in zip(normal, offset, strict=True):
            inside &= (points @ np.asarray(turn).T + shift) @ n <= d
        held |= inside
    return held.mean()


# Ranking


def test_48_rotations_all_different_and_proper():
    turns = rotations()
    assert np.linalg.det(turns) == pytest.approx(np.ones(48))
    gap = np.abs(turns[:, None] - turns[None]).max(axis=(2, 3)) + np.eye(48)
    assert gap.min() > 0.2
    through = np.abs(turns[:, 2])  # which axis of the stone goes through the wall
    assert np.bincount(through.argmax(axis=1)).tolist() == [16, 16, 16]
    assert through.max(axis=1) == pytest.approx(np.ones(48))


def test_a_box_ranked_in_itself_by_hand():
    """2 x 1 x 0.5 through the wall: all of it; turned by a quarter, half; with 2 through the wall, 0.5 x 0.5 x 1."""
    cells = only(box((2.0, 0.5, 1.0)))
    it = stone(*box((2.0, 0.5, 1.0)), turn=rotation(1))
    found = rank(Problem([it], body_points([it]), cells), cells.axes, ALL, 48)
    by_hand = {round(v, 2) for v in (1.0, 0.5, 0.25, 0.125)}
    assert found.shared[0, 0] == pytest.approx(1.0, rel=0.08)  # soft edges lose some of a perfect fit
    best = rotations()[found.turns[0, 0, 0]]
    assert np.abs(best) == pytest.approx(np.eye(3))
    for turn in found.turns[:, 0, 0]:
        allowed = np.arange(48) == turn
        here = rank(Problem([it], body_points([it]), cells), cells.axes, allowed, 1)
        if np.abs(rotations()[turn]).max(axis=1) == pytest.approx(np.ones(3)):  # a multiple of 90 degrees
            assert min(abs(float(here.shared[0, 0]) - v) for v in by_hand) < 0.08


def test_ranking_agrees_with_plain_counting_in_every_rotation():
    stones, cells = rubble(3, size=1.1), polygonal(3, 2)
    points, volume = body_points(stones), np.array([s.volume for s in stones])
    for number in range(48):
        found = rank(Problem(stones, points, cells), cells.axes, np.arange(48) == number, 1)
        assert (found.turns == number).all()
        for i, j in ((0, 0), (1, 3), (2, 5)):
            slow = shares(cells, j, points[i], cells.axes[j].T @ rotations()[number])
            assert found.shared[i, j] / volume[i] == pytest.approx(slow, abs=0.02)


def test_ranking_of_cells_of_several_depths():
    """A wall whose cells are 0.2 to 0.6 m deep: each drops the points that stick out of itself."""
    cells = only(*(box((0.42, d, 0.36), (x, 0.0, 0.0)) for x, d in enumerate((0.2, 0.3, 0.45, 0.6))))
    it = stone(*box((0.42, 0.36, 0.6)))
    found = rank(Problem([it], body_points([it]), cells), cells.axes, ALL, 1)
    assert found.shared[0] == pytest.approx([0.42 * 0.36 * d for d in (0.2, 0.3, 0.45, 0.6)], rel=0.08)


def test_tiles_may_be_of_any_size_and_run_anywhere(monkeypatch):
    stones, cells = rubble(9), polygonal(3, 3)
    problem = Problem(stones, body_points(stones), cells)
    whole = rank(problem, cells.axes, ALL, 3)
    monkeypatch.setattr("cyclopean.design.matching.coarse.TILE_STONES", 4)
    monkeypatch.setattr("cyclopean.design.matching.coarse.TILE_CELLS", 5)
    with ThreadPoolExecutor(2) as executor:
        tiled = rank(replace(problem, executor=executor), cells.axes, ALL, 3)
    assert (tiled.shared == whole.shared).all()
    assert (tiled.turns == whole.turns).all()


# Refining


def test_a_box_beside_its_cell_slides_home():
    cells = only(box((1.0, 0.6, 0.8)))
    it = stone(*box((1.0, 0.6, 0.8)))
    turn, shift = it.axes.T.copy()[None], np.array([[0.2, -0.1, 0.15]])
    tilted = turned_by(np.array([[0.1, -0.15, 0.1]])) @ turn
    points = body_points([it])
    before = shares(cells, 0, points[0], tilted[0], shift[0])
    long = Schedule(1024, 60, (0.3, 0.02), (0.1, 0.002))
    share, found, at = refine(Problem([it], points, cells), (np.array([0]), np.array([0])), (tilted, shift), long)
    assert before < 0.7
    assert share[0] > 0.97
    assert np.abs(at).max() < 0.02
    assert shares(cells, 0, points[0], found[0], at[0]) == pytest.approx(share[0], abs=0.01)


def test_refining_never_loses_what_was_given():
    stones, cells = rubble(6), polygonal(3, 2)
    points = body_points(stones)
    stone_, cell = np.arange(6), np.arange(6) % len(cells)
    start = cells.axes[cell].transpose(0, 2, 1)
    schedule = Schedule(512, 10, (0.15, 0.06), (0.1, 0.01))
    share, _, _ = refine(Problem(stones, points, cells), (stone_, cell), (start, np.zeros((6, 3))), schedule)
    for k in range(6):
        assert share[k] >= shares(cells, cell[k], points[k, :512], start[k]) - 1e-6


def test_early_steps_with_few_points_end_as_high_and_never_below_where_they_began():
    stones, cells = rubble(12, size=0.7), polygonal(3, 2)
    problem = Problem(stones, body_points(stones, 1024), cells)
    pair = np.arange(12), np.arange(12) % len(cells)
    plain = Schedule(1024, 40, (0.08, 0.02), (0.05, 0.005))
    start = cells.axes[pair[1]].transpose(0, 2, 1), np.zeros((12, 3))
    all_along, pose, shift = refine(problem, pair, start, plain)
    early, *_ = refine(problem, pair, start, replace(plain, early=24))
    assert early.mean() == pytest.approx(all_along.mean(), abs=0.01)
    again, same, _ = refine(problem, pair, (pose, shift), replace(plain, early=24, step=(0.9, 0.9)))
    assert (again >= all_along - 1e-6).all()
    kept = again <= all_along  # steps so long lead nowhere: it stays where it was
    assert kept.sum() > 6
    assert same[kept] == pytest.approx(pose[kept], abs=1e-6)


def test_refining_works_in_a_cell_of_several_parts():
    cells = only(prism([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 0.0, 0.6))
    it = stone(*prism([(0, 0), (1.9, 0), (1.9, 0.9), (0.9, 0.9), (0.9, 1.9), (0, 1.9)], 0.0, 0.6))
    points, still = body_points([it]), Schedule(1024, 0, (0.1, 0.1), (0.1, 0.1))
    home, pair = it.axes.T[None], (np.array([0]), np.array([0]))
    share, _, _ = refine(Problem([it], points, cells), pair, (home, np.array([[0.1, 0.05, -0.1]])), still)
    assert share[0] == pytest.approx(shares(cells, 0, points[0], home[0], (0.1, 0.05, -0.1)), abs=1e-3)
    assert 0.5 < share[0] < 0.99
    match = match_stones([it], cells, MatchSettings())
    assert match.placements[0].carved_share < 0.02
    alone = only(box((1.0, 0.6, 1.0)))  # of the L, one part only
    assert match_stones([it], alone, MatchSettings()).placements[0].carved_share > 0.6


def test_rodrigues_by_hand():
    turned = turned_by(np.array([[0.0, 0.0, np.pi / 2], [0.0, 0.0, 0.0]]))
    assert turned[0] == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), abs=1e-12)
    assert turned[1] == pytest.approx(np.eye(3))


def test_bonded_turns_back_to_the_limit_and_no_further():
    tilt = turned_by(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.3], [0.0, 0.0, np.pi - 0.4]]))
    found = bonded(tilt, Bonds(np.tile([1.0, 0.0, 0.0], (3, 1)), 0.5))
    angle = np.arccos(np.abs(found[:, 0, 0]))
    assert angle == pytest.approx([0.5, 0.3, 0.4])
    assert found[1:] == pytest.approx(tilt[1:])


# Assigning


def brute(shared, volume, weight):
    """Least total cost by trying everything."""
    cost = costs(shared, volume, weight)
    n, m = cost.shape
    if n >= m:
        return min(sum(cost[p[j], j] for j in range(m)) for p in permutations(range(n), m))
    return min(sum(cost[i, p[i]] for i in range(n)) for p in permutations(range(m), n))


@pytest.mark.parametrize(("n", "m"), [(4, 4), (6, 3), (3, 6), (1, 4), (5, 1)])
def test_assignment_is_the_best_of_all_and_its_prices_prove_it(n, m):
    draw = np.random.Generator(np.random.PCG64([n, m]))
    for weight in (0.3, 1.0, 3.0):
        volume = draw.uniform(1.0, 3.0, n)
        shared = draw.uniform(0.0, 1.0, (n, m))
        chosen = assign(shared, volume, weight)
        cost = costs(shared, volume, weight)
        given = chosen >= 0
        total = cost[chosen[given], np.flatnonzero(given)].sum()
        assert total == pytest.approx(brute(shared, volume, weight))
        u, v = prices(cost, chosen)
        assert (cost - u[:, None] - v >= -1e-9).all()
        assert total == pytest.approx(u.sum() + v.sum())
        idle = np.setdiff1d(np.arange(n), chosen)
        assert (u[idle] == 0.0).all() if n >= m else (v[~given] == 0.0).all()


def test_with_fewer_stones_than_cells_void_is_counted_everywhere():
    """One stone of 1: it fills a cell of 10 by 1 or one of 1 by 0.9. What counts is 1 of void less, not the cell."""
    assert assign(np.array([[1.0, 0.9]]), np.array([1.0]), 1.0).tolist() == [0, -1]


def test_weight_is_the_least_that_reaches_the_gap():
    draw = np.random.Generator(np.random.PCG64(5))
    volume, cell = draw.uniform(0.5, 2.0, 30), draw.uniform(0.8, 1.2, 8)
    shared = np.minimum(volume[:, None], cell) * draw.uniform(0.6, 0.95, (30, 8))
    for gap in (0.1, 0.2, 0.3):
        weight, chosen = weight_for_gap(shared, volume, cell, gap)
        void = 1.0 - shared[chosen, np.arange(8)].sum() / cell.sum()
        if weight < 99.0:
            assert void <= gap
        lighter = assign(shared, volume, weight * 0.97)
        if 0.011 < weight < 99.0:
            assert 1.0 - shared[lighter, np.arange(8)].sum() / cell.sum() > gap
        for near in (0.01, 0.5 * weight, weight, 3.0 * weight, 100.0):  # wherever it begins, but for its resolution
            again, same = weight_for_gap(shared, volume, cell, gap, min(near, 100.0))
            assert again == pytest.approx(weight, rel=0.006)
            assert (1.0 - shared[same, np.arange(8)].sum() / cell.sum() <= gap) == (void <= gap)


# Exact volumes


def test_shared_by_hand_and_its_slope_by_differences():
    cells = only(box((1.0, 1.0, 1.0)))
    it = stone(*box((1.0, 1.0, 1.0)), turn=rotation(2))
    solids = Solids([it], cells)
    turn = it.axes @ rotation(2)  # the body frame of a cube is anything: undo it
    assert solids.shared(0, 0, turn.T, np.array([0.5, 0.0, 0.0])) == pytest.approx(0.5)
    away = np.array([0.3, 0.2, -0.25])
    volume, slope = solids.slope(0, 0, turn.T, away)
    assert volume == pytest.approx(0.7 * 0.8 * 0.75)
    assert slope[:3] == pytest.approx([-0.8 * 0.75, -0.7 * 0.75, 0.7 * 0.8])
    blob = rubble(1, size=1.1)[0]
    solids, pose, at = Solids([blob], cells), rotation(4), np.array([0.1, 0.05, -0.1])
    _, slope = solids.slope(0, 0, pose, at)
    step = 1e-6
    for k in range(3):
        turns = [turned_by(sign * step * np.eye(3)[k : k + 1])[0] @ pose for sign in (1, -1)]
        by = [solids.shared(0, 0, turned, at) for turned in turns]
        assert slope[3 + k] == pytest.approx((by[0] - by[1]) / (2 * step), abs=1e-5)
        moves = [solids.shared(0, 0, pose, at + sign * step * np.eye(3)[k]) for sign in (1, -1)]
        assert slope[k] == pytest.approx((moves[0] - moves[1]) / (2 * step), abs=1e-5)


def test_a_climb_by_exact_volumes_gains():
    cells, blob = polygonal(3, 2), rubble(1, size=0.6)[0]
    solids = Solids([blob], cells)
    start = cells.axes[2].T
    before = solids.shared(0, 2, start, np.zeros(3))
    after, turn, shift = climbed(solids, 0, 2, start, np.zeros(3), 6)
    assert after > before
    assert solids.shared(0, 2, turn, shift) == pytest.approx(after, rel=1e-12)


def test_principal_axes_of_a_cell_are_those_of_a_stone():
    cells = polygonal(3, 2)
    axes, half = principal(cells)
    for it, j in zip(*stones_of(cells), strict=True):
        assert it.half == pytest.approx(half[j], rel=1e-9)
        assert np.linalg.det(axes[j]) == pytest.approx(1.0)


def test_corners_find_each_other_at_any_size():
    cells = polygonal(3, 2)
    block = cells.assembly.blocks[cells.block[1]]
    corners = block.vertices - cells.centre[1]
    it = stone(cells.centre[1] + 1.3 * corners, block.faces, turn=rotation(9))
    home = rotation(9).T @ it.axes.T
    near = turned_by(np.array([[0.08, -0.05, 0.06]]))[0] @ home
    turn, shift = corner_fit(in_body_frame(it), corners, 1 / 1.3, near, np.array([0.02, 0.01, -0.02]))
    assert turn == pytest.approx(home, abs=1e-9)
    assert shift == pytest.approx(np.zeros(3), abs=1e-9)


# The whole


@pytest.mark.parametrize(
    "cells",
    [
        polygonal(5, 3),
        polygonal(4, 3, surface=Cylinder(4.0, 1.5)),
        cells_of(wall(3, 2)),
        cells_of(stack(3)),
    ],
    ids=["polygonal", "curved", "bricks", "cubes"],
)
def test_stones_that_are_the_cells(cells):
    """Shuffled and turned, each loses nothing; 1.1 times as large, each loses 0.2487 of itself and leaves no void."""
    stones, order = stones_of(cells)
    match = match_stones(stones, cells)
    assert max(p.carved_share for p in match.placements) < 1e-6
    assert match.gap < 1e-6
    unlike = len(np.unique(np.round(cells.volume, 6))) == len(cells)
    larger, order = stones_of(cells, 1.1)
    match = match_stones(larger, cells)
    assert match.imposition == pytest.approx(OVERSIZE, abs=1e-3)
    if unlike:
        assert [order[p.stone] for p in match.placements] == [p.cell for p in match.placements]
        assert match.imposition == pytest.approx(OVERSIZE, abs=1e-9)


def test_what_is_reported_is_what_the_poses_give():
    stones, cells = rubble(12, size=0.7), polygonal(3, 3)
    match = match_stones(stones, cells, QUICK)
    carved = void = 0.0
    for p in match.placements:
        block, it = cells.assembly.blocks[cells.block[p.cell]], stones[p.stone]
        placed = moved(solid_of(it.vertices, it.triangles), p.rotation, p.shift)
        common = solid_volume(intersection(placed, solid_of(block.vertices, block.faces)))
        assert p.shared == pytest.approx(common, rel=1e-9)
        assert p.carved_share == pytest.approx(1.0 - common / it.volume, abs=1e-9)
        assert p.gap_share == pytest.approx(1.0 - common / cells.volume[p.cell], abs=1e-9)
        assert p.rotation @ p.rotation.T == pytest.approx(np.eye(3), abs=1e-9)
        carved, void = carved + it.volume - common, void + cells.volume[p.cell] - common
    used = [p.stone for p in match.placements]
    assert match.imposition == pytest.approx(carved / sum(stones[i].volume for i in used))
    assert match.gap == match.gap_of_wall == pytest.approx(void / cells.volume.sum())
    assert sorted([*used, *match.unused.tolist()]) == list(range(12))
    assert not len(match.empty)


def test_fewer_stones_than_cells_leave_some_empty_and_say_so():
    stones, cells = rubble(3), polygonal(3, 2)
    match = match_stones(stones, cells, QUICK)
    assert len(match) == 3
    assert len(match.empty) == len(cells) - 3
    assert not len(match.unused)
    shared = sum(p.shared for p in match.placements)
    assert match.gap_of_wall == pytest.approx(1.0 - shared / cells.volume.sum())
    assert match.gap < match.gap_of_wall
    assert any("stay empty" in note for note in match.notes)


def test_a_gap_that_is_asked_for_is_reached_or_said_to_be_out_of_reach():
    stones, cells = rubble(25, size=0.8), polygonal(3, 3)
    loose, tight = (match_stones(stones, cells, MatchSettings(gap=g, climbs=0, points=256)) for g in (0.5, 0.4))
    assert loose.gap_of_wall <= 0.51
    assert tight.gap_of_wall <= 0.41
    assert loose.weight < tight.weight
    assert loose.imposition < tight.imposition
    never = match_stones(rubble(9, size=0.2), cells, MatchSettings(gap=0.1, climbs=0, points=256))
    assert any("cannot be reached" in note for note in never.notes)


def test_bonds_hold():
    stones, cells = rubble(10, size=0.7), polygonal(3, 2)
    for bond, row in (("into", 2), ("along", 0)):
        match = match_stones(stones, cells, MatchSettings(bond=bond, bond_angle=20.0, points=256))
        for p in match.placements:
            axis = p.rotation @ stones[p.stone].axes[0]
            assert abs(axis @ cells.frame[p.cell, row]) >= np.cos(np.radians(20.1))
    free = match_stones(stones, cells, MatchSettings(points=256))
    assert free.imposition <= match.imposition + 0.01


def test_refining_pays_and_more_stones_do_too():
    stones, cells = rubble(30, size=0.7), polygonal(3, 3)

    def cost(match):
        return sum(stones[p.stone].volume - 2.0 * p.shared for p in match.placements)

    plain = match_stones(stones, cells, MatchSettings(climbs=0, points=64, shortlist=1, starts=1))
    fine = match_stones(stones, cells, MatchSettings(climbs=0))
    finest = match_stones(stones, cells)
    few = match_stones(stones[:9], cells)
    assert cost(finest) < cost(fine) < cost(plain)
    assert cost(finest) < cost(few)


def test_an_earlier_match_is_a_candidate():
    stones, cells = rubble(14, size=0.7), polygonal(3, 3)
    best = match_stones(stones, cells)
    again = match_stones(stones, cells, QUICK, known=Known(best))
    quick = match_stones(stones, cells, QUICK)
    assert sum(p.shared for p in again.placements) >= sum(p.shared for p in best.placements) * 0.995
    assert again.imposition <= quick.imposition + 1e-3


def test_what_was_measured_here_is_not_measured_again():
    stones, cells = rubble(14, size=0.7), polygonal(3, 3)
    best = match_stones(stones, cells)
    again = match_stones(stones, cells, QUICK, known=Known(best, measured=True))
    placed = {(p.stone, p.cell): p for p in best.placements}
    same = [(p, placed[p.stone, p.cell]) for p in again.placements if (p.stone, p.cell) in placed]
    assert len(same) >= 7
    assert all(p.shared == q.shared for p, q in same)
    assert all(p.shift == pytest.approx(q.shift, abs=1e-9) for p, q in same)
    yielded = match_stones(stones, cells, QUICK, known=Known(best, measured=True, yielding=0.2))
    kept = [p for p in yielded.placements if (p.stone, p.cell) in placed]
    assert len(kept) < len(same)  # they count for less, so that others come in
    solids = Solids(stones, cells)
    for p in yielded.placements:  # by points, not exact, but near
        turn, it = p.rotation @ stones[p.stone].axes.T, stones[p.stone]
        shift = p.rotation @ it.centroid + p.shift - cells.centre[p.cell]
        assert p.shared == pytest.approx(solids.shared(p.stone, p.cell, turn, shift), rel=0.06)


def test_the_same_input_gives_the_same_answer_also_from_other_workers():
    stones, cells = rubble(12, size=0.7), polygonal(3, 3)
    said = []
    first = match_stones(Inventory(tuple(stones)), cells, QUICK, progress=said.append)
    with ThreadPoolExecutor(2) as executor:
        second = match_stones(stones, cells, QUICK, executor)
    for a, b in zip(first.placements, second.placements, strict=True):
        assert (a.stone, a.cell, a.shared) == (b.stone, b.cell, b.shared)
        assert (a.rotation == b.rotation).all()
        assert (a.shift == b.shift).all()
    assert {line.split(":")[0] for line in said} >= {"sampling stones", "ranking", "refining", "measuring"}


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"weight": 0.0}, "weight"),
        ({"weight": float("nan")}, "weight"),
        ({"gap": 1.5}, "gap"),
        ({"points": 0}, "points"),
        ({"shortlist": 0}, "shortlist"),
        ({"starts": 0}, "starts"),
        ({"climbs": -1}, "climbs"),
        ({"bond": "up"}, "bond"),
        ({"bond_angle": 100.0}, "bond_angle"),
    ],
)
def test_settings_that_mean_nothing_are_refused(options, named):
    with pytest.raises(InputError, match=f"^{named}:"):
        MatchSettings(**options)


def test_bad_input_is_refused():
    cells = cells_of(row_of_boxes([0.5, 0.4]))
    with pytest.raises(InputError, match="stones: there are none"):
        match_stones([], cells)
    with pytest.raises(InputError, match="points: 8 of 2 stones"):
        match_stones(rubble(2), cells, known=Known(points=np.zeros((2, 8, 3), np.float32)))
    far = match_stones(rubble(2), cells, QUICK)
    with pytest.raises(InputError, match="start: names a stone"):
        match_stones(rubble(1), cells, QUICK, known=Known(far))
