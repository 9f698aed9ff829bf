"""Mesh files: stones come out one by one, with the volumes they went in with; trimesh reads what is written."""

import json
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults, pack
from cyclopean.geometry.sides import pieces
from cyclopean.io import MESH_SUFFIXES, read_model, write_mesh, write_model
from laws import examples

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
TRIANGLES = tuple(t for f in FACES for t in ((f[0], f[1], f[2]), (f[0], f[2], f[3])))
ASSUMED = "does not say its units; metres assumed (`units`)"


def stack(count=3, faces=FACES):
    """Cubes of side 1, 2, 3 ..., one on the other, so that they touch and are told apart by their volumes."""
    blocks, height = [], 0.0
    for k in range(count):
        side = 1.0 + k
        blocks.append(Block(f"stone {k}", CUBE * side + [0, 0, height], faces))
        height += side
    return Assembly(tuple(blocks))


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def put(name, content):
    with open(name, "wb") as stream:
        stream.write(content if isinstance(content, bytes) else content.encode())
    return name


def refused(name, content):
    with pytest.raises(InputError) as caught:
        read_model(put(name, content))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_round_trip(suffix):
    """Ids, volumes and places survive; OBJ and PLY keep the polygons as well."""
    before = stack()
    write_mesh("a" + suffix, before)
    after, warnings = read_model("a" + suffix)
    assert [b.id for b in after.blocks] == ["stone 0", "stone 1", "stone 2"]
    assert after.mass.volume.tolist() == pytest.approx([1, 8, 27], rel=1e-7)
    np.testing.assert_allclose(after.mass.centroid, before.mass.centroid, atol=1e-6)
    assert mesh_faults(after.mesh) == []
    if suffix == ".glb":  # what we wrote is taken as it is, and glTF is in metres
        assert warnings == ()
    else:
        assert warnings == (f"a{suffix}: made 3 blocks, one for each named mesh", f"a{suffix}: {ASSUMED}")
    if suffix in (".obj", ".ply"):
        assert [b.faces for b in after.blocks] == [b.faces for b in before.blocks]
        assert [b.vertices.tolist() for b in after.blocks] == [b.vertices.tolist() for b in before.blocks]


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_far_from_the_origin(suffix):
    """At 500 km a stone keeps its volume: the others hold doubles, GLB a full place for each node."""
    far = Assembly((Block("far", CUBE * 0.3 + [5e5, 4e6, 100], FACES),))
    write_mesh("a" + suffix, far)
    after, _ = read_model("a" + suffix)
    assert after.mass.volume[0] == pytest.approx(0.027, rel=1e-6)
    np.testing.assert_allclose(after.mass.centroid, far.mass.centroid, rtol=1e-12)


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_another_reader_finds_the_same(suffix):
    """By name and volume; trimesh keeps glTF's y up."""
    import trimesh

    write_mesh("a" + suffix, stack())
    options = {"split_objects": True, "split_groups": True} if suffix == ".obj" else {}
    with open("a" + suffix, "rb") as stream:
        scene = trimesh.load_scene(stream, file_type=suffix[1:], **options)
    whole = scene.to_mesh()
    assert whole.volume == pytest.approx(36, rel=1e-6)
    height = 1 if suffix == ".glb" else 2
    assert whole.bounds[1, height] == pytest.approx(6)
    if suffix != ".ply":  # it reads a PLY as one mesh
        volumes = sorted(mesh.volume for mesh in scene.geometry.values())
        assert volumes == pytest.approx([1, 8, 27], rel=1e-6)


@pytest.mark.parametrize("welded", [True, False], ids=["welded", "no vertex in common"])
@pytest.mark.parametrize("suffix", [".stl", ".ply", ".glb", ".obj"])
def test_what_another_writer_writes(suffix, welded):
    """Three stones in one unnamed soup: split into pieces although they touch, and triangles share no vertex."""
    import trimesh

    soup = trimesh.util.concatenate(
        [trimesh.Trimesh(b.vertices, [t for t in TRIANGLES], process=False) for b in stack().blocks]
    )
    if not welded:
        soup = trimesh.Trimesh(soup.triangles.reshape(-1, 3), np.arange(108).reshape(-1, 3), process=False)
    if suffix == ".glb":
        soup.apply_transform([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # to y up
    soup.export("a" + suffix)
    after, warnings = read_model("a" + suffix)
    assert sorted(after.mass.volume) == pytest.approx([1, 8, 27], rel=1e-6)
    assert after.mesh.vertex[:, 2].max() == pytest.approx(6)
    assert f"a{suffix}: made 3 blocks, one for each connected piece" in warnings


@given(
    st.lists(st.tuples(*[st.integers(0, 3)] * 3), min_size=1, max_size=12, unique=True),
    st.integers(0, 2**32 - 1),
    st.randoms(use_true_random=False),
)
@settings(max_examples=examples(100))
def test_touching_cells_fall_apart(cells, seed, random):
    """Cubes of a grid share faces, edges and corners; turned, rounded to single precision and shuffled, each is found.

    The two triangulations of a shared face then differ by rounding, in angle too, on either side of zero.
    """
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn[:, 0] *= np.linalg.det(turn)
    vertices = np.concatenate([(CUBE + np.array(cell)) for cell in cells])
    welded, new = np.unique(vertices, axis=0, return_inverse=True)
    faces = [(k, tuple(int(new.reshape(-1)[8 * k + i]) for i in t)) for k in range(len(cells)) for t in TRIANGLES]
    random.shuffle(faces)
    labels = pieces(pack([((welded @ turn.T).astype(np.float32).astype(float), [face for _, face in faces])]))
    assert len(set(zip((k for k, _ in faces), labels.tolist(), strict=True))) == len(cells) == labels.max() + 1


OBJ = """# a comment
mtllib none.mtl
o lower
v 0 0 0
v 1 0 0
v 1 1 0 0.5 0.5 0.5
v 0 1 0
v 0 0 1 1.0
v 1 0 1
v 1 1 1
v 0 1 1
vn 0 0 1
vt 0 0
usemtl grey
s off
f 1/1/1 4/1/1 3/1/1 2/1/1
f 5//1 6//1 7//1 8//1
f 1/1 2/1 6/1 5/1
f 2 3 7 6
f 3 4 8 \\
  7
f -5 -8 -4 -1 # the last, counted back
"""


def test_obj_by_hand():
    after, warnings = read_model(put("a.obj", OBJ))
    assert [b.id for b in after.blocks] == ["lower"]
    assert after.mass.volume[0] == pytest.approx(1)
    assert mesh_faults(after.mesh) == []
    assert after.blocks[0].faces[-1] == (3, 0, 4, 7)
    assert warnings == ("a.obj: made 1 block, from the one named mesh", f"a.obj: {ASSUMED}")


def test_obj_groups_share_vertices_and_keep_their_names():
    """Two tetrahedra in groups of one object, on one pool of vertices."""
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 -1\n"
    upper, lower = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n", "f 1 2 3\nf 1 5 2\nf 2 5 3\nf 1 3 5\n"
    after, _ = read_model(put("a.obj", f"{text}g up\n{upper}g down\n{lower}"))
    assert [b.id for b in after.blocks] == ["up", "down"]
    assert after.mass.volume.tolist() == pytest.approx([1 / 6, 1 / 6])
    after, _ = read_model(put("a.obj", f"{text}o pair\ng up\n{upper}g down\n{lower}"))
    assert [b.id for b in after.blocks] == ["pair/up", "pair/down"]
    after, warnings = read_model(put("a.obj", f"{text}o pair\n{upper}{lower}"))
    assert [b.id for b in after.blocks] == ["pair-0", "pair-1"]
    assert "a.obj: made 2 blocks, one for each connected piece" in warnings
    after, _ = read_model(put("a.obj", f"{text}{upper}{lower}"))
    assert [b.id for b in after.blocks] == ["b0", "b1"]


def test_units_of_a_mesh():
    after, warnings = read_model(put("a.obj", OBJ), "cm")
    assert after.mass.volume[0] == pytest.approx(1e-6)
    assert warnings == ("a.obj: made 1 block, from the one named mesh",)


def test_a_block_of_separate_pieces_is_warned_of():
    write_mesh("a.obj", stack())
    with open("a.obj") as stream:
        text = stream.read().replace("o stone 2\n", "")  # two cubes in the second object
    _, warnings = read_model(put("a.obj", text))
    assert "a.obj: block 'stone 1' has separate pieces that move as one" in warnings


def test_names_that_stand_twice_are_numbered():
    cube = Block("a", CUBE, FACES)
    write_mesh("a.glb", Assembly((cube, Block("b", CUBE + 2, FACES), Block("c", CUBE + 4, FACES))))
    with open("a.glb", "rb") as stream:
        data = stream.read().replace(b'"name": "b"', b'"name": "a"').replace(b'"name": "c"', b'"name": "a"')
    after, warnings = read_model(put("a.glb", data))
    assert [b.id for b in after.blocks] == ["a", "a-2", "a-3"]
    assert "a.glb: the name 'a' stands 3 times; numbers were added" in warnings


def test_open_meshes_are_read_and_the_flat_triangles_of_a_soup_dropped():
    lines = ""
    for tri in ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0, 0), (1, 0, 0), (1, -0.0, 0)]):
        corners = "".join(f"vertex {x} {y} {z}\n" for x, y, z in tri)
        lines += f"facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n"
    after, warnings = read_model(put("a.stl", f"solid\n{lines}endsolid\n"))
    assert len(after.blocks[0].faces) == 1
    assert "a.stl: 1 faces without area were dropped" in warnings
    assert "open" in mesh_faults(after.mesh)[0][1]


def binary_stl(corners, count=None):
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *np.ravel(tri), 0) for tri in corners)
    return b"solid, but binary".ljust(80) + struct.pack("<I", len(corners) if count is None else count) + rows


def test_binary_stl_may_begin_with_the_word_solid():
    data = binary_stl([CUBE[list(t)] for t in TRIANGLES])
    after, warnings = read_model(put("a.stl", data))
    assert after.mass.volume[0] == pytest.approx(1)
    assert len(after.blocks[0].vertices) == 8
    assert warnings == ("a.stl: made 1 block, from the one mesh", f"a.stl: {ASSUMED}")


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_ply_of_either_order_by_hand(order):
    name = {"<": "little", ">": "big"}[order]
    head = (
        f"ply\nformat binary_{name}_endian 1.0\nelement vertex 8\nproperty float x\nproperty uchar red\n"
        "property float y\nproperty float z\nelement face 6\nproperty list uchar ushort vertex_index\n"
        "property float quality\nelement edge 0\nproperty int a\nend_header\n"
    )
    data = b"".join(struct.pack(order + "fBff", x, 7, y, z) for x, y, z in CUBE)
    data += b"".join(struct.pack(order + "B4Hf", 4, *face, 0.5) for face in FACES)
    after, _ = read_model(put("a.ply", head.encode() + data))
    assert after.blocks[0].faces == FACES
    assert after.mass.volume[0] == pytest.approx(1)


ASCII_PLY = (
    "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 8\n"
    "property double x\nproperty double y\nproperty double z\n"
    "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
    + "".join(f"{x:g} {y:g} {z:g}\n" for x, y, z in CUBE)
    + "".join(f"4 {a} {b} {c} {d}\n" for a, b, c, d in FACES)
)


def test_ascii_ply_by_hand():
    after, _ = read_model(put("a.ply", ASCII_PLY))
    assert after.blocks[0].faces == FACES
    assert after.mass.volume[0] == pytest.approx(1)


def glb(document, binary=b""):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def cube_document(*nodes, **changes):
    """One mesh, a cube between 0 and 1 in glTF's own axes, and the nodes given."""
    binary = CUBE.astype("<f4").tobytes() + np.array(TRIANGLES, "<u2").tobytes()
    document = {
        "asset": {"version": "2.0"},
        "nodes": list(nodes),
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 72},
        ],
        "buffers": [{"byteLength": 168}],
    }
    return document | changes, binary


def test_glb_tree_by_hand():
    """A cube twice as large, 5 up (y) in a parent moved 1 along x: z is up here; a mirror image is not inside out."""
    half = np.sqrt(0.5)
    document, binary = cube_document(
        {"name": "parent", "translation": [1, 0, 0], "children": [1, 2, 3]},
        {"name": "large", "mesh": 0, "translation": [0, 5, 0], "scale": [2, 2, 2]},
        {"name": "mirrored", "mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
        {"name": "turned", "mesh": 0, "rotation": [half, 0, 0, half], "translation": [0, 0, -9]},
    )
    after, warnings = read_model(put("a.glb", glb(document, binary)))
    assert [b.id for b in after.blocks] == ["large", "mirrored", "turned"]
    assert after.mass.volume.tolist() == pytest.approx([8, 1, 1])
    np.testing.assert_allclose(after.blocks[0].vertices.min(0), [1, -2, 5], atol=1e-12)
    np.testing.assert_allclose(after.blocks[1].vertices.max(0), [1, 0, 1], atol=1e-12)
    np.testing.assert_allclose(after.blocks[2].vertices.min(0), [1, 8, -1], atol=1e-12)  # y to z, z to -y in glTF
    assert warnings == ("a.glb: made 3 blocks, one for each named mesh",)


def test_glb_refusals():
    cases = [
        (cube_document({"mesh": 1}), "the GLB refers to meshes[1], but there are 1"),
        (cube_document({"children": [0], "mesh": 0}), "has no faces; a model needs at least one closed mesh"),
        (
            cube_document({"children": [1]}, {"children": [0]}, scenes=[{"nodes": [0]}]),
            "nodes[0] hangs from two nodes; the nodes must form a tree",
        ),
        (
            cube_document({"mesh": 0}, buffers=[{"uri": "a.bin"}]),
            "keeps its data in another file; export it as one GLB",
        ),
        (
            cube_document({"mesh": 0}, extensionsRequired=["KHR_draco_mesh_compression"]),
            "needs the extension 'KHR_draco_mesh_compression'; export the GLB without compression",
        ),
        (cube_document({"mesh": 0, "scale": [1, 1]}), "nodes[0].scale must have 3 numbers, found 2"),
        (cube_document({"mesh": 0, "rotation": [0] * 4}), "nodes[0].rotation is zero; a rotation is a unit quaternion"),
    ]
    for (document, binary), line in cases:
        assert refused("a.glb", glb(document, binary)) == f"a.glb: {line}"
    document, binary = cube_document({"mesh": 0})
    document["accessors"][1]["count"] = 2**31
    assert (
        refused("a.glb", glb(document, binary))
        == "a.glb: accessors[1] reaches beyond the data of the GLB; is it cut off?"
    )
    whole = glb(*cube_document({"mesh": 0}))
    assert (
        refused("a.glb", whole[:-4])
        == f"a.glb: GLB that says it is {len(whole)} bytes long, but has {len(whole) - 4}; is it cut off?"
    )
    assert refused("a.glb", b"glTF" + struct.pack("<II", 1, 20) + b" " * 8) == (
        "a.glb: is glTF version 1; export it as version 2"
    )


REFUSALS = [
    ("a.obj", "hello world", "line 1: 'hello' is not an OBJ statement"),
    ("a.obj", "# nothing\n", "has no vertices (lines 'v x y z'); is it an OBJ file?"),
    ("a.obj", "v 0 0 0\n", "has no faces; a model needs at least one closed mesh"),
    ("a.obj", "v 0 0\n", "line 1: a vertex needs three numbers, 'v x y z'"),
    ("a.obj", "v 0 0 zero\n", "line 1: a vertex needs three numbers, 'v x y z'"),
    ("a.obj", "v 0 0 nan\n", "line 1: a coordinate is not a finite number below 1e12"),
    ("a.obj", "v 0 0 0\nf 1 2 3\n", "line 2: the face names vertex 2, but 1 vertices stand above it"),
    ("a.obj", "v 0 0 0\nf 1 0 3\n", "line 2: the face names vertex 0, but 1 vertices stand above it"),
    ("a.obj", "v 0 0 0\nf 1 -2 3\n", "line 2: the face names vertex -2, but 1 vertices stand above it"),
    ("a.obj", "v 0 0 0\nf 1 x\n", "line 2: 'x' is not a vertex index"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n", "line 3: a face needs at least 3 corners, found 2"),
    (
        "a.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 1 3\n",
        "line 5: a face names one vertex twice; list every corner once",
    ),
    ("a.obj", b"v 0 0 0\no \xff\n", "line 2: byte 10 is not UTF-8 text; save the file as UTF-8"),
    ("a.stl", "solid x\n", "line 2: the file ends early: 'endsolid' is missing"),
    ("a.stl", "solid x\nfacet normal 0 0 1\nvertex 0 0 0\n", "line 3: expected 'outer', found 'vertex'"),
    (
        "a.stl",
        "solid x\nfacet\nouter loop\nvertex 0 0\n",
        "line 4: a vertex needs three finite numbers, 'vertex x y z'",
    ),
    ("a.stl", "solid x\nendsolid x\n", "has no faces; a model needs at least one closed mesh"),
    (
        "a.stl",
        "short",
        "is neither ASCII STL (it does not begin with 'solid') nor binary STL (shorter than 84 bytes)",
    ),
    (
        "a.stl",
        b"x" + binary_stl([CUBE[:3]], 4_000_000_000)[1:],
        "binary STL that says it holds 4000000000 triangles, but there is room for 1; is it cut off?",
    ),
    ("a.stl", binary_stl([[(0, 0, np.nan)] * 3]), "vertex 0, coordinate 2 is not a finite number"),
    ("a.stl", binary_stl([[(0, 1e30, 0)] * 3]), "vertex 0, coordinate 1 is 1e+30, beyond 1e12; check the units"),
    ("a.ply", "plyx\n", "is not a PLY file: its first line is not 'ply'"),
    ("a.ply", "ply\nformat ascii 1.0\n", "the PLY header has no 'end_header'; is the file cut off?"),
    ("a.ply", "ply\nformat morse 1.0\n", "line 2 of the PLY header cannot be read: 'format morse 1.0'"),
    ("a.ply", "ply\nformat ascii 1.0\nend_header\n", "PLY without an element 'vertex' that has x, y and z"),
    (
        "a.ply",
        ASCII_PLY.replace("vertex_indices", "corners"),
        "PLY without faces (a list 'vertex_indices'); a point cloud makes no blocks",
    ),
    (
        "a.ply",
        ASCII_PLY.replace("vertex 8", "vertex 800000000000"),
        "PLY that says it holds 800000000000 of 'vertex', but there is room for 14; is it cut off?",
    ),
    (
        "a.ply",
        ASCII_PLY.partition("0 0 0")[0]
        .replace("ascii", "binary_little_endian")
        .replace("vertex 8", "vertex 0")
        .replace("face 6", "face 800000000000"),
        "PLY that says it holds 800000000000 of 'face', but there is room for 0; is it cut off?",
    ),
    ("a.ply", ASCII_PLY.replace("4 0 3 2 1", "4 0 3 2"), "face 0 cannot be read: '4 0 3 2'"),
    ("a.ply", ASCII_PLY.replace("4 0 3 2 1", "4 0 3 2 9"), "face 0 names vertex 9, but the vertices are 0..7"),
    ("a.ply", ASCII_PLY.replace("1 1 1\n", "1 1 nan\n"), "vertex 6, coordinate 2 is not a finite number"),
    ("a.glb", "not a glb, but long enough for one", "is not a GLB file: it does not begin with 'glTF'"),
]


@pytest.mark.parametrize(("name", "content", "line"), REFUSALS, ids=[f"{n}: {s[:50]}" for n, _, s in REFUSALS])
def test_refusals(name, content, line):
    assert refused(name, content) == f"{name}: {line}"


def test_writers_refuse():
    for path, line in {
        "a.step": "a.step: '.step' is not a mesh file; use glb, obj, ply or stl",
        "nowhere/a.obj": "nowhere/a.obj: the folder 'nowhere' does not exist; make it first",
    }.items():
        with pytest.raises(InputError) as caught:
            write_mesh(path, stack())
        assert str(caught.value) == line
    with pytest.raises(InputError, match=r"^a\.glb: block 'x' has no faces to write$"):
        write_mesh("a.glb", Assembly((Block("x", CUBE, ()),)))
    with pytest.raises(InputError, match=r"^a\.obj: a model file ends in \.json; a mesh holds no contacts"):
        write_model("a.obj", stack())
