"""Coupled analysis on the peer's own cases.

What the peer solves honestly we prove, and what it cannot we settle where we can: by a state that satisfies every
equation to nine digits, or by a closed tree. Its "infeasible" proves nothing and changes with the unit of weight: a
cube on a slope of 10 degrees at density 25 or 2400 and the stack of two at 26 degrees do have states, verified here.
"""

from collections.abc import Iterator

import numpy as np
import pytest

from cyclopean.analysis import Result, Settings, check
from cyclopean.design import stack
from cyclopean.io import read_model
from cyclopean.proof import verify
from fixtures_compas_cra import FOLDER, NAMES, needs_fixtures, raw
from test_peer import FALLING

WIDE = ("07_shelf", "05_wedge_type-a_y90", "05_wedge_type-b_y90", "05_wedge_type-c_y90", "05_wedge_type-d_y90")
JAMMED = {"16_A", "16_H"}  # forces exist, but no motion produces them
OPEN = {"07_shelf", "07_shelf-s3"}  # neither a state nor a proof that there is none


def answered(name: str, **change: object) -> Result:
    model, _ = read_model(FOLDER / f"{name}.json")
    eta = 100.0 if name.startswith(WIDE) else 10.0
    return check(model, Settings(**{"method": "cra", "eta": eta, "seconds": 30.0, **change}))


@needs_fixtures
@pytest.mark.parametrize("name", NAMES)
def test_verdict(name: str) -> None:
    result = answered(name, **({"seconds": 3.0} if name in OPEN else {}))
    expected = "unstable" if name in FALLING | JAMMED else "undecided" if name in OPEN else "stable"
    assert result.verdict == expected, result.reason
    if name in OPEN:
        assert result.certificate is None
        assert "merit" in result.reason
        return
    assert result.certificate is not None
    kind = "cra-state" if expected == "stable" else "cra-tree" if name in JAMMED else "rbe-mechanism"
    assert result.certificate["kind"] == kind
    assert verify(result.certificate).proved
    if kind == "cra-state":
        assert max(result.residuals.values()) <= 1e-9


@needs_fixtures
def test_where_the_peer_solves_honestly_we_prove() -> None:
    honest = {n for n in NAMES if (raw(n)["peer"]["cra"] or {}).get("verdict") in ("optimal", "acceptable")}
    assert len(honest) >= 15
    assert not honest & (FALLING | JAMMED | OPEN)


def where_the_peer_is_wrong() -> Iterator[tuple[str, object, Settings]]:
    for density in (1.0, 25.0, 2400.0):
        for degrees in (10.0, 30.0):
            cube = stack(1, size=(1.0, 1.0, 1.0))
            yield f"cube {degrees:g} rho {density:g}", cube, Settings(mu=0.84, density=density, tilt=(degrees, 0.0))
    yield "stack 26", stack(2, size=(1.0, 1.0, 1.0)), Settings(mu=0.84, tilt=(26.0, 0.0))


@pytest.mark.parametrize(("name", "model", "settings"), list(where_the_peer_is_wrong()))
def test_states_that_the_peer_calls_infeasible(name: str, model: object, settings: Settings) -> None:
    result = check(model, settings)  # type: ignore[arg-type]
    assert result.verdict == "stable", name
    assert result.certificate is not None
    assert result.certificate["kind"] == "cra-state"
    assert np.max(list(result.residuals.values())) <= 1e-9
