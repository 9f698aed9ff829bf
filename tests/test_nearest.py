"""Forces put into balance on the edges of their cones, next to others a hundred thousand times their size.

By hand: a block of weight 1 on a level face, held back by friction 1/2; forces (1, 1/2) lean on the edge of the cone.
With a pull of 1/2 sideways they balance; with 0.4 the nearest that do lie inside; with 0.6 none do.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from auditing import AGREES, judged
from cyclopean.analysis import Settings
from cyclopean.analysis.equilibrium.components import component_labels, lightest
from cyclopean.analysis.equilibrium.exact_balance import exact_balance
from cyclopean.analysis.equilibrium.nearest import nearest
from cyclopean.analysis.equilibrium.own_scale import own_scaled
from cyclopean.analysis.equilibrium.rbe import solve_rbe
from cyclopean.analysis.preparation import PreparedModel, prepare
from cyclopean.analysis.proving import polished
from cyclopean.assembly import Assembly
from cyclopean.design import wall
from cyclopean.statics import EquilibriumSystem, Schur
from laws import some
from oracle_models import drawn


def posed(assembly: Assembly, **options: object) -> tuple[PreparedModel, EquilibriumSystem]:
    model = prepare(assembly, Settings(method="rbe", **options))  # type: ignore[arg-type]
    return model, model.system()


def mixed_wall(rng: np.random.Generator) -> Assembly:
    """Weights from 1 to 1e5, in no order."""
    plain = wall(int(rng.integers(2, 4)), int(rng.integers(2, 4)))
    heavy = 10.0 ** rng.uniform(0.0, 5.0, len(plain))
    blocks = [replace(block, density=float(rho)) for block, rho in zip(plain.blocks, heavy, strict=True)]
    return replace(plain, blocks=tuple(blocks))


@pytest.mark.parametrize("seed", some(range(12), 3))
def test_mixed_walls_balance_to_the_lightest_weight(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lean = (float(rng.uniform(-0.5, 0.5)), 0.0, -9.80665)
    model, system = posed(mixed_wall(rng), mu=0.7, gravity=lean)
    found = solve_rbe(system)
    assert found.f is not None
    balance = exact_balance(model, system)
    share = lightest(component_labels(system), balance.weight) / balance.weight
    state = polished(model, system, found.f)
    assert (state.own.max(1) <= 1e-10 * share).all()
    beyond = np.hypot(state.f[:, 1], state.f[:, 2]) - system.mu * state.f[:, 0]
    assert beyond.max() <= 0.0


@pytest.mark.parametrize(("pull", "held"), [(0.4, True), (0.5, True), (0.6, False)])
def test_one_block_by_hand(pull: float, held: bool) -> None:
    model, system = posed(wall(1, 1), mu=0.5, gravity=(9.80665 * pull, 0.0, -9.80665))
    balance = exact_balance(model, system)
    weight, diagonal = balance.weight / system.force_unit, balance.diagonal / system.length_unit
    scaled = own_scaled(system, weight, diagonal, np.ones(system.points))
    f = np.zeros((system.points, 3))
    f[:, 0] = weight.sum() / system.points
    along = system.frame[:, 1:] @ np.array([-1.0, 0.0, 0.0])
    f[:, 1:] = 0.5 * f[:, :1] * along
    off = scaled.residual(f).ravel()
    columns = np.repeat(np.linalg.norm(f, axis=1)[:, None], 3, 1)
    found = nearest(scaled, Schur(scaled), f, off, columns, system.mu)
    assert (np.hypot(found[:, 1], found[:, 2]) <= 0.5 * found[:, 0] * (1.0 + 1e-14)).all()
    left = float(np.max(np.abs(scaled.residual(found))))
    assert (left <= 1e-10) is held
    assert left <= np.max(np.abs(off))


@pytest.mark.parametrize(("kind", "seed", "family"), [("cra", 1, "wall"), ("limit", 2, "pins"), ("limit", 58, None)])
def test_what_steps_inside_the_cones_left_open(kind: str, seed: int, family: str | None, tmp_path: Path) -> None:
    """A force of 4e-12 that nothing but itself opposes; pins on the edges of their cones; a boulder on a pebble."""
    assert judged(drawn(kind, seed, family), tmp_path).outcome == AGREES


def test_what_falls_without_live_loads_is_said_to_fall(tmp_path: Path) -> None:
    """A pebble a millionth of its neighbours falls; ten times the live loads would hold it."""
    found = judged(drawn("limit", 37), tmp_path)
    assert found.outcome == AGREES
    assert found.ours.startswith("falls")
