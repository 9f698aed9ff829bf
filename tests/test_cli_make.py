"""`make`, `info`, `convert` and `demo`."""

import json
import os
from pathlib import Path

import pytest

from cyclopean import design
from cyclopean.cli.demo import FILES
from cyclopean.cli.outputs import MESHES
from cyclopean.design.earthworks import BridgeShape, DryStone, Soil
from cyclopean.design.walls.dressing import Coping, Quoins
from cyclopean.design.walls.interlock import interlock
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cone, Cylinder, Sphere
from cyclopean.io import MESH_SUFFIXES, read_model
from laws import nightly

MADE = [
    (["stack", 3, "--size", "1,2,0.5", "--offset", "-0.2", "--slope", "10"],
     lambda: design.stack(3, (1.0, 2.0, 0.5), offset=-0.2, slope=10.0)),
    (["stack", 2, "--offset", "-0.1,0.3", "--no-ground"], lambda: design.stack(2, offset=[-0.1, 0.3], ground=False)),
    (["wall", 4, 3, "--length", "0.5", "--depth", "0.3", "--height", "0.25", "--ground", "course"],
     lambda: design.wall(4, 3, length=0.5, depth=0.3, height=0.25, ground="course")),
    (["arch", 9, "--span", "4", "--rise", "1", "--thickness", "0.4", "--depth", "0.6", "--facets", "2"],
     lambda: design.arch(9, span=4.0, rise=1.0, thickness=0.4, depth=0.6, facets=2)),
    (["arch", 9, "--radius", "3", "--springers", "fixed"], lambda: design.arch(9, radius=3.0, springers="fixed")),
    (["vault", 7, 3, "--radius", "2", "--thickness", "0.4", "--length", "3"],
     lambda: design.vault(7, 3, radius=2.0, thickness=0.4, length=3.0)),
    (["dome", 4, 8, "--radius", "2", "--thickness", "0.3", "--oculus", "20", "--mu", "0.6", "--density", "2000"],
     lambda: design.dome(4, 8, radius=2.0, thickness=0.3, oculus=20.0, mu=0.6, density=2000.0)),
    (["retaining", 2, 3, "--base", "0.8", "--inward", "5", "--through", "2", "--friction", "33", "--mu", "0.6"],
     lambda: design.retaining(2, 3, DryStone(base=0.8, inward=5.0, through=2), Soil(friction=33.0), mu=0.6)),
    (["bridge", 9, "--span", "4", "--rise", "1.2", "--spread", "boussinesq"],
     lambda: design.bridge(9, BridgeShape(span=4.0, rise=1.2, spread="boussinesq"))),
]  # fmt: skip


@pytest.mark.parametrize(("argv", "template"), MADE)
def test_every_option_reaches_the_template_and_the_file(run, argv, template):
    status, out, err = run("make", *argv, "--out", "m.json")
    assert (status, err) == (0, "")
    assert out.count("\n") == 1
    assert "m.json" in out
    model, warnings = read_model("m.json")
    wanted = template()
    assert warnings == ()
    assert [(b.id, b.fixed, b.group, b.density, b.faces) for b in model.blocks] == [
        (b.id, b.fixed, b.group, b.density, b.faces) for b in wanted.blocks
    ]
    assert model.mesh.vertex.tolist() == wanted.mesh.vertex.tolist()
    assert model.contacts.point.tolist() == wanted.contacts.point.tolist()
    assert model.contacts.mu.tolist() == pytest.approx(wanted.contacts.mu.tolist(), nan_ok=True)


def test_info_for_a_person_and_for_a_program(run):
    run("make", "wall", 10, 10, "--mu", "0.6", "--out", "w.json")
    status, out, err = run("info", "w.json")
    assert (status, err) == (0, "")
    assert "106 (1 fixed, 105 free)" in out
    assert "285 given" in out
    status, out, _ = run("info", "w.json", "--json", "-")
    data = json.loads(out)
    assert (data["blocks"], data["fixed"], data["contacts"]["count"], data["groups"]) == (106, 1, 285, 11)
    assert data["contacts"]["mu"] == [0.6, 0.6]
    assert data["faults"] == []
    assert data["without_density"] == 106


def test_info_tells_of_faults(run):
    run("make", "stack", 1, "--out", "m.json")
    with open("m.json") as file:
        model = json.load(file)
    del model["blocks"][1]["faces"][1:]
    del model["contacts"]
    with open("m.json", "w") as file:
        json.dump(model, file)
    status, out, _ = run("info", "m.json")
    assert status == 0
    assert "FAULT     block 'b01' is a sheet" in out
    assert "they will be detected" in out
    assert "assumes   density 2400" in out
    assert run("check", "m.json")[0] == 2


def test_convert_keeps_how_a_wall_was_drawn_or_says_that_it_is_lost(run):
    run("make", "polygonal", "--columns", "3", "--rows", "2", "--out", "w.json")
    status, _, err = run("convert", "w.json", "again.json")
    assert (status, err) == (0, "")
    assert json.loads(Path("again.json").read_text()) == json.loads(Path("w.json").read_text())

    status, _, err = run("convert", "w.json", "w.glb")
    assert status == 0
    assert "GLB does not hold how the wall was drawn" in err

    document = json.loads(Path("w.json").read_text())
    document["blocks"][1]["vertices"][0][0] += 0.01
    Path("stale.json").write_text(json.dumps(document))
    status, _, err = run("convert", "stale.json", "out.json")
    assert status == 0
    assert "its drawing is stale" in err
    assert "drawing" not in json.loads(Path("out.json").read_text())


def test_convert_keeps_the_stone(run):
    run("make", "arch", 9, "--out", "a.json")
    status, out, _ = run("convert", "a.json", "a.obj")
    assert status == 0
    assert "a.obj" in out
    model, _ = read_model("a.obj")
    assert model.mass.volume.sum() == pytest.approx(design.arch(9).mass.volume.sum(), rel=1e-9)
    status, _, err = run("convert", "a.json", "./a.json")
    assert status == 2
    assert "input" in err
    status, _, err = run("convert", "a.json", "a.xyz")
    assert status == 2
    assert "a.xyz" in err
    assert sorted(os.listdir()) == ["a.json", "a.obj"]


def test_every_mesh_format_can_be_written(run):
    assert MESHES == MESH_SUFFIXES
    run("make", "stack", 2, "--out", "m.json")
    for ending in MESHES:
        status, _, err = run("convert", "m.json", f"m{ending}")
        assert status == 0
        assert err.count("\n") == (0 if ending == ".glb" else 1)
        assert run("info", f"m{ending}", "--units", "m")[0] == 0


POLYGONAL = [
    ([], {}, {}),
    (["--width", "2", "--height", "1.5", "--columns", "5", "--rows", "4", "--seed", "3", "--jitter", "0.2",
      "--lloyd", "1", "--coursing", "0.7", "--courses", "4", "--size-grade", "0.2", "--sliver", "0.1", "--depth", "0.3",
      "--batter", "0.05", "--mu", "0.6", "--density", "2000"],
     {"width": 2.0, "height": 1.5, "columns": 5, "rows": 4, "seed": 3, "jitter": 0.2, "lloyd": 1, "coursing": 0.7,
      "courses": 4, "size_grade": 0.2, "sliver": 0.1},
     {"depth": 0.3, "batter": 0.05, "mu": 0.6, "density": 2000.0}),
    (["--opening", "0.6,0.5,0.5,0.6", "--opening", "1.9,0,0.6,1.2,arch", "--surface", "cylinder:-5",
      "--coping", "0.1,0.4"],
     {"openings": (Opening(0.6, 0.5, 0.6, 0.5), Opening(1.9, 0.6, 1.2, 0.0, "arch")), "coping": Coping(0.1, 0.4)},
     {"surface": Cylinder(-5.0, 1.5)}),
    (["--quoins", "0.6,0.3", "--base", "0:0,1.5:0.2,3:0", "--surface", "cone:4,5", "--warped", "triangles"],
     {"quoins": Quoins(0.6, 0.3), "base": ((0, 0), (1.5, 0.2), (3, 0))},
     {"surface": Cone(4.0, 5.0, 1.5), "warped": "triangles"}),
    (["--quoins", "auto", "--coping", "auto", "--base", "radius:6", "--surface", "sphere:7"],
     {"quoins": Quoins(), "coping": Coping(), "base_radius": 6.0}, {"surface": Sphere(7.0, 0.0, 1.5)}),
]  # fmt: skip


@pytest.mark.parametrize(("argv", "pattern", "options"), POLYGONAL)
def test_every_option_of_a_polygonal_wall_reaches_it(run, argv, pattern, options):
    status, out, err = run("make", "polygonal", *argv, "--out", "m.json")
    assert (status, err) == (0, "")
    wanted = polygonal_wall(PatternSettings(**pattern), **options)
    readout = wanted.pattern.readout
    said = dict(line.split(maxsplit=1) for line in out.splitlines()[1:])
    assert (int(said["cells"]), int(said["culled"]), int(said["crossings"])) == (
        readout.cells, readout.culled, readout.crossings)  # fmt: skip
    assert float(said["coverage"]) == pytest.approx(1.0, abs=1e-9)
    assert float(said["J"].split()[0]) == pytest.approx(interlock(wanted.pattern).score, abs=1e-3)
    assert said["written"] == "m.json"
    model, warnings = read_model("m.json")
    assert warnings == ()
    assert [(b.id, b.fixed, b.group, b.density, b.faces) for b in model.blocks] == [
        (b.id, b.fixed, b.group, b.density, b.faces) for b in wanted.assembly.blocks
    ]
    assert model.mesh.vertex.tolist() == wanted.assembly.mesh.vertex.tolist()
    assert model.contacts.point.tolist() == wanted.assembly.contacts.point.tolist()
    assert model.contacts.mu.tolist() == pytest.approx(wanted.assembly.contacts.mu.tolist(), nan_ok=True)


def test_a_twisted_wall_and_its_stones_with_open_joints(run):
    status, out, _ = run(
        "make", "polygonal", "--surface", "twist:12", "--out", "m.json", "--display", "d.json", "--chamfer", "0.01"
    )
    assert status == 0
    assert "of a plane" in out
    wall, apart = read_model("m.json")[0], read_model("d.json")[0]
    assert [b.id for b in apart.blocks] == [b.id for b in wall.blocks[1:]]
    assert len(apart.contacts) == 0
    assert (apart.mass.volume < wall.mass.volume[1:]).all()
    top = max(wall.blocks, key=lambda b: b.vertices[:, 2].max()).vertices
    assert abs(top[:, 1]).max() > 0.1


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["--width", "0"], "width"),
        (["--columns", "-3"], "columns"),
        (["--columns", "100000"], "ask for fewer"),
        (["--depth", "0"], "depth"),
        (["--coursing", "1.2"], "coursing"),
        (["--sliver", "1"], "sliver"),
        (["--opening", "5,0,1,1"], "outside the wall"),
        (["--opening", "1,0,1"], "--opening: '1,0,1' should be"),
        (["--opening", "1,0,1,1,vault"], "--opening"),
        (["--surface", "ball:3"], "--surface"),
        (["--surface", "cylinder"], "--surface: cylinder takes one number"),
        (["--surface", "plane:1"], "--surface: plane takes no number"),
        (["--surface", "cone:1,2,3"], "--surface: cone takes one or two numbers"),
        (["--surface", "twist:90"], "--surface: a twist of 90"),
        (["--surface", "cylinder:0"], "cylinder radius"),
        (["--surface", "cylinder:0.15", "--width", "0.4", "--columns", "3"], "bends with a radius of 0.15 m"),
        (["--surface", "cylinder:0.4"], "closes on itself"),
        (["--batter", "0.2"], "batter"),
        (["--quoins", "1"], "--quoins: '1' should be LONG,SHORT"),
        (["--coping", "x"], "--coping"),
        (["--base", "1,2"], "--base: '1,2' should be"),
        (["--base", "0:1,x:2"], "--base"),
        (["--warped", "flat"], "--warped"),
        (["--display", "d.json", "--gap", "1"], "gap"),
        (["--display", "w.json"], "the same file"),
    ],
)
def test_a_polygonal_wall_that_cannot_be_made(run, argv, says):
    status, out, err = run("make", "polygonal", *argv, "--out", "w.json")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert says in err
    assert os.listdir() == []


@nightly  # each run of continuous integration does the demo by itself
def test_demo_draws_a_wall_finds_it_stones_and_proves_it(run):
    status, out, err = run("demo")
    assert status == 0
    assert out.count("stable, certificate verified") == 2
    assert all("do not touch once carved" in line for line in err.splitlines())
    assert set(os.listdir("demo")) == {*FILES, "report.html"}
    for name in ("", "carved."):
        assert run("verify", f"demo/{name}certificate.json")[0] == 0
        with open(f"demo/{name}result.json") as file:
            data = json.load(file)
        assert (data["method"], data["verdict"]) == ("cra", "stable")
    with open("demo/match.json") as file:
        placed = json.load(file)["placements"]
    with open("demo/cutlist.csv") as file:
        assert len(file.read().splitlines()) == len(placed) + 1
    with open("demo/sequence.json") as file:
        steps = json.load(file)["steps"]
    assert len(steps) == len(placed)
    assert all("stable" in (step["verdict"], step["with_props"]) for step in steps)
    with open("demo/report.html") as page:
        source = page.read()
    links = {part.split('"')[0] for part in source.split('href="')[1:]}
    assert {link for link in links if not link.startswith("#")} == set(FILES)
    assert run("carve", "demo", "--out", "demo", "--method", "rbe")[0] == 0  # the folder is a match like any other
    os.mkdir("here")
    with open("file", "w"):
        pass
    assert run("demo", "--out", "file")[0] == 2
    assert run("demo", "--out", "nowhere")[0] == 2


def test_info_detects_contacts_and_names_outliers(run):
    """Most bricks are equal, so the quartiles coincide: the slab and the two half bricks lie beyond Tukey's fence."""
    run("make", "wall", 3, 3, "--out", "w.json")
    run("convert", "w.json", "w.obj")
    status, out, _ = run("info", "w.obj", "--units", "m", "--json", "-")
    data = json.loads(out)
    assert status == 0
    assert (data["contacts"]["count"], data["contacts"]["detected"]) == (22, True)
    assert data["assumed"] == {"mu": 0.84, "density": 2400.0, "supports": "lowest"}
    assert data["supports"] == "lowest"
    assert data["outliers"] == ["ground", "c02-b01", "c02-b04"]
    assert data["volume"]["quartiles"][1] == pytest.approx(0.4 * 0.2 * 0.2)


def test_improve_raises_the_interlock_score(run):
    scores = []
    for more in ((), ("--improve", "J")):
        status, out, _ = run("make", "polygonal", "--columns", 5, "--rows", 4, "--out", "wall.json", *more)
        assert status == 0
        scores.append(float(out.split("\nJ ")[1].split()[0]))
    assert scores[0] >= 0.75
    assert scores[1] >= max(0.9, scores[0])
    assert run("check", "wall.json", "--no-margins")[0] == 0
    status, _, err = run("make", "polygonal", "--out", "other.json", "--improve", "K")
    assert (status, err) == (2, "cyclopean: error: --improve K: expected J, or the score to be reached, up to 1\n")


def test_a_wall_is_drawn_where_that_is_asked_for(run):
    """One ring a stone, and of two walls at a corner one a stone a face."""
    assert run("make", "polygonal", "--columns", 4, "--rows", 3, "--out", "a.json", "--svg", "a.svg")[0] == 0
    assert (
        run("make", "polygonal", "--columns", 4, "--rows", 3, "--corner", 1.5, "--out", "b.json", "--svg", "b.svg")[0]
        == 0
    )
    stones = {name: len(read_model(f"{name}.json")[0].blocks) - 1 for name in "ab"}
    rings = {name: Path(f"{name}.svg").read_text().count('Z" fill="#') for name in "ab"}
    assert rings["a"] == stones["a"]
    assert rings["b"] > stones["b"]  # the quoins show two faces
    assert run("make", "polygonal", "--out", "a.json", "--svg", "a.json")[0] == 2
