"""Damaged files through the command line: a verdict, or one line and status 2; never a traceback, never a hang.

Bytes of valid files of every format are damaged, and values, types and keys of valid JSON are exchanged. The seeds are
fixed; `CYCLOPEAN_CLI_FUZZ` asks for another number of cases in all.
"""

import contextlib
import copy
import json
import os
import random
import signal
import time

import pytest

from cyclopean.cli import main
from cyclopean.io import write_exchange, write_mesh, write_model
from cyclopean.proof import seal
from laws import cases
from test_io_fuzz import FEWER, FORMATS, PAIR, ascii_ply, binary_stl, compas, damaged, dump

CASES = cases("CYCLOPEAN_CLI_FUZZ", 400)
LIMIT = 10  # s
COMMANDS = ("check", "check", "info", "convert")
OTHERS = [
    *(None, True, False, 0, -1, 1, 3, 10**400, -(2**63), 1e-320, 1e-200, 1e-17, 1e13, 1e200, -1e308, 1.5),
    *(float("nan"), float("inf"), "", "g", "b1", "b0", "\x00", "\ud800", "9", "mm", "x" * 5000),
    *([], [[]], [0], [1, 2, 3], [[1, 2, 3]] * 3, {}, {"id": "b1"}, [[[[[[]]]]]]),
]


class Hang(BaseException):
    """Not an Exception: nothing may mistake it for a fault of the file."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A valid file of each format, and one certificate of each kind."""
    folder = tmp_path_factory.mktemp("whole")
    write_model(folder / "model.json", PAIR)
    for suffix in ("obj", "stl", "ply", "glb"):
        write_mesh(folder / f"mesh.{suffix}", PAIR)
    for name in ("ours.compas.json", "model.ifc", "model.3dm"):
        write_exchange(folder / name, PAIR)
    made = {"compas.json": compas(), "dump.json": dump(), "binary.stl": binary_stl(), "ascii.ply": ascii_ply()}
    for name, data in made.items():
        (folder / name).write_bytes(data)
    model = str(folder / "model.json")
    assert main(["check", model, "--certificate", str(folder / "state.cert")]) == 0
    assert main(["check", model, "--tilt", "60", "--certificate", str(folder / "mechanism.cert")]) == 1
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture
def answer(tmp_path, monkeypatch, capsys):
    """Run one command on one file and hold it to what every command owes."""
    monkeypatch.chdir(tmp_path)

    def ring(*_):
        raise Hang

    def command(name, data, *argv):
        (tmp_path / name).write_bytes(data)
        if hasattr(signal, "SIGALRM"):
            signal.signal(signal.SIGALRM, ring)
            signal.alarm(LIMIT)
        start = time.perf_counter()
        try:
            status = main(list(argv))
        finally:
            if hasattr(signal, "SIGALRM"):
                signal.alarm(0)
        out, err = capsys.readouterr()
        lines = err.splitlines()
        assert time.perf_counter() - start < LIMIT
        assert status in (0, 1, 2, 3), err
        assert all(line.startswith("cyclopean: ") for line in lines), err
        complaints = [line for line in lines if line.startswith("cyclopean: error: ")]
        assert len(complaints) == (status == 2), err
        if status == 2:
            assert out == ""
            assert sorted(os.listdir()) == [name]
        for made in set(os.listdir()) - {name}:
            if made == "proof.json":
                assert main(["verify", made]) == 0, "a certificate that the program wrote itself"
                capsys.readouterr()
            os.remove(made)
        return status, out

    yield command
    for left in os.listdir():
        print(f"the culprit is {tmp_path / left}")


def asked(name, rng):
    """A command line that reads `name`."""
    if name.endswith(".cert"):
        return ("verify", name)
    command = rng.choice(COMMANDS)
    if command == "convert":
        return ("convert", name, "other." + rng.choice(("json", "obj", "stl", "ply", "glb")))
    options = rng.choice(((), ("--json", "-")))
    return (command, name, *options, *(("--certificate", "proof.json") if command == "check" else ()))


def tried(answer, name, data, rng):
    """Run a random command; what it prints as JSON must be JSON."""
    argv = asked(name, rng)
    status, out = answer(name, data, *argv)
    if "-" in argv and status != 2:
        json.loads(out, parse_constant=lambda text: pytest.fail(f"{text} is not JSON"))
    os.remove(name)
    return status


@pytest.mark.parametrize("name", [*FORMATS, "state.cert", "mechanism.cert"])
def test_damaged_bytes(answer, whole, name):
    rng = random.Random(name)
    count = max(CASES // 16 // FEWER.get(name, 1), 2)
    refused = sum(tried(answer, name, damaged(whole[name], rng), rng) in (1, 2) for _ in range(count))
    assert refused > count // 10  # the damage is real


def places(value, path=()):
    """Every place in parsed JSON, as a path of keys and indices."""
    yield path
    if isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from places(item, (*path, key))


def exchanged(document, rng):
    """The document with a few values, types, keys or entries changed."""
    document = copy.deepcopy(document)
    for _ in range(rng.choice((1, 1, 2, 4))):
        options = list(places(document))[1:]
        if not options:
            break
        depth = rng.choice(sorted({len(path) for path in options}))  # as often at the top as deep down
        *path, key = rng.choice([path for path in options if len(path) == depth])
        holder = document
        for step in path:
            holder = holder[step]
        match rng.randrange(6):
            case 0 | 1:
                holder[key] = copy.deepcopy(rng.choice(OTHERS))
            case 2:
                del holder[key]
            case 3 if isinstance(holder, dict):
                holder[rng.choice(("id", "x", "fixed", "", key + "s"))] = holder.pop(key)
            case 4 if isinstance(holder[key], int | float) and abs(holder[key]) < 1e300:
                holder[key] = holder[key] * rng.choice((-1, 1 + 1e-9, 1.001, 1e3, 1e-9, 1e9, 1e160, 1e-160))
            case _ if isinstance(holder, list):
                holder.insert(key, copy.deepcopy(rng.choice(holder)))
    return document


@pytest.mark.parametrize("name", ["model.json", "compas.json", "dump.json", "state.cert", "mechanism.cert"])
def test_exchanged_values(answer, whole, name):
    rng = random.Random(name)
    document = json.loads(whole[name])
    for _ in range(max(CASES // 16, 2)):
        data = exchanged(document, rng)
        if name.endswith(".cert"):  # the seal would hide everything else
            with contextlib.suppress(ValueError):
                data["seal"] = seal(data)
        tried(answer, name, json.dumps(data).encode(), rng)
