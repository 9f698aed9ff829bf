"""Drawings that do not quite meet: what is told of them, and what counts when a gap is forgiven.

By hand: a cube of 1 m, lifted by 1 mm off a slab and turned about y by a milliradian, is between 0.5 mm and 1.5 mm
above it, and 0.0573 degrees askew.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cyclopean import verify, wall
from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly, Forgiven, detect
from cyclopean.errors import InputError
from imprecise import disturbed, far_from_limit, model_of, rolled, shaken, shifted, verdict
from laws import examples
from test_detection import box
from test_detection import wall as blocks_of_wall


def lifted_cube(by: float = 1e-3, lean: float = 1e-3) -> Assembly:
    cube = box("cube", (0, 0, 0), (1, 1, 1))
    middle = np.array([0.5, 0.5, 0.0])
    turn = np.array([[np.cos(lean), 0, np.sin(lean)], [0, 1, 0], [-np.sin(lean), 0, np.cos(lean)]])
    cube = replace(cube, vertices=(cube.vertices - middle) @ turn.T + middle + [0, 0, by])
    return Assembly((replace(box("slab", (-1, -1, -1), (2, 2, 0)), fixed=True), cube))


def test_a_lifted_cube_by_hand() -> None:
    found = detect(lifted_cube())
    assert not len(found.contacts)
    assert found.near is not None
    assert found.near.gap == pytest.approx([1.5e-3], rel=1e-3)
    assert found.near.overlap == pytest.approx([0.0])
    assert np.degrees(found.near.angle) == pytest.approx([0.0573], rel=1e-3)
    assert detect(lifted_cube(-1e-3)).near.overlap == pytest.approx([1.5e-3], rel=1e-3)


def test_what_is_told_is_what_closes_it() -> None:
    result = check(lifted_cube(), Settings(method="rbe"))
    assert result.verdict == "unstable"
    assert "Block 'slab' is 0.0015 m apart and 0.057 degrees askew" in result.reason
    assert "`tolerance` 0.00151,0.0573, or auto" in result.reason
    for tolerance in ((0.00151, 0.0573), "auto", 0.00151):
        closed = check(lifted_cube(), Settings(method="rbe", tolerance=tolerance))
        assert closed.verdict == "stable"
        assert any(line.startswith("1 of 1 contacts count although") for line in closed.warnings)
        assert "gaps up to 0.0015 m" in verify(closed.certificate).claim
    for tolerance in (0.0014, (0.00151, 0.05)):
        assert check(lifted_cube(), Settings(method="rbe", tolerance=tolerance)).verdict == "unstable"


def test_a_joint_that_leans_has_less_friction() -> None:
    """The cube's face leans by two degrees, and slides where friction reaches no further than that of the contact."""
    lean = np.radians(2.0)
    for mu, expected in ((np.tan(lean / 2.0) + 1e-3, "undecided"), (np.tan(2.0 * lean), "stable")):
        result = check(lifted_cube(0.0, lean), Settings(method="rbe", mu=mu, tolerance=(0.04, 3.0)))
        assert result.verdict == expected


def test_joints_that_are_drawn_open_stay_open() -> None:
    """Head joints of 2 % of a stone, beside beds that touch to the last digit."""
    model = blocks_of_wall(3, 3)
    apart = tuple(
        replace(b, vertices=b.vertices * [0.98, 1, 1] + [0.02 * b.vertices[:, 0].mean(), 0, 0]) for b in model.blocks
    )
    open_ = replace(model, blocks=(model.blocks[0], *apart[1:]))
    result = check(open_, Settings(method="rbe", tolerance="auto"))
    assert "tolerance" not in result.assumed
    assert len(result.contacts) == len(detect(open_).contacts)


def test_stones_on_a_thin_slab_are_no_supports() -> None:
    """The slab is thinner than what is forgiven; what stands on it stands on it."""
    slab = box("slab", (0, 0, 0), (4, 4, 0.01))
    stones = [box(f"s{k}", (k, 0, 0.01 + 0.001 * k), (k + 0.9, 1, 1)) for k in range(3)]
    result = check(Assembly((slab, *stones)), Settings(method="rbe", tolerance="auto"))
    assert result.fixed.tolist() == [True, False, False, False]
    assert result.assumed["tolerance"].startswith("0.002,")  # the slab's thickness is no gap
    assert result.verdict == "stable"


def test_feet_that_are_drawn_at_slightly_different_heights_are_all_supports() -> None:
    feet = [box(f"f{k}", (2 * k, 0, 1e-3 * k), (2 * k + 1, 1, 1)) for k in range(4)]
    assert check(Assembly(tuple(feet)), Settings(method="rbe")).verdict == "unstable"
    result = check(Assembly(tuple(feet)), Settings(method="rbe", tolerance="auto"))
    assert result.fixed.all()
    assert result.assumed["tolerance"].startswith("0.003,")


seeds = st.integers(0, 10_000)


@settings(max_examples=examples(40))
@given(seed=seeds, how=st.sampled_from([shaken, shifted, rolled]), digits=st.floats(-9.0, -2.6))
def test_a_disturbed_drawing_has_the_verdict_of_the_exact_one(seed, how, digits) -> None:
    rng = np.random.default_rng(seed)
    model = model_of(rng)
    exact = verdict(model, mu=0.6)
    drawn = disturbed(model, how, 10.0**digits, rng)
    assume(far_from_limit(model, 0.6, exact))
    assert verdict(drawn, mu=0.6, tolerance="auto") == exact


@settings(max_examples=examples(40))
@given(seed=seeds, factor=st.floats(1e-3, 1e3), turn=st.floats(0.0, 6.28))
def test_near_misses_scale_and_turn_with_the_model(seed, factor, turn) -> None:
    rng = np.random.default_rng(seed)
    model = disturbed(wall(2, 2), rolled, 3e-3, rng)
    c, s = np.cos(turn), np.sin(turn)
    spin = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved = replace(model, blocks=tuple(replace(b, vertices=factor * (b.vertices @ spin.T)) for b in model.blocks))
    one, two = detect(model).near, detect(moved).near
    assert sorted(zip(one.a.tolist(), one.b.tolist(), strict=True)) == sorted(
        zip(two.a.tolist(), two.b.tolist(), strict=True)
    )
    assert np.sort(two.distance) == pytest.approx(factor * np.sort(one.distance), rel=1e-6)
    gap = float(one.distance.max())
    count = [len(detect(m, Forgiven(k * gap, 0.1)).contacts) for m, k in ((model, 1.0), (moved, factor))]
    assert count[0] == count[1] > 0


@pytest.mark.parametrize(
    "value", [0.0, -1.0, float("nan"), float("inf"), "much", (0.1, 0.0), (0.1, 95.0), (1, 2, 3), True]
)
def test_tolerances_that_are_none_are_refused(value) -> None:
    with pytest.raises(InputError, match=r"tolerance.*expected a positive gap in metres, GAP,DEGREES, or auto"):
        Settings(tolerance=value)
