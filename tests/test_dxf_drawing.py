"""Drawings as files: named layers, 1:1 in millimetres as SVG and as DXF; by hand, there and back, and refused."""

import re
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from cyclopean.cli.app import Program
from cyclopean.design.walls.interlock import interlock
from cyclopean.design.walls.line_work import LineReading, pattern_of
from cyclopean.design.walls.pattern import PatternSettings, draw_pattern
from cyclopean.errors import InputError
from cyclopean.io import dxf_text, read_line_work
from cyclopean.view.curves import curves_svg
from cyclopean.view.svg import closed, layer, scale_bar, sheet, text, to_scale, true_size
from cyclopean.view.wall_drawing import wall_svg

ezdxf = pytest.importorskip("ezdxf", reason="the extra `dxf` is not installed")

ASHLAR = ("--stone", "0.6x0.3x0.2*4", "--width", 1.2, "--height", 0.6, "--depth", 0.2, "--out", "wall.json")
STANDING, BACK, FRONT = np.array([[0, 0], [200, 0], [200, 200], [0, 200]]), [100, 0], [300, 50]


def opened(place, text=None):
    """A DXF file without a fault that ezdxf finds; `text` is written to it first."""
    if text is not None:
        place.write_text(text)
    made = ezdxf.readfile(place)
    audit = made.audit()
    assert (audit.errors, audit.fixes) == ([], [])
    assert made.header["$INSUNITS"] == 4
    return made.modelspace()


def outlines(space, name):
    """Corners (k, 2) of the closed lines on a layer, in mm."""
    found = space.query(f'LWPOLYLINE[layer=="{name}"]')
    assert all(one.closed for one in found)
    return [np.array(one.get_points("xy")) for one in found]


def sizes(rings):
    return sorted(tuple(np.ptp(ring, axis=0).round(3).tolist()) for ring in rings)


def area(ring):
    x, y = ring.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def of_sheet(parts, scale=200.0, foot=(0.0, 400.0)):
    return sheet((1000.0, 400.0), "by hand", parts, letters=10.0, more=to_scale(scale, foot))


def painted(corner, colour="#aabbcc", stroke="#111111"):
    return f'<path d="{closed(STANDING + corner)}" fill="{colour}" stroke="{stroke}"/>'


def test_a_stone_of_600_by_300_is_that_in_both_files(run, tmp_path):
    """Four stones of 600 x 300 mm in 1.2 x 0.6 m of running bond: three whole in the face, two halves."""
    status, out, err = run("ashlar", *ASHLAR, "--svg", "wall.svg", "--dxf", "wall.dxf")
    assert (status, err) == (0, "")
    assert out.splitlines()[-1] == "  written  wall.json, wall.svg, wall.dxf"
    face = [ring for ring in outlines(opened(tmp_path / "wall.dxf"), "stones") if ring[:, 1].min() >= 0.0]
    assert sizes(face) == [(300.0, 300.0)] * 2 + [(600.0, 300.0)] * 3
    assert np.concatenate(face).min(axis=0).tolist() == [0.0, 0.0]  # the foot of the wall
    assert np.concatenate(face).max(axis=0).tolist() == [1200.0, 600.0]
    assert sizes_of_svg((tmp_path / "wall.svg").read_text()) == sizes(face)
    damaged = re.sub(r'width="[\d.]+mm"', 'width="1234mm"', (tmp_path / "wall.svg").read_text())
    assert sizes_of_svg(damaged) != sizes(face)


def sizes_of_svg(text):
    """Sizes (mm) of the rectangles on the first layer of stones."""
    root = ElementTree.fromstring(text)
    wide = float(root.get("width").removesuffix("mm"))
    box = [float(x) for x in root.get("viewBox").split()]
    stones = next(one for one in root if one.get("{http://www.inkscape.org/namespaces/inkscape}label") == "stones")
    size = [[float(one.get(name)) * wide / box[2] for name in ("width", "height")] for one in stones]
    return sorted(tuple(np.round(one, 3).tolist()) for one in size)


@settings(max_examples=4)
@given(seed=st.integers(0, 10**6), width=st.floats(0.5, 40.0), shape=st.floats(0.3, 1.5))
def test_there_and_back_the_face_is_the_same(tmp_path_factory, seed, width, shape):
    drawn = draw_pattern(PatternSettings(width=width, height=shape * width, columns=5, rows=4, seed=seed))
    svg, place = wall_svg(drawn, interlock(drawn), "there"), tmp_path_factory.mktemp("back")
    for name, content in (("a.dxf", dxf_text(svg)), ("a.svg", true_size(svg))):
        (place / name).write_text(content)
        reading = LineReading(layer=("stones",))
        back = pattern_of(read_line_work(place / name, reading), reading.snap)
        each = [np.sort(pattern.subdivision.areas()) for pattern in (drawn, back)]
        rounding = 1e-6 * drawn.subdivision.perimeters().max()  # corners are written to a thousandth of a millimetre
        np.testing.assert_allclose(each[1], each[0], atol=rounding, rtol=0.0)
    wrong = re.sub(r'per-metre="[^"]+"', f'per-metre="{1001.0 * 952.0 / width / 1000.0}"', svg)
    (place / "b.dxf").write_text(dxf_text(wrong))  # a thousandth too small
    back = pattern_of(read_line_work(place / "b.dxf", reading), reading.snap)
    assert back.subdivision.areas().sum() == pytest.approx(width**2 * shape / 1.001**2, rel=1e-5)


def test_a_drawn_wall_is_drawn_again_from_its_own_file(run):
    status, *_ = run("make", "polygonal", "--seed", 3, "--columns", 4, "--rows", 3, "--out", "a.json", "--dxf", "a.dxf")
    assert status == 0
    status, *_ = run("make", "polygonal", "--drawing", "a.dxf", "--layer", "stones", "--out", "b.json")
    assert status == 0
    one, other = (cyclopean.read_model(name)[0] for name in ("a.json", "b.json"))
    assert len(one) == len(other)
    each = [np.sort(wall.mass.volume[1:]) for wall in (one, other)]
    np.testing.assert_allclose(each[1], each[0], atol=1e-6)


def test_what_is_hidden_is_cut_away(tmp_path):
    """Squares of 1 m: half of the one behind is seen, one below it is not, and 0.75 m of a line of 1.5 m."""
    line = '<path d="M50 100L350 100" fill="none" stroke="#222222"/>'
    parts = [line, painted(BACK), painted(BACK), painted([200, 0])]
    space = opened(tmp_path / "a.dxf", dxf_text(of_sheet([layer("stones", parts, solid=True)])))
    assert sorted(area(ring) for ring in outlines(space, "stones")) == pytest.approx([0.5e6, 1e6])
    (seen,) = space.query("LINE")
    assert seen.dxf.start.distance(seen.dxf.end) == pytest.approx(250.0, abs=0.3)  # from 50 to 100 of 200 a metre
    flat = opened(tmp_path / "b.dxf", dxf_text(of_sheet([layer("stones", parts)])))
    assert len(flat) == 3  # not solid: all of it, and what is painted twice once


@settings(max_examples=10)
@given(st.lists(st.tuples(st.integers(0, 700), st.integers(0, 180)), min_size=1, max_size=7, unique=True))
def test_what_is_seen_covers_what_was_painted_once(tmp_path_factory, corners):
    """Of squares painted over each other every place is seen of one: what is seen adds up to what all cover."""
    space = opened(
        tmp_path_factory.mktemp("seen") / "a.dxf",
        dxf_text(of_sheet([layer("stones", [painted(np.array(one)) for one in corners], solid=True)])),
    )
    cover = np.zeros((400, 1000), bool)
    for x, y in corners:
        cover[y : y + 200, x : x + 200] = True
    twice = np.zeros_like(cover, dtype=int)
    x, y = np.meshgrid(np.arange(1000) + 0.5, np.arange(400) + 0.5)
    for ring in outlines(space, "stones"):
        twice += inside(ring / 5.0 * [1.0, -1.0] + [0.0, 400.0], x, y)
    assert np.array_equal(twice % 2 == 1, cover)  # a hole is a ring within a ring
    assert np.all(twice[~cover] % 2 == 0)


def inside(ring, x, y):
    """Whether points lie within a ring (k, 2), by the even-odd rule."""
    found = np.zeros(x.shape, bool)
    for (ax, ay), (bx, by) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        if ay != by:
            found ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) / (by - ay) * (bx - ax))
    return found


def test_words_circles_dashes_and_colours(tmp_path):
    words = text(0.0, 0.0, "1 m &amp; more", 'text-anchor="middle"')
    turned = f'<g transform="translate(200 200) rotate(-90)">{words}</g>'
    dashed = '<path d="M0 400H200" fill="none" stroke="#8a8f94" stroke-dasharray="6 4"/>'
    parts = [
        layer("text", [turned]),
        layer("forces", ['<circle cx="100" cy="300" r="10" fill="#083f88" stroke="#fff"/>']),
        layer("at-rest", [dashed]),
        scale_bar(0.0, 300.0, 200.0, 250.0),
    ]
    space = opened(tmp_path / "a.dxf", dxf_text(of_sheet(parts)))
    (said,) = space.query('TEXT[layer=="text"]')
    assert (said.dxf.text, said.dxf.rotation) == ("1 m & more", 90.0)
    assert (said.dxf.align_point.x, said.dxf.align_point.y) == (1000.0, 1000.0)
    assert said.dxf.height == pytest.approx(0.72 * 10.0 * 5.0)
    (circle,) = space.query("CIRCLE")
    assert (tuple(circle.dxf.center), circle.dxf.radius) == ((500.0, 500.0, 0.0), 50.0)
    assert space.doc.layers.get("forces").rgb == (0x08, 0x3F, 0x88)
    (line,) = space.query('LINE[layer=="at-rest"]')
    pattern = space.doc.linetypes.get(line.dxf.linetype).pattern_tags.tags
    assert [tag.value for tag in pattern if tag.code == 49] == [30.0, -20.0]  # mm
    bar = max((one.dxf.end - one.dxf.start).magnitude for one in space.query('LINE[layer=="scale"]'))
    assert bar == 1000.0
    assert not space.query('*[layer=="paper"]')


def test_the_same_drawing_gives_the_same_bits():
    drawn = of_sheet([layer("stones", [painted(BACK)], solid=True)])
    before = ezdxf.options.write_fixed_meta_data_for_testing
    assert dxf_text(drawn) == dxf_text(drawn)
    assert ezdxf.options.write_fixed_meta_data_for_testing == before


def test_layers_have_names_of_their_own_in_files_only():
    twice = of_sheet([layer("front", [layer("stones", ["a"])]), layer("back", [layer("stones", ["b"])])])
    assert " id=" not in twice  # two drawings may stand in one page
    assert " width=" not in twice.partition(">")[0]
    assert re.findall(r'<g id="([^"]+)"', true_size(twice)) == ["paper", "front", "stones", "back", "stones-2"]
    chart = curves_svg("a chart", range(2), ["one", "two"], {"J": [0.1, 0.2]})
    assert true_size(chart) == chart
    with pytest.raises(InputError, match="not to scale"):
        dxf_text(chart)


def test_drawings_have_both_options():
    taken = {name: {word for one in made.params for word in one.opts} for name, made in walk(Program(name="cyclopean"))}
    drawing = {name for name, options in taken.items() if "--svg" in options}
    assert drawing == {"ashlar", "check", "limit", "match", "pack", "polygonal", "sequence", "settle"}
    assert drawing | {"carve"} == {name for name, options in taken.items() if "--dxf" in options}


def walk(group):
    """Every command by its name, those of groups too."""
    for name, one in group.commands.items():
        yield from walk(one) if hasattr(one, "commands") else [(name, one)]


def test_refusals_write_nothing(run, tmp_path, monkeypatch):
    status, _, err = run("ashlar", *ASHLAR, "--svg", "a.svg", "--dxf", "a.svg")
    assert (status, err) == (2, "cyclopean: error: --dxf a.svg: --svg writes to the same file\n")
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    status, _, err = run("ashlar", *ASHLAR, "--dxf", "a.dxf")
    assert (status, err) == (2, "cyclopean: error: --dxf: DXF files need ezdxf: pip install 'cyclopean[dxf]'\n")
    assert list(tmp_path.iterdir()) == []


def test_a_check_and_a_sequence_draw_themselves(run, tmp_path):
    assert run("make", "arch", 5, "--span", 2, "--out", "arch.json")[0] == 0
    status, _, err = run("check", "arch.json", "--dxf", "arch.json")
    assert (status, err) == (2, "cyclopean: error: --dxf arch.json: this is the input file; choose another name\n")
    assert run("check", "arch.json", "--svg", "c.svg", "--dxf", "c.dxf")[0] == 0
    found = opened(tmp_path / "c.dxf")
    assert {"stones", "supports", "thrust", "forces", "gravity", "scale"} <= {one.dxf.layer for one in found}
    assert len(outlines(found, "stones")) == 5
    assert run("sequence", "arch.json", "--out", "s.json", "--dxf", "s.dxf")[0] == 0
    numbers = opened(tmp_path / "s.dxf").query('TEXT[layer=="numbers"]')
    assert sorted(one.dxf.text for one in numbers) == list("12345")


def test_python_saves_what_has_a_drawing(tmp_path):
    wall, arch = cyclopean.polygonal_wall(columns=3, rows=2), cyclopean.arch(5, span=2.0)
    for k, thing in enumerate((wall, cyclopean.check(arch), cyclopean.limit(arch, push=(1.0, 0.0, 0.0)))):
        cyclopean.save(thing, tmp_path / f"{k}.svg")
        cyclopean.save(thing, tmp_path / f"{k}.dxf")
        assert len(outlines(opened(tmp_path / f"{k}.dxf"), "stones")) == (6, 5, 5)[k]
    with pytest.raises(InputError, match=r"a .* is written as"):
        cyclopean.save(arch, tmp_path / "arch.dxf")
