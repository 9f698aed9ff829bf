"""Solids of Rhino that are no meshes: polysurfaces, extrusions, block instances.

By hand: a prism over the L of area 3 (a square of 2 without one of 1), 1.5 high, has a volume of 4.5. A sphere has
curved faces; a file that Rhino did not write holds no render mesh of it.
"""

import importlib
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults
from cyclopean.io import read_model
from cyclopean.io.rhino import _Found, _solid_shape
from laws import examples

ELL = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]


@pytest.fixture
def rhino(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return importlib.import_module("rhino3dm")


def drawing(rhino, layer="voussoirs"):
    file = rhino.File3dm()
    file.Settings.ModelUnitSystem = rhino.UnitSystem.Meters
    row = rhino.Layer()
    row.Name = layer
    file.Layers.Add(row)
    attributes = rhino.ObjectAttributes()
    attributes.LayerIndex = 0
    return file, attributes


def written(file):
    file.Write("a.3dm", 7)
    return read_model("a.3dm")


def box(rhino, *size):
    return rhino.Brep.CreateFromBox(rhino.Box(rhino.BoundingBox(0, 0, 0, *size)))


def ell(rhino):
    line = rhino.Polyline.CreateFromPoints([rhino.Point3d(x, y, 0) for x, y in [*ELL, ELL[0]]])
    return rhino.Extrusion.Create(line.ToPolylineCurve(), 1.5, True)


def test_faces_of_flat_solids_are_read_as_they_are(rhino):
    file, attributes = drawing(rhino)
    attributes.Name = "springer"
    attributes.SetUserString("density", "2300")
    file.Objects.AddBrep(box(rhino, 1, 2, 3), attributes)
    attributes.Name = "corner"
    file.Objects.Add(ell(rhino), attributes)
    found, warnings = written(file)
    assert warnings == ("a.3dm: made 2 blocks, one for each named mesh",)
    assert [(b.id, b.group, b.density, len(b.faces)) for b in found.blocks] == [
        ("springer", "voussoirs", 2300.0, 6),
        ("corner", "voussoirs", 2300.0, 8),
    ]
    assert mesh_faults(found.mesh) == []
    np.testing.assert_allclose(found.mass.volume, [6, 4.5])


@settings(max_examples=examples(40))
@given(
    turn=st.floats(-3, 3), lift=st.floats(-1e3, 1e3), size=st.tuples(*[st.floats(0.1, 10)] * 3), mirror=st.booleans()
)
def test_law_of_instances(tmp_path_factory, turn, lift, size, mirror):
    """A solid in an instance in an instance stands where the product of their transformations puts it, closed."""
    rhino = importlib.import_module("rhino3dm")
    file, attributes = drawing(rhino)
    solid = rhino.ObjectAttributes()
    solid.Name = "stone"
    origin = rhino.Point3d(0, 0, 0)
    file.InstanceDefinitions.Add("inner", "", "", "", origin, (box(rhino, *size),), (solid,))
    inner = file.InstanceDefinitions[0].Id
    up = rhino.Transform.Translation(0, 0, lift)
    if mirror:
        up = rhino.Transform.Multiply(up, rhino.Transform.Mirror(origin, rhino.Vector3d(1, 0, 0)))
    reference = rhino.InstanceReference(inner, up)
    file.InstanceDefinitions.Add("outer", "", "", "", origin, (reference,), (solid,))
    about = rhino.Transform.Rotation(turn, rhino.Vector3d(0, 0, 1), origin)
    file.Objects.AddInstanceObject(rhino.InstanceReference(file.InstanceDefinitions[1].Id, about), attributes)
    path = tmp_path_factory.mktemp("law") / "a.3dm"
    file.Write(str(path), 7)
    found, _ = read_model(path)
    assert [(b.id, b.group) for b in found.blocks] == [("outer", "voussoirs")]
    assert mesh_faults(found.mesh) == []
    x, y, z = size
    assert found.mass.volume[0] == pytest.approx(x * y * z)
    middle = np.exp(1j * turn) * complex(-x if mirror else x, y) / 2
    np.testing.assert_allclose(found.mass.centroid[0], [middle.real, middle.imag, lift + z / 2], atol=1e-9)


def test_curved_solids_without_render_meshes_are_refused_with_the_remedy(rhino):
    file, attributes = drawing(rhino)
    for _ in range(3):
        file.Objects.AddBrep(rhino.Brep.CreateFromSphere(rhino.Sphere(rhino.Point3d(0, 0, 0), 1.0)), attributes)
    with pytest.raises(InputError) as caught:
        written(file)
    assert str(caught.value) == (
        "a.3dm: holds no meshes, but 3 polysurfaces on layers 'voussoirs', with curved faces and no render meshes;"
        " select them in Rhino, run the command Mesh (in scripts _-Mesh), and save the meshes"
    )
    file.Objects.AddBrep(box(rhino, 1, 1, 1), attributes)
    found, warnings = written(file)
    assert len(found.blocks) == 1
    assert warnings[0] == "a.3dm: 3 polysurfaces are passed over; only meshes are read where there are any"


def test_curved_solids_are_read_by_their_render_meshes(rhino):
    """Only Rhino caches them, so that a stand-in holds one here: a cube, face by face."""
    ball = rhino.Brep.CreateFromSphere(rhino.Sphere(rhino.Point3d(0, 0, 0), 1.0))
    found = _Found()
    stand_in = SimpleNamespace(ToBrep=lambda split: ball, GetMesh=lambda kind: cube(rhino))
    vertices, faces = _solid_shape(stand_in, "Extrusion", found)
    assert (len(vertices), len(faces), found.curved) == (24, 6, {"extrusions": 1})
    assert found.shapeless == found.kinds == {}


def cube(rhino):
    """Twenty-four corners, no two faces with one of them in common."""
    mesh = rhino.Mesh()
    for brep_face in box(rhino, 1, 1, 1).Faces:
        trims = brep_face.OuterLoop.Trims
        for k in range(4):
            at = box(rhino, 1, 1, 1).Vertices[trims[k].StartVertexIndex].Location
            mesh.Vertices.Add(at.X, at.Y, at.Z)
        first = len(mesh.Vertices) - 4
        mesh.Faces.AddFace(first, first + 1, first + 2, first + 3)
    return mesh


def test_meshes_stand_for_solids_beside_them(rhino):
    file, attributes = drawing(rhino)
    file.Objects.AddMesh(cube(rhino), attributes)
    file.Objects.AddBrep(box(rhino, 1, 2, 3), attributes)
    found, warnings = written(file)
    assert found.mass.volume.tolist() == pytest.approx([1.0])
    assert warnings[0] == "a.3dm: 1 polysurfaces are passed over; only meshes are read where there are any"


def test_instances_that_grow_without_end_are_refused(rhino, monkeypatch):
    """Each definition holds two of the one before: twelve of them are four thousand stones."""
    file, attributes = drawing(rhino)
    origin, still = rhino.Point3d(0, 0, 0), rhino.Transform.Identity()
    file.InstanceDefinitions.Add("d0", "", "", "", origin, (cube(rhino),), (attributes,))
    for k in range(12):
        one = rhino.InstanceReference(file.InstanceDefinitions[k].Id, still)
        file.InstanceDefinitions.Add(f"d{k + 1}", "", "", "", origin, (one, one), (attributes, attributes))
    file.Objects.AddInstanceObject(rhino.InstanceReference(file.InstanceDefinitions[12].Id, still), attributes)
    monkeypatch.setattr("cyclopean.io.fields.ROWS", 1000)
    with pytest.raises(InputError, match=r"bytes that unfold to more than"):
        written(file)
