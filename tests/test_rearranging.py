"""Blocks moved, taken out and put back, against detection of everything from nothing.

By hand: of two cubes of 1 m on a slab, shifting the upper one of a stack by 0.25 m along x leaves a contact of
0.75 x 1 m; lifting it leaves none; taking the lower one out leaves only what does not touch it.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.assembly import Assembly, Block, Contacts, Load, detect
from cyclopean.assembly.rearranging import Arrangement, Pose, arrange
from cyclopean.design import wall
from cyclopean.errors import InputError
from laws import examples

BOX = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
STILL = np.eye(3)


def box(name, low, high, **more):
    (x, y, z), (X, Y, Z) = low, high
    ring = [(x, y), (X, y), (X, Y), (x, Y)]
    return Block(name, np.array([(a, b, c) for c in (z, Z) for a, b in ring], float), BOX, **more)


def stack(**more):
    blocks = (box("a", (0, 0, 0), (1, 1, 1)), box("b", (0, 0, 1), (1, 1, 2)), box("c", (0, 0, 2), (1, 1, 3)))
    return Assembly(blocks, name="stack", **more)


def begun(model: Assembly) -> Arrangement:
    found = detect(model) if model.contacts is None else None
    contacts = model.contacts if found is None else found.contacts
    held = np.arange(len(model)) == 0
    return arrange(model, contacts, held, 1e-6 if found is None else found.tolerance)


def shapes(contacts: Contacts):
    """Every contact as its blocks and its points, whichever comes first, in a fixed order."""
    rows = []
    for k in range(len(contacts)):
        ring = contacts.polygon(k).round(7) + 0.0
        first = min(range(len(ring)), key=lambda i: tuple(ring[i]))
        rows.append((int(contacts.a[k]), int(contacts.b[k]), np.roll(ring, -first, axis=0).ravel().tolist()))
    return sorted(rows)


def same(one: Contacts, two: Contacts) -> bool:
    rows = list(zip(shapes(one), shapes(two), strict=True)) if len(one) == len(two) else [(0, 1)]
    return all(a[:2] == b[:2] and np.allclose(a[2], b[2], atol=2e-6) for a, b in rows if a != b)


def test_by_hand():
    home = begun(stack())
    shifted = home.moved(2, Pose(STILL, np.array([0.25, 0.0, 0.0])))
    assert shifted.contacts.area.tolist() == pytest.approx([1.0, 0.75])
    assert len(home.moved(2, Pose(STILL, np.array([0.0, 0.0, 0.5]))).contacts) == 1
    gone = home.without(1)
    assert [b.id for b in gone.assembly.blocks] == ["a", "c"]
    assert len(gone.contacts) == 0
    assert gone.place(2) == 1
    assert gone.place(1) is None
    assert same(gone.put_back(1).contacts, home.contacts)


def test_supports_and_loads_go_with_their_blocks():
    load = Load(2, np.array([1.0, 0, 0]), np.array([0.5, 0.5, 3.0]))
    home = begun(stack(loads=(load, Load(1, np.array([0, 1.0, 0]), np.array([0.5, 0.5, 1.5])))))
    quarter = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # about y: what was above is then along x
    moved = home.moved(2, Pose(quarter, np.array([0.0, 0.0, 1.0])))
    assert moved.assembly.loads[0].point == pytest.approx(np.array([1.0, 0.5, 3.5]))
    assert moved.assembly.loads[0].force.tolist() == [1, 0, 0]
    gone = home.without(1)
    assert [(row.block, row.force.tolist()) for row in gone.assembly.loads] == [(1, [1, 0, 0])]
    assert gone.fixed.tolist() == [True, False]
    assert [b.fixed for b in gone.assembly.blocks] == [True, False]


@given(data=st.data())
@settings(max_examples=examples(25), deadline=None)
def test_any_way_there_is_the_same_as_detection_from_nothing(data):
    home = begun(replace(wall(4, 4), contacts=None))
    now, number = home, st.integers(1, len(home.model) - 1)
    step = st.sampled_from([0.0, 0.05, -0.1, 0.2, 0.4])
    for _ in range(data.draw(st.integers(1, 6))):
        block, what = data.draw(number), data.draw(st.sampled_from(["move", "move", "remove", "back"]))
        if what == "move":
            shift = np.array([data.draw(step), 0.5 * data.draw(step), data.draw(st.sampled_from([0.0, 0.0, 0.2]))])
            angle = data.draw(st.sampled_from([0.0, 0.0, np.pi / 2, np.pi]))
            c, s = np.cos(angle), np.sin(angle)
            now = now.moved(block, Pose(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), shift))
        else:
            now = now.without(block) if what == "remove" else now.put_back(block)
        assert same(now.contacts, detect(now.assembly, now.tolerance).contacts)
        keys = now.contacts.a * len(now.assembly) + now.contacts.b
        assert (np.diff(keys) >= 0).all()
    for block in sorted({*now.poses, *now.removed}):
        now = now.put_back(block)
    assert np.array_equal(now.contacts.point, home.contacts.point)
    assert now.notes == ()


def test_given_contacts_stay_where_both_blocks_are_at_home():
    square = np.array([[0.0, 0, 1], [0.5, 0, 1], [0.5, 1, 1], [0, 1, 1]])  # half of what touches
    model = stack(contacts=Contacts.of([(0, 1), (1, 2)], [square, square + np.array([0, 0, 1])], [0.3, 0.4]))
    home = begun(model)
    there = home.moved(2, Pose(STILL, np.array([0.1, 0, 0])))
    assert there.contacts.area.tolist() == pytest.approx([0.5, 0.9])
    assert there.contacts.mu[0] == 0.3
    assert np.isnan(there.contacts.mu[1])
    back = there.put_back(2).contacts
    assert back.area.tolist() == pytest.approx([0.5, 0.5])
    assert back.mu.tolist() == [0.3, 0.4]


def test_notes_name_what_a_block_runs_into_and_go_when_it_leaves():
    home = begun(stack())
    into = home.moved(2, Pose(STILL, np.array([0.3, 0.2, -0.4])))
    assert any("'b' and 'c' run into each other" in note for note in into.notes)
    assert home.moved(2, Pose(STILL, np.array([0.0, 0.0, 5.0]))).notes == ("block 'c' touches no other block",)
    assert into.put_back(2).notes == ()
    (note,) = into.without(1).notes
    assert note.startswith("block 'c' touches no other block")


@pytest.mark.parametrize(
    ("act", "said"),
    [
        (lambda home: home.without(0), "'a' is the last support"),
        (lambda home: home.number("z"), "'z' is not in the model"),
        (lambda _: Pose(2.0 * STILL, np.zeros(3)), "not a rotation"),
        (lambda _: Pose(STILL, np.array([0, np.nan, 0])), "shift"),
    ],
)
def test_refusals(act, said):
    with pytest.raises(InputError, match=said):
        act(begun(stack()))


def test_the_last_block_stays():
    with pytest.raises(InputError, match="last one"):
        begun(Assembly((box("a", (0, 0, 0), (1, 1, 1)),))).without(0)
