"""Models mended where they are read: what is done, what is told, what is refused, and that sound blocks stay.

By hand: a cube of 1 m without its lid lacks a face of 1 m2; a face drawn in two halves has a vertex in the middle of
the edge of either neighbour; a sheet of 4 m x 1 m becomes a slab of a tenth of 2 m, the square root of its area.
Mutants killed: no weld; a weld across bodies; one of two equal faces kept always, or none; shells turned without their
volume's sign; T-junctions left; a lid on any hole; an inner shell kept; a load that keeps the number of its face.
"""

import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from cyclopean.analysis.preparation import prepare
from cyclopean.assembly import Assembly, Block, SurfaceLoad, mended
from cyclopean.cli import main
from cyclopean.errors import InputError
from cyclopean.geometry import mass_properties, mesh_faults, pack
from cyclopean.geometry.mending import mended as mended_meshes
from cyclopean.io import read_model, write_model
from fixtures_stones import boulder
from laws import examples
from test_proof_solids import cuboid, joined

SEEDS = st.integers(0, 2**32 - 1)
GROUND = cuboid((-2, -2, -1), (2, 2, 0))


def blocks(*meshes, **more):
    return Assembly(
        tuple(Block(f"b{k}", np.array(v, float), tuple(map(tuple, f)), **more) for k, (v, f) in enumerate(meshes))
    )


def volumes(assembly):
    return mass_properties(pack([(b.vertices, b.faces) for b in assembly.blocks])).volume


def solid(draw):
    """A cuboid, a boulder of triangles, or a prism with a base of many corners, somewhere."""
    kind = draw.integers(3)
    at, size = draw.uniform(-50, 50, 3), draw.uniform(0.2, 5.0, 3)
    if kind == 0:
        vertices, faces = cuboid((0, 0, 0), (1, 1, 1))
    elif kind == 1:
        vertices, faces = boulder(int(draw.integers(5)))
    else:
        n = int(draw.integers(3, 9))
        turn = 2 * np.pi * np.arange(n) / n
        ring = np.column_stack([np.cos(turn), np.sin(turn)])
        vertices = np.concatenate([np.column_stack([ring, np.full(n, z)]) for z in (0.0, 1.0)])
        sides = [(k, (k + 1) % n, (k + 1) % n + n, k + n) for k in range(n)]
        faces = [tuple(range(n))[::-1], tuple(range(n, 2 * n)), *sides]
    return np.array(vertices, float) * size + at, [tuple(map(int, face)) for face in faces]


def spoilt(mesh, draw):
    """The same surface: faces shuffled, some turned over, some twice, and none sharing a vertex with another."""
    vertices, faces = mesh
    faces = [face[::-1] if draw.random() < 0.5 else face for face in faces]
    faces += [faces[k] for k in draw.choice(len(faces), draw.integers(3), replace=False)]
    faces = [faces[k] for k in draw.permutation(len(faces))]
    start = np.cumsum([0, *map(len, faces)]).tolist()
    loose = vertices[[i for face in faces for i in face]]
    return loose, [tuple(range(a, b)) for a, b in itertools.pairwise(start)]


@settings(max_examples=examples(60), deadline=None)
@given(seed=SEEDS)
def test_what_was_spoilt_is_what_it_was(seed):
    """The same volume, the same polygons, whatever stands beside it; sound bodies are the same objects."""
    draw = np.random.default_rng(seed)
    drawn = [solid(draw) for _ in range(4)]
    chosen = [k % 2 == seed % 2 for k in range(4)]
    given_ = blocks(*(spoilt(mesh, draw) if bad else mesh for mesh, bad in zip(drawn, chosen, strict=True)))
    found = mended(given_)
    assert found.faults == ()
    assert not mesh_faults(found.assembly.mesh)
    assert volumes(found.assembly) == pytest.approx(volumes(blocks(*drawn)), rel=1e-12)
    for before, after, mesh, bad in zip(given_.blocks, found.assembly.blocks, drawn, chosen, strict=True):
        assert (after is before) != bad
        corners = sorted(sorted(map(tuple, after.vertices[list(face)].tolist())) for face in after.faces)
        assert corners == sorted(sorted(map(tuple, mesh[0][list(face)].tolist())) for face in mesh[1])
    assert mended(found.assembly).assembly is found.assembly


@settings(max_examples=examples(120), deadline=None)
@given(seed=SEEDS)
def test_whatever_comes_is_a_solid_or_left_and_named(seed):
    """Faces at random, or a solid of which some were lost and the rest shaken: nothing is half mended."""
    draw = np.random.default_rng(seed)
    if seed % 3:
        vertices, faces = spoilt(solid(draw), draw)
        faces = [face for face in faces if draw.random() > 0.12]
        vertices = vertices + draw.normal(scale=1e-5, size=vertices.shape) * (seed % 2)
    else:
        vertices = draw.choice([0.0, 0.5, 1.0], size=(draw.integers(3, 9), 3))
        size = [draw.integers(3, min(5, len(vertices)) + 1) for _ in range(draw.integers(9))]
        faces = [tuple(draw.choice(len(vertices), k, replace=False).tolist()) for k in size]
    drawn = blocks((vertices, faces))
    found = mended(drawn)
    assert [name for name, _ in found.faults] == ["b0"] * len(mesh_faults(found.assembly.mesh))
    assert not found.faults or found.assembly is drawn


@settings(max_examples=examples(8), deadline=None)
@given(seed=SEEDS)
def test_the_verdict_is_that_of_what_was_drawn(seed):
    """A block on the ground, over whose edge it leans or not."""
    draw = np.random.default_rng(seed)
    at = draw.uniform(1.0, 2.0)
    pair = GROUND, cuboid((at, 0, 0), (at + 1.5, 1, 1))
    sound = cyclopean.check(blocks(*pair), method="rbe")
    other = cyclopean.check(blocks(*(spoilt((np.array(v, float), f), draw) for v, f in pair)), method="rbe")
    assert other.verdict == sound.verdict == ("stable" if at + 0.75 <= 2.0 else "unstable")
    assert any("mended 2 of 2 blocks" in line for line in other.warnings)


@settings(max_examples=examples(30), deadline=None)
@given(seed=SEEDS, cuts=st.integers(1, 4))
def test_a_vertex_on_an_edge_becomes_a_corner(seed, cuts):
    """One side of a box is drawn in strips; its neighbours know nothing of the cuts."""
    draw = np.random.default_rng(seed)
    turn = np.linalg.qr(draw.normal(size=(3, 3)))[0]
    vertices, faces = cuboid((0, 0, 0), (2, 1, 1))
    vertices = np.array(vertices, float)
    a, b, c, d = faces[0]
    share = np.sort(draw.uniform(0.05, 0.95, cuts))[:, None]
    new = np.concatenate(
        [vertices[a] + share * (vertices[b] - vertices[a]), vertices[d] + share * (vertices[c] - vertices[d])]
    )
    low, high = [a, *range(8, 8 + cuts), b], [d, *range(8 + cuts, 8 + 2 * cuts), c]
    strips = [(low[k], low[k + 1], high[k + 1], high[k]) for k in range(cuts + 1)]
    moved = np.concatenate([vertices, new]) @ turn.T * 100.0 + draw.uniform(-1e4, 1e4, 3)
    found = mended(blocks((moved, [*strips, *faces[1:]])))
    assert found.faults == ()
    assert volumes(found.assembly)[0] == pytest.approx(2e6, rel=1e-9)
    assert {f"b0: {2 * cuts} vertices were joined to the edges they lie on"} <= {
        f"{name}: {one.text}" for name, done in found.done for one in done
    }


def test_a_flat_lid_is_closed_and_told_and_a_bent_one_is_refused():
    vertices, faces = cuboid((0, 0, 0), (1, 1, 1))
    found = mended(blocks((vertices, faces[1:])))
    assert [one.text for one in found.done[0][1]] == ["1 flat hole closed, 1 m2"]
    assert found.said[1] == "block 'b0' mended: 1 flat hole closed, 1 m2"
    assert volumes(found.assembly)[0] == 1.0
    bent = mended(blocks((vertices, faces[:3])))
    assert bent.done == ()
    assert bent.faults[0][1].startswith("is open: a hole 8 m round near (")
    with pytest.raises(
        InputError, match=r"block 'b0' is open: a hole .* m round near .*; draw the faces that are missing"
    ):
        prepare(bent.assembly)


def test_a_shell_inside_is_dropped_and_a_hollow_stays():
    outer, core = cuboid((0, 0, 0), (1, 1, 1)), cuboid((0.25, 0.25, 0.25), (0.75, 0.75, 0.75))
    found = mended(blocks(joined(outer, core)))
    assert [one.text for one in found.done[0][1]] == ["1 shell inside the surface dropped, of 12.50% of its volume"]
    assert volumes(found.assembly)[0] == 1.0
    hollow = joined(outer, (core[0], [face[::-1] for face in core[1]]))
    assert mended(blocks(hollow)).done == ()
    over = mended(blocks((hollow[0], [face[::-1] for face in hollow[1]])))
    assert volumes(over.assembly)[0] == pytest.approx(0.875)


def test_cracks_are_as_wide_as_the_block_allows():
    vertices, faces = (np.array(x) for x in cuboid((0, 0, 0), (1, 1, 1)))
    for scale in (1e-3, 1e3):
        for width, sound in ((3e-4, True), (1e-2, False)):
            loose = scale * np.concatenate([vertices, vertices + np.array([0, 0, width])])
            found = mended(blocks((loose, [*faces[:3].tolist(), *(faces[3:] + 8).tolist()])))
            assert (found.faults == ()) == sound
            assert not sound or f"up to {width * scale:.2g} m wide" in found.said[1]


def test_ground_drawn_as_a_sheet_is_a_slab():
    sheet = [(0, 0, 0), (4, 0, 0), (4, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)]
    stone = cuboid((1, 0, 0), (2, 1, 1))
    found = mended(blocks(sheet, stone))
    assert [one.text for one in found.done[0][1]] == ["was a sheet without thickness and was made a slab, 0.2 m thick"]
    assert volumes(found.assembly)[0] == pytest.approx(0.8)
    assert cyclopean.check(blocks(sheet, stone), method="rbe").verdict == "stable"
    for more in ([cuboid((1, 0, -2), (2, 1, -1))], []):  # something below it; nothing else at all
        left = mended(blocks(sheet, *more))
        assert left.faults[0][1].startswith("is a sheet without thickness near (2, 0.5, 0); draw it with a thickness")
    assert mended(blocks(sheet, stone, fixed=False)).done == ()  # a free sheet would have a weight of our making


def test_edges_with_more_than_two_faces_are_placed():
    vertices, faces = cuboid((0, 0, 0), (1, 1, 1))
    fin = np.concatenate([vertices, [[5.0, 0.5, 0.5]]])
    a, b = faces[0][:2]
    fault = mended(blocks((fin, [*faces, (a, b, 8)]))).faults[0][1]
    assert fault.startswith(("has 1 edge with more than two faces near (", "is open"))
    assert "near (" in fault


def test_a_load_goes_with_its_face():
    vertices, faces = cuboid((0, 0, 0), (1, 1, 1))
    twice = [faces[0], *faces]
    load = SurfaceLoad(0, face=3, pressure=10.0)
    drawn = Assembly((Block("a", np.array(vertices, float), tuple(twice)),), actions=(load,))
    after = mended(drawn).assembly
    assert set(after.blocks[0].faces[after.actions[0].face]) == set(faces[2])
    lost = Assembly(drawn.blocks, actions=(SurfaceLoad(0, face=1, pressure=10.0),))
    with pytest.raises(InputError, match="face 1 of block 'a' was dropped"):
        mended(lost)


def test_what_a_user_sees(tmp_path, capsys):
    draw = np.random.default_rng(1)
    stone = cuboid((0, 0, 0), (1, 1, 1))
    path = tmp_path / "m.json"
    write_model(path, blocks(GROUND, spoilt((np.array(stone[0], float), stone[1]), draw)))
    assembly, warnings = read_model(path)
    assert len(warnings) == 1
    assert "m.json: mended 1 of 2 blocks: " in warnings[0]
    write_model(tmp_path / "again.json", assembly)
    assert read_model(tmp_path / "again.json")[1] == ()
    assert main(["info", str(path), "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)["mended"]
    assert [one["block"] for one in told] == ["b1"]
    for command in (["check"], ["info"], ["convert", str(tmp_path / "x.obj")], ["limit", "--push", "1,0,0"]):
        assert main([command[0], str(path), *command[1:], "--strict"]) == 2, command
        assert "would mend 1 of 2 blocks: " in capsys.readouterr().err
    assert not (tmp_path / "x.obj").exists()


def test_ten_thousand_blocks_in_one_go():
    """Ten thousand would take ten thousand times what one takes if each went its own way (0.02 s alone)."""
    draw = np.random.default_rng(0)
    one = spoilt(tuple(map(np.array, cuboid((0, 0, 0), (1, 1, 1)))), draw)
    mesh = pack([(one[0] + [k, 0, 0], one[1]) for k in range(2000)])
    found = mended_meshes(mesh)
    assert found.fault == ()
    assert mass_properties(found.mesh).volume == pytest.approx(np.ones(2000))
