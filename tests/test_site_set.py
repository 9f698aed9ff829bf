"""The site set: what is measured on a sheet is true, what is read on it is there, and it can be printed.

By hand: a wall of 2.4 m by 0.8 m fits 1:20 on A4 (120 mm by 40 mm), not 1:10, for which 240 mm are 13 too many.
"""

import base64
import json
import re
import zlib
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from carving_cases import box, pebble, rotation, stone_like
from cyclopean.analysis import Settings
from cyclopean.api.site import SiteOptions, site_files, write_site
from cyclopean.api.site import site_set as site_set_of
from cyclopean.api.site_stock import stock_of
from cyclopean.api.stones import StoneCarving
from cyclopean.api.wall_options import opening
from cyclopean.design import arch, wall
from cyclopean.design.ashlar.wall import AshlarSettings, ashlar
from cyclopean.design.carving.carve import carve, total
from cyclopean.design.carving.carved_wall import carved_wall
from cyclopean.design.carving.marks import numbered_points, template_of
from cyclopean.design.construction.laying import laid_stones
from cyclopean.design.construction.sequence import build_sequence
from cyclopean.errors import InputError
from cyclopean.io.stocklist import repeated
from cyclopean.view.site.cuts import bent_faces, cut_stone
from cyclopean.view.site.elevation import elevation_pages
from cyclopean.view.site.paper import Form, Title, drawn, shortened, standard_scale, width, wrapped
from cyclopean.view.site.site_set import Layout, site_set

SVG = "{http://www.w3.org/2000/svg}"
SMALLEST = 2.2 / 0.72  # mm, letters whose capitals are 2.2 mm high
HALF = 0.0005 + 1e-9  # m: whole millimetres are true to half of one


@pytest.fixture(scope="module")
def built():
    return build_sequence(wall(6, 4), Settings(method="rbe"))


@pytest.fixture(scope="module")
def arched():
    return build_sequence(arch(7), Settings(method="rbe"))


@pytest.fixture(scope="module")
def carving():
    """A wall of four bricks and a half, each cut from a stone a tenth too large that stands askew."""
    drawn = wall(2, 2)
    fixed = np.array([bool(b.fixed) for b in drawn.blocks])
    stones = [stone_like(b, 1.1, f"stone {b.id}") for b in drawn.blocks if not b.fixed]
    cells = [b for b in drawn.blocks if not b.fixed]
    cut = tuple(carve(s, c, np.eye(3), [0.01, 0.005, -0.008]) for s, c in zip(stones, cells, strict=True))
    made = carved_wall(drawn, cut, fixed=fixed)
    return StoneCarving(cut, total(cut), drawn, fixed, made, (), tuple(stones))


def texts(drawing: str) -> list[str]:
    return ["".join(one.itertext()) for one in ElementTree.fromstring(drawing).iter(f"{SVG}text")]


def mesh(block) -> trimesh.Trimesh:
    """A block as another library sees it."""
    hull = trimesh.convex.convex_hull(block.vertices)
    return hull


def test_the_scale_is_the_largest_standard_one_that_fits():
    assert standard_scale((2.4, 0.8), (223.0, 128.0)) == 20
    assert standard_scale((2.23, 0.8), (223.0, 128.0)) == 10
    assert standard_scale((5000.0, 1.0), (223.0, 128.0)) is None


@pytest.mark.parametrize(("paper", "scale"), [("A4", 20), ("A3", 10)])
def test_an_elevation_measures_what_the_wall_does(built, paper, scale):
    page = elevation_pages(built, Form(paper)).pages[0]
    assert page.scale == f"1:{scale}"
    outlines = re.findall(r'<path d="([^"]+)" fill="#\w+" stroke', "".join(p for p in page.parts if "stones" in p[:25]))
    points = np.array([[float(x), float(y)] for path in outlines for x, y in re.findall(r"([\d.]+) ([\d.]+)", path)])
    assert np.ptp(points, axis=0) == pytest.approx([2400.0 / scale, 800.0 / scale], abs=0.003)
    said = texts(f'<svg xmlns="{SVG[1:-1]}">{"".join(page.parts)}</svg>')
    assert {"2.400 m", "800 mm", "+0.800 m", "datum 0.000"} <= set(said)
    assert {str(k) for k in range(1, 27)} <= set(said)  # every stone has its number


def test_another_scale_is_told(built):
    assert elevation_pages(built, Form("A4"), 50).notes == ()
    found = elevation_pages(built, Form("A4"), 10)
    assert found.notes == ("1:10 does not fit on A4; 1:20 on front elevation, back elevation, plan",)


def test_sheets_in_dxf_are_as_large_as_the_wall(built):
    ezdxf = pytest.importorskip("ezdxf")
    from io import StringIO

    from cyclopean import io

    page = elevation_pages(built, Form("A4")).pages[0]
    (drawing,) = drawn([page], Form("A4"), Title("Wall")).values()
    stones = [e for e in ezdxf.read(StringIO(io.dxf_text(drawing))).modelspace() if e.dxf.layer == "stones"]
    x = np.array([p[:2] for e in stones if e.dxftype() == "LWPOLYLINE" for p in e.get_points()])
    assert np.ptp(x, axis=0) == pytest.approx([2400.0, 800.0], abs=0.1)


def test_cards_say_what_another_library_measures(arched):
    sheets = site_set(arched, Layout(Form("A4"), Title("Arch"), 4)).sheets
    found = 0
    for stone in laid_stones(arched):
        block = arched.assembly.blocks[stone.block]
        solid = mesh(block)
        card = " ".join(texts(sheets[f"cards-{1 + (stone.step - 1) // 4}"]))
        size, middle = np.ptp(solid.vertices, axis=0), solid.center_mass - solid.bounds[0]
        told = re.findall(r"Mass ([\d,]+) kg\. (\d+) along, (\d+) deep, (\d+) high", card)[(stone.step - 1) % 4]
        assert float(told[0].replace(",", "")) == pytest.approx(2400.0 * solid.volume, abs=0.5)
        assert np.array(told[1:], float) == pytest.approx(1000.0 * size, abs=0.5001)
        sling = re.findall(r"gravity \(mm\): (\d+) from left end, (\d+) behind face, (\d+) above bed", card)
        assert np.array(sling[(stone.step - 1) % 4], float) == pytest.approx(1000.0 * middle, abs=0.5001)
        found += 1
    assert found == 7


def test_masses_add_up_and_props_are_told(arched):
    sheets = site_set(arched, Layout(Form("A4"), Title("Arch"))).sheets
    said = " ".join(texts(sheets["props-and-masses"]))
    free = [arched.assembly.blocks[step.block] for step in arched.steps]
    whole = 2400.0 * sum(mesh(block).volume for block in free)
    assert float(re.search(r"m³, ([\d,]+) kg", said)[1].replace(",", "")) == pytest.approx(whole, abs=0.5)
    assert sum(int(n) for n in re.findall(r"(\d+) stones of", said)) == len(free)
    for k, prop in enumerate(arched.props, 1):
        assert f"P{k}: {prop.kind}" in said
        assert f"from step {prop.first + 1}" in said
    assert sum(stone.mass for stone in laid_stones(arched)) == pytest.approx(whole)


def check_marks(one, points) -> None:
    """Marks lie on their cuts and on the stone, and their distances are those of the numbered points."""
    for marks in one.marks:
        if marks is None:
            continue
        cut = one.carved.cuts[marks.cut]
        assert marks.point @ cut.normal == pytest.approx(cut.offset, abs=1e-6)
        corner = one.found.vertices[one.found.triangles]
        for point, far in zip(marks.point, marks.distance, strict=True):
            nearest = trimesh.triangles.closest_point(corner, np.tile(point, (len(corner), 1)))
            assert np.linalg.norm(nearest - point, axis=1).min() < HALF
            assert np.abs(np.linalg.norm(points - point, axis=1) - far).max() < 1e-9


@settings(max_examples=6)
@given(seed=st.integers(0, 10_000))
def test_marks_of_cuts_are_where_they_are_said_to_be(seed):
    rng = np.random.default_rng(seed)
    stone, turn = pebble(rng), rotation(rng)
    cell = box((0.9, 0.9, 0.9), (-0.45, -0.45, -0.45))
    made = carve(stone, cell, turn, -turn @ stone.centroid)
    one = cut_stone(made, stone)
    assert all(marks is not None and marks.through for marks in one.marks if not made.cuts[0].dressing)
    check_marks(one, one.points.point)
    for k, cut in enumerate(made.cuts):  # templates close, and cover what the cut leaves
        rings = template_of(made, k, np.array([0.0, 0.0, 1.0])).rings
        x, y = np.concatenate([np.stack([ring, np.roll(ring, -1, axis=0)], 1) for ring in rings]).transpose(2, 1, 0)
        assert float((x[0] * y[1] - x[1] * y[0]).sum()) / 2.0 == pytest.approx(cut.area, rel=1e-6)


def test_a_mark_that_is_wrong_is_found():
    stone = stone_like(box(), 1.2)
    one = cut_stone(carve(stone, box(), np.eye(3), np.zeros(3)), stone)
    check_marks(one, one.points.point)
    first = one.marks[0]
    wrong = replace(one, marks=(replace(first, point=first.point + 0.002 * one.carved.cuts[0].normal),))
    with pytest.raises(AssertionError):
        check_marks(wrong, one.points.point)


def test_a_notch_is_marked_where_it_ends():
    from carving_cases import prism

    cell = prism([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 1.0)
    stone = stone_like(box((2.2, 1.2, 2.2), (-0.1, -0.1, -0.1)))
    made = carve(stone, cell, np.eye(3), np.zeros(3))
    one = cut_stone(made, stone)
    through = {tuple(np.round(made.cuts[m.cut].normal, 6) + 0.0): m.through for m in one.marks if m is not None}
    offsets = {round(cut.offset, 6) for cut in made.cuts}
    assert 1.0 in offsets
    assert through[0.0, -1.0, 0.0]
    notch = [m for m in one.marks if m is not None and not m.through]
    assert all(abs(made.cuts[m.cut].offset - 1.0) < 1e-9 for m in notch)


def test_cuts_of_a_bent_face_are_one():
    """By hand: at (1, 1.2) the top turns by 2 atan 0.2 = 22.6 degrees, at its ends by 78.7."""
    from carving_cases import prism

    cell = prism([(0, 0), (2, 0), (2, 1), (1, 1.2), (0, 1)], 1.0)
    cuts = carve(stone_like(box((2.2, 1.2, 1.6), (-0.1, -0.1, -0.1))), cell, np.eye(3), np.zeros(3)).cuts
    (bent,) = bent_faces(cuts)
    assert sorted(abs(round(float(cuts[k].normal @ [1.0, 0.0, 0.0]), 4)) for k in bent) == [0.1961, 0.1961]


@pytest.fixture
def no_cad(monkeypatch):
    """DXF takes most of the time."""
    monkeypatch.setattr("cyclopean.api.site.find_spec", lambda name: None if name == "ezdxf" else find_spec(name))


@pytest.fixture
def plain_sheets(monkeypatch):
    monkeypatch.setattr("cyclopean.api.site.find_spec", lambda name: None)


def test_a_wall_of_sawn_stones_has_courses_opening_and_left_overs(plain_sheets, tmp_path):
    """By hand: 4 courses of 0.2 m; an opening of 0.4 m by 0.4 m, 0.4 m from the left end, on the ground."""
    settings = AshlarSettings(length=1.2, height=0.8, depth=0.2, openings=(opening("opening", "0.4,0.2,0.4,0.4"),))
    wall_ = ashlar(settings, [*repeated("", (0.4, 0.2, 0.2), 20), *repeated("beam", (0.8, 0.2, 0.2), 2)])
    made = site_set_of(wall_, tmp_path / "s", Settings(method="rbe"), hours={"lay": 2.0})
    front = texts(made.contents["elevation-1.svg"])
    assert {"4 x 200 mm", "400 mm x 400 mm", "3 x 400 mm", "sill +0.200 m", "along (x)", "up (z)"} <= set(front)
    assert any("Section A-A" in text for text in texts(made.contents["elevation-4.svg"]))
    said = " ".join(texts(made.contents["props-and-masses.svg"]))
    tonnes = 2.4 * (1.2 * 0.8 - 0.4 * 0.4) * 0.2
    assert f"{2.0 * tonnes:.1f} h of laying" in said
    left = re.search(r"(\d+) not used, ([\d.]+) litres", said)
    assert float(left[2]) == pytest.approx(16.0 * 20 + 32.0 * 2 - 1000.0 * tonnes / 2.4, abs=17.0)
    assert "slab-0001, uncut" in " ".join(texts(made.contents["cards-1.svg"]))
    frames = json.loads((tmp_path / "s" / "frames.json").read_text())
    bases = {name: np.array(frame) for name, frame in frames["bases"].items()}
    for step in frames["steps"]:
        for name, base in bases.items():
            assert base @ np.array(step[f"in_{name}"]["approach"]) == pytest.approx(np.array(step["approach"]))
    assert np.array(frames["steps"][0]["in_wall"]["place"])[:3, 3] == pytest.approx([0.2, 0.1, 0.1])
    assert np.array(frames["steps"][0]["in_yard"]["yard"])[:3, 3] == pytest.approx([0.2, 0.1, 0.1], abs=1.0)
    compas = json.loads((tmp_path / "s" / "frames.compas.json").read_text())
    place = compas["stops"]["place"][0]
    assert place["dtype"] == "compas.geometry/Frame"
    assert place["data"]["point"] == pytest.approx(np.array(frames["steps"][0]["place"])[:3, 3])


def test_numbered_points_of_a_cube_are_corners_and_a_ball_has_others():
    cube = trimesh.creation.box((0.4, 0.3, 0.2))
    points = numbered_points(cube.vertices, cube.faces)
    assert points.corners
    assert np.abs(points.point) == pytest.approx(np.tile([0.2, 0.15, 0.1], (3, 1)))
    assert points.apart.min() > 0.19
    ball = trimesh.creation.icosphere(3, 0.25)
    round_ = numbered_points(ball.vertices, ball.faces)
    assert not round_.corners
    assert round_.apart[0] == pytest.approx(0.5, abs=1e-6)  # the two farthest apart
    assert np.linalg.norm(round_.point, axis=1) == pytest.approx([0.25] * 3)


def test_the_set_of_a_carved_wall(carving, tmp_path, plain_sheets):
    order = build_sequence(carving.assembly)
    files = site_files(order, SiteOptions(site="s", date="3 May 2026"), stock_of(order, carving))
    assert not [note for note in files.notes if "PDF" not in note and "DXF" not in note]
    templates = [name for name in files.contents if name.startswith("templates/") and name.endswith(".svg")]
    assert len(templates) == sum(len(c.cuts) for c in carving.carved)
    for name in templates:
        outline = re.search(r'data-layer="outline"><path d="([^"]+)"', files.contents[name])[1]
        assert outline.endswith("Z")
        assert ElementTree.fromstring(files.contents[name]).get("width").endswith("mm")
    card = " ".join(texts(next(drawing for name, drawing in files.contents.items() if re.match(r"cuts.*svg", name))))
    assert "sharpest corners" in card
    assert "3 May 2026" in card
    said = " ".join(texts(files.contents["props-and-masses.svg"]))
    off = 1000.0 * sum(c.stone_volume - c.volume for c in carving.carved)
    assert f"{off:,.0f} litres come off" in said
    write_site(tmp_path / "s", files)
    assert {path.name for path in (tmp_path / "s" / "templates").glob("*.svg")} == {Path(t).name for t in templates}
    frames = json.loads((tmp_path / "s" / "frames.json").read_text())
    assert [step["step"] for step in frames["steps"]] == list(range(1, len(order.steps) + 1))
    place, approach = (np.array(frames["steps"][0][stop]) for stop in ("place", "approach"))
    assert np.linalg.norm(place[:3, 3] - approach[:3, 3]) == pytest.approx(0.1)
    assert place[:3, 3] == pytest.approx(order.assembly.mass.centroid[order.steps[0].block])
    assert "metres" in frames["conventions"]["units"]


def test_no_letter_is_too_small_and_none_leaves_the_frame(arched, carving):
    sets = [site_set(arched, Layout(Form(paper), Title("Arch"), cards)) for paper in ("A4", "A3") for cards in (2, 8)]
    for sheets, paper in ((one.sheets, "A4" if k < 2 else "A3") for k, one in enumerate(sets)):
        wide, high = Form(paper).size
        for name, drawing in sheets.items():
            assert min(float(size) for size in re.findall(r'font-size="([\d.]+)"', drawing)) >= SMALLEST
            for one in ElementTree.fromstring(drawing).iter(f"{SVG}text"):
                if "rotate" in one.get("transform", ""):
                    continue
                long = width("".join(one.itertext()), float(one.get("font-size", "3.1"))) / 1.2
                x = float(one.get("x")) - {"middle": 0.5, "end": 1.0}.get(one.get("text-anchor"), 0.0) * long
                assert 8.0 <= x, (name, one.text)
                assert x + long <= wide - 8.0, (name, one.text)
                assert 8.0 <= float(one.get("y")) <= high - 8.0, (name, one.text)


def test_many_stones_have_an_index_and_parts_with_all_numbers():
    made = site_set(build_sequence(wall(30, 2), Settings(method="rbe")), Layout(Form("A4"), Title("Long"), 8))
    titles = list(made.titles.values())
    cards = [k for k, title in enumerate(titles, 1) if title.startswith("Stones ")]
    assert len(cards) == 8  # 61 stones, 8 on a page
    index = texts(made.sheets[next(name for name in made.sheets if name.startswith("index"))])
    at = index.index("c02-b31")
    assert int(index[at + 2]) == cards[(int(index[at + 1]) - 1) // 8]
    assert any("part 1 of" in title for title in titles), titles[:3]
    shown = {text for name, drawing in made.sheets.items() if name.startswith("elev") for text in texts(drawing)}
    assert {str(k) for k in range(1, 62)} <= shown


def test_words_fit_their_room():
    assert shortened("short", 50.0) == "short"
    cut = shortened("a long name " * 25, 50.0)
    assert cut.endswith("…")
    assert width(cut) <= 50.0
    assert all(width(line) <= 40.0 for line in wrapped("words that are many and " * 9 + "x" * 200, 40.0))
    assert len(wrapped("many words " * 50, 40.0, 3)) == 3


def test_text_of_the_pdf_can_be_found_and_the_same_sheets_give_the_same_bits(arched, no_cad):
    pytest.importorskip("reportlab")
    options = SiteOptions(site="s", title="Gothic arch", date="3 May 2026")
    data = site_files(arched, options).contents["site.pdf"]
    streams = re.findall(rb"stream\r?\n(.*?)endstream", data, re.DOTALL)
    words = b"".join(zlib.decompress(base64.a85decode(s.strip().removesuffix(b"~>"))) for s in streams)
    for said in (b"(Front elevation)", b"(Gothic arch)", b"(3 May 2026)", b"(v04)", b"(1 of 13)", b"(P1: centring"):
        assert said in words, said
    assert data.count(b"/Type /Page\n") == 13
    assert b"/MediaBox [ 0 0 841.8898 595.2756 ]" in data
    assert data == site_files(arched, options).contents["site.pdf"]


def test_letters_that_the_pdf_lacks_are_told(arched, no_cad):
    pytest.importorskip("reportlab")
    notes = site_files(arched, SiteOptions(site="s", title="石 arch")).notes
    assert any("shows ? for 石" in note for note in notes)


def test_without_the_libraries_the_sheets_are_there_as_svg(arched, plain_sheets):
    files = site_files(arched, SiteOptions(site="s"))
    assert [note.split(";")[0] for note in files.notes] == [
        "no PDF: it needs reportlab (pip install 'cyclopean[pdf]')",
        "no DXF: it needs ezdxf (pip install 'cyclopean[dxf]')",
    ]
    assert {name.rpartition(".")[2] for name in files.contents} == {"svg", "json"}


def test_a_structure_too_large_for_the_paper_is_refused(built):
    blocks = tuple(replace(b, vertices=400.0 * b.vertices) for b in built.assembly.blocks)
    large = replace(built, assembly=replace(built.assembly, blocks=blocks, contacts=None))
    with pytest.raises(InputError, match=r"960 m by 320 m do not fit on A4 at 1:1000"):
        elevation_pages(large, Form("A4"))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--paper", "A4"], None),
        (["--paper", "A3"], "--paper: no sheets are drawn; say where they go with --site DIR"),
        (["--site", "s", "--paper", "A9"], "--paper"),
        (["--site", "s", "--cards", "9"], "--cards"),
        (["--site", "s", "--hours", "rest=1"], "--hours rest=1: expected lay=H or cut=H"),
        (["--site", "no/where"], "--site no/where: the folder 'no' does not exist; make it first"),
        (["--site", "arch.json"], "--site arch.json: is not a folder; choose another name"),
    ],
)
def test_the_command_refuses(run, words, said):
    run("make", "arch", 3, "--out", "arch.json")
    status, _, err = run("sequence", "arch.json", "--out", "seq.json", "--method", "rbe", *words)
    assert status == (0 if said is None else 2)
    assert said is None or (said in err and len(err.splitlines()) == 1)
    assert Path("s").exists() is False
    assert Path("seq.json").exists() is (said is None)


def test_the_command_tells_of_a_long_title_and_of_old_sheets(run, no_cad):
    run("make", "arch", 3, "--out", "arch.json")
    command = ("sequence", "arch.json", "--out", "seq.json", "--method", "rbe", "--site", "s", "--title", "x" * 300)
    status, out, err = run(*command, "--cards", "1")
    assert status == 0
    assert "--title: 300 letters do not fit; the sheets say 'x" in err
    assert "  site     12 sheets in s; print" in out
    _, _, err = run(*command, "--cards", "8")
    assert "of an earlier run, not of this set; throw away before printing" in err
