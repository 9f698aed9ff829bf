"""Two thousand random assemblies at night, half of them within 2 % of the tilt at which they fall.

The fast path must give the right word on every one, with a certificate that verifies, and Clarabel, which shares no
code with it beyond A and p, must give the same. Set CYCLOPEAN_CASES to run more or fewer.
"""

import numpy as np
import pytest

from cyclopean.analysis import Settings, check
from laws import cases
from near_limit import random_case

CASES = cases("CYCLOPEAN_CASES", 2000, 50)
BATCH = 50


@pytest.mark.parametrize("first", range(0, CASES, BATCH))
def test_fast_path_and_reference_agree(first: int) -> None:
    for seed in range(first, min(first + BATCH, CASES)):
        case = random_case(seed)
        # share is known to the 1e-9 of the limit's own programme, and no case is nearer than 1e-4
        expected = "stable" if case.share < 1.0 else "unstable"
        fast = check(case.assembly, Settings(method="rbe", mu=case.mu, gravity=case.gravity))
        slow = check(case.assembly, Settings(method="rbe", mu=case.mu, gravity=case.gravity, solver="clarabel"))
        assert (fast.verdict, slow.verdict) == (expected, expected), f"case {seed}: {case.assembly.name}, {case.share}"
        assert fast.certificate is not None
        if fast.force is not None and slow.force is not None and fast.provenance["solver"] == "newton":
            # both claim the least norm; Clarabel stops at 1e-10 of its gap, conditioning near the limit costs the rest
            assert np.linalg.norm(fast.force) == pytest.approx(np.linalg.norm(slow.force), rel=1e-6)


def test_enough_cases_are_near_their_limit() -> None:
    """The drawing of cases, not the solver: at least 30 % within 2 %, and both verdicts well represented."""
    shares = np.array([random_case(seed).share for seed in range(CASES)])
    assert np.mean(np.abs(shares - 1.0) <= 0.02) >= 0.3
    assert 0.25 <= np.mean(shares < 1.0) <= 0.75
