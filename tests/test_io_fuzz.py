"""Damaged files of every format: a model or an InputError of one line that names the file, never anything else.

Each case damages a small valid file by a few random edits of bytes (change, insert, delete, repeat, cut off). The
seeds are fixed; `CYCLOPEAN_FUZZ` asks for another number of cases of each format.
"""

import json
import random
import struct
import time

import numpy as np
import pytest

from cyclopean.assembly import Assembly, Block, Contacts, Load
from cyclopean.errors import InputError
from cyclopean.io import read_model, write_exchange, write_mesh, write_model
from laws import cases

CASES = cases("CYCLOPEAN_FUZZ", 250)  # of each of eleven files
FEWER = {"model.3dm": 10}  # each that is not plainly broken costs a process of its own: one case for so many of others

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
PAIR = Assembly(
    (Block("b0", CUBE, FACES, 2400.0, True, "course"), Block("b1", CUBE + np.array([0, 0, 1]), FACES)),
    Contacts.of([(0, 1)], [CUBE[4:8]], [0.7]),
    (Load(1, np.array([1.0, 0, 0]), np.array([1, 0.5, 1.5])),),
)
# what damage likes to hit: numbers that overflow, are not finite, or are far too many
TOKENS = [
    *b'1e400 NaN -1 -Infinity 1e13 null true 9999999999999999999999999 [ { } ] " , 0 \\'.split(),
    *(b"\n", b" ", b"\xff\xff\xff\xff", b"\x00\x00\x80\x7f", b"\x01\x00\xa0\x7f"),  # the last two: inf, signalling NaN
]


def compas():
    def mesh(lift):
        vertex = {str(k): dict(zip("xyz", (x, y, z + lift), strict=True)) for k, (x, y, z) in enumerate(CUBE.tolist())}
        return {"dtype": "Block", "data": {"vertex": vertex, "face": {str(k): list(f) for k, f in enumerate(FACES)}}}

    frame = {"dtype": "Frame", "data": {"point": [0, 0, 1], "xaxis": [1, 0, 0], "yaxis": [0, 1, 0]}}
    interface = {"dtype": "Interface", "data": {"points": CUBE[4:8].tolist(), "frame": frame}}
    node = {"0": {"block": mesh(0.0), "is_support": True}, "1": {"block": mesh(1.0)}}
    graph = {"node": node, "edge": {"0": {"1": {"interfaces": [interface]}}, "1": {}}}
    return json.dumps({"dtype": "Assembly", "data": {"graph": {"dtype": "Graph", "data": graph}}}).encode()


def dump():
    blocks = [
        {"id": k, "fixed": k == 0, "density": None, "vertices": (CUBE + np.array([0, 0, k])).tolist(), "faces": FACES}
        for k in range(2)
    ]
    interfaces = [{"a": 0, "b": 1, "polygon": CUBE[4:8].tolist(), "frame": {"n": [0, 0, 1]}}]
    data = {"name": "pair", "mu": 0.6, "density": 1.0, "blocks": blocks, "interfaces": interfaces}
    return json.dumps(data).encode()


def binary_stl():
    corners = [CUBE[[f[0], f[k], f[k + 1]]] + [0, 0, lift] for lift in (0, 1) for f in FACES for k in (1, 2)]
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *np.ravel(tri), 0) for tri in corners)
    return b" " * 80 + struct.pack("<I", len(corners)) + rows


def ascii_ply():
    head = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
    rows = [f"{x:g} {y:g} {z:g}" for x, y, z in CUBE] + [f"4 {a} {b} {c} {d}" for a, b, c, d in FACES]
    return (head + "element face 6\nproperty list uchar int vertex_indices\nend_header\n" + "\n".join(rows)).encode()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A valid file of each format."""
    folder = tmp_path_factory.mktemp("whole")
    write_model(folder / "model.json", PAIR)
    files = {"model.json": (folder / "model.json").read_bytes()}
    for suffix in ("obj", "stl", "ply", "glb"):
        write_mesh(folder / f"mesh.{suffix}", PAIR)
        files[f"mesh.{suffix}"] = (folder / f"mesh.{suffix}").read_bytes()
    for name in ("ours.compas.json", "model.ifc", "model.3dm"):
        write_exchange(folder / name, PAIR)
        files[name] = (folder / name).read_bytes()
    made = {"compas.json": compas(), "dump.json": dump(), "binary.stl": binary_stl(), "ascii.ply": ascii_ply()}
    return files | made


def damaged(data, rng):
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        at = rng.randrange(len(data) + 1)
        match rng.randrange(8):
            case 0:
                data[at : at + 1] = bytes([rng.randrange(256)])
            case 1 if at < len(data):
                data[at] ^= 1 << rng.randrange(8)
            case 2:
                data[at:at] = rng.choice(TOKENS)
            case 3:
                token = rng.choice(TOKENS)
                data[at : at + len(token)] = token
            case 4:
                del data[at : at + rng.randrange(1, 20)]
            case 5:
                data[at:at] = data[at : at + rng.randrange(1, 60)]
            case 6:  # a whole number made another, where it hurts: counts, indices, versions
                spots = [k for k, byte in enumerate(data) if 48 <= byte < 58]
                if spots:
                    spot = rng.choice(spots)
                    data[spot : spot + 1] = rng.choice((b"9", b"0", b"-1", b"99999999", b"1.5", b"1e9", b"1e308"))
            case _:
                if rng.random() < 0.3:
                    del data[at:]
    return bytes(data)


FORMATS = [
    "model.json",
    "compas.json",
    "dump.json",
    "mesh.obj",
    "mesh.stl",
    "binary.stl",
    "mesh.ply",
    "ascii.ply",
    "mesh.glb",
    "ours.compas.json",
    "model.ifc",
    "model.3dm",
]


@pytest.mark.parametrize("name", FORMATS)
def test_damage_is_refused_in_one_line_or_read(name, whole, tmp_path):
    rng = random.Random(name)
    path = tmp_path / name
    path.write_bytes(whole[name])
    assert len(read_model(path)[0]) in (1, 2)  # the file itself is good
    refused, cases = 0, CASES // FEWER.get(name, 1)
    for case in range(cases):
        data = damaged(whole[name], rng)
        path.write_bytes(data)
        start = time.perf_counter()
        try:
            assembly, warnings = read_model(path)
            assert np.isfinite(assembly.mass.volume).all()
            assert len(assembly) >= 1
            lines = list(warnings)
        except InputError as error:
            refused += 1
            lines = [str(error)]
        except BaseException:
            (tmp_path / "culprit").write_bytes(data)
            print(f"{name}, case {case}: see {tmp_path / 'culprit'}")
            raise
        for line in lines:
            assert line.startswith(str(path)), line
            assert line.isprintable(), line
            assert len(line) < len(str(path)) + 400, line
        assert time.perf_counter() - start < 10.0
    assert refused > cases // 10  # the damage is real
