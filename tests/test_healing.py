"""Healing: faces that are meant to touch come to lie in one plane, by the least movement of vertices.

By hand: two cubes of 1 m, the upper one 0.5 mm above the lower one. The plane of the joint comes to lie midway, so that
eight vertices move by 0.25 mm each and both volumes grow by 0.025 %.

Mutants that these tests kill: planes that take no step; what redundant planes ask for forgotten from round to round;
feet not levelled; friction of dropped contacts lost; a movement beyond the length written all the same.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupled_cases import prism
from cyclopean.assembly import Assembly, Block, Contacts, detect, heal
from cyclopean.assembly.meant_planes import _grouped
from cyclopean.design import arch, dome, vault, wall
from cyclopean.errors import InputError
from cyclopean.geometry import face_warp, pack
from cyclopean.io import read_model, write_model
from imprecise import disturbed, model_of, rolled, shaken, shifted, size, verdict
from laws import examples

BOX = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def box(name, low, high, **more):
    (x, y, z), (X, Y, Z) = low, high
    ring = [(x, y), (X, y), (X, Y), (x, Y)]
    return Block(name, np.array([(a, b, c) for c in (z, Z) for a, b in ring], float), BOX, **more)


def two(gap=5e-4, **more):
    return Assembly((box("a", (0, 0, 0), (1, 1, 1)), box("b", (0, 0, 1 + gap), (1, 1, 2 + gap))), **more)


def joints(model):
    found = detect(replace(model, contacts=None)).contacts
    return set(zip(found.a.tolist(), found.b.tolist(), strict=True))


def furthest(healing, model):
    """m, by the vertices themselves."""
    pairs = zip(healing.assembly.blocks, model.blocks, strict=True)
    return max(float(np.linalg.norm(new.vertices - old.vertices, axis=1).max()) for new, old in pairs)


def test_two_cubes_by_hand():
    healing = heal(two(), 1e-3)
    assert healing.moved == pytest.approx([2.5e-4, 2.5e-4], rel=1e-9)
    assert healing.growth == pytest.approx([2.5e-4, 2.5e-4], rel=1e-9)
    assert healing.matched.tolist() == [1, 1]
    assert healing.assembly.blocks[0].vertices[4:, 2] == pytest.approx(np.full(4, 1.00025), abs=1e-15)
    assert detect(healing.assembly).contacts.area.tolist() == pytest.approx([1.0])
    assert healing.warnings == ()


def test_bent_polygons_become_flat_and_feet_level():
    """One corner of a top 0.4 mm too high: the nearest plane takes a quarter of it from every corner."""
    bent = box("a", (0, 0, 0), (1, 1, 1))
    vertices = bent.vertices.copy()
    vertices[6, 2] += 4e-4
    alone = heal(Assembly((replace(bent, vertices=vertices),)), 1e-3).assembly.blocks[0]
    assert face_warp(pack([(alone.vertices, alone.faces)])).max() < 1e-15
    assert np.abs(alone.vertices - vertices)[4:, 2] == pytest.approx(np.full(4, 1e-4), rel=1e-2)
    feet = Assembly((box("a", (0, 0, 0), (1, 1, 1)), box("b", (3, 0, 3e-4), (4, 1, 1))))
    level = heal(feet, 1e-3).assembly.mesh.vertex[[0, 1, 2, 3, 8, 9, 10, 11], 2]
    assert level.tolist() == pytest.approx([1.5e-4] * 8)
    named = replace(feet, blocks=tuple(replace(b, fixed=True) for b in feet.blocks))
    assert heal(named, 1e-3).assembly is named


@given(data=st.data(), seed=st.integers(0, 10**6))
@settings(max_examples=examples(40), deadline=None)
def test_what_is_healed_has_every_joint_of_the_exact_model(data, seed):
    rng = np.random.default_rng(seed)
    exact = replace(model_of(rng), contacts=None)
    how = data.draw(st.sampled_from([shaken, shifted, rolled]))
    share = data.draw(st.sampled_from([1e-6, 1e-5, 1e-4, 1e-3]))
    smallest, largest = (f(size(b) for b in exact.blocks) for f in (min, max))
    drawn = disturbed(exact, how, share * smallest / largest, rng, some=data.draw(st.sampled_from([0.3, 1.0])))
    length = 4.0 * share * smallest
    healing = heal(drawn, length)
    assert joints(exact) <= joints(healing.assembly)
    assert furthest(healing, drawn) == pytest.approx(float(healing.moved.max()), rel=1e-6, abs=1e-15)
    assert healing.moved.max() <= length * (1.0 + 1e-9)
    volume = healing.assembly.mass.volume / drawn.mass.volume - 1.0
    assert healing.growth == pytest.approx(volume, abs=1e-12)
    assert verdict(healing.assembly) == verdict(exact)


@pytest.mark.parametrize(
    "make", [lambda: wall(4, 4), lambda: vault(7, 3), lambda: dome(3, 8), lambda: arch(9, span=2.0)]
)
def test_an_exact_model_comes_back_as_it_is(make):
    model = make()
    healing = heal(model, 2e-3)
    assert healing.assembly is model
    assert not healing.moved.any()


@pytest.mark.parametrize("make", [lambda: wall(3, 4), lambda: vault(5, 2), lambda: arch(9, span=2.0, thickness=0.3)])
@pytest.mark.parametrize("how", [shaken, rolled])
def test_healing_twice_is_healing_once(make, how):
    drawn = disturbed(make(), how, 1e-3, np.random.default_rng(1))
    length = 4e-3 * max(size(b) for b in drawn.blocks)
    once = heal(drawn, length)
    assert once.moved.max() > 1e-5
    assert heal(once.assembly, length).moved.max() <= 1e-9 * once.moved.max()


@given(seed=st.integers(0, 10**6), scale=st.sampled_from([1e-3, 1e3]), angle=st.floats(-3, 3))
@settings(max_examples=examples(20), deadline=None)
def test_scale_and_place_do_not_matter(seed, scale, angle):
    """Turned about the vertical, for the ground is level."""
    drawn = disturbed(wall(2, 3), shaken, 1e-3, np.random.default_rng(seed))
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    there = replace(
        drawn, blocks=tuple(replace(b, vertices=scale * (b.vertices @ turn.T + [5.0, -3.0, 2.0])) for b in drawn.blocks)
    )
    one, other = heal(drawn, 2e-3), heal(there, 2e-3 * scale)
    assert other.moved / scale == pytest.approx(one.moved, rel=1e-5, abs=1e-9)


def test_no_shift_of_the_answer_moves_the_vertices_less():
    """The sum of squares of movements only grows where all that is healed slides by a hair."""
    drawn = disturbed(two(0.0), shaken, 1e-3, np.random.default_rng(3))
    healed = heal(drawn, 4e-3).assembly
    least = float(((healed.mesh.vertex - drawn.mesh.vertex) ** 2).sum())
    for axis in range(3):
        shift = np.zeros(3)
        shift[axis] = 1e-6
        assert float(((healed.mesh.vertex + shift - drawn.mesh.vertex) ** 2).sum()) > least


def test_contacts_are_found_anew_and_keep_their_friction():
    square = np.array([[0.0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    given_ = Contacts.of([(0, 1), (0, 1)], [square, square], [0.3, 0.5])
    healing = heal(two(contacts=given_), 1e-3)
    assert healing.assembly.contacts.mu.tolist() == [0.3]
    assert "found anew" in healing.warnings[0]
    silent = heal(two(contacts=Contacts.of([(0, 1)], [square])), 1e-3)
    assert silent.assembly.contacts is None
    assert "dropped" in silent.warnings[0]


@pytest.mark.parametrize(
    ("length", "words"),
    [
        (0.0, "positive length"),
        (np.nan, "positive length"),
        (0.05, r"block '[ab]' is 1 m thick; expected a length below 0.05 m"),
    ],
)
def test_lengths_are_refused(length, words):
    with pytest.raises(InputError, match=words):
        heal(two(), length)


def test_what_is_too_short_says_what_would_do():
    """A cube 0.9 mm off all three sides of a corner, to which others hold: together more than 1 mm. A gap is told."""
    slabs = [((0, 0, -1), (8, 8, 0)), ((-1, 0, 0), (0, 8, 8)), ((0, -1, 0), (8, 0, 8))]
    at = np.arange(1.2, 6.1, 1.2)
    places = [np.roll((x, y, 0.0), k) for x in at for y in at for k in range(3)]
    corners = [*slabs, *((p, p + 1) for p in places), (np.full(3, 9e-4), np.full(3, 1.0009))]
    model = Assembly(tuple(box(f"b{k}", low, high, fixed=k < 3) for k, (low, high) in enumerate(corners)))
    with pytest.raises(InputError, match=r"block 'b78' would have to move by 0\.00114 m; 0\.0012 would do"):
        heal(model, 1e-3)
    assert len(joints(heal(model, 1.2e-3).assembly)) == len(joints(model)) + 3
    left = heal(two(), 1e-4)
    assert left.assembly.mesh.vertex.tolist() == two().mesh.vertex.tolist()
    assert "nearly touch" in left.warnings[0]


def test_blocks_that_are_no_solids_are_refused():
    model = two()
    model = replace(model, blocks=(replace(model.blocks[0], faces=BOX[1:]), model.blocks[1]))
    with pytest.raises(InputError, match="block 'a' is open"):
        heal(model, 1e-3)


def test_convert_heals(tmp_path, monkeypatch, capsys):
    from cyclopean.cli import main

    monkeypatch.chdir(tmp_path)
    write_model("drawn.json", two())
    assert main(["convert", "drawn.json", "healed.json", "--heal", "0.001"]) == 0
    said = capsys.readouterr().out
    assert "2 of 2 blocks: vertices by up to 0.25 mm, volumes by up to 0.025 %" in said
    assert len(detect(read_model("healed.json")[0]).contacts) == 1
    assert main(["convert", "healed.json", "again.json", "--heal", "0.001"]) == 0
    assert "nothing had to move" in capsys.readouterr().out
    assert main(["convert", "drawn.json", "no.json", "--heal", "0.2"]) == 2
    assert not (tmp_path / "no.json").exists()
    assert "is 1 m thick; expected a length below 0.05 m" in capsys.readouterr().err


def test_planes_that_touch_one_after_the_other_are_one_only_as_far_as_the_length_goes():
    """Tops of five prisms, each 0.9 mm above the one before, in two places 20 m apart, so that no slope fits them.

    All in one plane the first and the last would be 1.8 mm off it; of four none is, by hand, more than 0.9 mm.
    """
    height, length = 9e-4 * np.arange(5), 1e-3
    left = [20.0 * (k % 2) + 2.0 * (k // 2) for k in range(5)]
    blocks = [
        prism(f"b{k}", [(x, -1), (x + 1, -1), (x + 1, z), (x, z)], 1.0)
        for k, (x, z) in enumerate(zip(left, height, strict=True))
    ]
    mesh = Assembly(tuple(blocks)).mesh
    low = np.full(int(mesh.corner_face.max()) + 1, np.inf)
    np.minimum.at(low, mesh.corner_face, mesh.vertex[mesh.corner][:, 2])
    top = np.flatnonzero(low > -0.5)
    plane = _grouped(mesh, np.arange(len(low)), np.stack([top[:-1], top[1:]], 1), length)
    assert len(set(plane[top[:4]].tolist())) == 1
    assert plane[top[4]] != plane[top[0]]
    assert len(set(plane.tolist())) == len(low) - 3
