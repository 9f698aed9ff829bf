"""Against compas_cra on its own cases.

Objective: its pyramid (8 faces, circumscribed), its weights (1e6 on tension) and its quirk (fv counts at every third
point). IPOPT stops at 1e-8 in the model's own units; where forces are small that is visible, and the test allows what
the multipliers say such a tolerance can do.

Verdicts: the peer's RBE has no word for "unstable": it answers "optimal" with tension. Taking its tension above 1e-3 of
the weight as "unstable", it agrees with physics everywhere.
"""

import numpy as np
import pytest

from cyclopean.analysis import Settings, check
from cyclopean.io import read_model
from fixtures_compas_cra import FOLDER, NAMES, needs_fixtures, peer_objective, raw

pytestmark = needs_fixtures

# By statics: cubes slide beyond atan(0.84) = 40.03 degrees, two cubes tip at 26.565, a block 0.75 out falls, a wedge
# between faces that open downwards drops (types c and d turned by 90 degrees), the arch with two more voussoirs on its
# free ends hinges. Shelves, bridge, curved and concave joints stand by RBE. 16_A and 16_H stand by RBE although nothing
# can produce their state: rigid-block equilibrium says no more than that forces exist.
FALLING = {
    "01_cube_tilt48_mu0.1",
    "03_offset0.75_tilt40",
    "03b_offset0.75",
    "04b_stacks_tilt27",
    "05_wedge_type-c_y90",
    "05_wedge_type-d_y90",
    "06_arch20_extra",
    "tilt_cube_41",
    "tilt_cube_44",
    "tilt_cube_46",
    "tilt_cube_50",
}

# Where our minimum differs from the peer's by more than 1e-6: tension of 1e-8 a point, which IPOPT lets through, is
# priced at 1e6 and comes to a visible part of a small objective.
COARSE = {
    "04b_stacks_tilt27",
    "05_wedge_type-a_y90",
    "07_shelf",
    "07_shelf-s1",
    "07_shelf-s3",
    "07_shelf-stable",
    "11_concave-short_tilt40",
    "14_cube-curve-short",
    "16_H",
    "tilt_cube_41",
}


@pytest.mark.parametrize("name", NAMES)
def test_objective(name: str) -> None:
    data = raw(name)
    ours, slack = peer_objective(data)
    theirs = data["peer"]["rbe"]["objective"]
    if name not in COARSE:
        assert ours == pytest.approx(theirs, rel=1e-6)
    assert abs(ours - theirs) <= 1e-6 * theirs + 3 * slack  # 3: frames in the files are rounded too


@pytest.mark.parametrize("name", NAMES)
def test_verdict(name: str) -> None:
    model, _ = read_model(FOLDER / f"{name}.json")
    result = check(model, Settings(method="rbe"))
    assert result.verdict == ("unstable" if name in FALLING else "stable")
    assert result.certificate is not None
    peer = raw(name)["peer"]["rbe"]
    assert (peer["sum_tension"] / peer["weight_free"] > 1e-3) == (name in FALLING)


@pytest.mark.parametrize("name", [n for n in NAMES if n in FALLING or n.startswith(("tilt_cube_3", "06"))])
def test_detected_contacts_give_the_same_verdict(name: str) -> None:
    from dataclasses import replace

    model, _ = read_model(FOLDER / f"{name}.json")
    mu = raw(name)["mu"]
    assert (
        check(replace(model, contacts=None), Settings(method="rbe", mu=mu)).verdict
        == check(model, Settings(method="rbe")).verdict
    )


def test_every_case_is_read() -> None:
    assert len(NAMES) == 36
    for name in NAMES:
        model, _ = read_model(FOLDER / f"{name}.json")
        data = raw(name)
        assert len(model) == len(data["blocks"])
        given = [b["volume"] for b in data["blocks"]]
        # the curved cases have faces that are not flat, and volumes depend on how those are cut into triangles
        assert np.abs(model.mass.volume - given).max() <= (2e-4 if "curve" in name or "concave" in name else 1e-6)
