"""Damaged and hostile caches and archives, read by a process that may take little memory and little time.

Each case is a small sound file that was hurt, or one that unfolds: compressed, or with a mesh that stands in many
places. What is read is a model or nothing; what is refused is refused in one line. `CYCLOPEAN_DAMAGED` asks for
another number of hurt files than 300.
"""

import io
import json
import os
import random
import struct
import subprocess
import sys

import numpy as np
import pytest

from cyclopean.design import stack
from cyclopean.design.stones.quarry import quarry
from cyclopean.errors import InputError
from cyclopean.io import archives, write_exchange, write_mesh
from cyclopean.io.fields import ROWS
from cyclopean.io.stone_cache import Reading, packed
from laws import cases

resource = pytest.importorskip("resource", reason="this system has no limits for a process")

CASES = cases("CYCLOPEAN_DAMAGED", 300)
SHARES = {"model.glb": 0.3, "model.ifc": 0.25, "model.3dm": 0.05, "pack.npz": 0.4}
NEEDS = {"model.ifc": "ifcopenshell", "model.3dm": "rhino3dm"}
ROOM = 1 << 30  # bytes beside what the process has when everything is loaded
SECONDS = 60.0  # of the processor for one file; a sound one takes less than a tenth of a second

READER = """
import importlib.util, json, resource, sys, time
from pathlib import Path
from cyclopean.errors import InputError
from cyclopean.io import read_model
from cyclopean.io.npz import UNREADABLE, arrays_of
from cyclopean.io.stone_cache import read_pack

for name in sys.argv[3:]:
    if importlib.util.find_spec(name):
        __import__(name)
room = int(sys.argv[2]) + int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (room, room))
for path in sorted(Path(sys.argv[1]).iterdir()):
    began = time.process_time()
    try:
        if path.suffix == ".npz":
            said = f"read {sum(len(reading.stones) for reading in read_pack(path).values())}"
        else:
            said = f"read {len(read_model(path)[0])}"
    except InputError as error:
        said = str(error)
    print(json.dumps([path.name, said, time.process_time() - began]), flush=True)
"""


def answers(folder, *libraries):
    """What reading each file of a folder gave, and the seconds that it took, by its name."""
    if not os.path.exists("/proc/self/statm"):
        pytest.skip("this system does not say what a process takes")
    command = [sys.executable, "-c", READER, str(folder), str(ROOM), *libraries]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=False)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == 0, (rows[-1:], done.stderr[-2000:])
    assert sorted(name for name, *_ in rows) == sorted(os.listdir(folder))
    return {name: (said, seconds) for name, said, seconds in rows}


def hurt(data, dice):
    """The bytes with one to eight wounds."""
    data = bytearray(data)
    for _ in range(dice.choice((1, 1, 1, 2, 3, 8))):
        at = dice.randrange(len(data))
        few = dice.randrange(1, 40)
        match dice.randrange(6):
            case 0:
                data[at] ^= 1 << dice.randrange(8)
            case 1:
                data[at : at + 4] = struct.pack("<I", dice.choice((0, 1, 2**31 - 1, 2**31, 2**32 - 1)))
            case 2:
                del data[at : at + few]
            case 3:
                data[at:at] = data[at : at + few]
            case 4:  # a number of the text made another
                digits = [k for k, byte in enumerate(data) if 48 <= byte < 58]
                spot = dice.choice(digits or [at])
                data[spot : spot + 1] = dice.choice((b"999999999", b"0", b"-1", b"1e308"))
            case _ if dice.random() < 0.3:
                del data[max(at, 1) :]
            case _:
                data[at : at + few] = bytes(few)
    return bytes(data)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A sound file of each kind."""
    folder = tmp_path_factory.mktemp("whole")
    write_mesh(folder / "model.glb", stack(3))
    stream = io.BytesIO()
    np.savez(stream, **packed({"digest": Reading(tuple(quarry(2, seed=1, volume=(0.6, 1.4), detail=1)))}))
    (folder / "pack.npz").write_bytes(stream.getvalue())
    for name, library in NEEDS.items():
        pytest.importorskip(library, reason=f"{library} is not installed")
        write_exchange(folder / name, stack(3))
    return folder


@pytest.mark.parametrize("name", SHARES)
def test_hurt_files_cost_little(whole, tmp_path, name) -> None:
    dice = random.Random(name)
    sound = (whole / name).read_bytes()
    count = max(round(SHARES[name] * CASES), 2)
    stem, suffix = name.split(".")
    (tmp_path / f"{stem}-whole.{suffix}").write_bytes(sound)
    for k in range(count):
        (tmp_path / f"{stem}-{k:04d}.{suffix}").write_bytes(hurt(sound, dice))
    found = answers(tmp_path, *NEEDS.values())
    assert found.pop(f"{stem}-whole.{suffix}")[0].startswith("read ")
    for file, (said, seconds) in found.items():
        assert seconds < SECONDS, file
        assert said.isprintable(), file
        assert said.startswith(("read ", str(tmp_path / file))), (file, said)
    assert any(not said.startswith("read ") or said == "read 0" for said, _ in found.values())


def shared_glb(path, nodes, triangles):
    """One mesh that stands in many places."""
    write_mesh(path, stack(1))
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + size])
    order = np.tile(np.arange(3, dtype="<u4"), triangles).tobytes()
    binary = data[28 + size :] + order
    document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary) - len(order), "byteLength": len(order)})
    view = len(document["bufferViews"]) - 1
    document["accessors"].append({"bufferView": view, "componentType": 5125, "count": 3 * triangles, "type": "SCALAR"})
    document["meshes"][0]["primitives"][0]["indices"] = len(document["accessors"]) - 1
    document["nodes"] = [{"mesh": 0}] * nodes
    document["scenes"] = [{"nodes": list(range(nodes))}]
    document["buffers"] = [{"byteLength": len(binary)}]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def shared_ifc(path, elements, faces):
    """One body that many elements have."""
    ifcopenshell = pytest.importorskip("ifcopenshell")
    write_exchange(path, stack(1))
    file = ifcopenshell.open(str(path))
    part = file.by_type("IfcBuildingElementPart")[0]
    body = file.by_type("IfcPolygonalFaceSet")[0]
    body.Faces = [*body.Faces] + [body.Faces[0]] * faces
    for _ in range(elements):
        file.create_entity(
            "IfcBuildingElementPart", GlobalId=ifcopenshell.guid.new(), Representation=part.Representation
        )
    path.write_text(file.to_string())


def folded_3dm(path, vertices):
    """A mesh whose vertices are compressed to next to nothing."""
    rhino = pytest.importorskip("rhino3dm")
    file, mesh = rhino.File3dm(), rhino.Mesh()
    mesh.Vertices.Add(0.0, 0.0, 0.0)
    while len(mesh.Vertices) < vertices:
        mesh.Append(mesh.Duplicate())
    mesh.Faces.AddFace(0, 1, 2)
    file.Objects.AddMesh(mesh)
    file.Write(str(path), 8)


@pytest.mark.parametrize(
    ("name", "fold"),
    [
        ("a.glb", lambda path: shared_glb(path, 3000, 3000)),
        ("a.ifc", lambda path: shared_ifc(path, 3000, 500)),
        ("a.3dm", lambda path: folded_3dm(path, ROWS + 1000)),
    ],
)
def test_small_files_that_unfold_are_refused(tmp_path, name, fold) -> None:
    fold(tmp_path / name)
    assert (tmp_path / name).stat().st_size < ROWS
    said, seconds = answers(tmp_path, "ifcopenshell", "rhino3dm")[name]
    assert "unfold to more than 2,000,000 vertices and corners" in said
    assert seconds < SECONDS


@pytest.mark.skipif(sys.platform != "linux", reason="the limit is kept by Linux only")
def test_the_process_that_tries_an_archive_has_little_memory(whole, monkeypatch) -> None:
    """A sound file is read; with no room for more than a megabyte it is not."""
    sound = (whole / "model.3dm").read_bytes()
    archives.refuse_damaged("a.3dm", sound)
    monkeypatch.setattr(archives, "_ROOM", (1 << 20, 0))
    with pytest.raises(InputError, match="damaged"):
        archives.refuse_damaged("a.3dm", sound)


def test_a_pack_that_unfolds_is_none(tmp_path, whole) -> None:
    """Less than 1 MB that would be 128 MB: it is not unpacked, although everything else in it is sound."""
    with np.load(whole / "pack.npz") as data:
        np.savez_compressed(tmp_path / "pack.npz", **(dict(data) | {"more": np.zeros((1 << 27) // 8)}))
    assert (tmp_path / "pack.npz").stat().st_size < 1 << 20
    said, seconds = answers(tmp_path)["pack.npz"]
    assert said == "read 0"
    assert seconds < SECONDS
