"""Files of other programs: what goes out comes back, other readers agree, what is lost is said, damage is refused.

Mutants that these tests must kill: a face reversed in 3DEC; Vertices.Add without SetPoint3dAt (single precision); the
unit of a 3DM taken for metres; the group of a moved stone taken from its user text; polygons of an edited mesh taken
from the record; forces of a result given to contacts of another model; `index` of interfaces dropped.
"""

import csv
import gc
import importlib
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cyclopean import design
from cyclopean.analysis import check
from cyclopean.assembly import Assembly, Block, BodyLoad, Combination, Contacts, FrictionPair, Load, SurfaceLoad
from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults
from cyclopean.io import archives, read_findings, read_model, result_dict, write_exchange, write_json
from cyclopean.io.blocklist import blocklist_text, not_convex
from cyclopean.io.findings import Findings
from cyclopean.io.formats import FORMATS, exchange_format
from cyclopean.io.model_json import model_dict
from cyclopean.io.palette import linear, stone_colours
from laws import examples

WHOLE = [form.suffix for form in FORMATS.values() if form.holds is None and form.writer]
SINGLE = 2.0**-23  # GLB: single precision, relative to the size of a block


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def prism(corners, height, shift, group=None, **fields):
    """A prism over a regular polygon: faces of three, four and more corners."""
    angle = 2 * np.pi * np.arange(corners) / corners
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(corners)], 1)
    vertices = np.concatenate([ring, ring + np.array([0, 0, height])]) + np.array(shift, float)
    sides = [(k, (k + 1) % corners, corners + (k + 1) % corners, corners + k) for k in range(corners)]
    faces = (tuple(range(corners - 1, -1, -1)), tuple(range(corners, 2 * corners)), *sides)
    return Block(fields.pop("id", f"b{shift[2]:g}"), vertices, faces, group=group, **fields)


NAMES = ["stone", " outer blanks  ", "a,b", 'say "so"', "it's", "ümläut 日本𝄞", "12", "true", "null", "[1]", "back\\"]
NAMES += ["a::b", "# no comment", "\\X2\\00E9\\X0\\", "a;b", "=1+1", '"quoted"', "NaN", "'"]
names = st.one_of(
    st.sampled_from(NAMES),
    st.text(st.characters(exclude_categories=("C", "Zl", "Zp")), min_size=1, max_size=8).filter(str.isprintable),
)
numbers = st.floats(-50, 50).map(lambda x: x if abs(x) > 1e-9 else 0.0)
vectors = st.tuples(numbers, numbers, numbers)


@st.composite
def models(draw):
    """Prisms anywhere, with all that a model may say; contacts need not lie on them, for no file asks that."""
    ids = draw(st.lists(names, min_size=2, max_size=4, unique=True))
    blocks = tuple(
        prism(
            draw(st.integers(3, 7)),
            draw(st.floats(0.1, 3)),
            draw(vectors),
            draw(st.none() | names),
            id=name,
            density=draw(st.none() | st.floats(1, 1e4)),
            fixed=draw(st.none() | st.booleans()),
            material=draw(st.none() | names),
            held=draw(st.sampled_from([(), ("x",), ("z", "rx")])),
        )
        for name in ids
    )
    ends = st.tuples(st.integers(0, len(ids) - 1), st.integers(0, len(ids) - 1)).filter(lambda p: p[0] != p[1])
    pairs = draw(st.lists(ends, max_size=4))
    polygons = [blocks[a].vertices[: draw(st.integers(3, len(blocks[a].vertices) // 2))] for a, _ in pairs]
    shares = st.none() | st.floats(0, 2)
    contacts = Contacts.of(pairs, polygons, [draw(shares) for _ in pairs], [draw(shares) for _ in pairs])
    loads = draw(st.lists(st.builds(Load, st.integers(0, 1), vectors.map(np.array), vectors.map(np.array)), max_size=2))
    spread = (SurfaceLoad(0, face=1, pressure=3.5), BodyLoad(1, body=np.array([0, 1.5, 0])))
    actions = draw(st.sampled_from([(), spread]))
    known = list(dict.fromkeys(b.material for b in blocks if b.material is not None))
    friction = (FrictionPair(known[0], known[-1], 0.55),) if known else ()
    combined = (Combination("all", (("self", 1.35),)),) if draw(st.booleans()) else ()
    given_contacts = contacts if draw(st.booleans()) else None
    return Assembly(blocks, given_contacts, tuple(loads), draw(names), actions, combined, friction)


@pytest.mark.parametrize("suffix", WHOLE)
@given(model=models())
@settings(
    max_examples=examples(20),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
def test_nothing_is_lost(suffix, model, monkeypatch):
    """The whole document comes back: every digit, GLB but for the rounding of vertices."""
    monkeypatch.setattr("cyclopean.io.rhino.refuse_damaged", lambda path, data: None)  # a process each time
    assert write_exchange("a" + suffix, model) == ()
    again, warnings = read_model("a" + suffix)
    assert warnings == ()
    before, after = model_dict(model), model_dict(again)
    if suffix == ".glb":
        for was, now, block in zip(before["blocks"], after["blocks"], model.blocks, strict=True):
            error = np.abs(np.array(now.pop("vertices")) - was.pop("vertices")).max()
            assert error <= SINGLE * np.linalg.norm(np.ptp(block.vertices, axis=0))
    assert after == before


@given(model=models())
@settings(max_examples=examples(30), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_obj_keeps_ids_groups_order_and_every_digit(model):
    write_exchange("a.obj", model)
    again, _ = read_model("a.obj", "m")
    for was, now in zip(model.blocks, again.blocks, strict=True):
        assert (now.id, now.group, now.faces) == (was.id, was.group, was.faces)
        assert (now.vertices == was.vertices).all()


@given(model=models())
@settings(max_examples=examples(30), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_ply_keeps_ids_order_and_every_digit(model):
    write_exchange("a.ply", model)
    again, _ = read_model("a.ply", "m")
    for was, now in zip(model.blocks, again.blocks, strict=True):
        assert (now.id, now.faces, now.vertices.tolist()) == (was.id, was.faces, was.vertices.tolist())


def test_an_empty_list_of_contacts_is_not_a_missing_one():
    for suffix in WHOLE:
        for contacts in (None, Contacts.of([], [])):
            write_exchange("a" + suffix, Assembly((prism(4, 1.0, (0, 0, 0)),), contacts))
            again, _ = read_model("a" + suffix)
            assert (again.contacts is None) == (contacts is None), suffix


def test_a_block_of_two_pieces_with_a_vertex_too_many_stays_one_block():
    one, other = prism(5, 1.0, (0, 0, 0)), prism(3, 1.0, (9, 0, 0))
    faces = (*other.faces, *(tuple(i + 6 for i in face) for face in one.faces))
    both = Block("both", np.concatenate([other.vertices, one.vertices, [[7.0, 7, 7]]]), faces)
    for suffix in WHOLE:
        write_exchange("a" + suffix, Assembly((both,)))
        again, _ = read_model("a" + suffix)
        assert (len(again), again.blocks[0].faces, len(again.blocks[0].vertices)) == (1, faces, 17), suffix


def test_warped_polygons_come_back():
    """IFC wants flat faces: they are cut up there, and put together again."""
    bent = prism(6, 1.0, (0, 0, 0))
    vertices = bent.vertices.copy()
    vertices[8, 2] += 0.1
    for suffix in WHOLE:
        write_exchange("a" + suffix, Assembly((replace(bent, vertices=vertices),)))
        assert read_model("a" + suffix)[0].blocks[0].faces == bent.faces, suffix
    ifc = importlib.import_module("ifcopenshell").open("a.ifc")
    assert len(ifc.by_type("IfcIndexedPolygonalFace")) > 8


# --- what a result adds


@pytest.fixture(scope="module")
def arch():
    """An arch, and the file of its check."""
    model = design.arch(5, span=3.0, thickness=0.5)
    model = replace(model, loads=(Load(3, np.array([0.0, 10, -50]), np.array([0.1, 0.5, 1.5])),))
    return model, result_dict(check(model))


@pytest.fixture
def found(arch):
    margins = {"friction": {"stands": 0.4}, "joints": None, "tilt": {"stands": 12.5}}
    write_json("result.json", arch[1] | {"margins": margins})
    return read_findings(["result.json"], arch[0])


def test_findings_by_hand(found, arch):
    """The forces at the joints of a voussoir carry its weight, in world axes; its utilisation is the worse of two."""
    model, findings, warnings = found
    assert warnings == ()
    margins = {"friction share": 0.4, "tilt degrees": 12.5}
    assert dict(findings.model) == {"verdict": "stable", "method": "cra"} | margins
    k = 2
    weight = 2400.0 * 9.80665 * model.mass.volume[k]
    sums = [state.force.sum(axis=0) for state in findings.contact]
    below = next(i for i, (a, b) in enumerate(zip(model.contacts.a, model.contacts.b, strict=True)) if b == k)
    above = next(i for i, (a, b) in enumerate(zip(model.contacts.a, model.contacts.b, strict=True)) if a == k)
    np.testing.assert_allclose(sums[below] - sums[above], [0, 0, weight], atol=1e-6 * weight)
    worst = max(findings.contact[i].utilisation for i in (below, above))
    assert findings.block[model.blocks[k].id] == {"utilisation": worst}


def test_contacts_that_a_check_found_go_along(arch):
    write_json("result.json", arch[1])
    bare = replace(arch[0], contacts=None)
    model, findings, _ = read_findings(["result.json"], bare)
    assert len(model.contacts) == len(findings.contact) == len(arch[1]["forces"])


def test_matches_and_sequences_tell_of_blocks(arch):
    model = arch[0]
    first, second = (block.id for block in model.blocks[:2])
    row = {"stone": "scan 7", "cell": first, "lambda": 0.25, "gap": 0.1}
    numbers = {"Lambda": 0.25, "gap": 0.1, "J": {"before": 0.9, "after": 0.8}}
    write_json("match.json", {"schema": "cyclopean.match/1", "placements": [row]} | numbers)
    write_json("info.json", {"schema": "cyclopean.info/1", "interlock": {"J": 0.7}})
    write_json(
        "order.json", {"schema": "cyclopean.sequence/1", "order": [second, first], "layers": [[second], [first]]}
    )
    _, findings, _ = read_findings(["match.json", "order.json"], model)
    assert findings.model == {"Lambda": 0.25, "gap": 0.1, "J": 0.8}
    assert read_findings(["match.json", "info.json"], model)[1].model["J"] == 0.7
    told = {"stone": "scan 7", "lambda": 0.25, "gap": 0.1, "order": 2, "course": 2}
    assert findings.block == {first: told, second: {"order": 1, "course": 1}}


def test_files_of_another_model_are_refused(arch):
    model, result = arch
    cases = [
        ({"schema": "cyclopean.model/1"}, "its schema is the text 'cyclopean.model/1'"),
        ([1], "its schema is null"),
        ({"schema": "cyclopean.info/1"}, "holds no interlock"),
        ({"schema": "cyclopean.match/1", "placements": [], "J": {"after": "1"}}, "J: after"),
        ({"schema": "cyclopean.sequence/1", "order": ["nobody"]}, "order[0] names block 'nobody'"),
        (result | {"forces": result["forces"][1:]}, "its contacts are not those of the model"),
        (result | {"forces": [row | {"force": row["force"][1:]} for row in result["forces"]]}, "one force a corner"),
        (result | {"forces": [row | {"a": "x"} for row in result["forces"]]}, "names block 'x'"),
    ]
    for data, line in cases:
        with open("f.json", "w") as stream:
            json.dump(data, stream)
        with pytest.raises(InputError) as caught:
            read_findings(["f.json"], model)
        assert line in str(caught.value)
        assert str(caught.value).startswith("f.json: ")
        assert "\n" not in str(caught.value)


def test_an_unstable_result_says_that_it_holds_no_forces(arch):
    write_json("f.json", {key: value for key, value in arch[1].items() if key != "forces"} | {"verdict": "unstable"})
    _, findings, warnings = read_findings(["f.json"], arch[0])
    assert findings.contact == ()
    assert warnings == ("f.json: holds no forces, because its verdict is unstable",)


# --- Rhino


def opened(name="a.3dm"):
    return importlib.import_module("rhino3dm").File3dm.Read(name)


def texts(item):
    return dict(item.Attributes.GetUserStrings())


def test_rhino_file_by_hand(found):
    """What a designer sees: meshes on layers by group, polylines for contacts, lines for forces; in metres."""
    model, findings, _ = found
    write_exchange("a.3dm", model, findings)
    file = opened()
    layers = {layer.Index: layer.FullPath for layer in file.Layers}
    items = [(texts(item), item) for item in file.Objects]
    stones = [(text, item) for text, item in items if text["cyclopean"] == "stone"]
    assert str(file.Settings.ModelUnitSystem) == "UnitSystem.Meters"
    assert [item.Attributes.Name for _, item in stones] == [block.id for block in model.blocks]
    assert {layers[item.Attributes.LayerIndex] for _, item in stones} == {"Stones::springers", "Stones::arch"}
    assert all(item.Geometry.IsClosed for _, item in stones)
    for k, (text, item) in enumerate(stones):
        assert float(text["volume"]) == model.mass.volume[k]
        assert float(text["utilisation"]) == findings.block[model.blocks[k].id]["utilisation"]
        vertices = item.Geometry.Vertices
        read = [(p.X, p.Y, p.Z) for p in map(vertices.Point3dAt, range(len(vertices)))]
        assert read == list(map(tuple, model.blocks[k].vertices.tolist()))
    contacts = [(text, item) for text, item in items if text["cyclopean"] == "contact"]
    assert len(contacts) == len(model.contacts)
    assert {layers[item.Attributes.LayerIndex] for _, item in contacts} == {"Contacts"}
    assert all(item.Geometry.IsClosed for _, item in contacts)
    forces = [text for text, item in items if layers[item.Attributes.LayerIndex] == "Forces"]
    assert sum(float(text["N"]) for text in forces) == pytest.approx(sum(s.local[:, 0].sum() for s in findings.contact))
    assert len([1 for text, _ in items if text["cyclopean"] == "load"]) == 1


def test_rhino_file_in_millimetres():
    """Rhino scales shapes when a document changes its unit; densities and forces are not lengths."""
    rhino = importlib.import_module("rhino3dm")
    block = prism(6, 1.0, (0, 0, 0), density=2500.0)
    load = Load(0, np.array([0, 0, -9.0]), np.array([0.1, 0.2, 1.0]))
    contacts = Contacts.of([(0, 1)], [block.vertices[6:]], [0.5])
    write_exchange("a.3dm", Assembly((block, prism(6, 1.0, (0, 0, 1))), contacts, (load,)))
    file = opened()
    file.Settings.ModelUnitSystem = rhino.UnitSystem.Millimeters
    for item in file.Objects:
        assert item.Geometry.Scale(1000.0)
    file.Write("mm.3dm", 7)
    again, warnings = read_model("mm.3dm")
    assert warnings == ()
    np.testing.assert_allclose(again.blocks[0].vertices, block.vertices, atol=1e-12)
    np.testing.assert_allclose(again.contacts.point, contacts.point, atol=1e-12)
    np.testing.assert_allclose(again.loads[0].point, load.point, atol=1e-12)
    assert (again.blocks[0].density, again.loads[0].force.tolist()) == (2500.0, [0, 0, -9])
    with pytest.raises(InputError, match="says that its units are mm; leave out units m"):
        read_model("mm.3dm", "m")
    file.Settings.ModelUnitSystem = rhino.UnitSystem.Miles
    file.Write("mm.3dm", 7)
    with pytest.raises(InputError, match="its unit is Miles; set it to metres"):
        read_model("mm.3dm")


def test_what_was_changed_in_rhino_counts():
    """A stone put on another layer is of that group, user text that was typed is read, an edited mesh is what it is."""
    rhino = importlib.import_module("rhino3dm")
    write_exchange("a.3dm", Assembly((prism(6, 1.0, (0, 0, 0), "low"), prism(6, 1.0, (0, 0, 1), "high", density=1.0))))
    file = opened()
    stones = list(file.Objects)
    stones[0].Attributes.LayerIndex = stones[1].Attributes.LayerIndex
    stones[0].Attributes.SetUserString("density", "2700")
    stones[0].Attributes.SetUserString("fixed", "yes")
    mesh = stones[1].Geometry
    for k in range(6, 12):  # taller, and one of the triangles of a hexagon turned into its neighbour's place
        p = mesh.Vertices.Point3dAt(k)
        mesh.Vertices.SetPoint3dAt(k, rhino.Point3d(p.X, p.Y, 3.0))
    file.Write("b.3dm", 7)
    again, _ = read_model("b.3dm")
    low, high = again.blocks
    assert (low.group, low.density, low.fixed) == ("high", 2700.0, True)
    assert (high.group, high.density) == ("high", 1.0)
    assert again.mass.volume[1] == pytest.approx(2.0 * again.mass.volume[0])
    assert len(low.faces) == 8
    mesh.Faces.Clear()
    for face in [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]:
        mesh.Faces.AddFace(*face)
    for k in range(3):
        mesh.Vertices.SetPoint3dAt(k, rhino.Point3d(*np.eye(3)[k].tolist()))
    mesh.Vertices.SetPoint3dAt(3, rhino.Point3d(0, 0, 0))
    file.Write("b.3dm", 7)
    assert len(read_model("b.3dm")[0].blocks[1].faces) == 4


def drawn(meshes, name="a.3dm"):
    """A file that a designer drew: unwelded boxes, as Rhino's Mesh command makes them."""
    rhino = importlib.import_module("rhino3dm")
    file = rhino.File3dm()
    file.Settings.ModelUnitSystem = rhino.UnitSystem.Centimeters
    for label, shift, text in meshes:
        block = prism(4, 100.0, (0, 0, shift))
        mesh = rhino.Mesh()
        for face in block.faces:
            first = len(mesh.Vertices)
            for corner in block.vertices[list(face)].tolist():
                mesh.Vertices.Add(*corner)
            mesh.Faces.AddFace(first, first + 1, first + 2, first + 3)
        attributes = rhino.ObjectAttributes()
        attributes.Name = label
        for key, value in text.items():
            attributes.SetUserString(key, value)
        file.Objects.AddMesh(mesh, attributes)
    file.Write(name, 7)
    return file


def test_meshes_of_a_designer():
    drawn([("foot", 0, {"fixed": "true"}), ("head", 100, {"density": "2300", "group": "top", "note": "ours"})])
    model, warnings = read_model("a.3dm")
    assert mesh_faults(model.mesh) == []
    assert [(b.id, b.fixed, b.density, b.group) for b in model.blocks] == [
        ("foot", True, None, None),
        ("head", None, 2300.0, "top"),
    ]
    assert model.mesh.vertex[:, 2].max() == pytest.approx(2.0)
    assert warnings == ("a.3dm: made 2 blocks, one for each named mesh",)
    drawn([("foot", 0, {"density": "heavy"})])
    with pytest.raises(InputError, match=r"'foot': density is not a finite number \(found the text 'heavy'\)"):
        read_model("a.3dm")


def test_damaged_rhino_archives(monkeypatch):
    """Cut off, of another kind, and with a count that keeps the library busy: a process of its own can be stopped."""
    write_exchange("a.3dm", Assembly((prism(4, 1.0, (0, 0, 0)),)))
    with open("a.3dm", "rb") as stream:
        data = stream.read()
    for bad, line in (
        (data[:-9], "is a damaged 3DM file, or is cut off"),
        (data[:200] + b"x" + data[200:], "is a damaged 3DM file, or is cut off"),
        (b"3D Geometry File Format       xx" + data[32:], "is not a 3DM file"),
        (b"hello", "is not a 3DM file"),
    ):
        with open("b.3dm", "wb") as stream:
            stream.write(bad)
        with pytest.raises(InputError, match=line):
            read_model("b.3dm")
    trial = archives._TRIAL
    monkeypatch.setattr(archives, "PATIENCE", 1)
    monkeypatch.setattr(archives, "_TRIAL", trial.replace("import rhino3dm", "while True: pass"))
    with pytest.raises(InputError, match=r"a\.3dm: is a damaged 3DM file; save it again"):  # by the processor's time
        read_model("a.3dm")
    monkeypatch.setattr(archives, "WAIT", 1)
    monkeypatch.setattr(archives, "_TRIAL", "import time; time.sleep(60)")
    with pytest.raises(InputError, match=r"a\.3dm: is a damaged 3DM file: it cannot be read in 1 s"):
        read_model("a.3dm")
    monkeypatch.setattr(archives, "PATIENCE", 60)
    monkeypatch.setattr(archives, "_TRIAL", "import os; os.abort()")
    with pytest.raises(InputError, match=r"a\.3dm: is a damaged 3DM file; save it again"):
        read_model("a.3dm")


# --- IFC


def faults(file, express=False):
    validate = importlib.import_module("ifcopenshell.validate")
    log = validate.json_logger()
    with pytest.MonkeyPatch.context() as patch:
        # it words a rule that is broken, which raises without, and takes longer than all rules
        patch.setattr("_pytest.assertion.rewrite.rewrite_asserts", lambda **_: None)
        validate.validate(file, log, express_rules=express)
    gc.collect()
    return [row["message"] for row in log.statements]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # its rules are read and left open
def test_ifc_is_valid(found):
    """By the schema and its rules; with all that a file can hold, and a name of each kind."""
    model, findings, _ = found
    blocks = tuple(
        replace(b, id=name, density=2000.0 + k) for k, (b, name) in enumerate(zip(model.blocks, NAMES[:7], strict=True))
    )
    model = replace(model, blocks=(replace(blocks[0], material="tuff"), *blocks[1:]))
    whole = {**findings.model, "J": 0.8, "gap": 0.05}
    write_exchange(
        "a.ifc", model, Findings(whole, {NAMES[0]: {"order": 1, "lambda": 0.2, "gap": 0.1}}, findings.contact)
    )
    file = importlib.import_module("ifcopenshell").open("a.ifc")
    assert faults(file, express=True) == []
    psets = importlib.import_module("ifcopenshell.util.element").get_psets
    parts = file.by_type("IfcBuildingElementPart")
    said = psets(parts[0])["Cyclopean_Stone"]
    assert (said["Id"], said["BuildOrder"], said["Lambda"], said["Density"], said["Fixed"]) == (
        NAMES[0], 1, 0.2, 2000.0, True,
    )  # fmt: skip
    assert (said["Volume"], said["Gap"]) == (model.mass.volume[0], 0.1)
    said = psets(file.by_type("IfcElementAssembly")[0])["Cyclopean_Model"]
    assert (said["J"], said["Gap"], said["FrictionShare"], said["TiltDegrees"]) == (0.8, 0.05, 0.4, 12.5)
    assert file.by_type("IfcElementAssembly")[0].PredefinedType == "ARCH"
    assert {m.Name for m in file.by_type("IfcMaterial")} >= {"tuff, 2000 kg/m3", "Stone, 2001 kg/m3"}
    parts[0].Name = None
    file.by_type("IfcProject")[0].GlobalId = "0"
    assert faults(file)  # a file can be invalid


def test_global_ids_follow_from_names(found):
    model, findings, _ = found
    ifc = importlib.import_module("ifcopenshell")
    seen = []
    for name in ("a.ifc", "b.ifc"):
        write_exchange(name, model, findings)
        seen.append([root.GlobalId for root in ifc.open(name).by_type("IfcRoot")])
    assert seen[0] == seen[1]
    assert len(set(seen[0])) == len(seen[0])
    write_exchange("c.ifc", replace(model, name="another"))
    assert not set(seen[0]) & {root.GlobalId for root in ifc.open("c.ifc").by_type("IfcRoot")}


def test_a_wall_is_a_wall_and_a_vault_a_vault():
    ifc = importlib.import_module("ifcopenshell")
    write_exchange("a.ifc", design.wall(2, 2))
    assert len(ifc.open("a.ifc").by_type("IfcWall")) == 1
    write_exchange("b.ifc", design.vault(3, 2))
    assert ifc.open("b.ifc").by_type("IfcElementAssembly")[0].ObjectType == "VAULT"


def test_ifc_of_another_program():
    """Millimetres, a placement, triangles and a faceted solid; what is not faces is passed over and said."""
    ifc = importlib.import_module("ifcopenshell")
    write_exchange("a.ifc", Assembly((prism(4, 1.0, (0, 0, 0), id="x"), prism(4, 1.0, (0, 0, 1), id="y"))))
    file = ifc.open("a.ifc")
    for relation in [*file.by_type("IfcRelDefinesByProperties"), *file.by_type("IfcPropertySet")]:
        file.remove(relation)
    next(u for u in file.by_type("IfcSIUnit") if u.UnitType == "LENGTHUNIT").Prefix = "MILLI"
    first, second = file.by_type("IfcBuildingElementPart")
    move = file.create_entity("IfcCartesianPoint", (1000.0, 0.0, 0.0))
    first.ObjectPlacement = file.create_entity(
        "IfcLocalPlacement", None, file.create_entity("IfcAxis2Placement3D", move)
    )
    old = first.Representation.Representations[0]
    faces = [[i for i in t] for f in old.Items[0].Faces for t in _fans(f.CoordIndex)]
    points = file.create_entity(
        "IfcCartesianPointList3D", [[1000 * x for x in p] for p in old.Items[0].Coordinates.CoordList]
    )
    old.Items = (file.create_entity("IfcTriangulatedFaceSet", points, None, None, faces, None),)
    corners = [
        file.create_entity("IfcCartesianPoint", [1000 * x for x in p])
        for p in prism(4, 1.0, (0, 0, 1)).vertices.tolist()
    ]
    loops = [file.create_entity("IfcPolyLoop", [corners[i] for i in face]) for face in prism(4, 1.0, (0, 0, 1)).faces]
    shell = file.create_entity(
        "IfcClosedShell",
        [file.create_entity("IfcFace", (file.create_entity("IfcFaceOuterBound", loop, True),)) for loop in loops],
    )
    second.Representation.Representations[0].Items = (file.create_entity("IfcFacetedBrep", shell),)
    file.write("b.ifc")
    model, warnings = read_model("b.ifc")
    assert [b.id for b in model.blocks] == ["x", "y"]
    assert warnings == ("b.ifc: made 2 blocks, one for each named mesh",)
    assert model.mass.volume.tolist() == pytest.approx([2.0, 2.0])
    assert model.mass.centroid[:, 0].tolist() == pytest.approx([1.0, 0.0], abs=1e-12)
    with pytest.raises(InputError, match="an IFC file says its units; leave out units mm"):
        read_model("b.ifc", "mm")
    solid = file.create_entity("IfcBlock", file.by_type("IfcAxis2Placement3D")[0], 1.0, 1.0, 1.0)
    for part in (first, second):
        part.Representation.Representations[0].Items = (solid,)
    file.write("b.ifc")
    with pytest.raises(InputError, match="holds no stones with faces, but 2 IfcBlock; export it with tessellated"):
        read_model("b.ifc")


def _fans(face):
    return [(face[0], face[k], face[k + 1]) for k in range(1, len(face) - 1)]


def test_damaged_ifc():
    write_exchange("a.ifc", Assembly((prism(4, 1.0, (0, 0, 0)),)))
    with open("a.ifc") as stream:
        text = stream.read()
    for bad, line in (
        ("solid", "is not an IFC file"),
        (text[: len(text) // 2], "is it cut off"),
        (text.replace("IFCPOLYGONALFACESET(", "IFCPOLYGONALFACESET(("), "lines can be read"),
        (text.replace("FILE_SCHEMA(('IFC4'))", "FILE_SCHEMA(('IFC9'))"), "is a damaged IFC file"),
    ):
        with open("b.ifc", "w") as stream:
            stream.write(bad)
        with pytest.raises(InputError, match=line) as caught:
            read_model("b.ifc")
        assert "\n" not in str(caught.value)


# --- GLB


def test_glb_for_other_readers(found):
    import trimesh

    model, findings, _ = found
    write_exchange("a.glb", model, findings)
    with open("a.glb", "rb") as stream:
        scene = trimesh.load_scene(stream, file_type="glb")
    for k, block in enumerate(model.blocks):
        _, geometry = scene.graph[block.id]
        mesh = scene.geometry[geometry]
        assert mesh.volume == pytest.approx(model.mass.volume[k], rel=1e-5)
        extras = scene.graph.transforms.edge_data[scene.graph.base_frame, block.id]["metadata"]
        assert extras["id"] == block.id
        assert extras["utilisation"] == findings.block[block.id]["utilisation"]
        assert extras["group"] == block.group
    colours = {tuple(mesh.visual.material.baseColorFactor) for mesh in scene.geometry.values()}
    assert len(colours) > 2


def test_a_glb_that_another_program_has_changed(found):
    """Vertices split along edges, as modellers export them: ids, groups, densities stay, contacts are found anew."""
    import trimesh

    model, _, _ = found
    write_exchange("a.glb", replace(model, blocks=tuple(replace(b, density=2200.0) for b in model.blocks)))
    with open("a.glb", "rb") as stream:
        scene = trimesh.load_scene(stream, file_type="glb")
    for mesh in scene.geometry.values():
        mesh.unmerge_vertices()
    scene.export("b.glb", extension_webp=None)
    again, warnings = read_model("b.glb")
    assert sorted(b.id for b in again.blocks) == sorted(b.id for b in model.blocks)
    assert again.mass.volume.sum() == pytest.approx(model.mass.volume.sum(), rel=1e-6)
    assert again.contacts is None
    assert {b.density for b in again.blocks} <= {2200.0, None}
    assert any("another program has changed its meshes" in line or "made 7 blocks" in line for line in warnings)


def test_colours_by_hand():
    """From blue, no friction used, to red, all of it; supports at three quarters; groups told apart where no use is."""
    blocks = [prism(4, 1.0, (0, 0, k), group, fixed=k == 2) for k, group in enumerate(("a", "b", "b", None))]
    model = Assembly(tuple(blocks))
    used = {"b0": {"utilisation": 0.0}, "b1": {"utilisation": 1.0}, "b2": {"utilisation": 1.0}}
    none, full, held, unknown = stone_colours(model, Findings(block=used))
    assert none[2] > none[0]
    assert full[0] > full[2]
    assert held == pytest.approx([0.75 * x for x in full])
    assert unknown not in (none, full, held)
    one, two, dark, plain = stone_colours(model, Findings())
    assert len({one, two, plain}) == 3
    assert dark == pytest.approx([0.75 * x for x in two])
    assert linear((0.0, 0.5, 1.0)) == pytest.approx([0.0, 0.21404114, 1.0])


def test_a_glb_of_triangles_is_known_by_its_count_of_vertices():
    """Without polygons there is no record of them; what the nodes say stays, the contacts go, and both is told."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    one = Block("one", corners, ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)))
    one = replace(one, density=2500.0, fixed=True, group="low")
    other = replace(one, id="other", vertices=one.vertices + np.array([0, 0, 2.0]), fixed=None)
    contacts = Contacts.of([(0, 1)], [one.vertices[:3]])
    write_exchange("a.glb", Assembly((one, other), contacts))
    with open("a.glb", "rb") as stream:
        data = stream.read()
    assert data.count(b'"vertices": 4') == 2
    with open("b.glb", "wb") as stream:
        stream.write(data.replace(b'"vertices": 4', b'"vertices": 5'))
    assert len(read_model("a.glb")[0].contacts) == 1
    again, warnings = read_model("b.glb")
    assert again.contacts is None
    assert [(b.id, b.density, b.fixed, b.group) for b in again.blocks] == [
        ("one", 2500.0, True, "low"),
        ("other", 2500.0, None, "low"),
    ]
    changed = "b.glb: another program has changed its meshes; contacts and loads that were in it are left out"
    assert warnings == (changed, "b.glb: made 2 blocks, one for each named mesh")


# --- COMPAS


def test_compas_opens_it(found):
    compas = pytest.importorskip("compas")
    model, findings, _ = found
    model = replace(model, blocks=tuple(replace(b, id=f" {b.id}'s") for b in model.blocks))
    write_exchange("a.compas.json", model, Findings(findings.model, {}, findings.contact))
    assembly = compas.json_load("a.compas.json")
    graph = assembly.graph
    assert list(graph.nodes()) == [b.id for b in model.blocks]
    assert [part.key for part in assembly.parts()] == [b.id for b in model.blocks]
    for block in model.blocks:
        vertices, faces = graph.node_attribute(block.id, "block").to_vertices_and_faces()
        assert vertices == block.vertices.tolist()
        assert [tuple(face) for face in faces] == list(block.faces)
        assert graph.node_attribute(block.id, "is_support") is (block.fixed is True)
    for k, (a, b) in enumerate(zip(model.contacts.a, model.contacts.b, strict=True)):
        (row,) = graph.edge_attribute((model.blocks[a].id, model.blocks[b].id), "interfaces")
        np.testing.assert_allclose(row["frame"].zaxis, model.contacts.frame[k, 0], atol=1e-9)
        assert [force["c_np"] for force in row["forces"]] == findings.contact[k].local[:, 0].tolist()


def test_what_compas_writes_again_is_read(found):
    """Also what was changed there: a support."""
    compas = pytest.importorskip("compas")
    model, findings, _ = found
    write_exchange("a.compas.json", model, findings)
    assembly = compas.json_load("a.compas.json")
    compas.json_dump(assembly, "b.json")
    again, warnings = read_model("b.json")
    assert warnings == ()
    assert model_dict(again) == model_dict(model)
    graph = assembly.graph
    graph.node_attribute(model.blocks[0].id, "is_support", False)
    graph.node_attribute(model.blocks[1].id, "is_support", True)
    compas.json_dump(assembly, "b.json")
    assert [b.fixed for b in read_model("b.json")[0].blocks[:2]] == [False, True]


def test_graphs_and_meshes_of_compas_itself():
    compas = pytest.importorskip("compas")
    shapes = importlib.import_module("compas.datastructures")
    block = prism(5, 1.0, (0, 0, 0))
    mesh = shapes.Mesh.from_vertices_and_faces(block.vertices.tolist(), [list(f) for f in block.faces])
    graph = shapes.Graph()
    for key in ("it's", "b 1", 7):
        graph.add_node(key, block=mesh.copy(), is_support=key == 7)
    compas.json_dump(graph, "a.json")
    model, _ = read_model("a.json", "m")
    assert [(b.id, b.fixed) for b in model.blocks] == [("it's", False), ("b 1", False), ("7", True)]
    assert model.blocks[0].faces == block.faces
    compas.json_dump([mesh, mesh], "a.json")
    assert len(read_model("a.json", "m")[0]) == 2
    graph.add_node("7", block=mesh.copy())
    compas.json_dump(graph, "a.json")
    with pytest.raises(InputError, match="node '7' stands twice"):
        read_model("a.json", "m")


# --- tables and commands that are only written


def commands(text):
    """Name and faces of each polyhedron, and the other lines, of 3DEC commands."""
    joined = text.replace(" ...\n", "\n\t")
    found, others = {}, []
    for line in joined.split("\n"):
        if line.startswith("block create polyhedron"):
            others.append(line.rstrip())
        elif line.startswith("\t  face "):
            faces = [[float(x) for x in word.split(",")] for word in line.split()[1:]]
            found.setdefault(others[-1], []).append(np.array(faces))
        elif line and not line.startswith(";"):
            others.append(line)
    return found, [line for line in others if not line.startswith("block create")]


def test_3dec_by_hand():
    """Corners run clockwise seen from outside, so that the volume by their order is negative; a bent face is cut up."""
    bent = prism(6, 1.0, (0, 0, 0), "lower course", id='it\'s "it"', density=2400.5, fixed=True)
    vertices = bent.vertices.copy()
    vertices[8, 2] += 0.1
    text = blocklist_text(Assembly((replace(bent, vertices=vertices), prism(4, 1.0, (5, 0, 0)))))
    found, others = commands(text)
    volumes = [
        sum(np.linalg.det([face[0], face[k], face[k + 1]]) for face in faces for k in range(1, len(face) - 1)) / 6
        for faces in found.values()
    ]
    assert volumes[1] == pytest.approx(-2.0)
    assert volumes[0] == pytest.approx(-Assembly((replace(bent, vertices=vertices),)).mass.volume[0])
    assert [len(faces) for faces in found.values()] == [1 + 4 + 4 + 2, 6]  # the top in four, two sides in two
    name = "\"stone it's 'it'\""
    assert others == [
        "model new",
        f"block group 'group lower course' slot 'group' range group {name}",
        f"block property density 2400.5 range group {name}",
        f"block group 'fixed' slot 'support' range group {name}",
        "block fix range group 'fixed'",
    ]


def test_3dec_wants_convex_blocks():
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
    ring = np.concatenate([np.c_[outline, np.zeros(6)], np.c_[outline, np.ones(6)]])
    bent = Block("L", ring, prism(6, 1.0, (0, 0, 0)).faces)
    model = Assembly((prism(6, 1.0, (5, 0, 0)), bent))
    assert not_convex(model) == ["L"]
    assert write_exchange("a.3ddat", model) == ("a.3ddat: block 'L' is not convex, and 3DEC only takes convex ones",)


def test_tables(found):
    model, findings, _ = found
    first = replace(model.blocks[0], id='a,"b"', density=2400.0)
    model = replace(model, blocks=(first, *model.blocks[1:]))
    findings = Findings(findings.model, {'a,"b"': {"utilisation": 0.5}}, findings.contact)
    warnings = write_exchange("a.csv", model, findings)
    assert warnings == (
        "a.csv: CSV holds no loads: dropped",
        "a.csv: CSV holds tables, no shapes: it cannot be read back",
    )
    with open("a-blocks.csv", newline="", encoding="utf-8") as stream:
        blocks = list(csv.DictReader(stream))
    with open("a-contacts.csv", newline="", encoding="utf-8") as stream:
        contacts = list(csv.DictReader(stream))
    assert [row["id"] for row in blocks] == [b.id for b in model.blocks]
    assert [float(row["volume [m3]"]) for row in blocks] == model.mass.volume.tolist()
    assert (blocks[0]["density [kg/m3]"], blocks[1]["density [kg/m3]"]) == ("2400", "")
    assert (blocks[0]["utilisation"], blocks[1]["utilisation"]) == ("0.5", "")
    assert [float(row["N [N]"]) for row in contacts] == [s.local[:, 0].sum() for s in findings.contact]
    assert [float(row["area [m2]"]) for row in contacts] == model.contacts.area.tolist()
    assert contacts[0]["a"] == 'a,"b"'


# --- the command


def test_convert_says_what_is_lost(run):
    run("make", "arch", 5, "--out", "a.json", "--density", "2300", "--mu", "0.7")
    assert run("check", "a.json", "--json", "r.json")[0] == 0
    lost = {
        "b.json": "cyclopean.model/1 holds no results: dropped",
        "b.obj": "OBJ holds no densities, supports, contacts, friction of contacts: dropped",
        "b.stl": "STL holds no densities, supports, groups, contacts, friction of contacts: dropped",
        "b.3ddat": "3DEC holds no contacts, friction of contacts: dropped",
    }
    for suffix in (form.suffix for form in FORMATS.values() if form.writer):
        status, out, err = run("convert", "a.json", f"b{suffix}", "--result", "r.json")
        name = f"b{suffix}"
        assert status == 0, err
        assert out.startswith("arch of 5: 7 blocks; written b")
        if name in lost:
            assert f"cyclopean: warning: {name}: {lost[name]}\n" in err
        if FORMATS[suffix].holds is None and FORMATS[suffix].findings:
            assert err == ""
        if FORMATS[suffix].reads:
            status, out, _ = run("info", name)
            assert status == 0
            assert f"  format    {FORMATS[suffix].name.removesuffix('4')}" in out
    assert run("check", "b.3dm", "--method", "rbe")[0] == 0


def test_a_missing_extra_is_one_line(run, monkeypatch):
    run("make", "stack", 2, "--out", "a.json")
    for suffix, library, extra in ((".3dm", "rhino3dm", "rhino"), (".ifc", "ifcopenshell", "ifc")):
        run("convert", "a.json", "full" + suffix)
        there = importlib.import_module

        def absent(name, package=None, *, library=library, there=there):
            if name.startswith(library):
                raise ImportError(name)
            return there(name, package)

        with monkeypatch.context() as patch:
            patch.setattr(importlib, "import_module", absent)
            for argv in (("a.json", "b" + suffix), ("full" + suffix, "b.json")):
                status, out, err = run("convert", *argv)
                assert (status, out, err.count("\n")) == (2, "", 1)
                assert f"need {library}: pip install 'cyclopean[{extra}]'" in err
                assert f"error: {argv[0] if argv[0] != 'a.json' else argv[1]}: " in err


def test_convert_refuses(run, tmp_path):
    run("make", "stack", 2, "--out", "a.json")
    before = sorted(p.name for p in tmp_path.iterdir())
    for argv, said in (
        (("a.json", "a.xyz"), "unknown ending; use .json, .compas.json, .3dm"),
        (("a.json", "b.3dm", "--result", "a.json"), "its schema is the text 'cyclopean.model/1'"),
        (("a.json", "b.3dm", "--result", "none.json"), "none.json: no such file"),
        (("a.json", "none/b.ifc"), "does not exist; make it first"),
        (("a.json", "./a.json"), "this is the input file"),
    ):
        status, out, err = run("convert", *argv)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert said in err
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_formats_are_told_by_their_endings():
    assert exchange_format("a.COMPAS.json").suffix == ".compas.json"
    assert exchange_format("x/compas.json").suffix == ".json"
    open_ended = Assembly((Block("a\nb", prism(4, 1.0, (0, 0, 0)).vertices, prism(4, 1.0, (0, 0, 0)).faces),))
    with pytest.raises(InputError, match="its id and group must be text of one line"):
        write_exchange("a.obj", open_ended)
    with pytest.raises(InputError, match="block 'b' has no faces to write"):
        write_exchange("a.ifc", Assembly((Block("b", np.zeros((0, 3)), ()),)))
