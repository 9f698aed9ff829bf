"""Every block by its own weight: models with stones of very different sizes, judged by the rules in plain fractions.

By hand: a stone whose edge hangs over by the share s of its length tips where s > 1/2; one on a slope slides where the
slope is steeper than mu; a stone between a wall and a cube that a load P presses against it stands where 2 mu P > W.
"""

from dataclasses import replace

import numpy as np
import pytest

from cyclopean.analysis import Settings
from cyclopean.analysis.equilibrium.components import component_labels, components
from cyclopean.analysis.equilibrium.deciding import Decision, decide_rigid
from cyclopean.analysis.equilibrium.exact_balance import exact_balance, product, total
from cyclopean.analysis.equilibrium.opening import drive, opened
from cyclopean.analysis.equilibrium.own_scale import own_scaled
from cyclopean.analysis.equilibrium.polishing import Polisher
from cyclopean.analysis.equilibrium.rbe import solve_rbe
from cyclopean.analysis.equilibrium.slack import AMPLE, slack
from cyclopean.analysis.preparation import PreparedModel, prepare
from cyclopean.assembly import Assembly, Contacts, Load, detect
from cyclopean.design import arch, dome, stack, vault, wall
from cyclopean.io import read_model
from cyclopean.statics import EquilibriumSystem, Schur
from fixtures_compas_cra import FOLDER
from laws import some
from own_scale_cases import box, mixed, tip
from own_scale_rules import Rules

AUDIT = FOLDER.parent / "audit"
G = 9.80665


def posed(assembly: Assembly, **options: object) -> PreparedModel:
    return prepare(assembly, Settings(method="rbe", **options))  # type: ignore[arg-type]


def system_of(model: PreparedModel) -> EquilibriumSystem:
    return model.system()


def judged(model: PreparedModel) -> tuple[str, Decision]:
    """What is decided, once it has passed the rules in fractions."""
    system = system_of(model)
    found = decide_rigid(model, system)
    if found.word == "balanced":
        assert found.state is not None
        assert Rules(model).state(system.used, *found.state.parts) == ""
    if found.word == "collapse":
        assert Rules(model).mechanism(world(system, found.y))
    return found.word, found


def world(system: EquilibriumSystem, y: np.ndarray | None) -> np.ndarray:
    assert y is not None
    rows = system.still(y).reshape(-1, 6).copy()
    rows[:, 3:] /= system.length_unit
    return rows / np.abs(rows).max()


def test_products_and_sums_lose_nothing() -> None:
    from fractions import Fraction

    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 200)) * 10.0 ** rng.integers(-30, 30, (2, 200))
    for work, exact in ((product, lambda x, y: x * y), (total, lambda x, y: x + y)):
        for x, y, high, low in zip(a, b, *work(a, b), strict=True):
            assert Fraction(high) + Fraction(low) == exact(Fraction(x), Fraction(y))


@pytest.mark.parametrize("mu", [0.6, 0.0])
def test_residuals_are_those_of_fractions(mu: float) -> None:
    """Two boxes far from the origin, a load, forces that are sums of two doubles."""
    assembly = Assembly(
        [box("base", (1e3, 0, -1), 1.0, True), box("a", (1e3, 0.1, 0), 0.7), box("b", (1e3 + 0.2, 0.15, 0.7), 1 / 3)],
        loads=(Load(2, np.array([1.0, 0.3, -2.0]), np.array([1e3 + 0.3, 0.2, 0.9])),),
    )
    model = posed(assembly, mu=mu, gravity=(0.1, 0.2, -9.8))
    system = system_of(model)
    balance = exact_balance(model, system)
    rng = np.random.default_rng(2)
    high, low = rng.random((system.points, 3)) * 100.0, rng.random((system.points, 3)) * 1e-15
    if mu == 0.0:
        high[:, 1:] = low[:, 1:] = 0.0
    found, rules = balance.residual((high, low)), Rules(model)
    wanted = rules.residuals(system.used, high, low)
    assert np.allclose(found, wanted, rtol=1e-9, atol=0.0)  # moments lose what c F cancels: 1e3 against 0.3
    assert balance.own(found)[0, 0] == pytest.approx(
        np.linalg.norm(wanted[0][:3]) / (2400 * 0.343 * np.linalg.norm(model.gravity))
    )


@pytest.mark.parametrize("seed", some(range(12), 3))
def test_small_stones_are_decided_right(seed: int) -> None:
    for name, assembly, mu, gravity, stands in mixed(seed):
        word, found = judged(posed(assembly, mu=mu, gravity=tuple(gravity)))
        assert word == ("balanced" if stands else "collapse"), name
        if stands:
            assert found.own <= 1e-10


@pytest.mark.parametrize(("need", "ratio"), [(1.01, 0.1), (0.99, 0.1), (1.2, 1e-3)])
def test_a_stone_that_a_load_holds(need: float, ratio: float) -> None:
    """Beside a wall, pressed by a cube on a floor without friction: stands where the load is above W / (2 mu)."""
    mu, weight = 0.5, 2400.0 * G * ratio**3
    push = Load(2, np.array([-need * weight / (2.0 * mu), 0, 0]), np.array([1 + ratio, 0.5, 0.5 + ratio / 2]))
    assembly = Assembly(
        [
            box("floor", (-1, -1, -1), (4, 3, 1), True),
            box("wall", (-1, -1, 0), (1, 3, 3), True),
            box("cube", (ratio, 0, 0), 1.0),
            box("stone", (0, 0.5 - ratio / 2, 0.5), ratio),
        ],
        loads=(push,),
    )
    found = detect(assembly, None).contacts
    smooth = np.where((found.a == 0) | (found.b == 0), 0.0, mu)
    model = posed(replace(assembly, contacts=Contacts(found.a, found.b, found.start, found.point, smooth)))
    assert judged(model)[0] == ("balanced" if need > 1.0 else "collapse")


def test_a_boulders_balance_never_hides_a_pebble() -> None:
    """1e-9 of the cube's weight would hold the stone up, and it falls: what may be missed is that of the lightest."""
    ratio, mu = 5e-4, 0.5
    weight = 2400.0 * G * ratio**3
    push = Load(2, np.array([-0.9 * weight / (2.0 * mu), 0, 0]), np.array([1 + ratio, 0.5, 0.5]))
    boxes = [box("floor", (-1, -1, -1), (4, 3, 1), True), box("wall", (-1, -1, 0), (1, 3, 3), True)]
    assembly = Assembly([*boxes, box("cube", (ratio, 0, 0), 1.0), box("stone", (0, 0.5, 0.5), ratio)], loads=(push,))
    found = detect(assembly, None).contacts
    smooth = np.where((found.a == 0) | (found.b == 0), 0.0, mu)
    model = posed(replace(assembly, contacts=Contacts(found.a, found.b, found.start, found.point, smooth)))
    assert judged(model)[0] == "collapse"


@pytest.mark.skipif(not AUDIT.exists(), reason=f"no models at {AUDIT}")
@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("tip_ratio_1.0", "collapse"),
        ("tip_ratio_0.3", "collapse"),
        ("tip_ratio_0.05", "collapse"),
        ("pinning_0.02", "collapse"),
        ("pebble_on_slope_edge", "balanced"),
        ("corner_59", "balanced"),
        ("tower_with_wall", "balanced"),
    ],
)
def test_the_audits_models(name: str, word: str) -> None:
    assert judged(posed(read_model(AUDIT / f"{name}.json")[0]))[0] == word


@pytest.mark.parametrize(
    "assembly",
    [stack(4), wall(5, 5), arch(13), vault(7, 3), dome(4, 8)],
    ids=["stack", "wall", "arch", "vault", "dome"],
)
def test_what_stands_has_slack_down_to_its_supports(assembly: Assembly) -> None:
    model = posed(assembly)
    system = system_of(model)
    found = decide_rigid(model, system)
    assert found.word == "balanced"
    assert found.state is not None
    balance = exact_balance(model, system)
    assert slack(system, balance, found.state).min() >= AMPLE


def test_polish_takes_residuals_off_and_stays_in_the_cones() -> None:
    """Forces a little off; pins of 1 mm below a cube of 1 m need a second double, a wall does not."""
    for assembly, off, two in ((wall(4, 4), 1e-9, False), (pinned(), 1e-11, True)):
        model = posed(assembly, mu=0.6)
        system = system_of(model)
        balance = exact_balance(model, system)
        f = decide_rigid(model, system).f
        assert f is not None
        noise = 1.0 + off * np.random.default_rng(3).normal(size=f.shape)
        polished = Polisher(system, balance, Schur(system)).polished(f * noise)
        assert polished.steps > 0
        assert polished.worst <= 1e-10
        assert (polished.low is not None) == two
        assert Rules(model).state(system.used, *polished.parts) == ""


def pinned() -> Assembly:
    corners = [(x, y, 0.0) for x in (0.0, 0.999) for y in (0.0, 0.999)]
    pins = [box(f"pin {i}", corner, 0.001) for i, corner in enumerate(corners)]
    return Assembly([box("base", (-1, -1, -1), (3, 3, 1), True), *pins, box("cube", (0, 0, 0.001), 1.0)])


def test_components_and_scales() -> None:
    """Two stacks on one base are two components; own rows say 1 for the weight of each stone."""
    boxes = [box("base", (0, 0, -1), (9, 9, 1), True)]
    boxes += [box("a", (1, 1, 0), 1.0), box("b", (5, 1, 0), 0.1), box("c", (5, 1, 0.1), 0.05)]
    model = posed(Assembly(boxes))
    system = system_of(model)
    assert component_labels(system).tolist() == [0, 1, 1]
    first, second = components(system)
    assert (first.blocks.tolist(), second.blocks.tolist()) == ([0], [1, 2])
    assert np.array_equal(second.system.A.toarray(), system.A.toarray()[6:][:, 3 * first.system.points :])
    assert system.weight is not None
    assert system.diagonal is not None
    scaled = own_scaled(system, system.weight, system.diagonal, np.ones(system.points))
    assert np.allclose(scaled.p.reshape(-1, 6)[:, 2], -1.0)
    D = np.random.default_rng(0).random((system.points, 3, 1)) * np.eye(3)
    dense = scaled.A.toarray() @ np.kron(np.eye(system.points), np.ones((3, 3))) * 0.0
    for k in range(system.points):
        column = scaled.A.toarray()[:, 3 * k : 3 * k + 3]
        dense = dense[: len(column), : len(column)] + column @ D[k] @ column.T if k else column @ D[k] @ column.T
    lower = Schur(system).on(scaled)
    matrix = np.zeros(dense.shape)
    where = np.repeat(np.arange(len(dense)), np.diff(lower.symbolic.indptr))
    matrix[lower.symbolic.indices, where] = lower.values(D)
    assert np.allclose(matrix, np.tril(dense))


def test_a_mechanism_that_merely_slides_is_opened() -> None:
    """Beside a cube of its own component: the rounding of a sliding joint is too much for 1e6 weights of the cube."""
    assembly, stands = tip(1e-3, 0.6, np.random.default_rng(0))
    assert not stands
    model = posed(assembly, mu=0.6)
    system = system_of(model)
    balance = exact_balance(model, system)
    label = component_labels(system)
    assert label.tolist() == [0, 0]
    tipping = np.zeros((2, 6))
    tipping[1] = [0.0, 0.0, -0.1, 0.0, 1.0, 0.0]  # turns about y while its centre falls: the edge digs in
    assert drive(system, balance, label, tipping.ravel())[0] < 1.0
    found = opened(system, balance, tipping.ravel())
    assert found is not None
    assert drive(system, balance, label, found)[0] > 1.0
    assert not found[:6].any()
    assert Rules(model).mechanism(world(system, found))


def test_the_rules_refuse_what_the_old_scale_took() -> None:
    """The state that the whole model's scale calls balanced leaves the small stone hanging: the rules see it."""
    assembly, _ = tip(1e-3, 0.6, np.random.default_rng(0))
    model = posed(assembly, mu=0.6)
    system = system_of(model)
    old = solve_rbe(system)
    assert old.word == "balanced"
    assert old.f is not None
    high = np.einsum("qi,qij->qj", old.f * system.force_unit, system.frame)
    assert "weight" in Rules(model).state(system.used, 0.999 * high, None) or "cone" in Rules(model).state(
        system.used, high, None
    )
