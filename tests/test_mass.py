"""Mass properties by hand: a box of 2 x 1 x 3 m has 6 m3 and, about its centre, Ixx = 6 (1 + 9) / 12 = 5 m5.

Integrated about a local origin they stay so 10 km away, where raw coordinates lose a fifth of the inertia.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.errors import InputError
from cyclopean.geometry import frames_from_normals, mass_properties, mesh_faults, pack

BOX = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 3], [2, 0, 3], [2, 1, 3], [0, 1, 3]], float)
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


@pytest.mark.parametrize("away", [0.0, 1e4])
def test_a_box_by_hand(away: float) -> None:
    found = mass_properties(pack([(BOX + away, FACES)]))
    assert found.volume[0] == pytest.approx(6.0, rel=1e-11)
    assert found.centroid[0] == pytest.approx(np.array([1, 0.5, 1.5]) + away, rel=1e-12)
    assert np.diag(found.inertia[0]) == pytest.approx([5.0, 6.5, 2.5], rel=1e-9)
    assert np.abs(found.inertia[0] - np.diag(np.diag(found.inertia[0]))).max() < 1e-9


def test_an_inverted_mesh_has_negative_volume_and_is_told() -> None:
    turned = pack([(BOX, [f[::-1] for f in FACES]), (BOX, FACES[1:]), (BOX * [1, 1, 0], FACES), (BOX, FACES)])
    assert mass_properties(turned).volume[0] == pytest.approx(-6.0)
    assert [(i, text.split(":")[0]) for i, text in mesh_faults(turned)] == [
        (0, "is inside out"),
        (1, "is open"),
        (2, "has zero volume"),
    ]


def test_faces_that_name_no_vertex_are_refused() -> None:
    with pytest.raises(InputError, match="names vertex 8"):
        pack([(BOX, [(0, 1, 8)])])


@given(seed=st.integers(0, 1000))
def test_frames_are_right_handed(seed: int) -> None:
    normal = np.random.default_rng(seed).standard_normal((5, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    frame = frames_from_normals(normal)
    assert np.abs(frame @ frame.transpose(0, 2, 1) - np.eye(3)).max() < 1e-12
    assert np.linalg.det(frame) == pytest.approx(np.ones(5))
    assert np.abs(frame[:, 0] - normal).max() == 0.0
