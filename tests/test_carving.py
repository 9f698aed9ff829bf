"""Carve-back: what stays, what comes off, where it is cut.

By hand: a cube of edge a about the middle of a cell of edge 1 loses 1 - 1/a^3; shifted by half its edge a cube of 1
loses half of itself on one cut of area 1, 0.5 m deep. Laws: carved and offcuts make the stone; areas of a closed
surface cancel; nothing depends on how the stone's file lies.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from carving_cases import CORNERS, box, pebble, prism, rotation, stone_like
from cyclopean.assembly import Block
from cyclopean.design.carving.carve import BALANCE, LEAST, carve, carve_all, total
from cyclopean.design.stones.stone import stone_of
from cyclopean.errors import InputError
from cyclopean.geometry import mass_properties, mesh_faults, pack
from cyclopean.geometry.solids import CUBE, difference, mesh_of, solid_of
from laws import examples

STAY = np.eye(3), np.zeros(3)
ROUNDING = 1e-12


def adds_up(found):
    """Both ways, from the meshes themselves."""
    pieces = [found.volume, *(piece.volume for piece in found.offcuts)]
    assert sum(pieces) == pytest.approx(found.stone_volume, rel=BALANCE)
    assert found.imbalance <= BALANCE
    for solid in (found, *found.offcuts):
        if len(solid.triangles):
            measured = mass_properties(pack([(solid.vertices, solid.triangles)])).volume[0]
            assert solid.volume == pytest.approx(measured, rel=1e-9)
            assert not mesh_faults(pack([(solid.vertices, solid.triangles)]))


@pytest.mark.parametrize("edge", [1.0, 1.1, 2.0])
def test_an_oversize_cube_by_hand(edge):
    found = carve(stone_like(box(), edge), box(), *STAY)
    assert found.carved_share == pytest.approx(1.0 - edge**-3, abs=ROUNDING)
    assert found.gap_share == pytest.approx(0.0, abs=ROUNDING)
    if edge == 1.0:  # identical stock: nothing is cut
        assert (found.cuts, found.offcuts) == ((), ())
        return
    assert [cut.area for cut in found.cuts] == pytest.approx([1.0] * 6)
    assert [cut.depth for cut in found.cuts] == pytest.approx([(edge - 1.0) / 2.0] * 6)
    assert [angle for cut in found.cuts for _, angle in cut.beside] == pytest.approx([90.0] * 24)
    assert all(len(cut.beside) == 4 for cut in found.cuts)
    (shell,) = found.offcuts  # one piece, hollow
    assert shell.volume == pytest.approx(edge**3 - 1.0)
    adds_up(found)


def test_ten_per_cent_oversize_is_0_2487():
    assert carve(stone_like(box(), 1.1), box(), *STAY).carved_share == pytest.approx(0.2487, abs=1e-4)


def test_a_cube_half_aside_by_hand():
    """One cut of 1 m2; what stays has x <= 0.5 in the stone's frame, whatever the frame of the wall."""
    found = carve(stone_like(box()), box(low=(10.0, 0.0, 0.0)), np.eye(3), [10.5, 0.0, 0.0])
    (cut,) = found.cuts
    assert (cut.area, cut.depth, cut.offset) == pytest.approx((1.0, 0.5, 0.5))
    assert cut.normal == pytest.approx([1.0, 0.0, 0.0])
    assert (cut.dressing, cut.beside, cut.to_flat) == (False, (), None)
    assert found.carved_share == pytest.approx(0.5)
    assert found.gap_share == pytest.approx(0.5)
    assert int((found.label == 0).sum()) > 0
    adds_up(found)


def test_angles_to_the_longest_axis_and_to_flat_faces_by_hand():
    """A bar along x, cut square across by a plane x <= 1, then by one that leans 30 degrees from it."""
    bar = stone_like(box((4.0, 1.0, 0.8)), name="bar")
    square = carve(bar, box((3.0, 4.0, 4.0), (-2.0, -2.0, -2.0)), *STAY, flat=[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    (cut,) = square.cuts
    assert (cut.to_axis, cut.to_flat) == pytest.approx((90.0, 0.0))
    lean = np.tan(np.radians(30.0))
    outline = [(-1.0, -2.0), (2.0 - 2.0 * lean, -2.0), (2.0 + 2.0 * lean, 2.0), (-1.0, 2.0)]
    (cut,) = carve(bar, prism(outline, 1.0), *STAY, flat=[[1.0, 0.0, 0.0]]).cuts
    assert (cut.to_axis, cut.to_flat) == pytest.approx((60.0, 30.0))
    assert cut.normal == pytest.approx([np.cos(np.radians(30.0)), 0.0, -0.5])


def test_a_cell_that_is_not_convex_has_a_hollow_edge():
    """An L: its re-entrant corner is cut 270 degrees round; a fan from its third corner would fold over itself."""
    cell = prism([(2, 1), (1, 1), (1, 2), (0, 2), (0, 0), (2, 0)], 1.0)
    found = carve(stone_like(box((2.0, 1.0, 2.0))), cell, *STAY)
    assert found.volume == pytest.approx(3.0)
    assert [cut.area for cut in found.cuts] == pytest.approx([1.0, 1.0])
    assert [cut.beside[0][1] for cut in found.cuts] == pytest.approx([270.0, 270.0])
    assert [cut.depth for cut in found.cuts] == pytest.approx([1.0, 1.0])
    adds_up(found)


def test_what_is_too_small_to_cut_is_dressing_and_the_solid_stays_exact():
    """A brick 1 mm too long at one end, and 50 mm at the other."""
    stone = stone_like(box((1.051, 1.0, 1.0)), name="brick")
    cell = box((1.0, 1.0, 1.0), (0.001, 0.0, 0.0))
    found = carve(stone, cell, *STAY)
    assert sorted((round(1e3 * cut.depth), cut.dressing) for cut in found.cuts) == [(1, True), (50, False)]
    assert [piece.dressing for piece in found.offcuts] == [False, True]
    assert found.volume == pytest.approx(1.0, rel=ROUNDING)
    assert total([found]).dressing == pytest.approx(0.001)
    assert all(not cut.dressing for cut in carve(stone, cell, *STAY, least=0.0005).cuts)
    assert 0.001 < LEAST < 0.05


def test_depth_is_of_what_comes_off_at_the_cut():
    """An L-shaped stone with an arm too thick by 0.1 m; its other arm reaches 2 m beyond the plane of the cut."""
    stone = stone_like(prism([(0, 0), (3, 0), (3, 1), (1.1, 1), (1.1, 2), (0, 2)], 1.0), name="L")
    cell = prism([(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2)], 1.0)
    one, two = carve(stone, cell, *STAY).cuts
    assert (one.area, one.depth, two.area, two.depth) == pytest.approx((1.0, 0.1, 0.1, 1.0))


def test_depth_is_not_of_a_piece_that_comes_off_elsewhere():
    """A mushroom: its cap, on a stem through the top, reaches 2 m beyond the side on which 0.1 m is cut."""
    outline = [
        (0, 0),
        (1.1, 0),
        (1.1, 1),
        (0.6, 1),
        (0.6, 1.5),
        (3, 1.5),
        (3, 2),
        (0, 2),
        (0, 1.5),
        (0.4, 1.5),
        (0.4, 1),
    ]
    found = carve(stone_like(prism([*outline, (0, 1)], 1.0), name="mushroom"), box(), *STAY)
    side, top = found.cuts
    assert (side.area, side.depth, top.area, top.depth) == pytest.approx((1.0, 0.1, 0.2, 1.0))
    assert [piece.reach for piece in found.offcuts] == pytest.approx([1.0, 0.1])


@pytest.mark.parametrize("seed", range(8))
def test_faces_that_are_flush_but_for_rounding_are_not_cut(seed):
    """A beam in a cell of its own section: two cuts, at its ends, however both are turned."""
    rng = np.random.default_rng(seed)
    turn, move = rotation(rng), rng.normal(size=3)
    cell = box(low=(0.3, 0.0, 0.0))
    turned = Block("cell", cell.vertices @ turn.T + move, cell.faces)
    found = carve(stone_like(box((1.6, 1.0, 1.0)), name="beam"), turned, turn, move)
    assert [cut.area for cut in found.cuts] == pytest.approx([1.0, 1.0])
    assert [cut.depth for cut in found.cuts] == pytest.approx([0.3, 0.3])
    assert found.carved_share == pytest.approx(0.6 / 1.6)


def test_a_rotation_with_the_rounding_of_a_file_is_set_right():
    blurred = rotation(np.random.default_rng(1)) + 2e-10 * np.ones((3, 3))
    found = carve(stone_like(box()), box((3.0, 3.0, 3.0), (-1.5, -1.5, -1.5)), blurred, np.zeros(3))
    assert found.imbalance < 1e-13
    assert found.rotation @ found.rotation.T == pytest.approx(np.eye(3), abs=1e-14)


def test_a_stone_that_falls_apart_keeps_its_largest_piece():
    """A U upside down: its legs, of 1 and 0.5 m, reach into the cell."""
    stone = stone_like(prism([(0, 0), (1, 0), (1, 2), (2, 2), (2, 0), (2.5, 0), (2.5, 3), (0, 3)], 1.0), name="U")
    found = carve(stone, box((4.0, 1.0, 1.0)), *STAY)
    assert found.volume == pytest.approx(1.0)
    (lost,) = [piece for piece in found.offcuts if piece.lost]
    assert (lost.volume, lost.dressing) == (pytest.approx(0.5), False)
    assert found.notes == ("stone 'U' falls apart in cell 'cell': a piece of 500 L in all come off too",)
    assert found.carved_share == pytest.approx(1.0 - 1.0 / stone.volume)
    adds_up(found)


def test_a_hollow_stone_keeps_its_cavity():
    shell = difference(solid_of(3.0 * CORNERS, CUBE), solid_of(1.0 + CORNERS, CUBE))
    found = carve(stone_of("shell", *mesh_of(shell)), box((3.0, 3.0, 2.5)), *STAY)
    assert found.stone_volume == pytest.approx(26.0)
    assert found.volume == pytest.approx(3.0 * 3.0 * 2.5 - 1.0)
    adds_up(found)


def test_nothing_left():
    found = carve(stone_like(box()), box(low=(5.0, 0.0, 0.0)), *STAY)
    assert (found.carved_share, found.gap_share, found.cuts, len(found.triangles)) == (1.0, 1.0, (), 0)
    assert found.notes == ("stone 'cell' does not reach cell 'cell': nothing of it is left there",)
    assert len(found.offcuts) == 1
    adds_up(found)


def test_total_weighs_by_volume():
    rows = [carve(stone_like(box(), 2.0), box(), *STAY), carve(stone_like(box()), box(), *STAY)]
    whole = total(rows)
    assert whole.imposition == pytest.approx(7.0 / 9.0)
    assert whole.gap == pytest.approx(0.0, abs=ROUNDING)
    assert total([]).imposition == 0.0


@settings(max_examples=examples(40), deadline=None)
@given(st.integers(0, 2**32))
def test_volumes_areas_and_planes(seed):
    """What is kept and what comes off make the stone; cuts close its surface, lie on their planes and face outwards."""
    rng = np.random.default_rng(seed)
    stone, turn, shift = pebble(rng), rotation(rng), rng.normal(size=3)
    cell = box(rng.uniform(0.5, 2.0, 3), turn @ stone.centroid + shift + rng.uniform(-1.5, 0.0, 3))
    found = carve(stone, cell, turn, shift)
    adds_up(found)
    assert 0.0 <= found.carved_share <= 1.0
    assert 0.0 <= found.gap_share <= 1.0
    if not len(found.triangles):
        return
    corner = found.vertices[found.triangles]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2.0
    sawn = sum((cut.area * (turn @ cut.normal) for cut in found.cuts), np.zeros(3))
    assert area[found.label < 0].sum(axis=0) + sawn == pytest.approx(np.zeros(3), abs=1e-9)
    back = (found.vertices - shift) @ turn  # in the stone's frame
    for k, cut in enumerate(found.cuts):
        height = back @ cut.normal - cut.offset
        assert height.max() <= 1e-9  # the cell is convex: all that stays is on this side
        assert np.abs(height[found.triangles[found.label == k]]).max() <= 1e-9
        assert area[found.label == k].sum(axis=0) @ turn == pytest.approx(cut.area * cut.normal, abs=1e-9)
        beyond = (stone.vertices @ cut.normal - cut.offset).max()
        assert 0.0 < cut.depth <= beyond + 1e-9
        assert all((k, angle) in found.cuts[other].beside for other, angle in cut.beside)


@settings(max_examples=examples(25), deadline=None)
@given(st.integers(0, 2**32))
def test_nothing_depends_on_how_the_file_lies(seed):
    """The stone's file turned and moved, and wall and stone turned and moved together."""
    rng = np.random.default_rng(seed)
    stone, turn = pebble(rng), rotation(rng)
    cell = box((1.0, 0.8, 0.9))
    shift = cell.vertices.mean(axis=0) - turn @ stone.centroid + rng.normal(size=3) / 5.0
    found = carve(stone, cell, turn, shift)
    again, move = rotation(rng), 50.0 * rng.normal(size=3)
    other = stone_of("pebble", stone.vertices @ again.T + move, stone.triangles)  # x' = again x + move
    same = carve(other, cell, turn @ again.T, shift - turn @ again.T @ move)
    assert same.volume == pytest.approx(found.volume, rel=1e-9)
    assert [cut.area for cut in same.cuts] == pytest.approx([cut.area for cut in found.cuts], abs=1e-9)
    assert [cut.depth for cut in same.cuts] == pytest.approx([cut.depth for cut in found.cuts], abs=1e-9)
    assert [cut.to_axis for cut in same.cuts] == pytest.approx([cut.to_axis for cut in found.cuts], abs=1e-6)
    for one, two in zip(found.cuts, same.cuts, strict=True):
        assert two.normal == pytest.approx(again @ one.normal, abs=1e-9)
        assert two.offset == pytest.approx(one.offset + two.normal @ move, abs=1e-9)


@settings(max_examples=examples(20), deadline=None)
@given(st.floats(1.0, 3.0), st.integers(0, 2**32))
def test_the_oversize_law(scale, seed):
    """A stone that is its cell, larger by a factor about the same middle, loses 1 - 1 / factor^3."""
    rng = np.random.default_rng(seed)
    cell = pebble(rng, 12)
    block = Block("cell", cell.vertices, tuple(map(tuple, cell.triangles.tolist())))
    found = carve(stone_like(block, scale), block, *STAY)
    assert found.carved_share == pytest.approx(1.0 - scale**-3, abs=1e-9)
    assert found.gap_share == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("turn", "shift", "least", "message"),
    [
        (np.diag([1.0, 1.0, -1.0]), np.zeros(3), LEAST, "its rotation is not one: a mirror, a scale or a shear"),
        (1.1 * np.eye(3), np.zeros(3), LEAST, "its rotation is not one"),
        (np.eye(3), [np.nan, 0.0, 0.0], LEAST, "shift"),
        (np.eye(3), np.zeros(3), -1e-3, "least cut: -0.001 m must be a length of at least 0 m"),
        (np.eye(3), np.zeros(3), np.nan, "least cut: nan m"),
    ],
)
def test_refused(turn, shift, least, message):
    with pytest.raises(InputError, match=message):
        carve(stone_like(box()), box(), turn, shift, least=least)


def test_meshes_that_are_no_solids_are_refused_by_name():
    stone = stone_like(box(), name="whole")
    open_cell = Block("open", CORNERS, CUBE[:-1])
    with pytest.raises(InputError, match="cell 'open': is open"):
        carve(stone, open_cell, *STAY)
    broken = stone_of("cracked", stone.vertices, stone.triangles[1:])
    with pytest.raises(InputError, match="stone 'cracked': is open"):
        carve(broken, box(), *STAY)


def test_a_stone_that_crosses_itself_is_refused():
    """Two cubes that overlap, in one mesh: what both hold would count twice."""
    vertices, triangles = mesh_of(solid_of(CORNERS, CUBE))
    twice = stone_of("twice", np.concatenate([vertices, vertices + 0.5]), np.concatenate([triangles, triangles + 8]))
    with pytest.raises(InputError, match=r"stone 'twice' in cell 'cell': the parts differ .* does a mesh cross itself"):
        carve(twice, box((3.0, 3.0, 0.75)), *STAY)


@pytest.mark.skipif("CYCLOPEAN_STONES" not in os.environ, reason="CYCLOPEAN_STONES names no folder of scans")
def test_real_scans_add_up():
    """Every scan against cells of four kinds, turned at random: carved and offcuts make the stone."""
    from cyclopean.io.stones import read_stones

    inventory, _ = read_stones(Path(os.environ["CYCLOPEAN_STONES"]), "m", cache=False)
    rng = np.random.default_rng(5)
    hollow = prism([(0, 0), (0.6, 0), (0.6, 0.3), (0.3, 0.3), (0.3, 0.6), (0, 0.6)], 0.5)
    skew = prism([(0, 0), (0.8, 0.1), (0.7, 0.5), (0.1, 0.6)], 0.3)
    cells = [box((0.5, 0.3, 0.4)), box((1.5, 0.2, 0.3)), skew, hollow]

    def placed(cell):
        for stone in inventory.stones:
            turn = rotation(rng)
            yield stone, cell, turn, cell.vertices.mean(axis=0) - turn @ stone.centroid

    found = [*carve_all(placed(cells[0])), *(carve(*each) for cell in cells[1:] for each in placed(cell))]
    for one in found:
        adds_up(one)
    assert any(cut.to_flat for one in found[: len(inventory)] for cut in one.cuts)
    assert len(found) == len(cells) * len(inventory)
    assert total(found).imbalance < 1e-12
