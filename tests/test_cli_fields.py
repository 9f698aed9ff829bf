"""Refusals of a polygonal wall name the option that was typed, whatever the design calls it.

Mutants killed (by hand): a field left out of the list; an underscore kept; the part of a field lost.
"""

import ast
from dataclasses import fields
from inspect import signature
from pathlib import Path

import pytest

from cyclopean.cli.polygonal import polygonal as command
from cyclopean.design.walls import corner, polygonal
from cyclopean.design.walls.dressing import Coping, Quoins
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings

WALLS = Path(polygonal.__file__).parent
ONLY_PYTHON = {  # what no option says
    "outline",
    "rounds", "seconds", "tolerance", "lines", "wall", "middle", "ruled width", "ruled height", "surface width",
    "surface height", "return plane x", "improve",
}  # fmt: skip
NOT_SAID = {
    "settings",
    "outline",  # of a surface
    "length",
    "left",
    "right",
    "corner",
}  # of dataclasses and functions; no refusal begins so

TYPED = [
    (["--width", "0"], "--width: must be more than 0"),
    (["--height", "-1"], "--height: must be more than 0"),
    (["--columns", "0"], "--columns: expected a whole number"),
    (["--columns", "1", "--rows", "1"], "--columns: 1 x 1 rows"),
    (["--rows", "0"], "--rows: expected a whole number"),
    (["--courses", "0"], "--courses: expected a whole number"),
    (["--seed", "-1"], "--seed: expected a whole number"),
    (["--lloyd", "-1"], "--lloyd: expected a whole number"),
    (["--jitter", "0.6"], "--jitter: must be between"),
    (["--coursing", "2"], "--coursing: must be between"),
    (["--sliver", "2"], "--sliver: must be between"),
    (["--size-grade", "-1"], "--size-grade: must not be negative"),
    (["--depth", "0"], "--depth: must be more than 0"),
    (["--batter", "-1"], "--batter: must not be negative"),
    (["--batter", "0.2"], "--batter: 0.2 leaves nothing"),
    (["--mu", "-1"], "--mu -1: expected a number >= 0"),
    (["--density", "0"], "--density 0: expected a positive number of kg/m3"),
    (["--base", "radius:1"], "--base: radius 1 m is below half"),
    (["--base", "0:0,1:0.1"], "--base: the points must run"),
    (["--base", "0:0,3:-0.1"], "--base: the height -0.1 m"),
    (["--quoins", "0.2,0.3"], "--quoins: long 0.2 m is less than short"),
    (["--quoins", "0.2,0"], "--quoins: short must be more than 0"),
    (["--quoins", "-1,0.1"], "--quoins: long must be more than 0"),
    (["--quoins", "0.5,0.3,0"], "--quoins: height must be more than 0"),
    (["--coping", "0"], "--coping: height must be more than 0"),
    (["--coping", "3"], "--coping: height 3 m leaves no wall"),
    (["--coping", "0.1,0"], "--coping: length must be more than 0"),
    (["--opening", "-1,0,1,1"], "--opening: left must not be negative"),
    (["--opening", "1,-1,1,1"], "--opening: sill must not be negative"),
    (["--opening", "1,0,0,1"], "--opening: width must be more than 0"),
    (["--opening", "1,0,1,0"], "--opening: height must be more than 0"),
    (["--opening", "1,0,1,0.2,arch"], "--opening: rise 0.5 m is more than"),
    (["--opening", "1,0,1,9"], "--opening: number 1 with its head"),
    (["--surface", "cylinder:0"], "--surface: cylinder radius must not be 0"),
    (["--surface", "cone:0"], "--surface: cone radius must not be 0"),
    (["--surface", "cone:4,90"], "--surface: cone lean must be between"),
    (["--surface", "sphere:0"], "--surface: sphere radius must not be 0"),
    (["--surface", "sphere:4,90"], "--surface: sphere latitude must be between"),
    (["--surface", "cylinder:0.4"], "--surface: a cylinder with a foot of radius"),
    (["--corner", "0.1"], "--corner: 0.1 m leaves nothing"),
    (["--display", "d.json", "--gap", "-1"], "--gap: must not be negative"),
    (["--display", "d.json", "--gap", "1"], "--gap: 1 m with a chamfer"),
    (["--display", "d.json", "--chamfer", "-1"], "--chamfer: must not be negative"),
    (["--display", "d.json", "--chamfer", "0.2"], "--chamfer: 0.2 m is not less than"),
    (["--warped", "flat"], "--warped: 'flat' is not one of"),
    (["--improve", "K"], "--improve K: expected J"),
]


@pytest.mark.parametrize(("argv", "says"), TYPED, ids=lambda x: x if isinstance(x, str) else None)
def test_refusals_begin_with_the_option(run, argv, says) -> None:
    status, out, err = run("make", "polygonal", *argv, "--out", "w.json")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"cyclopean: error: {says}"), err


def test_refusals_of_other_models_do_so_too(run) -> None:
    for argv, says in (
        (["stack", "2", "--size", "1,0,1"], "--size: must be more than 0"),
        (["wall", "2", "2", "--depth", "0"], "--depth: must be more than 0"),
        (["arch", "5", "--span", "0"], "--span: must be more than 0"),
        (["dome", "5", "9", "--oculus", "90"], "--oculus: must be between"),
    ):
        status, _, err = run("make", *argv, "--out", "w.json")
        assert (status, err.startswith(f"cyclopean: error: {says}")) == (2, True), err


def test_every_field_has_its_option() -> None:
    given = {name for kind in (polygonal.polygonal_wall, corner.corner_wall) for name in signature(kind).parameters}
    given |= {one.name for one in fields(PatternSettings)}
    for prefix, kind in (("quoins", Quoins), ("coping", Coping), ("opening", Opening)):
        own = {one.name for one in fields(kind)}
        given |= {f"{prefix} {name}" for name in own - ({"left", "right", "corner"} if kind is Quoins else set())}
    assert sorted(name for name in given - NOT_SAID if not typed(name).startswith("--")) == []


def typed(head: str) -> str:
    """What a refusal that begins so is told as."""
    return command._as_typed(f"{head}: no", {})


def heads(path: Path) -> set[str]:
    """What the refusals of a module begin with, as far as that is written there in one piece."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.args):
            continue
        said = node.args[0].values[0] if isinstance(node.args[0], ast.JoinedStr) else node.args[0]
        if not isinstance(said, ast.Constant) or not isinstance(said.value, str):
            continue
        if node.func.id == "InputError" and ":" in said.value:
            found.add(said.value.partition(":")[0])
        if node.func.id in ("positive", "not_negative", "within", "at_least", "finite") and said is node.args[0]:
            found.add(said.value)
    return found


@pytest.mark.parametrize("path", sorted(WALLS.glob("*.py")), ids=lambda path: path.stem)
def test_every_refusal_of_the_design_has_its_option(path) -> None:
    assert sorted(head for head in heads(path) - ONLY_PYTHON if not typed(head).startswith("--")) == []


def test_the_search_for_refusals_finds_some() -> None:
    found = set().union(*map(heads, WALLS.glob("*.py")))
    assert {"base_radius", "openings", "quoins long", "gap", "corner", "size_grade"} <= found


def test_only_the_beginning_of_a_refusal_is_changed() -> None:
    for before, after in (
        (
            "size_grade: must not be negative, size_grade: it is",
            "--size-grade: must not be negative, size_grade: it is",
        ),
        ("base_radius: 1 m", "--base: radius 1 m"),
        ("wall.json: depth: no number", "wall.json: depth: no number"),
        ("depth of the wall", "depth of the wall"),
    ):
        assert command._as_typed(before, {}) == after
