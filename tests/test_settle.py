"""Rubble walls: stones rest where they must, none stands in another one, and nothing hangs on the order of the file."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly, Contacts, rough_contacts
from cyclopean.design.rubble import coursing
from cyclopean.design.rubble.hearting import highest_plane, small_stones, wedge_under
from cyclopean.design.rubble.height_map import edges_of, rasters
from cyclopean.design.rubble.places import Bedded, Slot, Weights, bedded, ranked
from cyclopean.design.rubble.seating import body_of, seat
from cyclopean.design.rubble.settle import OVERLAP, SettleSettings, settle
from cyclopean.design.rubble.standing import FRICTION
from cyclopean.design.rubble.wall import ways_of
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.quarry import quarry
from cyclopean.design.stones.stone import stone_of
from cyclopean.errors import InputError
from cyclopean.io import write_model
from cyclopean.io.stones import read_stones
from fixtures_stones import SCANS, box, largest_overlap, needs_scans, sphere
from laws import nightly


def stone(vertices, triangles, name="a"):
    return stone_of(name, vertices, triangles)


def boxes(*sizes):
    return Inventory(tuple(stone(*box(*size), f"s{k}") for k, size in enumerate(sizes)))


def inside(laid, made):
    """Margin by an independent computation: the least distance from the centre of mass to the sides of the hull."""
    centre = laid.rotation @ made.centroid + laid.shift
    return float(-(ConvexHull(laid.contacts[:, :2]).equations @ np.append(centre[:2], 1.0)).max())


@pytest.fixture(scope="module")
def wall():
    return settle(Inventory(quarry(12, 2, detail=1)), SettleSettings(look_ahead=4, yaws=4))


@pytest.fixture(scope="module")
def stones():
    return quarry(12, 2, detail=1)


def test_boxes_stand_on_the_ground_side_by_side_and_exactly_on_it():
    found = settle(boxes((0.5, 0.3, 0.2), (0.5, 0.3, 0.2)), SettleSettings(length=1.1, thickness=0.3, cell=0.05))
    assert len(found.laid) == 2
    assert found.measures.courses == 1
    for laid, made in zip(found.laid, found.assembly.blocks[1:], strict=True):
        assert made.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-4)
        assert made.vertices[:, 2].max() == pytest.approx(0.2, abs=1e-4)
        assert laid.stable
        assert laid.margin == pytest.approx(0.15, abs=1e-3)
        assert laid.support == 1.0
    (one, two) = sorted(found.assembly.blocks[1:], key=lambda b: b.vertices[:, 0].min())
    assert one.vertices[:, 0].max() <= two.vertices[:, 0].min()
    assert found.measures.height == pytest.approx(0.2, abs=1e-4)


def test_a_box_bridges_the_gap_between_two_others():
    """On tops at 0.2 over x in 0..0.4 and 0.6..1.0, a box over 0.2..0.8 rests at 0.2, borne under 4 of its 6 parts."""
    ground = np.zeros((20, 6))
    ground[:8] = ground[12:] = 0.2
    vertices, triangles = box(0.6, 0.3, 0.1, at=(-0.3, -0.15, -0.05))
    lying = Bedded.of(0, np.eye(3), rasters(vertices[None], triangles, edges_of(triangles), 0.05)[0], 0)
    slot = Slot(np.array([4, 16]), np.array([0, 6]), 0.3, np.inf, both=True)
    (place,) = ranked(ground, [lying], slot, Weights(), 0.05, 9)
    assert place.cell == (4, 0)
    assert place.rest == 0.25
    # support 1 - 8/12; centre: borne 0.125 from the middle across, of 0.15; void: as deep as it is thick, under 1/3
    assert place.cost == pytest.approx(2 / 3 + 3 * (1 - 0.125 / 0.15) + 1 / 3, abs=1e-5)
    assert not ranked(np.where(ground > 0, 0.9, 0.0), [lying], slot, Weights(), 0.05, 9), "far above the level"


def test_a_ball_comes_to_lie_in_the_valley_between_two():
    """Of radius 0.2 on two of the same, 0.48 apart: its centre is sqrt(0.4^2 - 0.24^2) = 0.32 above theirs."""
    point, triangles = sphere(3)
    ball = 0.2 * point
    made = [
        rasters((ball + np.array([x, 0.2, 0.2]))[None], triangles, edges_of(triangles), 0.02, snapped=True)[0]
        for x in (0.2, 0.68)
    ]
    ground = np.zeros((44, 20))
    for raster in made:
        i = round(raster.corner[0] / 0.02)
        ground[i : i + 20] = np.maximum(ground[i : i + 20], raster.high)
    lying = bedded(0, stone(ball, triangles), 1, 0.02)[0]
    slot = Slot(np.array([0, 44]), np.array([0, 20]), 0.52, np.inf, both=True)
    low = Weights(support=0.0, centre=0.0, void=0.0, height=1.0, bond=0.0, face=0.0)
    place = ranked(ground, [lying], slot, low, 0.02, 50)[0]
    centre = np.array(place.cell) * 0.02 - lying.raster.corner
    assert centre == pytest.approx([0.44, 0.2], abs=0.02)
    assert 0.52 - 1e-3 <= place.rest <= 0.55, "never lower than it can be, little higher"
    body = body_of(ball, triangles)
    below = [body.moved(np.eye(3), [x, 0.2, 0.2]) for x in (0.2, 0.68)]
    there = seat(body, np.eye(3), [*centre, place.rest], below)
    assert 0.2 < there.shift[2] <= 0.52 + 1e-3, "it may roll out of the valley along it, never rise"
    assert there.overlap <= OVERLAP


def test_beds_are_faces_that_the_stone_can_rest_on(stones):
    for lying in bedded(0, stones[0], 4, 0.05):
        point = (stones[0].vertices - stones[0].centroid) @ lying.rotation.T
        low = point[point[:, 2] <= point[:, 2].min() + 1e-9]
        assert len(low) >= 3
        assert (ConvexHull(low[:, :2]).equations[:, 2] < 1e-9).all(), "the centre of mass is over the face"
        assert np.linalg.det(lying.rotation) == pytest.approx(1.0)


def test_a_raster_read_backwards_is_that_of_the_stone_turned_by_half(stones):
    made = bedded(0, stones[0], 2, 0.04)
    assert len(made) == 4
    for lying in made:
        point = (stones[0].vertices - stones[0].centroid) @ lying.rotation.T
        at = np.floor((point[:, :2] * (1 - 1e-6) - lying.raster.corner) / 0.04).astype(int)
        assert (at >= 0).all()
        assert (at < lying.raster.low.shape).all()
        assert (lying.raster.low[tuple(at.T)] <= point[:, 2] + 1e-6).all()


def test_no_stone_stands_in_another_or_in_the_ground(wall):
    share, _ = largest_overlap(wall.assembly)
    assert share <= OVERLAP
    assert wall.measures.overlap <= OVERLAP
    assert min(b.vertices[:, 2].min() for b in wall.assembly.blocks[1:]) >= -1e-9


def test_the_largest_overlap_is_seen():
    found = settle(boxes((0.5, 0.3, 0.2)), SettleSettings(length=1.0, thickness=0.3, cell=0.05))
    ground, one = found.assembly.blocks
    pushed = type(one)(one.id, one.vertices - [0, 0, 0.02], one.faces)
    share, names = largest_overlap(type(found.assembly)((ground, pushed)))
    assert share == pytest.approx(0.1, rel=1e-2)
    assert names == ("ground", "s0")


def test_what_is_called_stable_is_so_by_an_independent_computation(wall, stones):
    for laid in wall.laid:
        if laid.stable:
            assert inside(laid, stones[laid.stone]) > 0.0


def test_the_wall_holds_every_stone_once_whole_and_where_it_says(wall, stones):
    used = [laid.stone for laid in wall.laid]
    assert sorted([*used, *wall.left_over.tolist()]) == list(range(12))
    for laid, block in zip(wall.laid, wall.assembly.blocks[1:], strict=True):
        made = stones[laid.stone]
        assert block.id == made.id
        assert block.vertices == pytest.approx(made.vertices @ laid.rotation.T + laid.shift, abs=1e-12)
        assert block.group == f"course-{laid.course}"
    assert wall.assembly.blocks[0].fixed
    assert len(wall.assembly.contacts) > 0
    assert {laid.course for laid in wall.laid} == set(range(wall.measures.courses))


def test_measures_are_those_of_the_stones(wall, stones):
    m = wall.measures
    volume = sum(stones[laid.stone].volume for laid in wall.laid)
    assert 0.3 < m.hollow < m.void < 1.0
    assert m.void < 1.0 - volume / (m.length * m.thickness * m.height) + 0.05
    assert m.height == max(b.vertices[:, 2].max() for b in wall.assembly.blocks)
    assert m.stable == len(wall.laid) / 12
    assert all(laid.stable for laid in wall.laid)


def test_the_same_again_to_the_bit_and_in_any_order_of_the_inventory(wall, stones):
    settings = SettleSettings(look_ahead=4, yaws=4)
    there = settle(Inventory(stones[::-1]), settings)
    assert [stones[a.stone].id for a in wall.laid] == [stones[::-1][b.stone].id for b in there.laid]
    for a, b in zip(wall.laid, there.laid, strict=True):
        assert np.array_equal(a.transform, b.transform)


def test_of_several_walls_the_best_is_kept_whoever_lays_them(wall, stones, monkeypatch):
    """By hand: the first of those with most stones, or the one of these with least void."""
    assert wall.settings.ways == 4, "of twelve stones"
    settings = SettleSettings(look_ahead=4, yaws=4)
    alone = []
    for ahead, skip in ((4, 5), (3, 4), (4, 3), (3, 6)):
        monkeypatch.setattr(coursing, "SKIPS", (skip,))
        alone.append(settle(Inventory(stones), replace(settings, look_ahead=ahead, ways=1)))
        monkeypatch.undo()
    rank = [(-len(one.laid), one.measures.void) for one in alone]
    assert len(set(rank)) > 1, "the ways differ, or the test says nothing"
    best = alone[rank.index(min(rank))]
    with ThreadPoolExecutor(1) as other:
        beside = settle(Inventory(stones), settings, None, other)
    for found in (wall, beside):
        assert [a.stone for a in found.laid] == [b.stone for b in best.laid]
        assert all(np.array_equal(a.transform, b.transform) for a, b in zip(found.laid, best.laid, strict=True))
    assert ways_of(settings, 32) == 4
    assert ways_of(settings, 33) == 1
    assert ways_of(replace(settings, ways=2), 999) == 2


def test_the_order_of_the_inventory_counts_without_look_ahead():
    made = boxes((0.3, 0.3, 0.1), (0.5, 0.3, 0.2), (0.4, 0.3, 0.15))
    found = settle(made, SettleSettings(length=2.0, thickness=0.3, cell=0.05, look_ahead=0))
    assert [laid.stone for laid in found.laid] == [0, 1, 2]
    found = settle(made, SettleSettings(length=2.0, thickness=0.3, cell=0.05, look_ahead=1))
    assert [laid.stone for laid in found.laid] == [1, 2, 0]


def test_limits_are_kept_and_what_does_not_fit_is_left_over():
    made = boxes((0.5, 0.3, 0.2), (0.5, 0.3, 0.2), (0.5, 0.3, 0.2), (0.5, 0.9, 0.6))
    found = settle(made, SettleSettings(length=1.1, thickness=0.3, height=0.25, cell=0.05))
    assert found.measures.height <= 0.25 + 1e-3
    assert sorted(found.left_over.tolist()) in ([0, 3], [1, 3], [2, 3])


def test_two_wythes_stand_at_the_two_faces():
    found = settle(boxes(*[(0.5, 0.3, 0.2)] * 4), SettleSettings(length=1.1, thickness=0.7, wythes=2, cell=0.05))
    middle = {w: [b.vertices[:, 1].mean() for b, laid in pairs(found) if laid.wythe == w] for w in (0, 1)}
    assert middle[0] == pytest.approx([0.15, 0.15], abs=0.03)
    assert middle[1] == pytest.approx([0.55, 0.55], abs=0.03)


def pairs(found):
    return list(zip(found.assembly.blocks[1:], found.laid, strict=True))


def test_small_stones_go_into_the_hollows():
    made = boxes((0.5, 0.3, 0.2), (0.5, 0.3, 0.2), (0.5, 0.3, 0.2), (0.12, 0.1, 0.1))
    assert small_stones(made.stones).tolist() == [False, False, False, True]
    found = settle(made, SettleSettings(length=1.2, thickness=0.3, cell=0.05, hearting=True))
    heart = next(laid for laid in found.laid if laid.stone == 3)
    assert heart.wythe == 2
    assert heart.stable
    assert found.assembly.blocks[1 + found.laid.index(heart)].vertices[:, 2].max() <= 0.2 + 1e-6


def test_a_wedge_steadies_a_box_that_hangs_over():
    """A box of 1 x 0.4 on one of 0.4 x 0.4: its middle is 0.1 beyond the edge, until a wedge bears its other end."""
    below = body_of(*box(0.4, 0.4, 0.1))
    body = body_of(*box(1.0, 0.4, 0.2, at=(0.0, 0.0, 0.1)))
    borne = np.array([[x, y, 0.1] for x in (0.0, 0.4) for y in (0.0, 0.4)])
    wedge = wedge_under(body, [below], borne, 0.05, 0.1)
    assert wedge is not None
    assert wedge.margin > 0.05
    assert wedge.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    assert wedge.vertices[:, 2].max() == pytest.approx(0.1, abs=1e-9)
    assert wedge.contacts[:, 2] == pytest.approx(0.1, abs=1e-6)
    assert wedge_under(body_of(*box(1.0, 0.4, 0.2, at=(0.0, 0.0, 3.0))), [below], borne, 0.05, 0.1) is None, "too high"


def test_a_plane_is_below_all_points_and_touches_some():
    point = np.random.default_rng(4).normal(size=(30, 3)) * [1.0, 1.0, 0.3]
    a, b, c = highest_plane(point)
    over = point[:, 2] - a - point[:, :2] @ [b, c]
    assert over.min() == pytest.approx(0.0, abs=1e-9)
    assert np.count_nonzero(over < 1e-9) == 3


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"length": 0.0}, "length: must be more than 0"),
        ({"wythes": 3}, "wythes: expected 1 or 2"),
        ({"look_ahead": -1}, "look_ahead: expected a whole number of at least 0"),
        ({"ways": 0}, "ways: expected a whole number of at least 1"),
        ({"ways": 7}, "ways: 7; give no more than 6"),
        ({"yaws": 0}, "yaws: expected a whole number of at least 1"),
        ({"margin": -1.0}, "margin: must not be negative"),
        ({"friction": 0.0}, "friction: must be more than 0"),
        ({"cell": float("nan")}, "cell: expected a finite number"),
    ],
)
def test_settings_that_make_no_wall_are_refused(wrong, text):
    with pytest.raises(InputError, match=text):
        SettleSettings(**wrong)


def test_walls_that_cannot_be_are_refused():
    made = boxes((0.5, 0.3, 0.2))
    with pytest.raises(InputError, match="there are no stones to lay"):
        settle(Inventory(()))
    with pytest.raises(InputError, match=r"none of 1 stones fits into a wall 0\.2 m long"):
        settle(made, SettleSettings(length=0.2, thickness=0.3))
    with pytest.raises(InputError, match=r"cell: .* more than 4,000,000 cells"):
        settle(made, SettleSettings(cell=1e-4))
    with pytest.raises(InputError, match="cell: 2 m is more than the wall"):
        settle(made, SettleSettings(cell=2.0, length=1.0, thickness=0.3))
    with pytest.raises(InputError, match="weights: void: must not be negative"):
        Weights(void=-1.0)


def test_a_stone_that_would_tip_another_is_not_laid_there():
    """A plank on a narrow block stands; a box on the plank's free end would tip it, and is laid beside instead."""
    made = boxes((0.3, 0.3, 0.3), (1.0, 0.3, 0.06), (0.25, 0.29, 0.15))
    found = settle(made, SettleSettings(length=1.4, thickness=0.32, cell=0.04, look_ahead=0))
    verdict = check(found.assembly, Settings(method="rbe", mu=FRICTION)).verdict
    assert verdict == "stable"


def test_the_wall_stands_at_every_stage(wall):
    blocks, contacts = wall.assembly.blocks, wall.assembly.contacts
    for count in (3, len(blocks) // 2, len(blocks)):
        kept = [k for k in range(len(contacts)) if max(contacts.a[k], contacts.b[k]) < count]
        part = Contacts.of(
            [(int(contacts.a[k]), int(contacts.b[k])) for k in kept], [contacts.polygon(k) for k in kept]
        )
        result = check(Assembly(blocks[:count], part, ()), Settings(method="rbe", mu=FRICTION))
        assert result.verdict == "stable", count


def test_contacts_are_those_of_the_meshes_as_they_lie(wall):
    contacts, patches = rough_contacts(wall.assembly, wall.settings.band)
    assert np.array_equal(contacts.point, wall.assembly.contacts.point)
    assert [(p.a, p.b, p.kind) for p in patches] == [(p.a, p.b, p.kind) for p in wall.patches]


def test_margins_by_the_contacts_in_the_model_file_alone(wall, tmp_path):
    """From the numbers in the file: what bears a stone are the contacts with what comes before it in the file."""
    write_model(tmp_path / "w.json", wall.assembly)
    data = json.loads((tmp_path / "w.json").read_text())
    place = {block["id"]: k for k, block in enumerate(data["blocks"])}
    for laid, block in zip(wall.laid, data["blocks"][1:], strict=True):
        corner = np.array(block["vertices"])[np.array(block["faces"])]  # (t, 3, 3)
        volume = np.linalg.det(corner) / 6.0
        centre = (volume[:, None] * corner.sum(axis=1) / 4.0).sum(axis=0) / volume.sum()
        point = []
        for contact in data["contacts"]:
            other = {contact["a"]: contact["b"], contact["b"]: contact["a"]}.get(block["id"])
            if other is None or place[other] > place[block["id"]]:
                continue
            ring = np.array(contact["polygon"])
            normal = np.cross(ring - ring[0], np.roll(ring, -1, axis=0) - ring[0]).sum(axis=0)
            up = normal[2] / np.linalg.norm(normal) * (1.0 if contact["b"] == block["id"] else -1.0)
            point += ring.tolist() if up >= 0.25 else []
        plan = np.array(point)[:, :2] - centre[:2]
        angle = np.sort(np.arctan2(plan[:, 1], plan[:, 0]))
        gaps = np.diff(np.append(angle, angle[0] + 2.0 * np.pi))
        assert gaps.max() < np.pi, "there are contacts on every side of the centre of mass"
        sides = ConvexHull(plan).equations
        assert -sides[:, 2].max() == pytest.approx(laid.margin, abs=1e-9)
        assert laid.margin >= 0.05 * np.cbrt(volume.sum()) - 1e-9


def test_wedges_steady_stones_that_would_rock():
    """With wedges at hand, no fewer stones are laid, and the wall stands on all of them."""
    stones = quarry(8, 5, detail=1)
    found = settle(Inventory(stones), SettleSettings(look_ahead=3, yaws=2, chinking=True))
    assert found.wedges == sum(block.group == "chinking" for block in found.assembly.blocks)
    assert check(found.assembly, Settings(method="rbe", mu=FRICTION)).verdict == "stable"
    assert largest_overlap(found.assembly)[0] <= OVERLAP


@nightly
@needs_scans
def test_real_scans_stand_beside_each_other():
    inventory, _ = read_stones(SCANS, "m")
    found = settle(Inventory(inventory.stones[:4]), SettleSettings(look_ahead=2, yaws=4, length=4.0))
    assert len(found.laid) == 4
    assert largest_overlap(found.assembly)[0] <= OVERLAP
    assert all(a.course <= b.course for a, b in pairwise(found.laid))
    for laid in found.laid:
        assert laid.stable == (inside(laid, inventory.stones[laid.stone]) > 0.0)


@pytest.mark.parametrize("way", [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0)])
def test_what_touches_as_it_lies_holds_the_wall_with_gravity_leaning(wall, stones, way):
    """Over contacts of the meshes found anew, within 1/4000 of a median stone's size: what settle promises.

    It lays by friction about the contacts' normals; a proof also wants forces inside the cones about the faces', which
    lean by up to 17 degrees here. One of the four ways stays open for that; none falls.
    """
    size = np.cbrt(np.median([s.volume for s in stones]))
    close = Assembly(wall.assembly.blocks, rough_contacts(wall.assembly, 2.5e-4 * size)[0], ())
    side, down = 9.81 * np.sin(np.radians(4.0)), -9.81 * np.cos(np.radians(4.0))
    leaning = Settings(method="rbe", mu=FRICTION, gravity=(way[0] * side, way[1] * side, down))
    assert check(close, leaning).verdict == ("undecided" if way == (0.0, -1.0) else "stable")
    assert len(close.contacts) < len(wall.assembly.contacts), "fewer than the model has"
