"""The JSON of Hops: what is read, what is written, what is refused; without a server.

By hand: a point of 300 mm is 0.3 m to the last digit, and 0.3 m goes back as 300 mm. A force of 1 m in the drawing of
a document in millimetres is a line of 1000.
"""

import base64
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.errors import InputError
from cyclopean.service.icons import DRAWINGS, icon
from cyclopean.service.parameters import Answer, Component, Context, Input, Output
from cyclopean.service.protocol import OutdatedError, answered, described, inputs_of, request_of
from cyclopean.service.solving import solved

rhino3dm = pytest.importorskip("rhino3dm", reason="the extra rhino is not installed")

from cyclopean.geometry.polyhedra import face_triangles  # noqa: E402
from cyclopean.io.rhino_json import (  # noqa: E402
    RHINO_UNITS,
    mesh_body,
    mesh_json,
    plane_json,
    plane_of,
    point_json,
    point_of,
    polyline_json,
    units_of,
)
from cyclopean.service.components.catalogue import COMPONENTS  # noqa: E402
from hops_cases import Geometry, box, item, mesh, outputs, points, request, tree, vector  # noqa: E402

MM, M = (1, 1000), (1, 1)
ECHO = Component(
    "echo",
    "Echo",
    "E",
    "Says what it hears.",
    (
        Input("Number", "n", "Number", "A number.", default=0.5),
        Input("Maybe", "m", "Integer", "Nothing, or a number.", optional=True),
        Input("Texts", "t", "Text", "Texts.", "list", optional=True),
        Input("Tree", "b", "Boolean", "A tree.", "tree", optional=True),
        Input("Way", "v", "Vector", "A vector.", optional=True),
        Input("Points", "p", "Point", "Points.", "list", optional=True),
    ),
    (Output("Lines", "l", "Line", "Lines.", "tree"), Output("Text", "t", "Text", "Text.")),
    lambda given, context: Answer({}),
)


def read(**inputs):
    return inputs_of(ECHO, request("echo", inputs))[0]


def test_defaults_stand_where_nothing_is_connected() -> None:
    nothing = {"Number": 0.5, "Maybe": None, "Texts": [], "Tree": {}, "Way": None, "Points": []}
    assert read() == read(Number=[], Maybe=[], Texts=[]) == nothing


def test_values_are_read_as_rhino_writes_them() -> None:
    found = read(Number=2, Maybe=3, Texts=["a", 'say "b"'], Way=vector(0, 0, -1.0), Points=[vector(300.0, 0, 1.0)])
    assert (found["Number"], found["Maybe"], found["Texts"]) == (2.0, 3, ["a", 'say "b"'])
    assert found["Way"].tolist() == [0, 0, -1]
    assert found["Points"][0].tolist() == [0.3, 0.0, 0.001]


def test_a_tree_keeps_its_branches() -> None:
    body = request("echo", {})
    body["values"] = [{"ParamName": "Tree", "InnerTree": {"{0;1}": [item(True)], "{2}": [item(False), item(True)]}}]
    assert inputs_of(ECHO, body)[0]["Tree"] == {"{0;1}": [True], "{2}": [False, True]}


@pytest.mark.parametrize(
    ("inputs", "said"),
    [
        ({"Number": "0.5"}, r"Number \(n\): expected a finite number"),
        ({"Number": math.nan}, r"Number \(n\): expected a finite number"),
        ({"Number": math.inf}, r"Number \(n\): expected a finite number"),
        ({"Number": 10**400}, r"Number \(n\)"),
        ({"Number": True}, r"Number \(n\): expected a finite number"),
        ({"Number": [1.0, 2.0]}, r"Number \(n\): takes one value, got 2"),
        ({"Maybe": 1.5}, r"Maybe \(m\): expected a whole number"),
        ({"Maybe": 2**40}, r"Maybe \(m\): expected a whole number"),
        ({"Tree": [1]}, r"Tree \(b\): expected true or false"),
        ({"Way": Geometry("Vector3d", {"X": 1})}, r"Way \(v\): expected X, Y and Z"),
        ({"Way": vector(0, math.nan, 0)}, r"Way \(v\): expected X, Y and Z"),
        ({"Points": [vector(0, 0, 0), vector(0, 0, 1e200)]}, r"Points \(p\)\[1\]: a coordinate is not"),
    ],
)
def test_a_value_of_another_kind_is_refused_by_name(inputs, said) -> None:
    with pytest.raises(InputError, match=said):
        read(**inputs)


def test_an_outdated_component_is_told_apart() -> None:
    with pytest.raises(OutdatedError, match="no input 'Colour'"):
        read(Colour=1.0)
    body = json.dumps(request("check", {"Colour": 1.0})).encode()
    status, answer = solved("", body, Context())
    assert status == 500
    assert json.loads(answer)["errors"][0] == "Bad inputs"  # by these words Hops asks for the new inputs


@pytest.mark.parametrize(
    ("body", "status", "said"),
    [
        (b"", 400, "request"),
        (b"\xff\xfe", 400, "UTF-8"),
        (b"[]", 400, "object"),
        (b"{", 400, "JSON"),
        (b"[" * 200_000, 400, "deep"),
        (b'{"pointer": ' + b"9" * 10_000 + b"}", 400, "digits"),
        (b'{"values": []}', 400, "pointer"),
        (b'{"pointer": "nothing", "values": []}', 404, "no component 'nothing'"),
        (b'{"pointer": "check"}', 200, "values"),
        (b'{"pointer": "check", "values": [7]}', 200, "values"),
        (b'{"pointer": "check", "values": [], "modelunits": "Parsecs"}', 200, "Parsecs"),
        (b'{"pointer": "check", "values": [{"ParamName": "Tilt", "InnerTree": {"{0}": 1}}]}', 200, "Tilt"),
    ],
)
def test_what_is_no_request_is_answered_in_a_line(body, status, said) -> None:
    found, answer = solved("", body, Context())
    (line,) = json.loads(answer)["errors"]
    assert found == status
    assert said in line
    assert "\n" not in line
    assert "internal" not in line


def test_a_fault_of_ours_is_told_and_not_thrown(monkeypatch) -> None:
    def broken(given, context):
        raise ZeroDivisionError("oh")

    monkeypatch.setitem(COMPONENTS, "echo", Component("echo", "Echo", "E", "", (), (), broken))
    status, answer = solved("echo", b'{"values": []}', Context())
    assert status == 500
    assert "internal error" in json.loads(answer)["errors"][0]


def test_answers_hold_every_output_and_undo_the_units() -> None:
    line = np.array([[0.0, 0, 0], [1, 0, 0]])
    answer = answered(ECHO, Answer({"Lines": [[line], []], "Text": "ä\ud800"}, ("one\ntwo",)), MM, {})
    assert [value["ParamName"] for value in answer["values"]] == ["Lines", "Text"]
    found = outputs(answer)
    assert found["Lines"] == {
        "{0;0}": [{"From": {"X": 0, "Y": 0, "Z": 0}, "To": {"X": 1000, "Y": 0, "Z": 0}}],
        "{0;1}": [],
    }
    assert found["Text"]["{0}"] == ["ä\ud800"]
    assert answer["warnings"] == ["one\\ntwo"]
    assert answered(ECHO, Answer({}), M, {})["values"][1]["InnerTree"] == {"{0}": []}


@pytest.mark.parametrize("component", COMPONENTS.values(), ids=lambda c: c.path)
def test_a_description_is_what_hops_understands(component) -> None:
    """Item, list and tree as its `AccessFromInput` tells them; a default of the parameter's type; a 24 x 24 PNG."""
    told = json.loads(json.dumps(described(component)))
    assert told["Uri"] == f"/{component.path}"
    assert told["Description"].endswith(".")
    for side in ("Inputs", "Outputs"):
        names, nicknames = ([p[key] for p in told[side]] for key in ("Name", "Nickname"))
        assert len(set(names)) == len(names)
        assert len(set(nicknames)) == len(nicknames)
        assert all(map(len, names))
        assert {p["ParamType"] for p in told[side]} <= {
            "Number", "Integer", "Text", "Boolean", "Mesh", "Curve", "Line", "Point", "Vector", "Plane",
            "Surface",
        }  # fmt: skip
    kinds = {"Number": float, "Integer": int, "Text": str, "Boolean": bool}
    for p, given_ in zip(told["Inputs"], component.inputs, strict=True):
        item_ = p["AtLeast"] == p["AtMost"] == 1
        assert item_ == (given_.access == "item" and not given_.optional)
        assert "Default" not in p or type(p["Default"]) is kinds[p["ParamType"]]
        assert given_.default is None or (given_.access == "item" and not given_.optional)
    png = base64.b64decode(told["Icon"])
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    assert png[16:24] == bytes([0, 0, 0, 24, 0, 0, 0, 24])
    assert len(png) < 1500


def test_icons_are_read_by_others(tmp_path) -> None:
    image = pytest.importorskip("matplotlib.image", reason="the extra plot is not installed")
    for name in DRAWINGS:
        (tmp_path / "icon.png").write_bytes(base64.b64decode(icon(name)))
        picture = image.imread(tmp_path / "icon.png")
        assert picture.shape == (24, 24, 4)
        assert 0.2 < picture[..., 3].mean() < 1.0


@settings(deadline=None)
@given(
    shift=st.tuples(*[st.floats(-100, 100)] * 3),
    size=st.floats(0.01, 10),
    units=st.sampled_from([*RHINO_UNITS.values()]),
)
def test_a_mesh_comes_back_as_it_went(shift, size, units) -> None:
    corners, faces = box((0, 0, 0), (size, size, size))
    corners = corners + shift
    body = mesh_body("mesh", json.loads(json.dumps(mesh_json(corners, faces, units))), units)
    assert np.abs(body.vertices - corners).max() <= 4e-16 * np.abs(corners).max()
    assert body.faces == faces


def test_faces_that_rhino_has_not_become_triangles() -> None:
    """An L of six corners: four triangles that cover its area of 3, none of them outside."""
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]])
    body = mesh_body("mesh", mesh_json(corners, [(5, 4, 3, 2, 1, 0)], M), M)
    edge = body.vertices[face_triangles(body.vertices, body.faces)]
    double = np.cross(edge[:, 1] - edge[:, 0], edge[:, 2] - edge[:, 0])
    assert len(body.faces) == 4
    assert (double[:, 2] < 0.0).all()
    assert -double[:, 2].sum() / 2.0 == pytest.approx(3.0)


def test_single_precision_is_read_too() -> None:
    body = mesh_body("mesh", mesh(*box((0, 0, 0), (0.1, 0.1, 0.1))), MM)
    assert len(body.vertices) == 24
    assert np.abs(body.vertices).max() == pytest.approx(0.1, abs=1e-8)


@pytest.mark.parametrize(
    "data",
    [
        None, 7, "mesh", [], {}, {"version": 10000}, {"version": 1, "archive3dm": 70, "opennurbs": 1, "data": ""},
        {"version": 10**30, "archive3dm": 70, "opennurbs": 1, "data": "AAAA"},
        {"version": 2**31, "archive3dm": 70, "opennurbs": 1, "data": "AAAA"},
        {"version": None, "archive3dm": [], "opennurbs": {}, "data": "AAAA"},
        {"version": 10000, "archive3dm": 70, "opennurbs": 1, "data": "no base64!"},
    ],
)  # fmt: skip
def test_what_is_no_mesh_is_refused(data) -> None:
    with pytest.raises(InputError, match=r"^Blocks\[0\]: "):
        mesh_body("Blocks[0]", data, M)


def test_a_curve_is_no_mesh() -> None:
    with pytest.raises(InputError, match="is a PolylineCurve, not a mesh"):
        mesh_body("Blocks[0]", polyline_json(np.eye(3), M), M)


def test_a_polyline_is_closed() -> None:
    assert points(polyline_json(np.eye(3), MM)).tolist() == [[1000, 0, 0], [0, 1000, 0], [0, 0, 1000], [1000, 0, 0]]


@pytest.mark.parametrize("name", ["Millimeters", "Meters", "Feet", "none", "Unset", ""])
def test_units_by_the_names_of_rhino(name) -> None:
    """Against what rhino3dm calls them."""
    units = units_of(name)
    if units is None:
        assert name.lower() in ("none", "unset", "")
    else:
        assert hasattr(rhino3dm.UnitSystem, name)
        assert units[0] / units[1] in (0.001, 1.0, 0.3048)


def test_lengths_keep_their_digits() -> None:
    assert point_of("p", {"X": 300.0, "Y": 0, "Z": 0}, MM).tolist() == [0.3, 0, 0]
    assert point_json(np.array([0.3, 0, 0]), MM) == {"X": 300.0, "Y": 0.0, "Z": 0.0}


def test_a_plane_is_a_pose_and_back() -> None:
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    plane = plane_json((turn, np.array([1.0, 2, 3])), MM)
    assert plane["Origin"] == {"X": 1000, "Y": 2000, "Z": 3000}
    assert plane["XAxis"] == {"X": 0, "Y": 1, "Z": 0}
    found, shift = plane_of("plane", plane, MM)
    assert np.allclose(found, turn, atol=1e-15)
    assert shift.tolist() == [1, 2, 3]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, [1000, 2000, 3000]
    transform = {f"M{i}{k}": matrix[i, k] for i in range(4) for k in range(4)}
    assert np.allclose(plane_of("plane", transform, MM)[0], turn, atol=1e-15)
    mirrored = transform | {"M22": -1.0}
    for broken in (
        transform | {"M00": 2.0},
        mirrored,
        transform | {"M33": math.nan},
        {**plane, "YAxis": plane["XAxis"]},
        {},
        3,
    ):
        with pytest.raises(InputError, match=r"^plane"):
            plane_of("plane", broken, MM)


def test_requests_of_older_clients_are_read() -> None:
    """Paths without braces, plain text without quotes, numbers that are not text, a byte order mark."""
    body = {"pointer": "/echo", "values": [
        {"ParamName": "RH_IN:Texts", "InnerTree": {"0": [{"type": "System.String", "data": "plain"}]}},
        {"ParamName": "Number", "InnerTree": {"0": [{"type": "System.Double", "data": 2.5}]}},
    ]}  # fmt: skip
    found, units, warnings = inputs_of(ECHO, request_of(b"\xef\xbb\xbf" + json.dumps(body).encode()))
    assert found["Texts"] == ["plain"]
    assert found["Number"] == 2.5
    assert units == M
    assert "metres are assumed" in warnings[0]


def test_one_input_twice_is_refused() -> None:
    with pytest.raises(InputError, match="stands twice"):
        inputs_of(ECHO, request("echo", {}) | {"values": [tree("Number", 1.0), tree("Number", 2.0)]})
