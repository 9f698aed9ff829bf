"""Patterns of polygonal walls: seeds, coursing, openings, dressed stones, culling.

By hand: a corner at height 0.7 between lines 0 and 1 goes to 0.7 (1 - c) + c; a semicircular arch with n wedges leaves
w (h - r) + n r^2 sin(pi / n) / 2 clear; a circular foot of radius R under a wall of length L rises by
R - sqrt(R^2 - L^2 / 4).

Mutants killed (by hand): a corner not compared with the edges next to its own; sign of a height dropped; second choice
of line not taken; joints that meet on a bed not set apart; corners on a level bed not put in; corners of dressed stones
free, or not to be met; nothing slides; c and 1 - c exchanged; odd rows not staggered; seed not used; nothing culled;
thin pieces left; weights ignored; coverage claimed; radius of an arch doubled; overlapping openings let through; coping
in line with the quoins; quoins all alike.
"""

from collections.abc import Callable

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.design.walls.coursing import coursed, free_corners
from cyclopean.design.walls.dressing import Coping, Quoins, coping_stones, foot_line
from cyclopean.design.walls.openings import Opening, clear_shape, head_stones
from cyclopean.design.walls.pattern import Pattern, PatternSettings, draw_pattern
from cyclopean.errors import InputError
from cyclopean.geometry import power_diagram, subdivide
from geometry_rules import faults
from laws import examples, quick

DOOR = Opening(0.9, 0.7, 1.0)
WINDOW = Opening(2.6, 0.8, 0.95, 0.55, "arch")
SEGMENT = Opening(3.9, 0.8, 0.7, 0.7, "arch", rise=0.2)
BIG = PatternSettings(
    width=5.2, height=2.4, columns=14, rows=7, courses=7, openings=(DOOR, WINDOW, SEGMENT), quoins=Quoins(),
    coping=Coping(),
)  # fmt: skip


def changed(base: PatternSettings, **options: object) -> PatternSettings:
    names = PatternSettings.__dataclass_fields__
    return PatternSettings(**({name: getattr(base, name) for name in names} | options))


def wall_area(pattern: Pattern) -> float:
    """Rectangle less openings and what lies under the foot, computed apart from the program."""
    s = pattern.settings
    area = s.width * s.height
    area -= sum(shapely.area(shapely.polygons(shape)) for shape in pattern.openings)
    if pattern.foot is not None:
        (u, v), hole = pattern.foot.T, shapely.union_all([shapely.polygons(shape) for shape in pattern.openings])
        ground = shapely.polygons([*pattern.foot, (u[-1], -1.0), (u[0], -1.0)])
        area -= float(((v[1:] + v[:-1]) / 2.0 * np.diff(u)).sum()) - shapely.area(shapely.intersection(ground, hole))
    return float(area)


def off_lines(pattern: Pattern) -> int:
    """Corners that could be on a course line and are not."""
    dressed = np.array([kind != "stone" for kind in pattern.kind])
    free = free_corners(pattern.subdivision, dressed)
    return int((~np.isin(pattern.subdivision.vertex[free, 1], pattern.lines)).sum())


def drawn_or_refused(wanted: PatternSettings) -> Pattern | str:
    try:
        return draw_pattern(wanted)
    except InputError as error:
        return str(error)


# ---- by hand


@pytest.mark.parametrize("c", [0.0, 0.25, 0.5, 1.0])
def test_a_corner_goes_its_share_of_the_way_to_the_nearest_line(c: float) -> None:
    # two stones over one: the corner where the three meet is free, those on the upright ends slide, the rest stay
    three = subdivide(
        [[0, 0], [2, 0], [2, 1.2], [1.1, 0.7], [0, 1.1], [0, 2], [1, 2], [2, 2]],
        [[0, 1, 2, 3, 4], [4, 3, 6, 5], [3, 2, 7, 6]],
    )
    assert free_corners(three, np.zeros(3, bool)).tolist() == [False, False, True, True, True, False, False, False]
    found = coursed(three, np.array([0.0, 1.0, 2.0]), c, np.zeros(3, bool))
    assert faults(found, 4.0) == []
    for u, v in ((0.0, 1.1), (1.1, 0.7), (2.0, 1.2)):
        assert (u, pytest.approx((1 - c) * v + c)) in [tuple(p) for p in found.vertex.tolist()]


def test_a_cell_that_lies_in_one_line_vanishes_between_its_neighbours() -> None:
    # a lens about v = 1 between a lower and an upper stone
    point = [[0, 0], [3, 0], [3, 2], [0, 2], [0, 1], [3, 1], [1, 1.0], [2, 1.0], [1.4, 0.8], [1.5, 1.3]]
    lens = subdivide(point, [[0, 1, 5, 7, 8, 6, 4], [6, 8, 7, 9], [4, 6, 9, 7, 5, 2, 3]])
    found = coursed(lens, np.array([0.0, 1.0, 2.0]), 1.0, np.zeros(3, bool))
    assert found.site.tolist() == [0, 2]
    assert faults(found, 6.0) == []
    assert found.areas().tolist() == [3.0, 3.0]
    assert len(found.vertex) == 6  # nothing is left of the corners on the line


def test_a_corner_that_would_pass_an_edge_takes_its_second_choice() -> None:
    # the edge from (0, 0) to (1, 0.6) ends at 0 and at 1; the corner over it at 0.8 must not end below it
    point = [[0, -1], [1, -1], [1, 2], [0, 2], [0, 0.05], [1, 0.6], [0.8, 0.495], [0.3, 1.3]]
    cells = subdivide(point, [[0, 1, 5, 4], [4, 5, 6], [4, 6, 7], [4, 7, 3], [5, 2, 3, 7, 6]])
    assert faults(cells, 3.0) == []
    for c in (0.25, 0.5, 0.75, 0.99, 1.0):
        assert faults(coursed(cells, np.array([-1.0, 0.0, 1.0, 2.0]), c, np.zeros(5, bool)), 3.0) == []


def test_joints_that_meet_on_a_level_bed_are_set_apart() -> None:
    point = [[0, 0], [1, 0], [2, 0], [0, 1.1], [1, 1.1], [2, 0.9], [0, 2], [1, 2], [2, 2]]
    plus = subdivide(point, [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
    assert len(plus.crossings()) == 1
    found = coursed(plus, np.array([0.0, 1.0, 2.0]), 1.0, np.zeros(4, bool))
    assert faults(found, 4.0) == []
    assert len(found.crossings()) == 0
    assert sorted(found.vertex[found.vertex[:, 1] == 1.0, 0]) == pytest.approx([0.0, 0.85, 1.15, 2.0])


@pytest.mark.parametrize("voussoirs", [3, 7, 15])
def test_area_of_a_semicircular_opening(voussoirs: int) -> None:
    opening = Opening(1.0, 0.8, 1.5, 0.2, "arch", voussoirs=voussoirs)
    sector = voussoirs * 0.4**2 * np.sin(np.pi / voussoirs) / 2.0
    assert shapely.area(shapely.polygons(clear_shape(opening))) == pytest.approx(0.8 * 1.1 + sector)
    stones = head_stones(opening)
    assert [kind for kind, _ in stones].count("keystone") == 1
    assert stones[voussoirs // 2][0] == "keystone"
    ring = sum(shapely.area(shapely.polygons(s)) for _, s in stones)
    assert ring == pytest.approx(voussoirs * (0.56**2 - 0.4**2) * np.sin(np.pi / voussoirs) / 2.0)


def test_an_arch_that_springs_from_its_sill_and_a_flat_one() -> None:
    assert len(clear_shape(Opening(1.0, 0.8, 0.4, 0.2, "arch", voussoirs=5))) == 6
    flat = Opening(1.0, 0.8, 1.0, 0.2, "arch", rise=0.1, voussoirs=5)
    radius = (0.4**2 + 0.1**2) / 0.2
    outer = np.array([s[3] for _, s in head_stones(flat)])
    assert np.hypot(*(outer - [1.4, 1.2 - radius]).T) == pytest.approx([radius + 0.16] * 5)


@pytest.mark.parametrize(("radius", "high"), [(10.0, 1), (-10.0, 0)])
def test_a_circular_foot(radius: float, high: int) -> None:
    line = foot_line(None, radius, 6.0, 24)
    assert line is not None
    sag = 10.0 - np.sqrt(100.0 - 9.0)
    assert line[12, 1] == pytest.approx(high * sag)
    assert line[0, 1] == pytest.approx((1 - high) * sag)


def test_joints_of_the_coping_keep_clear_of_the_quoins() -> None:
    stones = coping_stones(Coping(0.1, 0.5), 5.0, 2.0, np.array([0.5, 4.5]))
    joint = np.array([s[0, 0] for s in stones[1:]])
    assert np.abs(joint[:, None] - [0.5, 4.5]).min() >= 0.15 * 5.0 / len(stones)
    assert sum(shapely.area(shapely.polygons(s)) for s in stones) == pytest.approx(0.5)


def test_the_default_wall() -> None:
    pattern = draw_pattern()
    assert pattern.readout.cells == 40
    assert pattern.readout.culled == pattern.readout.merged == pattern.readout.crossings == 0
    assert faults(pattern.subdivision, 5.4) == []
    assert pattern.lines == pytest.approx([0.0, 0.36, 0.72, 1.08, 1.44, 1.8])
    areas = pattern.subdivision.areas()
    assert pattern.readout.area_cv == pytest.approx(areas.std() / areas.mean())


def test_level_courses_without_chance_are_running_bond() -> None:
    pattern = draw_pattern(
        PatternSettings(jitter=0.0, lloyd=0, size_grade=0.0, coursing=1.0, columns=4, rows=3, courses=3)
    )
    joints = []
    for row in range(3):
        cells = np.flatnonzero(pattern.course == row)
        assert len(cells) == 4
        low = [pattern.subdivision.ring(c)[:, 0].min() for c in cells]
        joints.append(np.sort(low)[1:] / 0.75)
    assert off_lines(pattern) == 0
    assert np.abs(joints[0][:, None] - joints[1]).min() > 0.2  # staggered by a share of a stone
    assert len(pattern.subdivision.crossings()) == 0


# ---- laws


@pytest.mark.parametrize("c", [0.0, 0.25, 0.5, 0.75, 1.0])
@pytest.mark.parametrize("base", [PatternSettings(), BIG, changed(BIG, openings=(WINDOW,), base_radius=9.0)])
def test_exact_cover_at_every_coursing(base: PatternSettings, c: float) -> None:
    pattern = draw_pattern(changed(base, coursing=c))
    assert faults(pattern.subdivision, wall_area(pattern)) == []
    assert abs(pattern.readout.coverage - 1.0) <= 1e-9
    assert len(pattern.kind) == len(pattern.course) == len(pattern.subdivision)
    assert pattern.readout.crossings == 0
    if c == 1.0:
        assert off_lines(pattern) <= 0.02 * len(pattern.subdivision.vertex)
        assert off_lines(pattern) == 0 or base is not PatternSettings()


walls = st.builds(
    PatternSettings,
    width=st.floats(1.0, 12.0), height=st.floats(1.0, 4.0), columns=st.integers(3, 14), rows=st.integers(2, 8),
    seed=st.integers(0, 10**6), jitter=st.sampled_from([0.0, 0.25, 0.5]), lloyd=st.integers(0, 2),
    coursing=st.sampled_from([0.0, 0.25, 0.5, 0.75, 0.99, 1.0]), courses=st.integers(2, 9),
    size_grade=st.sampled_from([0.0, 0.3, 2.0]), sliver=st.sampled_from([0.0, 0.18]),
    quoins=st.sampled_from([None, Quoins(0.3, 0.2), Quoins(0.25, 0.15, 0.3, right=False)]),
    coping=st.sampled_from([None, Coping(0.1, 0.4)]), base_radius=st.sampled_from([None, 60.0, -90.0]),
)  # fmt: skip


@given(walls)
@settings(max_examples=examples(70), deadline=None)
def test_every_wall_is_valid_or_refused_in_one_line(wanted: PatternSettings) -> None:
    pattern = drawn_or_refused(wanted)
    if isinstance(pattern, str):
        assert "\n" not in pattern
        assert pattern.startswith(("sliver:", "columns:", "base:"))
        return
    assert faults(pattern.subdivision, wall_area(pattern)) == []
    inradius = pattern.subdivision.inradii()
    stone = np.array([kind == "stone" for kind in pattern.kind])
    assert pattern.readout.cells == len(stone)
    assert np.all(inradius > 0.0)


@given(
    seed=st.integers(0, 10**6),
    coursing=st.sampled_from([0.0, 0.6, 1.0]),
    coping=st.sampled_from([None, Coping(0.15, 0.8)]),
)
@settings(max_examples=examples(15), deadline=None)
def test_dressed_stones_keep_their_shape(seed: int, coursing: float, coping: Coping | None) -> None:
    """On level ground quoins and coping stones are rectangles, however the field is levelled."""
    pattern = draw_pattern(
        PatternSettings(
            columns=6, rows=4, courses=4, seed=seed, coursing=coursing, coping=coping, quoins=Quoins(0.5, 0.2)
        )
    )
    for k, kind in enumerate(pattern.kind):
        if kind != "stone":
            run, rise = np.ptp(pattern.subdivision.ring(k), axis=0)
            assert pattern.subdivision.areas()[k] == pytest.approx(run * rise, rel=1e-9)
            assert kind == "coping" or run == pytest.approx(0.5) or run == pytest.approx(0.2)


def test_a_change_to_a_short_joint_covers_what_was_covered() -> None:
    """The kinks of round ground are no straight side along which a corner may slide, however near its neighbour is."""
    quoins = Quoins(0.25, 0.15, 0.3, right=False)
    pattern = draw_pattern(
        PatternSettings(
            width=1.0, height=1.0, columns=6, rows=7, seed=2, jitter=0.0, coursing=0.0, courses=2, size_grade=2.0,
            sliver=0.0, quoins=quoins, base_radius=60.0,
        )
    )  # fmt: skip
    assert abs(pattern.readout.coverage - 1.0) <= 1e-10


@given(seed=st.integers(0, 10**6), stretch=st.floats(0.5, 2.0))
@settings(max_examples=examples(10), deadline=None)
def test_a_stretched_wall_stretches_its_stones(seed: int, stretch: float) -> None:
    one = draw_pattern(PatternSettings(seed=seed, sliver=0.0))
    two = draw_pattern(PatternSettings(seed=seed, sliver=0.0, width=3.0 * stretch))
    assert two.subdivision.areas() == pytest.approx(one.subdivision.areas() * stretch, rel=1e-7)


@pytest.mark.parametrize("base", [PatternSettings(), changed(BIG, coursing=1.0)])
def test_same_seed_same_wall_to_the_bit(base: PatternSettings) -> None:
    one, two = draw_pattern(base), draw_pattern(base)
    for name in ("vertex", "start", "index", "site"):
        assert getattr(one.subdivision, name).tobytes() == getattr(two.subdivision, name).tobytes()
    assert one.readout == two.readout
    other = draw_pattern(changed(base, seed=base.seed + 1))
    assert one.subdivision.vertex.tobytes() != other.subdivision.vertex.tobytes()


def test_no_stone_is_thinner_than_asked_and_the_rest_is_drawn_again() -> None:
    rough = PatternSettings(columns=20, rows=12, courses=12, jitter=0.5, size_grade=1.5, lloyd=0)
    least = 0.18 * np.sqrt(5.4 / 240)
    assert draw_pattern(changed(rough, sliver=0.0)).subdivision.inradii().min() < least
    pattern = draw_pattern(rough)
    assert pattern.readout.culled > 0
    assert pattern.subdivision.inradii().min() >= least


def test_thin_pieces_beside_openings_join_a_neighbour() -> None:
    pattern = draw_pattern(BIG)
    stone = np.array([kind == "stone" for kind in pattern.kind])
    field = wall_area(pattern) - pattern.subdivision.areas()[~stone].sum()
    assert pattern.readout.merged == 1
    assert pattern.subdivision.inradii()[stone].min() >= 0.18 * np.sqrt(field / (14 * 7))


def test_relaxation_stays_clear_of_the_quoins() -> None:
    still = changed(BIG, openings=(), size_grade=0.0, coursing=0.0)
    cv = [draw_pattern(changed(still, lloyd=k)).readout.area_cv for k in (0, 6)]
    assert cv[1] < 0.75 * cv[0]


def test_coverage_is_measured_to_the_last_digits() -> None:
    pattern = draw_pattern(changed(BIG, openings=(WINDOW,), base_radius=-8.0, coursing=1.0))
    measured = pattern.subdivision.areas().sum() / wall_area(pattern)
    assert abs(measured - 1.0) > 1e-13  # the overlay's grid shows on the slopes of the foot
    assert pattern.readout.coverage == pytest.approx(measured, abs=1e-14)


def test_size_grading_spreads_the_sizes() -> None:
    cv = [
        draw_pattern(PatternSettings(columns=20, rows=12, courses=12, size_grade=g)).readout.area_cv
        for g in (0, 0.3, 1)
    ]
    assert cv[0] < 0.75 * cv[1] < 0.75 * cv[2]


@pytest.mark.parametrize("grade", [0.0, 0.3])
def test_relaxation_brings_stones_to_their_sizes(grade) -> None:
    """Shares from exp(-grade) to exp(grade), evenly on that scale: spread over mean is about grade / sqrt(3)."""
    cv = [
        draw_pattern(PatternSettings(columns=20, rows=12, courses=12, size_grade=grade, lloyd=k)).readout.area_cv
        for k in (0, 2, 8)
    ]
    assert cv[0] > 1.1 * cv[1] > 1.1 * cv[2]
    assert cv[2] == pytest.approx(grade / np.sqrt(3.0), abs=0.05)


def test_dressed_stones_keep_their_shape_and_openings_stay_clear() -> None:
    pattern = draw_pattern(changed(BIG, coursing=0.7))
    kinds = dict(zip(*np.unique(pattern.kind, return_counts=True), strict=True))
    assert kinds["lintel"] == 1
    assert kinds["keystone"] == 2
    assert kinds["quoin"] == 14
    for k, (kind, corner) in enumerate(part for opening in BIG.openings for part in head_stones(opening)):
        ring = pattern.subdivision.ring(pattern.kind.index("lintel") + k)
        assert pattern.kind[pattern.kind.index("lintel") + k] == kind
        assert {tuple(p) for p in corner.tolist()} <= {tuple(p) for p in ring.tolist()}
    lintel = pattern.subdivision.ring(pattern.kind.index("lintel"))
    assert lintel.min(axis=0) == pytest.approx([0.76, 1.0])
    assert lintel.max(axis=0) == pytest.approx([1.74, 1.14])
    for shape in pattern.openings:
        hole = shapely.polygons(shape)
        assert shapely.area(shapely.intersection(pattern.subdivision.polygons(), hole)).max() < 1e-9
    bed = pattern.subdivision.edge[(pattern.subdivision.side == pattern.kind.index("lintel")).any(axis=1)]
    under = pattern.subdivision.vertex[bed]
    bearing = under[(under[..., 1] == 1.0).all(axis=1)]
    left, right = bearing[bearing.mean(axis=1)[:, 0] < 0.9], bearing[bearing.mean(axis=1)[:, 0] > 1.6]
    assert np.ptp(left[..., 0], axis=1).sum() == pytest.approx(0.14)  # a fifth of the clear width rests on stone
    assert np.ptp(right[..., 0], axis=1).sum() == pytest.approx(0.14)


def test_ten_thousand_stones() -> None:
    """Or, for every change, two thousand."""
    columns, rows = (50, 40) if quick() else (125, 80)
    pattern = draw_pattern(PatternSettings(width=30, height=12, columns=columns, rows=rows, courses=rows, coursing=1.0))
    assert 0.99 * columns * rows <= pattern.readout.cells <= columns * rows
    assert faults(pattern.subdivision, 360.0) == []
    assert pattern.readout.crossings <= 10


@pytest.mark.parametrize(
    "base", [lambda u: 0.1 * u, [(0.0, 0.3), (1.0, 0.0), (3.0, 0.2)], lambda u: 0.1 * (1.0 + np.sin(5.0 * u))]
)
def test_the_foot_follows_its_line(base: Callable[[float], float]) -> None:
    pattern = draw_pattern(PatternSettings(base=base))
    assert pattern.foot is not None
    assert faults(pattern.subdivision, wall_area(pattern)) == []
    low = pattern.subdivision.vertex
    assert np.all(low[:, 1] >= np.interp(low[:, 0], *pattern.foot.T) - 1e-8)


def test_coincident_heights_and_grid_aligned_cells_are_coursed() -> None:
    site = np.stack(np.meshgrid(np.arange(6) + 0.5, np.arange(4) + 0.5), -1).reshape(-1, 2)
    cells = power_diagram(site, np.zeros(24), [0, 0], [6, 4])
    for lines in (np.linspace(0, 4, 5), np.linspace(0, 4, 4), np.linspace(0, 4, 9)):
        for c in (0.5, 1.0):
            assert faults(coursed(cells, lines, c, np.zeros(24, bool)), 24.0) == []


# ---- refusals


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"width": 0.0}, "width: must be more than 0"),
        ({"height": -1.0}, "height: must be more than 0"),
        ({"width": float("nan")}, "width: expected a finite number"),
        ({"columns": 0}, "columns: expected a whole number of at least 1"),
        ({"rows": 2.5}, "rows: expected a whole number"),
        ({"columns": 1, "rows": 2}, "columns: 1 x 2 rows makes 2 seeds; give at least 3"),
        ({"coursing": 1.1}, "coursing: must be between 0 and 1"),
        ({"coursing": -0.1}, "coursing: must be between 0 and 1"),
        ({"courses": 0}, "courses: expected"),
        ({"seed": -1}, "seed: expected"),
        ({"lloyd": -1}, "lloyd: expected"),
        ({"jitter": 0.6}, "jitter: must be between"),
        ({"size_grade": -0.1}, "size_grade: must not be negative"),
        ({"sliver": 0.9}, "sliver: 0.9 would cull"),
        ({"rows": 20, "courses": 5, "coursing": 1.0}, "20 rows do not fit into 5 level courses"),
        ({"openings": (Opening(2.5, 0.8, 1.0),)}, "outside the wall's 0 to 3 m"),
        ({"openings": (Opening(0.1, 0.8, 1.0),)}, "outside the wall"),
        ({"openings": (Opening(1.0, 0.8, 1.7),)}, "make it lower"),
        ({"openings": (Opening(0.5, 0.8, 1.0), Opening(1.0, 0.8, 0.5))}, "overlap or touch; leave stone"),
        ({"openings": (Opening(1.0, 0.8, 0.3),), "base_radius": 3.0}, "head in the ground"),
        (
            {"openings": (Opening(0.4, 2.2, 1.3, bearing=0.3),), "columns": 3, "rows": 2},
            "columns: openings and dressed stones leave",
        ),
        ({"coping": Coping(2.0)}, "coping height: 2 m leaves no wall"),
        ({"quoins": Quoins(1.6, 1.0)}, "quoins long: 1.6 m leaves no field"),
        ({"base": [(0.0, 0.0), (2.0, 0.1)]}, "base: the points must run"),
        ({"base": lambda u: -u}, "below 0"),
        ({"base": lambda u: u}, "base: the ground rises to 3 m"),
        ({"base": lambda u: 0.1, "base_radius": 9.0}, "not both"),
        ({"base_radius": 1.0}, "base_radius: 1 m is below half"),
    ],
)
def test_bad_settings(options: dict[str, object], word: str) -> None:
    with pytest.raises(InputError) as error:
        draw_pattern(PatternSettings(**options))  # type: ignore[arg-type]
    assert word in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"width": 0.0}, "opening width"),
        ({"height": -1.0}, "opening height"),
        ({"left": -1.0}, "opening left"),
        ({"head": "dome"}, "expected lintel or arch"),
        ({"head": "arch", "rise": 0.9}, "opening rise"),
        ({"head": "arch", "voussoirs": 4}, "leaves no keystone"),
        ({"bearing": 0.0}, "opening bearing"),
    ],
)
def test_bad_openings(options: dict[str, object], word: str) -> None:
    with pytest.raises(InputError, match=word):
        Opening(**({"left": 1.0, "width": 1.0, "height": 1.0} | options))  # type: ignore[arg-type]


def test_bad_ends() -> None:
    with pytest.raises(InputError, match="exchange them"):
        Quoins(0.2, 0.4)
    with pytest.raises(InputError, match="neither end"):
        Quoins(left=False, right=False)
    with pytest.raises(InputError, match="coping length"):
        Coping(0.1, 0.0)
