"""Meshes that close and still bound no solid are named, in one line, before anything is solved."""

import json
import random
import re

import numpy as np
import pytest

from cyclopean.analysis.preparation import prepare
from cyclopean.cli import main
from cyclopean.errors import InputError
from cyclopean.geometry import detached_pieces, mesh_faults, pack
from cyclopean.geometry.shells import solid_faults
from cyclopean.io.models import read_as_drawn
from test_proof_solids import FAULTY, SOLIDS, cuboid, inward, joined, of_cells, parts_of, rotated, turned

FAULTS = {
    "sheet": "has a shell without volume (faces 6 and 7)",
    "sheet in triangles": "has a shell without volume (faces 6, 7 and 2 more)",
    "inside out, apart": "has a shell that is inside out (faces 6, 7 and 4 more)",
    "inside out, boxes overlap": "has a shell that is inside out (faces 10, 11 and 4 more)",
    "stone in stone": "has a shell that is inside another: stone that would count twice (faces 6, 7 and 4 more)",
    "stone twice": "has a shell that lies on another (faces 0, 1 and 4 more)",
    "stone twice, other triangles": "has a shell that lies on another (faces 0, 1 and 10 more)",
    "hole in a hole": "has a shell that is inside out (faces 12, 13 and 4 more)",
    "hole up to the top": "has faces 1 and 7 lying on each other, back to back: no thickness is between them",
    "pieces back to back": "has faces 3 and 11 lying on each other, back to back: no thickness is between them",
    "cubes face to face": "has faces 3 and 11 lying on each other, back to back: no thickness is between them",
    "cut without width": "has faces 5 and 7 lying on each other, back to back: no thickness is between them",
    "brim without thickness": "has faces 5 and 6 lying on each other, back to back: no thickness is between them",
    "top twice": "has a shell that is inside another: stone that would count twice (faces 6, 7 and 4 more)",
    "crossing pieces": "has faces 0 and 6 lying on each other, facing the same way",
}


def packed(*meshes, scale=1.0, shift=0.0):
    return pack([(scale * np.array(vertices, float) + shift, faces) for vertices, faces in meshes])


def placed(name, mesh):
    """The mesh as it is, turned exactly, turned with rounding, tiny, and far away."""
    rng = random.Random(name)
    yield packed(mesh)
    yield packed(turned(mesh, rng))
    for seed in range(4):
        yield packed(rotated(mesh, seed))
    yield packed(rotated(mesh, 5), scale=1e-3)
    yield packed(rotated(mesh, 6), shift=[300.0, -200.0, 100.0])


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_have_no_fault(name):
    mesh, pieces = SOLIDS[name]
    for given in placed(name, mesh):
        assert mesh_faults(given) == []
        assert detached_pieces(given).tolist() == [pieces]


@pytest.mark.parametrize("name", FAULTS)
def test_faults_are_named(name):
    for given in placed(name, FAULTY[name][0]):
        assert mesh_faults(given) == [(0, FAULTS[name])]


def test_each_body_is_looked_at_at_its_own_size():
    """A hollow boulder of four kilometres, and pebbles of four millimetres: sound, and with a sheet."""
    hollow, sheet = SOLIDS["hollow"][0], FAULTY["sheet"][0]
    small = [(0.001 * np.array(vertices) + 9000.0, faces) for vertices, faces in (hollow, sheet)]
    boulder = 1000.0 * np.array(hollow[0]), hollow[1]
    given = pack([boulder, small[0], small[1], (small[0][0], inward(hollow)[1])])
    assert [body for body, _ in mesh_faults(given)] == [2, 3]
    assert [fault.split(" (")[0].split(":")[0] for _, fault in mesh_faults(given)] == [
        "has a shell without volume",
        "is inside out",
    ]


def test_random_cells_bound_as_many_pieces_as_they_have_parts():
    rng = random.Random(11)
    tried = 0
    while tried < 40:
        size, share = rng.choice([(3, 0.5), (4, 0.25), (5, 0.93), (6, 0.06)])
        cells = {(x, y, z) for x in range(size) for y in range(size) for z in range(size) if rng.random() < share}
        mesh = of_cells(cells)
        if mesh is None or not cells:
            continue
        tried += 1
        given = packed(rotated(mesh, tried))
        assert mesh_faults(given) == []
        assert detached_pieces(given).tolist() == [parts_of(cells)]


def test_bodies_with_other_faults_are_passed_over():
    cube = cuboid((0, 0, 0), (1, 1, 1))
    opened = cube[0], cube[1][1:]
    given = packed(opened, FAULTY["sheet"][0], ([], []), cube)
    assert [body for body, _ in mesh_faults(given)] == [0, 1, 2]
    assert detached_pieces(given).tolist() == [1, 1, 0, 1]
    assert solid_faults(given, np.array([False, False, False, True])) == []


# --- what a user sees ------------------------------------------------------------------------------------------------


def model(tmp_path, *blocks):
    path = tmp_path / "model.json"
    path.write_text(json.dumps({"schema": "cyclopean.model/1", "units": "m", "blocks": list(blocks)}))
    return str(path)


def block(name, mesh, fixed=False):
    vertices, faces = mesh
    return {"id": name, "vertices": [[float(x) for x in v] for v in vertices], "faces": faces, "fixed": fixed}


SHEET = cuboid((0, 0, 5), (1, 1, 6))[0][:4], [[0, 1, 2, 3], [3, 2, 1, 0]]
MEMBRANE = (
    block("ground", joined(cuboid((0, 0, 0), (1, 1, 1)), SHEET), True),
    block("floating", cuboid((0, 0, 5), (1, 1, 6))),
)
COUNTERWEIGHT = (
    block("ground", cuboid((0, 0, 0), (1, 1, 1)), True),
    block("stone", joined(cuboid((0.5, 0, 1), (3, 1, 2)), inward(cuboid((4, 0, 1), (4.75, 1, 2))))),
)


@pytest.mark.parametrize(
    ("blocks", "said"),
    [
        (MEMBRANE, "block 'ground' has a shell without volume (faces 6 and 7); mend its mesh"),
        (COUNTERWEIGHT, "block 'stone' has a shell that is inside out (faces 6, 7 and 4 more); mend its mesh"),
    ],
)
def test_no_analysis_takes_what_is_no_solid(tmp_path, blocks, said):
    with pytest.raises(InputError, match=re.escape(said)):
        prepare(read_as_drawn(model(tmp_path, *blocks))[0])


@pytest.mark.parametrize(
    ("blocks", "said"),
    [(MEMBRANE, "2 faces that stood twice dropped"), (COUNTERWEIGHT, "was inside out and was turned")],
)
@pytest.mark.parametrize("method", ["rbe", "cra"])
def test_check_mends_it_and_finds_that_it_falls(tmp_path, capsys, blocks, said, method):
    assert main(["check", model(tmp_path, *blocks), "--method", method]) == 1
    assert f"mended 1 of 2 blocks: {said}" in capsys.readouterr().err
    assert main(["check", model(tmp_path, *blocks), "--strict"]) == 2
    out = capsys.readouterr()
    assert out.out == ""
    assert f"would mend 1 of 2 blocks: {said}" in out.err


def test_detached_pieces_are_warned_of_and_hollow_stones_are_not(tmp_path, capsys):
    ground = block("ground", cuboid((-9, -9, -1), (9, 9, 0)), fixed=True)
    pair = block("pair", joined(cuboid((5, 0, 0), (6, 1, 1)), cuboid((7, 0, 0), (8, 1, 1))))
    given = model(tmp_path, ground, pair, block("hollow", SOLIDS["hollow"][0]))
    assert main(["check", given, "--method", "rbe"]) == 0
    said = capsys.readouterr().err
    assert said.endswith("warning: block 'pair' consists of 2 detached pieces, taken as one rigid body\n")
    assert "hollow" not in said
