"""What is drawn soundly and hardly meant: told in a line, with the place.

By hand: a cube of 1 m and one of 1 mm differ by a thousand; a ring that is thicker
than it is wide crosses itself.
Mutants killed: sizes compared with no regard to what touches; a hollow taken for stone; boxes taken for blocks.
"""

import numpy as np
import pytest

import cyclopean
from cyclopean.analysis.preparation import prepare
from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.io import read_model, write_mesh
from fixtures_stones import torus
from test_mending import GROUND, blocks
from test_mesh_repair import uneven
from test_proof_solids import cuboid, joined


def said(*meshes):
    return prepare(blocks(GROUND, *meshes)).warnings


def test_two_units_in_one_file():
    row = [cuboid((x, 0, 0), (x + 0.5, 1, 1)) for x in (-1.0, 0.0, 1.0)]
    loose = cuboid((5, 5, 5), (5.001, 5.001, 5.001))
    assert [line for line in said(*row, loose) if "units" in line] == [  # 5.7 m, 1.5 m and 1.7 mm across
        "block 'b4' is about 1000 times smaller than the other 4 and nothing joins them:"
        " two units of length in one file?"
    ]
    pebble = cuboid((-0.2, 0, 1), (-0.199, 0.001, 1.001))
    assert not any("units" in line for line in said(*row, cuboid((-0.2, 0, 0), (-0.199, 0.001, 0.001))))
    assert any("units" in line for line in said(*row, pebble))


def test_a_stone_in_a_stone_is_refused_and_one_in_a_hollow_is_not():
    outer, core = cuboid((0, 0, 0), (1, 1, 1)), cuboid((0.4, 0.4, 0.4), (0.6, 0.6, 0.6))
    with pytest.raises(
        InputError, match=r"block 'b2' is inside block 'b1' near \(0.5, 0.5, 0.5\) and touches it nowhere"
    ):
        said(outer, core)
    room = cuboid((0.2, 0.2, 0.2), (0.8, 0.8, 0.8))
    assert said(joined(outer, (room[0], [face[::-1] for face in room[1]])), core)
    angle = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]  # in whose box there is room
    sides = [(k, (k + 1) % 6, (k + 1) % 6 + 6, k + 6) for k in range(6)]
    corner = [(*at, z) for z in (0, 2) for at in angle], [(5, 4, 3, 2, 1, 0), (6, 7, 8, 9, 10, 11), *sides]
    assert said(corner, cuboid((2, 2, 0.5), (2.5, 2.5, 1.0)))
    with pytest.raises(InputError, match="'b2' is inside block 'b1'"):
        said(corner, cuboid((0.2, 2, 0.5), (0.5, 2.5, 1.0)))


def test_a_surface_that_crosses_itself_is_told():
    vertices, faces = uneven(torus(0.6, 1.0))
    high = np.array([0.0, 0.0, 9.0])
    line = next(line for line in said((vertices + high, faces.tolist())) if "crosses itself" in line)
    assert line.startswith("block 'b1' crosses itself near (")


def test_a_model_twice_in_a_file_is_one_line():
    row = [cuboid((x, 0, 0), (x + 0.5, 1, 1)) for x in (-1.0, 0.0, 1.0, 1.5)]
    lines = [line for line in said(*row, *row) if "same place" in line]
    assert lines == [
        "blocks 'b1' and 'b5', 'b2' and 'b6', 'b3' and 'b7' and 1 more pairs stand in the same place:"
        " is the model in the file twice?"
    ]


@pytest.mark.parametrize(
    ("scale", "units", "line"),
    [
        (1000.0, None, "half of the blocks are more than 1.73e+03 m across: are these millimetres? (`units` mm)"),
        (1000.0, "m", "half of the blocks are more than 1.73e+03 m across: check the units"),
        (0.001, None, "half of the blocks are less than 0.00173 m across: check the units"),
        (1000.0, "mm", None),
        (1.0, None, None),
    ],
)
def test_sizes_that_no_stone_has(tmp_path, scale, units, line):
    path = tmp_path / "m.obj"
    vertices, faces = cuboid((0, 0, 0), (1, 1, 1))
    write_mesh(path, Assembly((Block("a", scale * np.array(vertices, float), tuple(map(tuple, faces))),)))
    found = [warning for warning in read_model(path, units)[1] if "half of" in warning]
    assert found == ([] if line is None else [f"{path}: {line}"])


def test_what_is_told_reaches_the_user():
    pair = cuboid((0, 0, 0), (1, 1, 1)), cuboid((1, 0, 0), (2, 1, 1)), cuboid((5, 5, 5), (5.001, 5.001, 5.001))
    assert any("two units" in line for line in cyclopean.check(blocks(GROUND, *pair), method="rbe").warnings)
