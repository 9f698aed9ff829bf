"""The server for Hops, over real HTTP: every component, what is too large, too slow or garbled, and how it ends.

By hand: a cube of 1 m on another weighs 2400 * 9.80665 = 23,535.96 N; on a slope of 60 degrees it slides, for
tan 60 = 1.73 is more than the friction of 0.84.
"""

import ast
import asyncio
import contextlib
import http.client
import json
import os
import random
import runpy
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from cyclopean.io import write_stones
from cyclopean.proof import verify
from laws import examples

for name in ("rhino3dm", "starlette", "uvicorn"):
    pytest.importorskip(name, reason=f"{name} of the extra rhino is not installed")

from cyclopean.design.stones.inventory import Inventory  # noqa: E402
from cyclopean.design.stones.quarry import quarry  # noqa: E402
from cyclopean.service.components.catalogue import COMPONENTS  # noqa: E402
from cyclopean.service.parameters import Context  # noqa: E402
from cyclopean.service.worker_pool import WorkerPool  # noqa: E402
from hops_cases import Geometry, box, mesh, one, outputs, points, request, serving, tower, two_stones, vector  # noqa: E402

ENDLESS = {"Relaxation": 10**9}  # of a wall: rounds that nobody waits for
LARGEST = 2**20
CLIENT = Path(__file__).parents[1] / "examples" / "rhino8_client.py"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder of stones, and one beside it that may not be read."""
    root = tmp_path_factory.mktemp("hops")
    for part in ("allowed", "other"):
        (root / part).mkdir()
        write_stones(root / part, Inventory(quarry(4, seed=1, volume=(0.6, 1.4), detail=1)))
    return root / "allowed"


@pytest.fixture(scope="module")
def server(folder):
    with serving("--workers", 2, "--seconds", 120, "--max-body", "1M", "--allow-folders", folder) as (address, _):
        yield Client(address)


class Client:
    """Says what Hops says."""

    def __init__(self, address):
        self.address = address

    def ask(self, method, path, body=None, **headers):
        """Status, content type and body of an answer."""
        connection = http.client.HTTPConnection(self.address, timeout=60)
        try:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            return answer.status, answer.headers.get_content_type(), answer.read()
        finally:
            connection.close()

    def solve(self, pointer, inputs, units="Millimeters", status=200):
        body = json.dumps(request(pointer, inputs, units)).encode()
        found, kind, answer = self.ask("POST", "/solve", body, **{"Content-Type": "application/json"})
        assert (found, kind) == (status, "application/json")
        return json.loads(answer)

    def done(self, pointer, inputs, units="Millimeters"):
        """The answer to a solve that goes well."""
        answer = self.solve(pointer, inputs, units)
        assert answer["errors"] == []
        assert [v["ParamName"] for v in answer["values"]] == [made.name for made in COMPONENTS[pointer].outputs]
        return answer


def test_descriptions(server) -> None:
    status, kind, body = server.ask("GET", "/")
    assert (status, kind) == (200, "application/json")
    listed = json.loads(body)
    assert [told["Uri"] for told in listed] == [f"/{path}" for path in COMPONENTS]
    for told in listed:
        assert json.loads(server.ask("GET", told["Uri"])[2]) == told
        assert server.ask("HEAD", told["Uri"])[0] == 200


def test_a_person_sees_a_page(server) -> None:
    status, kind, body = server.ask("GET", "/", Accept="text/html,*/*")
    assert (status, kind) == (200, "text/html")
    assert all(f'href="/{path}"' in body.decode() for path in COMPONENTS)
    assert server.ask("GET", "/check", Accept="text/html,*/*")[1] == "application/json"  # Hops tells a server by it


def test_the_signs_of_life_that_rhino_compute_gives(server) -> None:
    assert server.ask("GET", "/healthcheck")[2] == b"Healthy"
    assert server.ask("GET", "/activechildren")[2] == b"2"
    assert "cyclopean" in json.loads(server.ask("GET", "/version")[2])


def test_check(server) -> None:
    answer = server.done("check", {"Blocks": tower(), "Names": ["foot", "head"], "Fixed": [True, False]})
    assert one(answer, "Verdict") == "stable"
    assert outputs(answer)["Pairs"] == {"{0;0}": ["foot", "head"]}
    assert outputs(answer)["Resultants"]["{0}"][0]["Z"] == pytest.approx(23_535.96)
    outline = points(one(answer, "Contacts"))
    assert set(map(tuple, outline.round(6).tolist())) == {(x, y, 1000.0) for x in (0.0, 1000.0) for y in (0.0, 1000.0)}
    (lines,) = outputs(answer)["Forces"].values()
    assert max(line["To"]["Z"] - line["From"]["Z"] for line in lines) == pytest.approx(500.0)  # half a block
    assert verify(json.loads(one(answer, "Certificate"))).proved
    assert json.loads(one(answer, "Result"))["verdict"] == "stable"
    assert outputs(answer)["Motion"] == {"{0}": []}


def test_check_of_what_falls(server) -> None:
    answer = server.done("check", {"Blocks": tower(), "Tilt": 60.0, "Method": "rbe"})
    assert one(answer, "Verdict") == "unstable"
    still, moving = outputs(answer)["Motion"]["{0}"]
    assert still == {"X": 0, "Y": 0, "Z": 0}
    assert moving["X"] > 0.0
    assert verify(json.loads(one(answer, "Certificate"))).proved


def test_the_verdict_does_not_depend_on_the_units(server) -> None:
    """The same numbers in feet and in millimetres; a mesh turned inside out is turned back, and said."""
    for units in ("Feet", "Millimeters"):
        answer = server.done("check", {"Blocks": tower()}, units)
        assert one(answer, "Verdict") == "stable"
        assert answer["warnings"] == []
    corners, faces = box((0, 0, 1), (1, 1, 2))
    answer = server.done("check", {"Blocks": [tower()[0], mesh(corners, [f[::-1] for f in faces])]})
    assert one(answer, "Verdict") == "stable"
    assert "inside out" in answer["warnings"][0]


def test_limit(server) -> None:
    """The cube slides before it tips: at a push of 0.84 of its weight, and at a tilt of atan 0.84 = 40.03 degrees."""
    answer = server.done("limit", {"Blocks": tower(), "Push": vector(1.0, 0, 0)})
    assert one(answer, "Stands At") == pytest.approx(0.84, abs=1e-6) == one(answer, "Falls At")
    assert outputs(answer)["Governing"]["{0}"] == ["b0", "b1"]
    assert verify(json.loads(one(answer, "Certificate"))).proved
    assert one(server.done("limit", {"Blocks": tower()}), "Angle") == pytest.approx(40.0303, abs=1e-3)
    load = {"Load": vector(1000.0, 0, 0), "Load Block": "b1"}
    assert one(server.done("limit", {"Blocks": tower(), **load}), "Stands At") == pytest.approx(
        0.84 * 23.53596, rel=1e-6
    )


def test_a_polygonal_wall_is_checked_by_its_meshes_or_as_a_model(server) -> None:
    """Both have the same joints; a model keeps the names."""
    wall = server.done("polygonal-wall", {"Columns": 4, "Rows": 3, "Openings": ["1.2,0,0.6,0.9,arch"]}, "Meters")
    stones = [Geometry("Mesh", made) for made in (one(wall, "Ground"), *outputs(wall)["Stones"]["{0}"])]
    fixed = [True] + [False] * (len(stones) - 1)
    meshes = server.done("check", {"Blocks": stones, "Fixed": fixed, "Method": "rbe"}, "Meters")
    model = server.done("check", {"Model": one(wall, "Model"), "Method": "rbe"}, "Meters")
    assert one(meshes, "Verdict") == one(model, "Verdict") == "stable"
    count = len(outputs(model)["Contacts"])
    assert len(outputs(meshes)["Contacts"]) == count == len(outputs(wall)["Joints"]["{0}"])
    assert {name for pair in outputs(model)["Pairs"].values() for name in pair} == {
        "ground",
        *outputs(wall)["Names"]["{0}"],
    }


def test_a_wall_is_drawn_by_curves(server) -> None:
    """Two stones over half a circle, drawn in mm in an upright plane: 2 - pi / 8 m2, on two springings."""
    import rhino3dm

    def polyline(*corners):
        line = rhino3dm.Polyline.CreateFromPoints([rhino3dm.Point3d(x, 7.0, z) for x, z in corners])
        return Geometry("PolylineCurve", line.ToPolylineCurve().Encode())

    ends = [rhino3dm.Point3d(x, 7.0, z) for x, z in ((1500, 0), (1000, 500), (500, 0))]
    arc = Geometry("ArcCurve", rhino3dm.ArcCurve.CreateFromArc(rhino3dm.Arc(*ends)).Encode())
    frame = polyline((500, 0), (0, 0), (0, 1000), (2000, 1000), (2000, 0), (1500, 0))
    wall = server.done(
        "polygonal-wall", {"Drawing": [frame, arc, polyline((1000, 500), (1000, 1000))], "Depth": 0.5}, "Millimeters"
    )
    model = json.loads(one(wall, "Model"))
    assert [block["id"] for block in model["blocks"]] == ["ground", "c01-b01", "c01-b02"]
    assert len(model["contacts"]) == 3
    assert "curved lines have facets" in wall["warnings"][0]
    refused = server.solve("polygonal-wall", {"Drawing": [frame], "Columns": 4})
    assert refused["errors"] == ["columns: is of a pattern from seeds; leave it out, or Drawing"]


def test_a_wall_lies_on_a_surface_or_on_a_mesh(server) -> None:
    """A tilted rectangle of 2 x 1 m as a surface and as a mesh, in mm: the same stones, but for rounding."""
    import rhino3dm

    corner = [(0, 0, 0), (2, 0, 0), (2, 0.6, 0.8), (0, 0.6, 0.8)]
    rails = [
        rhino3dm.LineCurve(*(rhino3dm.Point3d(*(1000 * x for x in corner[k])) for k in ends))
        for ends in ((0, 1), (3, 2))
    ]
    brep = rhino3dm.Brep.CreateFromSurface(
        rhino3dm.NurbsSurface.CreateRuledSurface(*(rail.ToNurbsCurve() for rail in rails))
    )
    face = Geometry("Brep", brep.Encode())
    options = {"Columns": 4, "Rows": 2, "Density": 2400.0, "Quoins": "auto"}
    answers = [
        server.done("polygonal-wall", {**options, **way}, "Millimeters")
        for way in ({"Surface": face}, {"Surface Mesh": mesh(corner, [(0, 1, 2, 3)])})
    ]
    for answer in answers:
        assert one(answer, "Coverage") == pytest.approx(1.0, abs=1e-9)
        assert one(answer, "Crossings") >= 0
        assert "2 x 1 m laid flat" in answer["warnings"][0]
    stones = [[points(made) for made in outputs(answer)["Stones"]["{0}"]] for answer in answers]
    assert max(np.abs(a - b).max() for a, b in zip(*stones, strict=True)) < 0.01
    both = server.solve("polygonal-wall", {"Surface": face, "Radius": 3.0})
    assert both["errors"] == ["Radius: connect either Surface or Radius"]


def test_stones_are_matched_carved_and_checked(server) -> None:
    """The chain that a definition has: what one component gives, the next one takes."""
    match = server.done("match", {"Stones": two_stones(), "Cells": tower(), "Points": 256})
    assert outputs(match)["Cell"]["{0}"] == [1]
    assert 0.0 < one(match, "Lambda") < 0.4
    placed = [Geometry("Mesh", made) for made in outputs(match)["Placed"]["{0}"]]
    planes = [Geometry("Plane", made) for made in outputs(match)["Planes"]["{0}"]]
    stone = points(outputs(match)["Placed"]["{0}"][0]).mean(axis=0)
    assert np.abs(stone - [500, 500, 1500]).max() < 150.0  # in its cell, in mm
    cells = {"Cells": tower(), "Cell": outputs(match)["Cell"]["{0}"]}
    carved = server.done("carve", {"Placed": placed, "Planes": planes, **cells})
    assert one(carved, "Lambda") == pytest.approx(one(match, "Lambda"), abs=1e-6)
    assert one(carved, "Touching") == pytest.approx(1.0, abs=1e-6)
    head, first, *_ = outputs(carved)["Cut List"]["{0}"]
    assert head.startswith("stone,cell,cut")
    assert first.startswith("s0,b1,")
    assert one(server.done("check", {"Model": one(carved, "Model")}), "Verdict") == "stable"


def test_sequence(server) -> None:
    third = mesh(*box((0, 0, 2), (1, 1, 3)))
    answer = server.done("sequence", {"Blocks": [third, *tower()]})
    assert outputs(answer)["Order"]["{0}"] == [2, 0]
    assert outputs(answer)["Layers"] == {"{0;0}": [2], "{0;1}": [0]}
    assert outputs(answer)["Verdicts"]["{0}"] == ["stable", "stable"]
    assert outputs(answer)["Way In"]["{0;0}"][0]["Z"] == -1.0


def test_a_given_order(server) -> None:
    """The upper stone first: it hangs in the air, on a shore until the lower one is in."""
    third = mesh(*box((0, 0, 2), (1, 1, 3)))
    answer = server.done("sequence", {"Blocks": [third, *tower()], "Given Order": [0, 2]})
    assert outputs(answer)["Order"]["{0}"] == [0, 2]
    assert outputs(answer)["Nearest"]["{0}"] == [2, 0]
    assert outputs(answer)["Verdicts"]["{0}"] == ["unstable", "stable"]
    (said,) = outputs(answer)["Put Up"]["{0}"]
    assert said.startswith("shore under ")
    (line,) = server.solve("sequence", {"Blocks": [third, *tower()], "Given Order": [0, 7]})["errors"]
    assert line == "Given Order: block '7' is not in the model; take out or correct"


def test_settle(server) -> None:
    answer = server.done("settle", {"Stones": two_stones(), "Length": 1.3, "Thickness": 1.3})
    assert sorted(outputs(answer)["Stone"]["{0}"]) == [0, 1]
    assert outputs(answer)["Sits"]["{0}"] == [True, True]
    assert max(points(made)[:, 2].max() for made in outputs(answer)["Placed"]["{0}"]) == pytest.approx(2200, abs=100)


def test_a_folder_is_read_only_where_it_is_allowed(server, folder) -> None:
    answer = server.done("settle", {"Folder": ".", "Look Ahead": 2}, "Meters")
    assert len(outputs(answer)["Stone"]["{0}"]) + len(outputs(answer)["Left Over"]["{0}"]) == 4
    os.symlink(folder.parent / "other", folder / "link")
    for outside in ("..", "../other", str(folder.parent / "other"), "/", "link", "\0", "~", "a/" * 5000):
        (line,) = server.solve("settle", {"Folder": outside})["errors"]
        assert line.startswith(("Folder: ", str(folder)))
        assert str(folder.parent / "other") not in line.partition("'")[0]


@pytest.mark.parametrize(
    ("pointer", "inputs", "said"),
    [
        ("check", {}, "Blocks: nothing is connected"),
        ("check", {"Blocks": tower()[:1], "Model": "{}"}, "Blocks: connect either"),
        ("check", {"Model": "[]"}, "Model must be an object"),
        ("check", {"Model": '{"schema": "x"}'}, "Model: is not a model"),
        ("check", {"Blocks": tower(), "Names": ["a"]}, "Names: 1 values for 2 blocks"),
        ("check", {"Blocks": tower(), "Names": ["a", "a"]}, "Names: 'a' stands twice"),
        ("check", {"Blocks": tower(), "Fixed": [True]}, "Fixed: 1 values for 2 blocks"),
        ("check", {"Blocks": tower(), "Fixed": [False, False]}, "Fixed: no block is held"),
        ("check", {"Blocks": [mesh(*box((0, 0, 0), (1, 1, 1))[:1], box((0,) * 3, (1,) * 3)[1][:3])]}, "is open"),
        ("check", {"Blocks": tower(), "Friction": -1.0}, "Friction -1: expected a number >= 0"),
        ("check", {"Blocks": tower(), "Density": 0.0}, "Density 0: expected a positive number of kg/m3"),
        ("check", {"Blocks": tower(), "Method": "fem"}, "Method: 'fem' is not one of cra, rbe"),
        ("check", {"Blocks": tower(), "Density": 1e13}, "Density: 1e+13 is beyond 1e+12"),
        ("check", {"Blocks": tower(), "Weights": "1"}, "Weights: '1' should be two numbers"),
        ("check", {"Blocks": tower(), "Settlement": ["b0"]}, "Settlement: 'b0' should be BLOCK:DX,DY,DZ"),
        ("check", {"Blocks": tower(), "Tension": 1.0, "Cohesion": 1.0}, "Tension and Cohesion say the same"),
        ("limit", {"Blocks": tower(), "Load": vector(1.0, 0, 0)}, "Load: connect both"),
        ("limit", {"Blocks": tower(), "Load": vector(1.0, 0, 0), "Load Block": "b9"}, "no block 'b9'"),
        ("limit", {"Blocks": tower(), "Push": vector(0.0, 0, 0)}, "push: is zero"),
        ("polygonal-wall", {"Width": -1.0}, "width"),
        ("polygonal-wall", {"Columns": 10**6}, "Columns: more than"),
        ("polygonal-wall", {"Openings": ["door"]}, "Openings: 'door' is not a number"),
        ("polygonal-wall", {"Radius": 0.01}, ""),
        ("match", {"Stones": tower(), "Cells": []}, r"Cells (C): nothing is connected"),
        ("match", {"Cells": tower()}, "Stones: nothing is connected"),
        ("match", {"Stones": tower(), "Cells": tower(), "Gap": 2.0}, "Gap: 2 is not between"),
        ("match", {"Stones": tower(), "Cells": tower(), "Points": 10**6}, "Points: 1000000"),
        ("carve", {"Placed": tower(), "Cells": tower(), "Cell": [1, 7]}, "Cell: there is no block 7"),
        ("carve", {"Placed": tower(), "Cells": tower(), "Cell": [0, 1]}, "held"),
        ("carve", {"Placed": tower(), "Cells": tower()}, "Cell: nothing is connected"),
        ("settle", {"Stones": tower(), "Wythes": 7}, "wythes"),
        ("settle", {"Stones": tower(), "Length": -2.0}, "length: must be more than 0"),
    ],
)
def test_what_is_refused_is_told_on_the_component(server, pointer, inputs, said) -> None:
    answer = server.solve(pointer, inputs)
    (line,) = answer["errors"]
    assert said in line
    assert answer["values"] == []
    assert "internal" not in line
    assert "--" not in line
    assert "\n" not in line


def test_the_script_for_rhino_asks_the_same(server) -> None:
    """Its plain half, here; the other half runs in Rhino only, whose Python is 3.9."""
    source = CLIENT.read_text()
    ast.parse(source, feature_version=(3, 9))
    client = runpy.run_path(str(CLIENT))
    address = f"http://{server.address}"
    inputs = {"Blocks": [client["item"](json.dumps(m), "Mesh") for m in tower()], "Fixed": [client["item"](True)] * 2}
    inputs["Fixed"][1] = client["item"](False)
    found = client["solve"]("check", inputs, "Millimeters", address)
    assert found["Verdict"] == ["stable"]
    assert found["Pairs"] == [["b0", "b1"]]
    assert len(found["Forces"]) == len(found["Contacts"]) == 1
    with pytest.raises(RuntimeError, match="Blocks: nothing is connected"):
        client["solve"]("check", {}, "Millimeters", address)
    with pytest.raises(RuntimeError, match="no component 'nothing'"):
        client["solve"]("nothing", {}, "Millimeters", address)
    with pytest.raises(RuntimeError, match="no server answers"):
        client["solve"]("check", {}, "Millimeters", "http://127.0.0.1:9")
    plain = ast.parse(source.partition("# What follows runs in Rhino only.")[0])
    imported = {
        alias.name.partition(".")[0] for node in ast.walk(plain) if isinstance(node, ast.Import) for alias in node.names
    }
    assert imported <= sys.stdlib_module_names


def test_a_component_is_solved_at_its_own_address_too(server) -> None:
    body = json.dumps(request("", {"Blocks": tower()})).encode()
    assert one(json.loads(server.ask("POST", "/check", body)[2]), "Verdict") == "stable"


def test_what_is_not_there_is_told_in_json(server) -> None:
    for method, path, status in (
        ("GET", "/nothing", 404), ("GET", "/a/b", 404), ("PUT", "/solve", 405), ("GET", "/solve", 404),
        ("POST", "/nothing", 404), ("POST", "/", 405), ("DELETE", "/check", 405),
    ):  # fmt: skip
        body = b'{"values": []}' if method == "POST" else None
        found, kind, answer = server.ask(method, path, body)
        assert (found, kind) == (status, "application/json"), (method, path)
        assert json.loads(answer)["errors"]
        assert json.loads(answer)["Inputs"] == []


def test_what_is_too_large_is_refused_before_it_is_read(server) -> None:
    body = json.dumps(request("check", {"Model": "x" * LARGEST})).encode()
    status, _, answer = server.ask("POST", "/solve", body)
    assert status == 413
    assert "1 MB" in json.loads(answer)["errors"][0]
    connection = http.client.HTTPConnection(server.address, timeout=30)  # in pieces, without a length
    headers = {"Transfer-Encoding": "chunked"}
    connection.request("POST", "/solve", iter([b" " * 2**16] * 40), headers, encode_chunked=True)
    assert connection.getresponse().status == 413
    connection.close()
    sent = []  # a body without an end is not listened to for ever
    pieces = (sent.append(k) or b" " * 2**16 for k in range(1000))
    connection = http.client.HTTPConnection(server.address, timeout=30)
    with contextlib.suppress(OSError):
        connection.request("POST", "/solve", pieces, headers, encode_chunked=True)
    connection.close()
    assert len(sent) < 500
    connection = http.client.HTTPConnection(server.address, timeout=30)
    connection.putrequest("POST", "/solve")
    connection.putheader("Content-Length", str(10**14))
    connection.endheaders()
    assert connection.getresponse().status == 413
    connection.close()
    assert server.ask("POST", "/solve", b"x", **{"Content-Encoding": "gzip"})[0] == 415


def test_web_pages_of_others_are_not_answered(server) -> None:
    body = json.dumps(request("check", {"Blocks": tower()})).encode()
    port = server.address.rpartition(":")[2]
    for headers in ({"Host": "evil.example"}, {"Host": f"evil.example:{port}"}, {"Host": "["}, {"Origin": "null"},
                    {"Origin": "http://evil.example"}, {"Origin": "http://["}):  # fmt: skip
        assert server.ask("POST", "/solve", body, **headers)[0] == 403
        assert server.ask("GET", "/", **headers)[0] == 403
    for headers in ({"Host": f"localhost:{port}"}, {"Origin": f"http://{server.address}"}):
        assert server.ask("GET", "/", **headers)[0] == 200


def test_two_at_once(server) -> None:
    """An endless solve in one process does not keep the other from answering; it is ended when its client goes."""
    body = json.dumps(request("polygonal-wall", ENDLESS)).encode()
    slow = http.client.HTTPConnection(server.address, timeout=60)
    slow.request("POST", "/solve", body)
    time.sleep(0.2)
    answers = [None] * 3
    hands = [threading.Thread(target=lambda k=k: answers.__setitem__(k, server.solve("check", {"Blocks": tower()})))
             for k in range(3)]  # fmt: skip
    for hand in hands:
        hand.start()
    for hand in hands:
        hand.join()
    slow.close()
    assert [one(answer, "Verdict") for answer in answers] == ["stable"] * 3


def test_garbage_never_takes_it_down(server) -> None:
    """Requests with one thing wrong with each: every one is answered in JSON, and none by our fault."""
    dice = random.Random(1)
    seeds = [
        request("check", {"Blocks": tower(), "Names": ["a", "b"], "Friction": 0.7}),
        request("polygonal-wall", {"Columns": 3, "Rows": 2}),
        request("settle", {"Stones": two_stones(), "Length": 1.3}),
        request("carve", {"Placed": tower()[1:], "Cells": tower()}),
    ]
    connection = http.client.HTTPConnection(server.address, timeout=60)
    statuses = set()
    for k in range(examples(600)):
        body = mutated(dice, seeds[k % len(seeds)])
        connection.request("POST", "/solve", body)
        answer = connection.getresponse()
        found = json.loads(answer.read())
        statuses.add(answer.status)
        assert answer.status in (200, 400, 404) or found["errors"][0] == "Bad inputs", (body[:300], found["errors"])
        assert found["errors"] or found["values"]
        assert not any("internal" in line or "\n" in line for line in found["errors"]), (body, found["errors"])
    connection.close()
    assert statuses == {200, 400, 404, 500}
    assert one(server.solve("check", {"Blocks": tower()}), "Verdict") == "stable"


NASTY = (
    None, True, -1, 0, 1.5, 1e308, -1e-300, 10**30, float("nan"), float("inf"), "", "x", "0.5", "\0", "\ud800",
    "[" * 100_000, '"', "{}", "null", "NaN", "-Infinity", [], {}, [[]], {"{0}": []}, {"{0}": [None]}, {"{0}": [{}]},
)  # fmt: skip


def mutated(dice, seed):
    """The request with one place changed, or its text cut or garbled."""
    body = json.dumps(seed)
    way = dice.random()
    if way < 0.1:
        return body[: dice.randrange(len(body))].encode()
    if way < 0.2:
        at = dice.randrange(len(body))
        return (body[:at] + chr(dice.randrange(256)) + body[at + 1 :]).encode("latin-1")
    made = json.loads(body)
    holder, key = dice.choice(list(places(made)))
    value = holder[key]
    if isinstance(value, str) and len(value) > 100 and dice.random() < 0.5:
        at = dice.randrange(len(value))  # a mesh that is cut off, or has other bytes in it
        holder[key] = dice.choice([value[:at] + '"}', value[:at] + dice.choice("AZz09+/") + value[at + 1 :]])
    elif dice.random() < 0.2 and isinstance(holder, dict):
        del holder[key]
    else:
        holder[key] = dice.choice(NASTY)
    return json.dumps(made).encode()


def places(node):
    """Every (holder, key) in a document."""
    for key, value in node.items() if isinstance(node, dict) else enumerate(node):
        yield node, key
        if isinstance(value, dict | list):
            yield from places(value)


def test_a_solve_that_takes_too_long_is_ended() -> None:
    async def story():
        pool = WorkerPool(1, Context(seconds=1.0))
        try:
            (first,) = pool._all
            answer = await pool.answer("", json.dumps(request("polygonal-wall", ENDLESS)).encode())
            assert not first._process.is_alive()
            assert first not in pool._all
            return answer
        finally:
            pool.close()

    status, said = asyncio.run(story())
    assert status == 504
    assert "ended after 1 s" in json.loads(said)["errors"][0]


def test_a_dead_process_is_replaced_and_one_that_nobody_waits_for_is_ended() -> None:
    endless = json.dumps(request("polygonal-wall", ENDLESS)).encode()

    async def story():
        pool = WorkerPool(1, Context(seconds=3600.0))
        try:
            (first,) = pool._all
            solving = asyncio.ensure_future(pool.answer("", endless))
            await asyncio.sleep(0.1)
            first._process.kill()
            died = await solving
            (second,) = pool._all
            left = asyncio.ensure_future(pool.answer("", endless))
            await asyncio.sleep(0.1)
            left.cancel()  # as when a client goes
            async with asyncio.timeout(30.0):
                while second in pool._all:
                    await asyncio.sleep(0.02)
            (third,) = pool._all
            assert third._process.is_alive()
            assert not second._process.is_alive()
            return died, third
        finally:
            pool.close()

    (status, said), last = asyncio.run(story())
    assert status == 500
    assert "ended without an answer" in json.loads(said)["errors"][0]
    assert not last._process.is_alive()


def test_it_ends_at_ctrl_c_and_leaves_nothing() -> None:
    with serving("--seconds", 30) as (address, process):
        client = Client(address)
        hand = threading.Thread(target=lambda: contextless(client))
        hand.start()
        time.sleep(0.5)
        children = subprocess.run(
            ["ps", "-o", "pid=", "--ppid", str(process.pid)], capture_output=True, text=True
        ).stdout
        process.send_signal(signal.SIGINT)
        output, complaint = process.communicate(timeout=20)
        hand.join()
    assert (process.returncode, output, complaint) == (0, "", "")
    patience = time.monotonic() + 30.0  # the helper of Python's own that cleans up after processes is the last to go
    while (left := [pid for pid in children.split() if os.path.exists(f"/proc/{pid}")]) and time.monotonic() < patience:
        time.sleep(0.1)
    assert left == []


def contextless(client):
    """An endless request whose answer never comes."""
    try:
        client.solve("polygonal-wall", ENDLESS)
    except (OSError, http.client.HTTPException, AssertionError, ValueError):
        pass


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--hops"),
        (("--hops", "--port", "99999"), "--port 99999"),
        (("--hops", "--port", "x"), "--port: 'x'"),
        (("--hops", "--workers", "0"), "--workers 0"),
        (("--hops", "--seconds", "0"), "--seconds 0"),
        (("--hops", "--max-body", "64X"), "--max-body: '64X'"),
        (("--hops", "--max-body", "10"), "--max-body: 10"),
        (("--hops", "--max-body", ""), "--max-body: ''"),
        (("--hops", "--allow-folders", "nowhere"), "--allow-folders nowhere: no such folder"),
        (("--hops", "--host", "no.such.host.invalid"), "--host no.such.host.invalid"),
        (("--hops", "--host", "192.0.2.1"), "--port 5000: cannot listen on 192.0.2.1"),
    ],
)
def test_bad_options_are_one_line(run, options, said) -> None:
    status, output, complaint = run("serve", *options)
    assert (status, output) == (2, "")
    (line,) = [line for line in complaint.splitlines() if "warning" not in line]
    assert said in line


def test_a_port_that_is_taken_is_one_line(run, server) -> None:
    status, output, complaint = run("serve", "--hops", "--port", server.address.rpartition(":")[2])
    assert (status, output, complaint.count("\n")) == (2, "", 1)
    assert "cannot listen on 127.0.0.1" in complaint


def test_without_the_extra_it_names_it(run, monkeypatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    status, _, complaint = run("serve", "--hops")
    assert status == 2
    assert "pip install 'cyclopean[rhino]'" in complaint


def test_another_host_is_warned_of(run) -> None:
    _, _, complaint = run("serve", "--hops", "--host", "192.0.2.1")
    assert "no authentication" in complaint
