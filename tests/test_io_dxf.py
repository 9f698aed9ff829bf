"""DXF as ezdxf writes it: meshes, polyfaces, 3D faces, inserts; units, layers, groups; what is no solid."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults
from cyclopean.io import read_model, write_exchange
from laws import examples

ezdxf = pytest.importorskip("ezdxf", reason="the extra `dxf` is not installed")
render = pytest.importorskip("ezdxf.render")

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
UP = np.array([0.0, 0.0, 1.0])
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def drawing(unit=6):
    made = ezdxf.new("R2010")
    made.header["$INSUNITS"] = unit
    return made


def read(made, units=None, name="a.dxf"):
    made.saveas(name)
    return read_model(name, units)


def mesh(space, corners, layer="0"):
    with space.add_mesh({"layer": layer}).edit_data() as data:
        data.vertices, data.faces = corners.tolist(), FACES


def loose(space, corners, layer="0"):
    """The faces of a box as 3DFACEs: sides as they are, the ends as triangles."""
    faces = []
    for k, face in enumerate(FACES):
        rings = [face] if k > 1 else [face[:3], (face[0], *face[2:])]
        faces += [space.add_3dface(corners[list(ring)].tolist(), {"layer": layer}) for ring in rings]
    return faces


def polyface(space, corners, layer="0"):
    builder = render.MeshBuilder()
    builder.add_mesh(vertices=[tuple(p) for p in corners], faces=FACES)
    builder.render_polyface(space, {"layer": layer})


def test_every_way_to_draw_a_solid():
    """One stone each, closed, in the unit of the drawing; a layer is a group, and a name where nobody shares it."""
    made = drawing(4)
    space = made.modelspace()
    mesh(space, 500 * CUBE, "keystone")
    polyface(space, 500 * CUBE + [0, 0, 500], "springer")
    loose(space, 500 * CUBE + [0, 0, 1000], "wall")
    loose(space, 500 * CUBE + [500, 0, 1000], "wall")
    space.add_line((0, 0), (1, 1))
    found, warnings = read(made)
    assert sorted((b.id, b.group) for b in found.blocks) == [
        ("keystone", "keystone"),
        ("springer", "springer"),
        ("wall-0", "wall"),
        ("wall-1", "wall"),
    ]
    assert mesh_faults(found.mesh) == []
    np.testing.assert_allclose(found.mass.volume, 0.125)
    assert warnings == (
        "a.dxf: 1 LINE passed over; only meshes and 3D faces are read",
        "a.dxf: made 4 blocks, one for each connected piece",
    )


def test_names_of_groups_and_of_inserted_blocks():
    made = drawing()
    space = made.modelspace()
    made.groups.new("lintel").extend(loose(space, CUBE, "wall"))
    loose(space, CUBE + UP, "wall")
    block = made.blocks.new("cope", base_point=(0, 0, 1))
    mesh(block, CUBE + UP)
    space.add_blockref("cope", (0, 0, 2), {"layer": "top"})
    found, _ = read(made)
    assert {b.id: (b.group, b.vertices[:, 2].min()) for b in found.blocks} == {
        "lintel": ("wall", 0.0),
        "b2": ("wall", 1.0),
        "cope": ("top", 2.0),
    }


def test_inserts_that_touch_are_told_apart_whichever_way_their_faces_wind():
    """Faces round an edge that stones share are paired by how they wind, which draughtsmen do not heed."""
    made = drawing()
    block = made.blocks.new("stone")
    for k, face in enumerate(FACES):
        block.add_3dface(CUBE[list(face if k % 2 else face[::-1])].tolist())
    for x in range(3):
        made.modelspace().add_blockref("stone", (x, 0, 0))
    found, _ = read(made)
    assert [b.id for b in found.blocks] == ["stone", "stone-2", "stone-3"]
    assert mesh_faults(found.mesh) == []
    np.testing.assert_allclose(found.mass.volume, 1.0)


@settings(max_examples=examples(40))
@given(
    angle=st.floats(-180, 180),
    scale=st.tuples(*[st.floats(-2, 2)] * 3),
    rows=st.integers(1, 3),
    columns=st.integers(1, 3),
)
def test_law_of_inserts(tmp_path_factory, angle, scale, rows, columns):
    """Turned, scaled, mirrored and in arrays, of a block within a block: so many stones, closed, with their volume."""
    assume(min(map(abs, scale)) > 0.1)
    made = drawing()
    inner = made.blocks.new("inner")
    loose(inner, CUBE)
    made.blocks.new("outer").add_blockref("inner", (5, 0, 0), {"rotation": 30})
    array = {"row_count": rows, "column_count": columns, "row_spacing": 50, "column_spacing": 50}
    turned = {"rotation": angle, "xscale": scale[0], "yscale": scale[1], "zscale": scale[2]}
    made.modelspace().add_blockref("outer", (1, 2, 3), array | turned)
    path = tmp_path_factory.mktemp("law") / "a.dxf"
    made.saveas(path)
    found, _ = read_model(path)
    assert len(found.blocks) == rows * columns
    assert [kind for _, kind in mesh_faults(found.mesh) if kind != "inside out"] == []
    np.testing.assert_allclose(np.abs(found.mass.volume), abs(np.prod(scale)), rtol=1e-6)


def test_units_are_those_of_the_drawing():
    for unit, size in ((1, 0.0254), (2, 0.3048), (5, 0.01), (6, 1.0)):
        made = drawing(unit)
        mesh(made.modelspace(), CUBE)
        assert read(made)[0].mass.volume[0] == pytest.approx(size**3)
    made = drawing(0)
    mesh(made.modelspace(), CUBE)
    assert read(made, "cm")[0].mass.volume[0] == pytest.approx(1e-6)
    assert "a.dxf: does not say its units; metres assumed (`units`)" in read(made)[1]
    for unit, given_units, line in (
        (6, "cm", "says that its units are m; leave out units cm"),
        (10, None, "its unit is yards; set it to metres, centimetres, millimetres, inches or feet"),
    ):
        made.header["$INSUNITS"] = unit
        with pytest.raises(InputError) as caught:
            read(made, given_units)
        assert str(caught.value) == f"a.dxf: {line}"


def outlines(made):
    for k in range(3):
        made.modelspace().add_lwpolyline([(k, 0), (k + 1, 0), (k + 1, 1), (k, 1)], close=True)


def solids(made):
    outlines(made)
    made.modelspace().add_3dsolid().sat = ("400 0 1 0", "End-of-ACIS-data")


def line(made):
    made.modelspace().add_line((0, 0), (1, 1))


REFUSALS = {
    outlines: "holds 3 outlines in a plane and no solids; extrude them and export meshes, "
    "or make a wall of them (make polygonal drawing)",
    solids: "holds 1 ACIS solids, which only their own program opens; export meshes (MESHSMOOTH, or OBJ)",
    line: "holds no meshes and no 3D faces, but 1 LINE; export meshes",
    lambda made: None: "holds no meshes and no 3D faces; export meshes",
}


@pytest.mark.parametrize("draw", REFUSALS, ids=lambda draw: draw.__name__)
def test_what_is_no_solid_is_said(draw):
    made = drawing()
    draw(made)
    with pytest.raises(InputError) as caught:
        read(made)
    assert str(caught.value) == f"a.dxf: {REFUSALS[draw]}"


def test_damaged_drawings():
    made = drawing()
    mesh(made.modelspace(), CUBE)
    made.saveas("a.dxf")
    with open("a.dxf", "rb") as file:
        whole = file.read()
    for content in (b"0\nSECTION\n", whole[: len(whole) // 2]):
        with open("a.dxf", "wb") as file:
            file.write(content)
        with pytest.raises(InputError, match=r"^a.dxf: is a damaged DXF file \("):
            read_model("a.dxf")


def test_inserts_that_grow_without_end_are_refused(monkeypatch):
    made = drawing()
    mesh(made.blocks.new("d0"), CUBE)
    for k in range(12):
        block = made.blocks.new(f"d{k + 1}")
        for _ in range(2):
            block.add_blockref(f"d{k}", (0, 0, 0))
    made.modelspace().add_blockref("d12", (0, 0, 0))
    monkeypatch.setattr("cyclopean.io.fields.ROWS", 1000)
    with pytest.raises(InputError, match=r"bytes that unfold to more than"):
        read(made)
    made = drawing()
    made.blocks.new("self").add_blockref("self", (0, 0, 0))
    made.modelspace().add_blockref("self", (0, 0, 0))
    with pytest.raises(InputError, match=r"^a.dxf: "):
        read(made)


def test_nothing_is_written_as_dxf():
    made = drawing()
    mesh(made.modelspace(), CUBE)
    with pytest.raises(InputError, match=r"^b.dxf: unknown ending; use .json,"):
        write_exchange("b.dxf", read(made)[0])
