"""Walls on meshes: laws of flat and round ones, sizes on the surface, folds with their place, and what is refused."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from cyclopean.design.walls.mapped import mapped
from cyclopean.design.walls.openings import Opening
from cyclopean.design.walls.pattern import PatternSettings, draw_pattern
from cyclopean.design.walls.polygonal import polygonal_wall, verdict
from cyclopean.design.walls.surfaces import Cylinder, Thickness
from cyclopean.errors import InputError
from cyclopean.geometry.unfolding import area_ratio, stretch, unfolded
from cyclopean.io import write_model
from cyclopean.io.drawings import drawing_dict, read_drawing
from cyclopean.io.surfaces import read_surface
from laws import examples

SMALL = {"columns": 5, "rows": 3}


def grid(point, along=24, up=12):
    """Corners and triangles of a surface over (0, 1) x (0, 1), counter-clockwise seen from the front."""
    t, s = np.meshgrid(np.linspace(0, 1, up + 1), np.linspace(0, 1, along + 1), indexing="ij")
    first = (np.arange(up)[:, None] * (along + 1) + np.arange(along)).ravel()
    below = np.stack([first, first + 1, first + along + 2], 1)
    above = np.stack([first, first + along + 2, first + along + 1], 1)
    corners = np.stack(np.broadcast_arrays(*point(s.ravel(), t.ravel())), 1).astype(float)
    return corners, np.concatenate([below, above])


def flat(s, t):
    return 3.0 * s, 0.0, 1.8 * t


def dome(radius=4.0, half=0.5, top=0.5):
    def point(s, t):
        east, north = half * (2 * s - 1), top * t
        return (
            radius * np.cos(north) * np.sin(east),
            -radius * np.cos(north) * np.cos(east),
            radius * np.sin(north),
        )

    return grid(point)


def gable():
    """3 m wide and 1.2 m high, under a ridge of 2 m; in the plane y = 0."""
    corner = np.array([[0, 0, 0], [3, 0, 0], [3, 0, 1.2], [1.5, 0, 2.0], [0, 0, 1.2], [1.5, 0, 0.6]])
    return corner, [(0, 1, 5), (1, 2, 5), (2, 3, 5), (3, 4, 5), (4, 0, 5)]


def obj(path, corners, faces, scale=1.0):
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in (scale * np.asarray(corners)).tolist()]
    path.write_text("\n".join([*rows, *("f " + " ".join(str(k + 1) for k in face) for face in faces)]) + "\n")
    return path


def turn(axis, angle):
    a, b = [k for k in range(3) if k != axis]
    made = np.eye(3)
    made[a, a] = made[b, b] = np.cos(angle)
    made[a, b], made[b, a] = -np.sin(angle), np.sin(angle)
    return made


@settings(max_examples=examples(8))
@given(
    heading=st.floats(0, 6.28), lean=st.floats(-1.2, 1.2), roll=st.floats(-0.7, 0.7), shift=st.floats(-1e3, 1e3),
    seed=st.integers(0, 99),
)  # fmt: skip
def test_a_flat_mesh_gives_the_wall_of_a_plane(heading, lean, roll, shift, seed) -> None:
    """Whichever way it stands, up to its own frame: the same stones with the same corners."""
    corners, triangles = grid(flat)
    frame = turn(2, heading) @ turn(0, lean) @ turn(1, roll)
    wall = PatternSettings(seed=seed, max_bed=90.0, **SMALL)  # whether a bed is level depends on how it stands
    made = polygonal_wall(wall, surface=mapped(corners @ frame.T + shift, triangles))
    wanted = polygonal_wall(wall)
    assert len(made.assembly) == len(wanted.assembly)
    for one, other in zip(made.assembly.blocks[1:], wanted.assembly.blocks[1:], strict=True):
        assert np.abs((one.vertices - shift) @ frame - other.vertices).max() < 1e-8


def test_a_round_mesh_gives_nearly_the_wall_of_a_cylinder() -> None:
    """Facets of 3 m / 48 on a radius of 2.5 m lie at most h^2 / 8 R = 0.2 mm off it, their normals nearly as little."""
    corners, triangles = grid(
        lambda s, t: (2.5 * np.sin(1.2 * s - 0.6), 2.5 - 2.5 * np.cos(1.2 * s - 0.6), 1.8 * t), 48
    )
    sheet = mapped(corners, triangles)
    # the mesh is as wide as its chords, 3 cos(...): 0.02 mm less than the arc
    assert (sheet.width, sheet.height) == pytest.approx((3.0, 1.8), abs=1e-3)
    assert sheet.stretch == pytest.approx((1.0, 1.0), abs=1e-9)
    made = polygonal_wall(PatternSettings(), surface=sheet, depth=0.3)
    wanted = polygonal_wall(PatternSettings(), surface=Cylinder(2.5, 1.5), depth=0.3)
    assert len(made.assembly) == len(wanted.assembly)
    for one, other in zip(made.assembly.blocks, wanted.assembly.blocks, strict=True):
        assert np.abs(one.vertices + np.array([1.5, 0, 0]) - other.vertices).max() < 5e-4
    # a mean of the facets round a corner leans by h / 2 R = 0.0125 at the ends
    exact = (corners - [0, 2.5, 0]) / [2.5, 2.5, np.inf]
    assert np.linalg.norm(sheet.normal - exact, axis=1).max() < 1e-4


def test_stones_are_as_large_on_the_surface_as_asked() -> None:
    """A dome that is stretched by a fifth: areas on it vary far less than if the plane alone were divided evenly."""
    sheet = mapped(*dome(3.0, 1.2, 1.2))
    assert sheet.stretch[1] / sheet.stretch[0] > 1.2
    drawn = sheet.fitted(
        PatternSettings(columns=14, rows=8, size_grade=0.0, lloyd=5, coursing=0.0, sliver=0.1, max_bed=90.0)
    )
    spread = []
    for ratio in (sheet.area_ratio, None):
        cells = draw_pattern(drawn, ratio).subdivision
        area = cells.areas() * sheet.area_ratio(cells.centroids())
        spread.append(area.std() / area.mean())
    assert spread[0] < 0.6 * spread[1]


def cap(reach):
    """Of a sphere of 1 m, so many radians from its top to its edge."""
    r, way = np.meshgrid(np.linspace(0.1, 1, 10) * reach, np.arange(40) * (np.pi / 20), indexing="ij")
    around = np.stack([np.sin(r) * np.cos(way), np.sin(r) * np.sin(way), np.cos(r)], -1).reshape(-1, 3)
    first, j = np.arange(9)[:, None] * 40, np.arange(40)
    a, b = (first + j).ravel(), (first + (j + 1) % 40).ravel()
    top = np.stack([np.full(40, 400), j, (j + 1) % 40], 1)
    sides = np.stack([a, a + 40, b + 40], 1), np.stack([a, b + 40, b], 1)
    return np.concatenate([around, [[0.0, 0, 1]]]), np.concatenate([*sides, top])


def test_a_cap_laid_flat_keeps_its_area() -> None:
    """To second order: a cap of 0.5 rad by hand 2 pi (1 - cos 0.5) = 0.769 m2; nothing is turned over."""
    corners, faces = cap(0.5)
    place = unfolded(corners, faces)
    each = stretch(corners, place, faces)
    assert 0.9 < each.min() < 1.0 < each.max() < 1.1
    x, y = place[faces].transpose(2, 1, 0)
    flat_area = ((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])) / 2.0
    assert flat_area.sum() == pytest.approx(0.769, rel=0.02)
    assert (flat_area * area_ratio(corners, place, faces)).sum() == pytest.approx(0.769, rel=0.01)


def test_a_wall_has_the_outline_of_its_mesh(tmp_path) -> None:
    """A gable of 3 x 1.2 m under a ridge at 2 m: 4.8 m2, on a level foot; a model file keeps all that."""
    made = polygonal_wall(PatternSettings(**SMALL, openings=(Opening(1.0, 0.6, 0.9),)), surface=mapped(*gable()))
    cells = made.pattern.subdivision
    assert cells.areas().sum() == pytest.approx(4.8 - 0.54, abs=1e-9)
    assert made.pattern.readout.coverage == pytest.approx(1.0, abs=1e-9)
    assert np.all(cells.vertex[:, 1] <= 2.0 - np.abs(cells.vertex[:, 0] - 1.5) * 0.8 / 1.5 + 1e-9)
    assert made.pattern.foot is None
    assert verdict(made.assembly) == "stable"
    write_model(tmp_path / "gable.json", made.assembly, drawing=drawing_dict(made))
    again, said = read_drawing(tmp_path / "gable.json")
    assert said == ()
    for one, other in zip(again.assembly.blocks, made.assembly.blocks, strict=True):
        assert np.array_equal(one.vertices, other.vertices)
    document = json.loads((tmp_path / "gable.json").read_text())
    document["drawing"]["surface"]["triangle"][0][0] = 99
    (tmp_path / "gable.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match="a triangle names a corner that is not there"):
        read_drawing(tmp_path / "gable.json")


def test_every_joint_is_shared_to_the_last_bit() -> None:
    """On a dome with folded joints the corners of each are corners of both stones."""
    made = polygonal_wall(PatternSettings(columns=7, rows=4), surface=mapped(*dome()), depth=0.4, warped="triangles")
    contacts = made.assembly.contacts
    corners = [set(map(tuple, block.vertices.tolist())) for block in made.assembly.blocks]
    for k in range(len(contacts)):
        ring = set(map(tuple, contacts.polygon(k).tolist()))
        assert ring <= corners[contacts.a[k]]
        assert ring <= corners[contacts.b[k]]
    assert made.pattern.readout.coverage == pytest.approx(1.0, abs=1e-9)


def test_a_surface_that_folds_under_the_thickness_is_refused_with_its_place() -> None:
    """A sphere folds at its radius: 3.9 m of 4 are allowed, 4.1 not; seen from inside any thickness is."""
    corners, triangles = dome()
    mapped(corners, triangles).refuse_folds(Thickness(3.9))
    with pytest.raises(InputError, match=r"radius of (3\.9|4)\d* m near \(.*, .*, .*\) m, not more .* depth 4\.1 m"):
        mapped(corners, triangles).refuse_folds(Thickness(4.1))
    mapped(corners, triangles[:, ::-1]).refuse_folds(Thickness(40.0))


def ring():
    """A tube: two boundaries."""
    corners, triangles = grid(lambda s, t: (np.sin(6.283185307179586 * s), -np.cos(6.283185307179586 * s), t))
    return corners.round(12), triangles


def holed():
    corners, triangles = grid(flat)
    return corners, np.delete(triangles, 100, axis=0)


def fin():
    """A third triangle on one side of a square."""
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1], [0.5, 1, 0.5]])
    return corner, [(0, 1, 2), (0, 2, 3), (0, 2, 4)]


TETRA = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
APART = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1], [5, 0, 0], [6, 0, 0], [5, 0, 1]]), [(0, 1, 2), (3, 4, 5)]


@pytest.mark.parametrize(
    ("mesh", "said"),
    [
        (ring, r"has 2 boundaries, two of them round \(.*\) and \(.*\); fill holes"),
        (holed, "has 2 boundaries"),
        (fin, r"has an edge with more than two faces near \(0\.5, 0, 0\.5\)"),
        (lambda: TETRA, "is closed; a wall needs an open face"),
        (lambda: APART, "is in 2 pieces"),
        (lambda: grid(lambda s, t: (s, t, 0.0)), "lies level on the whole"),
        (lambda: cap(2.9), "cannot be laid flat without stretching it more than 2 times"),
        (lambda: (TETRA[0], []), "has no faces"),
    ],
)
def test_what_is_no_sheet_is_refused(mesh, said) -> None:
    with pytest.raises(InputError, match=said):
        mapped(*mesh())


def test_surfaces_that_do_not_fit_their_options_are_refused(tmp_path) -> None:
    sheet = mapped(*gable())
    for wall, said in (
        (PatternSettings(width=2.0), "width: is that of the surface, 3 m"),
        (PatternSettings(base_radius=9.0), "base_radius: is of a wall with four square corners"),
        (PatternSettings(openings=(Opening(0.4, 0.6, 1.3),)), "leaves the outline of the wall"),
    ):
        with pytest.raises(InputError, match=said):
            polygonal_wall(wall, surface=sheet)
    point = np.array([[1.0, 0, 0], [2, 0, 1.5], [1, 0, 3], [0, 0, 1.5]])
    with pytest.raises(InputError, match="stands on a corner, at u = 1"):
        polygonal_wall(surface=mapped(point * [1, 1, 1.0], [(0, 1, 2, 3)]))
    drawing = tmp_path / "wide.svg"
    lines = "M 0,0 H 4000 V -1000 H 0 Z M 2000,0 V -1000"
    drawing.write_text(f'<svg xmlns="http://www.w3.org/2000/svg"><path d="{lines}"/></svg>')
    with pytest.raises(InputError, match=r"reaches 1 m beyond the surface at u = 4, v = 0 m; draw within 3 x 2 m"):
        cyclopean.polygonal_wall(drawing=drawing, units="mm", surface=sheet)


def test_files_say_what_is_wrong_with_them(tmp_path) -> None:
    """One line with the name of the file; a unit that nobody said is told, and refused where it cannot be."""
    sheet, notes = read_surface(obj(tmp_path / "a.obj", *grid(flat), 1000.0), "mm")
    assert sheet.width == pytest.approx(3.0)
    assert "a metre of the pattern is 1.000 to 1.000 m; its front looks along (0.00, -1.00, 0.00)" in notes[-1]
    with pytest.raises(InputError, match=r"does not say its units, and in metres it is 3\.5e"):
        read_surface(tmp_path / "a.obj")
    assert "metres assumed" in read_surface(obj(tmp_path / "b.obj", *gable()))[1][0]
    with pytest.raises(InputError, match=r"c\.obj: has 2 boundaries"):
        read_surface(obj(tmp_path / "c.obj", *holed()))
    with pytest.raises(InputError, match=r"d\.txt: is no surface by its ending; save it as \.3dm"):
        read_surface(tmp_path / "d.txt")


def test_a_face_of_a_3dm_is_sampled(tmp_path) -> None:
    """A quarter of a cylinder as NURBS, in millimetres: as long as its arc, to the deviation; faces are counted."""
    rhino = pytest.importorskip("rhino3dm")
    round_ = rhino.NurbsSurface.CreateRuledSurface(
        *(rhino.Arc(rhino.Circle(rhino.Point3d(0, 0, z), 2000.0), np.pi / 2).ToNurbsCurve() for z in (0.0, 1500.0))
    )

    def saved(name, *surfaces):
        file = rhino.File3dm()
        file.Settings.ModelUnitSystem = rhino.UnitSystem.Millimeters
        for one in surfaces:
            (file.Objects.AddBrep if isinstance(one, rhino.Brep) else file.Objects.AddSurface)(one)
        file.Objects.AddPoint(0.0, 0.0, 0.0)
        file.Write(str(tmp_path / name), 7)
        return tmp_path / name

    for one in (round_, rhino.Brep.CreateFromSurface(round_)):
        sheet, _ = read_surface(saved("one.3dm", one))
        assert (sheet.width, sheet.height) == pytest.approx((np.pi, 1.5), rel=1e-3)
        assert np.linalg.norm(sheet.vertex[:, :2], axis=1) == pytest.approx(2.0, abs=1e-9)
        assert (sheet.normal[:, :2] * sheet.vertex[:, :2]).sum(axis=1) == pytest.approx(2.0, abs=1e-3)
    with pytest.raises(InputError, match=r"two.3dm: holds 2 faces; a wall lies on one"):
        read_surface(saved("two.3dm", round_, round_))
    with pytest.raises(InputError, match=r"none.3dm: holds no surface and no mesh"):
        read_surface(saved("none.3dm"))
