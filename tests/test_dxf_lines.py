"""Drawings of joints as ezdxf writes them: every kind of line, inserts, hidden layers, planes and units; by hand."""

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

import cyclopean
from cyclopean.design.walls.line_work import LineReading, pattern_of
from cyclopean.errors import InputError
from cyclopean.io import read_line_work

ezdxf = pytest.importorskip("ezdxf", reason="the extra `dxf` is not installed")

EXAMPLE = Path(__file__).parents[1] / "examples" / "wall_from_a_drawing.py"
SQUARE = [(0, 0), (2, 0), (2, 1), (0, 1)]


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def drawing(unit=6):
    made = ezdxf.new("R2010", units=unit)
    return made, made.modelspace()


def read(made, **reading):
    made.saveas("a.dxf")
    options = LineReading(**reading)
    return pattern_of(read_line_work("a.dxf", options), options.snap)


def areas(pattern):
    return sorted(pattern.subdivision.areas().round(9).tolist())


def half_discs(space):
    """The ways to draw half a disc of radius 0.5 below which there is nothing."""
    arc = math.pi * np.arange(0, 49) / 48.0
    return {
        "arc": lambda: space.add_arc((1, 0), 0.5, 0, 180),
        "downwards": lambda: space.add_arc((-1, 0), 0.5, 0, 180, dxfattribs={"extrusion": (0, 0, -1)}),
        "ellipse": lambda: space.add_ellipse((1, 0), (0.5, 0), 1.0, 0.0, math.pi),
        "bulge": lambda: space.add_lwpolyline([(1.5, 0, 1), (0.5, 0, 0)], format="xyb"),
        "clockwise": lambda: space.add_lwpolyline([(0.5, 0, -1), (1.5, 0, 0)], format="xyb"),
        "old": lambda: space.add_polyline2d([(1.5, 0, 1), (0.5, 0, 0)], format="xyb"),
        "spline": lambda: space.add_spline([(1 + 0.5 * math.cos(t), 0.5 * math.sin(t)) for t in arc]),
    }


@pytest.mark.parametrize("kind", ["arc", "downwards", "ellipse", "bulge", "clockwise", "old", "spline"])
def test_curves_by_hand(kind):
    """A bridge of two stones over half a disc: 2 - pi / 8 m2, whatever the half circle is drawn with."""
    made, space = drawing()
    space.add_lwpolyline([(0.5, 0), (0, 0), (0, 1), (2, 1), (2, 0), (1.5, 0)])
    space.add_line((1, 0.5), (1, 1))
    half_discs(space)[kind]()
    found = read(made, deviation=1e-4)
    assert areas(found) == pytest.approx([1.0 - math.pi / 16.0] * 2, abs=2e-4)
    assert "1 curved lines have facets within 0.1 mm of them" in found.notes[0]
    rough = read(made, deviation=2e-3)
    assert len(rough.subdivision.vertex) < len(found.subdivision.vertex) / 2


def test_an_arc_runs_counter_clockwise_from_its_start():
    """By hand, from 300 to 60 degrees: through 0, a third of a circle, 1 to 2 from the centre at (1, 0)."""
    made, space = drawing()
    space.add_arc((1, 0), 1.0, 300, 60)
    made.saveas("a.dxf")
    (line,) = read_line_work("a.dxf", LineReading()).lines
    assert line.point[[0, -1]] == pytest.approx(np.array([[1.5, -math.sqrt(0.75)], [1.5, math.sqrt(0.75)]]))
    assert (line.point[:, 0].min(), line.point[:, 0].max()) == (pytest.approx(1.5), pytest.approx(2.0, abs=2e-3))


def test_inserts_layers_planes_and_units():
    made, space = drawing(4)
    block = made.blocks.new("course")
    block.add_lwpolyline([(0, 0), (1000, 0), (1000, 500), (0, 500)], close=True)
    for k in range(4):
        space.add_blockref("course", (1000 * (k % 2), 500 * (k // 2)), dxfattribs={"layer": "stones"})
    made.layers.add("sketch").off()
    space.add_line((0, 0), (900, 900), dxfattribs={"layer": "sketch"})
    space.add_text("north face")
    found = read(made)
    assert areas(found) == [0.5] * 4
    assert found.notes == ("a.dxf: 1 hidden, 1 TEXT passed over; only lines and outlines are read",)
    space.add_line((0, 0), (400, 300), dxfattribs={"layer": "notes"})
    with pytest.raises(InputError, match=r"end freely at \(400, 300\) mm"):
        read(made)
    assert areas(read(made, layer=("Stones",))) == [0.5] * 4
    assert areas(read(made, layer=("stones",), scale=2.0)) == [2.0] * 4
    with pytest.raises(InputError, match="says that its units are mm"):
        read(made, units="m")


@pytest.mark.parametrize("turn", [lambda x, y: (x, 7, y), lambda x, y: (3, x, y), lambda x, y: (x, y, -2)])
def test_a_drawing_stands_in_any_plane_of_the_axes(turn):
    made, space = drawing()
    corners = [turn(x, y) for x, y in (*SQUARE, SQUARE[0])]
    space.add_polyline3d(corners)
    space.add_line(turn(1, 0), turn(1, 1))
    found = read(made)
    assert (areas(found), found.settings.width, found.settings.height) == ([1.0, 1.0], 2.0, 1.0)
    space.add_line((0, 0, 0), (5, 6, 7))
    with pytest.raises(InputError, match="lie in no plane of the axes"):
        read(made)


def test_what_cannot_be_used_is_one_line():
    made, space = drawing(3)
    space.add_lwpolyline(SQUARE, close=True)
    with pytest.raises(InputError, match="its unit is miles"):
        read(made)
    made.header["$INSUNITS"] = 0
    assert "does not say its units; metres assumed" in read(made).notes[0]
    assert read(made, units="ft").settings.width == pytest.approx(0.6096)
    made, space = drawing()
    with pytest.raises(InputError, match="holds no lines"):
        read(made)
    for content, says in ((b"", "the file is empty"), (b"hello\nworld\n", "is a damaged DXF file")):
        Path("bad.dxf").write_bytes(content)
        with pytest.raises(InputError, match=says) as refused:
            read_line_work("bad.dxf", LineReading())
        assert "tmp" not in str(refused.value)


def test_the_drawing_of_the_example():
    """The DXF has no fault that ezdxf finds; it and the SVG are the same wall, which stands."""
    spec = importlib.util.spec_from_file_location("wall_from_a_drawing", EXAMPLE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    example.write_dxf(Path("door.dxf"))
    example.write_svg(Path("door.svg"))
    audit = ezdxf.readfile("door.dxf").audit()
    assert (audit.errors, audit.fixes) == ([], [])
    walls = [cyclopean.polygonal_wall(drawing=f"door.{ending}", depth=0.4) for ending in ("dxf", "svg")]
    assert [len(wall.assembly) for wall in walls] == [48, 48]
    one, other = (areas(wall.pattern) for wall in walls)
    assert one == pytest.approx(other, abs=1e-6)
    hollow = [k for k in range(47) if not walls[0].pattern.subdivision.polygons()[k].convex_hull.area
              < walls[0].pattern.subdivision.areas()[k] * (1 + 1e-6)]  # fmt: skip
    assert len(hollow) >= 4  # hooked stones, and those that the ring bulges into
    curved = cyclopean.polygonal_wall(
        drawing="door.dxf", depth=0.3, surface=cyclopean.design.walls.surfaces.Cylinder(6.0, 1.6)
    )
    assert len(curved.assembly) == 48
