"""Contacts found from meshes.

By hand: two boxes that overlap in plan by w x d touch in a rectangle of area w d; in running bond of n columns and
n courses on a slab, every joint between courses has one patch per interval between the cuts of both courses, so 3, 5,
8, 10, 15, 20 columns and courses give 22, 67, 180, 285, 652, 1170 patches; a plate 4 x 4 with a hole 2 x 2 stands on
16 - 4 = 12 m2; a 48-sided prism in a half-round groove touches along 24 facets.
"""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cyclopean.assembly import Assembly, Block, detect, length_tolerance
from cyclopean.assembly.precision import local_mesh
from cyclopean.errors import InputError
from cyclopean.geometry import box_pairs, convex_bodies, pack, penetration_depths, planar_regions
from laws import examples

ROUNDING = 1e-12  # relative: a handful of roundings in a frame change


SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def box(name, low, high):
    (x, y, z), (X, Y, Z) = low, high
    corners = [[x, y, z], [X, y, z], [X, Y, z], [x, Y, z], [x, y, Z], [X, y, Z], [X, Y, Z], [x, Y, Z]]
    return Block(name, np.array(corners, float), SIDES)


def wall(columns, courses):
    """Running bond of blocks 2 x 1 x 1 on a slab; odd courses start and end with half blocks."""
    blocks = [box("slab", (0, 0, -1), (2 * columns, 1, 0))]
    for course in range(courses):
        cuts = [0, *range(1, 2 * columns, 2), 2 * columns] if course % 2 else range(0, 2 * columns + 1, 2)
        blocks += [box(f"{course}.{x}", (x, 0, course), (X, 1, course + 1)) for x, X in pairwise(cuts)]
    return Assembly(tuple(blocks))


def prism(name, outline, y=0.0, depth=1.0):
    """Extrude a counter-clockwise outline in (x, z), any shape, along +y."""
    n = len(outline)
    vertices = [[x, y, z] for x, z in outline] + [[x, y + depth, z] for x, z in outline]
    sides = [(i, i + n, (i + 1) % n + n, (i + 1) % n) for i in range(n)]
    return Block(name, np.array(vertices, float), (tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *sides))


def holed_plate(name, z=0.0):
    """A plate 4 x 4 x 1 with a square hole 2 x 2 in the middle, every flat ring as four trapezoids."""
    square = np.array([[0, 0], [4, 0], [4, 4], [0, 4]], float)
    inner = np.array([[1, 1], [3, 1], [3, 3], [1, 3]], float)
    rings = [np.column_stack([r, np.full(4, h)]) for h in (z, z + 1) for r in (square, inner)]
    faces = []
    for k in range(4):
        m = (k + 1) % 4
        faces += [
            (m, k, 4 + k, 4 + m),
            (8 + k, 8 + m, 12 + m, 12 + k),
            (k, m, 8 + m, 8 + k),
            (4 + m, 4 + k, 12 + k, 12 + m),
        ]
    return Block(name, np.concatenate(rings), tuple(faces))


def two_in_one(name, here, there):
    """Two separate unit cubes in one mesh: convex at every edge, but no convex body."""
    cube = box(name, (0, 0, 0), (1, 1, 1))
    second = tuple(tuple(i + 8 for i in face) for face in cube.faces)
    return Block(name, np.concatenate([cube.vertices + here, cube.vertices + there]), (*cube.faces, *second))


def triangulated(block, turn=0):
    """Fan triangles of convex faces, each fan from corner `turn`."""
    faces = []
    for face in block.faces:
        first = turn % len(face)
        face = face[first:] + face[:first]
        faces += [(face[0], face[k], face[k + 1]) for k in range(1, len(face) - 1)]
    return Block(block.id, block.vertices, tuple(faces))


def moved(model, scale=1.0, turn=None, shift=(0.0, 0.0, 0.0)):
    turn = np.eye(3) if turn is None else turn
    return Assembly(tuple(Block(b.id, scale * b.vertices @ turn.T + shift, b.faces) for b in model.blocks))


def colliding(model, tolerance):
    """Ids of all pairs that run into each other, listed without the limit that warnings have."""
    mesh, _ = local_mesh(model)
    regions = planar_regions(mesh, tolerance)
    low, high = (np.array([f(b.vertices, axis=0) for b in model.blocks]) for f in (np.min, np.max))
    i, j = box_pairs(low, high, tolerance)
    depth = penetration_depths(mesh, regions, convex_bodies(regions), (i, j), tolerance)
    return [(model.blocks[i[k]].id, model.blocks[j[k]].id) for k in np.flatnonzero(depth > 0)]


def rotation(seed):
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


def pair_areas(model, found, scale=1.0):
    """{(id, id): (patches, total area)}: what no change of frame, order or triangulation may alter."""
    table = {}
    for a, b, area in zip(found.contacts.a, found.contacts.b, found.contacts.area, strict=True):
        key = tuple(sorted((model.blocks[a].id, model.blocks[b].id)))
        count, total = table.get(key, (0, 0.0))
        table[key] = (count + 1, total + area / scale**2)
    return table


def assert_same(one, other, relative):
    assert {k: n for k, (n, _) in one.items()} == {k: n for k, (n, _) in other.items()}
    for key, (_, area) in one.items():
        assert other[key][1] == pytest.approx(area, rel=relative)


def zoo():
    """One of everything: L on a slab, cube in its nook, U with a tongue in it, holed plate, cradle and roller."""
    angle = np.linspace(np.pi, 2 * np.pi, 25)
    groove = np.column_stack([30 + np.cos(angle), 2 + np.sin(angle)])
    rim = 2 * np.pi * np.arange(48) / 48
    return Assembly(
        (
            box("slab", (-2, -2, -1), (40, 6, 0)),
            prism("L", [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]),
            box("nook", (1, 0, 1), (2, 1, 2)),
            prism("U", [(10, 0), (13, 0), (13, 2), (12, 2), (12, 1), (11, 1), (11, 2), (10, 2)]),
            box("tongue", (11, 0.25, 1), (12, 0.75, 3)),
            moved(Assembly((holed_plate("ring"),)), shift=(20, 0, 0)).blocks[0],
            prism("cradle", [(28.5, 0), (31.5, 0), (31.5, 2), *groove[::-1].tolist(), (28.5, 2)]),
            prism("roller", np.column_stack([30 + np.cos(rim), 2 + np.sin(rim)]).tolist(), y=0.2, depth=0.5),
        )
    )


# -- by hand ----------------------------------------------------------------------------------------------------------


def test_two_offset_cubes_touch_in_the_overlap_of_their_faces():
    found = detect(Assembly((box("low", (0, 0, 0), (1, 1, 1)), box("high", (0.25, 0.5, 1), (1.25, 1.5, 2)))))
    contacts = found.contacts
    assert (contacts.a.tolist(), contacts.b.tolist()) == ([0], [1])
    np.testing.assert_allclose(
        contacts.polygon(0), [[0.25, 0.5, 1], [1, 0.5, 1], [1, 1, 1], [0.25, 1, 1]], atol=ROUNDING
    )
    np.testing.assert_allclose(contacts.frame[0, 0], [0, 0, 1], atol=ROUNDING)
    assert np.isnan(contacts.mu).all()
    assert found.touching_nothing == ()
    assert found.warnings == ()


def test_the_normal_points_from_the_lower_index_into_the_higher():
    upper_first = detect(Assembly((box("high", (0, 0, 1), (1, 1, 2)), box("low", (0, 0, 0), (1, 1, 1))))).contacts
    np.testing.assert_allclose(upper_first.frame[0, 0], [0, 0, -1], atol=ROUNDING)


@pytest.mark.parametrize(("n", "count"), [(3, 22), (5, 67), (8, 180), (10, 285), (15, 652), (20, 1170)])
def test_running_bond_has_every_joint(n, count):
    found = detect(wall(n, n))
    assert len(found.contacts) == count
    assert found.contacts.area.sum() == pytest.approx(2 * n * n + (n - 1) * n + n // 2, rel=ROUNDING)  # beds, heads
    assert found.warnings == ()


def test_t_junction_and_order():
    """A long box on two short ones: two patches, sorted by place; the short ones touch each other too."""
    model = Assembly(
        (box("l", (0, 0, 0), (1, 1, 1)), box("r", (1, 0, 0), (3, 1, 1)), box("t", (0.5, 0, 1), (2.5, 1, 2)))
    )
    contacts = detect(model).contacts
    assert list(zip(contacts.a.tolist(), contacts.b.tolist(), strict=True)) == [(0, 1), (0, 2), (1, 2)]
    assert contacts.area.tolist() == pytest.approx([1.0, 0.5, 1.5], rel=ROUNDING)
    assert contacts.point[contacts.start[:-1]].tolist() == [[1, 0, 0], [0.5, 0, 1], [1, 0, 1]]  # the least point leads


def test_concave_blocks_touch_in_several_places():
    found = detect(zoo())
    names = [b.id for b in zoo().blocks]
    table = pair_areas(zoo(), found)
    by_hand = {
        ("L", "slab"): (1, 2.0),
        ("L", "nook"): (2, 2.0),
        ("U", "slab"): (1, 3.0),
        ("U", "tongue"): (3, 1.5),  # bottom and two cheeks
        ("ring", "slab"): (2, 12.0),  # cut once through the hole
        ("cradle", "slab"): (1, 3.0),
        ("cradle", "roller"): (24, 24 * 0.5 * 2 * np.sin(np.pi / 48)),
    }
    assert_same(table, by_hand, ROUNDING * 10)
    assert found.warnings == ()
    assert names[2] == "nook"


def test_an_overlap_with_a_hole_keeps_out_of_it():
    found = detect(Assembly((box("slab", (-1, -1, -1), (5, 5, 0)), holed_plate("plate"))))
    contacts = found.contacts
    assert contacts.area.sum() == pytest.approx(12.0, rel=ROUNDING)
    x, y = contacts.point[:, 0], contacts.point[:, 1]
    assert not np.any((x > 1 + 1e-9) & (x < 3 - 1e-9) & (y > 1 + 1e-9) & (y < 3 - 1e-9))
    assert np.diff(contacts.start).tolist() == [8, 8]


def test_a_block_that_covers_the_hole_touches_only_the_rim():
    found = detect(Assembly((holed_plate("plate"), box("lid", (0.5, 0.5, 1), (3.5, 3.5, 2)))))
    assert found.contacts.area.sum() == pytest.approx(9.0 - 4.0, rel=ROUNDING)


def test_a_non_convex_overlap_stays_one_polygon():
    angle = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
    flat = prism("L", angle)  # an L lying on its side: its outline touches the plate behind it
    contacts = detect(Assembly((flat, box("plate", (-1, 1, -1), (4, 2, 4))))).contacts
    assert len(contacts) == 1
    assert len(contacts.polygon(0)) == 6
    assert contacts.area[0] == pytest.approx(5.0, rel=ROUNDING)


def test_triangles_are_merged_into_one_patch_without_needless_points():
    cube, base = box("cube", (0, 0, 0), (1, 1, 1)), triangulated(box("base", (-1, -1, -1), (2, 2, 0)))
    contacts = detect(Assembly((base, triangulated(cube, 1)))).contacts
    assert len(contacts) == 1
    assert len(contacts.point) == 4


def test_points_on_a_straight_edge_are_dropped():
    split = prism("p", [(0, 0), (0.5, 0), (1, 0), (1, 1), (0.75, 1), (0.25, 1), (0, 1)])
    model = Assembly((split, box("plate", (-1, 1, -1), (4, 2, 4))))
    assert len(detect(model).contacts.point) == 4
    assert len(detect(moved(model, turn=rotation(6), shift=(1e4, 0, 0))).contacts.point) == 4


@pytest.mark.parametrize(("width", "count"), [(0.5, 0), (3.0, 1)])
def test_strips_narrower_than_the_tolerance_are_dropped(width, count):
    model = Assembly((box("p", (0, 0, 0), (1, 1, 1)), box("q", (1 - 1e-4 * width, 0, 1), (2, 1, 2))))
    assert len(detect(model, 1e-4).contacts) == count
    assert len(detect(moved(model, turn=rotation(5)), 1e-4).contacts) == count


@pytest.mark.parametrize("corner", [(1.0, 1.0, 0.0), (1.0, 1.0, 1.0), (1.0 - 1e-7, 1.0, 0.0)])
def test_touching_along_an_edge_or_in_a_corner_is_no_contact(corner):
    far = tuple(c + 1.0 for c in corner)
    found = detect(Assembly((box("p", (0, 0, 0), (1, 1, 1)), box("q", corner, far))))
    assert len(found.contacts) == 0
    assert found.touching_nothing == (0, 1)
    assert len(found.warnings) == 2
    assert "'p'" in found.warnings[0]


def test_gap_beyond_the_tolerance_is_no_contact():
    def gap(height, tolerance=None):
        model = Assembly((box("p", (0, 0, 0), (1, 1, 1)), box("q", (0, 0, 1 + height), (1, 1, 2 + height))))
        return detect(model, tolerance)

    tolerance = length_tolerance(Assembly((box("p", (0, 0, 0), (1, 1, 1)), box("q", (0, 0, 1), (1, 1, 2)))))
    assert tolerance == pytest.approx(1e-6 * np.sqrt(6.0))
    assert len(gap(0.9 * tolerance).contacts) == 1
    assert len(gap(1.1 * tolerance).contacts) == 0
    assert len(gap(-0.9 * tolerance).contacts) == 1
    assert len(gap(5e-4, 1e-3).contacts) == 1
    touching = gap(0.8e-3, 1e-3).contacts
    np.testing.assert_allclose(touching.point[:, 2], 1 + 0.4e-3, atol=ROUNDING)  # midway


def test_tilted_faces_touch_only_if_they_stay_within_the_tolerance():
    def tilted(angle):
        c, s = np.cos(angle), np.sin(angle)
        top = box("q", (0, 0, 0), (1, 1, 1))
        turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
        return detect(Assembly((box("p", (0, 0, -1), (1, 1, 0)), Block("q", top.vertices @ turn.T, top.faces))), 1e-4)

    assert len(tilted(0.9e-4).contacts) == 1
    assert len(tilted(1.5e-4).contacts) == 0


def test_a_slab_does_not_coarsen_the_tolerance_and_an_offset_does_not_matter():
    pebbles = [box(f"s{i}", (i, 0, 0), (i + 0.1, 0.1, 0.1)) for i in range(3)]
    model = Assembly((box("slab", (-1e4, -1e4, -1), (1e4, 1e4, 0)), *pebbles))
    assert length_tolerance(model) == pytest.approx(1e-4 * 0.1 * np.sqrt(3))
    assert len(detect(model).contacts) == 3
    assert length_tolerance(moved(model, shift=(1e4, 1e4, 1e4))) == pytest.approx(length_tolerance(model), rel=1e-9)


def test_faces_that_are_not_flat_are_triangulated():
    """A cube whose top is bent along a diagonal carries a wedge on one of its two triangles."""
    cube = box("cube", (0, 0, 0), (1, 1, 1))
    vertices = cube.vertices.copy()
    vertices[6, 2] = 1.5  # top corner (1, 1); the fan of face (4, 5, 6, 7) runs along 4-6
    bent = Block("cube", vertices, cube.faces)
    a, b, c = vertices[[4, 5, 6]]
    wedge = Block("wedge", np.array([a, b, c, np.add(b, [0, 0, 2])]), ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)))
    contacts = detect(Assembly((bent, wedge))).contacts
    assert len(contacts) == 1
    assert contacts.area[0] == pytest.approx(np.linalg.norm(np.cross(b - a, c - a)) / 2, rel=ROUNDING)


def test_a_face_drawn_round_a_hole_and_slivers_become_clean_regions():
    """A seam from rim to hole vanishes; a sliver on an edge between two planes joins one of them only."""
    outer, inner = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], [[1, 1, 0], [1, 3, 0], [3, 3, 0], [3, 1, 0]]
    seam = pack([(np.array(outer + inner, float), [(0, 1, 2, 3, 0, 4, 5, 6, 7, 4)])])
    regions = planar_regions(seam, 1e-6)
    assert np.diff(regions.ring_start).tolist() == [2]
    assert np.diff(regions.corner_start).tolist() == [4, 4]
    assert regions.vertex[regions.corner[:4]].max() == 4.0  # the rim first
    assert regions.area.tolist() == [12.0]
    folded = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 1], [0, 0, 1], [0.5, 0, 0]], float)
    faces = [(0, 6, 1, 2, 3), (1, 0, 5, 4), (0, 1, 6)]  # floor, wall, and a sliver where they meet
    regions = planar_regions(pack([(folded, faces)]), 1e-6)
    assert sorted(regions.area.tolist()) == [1.0, 1.0]


def test_nothing_in_nothing_out():
    found = detect(Assembly(()))
    assert (len(found.contacts), found.touching_nothing, found.warnings) == (0, (), ())
    assert detect(Assembly((box("only", (0, 0, 0), (1, 1, 1)),))).touching_nothing == (0,)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan, np.inf])
def test_a_tolerance_that_is_none_is_refused(tolerance):
    with pytest.raises(InputError, match="tolerance"):
        detect(wall(3, 3), tolerance)


# -- what looks wrong -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "other",
    [
        box("q", (0.5, 0.5, 0.5), (1.5, 1.5, 1.5)),  # corner in corner
        box("q", (-1, 0.25, 0.25), (2, 0.75, 0.75)),  # right through, no vertex inside
        box("q", (-1, 0, 0), (2, 1, 1)),  # through, sides in the same planes
        box("q", (0.25, 0.25, 0.25), (0.75, 0.75, 0.75)),  # swallowed whole
        box("q", (0, 0, 0.9), (1, 1, 1.9)),  # sunk in
        box("q", (0, 0, 0), (1, 1, 0.5)),  # the lower half again
        prism("q", [(-1, 0.4), (2, 0.4), (2, 0.6), (0.8, 0.5), (-1, 0.6)], y=-1, depth=3),  # concave, right through
        prism("q", [(0, 0), (1, 0), (1, 1), (0.5, 0.2), (0, 1)]),  # concave, its outline in the same planes
        prism("q", [(-1, -1), (3, -1), (3, 3), (0.5, 0.5), (-1, 3)], y=-1, depth=3),  # concave, swallows nearly all
        prism("q", [(-1, 0.4), (20, 0.4), (20, 0.6), (19, 0.5), (-1, 0.6)], y=0.3, depth=0.4),  # concave, aside
        two_in_one("q", (0.5, 0, 0), (5, 0, 0)),
    ],
)
def test_blocks_that_run_into_each_other_are_named(other):
    for model in (Assembly((box("p", (0, 0, 0), (1, 1, 1)), other)), Assembly((other, box("p", (0, 0, 0), (1, 1, 1))))):
        for copy in (model, moved(model, turn=rotation(3), shift=(1e4, 0, 0))):
            lines = [line for line in detect(copy).warnings if "run into" in line]
            assert len(lines) == 1
            assert "'p'" in lines[0]
            assert "'q'" in lines[0]


def test_depth_of_convex_penetration():
    found = detect(Assembly((box("p", (0, 0, 0), (1, 1, 1)), box("q", (0, 0, 0.9), (1, 1, 1.9)))))
    assert any(line.endswith("by about 0.1 m near (0.5, 0.5, 0.95)") for line in found.warnings)


@pytest.mark.parametrize(
    "other",
    [
        box("q", (1, 1, 0), (2, 2, 1)),
        box("q", (1.05, 0, 0), (2, 1, 1)),
        prism("q", [(1.2, -0.5), (2, 0.5), (1.2, 1.5)], y=-1, depth=3),
        prism("q", [(-1, -1), (2, -1), (2, 2), (1, 2), (1, 0), (0, 0), (0, 2), (-1, 2)]),  # a U round it
    ],
)
def test_blocks_that_stand_apart_or_touch_are_not_accused(other):
    model = Assembly((box("p", (0, 0, 0), (1, 1, 1)), other))
    for copy in (model, moved(model, turn=rotation(4), shift=(1e4, 1e4, 0))):
        assert not any("run into" in line for line in detect(copy).warnings)


def test_crossed_edges_need_an_edge_axis():
    """Two bars on edge, crossed: no face plane parts them, yet they only meet in a point; 2 mm closer they collide."""
    bar = [(0, -0.1), (0.1, 0), (0, 0.1), (-0.1, 0)]
    along_y = prism("p", bar, y=-1, depth=2)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])

    def at(height):
        upper = Block("q", along_y.vertices @ turn.T + [0, 0, height], along_y.faces)
        return [w for w in detect(Assembly((along_y, upper))).warnings if "run into" in w]

    assert at(0.2) == []
    assert len(at(0.198)) == 1


def test_convex_pairs_agree_with_linear_programmes():
    """300 random pairs of tetrahedra: they share more than the tolerance when a ball of half of it fits into both."""
    rng, tolerance = np.random.default_rng(7), 1e-3
    faces = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
    blocks, by_hand = [], set()
    for k in range(300):
        planes, limits = [], []
        for side in (0, 1):
            v = rng.normal(size=(4, 3)) + np.array([1.2 * side, 0, 0])
            v = v if np.linalg.det(v[1:] - v[0]) > 0 else v[[0, 2, 1, 3]]
            for f in faces:
                n = np.cross(v[f[1]] - v[f[0]], v[f[2]] - v[f[0]])
                planes.append([*(n / np.linalg.norm(n)), 1.0])
                limits.append(planes[-1][:3] @ v[f[0]])
            blocks.append(Block(f"{k}.{side}", v + np.array([20.0 * k, 0, 0]), faces))
        free = [(None, None)] * 4
        ball = linprog([0, 0, 0, -1], np.array(planes), np.array(limits), bounds=free)
        if -ball.fun > tolerance / 2:
            by_hand.add(k)
    lines = " ".join(f"{a} {b}" for a, b in colliding(Assembly(tuple(blocks)), tolerance))
    assert lines == " ".join(f"{k}.0 {k}.1" for k in sorted(by_hand))
    assert 50 < len(by_hand) < 250


def test_large_convex_bodies_are_sampled():
    rim = 2 * np.pi * np.arange(400) / 400
    drum = prism("p", np.column_stack([np.cos(rim), np.sin(rim)]).tolist())
    other = prism("q", np.column_stack([1.9 + np.cos(rim), 0.3 + np.sin(rim)]).tolist())
    clear = prism("q", np.column_stack([1.99 + np.cos(rim), 0.3 + np.sin(rim)]).tolist())
    assert any("run into" in w for w in detect(Assembly((drum, other))).warnings)
    assert not any("run into" in w for w in detect(Assembly((drum, clear))).warnings)


def test_duplicates_are_reported_once():
    found = detect(Assembly((box("p", (0, 0, 0), (1, 1, 1)), box("q", (0, 0, 0), (1, 1, 1)))))
    assert [line for line in found.warnings if "same place" in line] == ["blocks 'p' and 'q' stand in the same place"]
    assert not any("run into" in line for line in found.warnings)


def test_many_faults_are_counted():
    apart = Assembly(tuple(box(f"b{i}", (3 * i, 0, 0), (3 * i + 1, 1, 1)) for i in range(30)))
    warnings = detect(apart).warnings
    assert len(warnings) == 4
    assert "27 more" in warnings[-1]


# -- laws -------------------------------------------------------------------------------------------------------------

cuts = st.lists(st.integers(1, 31), min_size=0, max_size=5, unique=True).map(sorted)


@given(courses=st.lists(cuts, min_size=1, max_size=4), seed=st.integers(0, 999), turn=st.integers(0, 3))
@settings(max_examples=examples(40), deadline=None)
def test_any_coursed_wall_has_the_patches_of_its_intervals(courses, seed, turn):
    """Random courses, triangulated, in random order, rotated and 10 km away: patches and areas as in one dimension."""
    lines = [[0, *c, 32] for c in courses]
    blocks, by_hand = {}, {}
    for z, line in enumerate(lines):
        for k, (x, X) in enumerate(pairwise(line)):
            blocks[z, k] = box(f"{z}.{k}", (x / 8, 0, z), (X / 8, 1, z + 1))
            if k:
                by_hand[(f"{z}.{k - 1}", f"{z}.{k}")] = (1, 1.0)
            for m, (low, high) in enumerate(pairwise(lines[z - 1]) if z else ()):
                if min(high, X) > max(low, x):
                    by_hand[(f"{z - 1}.{m}", f"{z}.{k}")] = (1, (min(high, X) - max(low, x)) / 8)
    order = np.random.default_rng(seed).permutation(len(blocks))
    listed = list(blocks.values())
    model = Assembly(tuple(triangulated(listed[i], turn) if i % 2 else listed[i] for i in order))
    model = moved(model, turn=rotation(seed), shift=(1e4, -1e4, 3e3))
    found = detect(model)
    assert_same(pair_areas(model, found), by_hand, 1e-9)  # 1e-12 m of rounding at 10 km on edges of 0.1 m
    assert not any("run into" in line for line in found.warnings)
    centre, contacts = model.mass.centroid, found.contacts
    ahead = np.einsum("ki,ki->k", centre[contacts.b] - centre[contacts.a], contacts.frame[:, 0])
    assert np.all(ahead > 0)  # box centres lie on their own sides of the joint
    assert np.all(contacts.a < contacts.b)


@given(scale=st.floats(1e-3, 1e3), seed=st.integers(0, 999), far=st.booleans())
@settings(max_examples=examples(25), deadline=None)
def test_patches_do_not_depend_on_frame_or_unit(scale, seed, far):
    still = pair_areas(zoo(), detect(zoo()))
    model = moved(zoo(), scale, rotation(seed), 1e4 * far * np.array([1.0, -1.0, 1.0]))
    found = detect(model)
    rounding = 1e-10 + far * 1e-10 / scale  # 1e-11 m of rounding at 10 km against edges of 0.1 x scale
    assert_same(pair_areas(model, found, scale), still, rounding)
    assert found.warnings == ()


@given(seed=st.integers(0, 999))
@settings(max_examples=examples(20), deadline=None)
def test_order_of_blocks_and_faces_does_not_matter(seed):
    """Re-ordered, re-started faces: the very same patches; blocks re-ordered: the same up to names and direction."""
    rng = np.random.default_rng(seed)
    first = detect(zoo()).contacts
    shuffled = []
    for block in zoo().blocks:
        faces = [block.faces[k] for k in rng.permutation(len(block.faces))]
        faces = [f[(s := int(rng.integers(len(f)))) :] + f[:s] for f in faces]
        shuffled.append(Block(block.id, block.vertices, tuple(faces)))
    again = detect(Assembly(tuple(shuffled))).contacts
    assert again.a.tolist() == first.a.tolist()
    assert again.start.tolist() == first.start.tolist()
    np.testing.assert_allclose(again.point, first.point, atol=1e-9)
    order = rng.permutation(len(shuffled))
    model = Assembly(tuple(shuffled[i] for i in order))
    assert_same(pair_areas(model, detect(model)), pair_areas(zoo(), detect(zoo())), 1e-10)
    found = detect(model).contacts
    outward = {"slab": [0, 0, 1], "ring": [0, 0, -1]}  # where these two meet
    ring = [k for k, (a, b) in enumerate(zip(order[found.a], order[found.b], strict=True)) if {a, b} == {0, 5}]
    assert len(ring) == 2
    for k in ring:
        np.testing.assert_allclose(found.frame[k, 0], outward[model.blocks[found.a[k]].id], atol=1e-9)


@given(seed=st.integers(0, 999))
@settings(max_examples=examples(20), deadline=None)
def test_noise_below_the_tolerance_changes_no_count(seed):
    rng, model = np.random.default_rng(seed), wall(4, 4)
    noise = 0.1 * length_tolerance(model)
    shaken = [Block(b.id, b.vertices + rng.uniform(-noise, noise, b.vertices.shape), b.faces) for b in model.blocks]
    found = detect(Assembly(tuple(shaken)), length_tolerance(model))
    assert_same(pair_areas(model, found), pair_areas(model, detect(model)), 1e-4)
    assert found.warnings == ()
