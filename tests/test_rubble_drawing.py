"""Pictures of rubble walls: what is seen from each side, where it is cut, and at what scale.

By hand: a box fills its rectangle of the front; a section of a wedge is as high as the wedge is there.
"""

import base64
import re
import struct
import zlib
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.assembly import Assembly, Block
from cyclopean.errors import InputError
from cyclopean.geometry.solids import fans
from cyclopean.view.png import png
from cyclopean.view.relief import SHORT, Relief, hollow, outlines, picture, places, relief
from cyclopean.view.rubble_drawing import PALE_RIM, Profile, Told, courses_svg, rubble_svg
from cyclopean.view.settled_page import settled_html
from cyclopean.view.stone_faces import facing

SVG = "{http://www.w3.org/2000/svg}"
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
CORNER = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
UNIT = 1.0  # drawing units: outlines follow pixels, two thirds of a unit wide, and round corners off


def box(name: str, low: tuple[float, ...], high: tuple[float, ...], fixed: bool = False) -> Block:
    return Block(name, np.array(low) + CORNER * np.subtract(high, low), QUADS, fixed=fixed)


GROUND = box("ground", (-1, -1, -1), (3, 3, 0), fixed=True)


def wall(*blocks: Block) -> Assembly:
    return Assembly((GROUND, *blocks), name="wall")


# Two stones in front, one behind them, one on top: 2 m long, 0.8 m thick and 1 m high.
BUILT = wall(
    box("a", (0, 0, 0), (1.2, 0.4, 0.6)),
    box("b", (1.2, 0, 0), (2, 0.4, 0.6)),
    box("rear", (0.2, 0.4, 0), (1.8, 0.8, 0.5)),
    box("top", (0.5, 0, 0.6), (1.5, 0.8, 1)),
)


def rims(svg: str) -> dict[str, np.ndarray]:
    """(2, 2) least and largest corner of what is seen of each stone, drawing units."""
    found = {}
    for group in re.finditer(r'<g transform="translate\((\S+) (\S+)\) scale\((\S+)\)".*?</g>', svg):
        left, top, scale = map(float, group.groups())
        for way, name in re.findall(r'<path d="(M[^"]*)"[^>]*><title>([^<]*)', group[0]):
            rings = [np.array(re.findall(r"-?\d+", ring), float).reshape(-1, 2) for ring in way.split("z")[:-1]]
            point = np.concatenate([np.cumsum(ring, axis=0) for ring in rings]) * scale + [left, top]
            found[name] = np.array([point.min(axis=0), point.max(axis=0)])
    return found


def cut(svg: str, name: str) -> np.ndarray:
    """Corners (k, 2) of a stone that is cut."""
    (way,) = re.findall(rf'<path d="([^"]*)" fill="#\w*"><title>{name}<', svg)
    return np.array(re.findall(r"-?[\d.]+", way), float).reshape(-1, 2)


def dimensions(svg: str) -> list[tuple[float, float]]:
    """Length of each dimension line (drawing units), and the metres that it is said to be."""
    return [(float(a), float(b)) for a, b in re.findall(r'class="dimension" d="M\S+ \S+h([\d.]+)M.*?>([\d.]+) m<', svg)]


def words(svg: str) -> list[str]:
    return ["".join(text.itertext()) for text in ElementTree.fromstring(svg).iter(f"{SVG}text")]


def test_a_front_of_boxes_is_its_rectangles_to_scale():
    svg = rubble_svg(BUILT, "Front", (("front",),))
    (high, metres_high), (long, metres_long) = sorted(dimensions(svg))
    assert (metres_high, metres_long) == (1.0, 2.0)
    scale = long / 2.0
    assert high == pytest.approx(scale, abs=0.1)
    found = rims(svg)
    origin = np.array([found["a"][0, 0], found["a"][1, 1]])
    for name, low, up in (("a", (0, 0.6), (1.2, 0)), ("b", (1.2, 0.6), (2, 0)), ("top", (0.5, 1), (1.5, 0.6))):
        expected = origin + np.array([low, up]) * [scale, -scale]
        assert found[name] == pytest.approx(expected, abs=UNIT)


def test_what_is_hidden_is_not_drawn():
    assert set(rims(rubble_svg(BUILT, "Front", (("front",),)))) == {"a", "b", "top"}
    assert set(rims(rubble_svg(BUILT, "Back", (("back",),)))) == {"a", "b", "rear", "top"}  # a and b look out above it
    assert set(rims(rubble_svg(BUILT, "Plan", (("above",),)))) == {"a", "b", "rear", "top"}
    assert set(rims(rubble_svg(wall(*BUILT.blocks[1:4]), "Left", (("left",),)))) == {"a", "rear"}


@pytest.mark.parametrize(("side", "first"), [("front", "a"), ("back", "b"), ("left", "rear"), ("right", "b")])
def test_sides_are_not_mirrored(side, first):
    """The first from the left; the front is to the right at the left end, and to the left at the right end."""
    found = rims(rubble_svg(wall(*BUILT.blocks[1:4]), side, ((side,),)))
    assert min(found, key=lambda name: found[name][0, 0]) == first
    plan = rims(rubble_svg(BUILT, "Plan", (("above",),)))
    assert plan["rear"][0, 1] < plan["a"][0, 1]  # the front is at the foot


@given(x=st.floats(0.05, 0.95))
def test_a_section_of_a_wedge_is_as_high_as_the_wedge_is_there(x):
    """1 m high at x = 0, nothing at x = 1 m, 0.5 m through; a stone before the cut is gone, one behind it is not."""
    wedge = Block(
        "wedge",
        [[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 0.5, 0], [1, 0.5, 0], [0, 0.5, 1]],
        ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (0, 2, 5, 3), (1, 4, 5, 2)),
    )
    made = wall(box("before", (-1, 0, 0), (0, 0.5, 0.3)), wedge, box("behind", (1, 0, 0), (2, 0.5, 0.3)))
    svg = rubble_svg(made, "Cut", ((x,),))
    ((long, metres),) = dimensions(svg)
    assert metres == 0.5
    assert np.ptp(cut(svg, "wedge"), axis=0) * 0.5 / long == pytest.approx([0.5, 1.0 - x], abs=0.5 * 0.15 / long)
    assert set(rims(svg)) == {"behind"}


def test_sections_are_lettered_along_the_wall_and_marked_on_front_and_plan():
    svg = rubble_svg(BUILT, "All", (("front",), (1.5, 0.5), ("above", "back")), cuts=(1.0,))
    assert [word for word in words(svg) if word in "ABC"] == ["A", "B", "C"] * 2
    assert [word[:9] for word in words(svg) if word.startswith("Section")] == ["Section C", "Section A"]


def test_stones_are_numbered_in_their_order_or_as_told_or_not_at_all():
    rows = (("front",),)
    shown = [word for word in words(rubble_svg(BUILT, "Front", rows)) if word.isdigit()]
    assert sorted(shown) == ["1", "2", "4"]
    told = Told(number={"a": 7})
    assert [word for word in words(rubble_svg(BUILT, "Front", rows, told=told)) if word.isdigit()] == ["7"]


def test_roles_and_unsteady_stones_are_told_apart_only_where_there_are_some():
    rows = (("front",),)
    plain = rubble_svg(BUILT, "Front", rows)
    assert not {"pin (1)", "does not stand by itself", "as asked for"} & set(words(plain))
    told = Told(role={"a": "pin"}, unsteady={"top": "rocks"}, profile=Profile(2.0, 0.8, 1.0))
    svg = rubble_svg(BUILT, "Front", rows, told=told)
    assert {"pin (1)", "does not stand by itself", "as asked for"} <= set(words(svg))
    assert re.findall(r'fill="url\(#unsteady-thick\)"[^>]*><title>(\w+)', svg) == ["top"]
    assert "<title>a, pin</title>" in svg
    assert "pin (1)" not in words(rubble_svg(BUILT, "Front", rows, told=told, keys=False))


def test_a_wall_that_is_asked_for_leans_in():
    """Front 1:4, back 1:5, 1 m high: the upper edges lie 0.25 and 0.2 m within."""
    edges = Profile(2.0, 1.0, 1.0, (0.25, 0.2)).edges()
    assert edges.shape == (12, 2, 3)
    assert {tuple(point) for point in edges[..., 1:].reshape(-1, 2)} == {(0, 0), (0.25, 1), (1, 0), (0.8, 1)}


def test_courses_are_drawn_on_those_below_in_pale():
    svg = courses_svg(BUILT, "Courses", Told(course={"a": 0, "b": 0, "rear": 0, "top": 1}))
    assert [word for word in words(svg) if word.startswith("Course")] == ["Course 13 stones", "Course 21 stone"]
    assert [word for word in words(svg) if word.isdigit()] == ["1", "2", "3", "4"]
    lower, upper = svg.split("<image ")[1:]
    assert PALE_RIM not in lower
    assert re.findall(rf"{PALE_RIM}[^>]*><title>(\w+)", upper) == ["a", "b", "rear"]
    assert "top" not in lower

    shown = pixels(re.findall(r'href="([^"]*)"', upper)[0]).reshape(-1, 4)
    shown = shown[shown[:, 3] > 0]
    bare = (0.5 + 0.5) * 0.4 + (0.3 + 0.3) * 0.4  # m2 of the lower course, seen from above
    assert (shown[:, :3].min(axis=1) > 180).mean() == pytest.approx(bare / (bare + 1.0 * 0.8), abs=0.02)


def test_the_mean_top_of_a_wall():
    """1 m high over half of its length, 0.6 m over the other."""
    assert "Frontdashed: mean top, 0.8 m" in words(rubble_svg(BUILT, "Front", (("front",),)))


def test_no_stone_no_side_and_a_cut_beside_the_wall_are_refused():
    with pytest.raises(InputError, match="no stone to draw"):
        rubble_svg(wall(), "None")
    with pytest.raises(InputError, match="'top' is no side of a wall; choose among front, back"):
        rubble_svg(BUILT, "Top", (("top",),))
    with pytest.raises(InputError, match="section at x = 2 m: the wall lies from 0 to 2 m"):
        rubble_svg(BUILT, "Cut", ((2.0,),))
    with pytest.raises(InputError, match="wall: nothing says in which course"):
        courses_svg(BUILT, "Courses", Told())


corners = st.tuples(*[st.floats(-3.0, 23.0)] * 2)


@given(a=corners, b=corners, c=corners, inside=st.tuples(st.floats(0.1, 0.8), st.floats(0.1, 0.9)))
def test_triangles_that_share_edges_share_no_pixel_and_leave_no_gap(a, b, c, inside):
    """A triangle in three parts round a point in it covers each pixel once that the whole covers."""
    s, t = inside[0], inside[1] * (1.0 - inside[0])
    whole = np.array([[*a, 0.0], [*b, 1.0], [*c, 2.0]])
    middle = whole[0] + s * (whole[1] - whole[0]) + t * (whole[2] - whole[0])
    parts = [np.array([[whole[k], whole[(k + 1) % 3], middle]]) for k in range(3)]
    empty, light = Relief.empty(20, 20), np.ones(1)
    covered = [relief(empty, [(0, part, light)]).stone >= 0 for part in parts]
    assert (sum(part.astype(int) for part in covered) == (relief(empty, [(0, whole[None], light)]).stone >= 0)).all()


def test_faces_that_look_at_the_viewer_are_in_the_sun_from_the_upper_left():
    """Of a cube, y down, the near face and no other; towards the sun it is at 0.62 / |(0.5, 0.6, 0.62)|."""
    corner, light = facing(CORNER * [1.0, -1.0, 1.0], fans(QUADS))
    assert (corner[:, :, 2] == 1.0).all()
    assert light == pytest.approx([0.4 + 0.6 * 0.62 / np.sqrt(0.25 + 0.36 + 0.62**2)] * 2)
    leaning = [np.array([[0, 0, 0], [x, 0, -0.5], [0, 1, 0]], float)[:: -1 if x > 0 else 1] for x in (1, -1)]
    right, left = (facing(point, np.array([[0, 1, 2]]))[1] for point in leaning)
    assert left > right


def test_a_picture_has_the_tint_of_each_stone_and_pale_ones_near_white():
    seen = relief(Relief.empty(4, 9), [(k, plate(3 * k, 3 * k + 3, 0.0, 0, 4), np.ones(2)) for k in (0, 1)])
    address = picture(seen, 10.0, np.array([1, 0]), np.array([False, True]), ["#0000ff", "#ff0000"])
    shown = pixels(address)[0, [0, 3, 8]].tolist()
    assert shown == [[255, 0, 0, 255], [191, 191, 255, 255], [255, 255, 255, 0]]


def plate(left: float, right: float, near: float, top: float = 0.0, foot: float = 20.0) -> np.ndarray:
    """Two triangles (2, 3, 3) of a rectangle that looks at the viewer, pixels."""
    a, b, c, d = ((x, y, near) for x, y in ((left, top), (right, top), (right, foot), (left, foot)))
    return np.array([[a, b, c], [a, c, d]])


def test_the_nearest_is_seen_whatever_the_order():
    stones = [(0, plate(0, 30, 0.0), np.ones(2)), (1, plate(10, 20, 5.0), np.ones(2))]
    for order in (stones, stones[::-1]):
        seen = relief(Relief.empty(20, 30), order)
        assert [(seen.stone == k).sum() for k in (-1, 0, 1)] == [0, 400, 200]
    tilted = plate(0, 30, 0.0)
    tilted[:, :, 2] = tilted[:, :, 1] - tilted[:, :, 0] + 5.0
    seen = relief(Relief.empty(20, 30), [(0, plate(0, 30, 0.25), np.ones(2)), (1, tilted, np.ones(2))])
    row, column = np.indices((20, 30)) + 0.5
    assert (seen.stone == (row - column > -4.75)).all()
    behind = relief(Relief.empty(20, 30), stones, nearest=4.0)
    assert (behind.stone == 0).all()


def test_a_joint_lies_in_shade_and_a_face_does_not():
    two = [(k, plate(x, x + 28, 30.0), np.ones(2)) for k, x in enumerate((0, 32))]
    shade = hollow(relief(Relief.empty(20, 60), [*two, (2, plate(0, 60, 0.0), np.ones(2))]), 40.0)
    assert shade[:, 28:32].min() > 0.3
    assert shade[:, 5:20].max() < 1e-6


def test_outlines_go_round_what_is_seen_and_labels_lie_in_it():
    ring = [(0, plate(0, 60, 0.0, 0, 60), np.ones(2)), (1, plate(20, 40, 1.0, 20, 40), np.ones(2))]
    seen = relief(Relief.empty(60, 60), ring)
    found = outlines(seen)
    assert [len(found[k]) for k in (0, 1)] == [2, 1]  # the rim of the large one, and of the hole in it
    (inner,) = found[1]
    assert inner.min(axis=0) == pytest.approx([20, 20], abs=1.0)
    assert inner.max(axis=0) == pytest.approx([40, 40], abs=1.0)
    x, y, far = places(seen)[1]
    assert (x, y, far) == pytest.approx((30, 30, 10), abs=2.0)
    speck = relief(Relief.empty(9, 9), [(0, plate(4, 5, 0.0, 4, 5), np.ones(2))])
    assert SHORT > 4
    assert outlines(speck) == {}


def unpacked(file: bytes) -> dict[bytes, bytes]:
    """Chunks of a PNG, their sums checked."""
    found, at = {}, 8
    while at < len(file):
        (size,) = struct.unpack(">I", file[at : at + 4])
        kind, data, sum_ = file[at + 4 : at + 8], file[at + 8 : at + 8 + size], file[at + 8 + size : at + 12 + size]
        assert struct.unpack(">I", sum_) == (zlib.crc32(kind + data),)
        found[kind] = data
        at += 12 + size
    return found


def pixels(address: str) -> np.ndarray:
    """(h, w, 4) of a picture with a palette."""
    file = unpacked(base64.b64decode(address.partition(",")[2]))
    (wide,) = struct.unpack(">I", file[b"IHDR"][:4])
    index = np.frombuffer(zlib.decompress(file[b"IDAT"]), np.uint8).reshape(-1, wide + 1)[:, 1:]
    opacity = np.frombuffer(file[b"tRNS"], np.uint8)
    return np.column_stack([np.frombuffer(file[b"PLTE"], np.uint8).reshape(-1, 3), opacity])[index]


def test_pictures_of_pixels_come_back():
    colours = np.array([[255, 0, 0, 255], [0, 0, 255, 128]])
    few = unpacked(png(np.array([[0, 1, 1]]), colours))
    assert struct.unpack(">IIBB", few[b"IHDR"][:10]) == (3, 1, 8, 3)
    assert (few[b"PLTE"], few[b"tRNS"]) == (b"\xff\0\0\0\0\xff", b"\xff\x80")
    assert zlib.decompress(few[b"IDAT"]) == b"\0\0\1\1"
    full = unpacked(png(colours[None]))
    assert zlib.decompress(full[b"IDAT"]) == b"\0\xff\0\0\xff\0\0\xff\x80"


def test_the_page_holds_all_and_loads_nothing():
    stones = [box("<i>", (0, 0, 0), (1, 0.5, 0.5)), box("b", (1, 0, 0), (2, 0.5, 0.5))]
    told = Told(course={"<i>": 0, "b": 0}, role={"b": "pin"}, unsteady={"b": "rocks"})
    aside = [("s", "<b>large"), ("<t>", "<b>large"), ("u", "no place left")]
    page = settled_html(wall(*stones), ("2 of 5 stones stand", "A wall."), told, {"Void & more": "5 %"}, aside)
    assert "<i>" not in page
    assert "<t>" not in page
    assert "<b>" not in page
    assert not re.search(r"""(?:src|href)=["'](?!data:image/png;base64,)""", page)
    rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", page)]
    assert ["&lt;b&gt;large", "2", "s, &lt;t&gt;"] in rows
    assert ["Void &amp; more", "5 %"] in rows
    assert ["rocks", "1", "b"] in rows
    assert ["2", "b", "1", "600", "1000 × 500 × 500", "pin"] in rows
    assert page.count("<svg") == 5  # front, other sides, sections, plan, courses
    with pytest.raises(InputError, match="no stone to draw"):
        settled_html(wall(), ("0 of 5 stones", ""), Told(), {})
