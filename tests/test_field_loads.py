"""Earth, water and fill on the faces that look at them.

By hand. Coulomb's coefficients against printed tables (Das, Principles of Foundation Engineering, tables of active and
passive coefficients on an upright back with a level ground), and against a search over all plane wedges, whose
equilibrium is that of three forces. A gravity wall b wide and h high, of density rho, under the pressure K gamma z and
the surcharge q: it slides where K (gamma h2 / 2 + q h) = mu rho g b h, it tips where K (gamma h3 / 6 + q h2 / 2) =
rho g b2 h / 2. Water up to its top: gamma h2 / 2 at h / 3, and uplift in its foot, falling in a line to nothing, gamma
h b / 2 at b / 3 from the water. Fill on an arch weighs gamma times the area between extrados and road.
"""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from coupled_cases import prism
from cyclopean.analysis import Settings
from cyclopean.analysis.preparation import prepare
from cyclopean.assembly import Assembly, Earth, Fill, Road, Water, detect, earth_coefficient, resolved_fields
from cyclopean.assembly.field_loads import FieldLoad
from cyclopean.design import arch, bridge, retaining, stack, wall
from cyclopean.design.earthworks import BridgeShape, DryStone, Soil
from cyclopean.errors import InputError
from cyclopean.io import read_model, write_model
from cyclopean.proof import verify
from cyclopean.statics import body_loads
from laws import examples

G, GAMMA = 9.80665, 18_000.0
LEFT = Earth(side=180.0, state="active", friction=30.0, unit_weight=GAMMA)
ROUNDING = 1e-12


def under(model: Assembly, *rows: FieldLoad) -> Assembly:
    return replace(model, actions=rows)


def wrenches(model: Assembly) -> np.ndarray:
    """(n, 6) force and moment about the centre of mass of each block, without its weight."""
    contacts = detect(model).contacts if model.contacts is None else model.contacts
    return body_loads(resolved_fields(model, contacts)[0], np.zeros(3), 0.0)


def total(model: Assembly) -> np.ndarray:
    """(6,) force, and moment about the origin, on blocks that are free."""
    loads = [x for x in resolved_fields(model, model.contacts)[0].loads if not model.blocks[x.block].fixed]
    return np.concatenate([sum(x.force for x in loads), sum(np.cross(x.point, x.force) for x in loads)])


@pytest.mark.parametrize(
    ("state", "friction", "wall_friction", "printed"),
    [
        ("active", 30, 0, 0.3333),
        ("active", 30, 10, 0.3085),
        ("active", 30, 20, 0.2973),
        ("active", 36, 10, 0.2426),
        ("active", 40, 20, 0.1994),
        ("passive", 20, 5, 2.313),
        ("passive", 30, 0, 3.000),
        ("passive", 30, 10, 4.143),
        ("passive", 35, 10, 5.310),
        ("passive", 40, 0, 4.600),
        ("rest", 30, 0, 0.5),
    ],
)
def test_coefficients_are_those_of_the_tables(state, friction, wall_friction, printed) -> None:
    assert earth_coefficient(state, friction, wall_friction) == pytest.approx(printed, rel=3e-4)


def wedge(state: str, friction: float, wall: float, back: float, slope: float, seismic=(0.0, 0.0)) -> float:
    """Twice the push on a wall of unit height by unit earth, over all plane wedges: three forces in balance."""
    phi, delta, theta, beta = np.radians([friction, wall, back, slope])
    sign = 1.0 if state == "active" else -1.0
    rho = np.radians(np.arange(abs(slope) + 0.01, 89.9 - max(back, 0.0) * 0, 0.005))
    top = np.array([-np.tan(theta), 1.0])  # of the back; its foot is the origin, the earth lies towards +x
    far = (1.0 + np.tan(theta) * np.tan(beta)) / (np.tan(rho) - np.tan(beta))  # where the plane meets the ground
    area = 0.5 * np.abs(far * top[1] - far * np.tan(rho) * top[0])
    area = np.where(far > 0.0, area, np.nan)
    weight = np.stack([-seismic[0] * area, -(1.0 - seismic[1]) * area])
    lean = theta + sign * delta  # the wall's reply: towards the earth and up along the back where it is active
    push = np.array([np.cos(lean), np.sin(lean)])
    plane = np.stack([-np.sin(rho - sign * phi), np.cos(rho - sign * phi)])  # what the ground replies
    force = -(weight[0] * plane[1] - weight[1] * plane[0]) / (push[0] * plane[1] - push[1] * plane[0])
    force = force[(force > 0.0) & np.isfinite(force)]
    return 2.0 * float(force.max() if state == "active" else force.min())


@pytest.mark.parametrize(
    ("state", "angles", "seismic"),
    [
        ("active", (30.0, 20.0, 0.0, 0.0), (0.0, 0.0)),
        ("active", (33.0, 15.0, 12.0, 10.0), (0.0, 0.0)),
        ("active", (38.0, 25.0, -10.0, 15.0), (0.0, 0.0)),
        ("active", (35.0, 17.0, 5.0, 5.0), (0.15, 0.05)),
        ("passive", (30.0, 10.0, 0.0, 0.0), (0.0, 0.0)),
        ("passive", (28.0, 8.0, 6.0, 5.0), (0.0, 0.0)),
    ],
)
def test_no_plane_wedge_pushes_otherwise(state, angles, seismic) -> None:
    friction, delta, back, slope = angles
    formula = earth_coefficient(state, friction, delta, back=back, slope=slope, seismic=seismic) * (1.0 - seismic[1])
    assert formula == pytest.approx(wedge(state, friction, delta, back, slope, seismic), rel=2e-5)


def gravity_wall(b: float, h: float, *rows: FieldLoad, mu: float = 0.6) -> Assembly:
    return under(stack(1, (b, 1.0, h), mu=mu, density=2400.0), *rows)


@pytest.mark.parametrize(("b", "mu"), [(0.8, 0.4), (0.6, 0.9)])
def test_a_gravity_wall_slides_or_tips_by_hand(b, mu) -> None:
    h, k = 2.0, 1.0 / 3.0
    weight = 2400.0 * G * b * h
    slides = (mu * weight - k * GAMMA * h * h / 2.0) / (k * h)
    tips = (weight * b / 2.0 - k * GAMMA * h**3 / 6.0) / (k * h * h / 2.0)
    model = gravity_wall(b, h, LEFT, mu=mu)
    found = cyclopean.limit(model, surcharge=1000.0)
    assert found.value == pytest.approx(min(slides, tips) / 1000.0, rel=1e-6)
    assert verify(found.certificate).proved
    for share, verdict in ((0.999, "stable"), (1.001, "unstable")):
        checked = cyclopean.check(model, surcharge=share * min(slides, tips), method="rbe")
        assert checked.verdict == verdict
        assert "active by Coulomb's wedge" in checked.loading.words()
        assert verify(checked.certificate).proved


def test_friction_of_the_wall_pulls_it_down() -> None:
    """P at delta below the level: level part K cos(delta) gamma h2 / 2 at a third of the height."""
    force = total(gravity_wall(1.0, 3.0, replace(LEFT, wall_friction=20.0)))
    size = earth_coefficient("active", 30.0, 20.0) * GAMMA * 9.0 / 2.0
    assert force[:3] == pytest.approx([size * np.cos(np.radians(20)), 0, -size * np.sin(np.radians(20))], abs=1e-9)
    assert force[4] == pytest.approx(1.0 * force[0] - 0.0 * force[2], rel=ROUNDING)  # about y: z Fx - x Fz


def test_water_and_its_uplift_by_hand() -> None:
    b, h = 1.5, 2.0
    water = Water(side=180.0, head=h, unit_weight=10_000.0)
    free = wrenches(gravity_wall(b, h, water))[1]
    assert free == pytest.approx([10_000 * h * h / 2, 0, 0, 0, 20_000.0 * (h / 3 - h / 2), 0], abs=1e-9)
    whole, lined = (wrenches(gravity_wall(b, h, replace(water, uplift=way)))[1] - free for way in ("full", "linear"))
    assert whole == pytest.approx([0, 0, 10_000 * h * b, 0, 0, 0], abs=1e-8)
    assert lined == pytest.approx([0, 0, 10_000 * h * b / 2, 0, 15_000 * (b / 2 - b / 3), 0], abs=1e-8)
    above = resolved_fields(gravity_wall(b, h, replace(water, head=2.5)), gravity_wall(b, h).contacts)[1]
    assert "0.5 m above the highest stone" in above[0]


def turned(model: Assembly, degrees: float) -> Assembly:
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    blocks = tuple(replace(block, vertices=block.vertices @ turn.T) for block in model.blocks)
    return replace(model, blocks=blocks, contacts=None)


@settings(max_examples=examples(3), deadline=None)
@given(st.floats(0.0, 360.0), st.floats(0.3, 1.5), st.floats(0.0, 25.0), st.sampled_from(["active", "rest"]))
def test_pressures_turn_with_the_wall_and_add_up(azimuth, height, delta, state) -> None:
    """Neither how the wall is cut into stones nor where it looks matters; earth and water add up."""
    earth = replace(LEFT, side=90.0, state=state, wall_friction=delta, height=height, surcharge=3000.0, foot=0.0)
    water = Water(side=90.0, head=0.8 * height, foot=0.0, uplift="linear")
    cut, whole = wall(3, 5, length=0.4, height=0.2), prism("b", [(0, 0), (1.2, 0), (1.2, 1.0), (0, 1.0)], 0.2)
    solid = Assembly((whole,), contacts=cut.contacts.only(np.zeros(0, int)))
    assert total(under(cut, earth)) == pytest.approx(total(under(solid, earth)), rel=1e-9, abs=1e-6)
    apart = wrenches(under(cut, earth)) + wrenches(under(cut, water))
    assert wrenches(under(cut, earth, water)) == pytest.approx(apart, rel=1e-9, abs=1e-6)
    there = wrenches(under(turned(cut, azimuth), replace(earth, side=90.0 + azimuth)))
    assert np.linalg.norm(there[:, :2], axis=1) == pytest.approx(
        np.linalg.norm(wrenches(under(cut, earth))[:, :2], axis=1), rel=1e-6, abs=1e-4
    )


@settings(max_examples=examples(2), deadline=None)
@given(st.floats(0.2, 0.9), st.floats(0.0, 4000.0), st.floats(1.02, 1.5))
def test_more_soil_never_helps_a_wall_that_it_pushes(height, surcharge, more) -> None:
    """Smooth earth pushes level: what a push away from it may still add never grows with height, load or weight."""
    model = wall(2, 4, length=0.5, depth=0.5, height=0.25, mu=0.7, density=2400.0)
    earth = replace(LEFT, side=90.0, height=height, surcharge=surcharge)
    grown = (
        replace(earth, height=min(more * height, 1.0)),
        replace(earth, surcharge=more * surcharge + 100.0),
        replace(earth, unit_weight=more * GAMMA),
    )
    bears = cyclopean.limit(under(model, earth), push=(0.0, -1.0, 0.0))
    for other in grown:
        left = cyclopean.limit(under(model, other), push=(0.0, -1.0, 0.0))
        assert left.word == "falls" or left.lower <= bears.upper


def test_only_what_lies_open_is_pressed() -> None:
    """Two leaves: the one behind shows where it stands above the other; a group hides nothing of another."""
    front = prism("front", [(0, 0), (0.2, 0), (0.2, 2.0), (0, 2.0)], 1.0)
    back = replace(prism("back", [(0.2, 0), (0.4, 0), (0.4, 1.5), (0.2, 1.5)], 1.0), group="back")
    model = Assembly((front, back), contacts=stack(1).contacts.only(np.zeros(0, int)))
    earth = replace(LEFT, side=0.0, state="rest")
    force = wrenches(under(model, earth))[:, 0]
    assert -force == pytest.approx([0.5 * GAMMA * 0.5**2 / 2, 0.5 * GAMMA * (2.0**2 - 0.5**2) / 2], rel=1e-9)
    alone = wrenches(under(model, replace(earth, group="back")))[:, 0]
    assert -alone == pytest.approx([0.0, 0.5 * GAMMA * 1.5**2 / 2], abs=1e-9)


def test_fill_on_an_arch_against_statics() -> None:
    """Weight and place of the fill on each voussoir by quadrature; forces carry it and the stones to the springings."""
    model = under(arch(9, span=4.0, thickness=0.4, density=2000.0, mu=0.8), Fill(height=3.0, unit_weight=GAMMA))
    loads = {load.block: load for load in resolved_fields(model, model.contacts)[0].loads}
    radius, half = 2.4, np.linspace(-np.pi / 2, np.pi / 2, 10)
    for k, (a, b) in enumerate(pairwise(half), 1):
        (x0, x1), (z0, z1) = radius * np.sin([a, b]), radius * np.cos([a, b])
        depth = 3.0 - (z0 + z1) / 2.0
        assert loads[k].force == pytest.approx([0, 0, -GAMMA * depth * (x1 - x0)], rel=1e-6, abs=1e-6)
        x = np.linspace(x0, x1, 20001)
        deep = 3.0 - np.interp(x, [x0, x1], [z0, z1])
        assert loads[k].point[0] == pytest.approx(np.trapezoid(x * deep, x) / np.trapezoid(deep, x), abs=1e-6)
    found = cyclopean.check(model, method="rbe")
    assert found.verdict == "stable"
    carried = sum(found.force[found.contacts.start[k] : found.contacts.start[k + 1], 0].sum() for k in (0, 9))
    free = model.mass.volume[1:-1].sum() * 2000.0 * G - sum(x.force[2] for b, x in loads.items() if 0 < b < 10)
    assert carried == pytest.approx(free, rel=1e-6)  # level springings: their normals are upright


def test_level_pressure_squeezes_haunches() -> None:
    model = arch(9, span=4.0, thickness=0.4)
    plain, held = (wrenches(under(model, Fill(height=3.0, unit_weight=GAMMA, level=k))) for k in (0.0, 0.4))
    assert held[:, 2] == pytest.approx(plain[:, 2], rel=1e-9)
    assert (held[1:5, 0] > 0.0).all()  # from the left towards the crown
    assert held[:, 0].sum() == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("spread", [0.0, 30.0, "boussinesq"])
def test_all_of_a_load_arrives_where_it_stands(spread) -> None:
    model = under(arch(12, span=4.0, thickness=0.4), Fill(height=3.0, unit_weight=GAMMA, spread=spread))
    road = Road.of(model)
    for x in (-0.4, 0.0, 0.3):
        loads = road.loads(x, 1000.0)
        assert sum(load.force[2] for load in loads) == pytest.approx(-1000.0, rel=1e-9)
        assert -sum(load.force[2] * load.point[0] for load in loads) / 1000.0 == pytest.approx(x, abs=1e-3)
    assert (len(road.loads(0.1, 1.0)) > 1) == (spread != 0.0)


def test_a_load_moved_by_symmetry() -> None:
    """What an arch bears at x it bears at -x, and the answer is the least of all places."""
    model = under(
        arch(8, span=3.0, thickness=0.3, mu=0.7, density=2400.0), Fill(height=2.0, unit_weight=GAMMA, spread=26.6)
    )
    found = cyclopean.limit(model, along="-1.2:1.2", steps=4)
    bears = [one.value for one in found.travelling.results]
    assert bears == pytest.approx(bears[::-1], rel=2e-6)
    assert found.value == min(bears)
    one = cyclopean.limit(model, live_at=f"x={found.travelling.at}")
    assert one.value == pytest.approx(found.value, rel=2e-6)


def test_a_push_from_every_side() -> None:
    """A block 0.4 by 1 by 2 tips across at 0.2 and along at 0.5; a square with cosines in between."""
    found = cyclopean.limit(stack(1, (0.4, 1.0, 2.0)), push=(1.0, 0.0, 0.0), polar=4, mu=0.84)
    assert [low for _, low, _ in found.polar.table] == pytest.approx([0.2, 0.5, 0.2, 0.5], rel=1e-6)
    assert found.polar.towards in (0.0, 180.0)


def test_they_stand_in_cases_files_and_certificates(tmp_path) -> None:
    model = gravity_wall(
        1.0, 2.0, replace(LEFT, case="earth", seismic=(0.1, 0.0)), Water(side=180.0, head=1.0, case="flood")
    )
    write_model(tmp_path / "wall.json", model)
    again, said = read_model(tmp_path / "wall.json")
    assert said == ()
    assert wrenches(again) == pytest.approx(wrenches(model))
    result = cyclopean.check(again, factors={"flood": 0.0})
    assert result.loading.factors == {"self": 1.0, "earth": 1.0, "flood": 0.0}
    assert len(result.certificate["loads"]) == 2  # one on the slab
    assert cyclopean.verify(cyclopean.check(again).certificate, model=again).proved
    assert prepare(again, Settings(soil_height=1.0)).loading.fields[0].count("z = 1 m")


@pytest.mark.parametrize(
    ("row", "what"),
    [
        ({"soil": {"side": 90, "state": "active", "friction": 30, "unit_weight": 0}}, "unit_weight 0 N/m3"),
        ({"soil": {"side": 90, "state": "active", "friction": 30, "unit_weight": 18}}, "18 kN/m3 are 18000"),
        ({"soil": {"side": 90, "state": "active", "unit_weight": 18000}}, 'has no "friction"'),
        ({"soil": {"side": 90, "state": "lazy", "friction": 30, "unit_weight": 18000}}, "active, rest, passive"),
        ({"soil": {"side": 90, "state": "active", "friction": 30, "unit_weight": 18000, "slope": 31}}, "no wedge"),
        (
            {"soil": {"side": 90, "state": "passive", "friction": 30, "unit_weight": 18000, "wall_friction": 20}},
            "a third",
        ),
        ({"soil": {"side": 90, "state": "active", "friction": 30, "unit_weight": 18000, "foot": 9}}, "no face looks"),
        ({"water": {"side": 90, "head": 1, "unit_weight": 1000}}, "1000 kg/m3 are 9807"),
        ({"water": {"side": 90, "head": -9}}, "water on no face"),
        ({"fill": {"height": 2, "unit_weight": 18000, "spread": "wide"}}, "boussinesq"),
        ({"fill": {"height": 2, "unit_weight": 18000, "spread": 80}}, "boussinesq"),
    ],
)
def test_what_is_wrong_is_named(row, what, tmp_path, run) -> None:
    write_model(tmp_path / "model.json", stack(1))
    data = json.loads((tmp_path / "model.json").read_text()) | {"loads": [row]}
    (tmp_path / "model.json").write_text(json.dumps(data))
    status, out, err = run("check", "model.json", "--mu", 0.7)
    assert (status, out) == (2, "")
    assert what in err
    assert "model.json" in err


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (("check", "--surcharge", 10), "the model has no soil"),
        (("limit", "--surcharge", 10), "the model has no soil"),
        (("limit", "--live", "x=9"), "nothing lies below the road"),
        (("limit", "--live", "nobody"), "nobody"),
        (("limit", "--along", "0:9"), "nothing lies below the road"),
        (("limit", "--along", "2:1"), "--along"),
        (("limit", "--along", "0"), "two numbers"),
        (("limit", "--push", "0,0,1", "--polar", 4), "--polar"),
    ],
)
def test_what_has_no_place_is_refused(words, what, tmp_path, run) -> None:
    write_model(tmp_path / "model.json", stack(1))
    status, out, err = run(words[0], "model.json", *words[1:], "--mu", 0.7)
    assert (status, out) == (2, "")
    assert what in err
    with pytest.raises(InputError, match="rest has no seismic"):
        Earth(side=0.0, state="rest", friction=30.0, unit_weight=GAMMA, seismic=(0.1, 0.0))


def test_a_retaining_wall_is_what_was_asked_for() -> None:
    """By hand: a section 0.9 m wide below and leaning 0.15 in front, beds that fall, and K gamma h2 / 2 a metre."""
    model = retaining(3, 4, DryStone(inward=8.0), Soil(friction=30.0), density=2400.0, mu=0.65)
    fall, top = np.tan(np.radians(8.0)), model.actions[0].height
    (y0, z0), (y1, z1) = ((0.15 * h / (1.0 + 0.15 * fall), h / (1.0 + 0.15 * fall)) for h in (0.0, 1.2))
    ring = np.array([(y0, z0), (0.9, -0.9 * fall), (0.9, top), (y1, z1)])
    across = np.roll(ring, -1, 0)
    area = float(np.abs(ring[:, 0] @ across[:, 1] - ring[:, 1] @ across[:, 0])) / 2.0
    assert model.mass.volume[1:].sum() == pytest.approx(1.5 * area, rel=1e-9)
    assert top == pytest.approx(1.2 - 0.9 * fall)
    push = total(model)
    assert -push[1] == pytest.approx(1.5 * GAMMA * (top + 0.9 * fall) ** 2 / 6.0, rel=1e-9)
    assert abs(push[[0, 2]]).max() < 1e-9
    through = [b for b in model.blocks if b.id.endswith("through")]
    assert all(np.ptp(b.vertices[:, 1]) > 0.7 for b in through)
    assert len(through) == 5
    assert cyclopean.check(model, method="rbe", margins=False).verdict == "stable"
    flat = retaining(2, 4, DryStone(base=0.3, batter=0.0, inward=0.0, through=0), mu=0.65, density=2400.0)
    assert cyclopean.check(flat, method="rbe", margins=False).verdict == "unstable"


def test_a_bridge_stands_and_bears_alike_from_both_ends() -> None:
    model = bridge(10, BridgeShape(span=4.0, rise=1.3, spread="boussinesq"), density=2300.0, mu=0.7)
    assert cyclopean.check(model, method="rbe", margins=False).verdict == "stable"
    left, right = (cyclopean.limit(model, live_at=f"x={x}") for x in (-0.8, 0.8))
    assert left.value == pytest.approx(right.value, rel=2e-6)
    with pytest.raises(InputError, match="no road"):
        bridge(10, BridgeShape(width=1.0))
