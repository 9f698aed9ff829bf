"""COMPAS JSON that is no assembly: models of elements, problems, and solids that lie about in lists and tables.

Shapes are made by COMPAS itself, the documents round them by hand in the form that `compas_model` 0.4 to 0.9 and
`compas_dem` 0.5 write. By hand: a box of 1 x 2 x 3 m whose element stands at x = 10, below a group that is turned by a
quarter about z, in a model raised by 5 m, has its centre at (0, 10, 5) and is 2 m long in x.
"""

import json
import math

import numpy as np
import pytest
from compas.data import json_dumps
from compas.datastructures import Mesh
from compas.geometry import Box, Cylinder, Frame, Line, Polygon, Polyhedron, Rotation, Transformation, Translation
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults
from cyclopean.io import read_model
from cyclopean.io.models import read_as_drawn
from laws import examples

CUBE = Box(1.0)
SCHEMA = '"schema": "cyclopean.model/1"'


@pytest.fixture
def read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return written_and_read


def written_and_read(data, units="m"):
    with open("a.json", "w") as file:
        file.write(json_dumps(data))
    return read_model("a.json", units)


def said(text):
    """A document as COMPAS writes it, parsed: parts of it can then be put where they belong."""
    return json.loads(json_dumps(text))


def wrapped(kind, data, guid):
    return {"dtype": kind, "data": data, "guid": guid}


def element(guid, geometry=None, move=None, held=False, kind="Block", **more):
    data = {"transformation": move, "features": [], "name": kind, "material": None} | more
    own = {} if geometry is None else {"geometry": Mesh.from_shape(geometry), "is_support": held}
    return wrapped(f"compas_dem.elements/{kind}", data | own, guid)


def contact(polygon):
    points = [[float(x) for x in p] for p in polygon]
    frame = Frame(points[0], [1, 0, 0], [0, 1, 0])
    return wrapped("compas_dem.interactions/FrictionContact", {"points": points, "frame": frame, "forces": None}, "c")


def model(elements, edge=None, children=None, materials=None, move=None):
    """A model whose nodes are numbered from 7, as after some were deleted."""
    names = [one["guid"] for one in elements]
    tree = [{"name": "ElementNode", "element": name} for name in names] if children is None else children
    graph = {"node": {str(k): {"element": name} for k, name in enumerate(names, 7)}, "edge": edge or {}}
    data = {"elements": dict(zip(names, elements, strict=True)), "materials": materials or {}, "transformation": move}
    data |= {"tree": {"root": {"name": "root", "children": tree}}, "graph": graph}
    return wrapped("compas_dem.models/BlockModel", data, "m")


def pair(edge=None, **more):
    """Two cubes, one on the other, the lower one held."""
    stone = wrapped("compas_dem.material/Stone", {"name": "Granite", "density": 2700}, "g")
    up = Translation.from_vector([0, 0, 1])
    elements = [element("p", CUBE, held=True), element("q", CUBE, up, material="g")]
    return model(elements, edge, materials={"g": stone}, **more)


TOP = [[-0.5, -0.5, 0.5], [0.5, -0.5, 0.5], [0.5, 0.5, 0.5], [-0.5, 0.5, 0.5]]
JOINED = {"7": {"8": {"contacts": [contact(TOP)]}}}


def problem(inside=None, law=None, **conditions):
    data = {"model": inside or pair(JOINED), "name": "Problem"}
    data["boundary_conditions"] = wrapped("compas_dem.problem/BoundaryConditions", {"gravity": True, **conditions}, "b")
    law = None if law is None else wrapped("compas_dem.interactions/MohrCoulomb", law, "l")
    data["contact_properties"] = wrapped("compas_dem.interactions/ContactProperties", {"contact_model": law}, "k")
    return wrapped("compas_dem.problem/Problem", data, "p")


def test_elements_stand_where_their_transformations_put_them(read):
    turned = Rotation.from_axis_and_angle([0, 0, 1], math.pi / 2)
    children = [{"element": "g", "children": [{"element": "e", "children": []}]}, {"element": "f"}]
    elements = [
        element("g", kind="Group", move=turned, name="ring"),
        element("e", Box(1, 2, 3), Translation.from_vector([10, 0, 0]), name="keystone", held=True),
        element("f", CUBE, name="springer"),
    ]
    found, warnings = read(model(elements, children=children, move=Translation.from_vector([0, 0, 5])))
    assert warnings == ()
    assert [(b.id, b.fixed, b.group) for b in found.blocks] == [("keystone", True, "ring"), ("springer", False, None)]
    np.testing.assert_allclose(found.mass.centroid, [[0, 10, 5], [0, 0, 5]], atol=1e-12)
    np.testing.assert_allclose(np.ptp(found.blocks[0].vertices, axis=0), [2, 1, 3])
    assert mesh_faults(found.mesh) == []


@settings(max_examples=examples(60))
@given(matrix=arrays(float, (3, 4), elements=st.floats(-2, 2)))
def test_law_of_placement(tmp_path_factory, matrix):
    """What COMPAS itself makes of a transformation of a box, mirrored ones too, is what is read; faces look outward."""
    rows = np.vstack([matrix, [0, 0, 0, 1]])
    assume(abs(np.linalg.det(rows[:3, :3])) > 1e-2)
    move = Transformation(rows.tolist())
    file = tmp_path_factory.mktemp("law") / "a.json"
    file.write_text(json_dumps(model([element("e", Box(1, 2, 3), move)])))
    found, _ = read_as_drawn(file, "m")
    expected = Mesh.from_shape(Box(1, 2, 3)).transformed(move).to_vertices_and_faces()[0]
    np.testing.assert_allclose(found.blocks[0].vertices, expected, atol=1e-12)
    assert found.mass.volume[0] == pytest.approx(6 * abs(np.linalg.det(rows[:3, :3])))


def test_older_elements_stand_in_frames(read):
    """`compas_model` 0.4: a list, frames handed down, materials beside the elements, meshes under "shape"."""
    frame = Frame([0, 0, 2], [0, 1, 0], [-1, 0, 0])
    move = Translation.from_vector([10, 0, 0])
    shape = Mesh.from_shape(Box(1, 2, 3))
    group = wrapped("compas_model.elements/Group", {"frame": frame, "transformation": move}, "g")
    block = wrapped("compas_model.elements/BlockElement", {"frame": None, "transformation": move, "shape": shape}, "e")
    data = {"elements": [group, block], "materials": [wrapped("compas_model.materials/M", {"density": 2000.0}, "s")]}
    data |= {"element_material": {"e": "s"}, "graph": {"node": {"0": {"element": "g"}, "1": {"element": "e"}}}}
    data["tree"] = {"root": {"children": [{"element": "g", "children": [{"element": "e"}]}], "element": None}}
    found, _ = read(wrapped("compas_model.model/Model", data, "m"))
    np.testing.assert_allclose(found.mass.centroid, [[0, 10, 2]], atol=1e-12)
    assert [(b.id, b.density) for b in found.blocks] == [("1", 2000.0)]


def test_a_model_tells_supports_materials_and_contacts(read):
    found, warnings = read(pair(JOINED))
    assert warnings == ()
    assert [(b.id, b.fixed, b.density, b.material) for b in found.blocks] == [
        ("7", True, None, None),
        ("8", False, 2700.0, "Granite"),
    ]
    assert found.contacts.area.tolist() == [1.0]
    assert np.isnan(found.contacts.mu).all()
    assert read(pair())[0].contacts is None
    assert read({"model": pair(), "made": [1, 2]})[0].mass.volume.tolist() == pytest.approx([1, 1])
    assert read(pair(), "cm")[0].mass.volume[0] == pytest.approx(1e-6)


def test_a_problem_tells_loads_supports_and_friction(read):
    polygon = Polygon([[0.5, -0.5, 0.5], [0.5, 0.5, 0.5], [0.5, 0.5, 1.5], [0.5, -0.5, 1.5]])
    press = {"block_index": 8, "polygon": polygon, "magnitude": 30.0}
    asked = problem(
        law={"phi": 30.0, "mu": 0.1, "c": 0.0},
        body_forces=[[1.0, 0, 0]],
        point_loads=[
            {"block_index": 8, "force": [5.0, 0, 0], "moment": None, "point": [0, 0, 1.5]},
            {"block_index": 8, "force": [0.0, 0, -2], "moment": [0, 0, 7.0], "point": None},
        ],
        surface_loads=[press | {"direction": None}, press | {"direction": [0, 0, -1.0]}],
    )
    for units, area in (("m", 1.0), ("cm", 1e-4)):
        found, warnings = read(asked, units)
        assert warnings == ()
        metre = area**0.5
        assert found.contacts.mu.tolist() == pytest.approx([1 / math.sqrt(3)])
        accelerated, at_centre = found.actions
        assert accelerated.acceleration.tolist() == [1, 0, 0]
        assert (at_centre.block, at_centre.force.tolist()) == (1, [0, 0, -2])
        forces = np.array([load.force for load in found.loads])
        points = np.array([load.point for load in found.loads])
        np.testing.assert_allclose(forces[[0, 3, 4]], [[5, 0, 0], [30 * area, 0, 0], [0, 0, -30 * area]])
        np.testing.assert_allclose(points[[0, 3]], [[0, 0, 1.5 * metre], [0.5 * metre, 0, metre]])
        np.testing.assert_allclose(forces[1] + forces[2], 0, atol=1e-12)
        np.testing.assert_allclose(np.cross(points[1:3], forces[1:3]).sum(0), [0, 0, 7], atol=1e-12)


def test_displacements_are_supports_whole_or_partial_and_settlements(read):
    def moved(translation, rotation=None, block=8):
        return {"block_index": block, "translation": translation, "rotation": rotation}

    free = pair()
    free["data"]["elements"]["p"]["data"]["is_support"] = False
    found, _ = read(problem(free, displacements=[moved([0, 0, 0], [0, 0, 0], 7), moved([None, 0.0, None])]))
    assert [(b.fixed, b.held) for b in found.blocks] == [(True, ()), (False, ("y",))]
    found, _ = read(problem(free, displacements=[moved([0, 0, -0.01]), moved(None, [0, 0, 0])]))
    assert found.blocks[1].fixed is True
    assert found.settlements[0].motion.tolist() == [0, 0, -0.01, 0, 0, 0]
    with pytest.raises(InputError, match=r"^a.json: block '8': is moved but not held; say all six displacements$"):
        read(problem(free, displacements=[moved([None, None, -0.01])]))


def test_friction_goes_by_materials_where_no_contacts_are_listed(read):
    found, _ = read(problem(pair(), law={"mu": 0.5}))
    assert {frozenset((p.a, p.b)): p.mu for p in found.friction} == {
        frozenset(pair): 0.5 for pair in (("Granite",), ("Granite", "stone"), ("stone",))
    }


def test_what_a_problem_says_otherwise_is_told(read):
    found = read(problem(law={"mu": 0.5, "c": 3.0}, gravity=False, g=9.0))[1]
    assert found == (
        "a.json: its problem does not ask for weight; blocks have theirs here (`gravity`)",
        "a.json: its g of 9 m/s2 is not taken over; give it as `gravity`",
        "a.json: contact model: c = 3.0 is not taken over; see `cohesion`",
    )


def test_solids_wherever_they_lie(read):
    """Boxes in courses, a mesh in a table, a polyhedron; supports by their key; what is no solid is counted."""
    mesh = Mesh.from_shape(Box(1, 1, 1, Frame([9, 0, 0], [1, 0, 0], [0, 1, 0])))
    corners = np.array(CUBE.vertices)
    solid = Polyhedron((corners + np.array([0, 0, 20])).tolist(), CUBE.faces)
    row = [Box(2, 1, 0.5, Frame([3 * k, 0, 0], [0.6, 0.8, 0], [-0.8, 0.6, 0])) for k in range(2)]
    document = {
        "rows": [row, row[:1]],
        "key": {"keystone": mesh},
        "supports": [solid],
        "base": Line([0, 0, 0], [1, 0, 0]),
    }
    found, warnings = read(document)
    assert warnings == (
        "a.json: 1 Line passed over; only solids are read",
        "a.json: made 5 blocks, one for each named mesh",
    )
    assert [b.id for b in found.blocks] == ["b0", "b1", "b2", "keystone", "b4"]
    assert [b.fixed for b in found.blocks] == [None] * 4 + [True]
    assert mesh_faults(found.mesh) == []
    np.testing.assert_allclose(found.mass.volume, [1, 1, 1, 1, 1])
    np.testing.assert_allclose(found.mass.centroid[:, 2], [0, 0, 0, 0, 20], atol=1e-12)
    np.testing.assert_allclose(np.sort(found.blocks[0].vertices @ [0.6, 0.8, 0])[[0, -1]], [-1, 1])


def test_one_model_a_file(read):
    found, warnings = read({"model": pair(), "spare": Mesh.from_shape(CUBE)})
    assert len(found.blocks) == 2
    assert warnings == ("a.json: 1 solids beside the model are passed over",)
    with pytest.raises(
        InputError, match=r"^a.json: holds 2 models, at 'first', 'last'; save each in a file of its own$"
    ):
        read({"first": pair(), "last": pair()})


def changed(key, value, part="data"):
    """A pair whose upper element (or its data, or the graph) says something else, or nothing."""
    data = said(pair(JOINED))
    inner = data["data"]
    upper = inner["elements"]["q"]["data"]
    place = {"data": upper, "move": (upper["transformation"] or {})["data"], "graph": inner["graph"]}[part]
    place.pop(key) if value is None else place.update({key: value})
    return data


EXPECTED = f"; expected COMPAS meshes, or {SCHEMA}"
FLAT = said(CUBE) | {"data": said(CUBE)["data"] | {"zsize": 0.0}}
DIAGRAM = wrapped("compas_tna.diagrams/FormDiagram", said(Mesh.from_shape(CUBE))["data"], "d")
BREP = {"dtype": "compas_occ.brep/OCCBrep", "data": {}}
EDGE = {"7": {"8": {"modifiers": [{}]}}}
REFUSALS = [
    ({"UB": {"0": [0, 0, 1]}, "LB": {}}, "holds no blocks: it is an object with the keys 'UB' and 'LB'" + EXPECTED),
    (
        {"blocks": [{"vertices": TOP, "faces": [], "fixed": 1}]},
        "holds no blocks: it is an object with the keys 'blocks'" + EXPECTED,
    ),
    (said(Cylinder(1, 2)), "holds no blocks: it is 1 Cylinder" + EXPECTED),
    (DIAGRAM, "holds no blocks: it is 1 FormDiagram, bars of thrust" + EXPECTED),
    ([said(CUBE), FLAT], "Box '1': a box of 1 x 1 x 0 has no volume"),
    (changed("geometry", None), "element '8': is 1 Block, which has no mesh; give its mesh as a Block"),
    (changed("geometry", BREP), "element '8': is a Brep; give its mesh"),
    (changed("material", "z"), "element '8': its material the text 'z' is not in the file"),
    (
        changed("matrix", [[0] * 4] * 4, "move"),
        "element 'q': transformation: its matrix does not move, turn or scale a solid",
    ),
    (
        changed("edge", EDGE, "graph"),
        "edge '7' to '8': has modifiers that cut the blocks; save the model with them applied",
    ),
    (changed("node", {"7": {"element": "p"}}, "graph"), "edge '7' to '8': node '8' is no block"),
    (changed("node", {"8": {"element": "z"}}, "graph"), "node '8': there is no element the text 'z'"),
    (said(problem(point_loads=[{"block_index": 9, "force": [0, 0, 1]}])), "point_loads 0: there is no block 9"),
    (said(problem(law={"phi": 90.0})), "contact model: phi 90 must be below 90 degrees"),
    (
        said(problem(surface_loads=[{"block_index": 8, "polygon": {"points": TOP[:2]}}])),
        "surface_loads 0: polygon has 2 points; it needs at least 3",
    ),
]


@pytest.mark.parametrize(("data", "line"), REFUSALS, ids=[line[:60] for _, line in REFUSALS])
def test_refusals(read, data, line):
    with pytest.raises(InputError) as caught:
        read(data)
    assert str(caught.value) == f"a.json: {line}"


STRANGE = [None, True, -1, 1e300, "x", [], {}, [1], {"a": 1}, [None], [{}], {"node": {}}, {"0": None}, math.nan]


def places(value, above=()):
    """Every place in a document: the keys that lead to it."""
    yield above
    rows = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in rows:
        yield from places(inner, (*above, key))


@settings(max_examples=examples(400))
@given(st.data())
def test_law_of_strange_documents(tmp_path_factory, data):
    """Whatever stands anywhere in a document, it is read or refused in one line; never a fault of ours."""
    point = {"block_index": 8, "force": [5.0, 0, 0], "moment": [0, 0, 1.0], "point": None}
    spread = {"block_index": 8, "polygon": {"points": TOP}, "magnitude": 3.0, "direction": None}
    held = {"block_index": 7, "translation": [0, 0, 0], "rotation": [0, 0, 0]}
    whole = problem(law={"phi": 30.0}, point_loads=[point], surface_loads=[spread], displacements=[held])
    document = said(
        data.draw(st.sampled_from([whole, {"rows": [[CUBE], [FLAT]], "supports": [Mesh.from_shape(CUBE)]}]))
    )
    *above, last = data.draw(st.sampled_from(list(places(document))[1:]))
    owner = document
    for key in above:
        owner = owner[key]
    owner[last] = data.draw(st.sampled_from(STRANGE))
    path = tmp_path_factory.mktemp("law") / "a.json"
    path.write_text(json.dumps(document))
    refusal = f"{path}: read"
    try:
        read_as_drawn(path, "m")
    except InputError as error:
        refusal = str(error)
    assert refusal.startswith(f"{path}: ")
    assert "\n" not in refusal
