"""Loads on faces and throughout volumes, cases, combinations; friction of pairs of materials.

By hand, for a unit cube with one corner at the origin: a pressure of 5 Pa on its top (area 1 m2) is 5 N down at
(0.5, 0.5, 1); a traction of (2, 0, 0) Pa there is 2 N along x; a body force of (0, 3, 0) N/m3 is 3 N at its centre, and
so is an acceleration of (0, 3, 0) m/s2 at 1 kg/m3. A closed body under one pressure all around feels nothing: the area
vectors of its faces add up to zero, and so do their moments.

A cube pushed sideways at its centre slides when the push exceeds mu W; with wind x 1.5 and weight x 0.9 that is at
1.5 H > 0.9 mu W.
"""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupled_cases import prism
from cyclopean.analysis import Settings, check
from cyclopean.analysis.preparation import prepare
from cyclopean.assembly import (
    Assembly,
    BodyLoad,
    Combination,
    FrictionPair,
    Load,
    SurfaceLoad,
    detect,
    load_cases,
    loading,
    paired_friction,
    part,
    resolved_loads,
)
from cyclopean.design import stack
from cyclopean.errors import InputError
from cyclopean.io import read_model, write_model
from cyclopean.proof import verify
from cyclopean.statics import body_loads
from laws import examples

G = 9.80665
CUBE = prism("b", [(0, 0), (1, 0), (1, 1), (0, 1)], 1.0)
BASE = replace(prism("base", [(-1, -1), (2, -1), (2, 0), (-1, 0)], 1.0), fixed=True, material="granite")
TOP = [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
FREE = np.zeros(3)


def wrench(model: Assembly, density: float = 1.0) -> list[float]:
    """Force and moment about the centre of mass of the first block, without its weight."""
    return body_loads(resolved_loads(model, loading(model), density), FREE, density)[0].tolist()


def test_a_pressure_by_hand() -> None:
    top = next(k for k, face in enumerate(CUBE.faces) if (CUBE.vertices[list(face), 2] == 1.0).all())
    for where in ({"face": top}, {"polygon": np.array(TOP, float)}, {"polygon": np.array(TOP[::-1], float)}):
        model = Assembly((CUBE,), actions=(SurfaceLoad(0, pressure=5.0, **where),))
        assert wrench(model) == pytest.approx([0, 0, -5, 0, 0, 0], abs=1e-15)
        model = Assembly((CUBE,), actions=(SurfaceLoad(0, traction=np.array([2.0, 0, 0]), **where),))
        assert wrench(model) == pytest.approx([2, 0, 0, 0, 1, 0], abs=1e-15)  # 2 N, 0.5 m above the centre


def test_part_of_a_face() -> None:
    """Half of the top, x > 1/2: half the force, a quarter of a metre off."""
    half = np.array([[0.5, 0, 1], [1, 0, 1], [1, 1, 1], [0.5, 1, 1.0]])
    model = Assembly((CUBE,), actions=(SurfaceLoad(0, polygon=half, pressure=8.0),))
    assert wrench(model) == pytest.approx([0, 0, -4, 0, 1, 0], abs=1e-15)


def test_body_forces_by_hand() -> None:
    for load in (
        BodyLoad(0, body=np.array([0, 3.0, 0])),
        BodyLoad(group="g", body=np.array([0, 3.0, 0])),
        BodyLoad(acceleration=np.array([0, 3.0, 0])),
        BodyLoad(0, force=np.array([0, 3.0, 0])),
    ):
        model = Assembly((replace(CUBE, group="g"), replace(BASE, group="other")), actions=(load,))
        assert wrench(model) == pytest.approx([0, 3, 0, 0, 0, 0], abs=1e-15)
        other = resolved_loads(model, None, 1.0).loads[1:]
        assert [x.block for x in other] == ([1] if load.block is None and load.group is None else [])
    heavy = Assembly((replace(CUBE, density=7.0),), actions=(BodyLoad(acceleration=np.array([0, 3.0, 0])),))
    assert wrench(heavy)[1] == pytest.approx(21.0)


@settings(max_examples=examples(30), deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-1e6, 1e6))
def test_a_body_in_still_water_feels_no_pressure(seed: int, pressure: float) -> None:
    """Any closed mesh, not flat faces included: the areas add up to zero."""
    rng = np.random.default_rng(seed)
    vertices = CUBE.vertices @ rng.normal(size=(3, 3)) + rng.normal(size=3)
    if np.linalg.det(vertices[[1, 3, 4]] - vertices[0]) < 0.0:
        vertices = vertices * [1.0, 1.0, -1.0]
    block = replace(CUBE, vertices=vertices)
    all_around = tuple(SurfaceLoad(0, face=k, pressure=pressure) for k in range(len(CUBE.faces)))
    size = abs(pressure) * (1.0 + np.abs(vertices).max()) ** 3
    assert np.abs(wrench(Assembly((block,), actions=all_around))).max() <= 1e-12 * size + 1e-300


def test_an_acceleration_of_all_blocks_is_gravity() -> None:
    """Gravity of half a g sideways: as acceleration, or in `gravity`."""
    model = stack(2)
    sideways = np.array([3.0, 1.0, 0.0])
    loads = prepare(replace(model, actions=(BodyLoad(acceleration=sideways),)), Settings())
    other = prepare(model, Settings(gravity=(3.0, 1.0, -G)))
    one, two = (m.system().p * scale for m, scale in ((loads, 1.0), (other, 1.0)))
    assert one == pytest.approx(two, rel=1e-12, abs=1e-12)


def pushed(wind: float = 1.0, **more: Any) -> Assembly:
    """A cube of 1 kg/m3, mu 0.5, on a base; a wind on its side of so many Pa times its weight."""
    side = next(k for k, face in enumerate(CUBE.faces) if (CUBE.vertices[list(face), 0] == 0.0).all())
    blow = SurfaceLoad(1, face=side, pressure=wind * G, case="wind")
    rows = {
        "combinations": (Combination("calm", (("wind", 0.0),)), Combination("storm", (("self", 0.9), ("wind", 1.5))))
    }
    return Assembly((BASE, replace(CUBE, density=1.0)), actions=(blow,), **(rows | more))


def test_combinations_by_hand() -> None:
    """The limit without factors is a wind of 0.5 weights; in a storm it is 0.5 x 0.9 / 1.5 = 0.3."""
    for wind, said, word in (
        (0.49, {}, "stable"),
        (0.51, {}, "unstable"),
        (9.0, {"combination": "calm"}, "stable"),
        (0.29, {"combination": "storm"}, "stable"),
        (0.31, {"combination": "storm"}, "unstable"),
        (0.31, {"combination": "storm", "factors": (("wind", 1.0),)}, "stable"),
        (0.31, {"factors": (("wind", 2.0),)}, "unstable"),
        (0.49, {"factors": (("self", 0.5),)}, "unstable"),
    ):
        result = check(pushed(wind), Settings(mu=0.5, method="rbe", **said))
        assert result.verdict == word, (wind, said)
        assert result.assumed == check(pushed(0.0), Settings(mu=0.5, method="rbe")).assumed


def test_a_case_that_a_combination_does_not_name_is_left_out() -> None:
    """Its factor is 0, that of the weight 1."""
    model = replace(pushed(9.0), combinations=(Combination("bare", ()),))
    result = check(model, Settings(mu=0.5, method="rbe", combination="bare"))
    assert result.verdict == "stable"
    assert result.loading is not None
    assert result.loading.factors == {"self": 1.0, "wind": 0.0}
    assert result.loading.words() == "bare: self x 1, wind x 0"


def test_a_certificate_holds_forces_at_points_only() -> None:
    """1.5 x 0.2 weights at the middle of the side; a case with factor 0 is not there."""
    result = check(pushed(0.2), Settings(mu=0.5, combination="storm"))
    assert result.certificate is not None
    (load,) = result.certificate["loads"]
    assert load["force"] == pytest.approx([0.3 * G, 0, 0])
    assert load["point"] == pytest.approx([0, 0.5, 0.5])
    assert result.certificate["gravity"] == pytest.approx([0, 0, -0.9 * G])
    assert verify(result.certificate).proved
    calm = check(pushed(0.2), Settings(mu=0.5, combination="calm")).certificate
    assert calm is not None
    assert calm["loads"] == []


def test_plain_models_are_left_alone() -> None:
    """Nothing is computed anew where there is nothing to resolve: certificates stay as they are to the last bit."""
    model = replace(stack(2), loads=(Load(1, np.array([1.0, 0, 0]), np.zeros(3)),))
    assert loading(model) is None
    assert resolved_loads(model, None, 2400.0) is model
    result = check(model, Settings())
    assert result.loading is None
    assert load_cases(model) == ("self", "dead")


def test_statics_refuses_what_is_not_resolved() -> None:
    model = Assembly((CUBE,), actions=(BodyLoad(0, body=np.ones(3)),))
    with pytest.raises(InputError, match="resolved"):
        body_loads(model, FREE, 1.0)


REFUSED = [
    ({"actions": (SurfaceLoad(0, face=9, pressure=1.0),)}, "has no face 9"),
    ({"actions": (BodyLoad(group="roof", body=np.ones(3)),)}, "no block belongs to group 'roof'"),
    ({"actions": (BodyLoad(5, body=np.ones(3)),)}, "out of range"),
    ({"combinations": (Combination("a", (("wnd", 1.5),)),)}, "no load has the case 'wnd'"),
    ({"combinations": (Combination("a", ()), Combination("a", ()))}, "stands twice"),
    ({"friction": (FrictionPair("granite", "gold", 0.1),)}, "no block has the material 'gold'"),
    ({"friction": (FrictionPair("granite", "granite", 0.1),) * 2}, "stands twice"),
]


@pytest.mark.parametrize(("change", "line"), REFUSED, ids=[line for _, line in REFUSED])
def test_refusals(change: dict[str, Any], line: str) -> None:
    with pytest.raises(InputError, match=line):
        Assembly((replace(CUBE, material="granite"),), **change)


def test_surface_loads_off_their_block_are_refused() -> None:
    for polygon, line in (
        (np.array(TOP) + np.array([0, 0, 0.5]), "off the faces"),
        (np.array([[0, 0, 1], [1, 0, 1.4], [1, 1, 1.4], [0, 1, 1.0]]), "not along|off the faces"),
        (np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1.5], [0, 1, 1.0]]), "not flat"),
        (np.array([[0, 0, 1], [1, 0, 1], [0.5, 0, 1.0]]), "no area"),
    ):
        with pytest.raises(InputError, match=line):
            wrench(Assembly((CUBE,), actions=(SurfaceLoad(0, polygon=polygon, pressure=1.0),)))


def test_half_said_loads_are_refused() -> None:
    for make in (
        lambda: SurfaceLoad(0, pressure=1.0),
        lambda: SurfaceLoad(0, face=0, polygon=np.array(TOP), pressure=1.0),
        lambda: SurfaceLoad(0, face=0),
        lambda: SurfaceLoad(0, face=0, pressure=np.inf),
        lambda: BodyLoad(0),
        lambda: BodyLoad(0, "g", body=np.ones(3)),
        lambda: Load(0, np.ones(3), np.ones(3), case="self"),
        lambda: Combination("a", (("b", 1.0), ("b", 2.0))),
    ):
        with pytest.raises(InputError):
            make()


def test_friction_of_pairs() -> None:
    """Granite on granite 0.9, granite on lead 0.1; what a contact says itself wins; the rest is assumed."""
    three = [replace(b, material=m) for b, m in zip(stack(2).blocks, ("granite", "lead", "granite"), strict=True)]
    pairs = (FrictionPair("lead", "granite", 0.1), FrictionPair("granite", "granite", 0.9))
    model = Assembly(tuple(three), friction=pairs)
    contacts, unsaid = paired_friction(model, detect(model).contacts)
    assert (contacts.mu.tolist(), unsaid) == ([0.1, 0.1], ())
    own = replace(contacts, mu=np.array([0.4, np.nan]))
    assert paired_friction(model, own)[0].mu.tolist() == [0.4, 0.1]
    result = check(replace(model, friction=pairs[1:]), Settings())
    assert set(result.contacts.mu.tolist()) == {0.84}
    assert "mu" in result.assumed
    assert any("granite on lead" in line for line in result.warnings)
    assert check(model, Settings(tilt=(5.0, 0.0))).verdict == "stable"  # tan 5 = 0.087
    assert check(model, Settings(tilt=(6.0, 0.0))).verdict == "unstable"  # tan 6 = 0.105


def test_part_of_a_model_takes_its_loads_along() -> None:
    """The base goes; what is left moves up by one metre, its polygons and points with it."""
    calm = Combination("calm", (("wind", 0.0), ("base", 2.0)))
    model = pushed(0.2, loads=(Load(0, np.ones(3), np.zeros(3), "base"), Load(1, np.ones(3), np.zeros(3))))
    model = replace(model, combinations=(calm,), friction=(FrictionPair("granite", "granite", 0.3),))
    more = SurfaceLoad(1, polygon=np.array(TOP, float), pressure=5.0)
    model = replace(model, actions=(*model.actions, more, BodyLoad(0, body=np.ones(3)), BodyLoad(body=np.ones(3))))
    up = np.array([0.0, 0, 1])
    moved = (replace(model.blocks[1], vertices=model.blocks[1].vertices + up),)
    found = part(model, moved, None, np.array([-1, 0]), lambda block, points: points + up)
    assert [load.block for load in found.loads] == [0]
    assert found.loads[0].point.tolist() == [0, 0, 1]
    assert [load.block for load in found.actions] == [0, 0, None]
    assert found.combinations == (Combination("calm", (("wind", 0.0),)),)
    assert found.friction == ()
    assert resolved_loads(found, None, 1.0).loads[2].point == pytest.approx([0.5, 0.5, 2.0])


# ---------------------------------------------------------------------------------------------------------------------
# Files and the command.


def test_all_of_it_goes_through_a_file(tmp_path) -> None:
    model = pushed(
        0.2,
        loads=(Load(1, np.array([1.0, 2, 3]), np.array([0.1, 0.2, 0.3]), "live"),),
        friction=(FrictionPair("granite", "granite", 0.3),),
    )
    more = (
        SurfaceLoad(1, polygon=np.array(TOP, float), traction=np.array([1.0, 2, 3])),
        BodyLoad(1, body=np.ones(3), case="live"),
        BodyLoad(group="g", acceleration=np.ones(3)),
        BodyLoad(1, force=np.array([3.0, 2, 1])),
    )
    blocks = (model.blocks[0], replace(model.blocks[1], group="g"))
    model = replace(model, blocks=blocks, actions=(*model.actions, *more))
    write_model(tmp_path / "a.json", model)
    again, warnings = read_model(tmp_path / "a.json")
    write_model(tmp_path / "b.json", again)
    assert warnings == ()
    assert (tmp_path / "a.json").read_text() == (tmp_path / "b.json").read_text()
    assert [x.case for x in (*again.loads, *again.actions)] == ["live", "wind", "dead", "live", "dead", "dead"]
    assert again.combinations == model.combinations
    assert again.friction == model.friction
    one, two = (resolved_loads(m, loading(m), 2400.0).loads for m in (model, again))
    assert [(x.force.tolist(), x.point.tolist()) for x in one] == [(x.force.tolist(), x.point.tolist()) for x in two]


def test_lengths_of_loads_are_in_the_files_units(tmp_path) -> None:
    write_model(
        tmp_path / "m.json",
        replace(pushed(0.0), actions=(SurfaceLoad(1, polygon=np.array(TOP), pressure=5.0),), combinations=()),
    )
    data = json.loads((tmp_path / "m.json").read_text()) | {"units": "mm"}
    (tmp_path / "m.json").write_text(json.dumps(data))
    (load,) = resolved_loads(read_model(tmp_path / "m.json")[0], None, 1.0).loads
    assert load.force == pytest.approx([0, 0, -5e-6])


BAD = [
    ({"loads": [{"block": "b", "pressure": 1.0}]}, 'acts on a "face" or on a "polygon"'),
    ({"loads": [{"block": "b", "pressure": 1.0, "face": 1.5}]}, "face must be a whole number"),
    ({"loads": [{"block": "b", "pressure": 1.0, "force": [1, 0, 0]}]}, "make two loads of it"),
    ({"loads": [{"block": "b", "body": [0, 0, 1], "case": "self"}]}, "is the weight of the blocks"),
    ({"loads": [{"body": [0, 0, 1], "group": "x"}]}, "no block belongs to group 'x'"),
    ({"loads": [{"force": [0, 0, 1]}]}, 'has no "block"'),
    ({"combinations": [{"name": "a", "factors": {"wind": 1}}]}, "no load has the case 'wind'"),
    ({"combinations": [{"name": "a", "factors": {"self": None}}]}, "not a finite number"),
    ({"combinations": [{"factors": {}}]}, 'has no "name"'),
    ({"friction": [{"pair": ["granite"], "mu": 0.5}]}, "must name two materials"),
    ({"friction": [{"pair": ["granite", "granite"], "mu": -0.5}]}, "not negative"),
    ({"friction": [{"pair": ["granite", "gold"], "mu": 0.5}]}, "no block has the material 'gold'"),
]


@pytest.mark.parametrize(("change", "line"), BAD, ids=[line for _, line in BAD])
def test_bad_files(tmp_path, change: dict[str, Any], line: str) -> None:
    write_model(tmp_path / "m.json", Assembly((BASE, CUBE)))
    data = json.loads((tmp_path / "m.json").read_text()) | change
    (tmp_path / "m.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match=line) as caught:
        read_model(tmp_path / "m.json")
    assert "m.json" in str(caught.value)


def test_the_command(run, tmp_path) -> None:
    write_model(tmp_path / "m.json", pushed(0.31))
    rbe = ("--mu", "0.5", "--method", "rbe", "--no-margins")
    assert run("check", "m.json", *rbe)[0] == 0
    status, out, _ = run("check", "m.json", *rbe, "--combination", "storm", "--json", "r.json", "--report", "r.html")
    assert status == 1
    assert "storm: self x 0.9, wind x 1.5" in out
    assert json.loads((tmp_path / "r.json").read_text())["loading"] == {
        "combination": "storm",
        "factors": {"self": 0.9, "wind": 1.5},
    }
    assert "storm: self x 0.9, wind x 1.5" in (tmp_path / "r.html").read_text()
    assert run("check", "m.json", *rbe, "--combination", "storm", "--factor", "wind=1", "--factor", "self=1")[0] == 0
    status, out, _ = run("check", "m.json", *rbe, "--all-combinations")
    assert status == 1
    assert [line.split()[:2] for line in out.splitlines()] == [["calm", "stable"], ["storm", "unstable"]]
    for argv, line in (
        (("--combination", "rain"), "the model has no such combination; it has 'calm', 'storm'"),
        (("--factor", "rain=2"), "no load has this case"),
        (("--factor", "wind"), "should be NAME=X, a name and a number"),
        (("--factor", "wind=1", "--factor", "wind=2"), "stands twice"),
        (("--all-combinations", "--json", "r2.json"), "prints a table"),
    ):
        status, _, err = run("check", "m.json", *rbe, *argv)
        assert (status, len(err.splitlines())) == (2, 1)
        assert line in err
