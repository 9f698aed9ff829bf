"""What a model that stands has to spare, and the line of thrust.

By hand. A cube on a slope of angle theta needs mu = tan theta, whatever mu it has. In a stack of n cubes of side a,
each shifted by d against the one below, the k cubes above a joint have their centre (k - 1) d / 2 beyond that of the
lowest of them, and k d / 2 beyond the middle of the joint, which is a - d wide: shrunk to the share s it bears as long
as s (a - d) / 2 >= k d / 2. The lowest joint between cubes, k = n - 1, governs: s = (n - 1) d / (a - d).

An arch of t / R = 0.12 whose least t / R is 0.10746 may have its joints shrunk to 0.10746 / 0.12 of their size (its
weights stay where they are, which changes the ratio by less than a thousandth).

The two forces on a voussoir meet on the vertical through its centre of mass: three forces in balance meet in a point.
"""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from cyclopean.analysis import Settings, check
from cyclopean.analysis.preparation import prepare
from cyclopean.analysis.safety_margins import CLOSE, margins, shrunk
from cyclopean.assembly import Assembly, Block, Contacts
from cyclopean.design import arch, stack, wall
from cyclopean.view.figures import resultants
from cyclopean.view.thrust import thrust_line
from laws import examples


def of(assembly, **said):
    chosen = Settings(**said)
    return margins(prepare(assembly, chosen), chosen)


@pytest.mark.parametrize(("slope", "mu"), [(20.0, 0.7), (10.0, 0.3)])
def test_a_cube_on_a_slope_needs_the_tangent(slope, mu):
    found = of(stack(1), mu=mu, tilt=(slope, 40.0)).friction
    needed = np.tan(np.deg2rad(slope)) / mu
    assert found.falls < needed <= found.stands
    assert found.stands - found.falls <= CLOSE * found.stands
    assert found.governing == 0


@pytest.mark.parametrize(("count", "offset"), [(2, 0.3), (3, 0.2), (4, 0.05)])
def test_a_leaning_stack_uses_this_much_of_its_joints(count, offset):
    found = of(stack(count, offset=offset))
    share = (count - 1) * offset / (1.0 - offset)
    assert found.joints.falls < share <= found.joints.stands * (1.0 + 1e-9)
    assert found.joints.stands == pytest.approx(share, rel=CLOSE)
    assert found.geometric_safety == pytest.approx(1.0 / share, rel=CLOSE)
    assert found.friction.falls is None  # it needs none
    assert found.friction.stands == 0.0


def test_an_arch_has_its_geometric_safety():
    found = of(arch(20, radius=5.0, thickness=0.6), mu=0.84)
    assert found.geometric_safety == pytest.approx(0.12 / 0.10746, rel=2e-3)


def test_what_falls_has_nothing_to_spare():
    found = of(stack(1), mu=0.3, tilt=(20.0, 0.0))
    assert found.friction is None
    assert found.joints is None
    assert found.geometric_safety == 1.0


@cache
def leaning():
    model = stack(2, offset=0.3)
    return model, of(model, mu=0.5)


@settings(max_examples=examples(6), deadline=None)
@given(scale=st.floats(1e-2, 1e3), heading=st.floats(0.1, 6.0))
def test_margins_are_shares_and_do_not_depend_on_size_or_heading(scale, heading):
    model, once = leaning()
    c, s = np.cos(heading), np.sin(heading)
    turn = scale * np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved = Assembly([Block(b.id, b.vertices @ turn.T, b.faces, b.density, b.fixed) for b in model.blocks])
    again = of(moved, mu=0.5)
    assert again.joints.stands == pytest.approx(once.joints.stands, rel=2 * CLOSE)
    assert again.joints.governing == once.joints.governing


def test_shrunk_by_hand():
    square = np.array([[10, 0, 0], [14, 0, 0], [14, 2, 0], [10, 2, 0]], float)
    left = shrunk(Contacts.of([(0, 1)], [square]), 0.5)
    assert left.point.round(12).tolist() == [[11, 0.5, 0], [13, 0.5, 0], [13, 1.5, 0], [11, 1.5, 0]]
    assert len(shrunk(Contacts.of([], []), 0.5)) == 0


def test_the_line_of_thrust_of_an_arch_joins_centres_of_pressure_inside_each_stone():
    model = arch(15, radius=4.0, thickness=0.8)
    result = check(model, Settings(method="rbe"))
    line = thrust_line(result)
    assert len(line) == 15  # one piece a voussoir
    joints = resultants(result).centre
    assert np.linalg.norm(line[:, :, None] - joints[None, None], axis=3).min(axis=2).max() < 1e-9
    for block, ends in zip(np.flatnonzero(~result.fixed), line, strict=True):  # voussoirs are convex: hulls tell
        hull = ConvexHull(model.blocks[block].vertices).equations
        assert (hull[:, :3] @ np.linspace(*ends, 5).T + hull[:, 3:]).max() < 1e-9


def test_the_line_of_thrust_of_a_stack_is_plumb():
    result = check(stack(3), Settings(method="rbe"))
    line = thrust_line(result)
    assert np.ptp(line[:, :, :2].reshape(-1, 2), axis=0).max() < 1e-9
    assert line[..., 2].min() == pytest.approx(0.0, abs=1e-9) or line[..., 2].min() > 0.0
    assert line[..., 2].max() == pytest.approx(result.assembly.mass.centroid[:, 2].max())


def test_a_wall_has_no_line_of_thrust():
    assert len(thrust_line(check(wall(3, 3), Settings(method="rbe")))) == 0
