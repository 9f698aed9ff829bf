"""Settlements of supports: how an arch follows its springers, which joints open, and what its thrust becomes.

Textbook (Heyman 1966): an arch whose springers part settles on three hinges, the one at the crown at its extrados,
those at the haunches at their intrados, and its thrust is the least of all that balance; pushed together, the hinges
change sides and its thrust is the greatest. Both are found here once more by a linear programme of thrust lines that
knows nothing of settlements. By hand, with a rise h from the haunch hinges to that of the crown, a parting d turns each
half by d / (2 h).

A settlement that moves all supports as one rigid body changes nothing: the blocks go along and the forces stay.
"""

import copy
import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupled_cases import beams
from cyclopean.analysis import Result, Settings, check, openings
from cyclopean.assembly import Assembly, Load, Settlement
from cyclopean.design import arch, dome, vault, wall
from cyclopean.errors import InputError
from cyclopean.io import read_model, result_dict, write_model
from cyclopean.proof import seal, verify
from cyclopean.view import report_html
from laws import examples

G = 9.80665
PARTING = 0.01


def settled(model: Assembly, moves: dict[str, tuple[float, ...]], **said: Any) -> Result:
    rows = tuple((name, (*motion, 0.0, 0.0, 0.0)[:6]) for name, motion in moves.items())
    return check(model, Settings(method="rbe", settlement=rows, **said))


def thrust(result: Result) -> float:
    """Horizontal force (N) through the first joint of an arch."""
    assert result.force is not None
    here = slice(result.contacts.start[0], result.contacts.start[1])
    return abs(float(result.force[here].sum(0) @ result.contacts.frame[0][:, 0]))


def extreme_thrust(model: Assembly, sign: float) -> float:
    """Least (sign 1) or greatest (-1) horizontal thrust by a linear programme in the plane of the arch.

    At every joint two forces across it, at its ends, that press, and one along it of any size: Heyman's assumptions.
    """
    from scipy.optimize import linprog

    contacts, mass = model.contacts, model.mass
    assert contacts is not None
    joints, weight = len(contacts), 2400.0 * G * mass.volume[1:-1]
    normal = contacts.frame[:, 0][:, [0, 2]]
    balance = np.zeros((len(model) - 2, 3, joints, 3))  # block, equation, joint, unknown
    for k in range(joints):
        ends = np.unique(contacts.polygon(k)[:, [0, 2]].round(12), axis=0)
        along = np.array([-normal[k, 1], normal[k, 0]])
        for block, way in ((k - 1, -1.0), (k, 1.0)):  # of the free ones; n points from one voussoir into the next
            if 0 <= block < len(model) - 2:
                centre = mass.centroid[block + 1][[0, 2]]
                for unknown, (end, force) in enumerate(((ends[0], normal[k]), (ends[1], normal[k]), (ends[0], along))):
                    arm = end - centre
                    turn = arm[0] * force[1] - arm[1] * force[0]
                    balance[block, :, k, unknown] = way * np.array([force[0], force[1], turn])
    right = np.zeros((len(model) - 2, 3))
    right[:, 1] = weight
    cost = np.zeros((joints, 3))
    cost[0] = [normal[0, 0], normal[0, 0], -normal[0, 1]]
    free = [(0.0, None), (0.0, None), (None, None)] * joints
    found = linprog(sign * cost.ravel(), A_eq=balance.reshape(right.size, -1), b_eq=right.ravel(), bounds=free)
    assert found.status == 0, found.message
    return abs(float(found.fun))


@pytest.mark.parametrize("voussoirs", [12, 21])
@pytest.mark.parametrize(("parting", "sign"), [(PARTING, 1.0), (-PARTING, -1.0)], ids=["apart", "together"])
def test_heyman_thrust_of_an_arch(voussoirs: int, parting: float, sign: float) -> None:
    model = arch(voussoirs, thickness=1.0)
    result = settled(model, {"springer-right": (parting, 0, 0)})
    assert result.verdict == "stable"
    assert thrust(result) == pytest.approx(extreme_thrust(model, sign), rel=1e-6)
    low, high = extreme_thrust(model, 1.0), extreme_thrust(model, -1.0)
    before = thrust(check(model, Settings(method="rbe")))
    assert low < before < high


def test_heyman_hinges_of_an_arch() -> None:
    """Apart: the crown opens below, on its extrados, and the haunches above, on their intrados; by hand how far.

    The haunch hinges are 8.66 m apart at their intrados (z 2.5), the crown hinge is at z 5.8: rise 3.3 m, so that each
    half turns by 0.005 / 3.3, and the crown opens by twice that times the thickness of 0.8 m.
    """
    result = settled(arch(12), {"springer-right": (PARTING, 0, 0)})
    ids = [b.id for b in result.assembly.blocks]
    found = {(ids[result.contacts.a[k]], ids[result.contacts.b[k]]): (k, width) for k, width in openings(result)}
    assert list(found) == [("v06", "v07"), *sorted([("v02", "v03"), ("v10", "v11")], key=list(found).index)]
    assert result.settled is not None
    assert result.force is not None
    for pair, (k, width) in found.items():
        here = slice(result.contacts.start[k], result.contacts.start[k + 1])
        radius = np.hypot(result.contacts.point[here, 0], result.contacts.point[here, 2])
        opens, force = result.settled.gap[here, 0], result.force[here, 0]
        crown = pair == ("v06", "v07")
        outer = radius > 5.4
        assert (np.abs(opens) < 1e-9).tolist() == (outer if crown else ~outer).tolist()
        assert (force > 1.0).tolist() == (outer if crown else ~outer).tolist()  # what has opened carries nothing
        assert force[opens > 1e-6].tolist() == [0.0, 0.0]
        assert width == pytest.approx((2 if crown else 1) * 0.8 * 0.5 * PARTING / 3.3, rel=1e-9)
    report = verify(result.certificate)
    off = max(report.figures[key] for key in ("closing", "work", "hanging"))
    assert f"forces go with the displacement, to {off:.2g} of the settlement; " in report.reason


@settings(max_examples=examples(8), deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["arch", "wall", "dome"]))
def test_all_supports_moved_as_one_body_change_nothing(seed: int, name: str) -> None:
    """The blocks go along; the least forces stay what they are without a settlement."""
    rng = np.random.default_rng(seed)
    model = {"arch": arch(9), "wall": wall(2, 3, ground="course"), "dome": dome(2, 6)}[name]
    shift, turn = rng.normal(size=3), rng.normal(size=3)
    moves = {
        b.id: (*(shift + np.cross(turn, model.mass.centroid[i])), *turn) for i, b in enumerate(model.blocks) if b.fixed
    }
    result, before = settled(model, moves), check(model, Settings(method="rbe"))
    assert result.verdict == "stable"
    assert result.settled is not None
    assert before.force is not None
    assert np.abs(result.settled.gap).max() < 1e-6 * np.linalg.norm([shift, turn])
    rigid = shift + np.cross(turn, model.mass.centroid)
    assert result.settled.displacement[:, :3] == pytest.approx(rigid, abs=1e-6)
    assert result.force == pytest.approx(before.force, abs=1e-6 * float(np.abs(before.force).max()))


@settings(max_examples=examples(4), deadline=None)
@given(st.floats(1e-6, 1e3), st.floats(1e-3, 1e3))
def test_only_the_direction_of_a_settlement_matters(size: float, scale: float) -> None:
    model = arch(10)  # three hinges: with an odd number there are four, and a sway that costs nothing
    grown = replace(model, blocks=tuple(replace(b, vertices=scale * b.vertices) for b in model.blocks))
    grown = replace(grown, contacts=replace(model.contacts, point=scale * model.contacts.point))
    one = settled(model, {"springer-right": (PARTING, 0, 0)})
    two = settled(grown, {"springer-right": (size * PARTING, 0, 0)})
    assert one.settled is not None
    assert two.settled is not None
    scaled = one.settled.displacement * np.repeat([size, size / scale], 3)
    assert np.abs(two.settled.displacement - scaled).max() < 1e-8 * np.abs(scaled).max()
    assert thrust(two) == pytest.approx(scale**3 * thrust(one), rel=1e-6)


def test_mirrored_settlements_have_mirrored_answers() -> None:
    model = arch(10)
    right = settled(model, {"springer-right": (0, 0, -PARTING)})
    left = settled(model, {"springer-left": (0, 0, -PARTING)})
    assert [len(model.contacts) - 1 - k for k, _ in openings(right)] == [k for k, _ in openings(left)]
    assert [w for _, w in openings(right)] == pytest.approx([w for _, w in openings(left)])


# ---------------------------------------------------------------------------------------------------------------------
# No rest.


def test_what_falls_anyway_falls() -> None:
    thin = arch(20, thickness=0.4)
    result = settled(thin, {"springer-right": (PARTING, 0, 0)})
    assert result.verdict == "unstable"
    assert result.certificate is not None
    assert result.certificate["kind"] == "rbe-mechanism"


def test_locked_blocks_are_named_so() -> None:
    result = settled(beams(0.6, 0.4, 0.3), {"right": (-PARTING, 0, 0)})
    assert (result.verdict, result.certificate) == ("undecided", None)
    assert "locked between the supports" in result.reason


def test_forces_across_a_gap_are_no_rest() -> None:
    """A beam between columns that part: by associated flow it slides down, wedged in gaps. It falls."""
    result = settled(beams(0.6, 0.4, 0.3), {"right": (PARTING, 0, 0)})
    assert (result.verdict, result.certificate) == ("undecided", None)
    assert "dry stone does not do that" in result.reason


# ---------------------------------------------------------------------------------------------------------------------
# The checker: what it must refuse.


def changed(certificate: dict[str, Any], change: Any) -> str:
    data = copy.deepcopy(certificate)
    change(data)
    data["seal"] = seal(data)
    report = verify(data)
    return "proved" if report.proved else report.reason


def test_mutated_certificates_prove_nothing() -> None:
    found = settled(arch(8), {"springer-right": (PARTING, 0, 0)}).certificate
    assert found is not None
    assert found["kind"] == "rbe-settled"
    assert found["settlements"] == {"springer-right": [PARTING, 0, 0, 0, 0, 0]}
    report = verify(found)
    assert report.proved
    assert "comes to rest after an infinitesimal settlement" in report.claim
    ground = found["settlements"]
    for change, line in (
        (lambda d: d["settlements"].update({"springer-right": [-PARTING, 0, 0, 0, 0, 0]}), "closes"),
        (lambda d: d["settlements"].update({"springer-right": [PARTING, 0, -1e-6, 0, 0, 0]}), "closes|does work"),
        (
            lambda d: d["settlements"].update({"springer-right": [PARTING * 1.001, 0, 0, 0, 0, 0]}),
            "closes|does work|has opened",
        ),
        (lambda d: d["settlements"].update({"springer-right": [0.0] * 6}), "closes|does work|no contact point"),
        (lambda d: d["settlements"].clear(), "not an object that names"),
        (lambda d: d["settlements"].update({"v03": ground["springer-right"]}), "no fixed block"),
        (lambda d: d["settlements"].update({"nobody": ground["springer-right"]}), "no fixed block"),
        (lambda d: d["settlements"].update({"springer-right": [1.0]}), "1 numbers instead of 6"),
        (lambda d: d.pop("settlements"), "fields missing"),
        (lambda d: d["mechanism"].update({"v03": [0.0] * 6}), "closes|does work"),
        (lambda d: d["forces"].__setitem__(0, [0.0, 0.0, 0.0]), "balance|cone|does work"),
        (lambda d: d.update(kind="rbe-state"), "unknown field"),
        (lambda d: d["contacts"][0].update(tension=1.0), "no part"),
    ):
        assert re.search(line, changed(found, change)), (line, changed(found, change))


def test_a_state_of_other_forces_is_refused() -> None:
    """The least-norm state balances as well, but bears on what has opened."""
    model = arch(8)
    found = settled(model, {"springer-right": (PARTING, 0, 0)}).certificate
    other = check(model, Settings(method="rbe")).certificate
    assert found is not None
    assert other is not None
    assert "does work" in changed(found, lambda d: d.update(forces=other["forces"]))


def test_forces_across_a_gap_are_refused() -> None:
    """The first two conditions alone would accept the wedged beam; the third does not."""
    from cyclopean.analysis.equilibrium import settlement
    from cyclopean.analysis.preparation import prepare
    from cyclopean.analysis.proving import certify, polished

    model = prepare(beams(0.6, 0.4, 0.3), Settings(method="rbe", settlement=(("right", (PARTING, 0, 0, 0, 0, 0)),)))
    system = model.system()
    assert model.settled is not None
    scaled = model.settled / system.length_unit
    patch = model.contacts.patch[system.used]
    gap = settlement.support_gap(system, scaled[model.contacts.a[patch]], scaled[model.contacts.b[patch]])
    size = float(np.linalg.norm(gap, axis=1).max())
    answer = settlement.solve(settlement._program(system, gap / size), **settlement.conic_options(system.blocks, 1e-10))
    state = next(settlement._candidates(system, gap / size, answer.x, answer.z[: len(system.p)], []))
    assert state.f is not None
    assert state.y is not None
    assert settlement.missed(system, state) < 1e-8
    rows = state.y.reshape(-1, 6) / np.repeat([1.0, system.length_unit], 3) * size * system.length_unit
    force = polished(model, system, state.f).parts
    proof = {"world_force": force, "motion": rows, "settlements": model.settled}
    certificate = certify(model, system, "rbe-settled", proof)
    assert "has opened, but carries a force" in verify(certificate).reason


# ---------------------------------------------------------------------------------------------------------------------
# Refusals, files, the command.


def test_what_is_refused() -> None:
    model = arch(8)
    for said, line in (
        ({"settlement": (("v03", (1.0, 0, 0, 0, 0, 0)),)}, "is no support"),
        ({"settlement": (("nobody", (1.0, 0, 0, 0, 0, 0)),)}, "not in the model"),
        ({"settlement": (("springer-right", (1.0, 0, 0, 0, 0, 0)),), "method": "cra"}, "only rigid-block equilibrium"),
        ({"settlement": (("springer-right", (1.0, 0, 0, 0, 0, 0)),), "tension": 1.0}, "do not go together"),
        ({"settlement": (("springer-right", (1.0, 0, 0, 0, 0, 0)),), "penalty": True}, "does not go with"),
        ({"settlement": (("springer-right", (1.0, 0, 0, 0, 0, 0)),), "cone": "inscribed:8"}, "leave out settlement"),
        ({"settlement": (("springer-right", (1.0, 0, 0, 0, 0, 0)),), "solver": "clarabel"}, "exact cones alone"),
        ({"settlement": (("springer-right", (1.0, 0, 0)),)}, "six finite numbers"),
    ):
        with pytest.raises(InputError, match=line):
            check(model, Settings(**said))


def test_a_support_that_nothing_touches() -> None:
    model = arch(8)
    apart = replace(model.blocks[0], id="apart", vertices=model.blocks[0].vertices - np.array([50.0, 0, 0]))
    result = settled(replace(model, blocks=(*model.blocks, apart)), {"apart": (0, 0, -1.0)})
    assert result.verdict == "stable"
    assert any("changes nothing" in line for line in result.warnings)


def test_files_and_reports(tmp_path) -> None:
    model = replace(arch(8), settlements=(Settlement(9, np.array([PARTING, 0, 0, 0, 0, 0])),))
    write_model(tmp_path / "m.json", model)
    again, warnings = read_model(tmp_path / "m.json")
    assert warnings == ()
    assert again.settlements[0].motion.tolist() == [PARTING, 0, 0, 0, 0, 0]
    result = check(again)
    assert (result.method, result.verdict) == ("rbe", "stable")
    assert any("so the method is rbe" in line for line in result.warnings)
    data = result_dict(result)["settlement"]
    assert data["ground"] == {"springer-right": [PARTING, 0, 0, 0, 0, 0]}
    assert len(data["openings"]) == 3
    assert "After the settlement" in report_html(result)
    raw = json.loads((tmp_path / "m.json").read_text()) | {"units": "mm"}
    (tmp_path / "m.json").write_text(json.dumps(raw))
    assert read_model(tmp_path / "m.json")[0].settlements[0].motion[0] == pytest.approx(1e-3 * PARTING)
    raw["settlements"][0]["motion"] = [1, 2, 3]
    (tmp_path / "m.json").write_text(json.dumps(raw))
    with pytest.raises(InputError, match="found 3 numbers"):
        read_model(tmp_path / "m.json")


def test_the_command(run, tmp_path) -> None:
    write_model(tmp_path / "m.json", arch(8))
    status, out, _ = run("check", "m.json", "--settlement", "springer-right:0.01,0,0", "--certificate", "c.json")
    assert status == 0
    assert "opened   v04 and v05 by" in out
    assert "comes to rest" in run("verify", "c.json")[1]
    for argv in (("springer-right",), ("springer-right:1,2",), ("springer-right:a,0,0",), ("v03:0,0,1",)):
        status, _, err = run("check", "m.json", "--settlement", *argv)
        assert (status, len(err.splitlines())) == (2, 1)


def test_other_loads_and_vaults() -> None:
    """A load at the side moves the hinges; a vault settles as its arches do."""
    model = arch(12, thickness=1.2)
    push = Load(4, np.array([0.0, 0.0, -1.5e5]), model.mass.centroid[4])
    plain, pushed = (settled(replace(model, loads=x), {"springer-right": (PARTING, 0, 0)}) for x in ((), (push,)))
    assert plain.verdict == pushed.verdict == "stable"
    assert [k for k, _ in openings(plain)] != [k for k, _ in openings(pushed)]
    whole = vault(6, 2)
    right = {b.id: (PARTING, 0.0, 0.0) for i, b in enumerate(whole.blocks) if b.fixed and whole.mass.centroid[i, 0] > 0}
    assert settled(whole, right).verdict == "stable"
