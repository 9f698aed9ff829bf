"""Rubble walls: stones rest where they must, none stands in another one, and nothing hangs on the order of the file."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly
from cyclopean.design.rubble.orientations import bedded
from cyclopean.design.rubble.settle import OVERLAP, SettleSettings, _built, _laid_anew, settle
from cyclopean.design.rubble.sharing import Share
from cyclopean.design.rubble.site import Site
from cyclopean.design.rubble.standing import FRICTION
from cyclopean.design.rubble.wall import filled_in
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.quarry import quarry
from cyclopean.design.stones.stone import stone_of
from cyclopean.errors import InputError
from cyclopean.io import write_model
from cyclopean.io.stones import read_stones
from cyclopean.view.settled_page import answer_of, settled_page, stands_of, told_of
from fixtures_stones import SCANS, box, largest_overlap, needs_scans, sphere
from laws import nightly

QUICK = SettleSettings(look_ahead=4, yaws=4, ways=1)


def stone(vertices, triangles, name="a"):
    return stone_of(name, vertices, triangles)


def boxes(*sizes):
    return Inventory(tuple(stone(*box(*size), f"s{k}") for k, size in enumerate(sizes)))


def inside(laid, made):
    """Margin by an independent computation: the least distance from the centre of mass to the sides of the hull."""
    centre = laid.rotation @ made.centroid + laid.shift
    return float(-(ConvexHull(laid.contacts[:, :2]).equations @ np.append(centre[:2], 1.0)).max())


def stage(wall, count):
    """The wall after so many blocks."""
    contacts = wall.assembly.contacts
    part = contacts.only(np.flatnonzero(np.maximum(contacts.a, contacts.b) < count))
    return Assembly(wall.assembly.blocks[:count], part, ())


@pytest.fixture(scope="module")
def stones():
    return quarry(12, 2, detail=1)[:8]


@pytest.fixture(scope="module")
def wall(stones):
    return settle(Inventory(stones), replace(QUICK, ways=2))


def test_boxes_stand_on_the_ground_side_by_side_and_exactly_on_it():
    found = settle(boxes((0.5, 0.3, 0.2), (0.5, 0.3, 0.2)), SettleSettings(length=1.1, thickness=0.3, cell=0.05))
    assert len(found.laid) == 2
    assert found.measures.courses == 1
    for laid, made in zip(found.laid, found.assembly.blocks[1:], strict=True):
        assert made.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-4)
        assert made.vertices[:, 2].max() == pytest.approx(0.2, abs=1e-4)
        assert laid.stable
        assert laid.role == "stone"
        assert laid.margin == pytest.approx(0.15, abs=1e-3)
    (one, two) = sorted(found.assembly.blocks[1:], key=lambda b: b.vertices[:, 0].min())
    assert one.vertices[:, 0].max() <= two.vertices[:, 0].min()
    assert found.measures.height == pytest.approx(0.2, abs=1e-4)


def test_beds_are_faces_that_the_stone_can_rest_on(stones):
    for lying in bedded(0, stones[0], 4, 0.05):
        point = (stones[0].vertices - stones[0].centroid) @ lying.rotation.T
        low = point[point[:, 2] <= point[:, 2].min() + 1e-9]
        assert len(low) >= 3
        assert (ConvexHull(low[:, :2]).equations[:, 2] < 1e-9).all(), "the centre of mass is over the face"
        assert np.linalg.det(lying.rotation) == pytest.approx(1.0)


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
    assert sorted([*used, *(k for k, _ in wall.left_over)]) == list(range(8))
    for laid, block in zip(wall.laid, wall.assembly.blocks[1:], strict=True):
        made = stones[laid.stone]
        assert block.id == made.id
        assert block.vertices == pytest.approx(made.vertices @ laid.rotation.T + laid.shift, abs=1e-12)
        assert block.group == f"course-{laid.course}"
    assert wall.assembly.blocks[0].fixed
    assert len(wall.assembly.contacts) > 0
    assert all(reason for _, reason in wall.left_over)


def test_measures_are_those_of_the_stones(wall, stones):
    m = wall.measures
    volume = sum(stones[laid.stone].volume for laid in wall.laid)
    assert 0.2 < m.void_tops < m.void < 1.0
    assert m.void < 1.0 - volume / (m.length * m.thickness * m.height) + 0.05
    assert m.height == max(b.vertices[:, 2].max() for b in wall.assembly.blocks)
    assert all(laid.stable for laid in wall.laid)


def test_the_same_again_to_the_bit_and_in_any_order_of_the_inventory(wall, stones):
    there = settle(Inventory(stones[::-1]), wall.settings)
    assert [stones[a.stone].id for a in wall.laid] == [stones[::-1][b.stone].id for b in there.laid]
    for a, b in zip(wall.laid, there.laid, strict=True):
        assert np.array_equal(a.transform, b.transform)


def test_the_order_of_the_inventory_counts_without_look_ahead():
    made = boxes((0.3, 0.3, 0.1), (0.5, 0.3, 0.2), (0.4, 0.3, 0.15))
    found = settle(made, SettleSettings(length=2.0, thickness=0.3, cell=0.05, look_ahead=0))
    assert [laid.stone for laid in found.laid] == [0, 1, 2]
    found = settle(made, SettleSettings(length=2.0, thickness=0.3, cell=0.05, look_ahead=1))
    assert [laid.stone for laid in found.laid] == [1, 2, 0]


def test_limits_are_kept_and_what_does_not_fit_is_left_over_with_its_reason():
    made = boxes((0.5, 0.3, 0.2), (0.5, 0.3, 0.2), (0.5, 0.3, 0.2), (0.5, 0.9, 0.6))
    found = settle(made, SettleSettings(length=1.1, thickness=0.3, height=0.25, cell=0.05))
    assert found.measures.height <= 0.25 + 1e-3
    reasons = dict(found.left_over)
    assert sorted(reasons) in ([0, 3], [1, 3], [2, 3])
    assert reasons[3] == "too large for the wall"


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"length": 0.0}, "length: must be more than 0"),
        ({"wythes": 3}, "wythes: expected 1 or 2"),
        ({"look_ahead": -1}, "look_ahead: expected a whole number of at least 0"),
        ({"yaws": 0}, "yaws: expected a whole number of at least 1"),
        ({"margin": -1.0}, "margin: must not be negative"),
        ({"friction": 0.0}, "friction: must be more than 0"),
        ({"cell": float("nan")}, "cell: expected a finite number"),
        ({"batter": "6"}, "batter: '6' is none; give 1:N, such as 1:6"),
        ({"batter": "1:1"}, "batter: 1:1 is not between upright and 1:2"),
        ({"dress": 0.3}, "dress: 0.3 is not a share from 0 to 0.2; to cut more, use match and carve"),
        ({"opening": (1.0, 0.0, 1.0)}, "opening: expected X,Z,W,H"),
        ({"ends": "sloping"}, "ends: expected vertical or racked"),
    ],
)
def test_settings_that_make_no_wall_are_refused(wrong, text):
    with pytest.raises(InputError, match=text):
        SettleSettings(**wrong)


def test_less_than_no_stones_are_not_told(stones):
    with pytest.raises(InputError, match="next: expected a whole number of at least 0, got -1"):
        settle(Inventory(stones), QUICK, advice=-1)


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
    with pytest.raises(InputError, match=r"opening: no stone bridges 0\.6 m; it takes one 0\.8 m long"):
        settle(made, SettleSettings(length=3.0, thickness=0.3, opening=(1.0, 0.0, 0.6, 0.4)))


def test_the_wall_is_proved_at_every_stage(wall):
    for count in range(2, len(wall.assembly.blocks) + 1, 2):
        result = check(stage(wall, count), Settings(method="rbe", mu=FRICTION))
        assert (result.verdict, result.certificate is not None) == ("stable", True), count


def test_the_file_holds_what_was_proved_by_coupled_analysis_too(wall):
    assert check(wall.assembly, Settings(mu=FRICTION, seconds=60.0)).verdict == "stable"


def test_a_stone_taken_out_from_below_brings_others_down(wall):
    """The proof can fail: without the stone that bears most, the wall is not stable."""
    contacts = wall.assembly.contacts
    bears = [int(((contacts.a == k) | (contacts.b == k)).sum()) for k in range(1, len(wall.assembly.blocks))]
    out = 1 + int(np.argmax(bears))
    part = contacts.only(np.flatnonzero((contacts.a != out) & (contacts.b != out)))
    part = replace(part, a=part.a - (part.a > out), b=part.b - (part.b > out))
    blocks = tuple(b for k, b in enumerate(wall.assembly.blocks) if k != out)
    assert check(Assembly(blocks, part, ()), Settings(method="rbe", mu=FRICTION)).verdict == "unstable"


def test_a_batter_leans_the_face_inwards_and_the_wall_stands(stones):
    found = settle(Inventory(stones), replace(QUICK, batter="1:4", length=1.2, thickness=0.9))
    proud = 0.07 * np.cbrt(np.median([s.volume for s in stones]))
    for block in found.assembly.blocks[1:]:
        assert (block.vertices[:, 1] >= block.vertices[:, 2] / 4.0 - proud - 1e-9).all()
    assert check(found.assembly, Settings(method="rbe", mu=FRICTION)).verdict == "stable"


@pytest.mark.parametrize("jamb", [0.5, 0.44])
def test_an_opening_is_bridged_by_a_long_stone(jamb):
    """Also where stones end before the jamb, as round ones do."""
    made = boxes(*[(jamb, 0.3, 0.2)] * 4, (1.2, 0.3, 0.2))
    found = settle(made, SettleSettings(length=1.6, thickness=0.3, cell=0.05, opening=(0.5, 0.0, 0.6, 0.4)))
    (lintel,) = [k for k, laid in enumerate(found.laid) if laid.role == "lintel"]
    assert found.laid[lintel].stone == 4
    corner = found.assembly.blocks[1 + lintel].vertices
    assert corner[:, 2].min() == pytest.approx(0.4, abs=1e-3)
    assert corner[:, 0].min() < 0.5
    assert corner[:, 0].max() > 1.1
    for block in found.assembly.blocks[1:]:
        x, _, z = block.vertices.mean(axis=0)
        assert not (0.5 < x < 1.1 and z < 0.4)


def test_every_stone_is_laid_where_all_are_asked_for_and_those_that_do_not_stand_are_named_first():
    """A ball of small facets rocks wherever it lies."""
    vertices, triangles = sphere(2)
    made = Inventory((*boxes((0.5, 0.3, 0.2), (0.4, 0.3, 0.15)).stones, stone(0.1 * vertices, triangles, "ball")))
    asked = SettleSettings(length=1.3, thickness=0.32, cell=0.04, yaws=2, ways=1)
    some, every = settle(made, asked), settle(made, replace(asked, all=True))
    assert [made.stones[k].id for k, _ in some.left_over] == ["ball"]
    assert len(some.laid) == 2
    assert len(every.laid) == 3
    assert [made.stones[laid.stone].id for laid in every.laid if not laid.stable] == ["ball"]
    for laid in every.laid:
        assert laid.stable == (laid.reason == "")
    assert answer_of(every, made)[0].endswith("but 1 of them does not stand")
    assert stands_of(every, made).startswith("Without ball, which would fall, it stands at every stage with")
    assert stands_of(some, made).startswith("It stands at every stage with")
    assert "It stands" not in settled_page(every, made)
    assert "It stands at every stage with" in settled_page(some, made)
    assert list(told_of(every).unsteady) == ["ball"]


def test_what_is_told_first_is_what_stands_and_not_what_was_asked():
    made = boxes((0.5, 0.3, 0.2), (0.4, 0.3, 0.2))
    found = settle(made, SettleSettings(length=6.0, thickness=0.32, cell=0.05))
    what, missing = answer_of(found, made)
    assert what == f"2 of 2 stones make {found.measures.covered:.3g} x 0.32 x 0.20 m"
    assert found.measures.covered == pytest.approx(0.9, abs=0.11)
    litres = (6.0 - found.measures.covered) * 0.2 * 0.32 * (1.0 - found.measures.void) * 1e3
    assert missing == f"For the 6 m of length asked about {litres:,.0f} more litres of stone are missing. "


def test_binders_lie_with_their_length_into_the_wall():
    """Slabs of 2 to 1 with room either way: none lies across by itself, as many as are asked to do."""
    slabs = boxes(*[(0.4, 0.2, 0.1)] * 8)

    def across(share):
        found = settle(slabs, SettleSettings(length=1.3, thickness=0.5, height=0.25, binders=share, cell=0.02, ways=1))
        size = [np.ptp(block.vertices, axis=0) for block in found.assembly.blocks[1:]]
        return sum(deep > long for long, deep, _ in size), len(size)

    assert [across(share) for share in (0.0, 0.4, 1.0)] == [(0, 8), (4, 8), (8, 8)]


def test_binders_and_a_corner_are_refused():
    with pytest.raises(InputError, match="a wall with a corner has two ways into it"):
        SettleSettings(binders=0.3, corner=2.0)
    with pytest.raises(InputError, match=r"binders: 1\.5 is not a share"):
        SettleSettings(binders=1.5)


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
            area = np.cross(ring - ring[0], np.roll(ring, -1, axis=0) - ring[0]).sum(axis=0)
            normal = np.array(contact.get("normal", area))
            up = normal[2] / np.linalg.norm(normal) * (1.0 if contact["b"] == block["id"] else -1.0)
            point += ring.tolist() if up >= 0.25 else []
        plan = np.array(point)[:, :2] - centre[:2]
        angle = np.sort(np.arctan2(plan[:, 1], plan[:, 0]))
        gaps = np.diff(np.append(angle, angle[0] + 2.0 * np.pi))
        assert gaps.max() < np.pi, "there are contacts on every side of the centre of mass"
        sides = ConvexHull(plan).equations
        assert -sides[:, 2].max() == pytest.approx(laid.margin, abs=1e-9)
        assert laid.margin >= 0.03 * np.cbrt(volume.sum()) - 1e-9


@nightly
@needs_scans
def test_real_scans_stand_beside_each_other():
    inventory, _ = read_stones(SCANS, "m")
    found = settle(Inventory(inventory.stones[:4]), SettleSettings(look_ahead=2, yaws=4, length=4.0))
    assert len(found.laid) == 4
    assert largest_overlap(found.assembly)[0] <= OVERLAP
    for laid in found.laid:
        assert laid.stable == (inside(laid, inventory.stones[laid.stone]) > 0.0)


def test_a_wall_gone_on_with_is_the_wall_of_one_run():
    """From the end of a course on: what was tried in vain before is forgotten there, and forces are found anew."""
    made = boxes(*[(0.5 - 0.003 * k, 0.3, 0.2 + 0.002 * k) for k in range(10)])
    whole = settle(made, SettleSettings(length=1.1, thickness=0.32, cell=0.05, ways=1))
    courses = sorted({laid.course for laid in whole.laid})
    assert len(courses) > 1, "or the test says nothing"
    count = 1 + sum(laid.course < courses[1] for laid in whole.laid)
    on = settle(made, whole.settings, standing=stage(whole, count))
    names = [block.id for block in whole.assembly.blocks]
    assert [block.id for block in on.assembly.blocks] == names
    for one, two in zip(whole.assembly.blocks, on.assembly.blocks, strict=True):
        assert two.vertices == pytest.approx(one.vertices, abs=1e-6)
    assert len(on.laid) == len(names) - count


def test_the_next_stones_are_told_and_the_first_is_laid():
    stones = quarry(12, 2, detail=1)
    before = settle(Inventory(stones[:4]), replace(QUICK, length=1.6, thickness=0.9))
    told = settle(Inventory(stones), before.settings, standing=before.assembly, advice=2)
    assert len(told.following) == 2
    assert len({one.stone for one in told.following}) == 2
    assert [laid.stone for laid in told.laid] == [told.following[0].stone]
    assert len(told.assembly.blocks) == len(before.assembly.blocks) + 1
    assert answer_of(told, Inventory(stones))[0].startswith("1 of 12 stones, on 4 that stood before, make")
    assert "from here on" in stands_of(told, Inventory(stones))
    assert told_of(told).course[told.assembly.blocks[-1].id] == told.laid[0].course
    assert check(told.assembly, Settings(method="rbe", mu=FRICTION)).verdict == "stable"


def test_standing_walls_that_are_none_are_refused(wall, stones):
    ground, *rest = wall.assembly.blocks
    with pytest.raises(InputError, match="has no free block"):
        settle(Inventory(stones), QUICK, standing=Assembly((ground,), None, ()))
    air = replace(rest[0], vertices=rest[0].vertices + np.array([0.0, 0.0, 1.0]))
    with pytest.raises(InputError, match="touches nothing that comes before it"):
        settle(Inventory(stones), QUICK, standing=Assembly((ground, air), None, ()))
    raised = replace(ground, vertices=ground.vertices + np.array([0.0, 0.0, 0.5]))
    with pytest.raises(InputError, match=r"has its top at 0\.5 m; put it at height 0"):
        settle(Inventory(stones), QUICK, standing=Assembly((raised, *rest), None, ()))


def test_a_little_dressing_is_told_cut_by_cut_and_the_wall_stands(stones):
    found = settle(Inventory(stones), replace(QUICK, dress=0.05))
    cuts = [cut for laid in found.laid for cut in laid.cuts]
    assert cuts
    off = sum(cut.volume for cut in cuts)
    volume = sum(stones[laid.stone].volume for laid in found.laid)
    assert found.measures.imposition == pytest.approx(off / volume, rel=1e-6)
    for laid in found.laid:
        assert sum(cut.volume for cut in laid.cuts) <= 0.05 * stones[laid.stone].volume
    assert largest_overlap(found.assembly)[0] <= OVERLAP
    assert check(found.assembly, Settings(method="rbe", mu=FRICTION)).verdict == "stable"


def test_what_was_laid_last_is_taken_out_and_the_rest_laid_anew_after_the_others():
    """What stands is as it was; stones that were taken out come last; a wall of fewer stones is never kept."""
    stock = quarry(14, 1, detail=1)
    asked = filled_in(stock, replace(QUICK, length=2.0, thickness=0.8))
    site = _built(Site(stock, asked, lambda _: None), Share())
    last, rest = [laid.stone for laid in site.laid[-4:]], site.laid[:-4]
    before = site.without(4)
    for one, two in zip(before.laid, rest, strict=True):
        assert one.stone == two.stone
        assert np.array_equal(one.transform, two.transform)
    assert before.kept["stone"][-4:] == sorted(last, key=before.left.index)
    assert before.structure.resolve()
    highest = max(site.stood[k].high[2] for k in range(len(rest)))
    assert float(before.map[before.room > 0.0].max()) == pytest.approx(highest, abs=1e-9)
    assert len(_laid_anew(site, Share()).laid) >= len(site.laid)


def test_of_very_many_stones_those_that_are_tried_stay_the_same_and_have_every_size():
    """What is known of the places of a stone is then of use again, when another has been laid."""
    stock = quarry(60, 5, detail=1)
    site = Site(stock, filled_in(stock, QUICK), lambda _: None)
    some = site.some_of(site.left, 20)
    assert some == [k for k in site.left if k in some]
    assert len(some) == 20
    for gone in site.left:
        then = site.some_of([k for k in site.left if k != gone], 20)
        assert len(set(then) - set(some)) == (gone in some)
    assert all(set(some) & set(site.left[k : k + 20]) for k in (0, 20, 40))


def test_a_pin_is_a_small_stone_that_bears_the_one_laid_right_after_it():
    """Of stones and chips of a thousandth to a thirtieth of their volume; without pins they lie otherwise."""
    chips = (replace(chip, id=f"chip-{chip.id}") for chip in quarry(8, 104, (3e-4, 6e-3), detail=1))
    stock = Inventory((*quarry(8, 3, detail=1), *chips))
    found = settle(stock, replace(QUICK, pins=True))
    contacts = found.assembly.contacts
    touching = {(int(a), int(b)) for a, b in zip(contacts.a, contacts.b, strict=True)}
    pins = [k for k, laid in enumerate(found.laid) if laid.role == "pin"]
    assert pins
    for k in pins:
        assert stock.stones[found.laid[k].stone].id.startswith("chip")
        assert (k + 1, k + 2) in touching
        both = found.assembly.mass.centroid[[k + 1, k + 2], 2]
        assert both[0] < both[1]
    assert check(found.assembly, Settings(method="rbe", mu=FRICTION)).verdict == "stable"
