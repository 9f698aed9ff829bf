"""Bodies of other libraries given to `check` and its like: trimesh, COMPAS, pairs of vertices and faces.

By hand: a cube of 1 m on a larger one that is held stands; turned out to the edge by more than half, it falls.
"""

import math

import numpy as np
import pytest
import trimesh
from compas.datastructures import Assembly as CompasAssembly
from compas.datastructures import Mesh, Part
from compas.geometry import Box, Cylinder, Frame
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from cyclopean.io.python_bodies import read_bodies
from laws import examples

FOOT, HEAD = (2.0, 0.0), (1.0, 1.5)  # side and height of the middle


def as_trimesh(side, height, x=0.0):
    mesh = trimesh.creation.box((side, side, side))
    mesh.apply_translation((x, 0, height))
    return mesh


def as_box(side, height, x=0.0):
    return Box(side, side, side, Frame([x, 0, height], [1, 0, 0], [0, 1, 0]))


def as_mesh(side, height, x=0.0):
    return Mesh.from_shape(as_box(side, height, x))


def as_pair(side, height, x=0.0):
    vertices, faces = as_box(side, height, x).to_vertices_and_faces()
    return [list(point) for point in vertices], faces


def as_arrays(side, height, x=0.0):
    mesh = as_trimesh(side, height, x)
    return np.array(mesh.vertices), np.array(mesh.faces, np.uint32)


MAKERS = [as_trimesh, as_box, as_mesh, as_pair, as_arrays]


@pytest.mark.parametrize("make", MAKERS)
def test_every_kind_stands_and_falls_alike(make):
    result = cyclopean.check([make(*FOOT), make(*HEAD)], mu=0.7)
    assert (result.verdict, [b.id for b in result.assembly.blocks]) == ("stable", ["b0", "b1"])
    assert cyclopean.check((make(*FOOT), make(*HEAD, 1.2)), mu=0.7).verdict == "unstable"
    found = cyclopean.limit({"foot": make(*FOOT), "head": make(*HEAD)}, tilt=0.0, mu=0.7)
    assert [b.id for b in found.assembly.blocks] == ["foot", "head"]


@settings(max_examples=examples(60))
@given(
    st.lists(st.tuples(st.sampled_from(MAKERS), st.floats(0.1, 3), st.floats(-9, 9)), min_size=1, max_size=5),
    st.sampled_from(["m", "mm", "in"]),
)
def test_law_of_kinds(rows, unit):
    """Whatever the kinds are, so many blocks with those volumes and middles, in metres."""
    found, _ = read_bodies({f"s{k}": make(side, height, 20.0 * k) for k, (make, side, height) in enumerate(rows)}, unit)
    metre = {"m": 1.0, "mm": 1e-3, "in": 0.0254}[unit]
    assert [b.id for b in found.blocks] == [f"s{k}" for k in range(len(rows))]
    np.testing.assert_allclose(found.mass.volume, [(side * metre) ** 3 for _, side, _ in rows], rtol=1e-9)
    heights = [height * metre for _, _, height in rows]
    np.testing.assert_allclose(found.mass.centroid[:, 2], heights, atol=1e-9)


def test_one_mesh_alone_is_split_into_its_pieces():
    soup = trimesh.util.concatenate([as_trimesh(*FOOT), as_trimesh(*HEAD)])
    assert cyclopean.check(soup, mu=0.7).verdict == "stable"


def test_models_of_compas_are_read_as_its_files():
    assembly = CompasAssembly()
    for k, mesh in enumerate((as_mesh(*FOOT), as_mesh(*HEAD))):
        key = assembly.add_part(Part(name=f"p{k}"))
        assembly.graph.node_attributes(key, ["block", "is_support"], [mesh, k == 0])
    found, _ = read_bodies(assembly, "mm")
    assert [b.fixed for b in found.blocks] == [True, False]
    assert found.mass.volume.tolist() == pytest.approx([8e-9, 1e-9])


class Support(Box):
    """A body that says it is held, as elements of compas_dem do."""

    is_support = True


def test_what_says_that_it_is_held_is_held():
    found, _ = read_bodies([Support(1.0), as_box(1.0, 1.0)])
    assert [b.fixed for b in found.blocks] == [True, None]
    assert math.isclose(found.mass.volume.sum(), 2.0)


@pytest.mark.parametrize(
    ("bodies", "line"),
    [
        ([], "model: holds no bodies; a model needs at least one closed mesh"),
        ([as_box(1, 0), "wall.obj"], r"model\[1\]: expected a file, .*; got str"),
        ({"a": as_box(1, 0), "b": ([[0, 0, 0]], 3)}, "model: 'b': expected a file, .*; got tuple"),
        ([([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 7]])], "model: face 0 names vertex 7, but the vertices are 0..2"),
        ([([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 1.5]])], "model: face 0 names a vertex by .*; expected whole"),
        ([([[0, 0, math.nan], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])], "model: vertex 0, coordinate 2 is not a finite"),
        (3, "model: expected a file, .*; got int"),
        (Cylinder(1, 2).frame, "model: holds no blocks: it is 1 Frame; expected COMPAS meshes"),
    ],
    ids=str,
)
def test_refusals(bodies, line):
    with pytest.raises(cyclopean.InputError, match=f"^{line}"):
        cyclopean.check(bodies)
    with pytest.raises(cyclopean.InputError, match="'ell' is not a unit"):
        cyclopean.check([as_box(1, 0)], units="ell")
