"""A contact sheet: what is drawn of each stone, by hand.

A box of 4 x 2 x 1 shows its face of 4 x 2: two triangles of one shade, twice as wide as high. Of two cubes-like boxes
whose volumes are as 8 to 1, one is drawn twice as large as the other.
"""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.design.stones.quarry import quarry
from cyclopean.design.stones.stone import stone_of
from cyclopean.errors import InputError
from cyclopean.view.stone_faces import stone_svg
from cyclopean.view.stone_sheet import stone_sheet_svg
from laws import examples

SVG = "{http://www.w3.org/2000/svg}"
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = [(q[0], q[k], q[k + 1]) for q in QUADS for k in (1, 2)]


def box(name, a, b, c):
    return stone_of(name, [[a * x, b * y, c * z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], TRIANGLES)


def drawn(svg):
    """Triangles (t, 3, 2) in drawing units, and colours, of every stone."""
    found = []
    for group in ElementTree.fromstring(svg).findall(f"{SVG}g[@transform]"):
        scale = float(re.search(r"scale\(([\d.]+)\)", group.get("transform"))[1])
        paths = group.findall(f"{SVG}path")
        faces = [(way, path.get("color")) for path in paths for way in path.get("d").split("z")[:-1]]
        steps = [np.array(re.findall(r"-?\d+", way), float).reshape(3, 2) for way, _ in faces]
        found.append((np.cumsum(steps, axis=1) * scale, [colour for _, colour in faces]))
    return found


def text(svg):
    return ["".join(t.itertext()) for t in ElementTree.fromstring(svg).iter(f"{SVG}text")]


def test_a_box_shows_its_largest_face():
    svg = stone_sheet_svg([box("brick", 0.4, 0.2, 0.1)], columns=1)
    ((faces, colours),) = drawn(svg)
    assert len(faces) == 2
    assert len(set(colours)) == 1
    width, height = np.ptp(faces.reshape(-1, 2), axis=0)
    assert width == pytest.approx(2.0 * height, rel=0.01)
    assert "brick8 L, blade" in text(svg)
    assert text(svg)[0] == "1 stone; 8 L in all, seen on the largest face"


def test_all_stones_have_one_scale_and_a_bar_that_tells_it():
    svg = stone_sheet_svg([box("a", 0.8, 0.6, 0.4), box("b", 0.4, 0.3, 0.2)], columns=2)
    (large, _), (small, _) = drawn(svg)
    wide = np.ptp(large[..., 0])
    assert wide == pytest.approx(2.0 * np.ptp(small[..., 0]), rel=0.01)
    bar = float(re.search(r'd="M[\d.]+ [\d.]+v10m0-5h([\d.]+)', svg)[1])
    name = next(t for t in text(svg) if t.endswith(" m") or t.endswith(" mm"))
    length = float(name.split()[0]) * (1e-3 if name.endswith("mm") else 1.0)
    assert bar / length == pytest.approx(wide / 0.8, rel=0.01)


def test_volumes_are_written_in_the_unit_that_reads_best():
    names = text(stone_sheet_svg([box("s", 2.0, 1.0, 0.5), box("t", 2.0, 1.0, 0.6)]))
    assert "s1 m\u00b3, blade" in names
    assert "t1.2 m\u00b3, blade" in names


@settings(max_examples=examples(15), deadline=None)
@given(seed=st.integers(0, 10**6))
def test_faces_look_at_the_viewer_and_cover_the_outline(seed):
    stone = quarry(1, seed, detail=2)[0]
    ((faces, colours),) = drawn(stone_sheet_svg([stone], columns=1))
    a, b, c = faces.transpose(1, 0, 2)
    across = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    # Clockwise on a sheet whose y runs down is counter-clockwise from before it; coordinates are rounded to 0.1, so
    # that a face seen edge on may turn by that times its edges.
    assert (across <= 0.3 * np.linalg.norm([b - a, c - a], axis=2).sum(axis=0)).all()
    flat = faces.reshape(-1, 2)
    assert np.abs(flat.min(axis=0) + flat.max(axis=0)).max() < 9.0  # in the middle of its place, but for joined faces
    assert len(set(colours)) > 10


def test_the_nearest_faces_are_painted_last():
    # A long plate with a post on it, off the middle: the top of the post covers the plate behind.
    from cyclopean.geometry.solids import difference, mesh_of, solid_of

    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    whole = solid_of(corner * [0.8, 0.6, 0.4], QUADS)
    left = difference(whole, solid_of(corner * [0.5, 1.0, 0.3] + [0.2, -0.2, 0.2], QUADS))
    stone = stone_of("step", *mesh_of(left))
    body = (stone.vertices - stone.centroid) @ stone.axes.T
    ((faces, _),) = drawn(stone_sheet_svg([stone], columns=1))
    scale = np.ptp(faces[..., 0]) / np.ptp(body[:, 0])
    middle = (body[:, :2].min(axis=0) + body[:, :2].max(axis=0)) / 2.0
    sheet = (body[:, :2] - middle) * scale * [1.0, -1.0]
    nearest = np.linalg.norm(faces[:, :, None] - sheet, axis=3).argmin(axis=2)
    depth = body[nearest, 2].mean(axis=1)
    assert (np.diff(depth) > -1e-3).all()
    assert np.ptp(depth) > 0.05


@pytest.mark.parametrize(("light", "painted"), [([1.0, 0.5, 1.0], "white grey white"), ([1.0, 1.0, 0.5], "white grey")])
def test_faces_of_one_light_are_one_path_only_where_they_follow_each_other(light, painted):
    svg = stone_svg("a", np.arange(27.0).reshape(3, 3, 3), np.array(light), "#ffffff")
    names = {"#ffffff": "white", "#808080": "grey"}
    assert [names[colour] for colour in re.findall('path color="([^"]*)"', svg)] == painted.split()


def test_names_are_escaped_and_long_ones_cut():
    svg = stone_sheet_svg([box("<a & b>", 0.4, 0.3, 0.2), box("x" * 60, 0.4, 0.3, 0.2)], columns=8)
    root = ElementTree.fromstring(svg)
    titles = [t.text for t in root.iter(f"{SVG}title")]
    assert titles[1:] == ["<a & b>", "x" * 60]
    assert any(t.startswith("<a & b>") for t in text(svg))
    assert not any("x" * 60 in t for t in text(stone_sheet_svg([box("x" * 60, 0.4, 0.3, 0.2)] * 8)))


def test_of_many_stones_some_are_drawn_and_the_file_stays_small():
    stones = quarry(60)
    svg = stone_sheet_svg(stones)
    assert len(drawn(svg)) == 48
    assert text(svg)[0].startswith("60 stones, 48 of them drawn; ")
    assert any(t.startswith("stone-0001") for t in text(svg))
    assert any(t.startswith("stone-0060") for t in text(svg))
    assert len(svg) < 400_000
    assert svg == stone_sheet_svg(stones)
    assert len(drawn(stone_sheet_svg(stones, most=1))) == 1


@pytest.mark.parametrize(("stones", "columns", "most"), [(0, 8, 48), (1, 0, 48), (1, 8, 0)])
def test_refusals(stones, columns, most):
    with pytest.raises(InputError, match="contact sheet: "):
        stone_sheet_svg([box("a", 0.4, 0.3, 0.2)] * stones, columns, most)
