"""Equilibrium matrices, friction cones and S = A D A'.

By hand: a contact point 2 m east of a block's centre that pushes it up by 3 N gives Fz = 3 N and My = -6 N m.
A projection onto the cone of mu = 1: (0, 2, 0) goes to (1, 1, 0), halfway between the normal and the side.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import block_diag
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cyclopean.assembly import Assembly, Block, Contacts, Load, supports
from cyclopean.design import arch, wall
from cyclopean.errors import InputError
from cyclopean.geometry.packed import components
from cyclopean.statics import (
    EquilibriumSystem,
    Schur,
    body_loads,
    cone_jacobian,
    equilibrium_system,
    project_cones,
    pyramid_rows,
    turned_gravity,
)
from cyclopean.statics.equilibrium import partly_held
from laws import examples

FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
G = np.array([0.0, 0.0, -10.0])


def cube(name: str, at: tuple[float, float, float], size: float = 1.0, **kwargs: object) -> Block:
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    return Block(name, corners * size + np.array(at), FACES, **kwargs)  # type: ignore[arg-type]


def two_cubes() -> Assembly:
    bed = np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    return Assembly((cube("a", (0, 0, 0)), cube("b", (0, 0, 1))), Contacts.of([(0, 1)], [bed], [0.5]))


def system_of(assembly: Assembly, mu: float = 0.7) -> EquilibriumSystem:
    assert assembly.contacts is not None
    return equilibrium_system(assembly, assembly.contacts.with_mu(mu), supports(assembly)[0], G, 2400.0)


def test_one_contact_by_hand() -> None:
    """Unit cube (weight 24 kN, V^(1/3) = 1 m): the corner (1, 1, 1) lies at (0.5, 0.5, -0.5) from the centre."""
    system = system_of(two_cubes())
    assert system.force_unit == pytest.approx(24_000.0)
    assert system.length_unit == pytest.approx(1.0)
    assert system.p.reshape(-1, 6).tolist() == [[0, 0, -1, 0, 0, 0]]
    up = np.zeros((4, 3))
    up[2, 0] = 1.0
    assert (system.A @ up.ravel()).tolist() == pytest.approx([0, 0, 1, 0.5, -0.5, 0])


def test_four_equal_corners_balance_the_weight() -> None:
    system = system_of(two_cubes())
    f = np.zeros((4, 3))
    f[:, 0] = 0.25
    assert np.abs(system.residual(f)).max() < 1e-15


def test_loads_by_hand() -> None:
    """7 N east at the top of a cube on its side: moment 0.5 m x 7 N about +y."""
    model = Assembly((cube("a", (0, 0, 0), density=100.0),), None, (Load(0, [7.0, 0, 0], [0.5, 0.5, 1.0]),))
    assert body_loads(model, G, 2400.0).tolist() == pytest.approx(np.array([[7, 0, -1000, 0, 3.5, 0]]))


@given(seed=st.integers(0, 1000))
def test_action_is_reaction(seed: int) -> None:
    """Any forces between two free blocks leave total force and total moment about one point untouched."""
    rng = np.random.default_rng(seed)
    model = two_cubes()
    assert model.contacts is not None
    system = equilibrium_system(model, model.contacts, np.zeros(2, bool), G, 1000.0)
    f = rng.standard_normal((4, 3))
    wrench = (system.A @ f.ravel()).reshape(2, 6)
    assert np.abs(wrench[:, :3].sum(0)).max() < 1e-12
    centre = model.mass.centroid / system.length_unit
    moment = wrench[:, 3:] + np.cross(centre, wrench[:, :3])
    assert np.abs(moment.sum(0)).max() < 1e-12


@given(
    x=st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    mu=st.floats(0.0, 5.0),
)
def test_projection_is_the_nearest_point(x: tuple[float, float, float], mu: float) -> None:
    """Moreau: x = P_K(x) + P_K°(x), the two orthogonal, the first in K and the rest in the polar cone."""
    v, m = np.array([x]), np.array([mu])
    f = project_cones(v, m)
    size = max(np.abs(v).max(), 1e-300)
    assert f[0, 0] >= 0
    assert np.hypot(f[0, 1], f[0, 2]) <= mu * f[0, 0] + 1e-12 * size
    rest = (v - f)[0]
    assert abs(rest @ f[0]) <= 1e-10 * size**2
    assert rest[0] + mu * np.hypot(rest[1], rest[2]) <= 1e-10 * size * (1 + mu)
    assert np.abs(project_cones(f, m) - f).max() <= 1e-12 * size


@given(seed=st.integers(0, 1000), mu=st.floats(0.05, 2.0))
def test_jacobian_is_the_derivative(seed: int, mu: float) -> None:
    rng = np.random.default_rng(seed)
    x, d, m = rng.standard_normal((5, 3)), rng.standard_normal((5, 3)), np.full(5, mu)
    h = 1e-7
    slope = (project_cones(x + h * d, m) - project_cones(x - h * d, m)) / (2 * h)
    inside_edge = np.abs(np.hypot(x[:, 1], x[:, 2]) - mu * x[:, 0]) > 1e-3
    polar_edge = np.abs(x[:, 0] + mu * np.hypot(x[:, 1], x[:, 2])) > 1e-3
    smooth = inside_edge & polar_edge & (np.hypot(x[:, 1], x[:, 2]) > 1e-2)
    J = cone_jacobian(x, m)
    assert np.abs(np.einsum("nij,nj->ni", J, d) - slope)[smooth].max(initial=0) < 1e-4
    eigenvalues = np.linalg.eigvalsh(J)
    assert eigenvalues.min() >= -1e-12
    assert eigenvalues.max() <= 1 + 1e-12


def test_pyramids_bracket_the_cone() -> None:
    mu = np.array([0.7])
    inscribed, circumscribed = pyramid_rows(mu, 8, True), pyramid_rows(mu, 8, False)
    turn = np.linspace(0, 2 * np.pi, 65)[:-1]
    edge = np.stack([np.ones(64), 0.7 * np.cos(turn), 0.7 * np.sin(turn)])
    assert (circumscribed @ edge).max() <= 1e-12
    assert (inscribed @ (edge * [[1], [np.cos(np.pi / 8)], [np.cos(np.pi / 8)]])).max() <= 1e-12
    assert (inscribed @ edge).max() > 0.05
    four = pyramid_rows(mu, 4, False).toarray()
    assert four.tolist() == [[-0.7, 1, 0], [-0.7, 0, 1], [-0.7, -1, 0], [-0.7, 0, -1]]


HOLDS = {
    "nothing": lambda rng, blocks: np.zeros((0, 6), bool),
    "what leaves the plane": lambda rng, blocks: np.tile([False, True, False, True, False, True], (blocks, 1)),
    "this and that": lambda rng, blocks: rng.random((blocks, 6)) < 0.3,
}


@pytest.mark.parametrize("model", [wall(3, 4), arch(7)], ids=["wall", "arch"])
@settings(max_examples=examples(10))
@given(seed=st.integers(0, 100), holds=st.sampled_from(sorted(HOLDS)))
def test_schur_is_a_d_a_transposed(model: Assembly, seed: int, holds: str) -> None:
    """Of what no support holds; the rest is zero in every solution."""
    system, rng = system_of(model), np.random.default_rng(seed)
    held = HOLDS[holds](rng, system.blocks)
    if len(held):
        system = partly_held(system, held, np.ones(system.blocks))
    D = rng.standard_normal((system.points, 3, 3))
    schur = Schur(system)
    free = schur.free
    assert free.tolist() == [k for k in range(schur.size) if not (len(held) and held.flat[k])]
    A = system.A.toarray()[free]
    rhs = rng.standard_normal(schur.size)
    for metric, factored in ((D @ D.transpose(0, 2, 1), schur.factor), (D, schur.unsymmetric)):
        whole = A @ block_diag(*metric) @ A.T + 0.5 * np.eye(len(free))
        x = factored(metric, 0.5).solve(rhs)
        assert np.abs(whole @ x[free] - rhs[free]).max() <= 1e-9 * np.abs(whole).max() * np.abs(x).max()
        assert not np.delete(x, free).any()
    lower = np.zeros_like(whole)
    lower[schur.symbolic.indices, np.repeat(np.arange(len(free)), np.diff(schur.symbolic.indptr))] = schur.values(D)
    assert np.abs(np.tril(A @ block_diag(*D) @ A.T) - lower).max() <= 1e-12 * np.abs(whole).max()
    assert schur.factorisations == 2


def test_gravity_turns_towards_the_azimuth() -> None:
    assert turned_gravity(G, 30.0).tolist() == pytest.approx([5.0, 0, -10 * np.cos(np.pi / 6)])
    assert turned_gravity(G, 90.0, 90.0).tolist() == pytest.approx([0, 10.0, 0], abs=1e-12)
    assert np.linalg.norm(turned_gravity(np.array([1.0, 2, -3]), 17.0, 211.0)) == pytest.approx(np.sqrt(14))


def test_scaled_systems_do_not_know_their_units() -> None:
    """The same wall in metres and millimetres, at two densities, has one scaled system."""
    small, big = wall(2, 3), wall(2, 3, length=400.0, depth=200.0, height=200.0)
    one = system_of(small)
    assert big.contacts is not None
    other = equilibrium_system(big, big.contacts.with_mu(0.7), supports(big)[0], 1e-3 * G, 7.0)
    assert np.abs((one.A - other.A).toarray()).max() < 1e-12
    assert np.abs(one.p - other.p).max() < 1e-12


def test_a_missing_friction_coefficient_is_refused() -> None:
    model = wall(2, 2)
    assert model.contacts is not None
    with pytest.raises(InputError, match="friction coefficient mu is missing"):
        equilibrium_system(model, model.contacts, supports(model)[0], G, 2400.0)


def test_supports_by_name() -> None:
    """ids=a,b names two blocks, unless one block is called just that."""
    pair = Assembly((cube("a", (0, 0, 0)), cube("b", (0, 0, 1)), cube("c", (0, 0, 2))))
    assert supports(pair, "ids=a, c")[0].tolist() == [True, False, True]
    odd = Assembly((cube("a", (0, 0, 0)), cube("a,b", (0, 0, 1))))
    assert supports(odd, "ids=a,b")[0].tolist() == [False, True]
    with pytest.raises(InputError, match="block 'z'"):
        supports(pair, "ids=z")
    with pytest.raises(InputError, match="no block is a support"):
        supports(pair, "below=-5")


@given(st.integers(1, 40), st.data())
def test_what_hangs_together_is_what_scipy_finds(count, data):
    """Classes are numbered by their first members; pairs come in either order, twice, and of one with itself."""
    node = st.integers(0, count - 1)
    ends = np.array(data.draw(st.lists(st.tuples(node, node), max_size=60)), int).reshape(-1, 2)
    label = components(count, *ends.T)
    graph = coo_array((np.ones(len(ends)), tuple(ends.T)), shape=(count, count))
    other = connected_components(graph, directed=False)[1]
    assert len({*zip(label.tolist(), other.tolist(), strict=True)}) == len({*label.tolist()}) == other.max() + 1
    assert [*dict.fromkeys(label.tolist())] == [*range(label.max() + 1)]
