"""Walls from drawings of their joints: nets and outlines, gaps, curves, openings, ground; DXF and SVG; what is refused.

By hand: a wall 2.0 x 1.0 m with a bed at half its height and a head joint in each course has four stones of 0.5 m2;
the joints are 1 m long, or 0.5 m, and it stands on 2 m.
"""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from cyclopean.design.walls.line_work import Line, LineReading, LineWork, pattern_of, usual_snap
from cyclopean.design.walls.pattern import PatternSettings, draw_pattern
from cyclopean.design.walls.polygonal import polygonal_wall
from cyclopean.design.walls.surfaces import Cylinder, Plane, Sphere
from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults
from cyclopean.geometry.curves import bezier, bulged, elliptic, sampled, thinned
from cyclopean.geometry.line_net import noded
from cyclopean.io import read_drawing, read_line_work
from cyclopean.io.drawings import wall_of
from laws import examples

SQUARE = [(0, 0), (2, 0), (2, 1), (0, 1), (0, 0)]
FOUR = [SQUARE, [(0, 0.5), (2, 0.5)], [(0.8, 0), (0.8, 0.5)], [(1.2, 0.5), (1.2, 1)]]


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def work(*lines, layers=(), **more):
    layer = [*layers, *[""] * (len(lines) - len(layers))]
    made = tuple(Line(np.array(line, float), name) for line, name in zip(lines, layer, strict=True))
    return LineWork("d.dxf", "m", 1.0, made, **more)


def svg(name, body, size='width="2000mm" height="1000mm" viewBox="0 0 2000 1000"'):
    Path(name).write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{body}</svg>')
    return name


def areas(pattern):
    return sorted(pattern.subdivision.areas().round(9).tolist())


def test_four_stones_by_hand():
    made = polygonal_wall(pattern_of(work(*FOUR)), depth=0.5)
    assert areas(made.pattern) == [0.4, 0.4, 0.6, 0.6]
    assert made.pattern.readout.coverage == 1.0
    assert (made.pattern.settings.courses, made.pattern.course.tolist()) == (2, [0, 0, 1, 1])
    assert [block.id for block in made.assembly.blocks[1:]] == ["c01-b01", "c01-b02", "c02-b01", "c02-b02"]
    by_hand = [0.4, 0.6, 0.25, 0.4, 0.2, 0.4, 0.25]  # two on the ground, two heads of 0.5 m, a bed in three
    assert sorted(made.assembly.contacts.area.round(9).tolist()) == sorted(by_hand)
    assert made.assembly.mass.volume[1:].sum() == pytest.approx(1.0, rel=1e-12)
    assert cyclopean.check(made).verdict == "stable"


def test_outlines_and_net_are_the_same_wall():
    """Where all lines are closed what lies in none is open: the same four stones, then without one of them a hole."""
    stones = [
        [(0, 0), (0.8, 0), (0.8, 0.5), (0, 0.5), (0, 0)],
        [(2, 0), (0.8, 0), (0.8, 0.5), (2, 0.5), (2, 0)],
        [(0, 0.5), (1.2, 0.5), (1.2, 1), (0, 1), (0, 0.5)],
        [(1.2, 0.5), (2, 0.5), (2, 1), (1.2, 1), (1.2, 0.5)],
    ]
    net, outlines = pattern_of(work(*FOUR)), pattern_of(work(*stones))
    assert outlines.subdivision.vertex.tolist() == net.subdivision.vertex.tolist()
    assert outlines.subdivision.rings() == net.subdivision.rings()
    assert areas(pattern_of(work(*stones[:3]))) == [0.4, 0.6, 0.6]
    assert areas(pattern_of(work(*stones, SQUARE))) == areas(net)  # a frame is no stone
    ring = [[(x, y), (x + w, y), (x + w, y + h), (x, y + h), (x, y)]
            for x, y, w, h in ((0, 0, 1, 1), (1, 0, 1, 1), (0, 1, 0.5, 1), (1.5, 1, 0.5, 1), (0, 2, 2, 1))]  # fmt: skip
    window = pattern_of(work(*ring))
    assert (len(window.subdivision), areas(window)[0]) == (5, 0.5)
    assert [np.ptp(hole, axis=0).tolist() for hole in window.openings] == [[1.0, 1.0]]


@pytest.mark.parametrize(("gap", "reach"), [(1e-4, 3e-4), (0.02, 0.05)])
def test_gaps_are_closed_and_told_with_their_place(gap, reach):
    """One head joint stops short of its bed, one runs over, a corner is open: all by the same gap."""
    lines = [
        [(0, 0), (2, 0), (2, 1), (0, 1), (0, gap)],
        [(0, 0.5), (2, 0.5)],
        [(0.8, 0), (0.8, 0.5 - gap)],
        [(1.2, 0.5 - gap), (1.2, 1)],
    ]
    found = pattern_of(work(*lines), reach)
    assert areas(found) == [0.4, 0.4, 0.6, 0.6]
    assert found.notes == (f"d.dxf: 3 gaps closed, the widest of {gap:.2g} m at {found.notes[0].split(' at ')[1]}",)
    with pytest.raises(InputError, match=r"lines (end freely|cross) at .*\(1.2, 0.5\)|\(0.8, 0\.\d+\)"):
        pattern_of(work(*lines), gap / 2.0)


def test_nodes_stay_and_stray_ends_come_to_them():
    """Three lines meet to the last digit; the end of a fourth, and a facet of a curve, are nearby."""
    arc = Line(np.array([[0.999, 0.4999], [0.5, 0.8], [0.0, 0.9]]), "", np.array([True, False, False]))
    node = [(1, 0.5), (0, 0.5)], [(1, 0.5), (2, 0.5)], [(1, 0.5), (1, 0)]
    net = noded([np.array(line, float) for line in node] + [np.array([[0.998, 0.5001], [1, 1.0]]), arc.point], 0.005,
                [*(np.zeros(2, bool) for _ in range(4)), arc.curved])  # fmt: skip
    used = net.point[np.unique(net.edge)].tolist()
    assert [1.0, 0.5] in used
    assert not [x for x in used if x[0] in (0.998, 0.999)]
    assert net.gap.tolist() == [[1.0, 0.5, pytest.approx(math.hypot(0.002, 0.0001))]]  # the facet is no gap


def lines_of(pattern, rng, outlines, amount):
    """The edges of a pattern, or its rings, in any order and sense, each corner off by an amount at most."""
    cells = pattern.subdivision
    rings = cells.rings() if outlines else cells.edge.tolist()
    made = []
    for ring in rings:
        corner = cells.vertex[np.roll(ring, rng.integers(len(ring)))]
        corner = (corner if rng.random() < 0.5 else corner[::-1]) + rng.uniform(-amount, amount, (len(ring), 2))
        made.append(np.concatenate([corner, corner[:1]]) if outlines else corner)
    return [made[k] for k in rng.permutation(len(made))]


@settings(max_examples=examples(40))
@given(st.integers(0, 10_000), st.booleans(), st.sampled_from([0.0, 1e-4, 1e-3]))
def test_any_pattern_drawn_is_that_pattern(seed, outlines, amount):
    """Its lines in random order, and off by up to a third of the snap: as many cells, edges and crossings."""
    rng = np.random.default_rng(seed)
    columns, rows = int(rng.integers(3, 9)), int(rng.integers(2, 7))
    wanted = draw_pattern(PatternSettings(columns=columns, rows=rows, courses=rows, seed=seed))
    found = pattern_of(work(*lines_of(wanted, rng, outlines, amount)), 3.4e-3)
    assert len(found.subdivision.edge) == len(wanted.subdivision.edge)
    assert found.readout.crossings == wanted.readout.crossings
    off = np.abs(np.array(areas(found)) - np.array(areas(wanted))).max()
    assert off <= (2e-9 if amount == 0.0 else 5.0 * amount)


@settings(max_examples=examples(40))
@given(st.integers(0, 10_000), st.booleans(), st.sampled_from([0.005, 0.02, 0.05]), st.sampled_from([0.5, 1.0, 3.0]))
def test_what_is_accepted_is_a_tiling(seed, outlines, amount, share):
    """However badly it is drawn, and whatever the snap: refused, or cells that tile what they cover."""
    rng = np.random.default_rng(seed)
    wanted = draw_pattern(PatternSettings(columns=int(rng.integers(3, 8)), rows=3, courses=3, seed=seed))
    try:
        cells = pattern_of(work(*lines_of(wanted, rng, outlines, amount)), share * amount).subdivision
    except InputError:
        return
    polygons = cells.polygons()
    assert shapely.is_valid(polygons).all()
    assert float(cells.areas().min()) > 0.0
    assert shapely.area(shapely.union_all(polygons)) == pytest.approx(cells.areas().sum(), rel=1e-9)


def test_curves_keep_to_their_deviation():
    """By hand, half a circle of radius 1: the sagitta of n chords is 1 - cos(pi / 2n); 12 chords are within 0.01."""
    turn = np.linspace(0.0, np.pi, 4001)
    half = np.stack([np.cos(turn), np.sin(turn)], 1)
    made = {
        "arc": elliptic(np.zeros(2), np.array([1.0, 0]), np.array([0, 1.0]), 0.0, np.pi),
        "bulge": bulged(np.array([1.0, 0.0]), np.array([-1.0, 0.0]), 1.0),
        "sampled": sampled(lambda t: np.stack([np.cos(t), np.sin(t)], 1), 0.0, np.pi),
    }
    for name, curve in made.items():
        corners = curve.corners(0.01)
        assert np.hypot(*corners.T) == pytest.approx(1.0, abs=1e-12), name
        assert 1.0 - np.hypot(*((corners[1:] + corners[:-1]) / 2.0).T).min() <= 0.01, name
        assert corners[[0, -1]] == pytest.approx(np.array([[1.0, 0.0], [-1.0, 0.0]]), abs=1e-12)
    assert len(made["arc"].corners(0.01)) == len(made["bulge"].corners(0.01)) == 13
    cubic = bezier(np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]])).corners(1e-3)
    assert cubic[:, 1].max() == pytest.approx(0.75, abs=1e-3)  # 3 / 4 of the height of its handles
    assert len(thinned(half, 0.01)) == 17  # halved until it does: 16 chords


def test_facets_of_a_curve_meet_what_is_drawn_to_it():
    """Stones around a round window: joints end on its circle, between the facets; nothing is lost between them."""
    circle = elliptic(np.array([1.0, 1.0]), np.array([0.5, 0]), np.array([0, 0.5]), 0.0, 2.0 * np.pi).corners(1e-3)
    curved = np.ones(len(circle), bool)
    curved[[0, -1]] = False
    circle[-1] = circle[0]
    frame = Line(np.array([(0, 0), (2, 0), (2, 2), (0, 2), (0, 0)], float))
    joints = [Line(np.array([[1 + 0.5 * math.cos(t), 1 + 0.5 * math.sin(t)], [1 + dx, 1 + dy]]))
              for t, dx, dy in ((0.3, 1, 0.31), (1.9, -0.4, 1), (3.3, -1, -0.2), (4.8, 0.1, -1))]  # fmt: skip
    found = pattern_of(LineWork("d", "m", 1.0, (Line(circle, "Window", curved), frame, *joints)), 4e-3)
    assert len(found.subdivision) == 4
    assert sum(areas(found)) == pytest.approx(4.0 - math.pi / 4.0, abs=math.pi * 1e-3)
    assert sum(areas(found)) > 4.0 - math.pi / 4.0  # chords of a hole leave more than the circle
    made = polygonal_wall(found, depth=0.4)
    assert mesh_faults(made.assembly.mesh) == []


def test_openings_and_ground():
    """A door without a sill, bounded by the ground, which rises; its outline is on a layer of its own."""
    ground = [(-1, 0), (1.5, 0), (2.5, 0.2)]
    frame = [(0, 0), (0, 2), (2, 2), (2, 0.1)]
    door = [(0.6, 0), (1.2, 0), (1.2, 1), (0.6, 1), (0.6, 0)]
    joints = [[(0, 1), (0.6, 1)], [(1.2, 1), (2, 1)], [(0.9, 1), (0.9, 2)]]
    named = work(ground, door, frame, *joints, layers=("GROUND", "Opening"))
    found = pattern_of(named)
    assert areas(found) == [0.6, 0.775, 0.9, 1.1]
    assert np.interp([0.0, 1.0, 1.5, 1.75, 2.0], *found.foot.T) == pytest.approx([0.0, 0.0, 0.0, 0.05, 0.1])
    made = polygonal_wall(found, depth=0.5)
    low = [b.id for b in made.assembly.blocks[1:] if b.vertices[:, 2].min() < 0.2]
    contacts = made.assembly.contacts
    assert int((contacts.a == 0).sum()) == 3  # the sloping piece and the level one of the right stone, and the left
    assert len(low) == 2
    with pytest.raises(InputError, match=r"^d.dxf: lines end freely at \(-1, 0\), \(2.5, 0.2\) m"):
        pattern_of(work(ground, door, frame, *joints))
    with pytest.raises(InputError, match=r"^d.dxf: the outline of an opening is open at \(0.6, 0\) m"):
        pattern_of(work(ground, door[:-1], frame, *joints, layers=("ground", "door")))


REFUSED = [
    ([*FOUR, [(1, 0.2), (1, 0.8)]], r"lines cross at \(1, 0.5\) m: .* break both there"),
    (
        [*FOUR, [(1, 0.5), (1, 0.75)], [(0.4, 0.2), (0.4, 0)]],
        r"lines end freely at \(0.4, 0.2\), \(1, 0.75\) m: .*snap",
    ),
    ([SQUARE[:-1]], r"has no closed face: lines end freely at \(0, 0\), \(0, 1\) m"),
    ([SQUARE, [(0.5, 0.2), (1, 0.2), (0.7, 0.8), (0.5, 0.2)], [(0, 0.1), (2, 0.1)]], "lies free within a stone"),
    ([[(0, 1), (1, 0), (2, 1), (0, 1)]], r"stands on the point \(1, 0\) m; draw the ground"),
    ([SQUARE, [(0, 0.5), (2, 0.5)], [(0, 0.504), (2, 0.504)]], "no thicker than the gaps"),
    ([SQUARE, [(3, 0), (4, 0), (4, 1), (3, 1), (3, 0)], [(2, 0.5), (3, 0.5)]], r"\(2.5, 0.5\) m have the same stone"),
]


@pytest.mark.parametrize(("lines", "says"), REFUSED)
def test_what_is_no_wall_is_refused_with_its_place(lines, says):
    with pytest.raises(InputError, match=rf"^d\.dxf: .*{says}") as refused:
        pattern_of(work(*lines))
    assert "\n" not in str(refused.value)


def test_ground_that_cannot_be_stood_on():
    for ground, says in (
        ([(0, 0), (2, 0), (2, -0.3)], r"the ground rises straight up at \(2, -0.3\) m"),
        ([(0, -0.1), (1, 0), (2, -0.1)], "no stone stands on the line of the ground"),
        ([(0, 0), (1, 0), (2, 0.0)], None),
    ):
        drawn = work(ground, *FOUR, layers=("ground",))
        if says is None:
            assert pattern_of(drawn).foot is None
        else:
            with pytest.raises(InputError, match=says):
                pattern_of(drawn)
    with pytest.raises(InputError, match="openings and no stones"):
        pattern_of(work(SQUARE, layers=("void",)))
    with pytest.raises(InputError, match="only the ground"):
        pattern_of(work([(0, 0), (2, 0)], layers=("ground",)))


@pytest.mark.parametrize("surface", [Plane(), Cylinder(3.0, 1.0), Sphere(-4.0, 10.0, 1.0)])
def test_joints_are_shared_on_any_surface(surface):
    """Hooked stones on curved faces: closed solids, and every inner edge of the drawing is a joint."""
    lines = [SQUARE, [(0, 0.5), (0.6, 0.5), (0.6, 0.3), (1.1, 0.3), (1.1, 0.6), (2, 0.6)],
             [(0.8, 0), (0.8, 0.3)], [(0.9, 0.3), (0.9, 1)], [(1.5, 0.6), (1.4, 1)]]  # fmt: skip
    made = polygonal_wall(pattern_of(work(*lines)), surface=surface, depth=0.3)
    cells = made.pattern.subdivision
    assert mesh_faults(made.assembly.mesh) == []
    inner = int((cells.side >= 0).all(axis=1).sum())
    below = int((cells.vertex[cells.edge][:, :, 1] == 0.0).all(axis=1).sum())
    assert (made.joints.joints, made.joints.short) == (inner + below, 0)
    assert cells.areas().sum() == pytest.approx(2.0, rel=1e-12)
    assert cyclopean.check(made).verdict == "stable"


BODY = """
<g id="joints" transform="translate(0,1000) scale(1,-1)">
  <path d="m0,0 h2000 v1000 H0 z M0,500 2000,500"/><polyline points="800,0 800,500"/>
  <line x1="1200" y1="500" x2="1200" y2="1000"/>
</g><text x="3">what the mason said</text><defs><path d="M0,0L9,9"/></defs>"""


@pytest.mark.parametrize(
    ("size", "units", "scale", "width"),
    [
        ('width="2000mm" height="1000mm" viewBox="0 0 2000 1000"', None, 1.0, 2.0),
        ('width="100mm" height="50mm" viewBox="0 0 2000 1000"', None, 20.0, 2.0),
        ('width="200cm" viewBox="0 0 2000 1000"', None, 1.0, 2.0),
        ('width="2000" height="1000"', "mm", 1.0, 2.0),
        ('viewBox="0 0 2000 1000"', "in", 0.01, 0.508),
    ],
)
def test_lengths_of_svg(size, units, scale, width):
    name = svg("a.svg", BODY, size)
    found = read_line_work(name, LineReading(units=units, scale=scale))
    pattern = pattern_of(found)
    assert pattern.settings.width == pytest.approx(width, rel=1e-12)
    assert len(pattern.subdivision) == 4
    assert any("1 text passed over" in note for note in pattern.notes)


def test_paths_of_svg_by_hand():
    """A stadium by arcs, its copy by cubic curves, a rounded rectangle: areas with pi; smooth handles are mirrored."""
    arcs = "M500,0 H1500 A500,500 0 0 1 1500,1000 H500 A500 500 0 01500,0 Z"
    svg("a.svg", f'<path d="{arcs}"/><path d="M700,0V1000"/>')
    found = pattern_of(read_line_work("a.svg", LineReading(deviation=1e-5)), 2e-3)
    assert sum(areas(found)) == pytest.approx(1.0 + math.pi / 4.0, abs=1e-4)
    svg("b.svg", '<rect x="0" y="0" width="2000" height="1000" rx="250"/><path d="M700,0V1000"/>')
    found = pattern_of(read_line_work("b.svg", LineReading(deviation=1e-5)), 2e-3)
    assert sum(areas(found)) == pytest.approx(2.0 - (4.0 - math.pi) / 16.0, abs=1e-4)
    svg("c.svg", '<path d="M0,1000 Q500,0 1000,1000 T2000,1000 V2000 H0 Z"/><path d="M1000,1000V2000"/>')
    parabolas = areas(pattern_of(read_line_work("c.svg", LineReading(deviation=1e-5)), 2e-3))
    assert parabolas == pytest.approx([2.0 / 3.0, 4.0 / 3.0], abs=1e-4)  # a third of a square metre above, and below
    svg("d.svg", '<path d="M0,0 C0,500 500,500 500,1000 S900,1500 1000,2000"/>'
                 '<path d="m0,0c0,500 500,500 500,1000c0,500 400,500 500,1000"/>')  # fmt: skip
    smooth, spelt = read_line_work("d.svg", LineReading()).lines
    assert smooth.point == pytest.approx(spelt.point, abs=1e-9)


@pytest.mark.parametrize(
    ("large", "sweep", "middle"),
    [(0, 1, (0.5, 0.5)), (0, 0, (1.5, 1.5)), (1, 1, (1.5, 1.5)), (1, 0, (0.5, 0.5))],
)
def test_arcs_of_svg_by_hand(large, sweep, middle):
    """From (1.5, 0.5) to (0.5, 1.5), radius 1: about one centre or the other, the short way or the long one."""
    svg("a.svg", f'<path d="M1500,500 A1000,1000 0 {large}{sweep} 500,1500"/>')
    (line,) = read_line_work("a.svg", LineReading(deviation=1e-4)).lines
    off = line.point / 1000.0 * [1, -1] - middle
    assert np.hypot(*off.T) == pytest.approx(1.0, abs=1e-12)
    turns = np.diff(np.unwrap(np.arctan2(off[:, 1], off[:, 0]))).sum()
    assert turns == pytest.approx((1 if sweep else -1) * (1.5 if large else 0.5) * math.pi, abs=1e-9)


def test_a_turned_ellipse_is_the_ellipse_turned():
    """An arc whose axes lie at 30 degrees, and one along the axes in a group that is turned by 30 degrees."""
    sin, cos = 0.5, math.sqrt(0.75)
    x, y = 1500 * cos - 400 * sin, 1500 * sin + 400 * cos
    svg("a.svg", f'<path d="M0,0 A1000,500 30 1 0 {x!r},{y!r}"/>'
                 '<g transform="rotate(30)"><path d="M0,0 A1000,500 0 1 0 1500,400"/></g>')  # fmt: skip
    one, other = read_line_work("a.svg", LineReading(deviation=1e-3)).lines
    assert one.point == pytest.approx(other.point, abs=1e-9)


BAD_SVG = [
    ("", "the file is empty"),
    ("hello", "is no SVG drawing, or a damaged one"),
    ("<html/>", "is XML, but no SVG drawing"),
    ('<svg xmlns="http://www.w3.org/2000/svg"/>', "holds no lines"),
    ('<svg><path d="M0,0L1"/></svg>', "<path>: its path breaks off at 'M0,0L1'"),
    ('<svg><path id="bed" d="L0,0"/></svg>', "<path 'bed'>: its path has a wrong command 'L'"),
    ('<svg><path d="M0,0 1,1" transform="turn(3)"/></svg>', "its transform 'turn(3)' is not one of SVG"),
    ('<svg><rect width="9%" height="1"/></svg>', "width '9%' is not a number"),
    ('<svg><path d="M0,0 1e308,9e307L1e400,0"/></svg>', "not finite or far too large"),
    ('<svg><path d="M0,0H3000V2000Z"/></svg>', "does not say its units, and in metres it is 3.61e+03 m across"),
]


@pytest.mark.parametrize(("text", "says"), BAD_SVG)
def test_svg_that_is_none_is_one_line(text, says):
    Path("bad.svg").write_text(text)
    with pytest.raises(InputError) as refused:
        read_line_work("bad.svg", LineReading())
    assert str(refused.value).startswith("bad.svg: ")
    assert says in str(refused.value)


def test_the_command(run):
    svg("wall.svg", BODY)
    status, out, err = run("make", "polygonal", "--drawing", "wall.svg", "--depth", "0.4", "--out", "w.json")
    assert status == 0
    assert "polygonal wall of 4: 5 blocks, 4 of them free, 7 contacts" in out
    assert "1 text passed over" in err
    assert run("check", "w.json")[1].startswith("Stands")
    status, out, _ = run("sequence", "w.json", "--out", "s.json")
    assert (status, json.loads(Path("s.json").read_text())["stages"]["stable"]) == (0, 4)
    status, out, _ = run("make", "polygonal", "--drawing", "wall.svg", "--surface", "cylinder:4", "--out", "c.json")
    assert (status, "joints" in out) == (0, True)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--columns", "4"], "--columns: is of a pattern from seeds"),
        (["--opening", "1,0,1,1"], "--opening: is of a pattern from seeds"),
        (["--corner", "2"], "--corner: is not for a drawing"),
        (["--improve", "J"], "--improve: is not for a drawing"),
        (["--units", "m"], "says that its units are mm; leave out --units m"),
        (["--snap", "0"], "--snap 0: expected a positive length"),
        (["--deviation", "1"], "--deviation 1: at least"),
        (["--layer", "beds"], "has no lines on a layer 'beds'; it has 'joints'"),
        (["--display", "wall.svg"], "this is the input file"),
    ],
)
def test_the_command_refuses_in_one_line(run, words, says):
    svg("wall.svg", BODY)
    before = Path("wall.svg").read_bytes()
    status, out, err = run("make", "polygonal", "--drawing", "wall.svg", "--out", "w.json", *words)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert says in err
    assert not Path("w.json").exists()
    assert Path("wall.svg").read_bytes() == before


def test_options_of_a_drawing_need_one(run):
    status, _, err = run("make", "polygonal", "--snap", "0.01", "--out", "w.json")
    assert (status, err) == (2, "cyclopean: error: --snap: is of a drawing of joints; give --drawing too\n")
    for name, says in (("a.pdf", "is no drawing of lines by its ending"), ("none.svg", "no such file")):
        status, _, err = run("make", "polygonal", "--drawing", name, "--out", "w.json")
        assert (status, says in err) == (2, True)


def test_stones_lie_as_they_are_drawn_unless_beds_are_asked_for():
    """A stone with a bed of 45 degrees stays so; with `max_bed` its corners move."""
    lines = [SQUARE, [(0, 0.3), (0.7, 0.7), (1.3, 0.3), (2, 0.7)], [(0.7, 0.7), (0.7, 1)]]
    svg("a.svg", "".join(f'<polyline points="{" ".join(f"{1000 * x:g},{-1000 * y:g}" for x, y in line)}"/>'
                         for line in lines))  # fmt: skip
    as_drawn = cyclopean.polygonal_wall(drawing="a.svg")
    assert as_drawn.pattern.subdivision.vertex[:, 1].max() == 1.0
    assert [0.7, 0.7] in as_drawn.pattern.subdivision.vertex.round(12).tolist()
    flat = cyclopean.polygonal_wall(drawing="a.svg", max_bed=20.0, courses=2)
    assert flat.pattern.settings.courses == 2
    assert flat.pattern.settings.max_bed == 20.0
    with pytest.raises(InputError, match=r"^columns: is of a pattern"):
        cyclopean.polygonal_wall(drawing="a.svg", columns=3)
    with pytest.raises(InputError, match="improve"):
        cyclopean.polygonal_wall(drawing="a.svg", improve=True)


def test_snap_is_a_share_of_a_stone():
    """Four stones on 2 x 1 m have 9 m of line; a wall ten times as long, of stones alike, has the same snap."""
    assert usual_snap(work(*FOUR)) == pytest.approx(0.01 * 2.0 * 2.0 / 9.0)
    level = [[(0, y), (n, y)] for n in (30,) for y in range(4)]
    upright = [[(x, 0), (x, 3)] for x in range(31)]
    assert usual_snap(work(*level, *upright)) == pytest.approx(0.01 * 180.0 / 213.0)
    assert usual_snap(work([(0, 0), (1, 0)])) > 0.0


def test_the_file_keeps_how_the_wall_was_drawn(run):
    """Cells instead of seeds: the same blocks again, no other wall; there are no seeds to negotiate with."""
    lines = [SQUARE, [(0, 0.5), (0.6, 0.5), (0.6, 0.3), (2, 0.3)], [(0.9, 0.3), (0.9, 1)]]
    ground = work([(-1, -0.5), (1, 0), (3, 0.5)], *lines[1:], [(0, -0.25), (0, 1), (2, 1), (2, 0.25)],
                  layers=("ground",))  # fmt: skip
    made = polygonal_wall(pattern_of(ground), surface=Cylinder(4.0, 1.0))
    cyclopean.save(made, "w.json")
    again, notes = read_drawing("w.json")
    assert notes == ()
    assert again.assembly.mesh.vertex.tolist() == made.assembly.mesh.vertex.tolist()
    assert again.pattern.foot.tolist() == made.pattern.foot.tolist()
    run("make", "stones", "--count", "4", "--out", "s.obj")
    status, _, err = run("match", "s.obj", "w.json", "--negotiate", "1", "--out", ".")
    assert status == 2
    assert "was not drawn from seeds" in err
    document = json.loads(Path("w.json").read_text())
    for key, value, says in (
        ("rings", [[0, 1, 99]], "rings"),
        ("rings", [document["drawing"]["cells"]["rings"][0][::-1]], "runs clockwise"),
        ("foot", [[0, 0], [0, 1]], "each to the right of the last"),
        ("more", 1, "unknown key"),
    ):
        drawing = document["drawing"] | {"cells": document["drawing"]["cells"] | {key: value}}
        with pytest.raises(InputError, match=says):
            wall_of(drawing)
