"""Drawings: a wall is drawn again from its file to the last bit, a stale drawing is told, and every fault has its line.

By hand: the drawing of the default wall holds 40 seeds, and its surface is {"kind": "plane"}.
"""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.assembly import Assembly, Load
from cyclopean.design.walls.dressing import Coping, Quoins
from cyclopean.design.walls.improve import improve_interlock
from cyclopean.design.walls.joints import Masonry
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import laid_wall, polygonal_wall
from cyclopean.design.walls.surfaces import Cone, Cylinder, Free, HeightGrid, Plane, Ruled, Sphere, Thickness, Twist
from cyclopean.errors import InputError
from cyclopean.io import drawing_dict, read_drawing, read_model, write_model
from cyclopean.io.drawings import wall_of
from laws import examples

SMALL = {"columns": 5, "rows": 3, "courses": 3, "width": 2.0, "height": 1.2}
WALLS = {
    "default": lambda: polygonal_wall(),
    "openings": lambda: polygonal_wall(
        PatternSettings(openings=(Opening(0.6, 0.4, 0.6, head="arch"), Opening(1.7, 0.5, 0.5, 0.5))), mu=0.7
    ),
    "dressed": lambda: polygonal_wall(
        PatternSettings(quoins=Quoins(0.5, 0.3, right=False), coping=Coping()), batter=0.05, density=2600.0
    ),
    "hill": lambda: polygonal_wall(PatternSettings(base=lambda u: 0.1 * np.sin(u) ** 2), surface=Cylinder(4.0, 1.5)),
    "points": lambda: polygonal_wall(PatternSettings(base=((0, 0), (1.5, 0.2), (3, 0.1))), surface=Cylinder(-4.0, 1.5)),
    "round": lambda: polygonal_wall(PatternSettings(base_radius=6.0), surface=Sphere(7.0, 5.0, 1.5), depth=0.3),
    "cone": lambda: polygonal_wall(PatternSettings(**SMALL), surface=Cone(4.0, 5.0, 1.0), warped="triangles"),
    "twist": lambda: polygonal_wall(PatternSettings(**SMALL), surface=Twist(12.0, 2.0, 1.2), warped="plane"),
    "rough": lambda: polygonal_wall(
        PatternSettings(**SMALL), surface=HeightGrid(0.02 * np.random.default_rng(0).random((3, 4)), 2.0, 1.2)
    ),
}  # fmt: skip


def rows(assembly):
    """All that a file says of the blocks and contacts, to the bit."""
    joints = assembly.contacts
    return (
        [(b.id, b.vertices.tolist(), b.faces, b.density, b.fixed, b.group) for b in assembly.blocks],
        [joints.a.tolist(), joints.b.tolist(), joints.point.tolist(), joints.mu[~np.isnan(joints.mu)].tolist()],
    )


@pytest.fixture
def path(tmp_path):
    return tmp_path / "wall.json"


@pytest.mark.parametrize("name", WALLS)
def test_a_wall_is_drawn_again_to_the_bit(name, path):
    wall = WALLS[name]()
    write_model(path, wall.assembly, drawing=drawing_dict(wall))
    model, warnings = read_model(path)
    assert warnings == ()
    again, warnings = read_drawing(path)
    assert warnings == ()
    assert rows(again.assembly) == rows(wall.assembly) == rows(model)
    assert type(again.surface) is type(wall.surface)
    assert (again.thickness, again.masonry) == (wall.thickness, wall.masonry)
    assert drawing_dict(again) == drawing_dict(wall)


def test_the_drawing_by_hand():
    drawing = drawing_dict(polygonal_wall())
    assert drawing["surface"] == {"kind": "plane"}
    assert (len(drawing["seeds"]["point"]), len(drawing["seeds"]["weight"])) == (40, 40)
    assert (drawing["depth"], drawing["batter"], drawing["mu"], drawing["warped"]) == (0.2, 0.0, None, "auto")
    assert drawing["settings"]["coursing"] == 0.4
    assert drawing["settings"]["openings"] == []
    assert json.loads(json.dumps(drawing)) == drawing


def test_improved_seeds_are_kept():
    pattern = improve_interlock(PatternSettings(**SMALL, coursing=0.9), rounds=20)
    wall = laid_wall(pattern, Plane(), Thickness(), Masonry())
    assert rows(wall_of(drawing_dict(wall)).assembly) == rows(wall.assembly)


@settings(max_examples=examples(15))
@given(seed=st.integers(0, 999), coursing=st.floats(0.0, 1.0), depth=st.floats(0.05, 0.5))
def test_any_wall_survives_its_text(seed, coursing, depth):
    wall = polygonal_wall(PatternSettings(**SMALL, seed=seed, coursing=coursing), depth=depth)
    assert rows(wall_of(json.loads(json.dumps(drawing_dict(wall)))).assembly) == rows(wall.assembly)


@pytest.mark.parametrize(
    "surface",
    [
        Free(lambda u, v: (u, 0.1 * np.sin(2 * u + v), v), 2.0, 1.2),
        Ruled(lambda u: (u, 0.0, 0.0), lambda u: (u, 0.1 * u, 1.2), 2.0, 1.2),
    ],
)
def test_a_surface_of_functions_has_no_drawing(surface):
    assert drawing_dict(polygonal_wall(PatternSettings(**SMALL), surface=surface)) is None


def test_a_file_without_drawing(path):
    write_model(path, polygonal_wall(PatternSettings(**SMALL)).assembly)
    assert read_drawing(path) == (None, ())
    assert read_drawing("stones.stl") == (None, ())


def edited(path, change):
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    return read_drawing(path)


def moved(by):
    def change(data):
        data["blocks"][3]["vertices"][0][0] += by

    return change


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (moved(1e-6), "block 'c01-b03' has other corners"),
        (lambda data: (data["blocks"].pop(), data.update(contacts=None)), "it has 15 blocks, and the drawing makes 16"),
        (lambda data: data["blocks"][2].update(density=2000.0), "density or support"),
        (lambda data: data["contacts"][0].update(mu=0.1), "its contacts are not as drawn"),
        (lambda data: data["drawing"]["seeds"]["weight"].__setitem__(0, 0.9), "other corners than drawn"),
    ],
)
def test_a_stale_drawing_is_told_and_not_used(path, change, says):
    wall = polygonal_wall(PatternSettings(**SMALL, seed=3))
    write_model(path, wall.assembly, drawing=drawing_dict(wall))
    assert edited(path, moved(1e-12))[0] is not None  # a rounding is no edit
    found, warnings = edited(path, change)
    assert found is None
    assert len(warnings) == 1
    assert "its drawing is stale: " in warnings[0]
    assert says in warnings[0]


def test_units_of_the_model_are_not_those_of_the_drawing(path):
    wall = polygonal_wall(PatternSettings(**SMALL))
    write_model(path, wall.assembly, drawing=drawing_dict(wall))

    def in_millimetres(data):
        data["units"] = "mm"
        for block in data["blocks"]:
            block["vertices"] = (1000.0 * np.array(block["vertices"])).tolist()
        for contact in data["contacts"]:
            contact["polygon"] = (1000.0 * np.array(contact["polygon"])).tolist()

    again, warnings = edited(path, in_millimetres)
    assert warnings == ()
    assert rows(again.assembly) == rows(wall.assembly)


def test_loads_are_warned_of(path):
    wall = polygonal_wall(PatternSettings(**SMALL))
    loaded = Assembly(wall.assembly.blocks, wall.assembly.contacts, (Load(1, [0, 0, -1.0], [0, 0, 1.0]),))
    write_model(path, loaded, drawing=drawing_dict(wall))
    again, warnings = read_drawing(path)
    assert again is not None
    assert "no loads" in warnings[0]


@pytest.mark.parametrize(
    ("steps", "value", "says"),
    [
        (("schema",), "cyclopean.drawing/2", "drawing: its schema is the text 'cyclopean.drawing/2'"),
        (("colour",), "red", "drawing: unknown key 'colour'"),
        (("warped",), "flat", "warped: expected auto"),
        (("depth",), 0.0, "drawing: depth"),
        (("density",), -1.0, "density -1"),
        (("mu",), "x", "drawing: mu is not a finite number"),
        (("settings",), 3, "settings must be an object"),
        (("settings", "coursing"), 1.5, "settings: coursing"),
        (("settings", "rows"), "x", "settings"),
        (("settings", "courses"), 10**9, "courses = 1000000000 is more than 50,000"),
        (("settings", "lines"), 1, "settings: unknown key 'lines'"),
        (("settings", "openings"), [{"left": 1.0}], "openings[0]: needs numbers for left, width"),
        (("settings", "openings"), [{"left": 9.0, "width": 1.0, "height": 1.0}], "outside the wall"),
        (("settings", "base"), [[0, 1, 2]], "base[0] must hold 2 numbers"),
        (("seeds",), {}, "seeds: point must be a list"),
        (("seeds", "weight"), [1.0], "15 points but 1 weights"),
        (("seeds", "point"), [], "0 of them"),
        (("surface", "kind"), "ball", "kind: expected cone, cylinder"),
        (("surface",), {"kind": "cylinder"}, "surface: needs numbers for radius, middle"),
        (("surface",), {"kind": "cylinder", "radius": 0.0}, "surface: cylinder radius"),
        (("surface",), {"kind": "cylinder", "radius": 0.15}, "drawing: surface: "),
        (("surface",), {"kind": "heights", "relief": [[0, 1], [0]], "width": 1, "height": 1}, "relief[1] must hold 2"),
    ],
)  # fmt: skip
def test_a_drawing_that_is_none(steps, value, says):
    drawing = drawing_dict(polygonal_wall(PatternSettings(**SMALL)))
    inner = drawing
    for step in steps[:-1]:
        inner = inner[step]
    inner[steps[-1]] = value
    with pytest.raises(InputError, match=r"^drawing") as error:
        wall_of(drawing)
    assert says in str(error.value)
    assert "\n" not in str(error.value)
