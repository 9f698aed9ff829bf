"""A thousand damaged certificates of real models (a quarter of them by default), all rejected.

Each is a certificate that `check` wrote with one thing changed. As it stands it is rejected whatever the change; sealed
anew, the changes that touch the mathematics (forces, motion, loads, geometry, names) are rejected by the arithmetic.
"""

import copy

import numpy as np
import pytest

from cyclopean.analysis import Settings, check
from cyclopean.design import arch, dome, stack, wall
from cyclopean.proof import verify
from damages import OF_EQUILIBRIUM, Certificate, any_of, density_other, last_digit, mu_lowered, resealed
from laws import examples


@pytest.fixture(scope="module")
def originals() -> list[Certificate]:
    cases = [(wall(2, 3), 0.0), (arch(7), 3.0), (dome(3, 6), 0.0), (stack(4, offset=0.1), 2.0)]
    falls = [(wall(2, 3), 50.0), (arch(7), 60.0), (stack(4, offset=0.4), 0.0)]
    found = [check(model, Settings(method="rbe", tilt=(tilt, 20.0))).certificate for model, tilt in cases + falls]
    assert all(c is not None and verify(c).proved for c in found)
    return [c for c in found if c is not None]


def test_every_damaged_certificate_is_rejected(originals: list[Certificate]) -> None:
    for seed in range(examples(1000)):
        rng = np.random.default_rng(seed)
        damaged = copy.deepcopy(originals[seed % len(originals)])
        damage = any_of([*OF_EQUILIBRIUM, mu_lowered, last_digit, density_other], rng)
        assert damage(damaged, rng)
        assert not verify(damaged).proved, f"seed {seed}: {damage.__name__} passed"
        if damage in OF_EQUILIBRIUM:
            assert not verify(resealed(damaged)).proved, f"seed {seed}: {damage.__name__} passed with a good seal"
