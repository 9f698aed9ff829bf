"""Names that command: formulas for a spreadsheet in every CSV, control characters for a terminal in every output."""

import csv
import io
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cyclopean
from cyclopean.design import stack
from cyclopean.io import write_json, write_mesh, write_model
from cyclopean.io.csv_tables import cell_text, csv_number, csv_text
from cyclopean.io.stocklist import read_stocklist

SOURCE = Path(cyclopean.__file__).parent
FORMULAS = ("=cmd|' /C calc'!A0", "+A1", "-A1", "@SUM(A1)", "'=A1", " =A1", "-2+3", "＝A1")
NUMBER = re.compile(r"[+-]?[0-9]+(\.[0-9]*)?")


def cells(text):
    return [cell for row in csv.reader(io.StringIO(text, newline=""), strict=True) for cell in row]


def runs(text):
    """Cells of a table that a spreadsheet would run."""
    return [cell for cell in cells(text) if cell.lstrip(" ")[:1] in tuple("=+-@\t\r\n＝＋－＠") and cell.strip(" ")]


def formulas(text):
    return [cell for cell in runs(text) if not NUMBER.fullmatch(cell)]


@given(st.text(alphabet="'=+-@\t\r\n ab1.,\"＝", max_size=6))
def test_what_is_written_is_harmless_and_read_again(name) -> None:
    text = csv_text(["id", "n"], [[name, "1"]])
    assert formulas(text) == []
    assert cell_text(cells(text)[2]) == name


def test_numbers_stay_numbers() -> None:
    said = [csv_number(x) for x in (-2.5, 1e-9, -1e20, 0.0)]
    assert cells(csv_text(["a"] * 4, [said]))[4:] == said


def named(model):
    return replace(
        model, blocks=tuple(replace(b, id=n) for b, n in zip(model.blocks, ["ground", *FORMULAS], strict=True))
    )


def test_tables_of_a_model(run) -> None:
    write_model("in.json", named(stack(len(FORMULAS))))
    status, _, complaint = run("convert", "in.json", "out.csv")
    assert status == 0, complaint
    for name in ("out-blocks.csv", "out-contacts.csv"):
        text = Path(name).read_bytes().decode()
        assert formulas(text) == []
        assert {cell_text(cell) for cell in cells(text)} >= set(FORMULAS)


def test_a_stock_list_goes_in_and_cut_lists_come_out(run) -> None:
    """The ids are the same on the way, whether the stock list was written by us or not."""
    names = [name.strip() for name in FORMULAS]
    rows = [[name, "0.4", "0.2", "0.2", "3"] for name in dict.fromkeys(names)]
    Path("stock.csv").write_text(csv_text(["id", "length", "height", "depth", "count"], rows))
    slabs = read_stocklist("stock.csv")
    assert [slab.id for slab in slabs] == [f"{row[0]}-{k}" for row in rows for k in (1, 2, 3)]
    made = "--width", "1.4", "--height", "0.4", "--depth", "0.2", "--out", "wall.json"
    status, _, complaint = run("ashlar", "stock.csv", *made, "--cutlist", "cuts.csv", "--left", "left.csv")
    assert status == 0, complaint
    found = set()
    for name in ("cuts.csv", "left.csv"):
        text = Path(name).read_bytes().decode()
        assert formulas(text) == []
        found |= {cell_text(cell) for cell in cells(text)}
    assert found >= {slab.id for slab in slabs}


def test_only_one_room_writes_csv() -> None:
    writing = [p for p in SOURCE.rglob("*.py") if re.search(r"csv\.(writer|DictWriter)|\.to_csv", p.read_text("utf-8"))]
    assert [p.name for p in writing] == ["csv_tables.py"]


COMMANDING = "\x1b]0;owned\x07\x1b[31m\x9b5m\u202ea"
FORBIDDEN = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069]")


def spoken(folder, *arguments, program="cyclopean"):
    """Everything that the program says, as it reaches the terminal."""
    command = [sys.executable, "-m", program, *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, timeout=600, check=False)
    return done.returncode, (done.stdout + b"\n" + done.stderr).decode("utf-8")


@pytest.fixture(scope="module")
def yard(tmp_path_factory):
    """Files whose names, and what they name inside, command the terminal."""
    folder = tmp_path_factory.mktemp("yard")
    model = stack(2)
    write_model(folder / f"{COMMANDING}.json", model)
    for suffix in ("obj", "ply", "stl", "glb"):
        write_mesh(folder / f"{COMMANDING}.{suffix}", model)
    obj = folder / f"{COMMANDING}.obj"
    obj.write_bytes(re.sub(rb"^o (.*)$", f"o {COMMANDING}".encode(), obj.read_bytes(), flags=re.MULTILINE))
    (folder / "text.json").write_text(
        '{"schema": "cyclopean.model/1", "blocks": [{"id": "\\u001b[31m", "\\u001b[32m": 1}]}'
    )
    (folder / f"{COMMANDING}.csv").write_text(f"length,height,{COMMANDING}\n1,1,1\n")
    return folder


@pytest.mark.parametrize(
    ("words", "status"),
    [
        (("check", f"{COMMANDING}.json"), 0),
        (("check", f"{COMMANDING}.json", "--json", "-"), 0),
        (("check", f"{COMMANDING}.json", "--json", f"{COMMANDING}-result.json"), 0),
        (("limit", f"{COMMANDING}.json", "--tilt"), 0),
        (("info", f"{COMMANDING}.json"), 0),
        (("info", "--stones", f"{COMMANDING}.glb", "--json", "-"), 0),
        (("info", f"{COMMANDING}.obj"), 0),
        (("info", "--stones", f"{COMMANDING}.stl", "--units", "m"), 0),
        (("convert", f"{COMMANDING}.json", f"{COMMANDING}-out.ifc"), 0),
        (("convert", f"{COMMANDING}.obj", f"{COMMANDING}-out.csv"), 0),
        (("sequence", f"{COMMANDING}.json", "--out", f"{COMMANDING}-order.json"), 0),
        (("ashlar", f"{COMMANDING}.csv", "--width", "1", "--height", "1", "--depth", "1"), 2),
        (("check", f"{COMMANDING}-missing.json"), 2),
        (("check", f"{COMMANDING}.json", f"--{COMMANDING}"), 2),
        (("check", f"{COMMANDING}.json", "--mu", COMMANDING), 2),
        (("verify", f"{COMMANDING}.json"), 2),
        (("check", "text.json"), 2),
        (("make", COMMANDING), 2),
        ((COMMANDING,), 2),
        (("serve", "--hops", "--host", COMMANDING), 2),
        (("serve", "--hops", "--allow-folders", COMMANDING), 2),
    ],
    ids=lambda value: "-".join(map(str, value)).replace(COMMANDING, "x") if isinstance(value, tuple) else None,
)
def test_no_control_character_reaches_the_terminal(yard, words, status, run, monkeypatch) -> None:
    monkeypatch.chdir(yard)
    found, out, complaint = run(*words)
    said = out + "\n" + complaint
    assert FORBIDDEN.findall(said) == [], said
    assert found == status, said


def test_a_terminal_of_its_own_hears_the_same(yard, run, monkeypatch) -> None:
    words = "info", f"{COMMANDING}.obj"
    monkeypatch.chdir(yard)
    status, out, complaint = run(*words)
    assert spoken(yard, *words) == (status, out + "\n" + complaint)


def test_json_stays_json_whatever_it_names(run) -> None:
    """C1 controls and marks that turn the direction of writing are escaped as JSON has it, and read the same."""
    write_mesh(f"{COMMANDING}.glb", stack(1))
    status, said, complaint = run("info", "--stones", f"{COMMANDING}.glb", "--json", "-")
    assert status == 0, complaint
    assert FORBIDDEN.findall(said) == []
    assert json.loads(said)["source"] == f"{COMMANDING}.glb"


def test_the_checker_alone_says_nothing_that_commands(tmp_path) -> None:
    write_json(tmp_path / f"{COMMANDING}.json", {"schema": f"cyclopean.certificate/{COMMANDING}"})
    write_json(tmp_path / "kind.json", {"schema": "cyclopean.certificate/1", "kind": COMMANDING, "claim": COMMANDING})
    for name in (f"{COMMANDING}.json", "kind.json", f"{COMMANDING}-missing.json"):
        _, said = spoken(tmp_path, name, program="cyclopean.proof")
        assert said.strip()
        assert FORBIDDEN.findall(said) == []
