"""The wall as it will be built: where carved stones really touch, and what a check says of that.

By hand: a bridge of two legs on the ground touches it in two strips; the contact is the rectangle around both, and it
balances and slides as the two do. Law: the touching area is what detection finds between the carved meshes.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from carving_cases import box, pebble, prism, rotation, stone_like
from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly, Block, Contacts, Load, detect
from cyclopean.design import wall
from cyclopean.design.carving.carve import carve
from cyclopean.design.carving.carved_wall import CORNERS, carved_wall
from cyclopean.design.stones.stone import stone_of
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cylinder
from cyclopean.errors import InputError
from cyclopean.proof import verify
from geometry_rules import hull_mesh
from laws import examples

STAY = np.eye(3), np.zeros(3)
GROUND = box((6.0, 3.0, 1.0), (-2.0, -1.0, -1.0), "ground", fixed=True)
BRIDGE = [(0, 0), (0.5, 0), (0.5, 0.5), (1.5, 0.5), (1.5, 0), (2, 0), (2, 1), (0, 1)]


def on_ground(stone, cell):
    """One carved stone on the ground."""
    drawn = Assembly((GROUND, cell))
    return carved_wall(drawn, [carve(stone, cell, *STAY)])


def test_identical_stock_makes_the_drawn_wall():
    drawn = polygonal_wall(PatternSettings(columns=4, rows=3)).assembly
    stones = [carve(stone_like(block), block, *STAY) for block in drawn.blocks[1:]]
    built = carved_wall(drawn, stones)
    assert built.touching == pytest.approx(drawn.contacts.area, rel=1e-9)
    assert built.touching_share == pytest.approx(1.0)
    assert built.assembly.contacts.area == pytest.approx(drawn.contacts.area, rel=1e-9)
    assert (built.missing, built.notes) == ((), ())
    assert [b.id for b in built.assembly.blocks] == [b.id for b in drawn.blocks]
    result = check(built.assembly)
    assert result.verdict == check(drawn).verdict == "stable"
    assert verify(result.certificate).proved
    assert result.warnings == ()


@pytest.mark.parametrize("warped", ["auto", "triangles"])
def test_curved_joints_touch_as_drawn(warped):
    """Joints that are folded into triangles, or laid into the best plane through their corners."""
    drawn = polygonal_wall(PatternSettings(columns=4, rows=3), surface=Cylinder(3.0, 1.5), warped=warped).assembly
    built = carved_wall(drawn, [carve(stone_like(block, 1.1), block, *STAY) for block in drawn.blocks[1:]])
    assert built.touching == pytest.approx(drawn.contacts.area, rel=1e-9)
    assert built.assembly.contacts.area == pytest.approx(drawn.contacts.area, rel=1e-9)


def test_a_narrow_stone_touches_over_its_own_width():
    built = on_ground(stone_like(box((0.5, 1.0, 1.0)), name="narrow"), box((2.0, 1.0, 1.0)))
    contacts = built.assembly.contacts
    assert contacts.area == pytest.approx([0.5])
    assert built.drawn == pytest.approx([2.0])
    assert built.touching_share == pytest.approx(0.25)
    assert contacts.frame[0, 0] == pytest.approx([0.0, 0.0, 1.0])
    assert check(built.assembly).verdict == "stable"


def test_two_patches_are_one_contact_that_holds_as_they_do():
    """Pushed by more and more, it slides and tips at the same moment as with both strips listed."""
    built = on_ground(stone_like(prism(BRIDGE, 1.0), name="bridge"), box((2.0, 1.0, 1.0)))
    assert built.touching == pytest.approx([1.0])  # two strips of 0.5 x 1
    assert built.assembly.contacts.area == pytest.approx([2.0])
    strips = Assembly(built.assembly.blocks, detect(Assembly(built.assembly.blocks)).contacts)
    assert len(strips.contacts) == 2
    for degrees in (0.0, 30.0, 38.0, 39.9, 40.1, 50.0):
        asked = Settings(method="rbe", tilt=(degrees, 0.0))
        assert check(built.assembly, asked).verdict == check(strips, asked).verdict, degrees
    for degrees, verdict in ((40.0, "stable"), (41.2, "unstable")):  # over its side at atan(0.5 / 0.5833) = 40.6
        assert check(built.assembly, Settings(method="rbe", mu=5.0, tilt=(degrees, 90.0))).verdict == verdict


def test_a_round_foot_is_inscribed():
    """Of a 24-gon 8 corners stay: every third, which is a regular octagon, or one that loses no more."""
    angle = 2.0 * np.pi * np.arange(24) / 24
    drum = prism(np.column_stack([1.0 + np.cos(angle), 1.0 + np.sin(angle)]), 1.0, up=True)
    stone = stone_like(drum, name="drum")
    built = on_ground(stone, box((2.0, 2.0, 1.0)))
    assert len(built.assembly.contacts.point) == CORNERS == 8
    regular = (8 * np.sin(2 * np.pi / 8)) / (24 * np.sin(2 * np.pi / 24))
    assert 0.97 * regular < built.kept[0] <= regular + 1e-9
    corners = built.assembly.contacts.point[:, :2] - 1.0
    assert np.linalg.norm(corners, axis=1) == pytest.approx(np.ones(8))
    whole = carved_wall(
        Assembly((GROUND, box((2.0, 2.0, 1.0)))), [carve(stone, box((2.0, 2.0, 1.0)), *STAY)], corners=24
    )
    assert (len(whole.assembly.contacts.point), whole.kept[0]) == (24, pytest.approx(1.0))


@settings(max_examples=examples(15), deadline=None)
@given(st.integers(0, 2**32))
def test_touching_is_what_detection_finds(seed):
    """Two cells side by side on the ground, stones at random: areas against detection on the carved meshes."""
    rng = np.random.default_rng(seed)
    cells = [box(name="left"), box(low=(1.0, 0.0, 0.0), name="right")]
    drawn = Assembly((GROUND, *cells))
    carved = []
    for cell in cells:
        stone, turn = pebble(rng, size=1.2), rotation(rng)
        shift = cell.vertices.mean(axis=0) + rng.normal(size=3) / 8.0 - turn @ stone.centroid
        carved.append(carve(stone, cell, turn, shift))
    built = carved_wall(drawn, carved)
    found = detect(Assembly(built.assembly.blocks)).contacts
    names = [block.id for block in built.assembly.blocks]
    joints = detect(drawn).contacts
    for k in range(len(joints)):
        ends = {drawn.blocks[joints.a[k]].id, drawn.blocks[joints.b[k]].id}
        same = [{names[a], names[b]} == ends for a, b in zip(found.a, found.b, strict=True)]
        assert built.touching[k] == pytest.approx(found.area[same].sum(), abs=1e-6)
    assert (built.assembly.contacts.area <= built.drawn[built.joint] + 1e-12).all()
    result = check(built.assembly, Settings(method="rbe"))
    assert result.verdict in ("stable", "unstable")
    assert not any("turned" in line or "further" in line for line in result.warnings)


def test_cells_without_a_stone_are_left_out_with_their_joints_and_loads():
    drawn = wall(2, 2)
    stones = [carve(stone_like(block), block, *STAY) for block in drawn.blocks if not block.fixed]
    middle = drawn.mass.centroid
    loads = (Load(len(drawn) - 1, [0.0, 0.0, -10.0], middle[-1]), Load(1, [0.0, 0.0, -5.0], middle[1]))
    built = carved_wall(Assembly(drawn.blocks, drawn.contacts, loads), stones[:-1])
    last = drawn.blocks[-1].id
    assert built.missing == (last,)
    assert len(built.assembly) == len(drawn) - 1
    assert [built.assembly.blocks[load.block].id for load in built.assembly.loads] == [drawn.blocks[1].id]
    assert built.notes[:2] == (
        f"1 cell(s) have no stone: '{last}'",
        "1 load(s) acted on cells that have no stone, and are left out",
    )
    gone = (drawn.contacts.a == len(drawn) - 1) | (drawn.contacts.b == len(drawn) - 1)
    assert len(built.assembly.contacts) == int((~gone).sum())


def test_friction_and_density_come_through():
    cell = box((2.0, 1.0, 1.0), density=2000.0)
    joint = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    drawn = Assembly((GROUND, cell), Contacts.of([(0, 1)], [joint], [0.3]))
    plain = carved_wall(drawn, [carve(stone_like(box((2.0, 1.0, 1.0))), cell, *STAY)]).assembly
    heavy = stone_of("heavy", *hull_mesh(cell.vertices), 3000.0)
    dense = carved_wall(drawn, [carve(heavy, cell, *STAY)]).assembly
    assert (plain.blocks[1].density, dense.blocks[1].density) == (2000.0, 3000.0)
    assert plain.contacts.mu.tolist() == [0.3]


def test_stones_that_do_not_reach_each_other_are_said():
    left, right = box(name="left"), box(low=(1.0, 0.0, 0.0), name="right")
    thin = stone_like(box((0.9, 1.0, 1.0)), name="thin")
    carved = [carve(thin, left, *STAY), carve(stone_like(right), right, *STAY)]
    built = carved_wall(Assembly((GROUND, left, right)), carved)
    assert built.notes == ("1 drawn joint(s) do not touch once carved: 'left-right'",)
    assert len(built.assembly.contacts) == 2


def test_refused():
    cell = box()
    drawn = Assembly((GROUND, cell))
    good = carve(stone_like(cell), cell, *STAY)
    with pytest.raises(InputError, match="cell 'cell': has two stones, 'cell' and 'cell'"):
        carved_wall(drawn, [good, good])
    other = Block("elsewhere", cell.vertices, cell.faces)
    with pytest.raises(InputError, match="the wall has no block 'elsewhere'"):
        carved_wall(drawn, [carve(stone_like(cell), other, *STAY)])
    with pytest.raises(InputError, match="block 'ground' is held or sawn, it is no cell"):
        carved_wall(drawn, [carve(stone_like(GROUND), GROUND, *STAY)])
    with pytest.raises(InputError, match="at least 3"):
        carved_wall(drawn, [good], corners=2)
