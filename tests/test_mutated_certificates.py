"""One thousand damaged certificates of real models, all rejected.

Each is a certificate that `check` wrote with one thing changed. As it stands it is rejected whatever the change; sealed
anew, the changes that touch the mathematics (forces, motion, loads, geometry, names) are rejected by the arithmetic.
"""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cyclopean.analysis import Settings, check
from cyclopean.design import arch, dome, stack, wall
from cyclopean.proof import seal, verify

Certificate = dict[str, Any]
Change = Callable[[Certificate, np.random.Generator], None]


def certificates() -> list[Certificate]:
    cases = [(wall(2, 3), 0.0), (arch(7), 3.0), (dome(3, 6), 0.0), (stack(4, offset=0.1), 2.0)]
    falls = [(wall(2, 3), 50.0), (arch(7), 60.0), (stack(4, offset=0.4), 0.0)]
    found = [check(model, Settings(method="rbe", tilt=(tilt, 20.0))).certificate for model, tilt in cases + falls]
    assert all(c is not None and verify(c).proved for c in found)
    return [c for c in found if c is not None]


def largest(rows: list[list[float]]) -> tuple[int, int]:
    flat = int(np.argmax(np.abs(np.array(rows))))
    return flat // len(rows[0]), flat % len(rows[0])


def witness(c: Certificate) -> list[list[float]]:
    return c["forces"] if "forces" in c else list(c["mechanism"].values())


def flip(c: Certificate, rng: np.random.Generator) -> None:
    rows = witness(c)
    i, j = largest(rows)
    rows[i][j] *= -1


def scale_all(c: Certificate, rng: np.random.Generator) -> None:
    """To nothing or beyond what counts. (Where forces have slack, others between are corrected, and prove it still.)"""
    if "forces" in c:
        factor = float(rng.choice([0.0, 1e8]))
        c["forces"] = [[factor * x for x in row] for row in c["forces"]]
    else:
        c["mechanism"] = {name: [-x for x in row] for name, row in c["mechanism"].items()}


def gravity_turned_over(c: Certificate, rng: np.random.Generator) -> None:
    c["gravity"] = [-g for g in c["gravity"]]


def block_swapped(c: Certificate, rng: np.random.Generator) -> None:
    joint = c["contacts"][int(rng.integers(len(c["contacts"])))]
    joint["a"], joint["b"] = joint["b"], joint["a"]


def point_moved(c: Certificate, rng: np.random.Generator) -> None:
    joint = c["contacts"][int(rng.integers(len(c["contacts"])))]
    size = np.ptp(np.concatenate([b["vertices"] for b in c["blocks"]]), axis=0).max()
    joint["polygon"][int(rng.integers(len(joint["polygon"])))][int(rng.integers(3))] += float(size)


def mesh_opened(c: Certificate, rng: np.random.Generator) -> None:
    c["blocks"][int(rng.integers(len(c["blocks"])))]["faces"].pop()


def mesh_turned_inside_out(c: Certificate, rng: np.random.Generator) -> None:
    block = c["blocks"][int(rng.integers(len(c["blocks"])))]
    block["faces"] = [face[::-1] for face in block["faces"]]


def name_doubled(c: Certificate, rng: np.random.Generator) -> None:
    c["blocks"][0]["id"] = c["blocks"][-1]["id"]


def field_lost(c: Certificate, rng: np.random.Generator) -> None:
    del c[str(rng.choice([k for k in c if k != "seal"]))]


def not_a_number(c: Certificate, rng: np.random.Generator) -> None:
    witness(c)[0][int(rng.integers(3))] = float(rng.choice([np.nan, np.inf, -np.inf]))


def huge_exponent(c: Certificate, rng: np.random.Generator) -> None:
    witness(c)[0][int(rng.integers(3))] = float(rng.choice([1e300, -1e200, 1e-300]))


def witness_cut_short(c: Certificate, rng: np.random.Generator) -> None:
    if "forces" in c:
        c["forces"].pop()
    else:
        c["mechanism"].popitem()


MATHEMATICAL: list[Change] = [
    flip, scale_all, gravity_turned_over, block_swapped, point_moved, mesh_opened, mesh_turned_inside_out,
    name_doubled, field_lost, not_a_number, huge_exponent, witness_cut_short,
]  # fmt: skip


def mu_lowered(c: Certificate, rng: np.random.Generator) -> None:
    c["contacts"][int(rng.integers(len(c["contacts"])))]["mu"] *= 0.5


def last_digit(c: Certificate, rng: np.random.Generator) -> None:
    block = c["blocks"][int(rng.integers(len(c["blocks"])))]
    vertex = block["vertices"][int(rng.integers(len(block["vertices"])))]
    vertex[0] = float(np.nextafter(vertex[0], np.inf))


def density_changed(c: Certificate, rng: np.random.Generator) -> None:
    c["blocks"][int(rng.integers(len(c["blocks"])))]["density"] *= 1.5


@pytest.fixture(scope="module")
def originals() -> list[Certificate]:
    return certificates()


@pytest.mark.parametrize("batch", range(10))
def test_every_damaged_certificate_is_rejected(originals: list[Certificate], batch: int) -> None:
    changes = [*MATHEMATICAL, mu_lowered, last_digit, density_changed]
    for seed in range(100 * batch, 100 * batch + 100):
        rng = np.random.default_rng(seed)
        damaged = copy.deepcopy(originals[seed % len(originals)])
        change = changes[int(rng.integers(len(changes)))]
        change(damaged, rng)
        assert not verify(damaged).proved, f"seed {seed}: {change.__name__} passed"
        sealable = all(np.isfinite(x) for row in _rows(damaged) for x in row)
        if change in MATHEMATICAL and sealable:
            damaged["seal"] = seal(damaged)
            assert not verify(damaged).proved, f"seed {seed}: {change.__name__} passed with a good seal"


def _rows(c: Certificate) -> list[list[float]]:
    return c.get("forces") or list(c.get("mechanism", {}).values())
