"""The model file: what is read is what was written, and every fault has its one line."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.assembly import Assembly, Block, Contacts, Load
from cyclopean.errors import InputError
from cyclopean.io import read_model, write_model
from cyclopean.io.models import read_as_drawn

CUBE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
TOP = [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
ABSENT = object()


def model(**changes):
    """Two cubes, one on the other."""
    above = [[x, y, z + 1] for x, y, z in CUBE]
    data = {
        "schema": "cyclopean.model/1",
        "name": "two cubes",
        "units": "m",
        "blocks": [
            {"id": "b0", "vertices": CUBE, "faces": FACES, "density": 2400.0, "fixed": True, "group": "course-0"},
            {"id": "b1", "vertices": above, "faces": FACES},
        ],
        "contacts": [{"a": "b0", "b": "b1", "polygon": TOP, "mu": 0.7}],
        "loads": [{"block": "b1", "force": [1.0, 0, 0], "point": [1, 0.5, 1.5]}],
    }
    return json.loads(json.dumps({key: value for key, value in (data | changes).items() if value is not ABSENT}))


def changed(*steps_and_value):
    """The model with the value at a path of keys replaced; ABSENT removes it."""
    *steps, last, value = steps_and_value
    data = inner = model()
    for step in steps:
        inner = inner[step]
    if value is ABSENT:
        del inner[last]
    else:
        inner[last] = value
    return data


@pytest.fixture
def at(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(data, name="wall.json"):
        text = data if isinstance(data, str | bytes) else json.dumps(data)
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
        return name

    return write


def test_by_hand(at):
    assembly, warnings = read_model(at(model()))
    assert warnings == ()
    assert assembly.name == "two cubes"
    assert [b.id for b in assembly.blocks] == ["b0", "b1"]
    assert assembly.mass.volume.tolist() == pytest.approx([1.0, 1.0])
    first, second = assembly.blocks
    assert (first.density, first.fixed, first.group) == (2400.0, True, "course-0")
    assert (second.density, second.fixed, second.group) == (None, None, None)
    assert assembly.contacts.frame[0, 0].tolist() == [0, 0, 1]
    assert assembly.contacts.mu.tolist() == [0.7]
    assert assembly.loads[0].point.tolist() == [1, 0.5, 1.5]
    assert assembly.loads[0].block == 1


def test_absent_contacts_are_detected_and_an_empty_list_means_none(at):
    assert read_model(at(model(contacts=ABSENT)))[0].contacts is None
    assert len(read_model(at(model(contacts=[])))[0].contacts) == 0


@pytest.mark.parametrize(("units", "metre"), [("mm", 1e-3), ("cm", 1e-2), ("in", 0.0254), ("ft", 0.3048), ("m", 1)])
def test_units_of_the_file(at, units, metre):
    """Lengths are converted, forces and densities are not."""
    assembly, _ = read_model(at(model(units=units)))
    assert assembly.mass.volume.tolist() == pytest.approx([metre**3] * 2)
    assert assembly.contacts.area[0] == pytest.approx(metre**2)
    assert assembly.loads[0].point.tolist() == pytest.approx([metre, metre / 2, 1.5 * metre])
    assert assembly.loads[0].force.tolist() == [1, 0, 0]
    assert assembly.blocks[0].density == 2400


def test_millimetres_are_exact(at):
    """300 mm is 0.3 m to the last digit."""
    data = model(units="mm")
    data["blocks"][0]["vertices"][6] = [300, 1100, 9]
    assert read_model(at(data))[0].blocks[0].vertices[6].tolist() == [0.3, 1.1, 0.009]  # 9 * 0.001 is not 0.009


def test_units_asked_for(at):
    assert read_model(at(model()), "m")[1] == ()
    with pytest.raises(InputError) as caught:
        read_model(at(model()), "mm")
    assert str(caught.value) == "wall.json: says that its units are m; leave out units mm"
    assembly, warnings = read_model(at(model(units=ABSENT)), "mm")
    assert warnings == ("wall.json: half of the blocks are less than 0.00173 m across: check the units",)
    assert assembly.mass.volume[0] == pytest.approx(1e-9)
    assert read_model(at(model(units=ABSENT)))[1] == ('wall.json: says no "units"; metres assumed',)


def test_unknown_keys_make_one_warning_each(at):
    data = model()
    data["colour"] = "grey"
    for block in data["blocks"]:
        block["colour"] = "red"
    data["contacts"][0]["type"] = "face"
    data["loads"][0]["kind"] = "live"
    assert read_model(at(data))[1] == (
        "wall.json: block 'b0': unknown key 'colour' is ignored (and in 1 more blocks)",
        "wall.json: contact 0 ('b0' to 'b1'): unknown key 'type' is ignored",
        "wall.json: load 0: unknown key 'kind' is ignored",
        "wall.json: unknown key 'colour' is ignored",
    )


def test_byte_order_mark_and_null_fields_pass(at):
    data = model(loads=None)
    data["blocks"][1] |= {"density": None, "fixed": None, "group": None}
    data["contacts"][0]["mu"] = None
    assembly, warnings = read_model(at(b"\xef\xbb\xbf" + json.dumps(data).encode()))
    assert warnings == ()
    assert np.isnan(assembly.contacts.mu[0])


def test_faulty_meshes_are_not_found_at_reading(at):
    """An open, an inverted and a flat block are read: a check says what is wrong with them."""
    data = model(contacts=ABSENT)
    data["blocks"][0]["faces"] = FACES[:-1]
    data["blocks"][1]["faces"] = [face[::-1] for face in FACES]
    assert len(read_model(at(data))[0]) == 2


nan, inf = float("nan"), float("inf")
REFUSALS = [
    (
        changed("schema", ABSENT),
        "holds no blocks: it is an object with the keys 'name' and 'units' and 'blocks' and 'contacts' and more;"
        ' expected COMPAS meshes, or "schema": "cyclopean.model/1"',
    ),
    (
        changed("schema", "cyclopean.result/1"),
        'its schema is \'cyclopean.result/1\'; a model has "schema": "cyclopean.model/1"',
    ),
    (changed("schema", 1), 'its schema is not text; a model has "schema": "cyclopean.model/1"'),
    ([], 'holds no blocks: it is a list of 0 items; expected COMPAS meshes, or "schema": "cyclopean.model/1"'),
    (7, 'is not a model: expected an object with "schema": "cyclopean.model/1", or COMPAS JSON'),
    (changed("units", "furlong"), "units: 'furlong' is not a unit of length; use m, cm, mm, in or ft"),
    (changed("units", None), "units must be text in quotes, found null"),
    (changed("name", "a\nb"), "name must be text of one line, not empty, found 'a\\nb'"),
    (changed("blocks", ABSENT), 'has no "blocks"'),
    (changed("blocks", {}), "blocks must be a list, found an object"),
    (changed("blocks", []), "has no blocks; a model needs at least one"),
    (changed("blocks", 1, "stone"), "blocks[1] must be an object, found the text 'stone'"),
    (changed("blocks", 1, "id", ABSENT), 'blocks[1] has no "id"; give it one, as text'),
    (changed("blocks", 1, "id", 7), "blocks[1].id must be text in quotes, found 7"),
    (changed("blocks", 1, "id", ""), "blocks[1].id must be text of one line, not empty, found ''"),
    (changed("blocks", 1, "id", "b0"), "block 'b0': the id stands twice, in blocks[0] and blocks[1]; make it unique"),
    (changed("blocks", 1, "vertices", ABSENT), "block 'b1': has no \"vertices\""),
    (changed("blocks", 1, "faces", ABSENT), "block 'b1': has no \"faces\""),
    (changed("blocks", 1, "vertices", "x"), "block 'b1': vertices must be a list, found the text 'x'"),
    (changed("blocks", 1, "vertices", 2, 5), "block 'b1': vertices[2] must be a list, found 5"),
    (changed("blocks", 1, "vertices", 2, [0, 1]), "block 'b1': vertices[2] must be [x, y, z], found 2 numbers"),
    (changed("blocks", 1, "vertices", 2, 0, nan), "block 'b1': vertices[2][0] is not a finite number (found NaN)"),
    (
        changed("blocks", 1, "vertices", 2, 0, -inf),
        "block 'b1': vertices[2][0] is not a finite number (found -Infinity)",
    ),
    (changed("blocks", 1, "vertices", 2, 0, True), "block 'b1': vertices[2][0] is not a finite number (found true)"),
    (
        changed("blocks", 1, "vertices", 2, 0, "1"),
        "block 'b1': vertices[2][0] is not a finite number (found the text '1')",
    ),
    (changed("blocks", 1, "vertices", 2, 0, [1]), "block 'b1': vertices[2][0] is not a finite number (found a list)"),
    (
        changed("blocks", 1, "vertices", 2, 0, 1e13),
        "block 'b1': vertices[2][0] = 1e+13 is beyond 1e12; check the units",
    ),
    (
        changed("blocks", 1, "vertices", 2, 0, 10**400),
        "block 'b1': vertices[2][0] is not a finite number (found 100000000000000000000000...)",
    ),
    (changed("blocks", 1, "faces", 3), "block 'b1': faces must be a list, found 3"),
    (changed("blocks", 1, "faces", 2, 3), "block 'b1': faces[2] must be a list, found 3"),
    (changed("blocks", 1, "faces", 2, 0, 1.5), "block 'b1': faces[2][0] must be a whole number, found 1.5"),
    (changed("blocks", 1, "faces", 2, 0, True), "block 'b1': faces[2][0] must be a whole number, found true"),
    (changed("blocks", 1, "faces", 2, [0, 1]), "block 'b1': faces[2] has 2 corners; a face needs at least 3"),
    (changed("blocks", 1, "faces", 2, 0, 8), "block 'b1': faces[2] names vertex 8, but the vertices are 0..7"),
    (changed("blocks", 1, "faces", 2, 0, -1), "block 'b1': faces[2] names vertex -1, but the vertices are 0..7"),
    (
        changed("blocks", 1, "faces", 2, [0, 1, 5, 0]),
        "block 'b1': faces[2] names vertex 0 twice; list every corner once",
    ),
    (changed("blocks", 0, "density", -1), "block 'b0': density -1 must be a positive number of kg/m3"),
    (changed("blocks", 0, "density", "x"), "block 'b0': density is not a finite number (found the text 'x')"),
    (changed("blocks", 0, "density", True), "block 'b0': density is not a finite number (found true)"),
    (changed("blocks", 0, "fixed", 1), "block 'b0': fixed must be true or false, found 1"),
    (changed("blocks", 0, "group", 1), "block 'b0': group must be text in quotes, found 1"),
    (changed("contacts", {}), "contacts must be a list, found an object"),
    (changed("contacts", 0, []), "contact 0 must be an object, found a list"),
    (changed("contacts", 0, "a", ABSENT), 'contact 0: has no "a"; name a block'),
    (changed("contacts", 0, "a", 0), "contact 0: a must be text in quotes, found 0"),
    (changed("contacts", 0, "b", "b9"), "contact 0: b names block 'b9', which is not in the model"),
    (changed("contacts", 0, "b", "b0"), "contact 0 ('b0' to 'b0'): joins a block to itself; name two blocks"),
    (changed("contacts", 0, "polygon", ABSENT), "contact 0 ('b0' to 'b1'): has no \"polygon\""),
    (
        changed("contacts", 0, "polygon", TOP[:2]),
        "contact 0 ('b0' to 'b1'): polygon has 2 points; a contact needs at least 3",
    ),
    (
        changed("contacts", 0, "polygon", 1, 2, inf),
        "contact 0 ('b0' to 'b1'): polygon[1][2] is not a finite number (found Infinity)",
    ),
    (changed("contacts", 0, "mu", -0.1), "contact 0 ('b0' to 'b1'): mu -0.1 must not be negative"),
    (changed("contacts", 0, "mu", nan), "contact 0 ('b0' to 'b1'): mu is not a finite number (found NaN)"),
    (changed("loads", 3), "loads must be a list, found 3"),
    (changed("loads", 0, "block", "b9"), "load 0: block names block 'b9', which is not in the model"),
    (changed("loads", 0, "force", ABSENT), 'load 0: has no "force"'),
    (changed("loads", 0, "force", 1, None), "load 0: force[1] is not a finite number (found null)"),
    (changed("loads", 0, "point", [0, 1]), "load 0: point must be [x, y, z], found 2 numbers"),
]


@pytest.mark.parametrize(("data", "line"), REFUSALS, ids=[line[:60] for _, line in REFUSALS])
def test_refusals(at, data, line):
    with pytest.raises(InputError) as caught:
        read_model(at(data))
    assert str(caught.value) == f"wall.json: {line}"


BAD_TEXT = [
    (b"", "the file is empty"),
    (b"  \n", "is not JSON: line 2, column 1: Expecting value (the file ends early)"),
    (b'{"schema": "cyclopean.mo', "is not JSON: line 1, column 12: Unterminated string starting at"),
    (b'{"schema":\n "x",}', "is not JSON: line 2, column 6"),
    (b'{"schema": "a", "schema": "b"}', "the key 'schema' stands twice in one object; keep one"),
    (b'{"name": "\xff"}', "line 1: byte 10 is not UTF-8 text; save the file as UTF-8"),
    (b"[" * 100_000, "is nested too deeply to be a model"),
    (b'{"a":' * 100_000, "is nested too deeply to be a model"),
    (b"[1" + b"0" * 5000 + b"]", "holds a whole number of thousands of digits; coordinates are metres"),
    (
        json.dumps(changed("blocks", 1, "vertices", 2, 0, 5.5)).replace("5.5", "1e400").encode(),
        "block 'b1': vertices[2][0] is not",
    ),
]


@pytest.mark.parametrize(("content", "line"), BAD_TEXT, ids=[line[:40] for _, line in BAD_TEXT])
def test_refused_text(at, content, line):
    with pytest.raises(InputError) as caught:
        read_model(at(content))
    assert str(caught.value).startswith(f"wall.json: {line}")
    assert "\n" not in str(caught.value)


def test_refused_paths(at, tmp_path):
    (tmp_path / "folder.json").mkdir()
    cases = {
        "missing.json": "missing.json: no such file; check the path",
        "folder.json": "folder.json: is a folder; name a file in it",
        "no\nline.json": "no\\nline.json: no such file; check the path",
        "nul\0.json": "nul\\x00.json: is not a path",
        at(b"x", "model.dwg"): "model.dwg: '.dwg' files cannot be read; use json, 3dm, dxf, glb, ifc, obj, ply or stl",
    }
    for path, line in cases.items():
        with pytest.raises(InputError) as caught:
            read_model(path)
        assert str(caught.value) == line
    with pytest.raises(InputError, match=r"^units: 'yard' is not a unit of length; use m, cm, mm, in or ft$"):
        read_model(at(model()), "yard")


def test_a_long_id_cannot_flood_the_message(at):
    with pytest.raises(InputError) as caught:
        read_model(at(changed("contacts", 0, "a", "x" * 10_000)))
    assert len(str(caught.value)) < 200


finite = st.floats(-1e9, 1e9)
spots = st.tuples(finite, finite, finite)


@given(
    st.lists(spots, min_size=4, max_size=4),
    st.lists(st.tuples(st.one_of(st.none(), st.floats(0, 5)), st.lists(spots, min_size=3, max_size=6)), max_size=4),
    st.one_of(st.none(), st.floats(1e-3, 1e6)),
    st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1),
)
def test_what_is_written_is_read_again(tmp_path_factory, corners, joined, density, name):
    """Every number comes back to the last bit, a mu that is not given stays not given."""
    tetra = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
    blocks = (Block(name, np.array(corners), tetra, density, True, name), Block(name + "'", np.array(corners), tetra))
    contacts = Contacts.of([(0, 1)] * len(joined), [np.array(p) for _, p in joined], [mu for mu, _ in joined])
    loads = (Load(1, np.array(corners[0]), np.array(corners[1])),)
    path = tmp_path_factory.mktemp("model") / "model.json"
    assembly = Assembly(blocks, contacts, loads, name)
    write_model(path, assembly)
    again, warnings = read_as_drawn(path)
    assert warnings == ()
    assert again.name == name
    for one, other in zip(assembly.blocks, again.blocks, strict=True):
        assert (one.id, one.faces, one.density, one.fixed, one.group) == (
            other.id, other.faces, other.density, other.fixed, other.group,
        )  # fmt: skip
        assert one.vertices.tobytes() == other.vertices.tobytes()
    for field in ("a", "b", "start", "point", "mu"):
        assert getattr(contacts, field).tobytes() == getattr(again.contacts, field).tobytes()
    assert again.loads[0].force.tobytes() == loads[0].force.tobytes()
    assert again.loads[0].block == 1


def test_given_contacts_take_the_place_of_the_models_own(at, tmp_path):
    assembly, _ = read_model(at(model(contacts=ABSENT)))
    write_model("plain.json", assembly)
    assert "contacts" not in json.loads((tmp_path / "plain.json").read_text())
    write_model("found.json", assembly, Contacts.of([(0, 1)], [np.array(TOP, float)]))
    assert json.loads((tmp_path / "found.json").read_text())["contacts"] == [
        {"a": "b0", "b": "b1", "polygon": [[float(x) for x in p] for p in TOP]}
    ]


def test_ten_thousand_blocks(tmp_path):
    blocks = [
        {"id": f"b{k}", "vertices": [[x + 1.1 * k, y, z] for x, y, z in CUBE], "faces": FACES, "density": 2400.0}
        for k in range(10_000)
    ]
    (tmp_path / "big.json").write_text(json.dumps(model(blocks=blocks, loads=ABSENT)))
    assembly, _ = read_model(tmp_path / "big.json")
    assert len(assembly) == 10_000
    assert assembly.mass.centroid[9_999, 0] - assembly.mass.centroid[0, 0] == pytest.approx(1.1 * 9_999)
