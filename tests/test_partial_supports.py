"""Supports that hold some directions and leave others free.

By hand: a cube on a roller (held down, and upright) rolls away at the least push along, and not at one across; held at
its centre it turns at any load off it, unless something is in the way. An arch on a roller has no thrust to stand by:
it falls, while a tie along makes it stand, whatever its springer may do across.

Turned by 90 degrees about z, x and y change places, and so must the directions that are held. What holds all six is a
support like any other.
"""

import copy
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupled_cases import prism
from cyclopean.analysis import Settings, check
from cyclopean.assembly import DIRECTIONS, Assembly, Block, Load, held_directions, supports
from cyclopean.design import arch, stack
from cyclopean.errors import InputError
from cyclopean.geometry import newell_normals
from cyclopean.io import read_model, write_model
from cyclopean.proof import seal, verify
from cyclopean.statics import Schur, equilibrium_system
from laws import examples

G = 9.80665
ROLLER = ("z", "rx", "ry", "rz")
CUBE = prism("b", [(0.1, 0), (1.1, 0), (1.1, 1), (0.1, 1)], 1.0)
METHODS = ("cra", "rbe")


def loaded(held: tuple[str, ...], force: tuple[float, float, float], point: tuple[float, float, float]) -> Assembly:
    return Assembly((replace(CUBE, held=held),), loads=(Load(0, np.array(force), np.array(point)),))


def verdict(model: Assembly, method: str = "rbe", **said: object) -> str:
    return check(model, Settings(method=method, **said)).verdict  # type: ignore[arg-type]


def sprung(held: tuple[str, ...], voussoirs: int = 9) -> Assembly:
    """An arch whose right springer is held in these directions only."""
    whole = arch(voussoirs)
    last = replace(whole.blocks[-1], fixed=None, held=held)
    return replace(whole, blocks=(*whole.blocks[:-1], last))


@pytest.mark.parametrize("method", METHODS)
def test_a_roller_by_hand(method: str) -> None:
    middle = (0.6, 0.5, 0.5)
    assert verdict(loaded(ROLLER, (0, 0, -1e3), middle), method) == "stable"
    assert verdict(loaded(ROLLER, (1.0, 0, 0), middle), method) == "unstable"
    assert verdict(loaded((*ROLLER, "x"), (1.0, 0, 0), middle), method) == "stable"
    assert verdict(loaded((*ROLLER, "x"), (0, 1.0, 0), middle), method) == "unstable"
    assert verdict(Assembly((replace(CUBE, held=ROLLER),)), method, tilt=(0.01, 0.0)) == "unstable"


@pytest.mark.parametrize("method", METHODS)
def test_a_hinge_by_hand(method: str) -> None:
    """Free to turn about y through its centre (0.6, 0.5, 0.5): a load there does nothing, one beside it turns it."""
    hinge = ("x", "y", "z", "rx", "rz")
    assert verdict(loaded(hinge, (3.0, 2.0, -1.0), (0.6, 0.5, 0.5)), method) == "stable"
    assert verdict(loaded(hinge, (0.0, 5.0, 0.0), (0.9, 0.5, 0.5)), method) == "stable"  # turns about z: held
    assert verdict(loaded(hinge, (0.0, 0.0, -1.0), (0.9, 0.5, 0.5)), method) == "unstable"


@pytest.mark.parametrize("method", METHODS)
def test_what_touches_and_bears_nothing_stands(method: str) -> None:
    """The hinge bears all of the weight, and a stop beside it is only touched; so is all where there is no gravity."""
    stop = replace(prism("stop", [(1.1, 0), (2.1, 0), (2.1, 1), (1.1, 1)], 1.0), fixed=True)
    hinged = replace(CUBE, held=("x", "y", "z", "rx", "rz"))
    for blocks, gravity in (((hinged, stop), (0.0, 0.0, -G)), ((CUBE, stop), (0.0, 0.0, 0.0))):
        result = check(Assembly(blocks), Settings(method=method, gravity=gravity))
        assert result.verdict == "stable", result.reason
        assert not result.force.any()


def test_a_hinge_that_leans_on_a_stop() -> None:
    """A load at the right turns the cube down on a fixed block there; at the left it lifts off."""
    stop = replace(prism("stop", [(0.8, -0.5), (1.1, -0.5), (1.1, 0.0), (0.8, 0.0)], 1.0), fixed=True)
    for x, word in ((1.05, "stable"), (0.15, "unstable")):
        model = loaded(("x", "y", "z", "rx", "rz"), (0.0, 0.0, -100.0), (x, 0.5, 0.5))
        result = check(replace(model, blocks=(*model.blocks, stop)), Settings(method="rbe", mu=0.0))
        assert result.verdict == word
        assert result.partly_held == ("b",)
        if word == "stable":  # about y: 100 N x 0.45 m = N x lever of the centre of pressure, between 0.2 and 0.5
            assert result.force is not None
            pressed = result.contacts.point[:, 0] - 0.6
            assert float(result.force[:, 0] @ pressed) == pytest.approx(45.0, rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_an_arch_on_a_roller_falls_and_a_tie_holds_it(method: str) -> None:
    assert verdict(sprung(("y", *ROLLER)), method) == "unstable"
    assert verdict(sprung(("x", *ROLLER)), method) == "stable"
    assert verdict(sprung(("x", "y", "z")), method) == "unstable"  # the springer turns about its centre


@settings(max_examples=examples(6), deadline=None)
@given(st.integers(0, 63), st.floats(-20.0, 20.0), st.floats(0.0, 360.0), st.sampled_from(METHODS))
def test_a_quarter_turn_changes_x_and_y(mask: int, tilt: float, azimuth: float, method: str) -> None:
    """What stands does so seen from another side as well; directions turn with it."""
    held = tuple(name for k, name in enumerate(DIRECTIONS) if mask >> k & 1)
    swap = dict(zip(DIRECTIONS, ("y", "x", "z", "ry", "rx", "rz"), strict=True))
    base = replace(prism("base", [(0, -1), (1, -1), (1, 0), (0, 0)], 1.0), fixed=True)
    model = Assembly((base, replace(CUBE, held=held)))
    turned = tuple(
        replace(b, vertices=b.vertices @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]), held=[swap[x] for x in b.held])
        for b in model.blocks
    )
    one = verdict(model, method, tilt=(tilt, azimuth))
    two = verdict(Assembly(turned), method, tilt=(tilt, azimuth + 90.0))
    assert "undecided" in (one, two) or one == two


@settings(max_examples=examples(6), deadline=None)
@given(st.integers(0, 3), st.floats(0.0, 40.0), st.floats(0.0, 360.0), st.sampled_from(METHODS))
def test_held_in_all_six_is_fixed(block: int, tilt: float, azimuth: float, method: str) -> None:
    model = stack(3, offset=0.2)
    rows = [
        replace(model, blocks=tuple(replace(b, **change) if k == block else b for k, b in enumerate(model.blocks)))
        for change in ({"fixed": True}, {"held": DIRECTIONS})
    ]
    fixed, held = (check(m, Settings(method=method, tilt=(tilt, azimuth))) for m in rows)
    assert fixed.verdict == held.verdict
    assert fixed.certificate == held.certificate


@settings(max_examples=examples(12), deadline=None)
@given(st.integers(0, 62), st.integers(0, 62), st.floats(0.0, 40.0), st.floats(0.0, 360.0))
def test_more_support_never_takes_a_stable_verdict_away(few: int, more: int, tilt: float, azimuth: float) -> None:
    """Exact for equilibrium alone: what balances with fewer rows to balance balances too."""
    words = []
    for mask in (few, few | more):
        held = tuple(name for k, name in enumerate(DIRECTIONS) if mask >> k & 1)
        base = replace(prism("base", [(0, -1), (1, -1), (1, 0), (0, 0)], 1.0), fixed=True)
        words.append(verdict(Assembly((base, replace(CUBE, held=held))), tilt=(tilt, azimuth)))
    assert words != ["stable", "unstable"]


def test_rows_that_are_held_are_zero_and_s_stays_regular() -> None:
    model = sprung(ROLLER)
    system = equilibrium_system(model, model.contacts.with_mu(0.7), supports(model)[0], np.array([0, 0, -G]), 2400.0)
    still = held_directions(model)[system.free].ravel()
    assert still.sum() == 4
    assert not abs(system.A[still]).sum()
    assert not system.p[still].any()
    rhs = np.where(still, 0.0, 1.0)
    D = np.broadcast_to(np.eye(3), (system.points, 3, 3))
    dense = (system.A @ system.A.T).toarray() + np.diag(still.astype(float)) + 1e-6 * np.eye(len(still))
    found = Schur(system).factor(D, 1e-6).solve(rhs)
    assert found == pytest.approx(np.linalg.solve(dense, rhs), rel=1e-6, abs=1e-9)
    assert not found[still].any()


def test_partial_supports_alone_are_what_the_file_says_of_supports() -> None:
    """Else the lowest block, on its roller, would be held altogether."""
    model = Assembly((replace(CUBE, held=ROLLER),))
    fixed, rule = supports(model)
    assert (fixed.tolist(), rule) == ([False], "file")


# ---------------------------------------------------------------------------------------------------------------------
# The checker: what it must refuse.


def resealed(certificate: dict, change) -> str:
    """Apply a change, seal again, and say whether it is still proved."""
    data = copy.deepcopy(certificate)
    change(data)
    data["seal"] = seal(data)
    report = verify(data)
    return "proved" if report.proved else report.reason


def block(data: dict, name: str) -> dict:
    return next(row for row in data["blocks"] if row["id"] == name)


@pytest.mark.parametrize("method", METHODS)
def test_a_state_leans_on_what_is_held(method: str) -> None:
    found = check(sprung(("x", *ROLLER)), Settings(method=method)).certificate
    assert found is not None
    assert resealed(found, lambda d: None) == "proved"
    assert "1 of 11 blocks partly held" in verify(found).claim
    name = "springer-right"
    free = resealed(found, lambda d: block(d, name).update(held=["y", *ROLLER]))
    assert ("balance" if method == "rbe" else "support holds") in free
    assert "proved" != resealed(found, lambda d: block(d, name).pop("held"))
    for wrong in ([], ["z", "x"], ["x", "x"], ["w"], "x", list(DIRECTIONS), [1]):
        assert "held" in resealed(found, lambda d, wrong=wrong: block(d, name).update(held=wrong))
    assert "held" in resealed(found, lambda d: block(d, "springer-left").update(held=["x"]))


def test_a_mechanism_moves_nothing_that_is_held() -> None:
    found = check(sprung(("y", *ROLLER)), Settings(method="rbe")).certificate
    assert found is not None
    name = "springer-right"
    row = found["mechanism"][name]
    assert [x != 0.0 for x in row] == [True, False, False, False, False, False]
    for k in (1, 2, 3, 4, 5):
        moved = [*row[:k], 1e-300 if k > 5 else 1e-30 * row[0], *row[k + 1 :]]
        assert "support holds" in resealed(found, lambda d, moved=moved: d["mechanism"].update({name: moved}))
    assert "support holds" in resealed(found, lambda d: block(d, name).update(held=["x", *ROLLER]))


def test_a_coupled_state_displaces_nothing_that_is_held() -> None:
    found = check(sprung(("x", *ROLLER)), Settings(method="cra")).certificate
    assert found is not None
    assert found["kind"] == "cra-state"
    row = [1e-12, *found["mechanism"]["springer-right"][1:]]
    assert "support holds" in resealed(found, lambda d: d["mechanism"].update({"springer-right": row}))


def test_what_a_support_bears_makes_no_room_for_forces_out_of_balance() -> None:
    """A roller that weighs a million tonnes would make 1e-9 of the total weight a kilogram: it is no part. Without
    friction nothing can be corrected.
    """
    heavy = replace(prism("heavy", [(5, 0), (6, 0), (6, 1), (5, 1)], 1.0), held=("x", "y", *ROLLER)[1:], density=1e9)
    base = replace(prism("base", [(0, -1), (1.2, -1), (1.2, 0), (0, 0)], 1.0), fixed=True)
    found = check(Assembly((base, CUBE, heavy)), Settings(method="rbe")).certificate
    assert found is not None

    def smooth(share: float):
        def change(data: dict) -> None:
            area = float(newell_normals(np.array(data["contacts"][0]["polygon"]), np.array([0, 4]))[0, 2])
            data["contacts"][0]["mu"] = 0.0
            data["forces"][:4] = [[(1 + share) * row[2] / area] for row in data["forces"][:4]]

        return change

    assert resealed(found, smooth(0.0)) == "proved"
    assert "forces do not balance" in resealed(found, smooth(1e-8))


def test_a_hinged_mechanism_is_exact() -> None:
    """The centre of mass of a block with crooked numbers stays put to the last bit, however heavy the block is."""
    crooked = replace(prism("b", [(0.1, 0.3), (1.7, 0.1), (1.3, 1.1), (0.2, 0.9)], 0.7), held=("x", "y", "z"))
    centre = Assembly((crooked,)).mass.centroid[0]
    load = Load(0, np.array([0.3, -0.1, 1e-6]), centre + np.array([0.1, 0.2, -0.3]))
    crooked = replace(crooked, density=1e5)
    found = check(Assembly((crooked,), loads=(load,)), Settings(method="rbe")).certificate
    assert found is not None
    assert found["kind"] == "rbe-mechanism"
    back = [-x for x in found["mechanism"]["b"]]
    assert "no work" in resealed(found, lambda d: d["mechanism"].update({"b": back}))


# ---------------------------------------------------------------------------------------------------------------------
# Files.


def test_supports_in_a_file(tmp_path) -> None:
    path = tmp_path / "m.json"
    write_model(path, sprung(("x", "rz")))
    data = json.loads(path.read_text())
    assert data["supports"] == [{"block": "springer-right", "held": ["x", "rz"]}]
    model, warnings = read_model(path)
    assert warnings == ()
    assert model.blocks[-1].held == ("x", "rz")
    for rows, line in (
        ([{"block": "nobody", "held": ["x"]}], "block 'nobody' is not in the model"),
        ([{"block": "v01", "held": ["up"]}], "held names 'up'"),
        ([{"block": "v01", "held": []}], "held names nothing"),
        ([{"block": "v01"}], 'has no "held"'),
        ([{"block": "v01", "held": ["x"]}] * 2, "stands twice"),
    ):
        path.write_text(json.dumps(data | {"supports": rows}))
        with pytest.raises(InputError, match=line):
            read_model(path)


def test_unknown_directions_are_refused() -> None:
    with pytest.raises(InputError, match="held names 'w'"):
        Block("b", CUBE.vertices, CUBE.faces, held=("w",))


def test_the_command_says_what_is_partly_held(run, tmp_path) -> None:
    write_model(tmp_path / "m.json", sprung(("x", *ROLLER)))
    status, out, _ = run("check", "m.json", "--report", "r.html", "--json", "r.json")
    assert status == 0
    assert "partly: springer-right" in out
    assert json.loads((tmp_path / "r.json").read_text())["partly_held"] == ["springer-right"]
    assert "Partly held" in (tmp_path / "r.html").read_text()
