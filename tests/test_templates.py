"""Parametric models: volumes by hand, joints counted, every contact exactly on the faces of its two blocks.

By hand:
- a wall of 10 x 10 on a slab has 5 x 10 + 5 x 11 blocks, 10 feet, 5 x 9 + 5 x 10 head joints and 9 x 20 bed pieces;
- a vault or arch of n straight voussoirs has n d (R^2 - r^2) sin(pi / n) / 2 of stone;
- a dome of chords: a shell between two radii is (R^3 - r^3) / 3 times the figure of the unit sphere, here a stack of
  frusta over a regular polygon of 2 s corners, (2 s / 2) sin(pi / s) (q^2 + q Q + Q^2) h / 3 each, minus what
  lies under the cones of its two rims;
- a semicircular arch of 20 voussoirs, R to the centre line, stands from t / R = 0.10746 on (true centroids).
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.assembly.detection import detect
from cyclopean.design import arch, dome, stack, vault, wall
from cyclopean.errors import InputError
from cyclopean.geometry import face_normals, mesh_faults, newell_normals

ROUNDING = 1e-13  # of the model's size: a few operations in double precision

MODELS = {
    "stack": lambda: stack(4, (1.0, 2.0, 0.5), offset=0.2),
    "stack on a slope": lambda: stack(3, offset=[0.1, -0.3, 0.4], slope=25.0),
    "stack without ground": lambda: stack(3, offset=0.25, ground=False),
    "wall": lambda: wall(3, 4),
    "wall on a course": lambda: wall(3, 4, ground="course", mu=0.7, density=2500.0),
    "arch": lambda: arch(11),
    "segmental arch": lambda: arch(7, span=4.0, rise=0.8, thickness=0.4, facets=5),
    "arch, fixed voussoirs": lambda: arch(20, springers="fixed", thickness=0.5),
    "vault": lambda: vault(9, 4),
    "vault, one column": lambda: vault(9, 1),
    "dome": lambda: dome(6, 10),
    "dome of three": lambda: dome(2, 3, oculus=40.0),
}


@pytest.fixture(params=sorted(MODELS))
def model(request):
    return MODELS[request.param]()


def distance_to_face(point, mesh, body):
    """Smallest distance of (m, 3) points from the convex faces of one body, all of them on one face."""
    best = np.inf
    normals = face_normals(mesh)
    for f in range(mesh.face_start[body], mesh.face_start[body + 1]):
        corner = mesh.vertex[mesh.corner[mesh.corner_start[f] : mesh.corner_start[f + 1]]]
        n = normals[f] / np.linalg.norm(normals[f])
        off = np.abs((point - corner[0]) @ n)
        edge = np.roll(corner, -1, axis=0) - corner
        inward = np.cross(n, edge) / np.linalg.norm(edge, axis=1)[:, None]
        out = np.maximum(-np.einsum("ei,epi->ep", inward, point[None] - corner[:, None]), 0.0)
        best = min(best, max(off.max(), out.max()))
    return best


def test_every_mesh_is_closed_and_outward(model):
    assert mesh_faults(model.mesh) == []


def test_faces_and_contacts_are_flat_and_convex(model):
    mesh, contacts = model.mesh, model.contacts
    sets = [mesh.vertex[mesh.corner[i:j]] for i, j in zip(mesh.corner_start[:-1], mesh.corner_start[1:], strict=True)]
    for polygon in sets + [contacts.polygon(k) for k in range(len(contacts))]:
        n = newell_normals(polygon, np.array([0, len(polygon)]))[0]
        n /= np.linalg.norm(n)
        assert np.abs((polygon - polygon[0]) @ n).max() <= ROUNDING * model.size
        edge = np.roll(polygon, -1, axis=0) - polygon
        assert (np.cross(edge, np.roll(edge, -1, axis=0)) @ n > 0.0).all()


def test_contacts_lie_on_faces_of_both_blocks_and_point_from_a_to_b(model):
    contacts, mesh = model.contacts, model.mesh
    normal = contacts.frame[:, 0]
    face = face_normals(mesh)
    for k in range(len(contacts)):
        a, b = int(contacts.a[k]), int(contacts.b[k])
        for body, sense in ((a, 1.0), (b, -1.0)):
            assert distance_to_face(contacts.polygon(k), mesh, body) <= ROUNDING * model.size
            own = face[mesh.face_start[body] : mesh.face_start[body + 1]]
            unit = own / np.linalg.norm(own, axis=1)[:, None]
            assert (unit @ (sense * normal[k])).max() == pytest.approx(1.0, abs=1e-12)
        assert (model.mass.centroid[b] - model.mass.centroid[a]) @ normal[k] > 0.0


@pytest.mark.parametrize("name", ["arch", "segmental arch", "dome", "vault, one column"])
def test_contact_corners_are_block_corners_to_the_last_bit(name):
    model = MODELS[name]()
    for k in range(len(model.contacts)):
        for body in (model.contacts.a[k], model.contacts.b[k]):
            corners = set(map(tuple, model.blocks[body].vertices.tolist()))
            assert set(map(tuple, model.contacts.polygon(k).tolist())) <= corners


def test_every_block_says_whether_it_is_fixed(model):
    fixed = [b.fixed for b in model.blocks]
    assert True in fixed
    assert False in fixed
    assert None not in fixed


def test_ids_groups_and_supports():
    held = {b.id: b.group for b in arch(3).blocks if b.fixed}
    assert held == {"springer-left": "springers", "springer-right": "springers"}
    assert [b.id for b in arch(4, springers="fixed").blocks if b.fixed] == ["v01", "v04"]
    bond = wall(2, 2)
    assert [b.id for b in bond.blocks] == ["ground", "c01-b01", "c01-b02", "c02-b01", "c02-b02", "c02-b03"]
    assert [b.group for b in bond.blocks] == ["ground", "course-1", "course-1", "course-2", "course-2", "course-2"]
    assert dome(2, 4).blocks[-1].group == "course-2"
    assert vault(3, 2).blocks[3].group == "row-1"


def test_mu_and_density_are_said_only_when_asked():
    assert np.isnan(wall(2, 2).contacts.mu).all()
    assert {b.density for b in wall(2, 2).blocks} == {None}
    said = wall(2, 2, mu=0.6, density=2000.0)
    assert set(said.contacts.mu.tolist()) == {0.6}
    assert {b.density for b in said.blocks} == {2000.0}


def test_wall_by_hand():
    model = wall(10, 10, length=0.4, depth=0.2, height=0.3)
    assert (len(model), len(model.contacts)) == (106, 285)
    assert model.mass.volume[1:].sum() == pytest.approx(4.0 * 0.2 * 3.0, rel=1e-13)
    assert (len(wall(20, 20)), len(wall(20, 20).contacts)) == (411, 1170)
    own = wall(10, 10, ground="course")
    assert sum(b.fixed for b in own.blocks) == 10
    assert own.mesh.vertex[:, 2].min() == -0.2
    assert len(own.contacts) == 5 * 9 + 5 * 10 + 10 * 20 + 9
    assert own.contacts.area.min() == pytest.approx(0.2 * 0.2)


def test_contacts_are_those_that_detection_finds(model):
    found, own = detect(model).contacts, model.contacts
    assert list(zip(found.a, found.b, strict=True)) == list(zip(own.a, own.b, strict=True))
    assert found.area == pytest.approx(own.area, rel=1e-9)
    assert np.abs(found.frame[:, 0] - own.frame[:, 0]).max() <= 1e-9
    for k in range(len(own)):
        apart = np.linalg.norm(found.polygon(k)[:, None] - own.polygon(k)[None], axis=2)
        assert apart.min(axis=0).max() <= 1e-9 * model.size
        assert apart.min(axis=1).max() <= 1e-9 * model.size


@given(n=st.integers(2, 40), thickness=st.floats(0.05, 0.9), depth=st.floats(0.1, 5.0), facets=st.integers(1, 6))
@settings(deadline=None)
def test_arch_volume_by_hand(n, thickness, depth, facets):
    model = arch(n, radius=1.0, thickness=thickness, depth=depth, facets=facets)
    ring = (1.0 + thickness / 2.0) ** 2 - (1.0 - thickness / 2.0) ** 2
    by_hand = n * facets * depth * ring * np.sin(np.pi / (n * facets)) / 2.0
    assert model.mass.volume[1:-1].sum() == pytest.approx(by_hand, rel=1e-12)
    assert len(model.contacts) == n + 1
    assert model.contacts.area == pytest.approx(thickness * depth, rel=1e-12)


@given(span=st.floats(0.5, 50.0), part=st.floats(0.02, 1.0), n=st.integers(2, 60), share=st.floats(0.01, 0.5))
@settings(deadline=None)
def test_arch_has_the_span_and_rise_it_was_asked_for(span, part, n, share):
    rise = part * span / 2.0
    model = arch(2 * n, span=span, rise=rise, thickness=share * span)
    inner = model.contacts.point[:4], model.contacts.point[-4:]
    left, right = (quad[np.argmin(np.abs(quad[:, 0]))] for quad in inner)
    assert right[0] - left[0] == pytest.approx(span, rel=1e-12)
    assert [left[2], right[2]] == pytest.approx([0.0, 0.0], abs=1e-12 * (span + span / part))
    crown = model.contacts.polygon(n)  # the joint in the middle
    assert crown[:, 2].min() == pytest.approx(rise, abs=1e-12 * (span + span / part))
    assert crown[:, 2].max() - crown[:, 2].min() == pytest.approx(share * span, rel=1e-9)


def test_arch_of_a_clear_span_stands_on_thin_wedges():
    model = arch(20, thickness=0.5, depth=2.0, facets=3)
    left, right = model.contacts.polygon(0)[:, 0], model.contacts.polygon(20)[:, 0]
    assert sorted(left) == [-5.5, -5.5, -5.0, -5.0]
    assert sorted(right) == [5.0, 5.0, 5.5, 5.5]
    assert set(model.contacts.polygon(0)[:, 2].tolist()) == {0.0}
    wedge = 3 * 2.0 * (5.5**2 - 5.0**2) * np.sin(np.radians(6.0) / 3) / 2.0
    assert model.mass.volume[[0, -1]] == pytest.approx(wedge, rel=1e-12)


def test_facets_approach_the_annular_sector_quadratically():
    n, r, t = 8, 1.0, 0.3
    beta = np.pi / n
    out, inn = r + t / 2.0, r - t / 2.0
    true = 2.0 / 3.0 * (out**3 - inn**3) / (out**2 - inn**2) * np.sin(beta / 2.0) / (beta / 2.0)
    error = []
    for k in (4, 8, 16):
        found = arch(n, radius=r, thickness=t, facets=k).mass.centroid[1:-1]
        error.append(np.abs(np.hypot(found[:, 0], found[:, 2]) - true).max())
    assert error[0] / error[1] == pytest.approx(4.0, rel=0.05)
    assert error[1] / error[2] == pytest.approx(4.0, rel=0.05)


def stands(model, mu=2.0):
    """In-plane equilibrium with friction as a linear programme: two forces (fx, fz) at every joint's y = 0 edge."""
    from scipy.optimize import linprog

    contacts, mass = model.contacts, model.mass
    free = [i for i, b in enumerate(model.blocks) if not b.fixed]
    row = {block: 3 * k for k, block in enumerate(free)}
    edges = [
        (k, p) for k in range(len(contacts)) for p in contacts.polygon(k) if p[1] == 0.0
    ]  # the other edge carries the same by symmetry
    matrix, cone = np.zeros((3 * len(free), 2 * len(edges))), np.zeros((2 * len(edges), 2 * len(edges)))
    for j, (k, p) in enumerate(edges):
        n, t = contacts.frame[k, 0], np.cross(contacts.frame[k, 0], [0.0, 1.0, 0.0])
        cone[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = [[-mu, 1.0], [-mu, -1.0]]
        for block, sign in ((contacts.b[k], 1.0), (contacts.a[k], -1.0)):
            if int(block) in row:
                arm = p - mass.centroid[block]
                for column, push in ((2 * j, n), (2 * j + 1, t)):
                    moment = arm[2] * push[0] - arm[0] * push[2]
                    matrix[row[int(block)] : row[int(block)] + 3, column] = sign * np.array([push[0], push[2], moment])
    load = np.zeros(3 * len(free))
    load[1::3] = mass.volume[free] / mass.volume[free].mean()
    bounds = [(0.0, None), (None, None)] * len(edges)
    answer = linprog(np.zeros(2 * len(edges)), cone, np.zeros(2 * len(edges)), matrix, load, bounds, method="highs")
    return answer.status == 0


def test_minimum_thickness_of_the_semicircular_arch():
    """Textbook: t / R = 0.10746 for 20 voussoirs, R to the centre line, with the centroids of true annular sectors."""
    low, high = 0.10, 0.115
    while high - low > 2e-6:
        middle = (low + high) / 2.0
        if stands(arch(20, radius=1.0, thickness=middle, facets=32)):
            high = middle
        else:
            low = middle
    assert high == pytest.approx(0.10746, abs=1e-5)


def test_vault_by_hand():
    model = vault(12, 5, radius=3.0, thickness=0.4, length=7.0)
    free = np.array([not b.fixed for b in model.blocks])
    by_hand = 12 * 7.0 * (3.2**2 - 2.8**2) * np.sin(np.pi / 12) / 2.0
    assert model.mass.volume[free].sum() == pytest.approx(by_hand, rel=1e-12)
    # rows alternate 5, 6 ... blocks, springers included; 13 bed joints of 10 pieces, and head joints
    assert free.sum() == 6 * 6 + 6 * 5
    assert len(model.contacts) == 13 * 10 + 7 * 5 + 7 * 4
    between = free[model.contacts.a] | free[model.contacts.b]
    assert model.contacts.area[between].sum() == pytest.approx(
        13 * 7.0 * 0.4 + 54 * (3.2**2 - 2.8**2) * np.sin(np.pi / 12) / 2.0, rel=1e-12
    )


def test_dome_by_hand():
    courses, segments, oculus = 5, 7, 20.0
    model = dome(courses, segments, radius=2.0, thickness=0.5, oculus=oculus)
    free = np.array([not b.fixed for b in model.blocks])
    assert free.sum() == courses * segments
    assert len(model.contacts) == courses * 2 * segments + (courses + 1) * segments
    level = np.radians(np.linspace(0.0, 90.0 - oculus, courses + 1))
    q, z = np.cos(level), np.sin(level)
    polygon = segments * np.sin(np.pi / segments)  # area of the 2 s-gon in the unit circle
    frusta = (polygon * (q[:-1] ** 2 + q[:-1] * q[1:] + q[1:] ** 2) * np.diff(z) / 3.0).sum()
    unit = frusta - polygon * q[-1] ** 2 * z[-1] / 3.0  # the shell's cone from the centre, without that to the oculus
    assert model.mass.volume[free].sum() == pytest.approx(unit * (2.25**3 - 1.75**3), rel=1e-12)


def test_stack_by_hand():
    model = stack(3, (1.0, 2.0, 0.5), offset=0.25)
    assert model.mass.volume[1:] == pytest.approx([1.0] * 3)
    assert model.mass.centroid[:, 0] == pytest.approx([0.5, 0.5, 0.75, 1.0])
    assert model.contacts.area == pytest.approx([2.0, 1.5, 1.5])
    lean = stack(1, slope=30.0)
    assert lean.contacts.frame[0, 0] == pytest.approx([0.5, 0.0, np.sqrt(0.75)])  # the ground falls towards +x


@pytest.mark.parametrize(
    ("make", "option"),
    [
        (lambda: stack(0), "count"),
        (lambda: stack(2, (1.0, -1.0, 1.0)), "size"),
        (lambda: stack(2, (1.0, 1.0)), "size"),
        (lambda: stack(2, offset=1.0), "offset"),
        (lambda: stack(2, offset=[0.1]), "offset"),
        (lambda: stack(2, offset=float("nan")), "offset"),
        (lambda: stack(2, slope=90.0), "slope"),
        (lambda: stack(1, ground=False), "count"),
        (lambda: wall(0, 3), "columns"),
        (lambda: wall(3, 0), "courses"),
        (lambda: wall(3, 3, length=0.0), "length"),
        (lambda: wall(3, 3, ground="sand"), "ground"),
        (lambda: wall(3, 3, mu=-0.1), "mu"),
        (lambda: wall(3, 3, density=0.0), "density"),
        (lambda: arch(0), "voussoirs"),
        (lambda: arch(2, springers="fixed"), "voussoirs"),
        (lambda: arch(1), "voussoirs"),
        (lambda: arch(5, springers="none"), "springers"),
        (lambda: arch(5, thickness=-1.0), "thickness"),
        (lambda: arch(5, radius=1.0, thickness=1.0), "thickness"),
        (lambda: arch(5, radius=1.0, span=2.0), "radius"),
        (lambda: arch(5, span=2.0, rise=1.01), "rise"),
        (lambda: arch(5, span=float("inf")), "span"),
        (lambda: arch(5, facets=0), "facets"),
        (lambda: vault(1, 3), "voussoirs"),
        (lambda: vault(5, 0), "columns"),
        (lambda: vault(5, 3, thickness=2.0), "thickness"),
        (lambda: vault(5, 3, length=-2.0), "length"),
        (lambda: dome(0, 8), "courses"),
        (lambda: dome(3, 2), "segments"),
        (lambda: dome(3, 8, oculus=0.0), "oculus"),
        (lambda: dome(3, 8, thickness=1.5), "thickness"),
        (lambda: dome(3, 8, radius=0.0), "radius"),
    ],
)
def test_what_cannot_be_built_is_refused_by_the_name_of_the_option(make, option):
    with pytest.raises(InputError, match=rf"\b{option}\b"):
        make()
